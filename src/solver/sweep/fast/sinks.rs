//! Receivers of tiles: columns of all states, or peaks only.

use std::iter::zip;
use std::ops::Range;

use super::lanes::{first_product, largest, largest_product, repeat_each};
use super::laps::{LapTeeth, Laps, whole};
use super::tile::Tile;
use crate::contact::{Contact, PerContact};
use crate::drive::Drive;
use crate::mesh::Place;
use crate::sweep::columns::{ContactPeaks, InputAngles, Peak, PeaksSoFar, States, Sweep, Totals};

/// Receives tiles, in order.
pub(super) trait Sink {
    /// True if it uses more of a state than its loads.
    const COLUMNS: bool;

    /// Receives a tile that starts at a sample. If the teeth of all zones are listed, `listed` contains those of its lap.
    fn take(&mut self, tile: &mut Tile<'_>, sample: u64, listed: &LapTeeth);
}

/// Receives all columns.
pub(super) struct ColumnSink<'a> {
    drive: &'a Drive,
    laps: &'a Laps,
    states: States,
    input_angles: InputAngles,
    /// Peaks of force and stress.
    peaks: PerContact<[RunningPeak; 2]>,
}

impl<'a> ColumnSink<'a> {
    pub(super) fn new(drive: &'a Drive, laps: &'a Laps) -> Self {
        let states = whole(laps.mesh.state_count(laps.samples));
        let states = if laps.are_listed() { States::of_zeros(states) } else { States::with_capacity(states, false) };
        let samples = whole(laps.mesh.last_sample(laps.samples) + 1);
        let input_angles = InputAngles::of_columns(|| vec![0.0; samples], vec![0; samples]);
        Self { drive, laps, states, input_angles, peaks: PerContact::default() }
    }

    /// Returns the sweep, to be checked. If one zone represents all, the last input angle repeats the first, every tooth
    /// one number higher.
    pub(super) fn sweep(self, totals: &Totals) -> Sweep {
        let Self { drive, laps, mut states, mut input_angles, peaks } = self;
        let peaks = PerContact::of(|contact| {
            let (force_n, stress_mpa) = (states.force_n.get(contact), states.stress_mpa.get(contact));
            let [of_force, of_stress] = peaks.get(contact);
            let (force_at, stress_at) = (of_force.find(force_n), of_stress.find(stress_mpa));
            let (force_peak_n, stress_peak_mpa) = (states.peak(force_n, force_at), states.peak(stress_mpa, stress_at));
            let force_at_stress_n = force_n[stress_at];
            let peaks = PeaksSoFar { force_n: force_peak_n, stress_mpa: stress_peak_mpa, force_at_stress_n };
            peaks.of_line(drive.tooth_width_mm())
        });
        if !laps.are_listed() {
            let end_deg = laps.input_angle_deg(laps.of_lap.count());
            states.repeat_first(laps.mesh.teeth_at(0, laps.of_lap).count(), end_deg);
            input_angles.repeat_first(end_deg);
        }
        Sweep {
            mesh: laps.mesh,
            states,
            input_angles,
            peaks,
            torque_capacity: totals.torque_capacity,
            torque_balance_residual: totals.torque_balance_residual,
            period_closure_residual: 0.0,
        }
    }

    /// Fills in the input angles of a tile, at each of which this many teeth are listed.
    #[inline(always)]
    fn fill_in_rows(&mut self, tile: &Tile<'_>, sample: u64, listed: usize) {
        // A tooth that represents several is listed as often.
        let (rows, times) = (tile.rows(), listed / tile.teeth);
        let (angles, of_rows) = (&mut self.input_angles, whole(sample)..whole(sample) + rows);
        angles.input_angle_deg[of_rows.clone()].copy_from_slice(&tile.row_input_angle_deg[..rows]);
        for (row, at) in of_rows.enumerate() {
            angles.wind_up_deg[at] = tile.row_rotation_rad[row].to_degrees();
            let stiffness = InputAngles::of_output(self.drive, tile.row_stiffness[row]);
            angles.torsional_stiffness_nm_per_rad[at] = stiffness;
            angles.loaded_teeth[at] = u32::try_from(tile.row_loaded[row] * times).unwrap_or(u32::MAX);
        }
    }

