//! What a study comes to, as it goes over the wire.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_calculation::forms::{Form, Format, Forms};
use utoipa::ToSchema;

use crate::map::MapAnswer;

/// What a study comes to, as far as it has come.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "study", rename_all = "snake_case")]
pub enum StudyAnswer {
    /// Of a map.
    Map(MapAnswer),
}

impl Forms for StudyAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[(Format::Csv, Self::write_csv)];

    fn expected_bytes(&self) -> usize {
        match self {
            Self::Map(map) => map.expected_bytes(),
        }
    }
}

impl StudyAnswer {
    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Map(map) => map.write_csv(writer),
        }
    }
}

/// A CSV error as what it is: one of the writer.
pub(crate) fn csv_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}
