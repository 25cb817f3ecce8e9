//! Gaps of modified and deviating parts, against the real curves after their motion.

use std::f64::consts::PI;

use nalgebra::{Rotation2, Vector2};
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::gaps::{Deviations, Gaps, Runout, TipRelief};
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::mesh::{Mesh, Place, Samples};
use toothwave_solver::violation::{Listed, Modified};
use toothwave_solver::{
    Drive, DriveParameters, FieldCode, LoadCase, LoadParameters, Modification, Never, Parameter, PerContact, Position,
    SolveError, Violation,
    sweep::{self, Points},
};

use crate::drives::{PAPER_5_1, drive, ellipse, load, semi_axes_mm};

/// A size small enough for first order, and large enough for accurate differences.
const SMALL_UM: f64 = 1e-3;
const SMALL_MM: f64 = 1e-6;
const SMALL_ARCSEC: f64 = 1e-2;
const SMALL_RAD: f64 = SMALL_ARCSEC * PI / 648_000.0;

fn larger() -> DriveParameters {
    DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.5, ..PAPER_5_1 }
}

fn unit(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(angle_rad.cos(), angle_rad.sin())
}

/// Returns the path of centres around the cam by the cam's normal angle, without the solver.
fn path_at_normal(p: &DriveParameters, normal_rad: f64) -> Vector2<f64> {
    let ((a, b), r) = (semi_axes_mm(p), p.tooth_radius_mm);
    let n = unit(normal_rad);
    let h = (a * n.x).hypot(b * n.y);
    Vector2::new(a * a / h * n.x, b * b / h * n.y) + n * r
}

/// Returns the centre's distance at a position, by bisection of the normal's angle.
fn distance_at(p: &DriveParameters, position_rad: f64) -> f64 {
    let turn = (position_rad / PI).floor() * PI;
    let (mut low, mut high) = (turn - 0.6, turn + PI + 0.6);
    let polar = |normal: f64| {
        let c = path_at_normal(p, normal);
        let mut angle = c.y.atan2(c.x);
        while angle < normal - PI {
            angle += 2.0 * PI;
        }
        while angle > normal + PI {
            angle -= 2.0 * PI;
        }
        angle
    };
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if polar(middle) < position_rad { low = middle } else { high = middle }
    }
    path_at_normal(p, 0.5 * (low + high)).norm()
}

/// Returns the path of centres in a ring space by position, shifted outward by `shift_mm` along its radii.
fn path_in_ring(p: &DriveParameters, space: u64, position_rad: f64, shift_mm: f64) -> Vector2<f64> {
    let k = p.ring_teeth as f64 / 2.0;
    let s = if p.teeth > p.ring_teeth { 1.0 } else { -1.0 };
    let angle = 2.0 * PI * space as f64 / p.ring_teeth as f64 - s * position_rad / k;
    unit(angle) * (distance_at(p, position_rad) + shift_mm)
}

/// Returns a point's signed distance from a curve along the normal at the nearest point, by parabolas around `near`.
fn signed_distance(point: Vector2<f64>, outward: Vector2<f64>, near: f64, curve: impl Fn(f64) -> Vector2<f64>) -> f64 {
    // The tangent is a central difference. Newton's method on (P - C(t))·C'(t) needs only a rough second difference.
    let tangent = |t: f64| (curve(t + 1e-5) - curve(t - 1e-5)) / 2e-5;
    let mut t = near;
    for _ in 0..30 {
        let (along, off) = (tangent(t), point - curve(t));
        let bend = (curve(t + 1e-3) - 2.0 * curve(t) + curve(t - 1e-3)) / 1e-6;
        t += off.dot(&along) / (along.norm_squared() - off.dot(&bend));
    }
    let along = tangent(t).normalize();
    let normal = Vector2::new(along.y, -along.x);
    let normal = if normal.dot(&outward) < 0.0 { -normal } else { normal };
    (curve(t) - point).dot(&normal)
}

fn gaps_of(
    drive: &Drive,
    modification: Modification,
    deviations: &Deviations,
    place: &Place,
    tooth: &ToothState,
) -> PerContact<f64> {
    Gaps::new(drive, &PerContact::default(), modification, Some(deviations)).at(place, &tooth.center, &tooth.flank)
}

fn tooth_of(drive: &Drive, degrees: f64) -> ToothState {
    let case = LoadCase::new(&load(20.0, VirtualWork)).unwrap();
    LoadedDrive::new(drive, &case).unwrap().tooth(Position::from_lobe(degrees.to_radians(), 2)).unwrap()
}

