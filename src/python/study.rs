//! Studies: their chunks, parts and results.

use std::path::PathBuf;
use std::sync::Arc;

use parking_lot::Mutex;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use toothwave_calculation::question::Never;
use toothwave_study::{self as engine, Limits, PartFolder, TableColumn, Values, Work};

use crate::answer::{Answer, format_of};
use crate::column::Column;
use crate::{PartError, raised};

/// Named columns of a table.
type Columns<'py> = Vec<(String, Bound<'py, PyAny>)>;

/// A checked study.
#[pyclass(frozen, module = "toothwave._native")]
pub struct Study(Arc<engine::Study>);

#[pymethods]
impl Study {
    #[new]
    fn new(py: Python<'_>, document: &[u8], chunk_variants: Option<u64>) -> PyResult<Self> {
        let study = py.detach(|| engine::Study::read(document, &Limits::OFFLINE));
        let study = study.map_err(|no_answer| raised(py, no_answer))?;
        Ok(Self(Arc::new(match chunk_variants {
            Some(variants) => study.in_chunks_of(variants),
            None => study,
        })))
    }

    #[getter]
    fn id(&self) -> String {
        self.0.id().to_string()
    }

    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind()
    }

    #[getter]
    fn variants(&self) -> u64 {
        self.0.variants()
    }

    #[getter]
    fn chunks(&self) -> u64 {
        self.0.chunks()
    }

    /// Returns a chunk's first variant and the one after its last; `None` for a search, whose chunks are islands.
    fn span(&self, chunk: u64) -> Option<(u64, u64)> {
        let span = self.0.span_of(chunk);
        self.0.has_rows().then_some((span.start, span.end))
    }

    /// Computes a chunk and returns its part, the bytes of a Parquet file.
    fn compute<'py>(&self, py: Python<'py>, chunk: u64) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| {
            let part = Work::new(&self.0, chunk).run(&Never).map_err(|_| std::io::ErrorKind::Interrupted)?;
            self.0.part_bytes(chunk, &part)
        });
        Ok(PyBytes::new(py, &bytes?))
    }
}

/// The parts of a study computed so far.
#[pyclass(frozen, module = "toothwave._native")]
pub struct Gathered {
    study: Arc<engine::Study>,
    gathered: Mutex<engine::Gathered>,
}

#[pymethods]
impl Gathered {
    #[new]
    fn new(study: &Study) -> Self {
        Self { study: Arc::clone(&study.0), gathered: Mutex::new(engine::Gathered::new(&study.0)) }
    }

    /// Adds a part.
    fn add(&self, py: Python<'_>, chunk: u64, bytes: Vec<u8>) -> PyResult<()> {
        py.detach(|| {
            let part = self.study.read_part(chunk, bytes).map_err(|error| PartError::new_err(error.to_string()))?;
            self.gathered.lock().add(chunk, part);
            Ok(())
        })
    }

    /// Number of computed variants.
    #[getter]
    fn variants(&self) -> u64 {
        self.gathered.lock().variants()
    }

    /// Returns the chunks without a part.
    fn missing(&self) -> Vec<u64> {
        self.gathered.lock().missing().collect()
    }

    fn answer(&self, py: Python<'_>) -> Answer {
        py.detach(|| Answer::new(self.gathered.lock().answer()))
    }

    /// Returns the columns of the result's table.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        arrays(py, py.detach(|| self.gathered.lock().answer().columns()))
    }

    /// Returns the columns of the rows, one for each variant; `None` for a search.
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Option<Columns<'py>>> {
        py.detach(|| self.gathered.lock().rows_columns()).map(|columns| arrays(py, columns)).transpose()
    }

    /// Returns the rows as csv or parquet.
    fn rows_text<'py>(&self, py: Python<'py>, format: &str) -> PyResult<Bound<'py, PyBytes>> {
        let format = format_of(format)?;
        let text = py.detach(|| {
            let mut text = Vec::new();
            self.gathered.lock().write_rows(format, &mut text).map(|()| text)
        });
        Ok(PyBytes::new(py, &text?))
    }
}

fn arrays(py: Python<'_>, columns: Vec<TableColumn>) -> PyResult<Vec<(String, Bound<'_, PyAny>)>> {
    let array = |values| match values {
        Values::Counts(counts) => Column::of(counts).array(py),
        Values::Numbers(numbers) => Column::of(numbers).array(py),
        Values::Words(words) => py.import("numpy")?.call_method1("array", (words, "O")),
    };
    columns.into_iter().map(|TableColumn { name, values }| Ok((name, array(values)?))).collect()
}

/// A folder with one file for each part.
#[pyclass(frozen, module = "toothwave._native")]
pub struct Folder(PartFolder);

#[pymethods]
impl Folder {
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        Ok(Self(PartFolder::create(&path)?))
    }

    /// Returns the chunks that have a part in the folder.
    fn chunks(&self) -> PyResult<Vec<u64>> {
        Ok(self.0.chunks()?.into_iter().collect())
    }

    fn file(&self, chunk: u64) -> PathBuf {
        self.0.file(chunk)
    }

    fn read<'py>(&self, py: Python<'py>, chunk: u64) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.0.read(chunk))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn write(&self, py: Python<'_>, chunk: u64, bytes: &[u8]) -> PyResult<()> {
        Ok(py.detach(|| self.0.write(chunk, bytes))?)
    }
}
