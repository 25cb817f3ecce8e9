//! Drive with checked parameters, so that the functions below need not doubt their input.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

use crate::cam::{Cam, Ellipse, ToothCenter, WaveGenerator};
use crate::contact::PerContact;
use crate::locus::Locus;
use crate::position::{Position, half_lobe_rad};
use crate::ring::{FlankLimit, RingFlank, RingTooth};
use crate::root::{NotConverged, bracketed};
use crate::violation::{Alternatives, Parameter, Violation};

/// Parameters of a drive (docs/explanation/theory.md section 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveParameters {
    /// Wave generator, which pushes the teeth outward.
    pub wave_generator: WaveGenerator,
    /// `Z_G`: theoretical number of teeth.
    pub teeth: i64,
    /// `Z'_G`: number of installed teeth. Only they have a slot.
    pub installed: i64,
    /// `r`: radius of a tooth.
    pub tooth_radius_mm: f64,
    /// Shape of a tooth, in addition to its radius.
    pub tooth: ToothShape,
    /// `Z_K`: number of ring teeth.
    pub ring_teeth: i64,
    /// Radius of a bore that truncates the ring's teeth.
    pub tip_radius_mm: Option<f64>,
}

/// Shape of a tooth of radius `r` (docs/explanation/theory.md section 2.10).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToothShape {
    /// A cylinder along the axis.
    Cylinder {
        /// `L1`: width along the axis.
        width_mm: f64,
    },
    /// A ball, which runs in grooves if their radii are given.
    Ball {
        /// Radius of the groove in each part.
        groove_radius_mm: PerContact<Option<f64>>,
    },
    /// A cylinder with two flats, which lie on the walls of its slot.
    FlatSided {
        /// `L1`: width along the axis.
        width_mm: f64,
        /// `l`: length of a flat along the slot.
        flat_length_mm: f64,
    },
}

impl ToothShape {
    /// Returns the given values, each with the parameter that defines its range.
    pub(crate) fn parameters(&self) -> Vec<(Parameter, f64)> {
        match self {
            Self::Cylinder { width_mm } => vec![(Parameter::ToothWidth, *width_mm)],
            Self::Ball { groove_radius_mm } => groove_radius_mm
                .iter()
                .filter_map(|(contact, radius)| Some((Parameter::GrooveRadius(contact), (*radius)?)))
                .collect(),
            Self::FlatSided { width_mm, flat_length_mm } => {
                vec![(Parameter::ToothWidth, *width_mm), (Parameter::FlatLength, *flat_length_mm)]
            }
        }
    }

    /// Returns the reasons why no tooth of this radius has the shape. Values outside their ranges are skipped.
    fn violations(&self, tooth_radius_mm: f64) -> Vec<Violation> {
        match self {
            Self::Cylinder { .. } => Vec::new(),
            Self::Ball { groove_radius_mm } => groove_radius_mm
                .iter()
                .filter_map(|(contact, radius)| Some((contact, (*radius)?)))
                .filter(|&(contact, groove_radius_mm)| {
                    let is_in_range = Parameter::GrooveRadius(contact).check(groove_radius_mm).is_none();
                    is_in_range && groove_radius_mm <= tooth_radius_mm
                })
                .map(|(contact, groove_radius_mm)| Violation::GrooveTooTight {
                    contact,
                    groove_radius_mm,
                    tooth_radius_mm,
                })
                .collect(),
            Self::FlatSided { flat_length_mm, .. }
                if Parameter::FlatLength.check(*flat_length_mm).is_none()
                    && *flat_length_mm >= 2.0 * tooth_radius_mm =>
            {
                vec![Violation::FlatTooLong {
                    flat_length_mm: *flat_length_mm,
                    tooth_diameter_mm: 2.0 * tooth_radius_mm,
                }]
            }
            Self::FlatSided { .. } => Vec::new(),
        }
    }

    /// Returns half the tooth's width across the slot: `r`, between flats `√(r² - l²/4)`.
    pub fn half_width_in_slot_mm(&self, tooth_radius_mm: f64) -> f64 {
        match self {
            Self::Cylinder { .. } | Self::Ball { .. } => tooth_radius_mm,
            Self::FlatSided { flat_length_mm, .. } => {
                let half_mm = 0.5 * flat_length_mm;
                ((tooth_radius_mm - half_mm) * (tooth_radius_mm + half_mm)).sqrt()
            }
        }
    }
}

