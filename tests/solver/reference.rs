//! Results against `tests/reference/reference.py`, an independent calculation to 60 digits.
//!
//! Each case states its *condition*: the effect of rounding the input on each answer. The tests allow that and
//! a small rounding error.

use std::collections::BTreeMap;

use serde_json::Value;
use toothwave_solver::load_sharing::LoadedDrive;
use toothwave_solver::mesh::{Mesh, Samples};
use toothwave_solver::sweep::{self, Points, States, Sweep};
use toothwave_solver::{
    Compatibility, ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Material, Materials, Never,
    PerContact, SolveError, ToothShape, Torque,
};

use crate::drives::{ellipse, everywhere};

/// Allowed error beside the condition, relative to the value or the column's peak.
const TOLERANCE: f64 = 1e-14;

/// Allowed multiple of the condition.
const CONDITION_MULTIPLE: f64 = 1.0;

pub(crate) struct Case(pub(crate) Value);

impl Case {
    fn all() -> Vec<Self> {
        Self::of(include_str!("../reference/cases.json"))
    }

    /// Reads cases of Palmgren's law and clearances.
    fn all_of_contact() -> Vec<Self> {
        Self::of(include_str!("../reference/cases_contact.json"))
    }

    /// Reads cases of Johnson's law, series compliance, balls, projected clearances, bores and very elliptic cams.
    fn all_of_laws() -> Vec<Self> {
        Self::of(include_str!("../reference/cases_laws.json"))
    }

    /// Reads the cases of a file.
    pub(crate) fn of(file: &str) -> Vec<Self> {
        let file: Value = serde_json::from_str(file).unwrap();
        file["cases"].as_array().unwrap().iter().cloned().map(Self).collect()
    }

    pub(crate) fn name(&self) -> String {
        format!("{}/{}", self.0["group"].as_str().unwrap(), self.0["name"].as_str().unwrap())
    }

    pub(crate) fn drive(&self) -> Drive {
        let drive = &self.0["document"]["drive"];
        let (cam, teeth, ring) = (&drive["wave_generator"], &drive["teeth"], &drive["ring"]);
        Drive::new(&DriveParameters {
            wave_generator: ellipse(cam["semi_major_mm"].as_f64().unwrap(), cam["semi_minor_mm"].as_f64().unwrap()),
            teeth: teeth["count"].as_i64().unwrap(),
            installed: teeth["installed"].as_i64().unwrap(),
            tooth_radius_mm: teeth["radius_mm"].as_f64().unwrap(),
            tooth: self.shape(),
            ring_teeth: ring["teeth"].as_i64().unwrap(),
            tip_radius_mm: ring["tip_radius_mm"].as_f64(),
        })
        .unwrap_or_else(|error| panic!("{}: {error:?}", self.name()))
    }

