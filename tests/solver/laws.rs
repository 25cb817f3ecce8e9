//! Johnson's law, series compliance, balls and flats, against independent formulas and constructions.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Vector2};
use proptest::prelude::*;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::drive::Draft;
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::mesh::{Mesh, Samples};
use toothwave_solver::parts::CarrierRadii;
use toothwave_solver::sweep::{self, Points};
use toothwave_solver::tooth::Pressure;
use toothwave_solver::tooth::flat::FlatContact;
use toothwave_solver::tooth::point::EllipticContact;
use toothwave_solver::{
    Contact, ContactLaw, Drive, DriveParameters, FieldCode, Finding, FindingCode, LoadCase, LoadParameters, Material,
    Materials, Never, Parameter, PerContact, Position, SolveError, ToothShape, Violation, findings,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, cases, drive, everywhere, load, swept};

fn johnson(torque_nm: f64) -> LoadParameters {
    LoadParameters { law: ContactLaw::JOHNSON, ..load(torque_nm, VirtualWork) }
}

/// Returns a load with titanium teeth, ceramic, cast iron and bronze parts, each with its own depth.
fn mixed(torque_nm: f64) -> LoadParameters {
    let material = |youngs_modulus_gpa, poissons_ratio| Material { youngs_modulus_gpa, poissons_ratio };
    LoadParameters {
        materials: Materials {
            wave_generator: material(310.0, 0.27),
            teeth: material(114.0, 0.31),
            ring: material(120.0, 0.26),
            carrier: material(110.0, 0.34),
        },
        law: ContactLaw::Johnson {
            depth_mm: PerContact { wave_generator: Some(12.0), ring: None, carrier: Some(3.0) },
        },
        ..load(torque_nm, VirtualWork)
    }
}

/// Returns Johnson's printed approach and its half-width.
fn printed_approach_mm(
    load: &LoadParameters,
    r: f64,
    width_mm: f64,
    contact: Contact,
    curvature: f64,
    force_n: f64,
) -> f64 {
    let ContactLaw::Johnson { depth_mm } = &load.law else { panic!("another law") };
    let mate = match contact {
        Contact::WaveGenerator => load.materials.wave_generator,
        Contact::Ring => load.materials.ring,
        Contact::Carrier => load.materials.carrier,
    };
    let soft = |m: Material| (1.0 - m.poissons_ratio * m.poissons_ratio) / (1e3 * m.youngs_modulus_gpa);
    let (tooth, nu) = (soft(load.materials.teeth), mate.poissons_ratio);
    let b = (4.0 * force_n * (tooth + soft(mate)) / (PI * width_mm * curvature)).sqrt();
    let d = depth_mm.get(contact).unwrap_or(r);
    force_n / (PI * width_mm)
        * (tooth * (2.0 * (4.0 * r / b).ln() - 1.0) + soft(mate) * (2.0 * (2.0 * d / b).ln() - nu / (1.0 - nu)))
        + load.series_compliance_mm_per_n.get(contact) * force_n
}

fn directions(drive: &Drive, tooth: &ToothState) -> [Vector2<f64>; 3] {
    let (cam, ring) = (tooth.center.tan_pressure_angle.atan(), tooth.flank.tan_pressure_angle.atan());
    [
        Vector2::new(cam.cos(), cam.sin()),
        Vector2::new(-ring.cos(), drive.sense() * ring.sin()),
        Vector2::new(0.0, -drive.sense()),
    ]
}

