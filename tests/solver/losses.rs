//! Friction against exact equilibria (tests/reference/friction.py), closed forms and brute force.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use proptest::prelude::*;
use serde_json::Value;
use toothwave_solver::cam::ToothCenter;
use toothwave_solver::load_sharing::LoadedDrive;
use toothwave_solver::losses::bearing::{BearingRating, RollingElement};
use toothwave_solver::losses::duty::{Cost, Costs, LossParameters, LossTotals};
use toothwave_solver::losses::period::{BearingLoad, LossByPlace, Losses, RadialForces, Wear};
use toothwave_solver::losses::wear::WearParameters;
use toothwave_solver::losses::{
    Efficiencies, Fixed, Friction, FrictionParameters, LoadedTooth, Mechanism, RaceBearing, Turning,
    WaveGeneratorFriction, mean_over_period,
};
use toothwave_solver::mesh::{Mesh, Samples};
use toothwave_solver::ring::FlankPoint;
use toothwave_solver::sweep::{Points, States, sweep, sweep_with_deviations};
use toothwave_solver::tooth::Pressure;
use toothwave_solver::{
    Compatibility, Contact, ContactLaw, Deviations, DriveParameters, FieldCode, LoadCase, LoadParameters, Modification,
    Never, Parameter, PerContact, Position, SolveError, ToothShape, Violation, WaveGenerator,
};

use crate::drives::{ECCENTRIC, PAPER_5_1, PAPER_5_2, any_swept_drive, cases, drive, everywhere, load};
use crate::reference::number;

/// One input angle of a drive in friction.json.
struct Case(Value);

impl Case {
    fn all() -> Vec<Self> {
        let file: Value = serde_json::from_str(include_str!("../reference/friction.json")).unwrap();
        file["cases"].as_array().unwrap().iter().cloned().map(Self).collect()
    }

    fn name(&self) -> &str {
        self.0["name"].as_str().unwrap()
    }

    fn float(&self, name: &str) -> f64 {
        self.0[name].as_f64().unwrap()
    }

    fn mechanism(&self, tooth_spins: bool) -> Mechanism {
        let whole = |name: &str| self.0[name].as_i64().unwrap();
        let (lobes, mean_radius_mm) = (whole("lobes"), self.float("race_radius_mm"));
        let harmonic = |amplitude_mm| WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm };
        let eccentric = |eccentricity_mm| WaveGenerator::Eccentric { radius_mm: mean_radius_mm, eccentricity_mm };
        let parameters = DriveParameters {
            wave_generator: match self.name() {
                "5.2 undercut" => PAPER_5_2.wave_generator,
                "eccentric, carrier against the input" | "eccentric, carrier with the input" => eccentric(1.2),
                "eccentric, steep, undercut" => eccentric(3.0),
                "harmonic, three lobes" => harmonic(1.0),
                "harmonic, nearly round" => harmonic(0.3),
                "harmonic, few teeth" => harmonic(2.5),
                "harmonic path, three lobes" => {
                    WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm: 52.0, amplitude_mm: 1.0 }
                }
                _ => PAPER_5_1.wave_generator,
            },
            teeth: whole("teeth"),
            installed: whole("installed"),
            ring_teeth: whole("ring_teeth"),
            tooth_radius_mm: self.float("tooth_radius_mm"),
            ..PAPER_5_1
        };
        let mechanism = Mechanism { tooth_spins, ..mechanism(&parameters) };
        assert_eq!(mechanism.race_radius_mm(), mean_radius_mm, "{}", self.name());
        assert_eq!(i64::from(mechanism.drive.lobes()), lobes, "{}", self.name());
        mechanism
    }

    fn teeth(&self) -> Vec<LoadedTooth> {
        let lobes = self.mechanism(true).drive.lobes();
        let tooth = |tooth: &Value| {
            let float = |name: &str| tooth[name].as_f64().unwrap();
            // Losses do not depend on what is NaN here.
            LoadedTooth {
                lobe: u32::try_from(tooth["lobe"].as_u64().unwrap()).unwrap(),
                center: ToothCenter {
                    position: Position::from_lobe(float("position_rad"), lobes),
                    support_mm: f64::NAN,
                    lever_arm_mm: f64::NAN,
                    cam_curvature_per_mm: float("cam_curvature_per_mm"),
                    center_radius_mm: float("center_radius_mm"),
                    tan_pressure_angle: float("tan_pressure_angle"),
                    tan_pressure_angle_derivative: f64::NAN,
                },
                flank: FlankPoint {
                    distance_mm: f64::NAN,
                    tan_pressure_angle: f64::NAN,
                    cos_pressure_angle: f64::NAN,
                    regularity: float("regularity"),
                },
                is_at_corner: false,
                force_n: per_contact(&tooth["force_n"]),
            }
        };
        self.0["placed"].as_array().unwrap().iter().map(tooth).collect()
    }

    /// Returns an entry's friction, with coefficients times a factor, and its mechanism.
    fn friction(&self, entry: &Value, factor: f64) -> (Mechanism, Friction) {
        let coefficient = per_contact(&entry["coefficient"]);
        let bearing = RaceBearing {
            coefficient: factor * entry["bearing_coefficient"].as_f64().unwrap(),
            radius_mm: self.float("bearing_radius_mm"),
        };
        let on_cam = factor * coefficient.wave_generator;
        let wave_generator = match entry["wave_generator"].as_str().unwrap() {
            "plain" => WaveGeneratorFriction::Plain { coefficient: on_cam },
            "race" => WaveGeneratorFriction::Race { coefficient: on_cam, bearing },
            _ => WaveGeneratorFriction::Rolling { bearing },
        };
        let parameters = FrictionParameters {
            wave_generator,
            ring_coefficient: factor * coefficient.ring,
            carrier_coefficient: factor * coefficient.carrier,
        };
        (self.mechanism(entry["spins"].as_bool().unwrap()), Friction::new(&parameters).unwrap())
    }

    fn frictions(&self) -> impl Iterator<Item = &Value> {
        self.0["frictions"].as_array().unwrap().iter()
    }
}

/// Reads three numbers in the order of the contacts.
fn per_contact(values: &Value) -> PerContact<f64> {
    PerContact {
        wave_generator: number(&values[0]).unwrap(),
        ring: number(&values[1]).unwrap(),
        carrier: number(&values[2]).unwrap(),
    }
}

fn assert_near(found: f64, expected: f64, allowed: f64, what: &str) {
    assert!((found - expected).abs() <= allowed, "{what}: {found} instead of {expected}, allowed {allowed:e}");
}

#[test]
fn losses_match_exact_equilibrium_with_vanishing_friction() {
    let mut compared = 0;
    for case in Case::all() {
        let teeth = case.teeth();
        for entry in case.frictions() {
            let name = format!("{} / {}", case.name(), entry["name"].as_str().unwrap());
            let (mechanism, friction) = case.friction(entry, 1.0);
            let turning = mechanism.turning(&friction, &teeth);
            let limit = &entry["limit"];
            let way = case.float("race_radius_mm");
            assert_near(
                turning.race_mm_per_rad,
                number(&limit["race_mm_per_rad"]).unwrap(),
                1e-13 * way,
                &format!("{name}: race"),
            );
            for (index, slip) in turning.teeth.iter().enumerate() {
                let expected = per_contact(&limit["slip_mm_per_rad"][index]);
                let rolls = limit["rolls"][index].as_str();
                // If the race's speed lets two contacts roll at once, either may be named.
                let is_named = |contact: Contact| {
                    rolls == Some(code(contact)) || expected.get(contact).abs() < 1e-10 * way && rolls.is_some()
                };
                assert!(slip.rolls.map_or(rolls.is_none(), is_named), "{name}: {:?} rolls, not {rolls:?}", slip.rolls);
                for contact in Contact::all() {
                    let what = format!("{name}: slip of tooth {index} at {contact:?}");
                    assert_near(*slip.slip_mm_per_rad.get(contact), *expected.get(contact), 1e-13 * way, &what);
                    compared += 1;
                }
                if let Some(contact) = slip.rolls {
                    assert_eq!(*slip.slip_mm_per_rad.get(contact), 0.0, "{name}");
                }
            }
            let zones = mechanism.mesh.zones_in_torque();
            let lost = lost_nmm_per_rad(&turning);
            for contact in Contact::all() {
                let expected = zones * number(&limit["work_nmm_per_rad"][code(contact)]).unwrap();
                let what = format!("{name}: work at {contact:?}");
                assert_near(*turning.work_nmm_per_rad.get(contact), expected, 1e-12 * lost, &what);
                compared += 1;
            }
            let expected = zones * number(&limit["bearing_nmm_per_rad"]).unwrap();
            assert_near(turning.bearing_work_nmm_per_rad, expected, 1e-12 * lost, &format!("{name}: bearing"));
        }
    }
    assert!(compared > 4000, "{compared}");
}

