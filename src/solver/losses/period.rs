//! Losses over a period, from the teeth of a sweep at each input angle.

use crate::contact::{Contact, PerContact};
use crate::drive::Drive;
use crate::gaps::{Deviations, Gaps};
use crate::load_sharing::{LoadCase, LoadedDrive, ToothState};
use crate::losses::bearing::RollingElement;
use crate::losses::wear::{WearParameters, WornPlace};
use crate::losses::{Friction, LoadedTooth, Mechanism, Turning, mean_over_period};
use crate::mesh::PlacedTooth;
use crate::position::{Position, half_lobe_rad};
use crate::ring::TipCorner;
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::sweep::mean::means;
use crate::sweep::{Peak, States, Sweep};
use crate::{SolveError, Stop};

/// Loss ratio or power at each place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct LossByPlace {
    /// Between teeth and wave generator, or its race.
    pub wave_generator: f64,
    /// Between teeth and ring.
    pub ring: f64,
    /// Between teeth and carrier.
    pub carrier: f64,
    /// In the bearing between cam and race; 0 for a plain cam.
    pub bearing: f64,
}

impl LossByPlace {
    const PLACES: [fn(&Self) -> f64; 4] =
        [|loss| loss.wave_generator, |loss| loss.ring, |loss| loss.carrier, |loss| loss.bearing];

    /// Creates it from values in the order of the fields.
    const fn new([wave_generator, ring, carrier, bearing]: [f64; 4]) -> Self {
        Self { wave_generator, ring, carrier, bearing }
    }

    /// Applies a function to each place.
    pub(super) fn of(quantity: impl FnMut(fn(&Self) -> f64) -> f64) -> Self {
        Self::new(Self::PLACES.map(quantity))
    }

    /// Returns `ν = P/(M0 ω_HS)`: the friction power divided by the wave generator's torque without friction.
    fn of_turning(turning: &Turning, input_torque_nmm: f64) -> Self {
        let PerContact { wave_generator, ring, carrier } = turning.work_nmm_per_rad;
        let work_nmm_per_rad = [wave_generator, ring, carrier, turning.bearing_work_nmm_per_rad];
        Self::new(work_nmm_per_rad.map(|work| work / input_torque_nmm))
    }

    /// Returns the total.
    pub fn total(&self) -> f64 {
        let Self { wave_generator, ring, carrier, bearing } = self;
        wave_generator + ring + carrier + bearing
    }
}

/// Friction losses over the period of a sweep.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Losses {
    /// Mean loss ratio over the period.
    pub mean: LossByPlace,
    /// The loss ratio at each input angle of the sweep.
    pub loss_ratio: Vec<f64>,
    /// `v_c`, one entry per state of the sweep; relative to the race if there is one.
    pub slip_mm_per_rad: PerContact<Vec<f64>>,
    /// The rolling contact, one entry per state.
    pub rolls: Vec<Option<Contact>>,
    /// `v_R` at each input angle; 0 without a race.
    pub race_mm_per_rad: Vec<f64>,
    /// Wear of the parts, if asked for.
    pub wear: Option<Wear>,
}

