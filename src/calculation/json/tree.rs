//! A JSON document as a tree, whose fields keep their order.

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Serialize, de};

use crate::field::FieldError;

/// A JSON value, parsed or constructed. Documents are read from it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
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
    Object(#[serde(serialize_with = "as_map")] Vec<(String, Self)>),
}

/// Returns the index that a name means. RFC 6901 forbids signs and leading zeros, so each item has one name.
fn item(name: &str) -> Option<usize> {
    let is_digits = name.bytes().all(|byte| byte.is_ascii_digit());
    if is_digits && (name == "0" || !name.starts_with('0')) { name.parse().ok() } else { None }
}

fn as_map<S: serde::Serializer>(fields: &[(String, Tree)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(fields.iter().map(|(name, value)| (name, value)))
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

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TreeVisitor)
    }
}

struct TreeVisitor;

impl<'de> Visitor<'de> for TreeVisitor {
    type Value = Tree;

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
    /// Deserializes the tree.
    pub fn read<'de, T: Deserialize<'de>>(&self) -> Result<T, FieldError> {
        T::deserialize(self)
    }

    /// Returns the value at a path of field names.
    pub fn at(&self, path: &[impl AsRef<str>]) -> Option<&Self> {
        path.iter().try_fold(self, |tree, name| match tree {
            Self::Object(fields) => fields.iter().find(|(key, _)| key == name.as_ref()).map(|(_, value)| value),
            Self::Array(items) => items.get(item(name.as_ref())?),
            _ => None,
        })
    }

    /// Sets the value at a path. Missing objects on the path are created.
    pub fn set(&mut self, path: &[impl AsRef<str>], value: Self) {
        let Some((name, rest)) = path.split_first() else {
            *self = value;
            return;
        };
        let name = name.as_ref();
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
            fields.push((name.to_owned(), Self::Null));
            fields.len() - 1
        });
        fields[index].1.set(rest, value);
    }

    /// Removes the value at a path.
    pub fn remove(&mut self, path: &[impl AsRef<str>]) -> Option<Self> {
        let Self::Object(fields) = self else { return None };
        let (name, rest) = path.split_first()?;
        let index = fields.iter().position(|(key, _)| key == name.as_ref())?;
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

    /// Sorts all fields by name, so that equal trees have equal bytes.
    pub fn sort(&mut self) {
        match self {
            Self::Object(fields) => {
                fields.iter_mut().for_each(|(_, value)| value.sort());
                fields.sort_by(|(one, _), (other, _)| one.cmp(other));
            }
            Self::Array(items) => items.iter_mut().for_each(Self::sort),
            Self::Null | Self::Bool(_) | Self::Number(_) | Self::Text(_) => {}
        }
    }
}
