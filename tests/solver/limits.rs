//! Impossible parameters, and findings about possible ones.

use toothwave_solver::drive::{Draft, DriveError};
use toothwave_solver::{
    Compatibility, Contact, ContactLaw, Drive, DriveParameters, FieldCode, Finding, FindingCode, LoadCase,
    LoadParameters, Modification, Never, Parameter, PerContact, Position, Severity, SolveError, ToothShape, Torque,
    Violation, WaveGenerator, findings,
    sweep::{self, Points},
};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, ellipse, load, semi_axes_mm, swept};

fn violations(parameters: &DriveParameters) -> Vec<Violation> {
    match Drive::new(parameters) {
        Err(DriveError::Impossible(violations)) => violations,
        other => panic!("{other:?}"),
    }
}

fn is_out_of_range(violation: &Violation, parameter: Parameter) -> bool {
    violation.code == FieldCode::OutOfRange && violation.parameter == parameter
}

#[test]
fn value_out_of_range_is_written_readably() {
    let told = |tooth_radius_mm| {
        let found = violations(&DriveParameters { tooth_radius_mm, ..PAPER_5_1 });
        let of_radius = |v: &&Violation| is_out_of_range(v, Parameter::ToothRadius);
        found.iter().find(of_radius).unwrap().to_string()
    };
    for (value, written) in [(0.0, "0"), (-0.5, "-0.5"), (2e6, "2000000"), (1e7, "1e7"), (5e-7, "5e-7")] {
        assert_eq!(told(value), format!("{written} is out of range: choose a value from 1e-6 to 1000000 mm"));
    }
}

#[test]
fn reports_all_impossible_values_at_once() {
    let parameters = DriveParameters {
        wave_generator: ellipse(56.0, 58.0),
        teeth: 28,
        installed: 9,
        tooth_radius_mm: -1.0,
        tooth: ToothShape::Cylinder { width_mm: 1e7 },
        ring_teeth: 27,
        tip_radius_mm: Some(0.0),
    };
    let found = violations(&parameters);
    let out_of_range = |parameter| found.iter().any(|v| is_out_of_range(v, parameter));
    assert!(out_of_range(Parameter::ToothRadius));
    assert!(out_of_range(Parameter::ToothWidth));
    assert!(out_of_range(Parameter::TipRadius));
    let told = |code, value, words: &str| {
        found.iter().any(|v| v.code == code && v.value == Some(value) && v.to_string().contains(words))
    };
    assert!(told(FieldCode::CamNotElongated, 56.0, "must exceed the semi-minor axis (58.0 mm)"));
    assert!(told(FieldCode::ToothDifference, 27.0, "with 28 teeth the ring has 26 or 30, not 27"));
    assert!(told(FieldCode::InstalledNoDivisor, 9.0, "9 installed teeth do not divide 28"));
    assert_eq!(found.len(), 6);
}

#[test]
fn neighbouring_teeth_must_not_touch() {
    let touching = violations(&DriveParameters { tooth_radius_mm: 7.2, ..PAPER_5_1 });
    let [Violation { code: FieldCode::TeethTouch, value: Some(7.2), .. }] = touching[..] else {
        panic!("{touching:?}")
    };
    let told = touching[0].to_string();
    let told = told.strip_prefix("neighbouring teeth of 14.4 mm diameter come as near as ").expect("the diameter");
    let center_distance_mm: f64 = told.split(' ').next().unwrap().parse().unwrap();
    assert!(center_distance_mm > 14.0 && center_distance_mm <= 14.4, "{center_distance_mm}");
    // The pair that straddles the minor axis is the nearest: its centres lie on a line parallel to the major axis.
    let p = DriveParameters { tooth_radius_mm: 7.0, ..PAPER_5_1 };
    let fitting = drive(&p);
    let half = std::f64::consts::PI / 28.0;
    let at = |psi: f64| fitting.flank().locus().at(Position::from_valley(psi, 2)).unwrap();
    let straddling = 2.0 * at(half).center_radius_mm * half.sin();
    assert!((fitting.least_center_distance_mm().unwrap() - straddling).abs() < 1e-12 * straddling);
    assert!(straddling > 14.0);
}

