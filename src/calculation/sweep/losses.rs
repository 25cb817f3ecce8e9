//! What friction takes, and what pushes the wave generator aside, as they go over the wire.

use std::f64::consts::PI;
use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::losses::bearing::LoadForRevolutions;
use toothwave_solver::losses::duty::{BearingLoadForTime, DutyPoint, bearing_life_h};
use toothwave_solver::losses::period::{self, BearingLoad, LossRatio, RadialForces, Wear, WearForTime};
use toothwave_solver::losses::{Efficiency, FirstOrderError, Fixed, Friction, Mechanism};
use toothwave_solver::sweep::{Peak, States, Sweep};
use toothwave_solver::{Contact, PerContact};
use utoipa::ToSchema;

use crate::design::BearingRating;
use crate::no_answer::NoAnswer;
use crate::question::require_finite;
use crate::sweep::peak::PeakAnswer;

/// What friction takes, to first order in its coefficients; given `friction`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LossesAnswer {
    /// What there is one number of.
    #[serde(flatten)]
    pub totals: LossTotalsAnswer,
    /// How fast the tooth's surface slips over the part's, along the counter-clockwise tangent, per radian of wave generator against carrier;
    /// at a race over the race.
    pub slip_mm_per_rad: SlipAnswer,
    /// The contact at which the tooth rolls, one entry a state.
    pub rolls: Vec<RollsAnswer>,
    /// The same at each input angle.
    pub by_input_angle: LossesByInputAngleAnswer,
}

/// Losses over the period; over all points of a duty, as `duty` has it. Of a sweep to a tolerance the means keep it, relative to the whole loss but to 1e-10 at
/// the finest; wear, the bearing's load and the products of pressure and velocity are those of the listed input angles.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LossTotalsAnswer {
    /// Efficiency over the period.
    pub efficiency: EfficiencyAnswer,
    /// Whether no torque at the output turns the drive, over the period.
    pub self_locking: SelfLockingAnswer,
    /// The largest error against exact equilibria that was measured at such a loss and such coefficients, of the efficiency with the ring fixed.
    pub efficiency_error: f64,
    /// Whether the coefficients lie where that error was measured; beyond, it is no bound.
    pub is_within_measured_range: bool,
    /// The torque that the wave generator really needs, ring fixed: `load.input_torque_nm` over the efficiency. Of a duty, that of its hardest point.
    pub required_input_torque_nm: f64,
    /// Mean power lost over the input torque times the speed of wave generator against carrier.
    pub loss_ratio: f64,
    /// Where it is lost; these add up to it.
    pub loss_ratio_by_place: LossByPlaceAnswer,
    /// Mean power lost with the ring fixed, given a speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub power_loss_w: Option<f64>,
    /// Where it is lost, in W; these add up to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub power_loss_by_place_w: Option<LossByPlaceAnswer>,
    /// The largest Hertz stress times slip of each contact, ring fixed, in MPa m/s, given a speed. Limits in handbooks hold for the
    /// load over the projected area, which is far less: the two are never compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub pressure_velocity_mpa_m_per_s: Option<PressureVelocityAnswer>,
    /// The largest depth that each part loses in an hour where a tooth touches it, ring fixed, given `friction.wear_rate_mm3_per_nm` and a speed.
    /// Given `deviations` it is what a place would lose if every tooth that passes it bore as much as the one that bears most: no place loses more. A
    /// race, which wears all round, has its true mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub wear_mm_per_hour: Option<WearAnswer>,
    /// The bearing that is the eccentric, given its `bearing_load_rating_n`; left out where it does not turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub bearing: Option<BearingAnswer>,
}

/// How fast each part wears by Archard's law where it wears most.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WearAnswer {
    /// The wave generator, or its race.
    pub wave_generator: WearPlaceAnswer,
    /// The ring.
    pub ring: WearPlaceAnswer,
    /// The carrier.
    pub carrier: WearPlaceAnswer,
}

/// A depth and where it is; a race wears all round, and has no place.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WearPlaceAnswer {
    /// The depth, in mm an hour.
    pub value: f64,
    /// Input angle at which a tooth touches it there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub input_angle_deg: Option<f64>,
    /// Position of that tooth, from the middle of its lobe.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub position_deg: Option<f64>,
}

