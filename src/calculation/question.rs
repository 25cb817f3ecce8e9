//! The steps from a document to an answer, which all questions share.

use serde::Serialize;
use toothwave_solver::backing::Backings;
use toothwave_solver::drive::Draft;
use toothwave_solver::{LoadCase, Parameter, Part, Violation, model_error};
pub use toothwave_solver::{Never, Stop};

use crate::design::{Design, PartsDocument, SeriesComplianceDocument, TeethDocument};
use crate::forms::{Format, Forms};
use crate::key::Key;
use crate::no_answer::NoAnswer;

/// Limits of computations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most states of a sweep.
    pub max_states: u64,
    /// Most points of all profiles of a geometry together.
    pub max_profile_points: u64,
    /// Most states of a sweep with a tolerance, whose number is not known in advance.
    pub max_searched_states: u64,
}

impl Limits {
    /// Limits without a server: about 2 GB of memory.
    pub const OFFLINE: Self = Self::new(20_000_000, 20_000_000);

    /// Makes limits with the same number of states with and without a tolerance.
    pub const fn new(max_states: u64, max_profile_points: u64) -> Self {
        Self { max_states, max_profile_points, max_searched_states: max_states }
    }
}

/// A question about a design document.
pub trait Question: Send + 'static {
    /// Checked parameters of the answer.
    type Checked: Send + Sync + 'static;
    /// The answer. Its serialization is its JSON.
    type Answer: Forms;

    /// Name of the question in the key.
    fn name(&self) -> String;

    /// Returns the parts of a normalised document that the answer depends on.
    fn reads(&self, design: &Design) -> impl Serialize;

    /// Checks these parts and reports every impossible value.
    fn check(&self, design: &Design, limits: &Limits) -> Result<Self::Checked, NoAnswer>;

    /// Upper bound of the bytes of the answer with its text in this format, or none if it is unknown before solving.
    fn max_bytes(_checked: &Self::Checked, _format: Format) -> Option<u64> {
        Some(0)
    }

    /// True if solving and writing JSON certainly take at most about 0.1 ms.
    fn is_short(_checked: &Self::Checked) -> bool {
        false
    }

    /// Computes the answer.
    fn answer(checked: &Self::Checked, stop: &dyn Stop) -> Result<Self::Answer, NoAnswer>;

    /// Returns the key of the answer in this form. Equal keys mean equal bytes in every process.
    fn key(&self, design: &Design, form: &impl Serialize) -> Key {
        Key::new(&self.name(), &self.reads(design), form)
    }

    /// Parses, checks and computes.
    fn ask(&self, document: &[u8], limits: &Limits, stop: &dyn Stop) -> Result<Self::Answer, NoAnswer> {
        Self::answer(&self.check(&Design::read(document)?, limits)?, stop)
    }
}

/// Checks that all values are finite. serde_json would write `null` silently.
pub(crate) fn require_finite(columns: impl IntoIterator<Item = impl AsRef<[f64]>>) -> Result<(), NoAnswer> {
    if columns.into_iter().all(|column| column.as_ref().iter().all(|value| value.is_finite())) {
        Ok(())
    } else {
        Err(NoAnswer::internal("a result is not finite"))
    }
}

/// Returns the drive of a document, as far as it is possible, and adds its violations.
pub(crate) fn checked_drive(design: &Design, violations: &mut Vec<Violation>) -> Result<Draft, NoAnswer> {
    let draft = Draft::new(&design.drive_parameters())?;
    violations.extend(design.as_written(draft.violations()));
    Ok(draft)
}

/// Returns the load of a document for a checked drive, and adds its violations. Fails without a load, or without
/// exactly one torque.
pub(crate) fn checked_load(
    design: &Design,
    draft: &Draft,
    violations: &mut Vec<Violation>,
) -> Result<Option<LoadCase>, NoAnswer> {
    let has_pointed_tips = draft.drive().is_some_and(|drive| model_error::has_pointed_tips(&drive));
    let mut parameters = design.load_parameters(has_pointed_tips)?;
    if design.model.series_compliance_mm_per_n == SeriesComplianceDocument::Estimated
        && let Some(drive) = draft.drive()
    {
        let backings = Backings::of(&drive, draft, &design.parts_parameters()?, design.support());
        parameters.series_compliance_mm_per_n = backings.series_compliance_mm_per_n(&drive, &parameters);
    }
    // The torques of a duty have their own fields.
    let of_duty = |violation: &Violation| {
        use Parameter::{InputTorque, OutputTorque};
        design.has_duty() && matches!(violation.parameter, InputTorque | OutputTorque)
    };
    let of_clearances = design.clearance_violations();
    // A gap is the sum of clearances, so the error is about one clearance or about their sum.
    let as_clearance = |violation: Violation| match violation.parameter {
        Parameter::Clearance(contact) => {
            let parameter = Parameter::PartClearance(contact.mate());
            of_clearances.is_empty().then_some(Violation { parameter, ..violation })
        }
        _ => Some(violation),
    };
    let load = LoadCase::new(&parameters)
        .map_err(|found| violations.extend(found.into_iter().filter(|found| !of_duty(found)).filter_map(as_clearance)))
        .ok();
    violations.extend(of_clearances);
    violations.extend(design.duty_violations());
    violations.extend(parameters.clearance_violations(draft)?);
    violations.extend(draft.drive().and_then(|drive| parameters.modification.violation_in(&drive)));
    violations.extend(parameters.carrier_violations(draft));
    for violation in violations_of_supports(design, draft)? {
        let is_listed = |listed: &Violation| (listed.code, listed.parameter) == (violation.code, violation.parameter);
        if !violations.iter().any(is_listed) {
            violations.push(violation);
        }
    }
    violations.extend(parameters.deviation_violations(&design.drive_parameters(), &design.deviations));
    Ok(load)
}

/// Returns the reasons why given radii leave nothing of a part whose compliance or strength the document asks for.
fn violations_of_supports(design: &Design, draft: &Draft) -> Result<Vec<Violation>, NoAnswer> {
    let PartsDocument { ring, carrier, .. } = &design.parts;
    let is_estimated = design.model.series_compliance_mm_per_n == SeriesComplianceDocument::Estimated;
    let has_strength = carrier.strength.is_some() && !matches!(design.drive.teeth, TeethDocument::Ball { .. });
    let has_carrier_radius = carrier.inner_radius_mm.or(carrier.outer_radius_mm).is_some();
    let asked = [
        (Part::Carrier, has_carrier_radius && (is_estimated || has_strength)),
        (Part::Ring, ring.outer_radius_mm.is_some() && is_estimated),
    ];
    let parts = design.parts_parameters()?;
    let found = asked.into_iter().filter(|(_, is_asked)| *is_asked).flat_map(|(part, _)| parts.violations(part, draft));
    let is_of_radius = |violation: &Violation| {
        use Parameter::{CarrierInnerRadius, CarrierOuterRadius, RingOuterRadius};
        matches!(violation.parameter, CarrierInnerRadius | CarrierOuterRadius | RingOuterRadius)
    };
    Ok(found.filter(is_of_radius).collect())
}
