//! Profiles over HTTP against independently calculated curves.
//!
//! The service samples over the tooth's position ψ and inverts it for the cam's normal. Here the angle φ of that normal
//! is the parameter, so that nothing needs an inversion (docs/explanation/theory.md section 2).

use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{bored, shortest, undercut, with};

pub(crate) type Point = (f64, f64);

/// Parameters of a drive.
#[derive(Clone, Copy)]
struct Numbers {
    a: f64,
    b: f64,
    r: f64,
    ring_teeth: f64,
    tolerance_mm: f64,
}

impl Numbers {
    fn of(document: &Value) -> Self {
        let number = |pointer: &str| document.pointer(pointer).unwrap().as_f64().unwrap();
        Self {
            a: number("/drive/wave_generator/semi_major_mm"),
            b: number("/drive/wave_generator/semi_minor_mm"),
            r: number("/drive/teeth/radius_mm"),
            ring_teeth: number("/drive/ring/teeth"),
            tolerance_mm: document.pointer("/profile/chord_tolerance_mm").map_or(1e-3, |value| value.as_f64().unwrap()),
        }
    }

    /// Returns half the angle between two teeth of the ring.
    fn half_pitch(&self) -> f64 {
        PI / self.ring_teeth
    }

    /// Returns a tooth that touches the cam at the normal angle φ: ψ in degrees, centre, and contact on the ring.
    fn tooth(&self, phi: f64) -> (f64, Point, Point) {
        let (sin, cos) = phi.sin_cos();
        let h = (self.a * cos).hypot(self.b * sin);
        let slope = (self.b * self.b - self.a * self.a) * sin * cos / h;
        let d = (h + self.r).hypot(slope);
        let psi = phi + (slope / (h + self.r)).atan();
        let k = self.ring_teeth / 2.0;
        let beta = (-k * slope / (h + self.r)).atan();
        let center = polar(d, psi / k);
        let normal = polar(self.r, psi / k + beta);
        (psi.to_degrees(), center, (center.0 + normal.0, center.1 + normal.1))
    }

    /// Returns the normal angle of a tooth at ψ, by bisection.
    fn normal_angle(&self, psi_deg: f64) -> f64 {
        let (mut low, mut high) = (0.0, FRAC_PI_2);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if self.tooth(middle).0 < psi_deg { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

fn polar(radius: f64, angle: f64) -> Point {
    (radius * angle.cos(), radius * angle.sin())
}

fn angle(point: Point) -> f64 {
    point.1.atan2(point.0)
}

fn radius(point: Point) -> f64 {
    point.0.hypot(point.1)
}

fn distance(p: Point, q: Point) -> f64 {
    (p.0 - q.0).hypot(p.1 - q.1)
}

fn turned(point: Point, by: f64) -> Point {
    let (sin, cos) = by.sin_cos();
    (point.0 * cos - point.1 * sin, point.0 * sin + point.1 * cos)
}

fn points(profile: &Value) -> Vec<Point> {
    let column = |name: &str| -> Vec<f64> {
        profile[name].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
    };
    let (x, y) = (column("x_mm"), column("y_mm"));
    assert_eq!(x.len(), y.len());
    assert!(x.len() > 2);
    x.into_iter().zip(y).collect()
}

/// Returns the distance of a point from a polyline.
fn distance_from(polyline: &[Point], p: Point) -> f64 {
    let from_chord = |ends: &[Point]| {
        let (start, end) = (ends[0], ends[1]);
        let (dx, dy) = (end.0 - start.0, end.1 - start.1);
        let along = ((p.0 - start.0) * dx + (p.1 - start.1) * dy) / (dx * dx + dy * dy);
        let along = along.clamp(0.0, 1.0);
        distance(p, (start.0 + along * dx, start.1 + along * dy))
    };
    polyline.windows(2).map(from_chord).fold(f64::INFINITY, f64::min)
}

pub(crate) struct Geometry {
    numbers: Numbers,
    answer: Value,
    ring: Vec<Point>,
    path: Vec<Point>,
    cam: Vec<Point>,
}

pub(crate) async fn geometry(document: &Value) -> Geometry {
    let answer = Service::new().post("/v1/geometry", document).await.found();
    Geometry {
        numbers: Numbers::of(document),
        ring: points(&answer["ring"]["profile"]),
        path: points(&answer["tooth_center_path"]),
        cam: points(&answer["wave_generator"]["profile"]),
        answer,
    }
}

impl Geometry {
    fn start_deg(&self) -> f64 {
        self.answer["engagement"]["start_deg"].as_f64().unwrap()
    }

    fn tip_radius(&self) -> f64 {
        self.answer["ring"]["tip_radius_mm"].as_f64().unwrap()
    }

    /// Samples the ring's flank at positive angles, from the root.
    pub(crate) fn flank(&self, count: u32) -> Vec<Point> {
        let end = self.numbers.normal_angle(self.start_deg());
        (0..=count).map(|i| self.numbers.tooth(end * f64::from(i) / f64::from(count)).2).collect()
    }
}

fn profile(extent: &str, chord_tolerance_mm: f64) -> Value {
    json!({ "extent": extent, "chord_tolerance_mm": chord_tolerance_mm })
}

/// Returns a drive whose ring has few teeth, but more than the carrier.
fn reversed() -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 20.0, "semi_minor_mm": 18.5 },
            "teeth": { "count": 8, "radius_mm": 4.0, "width_mm": 10.0 },
            "ring": { "teeth": 10 }
        }
    })
}

