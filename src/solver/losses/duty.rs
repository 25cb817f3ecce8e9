//! What friction takes over several loads in turn (docs/explanation/theory.md section 10.5): what may be averaged over them, and how.
//!
//! | quantity | over the points of a duty |
//! |---|---|
//! | power lost | mean over time: energies add |
//! | efficiency | energy out over energy in, so the loss ratio is weighted by the power without friction |
//! | wear | mean over time *at each place* of a part: depths add where they are, so peaks at different places do not |
//! | bearing's life | loads by revolutions and the life's exponent; then the mean speed |
//! | forces, stresses, p·v, wind-up | the worst point: no other one makes it less |
//! | torque capacity | of no point: it does not hang on the load |

use std::f64::consts::PI;

use crate::contact::PerContact;
use crate::drive::Drive;
use crate::findings::{self, Finding};
use crate::gaps::Deviations;
use crate::load_sharing::LoadCase;
use crate::losses::bearing::{BearingLife, BearingRating, LoadForRevolutions};
use crate::losses::period::{BearingLoad, LossByPlace, Losses, RadialForces, Wear, WearForTime};
use crate::losses::wear::{WearParameters, WornPlace};
use crate::losses::{Efficiencies, FirstOrderError, Fixed, Friction, Mechanism};
use crate::sweep::{Peak, Points, States, Sweep, sweep_with_deviations};
use crate::{SolveError, Stop};

/// What is asked of friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossParameters {
    /// Friction at the contacts.
    pub friction: Friction,
    /// Specific wear rates; without them no wear is computed.
    pub wear_rate_mm3_per_nm: Option<PerContact<f64>>,
    /// The bearing that is the eccentric; without it no life is computed.
    pub bearing: Option<BearingRating>,
}

/// One load of a duty, or the only load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DutyPoint {
    /// The load.
    pub load: LoadCase,
    /// Speed of the wave generator, ring fixed; each point of a duty has one.
    pub input_speed_rpm: Option<f64>,
    /// Its share of the running time, or what is in proportion to it.
    pub share_of_time: f64,
}

/// The loads that a drive bears in turn, one at least.
#[derive(Debug, Clone, PartialEq)]
pub struct Duty {
    /// Each of them.
    pub points: Vec<DutyPoint>,
    /// The one with the largest torque.
    pub hardest: usize,
}

impl Duty {
    /// The load with the largest torque.
    pub fn hardest(&self) -> &LoadCase {
        &self.points[self.hardest].load
    }

    /// Mean speed of the wave generator: revolutions over running time.
    pub fn mean_input_speed_rpm(&self) -> f64 {
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let turned = |point: &DutyPoint| point.share_of_time * point.input_speed_rpm.unwrap_or_default();
        self.points.iter().map(turned).sum::<f64>() / time
    }
}

/// What friction takes over all points of a duty. The means of a sweep to a tolerance keep it, relative to the whole loss but to 1e-10 at the finest; wear, the
/// bearing's load and the products of pressure and velocity are those of the listed input angles.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct LossTotals {
    /// Efficiency over the period, the torque at the driven end given.
    pub efficiency: Efficiencies<f64>,
    /// Whether no torque at the output turns the drive, ring fixed.
    pub self_locking: bool,
    /// The largest error against exact equilibria that was measured at such a loss and such coefficients, of the efficiency with the ring fixed.
    pub efficiency_error: f64,
    /// Whether the coefficients lie where that error was measured; beyond, it is no bound.
    pub is_within_measured_range: bool,
    /// The torque that the wave generator really needs, ring fixed: `load.input_torque_nm` over the efficiency. Of a duty, that of its hardest point.
    pub required_input_torque_nm: f64,
    /// Mean power lost over the input torque times the speed of wave generator against carrier.
    pub loss_ratio: f64,
    /// Where it is lost; these add up to it.
    pub loss_ratio_by_place: LossByPlace,
    /// Mean power lost with the ring fixed, given a speed.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub power_loss_w: Option<f64>,
    /// Where it is lost, in W; these add up to it.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub power_loss_by_place_w: Option<LossByPlace>,
    /// The largest Hertz stress times slip of each contact, ring fixed, in MPa m/s, given a speed. Limits in handbooks hold for the
    /// load over the projected area, which is far less: the two are never compared.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub pressure_velocity_mpa_m_per_s: Option<PerContact<Peak>>,
    /// The largest depth that each part loses in an hour where a tooth touches it, ring fixed, given `friction.wear_rate_mm3_per_nm` and a speed.
    /// Given `deviations` it is what a place would lose if every tooth that passes it bore as much as the one that bears most: no place loses more. A
    /// race, which wears all round, has its true mean.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub wear_mm_per_hour: Option<PerContact<WornPlace>>,
    /// The bearing that is the eccentric, given its `bearing_load_rating_n`; left out where it does not turn.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub bearing: Option<BearingLife>,
}

