//! Formats of answers.

use std::io::{self, Write};

use serde::Serialize;

use crate::columns;

/// A format of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// JSON, for programs.
    Json,
    /// Columns as comma-separated values.
    Csv,
    /// Columns as an Apache Arrow IPC stream.
    Arrow,
    /// Columns as an Apache Parquet file.
    Parquet,
    /// Summary for a terminal.
    Text,
    /// Image.
    Svg,
    /// Outlines for CAD and manufacturing.
    Dxf,
    /// Solids for CAD.
    Step,
}

impl Format {
    /// True if it writes every number of the answer.
    pub const fn writes_all_numbers(self) -> bool {
        matches!(self, Self::Json | Self::Csv | Self::Arrow | Self::Parquet)
    }

    /// Bytes of numbers and of their text: a number has 8 bytes, its text about 20.
    pub const fn bytes_with_text(self, numbers_bytes: u64) -> u64 {
        if self.writes_all_numbers() { numbers_bytes * 7 / 2 } else { numbers_bytes }
    }
}

/// Function that writes an answer in one format.
pub type Form<A> = fn(&A, &mut dyn Write) -> io::Result<()>;

/// Formats of an answer type.
pub trait Forms: Serialize + Sized + 'static {
    /// Formats in addition to JSON, the preferred one first, each with its writer.
    const FORMS: &'static [(Format, Form<Self>)];

    /// Estimated bytes of the JSON, to size its buffer.
    fn expected_bytes(&self) -> usize {
        4096
    }

    /// Estimated bytes of the answer's numbers, and of the buffers that writing needs.
    fn held_bytes(&self, _format: Format) -> u64 {
        0
    }

    /// Estimated bytes of the answer with its text in this format.
    fn bytes(&self, format: Format) -> u64 {
        let text_bytes = if format.writes_all_numbers() { self.expected_bytes() as u64 } else { 0 };
        self.held_bytes(format) + text_bytes
    }

    /// Writes the answer in one of its formats, or else as JSON.
    ///
    /// # Errors
    /// The errors of the writer.
    fn write(&self, format: Format, writer: &mut impl Write) -> io::Result<()> {
        match Self::FORMS.iter().find(|(known, _)| *known == format) {
            Some((_, form)) => form(self, writer),
            None => columns::write(self, writer),
        }
    }
}

/// Converts a CSV error to the I/O error of its writer. Its kind distinguishes a closed pipe from a full disk.
pub fn csv_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}
