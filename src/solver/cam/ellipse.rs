//! Ellipse, described by its support function over the angle φ of its outward normal (docs/explanation/theory.md
//! sections 2.1 to 2.3).

use nalgebra::{Point2, Unit, Vector2};

use crate::cam::kind::{CurvePoint, Direction, Kind, ToothCenter};
use crate::position::Position;
use crate::root::{NotConverged, ValueAndSlope, bracketed, newton_in_bracket};

/// An ellipse centred on the axis, `a > b`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ellipse {
    /// `a`.
    pub(crate) semi_major_mm: f64,
    /// `b`.
    pub(crate) semi_minor_mm: f64,
    pub(crate) tooth_radius_mm: f64,
}

impl Ellipse {
    /// Returns `a² - b²`, as a product so that a nearly round cam keeps all its digits.
    pub(crate) fn difference_of_squares_mm2(&self) -> f64 {
        (self.semi_major_mm - self.semi_minor_mm) * (self.semi_major_mm + self.semi_minor_mm)
    }

    /// Returns `h` for the angle φ of a normal.
    fn support_mm(&self, normal: Direction) -> f64 {
        (self.semi_major_mm * normal.cos).hypot(self.semi_minor_mm * normal.sin)
    }

    /// Returns the radius of curvature `ρ_H = h + h'' = a²b²/h³`, a closed form without cancellation.
    fn curvature_radius_mm(&self, support_mm: f64) -> f64 {
        let a_over_h = self.semi_major_mm / support_mm;
        let b_over_h = self.semi_minor_mm / support_mm;
        a_over_h * a_over_h * b_over_h * b_over_h * support_mm
    }

    /// Returns `h'' = ρ_H - h`, as a product of differences that keeps its digits for a nearly round cam:
    /// `(a - b)(b sin²φ - a cos²φ)(ab + h²)/h³`.
    fn support_second_derivative_mm(&self, normal: Direction, support_mm: f64) -> f64 {
        let (a, b, h) = (self.semi_major_mm, self.semi_minor_mm, support_mm);
        let (c, s) = (normal.cos, normal.sin);
        (a - b) * ((b * s * s - a * c * c) / h) * ((a / h) * (b / h) + 1.0)
    }

    /// Returns the normal at the tooth: `tan φ = tan ψ (a² + rh)/(b² + rh)`, with sums and products of positive terms
    /// only.
    fn normal(&self, position: Position, support_mm: f64) -> Direction {
        let (a, b, r) = (self.semi_major_mm, self.semi_minor_mm, self.tooth_radius_mm);
        let cos = position.phase_cos * (b * b + r * support_mm);
        let sin = position.phase_sin * (a * a + r * support_mm);
        let length = cos.hypot(sin);
        Direction { cos: cos / length, sin: sin / length }
    }

    fn center(&self, position: Position, normal: Direction) -> ToothCenter {
        let support_mm = self.support_mm(normal);
        ToothCenter::by_support(
            position,
            self.tooth_radius_mm,
            support_mm,
            self.difference_of_squares_mm2() * (normal.sin * normal.cos / support_mm),
            self.support_second_derivative_mm(normal, support_mm),
            self.curvature_radius_mm(support_mm),
        )
    }
}

impl Kind for Ellipse {
    fn lobes(&self) -> u32 {
        2
    }

    fn tooth_radius_mm(&self) -> f64 {
        self.tooth_radius_mm
    }

    /// The centre is `((a²/h + r) cos φ, (b²/h + r) sin φ)`, so φ follows from ψ and the support `h = h(φ)`. `h` is the
    /// one root in `[b, a]` of `sin²ψ (a² + rh)² (h² - b²) - cos²ψ (b² + rh)² (a² - h²)`.
    fn at(&self, position: Position) -> Result<ToothCenter, NotConverged> {
        let (a, b, r) = (self.semi_major_mm, self.semi_minor_mm, self.tooth_radius_mm);
        let Position { phase_cos: cos, phase_sin: sin, .. } = position;
        let guess = (a * cos).hypot(b * sin);
        let support_mm = newton_in_bracket("support of the cam at a tooth", b, a, guess, |h| {
            let major = sin * (a * a + r * h);
            let minor = cos * (b * b + r * h);
            let (above_b, below_a) = ((h - b) * (h + b), (a - h) * (a + h));
            ValueAndSlope {
                value: major * major * above_b - minor * minor * below_a,
                slope: 2.0 * (major * (r * sin * above_b + major * h) + minor * (minor * h - r * cos * below_a)),
            }
        })?;
        Ok(self.center(position, self.normal(position, support_mm)))
    }