const fn code(contact: Contact) -> &'static str {
    match contact {
        Contact::WaveGenerator => "wave_generator",
        Contact::Ring => "ring",
        Contact::Carrier => "carrier",
    }
}

/// Returns first-order efficiencies with their names in friction.json.
fn efficiencies(mechanism: &Mechanism, loss_ratio: f64) -> [(&'static str, Fixed, f64); 6] {
    let of = |fixed| mechanism.efficiency(fixed, loss_ratio);
    [
        ("ring_fixed", Fixed::Ring, of(Fixed::Ring).driven),
        ("carrier_fixed", Fixed::Carrier, of(Fixed::Carrier).driven),
        ("wave_generator_fixed", Fixed::WaveGenerator, of(Fixed::WaveGenerator).driven),
        ("ring_fixed_back_driven", Fixed::Ring, of(Fixed::Ring).back_driven),
        ("carrier_fixed_back_driven", Fixed::Carrier, of(Fixed::Carrier).back_driven),
        ("wave_generator_fixed_back_driven", Fixed::WaveGenerator, of(Fixed::WaveGenerator).back_driven),
    ]
}

/// Returns the loss over the power at the driven end for an efficiency.
fn loss_share_of(name: &str, efficiency: f64) -> f64 {
    if name.ends_with("back_driven") { 1.0 - efficiency } else { 1.0 / efficiency - 1.0 }
}

#[test]
fn loss_error_is_quadratic_in_coefficients() {
    let (mut compared, mut least, mut most) = (0, f64::INFINITY, 0.0_f64);
    for case in Case::all() {
        let teeth = case.teeth();
        for entry in case.frictions() {
            // Relative to the loss itself, so one order remains.
            let errors: Vec<_> = entry["exact"].as_array().unwrap()[1..]
                .iter()
                .map(|exact| {
                    let (mechanism, friction) = case.friction(entry, exact["factor"].as_f64().unwrap());
                    let loss_ratio = loss_ratio(&mechanism, &friction, &teeth);
                    efficiencies(&mechanism, loss_ratio).map(|(name, fixed, _)| {
                        let exact = loss_share_of(name, exact[name].as_f64().unwrap());
                        exact / mechanism.loss_share(fixed, loss_ratio) - 1.0
                    })
                })
                .collect();
            for (coarse, fine) in errors[0].iter().zip(errors[1]) {
                let name = format!("{} / {}: from {coarse:e} to {fine:e}", case.name(), entry["name"]);
                // A quarter of the coefficients. If orders cancel, the first order shows later.
                assert!(fine.abs() < 0.34 * coarse.abs() + 1.5e-3, "{name}");
                if coarse.abs() > 0.01 {
                    (least, most) = (least.min(fine / coarse), most.max(fine / coarse));
                    compared += 1;
                }
            }
        }
    }
    println!(
        "{compared} relative errors at a quarter of the coefficients are {least:.3} to {most:.3} of what they were"
    );
    assert!(compared > 500, "{compared}");
}

#[test]
fn efficiency_error_is_within_reported_bound() {
    let mut nearest = 0.0_f64;
    let mut beyond = 0;
    for case in Case::all() {
        let teeth = case.teeth();
        for entry in case.frictions() {
            for exact in entry["exact"].as_array().unwrap() {
                let (mechanism, friction) = case.friction(entry, exact["factor"].as_f64().unwrap());
                let loss_ratio = loss_ratio(&mechanism, &friction, &teeth);
                for (name, fixed, efficiency) in efficiencies(&mechanism, loss_ratio) {
                    let told = friction.first_order_error(&mechanism, mechanism.loss_share(fixed, loss_ratio));
                    if !told.is_within_measured_range {
                        beyond += 1;
                        continue;
                    }
                    let exact = exact[name].as_f64().unwrap_or_else(|| panic!("{} {name} jams", case.name()));
                    let share = (efficiency - exact).abs() / told.efficiency;
                    nearest = nearest.max(share);
                    assert!(share <= 1.0, "{} / {} {name}: {share} of what is told", case.name(), entry["name"]);
                }
            }
        }
    }
    println!("at most {nearest:.3} of what is told; {beyond} beyond the measured range");
    assert!(nearest > 0.5, "what is told is far too much: {nearest}");
}

#[test]
fn reported_efficiency_error_has_range_of_validity() {
    let spinning = mechanism(&PAPER_5_1);
    let flat_sided = Mechanism { tooth_spins: false, ..spinning };
    let race = |on_balls| WaveGeneratorFriction::Race { coefficient: 0.08, bearing: bearing_of_5_1(on_balls) };
    let rolling = WaveGeneratorFriction::Rolling { bearing: bearing_of_5_1(0.0) };
    let told = |mechanism: &Mechanism, friction: &Friction| {
        let error = friction.first_order_error(mechanism, 0.25);
        (error.efficiency, error.is_within_measured_range)
    };
    assert_eq!(told(&spinning, &plain(0.05, 0.04)), (10.0 * 0.05 * 0.25, true));
    assert!(!told(&spinning, &plain(0.04, 0.051)).1);
    assert_eq!(told(&spinning, &with(rolling, 0.1)), (2.5 * 0.1 * 0.25, true));
    assert_eq!(told(&flat_sided, &with(rolling, 0.1)), (9.5 * 0.1 * 0.25, true));
    assert!(!told(&spinning, &with(rolling, 0.101)).1);
    // The factor 57/52 is the race's radius over the bearing's.
    let (light, _) = told(&spinning, &with(race(0.01 * 57.0 / 52.0), 0.05));
    assert_near(light, (2.5 * 0.08 + 10.0 * 0.01) * 0.25, 1e-15, "light bearing");
    let (stiff, is_within) = told(&spinning, &with(race(0.09 * 57.0 / 52.0), 0.05));
    assert_near(stiff, (2.5 * 0.09 + 10.0 * 0.08) * 0.25, 1e-15, "stiff bearing");
    assert!(!is_within);
}

#[test]
fn contact_point_moves_along_each_curve() {
    for case in Case::all() {
        let placed = case.0["placed"].as_array().unwrap();
        for (tooth, row) in case.teeth().iter().zip(placed) {
            let found = case.mechanism(true).advance_mm_per_rad(tooth);
            let expected = per_contact(&row["advance_mm_per_rad"]);
            for contact in Contact::all() {
                let expected = *expected.get(contact);
                let what = format!("{} at {contact:?}", case.name());
                // 1 + rκ has half a unit of error in its last place.
                assert_near(*found.get(contact), expected, 1e-13 * expected, &what);
            }
        }
    }
}

#[test]
fn radial_force_is_sum_of_tooth_forces() {
    for case in Case::all() {
        let (mechanism, teeth) = (case.mechanism(true), case.teeth());
        let total: f64 = teeth.iter().map(|tooth| tooth.force_n.wave_generator).sum();
        let load = mechanism.radial_force_n(&teeth);
        for axis in 0..2 {
            let expected = number(&case.0["radial_load_n"][axis]).unwrap();
            assert_near(load[axis], expected, 1e-13 * total, case.name());
        }
        if mechanism.drive.lobes() == 1 {
            // All normals of an eccentric circle meet in its centre: the load across the eccentricity makes the torque.
            let eccentricity_mm = if mechanism.drive.parameters().ring_teeth == 10 { 3.0 } else { 1.2 };
            assert_near(load[1].abs() * eccentricity_mm, 20e3, 1e-12 * 20e3, case.name());
        }
    }
}

/// Returns the loaded teeth of one zone from the load sharing.
fn teeth_at(loaded: &LoadedDrive<'_>, sample: u64, samples: u64) -> Vec<LoadedTooth> {
    let mesh = Mesh::new(loaded.drive());
    let states: Vec<_> = mesh
        .placed_at(sample, Samples::new(samples).unwrap())
        .map(|placed| loaded.tooth(placed.position).unwrap())
        .collect();
    let wind_up = loaded.wind_up(&states).unwrap();
    states
        .iter()
        .map(|state| LoadedTooth {
            lobe: 0,
            center: state.center,
            flank: state.flank,
            is_at_corner: false,
            force_n: loaded.forces_n(state, &wind_up).unwrap(),
        })
        .collect()
}

fn mechanism(parameters: &DriveParameters) -> Mechanism {
    Mechanism::of(&drive(parameters))
}

fn plain(on_cam: f64, elsewhere: f64) -> Friction {
    with(WaveGeneratorFriction::Plain { coefficient: on_cam }, elsewhere)
}

fn with(wave_generator: WaveGeneratorFriction, elsewhere: f64) -> Friction {
    let parameters = FrictionParameters { wave_generator, ring_coefficient: elsewhere, carrier_coefficient: elsewhere };
    Friction::new(&parameters).unwrap()
}

fn bearing_of_5_1(coefficient: f64) -> RaceBearing {
    RaceBearing { coefficient, radius_mm: 52.0 }
}

/// Returns the total loss.
fn lost_nmm_per_rad(turning: &Turning) -> f64 {
    turning.work_nmm_per_rad.iter().map(|(_, &work)| work).sum::<f64>() + turning.bearing_work_nmm_per_rad
}

/// Returns `M0` of these teeth: the sum of `F_H d sin γ`.
fn input_torque_nmm(mechanism: &Mechanism, teeth: &[LoadedTooth]) -> f64 {
    let of_tooth = |tooth: &LoadedTooth| {
        let ToothCenter { center_radius_mm, tan_pressure_angle, .. } = tooth.center;
        let lever_arm_mm = center_radius_mm * tan_pressure_angle / tan_pressure_angle.hypot(1.0);
        tooth.force_n.wave_generator * lever_arm_mm
    };
    mechanism.mesh.zones_in_torque() * teeth.iter().map(of_tooth).sum::<f64>()
}

/// Returns `ν = P/(M0 ω_HS)`.
fn loss_ratio(mechanism: &Mechanism, friction: &Friction, teeth: &[LoadedTooth]) -> f64 {
    lost_nmm_per_rad(&mechanism.turning(friction, teeth)) / input_torque_nmm(mechanism, teeth)
}

/// Returns the mean of ν over 40 intervals of a period, by `virtual_work` at 20 N·m.
fn mean_loss_ratio(parameters: &DriveParameters, mechanism: &Mechanism, friction: &Friction) -> f64 {
    let drive = drive(parameters);
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let column: Vec<_> = (0..=40_u32)
        .map(|sample| {
            let teeth = teeth_at(&loaded, sample.into(), 40);
            assert_near(input_torque_nmm(mechanism, &teeth), 20e3, 1e-8, "torque of the listed teeth");
            (f64::from(sample), loss_ratio(mechanism, friction, &teeth))
        })
        .collect();
    mean_over_period(&column)
}

#[test]
fn case_5_1_loses_known_shares_of_power() {
    let mechanism = mechanism(&PAPER_5_1);
    let efficiency = |friction: Friction| {
        let loss_ratio = mean_loss_ratio(&PAPER_5_1, &mechanism, &friction);
        mechanism.efficiency(Fixed::Ring, loss_ratio)
    };
    let on_cam = efficiency(plain(0.03, 0.05));
    let on_bearing =
        efficiency(with(WaveGeneratorFriction::Race { coefficient: 0.05, bearing: bearing_of_5_1(0.002) }, 0.05));
    println!("plain {on_cam:?}, on a bearing {on_bearing:?}");
    assert!((on_cam.driven - 0.5).abs() < 0.02, "{on_cam:?}");
    assert!((1.0 - on_bearing.driven - 0.125).abs() < 0.02, "{on_bearing:?}");
    assert!(on_bearing.back_driven > 0.0);
    assert!(efficiency(plain(0.05, 0.05)).back_driven <= 0.0);
}

#[test]
fn input_power_equals_output_power_plus_losses() {
    let mechanism = mechanism(&PAPER_5_2);
    for friction in [plain(0.01, 0.02), plain(0.08, 0.1)] {
        let drive = drive(&PAPER_5_2);
        let load = LoadCase::new(&load(3.0, Compatibility::VirtualWork)).unwrap();
        let loaded = LoadedDrive::new(&drive, &load).unwrap();
        let teeth = teeth_at(&loaded, 3, 20);
        let turning = mechanism.turning(&friction, &teeth);
        let turning_rad_per_s = mechanism.turning_rad_per_s(1500.0);
        let lost_w = 1e-3 * lost_nmm_per_rad(&turning) * turning_rad_per_s;
        // Speeds of wave generator, ring and carrier against the member that stands still, at this speed of the first against the last.
        let (k, sense) = (mechanism.drive.flank().teeth_per_wave(), mechanism.drive.sense());
        let (cam, ring) = (turning_rad_per_s, -sense / k * turning_rad_per_s);
        for fixed in [Fixed::Ring, Fixed::Carrier, Fixed::WaveGenerator] {
            let still = match fixed {
                Fixed::Ring => ring,
                Fixed::Carrier => 0.0,
                Fixed::WaveGenerator => cam,
            };
            // Torques without friction of the teeth on the three members. Each driven end keeps its own.
            let torque_nm = [-3.0, 3.0 * k * -sense, 3.0 * (k + sense) * sense];
            let powers_w = [torque_nm[0] * (cam - still), torque_nm[1] * (ring - still), torque_nm[2] * -still];
            assert!(powers_w.iter().sum::<f64>().abs() < 1e-10);
            let out_w = powers_w.iter().copied().fold(0.0, f64::max);
            let Efficiencies { driven, back_driven } =
                mechanism.efficiency(fixed, loss_ratio(&mechanism, &friction, &teeth));
            assert_near(out_w / driven, out_w + lost_w, 1e-12 * out_w, "driven");
            assert_near(out_w * back_driven, out_w - lost_w, 1e-12 * out_w, "driven from behind");
        }
    }
}

/// Returns the loss per radian at a given race speed. Each tooth's spin is the best of those with one rolling contact.
fn lost_at(mechanism: &Mechanism, friction: &FrictionParameters, teeth: &[LoadedTooth], race_mm_per_rad: f64) -> f64 {
    let (WaveGeneratorFriction::Race { coefficient, .. } | WaveGeneratorFriction::Plain { coefficient }) =
        friction.wave_generator
    else {
        unreachable!("not asked for")
    };
    let still = WaveGeneratorFriction::Plain { coefficient: 0.0 };
    let unspun = with(still, 0.0);
    let bearing = Friction::new(friction).unwrap().bearing().unwrap();
    let rigid = Mechanism { tooth_spins: false, ..*mechanism };
    let slips = rigid.turning(&unspun, teeth);
    let mut lost = 0.0;
    for (tooth, slip) in teeth.iter().zip(&slips.teeth) {
        let v = &slip.slip_mm_per_rad;
        let v = [v.wave_generator - race_mm_per_rad, v.ring, v.carrier];
        let limit = [
            coefficient * tooth.force_n.wave_generator,
            friction.ring_coefficient * tooth.force_n.ring,
            friction.carrier_coefficient * tooth.force_n.carrier,
        ];
        let at = |spin: f64| (0..3).map(|contact| limit[contact] * (v[contact] - spin).abs()).sum::<f64>();
        lost +=
            if mechanism.tooth_spins { v.iter().map(|&spin| at(spin)).fold(f64::INFINITY, f64::min) } else { at(0.0) };
        lost += bearing.coefficient * bearing.radius_mm / mechanism.race_radius_mm()
            * tooth.force_n.wave_generator
            * race_mm_per_rad.abs();
    }
    lost * mechanism.mesh.zones_in_torque()
}

proptest! {
    #![proptest_config(cases(96))]

    #[test]
    fn race_speed_minimises_losses(
        parameters in any_swept_drive(),
        on_race in 0.0_f64..0.2, ring in 0.0_f64..0.2, carrier in 0.0_f64..0.2, on_balls in 0.0_f64..0.1,
        tooth_spins in any::<bool>(), sample in 0_u64..7, other in -2.0_f64..2.0,
    ) {
        let drive = drive(&parameters);
        let load = LoadCase::new(&load(5.0, Compatibility::VirtualWork)).unwrap();
        let loaded = LoadedDrive::new(&drive, &load).unwrap();
        let mechanism = Mechanism { tooth_spins, ..mechanism(&parameters) };
        let race_radius_mm = mechanism.race_radius_mm();
        let bearing = RaceBearing { coefficient: on_balls, radius_mm: 0.9 * race_radius_mm };
        let friction = FrictionParameters {
            wave_generator: WaveGeneratorFriction::Race { coefficient: on_race, bearing },
            ring_coefficient: ring,
            carrier_coefficient: carrier,
        };
        let teeth = teeth_at(&loaded, sample, 7);
        let turning = mechanism.turning(&Friction::new(&friction).unwrap(), &teeth);
        let lost = lost_nmm_per_rad(&turning);
        let here = lost_at(&mechanism, &friction, &teeth, turning.race_mm_per_rad);
        prop_assert!((lost - here).abs() <= 1e-12 * here.max(1e-3), "{lost} {here}");
        for race in [0.0, other * race_radius_mm, turning.race_mm_per_rad + 1e-3 * other * race_radius_mm] {
            let elsewhere = lost_at(&mechanism, &friction, &teeth, race);
            prop_assert!(lost <= elsewhere * (1.0 + 1e-12), "{lost} at {}, {elsewhere} at {race}", turning.race_mm_per_rad);
        }
    }

    #[test]
    fn tooth_that_cannot_spin_loses_no_less(
        parameters in any_swept_drive(), on_cam in 0.001_f64..0.2, elsewhere in 0.001_f64..0.2, sample in 0_u64..7,
    ) {
        let drive = drive(&parameters);
        let load = LoadCase::new(&load(5.0, Compatibility::VirtualWork)).unwrap();
        let loaded = LoadedDrive::new(&drive, &load).unwrap();
        let spinning = mechanism(&parameters);
        let flat = Mechanism { tooth_spins: false, ..spinning };
        let teeth = teeth_at(&loaded, sample, 7);
        let friction = plain(on_cam, elsewhere);
        let lost = |mechanism: &Mechanism, friction: &Friction| lost_nmm_per_rad(&mechanism.turning(friction, &teeth));
        prop_assert!(lost(&spinning, &friction) <= lost(&flat, &friction) * (1.0 + 1e-14));
        let bearing = |coefficient| RaceBearing { coefficient, radius_mm: spinning.race_radius_mm() };
        let race = |on_balls| WaveGeneratorFriction::Race { coefficient: on_cam, bearing: bearing(on_balls) };
        // A bearing rougher than the teeth never turns.
        let stuck = spinning.turning(&with(race(2.0 * on_cam), elsewhere), &teeth);
        prop_assert_eq!(stuck.race_mm_per_rad, 0.0);
        prop_assert_eq!(lost_nmm_per_rad(&stuck), lost(&spinning, &friction));
        // A free race loses less than the cam, and at least as much as a race without rubbing.
        let free = lost(&spinning, &with(race(0.0), elsewhere));
        let rolling = lost(&spinning, &with(WaveGeneratorFriction::Rolling { bearing: bearing(0.0) }, elsewhere));
        prop_assert!(free <= lost(&spinning, &friction) * (1.0 + 1e-14));
        prop_assert!(rolling <= free * (1.0 + 1e-14), "{rolling} {free}");
    }
}

#[test]
fn unloaded_tooth_loses_nothing() {
    let drive = drive(&PAPER_5_1);
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let mechanism = mechanism(&PAPER_5_1);
    let mut teeth = teeth_at(&loaded, 0, 50);
    let friction = plain(0.03, 0.05);
    let (all, ratio) = (mechanism.turning(&friction, &teeth), loss_ratio(&mechanism, &friction, &teeth));
    let idle = LoadedTooth { force_n: PerContact::default(), ..teeth[3] };
    teeth.push(idle);
    let more = mechanism.turning(&friction, &teeth);
    assert_eq!(more.teeth.last().unwrap().rolls, None);
    assert_eq!(lost_nmm_per_rad(&more), lost_nmm_per_rad(&all));
    assert_eq!(loss_ratio(&mechanism, &friction, &teeth), ratio);
}

/// Teeth that cannot spin slip at all parts.
#[test]
fn worn_section_equals_material_removed_by_teeth() {
    let drive = drive(&PAPER_5_2);
    let load = LoadCase::new(&load(3.0, Compatibility::VirtualWork)).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let mechanism = Mechanism { tooth_spins: false, ..mechanism(&PAPER_5_2) };
    let friction = plain(0.03, 0.05);
    let (rate, turning_rad_per_s, width_mm) = (1e-6, mechanism.turning_rad_per_s(1000.0), 15.0);
    let wear = WearParameters {
        rate_mm3_per_nm: PerContact { wave_generator: rate, ring: rate, carrier: rate },
        turning_rad_per_s,
    };
    let samples = 400;
    let mut worn = PerContact::<f64>::default();
    let mut taken = PerContact::<f64>::default();
    let step_rad = 2.0 * PI / (40.0 * samples as f64);
    for sample in 0..samples {
        let teeth = teeth_at(&loaded, sample, samples);
        let turning = mechanism.turning(&friction, &teeth);
        for (tooth, slip) in teeth.iter().zip(&turning.teeth) {
            let line_load = PerContact::of(|contact| tooth.force_n.get(contact) / width_mm);
            let depth = mechanism.wear_mm_per_hour(&friction, &wear, tooth, slip, &line_load);
            let advance = mechanism.advance_mm_per_rad(tooth);
            worn = PerContact::of(|contact| worn.get(contact) + depth.get(contact) * advance.get(contact) * step_rad);
            // Friction work without its coefficient, in N·m an hour, over all teeth of both zones.
            taken = PerContact::of(|contact| {
                let sliding_nm = 1e-3 * tooth.force_n.get(contact) * slip.slip_mm_per_rad.get(contact).abs();
                taken.get(contact) + 2.0 / samples as f64 * rate / width_mm * sliding_nm * turning_rad_per_s * 3600.0
            });
        }
    }
    // Loaded flanks: one for each lobe, ring space and slot.
    for (contact, flanks) in [(Contact::WaveGenerator, 2.0), (Contact::Ring, 78.0), (Contact::Carrier, 40.0)] {
        let (worn_mm2, taken_mm2) = (flanks * worn.get(contact), *taken.get(contact));
        assert!(taken_mm2 > 0.0, "{contact:?}");
        assert_near(worn_mm2, taken_mm2, 1e-12 * taken_mm2, &format!("{contact:?}"));
    }
}

#[test]
fn power_and_torques_balance_for_any_fixed_member() {
    for (teeth, installed, ring_teeth, lobes) in
        [(28, 28, 26, 2_u32), (28, 14, 30, 2), (28, 28, 27, 1), (33, 11, 36, 3)]
    {
        let wave_generator = match lobes {
            1 => WaveGenerator::Eccentric { radius_mm: 90.0, eccentricity_mm: 0.5 },
            _ => WaveGenerator::Harmonic { lobes: lobes.into(), mean_radius_mm: 90.0, amplitude_mm: 0.5 },
        };
        let p = DriveParameters { wave_generator, teeth, installed, ring_teeth, tooth_radius_mm: 3.0, ..PAPER_5_1 };
        let (drive, mechanism) = (drive(&p), mechanism(&p));
        assert_eq!(mechanism.speed_ratio(Fixed::Ring), drive.transmission_ratio());
        assert_eq!(mechanism.speed_ratio(Fixed::Carrier), drive.transmission_ratio_carrier_fixed());
        // During one turn of the wave generator against the carrier, the ring turns by U teeth. A common rotation
        // is added.
        let (own, ring, carrier) = (1.0, -f64::from(lobes) * drive.sense() / ring_teeth as f64, 0.0);
        for (fixed, driving, driven, standing) in [
            (Fixed::Ring, own, carrier, ring),
            (Fixed::Carrier, own, ring, carrier),
            (Fixed::WaveGenerator, ring, carrier, own),
        ] {
            let ratio = (driving - standing) / (driven - standing);
            assert!((mechanism.speed_ratio(fixed) / ratio - 1.0).abs() < 1e-14, "{fixed:?} of {p:?}");
            let (put_in, taken_off) = (1.0, ratio);
            let balance = put_in - taken_off + mechanism.holding_torque_ratio(fixed);
            assert!(balance.abs() < 1e-13 * ratio.abs(), "{fixed:?} of {p:?}");
        }
    }
}

#[test]
fn race_wears_evenly_around() {
    let drive = drive(&PAPER_5_1);
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let mechanism = mechanism(&PAPER_5_1);
    let friction = with(WaveGeneratorFriction::Race { coefficient: 0.05, bearing: bearing_of_5_1(0.0015) }, 0.05);
    let teeth = teeth_at(&loaded, 7, 50);
    let turning = mechanism.turning(&friction, &teeth);
    let wear = WearParameters {
        rate_mm3_per_nm: PerContact { wave_generator: 2e-6, ring: 0.0, carrier: 0.0 },
        turning_rad_per_s: mechanism.turning_rad_per_s(1000.0),
    };
    let depth_mm: f64 = teeth
        .iter()
        .zip(&turning.teeth)
        .map(|(tooth, slip)| {
            let line_load = PerContact::of(|contact| tooth.force_n.get(contact) / 15.0);
            mechanism.wear_mm_per_hour(&friction, &wear, tooth, slip, &line_load).wave_generator
        })
        .sum();
    // Volume over surface: friction work over its coefficient is force times distance.
    let way_nm_per_h = 1e-3 * turning.work_nmm_per_rad.wave_generator / 0.05 * wear.turning_rad_per_s * 3600.0;
    assert_near(depth_mm, 2e-6 * way_nm_per_h / (2.0 * PI * 57.0 * 15.0), 1e-12 * depth_mm, "depth");
}

#[test]
fn slot_wear_follows_line_load_per_pass() {
    let drive = drive(&PAPER_5_1);
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let mechanism = Mechanism { tooth_spins: false, ..mechanism(&PAPER_5_1) };
    let teeth = teeth_at(&loaded, 7, 50);
    let turning = mechanism.turning(&plain(0.03, 0.05), &teeth);
    let wear = WearParameters {
        rate_mm3_per_nm: PerContact { wave_generator: 0.0, ring: 0.0, carrier: 1e-6 },
        turning_rad_per_s: 2.0 * PI / 60.0,
    };
    for (tooth, slip) in teeth.iter().zip(&turning.teeth) {
        let line_load = PerContact::of(|contact| tooth.force_n.get(contact) / 15.0);
        let depth = mechanism.wear_mm_per_hour(&plain(0.03, 0.05), &wear, tooth, slip, &line_load).carrier;
        // Two passes a turn, 60 turns an hour.
        let expected = 120.0 * 1e-3 * 1e-6 * line_load.carrier;
        assert_near(depth, expected, 1e-13 * expected, "depth");
    }
}

#[test]
fn bearing_life_follows_iso_281() {
    assert_near(RollingElement::Ball.life_h(10_000.0, 1_000.0, 1_000.0), 1e9 / 60e3, 1e-8, "ball");
    let roller = RollingElement::Roller.life_h(10_000.0, 1_000.0, 1_000.0);
    assert_near(roller, 1e6 * 10.0_f64.powf(10.0 / 3.0) / 60e3, 1e-7, "roller");
    assert_eq!(RollingElement::Ball.life_h(10_000.0, 0.0, 1_000.0), f64::INFINITY);
    // Half of the turns are unloaded, so P falls by the cube root of two.
    let loads = [(2_000.0, 1.0), (0.0, 1.0)];
    assert_near(RollingElement::Ball.mean_load_n(&loads), 2_000.0 / 2.0_f64.cbrt(), 1e-9, "mean load");
    assert_eq!(RollingElement::Ball.mean_load_n(&loads[1..]), 0.0);
}

/// What a duty of these points comes to on a plain cam, and on a bearing of this rating.
fn totals(mechanism: Mechanism, bearing: Option<BearingRating>, points: Vec<Cost>) -> LossTotals {
    let parameters = LossParameters { friction: plain(0.03, 0.05), wear_rate_mm3_per_nm: None, bearing };
    Costs { mechanism, parameters: &parameters, points }.totals(0, &States::default())
}

fn cost(share_of_time: f64, input_speed_rpm: f64, input_torque_nm: f64, loss_ratio: f64) -> Cost {
    let mean = LossByPlace { wave_generator: 0.5 * loss_ratio, ring: 0.5 * loss_ratio, ..LossByPlace::default() };
    let input_speed_rpm = Some(input_speed_rpm);
    Cost { input_torque_nm, input_speed_rpm, share_of_time, mean, pressure_velocity: None, wear: None, bearing: None }
}

#[test]
fn duty_sums_bearing_damage_over_points() {
    let mechanism = mechanism(&PAPER_5_1);
    for element in [RollingElement::Ball, RollingElement::Roller] {
        let rating = BearingRating { dynamic_load_rating_n: 9e3, element };
        // Palmgren and Miner: each hour takes its share of the life that it would have alone. A race at rest turns as 26/28 of the speed.
        let (mut used, mut points) = (0.0, Vec::new());
        for (share_of_time, speed_rpm, mean_load_n) in
            [(0.5, 1500.0, 800.0), (0.3, 300.0, 3000.0), (0.2, 3000.0, 100.0)]
        {
            used += share_of_time / element.life_h(9e3, mean_load_n, 26.0 / 28.0 * speed_rpm);
            let bearing = Some(BearingLoad { mean_load_n, speed_ratio: 1.0 });
            points.push(Cost { bearing, ..cost(share_of_time, speed_rpm, 1.0, 0.1) });
        }
        let life = totals(mechanism, Some(rating), points).bearing.unwrap();
        assert_near(life.life_h.unwrap() * used, 1.0, 1e-13, "life");
    }
}

#[test]
fn duty_adds_energies() {
    let mechanism = mechanism(&PAPER_5_1);
    let points = [(0.5, 1500.0, 20.0, 0.08), (0.25, 300.0, 60.0, 0.2), (0.25, 3000.0, 5.0, 0.05)];
    let duty = |times: f64| {
        let point = |(share, speed_rpm, torque_nm, ratio): (f64, f64, f64, f64)| {
            cost(times * share, speed_rpm, torque_nm, ratio)
        };
        totals(mechanism, None, points.map(point).into())
    };
    let (mut given_w, mut taken_w, mut lost_w) = (0.0, 0.0, 0.0);
    for (share, speed_rpm, torque_nm, loss_ratio) in points {
        let out_w = torque_nm * speed_rpm * PI / 30.0;
        let efficiency = mechanism.efficiency(Fixed::Ring, loss_ratio).driven;
        taken_w += share * out_w;
        given_w += share * out_w / efficiency;
        lost_w += share * out_w * (1.0 / efficiency - 1.0);
    }
    let found = duty(1.0);
    assert_near(found.efficiency.driven, taken_w / given_w, 1e-14, "efficiency");
    assert_near(found.power_loss_w.unwrap(), lost_w, 1e-12 * lost_w, "power");
    assert_eq!(found.power_loss_by_place_w.unwrap().ring, 0.5 * found.power_loss_w.unwrap());
    // Shares need not be of one.
    assert_eq!(duty(2.0), found);
}

#[test]
fn period_mean_halves_ends_and_splits_jumps() {
    assert_eq!(mean_over_period(&[(0.0, 1.0), (1.0, 3.0), (2.0, 1.0)]), 2.0);
    assert_eq!(mean_over_period(&[(0.0, 1.0), (1.0, 1.0), (1.0, 5.0), (4.0, 5.0)]), 4.0);
}

#[test]
fn impossible_friction_reports_every_value() {
    let bearing = RaceBearing { coefficient: 2.0, radius_mm: 0.0 };
    let parameters = FrictionParameters {
        wave_generator: WaveGeneratorFriction::Race { coefficient: -0.1, bearing },
        ring_coefficient: f64::NAN,
        carrier_coefficient: 0.05,
    };
    let refused: Vec<_> = Friction::new(&parameters)
        .unwrap_err()
        .iter()
        .map(|violation| match *violation {
            Violation { code: FieldCode::OutOfRange, parameter, limit: Some(limit), .. } => (parameter, limit),
            ref other => panic!("{other:?}"),
        })
        .collect();
    let expected = [
        (Parameter::FrictionCoefficient(Contact::WaveGenerator), 0.0),
        (Parameter::FrictionCoefficient(Contact::Ring), 0.0),
        (Parameter::BearingCoefficient, 1.0),
        (Parameter::BearingRadius, 1e-6),
    ];
    assert_eq!(refused, expected);
}

#[test]
fn zero_friction_loses_nothing() {
    let case = &Case::all()[0];
    let Turning { teeth, work_nmm_per_rad, .. } = case.mechanism(true).turning(&plain(0.0, 0.0), &case.teeth());
    assert!(teeth.iter().all(|slip| slip.rolls.is_none()));
    assert_eq!(work_nmm_per_rad, PerContact::default());
    assert_eq!(case.mechanism(true).efficiency(Fixed::Ring, 0.0), Efficiencies { driven: 1.0, back_driven: 1.0 });
}

#[test]
fn period_loss_is_mean_over_input_angles() {
    for parameters in [PAPER_5_1, PAPER_5_2] {
        let (drive, mechanism) = (drive(&parameters), mechanism(&parameters));
        let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
        let sweep = sweep(&drive, &load, Points::samples(40).unwrap(), &Never).unwrap();
        let race = WaveGeneratorFriction::Race { coefficient: 0.05, bearing: bearing_of_5_1(0.002) };
        for friction in [plain(0.03, 0.05), with(race, 0.04)] {
            let losses = Losses::of(&drive, &load, &sweep, &friction, None, &Never).unwrap();
            let expected = mean_loss_ratio(&parameters, &mechanism, &friction);
            assert_near(losses.mean.total(), expected, 1e-12 * expected, "mean");
            let loaded = LoadedDrive::new(&drive, &load).unwrap();
            let slips: Vec<_> = (0..=40)
                .flat_map(|sample| mechanism.turning(&friction, &teeth_at(&loaded, sample, 40)).teeth)
                .collect();
            assert_eq!(slips.len(), sweep.states.len());
            for (state, slip) in slips.iter().enumerate() {
                for contact in Contact::all() {
                    let found = losses.slip_mm_per_rad.get(contact)[state];
                    assert_near(found, *slip.slip_mm_per_rad.get(contact), 1e-10, "slip");
                }
            }
            assert_eq!(losses.loss_ratio.len(), sweep.input_angles.input_angle_deg.len());
        }
    }
}

/// With gaps the moved wave generator changes the teeth's lever arms by per cent.
#[test]
fn losses_equal_force_times_slip_with_moving_generator() {
    let drive = drive(&PAPER_5_2);
    let load = LoadCase::new(&LoadParameters {
        clearance_um: everywhere(5.0),
        wave_generator_moves: true,
        ..load(3.0, Compatibility::VirtualWork)
    })
    .unwrap();
    let sweep = sweep(&drive, &load, Points::samples(7).unwrap(), &Never).unwrap();
    let losses = Losses::of(&drive, &load, &sweep, &plain(0.03, 0.05), None, &Never).unwrap();
    let coefficient = PerContact { wave_generator: 0.03, ring: 0.05, carrier: 0.05 };
    let states = &sweep.states;
    for (&angle_deg, &loss_ratio) in sweep.input_angles.input_angle_deg.iter().zip(&losses.loss_ratio) {
        let of_angle = (0..states.len()).filter(|&state| states.input_angle_deg[state] == angle_deg);
        let lost_nmm =
            of_angle.flat_map(|state| Contact::all().map(|contact| (state, contact))).map(|(state, contact)| {
                let slip_mm = losses.slip_mm_per_rad.get(contact)[state].abs();
                coefficient.get(contact) * states.force_n.get(contact)[state] * slip_mm
            });
        // Two alike zones under 3 N·m.
        let expected = 2.0 * lost_nmm.sum::<f64>() / 3000.0;
        assert_near(loss_ratio, expected, 1e-12 * expected, "loss ratio");
    }
}

#[test]
fn pressure_times_velocity_peak_is_largest_product() {
    let drive = drive(&PAPER_5_1);
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let sweep = sweep(&drive, &load, Points::samples(40).unwrap(), &Never).unwrap();
    let losses = Losses::of(&drive, &load, &sweep, &plain(0.03, 0.05), None, &Never).unwrap();
    let peaks = losses.pressure_velocity_peaks(&sweep, 50.0);
    for contact in Contact::all() {
        let products = sweep.states.stress_mpa.get(contact).iter().zip(losses.slip_mm_per_rad.get(contact));
        // Both are in mm and are converted to metres.
        let values: Vec<_> = products.map(|(stress_mpa, slip)| stress_mpa * (slip * 50.0).abs() / 1000.0).collect();
        let largest = values.iter().copied().fold(0.0, f64::max);
        let peak = peaks.get(contact);
        assert_near(peak.value, largest, 1e-13 * largest, "peak");
        let state = values.iter().position(|&value| value == largest).unwrap();
        assert_eq!(peak.position_deg, sweep.states.position_deg[state]);
    }
}

#[test]
fn tolerance_sweep_loses_as_many_samples() {
    for parameters in [PAPER_5_1, PAPER_5_2] {
        let drive = drive(&parameters);
        let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
        let mean = |points| {
            let sweep = sweep(&drive, &load, points, &Never).unwrap();
            let losses = Losses::of(&drive, &load, &sweep, &plain(0.03, 0.05), None, &Never).unwrap();
            // At a tooth's entry the angle appears twice and counts twice here too.
            assert_eq!(losses.loss_ratio.len(), sweep.input_angles.input_angle_deg.len());
            losses.mean.total()
        };
        let fine = mean(Points::samples(4000).unwrap());
        for tolerance in [1e-3, 1e-6] {
            let found = mean(Points::tolerance(tolerance, 1_000_000).unwrap());
            println!("{tolerance:e}: {found} {fine} {:e}", found / fine - 1.0);
            assert_near(found, fine, 1e-2 * fine, "mean");
        }
    }
}

#[test]
fn race_runs_at_mean_radius_of_cam() {
    let radius_mm = |wave_generator: WaveGenerator| wave_generator.race_radius_mm(4.0);
    assert_eq!(radius_mm(WaveGenerator::Ellipse { semi_major_mm: 58.0, semi_minor_mm: 56.0 }), 57.0);
    assert_eq!(radius_mm(WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 }), 30.8);
    assert_eq!(radius_mm(WaveGenerator::Harmonic { lobes: 3, mean_radius_mm: 48.0, amplitude_mm: 1.0 }), 48.0);
    let path = WaveGenerator::HarmonicPath { lobes: 3, mean_path_radius_mm: 52.0, amplitude_mm: 1.0 };
    assert_eq!(radius_mm(path), 48.0);
    let flat = DriveParameters { tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 4.0 }, ..PAPER_5_1 };
    assert!(!mechanism(&flat).tooth_spins && mechanism(&PAPER_5_1).tooth_spins);
}

