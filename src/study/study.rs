//! The engine of studies: pure chunks, and a merge that does not depend on their order.

mod requirements;
mod work;

use std::ops::Range;

use requirements::{
    asked_quantities, check, is_of_every_draw, require_each_field_once, require_one_field_of_each_gap,
    require_possible_base, require_possible_ranges, require_what_quantities_need,
};
use serde::{Deserialize, Serialize};
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::Tree;
use toothwave_calculation::key::Key;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::{json, question};

use crate::ask::beyond;
use crate::document::StudyDocument;
use crate::evaluate::Evaluator;
use crate::map::Map;
use crate::quantity::Quantity;
use crate::rows::{Rows, RowsPart};
use crate::search::{IslandPart, Search, SearchAnswer};
use crate::sensitivity::Sensitivity;
use crate::table::Table;
use crate::tolerance::Tolerance;
use crate::variant::Template;
use crate::{identity, limit};

pub use work::Work;

/// Limits of studies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Limits of each variant.
    pub calculation: question::Limits,
    /// Most variants of a study.
    pub max_study_variants: u64,
    /// Most bytes of a study with its result.
    pub max_study_bytes: u64,
}

impl Limits {
    /// Limits without a server: 8 GiB of results.
    pub const OFFLINE: Self =
        Self { calculation: question::Limits::OFFLINE, max_study_variants: 1_000_000_000, max_study_bytes: 8 << 30 };
}

/// A checked study.
#[derive(Debug)]
pub struct Study {
    id: Key,
    pub(crate) kind: Kind,
    pub(crate) template: Template,
    pub(crate) evaluator: Evaluator,
    variants: u64,
    /// Variants of a chunk with rows.
    chunk_variants: u64,
}

#[derive(Debug)]
pub(crate) enum Kind {
    Map(Map),
    Search(Box<Search>),
    Sensitivity(Sensitivity),
    Tolerance(Tolerance),
}

/// Result of a chunk. Parts can be stored anywhere and merged in any order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// Part of a map, a sensitivity or a tolerance study.
    Rows(RowsPart),
    /// Part of a search.
    Island(IslandPart),
}

impl Part {
    /// Frees unused capacity.
    pub(crate) fn shrink(&mut self) {
        if let Self::Rows(rows) = self {
            rows.shrink();
        }
    }

    /// Estimated memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + match self {
                Self::Rows(rows) => rows.bytes(),
                Self::Island(island) => island.bytes(),
            }
    }

    /// Number of computed variants.
    pub const fn variants(&self) -> u64 {
        match self {
            Self::Rows(rows) => (rows.answered.len() + rows.refused.len()) as u64,
            Self::Island(island) => island.evaluated(),
        }
    }

    /// Number of computed variants without an answer. For a search, those of its scan.
    pub const fn refused(&self) -> u64 {
        match self {
            Self::Rows(rows) => rows.refused.len() as u64,
            Self::Island(island) => island.refused(),
        }
    }
}

impl Study {
    /// Reads a study document and checks it.
    pub fn read(text: &[u8], limits: &Limits) -> Result<Self, NoAnswer> {
        let document = {
            // The tree is dropped before the study is made.
            let tree = json::tree(text)?;
            require_each_field_once(&tree)?;
            tree.read()?
        };
        Self::new(&document, limits)
    }

    /// Checks a study document.
    pub fn new(document: &StudyDocument, limits: &Limits) -> Result<Self, NoAnswer> {
        let limited;
        let document = if let StudyDocument::Search(search) = document {
            limited = StudyDocument::Search(search.with_default_limits());
            &limited
        } else {
            document
        };
        let mut study = Self::unnamed(document, limits)?;
        let resolved = match &study.kind {
            Kind::Map(map) => vec![("over", Tree::Array(vec![study.template.asked(), map.counts()]))],
            Kind::Search(search) => vec![("free", study.template.asked()), ("start", search.starts())],
            Kind::Sensitivity(sensitivity) => vec![("inputs", sensitivity.asked())],
            Kind::Tolerance(_) => Vec::new(),
        };
        study.id = identity::id(document, &study.template, &study.evaluator.quantities, resolved, &limits.calculation)?;
        Ok(study)
    }

