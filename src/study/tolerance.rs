//! A tolerance study: drives with parts that deviate by chance, and what that does to each quantity.

use serde::Serialize;
use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_solver::violation::MAX_TEETH;
use utoipa::ToSchema;

use crate::ask::{escaped, fault, whole};
use crate::document::{DistributionDocument, DistributionKind, ToleranceDocument};
use crate::evaluate::Evaluator;
use crate::limit::{Bound, Limit};
use crate::random::Stream;
use crate::rank::{QuantileAnswer, ShareAnswer, quantile, share};
use crate::rows::{ReasonAnswer, Rows, RowsPart, RowsParts};
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{Asked, Domain, GRAIN_BYTES, Template, Value, Variable};

/// Drives in which one kind of deviation stands alone, for each kind.
const ALONE: u64 = 1000;

/// The quantiles that are told.
const SHARES: [f64; 9] = [0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999];

/// A distribution is not cut off nearer to its middle than this, in standard deviations: draws beyond are drawn again.
const NEAREST_LIMIT: f64 = 0.01;

/// Draws until one lies within the limits, at most: at the nearest limit all fail with a probability of 1e-34.
const MOST_DRAWS: u32 = 10_000;

/// The variants of a tolerance study: the drive without deviations, the drives drawn, then those with one kind of deviation alone.
#[derive(Debug, Clone)]
pub(crate) struct Tolerance {
    kinds: Vec<Kind>,
    samples: u64,
    seed: u64,
    pub(crate) limits: Vec<Limit>,
}

/// A kind of deviation.
#[derive(Debug, Clone)]
struct Kind {
    /// As the study's document has it.
    name: String,
    distribution: Distribution,
    place: Place,
}

#[derive(Debug, Clone)]
enum Place {
    /// A list with an entry for each item.
    Items { path: Vec<String>, count: usize },
    /// A vector.
    Runout { path: Vec<String> },
    /// A number of the base.
    Number { value: f64 },
}

#[derive(Debug, Clone, Copy)]
enum Distribution {
    Normal { sigma: f64, limit: f64 },
    Uniform { limit: f64 },
}

impl Distribution {
    fn new(at: &str, document: &DistributionDocument) -> Result<Self, NoAnswer> {
        let positive = |name: &str, value: Option<f64>| match value {
            Some(value) if value > 0.0 => Ok(value),
            Some(value) => {
                let detail = format!("`{name}` must be above zero, not {value:?}");
                Err(fault(&format!("{at}/{name}"), FieldCode::OutOfRange, detail))
            }
            None => Err(fault(&format!("{at}/{name}"), FieldCode::MissingField, format!("`{name}` is required here"))),
        };
        match document.distribution {
            DistributionKind::Normal => {
                let sigma = positive("sigma", document.sigma)?;
                let limit = document.limit.map_or(Ok(f64::INFINITY), |limit| positive("limit", Some(limit)))?;
                if limit < NEAREST_LIMIT * sigma {
                    let detail = "the limit is so near that the distribution is uniform within it: choose `uniform`";
                    return Err(fault(&format!("{at}/limit"), FieldCode::OutOfRange, detail));
                }
                Ok(Self::Normal { sigma, limit })
            }
            DistributionKind::Uniform if document.sigma.is_some() => {
                let detail = "a uniform distribution has a `limit` and no `sigma`";
                Err(fault(&format!("{at}/sigma"), FieldCode::ConflictingFields, detail))
            }
            DistributionKind::Uniform => Ok(Self::Uniform { limit: positive("limit", document.limit)? }),
        }
    }

    fn draw(&self, stream: &mut Stream) -> f64 {
        match *self {
            Self::Normal { sigma, limit } => {
                let draws = std::iter::repeat_with(|| sigma * stream.normal()).take(MOST_DRAWS as usize);
                let mut within = draws.filter(|deviation| deviation.abs() <= limit);
                within.next().unwrap_or_default()
            }
            Self::Uniform { limit } => limit * (2.0 * stream.share() - 1.0),
        }
    }
}

