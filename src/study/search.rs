//! Search: the best designs within limits, and the limits that prevent better ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question;
use toothwave_solver::parts::RIM;
use toothwave_solver::{Never, Parameter, Stop};
use utoipa::ToSchema;

use crate::ask::{beyond, escaped, fault, index_of, named, whole};
use crate::document::{Base, FreeDocument, Goal, RangeDocument, RequireDocument, SearchDocument};
use crate::evaluate::{Evaluator, Outcome, Stopped};
use crate::front::MOST_OBJECTIVES;
use crate::limit::{Bound, Limit, limits};
use crate::map::asked;
use crate::optimise::{Optimiser, Plan, merged};
use crate::point::{Judged, Point};
use crate::quantity::{Needs, OUTER_DIAMETER_MM, Quantity, TRANSMISSION_RATIO};
use crate::random::Stream;
use crate::rows::{ReasonAnswer, RefusalNoted, note};
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{Domain, Template, Value, Variable};

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
    /// Template for accurate peaks, if the search itself uses sampled peaks.
    at_true_peaks: Option<Template>,
}

#[derive(Debug, Clone, Copy)]
struct Objective {
    quantity: usize,
    goal: Goal,
}

/// Result of an island.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IslandPart {
    evaluated: u64,
    front: Vec<Point>,
    relaxations: Vec<Option<Point>>,
    nearest: Option<Point>,
    scan: Scan,
}

/// Counts of the scan.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Scan {
    variants: u64,
    good: u64,
    /// For each limit, the variants that violate it, and those that violate it alone.
    fell: Vec<u64>,
    fell_alone: Vec<u64>,
    refused: u64,
    refusals: Vec<RefusalNoted>,
}

impl Scan {
    fn new(limits: usize) -> Self {
        Self { fell: vec![0; limits], fell_alone: vec![0; limits], ..Self::default() }
    }

    fn add(&mut self, judged: &Judged) {
        let beyond = || judged.violations.iter().enumerate().filter(|(_, violation)| **violation > 0.0);
        let count = beyond().count();
        self.good += u64::from(count == 0);
        for (limit, _) in beyond() {
            self.fell[limit] += 1;
            self.fell_alone[limit] += u64::from(count == 1);
        }
    }

    fn append(&mut self, other: &Self) {
        self.variants += other.variants;
        self.good += other.good;
        self.refused += other.refused;
        for (sum, count) in self.fell.iter_mut().zip(&other.fell) {
            *sum += count;
        }
        for (sum, count) in self.fell_alone.iter_mut().zip(&other.fell_alone) {
            *sum += count;
        }
        for RefusalNoted { reason, detail, first, count } in &other.refusals {
            let refusal = crate::evaluate::Refusal { reason: reason.clone(), detail: detail.clone() };
            note(&mut self.refusals, *first, *count, refusal);
        }
    }
}