impl Losses {
    /// Returns the losses over the sweep of this drive under this load, with the wear at these parameters.
    ///
    /// ```
    /// use toothwave_solver::losses::period::Losses;
    /// use toothwave_solver::losses::{Fixed, Friction, FrictionParameters, Mechanism, WaveGeneratorFriction};
    /// use toothwave_solver::sweep::{Points, sweep};
    /// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
    /// let drive = Drive::new(&DriveParameters::default()).unwrap();
    /// let load = LoadCase::new(&LoadParameters::default()).unwrap();
    ///
    /// let sweep = sweep(&drive, &load, Points::samples(100).unwrap(), &Never).unwrap();
    /// let friction = Friction::new(&FrictionParameters {
    ///     wave_generator: WaveGeneratorFriction::Plain { coefficient: 0.01 },
    ///     ring_coefficient: 0.05,
    ///     carrier_coefficient: 0.05,
    /// })
    /// .unwrap();
    /// let losses = Losses::of(&drive, &load, &sweep, &friction, None, &Never).unwrap();
    /// let efficiency = Mechanism::of(&drive).efficiency(Fixed::Ring, losses.mean.total());
    /// assert!(efficiency.driven > 0.0 && efficiency.driven < 1.0);
    /// ```
    ///
    /// # Errors
    /// [`SolveError::NotConverged`] from the geometry, [`SolveError::Stopped`] when `stop` says so.
    pub fn of(
        drive: &Drive,
        load: &LoadCase,
        sweep: &Sweep,
        friction: &Friction,
        wear: Option<&WearParameters>,
        stop: &dyn Stop,
    ) -> Result<Self, SolveError> {
        let mechanism = Mechanism { mesh: sweep.mesh, ..Mechanism::of(drive) };
        // If the wave generator moves under its teeth, their lever arms differ from those at the positions of the
        // states.
        let input_torque_nmm = 1e3 * load.input_torque_nm(drive);
        let states = &sweep.states;
        let column = || Vec::with_capacity(states.len());
        let mut slip_mm_per_rad = PerContact::of(|_| column());
        let mut rolls = Vec::with_capacity(states.len());
        let mut ratios = Vec::with_capacity(sweep.input_angles.input_angle_deg.len());
        let mut race_mm_per_rad = Vec::with_capacity(ratios.capacity());
        let wear =
            wear.map(|parameters| LoadedDrive::new(drive, load).map(|loaded| (parameters, loaded))).transpose()?;
        let mut mm_per_hour = PerContact::of(|_| Vec::new());
        let mut of_race = Vec::new();
        at_each_input_angle(drive, states, stop, |input_angle_deg, teeth| {
            let turning = mechanism.turning(friction, teeth);
            ratios.push((input_angle_deg, LossByPlace::of_turning(&turning, input_torque_nmm)));
            race_mm_per_rad.push(turning.race_mm_per_rad);
            for slip in &turning.teeth {
                push(&mut slip_mm_per_rad, &slip.slip_mm_per_rad);
                rolls.push(slip.rolls);
            }
            if let Some((parameters, loaded)) = &wear {
                let mut on_race = 0.0;
                for (tooth, slip) in teeth.iter().zip(&turning.teeth) {
                    let line_load = loaded.line_load_n_per_mm(&tooth.center, &tooth.flank, &tooth.force_n)?;
                    let depth = mechanism.wear_mm_per_hour(friction, parameters, tooth, slip, &line_load);
                    on_race += depth.wave_generator;
                    push(&mut mm_per_hour, &depth);
                }
                of_race.push((input_angle_deg, on_race));
            }
            Ok(())
        })?;
        let race_mm_per_hour = friction.bearing().map(|_| mean_over_period(&of_race));
        if race_mm_per_hour.is_some() {
            mm_per_hour.wave_generator.clear();
        }
        let mean = |of: fn(&LossByPlace) -> f64| {
            let column: Vec<_> = ratios.iter().map(|(input_angle_deg, ratio)| (*input_angle_deg, of(ratio))).collect();
            mean_over_period(&column)
        };
        Ok(Self {
            mean: LossByPlace::of(mean),
            loss_ratio: ratios.iter().map(|(_, ratio)| ratio.total()).collect(),
            slip_mm_per_rad,
            rolls,
            race_mm_per_rad,
            wear: wear.map(|_| Wear { mm_per_hour, race_mm_per_hour }),
        })
    }

