//! Independent constructions: dense systems of equations and swept circles.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Vector2};
use proptest::prelude::*;
use toothwave_solver::Compatibility::{self, Projection, VirtualWork};
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::mesh::{Mesh, Samples};
use toothwave_solver::{ContactLaw, Drive, DriveParameters, LoadCase, PerContact, Position};

use crate::drives::{
    PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_drive, any_swept_drive, cases, drive, load, semi_axes_mm,
};

/// Returns the directions of the three forces on a tooth in its slot's frame: x outward, y in the sense of the input.
///
/// In the positive sense, the wave generator pushes outward and forward. For s = +1 the ring pushes inward and forward
/// and the slot holds the tooth back. For s = -1 the ring pushes backward and the slot forward.
fn directions(drive: &Drive, tooth: &ToothState) -> PerContact<Vector2<f64>> {
    let (cam, ring) = (tooth.center.tan_pressure_angle.atan(), tooth.flank.tan_pressure_angle.atan());
    PerContact {
        wave_generator: Vector2::new(cam.cos(), cam.sin()),
        ring: Vector2::new(-ring.cos(), drive.sense() * ring.sin()),
        carrier: Vector2::new(0.0, -drive.sense()),
    }
}

fn lever_mm(tooth: &ToothState) -> f64 {
    tooth.center.center_radius_mm * tooth.center.tan_pressure_angle.atan().sin()
}

/// Solves the paper's 3n equations as printed: equilibrium [1], torque [2], compatibility of neighbours [3]-[7].
fn forces_by_projection(
    drive: &Drive,
    teeth: &[ToothState],
    stiffness: &PerContact<f64>,
    torque_nmm: f64,
) -> Vec<PerContact<f64>> {
    let n = teeth.len();
    let mut matrix = DMatrix::<f64>::zeros(3 * n, 3 * n);
    let mut right = DVector::<f64>::zeros(3 * n);
    // ξ as a row over the forces of one tooth.
    let displacement = |tooth: &ToothState| {
        let direction = directions(drive, tooth);
        let along = direction.wave_generator;
        [
            1.0 / stiffness.wave_generator,
            -along.dot(&direction.ring) / stiffness.ring,
            -along.dot(&direction.carrier) / stiffness.carrier,
        ]
    };
    for (i, tooth) in teeth.iter().enumerate() {
        let direction = directions(drive, tooth);
        for axis in 0..2 {
            matrix[(2 * i + axis, 3 * i)] = direction.wave_generator[axis];
            matrix[(2 * i + axis, 3 * i + 1)] = direction.ring[axis];
            matrix[(2 * i + axis, 3 * i + 2)] = direction.carrier[axis];
        }
        matrix[(2 * n, 3 * i)] = Mesh::new(drive).zones_in_torque() * lever_mm(tooth);
        if let Some(next) = teeth.get(i + 1) {
            for contact in 0..3 {
                matrix[(2 * n + 1 + i, 3 * i + contact)] = displacement(tooth)[contact] * lever_mm(next);
                matrix[(2 * n + 1 + i, 3 * i + 3 + contact)] = -displacement(next)[contact] * lever_mm(tooth);
            }
        }
    }
    right[2 * n] = torque_nmm;
    // Rows of similar size keep the elimination accurate.
    for mut row in matrix.row_iter_mut().skip(2 * n + 1) {
        let largest = row.amax();
        if largest > 0.0 {
            row /= largest;
        }
    }
    let solution = matrix.lu().solve(&right).unwrap();
    (0..n)
        .map(|i| PerContact {
            wave_generator: solution[3 * i],
            ring: solution[3 * i + 1],
            carrier: solution[3 * i + 2],
        })
        .collect()
}

/// Solves for teeth with free centres against three springs each, and one common rotation.
fn forces_by_springs(
    drive: &Drive,
    teeth: &[ToothState],
    stiffness: &PerContact<f64>,
    torque_nmm: f64,
) -> Vec<PerContact<f64>> {
    let n = teeth.len();
    let mut matrix = DMatrix::<f64>::zeros(2 * n + 1, 2 * n + 1);
    let mut right = DVector::<f64>::zeros(2 * n + 1);
    // Unknowns: the centres' displacements, then the rotation over 1/mm so that all are lengths.
    for (i, tooth) in teeth.iter().enumerate() {
        let direction = directions(drive, tooth);
        for (contact, direction) in direction.iter() {
            let stiffness = stiffness.get(contact);
            for row in 0..2 {
                for column in 0..2 {
                    matrix[(2 * i + row, 2 * i + column)] -= stiffness * direction[row] * direction[column];
                }
            }
        }
        let push = stiffness.wave_generator * lever_mm(tooth);
        for axis in 0..2 {
            matrix[(2 * i + axis, 2 * n)] += push * direction.wave_generator[axis];
            matrix[(2 * n, 2 * i + axis)] -= push * direction.wave_generator[axis];
        }
        matrix[(2 * n, 2 * n)] += push * lever_mm(tooth);
    }
    right[2 * n] = torque_nmm / Mesh::new(drive).zones_in_torque();
    let solution = matrix.lu().solve(&right).unwrap();
    teeth
        .iter()
        .enumerate()
        .map(|(i, tooth)| {
            let direction = directions(drive, tooth);
            let moved = Vector2::new(solution[2 * i], solution[2 * i + 1]);
            let pushed = solution[2 * n] * lever_mm(tooth);
            PerContact {
                wave_generator: stiffness.wave_generator * (pushed - moved.dot(&direction.wave_generator)),
                ring: -stiffness.ring * moved.dot(&direction.ring),
                carrier: -stiffness.carrier * moved.dot(&direction.carrier),
            }
        })
        .collect()
}

