//! Outlines of modified parts, against the path of centres from the cam's support function, independent of the solver.

use std::f64::consts::PI;

use nalgebra::{Point2, Rotation2, Vector2};
use proptest::prelude::*;
use toothwave_solver::drawing::{Body, Drawing, DrawingParameters, DrawnPart, Edge, Outline};
use toothwave_solver::drive::{Draft, DriveError};
use toothwave_solver::gaps::{Gaps, TipRelief};
use toothwave_solver::mesh::Place;
use toothwave_solver::parts::{CarrierRadii, LEAST_WALL, PartsParameters, RIM};
use toothwave_solver::violation::Modified;
use toothwave_solver::{
    Contact, Drive, DriveParameters, FieldCode, Finding, FindingCode, Modification, Never, Parameter, Part, PerContact,
    Position, ToothShape, Violation, WaveGenerator,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, cases, drawn_part, drive, ellipse};

const NONE: Modification = Modification::NONE;
const ARCSEC: f64 = PI / 648_000.0;

/// Returns a drive with one lobe and a ring with more teeth than the carrier.
fn eccentric() -> DriveParameters {
    DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 },
        teeth: 20,
        installed: 20,
        ring_teeth: 21,
        tooth_radius_mm: 3.0,
        ..PAPER_5_1
    }
}

/// Returns a drive with three lobes.
fn three_lobes() -> DriveParameters {
    DriveParameters {
        wave_generator: WaveGenerator::Harmonic { lobes: 3, mean_radius_mm: 48.0, amplitude_mm: 1.0 },
        teeth: 36,
        installed: 36,
        ring_teeth: 33,
        tooth_radius_mm: 3.0,
        ..PAPER_5_1
    }
}

const RELIEF: TipRelief = TipRelief { amount_um: 30.0, start_deg: 20.0, power: 2.0 };

/// Returns each modification of the ring alone, in both directions, and all together.
fn of_the_ring() -> Vec<Modification> {
    let reliefs = [(30.0, 2.0), (-20.0, 1.5), (30.0, 1.0), (10.0, 0.5), (25.0, 3.0)];
    let relief =
        |(amount_um, power)| Modification { ring_tip_relief: Some(TipRelief { amount_um, power, ..RELIEF }), ..NONE };
    let mut all: Vec<_> = reliefs.into_iter().map(relief).collect();
    for sign in [1.0, -1.0] {
        all.extend([
            Modification { ring_equidistant_um: sign * 40.0, ..NONE },
            Modification { ring_path_shift_um: sign * 40.0, ..NONE },
            Modification { ring_profile_shift_um: sign * 40.0, ..NONE },
            Modification { ring_rotation_arcsec: sign * 120.0, ..NONE },
        ]);
    }
    all.push(Modification {
        ring_equidistant_um: 12.0,
        ring_path_shift_um: -20.0,
        ring_profile_shift_um: 7.0,
        ring_rotation_arcsec: 60.0,
        ring_tip_relief: Some(RELIEF),
        ..NONE
    });
    all
}

fn unit(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(angle_rad.cos(), angle_rad.sin())
}

/// Returns a tooth's centre by the cam's normal angle: `(h + r) n + h' n'`.
fn center(p: &DriveParameters, normal_rad: f64) -> Vector2<f64> {
    let (support, slope) = match p.wave_generator {
        WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } => {
            let n = unit(normal_rad);
            let h = (a * n.x).hypot(b * n.y);
            (h, (b * b - a * a) * n.x * n.y / h)
        }
        WaveGenerator::Eccentric { radius_mm, eccentricity_mm } => {
            (radius_mm + eccentricity_mm * normal_rad.cos(), -eccentricity_mm * normal_rad.sin())
        }
        WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm } => {
            let u = lobes as f64;
            (mean_radius_mm + amplitude_mm * (u * normal_rad).cos(), -amplitude_mm * u * (u * normal_rad).sin())
        }
        other => panic!("{other:?} is not known by its support"),
    };
    let n = unit(normal_rad);
    (support + p.tooth_radius_mm) * n + slope * Vector2::new(-n.y, n.x)
}

/// Returns the shifted centre in the ring's frame, with its position ψ.
fn in_ring(p: &DriveParameters, normal_rad: f64, shift_mm: f64) -> (Vector2<f64>, f64) {
    let k = p.ring_teeth as f64 / p.wave_generator.lobes() as f64;
    let center = center(p, normal_rad);
    let position = center.y.atan2(center.x);
    (unit(position / k) * (center.norm() + shift_mm), position)
}

/// Returns the least distance of a point from the shifted path of one space, and the nearest position.
fn from_path(p: &DriveParameters, point: Vector2<f64>, shift_mm: f64) -> (f64, f64) {
    let end = PI / p.wave_generator.lobes() as f64;
    let distance = |normal: f64| (point - in_ring(p, normal, shift_mm).0).norm();
    let steps = 400;
    let at = |i: i32| end * f64::from(i) / f64::from(steps);
    let best = (-20..=steps + 20).min_by(|&i, &j| distance(at(i)).total_cmp(&distance(at(j)))).unwrap();
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (at(best - 1), at(best + 1));
    for _ in 0..60 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if distance(left) < distance(right) { high = right } else { low = left }
    }
    let normal = 0.5 * (low + high);
    (distance(normal), in_ring(p, normal, shift_mm).1)
}

fn parts(modification: Modification) -> PartsParameters {
    PartsParameters { modification, ..PartsParameters::default() }
}

fn drawn(p: &DriveParameters, subject: DrawnPart, parts: &PartsParameters, tolerance_mm: f64, deg: f64) -> Vec<Body> {
    let parameters =
        DrawingParameters { chord_tolerance_mm: tolerance_mm, max_points: 10_000_000, input_angle_deg: deg };
    Drawing::new(&Draft::new(p).unwrap(), subject, parts, &parameters).unwrap().bodies(&Never).unwrap()
}

