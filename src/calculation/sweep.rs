//! Forces and contact stresses over one period.

use std::io::{self, Write};

use toothwave_solver::backing::{Backings, Shares};
use toothwave_solver::losses::wear::WearParameters;
use toothwave_solver::losses::{Friction, Mechanism, period};
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::{self as solver, Points};
use toothwave_solver::{
    Contact, Deviations, Drive, LoadCase, LoadParameters, PerContact, SolveError, Stop, findings,
    model_error as error_of_model,
};

use crate::design::{BearingRating, Design, Duty, DutyPoint, ModelDocument};
use crate::field::FieldCode;
use crate::findings::{FindingAnswer, drive_findings, write_findings};
use crate::forms::{Form, Format, Forms, csv_error};
use crate::json::word;
use crate::key::Encode;
use crate::no_answer::{NoAnswer, NoAnswerCode, too_many};
use crate::question::{Limits, Question, checked_drive, checked_load, require_finite};
use crate::sweep::answer::{ChecksAnswer, LoadAnswer, StatesAnswer, SweepAnswer, WindUpAnswer};
use crate::sweep::backing::EstimateAnswer;
use crate::sweep::duty::{DutyAnswer, DutyPointAnswer};
use crate::sweep::losses::{
    BearingLoaded, Cost, Costs, LossTotalsAnswer, LossesAnswer, RadialForceAnswer, RollsAnswer,
};
use crate::sweep::model_error::ModelErrorAnswer;

pub mod answer;
mod arrow;
pub mod backing;
pub mod contact;
pub mod duty;
pub mod losses;
pub mod model_error;
pub mod peak;
pub mod peaks_only;
mod plots;

/// The checked parameters of a sweep.
#[derive(Debug)]
pub struct CheckedSweep {
    drive: Drive,
    model: ModelDocument,
    of_document: Vec<FindingAnswer>,
    duty: CheckedDuty,
    deviations: Deviations,
    backings: Backings,
    friction: Option<Friction>,
    wear_rate_mm3_per_nm: Option<PerContact<f64>>,
    bearing_rating: Option<BearingRating>,
    points: Points,
    with_gaps: bool,
    with_wind_up: bool,
}

/// Eleven columns of doubles and two of numbers.
const STATE_BYTES: u64 = 11 * 8 + 2 * 4;

/// Three columns of doubles and one of numbers, three of radial forces, one of the wind-up without load, and what stands between them while they are made.
const ANGLE_BYTES: u64 = 11 * 8;

/// A number of about 18 characters and its comma.
const NUMBER_TEXT_BYTES: usize = 20;

/// What a state and an input angle take.
#[derive(Debug, Clone, Copy)]
struct Each {
    state_bytes: u64,
    angle_bytes: u64,
}

impl CheckedSweep {
    /// What a state and an input angle take in the answer.
    fn each(&self) -> Each {
        // Three columns of slips and one of words.
        const LOSSES_BYTES: u64 = 3 * 8 + 2;
        // Ratios by contact, bearing and race, powers, and what wears.
        const LOSSES_ANGLE_BYTES: u64 = 9 * 8;
        // Three columns of depths, of each point of a duty and of their mean.
        const WEAR_BYTES: u64 = 3 * 8;
        let Self { duty, friction, wear_rate_mm3_per_nm, .. } = self;
        let of = |is_asked, bytes| if is_asked { bytes } else { 0 };
        // With friction every point is swept, one after the other beside the hardest.
        let sweeps = 1 + of(friction.is_some() && duty.points.len() > 1, 1);
        let of_wear = (duty.points.len() as u64 + 1) * of(wear_rate_mm3_per_nm.is_some(), WEAR_BYTES);
        Each {
            state_bytes: sweeps * (STATE_BYTES + of(friction.is_some(), LOSSES_BYTES)) + of_wear,
            angle_bytes: sweeps * (ANGLE_BYTES + of(friction.is_some(), LOSSES_ANGLE_BYTES)),
        }
    }

    /// The drive.
    pub const fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Its load, of a duty the hardest.
    pub fn load(&self) -> &LoadCase {
        &self.duty.hardest().load
    }

    /// What its single items deviate by.
    pub const fn deviations(&self) -> &Deviations {
        &self.deviations
    }

    /// The same, of which wear and the life of a bearing are not asked.
    pub fn without_wear(self) -> Self {
        Self { wear_rate_mm3_per_nm: None, bearing_rating: None, ..self }
    }

