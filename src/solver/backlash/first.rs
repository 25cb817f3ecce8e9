//! First tooth of one side to close its gaps.

use super::{Flanks, INTERVALS, Lever, Piece, Side, Tooth, sum};
use crate::SolveError;
use crate::contact::PerContact;
use crate::position::half_lobe_rad;
use crate::root::{NotConverged, bracketed};

/// Shortest stretch that is cut, as a fraction of a lap. Shorter ones are rounding.
const SHORTEST: f64 = 1e-12;

/// Relative lead of one tooth over another that counts as rounding.
const ROUNDING: f64 = 1e-12;

/// Gap, in mm, below which a value is rounding.
const NEGLIGIBLE_MM: f64 = 1e-12;

/// Distance from a lobe or a valley at which a tooth counts as on it, as a fraction of half a lobe.
const BESIDE: f64 = 1e-6;

/// Stretch between two fractions of a lap, with its first tooth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) start: f64,
    pub(super) end: f64,
    pub(super) tooth: usize,
}

/// Fraction of a lap, with the first tooth there.
#[derive(Debug, Clone, Copy)]
struct Moment {
    fraction: f64,
    tooth: usize,
}

/// Teeth of one side during a piece of a lap.
pub(super) struct FirstTeeth<'a> {
    flanks: &'a Flanks<'a>,
    side: Side,
    nodes: &'a [f64],
    levers: &'a [Vec<Lever>],
    teeth: Vec<Tooth>,
    /// Closing angles, by node and tooth.
    closing_rad: Vec<Vec<f64>>,
    first: Vec<usize>,
}

impl<'a> FirstTeeth<'a> {
    /// Evaluates the teeth at all nodes. `nodes` are those of the current lap; `piece` is the piece of this side.
    pub(super) fn new(flanks: &'a Flanks<'a>, side: Side, lap: u64, nodes: &'a [f64], piece: &'a Piece) -> Self {
        let levers = &piece.levers;
        let places = levers.first().map_or(0, Vec::len) as u64;
        let mut found = Self {
            flanks,
            side,
            nodes,
            levers,
            teeth: flanks.teeth(side.lap(lap, flanks.laps), places),
            closing_rad: Vec::with_capacity(nodes.len()),
            first: Vec::with_capacity(nodes.len()),
        };
        for node in 0..nodes.len() {
            let closing_rad = found.teeth.iter().map(|tooth| sum(&found.closing_at_node(tooth, node)));
            let closing_rad: Vec<_> = closing_rad.collect();
            found.first.push(least(&closing_rad));
            found.closing_rad.push(closing_rad);
        }
        found
    }

