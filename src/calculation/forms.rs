//! Formats of answers.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::columns;
use crate::decimal_comma::DecimalComma;

/// A format of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Format {
    /// JSON, for programs.
    Json,
    /// Columns as comma-separated values.
    Csv,
    /// The same with a decimal comma and semicolons between fields.
    CsvComma,
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
    /// Meshes for printers.
    ThreeMf,
    /// One mesh for printers that read nothing else.
    Stl,
}

impl Format {
    /// Media type with parameters.
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Json => "application/json",
            Self::Csv | Self::CsvComma => "text/csv; charset=utf-8; header=present",
            Self::Arrow => "application/vnd.apache.arrow.stream",
            Self::Parquet => "application/vnd.apache.parquet",
            Self::Text => "text/plain; charset=utf-8",
            Self::Svg => "image/svg+xml",
            Self::Dxf => "image/vnd.dxf",
            Self::Step => "model/step",
            Self::ThreeMf => "model/3mf",
            Self::Stl => "model/stl",
        }
    }

    /// The format that an answer offers: CSV, whatever its decimal sign.
    pub const fn offered(self) -> Self {
        if matches!(self, Self::CsvComma) { Self::Csv } else { self }
    }

    /// True if it writes every number of the answer.
    pub const fn writes_all_numbers(self) -> bool {
        matches!(self, Self::Json | Self::Csv | Self::CsvComma | Self::Arrow | Self::Parquet)
    }

    /// Bytes of numbers and of their text: a number has 8 bytes, its text about 20.
    pub const fn bytes_with_text(self, numbers_bytes: u64) -> u64 {
        if self.writes_all_numbers() { numbers_bytes * 7 / 2 } else { numbers_bytes }
    }
}

/// Writer of CSV.
#[derive(Debug, Clone, Copy, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields, default)]
#[into_params(parameter_in = Query)]
pub struct CsvOptions {
    /// Decimal sign of numbers in CSV. With `comma` a semicolon separates fields.
    #[param(inline, required = false)]
    pub decimal: Decimal,
}

/// A decimal sign.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Decimal {
    /// `1.5`
    #[default]
    Point,
    /// `1,5`
    Comma,
}

impl Decimal {
    /// CSV with this sign; every other format as it is.
    pub const fn of(self, format: Format) -> Format {
        match (self, format) {
            (Self::Comma, Format::Csv) => Format::CsvComma,
            _ => format,
        }
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
    fn write(&self, format: Format, writer: &mut impl Write) -> io::Result<()> {
        match Self::FORMS.iter().find(|(known, _)| *known == format.offered()) {
            Some((_, form)) if format == Format::CsvComma => form(self, &mut DecimalComma::new(writer)),
            Some((_, form)) => form(self, writer),
            None => columns::write(self, writer),
        }
    }
}

/// Writes rows of CSV below their names.
pub(crate) fn write_csv(
    names: &[&str],
    rows: impl IntoIterator<Item = impl Serialize>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(writer);
    csv.write_record(names).map_err(csv_error)?;
    rows.into_iter().try_for_each(|row| csv.serialize(row).map_err(csv_error))?;
    csv.flush()
}

/// Converts a CSV error to the I/O error of its writer. Its kind distinguishes a closed pipe from a full disk.
pub fn csv_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}