    /// What a finger of the carrier, as it is held, adds to a tooth's approach at its contacts at the peaks of the load, over that; nothing where
    /// no estimate tells.
    pub fn finger_share(&self, peaks: &PerContact<solver::ContactPeaks>) -> Option<f64> {
        let shares = Shares::of(&self.drive, self.load(), &self.backings, peaks)?.shares;
        let of_finger = shares.into_iter().find(|(estimate, _)| estimate.backing.contact() == Contact::Carrier);
        of_finger.map(|(_, share)| share)
    }

    /// What friction takes over all points of a duty, as the answer has it, given the sweep of the hardest; nothing without friction.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn loss_totals(&self, hardest: &solver::Sweep, stop: &dyn Stop) -> Result<Option<LossTotalsAnswer>, NoAnswer> {
        let Some(friction) = &self.friction else { return Ok(None) };
        let forces = match self.bearing_rating {
            Some(_) => period::RadialForces::of(&self.drive, self.load(), &self.deviations, hardest, stop)?,
            None => None,
        };
        let losses = self.losses(self.load(), hardest, friction, stop)?;
        let costs = self.costs(friction, &Swept { sweep: hardest, forces: forces.as_ref() }, &losses, stop)?;
        Ok(Some(costs.totals(self.duty.hardest, &hardest.states)))
    }

    /// Solves, of a duty its hardest point.
    ///
    /// # Errors
    /// As [`solver::sweep_with_deviations`].
    pub fn solve(&self, stop: &dyn Stop) -> Result<solver::Sweep, SolveError> {
        self.solve_under(self.load(), stop)
    }

    fn solve_under(&self, load: &LoadCase, stop: &dyn Stop) -> Result<solver::Sweep, SolveError> {
        solver::sweep_with_deviations(&self.drive, load, &self.deviations, self.points, stop)
    }

    /// Solves for the peaks alone.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn peaks(&self, stop: &dyn Stop) -> Result<solver::SweepPeaks, SolveError> {
        if !self.deviations.is_nil() {
            return Ok((&self.solve(stop)?).into());
        }
        solver::peaks(&self.drive, self.load(), self.points, stop)
    }
}

/// The loads that are swept, one at least.
#[derive(Debug)]
struct CheckedDuty {
    points: Vec<CheckedDutyPoint>,
    hardest: usize,
    is_asked: bool,
}

#[derive(Debug)]
struct CheckedDutyPoint {
    load: LoadCase,
    input_speed_rpm: Option<f64>,
    share_of_time: f64,
}

impl CheckedDuty {
    /// The loads of a document of which the hardest was checked, as all others but their torques were.
    fn new(design: &Design, hardest: &LoadCase) -> Result<Self, NoAnswer> {
        let Duty { points, hardest: at, is_asked } = design.duty()?;
        let points: Result<Vec<_>, _> = points
            .iter()
            .map(|&DutyPoint { torque, input_speed_rpm, share_of_time }| {
                let load = LoadCase::new(&LoadParameters { torque, ..*hardest.parameters() })?;
                Ok(CheckedDutyPoint { load, input_speed_rpm, share_of_time })
            })
            .collect();
        let points = points.map_err(|violations: Vec<_>| NoAnswer::impossible(&violations))?;
        Ok(Self { points, hardest: at, is_asked })
    }

    fn hardest(&self) -> &CheckedDutyPoint {
        &self.points[self.hardest]
    }
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
        let Design { drive, materials, load, friction, modification, deviations, sweep, parts, .. } = design;
        (drive, materials, load, friction, design.model_in_key(), (modification, deviations, sweep, parts.under_load()))
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
        let points = design.sweep_points(limits.max_searched_states)?;
        let (drive, load, points) = match (draft.drive(), load, points) {
            (Some(drive), Some(load), Ok(points)) if violations.is_empty() => (drive, load, points),
            (_, _, points) => {
                violations.extend(points.err());
                return Err(NoAnswer::impossible(&violations));
            }
        };
        let deviations = Deviations::from(&design.deviations);
        if let Points::Samples(samples) = points {
            let sweeps = design.duty()?.points.len() as u64;
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
        let model = design.complete_model(error_of_model::has_pointed_tips(&drive));
        Ok(CheckedSweep {
            model,
            of_document: FindingAnswer::of_document(design, true),
            backings,
            drive,
            duty: CheckedDuty::new(design, &load)?,
            deviations,
            friction,
            wear_rate_mm3_per_nm: design.wear_rate_mm3_per_nm(),
            bearing_rating: design.bearing_rating(),
            points,
            with_gaps,
            with_wind_up: design.sweep.wind_up,
        })
    }

