//! Reading a value from a tree, with the path of whatever is wrong.

use serde::de::{self, IntoDeserializer, MapAccess, Unexpected, Visitor};

use super::tree::Tree;
use crate::field::{FieldCode, FieldError, escaped};

impl Tree {
    /// Returns what stands here, for a message.
    pub fn unexpected(&self) -> Unexpected<'_> {
        match self {
            Self::Null => Unexpected::Unit,
            Self::Bool(value) => Unexpected::Bool(*value),
            Self::Number(value) => Unexpected::Float(*value),
            Self::Text(value) => Unexpected::Str(value),
            Self::Array(_) => Unexpected::Seq,
            Self::Object(_) => Unexpected::Map,
        }
    }
}

impl<'de> serde::Deserializer<'de> for &Tree {
    type Error = FieldError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FieldError> {
        match self {
            Tree::Null => visitor.visit_unit(),
            Tree::Bool(value) => visitor.visit_bool(*value),
            Tree::Number(value) => visitor.visit_f64(*value),
            Tree::Text(value) => visitor.visit_str(value),
            Tree::Object(fields) => visitor.visit_map(Fields::new(fields, None)),
            Tree::Array(items) => visitor.visit_seq(Items { items: items.iter().enumerate() }),
        }
    }

    /// A field may be left out but not be null, except with `or_null`.
    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FieldError> {
        visitor.visit_some(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FieldError> {
        match self {
            Tree::Array(_) => self.deserialize_any(visitor),
            _ => Err(de::Error::invalid_type(self.unexpected(), &"an array")),
        }
    }

    /// Deserializes a word, or an object with a tag field. Enums of such objects are named `by:` and the tag, and
    /// perhaps `=` and the default kind.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, FieldError> {
        match (self, name.strip_prefix("by:")) {
            (Tree::Text(value), None) => visitor.visit_enum(value.as_str().into_deserializer()),
            (Tree::Object(fields), Some(tag)) => {
                let (tag, by_default) = tag.split_once('=').map_or((tag, None), |(tag, kind)| (tag, Some(kind)));
                visitor.visit_enum(Union { tag, by_default, fields })
            }
            (_, Some(_)) => Err(de::Error::invalid_type(self.unexpected(), &"an object")),
            _ => Err(de::Error::invalid_type(self.unexpected(), &"a word")),
        }
    }

    /// A structure is an object. serde would also accept an array, as its fields in order.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, FieldError> {
        match self {
            Tree::Array(_) => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, FieldError> {
        visitor.visit_newtype_struct(self)
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct tuple
        tuple_struct map identifier ignored_any
    }
}

struct Fields<'a> {
    fields: std::slice::Iter<'a, (String, Tree)>,
    /// Name of a field that was read already.
    passed_over: Option<&'a str>,
    current: Option<&'a (String, Tree)>,
}

impl<'a> Fields<'a> {
    pub(super) fn new(fields: &'a [(String, Tree)], passed_over: Option<&'a str>) -> Self {
        Self { fields: fields.iter(), passed_over, current: None }
    }
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = FieldError;

    fn next_key_seed<K: de::DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, FieldError> {
        self.current = self.fields.find(|(key, _)| Some(key.as_str()) != self.passed_over);
        self.current.map(|(key, _)| seed.deserialize(key.as_str().into_deserializer())).transpose()
    }

    fn next_value_seed<S: de::DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, FieldError> {
        let Some((key, value)) = self.current else {
            return Err(de::Error::custom("a value was read before its key"));
        };
        seed.deserialize(value).map_err(|fault| fault.within(key))
    }
}

struct Items<'a> {
    items: std::iter::Enumerate<std::slice::Iter<'a, Tree>>,
}

impl<'de> de::SeqAccess<'de> for Items<'_> {
    type Error = FieldError;

    fn next_element_seed<S: de::DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, FieldError> {
        let item = self.items.next();
        item.map(|(index, node)| seed.deserialize(node).map_err(|fault| fault.within(&index.to_string()))).transpose()
    }
}

/// An object whose kind is in one of its fields.
#[derive(Clone, Copy)]
struct Union<'a> {
    tag: &'static str,
    by_default: Option<&'static str>,
    fields: &'a [(String, Tree)],
}

impl<'de> de::EnumAccess<'de> for Union<'_> {
    type Error = FieldError;
    type Variant = Self;

    fn variant_seed<S: de::DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), FieldError> {
        let mut tags = self.fields.iter().filter(|(key, _)| key == self.tag).map(|(_, value)| value);
        let kind = match (tags.next(), self.by_default) {
            (Some(Tree::Text(word)), _) => word.as_str(),
            (Some(other), _) => {
                let fault: FieldError = de::Error::invalid_type(other.unexpected(), &"a word");
                return Err(fault.within(self.tag));
            }
            (None, Some(by_default)) => by_default,
            (None, None) => return Err(de::Error::missing_field(self.tag)),
        };
        if tags.next().is_some() {
            return Err(de::Error::duplicate_field(self.tag));
        }
        let deserializer: de::value::StrDeserializer<'_, FieldError> = kind.into_deserializer();
        Ok((seed.deserialize(deserializer).map_err(|fault| fault.within(self.tag))?, self))
    }
}

impl Union<'_> {
    /// Reads the fields of the kind, without its word.
    fn read<T>(self, read: impl FnOnce(Fields<'_>) -> Result<T, FieldError>) -> Result<T, FieldError> {
        let has_field = |pointer: &str| self.fields.iter().any(|(key, _)| pointer == format!("/{}", escaped(key)));
        let is_named = self.fields.iter().any(|(key, _)| key == self.tag);
        read(Fields::new(self.fields, Some(self.tag))).map_err(|mut fault| {
            if fault.code == FieldCode::UnknownField && !is_named && has_field(&fault.pointer) {
                fault.detail = format!("{}. Or add the `{}` that has it", fault.detail, self.tag);
            }
            fault
        })
    }
}

impl<'de> de::VariantAccess<'de> for Union<'_> {
    type Error = FieldError;

    fn newtype_variant_seed<S: de::DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, FieldError> {
        self.read(|fields| seed.deserialize(de::value::MapAccessDeserializer::new(fields)))
    }

    fn unit_variant(self) -> Result<(), FieldError> {
        Err(de::Error::invalid_type(Unexpected::Map, &"a word"))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, FieldError> {
        Err(de::Error::invalid_type(Unexpected::Map, &visitor))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], visitor: V) -> Result<V::Value, FieldError> {
        self.read(|fields| visitor.visit_map(fields))
    }
}
