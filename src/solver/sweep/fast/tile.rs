//! Tiles: columns of the states of a few input angles, small enough for the first-level cache, and the positions of
//! their teeth.

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::iter::zip;
use std::ops::Range;

use super::Kernel;
use super::gaps::{GapColumns, GapWork};
use super::lanes::{LANES, VECTOR};
use super::laps::{Laps, Layout, whole};
use super::sharing::Work;
use crate::contact::{Contact, PerContact};
use crate::mesh::{Mesh, Samples};
use crate::position::Position;
use crate::tooth::StressExponents;

/// Number of states of a tile, unless one input angle has more: its columns fit in the first-level cache.
const TILE: usize = 128;

/// Sines and cosines of angles.
pub(super) struct SineTable {
    sin: Vec<f64>,
    cos: Vec<f64>,
}

impl SineTable {
    /// Returns those of `count` multiples of a step, at most [`TILE`], from 0 to at most a quarter turn. They are sums
    /// of a few steps and a few strides.
    fn equally_spaced(step_rad: f64, count: usize) -> Self {
        // There are one or two strides more than steps in a stride.
        const STRIDE: usize = TILE.isqrt() + 2;
        let sines = |step_rad: f64, count: usize| {
            let mut sines = [(0.0, 0.0); STRIDE];
            for (index, sines) in sines[..count].iter_mut().enumerate() {
                *sines = (step_rad * index as f64).sin_cos();
            }
            sines
        };
        let stride = count.isqrt().max(1);
        let strides = count.div_ceil(stride);
        let (fine, coarse) = (sines(step_rad, stride), sines(step_rad * stride as f64, strides));
        let mut table = Self { sin: Vec::with_capacity(count + stride), cos: Vec::with_capacity(count + stride) };
        for (coarse_sin, coarse_cos) in &coarse[..strides] {
            table.sin.extend(fine[..stride].iter().map(|(sin, cos)| coarse_sin * cos + coarse_cos * sin));
            table.cos.extend(fine[..stride].iter().map(|(sin, cos)| coarse_cos * cos - coarse_sin * sin));
        }
        table
    }
}

/// Input angles at which the same teeth mesh.
///
/// The position of a tooth is a sum of three angles: its own at the start of the run, one of the tile, and one of the
/// input angle within the tile. The first and the last form a pattern common to all tiles, so each tile needs the sine
/// of one angle only. Teeth move towards the lobe, so the sum cancels only for the tooth next to it. That tooth is
/// computed from the end of the tile.
pub(super) struct Run {
    first: u64,
    end: u64,
    /// Samples of the period.
    of: Samples,
    /// Distance of successive samples.
    stride: u64,
    pub(super) places: usize,
    pub(super) teeth: usize,
    layout: Layout,
    /// Number of samples of a tile, except the last.
    rows: usize,
    mesh: Mesh,
}

impl Run {
    /// Returns the run of the samples at parts of a lap, from the first part on.
    pub(super) fn from(first: u64, laps: &Laps, mesh: &Mesh, layout: Layout) -> Self {
        let (of, stride) = (laps.of_lap, laps.stride);
        let end = mesh.same_teeth_until(first, of);
        let places = whole(*mesh.teeth_at(first, of).end());
        let teeth = layout.at_each_place * places;
        let count = whole((end - first).div_ceil(stride));
        let rows = count.div_ceil(count.div_ceil((TILE / teeth).max(1)));
        Self { first, end, of, stride, places, teeth, layout, rows, mesh: *mesh }
    }

    /// Returns the first samples of its tiles.
    pub(super) fn starts(&self) -> impl Iterator<Item = u64> + use<> {
        (self.first..self.end).step_by(whole(self.stride) * self.rows)
    }

    /// Returns the first sample beyond it.
    pub(super) const fn next(&self) -> u64 {
        self.first + (self.end - self.first).div_ceil(self.stride) * self.stride
    }