    fn max_bytes(checked: &CheckedSweep, format: Format) -> Option<u64> {
        let Points::Samples(samples) = checked.points else { return None };
        let mesh = checked.load().mesh(&checked.drive, &checked.deviations);
        let Each { state_bytes, angle_bytes } = checked.each();
        let columns_bytes = mesh.state_count(samples) * state_bytes + (mesh.last_sample(samples) + 1) * angle_bytes;
        // For plots the states are put in the order of their places: as much again.
        Some(if format == Format::Svg { 2 * columns_bytes } else { format.bytes_with_text(columns_bytes) })
    }

    fn is_short(checked: &CheckedSweep) -> bool {
        /// They are solved and written in about 0.1 ms; with Palmgren's law and all that can be asked for in a quarter of a millisecond.
        const FEW_STATES: u64 = 400;
        let CheckedSweep { drive, deviations, friction, points, with_gaps, .. } = checked;
        let load = checked.load();
        // The boundary elements of a tooth take longer than any short sweep.
        let is_plain =
            !with_gaps && friction.is_none() && !load.parameters().ring_teeth_bend && !load.presses_corners(drive);
        match points {
            Points::Samples(samples) => is_plain && deviations.mesh(drive).state_count(*samples) <= FEW_STATES,
            Points::Tolerance { .. } => false,
        }
    }

    fn answer(checked: &CheckedSweep, stop: &dyn Stop) -> Result<SweepAnswer, NoAnswer> {
        let CheckedSweep { drive, duty, deviations, backings, friction, with_gaps, with_wind_up, .. } = checked;
        let load = checked.load();
        let asks_without_load = *with_wind_up && *with_gaps;
        let points = if asks_without_load { checked.points.also_without_load() } else { checked.points };
        let sweep = solver::sweep_with_deviations(drive, load, deviations, points, stop)?;
        // Of a million states each of what follows takes tens of milliseconds.
        let go_on = || if stop.stopped() { Err(NoAnswer::stopped()) } else { Ok(()) };
        go_on()?;
        let mesh = sweep.mesh;
        let mut findings = drive_findings(drive)?;
        let approaches_matter = *with_wind_up || load.has_gaps() || !deviations.is_nil();
        let of_contacts = findings::of_contacts(drive, load, &sweep.peaks, approaches_matter);
        let of_half_widths = findings::of_half_widths(drive, load, &sweep.states);
        let of_wind_up = findings::of_wind_up(drive, load, &sweep);
        let of_projection = findings::of_projection(drive, load).map_err(SolveError::from)?;
        let shares = Shares::of(drive, load, backings, &sweep.peaks);
        let of_backing = shares.as_ref().map_or_else(Vec::new, findings::of_backing);
        let parts = shares.as_ref().map(|shares| (backings.support(), shares));
        go_on()?;
        let model_error = error_of_model::of(drive, load, deviations, &sweep, parts).map_err(SolveError::from)?;
        go_on()?;
        let forces = period::RadialForces::of(drive, load, deviations, &sweep, stop)?;
        let (mut of_friction, mut of_bearing) = (None, None);
        let mut losses = None;
        let mut points = duty.points.iter().map(|point| DutyPointAnswer::new(drive, point)).collect::<Vec<_>>();
        if let Some(friction) = friction {
            let of_period = checked.losses(load, &sweep, friction, stop)?;
            let costs = checked.costs(friction, &Swept { sweep: &sweep, forces: forces.as_ref() }, &of_period, stop)?;
            for (point, cost) in points.iter_mut().zip(costs.of_points()) {
                point.efficiency_ring_fixed = Some(cost.efficiency_ring_fixed);
                point.power_loss_w = cost.power_loss_w;
            }
            of_friction =
                findings::of_friction(&Mechanism::of_sweep(drive, &sweep), friction, costs.total_loss_ratio());
            of_bearing = costs
                .bearing_load()
                .and_then(|BearingLoaded { rating_n, load_n }| findings::of_bearing(rating_n, load_n));
            losses = Some(LossesAnswer::new(&costs, duty.hardest, &sweep, of_period)?);
        }
        let radial_force_n = forces.map(|forces| RadialForceAnswer::new(&sweep, forces)).transpose()?;
        let of_model =
            of_half_widths.iter().chain(&of_friction).chain(&of_bearing).chain(&of_projection).chain(&of_backing);
        let of_sweep = of_wind_up.iter().chain(of_model).chain(&of_contacts);
        findings.extend(of_sweep.map(|finding| FindingAnswer::new(finding, drive)));
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
            peaks: sweep.peaks.into(),
            teeth_in_mesh_per_zone: mesh.teeth_in_mesh().into(),
            loaded_teeth_per_zone: sweep.loaded_teeth().into(),
            wind_up: with_wind_up.then(|| WindUpAnswer::new(drive, &sweep, unloaded_wind_up_deg)),
            torque_capacity: sweep.torque_capacity.map(Into::into),
            duty: duty.is_asked.then(|| DutyAnswer {
                hardest_point: duty.hardest,
                mean_input_speed_rpm: duty.mean_input_speed_rpm(),
                points,
            }),
            losses,
            radial_force_n,
            model: checked.model.clone(),
            model_error: ModelErrorAnswer::new(load, model_error),
            series_compliance_estimates: EstimateAnswer::all(backings, drive, load, shares.as_ref()),
            checks: ChecksAnswer {
                torque_balance_residual: sweep.torque_balance_residual,
                period_closure_residual: sweep.period_closure_residual,
            },
            states: StatesAnswer::new(sweep.states, *with_gaps || load.presses_corners(drive)),
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
            let unloaded = wind_up.unloaded_wind_up_deg.iter();
            require_finite(unloaded.chain([&wind_up.wind_up_deg, &wind_up.torsional_stiffness_nm_per_rad]))?;
        }
        Ok(answer)
    }
}

