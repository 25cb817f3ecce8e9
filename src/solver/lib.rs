//! Geometry, load sharing and contact stress of discrete-tooth harmonic drives.
//!
//! The crate is arithmetic alone: pure functions, no input or output, no clock, no logging. The equations, with
//! their sources, stand in `docs/theory.md`; every formula below names its section there, and in brackets the
//! number it has in the paper (Wang, Bai, Chen, Wang, Journal of Chongqing University 36(1), 2013, 35-42).
//!
//! # Parts
//!
//! A *wave generator* of U lobes (input) pushes *teeth* outward in the radial slots of a *carrier*
//! (output). A fixed *ring*, whose profile is the envelope of the moving teeth, deflects them sideways.
//!
//! # Frames and signs
//!
//! - Wave generator's frame: x along the middle of a lobe, the major axis of an ellipse. A tooth's *position* ψ is the polar angle of its
//!   centre from the lobe that it is on: 0 in the middle of the lobe (root of the ring's tooth space), π/U in the valley (tip of the
//!   ring's tooth).
//! - Ring's frame: x along the middle of a tooth space; the tooth's centre stands at the angle `-s ψ/k`, `k = Z_K / U`,
//!   `s = sign(Z_G - Z_K)`. The profile is symmetric, and is drawn with ψ/k.
//! - Near the tip everything is worked from `x = π/U - ψ`, which a [`Position`] carries beside ψ, because cos(π/2)
//!   is 6e-17 in doubles and would enter stresses through a square root.
//! - Where U divides the number of installed teeth the meshing zones are alike: sums are over one of them, torques over all. Elsewhere
//!   the teeth of all zones are listed.
//!
//! # Units
//!
//! Lengths in mm, forces in N, stresses and moduli in MPa, torques in N·m at the border and N·mm inside, angles in
//! radians inside and in degrees where a name ends in `_deg`.
//!
//! # The way through
//!
//! [`Drive::new`] checks parameters once and reports every reason why a drive cannot exist. A [`Drive`] answers for
//! its geometry and its mesh; with a [`LoadCase`] it answers a [`sweep()`](sweep::sweep) over one period.

pub mod approach;
mod arcs;
pub mod backing;
pub mod cam;
pub mod contact;
pub mod drawing;
pub mod drive;
pub mod findings;
pub mod gaps;
pub mod load_sharing;
pub mod locus;
pub mod losses;
pub mod mesh;
pub mod model_error;
mod outline;
pub mod parts;
pub mod position;
pub mod profile;
pub mod ring;
pub mod ring_bending;
pub mod root;
mod spline;
pub mod springs;
pub mod sweep;
pub mod tooth;
mod tooth_space;
pub mod violation;

pub use cam::WaveGenerator;
pub use contact::{Contact, ContactLaw, Material, Materials, Part, PerContact};
pub use drive::{Drive, DriveParameters, ToothShape};
pub use findings::Finding;
pub use gaps::{Deviations, Modification};
pub use load_sharing::{Compatibility, LoadCase, LoadParameters, Torque};
use mesh::Place;
pub use position::Position;
pub use violation::{Parameter, Violation};

