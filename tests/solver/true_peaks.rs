//! True peaks without columns: guarantees against dense samples, tolerance sweeps and the reference, and their cost.

use proptest::prelude::*;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::gaps::TipRelief;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::sweep::{Points, SweepPeaks, peaks, sweep_plain};
use toothwave_solver::{
    Contact, ContactLaw, DriveParameters, LoadCase, LoadParameters, Material, Modification, Never, PerContact,
    SolveError, ToothShape, WaveGenerator,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, any_swept_drive, cases, drive, ellipse, everywhere, load};
use crate::fast::{OtherTeeth, any_drive_of_other_kinds, any_drive_of_unlike_zones, any_other_teeth};
use crate::reference::{Worst, number};
use crate::tolerances::{designs, of_many_teeth};

const MAX_STATES: u64 = 10_000_000;

const JOHNSON: ContactLaw = ContactLaw::JOHNSON;

fn of(parameters: &DriveParameters, load: &LoadParameters, points: Points) -> Result<SweepPeaks, SolveError> {
    peaks(&drive(parameters), &LoadCase::new(load).unwrap(), points, &Never)
}

fn to(parameters: &DriveParameters, load: &LoadParameters, tolerance: f64) -> SweepPeaks {
    of(parameters, load, Points::tolerance(tolerance, MAX_STATES).unwrap())
        .unwrap_or_else(|error| panic!("{error} of {parameters:?} {load:?}"))
}

/// Returns every largest value by name, and the reciprocal of every least value.
fn extremes(peaks: &SweepPeaks) -> Vec<(&'static str, f64)> {
    let mut extremes = Vec::new();
    for (_, contact) in peaks.contacts.iter() {
        extremes.extend([("force", contact.force_n.value), ("stress", contact.stress_mpa.value)]);
    }
    let (wind_up, stiffness) = (peaks.wind_up_deg, peaks.torsional_stiffness_nm_per_rad);
    extremes.extend([
        ("wind-up", wind_up.largest),
        ("least wind-up", 1.0 / wind_up.least),
        ("stiffness", stiffness.largest),
        ("least stiffness", 1.0 / stiffness.least),
    ]);
    extremes.extend(peaks.torque_capacity.map(|capacity| ("capacity", 1.0 / capacity.input_torque_nm)));
    extremes
}

/// Asserts that no extreme of a dense sweep is missed by more than the tolerance.
fn assert_found(parameters: &DriveParameters, load: &LoadParameters, samples: u64, tolerance: f64) {
    let dense = of(parameters, load, Points::samples(samples).unwrap()).unwrap();
    let found = to(parameters, load, tolerance);
    for ((name, found), (_, dense)) in extremes(&found).into_iter().zip(extremes(&dense)) {
        assert!(found >= dense * (1.0 - tolerance), "{name}: {:e} {parameters:?}", 1.0 - found / dense);
    }
}

fn by_every_law() -> Vec<(DriveParameters, LoadParameters)> {
    let mut all = designs();
    let by_work: Vec<_> = all
        .iter()
        .filter(|(_, load)| load.law == ContactLaw::Linear && load.compatibility == VirtualWork)
        .copied()
        .collect();
    all.extend(by_work.into_iter().map(|(parameters, load)| (parameters, LoadParameters { law: JOHNSON, ..load })));
    all
}

#[test]
fn no_dense_sweep_exceeds_true_peaks() {
    for (parameters, load) in by_every_law() {
        let Ok(dense) = of(&parameters, &load, Points::samples(20_000).unwrap()) else { continue };
        for tolerance in [1e-1, 1e-3, 1e-6, 1e-9, 1e-12] {
            let found = to(&parameters, &load, tolerance);
            for ((name, found), (_, dense)) in extremes(&found).into_iter().zip(extremes(&dense)) {
                // Rounding causes a difference of some units in the last digit.
                let missing = 1.0 - found / dense;
                assert!(
                    missing <= tolerance.max(1e-11),
                    "{name}: {missing:e} of {tolerance:e}, {:?} {load:?} {parameters:?}",
                    load.law
                );
            }
            assert!(found.torque_balance_residual < 1e-12);
            assert!(
                found.loaded_teeth.min <= dense.loaded_teeth.min && found.loaded_teeth.max >= dense.loaded_teeth.max,
                "{:?} {:?} {load:?} {parameters:?}",
                found.loaded_teeth,
                dense.loaded_teeth
            );
        }
    }
}

