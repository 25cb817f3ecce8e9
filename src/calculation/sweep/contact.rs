//! A contact of a tooth, by its name.

use serde::Serialize;
use toothwave_solver::Contact;
use utoipa::ToSchema;

/// A contact of a tooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactName {
    /// With the wave generator.
    WaveGenerator,
    /// With the ring.
    Ring,
    /// With the carrier.
    Carrier,
}

impl From<Contact> for ContactName {
    fn from(contact: Contact) -> Self {
        match contact {
            Contact::WaveGenerator => Self::WaveGenerator,
            Contact::Ring => Self::Ring,
            Contact::Carrier => Self::Carrier,
        }
    }
}
