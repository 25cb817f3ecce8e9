//! States of a sweep as columns, and as CSV.

use std::io::{self, Write};

use serde::ser::SerializeSeq;
use serde::{Serialize, Serializer};

use super::NUMBER_TEXT_BYTES;
use crate::forms::write_csv;
use crate::sweep::answer::SweepAnswer;
use crate::sweep::losses::{LossesAnswer, RollsAnswer};

/// Column of the states.
#[derive(Debug, Clone, Copy)]
pub enum Column<'a> {
    /// Numbers.
    Numbers(&'a [f64]),
    /// Whole numbers.
    Counts(&'a [u32]),
    /// Booleans.
    Flags(&'a [bool]),
    /// Contacts at which teeth roll.
    Rolls(&'a [RollsAnswer]),
}

/// A state's entries of all columns.
struct Row<'a> {
    columns: &'a [Column<'a>],
    state: usize,
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_seq(Some(self.columns.len()))?;
        for column in self.columns {
            match column {
                Column::Numbers(numbers) => row.serialize_element(&numbers[self.state]),
                Column::Counts(counts) => row.serialize_element(&counts[self.state]),
                Column::Flags(flags) => row.serialize_element(&flags[self.state]),
                Column::Rolls(rolls) => row.serialize_element(&rolls[self.state]),
            }?;
        }
        row.end()
    }
}

impl Column<'_> {
    /// Returns the approximate length as JSON.
    pub(super) const fn text_bytes(&self) -> usize {
        match self {
            Self::Numbers(numbers) => NUMBER_TEXT_BYTES * numbers.len(),
            Self::Counts(counts) => 5 * counts.len(),
            Self::Flags(flags) => 6 * flags.len(),
            Self::Rolls(rolls) => 17 * rolls.len(),
        }
    }

    pub(super) const fn bytes(&self) -> u64 {
        let bytes = match self {
            Self::Numbers(numbers) => size_of_val(*numbers),
            Self::Counts(counts) => size_of_val(*counts),
            Self::Flags(flags) => size_of_val(*flags),
            Self::Rolls(rolls) => size_of_val(*rolls),
        };
        bytes as u64
    }
}

impl SweepAnswer {
    /// Returns the columns of the states with their names in JSON; those of the slips come last.
    pub fn columns(&self) -> Vec<(&'static str, Column<'_>)> {
        let states = &self.states;
        let mut columns = vec![
            ("input_angle_deg", Column::Numbers(&states.input_angle_deg)),
            ("tooth", Column::Counts(&states.tooth)),
            ("position_deg", Column::Numbers(&states.position_deg)),
            ("center_radius_mm", Column::Numbers(&states.center_radius_mm)),
            ("wave_generator_angle_deg", Column::Numbers(&states.wave_generator_angle_deg)),
            ("ring_angle_deg", Column::Numbers(&states.ring_angle_deg)),
            ("force_wave_generator_n", Column::Numbers(&states.force_wave_generator_n)),
            ("force_ring_n", Column::Numbers(&states.force_ring_n)),
            ("force_carrier_n", Column::Numbers(&states.force_carrier_n)),
            ("stress_wave_generator_mpa", Column::Numbers(&states.stress_wave_generator_mpa)),
            ("stress_ring_mpa", Column::Numbers(&states.stress_ring_mpa)),
            ("stress_carrier_mpa", Column::Numbers(&states.stress_carrier_mpa)),
        ];
        columns.extend(states.lobe.as_deref().map(|lobe| ("lobe", Column::Counts(lobe))));
        columns.extend(states.loaded.as_deref().map(|loaded| ("loaded", Column::Flags(loaded))));
        if let Some(LossesAnswer { slip_mm_per_rad: slip, rolls, .. }) = &self.losses {
            columns.extend([
                ("slip_wave_generator_mm_per_rad", Column::Numbers(&slip.wave_generator)),
                ("slip_ring_mm_per_rad", Column::Numbers(&slip.ring)),
                ("slip_carrier_mm_per_rad", Column::Numbers(&slip.carrier)),
                ("rolls", Column::Rolls(rolls)),
            ]);
        }
        columns
    }

    pub(super) fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let (names, columns): (Vec<_>, Vec<_>) = self.columns().into_iter().unzip();
        let rows = (0..self.states.tooth.len()).map(|state| Row { columns: &columns, state });
        write_csv(&names, rows, writer)
    }
}
