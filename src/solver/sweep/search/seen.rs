//! Moments of a piece that have been evaluated.

use std::ops::Range;

use super::piece::Piece;
use super::{CLOSED, FIRST_INTERVALS, LOADS, SHORTEST_PIECE, TOTALS};

/// Evaluated moments of a piece.
#[derive(Debug)]
pub(crate) struct Seen {
    pub(crate) piece: Piece,
    /// Number of teeth in it, place by place.
    pub(crate) teeth: usize,
    /// Elapsed shares of the lap, in order of evaluation.
    pub(crate) fractions: Vec<f64>,
    /// For each moment the loads, by quantity and then tooth, and then the totals.
    pub(super) values: Vec<f64>,
    /// For each moment the rotation of every tooth beyond closure; negative if a gap is open. Empty without gaps.
    pub(crate) pressed: Vec<f64>,
    /// Indices of the moments in order of their fractions.
    pub(super) order: Vec<usize>,
    /// For each moment, true if the interval up to the next one needs no further evaluation.
    pub(super) is_settled: Vec<bool>,
    /// Fractions to evaluate next.
    pub(super) wanted: Vec<f64>,
}

impl Seen {
    pub(crate) fn new(piece: Piece, teeth: usize) -> Self {
        let intervals = if piece.end - piece.start < SHORTEST_PIECE { 1 } else { FIRST_INTERVALS };
        let share = |interval| f64::from(interval) / f64::from(intervals);
        let inside = (1..intervals).map(|interval| piece.start + share(interval) * (piece.end - piece.start));
        let wanted = std::iter::once(piece.start).chain(inside).chain([piece.end]).collect();
        Self {
            piece,
            teeth,
            fractions: Vec::new(),
            values: Vec::new(),
            pressed: Vec::new(),
            order: Vec::new(),
            is_settled: Vec::new(),
            wanted,
        }
    }

    pub(super) const fn stride(&self) -> usize {
        LOADS * self.teeth + TOTALS
    }

    /// Appends a moment and returns its values, to be filled in.
    pub(crate) fn push(&mut self, fraction: f64) -> &mut [f64] {
        self.fractions.push(fraction);
        self.is_settled.push(false);
        let (start, stride) = (self.values.len(), self.stride());
        self.values.resize(start + stride, 0.0);
        &mut self.values[start..]
    }

    pub(crate) fn values(&self, moment: usize) -> &[f64] {
        &self.values[moment * self.stride()..][..self.stride()]
    }

    pub(crate) fn load(&self, moment: usize, quantity: usize, tooth: usize) -> f64 {
        self.values(moment)[quantity * self.teeth + tooth]
    }

    /// Returns the range of a quantity's curves among a moment's values: one for each tooth, one for a total.
    pub(super) const fn curves(&self, quantity: usize) -> Range<usize> {
        if quantity < LOADS {
            quantity * self.teeth..(quantity + 1) * self.teeth
        } else {
            let at = LOADS * self.teeth + quantity - LOADS;
            at..at + 1
        }
    }

    pub(super) fn value(&self, moment: usize, curve: usize) -> f64 {
        self.values[moment * self.stride() + curve]
    }

    pub(crate) fn pressed(&self, moment: usize) -> &[f64] {
        &self.pressed[moment * self.teeth..][..self.teeth]
    }

    /// Returns the first tooth that carries at only one of two moments.
    pub(super) fn tooth_changed(&self, one: usize, other: usize) -> Option<usize> {
        if self.pressed.is_empty() {
            return None;
        }
        let (one_rad, other_rad) = (self.rotation_rad(one), self.rotation_rad(other));
        self.pressed(one).iter().zip(self.pressed(other)).position(|(&one, &other)| {
            // No rotation closes the gap of a tooth without a lever arm. A tooth there without a gap carries.
            let has_gap = |pressed: f64, rotation_rad: f64| rotation_rad - pressed > CLOSED * rotation_rad;
            (one > 0.0) != (other > 0.0)
                && (one.is_finite() || has_gap(other, other_rad))
                && (other.is_finite() || has_gap(one, one_rad))
        })
    }

    /// Returns a fraction between two successive moments at which some tooth may carry although it is open at both, or
    /// may be open although it carries at both. The lines through the neighbouring moments, extended, then meet beyond
    /// zero. A curve that bends towards zero stays on this side of both lines.
    pub(super) fn suspected_change(&self, at: usize) -> Option<f64> {
        let moments = [at.checked_sub(1), Some(at), Some(at + 1), Some(at + 2)];
        let [before, one, other, after] = moments.map(|at| self.order.get(at?).copied());
        let (one, other) = (one?, other?);
        let (low, high) = (self.fractions[one], self.fractions[other]);
        let slope = |from: usize, to: usize, tooth: usize| {
            (self.pressed(to)[tooth] - self.pressed(from)[tooth]) / (self.fractions[to] - self.fractions[from])
        };
        let nothing = CLOSED * self.rotation_rad(one);
        let meeting = |tooth: usize| {
            // Treat it as not carrying: a curve below zero.
            let sign = if self.pressed(one)[tooth] > 0.0 { -1.0 } else { 1.0 };
            let [start, end] = [one, other].map(|moment| sign * self.pressed(moment)[tooth]);
            let own = (end - start) / (high - low);
            let beside = |from: Option<usize>, to: Option<usize>| Some(sign * slope(from?, to?, tooth));
            // At the end of a piece, the curve is assumed to bend as on the known side.
            let (rise, fall) = match (beside(before, Some(one)), beside(Some(other), after)) {
                (Some(rise), Some(fall)) => (rise, fall),
                (Some(rise), None) => (rise, 2.0 * own - rise),
                (None, Some(fall)) => (2.0 * own - fall, fall),
                (None, None) => return None,
            };
            let share = (own - fall) / (rise - fall);
            let top = start + rise * share * (high - low);
            let is_on_one_side = start <= 0.0 && end <= 0.0;
            (is_on_one_side && rise > own && own > fall && top > nothing)
                .then_some(low + share.clamp(0.125, 0.875) * (high - low))
        };
        (0..self.teeth).find_map(meeting)
    }

    fn rotation_rad(&self, moment: usize) -> f64 {
        self.value(moment, LOADS * self.teeth)
    }

    /// Sorts the new moments into the order.
    pub(super) fn put_in_order(&mut self) {
        let fractions = &self.fractions;
        self.order.extend(self.order.len()..fractions.len());
        self.order.sort_by(|&one, &other| fractions[one].total_cmp(&fractions[other]));
    }
}