    /// Computes the pattern of its tiles.
    #[inline(always)]
    pub(super) fn lay_pattern(&self, tile: &mut Tile<'_>) {
        let Self { teeth, rows, places, layout, .. } = *self;
        let (base_sin, base_cos) = (&mut tile.base_sin[..teeth], &mut tile.base_cos[..teeth]);
        let base_step = &mut tile.base_step[..teeth];
        for place in 1..=places {
            let Position { phase_sin: sin, phase_cos: cos, .. } =
                self.mesh.position_in_mesh(place as u64, self.first, self.of);
            for at in (layout.index(place, places)..teeth).step_by(places) {
                // Whole numbers below 2^53: exact.
                (base_sin[at], base_cos[at], base_step[at]) = (sin, cos, place as f64 * self.of.count() as f64);
            }
        }
        tile.last_place = layout.index(places, places);
        tile.tooth.clear();
        let last_tooth = u32::try_from(teeth).unwrap_or(u32::MAX);
        for row in 0..rows {
            let of_row = row * teeth..(row + 1) * teeth;
            let (row_sin, row_cos) = (tile.row_sines.sin[row], tile.row_sines.cos[row]);
            let (sin, cos) = (&mut tile.pattern_sin[of_row.clone()], &mut tile.pattern_cos[of_row.clone()]);
            let step = &mut tile.pattern_step[of_row];
            let passed = (row as u64 * self.stride) as f64;
            for i in 0..teeth {
                sin[i] = base_sin[i] * row_cos - base_cos[i] * row_sin;
                cos[i] = base_cos[i] * row_cos + base_sin[i] * row_sin;
                step[i] = base_step[i] - passed;
            }
            tile.tooth.extend(1..=last_tooth);
        }
    }

    /// Computes the positions of all teeth of the tile that begins with a sample, by sample and then tooth.
    #[inline(always)]
    pub(super) fn place(&self, start: u64, tile: &mut Tile<'_>) {
        let rows = self.rows.min(whole((self.end - start).div_ceil(self.stride)));
        (tile.teeth, tile.count) = (self.teeth, rows * self.teeth);
        let len = tile.len();
        let passed = start as f64;
        let turn_rad = (start - self.first) as f64 * self.mesh.phase_step_rad(self.of);
        let (turn_sin, turn_cos) = turn_rad.sin_cos();
        let (pattern_sin, pattern_cos) = (&tile.pattern_sin[..len], &tile.pattern_cos[..len]);
        let pattern_step = &tile.pattern_step[..len];
        let (sin, cos) = (&mut tile.sin[..len], &mut tile.cos[..len]);
        for i in 0..len {
            sin[i] = pattern_sin[i] * turn_cos - pattern_cos[i] * turn_sin;
            cos[i] = pattern_cos[i] * turn_cos + pattern_sin[i] * turn_sin;
        }
        // Steps of a whole turn.
        let steps = self.mesh.steps(self.of) as f64;
        if !tile.position_deg.is_empty() {
            let (position_deg, from_valley_rad) = (&mut tile.position_deg[..len], &mut tile.from_valley_rad[..len]);
            let lobes = f64::from(self.mesh.lobe_count());
            // π/U - ψ.
            let valley_step_rad = PI / lobes / steps;
            for i in 0..len {
                let step = pattern_step[i] - passed;
                position_deg[i] = 360.0 * step / steps;
                from_valley_rad[i] = (steps - 2.0 * lobes * step) * valley_step_rad;
            }
        }
        if !tile.gaps.from_lobe_rad.is_empty() {
            for (from_lobe_rad, step) in zip(&mut tile.gaps.from_lobe_rad[..len], pattern_step) {
                *from_lobe_rad = 2.0 * PI * ((step - passed) / steps);
            }
        }
        (tile.passed, tile.steps) = (passed, steps);
        // The first tooth, computed from its position at the last sample.
        let end = self.mesh.position_in_mesh(1, start + (rows as u64 - 1) * self.stride, self.of);
        for (row, to_end) in (0..rows).rev().enumerate() {
            let (row_sin, row_cos) = (tile.row_sines.sin[to_end], tile.row_sines.cos[to_end]);
            for at in (row * self.teeth..(row + 1) * self.teeth).step_by(self.places) {
                sin[at] = end.phase_sin * row_cos + end.phase_cos * row_sin;
                cos[at] = end.phase_cos * row_cos - end.phase_sin * row_sin;
            }
        }
    }
}

