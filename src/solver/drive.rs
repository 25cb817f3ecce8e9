//! A drive whose parameters were checked once, so that nothing below doubts its input.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::cam::Cam;
use crate::locus::{Locus, ToothCenter};
use crate::position::Position;
use crate::ring::{FlankLimit, RingFlank, RingTooth};
use crate::root::NotConverged;
use crate::violation::{Parameter, Violation};

/// Waves of the cam: an ellipse has two.
pub const WAVES: f64 = 2.0;

/// What describes a drive (docs/theory.md section 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveParameters {
    /// `a`: semi-major axis of the wave generator.
    pub semi_major_mm: f64,
    /// `b`: semi-minor axis of the wave generator.
    pub semi_minor_mm: f64,
    /// `Z_G`: teeth in theory.
    pub teeth: i64,
    /// `Z'_G`: installed teeth; only they have a slot.
    pub installed: i64,
    /// `r`: radius of a tooth.
    pub tooth_radius_mm: f64,
    /// `L1`: width of a tooth along the axis.
    pub tooth_width_mm: f64,
    /// `Z_K`: teeth of the ring.
    pub ring_teeth: i64,
    /// Radius of a bore that truncates the ring's teeth.
    pub tip_radius_mm: Option<f64>,
}

/// A drive that can exist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    parameters: DriveParameters,
    ring: RingTooth,
}

/// Why there is no [`Drive`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// Every impossible value.
    #[error("the drive cannot exist")]
    Impossible(Vec<Violation>),
    /// A geometric iteration hit its cap.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
}

impl Drive {
    /// Checks the parameters.
    ///
    /// # Errors
    /// Every reason why the drive cannot exist; those that need sound values (teeth that touch, no annulus, no flank)
    /// are looked for when the values themselves are sound.
    pub fn new(parameters: &DriveParameters) -> Result<Self, DriveError> {
        let (mut violations, sound) = violations_of_values(parameters);
        if !sound {
            return Err(DriveError::Impossible(violations));
        }
        let p = *parameters;
        let locus = Locus::new(Cam::new(p.semi_major_mm, p.semi_minor_mm), p.tooth_radius_mm);
        let flank = RingFlank::new(locus, p.ring_teeth as f64 / WAVES);
        let drive = Self { parameters: p, ring: RingTooth::new(flank, p.tip_radius_mm)? };
        if drive.tip_radius_mm() <= p.semi_major_mm {
            violations.push(Violation::NoCarrierAnnulus {
                semi_major_mm: p.semi_major_mm,
                tip_radius_mm: drive.tip_radius_mm(),
            });
        }
        if !drive.neighbours_are_apart_everywhere() {
            let center_distance_mm = drive.least_center_distance_mm()?;
            let tooth_diameter_mm = 2.0 * p.tooth_radius_mm;
            if center_distance_mm <= tooth_diameter_mm {
                violations.push(Violation::TeethTouch { tooth_diameter_mm, center_distance_mm });
            }
        }
        if violations.is_empty() { Ok(drive) } else { Err(DriveError::Impossible(violations)) }
    }

    /// The parameters, as given.
    pub const fn parameters(&self) -> &DriveParameters {
        &self.parameters
    }

    /// The ring's flank; through it the path of the teeth and the wave generator.
    pub const fn flank(&self) -> &RingFlank {
        &self.ring.flank
    }

    /// One tooth of the ring.
    pub const fn ring_tooth(&self) -> &RingTooth {
        &self.ring
    }

