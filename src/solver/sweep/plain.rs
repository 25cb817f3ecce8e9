//! Sweep state by state: the reference for the fast path, and the fallback for drives it does not support.

use crate::contact::PerContact;
use crate::load_sharing::{LoadedDrive, ToothState, TorqueLimit};
use crate::mesh::{PlacedTooth, Samples};
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::sweep::adaptive::{self, Looking};
use crate::sweep::columns::{
    ContactPeaks, InputAngles, Peak, PeaksSoFar, States, Sweep, SweepPeaks, TorqueCapacity, Totals, checked, worse,
};
use crate::sweep::points::Points;
use crate::tooth::Pressure;
use crate::{SolveError, Stop};

/// Runs the sweep.
pub(crate) fn sweep(
    loaded: &LoadedDrive<'_>,
    points: Points,
    looking: Looking,
    stop: &dyn Stop,
) -> Result<Sweep, SolveError> {
    let mesh = *loaded.mesh();
    let mut columns = Growing::new(loaded, stop);
    match points {
        Points::Samples(samples) => {
            columns.begin(mesh.state_count(samples), mesh.last_sample(samples) + 1);
            for sample in 0..=mesh.last_sample(samples) {
                columns.add(mesh.input_angle_deg(sample, samples), mesh.placed_at(sample, samples))?;
            }
        }
        Points::Tolerance(tolerance) => {
            let by_lap = adaptive::moments(loaded, tolerance, looking, stop)?;
            // Each place was counted once. It may represent several listed teeth, and occurs in every lap.
            let places = by_lap.iter().flatten().map(|moment| moment.places()).sum::<u64>();
            let listed = places * (mesh.laps() / by_lap.len() as u64) * mesh.listed_at_each_place();
            let limit = tolerance.max_states;
            if listed > limit {
                return Err(SolveError::TooManyStates { limit });
            }
            let lap_deg = mesh.sweep_period_deg() / mesh.laps() as f64;
            // If items are alike, so are all laps.
            for (lap, moments) in (0..mesh.laps()).zip(by_lap.iter().cycle()) {
                // A lap begins at the end of the one before.
                for moment in &moments[usize::from(lap > 0)..] {
                    columns.add((lap as f64 + moment.fraction) * lap_deg, moment.placed(&mesh, lap))?;
                }
            }
        }
    }
    columns.finish(points)
}

/// Returns the peaks of a sweep over equal intervals, keeping only some states at a time.
pub(crate) fn peaks(loaded: &LoadedDrive<'_>, samples: Samples, stop: &dyn Stop) -> Result<SweepPeaks, SolveError> {
    const STATES_AT_A_TIME: u64 = 1024;
    let mesh = *loaded.mesh();
    let mut columns = Growing::new(loaded, stop);
    for sample in 0..=mesh.last_sample(samples) {
        if sample == 0 || columns.states.len() as u64 >= STATES_AT_A_TIME {
            columns.begin(2 * STATES_AT_A_TIME, STATES_AT_A_TIME);
        }
        columns.add(mesh.input_angle_deg(sample, samples), mesh.placed_at(sample, samples))?;
    }
    let contacts = columns.contact_peaks()?;
    columns.totals.peaks(contacts)
}

/// Sweep that is built input angle by input angle.
struct Growing<'a> {
    loaded: &'a LoadedDrive<'a>,
    stop: &'a dyn Stop,
    states: States,
    input_angles: InputAngles,
    totals: Totals,
    /// Set if the least limit is the end of Johnson's law instead of a stress.
    law_end: Option<SolveError>,
    lists_lobes: bool,
    teeth: Vec<ToothState>,
    peaks: PerContact<PeaksSoFar>,
    /// Pressure model in the state of each stress peak.
    pressures: PerContact<Option<Pressure>>,
}

impl<'a> Growing<'a> {
    fn new(loaded: &'a LoadedDrive<'a>, stop: &'a dyn Stop) -> Self {
        Self {
            loaded,
            stop,
            states: States::default(),
            input_angles: InputAngles::default(),
            totals: Totals::new(loaded),
            law_end: None,
            lists_lobes: !loaded.mesh().zones_are_alike(),
            teeth: Vec::new(),
            peaks: PerContact::of(|_| PeaksSoFar::NONE),
            pressures: PerContact::default(),
        }
    }

    /// Begins empty columns, with memory for as many states and input angles.
    fn begin(&mut self, states: u64, input_angles: u64) {
        // The caller has bounded the counts to what fits in memory.
        let [states, input_angles] = [states, input_angles].map(|count| usize::try_from(count).unwrap_or(usize::MAX));
        self.states = States::with_capacity(states, self.lists_lobes);
        self.input_angles =
            InputAngles::of_columns(|| Vec::with_capacity(input_angles), Vec::with_capacity(input_angles));
    }

