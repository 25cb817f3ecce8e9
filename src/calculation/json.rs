//! Parser from JSON text to document types, with errors that name a code and a place.
//!
//! serde_json alone accepts an array for an object, keeps no place, and has no kinds of error. So the text first
//! becomes a tree (malformed JSON fails here). The tree then feeds serde through a deserializer with the error type
//! [`Fault`].

use serde::de::{self, IntoDeserializer, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};

use crate::field::FieldCode;

/// Reason why a text is not a document of the expected form.
#[derive(Debug, Clone, PartialEq)]
pub enum ReadError {
    /// The text is not JSON.
    Malformed {
        /// Message of the parser, with line and column.
        detail: String,
    },
    /// The JSON has another form.
    Fault(Fault),
}

/// A structural error: the first one in the document.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// JSON pointer to the field.
    pub pointer: String,
    /// Kind of error.
    pub code: FieldCode,
    /// Message: what is wrong and what to do.
    pub detail: String,
}

/// Byte order mark of some editors. RFC 8259 allows a reader to ignore it.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Reads a document.
///
/// # Errors
/// See [`ReadError`].
pub fn read<'de, T: Deserialize<'de>>(text: &[u8]) -> Result<T, ReadError> {
    tree(text)?.read().map_err(ReadError::Fault)
}

/// Parses a text to a tree.
///
/// # Errors
/// See [`ReadError`].
pub fn tree(text: &[u8]) -> Result<Tree, ReadError> {
    if matches!(text, [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [0, _, ..] | [_, 0, ..]) {
        // In UTF-16 every ASCII letter has a byte that is zero.
        let detail =
            "the document is UTF-16; save it as UTF-8 (in Windows PowerShell `| Out-File -Encoding utf8`, not `>`)";
        return Err(ReadError::Malformed { detail: detail.into() });
    }
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    if text.trim_ascii().is_empty() {
        return Err(ReadError::Malformed { detail: "the body is empty. Send a design document".into() });
    }
    let mut parser = serde_json::Deserializer::from_slice(text);
    let tree: Tree = serde_path_to_error::deserialize(&mut parser).map_err(|error| {
        // serde_json reports a number beyond doubles, or deep nesting, as bad syntax. If the rest is valid, the text is
        // JSON.
        let fault = match error.inner().to_string() {
            text if text.starts_with("number out of range") => {
                Some((FieldCode::NumberTooLarge, "the number is too large for a double. Use a smaller one"))
            }
            text if text.starts_with("recursion limit exceeded") => {
                Some((FieldCode::WrongType, "the document has too many nested levels. Remove some"))
            }
            _ => None,
        };
        match (fault, serde_json::from_slice::<de::IgnoredAny>(text)) {
            (Some((code, detail)), Ok(_)) => {
                let pointer = error.path().iter().filter_map(|segment| match segment {
                    serde_path_to_error::Segment::Map { key } => Some(format!("/{}", escaped(key))),
                    serde_path_to_error::Segment::Seq { index } => Some(format!("/{index}")),
                    _ => None,
                });
                ReadError::Fault(Fault { pointer: pointer.collect(), code, detail: detail.into() })
            }
            (_, Err(malformed)) => {
                ReadError::Malformed { detail: format!("{malformed}. Send one complete JSON document") }
            }
            (None, Ok(_)) => ReadError::Malformed { detail: error.inner().to_string() },
        }
    })?;
    parser.end().map_err(|error| ReadError::Malformed { detail: error.to_string() })?;
    Ok(tree)
}

/// Returns a word of the API, as in JSON.
pub fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| Some(value.as_str()?.to_owned())).unwrap_or_default()
}

/// A JSON value, parsed or constructed. Documents are read from it.
#[derive(Debug, Clone, PartialEq)]
pub enum Tree {
    /// `null`.
    Null,
    /// `true` or `false`.
    Bool(bool),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// An array.
    Array(Vec<Self>),
    /// An object with its fields in order.
    Object(Vec<(String, Self)>),
}

/// Returns the index that a name means. RFC 6901 forbids signs and leading zeros, so each item has one name.
fn item(name: &str) -> Option<usize> {
    let is_digits = name.bytes().all(|byte| byte.is_ascii_digit());
    if is_digits && (name == "0" || !name.starts_with('0')) { name.parse().ok() } else { None }
}

impl Tree {
    /// Deserializes the tree.
    ///
    /// # Errors
    /// The first structural error.
    pub fn read<'de, T: Deserialize<'de>>(&self) -> Result<T, Fault> {
        T::deserialize(self)
    }

    /// Returns the value at a path of field names.
    pub fn at(&self, path: &[String]) -> Option<&Self> {
        path.iter().try_fold(self, |tree, name| match tree {
            Self::Object(fields) => fields.iter().find(|(key, _)| key == name).map(|(_, value)| value),
            Self::Array(items) => items.get(item(name)?),
            _ => None,
        })
    }

