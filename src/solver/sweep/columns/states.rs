//! Columns of a sweep: states of the teeth, and quantities of all teeth at each input angle.

use super::peaks::{ContactPeaks, Extremes, Peak, SweepPeaks, TorqueCapacity};
use crate::contact::PerContact;
use crate::drive::Drive;
use crate::mesh::{Mesh, TeethInMesh};

/// States of a sweep, by input angle and then tooth number: columns of equal length with one entry for each state. If
/// the zones are alike, the teeth of one zone represent all. Otherwise the teeth of all zones are listed ([`Mesh`]).
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct States {
    /// Input angle j, in deg.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number. Tooth 0 is in the middle of a lobe at j = 0.
    pub tooth: Vec<u32>,
    /// Lobe of the tooth; empty if the zones are alike.
    pub lobe: Vec<u32>,
    /// Position ψ from the middle of the lobe, in deg.
    pub position_deg: Vec<f64>,
    /// Distance `d` of the tooth's centre from the axis, in mm.
    pub center_radius_mm: Vec<f64>,
    /// φ_H: angle of the contact point on the cam from the valley, in deg.
    pub wave_generator_angle_deg: Vec<f64>,
    /// φ_K: angle of the contact point on the ring from the tip of the ring's tooth, in deg.
    pub ring_angle_deg: Vec<f64>,
    /// Contact forces `F_H`, `F_K`, `F_S`, in N.
    pub force_n: PerContact<Vec<f64>>,
    /// Hertz stresses `σ_H`, `σ_K`, `σ_S`, in MPa.
    pub stress_mpa: PerContact<Vec<f64>>,
}

/// Quantities of all teeth together at an input angle: columns of equal length with one entry for each input angle.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct InputAngles {
    /// Input angle j, in deg.
    pub input_angle_deg: Vec<f64>,
    /// Wind-up `Δφ`: rotation of the wave generator under the load, clearances included, in deg.
    pub wind_up_deg: Vec<f64>,
    /// Torsional stiffness `(Z_G/U)² dM0/dΔφ`: output torque over output rotation, input held, at the load.
    pub torsional_stiffness_nm_per_rad: Vec<f64>,
    /// Number of listed teeth that carry load.
    pub loaded_teeth: Vec<u32>,
}

/// A sweep over one period. If items deviate, it covers the load periods after which all items are back in their
/// positions.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sweep {
    /// Mesh of the sweep.
    pub mesh: Mesh,
    /// States of the teeth.
    pub states: States,
    /// Quantities at each input angle.
    pub input_angles: InputAngles,
    /// Peaks over the states.
    pub peaks: PerContact<ContactPeaks>,
    /// The torque capacity, given an allowable stress.
    pub torque_capacity: Option<TorqueCapacity>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
    /// Largest difference of a force or stress at the last input angle from its independent recalculation, over the
    /// peak.
    pub period_closure_residual: f64,
}

impl Sweep {
    /// Returns the transmission error under load, peak to peak: the range of the wind-up, referred to the output.
    pub fn transmission_error_peak_to_peak_deg(&self, drive: &Drive) -> f64 {
        let Extremes { least, largest } = Extremes::of(&self.input_angles.wind_up_deg);
        (largest - least) / drive.teeth_per_wave()
    }

    /// Returns the least and the largest number of teeth in a zone that are in mesh with their gaps closed.
    pub fn loaded_teeth(&self) -> TeethInMesh {
        let teeth = self.input_angles.loaded_teeth.iter().map(|&teeth| u64::from(teeth));
        TeethInMesh { min: teeth.clone().min().unwrap_or(0), max: teeth.max().unwrap_or(0) }
    }
}

impl From<&Sweep> for SweepPeaks {
    fn from(sweep: &Sweep) -> Self {
        Self {
            contacts: sweep.peaks,
            wind_up_deg: Extremes::of(&sweep.input_angles.wind_up_deg),
            torsional_stiffness_nm_per_rad: Extremes::of(&sweep.input_angles.torsional_stiffness_nm_per_rad),
            loaded_teeth: sweep.loaded_teeth(),
            torque_capacity: sweep.torque_capacity,
            torque_balance_residual: sweep.torque_balance_residual,
        }
    }
}

impl States {
    pub(crate) fn with_capacity(count: usize, lists_lobes: bool) -> Self {
        Self::of_columns(|| Vec::with_capacity(count), || Vec::with_capacity(count), lists_lobes)
    }

    /// Returns columns of zeros with the teeth of all zones, to be filled in.
    pub(crate) fn of_zeros(count: usize) -> Self {
        Self::of_columns(|| vec![0.0; count], || vec![0; count], true)
    }

    fn of_columns(column: impl Fn() -> Vec<f64>, numbers: impl Fn() -> Vec<u32>, lists_lobes: bool) -> Self {
        Self {
            input_angle_deg: column(),
            tooth: numbers(),
            lobe: if lists_lobes { numbers() } else { Vec::new() },
            position_deg: column(),
            center_radius_mm: column(),
            wave_generator_angle_deg: column(),
            ring_angle_deg: column(),
            force_n: PerContact::of(|_| column()),
            stress_mpa: PerContact::of(|_| column()),
        }
    }

    /// Returns the number of states.
    pub fn len(&self) -> usize {
        self.tooth.len()
    }

    /// Returns true if there is no state.
    pub fn is_empty(&self) -> bool {
        self.tooth.is_empty()
    }

    pub(crate) fn peak(&self, column: &[f64], at: usize) -> Peak {
        Peak { value: column[at], input_angle_deg: self.input_angle_deg[at], position_deg: self.position_deg[at] }
    }
}

impl InputAngles {
    pub(crate) fn of_columns(column: impl Fn() -> Vec<f64>, loaded_teeth: Vec<u32>) -> Self {
        let (input_angle_deg, wind_up_deg) = (column(), column());
        Self { input_angle_deg, wind_up_deg, torsional_stiffness_nm_per_rad: column(), loaded_teeth }
    }

    /// Returns the torsional stiffness at the output for `dM0/dΔφ`.
    #[inline(always)]
    pub(crate) fn of_output(drive: &Drive, stiffness_nmm_per_rad: f64) -> f64 {
        let torque_ratio = drive.teeth_per_wave();
        1e-3 * stiffness_nmm_per_rad * torque_ratio * torque_ratio
    }

    /// Fills in the last input angle, one period after the first.
    pub(crate) fn repeat_first(&mut self, input_angle_deg: f64) {
        let last = self.input_angle_deg.len() - 1;
        self.input_angle_deg[last] = input_angle_deg;
        self.wind_up_deg[last] = self.wind_up_deg[0];
        self.torsional_stiffness_nm_per_rad[last] = self.torsional_stiffness_nm_per_rad[0];
        self.loaded_teeth[last] = self.loaded_teeth[0];
    }
}