    /// Appends the states of the teeth in mesh at one input angle.
    fn add(&mut self, input_angle_deg: f64, placed: impl Iterator<Item = PlacedTooth>) -> Result<(), SolveError> {
        if self.stop.stopped() {
            return Err(SolveError::Stopped);
        }
        self.teeth.clear();
        for PlacedTooth { number, lobe, place, position, position_deg } in placed {
            let tooth = self.loaded.tooth_at(&place, position);
            self.teeth.push(tooth.map_err(|error| error.at_input_angle(input_angle_deg))?);
            self.states.input_angle_deg.push(input_angle_deg);
            self.states.tooth.push(u32::try_from(number).unwrap_or(u32::MAX));
            if self.lists_lobes {
                self.states.lobe.push(lobe);
            }
            self.states.position_deg.push(position_deg);
        }
        let wind_up = self.loaded.wind_up(&self.teeth)?;
        let loaded_teeth = self.share_load(input_angle_deg, &wind_up)?;
        let stiffness = InputAngles::of_output(self.loaded.drive(), wind_up.stiffness_nmm_per_rad);
        let wind_up_deg = wind_up.rotation_rad().to_degrees();
        let angles = &mut self.input_angles;
        angles.input_angle_deg.push(input_angle_deg);
        angles.wind_up_deg.push(wind_up_deg);
        angles.torsional_stiffness_nm_per_rad.push(stiffness);
        angles.loaded_teeth.push(loaded_teeth);
        self.totals.add(wind_up_deg, stiffness, u64::from(loaded_teeth));
        if let Some(allowable_stress_mpa) = &self.loaded.load.allowable_stress_mpa {
            let TorqueLimit { input_torque_nmm, contact, turns_past_teeth, law_end } =
                self.loaded.torque_limit(&self.teeth, allowable_stress_mpa)?;
            let capacity = TorqueCapacity::new(self.loaded.drive(), 1e-3 * input_torque_nmm, contact, input_angle_deg);
            if self.totals.add_capacity(TorqueCapacity { turns_past_teeth, ..capacity }) {
                self.law_end = law_end;
            }
        }
        Ok(())
    }

    /// Appends geometry, forces and stresses of the teeth. Returns the number of teeth that carry load.
    fn share_load(&mut self, input_angle_deg: f64, wind_up: &WindUp) -> Result<u32, NotConverged> {
        let flank = self.loaded.drive().flank();
        let states = &mut self.states;
        let mut loaded_teeth = 0;
        let zones = self.loaded.zones;
        let mut torque_nmm = PerContact::<f64>::default();
        let first = states.len() - self.teeth.len();
        for (tooth, &position_deg) in self.teeth.iter().zip(&states.position_deg[first..]) {
            let ToothState { center, flank: point, .. } = tooth;
            states.center_radius_mm.push(center.center_radius_mm);
            let cam_angle_rad = flank.locus().contact_angle_from_valley_rad(center);
            states.wave_generator_angle_deg.push(cam_angle_rad.to_degrees());
            states.ring_angle_deg.push(flank.angle_from_tip_rad(center, point).to_degrees());

            let force_n = self.loaded.forces_n(tooth, wind_up)?;
            loaded_teeth += u32::from(force_n.wave_generator > 0.0);
            let stress_mpa = self.loaded.stress_mpa(tooth, &force_n);
            for (contact, &stress_mpa) in stress_mpa.iter() {
                let (peaks, force_n) = (self.peaks.get_mut(contact), *force_n.get(contact));
                states.force_n.get_mut(contact).push(force_n);
                states.stress_mpa.get_mut(contact).push(stress_mpa);
                let peak = |value| Peak { value, input_angle_deg, position_deg };
                // The first of equal values counts.
                if force_n > peaks.force_n.value {
                    peaks.force_n = peak(force_n);
                }
                if stress_mpa > peaks.stress_mpa.value {
                    (peaks.stress_mpa, peaks.force_at_stress_n) = (peak(stress_mpa), force_n);
                    *self.pressures.get_mut(contact) = Some(*tooth.pressure.get(contact));
                }
            }

            let sin_ring = point.tan_pressure_angle * point.cos_pressure_angle;
            // If lever arms vary, all three moments use the arm after wind-up.
            let arm_mm = center.lever_arm_mm;
            let turned_mm = tooth.spring.turned_arm_mm(&wind_up.rotation) - arm_mm;
            let moved_nmm = zones * force_n.wave_generator * turned_mm;
            torque_nmm.wave_generator += zones * force_n.wave_generator * arm_mm + moved_nmm;
            let ring_nmm = zones * force_n.ring * sin_ring * center.center_radius_mm;
            // A corner's moment differs from a flank's; the carrier carries the difference.
            let beyond_nmm = if matches!(tooth.pressure.ring, Pressure::Corner(_)) {
                ring_nmm - zones * force_n.wave_generator * arm_mm * flank.teeth_per_wave()
            } else {
                0.0
            };
            torque_nmm.ring += ring_nmm - beyond_nmm + moved_nmm * flank.teeth_per_wave();
            torque_nmm.carrier += zones * force_n.carrier * center.center_radius_mm - beyond_nmm
                + moved_nmm * self.loaded.drive().teeth_per_wave();
        }
        let residual = self.totals.balance.residual(&torque_nmm);
        self.totals.torque_balance_residual = worse(residual, self.totals.torque_balance_residual);
        Ok(loaded_teeth)
    }

    /// Returns the peaks of each contact, or an error if the law ends before the torque capacity.
    fn contact_peaks(&self) -> Result<PerContact<ContactPeaks>, SolveError> {
        if let Some(error) = &self.law_end {
            return Err(error.clone());
        }
        let materials = &self.loaded.load.materials;
        Ok(PerContact::of(|contact| {
            let peaks = self.peaks.get(contact);
            let of_line = peaks.of_line(self.loaded.drive().tooth_width_mm());
            self.pressures
                .get(contact)
                .map_or(of_line, |pressure| of_line.of_pressure(&pressure, peaks.force_at_stress_n, materials, contact))
        }))
    }

    fn finish(self, points: Points) -> Result<Sweep, SolveError> {
        let sweep = Sweep {
            mesh: *self.loaded.mesh(),
            peaks: self.contact_peaks()?,
            states: self.states,
            input_angles: self.input_angles,
            torque_capacity: self.totals.torque_capacity,
            torque_balance_residual: self.totals.torque_balance_residual,
            period_closure_residual: 0.0,
        };
        checked(sweep, self.loaded, points)
    }
}
