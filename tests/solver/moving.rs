//! The wave generator moves under its teeth as it winds up. Tests compare with the path of centres and a plain search.

use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::gaps::TipRelief;
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::mesh::{Place, Samples};
use toothwave_solver::springs::{Rotation, Springs, WindUp};
use toothwave_solver::sweep::{self, Points};
use toothwave_solver::{
    ContactLaw, Deviations, Drive, DriveParameters, LoadCase, LoadParameters, Material, Materials, Modification, Never,
    Parameter, PerContact, Position, SolveError, ToothShape, Torque, Violation, WaveGenerator,
};

use crate::drives::{ECCENTRIC, PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, everywhere, load, swept};

const JOHNSON: ContactLaw = ContactLaw::JOHNSON;

const THREE_LOBES: DriveParameters = DriveParameters {
    wave_generator: WaveGenerator::HarmonicPath { lobes: 3, mean_path_radius_mm: 52.0, amplitude_mm: 1.0 },
    teeth: 36,
    installed: 36,
    tooth_radius_mm: 2.5,
    tooth: ToothShape::Cylinder { width_mm: 15.0 },
    ring_teeth: 33,
    tip_radius_mm: None,
};

fn moving(torque_nm: f64) -> LoadParameters {
    LoadParameters { law: JOHNSON, wave_generator_moves: true, ..load(torque_nm, VirtualWork) }
}

fn at(drive: &Drive, position_rad: f64) -> toothwave_solver::cam::ToothCenter {
    let folded = Position::from_lobe(position_rad.abs(), drive.lobes());
    drive.flank().locus().at(folded).unwrap()
}

/// Returns `d tan γ`, with the sign of the side of the lobe.
fn slope_mm(drive: &Drive, position_rad: f64) -> f64 {
    let tooth = at(drive, position_rad);
    position_rad.signum() * tooth.center_radius_mm * tooth.tan_pressure_angle
}

/// Half the rotation leaves an eighth of the third-order remainder.
#[test]
fn tooth_moves_along_centre_path_to_second_order() {
    for parameters in [PAPER_5_1, PAPER_5_2, ECCENTRIC, THREE_LOBES] {
        let drive = drive(&parameters);
        let case = LoadCase::new(&moving(1.0)).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let end_rad = drive.flank_limit().position.from_lobe_rad;
        for share in [0.05, 0.2, 0.35, 0.8, 0.97] {
            let position_rad = share * end_rad;
            let tooth = loaded.tooth(Position::from_lobe(position_rad, drive.lobes())).unwrap();
            let cos = 1.0 / tooth.center.tan_pressure_angle.hypot(1.0);
            let missed_mm = |turned_rad: f64| {
                let moved_mm = at(&drive, position_rad - turned_rad).center_radius_mm - tooth.center.center_radius_mm;
                let rotation = Rotation { closing_rad: 0.0, excess_rad: turned_rad };
                tooth.spring.displacement_mm(&rotation) - cos * moved_mm
            };
            let [whole, half] = [0.01, 0.005].map(missed_mm);
            assert!((6.0..10.0).contains(&(whole / half)), "{parameters:?} at {share}: {whole:e}, {half:e}");
        }
    }
}

/// Returns the teeth of one input angle with their forces.
fn shared(loaded: &LoadedDrive<'_>, sample: u64) -> (Vec<ToothState>, WindUp, Vec<f64>) {
    let samples = Samples::new(7).unwrap();
    let placed = loaded.mesh().placed_at(sample, samples);
    let teeth: Vec<_> = placed.map(|placed| loaded.tooth(placed.position).unwrap()).collect();
    let wind_up = loaded.wind_up(&teeth).unwrap();
    let forces = teeth.iter().map(|tooth| loaded.forces_n(tooth, &wind_up).unwrap().wave_generator).collect();
    (teeth, wind_up, forces)
}

