//! Parts as they are made, and the space between them.

use std::f64::consts::PI;

use nalgebra::{Point2, Rotation2, Vector2};
use toothwave_solver::drawing::{Drawing, DrawingParameters, Edge, Outline, widest_finger};
use toothwave_solver::drive::Draft;
use toothwave_solver::findings;
use toothwave_solver::parts::{CarrierRadii, PartsParameters};
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::{
    Contact, Drive, DriveParameters, Finding, FindingCode, Modification, Never, Part, Position, Severity, SolveError,
    ToothShape, WaveGenerator,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, drawn_part, drive, ellipse};

/// Returns the first closed path of a part's section.
fn edges(parameters: &DriveParameters, part: Part, parts: &PartsParameters) -> Vec<Edge> {
    let drawing = DrawingParameters { chord_tolerance_mm: 1e-3, max_points: 1_000_000, input_angle_deg: 0.0 };
    let draft = Draft::new(parameters).unwrap();
    let drawing = Drawing::new(&draft, drawn_part(part), parts, &drawing).unwrap();
    let body = drawing.bodies(&Never).unwrap().remove(0);
    let outlines = std::iter::once(body.outer).chain(body.holes);
    outlines
        .into_iter()
        .find_map(|outline| match outline {
            Outline::Path { edges } => Some(edges),
            Outline::Circle { .. } => None,
        })
        .unwrap()
}

/// Returns the findings about a part as it is made.
fn findings_as_made(parameters: &DriveParameters, part: Part, parts: &PartsParameters) -> Vec<Finding> {
    let drawing = DrawingParameters { chord_tolerance_mm: 1e-3, max_points: 1_000_000, input_angle_deg: 0.0 };
    let draft = Draft::new(parameters).unwrap();
    Drawing::new(&draft, drawn_part(part), parts, &drawing).unwrap().findings().unwrap()
}

/// Returns where a wall of slot 0 meets a circle, and the mirror image at the wall of slot 1.
fn on_both_walls(radius_mm: f64, wall_mm: f64, installed: i64) -> [Point2<f64>; 2] {
    let near = Point2::new((radius_mm * radius_mm - wall_mm * wall_mm).sqrt(), wall_mm);
    let to_next = Rotation2::new(2.0 * PI / installed as f64);
    [near, to_next * Point2::new(near.x, -near.y)]
}

#[test]
fn slot_wall_thickness_is_distance_at_inner_circle() {
    for (tooth_radius_mm, is_wall) in [(5.0, true), (2.0, true), (7.0, false)] {
        let p = DriveParameters { tooth_radius_mm, ..PAPER_5_1 };
        let [near, next] = on_both_walls(58.0, tooth_radius_mm, p.installed);
        // Beyond the line between the slots the wall thickness is negative.
        let between = Rotation2::new(PI / 28.0).inverse() * near;
        let wall = (near - next).norm().copysign(-between.y);
        let found = drive(&p).slot_wall_mm();
        assert!((found - wall).abs() < 1e-12 * 58.0, "{found} is not {wall}");
        assert_eq!(found > 0.0, is_wall);
    }
}

#[test]
fn default_carrier_leaves_tenth_of_annulus_free() {
    let radii: Vec<_> = edges(&PAPER_5_1, Part::Carrier, &PartsParameters::default())
        .into_iter()
        .filter_map(|edge| match edge {
            Edge::Arc { radius_mm, .. } => Some(radius_mm),
            Edge::Line { .. } | Edge::Curve { .. } => None,
        })
        .collect();
    // From a = 58 to b + 2r = 66.
    let [outer, inner] = radii[..] else { panic!("{radii:?}") };
    assert!((outer - 65.2).abs() < 1e-12 && (inner - 58.8).abs() < 1e-12, "{radii:?}");
}

