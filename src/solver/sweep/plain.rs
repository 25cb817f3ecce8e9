//! Sweep state by state: the reference for the fast path, and the fallback for drives it does not support.

use crate::contact::{Contact, Materials, PerContact};
use crate::load_sharing::{LawEnd, LoadCase, LoadedDrive, ToothState, TorqueLimit};
use crate::mesh::{PlacedTooth, Samples};
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::sweep::adaptive::{self, Looking};
use crate::sweep::columns::{
    AngleExtremes, Columns, ContactPeaks, InputAngles, Peak, PeakAt, States, Sweep, SweepPeaks, TorqueBalance,
    TorqueCapacity, check, finished, worse,
};
use crate::sweep::points::Points;
use crate::tooth::Pressure;
use crate::{SolveError, Stop};

/// Pressure with the largest stress of a contact so far.
#[derive(Debug, Clone, Copy)]
struct Hardest {
    stress_mpa: f64,
    force_n: f64,
    pressure: Pressure,
}

impl States {
    /// Returns the first of the largest values of a column and its index; none for an empty column.
    fn first_peak(&self, column: &[f64]) -> Option<(usize, Peak)> {
        let at = peak_at(column);
        (!column.is_empty()).then(|| (at, self.peak(column, at)))
    }

    /// Removes all states and keeps their memory.
    fn clear(&mut self) {
        let Self {
            input_angle_deg,
            tooth,
            lobe,
            position_deg,
            center_radius_mm,
            wave_generator_angle_deg,
            ring_angle_deg,
            force_n,
            stress_mpa,
        } = self;
        let of_places = [input_angle_deg, position_deg, center_radius_mm, wave_generator_angle_deg, ring_angle_deg];
        of_places.into_iter().for_each(Vec::clear);
        tooth.clear();
        lobe.clear();
        force_n.clear();
        stress_mpa.clear();
    }
}

impl InputAngles {
    fn clear(&mut self) {
        let Self { input_angle_deg, wind_up_deg, torsional_stiffness_nm_per_rad, loaded_teeth } = self;
        [input_angle_deg, wind_up_deg, torsional_stiffness_nm_per_rad].into_iter().for_each(Vec::clear);
        loaded_teeth.clear();
    }
}

/// Returns the index of the first of the largest values of a column.
fn peak_at(column: &[f64]) -> usize {
    column.iter().enumerate().fold(0, |at, (index, &value)| if value > column[at] { index } else { at })
}

/// Runs the sweep.
///
/// # Errors
/// As [`sweep`](crate::sweep::sweep()).
pub(crate) fn sweep(
    loaded: &LoadedDrive<'_>,
    load: &LoadCase,
    points: Points,
    looking: Looking,
    stop: &dyn Stop,
) -> Result<Sweep, SolveError> {
    let mesh = *loaded.mesh();
    let mut columns = Growing::new(loaded, load.parameters().allowable_stress_mpa);
    match points {
        Points::Samples(samples) => {
            columns.reserve(mesh.state_count(samples));
            for sample in 0..=mesh.last_sample(samples) {
                if stop.stopped() {
                    return Err(SolveError::Stopped);
                }
                columns.add(mesh.input_angle_deg(sample, samples), mesh.placed_at(sample, samples))?;
            }
        }
        Points::Tolerance(tolerance) => {
            let by_lap = adaptive::moments(loaded, load, tolerance, looking, stop)?;
            // Each place was counted once. It may represent several listed teeth, and occurs in every lap.
            let places = by_lap.iter().flatten().map(|moment| moment.places()).sum::<u64>();
            let listed = places * (mesh.laps() / by_lap.len() as u64) * mesh.listed_at_each_place();
            let limit = tolerance.max_states();
            if listed > limit {
                return Err(SolveError::TooManyStates { limit });
            }
            let lap_deg = mesh.sweep_period_deg() / mesh.laps() as f64;
            // If items are alike, so are all laps.
            for (lap, moments) in (0..mesh.laps()).zip(by_lap.iter().cycle()) {
                // A lap begins at the end of the one before.
                for moment in &moments[usize::from(lap > 0)..] {
                    if stop.stopped() {
                        return Err(SolveError::Stopped);
                    }
                    columns.add((lap as f64 + moment.fraction) * lap_deg, moment.placed(&mesh, lap))?;
                }
            }
        }
    }
    columns.finish(points, &load.parameters().materials)
}

