//! Fingers of the carrier: against dense solutions of beams, and against the drive under its own capacity.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Matrix4};
use serde::Deserialize;
use toothwave_solver::Compatibility::VirtualWork;
use toothwave_solver::backing::{Backing, Backings, Support};
use toothwave_solver::drive::Draft;
use toothwave_solver::fingers::{
    CarrierFingers, FOOT_IN_DISC, FingerBeam, FingerParameters, Fingers, LoadCycle, Overhang, Strength,
    slice_compliance_mm2_per_n, stress_concentration,
};
use toothwave_solver::parts::PartsParameters;
use toothwave_solver::sweep::{self, LimitedBy, Points, SweepPeaks};
use toothwave_solver::{
    ContactLaw, DriveParameters, LoadCase, LoadParameters, Material, Never, PerContact, ToothShape, Torque,
};

use crate::drives::{ECCENTRIC, PAPER_5_1, PAPER_5_2, drive, everywhere, load};

const HOLDINGS: [Fingers; 4] =
    [Fingers::HeldAtOneEnd, Fingers::HeldAtBothEnds, Fingers::FarEndsJoined, Fingers::WebInTheMiddle];

/// 42CrMo4 +QT up to 16 mm.
const HEAT_TREATED: Strength =
    Strength { yield_mpa: 900.0, tensile_mpa: 1100.0, endurance_mpa: 495.0, is_hardened: false };

fn johnson(torque_nm: f64) -> LoadParameters {
    let depth_mm = PerContact { wave_generator: None, ring: None, carrier: None };
    LoadParameters { law: ContactLaw::Johnson { depth_mm }, ..load(torque_nm, VirtualWork) }
}

fn beam(parameters: &DriveParameters) -> FingerBeam {
    let (draft, parts) = (Draft::new(parameters).unwrap(), PartsParameters::default());
    *Backings::of(&drive(parameters), &draft, &parts, Support::default()).finger().unwrap()
}

fn fingers(parameters: &DriveParameters, p: FingerParameters, load: &LoadParameters) -> CarrierFingers {
    CarrierFingers::new(&drive(parameters), beam(parameters), p, load).unwrap()
}

fn held(fingers: Fingers) -> FingerParameters {
    FingerParameters { fingers: Some(fingers), ..FingerParameters::default() }
}

/// Presses a cantilever on many springs: influence coefficients, without hyperbolic functions.
fn pressed_cantilever(x: f64) -> Overhang {
    const SLICES: usize = 400;
    // Unit length and bending stiffness: x⁴ = 1/(4 c).
    let slice = 0.25 / x.powi(4);
    let width = 1.0 / SLICES as f64;
    let at = |i: usize| (i as f64 + 0.5) * width;
    let influence = |i: usize, j: usize| {
        let (near, far) = (at(i).min(at(j)), at(i).max(at(j)));
        near * near * (3.0 * far - near) / 6.0
    };
    let flexibility =
        DMatrix::from_fn(SLICES, SLICES, |i, j| influence(i, j) * width + if i == j { slice } else { 0.0 });
    let pressed = flexibility.lu().solve(&DVector::from_element(SLICES, 1.0)).unwrap();
    let mean = pressed.mean();
    let moment: f64 = (0..SLICES).map(|i| pressed[i] * at(i) * width).sum();
    // At the foot itself, from the first two slices: the load is level there.
    let foot = pressed[0] + (pressed[0] - pressed[1]) / 8.0;
    Overhang { peak_over_mean: foot / mean, moment_over_force_length: moment / mean }
}

#[test]
fn overhanging_load_matches_dense_springs() {
    for x in [0.1, 0.5, 1.0, 1.7, 2.5, 4.0] {
        let (found, expected) = (Overhang::of_relative_length(x), pressed_cantilever(x));
        let off = |found: f64, expected: f64| (found / expected - 1.0).abs();
        assert!(off(found.peak_over_mean, expected.peak_over_mean) < 1e-4, "{x}: {found:?}, {expected:?}");
        assert!(
            off(found.moment_over_force_length, expected.moment_over_force_length) < 1e-4,
            "{x}: {found:?}, {expected:?}"
        );
    }
}

