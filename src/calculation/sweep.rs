//! Forces and contact stresses over one period.

pub mod answer;
mod arrow;
pub mod duty;
pub mod fingers;
pub mod losses;
pub mod peaks_only;
mod plots;
mod states;
mod text;

use serde::Serialize;
use toothwave_solver::backing::Backings;
use toothwave_solver::backlash::{self, Backlash};
use toothwave_solver::fingers::CarrierFingers;
use toothwave_solver::losses::duty::{Costs, Duty, DutyPoint, DutySweep, LossParameters, LossTotals};
use toothwave_solver::losses::{Mechanism, period};
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::{self as solver, Points};
use toothwave_solver::{Contact, Deviations, Drive, LoadCase, PerContact, SolveError, Stop, findings, model_error};

use crate::design::{Design, ModelDocument};
use crate::field::FieldCode;
use crate::findings::{Causes, FindingAnswer, drive_findings};
use crate::forms::{Form, Format, Forms};
use crate::no_answer::{NoAnswer, NoAnswerCode, too_many};
use crate::question::{Limits, Question, checked_drive, checked_load, require_finite};
use crate::sweep::answer::{ChecksAnswer, LoadAnswer, StatesAnswer, SweepAnswer, WindUpAnswer};
use crate::sweep::duty::{DutyAnswer, DutyPointAnswer};
use crate::sweep::losses::LossesAnswer;

pub use states::Column;

/// The checked parameters of a sweep.
#[derive(Debug)]
pub struct CheckedSweep {
    drive: Drive,
    /// For a duty, that of the hardest point.
    load: LoadCase,
    model: ModelDocument,
    of_document: Vec<FindingAnswer>,
    duty: Duty,
    is_duty: bool,
    deviations: Deviations,
    backings: Backings,
    fingers: Option<CarrierFingers>,
    losses: Option<LossParameters>,
    points: Points,
    with_gaps: bool,
    with_wind_up: bool,
}

/// Eleven columns of doubles and two of numbers.
const STATE_BYTES: u64 = 11 * 8 + 2 * 4;

/// Three columns of doubles, one of numbers, three of radial forces, one of the unloaded wind-up, and temporary values.
const ANGLE_BYTES: u64 = 11 * 8;

/// A number of about 18 characters and its comma.
const NUMBER_TEXT_BYTES: usize = 20;

impl CheckedSweep {
    /// Returns the memory of the answer's columns.
    fn columns_bytes(&self, states: u64, input_angles: u64) -> u64 {
        // Three columns of slips and one of words.
        const LOSSES_BYTES: u64 = 3 * 8 + 2;
        // Ratios by contact, bearing and race, powers, and wear.
        const LOSSES_ANGLE_BYTES: u64 = 9 * 8;
        // Three columns of depths, for each point of a duty and for their mean.
        const WEAR_BYTES: u64 = 3 * 8;
        let Self { duty, losses, .. } = self;
        let has_wear = losses.is_some_and(|losses| losses.wear_rate_mm3_per_nm.is_some());
        let of = |is_asked, bytes| if is_asked { bytes } else { 0 };
        // With friction every point is swept, one at a time, in addition to the hardest.
        let sweeps = 1 + of(losses.is_some() && duty.points.len() > 1, 1);
        let of_wear = (duty.points.len() as u64 + 1) * of(has_wear, WEAR_BYTES);
        let state_bytes = sweeps * (STATE_BYTES + of(losses.is_some(), LOSSES_BYTES)) + of_wear;
        let angle_bytes = sweeps * (ANGLE_BYTES + of(losses.is_some(), LOSSES_ANGLE_BYTES));
        states * state_bytes + input_angles * angle_bytes
    }

    /// Returns the drive.
    pub const fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Returns the load; for a duty, that of the hardest point.
    pub const fn load(&self) -> &LoadCase {
        &self.load
    }

    /// Returns the same sweep without wear and bearing life.
    pub fn without_wear(self) -> Self {
        let losses = self.losses.map(|losses| LossParameters { wear_rate_mm3_per_nm: None, bearing: None, ..losses });
        Self { losses, ..self }
    }

    /// Returns the share that a finger of the carrier adds to a tooth's approach at its contacts, at the peaks of the
    /// load. None without an estimate.
    pub fn finger_share(&self, peaks: &PerContact<solver::ContactPeaks>) -> Option<f64> {
        let estimates = self.backings.estimates_with_shares(&self.drive, self.load().parameters(), peaks)?;
        estimates.into_iter().filter(|estimate| estimate.contact == Contact::Carrier).find_map(|finger| finger.share)
    }