/// An island that is being computed.
#[derive(Debug)]
pub(crate) struct Island {
    optimiser: Optimiser,
    template: Template,
    is_true: bool,
    /// A proposed point, and true if it belongs to the scan.
    pending: Option<(Vec<f64>, bool)>,
    evaluated: u64,
    scan: Scan,
    scan_from: u64,
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
            document.require.entry("finger_safety".into()).or_insert(RequireDocument::Range(limit));
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
        }
        let mut list = Vec::new();
        for (pointer, FreeDocument { min, max, one_of }) in &free {
            let at = format!("/free/{}", escaped(pointer));
            list.push((pointer.clone(), asked(&at, *min, *max, one_of.as_deref())?));
        }
        let place = |name: &str| ["sweep".to_owned(), name.to_owned()];
        let (samples, tolerance) = (place("samples"), place("tolerance"));
        let is_free = free.keys().any(|pointer| pointer.starts_with("/sweep/"));
        let is_swept = quantities.iter().any(|quantity| quantity.needs > Needs::Drive);
        if is_swept && !is_free && base.at(&samples).is_none() && base.at(&tolerance).is_none() {
            put_in(&mut base, &samples, Tree::Number(SAMPLES));
        }
        let template = Template::new(&base, &list, "free")?;
        let has_duty = base.at(&path("/load/duty").unwrap_or_default()).is_some();
        let at_true_peaks = (is_swept && !is_free && base.at(&tolerance).is_none()).then(|| {
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

/// Derives the free fields if the document names none. They are the wave generator (two lobes by default), the teeth
/// and their number, within the limits on outer diameter and transmission ratio. Fields of the base stay fixed.
fn from_envelope(
    document: &SearchDocument,
    base: &mut Tree,
    free: &mut BTreeMap<String, FreeDocument>,
) -> Result<(), NoAnswer> {
    let range = |name: &str| match document.require.get(name) {
        Some(RequireDocument::Range(RangeDocument { min, max })) => (*min, *max),
        _ => (None, None),
    };
    let missing = |what: &str| {
        let detail = format!(
            "nothing is free, and `require` is not sufficient to derive free fields. In `require`, {what}; or name free fields with their ranges here"
        );
        fault("/free", FieldCode::MissingField, detail)
    };
    let lobes = with_wave_generator(base)?;
    let is_missing = |base: &Tree, pointer: &str| base.at(&path(pointer).unwrap_or_default()).is_none();
    if is_missing(base, TOOTH_COUNT) {
        if let Some(Tree::Number(ring_teeth)) = base.at(&path("/drive/ring/teeth").unwrap_or_default()) {
            let count = ring_teeth + lobes;
            put_in(base, &path(TOOTH_COUNT).unwrap_or_default(), Tree::Number(count));
        } else {
            let (Some(least_ratio), Some(largest_ratio)) = range(TRANSMISSION_RATIO) else {
                return Err(missing("set `min` and `max` of `transmission_ratio`"));
            };
            let (min, max) = ((lobes * least_ratio).ceil(), (lobes * largest_ratio).floor());
            if min.max(LEAST_COUNT) > max.min(LARGEST_COUNT) {
                let detail = format!(
                    "no number of teeth gives this transmission ratio with a ring of fewer teeth. The ratio is the number of teeth ({LEAST_COUNT:?} to {LARGEST_COUNT:?}) over the number of lobes ({lobes:?})"
                );
                let nearest = min.clamp(LEAST_COUNT, LARGEST_COUNT) / lobes;
                return Err(beyond("/require/transmission_ratio", FieldCode::OutOfRange, detail, least_ratio, nearest));
            }
            let range =
                FreeDocument { min: Some(min.max(LEAST_COUNT)), max: Some(max.min(LARGEST_COUNT)), one_of: None };
            free.insert(TOOTH_COUNT.into(), range);
        }
    }
    let lengths = lengths_over_root_radius(base);
    let lengths: Vec<_> = lengths.into_iter().filter(|(pointer, ..)| is_missing(base, pointer)).collect();
    if !lengths.is_empty() {
        let Some(diameter_mm) = range(OUTER_DIAMETER_MM).1 else {
            return Err(missing("set `max` of `outer_diameter_mm`"));
        };
        // Half of the outer diameter without the rim of the drawn ring.
        let root_mm = 0.5 * diameter_mm / RIM;
        let range = Parameter::ToothRadius.range();
        for &(_, least, largest) in &lengths {
            let (smallest_mm, largest_mm) = (least * root_mm, largest * root_mm);
            if let (Some(limit_mm), Some(_)) =
                (range.limit_exceeded_by(smallest_mm), range.limit_exceeded_by(largest_mm))
            {
                let scale = if limit_mm > smallest_mm { largest } else { least };
                let limit_mm = 2.0 * RIM * limit_mm / scale;
                let detail = format!(
                    "a drive with an outer diameter of {diameter_mm:?} mm has lengths outside their allowed ranges. Change this limit"
                );
                return Err(beyond(
                    "/require/outer_diameter_mm/max",
                    FieldCode::OutOfRange,
                    detail,
                    diameter_mm,
                    limit_mm,
                ));
            }
        }
        free.extend(lengths.into_iter().map(|(pointer, least, largest)| {
            let range = FreeDocument { min: Some(least * root_mm), max: Some(largest * root_mm), one_of: None };
            (pointer.to_owned(), range)
        }));
    }
    if free.is_empty() {
        let detail = "nothing is free: the base sets all fields that could be free. Remove some from the base, or name them here with their ranges";
        return Err(fault("/free", FieldCode::MissingField, detail));
    }
    Ok(())
}

/// Sets a value in the base, unless a parent is not an object. Parsing will report that.
fn put_in(base: &mut Tree, place: &[String], value: Tree) {
    let has_fields = |length: usize| base.at(&place[..length]).is_none_or(|tree| matches!(tree, Tree::Object(_)));
    if (0..place.len()).all(has_fields) {
        base.set(place, value);
    }
}

/// Returns the number of lobes of the base's wave generator. A missing wave generator becomes a harmonic path; a
/// missing number of lobes becomes two.
fn with_wave_generator(base: &mut Tree) -> Result<f64, NoAnswer> {
    const LOBES: &str = "/drive/wave_generator/lobes";
    const TWO: f64 = 2.0;
    const MOST: f64 = 1000.0;
    let place = |pointer: &str| path(pointer).unwrap_or_default();
    if base.at(&place("/drive/wave_generator")).is_none() {
        put_in(base, &place(KIND), Tree::Text("harmonic_path".into()));
    }
    match (word_at(base, KIND), base.at(&place(LOBES))) {
        (Some("eccentric"), _) => Ok(1.0),
        (Some("harmonic" | "harmonic_path"), Some(Tree::Number(lobes))) => {
            if (1.0..=MOST).contains(lobes) {
                return Ok(*lobes);
            }
            let limit = if *lobes < 1.0 { 1.0 } else { MOST };
            let detail = format!("{lobes:?} lobes are out of range. Use 1 to {MOST:?}");
            Err(beyond(&format!("/base{LOBES}"), FieldCode::OutOfRange, detail, *lobes, limit))
        }
        (Some("harmonic" | "harmonic_path"), None) => {
            put_in(base, &place(LOBES), Tree::Number(TWO));
            Ok(TWO)
        }
        // An ellipse, or a kind that parsing the base will refuse.
        _ => Ok(TWO),
    }
}

/// Returns the lengths of the base's wave generator and teeth, with their ranges over the ring's root radius.
fn lengths_over_root_radius(base: &Tree) -> Vec<(&'static str, f64, f64)> {
    let mut lengths = match word_at(base, KIND) {
        None | Some("ellipse") => {
            vec![("/drive/wave_generator/semi_major_mm", 0.3, 1.0), ("/drive/wave_generator/semi_minor_mm", 0.25, 1.0)]
        }
        Some("eccentric") => {
            vec![("/drive/wave_generator/radius_mm", 0.3, 1.0), ("/drive/wave_generator/eccentricity_mm", 0.002, 0.08)]
        }
        Some("harmonic") => vec![
            ("/drive/wave_generator/mean_radius_mm", 0.3, 1.0),
            ("/drive/wave_generator/amplitude_mm", 0.002, 0.08),
        ],
        Some("harmonic_path") => vec![
            ("/drive/wave_generator/mean_path_radius_mm", 0.4, 1.0),
            ("/drive/wave_generator/amplitude_mm", 0.002, 0.08),
        ],
        // Parsing the base refuses it.
        Some(_) => Vec::new(),
    };
    lengths.push(("/drive/teeth/radius_mm", 0.02, 0.15));
    let width = ("/drive/teeth/width_mm", 0.1, 0.6);
    match word_at(base, "/drive/teeth/shape") {
        None | Some("cylinder") => lengths.push(width),
        Some("flat_sided") => lengths.extend([width, ("/drive/teeth/flat_length_mm", 0.01, 0.2)]),
        Some(_) => {}
    }
    lengths
}

fn word_at<'a>(tree: &'a Tree, pointer: &str) -> Option<&'a str> {
    match tree.at(&path(pointer).unwrap_or_default()) {
        Some(Tree::Text(word)) => Some(word),
        _ => None,
    }
}