/// Largest size of the tiles of a sweep.
pub(super) struct TileSize {
    /// Number of states, with those that fill the last chunk and space for [`repeat_each`](super::lanes::repeat_each).
    len: usize,
    /// Number of input angles.
    pub(super) rows: usize,
    /// Number of teeth at an input angle.
    teeth: usize,
    /// True if a state has more columns than its loads.
    with_columns: bool,
    /// True if loads are more than scaled unit loads.
    with_work: bool,
    /// True if gaps are not the same at all teeth.
    with_gaps: bool,
}

impl TileSize {
    /// Returns the size for equal intervals.
    pub(super) fn of(kernel: &Kernel<'_>, samples: Samples, at_each_place: usize, with_columns: bool) -> Self {
        let mesh = kernel.loaded.mesh();
        let teeth_at = |sample| at_each_place * whole(*mesh.teeth_at(sample, samples).end());
        let (least, most) = (teeth_at(0).max(1), teeth_at(samples.count() - 1));
        let states = TILE.min(at_each_place * whole(mesh.state_count(samples))).max(most);
        let rows = whole(samples.count()).min(TILE.div_ceil(least));
        Self { with_columns, ..Self::new(kernel, states, rows, most) }
    }

    /// Returns the size for arbitrary input angles, with at most this many teeth and loads only.
    pub(super) fn anywhere(kernel: &Kernel<'_>, teeth: usize) -> Self {
        let rows = (TILE / teeth).max(1);
        Self::new(kernel, rows * teeth, rows, teeth)
    }

    const fn new(kernel: &Kernel<'_>, states: usize, rows: usize, teeth: usize) -> Self {
        Self {
            len: states.next_multiple_of(LANES) + VECTOR,
            rows,
            teeth,
            with_columns: false,
            with_work: kernel.sharing.is_some(),
            with_gaps: matches!(kernel.gaps, Some(GapColumns::Unlike(_))),
        }
    }

    /// Returns the total number of doubles of a tile.
    pub(super) const fn doubles(&self) -> usize {
        let (of_columns, of_work) = (self.with_columns as usize, self.with_work as usize);
        let of_gaps = self.with_gaps as usize;
        (17 + 5 * of_columns + Work::COLUMNS * of_work + GapWork::COLUMNS * of_gaps) * self.len
            + (8 + Work::ROWS * of_work) * self.rows
            + (3 + GapWork::ITEMS * of_gaps) * self.teeth
    }
}

