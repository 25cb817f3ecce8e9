//! Search: the best designs within limits, and the limits that prevent better ones.

mod answer;
mod envelope;
mod island;

use envelope::{from_envelope, place_of, put_in, with_wave_generator};
use island::variable_values;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question;
use toothwave_solver::Never;

use crate::ask::{beyond, escaped, fault, index_of, named, whole};
use crate::document::{Base, FreeDocument, Goal, RangeDocument, RequireDocument, SearchDocument};
use crate::evaluate::{Evaluator, Outcome, Stopped};
use crate::front::MOST_OBJECTIVES;
use crate::limit::{Bound, Limit, limits};
use crate::map::asked;
use crate::point::Judged;
use crate::quantity::{Needs, Quantity};
use crate::random::Stream;
use crate::variant::Template;

pub use answer::{FoundAnswer, FreeAnswer, LimitAnswer, RelaxationAnswer, ScanAnswer, SearchAnswer};
pub(crate) use island::Island;
pub use island::IslandPart;

/// Approximate evaluations of an island. Each island is a chunk.
const ISLAND_EVALUATIONS: u64 = 12_500;

/// Divisor: this fraction of an island's evaluations is the scan.
const SCAN_SHARE: u64 = 5;

/// Evaluations with accurate peaks in addition to those of the front.
const TRUE_EVALUATIONS: u64 = 300;

/// Relative tolerance of accurate peaks.
const TRUE_PEAKS: f64 = 1e-6;

/// Samples of a front with a duty. A duty is swept over the same input angles at all its points, without a tolerance.
const SAMPLES_OF_DUTY: f64 = 200.0;

/// Samples of the period during the search, if the base names none.
const SAMPLES: f64 = 16.0;

const KIND: &str = "/drive/wave_generator/kind";

const TOOTH_COUNT: &str = "/drive/teeth/count";

/// Range of the number of teeth, as in design documents.
const LEAST_COUNT: f64 = 2.0;

const LARGEST_COUNT: f64 = 10_000.0;

/// A checked search.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    limits: Vec<Limit>,
    objectives: Vec<Objective>,
    islands: u64,
    evaluations: u64,
    seed: u64,
    start: Vec<Vec<f64>>,
    /// Template of the answer's designs, with accurate peaks, if the search itself uses sampled peaks.
    at_true_peaks: Option<Template>,
}

#[derive(Debug, Clone, Copy)]
struct Objective {
    quantity: usize,
    goal: Goal,
}

/// Least safety of the carrier's fingers, if a search gives the carrier's strength and no limit: usual in machine design
/// for typical strengths.
const FINGER_SAFETY: f64 = 1.5;

impl SearchDocument {
    /// Returns the document with the default limit on the safety of the carrier's fingers.
    pub(crate) fn with_default_limits(&self) -> Self {
        let mut document = self.clone();
        let Base(base) = &self.base;
        let at = |pointer: &str| path(pointer).and_then(|place| base.at(&place));
        let is_ball = at("/drive/teeth/shape") == Some(&Tree::Text("ball".into()));
        if at("/parts/carrier/strength").is_some() && !is_ball {
            let limit = RangeDocument { min: Some(FINGER_SAFETY), max: None };
            let limit = document.require.entry("finger_safety".into()).or_insert(RequireDocument::Range(limit));
            if let RequireDocument::Range(RangeDocument { min: min @ None, max: Some(FINGER_SAFETY..) }) = limit {
                *min = Some(FINGER_SAFETY);
            }
        }
        document
    }
}

