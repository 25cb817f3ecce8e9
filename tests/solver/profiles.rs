//! The sampled profiles: true to the chord tolerance, closed, joining.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{Point2, Rotation2};
use proptest::prelude::*;
use toothwave_solver::profile::{Extent, Polyline, ProfileParameters, Profiles, expected_points, profiles};
use toothwave_solver::{DriveParameters, Never, SolveError, Stop};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_drive, cases, drive, semi_axes_mm};

fn sampled(parameters: &DriveParameters, chord_tolerance_mm: f64, extent: Extent) -> Profiles {
    let request = ProfileParameters { chord_tolerance_mm, extent, max_points: 10_000_000 };
    profiles(&drive(parameters), &request, &Never).unwrap()
}

/// Distance of a point from a polyline's nearest segment.
fn distance_mm(point: &Point2<f64>, polyline: &Polyline) -> f64 {
    let to_segment = |pair: &[Point2<f64>]| {
        let along = pair[1] - pair[0];
        let share = ((point - pair[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (point - (pair[0] + along * share)).norm()
    };
    polyline.windows(2).map(to_segment).fold(f64::INFINITY, f64::min)
}

/// The farthest that the fine polyline strays from the coarse one.
fn deviation_mm(fine: &Polyline, coarse: &Polyline) -> f64 {
    fine.iter().step_by(7).map(|point| distance_mm(point, coarse)).fold(0.0, f64::max)
}

#[test]
fn every_chord_is_true_to_the_tolerance() {
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        for tolerance in [0.1, 0.01, 0.001] {
            let (coarse, fine) = (
                sampled(&parameters, tolerance, Extent::Tooth),
                sampled(&parameters, tolerance / 400.0, Extent::Tooth),
            );
            // The fine curve is itself a 400th off.
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
    fn a_profile_has_no_more_points_than_are_expected(parameters in any_drive(), tolerance in -6..0_i32, is_full in any::<bool>()) {
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
    fn teeth_join_and_the_ring_closes(parameters in any_drive()) {
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
    fn the_flank_runs_monotonically_from_root_to_tip_without_spikes(parameters in any_drive()) {
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
fn the_whole_wave_generator_is_an_ellipse_and_the_whole_ring_and_path_repeat_from_tooth_to_tooth() {
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
fn a_bored_tip_has_its_land_on_the_bore() {
    let ring = sampled(&PAPER_5_2_BORED, 1e-7, Extent::Tooth).ring;
    let on_land = ring.iter().filter(|point| (point.coords.norm() - 52.8227).abs() < 1e-12).count();
    assert!(on_land > 4, "{on_land} points");
}

#[test]
fn a_profile_of_too_many_points_is_refused_with_their_number() {
    let request = ProfileParameters { chord_tolerance_mm: 1e-3, extent: Extent::Full, max_points: 1000 };
    let refused = profiles(&drive(&PAPER_5_1), &request, &Never).unwrap_err();
    assert!(matches!(refused, SolveError::TooManyPoints { points, limit: 1000 } if points > 1000));
}

/// Counts how often it is asked; each halving of a chord asks once.
#[derive(Default)]
struct Halvings(AtomicU64);

impl Stop for Halvings {
    fn stopped(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed);
        false
    }
}

#[test]
fn a_profile_of_far_too_many_points_is_given_up_before_it_is_whole() {
    let halvings = Halvings::default();
    let request = ProfileParameters { chord_tolerance_mm: 1e-13, extent: Extent::Tooth, max_points: 1000 };
    let refused = profiles(&drive(&PAPER_5_1), &request, &halvings).unwrap_err();
    assert!(matches!(refused, SolveError::TooManyPoints { points: 1001, limit: 1000 }), "{refused:?}");
    // A chord takes a halving, and the last one some more on the way down to it.
    let halvings = halvings.0.into_inner();
    assert!(halvings < 1100, "{halvings}");
}

#[test]
fn a_profile_is_refused_where_it_has_one_point_more_than_allowed() {
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