/// Returns the peaks of a sweep over equal intervals, keeping only some states at a time.
///
/// # Errors
/// As [`sweep`](crate::sweep::sweep()).
pub(crate) fn peaks(
    loaded: &LoadedDrive<'_>,
    load: &LoadCase,
    samples: Samples,
    stop: &dyn Stop,
) -> Result<SweepPeaks, SolveError> {
    const STATES_AT_A_TIME: usize = 1024;
    let mesh = *loaded.mesh();
    let mut columns = Growing::new(loaded, load.parameters().allowable_stress_mpa);
    let mut seen = SeenSoFar::default();
    for sample in 0..=mesh.last_sample(samples) {
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        columns.add(mesh.input_angle_deg(sample, samples), mesh.placed_at(sample, samples))?;
        if columns.states.len() >= STATES_AT_A_TIME {
            seen.take(&mut columns);
        }
    }
    seen.take(&mut columns);
    if let Some(end) = columns.law_end {
        return Err(end.error(true));
    }
    check("torque balance", columns.torque_balance_residual)?;
    let contacts = PerContact::of(|contact| {
        let &SeenAt { force_n, stress_mpa, force_at_stress_n } = seen.contacts.get(contact);
        let peaks = ContactPeaks::of_line(force_n, stress_mpa, force_at_stress_n, loaded.drive().tooth_width_mm());
        columns.complete(peaks, &load.parameters().materials, contact)
    });
    Ok(seen.angles.peaks(contacts, columns.torque_capacity, columns.torque_balance_residual))
}

/// Summary of the states that are no longer kept.
struct SeenSoFar {
    contacts: PerContact<SeenAt>,
    angles: AngleExtremes,
}

/// First of the largest values at a contact.
#[derive(Debug, Clone, Copy)]
struct SeenAt {
    force_n: Peak,
    stress_mpa: Peak,
    force_at_stress_n: f64,
}

impl Default for SeenSoFar {
    fn default() -> Self {
        let none = Peak { value: f64::NEG_INFINITY, input_angle_deg: 0.0, position_deg: 0.0 };
        Self {
            contacts: PerContact::of(|_| SeenAt { force_n: none, stress_mpa: none, force_at_stress_n: 0.0 }),
            angles: AngleExtremes::NONE,
        }
    }
}

impl SeenSoFar {
    /// Summarises the states collected so far and clears them.
    fn take(&mut self, columns: &mut Growing<'_>) {
        let Growing { states, input_angles, .. } = columns;
        self.contacts = PerContact::of(|contact| {
            let mut seen = *self.contacts.get(contact);
            let (forces_n, stresses_mpa) = (states.force_n.get(contact), states.stress_mpa.get(contact));
            if let Some((_, force_n)) = states.first_peak(forces_n).filter(|(_, peak)| peak.value > seen.force_n.value)
            {
                seen.force_n = force_n;
            }
            let stress_mpa = states.first_peak(stresses_mpa);
            if let Some((at, stress_mpa)) = stress_mpa.filter(|(_, peak)| peak.value > seen.stress_mpa.value) {
                (seen.stress_mpa, seen.force_at_stress_n) = (stress_mpa, forces_n[at]);
            }
            seen
        });
        let InputAngles { wind_up_deg, torsional_stiffness_nm_per_rad, loaded_teeth, .. } = input_angles;
        for ((&wind_up_deg, &stiffness), &teeth) in
            wind_up_deg.iter().zip(&*torsional_stiffness_nm_per_rad).zip(&*loaded_teeth)
        {
            self.angles.see(wind_up_deg, stiffness, u64::from(teeth));
        }
        states.clear();
        input_angles.clear();
    }
}

/// Sweep that is built input angle by input angle.
struct Growing<'a> {
    loaded: &'a LoadedDrive<'a>,
    allowable_stress_mpa: Option<PerContact<f64>>,
    states: States,
    input_angles: InputAngles,
    torque_capacity: Option<TorqueCapacity>,
    /// Set if the least limit is the end of Johnson's law instead of a stress.
    law_end: Option<LawEnd>,
    balance: TorqueBalance,
    torque_balance_residual: f64,
    lists_lobes: bool,
    teeth: Vec<ToothState>,
    hardest: PerContact<Option<Hardest>>,
}

impl<'a> Growing<'a> {
    fn new(loaded: &'a LoadedDrive<'a>, allowable_stress_mpa: Option<PerContact<f64>>) -> Self {
        Self {
            loaded,
            allowable_stress_mpa,
            states: States::default(),
            input_angles: InputAngles::default(),
            torque_capacity: None,
            law_end: None,
            balance: TorqueBalance::new(loaded.drive(), loaded.input_torque_nmm()),
            torque_balance_residual: 0.0,
            lists_lobes: !loaded.mesh().zones_are_alike(),
            teeth: Vec::new(),
            hardest: PerContact::default(),
        }
    }

    fn reserve(&mut self, states: u64) {
        // The caller has bounded the count to what fits in memory.
        self.states = States::with_capacity(usize::try_from(states).unwrap_or(usize::MAX));
    }