/// Returns the place of a design in the unit cube of the free fields.
fn place_of(design: &Tree, template: &Template, index: usize) -> Result<Vec<f64>, NoAnswer> {
    let at = |variable: &Variable| format!("/start/{index}{}", variable.pointer);
    let mut values = Vec::new();
    let mut place = Vec::new();
    for variable in template.variables() {
        let stands = design.at(variable.path());
        let (value, share) = match (&variable.domain, stands) {
            (Domain::Real { min, max } | Domain::Whole { min, max }, Some(Tree::Number(number))) => {
                if !(*min..=*max).contains(number) {
                    let limit = if number < min { *min } else { *max };
                    let detail = format!("{number:?} is outside the free range. Use {min:?} to {max:?}");
                    return Err(beyond(&at(variable), FieldCode::OutOfRange, detail, *number, limit));
                }
                let is_whole = matches!(variable.domain, Domain::Whole { .. });
                if is_whole && number.fract() != 0.0 {
                    let detail = format!("{number:?} is not a whole number. Use a whole number");
                    return Err(fault(&at(variable), FieldCode::WrongType, detail));
                }
                let share = match (is_whole, max > min) {
                    (true, _) => (number - min + 0.5) / (max - min + 1.0),
                    (false, true) => (number - min) / (max - min),
                    (false, false) => 0.5,
                };
                (Value::Number(*number), share)
            }
            (Domain::OneOf(count), Some(chosen)) => {
                let Some(choice) = variable.choices().iter().position(|choice| choice == chosen) else {
                    let detail = "the value is not in the free list. Use a value of `one_of`";
                    return Err(fault(&at(variable), FieldCode::UnknownChoice, detail));
                };
                (Value::Choice(choice), (choice as f64 + 0.5) / *count as f64)
            }
            (Domain::Real { .. } | Domain::Whole { .. }, Some(_)) => {
                return Err(fault(&at(variable), FieldCode::WrongType, "the value is not a number. Use a number"));
            }
            // A field that the kind does not have can have any place.
            (Domain::Real { min, .. } | Domain::Whole { min, .. }, None) => (Value::Number(*min), 0.5),
            (Domain::OneOf(_), None) => {
                let detail = "the field is free, but this design has no value for it. Add a value";
                return Err(fault(&at(variable), FieldCode::MissingField, detail));
            }
        };
        values.push(value);
        place.push(share);
    }
    let missing = template.taken(&values).find(|variable| design.at(variable.path()).is_none());
    match missing {
        Some(variable) => {
            let detail = "the field is free, but this design has no value for it. Add a value";
            Err(fault(&at(variable), FieldCode::MissingField, detail))
        }
        None => Ok(place),
    }
}

