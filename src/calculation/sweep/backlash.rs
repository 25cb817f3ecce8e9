//! Backlash in the answer of a sweep.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::backlash::{self, Backlash};
use toothwave_solver::{PerContact, SolveError, Stop};
use utoipa::ToSchema;

use crate::sweep::CheckedSweep;

/// Backlash at the output: rotation of the carrier from one flank to the other, with wave generator and ring held and
/// without load. It follows from the gaps alone, because the parts are rigid here.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct BacklashAnswer {
    /// Mean over the input angle, in arcmin.
    pub mean_arcmin: f64,
    /// Smallest value over the input angle, in arcmin. Parts interfere if it is below zero.
    pub smallest_arcmin: f64,
    /// Largest value over the input angle, in arcmin.
    pub largest_arcmin: f64,
    /// Contribution of the gaps of each contact to the mean, in arcmin. The sum is the mean.
    pub contribution_arcmin: PerContact<f64>,
}

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

impl BacklashAnswer {
    /// Returns `None` if a tooth has no space on a lobe or in a valley, which a finding reports.
    pub(super) fn of(backlash: Result<Backlash, SolveError>) -> Result<Option<Self>, SolveError> {
        match backlash {
            Ok(backlash) => Ok(Some(Self {
                mean_arcmin: backlash.mean_arcmin(),
                smallest_arcmin: backlash.smallest.backlash_arcmin(),
                largest_arcmin: backlash.largest.backlash_arcmin(),
                contribution_arcmin: backlash.contribution_arcmin(),
            })),
            Err(SolveError::Interference { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    pub(super) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        let Self { mean_arcmin, smallest_arcmin, largest_arcmin, contribution_arcmin: parts } = self;
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
}
