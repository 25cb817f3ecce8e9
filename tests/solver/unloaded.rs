//! Extremes of the unloaded wind-up from tolerance sweeps, against dense positions. An independent calculation is used
//! where it knows the gaps.

use proptest::prelude::*;
use toothwave_solver::Compatibility::VirtualWork;
use toothwave_solver::gaps::TipRelief;
use toothwave_solver::sweep::{self, Extremes, Points};
use toothwave_solver::{
    ContactLaw, Deviations, DriveParameters, LoadCase, LoadParameters, Modification, Never, PerContact, ToothShape,
    WaveGenerator,
};

use crate::deviations::{ALL_KINDS, FIXED, cleared, deviations, drives, first_closing_rad, swept_with};
use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_swept_drive, cases, drive, everywhere, load};

const MAX_STATES: u64 = 10_000_000;

const AT_RING: PerContact<f64> = PerContact { wave_generator: 0.0, ring: 10.0, carrier: 0.0 };
const AT_SLOT: PerContact<f64> = PerContact { wave_generator: 0.0, ring: 0.0, carrier: 10.0 };

fn to(tolerance: f64) -> Points {
    Points::tolerance(tolerance, MAX_STATES).unwrap().also_without_load()
}

/// Returns a sweep's input angles and its unloaded wind-up.
fn without_load(
    p: &DriveParameters,
    load: &LoadParameters,
    deviations: &Deviations,
    points: Points,
) -> (Vec<f64>, Vec<f64>) {
    let (drive, case) = (drive(p), LoadCase::new(load).unwrap());
    let sweep = swept_with(&drive, load, deviations, points).unwrap_or_else(|error| panic!("{error}: {load:?} {p:?}"));
    let unloaded_deg = sweep::unloaded_wind_up_deg(&drive, &case, deviations, &sweep, &Never).unwrap();
    (sweep.input_angles.input_angle_deg, unloaded_deg)
}

fn extremes(p: &DriveParameters, load: &LoadParameters, points: Points) -> Extremes {
    Extremes::of(&without_load(p, load, &Deviations::default(), points).1)
}

/// Asserts that the extremes miss the dense ones by at most the tolerance. Found values exist, so they exceed nothing.
fn assert_found(found: &Extremes, dense: &Extremes, tolerance: f64, what: &str) {
    let least_missed = found.least - dense.least;
    let largest_missed = dense.largest - found.largest;
    let allowed = tolerance.max(1e-12) * dense.largest;
    assert!(least_missed <= allowed, "least {} of {}, {tolerance:e}: {what}", found.least, dense.least);
    assert!(largest_missed <= allowed, "largest {} of {}, {tolerance:e}: {what}", found.largest, dense.largest);
}

#[test]
fn unloaded_error_of_case_5_1_is_known() {
    let load = LoadParameters { clearance_um: AT_RING, ..load(20.0, VirtualWork) };
    let period_rad = (360.0_f64 / 26.0).to_radians();
    let dense: Vec<_> = (0..5000)
        .map(|step| f64::from(step) / 5000.0 * period_rad)
        .map(|input_rad| first_closing_rad(&PAPER_5_1, &load, &Deviations::default(), 10.0, input_rad).to_degrees())
        .collect();
    let dense = Extremes::of(&dense);
    assert!(((dense.largest - dense.least) / 14.0 - 4.876_91e-4).abs() < 1e-9);
    for tolerance in [1e-1, 1e-3, 1e-6, 1e-9, 1e-12] {
        let found = extremes(&PAPER_5_1, &load, to(tolerance));
        assert_found(&found, &dense, tolerance, "case 5.1");
        assert!(found.least >= dense.least * (1.0 - 1e-6) && found.largest <= dense.largest * (1.0 + 1e-6));
    }
}