fn edges(outline: &Outline) -> &[Edge] {
    match outline {
        Outline::Path { edges } => edges,
        Outline::Circle { .. } => panic!("a circle"),
    }
}

/// Returns the ring's edges in one tooth space, from tip to tip.
fn space(p: &DriveParameters, modification: Modification) -> Vec<Edge> {
    let ring = drawn(p, DrawnPart::Ring, &parts(modification), 1e-4, 0.0).remove(0);
    let edges = edges(&ring.holes[0]);
    let count = edges.len() / usize::try_from(p.ring_teeth).unwrap();
    assert_eq!(edges.len() % count, 0);
    edges[..count].to_vec()
}

fn points(edge: &Edge) -> Vec<Point2<f64>> {
    match edge {
        Edge::Curve { .. } => edge.points().map(Point2::from).collect(),
        Edge::Line { .. } | Edge::Arc { .. } => Vec::new(),
    }
}

#[test]
fn modified_flank_is_offset_from_moved_path() {
    let mut worst: f64 = 0.0;
    for p in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, eccentric(), three_lobes()] {
        let flank_end_rad = drive(&p).flank_limit().position.from_lobe_rad;
        for m in of_the_ring() {
            for edge in space(&p, m) {
                // The upper half; the lower one is its image. Ends stand on symmetry lines.
                let points = points(&edge);
                for point in points.iter().skip(1).take(points.len().saturating_sub(2)).filter(|point| point.y > 0.0) {
                    let turned = Rotation2::new(-m.ring_rotation_arcsec * ARCSEC) * point.coords;
                    let shifted = turned * (1.0 - 1e-3 * m.ring_profile_shift_um / turned.norm());
                    let (distance, position) = from_path(&p, shifted, 1e-3 * m.ring_path_shift_um);
                    let relief_um = m.ring_tip_relief.map_or(0.0, |relief| {
                        let start = relief.start_deg.to_radians();
                        let share = ((position - start) / (flank_end_rad - start)).max(0.0);
                        relief.amount_um * share.powf(relief.power)
                    });
                    let off = distance - p.tooth_radius_mm - 1e-3 * (m.ring_equidistant_um + relief_um);
                    // The nearest position has half of a distance's digits. A relief with a power below one is
                    // steep at its start.
                    let steep = m.ring_tip_relief.is_some_and(|relief| relief.power < 1.0);
                    let allowed = if m.ring_tip_relief.is_none() {
                        1e-12
                    } else if steep {
                        1e-5
                    } else {
                        1e-7
                    };
                    assert!(off.abs() < allowed, "{off:e} at {position} of {m:?} on {p:?}");
                    if m.ring_tip_relief.is_none() {
                        worst = worst.max(off.abs());
                    }
                }
            }
        }
    }
    println!("worst distance from the moved path: {worst:.1e} mm");
}

/// Returns the tip radius: the farthest reach of discs on the shifted path along a tooth's symmetry line.
fn swept_tip_mm(p: &DriveParameters, shift_mm: f64, disc_mm: f64) -> f64 {
    let line = unit(PI / p.ring_teeth as f64);
    let end = PI / p.wave_generator.lobes() as f64;
    let reach = |normal: f64| {
        let center = in_ring(p, normal, shift_mm).0;
        let (along, across) = (center.dot(&line), center.perp(&line));
        if across.abs() < disc_mm { along + (disc_mm * disc_mm - across * across).sqrt() } else { 0.0 }
    };
    let steps = 4000;
    let at = |i: i32| end * f64::from(i) / f64::from(steps);
    let best = (0..=steps).max_by(|&i, &j| reach(at(i)).total_cmp(&reach(at(j)))).unwrap();
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (at(best - 1), at(best + 1));
    for _ in 0..70 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if reach(left) > reach(right) { high = right } else { low = left }
    }
    reach(0.5 * (low + high))
}

#[test]
fn shifted_path_tip_matches_swept_discs() {
    for p in [PAPER_5_1, PAPER_5_2, eccentric(), three_lobes()] {
        for (path_um, equidistant_um) in [(40.0, 0.0), (-40.0, 0.0), (25.0, -10.0), (-25.0, 10.0)] {
            let m = Modification { ring_path_shift_um: path_um, ring_equidistant_um: equidistant_um, ..NONE };
            let tip = points(&space(&p, m)[0])[0].coords.norm();
            let swept = swept_tip_mm(&p, 1e-3 * path_um, p.tooth_radius_mm + 1e-3 * equidistant_um);
            assert!((tip - swept).abs() < 1e-12 * swept, "{tip} is not {swept}: {m:?} on {p:?}");
        }
    }
}

/// Radii lie just below and above the swept path's own threshold, where the flank's end moves like a square root.
#[test]
fn shifted_path_ends_correctly_near_undercut_threshold() {
    let critical = drive(&PAPER_5_1).flank().critical_tooth_radius_mm().unwrap();
    for off in [-1e-3, -1e-5, 1e-5, 1e-4, 1e-3] {
        let p = DriveParameters { tooth_radius_mm: critical * (1.0 + off), ..PAPER_5_1 };
        let m = Modification { ring_path_shift_um: 0.5, ..NONE };
        let tip = points(&space(&p, m)[0])[0].coords.norm();
        let swept = swept_tip_mm(&p, 5e-4, p.tooth_radius_mm);
        assert!((tip - swept).abs() < 1e-12 * swept, "{tip} is not {swept} at {off}");
    }
}