#[test]
fn three_teeth_are_nearest_across_major_axis() {
    // A third of a turn apart, they are nearer to the minor axis than the pair on both sides of it.
    let p = DriveParameters {
        wave_generator: ellipse(58.0, 50.0),
        teeth: 12,
        installed: 3,
        tooth_radius_mm: 5.0,
        ring_teeth: 10,
        ..PAPER_5_1
    };
    let fitting = drive(&p);
    let at = |turn: f64| {
        // The ellipse is its own mirror image about both axes.
        let (sin, cos) = (2.0 * std::f64::consts::PI * turn).sin_cos();
        let tooth = fitting.flank().locus().at(Position::from_lobe(sin.abs().atan2(cos.abs()), 2)).unwrap();
        (tooth.center_radius_mm * cos, tooth.center_radius_mm * sin)
    };
    let distance = |turn: f64| {
        let ((x, y), (x2, y2)) = (at(turn), at(turn + 1.0 / 3.0));
        (x - x2).hypot(y - y2)
    };
    let least = (0..3600).map(|i| distance(f64::from(i) / 3600.0)).fold(f64::INFINITY, f64::min);
    let told = fitting.least_center_distance_mm().unwrap();
    assert!((told - least).abs() < 1e-12 * least, "{told} is not {least}");
}

/// Returns the touching radius that the violation of these parameters reports.
fn touching_radius_mm(parameters: &DriveParameters) -> f64 {
    let found = violations(parameters);
    let touching = found.iter().find(|violation| violation.code == FieldCode::TeethTouch);
    touching.and_then(|violation| violation.limit).unwrap_or_else(|| panic!("{found:?}"))
}

fn teeth_touch(parameters: &DriveParameters) -> bool {
    match Drive::new(parameters) {
        Ok(_) => false,
        Err(DriveError::Impossible(found)) => found.iter().any(|v| v.code == FieldCode::TeethTouch),
        Err(error) => panic!("{error}"),
    }
}

/// Returns drives with touching teeth: round and elliptic, few and many teeth, empty slots, and ends of ranges.
fn touching_drives() -> Vec<DriveParameters> {
    let of = |semi_major_mm, semi_minor_mm, teeth, installed, tooth_radius_mm| DriveParameters {
        wave_generator: ellipse(semi_major_mm, semi_minor_mm),
        teeth,
        installed,
        tooth_radius_mm,
        ring_teeth: teeth - 2,
        ..PAPER_5_1
    };
    vec![
        of(58.0, 56.0, 28, 28, 9.0),
        of(58.0, 56.0, 28, 14, 20.0),
        of(58.0, 56.0, 28, 4, 400.0),
        of(58.0, 2.0, 6, 6, 30.0),
        of(58.0, 20.0, 10, 10, 1e6),
        of(50.7, 49.3, 80, 40, 5.0),
        of(56.000_001, 56.0, 28, 28, 7.2),
        of(1e5, 0.1, 100, 100, 5e5),
        of(1e5, 99_999.9, 10_000, 10_000, 1e6),
        of(1e-3, 9e-4, 30, 30, 1e6),
        of(58.0, 56.0, 6, 3, 1e3),
        of(13.0, 10.0, 6, 3, 75.0),
        of(1e5, 0.1, 9, 3, 1e6),
    ]
}

#[test]
fn reported_touching_radius_is_the_threshold() {
    assert!((touching_radius_mm(&DriveParameters { tooth_radius_mm: 9.0, ..PAPER_5_1 }) - 7.06).abs() < 0.01);
    for p in touching_drives() {
        let limit = touching_radius_mm(&p);
        let of_radius = |tooth_radius_mm| DriveParameters { tooth_radius_mm, ..p };
        assert!(!teeth_touch(&of_radius(limit * (1.0 - 1e-12))), "{limit} of {p:?}");
        assert!(teeth_touch(&of_radius(limit * (1.0 + 1e-12))), "{limit} of {p:?}");
    }
}

