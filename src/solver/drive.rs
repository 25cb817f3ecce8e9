//! A drive whose parameters were checked once, so that nothing below doubts its input.

use std::f64::consts::{PI, SQRT_2};

use crate::cam::Cam;
use crate::locus::{Locus, ToothCenter};
use crate::position::Position;
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

    /// Distance of the nearest two centres on their path (docs/theory.md section 7): those either side of the minor axis, and of two teeth
    /// alone those on it.
    fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        if self.installed == 2 {
            return Ok(2.0 * self.locus.at(Position::TIP)?.center_radius_mm);
        }
        let half_rad = self.half_spacing_rad();
        Ok(2.0 * half_rad.sin() * self.locus.at(Position::from_minor(half_rad))?.center_radius_mm)
    }

    /// The radius at which the two teeth either side of the minor axis touch it, and so each other. There are four teeth or more.
    ///
    /// Their centres then stand at `(r, r cot μ)`, μ half the spacing, and on the path of section 2.2: with `a² cos φ/h = r (1 - cos φ)` and
    /// `b² sin φ/h = r (cot μ - sin φ)` the normal's angle is the one root of `a² cos φ (cot μ - sin φ) = b² sin φ (1 - cos φ)`, beyond 45°.
    fn touching_radius_mm(&self) -> Result<f64, NotConverged> {
        let (a, b) = (self.locus.cam().semi_major_mm(), self.locus.cam().semi_minor_mm());
        let half_rad = self.half_spacing_rad();
        // cot μ - 1 and, below, 1 - sin φ and 1 - cos φ, without a difference of near values.
        let beyond_one =
            SQRT_2 * (PI * (self.installed - 4) as f64 / (4 * self.installed) as f64).sin() / half_rad.sin();
        let flattening_squared = (b / a) * (b / a);
        // In the logarithm of tan φ, which reaches from 1 to some (a/b)² cot μ.
        let direction = |logarithm: f64| {
            let tan = logarithm.exp();
            let cos = 1.0 / tan.hypot(1.0);
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
        Ok(a * (a / (a * cos).hypot(b * sin)) * cos * (1.0 + cos) / (sin * sin))
    }
}
