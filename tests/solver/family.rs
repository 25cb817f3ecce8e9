//! All kinds of wave generators, with any number of lobes and installed teeth, against independent constructions:
//! supporting lines and circles, differences, swept circles, rational numbers.

use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::drawing::{Drawing, DrawingParameters, DrawnPart};
use toothwave_solver::drive::{Draft, DriveError};
use toothwave_solver::load_sharing::LoadedDrive;
use toothwave_solver::losses::{LoadedTooth, Mechanism};
use toothwave_solver::mesh::{Mesh, Samples, TeethInMesh};
use toothwave_solver::parts::PartsParameters;
use toothwave_solver::profile::{Extent, ProfileParameters, profiles};
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::{self, Points, Sweep};
use toothwave_solver::{
    ContactLaw, Drive, DriveParameters, FieldCode, FindingCode, LoadCase, Never, Parameter, Part, PerContact, Position,
    ToothShape, Violation, WaveGenerator, findings,
};

use crate::drives::{PAPER_5_1, cases, drive, ellipse, everywhere, load, swept};
use crate::oracles::{EQUAL, UNEQUAL, worst_difference};

/// With one lobe it is the eccentric circle.
const fn harmonic(lobes: i64, mean_radius_mm: f64, amplitude_mm: f64) -> WaveGenerator {
    match lobes {
        1 => eccentric(mean_radius_mm, amplitude_mm),
        _ => WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm },
    }
}

const fn harmonic_path(lobes: i64, mean_path_radius_mm: f64, amplitude_mm: f64) -> WaveGenerator {
    WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm, amplitude_mm }
}

const fn eccentric(radius_mm: f64, eccentricity_mm: f64) -> WaveGenerator {
    WaveGenerator::Eccentric { radius_mm, eccentricity_mm }
}

const fn of(
    wave_generator: WaveGenerator,
    teeth: i64,
    installed: i64,
    ring_teeth: i64,
    tooth_radius_mm: f64,
) -> DriveParameters {
    DriveParameters {
        wave_generator,
        teeth,
        installed,
        tooth_radius_mm,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth,
        tip_radius_mm: None,
    }
}

/// Returns drives of every kind: one to seven lobes, alike and unlike zones, regular and undercut, convex and hollow.
fn family() -> Vec<DriveParameters> {
    let bored = |parameters: DriveParameters, tip_radius_mm| DriveParameters {
        tip_radius_mm: Some(tip_radius_mm),
        ..parameters
    };
    vec![
        of(eccentric(30.8, 1.2), 20, 20, 21, 3.0),
        of(eccentric(30.8, 1.2), 21, 21, 20, 2.0),
        of(eccentric(20.0, 2.0), 16, 8, 15, 2.5),
        bored(of(eccentric(30.8, 1.2), 20, 20, 21, 3.0), 35.9),
        of(harmonic(2, 57.0, 1.0), 28, 28, 26, 5.0),
        of(harmonic(2, 57.0, 1.0), 27, 27, 25, 5.0),
        of(harmonic(2, 57.0, 1.0), 28, 7, 30, 5.0),
        of(harmonic(3, 48.0, 1.0), 30, 30, 27, 4.0),
        of(harmonic(3, 48.0, 1.0), 28, 28, 25, 4.0),
        of(harmonic(3, 48.0, 1.0), 32, 8, 29, 4.0),
        bored(of(harmonic(3, 48.0, 1.0), 28, 28, 25, 4.0), 55.8),
        of(harmonic(4, 60.0, 1.2), 36, 18, 40, 4.0),
        of(harmonic(4, 60.0, 1.2), 36, 9, 32, 4.0),
        of(harmonic(7, 90.0, 0.5), 70, 70, 63, 3.0),
        of(harmonic(7, 90.0, 0.5), 72, 24, 65, 3.0),
        of(harmonic_path(1, 34.0, 1.2), 20, 20, 19, 3.0),
        of(harmonic_path(2, 62.0, 1.0), 28, 28, 26, 5.0),
        of(harmonic_path(3, 52.0, 1.0), 30, 30, 27, 4.0),
        // Hollow: e > R/(U² + 1) = 5.2 mm.
        of(harmonic_path(3, 52.0, 5.5), 12, 12, 9, 6.0),
        of(harmonic_path(5, 70.0, 3.5), 20, 20, 15, 4.0),
        of(harmonic_path(5, 70.0, 3.5), 21, 21, 16, 4.0),
        bored(of(harmonic_path(3, 52.0, 1.0), 28, 14, 31, 4.0), 55.8),
        of(ellipse(58.0, 56.0), 27, 27, 25, 5.0),
        of(ellipse(58.0, 56.0), 30, 5, 28, 5.0),
    ]
}

/// Generates drives of the family that can be swept.
pub(crate) fn any_of_the_family() -> impl Strategy<Value = DriveParameters> {
    let numbers = (0_usize..4, 1_i64..8, 2_i64..40, 1_i64..4, 0.1_f64..0.8, 0.02_f64..0.9, any::<bool>());
    (numbers, prop::option::of(0.05_f64..1.0)).prop_filter_map(
        "an impossible drive",
        |((kind, lobes, installed, removal, thickness, stroke, more), bore)| {
            let lobes = if kind == 0 { 2 } else { lobes };
            let teeth = installed * removal;
            let sin = (PI / installed as f64).sin().min(0.5);
            let radius_mm = 40.0;
            let r = thickness * radius_mm * sin / (1.0 + sin);
            let e = (stroke * r).min(0.9 * radius_mm / (lobes * lobes) as f64);
            let wave_generator = match kind {
                0 => ellipse(radius_mm + e, radius_mm - e),
                1 => eccentric(radius_mm, e),
                2 => harmonic(lobes, radius_mm, e),
                _ => harmonic_path(lobes, radius_mm, e),
            };
            let lobes = wave_generator.lobes();
            let unbored = of(wave_generator, teeth, installed, if more { teeth + lobes } else { teeth - lobes }, r);
            let natural = Drive::new(&unbored).ok()?;
            let (tip_mm, root_mm) = (natural.ring_tooth().natural_tip_radius_mm, natural.root_radius_mm());
            let tip_radius_mm = bore.map(|share| tip_mm + 0.5 * share * (root_mm - tip_mm));
            let parameters = DriveParameters { tip_radius_mm, ..unbored };
            Mesh::new(&Drive::new(&parameters).ok()?).always_carries().then_some(parameters)
        },
    )
}

