//! The walk from a document to an answer, which all questions share.

use std::cell::{OnceCell, RefCell};

pub use toothwave_solver::Stop;
use toothwave_solver::drive::Draft;
use toothwave_solver::{LoadCase, Parameter, SolveError, Violation, model_error};

use crate::design::Design;
use crate::forms::Forms;
use crate::key::{Encode, Key};
use crate::no_answer::NoAnswer;

/// What is computed at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most states of a sweep.
    pub max_states: u64,
    /// Most points of all profiles of a geometry.
    pub max_profile_points: u64,
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

    /// Bytes that the answer's columns of numbers take, as far as that is known before it is there, or about.
    fn columns_bytes(_checked: &Self::Checked) -> u64 {
        0
    }

    /// About how many bytes solving takes besides, and has let go when the answer is there.
    fn working_bytes(_checked: &Self::Checked) -> u64 {
        0
    }

    /// About how many bytes both are once a search for extremes has looked at so many input angles.
    fn searched_bytes(_checked: &Self::Checked, _input_angles: u64) -> u64 {
        0
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

/// Solves, where a search for extremes takes room for all input angles that it has looked at before it looks at more.
///
/// # Errors
/// That of `take`, which stops the search.
pub fn with_room<T, E>(
    stop: &dyn Stop,
    take: impl FnMut(u64) -> Result<(), E>,
    solve: impl FnOnce(&dyn Stop) -> Result<T, NoAnswer>,
) -> Result<Result<T, NoAnswer>, E> {
    let taking = Taking { stop, take: RefCell::new(take), refused: OnceCell::new() };
    let solved = solve(&taking);
    taking.refused.into_inner().map_or(Ok(solved), Err)
}

struct Taking<'a, F, E> {
    stop: &'a dyn Stop,
    take: RefCell<F>,
    refused: OnceCell<E>,
}

impl<F: FnMut(u64) -> Result<(), E>, E> Stop for Taking<'_, F, E> {
    fn stopped(&self) -> bool {
        self.refused.get().is_some() || self.stop.stopped()
    }

    fn has_room_for(&self, input_angles: u64) -> bool {
        match (self.take.borrow_mut())(input_angles) {
            Ok(()) => true,
            Err(refused) => {
                self.refused.get_or_init(|| refused);
                false
            }
        }
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