#[test]
fn hundred_thousand_samples_approach_true_peaks() {
    for (parameters, load) in by_every_law().into_iter().step_by(7) {
        let Ok(dense) = of(&parameters, &load, Points::samples(100_000).unwrap()) else { continue };
        let found = to(&parameters, &load, 1e-9);
        for ((name, found), (_, dense)) in extremes(&found).into_iter().zip(extremes(&dense)) {
            assert!(found >= dense * (1.0 - 1e-9), "{name}: {found} {dense}");
            // Loads, and with gaps the stiffness too, jump at an instant that samples miss by one interval.
            let is_stiffness = name.ends_with("stiffness");
            assert!(is_stiffness || found <= dense * (1.0 + 1e-3), "{name}: {found} {dense} {load:?} {parameters:?}");
        }
    }
}

/// Under Johnson's law a tooth starts with zero stiffness, so other loads rise further: for 5e-5 degrees, by 1.6e-8.
#[test]
fn finds_peak_just_after_another_tooth_loads() {
    let clearance_um = PerContact { wave_generator: 0.0, ring: 3.0, carrier: 25.0 };
    let load = LoadParameters { law: JOHNSON, clearance_um, ..load(1.0, VirtualWork) };
    let dense = of(&PAPER_5_1, &load, Points::samples(2_000_000).unwrap()).unwrap();
    let found = to(&PAPER_5_1, &load, 1e-10);
    for ((name, found), (_, dense)) in extremes(&found).into_iter().zip(extremes(&dense)) {
        assert!(found >= dense * (1.0 - 1e-10), "{name}: {:e}", 1.0 - found / dense);
    }
}

/// A tooth in the valley has no arm, so it starts to carry only after it has left the valley.
#[test]
fn finds_stiffness_jump_near_valley() {
    let flat = |lobes: i64, mean_radius_mm, amplitude_mm, tooth_radius_mm| DriveParameters {
        wave_generator: WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm },
        teeth: 6 * lobes,
        installed: 6 * lobes,
        ring_teeth: 5 * lobes,
        tooth_radius_mm,
        ..PAPER_5_1
    };
    let loaded = |torque_nm, law, [wave_generator, ring, carrier]: [f64; 3]| LoadParameters {
        law,
        clearance_um: PerContact { wave_generator, ring, carrier },
        ..load(torque_nm, VirtualWork)
    };
    for (parameters, load) in [
        (
            flat(4, 47.565_194_500_284_01, 0.003_439_658_958_553_44, 2.434_805_499_715_990_3),
            loaded(3.202_971_128_566_237_4, ContactLaw::Linear, [1.0; 3]),
        ),
        (
            flat(5, 45.409_634_696_981_115, 0.023_505_506_526_250_96, 4.590_365_303_018_881),
            loaded(53.824_163_969_028_376, ContactLaw::Linear, [1.0, 1.394_998_939_278_116_1, 1.0]),
        ),
        (
            flat(5, 48.813_657_711_757_64, 0.168_761_858_990_047_5, 1.186_342_288_242_358_2),
            loaded(
                0.233_982_407_572_720_54,
                ContactLaw::Palmgren,
                [96.819_935_967_029_65, 20.189_567_715_500_807, 1.0],
            ),
        ),
    ] {
        assert_found(&parameters, &load, 1500, 1e-4);
    }
}

/// One tooth carries at both of the first moments, another one only between them.
#[test]
fn finds_tooth_loaded_only_between_moments() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Eccentric {
            radius_mm: 3.916_351_596_676_902,
            eccentricity_mm: 1.402_432_608_186_466_4,
        },
        teeth: 9,
        installed: 9,
        tooth_radius_mm: 1.278_650_254_156_029_8,
        tooth: ToothShape::Cylinder { width_mm: 1.341_311_874_813_533_3 },
        ring_teeth: 8,
        tip_radius_mm: None,
    };
    let load = LoadParameters {
        law: JOHNSON,
        wave_generator_moves: true,
        corner_contact: true,
        clearance_um: PerContact { wave_generator: 12.0, ring: 4.0, carrier: 4.0 },
        ..load(8.821_845_665_400_59e-6, VirtualWork)
    };
    assert_found(&parameters, &load, 1500, 1e-4);
}