    /// At the steepest point `h''(h + r) = h'²`. In terms of `u = cos²φ` and divided by `a - b` this is
    /// `(b - (a + b) u)(ab + h²)(h + r) = h (a + b)(a² - b²) u (1 - u)`, with `h² = b² + (a² - b²) u`.
    fn steepest(&self) -> Result<ToothCenter, NotConverged> {
        let (a, b, r) = (self.semi_major_mm, self.semi_minor_mm, self.tooth_radius_mm);
        let difference = self.difference_of_squares_mm2();
        let condition = |u: f64| {
            let support_squared = b * b + difference * u;
            let h = support_squared.sqrt();
            Ok((b - (a + b) * u) * (a * b + support_squared) * (h + r) - h * (a + b) * difference * u * (1.0 - u))
        };
        let cos_squared = bracketed("largest pressure angle", 0.0, b * (a * b + b * b) * (b + r), 1.0, condition)?;
        let normal = Direction { cos: cos_squared.sqrt(), sin: (1.0 - cos_squared).sqrt() };
        let support_mm = (b * b + difference * cos_squared).sqrt();
        let major = normal.cos * (a * a / support_mm + r);
        let minor = normal.sin * (b * b / support_mm + r);
        let position = if minor < major {
            Position::from_lobe(minor.atan2(major), 2)
        } else {
            Position::from_valley(major.atan2(minor), 2)
        };
        Ok(self.center(position, normal))
    }

    fn cam_outer_radius_mm(&self) -> f64 {
        self.semi_major_mm
    }

    fn cam_inner_radius_mm(&self) -> f64 {
        self.semi_minor_mm
    }

    /// `b²/a`, on the major axis.
    fn least_curvature_radius_mm(&self) -> f64 {
        self.semi_minor_mm * (self.semi_minor_mm / self.semi_major_mm)
    }

    /// Uses `h² - b² = (a² - b²) cos²φ` and `h'² = (h² - b²)(a² - h²)/h²`.
    fn center_rise_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (a, b, r) = (self.semi_major_mm, self.semi_minor_mm, self.tooth_radius_mm);
        let h = tooth.support_mm;
        let cos = self.normal(tooth.position, h).cos;
        let cos_squared = cos * cos;
        self.difference_of_squares_mm2() * cos_squared * (2.0 * r / (h + b) + (a / h) * (a / h))
    }

    /// Uses `a² - h² = (a² - b²) sin²φ`.
    fn center_drop_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (a, b, r) = (self.semi_major_mm, self.semi_minor_mm, self.tooth_radius_mm);
        let h = tooth.support_mm;
        let sin = self.normal(tooth.position, h).sin;
        let sin_squared = sin * sin;
        self.difference_of_squares_mm2() * sin_squared * (2.0 * r / (a + h) + (b / h) * (b / h))
    }

    /// `k² (a² - b²)/(a² + br)`.
    fn tip_bend(&self, ring_teeth_per_lobe: f64) -> f64 {
        let (a, b, k) = (self.semi_major_mm, self.semi_minor_mm, ring_teeth_per_lobe);
        k * k * self.difference_of_squares_mm2() / (a * a + b * self.tooth_radius_mm)
    }

    /// An ellipse is convex.
    fn hollow(&self) -> Option<(f64, f64)> {
        None
    }

    /// The lower root of `2b r² + (b² + 2a² - k²(a² - b²)) r + a²b = 0`; none if the roots are complex.
    fn critical_tooth_radius_mm(&self, ring_teeth_per_lobe: f64) -> Option<f64> {
        let (a, b, k) = (self.semi_major_mm, self.semi_minor_mm, ring_teeth_per_lobe);
        let linear = k * k * self.difference_of_squares_mm2() - b * b - 2.0 * a * a;
        let least = 2.0 * std::f64::consts::SQRT_2 * a * b;
        if linear < least {
            return None;
        }
        // The stable form of the lower root: no difference of nearly equal values.
        let root = ((linear - least) * (linear + least)).sqrt();
        Some(2.0 * a * (a * b / (linear + root)))
    }

    /// The point is `(a² cos φ, b² sin φ)/h`.
    fn contact_angle_from_valley_rad(&self, tooth: &ToothCenter) -> f64 {
        let (a, b) = (self.semi_major_mm, self.semi_minor_mm);
        let normal = self.normal(tooth.position, tooth.support_mm);
        (a * (a * normal.cos)).atan2(b * (b * normal.sin))
    }

    /// Takes the place as the angle φ of the normal, so that no tooth position has to be found.
    fn outline(&self, set_back_mm: f64, place: Position) -> Result<CurvePoint, NotConverged> {
        let (a, b) = (self.semi_major_mm, self.semi_minor_mm);
        let normal = Direction { cos: place.phase_cos, sin: place.phase_sin };
        let h = self.support_mm(normal);
        let point = Point2::new(a * (a / h) * normal.cos, b * (b / h) * normal.sin);
        Ok(CurvePoint {
            point: point - set_back_mm * Vector2::new(normal.cos, normal.sin),
            tangent: Unit::new_unchecked(Vector2::new(-normal.sin, normal.cos)),
            bend: 1.0,
        })
    }
}