    /// Returns the same with the mean to a tolerance relative to the total, independent of the sweep's input angles.
    ///
    /// # Errors
    /// The errors of [`Self::of`].
    pub fn with_mean_to(
        self,
        tolerance: f64,
        drive: &Drive,
        load: &LoadCase,
        deviations: &Deviations,
        friction: &Friction,
        stop: &dyn Stop,
    ) -> Result<Self, SolveError> {
        let loaded = LoadedDrive::deviating(drive, load, deviations)?;
        let mechanism = Mechanism { mesh: *loaded.mesh(), ..Mechanism::of(drive) };
        let input_torque_nmm = 1e3 * load.input_torque_nm(drive);
        let corner = TipCorner::of(drive.ring_tooth())?;
        let mut listed = Vec::new();
        let work_over_torque =
            |placed: &[PlacedTooth], teeth: &[ToothState], wind_up: &WindUp| -> Result<[f64; 4], SolveError> {
                listed.clear();
                for (&PlacedTooth { lobe, .. }, tooth) in placed.iter().zip(teeth) {
                    let &ToothState { center, flank, .. } = tooth;
                    let is_at_corner = corner.is_some_and(|corner| corner.is_before_flank(&center.position));
                    let force_n = loaded.forces_n(tooth, wind_up)?;
                    listed.push(LoadedTooth { lobe, center, flank, is_at_corner, force_n });
                }
                let LossByPlace { wave_generator, ring, carrier, bearing } =
                    LossByPlace::of_turning(&mechanism.turning(friction, &listed), input_torque_nmm);
                Ok([wave_generator, ring, carrier, bearing])
            };
        let mean = LossByPlace::new(means(&loaded, tolerance, work_over_torque, stop)?);
        Ok(Self { mean, ..self })
    }

    /// Returns the largest `p·v = σ |v_c|` of each contact over the states of the sweep that these losses belong to.
    /// `turning_rad_per_s` is the speed of the wave generator relative to the carrier, σ the largest Hertz pressure.
    /// Handbook limits refer to the load over the projected area, which is far less: do not compare the two.
    pub fn pressure_velocity_peaks(&self, sweep: &Sweep, turning_rad_per_s: f64) -> PerContact<Peak> {
        let states = &sweep.states;
        PerContact::of(|contact| {
            let stresses = states.stress_mpa.get(contact).iter();
            let values = stresses
                .zip(self.slip_mm_per_rad.get(contact))
                .map(|(stress_mpa, slip)| 1e-3 * turning_rad_per_s * stress_mpa * slip.abs());
            // A sweep has states.
            largest(states, values).unwrap_or(Peak { value: 0.0, input_angle_deg: 0.0, position_deg: 0.0 })
        })
    }
}

/// Wear rate of the parts over the states of a sweep (docs/explanation/theory.md section 10.4).
#[derive(Debug, Clone, PartialEq)]
pub struct Wear {
    /// Depth of each part where a tooth touches it, one entry per state; none for a race, which wears evenly.
    pub mm_per_hour: PerContact<Vec<f64>>,
    /// Depth of a race, which wears evenly around its circumference.
    pub race_mm_per_hour: Option<f64>,
}

impl Wear {
    /// Returns the mean over a duty of at least one point, each with its share of time or any quantity proportional to
    /// it. All points have the same input angles. It is taken at each place, since depths add there.
    pub fn over_duty(points: &[(f64, &Self)]) -> Self {
        let time: f64 = points.iter().map(|(share_of_time, _)| share_of_time).sum();
        let mean = |of: &dyn for<'a> Fn(&'a Self) -> &'a [f64]| -> Vec<f64> {
            let at =
                |place: usize| points.iter().map(|(share_of_time, wear)| share_of_time * of(wear)[place]).sum::<f64>();
            let places = points.first().map_or(0, |(_, wear)| of(wear).len());
            (0..places).map(|place| at(place) / time).collect()
        };
        Self {
            mm_per_hour: PerContact::of(|contact| mean(&|wear| wear.mm_per_hour.get(contact))),
            // A race is one place.
            race_mm_per_hour: mean(&|wear| wear.race_mm_per_hour.as_slice()).first().copied(),
        }
    }

    /// Returns the place of the largest wear of each part; none without states.
    pub(super) fn largest(&self, states: &States) -> Option<PerContact<WornPlace>> {
        let peaks = self.peaks(states);
        let of_race = self.race_mm_per_hour.map(|value| WornPlace { value, input_angle_deg: None, position_deg: None });
        PerContact::try_of(|contact| peaks.get(contact).map(WornPlace::from).or(of_race).ok_or(())).ok()
    }

    /// Returns the largest depth of each part and its place; none for a race.
    pub fn peaks(&self, states: &States) -> PerContact<Option<Peak>> {
        PerContact::of(|contact| largest(states, self.mm_per_hour.get(contact).iter().copied()))
    }
}

