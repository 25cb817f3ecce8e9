//! Accuracy: error and time of each computation method.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use serde::Serialize;
use toothwave_solver::backing::Backings;
use toothwave_solver::drive::Draft;
use toothwave_solver::mesh::Samples;
use toothwave_solver::model_error::{self, Beyond, ModelError};
use toothwave_solver::sweep::{ContactPeaks, Points, Tolerance, sweep_with_deviations};
use toothwave_solver::{
    Compatibility, ContactLaw, Deviations, Drive, LawName, LoadCase, LoadParameters, Parameter, PerContact, SolveError,
    Stop,
};
use utoipa::ToSchema;

use crate::design::{Design, ModelDocument, Refinements};
use crate::forms::{Form, Format, Forms, write_csv};
use crate::json::word;
use crate::no_answer::{NoAnswer, NoAnswerCode};
use crate::question::{Limits, Question, checked_drive, checked_load};

const SAMPLES: [u64; 9] = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000];

const TOLERANCES: [f64; 5] = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10];

/// Most timed runs for the median, and the time after which no further run begins.
const MOST_RUNS: usize = 15;
const ENOUGH: Duration = Duration::from_millis(2);

/// Error and time of each computation method, measured for this answer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AccuracyAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// The design's own model with all defaults. As the document's `model` it gives the same answer. Instead of
    /// deprecated switches it has `refinements`.
    pub model: ModelDocument,
    /// Requested relative error.
    pub requested_error: f64,
    /// The fastest method with the design's own model that meets the requested error. Absent if none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cheapest: Option<WayAnswer>,
    /// All methods, by model and then from coarse to fine.
    pub ways: Vec<WayAnswer>,
    /// Models without an answer for this design.
    pub unavailable: Vec<UnavailableAnswer>,
}

/// A computation method.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WayAnswer {
    /// The form of compatibility.
    pub compatibility: Compatibility,
    /// The contact law.
    pub law: LawName,
    /// Equal intervals of the period. Absent if there is a tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u64>,
    /// Relative tolerance. Absent if there are samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Largest relative error of the six peaks, compared with the converged peaks of the same model.
    pub error: f64,
    /// Largest relative difference between the converged peaks of this model and those of the design's own model.
    pub model_difference: f64,
    /// Largest error of the model's forces that was measured against elastic bodies in similar drives. Absent without
    /// such a measurement, or if the design is outside the measured range for another reason than the law (see
    /// `model_error` of a sweep).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_model_error: Option<f64>,
    /// True if `error` is below a tenth of `expected_model_error`. A finer method gives digits that the model does not
    /// have.
    pub is_finer_than_model: bool,
    /// Median time of the computation.
    pub solve_us: f64,
    /// Number of states.
    pub states: usize,
}

/// A model without an answer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct UnavailableAnswer {
    /// The form of compatibility.
    pub compatibility: Compatibility,
    /// The contact law.
    pub law: LawName,
    /// Reason.
    pub code: NoAnswerCode,
}

/// Checked parameters of the question.
#[derive(Debug)]
pub struct CheckedAccuracy {
    drive: Drive,
    model: ModelDocument,
    /// Refinements of virtual work.
    refinements: Refinements,
    load: LoadCase,
    deviations: Deviations,
    backings: Backings,
    requested_error: f64,
    max_states: u64,
}

/// The question for the accuracy.
#[derive(Debug)]
pub struct Accuracy;

impl Question for Accuracy {
    type Checked = CheckedAccuracy;
    type Answer = AccuracyAnswer;

    fn name(&self) -> String {
        "accuracy".into()
    }

