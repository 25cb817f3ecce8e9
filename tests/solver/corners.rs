//! Contact at the corners of pointed and bored tips: against finite elements, against springs made from the geometry,
//! and invariants of any load.

use nalgebra::{Matrix2, Point2, Rotation2, Vector2};
use proptest::prelude::*;
use serde::Deserialize;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::gaps::{Deviations, Modification};
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::losses::period::Losses;
use toothwave_solver::losses::{Friction, FrictionParameters, WaveGeneratorFriction};
use toothwave_solver::mesh::Place;
use toothwave_solver::model_error;
use toothwave_solver::parts::CarrierRadii;
use toothwave_solver::sweep::{self, Points, States, Sweep};
use toothwave_solver::{
    ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Never, Parameter, PerContact, Position, SolveError,
    ToothShape, Violation, WaveGenerator,
};

use crate::deviations::swept_with;
use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_swept_drive, drive, load, swept};
use crate::finite_elements::{Found, NOTHING_FOUND, note};

#[derive(Deserialize)]
struct Results {
    convergence: Vec<Refinement>,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Refinement {
    force_n: Vec<f64>,
    wind_up_rad: f64,
}

#[derive(Deserialize)]
struct Case {
    input_angle_deg: f64,
    ring_gap_um: f64,
    depth_mm: f64,
    teeth: Vec<Tooth>,
    wind_up_rad: f64,
}

#[derive(Deserialize)]
struct Tooth {
    position_deg: f64,
    force_n: [f64; 3],
    pressure_mpa: [f64; 3],
}

impl Case {
    /// Returns the load with all refinements, and with depths up to where the case's bodies are held.
    fn refined(&self) -> LoadParameters {
        LoadParameters {
            law: ContactLaw::Johnson { depth_mm: PerContact::of(|_| Some(self.depth_mm)) },
            clearance_um: PerContact { ring: self.ring_gap_um, ..PerContact::default() },
            ring_teeth_bend: true,
            wave_generator_moves: true,
            ..pressed_corners(3.0)
        }
    }

