//! Answer of a sweep.

use serde::Serialize;
pub use toothwave_solver::PerContact;
use toothwave_solver::backing::Estimate;
use toothwave_solver::backlash::Backlash;
use toothwave_solver::fingers::FingerStress;
use toothwave_solver::losses::period::RadialForces;
pub use toothwave_solver::mesh::TeethInMesh;
pub use toothwave_solver::model_error::ModelError;
pub use toothwave_solver::sweep::TorqueCapacity;
use toothwave_solver::sweep::{self as solver, ContactPeaks, Extremes, InputAngles, States};
use toothwave_solver::{Drive, SolveError};
use utoipa::ToSchema;

use crate::design::ModelDocument;
use crate::findings::FindingAnswer;
use crate::sweep::duty::DutyAnswer;
use crate::sweep::losses::LossesAnswer;

/// Forces and contact stresses over one period: of one meshing zone if the zones are alike, otherwise of all zones.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SweepAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give identical bytes.
    pub build: &'static str,
    /// Contact ratio ε, counted over all meshing zones.
    pub coincidence_degree: f64,
    /// Load period: input angle after which the load pattern repeats if no item deviates, in deg.
    pub period_deg: f64,
    /// Input angle of the sweep, in deg, with `deviations`: the number of load periods after which all items are back
    /// in their positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep_period_deg: Option<f64>,
    /// Load at both shafts, without losses.
    pub load: LoadAnswer,
    /// True if a tooth takes load as soon as it enters, because its flank ends before its lever arm becomes zero. The
    /// loads of the other teeth then jump.
    pub enters_under_load: bool,
    /// The largest force and stress of each contact, over the states. If the load along a tooth is uneven, stresses are
    /// those at its most loaded place (`fingers`).
    pub peaks: PerContact<ContactPeaks>,
    /// Numbers of teeth in mesh over the input angle: of one zone if the zones are alike, otherwise of all zones.
    pub teeth_in_mesh_per_zone: TeethInMesh,
    /// Numbers of teeth that carry load, over the input angles of the sweep. Clearance makes them fewer.
    pub loaded_teeth_per_zone: TeethInMesh,
    /// The states.
    pub states: StatesAnswer,
    /// Wind-up, torsional stiffness and backlash, with `sweep.wind_up`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wind_up: Option<WindUpAnswer>,
    /// Torque capacity, with `load.allowable_stress_mpa`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_capacity: Option<TorqueCapacity>,
    /// Strength of the carrier's fingers. Left out for balls, and for a carrier that cannot be made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fingers: Option<FingerStress>,
    /// Points of the duty, with `load.duty`. The other fields belong to the point with the largest torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duty: Option<DutyAnswer>,
    /// Friction losses, with `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub losses: Option<LossesAnswer>,
    /// Radial force of the teeth on the wave generator, in N. Left out if two or more lobes are loaded alike, because
    /// the forces then balance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radial_force_n: Option<RadialForces>,
    /// The complete model that was used. As `model` of the document it gives the same answer. Instead of deprecated
    /// switches it has `refinements`.
    pub model: ModelDocument,
    /// Error of the model against elastic bodies.
    pub model_error: ModelError,
    /// Compliances of the supports, estimated from `parts`. Forces include them only with
    /// `model.series_compliance_mm_per_n`. Balls, and parts that cannot be made, have none.
    pub series_compliance_estimates: Vec<Estimate>,
    /// Residuals of conditions that the results must meet.
    pub checks: ChecksAnswer,
    /// Findings for the designer.
    pub findings: Vec<FindingAnswer>,
}

/// Load at both shafts, ring fixed, without losses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct LoadAnswer {
    /// Torque M0 at the wave generator, in N·m.
    pub input_torque_nm: f64,
    /// Torque at the carrier, in N·m.
    pub output_torque_nm: f64,
}

/// Columns of equal length with one entry for each input angle and tooth in mesh, by input angle, then tooth number.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StatesAnswer {
    /// Input angle j, in deg.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number, counted from the middle of a lobe. If zones are unlike, it is the slot number; slot 0 is in the
    /// middle of lobe 0 at j = 0.
    pub tooth: Vec<u32>,
    /// Lobe of the tooth. Only if zones are unlike, so that all of them are listed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lobe: Option<Vec<u32>>,
    /// Position ψ of the tooth, from the middle of its lobe (the major axis of an ellipse), in deg.
    pub position_deg: Vec<f64>,
    /// Distance of the tooth's centre from the axis, in mm.
    pub center_radius_mm: Vec<f64>,
    /// Angle φ_H of the contact on the wave generator, from the valley before its lobe (the minor axis of an ellipse),
    /// in deg.
    pub wave_generator_angle_deg: Vec<f64>,
    /// Angle φ_K of the contact on the ring, from the tip of the ring's tooth, in deg.
    pub ring_angle_deg: Vec<f64>,
    /// Force F_H between tooth and wave generator, in N.
    pub force_wave_generator_n: Vec<f64>,
    /// Force F_K between tooth and ring, in N.
    pub force_ring_n: Vec<f64>,
    /// Force F_S between tooth and carrier, in N.
    pub force_carrier_n: Vec<f64>,
    /// Hertz stress σ_H between tooth and wave generator, in MPa.
    pub stress_wave_generator_mpa: Vec<f64>,
    /// Hertz stress σ_K between tooth and ring, in MPa. It is 0 at a corner (`corner_contact`), where it is not
    /// calculated.
    pub stress_ring_mpa: Vec<f64>,
    /// Hertz stress σ_S between tooth and carrier, in MPa.
    pub stress_carrier_mpa: Vec<f64>,
    /// True if the tooth carries load. Only with gaps or `corner_contact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loaded: Option<Vec<bool>>,
}

