//! All problem, field and finding codes. A `match` without a wildcard builds each list, so no new code can be missing.

use serde::Serialize;
use serde_json::Value;
use toothwave::http::problem::ProblemCode;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::findings::FindingCode;

/// Lists the values of an enum from first to last.
macro_rules! all {
    ($type:ident: $first:ident $(, $from:ident => $to:ident)* ; $last:ident) => {{
        let next = |code: $type| match code {
            $($type::$from => Some($type::$to),)*
            $type::$last => None,
        };
        std::iter::successors(Some($type::$first), |&code| next(code)).collect::<Vec<_>>()
    }};
}

pub(crate) fn problem_codes() -> Vec<ProblemCode> {
    all!(ProblemCode: MalformedJson,
        MalformedJson => BrokenBody,
        BrokenBody => InvalidQuery,
        InvalidQuery => Unauthorized,
        Unauthorized => NotFound,
        NotFound => MethodNotAllowed,
        MethodNotAllowed => NotAcceptable,
        NotAcceptable => RequestTimeout,
        RequestTimeout => BodyTooLarge,
        BodyTooLarge => UnsupportedMediaType,
        UnsupportedMediaType => MisdirectedRequest,
        MisdirectedRequest => InvalidDocument,
        InvalidDocument => ImpossibleDesign,
        ImpossibleDesign => NoToothInMesh,
        NoToothInMesh => ComplianceNotPositive,
        ComplianceNotPositive => Interference,
        Interference => TooManyStates,
        TooManyStates => TooManyPoints,
        TooManyPoints => TooManyVariants,
        TooManyVariants => QueueFull,
        QueueFull => DeadlineExceeded,
        DeadlineExceeded => ShuttingDown,
        ShuttingDown => TooManyConnections,
        TooManyConnections => TooManyUnreadBytes,
        TooManyUnreadBytes => StudiesOff,
        StudiesOff => StoreUnavailable,
        StoreUnavailable => InternalError;
        InternalError)
}

pub(crate) fn field_codes() -> Vec<FieldCode> {
    all!(FieldCode: UnknownField,
        UnknownField => MissingField,
        MissingField => DuplicateField,
        DuplicateField => WrongType,
        WrongType => UnknownChoice,
        UnknownChoice => NumberTooLarge,
        NumberTooLarge => ConflictingFields,
        ConflictingFields => OutOfRange,
        OutOfRange => WrongLength,
        WrongLength => Unaffected,
        Unaffected => CamNotElongated,
        CamNotElongated => CamTooSmall,
        CamTooSmall => ToothDifference,
        ToothDifference => InstalledNoDivisor,
        InstalledNoDivisor => GrooveTooTight,
        GrooveTooTight => FlatTooLong,
        FlatTooLong => TeethTouch,
        TeethTouch => NoCarrierAnnulus,
        NoCarrierAnnulus => BoreLeavesNoFlank,
        BoreLeavesNoFlank => ClearanceNotMonotone,
        ClearanceNotMonotone => RingWithoutRim,
        RingWithoutRim => CarrierMeetsCam,
        CarrierMeetsCam => CarrierMeetsRing,
        CarrierMeetsRing => CarrierWithoutWall,
        CarrierWithoutWall => SlotsTakeCarrier,
        SlotsTakeCarrier => BoreTakesCam,
        BoreTakesCam => ClearanceTakesCam,
        ClearanceTakesCam => ClearanceTakesTooth,
        ClearanceTakesTooth => ModificationLeavesNothing,
        ModificationLeavesNothing => TooManyStates,
        TooManyStates => TooManyPoints,
        TooManyPoints => TooManyVariants;
        TooManyVariants)
}