impl Tolerance {
    /// Without its limits, which are of quantities.
    pub(crate) fn new(document: &ToleranceDocument) -> Result<(Self, Template), NoAnswer> {
        let base = &document.base.0;
        let samples = whole("/samples", document.samples.value(), 10.0, 1e8)?;
        let seed = whole("/seed", document.seed.value(), 0.0, 9_007_199_254_740_991.0)?;
        if document.deviations.is_empty() && document.inputs.is_empty() {
            let detail = "nothing deviates: name `deviations` or `inputs` with their distributions";
            return Err(fault("/deviations", FieldCode::MissingField, detail));
        }
        let mut kinds = Vec::new();
        let mut free = Vec::new();
        for (pointer, distribution) in &document.inputs {
            let at = format!("/inputs/{}", escaped(pointer));
            let Some(Tree::Number(value)) = path(pointer).and_then(|path| base.at(&path)) else {
                let detail = "the base has no number here: write it down there, even where it is the default";
                return Err(fault(&at, FieldCode::MissingField, detail));
            };
            free.push((pointer.clone(), Asked::Range { min: *value, max: *value }));
            let distribution = Distribution::new(&at, distribution)?;
            kinds.push(Kind { name: pointer.clone(), distribution, place: Place::Number { value: *value } });
        }
        let mut template = Template::new(base, &free, "inputs")?;
        let counts = template.variables().iter().find(|variable| matches!(variable.domain, Domain::Whole { .. }));
        if let Some(Variable { pointer, .. }) = counts {
            let detail = "a whole number does not deviate";
            return Err(fault(&format!("/inputs/{}", escaped(pointer)), FieldCode::WrongType, detail));
        }
        // It was read just so.
        let items = match template.examples().next() {
            Some(example) => Items::of(&example.read::<Design>()?),
            None => Items { slots: 0, ring_spaces: 0, lobes: 0 },
        };
        for (name, distribution) in &document.deviations {
            let at = format!("/deviations/{}", escaped(name));
            let path = vec!["deviations".to_owned(), name.clone()];
            if base.at(&path).is_some() {
                let detail = "the study draws these: leave them out of the base";
                return Err(fault(
                    &format!("/base/deviations/{}", escaped(name)),
                    FieldCode::ConflictingFields,
                    detail,
                ));
            }
            let place = match name.as_str() {
                "tooth_radius_um" | "slot_angle_arcsec" | "slot_wall_um" => Place::Items { path, count: items.slots },
                "ring_space_um" | "ring_space_angle_arcsec" => Place::Items { path, count: items.ring_spaces },
                "wave_generator_lobe_um" => Place::Items { path, count: items.lobes },
                "wave_generator_runout" | "ring_runout" | "carrier_runout" => Place::Runout { path },
                _ => {
                    let detail = format!("`{name}` is none of the design's `deviations`");
                    return Err(fault(&at, FieldCode::UnknownField, detail));
                }
            };
            let kind = Kind { name: name.clone(), distribution: Distribution::new(&at, distribution)?, place };
            kind.put(&mut template, None);
            kinds.push(kind);
        }
        // Whether the design knows deviations, and whatever else cannot be read.
        for example in template.examples() {
            example.read::<Design>()?;
        }
        Ok((Self { kinds, samples, seed, limits: Vec::new() }, template))
    }

    /// Drives with one kind of deviation alone, for each; none where there is only one kind.
    fn alone(&self) -> u64 {
        if self.kinds.len() > 1 { ALONE.min(self.samples) } else { 0 }
    }

    /// What the answer takes: of each quantity an entry for each kind of deviation, and its histogram.
    pub(crate) fn answer_bytes(&self, quantities: usize) -> u64 {
        const HISTOGRAM_BYTES: usize = 2048;
        // A text takes a few bytes more than it has.
        let a_kind = |kind: &Kind| size_of::<ContributorAnswer>() + kind.name.len() + 16;
        (quantities * (HISTOGRAM_BYTES + self.kinds.iter().map(a_kind).sum::<usize>())) as u64
    }

