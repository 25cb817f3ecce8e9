//! Answers to single documents.

use std::any::Any;
use std::io;
use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::drawing::preset::Preset;
use toothwave_calculation::drawing::{Drawing, DrawnPart};
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::json;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::answer::SweepAnswer;
use toothwave_calculation::sweep::{self, Sweep};

use crate::column::Column;
use crate::{raised, to_python};

/// An answer. Its Python objects are made on request.
#[pyclass(frozen, module = "toothwave._native")]
pub struct Answer(Arc<dyn Told>);

/// Operations of every answer.
trait Told: Send + Sync {
    /// Returns the answer as Python objects, a sweep without its states.
    fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;

    /// Writes the answer in a format.
    fn write(&self, format: Format) -> io::Result<Vec<u8>>;

    fn any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync>;
}

impl<A: Forms + Send + Sync> Told for A {
    fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python::object(py, self, Some("states"))
    }

    fn write(&self, format: Format) -> io::Result<Vec<u8>> {
        let mut text = Vec::with_capacity(self.expected_bytes());
        Forms::write(self, format, &mut text)?;
        Ok(text)
    }

    fn any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync> {
        self
    }
}

impl Answer {
    pub(crate) fn new(answer: impl Forms + Send + Sync) -> Self {
        Self(Arc::new(answer))
    }
}

/// Computes the answer to a design document.
#[pyfunction]
pub(crate) fn ask(py: Python<'_>, question: &str, document: &[u8]) -> PyResult<Answer> {
    fn asked<Q: Question<Answer: Send + Sync>>(question: Q, document: &[u8]) -> Result<Answer, NoAnswer> {
        question.ask(document, &Limits::OFFLINE, &toothwave_calculation::question::Never).map(Answer::new)
    }
    let drawn = |part, document| asked(Drawing { part, preset: Preset::Document }, document);
    let answer = py.detach(|| {
        Some(match question {
            "sweep" => asked(Sweep, document),
            "geometry" => asked(Geometry, document),
            "coincidence_degree" => asked(CoincidenceDegree, document),
            "ring" => drawn(DrawnPart::Ring, document),
            "wave_generator" => drawn(DrawnPart::WaveGenerator, document),
            "carrier" => drawn(DrawnPart::Carrier, document),
            "tooth" => drawn(DrawnPart::Tooth, document),
            "assembly" => drawn(DrawnPart::Assembly, document),
            _ => return None,
        })
    });
    match answer {
        Some(answer) => answer.map_err(|no_answer| raised(py, no_answer)),
        None => Err(PyValueError::new_err(format!(
            "unknown part `{question}`. Use ring, wave_generator, carrier, tooth or assembly"
        ))),
    }
}

#[pymethods]
impl Answer {
    /// Returns the answer as Python objects, its columns as NumPy arrays; a sweep without its states.
    fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.object(py)
    }

    /// Returns the bytes of the answer in a format: json, csv, arrow, parquet, text, svg, dxf or step.
    fn text<'py>(&self, py: Python<'py>, format: &str) -> PyResult<Bound<'py, PyBytes>> {
        let format = format_of(format)?;
        let text = py.detach(|| self.0.write(format))?;
        Ok(PyBytes::new(py, &text))
    }

    /// Returns the columns of a sweep's states in the order of the CSV; none for other answers.
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        let owner = Arc::clone(&self.0).any();
        let Ok(sweep) = Arc::clone(&owner).downcast::<SweepAnswer>() else { return Ok(Vec::new()) };
        let array = |column| match column {
            sweep::Column::Numbers(numbers) => Column::within(owner.clone(), numbers).array(py),
            sweep::Column::Counts(counts) => Column::within(owner.clone(), counts).array(py),
            sweep::Column::Flags(flags) => Column::within(owner.clone(), flags).array(py),
            sweep::Column::Rolls(rolls) => {
                let words: Vec<_> = rolls.iter().map(json::word).collect();
                py.import("numpy")?.call_method1("array", (words,))
            }
        };
        sweep.columns().into_iter().map(|(name, column)| Ok((name, array(column)?))).collect()
    }
}

pub(crate) fn format_of(word: &str) -> PyResult<Format> {
    Ok(match word {
        "json" => Format::Json,
        "csv" => Format::Csv,
        "arrow" => Format::Arrow,
        "parquet" => Format::Parquet,
        "text" => Format::Text,
        "svg" => Format::Svg,
        "dxf" => Format::Dxf,
        "step" => Format::Step,
        _ => {
            return Err(PyValueError::new_err(format!(
                "unknown format `{word}`. Use json, csv, arrow, parquet, text, svg, dxf or step"
            )));
        }
    })
}
