//! Invariants, scaling laws, closure, continuity and the jump.

use proptest::prelude::*;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::Sweep;
use toothwave_solver::{Compatibility, DriveParameters, ToothShape, Torque};

use crate::drives::{
    PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_swept_drive, cases, drive, ellipse, load, semi_axes_mm, swept,
};

fn any_compatibility() -> impl Strategy<Value = Compatibility> {
    prop::sample::select(vec![Projection, VirtualWork])
}

fn scaled(p: &DriveParameters, factor: f64) -> DriveParameters {
    let (a, b) = semi_axes_mm(p);
    DriveParameters {
        wave_generator: ellipse(factor * a, factor * b),
        tooth_radius_mm: factor * p.tooth_radius_mm,
        tooth: ToothShape::Cylinder { width_mm: factor * 10.0 },
        tip_radius_mm: p.tip_radius_mm.map(|radius| factor * radius),
        ..*p
    }
}

/// Returns the six columns of forces and stresses with their peaks.
fn loads(sweep: &Sweep) -> Vec<(&Vec<f64>, f64)> {
    let force = sweep.states.force_n.iter().map(|(c, column)| (column, sweep.peaks.get(c).force_n.value));
    let stress = sweep.states.stress_mpa.iter().map(|(c, column)| (column, sweep.peaks.get(c).stress_mpa.value));
    force.chain(stress).collect()
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn torques_at_input_ring_and_carrier_balance(parameters in any_swept_drive(), compatibility in any_compatibility()) {
        let sweep = swept(&parameters, &load(7.0, compatibility), 11);
        prop_assert!(sweep.torque_balance_residual < 1e-13, "{:e}", sweep.torque_balance_residual);
    }

    #[test]
    fn period_closes(parameters in any_swept_drive(), compatibility in any_compatibility()) {
        let residual = swept(&parameters, &load(7.0, compatibility), 13).period_closure_residual;
        prop_assert!(residual < 1e-12, "{residual:e}");
    }

    #[test]
    fn every_load_is_finite_and_not_negative(parameters in any_swept_drive(), compatibility in any_compatibility()) {
        let sweep = swept(&parameters, &load(7.0, compatibility), 9);
        for (column, peak) in loads(&sweep) {
            prop_assert!(column.iter().all(|value| *value >= 0.0 && value.is_finite()));
            prop_assert!(peak > 0.0);
        }
    }

    #[test]
    fn doubled_drive_carries_same_forces_under_doubled_torque(parameters in any_swept_drive()) {
        let small = swept(&parameters, &load(3.0, VirtualWork), 10);
        let large = swept(&scaled(&parameters, 2.0), &load(6.0, VirtualWork), 10);
        // A factor of two is exact in doubles, so the digits are equal.
        prop_assert_eq!(&small.states.force_n, &large.states.force_n);
        for (contact, column) in small.states.stress_mpa.iter() {
            for (small, large) in column.iter().zip(large.states.stress_mpa.get(contact)) {
                prop_assert!((small - 2.0 * large).abs() <= 1e-14 * small);
            }
        }
    }

    #[test]
    fn forces_grow_with_torque_and_stresses_with_root(parameters in any_swept_drive(), compatibility in any_compatibility()) {
        let light = swept(&parameters, &load(1.0, compatibility), 10);
        let heavy = swept(&parameters, &load(4.0, compatibility), 10);
        for (contact, column) in light.states.force_n.iter() {
            for (light, heavy) in column.iter().zip(heavy.states.force_n.get(contact)) {
                prop_assert!((heavy - 4.0 * light).abs() <= 1e-14 * heavy);
            }
        }
        for (contact, column) in light.states.stress_mpa.iter() {
            for (light, heavy) in column.iter().zip(heavy.states.stress_mpa.get(contact)) {
                prop_assert!((heavy - 2.0 * light).abs() <= 1e-14 * heavy);
            }
        }
    }

    #[test]
    fn equal_stiffness_projection_shares_load_by_arm(parameters in any_swept_drive()) {
        let sweep = swept(&parameters, &load(5.0, Projection), 6);
        let states = &sweep.states;
        let mut ratio = None;
        for i in 0..states.len() {
            // F_S = F_H sin γ Z_G/U and d sin γ = |h'|: so F_H/|h'| is F_H²/(F_S d) but for a constant.
            let (h, s) = (states.force_n.wave_generator[i], states.force_n.carrier[i]);
            if states.input_angle_deg[i] == 0.0 && h > 0.0 {
                let per_lever = h * h / (s * states.center_radius_mm[i]);
                let expected = *ratio.get_or_insert(per_lever);
                prop_assert!((per_lever - expected).abs() < 1e-11 * expected);
            }
        }
    }
}

