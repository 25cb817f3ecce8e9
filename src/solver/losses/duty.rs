//! Friction losses over the load points of a duty cycle. Section 10.5 of docs/explanation/theory.md has the averaging rule
//! of each quantity.

use std::f64::consts::PI;

use crate::contact::PerContact;
use crate::drive::Drive;
use crate::findings::{self, Finding};
use crate::gaps::Deviations;
use crate::load_sharing::{LoadCase, LoadParameters, Torque};
use crate::losses::bearing::{BearingLife, BearingRating};
use crate::losses::period::{BearingLoad, LossByPlace, Losses, RadialForces, Wear};
use crate::losses::wear::{WearParameters, WornPlace};
use crate::losses::{Efficiencies, FirstOrderError, Fixed, Friction, Mechanism};
use crate::sweep::{Peak, Points, States, Sweep, sweep_with_deviations};
use crate::{SolveError, Stop};

/// Loss parameters.
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
    /// The torque.
    pub torque: Torque,
    /// Speed of the wave generator, ring fixed; each point of a duty has one.
    pub input_speed_rpm: Option<f64>,
    /// Share of the running time, or any quantity proportional to it.
    pub share_of_time: f64,
}

/// Loads of a duty cycle. It is empty if there is no load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Duty {
    /// All loads.
    pub points: Vec<DutyPoint>,
    /// Index of the load with the largest torque, which has the largest forces, stresses and wind-up.
    pub hardest: usize,
}

impl Duty {
    /// Returns the mean speed of the wave generator: revolutions divided by running time.
    pub fn mean_input_speed_rpm(&self) -> f64 {
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let turned = |point: &DutyPoint| point.share_of_time * point.input_speed_rpm.unwrap_or_default();
        self.points.iter().map(turned).sum::<f64>() / time
    }
}

/// Friction losses over all points of a duty. The means of a sweep to a tolerance keep it, relative to the total loss,
/// but never below 1e-10. Wear, bearing load and the products of pressure and velocity are those of the listed input
/// angles.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
#[non_exhaustive]
pub struct LossTotals {
    /// Efficiency over the period, the torque at the driven end given.
    pub efficiency: Efficiencies<f64>,
    /// True if no torque at the output turns the drive, ring fixed.
    pub self_locking: bool,
    /// Largest error of the efficiency with the ring fixed against exact equilibria, measured at such a loss and such
    /// coefficients.
    pub efficiency_error: f64,
    /// True if the coefficients are in the range where that error was measured. Outside it the error is not a bound.
    pub is_within_measured_range: bool,
    /// Torque that the wave generator requires with the ring fixed: `load.input_torque_nm` over the efficiency. For a
    /// duty, that of its hardest point.
    pub required_input_torque_nm: f64,
    /// Mean power lost over the input torque times the speed of wave generator against carrier.
    pub loss_ratio: f64,
    /// Loss ratio at each place; the entries add up to the total.
    pub loss_ratio_by_place: LossByPlace,
    /// Mean power lost with the ring fixed, given a speed.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub power_loss_w: Option<f64>,
    /// Power lost at each place, in W; the entries add up to the total.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub power_loss_by_place_w: Option<LossByPlace>,
    /// Largest product of Hertz stress and slip of each contact, ring fixed, in MPa m/s, given a speed. Limits in
    /// handbooks refer to the load over the projected area, which is far less: do not compare the two.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub pressure_velocity_mpa_m_per_s: Option<PerContact<Peak>>,
    /// Largest depth that each part loses per hour where a tooth touches it, ring fixed, given
    /// `friction.wear_rate_mm3_per_nm` and a speed. Given `deviations` it is an upper bound: every passing tooth is
    /// taken to carry as much as the tooth with the largest load. A race wears evenly around its circumference and has
    /// its true mean.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub wear_mm_per_hour: Option<PerContact<WornPlace>>,
    /// Load and life of the bearing that is the eccentric, given its `bearing_load_rating_n`. Left out if the bearing
    /// does not turn.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub bearing: Option<BearingLife>,
}

