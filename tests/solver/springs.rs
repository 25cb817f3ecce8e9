//! Load sharing among springs, and light loads across wide gaps.

use std::cell::Cell;
use std::f64::consts::PI;

use proptest::prelude::*;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::approach::{Approach, Logarithmic};
use toothwave_solver::load_sharing::LoadedDrive;
use toothwave_solver::springs::{Rotation, Spring, Springs};
use toothwave_solver::sweep::{self, Points};
use toothwave_solver::{
    Contact, ContactLaw, Deviations, DriveParameters, FieldCode, LoadCase, LoadParameters, Modification, Never,
    Parameter, Part, PerContact, Position, SolveError, ToothShape, Torque, Violation,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, cases, drive, ellipse, everywhere, load, swept};

const STIFFNESS: PerContact<f64> = PerContact { wave_generator: 4.1e5, ring: 6.3e5, carrier: 2.2e5 };

fn laws() -> [ContactLaw; 3] {
    [ContactLaw::Linear, ContactLaw::Fixed(STIFFNESS), ContactLaw::Palmgren]
}

#[test]
fn forces_balance_any_torque_to_1e_12() {
    let mut worst = (0.0_f64, String::new());
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        let drive = drive(&parameters);
        for law in laws() {
            for exponent in [-12, -9, -6, -3, 0, 3, 6, 9, 12, 15] {
                for gap_um in [0.0, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
                    for contact in Contact::all() {
                        let clearance_um = PerContact::of(|at| if at == contact { gap_um } else { 0.0 });
                        let torque = Torque::Input(10.0_f64.powi(exponent));
                        let parameters = LoadParameters { torque, law, clearance_um, ..load(1.0, VirtualWork) };
                        let case = LoadCase::new(&parameters).unwrap();
                        let sweep = sweep::sweep(&drive, &case, Points::samples(2).unwrap(), &Never).unwrap();
                        let residual = sweep.torque_balance_residual;
                        if residual > worst.0 || residual.is_nan() {
                            worst = (residual, format!("{law:?}, {torque:?}, {gap_um} um at {contact:?}"));
                        }
                    }
                }
            }
        }
    }
    assert!(worst.0 <= 1e-12, "{worst:?}");
}

/// An approach of 1e-313 mm exceeds the range of doubles in the logarithm of Johnson's law.
#[test]
fn negligible_gaps_do_not_change_loads() {
    let drive = drive(&PAPER_5_1);
    for law in [ContactLaw::JOHNSON, ContactLaw::Palmgren, ContactLaw::Linear] {
        for torque_nm in [1e-12, 20.0, 1e3] {
            let without = LoadParameters { law, ..load(torque_nm, VirtualWork) };
            let swept = |parameters: LoadParameters| {
                let case = LoadCase::new(&parameters).unwrap();
                let found = [sweep::sweep, sweep::sweep_plain]
                    .map(|sweep| sweep(&drive, &case, Points::samples(4).unwrap(), &Never).unwrap());
                found.map(|sweep| {
                    assert!(sweep.torque_balance_residual <= 1e-12, "{law:?}: {:e}", sweep.torque_balance_residual);
                    sweep.peaks.ring.force_n.value
                })
            };
            let [force_n, _] = swept(without);
            for gap_um in [5e-324, 1e-310, 1e-300, 1e-250, 1e-150] {
                let clearance_um = PerContact { ring: gap_um, ..PerContact::default() };
                let modification = Modification { ring_equidistant_um: gap_um, ..Modification::NONE };
                for loaded in [LoadParameters { clearance_um, ..without }, LoadParameters { modification, ..without }] {
                    for found_n in swept(loaded) {
                        assert!((found_n / force_n - 1.0).abs() < 1e-12, "{law:?}, {torque_nm} N·m, {gap_um:e} µm");
                    }
                }
            }
        }
    }
}