#[test]
fn touching_radius_matches_search_on_cam_points() {
    // Independent of the solver's path: cam points by the ellipse's parameter, and centres along their normals.
    // Bisection over the radius uses the least distance of pairs whose polar angles differ by one spacing.
    for p in touching_drives() {
        let (a, b) = semi_axes_mm(&p);
        if p.installed > 100 || a > 10.0 * b {
            continue;
        }
        let center = |t: f64, r: f64| {
            let length = (b * t.cos()).hypot(a * t.sin());
            ((a + r * b / length) * t.cos(), (b + r * a / length) * t.sin())
        };
        let spacing = 2.0 * std::f64::consts::PI / p.installed as f64;
        let distance = |t: f64, r: f64| {
            let (x, y) = center(t, r);
            let wanted = y.atan2(x) + spacing;
            let (mut low, mut high) = (t, t + 4.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let (x, y) = center(middle, r);
                let turned = (y.atan2(x) - wanted).rem_euclid(2.0 * std::f64::consts::PI);
                if turned < std::f64::consts::PI { high = middle } else { low = middle }
            }
            let (x2, y2) = center(0.5 * (low + high), r);
            (x - x2).hypot(y - y2)
        };
        let touch = |r: f64| {
            let (mut from, mut to) = (0.0, std::f64::consts::PI);
            let mut least = f64::INFINITY;
            for _ in 0..8 {
                let step = (to - from) / 60.0;
                let scanned = (0..=60).map(|i| from + f64::from(i) * step).map(|t| (t, distance(t, r)));
                let (t, value) = scanned.min_by(|one, other| one.1.total_cmp(&other.1)).unwrap();
                least = least.min(value);
                (from, to) = (t - step, t + step);
            }
            least <= 2.0 * r
        };
        let (mut free, mut touching) = (0.0, p.tooth_radius_mm);
        for _ in 0..100 {
            let middle = 0.5 * (free + touching);
            if touch(middle) { touching = middle } else { free = middle }
        }
        let limit = touching_radius_mm(&p);
        assert!((limit - touching).abs() <= 1e-9 * touching, "{limit} is not {touching} of {p:?}");
    }
}

#[test]
fn thicker_teeth_have_narrower_gaps() {
    for p in touching_drives() {
        let limit = touching_radius_mm(&p);
        let mut last = f64::INFINITY;
        for share in 1..40 {
            let tooth_radius_mm = limit * f64::from(share) / 40.0;
            // A wide bore, so that thin teeth leave an annulus.
            let Ok(drive) = Drive::new(&DriveParameters {
                tooth_radius_mm,
                tip_radius_mm: Some(semi_axes_mm(&p).0 + tooth_radius_mm),
                ..p
            }) else {
                continue;
            };
            let gap = drive.least_center_distance_mm().unwrap() - 2.0 * tooth_radius_mm;
            assert!(gap < last && gap > 0.0, "{gap} after {last} at {tooth_radius_mm} of {p:?}");
            last = gap;
        }
        assert!(last < f64::INFINITY);
    }
}

/// Returns the violations of tooth numbers that do not fit each other.
fn told_of_counts(teeth: i64, installed: i64, ring_teeth: i64) -> Vec<Violation> {
    let found = violations(&DriveParameters { teeth, installed, ring_teeth, ..PAPER_5_1 });
    let of_counts = |v: &Violation| matches!(v.code, FieldCode::ToothDifference | FieldCode::InstalledNoDivisor);
    found.into_iter().filter(of_counts).collect()
}

#[test]
fn impossible_tooth_count_has_possible_neighbours() {
    let is_told = |teeth, installed, ring_teeth, words: &str| {
        let told = told_of_counts(teeth, installed, ring_teeth);
        assert!(told.len() == 1 && told[0].to_string().ends_with(words), "{told:?}: not {words}");
    };
    is_told(28, 8, 26, "; choose 7 or 14");
    is_told(28, 56, 26, "; choose 28");
    is_told(27, 4, 25, "; choose 3 or 9");
    is_told(2, 2, 2, " the ring has 4, not 2");
    is_told(10_000, 10_000, 10_000, " the ring has 9998, not 10000");
    is_told(28, 28, 28, " the ring has 26 or 30, not 28");
}

