//! Tolerance sweeps: their guarantees, the entry of teeth, and their cost.

use proptest::prelude::*;
use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::ring::FlankEnd;
use toothwave_solver::sweep::{Peak, Points, Sweep, sweep};
use toothwave_solver::{
    ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Never, PerContact, Position, SolveError, ToothShape,
    WaveGenerator,
};

use crate::drives::{
    PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, any_drive, any_swept_drive, cases, drive, ellipse, everywhere, load,
    semi_axes_mm, swept,
};

/// A limit above the need of these sweeps.
const MAX_STATES: u64 = 10_000_000;

fn swept_to(parameters: &DriveParameters, load: &LoadParameters, tolerance: f64) -> Sweep {
    let load = LoadCase::new(load).unwrap();
    let points = Points::tolerance(tolerance, MAX_STATES).unwrap();
    sweep(&drive(parameters), &load, points, &Never).unwrap_or_else(|error| panic!("{error} of {parameters:?}"))
}

fn six_peaks(sweep: &Sweep) -> Vec<Peak> {
    sweep.peaks.iter().flat_map(|(_, peaks)| [peaks.force_n, peaks.stress_mpa]).collect()
}

/// Three lobes over 37 teeth have three equal laps, and one is computed. A lap's first moment counts again as the last
/// of the lap before.
#[test]
fn multi_lap_sweep_keeps_state_limit() {
    let wave_generator = WaveGenerator::HarmonicPath { lobes: 3, mean_path_radius_mm: 52.0, amplitude_mm: 1.0 };
    let p =
        DriveParameters { wave_generator, teeth: 37, installed: 37, ring_teeth: 34, tooth_radius_mm: 2.5, ..PAPER_5_1 };
    let load = load(20.0, VirtualWork);
    let states = swept_to(&p, &load, 1e-3).states;
    let of_first_moment = states.input_angle_deg.iter().filter(|&&angle_deg| angle_deg == 0.0).count();
    let counted = (states.len() + 2 * of_first_moment) as u64;
    let swept_within = |max_states| {
        let points = Points::tolerance(1e-3, max_states).unwrap();
        sweep(&drive(&p), &LoadCase::new(&load).unwrap(), points, &Never)
    };
    assert_eq!(swept_within(counted).unwrap().states.len(), states.len());
    let refused = swept_within(counted - 1).unwrap_err();
    assert!(matches!(refused, SolveError::TooManyStates { limit } if limit == counted - 1), "{refused:?}");
}