#[test]
fn sweep_radial_force_follows_torque_on_eccentric_only() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 },
        teeth: 28,
        installed: 28,
        tooth_radius_mm: 2.5,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 27,
        tip_radius_mm: None,
    };
    let rigid = load(5.0, Compatibility::VirtualWork);
    let forces = |parameters: &DriveParameters, load: &LoadParameters| {
        let (drive, load) = (drive(parameters), LoadCase::new(load).unwrap());
        let sweep = sweep(&drive, &load, Points::samples(9).unwrap(), &Never).unwrap();
        RadialForces::of(&drive, &load, &Deviations::default(), &sweep, &Never).unwrap()
    };
    let assert_across = |RadialForces { force_n, direction_deg, .. }: RadialForces, tolerance_n: f64| {
        assert_eq!(force_n.len(), 10);
        for (force_n, direction_deg) in force_n.iter().zip(direction_deg) {
            assert_near(force_n * direction_deg.to_radians().sin(), -5e3 / 1.2, tolerance_n, "across the eccentricity");
        }
    };
    assert_across(forces(&parameters, &rigid).unwrap(), 1e-8);
    assert_eq!(forces(&PAPER_5_1, &rigid), None);
    // Exact to second order in the wind-up if the wave generator moves. Lost motion alone moves nothing.
    let gap = PerContact { ring: 8.0, ..PerContact::default() };
    let moving = LoadParameters { clearance_um: gap, wave_generator_moves: true, ..rigid };
    let turned = Modification { ring_rotation_arcsec: 60.0, ..Modification::default() };
    for load in [moving, LoadParameters { modification: turned, ..moving }] {
        assert_across(forces(&parameters, &load).unwrap(), 1e-3 * 5e3 / 1.2);
    }
}

