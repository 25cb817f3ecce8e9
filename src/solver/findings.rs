//! Findings: warnings and information about a drive that can exist (docs/reference/findings.md).

mod contacts;
mod made_parts;

use FindingCode as Code;

use crate::SolveError;
use crate::backing::{Backing, Estimate};
use crate::backlash::Backlash;
use crate::contact::Contact;
use crate::drive::{Drive, ToothShape};
use crate::fingers::FingerStress;
use crate::load_sharing::{Compatibility, LoadCase};
use crate::losses::{FirstOrderError, Fixed, Friction, MEASURED_TO, MEASURED_TO_ALONG_CAM, Mechanism};
use crate::mesh::Mesh;
use crate::ring::FlankEnd;
use crate::root::NotConverged;
use crate::sweep::Sweep;

pub(crate) use contacts::widest_half_widths_mm;
pub use contacts::{of_contacts, of_half_widths};
pub(crate) use made_parts::of_made_part;

/// Contact stress at the fatigue limit of bearing steel (ISO 281:2007).
pub const FATIGUE_LIMIT_STRESS_MPA: f64 = 1500.0;

/// Wall thickness below which a finding is reported, as a share of the slot's width. A rule of thumb, not a strength
/// calculation.
pub const THIN_WALL_SHARE_OF_SLOT: f64 = 0.25;

/// Ring pressure angle above which a finding is reported. There the ring carries about three times the cam's radial
/// force. Friction, which the model leaves out, can then stop the drive from turning.
pub const STEEP_FLANK_DEG: f64 = 70.0;

/// Largest relative difference from the contact modulus of steel on steel at which Palmgren's constant applies without
/// a finding. Steels differ by less.
pub const STEEL_TOLERANCE: f64 = 0.1;

/// Wind-up above which a finding is reported, as a share of the period. Lever arms and directions are those of the
/// unloaded positions. A wind-up of one period moves every tooth by one spacing. A tenth of it changes results by some
/// per cent.
pub const WIND_UP_SHARE_OF_PERIOD: f64 = 0.1;

/// The same if the wave generator moves under its teeth: rad times number of lobes. Displacements are then exact to
/// second order. The third-order term is a sixth of the square, about 1 %.
pub const WIND_UP_TIMES_LOBES_RAD: f64 = 0.25;

/// Ring pressure angle above which a finding is reported for projected approaches. Compared with elastic bodies, the
/// largest force is at most 2 % too large at 22.8°, 8 % at 34.8°, 15 % at 46.7° (docs/explanation/validation.md).
pub const STEEP_FOR_PROJECTION_DEG: f64 = 30.0;

/// Possible error of an efficiency above which a finding is reported.
pub const UNCERTAIN_EFFICIENCY: f64 = 0.05;

/// Largest share of a bearing's dynamic load rating for which its life equation is valid (ISO 281:2007).
pub const LIFE_HOLDS_TO_SHARE_OF_RATING: f64 = 0.5;

/// Compliance of a part behind a contact above which a finding is reported, as a share of a tooth's contact deflection.
/// The wind-up is then a sixth too small. Elastic bodies in a housing add up to the same amount together
/// (docs/explanation/validation.md).
pub const SOFT_BACKING_SHARE: f64 = 0.2;

/// Depth of a ball's groove, as a share of the ball's radius, if the document gives none. A rule of thumb.
pub const GROOVE_DEPTH_SHARE_OF_BALL: f64 = 0.5;

/// Negative backlash closer to zero than this is rounding.
const ROUNDING_ARCMIN: f64 = 1e-9;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum Severity {
    /// Information only.
    Info,
    /// Likely to cause a problem in the drive.
    Warning,
}

