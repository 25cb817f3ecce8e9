//! Table of a study's result: one definition of the columns for CSV and Parquet.

use std::io::{self, Write};
use std::mem;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types;
use toothwave_calculation::forms::csv_error;

/// Most rows and cells of a Parquet row group. They are held in addition to the answer until the group is written.
const GROUP_ROWS: usize = 1 << 16;
const GROUP_CELLS: usize = 1 << 19;

/// Bytes of Parquet metadata for each column of a group, held until the end of the file.
const NOTE_BYTES: u64 = 1 << 10;

/// A table with rows that are made one by one.
pub(crate) struct Table<'a> {
    pub(crate) columns: Vec<Column>,
    /// Number of rows.
    pub(crate) length: usize,
    /// Rows, each with a cell for every column.
    pub(crate) rows: Box<dyn Iterator<Item = Vec<Cell>> + 'a>,
}

/// A column: its name and the type of its cells.
#[derive(Debug)]
pub(crate) struct Column {
    name: String,
    kind: Content,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content {
    Count,
    Number,
    Word,
}

/// A cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cell {
    Empty,
    Count(u64),
    Number(f64),
    Word(String),
}

/// A column of a table with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct TableColumn {
    /// Name.
    pub name: String,
    /// A value for each row.
    pub values: Values,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Integers, one in each row.
    Counts(Vec<u64>),
    /// Numbers; of an empty cell NaN.
    Numbers(Vec<f64>),
    /// Texts; of an empty cell none.
    Words(Vec<Option<String>>),
}

impl Values {
    fn push(&mut self, cell: Cell) {
        match (self, cell) {
            (Self::Counts(counts), Cell::Count(count)) => counts.push(count),
            (Self::Counts(counts), _) => counts.push(0),
            (Self::Numbers(numbers), Cell::Number(number)) => numbers.push(number),
            (Self::Numbers(numbers), Cell::Count(count)) => numbers.push(count as f64),
            (Self::Numbers(numbers), _) => numbers.push(f64::NAN),
            (Self::Words(words), Cell::Empty) => words.push(None),
            (Self::Words(words), cell) => words.push(Some(cell.text())),
        }
    }
}

impl Column {
    pub(crate) fn new(name: impl Into<String>, kind: Content) -> Self {
        Self { name: name.into(), kind }
    }
}

impl From<Option<f64>> for Cell {
    fn from(number: Option<f64>) -> Self {
        number.filter(|number| !number.is_nan()).map_or(Self::Empty, Self::Number)
    }
}

impl Cell {
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Count(count) => count.to_string(),
            Self::Number(number) => format!("{number:?}"),
            Self::Word(word) => word.clone(),
        }
    }
}