    fn wind_up_error(&self, sweep: &Sweep) -> f64 {
        let is_here = |deg: &f64| (deg - self.input_angle_deg).abs() < 1e-9;
        let at = sweep.input_angles.input_angle_deg.iter().position(is_here).unwrap();
        sweep.input_angles.wind_up_deg[at].to_radians() / self.wind_up_rad - 1.0
    }
}

fn results() -> Results {
    serde_json::from_str(include_str!("../finite_elements/corners.json")).unwrap()
}

/// Position ψ_e of the flank's end in case 5.2, in degrees.
const FLANK_END_DEG: f64 = 43.607_599;

const JOHNSON: ContactLaw = ContactLaw::JOHNSON;

fn pressed_corners(torque_nm: f64) -> LoadParameters {
    LoadParameters { law: JOHNSON, corner_contact: true, ..load(torque_nm, VirtualWork) }
}

/// Returns the states at an input angle.
fn at_angle(states: &States, input_angle_deg: f64) -> Vec<usize> {
    (0..states.len()).filter(|&at| (states.input_angle_deg[at] - input_angle_deg).abs() < 1e-9).collect()
}

#[test]
fn corner_force_converges_with_finer_elements() {
    let [first, finest] = &results().convergence[..] else { panic!("two refinements") };
    assert!((first.wind_up_rad / finest.wind_up_rad - 1.0).abs() < 1e-3);
    let largest = finest.force_n.iter().copied().fold(0.0, f64::max);
    for (first, finest) in first.force_n.iter().zip(&finest.force_n) {
        assert!((first - finest).abs() < 1e-3 * largest, "{first} N, by finer elements {finest} N");
    }
}

/// Beside the flank's end a tooth carries too much: the ring teeth's compliance assumes a contact of one width,
/// and the corner cuts off a part of it.
#[test]
fn teeth_at_pointed_tip_match_finite_elements() {
    for case in results().cases {
        let Case { input_angle_deg, ring_gap_um, ref teeth, .. } = case;
        let refined = case.refined();
        let errors = |load: &LoadParameters| {
            let sweep = swept(&PAPER_5_2, load, 240);
            let here = at_angle(&sweep.states, input_angle_deg);
            let force_n = |position_deg: f64| {
                let state = here.iter().find(|&&at| (sweep.states.position_deg[at] - position_deg).abs() < 1e-3);
                state.map_or(0.0, |&at| sweep.states.force_n.wave_generator[at])
            };
            let largest_n = teeth.iter().map(|tooth| tooth.force_n[0]).fold(0.0, f64::max);
            let of_model_n = here.iter().map(|&at| sweep.states.force_n.wave_generator[at]).fold(0.0, f64::max);
            let misses = teeth.iter().map(|tooth| (force_n(tooth.position_deg) - tooth.force_n[0]).abs() / largest_n);
            [of_model_n / largest_n - 1.0, misses.fold(0.0, f64::max), case.wind_up_error(&sweep)]
        };
        let before_deg = teeth.last().unwrap().position_deg - FLANK_END_DEG;
        let [peak, worst, wind_up] = errors(&refined);
        let name = format!("{before_deg:+.2} deg before the flank, {ring_gap_um} µm");
        println!("{name}: {:+.2} {:.2} {:+.2}", 100.0 * peak, 100.0 * worst, 100.0 * wind_up);
        let [peak_to, worst_to, wind_up_to] =
            if before_deg.abs() < 0.8 { [0.028, 0.061, 0.018] } else { [0.016, 0.023, 0.008] };
        assert!(peak.abs() < peak_to, "{name}: peak {:+.2} %", 100.0 * peak);
        assert!(worst < worst_to, "{name}: worst tooth {:.2} %", 100.0 * worst);
        assert!(wind_up.abs() < wind_up_to, "{name}: wind-up {:+.2} %", 100.0 * wind_up);
        if before_deg > 0.0 {
            let [peak, worst, _] = errors(&LoadParameters { corner_contact: false, ..refined });
            println!("  rigid: {:+.2} {:.2}", 100.0 * peak, 100.0 * worst);
            assert!(peak > 0.03 && worst > 0.13, "{name}: rigid tips {:+.2} %, {:.2} %", 100.0 * peak, 100.0 * worst);
        }
    }
}

/// The errors of the largest force of each contact, of the pressure there and of the wind-up, with the model that has them.
pub(crate) fn errors(has_gaps: bool, wave_generator_moves: bool) -> (LoadParameters, Found) {
    let (mut model, mut found) = (None, NOTHING_FOUND);
    for case in results().cases.iter().filter(|case| (case.ring_gap_um > 0.0) == has_gaps) {
        let load = LoadParameters { wave_generator_moves, ..case.refined() };
        let sweep = swept(&PAPER_5_2, &load, 240);
        let here = at_angle(&sweep.states, case.input_angle_deg);
        for contact in 0..3 {
            let column = |columns: &PerContact<Vec<f64>>, at: usize| {
                [columns.wave_generator[at], columns.ring[at], columns.carrier[at]][contact]
            };
            let by_force = |one: &&Tooth, other: &&Tooth| one.force_n[contact].total_cmp(&other.force_n[contact]);
            let tooth = case.teeth.iter().max_by(by_force).unwrap();
            let largest_n = here.iter().map(|&at| column(&sweep.states.force_n, at)).fold(0.0, f64::max);
            note(&mut found[0], largest_n / tooth.force_n[contact] - 1.0);
            let is_it = |at: &&usize| (sweep.states.position_deg[**at] - tooth.position_deg).abs() < 1e-3;
            let stress_mpa = column(&sweep.states.stress_mpa, *here.iter().find(is_it).unwrap());
            note(&mut found[1], stress_mpa / tooth.pressure_mpa[contact] - 1.0);
        }
        note(&mut found[2], case.wind_up_error(&sweep));
        model = Some(load);
    }
    (model.unwrap(), found)
}

#[test]
fn only_refined_models_have_errors_at_pointed_tips() {
    for has_gaps in [false, true] {
        let refined = results().cases[0].refined();
        let is_known = |load: &LoadParameters| {
            model_error::measured(load, model_error::Case { has_gaps, has_pointed_tips: true }).is_some()
        };
        assert!(is_known(&refined));
        assert!(!is_known(&LoadParameters { ring_teeth_bend: false, ..refined }));
        // Without a gap the wave generator stays, if the document does not say otherwise.
        assert_eq!(is_known(&LoadParameters { wave_generator_moves: false, ..refined }), !has_gaps);
    }
}

/// A tooth and its corner in the slot's frame: directions of its forces, and the gap between its circle and the corner.
struct Seen {
    to_cam: Vector2<f64>,
    to_ring: Vector2<f64>,
    to_wall: Vector2<f64>,
    gap_mm: f64,
}

/// Calculates the corner from the flank's end by angles alone, with the ring rotated.
fn seen(drive: &Drive, position_deg: f64, turned_away_rad: f64) -> Seen {
    let (flank, lobes) = (drive.flank(), drive.lobes());
    let end = flank.locus().at(drive.flank_limit().position).unwrap();
    let corner = flank.point(&end, &flank.at(&end));
    let tooth = flank.locus().at(Position::from_lobe(position_deg.to_radians(), lobes)).unwrap();
    let k = flank.teeth_per_wave();
    // In the ring's frame the tooth has moved back by ψ/k, in sense s, from the middle of its space. The slot's frame
    // is rotated likewise, and mirrored if s is -1.
    let in_slot = Rotation2::new(turned_away_rad - position_deg.to_radians() / k) * corner;
    let (sense, d) = (drive.sense(), tooth.center_radius_mm);
    let way = Point2::new(in_slot.x, -sense * in_slot.y) - Point2::new(d, 0.0);
    let gamma = tooth.tan_pressure_angle.atan();
    Seen {
        to_cam: Vector2::new(gamma.cos(), gamma.sin()),
        to_ring: way.normalize(),
        to_wall: Vector2::new(0.0, sense),
        gap_mm: way.norm() - drive.parameters().tooth_radius_mm,
    }
}

const STIFFNESS: PerContact<f64> = PerContact { wave_generator: 4e5, ring: 3e5, carrier: 5e5 };

/// One spring is at the corner. The wave generator pushes the tooth: two equilibrium equations, two degrees of freedom.
#[test]
fn tooth_before_flank_is_point_on_three_springs() {
    let with_more = DriveParameters { ring_teeth: 82, ..PAPER_5_2 };
    for (parameters, turned_arcsec) in [(PAPER_5_2, 0.0), (PAPER_5_2_BORED, 0.0), (with_more, 0.0), (PAPER_5_2, 0.2)] {
        let gaps_mm = PerContact { wave_generator: 1e-4, ring: 2e-4, carrier: 3e-4 };
        let fixed = LoadParameters {
            law: ContactLaw::Fixed(STIFFNESS),
            clearance_um: PerContact::of(|contact| 1e3 * gaps_mm.get(contact)),
            modification: Modification { ring_rotation_arcsec: turned_arcsec, ..Modification::default() },
            ..pressed_corners(3.0)
        };
        let (drive, sweep) = (drive(&parameters), swept(&parameters, &fixed, 40));
        let turned_rad = f64::to_radians(turned_arcsec / 3600.0);
        let (states, end_deg) = (&sweep.states, drive.flank_limit().position.from_lobe_deg());
        let mut carrying = 0;
        for at in (0..states.len()).filter(|&at| states.position_deg[at] > end_deg + 1e-9) {
            let Seen { to_cam, to_ring, to_wall, gap_mm } = seen(&drive, states.position_deg[at], 0.0);
            let angle = sweep.input_angles.input_angle_deg.iter().position(|&deg| deg == states.input_angle_deg[at]);
            let turned = sweep.input_angles.wind_up_deg[angle.unwrap()].to_radians();
            let position = Position::from_lobe(states.position_deg[at].to_radians(), drive.lobes());
            let center = drive.flank().locus().at(position).unwrap();
            let arm_mm = center.lever_arm_mm;
            // Contact starts when the rotation has closed the ring's rotation and the slot's gap.
            let turned = turned
                - drive.flank().teeth_per_wave() * turned_rad
                - drive.teeth_per_wave() * gaps_mm.carrier / center.center_radius_mm;
            // k_H (Δφ|h'| - g_H - u_H v) u_H = k_K (u_K v - g_K) u_K + k_S (u_S v) u_S
            let stiffness = STIFFNESS.wave_generator * to_cam * to_cam.transpose()
                + STIFFNESS.ring * to_ring * to_ring.transpose()
                + STIFFNESS.carrier * to_wall * to_wall.transpose();
            let right = STIFFNESS.wave_generator * (turned * arm_mm - gaps_mm.wave_generator) * to_cam
                + STIFFNESS.ring * (gap_mm + gaps_mm.ring) * to_ring;
            let way = Matrix2::lu(stiffness).solve(&right).unwrap();
            let expected_n = STIFFNESS.wave_generator * (turned * arm_mm - gaps_mm.wave_generator - to_cam.dot(&way));
            let force_n = PerContact::of(|contact| states.force_n.get(contact)[at]);
            let largest_n = sweep.peaks.wave_generator.force_n.value;
            if to_ring.y * -to_wall.y < 0.0 || to_ring.x < 0.0 {
                continue;
            }
            assert!(
                (force_n.wave_generator - expected_n.max(0.0)).abs() < 1e-9 * largest_n,
                "{parameters:?} at {} deg: {} N, by springs {expected_n} N",
                states.position_deg[at],
                force_n.wave_generator
            );
            if force_n.wave_generator > 0.0 {
                carrying += 1;
                let balance = force_n.wave_generator * to_cam - force_n.ring * to_ring - force_n.carrier * to_wall;
                assert!(balance.norm() < 1e-9 * largest_n, "{balance}");
            }
            assert_eq!(states.stress_mpa.ring[at], 0.0, "no pressure is told of a corner");
        }
        assert!(carrying > 10, "{carrying} states of teeth before the flank");
    }
}

/// Without corner contact these loads jump by half of the peak.
#[test]
fn loads_are_continuous_at_flank_end() {
    for (bend, moves, gap_um) in [(false, false, 0.0), (true, false, 0.0), (true, true, 10.0)] {
        let pressed = LoadParameters {
            ring_teeth_bend: bend,
            wave_generator_moves: moves,
            clearance_um: PerContact { ring: gap_um, ..PerContact::default() },
            ..pressed_corners(3.0)
        };
        for parameters in [PAPER_5_2, PAPER_5_2_BORED] {
            let drive = drive(&parameters);
            let load = LoadCase::new(&pressed).unwrap();
            let loaded = LoadedDrive::new(&drive, &load).unwrap();
            let end_rad = drive.flank_limit().position.from_lobe_rad;
            let forces = |beside_rad: f64| {
                let teeth: Vec<_> = [0.0, 0.16, 0.32, 0.48]
                    .map(|back_rad| loaded.tooth(Position::from_lobe(end_rad + beside_rad - back_rad, 2)).unwrap())
                    .into();
                let wind_up = loaded.wind_up(&teeth).unwrap();
                teeth.iter().map(|tooth| loaded.forces_n(tooth, &wind_up).unwrap().wave_generator).collect::<Vec<_>>()
            };
            for (on, before) in forces(-1e-9).iter().zip(forces(1e-9)) {
                assert!((on - before).abs() <= 2e-7 * on, "{on} N on the flank, {before} N before it");
            }
            let rigid = LoadParameters { corner_contact: false, ..pressed };
            let peaks = [&pressed, &rigid].map(|load| swept(&parameters, load, 400).peaks.wave_generator.force_n.value);
            assert!(peaks[0] < 0.97 * peaks[1], "{peaks:?} N");
        }
    }
}

/// A contact at angle α off the flank, of relative curvature Σ, has half width b by `α b + π Σ b²/4 = F/(L1 E*)`.
#[test]
fn narrower_contact_adds_logarithm_of_its_width() {
    let (drive, load) = (drive(&PAPER_5_2), LoadCase::new(&pressed_corners(3.0)).unwrap());
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let (flank, end) = (drive.flank(), drive.flank_limit().position);
    let modulus_mpa = 0.5 * 210e3 / (1.0 - 0.3 * 0.3);
    let growth_mm_per_n = 1.0 / (std::f64::consts::PI * 15.0 * modulus_mpa);
    let at_end = flank.at(&flank.locus().at(end).unwrap());
    for before_rad in [1e-4, 1e-3, 1e-2, 5e-2, 0.2] {
        let tooth = loaded.tooth(Position::from_lobe(end.from_lobe_rad + before_rad, 2)).unwrap();
        let to_corner = seen(&drive, tooth.center.position.from_lobe_deg(), 0.0).to_ring;
        let angle_rad = at_end.tan_pressure_angle.atan() - (-to_corner.y / to_corner.x).atan() - before_rad / 39.0;
        let curvature = tooth.curvature_per_mm.ring;
        for cam_force_n in [1e-6, 1.0, 50.0, 400.0] {
            let ring_n = cam_force_n * tooth.force_ratio.ring;
            let square = 0.25 * std::f64::consts::PI * curvature;
            let per_mm = ring_n / (15.0 * modulus_mpa);
            let half_mm = 2.0 * per_mm / (angle_rad + (angle_rad * angle_rad + 4.0 * square * per_mm).sqrt());
            let u = half_mm / (per_mm / square).sqrt();
            // Approach of the same contacts without narrowing, by Johnson (docs/explanation/theory.md 4.3).
            let of_contact = |force_n: f64, curvature: f64| {
                let half_mm = (4.0 * force_n / (std::f64::consts::PI * 15.0 * modulus_mpa * curvature)).sqrt();
                0.5 * growth_mm_per_n
                    * force_n
                    * (2.0 * (6.0 / half_mm).ln() - 1.0 + 2.0 * (3.0 / half_mm).ln() - 0.3 / 0.7)
            };
            let smooth = PerContact::of(|contact| {
                let ratio = tooth.force_ratio.get(contact);
                ratio * of_contact(ratio * cam_force_n, *tooth.curvature_per_mm.get(contact))
            });
            let narrower_mm = tooth.force_ratio.ring * growth_mm_per_n * 2.0 * ring_n * (2.0 / u - 1.0).ln();
            let expected_mm = smooth.wave_generator + smooth.ring + smooth.carrier + narrower_mm;
            let found_mm = tooth.spring.approach.approach_mm(cam_force_n);
            assert!((found_mm / expected_mm - 1.0).abs() < 1e-9, "{found_mm} mm, expected {expected_mm} mm");
            let back_n = tooth.spring.approach.force(found_mm).unwrap();
            assert!((back_n.force_n / cam_force_n - 1.0).abs() < 1e-12, "{back_n:?}");
            let slope = tooth.spring.approach.approach_mm(cam_force_n * 1.000_01)
                / tooth.spring.approach.approach_mm(cam_force_n * 0.999_99);
            assert!((slope.ln() / 2e-5 - back_n.exponent).abs() < 1e-6, "{back_n:?}");
        }
    }
}

/// J. H. Michell (1900): a force normal to one face of an apex with half angle w moves it by
/// `π (sin²w/(w + sin w cos w) + cos²w/(w - sin w cos w))` of a logarithm, where a half-plane has 2.
/// The angle is between the flank's tangent and the tooth's symmetry line, or the land.
#[test]
fn corner_of_bending_teeth_deflects_as_wedge_apex() {
    let compliance_mm_per_n = (1.0 - 0.3 * 0.3) / 210e3 / (std::f64::consts::PI * 15.0);
    for parameters in [PAPER_5_2, PAPER_5_2_BORED] {
        let drive = drive(&parameters);
        let (flank, end) = (drive.flank(), drive.flank_limit().position);
        let center = flank.locus().at(end).unwrap();
        let at_end = flank.at(&center);
        let (into_tooth, corner) =
            (-flank.tangent(&center, &at_end).into_inner(), flank.point(&center, &at_end).coords);
        let half_rad = if parameters.tip_radius_mm.is_some() {
            0.5 * into_tooth.angle(&Vector2::new(-corner.y, corner.x))
        } else {
            let (sin, cos) = (std::f64::consts::PI / parameters.ring_teeth as f64).sin_cos();
            into_tooth.angle(&Vector2::new(cos, sin))
        };
        let (sin, cos) = half_rad.sin_cos();
        let of_wedge = sin * sin / (half_rad + sin * cos) + cos * cos / (half_rad - sin * cos);
        let expected_mm_per_n = compliance_mm_per_n * (std::f64::consts::PI * of_wedge - 2.0);

        let at_corner = Position::from_lobe(end.from_lobe_rad + 0.05, 2);
        let tooth = |ring_teeth_bend| {
            let load = LoadCase::new(&LoadParameters { ring_teeth_bend, ..pressed_corners(3.0) }).unwrap();
            LoadedDrive::new(&drive, &load).unwrap().tooth(at_corner).unwrap()
        };
        let (bending, rigid) = (tooth(true), tooth(false));
        let ratio = rigid.force_ratio.ring;
        let to_corner = seen(&drive, at_corner.from_lobe_deg(), 0.0).to_ring;
        let angle_rad = at_end.tan_pressure_angle.atan() - (-to_corner.y / to_corner.x).atan() - 0.05 / 39.0;
        // Bending is proportional to the force; the rest is the logarithm of the contact's width.
        let per_n = |cam_force_n: f64| {
            let approach_mm = |tooth: &ToothState| tooth.spring.approach.approach_mm(cam_force_n);
            (approach_mm(&bending) - approach_mm(&rigid)) / (cam_force_n * ratio * ratio)
        };
        let ln_width = |cam_force_n: f64| {
            let square = 2.0 * rigid.curvature_per_mm.ring * compliance_mm_per_n * ratio * cam_force_n;
            let z = angle_rad / std::f64::consts::PI / square.sqrt();
            (2.0 * (z + (1.0 + z * z).sqrt()) - 1.0).ln()
        };
        let found_mm_per_n = (per_n(400.0) - per_n(4.0)) / (ln_width(400.0) - ln_width(4.0));
        assert!(
            (found_mm_per_n / expected_mm_per_n - 1.0).abs() < 1e-9,
            "{found_mm_per_n} mm/N, of a wedge of {} deg {expected_mm_per_n} mm/N",
            2.0 * half_rad.to_degrees()
        );
    }
}

fn same_loads(one: &Sweep, other: &Sweep) -> bool {
    one.states == other.states && one.peaks == other.peaks && one.torque_capacity == other.torque_capacity
}

#[test]
fn natural_tips_and_balls_have_no_corner() {
    let balls = DriveParameters { tooth: ToothShape::Ball { groove_radius_mm: PerContact::default() }, ..PAPER_5_2 };
    for (parameters, law) in [(PAPER_5_1, JOHNSON), (balls, ContactLaw::Hertz)] {
        let pressed = LoadParameters { law, ..pressed_corners(3.0) };
        let without = LoadParameters { corner_contact: false, ..pressed };
        assert!(same_loads(&swept(&parameters, &pressed, 12), &swept(&parameters, &without, 12)));
    }
}

/// Behind the corner in both directions, the tangent of the angle to the corner is positive again.
#[test]
fn tooth_beyond_corner_carries_nothing() {
    let wide_lands = DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 36.0, eccentricity_mm: 0.1 },
        teeth: 6,
        installed: 6,
        tooth_radius_mm: 1.3,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 5,
        tip_radius_mm: Some(38.6),
    };
    let two_lobes = DriveParameters {
        wave_generator: WaveGenerator::Ellipse { semi_major_mm: 56.2, semi_minor_mm: 54.8 },
        teeth: 5,
        installed: 5,
        tooth_radius_mm: 7.3,
        ring_teeth: 3,
        tip_radius_mm: Some(70.3),
        ..wide_lands
    };
    for parameters in [wide_lands, two_lobes] {
        let drive = drive(&parameters);
        let states = swept(&parameters, &pressed_corners(0.01), 20).states;
        let end_deg = drive.flank_limit().position.from_lobe_deg();
        let loads = states.position_deg.iter().zip(&states.force_n.wave_generator);
        let mut farther_out = 0;
        for (&position_deg, &force_n) in loads.filter(|(position_deg, _)| **position_deg > end_deg) {
            let Seen { to_ring, to_wall, .. } = seen(&drive, position_deg, 0.0);
            if to_ring.x < 0.0 {
                farther_out += 1;
                assert!(to_ring.y * -to_wall.y < 0.0 && force_n == 0.0, "{force_n} N at {position_deg} deg");
            }
        }
        assert!(farther_out > 0);
    }
}