    /// Appends the states of the teeth in mesh at one input angle.
    fn add(&mut self, input_angle_deg: f64, placed: impl Iterator<Item = PlacedTooth>) -> Result<(), SolveError> {
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
        let loaded_teeth = self.share_load(&wind_up)?;
        self.input_angles.push(self.loaded.drive(), input_angle_deg, &wind_up, loaded_teeth);
        if let Some(allowable_stress_mpa) = &self.allowable_stress_mpa {
            let limit = self.loaded.torque_limit(&self.teeth, allowable_stress_mpa)?;
            let input_torque_nm = 1e-3 * limit.input_torque_nmm;
            if self.torque_capacity.is_none_or(|capacity| input_torque_nm < capacity.input_torque_nm) {
                let output_torque_nm = input_torque_nm * self.loaded.drive().teeth_per_wave();
                let TorqueLimit { contact, turns_past_teeth, law_end, .. } = limit;
                self.torque_capacity = Some(TorqueCapacity {
                    input_torque_nm,
                    output_torque_nm,
                    limited_by: contact.into(),
                    turns_past_teeth,
                    input_angle_deg,
                });
                self.law_end = law_end;
            }
        }
        Ok(())
    }

    /// Appends geometry, forces and stresses of the teeth. Returns the number of teeth that carry load.
    fn share_load(&mut self, wind_up: &WindUp) -> Result<usize, NotConverged> {
        let flank = self.loaded.drive().flank();
        let states = &mut self.states;
        let mut loaded_teeth = 0;
        let zones = self.loaded.zones();
        let mut torque_nmm = PerContact::<f64>::default();
        for tooth in &self.teeth {
            let ToothState { center, flank: point, .. } = tooth;
            states.center_radius_mm.push(center.center_radius_mm);
            let cam_angle_rad = flank.locus().contact_angle_from_valley_rad(center);
            states.wave_generator_angle_deg.push(cam_angle_rad.to_degrees());
            states.ring_angle_deg.push(flank.angle_from_tip_rad(center, point).to_degrees());

            let force_n = self.loaded.forces_n(tooth, wind_up)?;
            loaded_teeth += usize::from(force_n.wave_generator > 0.0);
            let stress_mpa = self.loaded.stress_mpa(tooth, &force_n);
            for (contact, &stress_mpa) in stress_mpa.iter() {
                let hardest = self.hardest.get_mut(contact);
                // The first of equal values, as among the states.
                if hardest.is_none_or(|before| stress_mpa > before.stress_mpa) {
                    let (force_n, pressure) = (*force_n.get(contact), *tooth.pressure.get(contact));
                    *hardest = Some(Hardest { stress_mpa, force_n, pressure });
                }
            }
            states.force_n.push(force_n);
            states.stress_mpa.push(stress_mpa);

            let sin_ring = point.tan_pressure_angle * point.cos_pressure_angle;
            // If lever arms vary, all three moments use the arm after wind-up.
            let arm_mm = center.cam_contact.lever_arm_mm;
            let turned_mm = tooth.spring.turned_static_arm_mm(&wind_up.rotation) - arm_mm;
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
        let residual = self.balance.residual(&torque_nmm);
        self.torque_balance_residual = worse(residual, self.torque_balance_residual);
        Ok(loaded_teeth)
    }

    /// Returns the peaks of a contact, completed from its hardest pressure.
    fn complete(&self, peaks: ContactPeaks, materials: &Materials, contact: Contact) -> ContactPeaks {
        match self.hardest.get(contact) {
            Some(Hardest { force_n, pressure, .. }) => peaks.of_pressure(pressure, *force_n, materials, contact),
            None => peaks,
        }
    }

    fn finish(mut self, points: Points, materials: &Materials) -> Result<Sweep, SolveError> {
        if let Some(end) = self.law_end {
            return Err(end.error(true));
        }
        let states = std::mem::take(&mut self.states);
        let peaks = PerContact::of(|contact| PeakAt {
            force: peak_at(states.force_n.get(contact)),
            stress: peak_at(states.stress_mpa.get(contact)),
        });
        let input_angles = std::mem::take(&mut self.input_angles);
        let columns = Columns { states, input_angles, peaks, torque_balance_residual: self.torque_balance_residual };
        let mut sweep = finished(self.loaded, points, columns, self.torque_capacity)?;
        sweep.peaks = PerContact::of(|contact| self.complete(*sweep.peaks.get(contact), materials, contact));
        Ok(sweep)
    }
}

impl PerContact<Vec<f64>> {
    fn clear(&mut self) {
        let Self { wave_generator, ring, carrier } = self;
        [wave_generator, ring, carrier].into_iter().for_each(Vec::clear);
    }

    fn push(&mut self, values: PerContact<f64>) {
        self.wave_generator.push(values.wave_generator);
        self.ring.push(values.ring);
        self.carrier.push(values.carrier);
    }
}