/// What friction takes from a drive under its duty.
#[derive(Debug, Clone, PartialEq)]
pub struct DutyLosses {
    /// Over all points.
    pub totals: LossTotals,
    /// Of each point, in their order.
    pub points: Vec<PointLosses>,
    /// State by state and angle by angle, of the hardest point.
    pub hardest: Losses,
    /// What a designer should be told.
    pub findings: Vec<Finding>,
}

/// What friction takes at one point of a duty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLosses {
    /// Efficiency with the ring fixed.
    pub efficiency_ring_fixed: f64,
    /// Power lost while it runs, ring fixed, given a speed.
    pub power_loss_w: Option<f64>,
}

/// A drive under its duty, swept at these points.
#[derive(Debug, Clone, Copy)]
pub struct DutySweep<'a> {
    /// The drive.
    pub drive: &'a Drive,
    /// What its single items deviate by.
    pub deviations: &'a Deviations,
    /// Where its sweeps look.
    pub points: Points,
    /// Its loads.
    pub duty: &'a Duty,
}

impl DutySweep<'_> {
    /// What friction takes, given the sweep of the hardest point and what its teeth push the wave generator aside with, where bearings are asked for.
    ///
    /// # Errors
    /// As [`sweep_with_deviations`].
    pub fn losses(
        &self,
        parameters: &LossParameters,
        hardest: &Sweep,
        forces: Option<&RadialForces>,
        stop: &dyn Stop,
    ) -> Result<DutyLosses, SolveError> {
        let Self { drive, deviations, duty, .. } = *self;
        let losses = self.losses_of(parameters, duty.hardest(), hardest, stop)?;
        let cost = |(at, point): (usize, &DutyPoint)| {
            if at == duty.hardest {
                return self.cost(parameters, point, hardest, forces, &losses, stop);
            }
            let sweep = sweep_with_deviations(drive, &point.load, deviations, self.points, stop)?;
            let forces = RadialForces::of(drive, &point.load, deviations, &sweep, stop)?;
            let losses = self.losses_of(parameters, &point.load, &sweep, stop)?;
            self.cost(parameters, point, &sweep, forces.as_ref(), &losses, stop)
        };
        let points = duty.points.iter().enumerate().map(cost).collect::<Result<_, _>>()?;
        let costs = Costs { mechanism: Mechanism::of(drive), parameters, points };
        Ok(DutyLosses {
            totals: costs.totals(duty.hardest, &hardest.states),
            points: costs.points.iter().map(|point| costs.of_point(point)).collect(),
            hardest: losses,
            findings: costs.findings(),
        })
    }

    /// What friction takes of a sweep; the means of one to a tolerance keep it.
    fn losses_of(
        &self,
        parameters: &LossParameters,
        load: &LoadCase,
        sweep: &Sweep,
        stop: &dyn Stop,
    ) -> Result<Losses, SolveError> {
        let losses = Losses::of(self.drive, load, sweep, &parameters.friction, stop)?;
        match self.points {
            Points::Samples(_) => Ok(losses),
            Points::Tolerance(tolerance) => {
                losses.with_mean_to(tolerance.relative(), self.drive, load, self.deviations, &parameters.friction, stop)
            }
        }
    }

    fn cost(
        &self,
        parameters: &LossParameters,
        DutyPoint { load, input_speed_rpm, share_of_time }: &DutyPoint,
        sweep: &Sweep,
        forces: Option<&RadialForces>,
        losses: &Losses,
        stop: &dyn Stop,
    ) -> Result<Cost, SolveError> {
        let LossParameters { friction, wear_rate_mm3_per_nm, bearing } = parameters;
        let mechanism = Mechanism::of_sweep(self.drive, sweep);
        let turning_rad_per_s = input_speed_rpm.map(|speed_rpm| mechanism.turning_rad_per_s(speed_rpm));
        let wear = wear_rate_mm3_per_nm
            .zip(turning_rad_per_s)
            .map(|(rate_mm3_per_nm, turning_rad_per_s)| {
                let wear = WearParameters { rate_mm3_per_nm, turning_rad_per_s };
                Wear::of(self.drive, load, sweep, losses, friction, &wear, stop)
            })
            .transpose()?;
        Ok(Cost {
            input_torque_nm: load.input_torque_nm(self.drive),
            input_speed_rpm: *input_speed_rpm,
            share_of_time: *share_of_time,
            mean: losses.mean,
            pressure_velocity: turning_rad_per_s.map(|turning| losses.pressure_velocity_peaks(sweep, turning)),
            wear,
            bearing: bearing
                .zip(forces)
                .and_then(|(rating, forces)| BearingLoad::of(&mechanism, rating.element, sweep, losses, forces)),
        })
    }
}

