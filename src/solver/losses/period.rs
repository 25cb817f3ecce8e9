//! What a period costs: the teeth of a sweep, input angle by input angle.

use crate::contact::{Contact, PerContact};
use crate::drive::Drive;
use crate::losses::{AtInputAngle, Friction, LoadedTooth, Mechanism, mean_over_period};
use crate::position::{Position, half_lobe_rad};
use crate::root::NotConverged;
use crate::sweep::{Peak, States, Sweep};
use crate::{SolveError, Stop};

/// The loss ratio ν, by where the power goes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LossRatio {
    /// At the contacts.
    pub contacts: PerContact<f64>,
    /// In the bearing between cam and race.
    pub bearing: f64,
}

impl LossRatio {
    /// ν altogether.
    pub fn total(&self) -> f64 {
        self.contacts.iter().map(|(_, &ratio)| ratio).sum::<f64>() + self.bearing
    }
}

/// What friction does over the period of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Losses {
    /// Mean loss ratio over the period.
    pub mean: LossRatio,
    /// The loss ratio at each input angle of the sweep.
    pub loss_ratio: Vec<f64>,
    /// `v_c`, one entry a state of the sweep; at a race against the race.
    pub slip_mm_per_rad: PerContact<Vec<f64>>,
    /// The contact that rolls, one entry a state.
    pub rolls: Vec<Option<Contact>>,
}

impl Mechanism {
    /// That of a drive as a sweep lists its teeth.
    pub fn of_sweep(drive: &Drive, sweep: &Sweep) -> Self {
        Self { tells_items_apart: sweep.mesh.tells_items_apart(), ..Self::of(drive) }
    }
}

impl Losses {
    /// What friction does over a sweep of this drive.
    ///
    /// # Errors
    /// [`SolveError::NotConverged`] from the geometry, [`SolveError::Stopped`] when `stop` says so.
    pub fn of(drive: &Drive, sweep: &Sweep, friction: &Friction, stop: &impl Stop) -> Result<Self, SolveError> {
        let mechanism = Mechanism::of_sweep(drive, sweep);
        let states = &sweep.states;
        let column = || Vec::with_capacity(states.len());
        let mut slip_mm_per_rad = PerContact::of(|_| column());
        let mut rolls = Vec::with_capacity(states.len());
        let mut ratios = Vec::with_capacity(sweep.input_angles.input_angle_deg.len());
        at_each_input_angle(drive, states, stop, |input_angle_deg, teeth| {
            let turning = mechanism.turning(friction, teeth);
            let over_torque = |work_nmm_per_rad: f64| work_nmm_per_rad / turning.input_torque_nmm;
            let ratio = LossRatio {
                contacts: PerContact::of(|contact| over_torque(*turning.work_nmm_per_rad.get(contact))),
                bearing: over_torque(turning.bearing_work_nmm_per_rad),
            };
            ratios.push((input_angle_deg, ratio));
            for slip in &turning.teeth {
                for (contact, &slip) in slip.slip_mm_per_rad.iter() {
                    slip_mm_per_rad.get_mut(contact).push(slip);
                }
                rolls.push(slip.rolls);
            }
        })?;
        let mean = |of: &dyn Fn(&LossRatio) -> f64| {
            let column: Vec<_> = ratios
                .iter()
                .map(|(input_angle, ratio)| AtInputAngle { input_angle: *input_angle, value: of(ratio) })
                .collect();
            mean_over_period(&column)
        };
        Ok(Self {
            mean: LossRatio {
                contacts: PerContact::of(|contact| mean(&|ratio| *ratio.contacts.get(contact))),
                bearing: mean(&|ratio| ratio.bearing),
            },
            loss_ratio: ratios.iter().map(|(_, ratio)| ratio.total()).collect(),
            slip_mm_per_rad,
            rolls,
        })
    }

    /// The largest `p·v` of each contact over the states of the sweep that these losses belong to, at a turning of the wave generator
    /// against the carrier; see [`pressure_velocity_mpa_m_per_s`](super::pressure_velocity_mpa_m_per_s).
    pub fn pressure_velocity_peaks(&self, sweep: &Sweep, turning_rad_per_s: f64) -> PerContact<Peak> {
        let states = &sweep.states;
        PerContact::of(|contact| {
            let stresses = states.stress_mpa.get(contact).iter();
            let mut peak = Peak { value: 0.0, input_angle_deg: 0.0, position_deg: 0.0 };
            for (state, (stress_mpa, slip)) in stresses.zip(self.slip_mm_per_rad.get(contact)).enumerate() {
                let value = 1e-3 * turning_rad_per_s * stress_mpa * slip.abs();
                // The first, where nothing slips.
                if state == 0 || value > peak.value {
                    let (input_angle_deg, position_deg) = (states.input_angle_deg[state], states.position_deg[state]);
                    peak = Peak { value, input_angle_deg, position_deg };
                }
            }
            peak
        })
    }
}

/// What the teeth push the wave generator aside with at each input angle of a sweep, in its frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RadialForces {
    /// The force.
    pub force_n: Vec<f64>,
    /// Its direction from the middle of lobe 0.
    pub direction_deg: Vec<f64>,
}

impl RadialForces {
    /// Those of a sweep of this drive; none where two lobes or more are loaded alike, so that they balance each other at any load.
    ///
    /// # Errors
    /// As [`Losses::of`].
    pub fn of(drive: &Drive, sweep: &Sweep, stop: &impl Stop) -> Result<Option<Self>, SolveError> {
        let mechanism = Mechanism::of_sweep(drive, sweep);
        if mechanism.lobes_loaded_alike() > 1 {
            return Ok(None);
        }
        let mut forces = Self::default();
        at_each_input_angle(drive, &sweep.states, stop, |_, teeth| {
            let force_n = mechanism.radial_force_n(teeth);
            forces.force_n.push(force_n.norm());
            forces.direction_deg.push(force_n.y.atan2(force_n.x).to_degrees());
        })?;
        Ok(Some(forces))
    }
}

/// Goes through the input angles of a sweep. Where a tooth enters an angle may stand twice, without the tooth and with it; by number the
/// teeth then start anew.
fn at_each_input_angle(
    drive: &Drive,
    states: &States,
    stop: &impl Stop,
    mut each: impl FnMut(f64, &[LoadedTooth]),
) -> Result<(), SolveError> {
    let mut teeth = Vec::new();
    for state in 0..states.len() {
        let next = state + 1;
        teeth.push(loaded_tooth(drive, states, state)?);
        let goes_on = next < states.len()
            && states.input_angle_deg[next].total_cmp(&states.input_angle_deg[state]).is_eq()
            && states.tooth[next] > states.tooth[state];
        if !goes_on {
            if stop.stopped() {
                return Err(SolveError::Stopped);
            }
            each(states.input_angle_deg[state], &teeth);
            teeth.clear();
        }
    }
    Ok(())
}

/// The tooth of a state. Its place is known in degrees, near the valley to some 1e-14 rad, where it bears next to nothing.
fn loaded_tooth(drive: &Drive, states: &States, state: usize) -> Result<LoadedTooth, NotConverged> {
    let lobes = drive.lobes();
    let from_lobe_rad = states.position_deg[state].to_radians().min(half_lobe_rad(lobes));
    let center = drive.flank().locus().at(Position::from_lobe(from_lobe_rad, lobes))?;
    let flank = drive.flank().at(&center);
    let force_n = PerContact::of(|contact| states.force_n.get(contact)[state]);
    Ok(LoadedTooth::new(states.lobe.get(state).copied().unwrap_or_default(), &center, &flank, force_n))
}
