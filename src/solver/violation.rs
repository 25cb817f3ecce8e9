//! Reasons why a drive, a load or a request is impossible.

mod parameter;

pub use parameter::{
    Listed, MAX_DUTY_POINTS, MAX_LOBES, MAX_SAMPLES, MAX_TEETH, Modified, OfDutyPoint, Parameter, Range,
    SHARES_TOLERANCE,
};

// With the kinds that only documents have, so that the API has one list.
/// Kinds of field errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
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

/// Reason why a drive, a load or a request is impossible. Its text says what to change.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// Kind of error.
    pub code: FieldCode,
    /// The parameter at fault.
    pub parameter: Parameter,
    /// Its value, given or by default, if it is a number.
    pub value: Option<f64>,
    /// The violated limit, if it is a number. For a number of teeth or entries, the nearest valid number.
    pub limit: Option<f64>,
    /// What is wrong and what to do. `None` for a range: a long list can have many, of which few are ever written.
    pub detail: Option<String>,
}

impl Violation {
    /// Makes the violation of a limit.
    pub fn new(code: FieldCode, parameter: Parameter, value: f64, limit: f64, detail: String) -> Self {
        Self { code, parameter, value: Some(value), limit: Some(limit), detail: Some(detail) }
    }

    /// Makes the violation of a parameter's range, of which `limit` is the violated end.
    pub const fn out_of_range(parameter: Parameter, value: f64, limit: f64) -> Self {
        Self { code: FieldCode::OutOfRange, parameter, value: Some(value), limit: Some(limit), detail: None }
    }

    /// Makes the violation of a choice that others exclude.
    pub fn conflict(parameter: Parameter, detail: &str) -> Self {
        Self { code: FieldCode::ConflictingFields, parameter, value: None, limit: None, detail: Some(detail.into()) }
    }

    /// Makes the violation of a parameter that `projection` does not support.
    pub fn needs_virtual_work(parameter: Parameter) -> Self {
        Self::conflict(parameter, "`projection` does not take this: choose `virtual_work`, or leave it out")
    }

    /// Makes the violation of a modification that leaves nothing of a part's outline. The limit is missing if it is not
    /// a single number.
    pub fn modification_leaves_nothing(modified: Modified, value: f64, limit: Option<f64>) -> Self {
        let choice = match limit {
            Some(limit) => format!("a value between {limit:?} and zero"),
            None => "a value nearer to zero".into(),
        };
        let detail = format!("modified by {value:?} a part has no outline left that could be made: choose {choice}");
        let (code, parameter) = (FieldCode::ModificationLeavesNothing, Parameter::Modification(modified));
        Self { code, parameter, value: Some(value), limit, detail: Some(detail) }
    }

    /// Makes the violation of a ring whose outer radius does not exceed that of its tooth spaces.
    pub fn ring_without_rim(outer_mm: f64, root_mm: f64) -> Self {
        let detail = format!(
            "an outer radius of {outer_mm:?} mm leaves the ring no rim: choose more than its root radius of {root_mm:?} mm"
        );
        Self::new(FieldCode::RingWithoutRim, Parameter::RingOuterRadius, outer_mm, root_mm, detail)
    }
}

/// Formats a number as a person would write it.
fn readable(value: f64) -> String {
    if value == 0.0 || (1e-3..1e7).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

impl std::fmt::Display for Violation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(detail) = &self.detail {
            return f.write_str(detail);
        }
        let Range { low, high, closed, unit } = self.parameter.range();
        let bounds = if closed { "from" } else { "strictly between" };
        let joint = if closed { "to" } else { "and" };
        let [value, low, high] = [self.value.unwrap_or(f64::NAN), low, high].map(readable);
        write!(f, "{value} is out of range: choose a value {bounds} {low} {joint} {high}")?;
        if unit.is_empty() { Ok(()) } else { write!(f, " {unit}") }
    }
}