/// Returns the force for an approach, by bisection in its logarithm.
fn force_of(approach_mm: f64, law: impl Fn(f64) -> f64) -> f64 {
    if approach_mm <= 0.0 {
        return 0.0;
    }
    let (mut low, mut high) = (1e-12_f64, 1e7_f64);
    for _ in 0..120 {
        let middle = (low * high).sqrt();
        if law(middle) < approach_mm { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

/// Returns the forces on a tooth with a free centre. Newton's method moves it until its pressing contacts balance.
fn free_tooth(
    drive: &Drive,
    tooth: &ToothState,
    law: &dyn Fn(Contact, &ToothState, f64) -> f64,
    gap_mm: &PerContact<f64>,
    rotation_rad: f64,
) -> [f64; 3] {
    let along = directions(drive, tooth);
    let d = tooth.center.center_radius_mm;
    let pushed_mm = rotation_rad * d * tooth.center.tan_pressure_angle.atan().sin();
    // Approach of each contact if the centre moves by v. The cam comes nearer by its rotation.
    let pressed = |v: Vector2<f64>| {
        [
            pushed_mm - v.dot(&along[0]) - gap_mm.wave_generator,
            -v.dot(&along[1]) - gap_mm.ring,
            -v.dot(&along[2]) - gap_mm.carrier,
        ]
    };
    let forces = |v: Vector2<f64>| {
        let pressed = pressed(v);
        [0, 1, 2].map(|i| force_of(pressed[i], |force_n| law(Contact::all()[i], tooth, force_n)))
    };
    let stiffness = |i: usize, force_n: f64| {
        let step = 1e-5 * force_n;
        2.0 * step / (law(Contact::all()[i], tooth, force_n + step) - law(Contact::all()[i], tooth, force_n - step))
    };
    // Starts with the shares of statics, so that all three contacts press.
    let mut v = {
        let reach = |ratio: f64, i: usize, f: f64| law(Contact::all()[i], tooth, f * ratio);
        let ratio = tooth.force_ratio;
        let (mut low, mut high) = (1e-12_f64, 1e7_f64);
        for _ in 0..200 {
            let f = (low * high).sqrt();
            let all = reach(1.0, 0, f)
                + gap_mm.wave_generator
                + ratio.ring * (reach(ratio.ring, 1, f) + gap_mm.ring)
                + ratio.carrier * (reach(ratio.carrier, 2, f) + gap_mm.carrier);
            if all < pushed_mm { low = f } else { high = f }
        }
        if low < 1e-11 {
            return [0.0; 3];
        }
        let f = low;
        let ring = -(reach(ratio.ring, 1, f) + gap_mm.ring);
        let carrier = -(reach(ratio.carrier, 2, f) + gap_mm.carrier);
        Matrix2::from_rows(&[along[1].transpose(), along[2].transpose()])
            .lu()
            .solve(&Vector2::new(ring, carrier))
            .unwrap()
            // Starts beside the solution, so that Newton's method has work.
            * 1.001
    };
    for _ in 0..60 {
        let f = forces(v);
        let unbalanced: Vector2<f64> = (0..3).map(|i| along[i] * f[i]).sum();
        let mut slope = Matrix2::zeros();
        for i in 0..3 {
            if f[i] > 0.0 {
                slope -= along[i] * along[i].transpose() * stiffness(i, f[i]);
            }
        }
        let Some(step) = slope.lu().solve(&-unbalanced) else { break };
        v += step;
        if step.norm() < 1e-16 {
            break;
        }
    }
    forces(v)
}

/// Returns the largest difference from free teeth at the solver's wind-up, in forces over the peak and in torque.
fn worst_against_free_teeth(parameters: &DriveParameters, load: &LoadParameters) -> f64 {
    let samples = Samples::new(3).unwrap();
    let drive = drive(parameters);
    let loaded = LoadCase::new(load).unwrap();
    let loaded = LoadedDrive::new(&drive, &loaded).unwrap();
    let (r, width_mm) = (parameters.tooth_radius_mm, drive.tooth_width_mm());
    let law = |contact: Contact, tooth: &ToothState, force_n: f64| {
        let cam = 1.0 / tooth.center.cam_curvature_per_mm;
        let curvature = match contact {
            Contact::WaveGenerator => 1.0 / r + 1.0 / cam,
            Contact::Ring => 1.0 / (r * tooth.flank.regularity),
            Contact::Carrier => 1.0 / r,
        };
        printed_approach_mm(load, r, width_mm, contact, curvature, force_n)
    };
    let gap_mm = PerContact::of(|contact| 1e-3 * load.clearance_um.get(contact));
    let mesh = Mesh::new(&drive);
    let mut worst = 0.0_f64;
    for sample in 0..samples.count() {
        let teeth: Vec<_> = mesh
            .placed_at(sample, samples)
            .map(|placed| loaded.tooth(placed.position).unwrap())
            .filter(|tooth| tooth.center.tan_pressure_angle > 0.0)
            .collect();
        let wind_up = loaded.wind_up(&teeth).unwrap();
        let found: Vec<_> = teeth.iter().map(|tooth| loaded.forces_n(tooth, &wind_up).unwrap()).collect();
        let peak = found.iter().map(|force| force.wave_generator).fold(0.0, f64::max);
        let mut torque = 0.0;
        for (tooth, found) in teeth.iter().zip(&found) {
            let free = free_tooth(&drive, tooth, &law, &gap_mm, wind_up.rotation_rad());
            torque += 2.0 * free[0] * tooth.center.lever_arm_mm;
            for (free, (_, found)) in free.iter().zip(found.iter()) {
                worst = worst.max((free - found).abs() / peak);
            }
        }
        worst = worst.max((torque / loaded.input_torque_nmm() - 1.0).abs());
    }
    worst
}

#[test]
fn johnson_virtual_work_is_tooth_between_three_lines() {
    let with_gaps = |load: LoadParameters| LoadParameters {
        clearance_um: PerContact { wave_generator: 3.0, ring: 4.5, carrier: 6.0 },
        series_compliance_mm_per_n: PerContact { wave_generator: 0.0, ring: 1e-6, carrier: 7e-6 },
        ..load
    };
    let larger = DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.5, ..PAPER_5_1 };
    for (parameters, load) in [
        (PAPER_5_1, johnson(20.0)),
        (PAPER_5_2, johnson(3.0)),
        (PAPER_5_1, mixed(20.0)),
        (larger, mixed(20.0)),
        (PAPER_5_1, with_gaps(johnson(20.0))),
        (larger, with_gaps(mixed(20.0))),
        (PAPER_5_2, with_gaps(mixed(3.0))),
    ] {
        let worst = worst_against_free_teeth(&parameters, &load);
        assert!(worst < 1e-10, "{worst:e} at {load:?}");
    }
}

#[test]
fn approach_follows_johnsons_printed_formula() {
    let load = mixed(20.0);
    let drive = drive(&PAPER_5_1);
    let case = LoadCase::new(&load).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    for degrees in [0.0_f64, 1e-6, 10.0, 45.0, 80.0] {
        let tooth = loaded.tooth(Position::from_lobe(degrees.to_radians(), 2)).unwrap();
        for force_n in [1e-9, 1.0, 1e3, 1e4] {
            let printed: f64 = Contact::all()
                .iter()
                .map(|&contact| {
                    let (ratio, curvature) = (*tooth.force_ratio.get(contact), *tooth.curvature_per_mm.get(contact));
                    if ratio > 0.0 {
                        ratio * printed_approach_mm(&load, 5.0, 15.0, contact, curvature, ratio * force_n)
                    } else {
                        0.0
                    }
                })
                .sum();
            let found = tooth.spring.approach.approach_mm(force_n);
            assert!((found / printed - 1.0).abs() < 4e-15, "{degrees}, {force_n}: {:e}", found / printed - 1.0);
            let back = tooth.spring.approach.force(found).unwrap();
            assert!((back.force_n / force_n - 1.0).abs() < 2e-15, "{:e}", back.force_n / force_n - 1.0);
            let step = 1e-5;
            let rise = (tooth.spring.approach.approach_mm(force_n * (1.0 + step))
                / tooth.spring.approach.approach_mm(force_n * (1.0 - step)))
            .ln()
                / (2.0 * step);
            assert!((back.exponent - rise).abs() < 1e-9);
        }
    }
}

#[test]
fn johnson_lies_between_linear_and_palmgren() {
    let peak = |law| {
        let load = LoadParameters { law, ..load(20.0, VirtualWork) };
        let sweep = swept(&PAPER_5_1, &load, 50);
        let most_deg = sweep.input_angles.wind_up_deg.iter().copied().fold(0.0, f64::max);
        println!("5.1, {law:?}: peak F_H {:.3} N, wind-up {most_deg:.5} deg", sweep.peaks.wave_generator.force_n.value);
        (sweep.peaks.wave_generator.force_n.value, most_deg)
    };
    let (linear, palmgren, johnson) = (peak(ContactLaw::Linear), peak(ContactLaw::Palmgren), peak(ContactLaw::JOHNSON));
    assert!(linear.0 < palmgren.0 && palmgren.0 < johnson.0 && johnson.0 < 1.01 * palmgren.0, "{johnson:?}");
    assert!(linear.1 < johnson.1 && johnson.1 < palmgren.1, "{johnson:?}");
}

#[test]
fn johnsons_law_balances_any_torque_and_gap() {
    let mut worst = 0.0_f64;
    for parameters in [PAPER_5_1, PAPER_5_2] {
        for exponent in [-12, -8, -4, 0, 1] {
            for gap_um in [0.0, 1e-6, 1.0, 1e3, 1e6] {
                for contact in Contact::all() {
                    let load = LoadParameters {
                        clearance_um: PerContact::of(|at| if at == contact { gap_um } else { 0.0 }),
                        ..johnson(10.0_f64.powi(exponent))
                    };
                    worst = worst.max(swept(&parameters, &load, 2).torque_balance_residual);
                }
            }
        }
    }
    assert!(worst <= 1e-13, "{worst:e}");
}

#[test]
fn johnsons_law_ends_at_half_width_with_torque() {
    let flats = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 4.0 };
    for drive in [drive(&PAPER_5_1), drive(&DriveParameters { tooth: flats, ..PAPER_5_1 })] {
        johnsons_law_ends_at_the_ring(&drive);
    }
}

fn johnsons_law_ends_at_the_ring(drive: &Drive) {
    let heavy = LoadCase::new(&johnson(1e6)).unwrap();
    let refused = sweep::sweep(drive, &heavy, Points::samples(4).unwrap(), &Never).unwrap_err();
    assert!(refused.to_string().starts_with("half the contact's width at the ring reaches 2.5 mm"), "{refused}");
    let SolveError::JohnsonBeyondHalfWidth { contact, half_width_limit_mm, input_torque_limit_nm, .. } = refused else {
        panic!("{refused:?}")
    };
    assert_eq!(half_width_limit_mm, 2.5);
    // Just below the reported torque the first input angle has an answer with that half-width. Just above it has none.
    let loaded = |torque_nm: f64| {
        let case = LoadCase::new(&johnson(torque_nm)).unwrap();
        let loaded = LoadedDrive::new(drive, &case).unwrap();
        let mesh = Mesh::new(drive);
        let teeth: Vec<_> =
            mesh.placed_at(0, Samples::new(4).unwrap()).map(|placed| loaded.tooth(placed.position).unwrap()).collect();
        let wind_up = loaded.wind_up(&teeth)?;
        let widths = teeth.iter().map(|tooth| {
            let force_n = *loaded.forces_n(tooth, &wind_up).unwrap().get(contact);
            let modulus_mpa = 210e3 / (2.0 * (1.0 - 0.09));
            (4.0 * force_n / (PI * 15.0 * modulus_mpa * tooth.curvature_per_mm.get(contact))).sqrt()
        });
        Ok::<f64, SolveError>(widths.fold(0.0, f64::max))
    };
    assert!((loaded(input_torque_limit_nm * (1.0 - 1e-9)).unwrap() / 2.5 - 1.0).abs() < 1e-8);
    assert!(loaded(input_torque_limit_nm * (1.0 + 1e-9)).is_err());
    // No capacity exists beyond the law's end.
    let parameters = LoadParameters { allowable_stress_mpa: Some(everywhere(1e6)), ..johnson(20.0) };
    let refused = sweep::sweep(drive, &LoadCase::new(&parameters).unwrap(), Points::samples(4).unwrap(), &Never);
    assert!(matches!(refused, Err(SolveError::JohnsonBeyondHalfWidth { .. })), "{refused:?}");
}

#[test]
fn contact_above_tenth_of_tooth_is_a_finding() {
    let found = |load: &LoadParameters| {
        let drive = drive(&PAPER_5_1);
        let sweep = swept(&PAPER_5_1, load, 10);
        findings::of_half_widths(&drive, &LoadCase::new(load).unwrap(), &sweep.states, 1.0)
    };
    assert_eq!(found(&johnson(20.0)), []);
    assert_eq!(found(&load(2e3, VirtualWork)), []);
    let heavy = found(&johnson(2000.0));
    let widths: Vec<_> = heavy
        .iter()
        .map(|&Finding { code, value, limit, contact, .. }| {
            assert!(code == FindingCode::JohnsonBeyondHalfWidth && value > limit, "{heavy:?}");
            (contact, limit)
        })
        .collect();
    assert!(widths.contains(&(Some(Contact::Ring), 0.5)), "{heavy:?}");
    // At the most loaded place along the teeth contacts are wider by the root of the load.
    let sweep = swept(&PAPER_5_1, &johnson(2000.0), 10);
    let case = LoadCase::new(&johnson(2000.0)).unwrap();
    let uneven = findings::of_half_widths(&drive(&PAPER_5_1), &case, &sweep.states, 2.25);
    assert!(uneven.iter().zip(&heavy).all(|(wide, mean)| (wide.value / mean.value - 1.5).abs() < 1e-12), "{uneven:?}");
    let shallow = LoadParameters {
        law: ContactLaw::Johnson { depth_mm: PerContact { wave_generator: None, ring: None, carrier: Some(0.3) } },
        ..johnson(20.0)
    };
    let places: Vec<_> = found(&shallow).iter().map(|finding| (finding.code, finding.contact)).collect();
    assert_eq!(places, [(FindingCode::JohnsonBeyondHalfWidth, Some(Contact::Carrier))]);
}

/// Returns laws without a closed form, with gaps.
fn laws_of_searches() -> [LoadParameters; 3] {
    let gapped = |load: LoadParameters| LoadParameters {
        clearance_um: PerContact { wave_generator: 0.0, ring: 10.0, carrier: 2.0 },
        ..load
    };
    let springy = LoadParameters {
        law: ContactLaw::Palmgren,
        series_compliance_mm_per_n: PerContact { wave_generator: 0.0, ring: 2e-6, carrier: 5e-6 },
        ..load(20.0, VirtualWork)
    };
    [johnson(20.0), gapped(mixed(20.0)), gapped(springy)]
}

#[test]
fn stiffness_is_torque_slope_and_capacity_meets_stress() {
    for load in laws_of_searches() {
        let at = |torque_nm: f64| {
            let load = LoadParameters { torque: toothwave_solver::Torque::Input(torque_nm), ..load };
            swept(&PAPER_5_1, &load, 6)
        };
        let (less, middle, more) = (at(20.0 * (1.0 - 1e-5)), at(20.0), at(20.0 * (1.0 + 1e-5)));
        for (sample, stiffness) in middle.input_angles.torsional_stiffness_nm_per_rad.iter().enumerate() {
            let turned = |sweep: &sweep::Sweep| sweep.input_angles.wind_up_deg[sample].to_radians();
            let slope = 20.0 * 2e-5 * 14.0 * 14.0 / (turned(&more) - turned(&less));
            assert!((stiffness / slope - 1.0).abs() < 1e-7, "{stiffness} {slope}");
        }
        let limited = LoadParameters { allowable_stress_mpa: Some(everywhere(1500.0)), ..load };
        let capacity = swept(&PAPER_5_1, &limited, 6).torque_capacity.unwrap();
        let reached = at(capacity.input_torque_nm);
        let largest = reached.peaks.iter().map(|(_, peaks)| peaks.stress_mpa.value).fold(0.0, f64::max);
        assert!((largest / 1500.0 - 1.0).abs() < 1e-12, "{largest}");
        let limiting = reached.peaks.iter().find(|(contact, _)| capacity.limited_by == (*contact).into());
        assert_eq!(limiting.unwrap().1.stress_mpa.value, largest);
    }
}

#[test]
fn tolerance_sweep_finds_peaks_under_these_laws() {
    for load in laws_of_searches() {
        let case = LoadCase::new(&load).unwrap();
        let points = Points::tolerance(1e-6, 1_000_000).unwrap();
        let found = sweep::sweep(&drive(&PAPER_5_1), &case, points, &Never).unwrap();
        let sampled = swept(&PAPER_5_1, &load, 4000);
        for (contact, peaks) in found.peaks.iter() {
            let sampled = sampled.peaks.get(contact);
            for (found, sampled) in
                [(peaks.force_n.value, sampled.force_n.value), (peaks.stress_mpa.value, sampled.stress_mpa.value)]
            {
                // Samples miss a kink by up to their distance.
                assert!(found >= sampled * (1.0 - 1e-6) && found <= sampled * (1.0 + 2e-4), "{found} {sampled}");
            }
        }
    }
}

#[test]
fn projection_rejects_johnsons_law_and_series_compliance() {
    let refused = |parameters: LoadParameters| LoadCase::new(&parameters).unwrap_err();
    let projected = LoadParameters { law: ContactLaw::JOHNSON, ..load(20.0, Projection) };
    assert_eq!(refused(projected), [Violation::needs_virtual_work(Parameter::Law)]);
    let mut springy = load(20.0, Projection);
    springy.series_compliance_mm_per_n.carrier = 1e-6;
    let parameter = Parameter::SeriesCompliance(Contact::Carrier);
    assert_eq!(refused(springy), [Violation::needs_virtual_work(parameter)]);
    let mut soft = johnson(20.0);
    soft.series_compliance_mm_per_n.ring = -1e-9;
    soft.law = ContactLaw::Johnson { depth_mm: PerContact { wave_generator: Some(0.0), ring: None, carrier: None } };
    assert_eq!(refused(soft).len(), 2);
}

#[test]
fn series_compliance_softens_linear_stiffness() {
    let stiffness = PerContact { wave_generator: 4e5, ring: 6e5, carrier: 2e5 };
    let series = PerContact { wave_generator: 1e-6, ring: 2e-6, carrier: 3e-6 };
    let springy = LoadParameters {
        law: ContactLaw::Fixed(stiffness),
        series_compliance_mm_per_n: series,
        ..load(20.0, VirtualWork)
    };
    let softer = PerContact::of(|contact| 1.0 / (1.0 / stiffness.get(contact) + series.get(contact)));
    let soft = LoadParameters { law: ContactLaw::Fixed(softer), ..load(20.0, VirtualWork) };
    let gapped = |load: LoadParameters| LoadParameters {
        clearance_um: PerContact { wave_generator: 0.0, ring: 5.0, carrier: 2.0 },
        ..load
    };
    for (springy, soft) in [(springy, soft), (gapped(springy), gapped(soft))] {
        let (one, other) = (swept(&PAPER_5_1, &springy, 20), swept(&PAPER_5_1, &soft, 20));
        for (contact, column) in one.states.force_n.iter() {
            for (one_n, other_n) in column.iter().zip(other.states.force_n.get(contact)) {
                assert!((one_n - other_n).abs() < 1e-12 * other.peaks.get(contact).force_n.value);
            }
        }
    }
}

#[test]
fn ball_on_plane_has_hertz_closed_form_approach() {
    let (r, modulus) = (5.0_f64, 115e3_f64);
    let circle = EllipticContact::new(1.0 / r, 1.0 / r, modulus).unwrap();
    let sum = 2.0 / r;
    assert!((circle.coefficient() / (9.0 * sum / (32.0 * modulus * modulus)).cbrt() - 1.0).abs() < 1e-15);
    let half = (3.0 * 100.0 * r / (4.0 * modulus)).cbrt();
    assert!(
        (circle.half_width_mm(100.0) / half - 1.0).abs() < 1e-15
            && (circle.half_length_mm(100.0) / half - 1.0).abs() < 1e-15
    );
    assert!((circle.stress_mpa(100.0) / (1.5 * 100.0 / (PI * half * half)) - 1.0).abs() < 1e-15);
    // Largest shear below a circle, from the closed stresses on its axis.
    let shear = |z: f64| {
        let radial = -1.3 * (1.0 - z * (1.0 / z).atan()) + 0.5 / (1.0 + z * z);
        0.5 * (radial + 1.0 / (1.0 + z * z))
    };
    let below = circle.shear_below(0.3);
    assert!((below.share - shear(below.depth)).abs() < 1e-14);
    assert!(shear(below.depth) >= shear(below.depth + 1e-4) && shear(below.depth) >= shear(below.depth - 1e-4));
    assert!((below.share - 0.310).abs() < 5e-4 && (below.depth - 0.481).abs() < 1e-3, "{below:?}");
}

/// Returns both complete elliptic integrals of a complementary modulus, by the arithmetic-geometric mean.
fn elliptic_integrals(complement: f64) -> [f64; 2] {
    let (mut a, mut b, mut weight, mut sum) = (1.0, complement, 0.5, 0.5 * (1.0 - complement) * (1.0 + complement));
    for _ in 0..8 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        weight *= 2.0;
        sum += weight * c * c;
    }
    let first = 0.5 * PI / a;
    [first, first * (1.0 - sum)]
}