/// What one point of a duty, or the only load, costs over a period.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// `M0`: torque of the wave generator without friction.
    pub input_torque_nm: f64,
    /// Speed of the wave generator, ring fixed.
    pub input_speed_rpm: Option<f64>,
    /// Its share of the running time, or what is in proportion to it.
    pub share_of_time: f64,
    /// Mean of ν over the period.
    pub mean: LossByPlace,
    /// The largest `p·v` of each contact.
    pub pressure_velocity: Option<PerContact<Peak>>,
    /// What wears.
    pub wear: Option<Wear>,
    /// What the bearing bears, where it turns.
    pub bearing: Option<BearingLoad>,
}

/// The costs of all points, one at least.
#[derive(Debug)]
pub struct Costs<'a> {
    /// The drive that bears them.
    pub mechanism: Mechanism,
    /// What was asked.
    pub parameters: &'a LossParameters,
    /// Each point.
    pub points: Vec<Cost>,
}

impl Costs<'_> {
    /// A loss ratio over all points: by the powers without friction, since energies add.
    fn loss_ratio(&self, of: impl Fn(&LossByPlace) -> f64) -> f64 {
        if let [only] = self.points.as_slice() {
            return of(&only.mean);
        }
        let (mut ideal, mut lost) = (0.0, 0.0);
        for point in &self.points {
            // Power without friction is in proportion to this, with the same factor at every point.
            let power = point.share_of_time * point.input_torque_nm * point.input_speed_rpm.unwrap_or_default();
            ideal += power;
            lost += power * of(&point.mean);
        }
        lost / ideal
    }

    /// Power lost at a point, ring fixed; none without a speed.
    fn power_at_w(&self, point: &Cost, ratio: f64) -> Option<f64> {
        Some(ratio * point.input_torque_nm * self.mechanism.turning_rad_per_s(point.input_speed_rpm?))
    }

    /// Mean power over time; none without speeds.
    fn power_w(&self, of: impl Fn(&LossByPlace) -> f64) -> Option<f64> {
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let powers =
            self.points.iter().map(|point| Some(point.share_of_time * self.power_at_w(point, of(&point.mean))?));
        powers.sum::<Option<f64>>().map(|power_w| power_w / time)
    }

    /// The largest of any point.
    fn pressure_velocity(&self) -> Option<PerContact<Peak>> {
        let mut points = self.points.iter().map(|point| point.pressure_velocity);
        let first = points.next()??;
        points.try_fold(first, |one, other| {
            let other = other?;
            Some(PerContact::of(|contact| {
                let (one, other) = (*one.get(contact), *other.get(contact));
                if other.value > one.value { other } else { one }
            }))
        })
    }

    fn wear(&self, states: &States) -> Option<PerContact<WornPlace>> {
        let points: Option<Vec<_>> = self
            .points
            .iter()
            .map(|point| Some(WearForTime { share_of_time: point.share_of_time, wear: point.wear.as_ref()? }))
            .collect();
        Wear::over_duty(&points?).largest(states)
    }

    /// The bearing's life; a point at which it does not turn uses nothing of it up.
    fn bearing(&self) -> Option<BearingLife> {
        let rating = self.parameters.bearing?;
        let only = self.points.iter().find_map(|point| point.bearing)?;
        let of_point = |point: &Cost| {
            let turning_rpm = self.mechanism.turning_rad_per_s(point.input_speed_rpm?) * (60.0 / (2.0 * PI));
            let (speed_ratio, load_n) =
                point.bearing.map_or((0.0, 0.0), |bearing| (bearing.speed_ratio, bearing.mean_load_n));
            Some(LoadForRevolutions { load_n, revolutions: point.share_of_time * (speed_ratio * turning_rpm) })
        };
        let Some(loads) = self.points.iter().map(of_point).collect::<Option<Vec<_>>>() else {
            // A single load without a speed.
            return Some(rating.life(only.mean_load_n, None));
        };
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let speed_rpm = loads.iter().map(|load| load.revolutions).sum::<f64>() / time;
        Some(rating.life(rating.element.mean_load_n(&loads), Some(speed_rpm)))
    }

    /// Over all points; wear stands at the states of the hardest.
    pub fn totals(&self, hardest: usize, states: &States) -> LossTotals {
        let Self { mechanism, parameters, points } = self;
        let loss_ratio = self.loss_ratio(LossByPlace::total);
        let efficiency = mechanism.efficiency(Fixed::Ring, loss_ratio);
        let FirstOrderError { efficiency: efficiency_error, is_within_measured_range, .. } =
            parameters.friction.first_order_error(mechanism, mechanism.loss_share(Fixed::Ring, loss_ratio));
        let hardest = &points[hardest];
        LossTotals {
            efficiency: efficiency.into(),
            self_locking: efficiency.is_self_locking(),
            efficiency_error,
            is_within_measured_range,
            required_input_torque_nm: hardest.input_torque_nm / self.of_point(hardest).efficiency_ring_fixed,
            loss_ratio,
            loss_ratio_by_place: LossByPlace::of(|place| self.loss_ratio(place)),
            power_loss_w: self.power_w(LossByPlace::total),
            power_loss_by_place_w: self
                .power_w(LossByPlace::total)
                .map(|_| LossByPlace::of(|place| self.power_w(place).unwrap_or_default())),
            pressure_velocity_mpa_m_per_s: self.pressure_velocity(),
            wear_mm_per_hour: self.wear(states),
            bearing: self.bearing(),
        }
    }

    fn of_point(&self, point: &Cost) -> PointLosses {
        let ratio = point.mean.total();
        PointLosses {
            efficiency_ring_fixed: self.mechanism.efficiency(Fixed::Ring, ratio).driven,
            power_loss_w: self.power_at_w(point, ratio),
        }
    }

    /// About friction, and about the bearing's load where it is largest.
    fn findings(&self) -> Vec<Finding> {
        let loss_ratio = self.loss_ratio(LossByPlace::total);
        let of_friction = findings::of_friction(&self.mechanism, &self.parameters.friction, loss_ratio);
        let most_n = self.points.iter().filter_map(|point| Some(point.bearing?.mean_load_n)).reduce(f64::max);
        let of_bearing = self.parameters.bearing.zip(most_n);
        let of_bearing =
            of_bearing.and_then(|(rating, most_n)| findings::of_bearing(rating.dynamic_load_rating_n, most_n));
        of_friction.into_iter().chain(of_bearing).collect()
    }
}