#[test]
fn proposes_nearest_count_and_lower_on_tie() {
    let proposed = |teeth, installed, ring_teeth| told_of_counts(teeth, installed, ring_teeth)[0].limit.unwrap();
    assert_eq!(proposed(28, 8, 26), 7.0);
    assert_eq!(proposed(28, 12, 26), 14.0);
    assert_eq!(proposed(27, 8, 25), 9.0);
    assert_eq!(proposed(27, 6, 25), 3.0);
    assert_eq!(proposed(28, 56, 26), 28.0);
    assert_eq!(proposed(28, 28, 28), 26.0);
}

#[test]
fn projection_on_steep_flank_is_a_finding() {
    let load = LoadCase::new(&load(20.0, Compatibility::Projection)).unwrap();
    let told = [PAPER_5_1, PAPER_5_2, DriveParameters { wave_generator: ellipse(58.0, 57.8), ..PAPER_5_1 }].map(|p| {
        let drive = drive(&p);
        let found = findings::of_projection(&drive, &load).unwrap();
        let is_told = found.iter().any(|found| found.code == FindingCode::ProjectionOnSteepFlank);
        assert_eq!(is_told, drive.largest_pressure_angle_deg().unwrap() > findings::STEEP_FOR_PROJECTION_DEG, "{p:?}");
        is_told
    });
    assert!(told.contains(&true) && told.contains(&false), "{told:?}");
}

#[test]
fn shared_allowable_stress_is_reported_once() {
    let told = |wave_generator, ring, carrier| -> Vec<_> {
        let allowable_stress_mpa = Some(PerContact { wave_generator, ring, carrier });
        let load = LoadParameters { allowable_stress_mpa, ..load(20.0, Compatibility::Projection) };
        let of_range = |violation: Violation| match violation {
            Violation { code: FieldCode::OutOfRange, parameter, .. } => parameter,
            other => panic!("{other:?}"),
        };
        LoadCase::new(&load).unwrap_err().into_iter().map(of_range).collect()
    };
    let at = Parameter::AllowableStressAt;
    assert_eq!(told(-1.0, -1.0, -1.0), [Parameter::AllowableStress]);
    assert_eq!(told(-1.0, -1.0, 900.0), [at(Contact::WaveGenerator), at(Contact::Ring)]);
    assert_eq!(told(900.0, -1.0, -1.0), [at(Contact::Ring), at(Contact::Carrier)]);
}

#[test]
fn draft_has_the_violations_of_its_drive() {
    for p in [DriveParameters { tooth_radius_mm: 7.2, ..PAPER_5_1 }, DriveParameters { ring_teeth: 27, ..PAPER_5_1 }] {
        assert_eq!(Draft::new(&p).unwrap().violations(), violations(&p));
    }
    assert_eq!(Draft::new(&PAPER_5_1).unwrap().violations(), []);
}

#[test]
fn wind_up_beyond_model_is_a_finding() {
    let drive = drive(&PAPER_5_1);
    // A carrier turned by τ gives a wind-up of Z_G/U = 14 times τ, and a light load adds nothing.
    let found = |carrier_rotation_arcsec| {
        let modification = Modification { carrier_rotation_arcsec, ..Modification::default() };
        let load = LoadParameters { modification, ..load(1e-9, Compatibility::VirtualWork) };
        let sweep = swept(&PAPER_5_1, &load, 4);
        findings::of_wind_up(&drive, &LoadCase::new(&load).unwrap(), &sweep)
    };
    assert_eq!(found(350.0), None);
    let Finding { code, value: wind_up_deg, limit: limit_deg, .. } = found(360.0).unwrap();
    assert_eq!(code, FindingCode::WindUpBeyondModel);
    assert!((wind_up_deg - 1.4).abs() < 1e-6 && (limit_deg - 36.0 / 26.0).abs() < 1e-14, "{wind_up_deg} {limit_deg}");
}