#[test]
fn ellipse_axes_and_approach_match_elliptic_integrals() {
    let (modulus_mpa, force_n) = (115e3, 100.0);
    for exponent in 1..60 {
        let (large, small) = (0.3, 0.3 * 10_f64.powf(-0.05 * f64::from(exponent)));
        let ellipse = EllipticContact::new(large, small, modulus_mpa).unwrap();
        let (short_mm, long_mm) = (ellipse.half_width_mm(force_n), ellipse.half_length_mm(force_n));
        let ratio = short_mm / long_mm;
        let [first, second] = elliptic_integrals(ratio);
        let m = (1.0 - ratio) * (1.0 + ratio);
        // Johnson, Contact Mechanics, section 4.2.
        let curvatures = (second / (ratio * ratio) - first) / (first - second);
        let cubed_mm3 = 3.0 * force_n * second / (PI * modulus_mpa * (large + small) * ratio * ratio);
        let approach_mm = force_n.powf(2.0 / 3.0) * ellipse.coefficient();
        let expected_mm = 1.5 * force_n * first / (PI * modulus_mpa * long_mm);
        // Differences of integrals lose digits for a nearly round ellipse.
        assert!((curvatures / (large / small) - 1.0).abs() < 1e-14 / m, "{ratio}: {curvatures}");
        assert!((long_mm.powi(3) / cubed_mm3 - 1.0).abs() < 1e-14, "{ratio}: {long_mm} mm");
        assert!((approach_mm / expected_mm - 1.0).abs() < 1e-14, "{ratio}: {approach_mm} mm");
    }
}