    fn lever(&self, tooth: &Tooth, node: usize) -> &'a Lever {
        let row = &self.levers[self.side.index(node, self.nodes.len())];
        #[expect(clippy::cast_possible_truncation, reason = "a place among the levers")]
        let at = tooth.spacings as usize - 1;
        &row[at]
    }

    fn closing_at_node(&self, tooth: &Tooth, node: usize) -> PerContact<f64> {
        self.flanks.closing_rad(self.side, tooth, self.lever(tooth, node))
    }

    /// Returns the carrier rotation that closes the gaps of a tooth, per contact.
    pub(super) fn closing(&self, tooth: usize, fraction: f64) -> Result<PerContact<f64>, NotConverged> {
        let tooth = &self.teeth[tooth];
        if let Ok(node) = self.nodes.binary_search_by(|node| node.total_cmp(&fraction)) {
            return Ok(self.closing_at_node(tooth, node));
        }
        let lever = self.flanks.lever(tooth.spacings, self.side.fraction(fraction))?;
        Ok(self.flanks.closing_rad(self.side, tooth, &lever))
    }

    /// Returns the stretches of the cell that starts at a node.
    pub(super) fn stretches(&self, cell: usize) -> Result<Vec<Stretch>, NotConverged> {
        let [start, middle, end] =
            [cell, cell + 1, cell + 2].map(|node| Moment { fraction: self.nodes[node], tooth: self.first[node] });
        let mut stretches = Vec::with_capacity(2);
        let seen = if start.tooth == middle.tooth && middle.tooth == end.tooth {
            self.dip(cell).map(|fraction| self.first_at(fraction)).transpose()?
        } else {
            Some(middle)
        };
        match seen {
            Some(seen) => {
                self.cut(start, seen, &mut stretches)?;
                self.cut(seen, end, &mut stretches)?;
            }
            None => stretches.push(Stretch { start: start.fraction, end: end.fraction, tooth: start.tooth }),
        }
        Ok(stretches)
    }

    /// Returns the fraction at which another tooth is probably first, for a cell whose nodes share one first tooth. A
    /// parabola through the nodes estimates it.
    fn dip(&self, cell: usize) -> Option<f64> {
        let first = self.first[cell];
        let mut lowest: Option<(f64, f64)> = None;
        for tooth in 0..self.teeth.len() {
            let lag_rad = |node: usize| self.closing_rad[node][tooth] - self.closing_rad[node][first];
            let lags_rad = [cell, cell + 1, cell + 2].map(lag_rad);
            if let Some((place, value)) = vertex(lags_rad)
                && value < 0.0
                && lowest.is_none_or(|(_, lowest)| value < lowest)
            {
                let half = 0.5 * (self.nodes[cell + 2] - self.nodes[cell]);
                lowest = Some((self.nodes[cell + 1] + place * half, value));
            }
        }
        lowest.map(|(fraction, _)| fraction)
    }

    fn first_at(&self, fraction: f64) -> Result<Moment, NotConverged> {
        let closing_rad = (0..self.teeth.len()).map(|tooth| self.closing(tooth, fraction).map(|parts| sum(&parts)));
        Ok(Moment { fraction, tooth: least(&closing_rad.collect::<Result<Vec<_>, _>>()?) })
    }

    /// Splits a stretch at each change of the first tooth.
    fn cut(&self, from: Moment, to: Moment, stretches: &mut Vec<Stretch>) -> Result<(), NotConverged> {
        let mut push = |start: f64, end: f64, tooth| stretches.push(Stretch { start, end, tooth });
        if from.tooth == to.tooth || to.fraction - from.fraction < SHORTEST {
            push(from.fraction, to.fraction, from.tooth);
            return Ok(());
        }
        let closing_rad = |tooth: usize, fraction: f64| self.closing(tooth, fraction).map(|parts| sum(&parts));
        let lead_rad = |fraction: f64| -> Result<f64, NotConverged> {
            Ok(closing_rad(from.tooth, fraction)? - closing_rad(to.tooth, fraction)?)
        };
        let (at_start_rad, at_end_rad) = (lead_rad(from.fraction)?, lead_rad(to.fraction)?);
        if at_start_rad >= 0.0 || at_end_rad <= 0.0 {
            // The two teeth are equal up to the end, or from the start on.
            let tooth = if at_start_rad >= 0.0 { to.tooth } else { from.tooth };
            push(from.fraction, to.fraction, tooth);
            return Ok(());
        }
        let at = bracketed("change of the first tooth", from.fraction, at_start_rad, to.fraction, lead_rad)?;
        let seen = self.first_at(at)?;
        let [known_rad, seen_rad] = [closing_rad(from.tooth, at)?, closing_rad(seen.tooth, at)?];
        if seen.tooth != to.tooth && known_rad - seen_rad > ROUNDING * known_rad.abs() {
            self.cut(from, seen, stretches)?;
            return self.cut(seen, to, stretches);
        }
        push(from.fraction, at, from.tooth);
        push(at, to.fraction, to.tooth);
        Ok(())
    }

    /// Checks that each tooth passes its lobe and its valley. There it has no lever arm to close a gap, so a negative
    /// gap blocks it.
    pub(super) fn check_lobe_and_valley(&self, lap: u64) -> Result<(), SolveError> {
        for node in [0, INTERVALS] {
            for tooth in &self.teeth {
                let Lever { center, flank, .. } = self.lever(tooth, node);
                let position = &center.position;
                if position.from_lobe_rad.min(position.from_valley_rad) > BESIDE * half_lobe_rad(position.lobes) {
                    continue;
                }
                let gap_mm = self.flanks.gaps(self.side).at(&tooth.place, center, flank);
                let gap_mm = gap_mm.wave_generator + gap_mm.ring;
                if gap_mm < -NEGLIGIBLE_MM {
                    return Err(SolveError::Interference {
                        place: self.flanks.mesh.tells_items_apart().then_some(tooth.place),
                        position_deg: position.from_lobe_deg(),
                        input_angle_deg: Some((lap as f64 + self.nodes[node]) * self.flanks.lap_deg()),
                        gap_um: 1e3 * gap_mm,
                    });
                }
            }
        }
        Ok(())
    }
}

/// Returns the index of the smallest value.
fn least(values: &[f64]) -> usize {
    let mut least = 0;
    for (index, value) in values.iter().enumerate() {
        if *value < values[least] {
            least = index;
        }
    }
    least
}

/// Returns the place and value of the minimum of a parabola through values at -1, 0 and 1. Returns none if there is no
/// minimum between these.
pub(super) fn vertex([before, middle, behind]: [f64; 3]) -> Option<(f64, f64)> {
    let bend = before - 2.0 * middle + behind;
    let place = 0.5 * (before - behind) / bend;
    (bend > 0.0 && place.abs() < 1.0).then_some((place, middle - 0.25 * (before - behind) * place))
}
