//! How much further the ring gives way under a tooth towards its tips than at its root (docs/explanation/theory.md section 4.3, `ring_teeth_bend`).
//!
//! A force on the flank moves it as it would move a half-plane, and further, because the other faces of the ring's tooth bear nothing: what the
//! half-plane bears there has to be taken off the ring again. That is a problem of the boundary alone, without any singularity at the force, and
//! is solved by boundary elements: one dense system for all places of the force.

use std::cell::Cell;
use std::f64::consts::PI;

use nalgebra::Point2;

use crate::contact::Material;
use crate::drive::Drive;
use crate::ring::RingTooth;
use crate::root::NotConverged;

use boundary::{KNOTS, Piece, flank_point};

mod boundary;
mod solve;

/// A tooth presses a stretch as wide as this part of its radius to either side, as far as contacts are: nearer to the flank's end it bends
/// the tooth no more.
const WIDTH_SHARE: f64 = 0.02;

/// What a ring gives way by under a tooth beyond what it gives way by at its root.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingBending {
    /// Where the flank ends.
    end: Point2<f64>,
    width_mm: f64,
    /// Of the contact's distance from the flank's end the logarithm, increasing; and by it the compliance in mm/N with its second derivative.
    ln_distance: [f64; KNOTS],
    compliance_mm_per_n: [f64; KNOTS],
    bend: [f64; KNOTS],
}

impl RingBending {
    /// Of a drive whose ring is of a material.
    ///
    /// # Errors
    /// [`NotConverged`] from the flank.
    pub fn new(drive: &Drive, ring: &Material) -> Result<Self, NotConverged> {
        let Solved { end, ln_distance, give, .. } = Solved::of(drive, ring.poissons_ratio)?;
        // Towards the root: the compliance is a difference from the last.
        let root = give[KNOTS - 1];
        let per_width_mm_per_n = ring.compliance_per_mpa() / drive.tooth_width_mm();
        let compliance_mm_per_n = give.map(|give| per_width_mm_per_n * (give - root));
        let bend = spline_bends(&ln_distance, &compliance_mm_per_n);
        let width_mm = WIDTH_SHARE * drive.parameters().tooth_radius_mm;
        Ok(Self { end, width_mm, ln_distance, compliance_mm_per_n, bend })
    }

    /// Under a tooth that touches the flank at a point, in mm/N along the normal. A ring of few teeth, each as broad as the ring, may give way by less
    /// there than at its root; that counts as nothing, for beside stiff contacts it would be more than they have.
    pub fn compliance_mm_per_n(&self, contact: Point2<f64>) -> f64 {
        let ln = (contact - self.end).norm().hypot(self.width_mm).ln();
        let at = self.ln_distance[1..KNOTS - 1].partition_point(|&knot| knot < ln);
        let [low, high] = [self.ln_distance[at], self.ln_distance[at + 1]];
        let step = high - low;
        let (a, b) = ((high - ln) / step, (ln - low) / step);
        let bends = (a * a * a - a) * self.bend[at] + (b * b * b - b) * self.bend[at + 1];
        let compliance = a * self.compliance_mm_per_n[at] + b * self.compliance_mm_per_n[at + 1];
        (compliance + bends * step * step / 6.0).max(0.0)
    }
}

/// The boundary elements of a ring, solved for one Poisson's ratio. Neither load nor width nor modulus matters.
#[derive(Clone, Copy)]
struct Solved {
    ring: RingTooth,
    poissons_ratio: f64,
    end: Point2<f64>,
    ln_distance: [f64; KNOTS],
    /// Under a force at each knot, per unit of `(1 - ν²)/E` for each unit of width, and but for the same number for all.
    give: [f64; KNOTS],
}

thread_local! {
    /// The last one: all loads of a drive have the same, and mostly come one after the other.
    static LAST: Cell<Option<Solved>> = const { Cell::new(None) };
}

impl Solved {
    /// Solved anew only for another ring than the last.
    fn of(drive: &Drive, poissons_ratio: f64) -> Result<Self, NotConverged> {
        let is_same =
            |last: &Self| last.ring == *drive.ring_tooth() && last.poissons_ratio.to_bits() == poissons_ratio.to_bits();
        if let Some(last) = LAST.get().filter(is_same) {
            return Ok(last);
        }
        let solved = Self::new(drive, poissons_ratio)?;
        LAST.set(Some(solved));
        Ok(solved)
    }

    fn new(drive: &Drive, poissons_ratio: f64) -> Result<Self, NotConverged> {
        let pitch_mm = 2.0 * PI * drive.root_radius_mm() / drive.parameters().ring_teeth.unsigned_abs() as f64;
        let piece = Piece::of(drive, pitch_mm)?;
        let end = flank_point(drive.flank(), drive.flank_limit().position)?;
        let mut ln_distance = [0.0; KNOTS];
        for (ln, element) in ln_distance.iter_mut().zip(piece.pressed()) {
            *ln = (element.middle * pitch_mm - end).norm().ln();
        }
        let give = solve::further_than_half_plane(&piece, poissons_ratio)?;
        Ok(Self { ring: *drive.ring_tooth(), poissons_ratio, end, ln_distance, give })
    }
}

/// The second derivatives of the natural cubic spline through points.
fn spline_bends(x: &[f64; KNOTS], y: &[f64; KNOTS]) -> [f64; KNOTS] {
    let mut bends = [0.0; KNOTS];
    let mut share = [0.0; KNOTS];
    for i in 1..KNOTS - 1 {
        let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        let slopes = (y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * share[i - 1];
        share[i] = after / pivot;
        bends[i] = (6.0 * slopes - before * bends[i - 1]) / pivot;
    }
    for i in (1..KNOTS - 1).rev() {
        bends[i] -= share[i] * bends[i + 1];
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a period of a sine has no second derivative at its ends, like the natural spline.
    #[test]
    fn spline_has_second_derivatives_of_sine() {
        let x: [f64; KNOTS] = std::array::from_fn(|knot| knot as f64 / (KNOTS - 1) as f64);
        let x = x.map(|x| x * (0.5 + 0.5 * x));
        let bends = spline_bends(&x, &x.map(|x| (PI * x).sin()));
        for (x, bend) in x.into_iter().zip(bends) {
            assert!((bend + PI * PI * (PI * x).sin()).abs() < 0.05, "{bend} at {x}");
        }
    }

    #[test]
    fn spline_is_smooth_and_natural() {
        let x: [f64; KNOTS] = std::array::from_fn(|knot| (1.0 + knot as f64).ln() + 0.1 * (knot % 3) as f64);
        let y: [f64; KNOTS] = std::array::from_fn(|knot| (2.5 * knot as f64).sin());
        let bends = spline_bends(&x, &y);
        assert!(bends[0].abs() <= 0.0 && bends[KNOTS - 1].abs() <= 0.0);
        for i in 1..KNOTS - 1 {
            let slope =
                |to: usize| (y[to] - y[i]) / (x[to] - x[i]) - (x[to] - x[i]) * (2.0 * bends[i] + bends[to]) / 6.0;
            assert!((slope(i - 1) - slope(i + 1)).abs() < 1e-11, "{} and {}", slope(i - 1), slope(i + 1));
        }
    }
}