    /// Where and why the flank ends towards the tip.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.ring.limit
    }

    /// `s = sign(Z_G - Z_K)`.
    pub const fn sense(&self) -> f64 {
        if self.parameters.teeth > self.parameters.ring_teeth { 1.0 } else { -1.0 }
    }

    /// `Z_G / U`: carrier torque over input torque.
    pub fn teeth_per_wave(&self) -> f64 {
        self.parameters.teeth as f64 / WAVES
    }

    /// `i_HG = Z_G/(Z_G - Z_K)`: input speed over carrier speed, ring fixed.
    pub fn transmission_ratio(&self) -> f64 {
        self.sense() * self.teeth_per_wave()
    }

    /// `i_HK = -Z_K/(Z_G - Z_K)`: input speed over ring speed, carrier fixed.
    pub fn transmission_ratio_carrier_fixed(&self) -> f64 {
        -self.sense() * self.ring.flank.teeth_per_wave()
    }

    /// Radius of the ring at the middle of its tooth space, `a + 2r`.
    pub fn root_radius_mm(&self) -> f64 {
        self.ring.flank.root_radius_mm()
    }

    /// Radius of the ring's tips before any bore.
    pub const fn natural_tip_radius_mm(&self) -> f64 {
        self.ring.natural_tip_radius_mm
    }

    /// Radius of the ring's tips: natural, trimmed by undercut, or bored.
    pub const fn tip_radius_mm(&self) -> f64 {
        self.ring.tip_radius_mm
    }

    /// The engaged tooth with the largest pressure angles: at the steepest place of the path, or where the flank ends
    /// before it.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn steepest_engaged(&self) -> Result<ToothCenter, NotConverged> {
        let locus = self.ring.flank.locus();
        let steepest = locus.steepest()?;
        if steepest.position.from_minor_rad >= self.ring.limit.position.from_minor_rad {
            Ok(steepest)
        } else {
            locus.at(self.ring.limit.position)
        }
    }

    /// Half the angle between neighbouring slots.
    fn half_spacing_rad(&self) -> f64 {
        PI / self.parameters.installed as f64
    }

    /// A bound that settles nearly every drive: no centre comes nearer to the axis than `b + r`.
    fn neighbours_are_apart_everywhere(&self) -> bool {
        let p = &self.parameters;
        (p.semi_minor_mm + p.tooth_radius_mm) * self.half_spacing_rad().sin() > p.tooth_radius_mm
    }

    /// Least distance of two neighbouring centres on their path (docs/theory.md section 7): over the middle of the pair a scan,
    /// then a golden-section search around its least value. The pair that straddles the minor axis is one of the scan.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        const SCAN: u32 = 96;
        let half = self.half_spacing_rad();
        let distance = |middle_rad: f64| -> Result<f64, NotConverged> {
            let before = self.center_radius_at_mm(middle_rad - half)?;
            let after = self.center_radius_at_mm(middle_rad + half)?;
            Ok((before - after).hypot(2.0 * half.sin() * (before * after).sqrt()))
        };
        let step = FRAC_PI_2 / f64::from(SCAN);
        let mut best = (FRAC_PI_2, distance(FRAC_PI_2)?);
        for i in 0..SCAN {
            let middle = f64::from(i) * step;
            let value = distance(middle)?;
            if value < best.1 {
                best = (middle, value);
            }
        }
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (best.0 - step, best.0 + step);
        // Forty steps shrink the bracket by 4e-9: a minimum is then known to all digits.
        for _ in 0..40 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            let (at_left, at_right) = (distance(left)?, distance(right)?);
            best.1 = best.1.min(at_left).min(at_right);
            if at_left < at_right { high = right } else { low = left }
        }
        Ok(best.1)
    }

    /// `d` at any angle from the major axis.
    pub(crate) fn center_radius_at_mm(&self, angle_rad: f64) -> Result<f64, NotConverged> {
        let folded = angle_rad.rem_euclid(PI);
        let position = if folded > 0.5 * FRAC_PI_2 && folded < 1.5 * FRAC_PI_2 {
            Position::from_minor((folded - FRAC_PI_2).abs())
        } else {
            Position::from_major(folded.min(PI - folded))
        };
        Ok(self.ring.flank.locus().at(position)?.center_radius_mm)
    }

    /// Thickness of the wall between two neighbouring slots where it is thinnest, at the carrier's inner edge on
    /// the circle of radius `a`: `2 (√(a² - r²) sin(π/Z'_G) - r cos(π/Z'_G))`; not positive where the slots run into each other there.
    pub fn slot_wall_mm(&self) -> f64 {
        let p = &self.parameters;
        let (a, r) = (p.semi_major_mm, p.tooth_radius_mm);
        let (sin, cos) = self.half_spacing_rad().sin_cos();
        2.0 * (((a - r) * (a + r)).max(0.0).sqrt() * sin - r * cos)
    }
}

/// What can be said of the values before any geometry, and whether they are sound enough for it.
fn violations_of_values(p: &DriveParameters) -> (Vec<Violation>, bool) {
    let mut violations = Vec::new();
    let mut check = |parameter: Parameter, value: f64| {
        let violation = parameter.check(value);
        violations.extend(violation);
        violation.is_none()
    };
    let major = check(Parameter::SemiMajor, p.semi_major_mm);
    let minor = check(Parameter::SemiMinor, p.semi_minor_mm);
    let teeth = check(Parameter::ToothCount, p.teeth as f64);
    let installed = check(Parameter::InstalledTeeth, p.installed as f64);
    let radius = check(Parameter::ToothRadius, p.tooth_radius_mm);
    let width = check(Parameter::ToothWidth, p.tooth_width_mm);
    let ring = check(Parameter::RingTeeth, p.ring_teeth as f64);
    let bore = p.tip_radius_mm.filter(|&bore| check(Parameter::TipRadius, bore));
    if major && minor && p.semi_major_mm <= p.semi_minor_mm {
        violations.push(Violation::CamNotElongated { semi_major_mm: p.semi_major_mm, semi_minor_mm: p.semi_minor_mm });
    }
    if teeth && ring && (p.teeth - p.ring_teeth).abs() != 2 {
        violations.push(Violation::ToothDifference { teeth: p.teeth, ring_teeth: p.ring_teeth });
    }
    if installed && p.installed % 2 != 0 {
        violations.push(Violation::InstalledOdd { installed: p.installed });
    }
    if installed && teeth && p.teeth % p.installed != 0 {
        violations.push(Violation::InstalledNoDivisor { installed: p.installed, teeth: p.teeth });
    }
    let root_radius_mm = p.semi_major_mm + 2.0 * p.tooth_radius_mm;
    if let Some(tip_radius_mm) = bore.filter(|&bore| major && radius && bore >= root_radius_mm) {
        violations.push(Violation::BoreLeavesNoFlank { tip_radius_mm, root_radius_mm });
    }
    // The width of the teeth is the one value that no geometry needs.
    let sound = violations.len() == usize::from(!width);
    (violations, sound)
}