/// The bore leaves a short flank, and gaps are wide: all loaded teeth touch corners.
#[test]
fn corners_alone_carry_without_ring_stress() {
    let bored = DriveParameters { installed: 80, tip_radius_mm: Some(53.2), ..PAPER_5_2 };
    let gaps = PerContact { ring: 50.0, ..PerContact::default() };
    let load = LoadParameters {
        clearance_um: gaps,
        ring_teeth_bend: true,
        wave_generator_moves: true,
        ..pressed_corners(0.3)
    };
    let found = swept(&bored, &load, 50);
    assert!(found.peaks.ring.force_n.value > 100.0);
    assert_eq!((found.peaks.ring.stress_mpa.value, found.peaks.ring.half_width_mm), (0.0, 0.0));
    assert!(found.torque_balance_residual < 1e-12 && found.period_closure_residual < 1e-9);
}

#[test]
fn flats_outside_slots_before_flank_carry_nothing() {
    let flats = DriveParameters {
        wave_generator: WaveGenerator::Ellipse { semi_major_mm: 51.0, semi_minor_mm: 49.0 },
        tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 0.8 },
        ..PAPER_5_2
    };
    let cylinders = DriveParameters { tooth: ToothShape::Cylinder { width_mm: 15.0 }, ..flats };
    let carrying = |parameters: &DriveParameters| {
        let states = swept(parameters, &pressed_corners(3.0), 40).states;
        let farthest = states.position_deg.iter().zip(&states.force_n.wave_generator);
        let farthest = farthest.filter(|(_, force_n)| **force_n > 0.0).map(|(position_deg, _)| *position_deg);
        farthest.fold(0.0, f64::max)
    };
    let (of_flats, of_cylinders) = (carrying(&flats), carrying(&cylinders));
    assert!((of_flats - of_cylinders).abs() < 1.0 && of_flats > 37.0, "{of_flats}, with cylinders {of_cylinders} deg");
}