/// A drive that can exist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    parameters: DriveParameters,
    ring: RingTooth,
}

/// Reason why there is no [`Drive`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// All impossible values.
    #[error("the drive cannot exist")]
    Impossible(Vec<Violation>),
    /// A geometric iteration reached its limit of steps.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
}

impl Drive {
    /// Checks the parameters and builds the drive.
    ///
    /// # Errors
    /// Returns every reason why the drive cannot exist.
    pub fn new(parameters: &DriveParameters) -> Result<Self, DriveError> {
        let draft = Draft::new(parameters)?;
        draft.drive().ok_or(DriveError::Impossible(draft.violations))
    }

    /// The parameters, as given.
    pub const fn parameters(&self) -> &DriveParameters {
        &self.parameters
    }

    /// Returns `U`, the number of lobes of the wave generator.
    pub fn lobes(&self) -> u32 {
        self.ring.flank.locus().lobes()
    }

    /// Returns the extent of a tooth along the axis: `L1`, or a ball's diameter.
    pub fn tooth_width_mm(&self) -> f64 {
        match self.parameters.tooth {
            ToothShape::Cylinder { width_mm } | ToothShape::FlatSided { width_mm, .. } => width_mm,
            ToothShape::Ball { .. } => 2.0 * self.parameters.tooth_radius_mm,
        }
    }

    /// Returns half the width of a slot without clearance.
    pub fn slot_half_width_mm(&self) -> f64 {
        self.parameters.tooth.half_width_in_slot_mm(self.parameters.tooth_radius_mm)
    }

    /// Returns the cam's largest distance from the axis, which is the smallest possible inner radius of the carrier.
    pub fn cam_outer_radius_mm(&self) -> f64 {
        self.ring.flank.locus().cam_outer_radius_mm()
    }

    /// Returns the ring's flank, which contains the path of the teeth and the wave generator.
    pub const fn flank(&self) -> &RingFlank {
        &self.ring.flank
    }

    /// Returns one tooth of the ring.
    pub const fn ring_tooth(&self) -> &RingTooth {
        &self.ring
    }

    /// Returns the end of the flank towards the tip, and its cause.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.ring.limit
    }

    /// Returns `s = sign(Z_G - Z_K)`.
    pub const fn sense(&self) -> f64 {
        if self.parameters.teeth > self.parameters.ring_teeth { 1.0 } else { -1.0 }
    }

    /// Returns `Z_G / U`: carrier torque over input torque.
    pub fn teeth_per_wave(&self) -> f64 {
        self.parameters.teeth as f64 / f64::from(self.lobes())
    }

    /// Returns `i_HG = Z_G/(Z_G - Z_K)`: input speed over carrier speed, ring fixed.
    pub fn transmission_ratio(&self) -> f64 {
        self.sense() * self.teeth_per_wave()
    }

    /// Returns `i_HK = -Z_K/(Z_G - Z_K)`: input speed over ring speed, carrier fixed.
    pub fn transmission_ratio_carrier_fixed(&self) -> f64 {
        -self.sense() * self.ring.flank.teeth_per_wave()
    }

    /// Returns the radius of the ring at the middle of its tooth space, `d_l + r`.
    pub fn root_radius_mm(&self) -> f64 {
        self.ring.flank.root_radius_mm()
    }

    /// Returns the radius of the ring's tips before any bore.
    pub const fn natural_tip_radius_mm(&self) -> f64 {
        self.ring.natural_tip_radius_mm
    }

    /// Returns the radius of the ring's tips: natural, trimmed by undercut, or bored.
    pub const fn tip_radius_mm(&self) -> f64 {
        self.ring.tip_radius_mm
    }

    /// Returns the engaged tooth with the largest pressure angles. It is at the steepest point of the path, or at the
    /// end of the flank if that comes first.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn steepest_engaged(&self) -> Result<ToothCenter, NotConverged> {
        self.ring.steepest_engaged()
    }

    /// Returns the largest pressure angle β of the engaged flank.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn largest_pressure_angle_deg(&self) -> Result<f64, NotConverged> {
        Ok((self.steepest_engaged()?.tan_pressure_angle * self.flank().teeth_per_wave()).atan().to_degrees())
    }

    const fn neighbours(&self) -> Neighbours {
        Neighbours { locus: *self.ring.flank.locus(), installed: self.parameters.installed }
    }

    /// Returns the least distance of two neighbouring centres on their path.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        self.neighbours().least_center_distance_mm()
    }

    /// Returns `d` at any angle from a lobe.
    pub(crate) fn center_radius_at_mm(&self, angle_rad: f64) -> Result<f64, NotConverged> {
        self.ring.flank.locus().center_radius_at_mm(angle_rad)
    }

    /// Returns the least thickness of the wall between two neighbouring slots. It is at the carrier's inner edge, on
    /// the circle of the cam's outer radius `a`: `2 (√(a² - w²) sin(π/Z'_G) - w cos(π/Z'_G))`, with w half the slot's
    /// width. The result is not positive if the slots overlap there.
    pub fn slot_wall_mm(&self) -> f64 {
        let (a, r) = (self.cam_outer_radius_mm(), self.slot_half_width_mm());
        let (sin, cos) = self.neighbours().half_spacing_rad().sin_cos();
        2.0 * (((a - r) * (a + r)).max(0.0).sqrt() * sin - r * cos)
    }
}