#[test]
fn no_position_is_missed_with_deviations() {
    for (index, p) in drives().iter().enumerate() {
        let drive = drive(p);
        for kinds in &ALL_KINDS[..3] {
            let deviations = deviations(p, *kinds, index as u64);
            let load = cleared(20.0, FIXED);
            let mesh = deviations.mesh(&drive);
            let reach_rad = drive.flank_limit().position.from_lobe_rad;
            let first_deg = |input_deg: f64| {
                first_closing_rad(p, &load, &deviations, reach_rad, input_deg.to_radians()).to_degrees()
            };
            let positions: u32 = 3000;
            // Off the angles at which a tooth enters.
            let at = |step: u32| (f64::from(step) + 0.37) / f64::from(positions) * mesh.sweep_period_deg();
            let dense: Vec<_> = (0..positions).map(|step| first_deg(at(step))).collect();
            let dense = Extremes::of(&dense);
            for tolerance in [1e-2, 1e-6, 1e-9] {
                let (angles_deg, unloaded_deg) = without_load(p, &load, &deviations, to(tolerance));
                let found = Extremes::of(&unloaded_deg);
                assert_found(&found, &dense, tolerance, &format!("{kinds:?} {p:?}"));
                // The minimum occurs at its own angle. The maximum may be at a tooth's entry.
                let (angle_deg, _) = angles_deg
                    .iter()
                    .zip(&unloaded_deg)
                    .find(|&(_, &value)| value <= found.least)
                    .expect("an angle of its own");
                let there_deg = first_deg(*angle_deg).min(first_deg(angle_deg - 1e-7)).min(first_deg(angle_deg + 1e-7));
                assert!((there_deg / found.least - 1.0).abs() < 1e-6, "{there_deg} {}", found.least);
            }
        }
    }
}

fn of(wave_generator: WaveGenerator, teeth: i64, ring_teeth: i64, tooth_radius_mm: f64) -> DriveParameters {
    DriveParameters {
        wave_generator,
        teeth,
        installed: teeth,
        ring_teeth,
        tooth_radius_mm,
        tooth: ToothShape::Cylinder { width_mm: 15.0 },
        tip_radius_mm: None,
    }
}

/// Returns regular, undercut and bored flanks, unlike zones, one and three lobes, and few teeth.
fn shapes() -> Vec<DriveParameters> {
    vec![
        PAPER_5_1,
        PAPER_5_2,
        PAPER_5_2_BORED,
        DriveParameters { teeth: 27, installed: 27, ring_teeth: 25, ..PAPER_5_1 },
        DriveParameters { teeth: 81, installed: 81, ring_teeth: 79, tooth_radius_mm: 1.2, ..PAPER_5_2 },
        of(WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 }, 20, 21, 2.0),
        of(WaveGenerator::HarmonicPath { lobes: 3, mean_path_radius_mm: 52.0, amplitude_mm: 1.0 }, 37, 34, 2.5),
        of(WaveGenerator::Harmonic { lobes: 3, mean_radius_mm: 48.0, amplitude_mm: 1.0 }, 16, 13, 4.0),
    ]
}

fn loads(end_deg: f64) -> Vec<LoadParameters> {
    let johnson = ContactLaw::JOHNSON;
    let of_gaps = |clearance_um| LoadParameters { clearance_um, law: johnson, ..load(2.0, VirtualWork) };
    let relieved = |power, share| Modification {
        ring_tip_relief: Some(TipRelief { amount_um: 12.0, start_deg: share * end_deg, power }),
        ..Modification::default()
    };
    let shifted = Modification {
        ring_path_shift_um: 6.0,
        ring_profile_shift_um: 4.0,
        ring_rotation_arcsec: 9.0,
        carrier_rotation_arcsec: -3.0,
        ..Modification::default()
    };
    vec![
        of_gaps(AT_RING),
        of_gaps(AT_SLOT),
        of_gaps(everywhere(5.0)),
        LoadParameters { modification: shifted, ..of_gaps(AT_RING) },
        LoadParameters { modification: relieved(2.0, 0.3), ..of_gaps(everywhere(3.0)) },
        LoadParameters { modification: relieved(1.0, 0.5), ..of_gaps(AT_RING) },
        // No gap is open before the relief begins.
        LoadParameters { modification: relieved(2.0, 0.2), ..of_gaps(PerContact::default()) },
        LoadParameters { wave_generator_moves: true, ..of_gaps(AT_RING) },
        LoadParameters { corner_contact: true, ..of_gaps(AT_RING) },
        LoadParameters { corner_contact: true, wave_generator_moves: true, ..of_gaps(everywhere(2.0)) },
    ]
}

