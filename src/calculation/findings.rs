//! Findings in JSON, with their meaning and advice.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::findings;
pub use toothwave_solver::findings::{FindingCode, Severity};
use toothwave_solver::fingers::Fingers;
use toothwave_solver::losses::MEASURED_TO;
use toothwave_solver::{Contact, Drive, Finding, Parameter, ToothShape, WaveGenerator};
use utoipa::ToSchema;

use crate::design::{DEPRECATED_CLEARANCE, Design};
use crate::no_answer::NoAnswer;

/// Finding about a drive that can exist. docs/reference/findings.md has the formula behind each code.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FindingAnswer {
    /// Kind of finding, a stable word.
    pub code: FindingCode,
    /// Severity of the finding.
    pub severity: Severity,
    /// JSON pointers to the fields that the finding is about.
    pub pointers: Vec<String>,
    /// Value that caused the finding.
    pub value: f64,
    /// Limit of the value.
    pub limit: f64,
    /// Unit of value and limit; empty for a count.
    pub unit: String,
    /// Meaning of the finding.
    pub detail: String,
    /// Recommended change.
    pub advice: String,
}

const RADIUS: &str = "/drive/teeth/radius_mm";
const INSTALLED: &str = "/drive/teeth/installed";
const TIP_RADIUS: &str = "/drive/ring/tip_radius_mm";
const WIDTH: &str = "/drive/teeth/width_mm";
const LOAD: &str = "/load";

/// Properties of a document that select the text of a finding.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Causes {
    /// True if a clearance sets the ring back.
    pub(crate) ring_clearance: bool,
    /// True if the equidistant modification sets the ring back.
    pub(crate) ring_equidistant: bool,
    /// True if the wave generator moves under its teeth.
    pub(crate) wave_generator_moves: bool,
    /// Support of the carrier's fingers.
    pub(crate) fingers: Fingers,
    /// Fields of the document that open or close gaps.
    pub(crate) gap_fields: &'static [&'static str],
}

impl FindingAnswer {
    fn says(self, detail: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { detail: detail.into(), advice: advice.into(), ..self }
    }