/// Rounding of closing angles must not separate the teeth under 1e-12 N·m.
#[test]
fn equal_rotation_is_lost_motion_under_any_load() {
    let drive = drive(&DriveParameters { teeth: 14, installed: 14, ring_teeth: 12, ..PAPER_5_1 });
    let arcsec = 60.0;
    let rad = arcsec * PI / 648_000.0;
    let modified = |modification| (modification, Deviations::default());
    let deviating = |deviations| (Modification::default(), deviations);
    let turned = [
        (modified(Modification { ring_rotation_arcsec: arcsec, ..Modification::NONE }), 6.0 * rad),
        (modified(Modification { carrier_rotation_arcsec: arcsec, ..Modification::NONE }), 7.0 * rad),
        (modified(Modification { ring_rotation_arcsec: 1e5, ..Modification::NONE }), 6.0 * 1e5 / arcsec * rad),
        (deviating(Deviations { slot_angle_arcsec: vec![arcsec; 14], ..Deviations::default() }), 7.0 * rad),
        (deviating(Deviations { ring_space_angle_arcsec: vec![arcsec; 12], ..Deviations::default() }), 6.0 * rad),
    ];
    let johnson = ContactLaw::JOHNSON;
    for law in laws().into_iter().chain([johnson]) {
        for torque_nm in [1e-12, 1e-9, 1e-6, 1e-3, 1.0] {
            let swept = |modification, deviations: &Deviations| {
                let parameters = LoadParameters { law, modification, ..load(torque_nm, VirtualWork) };
                let (case, points) = (LoadCase::new(&parameters).unwrap(), Points::samples(7).unwrap());
                sweep::sweep_with_deviations(&drive, &case, deviations, points, &Never).unwrap()
            };
            let nominal = swept(Modification::NONE, &Deviations::default());
            for ((modification, deviations), lost_rad) in &turned {
                let found = swept(*modification, deviations);
                for (contact, peaks) in nominal.peaks.iter() {
                    let off = found.peaks.get(contact).force_n.value / peaks.force_n.value - 1.0;
                    assert!(off.abs() < 1e-12, "{law:?}, {torque_nm} N·m, {modification:?}, {deviations:?}: {off:e}");
                }
                let expected_deg = nominal.input_angles.wind_up_deg[3] + lost_rad.to_degrees();
                assert!((found.input_angles.wind_up_deg[3] / expected_deg - 1.0).abs() < 1e-14);
                let parameters = LoadParameters { law, modification: *modification, ..load(torque_nm, VirtualWork) };
                let case = LoadCase::new(&parameters).unwrap();
                let unloaded = sweep::unloaded_wind_up_deg(&drive, &case, deviations, &found, &Never).unwrap();
                assert!((unloaded[3] / lost_rad.to_degrees() - 1.0).abs() < 1e-14, "{}", unloaded[3]);
            }
        }
    }
}

#[test]
fn tooth_on_minor_axis_never_closes_slot_gap() {
    // Gap and lever arm vanish there together, so the tooth must not count as closed.
    let drive = drive(&PAPER_5_1);
    let mut parameters = load(1e-9, VirtualWork);
    parameters.clearance_um.carrier = 1000.0;
    let case = LoadCase::new(&parameters).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    assert_eq!(loaded.tooth(Position::valley(2)).unwrap().spring.closing_rad, f64::INFINITY);
    let sweep = sweep::sweep(&drive, &case, Points::samples(2).unwrap(), &Never).unwrap();
    assert!(sweep.torque_balance_residual < 1e-14, "{:e}", sweep.torque_balance_residual);
}

#[test]
fn tooth_without_arm_alone_carries_nothing() {
    let drive = drive(&PAPER_5_1);
    for contact in [None, Some(Contact::WaveGenerator), Some(Contact::Carrier)] {
        let mut parameters = load(20.0, VirtualWork);
        parameters.clearance_um = PerContact::of(|at| if Some(at) == contact { 10.0 } else { 0.0 });
        parameters.allowable_stress_mpa = Some(everywhere(1500.0));
        let loaded = LoadCase::new(&parameters).unwrap();
        let loaded = LoadedDrive::new(&drive, &loaded).unwrap();
        let tip = [loaded.tooth(Position::valley(2)).unwrap()];
        assert_eq!(loaded.wind_up(&tip), Err(SolveError::NoLeverArm));
        assert_eq!(loaded.torque_limit(&tip, &everywhere(1500.0)).map(|_| ()), Err(SolveError::NoLeverArm));
        assert_eq!(loaded.wind_up(&[]), Err(SolveError::NoLeverArm));
    }
}

