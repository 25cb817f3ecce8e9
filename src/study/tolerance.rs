//! Tolerance study: drives with random deviations, and the distributions of their quantities.

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
use crate::identity::with_defaults_at;
use crate::limit::{Bound, Limit};
use crate::random::Stream;
use crate::rank::{QuantileAnswer, ShareAnswer, quantile, share};
use crate::rows::{ReasonAnswer, Rows, RowsPart, RowsParts};
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{Asked, Domain, GRAIN_BYTES, Template, Value, Variable};

/// Drives with a single kind of deviation, for each kind.
const ALONE: u64 = 1000;

/// Fractions of the quantiles in the answer.
const SHARES: [f64; 9] = [0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999];

/// Smallest truncation limit of a normal distribution, in standard deviations. Values beyond the limit are drawn again.
const NEAREST_LIMIT: f64 = 0.01;

/// Most draws for one value. At the smallest limit all fail with a probability of 1e-34.
const MOST_DRAWS: u32 = 10_000;

/// The variants of a tolerance study: the nominal drive, the random drives, then drives with a single kind of
/// deviation.
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
    /// Name in the study document.
    name: String,
    distribution: Distribution,
    place: Place,
}

#[derive(Debug, Clone)]
enum Place {
    /// A list with one entry for each item.
    Items { path: Vec<String>, count: usize },
    /// A vector with two components.
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
                let detail = format!("`{name}` is {value:?}. Use a value above zero");
                Err(fault(&format!("{at}/{name}"), FieldCode::OutOfRange, detail))
            }
            None => {
                Err(fault(&format!("{at}/{name}"), FieldCode::MissingField, format!("`{name}` is missing. Add it")))
            }
        };
        match document.distribution {
            DistributionKind::Normal => {
                let sigma = positive("sigma", document.sigma)?;
                let limit = document.limit.map_or(Ok(f64::INFINITY), |limit| positive("limit", Some(limit)))?;
                if limit < NEAREST_LIMIT * sigma {
                    let detail = "`limit` is below 1 % of `sigma`, so the distribution is uniform. Use `uniform`";
                    return Err(fault(&format!("{at}/limit"), FieldCode::OutOfRange, detail));
                }
                Ok(Self::Normal { sigma, limit })
            }
            DistributionKind::Uniform if document.sigma.is_some() => {
                let detail = "a uniform distribution has no `sigma`. Remove it and use `limit`";
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

/// Returns false for deviations that are empty or zero, as by default.
fn deviates(given: &Tree) -> bool {
    match given {
        Tree::Null => false,
        Tree::Number(value) => *value != 0.0,
        Tree::Array(items) => items.iter().any(deviates),
        Tree::Object(fields) => fields.iter().any(|(_, value)| deviates(value)),
        Tree::Bool(_) | Tree::Text(_) => true,
    }
}

impl Tolerance {
    /// Makes the study without limits, because these refer to quantities.
    pub(crate) fn new(document: &ToleranceDocument) -> Result<(Self, Template), NoAnswer> {
        let base = &with_defaults_at(&document.base.0, document.inputs.keys())?;
        let samples = whole("/samples", document.samples.value(), 10.0, 1e8)?;
        let seed = whole("/seed", document.seed.value(), 0.0, 9_007_199_254_740_991.0)?;
        if document.deviations.is_empty() && document.inputs.is_empty() {
            let detail = "the study has no deviations. Add `deviations` or `inputs` with their distributions";
            return Err(fault("/deviations", FieldCode::MissingField, detail));
        }
        let mut kinds = Vec::new();
        let mut free = Vec::new();
        for (pointer, distribution) in &document.inputs {
            let at = format!("/inputs/{}", escaped(pointer));
            let Some(Tree::Number(value)) = path(pointer).and_then(|path| base.at(&path)) else {
                let detail = "the base has no number here. Write it into the base";
                return Err(fault(&at, FieldCode::MissingField, detail));
            };
            free.push((pointer.clone(), Asked::Range { min: *value, max: *value }));
            let distribution = Distribution::new(&at, distribution)?;
            kinds.push(Kind { name: pointer.clone(), distribution, place: Place::Number { value: *value } });
        }
        let mut template = Template::new(base, &free, "inputs")?;
        let counts = template.variables().iter().find(|variable| matches!(variable.domain, Domain::Whole { .. }));
        if let Some(Variable { pointer, .. }) = counts {
            let detail = "a whole number cannot deviate. Remove this input";
            return Err(fault(&format!("/inputs/{}", escaped(pointer)), FieldCode::WrongType, detail));
        }
        // The template has parsed this document already.
        let items = match template.examples().next() {
            Some(example) => Items::of(&example.read::<Design>()?),
            None => Items { slots: 0, ring_spaces: 0, lobes: 0 },
        };
        for (name, distribution) in &document.deviations {
            let at = format!("/deviations/{}", escaped(name));
            let path = vec!["deviations".to_owned(), name.clone()];
            if base.at(&path).is_some_and(deviates) {
                let detail = "the study sets these deviations. Remove them from the base";
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
                    let detail = format!("a design has no deviation `{name}`. Use a name of the design's `deviations`");
                    return Err(fault(&at, FieldCode::UnknownField, detail));
                }
            };
            let kind = Kind { name: name.clone(), distribution: Distribution::new(&at, distribution)?, place };
            kind.put(&mut template, None);
            kinds.push(kind);
        }
        // Checks that the design's model takes deviations, and that all documents are valid.
        for example in template.examples() {
            example.read::<Design>()?;
        }
        Ok((Self { kinds, samples, seed, limits: Vec::new() }, template))
    }

    /// Number of drives for each single kind of deviation; none if there is only one kind.
    fn alone(&self) -> u64 {
        if self.kinds.len() > 1 { ALONE.min(self.samples) } else { 0 }
    }

    /// Bytes of the answer: for each quantity an entry for each kind of deviation, and a histogram.
    pub(crate) fn answer_bytes(&self, quantities: usize) -> u64 {
        const HISTOGRAM_BYTES: usize = 2048;
        // 16 bytes for the overhead of a string.
        let a_kind = |kind: &Kind| size_of::<ContributorAnswer>() + kind.name.len() + 16;
        (quantities * (HISTOGRAM_BYTES + self.kinds.iter().map(a_kind).sum::<usize>())) as u64
    }

    /// Estimated memory without its template, in bytes.
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

    /// Returns the random stream of a kind in a variant, or none without this deviation. Each kind of each sample has
    /// its own stream. So a single deviation has the same value as in the complete sample.
    fn stream(&self, variant: u64, kind: usize) -> Option<Stream> {
        let stream = |sample: u64| Stream::new(self.seed, (sample << 16) | kind as u64);
        match self.drawn(variant) {
            Drawn::All { sample } => Some(stream(sample)),
            Drawn::Alone { sample, kind: alone } if alone == kind => Some(stream(sample)),
            Drawn::Alone { .. } | Drawn::Nominal => None,
        }
    }

    /// Returns the sample of a variant, and the single kind that deviates.
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

/// Numbers of items of the drive.
struct Items {
    slots: usize,
    ring_spaces: usize,
    lobes: usize,
}

impl Items {
    fn of(design: &Design) -> Self {
        let parameters = design.drive_parameters();
        // A base with more teeth is refused, but only after these lists are set.
        let count = |count: i64| usize::try_from(count.min(MAX_TEETH)).unwrap_or_default();
        Self {
            slots: count(parameters.installed),
            ring_spaces: count(parameters.ring_teeth),
            lobes: count(parameters.wave_generator.lobes()),
        }
    }
}

impl Kind {
    /// Draws the deviations, or zeros without a stream, and sets them in the documents. Returns the value of a number
    /// of the base.
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

    fn places(&self) -> Vec<Column> {
        let inputs = self.kinds.iter().filter(|kind| matches!(kind.place, Place::Number { .. }));
        let mut columns = vec![Column::new("deviates", Content::Word)];
        columns.extend(inputs.map(|kind| Column::new(kind.name.as_str(), Content::Number)));
        columns
    }

    fn place(&self, variant: u64) -> Vec<Cell> {
        let deviates = match self.drawn(variant) {
            Drawn::Nominal => "nothing",
            Drawn::All { .. } => "everything",
            Drawn::Alone { kind, .. } => &self.kinds[kind].name,
        };
        let mut cells = vec![Cell::Word(deviates.into())];
        cells.extend(self.kinds.iter().enumerate().filter_map(|(index, kind)| {
            let Place::Number { value } = kind.place else { return None };
            let drawn = self.stream(variant, index).map_or(0.0, |mut stream| kind.distribution.draw(&mut stream));
            Some(Cell::Number(value + drawn))
        }));
        cells
    }
}

/// Result of a tolerance study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// True if every drive is computed.
    pub is_complete: bool,
    /// Number of computed random drives.
    pub samples: u64,
    /// Random drives that cannot be assembled because teeth interfere with a part. They are in no quantile.
    pub interference: u64,
    /// Random drives without an answer for another reason. They are in no quantile.
    pub impossible: u64,
    /// Reasons for missing answers.
    pub reasons: Vec<ReasonAnswer>,
    /// Fraction of all random drives that can be assembled and meet every limit. Absent without `require`.
    #[serde(rename = "yield", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub yield_share: Option<ShareAnswer>,
    /// The limits, each with the number of drives that violate it.
    pub limits: Vec<ToleranceLimitAnswer>,
    /// The quantities, each with its distribution.
    pub quantities: Vec<ToleranceQuantityAnswer>,
}

/// A limit with the number of drives that violate it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceLimitAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Side of the limit.
    pub bound: Bound,
    /// Value of the limit.
    pub limit: f64,
    /// Drives that violate it.
    pub failed: u64,
}