impl Island {
    pub(crate) fn new(search: &Search, template: Template, island: u64) -> Self {
        // The first islands have one more evaluation each, so that the sum is the requested number.
        let evaluations = search.evaluations / search.islands + u64::from(island < search.evaluations % search.islands);
        let scan = evaluations / SCAN_SHARE;
        let scan_from = island * (search.evaluations.div_ceil(search.islands) / SCAN_SHARE + 1);
        let plan =
            Plan { dimensions: template.variables().len(), limits: search.limits.len(), scan_from, scan, evaluations };
        Self {
            optimiser: Optimiser::new(plan, search.start.clone(), search.seed, island),
            template,
            is_true: false,
            pending: None,
            evaluated: 0,
            scan: Scan::new(search.limits.len()),
            scan_from,
        }
    }

    /// Computes one variant. Returns true if it was the last one.
    pub(crate) fn step(&mut self, search: &Search, evaluator: &Evaluator, stop: &dyn Stop) -> Result<bool, Stopped> {
        // A point that was interrupted is computed again.
        let (place, is_scanning) = match self.pending.take() {
            Some(pending) => pending,
            None => {
                let is_scanning = self.optimiser.is_scanning();
                (self.optimiser.ask(), is_scanning)
            }
        };
        let values: Vec<Value> = variable_values(&self.template, &place);
        let outcome = match evaluator.outcome(self.template.filled(&values), stop) {
            Ok(outcome) => outcome,
            Err(interrupted) => {
                self.pending = Some((place, is_scanning));
                return Err(interrupted);
            }
        };
        self.evaluated += 1;
        let variant = self.scan_from + self.scan.variants;
        self.scan.variants += u64::from(is_scanning);
        match outcome {
            Outcome::Answered(values) => {
                let judged = search.judged(&values);
                if is_scanning {
                    self.scan.add(&judged);
                }
                self.optimiser.tell(Some(Point { place, judged, values }));
            }
            Outcome::Refused(refusal) => {
                if is_scanning {
                    self.scan.refused += 1;
                    note(&mut self.scan.refusals, variant, 1, refusal);
                }
                self.optimiser.tell(None);
            }
        }
        if !self.optimiser.is_over() {
            return Ok(false);
        }
        match &search.at_true_peaks {
            Some(template) if !self.is_true => {
                self.is_true = true;
                self.template = template.clone();
                self.optimiser.judge_anew(TRUE_EVALUATIONS);
                Ok(self.optimiser.is_over())
            }
            _ => Ok(true),
        }
    }

