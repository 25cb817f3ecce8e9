//! Distance of neighbouring teeth, which must not touch.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

use crate::cam::{Cam, Ellipse};
use crate::position::{Position, half_lobe_rad};
use crate::root::{NotConverged, bracketed, golden_section};
use crate::violation::{FieldCode, Parameter, Violation};

/// Neighbouring teeth on their path.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbours {
    pub(super) cam: Cam,
    pub(super) installed: i64,
}

impl Neighbours {
    /// Returns half the angle between neighbouring slots.
    pub(super) fn half_spacing_rad(&self) -> f64 {
        PI / self.installed as f64
    }

    /// Returns the tooth radius below which neighbouring teeth cannot touch. It follows from the least centre radius,
    /// in the valley. This bound settles nearly every drive.
    fn surely_free_radius_mm(&self) -> f64 {
        self.cam.kind().surely_free_radius_mm(self.half_spacing_rad().sin())
    }

    /// Returns a violation if neighbouring teeth touch.
    pub(super) fn violation(&self) -> Result<Option<Violation>, NotConverged> {
        let tooth_radius_mm = self.cam.kind().tooth_radius_mm();
        if tooth_radius_mm < self.surely_free_radius_mm() {
            return Ok(None);
        }
        let center_distance_mm = self.least_center_distance_mm()?;
        let tooth_diameter_mm = 2.0 * tooth_radius_mm;
        if center_distance_mm > tooth_diameter_mm {
            return Ok(None);
        }
        let limit_mm = self.touching_radius_mm(center_distance_mm)?;
        let detail = format!(
            "neighbouring teeth of {tooth_diameter_mm:?} mm diameter come as near as {center_distance_mm:?} mm from centre to centre: choose a radius below {limit_mm:?} mm, install fewer, or enlarge the wave generator"
        );
        let (code, parameter) = (FieldCode::TeethTouch, Parameter::ToothRadius);
        Ok(Some(Violation::new(code, parameter, tooth_radius_mm, limit_mm, detail)))
    }

    /// Returns the least distance of two neighbouring centres on their path (docs/explanation/theory.md section 7). On
    /// an ellipse it is that of the pair across the minor axis. With two or three teeth, which are more than a right
    /// angle apart, the pair across the major axis is closer to the minor axis.
    pub(super) fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        if !matches!(self.cam, Cam::Ellipse(_)) {
            return self.least_scanned_distance_mm();
        }
        let half_rad = self.half_spacing_rad();
        let nearest = Position::from_valley(half_rad.min(FRAC_PI_2 - half_rad), 2);
        Ok(2.0 * half_rad.sin() * self.cam.kind().at(nearest)?.center_radius_mm)
    }

    /// Returns the least distance of two neighbouring centres around any cam. It scans the middle of the pair, then
    /// runs a golden-section search around the least value. The scan includes the pair across the valley.
    fn least_scanned_distance_mm(&self) -> Result<f64, NotConverged> {
        const SCAN: u32 = 96;
        let half = self.half_spacing_rad();
        let distance = |middle_rad: f64| -> Result<f64, NotConverged> {
            let before = self.cam.kind().center_radius_at_mm(middle_rad - half)?;
            let after = self.cam.kind().center_radius_at_mm(middle_rad + half)?;
            Ok((before - after).hypot(2.0 * half.sin() * (before * after).sqrt()))
        };
        let valley_rad = half_lobe_rad(self.cam.kind().lobes());
        let step = valley_rad / f64::from(SCAN);
        let mut best = (valley_rad, distance(valley_rad)?);
        for i in 0..SCAN {
            let middle = f64::from(i) * step;
            let value = distance(middle)?;
            if value < best.1 {
                best = (middle, value);
            }
        }
        // Forty steps shrink the bracket by 4e-9, which gives the minimum to all digits.
        let (least, _) = golden_section(best.0 - step, best.0 + step, 40, distance)?;
        Ok(best.1.min(least))
    }

    /// Returns the radius, at most that of the teeth, at which neighbours begin to touch. Centres of thicker teeth are
    /// farther out, but by less than the increase in thickness, so the gap falls with the radius. The unknown is the
    /// radius's logarithm, because radii range over twelve decades. If the path itself is given, it is the same for all
    /// radii, and the result is half the least distance.
    fn touching_radius_mm(&self, center_distance_mm: f64) -> Result<f64, NotConverged> {
        match &self.cam {
            Cam::Ellipse(cam) if self.installed > 3 => return self.touching_radius_of_ellipse_mm(cam),
            cam if cam.kind().is_path() => return Ok(0.5 * center_distance_mm),
            _ => {}
        }
        let free_mm = 0.5 * self.surely_free_radius_mm();
        let at = |exponent: f64| Self { cam: self.cam.with_tooth_radius(free_mm * exponent.exp()), ..*self };
        let gap_mm = |exponent: f64| {
            let thinner = at(exponent);
            Ok(thinner.least_center_distance_mm()? - 2.0 * thinner.cam.kind().tooth_radius_mm())
        };
        let most = (self.cam.kind().tooth_radius_mm() / free_mm).ln();
        let exponent = bracketed("radius at which teeth touch", 0.0, gap_mm(0.0)?, most, gap_mm)?;
        Ok(at(exponent).cam.kind().tooth_radius_mm())
    }

    /// Returns, for an ellipse and four teeth or more, the radius at which the two teeth across the minor axis touch.
    ///
    /// Both touch the minor axis then. Their centres are at `(r, r cot μ)`, with μ half the spacing, and on the path of
    /// section 2.2. With `a² cos φ/h = r (1 - cos φ)` and `b² sin φ/h = r (cot μ - sin φ)` the normal's angle is the
    /// one root of `a² cos φ (cot μ - sin φ) = b² sin φ (1 - cos φ)` above 45°.
    fn touching_radius_of_ellipse_mm(&self, cam: &Ellipse) -> Result<f64, NotConverged> {
        let (a, b) = (cam.semi_major_mm, cam.semi_minor_mm);
        let half_rad = self.half_spacing_rad();
        // cot μ - 1 and, below, 1 - sin φ and 1 - cos φ, without a difference of nearly equal values.
        let beyond_one =
            SQRT_2 * (PI * (self.installed - 4) as f64 / (4 * self.installed) as f64).sin() / half_rad.sin();
        let flattening_squared = (b / a) * (b / a);
        // The unknown is the logarithm of tan φ. Tan φ ranges from 1 to about (a/b)² cot μ.
        let direction = |logarithm: f64| {
            let tan = logarithm.exp();
            let cos = 1.0 / (1.0 + tan * tan).sqrt();
            (cos, tan * cos)
        };
        let condition = |logarithm: f64| {
            let (cos, sin) = direction(logarithm);
            let off_axis = beyond_one + cos * cos / (1.0 + sin);
            Ok(cos * off_axis * (1.0 + cos) - flattening_squared * sin * sin * sin)
        };
        let most = (2.0 * (beyond_one + 1.0) / flattening_squared).ln() + 1.0;
        let logarithm = bracketed("radius at which teeth touch", -1.0, condition(-1.0)?, most, condition)?;
        let (cos, sin) = direction(logarithm);
        let support_mm = (a * cos).hypot(b * sin);
        Ok(a * (a / support_mm) * cos * (1.0 + cos) / (sin * sin))
    }
}