/// To first order the corner moves as a point turned about the axis.
#[test]
fn turned_space_moves_its_corner_by_its_arm() {
    let drive = drive(&PAPER_5_2);
    let end_deg = drive.flank_limit().position.from_lobe_deg();
    for beyond_deg in [0.1, 1.0, 4.0] {
        let position_deg = end_deg + beyond_deg;
        let way_mm = |arcsec: f64| {
            let mut ring_space_angle_arcsec = vec![0.0; 78];
            ring_space_angle_arcsec[0] = arcsec;
            let deviations = Deviations { ring_space_angle_arcsec, ..Deviations::default() };
            let case = LoadCase::new(&pressed_corners(3.0)).unwrap();
            let loaded = LoadedDrive::deviating(&drive, &case, &deviations).unwrap();
            let place = Place { slot: 0, ring_space: 0, lobe: 0 };
            let tooth = loaded.tooth_at(&place, Position::from_lobe(position_deg.to_radians(), 2)).unwrap();
            let gap_mm = seen(&drive, position_deg, f64::to_radians(arcsec / 3600.0)).gap_mm;
            (tooth.spring.closing_rad * tooth.spring.arm_mm, tooth.force_ratio.ring * gap_mm)
        };
        let (turned, as_it_is) = (way_mm(0.01), way_mm(0.0));
        let (found_mm, expected_mm) = (turned.0 - as_it_is.0, turned.1 - as_it_is.1);
        assert!((found_mm / expected_mm - 1.0).abs() < 1e-5, "{position_deg} deg: {found_mm} mm, {expected_mm} mm");
    }
}