/// A sweep with what its teeth push the wave generator aside with.
struct Swept<'a> {
    sweep: &'a solver::Sweep,
    forces: Option<&'a period::RadialForces>,
}

impl CheckedSweep {
    /// What each point of the duty costs; of the hardest the sweep is there already.
    fn costs<'a>(
        &'a self,
        friction: &'a Friction,
        hardest: &Swept<'_>,
        losses: &period::Losses,
        stop: &dyn Stop,
    ) -> Result<Costs<'a>, NoAnswer> {
        let Self { drive, duty, bearing_rating, deviations, .. } = self;
        let of_point = |(at, point): (usize, &CheckedDutyPoint)| {
            if at == duty.hardest {
                return self.cost(point, friction, hardest, losses, stop);
            }
            let sweep = self.solve_under(&point.load, stop)?;
            let forces = period::RadialForces::of(drive, &point.load, deviations, &sweep, stop)?;
            let losses = self.losses(&point.load, &sweep, friction, stop)?;
            self.cost(point, friction, &Swept { sweep: &sweep, forces: forces.as_ref() }, &losses, stop)
        };
        let points = duty.points.iter().enumerate().map(of_point).collect::<Result<_, _>>()?;
        Ok(Costs { mechanism: Mechanism::of(drive), friction, bearing_rating: *bearing_rating, points })
    }

    /// What friction takes; of a sweep to a tolerance the means keep it.
    fn losses(
        &self,
        load: &LoadCase,
        sweep: &solver::Sweep,
        friction: &Friction,
        stop: &dyn Stop,
    ) -> Result<period::Losses, SolveError> {
        let Self { drive, deviations, points, .. } = self;
        let losses = period::Losses::of(drive, load, sweep, friction, stop)?;
        match points {
            Points::Samples(_) => Ok(losses),
            Points::Tolerance(tolerance) => {
                losses.with_mean_to(tolerance.relative(), drive, load, deviations, friction, stop)
            }
        }
    }

    fn cost(
        &self,
        point: &CheckedDutyPoint,
        friction: &Friction,
        &Swept { sweep, forces }: &Swept<'_>,
        losses: &period::Losses,
        stop: &dyn Stop,
    ) -> Result<Cost, NoAnswer> {
        let Self { drive, wear_rate_mm3_per_nm, bearing_rating, .. } = self;
        let &CheckedDutyPoint { ref load, input_speed_rpm, share_of_time } = point;
        let mechanism = Mechanism::of_sweep(drive, sweep);
        let turning_rad_per_s = input_speed_rpm.map(|speed_rpm| mechanism.turning_rad_per_s(speed_rpm));
        let wear = wear_rate_mm3_per_nm
            .zip(turning_rad_per_s)
            .map(|(rate_mm3_per_nm, turning_rad_per_s)| {
                let parameters = WearParameters { rate_mm3_per_nm, turning_rad_per_s };
                period::Wear::of(drive, load, sweep, losses, friction, &parameters, stop)
            })
            .transpose()?;
        Ok(Cost {
            input_torque_nm: load.input_torque_nm(drive),
            input_speed_rpm,
            share_of_time,
            mean: losses.mean,
            pressure_velocity: turning_rad_per_s.map(|turning| losses.pressure_velocity_peaks(sweep, turning)),
            wear,
            bearing: bearing_rating.zip(forces).and_then(|(rating, forces)| {
                period::BearingLoad::of(&mechanism, rating.element, sweep, losses, forces)
            }),
        })
    }
}

