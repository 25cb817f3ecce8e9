//! The native part of the Python package `toothwave`: documents in, Python objects and NumPy columns out.
//!
//! Python's lock is released wherever something is computed. The package's own Python code adds the interfaces of data frames and executors.

mod answer;
mod column;
mod study;
mod to_python;

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use toothwave_calculation::json;
use toothwave_calculation::no_answer::NoAnswer;

/// As in the service: a sweep's columns are taken from memory that is there already.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

create_exception!(
    toothwave,
    Problem,
    PyValueError,
    "Why a document has no answer: `code`, `detail`, and `errors`, each with the JSON `pointer` of a field."
);
create_exception!(
    toothwave,
    PartError,
    PyValueError,
    "A part of a study that is damaged, or that another build or study made."
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

/// A reason as a Python exception.
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
