//! Shapes of the wave generator that have a fast path.

use super::centers::Centers;
use super::lanes::LANES;
use crate::cam::{Cam, Ellipse};
use crate::contact::PerContact;

/// Largest number of steps towards the support. A drive that needs more uses the plain path.
const MAX_STEPS: u32 = 8;

/// A relative step this small is the last: the next would be proportional to its cube, below the last digit.
const LAST_STEP: f64 = 5e-6;

/// Shape that determines the centres of the teeth.
pub(super) enum Shape {
    Ellipse(EllipseShape),
    Path(Centers),
}

impl Shape {
    /// Returns the shape, with bounds over all positions of the angle between contact points (cam, ring) and position,
    /// as tangents. Returns none for a kind without columns, which uses the plain path.
    pub(super) fn new(cam: &Cam, r: f64) -> Option<(Self, PerContact<f64>)> {
        // On the ring by sin β ≤ 1, from the least distance of a centre.
        let bounds =
            |cam: f64, least_center: f64| PerContact { wave_generator: cam, ring: r / least_center, carrier: 0.0 };
        let off_path = |steepest: f64, least_center: f64| bounds(r * steepest / (least_center - r), least_center);
        Some(match cam {
            Cam::Ellipse(cam) => {
                let shape = EllipseShape::new(cam, r);
                let EllipseShape { a, b, difference_of_squares, .. } = shape;
                // By the inequality of arithmetic and geometric means.
                let ratio = difference_of_squares * r * a / (2.0 * a * b * ((b * b + r * b) * (a * a + r * b)).sqrt());
                (Self::Ellipse(shape), bounds(ratio, b + r))
            }
            Cam::Harmonic(cam) => {
                let (path, e) = (cam.mean_radius_mm + r, cam.amplitude_mm);
                let centers = if cam.is_circle() { Centers::Eccentric(*cam) } else { Centers::Harmonic(*cam) };
                (Self::Path(centers), off_path(e * f64::from(cam.lobes) / (path - e), path - e))
            }
            Cam::HarmonicPath(cam) => {
                let (mean, e) = (cam.mean_radius_mm, cam.amplitude_mm);
                let steepest = e * cam.lobe_count() / (mean - e);
                (Self::Path(Centers::HarmonicPath(*cam)), off_path(steepest, mean - e))
            }
        })
    }
}

/// The ellipse, whose support is computed iteratively.
pub(super) struct EllipseShape {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) r: f64,
    pub(super) difference_of_squares: f64,
    /// Terms of the initial value of h: its series in ε = (a - b)/(a + b) up to the third power.
    guess: [f64; 4],
}

impl EllipseShape {
    pub(super) fn new(cam: &Ellipse, r: f64) -> Self {
        let (a, b) = (cam.semi_major_mm, cam.semi_minor_mm);
        let mean = 0.5 * (a + b);
        let (flattening, thickness) = ((a - b) / (a + b), r / mean);
        let round = 1.0 + thickness;
        let first = mean * flattening;
        let second = 2.0 * first * flattening * (thickness - 7.0) / round;
        let third = 2.0 * first * flattening * flattening * (thickness * (thickness - 14.0) + 25.0) / (round * round);
        let guess = [mean, first, second, third];
        Self { a, b, r, difference_of_squares: cam.difference_of_squares_mm2(), guess }
    }

    /// Returns the support h: the root in [b, a] of sin² (a² + rh)² (h² - b²) - cos² (b² + rh)² (a² - h²), by Halley's
    /// method. Its one division replaces two of Newton's steps. Returns none if it converges too slowly.
    #[inline(always)]
    pub(super) fn supports(&self, sin: &[f64; LANES], cos: &[f64; LANES]) -> Option<[f64; LANES]> {
        let Self { a, b, r, guess: [mean, first, second, third], .. } = *self;
        let (a2, b2) = (a * a, b * b);
        let mut support = [0.0; LANES];
        for i in 0..LANES {
            let (double_cos, product) = (cos[i] * cos[i] - sin[i] * sin[i], sin[i] * cos[i]);
            let guess = mean + first * double_cos + product * product * (second - third * double_cos);
            support[i] = if guess > b { guess } else { b };
        }
        for _ in 0..MAX_STEPS {
            let mut largest = [0.0; LANES];
            for i in 0..LANES {
                let h = support[i];
                let (major, minor) = (sin[i] * (a2 + r * h), cos[i] * (b2 + r * h));
                let (major_slope, minor_slope) = (r * sin[i], r * cos[i]);
                let (above_b, below_a) = ((h - b) * (h + b), (a - h) * (a + h));
                let value = major * major * above_b - minor * minor * below_a;
                // Half the first and half the second derivative.
                let (major_part, minor_part) = (major_slope * above_b, minor_slope * below_a);
                let slope = major * (major_part + major * h) + minor * (minor * h - minor_part);
                let bend = major * (major + 4.0 * h * major_slope)
                    + major_slope * major_part
                    + minor * (minor + 4.0 * h * minor_slope)
                    - minor_slope * minor_part;
                let step = 2.0 * value * slope / (4.0 * slope * slope - value * bend);
                support[i] = h - step;
                largest[i] = step.abs() - LAST_STEP * h;
            }
            if largest.iter().all(|&beyond| beyond <= 0.0) {
                return Some(support);
            }
        }
        None
    }
}
