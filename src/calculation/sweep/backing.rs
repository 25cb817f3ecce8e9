//! Estimated compliance of the supports behind the contacts, in JSON.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::backing::{Backing, Backings, Estimate, Shares};
use toothwave_solver::{Contact, Drive, LoadCase};
use utoipa::ToSchema;

use crate::json::word;

/// Estimated compliance of a part behind a contact (docs/explanation/theory.md section 4.10).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct EstimateAnswer {
    /// The contact.
    pub contact: Contact,
    /// Compliant part behind the contact.
    pub backing: Backing,
    /// Additional displacement of the contact per newton, beyond the depth that the contact's law includes.
    pub compliance_mm_per_n: f64,
    /// True if this support is the one in `parts`, or the default if `parts` does not specify it.
    pub is_as_held: bool,
    /// Share that it adds to the approach of a tooth at its three contacts, for cylinders with this support under
    /// `johnson`. Left out if the design gives a series compliance there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
}

impl EstimateAnswer {
    pub(super) fn all(backings: &Backings, drive: &Drive, load: &LoadCase, shares: Option<&Shares>) -> Vec<Self> {
        let share_of = |wanted: Backing| {
            let shares = shares.into_iter().flat_map(|shares| &shares.shares);
            shares.into_iter().find(|(estimate, _)| estimate.backing == wanted).map(|&(_, share)| share)
        };
        let answer = |Estimate { backing, compliance_mm_per_n }: Estimate| Self {
            contact: backing.contact(),
            backing,
            compliance_mm_per_n,
            is_as_held: backing.is_of(backings.support()),
            share: share_of(backing),
        };
        backings.estimates(drive, load.parameters()).into_iter().map(answer).collect()
    }
}

pub(super) fn write_text(estimates: &[EstimateAnswer], writer: &mut dyn Write) -> io::Result<()> {
    if estimates.is_empty() {
        return Ok(());
    }
    writeln!(writer, "\nbehind the contacts, estimated       mm/N   adds to a tooth's approach")?;
    for EstimateAnswer { contact, backing, compliance_mm_per_n, share, .. } in estimates {
        let name = format!("{}, {}", word(contact), word(backing)).replace('_', " ");
        write!(writer, "{name:<33} {compliance_mm_per_n:.3e}")?;
        match share {
            Some(share) => writeln!(writer, "   {:.0} %", 100.0 * share)?,
            None => writeln!(writer)?,
        }
    }
    Ok(())
}