/// By virtual work, the wall's gap is weighted with the slot's force.
#[test]
fn turned_slot_moves_tooth_by_slot_force_share() {
    let drive = drive(&PAPER_5_2);
    let end_deg = drive.flank_limit().position.from_lobe_deg();
    let case = LoadCase::new(&pressed_corners(3.0)).unwrap();
    for beyond_deg in [0.1, 1.0, 4.0] {
        let tooth = |arcsec: f64| {
            let mut slot_angle_arcsec = vec![0.0; 40];
            slot_angle_arcsec[0] = arcsec;
            let deviations = Deviations { slot_angle_arcsec, ..Deviations::default() };
            let loaded = LoadedDrive::deviating(&drive, &case, &deviations).unwrap();
            let position = Position::from_lobe((end_deg + beyond_deg).to_radians(), 2);
            loaded.tooth_at(&Place { slot: 0, ring_space: 0, lobe: 0 }, position).unwrap()
        };
        let (turned, as_it_is) = (tooth(0.01), tooth(0.0));
        let found_mm = (turned.spring.closing_rad - as_it_is.spring.closing_rad) * as_it_is.spring.arm_mm;
        let wall_mm = f64::to_radians(0.01 / 3600.0) * as_it_is.center.center_radius_mm;
        let expected_mm = as_it_is.force_ratio.carrier * wall_mm;
        assert!((found_mm / expected_mm - 1.0).abs() < 1e-5, "{beyond_deg} deg: {found_mm} mm, {expected_mm} mm");
    }
}

