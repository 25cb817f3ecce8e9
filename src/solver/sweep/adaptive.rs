//! The input angles of a sweep to a tolerance: wherever the search for its extremes looked, and so near to each other that straight lines between them are true
//! to a resolution.

use crate::contact::PerContact;
use crate::load_sharing::{LoadCase, LoadedDrive, ToothState};
use crate::mesh::{Mesh, PlacedTooth};
use crate::position::Position;
use crate::sweep::fast;
use crate::sweep::points::Tolerance;
use crate::sweep::search::{AtPlace, LOADS, Look, Piece, Seen, search};
use crate::sweep::unloaded;
use crate::{SolveError, Stop};

/// How true straight lines between the input angles are at least, over each column's peak: a plot that looks smooth.
const COARSEST_RESOLUTION: f64 = 1e-2;

/// The finest resolution; beyond it extremes are looked for one by one.
const FINEST_RESOLUTION: f64 = 1e-3;

/// How the search looks at moments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Looking {
    /// In columns, where that reaches.
    Fast,
    /// Tooth by tooth.
    Plain,
}

/// An input angle, and which teeth mesh there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Share of the lap that has passed.
    pub(crate) fraction: f64,
    first: u64,
    last: u64,
    /// The tooth that stands exactly where the flank ends, or where it enters.
    exact: Option<AtPlace>,
}

impl Moment {
    /// The teeth that are listed when so many laps have passed before.
    pub(crate) fn placed(self, mesh: &Mesh, lap: u64) -> impl Iterator<Item = PlacedTooth> {
        let mesh = *mesh;
        mesh.placed_between(self.first..=self.last, lap, move |place| self.position(&mesh, place))
    }

    /// Places where teeth mesh.
    pub(crate) const fn places(&self) -> u64 {
        self.last + 1 - self.first
    }

    fn position(&self, mesh: &Mesh, place: u64) -> Position {
        self.exact
            .filter(|at| at.place == place)
            .map_or_else(|| mesh.position_between(place, self.fraction), |at| at.position)
    }

    /// Of a piece. A tooth that has reached the lobe has left.
    fn of(piece: &Piece, fraction: f64) -> Self {
        let exact = piece.exactly_at(fraction).next();
        Self { fraction, first: if fraction < 1.0 { 1 } else { 2 }, last: piece.places, exact }
    }
}

/// The input angles of a sweep to a tolerance, in order, by lap: one that stands for all where items are alike. Where loads jump the same
/// angle stands twice, first without the tooth that enters and then with it.
///
/// # Errors
/// As [`search()`].
pub(crate) fn moments(
    loaded: &LoadedDrive<'_>,
    load: &LoadCase,
    tolerance: Tolerance,
    looking: Looking,
    stop: &dyn Stop,
) -> Result<Vec<Vec<Moment>>, SolveError> {
    let mesh = *loaded.mesh();
    let laps = if mesh.tells_items_apart() { mesh.laps() } else { 1 };
    let resolution = tolerance.relative().clamp(FINEST_RESOLUTION, COARSEST_RESOLUTION);
    let allowable_mpa = load.parameters().allowable_stress_mpa;
    let pieces = || (0..laps).flat_map(|lap| Piece::of(loaded, lap));
    let in_columns = match looking {
        Looking::Fast => fast::moments(loaded, pieces(), tolerance, resolution, allowable_mpa, stop)?,
        Looking::Plain => None,
    };
    let found = match in_columns {
        Some(found) => found,
        None => {
            let mut look = PlainLook::new(loaded, load, stop);
            // This way tells of every moment.
            search(&mut look, pieces(), tolerance, Some(resolution))?.unwrap_or_default()
        }
    };
    let mut by_lap = vec![Vec::new(); usize::try_from(laps).unwrap_or(usize::MAX)];
    // A wave generator that moves presses a tooth before it is lifted, as it is behind the valley then.
    let loads_jump = mesh.loads_jump_at_entry() || load.parameters().wave_generator_moves;
    let without_load = if tolerance.looks_without_load() && loaded.has_gaps() {
        unloaded::extremes(PlainLook::new(loaded, load, stop), pieces(), tolerance)?
    } else {
        Vec::new()
    };
    for (moments, lap) in by_lap.iter_mut().zip(0..) {
        for Seen { piece, fractions, .. } in found.seen.iter().filter(|seen| seen.piece.lap == lap) {
            moments.extend(fractions.iter().map(|&fraction| Moment::of(piece, fraction)));
        }
        let extremes = without_load.iter().filter(|(piece, _)| piece.lap == lap);
        moments.extend(extremes.map(|(piece, fraction)| Moment::of(piece, *fraction)));
        if mesh.spacings_are_whole() {
            // As a lap begins with a tooth at the end of the flank, so it ends: at a regular tip, where it carries nothing, at the same instant.
            let last = mesh.whole_spacings() + 1;
            if !loads_jump {
                moments.retain(|moment| moment.fraction < 1.0);
            }
            let exact = Some(AtPlace { place: last, position: mesh.last_position() });
            moments.push(Moment { fraction: 1.0, first: 2, last, exact });
        }
        moments.sort_by(|one, other| one.fraction.total_cmp(&other.fraction).then(one.last.cmp(&other.last)));
        moments.dedup();
    }
    Ok(by_lap)
}

