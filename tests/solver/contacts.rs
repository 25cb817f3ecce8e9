//! Forces with gaps, against the equations themselves.

use toothwave_solver::drive::Draft;
use toothwave_solver::load_sharing::{LoadedDrive, ToothState};
use toothwave_solver::mesh::{Mesh, Samples};
use toothwave_solver::{
    Compatibility, Contact, ContactLaw, Drive, DriveParameters, FieldCode, LoadCase, Parameter, PerContact, Position,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, ellipse, load, swept};

/// Returns the paper's weights [3][6] by angles, or those of virtual work by forces.
fn weights(drive: &Drive, tooth: &ToothState, compatibility: Compatibility) -> PerContact<f64> {
    let (cam, ring) = (tooth.center.tan_pressure_angle.atan(), tooth.flank.tan_pressure_angle.atan());
    match compatibility {
        Compatibility::Projection => PerContact {
            wave_generator: 1.0,
            ring: (cam + drive.sense() * ring).cos(),
            carrier: drive.sense() * cam.sin(),
        },
        Compatibility::VirtualWork => PerContact {
            wave_generator: 1.0,
            ring: cam.cos() / ring.cos(),
            carrier: cam.sin() * drive.teeth_per_wave(),
        },
    }
}

#[test]
fn exactly_loaded_teeth_close_their_gaps() {
    let samples = Samples::new(11).unwrap();
    let stiffness = PerContact { wave_generator: 1.3e6, ring: 0.8e6, carrier: 0.9e6 };
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED] {
        for compatibility in [Compatibility::Projection, Compatibility::VirtualWork] {
            for (cam_um, ring_um, carrier_um) in [(4.0, 0.0, 0.0), (0.0, 6.0, 0.0), (0.0, 0.0, 9.0), (1.0, 2.0, 3.0)] {
                let possible = drive(&parameters);
                let mut load = load(20.0, compatibility);
                load.law = ContactLaw::Fixed(stiffness);
                load.clearance_um = PerContact { wave_generator: cam_um, ring: ring_um, carrier: carrier_um };
                let loaded = LoadedDrive::new(&possible, &LoadCase::new(&load).unwrap()).unwrap();
                let mesh = Mesh::new(&possible);
                for sample in 0..samples.count() {
                    let placed = mesh.placed_at(sample, samples);
                    let teeth: Vec<_> = placed.map(|placed| loaded.tooth(placed.position).unwrap()).collect();
                    let wind_up = loaded.wind_up(&teeth).unwrap();
                    let mut torque_nmm = 0.0;
                    for tooth in &teeth {
                        let weights = weights(&possible, tooth, compatibility);
                        let force_n = loaded.forces_n(tooth, &wind_up).unwrap();
                        let lever_arm_mm = tooth.center.lever_arm_mm;
                        torque_nmm += 2.0 * force_n.wave_generator * lever_arm_mm;
                        let turned_mm = wind_up.rotation_rad() * lever_arm_mm;
                        let of = |term: &dyn Fn(Contact) -> f64| -> f64 {
                            weights.iter().map(|(contact, weight)| weight * term(contact)).sum()
                        };
                        let gap_mm = of(&|contact| 1e-3 * load.clearance_um.get(contact));
                        let approach_mm = of(&|contact| force_n.get(contact) / stiffness.get(contact));
                        let missing_mm = turned_mm - gap_mm - approach_mm;
                        let is_closed = force_n.wave_generator > 0.0;
                        assert!(
                            if is_closed { missing_mm.abs() < 1e-12 } else { missing_mm < 1e-12 },
                            "{missing_mm:e}"
                        );
                    }
                    assert!((torque_nmm / 20_000.0 - 1.0).abs() < 1e-12);
                }
            }
        }
    }
}

#[test]
fn transmission_error_is_wind_up_range_over_ratio() {
    let sweep = swept(&PAPER_5_2, &load(3.0, Compatibility::VirtualWork), 300);
    let wind_up_deg = &sweep.input_angles.wind_up_deg;
    let most = wind_up_deg.iter().copied().fold(0.0, f64::max);
    let least = wind_up_deg.iter().copied().fold(f64::INFINITY, f64::min);
    let found = sweep.transmission_error_peak_to_peak_deg(&drive(&PAPER_5_2));
    assert!((found - (most - least) / 40.0).abs() < 1e-14 * most && found > 0.0, "{found}");
}

fn is_refused(parameters: &DriveParameters, contact: Contact) -> bool {
    let mut load = load(20.0, Compatibility::Projection);
    load.clearance_um = PerContact::of(|other| if other == contact { 10.0 } else { 0.0 });
    let violations = load.clearance_violations(&Draft::new(parameters).unwrap()).unwrap();
    let parameter = Parameter::PartClearance(contact.mate());
    assert!(violations.iter().all(|v| v.code == FieldCode::ClearanceNotMonotone && v.parameter == parameter));
    !violations.is_empty()
}

#[test]
fn projection_takes_gaps_of_positive_weight_only() {
    let backwards = DriveParameters { ring_teeth: 30, tooth_radius_mm: 4.0, ..PAPER_5_1 };
    // With γ + β above 90° the ring's weight cos(γ + β) is negative.
    let steep = DriveParameters {
        wave_generator: ellipse(58.0, 20.0),
        tip_radius_mm: Some(58.5),
        tooth_radius_mm: 2.0,
        ..PAPER_5_1
    };
    let steepest = drive(&steep).ring_tooth().steepest_engaged().unwrap();
    let k = drive(&steep).flank().teeth_per_wave();
    let sum = steepest.tan_pressure_angle.atan() + (k * steepest.tan_pressure_angle).atan();
    assert!(sum > std::f64::consts::FRAC_PI_2);
    for (parameters, refused) in
        [(PAPER_5_1, [false, false, false]), (backwards, [false, false, true]), (steep, [false, true, false])]
    {
        let contacts = Contact::all();
        assert_eq!(contacts.map(|contact| is_refused(&parameters, contact)), refused, "{parameters:?}");
    }
}

#[test]
fn steepest_engaged_tooth_is_steepest_before_flank_end() {
    let short = DriveParameters { tip_radius_mm: Some(67.5), ..PAPER_5_1 };
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, short] {
        let possible = drive(&parameters);
        let end_rad = possible.flank_limit().position.from_lobe_rad;
        let tangents = (0..=4000_u32).map(|step| {
            let position = Position::from_lobe(end_rad * f64::from(step) / 4000.0, 2);
            possible.flank().locus().at(position).unwrap().tan_pressure_angle
        });
        let steepest = tangents.fold(0.0, f64::max);
        let found = possible.ring_tooth().steepest_engaged().unwrap().tan_pressure_angle;
        assert!((found / steepest - 1.0).abs() < 1e-6, "{found} {steepest}");
    }
    assert!(drive(&short).flank_limit().position.from_lobe_deg() < 40.0, "the path is steepest beyond");
}
