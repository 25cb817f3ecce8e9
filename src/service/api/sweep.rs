//! `POST /v1/sweep`: forces and contact stresses over one period.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::extract::{Request, State};
use axum::response::Response;
use serde::Serialize;
use toothwave_solver::contact::{SHEAR_DEPTH, SHEAR_SHARE};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::{self as solver, ContactPeaks, InputAngles, Peak, Points, States, TorqueCapacity};
use toothwave_solver::{Contact, Drive, LoadCase, PerContact, findings};
use utoipa::ToSchema;

use super::geometry::{drive_findings, write_findings};
use super::{App, Endpoint, Form, Forms, Problems, checked_drive, checked_load, csv_error, require_finite, respond};
use crate::compute::Thread;
use crate::config::Limits;
use crate::design::Design;
use crate::findings::FindingAnswer;
use crate::json::word;
use crate::negotiation::Format;
use crate::plots;
use crate::problem::{FieldCode, Problem, ProblemCode, too_many};

/// Forces and contact stresses of one meshing zone over one period; the other zone is its point reflection.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SweepAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Contact ratio ε, counted over both meshing zones.
    pub coincidence_degree: f64,
    /// The input angle after which the load pattern repeats.
    pub period_deg: f64,
    /// The load at both shafts.
    pub load: LoadAnswer,
    /// Whether a tooth takes load the moment it enters, because its flank ends before the place where its lever arm is zero: the
    /// others' loads then jump.
    pub enters_under_load: bool,
    /// The largest force and stress of each contact, over the states.
    pub peaks: PeaksAnswer,
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
    /// Half the width of the contact where the stress has its peak.
    pub half_width_mm: f64,
    /// The largest shear stress below the surface there, in the plane of the section.
    pub shear_stress_mpa: f64,
    /// How deep it stands.
    pub shear_depth_mm: f64,
}

/// A largest value and where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PeakAnswer {
    /// The value, in the unit of the field that holds the peak.
    pub value: f64,
    /// Input angle.
    pub input_angle_deg: f64,
    /// Position of the tooth, from the major axis.
    pub position_deg: f64,
}

/// Columns of equal length: one entry for each input angle and tooth in mesh, by input angle, then tooth number.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StatesAnswer {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number; tooth 0 stands on the major axis at j = 0.
    pub tooth: Vec<u32>,
    /// Position ψ of the tooth, from the major axis.
    pub position_deg: Vec<f64>,
    /// Distance of the tooth's centre from the axis.
    pub center_radius_mm: Vec<f64>,
    /// φ_H: contact on the wave generator, from its minor axis.
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
    /// Hertz stress σ_K between tooth and ring.
    pub stress_ring_mpa: Vec<f64>,
    /// Hertz stress σ_S between tooth and carrier.
    pub stress_carrier_mpa: Vec<f64>,
    /// Whether the tooth carries load, given `model.clearance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub loaded: Option<Vec<bool>>,
}

/// What holds for all teeth at an input angle, in columns of equal length: one entry an input angle.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WindUpAnswer {
    /// Range of the wind-up over the period, at the output.
    pub transmission_error_peak_to_peak_deg: f64,
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// How far the wave generator turns under the load, carrier held, clearances included.
    pub wind_up_deg: Vec<f64>,
    /// Output torque over output rotation at the load, wave generator held.
    pub torsional_stiffness_nm_per_rad: Vec<f64>,
    /// Teeth of one zone that carry load.
    pub loaded_teeth: Vec<u32>,
}

/// The largest torque under which no contact exceeds the allowable stress, over the input angles of the sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct TorqueCapacityAnswer {
    /// At the wave generator.
    pub input_torque_nm: f64,
    /// At the carrier.
    pub output_torque_nm: f64,
    /// The contact that limits it.
    pub limited_by: ContactName,
    /// The input angle where it does.
    pub input_angle_deg: f64,
}

/// A contact of a tooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactName {
    /// With the wave generator.
    WaveGenerator,
    /// With the ring.
    Ring,
    /// With the carrier.
    Carrier,
}