/// Kinds of finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum FindingCode {
    /// The ring's tips are undercut: their own envelope cuts them.
    Undercut,
    /// The bore ends the flank before its natural tip.
    BoreShortensFlank,
    /// The bore lies inside the natural tip.
    BoreWithoutEffect,
    /// Fewer than two teeth of a zone mesh at some input angle.
    FewTeethInMesh,
    /// The wall between two slots is thin.
    ThinSlotWall,
    /// A loaded tooth's centre leaves the carrier's annulus.
    ToothBeyondCarrier,
    /// The ring's flank is steep to the radius.
    SteepRingFlank,
    /// Linear law although wind-up or clearance is computed: it is several times too stiff.
    LinearLawTooStiff,
    /// A cam with concave valleys, which no bearing ring can follow.
    HollowWaveGenerator,
    /// The flats of the teeth end the arcs before the steepest contact.
    FlatCutsTheContact,
    /// A ball's contact is longer than its groove is wide.
    ContactBeyondGroove,
    /// The groove that balls run in is not drawn.
    GrooveNotDrawn,
    /// `projection` with a steep ring flank: forces come out too large.
    ProjectionOnSteepFlank,
    /// `projection` with a gap, which it does not weight by work.
    ProjectionWithGap,
    /// The compliance of the carrier's fingers is too large to neglect.
    SlenderFingers,
    /// The compliance of the ring's rim is too large to neglect.
    SoftRim,
    /// Palmgren's law for a contact that is not steel on steel.
    PalmgrenBeyondSteel,
    /// Johnson's law for a contact that is wide compared with the tooth's radius or the depth.
    JohnsonBeyondHalfWidth,
    /// Wind-up so large that the teeth are no longer where the model assumes them.
    WindUpBeyondModel,
    /// Unloaded parts interfere on both flanks: the backlash is negative.
    NegativeBacklash,
    /// A tooth's centre passes the end of its slot's walls in the manufactured carrier.
    ToothLeavesSlot,
    /// A wall of a manufactured part is thin.
    ThinWallAsMade,
    /// The ring's flank is undercut only because of its clearance.
    ClearanceUndercutsRing,
    /// Friction outside the range in which the first-order model was compared with exact equilibria.
    FrictionBeyondMeasured,
    /// Friction so large that the efficiency of an exact equilibrium may differ considerably.
    EfficiencyUncertain,
    /// Load on the wave generator's bearing above which its life equation is not valid.
    BearingLoadAboveHalfRating,
    /// A finger of the carrier that yields or breaks by fatigue.
    FingerOverstressed,
    /// Stress above the contact's allowable stress.
    StressAboveAllowable,
    /// Stress above the fatigue limit of bearing steel.
    StressAboveFatigueLimit,
    /// Field that a later version will remove.
    DeprecatedField,
    /// Surface set back by both a clearance and a modification.
    SetBackTwice,
}

/// Finding about a drive, its load or its document.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The kind of finding.
    pub code: FindingCode,
    /// Severity of the finding.
    pub severity: Severity,
    /// Value that caused the finding.
    pub value: f64,
    /// Limit of the value.
    pub limit: f64,
    /// Contact, or the part that teeth touch there, if the finding is about one.
    pub contact: Option<Contact>,
}

impl Finding {
    const fn warning(code: FindingCode, value: f64, limit: f64) -> Self {
        Self { code, severity: Severity::Warning, value, limit, contact: None }
    }

    const fn info(code: FindingCode, value: f64, limit: f64) -> Self {
        Self { severity: Severity::Info, ..Self::warning(code, value, limit) }
    }

    /// Creates a warning if a value exceeds its limit.
    fn above(code: FindingCode, value: f64, limit: f64) -> Option<Self> {
        (value > limit).then_some(Self::warning(code, value, limit))
    }

    /// Creates a warning if a value is less than its limit.
    fn below(code: FindingCode, value: f64, limit: f64) -> Option<Self> {
        (value < limit).then_some(Self::warning(code, value, limit))
    }

    const fn at(self, contact: Contact) -> Self {
        Self { contact: Some(contact), ..self }
    }

    /// Creates a warning if `is_grave`, otherwise information.
    const fn grave_if(code: FindingCode, value: f64, limit: f64, is_grave: bool) -> Self {
        if is_grave { Self::warning(code, value, limit) } else { Self::info(code, value, limit) }
    }
}

