//! Drive with checked parameters, so that the functions below need not doubt their input.

mod draft;
mod neighbours;
mod tooth_counts;

use neighbours::Neighbours;

use crate::cam::WaveGenerator;
use crate::contact::PerContact;
use crate::ring::{FlankLimit, RingFlank, RingTooth};
use crate::root::NotConverged;
use crate::violation::{FieldCode, Parameter, Violation};

pub use draft::Draft;

/// Parameters of a drive (docs/explanation/theory.md section 1). The default is the drive of the paper's section 5.1.
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

impl Default for DriveParameters {
    fn default() -> Self {
        Self {
            wave_generator: WaveGenerator::Ellipse { semi_major_mm: 58.0, semi_minor_mm: 56.0 },
            teeth: 28,
            installed: 28,
            tooth_radius_mm: 5.0,
            tooth: ToothShape::Cylinder { width_mm: 15.0 },
            ring_teeth: 26,
            tip_radius_mm: None,
        }
    }
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
                .map(|(contact, groove_radius_mm)| {
                    let detail = format!(
                        "a groove of {groove_radius_mm:?} mm radius is no wider than the balls in it: choose more than their radius of {tooth_radius_mm:?} mm"
                    );
                    let parameter = Parameter::GrooveRadius(contact);
                    Violation::new(FieldCode::GrooveTooTight, parameter, groove_radius_mm, tooth_radius_mm, detail)
                })
                .collect(),
            Self::FlatSided { flat_length_mm, .. }
                if Parameter::FlatLength.check(*flat_length_mm).is_none()
                    && *flat_length_mm >= 2.0 * tooth_radius_mm =>
            {
                let diameter_mm = 2.0 * tooth_radius_mm;
                let detail = format!(
                    "flats of {flat_length_mm:?} mm length leave nothing of a tooth: choose less than its diameter of {diameter_mm:?} mm"
                );
                let (code, parameter) = (FieldCode::FlatTooLong, Parameter::FlatLength);
                vec![Violation::new(code, parameter, *flat_length_mm, diameter_mm, detail)]
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
    /// ```
    /// use toothwave_solver::{Drive, DriveParameters, drive::DriveError};
    ///
    /// let drive = Drive::new(&DriveParameters::default()).unwrap();
    /// assert_eq!(drive.transmission_ratio(), 14.0);
    ///
    /// // Neighbouring teeth touch.
    /// let thick = DriveParameters { tooth_radius_mm: 8.0, ..DriveParameters::default() };
    /// let Err(DriveError::Impossible(violations)) = Drive::new(&thick) else { panic!() };
    /// println!("{}", violations[0]);
    /// ```
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

    /// Returns the radius of the ring's tips: natural, trimmed by undercut, or bored.
    pub const fn tip_radius_mm(&self) -> f64 {
        self.ring.tip_radius_mm
    }

    /// Returns the largest pressure angle β of the engaged flank.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn largest_pressure_angle_deg(&self) -> Result<f64, NotConverged> {
        Ok((self.ring.steepest_engaged()?.tan_pressure_angle * self.flank().teeth_per_wave()).atan().to_degrees())
    }

    const fn neighbours(&self) -> Neighbours {
        Neighbours { cam: self.ring.flank.cam, installed: self.parameters.installed }
    }

    /// Returns the least distance of two neighbouring centres on their path.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn least_center_distance_mm(&self) -> Result<f64, NotConverged> {
        self.neighbours().least_center_distance_mm()
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
