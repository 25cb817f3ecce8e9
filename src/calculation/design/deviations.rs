//! Single items of the parts as they came out.

use serde::{Deserialize, Serialize};
use toothwave_solver::gaps::{Deviations, Runout};
use toothwave_solver::{DriveParameters, PerContact};
use utoipa::ToSchema;

use crate::key::encoded;

/// Single items of the parts as they came out, measured or drawn by lot, with `virtual_work` alone: each number opens a gap where it is
/// positive. Angles are turned away from the flank under load. A list has one entry for each item, counted from 0, or none, where all are
/// as drawn.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct DeviationsDocument {
    /// Teeth thinner in their radius, by slot.
    #[schema(minimum = -1e6, maximum = 1e6)]
    pub tooth_radius_um: Vec<f64>,
    /// Slots turned about the axis.
    #[schema(minimum = -1e5, maximum = 1e5)]
    pub slot_angle_arcsec: Vec<f64>,
    /// Walls set back, by slot.
    #[schema(minimum = -1e6, maximum = 1e6)]
    pub slot_wall_um: Vec<f64>,
    /// Profiles set back along their normals, by ring space.
    #[schema(minimum = -1e6, maximum = 1e6)]
    pub ring_space_um: Vec<f64>,
    /// Ring spaces turned about the axis.
    #[schema(minimum = -1e5, maximum = 1e5)]
    pub ring_space_angle_arcsec: Vec<f64>,
    /// The wave generator set back along its normals, by lobe.
    #[schema(minimum = -1e6, maximum = 1e6)]
    pub wave_generator_lobe_um: Vec<f64>,
    /// The wave generator off the axis; its angle is counted from the middle of lobe 0.
    pub wave_generator_runout: RunoutDocument,
    /// The ring off the axis; its angle is counted from the middle of space 0.
    pub ring_runout: RunoutDocument,
    /// The carrier off the axis; its angle is counted from slot 0.
    pub carrier_runout: RunoutDocument,
}

/// A part off the axis, in a direction that is fixed in the part.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct RunoutDocument {
    /// How far.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub amount_um: f64,
    /// In which direction.
    #[schema(minimum = -360.0, maximum = 360.0, default = 0.0)]
    pub angle_deg: f64,
}

impl DeviationsDocument {
    /// Empties each list that has a zero for every item, which says the same.
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
                wave_generator: (&document.wave_generator_runout).into(),
                ring: (&document.ring_runout).into(),
                carrier: (&document.carrier_runout).into(),
            },
        }
    }
}

impl From<&RunoutDocument> for Runout {
    fn from(&RunoutDocument { amount_um, angle_deg }: &RunoutDocument) -> Self {
        Self { amount_um, angle_deg }
    }
}

encoded! {
    struct DeviationsDocument {
        tooth_radius_um,
        slot_angle_arcsec,
        slot_wall_um,
        ring_space_um,
        ring_space_angle_arcsec,
        wave_generator_lobe_um,
        wave_generator_runout,
        ring_runout,
        carrier_runout,
    }
    struct RunoutDocument { amount_um, angle_deg }
}