    fn reads(&self, design: &Design) -> impl Serialize {
        let Design { drive, materials, load, model, modification, deviations, accuracy, parts, .. } = design.in_key();
        (drive, materials, load, model, (modification, deviations, parts), accuracy)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<CheckedAccuracy, NoAnswer> {
        let mut violations = Vec::new();
        let draft = checked_drive(design, &mut violations)?;
        let load = checked_load(design, &draft, &mut violations)?;
        let requested_error = design.accuracy.requested_error;
        violations.extend(Parameter::RequestedError.check(requested_error));
        let (Some(drive), Some(load), true) = (draft.drive(), load, violations.is_empty()) else {
            return Err(NoAnswer::impossible(&violations));
        };
        let has_pointed_tips = model_error::has_pointed_tips(&drive);
        Ok(CheckedAccuracy {
            model: design.complete_model(has_pointed_tips),
            refinements: design.refinements_by_virtual_work(has_pointed_tips),
            backings: Backings::of(&drive, &draft, &design.parts_parameters()?, design.support()),
            drive,
            load,
            deviations: design.deviations.clone(),
            requested_error,
            max_states: limits.max_searched_states,
        })
    }

    fn max_bytes(_: &CheckedAccuracy, _: Format) -> Option<u64> {
        None
    }

    fn answer(checked: &CheckedAccuracy, stop: &dyn Stop) -> Result<AccuracyAnswer, NoAnswer> {
        let &CheckedAccuracy { ref drive, ref load, requested_error, .. } = checked;
        let parameters = *load.parameters();
        let own = Model::new(checked, &parameters, stop).map_err(|error| match error {
            // No field of the document is wrong, because the reference's tolerance is fixed.
            SolveError::TooManyStates { limit } => NoAnswer::new(
                NoAnswerCode::TooManyStates,
                format!(
                    "a converged reference for this drive needs more than the {limit} states that `max_states` allows"
                ),
            ),
            error => error.into(),
        })?;
        let (mut ways, mut unavailable) = (own.measured(&own, stop)?, Vec::new());
        for other in other_models(drive, &parameters, checked.refinements) {
            match Model::new(checked, &other, stop) {
                Ok(model) => ways.extend(model.measured(&own, stop)?),
                Err(SolveError::Stopped) => return Err(NoAnswer::stopped()),
                Err(error) => unavailable.push(UnavailableAnswer {
                    compatibility: other.compatibility,
                    law: other.law.name(),
                    code: NoAnswer::from(error).code,
                }),
            }
        }
        let is_own = |way: &&WayAnswer| {
            way.compatibility == parameters.compatibility
                && way.law == parameters.law.name()
                && way.error <= requested_error
        };
        let cheapest = ways.iter().filter(is_own).min_by(|one, other| one.solve_us.total_cmp(&other.solve_us)).cloned();
        Ok(AccuracyAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            model: checked.model.clone(),
            requested_error,
            cheapest,
            ways,
            unavailable,
        })
    }
}

/// Returns every other model: each form of compatibility with each law that is possible for it and the teeth. A law
/// with numbers is compared only if it is the design's own.
fn other_models(drive: &Drive, own: &LoadParameters, refinements: Refinements) -> Vec<LoadParameters> {
    let others = ContactLaw::WITHOUT_NUMBERS.into_iter().filter(|law| law.suits(&drive.parameters().tooth));
    // Other numbers would be another model with the same name.
    let others = others.map(|law| if law.name() == own.law.name() { own.law } else { law });
    let laws: Vec<_> = std::iter::once(own.law).chain(others).collect();
    let mut models = Vec::new();
    for compatibility in [Compatibility::Projection, Compatibility::VirtualWork] {
        for &law in &laws {
            let Refinements { ring_teeth_bend, wave_generator_moves, corner_contact, .. } = match compatibility {
                Compatibility::Projection => Refinements::NONE,
                Compatibility::VirtualWork => refinements,
            };
            let model =
                LoadParameters { compatibility, law, ring_teeth_bend, wave_generator_moves, corner_contact, ..*own };
            let is_possible = compatibility == Compatibility::VirtualWork || law.is_of_projection();
            if is_possible && model != *own && !models.contains(&model) {
                models.push(model);
            }
        }
    }
    models
}

/// Returns the largest relative difference of six peaks from their reference.
fn difference(peaks: &PerContact<ContactPeaks>, reference: &PerContact<ContactPeaks>) -> f64 {
    let pairs = peaks.iter().flat_map(|(contact, peaks)| {
        let reference = reference.get(contact);
        [(peaks.force_n, reference.force_n), (peaks.stress_mpa, reference.stress_mpa)]
    });
    pairs.map(|(peak, reference)| (peak.value - reference.value).abs() / reference.value).fold(0.0, f64::max)
}

/// A model of the design with its converged peaks.
struct Model<'a> {
    checked: &'a CheckedAccuracy,
    load: LoadCase,
    peaks: PerContact<ContactPeaks>,
    /// Largest error of its forces that was measured in similar drives.
    expected_error: Option<f64>,
}

impl<'a> Model<'a> {
    fn new(checked: &'a CheckedAccuracy, parameters: &LoadParameters, stop: &dyn Stop) -> Result<Self, SolveError> {
        let CheckedAccuracy { drive, deviations, backings, max_states, .. } = checked;
        let load = LoadCase::new(parameters).map_err(SolveError::Impossible)?;
        // Some forms of compatibility would turn a gap into load.
        let violations = parameters.clearance_violations(&Draft::new(drive.parameters())?)?;
        if !violations.is_empty() {
            return Err(SolveError::Impossible(violations));
        }
        let sweep = sweep_with_deviations(drive, &load, deviations, Points::finest(*max_states), stop)?;
        let shared = backings.estimates_with_shares(drive, parameters, &sweep.peaks);
        let parts = Some((backings, shared.as_deref()));
        let ModelError { measured, beyond, .. } = model_error::of(drive, &load, deviations, &sweep, parts)?;
        let is_like = beyond.iter().all(|reason| matches!(reason, Beyond::Law));
        let expected_error = measured.filter(|_| is_like).map(|measured| measured.force.largest());
        Ok(Self { checked, load, peaks: sweep.peaks, expected_error })
    }