/// Load and basic rating life (ISO 281, 90 % reliability, no factor for lubrication) of the bearing that is the eccentric.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct BearingAnswer {
    /// The constant radial load under which it would last as long.
    pub mean_load_n: f64,
    /// Millions of revolutions of one of its rings against the other.
    pub life_million_revolutions: f64,
    /// How fast they turn against each other, ring of the drive fixed, given a speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub speed_rpm: Option<f64>,
    /// The life in hours, given a speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub life_h: Option<f64>,
}

/// Power out over power in, the torque at the driven end given, by the member that stands still. Driven from behind, an efficiency at or
/// below 0 means that the drive locks itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct EfficiencyAnswer {
    /// The wave generator drives the carrier.
    pub ring_fixed: f64,
    /// The wave generator drives the ring.
    pub carrier_fixed: f64,
    /// The ring drives the carrier.
    pub wave_generator_fixed: f64,
    /// The carrier drives the wave generator.
    pub ring_fixed_back_driven: f64,
    /// The ring drives the wave generator.
    pub carrier_fixed_back_driven: f64,
    /// The carrier drives the ring.
    pub wave_generator_fixed_back_driven: f64,
}

/// Whether no torque at the output turns the drive, by the member that stands still.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct SelfLockingAnswer {
    /// The carrier does not drive the wave generator.
    pub ring_fixed: bool,
    /// The ring does not drive the wave generator.
    pub carrier_fixed: bool,
    /// The carrier does not drive the ring.
    pub wave_generator_fixed: bool,
}

/// A loss by where it is lost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, ToSchema)]
pub struct LossByPlaceAnswer {
    /// Between teeth and wave generator, or its race.
    pub wave_generator: f64,
    /// Between teeth and ring.
    pub ring: f64,
    /// Between teeth and carrier.
    pub carrier: f64,
    /// In the bearing between cam and race; 0 of a plain cam.
    pub bearing: f64,
}

/// The largest pressure times velocity of each contact.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PressureVelocityAnswer {
    /// At the wave generator.
    pub wave_generator: PeakAnswer,
    /// At the ring.
    pub ring: PeakAnswer,
    /// At the carrier.
    pub carrier: PeakAnswer,
}

/// Slips in columns, one entry a state.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SlipAnswer {
    /// At the wave generator, or its race.
    pub wave_generator: Vec<f64>,
    /// At the ring.
    pub ring: Vec<f64>,
    /// At the carrier.
    pub carrier: Vec<f64>,
}

/// The contact at which a tooth rolls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollsAnswer {
    /// At the wave generator, or its race.
    WaveGenerator,
    /// At the ring.
    Ring,
    /// At the carrier.
    Carrier,
    /// At none: it cannot spin, carries nothing or has no friction.
    Nowhere,
}

/// Columns of equal length, one entry an input angle; where a tooth enters an angle may stand twice, without it and with it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LossesByInputAngleAnswer {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Power lost over the input torque times the speed of wave generator against carrier.
    pub loss_ratio: Vec<f64>,
    /// The efficiencies there.
    pub efficiency: EfficienciesAnswer,
}

/// Efficiencies in columns, named as over the period.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct EfficienciesAnswer {
    /// The wave generator drives the carrier.
    pub ring_fixed: Vec<f64>,
    /// The wave generator drives the ring.
    pub carrier_fixed: Vec<f64>,
    /// The ring drives the carrier.
    pub wave_generator_fixed: Vec<f64>,
    /// The carrier drives the wave generator.
    pub ring_fixed_back_driven: Vec<f64>,
    /// The ring drives the wave generator.
    pub carrier_fixed_back_driven: Vec<f64>,
    /// The carrier drives the ring.
    pub wave_generator_fixed_back_driven: Vec<f64>,
}

/// What the teeth push the wave generator aside with, where no two lobes are loaded alike: columns of equal length, one entry an input angle.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RadialForceAnswer {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// The force, in N.
    pub value: Vec<f64>,
    /// Its direction in the wave generator's frame, from the middle of lobe 0.
    pub direction_deg: Vec<f64>,
}

/// What one point of a duty, or the only load, costs: all but its columns.
#[derive(Debug)]
pub(super) struct Cost {
    pub(super) input_torque_nm: f64,
    pub(super) input_speed_rpm: Option<f64>,
    pub(super) share_of_time: f64,
    pub(super) mean: LossRatio,
    pub(super) pressure_velocity: Option<PerContact<Peak>>,
    pub(super) wear: Option<Wear>,
    pub(super) bearing: Option<BearingLoad>,
}

