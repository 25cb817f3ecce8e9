//! A sweep as it goes over the wire.

use serde::Serialize;
use toothwave_solver::sweep::{self as solver, ContactPeaks, Extremes, InputAngles, States, TorqueCapacity};
use toothwave_solver::{Drive, PerContact};
use utoipa::ToSchema;

use crate::coincidence_degree::TeethInMeshAnswer;
use crate::design::ModelDocument;
use crate::findings::FindingAnswer;
use crate::sweep::backing::EstimateAnswer;
use crate::sweep::contact::ContactName;
use crate::sweep::duty::DutyAnswer;
use crate::sweep::losses::{LossesAnswer, RadialForceAnswer};
use crate::sweep::model_error::ModelErrorAnswer;
use crate::sweep::peak::PeakAnswer;

/// Forces and contact stresses over one period: of one meshing zone where the zones are alike, elsewhere of all of them.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SweepAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// The build that computed it: equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// Contact ratio ε, counted over all meshing zones.
    pub coincidence_degree: f64,
    /// The input angle after which the load pattern repeats, where no item deviates.
    pub period_deg: f64,
    /// The input angle that the sweep goes over, given `deviations`: so many of these periods as it takes until the items that deviate meet
    /// again as they did.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub sweep_period_deg: Option<f64>,
    /// The load at both shafts.
    pub load: LoadAnswer,
    /// Whether a tooth takes load the moment it enters, because its flank ends before the place where its lever arm is zero: the
    /// others' loads then jump.
    pub enters_under_load: bool,
    /// The largest force and stress of each contact, over the states.
    pub peaks: PeaksAnswer,
    /// How many teeth mesh, over the input angle: of a zone where the zones are alike, elsewhere of all of them together.
    pub teeth_in_mesh_per_zone: TeethInMeshAnswer,
    /// How many of them carry load, over the input angles of the sweep: with clearance fewer.
    pub loaded_teeth_per_zone: TeethInMeshAnswer,
    /// The states.
    pub states: StatesAnswer,
    /// Wind-up and torsional stiffness, given `sweep.wind_up`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub wind_up: Option<WindUpAnswer>,
    /// The torque capacity, given `load.allowable_stress_mpa`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub torque_capacity: Option<TorqueCapacityAnswer>,
    /// The points of the duty, given `load.duty`: what stands beside it is of the one with the largest torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub duty: Option<DutyAnswer>,
    /// What friction takes, given `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub losses: Option<LossesAnswer>,
    /// What the teeth push the wave generator aside with, in N, where no two lobes are loaded alike; elsewhere they balance each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub radial_force_n: Option<RadialForceAnswer>,
    /// The complete model that was used: in the place of the document's `model` it gives the same answer.
    pub model: ModelDocument,
    /// How far the model is off elastic bodies.
    pub model_error: ModelErrorAnswer,
    /// What gives way behind the contacts, estimated from the document's `parts`, each a number for `model.series_compliance_mm_per_n`; nothing of it is in the
    /// forces. Of parts that cannot be made, and of balls, there are none.
    pub series_compliance_estimates: Vec<EstimateAnswer>,
    /// How well the results fulfil what must hold.
    pub checks: ChecksAnswer,
    /// What a designer should be told.
    pub findings: Vec<FindingAnswer>,
}

/// The load as it is seen from either shaft, ring fixed, losses neglected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct LoadAnswer {
    /// At the wave generator.
    pub input_torque_nm: f64,
    /// At the carrier.
    pub output_torque_nm: f64,
}

/// The peaks of each contact.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PeaksAnswer {
    /// Between tooth and wave generator.
    pub wave_generator: ContactPeaksAnswer,
    /// Between tooth and ring.
    pub ring: ContactPeaksAnswer,
    /// Between tooth and carrier.
    pub carrier: ContactPeaksAnswer,
}

/// The peaks of a contact.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ContactPeaksAnswer {
    /// Of its normal force, in N.
    pub force_n: PeakAnswer,
    /// Of its Hertz stress, in MPa.
    pub stress_mpa: PeakAnswer,
    /// Half the width of the contact, in the plane of motion, where the stress has its peak.
    pub half_width_mm: f64,
    /// Half its length along the axis there, of a ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub half_length_mm: Option<f64>,
    /// The largest shear stress below the surface there; left out under a flat, whose edges are not modelled.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub shear_stress_mpa: Option<f64>,
    /// How deep it stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub shear_depth_mm: Option<f64>,
}

