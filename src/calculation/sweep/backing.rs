//! Estimates of what gives way behind the contacts, as they go over the wire.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::backing::{Backing, Backings, Estimate, Shares};
use toothwave_solver::{Drive, LoadCase};
use utoipa::ToSchema;

use crate::json::word;
use crate::sweep::contact::ContactName;

/// An estimate of what gives way behind a contact (docs/explanation/theory.md section 4.10).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct EstimateAnswer {
    /// The contact.
    pub contact: ContactName,
    /// What gives way behind it.
    pub backing: BackingWord,
    /// How far the contact gives way besides, for each newton there, beyond the depth that its law counts to.
    pub compliance_mm_per_n: f64,
    /// Whether the parts are held so as far as `parts` says; where it says nothing, as the stiffer of the two.
    pub is_as_held: bool,
    /// What it adds to the approach of a tooth at its three contacts, over that, of cylinders whose parts are held so under `johnson`; left out where the
    /// designer gives a series compliance there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub share: Option<f64>,
}

/// What gives way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BackingWord {
    /// The wave generator between its contacts and its bore.
    CamOnBore,
    /// The ring's rim in a rigid housing.
    HousedRim,
    /// The rim with nothing around it.
    FreeRim,
    /// A finger of the carrier held at both ends.
    FingerAtBothEnds,
    /// A finger held at one end.
    FingerAtOneEnd,
}

impl From<Backing> for BackingWord {
    fn from(backing: Backing) -> Self {
        match backing {
            Backing::CamOnBore => Self::CamOnBore,
            Backing::HousedRim => Self::HousedRim,
            Backing::FreeRim => Self::FreeRim,
            Backing::FingerAtBothEnds => Self::FingerAtBothEnds,
            Backing::FingerAtOneEnd => Self::FingerAtOneEnd,
        }
    }
}

impl EstimateAnswer {
    pub(super) fn all(backings: &Backings, drive: &Drive, load: &LoadCase, shares: Option<&Shares>) -> Vec<Self> {
        let share_of = |wanted: Backing| {
            let shares = shares.into_iter().flat_map(|shares| &shares.shares);
            shares.into_iter().find(|(estimate, _)| estimate.backing == wanted).map(|&(_, share)| share)
        };
        let answer = |Estimate { backing, compliance_mm_per_n }: Estimate| Self {
            contact: backing.contact().into(),
            backing: backing.into(),
            compliance_mm_per_n,
            is_as_held: backing.is_of(backings.support()),
            share: share_of(backing),
        };
        backings.estimates(drive, load).into_iter().map(answer).collect()
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