/// Returns the findings about the drive itself.
///
/// ```
/// use toothwave_solver::{Drive, DriveParameters, FindingCode, WaveGenerator, findings};
///
/// let undercut = Drive::new(&DriveParameters {
///     wave_generator: WaveGenerator::Ellipse { semi_major_mm: 50.7, semi_minor_mm: 49.3 },
///     teeth: 80,
///     installed: 40,
///     ring_teeth: 78,
///     tooth_radius_mm: 1.5,
///     ..DriveParameters::default()
/// })
/// .unwrap();
/// let found = findings::of_drive(&undercut).unwrap();
/// assert!(found.iter().any(|finding| finding.code == FindingCode::Undercut));
/// ```
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn of_drive(drive: &Drive) -> Result<Vec<Finding>, NotConverged> {
    let mut findings = Vec::new();
    let p = drive.parameters();
    let flank = drive.flank();
    let limit = drive.flank_limit();
    let natural_tip_radius_mm = drive.ring_tooth().natural_tip_radius_mm;
    if flank.is_undercut()
        && let Some(critical_tooth_radius_mm) = flank.critical_tooth_radius_mm()
    {
        let is_grave = limit.end != FlankEnd::Bore;
        findings.push(Finding::grave_if(Code::Undercut, p.tooth_radius_mm, critical_tooth_radius_mm, is_grave));
    }
    match p.tip_radius_mm {
        Some(tip_radius_mm) if limit.end == FlankEnd::Bore => {
            findings.push(Finding::info(Code::BoreShortensFlank, tip_radius_mm, natural_tip_radius_mm));
        }
        Some(tip_radius_mm) if tip_radius_mm < natural_tip_radius_mm => {
            findings.push(Finding::info(Code::BoreWithoutEffect, tip_radius_mm, natural_tip_radius_mm));
        }
        Some(_) | None => {}
    }
    let least_in_mesh = Mesh::new(drive).teeth_in_mesh().min as f64;
    findings.extend(Finding::below(Code::FewTeethInMesh, least_in_mesh, 2.0));
    findings.extend(Finding::below(Code::ThinSlotWall, drive.slot_wall_mm(), thin_wall_mm(drive)));
    let innermost_mm = flank.locus().at(limit.position)?.center_radius_mm;
    let cam_outer_mm = drive.cam_outer_radius_mm();
    findings.extend(Finding::below(Code::ToothBeyondCarrier, innermost_mm, cam_outer_mm));
    let outermost_mm = cam_outer_mm + p.tooth_radius_mm;
    findings.extend(Finding::above(Code::ToothBeyondCarrier, outermost_mm, drive.tip_radius_mm()));
    let tan_pressure_angle = drive.ring_tooth().steepest_engaged()?.tan_pressure_angle * flank.teeth_per_wave();
    let pressure_angle_deg = tan_pressure_angle.atan().to_degrees();
    findings.extend(Finding::above(Code::SteepRingFlank, pressure_angle_deg, STEEP_FLANK_DEG));
    if let Some((amplitude_mm, limit_mm)) = flank.locus().hollow() {
        findings.push(Finding::info(Code::HollowWaveGenerator, amplitude_mm, limit_mm));
    }
    if let ToothShape::FlatSided { flat_length_mm, .. } = p.tooth {
        // The arcs beside the flats reach the contact with the ring if w/2 ≥ r sin β, that is, l ≤ 2r cos β.
        let limit_mm = 2.0 * p.tooth_radius_mm / tan_pressure_angle.hypot(1.0);
        findings.extend(Finding::above(Code::FlatCutsTheContact, flat_length_mm, limit_mm));
    }
    Ok(findings)
}

/// Returns findings if `projection` differs much from elastic bodies.
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn of_projection(drive: &Drive, load: &LoadCase) -> Result<Vec<Finding>, NotConverged> {
    let p = load.parameters();
    if p.compatibility == Compatibility::VirtualWork {
        return Ok(Vec::new());
    }
    let mut findings = Vec::new();
    let pressure_angle_deg = drive.largest_pressure_angle_deg()?;
    let limit_deg = STEEP_FOR_PROJECTION_DEG;
    if pressure_angle_deg > limit_deg {
        findings.push(Finding::info(Code::ProjectionOnSteepFlank, pressure_angle_deg, limit_deg));
    }
    let gap_um = p.clearance_um.iter().fold(0.0, |most: f64, (_, &gap_um)| most.max(gap_um));
    findings.extend(Finding::above(Code::ProjectionWithGap, gap_um, 0.0));
    Ok(findings)
}