/// A rotation of the whole ring or carrier, or equal gaps at all slots, give the same drive at another input angle.
#[test]
fn rigid_rotation_changes_no_corner_force() {
    for (parameters, moves) in [(PAPER_5_2, true), (PAPER_5_2_BORED, true), (PAPER_5_2, false)] {
        let of = |load: LoadParameters| swept(&parameters, &load, 24);
        let plain = LoadParameters { wave_generator_moves: moves, ..pressed_corners(3.0) };
        let as_it_is = of(plain);
        let of_turned = |modification: Modification| of(LoadParameters { modification, ..plain });
        for arcsec in [40.0, 400.0] {
            let ring = of_turned(Modification { ring_rotation_arcsec: arcsec, ..Modification::default() });
            let carrier = of_turned(Modification { carrier_rotation_arcsec: arcsec, ..Modification::default() });
            for turned in [ring, carrier] {
                for (one, other) in turned.states.force_n.ring.iter().zip(&as_it_is.states.force_n.ring) {
                    assert!((one - other).abs() < 1e-9 * as_it_is.peaks.ring.force_n.value, "{arcsec}: {one} {other}");
                }
            }
        }
        // The offset is equal everywhere, but a tooth is some per cent farther out at the lobe than in the valley.
        let carrier =
            |carrier| of(LoadParameters { clearance_um: PerContact { carrier, ..PerContact::default() }, ..plain });
        let near = carrier(10.0).peaks.wave_generator.force_n.value / as_it_is.peaks.wave_generator.force_n.value;
        assert!((near - 1.0).abs() < 0.03, "{parameters:?}: {near}");
    }
}

/// Either all of ring and carrier are turned, or each of their spaces and slots.
#[test]
fn corner_rotations_add_up_however_given() {
    let drive = drive(&PAPER_5_2);
    let (ring, carrier) = (3.0, 2.0);
    let forces = |is_ring_whole: bool, is_carrier_whole: bool| {
        let modification = Modification {
            ring_rotation_arcsec: if is_ring_whole { ring } else { 0.0 },
            carrier_rotation_arcsec: if is_carrier_whole { carrier } else { 0.0 },
            ..Modification::default()
        };
        let each = |count: i64, arcsec: f64, is_whole: bool| {
            if is_whole { Vec::new() } else { vec![arcsec; usize::try_from(count).unwrap()] }
        };
        let deviations = Deviations {
            ring_space_angle_arcsec: each(PAPER_5_2.ring_teeth, ring, is_ring_whole),
            slot_angle_arcsec: each(PAPER_5_2.installed, carrier, is_carrier_whole),
            ..Deviations::default()
        };
        let load = LoadParameters { modification, ..pressed_corners(3.0) };
        swept_with(&drive, &load, &deviations, Points::samples(20).unwrap()).unwrap().peaks.ring.force_n.value
    };
    let whole_n = forces(true, true);
    for (is_ring_whole, is_carrier_whole) in [(true, false), (false, true), (false, false)] {
        let found_n = forces(is_ring_whole, is_carrier_whole);
        assert!(
            (found_n / whole_n - 1.0).abs() < 1e-9,
            "{is_ring_whole}, {is_carrier_whole}: {found_n} N, {whole_n} N"
        );
    }
}

/// A tooth outside its slot has no wall to hold it, and so no force at a corner.
#[test]
fn flat_before_flank_is_pressed_as_cylinder() {
    let flats = DriveParameters {
        wave_generator: WaveGenerator::Ellipse { semi_major_mm: 51.0, semi_minor_mm: 49.0 },
        tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 0.8 },
        ..PAPER_5_2
    };
    let cylinders = DriveParameters { tooth: ToothShape::Cylinder { width_mm: 15.0 }, ..flats };
    let inner_mm = 51.6;
    let carrier = CarrierRadii { inner_mm: Some(inner_mm), outer_mm: None };
    let case = LoadCase::new(&LoadParameters { carrier, ..pressed_corners(3.0) }).unwrap();
    let drives = [drive(&flats), drive(&cylinders)];
    let [flats, cylinders] = drives.each_ref().map(|drive| LoadedDrive::new(drive, &case).unwrap());
    let end_deg = drives[0].flank_limit().position.from_lobe_deg();
    let (mut held, mut left) = (0, 0);
    for step in 1..=100 {
        let position_deg = end_deg + f64::from(step) / 101.0 * (90.0 - end_deg);
        let position = Position::from_lobe(position_deg.to_radians(), 2);
        let [flat, cylinder] = [&flats, &cylinders].map(|loaded| loaded.tooth(position).unwrap());
        let can_be_pressed = cylinder.spring.closing_rad.is_finite();
        if flat.center.center_radius_mm + 0.4 > inner_mm {
            held += u32::from(can_be_pressed);
            assert_eq!(flat.spring.closing_rad, cylinder.spring.closing_rad, "{position_deg} deg");
        } else {
            left += u32::from(can_be_pressed);
            assert_eq!(flat.spring.closing_rad, f64::INFINITY, "{position_deg} deg");
        }
    }
    assert!(held > 5 && left > 5, "{held} held, {left} have left");
}

