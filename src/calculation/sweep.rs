//! Forces and contact stresses over one period.

use std::io::{self, Write};

use toothwave_solver::losses::{Friction, Mechanism, period};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::{self as solver, Points};
use toothwave_solver::{Drive, LoadCase, SolveError, Stop, findings, model_error as error_of_model};

use crate::design::Design;
use crate::field::FieldCode;
use crate::findings::{FindingAnswer, drive_findings, write_findings};
use crate::forms::{Form, Format, Forms, csv_error};
use crate::json::word;
use crate::key::Encode;
use crate::no_answer::{NoAnswer, NoAnswerCode, too_many};
use crate::question::{Limits, Question, checked_drive, checked_load, require_finite};
use crate::sweep::answer::{ChecksAnswer, LoadAnswer, StatesAnswer, SweepAnswer, WindUpAnswer};
use crate::sweep::losses::{LossesAnswer, RadialForceAnswer};
use crate::sweep::model_error::ModelErrorAnswer;

pub mod answer;
pub mod losses;
pub mod model_error;
mod plots;

/// The checked parameters of a sweep.
#[derive(Debug)]
pub struct CheckedSweep {
    drive: Drive,
    load: LoadCase,
    friction: Option<Friction>,
    input_speed_rpm: Option<f64>,
    points: Points,
    with_gaps: bool,
    with_wind_up: bool,
}

/// What is asked.
#[derive(Debug)]
pub struct Sweep;

impl Question for Sweep {
    type Checked = CheckedSweep;
    type Answer = SweepAnswer;

    fn name(&self) -> &'static str {
        "sweep"
    }

    fn reads<'a>(&self, design: &'a Design) -> impl Encode + 'a {
        let Design { drive, materials, load, friction, model, modification, sweep, .. } = design;
        (drive, materials, load, friction, model, (modification, sweep))
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<CheckedSweep, NoAnswer> {
        let mut violations = Vec::new();
        let draft = checked_drive(design, &mut violations)?;
        // In the document's order: of structural faults the first is told.
        let load = checked_load(design, &draft, &mut violations)?;
        let friction = design.friction().unwrap_or_else(|found| {
            violations.extend(found);
            None
        });
        let points = design.sweep_points(limits.max_states)?;
        let (drive, load, points) = match (draft.drive(), load, points) {
            (Some(drive), Some(load), Ok(points)) if violations.is_empty() => (drive, load, points),
            (_, _, points) => {
                violations.extend(points.err());
                return Err(NoAnswer::impossible(&violations));
            }
        };
        if let Points::Samples(samples) = points {
            let (states, limit) = (Mesh::new(&drive).state_count(samples), limits.max_states);
            if states > limit {
                let detail = format!(
                    "the sweep has {states} states (input angles times teeth in mesh), more than the {limit} of `max_states`; take fewer samples"
                );
                let (code, field_code) = (NoAnswerCode::TooManyStates, FieldCode::TooManyStates);
                return Err(too_many(code, field_code, "/sweep/samples", &detail, Some(states), limit));
            }
        }
        let with_gaps = design.model.clearance.is_some() || load.has_gaps();
        // In its range, or its violation would be among the others.
        let input_speed_rpm = design.input_speed_rpm().unwrap_or_default();
        let with_wind_up = design.sweep.wind_up;
        Ok(CheckedSweep { drive, load, friction, input_speed_rpm, points, with_gaps, with_wind_up })
    }

    fn columns_bytes(checked: &CheckedSweep) -> u64 {
        // Eleven columns of doubles and one of teeth; of a sweep to a tolerance nobody knows how long they will be.
        const STATE_BYTES: u64 = 11 * 8 + 4;
        // Three columns of slips and one of words.
        const LOSSES_BYTES: u64 = 3 * 8 + 2;
        match checked.points {
            Points::Samples(samples) => {
                let of_losses = if checked.friction.is_some() { LOSSES_BYTES } else { 0 };
                (STATE_BYTES + of_losses) * Mesh::new(&checked.drive).state_count(samples)
            }
            Points::Tolerance { .. } => 0,
        }
    }

    fn is_short(checked: &CheckedSweep) -> bool {
        /// They are solved and written in about 0.1 ms; with Palmgren's law and all that can be asked for in a quarter of a millisecond.
        const FEW_STATES: u64 = 400;
        let CheckedSweep { drive, friction, points, with_gaps, .. } = checked;
        match points {
            Points::Samples(samples) => {
                !with_gaps && friction.is_none() && Mesh::new(drive).state_count(*samples) <= FEW_STATES
            }
            Points::Tolerance { .. } => false,
        }
    }

    fn answer(checked: &CheckedSweep, stop: &impl Stop) -> Result<SweepAnswer, NoAnswer> {
        let CheckedSweep { drive, load, friction, input_speed_rpm, points, with_gaps, with_wind_up } = checked;
        let sweep = solver::sweep(drive, load, *points, stop)?;
        let mesh = Mesh::new(drive);
        let mut findings = drive_findings(drive)?;
        let approaches_matter = *with_wind_up || load.has_gaps();
        let of_contacts = findings::of_contacts(drive, load, &sweep.peaks, approaches_matter);
        let of_half_widths = findings::of_half_widths(drive, load, &sweep.states);
        let of_wind_up = findings::of_wind_up(drive, &sweep);
        let of_projection = findings::of_projection(drive, load).map_err(SolveError::from)?;
        let model_error = error_of_model::of(drive, load, &sweep).map_err(SolveError::from)?;
        let radial_force_n = period::RadialForces::of(drive, &sweep, stop)?
            .map(|forces| RadialForceAnswer::new(&sweep, forces))
            .transpose()?;
        let mut of_friction = None;
        let mut losses = None;
        if let Some(friction) = friction {
            let of_period = period::Losses::of(drive, &sweep, friction, stop)?;
            of_friction = findings::of_friction(&Mechanism::of(drive), friction, of_period.mean.total());
            let input_torque_nm = load.input_torque_nm(drive);
            losses = Some(LossesAnswer::new(drive, friction, input_torque_nm, *input_speed_rpm, &sweep, of_period)?);
        }
        let of_sweep =
            of_wind_up.iter().chain(&of_half_widths).chain(&of_friction).chain(&of_projection).chain(&of_contacts);
        findings.extend(of_sweep.map(FindingAnswer::from));
        let answer = SweepAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            coincidence_degree: mesh.coincidence_degree(),
            period_deg: mesh.period_deg(),
            load: LoadAnswer {
                input_torque_nm: load.input_torque_nm(drive),
                output_torque_nm: load.output_torque_nm(drive),
            },
            enters_under_load: drive.flank_limit().end != FlankEnd::RegularTip,
            peaks: sweep.peaks.into(),
            teeth_in_mesh_per_zone: mesh.teeth_in_mesh().into(),
            loaded_teeth_per_zone: sweep.loaded_teeth().into(),
            wind_up: with_wind_up.then(|| WindUpAnswer::new(drive, &sweep)),
            torque_capacity: sweep.torque_capacity.map(Into::into),
            losses,
            radial_force_n,
            model_error: ModelErrorAnswer::new(load, model_error),
            checks: ChecksAnswer {
                torque_balance_residual: sweep.torque_balance_residual,
                period_closure_residual: sweep.period_closure_residual,
            },
            states: StatesAnswer::new(sweep.states, *with_gaps),
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
        let of_losses = if self.losses.is_some() { 80 } else { 0 };
        4096 + (220 + of_losses) * self.states.tooth.len()
    }
}

