//! The engine: a study is pure chunks, and a merge that does not depend on their order.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{self, Tree};
use toothwave_calculation::key::Key;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{self, Question as _};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Stop;

use crate::answer::StudyAnswer;
use crate::document::StudyDocument;
use crate::evaluate::{Evaluator, Stopped};
use crate::map::{Map, MapAnswer};
use crate::quantity::{Needs, QUANTITIES, Quantity};
use crate::rows::{CHUNK_VARIANTS, RowsPart, RowsWork};
use crate::variant::{Template, beyond, fault};

/// What studies are computed at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Those of each variant.
    pub calculation: question::Limits,
    /// Most variants of a study.
    pub max_study_variants: u64,
    /// Most bytes of what studies come to.
    pub max_study_bytes: u64,
}

/// A study that can be carried out.
#[derive(Debug)]
pub struct Study {
    id: Key,
    kind: Kind,
    template: Template,
    evaluator: Evaluator,
    variants: u64,
}

#[derive(Debug)]
enum Kind {
    Map(Map),
}

/// What a chunk comes to. It can be kept anywhere and merged in any order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// Of a map.
    Rows(RowsPart),
}

impl Part {
    /// Variants that it has looked at.
    pub const fn variants(&self) -> u64 {
        match self {
            Self::Rows(rows) => (rows.answered.len() + rows.refused.len()) as u64,
        }
    }

    /// Of those, the ones without an answer.
    pub const fn refused(&self) -> u64 {
        match self {
            Self::Rows(rows) => rows.refused.len() as u64,
        }
    }
}

impl Study {
    /// The study that a text asks for.
    ///
    /// # Errors
    /// Whatever is known to be impossible before anything is computed, at the field that says so.
    pub fn read(text: &[u8], limits: &Limits) -> Result<Self, NoAnswer> {
        Self::new(&json::read(text)?, limits)
    }

    /// The study that a document asks for.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn new(document: &StudyDocument, limits: &Limits) -> Result<Self, NoAnswer> {
        let id = id(document)?;
        match document {
            StudyDocument::Map(map) => {
                let (grid, template) = Map::new(map)?;
                let quantities = asked_quantities(&map.quantities, &template)?;
                let variants = grid.variants().unwrap_or(u64::MAX);
                Self::checked(id, Kind::Map(grid), template, quantities, variants, limits)
            }
            StudyDocument::Search(_) | StudyDocument::Sensitivity(_) | StudyDocument::Tolerance(_) => {
                Err(fault("/study", FieldCode::UnknownChoice, "not yet"))
            }
        }
    }

    fn checked(
        id: Key,
        kind: Kind,
        template: Template,
        quantities: Vec<&'static Quantity>,
        variants: u64,
        limits: &Limits,
    ) -> Result<Self, NoAnswer> {
        for example in template.examples() {
            require_what_quantities_need(&quantities, example, &limits.calculation)?;
        }
        let study = Self { id, kind, template, evaluator: Evaluator::new(quantities, limits.calculation), variants };
        #[expect(clippy::cast_precision_loss, reason = "told, not computed with")]
        if variants > limits.max_study_variants {
            let limit = limits.max_study_variants;
            let detail = format!("the study has {variants} variants, more than the {limit} of `max_study_variants`");
            let mut refused = beyond("", FieldCode::TooManyVariants, detail, variants as f64, limit as f64);
            refused.code = NoAnswerCode::TooManyVariants;
            return Err(refused);
        }
        #[expect(clippy::cast_precision_loss, reason = "told, not computed with")]
        if study.stored_bytes() > limits.max_study_bytes {
            let (bytes, limit) = (study.stored_bytes(), limits.max_study_bytes);
            let detail = format!(
                "what the study comes to takes {bytes} bytes, more than the {limit} of `max_study_bytes`: ask for fewer variants or quantities"
            );
            let mut refused = beyond("", FieldCode::TooManyVariants, detail, bytes as f64, limit as f64);
            refused.code = NoAnswerCode::TooManyVariants;
            return Err(refused);
        }
        Ok(study)
    }

    /// What tells it from every other one: a hash of what is asked, of the build and of the machine's arithmetic.
    pub const fn id(&self) -> Key {
        self.id
    }

    /// The kind, as documents spell it.
    pub const fn kind(&self) -> &'static str {
        match self.kind {
            Kind::Map(_) => "map",
        }
    }

    /// Variants that it looks at.
    pub const fn variants(&self) -> u64 {
        self.variants
    }

    /// Chunks that it consists of, each a computation of its own.
    pub const fn chunks(&self) -> u64 {
        match self.kind {
            Kind::Map(_) => self.variants.div_ceil(CHUNK_VARIANTS),
        }
    }

    /// About what it takes to keep what it comes to.
    pub const fn stored_bytes(&self) -> u64 {
        const OVERHEAD: u64 = 1 << 14;
        let columns = self.evaluator.quantities.len() as u64 + 2;
        OVERHEAD.saturating_add(self.variants.saturating_mul(8 * columns))
    }
}

