//! Bending of the ring's teeth: against finite elements, and its effect on loads.

use serde_json::Value;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::ring_bending::RingBending;
use toothwave_solver::{
    ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Material, Parameter, PerContact, Position,
    ToothShape, Violation, WaveGenerator,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, ellipse, load, swept};

/// Returns `(1 - ν²)/(π E L1)` of a ring.
fn unit_mm_per_n(drive: &Drive, ring: &Material) -> f64 {
    let modulus_mpa = 1e3 * ring.youngs_modulus_gpa / (1.0 - ring.poissons_ratio.powi(2));
    1.0 / (std::f64::consts::PI * modulus_mpa * drive.tooth_width_mm())
}

/// Returns the ring's compliance at a position minus the one at its root, in [`unit_mm_per_n`].
fn beyond_root(drive: &Drive, ring: &Material) -> impl Fn(f64) -> f64 {
    let bending = RingBending::new(drive, ring).unwrap();
    let unit_mm_per_n = unit_mm_per_n(drive, ring);
    move |position_deg: f64| {
        let tooth = drive.flank().locus().at(Position::from_lobe(position_deg.to_radians(), drive.lobes())).unwrap();
        let contact = drive.flank().point(&tooth, &drive.flank().at(&tooth));
        bending.compliance_mm_per_n(contact) / unit_mm_per_n
    }
}

/// The contact's own approach is about 21 of these units, so 0.2 is a hundredth of it.
#[test]
fn case_5_2_teeth_bend_like_finite_elements() {
    let found: Value = serde_json::from_str(include_str!("../finite_elements/ring_teeth.json")).unwrap();
    let teeth = found["teeth"].as_array().unwrap();
    let number = |tooth: &Value, name: &str| tooth[name].as_f64().unwrap();
    let drive = drive(&PAPER_5_2);
    let at = beyond_root(&drive, &Material::STEEL);
    assert_eq!(teeth.len(), 15);
    for tooth in teeth {
        let position_deg = number(tooth, "position_deg");
        let expected = number(tooth, "beyond") - number(&teeth[0], "beyond");
        let found = at(position_deg);
        assert!((found - expected).abs() < 0.2, "{position_deg}: {found}, by finite elements {expected}");
    }
}

/// Michell: a force at a wedge's corner moves it more than a half-plane, with any land beyond.
#[test]
fn bored_ring_is_softer_near_its_corner() {
    let wide_land = DriveParameters {
        wave_generator: ellipse(669.53, 572.498),
        teeth: 27,
        installed: 27,
        ring_teeth: 29,
        tooth_radius_mm: 39.783,
        tip_radius_mm: Some(700.92),
        ..PAPER_5_1
    };
    for parameters in [PAPER_5_2_BORED, wide_land] {
        let drive = drive(&parameters);
        let at = beyond_root(&drive, &Material::STEEL);
        let end_deg = drive.flank_limit().position.from_lobe_deg();
        let last_tenth: Vec<_> = (0..=100).map(|step| at((0.9 + 0.001 * f64::from(step)) * end_deg)).collect();
        assert!(last_tenth.is_sorted(), "{parameters:?}: {last_tenth:?}");
    }
}

#[test]
fn ring_with_few_teeth_bends_most_at_root() {
    let shallow = DriveParameters { wave_generator: ellipse(58.0, 57.99), ..PAPER_5_1 };
    let drive = drive(&shallow);
    let at = beyond_root(&drive, &Material::STEEL);
    for position_deg in [5.0, 20.0, 45.0, 70.0, 89.0] {
        assert!(at(position_deg).abs() < 0.1, "{position_deg}: {}", at(position_deg));
    }
}

/// A scaled ring, or another material of the same Poisson's ratio, bends by as many units.
#[test]
fn bending_is_independent_of_scale() {
    let larger = DriveParameters {
        wave_generator: ellipse(507.0, 493.0),
        tooth_radius_mm: 15.0,
        tooth: ToothShape::Cylinder { width_mm: 20.0 },
        ..PAPER_5_2
    };
    let (one, other) = (drive(&PAPER_5_2), drive(&larger));
    let brass = Material { youngs_modulus_gpa: 100.0, ..Material::STEEL };
    let (one, other) = (beyond_root(&one, &Material::STEEL), beyond_root(&other, &brass));
    for position_deg in [3.0, 15.0, 30.0, 40.0, 43.0] {
        assert!((one(position_deg) - other(position_deg)).abs() < 1e-9, "{position_deg}");
    }
}

