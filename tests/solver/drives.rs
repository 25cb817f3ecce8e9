//! Drives and loads that many tests speak of.

use toothwave_solver::{
    Compatibility, ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Material, Materials, Never, Torque,
    sweep::{self, Sweep},
};

/// The paper's case 5.1: no undercut.
pub(crate) const PAPER_5_1: DriveParameters = DriveParameters {
    semi_major_mm: 58.0,
    semi_minor_mm: 56.0,
    teeth: 28,
    installed: 28,
    tooth_radius_mm: 5.0,
    tooth_width_mm: 15.0,
    ring_teeth: 26,
    tip_radius_mm: None,
};

/// The paper's case 5.2: undercut, every second slot filled.
pub(crate) const PAPER_5_2: DriveParameters = DriveParameters {
    semi_major_mm: 50.7,
    semi_minor_mm: 49.3,
    teeth: 80,
    installed: 40,
    tooth_radius_mm: 1.5,
    tooth_width_mm: 15.0,
    ring_teeth: 78,
    tip_radius_mm: None,
};

/// Case 5.2 with the bore that reproduces the paper's figures 20-25.
pub(crate) const PAPER_5_2_BORED: DriveParameters = DriveParameters { tip_radius_mm: Some(52.8227), ..PAPER_5_2 };

pub(crate) fn drive(parameters: &DriveParameters) -> Drive {
    Drive::new(parameters).expect("a possible drive")
}

/// Steel throughout, linear stiffness.
pub(crate) fn load(torque_nm: f64, compatibility: Compatibility) -> LoadParameters {
    LoadParameters {
        materials: Materials {
            wave_generator: Material::STEEL,
            teeth: Material::STEEL,
            ring: Material::STEEL,
            carrier: Material::STEEL,
        },
        torque: Torque::Input(torque_nm),
        compatibility,
        law: ContactLaw::Linear,
    }
}

pub(crate) fn swept(parameters: &DriveParameters, load: &LoadParameters, samples: u64) -> Sweep {
    let load = LoadCase::new(load).expect("a possible load");
    sweep::sweep(&drive(parameters), &load, samples, &Never).expect("a solvable sweep")
}