/// Parameters of which some may be impossible. Each check runs as soon as the values that it needs are possible, so one
/// impossible value hides no other.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    parameters: DriveParameters,
    violations: Vec<Violation>,
    /// Largest and least distance of the cam from the axis.
    pub(crate) cam_outer_mm: Option<f64>,
    pub(crate) cam_inner_mm: Option<f64>,
    /// Largest possible inward offset of the cam.
    pub(crate) greatest_set_back_mm: Option<f64>,
    pub(crate) installed: Option<i64>,
    pub(crate) tooth_radius_mm: Option<f64>,
    /// Half the width of a slot.
    pub(crate) slot_half_width_mm: Option<f64>,
    /// `s`, if carrier and ring differ by one tooth for each lobe.
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
        let mut are_in_range = |parameters: &[(Parameter, f64)]| {
            parameters.iter().fold(true, |all, &(parameter, value)| is_in_range(parameter, value) && all)
        };
        let wave_generator = are_in_range(&p.wave_generator.parameters()).then_some(p.wave_generator);
        let teeth = are_in_range(&[(Parameter::ToothCount, p.teeth as f64)]).then_some(p.teeth);
        let installed = are_in_range(&[(Parameter::InstalledTeeth, p.installed as f64)]).then_some(p.installed);
        let tooth_radius_mm = are_in_range(&[(Parameter::ToothRadius, p.tooth_radius_mm)]).then_some(p.tooth_radius_mm);
        are_in_range(&p.tooth.parameters());
        let ring_teeth = are_in_range(&[(Parameter::RingTeeth, p.ring_teeth as f64)]).then_some(p.ring_teeth);
        let mut bore_is_possible = p.tip_radius_mm.is_none_or(|bore| is_in_range(Parameter::TipRadius, bore));

        // A cam defined by its path depends on the teeth. Any other cam is known without them.
        let cam_tooth_radius_mm = tooth_radius_mm.or((!p.wave_generator.follows_from_teeth()).then_some(0.0));
        let mut cam = None;
        if let Some((wave_generator, radius_mm)) = wave_generator.zip(cam_tooth_radius_mm) {
            match wave_generator.cam(radius_mm) {
                Ok(possible) => cam = Some(Locus::new(possible, radius_mm)),
                Err(violation) => violations.push(violation),
            }
        }
        let (cam_outer_mm, cam_inner_mm) = match p.wave_generator {
            // The semi-axes of an ellipse are known independently of each other.
            WaveGenerator::Ellipse { semi_major_mm, semi_minor_mm } => {
                let in_range = |parameter: Parameter, value| parameter.check(value).is_none().then_some(value);
                (in_range(Parameter::SemiMajor, semi_major_mm), in_range(Parameter::SemiMinor, semi_minor_mm))
            }
            _ => (cam.map(|cam| cam.cam_outer_radius_mm()), cam.map(|cam| cam.cam_inner_radius_mm())),
        };
        let lobes = wave_generator.map(|wave_generator| wave_generator.lobes()).or_else(|| {
            let lobes = p.wave_generator.lobes();
            Parameter::Lobes.check(lobes as f64).is_none().then_some(lobes)
        });
        let mut sense = None;
        if let Some(((teeth, ring_teeth), lobes)) = teeth.zip(ring_teeth).zip(lobes) {
            let instead = Alternatives::to_ring_beside(teeth, lobes);
            if instead.contains(ring_teeth) {
                sense = Some(if teeth > ring_teeth { 1.0 } else { -1.0 });
            } else {
                violations.push(Violation::ToothDifference { teeth, ring_teeth, lobes, instead });
            }
        }
        if let Some((installed, teeth)) = installed.zip(teeth).filter(|(installed, teeth)| teeth % installed != 0) {
            let instead = Alternatives::to_installed(installed, teeth);
            violations.push(Violation::InstalledNoDivisor { installed, teeth, instead });
        }
        let mut slot_half_width_mm = None;
        if let Some(tooth_radius_mm) = tooth_radius_mm {
            violations.extend(p.tooth.violations(tooth_radius_mm));
            // None if the flats leave nothing of the tooth.
            slot_half_width_mm =
                Some(p.tooth.half_width_in_slot_mm(tooth_radius_mm)).filter(|&width_mm| width_mm > 0.0);
        }
        if let Some(((cam_outer_mm, tooth_radius_mm), tip_radius_mm)) =
            cam_outer_mm.zip(tooth_radius_mm).zip(p.tip_radius_mm.filter(|_| bore_is_possible))
        {
            let root_radius_mm = cam_outer_mm + 2.0 * tooth_radius_mm;
            if tip_radius_mm >= root_radius_mm {
                violations.push(Violation::BoreLeavesNoFlank { tip_radius_mm, root_radius_mm });
                bore_is_possible = false;
            }
        }

        let locus = cam.zip(tooth_radius_mm).map(|(cam, tooth_radius_mm)| Locus::new(*cam.cam(), tooth_radius_mm));
        let ring = match locus.zip(ring_teeth).filter(|_| bore_is_possible) {
            Some((locus, ring_teeth)) => {
                let flank = RingFlank::new(locus, ring_teeth as f64 / f64::from(locus.lobes()));
                Some(RingTooth::new(flank, p.tip_radius_mm)?)
            }
            None => None,
        };
        if let Some(RingTooth { flank, tip_radius_mm, .. }) = ring {
            let cam_outer_mm = flank.locus().cam_outer_radius_mm();
            if tip_radius_mm <= cam_outer_mm {
                let (parameter, value_mm) = p.wave_generator.stroke();
                let limit_mm = match p.wave_generator {
                    WaveGenerator::Ellipse { .. } => tip_radius_mm,
                    // At a regular tip, where the ring is farthest in, the carrier has space if e < r.
                    _ => p.tooth_radius_mm,
                };
                violations.push(Violation::NoCarrierAnnulus {
                    parameter,
                    value_mm,
                    limit_mm,
                    cam_outer_mm,
                    tip_radius_mm,
                });
            }
        }
        if let Some((locus, installed)) = locus.zip(installed) {
            violations.extend(Neighbours { locus, installed }.violation()?);
        }
        Ok(Self {
            parameters: p,
            violations,
            cam_outer_mm,
            cam_inner_mm,
            greatest_set_back_mm: cam.map(|cam| cam.greatest_set_back_mm()),
            installed,
            tooth_radius_mm,
            slot_half_width_mm,
            sense,
            ring,
        })
    }

    /// Returns every reason why the drive cannot exist.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// Returns true if the teeth have flats.
    pub(crate) const fn has_flats(&self) -> bool {
        matches!(self.parameters.tooth, ToothShape::FlatSided { .. })
    }

    /// Returns the drive if it can exist.
    pub fn drive(&self) -> Option<Drive> {
        let ring = self.ring.filter(|_| self.violations.is_empty())?;
        Some(Drive { parameters: self.parameters, ring })
    }
}