#[test]
fn losses_stop_on_request() {
    let drive = drive(&PAPER_5_1);
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let sweep = sweep(&drive, &load, Points::samples(4).unwrap(), &Never).unwrap();
    let stopped = Losses::of(&drive, &load, &sweep, &plain(0.03, 0.05), None, &AtomicBool::new(true));
    assert_eq!(stopped, Err(SolveError::Stopped));
}

/// Returns wear parameters at 1000 rpm, with a different rate for each part.
fn wear_parameters(mechanism: &Mechanism) -> WearParameters {
    WearParameters {
        rate_mm3_per_nm: PerContact { wave_generator: 1e-6, ring: 2e-6, carrier: 3e-6 },
        turning_rad_per_s: mechanism.turning_rad_per_s(1000.0),
    }
}

#[test]
fn sweep_wear_is_that_of_its_states() {
    let (drive, mechanism) = (drive(&PAPER_5_1), mechanism(&PAPER_5_1));
    let load = LoadCase::new(&load(20.0, Compatibility::VirtualWork)).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let sweep = sweep(&drive, &load, Points::samples(40).unwrap(), &Never).unwrap();
    let parameters = wear_parameters(&mechanism);
    let race = WaveGeneratorFriction::Race { coefficient: 0.05, bearing: bearing_of_5_1(0.002) };
    for friction in [plain(0.03, 0.05), with(race, 0.04)] {
        let losses = Losses::of(&drive, &load, &sweep, &friction, Some(&parameters), &Never).unwrap();
        let wear = losses.wear.unwrap();
        let mut expected = PerContact::of(|_| Vec::new());
        let mut on_race = Vec::new();
        for sample in 0..=40_u32 {
            let teeth = teeth_at(&loaded, sample.into(), 40);
            let turning = mechanism.turning(&friction, &teeth);
            let mut sum = 0.0;
            for (tooth, slip) in teeth.iter().zip(&turning.teeth) {
                let line_load = PerContact::of(|contact| tooth.force_n.get(contact) / 15.0);
                let depth = mechanism.wear_mm_per_hour(&friction, &parameters, tooth, slip, &line_load);
                sum += depth.wave_generator;
                for contact in Contact::all() {
                    expected.get_mut(contact).push(*depth.get(contact));
                }
            }
            on_race.push((sample.into(), sum));
        }
        match wear.race_mm_per_hour {
            Some(depth) => {
                assert_near(depth, mean_over_period(&on_race), 1e-10 * depth, "race");
                expected.wave_generator.clear();
            }
            None => assert!(friction.bearing().is_none()),
        }
        let peaks = wear.peaks(&sweep.states);
        for contact in Contact::all() {
            let (found, expected) = (wear.mm_per_hour.get(contact), expected.get(contact));
            assert_eq!(found.len(), expected.len());
            let most = expected.iter().copied().fold(0.0, f64::max);
            for (found, expected) in found.iter().zip(expected) {
                assert_near(*found, *expected, 1e-10 * most, &format!("{contact:?}"));
            }
            let peak = peaks.get(contact);
            assert_eq!(peak.is_none(), expected.is_empty());
            if let Some(peak) = peak {
                let at = found.iter().position(|&depth| depth == peak.value).unwrap();
                assert_near(peak.value, most, 1e-10 * most, "peak");
                assert_eq!(peak.position_deg, sweep.states.position_deg[at]);
            }
        }
    }
}

