//! Path of a tooth's centre over its position ψ (docs/explanation/theory.md section 2).

use crate::cam::{Cam, CurvePoint, ToothCenter};
use crate::position::{Position, half_lobe_rad};
use crate::root::NotConverged;

/// Path of the tooth centres around the wave generator: the outer parallel curve of the cam at the tooth radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Locus {
    cam: Cam,
    tooth_radius_mm: f64,
}

impl Locus {
    pub(crate) const fn new(cam: Cam, tooth_radius_mm: f64) -> Self {
        Self { cam, tooth_radius_mm }
    }

    /// Returns the wave generator.
    pub const fn cam(&self) -> &Cam {
        &self.cam
    }

    /// Returns `r`.
    pub const fn tooth_radius_mm(&self) -> f64 {
        self.tooth_radius_mm
    }

    /// Returns `U`.
    pub fn lobes(&self) -> u32 {
        self.cam.kind().lobes()
    }

    /// Returns the tooth whose centre is at `position`.
    ///
    /// # Errors
    /// [`NotConverged`] if its contact with the cam is not found.
    pub fn at(&self, position: Position) -> Result<ToothCenter, NotConverged> {
        self.cam.kind().tooth(self.tooth_radius_mm, position)
    }

    /// Returns the tooth with the largest pressure angle at the wave generator.
    ///
    /// # Errors
    /// [`NotConverged`] if its position is not found.
    pub fn steepest(&self) -> Result<ToothCenter, NotConverged> {
        self.cam.kind().steepest(self.tooth_radius_mm)
    }

    /// Returns the cam's largest distance from the axis: `a` for an ellipse.
    pub fn cam_outer_radius_mm(&self) -> f64 {
        self.cam.kind().outer_radius_mm(self.tooth_radius_mm)
    }

    /// Returns the cam's least distance from the axis: `b` for an ellipse.
    pub fn cam_inner_radius_mm(&self) -> f64 {
        self.cam.kind().inner_radius_mm(self.tooth_radius_mm)
    }

    /// Returns the inward offset of the cam at which it gets a cusp or reaches the axis.
    pub(crate) fn greatest_set_back_mm(&self) -> f64 {
        self.cam.kind().least_curvature_radius_mm(self.tooth_radius_mm).min(self.cam_inner_radius_mm())
    }

    /// Returns the angle φ_H of a tooth's contact point on the cam from the valley, about the axis of rotation.
    pub fn contact_angle_from_valley_rad(&self, tooth: &ToothCenter) -> f64 {
        self.cam.kind().contact_angle_from_valley_rad(self.tooth_radius_mm, tooth)
    }

    /// Returns the cam's outline, offset inward along its normal, at a place between the lobe and the valley. Both ends
    /// are exact.
    pub(crate) fn cam_outline(&self, set_back_mm: f64, place: Position) -> Result<CurvePoint, NotConverged> {
        self.cam.kind().outline(self.tooth_radius_mm, set_back_mm, place)
    }

    /// Returns `d` at any angle from a lobe.
    pub(crate) fn center_radius_at_mm(&self, angle_rad: f64) -> Result<f64, NotConverged> {
        let (lobes, half_rad) = (self.lobes(), half_lobe_rad(self.lobes()));
        let pitch_rad = 2.0 * half_rad;
        let folded = angle_rad.rem_euclid(pitch_rad);
        let position = if folded > 0.5 * half_rad && folded < 1.5 * half_rad {
            Position::from_valley((folded - half_rad).abs(), lobes)
        } else {
            Position::from_lobe(folded.min(pitch_rad - folded), lobes)
        };
        self.cam.kind().center_radius_mm(self.tooth_radius_mm, position)
    }
}