/// Returns the largest step of `F_K` between samples, over its peak, for teeth in mesh at both samples.
fn largest_step(parameters: &DriveParameters, samples: u64) -> f64 {
    let sweep = swept(parameters, &load(3.0, Projection), samples);
    let states = &sweep.states;
    let force = &states.force_n.ring;
    let mut before = std::collections::BTreeMap::new();
    let mut largest = 0.0_f64;
    for (tooth, force) in states.tooth.iter().zip(force) {
        // A tooth appears once at each angle, so its previous load is at the previous angle.
        if let Some(last) = before.insert(tooth, force) {
            largest = largest.max((force - last).abs());
        }
    }
    largest / sweep.peaks.ring.force_n.value
}

#[test]
fn forces_are_continuous_without_undercut() {
    let (coarse, fine) = (largest_step(&PAPER_5_1, 100), largest_step(&PAPER_5_1, 1000));
    assert!(fine < 0.11 * coarse, "steps shrink with the samples: {coarse} {fine}");
}

#[test]
fn forces_jump_at_entry_with_undercut_or_bore() {
    for parameters in [PAPER_5_2, PAPER_5_2_BORED] {
        let (coarse, fine) = (largest_step(&parameters, 100), largest_step(&parameters, 1000));
        assert!(coarse > 0.1 && fine > 0.9 * coarse, "the jump stays: {coarse} {fine}");
    }
}

#[test]
fn only_shortened_flanks_admit_teeth_under_load() {
    let first_force = |parameters: &DriveParameters| {
        let sweep = swept(parameters, &load(3.0, Projection), 4000);
        let states = &sweep.states;
        let outermost = (0..states.len()).max_by(|i, j| states.position_deg[*i].total_cmp(&states.position_deg[*j]));
        states.force_n.ring[outermost.unwrap()] / sweep.peaks.ring.force_n.value
    };
    assert!(first_force(&PAPER_5_1) < 1e-3);
    assert!(first_force(&PAPER_5_2) > 0.5);
    assert!(first_force(&PAPER_5_2_BORED) > 0.5);
}

#[test]
fn output_torque_is_input_torque_times_ratio() {
    let mut by_output = load(0.0, Projection);
    by_output.torque = Torque::Output(20.0 * 14.0);
    assert_eq!(swept(&PAPER_5_1, &by_output, 50).states, swept(&PAPER_5_1, &load(20.0, Projection), 50).states);
}

#[test]
fn tooth_difference_sign_sets_sense_of_rotation() {
    let fewer = drive(&PAPER_5_1);
    let more = drive(&DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..PAPER_5_1 });
    assert_eq!((fewer.transmission_ratio(), fewer.transmission_ratio_carrier_fixed()), (14.0, -13.0));
    assert_eq!((more.transmission_ratio(), more.transmission_ratio_carrier_fixed()), (-14.0, 15.0));
}

#[test]
fn flank_ends_near_axis_above_critical_radius() {
    let critical = drive(&PAPER_5_1).flank().critical_tooth_radius_mm().unwrap();
    let at = |factor: f64| drive(&DriveParameters { tooth_radius_mm: critical * factor, ..PAPER_5_1 });
    assert_eq!(at(1.0 - 1e-9).flank_limit().end, FlankEnd::RegularTip);
    let short = |relative: f64| at(1.0 + relative).flank_limit().position.from_valley_rad;
    // Like a square root: a hundredth of the distance gives a tenth of the angle.
    assert!((short(1e-6) / short(1e-8) - 10.0).abs() < 1e-2);
}