#[test]
fn duty_wear_peaks_after_averaging_each_place() {
    let wear = |ring: [f64; 2], race| Wear {
        mm_per_hour: PerContact { wave_generator: Vec::new(), ring: ring.into(), carrier: vec![1.0, 2.0] },
        race_mm_per_hour: Some(race),
    };
    let wears = [wear([4.0, 0.0], 1.0), wear([0.0, 8.0], 5.0)];
    assert_eq!(Wear::over_duty(&[(3.0, &wears[0]), (1.0, &wears[1])]), wear([3.0, 2.0], 2.0));
}

#[test]
fn ball_wears_groove_by_pressure_over_its_middle() {
    let shape =
        ToothShape::Ball { groove_radius_mm: PerContact { wave_generator: Some(5.4), ring: Some(5.3), carrier: None } };
    let parameters = DriveParameters { tooth: shape, ..PAPER_5_1 };
    let (drive, mechanism) = (drive(&parameters), mechanism(&parameters));
    let load =
        LoadCase::new(&LoadParameters { law: ContactLaw::Hertz, ..load(20.0, Compatibility::VirtualWork) }).unwrap();
    let loaded = LoadedDrive::new(&drive, &load).unwrap();
    let sweep = sweep(&drive, &load, Points::samples(6).unwrap(), &Never).unwrap();
    // On a rough cam teeth roll there and slip at ring and slot.
    let (friction, parameters) = (plain(0.2, 0.05), wear_parameters(&mechanism));
    let losses = Losses::of(&drive, &load, &sweep, &friction, Some(&parameters), &Never).unwrap();
    let wear = losses.wear.unwrap();
    let mut state = 0;
    for sample in 0..=6 {
        let teeth = teeth_at(&loaded, sample, 6);
        let turning = mechanism.turning(&friction, &teeth);
        let mesh = Mesh::new(&drive);
        let placed = mesh.placed_at(sample, Samples::new(6).unwrap());
        for ((tooth, slip), placed) in teeth.iter().zip(&turning.teeth).zip(placed) {
            let pressures = loaded.tooth(placed.position).unwrap().pressure;
            let line_load = PerContact::of(|contact| {
                let Pressure::Ellipse(ellipse) = pressures.get(contact) else { panic!("a ball touches in an ellipse") };
                let force_n = *tooth.force_n.get(contact);
                let half_mm = ellipse.half_width_mm(force_n);
                // Hertz's semi-ellipse, x = a sin t, by the midpoint rule.
                let steps = 200;
                let step = PI / f64::from(steps);
                let across = (0..steps).map(|i| (-0.5 * PI + (f64::from(i) + 0.5) * step).cos().powi(2)).sum::<f64>();
                ellipse.stress_mpa(force_n) * half_mm * across * step
            });
            let expected = mechanism.wear_mm_per_hour(&friction, &parameters, tooth, slip, &line_load);
            for contact in Contact::all() {
                let found = wear.mm_per_hour.get(contact)[state];
                assert_near(found, *expected.get(contact), 1e-9 * expected.get(contact).max(1e-12), "ball");
            }
            state += 1;
        }
    }
    assert_eq!(state, sweep.states.len());
    assert!(wear.peaks(&sweep.states).ring.unwrap().value > 0.0);
}