/// Returns the largest difference between the closed form and a dense solve at some angles, over the largest force.
pub(crate) fn worst_difference(
    parameters: &DriveParameters,
    compatibility: Compatibility,
    stiffness: PerContact<f64>,
) -> f64 {
    let samples = Samples::new(7).unwrap();
    let drive = drive(parameters);
    let mut load = load(20.0, compatibility);
    load.law = ContactLaw::Fixed(stiffness);
    let loaded = LoadedDrive::new(&drive, &LoadCase::new(&load).unwrap()).unwrap();
    let mesh = Mesh::new(&drive);
    let mut worst = 0.0_f64;
    for sample in 0..=samples.count() {
        let teeth: Vec<_> = mesh
            .placed_at(sample, samples)
            .map(|placed| loaded.tooth(placed.position).unwrap())
            .filter(|tooth| tooth.center.tan_pressure_angle > 0.0)
            .collect();
        let wind_up = loaded.wind_up(&teeth).unwrap();
        let dense = match compatibility {
            Projection => forces_by_projection(&drive, &teeth, &stiffness, loaded.input_torque_nmm()),
            VirtualWork => forces_by_springs(&drive, &teeth, &stiffness, loaded.input_torque_nmm()),
        };
        let closed: Vec<_> = teeth.iter().map(|tooth| loaded.forces_n(tooth, &wind_up).unwrap()).collect();
        let peak = closed.iter().map(|force| force.wave_generator).fold(0.0, f64::max);
        for (closed, dense) in closed.iter().zip(&dense) {
            for (contact, force) in closed.iter() {
                worst = worst.max((force - dense.get(contact)).abs() / peak);
            }
        }
    }
    worst
}

pub(crate) const EQUAL: PerContact<f64> = PerContact { wave_generator: 1e6, ring: 1e6, carrier: 1e6 };
pub(crate) const UNEQUAL: PerContact<f64> = PerContact { wave_generator: 1.3e6, ring: 0.7e6, carrier: 0.9e6 };

#[test]
fn projection_matches_the_papers_3n_equations() {
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        for stiffness in [EQUAL, UNEQUAL] {
            let worst = worst_difference(&parameters, Projection, stiffness);
            assert!(worst < 1e-12, "{worst:e}");
        }
    }
}

#[test]
fn virtual_work_is_free_tooth_on_three_springs() {
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        for stiffness in [EQUAL, UNEQUAL] {
            let worst = worst_difference(&parameters, VirtualWork, stiffness);
            assert!(worst < 1e-12, "{worst:e}");
        }
    }
}

proptest! {
    #![proptest_config(cases(128))]

    #[test]
    fn closed_form_matches_dense_solves(parameters in any_swept_drive()) {
        // The elimination's own error grows with the number and the scale of the equations.
        prop_assert!(worst_difference(&parameters, Projection, EQUAL) < 1e-9);
        prop_assert!(worst_difference(&parameters, VirtualWork, UNEQUAL) < 1e-9);
    }

    #[test]
    fn ring_is_boundary_of_swept_circles(parameters in any_drive(), share in 0.02_f64..0.98) {
        let drive = drive(&parameters);
        let flank = drive.flank();
        let end_rad = drive.flank_limit().position.from_lobe_rad;
        let tooth = flank.locus().at(Position::from_lobe(share * end_rad, 2)).unwrap();
        let point = flank.at(&tooth);
        let flank_mm = flank.radius_mm(&tooth, &point);
        let angle_rad = flank.angle_from_space_rad(&tooth, &point);
        let swept_mm = farthest_swept_mm(&drive, angle_rad);
        prop_assert!((swept_mm - flank_mm).abs() < 1e-9 * flank_mm, "{swept_mm} is not {flank_mm}");
    }
}

/// Returns the farthest reach of any circle on the path in the direction `angle_rad` of the ring's frame.
/// It scans the tooth space and its neighbours and refines the maximum.
fn farthest_swept_mm(drive: &Drive, angle_rad: f64) -> f64 {
    const SCAN: u32 = 4000;
    let p = drive.parameters();
    let ((a, b), r) = (semi_axes_mm(p), p.tooth_radius_mm);
    let k = p.ring_teeth as f64 / 2.0;
    // The path by the normal's angle φ on the ellipse, without the solver.
    let reach = |phi: f64| {
        let (sin, cos) = phi.sin_cos();
        let h = (a * cos).hypot(b * sin);
        let center = Vector2::new((a * a / h + r) * cos, (b * b / h + r) * sin);
        let turns = (phi / PI).round();
        let folded = Vector2::new(center.x * if turns.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 }, center.y)
            .component_mul(&Vector2::new(1.0, if turns.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 }));
        let psi = turns * PI + folded.y.atan2(folded.x);
        let off = angle_rad - psi / k;
        let beside = center.norm() * off.sin();
        if beside.abs() > r || off.cos() < 0.0 {
            0.0
        } else {
            center.norm() * off.cos() + (r * r - beside * beside).sqrt()
        }
    };
    let (low, high) = (-0.5 * PI * k.min(6.0), 0.5 * PI * k.min(6.0) + PI);
    let step = (high - low) / f64::from(SCAN);
    let best = (0..=SCAN).map(|i| low + f64::from(i) * step).max_by(|x, y| reach(*x).total_cmp(&reach(*y))).unwrap();
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (best - step, best + step);
    for _ in 0..60 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if reach(left) > reach(right) { high = right } else { low = left }
    }
    reach(0.5 * (low + high))
}