/// The version that answers carry, since a later one may compute the last digits differently.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Why a drive that can exist has no answer to a question.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// At some input angle no tooth has a lever arm: ψ_e is at most the spacing of the places where teeth stand.
    #[error(
        "the ring's flank ends at {engagement_start_deg} deg from the middle of a lobe, within one spacing of the teeth ({spacing_deg} deg): at some input angle no tooth has a lever arm, so no finite force carries the torque"
    )]
    NoToothInMesh {
        /// Where the flank ends, ψ_e.
        engagement_start_deg: f64,
        /// Angle between neighbouring installed teeth.
        spacing_deg: f64,
    },
    /// `projection` with these stiffnesses gives a tooth a compliance that is not positive.
    #[error(
        "the projected compliance of a tooth at {position_deg} deg is {compliance_mm_per_n} mm/N, not above zero: with these stiffnesses the projection form has no solution with physical meaning"
    )]
    ComplianceNotPositive {
        /// Where on the flank the compliance is least.
        position_deg: f64,
        /// The least compliance.
        compliance_mm_per_n: f64,
    },
    /// A load that this drive cannot have.
    #[error("the load is impossible for this drive")]
    Impossible(Vec<Violation>),
    /// None of the teeth at an input angle has a lever arm.
    #[error("none of the teeth in mesh has a lever arm, so no finite force carries the torque")]
    NoLeverArm,
    /// The wave generator moves on under its teeth, past all of them, before they carry the torque.
    #[error("the wave generator would turn past its teeth before gaps are closed and the torque is carried")]
    TurnedPastTeeth,
    /// Johnson's law where a contact is half as wide as the tooth's radius or the depth, or wider.
    #[error(
        "{of_capacity}half the contact's width at {} reaches {half_width_limit_mm} mm, half of the tooth's radius or of the depth, where Johnson's approach ends: at this input angle with an input torque of {input_torque_limit_nm} N·m, first on the tooth at {position_deg} deg",
        .contact.name(),
        of_capacity = if *.is_of_capacity { "no torque capacity can be told, as before any contact reaches its allowable stress " } else { "" }
    )]
    JohnsonBeyondHalfWidth {
        /// The contact that is first.
        contact: Contact,
        /// Where its tooth stands.
        position_deg: f64,
        /// The half-width at which the law ends.
        half_width_limit_mm: f64,
        /// The input torque at which it does so, at the input angle looked at.
        input_torque_limit_nm: f64,
        /// Whether it is the torque capacity that lies beyond, and not the load.
        is_of_capacity: bool,
    },
    /// A part that is too full: before any load a tooth would be pressed already.
    #[error(
        "interference: {tooth} {position_deg} deg from the middle of its lobe{at} has a total gap of {gap_um} µm along the wave generator's force",
        tooth = .place.map_or_else(|| "a tooth".to_owned(), |place| format!("the tooth in slot {} on lobe {},", place.slot, place.lobe)),
        at = .input_angle_deg.map_or_else(String::new, |input_angle_deg| format!(", at an input angle of {input_angle_deg} deg,"))
    )]
    Interference {
        /// Where the tooth is among the items, where these deviate.
        place: Option<Place>,
        /// Where it stands on its lobe.
        position_deg: f64,
        /// The input angle, where one is looked at.
        input_angle_deg: Option<f64>,
        /// Its total gap along `F_H`, below zero.
        gap_um: f64,
    },
    /// A flat-sided tooth that is nowhere borne by the carrier.
    #[error(
        "the flat of the tooth at {position_deg} deg, its centre {center_radius_mm} mm from the axis, lies outside the carrier"
    )]
    FlatOffCarrier {
        /// Where it stands.
        position_deg: f64,
        /// Distance of its centre from the axis.
        center_radius_mm: f64,
    },
    /// More points than asked for at most.
    #[error("the profiles need {points} points or more at this chord tolerance, beyond the {limit} allowed")]
    TooManyPoints {
        /// Points that the profiles need, or as many of them as were counted.
        points: u64,
        /// The limit that was given.
        limit: u64,
    },
    /// More states than asked for at most.
    #[error(
        "the sweep takes more states at this tolerance (input angles times teeth in mesh) than the {limit} allowed"
    )]
    TooManyStates {
        /// The limit that was given.
        limit: u64,
    },
    /// The answer's own checks say that it is wrong: a fault of this crate.
    #[error("the {check} of the sweep is off by {residual:e}")]
    Inconsistent {
        /// Which check.
        check: &'static str,
        /// What it came to.
        residual: f64,
    },
    /// The caller's stop signal was seen.
    #[error("the computation was stopped")]
    Stopped,
    /// An iteration hit its cap.
    #[error(transparent)]
    NotConverged(#[from] root::NotConverged),
}

impl SolveError {
    /// The same, of teeth that were looked at at an input angle.
    pub(crate) fn at_input_angle(self, input_angle_deg: f64) -> Self {
        match self {
            Self::Interference { place, position_deg, gap_um, .. } => {
                Self::Interference { place, position_deg, input_angle_deg: Some(input_angle_deg), gap_um }
            }
            other => other,
        }
    }
}

/// Asked now and then whether to go on; a computation that is told to stop returns [`SolveError::Stopped`].
/// It is asked through `dyn`, so that a sweep is compiled once, in this crate.
pub trait Stop {
    /// Whether to stop.
    fn stopped(&self) -> bool;
}

/// Never stops.
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
