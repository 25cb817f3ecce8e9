//! Drive for the unit tests of the sweep.

use crate::{DriveParameters, ToothShape, WaveGenerator};

/// Case 5.1 of the paper.
pub(super) const PAPER_5_1: DriveParameters = DriveParameters {
    wave_generator: WaveGenerator::Ellipse { semi_major_mm: 58.0, semi_minor_mm: 56.0 },
    teeth: 28,
    installed: 28,
    tooth_radius_mm: 5.0,
    tooth: ToothShape::Cylinder { width_mm: 15.0 },
    ring_teeth: 26,
    tip_radius_mm: None,
};
