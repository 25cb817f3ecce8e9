//! The fast path against the plain one, in everything that a sweep returns, on any drive.

use alloc_counter::count_alloc;
use proptest::prelude::*;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::sweep::{Points, Sweep, TorqueBalance, sweep, sweep_plain};
use toothwave_solver::{
    Compatibility, Contact, ContactLaw, Drive, DriveParameters, LoadCase, Never, PerContact, Position, ToothShape,
};

use crate::drives::{PAPER_5_1, any_swept_drive, drive, ellipse, load, swept};

/// How far two ways to the same number may be apart, over what its terms came to.
const ROUNDING: f64 = 1e-12;

fn largest(column: &[f64]) -> f64 {
    column.iter().fold(0.0_f64, |most, value| most.max(value.abs()))
}

/// Drives far more elliptic than [`any_swept_drive`] has them, as far as the fast path goes: a/b to 5.
fn any_elliptic_drive() -> impl Strategy<Value = DriveParameters> {
    let shape = (1.2_f64..5.0, 0.0_f64..1.0, 0.0_f64..1.0);
    (shape, 4_i64..40, prop::sample::select(vec![1_i64, 2]), 0.05_f64..0.95, any::<bool>()).prop_filter_map(
        "an impossible drive",
        |((ratio, bore, stretch), half, removal, thickness, more)| {
            let installed = 2 * half;
            let (a, teeth) = (50.0, installed * removal);
            let b = a / (1.0 + (ratio - 1.0) * stretch.max(0.2));
            let sin = (std::f64::consts::PI / installed as f64).sin();
            let tooth_radius_mm = thickness * b * sin / (1.0 - sin);
            let least = a.max(b + 2.0 * tooth_radius_mm);
            let parameters = DriveParameters {
                wave_generator: ellipse(a, b),
                teeth,
                installed,
                tooth_radius_mm,
                tooth: ToothShape::Cylinder { width_mm: 10.0 },
                ring_teeth: if more { teeth + 2 } else { teeth - 2 },
                tip_radius_mm: Some(least + 0.5 * bore * (a + 2.0 * tooth_radius_mm - least)),
            };
            let possible = Drive::new(&parameters).ok()?;
            Mesh::new(&possible).always_carries().then_some(parameters)
        },
    )
}

/// Columns by name.
fn columns(sweep: &Sweep) -> Vec<(&'static str, &Vec<f64>)> {
    let (states, angles) = (&sweep.states, &sweep.input_angles);
    vec![
        ("input angle", &states.input_angle_deg),
        ("position", &states.position_deg),
        ("centre radius", &states.center_radius_mm),
        ("angle on the cam", &states.wave_generator_angle_deg),
        ("angle on the ring", &states.ring_angle_deg),
        ("force at the cam", &states.force_n.wave_generator),
        ("force at the ring", &states.force_n.ring),
        ("force at the carrier", &states.force_n.carrier),
        ("stress at the cam", &states.stress_mpa.wave_generator),
        ("stress at the ring", &states.stress_mpa.ring),
        ("stress at the carrier", &states.stress_mpa.carrier),
        ("input angles", &angles.input_angle_deg),
        ("wind-up", &angles.wind_up_deg),
        ("stiffness", &angles.torsional_stiffness_nm_per_rad),
    ]
}

/// How much a relative error of the flank's terms becomes in the stress at the ring: `1 + rκ` may be a small difference.
fn amplification(drive: &Drive, position_deg: f64) -> f64 {
    let position = if position_deg < 45.0 {
        Position::from_lobe(position_deg.to_radians(), 2)
    } else {
        Position::from_valley((90.0 - position_deg).to_radians(), 2)
    };
    let center = drive.flank().locus().at(position).unwrap();
    let point = drive.flank().at(&center);
    let k = drive.flank().teeth_per_wave();
    let slope = center.tan_pressure_angle_derivative;
    let bending = k * k * slope.abs() * point.cos_pressure_angle.powi(2);
    let r_over_d = drive.parameters().tooth_radius_mm / center.center_radius_mm;
    1.0 + (1.0 + r_over_d * (1.0 + bending)) / point.regularity
}

