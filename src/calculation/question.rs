//! The walk from a document to an answer, which all questions share.

pub use toothwave_solver::Stop;
use toothwave_solver::drive::Draft;
use toothwave_solver::{LoadCase, Parameter, SolveError, Violation, model_error};

use crate::design::Design;
use crate::forms::{Format, Forms};
use crate::key::{Encode, Key};
use crate::no_answer::NoAnswer;

/// What is computed at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most states of a sweep.
    pub max_states: u64,
    /// Most points of all profiles of a geometry.
    pub max_profile_points: u64,
    /// Most states of a sweep to a tolerance, whose number is not known before.
    pub max_searched_states: u64,
}

impl Limits {
    /// Limits with as many states to a tolerance as otherwise.
    pub const fn new(max_states: u64, max_profile_points: u64) -> Self {
        Self { max_states, max_profile_points, max_searched_states: max_states }
    }
}

/// What a design document can be asked.
pub trait Question: Send + 'static {
    /// The checked parameters that the answer follows from.
    type Checked: Send + Sync + 'static;
    /// The answer; its serialisation is its JSON.
    type Answer: Forms;

    /// Its name, in the key.
    fn name(&self) -> &'static str;

    /// The parts of a normalised document that the answer depends on.
    fn reads<'a>(&self, design: &'a Design) -> impl Encode + 'a;

    /// Checks those parts, reporting every impossible value.
    ///
    /// # Errors
    /// Names the fields at fault.
    fn check(&self, design: &Design, limits: &Limits) -> Result<Self::Checked, NoAnswer>;

    /// The upper bound of the bytes that the answer takes with its text in this format; none if only solving tells.
    fn max_bytes(_checked: &Self::Checked, _format: Format) -> Option<u64> {
        Some(0)
    }

    /// Whether solving, and writing the answer as JSON, is certain to take no longer than some 0.1 ms.
    fn is_short(_checked: &Self::Checked) -> bool {
        false
    }

    /// Solves.
    ///
    /// # Errors
    /// Why there is no answer; also where `stop` was set.
    fn answer(checked: &Self::Checked, stop: &dyn Stop) -> Result<Self::Answer, NoAnswer>;

    /// The key of the answer in a form that `form` stands for: equal keys are equal bytes, whatever process they come from.
    fn key(&self, design: &Design, form: &impl Encode) -> Key {
        Key::new(self.name(), &self.reads(design), form)
    }

    /// The whole walk.
    ///
    /// # Errors
    /// Why there is no answer.
    fn ask(&self, document: &[u8], limits: &Limits, stop: &dyn Stop) -> Result<Self::Answer, NoAnswer> {
        Self::answer(&self.check(&Design::read(document)?, limits)?, stop)
    }
}

/// Guards the promise that no answer holds anything but numbers: serde_json would write `null` and say nothing.
///
/// # Errors
/// A fault of the calculation.
pub(crate) fn require_finite<'a>(columns: impl IntoIterator<Item = &'a Vec<f64>>) -> Result<(), NoAnswer> {
    if columns.into_iter().all(|column| column.iter().all(|value| value.is_finite())) {
        Ok(())
    } else {
        Err(NoAnswer::internal("a result is not finite"))
    }
}

/// The drive of a document as far as it is possible; what is not adds its violations to the others.
///
/// # Errors
/// Where the geometry does not converge.
pub(crate) fn checked_drive(design: &Design, violations: &mut Vec<Violation>) -> Result<Draft, NoAnswer> {
    let draft = Draft::new(&design.drive_parameters()).map_err(SolveError::from)?;
    violations.extend(design.as_written(draft.violations()));
    Ok(draft)
}

/// The load of a document for a drive that was checked before; what is impossible adds its violations to the others.
///
/// # Errors
/// Where the document has no load or not exactly one torque, and where the geometry does not converge.
pub(crate) fn checked_load(
    design: &Design,
    draft: &Draft,
    violations: &mut Vec<Violation>,
) -> Result<Option<LoadCase>, NoAnswer> {
    let has_pointed_tips = draft.drive().is_some_and(|drive| model_error::has_pointed_tips(&drive));
    let parameters = design.load_parameters(has_pointed_tips)?;
    let duty = design.duty()?;
    // The torques of a duty have places of their own.
    let of_duty = |violation: &Violation| {
        use Parameter::{InputTorque, OutputTorque};
        duty.is_asked && matches!(violation, Violation::OutOfRange { parameter: InputTorque | OutputTorque, .. })
    };
    let of_clearances = design.clearance_violations();
    // A gap is too large as the clearances are that it is the sum of, or their sum is.
    let as_clearance = |violation: Violation| match violation {
        Violation::OutOfRange { parameter: Parameter::Clearance(contact), value, limit } => {
            let parameter = Parameter::PartClearance(contact.mate());
            of_clearances.is_empty().then_some(Violation::OutOfRange { parameter, value, limit })
        }
        other => Some(other),
    };
    let load = LoadCase::new(&parameters)
        .map_err(|found| violations.extend(found.into_iter().filter(|found| !of_duty(found)).filter_map(as_clearance)))
        .ok();
    violations.extend(of_clearances);
    violations.extend(design.duty_violations()?);
    violations.extend(parameters.clearance_violations(draft).map_err(SolveError::from)?);
    violations.extend(draft.drive().and_then(|drive| parameters.modification.violation_in(&drive)));
    violations.extend(parameters.carrier_violations(draft));
    violations.extend(parameters.deviation_violations(&design.drive_parameters(), &(&design.deviations).into()));
    Ok(load)
}
