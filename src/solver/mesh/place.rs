//! Places of teeth in the slots and on the lobes.

use crate::position::Position;

/// Numbers of teeth over the input angle: of one zone if the zones are alike, otherwise and with `deviations` of all
/// zones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct TeethInMesh {
    /// Least number.
    pub min: u64,
    /// Largest number.
    pub max: u64,
}

impl std::fmt::Display for TeethInMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { min, max } = self;
        if min == max { write!(f, "{min}") } else { write!(f, "{min} to {max}") }
    }
}

impl TeethInMesh {
    /// Returns the numbers for this many teeth at each place.
    pub(crate) const fn times(self, at_each_place: u64) -> Self {
        Self { min: at_each_place * self.min, max: at_each_place * self.max }
    }
}

/// Place of a tooth among the items of the parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    /// Slot of the carrier, counted from 0.
    pub slot: u64,
    /// Tooth space of the ring.
    pub ring_space: u64,
    /// Lobe of the wave generator that pushes the tooth.
    pub lobe: u64,
}

/// Teeth in neighbouring slots on one lobe. The distance of their places is the number of laps in a load period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbours {
    /// Slot of the first tooth, counted on over turns of the carrier.
    pub(crate) first_slot: u64,
    pub(crate) count: u64,
    /// Place of the first tooth.
    pub(crate) first_place: u64,
    pub(crate) lobe: u64,
}

/// A tooth in mesh at an input angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedTooth {
    /// Slot of the tooth. If zones are alike, the slots of one zone are counted on.
    pub number: u64,
    /// Lobe of the tooth, counted from the one at tooth 0 at the start.
    pub lobe: u32,
    /// Place among the items that may deviate.
    pub place: Place,
    /// Position on the lobe.
    pub position: Position,
    /// Position in degrees, rounded once if it is a whole fraction of a turn.
    pub position_deg: f64,
}