#[test]
fn overhanging_load_has_limits_of_stiff_and_long_beams() {
    let stiff = Overhang::of_relative_length(1e-4);
    assert!((stiff.peak_over_mean - 1.0).abs() < 1e-12 && (stiff.moment_over_force_length - 0.5).abs() < 1e-12);
    let [below, above] = [20.0 - 1e-9, 20.0 + 1e-9].map(Overhang::of_relative_length);
    assert!((below.peak_over_mean / above.peak_over_mean - 1.0).abs() < 1e-9);
    assert!((below.moment_over_force_length / above.moment_over_force_length - 1.0).abs() < 1e-9);
}

/// Moments at the feet and mean deflections of fingers of unit bending stiffness and length 1, by Hermite elements.
struct DenseFingers {
    moments: Vec<f64>,
    deflections: Vec<f64>,
}

const ELEMENTS: usize = 8;

/// Solves fingers under even loads whose feet, and far ends if they are held, turn by `foot` for each unit of moment.
/// `is_far_end_held` fixes far ends, `is_joined` lets them sway together.
fn dense_fingers(forces: &[f64], foot: f64, is_far_end_held: bool, is_joined: bool) -> DenseFingers {
    let h = 1.0 / ELEMENTS as f64;
    let stiffness = Matrix4::new(
        12.0,
        6.0 * h,
        -12.0,
        6.0 * h,
        6.0 * h,
        4.0 * h * h,
        -6.0 * h,
        2.0 * h * h,
        -12.0,
        -6.0 * h,
        12.0,
        -6.0 * h,
        6.0 * h,
        2.0 * h * h,
        -6.0 * h,
        4.0 * h * h,
    ) / h.powi(3);
    let nodes = ELEMENTS + 1;
    let size = forces.len() * 2 * nodes;
    let mut matrix = DMatrix::<f64>::zeros(size + 1, size + 1);
    let mut right = DVector::<f64>::zeros(size + 1);
    const STIFF: f64 = 1e12;
    let turning = if foot > 0.0 { 1.0 / foot } else { STIFF };
    for (finger, &force) in forces.iter().enumerate() {
        let at = |node: usize, turn: usize| finger * 2 * nodes + 2 * node + turn;
        for element in 0..ELEMENTS {
            let of = [at(element, 0), at(element, 1), at(element + 1, 0), at(element + 1, 1)];
            for (i, &row) in of.iter().enumerate() {
                for (j, &column) in of.iter().enumerate() {
                    matrix[(row, column)] += stiffness[(i, j)];
                }
            }
            for (row, share) in of.into_iter().zip([h / 2.0, h * h / 12.0, h / 2.0, -h * h / 12.0]) {
                right[row] += force * share;
            }
        }
        matrix[(at(0, 0), at(0, 0))] += STIFF;
        matrix[(at(0, 1), at(0, 1))] += turning;
        if is_far_end_held || is_joined {
            matrix[(at(ELEMENTS, 1), at(ELEMENTS, 1))] += turning;
            // Tied to the ring, the last unknown, which is fixed or free.
            let (end, ring) = (at(ELEMENTS, 0), size);
            for (row, column, sign) in [(end, end, 1.0), (ring, ring, 1.0), (end, ring, -1.0), (ring, end, -1.0)] {
                matrix[(row, column)] += sign * STIFF;
            }
        }
    }
    if !is_joined {
        matrix[(size, size)] += STIFF;
    }
    let found = matrix.lu().solve(&right).unwrap();
    let of_finger = |finger: usize| {
        let at = |node: usize, turn: usize| found[finger * 2 * nodes + 2 * node + turn];
        // Simpson's rule over each element, with the middle of its Hermite cubic and the load's own part.
        let mean: f64 = (0..ELEMENTS)
            .map(|element| {
                let [a, b] = [element, element + 1].map(|node| (at(node, 0), at(node, 1)));
                h * (0.5 * (a.0 + b.0) + h * (a.1 - b.1) / 12.0) + forces[finger] * h.powi(5) / 720.0
            })
            .sum();
        let foot_reaction = stiffness.row(1) * nalgebra::Vector4::new(at(0, 0), at(0, 1), at(1, 0), at(1, 1));
        (-(foot_reaction[0] - forces[finger] * h * h / 12.0), mean)
    };
    let (moments, deflections) = (0..forces.len()).map(of_finger).unzip();
    DenseFingers { moments, deflections }
}

#[derive(Deserialize)]
struct Results {
    fingers: Vec<Solid>,
}

