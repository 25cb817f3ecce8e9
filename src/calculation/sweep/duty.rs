//! Points of a duty in JSON.

use serde::Serialize;
use utoipa::ToSchema;

/// Several loads in sequence. Averages over the points of a duty:
///
/// - Power lost is a mean over time, since energies add. Efficiency is energy out over energy in, so each point's loss
///   ratio is weighted by its power without friction.
/// - Wear is a mean over time at each place of a part, since depths add at each place. The mean of two points' largest
///   depths would be too large, because these may be at different places.
/// - A bearing's load is weighted by revolutions and with the exponent of its life. Each point uses its share of the
///   life that the bearing would have under this point alone.
/// - Nothing else is averaged. Forces, stresses, states, wind-up, radial force, slip and the required torque of the wave
///   generator are those of the hardest point. Pressure times velocity is the largest of all points, since no other
///   point reduces it. The torque capacity does not depend on the load.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DutyAnswer {
    /// The point with the largest torque, counted from 0.
    pub hardest_point: usize,
    /// Mean speed of the wave generator over the running time.
    pub mean_input_speed_rpm: f64,
    /// The points, in the document's order.
    pub points: Vec<DutyPointAnswer>,
}

/// One load of a duty.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DutyPointAnswer {
    /// Torque at the wave generator, losses neglected.
    pub input_torque_nm: f64,
    /// Torque at the carrier.
    pub output_torque_nm: f64,
    /// Speed of the wave generator.
    pub input_speed_rpm: f64,
    /// Share of the running time.
    pub share_of_time: f64,
    /// Efficiency with the ring fixed, given `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub efficiency_ring_fixed: Option<f64>,
    /// Power lost while this point runs, ring fixed, given `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_loss_w: Option<f64>,
}