/// Returns drives with a regular, an undercut and a bored tip, and one with few ring teeth.
fn drives() -> [Value; 4] {
    [shortest(), undercut(), bored(), reversed()]
}

/// Returns the drives at several tolerances.
fn drives_and_tolerances(extent: &str) -> Vec<Value> {
    let drives = drives();
    let with_tolerance =
        |tolerance| drives.iter().map(move |drive| with(drive, "/profile", profile(extent, tolerance)));
    [1e-4, 1e-2, 5.0].into_iter().flat_map(with_tolerance).collect()
}

#[tokio::test]
async fn tooth_profile_spans_its_two_symmetry_lines() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        let half = geometry.numbers.half_pitch();
        for curve in [&geometry.ring, &geometry.path] {
            let (first, last) = (curve[0], curve[curve.len() - 1]);
            for (end, expected) in [(first, -half), (last, half)] {
                assert!((angle(end) - expected).abs() <= 2e-16, "{} is not {expected}", angle(end));
            }
        }
    }
}

#[tokio::test]
async fn copies_rotated_by_one_tooth_join() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        for curve in [&geometry.ring, &geometry.path] {
            let copy = turned(curve[0], 2.0 * geometry.numbers.half_pitch());
            let gap = distance(copy, curve[curve.len() - 1]);
            assert!(gap <= 1e-12, "{gap:e} mm between a tooth and the next");
        }
    }
}

#[tokio::test]
async fn tooth_profile_is_mirror_symmetric() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        for curve in [&geometry.ring, &geometry.path] {
            for (point, mirrored) in curve.iter().zip(curve.iter().rev()) {
                assert_eq!((point.0, point.1), (mirrored.0, -mirrored.1));
            }
        }
    }
}

#[tokio::test]
async fn full_ring_is_closed_and_repeats_its_tooth() {
    for document in drives_and_tolerances("full") {
        let full = geometry(&document).await;
        let tooth = geometry(&with(&document, "/profile/extent", json!("tooth"))).await;
        let pitch = 2.0 * full.numbers.half_pitch();
        for (full, tooth) in [(&full.ring, &tooth.ring), (&full.path, &tooth.path)] {
            assert_eq!(full.first(), full.last(), "the last point is the first");
            let spans = tooth.len() - 1;
            let mut turn = 0.0;
            for (copy, points) in full.chunks(spans).enumerate() {
                for (point, original) in points.iter().zip(tooth) {
                    let gap = distance(*point, turned(*original, turn));
                    assert!(gap <= 1e-12 * radius(*original).max(1.0), "copy {copy}: {gap:e} mm");
                }
                turn += pitch;
            }
            let teeth = document["drive"]["ring"]["teeth"].as_u64().unwrap();
            assert_eq!(full.len() as u64, teeth * spans as u64 + 1);
        }
        assert_eq!(full.cam, tooth.cam, "the wave generator is closed either way");
    }
}

#[tokio::test]
async fn ring_runs_counter_clockwise_without_spikes() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        for curve in [&geometry.ring, &geometry.path] {
            for pair in curve.windows(2) {
                assert!(distance(pair[0], pair[1]) > 0.0, "the same point twice: {:?}", pair[0]);
                assert!(angle(pair[0]) < angle(pair[1]) + 1e-15, "back from {:?} to {:?}", pair[0], pair[1]);
            }
            let half = curve.len() / 2;
            for pair in curve[half..].windows(2) {
                assert!(radius(pair[0]) >= radius(pair[1]) - 1e-12, "out again from {:?} to {:?}", pair[0], pair[1]);
            }
        }
    }
}

