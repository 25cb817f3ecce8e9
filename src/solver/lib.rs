//! Geometry, load sharing and contact stress of discrete-tooth harmonic drives.
//!
//! The crate consists of pure functions: no input or output, no clock, no logging. The file
//! `docs/explanation/theory.md` derives the equations. Every formula below names its section there. A number in
//! brackets is the number of an equation in the paper (Wang, Bai, Chen, Wang, Journal of Chongqing University 36(1),
//! 2013, 35-42).
//!
//! # Parts
//!
//! A *wave generator* with U lobes (the input) pushes *teeth* outward in the radial slots of a *carrier* (the output).
//! A fixed *ring*, whose profile is the envelope of the moving teeth, deflects them sideways.
//!
//! # Frames and signs
//!
//! - Wave generator's frame: x points along the middle of a lobe, which is the major axis of an ellipse. A tooth's
//!   *position* ψ is the polar angle of its centre from the nearest lobe. It is 0 in the middle of the lobe (root of
//!   the ring's tooth space) and π/U in the valley (tip of the ring's tooth).
//! - Ring's frame: x points along the middle of a tooth space. The tooth's centre has the angle `-s ψ/k`, `k = Z_K /
//!   U`, `s = sign(Z_G - Z_K)`. The profile is symmetric and is drawn with ψ/k.
//! - Near the tip all formulas use `x = π/U - ψ`, which a [`Position`] stores next to ψ. In doubles cos(π/2) is 6e-17,
//!   and would enter stresses through a square root.
//! - If U divides the number of installed teeth, the meshing zones are alike: sums are over one of them, torques over
//!   all. Otherwise the teeth of all zones are listed.
//!
//! # Units
//!
//! Lengths are in mm, forces in N, stresses and moduli in MPa. Torques are in N·m in the public interface and in N·mm
//! inside. Angles are in radians inside, and in degrees if a name ends in `_deg`.
//!
//! # Usage
//!
//! [`Drive::new`] checks the parameters once and reports every reason why a drive cannot exist. A [`Drive`] computes
//! its geometry and its mesh. With a [`LoadCase`] it computes a [`sweep()`](sweep::sweep) over one period:
//!
//! ```
//! use toothwave_solver::sweep::{Points, sweep};
//! use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never, ToothShape, Torque, WaveGenerator};
//!
//! let drive = Drive::new(&DriveParameters {
//!     wave_generator: WaveGenerator::Ellipse { semi_major_mm: 58.0, semi_minor_mm: 56.0 },
//!     teeth: 28,
//!     installed: 28,
//!     ring_teeth: 26,
//!     tooth_radius_mm: 5.0,
//!     tooth: ToothShape::Cylinder { width_mm: 15.0 },
//!     tip_radius_mm: None,
//! })
//! .unwrap();
//! let load = LoadCase::new(&LoadParameters { torque: Torque::Output(280.0), ..LoadParameters::default() }).unwrap();
//! let sweep = sweep(&drive, &load, Points::samples(200).unwrap(), &Never).unwrap();
//! let peak = sweep.peaks.wave_generator.stress_mpa;
//! assert_eq!(format!("{:.0} MPa", peak.value), "864 MPa");
//! ```
//!
//! | to compute | use |
//! |---|---|
//! | forces, stresses, wind-up, stiffness, torque capacity | [`sweep()`](sweep::sweep), only their peaks [`sweep::peaks`] |
//! | the same with deviations of single items | [`sweep::sweep_with_deviations`] |
//! | true extremes instead of samples | [`sweep::Points::tolerance`] |
//! | backlash | [`backlash::of`] |
//! | losses, wear, duty, life of the bearing | [`losses::period::Losses::of`], [`losses::duty::DutySweep`] |
//! | compliance behind the contacts | [`backing::Backings`] |
//! | strength of the carrier, load along its teeth | [`fingers::CarrierFingers`] |
//! | profiles and drawings | [`profile::profiles`], [`drawing::Drawing`] |
//! | warnings, expected error of the model | [`findings`], [`model_error::of`] |
//!
//! Parameters are built with `..Default::default()`, so that a later field changes no caller. Enums are exhaustive, so
//! that a match over codes or errors shows what a later version adds.

#[doc(hidden)]
pub mod approach;
mod arcs;
pub mod backing;
pub mod backlash;
pub mod cam;
pub mod contact;
pub mod contact_law;
pub mod drawing;
pub mod drive;
pub mod findings;
pub mod fingers;
pub mod gaps;
pub mod load_sharing;
pub mod losses;
pub mod mesh;
pub mod model_error;
mod outline;
pub mod parts;
pub mod position;
pub mod profile;
pub mod ring;
#[doc(hidden)]
pub mod ring_bending;
pub mod root;
mod spline;
#[doc(hidden)]
pub mod springs;
pub mod sweep;
#[doc(hidden)]
pub mod tooth;
mod tooth_space;
pub mod violation;

pub use cam::WaveGenerator;
pub use contact::{Contact, Material, Materials, Part, PerContact};
pub use contact_law::{ContactLaw, LawName};
pub use drive::{Drive, DriveParameters, ToothShape};
pub use findings::{Finding, FindingCode, Severity};
pub use gaps::{Deviations, Modification};
pub use load_sharing::{Compatibility, LoadCase, LoadParameters, Torque};
use mesh::Place;
pub use position::Position;
pub use violation::{FieldCode, Parameter, Violation};