/// Neighbouring teeth on their path.
#[derive(Debug, Clone, Copy)]
struct Neighbours {
    locus: Locus,
    installed: i64,
}

impl Neighbours {
    /// Returns half the angle between neighbouring slots.
    fn half_spacing_rad(&self) -> f64 {
        PI / self.installed as f64
    }

    /// Returns the tooth radius below which neighbouring teeth cannot touch. It follows from the least centre radius,
    /// in the valley. This bound settles nearly every drive.
    fn surely_free_radius_mm(&self) -> f64 {
        self.locus.cam().kind().surely_free_radius_mm(self.half_spacing_rad().sin())
    }

    /// Returns a violation if neighbouring teeth touch.
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
        let touching_radius_mm = self.touching_radius_mm(center_distance_mm)?;
        Ok(Some(Violation::TeethTouch { tooth_diameter_mm, center_distance_mm, touching_radius_mm }))
    }

    /// Returns the least distance of two neighbouring centres on their path (docs/explanation/theory.md section 7). On
    /// an ellipse it is that of the pair across the minor axis. With two or three teeth, which are more than a right
    /// angle apart, the pair across the major axis is closer to the minor axis.
    fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        if !matches!(self.locus.cam(), Cam::Ellipse(_)) {
            return self.least_scanned_distance_mm();
        }
        let half_rad = self.half_spacing_rad();
        let nearest = Position::from_valley(half_rad.min(FRAC_PI_2 - half_rad), self.locus.lobes());
        Ok(2.0 * half_rad.sin() * self.locus.at(nearest)?.center_radius_mm)
    }

    /// Returns the least distance of two neighbouring centres around any cam. It scans the middle of the pair, then
    /// runs a golden-section search around the least value. The scan includes the pair across the valley.
    fn least_scanned_distance_mm(&self) -> Result<f64, NotConverged> {
        const SCAN: u32 = 96;
        let half = self.half_spacing_rad();
        let distance = |middle_rad: f64| -> Result<f64, NotConverged> {
            let before = self.locus.center_radius_at_mm(middle_rad - half)?;
            let after = self.locus.center_radius_at_mm(middle_rad + half)?;
            Ok((before - after).hypot(2.0 * half.sin() * (before * after).sqrt()))
        };
        let valley_rad = half_lobe_rad(self.locus.lobes());
        let step = valley_rad / f64::from(SCAN);
        let mut best = (valley_rad, distance(valley_rad)?);
        for i in 0..SCAN {
            let middle = f64::from(i) * step;
            let value = distance(middle)?;
            if value < best.1 {
                best = (middle, value);
            }
        }
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (best.0 - step, best.0 + step);
        // Forty steps shrink the bracket by 4e-9, which gives the minimum to all digits.
        for _ in 0..40 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            let (at_left, at_right) = (distance(left)?, distance(right)?);
            best.1 = best.1.min(at_left).min(at_right);
            if at_left < at_right { high = right } else { low = left }
        }
        Ok(best.1)
    }

    /// Returns the radius, at most that of the teeth, at which neighbours begin to touch. Centres of thicker teeth are
    /// farther out, but by less than the increase in thickness, so the gap falls with the radius. The unknown is the
    /// radius's logarithm, because radii range over twelve decades. If the path itself is given, it is the same for all
    /// radii, and the result is half the least distance.
    fn touching_radius_mm(&self, center_distance_mm: f64) -> Result<f64, NotConverged> {
        match self.locus.cam() {
            Cam::Ellipse(cam) if self.installed > 3 => return self.touching_radius_of_ellipse_mm(cam),
            Cam::HarmonicPath(_) => return Ok(0.5 * center_distance_mm),
            Cam::Ellipse(_) | Cam::Harmonic(_) => {}
        }
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

    /// Returns, for an ellipse and four teeth or more, the radius at which the two teeth across the minor axis touch.
    ///
    /// Both touch the minor axis then. Their centres are at `(r, r cot μ)`, with μ half the spacing, and on the path of
    /// section 2.2. With `a² cos φ/h = r (1 - cos φ)` and `b² sin φ/h = r (cot μ - sin φ)` the normal's angle is the
    /// one root of `a² cos φ (cot μ - sin φ) = b² sin φ (1 - cos φ)` above 45°.
    fn touching_radius_of_ellipse_mm(&self, cam: &Ellipse) -> Result<f64, NotConverged> {
        let (a, b) = (cam.semi_major_mm(), cam.semi_minor_mm());
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
