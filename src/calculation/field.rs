//! Errors of fields, and the ranges of their numbers.

use serde::Serialize;
use toothwave_solver::Parameter;
use toothwave_solver::violation::{Misfit, Modified, Range, Violation};
use utoipa::ToSchema;

/// Error of a field.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FieldError {
    /// JSON pointer (RFC 6901) to the field.
    pub pointer: String,
    /// Kind of error, as a stable word.
    pub code: FieldCode,
    /// Message: what is wrong and what to do.
    pub detail: String,
    /// Value of the field, if it is a number.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub value: Option<f64>,
    /// The violated limit. For a number of teeth or entries, the nearest valid number.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub limit: Option<f64>,
}

/// Kinds of field errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldCode {
    /// The field is unknown.
    UnknownField,
    /// A required field is missing.
    MissingField,
    /// The field is given twice.
    DuplicateField,
    /// The value has the wrong type.
    WrongType,
    /// The word is not a valid choice.
    UnknownChoice,
    /// The number is too large for a double.
    NumberTooLarge,
    /// Only one of two fields may be given.
    ConflictingFields,
    /// The value is out of its range.
    OutOfRange,
    /// The list must be empty or have one entry for each item.
    WrongLength,
    /// No free field changes a quantity that is an objective or violates its limit.
    Unaffected,
    /// The semi-major axis does not exceed the semi-minor axis.
    CamNotElongated,
    /// The wave generator is too small for its stroke.
    CamTooSmall,
    /// The numbers of teeth of carrier and ring do not differ by one for each lobe.
    ToothDifference,
    /// The number of installed teeth does not divide the theoretical number (`count`).
    InstalledNoDivisor,
    /// A groove is not wider than its ball.
    GrooveTooTight,
    /// The flat is as long as the tooth's diameter, or longer.
    FlatTooLong,
    /// Neighbouring teeth touch somewhere on their path.
    TeethTouch,
    /// The ring's tips reach the wave generator.
    NoCarrierAnnulus,
    /// The bore removes the whole flank.
    BoreLeavesNoFlank,
    /// With `projection` this clearance would load a tooth instead of relieving it.
    ClearanceNotMonotone,
    /// The ring's outer radius does not exceed the largest radius of its tooth spaces, including the tip relief.
    RingWithoutRim,
    /// The carrier's inner radius does not exceed the cam's largest radius.
    CarrierMeetsCam,
    /// The carrier's outer radius reaches the ring's tips.
    CarrierMeetsRing,
    /// The carrier's outer radius does not exceed its inner radius.
    CarrierWithoutWall,
    /// The slots overlap up to the carrier's outer radius.
    SlotsTakeCarrier,
    /// The wave generator's bore cuts through its outline.
    BoreTakesCam,
    /// The wave generator's clearance gives its outline a cusp.
    ClearanceTakesCam,
    /// The teeth's clearance is as large as their radius, or larger.
    ClearanceTakesTooth,
    /// The modification removes the whole outline of a part.
    ModificationLeavesNothing,
    /// There are more states than `max_states`.
    TooManyStates,
    /// There are more profile points than `max_profile_points`.
    TooManyPoints,
    /// There are more variants than `max_study_variants`, or more bytes than `max_study_bytes`.
    TooManyVariants,
}