    /// Creates a finding about this drive. It names only fields that the document has.
    pub(crate) fn new(finding: &Finding, drive: &Drive, causes: Causes) -> Self {
        use FindingCode as Code;
        let Finding { code, severity, value, limit, contact } = *finding;
        // A finding about these fields, without its text.
        let at = |pointers: &[&str], unit: &str| {
            let (pointers, unit) = (pointers.iter().map(|&pointer| pointer.into()).collect(), unit.into());
            Self { code, severity, pointers, value, limit, unit, detail: String::new(), advice: String::new() }
        };
        let is_grave = severity == Severity::Warning;
        let parameters = drive.parameters();
        let shaping = parameters.wave_generator.size_and_shape().map(|(parameter, _)| parameter.to_string());
        let [size, shape] = [0, 1].map(|at| shaping[at].as_str());
        let (lobe, rounder) = match parameters.wave_generator {
            WaveGenerator::Ellipse { .. } => ("the major axis", "the ellipse rounder"),
            _ => ("the middle of a lobe", "the wave generator's stroke smaller"),
        };
        // A ball has no width.
        let (stressed, widen): (&[&str], _) = match parameters.tooth {
            ToothShape::Ball { .. } => (&[LOAD, RADIUS], "make the balls larger"),
            ToothShape::Cylinder { .. } | ToothShape::FlatSided { .. } => (&[LOAD, WIDTH, RADIUS], "widen the teeth"),
        };
        let support = match causes.fingers {
            Fingers::HeldAtOneEnd => "held at one end",
            Fingers::HeldAtBothEnds => "held at both ends",
            Fingers::FarEndsJoined => "held at one end and joined at the other",
            Fingers::WebInTheMiddle => "held by a web in the middle",
        };
        let hold_both_ends =
            if causes.fingers == Fingers::HeldAtBothEnds { "" } else { "hold the fingers at both ends, " };
        let contact = contact.unwrap_or(Contact::WaveGenerator);
        let (place, mate) = (contact.to_string().replace('_', " "), format!("/materials/{contact}"));
        let groove = Parameter::GrooveRadius(contact).to_string();
        let starts_deg = drive.flank_limit().position.from_lobe_deg();
        match code {
            Code::Undercut => at(&[RADIUS, size, shape], "mm").says(
                if is_grave {
                    format!("the moving teeth cut away the tips of the ring's teeth: they start to touch the flank only {starts_deg:.4} deg from {lobe}, fewer of them mesh, and loads jump when one enters, except with contact at tip corners (`corner_contact`)")
                } else {
                    "the ring's tooth tips would be undercut, but the bore takes more away than undercut does".into()
                },
                format!("make the teeth thinner than the critical radius, or {rounder}"),
            ),
            Code::BoreShortensFlank => at(&[TIP_RADIUS], "mm").says(
                format!("the bore ends the flank before its natural tip: teeth start to touch it {starts_deg:.4} deg from {lobe} and take load at once, so loads jump, except with contact at tip corners (`corner_contact`)"),
                "if the jump matters, use a smaller bore or none",
            ),
            Code::BoreWithoutEffect => at(&[TIP_RADIUS], "mm").says(
                "the bore lies inside the ring's natural tips and removes nothing",
                "leave it out, or bore beyond the natural tip radius",
            ),
            Code::FewTeethInMesh => at(&[INSTALLED, RADIUS], "").says(
                "at some input angle fewer than two teeth of a zone mesh: one tooth carries all, or none does",
                "install more teeth, or lengthen the flank: less undercut, a smaller bore",
            ),
            Code::ThinSlotWall => at(&[RADIUS, INSTALLED], "mm").says(
                if value > 0.0 {
                    "the wall between two slots of the carrier is thinner at its inner edge than a quarter of a slot's width"
                } else {
                    "the slots of the carrier run into each other at its inner edge"
                },
                "make the teeth thinner or install fewer",
            ),
            Code::ToothBeyondCarrier => at(&[size, shape, RADIUS], "mm").says(
                if value < limit {
                    "the centre of a loaded tooth comes nearer to the axis than the carrier's annulus begins: it presses on a slot's edge, not on its wall"
                } else {
                    "the centre of a loaded tooth goes further out than the ring's tips leave room for the carrier: it presses on a slot's edge, not on its wall"
                },
                format!("make {rounder} or the teeth thicker, or bore the ring"),
            ),
            Code::SteepRingFlank => at(&[size, shape, "/drive/ring/teeth"], "deg").says(
                "the ring's flank stands steep to the radius: its force is several times the wave generator's, and friction, which the model leaves out, may keep the drive from turning",
                format!("make {rounder}, or take fewer teeth"),
            ),
            Code::HollowWaveGenerator => at(&["/drive/wave_generator/amplitude_mm"], "mm").says(
                "the wave generator is concave between its lobes: a solid cam works, but the ring of a bearing cannot follow it",
                "for a bearing choose a smaller amplitude or a larger path",
            ),
            Code::FlatCutsTheContact => at(&["/drive/teeth/flat_length_mm", RADIUS], "mm").says(
                "the flats end a tooth's arcs before its steepest contact with the ring: there it would ride on an edge",
                "make the flats shorter",
            ),
            Code::ContactBeyondGroove => at(&[&groove, LOAD], "mm").says(
                format!("the contact at the {place} reaches along the axis beyond the edges of a groove half as deep as the ball's radius: it would ride on them"),
                "make the groove's radius larger, which shortens the contact, or lower the torque",
            ),
            Code::GrooveNotDrawn => at(&[&groove], "mm").says(
                format!("the groove of the {place} is not drawn: the outline is that in the middle of the width, along which the groove runs"),
                "sweep a circle of the groove's radius along the outline in CAD, its lowest point on the outline",
            ),
            Code::LinearLawTooStiff => at(&["/model/stiffness/law"], "µm").says(
                "under the peak force the linear law's deflection of the wave generator's contact is far smaller than that of real line contacts: wind-up comes out too small and the effect of clearances too large",
                "choose `virtual_work` with the law `johnson`, or the law `fixed` with stiffnesses of your own",
            ),
            Code::ProjectionOnSteepFlank => at(&["/model/compatibility"], "deg").says(
                "`projection` adds the approaches along one direction, which is valid for a flat ring flank: on a flank as steep as this, elastic bodies have peak forces that are 8 to 15 % smaller in the calculated drives, and the difference is larger for a tooth that just enters",
                "choose `virtual_work`, unless you want the paper's results",
            ),
            Code::ProjectionWithGap => at(&["/model/compatibility", "/parts"], "µm").says(
                "`projection` does not weight a gap by the work done there: forces and wind-up differ much from those of elastic bodies",
                "choose `virtual_work`",
            ),
            Code::SlenderFingers => at(&["/parts/carrier/fingers", "/model/series_compliance_mm_per_n/carrier", WIDTH], "").says(
                format!("the carrier's fingers, {support}, bend under their teeth: by an estimate they add this share to the deflection at a tooth's contacts. Forces and wind-up leave it out"),
                format!("give the estimate as the carrier's series compliance, {hold_both_ends}or make the fingers shorter or thicker"),
            ),
            Code::SoftRim => at(&["/parts/ring/rim", "/parts/ring/outer_radius_mm", "/model/series_compliance_mm_per_n/ring"], "").says(
                format!(
                    "{}: by an estimate it adds this share to the deflection at a tooth's contacts. Forces and wind-up leave it out",
                    if is_grave { "without a housing the ring's rim bends" } else { "the ring's rim deflects even in a housing" }
                ),
                if is_grave {
                    "house the ring or make its rim thicker, or give the estimate as the ring's series compliance"
                } else {
                    "give the estimate as the ring's series compliance, or let the housing begin nearer behind the teeth"
                },
            ),
            Code::PalmgrenBeyondSteel => at(&["/model/stiffness/law", "/materials/teeth", &mate], "GPa").says(
                format!("Palmgren's law is valid for steel on steel, but the contact modulus at the {place} differs"),
                "choose `virtual_work` with the law `johnson`, which follows the modulus",
            ),
            Code::JohnsonBeyondHalfWidth => at(&["/model/stiffness/law", LOAD, RADIUS], "mm").says(
                format!("half the contact's width at the {place} exceeds a tenth of the tooth's radius or of the depth: Johnson's law assumes narrow contacts and becomes inaccurate"),
                "lower the torque, widen the teeth, or choose a stiffer material",
            ),
            Code::WindUpBeyondModel if causes.wave_generator_moves => at(&[LOAD, "/model"], "deg").says(
                "under the load the wave generator turns by more than a quarter of a radian over the number of its lobes: the model follows it on under its teeth to second order alone, and directions are those of the drive without load",
                "lower the torque, choose stiffer contacts, or close the clearances",
            ),
            Code::WindUpBeyondModel => at(&[LOAD, "/model"], "deg").says(
                "under the load the wave generator turns by more than a tenth of the period: the model uses lever arms and directions of the unloaded drive, but the loaded teeth are no longer there",
                "lower the torque, close the clearances, or let the wave generator move, by `virtual_work`",
            ),
            Code::NegativeBacklash => {
                let (unit, detail) = if finding.contact.is_some() {
                    ("µm", "a tooth has no space between wave generator and ring on a lobe or in a valley: the parts interfere")
                } else {
                    ("arcmin", "at some input angle the backlash is negative: without load the parts interfere on both flanks")
                };
                at(causes.gap_fields, unit).says(
                    format!("{detail}, so force is needed to assemble the drive or to turn it"),
                    "make the clearances larger or the deviations smaller",
                )
            }
            Code::ToothLeavesSlot => {
                let (radius, passes, further) = if value < limit {
                    ("inner_radius_mm", "comes nearer to the axis than the walls of its slot begin", "in")
                } else {
                    ("outer_radius_mm", "goes further out than the walls of its slot reach", "out")
                };
                let result = if is_grave {
                    "under load it presses on the wall's edge, or on nothing"
                } else {
                    "it is not loaded there, but nothing holds it upright in its slot"
                };
                at(&[&format!("/parts/carrier/{radius}"), "/parts/carrier/clearance_um"], "mm").says(
                    format!("the centre of a tooth {passes}: {result}"),
                    format!("draw the carrier further {further}"),
                )
            }
            Code::ThinWallAsMade => {
                let (field, wall, advice) = match contact {
                    Contact::Ring => (
                        "/parts/ring/outer_radius_mm",
                        "the ring's rim beyond its tooth spaces",
                        "draw the ring larger",
                    ),
                    _ => (
                        "/parts/wave_generator/bore_radius_mm",
                        "the wave generator's wall where it is lowest, around its bore",
                        "bore the wave generator less",
                    ),
                };
                let detail = "is thinner than a quarter of a slot's width: the model takes the part as rigid, and this one is not";
                at(&[field], "mm").says(format!("{wall} {detail}"), advice)
            }
            Code::ClearanceUndercutsRing => {
                const CLEARANCE: &str = "/parts/ring/clearance_um";
                const EQUIDISTANT: &str = "/modification/ring_equidistant_um";
                let (pointers, what, less): (&[&str], _, _) = match (causes.ring_clearance, causes.ring_equidistant) {
                    (true, true) => {
                        (&[CLEARANCE, EQUIDISTANT, RADIUS], "clearance and its equidistant modification cut", "them")
                    }
                    (_, false) => (&[CLEARANCE, RADIUS], "clearance alone cuts", "the clearance"),
                    (false, true) => {
                        (&[EQUIDISTANT, RADIUS], "equidistant modification alone cuts", "the modification")
                    }
                };
                at(pointers, "mm").says(
                    format!("the ring's {what} away its tooth tips: the flank as drawn ends before the one that is computed with, so teeth enter later than the results say"),
                    format!("make {less} smaller, or take it from the teeth's radius instead"),
                )
            }
            Code::FrictionBeyondMeasured => at(&["/friction"], "").says(
                format!(
                    "{} lies beyond the range in which losses were held against exact equilibria: efficiencies are tendencies",
                    if limit < MEASURED_TO { "the friction along the wave generator" } else { "a coefficient of friction" }
                ),
                "let the teeth run on a bearing, or choose surfaces that slide better",
            ),
            Code::EfficiencyUncertain => at(&["/friction"], "").says(
                "friction alters the normal forces themselves, which losses to first order leave out: an exact equilibrium may have an efficiency that is off by as much as this",
                "let the teeth run on a bearing, or use the efficiency only as a tendency",
            ),
            Code::BearingLoadAboveHalfRating => at(&["/friction/wave_generator/bearing_load_rating_n", LOAD], "N").says(
                "the load on the bearing exceeds half its dynamic load rating, the limit of its life equation (ISO 281:2007): its life may be shorter than calculated",
                "choose a bearing with a larger load rating, or lower the torque",
            ),
            Code::FingerOverstressed => at(&["/parts/carrier/strength", "/parts/carrier/fingers", "/parts/carrier/finger_fillet_radius_mm", LOAD, WIDTH, RADIUS], "").says(
                "the safety of the carrier's fingers is below 1: they yield or break by fatigue at their feet",
                format!("lower the torque, {hold_both_ends}make the fingers thicker or shorter, enlarge their fillets, or choose a stronger material"),
            ),
            Code::StressAboveAllowable => at(&[&["/load/allowable_stress_mpa"], stressed, &[&*mate]].concat(), "MPa").says(
                format!("the contact stress at the {place} exceeds its allowable stress"),
                format!("lower the torque, {widen}, let more of them mesh, or choose a stronger material"),
            ),
            Code::StressAboveFatigueLimit => at(&[stressed, &[&*mate]].concat(), "MPa").says(
                format!("the contact stress at the {place} exceeds the fatigue limit of bearing steel (ISO 281:2007)"),
                format!("lower the torque, {widen}, or let more of them mesh"),
            ),
            // Findings of a document; see below.
            Code::DeprecatedField | Code::SetBackTwice => at(&[], ""),
        }
    }
}