const DEGREES: [f64; 5] = [3.0, 25.0, 45.0, 68.0, 86.0];

/// Returns the gap at the ring after `moved` is applied to its path, shifted by `shift_mm` along its radii.
fn gap_of_moved_ring(
    p: &DriveParameters,
    place: &Place,
    degrees: f64,
    shift_mm: f64,
    moved: impl Fn(Vector2<f64>) -> Vector2<f64>,
) -> f64 {
    let position = degrees.to_radians();
    let center = path_in_ring(p, place.ring_space, position, 0.0);
    signed_distance(center, center, position, |t| moved(path_in_ring(p, place.ring_space, t, shift_mm)))
}

#[track_caller]
fn assert_near(found_mm: f64, moved_mm: f64, size_mm: f64) {
    // Allows the second order in the size, and rounding of 60 mm over a millionth.
    assert!((found_mm - moved_mm).abs() < 1e-6 * size_mm, "{found_mm:e} is not {moved_mm:e}");
}

#[test]
fn shifted_or_turned_ring_opens_real_gap() {
    for p in [PAPER_5_1, larger()] {
        let drive = drive(&p);
        let s = drive.sense();
        for degrees in DEGREES {
            let tooth = tooth_of(&drive, degrees);
            let place = Place { slot: 3, ring_space: 5, lobe: 0 };
            let none = Deviations::default();
            let gap = |modification| gaps_of(&drive, modification, &none, &place, &tooth).ring;
            let shifted = gap(Modification { ring_path_shift_um: SMALL_UM, ..Modification::default() });
            assert_near(shifted, gap_of_moved_ring(&p, &place, degrees, SMALL_MM, |c| c), SMALL_MM);
            // Away from the flank under load: backward for s = +1.
            let turned = gap(Modification { ring_rotation_arcsec: SMALL_ARCSEC, ..Modification::default() });
            let rotated = |c: Vector2<f64>| Rotation2::new(-s * SMALL_RAD) * c;
            assert_near(turned, gap_of_moved_ring(&p, &place, degrees, 0.0, rotated), 60.0 * SMALL_RAD);
            let mut one = Deviations { ring_space_angle_arcsec: vec![0.0; 30], ..Deviations::default() };
            one.ring_space_angle_arcsec[5] = SMALL_ARCSEC;
            assert_eq!(gaps_of(&drive, Modification::default(), &one, &place, &tooth).ring, turned);
            let elsewhere = Place { ring_space: 6, ..place };
            assert_eq!(gaps_of(&drive, Modification::default(), &one, &elsewhere, &tooth).ring, 0.0);
        }
    }
}

#[test]
fn equidistant_opens_full_gap_and_profile_shift_cosine() {
    for p in [PAPER_5_1, larger()] {
        let drive = drive(&p);
        for degrees in DEGREES {
            let tooth = tooth_of(&drive, degrees);
            let place = Place::default();
            let none = Deviations::default();
            let position = degrees.to_radians();
            let center = path_in_ring(&p, 0, position, 0.0);
            // The flank as points: neighbours on the path, plus a radius along the normal.
            let flank = |t: f64, r: f64| {
                let (before, after) = (path_in_ring(&p, 0, t - 1e-5, 0.0), path_in_ring(&p, 0, t + 1e-5, 0.0));
                let along = (after - before).normalize();
                let normal = Vector2::new(along.y, -along.x);
                let c = path_in_ring(&p, 0, t, 0.0);
                c + if normal.dot(&c) < 0.0 { -normal } else { normal } * r
            };
            let r = p.tooth_radius_mm;
            let wider = |t: f64| flank(t, r + SMALL_MM);
            let equidistant = Modification { ring_equidistant_um: SMALL_UM, ..Modification::default() };
            let moved = signed_distance(center, center, position, wider) - r;
            assert_near(gaps_of(&drive, equidistant, &none, &place, &tooth).ring, moved, 10.0 * SMALL_MM);
            let along_radii = |t: f64| {
                let point = flank(t, r);
                point + point.normalize() * SMALL_MM
            };
            let shifted = Modification { ring_profile_shift_um: SMALL_UM, ..Modification::default() };
            let moved = signed_distance(center, center, position, along_radii) - r;
            assert_near(gaps_of(&drive, shifted, &none, &place, &tooth).ring, moved, 10.0 * SMALL_MM);
        }
    }
}