impl From<Contact> for ContactName {
    fn from(contact: Contact) -> Self {
        match contact {
            Contact::WaveGenerator => Self::WaveGenerator,
            Contact::Ring => Self::Ring,
            Contact::Carrier => Self::Carrier,
        }
    }
}

impl WindUpAnswer {
    fn new(drive: &Drive, sweep: &solver::Sweep) -> Self {
        let InputAngles { input_angle_deg, wind_up_deg, torsional_stiffness_nm_per_rad, loaded_teeth } =
            sweep.input_angles.clone();
        Self {
            transmission_error_peak_to_peak_deg: sweep.transmission_error_peak_to_peak_deg(drive),
            input_angle_deg,
            wind_up_deg,
            torsional_stiffness_nm_per_rad,
            loaded_teeth,
        }
    }
}

impl From<TorqueCapacity> for TorqueCapacityAnswer {
    fn from(capacity: TorqueCapacity) -> Self {
        let TorqueCapacity { input_torque_nm, output_torque_nm, contact, input_angle_deg } = capacity;
        Self { input_torque_nm, output_torque_nm, limited_by: contact.into(), input_angle_deg }
    }
}

/// How well the results fulfil what must hold.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ChecksAnswer {
    /// Largest relative deviation of the input, ring and carrier torques, over the input angles.
    pub torque_balance_residual: f64,
    /// Largest difference between the last input angle and the first, teeth renumbered, over the column's peak.
    pub period_closure_residual: f64,
}