/// The costs of all points, one at least.
pub(super) struct Costs<'a> {
    pub(super) mechanism: Mechanism,
    pub(super) friction: &'a Friction,
    pub(super) bearing_rating: Option<BearingRating>,
    pub(super) points: Vec<Cost>,
}

/// A bearing's dynamic load rating, and the largest of its points' mean loads.
pub(super) struct BearingLoaded {
    pub(super) rating_n: f64,
    pub(super) load_n: f64,
}

impl Costs<'_> {
    /// A loss ratio over all points: by the powers without friction, since energies add.
    fn loss_ratio(&self, of: impl Fn(&LossRatio) -> f64) -> f64 {
        if let [only] = self.points.as_slice() {
            return of(&only.mean);
        }
        let points: Vec<_> = self.points.iter().filter_map(|point| point.of_duty(of(&point.mean))).collect();
        self.mechanism.duty(&points).loss_ratio
    }

    /// ν over all points.
    pub(super) fn total_loss_ratio(&self) -> f64 {
        self.loss_ratio(LossRatio::total)
    }

    /// Mean power over time; none without speeds.
    fn power_w(&self, of: impl Fn(&LossRatio) -> f64) -> Option<f64> {
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let powers = self.points.iter().map(|point| {
            let turning_rad_per_s = self.mechanism.turning_rad_per_s(point.input_speed_rpm?);
            Some(point.share_of_time * (of(&point.mean) * point.input_torque_nm * turning_rad_per_s))
        });
        powers.sum::<Option<f64>>().map(|power_w| power_w / time)
    }

    fn by_place(&self, quantity: impl Fn(&dyn Fn(&LossRatio) -> f64) -> Option<f64>) -> Option<LossByPlaceAnswer> {
        Some(LossByPlaceAnswer {
            wave_generator: quantity(&|ratio| ratio.contacts.wave_generator)?,
            ring: quantity(&|ratio| ratio.contacts.ring)?,
            carrier: quantity(&|ratio| ratio.contacts.carrier)?,
            bearing: quantity(&|ratio| ratio.bearing)?,
        })
    }

    /// The largest of any point.
    fn pressure_velocity(&self) -> Option<PressureVelocityAnswer> {
        let points: Option<Vec<_>> = self.points.iter().map(|point| point.pressure_velocity).collect();
        let points = points?;
        let larger = |one: PerContact<Peak>, other: &PerContact<Peak>| {
            PerContact::of(|contact| {
                let (one, other) = (*one.get(contact), *other.get(contact));
                if other.value > one.value { other } else { one }
            })
        };
        Some(points.iter().skip(1).fold(*points.first()?, larger).into())
    }

    fn wear(&self, states: &States) -> Option<WearAnswer> {
        fn of_point(point: &Cost) -> Option<WearForTime<'_>> {
            Some(WearForTime { share_of_time: point.share_of_time, wear: point.wear.as_ref()? })
        }
        let points: Option<Vec<_>> = self.points.iter().map(of_point).collect();
        let wear = Wear::over_duty(&points?);
        let peaks = wear.peaks(states);
        let place = |peak: Option<Peak>| {
            peak.map(|Peak { value, input_angle_deg, position_deg }| WearPlaceAnswer {
                value,
                input_angle_deg: Some(input_angle_deg),
                position_deg: Some(position_deg),
            })
        };
        let of_race =
            wear.race_mm_per_hour.map(|value| WearPlaceAnswer { value, input_angle_deg: None, position_deg: None });
        Some(WearAnswer {
            wave_generator: place(peaks.wave_generator).or(of_race)?,
            ring: place(peaks.ring)?,
            carrier: place(peaks.carrier)?,
        })
    }

    /// What the bearing bears at the point where it bears most, of those at which it turns.
    pub(super) fn bearing_load(&self) -> Option<BearingLoaded> {
        let BearingRating { dynamic_load_rating_n: rating_n, .. } = self.bearing_rating?;
        let loads_n = self.points.iter().filter_map(|point| Some(point.bearing?.mean_load_n));
        loads_n.reduce(f64::max).map(|load_n| BearingLoaded { rating_n, load_n })
    }

    /// A point at which the bearing does not turn uses nothing of its life up.
    fn bearing(&self) -> Option<BearingAnswer> {
        let BearingRating { dynamic_load_rating_n, element } = self.bearing_rating?;
        let turning: Vec<_> = self.points.iter().filter_map(|point| Some((point, point.bearing?))).collect();
        let (_, only) = turning.first()?;
        let revolutions_million =
            |mean_load_n: f64| 60.0 * 1e-6 * element.life_h(dynamic_load_rating_n, mean_load_n, 1.0);
        let with_speed: Option<Vec<_>> = self
            .points
            .iter()
            .map(|point| {
                let turning_rpm = self.mechanism.turning_rad_per_s(point.input_speed_rpm?) * (60.0 / (2.0 * PI));
                let (speed_ratio, mean_load_n) =
                    point.bearing.map_or((0.0, 0.0), |bearing| (bearing.speed_ratio, bearing.mean_load_n));
                let speed_rpm = speed_ratio * turning_rpm;
                Some(BearingLoadForTime { share_of_time: point.share_of_time, speed_rpm, mean_load_n })
            })
            .collect();
        let Some(points) = with_speed else {
            // A single load without a speed.
            let mean_load_n = only.mean_load_n;
            let life_million_revolutions = revolutions_million(mean_load_n);
            return Some(BearingAnswer { mean_load_n, life_million_revolutions, speed_rpm: None, life_h: None });
        };
        let loads: Vec<_> = points
            .iter()
            .map(|point| LoadForRevolutions {
                load_n: point.mean_load_n,
                revolutions: point.share_of_time * point.speed_rpm,
            })
            .collect();
        let mean_load_n = element.mean_load_n(&loads);
        let time: f64 = points.iter().map(|point| point.share_of_time).sum();
        Some(BearingAnswer {
            mean_load_n,
            life_million_revolutions: revolutions_million(mean_load_n),
            speed_rpm: Some(loads.iter().map(|load| load.revolutions).sum::<f64>() / time),
            life_h: Some(bearing_life_h(element, dynamic_load_rating_n, &points)),
        })
    }

    pub(super) fn totals(&self, hardest: usize, states: &States) -> LossTotalsAnswer {
        let Self { mechanism, friction, points, .. } = self;
        let loss_ratio = self.total_loss_ratio();
        let FirstOrderError { efficiency: efficiency_error, is_within_measured_range, .. } =
            friction.first_order_error(mechanism, mechanism.loss_share(Fixed::Ring, loss_ratio));
        let hardest = &points[hardest];
        let efficiency_there = mechanism.efficiency(Fixed::Ring, hardest.mean.total()).driven;
        LossTotalsAnswer {
            efficiency: EfficiencyAnswer::new(mechanism, loss_ratio),
            self_locking: SelfLockingAnswer::new(mechanism, loss_ratio),
            efficiency_error,
            is_within_measured_range,
            required_input_torque_nm: hardest.input_torque_nm / efficiency_there,
            loss_ratio,
            loss_ratio_by_place: self.by_place(|of| Some(self.loss_ratio(of))).unwrap_or_default(),
            power_loss_w: self.power_w(LossRatio::total),
            power_loss_by_place_w: self.by_place(|of| self.power_w(of)),
            pressure_velocity_mpa_m_per_s: self.pressure_velocity(),
            wear_mm_per_hour: self.wear(states),
            bearing: self.bearing(),
        }
    }

    /// Each point, as the answer lists it.
    pub(super) fn of_points(&self) -> impl Iterator<Item = PointCost> {
        self.points.iter().map(|point| {
            let ratio = point.mean.total();
            let power_w = |speed_rpm| ratio * point.input_torque_nm * self.mechanism.turning_rad_per_s(speed_rpm);
            PointCost {
                efficiency_ring_fixed: self.mechanism.efficiency(Fixed::Ring, ratio).driven,
                power_loss_w: point.input_speed_rpm.map(power_w),
            }
        })
    }
}

