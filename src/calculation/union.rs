//! Values of several kinds: objects that are told apart by a word in one of their fields, and an object or one value.

use serde_json::{Value, json};

/// Makes an enum of kinds of object. It is written with its word always, and read as [`crate::json`] reads unions.
#[macro_export]
macro_rules! union {
    ($(#[$meta:meta])+ pub enum $union:ident by $tag:tt read $read:literal { $($kinds:tt)+ }) => {
        #[derive(Debug, Clone, PartialEq, serde::Serialize, utoipa::ToSchema)]
        #[serde(tag = $tag, rename_all = "snake_case")]
        $(#[$meta])+
        pub enum $union {
            $($kinds)+
        }

        impl<'de> serde::Deserialize<'de> for $union {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                type Union = $union;

                // Deriving `ToSchema` makes `#[schema]` on fields valid here.
                #[derive(serde::Deserialize, utoipa::ToSchema)]
                #[serde(remote = "Union", rename = $read, rename_all = "snake_case", deny_unknown_fields)]
                enum Read {
                    $($kinds)+
                }
                Read::deserialize(deserializer)
            }
        }
    };
}

/// Reads one value, or else an object. The JSON type tells them apart, so that an error keeps its place. With `as` it is a
/// `oneOf` in the API document.
#[macro_export]
macro_rules! either {
    (
        $document:ident expects $expected:literal:
        $visit:ident($one:ident: $of:ty) => $read:expr, $object:ty => $given:expr $(,)?
    ) => {
        impl<'de> serde::Deserialize<'de> for $document {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Either;

                impl<'de> serde::de::Visitor<'de> for Either {
                    type Value = $document;

                    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                        f.write_str($expected)
                    }

                    fn $visit<E: serde::de::Error>(self, $one: $of) -> Result<$document, E> {
                        $read
                    }

                    fn visit_map<A: serde::de::MapAccess<'de>>(self, fields: A) -> Result<$document, A::Error> {
                        let fields = serde::de::value::MapAccessDeserializer::new(fields);
                        <$object as serde::Deserialize>::deserialize(fields).map($given)
                    }
                }

                deserializer.deserialize_any(Either)
            }
        }
    };
    (
        $document:ident as $name:literal ($description:literal, $schema:expr) expects $expected:literal:
        $visit:ident($one:ident: $of:ty) => $read:expr, $object:ty => $given:expr $(,)?
    ) => {
        $crate::either!($document expects $expected: $visit($one: $of) => $read, $object => $given);

        impl utoipa::PartialSchema for $document {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                utoipa::openapi::schema::OneOfBuilder::new()
                    .description(Some($description))
                    .item($schema)
                    .item(utoipa::openapi::Ref::from_schema_name(<$object as utoipa::ToSchema>::name()))
                    .into()
            }
        }

        impl utoipa::ToSchema for $document {
            fn name() -> std::borrow::Cow<'static, str> {
                $name.into()
            }

            fn schemas(schemas: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                let name = <$object as utoipa::ToSchema>::name();
                schemas.push((name.into(), <$object as utoipa::PartialSchema>::schema()));
            }
        }
    };
}

/// The kinds that are meant if the word is left out: union, field of the word, word, schema of the kind.
const KINDS_BY_DEFAULT: [[&str; 4]; 2] =
    [["WaveGenerator", "kind", "ellipse", "WaveGeneratorEllipse"], ["Teeth", "shape", "cylinder", "TeethCylinder"]];

/// Marks the kinds in the API document whose word may be left out. Generators read no discriminator that a kind may lack, so
/// these unions have none.
pub fn put_default_kinds(schemas: &mut Value) {
    for [union, tag, word, kind] in KINDS_BY_DEFAULT {
        schemas[kind]["properties"][tag]["default"] = json!(word);
        let of_kind = schemas[kind]["required"].as_array_mut();
        of_kind.into_iter().for_each(|required| required.retain(|name| name != tag));
        schemas[union].as_object_mut().and_then(|union| union.remove("discriminator"));
    }
}