/// Adds a value to the column of each contact.
fn push(columns: &mut PerContact<Vec<f64>>, values: &PerContact<f64>) {
    for (contact, &value) in values.iter() {
        columns.get_mut(contact).push(value);
    }
}

/// Returns the first of the largest values over the states; none if there are no values.
fn largest(states: &States, values: impl Iterator<Item = f64>) -> Option<Peak> {
    let mut peak: Option<Peak> = None;
    for (state, value) in values.enumerate() {
        if peak.is_none_or(|before| value > before.value) {
            let (input_angle_deg, position_deg) = (states.input_angle_deg[state], states.position_deg[state]);
            peak = Some(Peak { value, input_angle_deg, position_deg });
        }
    }
    peak
}

/// Load over a period on the bearing that is an eccentric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingLoad {
    /// Mean over its revolutions, see [`RollingElement::mean_load_n`].
    pub mean_load_n: f64,
    /// Relative speed of its rings, divided by the speed of the wave generator relative to the carrier.
    pub speed_ratio: f64,
}

impl BearingLoad {
    /// Returns the load for the sweep of these losses and forces; none if the race does not turn.
    pub fn of(
        mechanism: &Mechanism,
        element: RollingElement,
        sweep: &Sweep,
        losses: &Losses,
        forces: &RadialForces,
    ) -> Option<Self> {
        let speed_ratio = |at: usize| losses.race_mm_per_rad[at].abs() / mechanism.race_radius_mm();
        let input_angle_deg = &sweep.input_angles.input_angle_deg;
        let (mut loads, mut turned_deg) = (Vec::with_capacity(2 * input_angle_deg.len()), 0.0);
        for at in 1..input_angle_deg.len() {
            let step_deg = input_angle_deg[at] - input_angle_deg[at - 1];
            turned_deg += step_deg;
            // Half of the interval at either end, as in the means over a period.
            for end in [at - 1, at] {
                loads.push((forces.force_n[end], 0.5 * step_deg * speed_ratio(end)));
            }
        }
        let revolutions: f64 = loads.iter().map(|(_, revolutions)| revolutions).sum();
        (revolutions > 0.0)
            .then(|| Self { mean_load_n: element.mean_load_n(&loads), speed_ratio: revolutions / turned_deg })
    }
}

/// Radial force of the teeth on the wave generator, if no two lobes carry the same load: columns of equal length, one
/// entry per input angle.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = RadialForceAnswer))]
pub struct RadialForces {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Magnitude of the force, in N.
    #[cfg_attr(feature = "document", serde(rename = "value"))]
    pub force_n: Vec<f64>,
    /// Direction of the force in the wave generator's frame, from the middle of lobe 0.
    pub direction_deg: Vec<f64>,
}

impl RadialForces {
    /// Returns the forces of a sweep of this drive under this load. None if two or more lobes carry the same load, so
    /// that the forces balance at any load.
    ///
    /// # Errors
    /// The errors of [`Losses::of`].
    pub fn of(
        drive: &Drive,
        load: &LoadCase,
        deviations: &Deviations,
        sweep: &Sweep,
        stop: &dyn Stop,
    ) -> Result<Option<Self>, SolveError> {
        let mechanism = Mechanism { mesh: sweep.mesh, ..Mechanism::of(drive) };
        if mechanism.lobes_loaded_alike() > 1 {
            return Ok(None);
        }
        let p = load.parameters();
        let gaps = Gaps::new(drive, &p.clearance_um, p.modification, Some(deviations));
        let mut forces = Self::default();
        at_each_input_angle(drive, &sweep.states, stop, |input_angle_deg, teeth| {
            let mut teeth = teeth.to_vec();
            if p.wave_generator_moves {
                let wind_up_rad = sweep.input_angles.wind_up_deg[forces.force_n.len()].to_radians();
                for tooth in &mut teeth {
                    *tooth = passed_by(drive, tooth, &gaps, wind_up_rad)?;
                }
            }
            let force_n = mechanism.radial_force_n(&teeth);
            forces.input_angle_deg.push(input_angle_deg);
            forces.force_n.push(force_n.norm());
            forces.direction_deg.push(force_n.y.atan2(force_n.x).to_degrees());
            Ok(())
        })?;
        Ok(Some(forces))
    }
}