/// What a point of a duty costs.
pub(super) struct PointCost {
    pub(super) efficiency_ring_fixed: f64,
    pub(super) power_loss_w: Option<f64>,
}

impl Cost {
    fn of_duty(&self, loss_ratio: f64) -> Option<DutyPoint> {
        let Self { input_torque_nm, share_of_time, .. } = *self;
        Some(DutyPoint { share_of_time, input_speed_rpm: self.input_speed_rpm?, input_torque_nm, loss_ratio })
    }
}

impl LossesAnswer {
    /// The losses over all points, with the columns of the hardest, whose sweep and losses these are.
    pub(super) fn new(
        costs: &Costs<'_>,
        hardest: usize,
        sweep: &Sweep,
        losses: period::Losses,
    ) -> Result<Self, NoAnswer> {
        let mechanism = &costs.mechanism;
        let columns = |of: &dyn Fn(EfficiencyAnswer) -> f64| -> Vec<f64> {
            losses.loss_ratio.iter().map(|&ratio| of(EfficiencyAnswer::new(mechanism, ratio))).collect()
        };
        let answer = Self {
            totals: costs.totals(hardest, &sweep.states),
            by_input_angle: LossesByInputAngleAnswer {
                input_angle_deg: sweep.input_angles.input_angle_deg.clone(),
                efficiency: EfficienciesAnswer {
                    ring_fixed: columns(&|of| of.ring_fixed),
                    carrier_fixed: columns(&|of| of.carrier_fixed),
                    wave_generator_fixed: columns(&|of| of.wave_generator_fixed),
                    ring_fixed_back_driven: columns(&|of| of.ring_fixed_back_driven),
                    carrier_fixed_back_driven: columns(&|of| of.carrier_fixed_back_driven),
                    wave_generator_fixed_back_driven: columns(&|of| of.wave_generator_fixed_back_driven),
                },
                loss_ratio: losses.loss_ratio,
            },
            slip_mm_per_rad: SlipAnswer {
                wave_generator: losses.slip_mm_per_rad.wave_generator,
                ring: losses.slip_mm_per_rad.ring,
                carrier: losses.slip_mm_per_rad.carrier,
            },
            rolls: losses.rolls.into_iter().map(RollsAnswer::from).collect(),
        };
        let SlipAnswer { wave_generator, ring, carrier } = &answer.slip_mm_per_rad;
        let numbers = answer.totals.numbers();
        require_finite([wave_generator, ring, carrier, &answer.by_input_angle.loss_ratio, &numbers])?;
        Ok(answer)
    }
}

