//! Backlash while one pair of teeth, one on each side, is first: a smooth curve.

use super::first::{FirstTeeth, vertex};
use super::{Found, MARGIN, sum};
use crate::contact::PerContact;
use crate::root::NotConverged;

/// Largest relative difference to the trapezoid rule at which Simpson's rule is accepted. Its own error is about the
/// square of it.
const SMOOTH: f64 = 3e-4;

/// Steps of a golden-section search. They shrink the bracket by 4e-9, so the minimum is exact to all digits.
const SECTIONS: u32 = 40;

/// Relative gain over the extreme found so far that counts as rounding.
const ROUNDING: f64 = 1e-12;

/// First teeth in front of the lobes and behind them.
pub(super) struct Pair<'a> {
    pub(super) front: &'a FirstTeeth<'a>,
    pub(super) behind: &'a FirstTeeth<'a>,
    pub(super) teeth: [usize; 2],
    pub(super) lap: u64,
}

impl Pair<'_> {
    fn at(&self, fraction: f64) -> Result<PerContact<f64>, NotConverged> {
        let front = self.front.closing(self.teeth[0], fraction)?;
        let behind = self.behind.closing(self.teeth[1], fraction)?;
        Ok(PerContact::of(|contact| front.get(contact) + behind.get(contact)))
    }

    /// Adds the integral and the extremes between two fractions of the lap.
    pub(super) fn integrate(&self, start: f64, end: f64, found: &mut Found) -> Result<(), NotConverged> {
        self.halve(start, end, [self.at(start)?, self.at(end)?], found)
    }

    fn halve(
        &self,
        start: f64,
        end: f64,
        [at_start, at_end]: [PerContact<f64>; 2],
        found: &mut Found,
    ) -> Result<(), NotConverged> {
        let middle = start.midpoint(end);
        let at_middle = self.at(middle)?;
        let ends = PerContact::of(|contact| 0.5 * (at_start.get(contact) + at_end.get(contact)));
        let bend = |contact| (ends.get(contact) - at_middle.get(contact)).abs() * (2.0 / 3.0);
        let scale: f64 = at_middle.iter().map(|(_, part)| part.abs()).sum();
        let is_smooth = ends.iter().all(|(contact, _)| bend(contact) <= SMOOTH * scale);
        // The rest of so short a stretch is negligible.
        if !is_smooth && end - start > MARGIN {
            self.halve(start, middle, [at_start, at_middle], found)?;
            return self.halve(middle, end, [at_middle, at_end], found);
        }
        found.integral_rad = PerContact::of(|contact| {
            let mean_rad = (ends.get(contact) + 2.0 * at_middle.get(contact)) / 3.0;
            found.integral_rad.get(contact) + mean_rad * (end - start)
        });
        let values_rad = [sum(&at_start), sum(&at_middle), sum(&at_end)];
        for (fraction, value_rad) in [start, middle, end].into_iter().zip(values_rad) {
            found.see(self.lap as f64 + fraction, value_rad);
        }
        self.look_for_extremes(start, end, values_rad, found)
    }

    /// Searches a stretch for an extreme if a parabola through its values predicts one.
    fn look_for_extremes(
        &self,
        start: f64,
        end: f64,
        values_rad: [f64; 3],
        found: &mut Found,
    ) -> Result<(), NotConverged> {
        for sign in [1.0, -1.0] {
            let signed = values_rad.map(|value| sign * value);
            let Some((_, least)) = vertex(signed) else { continue };
            let nearest = signed.into_iter().fold(f64::INFINITY, f64::min);
            let best = if sign > 0.0 { found.smallest.1 } else { -found.largest.1 };
            // The parabola's error can be as large as its own prediction.
            if least - (nearest - least) < best - ROUNDING * best.abs() {
                self.sections(start, end, sign, found)?;
            }
        }
        Ok(())
    }

    fn sections(&self, start: f64, end: f64, sign: f64, found: &mut Found) -> Result<(), NotConverged> {
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (start, end);
        for _ in 0..SECTIONS {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            let [at_left, at_right] = [sum(&self.at(left)?), sum(&self.at(right)?)];
            found.see(self.lap as f64 + left, at_left);
            found.see(self.lap as f64 + right, at_right);
            if sign * at_left < sign * at_right { high = right } else { low = left }
        }
        Ok(())
    }
}