    /// Sets the value at a path. Missing objects on the path are created.
    pub fn set(&mut self, path: &[String], value: Self) {
        let Some((name, rest)) = path.split_first() else {
            *self = value;
            return;
        };
        if let Self::Array(items) = self
            && let Some(item) = item(name).and_then(|index| items.get_mut(index))
        {
            item.set(rest, value);
            return;
        }
        if !matches!(self, Self::Object(_)) {
            *self = Self::Object(Vec::new());
        }
        let Self::Object(fields) = self else { return };
        let index = fields.iter().position(|(key, _)| key == name).unwrap_or_else(|| {
            fields.push((name.clone(), Self::Null));
            fields.len() - 1
        });
        fields[index].1.set(rest, value);
    }

    /// Removes the value at a path.
    pub fn remove(&mut self, path: &[String]) -> Option<Self> {
        let Self::Object(fields) = self else { return None };
        let (name, rest) = path.split_first()?;
        let index = fields.iter().position(|(key, _)| key == name)?;
        if rest.is_empty() { Some(fields.remove(index).1) } else { fields[index].1.remove(rest) }
    }

    /// Estimated memory in bytes.
    pub fn bytes(&self) -> usize {
        let below: usize = match self {
            Self::Null | Self::Bool(_) | Self::Number(_) => 0,
            Self::Text(text) => text.len(),
            Self::Array(items) => items.iter().map(Self::bytes).sum(),
            Self::Object(fields) => fields.iter().map(|(name, value)| FIELD_BYTES + name.len() + value.bytes()).sum(),
        };
        size_of::<Self>() + below
    }

    /// Returns the tree with all fields sorted by name, so that equal trees have equal bytes.
    pub fn sorted(mut self) -> Self {
        match &mut self {
            Self::Object(fields) => {
                for (_, value) in fields.iter_mut() {
                    *value = std::mem::replace(value, Self::Null).sorted();
                }
                fields.sort_by(|(one, _), (other, _)| one.cmp(other));
            }
            Self::Array(items) => {
                for item in items {
                    *item = std::mem::replace(item, Self::Null).sorted();
                }
            }
            Self::Null | Self::Bool(_) | Self::Number(_) | Self::Text(_) => {}
        }
        self
    }
}

impl Serialize for Tree {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Null => serializer.serialize_unit(),
            Self::Bool(value) => serializer.serialize_bool(*value),
            Self::Number(value) => serializer.serialize_f64(*value),
            Self::Text(value) => serializer.serialize_str(value),
            Self::Array(items) => serializer.collect_seq(items),
            Self::Object(fields) => serializer.collect_map(fields.iter().map(|(name, value)| (name, value))),
        }
    }
}

/// Bytes of a field name in addition to its letters: the string and its allocation.
const FIELD_BYTES: usize = size_of::<String>() + 16;

/// Deepest path. Walking a tree is recursive, so the depth is limited, as in serde_json.
const MOST_LEVELS: usize = 128;

/// Returns the names of a JSON pointer (RFC 6901), or none if it is invalid or too deep.
pub fn path(pointer: &str) -> Option<Vec<String>> {
    let names = pointer.strip_prefix('/')?.split('/');
    if names.clone().nth(MOST_LEVELS).is_some() {
        return None;
    }
    Some(names.map(|name| name.replace("~1", "/").replace("~0", "~")).collect())
}

/// Name of a newtype for which a tree also accepts arrays.
pub(crate) const ANY: &str = "any tree";

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(ANY, TreeVisitor)
    }
}

struct TreeVisitor;

impl<'de> Visitor<'de> for TreeVisitor {
    type Value = Tree;

