//! Evaluation of arbitrary moments of a lap in columns, for the search for extremes.

use std::f64::consts::FRAC_1_SQRT_2;

use pulp::Simd;

use super::Kernel;
use super::laps::{LapTeeth, Layout, whole};
use super::sharing::Sharing;
use super::sinks::PeakSink;
use super::tile::{Tile, TileSize};
use crate::contact::Contact;
use crate::mesh::Mesh;
use crate::sweep::columns::Totals;
use crate::sweep::search::{LOADS, Piece, SearchedDrive, Seen};
use crate::{SolveError, Stop};

/// Evaluates moments with the kernel.
pub(super) struct FastLook<'a> {
    kernel: &'a Kernel<'a>,
    stop: &'a dyn Stop,
    /// Mesh of the sweep.
    mesh: Mesh,
    layout: Layout,
    lap_teeth: LapTeeth,
    rows: usize,
    tile: Tile<'a>,
    /// Base positions of the teeth, for each piece of a lap that was evaluated.
    bases: Vec<Bases>,
    pub(super) totals: Totals,
}

/// Base positions of the teeth of a piece: at its end for those near a lobe, at its start for all others, so that
/// nothing cancels near an axis.
struct Bases {
    piece: Piece,
    is_near_lobe: Vec<bool>,
    last_place: usize,
    sin: Vec<f64>,
    cos: Vec<f64>,
    /// ψ at the start of the lap, in units of the distance between places.
    place: Vec<f64>,
    /// Distance between places, and change of the phase in a lap.
    spacing_rad: f64,
    phase_rad: f64,
}

impl Bases {
    fn new(mesh: &Mesh, layout: Layout, piece: Piece) -> Self {
        let places = whole(piece.places);
        let teeth = layout.at_each_place * places;
        let (mut sin, mut cos) = (vec![0.0; teeth], vec![0.0; teeth]);
        let (mut place_of, mut is_near_lobe) = (vec![0.0; teeth], vec![false; teeth]);
        for place in 1..=piece.places {
            let at_start = piece.position(mesh, place, piece.start);
            let is_near = at_start.phase_sin < at_start.phase_cos;
            let base = if is_near { piece.position(mesh, place, piece.end) } else { at_start };
            for at in (layout.index(whole(place), places)..teeth).step_by(places) {
                (sin[at], cos[at]) = (base.phase_sin, base.phase_cos);
                (place_of[at], is_near_lobe[at]) = (place as f64, is_near);
            }
        }
        let spacing_rad = mesh.spacing_deg().to_radians();
        let phase_rad = 0.5 * f64::from(mesh.lobe_count()) * spacing_rad;
        let last_place = layout.index(places, places);
        Self { piece, is_near_lobe, last_place, sin, cos, place: place_of, spacing_rad, phase_rad }
    }

    /// Computes the positions of all teeth at some moments, by moment and then tooth.
    #[inline(always)]
    fn place(&self, fractions: &[f64], tile: &mut Tile<'_>) {
        let teeth = self.sin.len();
        (tile.teeth, tile.count) = (teeth, fractions.len() * teeth);
        tile.last_place = self.last_place;
        for (row, fraction) in fractions.iter().enumerate() {
            let (back_sin, back_cos) = ((self.piece.end - fraction) * self.phase_rad).sin_cos();
            let (on_sin, on_cos) = ((fraction - self.piece.start) * self.phase_rad).sin_cos();
            let at = tile.of_row(row);
            let (sin, cos) = (&mut tile.sin[at.clone()], &mut tile.cos[at.clone()]);
            for i in 0..teeth {
                let (turn_sin, turn_cos) = if self.is_near_lobe[i] { (back_sin, back_cos) } else { (-on_sin, on_cos) };
                // Rounding beyond an axis is set to the axis.
                sin[i] = (self.sin[i] * turn_cos + self.cos[i] * turn_sin).max(0.0);
                cos[i] = (self.cos[i] * turn_cos - self.sin[i] * turn_sin).max(0.0);
            }
            if !tile.gaps.from_lobe_rad.is_empty() {
                for (from_lobe_rad, place) in tile.gaps.from_lobe_rad[at].iter_mut().zip(&self.place) {
                    *from_lobe_rad = (place - fraction) * self.spacing_rad;
                }
            }
        }
        let rest = tile.count..tile.len();
        tile.sin[rest.clone()].fill(FRAC_1_SQRT_2);
        tile.cos[rest].fill(FRAC_1_SQRT_2);
    }
}