#[test]
fn stress_above_allowable_is_a_finding() {
    let allowable = PerContact { wave_generator: 800.0, ring: 5000.0, carrier: 5000.0 };
    let load = LoadParameters { allowable_stress_mpa: Some(allowable), ..load(20.0, Compatibility::Projection) };
    let peaks = swept(&PAPER_5_1, &load, 10).peaks;
    let found = findings::of_contacts(&drive(&PAPER_5_1), &LoadCase::new(&load).unwrap(), &peaks, false);
    let expected = Finding {
        code: FindingCode::StressAboveAllowable,
        severity: Severity::Warning,
        value: peaks.wave_generator.stress_mpa.value,
        limit: 800.0,
        contact: Some(Contact::WaveGenerator),
    };
    assert_eq!(found, [expected]);
}

/// A groove of radius `r_g`, half a ball's radius t deep, is `2√(t (2r_g - t))` wide at its edges.
#[test]
fn contact_longer_than_groove_width_is_a_finding() {
    let groove_radius_mm = PerContact { wave_generator: Some(5.2), ring: None, carrier: None };
    let parameters = DriveParameters { tooth: ToothShape::Ball { groove_radius_mm }, ..PAPER_5_1 };
    let load = LoadParameters { law: ContactLaw::Hertz, ..load(1.0, Compatibility::VirtualWork) };
    let mut peaks = swept(&parameters, &load, 4).peaks;
    let mut found = |half_length_mm| {
        peaks.wave_generator.half_length_mm = Some(half_length_mm);
        findings::of_contacts(&drive(&parameters), &LoadCase::new(&load).unwrap(), &peaks, false)
    };
    let edge_mm = (2.5 * (10.4 - 2.5_f64)).sqrt();
    let is_told = |found: &[Finding]| found.iter().any(|found| found.code == FindingCode::ContactBeyondGroove);
    assert!(!is_told(&found(edge_mm - 1e-9)) && is_told(&found(edge_mm + 1e-9)));
}

/// Hertz and Palmgren for a steel cylinder at the wave generator, L1 = 15 mm, and moduli of other materials.
#[test]
fn contact_findings_have_formula_values() {
    let drive = drive(&PAPER_5_1);
    let found = |load: &LoadParameters, approaches_matter| {
        let peaks = swept(&PAPER_5_1, load, 10).peaks;
        let force_n = peaks.wave_generator.force_n.value;
        (findings::of_contacts(&drive, &LoadCase::new(load).unwrap(), &peaks, approaches_matter), force_n)
    };
    let near = |one: f64, other: f64| (one / other - 1.0).abs() < 1e-13;
    let linear = load(20.0, Compatibility::Projection);
    assert_eq!(found(&linear, false).0, []);
    let (told, force_n) = found(&linear, true);
    let [Finding { code: FindingCode::LinearLawTooStiff, value: linear_um, limit: palmgren_um, .. }] = told[..] else {
        panic!("{told:?}")
    };
    let contact_modulus_mpa = 210e3 / (2.0 * (1.0 - 0.09));
    assert!(near(linear_um, 1e3 * force_n / (std::f64::consts::FRAC_PI_2 * 15.0 * contact_modulus_mpa)), "{linear_um}");
    assert!(near(palmgren_um, 1e3 * 3.84e-5 * force_n.powf(0.9) / 15_f64.powf(0.8)), "{palmgren_um}");

    let mut palmgren = LoadParameters { law: ContactLaw::Palmgren, ..linear };
    assert_eq!(found(&palmgren, true).0, []);
    palmgren.materials.ring.youngs_modulus_gpa = 105.0;
    let (told, _) = found(&palmgren, true);
    let [Finding { code, value: contact_modulus_gpa, limit: steel_gpa, contact, .. }] = told[..] else {
        panic!("{told:?}")
    };
    assert_eq!((code, contact), (FindingCode::PalmgrenBeyondSteel, Some(Contact::Ring)));
    assert!(near(steel_gpa, 1e-3 * contact_modulus_mpa));
    assert!(near(contact_modulus_gpa, 1.0 / (0.91 / 210.0 + 0.91 / 105.0)), "{contact_modulus_gpa}");
}

#[test]
fn any_divisor_of_teeth_may_be_installed() {
    for (teeth, installed) in [(28, 7), (27, 27), (27, 9), (28, 14)] {
        assert!(Drive::new(&DriveParameters { teeth, installed, ring_teeth: teeth - 2, ..PAPER_5_1 }).is_ok());
    }
}