    /// Makes the study without its id.
    fn unnamed(document: &StudyDocument, limits: &Limits) -> Result<Self, NoAnswer> {
        match document {
            StudyDocument::Map(map) => {
                let (grid, template) = Map::new(map)?;
                let quantities = asked_quantities(&map.quantities, &template)?;
                let variants = grid.variants().unwrap_or(u64::MAX);
                Self::checked(Kind::Map(grid), template, quantities, variants, limits)
            }
            StudyDocument::Search(document) => {
                let (search, template, quantities) = Search::new(document)?;
                search.require_that_free_fields_matter(&template, &quantities, &limits.calculation)?;
                let variants = search.evaluations();
                Self::checked(Kind::Search(Box::new(search)), template, quantities, variants, limits)
            }
            StudyDocument::Sensitivity(document) => {
                let (sensitivity, template) = Sensitivity::new(document)?;
                let quantities = asked_quantities(&document.quantities, &template)?;
                let variants = sensitivity.variants();
                let kind = Kind::Sensitivity(sensitivity);
                Self::checked(kind, template, quantities, variants, limits)?.with_possible_base(limits)
            }
            StudyDocument::Tolerance(document) => {
                let (mut tolerance, template) = Tolerance::new(document)?;
                let mut quantities = asked_quantities(&document.quantities, &template)?;
                tolerance.limits = limit::limits(&document.require, &mut quantities)?;
                let variants = tolerance.variants();
                let kind = Kind::Tolerance(tolerance);
                Self::checked(kind, template, quantities, variants, limits)?.with_possible_base(limits)
            }
        }
    }

    fn checked(
        kind: Kind,
        template: Template,
        quantities: Vec<&'static Quantity>,
        variants: u64,
        limits: &Limits,
    ) -> Result<Self, NoAnswer> {
        require_one_field_of_each_gap(&template)?;
        for example in template.examples() {
            require_what_quantities_need(&quantities, example)?;
            require_possible_base(&quantities, &template, example, &limits.calculation)?;
        }
        if matches!(kind, Kind::Map(_) | Kind::Search(_)) {
            require_possible_ranges(&quantities, &template, &limits.calculation)?;
        }
        let evaluator = Evaluator::new(quantities, limits.calculation);
        let study =
            Self { id: Key::default(), kind, template, evaluator, variants, chunk_variants: chunk_variants(variants) };
        #[expect(clippy::cast_precision_loss, reason = "a number in a message")]
        if variants > limits.max_study_variants {
            let limit = limits.max_study_variants;
            let detail = format!(
                "the study has {variants} variants, but `max_study_variants` allows at most {limit}. Use fewer"
            );
            let mut refused = beyond("", FieldCode::TooManyVariants, detail, variants as f64, limit as f64);
            refused.code = NoAnswerCode::TooManyVariants;
            return Err(refused);
        }
        let bytes = study.kept_bytes().max(study.answer_bytes());
        #[expect(clippy::cast_precision_loss, reason = "a number in a message")]
        if bytes > limits.max_study_bytes {
            let limit = limits.max_study_bytes;
            let detail = format!(
                "the study with its result needs {bytes} bytes, but `max_study_bytes` allows at most {limit}. Use fewer variants or quantities, or a shorter base"
            );
            let mut refused = beyond("", FieldCode::TooManyVariants, detail, bytes as f64, limit as f64);
            refused.code = NoAnswerCode::TooManyVariants;
            return Err(refused);
        }
        Ok(study)
    }

    /// Checks that the base design is possible, and that it can deviate as requested.
    fn with_possible_base(self, limits: &Limits) -> Result<Self, NoAnswer> {
        let mut template = self.template.clone();
        let mut refused = |rows: &dyn Rows, variant: u64| {
            let document = rows.document(&mut template, variant);
            check(&self.evaluator.quantities, document, &limits.calculation).err()
        };
        let (found, is_drawn) = match &self.kind {
            Kind::Map(_) | Kind::Search(_) => (None, false),
            Kind::Sensitivity(sensitivity) => (refused(sensitivity, 0), false),
            Kind::Tolerance(tolerance) => match refused(tolerance, 0) {
                Some(refused) => (Some(refused), false),
                // A single impossible drive is a result of the study. A model without deviations is an error.
                None => (refused(tolerance, 1).filter(is_of_every_draw), true),
            },
        };
        let Some(mut refused) = found else { return Ok(self) };
        for error in &mut refused.errors {
            let stands = match error.pointer.as_str() {
                pointer if !is_drawn => format!("/base{pointer}"),
                // The study names them as the design does.
                pointer if pointer.starts_with("/deviations") => pointer.into(),
                pointer => self.template.blamed(pointer),
            };
            refused.detail = refused.detail.replacen(&error.pointer, &stands, 1);
            error.pointer = stands;
        }
        Err(refused)
    }

    /// The id: a hash of the question, the limits of each variant, the build and the machine's arithmetic.
    pub const fn id(&self) -> Key {
        self.id
    }