/// The gap has a corner there.
#[test]
fn finds_peak_where_tooth_reaches_relief() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Harmonic { lobes: 3, mean_radius_mm: 48.0, amplitude_mm: 1.0 },
        teeth: 30,
        installed: 30,
        tooth_radius_mm: 3.0,
        ring_teeth: 27,
        ..PAPER_5_1
    };
    let ring_tip_relief = Some(TipRelief { amount_um: 15.77, start_deg: 13.4, power: 1.0 });
    let load = LoadParameters {
        law: JOHNSON,
        wave_generator_moves: true,
        modification: Modification { ring_tip_relief, ..Modification::default() },
        ..load(13.51, VirtualWork)
    };
    assert_found(&parameters, &load, 6007, 1e-5);
}

/// Second differences of two opposite corners cancel.
#[test]
fn finds_capacity_between_two_corners() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Harmonic {
            lobes: 5,
            mean_radius_mm: 45.003_137_212_920_79,
            amplitude_mm: 0.023_981_016_962_778_66,
        },
        teeth: 40,
        installed: 20,
        ring_teeth: 35,
        tooth_radius_mm: 4.996_862_787_079_209,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        tip_radius_mm: None,
    };
    let clearance_um = PerContact {
        wave_generator: 2.464_927_512_857_069,
        ring: 0.915_820_933_752_716_1,
        carrier: 0.901_299_260_170_476_2,
    };
    let allowable_stress_mpa = Some(everywhere(1500.0));
    let load = LoadParameters { clearance_um, allowable_stress_mpa, ..load(1.135_355_178_771_830_8, VirtualWork) };
    let capacity_nm = |points| of(&parameters, &load, points).unwrap().torque_capacity.unwrap().output_torque_nm;
    let dense_nm = capacity_nm(Points::samples(600).unwrap());
    let found_nm = capacity_nm(Points::tolerance(1e-4, MAX_STATES).unwrap());
    assert!(found_nm <= dense_nm * (1.0 + 1e-4), "{found_nm} {dense_nm}");
}

/// Under a tiny torque across a gap of 100 mm, rounding bends the curves of capacity and loads.
#[test]
fn finds_extremes_despite_rounding() {
    let cylinder = |width_mm| ToothShape::Cylinder { width_mm };
    let of_major = |semi_major_mm, semi_minor_mm, teeth, installed, tooth_radius_mm, width_mm| DriveParameters {
        wave_generator: ellipse(semi_major_mm, semi_minor_mm),
        teeth,
        installed,
        ring_teeth: teeth - 2,
        tooth_radius_mm,
        tooth: cylinder(width_mm),
        tip_radius_mm: None,
    };
    let bored = DriveParameters {
        tip_radius_mm: Some(8.670_603_836_436_415),
        ..of_major(8.25, 8.247_236_535_126_948, 16, 16, 0.211_651_139_303_286_08, 15.0)
    };
    let clearance_um = PerContact { wave_generator: 0.001, ring: 1e5, carrier: 10.0 };
    let allowable_stress_mpa = Some(everywhere(10.0));
    let nearly_round = LoadParameters { clearance_um, allowable_stress_mpa, ..load(1e-5, VirtualWork) };
    let deep = of_major(43.75, 43.214_846_885_415_65, 24, 12, 5.385_253_723_998_935, 1e5);
    let clearance_um = PerContact { wave_generator: 1e5, ring: 0.0, carrier: 0.0 };
    let allowable_stress_mpa = Some(everywhere(0.1));
    let weak =
        LoadParameters { law: ContactLaw::Palmgren, clearance_um, allowable_stress_mpa, ..load(1e-9, Projection) };
    for (parameters, load) in [(bored, nearly_round), (deep, weak)] {
        assert!(to(&parameters, &load, 1e-10).torque_capacity.is_some());
    }
}