    /// Returns the loss totals over all points of a duty, without the life of a bearing. Takes the sweep of the hardest
    /// point. None without friction.
    pub fn loss_totals(&self, hardest: &solver::Sweep, stop: &dyn Stop) -> Result<Option<LossTotals>, SolveError> {
        let Some((costs, _)) = self.costs(hardest, None, stop)? else { return Ok(None) };
        let mut totals = self.losses_along(costs.totals(self.duty.hardest, &hardest.states));
        totals.bearing = None;
        Ok(Some(totals))
    }

    /// Returns the losses of all points and those of the hardest, given its sweep; none without friction.
    fn costs(
        &self,
        hardest: &solver::Sweep,
        forces: Option<&period::RadialForces>,
        stop: &dyn Stop,
    ) -> Result<Option<(Costs<'_>, period::Losses)>, SolveError> {
        let Self { drive, load, deviations, points, duty, .. } = self;
        let of_duty = DutySweep { drive, load, deviations, points: *points, duty };
        self.losses.as_ref().map(|parameters| of_duty.losses(parameters, hardest, forces, stop)).transpose()
    }

    /// Returns the radial forces of the teeth on the wave generator.
    pub fn radial_forces(
        &self,
        sweep: &solver::Sweep,
        stop: &dyn Stop,
    ) -> Result<Option<period::RadialForces>, SolveError> {
        period::RadialForces::of(&self.drive, self.load(), &self.deviations, sweep, stop)
    }

    /// Returns the backlash at the output.
    pub fn backlash(&self, stop: &dyn Stop) -> Result<Backlash, SolveError> {
        backlash::of(&self.drive, self.load(), &self.deviations, stop)
    }

    /// Returns pointers to the fields that open or close gaps.
    pub(super) fn gap_fields(&self) -> &'static [&'static str] {
        match (self.load().parameters().modification.is_nil(), self.deviations.is_nil()) {
            (true, true) => &["/parts"],
            (true, false) => &["/parts", "/deviations"],
            (false, true) => &["/parts", "/modification"],
            (false, false) => &["/parts", "/modification", "/deviations"],
        }
    }

    /// Solves the sweep; for a duty, that of its hardest point. Stresses are means along the teeth.
    pub fn solve(&self, stop: &dyn Stop) -> Result<solver::Sweep, SolveError> {
        self.solve_at(self.points, stop)
    }

    fn solve_at(&self, points: Points, stop: &dyn Stop) -> Result<solver::Sweep, SolveError> {
        let run = |load: &LoadCase| solver::sweep_with_deviations(&self.drive, load, &self.deviations, points, stop);
        self.limited(run, |sweep| &mut sweep.torque_capacity)
    }

    /// Solves for the peaks only. Stresses are means along the teeth.
    pub fn peaks(&self, stop: &dyn Stop) -> Result<solver::SweepPeaks, SolveError> {
        if !self.deviations.is_nil() {
            return Ok((&self.solve(stop)?).into());
        }
        let run = |load: &LoadCase| solver::peaks(&self.drive, load, self.points, stop);
        self.limited(run, |peaks| &mut peaks.torque_capacity)
    }
}

/// Question: forces and contact stresses over one period.
#[derive(Debug)]
pub struct Sweep;

impl Question for Sweep {
    type Checked = CheckedSweep;
    type Answer = SweepAnswer;

    fn name(&self) -> String {
        "sweep".into()
    }