#[test]
fn corners_need_virtual_work() {
    let refused = LoadCase::new(&LoadParameters { corner_contact: true, ..load(3.0, Projection) });
    assert_eq!(refused, Err(vec![Violation::needs_virtual_work(Parameter::CornerContact)]));
}

/// Covers several laws, unlike zones, gaps and a bored tip.
#[test]
fn tolerance_sweep_with_corners_finds_dense_peaks() {
    let unlike = DriveParameters { teeth: 81, installed: 27, ring_teeth: 79, ..PAPER_5_2 };
    let gaps = PerContact { ring: 4.0, ..PerContact::default() };
    for (parameters, of) in [
        (PAPER_5_2, pressed_corners(3.0)),
        (PAPER_5_2_BORED, LoadParameters { law: ContactLaw::Linear, ..pressed_corners(3.0) }),
        (unlike, LoadParameters { law: ContactLaw::Palmgren, clearance_um: gaps, ..pressed_corners(3.0) }),
        (PAPER_5_2, LoadParameters { clearance_um: gaps, wave_generator_moves: true, ..pressed_corners(2.0) }),
    ] {
        let of = LoadParameters { allowable_stress_mpa: Some(PerContact::of(|_| 900.0)), ..of };
        let (drive, load) = (drive(&parameters), LoadCase::new(&of).unwrap());
        let dense = swept(&parameters, &of, 3000);
        let found = sweep::sweep(&drive, &load, Points::tolerance(1e-6, 1_000_000).unwrap(), &Never).unwrap();
        let near = |what: &str, found: f64, dense: f64| {
            assert!(found > dense * (1.0 - 1e-6) && found < dense * 1.001, "{what}: {found}, of many {dense}");
        };
        for (contact, peaks) in found.peaks.iter() {
            near(&format!("force at {contact:?}"), peaks.force_n.value, dense.peaks.get(contact).force_n.value);
            near(&format!("stress at {contact:?}"), peaks.stress_mpa.value, dense.peaks.get(contact).stress_mpa.value);
        }
        let largest = |sweep: &Sweep| sweep.input_angles.wind_up_deg.iter().copied().fold(0.0, f64::max);
        near("wind-up", largest(&found), largest(&dense));
        let capacity = |sweep: &Sweep| 1.0 / sweep.torque_capacity.unwrap().input_torque_nm;
        near("reciprocal of the capacity", capacity(&found), capacity(&dense));
        // The sweep examines the angle at which a tooth reaches the flank, where the ring's stress begins.
        let (states, end_deg) = (&found.states, drive.flank_limit().position.from_lobe_deg());
        let stress_at_end = |is_told: bool| {
            let is_it = |at: usize| {
                (states.position_deg[at] - end_deg).abs() < 1e-9 && (states.stress_mpa.ring[at] > 0.0) == is_told
            };
            (0..states.len()).any(is_it)
        };
        assert!(stress_at_end(true) && stress_at_end(false));
        // No other tooth is moved for this.
        let spacing_deg = 360.0 / parameters.installed as f64;
        for at in 1..states.len() {
            let apart_deg = states.position_deg[at] - states.position_deg[at - 1];
            let is_next = states.input_angle_deg[at] == states.input_angle_deg[at - 1] && apart_deg > 0.0;
            assert!(!is_next || (apart_deg - spacing_deg).abs() < 1e-9, "{apart_deg} deg apart");
        }
        let ring_peak_deg = found.peaks.ring.stress_mpa.position_deg;
        assert!(ring_peak_deg <= end_deg + 1e-9, "{ring_peak_deg}");
    }
}

/// Near the flank the distance to the corner is a difference of two lengths of 39 mm, so rounding is 1e-14 mm.
/// Under 0.3 mN·m the approach is 1e-6 mm.
#[test]
fn lightest_corner_loads_report_their_lost_digits() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Ellipse { semi_major_mm: 37.925807356426894, semi_minor_mm: 37.83643056865192 },
        teeth: 232,
        installed: 116,
        tooth_radius_mm: 0.860085650974161,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 230,
        tip_radius_mm: None,
    };
    let of = |torque_nm: f64| {
        let pressed = LoadParameters { ring_teeth_bend: false, ..pressed_corners(torque_nm) };
        swept(&parameters, &pressed, 20)
    };
    let residuals = [3.0, 3e-2, 1e-3, 3.14e-4].map(|torque_nm| of(torque_nm).period_closure_residual);
    assert!(residuals[0] < 1e-11 && residuals[1] < 1e-9, "{residuals:?}");
    assert!(residuals.iter().all(|&residual| residual < 1e-7), "{residuals:?}");
}