/// Arms and their decline are differences on the path of centres. The rotation is found by bisection.
#[test]
fn loads_balance_torque_with_moved_arms() {
    let fixed = ContactLaw::Fixed(PerContact { wave_generator: 4e5, ring: 3e5, carrier: 5e5 });
    let gaps = [PerContact::default(), PerContact { ring: 10.0, ..PerContact::default() }, everywhere(4.0)];
    for (parameters, torque_nm) in
        [(PAPER_5_1, 20.0), (PAPER_5_2, 3.0), (PAPER_5_2_BORED, 1e-4), (ECCENTRIC, 5.0), (THREE_LOBES, 30.0)]
    {
        let drive = drive(&parameters);
        for law in [JOHNSON, ContactLaw::Palmgren, fixed] {
            for clearance_um in gaps {
                let case = LoadCase::new(&LoadParameters { law, clearance_um, ..moving(torque_nm) }).unwrap();
                let loaded = LoadedDrive::new(&drive, &case).unwrap();
                let (teeth, wind_up, forces) = shared(&loaded, 3);
                let turned = |tooth: &ToothState, turned_rad: f64| {
                    let psi = tooth.center.position.from_lobe_rad;
                    let cos = 1.0 / tooth.center.tan_pressure_angle.hypot(1.0);
                    let decline = (slope_mm(&drive, psi + 1e-5) - slope_mm(&drive, psi - 1e-5)) / 2e-5;
                    // This rotation moves the tooth across its slot to its place on the flank.
                    let lost_rad = drive.teeth_per_wave() * 1e-3 * clearance_um.carrier / tooth.center.center_radius_mm;
                    let turned_rad = turned_rad - lost_rad;
                    let way_mm = cos * (slope_mm(&drive, psi) * turned_rad - 0.5 * decline * turned_rad * turned_rad);
                    let gap_mm = 1e-3 * (clearance_um.wave_generator + tooth.force_ratio.ring * clearance_um.ring);
                    let pressed_mm = if turned_rad > 0.0 { way_mm - gap_mm } else { 0.0 };
                    let force_n =
                        if pressed_mm > 0.0 { tooth.spring.approach.force(pressed_mm).unwrap().force_n } else { 0.0 };
                    (force_n, cos * (slope_mm(&drive, psi) - decline * turned_rad))
                };
                let torque_nmm = |turned_rad: f64| -> f64 {
                    let of_each = teeth.iter().map(|tooth| turned(tooth, turned_rad));
                    f64::from(drive.lobes()) * of_each.map(|(force_n, arm_mm)| force_n * arm_mm).sum::<f64>()
                };
                let (mut low, mut high) = (0.0, 0.05);
                for _ in 0..200 {
                    let middle = 0.5 * (low + high);
                    if torque_nmm(middle) < 1e3 * torque_nm { low = middle } else { high = middle }
                }
                let peak_n = forces.iter().copied().fold(0.0, f64::max);
                let name = format!("{parameters:?} {law:?} {clearance_um:?}");
                assert!(
                    (wind_up.rotation_rad() / high - 1.0).abs() < 1e-8,
                    "{name}: {} {high}",
                    wind_up.rotation_rad()
                );
                for (tooth, force_n) in teeth.iter().zip(&forces) {
                    let expected_n = turned(tooth, high).0;
                    // A light load across wide gaps loses some digits in differences.
                    assert!((force_n - expected_n).abs() < 1e-4 * peak_n, "{name}: {force_n} N, {expected_n} N");
                }
                // The torque's derivative is the stiffness.
                let rise = torque_nmm(high * (1.0 + 1e-5)) - torque_nmm(high * (1.0 - 1e-5));
                let stiffness = rise / (2e-5 * high);
                if torque_nm > 1.0 {
                    assert!((wind_up.stiffness_nmm_per_rad / stiffness - 1.0).abs() < 1e-3, "{name}: {stiffness}");
                }
            }
        }
    }
}

#[test]
fn light_load_without_gaps_moves_nothing() {
    for parameters in [PAPER_5_1, PAPER_5_2, ECCENTRIC, THREE_LOBES] {
        let still = swept(&parameters, &LoadParameters { wave_generator_moves: false, ..moving(1e-10) }, 12);
        let moved = swept(&parameters, &moving(1e-10), 12);
        let peak_n = still.peaks.wave_generator.force_n.value;
        for (one, other) in still.states.force_n.wave_generator.iter().zip(&moved.states.force_n.wave_generator) {
            assert!((one - other).abs() < 1e-9 * peak_n, "{one} {other}");
        }
        assert!(moved.torque_balance_residual < 1e-13, "{:e}", moved.torque_balance_residual);
    }
}

/// The wave generator pushes a passed tooth along its remaining way, so no load jumps.
#[test]
fn passed_tooth_is_released_gradually() {
    let drive = drive(&PAPER_5_1);
    let case = LoadCase::new(&moving(20.0)).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    let (_, wind_up, forces) = shared(&loaded, 3);
    let turned_rad = wind_up.rotation_rad();
    let peak_n = forces.iter().copied().fold(0.0, f64::max);
    let at = |share: f64| {
        let tooth = loaded.tooth(Position::from_lobe(share * turned_rad, 2)).unwrap();
        (loaded.forces_n(&tooth, &wind_up).unwrap().wave_generator, tooth.spring.turned_arm_mm(&wind_up.rotation))
    };
    let (before, on_lobe, passed, left) = (at(1.5), at(1.0), at(0.75), at(0.45));
    assert!(before.0 > on_lobe.0 && on_lobe.0 > passed.0 && passed.0 > 0.0 && left.0 == 0.0);
    assert!(before.1 > 0.0 && on_lobe.1.abs() < 1e-3 * before.1 && passed.1 < 0.0);
    assert!(on_lobe.0 < 0.01 * peak_n, "{} of {peak_n}", on_lobe.0);
}

