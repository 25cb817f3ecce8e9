//! Clearances for a way of making the parts.

use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use crate::design::Design;

/// How a part is drawn.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields, default)]
#[into_params(parameter_in = Query)]
pub struct DrawingOptions {
    /// Clearances of the drawn parts: those of the `document`, or for `printing` 50 for every `parts.*.clearance_um`, so that each contact has a gap of 0.1 mm.
    #[param(inline, required = false)]
    pub preset: Preset,
}

/// What the clearances of drawn parts are for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Those of the document.
    #[default]
    Document,
    /// Printing: 0.1 mm between the two parts of each contact.
    Printing,
}

/// Half of the clearance at a contact, of which each of its two parts has one.
const PRINTED_CLEARANCE_UM: f64 = 50.0;

/// The design with clearances for printing in place of its own.
pub(super) fn printed(design: &Design) -> Design {
    let mut printed = design.clone();
    // Deprecated, and another gap than that of the parts would be a conflict.
    printed.model.clearance = None;
    let parts = &mut printed.parts;
    parts.wave_generator.clearance_um = PRINTED_CLEARANCE_UM;
    parts.teeth.clearance_um = PRINTED_CLEARANCE_UM;
    parts.ring.clearance_um = PRINTED_CLEARANCE_UM;
    parts.carrier.clearance_um = PRINTED_CLEARANCE_UM;
    printed
}