/// If two bodies swap materials, the contact stays. The body with the lower Poisson's ratio has the larger shear.
#[test]
fn ball_contact_shear_is_larger_bodys() {
    let material = |poissons_ratio| Material { youngs_modulus_gpa: 200.0, poissons_ratio };
    let ball = DriveParameters { tooth: ToothShape::Ball { groove_radius_mm: PerContact::default() }, ..PAPER_5_1 };
    let peaks = |of_teeth, of_parts| {
        let parts = material(of_parts);
        let materials = Materials { wave_generator: parts, teeth: material(of_teeth), ring: parts, carrier: parts };
        swept(&ball, &LoadParameters { materials, law: ContactLaw::Hertz, ..load(5.0, VirtualWork) }, 20).peaks
    };
    let (one, other, soft) = (peaks(0.2, 0.4), peaks(0.4, 0.2), peaks(0.4, 0.4));
    for (contact, one) in one.iter() {
        let [one, other, soft] = [one, other.get(contact), soft.get(contact)]
            .map(|peaks| peaks.shear_stress_mpa.unwrap() / peaks.stress_mpa.value);
        assert!((one / other - 1.0).abs() < 1e-9, "{contact:?}: {one} {other}");
        assert!(one > 1.01 * soft, "{contact:?}: {one} {soft}");
    }
}