impl Table<'_> {
    /// Writes CSV: a header of names, then one line for each row.
    pub(crate) fn write_csv(self, writer: &mut dyn Write) -> io::Result<()> {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(self.columns.iter().map(|column| &column.name)).map_err(csv_error)?;
        for row in self.rows {
            csv.write_record(row.iter().map(Cell::text)).map_err(csv_error)?;
        }
        csv.flush()
    }

    /// Writes Apache Parquet with the same columns. An empty cell is null.
    pub(crate) fn write_parquet(self, writer: &mut dyn Write) -> io::Result<()> {
        self.write_parquet_with(Vec::new(), writer)
    }

    /// Writes Apache Parquet with notes in the file's metadata.
    pub(crate) fn write_parquet_with(mut self, notes: Vec<KeyValue>, writer: &mut dyn Write) -> io::Result<()> {
        let fields = self.columns.iter().map(|column| column.schema().map(Arc::new));
        let fields = fields.collect::<Result<_, _>>().map_err(parquet_error)?;
        let schema = types::Type::group_type_builder("study").with_fields(fields).build().map_err(parquet_error)?;
        let properties = WriterProperties::builder().set_key_value_metadata(Some(notes)).build();
        // Parquet needs to own its writer, so it gets a buffer that is emptied after each group.
        let file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties));
        let mut file = file.map_err(parquet_error)?;
        let group_rows = self.group_rows();
        loop {
            let rows: Vec<_> = self.rows.by_ref().take(group_rows).collect();
            if rows.is_empty() {
                return writer.write_all(&file.into_inner().map_err(parquet_error)?);
            }
            write_group(&mut file, &self.columns, &rows).map_err(parquet_error)?;
            file.flush()?;
            writer.write_all(&mem::take(file.inner_mut()))?;
            // A group may have few bytes. The flush lets the writer check its stop flag.
            writer.flush()?;
        }
    }

    /// Returns each column as a whole.
    pub(crate) fn into_columns(self) -> Vec<TableColumn> {
        let empty = |column: Column| {
            let values = match column.kind {
                Content::Count => Values::Counts(Vec::with_capacity(self.length)),
                Content::Number => Values::Numbers(Vec::with_capacity(self.length)),
                Content::Word => Values::Words(Vec::with_capacity(self.length)),
            };
            TableColumn { name: column.name, values }
        };
        let mut columns: Vec<_> = self.columns.into_iter().map(empty).collect();
        for row in self.rows {
            for (column, cell) in columns.iter_mut().zip(row) {
                column.values.push(cell);
            }
        }
        columns
    }

    /// Estimated bytes that writing Parquet holds, without the answer and without the output.
    pub(crate) fn parquet_bytes(&self) -> u64 {
        let (group_rows, columns) = (self.group_rows(), self.columns.len() as u64);
        let of_row: u64 = self.columns.iter().map(Column::cell_bytes).sum();
        let groups = self.length.div_ceil(group_rows) as u64;
        self.length.min(group_rows) as u64 * of_row + groups.saturating_mul(columns).saturating_mul(NOTE_BYTES)
    }

    fn group_rows(&self) -> usize {
        (GROUP_CELLS / self.columns.len().max(1)).clamp(1, GROUP_ROWS)
    }
}

impl Column {
    /// Bytes of a cell until its group is written. Words are assumed to be short.
    const fn cell_bytes(&self) -> u64 {
        match self.kind {
            Content::Count | Content::Number => 32 + 8,
            Content::Word => 128,
        }
    }

    fn schema(&self) -> Result<types::Type, ParquetError> {
        let (physical, logical) = match self.kind {
            Content::Count => (Type::INT64, None),
            Content::Number => (Type::DOUBLE, None),
            Content::Word => (Type::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let column = types::Type::primitive_type_builder(&self.name, physical);
        column.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build()
    }

    fn write(
        &self,
        writer: &mut SerializedColumnWriter<'_>,
        cells: impl Iterator<Item = Cell>,
    ) -> Result<(), ParquetError> {
        let mut levels = Vec::new();
        let (mut counts, mut numbers, mut words) = (Vec::new(), Vec::new(), Vec::new());
        for cell in cells {
            levels.push(i16::from(cell != Cell::Empty));
            match (self.kind, cell) {
                (_, Cell::Empty) => {}
                (Content::Count, Cell::Count(count)) => counts.push(i64::try_from(count).unwrap_or(i64::MAX)),
                (Content::Number, Cell::Number(number)) => numbers.push(number),
                (Content::Number, Cell::Count(count)) => numbers.push(count as f64),
                (Content::Word, cell) => words.push(ByteArray::from(cell.text().into_bytes())),
                (Content::Count | Content::Number, cell) => {
                    return Err(ParquetError::General(format!("{cell:?} in the column `{}`", self.name)));
                }
            }
        }
        let levels = Some(levels.as_slice());
        match self.kind {
            Content::Count => writer.typed::<Int64Type>().write_batch(&counts, levels, None),
            Content::Number => writer.typed::<DoubleType>().write_batch(&numbers, levels, None),
            Content::Word => writer.typed::<ByteArrayType>().write_batch(&words, levels, None),
        }
        .map(drop)
    }
}

fn write_group(
    file: &mut SerializedFileWriter<Vec<u8>>,
    columns: &[Column],
    rows: &[Vec<Cell>],
) -> Result<(), ParquetError> {
    let mut group = file.next_row_group()?;
    let mut columns = columns.iter().enumerate();
    while let (Some(mut writer), Some((index, column))) = (group.next_column()?, columns.next()) {
        column.write(&mut writer, rows.iter().map(|row| row.get(index).cloned().unwrap_or(Cell::Empty)))?;
        writer.close()?;
    }
    group.close().map(drop)
}

fn parquet_error(error: ParquetError) -> io::Error {
    io::Error::other(error)
}