#[test]
fn drawn_distances_equal_model_gaps() {
    let size_um = 2.0;
    let modifications = [
        Modification { ring_equidistant_um: size_um, ..NONE },
        Modification { ring_path_shift_um: size_um, ..NONE },
        Modification { ring_profile_shift_um: size_um, ..NONE },
        Modification { ring_rotation_arcsec: 10.0, ..NONE },
        Modification { ring_tip_relief: Some(TipRelief { amount_um: size_um, ..RELIEF }), ..NONE },
        Modification { wave_generator_equidistant_um: size_um, ..NONE },
        Modification { slot_wall_um: size_um, ..NONE },
        Modification { carrier_rotation_arcsec: 10.0, ..NONE },
        Modification { tooth_radius_um: size_um, ..NONE },
    ];
    for p in [PAPER_5_1, PAPER_5_2, eccentric(), three_lobes()] {
        let drive = drive(&p);
        let sense = drive.sense();
        let flank_end_rad = drive.flank_limit().position.from_lobe_rad;
        for m in modifications {
            let bodies = drawn(&p, DrawnPart::Assembly, &parts(m), 1e-5, 7.0);
            let [ring, carrier, teeth, cam] = &bodies[..] else { panic!("{bodies:?}") };
            let ring_points = placed_outline(&ring.holes[0], 0.0);
            let cam_points = placed_outline(&cam.outer, cam.placements[0].rotation_deg);
            let Outline::Circle { radius_mm, .. } = teeth.outer else { panic!("a tooth is round") };
            let fingers = carrier.placements.len();
            let mut looked_at = 0;
            for (slot, tooth) in teeth.placements.iter().enumerate() {
                let center = Point2::new(tooth.x_mm, tooth.y_mm);
                let lobes = drive.lobes();
                let pitch = 2.0 * PI / f64::from(lobes);
                let from_lobe = (tooth.rotation_deg - 7.0).to_radians().rem_euclid(pitch);
                if from_lobe < 0.02 * pitch || from_lobe > 0.96 * flank_end_rad {
                    continue;
                }
                looked_at += 1;
                let at = drive.flank().locus().at(Position::from_lobe(from_lobe, lobes)).unwrap();
                let gaps = Gaps::new(&drive, &PerContact::default(), m, None);
                let gap = gaps.at(&Place::default(), &at, &drive.flank().at(&at));
                // The wall under load is ahead of the tooth if the carrier turns forward, else behind it.
                let finger = if sense > 0.0 { slot } else { (slot + fingers - 1) % fingers };
                let walls = placed_outline(&carrier.outer, carrier.placements[finger].rotation_deg);
                for (name, outline, gap_mm) in [
                    ("ring", &ring_points, gap.ring),
                    ("cam", &cam_points, gap.wave_generator),
                    ("wall", &walls, gap.carrier),
                ] {
                    let off = distance(outline, center) - radius_mm - gap_mm;
                    assert!(off.abs() < 4e-5, "{name} {off:e} of {gap_mm:e} at {from_lobe}: {m:?} on {p:?}");
                }
            }
            assert!(looked_at >= 5, "{looked_at}");
        }
    }
}

fn placed_outline(outline: &Outline, rotation_deg: f64) -> Vec<Point2<f64>> {
    placed(edges(outline), rotation_deg)
}

/// Returns points of the edges. On an arc chords are within 2 nm of a radius of 31 mm.
fn placed(edges: &[Edge], rotation_deg: f64) -> Vec<Point2<f64>> {
    let rotation = Rotation2::new(rotation_deg.to_radians());
    let of_edge = |edge: &Edge| match edge {
        Edge::Arc { center_mm, sweep_deg, .. } => {
            let center = Point2::from(*center_mm);
            let start = Point2::from(edge.start()) - center;
            let chords = (sweep_deg.abs() / 0.036).ceil();
            let at = |i: i32| Rotation2::new(sweep_deg.to_radians() * f64::from(i) / chords) * start;
            (0..).take_while(|&i| f64::from(i) <= chords).map(|i| center + at(i)).collect()
        }
        Edge::Line { .. } | Edge::Curve { .. } => edge.points().map(Point2::from).collect::<Vec<_>>(),
    };
    edges.iter().flat_map(of_edge).map(|point| rotation * point).collect()
}

/// Returns the least distance of a point from the chords of a closed outline.
fn distance(outline: &[Point2<f64>], point: Point2<f64>) -> f64 {
    let of_chord = |(from, to): (&Point2<f64>, &Point2<f64>)| {
        let along = to - from;
        let share = if along == Vector2::zeros() { 0.0 } else { (point - from).dot(&along) / along.norm_squared() };
        (point - (from + along * share.clamp(0.0, 1.0))).norm()
    };
    outline.iter().zip(outline.iter().cycle().skip(1)).map(of_chord).fold(f64::INFINITY, f64::min)
}

#[test]
fn modified_outlines_close_with_matching_tangents() {
    for p in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, eccentric(), three_lobes()] {
        for m in of_the_ring() {
            let ring = drawn(&p, DrawnPart::Ring, &parts(m), 1e-6, 0.0).remove(0);
            let edges = edges(&ring.holes[0]);
            for (edge, next) in edges.iter().zip(edges.iter().cycle().skip(1)) {
                assert_eq!(edge.end(), next.start());
                let Edge::Curve { start_tangent_deg, end_tangent_deg, .. } = edge else { continue };
                // A chord of a thousandth of a radian turns by as much, at a steep start of a relief by more.
                let steep = m.ring_tip_relief.is_some_and(|relief| relief.power < 2.0);
                let points = points(edge);
                let [first, second, .., before, last] = &points[..] else { panic!("{points:?}") };
                for (chord, tangent_deg) in [(second - first, start_tangent_deg), (last - before, end_tangent_deg)] {
                    let along = chord.normalize().dot(&unit(tangent_deg.to_radians()));
                    assert!(along > if steep { 0.9 } else { 1.0 - 1e-5 }, "{along} of {m:?} on {p:?}");
                }
            }
            // Counter-clockwise, its area positive and nearly the conjugate ring's.
            let shoelace = |edges: &[Edge]| -> f64 {
                let points = placed(edges, 0.0);
                points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| 0.5 * a.coords.perp(&b.coords)).sum()
            };
            let plain = drawn(&p, DrawnPart::Ring, &PartsParameters::default(), 1e-4, 0.0).remove(0);
            let ratio = shoelace(edges) / shoelace(self::edges(&plain.holes[0]));
            assert!((ratio - 1.0).abs() < 5e-3, "{ratio} of {m:?} on {p:?}");
        }
    }
}

