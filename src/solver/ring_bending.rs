//! Bending of the ring's teeth: extra compliance of the ring under a tooth compared with its root
//! (docs/explanation/theory.md section 4.3, `ring_teeth_bend`).
//!
//! A force on the flank displaces it as it would a half-plane, plus more, because the other faces of the ring's tooth
//! are free: the half-plane's tractions there have to be removed. The extra part is a boundary problem without a
//! singularity at the force. It is solved by boundary elements, with one dense system for all places of the force.

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

/// Half-width of the loaded stretch of the flank, as part of the tooth's radius, as for contacts. Nearer to the flank's
/// end than that, bending does not grow further.
const WIDTH_SHARE: f64 = 0.02;

/// Compliance of a ring under a tooth in excess of that at its root.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingBending {
    /// End of the flank.
    end: Point2<f64>,
    width_mm: f64,
    /// Increasing logarithms of the contact's distance from the flank's end; for each the compliance in mm/N and its
    /// second derivative.
    ln_distance: [f64; KNOTS],
    compliance_mm_per_n: [f64; KNOTS],
    bend: [f64; KNOTS],
}

impl RingBending {
    /// Builds the compliance for a drive whose ring has this material.
    ///
    /// # Errors
    /// [`NotConverged`] from the flank.
    pub fn new(drive: &Drive, ring: &Material) -> Result<Self, NotConverged> {
        let Solved { end, ln_distance, give, .. } = Solved::of(drive, ring.poissons_ratio)?;
        // Relative to the root: the compliance is a difference from the last knot.
        let root = give[KNOTS - 1];
        let per_width_mm_per_n = ring.compliance_per_mpa() / drive.tooth_width_mm();
        let compliance_mm_per_n = give.map(|give| per_width_mm_per_n * (give - root));
        let bend = spline_bends(&ln_distance, &compliance_mm_per_n);
        let width_mm = WIDTH_SHARE * drive.parameters().tooth_radius_mm;
        Ok(Self { end, width_mm, ln_distance, compliance_mm_per_n, bend })
    }

    /// Returns the compliance in mm/N along the normal under a tooth that touches the flank at a point. If a ring has
    /// few teeth, each as wide as the ring, it may be less there than at the root. It then counts as 0, because a
    /// negative value could exceed the compliance of stiff contacts.
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

/// Boundary elements of a ring, solved for one Poisson's ratio. The result is independent of load, width and modulus.
#[derive(Clone, Copy)]
struct Solved {
    ring: RingTooth,
    poissons_ratio: f64,
    end: Point2<f64>,
    ln_distance: [f64; KNOTS],
    /// Displacement under a force at each knot, per unit of `(1 - ν²)/E` and unit width, up to a common constant.
    give: [f64; KNOTS],
}

thread_local! {
    /// The last solution: all loads of a drive share it, and they mostly follow each other.
    static LAST: Cell<Option<Solved>> = const { Cell::new(None) };
}

impl Solved {
    /// Returns the solution, computed only if the ring differs from the last one.
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

/// Returns the second derivatives of the natural cubic spline through points.
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

    /// A sine over half a wave has no curvature at its ends, like the natural spline.
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
