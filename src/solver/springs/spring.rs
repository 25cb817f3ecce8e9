//! Spring of one tooth: the force along `F_H` that a rotation of the wave generator makes.

use super::NOTHING_MM;
use crate::approach::Approach;
use crate::root::{NotConverged, ValueAndSlope};

/// A tooth in load sharing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// `|h'|` with the gaps closed: displacement along `F_H` for each radian of the wave generator, and torque at the
    /// wave generator for each newton of `F_H`.
    pub arm_mm: f64,
    /// Decrease of the arm for each further radian of the wave generator; 0 if lever arms do not vary with wind-up.
    pub arm_decline_mm_per_rad: f64,
    /// Rotation of the wave generator until the gaps at this tooth are closed, `g/|h'|`; infinite if they never close.
    /// Lost motion common to all teeth may be excluded; the rest may be negative.
    pub closing_rad: f64,
    /// Approach of the tooth under `F_H`.
    pub approach: Approach,
}

/// Gap to close before a tooth carries. The wave generator first takes up the lost motion, then the distance with the
/// arm that is left.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// Distance along `F_H`.
    pub(crate) along_mm: f64,
    /// Lost motion, as a rotation of the wave generator.
    pub(crate) lost_motion_rad: f64,
}

impl Gap {
    /// Returns the rotation of the wave generator that closes the gap of a tooth whose arm applies after this common
    /// lost motion, and the arm at that point.
    fn closing(&self, arm_mm: f64, usual_rad: f64, arm_decline_mm_per_rad: f64) -> (f64, f64) {
        // If the common lost motion exceeds the gap, the rotation is negative, at most back to where a growing arm
        // begins.
        let begin_rad = |arm_mm: f64| {
            if arm_decline_mm_per_rad < 0.0 { arm_mm / arm_decline_mm_per_rad } else { f64::NEG_INFINITY }
        };
        let lost_motion_rad = self.lost_motion_rad.max(usual_rad + begin_rad(arm_mm));
        let arm_mm = (arm_mm - arm_decline_mm_per_rad * (lost_motion_rad - usual_rad)).max(0.0);
        let has_ended = arm_mm == 0.0 && arm_decline_mm_per_rad >= 0.0;
        let way_rad = turned_rad(arm_mm, arm_decline_mm_per_rad, self.along_mm).max(begin_rad(arm_mm));
        if has_ended || self.along_mm == f64::INFINITY || way_rad == f64::INFINITY {
            return (f64::INFINITY, arm_mm);
        }
        (lost_motion_rad + way_rad, arm_mm - arm_decline_mm_per_rad * way_rad)
    }
}

impl Spring {
    /// Builds the spring of a tooth with a gap (or none). The arm applies after the common lost motion. A tooth without
    /// an arm never closes a gap, unless the arm grows with the rotation. A tooth whose arm becomes zero first does not
    /// close it either.
    pub(crate) fn new(
        arm_mm: f64,
        usual_rad: f64,
        arm_decline_mm_per_rad: f64,
        gap: Option<Gap>,
        approach: Approach,
    ) -> Self {
        let (closing_rad, arm_mm) =
            gap.map_or((0.0, arm_mm), |gap| gap.closing(arm_mm, usual_rad, arm_decline_mm_per_rad));
        Self { arm_mm, arm_decline_mm_per_rad, closing_rad, approach }
    }

    /// Returns the rotation beyond the closing angle without loss of digits; negative while a gap is open.
    fn closed_rad(&self, wind_up: &Rotation) -> f64 {
        wind_up.excess_rad - (self.closing_rad - wind_up.closing_rad)
    }

    /// Returns `(Δφ - θ) (|h'| - c (Δφ - θ)/2)` beyond the closing angle θ, with c the decline of the arm there; 0
    /// before.
    pub fn displacement_mm(&self, wind_up: &Rotation) -> f64 {
        let closed_rad = self.closed_rad(wind_up);
        let displacement_mm = closed_rad * (self.arm_mm - 0.5 * self.arm_decline_mm_per_rad * closed_rad);
        if closed_rad > 0.0 && displacement_mm > NOTHING_MM { displacement_mm } else { 0.0 }
    }