/// Without an arm, the wave generator lifts the tooth by half its curvature times the rotation squared.
#[test]
fn tooth_in_valley_closes_gap_after_rotation() {
    for (parameters, lobes) in [(PAPER_5_1, 2), (ECCENTRIC, 1), (THREE_LOBES, 3)] {
        let drive = drive(&parameters);
        let clearance_um = PerContact { ring: 10.0, ..PerContact::default() };
        let case = LoadCase::new(&LoadParameters { clearance_um, ..moving(20.0) }).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let tooth = loaded.tooth(Position::valley(lobes)).unwrap();
        let lifted_mm = |turned_rad: f64| {
            let valley_rad = std::f64::consts::PI / f64::from(lobes);
            at(&drive, valley_rad - turned_rad).center_radius_mm - tooth.center.center_radius_mm
        };
        let closing_rad = tooth.spring.closing_rad;
        assert!((lifted_mm(closing_rad) / 0.01 - 1.0).abs() < 0.02, "{closing_rad}: {}", lifted_mm(closing_rad));
        let further = Rotation { closing_rad, excess_rad: 0.5 * closing_rad };
        assert!(tooth.spring.force_n(&further).unwrap() > 0.0);
        assert!(tooth.spring.turned_arm_mm(&further) > 0.0);
        // It carries its share beside a tooth with an arm.
        let lifted = loaded.tooth(Position::from_lobe(1.0 / f64::from(lobes), lobes)).unwrap();
        let both = [lifted, tooth];
        let springs = Springs::new(&both, f64::from(lobes));
        let torque_nmm = springs.torque_nmm(&further).unwrap().value;
        let found = springs.wind_up(torque_nmm).unwrap().unwrap();
        assert!((found.rotation.rad() / further.rad() - 1.0).abs() < 1e-12);
    }
}

/// The ring's rotation against the slot moves the place on the teeth's path, the wave generator's the place under it.
#[test]
fn slot_gaps_close_at_rigid_body_rotation() {
    for (parameters, carrier_um) in
        [(PAPER_5_1, 20.0), (PAPER_5_1, 500.0), (PAPER_5_2, 10.0), (ECCENTRIC, 100.0), (THREE_LOBES, 50.0)]
    {
        let drive = drive(&parameters);
        let clearance_um = PerContact { carrier: carrier_um, ..PerContact::default() };
        let case = LoadCase::new(&LoadParameters { clearance_um, ..moving(1e-9) }).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let k = drive.flank().teeth_per_wave();
        let s = drive.sense();
        for share in [0.3, 0.6, 0.9, 0.97] {
            let position_rad = share * drive.flank_limit().position.from_lobe_rad;
            let tooth = loaded.tooth(Position::from_lobe(position_rad, drive.lobes())).unwrap();
            // On the flank the tooth is at its wall, offset in a slot that is k times as far ahead.
            let on_flank_mm = at(&drive, position_rad).center_radius_mm;
            let aside_rad = (1e-3 * carrier_um / on_flank_mm).asin();
            let slot_rad = position_rad + k * aside_rad;
            let under_mm =
                |turned_rad: f64| at(&drive, slot_rad - turned_rad + s * aside_rad).center_radius_mm - on_flank_mm;
            let closing_rad = tooth.spring.closing_rad;
            let [before_mm, after_mm] = [0.999, 1.001].map(|of| under_mm(of * closing_rad));
            assert!(before_mm < 0.0 && after_mm > 0.0, "{parameters:?} at {share}: {before_mm} {after_mm}");
        }
    }
}