impl Search {
    pub(crate) fn new(document: &SearchDocument) -> Result<(Self, Template, Vec<&'static Quantity>), NoAnswer> {
        let mut quantities = Vec::new();
        let objectives = objectives(document, &mut quantities)?;
        let limits = limits(&document.require, &mut quantities)?;
        let evaluations = whole("/evaluations", document.evaluations.value(), 100.0, 1e8)?;
        let seed = whole("/seed", document.seed.value(), 0.0, 9_007_199_254_740_991.0)?;
        let mut base = document.base.0.clone();
        let mut free = document.free.clone();
        if free.is_empty() {
            from_envelope(document, &mut base, &mut free)?;
        } else if free.contains_key("/drive/wave_generator/mean_path_radius_mm") && !free.contains_key(KIND) {
            // The fields that would be derived, written out.
            with_wave_generator(&mut base)?;
        }
        let mut list = Vec::new();
        for (pointer, FreeDocument { min, max, one_of }) in &free {
            let at = format!("/free/{}", escaped(pointer));
            list.push((pointer.clone(), asked(&at, *min, *max, one_of.as_deref())?));
        }
        let place = |name: &str| ["sweep".to_owned(), name.to_owned()];
        let (samples, tolerance) = (place("samples"), place("tolerance"));
        let is_free = free.keys().any(|pointer| pointer.starts_with("/sweep/"));
        if !is_free && base.at(&samples).is_none() && base.at(&tolerance).is_none() {
            put_in(&mut base, &samples, Tree::Number(SAMPLES));
        }
        let template = Template::new(&base, &list, "free")?;
        let has_duty = base.at(&path("/load/duty").unwrap_or_default()).is_some();
        let at_true_peaks = (!is_free && base.at(&tolerance).is_none()).then(|| {
            let mut template = template.clone();
            if !has_duty {
                template.remove(&samples);
                template.set(&tolerance, &Tree::Number(TRUE_PEAKS));
            } else if !matches!(base.at(&samples), Some(Tree::Number(given)) if *given >= SAMPLES_OF_DUTY) {
                template.set(&samples, &Tree::Number(SAMPLES_OF_DUTY));
            }
            template
        });
        let start = document.start.iter().enumerate();
        let start = start.map(|(index, design)| place_of(&design.0, &template, index)).collect::<Result<_, _>>()?;
        let islands = (evaluations / ISLAND_EVALUATIONS).clamp(1, 4096);
        let of_an_island = evaluations / islands;
        let most = of_an_island - of_an_island / SCAN_SHARE;
        if document.start.len() as u64 > most {
            let count = document.start.len();
            let detail = format!(
                "`start` has {count} designs. Each of {islands} islands evaluates {of_an_island} variants, so use at most {most} designs, or more `evaluations`"
            );
            return Err(fault("/start", FieldCode::OutOfRange, detail));
        }
        Ok((Self { limits, objectives, islands, evaluations, seed, start, at_true_peaks }, template, quantities))
    }

    pub(crate) const fn islands(&self) -> u64 {
        self.islands
    }

    /// Number of variants, without those of the fronts that are evaluated again.
    pub(crate) const fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The free values of the starts.
    pub(crate) fn starts(&self) -> Tree {
        let numbers = |place: &Vec<f64>| Tree::Array(place.iter().copied().map(Tree::Number).collect());
        Tree::Array(self.start.iter().map(numbers).collect())
    }

    /// Bytes of the stored fronts of all islands.
    pub(crate) fn stored_bytes(&self, quantities: usize, variables: usize) -> u64 {
        let numbers = quantities + variables + self.limits.len() + self.objectives.len();
        let points = crate::optimise::MOST_OF_FRONT + self.limits.len() + 1;
        self.islands * (8 * numbers * points) as u64
    }

    /// Bytes of the template for accurate peaks.
    pub(crate) fn template_bytes(&self) -> usize {
        self.at_true_peaks.as_ref().map_or(0, Template::bytes)
    }

    /// Bytes of the designs in an answer: those of the front or, without one, the nearest ones. `document_bytes` is the
    /// largest document as a tree.
    pub(crate) fn designs_bytes(&self, document_bytes: usize) -> u64 {
        /// Bytes of a design with its quantities, without its lists. Numbers of lists take a quarter of their size in a
        /// tree.
        const DESIGN_BYTES: usize = 8192;
        let designs = (2 * crate::optimise::MOST_OF_FRONT).max(self.limits.len() + 1);
        (designs * (DESIGN_BYTES + document_bytes / 2)) as u64
    }