    pub(crate) fn load(&self) -> LoadCase {
        let document = &self.0["document"];
        let material = |part: &str| {
            let material = &document["materials"][part];
            Material {
                youngs_modulus_gpa: material["youngs_modulus_gpa"].as_f64().unwrap(),
                poissons_ratio: material["poissons_ratio"].as_f64().unwrap(),
            }
        };
        let stiffness = &document["model"]["stiffness"];
        let fixed = |contact: &str| stiffness[contact].as_f64().unwrap();
        let gap = |contact: &str| document["model"]["clearance"][contact].as_f64().unwrap_or(0.0);
        let load = &document["load"];
        LoadCase::new(&LoadParameters {
            materials: Materials {
                wave_generator: material("wave_generator"),
                teeth: material("teeth"),
                ring: material("ring"),
                carrier: material("carrier"),
            },
            torque: load["input_torque_nm"]
                .as_f64()
                .map_or_else(|| Torque::Output(load["output_torque_nm"].as_f64().unwrap()), Torque::Input),
            compatibility: match document["model"]["compatibility"].as_str().unwrap() {
                "projection" => Compatibility::Projection,
                _ => Compatibility::VirtualWork,
            },
            law: match stiffness["law"].as_str().unwrap() {
                "linear" => ContactLaw::Linear,
                "palmgren" => ContactLaw::Palmgren,
                "hertz" => ContactLaw::Hertz,
                "johnson" => {
                    ContactLaw::Johnson { depth_mm: per_contact(|contact| stiffness["depth_mm"][contact].as_f64()) }
                }
                _ => ContactLaw::Fixed(PerContact {
                    wave_generator: fixed("wave_generator_n_per_mm"),
                    ring: fixed("ring_n_per_mm"),
                    carrier: fixed("carrier_n_per_mm"),
                }),
            },
            series_compliance_mm_per_n: per_contact(|contact| {
                document["model"]["series_compliance_mm_per_n"][contact].as_f64().unwrap_or(0.0)
            }),
            clearance_um: PerContact {
                wave_generator: gap("wave_generator_um"),
                ring: gap("ring_um"),
                carrier: gap("carrier_um"),
            },
            allowable_stress_mpa: load["allowable_stress_mpa"].as_f64().map(everywhere),
            ..LoadParameters::default()
        })
        .unwrap()
    }

    fn shape(&self) -> ToothShape {
        let teeth = &self.0["document"]["drive"]["teeth"];
        if teeth["shape"] == "ball" {
            let groove_radius_mm = per_contact(|contact| teeth["groove_radius_mm"][contact].as_f64());
            ToothShape::Ball { groove_radius_mm }
        } else {
            ToothShape::Cylinder { width_mm: teeth["width_mm"].as_f64().unwrap() }
        }
    }

    fn samples(&self) -> Samples {
        Samples::new(self.0["document"]["sweep"]["samples"].as_u64().unwrap()).unwrap()
    }

    pub(crate) fn points(&self) -> Points {
        match self.0["document"]["sweep"]["tolerance"].as_f64() {
            Some(tolerance) => Points::tolerance(tolerance, 10_000_000).unwrap(),
            None => Points::Samples(self.samples()),
        }
    }

    pub(crate) fn sweep(&self) -> Result<Sweep, SolveError> {
        sweep::sweep(&self.drive(), &self.load(), self.points(), &Never)
    }

    /// Returns an expected scalar and its condition.
    fn scalar(&self, name: &str) -> Option<(f64, f64)> {
        let value = number(&self.0["expected"][name])?;
        Some((value, self.0["condition"][name].as_f64().unwrap_or(0.0)))
    }
}

fn per_contact<T>(of: impl Fn(&str) -> T) -> PerContact<T> {
    PerContact { wave_generator: of("wave_generator"), ring: of("ring"), carrier: of("carrier") }
}

pub(crate) fn number(value: &Value) -> Option<f64> {
    value.as_str().map(|text| text.parse().unwrap()).or_else(|| value.as_f64())
}

/// The worst error of each kind over the allowed error.
#[derive(Default)]
pub(crate) struct Worst(BTreeMap<String, (f64, String)>);

impl Worst {
    pub(crate) fn see(&mut self, kind: &str, case: &str, error: f64, allowed: f64) {
        let ratio = if error == 0.0 { 0.0 } else { error / allowed };
        let entry = self.0.entry(kind.into()).or_insert((0.0, String::new()));
        if ratio.is_nan() || ratio > entry.0 {
            *entry = (ratio, format!("{case}: error {error:.2e}, allowed {allowed:.2e}"));
        }
    }

    pub(crate) fn assert_all_within(&self) {
        for (kind, (ratio, case)) in &self.0 {
            println!("{kind:<44} {ratio:.3} of what is allowed, at {case}");
        }
        for (kind, (ratio, case)) in &self.0 {
            assert!(*ratio <= 1.0, "{kind} is {ratio:.3} times off what is allowed, at {case}");
        }
    }
}