#[test]
fn tooth_presses_carrier_edge_outside_annulus() {
    let edges = |tooth_radius_mm| -> Vec<_> {
        let found = findings::of_drive(&drive(&DriveParameters { tooth_radius_mm, ..PAPER_5_1 })).unwrap();
        let edges = found.iter().filter(|finding| finding.code == FindingCode::ToothBeyondCarrier);
        edges.map(|finding| (finding.value, finding.limit)).collect()
    };
    // Centres run from 56 + r to 58 + r, the annulus from 58 to 56 + 2r.
    assert_eq!(edges(2.1), []);
    assert_eq!(edges(1.5), [(57.5, 58.0), (59.5, 59.0)]);
}

#[test]
fn pointed_finger_ends_where_slot_walls_meet() {
    let p = DriveParameters { tooth_radius_mm: 7.0, ..PAPER_5_1 };
    let finger = edges(&p, Part::Carrier, &PartsParameters::default());
    let [to_rim @ Edge::Line { .. }, Edge::Arc { .. }, to_apex @ Edge::Line { .. }] = &finger[..] else {
        panic!("{finger:?}")
    };
    let [apex, outer] = [to_rim.start(), to_rim.end()].map(Point2::from);
    assert_eq!(to_apex.end(), to_rim.start());
    // On the wall of slot 0, and equally far from the middle of slot 1.
    assert!((apex.y - 7.0).abs() < 1e-12 && (outer.y - 7.0).abs() < 1e-12);
    let from_next = Rotation2::new(-2.0 * PI / 28.0) * apex;
    assert!((from_next.y + 7.0).abs() < 1e-12, "{from_next}");
    assert!((apex.y.atan2(apex.x) - PI / 28.0).abs() < 1e-14);
}

#[test]
fn wave_generator_curves_join_and_end_radially() {
    for wave_generator in [
        PAPER_5_1.wave_generator,
        WaveGenerator::HarmonicPath { lobes: 3, mean_path_radius_mm: 63.0, amplitude_mm: 1.0 },
        WaveGenerator::HarmonicPath { lobes: 1, mean_path_radius_mm: 63.0, amplitude_mm: 1.0 },
    ] {
        let ring_teeth = 28 - wave_generator.lobes();
        let p = DriveParameters { wave_generator, ring_teeth, ..PAPER_5_1 };
        let outline = edges(&p, Part::WaveGenerator, &PartsParameters::default());
        for (edge, next) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let Edge::Curve { start_tangent_deg, end_tangent_deg, .. } = edge else { panic!("{edge:?}") };
            for (point, tangent_deg) in [(edge.start(), start_tangent_deg), (edge.end(), end_tangent_deg)] {
                // Counter-clockwise.
                let point = Point2::from(point);
                let ahead = Rotation2::new(0.5 * PI) * (point.coords / point.coords.norm());
                let tangent = Rotation2::new(tangent_deg.to_radians()) * Vector2::x();
                assert!((ahead - tangent).norm() < 1e-14, "{tangent:?} at {point}");
            }
            assert_eq!(edge.end(), next.start());
        }
    }
}

#[test]
fn bore_must_leave_some_wave_generator() {
    let draft = Draft::new(&PAPER_5_1).unwrap();
    // Least radius 56 mm, minus a clearance of 0.25 mm and an offset of 0.5 mm.
    let modification = Modification { wave_generator_equidistant_um: 500.0, ..Modification::default() };
    let is_possible = |bore_mm| {
        let bore_radius_mm = Some(bore_mm);
        let parts =
            PartsParameters { bore_radius_mm, wave_generator_clearance_um: 250.0, modification, ..Default::default() };
        parts.violations(Part::WaveGenerator, &draft).is_empty()
    };
    assert!(is_possible(55.249) && !is_possible(55.25) && !is_possible(56.0));
}

