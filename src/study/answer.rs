//! The answers of all kinds of study.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_calculation::forms::{Form, Format, Forms};
use utoipa::ToSchema;

use crate::map::MapAnswer;
use crate::search::SearchAnswer;
use crate::sensitivity::SensitivityAnswer;
use crate::table::{Table, TableColumn};
use crate::tolerance::ToleranceAnswer;

/// Answer of a study. It is partial while the study runs.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "study", rename_all = "snake_case")]
pub enum StudyAnswer {
    /// Answer of a map.
    Map(MapAnswer),
    /// Answer of a search.
    Search(Box<SearchAnswer>),
    /// Answer of a sensitivity study.
    Sensitivity(SensitivityAnswer),
    /// Answer of a tolerance study.
    Tolerance(ToleranceAnswer),
}

impl Forms for StudyAnswer {
    const FORMS: &'static [(Format, Form<Self>)] =
        &[(Format::Csv, Self::write_csv), (Format::Parquet, Self::write_parquet)];

    fn expected_bytes(&self) -> usize {
        match self {
            Self::Map(map) => map.expected_bytes(),
            Self::Search(search) => 4096 + 2048 * search.front.len(),
            Self::Sensitivity(sensitivity) => sensitivity.expected_bytes(),
            Self::Tolerance(tolerance) => tolerance.expected_bytes(),
        }
    }

    fn held_bytes(&self, format: Format) -> u64 {
        let of_answer = if let Self::Map(map) = self { map.held_bytes() } else { 0 };
        let of_groups = if format == Format::Parquet { self.table().parquet_bytes() } else { 0 };
        of_answer + of_groups
    }
}

impl StudyAnswer {
    /// The columns of its table, which CSV and Parquet hold too.
    pub fn columns(&self) -> Vec<TableColumn> {
        self.table().into_columns()
    }

    fn table(&self) -> Table<'_> {
        match self {
            Self::Map(map) => map.table(),
            Self::Search(search) => search.table(),
            Self::Sensitivity(sensitivity) => sensitivity.table(),
            Self::Tolerance(tolerance) => tolerance.table(),
        }
    }

    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        self.table().write_csv(writer)
    }

    fn write_parquet(&self, writer: &mut dyn Write) -> io::Result<()> {
        self.table().write_parquet(writer)
    }
}