impl SweepAnswer {
    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let states = &self.states;
        let mut csv = csv::Writer::from_writer(writer);
        let names = STATE_COLUMNS.iter().chain(states.lobe.as_ref().map(|_| &"lobe"));
        csv.write_record(names.chain(states.loaded.as_ref().map(|_| &"loaded"))).map_err(csv_error)?;
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
            match (&states.lobe, &states.loaded) {
                (None, None) => csv.serialize(state),
                (Some(lobe), None) => csv.serialize((state, lobe[i])),
                (None, Some(loaded)) => csv.serialize((state, loaded[i])),
                (Some(lobe), Some(loaded)) => csv.serialize((state, lobe[i], loaded[i])),
            }
            .map_err(csv_error)?;
        }
        csv.flush()
    }

    fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "coincidence degree                  {:.12}", self.coincidence_degree)?;
        writeln!(writer, "period of the input angle           {:.6} deg", self.period_deg)?;
        writeln!(writer, "teeth in mesh per zone              {}", self.teeth_in_mesh_per_zone)?;
        writeln!(writer, "teeth that carry per zone           {}", self.loaded_teeth_per_zone)?;
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
        if let Some(losses) = &self.losses {
            losses.write_text(writer)?;
        }
        if let Some(radial_force) = &self.radial_force_n {
            let most_n = radial_force.value.iter().copied().fold(0.0, f64::max);
            writeln!(writer, "\nlargest force on the wave generator {most_n:.6} N, across its axis")?;
        }
        self.model_error.write_text(writer)?;
        write_findings(&self.findings, writer)
    }
}