/// A period of case 5.1 ends where its seventh tooth enters without load.
#[test]
fn tolerance_sweep_lists_no_regular_angle_twice() {
    let angles_deg = swept_to(&PAPER_5_1, &load(20.0, VirtualWork), 1e-3).input_angles.input_angle_deg;
    assert!(angles_deg.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!([angles_deg[0], angles_deg[angles_deg.len() - 1]], [0.0, 360.0 / 26.0]);
}

// --- Where a tooth enters

/// Returns the bore that ends the flank this many spacings from the major axis, up to rounding.
fn bore_at(unbored: &Drive, spacings: u64) -> Option<f64> {
    let flank = unbored.flank();
    let installed = unbored.parameters().installed.unsigned_abs();
    let position = (4 * spacings <= installed).then(|| Position::of_lobe(2 * spacings, installed, 2))?;
    let center = flank.locus().at(position).unwrap();
    Some(flank.radius_mm(&center, &flank.at(&center)))
}

/// Returns the values up to four units in the last place around a value.
fn around(value: f64) -> impl Iterator<Item = f64> {
    (value.to_bits() - 4..=value.to_bits() + 4).map(f64::from_bits)
}

/// Asserts that both kinds of sweep agree about teeth and loads.
fn assert_entry_is_decided_once(parameters: &DriveParameters) -> bool {
    let Ok(possible) = Drive::new(parameters) else { return false };
    let mesh = Mesh::new(&possible);
    if !mesh.always_carries() {
        return false;
    }
    let load = load(20.0, Projection);
    let (by_samples, to_tolerance) = (swept(parameters, &load, 5), swept_to(parameters, &load, 1e-2));
    let teeth = mesh.teeth_in_mesh();
    for sweep in [&by_samples, &to_tolerance] {
        assert!(sweep.torque_balance_residual < 1e-12, "{:e} of {parameters:?}", sweep.torque_balance_residual);
        assert!(sweep.period_closure_residual < 1e-12, "{:e} of {parameters:?}", sweep.period_closure_residual);
        let (states, angles) = (sweep.states.len() as u64, sweep.input_angles.input_angle_deg.len() as u64);
        // One fewer if an unloaded tooth leaves at the very instant before another enters.
        assert!((angles * teeth.min - 1..=angles * teeth.max).contains(&states), "{parameters:?}");
    }
    for (by_samples, to_tolerance) in six_peaks(&by_samples).iter().zip(six_peaks(&to_tolerance)) {
        assert!(to_tolerance.value >= (1.0 - 1e-2) * by_samples.value, "{parameters:?}");
    }
    for (contact, peaks) in to_tolerance.peaks.iter() {
        // A force between five samples may be larger, but not by orders of magnitude.
        assert!(peaks.force_n.value <= 100.0 * by_samples.peaks.get(contact).force_n.value, "{parameters:?}");
    }
    true
}

#[test]
fn bore_at_whole_spacings_is_swept_alike() {
    // Found in 0.1: rounding put the wrong tooth at the end of the flank.
    let known = DriveParameters {
        wave_generator: ellipse(504.4784470731704, 498.60993196702196),
        teeth: 24,
        installed: 12,
        tooth_radius_mm: 163.34276420022084,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth: 22,
        tip_radius_mm: Some(826.2920076590049),
    };
    assert!(assert_entry_is_decided_once(&known));
    let peak = swept_to(&known, &load(20.0, Projection), 1e-6).peaks.ring.force_n.value;
    let by_samples = swept(&known, &load(20.0, Projection), 2000).peaks.ring.force_n.value;
    assert!((peak / by_samples - 1.0).abs() < 1e-3, "{peak} {by_samples}");
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn bores_near_whole_spacings_are_swept_alike(parameters in any_drive(), share in 0.0_f64..1.0) {
        let unbored = DriveParameters { tip_radius_mm: None, ..parameters };
        let Ok(possible) = Drive::new(&unbored) else { return Ok(()) };
        let most = Mesh::new(&possible).teeth_in_mesh().min;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number of teeth")]
        let spacings = 2 + (share * most.saturating_sub(2) as f64) as u64;
        let Some(bore_mm) = bore_at(&possible, spacings).filter(|_| spacings <= most) else { return Ok(()) };
        for tip_radius_mm in around(bore_mm) {
            assert_entry_is_decided_once(&DriveParameters { tip_radius_mm: Some(tip_radius_mm), ..unbored });
        }
    }
}

#[test]
fn flanks_near_whole_spacings_are_swept_alike() {
    let mut tried = 0;
    for teeth in [12_i64, 16, 20, 22, 28, 40] {
        for flattening in [0.005, 0.01, 0.015, 0.02, 0.027, 0.034, 0.05, 0.07] {
            let base = DriveParameters {
                wave_generator: ellipse(58.0, 58.0 * (1.0 - flattening)),
                teeth,
                installed: teeth,
                ring_teeth: teeth - 2,
                tooth_radius_mm: 1.0,
                tip_radius_mm: Some(58.5),
                ..PAPER_5_1
            };
            let of_radius = |tooth_radius_mm| DriveParameters { tooth_radius_mm, tip_radius_mm: None, ..base };
            let Some(critical) = Drive::new(&base).ok().and_then(|drive| drive.flank().critical_tooth_radius_mm())
            else {
                continue;
            };
            for tooth_radius_mm in around(critical) {
                tried += u32::from(assert_entry_is_decided_once(&of_radius(tooth_radius_mm)));
            }
            // Thicker teeth end the flank earlier. Bisection finds the radius with a flank end at whole spacings.
            let spacings =
                |radius: f64| Drive::new(&of_radius(radius)).map(|drive| Mesh::new(&drive).engaged_spacings());
            let (mut thin, mut thick) = (critical * 1.001, critical * 1.5);
            let (Ok(most), Ok(least)) = (spacings(thin), spacings(thick)) else { continue };
            let wanted = most.floor();
            if wanted <= least {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (thin + thick);
                if spacings(middle).unwrap() > wanted { thin = middle } else { thick = middle }
            }
            for tooth_radius_mm in around(thick) {
                tried += u32::from(assert_entry_is_decided_once(&of_radius(tooth_radius_mm)));
            }
        }
    }
    assert!(tried > 100, "{tried}");
}

// --- What a tolerance promises

struct Extremes {
    peaks: Vec<Peak>,
    half_widths_mm: Vec<f64>,
    /// Largest wind-up and stiffness.
    most: [f64; 2],
    least: [f64; 2],
    transmission_error_deg: f64,
    capacity_nm: f64,
}

impl Extremes {
    fn of(parameters: &DriveParameters, sweep: &Sweep) -> Self {
        let columns = [&sweep.input_angles.wind_up_deg, &sweep.input_angles.torsional_stiffness_nm_per_rad];
        Self {
            peaks: six_peaks(sweep),
            half_widths_mm: sweep.peaks.iter().map(|(_, peaks)| peaks.half_width_mm).collect(),
            most: columns.map(|column| column.iter().copied().fold(0.0, f64::max)),
            least: columns.map(|column| column.iter().copied().fold(f64::INFINITY, f64::min)),
            transmission_error_deg: sweep.transmission_error_peak_to_peak_deg(&drive(parameters)),
            capacity_nm: sweep.torque_capacity.unwrap().input_torque_nm,
        }
    }
}

/// Returns designs with extremes at smooth maxima, entries, corners and jumps of the stiffness.
pub(crate) fn designs() -> Vec<(DriveParameters, LoadParameters)> {
    let mut designs = Vec::new();
    let elliptic = DriveParameters {
        wave_generator: ellipse(58.0, 40.0),
        teeth: 12,
        installed: 12,
        ring_teeth: 14,
        tooth_radius_mm: 10.0,
        ..PAPER_5_1
    };
    for parameters in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, elliptic] {
        for (law, compatibility) in
            [(ContactLaw::Linear, VirtualWork), (ContactLaw::Palmgren, VirtualWork), (ContactLaw::Linear, Projection)]
        {
            for (ring, carrier) in [(0.0, 0.0), (10.0, 0.0), (3.0, 25.0)] {
                if carrier > 0.0 && (compatibility == Projection || semi_axes_mm(&parameters).1 == 40.0) {
                    continue;
                }
                for torque_nm in [1.0, 40.0] {
                    let mut load = load(torque_nm, compatibility);
                    load.law = law;
                    load.clearance_um = PerContact { wave_generator: 0.0, ring, carrier };
                    load.allowable_stress_mpa = Some(everywhere(1500.0));
                    designs.push((parameters, load));
                }
            }
        }
    }
    designs
}

