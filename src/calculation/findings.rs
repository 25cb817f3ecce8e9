//! Findings as they go over the wire, with what each means and what to change.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::findings::{
    self, Edge, FATIGUE_LIMIT_STRESS_MPA, SOFT_BACKING_SHARE, STEEP_FLANK_DEG, STEEP_FOR_PROJECTION_DEG, Wall,
};
use toothwave_solver::{Drive, Finding, Parameter, SolveError, ToothShape, WaveGenerator};
use utoipa::ToSchema;

use crate::design::{DeprecatedField, Design, SetBackTwice};
use crate::field::{contact_name, pointer};
use crate::no_answer::NoAnswer;

/// What a designer should be told about a drive that can exist; docs/reference/findings.md has the formula behind each code.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FindingAnswer {
    /// The kind of finding, a stable word.
    pub code: FindingCode,
    /// How grave it is.
    pub severity: Severity,
    /// JSON pointers to the fields that it is about.
    pub pointers: Vec<String>,
    /// What was found.
    pub value: f64,
    /// What it is measured against.
    pub limit: f64,
    /// Unit of value and limit; empty for a count.
    pub unit: String,
    /// What it means.
    pub detail: String,
    /// What to change.
    pub advice: String,
}

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know.
    Info,
    /// Likely to trouble the drive.
    Warning,
}

/// Kinds of finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FindingCode {
    /// The ring's tips are cut away by their own envelope.
    Undercut,
    /// The bore ends the flank before its natural tip.
    BoreShortensFlank,
    /// The bore lies inside the natural tip.
    BoreWithoutEffect,
    /// At some input angle fewer than two teeth of a zone mesh.
    FewTeethInMesh,
    /// The wall between two slots is thin.
    ThinSlotWall,
    /// A loaded tooth's centre leaves the carrier's annulus.
    ToothBeyondCarrier,
    /// The ring's flank stands steep to the radius.
    SteepRingFlank,
    /// The linear law where wind-up or clearance was asked for: it is several times too stiff.
    LinearLawTooStiff,
    /// A cam with hollow valleys, which no bearing's ring could follow.
    HollowWaveGenerator,
    /// The teeth's flats end their arcs before the steepest contact.
    FlatCutsTheContact,
    /// A ball's contact is longer than its groove is wide.
    ContactBeyondGroove,
    /// A groove that balls run in is not drawn.
    GrooveNotDrawn,
    /// `projection` where the ring's flank is steep: forces come out too large.
    ProjectionOnSteepFlank,
    /// `projection` with a gap, which it does not weigh by the work done.
    ProjectionWithGap,
    /// The carrier's fingers give way by more than can be left out.
    SlenderFingers,
    /// The ring's rim does so.
    SoftRim,
    /// Palmgren's law for a contact that is not steel on steel.
    PalmgrenBeyondSteel,
    /// Johnson's law for a contact that is wide beside the tooth's radius or the depth.
    JohnsonBeyondHalfWidth,
    /// A wind-up so large that the teeth no longer stand where the model has them.
    WindUpBeyondModel,
    /// A tooth's centre passes the end of its slot's walls, as the carrier is made.
    ToothLeavesSlot,
    /// A wall of a part as it is made is thin.
    ThinWallAsMade,
    /// The ring's flank is undercut only because its clearance sets it back.
    ClearanceUndercutsRing,
    /// Friction beyond the range in which first order was held against exact equilibria.
    FrictionBeyondMeasured,
    /// Friction so large that an exact equilibrium may have quite another efficiency.
    EfficiencyUncertain,
    /// A load on the wave generator's bearing beyond which the equation of its life does not hold.
    BearingLoadAboveHalfRating,
    /// A stress above the one that the contact may have.
    StressAboveAllowable,
    /// A stress above the fatigue limit of bearing steel.
    StressAboveFatigueLimit,
    /// A field that a later version will not know.
    DeprecatedField,
    /// A surface that a clearance and a modification set back.
    SetBackTwice,
}