/// A finger of finite elements on its disc.
#[derive(Deserialize)]
struct Solid {
    inner_mm: f64,
    outer_mm: f64,
    slot_half_width_mm: f64,
    count: i64,
    length_mm: f64,
    slice_mm2_per_n: f64,
    at_one_end: AtOneEnd,
    at_both_ends: AtBothEnds,
}

#[derive(Deserialize)]
struct AtOneEnd {
    compliance_mm_per_n: f64,
    load_peak_over_mean: f64,
    moment_over_force_length: f64,
}

#[derive(Deserialize)]
struct AtBothEnds {
    compliance_mm_per_n: f64,
    moment_over_force_length: f64,
}

impl Solid {
    fn beam(&self) -> FingerBeam {
        let middle_mm = 0.5 * (self.inner_mm + self.outer_mm);
        FingerBeam {
            length_mm: self.length_mm,
            thickness_mm: 2.0 * (middle_mm * (PI / self.count as f64).sin() - self.slot_half_width_mm),
            height_mm: self.outer_mm - self.inner_mm,
            count: self.count,
            foot: FOOT_IN_DISC,
        }
    }
}

/// `tests/finite_elements/fingers.py`. A short finger between two discs gives way more than its beam.
#[test]
fn fingers_match_finite_elements() {
    let Results { fingers } = serde_json::from_str(include_str!("../finite_elements/fingers.json")).unwrap();
    for (solid, between_discs) in fingers.iter().zip([0.1, 0.17]) {
        let beam = solid.beam();
        let compliance = |fingers| beam.compliance_mm_per_n(&Material::STEEL, fingers);
        let overhang = Overhang::of_beam(&beam, &Material::STEEL, solid.slice_mm2_per_n);
        let Solid { at_one_end, at_both_ends, .. } = solid;
        for (what, found, expected, allowed) in [
            ("compliance", compliance(Fingers::HeldAtOneEnd), at_one_end.compliance_mm_per_n, 0.1),
            ("κ", overhang.peak_over_mean, at_one_end.load_peak_over_mean, 0.1),
            ("m", overhang.moment_over_force_length, at_one_end.moment_over_force_length, 0.1),
            ("between discs", compliance(Fingers::HeldAtBothEnds), at_both_ends.compliance_mm_per_n, between_discs),
        ] {
            assert!((found / expected - 1.0).abs() < allowed, "{what}: {found:e}, by finite elements {expected:e}");
        }
        // Of rigid discs, on the safe side.
        assert!((1.0..1.25).contains(&(1.0 / 12.0 / at_both_ends.moment_over_force_length)));
    }
}

/// Forces on five fingers, of which three carry.
const FORCES: [f64; 5] = [3.0, 7.0, 5.0, 0.0, 0.0];

#[test]
fn moments_at_foot_match_dense_beams() {
    let mean = FORCES.iter().sum::<f64>() / 5.0;
    // 28 fingers at a mean radius of 62 mm.
    let torque_nm = 1e-3 * 28.0 * 62.0 * mean;
    for (holding, is_far_end_held, is_joined) in
        [(Fingers::HeldAtBothEnds, true, false), (Fingers::FarEndsJoined, false, true)]
    {
        let dense = dense_fingers(&FORCES, 0.0, is_far_end_held, is_joined).moments;
        let of = fingers(&PAPER_5_1, held(holding), &johnson(1.0));
        for (force, expected) in FORCES.iter().zip(dense) {
            let found = of.stress(*force, torque_nm).moment_nmm / of.beam().length_mm;
            assert!((found - expected).abs() < 1e-3, "{found}, expected {expected}");
        }
    }
}

/// Fingers so long that shear does not matter, with unit bending stiffness.
fn long_fingers(foot: f64) -> (FingerBeam, Material) {
    let beam = FingerBeam { length_mm: 1e3, thickness_mm: 1.0, height_mm: 12.0, count: i64::MAX, foot };
    (beam, Material { youngs_modulus_gpa: 1e-3, poissons_ratio: 0.0 })
}