/// Quantities of all teeth together, in columns of equal length with one entry for each input angle.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WindUpAnswer {
    /// Backlash at the output, without load. Absent if a tooth has no space on a lobe or in a valley.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backlash: Option<Backlash>,
    /// Transmission error, peak to peak: range of the wind-up over the period, at the output, in deg.
    pub transmission_error_peak_to_peak_deg: f64,
    /// Transmission error without load, peak to peak, in deg. Only with gaps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unloaded_transmission_error_peak_to_peak_deg: Option<f64>,
    /// Input angle j, in deg.
    pub input_angle_deg: Vec<f64>,
    /// Wind-up: rotation of the wave generator under the load, carrier held, clearances included, in deg.
    pub wind_up_deg: Vec<f64>,
    /// Wind-up without load, in deg: rotation until the first tooth has closed its gaps. Only with gaps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unloaded_wind_up_deg: Option<Vec<f64>>,
    /// Torsional stiffness, in N·m/rad: output torque over output rotation at the load, wave generator held.
    pub torsional_stiffness_nm_per_rad: Vec<f64>,
    /// Number of teeth that carry load: of one zone if the zones are alike, otherwise of all teeth that `states` lists.
    pub loaded_teeth: Vec<u32>,
}

impl WindUpAnswer {
    pub(super) fn new(
        drive: &Drive,
        sweep: &solver::Sweep,
        backlash: Result<Backlash, SolveError>,
        unloaded_wind_up_deg: Option<Vec<f64>>,
    ) -> Result<Self, SolveError> {
        let unloaded_peak_to_peak_deg = unloaded_wind_up_deg.as_ref().map(|column| {
            let Extremes { least, largest } = Extremes::of(column);
            (largest - least) / drive.teeth_per_wave()
        });
        let InputAngles { input_angle_deg, wind_up_deg, torsional_stiffness_nm_per_rad, loaded_teeth, .. } =
            sweep.input_angles.clone();
        Ok(Self {
            backlash: match backlash {
                // A finding reports that a tooth has no space on a lobe or in a valley.
                Err(SolveError::Interference { .. }) => None,
                other => Some(other?),
            },
            transmission_error_peak_to_peak_deg: sweep.transmission_error_peak_to_peak_deg(drive),
            unloaded_transmission_error_peak_to_peak_deg: unloaded_peak_to_peak_deg,
            input_angle_deg,
            wind_up_deg,
            unloaded_wind_up_deg,
            torsional_stiffness_nm_per_rad,
            loaded_teeth,
        })
    }
}

/// Residuals of the conditions that the results must meet.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ChecksAnswer {
    /// Largest relative deviation of the input, ring and carrier torques from equilibrium, over the input angles.
    pub torque_balance_residual: f64,
    /// Largest difference of a load at the last input angle from its independent recalculation, over the column's peak.
    pub period_closure_residual: f64,
}

impl StatesAnswer {
    pub(super) fn new(states: States, with_gaps: bool) -> Self {
        let forces = &states.force_n.wave_generator;
        Self {
            loaded: with_gaps.then(|| forces.iter().map(|force| *force > 0.0).collect()),
            input_angle_deg: states.input_angle_deg,
            tooth: states.tooth,
            lobe: (!states.lobe.is_empty()).then_some(states.lobe),
            position_deg: states.position_deg,
            center_radius_mm: states.center_radius_mm,
            wave_generator_angle_deg: states.wave_generator_angle_deg,
            ring_angle_deg: states.ring_angle_deg,
            force_wave_generator_n: states.force_n.wave_generator,
            force_ring_n: states.force_n.ring,
            force_carrier_n: states.force_n.carrier,
            stress_wave_generator_mpa: states.stress_mpa.wave_generator,
            stress_ring_mpa: states.stress_mpa.ring,
            stress_carrier_mpa: states.stress_mpa.carrier,
        }
    }
}
