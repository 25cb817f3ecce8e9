//! Input angles of a sweep to a tolerance: those at which the search for extremes evaluated the drive, plus enough
//! others that linear interpolation between them meets a resolution.

use crate::load_sharing::LoadedDrive;
use crate::mesh::{Mesh, PlacedTooth};
use crate::position::Position;
use crate::sweep::fast;
use crate::sweep::plain_look::PlainLook;
use crate::sweep::points::Tolerance;
use crate::sweep::search::{AtPlace, Piece, Seen, search};
use crate::sweep::unloaded;
use crate::{SolveError, Stop};

/// Largest error of linear interpolation between the input angles, over each column's peak: a plot that looks smooth.
const COARSEST_RESOLUTION: f64 = 1e-2;

/// The finest resolution. Below it extremes are searched for one by one.
const FINEST_RESOLUTION: f64 = 1e-3;

/// Evaluation method of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Looking {
    /// In columns, if the fast path supports the drive.
    Fast,
    /// Tooth by tooth.
    Plain,
}

/// An input angle, and the teeth in mesh there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Elapsed share of the lap.
    pub(crate) fraction: f64,
    first: u64,
    last: u64,
    /// The tooth that is exactly at the end of the flank, or exactly enters.
    exact: Option<AtPlace>,
}

impl Moment {
    /// Returns the listed teeth after this many elapsed laps.
    pub(crate) fn placed(self, mesh: &Mesh, lap: u64) -> impl Iterator<Item = PlacedTooth> {
        let mesh = *mesh;
        mesh.placed_between(self.first..=self.last, lap, move |place| self.position(&mesh, place))
    }

    /// Returns the number of places where teeth mesh.
    pub(crate) const fn places(&self) -> u64 {
        self.last + 1 - self.first
    }

    fn position(&self, mesh: &Mesh, place: u64) -> Position {
        self.exact
            .filter(|at| at.place == place)
            .map_or_else(|| mesh.position_between(place, self.fraction), |at| at.position)
    }

    /// Returns the moment of a piece. A tooth that has reached the lobe is no longer in mesh.
    pub(crate) fn of(piece: &Piece, fraction: f64) -> Self {
        let exact = piece.exactly_at(fraction).next();
        Self { fraction, first: if fraction < 1.0 { 1 } else { 2 }, last: piece.places, exact }
    }
}

/// Returns the input angles of a sweep to a tolerance, in order, by lap. If items are alike, one lap represents all. At
/// a jump of the loads the same angle is listed twice: first without the tooth that enters, then with it.
pub(crate) fn moments(
    loaded: &LoadedDrive<'_>,
    tolerance: Tolerance,
    looking: Looking,
    stop: &dyn Stop,
) -> Result<Vec<Vec<Moment>>, SolveError> {
    let mesh = *loaded.mesh();
    let laps = if mesh.tells_items_apart() { mesh.laps() } else { 1 };
    let resolution = tolerance.relative().clamp(FINEST_RESOLUTION, COARSEST_RESOLUTION);
    let pieces = || (0..laps).flat_map(|lap| Piece::of(loaded, lap));
    let in_columns = match looking {
        Looking::Fast => fast::moments(loaded, pieces(), tolerance, resolution, stop)?,
        Looking::Plain => None,
    };
    let found = match in_columns {
        Some(found) => found,
        None => {
            let plain = PlainLook::new(loaded, stop);
            // The plain path covers every moment.
            let look = |fractions: &[f64], seen: &mut Seen| plain.look(fractions, seen).map(|()| true);
            search(&plain.searched(), pieces(), tolerance, Some(resolution), stop, look)?.unwrap_or_default()
        }
    };
    let mut by_lap = vec![Vec::new(); usize::try_from(laps).unwrap_or(usize::MAX)];
    // If lever arms vary, a tooth is pressed before it is lifted, because it is then behind the valley.
    let loads_jump = mesh.loads_jump_at_entry() || loaded.load.wave_generator_moves;
    let without_load = if tolerance.looks_without_load && loaded.has_gaps() {
        unloaded::extremes(&PlainLook::new(loaded, stop), pieces(), tolerance, stop)?
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
            // A lap ends as it begins, with a tooth at the end of the flank. At a regular tip that tooth carries
            // nothing.
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
