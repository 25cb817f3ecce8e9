//! Errors of the model against elastic bodies, in per cent. Generated from `tests/finite_elements`: run
//! `WRITE_MODEL_ERRORS=1 cargo test -p toothwave-solver --test solver -- model_errors_are_generated`.

use super::{Measured, row};
use crate::contact_law::LawName::{Johnson, Linear, Palmgren};
use crate::load_sharing::Compatibility::{Projection, VirtualWork};

/// Model, its refinements, pointed tips and gaps; errors of force, stress and wind-up.
pub(super) const MEASURED: [Measured; 35] = [
    row(VirtualWork, Johnson, [false, false, false], [false, false], [[-1, 0], [-2, 1], [-2, -1]]),
    row(VirtualWork, Johnson, [false, false, false], [false, true], [[-1, 1], [-5, 3], [-1, 0]]),
    row(VirtualWork, Johnson, [false, false, false], [true, false], [[-3, 7], [-3, 4], [-6, -3]]),
    row(VirtualWork, Johnson, [false, false, false], [true, true], [[-3, 6], [-5, 3], [-3, 0]]),
    row(VirtualWork, Johnson, [true, false, false], [false, false], [[-1, 0], [-2, 1], [-1, 1]]),
    row(VirtualWork, Johnson, [true, false, false], [false, true], [[-1, 1], [-5, 2], [-1, 1]]),
    row(VirtualWork, Johnson, [true, false, false], [true, false], [[-1, 0], [-2, 1], [0, 1]]),
    row(VirtualWork, Johnson, [true, false, false], [true, true], [[-4, 0], [-4, 1], [-1, 1]]),
    row(VirtualWork, Johnson, [true, true, false], [false, false], [[-1, 0], [-2, 1], [-1, 1]]),
    row(VirtualWork, Johnson, [true, true, false], [false, true], [[-1, 1], [-5, 2], [-1, 1]]),
    row(VirtualWork, Johnson, [true, true, false], [true, false], [[-1, 1], [-1, 1], [0, 1]]),
    row(VirtualWork, Johnson, [true, true, false], [true, true], [[-1, 1], [-4, 1], [0, 1]]),
    row(VirtualWork, Johnson, [false, true, false], [false, false], [[-1, 1], [-2, 1], [-2, -1]]),
    row(VirtualWork, Johnson, [false, true, false], [false, true], [[-1, 1], [-5, 2], [-1, 0]]),
    row(VirtualWork, Johnson, [false, true, false], [true, false], [[-3, 8], [-2, 4], [-6, -3]]),
    row(VirtualWork, Johnson, [false, true, false], [true, true], [[-3, 8], [-5, 4], [-2, 0]]),
    row(VirtualWork, Palmgren, [false, false, false], [false, false], [[-1, 1], [-2, 1], [13, 16]]),
    row(VirtualWork, Palmgren, [false, false, false], [false, true], [[-4, 1], [-5, 1], [4, 10]]),
    row(VirtualWork, Palmgren, [false, false, false], [true, false], [[-2, 9], [-2, 4], [14, 16]]),
    row(VirtualWork, Palmgren, [false, false, false], [true, true], [[-3, 8], [-5, 3], [1, 5]]),
    row(VirtualWork, Linear, [false, false, false], [false, false], [[-3, -1], [-3, 0], [-81, -80]]),
    row(VirtualWork, Linear, [false, false, false], [false, true], [[-3, 45], [-6, 22], [-47, -26]]),
    row(VirtualWork, Linear, [false, false, false], [true, false], [[-3, 7], [-3, 4], [-83, -82]]),
    row(VirtualWork, Linear, [false, false, false], [true, true], [[-3, 50], [-5, 23], [-21, -18]]),
    row(Projection, Palmgren, [false, false, false], [false, false], [[3, 11], [0, 6], [-18, 2]]),
    row(Projection, Palmgren, [false, false, false], [false, true], [[3, 17], [-3, 9], [-39, -8]]),
    row(Projection, Palmgren, [false, false, false], [true, false], [[15, 29], [0, 14], [-38, -35]]),
    row(Projection, Palmgren, [false, false, false], [true, true], [[15, 39], [-13, 18], [-84, -47]]),
    row(Projection, Linear, [false, false, false], [false, false], [[1, 8], [-1, 5], [-87, -82]]),
    row(Projection, Linear, [false, false, false], [false, true], [[1, 77], [-4, 34], [-88, -39]]),
    row(Projection, Linear, [false, false, false], [true, false], [[13, 26], [-1, 12], [-91, -89]]),
    row(Projection, Linear, [false, false, false], [true, true], [[12, 110], [-12, 45], [-96, -61]]),
    row(VirtualWork, Johnson, [true, false, true], [true, false], [[-4, 0], [-4, 0], [-3, 0]]),
    row(VirtualWork, Johnson, [true, true, true], [true, false], [[-3, 0], [-4, 1], [-2, 1]]),
    row(VirtualWork, Johnson, [true, true, true], [true, true], [[-2, 0], [-3, 1], [0, 1]]),
];