#[test]
fn turned_flanks_leave_arc_or_land() {
    let turned = |arcsec| space(&PAPER_5_1, Modification { ring_rotation_arcsec: arcsec, ..NONE });
    let apart = turned(120.0);
    let [lower @ Edge::Curve { .. }, Edge::Arc { radius_mm, sweep_deg, .. }, upper @ Edge::Curve { .. }] = &apart[..]
    else {
        panic!("{apart:?}")
    };
    assert!((radius_mm - 68.0).abs() < 1e-12 && (sweep_deg.to_radians() - 240.0 * ARCSEC).abs() < 1e-15);
    // Thinned from both sides, the ring's teeth are points outside the regular tip at 66.
    let [tip, other_tip] = [lower.start(), upper.end()].map(|point| Point2::from(point).coords.norm());
    assert!(tip > 66.0 && tip < 66.2 && (other_tip - tip).abs() < 1e-12, "{tip}");
    let together = turned(-120.0);
    let [Edge::Curve { .. }, upper @ Edge::Curve { .. }, Edge::Arc { radius_mm, sweep_deg, .. }] = &together[..] else {
        panic!("{together:?}")
    };
    assert!((radius_mm - 66.0).abs() < 1e-12 && (sweep_deg.to_radians() - 240.0 * ARCSEC).abs() < 1e-13);
    let [x_mm, y_mm] = upper.start();
    assert!(y_mm == 0.0 && x_mm < 68.0);
}

#[test]
fn equidistant_modification_draws_as_clearance() {
    for p in [PAPER_5_1, PAPER_5_2, eccentric()] {
        for (part, clearance, modification) in [
            (
                Part::Ring,
                PartsParameters { ring_clearance_um: 30.0, ..parts(NONE) },
                Modification { ring_equidistant_um: 30.0, ..NONE },
            ),
            (
                Part::WaveGenerator,
                PartsParameters { wave_generator_clearance_um: 30.0, ..parts(NONE) },
                Modification { wave_generator_equidistant_um: 30.0, ..NONE },
            ),
            (
                Part::Carrier,
                PartsParameters { carrier_clearance_um: 30.0, ..parts(NONE) },
                Modification { slot_wall_um: 30.0, ..NONE },
            ),
            (
                Part::Teeth,
                PartsParameters { teeth_clearance_um: 30.0, ..parts(NONE) },
                Modification { tooth_radius_um: 30.0, ..NONE },
            ),
        ] {
            let draw = |parts: &PartsParameters| drawn(&p, drawn_part(part), parts, 1e-3, 0.0);
            assert_eq!(draw(&clearance), draw(&parts(modification)), "{part:?}");
        }
    }
}

#[test]
fn carrier_beyond_advanced_tips_is_refused() {
    let forward = [
        Modification { ring_equidistant_um: -30.0, ..NONE },
        Modification { ring_path_shift_um: -30.0, ..NONE },
        Modification { ring_profile_shift_um: -30.0, ..NONE },
    ];
    let draft = Draft::new(&PAPER_5_1).unwrap();
    let of = |modification: Modification, outer_mm: f64, ring_clearance_um: f64| {
        let carrier = CarrierRadii { inner_mm: None, outer_mm: Some(outer_mm) };
        let parts = PartsParameters { carrier, ring_clearance_um, ..parts(modification) };
        parts.violations(Part::Carrier, &draft)
    };
    for modification in forward {
        let found = of(modification, 65.99, 0.0);
        let [Violation { code: FieldCode::CarrierMeetsRing, value: Some(65.99), limit: Some(limit), .. }] = found[..]
        else {
            panic!("{found:?}")
        };
        assert!((limit - 65.97).abs() < 1e-9, "{limit} of {modification:?}");
        assert_eq!(of(modification, limit - 1e-6, 0.0), []);
        assert!(!of(modification, limit + 1e-6, 0.0).is_empty());
        // A clearance sets it back, but not beyond its nominal place.
        assert_eq!(of(modification, 65.99, 30.0), []);
    }
    assert_eq!(of(NONE, 65.99, 0.0), []);
}

#[test]
fn rim_starts_outside_root_as_made() {
    let of = |drive: &DriveParameters, modification: Modification, ring_clearance_um: f64| {
        let parts = PartsParameters { ring_outer_radius_mm: Some(60.0), ring_clearance_um, ..parts(modification) };
        let found = parts.violations(Part::Ring, &Draft::new(drive).unwrap());
        let limit = found.iter().find_map(|violation| match violation {
            Violation { code: FieldCode::RingWithoutRim, value: Some(60.0), limit, .. } => *limit,
            _ => None,
        });
        limit.unwrap_or_else(|| panic!("{found:?}"))
    };
    let set_back = Modification { ring_equidistant_um: 30.0, ..NONE };
    let shifted = Modification { ring_path_shift_um: 40.0, ring_profile_shift_um: -15.0, ..NONE };
    // a + 2r plus all offsets of the flank. A rim must exceed it by a millionth.
    for (modification, clearance_um, root_mm) in [
        (NONE, 0.0, 68.0),
        (NONE, 20.0, 68.02),
        (set_back, 0.0, 68.03),
        (set_back, 20.0, 68.05),
        (shifted, 20.0, 68.045),
    ] {
        let limit = of(&PAPER_5_1, modification, clearance_um);
        assert!((limit - root_mm * (1.0 + 1e-6)).abs() < 1e-9, "{limit}, not {root_mm}");
    }
    // Wrong values of other parts do not matter.
    assert_eq!(of(&PAPER_5_1, Modification { slot_wall_um: 2e6, ..set_back }, 0.0), of(&PAPER_5_1, set_back, 0.0));
    // For an impossible drive, the known values count.
    let impossible = DriveParameters { ring_teeth: 20, ..PAPER_5_1 };
    assert!((of(&impossible, NONE, 20.0) - 68.02 * (1.0 + 1e-6)).abs() < 1e-9);
}

