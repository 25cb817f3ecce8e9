//! A drive whose parameters were checked once, so that nothing below doubts its input.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::cam::Cam;
use crate::locus::{Locus, ToothCenter};
use crate::ring::{FlankLimit, RingFlank, RingTooth};
use crate::root::{NotConverged, bracketed};
use crate::violation::{Alternatives, Parameter, Violation};

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
    /// Every reason why the drive cannot exist.
    pub fn new(parameters: &DriveParameters) -> Result<Self, DriveError> {
        let draft = Draft::new(parameters)?;
        draft.drive().ok_or(DriveError::Impossible(draft.violations))
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
        self.ring.steepest_engaged()
    }

    const fn neighbours(&self) -> Neighbours {
        Neighbours { locus: *self.ring.flank.locus(), installed: self.parameters.installed }
    }

    /// Least distance of two neighbouring centres on their path.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        self.neighbours().least_center_distance_mm()
    }

    /// `d` at any angle from the major axis.
    pub(crate) fn center_radius_at_mm(&self, angle_rad: f64) -> Result<f64, NotConverged> {
        self.ring.flank.locus().center_radius_at_mm(angle_rad)
    }

    /// Thickness of the wall between two neighbouring slots where it is thinnest, at the carrier's inner edge on
    /// the circle of radius `a`: `2 (√(a² - r²) sin(π/Z'_G) - r cos(π/Z'_G))`; not positive where the slots run into each other there.
    pub fn slot_wall_mm(&self) -> f64 {
        let p = &self.parameters;
        let (a, r) = (p.semi_major_mm, p.tooth_radius_mm);
        let (sin, cos) = self.neighbours().half_spacing_rad().sin_cos();
        2.0 * (((a - r) * (a + r)).max(0.0).sqrt() * sin - r * cos)
    }
}

/// Parameters of which some may be impossible. Whatever can be checked is checked as soon as the values that it itself needs are possible:
/// one impossible value hides no other.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    parameters: DriveParameters,
    violations: Vec<Violation>,
    pub(crate) semi_major_mm: Option<f64>,
    pub(crate) semi_minor_mm: Option<f64>,
    pub(crate) installed: Option<i64>,
    pub(crate) tooth_radius_mm: Option<f64>,
    pub(crate) cam: Option<Cam>,
    /// `s`, where carrier and ring differ by two teeth.
    pub(crate) sense: Option<f64>,
    pub(crate) ring: Option<RingTooth>,
}

impl Draft {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`NotConverged`] from the geometry.
    pub fn new(parameters: &DriveParameters) -> Result<Self, NotConverged> {
        let p = *parameters;
        let mut violations = Vec::new();
        let mut is_in_range = |parameter: Parameter, value: f64| {
            let violation = parameter.check(value);
            violations.extend(violation);
            violation.is_none()
        };
        let semi_major_mm = is_in_range(Parameter::SemiMajor, p.semi_major_mm).then_some(p.semi_major_mm);
        let semi_minor_mm = is_in_range(Parameter::SemiMinor, p.semi_minor_mm).then_some(p.semi_minor_mm);
        let teeth = is_in_range(Parameter::ToothCount, p.teeth as f64).then_some(p.teeth);
        let installed = is_in_range(Parameter::InstalledTeeth, p.installed as f64).then_some(p.installed);
        let tooth_radius_mm = is_in_range(Parameter::ToothRadius, p.tooth_radius_mm).then_some(p.tooth_radius_mm);
        is_in_range(Parameter::ToothWidth, p.tooth_width_mm);
        let ring_teeth = is_in_range(Parameter::RingTeeth, p.ring_teeth as f64).then_some(p.ring_teeth);
        let mut bore_is_possible = p.tip_radius_mm.is_none_or(|bore| is_in_range(Parameter::TipRadius, bore));

        let mut cam = None;
        if let Some((semi_major_mm, semi_minor_mm)) = semi_major_mm.zip(semi_minor_mm) {
            if semi_major_mm > semi_minor_mm {
                cam = Some(Cam::new(semi_major_mm, semi_minor_mm));
            } else {
                violations.push(Violation::CamNotElongated { semi_major_mm, semi_minor_mm });
            }
        }
        let mut sense = None;
        if let Some((teeth, ring_teeth)) = teeth.zip(ring_teeth) {
            match teeth - ring_teeth {
                2 => sense = Some(1.0),
                -2 => sense = Some(-1.0),
                _ => {
                    let instead = Alternatives::to_ring_beside(teeth);
                    violations.push(Violation::ToothDifference { teeth, ring_teeth, instead });
                }
            }
        }
        violations.extend(violations_of_counts(teeth, installed));
        if let Some(((semi_major_mm, tooth_radius_mm), tip_radius_mm)) =
            semi_major_mm.zip(tooth_radius_mm).zip(p.tip_radius_mm.filter(|_| bore_is_possible))
        {
            let root_radius_mm = semi_major_mm + 2.0 * tooth_radius_mm;
            if tip_radius_mm >= root_radius_mm {
                violations.push(Violation::BoreLeavesNoFlank { tip_radius_mm, root_radius_mm });
                bore_is_possible = false;
            }
        }

        let locus = cam.zip(tooth_radius_mm).map(|(cam, tooth_radius_mm)| Locus::new(cam, tooth_radius_mm));
        let ring = match locus.zip(ring_teeth).filter(|_| bore_is_possible) {
            Some((locus, ring_teeth)) => {
                Some(RingTooth::new(RingFlank::new(locus, ring_teeth as f64 / WAVES), p.tip_radius_mm)?)
            }
            None => None,
        };
        if let Some(RingTooth { tip_radius_mm, .. }) = ring
            && tip_radius_mm <= p.semi_major_mm
        {
            violations.push(Violation::NoCarrierAnnulus { semi_major_mm: p.semi_major_mm, tip_radius_mm });
        }
        if let Some((locus, installed)) = locus.zip(installed) {
            violations.extend(Neighbours { locus, installed }.violation()?);
        }
        Ok(Self {
            parameters: p,
            violations,
            semi_major_mm,
            semi_minor_mm,
            installed,
            tooth_radius_mm,
            cam,
            sense,
            ring,
        })
    }

    /// Every reason why the drive cannot exist.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// The drive, where it can exist.
    pub fn drive(&self) -> Option<Drive> {
        let ring = self.ring.filter(|_| self.violations.is_empty())?;
        Some(Drive { parameters: self.parameters, ring })
    }
}

