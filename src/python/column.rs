//! Columns of numbers for NumPy, shared without a copy.

use std::any::Any;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A column of numbers, which NumPy reads through `__array_interface__`. The array refers to this object's memory and
/// keeps the object alive.
#[pyclass(frozen, module = "toothwave._native")]
#[derive(Debug)]
pub struct Column {
    /// Owner of the numbers, which are never changed.
    _owner: Arc<dyn Any + Send + Sync>,
    address: usize,
    length: usize,
    type_word: &'static str,
}

/// Number type that NumPy supports.
pub(crate) trait Element: Send + Sync + 'static {
    /// The type in NumPy's notation.
    const TYPE_WORD: &'static str;
}

impl Element for f64 {
    const TYPE_WORD: &'static str = "<f8";
}

impl Element for i64 {
    const TYPE_WORD: &'static str = "<i8";
}

impl Element for u64 {
    const TYPE_WORD: &'static str = "<u8";
}

impl Element for u32 {
    const TYPE_WORD: &'static str = "<u4";
}

impl Element for bool {
    const TYPE_WORD: &'static str = "|b1";
}

impl Column {
    /// Makes a column of numbers that `owner` holds.
    pub(crate) fn within<E: Element>(owner: Arc<dyn Any + Send + Sync>, numbers: &[E]) -> Self {
        let address = numbers.as_ptr().expose_provenance();
        Self { _owner: owner, address, length: numbers.len(), type_word: E::TYPE_WORD }
    }

    /// Makes a column that owns its numbers.
    pub(crate) fn of<E: Element>(numbers: Vec<E>) -> Self {
        let owner = Arc::new(numbers);
        let (address, length) = (owner.as_ptr().expose_provenance(), owner.len());
        Self { _owner: owner, address, length, type_word: E::TYPE_WORD }
    }

    /// Returns the column as a NumPy array.
    pub(crate) fn array(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        py.import("numpy")?.call_method1("asarray", (self,))
    }
}

#[pymethods]
impl Column {
    /// NumPy's array interface, version 3: the address of read-only memory, the length and the type.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", (self.length,))?;
        interface.set_item("typestr", self.type_word)?;
        interface.set_item("data", (self.address, true))?;
        Ok(interface)
    }
}