    /// Returns the rotation beyond the closing angle at a displacement; infinite if it is never reached.
    pub(crate) fn excess_rad(&self, displacement_mm: f64) -> f64 {
        if self.arm_decline_mm_per_rad == 0.0 {
            return displacement_mm / self.arm_mm;
        }
        turned_rad(self.arm_mm, self.arm_decline_mm_per_rad, displacement_mm)
    }

    /// Returns the arm at a rotation. A gap that never closes leaves the unloaded arm.
    pub fn turned_arm_mm(&self, wind_up: &Rotation) -> f64 {
        if self.closing_rad.is_finite() {
            self.arm_mm - self.arm_decline_mm_per_rad * self.closed_rad(wind_up)
        } else {
            self.arm_mm
        }
    }

    /// Returns `F_H`; 0 while a gap is open.
    ///
    /// # Errors
    /// [`NotConverged`] from the law's inverse.
    pub fn force_n(&self, wind_up: &Rotation) -> Result<f64, NotConverged> {
        let displacement_mm = self.displacement_mm(wind_up);
        if displacement_mm > 0.0 { Ok(self.approach.force(displacement_mm)?.force_n) } else { Ok(0.0) }
    }

    /// Returns the force under a displacement, and its derivative.
    pub(super) fn force_and_stiffness(&self, displacement_mm: f64) -> Result<ValueAndSlope, NotConverged> {
        if displacement_mm <= 0.0 {
            return Ok(ValueAndSlope { value: 0.0, slope: 0.0 });
        }
        let force = self.approach.force(displacement_mm)?;
        Ok(ValueAndSlope { value: force.force_n, slope: force.force_n / (displacement_mm * force.exponent) })
    }

    /// Returns true if the spring's torque certainly grows up to a rotation, or is zero. Its slope
    /// `h'² dF_H/dξ - c F_H` is not negative if `h'² ≥ c ξ`, because the force grows faster than the displacement. Once
    /// that fails, it fails for larger rotations too.
    pub(super) fn helps_up_to(&self, rotation: &Rotation) -> bool {
        if !self.can_carry() || self.closing_rad - rotation.closing_rad >= rotation.excess_rad {
            return true;
        }
        let arm_mm = self.turned_arm_mm(rotation);
        arm_mm > 0.0 && arm_mm * arm_mm >= self.arm_decline_mm_per_rad * self.displacement_mm(rotation)
    }

    pub(super) const fn has_arm(&self) -> bool {
        self.arm_mm > 0.0
    }

    /// Returns true if some rotation makes the spring carry a torque.
    pub(crate) const fn can_carry(&self) -> bool {
        (self.has_arm() || self.arm_decline_mm_per_rad < 0.0) && self.closing_rad.is_finite()
    }
}

/// Returns the rotation for a displacement along `F_H` with a declining arm, `Δφ |h'| - c Δφ²/2`; infinite if the arm
/// ends before.
fn turned_rad(arm_mm: f64, arm_decline_mm_per_rad: f64, way_mm: f64) -> f64 {
    // Also if the initial arm is zero.
    if way_mm == 0.0 {
        return 0.0;
    }
    let square_mm2 = arm_mm * arm_mm - 2.0 * arm_decline_mm_per_rad * way_mm;
    if square_mm2 < 0.0 && way_mm > 0.0 {
        return f64::INFINITY;
    }
    2.0 * way_mm / (arm_mm + square_mm2.max(0.0).sqrt())
}

impl AsRef<Self> for Spring {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// `Δφ` in two parts. Under a light load the rotation beyond the last closing angle is small relative to the
/// clearances, but determines the forces. A single number would lose its digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Closing angle of the last tooth that carries.
    pub closing_rad: f64,
    /// Rotation beyond that, not negative. The displacement of every carrying tooth is then a sum of positive terms.
    pub excess_rad: f64,
}

impl Rotation {
    /// Returns `Δφ`.
    pub const fn rad(&self) -> f64 {
        self.closing_rad + self.excess_rad
    }
}