impl LossTotalsAnswer {
    /// All that others follow from by finite means.
    fn numbers(&self) -> Vec<f64> {
        let mut numbers = vec![
            self.loss_ratio,
            self.efficiency_error,
            self.required_input_torque_nm,
            self.efficiency.ring_fixed_back_driven,
            self.efficiency.carrier_fixed_back_driven,
        ];
        numbers.extend(self.power_loss_w);
        if let Some(PressureVelocityAnswer { wave_generator, ring, carrier }) = &self.pressure_velocity_mpa_m_per_s {
            numbers.extend([wave_generator.value, ring.value, carrier.value]);
        }
        if let Some(WearAnswer { wave_generator, ring, carrier }) = &self.wear_mm_per_hour {
            numbers.extend([wave_generator.value, ring.value, carrier.value]);
        }
        if let Some(BearingAnswer { mean_load_n, life_million_revolutions, speed_rpm, life_h }) = &self.bearing {
            numbers.extend([*mean_load_n, *life_million_revolutions]);
            numbers.extend(speed_rpm.iter().chain(life_h));
        }
        numbers
    }

    pub(super) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        let percent = |share: f64| 100.0 * share;
        let EfficiencyAnswer {
            ring_fixed,
            carrier_fixed,
            wave_generator_fixed,
            ring_fixed_back_driven,
            carrier_fixed_back_driven,
            wave_generator_fixed_back_driven,
        } = self.efficiency;
        writeln!(writer, "\nefficiency             driven   from behind")?;
        for (name, driven, back_driven) in [
            ("ring fixed", ring_fixed, ring_fixed_back_driven),
            ("carrier fixed", carrier_fixed, carrier_fixed_back_driven),
            ("wave generator fixed", wave_generator_fixed, wave_generator_fixed_back_driven),
        ] {
            let locks = if back_driven <= 0.0 { " (locks itself)" } else { "" };
            writeln!(writer, "{name:<20} {:>6.2} %      {:>6.2} %{locks}", percent(driven), percent(back_driven))?;
        }
        let torque_nm = self.required_input_torque_nm;
        writeln!(writer, "input torque with losses            {torque_nm:.6} N·m, ring fixed")?;
        if let Some(power_w) = self.power_loss_w {
            writeln!(writer, "power lost, ring fixed              {power_w:.6} W")?;
        }
        let LossByPlaceAnswer { wave_generator, ring, carrier, bearing } = self.loss_ratio_by_place;
        for (name, ratio) in
            [("wave generator", wave_generator), ("ring", ring), ("carrier", carrier), ("bearing", bearing)]
        {
            // Without friction there is no share of it.
            let share = if self.loss_ratio > 0.0 { ratio / self.loss_ratio } else { 0.0 };
            writeln!(writer, "  of it at the {name:<14}         {:>6.2} %", percent(share))?;
        }
        if let Some(PressureVelocityAnswer { wave_generator, ring, carrier }) = &self.pressure_velocity_mpa_m_per_s {
            for (name, peak) in [("wave generator", wave_generator), ("ring", ring), ("carrier", carrier)] {
                let PeakAnswer { value, input_angle_deg, position_deg } = peak;
                writeln!(
                    writer,
                    "{name:<14} p·v    {value:>14.3} MPa m/s {input_angle_deg:>5.4} deg {position_deg:>9.4} deg"
                )?;
            }
        }
        if let Some(WearAnswer { wave_generator, ring, carrier }) = &self.wear_mm_per_hour {
            for (name, wear) in [("wave generator", wave_generator), ("ring", ring), ("carrier", carrier)] {
                write!(writer, "{name:<14} wear   {:>14.3e} mm/h    ", wear.value)?;
                match wear.input_angle_deg.zip(wear.position_deg) {
                    Some((input_angle_deg, position_deg)) => {
                        writeln!(writer, "{input_angle_deg:>5.4} deg {position_deg:>9.4} deg")?;
                    }
                    None => writeln!(writer, "all round")?,
                }
            }
        }
        if let Some(BearingAnswer { mean_load_n, life_million_revolutions, speed_rpm, life_h }) = &self.bearing {
            writeln!(writer, "mean load on the bearing            {mean_load_n:.6} N")?;
            writeln!(writer, "its life                            {life_million_revolutions:.4e} million revolutions")?;
            if let Some((speed_rpm, life_h)) = speed_rpm.zip(*life_h) {
                writeln!(writer, "                                    {life_h:.4e} h at {speed_rpm:.6} rpm")?;
            }
        }
        Ok(())
    }
}