#[test]
fn very_long_ellipse_is_sheared_like_line() {
    let long = EllipticContact::new(1.0, 1e-20, 1e5).unwrap();
    for nu in [0.0, 0.3, 0.45] {
        let below = long.shear_below(nu);
        assert!((below.share - toothwave_solver::contact::SHEAR_SHARE).abs() < 1e-9, "{below:?}");
        assert!((below.depth - toothwave_solver::contact::SHEAR_DEPTH).abs() < 1e-6, "{below:?}");
    }
}

/// Returns the deflection of a half-space at `(x, y)`, times π E*, under Hertz's pressure of unit peak over an ellipse.
/// It sums the pressure along all lines through the point. On each chord the pressure is the root of a quadratic.
fn half_space_deflection(long: f64, short: f64, x: f64, y: f64) -> f64 {
    const STEPS: u32 = 20_000;
    let mut sum = 0.0;
    for i in 0..STEPS {
        let t = PI * (f64::from(i) + 0.5) / f64::from(STEPS);
        let (sin, cos) = t.sin_cos();
        let a = (cos / long).powi(2) + (sin / short).powi(2);
        let b = x * cos / (long * long) + y * sin / (short * short);
        let c = 1.0 - (x / long).powi(2) - (y / short).powi(2);
        // ∫ √(c - 2bs - as²) ds over the whole chord: half a disc's area.
        sum += 0.5 * PI * (c + b * b / a) / a.sqrt();
    }
    sum * PI / f64::from(STEPS)
}