/// Returns the distance of a tooth's centre without the solver: by a supporting line, by the circle, or as given.
fn center_radius_mm(p: &DriveParameters, psi: f64) -> f64 {
    let r = p.tooth_radius_mm;
    let by_support = |support: &dyn Fn(f64) -> (f64, f64), lobes: i64| {
        let center = |phi: f64| {
            let (h, slope) = support(phi);
            let (sin, cos) = phi.sin_cos();
            Vector2::new((h + r) * cos - slope * sin, (h + r) * sin + slope * cos)
        };
        // The polar angle grows with the normal's. It stays within half a lobe of ψ, so no turn is lost.
        let (mut low, mut high) = (psi - 0.5 * PI / lobes as f64, psi + 2.0 * PI / lobes as f64);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            let c = center(middle);
            let beyond = (c.y.atan2(c.x) - psi + PI).rem_euclid(2.0 * PI) - PI;
            if beyond > 0.0 { high = middle } else { low = middle }
        }
        center(0.5 * (low + high)).norm()
    };
    match p.wave_generator {
        WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } => by_support(
            &|phi| {
                let h = (a * phi.cos()).hypot(b * phi.sin());
                (h, -(a * a - b * b) * phi.sin() * phi.cos() / h)
            },
            2,
        ),
        WaveGenerator::Eccentric { radius_mm, eccentricity_mm: e } => {
            // The far intersection of a ray from the axis with the circle of radius R0 + r around (e, 0).
            e * psi.cos() + ((radius_mm + r).powi(2) - (e * psi.sin()).powi(2)).sqrt()
        }
        WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm: e } => {
            let u = lobes as f64;
            by_support(&|phi| (mean_radius_mm + e * (u * phi).cos(), -e * u * (u * phi).sin()), lobes)
        }
        WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm, amplitude_mm } => {
            mean_path_radius_mm + amplitude_mm * (lobes as f64 * psi).cos()
        }
        other => panic!("no path of {other:?}"),
    }
}

#[test]
fn path_slope_and_curvature_match_differences() {
    for p in family() {
        let drive = drive(&p);
        let (locus, lobes) = (drive.flank().locus(), drive.lobes());
        let half_rad = PI / f64::from(lobes);
        for share in [0.03, 0.2, 0.45, 0.55, 0.8, 0.97] {
            let psi = share * half_rad;
            let tooth = locus.at(Position::from_lobe(psi, lobes)).unwrap();
            let d = center_radius_mm(&p, psi);
            assert!((tooth.center_radius_mm - d).abs() < 1e-13 * d, "{} is not {d} of {p:?}", tooth.center_radius_mm);
            let step = 3e-4 * half_rad;
            let around = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|at| center_radius_mm(&p, psi + at * step));
            let slope = (8.0 * (around[3] - around[1]) - (around[4] - around[0])) / (12.0 * step);
            let bend = (16.0 * (around[3] + around[1]) - (around[4] + around[0]) - 30.0 * d) / (12.0 * step * step);
            let t = -slope / d;
            assert!((tooth.tan_pressure_angle - t).abs() < 1e-9, "{} is not {t} of {p:?}", tooth.tan_pressure_angle);
            let t_psi = -bend / d + t * t;
            let scale = 1.0 + t_psi.abs();
            assert!((tooth.tan_pressure_angle_derivative - t_psi).abs() < 1e-5 * scale, "{t_psi} of {p:?}");
            // Curvature of the path in polar form, and of the cam as a parallel curve.
            let path = (d * d + 2.0 * slope * slope - d * bend) / (d * d + slope * slope).powf(1.5);
            let cam = path / (1.0 - p.tooth_radius_mm * path);
            let found = tooth.cam_curvature_per_mm;
            assert!((found - cam).abs() < 1e-4 * (1.0 / d + cam.abs()), "{found} is not {cam} of {p:?}");
            assert!((tooth.lever_arm_mm - d * (t / t.hypot(1.0))).abs() < 1e-8 * d);
            assert!((tooth.support_mm - (d / t.hypot(1.0) - p.tooth_radius_mm)).abs() < 1e-8 * d);
        }
    }
}

#[test]
fn position_is_accurate_near_lobe_and_valley() {
    // Near either end, lever arms are proportional to the distance from it and must keep their digits.
    for p in family() {
        let drive = drive(&p);
        let (locus, lobes) = (drive.flank().locus(), drive.lobes());
        let lever_mm = |position| locus.at(position).unwrap().lever_arm_mm;
        for at in [1e-5, 1e-9, 1e-13] {
            let ratio = lever_mm(Position::from_lobe(at, lobes)) / lever_mm(Position::from_lobe(0.5 * at, lobes));
            assert!((ratio - 2.0).abs() < 2e-9 * at / 1e-9 * at / 1e-9 + 1e-8 * f64::from(u8::from(at > 1e-6)) + 1e-13);
            let ratio = lever_mm(Position::from_valley(at, lobes)) / lever_mm(Position::from_valley(0.5 * at, lobes));
            assert!((ratio - 2.0).abs() < 1e-8 * f64::from(u8::from(at > 1e-6)) + 1e-13, "{ratio} at {at} of {p:?}");
        }
        assert_eq!(lever_mm(Position::lobe(lobes)), 0.0);
        assert_eq!(lever_mm(Position::valley(lobes)), 0.0);
    }
}

#[test]
fn steepest_place_matches_scan() {
    for p in family() {
        let drive = drive(&p);
        let (locus, lobes) = (drive.flank().locus(), drive.lobes());
        let steepest = locus.steepest().unwrap();
        let scanned = (1..2000)
            .map(|i| locus.at(Position::from_lobe(PI / f64::from(lobes) * f64::from(i) / 2000.0, lobes)).unwrap())
            .max_by(|one, other| one.tan_pressure_angle.total_cmp(&other.tan_pressure_angle))
            .unwrap();
        assert!(steepest.tan_pressure_angle >= scanned.tan_pressure_angle * (1.0 - 1e-15));
        assert!((steepest.tan_pressure_angle / scanned.tan_pressure_angle - 1.0).abs() < 1e-5);
        assert!((steepest.position.from_lobe_rad - scanned.position.from_lobe_rad).abs() < 2e-3);
        let again = locus.at(steepest.position).unwrap();
        assert!((again.tan_pressure_angle - steepest.tan_pressure_angle).abs() < 1e-14 * steepest.tan_pressure_angle);
        // e U/√(P0² - e²) and e U/√(R² - e²).
        let known = match p.wave_generator {
            WaveGenerator::Eccentric { radius_mm, eccentricity_mm } => (radius_mm + p.tooth_radius_mm, eccentricity_mm),
            WaveGenerator::Harmonic { mean_radius_mm, amplitude_mm, .. } => {
                (mean_radius_mm + p.tooth_radius_mm, amplitude_mm)
            }
            WaveGenerator::HarmonicPath { mean_path_radius_mm, amplitude_mm, .. } => {
                (mean_path_radius_mm, amplitude_mm)
            }
            _ => continue,
        };
        let known = known.1 * f64::from(lobes) / ((known.0 - known.1) * (known.0 + known.1)).sqrt();
        assert!((steepest.tan_pressure_angle - known).abs() < 1e-14 * known);
    }
}

