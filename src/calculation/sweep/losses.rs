//! What friction takes, and what pushes the wave generator aside, as they go over the wire.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::losses::period::{self, LossRatio, RadialForces};
use toothwave_solver::losses::{Efficiency, FirstOrderError, Fixed, Friction, Mechanism};
use toothwave_solver::sweep::{Peak, Sweep};
use toothwave_solver::{Contact, Drive, PerContact};
use utoipa::ToSchema;

use crate::no_answer::NoAnswer;
use crate::question::require_finite;
use crate::sweep::answer::PeakAnswer;

/// What friction takes, to first order in its coefficients; given `friction`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LossesAnswer {
    /// Efficiency over the period.
    pub efficiency: EfficiencyAnswer,
    /// Whether no torque at the output turns the drive, over the period.
    pub self_locking: SelfLockingAnswer,
    /// The largest error against exact equilibria that was measured at such a loss and such coefficients, of the efficiency with the ring fixed.
    pub efficiency_error: f64,
    /// Whether the coefficients lie where that error was measured; beyond, it is no bound.
    pub is_within_measured_range: bool,
    /// The torque that the wave generator really needs, ring fixed: `load.input_torque_nm` over the efficiency.
    pub required_input_torque_nm: f64,
    /// Mean power lost over the input torque times the speed of wave generator against carrier.
    pub loss_ratio: f64,
    /// Where it is lost; these add up to it.
    pub loss_ratio_by_place: LossByPlaceAnswer,
    /// Mean power lost with the ring fixed, given `load.input_speed_rpm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub power_loss_w: Option<f64>,
    /// Where it is lost, in W; these add up to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub power_loss_by_place_w: Option<LossByPlaceAnswer>,
    /// The largest Hertz stress times slip of each contact, ring fixed, in MPa m/s, given `load.input_speed_rpm`. Limits in handbooks hold for the
    /// load over the projected area, which is far less: the two are never compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub pressure_velocity_mpa_m_per_s: Option<PressureVelocityAnswer>,
    /// How fast the tooth's surface slips over the part's, along the counter-clockwise tangent, per radian of wave generator against carrier;
    /// at a race over the race.
    pub slip_mm_per_rad: SlipAnswer,
    /// The contact at which the tooth rolls, one entry a state.
    pub rolls: Vec<RollsAnswer>,
    /// The same at each input angle.
    pub by_input_angle: LossesByInputAngleAnswer,
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
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

impl LossesAnswer {
    pub(super) fn new(
        drive: &Drive,
        friction: &Friction,
        input_torque_nm: f64,
        input_speed_rpm: Option<f64>,
        sweep: &Sweep,
        losses: period::Losses,
    ) -> Result<Self, NoAnswer> {
        let mechanism = Mechanism::of(drive);
        let loss_ratio = losses.mean.total();
        let efficiency = EfficiencyAnswer::new(&mechanism, loss_ratio);
        let FirstOrderError { efficiency: efficiency_error, is_within_measured_range, .. } =
            friction.first_order_error(&mechanism, mechanism.loss_share(Fixed::Ring, loss_ratio));
        let turning_rad_per_s = input_speed_rpm.map(|speed_rpm| mechanism.turning_rad_per_s(speed_rpm));
        let power_w = |ratio: f64, turning_rad_per_s: f64| ratio * input_torque_nm * turning_rad_per_s;
        let by_place = LossByPlaceAnswer::of(&losses.mean, |ratio| ratio);
        let columns = |of: &dyn Fn(EfficiencyAnswer) -> f64| -> Vec<f64> {
            losses.loss_ratio.iter().map(|&ratio| of(EfficiencyAnswer::new(&mechanism, ratio))).collect()
        };
        let answer = Self {
            efficiency,
            self_locking: SelfLockingAnswer::new(&mechanism, loss_ratio),
            efficiency_error,
            is_within_measured_range,
            required_input_torque_nm: input_torque_nm / efficiency.ring_fixed,
            loss_ratio,
            loss_ratio_by_place: by_place,
            power_loss_w: turning_rad_per_s.map(|turning| power_w(loss_ratio, turning)),
            power_loss_by_place_w: turning_rad_per_s
                .map(|turning| LossByPlaceAnswer::of(&losses.mean, |ratio| power_w(ratio, turning))),
            pressure_velocity_mpa_m_per_s: turning_rad_per_s
                .map(|turning| losses.pressure_velocity_peaks(sweep, turning).into()),
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
        answer.require_finite()?;
        Ok(answer)
    }

    fn require_finite(&self) -> Result<(), NoAnswer> {
        let Self { slip_mm_per_rad: slip, by_input_angle, .. } = self;
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
        let columns = [&slip.wave_generator, &slip.ring, &slip.carrier, &by_input_angle.loss_ratio, &numbers];
        require_finite(columns)
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

impl LossByPlaceAnswer {
    fn of(ratio: &LossRatio, quantity: impl Fn(f64) -> f64) -> Self {
        let LossRatio { contacts: PerContact { wave_generator, ring, carrier }, bearing } = *ratio;
        Self {
            wave_generator: quantity(wave_generator),
            ring: quantity(ring),
            carrier: quantity(carrier),
            bearing: quantity(bearing),
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