/// Returns a tooth that the wave generator has moved on under, in the wave generator's frame. Its force acts along the
/// normal there.
fn passed_by(
    drive: &Drive,
    tooth: &LoadedTooth,
    gaps: &Gaps<'_>,
    wind_up_rad: f64,
) -> Result<LoadedTooth, NotConverged> {
    let usual = gaps.usually_turned(tooth.center.center_radius_mm);
    let moved_rad = wind_up_rad - gaps.lost_motion_rad() - usual.lost_motion_rad(drive);
    // Negative beyond the middle of the lobe.
    let position_rad = tooth.center.position.from_lobe_rad - moved_rad;
    let from_lobe_rad = position_rad.abs().min(half_lobe_rad(drive.lobes()));
    let mut center = drive.flank().locus().at(Position::from_lobe(from_lobe_rad, drive.lobes()))?;
    // Only the direction of the radial force reads it.
    center.position.from_lobe_rad = position_rad;
    center.tan_pressure_angle = center.tan_pressure_angle.copysign(position_rad);
    Ok(LoadedTooth { center, ..*tooth })
}

/// Visits the input angles of a sweep. An angle may occur twice where a tooth enters: without the tooth and with it.
/// The tooth numbers then start again.
fn at_each_input_angle(
    drive: &Drive,
    states: &States,
    stop: &dyn Stop,
    mut each: impl FnMut(f64, &[LoadedTooth]) -> Result<(), SolveError>,
) -> Result<(), SolveError> {
    let mut teeth = Vec::new();
    let corner = TipCorner::of(drive.ring_tooth())?;
    for state in 0..states.len() {
        let next = state + 1;
        teeth.push(tooth_of(drive, corner.as_ref(), states, state)?);
        let goes_on = next < states.len()
            && states.input_angle_deg[next].total_cmp(&states.input_angle_deg[state]).is_eq()
            && states.tooth[next] > states.tooth[state];
        if !goes_on {
            if stop.stopped() {
                return Err(SolveError::Stopped);
            }
            each(states.input_angle_deg[state], &teeth)?;
            teeth.clear();
        }
    }
    Ok(())
}

/// Returns the tooth of a state. Its position is stored in degrees. Near the valley the rounding is about 1e-14 rad,
/// where its load is negligible.
fn tooth_of(
    drive: &Drive,
    corner: Option<&TipCorner>,
    states: &States,
    state: usize,
) -> Result<LoadedTooth, NotConverged> {
    let lobes = drive.lobes();
    let from_lobe_rad = states.position_deg[state].to_radians().min(half_lobe_rad(lobes));
    let center = drive.flank().locus().at(Position::from_lobe(from_lobe_rad, lobes))?;
    // A tooth is before the flank only if corners are pressed.
    let corner =
        corner.filter(|corner| corner.is_before_flank(&center.position)).map(|corner| corner.seen_from(&center));
    let flank = corner.unwrap_or_else(|| drive.flank().at(&center));
    let force_n = PerContact::of(|contact| states.force_n.get(contact)[state]);
    let lobe = states.lobe.get(state).copied().unwrap_or_default();
    Ok(LoadedTooth { lobe, center, flank, is_at_corner: corner.is_some(), force_n })
}