/// The hash of what is asked: equal however the fields are ordered and the numbers spelled.
fn id(document: &StudyDocument) -> Result<Key, NoAnswer> {
    let text = serde_json::to_string(document).map_err(NoAnswer::internal)?;
    let sorted = json::tree(text.as_bytes())?.sorted();
    let text = serde_json::to_string(&sorted).map_err(NoAnswer::internal)?;
    Ok(Key::new("study", &text.as_str(), &false))
}

/// The quantities of these names; all that every document has what they need for, where none is named.
pub(crate) fn asked_quantities(names: &[String], template: &Template) -> Result<Vec<&'static Quantity>, NoAnswer> {
    if names.is_empty() {
        let has = template.examples().map(what_it_has).min().unwrap_or(Needs::Drive);
        let known = template.examples().all(has_allowable_stress);
        let is_had = |quantity: &&Quantity| match quantity.needs {
            Needs::AllowableStress => known,
            needs => needs <= has,
        };
        return Ok(QUANTITIES.iter().filter(is_had).collect());
    }
    let mut quantities: Vec<&'static Quantity> = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let quantity = named(name, &format!("/quantities/{index}"))?;
        if !quantities.contains(&quantity) {
            quantities.push(quantity);
        }
    }
    Ok(quantities)
}

/// The quantity of this name, which stands at this place of the study's document.
pub(crate) fn named(name: &str, at: &str) -> Result<&'static Quantity, NoAnswer> {
    Quantity::named(name).ok_or_else(|| {
        let detail = format!("no quantity is called `{name}`; `/v1/quantities` lists them");
        fault(at, FieldCode::UnknownChoice, detail)
    })
}

fn at<'a>(tree: &'a Tree, place: &[&str]) -> Option<&'a Tree> {
    let place: Vec<_> = place.iter().map(|&name| name.to_owned()).collect();
    tree.at(&place)
}

fn has_allowable_stress(tree: &Tree) -> bool {
    at(tree, &["load", "allowable_stress_mpa"]).is_some()
}

/// The most that quantities may need, allowable stresses apart.
fn what_it_has(tree: &Tree) -> Needs {
    let has = |place: &[&str]| at(tree, place).is_some();
    match (has(&["load"]), has(&["friction"]), has(&["load", "input_speed_rpm"])) {
        (false, ..) => Needs::Drive,
        (true, false, _) => Needs::Load,
        (true, true, false) => Needs::Friction,
        (true, true, true) => Needs::FrictionAndSpeed,
    }
}