#[tokio::test]
async fn reported_radii_are_those_of_profile() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        let radii: Vec<_> = geometry.ring.iter().map(|&point| radius(point)).collect();
        let (least, most) =
            (radii.iter().copied().fold(f64::INFINITY, f64::min), radii.iter().copied().fold(0.0, f64::max));
        let root = geometry.answer["ring"]["root_radius_mm"].as_f64().unwrap();
        assert!((least - geometry.tip_radius()).abs() <= 1e-12 * least, "{least} is not the tip radius");
        assert!((most - root).abs() <= 1e-12 * most, "{most} is not the root radius");
        assert_eq!(root, geometry.numbers.a + 2.0 * geometry.numbers.r);
        assert!(geometry.ring.contains(&(root, 0.0)), "the middle of the tooth space lies on the x axis");
    }
}

#[tokio::test]
async fn regular_tip_is_flat_at_known_radius() {
    for document in [shortest(), reversed()] {
        let geometry = geometry(&with(&document, "/profile", profile("tooth", 1e-6))).await;
        let Numbers { b, r, .. } = geometry.numbers;
        assert!((geometry.tip_radius() - (b + 2.0 * r)).abs() <= 1e-12);
        let (tip, before) = (geometry.ring[geometry.ring.len() - 1], geometry.ring[geometry.ring.len() - 2]);
        // The flank meets the symmetry line at a right angle, up to the length of the last chord.
        let inward = (radius(before) - radius(tip)) / distance(before, tip);
        assert!(inward.abs() < 0.05, "{inward}");
    }
}

#[tokio::test]
async fn undercut_tip_ends_in_point_on_symmetry_line() {
    let geometry = geometry(&with(&undercut(), "/profile", profile("tooth", 1e-6))).await;
    let Numbers { b, r, .. } = geometry.numbers;
    let tip = geometry.ring[geometry.ring.len() - 1];
    assert!(radius(tip) > b + 2.0 * r, "it is cut back");
    // The flank itself ends there, at ψ_e, without a land.
    let (_, _, end) = geometry.numbers.tooth(geometry.numbers.normal_angle(geometry.start_deg()));
    assert!(distance(end, tip) <= 1e-9, "{end:?} is not {tip:?}");
    // Along the symmetry line the last chord falls steeply inward, and its mirror image on the next tooth rises.
    let before = geometry.ring[geometry.ring.len() - 2];
    let steepness = (radius(before) - radius(tip)) / distance(before, tip);
    assert!(steepness > 0.5, "the two flanks meet in a blunt {steepness}");
}

#[tokio::test]
async fn bored_tip_has_land_on_bore_circle() {
    for tolerance in [1e-6, 1e-3, 1.0] {
        let geometry = geometry(&with(&bored(), "/profile", profile("tooth", tolerance))).await;
        assert_eq!(geometry.tip_radius(), 52.8227);
        let (_, _, end) = geometry.numbers.tooth(geometry.numbers.normal_angle(geometry.start_deg()));
        assert!((radius(end) - 52.8227).abs() <= 1e-9, "the flank ends on the bore circle");
        let land: Vec<_> =
            geometry.ring.iter().filter(|&&point| (radius(point) - 52.8227).abs() <= 1e-12 && point.1 > 0.0).collect();
        assert!(land.len() >= 2, "a land has two ends");
        assert!(distance(*land[0], end) <= 1e-9, "it begins where the flank ends");
        assert!(
            (angle(*land[land.len() - 1]) - geometry.numbers.half_pitch()).abs() <= 2e-16,
            "it ends on the symmetry line"
        );
        assert!(angle(*land[0]) < geometry.numbers.half_pitch() - 1e-3, "it is no point");
        for point in land.windows(2) {
            let sagitta = 52.8227 * (1.0 - (0.5 * (angle(*point[1]) - angle(*point[0]))).cos());
            assert!(sagitta <= tolerance, "{sagitta} mm");
        }
    }
}

#[tokio::test]
async fn ring_chords_keep_tolerance() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        let half: Vec<_> = geometry.ring.iter().copied().filter(|point| point.1 >= 0.0).collect();
        let farthest = geometry.flank(5_000).into_iter().map(|point| distance_from(&half, point)).fold(0.0, f64::max);
        assert!(farthest <= geometry.numbers.tolerance_mm, "{farthest} mm against {}", geometry.numbers.tolerance_mm);
    }
}

#[tokio::test]
async fn path_chords_keep_tolerance() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        let half: Vec<_> = geometry.path.iter().copied().filter(|point| point.1 >= 0.0).collect();
        let farthest = (0..=5_000)
            .map(|i| geometry.numbers.tooth(FRAC_PI_2 * f64::from(i) / 5_000.0).1)
            .map(|point| distance_from(&half, point))
            .fold(0.0, f64::max);
        assert!(farthest <= geometry.numbers.tolerance_mm, "{farthest} mm against {}", geometry.numbers.tolerance_mm);
    }
}