/// The last ring is cached.
#[test]
fn cached_ring_bends_like_new_one() {
    let (one, other) = (drive(&PAPER_5_2), drive(&PAPER_5_2_BORED));
    let new = |drive| RingBending::new(drive, &Material::STEEL).unwrap();
    let first = new(&one);
    let remembered = new(&one);
    let between = new(&other);
    assert_eq!((first, remembered), (new(&one), first));
    assert_ne!(between, first);
    let softer = Material { poissons_ratio: 0.45, ..Material::STEEL };
    assert_ne!(RingBending::new(&one, &softer).unwrap(), first);
}

/// By virtual work with given stiffnesses, each force is rotation times arm over the sum of compliances.
#[test]
fn bending_acts_as_ring_compliance_in_load_sharing() {
    let stiffness_n_per_mm = PerContact { wave_generator: 4e5, ring: 3e5, carrier: 5e5 };
    let rigid = LoadParameters { law: ContactLaw::Fixed(stiffness_n_per_mm), ..load(3.0, VirtualWork) };
    for parameters in [PAPER_5_2, PAPER_5_2_BORED, PAPER_5_1] {
        let drive = drive(&parameters);
        let bending = RingBending::new(&drive, &Material::STEEL).unwrap();
        let sweep = swept(&parameters, &LoadParameters { ring_teeth_bend: true, ..rigid }, 20);
        let states = &sweep.states;
        for &input_angle_deg in &sweep.input_angles.input_angle_deg {
            let (mut torque_nmm, mut forces) = (0.0, Vec::new());
            let carries = |at: &usize| states.force_n.wave_generator[*at] > 0.0;
            for at in (0..states.len()).filter(|&at| states.input_angle_deg[at] == input_angle_deg).filter(carries) {
                let position = Position::from_lobe(states.position_deg[at].to_radians(), drive.lobes());
                let tooth = drive.flank().locus().at(position).unwrap();
                let point = drive.flank().at(&tooth);
                let bend = bending.compliance_mm_per_n(drive.flank().point(&tooth, &point));
                let ring = states.force_n.ring[at] / states.force_n.wave_generator[at];
                let carrier = states.force_n.carrier[at] / states.force_n.wave_generator[at];
                let compliance = 1.0 / 4e5 + ring * ring * (1.0 / 3e5 + bend) + carrier * carrier / 5e5;
                let arm_mm = tooth.lever_arm_mm;
                let share = arm_mm / compliance;
                torque_nmm += f64::from(drive.lobes()) * arm_mm * share;
                forces.push((share, states.force_n.wave_generator[at]));
            }
            let turned_rad = 3000.0 / torque_nmm;
            for (share, force_n) in forces.into_iter().filter(|(share, _)| *share > 1e-3) {
                assert!((turned_rad * share / force_n - 1.0).abs() < 1e-6, "{input_angle_deg}: {force_n}");
            }
        }
    }
}

#[test]
fn projection_rejects_bending_ring_teeth() {
    let refused = LoadCase::new(&LoadParameters { ring_teeth_bend: true, ..load(3.0, Projection) });
    assert_eq!(refused, Err(vec![Violation::needs_virtual_work(Parameter::RingTeethBend)]));
}

/// Includes rings of few teeth, very short flanks, and all kinds of tips.
#[test]
fn every_ring_bends_by_finite_amount() {
    let eccentric = |teeth: i64| DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 20.0, eccentricity_mm: 0.5 },
        teeth,
        installed: teeth,
        ring_teeth: teeth - 1,
        tooth_radius_mm: 1.0,
        ..PAPER_5_1
    };
    let few = [3, 4, 5, 6, 7, 40].map(eccentric);
    for parameters in few.into_iter().chain([PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED]) {
        let drive = drive(&parameters);
        let at = beyond_root(&drive, &Material::STEEL);
        let end_deg = drive.flank_limit().position.from_lobe_deg();
        for share in [0.0, 1e-6, 0.1, 0.5, 0.9, 0.999_999, 1.0] {
            let found = at(share * end_deg);
            assert!((0.0..60.0).contains(&found), "{parameters:?} at {share}: {found}");
        }
    }
}

#[test]
fn bending_is_continuous_along_flank() {
    const STEPS: u32 = 4000;
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        let drive = drive(&parameters);
        let at = beyond_root(&drive, &Material::STEEL);
        let end_deg = drive.flank_limit().position.from_lobe_deg();
        let values: Vec<_> = (0..=STEPS).map(|step| at(f64::from(step) / f64::from(STEPS) * end_deg)).collect();
        let largest = values.iter().copied().fold(0.0, f64::max);
        let bend = values.windows(3).map(|three| (three[0] - 2.0 * three[1] + three[2]).abs()).fold(0.0, f64::max);
        assert!(bend < 1e-4 * largest, "{parameters:?}: {bend} of {largest}");
    }
}