    /// About what it takes in memory beside its template.
    pub(crate) fn bytes(&self) -> usize {
        let of_kind = |kind: &Kind| {
            let path: &[String] = match &kind.place {
                Place::Items { path, .. } | Place::Runout { path } => path,
                Place::Number { .. } => &[],
            };
            let texts = path.iter().chain([&kind.name]);
            size_of::<Kind>() + texts.map(|text| size_of::<String>() + GRAIN_BYTES + text.len()).sum::<usize>()
        };
        self.kinds.iter().map(of_kind).sum()
    }

    pub(crate) fn variants(&self) -> u64 {
        1 + self.samples + self.alone() * self.kinds.len() as u64
    }

    /// The stream of a kind of deviation in a variant: one of its own for each kind of each sample, so that what stands alone is what it was
    /// among others. None where it does not deviate.
    fn stream(&self, variant: u64, kind: usize) -> Option<Stream> {
        let stream = |sample: u64| Stream::new(self.seed, (sample << 16) | kind as u64);
        match self.drawn(variant) {
            Drawn::All { sample } => Some(stream(sample)),
            Drawn::Alone { sample, kind: alone } if alone == kind => Some(stream(sample)),
            Drawn::Alone { .. } | Drawn::Nominal => None,
        }
    }

    /// The sample whose chance a variant has, and the kind that it keeps of it.
    fn drawn(&self, variant: u64) -> Drawn {
        match variant.checked_sub(1) {
            None => Drawn::Nominal,
            Some(sample) if sample < self.samples => Drawn::All { sample },
            Some(later) => {
                let rest = later - self.samples;
                let alone = self.alone().max(1);
                Drawn::Alone { sample: rest % alone, kind: usize::try_from(rest / alone).unwrap_or(usize::MAX) }
            }
        }
    }
}

enum Drawn {
    Nominal,
    All { sample: u64 },
    Alone { sample: u64, kind: usize },
}

/// How many items of each sort the drive has.
struct Items {
    slots: usize,
    ring_spaces: usize,
    lobes: usize,
}

impl Items {
    fn of(design: &Design) -> Self {
        let parameters = design.drive_parameters();
        // Of more a base is refused, and not before these stand in it.
        let count = |count: i64| usize::try_from(count.min(MAX_TEETH)).unwrap_or_default();
        Self {
            slots: count(parameters.installed),
            ring_spaces: count(parameters.ring_teeth),
            lobes: count(parameters.wave_generator.lobes()),
        }
    }
}

impl Kind {
    /// Draws its deviations, from a stream or none at all, and puts them into the documents; a number of the base is returned.
    fn put(&self, template: &mut Template, stream: Option<&mut Stream>) -> Option<f64> {
        let mut none = Stream::new(0, 0);
        let is_nil = stream.is_none();
        let stream = stream.unwrap_or(&mut none);
        let mut draw = || if is_nil { 0.0 } else { self.distribution.draw(stream) };
        match &self.place {
            Place::Items { path, count } => {
                let items = (0..*count).map(|_| Tree::Number(draw())).collect();
                template.set(path, &Tree::Array(items));
                None
            }
            Place::Runout { path } => {
                let (x_um, y_um) = (draw(), draw());
                let fields = [("amount_um", x_um.hypot(y_um)), ("angle_deg", y_um.atan2(x_um).to_degrees())];
                let fields = fields.map(|(name, value)| (name.to_owned(), Tree::Number(value)));
                template.set(path, &Tree::Object(fields.into()));
                None
            }
            Place::Number { value } => Some(value + draw()),
        }
    }
}

impl Rows for Tolerance {
    fn document<'t>(&self, template: &'t mut Template, variant: u64) -> &'t Tree {
        let mut numbers = Vec::new();
        for (index, kind) in self.kinds.iter().enumerate() {
            numbers.extend(kind.put(template, self.stream(variant, index).as_mut()).map(Value::Number));
        }
        template.filled(&numbers)
    }
}

