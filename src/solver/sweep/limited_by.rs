//! What limits the torque capacity of a drive.

use crate::contact::Contact;

/// What limits the torque capacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum LimitedBy {
    /// The contact stress at the wave generator.
    WaveGenerator,
    /// The contact stress at the ring.
    Ring,
    /// The contact stress at the slots of the carrier.
    Carrier,
    /// Yield of the carrier's fingers.
    FingerYield,
    /// Fatigue of the carrier's fingers.
    FingerFatigue,
}

impl From<Contact> for LimitedBy {
    fn from(contact: Contact) -> Self {
        match contact {
            Contact::WaveGenerator => Self::WaveGenerator,
            Contact::Ring => Self::Ring,
            Contact::Carrier => Self::Carrier,
        }
    }
}
