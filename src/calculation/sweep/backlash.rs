//! Backlash in the answer of a sweep.

use std::io::{self, Write};

use toothwave_solver::backlash::{self, Backlash};
use toothwave_solver::{SolveError, Stop};

use crate::sweep::CheckedSweep;

impl CheckedSweep {
    /// Returns the backlash at the output.
    pub fn backlash(&self, stop: &dyn Stop) -> Result<Backlash, SolveError> {
        backlash::of(&self.drive, self.load(), &self.deviations, stop)
    }

    /// Returns pointers to the fields that open or close gaps.
    pub(super) fn gap_fields(&self) -> &'static [&'static str] {
        match (self.load().parameters().modification.is_nil(), self.deviations.is_nil()) {
            (true, true) => &["/parts"],
            (true, false) => &["/parts", "/deviations"],
            (false, true) => &["/parts", "/modification"],
            (false, false) => &["/parts", "/modification", "/deviations"],
        }
    }
}

/// Returns `None` if a tooth has no space on a lobe or in a valley, which a finding reports.
pub(super) fn unless_interfering(backlash: Result<Backlash, SolveError>) -> Result<Option<Backlash>, SolveError> {
    match backlash {
        Err(SolveError::Interference { .. }) => Ok(None),
        other => other.map(Some),
    }
}

pub(super) fn write_text(backlash: &Backlash, writer: &mut dyn Write) -> io::Result<()> {
    let Backlash { mean_arcmin, smallest_arcmin, largest_arcmin, contribution_arcmin: parts, .. } = backlash;
    writeln!(
        writer,
        "backlash at the output              {mean_arcmin:.6} arcmin, {smallest_arcmin:.6} to {largest_arcmin:.6}"
    )?;
    writeln!(
        writer,
        "of which at generator, ring, slot   {:.6}, {:.6} and {:.6} arcmin",
        parts.wave_generator, parts.ring, parts.carrier
    )
}
