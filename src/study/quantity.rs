//! The quantities of a variant, each with unit, meaning and source.

mod list;
mod variant;

use serde::Serialize;
use toothwave_solver::root::NotConverged;
use utoipa::ToSchema;

pub use list::QUANTITIES;
pub(crate) use variant::{Loaded, Variant};

/// Source of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// An answer to the same document has it.
    Answer(AnswerPlace),
    /// Definition of a quantity that is computed from an answer.
    Definition(&'static str),
}

/// Place of a value in an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct AnswerPlace {
    /// Path of the request.
    pub path: &'static str,
    /// JSON pointer into the answer.
    pub pointer: &'static str,
}

/// Fields of the document that a quantity needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Needs {
    /// The drive alone.
    Drive,
    /// A load.
    Load,
    /// A load and `load.allowable_stress_mpa`.
    AllowableStress,
    /// A load and `parts.carrier.strength`.
    CarrierStrength,
    /// A load and `friction`.
    Friction,
    /// A load, `friction` and a speed: `load.input_speed_rpm`, or the speeds of a `load.duty`.
    FrictionAndSpeed,
}

/// Computation that a quantity needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Takes {
    /// Geometry of the drive.
    Drive,
    /// Peaks of a sweep.
    Peaks,
    /// Radial forces on the wave generator, state by state.
    RadialForces,
    /// Losses by friction, state by state.
    Losses,
    /// Backlash at the output.
    Backlash,
}

/// Function that computes a quantity.
type Of = fn(&Variant<'_>) -> Result<f64, NotConverged>;

/// A quantity of a study.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct Quantity {
    /// Name, which ends in the unit.
    pub name: &'static str,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// True if the quantity is a flag: 1 for true, 0 for false.
    pub is_flag: bool,
    /// Fields that the document needs for it.
    pub needs: Needs,
    /// Source.
    pub source: Source,
    /// Paths of a design that it may depend on. Other fields do not change it.
    #[serde(skip)]
    pub(crate) depends_on: &'static [&'static str],
    /// Path of a design that sets it directly, if the field is given.
    #[serde(skip)]
    pub(crate) said_by: Option<&'static str>,
    /// Lower bound for every drive.
    #[serde(skip)]
    pub(crate) least: f64,
    /// Upper bound for every drive.
    #[serde(skip)]
    pub(crate) most: f64,
    /// True if some drives have no such value.
    #[serde(skip)]
    pub(crate) may_be_absent: bool,
    #[serde(skip)]
    pub(crate) takes: Takes,
    #[serde(skip)]
    of: Of,
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// All paths except those of drawings.
const MECHANICS: [&str; 9] =
    ["/drive", "/materials", "/load", "/model", "/modification", "/deviations", "/friction", "/parts", "/sweep"];

const fn of_drive(name: &'static str, unit: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity {
        name,
        unit,
        meaning,
        is_flag: false,
        needs: Needs::Drive,
        source,
        depends_on: &["/drive"],
        said_by: None,
        least: f64::NEG_INFINITY,
        most: f64::INFINITY,
        may_be_absent: false,
        takes: Takes::Drive,
        of,
    }
}

const fn flag(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { is_flag: true, ..of_drive(name, "", meaning, source, of) }
}

const fn of_sweep(name: &'static str, unit: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    let (needs, takes) = (Needs::Load, Takes::Peaks);
    Quantity { needs, depends_on: &MECHANICS, takes, ..of_drive(name, unit, meaning, source, of) }
}

const fn of_capacity(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { needs: Needs::AllowableStress, ..of_sweep(name, "N·m", meaning, source, of) }
}

const fn backlash(name: &'static str, meaning: &'static str, pointer: &'static str, of: Of) -> Quantity {
    of_sweep(name, "arcmin", meaning, sweep(pointer), of).taking(Takes::Backlash)
}

const fn of_losses(name: &'static str, unit: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { needs: Needs::Friction, takes: Takes::Losses, ..of_sweep(name, unit, meaning, source, of) }
}

const fn loss_ratio(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    of_losses(name, "", meaning, source, of).not_below_zero()
}

const fn efficiency(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { most: 1.0, ..of_losses(name, "", meaning, source, of) }
}

const fn pressure_velocity(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    of_losses(name, "MPa m/s", meaning, source, of).at_speed().not_below_zero()
}

const fn geometry(pointer: &'static str) -> Source {
    Source::Answer(AnswerPlace { path: "/v1/geometry", pointer })
}

const fn mesh(pointer: &'static str) -> Source {
    Source::Answer(AnswerPlace { path: "/v1/coincidence-degree", pointer })
}

const fn sweep(pointer: &'static str) -> Source {
    Source::Answer(AnswerPlace { path: "/v1/sweep", pointer })
}

/// The two quantities from which a search can derive the free fields.
pub(crate) const TRANSMISSION_RATIO: &str = "transmission_ratio";

pub(crate) const OUTER_DIAMETER_MM: &str = "outer_diameter_mm";

impl Quantity {
    const fn not_below_zero(self) -> Self {
        Self { least: 0.0, ..self }
    }

    const fn or_absent(self) -> Self {
        Self { may_be_absent: true, ..self }
    }

    const fn depending_on(self, depends_on: &'static [&'static str]) -> Self {
        Self { depends_on, ..self }
    }

    const fn said_by(self, place: &'static str) -> Self {
        Self { said_by: Some(place), ..self }
    }

    const fn taking(self, takes: Takes) -> Self {
        Self { takes, ..self }
    }

    const fn at_speed(self) -> Self {
        Self { needs: Needs::FrictionAndSpeed, ..self }
    }

    /// Returns the quantity with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        QUANTITIES.iter().find(|quantity| quantity.name == name)
    }

    /// Computes the value, NaN if this drive has none.
    pub(crate) fn of(&self, variant: &Variant<'_>) -> Result<f64, NotConverged> {
        (self.of)(variant)
    }
}