/// Columns of the states of a few input angles: positions, geometry and unit loads. All are in one block of memory.
pub(super) struct Tile<'a> {
    /// Number of states. Lanes beyond the last one contain arbitrary teeth.
    pub(super) count: usize,
    /// Number of teeth at an input angle.
    pub(super) teeth: usize,
    /// Elapsed steps of the turn at its first input angle, and steps of the whole turn.
    pub(super) passed: f64,
    pub(super) steps: f64,
    /// Sines of the steps from one input angle to the next.
    pub(super) row_sines: SineTable,
    pub(super) tooth: Vec<u32>,
    // Teeth at the start of the run.
    pub(super) base_sin: &'a mut [f64],
    pub(super) base_cos: &'a mut [f64],
    pub(super) base_step: &'a mut [f64],
    /// Index of the tooth that may be in the valley.
    pub(super) last_place: usize,
    pub(super) pattern_sin: &'a mut [f64],
    pub(super) pattern_cos: &'a mut [f64],
    pub(super) pattern_step: &'a mut [f64],
    pub(super) sin: &'a mut [f64],
    pub(super) cos: &'a mut [f64],
    pub(super) from_valley_rad: &'a mut [f64],
    pub(super) input_angle_deg: &'a mut [f64],
    pub(super) position_deg: &'a mut [f64],
    pub(super) center_radius_mm: &'a mut [f64],
    pub(super) wave_generator_angle_deg: &'a mut [f64],
    pub(super) ring_angle_deg: &'a mut [f64],
    /// Forces over `scale`.
    pub(super) force: PerContact<&'a mut [f64]>,
    /// Stresses over the root of `scale`: square root for lines, cube root for balls; over `scale` itself for a flat.
    pub(super) stress: PerContact<&'a mut [f64]>,
    /// Torques of the forces over `scale`.
    pub(super) torque: PerContact<&'a mut [f64]>,
    /// Factor from unit loads to loads: `Δφ`, or `F_H` of each tooth.
    pub(super) scale: &'a mut [f64],
    pub(super) scale_root: &'a mut [f64],
    pub(super) stress_exponents: StressExponents,
    /// Columns for laws that are not linear.
    pub(super) work: Work<'a>,
    pub(super) gaps: GapWork<'a>,
    // Columns by input angle.
    pub(super) row_torque: PerContact<&'a mut [f64]>,
    pub(super) row_input_angle_deg: &'a mut [f64],
    pub(super) row_rotation_rad: &'a mut [f64],
    pub(super) row_rotation_root: &'a mut [f64],
    pub(super) row_stiffness: &'a mut [f64],
    /// Number of carrying teeth.
    pub(super) row_loaded: Vec<usize>,
    pub(super) row_residual: &'a mut [f64],
}

/// Chunk of a tile: positions of its states, and space for their loads.
pub(super) struct TileLanes<'t> {
    pub(super) sin: &'t [f64; LANES],
    pub(super) cos: &'t [f64; LANES],
    pub(super) force: PerContact<&'t mut [f64; LANES]>,
    pub(super) stress: PerContact<&'t mut [f64; LANES]>,
    pub(super) torque: PerContact<&'t mut [f64; LANES]>,
}

impl<'a> Tile<'a> {
    pub(super) fn new(arena: &'a mut [f64], size: &TileSize, step_rad: f64, stress_exponents: StressExponents) -> Self {
        let &TileSize { len, rows, teeth, with_columns, with_work, with_gaps } = size;
        let mut rest = arena;
        let mut slice = |len| {
            let (slice, others) = std::mem::take(&mut rest).split_at_mut(len);
            rest = others;
            slice
        };
        let (base_sin, base_cos, base_step) = (slice(teeth), slice(teeth), slice(teeth));
        let row_torque = PerContact::of(|_| slice(rows));
        let (row_input_angle_deg, row_residual) = (slice(rows), slice(rows));
        let (row_rotation_rad, row_rotation_root) = (slice(rows), slice(rows));
        let row_stiffness = slice(rows);
        let work = if with_work { Work::new(&mut slice, len, rows) } else { Work::new(&mut slice, 0, 0) };
        let gaps = if with_gaps { GapWork::new(&mut slice, len, teeth) } else { GapWork::new(&mut slice, 0, 0) };
        let of_columns = if with_columns { len } else { 0 };
        let (from_valley_rad, position_deg) = (slice(of_columns), slice(of_columns));
        let input_angle_deg = slice(of_columns);
        let (wave_generator_angle_deg, ring_angle_deg) = (slice(of_columns), slice(of_columns));
        let mut column = || slice(len);
        let (pattern_sin, pattern_cos) = (column(), column());
        pattern_sin.fill(FRAC_1_SQRT_2);
        pattern_cos.fill(FRAC_1_SQRT_2);
        Self {
            count: 0,
            teeth,
            passed: 0.0,
            steps: 0.0,
            row_sines: SineTable::equally_spaced(step_rad, rows),
            tooth: Vec::with_capacity(len),
            base_sin,
            base_cos,
            base_step,
            last_place: 0,
            pattern_sin,
            pattern_cos,
            pattern_step: column(),
            sin: column(),
            cos: column(),
            from_valley_rad,
            input_angle_deg,
            position_deg,
            center_radius_mm: column(),
            wave_generator_angle_deg,
            ring_angle_deg,
            force: PerContact::of(|_| column()),
            stress: PerContact::of(|_| column()),
            torque: PerContact::of(|_| column()),
            scale: column(),
            scale_root: column(),
            stress_exponents,
            work,
            gaps,
            row_torque,
            row_input_angle_deg,
            row_rotation_rad,
            row_rotation_root,
            row_stiffness,
            row_loaded: Vec::with_capacity(rows),
            row_residual,
        }
    }