    /// Checks that the free fields change every objective, and every quantity that violates its limit otherwise.
    pub(crate) fn require_that_free_fields_matter(
        &self,
        template: &Template,
        quantities: &[&'static Quantity],
        limits: &question::Limits,
    ) -> Result<(), NoAnswer> {
        if !template.varies_within(&[""]) {
            let detail = "nothing is free: each range and each list has only one value. Widen a range";
            return Err(fault("/free", FieldCode::Unaffected, detail));
        }
        let is_said = |place: &str| {
            let stands = |tree: &Tree| tree.at(&path(place).unwrap_or_default()).is_some();
            template.examples().all(stands) && !template.is_varied(place)
        };
        let is_affected =
            |quantity: &Quantity| !quantity.said_by.is_some_and(is_said) && template.varies_within(quantity.depends_on);
        for (index, objective) in self.objectives.iter().enumerate() {
            let quantity = quantities[objective.quantity];
            if !is_affected(quantity) {
                let detail = format!(
                    "no free field changes `{}`. Remove this objective, or free a field that changes it",
                    quantity.name
                );
                return Err(fault(&format!("/objectives/{index}/quantity"), FieldCode::Unaffected, detail));
            }
        }
        let is_settled = |quantity: &Quantity| quantity.needs == Needs::Drive && !is_affected(quantity);
        let settled = self.limits.iter().filter(|limit| is_settled(quantities[limit.quantity]));
        for limit in settled {
            let quantity = quantities[limit.quantity];
            if let Some(value) = some_value(quantity, template, limits)
                && limit.violation(value) > 0.0
            {
                let end = match limit.bound {
                    Bound::Min => "/min",
                    Bound::Max => "/max",
                    Bound::Is => "",
                };
                let at = format!("/require/{}{end}", escaped(quantity.name));
                let detail = format!(
                    "no free field changes `{}`, which is {value:?}. Change this limit, or free a field that changes it",
                    quantity.name
                );
                return Err(beyond(&at, FieldCode::Unaffected, detail, limit.limit, value));
            }
        }
        Ok(())
    }

    /// Returns the least violations of a variant, given some of its values and NaN for the others.
    fn least_judged(&self, values: &[f64]) -> Judged {
        let least = |limit: &Limit| match values[limit.quantity] {
            value if value.is_finite() => limit.violation(value),
            _ => 0.0,
        };
        Judged { objectives: Vec::new(), violations: self.limits.iter().map(least).collect() }
    }

    fn judged(&self, values: &[f64]) -> Judged {
        let objective = |objective: &Objective| match objective.goal {
            Goal::Min => values[objective.quantity],
            Goal::Max => -values[objective.quantity],
        };
        Judged {
            objectives: self.objectives.iter().map(objective).collect(),
            violations: self.limits.iter().map(|limit| limit.violation(values[limit.quantity])).collect(),
        }
    }
}

/// Returns the value of a drive's quantity in one of some random variants, if one of them is possible.
fn some_value(quantity: &'static Quantity, template: &Template, limits: &question::Limits) -> Option<f64> {
    const TRIES: u64 = 64;
    let evaluator = Evaluator::new(vec![quantity], *limits);
    let mut template = template.clone();
    (0..TRIES).find_map(|stream| {
        let mut stream = Stream::new(0, stream);
        let place: Vec<_> = template.variables().iter().map(|_| stream.share()).collect();
        let values = variable_values(&template, &place);
        match evaluator.outcome(template.filled(&values), &Never) {
            Ok(Outcome::Answered(values)) => values.first().copied(),
            // A drive without a load needs no memory limit.
            Ok(Outcome::Refused(_)) | Err(Stopped) => None,
        }
    })
}

fn objectives(document: &SearchDocument, quantities: &mut Vec<&'static Quantity>) -> Result<Vec<Objective>, NoAnswer> {
    let asked = &document.objectives;
    if asked.is_empty() {
        return Err(fault("/objectives", FieldCode::MissingField, "`objectives` is empty. Name a quantity and a goal"));
    }
    if asked.len() > MOST_OBJECTIVES {
        let detail = format!("use at most {MOST_OBJECTIVES} objectives; there are {}", asked.len());
        return Err(fault("/objectives", FieldCode::OutOfRange, detail));
    }
    let mut objectives: Vec<Objective> = Vec::new();
    for (index, objective) in asked.iter().enumerate() {
        let at = format!("/objectives/{index}/quantity");
        let quantity = index_of(named(&objective.quantity, &at)?, quantities);
        if objectives.iter().any(|other| other.quantity == quantity) {
            let detail = format!("`{}` is listed twice. Remove one", objective.quantity);
            return Err(fault(&at, FieldCode::ConflictingFields, detail));
        }
        objectives.push(Objective { quantity, goal: objective.goal });
    }
    Ok(objectives)
}
