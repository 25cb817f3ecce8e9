//! The states of a sweep as an Apache Arrow IPC stream: what data frames read without parsing text.

use std::io::{self, Write};
use std::sync::Arc;

use arrow_array::{Array, ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, Field, Schema};

use crate::json::word;
use crate::sweep::Column;
use crate::sweep::answer::SweepAnswer;

/// States of a batch: what is copied before it is written.
const BATCH_STATES: usize = 1 << 16;

/// Columns of the same names and in the same order as in CSV.
pub(super) fn write(answer: &SweepAnswer, writer: &mut dyn Write) -> io::Result<()> {
    write_columns(&answer.columns(), answer.states.tooth.len(), writer).map_err(|error| match error {
        ArrowError::IoError(_, error) => error,
        other => io::Error::other(other),
    })
}

fn write_columns(columns: &[(&str, Column<'_>)], states: usize, writer: &mut dyn Write) -> Result<(), ArrowError> {
    let field = |(name, column): &(&str, Column<'_>)| Field::new(*name, column.array(0, 0).data_type().clone(), false);
    let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
    let mut stream = StreamWriter::try_new(writer, &schema)?;
    for from in (0..states).step_by(BATCH_STATES) {
        let to = states.min(from + BATCH_STATES);
        let arrays = columns.iter().map(|(_, column)| column.array(from, to)).collect();
        stream.write(&RecordBatch::try_new(Arc::clone(&schema), arrays)?)?;
    }
    stream.finish()
}

impl Column<'_> {
    /// The entries of some states, copied.
    fn array(&self, from: usize, to: usize) -> ArrayRef {
        match self {
            Self::Numbers(numbers) => Arc::new(Float64Array::from(numbers[from..to].to_vec())),
            Self::Counts(counts) => Arc::new(UInt32Array::from(counts[from..to].to_vec())),
            Self::Flags(flags) => Arc::new(BooleanArray::from(flags[from..to].to_vec())),
            Self::Rolls(rolls) => Arc::new(StringArray::from_iter_values(rolls[from..to].iter().map(word))),
        }
    }
}