    /// Returns the number of input angles.
    #[inline(always)]
    pub(super) const fn rows(&self) -> usize {
        self.count / self.teeth
    }

    /// Returns the number of states, including those that fill the last chunk.
    #[inline(always)]
    pub(super) const fn len(&self) -> usize {
        self.count.next_multiple_of(LANES)
    }

    /// Returns the states of an input angle.
    #[inline(always)]
    pub(super) const fn of_row(&self, row: usize) -> Range<usize> {
        row * self.teeth..(row + 1) * self.teeth
    }

    #[inline(always)]
    pub(super) fn lanes(&mut self, chunk: usize) -> TileLanes<'_> {
        #[inline(always)]
        fn at<'t>(columns: &'t mut PerContact<&mut [f64]>, chunk: usize) -> PerContact<&'t mut [f64; LANES]> {
            let PerContact { wave_generator, ring, carrier } = columns;
            PerContact {
                wave_generator: &mut wave_generator.as_chunks_mut().0[chunk],
                ring: &mut ring.as_chunks_mut().0[chunk],
                carrier: &mut carrier.as_chunks_mut().0[chunk],
            }
        }
        TileLanes {
            sin: &self.sin.as_chunks().0[chunk],
            cos: &self.cos.as_chunks().0[chunk],
            force: at(&mut self.force, chunk),
            stress: at(&mut self.stress, chunk),
            torque: at(&mut self.torque, chunk),
        }
    }

    /// Returns the factor from unit stresses to stresses.
    #[inline(always)]
    pub(super) const fn stress_scale(&self, contact: Contact) -> &[f64] {
        if self.stress_exponents.is_one_at(contact) { self.scale } else { self.scale_root }
    }

    pub(super) fn position_deg_of(&self, state: usize) -> f64 {
        360.0 * (self.pattern_step[state] - self.passed) / self.steps
    }

    /// Sums the torques, of unit loads or loads, over the teeth at each input angle. Returns the number of input
    /// angles.
    #[inline(always)]
    pub(super) fn sum_torques<const OF_UNIT_LOADS: bool>(&mut self) -> usize {
        let (rows, teeth) = (self.rows(), self.teeth);
        for row in 0..rows {
            let at = self.of_row(row);
            let (cam, ring) = (&self.torque.wave_generator[at.clone()], &self.torque.ring[at.clone()]);
            let (carrier, scale) = (&self.torque.carrier[at.clone()], &self.scale[at]);
            let (mut of_cam, mut of_ring, mut of_carrier) = (0.0, 0.0, 0.0);
            for i in 0..teeth {
                let scale = if OF_UNIT_LOADS { 1.0 } else { scale[i] };
                of_cam += cam[i] * scale;
                of_ring += ring[i] * scale;
                of_carrier += carrier[i] * scale;
            }
            self.row_torque.wave_generator[row] = of_cam;
            self.row_torque.ring[row] = of_ring;
            self.row_torque.carrier[row] = of_carrier;
        }
        rows
    }
}
