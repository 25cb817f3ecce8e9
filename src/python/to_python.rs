//! Conversion of answers to Python objects. A JSON object becomes a `dict`, a string a `str`, a list a `list`.
//! A list of numbers becomes a NumPy array.

use std::fmt::Display;

use pyo3::IntoPyObjectExt as _;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use serde::Serialize;
use serde::ser::{self, Impossible, SerializeMap, SerializeSeq, SerializeStruct, SerializeTuple, Serializer};

use crate::column::Column;

/// Returns a value as a Python object, without the field `skipped` of the outermost object.
pub(crate) fn object<'py>(
    py: Python<'py>,
    value: &impl Serialize,
    skipped: Option<&'static str>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(value.serialize(ToPython { py, skipped })?.object(py)?)
}

#[derive(Clone, Copy)]
struct ToPython<'py> {
    py: Python<'py>,
    skipped: Option<&'static str>,
}

/// A converted value. Numbers become Python objects only if they are not part of a column.
enum Made<'py> {
    Number(f64),
    Count(i64),
    Flag(bool),
    Object(Bound<'py, PyAny>),
}

impl<'py> Made<'py> {
    fn object(self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failed> {
        Ok(match self {
            Self::Number(number) => number.into_bound_py_any(py)?,
            Self::Count(count) => count.into_bound_py_any(py)?,
            Self::Flag(flag) => flag.into_bound_py_any(py)?,
            Self::Object(object) => object,
        })
    }
}

/// An exception raised by Python.
#[derive(Debug)]
struct Failed(PyErr);

impl Display for Failed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Failed {}

impl ser::Error for Failed {
    fn custom<T: Display>(text: T) -> Self {
        Self(pyo3::exceptions::PyRuntimeError::new_err(text.to_string()))
    }
}

impl From<PyErr> for Failed {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

impl From<Failed> for PyErr {
    fn from(Failed(error): Failed) -> Self {
        error
    }
}

type Result<T, E = Failed> = std::result::Result<T, E>;

fn in_no_answer<T>(what: &str) -> Result<T> {
    Err(ser::Error::custom(format_args!("cannot convert {what} to Python")))
}

impl<'py> Serializer for ToPython<'py> {
    type Ok = Made<'py>;
    type Error = Failed;
    type SerializeSeq = Items<'py>;
    type SerializeTuple = Items<'py>;
    type SerializeTupleStruct = Impossible<Made<'py>, Failed>;
    type SerializeTupleVariant = Impossible<Made<'py>, Failed>;
    type SerializeMap = Fields<'py>;
    type SerializeStruct = Fields<'py>;
    type SerializeStructVariant = Impossible<Made<'py>, Failed>;

    fn serialize_bool(self, value: bool) -> Result<Made<'py>> {
        Ok(Made::Flag(value))
    }

    fn serialize_i8(self, value: i8) -> Result<Made<'py>> {
        Ok(Made::Count(value.into()))
    }

