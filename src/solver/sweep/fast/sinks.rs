//! What becomes of a tile: columns of all its states, or their peaks alone.

use std::iter::zip;

use super::lanes::{largest, repeat_each};
use super::tile::{Tile, whole};
use crate::contact::{Contact, PerContact};
use crate::drive::Drive;
use crate::mesh::{Mesh, Samples, TeethInMesh};
use crate::sweep::columns::{
    Columns, ContactPeaks, Extremes, InputAngles, Peak, PeakAt, States, SweepPeaks, TorqueCapacity,
};

/// Whoever takes tiles, in order.
pub(super) trait Sink {
    /// Whether it takes more of a state than its loads.
    const COLUMNS: bool;

    /// A tile with so many teeth at each input angle.
    fn take(&mut self, drive: &Drive, tile: &mut Tile<'_>, teeth: usize);
}

/// All columns.
pub(super) struct ColumnSink {
    states: States,
    input_angles: InputAngles,
    /// Of force and stress.
    peaks: PerContact<[RunningPeak; 2]>,
}

impl ColumnSink {
    pub(super) fn new(mesh: &Mesh, samples: Samples) -> Self {
        Self {
            states: States::with_capacity(whole(mesh.state_count(samples))),
            input_angles: InputAngles::with_capacity(whole(samples.count() + 1)),
            peaks: PerContact::default(),
        }
    }

    /// The columns, with the last input angle, which repeats the first, every tooth one further.
    pub(super) fn columns(self, mesh: &Mesh, samples: Samples, torque_balance_residual: f64) -> Columns {
        let Self { mut states, mut input_angles, peaks } = self;
        let peaks = PerContact::of(|contact| {
            let [force, stress] = peaks.get(contact);
            PeakAt {
                force: force.find(states.force_n.get(contact)),
                stress: stress.find(states.stress_mpa.get(contact)),
            }
        });
        let end_deg = mesh.input_angle_deg(samples.count(), samples);
        states.repeat_first(mesh.teeth_at(0, samples).count(), end_deg);
        input_angles.repeat_first(end_deg);
        Columns { states, input_angles, peaks, torque_balance_residual }
    }
}

impl Sink for ColumnSink {
    const COLUMNS: bool = true;

    #[inline(always)]
    fn take(&mut self, drive: &Drive, tile: &mut Tile<'_>, teeth: usize) {
        let (count, rows) = (tile.count, tile.count / teeth);
        self.input_angles.extend(
            drive,
            &tile.row_input_angle_deg[..rows],
            &tile.row_rotation_rad[..rows],
            tile.row_stiffness[..rows].iter().copied(),
            tile.row_loaded.iter().copied(),
        );
        repeat_each(&tile.row_input_angle_deg[..rows], teeth, tile.input_angle_deg);
        let states = &mut self.states;
        states.input_angle_deg.extend_from_slice(&tile.input_angle_deg[..count]);
        states.tooth.extend_from_slice(&tile.tooth[..count]);
        states.position_deg.extend_from_slice(&tile.position_deg[..count]);
        states.center_radius_mm.extend_from_slice(&tile.center_radius_mm[..count]);
        states.wave_generator_angle_deg.extend_from_slice(&tile.wave_generator_angle_deg[..count]);
        states.ring_angle_deg.extend_from_slice(&tile.ring_angle_deg[..count]);
        for contact in CONTACTS {
            let (scale, root) = (&tile.scale[..count], &tile.stress_scale(contact)[..count]);
            let [force, stress] = self.peaks.get_mut(contact);
            force.append(states.force_n.get_mut(contact), tile.force.get(contact), scale);
            stress.append(states.stress_mpa.get_mut(contact), tile.stress.get(contact), root);
        }
    }
}

const CONTACTS: [Contact; 3] = [Contact::WaveGenerator, Contact::Ring, Contact::Carrier];

/// The largest value of a growing column, and the first state of the tile that it stands in.
#[derive(Clone, Copy, Default)]
struct RunningPeak {
    value: f64,
    start: usize,
}

impl RunningPeak {
    /// Appends unit loads times what scales them to the column, and looks at them while they are near.
    #[inline(always)]
    fn append(&mut self, column: &mut Vec<f64>, unit: &[f64], factor: &[f64]) {
        let start = column.len();
        column.extend(zip(unit, factor).map(|(unit, factor)| unit * factor));
        let value = largest(&column[start..]);
        if value > self.value {
            *self = Self { value, start };
        }
    }

    /// The state itself.
    fn find(&self, column: &[f64]) -> usize {
        self.start + column[self.start..].iter().position(|&value| value >= self.value).unwrap_or(0)
    }
}

/// What all teeth together come to at the input angles so far.
pub(super) struct AngleExtremes {
    wind_up_deg: Extremes,
    torsional_stiffness_nm_per_rad: Extremes,
    loaded_teeth: Option<TeethInMesh>,
}

impl AngleExtremes {
    pub(super) const NONE: Self =
        Self { wind_up_deg: Extremes::NONE, torsional_stiffness_nm_per_rad: Extremes::NONE, loaded_teeth: None };