/// Once the slot is closed, the wave generator lifts the tooth by the remaining gap at the ring, with the same arm.
#[test]
fn tooth_of_turned_slot_closes_remaining_gaps() {
    let drive = drive(&PAPER_5_1);
    let clearance_um = PerContact { ring: 300.0, ..PerContact::default() };
    let case = LoadCase::new(&LoadParameters { clearance_um, ..moving(20.0) }).unwrap();
    for position_rad in [0.5, 1.2, 1.5] {
        for arcsec in [-2000.0_f64, -300.0, 300.0] {
            let mut slot_angle_arcsec = vec![0.0; 28];
            slot_angle_arcsec[5] = arcsec;
            let deviations = Deviations { slot_angle_arcsec, ..Deviations::default() };
            let loaded = LoadedDrive::deviating(&drive, &case, &deviations).unwrap();
            let place = Place { slot: 5, ring_space: 5, lobe: 0 };
            let tooth = loaded.tooth_at(&place, Position::from_lobe(position_rad, 2)).unwrap();
            let cos = 1.0 / tooth.center.tan_pressure_angle.hypot(1.0);
            let arm_mm = cos * slope_mm(&drive, position_rad);
            let decline_mm =
                cos * (slope_mm(&drive, position_rad + 1e-5) - slope_mm(&drive, position_rad - 1e-5)) / 2e-5;
            let slot_rad = drive.teeth_per_wave() * (arcsec / 3600.0).to_radians();
            // A growing arm starts when the valley passes.
            let from_rad = if decline_mm < 0.0 { slot_rad.max(arm_mm / decline_mm) } else { slot_rad };
            let way_mm = |turned_rad: f64| arm_mm * turned_rad - 0.5 * decline_mm * turned_rad * turned_rad;
            let closing_rad = tooth.spring.closing_rad;
            let (left_mm, gap_mm) = (way_mm(closing_rad) - way_mm(from_rad), 0.3 * tooth.force_ratio.ring);
            assert!(closing_rad > from_rad, "{arcsec} at {position_rad}: {closing_rad}");
            assert!((left_mm / gap_mm - 1.0).abs() < 1e-6, "{arcsec} at {position_rad}: {left_mm} of {gap_mm}");
            let left_arm_mm = arm_mm - decline_mm * closing_rad;
            assert!((tooth.spring.arm_mm / left_arm_mm - 1.0).abs() < 1e-6, "{arcsec} at {position_rad}");
        }
    }
}

/// Positions count from those of most items, for either direction of the deviation.
#[test]
fn turned_item_does_not_affect_other_teeth() {
    let drive = drive(&PAPER_5_1);
    let case = LoadCase::new(&moving(20.0)).unwrap();
    let spring = |slot_arcsec: f64, space_arcsec: f64| {
        let (mut slot_angle_arcsec, mut ring_space_angle_arcsec) = (vec![0.0; 28], vec![0.0; 26]);
        (slot_angle_arcsec[3], ring_space_angle_arcsec[3]) = (slot_arcsec, space_arcsec);
        let deviations = Deviations { slot_angle_arcsec, ring_space_angle_arcsec, ..Deviations::default() };
        let loaded = LoadedDrive::deviating(&drive, &case, &deviations).unwrap();
        let other = Place { slot: 5, ring_space: 5, lobe: 0 };
        loaded.tooth_at(&other, Position::from_lobe(0.6, 2)).unwrap().spring
    };
    for arcsec in [-60.0, 60.0] {
        assert_eq!(spring(arcsec, 0.0), spring(0.0, 0.0));
        assert_eq!(spring(0.0, arcsec), spring(0.0, 0.0));
    }
}

#[test]
fn slot_gap_transmission_error_follows_tooth_radii() {
    let drive = drive(&PAPER_5_1);
    let clearance_um = PerContact { carrier: 20.0, ..PerContact::default() };
    let case = LoadCase::new(&LoadParameters { clearance_um, ..moving(1e-6) }).unwrap();
    let sweep = sweep::sweep(&drive, &case, Points::samples(100).unwrap(), &Never).unwrap();
    let wind_up_deg = &sweep.input_angles.wind_up_deg;
    let [least_deg, most_deg] = [f64::min, f64::max].map(|of| wind_up_deg.iter().copied().reduce(of).unwrap());
    // `(Z_G/U) g_S/d` of 63 and 61 mm.
    let [at_lobe_deg, in_valley_deg] = [63.0, 61.0].map(|radius_mm: f64| (14.0 * 0.02 / radius_mm).to_degrees());
    assert!(least_deg > at_lobe_deg && most_deg < in_valley_deg, "{least_deg} {most_deg}");
    assert!(sweep.torque_balance_residual < 1e-12, "{:e}", sweep.torque_balance_residual);
}

/// The gaps only shift the angle at which teeth reach the flank.
#[test]
fn equal_slot_gaps_hardly_change_bored_tip_peak() {
    for parameters in [PAPER_5_2, PAPER_5_2_BORED] {
        let peak_n = |carrier_um: f64| {
            let clearance_um = PerContact { carrier: carrier_um, ..PerContact::default() };
            let load = LoadParameters { clearance_um, ring_teeth_bend: true, ..moving(3.0) };
            let case = LoadCase::new(&load).unwrap();
            let points = Points::tolerance(1e-4, 1_000_000).unwrap();
            let sweep = sweep::sweep(&drive(&parameters), &case, points, &Never).unwrap();
            sweep.peaks.wave_generator.force_n.value
        };
        let without_n = peak_n(0.0);
        for carrier_um in [5.0, 20.0, 50.0] {
            let share = peak_n(carrier_um) / without_n - 1.0;
            assert!(share.abs() < 3e-4 * carrier_um + 1e-3, "{carrier_um} µm: {share}");
        }
    }
}