    /// Other formats pass their newtypes here.
    fn visit_newtype_struct<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<Tree, D::Error> {
        deserializer.deserialize_any(self)
    }

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Tree, E> {
        Ok(Tree::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Tree, E> {
        Ok(Tree::Bool(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Tree, E> {
        Ok(Tree::Number(value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Tree, E> {
        Ok(Tree::Number(value as f64))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Tree, E> {
        // -0.0 is the same value as 0.0 and must have the same hash.
        Ok(Tree::Number(value + 0.0))
    }

    fn visit_str<E>(self, value: &str) -> Result<Tree, E> {
        Ok(Tree::Text(value.to_owned()))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, mut items: A) -> Result<Tree, A::Error> {
        let mut trees = Vec::new();
        while let Some(tree) = items.next_element()? {
            trees.push(tree);
        }
        trees.shrink_to_fit();
        Ok(Tree::Array(trees))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Tree, A::Error> {
        let mut fields = Vec::new();
        while let Some(entry) = entries.next_entry()? {
            fields.push(entry);
        }
        // Otherwise an object with one field has the capacity of four.
        fields.shrink_to_fit();
        Ok(Tree::Object(fields))
    }
}

impl Tree {
    fn unexpected(&self) -> Unexpected<'_> {
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
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self {
            Tree::Null => visitor.visit_unit(),
            Tree::Bool(value) => visitor.visit_bool(*value),
            Tree::Number(value) => visitor.visit_f64(*value),
            Tree::Text(value) => visitor.visit_str(value),
            Tree::Object(fields) => visitor.visit_map(Fields::new(fields, None)),
            // A type that is read field by field would accept an array as its fields in order.
            Tree::Array(_) => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self {
            Tree::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self {
            Tree::Array(items) => visitor.visit_seq(Items { items: items.iter().enumerate() }),
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
    ) -> Result<V::Value, Fault> {
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

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, Fault> {
        match self {
            Tree::Array(items) if name == ANY => visitor.visit_seq(Items { items: items.iter().enumerate() }),
            _ if name == ANY => self.deserialize_any(visitor),
            _ => visitor.visit_newtype_struct(self),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct tuple
        tuple_struct map struct identifier ignored_any
    }
}

struct Fields<'a> {
    fields: std::slice::Iter<'a, (String, Tree)>,
    /// Name of a field that was read already.
    passed_over: Option<&'a str>,
    current: Option<&'a (String, Tree)>,
}

impl<'a> Fields<'a> {
    fn new(fields: &'a [(String, Tree)], passed_over: Option<&'a str>) -> Self {
        Self { fields: fields.iter(), passed_over, current: None }
    }
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = Fault;

    fn next_key_seed<K: de::DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Fault> {
        self.current = self.fields.find(|(key, _)| Some(key.as_str()) != self.passed_over);
        self.current.map(|(key, _)| seed.deserialize(key.as_str().into_deserializer())).transpose()
    }

    fn next_value_seed<S: de::DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, Fault> {
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
    type Error = Fault;

    fn next_element_seed<S: de::DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Fault> {
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
    type Error = Fault;
    type Variant = Self;

    fn variant_seed<S: de::DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), Fault> {
        let mut tags = self.fields.iter().filter(|(key, _)| key == self.tag).map(|(_, value)| value);
        let kind = match (tags.next(), self.by_default) {
            (Some(Tree::Text(word)), _) => word.as_str(),
            (Some(other), _) => {
                let fault: Fault = de::Error::invalid_type(other.unexpected(), &"a word");
                return Err(fault.within(self.tag));
            }
            (None, Some(by_default)) => by_default,
            (None, None) => return Err(de::Error::missing_field(self.tag)),
        };
        if tags.next().is_some() {
            return Err(de::Error::duplicate_field(self.tag));
        }
        let deserializer: de::value::StrDeserializer<'_, Fault> = kind.into_deserializer();
        Ok((seed.deserialize(deserializer).map_err(|fault| fault.within(self.tag))?, self))
    }
}

impl<'de> de::VariantAccess<'de> for Union<'_> {
    type Error = Fault;

    fn newtype_variant_seed<S: de::DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, Fault> {
        seed.deserialize(de::value::MapAccessDeserializer::new(Fields::new(self.fields, Some(self.tag))))
    }

    fn unit_variant(self) -> Result<(), Fault> {
        Err(de::Error::invalid_type(Unexpected::Map, &"a word"))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Fault> {
        Err(de::Error::invalid_type(Unexpected::Map, &visitor))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_map(Fields::new(self.fields, Some(self.tag)))
    }
}

impl Fault {
    /// Returns the same error, seen from the object that has it under `key`.
    pub fn within(mut self, key: &str) -> Self {
        self.pointer.insert_str(0, &format!("/{}", escaped(key)));
        self
    }

    /// Makes the error of a field, seen from its object.
    pub fn of_field(code: FieldCode, field: &str, detail: String) -> Self {
        Self { pointer: format!("/{}", escaped(field)), code, detail }
    }
}

/// Escapes a key for a JSON pointer (RFC 6901).
fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// Joins names by commas.
fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

impl de::Error for Fault {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self { pointer: String::new(), code: FieldCode::WrongType, detail: message.to_string() }
    }

    fn invalid_type(unexpected: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        let found = match unexpected {
            Unexpected::Unit => "null".into(),
            Unexpected::Seq => "an array".into(),
            Unexpected::Map => "an object".into(),
            Unexpected::Float(value) => format!("the number {value}"),
            Unexpected::Str(value) => format!("the text {value:?}"),
            other => other.to_string(),
        };
        let expected = match expected.to_string() {
            name if name == "f64" => "a number".into(),
            // serde's derive gives the Rust type here. Readers of the message know only objects.
            name if name.starts_with("struct ") => "an object".into(),
            name => name,
        };
        Self::custom(format_args!("the value is {found}, but {expected} is expected here"))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        let known = if known.is_empty() { "no other".into() } else { listed(known) };
        let detail = format!("the field `{field}` is unknown here. Use: {known}");
        Self::of_field(FieldCode::UnknownField, field, detail)
    }

    fn missing_field(field: &'static str) -> Self {
        Self::of_field(FieldCode::MissingField, field, format!("the field `{field}` is required here"))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self::of_field(FieldCode::DuplicateField, field, format!("the field `{field}` is given twice. Remove one"))
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        Self {
            pointer: String::new(),
            code: FieldCode::UnknownChoice,
            detail: format!("`{word}` is not a valid choice here. Use one of: {}", listed(known)),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.pointer, self.detail)
    }
}

impl std::error::Error for Fault {}
