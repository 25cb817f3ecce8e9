//! A search: the best designs within limits, and why there are no better ones.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde::{Deserialize, Serialize};
use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::Tree;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_solver::Stop;
use toothwave_solver::parts::RIM;
use utoipa::ToSchema;

use crate::ask::{escaped, fault, index_of, named, whole};
use crate::document::{FreeDocument, Goal, RangeDocument, RequireDocument, SearchDocument};
use crate::evaluate::{Evaluator, Outcome, Stopped};
use crate::limit::{Bound, Limit, limits};
use crate::map::asked;
use crate::optimise::{Judged, Optimiser, Plan, Point, merged};
use crate::quantity::{Needs, Quantity};
use crate::rows::{GapAnswer, ReasonAnswer, RefusalNoted, note};
use crate::variant::{Domain, Template, Value};
use toothwave_calculation::forms::csv_error;

/// Evaluations of an island, about; each is a chunk.
const ISLAND_EVALUATIONS: u64 = 6250;

/// Of an island's evaluations, the share that scans.
const SCAN_SHARE: u64 = 5;

/// Evaluations at true peaks beside those of the front.
const TRUE_EVALUATIONS: u64 = 300;

/// The tolerance of true peaks.
const TRUE_PEAKS: f64 = 1e-4;

/// Intervals of the period that are looked at before, where the base says nothing.
const SAMPLES: f64 = 16.0;

/// Objectives at most.
const MOST_OBJECTIVES: usize = 4;

/// A search that can be carried out.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    limits: Vec<Limit>,
    objectives: Vec<Objective>,
    islands: u64,
    evaluations: u64,
    seed: u64,
    start: Vec<Vec<f64>>,
    /// The documents with true peaks, where sampled ones are looked at before.
    at_true_peaks: Option<Template>,
}

#[derive(Debug, Clone, Copy)]
struct Objective {
    quantity: usize,
    goal: Goal,
}

/// What an island comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IslandPart {
    evaluated: u64,
    front: Vec<Point>,
    relaxations: Vec<Option<Point>>,
    nearest: Option<Point>,
    scan: Scan,
}

/// What the scan saw.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Scan {
    variants: u64,
    good: u64,
    /// Of each limit, how many were beyond it, and how many beyond it alone.
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