/// In the valley the slot that is turned least leads the others.
#[test]
fn no_tooth_is_pressed_before_its_gap_closes() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 0.8 },
        teeth: 18,
        installed: 18,
        tooth_radius_mm: 2.5,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 19,
        tip_radius_mm: None,
    };
    let turned = [52.96, 69.78, 23.81, 30.76, 9.31, 82.49, 33.33, 5.88, 27.76];
    let slot_angle_arcsec = [[0.0; 9], turned].concat();
    let deviations = Deviations { slot_angle_arcsec, ..Deviations::default() };
    let ahead = Modification { slot_wall_um: -2.0, carrier_rotation_arcsec: 20.0, ..Modification::default() };
    for (parameters, deviations, modification) in
        [(parameters, deviations, Modification::default()), (PAPER_5_1, Deviations::default(), ahead)]
    {
        for torque_nm in [1e-5, 1e-3, 1.0] {
            for law in [ContactLaw::Linear, JOHNSON] {
                let case = LoadCase::new(&LoadParameters { law, modification, ..moving(torque_nm) }).unwrap();
                let points = Points::samples(7).unwrap();
                let sweep =
                    sweep::sweep_with_deviations(&drive(&parameters), &case, &deviations, points, &Never).unwrap();
                assert!(sweep.torque_balance_residual < 1e-11, "{:e}", sweep.torque_balance_residual);
            }
        }
    }
}

/// The search for the rotation must end under a tiny load across wide gaps.
#[test]
fn first_closing_slots_carry_light_load() {
    let drive = drive(&PAPER_5_1);
    let clearance_um = PerContact { carrier: 1000.0, ..PerContact::default() };
    let case = LoadCase::new(&LoadParameters { clearance_um, ..moving(1e-9) }).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    let (teeth, wind_up, forces) = shared(&loaded, 0);
    for (tooth, &force_n) in teeth.iter().zip(&forces) {
        assert_eq!(force_n > 0.0, tooth.spring.closing_rad < wind_up.rotation_rad(), "{force_n} N");
    }
    let sweep = sweep::sweep(&drive, &case, Points::samples(7).unwrap(), &Never).unwrap();
    assert!(sweep.torque_balance_residual < 1e-12, "{:e}", sweep.torque_balance_residual);
}

#[test]
fn gaps_wider_than_lift_give_an_error() {
    let drive = drive(&PAPER_5_2);
    let allowable_stress_mpa = Some(everywhere(1500.0));
    for clearance_um in [everywhere(0.0), PerContact { ring: 1000.0, ..PerContact::default() }] {
        for torque_nm in [3.0, 1e5] {
            if clearance_um.ring == 0.0 && torque_nm < 10.0 {
                continue;
            }
            let law = ContactLaw::Palmgren;
            let case = LoadCase::new(&LoadParameters { law, clearance_um, allowable_stress_mpa, ..moving(torque_nm) })
                .unwrap();
            let found = sweep::sweep(&drive, &case, Points::samples(4).unwrap(), &Never);
            assert_eq!(found.map(|sweep| sweep.peaks), Err(SolveError::TurnedPastTeeth), "{torque_nm} N·m");
        }
    }
}

#[test]
fn allowable_stress_is_reached_under_torque_capacity() {
    for parameters in [PAPER_5_1, PAPER_5_2, ECCENTRIC] {
        for ring_um in [0.0, 10.0] {
            let clearance_um = PerContact { ring: ring_um, ..PerContact::default() };
            let allowable_stress_mpa = Some(everywhere(1200.0));
            let asked = LoadParameters { clearance_um, allowable_stress_mpa, ..moving(3.0) };
            let capacity = swept(&parameters, &asked, 24).torque_capacity.unwrap();
            let torque = Torque::Input(capacity.input_torque_nm);
            let loaded = swept(&parameters, &LoadParameters { torque, ..asked }, 24);
            let largest_mpa = loaded.peaks.iter().map(|(_, peaks)| peaks.stress_mpa.value).fold(0.0, f64::max);
            assert!((largest_mpa / 1200.0 - 1.0).abs() < 1e-10, "{parameters:?} {ring_um}: {largest_mpa}");
        }
    }
}