#[test]
fn hertz_pressure_closes_whole_contact_ellipse() {
    let modulus = 115e3;
    for (in_plane, axial) in [(0.4, 0.4 - 1e-9), (0.4, 0.2), (0.3, 0.008), (0.02, 0.2), (5.0, 0.008)] {
        let force_n = 730.0;
        let contact = EllipticContact::new(in_plane, axial, modulus).unwrap();
        let (wide, long) = (contact.half_width_mm(force_n), contact.half_length_mm(force_n));
        let peak = contact.stress_mpa(force_n);
        assert!((peak * 2.0 * PI * wide * long / 3.0 / force_n - 1.0).abs() < 1e-13);
        assert!((contact.force_n(peak) / force_n - 1.0).abs() < 1e-13);
        let approach = contact.coefficient() * force_n.powf(EllipticContact::EXPONENT);
        for (x, y) in [(0.0, 0.0), (0.6, 0.0), (0.0, 0.7), (0.5, 0.5)] {
            let (x, y) = (x * wide, y * long);
            let deflection = peak / (PI * modulus) * half_space_deflection(wide, long, x, y);
            let gone = approach - 0.5 * (in_plane * x * x + axial * y * y);
            assert!((deflection / gone - 1.0).abs() < 1e-9, "{in_plane} {axial}: {:e}", deflection / gone - 1.0);
        }
    }
}

#[test]
fn flat_approach_is_mean_under_uniform_pressure() {
    let modulus = 115e3;
    for (length, width) in [(4.0_f64, 15.0_f64), (3.0, 3.0), (15.0, 4.0), (1e-4, 10.0)] {
        let flat = FlatContact { length_mm: length, width_mm: width };
        // Over the distances (u, v) of two points, each with weight (l - u)(L - v). Polar coordinates at u = v = 0.
        let steps = 400;
        let nodes = |n: u32| (0..n).map(move |i| (f64::from(i) + 0.5) / f64::from(n));
        let corner = (width / length).atan();
        let mut sum = 0.0;
        for (from, to) in [(0.0, corner), (corner, 0.5 * PI)] {
            for share in nodes(steps) {
                let t: f64 = from + (to - from) * share;
                let (sin, cos) = t.sin_cos();
                let reach = (length / cos).min(width / sin);
                // ∫ (l - s cos)(L - s sin) ds
                let along = length * width * reach - 0.5 * (length * sin + width * cos) * reach * reach
                    + sin * cos * reach.powi(3) / 3.0;
                sum += 4.0 * along * (to - from) / f64::from(steps);
            }
        }
        let area = length * width;
        let mean = sum / (PI * modulus * area * area);
        let found = flat.compliance_mm_per_n(modulus);
        assert!(
            (found / mean - 1.0).abs() < 1e-4 * (width / length).max(1.0),
            "{length} {width}: {:e}",
            found / mean - 1.0
        );
        assert_eq!(flat.stress_mpa(flat.force_n(800.0)), 800.0);
    }
    // A square, from its closed form.
    let square = FlatContact { length_mm: 3.0, width_mm: 3.0 }.compliance_mm_per_n(modulus);
    let closed = (4.0 * 1.0_f64.asinh() + (4.0 - 4.0 * 2.0_f64.sqrt()) / 3.0) / (PI * modulus * 3.0);
    assert!((square / closed - 1.0).abs() < 1e-15);
    // A narrow strip keeps its digits: to second order in t = l/L, I over L³ is 2t²(ln(2/t) + 1/2) + (2/3) t³.
    let t = 1e-9_f64;
    let strip = FlatContact { length_mm: t, width_mm: 1.0 }.compliance_mm_per_n(1.0) * PI * t * t;
    let series = 2.0 * t * t * ((2.0 / t).ln() + 0.5) + 2.0 / 3.0 * t * t * t;
    assert!((strip / series - 1.0).abs() < 1e-14, "{:e}", strip / series - 1.0);
}