/// With stiff contacts each tooth carries alone, and the transfer takes less than 1e-8 of the period.
#[test]
fn finds_sudden_load_transfer() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::HarmonicPath {
            lobes: 3,
            mean_path_radius_mm: 45.25,
            amplitude_mm: 0.085_850_649_182_247_9,
        },
        teeth: 32,
        installed: 16,
        ring_teeth: 29,
        tooth_radius_mm: 3.004_970_900_807_117,
        tooth: ToothShape::Ball {
            groove_radius_mm: PerContact { ring: Some(3.102_255_557_894_772), ..PerContact::default() },
        },
        tip_radius_mm: None,
    };
    let modification = Modification {
        ring_equidistant_um: 3.004_970_900_807_117_5,
        ring_path_shift_um: -0.300_497_090_080_711_74,
        ring_profile_shift_um: -0.030_049_709_008_071_177,
        ring_rotation_arcsec: 100.0,
        slot_wall_um: -0.300_497_090_080_711_74,
        carrier_rotation_arcsec: -10.0,
        tooth_radius_um: 0.030_049_709_008_071_177,
        ..Modification::default()
    };
    let stiffness_n_per_mm = PerContact { wave_generator: 1e12, ring: 1e13, carrier: 1e12 };
    let allowable_stress_mpa = Some(everywhere(1500.0));
    let law = ContactLaw::Fixed(stiffness_n_per_mm);
    let load = LoadParameters { law, modification, allowable_stress_mpa, ..load(1e-3, VirtualWork) };
    let case = LoadCase::new(&load).unwrap();
    let capacity_nm = |points| {
        sweep_plain(&drive(&parameters), &case, points, &Never).unwrap().torque_capacity.unwrap().input_torque_nm
    };
    let found_nm = capacity_nm(Points::tolerance(1e-8, MAX_STATES).unwrap());
    let dense_nm = capacity_nm(Points::samples(20_000).unwrap());
    assert!(found_nm <= dense_nm * (1.0 + 1e-8), "{found_nm} {dense_nm}");
}

/// The capacity has more corners in a period than there are rounds, so one round must find several.
#[test]
fn finds_many_capacity_corners_at_tightest_tolerance() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::HarmonicPath {
            lobes: 1,
            mean_path_radius_mm: 9.894_190_524_325_321,
            amplitude_mm: 0.241_290_364_723_656_1,
        },
        teeth: 22,
        installed: 22,
        ring_teeth: 23,
        tooth_radius_mm: 0.605_174_118_311_290_6,
        tooth: ToothShape::Cylinder { width_mm: 1.287_376_120_038_855_8 },
        tip_radius_mm: None,
    };
    let mut load = load(0.007_204_096_484_479_152, VirtualWork);
    load.law = ContactLaw::Fixed(PerContact {
        wave_generator: 1_742_088.996_738_245,
        ring: 863_189.093_750_152_7,
        carrier: 769_658.662_147_516_9,
    });
    load.materials.teeth =
        Material { youngs_modulus_gpa: 70.717_402_109_773_89, poissons_ratio: 0.244_576_336_077_262_34 };
    load.materials.carrier =
        Material { youngs_modulus_gpa: 103.888_780_055_750_19, poissons_ratio: 0.126_556_351_533_704_84 };
    load.clearance_um.carrier = 0.605_971_923_594_121;
    load.allowable_stress_mpa = Some(everywhere(900.0));
    let case = LoadCase::new(&load).unwrap();
    let capacity_nm = |points| {
        let sweep = sweep_plain(&drive(&parameters), &case, points, &Never).unwrap();
        sweep.torque_capacity.unwrap().input_torque_nm
    };
    let found_nm = capacity_nm(Points::tolerance(1e-12, MAX_STATES).unwrap());
    let dense_nm = capacity_nm(Points::samples(20_000).unwrap());
    assert!(found_nm <= dense_nm * (1.0 + 1e-12) && found_nm > dense_nm * (1.0 - 1e-4), "{found_nm} {dense_nm}");
}

/// `ψ_i = 2π i/Z'_G - j Z_K/Z_G`.
#[test]
fn true_peak_tooth_position_matches_its_input_angle() {
    for p in [PAPER_5_1, PAPER_5_2] {
        for (_, peaks) in to(&p, &load(20.0, VirtualWork), 1e-4).contacts.iter() {
            for peak in [peaks.force_n, peaks.stress_mpa] {
                let at_start_deg = peak.position_deg + peak.input_angle_deg * p.ring_teeth as f64 / p.teeth as f64;
                let tooth = at_start_deg * p.installed as f64 / 360.0;
                assert!((tooth - tooth.round()).abs() < 1e-9, "{tooth} of {peak:?}");
            }
        }
    }
}