    fn serialize_i16(self, value: i16) -> Result<Made<'py>> {
        Ok(Made::Count(value.into()))
    }

    fn serialize_i32(self, value: i32) -> Result<Made<'py>> {
        Ok(Made::Count(value.into()))
    }

    fn serialize_i64(self, value: i64) -> Result<Made<'py>> {
        Ok(Made::Count(value))
    }

    fn serialize_u8(self, value: u8) -> Result<Made<'py>> {
        Ok(Made::Count(value.into()))
    }

    fn serialize_u16(self, value: u16) -> Result<Made<'py>> {
        Ok(Made::Count(value.into()))
    }

    fn serialize_u32(self, value: u32) -> Result<Made<'py>> {
        Ok(Made::Count(value.into()))
    }

    fn serialize_u64(self, value: u64) -> Result<Made<'py>> {
        i64::try_from(value).map(Made::Count).map_err(ser::Error::custom)
    }

    fn serialize_f32(self, value: f32) -> Result<Made<'py>> {
        Ok(Made::Number(value.into()))
    }

    fn serialize_f64(self, value: f64) -> Result<Made<'py>> {
        Ok(Made::Number(value))
    }

    fn serialize_char(self, value: char) -> Result<Made<'py>> {
        self.serialize_str(value.encode_utf8(&mut [0; 4]))
    }

    fn serialize_str(self, value: &str) -> Result<Made<'py>> {
        Ok(Made::Object(PyString::new(self.py, value).into_any()))
    }

    fn serialize_bytes(self, _: &[u8]) -> Result<Made<'py>> {
        in_no_answer("bytes")
    }

    fn serialize_none(self) -> Result<Made<'py>> {
        Ok(Made::Object(self.py.None().into_bound(self.py)))
    }

    fn serialize_some<T: ?Sized + Serialize>(self, value: &T) -> Result<Made<'py>> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<Made<'py>> {
        self.serialize_none()
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<Made<'py>> {
        self.serialize_none()
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, variant: &'static str) -> Result<Made<'py>> {
        self.serialize_str(variant)
    }

    fn serialize_newtype_struct<T: ?Sized + Serialize>(self, _: &'static str, value: &T) -> Result<Made<'py>> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: ?Sized + Serialize>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<Made<'py>> {
        let mut fields = self.serialize_map(None)?;
        SerializeStruct::serialize_field(&mut fields, variant, value)?;
        SerializeStruct::end(fields)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Items<'py>> {
        Ok(Items { py: self.py, length: length.unwrap_or_default(), list: List::Empty })
    }

    fn serialize_tuple(self, length: usize) -> Result<Items<'py>> {
        self.serialize_seq(Some(length))
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self::SerializeTupleStruct> {
        in_no_answer("tuples with a name")
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self::SerializeTupleVariant> {
        in_no_answer("tuples with a name")
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Fields<'py>> {
        Ok(Fields { py: self.py, dict: PyDict::new(self.py), name: None, skipped: self.skipped })
    }

    fn serialize_struct(self, _: &'static str, length: usize) -> Result<Fields<'py>> {
        self.serialize_map(Some(length))
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self::SerializeStructVariant> {
        in_no_answer("enum variants with fields")
    }
}

/// A list under construction.
struct Items<'py> {
    py: Python<'py>,
    length: usize,
    list: List<'py>,
}

enum List<'py> {
    Empty,
    Numbers(Vec<f64>),
    Counts(Vec<i64>),
    Flags(Vec<bool>),
    Objects(Vec<Bound<'py, PyAny>>),
}

impl<'py> Items<'py> {
    fn push(&mut self, item: Made<'py>) -> Result<()> {
        fn first<T>(length: usize, item: T) -> Vec<T> {
            let mut list = Vec::with_capacity(length);
            list.push(item);
            list
        }
        match (&mut self.list, item) {
            (List::Numbers(list), Made::Number(number)) => list.push(number),
            (List::Counts(list), Made::Count(count)) => list.push(count),
            (List::Flags(list), Made::Flag(flag)) => list.push(flag),
            (List::Objects(list), item) => list.push(item.object(self.py)?),
            (List::Empty, Made::Number(number)) => self.list = List::Numbers(first(self.length, number)),
            (List::Empty, Made::Count(count)) => self.list = List::Counts(first(self.length, count)),
            (List::Empty, Made::Flag(flag)) => self.list = List::Flags(first(self.length, flag)),
            (List::Empty, Made::Object(object)) => self.list = List::Objects(first(self.length, object)),
            _ => return in_no_answer("a list that mixes numbers and other values"),
        }
        Ok(())
    }

    fn finish(self) -> Result<Made<'py>> {
        let py = self.py;
        let object = match self.list {
            List::Empty => PyList::empty(py).into_any(),
            List::Objects(list) => PyList::new(py, list)?.into_any(),
            List::Numbers(numbers) => Column::of(numbers).array(py)?,
            List::Counts(counts) => Column::of(counts).array(py)?,
            List::Flags(flags) => Column::of(flags).array(py)?,
        };
        Ok(Made::Object(object))
    }
}

impl<'py> SerializeSeq for Items<'py> {
    type Ok = Made<'py>;
    type Error = Failed;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<()> {
        let item = value.serialize(ToPython { py: self.py, skipped: None })?;
        self.push(item)
    }

    fn end(self) -> Result<Made<'py>> {
        self.finish()
    }
}

impl<'py> SerializeTuple for Items<'py> {
    type Ok = Made<'py>;
    type Error = Failed;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<()> {
        SerializeSeq::serialize_element(self, value)
    }

    fn end(self) -> Result<Made<'py>> {
        self.finish()
    }
}

/// A `dict` under construction.
struct Fields<'py> {
    py: Python<'py>,
    dict: Bound<'py, PyDict>,
    /// Name of the next value.
    name: Option<Bound<'py, PyAny>>,
    skipped: Option<&'static str>,
}

impl<'py> SerializeMap for Fields<'py> {
    type Ok = Made<'py>;
    type Error = Failed;

    fn serialize_key<T: ?Sized + Serialize>(&mut self, key: &T) -> Result<()> {
        self.name = Some(key.serialize(ToPython { py: self.py, skipped: None })?.object(self.py)?);
        Ok(())
    }

    fn serialize_value<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<()> {
        let value = value.serialize(ToPython { py: self.py, skipped: None })?.object(self.py)?;
        match self.name.take() {
            Some(name) => Ok(self.dict.set_item(name, value)?),
            None => in_no_answer("a value without a name"),
        }
    }

    fn end(self) -> Result<Made<'py>> {
        Ok(Made::Object(self.dict.into_any()))
    }
}

impl<'py> SerializeStruct for Fields<'py> {
    type Ok = Made<'py>;
    type Error = Failed;

    fn serialize_field<T: ?Sized + Serialize>(&mut self, name: &'static str, value: &T) -> Result<()> {
        if self.skipped == Some(name) {
            return Ok(());
        }
        self.name = Some(PyString::new(self.py, name).into_any());
        SerializeMap::serialize_value(self, value)
    }

    fn end(self) -> Result<Made<'py>> {
        SerializeMap::end(self)
    }
}
