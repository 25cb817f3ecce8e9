//! The wave generator: an ellipse described by its support function over the angle φ of its outward normal
//! (docs/theory.md section 2).

use nalgebra::{Point2, Unit, Vector2};

/// The elliptic wave generator, `a > b`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cam {
    semi_major_mm: f64,
    semi_minor_mm: f64,
}

/// The cam where its outward normal has the angle φ from the major axis, 0 ≤ φ ≤ π/2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CamContact {
    /// cos φ.
    pub normal_cos: f64,
    /// sin φ.
    pub normal_sin: f64,
    /// Support function `h(φ)`: distance of the tangent from the axis.
    pub support_mm: f64,
    /// `|h'(φ)|`: the lever arm of a force along the normal about the axis.
    pub lever_arm_mm: f64,
}

impl Cam {
    /// Both lengths positive and `semi_major_mm > semi_minor_mm`; [`crate::Drive::new`] has checked it.
    pub(crate) const fn new(semi_major_mm: f64, semi_minor_mm: f64) -> Self {
        Self { semi_major_mm, semi_minor_mm }
    }

    /// `a`.
    pub const fn semi_major_mm(&self) -> f64 {
        self.semi_major_mm
    }

    /// `b`.
    pub const fn semi_minor_mm(&self) -> f64 {
        self.semi_minor_mm
    }

    /// `a² - b²`, as a product so that a nearly round cam keeps all its digits.
    pub fn difference_of_squares_mm2(&self) -> f64 {
        (self.semi_major_mm - self.semi_minor_mm) * (self.semi_major_mm + self.semi_minor_mm)
    }

    /// The contact where the normal has the direction `(normal_cos, normal_sin)`.
    pub fn contact(&self, normal_cos: f64, normal_sin: f64) -> CamContact {
        let support_mm = (self.semi_major_mm * normal_cos).hypot(self.semi_minor_mm * normal_sin);
        let lever_arm_mm = self.difference_of_squares_mm2() * (normal_sin * normal_cos / support_mm);
        CamContact { normal_cos, normal_sin, support_mm, lever_arm_mm }
    }

    /// Radius of curvature `ρ_H = h + h'' = a²b²/h³`: for an ellipse the sum has this closed form without cancellation.
    pub fn curvature_radius_mm(&self, contact: &CamContact) -> f64 {
        let a_over_h = self.semi_major_mm / contact.support_mm;
        let b_over_h = self.semi_minor_mm / contact.support_mm;
        a_over_h * a_over_h * b_over_h * b_over_h * contact.support_mm
    }

    /// `h'' = ρ_H - h`, written as a product of differences that keeps its digits for a nearly round cam:
    /// `(a - b)(b sin²φ - a cos²φ)(ab + h²)/h³`.
    pub fn support_second_derivative_mm(&self, contact: &CamContact) -> f64 {
        let (a, b, h) = (self.semi_major_mm, self.semi_minor_mm, contact.support_mm);
        let (c, s) = (contact.normal_cos, contact.normal_sin);
        (a - b) * ((b * s * s - a * c * c) / h) * ((a / h) * (b / h) + 1.0)
    }

    /// Angle φ_H of the contact point from the minor axis, about the axis of rotation.
    pub fn contact_angle_from_minor_rad(&self, contact: &CamContact) -> f64 {
        let (a, b) = (self.semi_major_mm, self.semi_minor_mm);
        // The point is (a² cos φ, b² sin φ)/h.
        (a * (a * contact.normal_cos)).atan2(b * (b * contact.normal_sin))
    }

    /// The contact point in the wave generator's frame.
    pub fn point(&self, contact: &CamContact) -> Point2<f64> {
        let (a, b, h) = (self.semi_major_mm, self.semi_minor_mm, contact.support_mm);
        Point2::new(a * (a / h) * contact.normal_cos, b * (b / h) * contact.normal_sin)
    }

    /// The tangent at the contact, counter-clockwise.
    pub fn tangent(&self, contact: &CamContact) -> Unit<Vector2<f64>> {
        Unit::new_unchecked(Vector2::new(-contact.normal_sin, contact.normal_cos))
    }
}