#[test]
fn tolerance_finds_unloaded_extremes_for_every_shape() {
    for p in shapes() {
        for load in loads(drive(&p).flank_limit().position.from_lobe_deg()) {
            let what = format!("{load:?} {p:?}");
            let dense = extremes(&p, &load, Points::samples(4000).unwrap());
            for tolerance in [1e-2, 1e-6, 1e-12] {
                assert_found(&extremes(&p, &load, to(tolerance)), &dense, tolerance, &what);
            }
            let [coarse, fine] = [1e-6, 1e-12].map(|tolerance| extremes(&p, &load, to(tolerance)));
            assert_found(&coarse, &fine, 1e-6, &what);
        }
    }
}

proptest! {
    #![proptest_config(cases(100))]

    #[test]
    fn tolerance_finds_unloaded_extremes_on_any_drive(
        parameters in any_swept_drive(),
        exponents in prop::array::uniform3(-1.0_f64..2.0),
        is_at_slot_alone in any::<bool>(),
        moves in any::<bool>(),
        tolerance in prop::sample::select(vec![1e-2, 1e-4, 1e-8]),
    ) {
        let [wave_generator, ring, carrier] = exponents.map(|exponent| 10.0_f64.powf(exponent));
        let of_all = PerContact { wave_generator, ring, carrier };
        let clearance_um = if is_at_slot_alone { PerContact { carrier, ..PerContact::default() } } else { of_all };
        let load = LoadParameters { clearance_um, wave_generator_moves: moves, ..load(20.0, VirtualWork) };
        let case = LoadCase::new(&load).unwrap();
        // A moving wave generator may turn past its teeth.
        let drive = drive(&parameters);
        if let Ok(dense) = sweep::sweep(&drive, &case, Points::samples(1500).unwrap(), &Never) {
            let dense_deg = sweep::unloaded_wind_up_deg(&drive, &case, &Deviations::default(), &dense, &Never).unwrap();
            let found = extremes(&parameters, &load, to(tolerance));
            assert_found(&found, &Extremes::of(&dense_deg), tolerance, &format!("{load:?} {parameters:?}"));
        }
    }
}

#[test]
fn unloaded_wind_up_adds_only_two_input_angles() {
    let load = LoadParameters { clearance_um: AT_RING, ..load(20.0, VirtualWork) };
    let drive = drive(&PAPER_5_1);
    let swept = |points| swept_with(&drive, &load, &Deviations::default(), points).unwrap();
    let points = Points::tolerance(1e-6, MAX_STATES).unwrap();
    let (plain, also) = (swept(points), swept(points.also_without_load()));
    assert_eq!(also.input_angles.input_angle_deg.len(), plain.input_angles.input_angle_deg.len() + 2);
    for (contact, peaks) in plain.peaks.iter() {
        let found = also.peaks.get(contact);
        assert!((found.force_n.value / peaks.force_n.value - 1.0).abs() < 1e-6);
        assert!((found.stress_mpa.value / peaks.stress_mpa.value - 1.0).abs() < 1e-6);
    }
    // Sweeps by samples do not change.
    let points = Points::samples(50).unwrap();
    assert_eq!(swept(points).states, swept(points.also_without_load()).states);
}