/// What deviations do to each quantity.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// The build that computed it: equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// Whether every drive was looked at.
    pub is_complete: bool,
    /// Drives that were drawn and looked at.
    pub samples: u64,
    /// Of those, drives that cannot be put together because a part is too full. They enter no quantile.
    pub interference: u64,
    /// Of those, drives without an answer for another reason. They enter no quantile either.
    pub impossible: u64,
    /// Why variants have no answer.
    pub reasons: Vec<ReasonAnswer>,
    /// The share of all drives that can be put together and keep every limit, given `require`.
    #[serde(rename = "yield", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub yield_share: Option<ShareAnswer>,
    /// Each limit, with how many drives are beyond it.
    pub limits: Vec<ToleranceLimitAnswer>,
    /// Each quantity with its distribution.
    pub quantities: Vec<ToleranceQuantityAnswer>,
}

/// A limit with how many drives are beyond it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceLimitAnswer {
    /// The quantity.
    pub quantity: &'static str,
    /// On which side of it the quantity has to be.
    pub bound: Bound,
    /// The limit.
    pub limit: f64,
    /// Drives beyond it.
    pub failed: u64,
}

/// The distribution of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceQuantityAnswer {
    /// Its name.
    pub quantity: &'static str,
    /// Its value without deviations; left out where that drive has no answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub nominal: Option<f64>,
    /// Its mean.
    pub mean: f64,
    /// Its standard deviation.
    pub standard_deviation: f64,
    /// The least that was drawn.
    pub least: f64,
    /// The largest that was drawn.
    pub largest: f64,
    /// Its quantiles.
    pub quantiles: Vec<QuantileAnswer>,
    /// How its values are spread between the least and the largest.
    pub histogram: HistogramAnswer,
    /// What each kind of deviation does alone, what does most first; empty where there is only one kind.
    pub contributors: Vec<ContributorAnswer>,
}

/// Drives in bins of equal width.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct HistogramAnswer {
    /// Where the bins meet, their ends included: one more than there are bins. A value at an edge is in the bin above it, the largest in
    /// the last one.
    pub edges: Vec<f64>,
    /// How many drives are in each.
    pub drives: Vec<u64>,
}

/// What a kind of deviation does alone.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ContributorAnswer {
    /// The kind: its name in `deviations`, or a JSON pointer.
    pub deviation: String,
    /// Standard deviation of the quantity in drives that deviate in nothing else.
    pub standard_deviation: f64,
    /// Its variance over the sum of those of all kinds.
    pub share: f64,
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy)]
struct Spread {
    mean: f64,
    standard_deviation: f64,
}

/// In two passes, so that no digits are lost to a large mean.
fn spread(values: &[f64]) -> Spread {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    Spread { mean, standard_deviation: (squares / (count - 1.0).max(1.0)).sqrt() }
}

impl HistogramAnswer {
    /// Of a sorted sample, which is not empty: as many bins as twice the cube root of its size (Rice's rule), one where all values are equal.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number, not negative")]
    fn of(sorted: &[f64]) -> Self {
        let (least, largest) = match sorted {
            [] => return Self { edges: Vec::new(), drives: Vec::new() },
            [one] => (*one, *one),
            [first, .., last] => (*first, *last),
        };
        let bins = if largest > least { (2.0 * (sorted.len() as f64).cbrt()).ceil() as usize } else { 1 };
        let edge = |index: usize| {
            if index == bins { largest } else { least + (largest - least) * (index as f64 / bins as f64) }
        };
        let below = |index: usize| {
            if index == bins { sorted.len() } else { sorted.partition_point(|&value| value < edge(index)) }
        };
        Self {
            edges: (0..=bins).map(edge).collect(),
            drives: (0..bins).map(|index| (below(index + 1) - below(index)) as u64).collect(),
        }
    }
}