    pub(crate) fn finish(self) -> IslandPart {
        IslandPart {
            evaluated: self.evaluated,
            front: self.optimiser.front().to_vec(),
            relaxations: self.optimiser.relaxations().to_vec(),
            nearest: self.optimiser.nearest().cloned(),
            scan: self.scan,
        }
    }
}

fn variable_values(template: &Template, place: &[f64]) -> Vec<Value> {
    template.variables().iter().zip(place).map(|(variable, &share)| variable.at_share(share)).collect()
}

impl IslandPart {
    /// Estimated memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let points = self.front.iter().chain(self.relaxations.iter().flatten()).chain(&self.nearest);
        let places = size_of_val(self.relaxations.as_slice()) + size_of_val(self.front.as_slice());
        places
            + points.map(Point::bytes).sum::<usize>()
            + self.scan.refusals.iter().map(RefusalNoted::bytes).sum::<usize>()
    }

    pub(crate) const fn evaluated(&self) -> u64 {
        self.evaluated
    }

    pub(crate) const fn refused(&self) -> u64 {
        self.scan.refused
    }
}

/// Result of a search: the best designs within limits, and the limits that prevent better ones.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SearchAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// True if every variant is computed.
    pub is_complete: bool,
    /// Number of computed variants.
    pub evaluated: u64,
    /// The free fields.
    pub free: Vec<FreeAnswer>,
    /// Pareto front, ordered by the first objective. Its figures are accurate peaks.
    pub front: Vec<FoundAnswer>,
    /// The limits, with the numbers of variants that violate them.
    pub limits: Vec<LimitAnswer>,
    /// Counts of the even scan of all free fields.
    pub scan: ScanAnswer,
    /// If no design meets all limits: the design with the smallest sum of violations.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub nearest_miss: Option<FoundAnswer>,
    /// If no design meets all limits: for each limit that can be relaxed alone, the needed value.
    pub relaxations: Vec<RelaxationAnswer>,
    /// Names of the quantities in the order of the columns.
    #[serde(skip)]
    #[schema(ignore)]
    quantities: Vec<&'static str>,
}

/// A free field.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FreeAnswer {
    /// JSON pointer into the design.
    pub pointer: String,
    /// Smallest value of a range.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub min: Option<f64>,
    /// Largest value of a range.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub max: Option<f64>,
    /// Number of values of a list.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub choices: Option<u64>,
}

/// A design that the search found.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FoundAnswer {
    /// The complete design document. Every endpoint accepts it.
    pub design: Design,
    /// The quantities of objectives and limits.
    pub quantities: BTreeMap<&'static str, f64>,
}

/// A limit, with the numbers of variants that violate it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LimitAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Side of the limit.
    pub bound: Bound,
    /// Value of the limit.
    pub limit: f64,
    /// Variants of the scan that violate it.
    pub fell: u64,
    /// Variants of the scan that violate it alone.
    pub fell_alone: u64,
    /// Designs of the front that are within 1 % of it.
    pub binds: u64,
}

/// Counts of the even scan of all free fields.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ScanAnswer {
    /// Number of variants.
    pub variants: u64,
    /// Variants that meet all limits.
    pub good: u64,
    /// Variants that are impossible drives.
    pub impossible: u64,
    /// Reasons for the impossible variants.
    pub reasons: Vec<ReasonAnswer>,
}

/// Needed relaxation of one limit, with all other limits met.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RelaxationAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Side of the limit.
    pub bound: Bound,
    /// Value of the limit.
    pub limit: f64,
    /// Value nearest to the limit for which a design was found.
    pub needed: f64,
    /// The design with this value.
    pub found: FoundAnswer,
}