    fn reads(&self, design: &Design) -> impl Serialize {
        let Design { drive, materials, load, friction, model, modification, deviations, sweep, parts, .. } =
            design.in_key();
        (drive, materials, load, friction, model, (modification, deviations, parts), sweep)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<CheckedSweep, NoAnswer> {
        let mut violations = Vec::new();
        let draft = checked_drive(design, &mut violations)?;
        // In the document's order: the first structural fault is reported.
        let load = checked_load(design, &draft, &mut violations)?;
        let losses = design.loss_parameters(&mut violations);
        let finger_parameters = design.finger_parameters(&mut violations);
        let points = design.sweep_points(limits.max_searched_states)?.map_err(|found| violations.push(found)).ok();
        let (Some(drive), Some(load), Some(points), true) = (draft.drive(), load, points, violations.is_empty()) else {
            return Err(NoAnswer::impossible(&violations));
        };
        let deviations = design.deviations.clone();
        let duty = design.duty()?;
        if let Points::Samples(samples) = points {
            let sweeps = duty.points.len() as u64;
            let (states, limit) = (sweeps * load.mesh(&drive, &deviations).state_count(samples), limits.max_states);
            if states > limit {
                let of_duty = if sweeps > 1 { ", times the points of the duty" } else { "" };
                let detail = format!(
                    "the sweep has {states} states (input angles times teeth in mesh{of_duty}), more than the {limit} of `max_states`; take fewer samples"
                );
                let (code, field_code) = (NoAnswerCode::TooManyStates, FieldCode::TooManyStates);
                return Err(too_many(code, field_code, "/sweep/samples", &detail, Some(states), limit));
            }
        }
        let with_gaps = load.has_gaps() || !deviations.is_nil();
        let parts = design.parts_parameters()?;
        let backings = Backings::of(&drive, &draft, &parts, design.support());
        let model = design.complete_model(model_error::has_pointed_tips(&drive));
        let fingers =
            backings.finger.map(|beam| CarrierFingers::new(&drive, beam, finger_parameters, load.parameters()));
        Ok(CheckedSweep {
            model,
            of_document: FindingAnswer::of_document(design, true),
            fingers: fingers.transpose().map_err(SolveError::from)?,
            backings,
            drive,
            load,
            duty,
            is_duty: design.has_duty(),
            deviations,
            losses,
            points,
            with_gaps,
            with_wind_up: design.sweep.wind_up,
        })
    }

    fn max_bytes(checked: &CheckedSweep, format: Format) -> Option<u64> {
        let Points::Samples(samples) = checked.points else { return None };
        let mesh = checked.load().mesh(&checked.drive, &checked.deviations);
        let columns_bytes = checked.columns_bytes(mesh.state_count(samples), mesh.last_sample(samples) + 1);
        // A plot sorts the states by position, which needs the same memory again.
        Some(if format == Format::Svg { 2 * columns_bytes } else { format.bytes_with_text(columns_bytes) })
    }

    fn is_short(checked: &CheckedSweep) -> bool {
        /// Solving and writing them takes about 0.1 ms; with Palmgren's law and all options 0.25 ms.
        const FEW_STATES: u64 = 400;
        let CheckedSweep { drive, deviations, fingers, losses, points, with_gaps, with_wind_up, .. } = checked;
        let load = checked.load();
        // The boundary elements of a tooth take longer than any short sweep, and so does the backlash.
        let is_plain = !with_gaps
            && !with_wind_up
            && losses.is_none()
            && !fingers.is_some_and(|fingers| fingers.limits_fall_with_torque())
            && !load.parameters().ring_teeth_bend
            && !load.presses_corners(drive);
        match points {
            Points::Samples(samples) => is_plain && deviations.mesh(drive).state_count(*samples) <= FEW_STATES,
            Points::Tolerance { .. } => false,
        }
    }

    fn answer(checked: &CheckedSweep, stop: &dyn Stop) -> Result<SweepAnswer, NoAnswer> {
        let CheckedSweep { drive, duty, deviations, backings, fingers, with_gaps, with_wind_up, .. } = checked;
        let load = checked.load();
        let asks_without_load = *with_wind_up && *with_gaps;
        let points = if asks_without_load { checked.points.also_without_load() } else { checked.points };
        let sweep = checked.solve_at(points, stop)?;
        // For a million states each of the following steps takes tens of milliseconds.
        let go_on = || if stop.stopped() { Err(NoAnswer::stopped()) } else { Ok(()) };
        go_on()?;
        let mesh = sweep.mesh;
        let peaks = fingers.as_ref().map_or(sweep.peaks, |fingers| fingers.peaks_along(&sweep.peaks));
        let finger_stress = checked.finger_stress(&sweep.peaks);
        let shared = backings.estimates_with_shares(drive, load.parameters(), &sweep.peaks);
        let parts = Some((backings, shared.as_deref()));
        let mut found = Vec::from_iter(findings::of_wind_up(drive, load, &sweep));
        found.extend(findings::of_half_widths(drive, load, &sweep.states, checked.load_peak_over_mean()));
        go_on()?;
        let model_error = model_error::of(drive, load, deviations, &sweep, parts)?;
        go_on()?;
        let forces = checked.radial_forces(&sweep, stop)?;
        let costs = checked.costs(&sweep, forces.as_ref(), stop)?;
        let duty_answer = checked.is_duty.then(|| DutyAnswer::new(drive, duty, costs.as_ref().map(|(costs, _)| costs)));
        let losses = match costs {
            Some((costs, hardest)) => {
                found.extend(costs.findings());
                let totals = checked.losses_along(costs.totals(duty.hardest, &sweep.states));
                Some(LossesAnswer::new(&Mechanism::of(drive), totals, hardest, &sweep)?)
            }
            None => None,
        };
        if let Some(forces) = &forces {
            require_finite([&forces.force_n, &forces.direction_deg])?;
        }
        found.extend(findings::of_projection(drive, load)?);
        found.extend(shared.iter().flat_map(|estimates| findings::of_backing(estimates)));
        found.extend(findings::of_contacts(drive, load, &peaks, *with_wind_up || *with_gaps));
        found.extend(finger_stress.as_ref().and_then(findings::of_fingers));
        let backlash = with_wind_up.then(|| checked.backlash(stop));
        found.extend(backlash.as_ref().and_then(findings::of_backlash));
        let causes = Causes {
            wave_generator_moves: load.parameters().wave_generator_moves,
            fingers: backings.support.fingers,
            gap_fields: checked.gap_fields(),
            ..Causes::default()
        };
        let mut findings = drive_findings(drive)?;
        findings.extend(found.iter().map(|finding| FindingAnswer::new(finding, drive, causes)));
        findings.extend(checked.of_document.iter().cloned());
        let unloaded_wind_up_deg = if asks_without_load {
            Some(solver::unloaded_wind_up_deg(drive, load, deviations, &sweep, stop)?)
        } else {
            None
        };
        go_on()?;
        let answer = SweepAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            coincidence_degree: mesh.coincidence_degree(),
            period_deg: mesh.period_deg(),
            sweep_period_deg: mesh.tells_items_apart().then(|| mesh.sweep_period_deg()),
            load: LoadAnswer {
                input_torque_nm: load.input_torque_nm(drive),
                output_torque_nm: load.output_torque_nm(drive),
            },
            enters_under_load: drive.flank_limit().end != FlankEnd::RegularTip && !load.presses_corners(drive),
            peaks,
            teeth_in_mesh_per_zone: mesh.teeth_in_mesh(),
            loaded_teeth_per_zone: sweep.loaded_teeth(),
            wind_up: backlash
                .map(|backlash| WindUpAnswer::new(drive, &sweep, backlash, unloaded_wind_up_deg))
                .transpose()?,
            torque_capacity: sweep.torque_capacity,
            fingers: finger_stress,
            duty: duty_answer,
            losses,
            radial_force_n: forces,
            model: checked.model.clone(),
            model_error,
            series_compliance_estimates: shared.unwrap_or_else(|| backings.estimates(drive, load.parameters())),
            checks: ChecksAnswer {
                torque_balance_residual: sweep.torque_balance_residual,
                period_closure_residual: sweep.period_closure_residual,
            },
            states: StatesAnswer::new(
                match fingers {
                    Some(fingers) => fingers.states_along(sweep.states),
                    None => sweep.states,
                },
                *with_gaps || load.presses_corners(drive),
            ),
            findings,
        };
        require_finite(answer.columns().into_iter().filter_map(|(_, column)| match column {
            Column::Numbers(numbers) => Some(numbers),
            Column::Counts(_) | Column::Flags(_) | Column::Rolls(_) => None,
        }))?;
        if let Some(wind_up) = &answer.wind_up {
            let unloaded = wind_up.unloaded_wind_up_deg.iter();
            require_finite(unloaded.chain([&wind_up.wind_up_deg, &wind_up.torsional_stiffness_nm_per_rad]))?;
        }
        Ok(answer)
    }
}