const RADIUS: &str = "/drive/teeth/radius_mm";
const INSTALLED: &str = "/drive/teeth/installed";
const TIP_RADIUS: &str = "/drive/ring/tip_radius_mm";
const WIDTH: &str = "/drive/teeth/width_mm";
const LOAD: &str = "/load";

impl FindingAnswer {
    /// A finding about this drive, which names fields that its document has.
    pub(crate) fn new(finding: &Finding, drive: &Drive) -> Self {
        use FindingCode as Code;
        use Severity::{Info, Warning};
        let parameters = drive.parameters();
        let shaping = parameters.wave_generator.size_and_shape().map(pointer);
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
        let new = |code, severity, pointers: &[&str], value, limit, unit: &str, detail: String, advice: &str| Self {
            code,
            severity,
            pointers: pointers.iter().map(|&pointer| pointer.into()).collect(),
            value,
            limit,
            unit: unit.into(),
            detail,
            advice: advice.into(),
        };
        match *finding {
            Finding::Undercut { tooth_radius_mm, critical_tooth_radius_mm, engagement_start_deg, is_bored_away } => new(
                Code::Undercut,
                if is_bored_away { Info } else { Warning },
                &[RADIUS, size, shape],
                tooth_radius_mm,
                critical_tooth_radius_mm,
                "mm",
                if is_bored_away {
                    "the ring's tooth tips would be undercut, but the bore takes more away than undercut does".into()
                } else {
                    format!(
                        "the ring's tooth tips are cut away by their own envelope: teeth start to touch the flank only {engagement_start_deg:.4} deg from {lobe}, fewer of them mesh, and loads jump when one enters unless corners carry"
                    )
                },
                &format!("make the teeth thinner than the critical radius, or {rounder}"),
            ),
            Finding::BoreShortensFlank { tip_radius_mm, natural_tip_radius_mm, engagement_start_deg } => new(
                Code::BoreShortensFlank,
                Info,
                &[TIP_RADIUS],
                tip_radius_mm,
                natural_tip_radius_mm,
                "mm",
                format!(
                    "the bore ends the flank before its natural tip: teeth start to touch it {engagement_start_deg:.4} deg from {lobe} and take load at once, so loads jump unless corners carry"
                ),
                "bore less, or not at all, where the jump matters",
            ),
            Finding::BoreWithoutEffect { tip_radius_mm, natural_tip_radius_mm } => new(
                Code::BoreWithoutEffect,
                Info,
                &[TIP_RADIUS],
                tip_radius_mm,
                natural_tip_radius_mm,
                "mm",
                "the bore lies inside the ring's natural tips and takes nothing away".into(),
                "leave it out, or bore beyond the natural tip radius",
            ),
            #[expect(clippy::cast_precision_loss, reason = "a count of teeth")]
            Finding::FewTeethInMesh { min } => new(
                Code::FewTeethInMesh,
                Warning,
                &[INSTALLED, RADIUS],
                min as f64,
                2.0,
                "",
                "at some input angle fewer than two teeth of a zone mesh: one tooth carries all, or none does".into(),
                "install more teeth, or lengthen the flank: less undercut, a smaller bore",
            ),
            Finding::ThinSlotWall { slot_wall_mm, limit_mm } => new(
                Code::ThinSlotWall,
                Warning,
                &[RADIUS, INSTALLED],
                slot_wall_mm,
                limit_mm,
                "mm",
                if slot_wall_mm > 0.0 {
                    "the wall between two slots of the carrier is thinner at its inner edge than a quarter of a slot's width".into()
                } else {
                    "the slots of the carrier run into each other at its inner edge".into()
                },
                "make the teeth thinner or install fewer",
            ),
            Finding::ToothBeyondCarrier { edge, center_radius_mm, limit_mm } => new(
                Code::ToothBeyondCarrier,
                Warning,
                &[size, shape, RADIUS],
                center_radius_mm,
                limit_mm,
                "mm",
                match edge {
                    Edge::Inner => "the centre of a loaded tooth comes nearer to the axis than the carrier's annulus begins: it presses on a slot's edge, not on its wall".into(),
                    Edge::Outer => "the centre of a loaded tooth goes further out than the ring's tips leave room for the carrier: it presses on a slot's edge, not on its wall".into(),
                },
                &format!("make {rounder} or the teeth thicker, or bore the ring"),
            ),
            Finding::SteepRingFlank { pressure_angle_deg } => new(
                Code::SteepRingFlank,
                Warning,
                &[size, shape, "/drive/ring/teeth"],
                pressure_angle_deg,
                STEEP_FLANK_DEG,
                "deg",
                "the ring's flank stands steep to the radius: its force is several times the wave generator's, and friction, which the model leaves out, may keep the drive from turning".into(),
                &format!("make {rounder}, or take fewer teeth"),
            ),
            Finding::HollowWaveGenerator { amplitude_mm, limit_mm } => new(
                Code::HollowWaveGenerator,
                Info,
                &["/drive/wave_generator/amplitude_mm"],
                amplitude_mm,
                limit_mm,
                "mm",
                "the wave generator is hollow between its lobes: a solid one turns, but the ring of a bearing could not follow it".into(),
                "for a bearing choose a smaller amplitude or a larger path",
            ),
            Finding::FlatCutsTheContact { flat_length_mm, limit_mm } => new(
                Code::FlatCutsTheContact,
                Warning,
                &["/drive/teeth/flat_length_mm", RADIUS],
                flat_length_mm,
                limit_mm,
                "mm",
                "the flats end a tooth's arcs before its steepest contact with the ring: there it would ride on an edge".into(),
                "make the flats shorter",
            ),
            Finding::ContactBeyondGroove { contact, half_length_mm, limit_mm } => new(
                Code::ContactBeyondGroove,
                Warning,
                &[&pointer(Parameter::GrooveRadius(contact)), LOAD],
                half_length_mm,
                limit_mm,
                "mm",
                format!(
                    "the contact at the {} reaches along the axis beyond the edges of a groove half as deep as the ball's radius: it would ride on them",
                    contact_name(contact).replace('_', " ")
                ),
                "make the groove's radius larger, which shortens the contact, or lower the torque",
            ),
            Finding::GrooveNotDrawn { contact, groove_radius_mm, ball_radius_mm } => new(
                Code::GrooveNotDrawn,
                Info,
                &[&pointer(Parameter::GrooveRadius(contact))],
                groove_radius_mm,
                ball_radius_mm,
                "mm",
                format!(
                    "the groove of the {} is not drawn: the outline is that in the middle of the width, along which the groove runs",
                    contact_name(contact).replace('_', " ")
                ),
                "sweep a circle of the groove's radius along the outline in CAD, its lowest point on the outline",
            ),
            Finding::LinearLawTooStiff { linear_um, palmgren_um } => new(
                Code::LinearLawTooStiff,
                Info,
                &["/model/stiffness/law"],
                linear_um,
                palmgren_um,
                "µm",
                "under the peak force the linear law lets the wave generator's contact approach by far less than real line contacts do: wind-up comes out too small and the effect of clearances too large".into(),
                "choose `virtual_work` with the law `johnson`, or the law `fixed` with stiffnesses of your own",
            ),
            Finding::ProjectionOnSteepFlank { pressure_angle_deg } => new(
                Code::ProjectionOnSteepFlank,
                Info,
                &["/model/compatibility"],
                pressure_angle_deg,
                STEEP_FOR_PROJECTION_DEG,
                "deg",
                "`projection` adds the approaches up along one direction, which holds where the ring's flank is flat: on a flank as steep as this elastic bodies have smaller peak forces, by 8 to 15 % in the drives that were calculated, and the tooth that just enters by more".into(),
                "choose `virtual_work`, unless the paper's results are wanted",
            ),
            Finding::ProjectionWithGap { gap_um } => new(
                Code::ProjectionWithGap,
                Warning,
                &["/model/compatibility", "/parts"],
                gap_um,
                0.0,
                "µm",
                "`projection` does not weigh a gap by the work done there: forces and wind-up come out far from those of elastic bodies".into(),
                "choose `virtual_work`",
            ),
            Finding::SlenderFingers { share, is_held_at_one_end } => new(
                Code::SlenderFingers,
                if is_held_at_one_end { Warning } else { Info },
                &["/parts/carrier/fingers", "/model/series_compliance_mm_per_n/carrier", WIDTH],
                share,
                SOFT_BACKING_SHARE,
                "",
                format!(
                    "the carrier's fingers, {}, bend under their teeth: by an estimate they add this share to what a tooth gives way at its contacts, and forces and wind-up leave it out",
                    if is_held_at_one_end { "held at one end" } else { "even if held at both ends" }
                ),
                "give the estimate as the carrier's series compliance, or make the fingers shorter or thicker",
            ),
            Finding::SoftRim { share, is_free } => new(
                Code::SoftRim,
                if is_free { Warning } else { Info },
                &["/parts/ring/rim", "/parts/ring/outer_radius_mm", "/model/series_compliance_mm_per_n/ring"],
                share,
                SOFT_BACKING_SHARE,
                "",
                format!(
                    "the ring's rim, {}: by an estimate it adds this share to what a tooth gives way at its contacts, and forces and wind-up leave it out",
                    if is_free { "with nothing around it, bends" } else { "even if housed, gives way" }
                ),
                if is_free {
                    "house the ring or make its rim thicker, or give the estimate as the ring's series compliance"
                } else {
                    "give the estimate as the ring's series compliance, or let the housing begin nearer behind the teeth"
                },
            ),
            Finding::PalmgrenBeyondSteel { contact, contact_modulus_gpa, steel_gpa } => new(
                Code::PalmgrenBeyondSteel,
                Warning,
                &["/model/stiffness/law", "/materials/teeth", &format!("/materials/{}", contact_name(contact))],
                contact_modulus_gpa,
                steel_gpa,
                "GPa",
                format!(
                    "Palmgren's law holds for steel on steel, and the contact modulus at the {} is another",
                    contact_name(contact).replace('_', " ")
                ),
                "choose `virtual_work` with the law `johnson`, which follows the modulus",
            ),
            Finding::JohnsonBeyondHalfWidth { contact, half_width_mm, limit_mm } => new(
                Code::JohnsonBeyondHalfWidth,
                Warning,
                &["/model/stiffness/law", LOAD, RADIUS],
                half_width_mm,
                limit_mm,
                "mm",
                format!(
                    "half the contact's width at the {} exceeds a tenth of the tooth's radius or of the depth: Johnson's law, which takes contacts for narrow, begins to err",
                    contact_name(contact).replace('_', " ")
                ),
                "lower the torque, widen the teeth, or take a stiffer material",
            ),
            Finding::WindUpBeyondModel { wind_up_deg, limit_deg, is_moving } => new(
                Code::WindUpBeyondModel,
                Warning,
                &[LOAD, "/model"],
                wind_up_deg,
                limit_deg,
                "deg",
                if is_moving {
                    "under the load the wave generator turns by more than a quarter of a radian over the number of its lobes: the model follows it on under its teeth to second order alone, and directions are those of the drive without load".into()
                } else {
                    "under the load the wave generator turns by more than a tenth of the period: the teeth then stand elsewhere than the model, which takes lever arms and directions from the drive without load, has them".into()
                },
                if is_moving {
                    "lower the torque, choose stiffer contacts, or close the clearances"
                } else {
                    "lower the torque, close the clearances, or let the wave generator move, by `virtual_work`"
                },
            ),
            Finding::ToothLeavesSlot { edge, center_radius_mm, wall_end_mm, is_loaded } => new(
                Code::ToothLeavesSlot,
                if is_loaded { Warning } else { Info },
                &[
                    match edge {
                        Edge::Inner => "/parts/carrier/inner_radius_mm",
                        Edge::Outer => "/parts/carrier/outer_radius_mm",
                    },
                    "/parts/carrier/clearance_um",
                ],
                center_radius_mm,
                wall_end_mm,
                "mm",
                format!(
                    "the centre of a tooth {}: {}",
                    match edge {
                        Edge::Inner => "comes nearer to the axis than the walls of its slot begin",
                        Edge::Outer => "goes further out than the walls of its slot reach",
                    },
                    if is_loaded {
                        "under load it presses on the wall's edge, or on nothing"
                    } else {
                        "it is not loaded there, but nothing holds it upright in its slot"
                    }
                ),
                match edge {
                    Edge::Inner => "draw the carrier further in",
                    Edge::Outer => "draw the carrier further out",
                },
            ),
            Finding::ThinWallAsMade { wall, wall_mm, limit_mm } => new(
                Code::ThinWallAsMade,
                Warning,
                &[match wall {
                    Wall::RingRim => "/parts/ring/outer_radius_mm",
                    Wall::Cam => "/parts/wave_generator/bore_radius_mm",
                }],
                wall_mm,
                limit_mm,
                "mm",
                format!(
                    "{} is thinner than a quarter of a slot's width: the model takes the part as rigid, and this one is not",
                    match wall {
                        Wall::RingRim => "the ring's rim beyond its tooth spaces",
                        Wall::Cam => "the wave generator's wall where it is lowest, around its bore",
                    }
                ),
                match wall {
                    Wall::RingRim => "draw the ring larger",
                    Wall::Cam => "bore the wave generator less",
                },
            ),
            Finding::ClearanceUndercutsRing { has_clearance, is_set_back, distance_mm, critical_distance_mm } => {
                const CLEARANCE: &str = "/parts/ring/clearance_um";
                const EQUIDISTANT: &str = "/modification/ring_equidistant_um";
                let (pointers, what, less): (&[&str], _, _) = match (has_clearance, is_set_back) {
                    (true, true) => (&[CLEARANCE, EQUIDISTANT, RADIUS], "clearance and its equidistant modification cut", "them"),
                    (_, false) => (&[CLEARANCE, RADIUS], "clearance alone cuts", "the clearance"),
                    (false, true) => (&[EQUIDISTANT, RADIUS], "equidistant modification alone cuts", "the modification"),
                };
                new(
                    Code::ClearanceUndercutsRing,
                    Warning,
                    pointers,
                    distance_mm,
                    critical_distance_mm,
                    "mm",
                    format!(
                        "the ring's {what} away its tooth tips: the flank as drawn ends before the one that is computed with, so teeth enter later than the results say"
                    ),
                    &format!("make {less} smaller, or take it from the teeth's radius instead"),
                )
            }
            Finding::FrictionBeyondMeasured { is_along_cam, coefficient, limit } => new(
                Code::FrictionBeyondMeasured,
                Warning,
                &["/friction"],
                coefficient,
                limit,
                "",
                if is_along_cam {
                    "the friction along the wave generator lies beyond the range in which losses were held against exact equilibria: efficiencies are tendencies".into()
                } else {
                    "a coefficient of friction lies beyond the range in which losses were held against exact equilibria: efficiencies are tendencies".into()
                },
                "let the teeth run on a bearing, or choose surfaces that slide better",
            ),
            Finding::EfficiencyUncertain { error, limit } => new(
                Code::EfficiencyUncertain,
                Info,
                &["/friction"],
                error,
                limit,
                "",
                "friction alters the normal forces themselves, which losses to first order leave out: an exact equilibrium may have an efficiency that is off by as much as this".into(),
                "let the teeth run on a bearing, or take the efficiency for a tendency",
            ),
            Finding::BearingLoadAboveHalfRating { load_n, limit_n } => new(
                Code::BearingLoadAboveHalfRating,
                Warning,
                &["/friction/wave_generator/bearing_load_rating_n", LOAD],
                load_n,
                limit_n,
                "N",
                "the load on the bearing exceeds half its dynamic load rating, up to which the equation of its life holds (ISO 281:2007): it may last less long than calculated".into(),
                "choose a bearing with a larger load rating, or lower the torque",
            ),
            Finding::StressAboveAllowable { contact, stress_mpa, allowable_mpa } => new(
                Code::StressAboveAllowable,
                Warning,
                &[&["/load/allowable_stress_mpa"], stressed, &[&*format!("/materials/{}", contact_name(contact))]].concat(),
                stress_mpa,
                allowable_mpa,
                "MPa",
                format!(
                    "the contact stress at the {} exceeds the one that it may have",
                    contact_name(contact).replace('_', " ")
                ),
                &format!("lower the torque, {widen}, let more of them mesh, or choose a stronger material"),
            ),
            Finding::StressAboveFatigueLimit { contact, stress_mpa } => new(
                Code::StressAboveFatigueLimit,
                Warning,
                &[stressed, &[&*format!("/materials/{}", contact_name(contact))]].concat(),
                stress_mpa,
                FATIGUE_LIMIT_STRESS_MPA,
                "MPa",
                format!(
                    "the contact stress at the {} exceeds the fatigue limit of bearing steel (ISO 281:2007)",
                    contact_name(contact).replace('_', " ")
                ),
                &format!("lower the torque, {widen}, or let more of them mesh"),
            ),
        }
    }
}