    /// Returns each number of samples and each tolerance within the limit on states, with its measured error and time.
    fn measured(&self, own: &Self, stop: &dyn Stop) -> Result<Vec<WayAnswer>, SolveError> {
        let &CheckedAccuracy { ref drive, ref deviations, max_states, .. } = self.checked;
        let mesh = self.load.mesh(drive, deviations);
        // All of them are within the range.
        let samples = SAMPLES.into_iter().filter_map(|samples| Samples::new(samples).ok());
        let samples = samples.filter(|&samples| mesh.state_count(samples) <= max_states).map(Points::Samples);
        let tolerances = TOLERANCES.into_iter().filter_map(|value| Tolerance::new(value, max_states).ok());
        samples.chain(tolerances.map(Points::Tolerance)).map(|points| self.way(own, points, stop)).collect()
    }

    fn way(&self, own: &Self, points: Points, stop: &dyn Stop) -> Result<WayAnswer, SolveError> {
        /// Fraction of the model's error below which the numerical error is negligible.
        const FINER: f64 = 0.1;
        let CheckedAccuracy { drive, deviations, .. } = self.checked;
        let begun = Instant::now();
        let mut times_us = Vec::with_capacity(MOST_RUNS);
        let found = loop {
            let started = Instant::now();
            let found = sweep_with_deviations(drive, &self.load, deviations, points, stop)?;
            times_us.push(1e6 * started.elapsed().as_secs_f64());
            if times_us.len() == MOST_RUNS || begun.elapsed() > ENOUGH {
                break found;
            }
        };
        times_us.sort_by(f64::total_cmp);
        let (samples, tolerance) = match points {
            Points::Samples(samples) => (Some(samples.count()), None),
            Points::Tolerance(tolerance) => (None, Some(tolerance.relative())),
        };
        let p = self.load.parameters();
        let error = difference(&found.peaks, &self.peaks);
        Ok(WayAnswer {
            compatibility: p.compatibility,
            law: p.law.name(),
            samples,
            tolerance,
            error,
            model_difference: difference(&self.peaks, &own.peaks),
            expected_model_error: self.expected_error,
            is_finer_than_model: self.expected_error.is_some_and(|expected| error < FINER * expected),
            solve_us: times_us[times_us.len() / 2],
            states: found.states.len(),
        })
    }
}

impl Forms for AccuracyAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[(Format::Csv, Self::write_csv), (Format::Text, Self::write_text)];
}

impl AccuracyAnswer {
    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let names = [
            "compatibility",
            "law",
            "samples",
            "tolerance",
            "error",
            "model_difference",
            "solve_us",
            "states",
            "expected_model_error",
            "is_finer_than_model",
        ];
        let rows = self.ways.iter().map(|way| {
            let points = (way.compatibility, way.law, way.samples, way.tolerance);
            let measured = (way.error, way.model_difference, way.solve_us, way.states);
            (points, measured, way.expected_model_error, way.is_finer_than_model)
        });
        write_csv(&names, rows, writer)
    }

    fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(
            writer,
            "compatibility  law       points            error   from own model      solve    states  model"
        )?;
        for way in &self.ways {
            way.write_line(writer)?;
        }
        for UnavailableAnswer { compatibility, law, code } in &self.unavailable {
            writeln!(writer, "{:<14} {:<9} no answer: {}", word(compatibility), word(law), word(code))?;
        }
        match &self.cheapest {
            Some(way) => {
                writeln!(writer, "\nfastest method with the design's own model within {:e}:", self.requested_error)?;
                way.write_line(writer)
            }
            None => writeln!(writer, "\nno method with the design's own model is within {:e}", self.requested_error),
        }?;
        writeln!(
            writer,
            "\nmodel: error of the model against elastic bodies. If an error is below a tenth of it (<), further digits are meaningless"
        )
    }
}

impl WayAnswer {
    fn write_line(&self, writer: &mut dyn Write) -> io::Result<()> {
        let points = match (self.samples, self.tolerance) {
            (Some(samples), _) => format!("{samples} samples"),
            (None, tolerance) => format!("to {:e}", tolerance.unwrap_or_default()),
        };
        writeln!(
            writer,
            "{:<14} {:<9} {points:<14} {:>8.1e}         {:>8.1e} {:>7.1} us {:>9}  {}",
            word(&self.compatibility),
            word(&self.law),
            self.error,
            self.model_difference,
            self.solve_us,
            self.states,
            self.expected_model_error.map_or_else(
                || "not measured".into(),
                |expected| format!("{expected:.0e}{}", if self.is_finer_than_model { " <" } else { "" })
            )
        )
    }
}