impl DutyAnswer {
    fn new(drive: &Drive, duty: &Duty, costs: Option<&Costs<'_>>) -> Self {
        let of_point =
            |(at, &DutyPoint { torque, input_speed_rpm, share_of_time }): (usize, &DutyPoint)| DutyPointAnswer {
                input_torque_nm: torque.input_nm(drive),
                output_torque_nm: torque.output_nm(drive),
                // Every point of a duty has a speed.
                input_speed_rpm: input_speed_rpm.unwrap_or_default(),
                share_of_time,
                efficiency_ring_fixed: costs.map(|costs| costs.efficiency_at(at)),
                power_loss_w: costs.and_then(|costs| costs.power_loss_at_w(at)),
            };
        Self {
            hardest_point: duty.hardest,
            mean_input_speed_rpm: duty.mean_input_speed_rpm(),
            points: duty.points.iter().enumerate().map(of_point).collect(),
        }
    }
}

impl Forms for SweepAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[
        (Format::Csv, Self::write_csv),
        (Format::Arrow, arrow::write),
        (Format::Text, Self::write_text),
        (Format::Svg, plots::write),
    ];

    fn expected_bytes(&self) -> usize {
        let of_states: usize = self.columns().iter().map(|(_, column)| column.text_bytes()).sum();
        // Columns by input angle.
        let wind_up = self.wind_up.as_ref().map(|wind_up| 5 * wind_up.input_angle_deg.len());
        let losses = self.losses.as_ref().map(|losses| 4 * losses.by_input_angle.input_angle_deg.len());
        let radial_force = self.radial_force_n.as_ref().map(|force| 3 * force.input_angle_deg.len());
        let numbers: usize = [wind_up, losses, radial_force].into_iter().flatten().sum();
        4096 + of_states + NUMBER_TEXT_BYTES * numbers
    }

    fn held_bytes(&self, format: Format) -> u64 {
        let columns_bytes = self.columns().iter().map(|(_, column)| column.bytes()).sum();
        // A plot sorts the states by position, which needs the same memory again.
        if format == Format::Svg { 2 * columns_bytes } else { columns_bytes }
    }
}
