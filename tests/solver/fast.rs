//! The fast path against the plain one, on any drive.

use alloc_counter::count_alloc;
use proptest::prelude::*;
use toothwave_solver::sweep::{Points, Sweep, sweep, sweep_plain};
use toothwave_solver::{Compatibility, LoadCase, Never};

use crate::drives::{PAPER_5_1, any_swept_drive, drive, load, swept};

fn columns(sweep: &Sweep) -> Vec<(&Vec<f64>, f64)> {
    let states = &sweep.states;
    let peak = |column: &[f64]| column.iter().fold(0.0_f64, |most, value| most.max(*value));
    let mut columns = vec![
        &states.input_angle_deg,
        &states.position_deg,
        &states.center_radius_mm,
        &states.wave_generator_angle_deg,
        &states.ring_angle_deg,
    ];
    columns.extend(states.force_n.iter().map(|(_, column)| column));
    columns.extend(states.stress_mpa.iter().map(|(_, column)| column));
    columns.into_iter().map(|column| (column, peak(column))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_fast_path_agrees_with_the_plain_one(
        parameters in any_swept_drive(),
        by_virtual_work in any::<bool>(),
        samples in prop_oneof![1_u64..6, 40_u64..60, 500_u64..700],
    ) {
        let compatibility = if by_virtual_work { Compatibility::VirtualWork } else { Compatibility::Projection };
        let (drive, load) = (drive(&parameters), LoadCase::new(&load(7.0, compatibility)).unwrap());
        let fast = sweep(&drive, &load, Points::samples(samples).unwrap(), &Never).unwrap();
        let plain = sweep_plain(&drive, &load, Points::samples(samples).unwrap(), &Never).unwrap();
        prop_assert_eq!(&fast.states.tooth, &plain.states.tooth);
        prop_assert_eq!(&fast.input_angles.loaded_teeth, &plain.input_angles.loaded_teeth);
        for ((fast, peak), (plain, _)) in columns(&fast).into_iter().zip(columns(&plain)) {
            for (fast, plain) in fast.iter().zip(plain) {
                prop_assert!((fast - plain).abs() <= 1e-12 * peak, "{} is not {} of {}", fast, plain, peak);
            }
        }
    }
}

#[test]
fn a_sweep_allocates_columns_and_nothing_a_state() {
    let allocations = |samples| {
        let load = load(20.0, Compatibility::Projection);
        let ((allocations, growths, _), sweep) = count_alloc(|| swept(&PAPER_5_1, &load, samples));
        (sweep.states.len(), allocations + growths)
    };
    let (few_states, of_few) = allocations(50);
    let (many_states, of_many) = allocations(5000);
    assert!(many_states > 90 * few_states, "{few_states}, {many_states}");
    // Columns that grow are moved a number of times that rises with the logarithm of their length.
    assert!(of_few <= of_many && of_many < of_few + 30, "{of_few}, {of_many}");
}
