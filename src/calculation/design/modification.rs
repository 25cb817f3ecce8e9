//! Modification: intentional differences of the parts from the conjugate shape.

use serde::{Deserialize, Serialize};
use toothwave_solver::Modification;
use toothwave_solver::gaps::TipRelief;
use utoipa::ToSchema;

use super::number::given;
use crate::key::encoded;

/// Modification: intentional differences of the parts from the conjugate shape, the same for all teeth, with
/// `virtual_work` only. A positive value opens a gap. A positive angle is a rotation away from the flank under load.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ModificationDocument {
    /// Offset of the ring's profile along its normals, in µm. Default: 0 µm.
    pub ring_equidistant_um: f64,
    /// Outward shift of the path that generates the ring, along its radii, in µm. Default: 0 µm.
    pub ring_path_shift_um: f64,
    /// Outward shift of the ring's profile, along its own radii, in µm. Default: 0 µm.
    pub ring_profile_shift_um: f64,
    /// Rotation of the ring's flanks about the axis, in arcsec. Default: 0 arcsec.
    pub ring_rotation_arcsec: f64,
    /// Offset of the wave generator along its normals, in µm. Default: 0 µm.
    pub wave_generator_equidistant_um: f64,
    /// Offset of the slots' walls, in µm. Default: 0 µm.
    pub slot_wall_um: f64,
    /// Rotation of the carrier about the axis, in arcsec. Default: 0 arcsec.
    pub carrier_rotation_arcsec: f64,
    /// Reduction of the teeth's radius, in µm. Default: 0 µm.
    pub tooth_radius_um: f64,
    /// Tip relief: offset of the ring's flank towards its tip. Default: no relief.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub ring_tip_relief: Option<TipReliefDocument>,
}

/// Tip relief: the flank is offset by C ((ψ - ψ_t)/(ψ_e - ψ_t))^n for tooth positions ψ above ψ_t. ψ_e is the flank's
/// end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct TipReliefDocument {
    /// Amount C at the flank's end, in µm.
    pub amount_um: f64,
    /// Start ψ_t: tooth position from the middle of the lobe, in deg. It must be before the flank's end.
    pub start_deg: f64,
    /// Power n.
    pub power: f64,
}

impl From<&ModificationDocument> for Modification {
    fn from(document: &ModificationDocument) -> Self {
        Self {
            ring_equidistant_um: document.ring_equidistant_um,
            ring_path_shift_um: document.ring_path_shift_um,
            ring_profile_shift_um: document.ring_profile_shift_um,
            ring_rotation_arcsec: document.ring_rotation_arcsec,
            wave_generator_equidistant_um: document.wave_generator_equidistant_um,
            slot_wall_um: document.slot_wall_um,
            carrier_rotation_arcsec: document.carrier_rotation_arcsec,
            tooth_radius_um: document.tooth_radius_um,
            ring_tip_relief: document
                .ring_tip_relief
                .as_ref()
                .map(|&TipReliefDocument { amount_um, start_deg, power }| TipRelief { amount_um, start_deg, power }),
        }
    }
}

encoded! {
    struct ModificationDocument {
        ring_equidistant_um, ring_path_shift_um, ring_profile_shift_um, ring_rotation_arcsec, wave_generator_equidistant_um,
        slot_wall_um, carrier_rotation_arcsec, tooth_radius_um, ring_tip_relief,
    }
    struct TipReliefDocument { amount_um, start_deg, power }
}
