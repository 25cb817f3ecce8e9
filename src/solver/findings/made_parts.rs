//! Findings about the manufactured parts (docs/explanation/theory.md section 8).

use std::f64::consts::PI;

use super::FindingCode as Code;

use super::{Finding, groove_radius_mm, thin_wall_mm};
use crate::contact::Contact;
use crate::drive::Drive;
use crate::parts::{CarrierPart, MadePart};
use crate::root::NotConverged;
use crate::tooth_space::ToothSpace;

/// Returns the findings about a manufactured part.
pub(crate) fn of_made_part(drive: &Drive, part: &MadePart) -> Result<Vec<Finding>, NotConverged> {
    match part {
        MadePart::Ring { space, outer_radius_mm } => Ok(of_ring(drive, space, *outer_radius_mm)),
        MadePart::Carrier(carrier) => of_carrier(drive, carrier),
        MadePart::Teeth { .. } => Ok(Vec::new()),
        MadePart::WaveGenerator { set_back_mm, bore_radius_mm } => {
            // A solid cam has no wall.
            let cam_mm = drive.flank().locus().cam_inner_radius_mm() - set_back_mm;
            let thin = bore_radius_mm.and_then(|bore_mm| thin_wall(drive, Contact::WaveGenerator, cam_mm - bore_mm));
            Ok(thin.into_iter().chain(groove_not_drawn(drive, Contact::WaveGenerator)).collect())
        }
    }
}

fn of_ring(drive: &Drive, space: &ToothSpace, outer_radius_mm: f64) -> Vec<Finding> {
    let thin = thin_wall(drive, Contact::Ring, outer_radius_mm - space.outermost_radius_mm);
    let mut findings: Vec<_> = thin.into_iter().chain(groove_not_drawn(drive, Contact::Ring)).collect();
    if let Some((distance_mm, critical_mm)) = space.undercutting_distance_mm().filter(|_| !drive.flank().is_undercut())
    {
        findings.push(Finding::warning(Code::ClearanceUndercutsRing, distance_mm, critical_mm));
    }
    findings
}

/// Returns the findings about the carrier: its walls must cover the travel of the teeth's centres.
fn of_carrier(drive: &Drive, carrier: &CarrierPart) -> Result<Vec<Finding>, NotConverged> {
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
    let innermost_loaded_mm = locus.at(drive.flank_limit().position)?.center_radius_mm;
    let mut findings = Vec::new();
    if innermost_mm < inner_mm {
        let is_loaded = innermost_loaded_mm < inner_mm;
        let center_radius_mm = if is_loaded { innermost_loaded_mm } else { innermost_mm };
        findings.push(Finding::grave_if(Code::ToothLeavesSlot, center_radius_mm, inner_mm, is_loaded));
    }
    findings.extend(Finding::above(Code::ToothLeavesSlot, outermost_mm, outer_mm));
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
    Some(Finding::below(Code::ThinWallAsMade, wall_mm, thin_wall_mm(drive))?.at(contact))
}