/// Material so soft that the wave generator turns far past the first tooth.
const PLASTIC: Materials = {
    let soft = Material { youngs_modulus_gpa: 3.5, poissons_ratio: 0.4 };
    Materials { wave_generator: soft, teeth: soft, ring: soft, carrier: soft }
};

const FINE_ECCENTRIC: DriveParameters = DriveParameters {
    wave_generator: WaveGenerator::Eccentric { radius_mm: 5.58, eccentricity_mm: 0.34 },
    teeth: 41,
    installed: 41,
    tooth_radius_mm: 0.427,
    tooth: ToothShape::Cylinder { width_mm: 0.885 },
    ring_teeth: 40,
    tip_radius_mm: None,
};

/// Returns rotation and torque of the first maximum after all gaps are closed, within a quarter of a lobe.
/// It searches in small steps, then by thirds.
fn first_maximum(teeth: &[ToothState], lobes: u32) -> Option<(f64, f64)> {
    const STEPS: u32 = 1000;
    let springs = Springs::new(teeth, f64::from(lobes));
    let torque_nmm =
        |turned_rad: f64| springs.torque_nmm(&Rotation { closing_rad: 0.0, excess_rad: turned_rad }).unwrap().value;
    let closings_rad = teeth.iter().map(|tooth| tooth.spring.closing_rad).filter(|closing_rad| closing_rad.is_finite());
    let last_rad = closings_rad.fold(0.0, f64::max);
    let step_rad = 0.5 * std::f64::consts::PI / f64::from(lobes) / f64::from(STEPS);
    let mut before_nmm = 0.0;
    let mut falls = |&step: &u32| {
        let turned_rad = f64::from(step) * step_rad;
        let now_nmm = torque_nmm(turned_rad);
        let falls = turned_rad - step_rad > last_rad && now_nmm < before_nmm;
        before_nmm = now_nmm;
        falls
    };
    let step = (1..STEPS).find(|step| falls(step))? - 1;
    let (mut low, mut high) = (f64::from(step - 1) * step_rad, f64::from(step + 1) * step_rad);
    for _ in 0..100 {
        let third = (high - low) / 3.0;
        if torque_nmm(low + third) < torque_nmm(high - third) { low += third } else { high -= third }
    }
    Some((low, torque_nmm(low)))
}

/// Returns soft drives with few and many teeth in mesh, and eccentric ones with pointed tips.
fn soft_drives() -> Vec<(DriveParameters, f64)> {
    let mut drives = vec![(FINE_ECCENTRIC, 0.0), (PAPER_5_2, 0.0), (PAPER_5_2, 30.0), (PAPER_5_2_BORED, 10.0)];
    // A reproducible sequence.
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    while drives.len() < 24 {
        let teeth = [20, 27, 34, 41, 50, 59][drives.len() % 6];
        let radius_mm = 5.0 + 30.0 * random();
        let parameters = DriveParameters {
            wave_generator: WaveGenerator::Eccentric {
                radius_mm,
                eccentricity_mm: radius_mm * (0.02 + 0.06 * random()),
            },
            teeth,
            installed: teeth,
            tooth_radius_mm: radius_mm * std::f64::consts::PI / teeth as f64 * (0.3 + 0.6 * random()),
            tooth: ToothShape::Cylinder { width_mm: 0.2 * radius_mm },
            ring_teeth: teeth - 1,
            tip_radius_mm: None,
        };
        let ring_um = if random() < 0.5 { 0.0 } else { radius_mm * random() };
        if Drive::new(&parameters).is_ok() {
            drives.push((parameters, ring_um));
        }
    }
    drives
}