/// Returns the farthest reach of any tooth in the direction `angle_rad` of the ring's frame, over a whole turn.
/// It scans and refines the ring's path `d(kθ)` without the solver.
fn farthest_swept_mm(p: &DriveParameters, angle_rad: f64) -> f64 {
    const SCAN: u32 = 600;
    let r = p.tooth_radius_mm;
    let k = p.ring_teeth as f64 / p.wave_generator.lobes() as f64;
    let reach = |theta: f64| {
        let d = center_radius_mm(p, k * theta);
        let off = angle_rad - theta;
        let beside = d * off.sin();
        if beside.abs() > r { 0.0 } else { d * off.cos() + (r * r - beside * beside).sqrt() }
    };
    let width = (r / (center_radius_mm(p, PI / p.wave_generator.lobes() as f64))).asin();
    let step = 2.0 * width / f64::from(SCAN);
    let places = (0..=SCAN).map(|i| angle_rad - width + f64::from(i) * step);
    let best = places.max_by(|x, y| reach(*x).total_cmp(&reach(*y))).unwrap();
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (best - step, best + step);
    for _ in 0..70 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if reach(left) > reach(right) { high = right } else { low = left }
    }
    reach(0.5 * (low + high))
}

#[test]
fn ring_is_boundary_of_swept_circles() {
    for p in family() {
        let drive = drive(&p);
        let flank = drive.flank();
        let end = drive.flank_limit().position;
        for share in [0.02, 0.2, 0.4, 0.6, 0.8, 0.9, 0.97, 1.0] {
            let position =
                if share < 1.0 { Position::from_lobe(share * end.from_lobe_rad, drive.lobes()) } else { end };
            let tooth = flank.locus().at(position).unwrap();
            let point = flank.at(&tooth);
            let swept_mm = farthest_swept_mm(&p, flank.angle_from_space_rad(&tooth, &point));
            let flank_mm = flank.radius_mm(&tooth, &point);
            assert!((swept_mm - flank_mm).abs() < 1e-9 * flank_mm, "{swept_mm} is not {flank_mm} at {share} of {p:?}");
        }
        let tip_mm = farthest_swept_mm(&p, PI / p.ring_teeth as f64);
        assert!((tip_mm - drive.ring_tooth().natural_tip_radius_mm).abs() < 1e-9 * tip_mm, "{tip_mm} of {p:?}");
        match drive.flank_limit().end {
            FlankEnd::Bore => {
                let tooth = flank.locus().at(end).unwrap();
                let end_mm = flank.radius_mm(&tooth, &flank.at(&tooth));
                assert!((end_mm - drive.tip_radius_mm()).abs() < 1e-13 * end_mm, "{end_mm} of {p:?}");
            }
            FlankEnd::RegularTip | FlankEnd::Undercut => {
                assert_eq!(drive.tip_radius_mm(), drive.ring_tooth().natural_tip_radius_mm)
            }
        }
    }
}

#[test]
fn critical_radius_separates_undercut_from_regular_tips() {
    let mut tried = 0;
    for p in family() {
        let unbored = DriveParameters { tip_radius_mm: None, ..p };
        let Some(critical_mm) = drive(&unbored).flank().critical_tooth_radius_mm() else { continue };
        let valley_rad = PI / p.wave_generator.lobes() as f64;
        // Reach of the union on the tip's line beyond the tooth in the valley.
        let beyond_mm = |factor: f64| {
            let thicker = DriveParameters { tooth_radius_mm: critical_mm * factor, ..unbored };
            let regular_mm = center_radius_mm(&thicker, valley_rad) + thicker.tooth_radius_mm;
            (farthest_swept_mm(&thicker, PI / p.ring_teeth as f64) - regular_mm) / regular_mm
        };
        let (thinner, thicker) = (beyond_mm(1.0 - 1e-3), beyond_mm(1.0 + 1e-3));
        assert!(thinner < 2e-14, "{thinner:e} of {p:?}");
        assert!(thicker > 2e-12, "{thicker:e} of {p:?}");
        for (factor, end) in [(1.0 - 1e-9, FlankEnd::RegularTip), (1.0 + 1e-9, FlankEnd::Undercut)] {
            let beside = DriveParameters { tooth_radius_mm: critical_mm * factor, installed: 2, ..unbored };
            if let Ok(drive) = Drive::new(&beside) {
                assert_eq!(drive.flank_limit().end, end, "{beside:?}");
                tried += 1;
            }
        }
    }
    assert!(tried > 10, "{tried}");
}

/// Theory 2.9. An undercut drive has a root below its own radius.
#[test]
fn harmonic_critical_radius_is_lower_quadratic_root() {
    let mut undercut = 0;
    for (lobes, teeth, radius_mm, e) in [(1, 40, 57.0, 1.0), (2, 80, 57.0, 1.0), (3, 36, 48.0, 1.0), (4, 48, 60.0, 1.2)]
    {
        let p = of(harmonic(lobes, radius_mm, e), teeth, 2, teeth - lobes, 1.5);
        let ring_teeth = (teeth - lobes) as f64;
        let (a, b) = (radius_mm - e, radius_mm + e * (lobes * lobes - 1) as f64);
        let linear = a + 2.0 * b - e * ring_teeth * ring_teeth;
        let critical_mm = drive(&p).flank().critical_tooth_radius_mm();
        assert_eq!(critical_mm.is_some(), linear <= -(8.0 * a * b).sqrt(), "{p:?}");
        let Some(r) = critical_mm else { continue };
        assert!((2.0 * r * r + linear * r + a * b).abs() < 1e-12 * a * b, "{r} of {p:?}");
        assert!(4.0 * r < -linear, "{r} is the upper root of {p:?}");
        undercut += 1;
    }
    assert!(undercut > 1, "{undercut}");
}

/// The position keeps as many digits as the bore's distance from tip or root has.
#[test]
fn harmonic_bore_is_accurate_near_tip_and_root() {
    for (lobes, teeth) in [(1, 30), (2, 28), (3, 36), (5, 50)] {
        let drive = drive(&of(harmonic(lobes, 57.0, 1.0), teeth, 2, teeth - lobes, 2.5));
        let flank = drive.flank();
        let half_lobe_rad = PI / lobes as f64;
        for share in [1e-3, 0.01, 0.1, 0.4, 0.6, 0.9, 0.99, 0.999] {
            let position = Position::from_lobe(share * half_lobe_rad, drive.lobes());
            let tooth = flank.locus().at(position).unwrap();
            let found = flank.position_at_radius(flank.radius_mm(&tooth, &flank.at(&tooth))).unwrap();
            assert!((found.from_lobe_rad / position.from_lobe_rad - 1.0).abs() < 1e-5, "{lobes}, {share}");
            assert!((found.from_valley_rad / position.from_valley_rad - 1.0).abs() < 1e-5, "{lobes}, {share}");
        }
    }
}

#[test]
fn two_lobe_harmonic_cam_approaches_ellipse_quadratically() {
    let difference_mm = |e: f64| {
        let (one, other) =
            (of(harmonic(2, 57.0, e), 28, 28, 26, 5.0), of(ellipse(57.0 + e, 57.0 - e), 28, 28, 26, 5.0));
        let (one, other) = (drive(&one), drive(&other));
        let at = |drive: &Drive, psi| drive.flank().locus().at(Position::from_lobe(psi, 2)).unwrap().center_radius_mm;
        (1..90)
            .map(|degree| f64::from(degree).to_radians())
            .map(|psi| (at(&one, psi) - at(&other, psi)).abs())
            .fold(0.0, f64::max)
    };
    let (large, small) = (difference_mm(0.5), difference_mm(0.25));
    assert!((large / small - 4.0).abs() < 0.1, "{large} {small}");
    assert!(large < 0.5 * 0.5 / 57.0 * 2.0, "{large}");
}

