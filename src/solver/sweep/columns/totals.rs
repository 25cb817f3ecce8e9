//! Totals over the input angles of a sweep.

use super::checks::{TorqueBalance, check};
use super::peaks::{ContactPeaks, Extremes, SweepPeaks, TorqueCapacity};
use crate::SolveError;
use crate::contact::PerContact;
use crate::load_sharing::LoadedDrive;
use crate::mesh::TeethInMesh;

/// Torque balance, torque capacity, and the ranges of wind-up, stiffness and loaded teeth.
pub(crate) struct Totals {
    pub(crate) balance: TorqueBalance,
    pub(crate) torque_balance_residual: f64,
    pub(crate) torque_capacity: Option<TorqueCapacity>,
    wind_up_deg: Extremes,
    torsional_stiffness_nm_per_rad: Extremes,
    loaded_teeth: TeethInMesh,
}

impl Totals {
    /// Totals of no input angle.
    pub(crate) fn new(loaded: &LoadedDrive<'_>) -> Self {
        Self {
            balance: TorqueBalance::new(loaded.drive(), loaded.input_torque_nmm()),
            torque_balance_residual: 0.0,
            torque_capacity: None,
            wind_up_deg: Extremes::NONE,
            torsional_stiffness_nm_per_rad: Extremes::NONE,
            loaded_teeth: TeethInMesh { min: u64::MAX, max: 0 },
        }
    }

    /// Adds wind-up, stiffness and loaded teeth of an input angle.
    #[inline(always)]
    pub(crate) fn add(&mut self, wind_up_deg: f64, torsional_stiffness_nm_per_rad: f64, loaded_teeth: u64) {
        self.wind_up_deg = self.wind_up_deg.with(wind_up_deg);
        self.torsional_stiffness_nm_per_rad = self.torsional_stiffness_nm_per_rad.with(torsional_stiffness_nm_per_rad);
        let TeethInMesh { min, max } = self.loaded_teeth;
        self.loaded_teeth = TeethInMesh { min: min.min(loaded_teeth), max: max.max(loaded_teeth) };
    }

    /// Adds the torque capacity at an input angle. Returns true if it is the least so far. The first of equal ones
    /// counts, in any order of evaluation.
    #[inline(always)]
    pub(crate) fn add_capacity(&mut self, capacity: TorqueCapacity) -> bool {
        let is_least = self.torque_capacity.is_none_or(|before| {
            let order = before.input_torque_nm.total_cmp(&capacity.input_torque_nm);
            order.then(before.input_angle_deg.total_cmp(&capacity.input_angle_deg)).is_gt()
        });
        if is_least {
            self.torque_capacity = Some(capacity);
        }
        is_least
    }

    /// Returns the summary, given the peaks of each contact, or an error if the torques are not balanced.
    pub(crate) fn peaks(&self, contacts: PerContact<ContactPeaks>) -> Result<SweepPeaks, SolveError> {
        check("torque balance", self.torque_balance_residual)?;
        Ok(SweepPeaks {
            contacts,
            wind_up_deg: self.wind_up_deg,
            torsional_stiffness_nm_per_rad: self.torsional_stiffness_nm_per_rad,
            loaded_teeth: self.loaded_teeth,
            torque_capacity: self.torque_capacity,
            torque_balance_residual: self.torque_balance_residual,
        })
    }
}
