//! Backlash while one pair of teeth, one on each side, is first: a smooth curve.

use super::first::{FirstTeeth, vertex};
use super::{Found, MARGIN, sum};
use crate::contact::PerContact;
use crate::root::{NotConverged, golden_section};

/// Largest relative difference to the trapezoid rule at which Simpson's rule is accepted. Its own error is about the
/// square of it.
const SMOOTH: f64 = 3e-4;

/// Steps of a golden-section search. They shrink the bracket by 4e-9, so the minimum is exact to all digits.
const SECTIONS: u32 = 40;

/// Part of the closing angles that counts as rounding. The angles of the two sides may cancel each other.
const ROUNDING: f64 = 1e-12;

/// Backlash at one fraction of a lap.
#[derive(Clone, Copy)]
struct Value {
    of_contact_rad: PerContact<f64>,
    /// Differences below this are rounding.
    rounding_rad: f64,
}

impl Value {
    fn rad(&self) -> f64 {
        sum(&self.of_contact_rad)
    }
}

/// First teeth in front of the lobes and behind them.
pub(super) struct Pair<'a> {
    pub(super) front: &'a FirstTeeth<'a>,
    pub(super) behind: &'a FirstTeeth<'a>,
    pub(super) teeth: [usize; 2],
    pub(super) lap: u64,
}

impl Pair<'_> {
    fn at(&self, fraction: f64) -> Result<Value, NotConverged> {
        let front = self.front.closing(self.teeth[0], fraction)?;
        let behind = self.behind.closing(self.teeth[1], fraction)?;
        let angles_rad = front.iter().chain(behind.iter()).map(|(_, angle)| angle.abs());
        Ok(Value {
            of_contact_rad: PerContact::of(|contact| front.get(contact) + behind.get(contact)),
            rounding_rad: ROUNDING * angles_rad.sum::<f64>(),
        })
    }

    /// Adds the integral and the extremes between two fractions of the lap.
    pub(super) fn integrate(&self, start: f64, end: f64, found: &mut Found) -> Result<(), NotConverged> {
        self.halve(start, end, [self.at(start)?, self.at(end)?], found)
    }

    fn halve(
        &self,
        start: f64,
        end: f64,
        [at_start, at_end]: [Value; 2],
        found: &mut Found,
    ) -> Result<(), NotConverged> {
        let middle = start.midpoint(end);
        let at_middle = self.at(middle)?;
        let [from, to, between] = [at_start, at_end, at_middle].map(|value| value.of_contact_rad);
        let ends = PerContact::of(|contact| 0.5 * (from.get(contact) + to.get(contact)));
        let bend = |contact| (ends.get(contact) - between.get(contact)).abs() * (2.0 / 3.0);
        let scale: f64 = between.iter().map(|(_, part)| part.abs()).sum();
        let accepted_rad = (SMOOTH * scale).max(at_middle.rounding_rad);
        let is_smooth = ends.iter().all(|(contact, _)| bend(contact) <= accepted_rad);
        // The rest of so short a stretch is negligible.
        if !is_smooth && end - start > MARGIN {
            self.halve(start, middle, [at_start, at_middle], found)?;
            return self.halve(middle, end, [at_middle, at_end], found);
        }
        found.integral_rad = PerContact::of(|contact| {
            let mean_rad = (ends.get(contact) + 2.0 * between.get(contact)) / 3.0;
            found.integral_rad.get(contact) + mean_rad * (end - start)
        });
        let values = [at_start, at_middle, at_end];
        for (fraction, value) in [start, middle, end].into_iter().zip(values) {
            found.see(self.lap as f64 + fraction, value.rad());
        }
        self.look_for_extremes(start, end, values, found)
    }

    /// Searches a stretch for an extreme if a parabola through its values predicts one.
    fn look_for_extremes(
        &self,
        start: f64,
        end: f64,
        values: [Value; 3],
        found: &mut Found,
    ) -> Result<(), NotConverged> {
        for sign in [1.0, -1.0] {
            let signed = values.map(|value| sign * value.rad());
            let Some((_, least)) = vertex(signed) else { continue };
            let nearest = signed.into_iter().fold(f64::INFINITY, f64::min);
            let best = if sign > 0.0 { found.smallest.1 } else { -found.largest.1 };
            // The parabola's error can be as large as its own prediction.
            if least - (nearest - least) < best - values[1].rounding_rad {
                // `found` keeps the extreme.
                golden_section(start, end, SECTIONS, |fraction| {
                    let value_rad = self.at(fraction)?.rad();
                    found.see(self.lap as f64 + fraction, value_rad);
                    Ok(sign * value_rad)
                })?;
            }
        }
        Ok(())
    }
}