#[test]
fn small_stroke_makes_every_kind_a_circle() {
    let e = 1e-6;
    for (wave_generator, teeth, radius_mm) in [
        (eccentric(40.0, e), 21, 43.0),
        (harmonic(2, 40.0, e), 22, 43.0),
        (harmonic(5, 40.0, e), 25, 43.0),
        (harmonic_path(3, 43.0, e), 23, 43.0),
        (ellipse(40.0 + e, 40.0 - e), 22, 43.0),
    ] {
        let lobes = wave_generator.lobes();
        let drive = drive(&of(wave_generator, teeth, teeth, 20, 3.0));
        let k = 20.0 / lobes as f64;
        for share in [0.1, 0.5, 0.9] {
            let psi = share * PI / lobes as f64;
            let tooth = drive.flank().locus().at(Position::from_lobe(psi, drive.lobes())).unwrap();
            let u = lobes as f64;
            assert!(
                (tooth.center_radius_mm - radius_mm - e * (u * psi).cos()).abs() < 1e-13 * radius_mm + 30.0 * e * e
            );
            let t = e * u * (u * psi).sin() / radius_mm;
            assert!((tooth.tan_pressure_angle - t).abs() < 1e-5 * t, "{wave_generator:?}");
            assert!((drive.flank().at(&tooth).tan_pressure_angle / tooth.tan_pressure_angle - k).abs() < 1e-12 * k);
        }
        let sweep = sweep::sweep(&drive, &case(VirtualWork), Points::samples(10).unwrap(), &Never).unwrap();
        assert!(sweep.torque_balance_residual < 1e-13, "{:e} of {wave_generator:?}", sweep.torque_balance_residual);
    }
}

fn case(compatibility: toothwave_solver::Compatibility) -> LoadCase {
    LoadCase::new(&load(7.0, compatibility)).unwrap()
}

/// Returns slot and lobe of the teeth in mesh at a sample, by fractions of a turn in whole numbers.
fn in_mesh_by_fractions(installed: i64, lobes: i64, sample: i64, samples: i64, reach: (i64, i64)) -> Vec<(u64, u32)> {
    let mut found = Vec::new();
    for slot in 0..installed {
        for lobe in 0..lobes {
            // slot/Z' - n/(N Z') - u/U in turns, over the common denominator; whole turns do not matter.
            let denominator = samples * installed * lobes;
            let numerator = (slot * samples - sample) * lobes - lobe * samples * installed;
            let behind = (denominator - 1) / 2;
            let turned = (numerator.rem_euclid(denominator) + behind) % denominator - behind;
            // 0 < ψ ≤ reach.
            if turned > 0 && turned * reach.1 <= reach.0 * denominator {
                found.push((slot.unsigned_abs(), u32::try_from(lobe).unwrap()));
            }
        }
    }
    found
}

#[test]
fn teeth_in_mesh_match_exact_fractions() {
    for (lobes, teeth, installed) in [
        (1, 20, 20),
        (1, 21, 7),
        (2, 27, 27),
        (2, 27, 9),
        (3, 28, 28),
        (3, 32, 8),
        (3, 20, 5),
        (4, 36, 18),
        (4, 36, 9),
        (6, 40, 10),
        (7, 72, 24),
    ] {
        let p = of(harmonic(lobes, 100.0, 0.3), teeth, installed, teeth + lobes, 3.0);
        let mesh = Mesh::new(&drive(&p));
        assert_eq!(mesh.flank_limit().end, FlankEnd::RegularTip);
        let listed_lobes = if mesh.zones_are_alike() { 1 } else { lobes };
        for count in [1, 2, 5, 12, 13] {
            let samples = Samples::new(count).unwrap();
            let mut states = 0;
            let mut counts = Vec::new();
            for sample in 0..=count {
                let placed: Vec<_> = mesh.placed_at(sample, samples).collect();
                let (n, of) = (i64::try_from(sample).unwrap(), i64::try_from(count).unwrap());
                let mut expected = in_mesh_by_fractions(installed, lobes, n, of, (1, 2 * lobes));
                expected.retain(|&(_, lobe)| i64::from(lobe) < listed_lobes);
                let found: Vec<_> =
                    placed.iter().map(|placed| (placed.number % installed.unsigned_abs(), placed.lobe)).collect();
                assert_eq!(found, expected, "{sample} of {count}, {p:?}");
                for placed in &placed {
                    let turns = (placed.number as f64 - sample as f64 / count as f64) / installed as f64
                        - f64::from(placed.lobe) / lobes as f64;
                    // The valley is half a lobe ahead, not behind.
                    let psi = 2.0 * PI * (turns - (turns - 1e-12).round());
                    assert!((placed.position.from_lobe_rad - psi).abs() < 1e-14);
                    assert!((placed.position_deg - psi.to_degrees()).abs() < 1e-12);
                }
                states += placed.len() as u64;
                counts.push(placed.len() as u64);
            }
            assert_eq!(states, mesh.state_count(samples), "{count} of {p:?}");
            let TeethInMesh { min, max } = mesh.teeth_in_mesh();
            assert!(counts.iter().all(|count| (min..=max).contains(count)), "{counts:?} {min} {max} of {p:?}");
            if count == 12 {
                assert!(counts.contains(&min) && counts.contains(&max), "{counts:?} {min} {max} of {p:?}");
            }
        }
    }
}

#[test]
fn shortened_flank_counts_the_teeth_on_it() {
    for p in family() {
        let drive = drive(&p);
        let mesh = Mesh::new(&drive);
        let (installed, lobes) = (p.installed, p.wave_generator.lobes());
        if drive.flank_limit().end == FlankEnd::RegularTip {
            continue;
        }
        let engaged = drive.flank_limit().position.from_lobe_rad / (2.0 * PI);
        let mut states = 0;
        for sample in 0..=7 {
            let found = mesh.placed_at(sample, Samples::new(7).unwrap()).count();
            let listed_lobes = if mesh.zones_are_alike() { 1 } else { lobes };
            let expected = (0..installed)
                .flat_map(|slot| (0..listed_lobes).map(move |lobe| (slot, lobe)))
                .filter(|&(slot, lobe)| {
                    let turns = (slot as f64 - sample as f64 / 7.0) / installed as f64 - lobe as f64 / lobes as f64;
                    let turns = turns - turns.round();
                    turns > 1e-12 && turns <= engaged
                })
                .count();
            assert_eq!(found, expected, "{sample} of {p:?}");
            states += found as u64;
        }
        assert_eq!(states, mesh.state_count(Samples::new(7).unwrap()));
        let degree = lobes as f64 * engaged * installed as f64;
        assert!((mesh.coincidence_degree() - degree).abs() < 1e-12 * degree);
    }
}