#[test]
fn runout_changes_gaps_between_real_curves() {
    for p in [PAPER_5_1, larger()] {
        let drive = drive(&p);
        let s = drive.sense();
        for (degrees, angle_deg) in DEGREES.into_iter().zip([0.0_f64, 77.0, 130.0, 215.0, 300.0]) {
            let tooth = tooth_of(&drive, degrees);
            let position = degrees.to_radians();
            let off = unit(angle_deg.to_radians()) * SMALL_MM;
            let runout = Runout { amount_um: SMALL_UM, angle_deg };
            let deviations = Deviations {
                wave_generator_runout: runout,
                ring_runout: runout,
                carrier_runout: runout,
                ..Deviations::default()
            };
            for lobe in [0, 1] {
                let place = Place { slot: 9, ring_space: 4, lobe };
                let found = gaps_of(&drive, Modification::default(), &deviations, &place, &tooth);
                // In the cam's frame the tooth is at its position from the lobe.
                let turn = PI * lobe as f64;
                let center = unit(position + turn) * distance_at(&p, position);
                let cam = signed_distance(center, center, position + turn, |t| path_at_normal(&p, t) + off);
                assert_near(found.wave_generator, -cam, SMALL_MM);
                let ring = gap_of_moved_ring(&p, &place, degrees, 0.0, |c| c + off);
                assert_near(found.ring, ring, SMALL_MM);
                // A plane wall beside the tooth, ahead of it for s = +1.
                let slot = 2.0 * PI * 9.0 / p.installed as f64;
                let wall = Rotation2::new(slot) * Vector2::new(0.0, s);
                assert_near(found.carrier, wall.dot(&off), SMALL_MM);
            }
        }
    }
}

#[test]
fn walls_teeth_lobes_and_rotation_open_their_gaps() {
    let drive = drive(&PAPER_5_1);
    let tooth = tooth_of(&drive, 40.0);
    let d = tooth.center.center_radius_mm;
    let place = Place { slot: 2, ring_space: 1, lobe: 1 };
    let list = |count: usize, at: usize| {
        let mut list = vec![0.0; count];
        list[at] = 1.0;
        list
    };
    let thin = Deviations { tooth_radius_um: list(28, 2), ..Deviations::default() };
    let found = gaps_of(&drive, Modification::default(), &thin, &place, &tooth);
    assert_eq!(found, PerContact { wave_generator: 1e-3, ring: 1e-3, carrier: 1e-3 });
    let modification = Modification {
        tooth_radius_um: 2.0,
        wave_generator_equidistant_um: 3.0,
        slot_wall_um: 5.0,
        carrier_rotation_arcsec: 648_000.0 / PI * 1e-6,
        ..Modification::default()
    };
    let found = gaps_of(&drive, modification, &Deviations::default(), &place, &tooth);
    assert!((found.wave_generator - 5e-3).abs() < 1e-17 && found.ring == 2e-3);
    assert!((found.carrier - (7e-3 + 1e-6 * d)).abs() < 1e-17);
    let items = Deviations {
        slot_wall_um: list(28, 2),
        slot_angle_arcsec: list(28, 2),
        ring_space_um: list(26, 1),
        wave_generator_lobe_um: list(2, 1),
        ..Deviations::default()
    };
    let found = gaps_of(&drive, Modification::default(), &items, &place, &tooth);
    let second = PI / 648_000.0;
    assert_eq!((found.wave_generator, found.ring), (1e-3, 1e-3));
    assert!((found.carrier - (1e-3 + second * d)).abs() < 1e-17);
    let next = Place { slot: 3, ring_space: 2, lobe: 0 };
    assert_eq!(gaps_of(&drive, Modification::default(), &items, &next, &tooth), PerContact::default());
}

#[test]
fn tip_relief_grows_from_start_to_flank_end() {
    let drive = drive(&PAPER_5_1);
    let relief = TipRelief { amount_um: 6.0, start_deg: 60.0, power: 2.0 };
    let modification = Modification { ring_tip_relief: Some(relief), ..Modification::default() };
    let at = |degrees| {
        gaps_of(&drive, modification, &Deviations::default(), &Place::default(), &tooth_of(&drive, degrees)).ring
    };
    assert_eq!((at(59.0), at(60.0)), (0.0, 0.0));
    assert!((at(75.0) - 1.5e-3).abs() < 1e-15 && (at(90.0) - 6e-3).abs() < 1e-15);
    let late = Modification { ring_tip_relief: Some(TipRelief { start_deg: 90.0, ..relief }), ..modification };
    let case = LoadCase::new(&LoadParameters { modification: late, ..load(20.0, VirtualWork) }).unwrap();
    let refused = LoadedDrive::new(&drive, &case).unwrap_err();
    let SolveError::Impossible(found) = refused else { panic!("{refused:?}") };
    let parameter = Parameter::Modification(Modified::TipReliefStart);
    let detail = "a tip relief from 90.0 deg on relieves nothing: the flank ends at 90.0 deg";
    assert_eq!(found, [Violation::new(FieldCode::OutOfRange, parameter, 90.0, 90.0, detail.into())]);
}

