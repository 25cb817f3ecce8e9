//! The input angles of a sweep to a tolerance: wherever the search for its extremes looked, and so near to each other that straight lines between them are true
//! to a resolution.

use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::mesh::{Mesh, PlacedTooth};
use crate::position::Position;
use crate::sweep::fast;
use crate::sweep::plain_look::PlainLook;
use crate::sweep::points::Tolerance;
use crate::sweep::search::{AtPlace, Piece, Seen, search};
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
    pub(crate) fn of(piece: &Piece, fraction: f64) -> Self {
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
            search(&mut look, pieces(), tolerance, Some(resolution), stop)?.unwrap_or_default()
        }
    };
    let mut by_lap = vec![Vec::new(); usize::try_from(laps).unwrap_or(usize::MAX)];
    // A wave generator that moves presses a tooth before it is lifted, as it is behind the valley then.
    let loads_jump = mesh.loads_jump_at_entry() || load.parameters().wave_generator_moves;
    let without_load = if tolerance.looks_without_load() && loaded.has_gaps() {
        unloaded::extremes(PlainLook::new(loaded, load, stop), pieces(), tolerance, stop)?
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