#[test]
fn drawing_keeps_expected_point_count() {
    for p in [PAPER_5_1, PAPER_5_2, eccentric(), three_lobes()] {
        for (subject, has_curves) in [
            (DrawnPart::Ring, true),
            (DrawnPart::WaveGenerator, !matches!(p.wave_generator, WaveGenerator::Eccentric { .. })),
            (DrawnPart::Assembly, true),
            (DrawnPart::Carrier, false),
            (DrawnPart::Tooth, false),
        ] {
            for tolerance_mm in [1e-2, 1e-4] {
                let parameters = DrawingParameters {
                    chord_tolerance_mm: tolerance_mm,
                    max_points: 10_000_000,
                    input_angle_deg: 0.0,
                };
                let draft = Draft::new(&p).unwrap();
                let drawing = Drawing::new(&draft, subject, &parts(NONE), &parameters).unwrap();
                let bodies = drawing.bodies(&Never).unwrap();
                let outlines = bodies.iter().flat_map(|body| body.holes.iter().chain([&body.outer]));
                let points: usize = outlines
                    .flat_map(|outline| if let Outline::Path { edges } = outline { &edges[..] } else { &[] })
                    .map(|edge| if let Edge::Curve { x_mm, .. } = edge { x_mm.len() } else { 0 })
                    .sum();
                assert_eq!(points > 0, has_curves);
                let expected = drawing.expected_points();
                assert!(
                    expected >= points as u64 && (expected > 0) == has_curves,
                    "{subject:?}: {expected}, not {points}"
                );
            }
        }
    }
}

#[test]
fn zero_relief_draws_conjugate_ring() {
    let relief = Modification { ring_tip_relief: Some(TipRelief { amount_um: 0.0, ..RELIEF }), ..NONE };
    assert_eq!(space(&PAPER_5_1, relief), space(&PAPER_5_1, NONE));
}

#[test]
fn smooth_space_is_one_curve_and_relief_another() {
    let curves = |start_deg, power| {
        let relief = TipRelief { start_deg, power, ..RELIEF };
        let edges = space(&PAPER_5_1, Modification { ring_tip_relief: Some(relief), ..NONE });
        assert!(edges.iter().all(|edge| matches!(edge, Edge::Curve { .. })), "{edges:?}");
        edges.len()
    };
    assert_eq!([curves(20.0, 2.0), curves(20.0, 1.0), curves(20.0, 0.5)], [3, 3, 3]);
    // A relief from the root continues the curve tangentially with a power above one, else with a bend.
    assert_eq!([curves(0.0, 2.0), curves(0.0, 1.0), curves(0.0, 0.5)], [1, 2, 2]);
}

#[test]
fn low_relief_leaves_rim_unchanged() {
    let outer = |modification| {
        let ring = drawn(&PAPER_5_1, DrawnPart::Ring, &parts(modification), 1e-2, 0.0).remove(0);
        ring.outer
    };
    assert_eq!(outer(Modification { ring_tip_relief: Some(RELIEF), ..NONE }), outer(NONE));
}

/// Returns the ring's reach, derived from the limit that a refusal of a too small ring reports.
fn reported_reach_mm(p: &DriveParameters, parts: &PartsParameters) -> f64 {
    let without_rim = PartsParameters { ring_outer_radius_mm: Some(1.0), ..*parts };
    let violations = without_rim.violations(Part::Ring, &Draft::new(p).unwrap());
    let without_rim = violations.iter().find(|violation| violation.code == FieldCode::RingWithoutRim);
    without_rim.and_then(|violation| violation.limit).unwrap_or_else(|| panic!("{violations:?}")) / (1.0 + LEAST_WALL)
}