/// Converts a violation to the error of its field.
impl From<&Violation> for FieldError {
    fn from(violation: &Violation) -> Self {
        use Parameter::{InstalledTeeth, RingTeeth, SemiMajor, TipRadius, ToothRadius};
        let (code, parameter, value, limit) = match *violation {
            Violation::OutOfRange { parameter, value, limit } => (FieldCode::OutOfRange, parameter, value, limit),
            Violation::CamNotElongated { semi_major_mm, semi_minor_mm } => {
                (FieldCode::CamNotElongated, SemiMajor, semi_major_mm, semi_minor_mm)
            }
            Violation::CamTooSmall { parameter, radius_mm, least_mm } => {
                (FieldCode::CamTooSmall, parameter, radius_mm, least_mm)
            }
            Violation::GrooveTooTight { contact, groove_radius_mm, tooth_radius_mm } => {
                (FieldCode::GrooveTooTight, Parameter::GrooveRadius(contact), groove_radius_mm, tooth_radius_mm)
            }
            Violation::FlatTooLong { flat_length_mm, tooth_diameter_mm } => {
                (FieldCode::FlatTooLong, Parameter::FlatLength, flat_length_mm, tooth_diameter_mm)
            }
            Violation::ToothDifference { ring_teeth, instead, .. } => {
                (FieldCode::ToothDifference, RingTeeth, ring_teeth as f64, instead.nearest_to(ring_teeth) as f64)
            }
            Violation::InstalledNoDivisor { installed, instead, .. } => {
                (FieldCode::InstalledNoDivisor, InstalledTeeth, installed as f64, instead.nearest_to(installed) as f64)
            }
            Violation::TeethTouch { tooth_diameter_mm, touching_radius_mm, .. } => {
                (FieldCode::TeethTouch, ToothRadius, 0.5 * tooth_diameter_mm, touching_radius_mm)
            }
            Violation::NoCarrierAnnulus { parameter, value_mm, limit_mm, .. } => {
                (FieldCode::NoCarrierAnnulus, parameter, value_mm, limit_mm)
            }
            Violation::ClearanceNotMonotone { contact, clearance_um } => {
                (FieldCode::ClearanceNotMonotone, Parameter::PartClearance(contact.mate()), clearance_um, 0.0)
            }
            Violation::BoreLeavesNoFlank { tip_radius_mm, root_radius_mm } => {
                (FieldCode::BoreLeavesNoFlank, TipRadius, tip_radius_mm, root_radius_mm)
            }
            Violation::NeedsVirtualWork { parameter } => return Self::conflict(violation, parameter),
            Violation::TipReliefBeyondFlank { start_deg, engagement_start_deg } => {
                let parameter = Parameter::Modification(Modified::TipReliefStart);
                (FieldCode::OutOfRange, parameter, start_deg, engagement_start_deg)
            }
            Violation::ModificationLeavesNothing { modified, value, limit } => {
                return FieldError {
                    pointer: Parameter::Modification(modified).to_string(),
                    code: FieldCode::ModificationLeavesNothing,
                    detail: violation.to_string(),
                    value: Some(value),
                    limit,
                };
            }
            Violation::DeviationCount { listed, count, items } => {
                (FieldCode::WrongLength, Parameter::DeviationList(listed), count as f64, items as f64)
            }
            Violation::DutyShares { sum } => (FieldCode::OutOfRange, Parameter::DutyPoints, sum, 1.0),
            Violation::NoBearingLife => return Self::conflict(violation, Parameter::BearingLoadRating),
            Violation::LawOfOtherTeeth => return Self::conflict(violation, Parameter::Law),
            Violation::PartDoesNotFit { misfit, value, limit } => {
                let code = match misfit {
                    Misfit::RingWithoutRim => FieldCode::RingWithoutRim,
                    Misfit::CarrierMeetsCam => FieldCode::CarrierMeetsCam,
                    Misfit::CarrierMeetsRing => FieldCode::CarrierMeetsRing,
                    Misfit::CarrierWithoutWall => FieldCode::CarrierWithoutWall,
                    Misfit::SlotsTakeCarrier => FieldCode::SlotsTakeCarrier,
                    Misfit::BoreTakesCam => FieldCode::BoreTakesCam,
                    Misfit::ClearanceTakesCam => FieldCode::ClearanceTakesCam,
                    Misfit::ClearanceTakesTooth => FieldCode::ClearanceTakesTooth,
                };
                (code, misfit.parameter(), value, limit)
            }
        };
        FieldError {
            pointer: parameter.to_string(),
            code,
            detail: violation.to_string(),
            value: Some(value),
            limit: Some(limit),
        }
    }
}

impl FieldError {
    /// Makes the error of a violation about a choice, which has no number.
    fn conflict(violation: &Violation, parameter: Parameter) -> Self {
        Self {
            pointer: parameter.to_string(),
            code: FieldCode::ConflictingFields,
            detail: violation.to_string(),
            value: None,
            limit: None,
        }
    }
}

/// Returns the pointer and the range of each number of the design document, of a list's entries those of the first.
pub fn ranges() -> impl Iterator<Item = (String, Range)> {
    let with_range = |parameter: Parameter| (parameter.to_string(), parameter.range());
    Parameter::all().into_iter().map(with_range).filter(|(_, range)| range.low.is_finite())
}
