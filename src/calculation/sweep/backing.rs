//! Estimated compliance of the supports behind the contacts, in JSON.

use std::io::{self, Write};

use toothwave_solver::backing::Estimate;

use crate::json::word;

pub(super) fn write_text(estimates: &[Estimate], writer: &mut dyn Write) -> io::Result<()> {
    if estimates.is_empty() {
        return Ok(());
    }
    writeln!(writer, "\nbehind the contacts, estimated       mm/N   adds to a tooth's approach")?;
    for Estimate { contact, backing, compliance_mm_per_n, share, .. } in estimates {
        let name = format!("{}, {}", word(contact), word(backing)).replace('_', " ");
        write!(writer, "{name:<33} {compliance_mm_per_n:.3e}")?;
        match share {
            Some(share) => writeln!(writer, "   {:.0} %", 100.0 * share)?,
            None => writeln!(writer)?,
        }
    }
    Ok(())
}