proptest! {
    #![proptest_config(cases(256))]

    /// Within two tolerances of the drawn hole: the curve may exceed its points by one tolerance.
    #[test]
    fn rim_starts_where_hole_reaches_farthest(
        which in 0_usize..5,
        power in prop::sample::select(vec![0.1, 0.5, 1.0, 1.5, 2.0, 3.0, 10.0]),
        (amount, is_set_forward) in (-2.5_f64..0.5, prop::bool::weighted(0.2)),
        start in prop::option::of(0.0_f64..0.98),
        (rotation, shift, equidistant) in (prop::option::of(-0.1_f64..0.2), prop::option::of(-0.1_f64..0.1), prop::option::of(-0.1_f64..0.1)),
    ) {
        let p = [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, eccentric(), three_lobes()][which];
        let drive = drive(&p);
        let stroke_um = 1e3 * (drive.root_radius_mm() - drive.ring_tooth().natural_tip_radius_mm);
        let amount_um = 10.0_f64.powf(amount) * if is_set_forward { -stroke_um } else { stroke_um };
        let start_deg = start.map_or(0.0, |share| share * drive.flank_limit().position.from_lobe_deg());
        let pitch_arcsec = PI / p.ring_teeth as f64 / ARCSEC;
        let parts = parts(Modification {
            ring_tip_relief: Some(TipRelief { amount_um, start_deg, power }),
            ring_rotation_arcsec: rotation.unwrap_or(0.0) * pitch_arcsec,
            ring_profile_shift_um: 1e3 * shift.unwrap_or(0.0) * p.tooth_radius_mm,
            ring_equidistant_um: 1e3 * equidistant.unwrap_or(0.0) * p.tooth_radius_mm,
            ..NONE
        });
        let tolerance_mm = 1e-5 * p.tooth_radius_mm;
        let parameters = DrawingParameters { chord_tolerance_mm: tolerance_mm, max_points: 10_000_000, input_angle_deg: 0.0 };
        let draft = Draft::new(&p).unwrap();
        let Ok(drawing) = Drawing::new(&draft, DrawnPart::Ring, &parts, &parameters) else { return Ok(()) };
        let body = drawing.bodies(&Never).unwrap().remove(0);
        let of_hole = edges(&body.holes[0]);
        let farthest = |points: &[Point2<f64>]| points.iter().map(|point| point.coords.norm()).fold(0.0, f64::max);
        let drawn_mm = of_hole.iter().map(|edge| farthest(&points(edge)).max(Point2::from(edge.start()).coords.norm())).fold(0.0, f64::max);

        let reach_mm = reported_reach_mm(&p, &parts);
        prop_assert!(reach_mm >= drawn_mm * (1.0 - 1e-11), "{reach_mm} told, {drawn_mm} drawn");
        prop_assert!(reach_mm <= drawn_mm + 2.0 * tolerance_mm, "{reach_mm} told, {drawn_mm} drawn");
        let Outline::Circle { radius_mm, .. } = body.outer else { panic!("{:?}", body.outer) };
        prop_assert!((radius_mm - RIM * reach_mm).abs() < 1e-12 * radius_mm);
        let thin = PartsParameters { ring_outer_radius_mm: Some(reach_mm * (1.0 + 1e-3)), ..parts };
        let found = Drawing::new(&draft, DrawnPart::Ring, &thin, &parameters).unwrap().findings().unwrap();
        let is_rim = |finding: &&Finding| finding.code == FindingCode::ThinWallAsMade && finding.contact == Some(Contact::Ring);
        let walls: Vec<_> = found.iter().filter(is_rim).map(|finding| finding.value).collect();
        prop_assert!(matches!(walls[..], [wall_mm] if (wall_mm - 1e-3 * reach_mm).abs() < 1e-11 * reach_mm), "{walls:?}");
    }
}

/// Near its start a relief of power 1 or less grows faster than the flank falls.
#[test]
fn outward_relief_at_root_reduces_rim() {
    for (amount_um, power, outer_mm) in [(500.0, 0.1, 68.2), (1000.0, 1.0, 68.02)] {
        let relief = TipRelief { amount_um, start_deg: 0.0, power };
        let parts = PartsParameters {
            ring_outer_radius_mm: Some(outer_mm),
            ..parts(Modification { ring_tip_relief: Some(relief), ..NONE })
        };
        let violations = parts.violations(Part::Ring, &Draft::new(&PAPER_5_1).unwrap());
        assert!(
            matches!(violations[..], [Violation { code: FieldCode::RingWithoutRim, .. }]),
            "{violations:?} of the power {power}"
        );
    }
}

#[test]
fn excessive_modification_is_refused_at_its_number() {
    let refused = |p: &DriveParameters, part, modification| {
        let parameters = DrawingParameters { chord_tolerance_mm: 1e-3, max_points: 1_000_000, input_angle_deg: 0.0 };
        match Drawing::new(&Draft::new(p).unwrap(), drawn_part(part), &parts(modification), &parameters) {
            Err(DriveError::Impossible(violations)) => violations,
            other => panic!("{other:?}"),
        }
    };
    let nothing = |modified, value, limit| vec![Violation::modification_leaves_nothing(modified, value, limit)];
    let p = PAPER_5_1;
    for (part, modification, expected) in [
        (
            Part::Ring,
            Modification { ring_equidistant_um: -5000.0, ..NONE },
            nothing(Modified::RingEquidistant, -5000.0, Some(-5000.0)),
        ),
        // With 26 teeth, the middle of a space is 24 923 arc seconds from that of a tooth.
        (
            Part::Ring,
            Modification { ring_rotation_arcsec: 25_000.0, ..NONE },
            nothing(Modified::RingRotation, 25_000.0, None),
        ),
        (
            Part::Ring,
            Modification { ring_path_shift_um: -70_000.0, ..NONE },
            nothing(Modified::RingPathShift, -70_000.0, None),
        ),
        (
            Part::WaveGenerator,
            Modification { wave_generator_equidistant_um: -5001.0, ..NONE },
            nothing(Modified::WaveGeneratorEquidistant, -5001.0, Some(-5000.0)),
        ),
        (
            Part::Carrier,
            Modification { slot_wall_um: -5000.0, ..NONE },
            nothing(Modified::SlotWall, -5000.0, Some(-5000.0)),
        ),
        (
            Part::Teeth,
            Modification { tooth_radius_um: 5000.0, ..NONE },
            nothing(Modified::ToothRadius, 5000.0, Some(5000.0)),
        ),
    ] {
        assert_eq!(refused(&p, part, modification), expected);
    }
    let late = Modification { ring_tip_relief: Some(TipRelief { start_deg: 95.0, ..RELIEF }), ..NONE };
    let found = refused(&p, Part::Ring, late);
    assert!(found.len() == 1 && found[0].to_string().starts_with("a tip relief from 95.0 deg on"), "{found:?}");
    let far = Modification { slot_wall_um: 2e6, ..NONE };
    let parameter = Parameter::Modification(Modified::SlotWall);
    let out_of_range = Violation::out_of_range(parameter, 2e6, 1e6);
    assert!(refused(&p, Part::Carrier, far).contains(&out_of_range));
    // The flank is set so far inside that the bore removes it.
    let root_mm = Drive::new(&PAPER_5_2_BORED).unwrap().root_radius_mm();
    let least_um = 1e3 * (52.8227 - root_mm);
    let found = refused(&PAPER_5_2_BORED, Part::Ring, Modification { ring_equidistant_um: least_um - 1.0, ..NONE });
    assert!(
        matches!(found[..], [Violation { code: FieldCode::ModificationLeavesNothing, limit: Some(limit), .. }] if (limit - least_um).abs() < 1e-9),
        "{found:?}"
    );
}