/// Distribution of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceQuantityAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Value without deviations. Absent if that drive has no answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub nominal: Option<f64>,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub standard_deviation: f64,
    /// Smallest value of the sample.
    pub least: f64,
    /// Largest value of the sample.
    pub largest: f64,
    /// Quantiles.
    pub quantiles: Vec<QuantileAnswer>,
    /// Histogram from the smallest to the largest value.
    pub histogram: HistogramAnswer,
    /// Effect of each kind of deviation alone, the largest first. Empty with a single kind.
    pub contributors: Vec<ContributorAnswer>,
}

/// Histogram with bins of equal width.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct HistogramAnswer {
    /// Edges of the bins, one more than there are bins. A value at an edge is in the bin above it; the largest value is
    /// in the last bin.
    pub edges: Vec<f64>,
    /// Number of drives in each bin.
    pub drives: Vec<u64>,
}

/// Effect of one kind of deviation alone.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ContributorAnswer {
    /// Kind of deviation: its name in `deviations`, or a JSON pointer.
    pub deviation: String,
    /// Standard deviation of the quantity in drives with this deviation alone.
    pub standard_deviation: f64,
    /// Variance as a fraction of the sum over all kinds.
    pub share: f64,
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy)]
struct Spread {
    mean: f64,
    standard_deviation: f64,
}

/// Computes mean and standard deviation in two passes, so that a large mean costs no digits.
fn spread(values: &[f64]) -> Spread {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    Spread { mean, standard_deviation: (squares / (count - 1.0).max(1.0)).sqrt() }
}

impl HistogramAnswer {
    /// Makes the histogram of a sorted sample. It has twice the cube root of its size bins (Rice's rule), or one if all
    /// values are equal.
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
            // An unstable sort gives the same result, because equal values have equal bits.
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

    /// Returns a table with one row for each quantity and quantile.
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