#[test]
fn always_carries_matches_brute_force() {
    let mut refused = 0;
    for lobes in 1..=6 {
        for installed in 2..30 {
            let p = of(harmonic(lobes, 100.0, 0.3), installed, installed, installed + lobes, 3.0);
            let Ok(drive) = Drive::new(&p) else { continue };
            let mesh = Mesh::new(&drive);
            // Brute force over many moments, none of them an entry: is there a moment without a tooth with a lever arm?
            let carries = (0..840).all(|sample| {
                (0..installed).any(|slot| {
                    let place = (slot * 840 - sample) * lobes;
                    let turn = 840 * installed;
                    let from_lobe = (place.rem_euclid(turn) + turn / 2 - 1) % turn - turn / 2 + 1;
                    // In the valley there is no lever arm.
                    from_lobe > 0 && 2 * from_lobe < turn
                })
            });
            assert_eq!(mesh.always_carries(), carries, "{lobes} lobes, {installed} teeth");
            refused += usize::from(!carries);
        }
    }
    assert!(refused > 10, "{refused}");
}

proptest! {
    #![proptest_config(cases(192))]

    #[test]
    fn loads_of_every_kind_match_dense_solves(parameters in any_of_the_family()) {
        prop_assert!(worst_difference(&parameters, Projection, EQUAL) < 1e-9);
        prop_assert!(worst_difference(&parameters, VirtualWork, UNEQUAL) < 1e-9);
    }

    #[test]
    fn torques_of_every_kind_balance_and_periods_close(parameters in any_of_the_family(), samples in 1_u64..20) {
        let sweep = swept(&parameters, &load(7.0, VirtualWork), samples);
        prop_assert!(sweep.torque_balance_residual < 1e-12, "{:e}", sweep.torque_balance_residual);
        prop_assert!(sweep.period_closure_residual < 1e-11, "{:e}", sweep.period_closure_residual);
        let is_one_zone = Mesh::new(&drive(&parameters)).zones_are_alike();
        prop_assert_eq!(sweep.states.lobe.len(), if is_one_zone { 0 } else { sweep.states.len() });
        for (_, column) in sweep.states.force_n.iter().chain(sweep.states.stress_mpa.iter()) {
            prop_assert!(column.iter().all(|value| *value >= 0.0 && value.is_finite()));
        }
    }

    #[test]
    fn tolerance_sweep_matches_many_samples(parameters in any_of_the_family()) {
        let drive = drive(&parameters);
        let to_tolerance = Points::tolerance(1e-4, 1_000_000).unwrap();
        let adaptive = sweep::sweep(&drive, &case(VirtualWork), to_tolerance, &Never).unwrap();
        let dense = sweep::sweep(&drive, &case(VirtualWork), Points::samples(600).unwrap(), &Never).unwrap();
        prop_assert!(adaptive.torque_balance_residual < 1e-11, "{:e}", adaptive.torque_balance_residual);
        prop_assert!(adaptive.period_closure_residual < 1e-9, "{:e}", adaptive.period_closure_residual);
        for (contact, peaks) in adaptive.peaks.iter() {
            let dense = dense.peaks.get(contact);
            prop_assert!(peaks.force_n.value >= dense.force_n.value * (1.0 - 1e-4), "{:?}", contact);
            prop_assert!(peaks.stress_mpa.value >= dense.stress_mpa.value * (1.0 - 1e-4), "{:?}", contact);
            // Between samples values are hardly larger, except where a tooth is alone just off the lobe.
            let is_steady = Mesh::new(&drive).engaged_spacings() > 2.5;
            prop_assert!(!is_steady || peaks.force_n.value <= dense.force_n.value * 1.1, "{:?}", contact);
        }
    }

    #[test]
    fn wave_generator_outline_is_inner_offset_of_path(parameters in any_of_the_family(), place in 0.0_f64..1.0) {
        let drive = drive(&parameters);
        let request = ProfileParameters { chord_tolerance_mm: 1e-3, extent: Extent::Full, max_points: 1_000_000 };
        let outline = profiles(&drive, &request, &Never).unwrap().wave_generator;
        prop_assert_eq!(outline.first(), outline.last());
        prop_assert!(outline.windows(2).all(|pair| pair[0] != pair[1]));
        // Once around, counter-clockwise, and nowhere beyond its largest and least radius.
        let turned: f64 = outline.windows(2).map(|pair| pair[0].coords.angle(&pair[1].coords)).sum();
        prop_assert!((turned - 2.0 * PI).abs() < 1e-9, "{}", turned);
        let locus = drive.flank().locus();
        for point in &outline {
            let radius_mm = point.coords.norm();
            prop_assert!(radius_mm < locus.cam_outer_radius_mm() * (1.0 + 1e-12));
            prop_assert!(radius_mm > locus.cam_inner_radius_mm() * (1.0 - 1e-12));
        }
        // Every point keeps a radius from every tooth's centre, and some touch it.
        let psi = 2.0 * PI * place;
        let d = center_radius_mm(&parameters, psi);
        let center = Point2::new(d * psi.cos(), d * psi.sin());
        let nearest = outline.windows(2).map(|pair| {
            let along = pair[1] - pair[0];
            let share = ((center - pair[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (center - (pair[0] + along * share)).norm()
        }).fold(f64::INFINITY, f64::min);
        let r = parameters.tooth_radius_mm;
        prop_assert!((nearest - r).abs() < 1.1e-3, "{} is not {}", nearest, r);
    }
}

fn forces(p: &DriveParameters, sample: u64, samples: u64) -> (Vector2<f64>, f64, f64) {
    let drive = drive(p);
    let load = case(VirtualWork);
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let mesh = Mesh::new(&drive);
    let placed: Vec<_> = mesh.placed_at(sample, Samples::new(samples).unwrap()).collect();
    let teeth: Vec<_> = placed.iter().map(|placed| loaded.tooth(placed.position).unwrap()).collect();
    let wind_up = loaded.wind_up(&teeth).unwrap();
    let loads: Vec<_> = placed
        .iter()
        .zip(&teeth)
        .map(|(placed, tooth)| LoadedTooth {
            lobe: placed.lobe,
            center: tooth.center,
            flank: tooth.flank,
            is_at_corner: false,
            force_n: loaded.forces_n(tooth, &wind_up).unwrap(),
        })
        .collect();
    let sum_n = loads.iter().map(|tooth| tooth.force_n.wave_generator).sum();
    (Mechanism::of(&drive).radial_force_n(&loads), sum_n, loaded.input_torque_nmm())
}

/// Returns the sum of the forces at the cam along the lines from the circle's centre to the teeth's centres.
fn along_normals_n(p: &DriveParameters, sample: u64, samples: u64, circle: Vector2<f64>) -> Vector2<f64> {
    let states = swept(p, &load(7.0, VirtualWork), samples).states;
    let angle_deg = Mesh::new(&drive(p)).input_angle_deg(sample, Samples::new(samples).unwrap());
    (0..states.len()).filter(|&i| states.input_angle_deg[i] == angle_deg).fold(Vector2::zeros(), |sum, i| {
        let psi = states.position_deg[i].to_radians();
        let center = center_radius_mm(p, psi) * Vector2::new(psi.cos(), psi.sin());
        sum + states.force_n.wave_generator[i] * (center - circle).normalize()
    })
}

#[test]
fn eccentric_radial_force_is_torque_over_eccentricity() {
    for p in [of(eccentric(30.8, 1.2), 20, 20, 21, 3.0), of(eccentric(20.0, 2.0), 16, 8, 15, 2.5)] {
        for sample in 0..5 {
            let (force_n, sum_n, torque_nmm) = forces(&p, sample, 5);
            let WaveGenerator::Eccentric { eccentricity_mm, .. } = p.wave_generator else { panic!("{p:?}") };
            let across_n = -torque_nmm / eccentricity_mm;
            assert!((force_n.y - across_n).abs() < 1e-12 * across_n.abs(), "{} is not {across_n}", force_n.y);
            // All normals meet at the circle's centre.
            let pushed_n = along_normals_n(&p, sample, 5, Vector2::new(eccentricity_mm, 0.0));
            assert!((force_n + pushed_n).norm() < 1e-11 * sum_n, "{force_n} is not {}", -pushed_n);
        }
    }
}

#[test]
fn only_unequally_loaded_lobes_have_radial_force() {
    for p in [of(harmonic(4, 60.0, 1.2), 36, 18, 40, 4.0), of(harmonic(3, 48.0, 1.0), 30, 30, 27, 4.0), PAPER_5_1] {
        assert_eq!(forces(&p, 1, 5).0, Vector2::zeros());
    }
    // The sum over all lobes, calculated and not assumed: two of the four lobes are alike.
    let p = of(harmonic(4, 60.0, 1.2), 36, 18, 40, 4.0);
    let drive = drive(&p);
    let mesh = Mesh::new(&drive);
    let by_lobe = mesh.placed_at(2, Samples::new(5).unwrap()).fold([0_usize; 4], |mut count, placed| {
        count[placed.lobe as usize] += 1;
        count
    });
    assert_eq!((by_lobe[0], by_lobe[1]), (by_lobe[2], by_lobe[3]));
    for p in [of(ellipse(58.0, 56.0), 27, 27, 25, 5.0), of(harmonic(3, 48.0, 1.0), 28, 28, 25, 4.0)] {
        let (force_n, sum_n, _) = forces(&p, 1, 5);
        assert!(force_n.norm() > 1e-4 * sum_n && force_n.norm() < 0.05 * sum_n, "{force_n} of {sum_n}");
    }
    let (force_n, sum_n, _) = forces(&of(harmonic(4, 60.0, 1.2), 36, 9, 32, 4.0), 1, 5);
    assert!(force_n.norm() > 0.1 * sum_n, "{force_n} of {sum_n}");
}

fn violations(p: &DriveParameters) -> Vec<Violation> {
    match Drive::new(p) {
        Err(DriveError::Impossible(violations)) => violations,
        other => panic!("{other:?}"),
    }
}

/// On a given path, every centre keeps the tooth's radius from the whole cam, or the cam is refused.
#[test]
fn flanks_of_lobe_do_not_meet() {
    let mut are_hollow = 0;
    for lobes in [2, 3, 4, 7, 12] {
        for tooth_radius_mm in [0.1, 0.3, 0.6, 1.2] {
            let of_radius = |radius_mm: f64| {
                let p = of(harmonic_path(lobes, radius_mm, 10.0), 4 * lobes, 2, 3 * lobes, tooth_radius_mm);
                let found = violations(&p).into_iter().find(|violation| violation.code == FieldCode::CamTooSmall);
                (p, found.and_then(|violation| violation.limit))
            };
            let (_, least_mm) = of_radius(1e-3);
            let least_mm = least_mm.unwrap();
            let is_by_flanks = least_mm > 1.001 * least_radius_mm(lobes, tooth_radius_mm);
            are_hollow += i32::from(is_by_flanks);
            // A lobe that is barely too sharp loses almost nothing.
            let by = if is_by_flanks { 1e-3 } else { 2e-2 };
            for share in [1.0 - by, 1.0 + by] {
                let (p, found) = of_radius(least_mm * share);
                assert_eq!(found.is_some(), share < 1.0);
                let half_rad = PI / lobes as f64;
                let center = |psi: f64| {
                    let d = center_radius_mm(&p, psi);
                    (d * psi.cos(), d * psi.sin())
                };
                let centers: Vec<_> = (-20_000..20_000).map(|i| center(half_rad * f64::from(i) / 20_000.0)).collect();
                // Fine steps in the valley, where large strokes have sharp curves.
                let nearest_mm = (0..150)
                    .map(|i| {
                        let psi = half_rad * (1.0 - 0.93_f64.powi(i));
                        let ((x, y), step) = (center(psi), 1e-7);
                        let ((x1, y1), (x2, y2)) = (center(psi - step), center(psi + step));
                        let along = (x2 - x1).hypot(y2 - y1);
                        let foot = (x - tooth_radius_mm * (y2 - y1) / along, y + tooth_radius_mm * (x2 - x1) / along);
                        centers.iter().map(|(x, y)| (x - foot.0).hypot(y - foot.1)).fold(f64::INFINITY, f64::min)
                    })
                    .fold(f64::INFINITY, f64::min);
                let is_free = nearest_mm > tooth_radius_mm * (1.0 - 2e-5);
                assert_eq!(is_free, found.is_none(), "{lobes}, {tooth_radius_mm}, {share}: {nearest_mm} of {p:?}");
            }
        }
    }
    assert!(are_hollow > 3, "{are_hollow} whose flanks meet before anything else is wrong");
}

/// Returns the least radius from the conditions at lobe and valley, for an amplitude of 10 mm.
fn least_radius_mm(lobes: i64, r: f64) -> f64 {
    let u = lobes as f64;
    (r + 10.0).max(0.5 * (r + (r * (r + 40.0 * u * u)).sqrt()) - 10.0)
}

#[test]
fn too_small_cam_is_refused_with_least_size() {
    for (wave_generator, parameter) in [
        (eccentric(1.0, 1.2), Parameter::EccentricRadius),
        (harmonic(3, 8.0, 1.0), Parameter::MeanRadius),
        (harmonic(7, 47.0, 1.0), Parameter::MeanRadius),
        (harmonic_path(1, 2.0, 1.0), Parameter::MeanPathRadius),
        (harmonic_path(3, 5.5, 1.0), Parameter::MeanPathRadius),
        (harmonic_path(7, 12.0, 1.0), Parameter::MeanPathRadius),
    ] {
        let lobes = wave_generator.lobes();
        let p = of(wave_generator, 4 * lobes, 2, 3 * lobes, 3.0);
        let found = violations(&p);
        let too_small = found.iter().find(|violation| violation.code == FieldCode::CamTooSmall);
        let too_small = too_small.unwrap_or_else(|| panic!("{found:?}"));
        assert_eq!(too_small.parameter, parameter);
        let least_mm = too_small.limit.unwrap();
        let of_radius = |radius_mm: f64| match p.wave_generator {
            WaveGenerator::Harmonic { lobes, amplitude_mm, .. } => harmonic(lobes, radius_mm, amplitude_mm),
            WaveGenerator::HarmonicPath { lobes, amplitude_mm, .. } => harmonic_path(lobes, radius_mm, amplitude_mm),
            WaveGenerator::Eccentric { eccentricity_mm, .. } => eccentric(radius_mm, eccentricity_mm),
            other => panic!("{other:?}"),
        };
        let is_too_small = |wave_generator| match Drive::new(&DriveParameters { wave_generator, ..p }) {
            Err(DriveError::Impossible(found)) => found.iter().any(|v| v.code == FieldCode::CamTooSmall),
            Err(error) => panic!("{error}"),
            Ok(_) => false,
        };
        if let WaveGenerator::Harmonic { amplitude_mm: e, .. } | WaveGenerator::Eccentric { eccentricity_mm: e, .. } =
            p.wave_generator
        {
            assert_eq!(least_mm, e * ((lobes * lobes - 1) as f64).max(1.0));
        }
        assert!(is_too_small(of_radius(least_mm)));
        assert!(!is_too_small(of_radius(least_mm * (1.0 + 1e-12))), "{least_mm} of {p:?}");
        // Just above the limit the cam is convex at its sharpest point, or its valley touches the axis. Just below,
        // a cusp is inverted.
        let sharpest = |radius_mm: f64| {
            let p = DriveParameters { wave_generator: of_radius(radius_mm), ..p };
            (0..=400)
                .map(|i| {
                    let psi = PI / lobes as f64 * f64::from(i) / 400.0;
                    let at = |off: f64| center_radius_mm(&p, psi + off * 1e-4);
                    let (slope, bend) = ((at(1.0) - at(-1.0)) / 2e-4, (at(1.0) - 2.0 * at(0.0) + at(-1.0)) / 1e-8);
                    let d = at(0.0);
                    let path = (d * d + 2.0 * slope * slope - d * bend) / (d * d + slope * slope).powf(1.5);
                    (1.0 - 3.0 * path).min(d - 3.0)
                })
                .fold(f64::INFINITY, f64::min)
        };
        if matches!(p.wave_generator, WaveGenerator::HarmonicPath { .. }) {
            assert!(sharpest(least_mm * 1.01) > 0.0, "{p:?}");
            assert!(sharpest(least_mm * 0.99) < 0.0, "{p:?}");
        }
    }
}

#[test]
fn tooth_counts_differ_by_one_per_lobe() {
    for lobes in 1..=7 {
        let beside = |ring_teeth| of(harmonic(lobes, 100.0, 0.3), 30, 30, ring_teeth, 2.0);
        for ring_teeth in 20_i64..40 {
            let differs = (30 - ring_teeth).abs() == lobes;
            assert_eq!(Drive::new(&beside(ring_teeth)).is_ok(), differs, "{ring_teeth} with {lobes} lobes");
        }
        assert_ring_has(&violations(&beside(30))[0], &format!("{} or {}", 30 - lobes, 30 + lobes));
    }
    // A ring needs at least one tooth for each lobe.
    assert_ring_has(&violations(&of(harmonic(3, 100.0, 0.3), 5, 5, 2, 2.0))[0], "8");
}

/// Checks that a violation proposes these numbers of ring teeth.
fn assert_ring_has(violation: &Violation, teeth: &str) {
    assert_eq!(violation.code, FieldCode::ToothDifference);
    assert!(violation.to_string().contains(&format!("the ring has {teeth}, not ")), "{violation}: not {teeth}");
}

#[test]
fn carrier_fits_if_stroke_is_below_tooth_radius() {
    for wave_generator in [eccentric(40.0, 1.0), harmonic(3, 40.0, 1.0), harmonic_path(3, 43.0, 1.0)] {
        let lobes = wave_generator.lobes();
        // Few ring teeth keep the tip regular.
        let of_radius = |tooth_radius_mm| of(wave_generator, 3 * lobes, 3 * lobes, 2 * lobes, tooth_radius_mm);
        assert!(Drive::new(&of_radius(1.001)).is_ok());
        let found = violations(&of_radius(0.999));
        let [Violation { code: FieldCode::NoCarrierAnnulus, value: Some(1.0), limit: Some(0.999), .. }] = found[..]
        else {
            panic!("{found:?}")
        };
    }
}

#[test]
fn neighbouring_teeth_of_every_kind_must_not_touch() {
    for wave_generator in
        [eccentric(40.0, 1.2), harmonic(3, 40.0, 1.2), harmonic(5, 40.0, 0.5), harmonic_path(3, 43.0, 1.2)]
    {
        let teeth = 10 * wave_generator.lobes();
        let of_radius =
            |tooth_radius_mm| of(wave_generator, teeth, teeth, teeth - wave_generator.lobes(), tooth_radius_mm);
        let touching = violations(&of_radius(30.0));
        let limit_mm = touching.iter().find(|violation| violation.code == FieldCode::TeethTouch);
        let limit_mm = limit_mm.and_then(|violation| violation.limit).unwrap_or_else(|| panic!("{touching:?}"));
        // Least distance of two neighbouring centres, by a fine scan without the solver.
        let gap_mm = |r: f64| {
            let p = of_radius(r);
            let spacing = 2.0 * PI / teeth as f64;
            let distance = |psi: f64| {
                let (one, other) = (center_radius_mm(&p, psi), center_radius_mm(&p, psi + spacing));
                (one * one + other * other - 2.0 * one * other * spacing.cos()).sqrt()
            };
            (0..4000).map(|i| distance(2.0 * PI * f64::from(i) / 4000.0)).fold(f64::INFINITY, f64::min) - 2.0 * r
        };
        assert!(gap_mm(limit_mm * (1.0 - 1e-5)) > 0.0, "{limit_mm} of {wave_generator:?}");
        assert!(gap_mm(limit_mm * (1.0 + 1e-5)) < 0.0, "{limit_mm} of {wave_generator:?}");
    }
}

#[test]
fn hollow_wave_generator_runs_but_is_a_finding() {
    let path = |amplitude_mm| of(harmonic_path(3, 52.0, amplitude_mm), 12, 12, 9, 6.0);
    let is_told = |p: &DriveParameters| {
        let found = findings::of_drive(&drive(p)).unwrap();
        found.iter().any(|finding| finding.code == FindingCode::HollowWaveGenerator)
    };
    // At R/(U² + 1) the valley is straight, which is not hollow yet.
    assert!(is_told(&path(5.21)) && !is_told(&path(5.2)) && !is_told(&path(5.19)));
    let valley = |p: &DriveParameters| drive(p).flank().locus().at(Position::valley(3)).unwrap().cam_curvature_per_mm;
    assert!(valley(&path(5.21)) < 0.0 && valley(&path(5.19)) > 0.0);
    let sweep = swept(&path(5.5), &load(20.0, VirtualWork), 20);
    assert!(sweep.torque_balance_residual < 1e-13);
}

#[test]
fn alternating_zones_need_only_one_tooth_each() {
    // Four teeth on three lobes: each place is a third of a lobe.
    let p = of(harmonic(3, 48.0, 1.0), 28, 4, 25, 4.0);
    let mesh = Mesh::new(&drive(&p));
    assert!(!mesh.zones_are_alike() && mesh.always_carries());
    assert_eq!(mesh.teeth_in_mesh(), TeethInMesh { min: 2, max: 2 });
    let sweep: Sweep = swept(&p, &load(5.0, VirtualWork), 30);
    assert!(sweep.torque_balance_residual < 1e-13 && sweep.period_closure_residual < 1e-13);
    // Three teeth on three lobes are alike. Each is alone in its zone and has no lever arm at some angles.
    let p = of(harmonic(3, 48.0, 1.0), 30, 3, 27, 4.0);
    assert!(!Mesh::new(&drive(&p)).always_carries());
}

#[test]
fn clearances_and_power_laws_balance_all_zones() {
    for p in family() {
        let mut load = load(7.0, VirtualWork);
        load.law = ContactLaw::Palmgren;
        load.clearance_um = PerContact { wave_generator: 2.0, ring: 3.0, carrier: 1.0 };
        load.allowable_stress_mpa = Some(everywhere(1500.0));
        let sweep = swept(&p, &load, 12);
        assert!(sweep.torque_balance_residual < 1e-11, "{:e} of {p:?}", sweep.torque_balance_residual);
        assert!(sweep.torque_capacity.is_some());
    }
}

#[test]
fn grooves_exceed_balls_and_flats_are_short() {
    let ball = |radius| ToothShape::Ball {
        groove_radius_mm: PerContact { wave_generator: Some(radius), ring: None, carrier: Some(5.2) },
    };
    let with = |tooth| DriveParameters { tooth, ..PAPER_5_1 };
    assert!(Drive::new(&with(ball(5.001))).is_ok());
    let found = violations(&with(ball(5.0)));
    let [Violation { code: FieldCode::GrooveTooTight, value: Some(5.0), .. }] = found[..] else { panic!("{found:?}") };
    let flat = |flat_length_mm| ToothShape::FlatSided { width_mm: 15.0, flat_length_mm };
    assert!(Drive::new(&with(flat(9.99))).is_ok());
    let found = violations(&with(flat(10.0)));
    let [Violation { code: FieldCode::FlatTooLong, limit: Some(10.0), .. }] = found[..] else { panic!("{found:?}") };
    assert!(matches!(violations(&with(flat(f64::NAN)))[..], [Violation { code: FieldCode::OutOfRange, .. }]));
}

#[test]
fn flat_cutting_steepest_contact_is_a_finding() {
    let with = |flat_length_mm| DriveParameters {
        tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm },
        ..PAPER_5_1
    };
    // The contact farthest from the slot's middle line, by the flank's points in the tooth's frame.
    let drive_of = drive(&PAPER_5_1);
    let flank = drive_of.flank();
    let farthest_mm = (1..1000)
        .map(|i| {
            let tooth = flank.locus().at(Position::from_lobe(PI / 2.0 * f64::from(i) / 1000.0, 2)).unwrap();
            let point = flank.at(&tooth);
            flank.radius_mm(&tooth, &point) * flank.lead_rad(&tooth, &point).sin()
        })
        .fold(0.0, f64::max);
    let limit_mm = 2.0 * (25.0 - farthest_mm * farthest_mm).sqrt();
    let is_told = |flat_length_mm: f64| {
        let found = findings::of_drive(&drive(&with(flat_length_mm))).unwrap();
        found.iter().any(|finding| finding.code == FindingCode::FlatCutsTheContact)
    };
    assert!(is_told(limit_mm * 1.0001) && !is_told(limit_mm * 0.9999));
}

#[test]
fn assembly_places_every_tooth_on_path_in_slot() {
    for p in family() {
        let (n, input_angle_deg) = (p.installed as f64, 7.0_f64);
        let parameters = DrawingParameters { chord_tolerance_mm: 1e-2, max_points: 1_000_000, input_angle_deg };
        let draft = Draft::new(&p).unwrap();
        let drawing = Drawing::new(&draft, DrawnPart::Assembly, &PartsParameters::default(), &parameters).unwrap();
        let teeth = drawing.bodies(&Never).unwrap().into_iter().find(|body| body.part == Part::Teeth).unwrap();
        assert_eq!(Ok(teeth.placements.len()), usize::try_from(p.installed));
        let cam_rad = input_angle_deg.to_radians();
        let carrier_rad = cam_rad * (p.teeth - p.ring_teeth) as f64 / p.teeth as f64;
        for (slot, placement) in teeth.placements.iter().enumerate() {
            let angle_rad = carrier_rad + 2.0 * PI * slot as f64 / n;
            let from_lobe_rad = (angle_rad - cam_rad).rem_euclid(2.0 * PI);
            let expected = center_radius_mm(&p, from_lobe_rad) * Vector2::new(angle_rad.cos(), angle_rad.sin());
            let off_mm = (Vector2::new(placement.x_mm, placement.y_mm) - expected).norm();
            assert!(off_mm < 1e-9 * expected.norm(), "slot {slot} of {p:?} is {off_mm} mm off");
        }
    }
}

#[test]
fn bored_flank_of_every_kind_ends_at_bore() {
    for unbored in family() {
        let unbored = DriveParameters { tip_radius_mm: None, ..unbored };
        let natural = drive(&unbored);
        let (tip_mm, root_mm) = (natural.ring_tooth().natural_tip_radius_mm, natural.root_radius_mm());
        for share in [0.01, 0.1, 0.3, 0.6, 0.9] {
            let bore_mm = tip_mm + share * (root_mm - tip_mm);
            // A bore may leave fewer teeth than a drive needs.
            let Ok(bored) = Drive::new(&DriveParameters { tip_radius_mm: Some(bore_mm), ..unbored }) else { continue };
            let end = bored.flank_limit();
            assert_eq!(end.end, FlankEnd::Bore);
            let tooth = bored.flank().locus().at(end.position).unwrap();
            // The flank is one radius from the path along its normal.
            let ring_teeth_per_lobe = unbored.ring_teeth as f64 / f64::from(bored.lobes());
            let (r, tan) = (unbored.tooth_radius_mm, tooth.tan_pressure_angle * ring_teeth_per_lobe);
            let along_mm = tooth.center_radius_mm + r / tan.hypot(1.0);
            let radius_mm = along_mm.hypot(r * tan / tan.hypot(1.0));
            assert!((radius_mm - bore_mm).abs() < 1e-12 * bore_mm, "{radius_mm} is not {bore_mm} on {unbored:?}");
        }
    }
}