/// That a document has what every quantity needs, and that it can be asked at all.
fn require_what_quantities_need(
    quantities: &[&'static Quantity],
    tree: &Tree,
    limits: &question::Limits,
) -> Result<(), NoAnswer> {
    for quantity in quantities {
        let needed: &[(&[&str], &str)] = match quantity.needs {
            Needs::Drive => &[],
            Needs::Load => &[(&["load"], "a load")],
            Needs::AllowableStress => &[(&["load"], "a load"), (&["load", "allowable_stress_mpa"], "an allowable stress")],
            Needs::Friction => &[(&["load"], "a load"), (&["friction"], "friction")],
            Needs::FrictionAndSpeed => &[
                (&["load"], "a load"),
                (&["friction"], "friction"),
                (&["load", "input_speed_rpm"], "the speed of the wave generator"),
            ],
        };
        if let Some((place, what)) = needed.iter().find(|(place, _)| at(tree, place).is_none()) {
            let detail = format!("`{}` needs {what}, and the base has none", quantity.name);
            return Err(fault(&format!("/base/{}", place.join("/")), FieldCode::MissingField, detail));
        }
    }
    if quantities.iter().all(|quantity| quantity.needs == Needs::Drive) {
        return Ok(());
    }
    // A fault of its form is one whatever the values.
    let design = tree.read::<Design>()?.normalised();
    match Sweep.check(&design, limits) {
        Err(mut refused) if refused.code == NoAnswerCode::InvalidDocument => {
            refused.detail = format!("/base{}", refused.detail);
            for error in &mut refused.errors {
                error.pointer.insert_str(0, "/base");
            }
            Err(refused)
        }
        _ => Ok(()),
    }
}

/// A chunk as it is worked on, a variant at a time: it may be laid aside between any two of them.
#[derive(Debug)]
pub struct Work {
    study: Arc<Study>,
    state: State,
}

#[derive(Debug)]
enum State {
    Rows(RowsWork),
}

impl Work {
    /// A chunk of a study, not begun yet.
    pub fn new(study: &Arc<Study>, chunk: u64) -> Self {
        let state = match &study.kind {
            Kind::Map(_) => {
                let quantities = study.evaluator.quantities.len();
                State::Rows(RowsWork::new(study.template.clone(), quantities, chunk, study.variants))
            }
        };
        Self { study: Arc::clone(study), state }
    }

    /// One variant further; whether that was the last one.
    ///
    /// # Errors
    /// When `stop` says so; the chunk is then as it was before.
    pub fn step(&mut self, stop: &impl Stop) -> Result<bool, Stopped> {
        let Self { study, state } = self;
        match (&study.kind, state) {
            (Kind::Map(map), State::Rows(rows)) => rows.step(map, &study.evaluator, stop),
        }
    }

    /// What the chunk comes to, once it is over.
    pub fn finish(self) -> Part {
        match self.state {
            State::Rows(rows) => Part::Rows(rows.finish()),
        }
    }

    /// The whole chunk at once.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn run(mut self, stop: &impl Stop) -> Result<Part, Stopped> {
        while !self.step(stop)? {}
        Ok(self.finish())
    }
}

/// The parts of a study, in whatever order they come.
#[derive(Debug)]
pub struct Gathered {
    study: Arc<Study>,
    parts: Vec<Option<Part>>,
    missing: u64,
    variants: u64,
    refused: u64,
}

impl Gathered {
    /// None yet.
    pub fn new(study: &Arc<Study>) -> Self {
        let parts = (0..study.chunks()).map(|_| None).collect();
        Self { study: Arc::clone(study), parts, missing: study.chunks(), variants: 0, refused: 0 }
    }

    /// The study.
    pub const fn study(&self) -> &Arc<Study> {
        &self.study
    }

    /// Takes what a chunk has come to; a second time it changes nothing.
    pub fn add(&mut self, chunk: u64, part: Part) {
        let place = usize::try_from(chunk).ok().and_then(|chunk| self.parts.get_mut(chunk));
        if let Some(place @ None) = place {
            self.missing -= 1;
            self.variants += part.variants();
            self.refused += part.refused();
            *place = Some(part);
        }
    }

    /// Chunks that have not come yet.
    pub fn missing(&self) -> impl Iterator<Item = u64> {
        (0..).zip(&self.parts).filter(|(_, part)| part.is_none()).map(|(chunk, _)| chunk)
    }

    /// Whether all have come.
    pub const fn is_complete(&self) -> bool {
        self.missing == 0
    }

    /// Variants that were looked at.
    pub const fn variants(&self) -> u64 {
        self.variants
    }

    /// Of those, the ones without an answer.
    pub const fn refused(&self) -> u64 {
        self.refused
    }

    /// What the study comes to, as far as it has come.
    pub fn answer(&self) -> StudyAnswer {
        let study = &*self.study;
        let parts = self.parts.iter().flatten();
        match &study.kind {
            Kind::Map(map) => {
                let mut rows = RowsPart::new(study.evaluator.quantities.len());
                for Part::Rows(part) in parts {
                    rows.append(part);
                }
                StudyAnswer::Map(MapAnswer::new(map, &study.evaluator, rows, self.is_complete()))
            }
        }
    }
}
