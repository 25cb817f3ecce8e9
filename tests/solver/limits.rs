//! What cannot exist, and what must be said of what can.

use toothwave_solver::drive::DriveError;
use toothwave_solver::{
    Compatibility, ContactLaw, Drive, DriveParameters, Finding, LoadCase, Never, Parameter, PerContact, SolveError,
    Torque, Violation, findings,
    sweep::{self, Points},
};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, load, swept};

fn violations(parameters: &DriveParameters) -> Vec<Violation> {
    match Drive::new(parameters) {
        Err(DriveError::Impossible(violations)) => violations,
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_impossible_value_is_named_at_once() {
    let parameters = DriveParameters {
        semi_major_mm: 56.0,
        semi_minor_mm: 58.0,
        teeth: 28,
        installed: 9,
        tooth_radius_mm: -1.0,
        tooth_width_mm: 1e7,
        ring_teeth: 27,
        tip_radius_mm: Some(0.0),
    };
    let found = violations(&parameters);
    let out_of_range =
        |parameter| found.iter().any(|v| matches!(v, Violation::OutOfRange { parameter: p, .. } if *p == parameter));
    assert!(out_of_range(Parameter::ToothRadius));
    assert!(out_of_range(Parameter::ToothWidth));
    assert!(out_of_range(Parameter::TipRadius));
    assert!(found.iter().any(|v| matches!(v, Violation::CamNotElongated { .. })));
    assert!(found.contains(&Violation::ToothDifference { teeth: 28, ring_teeth: 27 }));
    assert!(found.contains(&Violation::InstalledOdd { installed: 9 }));
    assert!(found.contains(&Violation::InstalledNoDivisor { installed: 9, teeth: 28 }));
    assert_eq!(found.len(), 7);
}

#[test]
fn neighbouring_teeth_may_not_touch() {
    let touching = violations(&DriveParameters { tooth_radius_mm: 7.2, ..PAPER_5_1 });
    let [Violation::TeethTouch { tooth_diameter_mm, center_distance_mm }] = touching[..] else {
        panic!("{touching:?}")
    };
    assert!(center_distance_mm <= tooth_diameter_mm);
    // The pair that straddles the minor axis is the nearest: its centres lie on a line parallel to the major axis.
    let p = DriveParameters { tooth_radius_mm: 7.0, ..PAPER_5_1 };
    let fitting = drive(&p);
    let half = std::f64::consts::PI / 28.0;
    let at = |psi: f64| fitting.flank().locus().at(toothwave_solver::Position::from_minor(psi)).unwrap();
    let straddling = 2.0 * at(half).center_radius_mm * half.sin();
    assert!((fitting.least_center_distance_mm().unwrap() - straddling).abs() < 1e-12 * straddling);
    assert!(straddling > 14.0);
}

#[test]
fn without_an_annulus_there_is_no_carrier() {
    let p = DriveParameters { semi_major_mm: 60.0, semi_minor_mm: 48.0, tooth_radius_mm: 1.0, ..PAPER_5_1 };
    assert!(matches!(violations(&p)[..], [Violation::NoCarrierAnnulus { .. }]));
}

#[test]
fn a_bore_must_leave_some_flank() {
    let bored = |tip_radius_mm| DriveParameters { tip_radius_mm: Some(tip_radius_mm), ..PAPER_5_1 };
    assert!(matches!(violations(&bored(68.0))[..], [Violation::BoreLeavesNoFlank { root_radius_mm: 68.0, .. }]));
    assert!(Drive::new(&bored(67.999)).is_ok());
}

#[test]
fn four_teeth_have_a_geometry_but_no_sweep() {
    let p = DriveParameters {
        teeth: 4,
        installed: 4,
        ring_teeth: 2,
        semi_major_mm: 10.0,
        semi_minor_mm: 9.0,
        tooth_radius_mm: 2.0,
        ..PAPER_5_1
    };
    let load = LoadCase::new(&load(1.0, Compatibility::Projection)).unwrap();
    let refused = sweep::sweep(&drive(&p), &load, Points::Samples(10), &Never).unwrap_err();
    assert!(matches!(refused, SolveError::NoToothInMesh { .. }));
}

#[test]
fn stiffnesses_that_differ_much_make_projection_meaningless_and_virtual_work_does_not_care() {
    let mut soft_ring = load(20.0, Compatibility::Projection);
    soft_ring.law = ContactLaw::Fixed(PerContact { wave_generator: 1e9, ring: 1e9, carrier: 1e3 });
    let p = DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..PAPER_5_1 };
    let refused =
        sweep::sweep(&drive(&p), &LoadCase::new(&soft_ring).unwrap(), Points::Samples(10), &Never).unwrap_err();
    assert!(
        matches!(refused, SolveError::ComplianceNotPositive { compliance_mm_per_n, .. } if compliance_mm_per_n <= 0.0)
    );
    soft_ring.compatibility = Compatibility::VirtualWork;
    assert!(swept(&p, &soft_ring, 10).peaks.ring.force_n.value > 0.0);
}

#[test]
fn a_load_names_every_value_out_of_range() {
    let mut parameters = load(20.0, Compatibility::Projection);
    parameters.torque = Torque::Output(0.0);
    parameters.materials.ring.poissons_ratio = 0.5;
    parameters.materials.teeth.youngs_modulus_gpa = 0.0;
    parameters.law = ContactLaw::Fixed(PerContact { wave_generator: 1e-4, ring: 1.0, carrier: 1e16 });
    assert_eq!(LoadCase::new(&parameters).unwrap_err().len(), 5);
}

#[test]
fn not_a_number_is_out_of_every_range() {
    let p = DriveParameters { semi_major_mm: f64::NAN, tooth_radius_mm: f64::INFINITY, ..PAPER_5_1 };
    assert_eq!(violations(&p).len(), 2);
}

#[test]
fn a_sound_drive_has_no_findings() {
    assert_eq!(findings::of_drive(&drive(&PAPER_5_1)).unwrap(), []);
}

#[test]
fn undercut_is_a_finding_and_a_bore_beyond_it_says_so() {
    let found = findings::of_drive(&drive(&PAPER_5_2)).unwrap();
    assert!(matches!(found[..], [Finding::Undercut { is_bored_away: false, .. }]), "{found:?}");
    let found = findings::of_drive(&drive(&PAPER_5_2_BORED)).unwrap();
    assert!(
        matches!(found[..], [Finding::Undercut { is_bored_away: true, .. }, Finding::BoreShortensFlank { .. }]),
        "{found:?}"
    );
}

#[test]
fn a_bore_inside_the_natural_tip_changes_nothing_but_is_a_finding() {
    let p = DriveParameters { tip_radius_mm: Some(65.9), ..PAPER_5_1 };
    let found = findings::of_drive(&drive(&p)).unwrap();
    assert!(matches!(found[..], [Finding::BoreWithoutEffect { .. }]), "{found:?}");
    // A bore that just meets the natural tip says what is there anyway.
    let exact = drive(&DriveParameters { tip_radius_mm: Some(66.0), ..PAPER_5_1 });
    assert_eq!(findings::of_drive(&exact).unwrap(), []);
    let load = load(20.0, Compatibility::Projection);
    assert_eq!(swept(&p, &load, 10), swept(&PAPER_5_1, &load, 10));
}

#[test]
fn a_sweep_stops_when_it_is_told_to() {
    let stop = std::sync::atomic::AtomicBool::new(true);
    let load = LoadCase::new(&load(20.0, Compatibility::Projection)).unwrap();
    assert_eq!(sweep::sweep(&drive(&PAPER_5_1), &load, Points::Samples(50), &stop), Err(SolveError::Stopped));
}

#[test]
fn a_tooth_of_the_critical_radius_or_a_few_roundings_beside_it_is_a_drive() {
    // Found by fuzzing: rounding alone decides here on which side of the threshold the drive is.
    let known = DriveParameters {
        semi_major_mm: 46.8,
        semi_minor_mm: 42.0,
        teeth: 16,
        installed: 2,
        tooth_radius_mm: 6.479_544_353_139_002,
        tooth_width_mm: 10.0,
        ring_teeth: 14,
        tip_radius_mm: None,
    };
    assert!(Drive::new(&known).is_ok());
    let mut tried = 0;
    for a in 41..400_i32 {
        for teeth in [12, 16, 20, 28, 40] {
            let base = DriveParameters {
                semi_major_mm: 40.0 + f64::from(a) / 37.0,
                semi_minor_mm: 40.0,
                teeth,
                installed: 2,
                ring_teeth: teeth - 2,
                tooth_radius_mm: 1.0,
                ..known
            };
            let Some(critical) = Drive::new(&base).ok().and_then(|drive| drive.flank().critical_tooth_radius_mm())
            else {
                continue;
            };
            let bits = critical.to_bits();
            for tooth_radius_mm in (bits - 8..=bits + 8).map(f64::from_bits) {
                match Drive::new(&DriveParameters { tooth_radius_mm, ..base }) {
                    Ok(_) | Err(DriveError::Impossible(_)) => tried += 1,
                    Err(error) => panic!("{tooth_radius_mm} on {base:?}: {error}"),
                }
            }
        }
    }
    assert!(tried > 1_000, "{tried}");
}
