//! Result of a sweep: columns of states and input angles, peaks, capacity, and the checks that it has to pass.

mod checks;
mod peaks;
mod states;

pub use checks::TorqueBalance;
pub(crate) use checks::{checked, worse};
pub use peaks::{ContactPeaks, Extremes, Peak, SweepPeaks, TorqueCapacity};
pub(crate) use peaks::{PeaksSoFar, Totals};
pub use states::{InputAngles, States, Sweep};
