//! Several loads in turn (docs/explanation/theory.md section 10.5): what may be averaged over them, and how.
//!
//! | quantity | over the points of a duty |
//! |---|---|
//! | power lost | mean over time: energies add |
//! | efficiency | energy out over energy in, so the loss ratio is weighted by the power without friction |
//! | wear | mean over time *at each place* of a part: depths add where they are, so peaks at different places do not |
//! | bearing's life | loads by revolutions and the life's exponent; then the mean speed |
//! | forces, stresses, p·v, wind-up | the worst point: no other one makes it less |
//! | torque capacity | of no point: it does not hang on the load |

use crate::losses::bearing::{LoadForRevolutions, RollingElement};
use crate::losses::{Mechanism, power_w};

/// One load of a duty and what came of it, each over a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DutyPoint {
    /// Its share of the running time, or what is in proportion to it.
    pub share_of_time: f64,
    /// Speed of the wave generator, ring fixed.
    pub input_speed_rpm: f64,
    /// `M0`: torque of the wave generator without friction.
    pub input_torque_nm: f64,
    /// Mean of ν over the period.
    pub loss_ratio: f64,
}

/// A duty as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Duty {
    /// The loss ratio from which [`Mechanism::efficiency`] makes energy out over energy in, whichever member is fixed.
    pub loss_ratio: f64,
    /// Mean power lost, ring fixed.
    pub power_loss_w: f64,
    /// Mean speed of the wave generator: revolutions over running time.
    pub input_speed_rpm: f64,
}

impl Mechanism {
    /// The means over a duty of at least one point.
    pub fn duty(&self, points: &[DutyPoint]) -> Duty {
        let time: f64 = points.iter().map(|point| point.share_of_time).sum();
        let (mut revolutions, mut ideal, mut lost, mut power_loss_w) = (0.0, 0.0, 0.0, 0.0);
        for point in points {
            // Power without friction is in proportion to this, with the same factor at every point.
            let power = point.share_of_time * point.input_torque_nm * point.input_speed_rpm;
            ideal += power;
            lost += power * point.loss_ratio;
            revolutions += point.share_of_time * point.input_speed_rpm;
            let work_nmm_per_rad = 1e3 * point.input_torque_nm * point.loss_ratio;
            power_loss_w +=
                point.share_of_time * power_w(work_nmm_per_rad, self.turning_rad_per_s(point.input_speed_rpm));
        }
        Duty { loss_ratio: lost / ideal, power_loss_w: power_loss_w / time, input_speed_rpm: revolutions / time }
    }
}

/// A quantity at each place during one point of a duty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnForTime<'a> {
    /// The point's share of the running time, or what is in proportion to it.
    pub share_of_time: f64,
    /// One value a place, the same places at every point.
    pub column: &'a [f64],
}

/// Mean over time at each place, as wear takes it. The columns are of one length; each point is swept over the same input angles.
pub fn mean_at_each_place(points: &[ColumnForTime<'_>]) -> Vec<f64> {
    let time: f64 = points.iter().map(|point| point.share_of_time).sum();
    let places = points.first().map_or(0, |point| point.column.len());
    (0..places)
        .map(|place| points.iter().map(|point| point.share_of_time * point.column[place]).sum::<f64>() / time)
        .collect()
}

/// A bearing's load during one point of a duty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingLoadForTime {
    /// The point's share of the running time, or what is in proportion to it.
    pub share_of_time: f64,
    /// How fast one ring of the bearing turns against the other.
    pub speed_rpm: f64,
    /// Mean load over the point's revolutions, see [`RollingElement::mean_load_n`].
    pub mean_load_n: f64,
}

/// Basic rating life of a bearing under a duty, in hours of running time.
pub fn bearing_life_h(element: RollingElement, dynamic_load_rating_n: f64, points: &[BearingLoadForTime]) -> f64 {
    let time: f64 = points.iter().map(|point| point.share_of_time).sum();
    let loads: Vec<_> = points
        .iter()
        .map(|point| LoadForRevolutions {
            load_n: point.mean_load_n,
            revolutions: point.share_of_time * point.speed_rpm,
        })
        .collect();
    let speed_rpm = loads.iter().map(|load| load.revolutions).sum::<f64>() / time;
    element.life_h(dynamic_load_rating_n, element.mean_load_n(&loads), speed_rpm)
}