/// Calls a function with teeth of some input angles of soft drives, and their maximum torque.
fn at_soft_teeth(mut look: impl FnMut(&LoadedDrive<'_>, &[ToothState], (f64, f64))) {
    let mut looked = 0;
    for (parameters, ring_um) in soft_drives() {
        let drive = drive(&parameters);
        for law in [ContactLaw::Linear, JOHNSON] {
            let clearance_um = PerContact { ring: ring_um, ..PerContact::default() };
            let asked = LoadParameters { law, materials: PLASTIC, clearance_um, ..moving(1e-6) };
            let case = LoadCase::new(&asked).unwrap();
            let Ok(loaded) = LoadedDrive::new(&drive, &case) else { continue };
            for sample in [0, 2, 5] {
                let placed = loaded.mesh().placed_at(sample, Samples::new(7).unwrap());
                let teeth: Vec<_> = placed.map(|placed| loaded.tooth(placed.position).unwrap()).collect();
                if let Some(maximum) = first_maximum(&teeth, drive.lobes()) {
                    look(&loaded, &teeth, maximum);
                    looked += 1;
                }
            }
        }
    }
    assert!(looked > 30, "{looked}");
}

/// The search must not step over the maximum.
#[test]
fn every_torque_below_first_maximum_is_carried() {
    at_soft_teeth(|loaded, teeth, (turned_rad, most_nmm)| {
        let springs = Springs::new(teeth, f64::from(loaded.drive().lobes()));
        for share in [1e-9, 0.1, 0.5, 0.9, 0.98, 0.995, 0.999_999] {
            let found = springs.wind_up(share * most_nmm).unwrap();
            let rotation = found.unwrap_or_else(|| panic!("{share} of {most_nmm} N·mm")).rotation;
            assert!(rotation.rad() < turned_rad, "{share}: {} {turned_rad}", rotation.rad());
            let torque_nmm = springs.torque_nmm(&rotation).unwrap().value;
            assert!((torque_nmm / (share * most_nmm) - 1.0).abs() < 1e-9, "{share}: {torque_nmm} N·mm");
        }
        for share in [1.000_001, 1.03, 1.5, 10.0] {
            assert_eq!(springs.wind_up(share * most_nmm).unwrap(), None, "{share} of {most_nmm} N·mm");
        }
    });
}

#[test]
fn capacity_never_falls_with_higher_allowable_stress() {
    at_soft_teeth(|loaded, teeth, (_, most_nmm)| {
        let mut before_nmm = 0.0;
        for exponent in 0..40 {
            let stress_mpa = 10.0 * 1.2_f64.powi(exponent);
            let limit = loaded.torque_limit(teeth, &everywhere(stress_mpa)).unwrap();
            if limit.law_end.is_some() {
                break;
            }
            assert!(limit.input_torque_nmm >= before_nmm * (1.0 - 1e-9), "{stress_mpa} MPa: {limit:?} {before_nmm}");
            assert!(limit.input_torque_nmm <= most_nmm * (1.0 + 1e-9), "{stress_mpa} MPa: {limit:?} {most_nmm}");
            if limit.turns_past_teeth {
                // If a tooth is released at the maximum, the torque's error is proportional to the place's.
                assert!((limit.input_torque_nmm / most_nmm - 1.0).abs() < 1e-8, "{limit:?} {most_nmm}");
            }
            before_nmm = limit.input_torque_nmm;
        }
    });
}

#[test]
fn unlimited_capacity_reports_wave_generator_passing_teeth() {
    let capacity = |parameters: &DriveParameters, ring_um: f64, stress_mpa: f64| {
        let clearance_um = PerContact { ring: ring_um, ..PerContact::default() };
        let allowable_stress_mpa = Some(everywhere(stress_mpa));
        let asked = LoadParameters {
            materials: PLASTIC,
            ring_teeth_bend: true,
            clearance_um,
            allowable_stress_mpa,
            ..moving(0.002)
        };
        swept(parameters, &asked, 20).torque_capacity.unwrap()
    };
    for ring_um in [10.0, 30.0] {
        let capacities = [100.0, 200.0, 400.0].map(|stress_mpa| capacity(&PAPER_5_2, ring_um, stress_mpa));
        let torques_nm = capacities.map(|capacity| capacity.input_torque_nm);
        assert!(torques_nm.is_sorted(), "{torques_nm:?}");
        assert_eq!(capacities.map(|capacity| capacity.turns_past_teeth), [false, false, true], "{torques_nm:?}");
    }
    // An allowable stress that no contact reaches must not cause a refusal.
    assert!(capacity(&PAPER_5_2_BORED, 10.0, 300.0).turns_past_teeth);
}

/// With relief along the whole flank, the tooth nearest to the lobe closes first and carries next to nothing.
#[test]
fn wave_generator_passes_lobe_tooth_to_reach_others() {
    let ring_tip_relief = Some(TipRelief { amount_um: 200.0, start_deg: 0.0, power: 2.0 });
    let modification = Modification { ring_tip_relief, ..Modification::default() };
    let drive = drive(&PAPER_5_1);
    let case = LoadCase::new(&LoadParameters { modification, ..moving(1.0) }).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    let teeth = [0.002, 0.4, 0.8].map(|position_rad| loaded.tooth(Position::from_lobe(position_rad, 2)).unwrap());
    let springs = Springs::new(&teeth, 2.0);
    let passed_rad = 2.0 * teeth[0].spring.arm_mm / teeth[0].spring.arm_decline_mm_per_rad;
    assert!(teeth[1].spring.closing_rad > passed_rad);
    let found = springs.wind_up(1e3).unwrap().unwrap();
    assert!(found.rotation.rad() > teeth[1].spring.closing_rad);
    assert!((springs.torque_nmm(&found.rotation).unwrap().value / 1e3 - 1.0).abs() < 1e-12);
}

/// The wave generator still moves on to where the relieved tooth closes its gap.
#[test]
fn capacity_is_higher_of_two_maxima() {
    let ring_tip_relief = Some(TipRelief { amount_um: 2000.0, start_deg: 12.0, power: 1.0 });
    let modification = Modification { ring_tip_relief, ..Modification::default() };
    let drive = drive(&PAPER_5_1);
    let case = LoadCase::new(&LoadParameters { modification, ..moving(1.0) }).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    let teeth = [0.2, 0.3].map(|position_rad| loaded.tooth(Position::from_lobe(position_rad, 2)).unwrap());
    let springs = Springs::new(&teeth, 2.0);
    let torque_nmm = |step: u32| {
        let rotation = Rotation { closing_rad: 0.0, excess_rad: 1e-4 * f64::from(step) };
        springs.torque_nmm(&rotation).unwrap().value
    };
    let maxima: Vec<_> = (1..4000)
        .filter(|&step| torque_nmm(step) > torque_nmm(step - 1) && torque_nmm(step) >= torque_nmm(step + 1))
        .map(torque_nmm)
        .collect();
    assert!(maxima.len() == 2 && maxima[0] > 1.1 * maxima[1], "{maxima:?}");
    let limit = loaded.torque_limit(&teeth, &everywhere(1e9)).unwrap();
    assert!(limit.turns_past_teeth && (limit.input_torque_nmm / maxima[0] - 1.0).abs() < 1e-4, "{limit:?} {maxima:?}");
}

#[test]
fn no_dense_sweep_exceeds_tolerance_sweep() {
    for (parameters, torque_nm) in [(PAPER_5_1, 20.0), (PAPER_5_2, 3.0), (THREE_LOBES, 30.0)] {
        for ring_um in [0.0, 10.0] {
            let clearance_um = PerContact { ring: ring_um, ..PerContact::default() };
            let case = LoadCase::new(&LoadParameters { clearance_um, ..moving(torque_nm) }).unwrap();
            let drive = drive(&parameters);
            let of = |points| sweep::sweep(&drive, &case, points, &Never).unwrap();
            let dense = of(Points::samples(2000).unwrap());
            let found = of(Points::tolerance(1e-6, 1_000_000).unwrap());
            assert!(found.torque_balance_residual < 1e-12);
            for ((contact, dense), (_, found)) in dense.peaks.iter().zip(found.peaks.iter()) {
                assert!(dense.force_n.value < found.force_n.value * (1.0 + 1e-6), "{contact:?} of {parameters:?}");
                assert!(
                    dense.stress_mpa.value < found.stress_mpa.value * (1.0 + 1e-6),
                    "{contact:?} of {parameters:?}"
                );
            }
        }
    }
}

/// Before the tooth enters the regular tip, the wave generator has moved so far that it presses the valley tooth.
#[test]
fn tolerance_sweep_sees_capacity_before_tooth_entry() {
    let ellipse = WaveGenerator::Ellipse { semi_major_mm: 32.9442, semi_minor_mm: 31.7933 };
    let parameters = DriveParameters {
        wave_generator: ellipse,
        teeth: 16,
        installed: 16,
        tooth_radius_mm: 2.7234,
        tooth: ToothShape::Cylinder { width_mm: 13.25 },
        ring_teeth: 18,
        tip_radius_mm: None,
    };
    let drive = drive(&parameters);
    let modification = Modification {
        wave_generator_equidistant_um: 13.8,
        ring_tip_relief: Some(TipRelief { amount_um: 15.4, start_deg: 35.1, power: 2.0 }),
        ..Modification::default()
    };
    let case = LoadCase::new(&LoadParameters {
        modification,
        allowable_stress_mpa: Some(everywhere(20_000.0)),
        ..moving(13.6)
    });
    let case = case.unwrap();
    let capacity_nm =
        |points: Points| sweep::sweep(&drive, &case, points, &Never).unwrap().torque_capacity.unwrap().input_torque_nm;
    let dense_nm = capacity_nm(Points::samples(1000).unwrap());
    for tolerance in [1e-3, 1e-4] {
        let found_nm = capacity_nm(Points::tolerance(tolerance, 1_000_000).unwrap());
        assert!(found_nm <= (1.0 + tolerance) * dense_nm, "{found_nm} to {tolerance}, {dense_nm}");
    }
}

#[test]
fn projection_rejects_moving_wave_generator() {
    let refused = LoadCase::new(&LoadParameters { wave_generator_moves: true, ..load(3.0, Projection) });
    assert_eq!(refused, Err(vec![Violation::needs_virtual_work(Parameter::WaveGeneratorMoves)]));
}