impl FindingAnswer {
    /// Returns the findings about the document itself. Set `is_of_model` if the answer depends on the model.
    pub(crate) fn of_document(design: &Design, is_of_model: bool) -> Vec<Self> {
        let deprecated = design.deprecated_fields().into_iter();
        let deprecated = deprecated.filter(|&field| is_of_model || field == DEPRECATED_CLEARANCE);
        deprecated.map(Self::of_deprecated).chain(design.set_back_twice().map(Self::of_set_back_twice)).collect()
    }

    /// Creates the finding that two fields set the same surface back.
    fn of_set_back_twice([(clearance, clearance_um), (modification, modification_um)]: [(Parameter, f64); 2]) -> Self {
        let pointers = [clearance, modification].map(|at| at.to_string());
        Self {
            code: FindingCode::SetBackTwice,
            severity: Severity::Info,
            detail: format!("`{}` and `{}` both set this surface back: the two add up", pointers[0], pointers[1]),
            pointers: pointers.into(),
            value: clearance_um + modification_um,
            limit: clearance_um,
            unit: "µm".into(),
            advice: "remove one of them, unless you want both".into(),
        }
    }

    /// Creates the finding that a document uses the deprecated field at this JSON pointer.
    fn of_deprecated(field: &str) -> Self {
        let replacement = if field == DEPRECATED_CLEARANCE { "parts.*.clearance_um" } else { "model.refinements" };
        Self {
            code: FindingCode::DeprecatedField,
            severity: Severity::Info,
            pointers: vec![field.into()],
            value: 0.0,
            limit: 0.0,
            unit: String::new(),
            detail: format!("the field `{field}` is deprecated: version 0.3 will refuse it"),
            advice: format!("use `{replacement}`; `toothwave convert` changes a file"),
        }
    }
}

/// Returns the findings about a drive, ready for JSON.
pub(crate) fn drive_findings(drive: &Drive) -> Result<Vec<FindingAnswer>, NoAnswer> {
    let findings = findings::of_drive(drive)?;
    Ok(findings.iter().map(|finding| FindingAnswer::new(finding, drive, Causes::default())).collect())
}

/// Writes one paragraph per finding.
pub(crate) fn write_findings(findings: &[FindingAnswer], writer: &mut dyn Write) -> io::Result<()> {
    for finding in findings {
        let FindingAnswer { severity, detail, value, limit, unit, advice, .. } = finding;
        let limit = format!("{limit:.6} {unit}");
        writeln!(writer, "\n{severity:?}: {detail} ({value:.6} against {}); {advice}", limit.trim_end())?;
    }
    Ok(())
}
