//! The default model, virtual work with Johnson's law, against elastic bodies in contact
//! (`tests/finite_elements`, docs/explanation/validation.md).
//!
//! Each case is one input angle of a drive. Its parts are held 5 mm behind the contacts, the depth in Johnson's law.

use std::f64::consts::PI;

use serde::Deserialize;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::model_error::{self, Beyond, ErrorRange};
use toothwave_solver::{
    Compatibility, ContactLaw, Deviations, Drive, DriveParameters, LoadCase, LoadParameters, PerContact, Position,
    ToothShape, Torque, WaveGenerator,
};

use crate::corners;
use crate::drives::{ECCENTRIC, PAPER_5_1, PAPER_5_2, ellipse, load, swept};

/// Intervals in a period. Each case has the input angle of one of them.
const INTERVALS: u64 = 240;

#[derive(Deserialize)]
struct Results {
    single_contacts: Vec<SingleContact>,
    convergence: Vec<Refinement>,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct SingleContact {
    radius_mm: f64,
    force_n_per_mm: f64,
    depth_mm: f64,
    pressure_mpa: f64,
    /// Approach of the blocks on both sides.
    approach_mm: f64,
}

#[derive(Deserialize)]
struct Refinement {
    force_n: f64,
    wind_up_rad: f64,
}

#[derive(Deserialize)]
struct Case {
    drive: String,
    input_angle_deg: f64,
    ring_gap_um: f64,
    slot_gap_um: f64,
    depth_mm: f64,
    teeth: Vec<Tooth>,
    wind_up_rad: f64,
}

#[derive(Deserialize)]
struct Tooth {
    position_deg: f64,
    /// Forces at wave generator, ring and carrier.
    force_n: [f64; 3],
    pressure_mpa: [f64; 3],
}

/// Errors of the model as shares.
struct Errors {
    /// Error of the largest force at the wave generator.
    peak: f64,
    /// Error of the largest force at each contact.
    force: [f64; 3],
    /// Largest error of a tooth's force at the wave generator, over the largest force.
    worst_tooth: f64,
    /// Error of the pressure at each contact's largest force. Narrow contacts have few elements.
    stress: [f64; 3],
    wind_up: f64,
}

/// Allowed errors of the default model.
struct Allowed {
    peak: f64,
    worst_tooth: f64,
    stress: [f64; 3],
    wind_up: f64,
}

fn results() -> Results {
    serde_json::from_str(include_str!("../finite_elements/results.json")).unwrap()
}

impl Case {
    fn name(&self) -> String {
        let Self { drive, input_angle_deg, ring_gap_um, slot_gap_um, .. } = self;
        format!("{drive} at {input_angle_deg} deg, {ring_gap_um} µm at the ring, {slot_gap_um} µm at the slot")
    }

    /// Returns the allowed errors. The model ignores that the pointed ring teeth of case 5.2 bend.
    fn allowed(&self) -> Allowed {
        match self.drive.as_str() {
            "5.2" => Allowed { peak: 0.05, worst_tooth: 0.08, stress: [0.055; 3], wind_up: 0.06 },
            _ => Allowed { peak: 0.005, worst_tooth: 0.02, stress: [0.025, 0.025, 0.05], wind_up: 0.015 },
        }
    }

    fn has_gaps(&self) -> bool {
        self.ring_gap_um > 0.0 || self.slot_gap_um > 0.0
    }

    fn drive_and_torque_nm(&self) -> (DriveParameters, f64) {
        match self.drive.as_str() {
            "5.1" => (PAPER_5_1, 20.0),
            "5.2" => (PAPER_5_2, 3.0),
            "eccentric" => (ECCENTRIC, 5.0),
            other => panic!("no drive {other}"),
        }
    }

    /// Returns Johnson's law with depths up to where the case's bodies are held.
    fn johnson(&self) -> ContactLaw {
        ContactLaw::Johnson { depth_mm: PerContact::of(|_| Some(self.depth_mm)) }
    }

