//! Strength of the carrier's fingers, and the capacity of a drive with them.

use std::f64::consts::PI;

use toothwave_solver::fingers::{CarrierFingers, FingerParameters, Fingers, LoadCycle, Strength, stress_concentration};
use toothwave_solver::sweep::{self, LimitedBy, Points, SweepPeaks};
use toothwave_solver::{DriveParameters, LoadCase, LoadParameters, Never, ToothShape, Torque};

use crate::drives::{ECCENTRIC, PAPER_5_1, PAPER_5_2, drive, everywhere};
use crate::fingers::{beam, fingers, held, johnson};

const HOLDINGS: [Fingers; 4] =
    [Fingers::HeldAtOneEnd, Fingers::HeldAtBothEnds, Fingers::FarEndsJoined, Fingers::WebInTheMiddle];

/// 42CrMo4 +QT up to 16 mm.
const HEAT_TREATED: Strength =
    Strength { yield_mpa: 900.0, tensile_mpa: 1100.0, endurance_mpa: 495.0, is_hardened: false };

#[test]
fn notch_counts_more_if_load_is_beside_fillet() {
    let factor = |parameters: &DriveParameters, how| {
        let of = fingers(parameters, held(how), &johnson(1.0));
        of.concentration() / stress_concentration(0.1)
    };
    // The moment at the foot is 0.32 and 0.17 of force times length, of half the length on a web 0.45.
    for (parameters, how, expected) in [
        (PAPER_5_1, Fingers::HeldAtOneEnd, 1.0),
        (PAPER_5_2, Fingers::HeldAtOneEnd, 1.35),
        (PAPER_5_1, Fingers::WebInTheMiddle, 1.0),
        (PAPER_5_1, Fingers::HeldAtBothEnds, 1.35),
        (PAPER_5_1, Fingers::FarEndsJoined, 1.35),
    ] {
        let found = factor(&parameters, how);
        assert!((found - expected).abs() < 1e-12, "{how:?}: {found}, expected {expected}");
    }
}

#[test]
fn stress_concentration_follows_table() {
    for (radius, expected) in [(0.05, 2.39), (0.1, 1.91), (0.15, 1.68), (0.2, 1.54)] {
        assert!((stress_concentration(radius) - expected).abs() < 1e-12);
    }
    let between = stress_concentration(0.12);
    assert!((stress_concentration(5.0) - 1.54).abs() < 1e-12);
    assert!((1.68..1.91).contains(&between) && stress_concentration(0.02) > 3.0);
}

#[test]
fn endured_stress_follows_load_cycle() {
    assert!((HEAT_TREATED.endured_mpa(LoadCycle::Pulsating) - 683.0).abs() < 0.5);
    assert_eq!(HEAT_TREATED.endured_mpa(LoadCycle::Reversed), 495.0);
    let safety = HEAT_TREATED.safety(LoadCycle::Reversed, 450.0, 2.0);
    assert_eq!((safety.yielding, safety.fatigue, safety.least()), (2.0, 0.55, 0.55));
    let hardened = Strength { is_hardened: true, ..HEAT_TREATED };
    assert_eq!(hardened.safety(LoadCycle::Reversed, 450.0, 2.0).yielding, 1.0);
}

#[test]
fn stress_at_foot_is_moment_over_section() {
    let (parameters, p) = (PAPER_5_1, johnson(1.0));
    let beam = beam(&parameters);
    let (sin, cos) = (PI / 28.0).sin_cos();
    let radial = cos + beam.thickness_mm / beam.height_mm * (sin + 0.1);
    for (how, moment_nmm) in [
        (Fingers::HeldAtBothEnds, 600.0 * 15.0 / 12.0),
        (Fingers::FarEndsJoined, 600.0 * 15.0 / 12.0 + 1e6 / (28.0 * 62.0) * 15.0 / 4.0),
    ] {
        let given = FingerParameters { fillet_radius_mm: Some(0.4), friction_coefficient: 0.1, ..held(how) };
        let stress = fingers(&parameters, given, &p).stress(600.0, 1e3);
        let nominal_mpa = 6.0 * moment_nmm / (beam.height_mm * beam.thickness_mm.powi(2)) * radial;
        assert!((stress.moment_nmm / moment_nmm - 1.0).abs() < 1e-12, "{} {moment_nmm}", stress.moment_nmm);
        assert!((stress.nominal_stress_mpa / nominal_mpa - 1.0).abs() < 1e-12);
        let factor = 1.35 * stress_concentration(0.4 / beam.thickness_mm);
        assert!((stress.stress_mpa / stress.nominal_stress_mpa / factor - 1.0).abs() < 1e-12);
        assert_eq!(stress.safety, None);
    }
    // The usual cage, and a fillet of a tenth of the thickness.
    let default = fingers(&parameters, FingerParameters::default(), &p);
    let stress = default.stress(600.0, 1e3);
    assert_eq!(stress.fingers, Fingers::FarEndsJoined);
    assert!((stress.fillet_radius_mm / beam.thickness_mm - 0.1).abs() < 1e-12);
}

/// Sweeps a drive with its fingers.
fn peaks(parameters: &DriveParameters, fingers: &CarrierFingers, load: &LoadParameters) -> SweepPeaks {
    let case = LoadCase::new(load).unwrap();
    let run = |load: &LoadCase| sweep::peaks(&drive(parameters), load, Points::samples(50).unwrap(), &Never);
    fingers.limited(&case, run, |peaks| &mut peaks.torque_capacity).unwrap()
}