#[test]
fn crate_refuses_gap_that_projection_turns_into_load() {
    let larger = drive(&DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..PAPER_5_1 });
    let mut parameters = load(20.0, Projection);
    parameters.clearance_um.carrier = 500.0;
    let case = LoadCase::new(&parameters).unwrap();
    let refused = sweep::sweep(&larger, &case, Points::samples(10).unwrap(), &Never);
    let Err(SolveError::Impossible(found)) = refused else { panic!("{refused:?}") };
    let [Violation { code: FieldCode::ClearanceNotMonotone, parameter, value: Some(500.0), .. }] = found[..] else {
        panic!("{found:?}")
    };
    assert_eq!(parameter, Parameter::PartClearance(Part::Carrier));
}

#[test]
fn early_tooth_of_tiny_arm_costs_no_digits() {
    // The first tooth alone would need 1e9 rad. The next one's approach is 1e-15 of the first one's way.
    let approach = Approach::Linear { compliance_mm_per_n: 1e-6 };
    let spring = |arm_mm: f64, closing_rad| Spring { arm_mm, arm_decline_mm_per_rad: 0.0, closing_rad, approach };
    let springs = [spring(1e-12, 0.0), spring(1.7, 1.1), spring(1.9, 2.3)];
    let wind_up = Springs::new(&springs, 2.0).wind_up(1e-9).unwrap().unwrap();
    let torque: f64 =
        springs.iter().map(|spring| 2.0 * spring.force_n(&wind_up.rotation).unwrap() * spring.arm_mm).sum();
    assert!((torque / 1e-9 - 1.0).abs() < 1e-14, "{torque:e}");
    assert_eq!(wind_up.rotation.closing_rad, 1.1);
}

/// A spring that counts its reads.
struct Counted(Spring, Cell<u64>);

impl AsRef<Spring> for Counted {
    fn as_ref(&self) -> &Spring {
        self.1.set(self.1.get() + 1);
        &self.0
    }
}

#[test]
fn loaded_teeth_are_found_in_few_passes() {
    let looks = |count: u32, torque_nmm: f64| {
        let spring = |i: u32| Spring {
            arm_mm: 1.0,
            arm_decline_mm_per_rad: 0.0,
            // Unsorted and all different.
            closing_rad: 1e-6 * f64::from(i * 7919 % count),
            approach: Approach::Power { exponent: 0.9, coefficient: 1e-6, compliance_mm_per_n: 0.0 },
        };
        let springs: Vec<_> = (0..count).map(|i| Counted(spring(i), Cell::new(0))).collect();
        Springs::new(&springs, 2.0).wind_up(torque_nmm).unwrap().unwrap();
        springs.iter().map(|counted| counted.1.get()).sum::<u64>()
    };
    for torque_nmm in [1.0, 1e3, 1e6, 1e9] {
        let looks = looks(10_000, torque_nmm);
        assert!(looks < 10_000 * 100, "{looks} looks at 10 000 springs under {torque_nmm} N mm");
    }
}

prop_compose! {
    fn any_power()(p in prop::sample::select(vec![0.9, 2.0 / 3.0, 0.5]), c in -9.0_f64..-3.0, l in prop::option::of(-12.0_f64..-3.0)) -> Approach {
        Approach::Power { exponent: p, coefficient: 10.0_f64.powf(c), compliance_mm_per_n: l.map_or(0.0, |l| 10.0_f64.powf(l)) }
    }
}

prop_compose! {
    fn any_linear()(c in -12.0_f64..-3.0) -> Approach {
        Approach::Linear { compliance_mm_per_n: 10.0_f64.powf(c) }
    }
}

fn any_approach() -> impl Strategy<Value = Approach> {
    prop_oneof![any_linear(), any_power()]
}

prop_compose! {
    fn any_spring()(approach in any_approach(), arm in -6.0_f64..2.0, closing in prop::option::of(-9.0_f64..1.0)) -> Spring {
        Spring { arm_mm: 10.0_f64.powf(arm), arm_decline_mm_per_rad: 0.0, closing_rad: closing.map_or(0.0, |power| 10.0_f64.powf(power)), approach }
    }
}