/// Drive with its duty and sweep points.
#[derive(Debug, Clone, Copy)]
pub struct DutySweep<'a> {
    /// The drive.
    pub drive: &'a Drive,
    /// Load with the torque of the hardest point. The other loads differ from it in the torque alone.
    pub load: &'a LoadCase,
    /// Deviations of its single items.
    pub deviations: &'a Deviations,
    /// Input angles of its sweeps.
    pub points: Points,
    /// The duty.
    pub duty: &'a Duty,
}

impl DutySweep<'_> {
    /// Returns the losses of all points, and those of the hardest for each state and input angle. Takes the sweep of the
    /// hardest point and, if bearings are required, its transverse forces on the wave generator.
    ///
    /// ```
    /// use toothwave_solver::losses::duty::{Duty, DutyPoint, DutySweep, LossParameters};
    /// use toothwave_solver::losses::{Friction, FrictionParameters, WaveGeneratorFriction};
    /// use toothwave_solver::sweep::{Points, sweep};
    /// # use toothwave_solver::{Deviations, Torque};
    /// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
    /// let drive = Drive::new(&DriveParameters::default()).unwrap();
    /// let load = LoadCase::new(&LoadParameters::default()).unwrap();
    ///
    /// let point = |torque, share_of_time| DutyPoint { torque, input_speed_rpm: Some(1500.0), share_of_time };
    /// let duty = Duty { points: vec![point(load.parameters().torque, 0.1), point(Torque::Input(5.0), 0.9)], hardest: 0 };
    /// let friction = Friction::new(&FrictionParameters {
    ///     wave_generator: WaveGeneratorFriction::Plain { coefficient: 0.01 },
    ///     ring_coefficient: 0.05,
    ///     carrier_coefficient: 0.05,
    /// })
    /// .unwrap();
    /// let parameters = LossParameters { friction, wear_rate_mm3_per_nm: None, bearing: None };
    /// let points = Points::samples(50).unwrap();
    /// let hardest = sweep(&drive, &load, points, &Never).unwrap();
    /// let of_duty = DutySweep { drive: &drive, load: &load, deviations: &Deviations::default(), points, duty: &duty };
    /// let (costs, _) = of_duty.losses(&parameters, &hardest, None, &Never).unwrap();
    /// assert!(costs.totals(0, &hardest.states).power_loss_w.is_some());
    /// ```
    ///
    /// # Errors
    /// The errors of [`sweep_with_deviations`]; [`SolveError::Impossible`] for a torque out of its range.
    pub fn losses<'p>(
        &self,
        parameters: &'p LossParameters,
        hardest: &Sweep,
        forces: Option<&RadialForces>,
        stop: &dyn Stop,
    ) -> Result<(Costs<'p>, Losses), SolveError> {
        let Self { drive, load, deviations, duty, .. } = *self;
        let mut losses = self.losses_of(parameters, load, &duty.points[duty.hardest], hardest, stop)?;
        let cost = |(at, point): (usize, &DutyPoint)| {
            if at == duty.hardest {
                return Ok(self.cost(parameters, load, point, hardest, forces, &mut losses));
            }
            let parameters_of_load = LoadParameters { torque: point.torque, ..*load.parameters() };
            let load = LoadCase::new(&parameters_of_load).map_err(SolveError::Impossible)?;
            let sweep = sweep_with_deviations(drive, &load, deviations, self.points, stop)?;
            let forces = RadialForces::of(drive, &load, deviations, &sweep, stop)?;
            let mut losses = self.losses_of(parameters, &load, point, &sweep, stop)?;
            Ok(self.cost(parameters, &load, point, &sweep, forces.as_ref(), &mut losses))
        };
        let points = duty.points.iter().enumerate().map(cost).collect::<Result<_, SolveError>>()?;
        Ok((Costs { mechanism: Mechanism::of(drive), parameters, points }, losses))
    }

    /// Returns the losses of a sweep. The means of a sweep to a tolerance keep it.
    fn losses_of(
        &self,
        LossParameters { friction, wear_rate_mm3_per_nm, .. }: &LossParameters,
        load: &LoadCase,
        point: &DutyPoint,
        sweep: &Sweep,
        stop: &dyn Stop,
    ) -> Result<Losses, SolveError> {
        let wear = wear_rate_mm3_per_nm.zip(point.input_speed_rpm).map(|(rate_mm3_per_nm, speed_rpm)| {
            let turning_rad_per_s = Mechanism::of(self.drive).turning_rad_per_s(speed_rpm);
            WearParameters { rate_mm3_per_nm, turning_rad_per_s }
        });
        let losses = Losses::of(self.drive, load, sweep, friction, wear.as_ref(), stop)?;
        match self.points {
            Points::Samples(_) => Ok(losses),
            Points::Tolerance(tolerance) => {
                losses.with_mean_to(tolerance.relative(), self.drive, load, self.deviations, friction, stop)
            }
        }
    }

    /// Returns the losses of a point. Takes the wear out of its losses.
    fn cost(
        &self,
        parameters: &LossParameters,
        load: &LoadCase,
        &DutyPoint { input_speed_rpm, share_of_time, .. }: &DutyPoint,
        sweep: &Sweep,
        forces: Option<&RadialForces>,
        losses: &mut Losses,
    ) -> Cost {
        let mechanism = Mechanism { mesh: sweep.mesh, ..Mechanism::of(self.drive) };
        let turning_rad_per_s = input_speed_rpm.map(|speed_rpm| mechanism.turning_rad_per_s(speed_rpm));
        Cost {
            input_torque_nm: load.input_torque_nm(self.drive),
            input_speed_rpm,
            share_of_time,
            mean: losses.mean,
            pressure_velocity: turning_rad_per_s.map(|turning| losses.pressure_velocity_peaks(sweep, turning)),
            wear: losses.wear.take(),
            bearing: parameters
                .bearing
                .zip(forces)
                .and_then(|(rating, forces)| BearingLoad::of(&mechanism, rating.element, sweep, losses, forces)),
        }
    }
}