#[test]
fn eccentric_bearing_carries_radial_force_at_race_speed() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 },
        teeth: 28,
        installed: 28,
        tooth_radius_mm: 2.5,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 27,
        tip_radius_mm: None,
    };
    let (drive, mechanism) = (drive(&parameters), mechanism(&parameters));
    let load = LoadCase::new(&load(5.0, Compatibility::VirtualWork)).unwrap();
    let sweep = sweep(&drive, &load, Points::samples(20).unwrap(), &Never).unwrap();
    let forces = RadialForces::of(&drive, &load, &Deviations::default(), &sweep, &Never).unwrap().unwrap();
    let bearing = RaceBearing { coefficient: 0.002, radius_mm: 25.0 };
    let of = |wave_generator, element| {
        let losses = Losses::of(&drive, &load, &sweep, &with(wave_generator, 0.05), None, &Never).unwrap();
        BearingLoad::of(&mechanism, element, &sweep, &losses, &forces)
    };
    for (element, exponent) in [(RollingElement::Ball, 3.0), (RollingElement::Roller, 10.0 / 3.0)] {
        // A race at rest against the carrier turns like the wave generator at every angle.
        let still = of(WaveGeneratorFriction::Rolling { bearing }, element).unwrap();
        assert_near(still.speed_ratio, 1.0, 1e-14, "speed");
        let powers: Vec<_> =
            forces.force_n.iter().enumerate().map(|(at, force_n)| (at as f64, force_n.powf(exponent))).collect();
        let mean_n = mean_over_period(&powers).powf(1.0 / exponent);
        assert_near(still.mean_load_n, mean_n, 1e-12 * mean_n, "mean load");
        assert!(still.mean_load_n >= 5e3 / 1.2);
        // A race that rubs on the teeth follows them at another speed (section 10.2).
        let rubbing = of(WaveGeneratorFriction::Race { coefficient: 0.05, bearing }, element).unwrap();
        assert!((0.79..0.98).contains(&rubbing.speed_ratio), "{rubbing:?}");
        // A bearing rougher than the teeth does not turn.
        let rough = RaceBearing { coefficient: 0.9, ..bearing };
        assert_eq!(of(WaveGeneratorFriction::Race { coefficient: 0.05, bearing: rough }, element), None);
    }
}