impl StatesAnswer {
    fn new(states: States, with_clearance: bool) -> Self {
        let forces = &states.force_n.wave_generator;
        Self {
            loaded: with_clearance.then(|| forces.iter().map(|force| *force > 0.0).collect()),
            input_angle_deg: states.input_angle_deg,
            tooth: states.tooth,
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

impl From<Peak> for PeakAnswer {
    fn from(Peak { value, input_angle_deg, position_deg }: Peak) -> Self {
        Self { value, input_angle_deg, position_deg }
    }
}

impl From<ContactPeaks> for ContactPeaksAnswer {
    fn from(ContactPeaks { force_n, stress_mpa, half_width_mm }: ContactPeaks) -> Self {
        Self {
            shear_stress_mpa: SHEAR_SHARE * stress_mpa.value,
            shear_depth_mm: SHEAR_DEPTH * half_width_mm,
            half_width_mm,
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

/// The checked parameters of a sweep.
#[derive(Debug)]
pub struct SweepQuestion {
    drive: Drive,
    load: LoadCase,
    points: Points,
    with_clearance: bool,
    with_wind_up: bool,
}

/// The endpoint.
#[derive(Debug)]
pub struct Sweep;

impl Endpoint for Sweep {
    type Question = SweepQuestion;
    type Answer = SweepAnswer;

    fn name(&self) -> &'static str {
        "sweep"
    }

    fn reads<'a>(&self, design: &'a Design) -> impl Serialize + 'a {
        (&design.drive, &design.materials, &design.load, &design.model, &design.sweep)
    }

    fn question(&self, design: &Design, limits: &Limits) -> Result<SweepQuestion, Problem> {
        let mut violations = Vec::new();
        let draft = checked_drive(design, &mut violations)?;
        // In the document's order: of structural faults the first is told.
        let load = checked_load(design, &draft, &mut violations)?;
        let points = design.sweep_points(limits.max_states)?;
        let (drive, load, points) = match (draft.drive(), load, points) {
            (Some(drive), Some(load), Ok(points)) if violations.is_empty() => (drive, load, points),
            (_, _, points) => {
                violations.extend(points.err());
                return Err(Problem::impossible(&violations));
            }
        };
        if let Points::Samples(samples) = points {
            let (states, limit) = (Mesh::new(&drive).state_count(samples), limits.max_states);
            if states > limit {
                let detail = format!(
                    "the sweep has {states} states (input angles times teeth in mesh), more than the {limit} of `max_states`; take fewer samples"
                );
                let (code, field_code) = (ProblemCode::TooManyStates, FieldCode::TooManyStates);
                return Err(too_many(code, field_code, "/sweep/samples", &detail, Some(states), limit));
            }
        }
        let (with_clearance, with_wind_up) = (design.model.clearance.is_some(), design.sweep.wind_up);
        Ok(SweepQuestion { drive, load, points, with_clearance, with_wind_up })
    }

    fn thread(question: &SweepQuestion) -> Thread {
        /// They are solved and written in about 0.1 ms; with Palmgren's law and all that can be asked for in a quarter of a millisecond.
        const FEW_STATES: u64 = 400;
        let SweepQuestion { drive, points, with_clearance, .. } = question;
        match points {
            Points::Samples(samples) if !with_clearance && Mesh::new(drive).state_count(*samples) <= FEW_STATES => {
                Thread::Executor
            }
            _ => Thread::Blocking,
        }
    }

    fn answer(question: &SweepQuestion, stop: &AtomicBool) -> Result<SweepAnswer, Problem> {
        let SweepQuestion { drive, load, points, with_clearance, with_wind_up } = question;
        let sweep = solver::sweep(drive, load, *points, stop)?;
        let mesh = Mesh::new(drive);
        let mut findings = drive_findings(drive)?;
        let approaches_matter = *with_wind_up || load.has_clearance();
        let of_contacts = findings::of_contacts(drive, load, &sweep.peaks, approaches_matter);
        findings.extend(of_contacts.iter().map(FindingAnswer::from));
        let answer = SweepAnswer {
            solver_version: toothwave_solver::VERSION,
            coincidence_degree: mesh.coincidence_degree(),
            period_deg: mesh.period_deg(),
            load: LoadAnswer {
                input_torque_nm: load.input_torque_nm(drive),
                output_torque_nm: load.output_torque_nm(drive),
            },
            enters_under_load: drive.flank_limit().end != FlankEnd::RegularTip,
            peaks: sweep.peaks.into(),
            wind_up: with_wind_up.then(|| WindUpAnswer::new(drive, &sweep)),
            torque_capacity: sweep.torque_capacity.map(Into::into),
            checks: ChecksAnswer {
                torque_balance_residual: sweep.torque_balance_residual,
                period_closure_residual: sweep.period_closure_residual,
            },
            states: StatesAnswer::new(sweep.states, *with_clearance),
            findings,
        };
        let states = &answer.states;
        require_finite([
            &states.center_radius_mm,
            &states.wave_generator_angle_deg,
            &states.ring_angle_deg,
            &states.force_wave_generator_n,
            &states.force_ring_n,
            &states.force_carrier_n,
            &states.stress_wave_generator_mpa,
            &states.stress_ring_mpa,
            &states.stress_carrier_mpa,
        ])?;
        if let Some(wind_up) = &answer.wind_up {
            require_finite([&wind_up.wind_up_deg, &wind_up.torsional_stiffness_nm_per_rad])?;
        }
        Ok(answer)
    }
}

/// The columns of the states, as JSON and CSV name them.
const STATE_COLUMNS: [&str; 12] = [
    "input_angle_deg",
    "tooth",
    "position_deg",
    "center_radius_mm",
    "wave_generator_angle_deg",
    "ring_angle_deg",
    "force_wave_generator_n",
    "force_ring_n",
    "force_carrier_n",
    "stress_wave_generator_mpa",
    "stress_ring_mpa",
    "stress_carrier_mpa",
];

impl Forms for SweepAnswer {
    const FORMS: &'static [(Format, Form<Self>)] =
        &[(Format::Csv, Self::write_csv), (Format::Text, Self::write_text), (Format::Svg, plots::write)];

    fn expected_bytes(&self) -> usize {
        // Eleven numbers of about 18 characters and a short one, each with its comma.
        4096 + 220 * self.states.tooth.len()
    }
}

impl SweepAnswer {
    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let states = &self.states;
        let mut csv = csv::Writer::from_writer(writer);
        let names = STATE_COLUMNS.iter().chain(states.loaded.as_ref().map(|_| &"loaded"));
        csv.write_record(names).map_err(csv_error)?;
        for i in 0..states.tooth.len() {
            let state = (
                states.input_angle_deg[i],
                states.tooth[i],
                states.position_deg[i],
                states.center_radius_mm[i],
                states.wave_generator_angle_deg[i],
                states.ring_angle_deg[i],
                states.force_wave_generator_n[i],
                states.force_ring_n[i],
                states.force_carrier_n[i],
                states.stress_wave_generator_mpa[i],
                states.stress_ring_mpa[i],
                states.stress_carrier_mpa[i],
            );
            match &states.loaded {
                Some(loaded) => csv.serialize((state, loaded[i])),
                None => csv.serialize(state),
            }
            .map_err(csv_error)?;
        }
        csv.flush()
    }

    fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "coincidence degree                  {:.12}", self.coincidence_degree)?;
        writeln!(writer, "period of the input angle           {:.6} deg", self.period_deg)?;
        writeln!(writer, "states                              {}", self.states.tooth.len())?;
        writeln!(writer, "torque balance residual             {:.1e}", self.checks.torque_balance_residual)?;
        writeln!(writer, "period closure residual             {:.1e}", self.checks.period_closure_residual)?;
        writeln!(writer, "\npeak                              value   input angle      position")?;
        let contacts = [
            ("wave generator", &self.peaks.wave_generator),
            ("ring", &self.peaks.ring),
            ("carrier", &self.peaks.carrier),
        ];
        for (name, contact) in contacts {
            for (quantity, unit, peak) in [("force", "N", &contact.force_n), ("stress", "MPa", &contact.stress_mpa)] {
                writeln!(
                    writer,
                    "{name:<14} {quantity:<6} {:>14.3} {unit:<3} {:>9.4} deg {:>9.4} deg",
                    peak.value, peak.input_angle_deg, peak.position_deg
                )?;
            }
        }
        if let Some(capacity) = &self.torque_capacity {
            writeln!(
                writer,
                "\ntorque capacity, input and output   {:.6} and {:.6} N·m, limited by {} at {:.4} deg",
                capacity.input_torque_nm,
                capacity.output_torque_nm,
                word(&capacity.limited_by),
                capacity.input_angle_deg
            )?;
        }
        if let Some(wind_up) = &self.wind_up {
            let range = |column: &[f64]| {
                let least = column.iter().copied().fold(f64::INFINITY, f64::min);
                (least, column.iter().copied().fold(f64::NEG_INFINITY, f64::max))
            };
            let (least, most) = range(&wind_up.wind_up_deg);
            let (softest, stiffest) = range(&wind_up.torsional_stiffness_nm_per_rad);
            let error_deg = wind_up.transmission_error_peak_to_peak_deg;
            writeln!(writer, "\nwind-up of the input                {least:.6} to {most:.6} deg")?;
            writeln!(writer, "torsional stiffness at the output   {softest:.6e} to {stiffest:.6e} N·m/rad")?;
            writeln!(writer, "transmission error, peak to peak    {error_deg:.3e} deg")?;
        }
        write_findings(&self.findings, writer)
    }
}

/// Forces and contact stresses over one period.
#[utoipa::path(
    post,
    path = "/v1/sweep",
    tag = "drive",
    request_body(content = Design, description = "Reads all but `profile`; `load` is required."),
    params(("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The sweep. As CSV one line a state, with the names of the columns of `states`; as text a summary; as SVG its plots.",
            content((SweepAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"), (String = "image/svg+xml")), headers(
                ("ETag" = String, description = "Entity tag of this representation."),
                ("Cache-Status" = String, description = "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
                ("Server-Timing" = String, description = "`solve;dur=` and the milliseconds of the solve.")
            )),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn sweep(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Sweep, app, request).await
}
