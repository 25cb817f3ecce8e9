//! Findings: warnings and information about a drive that can exist (docs/reference/findings.md).

use std::f64::consts::PI;

use crate::SolveError;
use crate::backing::{Backing, Estimate, Shares};
use crate::backlash::Backlash;
use crate::cam::Hollow;
use crate::contact::{Contact, ContactLaw, Material, Materials, PerContact, half_width_mm};
use crate::drive::{Drive, ToothShape};
use crate::fingers::FingerStress;
use crate::load_sharing::{Compatibility, LoadCase};
use crate::losses::{FirstOrderError, Fixed, Friction, MEASURED_TO, MEASURED_TO_ALONG_CAM, Mechanism};
use crate::mesh::Mesh;
use crate::parts::{CarrierPart, RingPart, WaveGeneratorPart};
use crate::ring::FlankEnd;
use crate::root::NotConverged;
use crate::sweep::{ContactPeaks, States, Sweep};
use crate::tooth::line::{WIDE_SHARE, least_length_mm};
use crate::tooth::plain_approach_mm;

use FindingCode as Code;

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

const STEEL: Material = Material::STEEL;

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
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn of_drive(drive: &Drive) -> Result<Vec<Finding>, NotConverged> {
    let mut findings = Vec::new();
    let p = drive.parameters();
    let flank = drive.flank();
    let limit = drive.flank_limit();
    let natural_tip_radius_mm = drive.natural_tip_radius_mm();
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
    let min = Mesh::new(drive).teeth_in_mesh().min;
    if min < 2 {
        #[expect(clippy::cast_precision_loss, reason = "a count of teeth")]
        findings.push(Finding::warning(Code::FewTeethInMesh, min as f64, 2.0));
    }
    let slot_wall_mm = drive.slot_wall_mm();
    let limit_mm = THIN_WALL_SHARE_OF_SLOT * 2.0 * drive.slot_half_width_mm();
    if slot_wall_mm < limit_mm {
        findings.push(Finding::warning(Code::ThinSlotWall, slot_wall_mm, limit_mm));
    }
    let innermost_mm = flank.locus().at(limit.position)?.center_radius_mm;
    let cam_outer_mm = drive.cam_outer_radius_mm();
    if innermost_mm < cam_outer_mm {
        findings.push(Finding::warning(Code::ToothBeyondCarrier, innermost_mm, cam_outer_mm));
    }
    let outermost_mm = cam_outer_mm + p.tooth_radius_mm;
    if outermost_mm > drive.tip_radius_mm() {
        findings.push(Finding::warning(Code::ToothBeyondCarrier, outermost_mm, drive.tip_radius_mm()));
    }
    let tan_pressure_angle = drive.steepest_engaged()?.tan_pressure_angle * flank.teeth_per_wave();
    let pressure_angle_deg = tan_pressure_angle.atan().to_degrees();
    if pressure_angle_deg > STEEP_FLANK_DEG {
        findings.push(Finding::warning(Code::SteepRingFlank, pressure_angle_deg, STEEP_FLANK_DEG));
    }
    if let Some(Hollow { amplitude_mm, limit_mm }) = flank.locus().cam().kind().hollow() {
        findings.push(Finding::info(Code::HollowWaveGenerator, amplitude_mm, limit_mm));
    }
    if let ToothShape::FlatSided { flat_length_mm, .. } = p.tooth {
        // The arcs beside the flats reach the contact with the ring if w/2 ≥ r sin β, that is, l ≤ 2r cos β.
        let limit_mm = 2.0 * p.tooth_radius_mm / tan_pressure_angle.hypot(1.0);
        if flat_length_mm > limit_mm {
            findings.push(Finding::warning(Code::FlatCutsTheContact, flat_length_mm, limit_mm));
        }
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
    if pressure_angle_deg > STEEP_FOR_PROJECTION_DEG {
        let limit_deg = STEEP_FOR_PROJECTION_DEG;
        findings.push(Finding::info(Code::ProjectionOnSteepFlank, pressure_angle_deg, limit_deg));
    }
    let gap_um = p.clearance_um.iter().fold(0.0, |most: f64, (_, &gap_um)| most.max(gap_um));
    if gap_um > 0.0 {
        findings.push(Finding::warning(Code::ProjectionWithGap, gap_um, 0.0));
    }
    Ok(findings)
}

/// Returns findings for parts behind the contacts that are too compliant to neglect.
pub fn of_backing(shares: &Shares) -> Vec<Finding> {
    let soft = shares.shares.iter().filter(|(_, share)| *share > SOFT_BACKING_SHARE);
    let finding = |&(estimate, share): &(Estimate, f64)| {
        let (code, is_grave) = match estimate.backing {
            Backing::FingerAtOneEnd | Backing::FingerJoinedAtFarEnd | Backing::FingerOnWeb => {
                (Code::SlenderFingers, true)
            }
            Backing::FingerAtBothEnds => (Code::SlenderFingers, false),
            Backing::FreeRim => (Code::SoftRim, true),
            Backing::HousedRim => (Code::SoftRim, false),
            Backing::CamOnBore => return None,
        };
        Some(Finding::grave_if(code, share, SOFT_BACKING_SHARE, is_grave))
    };
    soft.filter_map(finding).collect()
}

/// Returns a finding if the carrier's fingers have a safety below 1.
pub fn of_fingers(stress: &FingerStress) -> Option<Finding> {
    let least = stress.safety?.least();
    (least < 1.0).then_some(Finding::warning(Code::FingerOverstressed, least, 1.0))
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
    (wind_up_deg > limit_deg).then_some(Finding::warning(Code::WindUpBeyondModel, wind_up_deg, limit_deg))
}

/// Returns a finding for unloaded interference on both flanks. If a tooth is blocked on a lobe or in a valley, the
/// finding names the ring. Its value is then the gap in µm instead of the backlash in arcmin.
pub fn of_backlash(backlash: &Result<Backlash, SolveError>) -> Option<Finding> {
    match *backlash {
        Ok(Backlash { smallest, .. }) => {
            let smallest_arcmin = smallest.backlash_arcmin();
            (smallest_arcmin < -ROUNDING_ARCMIN).then_some(Finding::warning(
                Code::NegativeBacklash,
                smallest_arcmin,
                0.0,
            ))
        }
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
    let limit_n = LIFE_HOLDS_TO_SHARE_OF_RATING * dynamic_load_rating_n;
    (load_n > limit_n).then_some(Finding::warning(Code::BearingLoadAboveHalfRating, load_n, limit_n))
}

/// Returns the findings about the manufactured ring (docs/explanation/theory.md section 8).
pub(crate) fn of_ring(drive: &Drive, ring: &RingPart) -> Vec<Finding> {
    let flank = ring.space.set_back_flank();
    let thin = thin_wall(drive, Contact::Ring, ring.outer_radius_mm - ring.space.outermost_radius_mm());
    let mut findings: Vec<_> = thin.into_iter().chain(groove_not_drawn(drive, Contact::Ring)).collect();
    if ring.space.is_undercut_by_distance()
        && !drive.flank().is_undercut()
        && let Some(critical_distance_mm) = flank.critical_distance_mm()
    {
        findings.push(Finding::warning(Code::ClearanceUndercutsRing, flank.distance_mm(), critical_distance_mm));
    }
    findings
}

/// Returns the findings about the manufactured wave generator. A solid cam has no wall.
pub(crate) fn of_wave_generator(drive: &Drive, cam: &WaveGeneratorPart) -> Vec<Finding> {
    let wall_mm = |bore_mm: f64| drive.flank().locus().cam_inner_radius_mm() - cam.set_back_mm - bore_mm;
    let thin = cam.bore_radius_mm.and_then(|bore_mm| thin_wall(drive, Contact::WaveGenerator, wall_mm(bore_mm)));
    thin.into_iter().chain(groove_not_drawn(drive, Contact::WaveGenerator)).collect()
}

/// Returns the findings about the manufactured carrier: its walls must cover the travel of the teeth's centres.
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub(crate) fn of_carrier(drive: &Drive, carrier: &CarrierPart) -> Result<Vec<Finding>, NotConverged> {
    let p = drive.parameters();
    let w = carrier.slot_half_width_mm;
    // A wall is at distance w from the slot's middle, so its ends are nearer to the axis along the slot than their
    // radii.
    let along_slot_mm = |radius_mm: f64| ((radius_mm - w).max(0.0) * (radius_mm + w)).sqrt();
    // If slots overlap, the fingers are pointed and their walls begin at the point.
    let point_mm = w / (PI / p.installed as f64).tan();
    let (inner_mm, outer_mm) =
        (along_slot_mm(carrier.inner_radius_mm).max(point_mm), along_slot_mm(carrier.outer_radius_mm));
    let locus = drive.flank().locus();
    let innermost_mm = locus.cam_inner_radius_mm() + p.tooth_radius_mm;
    let outermost_mm = locus.cam_outer_radius_mm() + p.tooth_radius_mm;
    let innermost_loaded_mm = drive.flank().locus().at(drive.flank_limit().position)?.center_radius_mm;
    let mut findings = Vec::new();
    if innermost_mm < inner_mm {
        let is_loaded = innermost_loaded_mm < inner_mm;
        let center_radius_mm = if is_loaded { innermost_loaded_mm } else { innermost_mm };
        findings.push(Finding::grave_if(Code::ToothLeavesSlot, center_radius_mm, inner_mm, is_loaded));
    }
    if outermost_mm > outer_mm {
        findings.push(Finding::warning(Code::ToothLeavesSlot, outermost_mm, outer_mm));
    }
    findings.extend(groove_not_drawn(drive, Contact::Carrier));
    Ok(findings)
}

/// Returns `r_g` if teeth are balls and this contact has a groove for them.
const fn groove_radius_mm(drive: &Drive, contact: Contact) -> Option<f64> {
    match &drive.parameters().tooth {
        ToothShape::Ball { groove_radius_mm } => *groove_radius_mm.get(contact),
        ToothShape::Cylinder { .. } | ToothShape::FlatSided { .. } => None,
    }
}

/// Returns the finding if there is a groove: outlines are drawn without it.
fn groove_not_drawn(drive: &Drive, contact: Contact) -> Option<Finding> {
    let ball_radius_mm = drive.parameters().tooth_radius_mm;
    let finding = |groove_radius_mm| Finding::info(Code::GrooveNotDrawn, groove_radius_mm, ball_radius_mm).at(contact);
    groove_radius_mm(drive, contact).map(finding)
}

/// Returns half the width at the edges of a groove of radius `r_g` and depth `t`: `√(t (2r_g - t))`, at most the ball's
/// radius.
fn groove_half_width_mm(groove_radius_mm: f64, ball_radius_mm: f64) -> f64 {
    let depth_mm = GROOVE_DEPTH_SHARE_OF_BALL * ball_radius_mm;
    (depth_mm * (2.0 * groove_radius_mm - depth_mm)).sqrt().min(ball_radius_mm)
}

/// Returns the finding if a wall is thinner than the minimum share of a slot's width, as for walls between slots.
fn thin_wall(drive: &Drive, contact: Contact, wall_mm: f64) -> Option<Finding> {
    let limit_mm = THIN_WALL_SHARE_OF_SLOT * 2.0 * drive.slot_half_width_mm();
    (wall_mm < limit_mm).then_some(Finding::warning(Code::ThinWallAsMade, wall_mm, limit_mm).at(contact))
}

/// True if the contact is that of a flat.
fn is_flat(drive: &Drive, contact: Contact) -> bool {
    contact == Contact::Carrier && matches!(drive.parameters().tooth, ToothShape::FlatSided { .. })
}

/// Returns the findings about a drive's contacts under a load. `approaches_matter` is true if wind-up or clearance is
/// computed.
pub fn of_contacts(
    drive: &Drive,
    load: &LoadCase,
    peaks: &PerContact<ContactPeaks>,
    approaches_matter: bool,
) -> Vec<Finding> {
    let p = load.parameters();
    let width_mm = drive.tooth_width_mm();
    let mut findings = Vec::new();
    let force_n = peaks.wave_generator.force_n.value;
    let approach_mm = |law: ContactLaw| plain_approach_mm(&law, &p.materials, width_mm, force_n);
    if p.law == ContactLaw::Linear
        && approaches_matter
        && let Some((linear_mm, palmgren_mm)) = approach_mm(ContactLaw::Linear).zip(approach_mm(ContactLaw::Palmgren))
    {
        findings.push(Finding::info(Code::LinearLawTooStiff, 1e3 * linear_mm, 1e3 * palmgren_mm));
    }
    if p.law == ContactLaw::Palmgren {
        let steel = Materials { wave_generator: STEEL, teeth: STEEL, ring: STEEL, carrier: STEEL };
        let steel_mpa = steel.contact_modulus_mpa(Contact::Ring);
        // A flat has its own law, which depends on the modulus.
        for (contact, _) in peaks.iter().filter(|&(contact, _)| !is_flat(drive, contact)) {
            let contact_mpa = p.materials.contact_modulus_mpa(contact);
            if (contact_mpa / steel_mpa - 1.0).abs() > STEEL_TOLERANCE {
                let (contact_gpa, steel_gpa) = (1e-3 * contact_mpa, 1e-3 * steel_mpa);
                findings.push(Finding::warning(Code::PalmgrenBeyondSteel, contact_gpa, steel_gpa).at(contact));
            }
        }
    }
    for (contact, peaks) in peaks.iter() {
        if let Some(half_length_mm) = peaks.half_length_mm
            && let Some(groove_radius_mm) = groove_radius_mm(drive, contact)
        {
            let limit_mm = groove_half_width_mm(groove_radius_mm, drive.parameters().tooth_radius_mm);
            if half_length_mm > limit_mm {
                findings.push(Finding::warning(Code::ContactBeyondGroove, half_length_mm, limit_mm).at(contact));
            }
        }
    }
    if let Some(allowable_mpa) = &p.allowable_stress_mpa {
        findings.extend(
            peaks
                .iter()
                .map(|(contact, peaks)| (contact, peaks.stress_mpa.value, *allowable_mpa.get(contact)))
                // The fatigue limit has its own finding.
                .filter(|(_, stress_mpa, allowable_mpa)| {
                    stress_mpa > allowable_mpa && allowable_mpa.total_cmp(&FATIGUE_LIMIT_STRESS_MPA).is_ne()
                })
                .map(|(contact, stress_mpa, allowable_mpa)| {
                    Finding::warning(Code::StressAboveAllowable, stress_mpa, allowable_mpa).at(contact)
                }),
        );
    }
    let stresses = peaks.iter().map(|(contact, peaks)| (contact, peaks.stress_mpa.value));
    let tired = stresses.filter(|(_, stress_mpa)| *stress_mpa > FATIGUE_LIMIT_STRESS_MPA);
    findings.extend(tired.map(|(contact, stress_mpa)| {
        Finding::warning(Code::StressAboveFatigueLimit, stress_mpa, FATIGUE_LIMIT_STRESS_MPA).at(contact)
    }));
    findings
}

/// Returns half the width of the widest contact of each kind over all states. It is not the contact with the largest
/// stress. Flats have none.
pub(crate) fn widest_half_widths_mm(drive: &Drive, states: &States) -> impl Iterator<Item = (Contact, f64)> {
    let tooth_width_mm = drive.tooth_width_mm();
    states.force_n.iter().filter(|&(contact, _)| !is_flat(drive, contact)).map(move |(contact, forces_n)| {
        // A corner has no such width, and its stress is not reported.
        let loaded = forces_n.iter().zip(states.stress_mpa.get(contact)).filter(|&(_, &stress_mpa)| stress_mpa > 0.0);
        let half_widths = loaded.map(|(&force_n, &stress_mpa)| half_width_mm(force_n, stress_mpa, tooth_width_mm));
        (contact, half_widths.fold(0.0, f64::max))
    })
}

/// Returns the contacts that are too wide for Johnson's law, over all states.
pub fn of_half_widths(drive: &Drive, load: &LoadCase, states: &States) -> Vec<Finding> {
    let ContactLaw::Johnson { depth_mm } = &load.parameters().law else { return Vec::new() };
    let tooth_radius_mm = drive.parameters().tooth_radius_mm;
    widest_half_widths_mm(drive, states)
        .map(|(contact, half_width_mm)| {
            let limit_mm = WIDE_SHARE * least_length_mm(depth_mm, contact, tooth_radius_mm);
            Finding::warning(Code::JohnsonBeyondHalfWidth, half_width_mm, limit_mm).at(contact)
        })
        .filter(|finding| finding.value > finding.limit)
        .collect()
}
