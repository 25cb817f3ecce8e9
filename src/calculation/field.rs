//! Fields of the design document: their pointers, and their kinds of error.

use serde::Serialize;
use toothwave_solver::violation::{Listed, Misfit, Modified, OfDutyPoint, Range, Violation};
use toothwave_solver::{Contact, Parameter};
use utoipa::ToSchema;

use crate::json::word;

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
                    pointer: pointer(Parameter::Modification(modified)),
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
            pointer: pointer(parameter),
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
            pointer: pointer(parameter),
            code: FieldCode::ConflictingFields,
            detail: violation.to_string(),
            value: None,
            limit: None,
        }
    }
}

/// Returns the pointer and the range of each number of the design document, of a list's entries those of the first.
pub fn ranges() -> impl Iterator<Item = (String, Range)> {
    let with_range = |parameter: Parameter| (pointer(parameter), parameter.range());
    Parameter::all().into_iter().map(with_range).filter(|(_, range)| range.low.is_finite())
}

/// Returns the JSON pointer of a parameter in the design document.
pub fn pointer(parameter: Parameter) -> String {
    match parameter {
        Parameter::SemiMajor => "/drive/wave_generator/semi_major_mm".into(),
        Parameter::SemiMinor => "/drive/wave_generator/semi_minor_mm".into(),
        Parameter::EccentricRadius => "/drive/wave_generator/radius_mm".into(),
        Parameter::Eccentricity => "/drive/wave_generator/eccentricity_mm".into(),
        Parameter::Lobes | Parameter::HarmonicLobes => "/drive/wave_generator/lobes".into(),
        Parameter::MeanRadius => "/drive/wave_generator/mean_radius_mm".into(),
        Parameter::MeanPathRadius => "/drive/wave_generator/mean_path_radius_mm".into(),
        Parameter::Amplitude => "/drive/wave_generator/amplitude_mm".into(),
        Parameter::ToothCount => "/drive/teeth/count".into(),
        Parameter::InstalledTeeth => "/drive/teeth/installed".into(),
        Parameter::ToothRadius => "/drive/teeth/radius_mm".into(),
        Parameter::ToothWidth => "/drive/teeth/width_mm".into(),
        Parameter::GrooveRadius(contact) => format!("/drive/teeth/groove_radius_mm/{}", contact_name(contact)),
        Parameter::FlatLength => "/drive/teeth/flat_length_mm".into(),
        Parameter::RingTeeth => "/drive/ring/teeth".into(),
        Parameter::TipRadius => "/drive/ring/tip_radius_mm".into(),
        Parameter::YoungsModulus(part) => format!("/materials/{}/youngs_modulus_gpa", word(&part)),
        Parameter::PoissonsRatio(part) => format!("/materials/{}/poissons_ratio", word(&part)),
        Parameter::InputTorque => "/load/input_torque_nm".into(),
        Parameter::OutputTorque => "/load/output_torque_nm".into(),
        Parameter::Stiffness(contact) => format!("/model/stiffness/{}_n_per_mm", contact_name(contact)),
        Parameter::Law => "/model/stiffness/law".into(),
        Parameter::RingTeethBend | Parameter::WaveGeneratorMoves | Parameter::CornerContact => {
            "/model/refinements".into()
        }
        Parameter::Depth(contact) => format!("/model/stiffness/depth_mm/{}", contact_name(contact)),
        Parameter::SeriesCompliance(contact) => {
            format!("/model/series_compliance_mm_per_n/{}", contact_name(contact))
        }
        Parameter::Clearance(contact) => format!("/model/clearance/{}_um", contact_name(contact)),
        Parameter::Modification(modified) => format!("/modification/{}", modified_name(modified)),
        Parameter::Deviations => "/deviations".into(),
        Parameter::DeviationList(listed) => format!("/deviations/{}", listed_name(listed)),
        Parameter::Deviation(listed, entry) => format!("/deviations/{}/{entry}", listed_name(listed)),
        Parameter::RunoutAmount(contact) => format!("/deviations/{}_runout/amount_um", contact_name(contact)),
        Parameter::RunoutAngle(contact) => format!("/deviations/{}_runout/angle_deg", contact_name(contact)),
        Parameter::AllowableStress => "/load/allowable_stress_mpa".into(),
        Parameter::AllowableStressAt(contact) => format!("/load/allowable_stress_mpa/{}", contact_name(contact)),
        Parameter::InputSpeed => "/load/input_speed_rpm".into(),
        Parameter::DutyPoints => "/load/duty".into(),
        Parameter::Duty(of, at) => {
            let name = match of {
                OfDutyPoint::InputTorque => "input_torque_nm",
                OfDutyPoint::OutputTorque => "output_torque_nm",
                OfDutyPoint::InputSpeed => "input_speed_rpm",
                OfDutyPoint::ShareOfTime => "share_of_time",
            };
            format!("/load/duty/{at}/{name}")
        }
        Parameter::FrictionCoefficient(contact) => format!("/friction/{}/coefficient", contact_name(contact)),
        Parameter::BearingCoefficient => "/friction/wave_generator/bearing_coefficient".into(),
        Parameter::BearingRadius => "/friction/wave_generator/bearing_radius_mm".into(),
        Parameter::BearingLoadRating => "/friction/wave_generator/bearing_load_rating_n".into(),
        Parameter::WearRate(contact) => format!("/friction/wear_rate_mm3_per_nm/{}", contact_name(contact)),
        Parameter::Samples => "/sweep/samples".into(),
        Parameter::RequestedError => "/accuracy/requested_error".into(),
        Parameter::SweepTolerance => "/sweep/tolerance".into(),
        Parameter::ChordTolerance => "/profile/chord_tolerance_mm".into(),
        Parameter::RingOuterRadius => "/parts/ring/outer_radius_mm".into(),
        Parameter::CarrierInnerRadius => "/parts/carrier/inner_radius_mm".into(),
        Parameter::CarrierOuterRadius => "/parts/carrier/outer_radius_mm".into(),
        Parameter::FingerFilletRadius => "/parts/carrier/finger_fillet_radius_mm".into(),
        Parameter::YieldStrength => "/parts/carrier/strength/yield_strength_mpa".into(),
        Parameter::TensileStrength => "/parts/carrier/strength/tensile_strength_mpa".into(),
        Parameter::EnduranceLimit => "/parts/carrier/strength/endurance_limit_mpa".into(),
        Parameter::BoreRadius => "/parts/wave_generator/bore_radius_mm".into(),
        Parameter::PartClearance(part) => format!("/parts/{}/clearance_um", word(&part)),
        Parameter::InputAngle => "/assembly/input_angle_deg".into(),
    }
}