    /// Puts the teeth of all zones into their listed order.
    #[inline(always)]
    fn list(&mut self, tile: &Tile<'_>, sample: u64, lap: &LapTeeth) {
        let listed = lap.listed.iter().map(|run| run.at.len()).sum::<usize>();
        self.fill_in_rows(tile, sample, listed);
        let Self { laps, states, peaks, .. } = self;
        let (rows, teeth) = (tile.rows(), tile.teeth);
        let start = laps.states_before(sample);
        let all = start..start + rows * listed;
        let angles_of_rows = states.input_angle_deg[all.clone()].chunks_exact_mut(listed);
        for (column, &angle_deg) in angles_of_rows.zip(&*tile.row_input_angle_deg) {
            column.fill(angle_deg);
        }
        let mut at = start;
        for run in &lap.listed {
            let Place { slot, lobe, .. } = laps.mesh.place(run.teeth.first_slot, run.teeth.lobe);
            let of_run = at..at + run.at.len();
            let numbers = u32::try_from(slot).unwrap_or(u32::MAX)..;
            states.tooth[of_run.clone()].iter_mut().zip(numbers).for_each(|(tooth, number)| *tooth = number);
            states.lobe[of_run.clone()].fill(u32::try_from(lobe).unwrap_or(u32::MAX));
            at = of_run.end;
        }
        for row in all.clone().step_by(listed).skip(1) {
            states.tooth.copy_within(start..start + listed, row);
            states.lobe.copy_within(start..start + listed, row);
        }
        for (column, of_tile) in [
            (&mut states.position_deg, &tile.position_deg),
            (&mut states.center_radius_mm, &tile.center_radius_mm),
            (&mut states.wave_generator_angle_deg, &tile.wave_generator_angle_deg),
            (&mut states.ring_angle_deg, &tile.ring_angle_deg),
        ] {
            for_each_stretch(&mut column[all.clone()], listed, teeth, lap, |column, at| {
                column.copy_from_slice(&of_tile[at]);
            });
        }
        for contact in Contact::all() {
            let [force, stress] = peaks.get_mut(contact);
            for (column, unit, factor, peak) in [
                (states.force_n.get_mut(contact), tile.force.get(contact), &*tile.scale, force),
                (states.stress_mpa.get_mut(contact), tile.stress.get(contact), tile.stress_scale(contact), stress),
            ] {
                for_each_stretch(&mut column[all.clone()], listed, teeth, lap, |column, at| {
                    for (value, (unit, factor)) in column.iter_mut().zip(zip(&unit[at.clone()], &factor[at])) {
                        *value = unit * factor;
                    }
                });
                peak.see(&column[all.clone()], start);
            }
        }
    }
}

/// Calls a function for each chunk of a column whose teeth are adjacent in the tile too, with its index there.
#[inline(always)]
fn for_each_stretch(
    column: &mut [f64],
    listed: usize,
    teeth: usize,
    lap: &LapTeeth,
    mut each: impl FnMut(&mut [f64], Range<usize>),
) {
    if let [row] = &lap.stretches[..]
        && *row == (0..teeth)
    {
        let all = 0..column.len();
        each(column, all);
        return;
    }
    for (row, mut column) in column.chunks_exact_mut(listed).enumerate() {
        for stretch in &lap.stretches {
            let (of_stretch, rest) = column.split_at_mut(stretch.len());
            each(of_stretch, row * teeth + stretch.start..row * teeth + stretch.end);
            column = rest;
        }
    }
}

impl Sink for ColumnSink<'_> {
    const COLUMNS: bool = true;

    #[inline(always)]
    fn take(&mut self, tile: &mut Tile<'_>, sample: u64, listed: &LapTeeth) {
        if self.laps.are_listed() {
            self.list(tile, sample, listed);
            return;
        }
        self.fill_in_rows(tile, sample, tile.teeth);
        let (count, rows) = (tile.count, tile.rows());
        repeat_each(&tile.row_input_angle_deg[..rows], tile.teeth, tile.input_angle_deg);
        let states = &mut self.states;
        states.input_angle_deg.extend_from_slice(&tile.input_angle_deg[..count]);
        states.tooth.extend_from_slice(&tile.tooth[..count]);
        states.position_deg.extend_from_slice(&tile.position_deg[..count]);
        states.center_radius_mm.extend_from_slice(&tile.center_radius_mm[..count]);
        states.wave_generator_angle_deg.extend_from_slice(&tile.wave_generator_angle_deg[..count]);
        states.ring_angle_deg.extend_from_slice(&tile.ring_angle_deg[..count]);
        for contact in Contact::all() {
            let (scale, root) = (&tile.scale[..count], &tile.stress_scale(contact)[..count]);
            let [force, stress] = self.peaks.get_mut(contact);
            force.append(states.force_n.get_mut(contact), tile.force.get(contact), scale);
            stress.append(states.stress_mpa.get_mut(contact), tile.stress.get(contact), root);
        }
    }
}