#[test]
fn carrier_needs_an_annulus() {
    let p = DriveParameters { wave_generator: ellipse(60.0, 48.0), tooth_radius_mm: 1.0, ..PAPER_5_1 };
    assert!(matches!(violations(&p)[..], [Violation { code: FieldCode::NoCarrierAnnulus, .. }]));
}

#[test]
fn bore_must_leave_some_flank() {
    let bored = |tip_radius_mm| DriveParameters { tip_radius_mm: Some(tip_radius_mm), ..PAPER_5_1 };
    let found = violations(&bored(68.0));
    let [Violation { code: FieldCode::BoreLeavesNoFlank, limit: Some(68.0), .. }] = found[..] else {
        panic!("{found:?}")
    };
    assert!(Drive::new(&bored(67.999)).is_ok());
}

#[test]
fn four_teeth_have_geometry_but_no_sweep() {
    let p = DriveParameters {
        teeth: 4,
        installed: 4,
        ring_teeth: 2,
        wave_generator: ellipse(10.0, 9.0),
        tooth_radius_mm: 2.0,
        ..PAPER_5_1
    };
    let load = LoadCase::new(&load(1.0, Compatibility::Projection)).unwrap();
    let refused = sweep::sweep(&drive(&p), &load, Points::samples(10).unwrap(), &Never).unwrap_err();
    assert!(matches!(refused, SolveError::NoToothInMesh { .. }));
}

#[test]
fn teeth_on_given_path_touch_at_valley_chord() {
    // d_v sin(π/28) with d_v = 59 mm.
    let half_chord_mm = 59.0 * (std::f64::consts::PI / 28.0).sin();
    let touches = |share: f64| {
        let wave_generator = WaveGenerator::HarmonicPath { lobes: 2, mean_path_radius_mm: 60.0, amplitude_mm: 1.0 };
        let p = DriveParameters { wave_generator, tooth_radius_mm: share * half_chord_mm, ..PAPER_5_1 };
        match Drive::new(&p) {
            Ok(_) => false,
            Err(DriveError::Impossible(found)) => found.iter().any(|v| v.code == FieldCode::TeethTouch),
            Err(other) => panic!("{other}"),
        }
    };
    assert!(!touches(0.99) && touches(1.02));
}

#[test]
fn unequal_stiffnesses_break_projection_but_not_virtual_work() {
    let mut soft_ring = load(20.0, Compatibility::Projection);
    soft_ring.law = ContactLaw::Fixed(PerContact { wave_generator: 1e9, ring: 1e9, carrier: 1e3 });
    let p = DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..PAPER_5_1 };
    let refused = sweep::sweep(&drive(&p), &LoadCase::new(&soft_ring).unwrap(), Points::samples(10).unwrap(), &Never)
        .unwrap_err();
    assert!(
        matches!(refused, SolveError::ComplianceNotPositive { compliance_mm_per_n, .. } if compliance_mm_per_n <= 0.0)
    );
    soft_ring.compatibility = Compatibility::VirtualWork;
    assert!(swept(&p, &soft_ring, 10).peaks.ring.force_n.value > 0.0);
}

#[test]
fn load_reports_every_value_out_of_range() {
    let mut parameters = load(20.0, Compatibility::Projection);
    parameters.torque = Torque::Output(0.0);
    parameters.materials.ring.poissons_ratio = 0.5;
    parameters.materials.teeth.youngs_modulus_gpa = 0.0;
    parameters.law = ContactLaw::Fixed(PerContact { wave_generator: 1e-4, ring: 1.0, carrier: 1e16 });
    assert_eq!(LoadCase::new(&parameters).unwrap_err().len(), 5);
}

#[test]
fn not_a_number_is_out_of_every_range() {
    let p = DriveParameters { wave_generator: ellipse(f64::NAN, 56.0), tooth_radius_mm: f64::INFINITY, ..PAPER_5_1 };
    assert_eq!(violations(&p).len(), 2);
}

#[test]
fn sound_drive_has_no_findings() {
    assert_eq!(findings::of_drive(&drive(&PAPER_5_1)).unwrap(), []);
}

