//! Parts made otherwise than conjugate on purpose.

use serde::{Deserialize, Serialize};
use toothwave_solver::Modification;
use toothwave_solver::gaps::TipRelief;
use utoipa::ToSchema;

use super::number::given;
use crate::key::encoded;

/// Parts made otherwise than conjugate on purpose, all teeth alike, with `virtual_work` alone: each number opens a gap where it is positive.
/// Angles are turned away from the flank under load.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ModificationDocument {
    /// The ring's profile set back along its normals.
    #[serde(default)]
    #[schema(minimum = -1e6, maximum = 1e6, default = 0.0)]
    pub ring_equidistant_um: f64,
    /// The path that generates the ring shifted outward along its radii.
    #[serde(default)]
    #[schema(minimum = -1e6, maximum = 1e6, default = 0.0)]
    pub ring_path_shift_um: f64,
    /// The ring's profile moved outward along its own radii.
    #[serde(default)]
    #[schema(minimum = -1e6, maximum = 1e6, default = 0.0)]
    pub ring_profile_shift_um: f64,
    /// The ring's flanks turned about the axis.
    #[serde(default)]
    #[schema(minimum = -1e5, maximum = 1e5, default = 0.0)]
    pub ring_rotation_arcsec: f64,
    /// The wave generator set back along its normals.
    #[serde(default)]
    #[schema(minimum = -1e6, maximum = 1e6, default = 0.0)]
    pub wave_generator_equidistant_um: f64,
    /// The slots' walls set back.
    #[serde(default)]
    #[schema(minimum = -1e6, maximum = 1e6, default = 0.0)]
    pub slot_wall_um: f64,
    /// The carrier turned about the axis.
    #[serde(default)]
    #[schema(minimum = -1e5, maximum = 1e5, default = 0.0)]
    pub carrier_rotation_arcsec: f64,
    /// The teeth thinner in their radius.
    #[serde(default)]
    #[schema(minimum = -1e6, maximum = 1e6, default = 0.0)]
    pub tooth_radius_um: f64,
    /// The ring's flank set back towards its tip; left out, it has no relief.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub ring_tip_relief: Option<TipReliefDocument>,
}

/// The ring's flank set back by C ((ψ - ψ_t)/(ψ_e - ψ_t))^n where the tooth stands beyond ψ_t; ψ_e is the flank's end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct TipReliefDocument {
    /// C, at the flank's end.
    #[schema(minimum = -1e6, maximum = 1e6)]
    pub amount_um: f64,
    /// ψ_t, the position where it starts, from the middle of the lobe; before the flank's end.
    #[schema(minimum = 0.0, maximum = 180.0)]
    pub start_deg: f64,
    /// n.
    #[schema(minimum = 0.1, maximum = 100.0)]
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
