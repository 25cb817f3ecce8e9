//! Tolerance study: drives with random deviations, and the distributions of their quantities.

mod answer;

use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_solver::violation::MAX_TEETH;

use crate::ask::{escaped, fault, whole};
use crate::defaults::with_defaults_at;
use crate::document::{DistributionDocument, DistributionKind, ToleranceDocument};
use crate::limit::Limit;
use crate::random::Stream;
use crate::rows::Rows;
use crate::table::{Cell, Column, Content};
use crate::variant::{Asked, Domain, GRAIN_BYTES, Template, Value, Variable};

pub use answer::{ContributorAnswer, HistogramAnswer, ToleranceAnswer, ToleranceLimitAnswer, ToleranceQuantityAnswer};

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
            let is_of_it =
                |pointer: &&String| pointer.split('/').nth(2) == Some(name) && pointer.starts_with("/deviations/");
            if let Some(pointer) = document.inputs.keys().find(is_of_it) {
                let detail = format!("`deviations/{name}` of the study draws this too. Remove one");
                return Err(fault(&format!("/inputs/{}", escaped(pointer)), FieldCode::ConflictingFields, detail));
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