#[test]
fn turned_ring_or_carrier_is_lost_motion_alone() {
    // kτ and (Z_G/U)τ for every tooth alike: section 4.8.
    let drive = drive(&PAPER_5_1);
    let solved = |modification| {
        let case = LoadCase::new(&LoadParameters { modification, ..load(20.0, VirtualWork) }).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let mesh = Mesh::new(&drive);
        let teeth: Vec<_> =
            mesh.placed_at(2, Samples::new(5).unwrap()).map(|placed| loaded.tooth(placed.position).unwrap()).collect();
        let wind_up = loaded.wind_up(&teeth).unwrap();
        let forces: Vec<_> = teeth.iter().map(|tooth| loaded.forces_n(tooth, &wind_up).unwrap().ring).collect();
        (wind_up.rotation_rad(), forces)
    };
    let (plain, forces) = solved(Modification::default());
    let arcsec = 100.0;
    let tau = arcsec * PI / 648_000.0;
    let ring = solved(Modification { ring_rotation_arcsec: arcsec, ..Modification::default() });
    let carrier = solved(Modification { carrier_rotation_arcsec: arcsec, ..Modification::default() });
    assert!((ring.0 - plain - 13.0 * tau).abs() < 1e-14 && (carrier.0 - plain - 14.0 * tau).abs() < 1e-14);
    for turned in [ring.1, carrier.1] {
        for (one, other) in turned.iter().zip(&forces) {
            assert!((one - other).abs() < 1e-8, "{one} {other}");
        }
    }
}

#[test]
fn deviating_teeth_of_both_zones_share_load() {
    let drive = drive(&PAPER_5_1);
    let mesh = Mesh::new(&drive);
    let solved = |deviations: Option<&Deviations>, zones: u64| {
        let case = LoadCase::new(&LoadParameters {
            clearance_um: PerContact { wave_generator: 5.0, ring: 5.0, carrier: 5.0 },
            ..load(20.0, VirtualWork)
        })
        .unwrap();
        let loaded = match deviations {
            Some(deviations) => LoadedDrive::deviating(&drive, &case, deviations)?,
            None => LoadedDrive::new(&drive, &case)?,
        };
        let mut teeth = Vec::new();
        for lobe in 0..zones {
            for placed in mesh.placed_at(1, Samples::new(4).unwrap()) {
                // The teeth of the second lobe are half a turn away.
                let place = Mesh::new(&drive).place(placed.number + 14 * lobe, lobe);
                teeth.push(loaded.tooth_at(&place, placed.position)?);
            }
        }
        let wind_up = loaded.wind_up(&teeth)?;
        let forces: Vec<_> =
            teeth.iter().map(|tooth| loaded.forces_n(tooth, &wind_up).unwrap().wave_generator).collect();
        let torque: f64 = teeth.iter().zip(&forces).map(|(tooth, force)| force * tooth.center.lever_arm_mm).sum();
        Ok::<_, SolveError>((forces, torque))
    };
    let (alike, half) = solved(None, 1).unwrap();
    assert!((2.0 * half / 20e3 - 1.0).abs() < 1e-14);
    // A deviation at an unloaded tooth changes only the list, which has the second zone.
    let elsewhere =
        Deviations { slot_wall_um: (0..28).map(|i| f64::from(u8::from(i == 10))).collect(), ..Deviations::default() };
    let (both, torque) = solved(Some(&elsewhere), 2).unwrap();
    assert!((torque / 20e3 - 1.0).abs() < 1e-14);
    for (one, other) in both.iter().zip(alike.iter().chain(&alike)) {
        assert!((one - other).abs() < 1e-9);
    }
    // A cam off its axis loads one zone more.
    let off = Runout { amount_um: 2.0, angle_deg: 40.0 };
    let (unlike, torque) =
        solved(Some(&Deviations { wave_generator_runout: off, ..Deviations::default() }), 2).unwrap();
    assert!((torque / 20e3 - 1.0).abs() < 1e-14);
    let sums: Vec<f64> = unlike.chunks(alike.len()).map(|zone| zone.iter().sum()).collect();
    assert!(sums[0] > 1.1 * sums[1], "{sums:?}");
    // The runout exceeds the clearance.
    let far = Runout { amount_um: 60.0, angle_deg: 40.0 };
    let refused = solved(Some(&Deviations { wave_generator_runout: far, ..Deviations::default() }), 2);
    assert!(matches!(refused, Err(SolveError::Interference { gap_um, .. }) if gap_um < 0.0), "{refused:?}");
}