/// An island as it is worked on.
#[derive(Debug)]
pub(crate) struct Island {
    optimiser: Optimiser,
    template: Template,
    is_true: bool,
    /// A point with whether it is of the scan.
    pending: Option<(Vec<f64>, bool)>,
    evaluated: u64,
    scan: Scan,
    scan_from: u64,
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
            base.set(&samples, Tree::Number(SAMPLES));
        }
        let template = Template::new(&base, &list, "free")?;
        let at_true_peaks = (is_swept && !is_free && base.at(&tolerance).is_none()).then(|| {
            let mut template = template.clone();
            template.remove(&samples);
            template.set(&tolerance, &Tree::Number(TRUE_PEAKS));
            template
        });
        let start = document.start.iter().enumerate();
        let start = start.map(|(index, design)| place_of(&design.0, &template, index)).collect::<Result<_, _>>()?;
        let islands = (evaluations / ISLAND_EVALUATIONS).clamp(1, 4096);
        Ok((Self { limits, objectives, islands, evaluations, seed, start, at_true_peaks }, template, quantities))
    }

    pub(crate) const fn islands(&self) -> u64 {
        self.islands
    }

    /// Variants, but for how many of each front are looked at again.
    pub(crate) const fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// What the fronts of all islands take, each point a few columns wide.
    pub(crate) fn stored_bytes(&self, quantities: usize, variables: usize) -> u64 {
        let numbers = quantities + variables + self.limits.len() + self.objectives.len();
        let points = crate::optimise::MOST_OF_FRONT + self.limits.len() + 1;
        self.islands * (8 * numbers * points) as u64
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

fn objectives(document: &SearchDocument, quantities: &mut Vec<&'static Quantity>) -> Result<Vec<Objective>, NoAnswer> {
    let asked = &document.objectives;
    if asked.is_empty() {
        return Err(fault(
            "/objectives",
            FieldCode::MissingField,
            "a search needs an objective: name a quantity and a goal",
        ));
    }
    if asked.len() > MOST_OBJECTIVES {
        let detail = format!("a search has at most {MOST_OBJECTIVES} objectives, not {}", asked.len());
        return Err(fault("/objectives", FieldCode::OutOfRange, detail));
    }
    let mut objectives: Vec<Objective> = Vec::new();
    for (index, objective) in asked.iter().enumerate() {
        let at = format!("/objectives/{index}/quantity");
        let quantity = index_of(named(&objective.quantity, &at)?, quantities);
        if objectives.iter().any(|other| other.quantity == quantity) {
            let detail = format!("`{}` is an objective already", objective.quantity);
            return Err(fault(&at, FieldCode::ConflictingFields, detail));
        }
        objectives.push(Objective { quantity, goal: objective.goal });
    }
    Ok(objectives)
}

/// What is free where nothing is said: a wave generator of two lobes, its teeth and their number, within the limits on the outer diameter and
/// the transmission ratio. What stands in the base stays.
fn from_envelope(
    document: &SearchDocument,
    base: &mut Tree,
    free: &mut BTreeMap<String, FreeDocument>,
) -> Result<(), NoAnswer> {
    let range = |name: &str| match document.require.get(name) {
        Some(RequireDocument::Range(RangeDocument { min, max })) => (*min, *max),
        _ => (None, None),
    };
    let (ratio, diameter_mm) = (range("transmission_ratio"), range("outer_diameter_mm").1);
    let ((Some(least_ratio), Some(largest_ratio)), Some(diameter_mm)) = (ratio, diameter_mm) else {
        let detail = "nothing is free: name fields with their ranges, or limit `transmission_ratio` from both sides and `outer_diameter_mm`, from which they follow";
        return Err(fault("/free", FieldCode::MissingField, detail));
    };
    const LOBES: f64 = 2.0;
    let path = |pointer: &str| toothwave_calculation::json::path(pointer).unwrap_or_default();
    if base.at(&path("/drive/wave_generator")).is_none() {
        base.set(&path("/drive/wave_generator/kind"), Tree::Text("harmonic_path".into()));
        base.set(&path("/drive/wave_generator/lobes"), Tree::Number(LOBES));
    }
    // As drawn, a rim included.
    let root_mm = 0.5 * diameter_mm / RIM;
    let ranges = [
        ("/drive/wave_generator/mean_path_radius_mm", 0.4 * root_mm, root_mm),
        ("/drive/wave_generator/amplitude_mm", 0.002 * root_mm, 0.08 * root_mm),
        ("/drive/teeth/count", (LOBES * least_ratio).ceil(), (LOBES * largest_ratio).floor()),
        ("/drive/teeth/radius_mm", 0.02 * root_mm, 0.15 * root_mm),
        ("/drive/teeth/width_mm", 0.1 * root_mm, 0.6 * root_mm),
    ];
    for (pointer, min, max) in ranges {
        if base.at(&path(pointer)).is_none() {
            free.insert(pointer.into(), FreeDocument { min: Some(min), max: Some(max), one_of: None });
        }
    }
    Ok(())
}

/// Where a design stands among what is free.
fn place_of(design: &Tree, template: &Template, index: usize) -> Result<Vec<f64>, NoAnswer> {
    let at = |pointer: &str| format!("/start/{index}{pointer}");
    let mut place = Vec::new();
    for variable in template.variables() {
        let stands = design.at(variable.path());
        let share =
            match (&variable.domain, stands) {
                (Domain::Real { min, max }, Some(Tree::Number(number))) if (*min..=*max).contains(number) => {
                    if max > min { (number - min) / (max - min) } else { 0.5 }
                }
                (Domain::Whole { min, max }, Some(Tree::Number(number))) if (*min..=*max).contains(number) => {
                    (number - min + 0.5) / (max - min + 1.0)
                }
                (Domain::OneOf(count), Some(chosen)) => {
                    match variable.choices().iter().position(|choice| choice == chosen) {
                        Some(choice) => (choice as f64 + 0.5) / *count as f64,
                        None => {
                            return Err(fault(
                                &at(&variable.pointer),
                                FieldCode::UnknownChoice,
                                "none of the choices of `free`",
                            ));
                        }
                    }
                }
                // What a kind does not take may stand anywhere.
                (_, None) => 0.5,
                (_, Some(_)) => {
                    return Err(fault(&at(&variable.pointer), FieldCode::OutOfRange, "outside its range in `free`"));
                }
            };
        place.push(share);
    }
    Ok(place)
}

impl Island {
    pub(crate) fn new(search: &Search, template: Template, island: u64) -> Self {
        // The first islands have one more each, so that all of them come to what is asked.
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

    /// One variant further; whether that was the last one.
    pub(crate) fn step(&mut self, search: &Search, evaluator: &Evaluator, stop: &impl Stop) -> Result<bool, Stopped> {
        // A point that was asked for when the work was stopped is taken up again.
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
            Err(stopped) => {
                self.pending = Some((place, is_scanning));
                return Err(stopped);
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
    pub(crate) const fn evaluated(&self) -> u64 {
        self.evaluated
    }

    pub(crate) const fn refused(&self) -> u64 {
        self.scan.refused
    }
}

/// The best designs within limits, and why there are no better ones.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SearchAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// The build that computed it: equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// Whether every variant was looked at.
    pub is_complete: bool,
    /// Variants that were given up, where there are any.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub gaps: Vec<GapAnswer>,
    /// Variants that were looked at.
    pub evaluated: u64,
    /// What was free.
    pub free: Vec<FreeAnswer>,
    /// The designs that none beats in every objective, by the first objective. Their figures are true peaks.
    pub front: Vec<FoundAnswer>,
    /// Each limit, with what fell to it.
    pub limits: Vec<LimitAnswer>,
    /// What an even scan of all that is free saw.
    pub scan: ScanAnswer,
    /// Where nothing keeps all limits, the design that is least beyond them altogether.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub nearest_miss: Option<FoundAnswer>,
    /// Where nothing keeps all limits: for each that can be relaxed alone, how far it must be.
    pub relaxations: Vec<RelaxationAnswer>,
}

/// What was free.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FreeAnswer {
    /// JSON pointer into the design.
    pub pointer: String,
    /// Its least value.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub min: Option<f64>,
    /// Its largest.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub max: Option<f64>,
    /// How many choices it has, where it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub choices: Option<u64>,
}

/// A design that was found.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FoundAnswer {
    /// The whole document: every endpoint takes it.
    pub design: Design,
    /// Its quantities: objectives and those that are limited.
    pub quantities: BTreeMap<&'static str, f64>,
}

/// A limit, with what fell to it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LimitAnswer {
    /// The quantity.
    pub quantity: &'static str,
    /// On which side of it the quantity has to be.
    pub bound: Bound,
    /// The limit.
    pub limit: f64,
    /// Variants of the scan that were beyond it.
    pub fell: u64,
    /// Those that were beyond this limit alone.
    pub fell_alone: u64,
    /// Designs of the front that are within 1 % of it.
    pub binds: u64,
}