/// Version of this crate, which answers include because a later version may compute the last digits differently.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Reason why a valid drive has no answer to a question.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// At some input angle no tooth has a lever arm: ψ_e is at most the spacing of the installed teeth.
    #[error(
        "the ring's flank ends at {engagement_start_deg} deg from the middle of a lobe, within one spacing of the teeth ({spacing_deg} deg): at some input angle no tooth has a lever arm, so no finite force carries the torque"
    )]
    NoToothInMesh {
        /// End of the flank, ψ_e.
        engagement_start_deg: f64,
        /// Angle between neighbouring installed teeth.
        spacing_deg: f64,
    },
    /// With these stiffnesses the form `projection` gives a tooth a compliance that is not positive.
    #[error(
        "the projected compliance of a tooth at {position_deg} deg is {compliance_mm_per_n} mm/N, not above zero: with these stiffnesses the projection form has no solution with physical meaning"
    )]
    ComplianceNotPositive {
        /// Position on the flank with the least compliance.
        position_deg: f64,
        /// The least compliance.
        compliance_mm_per_n: f64,
    },
    /// The load is impossible for this drive.
    #[error("the load is impossible for this drive")]
    Impossible(Vec<Violation>),
    /// None of the teeth at an input angle has a lever arm.
    #[error("none of the teeth in mesh has a lever arm, so no finite force carries the torque")]
    NoLeverArm,
    /// The wave generator rotates past all its teeth before they carry the torque.
    #[error("the wave generator would turn past its teeth before gaps are closed and the torque is carried")]
    TurnedPastTeeth,
    /// Johnson's law is invalid: the half-width of a contact reaches half of the tooth's radius or of the depth.
    #[error(
        "{of_capacity}half the contact's width at {} reaches {half_width_limit_mm} mm, half of the tooth's radius or of the depth, where Johnson's approach ends: at this input angle with an input torque of {input_torque_limit_nm} N·m, first on the tooth at {position_deg} deg",
        .contact.name(),
        of_capacity = if *.is_of_capacity { "no torque capacity can be told, as before any contact reaches its allowable stress " } else { "" }
    )]
    JohnsonBeyondHalfWidth {
        /// The contact that reaches the limit first.
        contact: Contact,
        /// Position of its tooth.
        position_deg: f64,
        /// Half-width at which the law ends.
        half_width_limit_mm: f64,
        /// Input torque at this half-width, at the input angle in question.
        input_torque_limit_nm: f64,
        /// True if the torque capacity is beyond the limit, false if the load is.
        is_of_capacity: bool,
    },
    /// Interference: a tooth is pressed without any load.
    #[error(
        "interference: {tooth} {position_deg} deg from the middle of its lobe{at} has a total gap of {gap_um} µm along the wave generator's force",
        tooth = .place.map_or_else(|| "a tooth".to_owned(), |place| format!("the tooth in slot {} on lobe {},", place.slot, place.lobe)),
        at = .input_angle_deg.map_or_else(String::new, |input_angle_deg| format!(", at an input angle of {input_angle_deg} deg,"))
    )]
    Interference {
        /// Place of the tooth, if parts deviate individually.
        place: Option<Place>,
        /// Position of the tooth on its lobe.
        position_deg: f64,
        /// Input angle, if one is known.
        input_angle_deg: Option<f64>,
        /// Total gap along `F_H`, below zero.
        gap_um: f64,
    },
    /// A flat-sided tooth has no contact with the carrier's slot walls.
    #[error(
        "the flat of the tooth at {position_deg} deg, its centre {center_radius_mm} mm from the axis, lies outside the carrier"
    )]
    FlatOffCarrier {
        /// Position of the tooth.
        position_deg: f64,
        /// Distance of its centre from the axis.
        center_radius_mm: f64,
    },
    /// The profiles need more points than the limit.
    #[error("the profiles need {points} points or more at this chord tolerance, beyond the {limit} allowed")]
    TooManyPoints {
        /// Number of points that the profiles need, or the number counted so far.
        points: u64,
        /// Limit given by the caller.
        limit: u64,
    },
    /// The sweep needs more states than the limit.
    #[error(
        "the sweep takes more states at this tolerance (input angles times teeth in mesh) than the {limit} allowed"
    )]
    TooManyStates {
        /// Limit given by the caller.
        limit: u64,
    },
    /// The answer fails its own checks: a bug in this crate.
    #[error("the {check} of the sweep is off by {residual:e}")]
    Inconsistent {
        /// Name of the check.
        check: &'static str,
        /// Residual of the check.
        residual: f64,
    },
    /// The stop signal of the caller was set.
    #[error("the computation was stopped")]
    Stopped,
    /// An iteration reached its limit of steps.
    #[error(transparent)]
    NotConverged(#[from] root::NotConverged),
}

impl SolveError {
    /// Returns the error with this input angle, if it carries one.
    pub(crate) fn at_input_angle(self, input_angle_deg: f64) -> Self {
        match self {
            Self::Interference { place, position_deg, gap_um, .. } => {
                Self::Interference { place, position_deg, input_angle_deg: Some(input_angle_deg), gap_um }
            }
            other => other,
        }
    }
}

/// Stop signal, polled during a computation. If it is set, the computation returns [`SolveError::Stopped`]. It is
/// passed as `dyn`, so that a sweep is compiled once, in this crate.
pub trait Stop {
    /// Returns true if the computation has to stop.
    fn stopped(&self) -> bool;
}

/// Stop signal that is never set.
#[derive(Debug, Clone, Copy, Default)]
pub struct Never;

impl Stop for Never {
    fn stopped(&self) -> bool {
        false
    }
}

impl Stop for std::sync::atomic::AtomicBool {
    fn stopped(&self) -> bool {
        self.load(std::sync::atomic::Ordering::Relaxed)
    }
}
