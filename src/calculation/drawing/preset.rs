//! Clearances for a manufacturing method.

use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use crate::design::{ClearanceDocument, Design};

/// Drawing options of a part.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields, default)]
#[into_params(parameter_in = Query)]
pub struct DrawingOptions {
    /// Clearances of the drawn parts: those of the `document`, or for `printing` 50 for every `parts.*.clearance_um`, so that each contact has a gap of 0.1 mm.
    #[param(inline, required = false)]
    pub preset: Preset,
}

/// Purpose of the clearances of drawn parts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Clearances of the document.
    #[default]
    Document,
    /// Printing: 0.1 mm between the two parts of each contact.
    Printing,
}

/// Clearance of each part for printing: half of the gap at a contact.
const PRINTED_CLEARANCE_UM: f64 = 50.0;

/// Returns the design with clearances for printing instead of its own.
pub(super) fn printed(design: &Design) -> Design {
    let mut printed = design.clone();
    // Replaced too, not removed: the finding of the deprecated field is about the document.
    if let Some(ClearanceDocument { wave_generator_um, ring_um, carrier_um }) = &mut printed.model.clearance {
        for gap_um in [wave_generator_um, ring_um, carrier_um].into_iter().filter(|gap_um| **gap_um != 0.0) {
            *gap_um = 2.0 * PRINTED_CLEARANCE_UM;
        }
    }
    let parts = &mut printed.parts;
    parts.wave_generator.clearance_um = PRINTED_CLEARANCE_UM;
    parts.teeth.clearance_um = PRINTED_CLEARANCE_UM;
    parts.ring.clearance_um = PRINTED_CLEARANCE_UM;
    parts.carrier.clearance_um = PRINTED_CLEARANCE_UM;
    printed
}