/// The sweep must not refine rounding noise. Its peaks are those of a dense sweep, within their accuracy.
#[test]
fn lightest_corner_loads_keep_accurate_extremes() {
    let bored = DriveParameters { tip_radius_mm: Some(53.2), ..PAPER_5_2 };
    for (parameters, torque_nm) in [(bored, 1e-5), (bored, 1e-6), (PAPER_5_2, 1e-3), (PAPER_5_2, 1e-4)] {
        let of = LoadParameters { law: ContactLaw::Linear, ring_teeth_bend: false, ..pressed_corners(torque_nm) };
        let (drive, load) = (drive(&parameters), LoadCase::new(&of).unwrap());
        let found = sweep::sweep(&drive, &load, Points::tolerance(1e-8, 1_000_000).unwrap(), &Never).unwrap();
        let found = found.peaks.wave_generator.force_n.value;
        let dense = swept(&parameters, &of, 3000).peaks.wave_generator.force_n.value;
        assert!((found / dense - 1.0).abs() < 1e-3, "{torque_nm} N·m: {found} and {dense} N");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Covers any drive, both senses of rotation and all bores, with the checks of the sweep itself.
    #[test]
    fn corner_contact_never_increases_wind_up(parameters in any_swept_drive(), bends in any::<bool>(), ln_torque in -6.0_f64..6.0) {
        let pressed = LoadParameters { ring_teeth_bend: bends, ..pressed_corners(10.0_f64.powf(ln_torque)) };
        let rigid = LoadParameters { corner_contact: false, ..pressed };
        let drive = drive(&parameters);
        let sweeps = [pressed, rigid].map(|load| {
            sweep::sweep(&drive, &LoadCase::new(&load).unwrap(), Points::samples(20).unwrap(), &Never)
        });
        // Bending teeth may exceed Johnson's law and are then refused.
        if let [Ok(pressed), Ok(rigid)] = sweeps {
            prop_assert!(pressed.states.len() >= rigid.states.len());
            prop_assert_eq!(pressed.mesh.coincidence_degree(), rigid.mesh.coincidence_degree());
            for (pressed, rigid) in pressed.input_angles.wind_up_deg.iter().zip(&rigid.input_angles.wind_up_deg) {
                prop_assert!(*pressed <= rigid * (1.0 + 1e-12), "{} deg, rigid {} deg", pressed, rigid);
            }
        } else {
            let is_refused = |sweep: &Result<Sweep, SolveError>| {
                matches!(sweep, Err(SolveError::JohnsonBeyondHalfWidth { .. }))
            };
            prop_assert!(is_refused(&sweeps[1]), "{:?}", sweeps[0].as_ref().err());
        }
    }
}

#[test]
fn capacity_with_corners_reaches_allowable_stress() {
    let allowable = LoadParameters { allowable_stress_mpa: Some(PerContact::of(|_| 900.0)), ..pressed_corners(3.0) };
    let capacity_nm = swept(&PAPER_5_2, &allowable, 60).torque_capacity.unwrap().input_torque_nm;
    let peaks = swept(&PAPER_5_2, &pressed_corners(capacity_nm), 60).peaks;
    let largest_mpa = peaks.iter().map(|(_, peaks)| peaks.stress_mpa.value).fold(0.0, f64::max);
    assert!((largest_mpa / 900.0 - 1.0).abs() < 1e-9, "{largest_mpa} MPa");
}

/// With deviations, every tooth is listed by itself.
#[test]
fn vanishing_deviation_changes_no_corner_load() {
    let deviations = Deviations { tooth_radius_um: [vec![1e-9], vec![0.0; 39]].concat(), ..Deviations::default() };
    let (drive, load) = (drive(&PAPER_5_2), LoadCase::new(&pressed_corners(3.0)).unwrap());
    let points = Points::samples(12).unwrap();
    let apart = sweep::sweep_with_deviations(&drive, &load, &deviations, points, &Never).unwrap();
    let alike = sweep::sweep(&drive, &load, points, &Never).unwrap();
    for (contact, peaks) in apart.peaks.iter() {
        let expected_n = alike.peaks.get(contact).force_n.value;
        assert!((peaks.force_n.value / expected_n - 1.0).abs() < 1e-5, "{contact:?}");
    }
}

/// The test takes differences of positions for a tooth that cannot spin.
#[test]
fn corner_slip_follows_motion_of_contact_points() {
    let flats = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 0.5 };
    for ring_teeth in [78, 82] {
        let parameters = DriveParameters { tooth: flats, ring_teeth, ..PAPER_5_2 };
        let pressed = LoadCase::new(&pressed_corners(3.0)).unwrap();
        let (drive, sweep) = (drive(&parameters), swept(&parameters, pressed.parameters(), 12));
        let friction = Friction::new(&FrictionParameters {
            wave_generator: WaveGeneratorFriction::Plain { coefficient: 0.01 },
            ring_coefficient: 0.01,
            carrier_coefficient: 0.01,
        })
        .unwrap();
        let losses = Losses::of(&drive, &pressed, &sweep, &friction, None, &Never).unwrap();
        let (states, end_deg) = (&sweep.states, drive.flank_limit().position.from_lobe_deg());
        let (s, k) = (drive.sense(), drive.flank().teeth_per_wave());
        for at in (0..states.len()).filter(|&at| states.position_deg[at] > end_deg && states.position_deg[at] < 85.0) {
            let center_mm = |position_deg: f64| {
                let position = Position::from_lobe(position_deg.to_radians(), 2);
                drive.flank().locus().at(position).unwrap().center_radius_mm
            };
            // If the wave generator turns by a radian against the carrier, the tooth comes a radian nearer to the lobe
            // and the ring turns by -s/k.
            let step_deg = 1e-4;
            let lift = center_mm(states.position_deg[at] - step_deg) - center_mm(states.position_deg[at] + step_deg);
            let outward = lift / (2.0 * step_deg).to_radians();
            let Seen { to_ring, gap_mm, .. } = seen(&drive, states.position_deg[at], 0.0);
            let d = center_mm(states.position_deg[at]);
            let corner = Vector2::new(d, 0.0) + (1.5 + gap_mm) * to_ring;
            let of_ring = -s / k * Vector2::new(-corner.y, corner.x);
            let tangent = Vector2::new(-to_ring.y, to_ring.x);
            let expected = (Vector2::new(outward, 0.0) - of_ring).dot(&tangent);
            let found = losses.slip_mm_per_rad.ring[at];
            assert!((found - expected).abs() < 1e-6, "{found} mm/rad at {}, {expected}", states.position_deg[at]);
        }
    }
}
