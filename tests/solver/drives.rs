//! Drives and loads that many tests share.

use proptest::prelude::*;
use toothwave_solver::drawing::DrawnPart;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::{
    Compatibility, ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Never, Part, PerContact, ToothShape,
    Torque, WaveGenerator,
    sweep::{self, Points, Sweep},
};

/// Returns a configuration with this many cases, or fewer by `PROPTEST_CASES`. Failures are not persisted.
pub(crate) fn cases(most: u32) -> ProptestConfig {
    let asked = std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok());
    let cases = asked.map_or(most, |asked: u32| asked.min(most));
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

pub(crate) const fn ellipse(semi_major_mm: f64, semi_minor_mm: f64) -> WaveGenerator {
    WaveGenerator::Ellipse { semi_major_mm, semi_minor_mm }
}

/// Returns the semi-axes of an elliptic drive.
pub(crate) fn semi_axes_mm(parameters: &DriveParameters) -> (f64, f64) {
    match parameters.wave_generator {
        WaveGenerator::Ellipse { semi_major_mm, semi_minor_mm } => (semi_major_mm, semi_minor_mm),
        other => panic!("{other:?} is no ellipse"),
    }
}

/// The paper's case 5.1: no undercut.
pub(crate) const PAPER_5_1: DriveParameters = DriveParameters {
    wave_generator: ellipse(58.0, 56.0),
    teeth: 28,
    installed: 28,
    tooth_radius_mm: 5.0,
    tooth: ToothShape::Cylinder { width_mm: 15.0 },
    ring_teeth: 26,
    tip_radius_mm: None,
};

/// The paper's case 5.2: undercut, every second slot filled.
pub(crate) const PAPER_5_2: DriveParameters = DriveParameters {
    wave_generator: ellipse(50.7, 49.3),
    teeth: 80,
    installed: 40,
    tooth_radius_mm: 1.5,
    tooth: ToothShape::Cylinder { width_mm: 15.0 },
    ring_teeth: 78,
    tip_radius_mm: None,
};

/// Case 5.2 with the bore that reproduces the paper's figures 20-25.
pub(crate) const PAPER_5_2_BORED: DriveParameters = DriveParameters { tip_radius_mm: Some(52.8227), ..PAPER_5_2 };

/// A drive with one lobe, compared with finite elements like the paper's cases.
pub(crate) const ECCENTRIC: DriveParameters = DriveParameters {
    wave_generator: WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 },
    teeth: 20,
    installed: 20,
    tooth_radius_mm: 2.0,
    tooth: ToothShape::Cylinder { width_mm: 12.0 },
    ring_teeth: 19,
    tip_radius_mm: None,
};

pub(crate) fn drive(parameters: &DriveParameters) -> Drive {
    Drive::new(parameters).expect("a possible drive")
}

/// Returns the subject of a drawing of one part.
pub(crate) const fn drawn_part(part: Part) -> DrawnPart {
    match part {
        Part::Ring => DrawnPart::Ring,
        Part::Carrier => DrawnPart::Carrier,
        Part::Teeth => DrawnPart::Tooth,
        Part::WaveGenerator => DrawnPart::WaveGenerator,
    }
}

/// Returns a load with steel throughout and linear stiffness.
pub(crate) fn load(torque_nm: f64, compatibility: Compatibility) -> LoadParameters {
    let torque = Torque::Input(torque_nm);
    LoadParameters { torque, compatibility, law: ContactLaw::Linear, ..LoadParameters::default() }
}

/// Returns one number for each contact.
pub(crate) const fn everywhere(value: f64) -> PerContact<f64> {
    PerContact { wave_generator: value, ring: value, carrier: value }
}

pub(crate) fn swept(parameters: &DriveParameters, load: &LoadParameters, samples: u64) -> Sweep {
    let load = LoadCase::new(load).expect("a possible load");
    sweep::sweep(&drive(parameters), &load, Points::samples(samples).unwrap(), &Never).expect("a solvable sweep")
}

/// Generates possible drives of many shapes, including ones that can be swept (`always_carries`).
pub(crate) fn any_drive() -> impl Strategy<Value = DriveParameters> {
    (
        (1.0_f64..3.0).prop_map(|exponent| 10.0_f64.powf(exponent)),
        (-3.0_f64..-0.8).prop_map(|exponent| 10.0_f64.powf(exponent)),
        3_i64..60,
        prop::sample::select(vec![1_i64, 1, 1, 2, 3]),
        0.15_f64..0.85,
        any::<bool>(),
        prop::option::of(0.0_f64..1.0),
    )
        .prop_filter_map("an impossible drive", |(a, flattening, half, removal, thickness, more, bore)| {
            let installed = 2 * half;
            let teeth = installed * removal;
            let semi_minor_mm = a * (1.0 - flattening);
            // Fills this share of the space between neighbours.
            let sin = (std::f64::consts::PI / installed as f64).sin();
            let tooth_radius_mm = thickness * semi_minor_mm * sin / (1.0 - sin);
            let parameters = DriveParameters {
                wave_generator: ellipse(a, semi_minor_mm),
                teeth,
                installed,
                tooth_radius_mm,
                tooth: ToothShape::Cylinder { width_mm: 10.0 },
                ring_teeth: if more { teeth + 2 } else { teeth - 2 },
                tip_radius_mm: bore
                    .map(|share| semi_minor_mm + 2.0 * tooth_radius_mm + share * 0.9 * (a - semi_minor_mm)),
            };
            Drive::new(&parameters).ok().map(|_| parameters)
        })
}

/// Generates drives that can be swept.
pub(crate) fn any_swept_drive() -> impl Strategy<Value = DriveParameters> {
    any_drive()
        .prop_filter("no tooth in mesh at some angle", |parameters| Mesh::new(&drive(parameters)).always_carries())
}
