//! The points of a duty as they go over the wire.

use serde::Serialize;
use utoipa::ToSchema;

/// Several loads in turn. What may be averaged over them, and why:
///
/// - Power lost is a mean over time, since energies add; efficiency is energy out over energy in, so each point's loss ratio counts by its
///   power without friction.
/// - Wear is a mean over time at each place of a part, since depths add where they are: the mean of two points' largest depths, which may stand at
///   different places, would be too large.
/// - A bearing's load counts by revolutions and with the exponent of its life: so each point uses up its share of the life that it would have alone.
/// - Nothing else is averaged. Forces, stresses, states, wind-up, radial force, slip and the torque that the wave generator needs are those of the
///   hardest point, and pressure times velocity is the largest of any: no other point makes them less. The torque capacity hangs on no load.
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
    /// At the carrier.
    pub output_torque_nm: f64,
    /// Speed of the wave generator.
    pub input_speed_rpm: f64,
    /// Share of the running time.
    pub share_of_time: f64,
    /// Efficiency with the ring fixed, given `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub efficiency_ring_fixed: Option<f64>,
    /// Power lost while it runs, ring fixed, given `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub power_loss_w: Option<f64>,
}
