//! Equilibrium of a tooth, and compatibility of all teeth at one input angle (docs/explanation/theory.md section 4).

mod capacity;
mod equilibrium;
mod load;
mod loaded_drive;
mod tooth_state;

#[doc(hidden)]
pub use capacity::TorqueLimit;
pub use equilibrium::Compatibility;
#[doc(hidden)]
pub use equilibrium::ToothState;
pub(crate) use equilibrium::{curvature_per_mm, force_ratio};
pub use load::{LoadCase, LoadParameters, Torque};
#[doc(hidden)]
pub use loaded_drive::LoadedDrive;