fn columns(states: &States) -> [(&'static str, &Vec<f64>); 11] {
    [
        ("input_angle_deg", &states.input_angle_deg),
        ("position_deg", &states.position_deg),
        ("center_radius_mm", &states.center_radius_mm),
        ("wave_generator_angle_deg", &states.wave_generator_angle_deg),
        ("ring_angle_deg", &states.ring_angle_deg),
        ("force_wave_generator_n", &states.force_n.wave_generator),
        ("force_ring_n", &states.force_n.ring),
        ("force_carrier_n", &states.force_n.carrier),
        ("stress_wave_generator_mpa", &states.stress_mpa.wave_generator),
        ("stress_ring_mpa", &states.stress_mpa.ring),
        ("stress_carrier_mpa", &states.stress_mpa.carrier),
    ]
}

#[test]
fn geometry_and_mesh_match_60_digits() {
    let mut worst = Worst::default();
    for case in Case::all() {
        let (name, drive) = (case.name(), case.drive());
        let mesh = Mesh::new(&drive);
        let expected = &case.0["expected"];
        assert_eq!(drive.flank().is_undercut(), expected["undercut"].as_bool().unwrap(), "{name}");
        let teeth = mesh.teeth_in_mesh();
        assert_eq!(Some(teeth.min), expected["teeth_in_mesh_min"].as_u64(), "{name}");
        assert_eq!(Some(teeth.max), expected["teeth_in_mesh_max"].as_u64(), "{name}");
        let critical = drive.flank().critical_tooth_radius_mm();
        assert_eq!(critical.is_some(), !expected["critical_tooth_radius_mm"].is_null(), "{name}");
        let found = [
            ("critical_tooth_radius_mm", critical.unwrap_or_default()),
            ("engagement_start_deg", drive.flank_limit().position.from_lobe_deg()),
            ("coincidence_degree", mesh.coincidence_degree()),
            ("period_deg", mesh.period_deg()),
            ("transmission_ratio", drive.transmission_ratio()),
            ("transmission_ratio_carrier_fixed", drive.transmission_ratio_carrier_fixed()),
            ("root_radius_mm", drive.root_radius_mm()),
            ("tip_radius_mm", drive.tip_radius_mm()),
        ];
        for (kind, found) in found {
            if let Some((value, condition)) = case.scalar(kind) {
                let allowed = TOLERANCE * value.abs() + CONDITION_MULTIPLE * condition;
                worst.see(kind, &name, (found - value).abs(), allowed);
            }
        }
    }
    worst.assert_all_within();
}

/// Returns the index of a recorded row among the states.
fn index_of(mesh: &Mesh, samples: Samples, rows: &Value, row: usize) -> usize {
    let (tooth, sample) = (rows["tooth"][row].as_u64().unwrap(), rows["input_index"][row].as_u64().unwrap());
    let before: usize = (0..sample).map(|sample| mesh.teeth_at(sample, samples).count()).sum();
    before + usize::try_from(tooth - mesh.teeth_at(sample, samples).start()).unwrap()
}

fn see_sweep(case: &Case, worst: &mut Worst) {
    let name = case.name();
    let expected = &case.0["expected"];
    let Some(count) = expected["state_count"].as_u64() else {
        assert!(matches!(case.sweep(), Err(SolveError::NoToothInMesh { .. })), "{name}");
        return;
    };
    let (sweep, samples) = (case.sweep().unwrap(), case.samples());
    assert_eq!(sweep.states.len() as u64, count, "{name}");
    let mesh = Mesh::new(&case.drive());
    let rows = &expected["rows"];
    let at = |row: usize| index_of(&mesh, samples, rows, row);
    for (kind, column) in columns(&sweep.states) {
        let peak = number(&expected["column_peak"][kind]).unwrap();
        let condition = case.0["condition"]["columns"][kind].as_f64().unwrap_or(0.0);
        for (row, value) in rows[kind].as_array().unwrap().iter().enumerate() {
            let error = (column[at(row)] - number(value).unwrap()).abs();
            worst.see(kind, &name, error, (TOLERANCE + CONDITION_MULTIPLE * condition) * peak);
        }
    }
    for (row, loaded) in rows["loaded"].as_array().into_iter().flatten().enumerate() {
        assert_eq!(sweep.states.force_n.wave_generator[at(row)] > 0.0, loaded.as_bool().unwrap(), "{name}");
    }
    let wind_up = &expected["wind_up_deg"];
    let most = wind_up.as_array().unwrap().iter().filter_map(number).fold(0.0, f64::max);
    let condition = case.0["condition"]["wind_up_deg"].as_f64().unwrap_or(0.0);
    for (sample, found) in sweep.input_angles.wind_up_deg.iter().enumerate() {
        let error = (found - number(&wind_up[sample]).unwrap()).abs();
        worst.see("wind_up_deg", &name, error, (TOLERANCE + CONDITION_MULTIPLE * condition) * most);
    }
}

#[test]
fn every_sweep_column_matches_60_digits() {
    let mut worst = Worst::default();
    for case in Case::all() {
        see_sweep(&case, &mut worst);
    }
    worst.assert_all_within();
}

#[test]
fn palmgrens_law_and_clearances_match_60_digits() {
    let mut worst = Worst::default();
    for case in Case::all_of_contact() {
        see_sweep(&case, &mut worst);
    }
    worst.assert_all_within();
}

/// Compares forces and stresses at the recorded rows, and the wind-up at every angle, for teeth of any shape.
fn see_states(case: &Case, worst: &mut Worst) {
    let (name, samples) = (case.name(), case.samples());
    let (drive, load) = (case.drive(), case.load());
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let mesh = Mesh::new(&drive);
    let expected = &case.0["expected"];
    let (rows, condition) = (&expected["rows"], &case.0["condition"]);
    let mut see = |kind: &str, found: f64, value: &Value, scale: f64, condition: &Value| {
        let allowed = (TOLERANCE + CONDITION_MULTIPLE * condition.as_f64().unwrap_or(0.0)) * scale;
        worst.see(kind, &name, (found - number(value).unwrap()).abs(), allowed);
    };
    for sample in 0..=samples.count() {
        let numbers = mesh.teeth_at(sample, samples);
        let teeth: Vec<_> =
            mesh.placed_at(sample, samples).map(|placed| loaded.tooth(placed.position).unwrap()).collect();
        let wind_up = loaded.wind_up(&teeth).unwrap();
        let most = expected["wind_up_deg"].as_array().unwrap().iter().filter_map(number).fold(0.0, f64::max);
        let at = usize::try_from(sample).unwrap();
        let wind_up_deg = wind_up.rotation_rad().to_degrees();
        see("wind_up_deg", wind_up_deg, &expected["wind_up_deg"][at], most, &condition["wind_up_deg"]);
        for (number_of_tooth, tooth) in numbers.zip(&teeth) {
            let is_row = |row: &usize| rows["input_index"][*row] == sample && rows["tooth"][*row] == number_of_tooth;
            let Some(row) = (0..rows["tooth"].as_array().unwrap().len()).find(is_row) else { continue };
            let force_n = loaded.forces_n(tooth, &wind_up).unwrap();
            let stress_mpa = loaded.stress_mpa(tooth, &force_n);
            assert_eq!(Some(force_n.wave_generator > 0.0), rows["loaded"][row].as_bool(), "{name}");
            let per = |what: &str, unit: &str, found: &PerContact<f64>| {
                [("wave_generator", found.wave_generator), ("ring", found.ring), ("carrier", found.carrier)]
                    .map(|(contact, found)| (format!("{what}_{contact}_{unit}"), found))
            };
            for (kind, found) in per("force", "n", &force_n).into_iter().chain(per("stress", "mpa", &stress_mpa)) {
                let peak = number(&expected["column_peak"][&kind]).unwrap();
                see(&kind, found, &rows[&kind][row], peak, &condition["columns"][&kind]);
            }
        }
    }
}

#[test]
fn further_laws_and_projected_gaps_match_40_digits() {
    let mut worst = Worst::default();
    for case in Case::all_of_laws() {
        see_states(&case, &mut worst);
        if matches!(case.shape(), ToothShape::Cylinder { .. }) {
            see_sweep(&case, &mut worst);
        }
    }
    worst.assert_all_within();
}

/// Summary of a group of cases.
#[derive(Default)]
struct Row {
    cases: usize,
    /// Number of compared values.
    numbers: usize,
    /// Worst error of geometry, forces and stresses, over the column's peak.
    errors: [f64; 3],
    /// Largest condition of a column.
    condition: f64,
    /// Worst error over its column's condition, after one unit of rounding.
    multiple: f64,
}

/// `cargo test -p toothwave-solver hard_cases -- --nocapture` prints the table of tests/reference/hard-cases.md and the figures of
/// README.md.
#[test]
fn hard_cases_stay_near_their_condition() {
    let mut table: BTreeMap<String, Row> = BTreeMap::new();
    for case in Case::all().into_iter().chain(Case::all_of_contact()) {
        let row = table.entry(case.0["group"].as_str().unwrap().into()).or_default();
        row.cases += 1;
        if case.0["expected"]["state_count"].is_null() {
            continue;
        }
        let sweep = case.sweep().unwrap();
        for (kind, error) in errors_over_peak(&case, &sweep) {
            let class = if kind.starts_with("force") { 1 } else { 2 * usize::from(kind.starts_with("stress")) };
            let condition = case.0["condition"]["columns"][kind].as_f64().unwrap_or(0.0);
            row.numbers += case.0["expected"]["rows"][kind].as_array().unwrap().len();
            row.errors[class] = row.errors[class].max(error);
            row.condition = row.condition.max(condition);
            row.multiple = row.multiple.max(error / (condition + f64::EPSILON));
        }
    }
    println!("| cases | number | geometry | forces | stresses | condition | error over condition |");
    println!("|---|---|---|---|---|---|---|");
    for (group, Row { cases, errors: [geometry, forces, stresses], condition, multiple, .. }) in &table {
        println!(
            "| {group} | {cases} | {geometry:.1e} | {forces:.1e} | {stresses:.1e} | {condition:.1e} | {multiple:.1} |"
        );
        assert!(*multiple < 10.0, "{group}: {multiple}");
    }
    let gapless_and_linear = || table.iter().filter(|(group, _)| !group.starts_with("contact-")).map(|(_, row)| row);
    println!(
        "without the groups contact-*: {} numbers of {} designs, forces within {:.1e}, stresses within {:.1e}",
        gapless_and_linear().map(|row| row.numbers).sum::<usize>(),
        gapless_and_linear().map(|row| row.cases).sum::<usize>(),
        gapless_and_linear().map(|row| row.errors[1]).fold(0.0, f64::max),
        gapless_and_linear().map(|row| row.errors[2]).fold(0.0, f64::max),
    );
}

/// Returns the worst error of each column at the recorded rows, over the column's peak.
fn errors_over_peak(case: &Case, sweep: &Sweep) -> Vec<(&'static str, f64)> {
    let (mesh, samples) = (Mesh::new(&case.drive()), case.samples());
    let rows = &case.0["expected"]["rows"];
    let at = |row: usize| index_of(&mesh, samples, rows, row);
    let error_of = |kind: &str, column: &[f64]| {
        let peak = number(&case.0["expected"]["column_peak"][kind]).unwrap();
        let values = rows[kind].as_array().unwrap().iter().enumerate();
        let errors = values.map(|(row, value)| (column[at(row)] - number(value).unwrap()).abs() / peak);
        errors.fold(0.0, f64::max)
    };
    columns(&sweep.states).into_iter().map(|(kind, column)| (kind, error_of(kind, column))).collect()
}
