//! The forms that answers are written in.

use std::io::{self, Write};

use serde::Serialize;

use crate::columns;

/// A format of answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// As programs read it.
    Json,
    /// Columns.
    Csv,
    /// Columns in Apache Arrow's IPC stream.
    Arrow,
    /// Columns in Apache Parquet.
    Parquet,
    /// For a terminal.
    Text,
    /// A picture.
    Svg,
    /// Outlines for CAD and workshops.
    Dxf,
    /// Solids for CAD.
    Step,
}

impl Format {
    /// Whether each number of the answer is written.
    pub const fn writes_all_numbers(self) -> bool {
        matches!(self, Self::Json | Self::Csv | Self::Arrow | Self::Parquet)
    }

    /// The bytes of numbers and of their text: a number has 8 bytes, and its text about 20.
    pub const fn bytes_with_text(self, numbers_bytes: u64) -> u64 {
        if self.writes_all_numbers() { numbers_bytes * 7 / 2 } else { numbers_bytes }
    }
}

/// Writes an answer in one form.
pub type Form<A> = fn(&A, &mut dyn Write) -> io::Result<()>;

/// What an answer can be written as.
pub trait Forms: Serialize + Sized + 'static {
    /// The formats beside JSON, the preferred first, each with what writes it.
    const FORMS: &'static [(Format, Form<Self>)];

    /// About how many bytes the JSON takes, so that its buffer need not grow.
    fn expected_bytes(&self) -> usize {
        4096
    }

    /// About how many bytes the numbers of the answer take, with what writing them in a format takes beside the text.
    fn held_bytes(&self, _format: Format) -> u64 {
        0
    }

    /// About how many bytes the answer takes with its text in this format.
    fn bytes(&self, format: Format) -> u64 {
        let text_bytes = if format.writes_all_numbers() { self.expected_bytes() as u64 } else { 0 };
        self.held_bytes(format) + text_bytes
    }

    /// Writes the answer in one of its formats, or in JSON.
    ///
    /// # Errors
    /// Those of the writer.
    fn write(&self, format: Format, writer: &mut impl Write) -> io::Result<()> {
        match Self::FORMS.iter().find(|(known, _)| *known == format) {
            Some((_, form)) => form(self, writer),
            None => columns::write(self, writer),
        }
    }
}

/// A CSV error as what it is: one of the writer, whose kind tells a closed pipe from a full disk.
pub fn csv_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}