/// The limit is the smaller of the least radius of curvature and the least radius. Beyond it the outline inverts.
#[test]
fn greatest_cam_clearance_is_least_radius() {
    for (wave_generator, least_mm) in [
        (ellipse(58.0, 40.0), None),
        (WaveGenerator::Harmonic { lobes: 3, mean_radius_mm: 57.0, amplitude_mm: 1.0 }, None),
        (WaveGenerator::HarmonicPath { lobes: 3, mean_path_radius_mm: 63.0, amplitude_mm: 1.0 }, None),
        (WaveGenerator::HarmonicPath { lobes: 1, mean_path_radius_mm: 63.0, amplitude_mm: 5.0 }, Some(53.0)),
        (WaveGenerator::Eccentric { radius_mm: 57.0, eccentricity_mm: 1.0 }, Some(56.0)),
    ] {
        let lobes = wave_generator.lobes();
        let p = DriveParameters { wave_generator, ring_teeth: 28 - lobes, ..PAPER_5_1 };
        let draft = Draft::new(&p).unwrap();
        let drive = draft.drive().unwrap_or_else(|| panic!("{p:?}: {:?}", draft.violations()));
        let sharpest_mm = (0..=2000)
            .map(|i| Position::from_lobe(PI / lobes as f64 * f64::from(i) / 2000.0, drive.lobes()))
            .map(|position| 1.0 / drive.flank().locus().at(position).unwrap().cam_curvature_per_mm)
            .filter(|&radius_mm| radius_mm > 0.0)
            .fold(f64::INFINITY, f64::min);
        let expected_um = 1e3 * least_mm.unwrap_or(sharpest_mm);
        let is_possible = |wave_generator_clearance_um| {
            let parts = PartsParameters { wave_generator_clearance_um, ..PartsParameters::default() };
            parts.violations(Part::WaveGenerator, &draft).is_empty()
        };
        assert!(
            is_possible(expected_um * (1.0 - 1e-6)) && !is_possible(expected_um * (1.0 + 1e-6)),
            "{p:?} {expected_um}"
        );
    }
}

#[test]
fn widest_finger_fills_annulus_between_slots() {
    let finger = widest_finger(&drive(&PAPER_5_1)).unwrap();
    let corners: Vec<_> = finger.iter().map(|edge| Point2::from(edge.start())).collect();
    let ([inner, inner_next], [outer, outer_next]) = (on_both_walls(58.0, 5.0, 28), on_both_walls(66.0, 5.0, 28));
    assert_eq!(corners.len(), 4);
    for (found, expected) in corners.into_iter().zip([inner, outer, outer_next, inner_next]) {
        assert!((found - expected).norm() < 1e-12 * 66.0, "{found} is not {expected}");
    }
}

#[test]
fn flat_sided_tooth_is_two_arcs_and_flats() {
    let tooth = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 6.0 };
    let p = DriveParameters { tooth, ..PAPER_5_1 };
    let outline = edges(&p, Part::Teeth, &PartsParameters::default());
    let [right @ Edge::Arc { .. }, upper @ Edge::Line { .. }, left @ Edge::Arc { .. }, lower @ Edge::Line { .. }] =
        &outline[..]
    else {
        panic!("{outline:?}")
    };
    // Radius 5 with flats of length 6: corners at (±3, ±4).
    let corners = [(3.0, -4.0), (3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0)].map(|(x, y)| Point2::new(x, y));
    for (i, edge) in [right, upper, left, lower].into_iter().enumerate() {
        assert!((Point2::from(edge.start()) - corners[i]).norm() < 1e-14 * 5.0, "{edge:?}");
        assert!((Point2::from(edge.end()) - corners[(i + 1) % 4]).norm() < 1e-14 * 5.0, "{edge:?}");
    }
    for arc in [right, left] {
        let &Edge::Arc { radius_mm, sweep_deg, .. } = arc else { panic!("{arc:?}") };
        assert_eq!(radius_mm, 5.0);
        assert!((sweep_deg.to_radians() - 2.0 * 4_f64.atan2(3.0)).abs() < 1e-14, "{sweep_deg}");
    }
}