/// Returns the name of a modification in documents.
const fn modified_name(modified: Modified) -> &'static str {
    match modified {
        Modified::RingEquidistant => "ring_equidistant_um",
        Modified::RingPathShift => "ring_path_shift_um",
        Modified::RingProfileShift => "ring_profile_shift_um",
        Modified::RingRotation => "ring_rotation_arcsec",
        Modified::WaveGeneratorEquidistant => "wave_generator_equidistant_um",
        Modified::SlotWall => "slot_wall_um",
        Modified::CarrierRotation => "carrier_rotation_arcsec",
        Modified::ToothRadius => "tooth_radius_um",
        Modified::TipReliefAmount => "ring_tip_relief/amount_um",
        Modified::TipReliefStart => "ring_tip_relief/start_deg",
        Modified::TipReliefPower => "ring_tip_relief/power",
    }
}

/// Returns the name of a list of deviations in documents.
const fn listed_name(listed: Listed) -> &'static str {
    match listed {
        Listed::ToothRadius => "tooth_radius_um",
        Listed::SlotAngle => "slot_angle_arcsec",
        Listed::SlotWall => "slot_wall_um",
        Listed::RingSpace => "ring_space_um",
        Listed::RingSpaceAngle => "ring_space_angle_arcsec",
        Listed::WaveGeneratorLobe => "wave_generator_lobe_um",
    }
}

/// Returns the name of a contact in documents.
pub const fn contact_name(contact: Contact) -> &'static str {
    match contact {
        Contact::WaveGenerator => "wave_generator",
        Contact::Ring => "ring",
        Contact::Carrier => "carrier",
    }
}
