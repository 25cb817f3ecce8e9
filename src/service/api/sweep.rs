//! `POST /v1/sweep`: forces and contact stresses over one period.

use std::io::{self, Write};
use std::sync::atomic::AtomicBool;

use axum::extract::{Request, State};
use axum::response::Response;
use serde::Serialize;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::sweep::{self as solver, ContactPeaks, Peak, States};
use toothwave_solver::{Drive, LoadCase, PerContact, findings};
use utoipa::ToSchema;

use super::geometry::{drive_findings, write_findings};
use super::{App, Endpoint, Problems, Tabular, checked_drive, csv_error, require_finite, respond};
use crate::config::Limits;
use crate::design::Design;
use crate::findings::FindingAnswer;
use crate::negotiation::Format;
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
    /// The largest force and stress of each contact, over the states.
    pub peaks: PeaksAnswer,
    /// The states.
    pub states: StatesAnswer,
    /// How well the results fulfil what must hold.
    pub checks: ChecksAnswer,
    /// What a designer should be told.
    pub findings: Vec<FindingAnswer>,
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
}

/// How well the results fulfil what must hold.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ChecksAnswer {
    /// Largest relative deviation of the input, ring and carrier torques, over the input angles.
    pub torque_balance_residual: f64,
    /// Largest difference between the last input angle and the first, teeth renumbered, over the column's peak.
    pub period_closure_residual: f64,
}

impl From<States> for StatesAnswer {
    fn from(states: States) -> Self {
        Self {
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
    fn from(ContactPeaks { force_n, stress_mpa }: ContactPeaks) -> Self {
        Self { force_n: force_n.into(), stress_mpa: stress_mpa.into() }
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
    samples: u64,
}

/// The endpoint.
#[derive(Debug)]
pub struct Sweep;

impl Endpoint for Sweep {
    const NAME: &'static str = "sweep";
    const FORMATS: &'static [Format] = &[Format::Json, Format::Csv];
    type Question = SweepQuestion;
    type Answer = SweepAnswer;

    fn reads(design: &Design) -> impl Serialize + '_ {
        (&design.drive, &design.materials, &design.load, &design.model, &design.sweep)
    }

    fn question(design: &Design, limits: &Limits) -> Result<SweepQuestion, Problem> {
        let load = design.load_case()?;
        let mut violations = Vec::new();
        let drive = checked_drive(design, &mut violations)?;
        let (drive, load, samples) = match (drive, load, design.samples()) {
            (Some(drive), Ok(load), Ok(samples)) => (drive, load, samples),
            (_, load, samples) => {
                violations.extend(load.err().into_iter().flatten());
                violations.extend(samples.err());
                return Err(Problem::impossible(&violations));
            }
        };
        let states = Mesh::new(&drive).state_count(samples);
        let limit = limits.max_states;
        if states > limit {
            let detail = format!(
                "the sweep has {states} states (input angles times teeth in mesh), more than the {limit} of `max_states`"
            );
            let (code, field_code) = (ProblemCode::TooManyStates, FieldCode::TooManyStates);
            return Err(too_many(code, field_code, "/sweep/samples", &detail, states, limit));
        }
        Ok(SweepQuestion { drive, load, samples })
    }

    fn answer(question: &SweepQuestion, stop: &AtomicBool) -> Result<SweepAnswer, Problem> {
        let SweepQuestion { drive, load, samples } = question;
        let sweep = solver::sweep(drive, load, *samples, stop)?;
        let mesh = Mesh::new(drive);
        let mut findings = drive_findings(drive)?;
        findings.extend(findings::of_peaks(&sweep.peaks).iter().map(FindingAnswer::from));
        let answer = SweepAnswer {
            solver_version: toothwave_solver::VERSION,
            coincidence_degree: mesh.coincidence_degree(),
            period_deg: mesh.period_deg(),
            peaks: sweep.peaks.into(),
            states: sweep.states.into(),
            checks: ChecksAnswer {
                torque_balance_residual: sweep.torque_balance_residual,
                period_closure_residual: sweep.period_closure_residual,
            },
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
        Ok(answer)
    }
}

impl Tabular for SweepAnswer {
    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record([
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
        ])
        .map_err(csv_error)?;
        let states = &self.states;
        for i in 0..states.tooth.len() {
            csv.serialize((
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
            ))
            .map_err(csv_error)?;
        }
        csv.flush()
    }

    fn write_table(&self, writer: &mut dyn Write) -> io::Result<()> {
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
        write_findings(&self.findings, writer)
    }
}

/// Forces and contact stresses over one period.
#[utoipa::path(
    post,
    path = "/v1/sweep",
    tag = "drive",
    request_body(content = Design, description = "Reads all but `profile`; `load` is required."),
    responses(
        (status = 200, description = "The sweep. As CSV: one line a state, with the names of the columns of `states`.",
            content((SweepAnswer = "application/json"), (String = "text/csv"))),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn sweep(State(app): State<App>, request: Request) -> Response {
    respond::<Sweep>(app, request).await
}
