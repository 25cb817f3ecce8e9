//! Geometry, load sharing and contact stress of discrete-tooth harmonic drives.
//!
//! The crate is arithmetic alone: pure functions, no input or output, no clock, no logging. The equations, with
//! their sources, stand in `docs/theory.md`; every formula below names its section there, and in brackets the
//! number it has in the paper (Wang, Bai, Chen, Wang, Journal of Chongqing University 36(1), 2013, 35-42).
//!
//! # Parts
//!
//! An elliptic *wave generator* (input) pushes cylindrical *teeth* outward in the radial slots of a *carrier*
//! (output). A fixed *ring*, whose profile is the envelope of the moving teeth, deflects them sideways.
//!
//! # Frames and signs
//!
//! - Wave generator's frame: x along the major axis. A tooth's *position* ψ is the polar angle of its centre there,
//!   0 on the major axis (root of the ring's tooth space), π/2 on the minor axis (tip of the ring's tooth).
//! - Ring's frame: x along the middle of a tooth space; the tooth's centre stands at the angle `-s ψ/k`, `k = Z_K / 2`,
//!   `s = sign(Z_G - Z_K)`. The profile is symmetric, and is drawn with ψ/k.
//! - Near the tip everything is worked from `x = π/2 - ψ`, which a [`Position`] carries beside ψ, because cos(π/2)
//!   is 6e-17 in doubles and would enter stresses through a square root.
//! - The two meshing zones are point reflections of each other; sums are over one zone, torques over both.
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

mod adaptive;
mod batch;
pub mod cam;
pub mod contact;
pub mod drawing;
pub mod drive;
pub mod findings;
pub mod load_sharing;
pub mod locus;
pub mod losses;
pub mod mesh;
pub mod parts;
pub mod position;
pub mod profile;
pub mod ring;
pub mod root;
pub mod sweep;
pub mod violation;

pub use contact::{Contact, ContactLaw, Material, Materials, Part, PerContact};
pub use drive::{Drive, DriveParameters};
pub use findings::Finding;
pub use load_sharing::{Compatibility, LoadCase, LoadParameters, Torque};

pub use position::Position;
pub use violation::{Parameter, Violation};

/// The version that answers carry, since a later one may compute the last digits differently.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Why a drive that can exist has no answer to a question.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// At some input angle no tooth has a lever arm: ψ_e is at most the spacing of the installed teeth.
    #[error(
        "the ring's flank ends at {engagement_start_deg} deg from the major axis, within one spacing of the installed teeth ({spacing_deg} deg): at some input angle no tooth has a lever arm, so no finite force carries the torque"
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
    /// More points than asked for at most.
    #[error("the profiles need {points} points at this chord tolerance, more than the {limit} allowed")]
    TooManyPoints {
        /// Points that the profiles need.
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
    /// The caller's stop signal was seen.
    #[error("the computation was stopped")]
    Stopped,
    /// An iteration hit its cap.
    #[error(transparent)]
    NotConverged(#[from] root::NotConverged),
}

/// Asked now and then whether to go on; a computation that is told to stop returns [`SolveError::Stopped`].
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