#[test]
fn true_peaks_match_tolerance_sweep() {
    for (parameters, load) in by_every_law() {
        let case = LoadCase::new(&load).unwrap();
        let points = Points::tolerance(1e-10, MAX_STATES).unwrap();
        let Ok(swept) = sweep_plain(&drive(&parameters), &case, points, &Never) else { continue };
        let swept = SweepPeaks::from(&swept);
        let found = to(&parameters, &load, 1e-10);
        for ((name, found), (_, swept)) in extremes(&found).into_iter().zip(extremes(&swept)) {
            let off = (found / swept - 1.0).abs();
            assert!(off <= 1e-9, "{name}: {off:e} {load:?} {parameters:?}");
        }
        for (contact, peaks) in found.contacts.iter() {
            let expected = swept.contacts.get(contact);
            let off = (peaks.half_width_mm / expected.half_width_mm - 1.0).abs();
            assert!(off <= 1e-4, "{contact:?}: {off:e} {load:?} {parameters:?}");
        }
        if let Some((found, swept)) = found.torque_capacity.zip(swept.torque_capacity) {
            let off = (found.output_torque_nm / swept.output_torque_nm - 1.0).abs();
            assert!(off <= 1e-9, "capacity {off:e}");
        }
    }
}

#[test]
fn true_peaks_cover_all_teeth_of_unlike_zones() {
    for (installed, lobes) in [(29, 2), (31, 3), (33, 6)] {
        let wave_generator = WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm: 60.0, amplitude_mm: 0.8 };
        let parameters = DriveParameters {
            wave_generator,
            teeth: installed,
            installed,
            ring_teeth: installed - lobes,
            tooth_radius_mm: 4.0,
            ..PAPER_5_1
        };
        for law in [ContactLaw::Linear, ContactLaw::Palmgren, JOHNSON] {
            let allowable_stress_mpa = Some(everywhere(1500.0));
            let load = LoadParameters { law, allowable_stress_mpa, ..load(20.0, VirtualWork) };
            let points = Points::tolerance(1e-10, MAX_STATES).unwrap();
            let swept = sweep_plain(&drive(&parameters), &LoadCase::new(&load).unwrap(), points, &Never).unwrap();
            let (swept, found) = (SweepPeaks::from(&swept), to(&parameters, &load, 1e-10));
            for ((name, found), (_, swept)) in extremes(&found).into_iter().zip(extremes(&swept)) {
                let off = (found / swept - 1.0).abs();
                assert!(off <= 1e-9, "{name}: {off:e} {law:?} {parameters:?}");
            }
            assert_eq!(found.loaded_teeth, swept.loaded_teeth);
        }
    }
}

proptest! {
    #![proptest_config(cases(600))]

    #[test]
    fn no_samples_under_any_law_exceed_true_peaks(
        parameters in prop_oneof![2 => any_swept_drive(), 1 => any_drive_of_other_kinds(), 1 => any_drive_of_unlike_zones()],
        teeth in prop::option::weighted(0.4, any_other_teeth()),
        gaps in prop::option::of(prop::array::uniform3(-1.0_f64..2.0)),
        law in prop::sample::select(vec![ContactLaw::Linear, ContactLaw::Palmgren, JOHNSON]),
        torque_exponent in -1.0_f64..2.0,
        tolerance in prop::sample::select(vec![1e-1, 1e-2, 1e-4]),
    ) {
        let parameters = teeth.map_or(parameters, |teeth: OtherTeeth| teeth.of(&parameters));
        let mut load = load(10.0_f64.powf(torque_exponent), VirtualWork);
        load.law = if matches!(parameters.tooth, ToothShape::Ball { .. }) { ContactLaw::Hertz } else { law };
        let [wave_generator, ring, carrier] = gaps.map_or([0.0; 3], |gaps| gaps.map(|exponent| 10.0_f64.powf(exponent)));
        load.clearance_um = PerContact { wave_generator, ring, carrier };
        load.allowable_stress_mpa = Some(everywhere(1500.0));
        let Ok(dense) = of(&parameters, &load, Points::samples(1500).unwrap()) else { return Ok(()) };
        let found = of(&parameters, &load, Points::tolerance(tolerance, MAX_STATES).unwrap());
        let Ok(found) = found else { return Ok(()) };
        for ((name, found), (_, dense)) in extremes(&found).into_iter().zip(extremes(&dense)) {
            prop_assert!(found >= (1.0 - tolerance.max(1e-11)) * dense, "{}: {:e} of {:e} {:?}", name, 1.0 - found / dense, tolerance, load);
        }
    }
}

