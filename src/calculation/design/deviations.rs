//! Deviations of individual items of the parts.

use serde::{Deserialize, Serialize};
use toothwave_solver::gaps::{Deviations, Runout};
use toothwave_solver::{DriveParameters, PerContact};
use utoipa::ToSchema;

/// Deviations of individual items of the parts, measured or random, with `virtual_work` only. A positive value opens a
/// gap. A positive angle is a rotation away from the flank under load. A list has one entry for each item, counted from
/// 0, or is empty if no item deviates.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct DeviationsDocument {
    /// Reduction of the teeth's radius, by slot, in µm.
    pub tooth_radius_um: Vec<f64>,
    /// Rotation of the slots about the axis, by slot, in arcsec.
    pub slot_angle_arcsec: Vec<f64>,
    /// Offset of the slots' walls, by slot, in µm.
    pub slot_wall_um: Vec<f64>,
    /// Offset of the profiles along their normals, by ring space, in µm.
    pub ring_space_um: Vec<f64>,
    /// Rotation of the ring's spaces about the axis, by ring space, in arcsec.
    pub ring_space_angle_arcsec: Vec<f64>,
    /// Offset of the wave generator along its normals, by lobe, in µm.
    pub wave_generator_lobe_um: Vec<f64>,
    /// Runout of the wave generator. Its angle is counted from the middle of lobe 0.
    pub wave_generator_runout: Runout,
    /// Runout of the ring. Its angle is counted from the middle of space 0.
    pub ring_runout: Runout,
    /// Runout of the carrier. Its angle is counted from slot 0.
    pub carrier_runout: Runout,
}

impl DeviationsDocument {
    /// Clears each list that has a zero for every item, which is equivalent.
    pub(super) fn leave_out_zeros(&mut self, drive: &DriveParameters) {
        let lobes = drive.wave_generator.lobes();
        for (list, items) in [
            (&mut self.tooth_radius_um, drive.installed),
            (&mut self.slot_angle_arcsec, drive.installed),
            (&mut self.slot_wall_um, drive.installed),
            (&mut self.ring_space_um, drive.ring_teeth),
            (&mut self.ring_space_angle_arcsec, drive.ring_teeth),
            (&mut self.wave_generator_lobe_um, lobes),
        ] {
            if usize::try_from(items) == Ok(list.len()) && list.iter().all(|&value| value == 0.0) {
                list.clear();
            }
        }
    }
}

impl From<&DeviationsDocument> for Deviations {
    fn from(document: &DeviationsDocument) -> Self {
        Self {
            tooth_radius_um: document.tooth_radius_um.clone(),
            slot_angle_arcsec: document.slot_angle_arcsec.clone(),
            slot_wall_um: document.slot_wall_um.clone(),
            ring_space_um: document.ring_space_um.clone(),
            ring_space_angle_arcsec: document.ring_space_angle_arcsec.clone(),
            wave_generator_lobe_um: document.wave_generator_lobe_um.clone(),
            runout: PerContact {
                wave_generator: document.wave_generator_runout,
                ring: document.ring_runout,
                carrier: document.carrier_runout,
            },
        }
    }
}