#[test]
fn compliances_match_dense_beams() {
    // With E = 1, I = 1 and h t² = 12 the foot turns by foot/12 for each unit of moment, L/foot-th of the beam's own.
    for foot in [0.0, 600.0] {
        let (beam, material) = long_fingers(foot);
        let compliance = |fingers| beam.compliance_mm_per_n(&material, fingers) / 1e9;
        let per_moment = foot / 12.0 / 1e3;
        let one = |is_far_end_held| dense_fingers(&[1.0], per_moment, is_far_end_held, false).deflections[0];
        for (found, expected) in [
            (compliance(Fingers::HeldAtOneEnd), one(false)),
            (compliance(Fingers::HeldAtBothEnds), one(true)),
            // Each half has half of the force and half of the length; its foot is as soft.
            (8.0 * 2.0 * compliance(Fingers::WebInTheMiddle), {
                dense_fingers(&[1.0], 2.0 * per_moment, false, false).deflections[0]
            }),
        ] {
            assert!((found / expected - 1.0).abs() < 1e-4, "{foot}: {found:e}, expected {expected:e}");
        }
        // Springs of one compliance do the work of fingers that a ring joins.
        let forces: Vec<_> = (0..40).map(|i| (2.0 * PI * (f64::from(i) + 0.5) / 40.0).sin().max(0.0)).collect();
        let dense = dense_fingers(&forces, per_moment, false, true);
        let work: f64 = forces.iter().zip(&dense.deflections).map(|(force, deflection)| force * deflection).sum();
        let expected = work / forces.iter().map(|force| force * force).sum::<f64>();
        let found = compliance(Fingers::FarEndsJoined);
        assert!((found / expected - 1.0).abs() < 3e-3, "{foot}: {found:e}, expected {expected:e}");
    }
}

#[test]
fn elastic_disc_and_radial_bending_add_measured_compliance() {
    for parameters in [PAPER_5_1, ECCENTRIC] {
        let beam = beam(&parameters);
        let rigid = FingerBeam { foot: 0.0, count: i64::MAX, ..beam };
        let more = |fingers| {
            beam.compliance_mm_per_n(&Material::STEEL, fingers) / rigid.compliance_mm_per_n(&Material::STEEL, fingers)
        };
        let (one, both) = (more(Fingers::HeldAtOneEnd), more(Fingers::HeldAtBothEnds));
        assert!((1.28..1.9).contains(&one) && (1.25..1.9).contains(&both), "{one}, {both}");
    }
}

#[test]
fn load_runs_to_foot_of_paper_cases() {
    let of = |parameters: &DriveParameters| fingers(parameters, held(Fingers::HeldAtOneEnd), &johnson(1.0));
    for (parameters, least, most) in [(PAPER_5_1, 1.9, 2.0), (ECCENTRIC, 2.0, 2.3), (PAPER_5_2, 2.9, 3.3)] {
        let found = of(&parameters).load_peak_over_mean();
        assert!((least..=most).contains(&found), "{found}");
    }
    // Held otherwise or not known to be held so, a tooth presses evenly.
    for parameters in [held(Fingers::HeldAtBothEnds), held(Fingers::FarEndsJoined), FingerParameters::default()] {
        assert_eq!(fingers(&PAPER_5_1, parameters, &johnson(1.0)).load_peak_over_mean(), 1.0);
    }
    let web = fingers(&PAPER_5_1, held(Fingers::WebInTheMiddle), &johnson(1.0)).load_peak_over_mean();
    assert!((1.15..1.19).contains(&web), "{web}");
}

#[test]
fn slice_compliance_is_that_of_whole_contacts() {
    let (p, drive) = (johnson(1.0), drive(&PAPER_5_1));
    let found = slice_compliance_mm2_per_n(&drive, &p).unwrap();
    // By hand from the formulas of Johnson's approach at the steepest place.
    assert!((found / 2.73e-4 - 1.0).abs() < 5e-3, "{found:e}");
    let fixed = LoadParameters { law: ContactLaw::Fixed(everywhere(1e6)), ..p };
    assert_eq!(slice_compliance_mm2_per_n(&drive, &fixed).unwrap(), found);
    let soft = Material { youngs_modulus_gpa: 105.0, ..Material::STEEL };
    let materials = toothwave_solver::Materials { wave_generator: soft, teeth: soft, ring: soft, carrier: soft };
    let twice = slice_compliance_mm2_per_n(&drive, &LoadParameters { materials, ..p }).unwrap();
    assert!((twice / found - 2.0).abs() < 1e-12, "{}", twice / found);
}

#[test]
fn stress_concentration_follows_table() {
    for (radius, expected) in [(0.05, 2.39), (0.1, 1.91), (0.15, 1.68), (0.2, 1.54)] {
        assert!((stress_concentration(radius) - expected).abs() < 1e-12);
    }
    let between = stress_concentration(0.12);
    assert!((stress_concentration(5.0) - 1.54).abs() < 1e-12);
    assert!((1.68..1.91).contains(&between) && stress_concentration(0.02) > 3.0);
}