impl EfficiencyAnswer {
    fn new(mechanism: &Mechanism, loss_ratio: f64) -> Self {
        let of = |fixed| mechanism.efficiency(fixed, loss_ratio);
        let [ring, carrier, wave_generator]: [Efficiency; 3] =
            [of(Fixed::Ring), of(Fixed::Carrier), of(Fixed::WaveGenerator)];
        Self {
            ring_fixed: ring.driven,
            carrier_fixed: carrier.driven,
            wave_generator_fixed: wave_generator.driven,
            ring_fixed_back_driven: ring.back_driven,
            carrier_fixed_back_driven: carrier.back_driven,
            wave_generator_fixed_back_driven: wave_generator.back_driven,
        }
    }
}

impl SelfLockingAnswer {
    fn new(mechanism: &Mechanism, loss_ratio: f64) -> Self {
        let locks = |fixed| mechanism.efficiency(fixed, loss_ratio).is_self_locking();
        Self {
            ring_fixed: locks(Fixed::Ring),
            carrier_fixed: locks(Fixed::Carrier),
            wave_generator_fixed: locks(Fixed::WaveGenerator),
        }
    }
}

impl From<PerContact<Peak>> for PressureVelocityAnswer {
    fn from(peaks: PerContact<Peak>) -> Self {
        Self { wave_generator: peaks.wave_generator.into(), ring: peaks.ring.into(), carrier: peaks.carrier.into() }
    }
}

impl From<Option<Contact>> for RollsAnswer {
    fn from(rolls: Option<Contact>) -> Self {
        match rolls {
            Some(Contact::WaveGenerator) => Self::WaveGenerator,
            Some(Contact::Ring) => Self::Ring,
            Some(Contact::Carrier) => Self::Carrier,
            None => Self::Nowhere,
        }
    }
}

impl RadialForceAnswer {
    pub(super) fn new(sweep: &Sweep, forces: RadialForces) -> Result<Self, NoAnswer> {
        let RadialForces { force_n, direction_deg } = forces;
        require_finite([&force_n, &direction_deg])?;
        Ok(Self { input_angle_deg: sweep.input_angles.input_angle_deg.clone(), value: force_n, direction_deg })
    }
}
