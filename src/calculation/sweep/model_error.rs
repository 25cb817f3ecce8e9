//! Model error relative to elastic bodies, as text.

use std::io::{self, Write};

use toothwave_solver::model_error::{ErrorRange, Held, Measured, ModelError};

use crate::json::word;

pub(super) fn write_text(error: &ModelError, writer: &mut dyn Write) -> io::Result<()> {
    let percent = |ErrorRange { low, high }: &ErrorRange| format!("{:+.0} to {:+.0} %", 100.0 * low, 100.0 * high);
    match &error.measured {
        Some(Measured { case, force, stress, wind_up }) => {
            writeln!(
                writer,
                "\nmodel against elastic bodies        force {}, stress {}",
                percent(force),
                percent(stress)
            )?;
            writeln!(writer, "wind-up of bodies that are held     {}", percent(wind_up))?;
            let refined = [
                (case.ring_teeth_bend, "the ring's teeth bend"),
                (case.wave_generator_moves, "the wave generator moves on under its teeth"),
                (case.corner_contact, "teeth meet the corners of tips"),
            ];
            let refined: Vec<_> = refined.into_iter().filter(|(is, _)| *is).map(|(_, words)| words).collect();
            if !refined.is_empty() {
                writeln!(writer, "refined                             {}", refined.join(", "))?;
            }
        }
        None => writeln!(writer, "\nmodel against elastic bodies        not measured")?,
    }
    if let Some(Held { case, wind_up, estimated_wind_up }) = &error.held {
        let earlier = wind_up.as_ref().map_or_else(String::new, |range| format!("{}, ", percent(range)));
        let case = word(case).replace('_', " ");
        writeln!(writer, "wind-up besides, {case:<18} {earlier}estimated {:+.0} %", 100.0 * estimated_wind_up)?;
    }
    if error.is_within {
        return writeln!(writer, "this design                         within the range of those measured");
    }
    let beyond: Vec<_> = error.beyond.iter().map(word).collect();
    writeln!(writer, "this design                         beyond the range of those measured: {}", beyond.join(", "))
}