impl CheckedDuty {
    fn mean_input_speed_rpm(&self) -> f64 {
        let time: f64 = self.points.iter().map(|point| point.share_of_time).sum();
        let turned = |point: &CheckedDutyPoint| point.share_of_time * point.input_speed_rpm.unwrap_or_default();
        self.points.iter().map(turned).sum::<f64>() / time
    }
}

impl DutyPointAnswer {
    fn new(drive: &Drive, point: &CheckedDutyPoint) -> Self {
        Self {
            input_torque_nm: point.load.input_torque_nm(drive),
            output_torque_nm: point.load.output_torque_nm(drive),
            // Every point of a duty has one.
            input_speed_rpm: point.input_speed_rpm.unwrap_or_default(),
            share_of_time: point.share_of_time,
            efficiency_ring_fixed: None,
            power_loss_w: None,
        }
    }
}

/// A column of the states.
#[derive(Debug, Clone, Copy)]
pub enum Column<'a> {
    /// Numbers.
    Numbers(&'a [f64]),
    /// Whole numbers.
    Counts(&'a [u32]),
    /// Whether something holds.
    Flags(&'a [bool]),
    /// Where teeth roll.
    Rolls(&'a [RollsAnswer]),
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
        // Columns that stand by input angle.
        let wind_up = self.wind_up.as_ref().map(|wind_up| 5 * wind_up.input_angle_deg.len());
        let losses = self.losses.as_ref().map(|losses| 8 * losses.by_input_angle.input_angle_deg.len());
        let radial_force = self.radial_force_n.as_ref().map(|force| 3 * force.input_angle_deg.len());
        let numbers: usize = [wind_up, losses, radial_force].into_iter().flatten().sum();
        4096 + of_states + NUMBER_TEXT_BYTES * numbers
    }

    fn held_bytes(&self, format: Format) -> u64 {
        let columns_bytes = self.columns().iter().map(|(_, column)| column.bytes()).sum();
        // For plots the states are put in the order of their places: as much again.
        if format == Format::Svg { 2 * columns_bytes } else { columns_bytes }
    }
}

impl Column<'_> {
    /// About, as JSON.
    const fn text_bytes(&self) -> usize {
        match self {
            Self::Numbers(numbers) => NUMBER_TEXT_BYTES * numbers.len(),
            Self::Counts(counts) => 5 * counts.len(),
            Self::Flags(flags) => 6 * flags.len(),
            Self::Rolls(rolls) => 17 * rolls.len(),
        }
    }

    const fn bytes(&self) -> u64 {
        let bytes = match self {
            Self::Numbers(numbers) => size_of_val(*numbers),
            Self::Counts(counts) => size_of_val(*counts),
            Self::Flags(flags) => size_of_val(*flags),
            Self::Rolls(rolls) => size_of_val(*rolls),
        };
        bytes as u64
    }
}

impl SweepAnswer {
    /// The columns of the states by their names in JSON, those of the slips after them.
    pub fn columns(&self) -> Vec<(&'static str, Column<'_>)> {
        let states = &self.states;
        let mut columns = vec![
            ("input_angle_deg", Column::Numbers(&states.input_angle_deg)),
            ("tooth", Column::Counts(&states.tooth)),
            ("position_deg", Column::Numbers(&states.position_deg)),
            ("center_radius_mm", Column::Numbers(&states.center_radius_mm)),
            ("wave_generator_angle_deg", Column::Numbers(&states.wave_generator_angle_deg)),
            ("ring_angle_deg", Column::Numbers(&states.ring_angle_deg)),
            ("force_wave_generator_n", Column::Numbers(&states.force_wave_generator_n)),
            ("force_ring_n", Column::Numbers(&states.force_ring_n)),
            ("force_carrier_n", Column::Numbers(&states.force_carrier_n)),
            ("stress_wave_generator_mpa", Column::Numbers(&states.stress_wave_generator_mpa)),
            ("stress_ring_mpa", Column::Numbers(&states.stress_ring_mpa)),
            ("stress_carrier_mpa", Column::Numbers(&states.stress_carrier_mpa)),
        ];
        columns.extend(states.lobe.as_deref().map(|lobe| ("lobe", Column::Counts(lobe))));
        columns.extend(states.loaded.as_deref().map(|loaded| ("loaded", Column::Flags(loaded))));
        if let Some(LossesAnswer { slip_mm_per_rad: slip, rolls, .. }) = &self.losses {
            columns.extend([
                ("slip_wave_generator_mm_per_rad", Column::Numbers(&slip.wave_generator)),
                ("slip_ring_mm_per_rad", Column::Numbers(&slip.ring)),
                ("slip_carrier_mm_per_rad", Column::Numbers(&slip.carrier)),
                ("rolls", Column::Rolls(rolls)),
            ]);
        }
        columns
    }

    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let states = &self.states;
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(self.columns().into_iter().map(|(name, _)| name)).map_err(csv_error)?;
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
            // A column that is not there has no field.
            let lobe = states.lobe.as_ref().map_or(&[][..], |lobe| &lobe[i..=i]);
            let loaded = states.loaded.as_ref().map_or(&[][..], |loaded| &loaded[i..=i]);
            let slips = self.losses.as_ref().map(|LossesAnswer { slip_mm_per_rad: slip, rolls, .. }| {
                ([slip.wave_generator[i], slip.ring[i], slip.carrier[i]], [rolls[i]])
            });
            let (slips, rolls) = slips.as_ref().map_or((&[][..], &[][..]), |(slips, rolls)| (slips, rolls));
            csv.serialize((state, lobe, loaded, slips, rolls)).map_err(csv_error)?;
        }
        csv.flush()
    }

    fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "coincidence degree                  {:.12}", self.coincidence_degree)?;
        writeln!(writer, "period of the input angle           {:.6} deg", self.period_deg)?;
        if let Some(sweep_period_deg) = self.sweep_period_deg {
            writeln!(writer, "input angle of the sweep            {sweep_period_deg:.6} deg")?;
        }
        let zones = if self.states.lobe.is_none() { "per zone" } else { "in all zones" };
        writeln!(writer, "teeth in mesh {zones:<22}{}", self.teeth_in_mesh_per_zone)?;
        writeln!(writer, "teeth that carry {zones:<19}{}", self.loaded_teeth_per_zone)?;
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
            let limit = if capacity.turns_past_teeth {
                "beyond it the wave generator turns past its teeth".to_owned()
            } else {
                format!("limited by {}", word(&capacity.limited_by))
            };
            writeln!(
                writer,
                "\ntorque capacity, input and output   {:.6} and {:.6} N·m, {limit} at {:.4} deg",
                capacity.input_torque_nm, capacity.output_torque_nm, capacity.input_angle_deg
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
            if let Some(unloaded_deg) = &wind_up.unloaded_wind_up_deg {
                let (least, most) = range(unloaded_deg);
                writeln!(writer, "the same without load               {least:.6} to {most:.6} deg")?;
            }
            writeln!(writer, "torsional stiffness at the output   {softest:.6e} to {stiffest:.6e} N·m/rad")?;
            writeln!(writer, "transmission error, peak to peak    {error_deg:.3e} deg")?;
            if let Some(error_deg) = wind_up.unloaded_transmission_error_peak_to_peak_deg {
                writeln!(writer, "the same without load               {error_deg:.3e} deg")?;
            }
        }
        if let Some(losses) = &self.losses {
            losses.totals.write_text(writer)?;
        }
        if let Some(radial_force) = &self.radial_force_n {
            let most_n = radial_force.value.iter().copied().fold(0.0, f64::max);
            writeln!(writer, "\nlargest force on the wave generator {most_n:.6} N, across its axis")?;
        }
        self.model_error.write_text(writer)?;
        backing::write_text(&self.series_compliance_estimates, writer)?;
        write_findings(&self.findings, writer)
    }
}
