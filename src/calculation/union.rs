//! Objects of several kinds, told apart by a word in one of their fields.

use utoipa::ToSchema;
use utoipa::openapi::schema::{Discriminator, ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{Ref, RefOr};

/// A kind of a union, as the API document has it.
pub(crate) struct KindSchema {
    /// The word that names the kind.
    pub(crate) word: &'static str,
    /// The name of its schema.
    pub(crate) name: String,
    /// Fields without the word.
    pub(crate) fields: RefOr<Schema>,
}

impl KindSchema {
    pub(crate) fn of<T: ToSchema>(union: &str, word: &'static str) -> Self {
        let mut name = union.to_owned();
        for part in word.split('_') {
            let (first, rest) = part.split_at(1);
            name.push_str(&first.to_uppercase());
            name.push_str(rest);
        }
        Self { word, name, fields: T::schema() }
    }

    /// The fields with the word. It is required unless this kind is meant where it is left out.
    fn with_word(&self, tag: &str, by_default: &[&str]) -> RefOr<Schema> {
        let mut schema = self.fields.clone();
        if let RefOr::T(Schema::Object(object)) = &mut schema {
            let mut word = ObjectBuilder::new().schema_type(Type::String).enum_values(Some([self.word]));
            if by_default.contains(&self.word) {
                word = word.default(Some(self.word.into()));
            } else {
                object.required.insert(0, tag.into());
            }
            object.properties.insert(tag.into(), Schema::Object(word.build()).into());
        }
        schema
    }

    fn reference(&self) -> Ref {
        Ref::from_schema_name(&self.name)
    }
}

/// One of these kinds. Generators read no discriminator that a kind may lack: with a default the kinds are told apart by their words alone.
pub(crate) fn schema(description: &str, tag: &str, kinds: &[KindSchema], by_default: &[&str]) -> RefOr<Schema> {
    let mapping = kinds.iter().map(|kind| (kind.word, kind.reference().ref_location));
    let discriminator = by_default.is_empty().then(|| Discriminator::with_mapping(tag, mapping));
    let mut union = OneOfBuilder::new().description(Some(description.trim())).discriminator(discriminator);
    for kind in kinds {
        union = union.item(kind.reference());
    }
    union.into()
}

/// The schemas that [`schema`] refers to.
pub(crate) fn schemas(
    tag: &str,
    kinds: &[KindSchema],
    by_default: &[&str],
    schemas: &mut Vec<(String, RefOr<Schema>)>,
) {
    schemas.extend(kinds.iter().map(|kind| (kind.name.clone(), kind.with_word(tag, by_default))));
}

/// Makes an enum of kinds of object. It is written with its word always, read as [`crate::json`] reads unions, and in the API document it is a
/// `oneOf` with a discriminator.
macro_rules! union {
    (
        $(#[doc = $doc:literal])+
        pub enum $union:ident as $name:literal by $tag:literal read $read:literal $(default $by_default:literal)? {
            $($(#[doc = $kind_doc:literal])+ $kind:ident($fields:ty) = $word:literal),+ $(,)?
        }
    ) => {
        $(#[doc = $doc])+
        #[derive(Debug, Clone, PartialEq)]
        pub enum $union {
            $($(#[doc = $kind_doc])+ $kind($fields)),+
        }

        impl serde::Serialize for $union {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                #[derive(serde::Serialize)]
                #[serde(tag = $tag)]
                enum Written<'a> {
                    $(#[serde(rename = $word)] $kind(&'a $fields)),+
                }
                match self {
                    $(Self::$kind(fields) => Written::$kind(fields)),+
                }
                .serialize(serializer)
            }
        }

        impl<'de> serde::Deserialize<'de> for $union {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                #[derive(serde::Deserialize)]
                #[serde(rename = $read)]
                enum Read {
                    $(#[serde(rename = $word)] $kind($fields)),+
                }
                Ok(match Read::deserialize(deserializer)? {
                    $(Read::$kind(fields) => Self::$kind(fields)),+
                })
            }
        }

        impl $union {
            const BY_DEFAULT: &[&str] = &[$($by_default)?];

            fn kinds() -> Vec<$crate::union::KindSchema> {
                vec![$($crate::union::KindSchema::of::<$fields>($name, $word)),+]
            }
        }

        impl utoipa::PartialSchema for $union {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                $crate::union::schema(concat!($($doc, "\n"),+), $tag, &Self::kinds(), Self::BY_DEFAULT)
            }
        }

        impl utoipa::ToSchema for $union {
            fn name() -> std::borrow::Cow<'static, str> {
                $name.into()
            }

            fn schemas(schemas: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $crate::union::schemas($tag, &Self::kinds(), Self::BY_DEFAULT, schemas);
                $(<$fields as utoipa::ToSchema>::schemas(schemas);)+
            }
        }
    };
}
pub(crate) use union;