#[test]
fn logarithmic_approach_is_inverted_and_extended_along_tangent() {
    for (compliance, growth, reference_n) in
        [(3e-6, 1e-6, 1e4), (0.0, 2e-6, 50.0), (1e-4, 1e-8, 1e9), (-1e-7, 1e-6, 1.0)]
    {
        let law = Approach::Logarithmic(Logarithmic::new(compliance, growth, reference_n));
        let limit_n = Logarithmic::LIMIT * reference_n;
        let formula = |force_n: f64| force_n * (compliance + growth * (reference_n / force_n).ln());
        for share in [1e-9, 1e-3, 0.2, 0.9, 1.0 - 1e-9, 1.0 + 1e-9, 1.5, 7.0, 1e6] {
            let force_n = share * limit_n;
            let slope = compliance + growth * ((reference_n / limit_n).ln() - 1.0);
            let expected = if share <= 1.0 { formula(force_n) } else { formula(limit_n) + (force_n - limit_n) * slope };
            let approach_mm = law.approach_mm(force_n);
            assert!((approach_mm / expected - 1.0).abs() < 1e-13, "{approach_mm:e} is not {expected:e} at {share}");
            let found_n = law.force(approach_mm).unwrap().force_n;
            assert!((found_n / force_n - 1.0).abs() < 1e-12, "{found_n:e} is not {force_n:e} at {share}");
        }
    }
}

proptest! {
    #![proptest_config(cases(4096))]

    #[test]
    fn approach_has_an_inverse(approach in any_approach(), power in -30.0_f64..18.0) {
        let force_n = 10.0_f64.powf(power);
        let approach_mm = approach.approach_mm(force_n);
        let found = approach.force(approach_mm).unwrap();
        prop_assert!((found.force_n / force_n - 1.0).abs() < 1e-14, "{approach:?}, {force_n:e}, {:e}", found.force_n / force_n - 1.0);
        // The exponent is the slope in logarithms.
        let step = 1e-5_f64;
        let rise = (approach.approach_mm(force_n * (1.0 + step)) / approach.approach_mm(force_n * (1.0 - step))).ln() / (2.0 * step);
        prop_assert!((found.exponent - rise).abs() < 1e-8, "{} {rise}", found.exponent);
    }

    #[test]
    fn springs_of_all_laws_carry_torque_accurately(springs in prop::collection::vec(any_spring(), 1..12), power in -12.0_f64..15.0) {
        let torque_nmm = 1e3 * 10.0_f64.powf(power);
        let wind_up = Springs::new(&springs, 2.0).wind_up(torque_nmm).unwrap().unwrap();
        prop_assert!(wind_up.rotation.excess_rad >= 0.0);
        let mut torque = 0.0;
        for spring in &springs {
            let force_n = spring.force_n(&wind_up.rotation).unwrap();
            torque += 2.0 * force_n * spring.arm_mm;
            // A spring carries exactly if its gap is closed.
            prop_assert!((force_n > 0.0) == (wind_up.rotation_rad() > spring.closing_rad) || (spring.closing_rad - wind_up.rotation_rad()).abs() < 1e-15 * spring.closing_rad);
        }
        prop_assert!((torque / torque_nmm - 1.0).abs() < 1e-13, "{:e}", torque / torque_nmm - 1.0);
        let more = Springs::new(&springs, 2.0).wind_up(torque_nmm * (1.0 + 1e-6)).unwrap().unwrap();
        prop_assert!(more.rotation_rad() >= wind_up.rotation_rad());
    }
}

