//! The native part of the Python package `toothwave`: reads documents, returns Python objects and NumPy columns.
//!
//! Computations release Python's global lock. The package's Python code adds data frames and executors.

mod answer;
mod column;
mod study;
mod to_python;

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use toothwave_calculation::json;
use toothwave_calculation::no_answer::NoAnswer;

/// The allocator of the service, which reuses freed memory for a sweep's columns.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

create_exception!(
    toothwave,
    Problem,
    PyValueError,
    "Reason why a document has no answer: `code`, `detail`, and `errors`, each with the JSON `pointer` of a field."
);
create_exception!(
    toothwave,
    PartError,
    PyValueError,
    "A part of a study is damaged, or belongs to another build or another study."
);

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::answer::{Answer, ask};
    #[pymodule_export]
    use super::column::Column;
    #[pymodule_export]
    use super::study::{Folder, Gathered, Study};
    #[pymodule_export]
    use super::{PartError, Problem};

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's spelling")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}

/// Returns the reason as a Python exception.
fn raised(py: Python<'_>, no_answer: NoAnswer) -> PyErr {
    let error = Problem::new_err(no_answer.to_string());
    let NoAnswer { code, detail, errors } = no_answer;
    let value = error.value(py);
    let told = value
        .setattr("code", json::word(&code))
        .and_then(|()| value.setattr("detail", detail))
        .and_then(|()| value.setattr("errors", to_python::object(py, &errors, None)?));
    told.err().unwrap_or(error)
}