impl SearchAnswer {
    pub(crate) fn new<'a>(
        search: &Search,
        template: &Template,
        evaluator: &Evaluator,
        parts: impl Iterator<Item = &'a IslandPart>,
        is_complete: bool,
    ) -> Self {
        let mut scan = Scan::new(search.limits.len());
        let (mut evaluated, mut points) = (0, Vec::new());
        let mut relaxations: Vec<Option<&Point>> = vec![None; search.limits.len()];
        let mut nearest: Option<&Point> = None;
        let beyond = |point: &Point| point.judged.violations.iter().sum::<f64>();
        for part in parts {
            scan.append(&part.scan);
            evaluated += part.evaluated;
            points.extend(part.front.iter().cloned());
            for (limit, (least, own)) in relaxations.iter_mut().zip(&part.relaxations).enumerate() {
                if let Some(own) = own
                    && least.is_none_or(|least| own.judged.violations[limit] < least.judged.violations[limit])
                {
                    *least = Some(own);
                }
            }
            if let Some(own) = &part.nearest
                && nearest.is_none_or(|nearest| beyond(own) < beyond(nearest))
            {
                nearest = Some(own);
            }
        }
        let front = merged(points);
        let mut quantities: Vec<_> = evaluator.quantities.iter().map(|quantity| quantity.name).collect();
        quantities.sort_unstable();
        let name = |limit: &Limit| evaluator.quantities[limit.quantity].name;
        let mut template = search.at_true_peaks.as_ref().unwrap_or(template).clone();
        let free = template.variables().iter().map(FreeAnswer::from).collect();
        let mut found = |point: &Point| FoundAnswer::new(&mut template, evaluator, point);
        let limit_answers = search.limits.iter().zip(scan.fell.iter().zip(&scan.fell_alone));
        let limits = limit_answers.map(|(limit, (&fell, &fell_alone))| LimitAnswer {
            quantity: name(limit),
            bound: limit.bound,
            limit: limit.limit,
            fell,
            fell_alone,
            binds: front.iter().filter(|point| limit.binds(point.values[limit.quantity])).count() as u64,
        });
        let limits = limits.collect();
        let is_impossible = front.is_empty();
        let relaxed = search.limits.iter().zip(&relaxations).filter(|_| is_impossible).filter_map(|(limit, point)| {
            let point = (*point)?;
            let needed = point.values[limit.quantity];
            Some(RelaxationAnswer {
                quantity: name(limit),
                bound: limit.bound,
                limit: limit.limit,
                needed,
                found: found(point)?,
            })
        });
        let relaxations = relaxed.collect();
        let nearest_miss = nearest.filter(|_| is_impossible).and_then(&mut found);
        Self {
            solver_version: toothwave_solver::VERSION,
            build: toothwave_calculation::BUILD,
            is_complete,
            evaluated,
            free,
            front: front.iter().filter_map(&mut found).collect(),
            limits,
            scan: ScanAnswer {
                variants: scan.variants,
                good: scan.good,
                impossible: scan.refused,
                reasons: scan.refusals.iter().map(ReasonAnswer::from).collect(),
            },
            nearest_miss,
            relaxations,
            quantities,
        }
    }

    /// Returns a table with one row for each design of the front: quantities, then the free fields.
    pub(crate) fn table(&self) -> Table<'_> {
        let mut columns: Vec<_> = self.quantities.iter().map(|name| Column::new(*name, Content::Number)).collect();
        columns.extend(self.free.iter().map(|free| {
            let kind = if free.choices.is_some() { Content::Word } else { Content::Number };
            Column::new(free.pointer.as_str(), kind)
        }));
        let rows = self.front.iter().map(|found| {
            let mut row: Vec<_> =
                self.quantities.iter().map(|name| Cell::from(found.quantities.get(name).copied())).collect();
            let design = serde_json::to_value(&found.design).unwrap_or_default();
            row.extend(self.free.iter().map(|free| match design.pointer(&free.pointer) {
                None => Cell::Empty,
                Some(value) => match (value.as_str(), value.as_u64(), value.as_f64()) {
                    (Some(word), ..) => Cell::Word(word.to_owned()),
                    (_, Some(count), _) => Cell::Count(count),
                    (_, _, Some(number)) => Cell::Number(number),
                    _ => Cell::Word(value.to_string()),
                },
            }));
            row
        });
        let length = self.front.len();
        Table { columns, length, rows: Box::new(rows) }
    }
}

impl From<&Variable> for FreeAnswer {
    fn from(variable: &Variable) -> Self {
        let (range, choices) = match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => (Some((min, max)), None),
            Domain::OneOf(count) => (None, Some(count as u64)),
        };
        let (min, max) = range.unzip();
        Self { pointer: variable.pointer.clone(), min, max, choices }
    }
}

impl FoundAnswer {
    /// Reads the design of a point again, with its quantities.
    fn new(template: &mut Template, evaluator: &Evaluator, point: &Point) -> Option<Self> {
        let values = variable_values(template, &point.place);
        let design = template.filled(&values).read::<Design>().ok()?.normalised();
        let quantities = evaluator.quantities.iter().map(|quantity| quantity.name);
        Some(Self { design, quantities: quantities.zip(point.values.iter().copied()).collect() })
    }
}
