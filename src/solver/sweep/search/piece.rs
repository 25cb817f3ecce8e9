//! Pieces of a lap, in which every load is a smooth curve.

use crate::load_sharing::LoadedDrive;
use crate::mesh::Mesh;
use crate::position::Position;
use crate::ring::TipCorner;

/// Part of a lap in which no tooth enters. Teeth are at the places from 1 on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Number of laps before; 0 if all laps are alike.
    pub(crate) lap: u64,
    /// Elapsed shares of the lap.
    pub(crate) start: f64,
    pub(crate) end: f64,
    /// Number of places where teeth are listed.
    pub(crate) places: u64,
    /// The tooth at the end of the flank, or entering, at the start.
    pub(crate) at_start: Option<AtPlace>,
    /// The tooth just before the flank at the end.
    pub(crate) at_end: Option<AtPlace>,
}

/// Exact position of the tooth at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AtPlace {
    pub(crate) place: u64,
    pub(crate) position: Position,
}

impl Piece {
    /// Returns the pieces of a lap.
    pub(crate) fn of(loaded: &LoadedDrive<'_>, lap: u64) -> impl Iterator<Item = Self> + use<> {
        let mesh = *loaded.mesh();
        let relieved_fraction =
            loaded.gaps.modification.ring_tip_relief.map(|relief| mesh.fraction_at_deg(relief.start_deg));
        let (places, entry) = (mesh.whole_spacings(), mesh.entry_fraction());
        let is_whole = mesh.spacings_are_whole();
        let entering = |place| Some(AtPlace { place, position: mesh.last_position() });
        let at_start = if is_whole { entering(places) } else { None };
        let first = Self { lap, start: 0.0, end: if is_whole { 1.0 } else { entry }, places, at_start, at_end: None };
        let rest =
            Self { lap, start: entry, end: 1.0, places: places + 1, at_start: entering(places + 1), at_end: None };
        let pieces = std::iter::once(first).chain((!is_whole).then_some(rest));
        let pieces = pieces.flat_map(move |piece| piece.cut_where_a_tooth_comes_to_the_flank(&mesh));
        // Where a tooth reaches the tip relief, its gap has a kink for power 1, otherwise it grows smoothly.
        pieces.flat_map(move |piece| piece.cut_at(relieved_fraction, [None, None]))
    }

    /// Cuts the piece where a tooth reaches the flank: loads have a kink there, and the ring's stress begins.
    fn cut_where_a_tooth_comes_to_the_flank(self, mesh: &Mesh) -> impl Iterator<Item = Self> + use<> {
        let (place, fraction) = mesh.flank_fraction();
        let limit = *mesh.flank_limit();
        let on_flank = Some(AtPlace { place, position: limit.position });
        let before = Some(AtPlace { place, position: TipCorner::last_before_flank(&limit) });
        self.cut_at(mesh.lists_teeth_before_flank().then_some(fraction), [before, on_flank])
    }

    /// Returns the pieces before and after a fraction within, with the exactly known tooth at the cut.
    fn cut_at(
        self,
        fraction: Option<f64>,
        [at_end, at_start]: [Option<AtPlace>; 2],
    ) -> impl Iterator<Item = Self> + use<> {
        let cut = fraction.filter(|&fraction| fraction > self.start && fraction < self.end);
        let before = cut.map_or(self, |end| Self { end, at_end, ..self });
        std::iter::once(before).chain(cut.map(|start| Self { start, at_start, ..self }))
    }

    pub(crate) fn position(&self, mesh: &Mesh, place: u64, fraction: f64) -> Position {
        self.exactly_at(fraction)
            .find(|at| at.place == place)
            .map_or_else(|| mesh.position_between(place, fraction), |at| at.position)
    }

    /// Returns the teeth with exactly known positions.
    pub(crate) fn exactly_at(&self, fraction: f64) -> impl Iterator<Item = AtPlace> + use<> {
        let at_start = self.at_start.filter(|_| fraction <= self.start);
        at_start.into_iter().chain(self.at_end.filter(|_| fraction >= self.end))
    }
}