    /// Those of a tile, too.
    #[inline(always)]
    pub(super) fn take(&mut self, drive: &Drive, tile: &Tile<'_>, rows: usize) {
        let torque_ratio = drive.teeth_per_wave();
        for row in 0..rows {
            self.wind_up_deg = self.wind_up_deg.with(tile.row_rotation_rad[row].to_degrees());
            let stiffness = 1e-3 * tile.row_stiffness[row] * torque_ratio * torque_ratio;
            self.torsional_stiffness_nm_per_rad = self.torsional_stiffness_nm_per_rad.with(stiffness);
            let loaded = tile.row_loaded[row] as u64;
            let TeethInMesh { min, max } = self.loaded_teeth.unwrap_or(TeethInMesh { min: loaded, max: loaded });
            self.loaded_teeth = Some(TeethInMesh { min: min.min(loaded), max: max.max(loaded) });
        }
    }

    /// With what each contact comes to.
    pub(super) fn peaks(
        self,
        contacts: PerContact<ContactPeaks>,
        torque_capacity: Option<TorqueCapacity>,
        torque_balance_residual: f64,
    ) -> SweepPeaks {
        SweepPeaks {
            contacts,
            wind_up_deg: self.wind_up_deg,
            torsional_stiffness_nm_per_rad: self.torsional_stiffness_nm_per_rad,
            loaded_teeth: self.loaded_teeth.unwrap_or(TeethInMesh { min: 0, max: 0 }),
            torque_capacity,
            torque_balance_residual,
        }
    }
}

/// Peaks alone.
pub(super) struct PeakSink {
    /// Of force and stress.
    peaks: PerContact<[PlacedPeak; 2]>,
    angles: AngleExtremes,
}

/// The largest value so far, and the state where it stands.
#[derive(Clone, Copy, Default)]
struct PlacedPeak {
    value: f64,
    input_angle_deg: f64,
    position_deg: f64,
    /// The force there.
    force_n: f64,
}

impl PlacedPeak {
    fn peak(&self) -> Peak {
        Peak { value: self.value, input_angle_deg: self.input_angle_deg, position_deg: self.position_deg }
    }
}

impl Default for PeakSink {
    fn default() -> Self {
        Self { peaks: PerContact::default(), angles: AngleExtremes::NONE }
    }
}

impl PeakSink {
    pub(super) fn peaks(self, drive: &Drive, torque_balance_residual: f64) -> SweepPeaks {
        let width_mm = drive.tooth_width_mm();
        let contacts = PerContact::of(|contact| {
            let [force, stress] = self.peaks.get(contact);
            ContactPeaks::of_line(force.peak(), stress.peak(), stress.force_n, width_mm)
        });
        self.angles.peaks(contacts, None, torque_balance_residual)
    }
}

impl Sink for PeakSink {
    const COLUMNS: bool = false;

    #[inline(always)]
    fn take(&mut self, drive: &Drive, tile: &mut Tile<'_>, teeth: usize) {
        let (count, rows) = (tile.count, tile.count / teeth);
        self.angles.take(drive, tile, rows);
        for contact in CONTACTS {
            scale(tile.force.get_mut(contact), tile.scale, count);
            let is_one = tile.stress_exponents.is_one_at(contact);
            scale(tile.stress.get_mut(contact), if is_one { tile.scale } else { tile.scale_root }, count);
            for (peak, is_stress) in self.peaks.get_mut(contact).iter_mut().zip([false, true]) {
                let column = if is_stress { tile.stress.get(contact) } else { tile.force.get(contact) };
                let value = largest(&column[..count]);
                if value > peak.value {
                    let at = column[..count].iter().position(|&found| found >= value).unwrap_or(0);
                    *peak = PlacedPeak {
                        value,
                        input_angle_deg: tile.row_input_angle_deg[at / teeth],
                        position_deg: tile.position_deg_of(at),
                        force_n: tile.force.get(contact)[at],
                    };
                }
            }
        }
    }
}

#[inline(always)]
fn scale(column: &mut [f64], factor: &[f64], count: usize) {
    for (value, factor) in zip(&mut column[..count], factor) {
        *value *= factor;
    }
}

impl States {
    /// Appends the first `teeth` states again, a period on.
    fn repeat_first(&mut self, teeth: usize, input_angle_deg: f64) {
        self.input_angle_deg.extend(std::iter::repeat_n(input_angle_deg, teeth));
        self.tooth.extend_from_within(..teeth);
        let last = self.tooth.len() - teeth;
        self.tooth[last..].iter_mut().for_each(|tooth| *tooth += 1);
        let PerContact { wave_generator: force_h, ring: force_k, carrier: force_s } = &mut self.force_n;
        let PerContact { wave_generator: stress_h, ring: stress_k, carrier: stress_s } = &mut self.stress_mpa;
        for column in [
            &mut self.position_deg,
            &mut self.center_radius_mm,
            &mut self.wave_generator_angle_deg,
            &mut self.ring_angle_deg,
            force_h,
            force_k,
            force_s,
            stress_h,
            stress_k,
            stress_s,
        ] {
            column.extend_from_within(..teeth);
        }
    }
}