fn assert_both_paths_agree(parameters: &DriveParameters, compatibility: Compatibility, soft: [f64; 3], samples: u64) {
    let drive = drive(parameters);
    let mut load = load(7.0, compatibility);
    let [wave_generator, ring, carrier] = soft;
    load.law = ContactLaw::Fixed(PerContact { wave_generator, ring, carrier });
    let load = LoadCase::new(&load).unwrap();
    let points = Points::samples(samples).unwrap();
    let (Ok(fast), Ok(plain)) = (sweep(&drive, &load, points, &Never), sweep_plain(&drive, &load, points, &Never))
    else {
        panic!("no answer of {parameters:?}")
    };
    assert_eq!(fast.states.tooth, plain.states.tooth);
    assert_eq!(fast.input_angles.loaded_teeth, plain.input_angles.loaded_teeth);
    let position_deg = &plain.states.position_deg;
    for ((name, fast), (_, plain)) in columns(&fast).into_iter().zip(columns(&plain)) {
        assert_eq!(fast.len(), plain.len(), "{name}");
        // The angle on the ring is the difference of two, of which the first is at most a quarter turn over k.
        let of_terms = if name == "angle on the ring" { 90.0 / drive.flank().teeth_per_wave() } else { 0.0 };
        let scale = largest(plain).max(of_terms);
        for (index, (fast, plain)) in fast.iter().zip(plain).enumerate() {
            let amplified = if name == "stress at the ring" { amplification(&drive, position_deg[index]) } else { 1.0 };
            let off = (fast - plain).abs();
            assert!(off <= ROUNDING * scale * amplified, "{name}: {fast} is not {plain} of {scale}, {parameters:?}");
        }
    }
    for (contact, peaks) in fast.peaks.iter() {
        let expected = plain.peaks.get(contact);
        // Where two states are as high, rounding decides which is the peak; its value is the column's in either case.
        let amplified = amplification(&drive, expected.stress_mpa.position_deg);
        let amplified = if contact == Contact::Ring { amplified } else { 1.0 };
        let pairs = [(peaks.force_n, expected.force_n, 1.0), (peaks.stress_mpa, expected.stress_mpa, amplified)];
        for (peak, expected, amplified) in pairs {
            let off = (peak.value - expected.value).abs();
            assert!(off <= ROUNDING * amplified * expected.value, "{contact:?}: {peak:?} {expected:?} {parameters:?}");
        }
        for (column, peak) in
            [(fast.states.force_n.get(contact), peaks.force_n), (fast.states.stress_mpa.get(contact), peaks.stress_mpa)]
        {
            assert_eq!(largest(column), peak.value, "a peak is the largest of its column");
            let at = column.iter().position(|&value| value >= peak.value).unwrap();
            assert_eq!(fast.states.input_angle_deg[at], peak.input_angle_deg);
            assert_eq!(fast.states.position_deg[at], peak.position_deg);
        }
        if peaks.stress_mpa.position_deg == expected.stress_mpa.position_deg {
            let off = (peaks.half_width_mm / expected.half_width_mm - 1.0).abs();
            assert!(off <= ROUNDING * amplified, "{contact:?}: half-width of {parameters:?}");
        }
    }
    for sweep in [&fast, &plain] {
        assert!(sweep.torque_balance_residual < 1e-13, "{:e} of {parameters:?}", sweep.torque_balance_residual);
        assert!(sweep.period_closure_residual < 1e-11, "{:e} of {parameters:?}", sweep.period_closure_residual);
    }
}

fn any_stiffnesses() -> impl Strategy<Value = [f64; 3]> {
    // Near enough to each other for `projection` to have a solution on every drive.
    prop_oneof![Just([1e6; 3]), prop::array::uniform3(0.9e6_f64..1.1e6)]
}

fn any_samples() -> impl Strategy<Value = u64> {
    prop_oneof![1_u64..6, 40_u64..60, 500_u64..700]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_fast_path_agrees_with_the_plain_one(
        parameters in prop_oneof![any_swept_drive(), any_elliptic_drive()],
        by_virtual_work in any::<bool>(),
        stiffnesses in any_stiffnesses(),
        samples in any_samples(),
    ) {
        if by_virtual_work {
            assert_both_paths_agree(&parameters, Compatibility::VirtualWork, stiffnesses, samples);
        } else {
            assert_both_paths_agree(&parameters, Compatibility::Projection, [1e6; 3], samples);
        }
    }
}

#[test]
fn a_torque_that_is_off_at_any_of_the_three_parts_is_seen() {
    let balance = TorqueBalance::new(&drive(&PAPER_5_1), 20_000.0);
    let right = PerContact { wave_generator: 20_000.0, ring: 260_000.0, carrier: 280_000.0 };
    assert!(balance.residual(&right) < 1e-15);
    let off = 1.01;
    for wrong in [
        PerContact { wave_generator: off * right.wave_generator, ..right },
        PerContact { ring: off * right.ring, ..right },
        PerContact { carrier: off * right.carrier, ..right },
        PerContact { carrier: (2.0 - off) * right.carrier, ..right },
    ] {
        assert!((balance.residual(&wrong) - 0.01).abs() < 1e-12, "{wrong:?}");
    }
    for none in [
        PerContact { wave_generator: f64::NAN, ..right },
        PerContact { ring: f64::NAN, ..right },
        PerContact { carrier: f64::NAN, ..right },
    ] {
        assert!(balance.residual(&none).is_nan());
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