#[test]
fn undercut_is_a_finding_and_notes_larger_bore() {
    let found = |parameters: &DriveParameters| -> Vec<_> {
        let found = findings::of_drive(&drive(parameters)).unwrap();
        found.iter().map(|finding| (finding.code, finding.severity)).collect()
    };
    assert_eq!(found(&PAPER_5_2), [(FindingCode::Undercut, Severity::Warning)]);
    let bored = [(FindingCode::Undercut, Severity::Info), (FindingCode::BoreShortensFlank, Severity::Info)];
    assert_eq!(found(&PAPER_5_2_BORED), bored);
}

#[test]
fn bore_inside_natural_tip_is_only_a_finding() {
    let p = DriveParameters { tip_radius_mm: Some(65.9), ..PAPER_5_1 };
    let found = findings::of_drive(&drive(&p)).unwrap();
    assert_eq!(found.iter().map(|finding| finding.code).collect::<Vec<_>>(), [FindingCode::BoreWithoutEffect]);
    // A bore that just meets the natural tip says what is there anyway.
    let exact = drive(&DriveParameters { tip_radius_mm: Some(66.0), ..PAPER_5_1 });
    assert_eq!(findings::of_drive(&exact).unwrap(), []);
    let load = load(20.0, Compatibility::Projection);
    assert_eq!(swept(&p, &load, 10), swept(&PAPER_5_1, &load, 10));
}

#[test]
fn rejects_impossible_sample_count_or_tolerance() {
    for count in [0, 10_000_001, u64::MAX] {
        assert!(is_out_of_range(&Points::samples(count).unwrap_err(), Parameter::Samples));
    }
    for tolerance in [f64::NAN, 0.0, -1e-3, f64::INFINITY] {
        let refused = Points::tolerance(tolerance, 1000);
        assert!(is_out_of_range(&refused.unwrap_err(), Parameter::SweepTolerance));
    }
    assert!(Points::samples(1).is_ok() && Points::tolerance(1e-12, 1).is_ok());
    assert_eq!(Points::finest(7), Points::tolerance(1e-12, 7).unwrap());
}

#[test]
fn positions_at_both_axes_are_exact() {
    assert_eq!(Position::of_lobe(1, 2, 2), Position::valley(2));
    assert_eq!(Position::of_lobe(0, 2, 2), Position::lobe(2));
}

#[test]
fn sweep_stops_on_request() {
    let stop = std::sync::atomic::AtomicBool::new(true);
    let load = LoadCase::new(&load(20.0, Compatibility::Projection)).unwrap();
    assert_eq!(sweep::sweep(&drive(&PAPER_5_1), &load, Points::samples(50).unwrap(), &stop), Err(SolveError::Stopped));
}

#[test]
fn radii_around_critical_radius_give_a_drive() {
    // Found by fuzzing: rounding decides on which side of the threshold the drive is.
    let known = DriveParameters {
        wave_generator: ellipse(46.8, 42.0),
        teeth: 16,
        installed: 2,
        tooth_radius_mm: 6.479_544_353_139_002,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 14,
        tip_radius_mm: None,
    };
    assert!(Drive::new(&known).is_ok());
    let mut tried = 0;
    for a in 41..400_i32 {
        for teeth in [12, 16, 20, 28, 40] {
            let base = DriveParameters {
                wave_generator: ellipse(40.0 + f64::from(a) / 37.0, 40.0),
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

#[test]
fn gap_is_a_finding_under_projection_only() {
    let found = |compatibility| {
        let gaps = PerContact { wave_generator: 0.0, ring: 10.0, carrier: 4.0 };
        let load = LoadParameters { clearance_um: gaps, ..load(20.0, compatibility) };
        findings::of_projection(&drive(&PAPER_5_1), &LoadCase::new(&load).unwrap()).unwrap()
    };
    let of_gap = |finding: &Finding| finding.code == FindingCode::ProjectionWithGap && finding.value == 10.0;
    assert!(found(Compatibility::Projection).iter().any(of_gap));
    assert_eq!(found(Compatibility::VirtualWork), []);
}