    /// The kind, as in documents.
    pub const fn kind(&self) -> &'static str {
        match self.kind {
            Kind::Map(_) => "map",
            Kind::Search(_) => "search",
            Kind::Sensitivity(_) => "sensitivity",
            Kind::Tolerance(_) => "tolerance",
        }
    }

    /// Number of variants.
    pub const fn variants(&self) -> u64 {
        self.variants
    }

    /// Number of chunks. Each is a separate computation.
    pub const fn chunks(&self) -> u64 {
        match &self.kind {
            Kind::Search(search) => search.islands(),
            Kind::Map(_) | Kind::Sensitivity(_) | Kind::Tolerance(_) => self.variants.div_ceil(self.chunk_variants),
        }
    }

    /// Returns the same study with another chunk size. The result is the same, to the bit. A search keeps its islands,
    /// because its result depends on their number.
    #[must_use]
    pub fn in_chunks_of(self, variants: u64) -> Self {
        Self { chunk_variants: variants.max(1), ..self }
    }

    /// Number of variants of a chunk with rows.
    pub const fn chunk_variants(&self) -> u64 {
        self.chunk_variants
    }

    /// Names of the quantities in the order of the columns.
    pub(crate) fn quantities(&self) -> impl ExactSizeIterator<Item = &'static str> {
        self.evaluator.quantities.iter().map(|quantity| quantity.name)
    }

    /// True if a chunk has one row for each variant. A chunk of a search is an island with designs.
    pub const fn has_rows(&self) -> bool {
        !matches!(self.kind, Kind::Search(_))
    }

    /// Returns the rows of a part as a table, or `None` for a search.
    pub(crate) fn rows_table<'a>(&'a self, rows: &'a RowsPart) -> Option<Table<'a>> {
        match &self.kind {
            Kind::Map(map) => Some(rows.table(map, self.quantities())),
            Kind::Sensitivity(sensitivity) => Some(rows.table(sensitivity, self.quantities())),
            Kind::Tolerance(tolerance) => Some(rows.table(tolerance, self.quantities())),
            Kind::Search(_) => None,
        }
    }

    /// Returns the answer from one island of a search.
    pub(crate) fn found_by(&self, island: &IslandPart) -> Option<SearchAnswer> {
        let Kind::Search(search) = &self.kind else { return None };
        Some(SearchAnswer::new(search, &self.template, &self.evaluator, [island].into_iter(), false))
    }

    /// Returns the range of a chunk: its variants, or one island of a search.
    pub fn span_of(&self, chunk: u64) -> Range<u64> {
        if matches!(self.kind, Kind::Search(_)) {
            return chunk..chunk + 1;
        }
        let first = chunk.saturating_mul(self.chunk_variants).min(self.variants);
        first..self.variants.min(first.saturating_add(self.chunk_variants))
    }

    /// Estimated bytes of the stored results.
    pub fn stored_bytes(&self) -> u64 {
        const OVERHEAD: u64 = 1 << 14;
        let quantities = self.evaluator.quantities.len();
        let bytes = match &self.kind {
            Kind::Search(search) => search.stored_bytes(quantities, self.template.variables().len()),
            Kind::Map(_) | Kind::Sensitivity(_) | Kind::Tolerance(_) => {
                self.variants.saturating_mul(8 * (quantities as u64 + 2))
            }
        };
        OVERHEAD.saturating_add(bytes)
    }

    /// Estimated bytes of the answer while it is made, with the stored results.
    pub fn answer_bytes(&self) -> u64 {
        self.stored_bytes().saturating_add(self.told_bytes())
    }

    /// Estimated bytes of the answer without the stored results.
    pub fn told_bytes(&self) -> u64 {
        let quantities = self.evaluator.quantities.len();
        match &self.kind {
            Kind::Map(_) => 0,
            Kind::Search(search) => search.designs_bytes(self.template.longest_bytes()),
            Kind::Sensitivity(sensitivity) => sensitivity.answer_bytes(quantities),
            Kind::Tolerance(tolerance) => tolerance.answer_bytes(quantities),
        }
    }

    /// Estimated memory of the study with its results, in bytes.
    pub fn kept_bytes(&self) -> u64 {
        let of_kind = match &self.kind {
            Kind::Map(map) => map.bytes(),
            Kind::Search(search) => search.template_bytes(),
            Kind::Sensitivity(sensitivity) => sensitivity.bytes(),
            Kind::Tolerance(tolerance) => tolerance.bytes(),
        };
        self.stored_bytes().saturating_add((self.template.bytes() + of_kind) as u64)
    }
}

/// Returns the chunk size. It depends on the question alone, so that every process makes the same chunks.
fn chunk_variants(variants: u64) -> u64 {
    /// Some tens of milliseconds of the cheapest variants.
    const MOST_VARIANTS: u64 = 4096;
    /// Enough chunks that several cores work on slow variants, and that a lost chunk costs little.
    const LEAST_CHUNKS: u64 = 256;
    /// The list of chunks stays short enough for its readers.
    const MOST_CHUNKS: u64 = 100_000;
    variants.div_ceil(LEAST_CHUNKS).clamp(1, MOST_VARIANTS).max(variants.div_ceil(MOST_CHUNKS))
}
