//! Result of a sweep: columns of states and input angles, peaks, capacity, and the checks that it has to pass.

mod checks;
mod peaks;
mod states;
mod totals;

pub use checks::TorqueBalance;
pub(crate) use checks::{checked, worse};
pub(crate) use peaks::PeaksSoFar;
pub use peaks::{ContactPeaks, Extremes, Peak, SweepPeaks, TorqueCapacity};
pub use states::{InputAngles, States, Sweep};
pub(crate) use totals::Totals;