/// Moments tooth by tooth.
pub(crate) struct PlainLook<'a> {
    /// With one tooth at each place of the mesh, which stands for all that carry alike; where items deviate, with every tooth.
    loaded: LoadedDrive<'a>,
    mesh: Mesh,
    allowable_stress_mpa: Option<PerContact<f64>>,
    has_gaps: bool,
    is_linear: bool,
    stop: &'a dyn Stop,
}

impl<'a> PlainLook<'a> {
    fn new(loaded: &LoadedDrive<'a>, load: &LoadCase, stop: &'a dyn Stop) -> Self {
        let mesh = *loaded.mesh();
        let tells_items_apart = mesh.tells_items_apart();
        Self {
            loaded: if tells_items_apart { *loaded } else { loaded.with_zones(mesh.teeth_at_each_place()) },
            mesh,
            allowable_stress_mpa: load.parameters().allowable_stress_mpa,
            has_gaps: loaded.has_gaps() || tells_items_apart,
            is_linear: loaded.is_linear(),
            stop,
        }
    }

    /// The drive, and how many teeth each that is looked at stands for.
    pub(crate) const fn loaded(&self) -> &LoadedDrive<'a> {
        &self.loaded
    }

    /// The teeth of a piece, place by place.
    ///
    /// # Errors
    /// Those of a tooth, with the input angle.
    pub(crate) fn teeth(&self, piece: &Piece, fraction: f64) -> Result<Vec<ToothState>, SolveError> {
        if self.stop.stopped() {
            return Err(SolveError::Stopped);
        }
        let lap_deg = self.mesh.sweep_period_deg() / self.mesh.laps() as f64;
        let input_angle_deg = (piece.lap as f64 + fraction) * lap_deg;
        self.teeth_by_place(piece, fraction).map_err(|error| error.at_input_angle(input_angle_deg))
    }

    fn teeth_by_place(&self, piece: &Piece, fraction: f64) -> Result<Vec<ToothState>, SolveError> {
        let mesh = &self.mesh;
        if !mesh.tells_items_apart() {
            let places = 1..=piece.places;
            return places.map(|place| self.loaded.tooth(piece.position(mesh, place, fraction))).collect();
        }
        let position = |place| piece.position(mesh, place, fraction);
        let mut placed: Vec<_> = mesh.placed_between(1..=piece.places, piece.lap, position).collect();
        // Those at one place stay in the order of their slots.
        placed.sort_by(|one, other| one.position.from_lobe_rad.total_cmp(&other.position.from_lobe_rad));
        placed.iter().map(|tooth| self.loaded.tooth_at(&tooth.place, tooth.position)).collect()
    }
}

impl Look for PlainLook<'_> {
    fn has_gaps(&self) -> bool {
        self.has_gaps
    }

    fn is_linear(&self) -> bool {
        self.is_linear
    }

    fn is_in_proportion(&self) -> bool {
        self.is_linear
    }

    fn input_torque_nmm(&self) -> f64 {
        self.loaded.input_torque_nmm()
    }

    fn teeth_at_each_place(&self) -> u64 {
        if self.mesh.tells_items_apart() { self.mesh.listed_at_each_place() } else { 1 }
    }

    fn look(&mut self, fractions: &[f64], seen: &mut Seen) -> Result<bool, SolveError> {
        let piece = seen.piece;
        for &fraction in fractions {
            let teeth = self.teeth(&piece, fraction)?;
            let wind_up = self.loaded.wind_up(&teeth)?;
            if self.has_gaps {
                let rotation = wind_up.rotation;
                let closings_rad = teeth.iter().map(|tooth| tooth.spring.closing_rad);
                seen.push_pressed(
                    closings_rad.map(|closing_rad| rotation.excess_rad + (rotation.closing_rad - closing_rad)),
                );
            }
            let per_capacity = match &self.allowable_stress_mpa {
                Some(allowable_mpa) => 1.0 / self.loaded.torque_limit(&teeth, allowable_mpa)?.input_torque_nmm,
                None => 0.0,
            };
            let (rotation_rad, stiffness) = (wind_up.rotation_rad(), wind_up.stiffness_nmm_per_rad);
            let count = seen.teeth;
            let values = seen.push(fraction);
            for (index, tooth) in teeth.iter().enumerate() {
                for (quantity, load) in self.loaded.loads(tooth, &wind_up)?.into_iter().enumerate() {
                    values[quantity * count + index] = load;
                }
            }
            let totals = [rotation_rad, 1.0 / rotation_rad, stiffness, 1.0 / stiffness, per_capacity];
            values[LOADS * count..].copy_from_slice(&totals);
        }
        Ok(true)
    }
}