/// The cam is nearly round and the tip bored. A turned flank extends to the valley, where a relief of the 52nd
/// power is far outside the ring.
#[test]
fn relief_rising_out_of_its_space_is_refused() {
    let p = DriveParameters {
        wave_generator: ellipse(34.253_525_011_805_64, 34.246_474_988_194_36),
        teeth: 28,
        installed: 28,
        ring_teeth: 26,
        tooth_radius_mm: 2.963_218_370_144_663,
        tooth: ToothShape::Cylinder { width_mm: 13.0 },
        tip_radius_mm: Some(40.179_190_655_762_48),
    };
    let drawn = |power| {
        let relief = TipRelief { amount_um: 0.003, start_deg: 15.53, power };
        let modification =
            Modification { ring_rotation_arcsec: -10.0, ring_tip_relief: Some(relief), ..Modification::default() };
        let parameters = DrawingParameters { chord_tolerance_mm: 1e-3, max_points: 1_000_000, input_angle_deg: 0.0 };
        let subject = DrawnPart::Ring;
        Drawing::new(&Draft::new(&p).unwrap(), subject, &parts(modification), &parameters)
    };
    let modified = Modified::TipReliefAmount;
    let leaves_nothing = Violation::modification_leaves_nothing(modified, 0.003, None);
    assert_eq!(drawn(52.1).map(|_| ()), Err(DriveError::Impossible(vec![leaves_nothing])));
    let gentle = drawn(2.0).expect("a relief of the second power stays within the ring");
    assert!(gentle.bodies(&Never).is_ok());
}

/// A relief adds inflections where its curvature exceeds the path's. A tangent at one end may lie along the chord.
#[test]
fn chord_with_several_inflections_keeps_tolerance() {
    let p = PAPER_5_1;
    let half_rad = 0.5 * PI;
    let k = p.ring_teeth as f64 / 2.0;
    for (amount_um, start_deg, power) in [
        (-103.027_740_281_209_85, 17.017_335_274_292_947, 3.438_615_871_309_888),
        (-67.021_817_668_199_62, 27.925_798_579_260_814, 3.852_224_926_774_075_4),
    ] {
        let ring_tip_relief = Some(TipRelief { amount_um, start_deg, power });
        let parts = parts(Modification { ring_tip_relief, ..NONE });
        for tolerance_mm in [1e-6, 2e-6, 4e-6, 8e-6] {
            let ring = drawn(&p, DrawnPart::Ring, &parts, tolerance_mm, 0.0).remove(0);
            let edges = edges(&ring.holes[0]);
            let space = placed(&edges[..edges.len() / usize::try_from(p.ring_teeth).unwrap()], 0.0);
            let upper: Vec<_> = space.into_iter().filter(|point| point.y >= 0.0).collect();
            let start_rad = start_deg.to_radians();
            for step in 0..=600 {
                let normal_rad = start_rad + (half_rad - start_rad) * f64::from(step) / 600.0;
                let (center, position_rad) = in_ring(&p, normal_rad, 0.0);
                let share = ((position_rad - start_rad) / (half_rad - start_rad)).max(0.0);
                let distance_mm = p.tooth_radius_mm + 1e-3 * amount_um * share.powf(power);
                let pressure_rad = (k * (normal_rad - position_rad).tan()).atan();
                let point = Point2::from(center + distance_mm * unit(position_rad / k + pressure_rad));
                let off_mm = distance(&upper, point);
                assert!(off_mm <= tolerance_mm * (1.0 + 1e-6), "{off_mm:e} at {position_rad} for {tolerance_mm:e}");
            }
        }
    }
}

/// Returns the Bézier polygons of all curves.
fn polynomials(edges: &[Edge]) -> Vec<Vec<Point2<f64>>> {
    let of_edge = |edge: &Edge| match edge {
        Edge::Curve { polynomials, .. } => polynomials.clone(),
        Edge::Line { .. } | Edge::Arc { .. } => Vec::new(),
    };
    edges.iter().flat_map(of_edge).collect()
}

/// Samples a polynomial with Bernstein's sum, including both ends.
fn along(polygon: &[Point2<f64>]) -> impl Iterator<Item = Vector2<f64>> {
    let degree = polygon.len() - 1;
    (0..=60).map(move |i| {
        let t = f64::from(i) / 60.0;
        let mut binomial = 1.0;
        let mut sum = Vector2::zeros();
        for (k, pole) in polygon.iter().enumerate() {
            sum += pole.coords * (binomial * t.powf(k as f64) * (1.0 - t).powf((degree - k) as f64));
            binomial *= (degree - k) as f64 / (k + 1) as f64;
        }
        sum
    })
}

#[test]
fn solid_polynomials_keep_hundredth_of_chord_tolerance() {
    for p in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, eccentric(), three_lobes()] {
        for tolerance_mm in [1e-2, 1e-3, 1e-5] {
            let near_mm = 0.01 * tolerance_mm;
            let ring = drawn(&p, DrawnPart::Ring, &parts(NONE), tolerance_mm, 0.0).remove(0);
            let edges = edges(&ring.holes[0]);
            let of_space = edges.len() / usize::try_from(p.ring_teeth).unwrap();
            for polygon in polynomials(&edges[..of_space]) {
                for point in along(&polygon) {
                    let above = Vector2::new(point.x, point.y.abs());
                    let off_mm = (from_path(&p, above, 0.0).0 - p.tooth_radius_mm).abs();
                    assert!(off_mm < 1.1 * near_mm, "{off_mm} of {near_mm} on {p:?}");
                }
            }
            if let WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } = p.wave_generator {
                let cam = drawn(&p, DrawnPart::WaveGenerator, &parts(NONE), tolerance_mm, 0.0).remove(0);
                for point in polynomials(self::edges(&cam.outer)).iter().flat_map(|polygon| along(polygon)) {
                    // Distance from the ellipse to first order.
                    let slope = 2.0 * (point.x / (a * a)).hypot(point.y / (b * b));
                    let off_mm = ((point.x / a).powi(2) + (point.y / b).powi(2) - 1.0).abs() / slope;
                    assert!(off_mm < 1.1 * near_mm, "{off_mm} of {near_mm}");
                }
            }
        }
    }
}