/// What an even scan of all that is free saw.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ScanAnswer {
    /// Variants that were looked at.
    pub variants: u64,
    /// Those that keep every limit.
    pub good: u64,
    /// Those that no drive can be.
    pub impossible: u64,
    /// Why not.
    pub reasons: Vec<ReasonAnswer>,
}

/// How far a limit must be relaxed for something to be possible, all others kept.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RelaxationAnswer {
    /// The quantity.
    pub quantity: &'static str,
    /// On which side of it the quantity has to be.
    pub bound: Bound,
    /// The limit as it is.
    pub limit: f64,
    /// The least change that something was found for.
    pub needed: f64,
    /// The design that was.
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
            gaps: Vec::new(),
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
        }
    }

    /// A line a design of the front: its quantities, then the fields that were free.
    pub(crate) fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let mut csv = csv::Writer::from_writer(writer);
        let Some(first) = self.front.first() else { return csv.flush() };
        let names: Vec<_> = first.quantities.keys().copied().collect();
        let pointers: Vec<_> = self.free.iter().map(|free| free.pointer.as_str()).collect();
        csv.write_record(names.iter().chain(&pointers)).map_err(csv_error)?;
        for found in &self.front {
            let design = serde_json::to_value(&found.design)?;
            let quantities = names.iter().map(|name| found.quantities.get(name).map(|value| format!("{value:?}")));
            let values = pointers.iter().map(|pointer| {
                design.pointer(pointer).map(|value| value.as_str().map_or_else(|| value.to_string(), str::to_owned))
            });
            csv.write_record(quantities.chain(values).map(Option::unwrap_or_default)).map_err(csv_error)?;
        }
        csv.flush()
    }
}

impl From<&crate::variant::Variable> for FreeAnswer {
    fn from(variable: &crate::variant::Variable) -> Self {
        let (range, choices) = match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => (Some((min, max)), None),
            Domain::OneOf(count) => (None, Some(count as u64)),
        };
        let (min, max) = range.unzip();
        Self { pointer: variable.pointer.clone(), min, max, choices }
    }
}

impl FoundAnswer {
    /// The design of a point; what was read when it was looked at is read again.
    fn new(template: &mut Template, evaluator: &Evaluator, point: &Point) -> Option<Self> {
        let values = variable_values(template, &point.place);
        let design = template.filled(&values).read::<Design>().ok()?.normalised();
        let quantities = evaluator.quantities.iter().map(|quantity| quantity.name);
        Some(Self { design, quantities: quantities.zip(point.values.iter().copied()).collect() })
    }
}