#[test]
fn tolerance_bounds_extremes_and_root_bounds_half_widths() {
    let mut worst = [0.0_f64; 5];
    for (parameters, load) in designs() {
        let dense = Extremes::of(&parameters, &swept(&parameters, &load, 6_000));
        for tolerance in [1e-1, 1e-2, 1e-4, 1e-6, 1e-9] {
            let found = Extremes::of(&parameters, &swept_to(&parameters, &load, tolerance));
            let context = format!("{tolerance:e}, {:?} {:?} of {parameters:?}", load.law, load.clearance_um);
            let mut see = |kind: usize, missing: f64, allowed: f64| {
                assert!(missing <= allowed, "{kind}: {missing:e} of {allowed:e} at {context}");
                worst[kind] = worst[kind].max(missing / allowed);
            };
            // A sweep finds real values, so it can miss an extreme but not exceed it.
            for (found, dense) in found.peaks.iter().zip(&dense.peaks) {
                see(0, 1.0 - found.value / dense.value, tolerance);
            }
            for quantity in 0..2 {
                see(1, 1.0 - found.most[quantity] / dense.most[quantity], tolerance);
                see(1, found.least[quantity] / dense.least[quantity] - 1.0, tolerance);
            }
            let error_missed = dense.transmission_error_deg - found.transmission_error_deg;
            see(2, error_missed * drive(&parameters).teeth_per_wave(), tolerance * dense.most[0]);
            see(3, found.capacity_nm / dense.capacity_nm - 1.0, tolerance);
            for (found, dense) in found.half_widths_mm.iter().zip(&dense.half_widths_mm) {
                // The dense sweep knows the position to 1/6000 of the period.
                see(4, (found / dense - 1.0).abs(), tolerance.sqrt() + 1e-3);
            }
        }
    }
    println!("peaks, wind-up and stiffness, transmission error, capacity, half-widths: {worst:.3?} of what is allowed");
}