#[test]
fn clearance_undercuts_ring_by_offset_from_path() {
    let critical = drive(&PAPER_5_1).flank().critical_tooth_radius_mm().unwrap();
    let p = DriveParameters { tooth_radius_mm: 0.999 * critical, ..PAPER_5_1 };
    assert_eq!(drive(&p).flank_limit().end, FlankEnd::RegularTip);
    let (a, b, r, k) = (58.0, 56.0, p.tooth_radius_mm, 13.0);
    // (b + r)(1 + (r + c)κ) = b + 2r + c - (r + c) k² (a² - b²)/(a² + br) at the tip.
    let narrowing = k * k * (a * a - b * b) / (a * a + b * r);
    let most_um = 1e3 * (b + 2.0 * r - r * narrowing) / (narrowing - 1.0);
    let tip_mm = |clearance_um| {
        let parts = PartsParameters { ring_clearance_um: clearance_um, ..PartsParameters::default() };
        let ring = edges(&p, Part::Ring, &parts);
        let tip = Point2::from(ring[0].start());
        tip.coords.norm() - (b + 2.0 * r + 1e-3 * clearance_um)
    };
    // A regular tip stands at b + 2r + c; the flanks of an undercut one meet farther out.
    assert!(tip_mm(0.5 * most_um).abs() < 1e-10);
    assert!(tip_mm(20.0 * most_um) > 1e-6, "{}", tip_mm(20.0 * most_um));
}

#[test]
fn bore_at_undercut_tip_keeps_flank_end() {
    let mut tried = 0;
    for tenth_um in 1..400_u32 {
        let unbored = DriveParameters { tooth_radius_mm: 0.7 + 1e-3 * f64::from(tenth_um), ..PAPER_5_2 };
        let Ok(natural) = Drive::new(&unbored) else { continue };
        assert_eq!(natural.flank_limit().end, FlankEnd::Undercut);
        let tip = natural.ring_tooth().natural_tip_radius_mm.to_bits();
        for tip_radius_mm in (tip..tip + 4).map(f64::from_bits) {
            let bored = drive(&DriveParameters { tip_radius_mm: Some(tip_radius_mm), ..unbored });
            let (found, end) = (bored.flank_limit().position, natural.flank_limit().position);
            assert!(found.from_valley_rad >= end.from_valley_rad, "{tip_radius_mm} on {unbored:?}");
            tried += 1;
        }
    }
    assert!(tried > 1000, "{tried}");
}

#[test]
fn undercut_by_clearance_reports_critical_distance() {
    let critical = drive(&PAPER_5_1).flank().critical_tooth_radius_mm().unwrap();
    let p = DriveParameters { tooth_radius_mm: 0.999 * critical, ..PAPER_5_1 };
    let (a, b, r, k) = (58.0, 56.0, p.tooth_radius_mm, 13.0);
    // As above: at this clearance the flank's radius of curvature at the tip is zero.
    let narrowing = k * k * (a * a - b * b) / (a * a + b * r);
    let most_um = 1e3 * (b + 2.0 * r - r * narrowing) / (narrowing - 1.0);
    let of = |parameters: &DriveParameters, ring_clearance_um| {
        let parts = PartsParameters { ring_clearance_um, ..PartsParameters::default() };
        findings_as_made(parameters, Part::Ring, &parts)
    };
    assert_eq!(of(&p, 0.999 * most_um), []);
    let found = of(&p, 1.001 * most_um);
    let [Finding { code, value: distance_mm, limit: critical_distance_mm, .. }] = found[..] else {
        panic!("{found:?}")
    };
    assert_eq!(code, FindingCode::ClearanceUndercutsRing);
    assert!((distance_mm - (r + 1.001e-3 * most_um)).abs() < 1e-12);
    assert!((critical_distance_mm - (r + 1e-3 * most_um)).abs() < 1e-9, "{critical_distance_mm} at {most_um} µm");
    // An undercut without the clearance gives no finding about it.
    assert_eq!(of(&PAPER_5_2, 1.0), []);
}

