//! Refinements of the load-sharing model beyond its contact law.

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{PartialSchema, ToSchema};

/// A set of refinements. Needs `virtual_work`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refinements {
    /// [`RefinementItem::Auto`]; false in the answer's `model`, which lists what follows from the geometry.
    pub auto: bool,
    /// [`RefinementItem::RingTeethBend`].
    pub ring_teeth_bend: bool,
    /// [`RefinementItem::WaveGeneratorMoves`].
    pub wave_generator_moves: bool,
    /// [`RefinementItem::CornerContact`].
    pub corner_contact: bool,
}

const AUTO: &str = "auto";
const NONE: &str = "none";

impl Refinements {
    /// The empty set.
    pub const NONE: Self =
        Self { auto: false, ring_teeth_bend: false, wave_generator_moves: false, corner_contact: false };

    /// The refinements that follow from the geometry.
    pub const AUTO: Self = Self { auto: true, ..Self::NONE };
}

impl Default for Refinements {
    fn default() -> Self {
        Self::AUTO
    }
}

/// Item of the list: a refinement, or those that follow from the geometry.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RefinementItem {
    /// The refinements that follow from the geometry.
    Auto,
    /// The ring's teeth bend, more so the nearer to the tip the contact is.
    RingTeethBend,
    /// The lever arms change as the wave generator winds up under its teeth. Otherwise they are those without load.
    WaveGeneratorMoves,
    /// Teeth press against the corner of a pointed or bored tip before they reach the flank. States are then listed
    /// from the valley on. At a corner the ring stress is not calculated. Balls never press against corners.
    CornerContact,
}

impl RefinementItem {
    const ALL: [Self; 4] = [Self::Auto, Self::RingTeethBend, Self::WaveGeneratorMoves, Self::CornerContact];

    /// Returns the place that tells whether the refinements include the item.
    const fn of(self, refinements: &mut Refinements) -> &mut bool {
        match self {
            Self::Auto => &mut refinements.auto,
            Self::RingTeethBend => &mut refinements.ring_teeth_bend,
            Self::WaveGeneratorMoves => &mut refinements.wave_generator_moves,
            Self::CornerContact => &mut refinements.corner_contact,
        }
    }
}

impl Serialize for Refinements {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Self::AUTO => serializer.serialize_str(AUTO),
            Self::NONE => serializer.serialize_str(NONE),
            mut refinements => {
                serializer.collect_seq(RefinementItem::ALL.into_iter().filter(|item| *item.of(&mut refinements)))
            }
        }
    }
}

impl<'de> Deserialize<'de> for Refinements {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WordOrList;

        impl<'de> Visitor<'de> for WordOrList {
            type Value = Refinements;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "`{AUTO}`, `{NONE}` or a list of refinements")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Self::Value, E> {
                match word {
                    AUTO => Ok(Refinements::AUTO),
                    NONE => Ok(Refinements::NONE),
                    other => Err(E::unknown_variant(other, &[AUTO, NONE])),
                }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
                let mut refinements = Refinements::NONE;
                while let Some(item) = items.next_element::<RefinementItem>()? {
                    *item.of(&mut refinements) = true;
                }
                Ok(refinements)
            }
        }

        deserializer.deserialize_any(WordOrList)
    }
}

impl PartialSchema for Refinements {
    fn schema() -> RefOr<Schema> {
        let word = ObjectBuilder::new().schema_type(Type::String).enum_values(Some([AUTO, NONE]));
        let list = ArrayBuilder::new().items(Ref::from_schema_name(RefinementItem::name()));
        OneOfBuilder::new()
            .description(Some(
                "Refinements of the model: `auto`, `none`, or a list. `auto` depends on the geometry and not on the law. For \
                 cylinders with `virtual_work` in a ring with pointed or bored tips it is `ring_teeth_bend`, with gaps \
                 also `wave_generator_moves`. Otherwise it is `none`. In a list `auto` means these.",
            ))
            .item(word)
            .item(list)
            .default(Some(AUTO.into()))
            .into()
    }
}

impl ToSchema for Refinements {
    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((RefinementItem::name().into(), RefinementItem::schema()));
    }
}