/// Generates springs of several power laws whose arms decline to zero within two radians.
fn any_declining_spring() -> impl Strategy<Value = Spring> {
    let exponent = prop::sample::select(vec![1.0, 0.9, 2.0 / 3.0, 0.5]);
    let gap = prop::option::of(0.02_f64..0.5);
    (exponent, -6.0_f64..-2.0, -1.0_f64..1.5, 0.05_f64..2.0, gap).prop_map(|(exponent, power, arm, end_rad, gap)| {
        let (coefficient, arm_mm) = (10.0_f64.powf(power), 10.0_f64.powf(arm));
        let approach = if exponent == 1.0 {
            Approach::Linear { compliance_mm_per_n: coefficient }
        } else {
            Approach::Power { exponent, coefficient, compliance_mm_per_n: 0.0 }
        };
        // The gap must close before the arm ends.
        let gap = gap.unwrap_or(0.0);
        let left_mm = arm_mm * (1.0 - gap);
        Spring { arm_mm: left_mm, arm_decline_mm_per_rad: arm_mm / end_rad, closing_rad: gap * end_rad, approach }
    })
}

/// Returns rotations and torques of all maxima up to the first after all gaps are closed.
/// It searches in steps, then by thirds.
fn maxima(springs: &[Spring]) -> Vec<(f64, f64)> {
    let all = Springs::new(springs, 2.0);
    let at = |turned_rad: f64| Rotation { closing_rad: 0.0, excess_rad: turned_rad };
    let torque_nmm = |turned_rad: f64| all.torque_nmm(&at(turned_rad)).unwrap().value;
    let last_rad = springs.iter().map(|spring| spring.closing_rad).fold(0.0, f64::max);
    let parts =
        |from: u32, to: u32, part_rad: f64| (from..to).map(move |step| f64::from(step) / f64::from(STEPS) * part_rad);
    let turned_rad: Vec<_> =
        parts(0, STEPS, last_rad).chain(parts(0, STEPS, 2.0).map(|beyond_rad| last_rad + beyond_rad)).collect();
    let torques_nmm: Vec<_> = turned_rad.iter().map(|&turned_rad| torque_nmm(turned_rad)).collect();
    let mut maxima = Vec::new();
    for (three_rad, three) in turned_rad.windows(3).zip(torques_nmm.windows(3)) {
        if three[1] > three[0] && three[2] <= three[1] {
            let (mut low, mut high) = (three_rad[0], three_rad[2]);
            for _ in 0..80 {
                let third = (high - low) / 3.0;
                if torque_nmm(low + third) < torque_nmm(high - third) { low += third } else { high -= third }
            }
            maxima.push((low, torque_nmm(low)));
            if low >= last_rad {
                break;
            }
        }
    }
    maxima
}

/// Number of steps over the rotation up to two radians past the last gap.
const STEPS: u32 = 4000;