#[test]
fn finer_tolerance_stays_within_coarser_one() {
    for (parameters, load) in designs() {
        let finest = Extremes::of(&parameters, &swept_to(&parameters, &load, 1e-12));
        for tolerance in [1e-3, 1e-5, 1e-8] {
            let found = Extremes::of(&parameters, &swept_to(&parameters, &load, tolerance));
            let near = |found: f64, finest: f64| {
                let off = (found / finest - 1.0).abs();
                assert!(off <= tolerance, "{off:e} at {tolerance:e}, {:?} {load:?} of {parameters:?}", load.law);
            };
            for (found, finest) in found.peaks.iter().zip(&finest.peaks) {
                near(found.value, finest.value);
            }
            for quantity in 0..2 {
                near(found.most[quantity], finest.most[quantity]);
                near(found.least[quantity], finest.least[quantity]);
            }
            near(found.capacity_nm, finest.capacity_nm);
        }
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn tolerance_holds_on_any_drive_with_any_gap(
        parameters in any_swept_drive(),
        exponents in prop::array::uniform3(-1.0_f64..2.0),
        is_linear in any::<bool>(),
        tolerance in prop::sample::select(vec![1e-1, 1e-2, 1e-4]),
    ) {
        let mut load = load(20.0, VirtualWork);
        load.law = if is_linear { ContactLaw::Linear } else { ContactLaw::Palmgren };
        let [wave_generator, ring, carrier] = exponents.map(|exponent| 10.0_f64.powf(exponent));
        load.clearance_um = PerContact { wave_generator, ring, carrier };
        load.allowable_stress_mpa = Some(everywhere(1500.0));
        let dense = Extremes::of(&parameters, &swept(&parameters, &load, 1500));
        let found = Extremes::of(&parameters, &swept_to(&parameters, &load, tolerance));
        for (found, dense) in found.peaks.iter().zip(&dense.peaks) {
            prop_assert!(found.value >= (1.0 - tolerance) * dense.value, "{} {}", found.value, dense.value);
        }
        for quantity in 0..2 {
            prop_assert!(found.most[quantity] >= (1.0 - tolerance) * dense.most[quantity], "most {}", quantity);
            prop_assert!(found.least[quantity] <= (1.0 + tolerance) * dense.least[quantity], "least {}", quantity);
        }
        prop_assert!(found.capacity_nm <= (1.0 + tolerance) * dense.capacity_nm);
    }
}

#[test]
fn capacity_is_found_away_from_load_peaks() {
    let mut load = load(1.0, VirtualWork);
    load.clearance_um.ring = 10.0;
    load.allowable_stress_mpa = Some(everywhere(1500.0));
    let found = swept_to(&PAPER_5_1, &load, 1e-4).torque_capacity.unwrap().input_torque_nm;
    let dense = swept(&PAPER_5_1, &load, 100_000).torque_capacity.unwrap().input_torque_nm;
    assert!((found / dense - 1.0).abs() < 1e-4, "{found} {dense}");
    assert!((found - 37.018).abs() < 0.01, "{found}");
}

#[test]
fn gapless_capacity_grows_with_stress_squared() {
    for law in [ContactLaw::Linear, ContactLaw::Palmgren] {
        for parameters in [PAPER_5_1, PAPER_5_2] {
            let mut load = load(7.0, VirtualWork);
            (load.law, load.allowable_stress_mpa) = (law, Some(everywhere(1500.0)));
            let sweep = swept(&parameters, &load, 400);
            let stress = sweep.peaks.iter().map(|(_, peaks)| peaks.stress_mpa.value).fold(0.0, f64::max);
            let expected = 7.0 * (1500.0 / stress).powi(2);
            let found = sweep.torque_capacity.unwrap().input_torque_nm;
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} is not {expected}");
        }
    }
}

// --- What it costs

/// Returns a drive with this many teeth and this multiple of the critical radius.
pub(crate) fn of_many_teeth(teeth: i64, of_critical: f64) -> DriveParameters {
    let sin = (std::f64::consts::PI / teeth as f64).sin();
    let (a, ring) = (58.0, (teeth - 2) as f64 / 2.0);
    let tooth_radius_mm = 0.8 * a * sin / (1.0 - sin);
    // k² (a² - b²) r_c = a²b up to small terms.
    let stroke_mm = a * a / (2.0 * ring * ring * (tooth_radius_mm / of_critical));
    DriveParameters {
        wave_generator: ellipse(a, a - stroke_mm),
        teeth,
        installed: teeth,
        ring_teeth: teeth - 2,
        tooth_radius_mm,
        ..PAPER_5_1
    }
}

/// Returns the least limit of states that a sweep accepts.
fn least_state_limit(parameters: &DriveParameters, tolerance: f64) -> u64 {
    let (drive, load) = (drive(parameters), LoadCase::new(&load(20.0, Projection)).unwrap());
    let is_enough = |max_states| match sweep(&drive, &load, Points::tolerance(tolerance, max_states).unwrap(), &Never) {
        Ok(_) => true,
        Err(SolveError::TooManyStates { .. }) => false,
        Err(error) => panic!("{error}"),
    };
    let (mut few, mut enough) = (1, MAX_STATES);
    while enough - few > few / 50 + 1 {
        let middle = few.midpoint(enough);
        if is_enough(middle) { enough = middle } else { few = middle }
    }
    enough
}

#[test]
fn tolerance_sweep_cost_is_linear_in_teeth() {
    for teeth in [28, 200, 1000, 1800, 10_000] {
        for of_critical in [0.7, 1.5] {
            let parameters = of_many_teeth(teeth, of_critical);
            let end = drive(&parameters).flank_limit().end;
            assert_eq!(end == FlankEnd::Undercut, of_critical > 1.0);
            let in_mesh = Mesh::new(&drive(&parameters)).teeth_in_mesh().max;
            let states = least_state_limit(&parameters, 1e-4);
            println!(
                "{teeth} teeth, {end:?}: {states} states worked out, {} times the teeth in mesh",
                states / in_mesh
            );
            assert!(states < 400 * in_mesh, "{states} for {in_mesh} teeth in mesh");
        }
    }
}