/// Only its component across the eccentricity counts. Slot offsets come from a modification or from deviations.
#[test]
fn radial_force_balances_torque_with_any_slot_gaps() {
    let drive = drive(&ECCENTRIC);
    let of_slots = |slot_wall_um: f64| Modification { slot_wall_um, ..Modification::default() };
    let of_each = |um: f64| Deviations { slot_wall_um: vec![um; 20], ..Deviations::default() };
    for (modification, deviations) in
        [(of_slots(100.0), Deviations::default()), (of_slots(0.0), of_each(100.0)), (of_slots(0.0), of_each(300.0))]
    {
        let load = LoadParameters { wave_generator_moves: true, modification, ..load(5.0, Compatibility::VirtualWork) };
        let load = LoadCase::new(&load).unwrap();
        let sweep = sweep_with_deviations(&drive, &load, &deviations, Points::samples(6).unwrap(), &Never).unwrap();
        let forces = RadialForces::of(&drive, &load, &deviations, &sweep, &Never).unwrap().unwrap();
        for (force_n, direction_deg) in forces.force_n.iter().zip(&forces.direction_deg) {
            let across_n = force_n * direction_deg.to_radians().sin();
            assert!((across_n.abs() / (5e3 / 1.2) - 1.0).abs() < 2e-3, "{across_n} N");
        }
    }
}

