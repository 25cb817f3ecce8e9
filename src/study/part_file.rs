//! Parts as Apache Parquet files: the rows of a chunk, or the designs found by an island of a search.
//!
//! The file's metadata names the study, the chunk, the build and the arithmetic. Parts of different builds or
//! arithmetic are never merged, because their last bits differ.

use std::collections::BTreeMap;
use std::io;

use bytes::Bytes;
use parquet::data_type::{ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use toothwave_calculation::origin;

use crate::rows::RowsPart;
use crate::study::{Part, Study};

const STUDY: &str = "toothwave.study";
const CHUNK: &str = "toothwave.chunk";
const CHUNK_VARIANTS: &str = "toothwave.chunk_variants";
/// Key of the build and the arithmetic.
const ORIGIN: &str = "toothwave.origin";
/// Key of the part without its columns, as JSON.
const PART: &str = "toothwave.part";

/// Reason to refuse the bytes of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PartError {
    /// The bytes are no part, or were changed after they were written.
    Damaged(String),
    /// Another build computed the part, or a processor with another arithmetic.
    OtherOrigin(String),
    /// The part belongs to another study, to another chunk, or to chunks of another size.
    OtherStudy,
}

impl std::fmt::Display for PartError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Damaged(how) => write!(f, "the part is damaged ({how}). Delete it, and run the study again"),
            Self::OtherOrigin(other) => write!(
                f,
                "the part was computed by the build `{other}`, and this is `{}`: their last digits differ. Use one build and one kind of processor, or another folder",
                origin()
            ),
            Self::OtherStudy => write!(f, "the part belongs to another study. Use another folder"),
        }
    }
}

impl std::error::Error for PartError {}

impl From<ParquetError> for PartError {
    fn from(error: ParquetError) -> Self {
        Self::Damaged(error.to_string())
    }
}

impl Study {
    /// Returns a part of this study as the bytes of a Parquet file.
    pub fn part_bytes(&self, chunk: u64, part: &Part) -> io::Result<Vec<u8>> {
        let mut notes: Vec<_> = self.notes(chunk).map(|(name, value)| KeyValue::new(name.into(), value)).into();
        let without_columns = match part {
            Part::Rows(rows) => &Part::Rows(rows.without_columns()),
            Part::Island(_) => part,
        };
        notes.push(KeyValue::new(PART.into(), serde_json::to_string(without_columns)?));
        let mut bytes = Vec::new();
        match part {
            Part::Rows(rows) => {
                if let Some(table) = self.rows_table(rows) {
                    table.write_parquet_with(notes, &mut bytes)?;
                }
            }
            Part::Island(island) => {
                if let Some(answer) = self.found_by(island) {
                    answer.table().write_parquet_with(notes, &mut bytes)?;
                }
            }
        }
        Ok(bytes)
    }

    /// Reads the part of a chunk from the bytes of its file. Fails if the bytes are damaged, or belong to another
    /// build, another study or another chunk.
    pub fn read_part(&self, chunk: u64, bytes: Vec<u8>) -> Result<Part, PartError> {
        let file = SerializedFileReader::new(Bytes::from(bytes))?;
        let notes = file.metadata().file_metadata().key_value_metadata().into_iter().flatten();
        let notes: BTreeMap<_, _> =
            notes.filter_map(|note| Some((note.key.as_str(), note.value.as_deref()?))).collect();
        for (name, wanted) in self.notes(chunk) {
            match notes.get(name) {
                None => return Err(PartError::Damaged(format!("it lacks `{name}`"))),
                Some(&found) if found == wanted => {}
                Some(&found) if name == ORIGIN => return Err(PartError::OtherOrigin(found.into())),
                Some(_) => return Err(PartError::OtherStudy),
            }
        }
        let text = notes.get(PART).ok_or_else(|| PartError::Damaged(format!("it lacks `{PART}`")))?;
        let part = serde_json::from_str(text).map_err(|error| PartError::Damaged(error.to_string()))?;
        match (part, self.has_rows()) {
            (Part::Rows(mut rows), true) => {
                for group in 0..file.num_row_groups() {
                    read_rows(file.get_row_group(group)?.as_ref(), self.quantities().len(), &mut rows)?;
                }
                let variants = self.span_of(chunk);
                let has_all = (rows.answered.len() + rows.refused.len()) as u64 == variants.end - variants.start
                    && rows.refused.len() == rows.reasons.len()
                    && rows.columns.len() == self.quantities().len()
                    && rows.columns.iter().all(|column| column.len() == rows.answered.len());
                if !has_all {
                    return Err(PartError::Damaged("it lacks rows".into()));
                }
                Ok(Part::Rows(rows))
            }
            (part @ Part::Island(_), false) => Ok(part),
            _ => Err(PartError::OtherStudy),
        }
    }

    /// Returns the metadata that identifies a part. The origin comes first, because the study's id depends on it.
    fn notes(&self, chunk: u64) -> [(&'static str, String); 4] {
        [
            (ORIGIN, origin().to_owned()),
            (STUDY, self.id().to_string()),
            (CHUNK, chunk.to_string()),
            (CHUNK_VARIANTS, self.chunk_variants().to_string()),
        ]
    }
}

/// Appends the variants and the quantities of a group of rows.
fn read_rows(group: &dyn RowGroupReader, quantities: usize, rows: &mut RowsPart) -> Result<(), PartError> {
    let lacks_columns = || PartError::Damaged("it lacks columns".into());
    let first = group.num_columns().checked_sub(quantities + 1).ok_or_else(lacks_columns)?;
    let (variants, _) = column::<Int64Type>(group, 0)?;
    let (_, is_refused) = column::<ByteArrayType>(group, first + quantities)?;
    for (variant, &is_refused) in variants.into_iter().zip(&is_refused) {
        let variant = u64::try_from(variant).map_err(|error| PartError::Damaged(error.to_string()))?;
        if is_refused { rows.refused.push(variant) } else { rows.answered.push(variant) }
    }
    for (index, column_of_part) in rows.columns.iter_mut().enumerate() {
        let (values, is_there) = column::<DoubleType>(group, first + index)?;
        let mut values = values.into_iter();
        for (is_there, _) in is_there.into_iter().zip(&is_refused).filter(|(_, is_refused)| !**is_refused) {
            let value = if is_there { values.next() } else { None };
            column_of_part.push(value.unwrap_or(f64::NAN));
        }
    }
    Ok(())
}

/// Returns the non-null values of a column, and for each row true if its value is not null.
fn column<T: DataType>(group: &dyn RowGroupReader, index: usize) -> Result<(Vec<T::T>, Vec<bool>), PartError> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or_default();
    let (mut values, mut levels) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
    let mut reader = T::get_column_reader(group.get_column_reader(index)?)
        .ok_or_else(|| PartError::Damaged("a column has another type".into()))?;
    reader.read_records(rows, Some(&mut levels), None, &mut values)?;
    Ok((values, levels.into_iter().map(|level| level > 0).collect()))
}
