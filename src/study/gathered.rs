//! Collected parts of a study, merged to the same bits in any order of arrival.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{self, Write};
use std::sync::Arc;

use toothwave_calculation::forms::Format;

use crate::answer::StudyAnswer;
use crate::map::MapAnswer;
use crate::rows::{RowsPart, RowsParts};
use crate::search::SearchAnswer;
use crate::sensitivity::SensitivityAnswer;
use crate::study::{Kind, Part, Study};
use crate::table::{Table, TableColumn};
use crate::tolerance::ToleranceAnswer;

/// The parts of a study, added in any order.
#[derive(Debug)]
pub struct Gathered {
    study: Arc<Study>,
    /// Parts by chunk.
    parts: BTreeMap<u64, Part>,
    variants: u64,
}

impl Gathered {
    /// Makes an empty collection.
    pub fn new(study: &Arc<Study>) -> Self {
        Self { study: Arc::clone(study), parts: BTreeMap::new(), variants: 0 }
    }

    /// Adds the part of a chunk. A duplicate or unknown chunk changes nothing.
    pub fn add(&mut self, chunk: u64, mut part: Part) {
        if chunk < self.study.chunks()
            && let Entry::Vacant(place) = self.parts.entry(chunk)
        {
            part.shrink();
            self.variants += part.variants();
            place.insert(part);
        }
    }

    /// Chunks without a part.
    pub fn missing(&self) -> impl Iterator<Item = u64> {
        (0..self.study.chunks()).filter(|chunk| !self.parts.contains_key(chunk))
    }

    /// True if all chunks have a part.
    pub fn is_complete(&self) -> bool {
        self.parts.len() as u64 == self.study.chunks()
    }

    /// Number of computed variants.
    pub const fn variants(&self) -> u64 {
        self.variants
    }

    /// Returns the result of the study from the parts so far.
    pub fn answer(&self) -> StudyAnswer {
        let study = &*self.study;
        let (evaluator, is_complete) = (&study.evaluator, self.is_complete());
        match &study.kind {
            Kind::Map(map) => {
                let rows = self.rows().joined(evaluator.quantities.len());
                StudyAnswer::Map(MapAnswer::new(map, evaluator, rows, is_complete))
            }
            Kind::Search(search) => {
                let islands = self.parts.values().filter_map(|part| match part {
                    Part::Island(island) => Some(island),
                    Part::Rows(_) => None,
                });
                let answer = SearchAnswer::new(search, &study.template, evaluator, islands, is_complete);
                StudyAnswer::Search(Box::new(answer))
            }
            Kind::Sensitivity(sensitivity) => {
                let rows = self.rows().joined(evaluator.quantities.len());
                let answer = SensitivityAnswer::new(sensitivity, evaluator, &rows, is_complete);
                StudyAnswer::Sensitivity(answer)
            }
            Kind::Tolerance(tolerance) => {
                StudyAnswer::Tolerance(ToleranceAnswer::new(tolerance, evaluator, &self.rows(), is_complete))
            }
        }
    }

    /// Writes one row for each computed variant, in order; nothing for a search. Fails with `Unsupported` for a format
    /// that is no table.
    pub fn write_rows(&self, format: Format, writer: &mut dyn Write) -> io::Result<()> {
        match (self.rows_table(), format) {
            (None, _) => Ok(()),
            (Some(table), Format::Csv) => table.write_csv(writer),
            (Some(table), Format::Parquet) => table.write_parquet(writer),
            (Some(_), _) => {
                Err(io::Error::new(io::ErrorKind::Unsupported, "rows have no such format. Use CSV or Parquet"))
            }
        }
    }

    /// Returns the columns of these rows, or `None` for a search.
    pub fn rows_columns(&self) -> Option<Vec<TableColumn>> {
        Some(self.rows_table()?.into_columns())
    }

    fn rows_table(&self) -> Option<Table<'_>> {
        let nothing = RowsPart::new(self.study.quantities().len());
        let RowsParts(parts) = self.rows();
        let length = parts.iter().map(|part| part.answered.len() + part.refused.len()).sum();
        let columns = self.study.rows_table(&nothing)?.columns;
        let rows = parts.into_iter().filter_map(|part| self.study.rows_table(part)).flat_map(|table| table.rows);
        Some(Table { columns, length, rows: Box::new(rows) })
    }

    /// Returns all rows so far.
    fn rows(&self) -> RowsParts<'_> {
        let rows = self.parts.values().filter_map(|part| match part {
            Part::Rows(rows) => Some(rows),
            Part::Island(_) => None,
        });
        RowsParts(rows.collect())
    }
}
