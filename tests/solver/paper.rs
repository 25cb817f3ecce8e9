//! The paper's cases against separate calculations (docs/explanation/theory.md section 6).

use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::mesh::{Mesh, TeethInMesh};
use toothwave_solver::ring::FlankEnd;

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, load, swept};

/// Asserts six peaks to three decimals.
fn assert_peaks(compatibility: toothwave_solver::Compatibility, expected: [f64; 6]) {
    let peaks = swept(&PAPER_5_1, &load(20.0, compatibility), 50).peaks;
    let found = [
        peaks.wave_generator.force_n.value,
        peaks.ring.force_n.value,
        peaks.carrier.force_n.value,
        peaks.wave_generator.stress_mpa.value,
        peaks.ring.stress_mpa.value,
        peaks.carrier.stress_mpa.value,
    ];
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 5.0001e-4, "{found} is not {expected}");
    }
}

#[test]
fn case_5_1_has_known_projection_peaks() {
    assert_peaks(Projection, [1429.443, 1549.279, 645.337, 872.606, 980.437, 562.162]);
}

#[test]
fn case_5_1_has_known_virtual_work_peaks() {
    assert_peaks(VirtualWork, [1370.248, 1485.085, 618.576, 854.363, 1014.466, 550.383]);
}

#[test]
fn case_5_1_has_seven_states_per_angle() {
    let states = swept(&PAPER_5_1, &load(20.0, Projection), 50).states;
    assert_eq!(states.len(), 51 * 7);
    assert!(!states.is_empty());
}

#[test]
fn case_5_1_has_seven_teeth_per_zone() {
    let drive = drive(&PAPER_5_1);
    assert_eq!(drive.flank_limit().end, FlankEnd::RegularTip);
    let mesh = Mesh::new(&drive);
    assert_eq!(mesh.coincidence_degree(), 14.0);
    assert_eq!(mesh.teeth_in_mesh(), TeethInMesh { min: 7, max: 7 });
    let critical = drive.flank().critical_tooth_radius_mm().expect("a radius that undercuts");
    assert!((critical - 6.749189868666484).abs() < 1e-14 * critical);
}

#[test]
fn case_5_2_is_undercut_with_few_teeth() {
    let drive = drive(&PAPER_5_2);
    assert_eq!(drive.flank_limit().end, FlankEnd::Undercut);
    let mesh = Mesh::new(&drive);
    // 9.690577523835 is truncated, not rounded.
    assert!((mesh.coincidence_degree() - 9.690_577_523_835_5).abs() <= 5e-13, "{}", mesh.coincidence_degree());
    assert!((drive.flank_limit().position.from_lobe_deg() - 43.60759885726).abs() < 5e-12);
    assert_eq!(mesh.teeth_in_mesh(), TeethInMesh { min: 4, max: 5 });
}

#[test]
fn bored_case_5_2_has_few_teeth() {
    let drive = drive(&PAPER_5_2_BORED);
    assert_eq!(drive.flank_limit().end, FlankEnd::Bore);
    let mesh = Mesh::new(&drive);
    assert!((drive.flank_limit().position.from_lobe_deg() - 34.0787).abs() < 1e-4);
    assert!((mesh.coincidence_degree() - 7.5730).abs() < 1e-4);
    assert_eq!(mesh.teeth_in_mesh(), TeethInMesh { min: 3, max: 4 });
}
