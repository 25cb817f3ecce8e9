//! A tooth's centre over its position ψ (docs/theory.md section 2).

use std::f64::consts::{FRAC_PI_2, PI};

use crate::cam::{Cam, CamContact};
use crate::position::Position;
use crate::root::{NotConverged, ValueAndSlope, bracketed, newton_in_bracket};

/// The path of the teeth's centres around the wave generator: the outer parallel curve of the cam at the tooth radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Locus {
    cam: Cam,
    tooth_radius_mm: f64,
}

/// A tooth at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothCenter {
    /// Where it is.
    pub position: Position,
    /// Where it touches the cam.
    pub cam_contact: CamContact,
    /// `d`: distance of its centre from the axis.
    pub center_radius_mm: f64,
    /// `T = tan γ = |h'|/(h + r)`, γ the pressure angle at the wave generator.
    pub tan_pressure_angle: f64,
}

impl Locus {
    pub(crate) const fn new(cam: Cam, tooth_radius_mm: f64) -> Self {
        Self { cam, tooth_radius_mm }
    }

    /// The wave generator.
    pub const fn cam(&self) -> &Cam {
        &self.cam
    }

    /// `r`.
    pub const fn tooth_radius_mm(&self) -> f64 {
        self.tooth_radius_mm
    }

    /// The tooth whose centre stands at `position`.
    ///
    /// The centre is `((a²/h + r) cos φ, (b²/h + r) sin φ)`, so that `tan φ = tan ψ (a² + rh)/(b² + rh)`: φ follows from
    /// ψ by sums and products of positive terms once the support `h = h(φ)` is known. `h` is the one root in `[b, a]` of
    /// `sin²ψ (a² + rh)² (h² - b²) - cos²ψ (b² + rh)² (a² - h²)`.
    ///
    /// # Errors
    /// [`NotConverged`] if that root is not found.
    pub fn at(&self, position: Position) -> Result<ToothCenter, NotConverged> {
        let (a, b, r) = (self.cam.semi_major_mm(), self.cam.semi_minor_mm(), self.tooth_radius_mm);
        let Position { cos, sin, .. } = position;
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
        let normal_cos = cos * (b * b + r * support_mm);
        let normal_sin = sin * (a * a + r * support_mm);
        let length = normal_cos.hypot(normal_sin);
        Ok(self.center(position, normal_cos / length, normal_sin / length))
    }

    /// `d` at any angle from the major axis.
    pub(crate) fn center_radius_at_mm(&self, angle_rad: f64) -> Result<f64, NotConverged> {
        let folded = angle_rad.rem_euclid(PI);
        let position = if folded > 0.5 * FRAC_PI_2 && folded < 1.5 * FRAC_PI_2 {
            Position::from_minor((folded - FRAC_PI_2).abs())
        } else {
            Position::from_major(folded.min(PI - folded))
        };
        Ok(self.at(position)?.center_radius_mm)
    }

    fn center(&self, position: Position, normal_cos: f64, normal_sin: f64) -> ToothCenter {
        let cam_contact = self.cam.contact(normal_cos, normal_sin);
        let offset_support_mm = cam_contact.support_mm + self.tooth_radius_mm;
        ToothCenter {
            position,
            cam_contact,
            center_radius_mm: offset_support_mm.hypot(cam_contact.lever_arm_mm),
            tan_pressure_angle: cam_contact.lever_arm_mm / offset_support_mm,
        }
    }

    /// `T_ψ = dT/dψ = (1 + T²)(T |h'| - h'')/(r + ρ_H)`.
    pub fn tan_pressure_angle_derivative(&self, tooth: &ToothCenter) -> f64 {
        let contact = &tooth.cam_contact;
        let t = tooth.tan_pressure_angle;
        (1.0 + t * t) * (t * contact.lever_arm_mm - self.cam.support_second_derivative_mm(contact))
            / (self.tooth_radius_mm + self.cam.curvature_radius_mm(contact))
    }

    /// The tooth with the largest pressure angle at the wave generator.
    ///
    /// There `h''(h + r) = h'²`; in `u = cos²φ` and divided by `a - b` this reads
    /// `(b - (a + b) u)(ab + h²)(h + r) = h (a + b)(a² - b²) u (1 - u)`, with `h² = b² + (a² - b²) u`.
    ///
    /// # Errors
    /// [`NotConverged`] if its root in `[0, 1]` is not found.
    pub fn steepest(&self) -> Result<ToothCenter, NotConverged> {
        let (a, b, r) = (self.cam.semi_major_mm(), self.cam.semi_minor_mm(), self.tooth_radius_mm);
        let difference = self.cam.difference_of_squares_mm2();
        let condition = |u: f64| {
            let support_squared = b * b + difference * u;
            let h = support_squared.sqrt();
            Ok((b - (a + b) * u) * (a * b + support_squared) * (h + r) - h * (a + b) * difference * u * (1.0 - u))
        };
        let cos_squared = bracketed("largest pressure angle", 0.0, b * (a * b + b * b) * (b + r), 1.0, condition)?;
        let (normal_cos, normal_sin) = (cos_squared.sqrt(), (1.0 - cos_squared).sqrt());
        let support_mm = (b * b + difference * cos_squared).sqrt();
        let major = normal_cos * (a * a / support_mm + r);
        let minor = normal_sin * (b * b / support_mm + r);
        let position = if minor < major {
            Position::from_major(minor.atan2(major))
        } else {
            Position::from_minor(major.atan2(minor))
        };
        Ok(self.center(position, normal_cos, normal_sin))
    }
}
