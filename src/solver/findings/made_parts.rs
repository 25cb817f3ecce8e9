//! Findings about the manufactured parts (docs/explanation/theory.md section 8).

use std::f64::consts::PI;

use super::FindingCode as Code;

use super::{Finding, THIN_WALL_SHARE_OF_SLOT, groove_radius_mm};
use crate::contact::Contact;
use crate::drive::Drive;
use crate::parts::{CarrierPart, RingPart, WaveGeneratorPart};
use crate::root::NotConverged;

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

/// Returns the finding if there is a groove: outlines are drawn without it.
fn groove_not_drawn(drive: &Drive, contact: Contact) -> Option<Finding> {
    let ball_radius_mm = drive.parameters().tooth_radius_mm;
    let finding = |groove_radius_mm| Finding::info(Code::GrooveNotDrawn, groove_radius_mm, ball_radius_mm).at(contact);
    groove_radius_mm(drive, contact).map(finding)
}

/// Returns the finding if a wall is thinner than the minimum share of a slot's width, as for walls between slots.
fn thin_wall(drive: &Drive, contact: Contact, wall_mm: f64) -> Option<Finding> {
    let limit_mm = THIN_WALL_SHARE_OF_SLOT * 2.0 * drive.slot_half_width_mm();
    (wall_mm < limit_mm).then_some(Finding::warning(Code::ThinWallAsMade, wall_mm, limit_mm).at(contact))
}
