//! Sampled profiles: chord tolerance, closure and joints.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{Point2, Rotation2, Vector2};
use proptest::prelude::*;
use toothwave_solver::profile::{Extent, Polyline, ProfileParameters, Profiles, expected_points, profiles};
use toothwave_solver::{DriveParameters, Never, SolveError, Stop, ToothShape, WaveGenerator};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_drive, cases, drive, semi_axes_mm};
use crate::family::any_of_the_family;

fn sampled(parameters: &DriveParameters, chord_tolerance_mm: f64, extent: Extent) -> Profiles {
    let request = ProfileParameters { chord_tolerance_mm, extent, max_points: 10_000_000 };
    profiles(&drive(parameters), &request, &Never).unwrap()
}

/// Returns the distance of a point from the nearest segment of a polyline.
fn distance_mm(point: &Point2<f64>, polyline: &Polyline) -> f64 {
    let to_segment = |pair: &[Point2<f64>]| {
        let along = pair[1] - pair[0];
        let share = ((point - pair[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (point - (pair[0] + along * share)).norm()
    };
    polyline.windows(2).map(to_segment).fold(f64::INFINITY, f64::min)
}

/// Returns the largest distance of the fine polyline from the coarse one.
fn deviation_mm(fine: &Polyline, coarse: &Polyline) -> f64 {
    fine.iter().step_by(7).map(|point| distance_mm(point, coarse)).fold(0.0, f64::max)
}

fn unit(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(angle_rad.cos(), angle_rad.sin())
}

/// Samples ring, path and cam from root and lobe on, by closed forms over the cam's normal, or over ψ on a given path.
fn closed_forms(p: &DriveParameters) -> [Polyline; 3] {
    let (r, lobes) = (p.tooth_radius_mm, p.wave_generator.lobes() as f64);
    let k = p.ring_teeth as f64 / lobes;
    let end_rad = drive(p).flank_limit().position.from_lobe_rad;
    let mut curves = [const { Vec::new() }; 3];
    for i in 0..=1500 {
        let angle = PI / lobes * f64::from(i) / 1500.0;
        let support = match p.wave_generator {
            WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } => {
                let n = unit(angle);
                let h = (a * n.x).hypot(b * n.y);
                Ok((h, (b * b - a * a) * n.x * n.y / h))
            }
            WaveGenerator::Eccentric { radius_mm, eccentricity_mm: e } => {
                Ok((radius_mm + e * angle.cos(), -e * angle.sin()))
            }
            WaveGenerator::Harmonic { mean_radius_mm, amplitude_mm: e, .. } => {
                Ok((mean_radius_mm + e * (lobes * angle).cos(), -e * lobes * (lobes * angle).sin()))
            }
            WaveGenerator::HarmonicPath { mean_path_radius_mm, amplitude_mm: e, .. } => {
                Err((mean_path_radius_mm + e * (lobes * angle).cos(), e * lobes * (lobes * angle).sin()))
            }
            other => panic!("no profile of {other:?}"),
        };
        let (psi, d, tan, normal) = match support {
            Ok((h, slope)) => {
                let tan = -slope / (h + r);
                (angle - tan.atan(), (h + r).hypot(slope), tan, angle)
            }
            Err((d, drop)) => (angle, d, drop / d, angle + (drop / d).atan()),
        };
        let in_ring = d * unit(psi / k);
        if psi <= end_rad {
            curves[0].push(Point2::from(in_ring + r * unit(psi / k + (k * tan).atan())));
        }
        curves[1].push(Point2::from(in_ring));
        curves[2].push(Point2::from(d * unit(psi) - r * unit(normal)));
    }
    curves
}

/// Returns the largest distances of ring, path and cam from the chords, over the tolerance.
fn deviations_over_tolerance(p: &DriveParameters, curves: &[Polyline; 3], tolerance_mm: f64) -> [f64; 3] {
    let profiles = sampled(p, tolerance_mm, Extent::Tooth);
    let from_middle = |curve: &Polyline| curve[curve.len() / 2..].to_vec();
    let of_half_lobe = (profiles.wave_generator.len() - 1) / (2 * usize::try_from(p.wave_generator.lobes()).unwrap());
    let chords = [
        from_middle(&profiles.ring),
        from_middle(&profiles.tooth_center_path),
        profiles.wave_generator[..=of_half_lobe].to_vec(),
    ];
    std::array::from_fn(|i| {
        // Both curves have the same direction, so the search for a nearest chord starts at the previous one.
        let mut nearest = 0;
        let mut worst_mm = 0.0_f64;
        for point in &curves[i] {
            let last = (nearest + 40).min(chords[i].len() - 1);
            let near: Vec<_> = (nearest..last).map(|j| distance_mm(point, &chords[i][j..=j + 1].to_vec())).collect();
            let best = (0..near.len()).min_by(|&a, &b| near[a].total_cmp(&near[b])).unwrap();
            worst_mm = worst_mm.max(near[best]);
            nearest += best;
        }
        worst_mm / tolerance_mm
    })
}

/// True if the deviation is within tolerance and rounding.
fn is_true(deviation_over_tolerance: f64) -> bool {
    deviation_over_tolerance <= 1.0 + 1e-6
}

/// Exponents of relative tolerances. Below them, closed forms are sampled too coarsely to test each chord.
const RELATIVE_TOLERANCES: std::ops::Range<f64> = -6.0..-2.5;

proptest! {
    #![proptest_config(cases(192))]

    #[test]
    fn chords_keep_tolerance_at_every_point(
        p in any_of_the_family(),
        exponents in prop::collection::vec(RELATIVE_TOLERANCES, 12),
    ) {
        let curves = closed_forms(&p);
        for exponent in exponents {
            let tolerance_mm = 10.0_f64.powf(exponent) * p.tooth_radius_mm;
            let found = deviations_over_tolerance(&p, &curves, tolerance_mm);
            prop_assert!(found.into_iter().all(is_true), "{found:?} at {tolerance_mm} mm");
        }
    }
}

/// Both end tangents then lie on the same side of the chord.
#[test]
fn chord_with_inflection_near_end_keeps_tolerance() {
    let p = DriveParameters {
        wave_generator: WaveGenerator::HarmonicPath {
            lobes: 2,
            mean_path_radius_mm: 67.416_168_989_479_36,
            amplitude_mm: 6.566_526_084_734_569,
        },
        teeth: 8,
        installed: 8,
        tooth_radius_mm: 12.363_288_155_453_837,
        tooth: ToothShape::Cylinder { width_mm: 32.0 },
        ring_teeth: 6,
        tip_radius_mm: None,
    };
    let curves = closed_forms(&p);
    for tolerance_mm in [0.000_550_598_576_292_938, 0.000_74, 0.001] {
        let found = deviations_over_tolerance(&p, &curves, tolerance_mm);
        assert!(found.into_iter().all(is_true), "{found:?} at {tolerance_mm} mm");
    }
}

/// The tangents of a chord over angle θ meet at height `c tan(θ/2)/2`. Spacing differs from the circle's by per cent.
#[test]
fn circle_is_bisected_until_tangent_triangles_fit() {
    let radius_mm = 57.0;
    let wave_generator = WaveGenerator::Eccentric { radius_mm, eccentricity_mm: 1.0 };
    let p = DriveParameters { wave_generator, ring_teeth: 27, ..PAPER_5_1 };
    for chords in [32_u16, 64, 256, 1024] {
        let half_rad = 0.5 * PI / f64::from(chords);
        let height_mm = 0.5 * (2.0 * radius_mm * half_rad.sin()) * half_rad.tan();
        let points = |tolerance_mm| sampled(&p, tolerance_mm, Extent::Tooth).wave_generator.len();
        assert_eq!(
            [1.3, 0.7].map(|of| points(of * height_mm)),
            [1, 2].map(|times| 2 * times * usize::from(chords) + 1)
        );
    }
}

#[test]
fn every_chord_keeps_the_tolerance() {
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        for tolerance in [0.1, 0.01, 0.001] {
            let (coarse, fine) = (
                sampled(&parameters, tolerance, Extent::Tooth),
                sampled(&parameters, tolerance / 400.0, Extent::Tooth),
            );
            // The fine curve has an error of 1/400 itself.
            let allowed = tolerance * (1.0 + 1.0 / 400.0);
            assert!(deviation_mm(&fine.ring, &coarse.ring) <= allowed);
            assert!(deviation_mm(&fine.tooth_center_path, &coarse.tooth_center_path) <= allowed);
            assert!(deviation_mm(&fine.wave_generator, &coarse.wave_generator) <= allowed);
        }
    }
}

proptest! {
    #![proptest_config(cases(96))]

    #[test]
    fn profile_has_at_most_expected_points(parameters in any_drive(), tolerance in -6..0_i32, is_full in any::<bool>()) {
        let extent = if is_full { Extent::Full } else { Extent::Tooth };
        let chord_tolerance_mm = 10.0_f64.powi(tolerance) * parameters.tooth_radius_mm;
        let drive = drive(&parameters);
        let request = ProfileParameters { chord_tolerance_mm, extent, max_points: 100_000_000 };
        let profiles = profiles(&drive, &request, &Never).unwrap();
        let points: usize = [&profiles.ring, &profiles.tooth_center_path, &profiles.wave_generator].iter().map(|curve| curve.len()).sum();
        let expected = expected_points(&drive, &request);
        prop_assert!(expected >= points as u64 && expected < 12 * points as u64, "{expected}, not {points}");
    }

    #[test]
    fn teeth_join_and_ring_closes(parameters in any_drive()) {
        let p = &parameters;
        let tooth = sampled(p, 1e-3 * p.tooth_radius_mm, Extent::Tooth).ring;
        let (first, last) = (tooth[0], tooth[tooth.len() - 1]);
        let tip_rad = PI / p.ring_teeth as f64;
        prop_assert!((first.y.atan2(first.x) + tip_rad).abs() < 1e-15);
        prop_assert!((last.y.atan2(last.x) - tip_rad).abs() < 1e-15);
        let turned = Rotation2::new(2.0 * tip_rad) * first;
        prop_assert!((turned - last).norm() < 1e-12 * semi_axes_mm(p).0);
        let full = sampled(p, 1e-3 * p.tooth_radius_mm, Extent::Full);
        for curve in [&full.ring, &full.tooth_center_path, &full.wave_generator] {
            prop_assert_eq!(curve.first(), curve.last());
        }
        prop_assert!(full.ring.windows(2).all(|pair| pair[0] != pair[1]), "no point stands twice in a row");
    }

    #[test]
    fn flank_runs_monotonically_without_spikes(parameters in any_drive()) {
        let drive = drive(&parameters);
        let tooth = sampled(&parameters, 1e-3 * parameters.tooth_radius_mm, Extent::Tooth).ring;
        let half = &tooth[tooth.len() / 2..];
        prop_assert!((half[0] - Point2::new(drive.root_radius_mm(), 0.0)).norm() < 1e-15 * drive.root_radius_mm() * 2.0);
        let last = half[half.len() - 1];
        prop_assert!((last.coords.norm() - drive.tip_radius_mm()).abs() < 1e-14 * drive.root_radius_mm());
        for pair in half.windows(2) {
            let slack = 1e-12 * drive.root_radius_mm();
            prop_assert!(pair[1].coords.norm() <= pair[0].coords.norm() + slack);
            prop_assert!(pair[1].y.atan2(pair[1].x) >= pair[0].y.atan2(pair[0].x) - 1e-12);
        }
    }
}

#[test]
fn full_profiles_repeat_and_generator_is_ellipse() {
    for parameters in [PAPER_5_1, PAPER_5_2_BORED] {
        let all = sampled(&parameters, 1e-2, Extent::Full);
        let (a, b) = semi_axes_mm(&parameters);
        let quadrants: BTreeSet<_> = all.wave_generator.iter().map(|point| (point.x > 0.0, point.y > 0.0)).collect();
        assert_eq!(quadrants.len(), 4);
        for point in &all.wave_generator {
            assert!(((point.x / a).powi(2) + (point.y / b).powi(2) - 1.0).abs() < 1e-13, "{point} is on no ellipse");
        }
        let tooth = Rotation2::new(2.0 * PI / parameters.ring_teeth as f64);
        for curve in [&all.ring, &all.tooth_center_path] {
            let step = (curve.len() - 1) / usize::try_from(parameters.ring_teeth).unwrap();
            for (point, next) in curve.iter().zip(&curve[step..]) {
                assert!((tooth * point - next).norm() < 1e-12 * a, "{point} is not followed by {next}");
            }
        }
    }
}

#[test]
fn bored_tip_has_land_on_bore() {
    let ring = sampled(&PAPER_5_2_BORED, 1e-7, Extent::Tooth).ring;
    let on_land = ring.iter().filter(|point| (point.coords.norm() - 52.8227).abs() < 1e-12).count();
    assert!(on_land > 4, "{on_land} points");
}

#[test]
fn profile_with_too_many_points_reports_their_number() {
    let request = ProfileParameters { chord_tolerance_mm: 1e-3, extent: Extent::Full, max_points: 1000 };
    let refused = profiles(&drive(&PAPER_5_1), &request, &Never).unwrap_err();
    assert!(matches!(refused, SolveError::TooManyPoints { points, limit: 1000 } if points > 1000));
}

/// A stop flag that counts the bisections of chords.
#[derive(Default)]
struct Halvings(AtomicU64);

impl Stop for Halvings {
    fn stopped(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed);
        false
    }
}