#[test]
fn flat_sided_teeth_work_with_any_cylinder_law() {
    let tooth = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 4.0 };
    let drive = drive(&DriveParameters { tooth, ..PAPER_5_1 });
    let within = |outer_mm| LoadParameters {
        carrier: CarrierRadii { inner_mm: Some(58.5), outer_mm: Some(outer_mm) },
        ..load(20.0, VirtualWork)
    };
    for law in [ContactLaw::Linear, ContactLaw::Palmgren, ContactLaw::JOHNSON] {
        let case = LoadCase::new(&LoadParameters { law, ..within(65.5) }).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let mesh = Mesh::new(&drive);
        let teeth: Vec<_> =
            mesh.placed_at(1, Samples::new(3).unwrap()).map(|placed| loaded.tooth(placed.position).unwrap()).collect();
        let wind_up = loaded.wind_up(&teeth).unwrap();
        let mut torque = 0.0;
        for tooth in &teeth {
            let force_n = loaded.forces_n(tooth, &wind_up).unwrap();
            torque += 2.0 * force_n.wave_generator * tooth.center.lever_arm_mm;
            let d = tooth.center.center_radius_mm;
            let borne = (d + 2.0).min(65.5) - (d - 2.0).max(58.5);
            let pressure = loaded.stress_mpa(tooth, &force_n).carrier;
            assert!((pressure * borne * 15.0 / force_n.carrier - 1.0).abs() < 1e-12);
        }
        assert!((torque / 20e3 - 1.0).abs() < 1e-14);
    }
    let case = LoadCase::new(&within(60.0)).unwrap();
    let loaded = LoadedDrive::new(&drive, &case).unwrap();
    let left = loaded.tooth(Position::from_lobe(0.1, 2));
    assert!(matches!(left, Err(SolveError::FlatOffCarrier { .. })), "{left:?}");
}

#[test]
fn flat_half_width_is_half_its_length() {
    let tooth = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 6.0 };
    let peaks = swept(&DriveParameters { tooth, ..PAPER_5_1 }, &johnson(20.0), 4).peaks;
    assert!((peaks.carrier.half_width_mm / 3.0 - 1.0).abs() < 1e-14);
}

#[test]
fn given_carrier_bears_the_flats() {
    let flat_length_mm = 4.0;
    let parameters = DriveParameters { tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm }, ..PAPER_5_1 };
    let drive = drive(&parameters);
    let draft = Draft::new(&parameters).unwrap();
    for (inner_mm, outer_mm) in [(None, None), (Some(61.0), None), (None, Some(62.0)), (Some(60.5), Some(62.5))] {
        let carrier = CarrierRadii { inner_mm, outer_mm };
        let load = LoadParameters { law: ContactLaw::JOHNSON, carrier, ..load(20.0, VirtualWork) };
        assert!(load.carrier_violations(&draft).is_empty());
        let found = sweep::sweep(&drive, &LoadCase::new(&load).unwrap(), Points::samples(8).unwrap(), &Never).unwrap();
        assert!(found.torque_balance_residual < 1e-14);
        // Between the cam at 58 mm and the tips at 66 mm, with a tenth of the space free on each side.
        let (inner_mm, outer_mm) = (inner_mm.unwrap_or(58.8), outer_mm.unwrap_or(65.2));
        for state in 0..found.states.len() {
            let d = found.states.center_radius_mm[state];
            let borne_mm = (d + 2.0).min(outer_mm) - (d - 2.0).max(inner_mm);
            let force_n = found.states.stress_mpa.carrier[state] * borne_mm * 15.0;
            let expected_n = found.states.force_n.carrier[state];
            assert!((force_n - expected_n).abs() < 1e-9, "{carrier:?} at {d} mm: {force_n} N, not {expected_n}");
        }
    }
    let impossible = [
        (Some(57.0), None, Parameter::CarrierInnerRadius),
        (None, Some(67.0), Parameter::CarrierOuterRadius),
        (Some(63.0), Some(62.0), Parameter::CarrierOuterRadius),
        (Some(f64::NAN), None, Parameter::CarrierInnerRadius),
    ];
    for (inner_mm, outer_mm, at_fault) in impossible {
        let load = LoadParameters { carrier: CarrierRadii { inner_mm, outer_mm }, ..load(20.0, VirtualWork) };
        use FieldCode::{CarrierMeetsCam, CarrierMeetsRing, CarrierWithoutWall, OutOfRange};
        let parameter = |violations: &[Violation]| match violations {
            [
                Violation {
                    code: CarrierMeetsCam | CarrierMeetsRing | CarrierWithoutWall | OutOfRange, parameter, ..
                },
            ] => *parameter,
            other => panic!("{other:?}"),
        };
        assert_eq!(parameter(&load.carrier_violations(&draft)), at_fault);
        let case = LoadCase::new(&load).unwrap();
        match sweep::sweep(&drive, &case, Points::samples(8).unwrap(), &Never) {
            Err(SolveError::Impossible(violations)) => assert_eq!(parameter(&violations), at_fault),
            other => panic!("{other:?}"),
        }
        // Cylinders do not depend on the carrier.
        let cylinders = crate::drives::drive(&PAPER_5_1);
        assert!(sweep::sweep(&cylinders, &case, Points::samples(8).unwrap(), &Never).is_ok());
    }
}