pub(crate) fn finding_codes() -> Vec<FindingCode> {
    all!(FindingCode: Undercut,
        Undercut => BoreShortensFlank,
        BoreShortensFlank => BoreWithoutEffect,
        BoreWithoutEffect => FewTeethInMesh,
        FewTeethInMesh => ThinSlotWall,
        ThinSlotWall => ToothBeyondCarrier,
        ToothBeyondCarrier => SteepRingFlank,
        SteepRingFlank => LinearLawTooStiff,
        LinearLawTooStiff => HollowWaveGenerator,
        HollowWaveGenerator => FlatCutsTheContact,
        FlatCutsTheContact => ContactBeyondGroove,
        ContactBeyondGroove => GrooveNotDrawn,
        GrooveNotDrawn => ProjectionOnSteepFlank,
        ProjectionOnSteepFlank => ProjectionWithGap,
        ProjectionWithGap => SlenderFingers,
        SlenderFingers => SoftRim,
        SoftRim => PalmgrenBeyondSteel,
        PalmgrenBeyondSteel => JohnsonBeyondHalfWidth,
        JohnsonBeyondHalfWidth => WindUpBeyondModel,
        WindUpBeyondModel => NegativeBacklash,
        NegativeBacklash => ToothLeavesSlot,
        ToothLeavesSlot => ThinWallAsMade,
        ThinWallAsMade => ClearanceUndercutsRing,
        ClearanceUndercutsRing => FrictionBeyondMeasured,
        FrictionBeyondMeasured => EfficiencyUncertain,
        EfficiencyUncertain => BearingLoadAboveHalfRating,
        BearingLoadAboveHalfRating => FingerOverstressed,
        FingerOverstressed => StressAboveAllowable,
        StressAboveAllowable => StressAboveFatigueLimit,
        StressAboveFatigueLimit => DeprecatedField,
        DeprecatedField => SetBackTwice;
        SetBackTwice)
}

/// Returns the words of codes, as documents spell them, in alphabetical order.
pub(crate) fn words(codes: &[impl Serialize]) -> Vec<String> {
    let word = |code| serde_json::to_value(code).unwrap().as_str().unwrap().to_owned();
    let mut words: Vec<_> = codes.iter().map(word).collect();
    words.sort_unstable();
    words
}

/// Returns the `code`s among these objects, each once, in alphabetical order.
pub(crate) fn codes_of<'a>(objects: impl IntoIterator<Item = &'a Value>) -> Vec<String> {
    let mut codes: Vec<_> = objects.into_iter().map(|object| object["code"].as_str().unwrap().to_owned()).collect();
    codes.sort_unstable();
    codes.dedup();
    codes
}

#[test]
fn every_problem_has_status_and_unique_type() {
    use toothwave::http::problem::Problem;
    let expected = |code| match code {
        ProblemCode::MalformedJson | ProblemCode::BrokenBody | ProblemCode::InvalidQuery => 400,
        ProblemCode::Unauthorized => 401,
        ProblemCode::NotFound => 404,
        ProblemCode::MethodNotAllowed => 405,
        ProblemCode::NotAcceptable => 406,
        ProblemCode::RequestTimeout => 408,
        ProblemCode::BodyTooLarge => 413,
        ProblemCode::UnsupportedMediaType => 415,
        ProblemCode::MisdirectedRequest => 421,
        ProblemCode::InvalidDocument
        | ProblemCode::ImpossibleDesign
        | ProblemCode::NoToothInMesh
        | ProblemCode::ComplianceNotPositive
        | ProblemCode::Interference
        | ProblemCode::TooManyStates
        | ProblemCode::TooManyPoints
        | ProblemCode::TooManyVariants => 422,
        ProblemCode::QueueFull
        | ProblemCode::DeadlineExceeded
        | ProblemCode::ShuttingDown
        | ProblemCode::TooManyConnections
        | ProblemCode::TooManyUnreadBytes
        | ProblemCode::StoreUnavailable => 503,
        ProblemCode::StudiesOff => 501,
        ProblemCode::InternalError => 500,
    };
    let mut types: Vec<_> = problem_codes()
        .into_iter()
        .map(|code| {
            let problem = Problem::new(code, "what happened");
            assert_eq!((problem.status, code.status().as_u16()), (expected(code), expected(code)), "{code:?}");
            problem.kind
        })
        .collect();
    types.sort_unstable();
    types.dedup();
    assert_eq!(types.len(), problem_codes().len());
}
