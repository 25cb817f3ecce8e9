//! Point contact: Hertz's ellipse (docs/explanation/theory.md sections 4.3 and 5).

use std::convert::Infallible;
use std::f64::consts::{FRAC_2_PI, PI};

use crate::root::{NotConverged, golden_section};

/// Returns Carlson's symmetric integral of the second kind `R_D(x, y, z) = (3/2) ∫ dt/(√(t+x) √(t+y) (t+z)^(3/2))` from
/// t = 0. Needs `x, y ≥ 0`, not both zero, and `z > 0`. Method: duplication (B. C. Carlson, *Numerical computation of
/// real or complex elliptic integrals*, Numerical Algorithms 10, 1995).
fn carlson_rd(x: f64, y: f64, z: f64) -> f64 {
    /// Each duplication divides the distances from the mean by four. The error of the series is their sixth power:
    /// below doubles.
    const NEAR: f64 = 1.5e-3;
    let (mut x, mut y, mut z) = (x, y, z);
    let (mut sum, mut share) = (0.0, 1.0);
    loop {
        let mean = (x + y + 3.0 * z) / 5.0;
        let (off_x, off_y) = ((mean - x) / mean, (mean - y) / mean);
        let off_z = (mean - z) / mean;
        if off_x.abs().max(off_y.abs()).max(off_z.abs()) < NEAR {
            let (xy, zz) = (off_x * off_y, off_z * off_z);
            let e2 = xy - 6.0 * zz;
            let e3 = (3.0 * xy - 8.0 * zz) * off_z;
            let e4 = 3.0 * (xy - zz) * zz;
            let e5 = xy * zz * off_z;
            let series =
                1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0
                    + 3.0 * e5 / 26.0;
            return 3.0 * sum + share * series / (mean * mean.sqrt());
        }
        let (root_x, root_y, root_z) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = root_x * root_y + root_x * root_z + root_y * root_z;
        sum += share / (root_z * (z + lambda));
        share *= 0.25;
        (x, y, z) = (0.25 * (x + lambda), 0.25 * (y + lambda), 0.25 * (z + lambda));
    }
}

/// Returns complete elliptic integrals of a contact ellipse for the parameter `m = 1 - k1²`, as sums of positive terms:
/// `B = (E - k1² K)/m` and `D = (K - E)/m`, both π/4 for a circle. The ratio `k1` of the half-axes is short to long.
fn integrals(ratio: f64) -> (f64, f64) {
    let squared = ratio * ratio;
    (squared * carlson_rd(0.0, 1.0, squared) / 3.0, carlson_rd(0.0, squared, 1.0) / 3.0)
}

/// Contact of two bodies whose curvatures, convex positive, sum to `Σ` in either of two perpendicular planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticContact {
    /// `k1`: short over long half-axis.
    ratio: f64,
    /// True if the short half-axis is in the plane of motion.
    is_short_in_plane: bool,
    /// Long half-axis under 1 N, in mm.
    long_mm: f64,
    /// Largest pressure under 1 N, in MPa.
    stress_mpa: f64,
    /// Approach under 1 N, in mm.
    approach_mm: f64,
}

/// Largest shear stress below a contact, in the plane of its short half-axis and the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShearBelow {
    /// Shear stress over the largest pressure.
    pub share: f64,
    /// Depth over the short half-axis.
    pub depth: f64,
}

impl EllipticContact {
    /// Exponent of the force in the approach. The force is proportional to the cube of the half-axes and of the
    /// pressure.
    pub const EXPONENT: f64 = 2.0 / 3.0;

    /// Builds the contact from the curvatures in the plane of motion and along the axis, in 1/mm, both positive, and
    /// the modulus.
    ///
    /// # Errors
    /// [`NotConverged`] if the ratio of the half-axes is not found.
    pub fn new(in_plane_per_mm: f64, axial_per_mm: f64, modulus_mpa: f64) -> Result<Self, NotConverged> {
        let is_short_in_plane = in_plane_per_mm >= axial_per_mm;
        let (large, small) =
            if is_short_in_plane { (in_plane_per_mm, axial_per_mm) } else { (axial_per_mm, in_plane_per_mm) };
        let ratio = ratio_of_half_axes(large / small)?;
        let (b, d) = integrals(ratio);
        // K and E.
        let (first, second) = (b + d, b + ratio * ratio * d);
        let sum = large + small;
        let long_mm = (3.0 * second / (PI * modulus_mpa * sum * ratio * ratio)).cbrt();
        let stress_mpa =
            (3.0 * ratio * (sum * modulus_mpa / second) * (sum * modulus_mpa / second) / (8.0 * PI)).cbrt();
        let approach_mm =
            0.5 * first * (9.0 * ratio * ratio * sum / (PI * PI * modulus_mpa * modulus_mpa * second)).cbrt();
        Ok(Self { ratio, is_short_in_plane, long_mm, stress_mpa, approach_mm })
    }