#[test]
fn endured_stress_follows_load_cycle() {
    assert!((HEAT_TREATED.endured_mpa(LoadCycle::Pulsating) - 683.0).abs() < 0.5);
    assert_eq!(HEAT_TREATED.endured_mpa(LoadCycle::Reversed), 495.0);
    let safety = HEAT_TREATED.safety(LoadCycle::Reversed, 450.0, 2.0);
    assert_eq!((safety.yielding, safety.fatigue, safety.least()), (2.0, 0.55, 0.55));
    let hardened = Strength { is_hardened: true, ..HEAT_TREATED };
    assert_eq!(hardened.safety(LoadCycle::Reversed, 450.0, 2.0).yielding, 1.0);
}

#[test]
fn stress_at_foot_is_moment_over_section() {
    let (parameters, p) = (PAPER_5_1, johnson(1.0));
    let beam = beam(&parameters);
    let (sin, cos) = (PI / 28.0).sin_cos();
    let radial = cos + beam.thickness_mm / beam.height_mm * (sin + 0.1);
    for (how, moment_nmm) in [
        (Fingers::HeldAtBothEnds, 600.0 * 15.0 / 12.0),
        (Fingers::FarEndsJoined, 600.0 * 15.0 / 12.0 + 1e6 / (28.0 * 62.0) * 15.0 / 4.0),
    ] {
        let given = FingerParameters { fillet_radius_mm: Some(0.4), friction_coefficient: 0.1, ..held(how) };
        let stress = fingers(&parameters, given, &p).stress(600.0, 1e3);
        let nominal_mpa = 6.0 * moment_nmm / (beam.height_mm * beam.thickness_mm.powi(2)) * radial;
        assert!((stress.moment_nmm / moment_nmm - 1.0).abs() < 1e-12, "{} {moment_nmm}", stress.moment_nmm);
        assert!((stress.nominal_mpa / nominal_mpa - 1.0).abs() < 1e-12);
        let factor = 1.35 * stress_concentration(0.4 / beam.thickness_mm);
        assert!((stress.largest_mpa / stress.nominal_mpa / factor - 1.0).abs() < 1e-12);
        assert_eq!(stress.safety, None);
    }
    // The assumed cage, and a fillet of a tenth of the thickness.
    let assumed = fingers(&parameters, FingerParameters::default(), &p);
    assert!(assumed.is_assumed() && assumed.fingers() == Fingers::FarEndsJoined);
    assert!((assumed.fillet_radius_mm() / beam.thickness_mm - 0.1).abs() < 1e-12);
}

/// Sweeps a drive with its fingers.
fn peaks(parameters: &DriveParameters, fingers: &CarrierFingers, load: &LoadParameters) -> SweepPeaks {
    let case = LoadCase::new(load).unwrap();
    let run = |load: &LoadCase| sweep::peaks(&drive(parameters), load, Points::samples(50).unwrap(), &Never);
    fingers.limited(&case, run).unwrap()
}