/// Under the torque capacity what limits it is at its limit, and nothing is beyond.
#[test]
fn capacity_brings_its_limit_to_one() {
    let flat = DriveParameters { tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 3.0 }, ..PAPER_5_1 };
    let weak = Strength { yield_mpa: 200.0, tensile_mpa: 300.0, endurance_mpa: 120.0, is_hardened: false };
    let soft = Strength { yield_mpa: 60.0, tensile_mpa: 900.0, endurance_mpa: 800.0, is_hardened: false };
    let strong = Strength { yield_mpa: 9e3, tensile_mpa: 1e4, endurance_mpa: 5e3, is_hardened: false };
    let mut seen = Vec::new();
    for (parameters, clearance_um) in [(PAPER_5_1, 0.0), (PAPER_5_1, 5.0), (flat, 0.0), (ECCENTRIC, 2.0)] {
        for (how, strength) in
            HOLDINGS.into_iter().flat_map(|how| [weak, soft, HEAT_TREATED, strong].map(|of| (how, of)))
        {
            let p = LoadParameters {
                allowable_stress_mpa: Some(everywhere(1200.0)),
                clearance_um: everywhere(clearance_um),
                ..johnson(5.0)
            };
            let given = FingerParameters { strength: Some(strength), ..held(how) };
            let fingers = fingers(&parameters, given, &p);
            let capacity = peaks(&parameters, &fingers, &p).torque_capacity.unwrap();
            let under = LoadParameters { torque: Torque::Output(capacity.output_torque_nm), ..p };
            let reached = peaks(&parameters, &fingers, &under);
            let stress = fingers.stress(reached.contacts.carrier.force_n.value, capacity.output_torque_nm);
            let of_contacts = fingers
                .peaks_along(&reached.contacts)
                .iter()
                .fold(0.0, |most: f64, (_, peaks)| most.max(peaks.stress_mpa.value));
            let used = match capacity.limited_by {
                LimitedBy::FingerYield => 1.0 / stress.yield_safety.unwrap(),
                LimitedBy::FingerFatigue => 1.0 / stress.fatigue_safety.unwrap(),
                LimitedBy::WaveGenerator | LimitedBy::Ring | LimitedBy::Carrier => of_contacts / 1200.0,
            };
            let case = (how, clearance_um, capacity.limited_by, used);
            assert!((used - 1.0).abs() < 1e-9, "{case:?}");
            assert!(stress.safety.unwrap() > 1.0 - 1e-9 && of_contacts < 1200.0 * (1.0 + 1e-9), "{case:?} {stress:?}");
            // It does not depend on the load.
            let again = peaks(&parameters, &fingers, &under).torque_capacity.unwrap();
            assert!((again.output_torque_nm / capacity.output_torque_nm - 1.0).abs() < 1e-9);
            seen.push(capacity.limited_by);
        }
    }
    let limits = [LimitedBy::FingerYield, LimitedBy::FingerFatigue, LimitedBy::Ring];
    assert!(limits.iter().all(|limit| seen.contains(limit)), "{seen:?}");
}

#[test]
fn joined_fingers_limit_capacity_to_a_tolerance() {
    let p = LoadParameters { allowable_stress_mpa: Some(everywhere(1e4)), ..johnson(5.0) };
    let given = FingerParameters { strength: Some(HEAT_TREATED), ..held(Fingers::FarEndsJoined) };
    let fingers = fingers(&PAPER_5_1, given, &p);
    let found = |load: &LoadParameters, points| {
        let run = |load: &LoadCase| sweep::peaks(&drive(&PAPER_5_1), load, points, &Never);
        fingers.limited(&LoadCase::new(load).unwrap(), run, |peaks| &mut peaks.torque_capacity).unwrap()
    };
    let tolerance = Points::tolerance(1e-6, 1_000_000).unwrap();
    let capacity = found(&p, tolerance).torque_capacity.unwrap();
    assert_eq!(capacity.limited_by, LimitedBy::FingerFatigue);
    let under = LoadParameters { torque: Torque::Output(capacity.output_torque_nm), ..p };
    let force_n = found(&under, tolerance).contacts.carrier.force_n.value;
    let stress = fingers.stress(force_n, capacity.output_torque_nm);
    assert!((stress.fatigue_safety.unwrap() - 1.0).abs() < 1e-5, "{stress:?}");
}

#[test]
fn uneven_load_divides_capacity_of_contacts() {
    let p = LoadParameters { allowable_stress_mpa: Some(everywhere(1500.0)), ..johnson(5.0) };
    let even = fingers(&PAPER_5_1, FingerParameters::default(), &p);
    let uneven = fingers(&PAPER_5_1, held(Fingers::HeldAtOneEnd), &p);
    let [all, less] = [&even, &uneven].map(|fingers| peaks(&PAPER_5_1, fingers, &p).torque_capacity.unwrap());
    let factor = all.output_torque_nm / less.output_torque_nm;
    assert!((factor / uneven.load_peak_over_mean() - 1.0).abs() < 0.05, "{factor}");
    let found = uneven.peaks_along(&peaks(&PAPER_5_1, &uneven, &p).contacts);
    let means = peaks(&PAPER_5_1, &uneven, &p).contacts;
    let root = uneven.load_peak_over_mean().sqrt();
    for (contact, peak) in found.iter() {
        let mean = means.get(contact);
        assert_eq!(peak.stress_mpa.value, mean.stress_mpa.value * root);
        assert_eq!(peak.half_width_mm, mean.half_width_mm * root);
        assert_eq!(peak.force_n, mean.force_n);
    }
}