impl ToleranceAnswer {
    pub(crate) fn new(tolerance: &Tolerance, evaluator: &Evaluator, rows: &RowsParts<'_>, is_complete: bool) -> Self {
        let samples = 1..=tolerance.samples;
        let (mut interference, mut impossible) = (0, 0);
        for reason in rows.reasons(samples.clone()) {
            if reason.code == "interference" { interference += 1 } else { impossible += 1 }
        }
        let fails =
            |limit: &Limit, part: &RowsPart, row: usize| limit.violation(part.columns[limit.quantity][row]) > 0.0;
        let sampled = || rows.within(samples.clone()).flat_map(|(part, rows)| rows.map(move |row| (part, row)));
        let is_good = |&(part, row): &(&RowsPart, usize)| !tolerance.limits.iter().any(|limit| fails(limit, part, row));
        let good = sampled().filter(is_good).count() as u64;
        let answered: usize = rows.within(samples.clone()).map(|(_, rows)| rows.len()).sum();
        let looked_at = answered as u64 + interference + impossible;
        let limits = tolerance.limits.iter().map(|limit| ToleranceLimitAnswer {
            quantity: evaluator.quantities[limit.quantity].name,
            bound: limit.bound,
            limit: limit.limit,
            failed: sampled().filter(|&(part, row)| fails(limit, part, row)).count() as u64,
        });
        let alone = tolerance.alone();
        let quantities = evaluator.quantities.iter().enumerate().filter(|_| answered > 0);
        let quantities = quantities.map(|(column, quantity)| {
            let mut sorted = rows.values(column, samples.clone());
            let Spread { mean, standard_deviation } = spread(&sorted);
            // Equal ones have equal bits.
            sorted.sort_unstable_by(f64::total_cmp);
            let kinds = (0..).zip(&tolerance.kinds).filter(|_| alone > 0).map(|(index, kind)| {
                let first = 1 + tolerance.samples + index * alone;
                let Spread { standard_deviation, .. } = spread(&rows.values(column, first..=first + alone - 1));
                ContributorAnswer { deviation: kind.name.clone(), standard_deviation, share: 0.0 }
            });
            let mut contributors: Vec<_> = kinds.collect();
            let variance: f64 = contributors.iter().map(|kind| kind.standard_deviation.powi(2)).sum();
            for kind in &mut contributors {
                kind.share = if variance > 0.0 { kind.standard_deviation.powi(2) / variance } else { 0.0 };
            }
            contributors.sort_by(|one, other| other.standard_deviation.total_cmp(&one.standard_deviation));
            ToleranceQuantityAnswer {
                quantity: quantity.name,
                nominal: rows.values(column, 0..=0).first().copied(),
                mean,
                standard_deviation,
                least: sorted.first().copied().unwrap_or_default(),
                largest: sorted.last().copied().unwrap_or_default(),
                quantiles: SHARES.iter().filter_map(|&share| quantile(&sorted, share)).collect(),
                histogram: HistogramAnswer::of(&sorted),
                contributors,
            }
        });
        Self {
            solver_version: toothwave_solver::VERSION,
            build: toothwave_calculation::BUILD,
            is_complete,
            samples: looked_at,
            interference,
            impossible,
            reasons: rows.refusals().iter().map(ReasonAnswer::from).collect(),
            yield_share: if tolerance.limits.is_empty() { None } else { share(good, looked_at) },
            limits: limits.collect(),
            quantities: quantities.collect(),
        }
    }

    pub(crate) fn expected_bytes(&self) -> usize {
        let of_quantity = |of: &ToleranceQuantityAnswer| {
            let contributors = of.contributors.iter().map(|kind| 100 + kind.deviation.len());
            1000 + 26 * of.histogram.drives.len() + contributors.sum::<usize>()
        };
        2048 + self.quantities.iter().map(of_quantity).sum::<usize>()
    }

    /// A row a quantity and quantile.
    pub(crate) fn table(&self) -> Table<'_> {
        let mut columns = vec![Column::new("quantity", Content::Word)];
        columns.extend(["share", "value", "low", "high"].map(|name| Column::new(name, Content::Number)));
        let rows = self.quantities.iter().flat_map(|of| {
            of.quantiles.iter().map(|&QuantileAnswer { share, value, low, high }| {
                let mut row = vec![Cell::Word(of.quantity.into())];
                row.extend([Some(share), Some(value), low, high].map(Cell::from));
                row
            })
        });
        let length = self.quantities.iter().map(|of| of.quantiles.len()).sum();
        Table { columns, length, rows: Box::new(rows) }
    }
}