/// Under the torque capacity what limits it is at its limit, and nothing is beyond.
#[test]
fn capacity_brings_its_limit_to_one() {
    let flat = DriveParameters { tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 3.0 }, ..PAPER_5_1 };
    let weak = Strength { yield_mpa: 200.0, tensile_mpa: 300.0, endurance_mpa: 120.0, is_hardened: false };
    let soft = Strength { yield_mpa: 60.0, tensile_mpa: 900.0, endurance_mpa: 800.0, is_hardened: false };
    let strong = Strength { yield_mpa: 9e3, tensile_mpa: 1e4, endurance_mpa: 5e3, is_hardened: false };
    let mut seen = Vec::new();
    for (parameters, clearance_um) in [(PAPER_5_1, 0.0), (PAPER_5_1, 5.0), (flat, 0.0), (ECCENTRIC, 2.0)] {
        for (how, strength) in
            HOLDINGS.into_iter().flat_map(|how| [weak, soft, HEAT_TREATED, strong].map(|of| (how, of)))
        {
            let p = LoadParameters {
                allowable_stress_mpa: Some(everywhere(1200.0)),
                clearance_um: everywhere(clearance_um),
                ..johnson(5.0)
            };
            let given = FingerParameters { strength: Some(strength), ..held(how) };
            let fingers = fingers(&parameters, given, &p);
            let capacity = peaks(&parameters, &fingers, &p).torque_capacity.unwrap();
            let under = LoadParameters { torque: Torque::Output(capacity.output_torque_nm), ..p };
            let reached = peaks(&parameters, &fingers, &under);
            let stress = fingers.stress(reached.contacts.carrier.force_n.value, capacity.output_torque_nm);
            let safety = stress.safety.unwrap();
            let of_contacts = fingers
                .peaks_along(&reached.contacts)
                .iter()
                .fold(0.0, |most: f64, (_, peaks)| most.max(peaks.stress_mpa.value));
            let used = match capacity.limited_by {
                LimitedBy::FingerYield => 1.0 / safety.yielding,
                LimitedBy::FingerFatigue => 1.0 / safety.fatigue,
                LimitedBy::WaveGenerator | LimitedBy::Ring | LimitedBy::Carrier => of_contacts / 1200.0,
            };
            let case = (how, clearance_um, capacity.limited_by, used);
            assert!((used - 1.0).abs() < 1e-9, "{case:?}");
            assert!(safety.least() > 1.0 - 1e-9 && of_contacts < 1200.0 * (1.0 + 1e-9), "{case:?} {safety:?}");
            // It does not depend on the load.
            let again = peaks(&parameters, &fingers, &under).torque_capacity.unwrap();
            assert!((again.output_torque_nm / capacity.output_torque_nm - 1.0).abs() < 1e-9);
            seen.push(capacity.limited_by);
        }
    }
    let limits = [LimitedBy::FingerYield, LimitedBy::FingerFatigue, LimitedBy::Ring];
    assert!(limits.iter().all(|limit| seen.contains(limit)), "{seen:?}");
}

#[test]
fn uneven_load_divides_capacity_of_contacts() {
    let p = LoadParameters { allowable_stress_mpa: Some(everywhere(1500.0)), ..johnson(5.0) };
    let even = fingers(&PAPER_5_1, FingerParameters::default(), &p);
    let uneven = fingers(&PAPER_5_1, held(Fingers::HeldAtOneEnd), &p);
    let [all, less] = [&even, &uneven].map(|fingers| peaks(&PAPER_5_1, fingers, &p).torque_capacity.unwrap());
    let factor = all.output_torque_nm / less.output_torque_nm;
    assert!((factor / uneven.load_peak_over_mean() - 1.0).abs() < 0.05, "{factor}");
    let found = uneven.peaks_along(&peaks(&PAPER_5_1, &uneven, &p).contacts);
    let means = peaks(&PAPER_5_1, &uneven, &p).contacts;
    let root = uneven.load_peak_over_mean().sqrt();
    for (contact, peak) in found.iter() {
        let mean = means.get(contact);
        assert_eq!(peak.stress_mpa.value, mean.stress_mpa.value * root);
        assert_eq!(peak.half_width_mm, mean.half_width_mm * root);
        assert_eq!(peak.force_n, mean.force_n);
    }
}

#[test]
fn estimated_compliance_is_that_of_holding() {
    let p = johnson(20.0);
    let case = LoadCase::new(&p).unwrap();
    for (how, backing) in [
        (None, Backing::FingerAtBothEnds),
        (Some(Fingers::HeldAtBothEnds), Backing::FingerAtBothEnds),
        (Some(Fingers::HeldAtOneEnd), Backing::FingerAtOneEnd),
        (Some(Fingers::FarEndsJoined), Backing::FingerJoinedAtFarEnd),
        (Some(Fingers::WebInTheMiddle), Backing::FingerOnWeb),
    ] {
        let support = Support { fingers: how, rim: None };
        let backings =
            Backings::of(&drive(&PAPER_5_1), &Draft::new(&PAPER_5_1).unwrap(), &PartsParameters::default(), support);
        let PerContact { carrier, .. } = backings.series_compliance_mm_per_n(&drive(&PAPER_5_1), case.parameters());
        let estimates = backings.estimates(&drive(&PAPER_5_1), case.parameters());
        let expected = estimates.iter().find(|estimate| estimate.backing == backing).unwrap().compliance_mm_per_n;
        assert_eq!(carrier, expected, "{how:?}");
        let alone = beam(&PAPER_5_1).compliance_mm_per_n(&Material::STEEL, how.unwrap_or(Fingers::HeldAtBothEnds));
        assert_eq!(expected, alone);
    }
    assert_eq!(beam(&PAPER_5_1).foot, FOOT_IN_DISC);
}