impl<'a> FastLook<'a> {
    /// Builds the evaluation of a mesh, in an empty arena. The kernel's drive is loaded over one zone.
    pub(super) fn new(kernel: &'a Kernel<'a>, mesh: Mesh, arena: &'a mut Vec<f64>, stop: &'a dyn Stop) -> Self {
        let (layout, places) = (kernel.layout(&mesh), mesh.teeth_in_mesh().max / mesh.listed_at_each_place());
        let size = TileSize::anywhere(kernel, layout.at_each_place * whole(places));
        arena.resize(size.doubles(), 0.0);
        Self {
            kernel,
            stop,
            mesh,
            layout,
            lap_teeth: LapTeeth::default(),
            rows: size.rows,
            tile: Tile::new(arena, &size, 0.0, kernel.pressures.stress_exponents()),
            bases: Vec::new(),
            totals: Totals::new(kernel.loaded),
        }
    }

    /// Returns what the search needs to know.
    pub(super) fn searched(&self) -> SearchedDrive<'a> {
        let kernel = self.kernel;
        SearchedDrive {
            loaded: kernel.loaded,
            has_gaps: kernel.gaps.is_some(),
            is_linear: kernel.sharing.as_ref().is_none_or(|sharing| matches!(sharing, Sharing::Linear(_))),
            is_in_proportion: kernel.is_in_proportion(),
            teeth_at_each_place: self.layout.at_each_place as u64,
        }
    }

    /// Appends moments of a piece. Returns false if the plain path is needed.
    pub(super) fn look(&mut self, fractions: &[f64], seen: &mut Seen) -> Result<bool, SolveError> {
        // Positions repeat in every lap.
        let piece = Piece { lap: 0, ..seen.piece };
        let bases = self.bases.iter().position(|bases| bases.piece == piece).unwrap_or_else(|| {
            self.bases.push(Bases::new(&self.mesh, self.layout, piece));
            self.bases.len() - 1
        });
        if self.kernel.tells_items_apart() {
            self.lap_teeth.list(&self.mesh, self.layout, whole(seen.piece.places), seen.piece.lap);
        }
        for fractions in fractions.chunks(self.rows) {
            if self.stop.stopped() {
                return Err(SolveError::Stopped);
            }
            if !pulp::Arch::new().dispatch(Looking { look: self, bases, fractions, seen }) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Evaluation of a tile of moments in the form that `pulp` needs, as [`super::Vectorised`]. Returns false if the plain path
/// is needed.
struct Looking<'l, 'a> {
    look: &'l mut FastLook<'a>,
    bases: usize,
    fractions: &'l [f64],
    seen: &'l mut Seen,
}

impl pulp::WithSimd for Looking<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<V: Simd>(self, _: V) -> bool {
        let Self { look, bases, fractions, seen } = self;
        let (kernel, loaded, tile) = (look.kernel, look.kernel.loaded, &mut look.tile);
        look.bases[bases].place(fractions, tile);
        let teeth = seen.teeth;
        if !kernel.unit_loads::<V, PeakSink<'_>>(tile) || !kernel.loads::<V>(&look.mesh, &look.lap_teeth, tile) {
            return false;
        }
        if kernel.gaps.is_some() {
            (0..fractions.len()).for_each(|row| seen.pressed.extend(tile.work.pressed_rad(row, teeth)));
        }
        let Some(limit) = kernel.limit::<V>(tile) else { return false };
        look.totals.add_torques(loaded, tile, limit.as_ref(), |row| fractions[row] * look.mesh.sweep_period_deg());
        look.totals.add_rows(loaded.drive(), tile);
        for (row, &fraction) in fractions.iter().enumerate() {
            let at = tile.of_row(row);
            let (rotation_rad, stiffness) = (tile.row_rotation_rad[row], tile.row_stiffness[row]);
            let values = seen.push(fraction);
            let scale = &tile.scale[at.clone()];
            for (index, contact) in Contact::all().into_iter().enumerate() {
                let (force, stress) = (&tile.force.get(contact)[at.clone()], &tile.stress.get(contact)[at.clone()]);
                let forces = &mut values[index * teeth..(index + 1) * teeth];
                for i in 0..teeth {
                    forces[i] = force[i] * scale[i];
                }
                let root = &tile.stress_scale(contact)[at.clone()];
                let stresses = &mut values[(index + 3) * teeth..(index + 4) * teeth];
                for i in 0..teeth {
                    stresses[i] = stress[i] * root[i];
                }
            }
            let per_capacity = if limit.is_some() { 1.0 / (loaded.zones * tile.work.row_limit[row]) } else { 0.0 };
            let totals = [rotation_rad, 1.0 / rotation_rad, stiffness, 1.0 / stiffness, per_capacity];
            values[LOADS * teeth..].copy_from_slice(&totals);
        }
        true
    }
}