#[tokio::test]
async fn points_of_ring_and_path_lie_on_curves() {
    for document in drives() {
        let document = with(&document, "/profile", profile("tooth", 1e-3));
        let geometry = geometry(&document).await;
        // These chords are within 1e-9 mm of the curve.
        let flank = geometry.flank(50_000);
        let path: Vec<_> =
            (0..=50_000).map(|i| geometry.numbers.tooth(FRAC_PI_2 * f64::from(i) / 50_000.0).1).collect();
        for &point in geometry.ring.iter().filter(|point| point.1 >= 0.0) {
            let is_on_land = (radius(point) - geometry.tip_radius()).abs() <= 1e-12;
            assert!(
                is_on_land || distance_from(&flank, point) <= 1e-8,
                "{point:?} is {} mm away",
                distance_from(&flank, point)
            );
        }
        for &point in geometry.path.iter().filter(|point| point.1 >= 0.0) {
            assert!(distance_from(&path, point) <= 1e-8, "{point:?}");
        }
    }
}

#[tokio::test]
async fn ring_keeps_tooth_radius_from_path() {
    for document in drives() {
        let geometry = geometry(&with(&document, "/profile", profile("tooth", 1e-3))).await;
        let full: Vec<_> = (-2_000..=2_000)
            .map(|i| {
                let phi = FRAC_PI_2 * f64::from(i) / 2_000.0;
                let (_, center, _) = geometry.numbers.tooth(phi.abs());
                (center.0, if phi < 0.0 { -center.1 } else { center.1 })
            })
            .collect();
        for &point in &geometry.ring {
            let away = distance_from(&full, point);
            let is_on_land = (radius(point) - geometry.tip_radius()).abs() <= 1e-12;
            assert!(away >= geometry.numbers.r - 1e-6, "the tooth cuts into the ring at {point:?}: {away}");
            assert!(is_on_land || away <= geometry.numbers.r + 1e-6, "no tooth gets to {point:?}: {away}");
        }
    }
}

#[tokio::test]
async fn wave_generator_is_closed_ellipse_within_tolerance() {
    for document in drives_and_tolerances("tooth") {
        let geometry = geometry(&document).await;
        let Numbers { a, b, tolerance_mm, .. } = geometry.numbers;
        assert_eq!(geometry.cam.first(), geometry.cam.last());
        assert_eq!(geometry.cam[0], (a, 0.0), "x along the major axis");
        for &(x, y) in &geometry.cam {
            assert!(((x / a).powi(2) + (y / b).powi(2) - 1.0).abs() <= 1e-14, "({x}, {y})");
        }
        for axis_end in [(0.0, b), (-a, 0.0), (0.0, -b)] {
            assert!(distance_from(&geometry.cam, axis_end) <= 1e-12, "{axis_end:?}");
        }
        let half = &geometry.cam[..=geometry.cam.len() / 2];
        for (&(x, y), mirrored) in geometry.cam.iter().zip(geometry.cam.iter().rev()) {
            assert_eq!((x, -y), *mirrored, "about the major axis");
        }
        for (&(x, y), mirrored) in half.iter().zip(half.iter().rev()) {
            assert_eq!((-x, y), *mirrored, "about the minor axis");
        }
        let quarter = &half[..=half.len() / 2];
        let farthest = (0..=3_000)
            .map(|i| FRAC_PI_2 * f64::from(i) / 3_000.0)
            .map(|t| distance_from(quarter, (a * t.cos(), b * t.sin())))
            .fold(0.0, f64::max);
        assert!(farthest <= tolerance_mm, "{farthest} mm against {tolerance_mm}");
        let area: f64 = geometry.cam.windows(2).map(|p| 0.5 * (p[0].0 * p[1].1 - p[1].0 * p[0].1)).sum();
        assert!(area > 0.0, "counter-clockwise, all the way round once");
        assert!(area <= PI * a * b, "inscribed");
    }
}

#[tokio::test]
async fn finer_tolerance_takes_few_more_points_than_needed() {
    for document in drives() {
        let count =
            async |tolerance: f64| geometry(&with(&document, "/profile", profile("tooth", tolerance))).await.ring.len();
        let (coarse, fine) = (count(1e-4).await, count(1e-6).await);
        // A smooth arc needs ten times as many chords for a hundredth of the tolerance.
        assert!(fine > 4 * coarse && fine < 25 * coarse, "{coarse} and {fine} points");
    }
}