impl FindingAnswer {
    /// What a document itself gives rise to, for an answer to which the model matters or not.
    pub(crate) fn of_document(design: &Design, is_of_model: bool) -> Vec<Self> {
        let deprecated = design.deprecated_fields().into_iter();
        let deprecated = deprecated.filter(|&field| is_of_model || field == DeprecatedField::Clearance);
        deprecated.map(Self::of_deprecated).chain(design.set_back_twice().map(Self::of_set_back_twice)).collect()
    }

    /// That two fields set a surface back.
    fn of_set_back_twice(SetBackTwice { part, modified, clearance_um, modification_um }: SetBackTwice) -> Self {
        let pointers = [Parameter::PartClearance(part), Parameter::Modification(modified)].map(pointer);
        Self {
            code: FindingCode::SetBackTwice,
            severity: Severity::Info,
            detail: format!("`{}` and `{}` both set this surface back: the two add up", pointers[0], pointers[1]),
            pointers: pointers.into(),
            value: clearance_um + modification_um,
            limit: clearance_um,
            unit: "µm".into(),
            advice: "leave one of them out, unless both are meant".into(),
        }
    }

    /// That a document uses a field which a later version will not know.
    fn of_deprecated(field: DeprecatedField) -> Self {
        Self {
            code: FindingCode::DeprecatedField,
            severity: Severity::Info,
            pointers: vec![field.pointer().into()],
            value: 0.0,
            limit: 0.0,
            unit: String::new(),
            detail: format!("the field `{}` is deprecated: version 0.3 will refuse it", field.pointer()),
            advice: format!("use `{}`; `toothwave convert` changes a file", field.replacement()),
        }
    }
}

/// The findings about a drive, as they go over the wire.
pub(crate) fn drive_findings(drive: &Drive) -> Result<Vec<FindingAnswer>, NoAnswer> {
    let findings = findings::of_drive(drive).map_err(SolveError::from)?;
    Ok(findings.iter().map(|finding| FindingAnswer::new(finding, drive)).collect())
}

/// The findings, a paragraph each.
pub(crate) fn write_findings(findings: &[FindingAnswer], writer: &mut dyn Write) -> io::Result<()> {
    for finding in findings {
        let FindingAnswer { severity, detail, value, limit, unit, advice, .. } = finding;
        writeln!(writer, "\n{severity:?}: {detail} ({value:.6} against {limit:.6} {unit}); {advice}")?;
    }
    Ok(())
}