#[test]
fn far_too_large_profile_is_abandoned_early() {
    let halvings = Halvings::default();
    let request = ProfileParameters { chord_tolerance_mm: 1e-13, extent: Extent::Tooth, max_points: 1000 };
    let refused = profiles(&drive(&PAPER_5_1), &request, &halvings).unwrap_err();
    assert!(matches!(refused, SolveError::TooManyPoints { points: 1001, limit: 1000 }), "{refused:?}");
    // Each chord takes one bisection, and the last one some more.
    let halvings = halvings.0.into_inner();
    assert!(halvings < 1100, "{halvings}");
}

#[test]
fn profile_with_one_point_too_many_is_refused() {
    for (parameters, extent) in
        [(PAPER_5_1, Extent::Tooth), (PAPER_5_1, Extent::Full), (PAPER_5_2, Extent::Full), (PAPER_5_2, Extent::Tooth)]
    {
        let all = sampled(&parameters, 1e-2, extent);
        let count =
            [&all.ring, &all.tooth_center_path, &all.wave_generator].iter().map(|curve| curve.len() as u64).sum();
        let of_most = |max_points| {
            let request = ProfileParameters { chord_tolerance_mm: 1e-2, extent, max_points };
            profiles(&drive(&parameters), &request, &Never)
        };
        assert!(of_most(count).is_ok(), "{count} points of {extent:?}");
        let refused = of_most(count - 1).unwrap_err();
        assert!(
            matches!(refused, SolveError::TooManyPoints { points, .. } if points == count),
            "{refused:?}, not {count}"
        );
    }
}
