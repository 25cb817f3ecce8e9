//! Friction losses and radial forces on the wave generator in JSON.

use serde::Serialize;
use toothwave_solver::losses::bearing::BearingLife;
pub use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::losses::period;
use toothwave_solver::losses::{Efficiencies, Fixed, Mechanism};
use toothwave_solver::sweep::Sweep;
use toothwave_solver::{Contact, PerContact};
use utoipa::ToSchema;

use crate::no_answer::NoAnswer;
use crate::question::require_finite;

/// Friction losses, to first order in the coefficients; given `friction`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LossesAnswer {
    /// Totals over the period or the duty.
    #[serde(flatten)]
    pub totals: LossTotals,
    /// Slip of the tooth's surface over the part's, along the counter-clockwise tangent, per radian of wave generator
    /// against carrier; with a race, over the race. One entry per state.
    pub slip_mm_per_rad: PerContact<Vec<f64>>,
    /// The contact at which the tooth rolls, one entry per state.
    pub rolls: Vec<RollsAnswer>,
    /// Losses at each input angle.
    pub by_input_angle: LossesByInputAngleAnswer,
}

/// The contact at which a tooth rolls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollsAnswer {
    /// Rolls at the wave generator, or its race.
    WaveGenerator,
    /// Rolls at the ring.
    Ring,
    /// Rolls at the carrier.
    Carrier,
    /// Rolls at no contact: it cannot spin, carries no load or has no friction.
    Nowhere,
}

/// Columns of equal length, one entry per input angle. An angle may occur twice where a tooth enters: without it and
/// with it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LossesByInputAngleAnswer {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Power lost over the input torque times the speed of wave generator against carrier.
    pub loss_ratio: Vec<f64>,
    /// Efficiencies at each input angle.
    pub efficiency: Efficiencies<Vec<f64>>,
}

impl LossesAnswer {
    /// Creates the losses over all points of a duty, with the columns of the hardest point, whose sweep this is.
    pub(super) fn new(
        mechanism: &Mechanism,
        totals: LossTotals,
        losses: period::Losses,
        sweep: &Sweep,
    ) -> Result<Self, NoAnswer> {
        let at_each = losses.loss_ratio.iter().map(|&ratio| mechanism.efficiency(Fixed::Ring, ratio));
        let (driven, back_driven) = at_each.map(|of| (of.driven, of.back_driven)).unzip();
        let answer = Self {
            totals,
            slip_mm_per_rad: losses.slip_mm_per_rad,
            rolls: losses.rolls.into_iter().map(RollsAnswer::from).collect(),
            by_input_angle: LossesByInputAngleAnswer {
                input_angle_deg: sweep.input_angles.input_angle_deg.clone(),
                loss_ratio: losses.loss_ratio,
                efficiency: Efficiencies { driven, back_driven },
            },
        };
        // The sweep checks the columns of slips with its own.
        require_finite([&answer.by_input_angle.loss_ratio, &numbers(&answer.totals)])?;
        Ok(answer)
    }
}

/// Returns the numbers whose finiteness implies that of all others.
fn numbers(totals: &LossTotals) -> Vec<f64> {
    let LossTotals { loss_ratio, efficiency_error, required_input_torque_nm, efficiency, .. } = totals;
    let mut numbers = vec![*loss_ratio, *efficiency_error, *required_input_torque_nm, efficiency.back_driven];
    numbers.extend(totals.power_loss_w);
    let products = totals.pressure_velocity_mpa_m_per_s.iter().flat_map(PerContact::iter);
    numbers.extend(products.map(|(_, peak)| peak.value));
    numbers.extend(totals.wear_mm_per_hour.iter().flat_map(PerContact::iter).map(|(_, worn)| worn.value));
    if let Some(BearingLife { mean_load_n, life_million_revolutions, speed_rpm, life_h }) = totals.bearing {
        numbers.extend([mean_load_n, life_million_revolutions].into_iter().chain(speed_rpm).chain(life_h));
    }
    numbers
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
