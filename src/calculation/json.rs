//! From JSON text to wire types, with faults that name a code and a place.
//!
//! serde_json alone would take an array for an object, keep no place, and tell kinds of fault apart only by their text. So
//! the text becomes a tree first (no JSON: the first kind of fault), and the tree feeds serde through a deserializer whose error is a
//! [`Fault`].

use serde::de::{self, IntoDeserializer, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};

use crate::field::FieldCode;

/// Why a text is no document of the wanted form.
#[derive(Debug, Clone, PartialEq)]
pub enum ReadError {
    /// The text is no JSON.
    Malformed {
        /// What the parser says, with line and column.
        detail: String,
    },
    /// It is JSON of another form.
    Fault(Fault),
}

/// A structural fault: the first one found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// JSON pointer to the field.
    pub pointer: String,
    /// Kind of fault.
    pub code: FieldCode,
    /// What is wrong and what would be right.
    pub detail: String,
}

/// What some editors begin a UTF-8 text with; RFC 8259 lets a reader ignore it.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Reads a document.
///
/// # Errors
/// See [`ReadError`].
pub fn read<'de, T: Deserialize<'de>>(text: &[u8]) -> Result<T, ReadError> {
    tree(text)?.read().map_err(ReadError::Fault)
}

/// Reads the tree of a text, whatever it is.
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
        return Err(ReadError::Malformed { detail: "nothing was sent; send a design document".into() });
    }
    let mut parser = serde_json::Deserializer::from_slice(text);
    let tree: Tree = serde_path_to_error::deserialize(&mut parser).map_err(|error| {
        // serde_json takes a number beyond the doubles and deep nesting for bad syntax; they are JSON all the same, if the rest is.
        let fault = match error.inner().to_string() {
            text if text.starts_with("number out of range") => {
                Some((FieldCode::NumberTooLarge, "the number is beyond what a double can hold"))
            }
            text if text.starts_with("recursion limit exceeded") => {
                Some((FieldCode::WrongType, "no document nests as deep as this"))
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
            (_, Err(malformed)) => ReadError::Malformed { detail: malformed.to_string() },
            (None, Ok(_)) => ReadError::Malformed { detail: error.inner().to_string() },
        }
    })?;
    parser.end().map_err(|error| ReadError::Malformed { detail: error.to_string() })?;
    Ok(tree)
}

/// A word of the API, as JSON spells it.
pub fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| Some(value.as_str()?.to_owned())).unwrap_or_default()
}

/// JSON as it stands in a text, or as it is put together: what documents are read from.
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
    /// An object, its fields in the order in which they stand.
    Object(Vec<(String, Self)>),
}

/// Which item of an array a name means: RFC 6901 knows neither a sign nor a leading zero, so that each item has one name.
fn item(name: &str) -> Option<usize> {
    let is_digits = name.bytes().all(|byte| byte.is_ascii_digit());
    if is_digits && (name == "0" || !name.starts_with('0')) { name.parse().ok() } else { None }
}

impl Tree {
    /// What the tree holds.
    ///
    /// # Errors
    /// The first structural fault.
    pub fn read<'de, T: Deserialize<'de>>(&self) -> Result<T, Fault> {
        T::deserialize(self)
    }

    /// What stands at a place, of which the path names the fields.
    pub fn at(&self, path: &[String]) -> Option<&Self> {
        path.iter().try_fold(self, |tree, name| match tree {
            Self::Object(fields) => fields.iter().find(|(key, _)| key == name).map(|(_, value)| value),
            Self::Array(items) => items.get(item(name)?),
            _ => None,
        })
    }

    /// Puts a value at a place, in objects that are made where there are none.
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

    /// Takes away what stands at a place.
    pub fn remove(&mut self, path: &[String]) -> Option<Self> {
        let Self::Object(fields) = self else { return None };
        let (name, rest) = path.split_first()?;
        let index = fields.iter().position(|(key, _)| key == name)?;
        if rest.is_empty() { Some(fields.remove(index).1) } else { fields[index].1.remove(rest) }
    }

    /// About what the tree takes in memory.
    pub fn bytes(&self) -> usize {
        let below: usize = match self {
            Self::Null | Self::Bool(_) | Self::Number(_) => 0,
            Self::Text(text) => text.len(),
            Self::Array(items) => items.iter().map(Self::bytes).sum(),
            Self::Object(fields) => fields.iter().map(|(name, value)| FIELD_BYTES + name.len() + value.bytes()).sum(),
        };
        size_of::<Self>() + below
    }

    /// The same with the fields of every object by name, so that equal trees are equal bytes.
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

/// What a field's name takes beside its letters: the string itself, and what its allocation costs.
const FIELD_BYTES: usize = size_of::<String>() + 16;

/// As deep as JSON is read: what walks through a tree does so level by level on its stack.
const MOST_LEVELS: usize = 128;

/// The names that a JSON pointer (RFC 6901) goes through; none where it is no pointer, or leads deeper than any document is.
pub fn path(pointer: &str) -> Option<Vec<String>> {
    let names = pointer.strip_prefix('/')?.split('/');
    if names.clone().nth(MOST_LEVELS).is_some() {
        return None;
    }
    Some(names.map(|name| name.replace("~1", "/").replace("~0", "~")).collect())
}

/// Name of the newtype that a tree gives its arrays to as well.
pub(crate) const ANY: &str = "any tree";

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(ANY, TreeVisitor)
    }
}

struct TreeVisitor;

impl<'de> Visitor<'de> for TreeVisitor {
    type Value = Tree;

    /// What other formats than trees do with a newtype.
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
        // -0.0 means nothing else than 0.0, and must not be told from it.
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
        // An object of one field would take as much as one of four.
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
            // What is read field by field would take an array for its fields in order.
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

    /// A word, or one of several kinds of object, which a field tells apart: those are enums named `by:` and the field, and perhaps `=` and
    /// the kind that is meant where the field is left out.
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
    /// A field that was read already.
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
            return Err(de::Error::custom("a value was asked for before its key"));
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

/// An object of a kind that one of its fields names.
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
    /// The same fault seen from the object that holds it under `key`.
    pub fn within(mut self, key: &str) -> Self {
        self.pointer.insert_str(0, &format!("/{}", escaped(key)));
        self
    }

    /// A fault of a field, seen from the object that holds it.
    pub fn of_field(code: FieldCode, field: &str, detail: String) -> Self {
        Self { pointer: format!("/{}", escaped(field)), code, detail }
    }
}

/// A key as a JSON pointer spells it (RFC 6901).
fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// Names one after the other.
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
            // serde's derive names the Rust type here; its reader knows only objects.
            name if name.starts_with("struct ") => "an object".into(),
            name => name,
        };
        Self::custom(format_args!("{expected} is wanted here, not {found}"))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        let known = if known.is_empty() { "no other".into() } else { listed(known) };
        let detail = format!("the document knows no field `{field}` here; it knows {known}");
        Self::of_field(FieldCode::UnknownField, field, detail)
    }

    fn missing_field(field: &'static str) -> Self {
        Self::of_field(FieldCode::MissingField, field, format!("the field `{field}` is required here"))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self::of_field(FieldCode::DuplicateField, field, format!("the field `{field}` stands here twice"))
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        Self {
            pointer: String::new(),
            code: FieldCode::UnknownChoice,
            detail: format!("`{word}` is no choice here; choose one of {}", listed(known)),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.pointer, self.detail)
    }
}

impl std::error::Error for Fault {}