#[test]
fn flat_projection_needs_non_negative_approach_terms() {
    let flat = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 4.0 };
    let forward = DriveParameters { tooth: flat, ..PAPER_5_1 };
    let backward = DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..forward };
    let projected = |law| LoadParameters { law, ..load(20.0, Projection) };
    let case = LoadCase::new(&projected(ContactLaw::Palmgren)).unwrap();
    let refused = sweep::sweep(&drive(&backward), &case, Points::samples(10).unwrap(), &Never);
    assert!(matches!(refused, Err(SolveError::ComplianceNotPositive { .. })), "{refused:?}");
    for (p, law) in [(forward, ContactLaw::Palmgren), (forward, ContactLaw::Linear), (backward, ContactLaw::Linear)] {
        let drive = drive(&p);
        let case = LoadCase::new(&projected(law)).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let mesh = Mesh::new(&drive);
        let teeth: Vec<_> =
            mesh.placed_at(1, Samples::new(3).unwrap()).map(|placed| loaded.tooth(placed.position).unwrap()).collect();
        let wind_up = loaded.wind_up(&teeth).unwrap();
        let (modulus_mpa, s) = (case.parameters().materials.contact_modulus_mpa(Contact::Carrier), drive.sense());
        for tooth in &teeth {
            let force_n = loaded.forces_n(tooth, &wind_up).unwrap();
            let approach_mm = |force_n: f64| match law {
                ContactLaw::Palmgren => 3.84e-5 * force_n.powf(0.9) / 15.0_f64.powf(0.8),
                _ => force_n / (0.5 * PI * 15.0 * modulus_mpa),
            };
            let Pressure::Flat(borne) = &tooth.pressure.carrier else { panic!("no flat") };
            let (gamma, beta) = (tooth.center.tan_pressure_angle.atan(), tooth.flank.tan_pressure_angle.atan());
            let way_mm = approach_mm(force_n.wave_generator)
                + (gamma + s * beta).cos() * approach_mm(force_n.ring)
                + s * gamma.sin() * borne.compliance_mm_per_n(modulus_mpa) * force_n.carrier;
            let off = way_mm / (wind_up.rotation_rad() * tooth.center.lever_arm_mm) - 1.0;
            assert!(off.abs() < 1e-12, "{law:?}: {off:e}");
        }
    }
}

#[test]
fn palmgrens_law_is_not_questioned_at_flats() {
    let bronze = Material { youngs_modulus_gpa: 110.0, poissons_ratio: 0.34 };
    let flat = ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 4.0 };
    let mut parameters = LoadParameters { law: ContactLaw::Palmgren, ..load(20.0, VirtualWork) };
    parameters.materials.carrier = bronze;
    let found = |tooth| {
        let p = DriveParameters { tooth, ..PAPER_5_1 };
        let case = LoadCase::new(&parameters).unwrap();
        findings::of_contacts(&drive(&p), &case, &swept(&p, &parameters, 10).peaks, false)
    };
    let of_cylinders = found(ToothShape::Cylinder { width_mm: 15.0 });
    let places: Vec<_> = of_cylinders.iter().map(|finding| (finding.code, finding.contact)).collect();
    assert_eq!(places, [(FindingCode::PalmgrenBeyondSteel, Some(Contact::Carrier))]);
    assert_eq!(found(flat), []);
}

#[test]
fn only_balls_take_hertz_beside_fixed() {
    let ball = ToothShape::Ball { groove_radius_mm: PerContact::default() };
    let accepts = |law, tooth| {
        let drive = drive(&DriveParameters { tooth, ..PAPER_5_1 });
        let case = LoadCase::new(&LoadParameters { law, ..load(20.0, VirtualWork) }).unwrap();
        match LoadedDrive::new(&drive, &case) {
            Ok(_) => true,
            Err(error) => {
                let SolveError::Impossible(found) = error else { panic!("{error:?}") };
                let about = found.iter().map(|v| (v.code, v.parameter)).collect::<Vec<_>>();
                assert_eq!(about, [(FieldCode::ConflictingFields, Parameter::Law)]);
                assert!(found[0].to_string().starts_with("balls take `hertz` or `fixed`"), "{found:?}");
                false
            }
        }
    };
    let fixed = ContactLaw::Fixed(PerContact { wave_generator: 1e5, ring: 1e5, carrier: 1e5 });
    assert!(accepts(ContactLaw::Hertz, ball) && accepts(fixed, ball));
    assert!(
        !accepts(ContactLaw::Linear, ball)
            && !accepts(ContactLaw::Palmgren, ball)
            && !accepts(ContactLaw::JOHNSON, ball)
    );
    assert!(!accepts(ContactLaw::Hertz, PAPER_5_1.tooth));
}

proptest! {
    #![proptest_config(cases(512))]

    #[test]
    fn stress_matches_force_for_every_ellipse(one in -6.0_f64..3.0, other in -6.0_f64..3.0, power in -6.0_f64..6.0) {
        let contact = EllipticContact::new(10.0_f64.powf(one), 10.0_f64.powf(other), 1.1e5).unwrap();
        let force_n = 10.0_f64.powf(power);
        prop_assert!((contact.force_n(contact.stress_mpa(force_n)) / force_n - 1.0).abs() < 1e-14);
        // The larger curvature lies along the shorter half-axis.
        prop_assert_eq!(one >= other, contact.half_width_mm(force_n) <= contact.half_length_mm(force_n));
        let turned = EllipticContact::new(10.0_f64.powf(other), 10.0_f64.powf(one), 1.1e5).unwrap();
        prop_assert!((turned.half_length_mm(force_n) / contact.half_width_mm(force_n) - 1.0).abs() < 1e-13);
    }
}