    /// Returns `q` in `δ = q F^(2/3)`.
    pub const fn coefficient(&self) -> f64 {
        self.approach_mm
    }

    /// Returns the largest pressure, `3F/(2π short long)`.
    pub fn stress_mpa(&self, force_n: f64) -> f64 {
        self.stress_mpa * force_n.cbrt()
    }

    /// Returns the force that makes the largest pressure `stress_mpa`.
    pub fn force_n(&self, stress_mpa: f64) -> f64 {
        (stress_mpa / self.stress_mpa).powi(3)
    }

    /// Returns half the width in the plane of motion.
    pub fn half_width_mm(&self, force_n: f64) -> f64 {
        self.half_axis_mm(self.is_short_in_plane, force_n)
    }

    /// Returns half the length along the axis.
    pub fn half_length_mm(&self, force_n: f64) -> f64 {
        self.half_axis_mm(!self.is_short_in_plane, force_n)
    }

    fn half_axis_mm(&self, is_short: bool, force_n: f64) -> f64 {
        let long_mm = self.long_mm * force_n.cbrt();
        if is_short { self.ratio * long_mm } else { long_mm }
    }

    /// Returns the largest shear stress below the surface of a body with this Poisson's ratio, on the axis of symmetry.
    pub fn shear_below(&self, poissons_ratio: f64) -> ShearBelow {
        let shear = |depth: f64| shear_at(self.ratio, poissons_ratio, depth);
        // The only maximum is between these depths, from a circle (0.38 to 0.57 for ν up to 0.5) to a line (0.786).
        // Sixty steps leave 1e-13 of the bracket, finer than a maximum can be located.
        let Ok((_, depth)) = golden_section(0.05, 1.2, 60, |depth| Ok::<_, Infallible>(-shear(depth)));
        ShearBelow { share: shear(depth), depth }
    }
}

/// Returns the ratio of the half-axes, short to long, for a ratio of curvatures of at least 1. It is the root of
/// `c_max/c_min = B/(k1² D)`, in logarithms.
fn ratio_of_half_axes(curvature_ratio: f64) -> Result<f64, NotConverged> {
    const CAP: u32 = 60;
    let wanted = curvature_ratio.ln();
    // Hamrock and Brewe's approximation, with an error of 4 % at most.
    let mut ln_ratio = -FRAC_2_PI * wanted;
    for _ in 0..CAP {
        let ratio = ln_ratio.exp();
        let (b, d) = integrals(ratio);
        let squared = ratio * ratio;
        let m = (1.0 - ratio) * (1.0 + ratio);
        // d ln(B/D)/dm = (D - B)/(2mB) - (B/k1² - D)/(2mD), at a circle -1/4. The slope affects only the speed.
        let slope_m = if m < 1e-4 { -0.25 } else { ((d - b) / b - (b / squared - d) / d) / (2.0 * m) };
        let step = ((b / d).ln() - 2.0 * ln_ratio - wanted) / (2.0 * squared * slope_m + 2.0);
        ln_ratio = (ln_ratio + step).min(0.0);
        if step.abs() <= 4.0 * f64::EPSILON * (1.0 + ln_ratio.abs()) {
            return Ok(ln_ratio.exp());
        }
    }
    Err(NotConverged { what: "ratio of a contact's half-axes", iterations: CAP, bracket_width: ln_ratio })
}

/// Returns half the difference of the stresses along the short half-axis and the normal, over the largest pressure. The
/// point is `depth` short half-axes below the middle of the contact. Source: K. L. Johnson, *Contact Mechanics*, 1985,
/// equation 3.69, with its differences of elliptic integrals as Carlson's.
fn shear_at(ratio: f64, poissons_ratio: f64, depth: f64) -> f64 {
    let k2 = ratio * ratio;
    let zeta = depth * ratio;
    let z2 = zeta * zeta;
    let (one, short) = (1.0 + z2, k2 + z2);
    let t = (short / one).sqrt();
    let b = k2 * carlson_rd(z2, one, short) / 3.0 + zeta / (one * short).sqrt();
    let d = carlson_rd(z2, short, one) / 3.0;
    let omega_prime_x = (zeta * b - (k2 + z2 * (1.0 + k2)) / (one * (k2 + t))) / k2;
    let omega_y = 0.5 / (t * one * (1.0 + t)) + omega_prime_x;
    let omega_prime_y = zeta * d - 1.0 / (one * (1.0 + t));
    let along_short = 2.0 * ratio * (omega_y + poissons_ratio * omega_prime_y);
    let along_normal = -ratio / (one * short).sqrt();
    0.5 * (along_short - along_normal)
}