/// Where a tooth enters under load the radial force jumps, and each side of the jump has its own intervals.
#[test]
fn bearing_mean_load_uses_trapezoids_up_to_jumps() {
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::Eccentric { radius_mm: 30.8, eccentricity_mm: 1.2 },
        teeth: 12,
        installed: 12,
        tooth_radius_mm: 2.5,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 11,
        tip_radius_mm: Some(35.5),
    };
    let (drive, mechanism) = (drive(&parameters), mechanism(&parameters));
    let load = LoadCase::new(&load(5.0, Compatibility::VirtualWork)).unwrap();
    let sweep = sweep(&drive, &load, Points::tolerance(1e-2, 100_000).unwrap(), &Never).unwrap();
    let forces = RadialForces::of(&drive, &load, &Deviations::default(), &sweep, &Never).unwrap().unwrap();
    let rolling = WaveGeneratorFriction::Rolling { bearing: RaceBearing { coefficient: 0.002, radius_mm: 25.0 } };
    let losses = Losses::of(&drive, &load, &sweep, &with(rolling, 0.05), None, &Never).unwrap();
    let found = BearingLoad::of(&mechanism, RollingElement::Ball, &sweep, &losses, &forces).unwrap();
    let angles = &sweep.input_angles.input_angle_deg;
    assert!(angles.windows(2).any(|pair| pair[0] == pair[1]), "a jump stands twice");
    let cubes = angles.iter().zip(&forces.force_n);
    let cubes: Vec<_> = cubes.map(|(&input_angle_deg, force_n)| (input_angle_deg, force_n.powi(3))).collect();
    let mean_n = mean_over_period(&cubes).cbrt();
    assert_near(found.mean_load_n, mean_n, 1e-12 * mean_n, "mean load");
}

#[test]
fn capacity_is_least_over_contacts() {
    for parameters in [PAPER_5_1, PAPER_5_2] {
        let drive = drive(&parameters);
        let capacity = |allowable: PerContact<f64>| {
            let load =
                LoadParameters { allowable_stress_mpa: Some(allowable), ..load(20.0, Compatibility::VirtualWork) };
            let load = LoadCase::new(&load).unwrap();
            sweep(&drive, &load, Points::samples(30).unwrap(), &Never).unwrap().torque_capacity.unwrap()
        };
        let allowable = PerContact { wave_generator: 1200.0, ring: 900.0, carrier: 400.0 };
        // Each contact alone, with the others unlimited.
        let alone = Contact::all().map(|contact| {
            let mut limits = everywhere(1e6);
            *limits.get_mut(contact) = *allowable.get(contact);
            let capacity = capacity(limits);
            assert_eq!(capacity.limited_by, contact.into());
            capacity.input_torque_nm
        });
        let least = alone.iter().copied().fold(f64::INFINITY, f64::min);
        let all = capacity(allowable);
        assert_eq!(all.input_torque_nm, least);
        assert_eq!(alone[Contact::all().iter().position(|&contact| all.limited_by == contact.into()).unwrap()], least);
    }
}