#[test]
fn ring_space_follows_from_slot_and_lobe() {
    // In the ring's frame the tooth is at the middle of its space, minus its position through the ring. Only angles are
    // used here.
    for p in [
        PAPER_5_1,
        larger(),
        DriveParameters {
            teeth: 80,
            installed: 40,
            ring_teeth: 78,
            tooth_radius_mm: 1.5,
            wave_generator: ellipse(50.7, 49.3),
            ..PAPER_5_1
        },
    ] {
        let drive = drive(&p);
        let s = drive.sense();
        let input = 0.013;
        let k = p.ring_teeth as f64 / 2.0;
        for lobe in [0_u64, 1] {
            for slot in 0..p.installed.unsigned_abs() {
                let carrier = s * 2.0 / p.teeth as f64 * input;
                let in_ring = 2.0 * PI * slot as f64 / p.installed as f64 + carrier;
                let position = in_ring - input - PI * lobe as f64;
                let position = (position + 0.5 * PI).rem_euclid(2.0 * PI) - 0.5 * PI;
                if !(0.0..0.5 * PI).contains(&position) {
                    continue;
                }
                let space = Mesh::new(&drive).place(slot, lobe).ring_space;
                let middle = in_ring + s * position / k;
                let off = (middle - 2.0 * PI * space as f64 / p.ring_teeth as f64).rem_euclid(2.0 * PI);
                assert!(off.min(2.0 * PI - off) < 1e-12, "slot {slot}, lobe {lobe}: {off}");
            }
        }
    }
}

/// A carrier turned by τ opens `τ d` at every wall, about 11 µm here.
#[test]
fn turned_carrier_makes_room_for_thick_walls() {
    let swept = |slot_wall_um, carrier_rotation_arcsec| {
        let modification = Modification { slot_wall_um, carrier_rotation_arcsec, ..Modification::default() };
        let case = LoadCase::new(&LoadParameters { modification, ..load(20.0, VirtualWork) }).unwrap();
        sweep::sweep(&drive(&PAPER_5_1), &case, Points::samples(10).unwrap(), &Never)
    };
    assert!(matches!(swept(-5.0, 0.0), Err(SolveError::Interference { .. })));
    assert!(swept(-5.0, 40.0).is_ok());
    assert!(matches!(swept(-15.0, 40.0), Err(SolveError::Interference { .. })));
}

#[test]
fn rejects_deviations_under_projection_or_of_wrong_length() {
    let modification = Modification { slot_wall_um: 1.0, ..Modification::default() };
    let refused = LoadCase::new(&LoadParameters { modification, ..load(20.0, Projection) }).unwrap_err();
    assert_eq!(refused, [Violation::needs_virtual_work(Parameter::Modification(Modified::SlotWall))]);
    let drive = drive(&PAPER_5_1);
    let with = |compatibility, deviations: &Deviations| {
        let case = LoadCase::new(&load(20.0, compatibility)).unwrap();
        LoadedDrive::deviating(&drive, &case, deviations).map(|_| ())
    };
    let some = Deviations { slot_wall_um: vec![1.0; 28], ..Deviations::default() };
    assert_eq!(with(VirtualWork, &some), Ok(()));
    let violation = Violation::needs_virtual_work(Parameter::Deviations);
    assert_eq!(with(Projection, &some), Err(SolveError::Impossible(vec![violation])));
    let few = Deviations { ring_space_um: vec![1.0; 28], ..Deviations::default() };
    let (parameter, detail) =
        (Parameter::DeviationList(Listed::RingSpace), "28 entries for 26 items: give one for each, or none");
    let violation = Violation::new(FieldCode::WrongLength, parameter, 28.0, 26.0, detail.into());
    assert_eq!(with(VirtualWork, &few), Err(SolveError::Impossible(vec![violation])));
    let mut odd = vec![0.0; 28];
    odd[3] = f64::INFINITY;
    let odd = Deviations { slot_wall_um: odd, ..Deviations::default() };
    let parameter = Parameter::Deviation(Listed::SlotWall, 3);
    let violation = Violation::out_of_range(parameter, f64::INFINITY, 1e6);
    assert_eq!(with(VirtualWork, &odd), Err(SolveError::Impossible(vec![violation])));
}