    fn load(&self, compatibility: Compatibility, law: ContactLaw) -> LoadParameters {
        let (_, torque_nm) = self.drive_and_torque_nm();
        LoadParameters {
            torque: Torque::Input(torque_nm),
            law,
            clearance_um: PerContact { wave_generator: 0.0, ring: self.ring_gap_um, carrier: self.slot_gap_um },
            ..load(torque_nm, compatibility)
        }
    }

    /// Returns the model's errors. Each tooth lies offset in its slot by the gap, and so farther back on the flank.
    fn errors_under(&self, load: &LoadParameters) -> Errors {
        let (parameters, _) = self.drive_and_torque_nm();
        let drive = Drive::new(&parameters).unwrap();
        let case = LoadCase::new(load).unwrap();
        let loaded = LoadedDrive::new(&drive, &case).unwrap();
        let on_flank = |tooth: &Tooth| {
            let slot_rad = tooth.position_deg.to_radians();
            let at = |position_rad: f64| Position::from_lobe(position_rad, drive.lobes());
            let center_radius_mm = drive.flank().locus().at(at(slot_rad)).unwrap().center_radius_mm;
            let back_rad = drive.flank().teeth_per_wave() * 1e-3 * self.slot_gap_um / center_radius_mm;
            loaded.tooth(at(slot_rad - back_rad)).unwrap()
        };
        let teeth: Vec<_> = self.teeth.iter().map(on_flank).collect();
        let found = loaded.wind_up(&teeth).unwrap();
        let of_model = |tooth: &ToothState| {
            let force_n = loaded.forces_n(tooth, &found).unwrap();
            let stress_mpa = loaded.stress_mpa(tooth, &force_n);
            let of = |values: &PerContact<f64>| [values.wave_generator, values.ring, values.carrier];
            (of(&force_n), of(&stress_mpa))
        };
        let model: Vec<_> = teeth.iter().map(of_model).collect();

        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let peak_n = largest(&mut self.teeth.iter().map(|tooth| tooth.force_n[0]));
        let peak_of_model_n = largest(&mut model.iter().map(|(force_n, _)| force_n[0]));
        let force = [0, 1, 2].map(|contact| {
            let of_model_n = largest(&mut model.iter().map(|(force_n, _)| force_n[contact]));
            of_model_n / largest(&mut self.teeth.iter().map(|tooth| tooth.force_n[contact])) - 1.0
        });
        let misses = self.teeth.iter().zip(&model).map(|(tooth, (force_n, _))| (force_n[0] - tooth.force_n[0]).abs());
        let stress = [0, 1, 2].map(|contact| {
            let by_force = |a: &(&Tooth, _), b: &(&Tooth, _)| a.0.force_n[contact].total_cmp(&b.0.force_n[contact]);
            let (tooth, (_, stress_mpa)) = self.teeth.iter().zip(&model).max_by(by_force).unwrap();
            stress_mpa[contact] / tooth.pressure_mpa[contact] - 1.0
        });
        Errors {
            peak: peak_of_model_n / peak_n - 1.0,
            force,
            worst_tooth: largest(&mut misses.map(|miss_n| miss_n / peak_n)),
            stress,
            wind_up: found.rotation_rad() / self.wind_up_rad - 1.0,
        }
    }
}

fn percent(share: f64) -> f64 {
    100.0 * share
}

#[test]
fn single_contacts_match_hertz_pressure_and_johnson_approach() {
    for contact in results().single_contacts {
        let SingleContact { radius_mm, force_n_per_mm, depth_mm, pressure_mpa, approach_mm } = contact;
        let modulus_mpa = 210e3 / (1.0 - 0.3 * 0.3);
        let half_width_mm = (8.0 * force_n_per_mm * radius_mm / (PI * modulus_mpa)).sqrt();
        let hertz_mpa = 2.0 * force_n_per_mm / (PI * half_width_mm);
        assert!((pressure_mpa / hertz_mpa - 1.0).abs() < 0.015, "{pressure_mpa} MPa, by Hertz {hertz_mpa}");
        // Both sides of the disc approach it (docs/explanation/theory.md 4.3).
        let johnson_mm = force_n_per_mm / (PI * modulus_mpa)
            * (2.0 * (4.0 * radius_mm / half_width_mm).ln() - 1.0 + 2.0 * (2.0 * depth_mm / half_width_mm).ln()
                - 0.3 / 0.7);
        assert!((approach_mm / johnson_mm - 1.0).abs() < 0.02, "{approach_mm} mm, by Johnson {johnson_mm}");
    }
}

#[test]
fn finer_elements_change_no_compared_result() {
    let convergence = results().convergence;
    let [.., finer, finest] = &convergence[..] else { panic!("two refinements at least") };
    assert!((finer.force_n / finest.force_n - 1.0).abs() < 1e-3);
    assert!((finer.wind_up_rad / finest.wind_up_rad - 1.0).abs() < 1e-3);
}

#[test]
fn default_model_matches_elastic_bodies() {
    let cases = results().cases;
    assert_eq!(cases.len(), 20);
    for case in cases {
        let Errors { peak, worst_tooth, stress, wind_up, .. } =
            case.errors_under(&case.load(VirtualWork, case.johnson()));
        let allowed = case.allowed();
        let name = case.name();
        println!(
            "{name}: peak {:+.2} %, worst tooth {:.2} % of it, stress {:+.2?} %, wind-up {:+.2} %",
            percent(peak),
            percent(worst_tooth),
            stress.map(percent),
            percent(wind_up)
        );
        assert!(peak.abs() < allowed.peak, "{name}: peak force {:+.2} %", percent(peak));
        assert!(worst_tooth < allowed.worst_tooth, "{name}: worst tooth {:.2} %", percent(worst_tooth));
        assert!((0..3).all(|contact| stress[contact].abs() < allowed.stress[contact]), "{name}: stress {stress:?}");
        assert!(wind_up.abs() < allowed.wind_up, "{name}: wind-up {:+.2} %", percent(wind_up));
    }
}

/// The refinements are bending ring teeth and, with gaps, the moving wave generator.
#[test]
fn refined_model_matches_elastic_bodies_more_closely() {
    for case in results().cases {
        for wave_generator_moves in [false, true] {
            let own = case.load(VirtualWork, case.johnson());
            let load = LoadParameters { ring_teeth_bend: true, wave_generator_moves, ..own };
            let Errors { peak, worst_tooth, wind_up, .. } = case.errors_under(&load);
            let [peak_to, worst_to] = match (case.drive.as_str(), wave_generator_moves || !case.has_gaps()) {
                (_, true) => [0.006, 0.012],
                ("5.2", false) => [0.037, 0.082],
                (_, false) => [0.006, 0.018],
            };
            let name = format!("{}, wave generator moves: {wave_generator_moves}", case.name());
            println!("{name}: {:+.2} {:.2} {:+.2}", percent(peak), percent(worst_tooth), percent(wind_up));
            assert!(peak.abs() < peak_to, "{name}: peak force {:+.2} %", percent(peak));
            assert!(worst_tooth < worst_to, "{name}: worst tooth {:.2} %", percent(worst_tooth));
            assert!(wind_up.abs() < 0.008, "{name}: wind-up {:+.2} %", percent(wind_up));
        }
    }
}

/// The least and the largest error of force, stress and wind-up.
pub(crate) type Found = [(f64, f64); 3];

pub(crate) const NOTHING_FOUND: Found = [(f64::INFINITY, f64::NEG_INFINITY); 3];

pub(crate) fn note(found: &mut (f64, f64), error: f64) {
    *found = (found.0.min(error), found.1.max(error));
}

/// A row of the table, errors rounded outward to whole hundredths.
#[expect(clippy::cast_possible_truncation, reason = "some per cent")]
fn row(load: &LoadParameters, case: model_error::Case, found: &Found) -> String {
    let LoadParameters { compatibility, law, ring_teeth_bend, wave_generator_moves, corner_contact, .. } = load;
    let refined = [ring_teeth_bend, wave_generator_moves, corner_contact];
    let tips_and_gaps = [case.has_pointed_tips, case.has_gaps];
    let percent = found.map(|(least, largest)| [percent(least).floor() as i32, percent(largest).ceil() as i32]);
    format!("    row({compatibility:?}, {:?}, {refined:?}, {tips_and_gaps:?}, {percent:?}),\n", law.name())
}

/// What was found of every model that is held against `results.json`, in each case.
fn rows_without_corners() -> Vec<String> {
    let cases = results().cases;
    let mut rows = Vec::new();
    for (compatibility, law, ring_teeth_bend, wave_generator_moves) in [
        (VirtualWork, None, false, false),
        (VirtualWork, None, true, false),
        (VirtualWork, None, true, true),
        (VirtualWork, None, false, true),
        (VirtualWork, Some(ContactLaw::Palmgren), false, false),
        (VirtualWork, Some(ContactLaw::Linear), false, false),
        (Projection, Some(ContactLaw::Palmgren), false, false),
        (Projection, Some(ContactLaw::Linear), false, false),
    ] {
        for (has_pointed_tips, has_gaps) in [(false, false), (false, true), (true, false), (true, true)] {
            let wanted = model_error::Case { has_gaps, has_pointed_tips };
            let (mut model, mut found) = (None, NOTHING_FOUND);
            for case in &cases {
                let law = law.unwrap_or_else(|| case.johnson());
                let drive = Drive::new(&case.drive_and_torque_nm().0).unwrap();
                let load = LoadParameters { ring_teeth_bend, wave_generator_moves, ..case.load(compatibility, law) };
                let checked = LoadCase::new(&load).unwrap();
                if model_error::case_of(&drive, &checked, &Deviations::default()) != wanted {
                    continue;
                }
                let Errors { force, stress, wind_up, .. } = case.errors_under(&load);
                for (range, errors) in found.iter_mut().zip([&force[..], &stress[..], &[wind_up][..]]) {
                    errors.iter().for_each(|&error| note(range, error));
                }
                model = Some(load);
            }
            rows.push(row(&model.unwrap(), wanted, &found));
        }
    }
    rows
}

/// What was found at the corners of pointed tips, refined as the model is there by default.
fn rows_with_corners() -> impl Iterator<Item = String> {
    [(false, false), (false, true), (true, true)].into_iter().map(|(has_gaps, wave_generator_moves)| {
        let (load, found) = corners::errors(has_gaps, wave_generator_moves);
        row(&load, model_error::Case { has_gaps, has_pointed_tips: true }, &found)
    })
}

/// `WRITE_MODEL_ERRORS=1` writes the table instead.
#[test]
fn model_errors_are_generated_from_the_results() {
    let rows: Vec<_> = rows_without_corners().into_iter().chain(rows_with_corners()).collect();
    let table = format!(
        "//! Errors of the model against elastic bodies, in per cent. Generated from `tests/finite_elements`: run\n\
         //! `WRITE_MODEL_ERRORS=1 cargo test -p toothwave-solver --test solver -- model_errors_are_generated`.\n\n\
         use super::{{Measured, row}};\n\
         use crate::contact_law::LawName::{{Johnson, Linear, Palmgren}};\n\
         use crate::load_sharing::Compatibility::{{Projection, VirtualWork}};\n\n\
         /// Model, its refinements, pointed tips and gaps; errors of force, stress and wind-up.\n\
         pub(super) const MEASURED: [Measured; {}] = [\n{}];\n",
        rows.len(),
        rows.concat()
    );
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/model_error/measured.rs");
    if std::env::var_os("WRITE_MODEL_ERRORS").is_some() {
        std::fs::write(path, &table).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap(), table);
}

#[test]
fn larger_error_of_range_has_larger_magnitude() {
    assert_eq!(ErrorRange { low: -0.05, high: 0.03 }.largest(), 0.05);
    assert_eq!(ErrorRange { low: -0.01, high: 0.03 }.largest(), 0.03);
}

#[test]
fn pressure_angle_above_calculated_drives_is_reported() {
    let mut told = Vec::new();
    for semi_minor_mm in [49.5, 49.3, 49.1, 48.9] {
        let parameters = DriveParameters { wave_generator: ellipse(50.7, semi_minor_mm), ..PAPER_5_2 };
        let drive = Drive::new(&parameters).unwrap();
        let load = LoadParameters { law: ContactLaw::JOHNSON, ..load(3.0, VirtualWork) };
        let sweep = swept(&parameters, &load, 20);
        let case = LoadCase::new(&load).unwrap();
        let error = model_error::of(&drive, &case, &Deviations::default(), &sweep, None).unwrap();
        let is_beyond = drive.largest_pressure_angle_deg().unwrap() > model_error::PRESSURE_ANGLE_TO_DEG;
        assert_eq!(error.beyond.contains(&Beyond::PressureAngle), is_beyond, "{semi_minor_mm}");
        told.push(is_beyond);
    }
    assert!(told.contains(&true) && told.contains(&false), "{told:?}");
}

/// A few teeth with flat lobes and a gap turn by several degrees before they touch. The unloaded lever arms then
/// make the largest force 1.6 % and 5 % too small.
#[test]
fn wind_up_above_calculated_drives_is_reported() {
    let path = |mean_path_radius_mm, amplitude_mm, tooth_radius_mm| DriveParameters {
        wave_generator: WaveGenerator::HarmonicPath { lobes: 2, mean_path_radius_mm, amplitude_mm },
        teeth: 10,
        installed: 10,
        tooth_radius_mm,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 8,
        tip_radius_mm: None,
    };
    for (parameters, gap_um, off) in [(path(63.0, 0.3, 5.0), 10.0, 0.016), (path(14.38, 0.061, 1.1118), 7.4, 0.055)] {
        let drive = Drive::new(&parameters).unwrap();
        let law = ContactLaw::JOHNSON;
        let clearance_um = PerContact { ring: gap_um, ..PerContact::default() };
        let load = LoadParameters { law, clearance_um, ..load(1e-5, VirtualWork) };
        let sweep = swept(&parameters, &load, 400);
        let case = LoadCase::new(&load).unwrap();
        let error = model_error::of(&drive, &case, &Deviations::default(), &sweep, None).unwrap();
        assert_eq!(error.beyond, [Beyond::WindUp]);
        // d = R + e cos 2ψ. The cam turns by x until R + e cos 2(ψ - x) has risen by the gap over cos β, where
        // tan β = k T. It presses with the arm of that place.
        let WaveGenerator::HarmonicPath { mean_path_radius_mm, amplitude_mm, .. } = parameters.wave_generator else {
            unreachable!("made above");
        };
        let d = |psi: f64| mean_path_radius_mm + amplitude_mm * (2.0 * psi).cos();
        let slope = |psi: f64| 2.0 * amplitude_mm * (2.0 * psi).sin();
        let turned = |psi: f64| {
            let beta = (4.0 * slope(psi) / d(psi)).atan();
            let wanted_mm = 1e-3 * gap_um / beta.cos();
            let (mut low, mut high) = (0.0, psi);
            for _ in 0..100 {
                let x = 0.5 * (low + high);
                if d(psi - x) - d(psi) < wanted_mm { low = x } else { high = x }
            }
            (low < psi - 1e-9).then_some(low)
        };
        let force_n = |input_rad: f64| {
            let teeth = (0..10).map(|tooth| (f64::from(tooth) * 0.2 * PI - input_rad).rem_euclid(PI));
            let closes = teeth.filter(|&psi| psi < 0.5 * PI).filter_map(|psi| Some((turned(psi)?, psi)));
            let (x, psi) = closes.min_by(|one, other| one.0.total_cmp(&other.0)).unwrap();
            let t = slope(psi - x) / d(psi - x);
            // Two zones share the torque. The arm belongs to the tangential part of F_H.
            0.5 * 1e-2 / (d(psi - x) * t) * t.hypot(1.0)
        };
        let rigid_n = (0..400).map(|step| force_n(f64::from(step) / 400.0 * 0.2 * PI)).fold(0.0, f64::max);
        let told_n = sweep.peaks.wave_generator.force_n.value;
        assert!((1.0 - told_n / rigid_n - off).abs() < 0.01, "{told_n} N, rigid {rigid_n} N");
    }
}

#[test]
fn only_calculated_drives_lie_within_range() {
    for case in results().cases {
        let (parameters, _) = case.drive_and_torque_nm();
        let drive = Drive::new(&parameters).unwrap();
        let own = case.load(VirtualWork, case.johnson());
        let beyond = |parameters: &DriveParameters, load: &LoadParameters| {
            let drive = Drive::new(parameters).unwrap();
            let sweep = swept(parameters, load, INTERVALS);
            model_error::of(&drive, &LoadCase::new(load).unwrap(), &Deviations::default(), &sweep, None).unwrap().beyond
        };
        // For a drive with pointed tips, the angles of entry are not covered.
        let expected = if case.drive == "5.2" { vec![Beyond::EntryUnderLoad] } else { Vec::new() };
        assert_eq!(beyond(&parameters, &own), expected, "{}", case.name());
        if drive.lobes() == 2 && case.drive == "5.1" && !LoadCase::new(&own).unwrap().has_gaps() {
            let gaps = PerContact { ring: 10.5, ..PerContact::default() };
            assert_eq!(beyond(&parameters, &LoadParameters { clearance_um: gaps, ..own }), [Beyond::Gap]);
            // At a tenth of the size the limit of a gap scales too.
            let small = DriveParameters {
                wave_generator: ellipse(5.8, 5.6),
                tooth_radius_mm: 0.5,
                tooth: ToothShape::Cylinder { width_mm: 1.5 },
                ..parameters
            };
            for (gap_um, expected) in
                [(1.0, vec![]), (3.0, vec![Beyond::WindUp]), (4.0, vec![Beyond::Gap, Beyond::WindUp])]
            {
                let clearance_um = PerContact { ring: gap_um, ..PerContact::default() };
                let load = LoadParameters {
                    clearance_um,
                    torque: Torque::Input(0.02),
                    law: ContactLaw::Johnson { depth_mm: PerContact::of(|_| None) },
                    ..own
                };
                assert_eq!(beyond(&small, &load), expected, "{gap_um} µm");
            }
            let series = PerContact { carrier: 1e-7, ..PerContact::default() };
            let backed = LoadParameters { series_compliance_mm_per_n: series, ..own };
            assert_eq!(beyond(&parameters, &backed), [Beyond::SeriesCompliance]);
            let mut brass = own;
            brass.materials.carrier.youngs_modulus_gpa = 100.0;
            assert_eq!(beyond(&parameters, &brass), [Beyond::Materials]);
            // Near the root contacts are wider than at the largest stress: 0.035 of the radius above 85 N·m.
            for (torque_nm, expected) in [(80.0, vec![]), (100.0, vec![Beyond::HalfWidth])] {
                let torque = Torque::Input(torque_nm);
                assert_eq!(beyond(&parameters, &LoadParameters { torque, ..own }), expected, "{torque_nm} N·m");
            }
            assert_eq!(
                beyond(&parameters, &LoadParameters { torque: Torque::Input(200.0), ..own }),
                [Beyond::HalfWidth]
            );
            // A law with a small depth ends earlier.
            let depth_mm = PerContact { ring: Some(0.5), ..PerContact::default() };
            let shallow = LoadParameters { law: ContactLaw::Johnson { depth_mm }, torque: Torque::Input(40.0), ..own };
            assert_eq!(beyond(&parameters, &shallow), [Beyond::HalfWidth]);
            // Errors of other laws depend on size and load.
            for law in [ContactLaw::Palmgren, ContactLaw::Linear] {
                assert_eq!(beyond(&parameters, &LoadParameters { law, ..own }), [Beyond::Law], "{law:?}");
            }
            for torque_nm in [0.2, 10.0] {
                assert_eq!(beyond(&parameters, &LoadParameters { torque: Torque::Input(torque_nm), ..own }), []);
            }
            let fixed = ContactLaw::Fixed(PerContact { wave_generator: 4e5, ring: 4e5, carrier: 4e5 });
            assert_eq!(beyond(&parameters, &LoadParameters { law: fixed, ..own }), [Beyond::Law]);
            let turned = DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..parameters };
            assert_eq!(beyond(&turned, &own), [Beyond::RingWithMoreTeeth]);
        }
    }
}