#[test]
fn polynomials_join_tangentially_and_end_with_curve() {
    for p in [PAPER_5_1, PAPER_5_2_BORED, eccentric(), three_lobes()] {
        for m in of_the_ring().into_iter().chain([NONE]) {
            for part in [Part::Ring, Part::WaveGenerator] {
                let body = drawn(&p, drawn_part(part), &parts(m), 1e-3, 0.0).remove(0);
                let outline = body.holes.first().unwrap_or(&body.outer);
                let Outline::Path { edges } = outline else { continue };
                for edge in edges {
                    let Edge::Curve { polynomials: polygons, .. } = edge else { continue };
                    let ends = (polygons[0][0], *polygons.last().unwrap().last().unwrap());
                    assert_eq!(ends, (edge.start().into(), edge.end().into()));
                    for (before, after) in polygons.iter().zip(&polygons[1..]) {
                        let [.., last, joint] = &before[..] else { panic!("{before:?}") };
                        assert_eq!(after[0], *joint);
                        let (into, out) = ((joint - last).normalize(), (after[1] - joint).normalize());
                        assert!(into.dot(&out) > 0.0 && into.perp(&out).abs() < 1e-9, "{into} {out} of {m:?}");
                    }
                }
            }
        }
    }
}

/// Points of the arcs of all curves.
fn along_arcs(edges: &[Edge]) -> Vec<Vector2<f64>> {
    let mut sampled = Vec::new();
    for edge in edges {
        let Edge::Curve { arcs, .. } = edge else { continue };
        assert_eq!(arcs[0].point, Point2::from(edge.start()));
        let ends = arcs.iter().skip(1).map(|arc| arc.point).chain([edge.end().into()]);
        for (arc, end) in arcs.iter().zip(ends) {
            let chord = end - arc.point;
            let to_right = Vector2::new(chord.y, -chord.x);
            // By the angle at which a point sees the chord's ends, half of the arc's on the other side.
            let half_rad = 2.0 * arc.bulge.atan();
            sampled.extend((0..=40).map(|i| {
                let share = f64::from(i) / 40.0;
                if arc.bulge == 0.0 {
                    return arc.point.coords + share * chord;
                }
                let radius_mm = 0.5 * chord.norm() / half_rad.sin();
                let center = arc.point + 0.5 * chord - to_right * (0.5 / half_rad.tan());
                let start = arc.point - center;
                assert!((start.norm() - radius_mm.abs()).abs() < 1e-9 * radius_mm.abs());
                (center + Rotation2::new(2.0 * half_rad * share) * start).coords
            }));
        }
    }
    sampled
}

#[test]
fn arcs_stay_within_chord_tolerance() {
    for p in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, eccentric(), three_lobes()] {
        for tolerance_mm in [0.1, 1e-2, 1e-3, 1e-5] {
            let ring = drawn(&p, DrawnPart::Ring, &parts(NONE), tolerance_mm, 0.0).remove(0);
            let edges = edges(&ring.holes[0]);
            let of_space = edges.len() / usize::try_from(p.ring_teeth).unwrap();
            for point in along_arcs(&edges[..of_space]) {
                let above = Vector2::new(point.x, point.y.abs());
                let off_mm = (from_path(&p, above, 0.0).0 - p.tooth_radius_mm).abs();
                assert!(off_mm < tolerance_mm, "{off_mm} of {tolerance_mm} on {p:?}");
            }
            if let WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } = p.wave_generator {
                let cam = drawn(&p, DrawnPart::WaveGenerator, &parts(NONE), tolerance_mm, 0.0).remove(0);
                for point in along_arcs(self::edges(&cam.outer)) {
                    let slope = 2.0 * (point.x / (a * a)).hypot(point.y / (b * b));
                    let off_mm = ((point.x / a).powi(2) + (point.y / b).powi(2) - 1.0).abs() / slope;
                    assert!(off_mm < tolerance_mm, "{off_mm} of {tolerance_mm}");
                }
            }
        }
    }
}

#[test]
fn eccentric_is_circle_about_its_own_centre() {
    let WaveGenerator::Eccentric { radius_mm: r, eccentricity_mm: e } = eccentric().wave_generator else { panic!() };
    for clearance_um in [0.0, 30.0] {
        let p = eccentric();
        let parts = PartsParameters { wave_generator_clearance_um: clearance_um, ..PartsParameters::default() };
        let cam = drawn(&p, DrawnPart::WaveGenerator, &parts, 1e-3, 0.0).remove(0);
        let [
            upper @ Edge::Arc { center_mm, radius_mm, sweep_deg, .. },
            lower @ Edge::Arc {
                center_mm: other_center_mm, radius_mm: other_radius_mm, sweep_deg: other_sweep_deg, ..
            },
        ] = edges(&cam.outer)
        else {
            panic!("{:?}", cam.outer)
        };
        let expected = ([e, 0.0], r - 1e-3 * clearance_um, 180.0);
        assert_eq!((*center_mm, *radius_mm, *sweep_deg), expected);
        assert_eq!((*other_center_mm, *other_radius_mm, *other_sweep_deg), expected);
        assert_eq!((upper.start(), lower.start()), ([e + expected.1, 0.0], [e - expected.1, 0.0]));
    }
}