/// Largest value of a growing column, and the first state of its tile.
#[derive(Clone, Copy, Default)]
struct RunningPeak {
    value: f64,
    start: usize,
}

impl RunningPeak {
    /// Appends scaled unit loads to the column, and updates the peak while they are in the cache.
    #[inline(always)]
    fn append(&mut self, column: &mut Vec<f64>, unit: &[f64], factor: &[f64]) {
        let start = column.len();
        column.extend(zip(unit, factor).map(|(unit, factor)| unit * factor));
        self.see(&column[start..], start);
    }

    /// Updates the peak with the states of a tile that begins at `start`. The first of equal values counts, in any
    /// order of tiles.
    #[inline(always)]
    fn see(&mut self, of_tile: &[f64], start: usize) {
        let value = largest(of_tile);
        if value.total_cmp(&self.value).then(self.start.cmp(&start)).is_gt() {
            *self = Self { value, start };
        }
    }

    /// Returns the state of the peak.
    fn find(&self, column: &[f64]) -> usize {
        self.start + column[self.start..].iter().position(|&value| value >= self.value).unwrap_or(0)
    }
}

/// Receives peaks only.
pub(super) struct PeakSink<'a> {
    drive: &'a Drive,
    contacts: PerContact<PeaksSoFar>,
}

impl<'a> PeakSink<'a> {
    pub(super) fn new(drive: &'a Drive) -> Self {
        Self { drive, contacts: PerContact::of(|_| PeaksSoFar::NONE) }
    }

    pub(super) fn contact_peaks(&self) -> PerContact<ContactPeaks> {
        PerContact::of(|contact| self.contacts.get(contact).of_line(self.drive.tooth_width_mm()))
    }
}

impl Sink for PeakSink<'_> {
    const COLUMNS: bool = false;

    #[inline(always)]
    fn take(&mut self, tile: &mut Tile<'_>, _: u64, _: &LapTeeth) {
        let count = tile.count;
        for contact in Contact::all() {
            let (force, scale) = (&tile.force.get(contact)[..count], &tile.scale[..count]);
            let (stress, root) = (&tile.stress.get(contact)[..count], &tile.stress_scale(contact)[..count]);
            let peaks = self.contacts.get_mut(contact);
            let peak = |value: f64, at: usize| Peak {
                value,
                input_angle_deg: tile.row_input_angle_deg[at / tile.teeth],
                position_deg: tile.position_deg_of(at),
            };
            let force_n = largest_product(force, scale);
            if force_n > peaks.force_n.value {
                peaks.force_n = peak(force_n, first_product(force, scale, force_n).unwrap_or(0));
            }
            let stress_mpa = largest_product(stress, root);
            if stress_mpa > peaks.stress_mpa.value {
                let at = first_product(stress, root, stress_mpa).unwrap_or(0);
                (peaks.stress_mpa, peaks.force_at_stress_n) = (peak(stress_mpa, at), force[at] * scale[at]);
            }
        }
    }
}

impl States {
    /// Appends the first `teeth` states again, one period later.
    fn repeat_first(&mut self, teeth: usize, input_angle_deg: f64) {
        self.input_angle_deg.extend(std::iter::repeat_n(input_angle_deg, teeth));
        self.tooth.extend_from_within(..teeth);
        let last = self.tooth.len() - teeth;
        self.tooth[last..].iter_mut().for_each(|tooth| *tooth += 1);
        for column in [
            &mut self.position_deg,
            &mut self.center_radius_mm,
            &mut self.wave_generator_angle_deg,
            &mut self.ring_angle_deg,
        ] {
            column.extend_from_within(..teeth);
        }
        for contact in Contact::all() {
            self.force_n.get_mut(contact).extend_from_within(..teeth);
            self.stress_mpa.get_mut(contact).extend_from_within(..teeth);
        }
    }
}