#[test]
fn wall_below_quarter_of_slot_width_is_thin() {
    // Slots of 10 mm; the ring's root at 58 + 2 · 5, the cam's least radius 56.
    for (thickness_mm, is_thin) in [(2.499, true), (2.501, false)] {
        let rim = PartsParameters { ring_outer_radius_mm: Some(68.0 + thickness_mm), ..PartsParameters::default() };
        let bore = PartsParameters { bore_radius_mm: Some(56.0 - thickness_mm), ..PartsParameters::default() };
        for (part, parts, wall) in
            [(Part::Ring, rim, Contact::Ring), (Part::WaveGenerator, bore, Contact::WaveGenerator)]
        {
            let found = findings_as_made(&PAPER_5_1, part, &parts);
            match found[..] {
                [Finding { code: FindingCode::ThinWallAsMade, value: wall_mm, limit, contact, .. }] if is_thin => {
                    assert_eq!((contact, limit), (Some(wall), 2.5));
                    assert!((wall_mm - thickness_mm).abs() < 1e-12, "{wall_mm}");
                }
                ref others => assert!(others.is_empty() && !is_thin, "{others:?}"),
            }
        }
    }
    let undercut_cam = PartsParameters {
        bore_radius_mm: Some(53.0),
        wave_generator_clearance_um: 600.0,
        ..PartsParameters::default()
    };
    let found = findings_as_made(&PAPER_5_1, Part::WaveGenerator, &undercut_cam);
    let [Finding { code: FindingCode::ThinWallAsMade, value: wall_mm, .. }] = found[..] else { panic!("{found:?}") };
    assert!((wall_mm - 2.4).abs() < 1e-12, "{wall_mm}");
}

#[test]
fn tooth_leaves_slot_with_short_walls() {
    // A wall 5 mm from the slot's middle ends √(R² - 25) from the axis. Centres run from 61 mm to 63 mm, loaded too.
    let wall_end_mm = |radius_mm: f64| (radius_mm * radius_mm - 25.0_f64).sqrt();
    let of = |inner_mm, outer_mm| {
        let parts = PartsParameters {
            carrier: CarrierRadii { inner_mm: Some(inner_mm), outer_mm: Some(outer_mm) },
            ..PartsParameters::default()
        };
        findings_as_made(&PAPER_5_1, Part::Carrier, &parts)
    };
    // Between 60.9 and 63.1 the wall holds all teeth.
    let (enough_inner, enough_outer) = (60.9_f64.hypot(5.0), 63.1_f64.hypot(5.0));
    assert_eq!(of(enough_inner, enough_outer), []);
    for (found, center_mm, radius_mm) in [
        (of(61.1_f64.hypot(5.0), enough_outer), 61.0, 61.1_f64.hypot(5.0)),
        (of(enough_inner, 62.9_f64.hypot(5.0)), 63.0, 62.9_f64.hypot(5.0)),
    ] {
        let [Finding { code, severity, value: center_radius_mm, limit: end_mm, .. }] = found[..] else {
            panic!("{found:?}")
        };
        assert_eq!((code, severity), (FindingCode::ToothLeavesSlot, Severity::Warning));
        assert!((center_radius_mm - center_mm).abs() < 1e-9 && (end_mm - wall_end_mm(radius_mm)).abs() < 1e-12);
    }
}

#[test]
fn outline_with_one_chord_too_many_is_refused() {
    for (parameters, part) in [(PAPER_5_1, Part::Ring), (PAPER_5_2, Part::Ring), (PAPER_5_1, Part::WaveGenerator)] {
        let chords = |edge: &Edge| match edge {
            Edge::Curve { x_mm, .. } => x_mm.len() as u64 - 1,
            Edge::Line { .. } | Edge::Arc { .. } => 0,
        };
        let count: u64 = edges(&parameters, part, &PartsParameters::default()).iter().map(chords).sum();
        let of_most = |max_points| {
            let drawing = DrawingParameters { chord_tolerance_mm: 1e-3, max_points, input_angle_deg: 0.0 };
            let draft = Draft::new(&parameters).unwrap();
            Drawing::new(&draft, drawn_part(part), &PartsParameters::default(), &drawing).unwrap().bodies(&Never)
        };
        assert!(of_most(count).is_ok(), "{count} chords of {part:?}");
        let refused = of_most(count - 1).unwrap_err();
        assert!(
            matches!(refused, SolveError::TooManyPoints { points, .. } if points == count),
            "{refused:?}, not {count}, of {part:?}"
        );
    }
}