proptest! {
    #![proptest_config(cases(512))]

    #[test]
    fn declining_springs_carry_torque_up_to_their_maximum(
        springs in prop::collection::vec(any_declining_spring(), 1..5),
        share in 0.01_f64..1.0,
    ) {
        let all = Springs::new(&springs, 2.0);
        let maxima = maxima(&springs);
        let most_nmm = maxima.iter().map(|(_, torque_nmm)| *torque_nmm).fold(0.0, f64::max);
        prop_assume!(most_nmm > 0.0);
        for share in [share, 0.95, 0.999] {
            let sought_nmm = share * most_nmm;
            // Near another maximum, within rounding and steps, either may be found.
            if maxima.iter().any(|(_, torque_nmm)| (torque_nmm / sought_nmm - 1.0).abs() < 1e-4) {
                continue;
            }
            let (before_rad, _) = *maxima.iter().find(|(_, torque_nmm)| *torque_nmm > sought_nmm).unwrap();
            let found = all.wind_up(sought_nmm).unwrap();
            prop_assert!(found.is_some(), "{share} of {most_nmm} N·mm is not carried");
            let rotation = found.unwrap().rotation;
            prop_assert!(rotation.rad() < before_rad, "{} rad, the maximum at {before_rad} rad", rotation.rad());
            let torque_nmm = all.torque_nmm(&rotation).unwrap().value;
            prop_assert!((torque_nmm / sought_nmm - 1.0).abs() < 1e-9, "{torque_nmm} N·mm, {sought_nmm} sought");
        }
        for share in [1.001, 1.1, 3.0] {
            prop_assert_eq!(all.wind_up(share * most_nmm).unwrap(), None, "{} of {} N·mm", share, most_nmm);
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    /// Scaling by powers of two changes only exponents.
    #[test]
    fn rotation_is_independent_of_unit_of_length(springs in prop::collection::vec(any_declining_spring(), 1..5)) {
        let torque_nmm = |step: u32| {
            let rotation = Rotation { closing_rad: 0.0, excess_rad: 0.02 * f64::from(step) };
            Springs::new(&springs, 2.0).torque_nmm(&rotation).unwrap().value
        };
        let most_nmm = (1..100).map(torque_nmm).fold(0.0, f64::max);
        for share in [0.5, 0.9, 0.999, 1.1] {
            let rotation = |power: i32| {
                let unit = 2.0_f64.powi(power);
                let in_unit = |spring: &Spring| Spring {
                    arm_mm: unit * spring.arm_mm,
                    arm_decline_mm_per_rad: unit * spring.arm_decline_mm_per_rad,
                    closing_rad: spring.closing_rad,
                    approach: match spring.approach {
                        Approach::Power { exponent, coefficient, compliance_mm_per_n } => {
                            Approach::Power { exponent, coefficient: unit * coefficient, compliance_mm_per_n }
                        }
                        Approach::Linear { compliance_mm_per_n } => {
                            Approach::Linear { compliance_mm_per_n: unit * compliance_mm_per_n }
                        }
                        other => other,
                    },
                };
                let springs: Vec<_> = springs.iter().map(in_unit).collect();
                let wind_up = Springs::new(&springs, 2.0).wind_up(unit * share * most_nmm).unwrap();
                wind_up.map(|wind_up| wind_up.rotation)
            };
            prop_assert_eq!(rotation(-20), rotation(0));
            prop_assert_eq!(rotation(20), rotation(0));
        }
    }
}

/// A spring of Hertz's ellipse starts at zero force, so the torque of the others still falls for a moment.
#[test]
fn closing_spring_carries_when_others_decline() {
    let spring = |arm_decline_mm_per_rad: f64, closing_rad: f64, approach: Approach| Spring {
        arm_mm: 1.0 - arm_decline_mm_per_rad * closing_rad,
        arm_decline_mm_per_rad,
        closing_rad,
        approach,
    };
    let ellipse = Approach::Power { exponent: 2.0 / 3.0, coefficient: 3e-5, compliance_mm_per_n: 0.0 };
    let springs = [spring(2.5, 0.0, Approach::Linear { compliance_mm_per_n: 1.5e-5 }), spring(0.5, 0.25, ellipse)];
    let first = Springs::new(&springs[..1], 2.0);
    // Its arm's square is then a third of what it was, the way the rest of its whole.
    let most_of_first_nmm = 2.0 * (2.0 / 3.0 * 0.2) / 1.5e-5 * (1.0_f64 / 3.0).sqrt();
    assert!(first.wind_up(0.999 * most_of_first_nmm).unwrap().is_some());
    assert_eq!(first.wind_up(1.001 * most_of_first_nmm).unwrap(), None);
    let both = Springs::new(&springs, 2.0);
    let rotation = both.wind_up(1.5 * most_of_first_nmm).unwrap().expect("a rotation").rotation;
    assert!(rotation.rad() > 0.25 && rotation.rad() < 0.3, "{rotation:?}");
    assert!((both.torque_nmm(&rotation).unwrap().value / (1.5 * most_of_first_nmm) - 1.0).abs() < 1e-12);
}

/// The first spring's torque peaks just after the other closes. The search must not skip to the common maximum.
#[test]
fn torque_below_next_closing_is_carried_by_first() {
    let spring = |arm_mm: f64, end_rad: f64, closing_rad: f64, compliance_mm_per_n: f64| Spring {
        arm_mm: arm_mm * (1.0 - closing_rad / end_rad),
        arm_decline_mm_per_rad: arm_mm / end_rad,
        closing_rad,
        approach: Approach::Linear { compliance_mm_per_n },
    };
    let springs = [spring(16.0, 0.773, 0.0, 6.8e-6), spring(7.7, 1.162, 0.326, 1.7e-5)];
    let both = Springs::new(&springs, 2.0);
    let at_closing = both.torque_nmm(&Rotation { closing_rad: 0.326, excess_rad: 0.0 }).unwrap();
    assert!(at_closing.slope > 0.0);
    for share in [0.5, 0.9, 0.99, 0.999, 0.999_99] {
        let rotation = both.wind_up(share * at_closing.value).unwrap().unwrap().rotation;
        assert!(rotation.rad() < 0.326, "{share}: {rotation:?}");
        let torque_nmm = both.torque_nmm(&rotation).unwrap().value;
        assert!((torque_nmm / (share * at_closing.value) - 1.0).abs() < 1e-12, "{share}: {torque_nmm} N·mm");
    }
}

/// Beyond the first maximum lies a branch that no load reaches. Arms scaled by a factor scale all rotations.
#[test]
fn search_never_passes_a_maximum_of_all_springs() {
    for shorter in [1.0, 1e-6, 1e-12, 1e-18, 1e-24] {
        let spring = |end_rad: f64, compliance_mm_per_n: f64| Spring {
            arm_mm: shorter * 5.0 * (1.0 - 0.1 / end_rad),
            arm_decline_mm_per_rad: 5.0 / end_rad,
            closing_rad: shorter * 0.1,
            approach: Approach::Linear { compliance_mm_per_n },
        };
        let springs = [spring(0.3, 1e-6), spring(6.0, 3e-5)];
        let both = Springs::new(&springs, 2.0);
        let torque_nmm = |rad: f64| {
            let rotation = Rotation { closing_rad: shorter * 0.1, excess_rad: shorter * (rad - 0.1) };
            both.torque_nmm(&rotation).unwrap().value
        };
        let most_nmm = (100..300).map(|step| torque_nmm(1e-3 * f64::from(step))).fold(0.0, f64::max);
        assert!(torque_nmm(0.35) < 0.5 * most_nmm && torque_nmm(2.5) > 1.5 * most_nmm);
        assert!(both.wind_up(0.99 * most_nmm).unwrap().unwrap().rotation.rad() < shorter * 0.3);
        assert_eq!(both.wind_up(1.01 * most_nmm).unwrap(), None, "{shorter}");
    }
}

/// Rounding may let the other springs carry less at this point.
#[test]
fn torque_at_next_closing_is_carried_there() {
    let spring = |arm_mm: f64, closing_rad: f64| Spring {
        arm_mm,
        arm_decline_mm_per_rad: 1.0,
        closing_rad,
        approach: Approach::Power { exponent: 0.9, coefficient: 1e-5, compliance_mm_per_n: 0.0 },
    };
    for step in 1..200 {
        let next_rad = 0.02 + 1e-3 * f64::from(step);
        let springs = [spring(7.3, 0.003), spring(6.1, 0.017), spring(5.0, 0.0191), spring(5.9, next_rad)];
        let all = Springs::new(&springs, 2.0);
        let torque_nmm = all.torque_nmm(&Rotation { closing_rad: next_rad, excess_rad: 0.0 }).unwrap().value;
        let rotation = all.wind_up(torque_nmm).unwrap().unwrap().rotation;
        assert!((rotation.rad() / next_rad - 1.0).abs() < 1e-12, "{rotation:?}, not {next_rad}");
    }
}

/// Closing angles are 1e7 times the rotation beyond them, so their rounding dominates. This is no internal error.
#[test]
fn tiny_torque_across_wide_gap_is_answered() {
    let parameters = DriveParameters {
        wave_generator: ellipse(16.75, 16.749_866_950_020_685),
        teeth: 424,
        installed: 106,
        tooth_radius_mm: 0.363_073_297_478_682_6,
        tooth: ToothShape::Cylinder { width_mm: 58.5 },
        ring_teeth: 426,
        tip_radius_mm: None,
    };
    let clearance_um = PerContact { wave_generator: 0.0, ring: 0.0, carrier: 10_000.0 };
    let load = LoadParameters { law: ContactLaw::Palmgren, clearance_um, ..load(1e-11, VirtualWork) };
    let sweep = swept(&parameters, &load, 32);
    assert!(sweep.torque_balance_residual < 1e-12);
    assert!(sweep.period_closure_residual < 1e-8);
}