/// Columns of equal length: one entry for each input angle and tooth in mesh, by input angle, then tooth number.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StatesAnswer {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number, from the middle of a lobe on; where zones are unlike, the number of its slot, slot 0 standing in the middle of lobe 0 at j = 0.
    pub tooth: Vec<u32>,
    /// The lobe that the tooth is on, where zones are unlike and all of them are listed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub lobe: Option<Vec<u32>>,
    /// Position ψ of the tooth, from the middle of its lobe: the major axis of an ellipse.
    pub position_deg: Vec<f64>,
    /// Distance of the tooth's centre from the axis.
    pub center_radius_mm: Vec<f64>,
    /// φ_H: contact on the wave generator, from the valley before its lobe: the minor axis of an ellipse.
    pub wave_generator_angle_deg: Vec<f64>,
    /// φ_K: contact on the ring, from the ring's tooth tip.
    pub ring_angle_deg: Vec<f64>,
    /// Force F_H between tooth and wave generator.
    pub force_wave_generator_n: Vec<f64>,
    /// Force F_K between tooth and ring.
    pub force_ring_n: Vec<f64>,
    /// Force F_S between tooth and carrier.
    pub force_carrier_n: Vec<f64>,
    /// Hertz stress σ_H between tooth and wave generator.
    pub stress_wave_generator_mpa: Vec<f64>,
    /// Hertz stress σ_K between tooth and ring; 0 at a corner (`corner_contact`), of which none is told.
    pub stress_ring_mpa: Vec<f64>,
    /// Hertz stress σ_S between tooth and carrier.
    pub stress_carrier_mpa: Vec<f64>,
    /// Whether the tooth carries load, where there are gaps or `corner_contact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub loaded: Option<Vec<bool>>,
}

/// What holds for all teeth at an input angle, in columns of equal length: one entry an input angle.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WindUpAnswer {
    /// Range of the wind-up over the period, at the output.
    pub transmission_error_peak_to_peak_deg: f64,
    /// The same without load, where there are gaps.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub unloaded_transmission_error_peak_to_peak_deg: Option<f64>,
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// How far the wave generator turns under the load, carrier held, clearances included.
    pub wind_up_deg: Vec<f64>,
    /// How far it turns before the first tooth has closed its gaps, where there are any: the wind-up as the torque goes to nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub unloaded_wind_up_deg: Option<Vec<f64>>,
    /// Output torque over output rotation at the load, wave generator held.
    pub torsional_stiffness_nm_per_rad: Vec<f64>,
    /// Teeth that carry load: of one zone where the zones are alike, elsewhere of all that `states` lists.
    pub loaded_teeth: Vec<u32>,
}

/// The largest torque under which no contact exceeds the allowable stress, over the input angles of the sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct TorqueCapacityAnswer {
    /// At the wave generator.
    pub input_torque_nm: f64,
    /// At the carrier.
    pub output_torque_nm: f64,
    /// The contact that limits it; where `turns_past_teeth`, the one that is nearest to its allowable stress.
    pub limited_by: ContactName,
    /// Whether no contact reaches its stress under any torque that the teeth carry: the wave generator moves on, and beyond this torque would turn past them.
    /// Left out where it does not.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub turns_past_teeth: bool,
    /// The input angle where it is so.
    pub input_angle_deg: f64,
}

impl WindUpAnswer {
    pub(super) fn new(drive: &Drive, sweep: &solver::Sweep, unloaded_wind_up_deg: Option<Vec<f64>>) -> Self {
        let unloaded_peak_to_peak_deg = unloaded_wind_up_deg.as_ref().map(|column| {
            let Extremes { least, largest } = Extremes::of(column);
            (largest - least) / drive.teeth_per_wave()
        });
        let InputAngles { input_angle_deg, wind_up_deg, torsional_stiffness_nm_per_rad, loaded_teeth } =
            sweep.input_angles.clone();
        Self {
            transmission_error_peak_to_peak_deg: sweep.transmission_error_peak_to_peak_deg(drive),
            unloaded_transmission_error_peak_to_peak_deg: unloaded_peak_to_peak_deg,
            input_angle_deg,
            wind_up_deg,
            unloaded_wind_up_deg,
            torsional_stiffness_nm_per_rad,
            loaded_teeth,
        }
    }
}

impl From<TorqueCapacity> for TorqueCapacityAnswer {
    fn from(capacity: TorqueCapacity) -> Self {
        let TorqueCapacity { input_torque_nm, output_torque_nm, contact, turns_past_teeth, input_angle_deg } = capacity;
        Self { input_torque_nm, output_torque_nm, limited_by: contact.into(), turns_past_teeth, input_angle_deg }
    }
}

/// How well the results fulfil what must hold.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ChecksAnswer {
    /// Largest relative deviation of the input, ring and carrier torques, over the input angles.
    pub torque_balance_residual: f64,
    /// Largest difference of a load at the last input angle from that angle worked out anew, over the column's peak.
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

impl From<ContactPeaks> for ContactPeaksAnswer {
    fn from(ContactPeaks { force_n, stress_mpa, half_width_mm, half_length_mm, shear }: ContactPeaks) -> Self {
        Self {
            half_width_mm,
            half_length_mm,
            shear_stress_mpa: shear.map(|shear| shear.stress_mpa),
            shear_depth_mm: shear.map(|shear| shear.depth_mm),
            force_n: force_n.into(),
            stress_mpa: stress_mpa.into(),
        }
    }
}

impl From<PerContact<ContactPeaks>> for PeaksAnswer {
    fn from(peaks: PerContact<ContactPeaks>) -> Self {
        Self { wave_generator: peaks.wave_generator.into(), ring: peaks.ring.into(), carrier: peaks.carrier.into() }
    }
}