#[test]
fn true_peaks_match_the_reference() {
    let mut worst = Worst::default();
    for case in crate::extremes::cases("extremes") {
        let (name, points) = (case.name(), case.points());
        let Points::Tolerance(tolerance) = points else { panic!("{name}") };
        let found = peaks(&case.drive(), &case.load(), points, &Never).unwrap();
        let (expected, condition) = (&case.0["expected"]["peaks"], &case.0["condition"]["peaks"]);
        for (contact, word) in
            [(Contact::WaveGenerator, "wave_generator"), (Contact::Ring, "ring"), (Contact::Carrier, "carrier")]
        {
            let peaks = PerContact::get(&found.contacts, contact);
            for (kind, found) in [("force_n", peaks.force_n.value), ("stress_mpa", peaks.stress_mpa.value)] {
                let value = number(&expected[word][kind]["value"]).unwrap();
                let rounding = condition[word][kind]["value"].as_f64().unwrap_or(0.0);
                worst.see(kind, &name, (found - value).abs(), tolerance.relative() * value + rounding);
            }
        }
    }
    worst.assert_all_within();
}

// --- What they cost

/// Returns the least limit of states that the search accepts.
fn least_state_limit(parameters: &DriveParameters, load: &LoadParameters, tolerance: f64) -> u64 {
    let is_enough = |max_states| match of(parameters, load, Points::tolerance(tolerance, max_states).unwrap()) {
        Ok(_) => true,
        Err(SolveError::TooManyStates { .. }) => false,
        Err(error) => panic!("{error}"),
    };
    let (mut few, mut enough) = (0, MAX_STATES);
    while enough - few > 1 {
        let middle = few.midpoint(enough);
        if is_enough(middle) { enough = middle } else { few = middle }
    }
    enough
}

#[test]
fn true_peaks_need_some_hundred_states() {
    let threshold = DriveParameters { tooth_radius_mm: 6.749_189_868_666_484 * (1.0 + 1e-6), ..PAPER_5_1 };
    let with_gaps = |law| {
        let clearance_um = PerContact { wave_generator: 0.0, ring: 10.0, carrier: 2.0 };
        LoadParameters { law, clearance_um, ..load(20.0, VirtualWork) }
    };
    let without = |law| LoadParameters { law, ..load(20.0, VirtualWork) };
    let linear = load(20.0, Projection);
    for (name, parameters, load, most) in [
        ("5.1 linear", PAPER_5_1, linear, 200),
        ("5.1 johnson", PAPER_5_1, without(JOHNSON), 260),
        ("5.1 palmgren", PAPER_5_1, without(ContactLaw::Palmgren), 260),
        ("5.1 linear, gaps", PAPER_5_1, with_gaps(ContactLaw::Linear), 420),
        ("5.1 johnson, gaps", PAPER_5_1, with_gaps(JOHNSON), 760),
        ("5.2 linear", PAPER_5_2, linear, 170),
        ("5.2 johnson", PAPER_5_2, without(JOHNSON), 230),
        ("threshold", threshold, linear, 350),
    ] {
        let states = least_state_limit(&parameters, &load, 1e-9);
        println!("{name}: {states} states");
        assert!(states <= most, "{name}: {states} states");
    }
}

#[test]
fn true_peaks_cost_is_linear_in_teeth() {
    for of_critical in [0.7, 1.5] {
        for teeth in [28, 200, 1000, 10_000] {
            let parameters = of_many_teeth(teeth, of_critical);
            let in_mesh = Mesh::new(&drive(&parameters)).teeth_in_mesh().max;
            let states = least_state_limit(&parameters, &load(20.0, Projection), 1e-6);
            println!(
                "{teeth} teeth, {of_critical} of the critical radius: {} times the teeth in mesh",
                states / in_mesh
            );
            assert!(states < 40 * in_mesh, "{states} for {in_mesh} teeth in mesh");
        }
    }
}