/// Losses of one point of a duty, or of the only load, over a period.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// `M0`: torque of the wave generator without friction.
    pub input_torque_nm: f64,
    /// Speed of the wave generator, ring fixed.
    pub input_speed_rpm: Option<f64>,
    /// Share of the running time, or any quantity proportional to it.
    pub share_of_time: f64,
    /// Mean of ν over the period.
    pub mean: LossByPlace,
    /// Largest `p·v` of each contact.
    pub pressure_velocity: Option<PerContact<Peak>>,
    /// Wear of the parts.
    pub wear: Option<Wear>,
    /// Load on the bearing, if it turns.
    pub bearing: Option<BearingLoad>,
}

/// Losses of all points, at least one.
#[derive(Debug)]
pub struct Costs<'a> {
    /// Drive that carries the loads.
    pub mechanism: Mechanism,
    /// Loss parameters.
    pub parameters: &'a LossParameters,
    /// Losses of each point.
    pub points: Vec<Cost>,
}

impl Costs<'_> {
    /// Returns the loss ratio over all points, weighted by the power without friction, since energies add.
    fn loss_ratio(&self, of: impl Fn(&LossByPlace) -> f64) -> f64 {
        if let [only] = self.points.as_slice() {
            return of(&only.mean);
        }
        let (mut ideal, mut lost) = (0.0, 0.0);
        for point in &self.points {
            // Power without friction is proportional to this, with the same factor at every point.
            let power = point.share_of_time * point.input_torque_nm * point.input_speed_rpm.unwrap_or_default();
            ideal += power;
            lost += power * of(&point.mean);
        }
        lost / ideal
    }

    /// Returns the power lost at a point, ring fixed; none without a speed.
    fn power_at_w(&self, point: &Cost, ratio: f64) -> Option<f64> {
        Some(ratio * point.input_torque_nm * self.mechanism.turning_rad_per_s(point.input_speed_rpm?))
    }

    /// Returns the mean power over time; none without speeds.
    fn power_w(&self, of: impl Fn(&LossByPlace) -> f64) -> Option<f64> {
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let powers =
            self.points.iter().map(|point| Some(point.share_of_time * self.power_at_w(point, of(&point.mean))?));
        powers.sum::<Option<f64>>().map(|power_w| power_w / time)
    }

    /// Returns the largest value of all points.
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
        let points: Option<Vec<_>> =
            self.points.iter().map(|point| Some((point.share_of_time, point.wear.as_ref()?))).collect();
        Wear::over_duty(&points?).largest(states)
    }

    /// Returns the bearing's life. A point at which it does not turn uses no life.
    fn bearing(&self) -> Option<BearingLife> {
        let rating = self.parameters.bearing?;
        let only = self.points.iter().find_map(|point| point.bearing)?;
        let of_point = |point: &Cost| {
            let turning_rpm = self.mechanism.turning_rad_per_s(point.input_speed_rpm?) * (60.0 / (2.0 * PI));
            let (speed_ratio, load_n) =
                point.bearing.map_or((0.0, 0.0), |bearing| (bearing.speed_ratio, bearing.mean_load_n));
            Some((load_n, point.share_of_time * (speed_ratio * turning_rpm)))
        };
        let Some(loads) = self.points.iter().map(of_point).collect::<Option<Vec<_>>>() else {
            // A single load without a speed.
            return Some(rating.life(only.mean_load_n, None));
        };
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let speed_rpm = loads.iter().map(|(_, revolutions)| revolutions).sum::<f64>() / time;
        Some(rating.life(rating.element.mean_load_n(&loads), Some(speed_rpm)))
    }

    /// Returns the totals over all points. Wear refers to the states of the hardest point.
    pub fn totals(&self, hardest: usize, states: &States) -> LossTotals {
        let Self { mechanism, parameters, points } = self;
        let loss_ratio = self.loss_ratio(LossByPlace::total);
        let efficiency = mechanism.efficiency(Fixed::Ring, loss_ratio);
        let FirstOrderError { efficiency: efficiency_error, is_within_measured_range, .. } =
            parameters.friction.first_order_error(mechanism, mechanism.loss_share(Fixed::Ring, loss_ratio));
        LossTotals {
            efficiency,
            self_locking: efficiency.back_driven <= 0.0,
            efficiency_error,
            is_within_measured_range,
            required_input_torque_nm: points[hardest].input_torque_nm / self.efficiency_at(hardest),
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

    /// Returns the efficiency at a point with the ring fixed.
    pub fn efficiency_at(&self, at: usize) -> f64 {
        self.mechanism.efficiency(Fixed::Ring, self.points[at].mean.total()).driven
    }

    /// Returns the power lost while a point runs, ring fixed; none without a speed.
    pub fn power_loss_at_w(&self, at: usize) -> Option<f64> {
        self.power_at_w(&self.points[at], self.points[at].mean.total())
    }

    /// Returns the findings about friction, and about the bearing at its largest load.
    pub fn findings(&self) -> Vec<Finding> {
        let loss_ratio = self.loss_ratio(LossByPlace::total);
        let of_friction = findings::of_friction(&self.mechanism, &self.parameters.friction, loss_ratio);
        let most_n = self.points.iter().filter_map(|point| Some(point.bearing?.mean_load_n)).reduce(f64::max);
        let of_bearing = self.parameters.bearing.zip(most_n);
        let of_bearing =
            of_bearing.and_then(|(rating, most_n)| findings::of_bearing(rating.dynamic_load_rating_n, most_n));
        of_friction.into_iter().chain(of_bearing).collect()
    }
}