/// Returns findings for parts behind the contacts that are too compliant to neglect.
pub fn of_backing(estimates: &[Estimate]) -> Vec<Finding> {
    let finding = |estimate: &Estimate| {
        let share = estimate.share.filter(|&share| share > SOFT_BACKING_SHARE)?;
        let (code, is_grave) = match estimate.backing {
            Backing::FingerAtOneEnd | Backing::FingerOnWeb => (Code::SlenderFingers, true),
            Backing::FingerAtBothEnds | Backing::FingerJoinedAtFarEnd => (Code::SlenderFingers, false),
            Backing::FreeRim => (Code::SoftRim, true),
            Backing::HousedRim => (Code::SoftRim, false),
            Backing::CamOnBore => return None,
        };
        Some(Finding::grave_if(code, share, SOFT_BACKING_SHARE, is_grave))
    };
    estimates.iter().filter_map(finding).collect()
}

/// Returns a finding if the carrier's fingers have a safety below 1.
pub fn of_fingers(stress: &FingerStress) -> Option<Finding> {
    Finding::below(Code::FingerOverstressed, stress.safety?, 1.0)
}

/// Returns a finding if the wind-up of a sweep exceeds the model's range.
pub fn of_wind_up(drive: &Drive, load: &LoadCase, sweep: &Sweep) -> Option<Finding> {
    let wind_up_deg = sweep.input_angles.wind_up_deg.iter().copied().fold(0.0, f64::max);
    let is_moving = load.parameters().wave_generator_moves;
    let limit_deg = if is_moving {
        (WIND_UP_TIMES_LOBES_RAD / f64::from(drive.lobes())).to_degrees()
    } else {
        WIND_UP_SHARE_OF_PERIOD * Mesh::new(drive).period_deg()
    };
    Finding::above(Code::WindUpBeyondModel, wind_up_deg, limit_deg)
}

/// Returns a finding for unloaded interference on both flanks. If a tooth is blocked on a lobe or in a valley, the
/// finding names the ring. Its value is then the gap in µm instead of the backlash in arcmin.
pub fn of_backlash(backlash: &Result<Backlash, SolveError>) -> Option<Finding> {
    match *backlash {
        Ok(Backlash { smallest_arcmin, .. }) => (smallest_arcmin < -ROUNDING_ARCMIN).then_some(Finding::warning(
            Code::NegativeBacklash,
            smallest_arcmin,
            0.0,
        )),
        Err(SolveError::Interference { gap_um, .. }) => {
            Some(Finding::warning(Code::NegativeBacklash, gap_um, 0.0).at(Contact::Ring))
        }
        Err(_) => None,
    }
}

/// Returns a finding if first-order friction is not accurate for a sweep with this mean loss ratio
/// (docs/explanation/theory.md section 10.6).
pub fn of_friction(mechanism: &Mechanism, friction: &Friction, loss_ratio: f64) -> Option<Finding> {
    let FirstOrderError { efficiency, coefficient, coefficient_along_cam, is_within_measured_range } =
        friction.first_order_error(mechanism, mechanism.loss_share(Fixed::Ring, loss_ratio));
    if !is_within_measured_range {
        // Outside the measured range no error is known.
        let is_along_cam = coefficient <= MEASURED_TO;
        let (coefficient, limit) =
            if is_along_cam { (coefficient_along_cam, MEASURED_TO_ALONG_CAM) } else { (coefficient, MEASURED_TO) };
        return Some(Finding::warning(Code::FrictionBeyondMeasured, coefficient, limit));
    }
    (efficiency > UNCERTAIN_EFFICIENCY).then_some(Finding::info(
        Code::EfficiencyUncertain,
        efficiency,
        UNCERTAIN_EFFICIENCY,
    ))
}

/// Returns a finding if the load on a bearing of this rating exceeds the range of its life equation
/// (docs/explanation/theory.md section 10.5).
pub fn of_bearing(dynamic_load_rating_n: f64, load_n: f64) -> Option<Finding> {
    Finding::above(Code::BearingLoadAboveHalfRating, load_n, LIFE_HOLDS_TO_SHARE_OF_RATING * dynamic_load_rating_n)
}

/// Returns the thickness below which a wall is thin.
fn thin_wall_mm(drive: &Drive) -> f64 {
    THIN_WALL_SHARE_OF_SLOT * 2.0 * drive.slot_half_width_mm()
}

/// Returns `r_g` if teeth are balls and this contact has a groove for them.
const fn groove_radius_mm(drive: &Drive, contact: Contact) -> Option<f64> {
    match &drive.parameters().tooth {
        ToothShape::Ball { groove_radius_mm } => *groove_radius_mm.get(contact),
        ToothShape::Cylinder { .. } | ToothShape::FlatSided { .. } => None,
    }
}