/// What makes a number of teeth, or of installed ones among them, impossible.
fn violations_of_counts(teeth: Option<i64>, installed: Option<i64>) -> Vec<Violation> {
    let mut violations = Vec::new();
    let (even_teeth, odd_teeth) = (teeth.filter(|teeth| teeth % 2 == 0), teeth.filter(|teeth| teeth % 2 != 0));
    violations.extend(odd_teeth.map(|teeth| Violation::CountOdd { teeth, instead: Alternatives::to_odd(teeth) }));
    let Some(installed) = installed else { return violations };
    let divisors = even_teeth.map(|teeth| Alternatives::to_installed(installed, teeth));
    if installed % 2 != 0 {
        let instead = divisors.unwrap_or(Alternatives::to_odd(installed));
        violations.push(Violation::InstalledOdd { installed, instead });
    }
    if let Some((teeth, instead)) = even_teeth.zip(divisors).filter(|(teeth, _)| teeth % installed != 0) {
        violations.push(Violation::InstalledNoDivisor { installed, teeth, instead });
    }
    violations
}

/// Neighbouring teeth on their path.
#[derive(Debug, Clone, Copy)]
struct Neighbours {
    locus: Locus,
    installed: i64,
}

impl Neighbours {
    /// Half the angle between neighbouring slots.
    fn half_spacing_rad(&self) -> f64 {
        PI / self.installed as f64
    }

    /// The radius up to which teeth are apart, `b sin/(1 - sin)` of half the spacing, because no centre comes nearer to the axis than
    /// `b + r`. This bound settles nearly every drive.
    fn surely_free_radius_mm(&self) -> f64 {
        let sin = self.half_spacing_rad().sin();
        self.locus.cam().semi_minor_mm() * (sin / (1.0 - sin))
    }

    /// That they touch, where they do.
    fn violation(&self) -> Result<Option<Violation>, NotConverged> {
        let tooth_radius_mm = self.locus.tooth_radius_mm();
        if tooth_radius_mm < self.surely_free_radius_mm() {
            return Ok(None);
        }
        let center_distance_mm = self.least_center_distance_mm()?;
        let tooth_diameter_mm = 2.0 * tooth_radius_mm;
        if center_distance_mm > tooth_diameter_mm {
            return Ok(None);
        }
        let touching_radius_mm = self.touching_radius_mm()?;
        Ok(Some(Violation::TeethTouch { tooth_diameter_mm, center_distance_mm, touching_radius_mm }))
    }

    /// The radius, at most the one that the teeth have, at which they begin to touch: thicker teeth stand farther out, but by less than they
    /// are thicker, so that the gap falls with the radius. Its logarithm is what is solved for, because radii range over twelve decades.
    fn touching_radius_mm(&self) -> Result<f64, NotConverged> {
        let free_mm = 0.5 * self.surely_free_radius_mm();
        let at = |exponent: f64| Self { locus: Locus::new(*self.locus.cam(), free_mm * exponent.exp()), ..*self };
        let gap_mm = |exponent: f64| {
            let thinner = at(exponent);
            Ok(thinner.least_center_distance_mm()? - 2.0 * thinner.locus.tooth_radius_mm())
        };
        let most = (self.locus.tooth_radius_mm() / free_mm).ln();
        let exponent = bracketed("radius at which teeth touch", 0.0, gap_mm(0.0)?, most, gap_mm)?;
        Ok(at(exponent).locus.tooth_radius_mm())
    }

    /// Least distance of two neighbouring centres on their path (docs/theory.md section 7): over the middle of the pair a scan,
    /// then a golden-section search around its least value. The pair that straddles the minor axis is one of the scan.
    fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        const SCAN: u32 = 96;
        let half = self.half_spacing_rad();
        let distance = |middle_rad: f64| -> Result<f64, NotConverged> {
            let before = self.locus.center_radius_at_mm(middle_rad - half)?;
            let after = self.locus.center_radius_at_mm(middle_rad + half)?;
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
}
