//! The fast path against the plain path, in all results of a sweep, on any drive.

use alloc_counter::count_alloc;
use proptest::prelude::*;
use toothwave_solver::gaps::{Runout, TipRelief};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::sweep::{
    LimitedBy, Points, Sweep, SweepPeaks, TorqueBalance, peaks, sweep, sweep_plain, sweep_plain_with_deviations,
    sweep_with_deviations,
};
use toothwave_solver::{
    Compatibility, Contact, ContactLaw, Deviations, Drive, DriveParameters, LoadCase, LoadParameters, Modification,
    Never, PerContact, Position, ToothShape, Torque, WaveGenerator,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, any_swept_drive, cases, drive, ellipse, everywhere, load, swept};

/// Allowed difference of two calculations, relative to the sum of the terms.
const ROUNDING: f64 = 1e-12;

fn largest(column: &[f64]) -> f64 {
    column.iter().fold(0.0_f64, |most, value| most.max(value.abs()))
}

/// Generates drives more elliptic than those of [`any_swept_drive`], up to the fast path's limit a/b = 5.
fn any_elliptic_drive() -> impl Strategy<Value = DriveParameters> {
    let shape = (1.2_f64..5.0, 0.0_f64..1.0, 0.0_f64..1.0);
    (shape, 4_i64..40, prop::sample::select(vec![1_i64, 2]), 0.05_f64..0.95, any::<bool>()).prop_filter_map(
        "an impossible drive",
        |((ratio, bore, stretch), half, removal, thickness, more)| {
            let installed = 2 * half;
            let (a, teeth) = (50.0, installed * removal);
            let b = a / (1.0 + (ratio - 1.0) * stretch.max(0.2));
            let sin = (std::f64::consts::PI / installed as f64).sin();
            let tooth_radius_mm = thickness * b * sin / (1.0 - sin);
            let least = a.max(b + 2.0 * tooth_radius_mm);
            let parameters = DriveParameters {
                wave_generator: ellipse(a, b),
                teeth,
                installed,
                tooth_radius_mm,
                tooth: ToothShape::Cylinder { width_mm: 10.0 },
                ring_teeth: if more { teeth + 2 } else { teeth - 2 },
                tip_radius_mm: Some(least + 0.5 * bore * (a + 2.0 * tooth_radius_mm - least)),
            };
            let possible = Drive::new(&parameters).ok()?;
            Mesh::new(&possible).always_carries().then_some(parameters)
        },
    )
}

/// Generates wave generators other than ellipses, with strokes from tiny to hollow valleys.
pub(crate) fn any_drive_of_other_kinds() -> impl Strategy<Value = DriveParameters> {
    let counts = (1_u32..8, 2_i64..20, prop::sample::select(vec![1_i64, 2]), any::<bool>());
    let shape = (any::<bool>(), -4.0_f64..0.0, 0.05_f64..0.95, prop::option::of(0.0_f64..1.0));
    (counts, shape).prop_filter_map(
        "an impossible drive",
        |((lobes, in_zone, removal, more), (has_path, stroke, thickness, bore))| {
            let lobes = i64::from(lobes);
            let installed = lobes * in_zone;
            let teeth = installed * removal;
            let sin = (std::f64::consts::PI / installed.max(3) as f64).sin();
            let tooth_radius_mm = thickness * 50.0 * sin;
            let amplitude_mm = 0.9 * 10.0_f64.powf(stroke) * tooth_radius_mm;
            let mean_radius_mm = 50.0 - tooth_radius_mm;
            let wave_generator = match (has_path, lobes) {
                (true, _) => WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm: 50.0, amplitude_mm },
                (false, 1) => WaveGenerator::Eccentric { radius_mm: mean_radius_mm, eccentricity_mm: amplitude_mm },
                (false, _) => WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm },
            };
            let ring_teeth = if more { teeth + lobes } else { teeth - lobes };
            carrying(wave_generator, [teeth, installed, ring_teeth], [tooth_radius_mm, amplitude_mm], bore)
        },
    )
}

/// Returns a possible drive with centres near 50 mm and a lever arm at every angle.
/// `bore` is the share of the stroke that is bored away from the ring's teeth.
fn carrying(
    wave_generator: WaveGenerator,
    [teeth, installed, ring_teeth]: [i64; 3],
    [tooth_radius_mm, amplitude_mm]: [f64; 2],
    bore: Option<f64>,
) -> Option<DriveParameters> {
    let root_mm = 50.0 + amplitude_mm + tooth_radius_mm;
    let parameters = DriveParameters {
        wave_generator,
        teeth,
        installed,
        tooth_radius_mm,
        tooth: ToothShape::Cylinder { width_mm: 10.0 },
        ring_teeth,
        tip_radius_mm: bore.map(|share| root_mm - share * 2.0 * amplitude_mm),
    };
    let possible = Drive::new(&parameters).ok()?;
    Mesh::new(&possible).always_carries().then_some(parameters)
}

/// Generates all kinds of wave generators with slot counts that make their zones unlike.
pub(crate) fn any_drive_of_unlike_zones() -> impl Strategy<Value = DriveParameters> {
    let counts = (2_i64..8, 5_i64..60, prop::sample::select(vec![1_i64, 2]), any::<bool>());
    let shape = (0_u32..3, -4.0_f64..0.0, 0.05_f64..0.9, prop::option::of(0.0_f64..1.0));
    (counts, shape).prop_filter_map(
        "an impossible drive, or one of like zones",
        |((lobes, installed, removal, more), (kind, stroke, thickness, bore))| {
            let lobes = if kind == 0 { 2 } else { lobes };
            if installed % lobes == 0 {
                return None;
            }
            let teeth = installed * removal;
            let tooth_radius_mm = thickness * 50.0 * (std::f64::consts::PI / installed as f64).sin();
            let amplitude_mm = 0.9 * 10.0_f64.powf(stroke) * tooth_radius_mm;
            let mean_radius_mm = 50.0 - tooth_radius_mm;
            let wave_generator = match kind {
                0 => ellipse(mean_radius_mm + amplitude_mm, mean_radius_mm - amplitude_mm),
                1 => WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm },
                _ => WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm: 50.0, amplitude_mm },
            };
            let ring_teeth = if more { teeth + lobes } else { teeth - lobes };
            carrying(wave_generator, [teeth, installed, ring_teeth], [tooth_radius_mm, amplitude_mm], bore)
        },
    )
}

/// Returns the columns with their names.
fn columns(sweep: &Sweep) -> Vec<(&'static str, &Vec<f64>)> {
    let (states, angles) = (&sweep.states, &sweep.input_angles);
    vec![
        ("input angle", &states.input_angle_deg),
        ("position", &states.position_deg),
        ("centre radius", &states.center_radius_mm),
        ("angle on the cam", &states.wave_generator_angle_deg),
        ("angle on the ring", &states.ring_angle_deg),
        ("force at the cam", &states.force_n.wave_generator),
        ("force at the ring", &states.force_n.ring),
        ("force at the carrier", &states.force_n.carrier),
        ("stress at the cam", &states.stress_mpa.wave_generator),
        ("stress at the ring", &states.stress_mpa.ring),
        ("stress at the carrier", &states.stress_mpa.carrier),
        ("input angles", &angles.input_angle_deg),
        ("wind-up", &angles.wind_up_deg),
        ("stiffness", &angles.torsional_stiffness_nm_per_rad),
    ]
}

/// Returns the amplification of a flank's relative error in the ring's stress. `1 + rκ` may be a small difference.
fn amplification(drive: &Drive, position_deg: f64) -> f64 {
    let lobes = drive.lobes();
    let valley_deg = 180.0 / f64::from(lobes);
    let position = if position_deg < 0.5 * valley_deg {
        Position::from_lobe(position_deg.to_radians(), lobes)
    } else {
        Position::from_valley((valley_deg - position_deg).to_radians(), lobes)
    };
    let center = drive.flank().locus().at(position).unwrap();
    let point = drive.flank().at(&center);
    let k = drive.flank().teeth_per_wave();
    let slope = center.tan_pressure_angle_derivative;
    let bending = k * k * slope.abs() * point.cos_pressure_angle.powi(2);
    let r_over_d = drive.parameters().tooth_radius_mm / center.center_radius_mm;
    1.0 + (1.0 + r_over_d * (1.0 + bending)) / point.regularity
}

/// Returns the amplification of a closing angle's error: `1 + Δφ K/M0` with the stiffness K if there are gaps, else 1.
fn amplification_by_gaps(drive: &Drive, load: &LoadCase, deviations: &Deviations, plain: &Sweep) -> f64 {
    if !load.has_gaps() && deviations.is_nil() {
        return 1.0;
    }
    let output_nm = load.output_torque_nm(drive);
    let angles = &plain.input_angles;
    let rotations = angles.wind_up_deg.iter().map(|wind_up_deg| wind_up_deg.to_radians() / drive.teeth_per_wave());
    let stiffnesses = &angles.torsional_stiffness_nm_per_rad;
    1.0 + rotations.zip(stiffnesses).map(|(rad, stiffness)| rad * stiffness / output_nm).fold(0.0, f64::max)
}

/// Returns the same at the capacity's own torque, which may be far below the load's, or 1 without an answer there.
/// Below the least allowed torque it grows at most as the torque falls: no approach falls faster than its force.
fn amplification_by_gaps_under(
    drive: &Drive,
    load: &LoadParameters,
    capacity_nm: f64,
    deviations: &Deviations,
    points: Points,
) -> f64 {
    let input_torque_nm = capacity_nm.max(1e-12);
    let torque = Torque::Input(input_torque_nm);
    let load = LoadCase::new(&LoadParameters { torque, allowable_stress_mpa: None, ..*load }).unwrap();
    let plain = if deviations.is_nil() {
        sweep_plain(drive, &load, points, &Never)
    } else {
        sweep_plain_with_deviations(drive, &load, deviations, points, &Never)
    };
    let amplified = plain.map_or(1.0, |plain| amplification_by_gaps(drive, &load, deviations, &plain));
    1.0 + (amplified - 1.0) * input_torque_nm / capacity_nm
}

/// Returns the further amplification in the stiffness at each input angle, for laws with a varying slope. A barely
/// loaded tooth has an approach that is a small difference, and its slope changes by at most a seventh of its force.
fn amplification_of_stiffness(plain: &Sweep) -> Vec<f64> {
    let states = &plain.states;
    let angles = plain.input_angles.input_angle_deg.iter();
    angles
        .map(|angle_deg| {
            let start = states.input_angle_deg.partition_point(|other| other < angle_deg);
            let end = states.input_angle_deg.partition_point(|other| other <= angle_deg);
            let forces = &states.force_n.wave_generator[start..end];
            let least = forces.iter().copied().filter(|&force| force > 0.0).fold(f64::INFINITY, f64::min);
            1.0 + largest(forces) / (7.0 * least)
        })
        .collect()
}

fn assert_both_paths_agree(parameters: &DriveParameters, load: &LoadParameters, samples: u64) {
    assert_both_paths_agree_on(parameters, load, &Deviations::default(), samples);
}

/// Compares both paths with deviations.
fn assert_both_paths_agree_on(
    parameters: &DriveParameters,
    load: &LoadParameters,
    deviations: &Deviations,
    samples: u64,
) {
    let drive = drive(parameters);
    let given = load;
    let load = LoadCase::new(given).unwrap();
    let points = Points::samples(samples).unwrap();
    let answers = if deviations.is_nil() {
        (sweep(&drive, &load, points, &Never), sweep_plain(&drive, &load, points, &Never))
    } else {
        (
            sweep_with_deviations(&drive, &load, deviations, points, &Never),
            sweep_plain_with_deviations(&drive, &load, deviations, points, &Never),
        )
    };
    let (Ok(fast), Ok(plain)) = &answers else {
        // Both paths must give the same error.
        assert_eq!(format!("{:?}", answers.0.map(|_| ())), format!("{:?}", answers.1.map(|_| ())));
        return;
    };
    let by_gaps = amplification_by_gaps(&drive, &load, deviations, plain);
    let of_stiffness = if by_gaps > 1.0 { amplification_of_stiffness(plain) } else { Vec::new() };
    assert_eq!(fast.mesh, plain.mesh);
    assert_eq!(fast.states.tooth, plain.states.tooth);
    assert_eq!(fast.states.lobe, plain.states.lobe);
    assert_eq!(fast.input_angles.loaded_teeth, plain.input_angles.loaded_teeth);
    let position_deg = &plain.states.position_deg;
    let of_plain = &plain.states.force_n;
    for ((name, fast), (_, plain)) in columns(fast).into_iter().zip(columns(plain)) {
        assert_eq!(fast.len(), plain.len(), "{name}");
        // The angle on the ring is a difference. Its first term is at most a quarter turn over k.
        let valley_deg = 180.0 / f64::from(drive.lobes());
        let of_terms = if name == "angle on the ring" { valley_deg / drive.flank().teeth_per_wave() } else { 0.0 };
        let scale = largest(plain).max(of_terms);
        // A stress follows its force with the same relative error. For a barely loaded tooth both are small.
        let forces = match name {
            _ if by_gaps == 1.0 => None,
            "stress at the cam" => Some(&of_plain.wave_generator),
            "stress at the ring" => Some(&of_plain.ring),
            "stress at the carrier" => Some(&of_plain.carrier),
            _ => None,
        };
        let largest_force = forces.map_or(0.0, |forces| largest(forces));
        for (index, (fast, plain)) in fast.iter().zip(plain).enumerate() {
            let amplified = match name {
                "stress at the ring" => amplification(&drive, position_deg[index]),
                "stiffness" if by_gaps > 1.0 => of_stiffness[index],
                _ => 1.0,
            };
            let off = (fast - plain).abs();
            let over_force =
                forces.filter(|forces| forces[index] > 0.0).map_or(0.0, |forces| largest_force / forces[index]);
            let allowed = ROUNDING * by_gaps * (scale * amplified + plain * over_force);
            assert!(off <= allowed, "{name}: {fast} is not {plain} of {scale}, {parameters:?} {load:?} {deviations:?}");
        }
    }
    for (contact, peaks) in fast.peaks.iter() {
        let expected = plain.peaks.get(contact);
        // If two states are equally high, rounding decides which is the peak. Its value is the column's either way.
        let amplified = amplification(&drive, expected.stress_mpa.position_deg);
        let amplified = by_gaps * if contact == Contact::Ring { amplified } else { 1.0 };
        let pairs = [(peaks.force_n, expected.force_n, by_gaps), (peaks.stress_mpa, expected.stress_mpa, amplified)];
        for (peak, expected, amplified) in pairs {
            let off = (peak.value - expected.value).abs();
            assert!(off <= ROUNDING * amplified * expected.value, "{contact:?}: {peak:?} {expected:?} {parameters:?}");
        }
        for (column, peak) in
            [(fast.states.force_n.get(contact), peaks.force_n), (fast.states.stress_mpa.get(contact), peaks.stress_mpa)]
        {
            assert_eq!(largest(column), peak.value, "a peak is the largest of its column");
            let at = column.iter().position(|&value| value >= peak.value).unwrap();
            assert_eq!(fast.states.input_angle_deg[at], peak.input_angle_deg);
            assert_eq!(fast.states.position_deg[at], peak.position_deg);
        }
        if peaks.stress_mpa.position_deg == expected.stress_mpa.position_deg {
            let assert_near = |what: &str, found: f64, expected: f64| {
                let off = (found / expected - 1.0).abs();
                assert!(off <= ROUNDING * amplified, "{contact:?}: {what} of {parameters:?}");
            };
            assert_near("half-width", peaks.half_width_mm, expected.half_width_mm);
            assert_eq!(peaks.half_length_mm.is_some(), expected.half_length_mm.is_some());
            if let Some((found, expected)) = peaks.half_length_mm.zip(expected.half_length_mm) {
                assert_near("half-length", found, expected);
            }
            assert_eq!(peaks.shear_stress_mpa.is_some(), expected.shear_stress_mpa.is_some());
            if let Some((found, of_plain)) = peaks.shear_stress_mpa.zip(expected.shear_stress_mpa) {
                assert_near("shear", found, of_plain);
                // The depth of the maximum has half of the digits.
                let off = (peaks.shear_depth_mm.unwrap() / expected.shear_depth_mm.unwrap() - 1.0).abs();
                assert!(off <= 1e-7 * amplified.max(1.0), "{contact:?}: depth of shear of {parameters:?}");
            }
        }
    }
    for sweep in [fast, plain] {
        assert!(sweep.torque_balance_residual < 1e-13, "{:e} of {parameters:?}", sweep.torque_balance_residual);
        let allowed = 1e-11 * by_gaps;
        assert!(sweep.period_closure_residual < allowed, "{:e} of {parameters:?}", sweep.period_closure_residual);
    }
    let by_gaps_at_capacity = plain.torque_capacity.map_or(by_gaps, |capacity| {
        amplification_by_gaps_under(&drive, given, capacity.input_torque_nm, deviations, points).max(by_gaps)
    });
    if let Some(expected) = plain.torque_capacity {
        let found = fast.torque_capacity.unwrap();
        let amplified = by_gaps_at_capacity * amplification(&drive, plain.peaks.ring.stress_mpa.position_deg);
        for (found, expected) in
            [(found.input_torque_nm, expected.input_torque_nm), (found.output_torque_nm, expected.output_torque_nm)]
        {
            assert!((found / expected - 1.0).abs() <= ROUNDING * amplified, "{found} {expected}");
        }
        let stress_of = |limit: LimitedBy| {
            let limiting = plain.peaks.iter().find(|(contact, _)| limit == (*contact).into());
            limiting.unwrap().1.stress_mpa.value
        };
        if by_gaps == 1.0 {
            assert!((stress_of(found.limited_by) / stress_of(expected.limited_by) - 1.0).abs() <= ROUNDING * amplified);
        }
    }
    if !deviations.is_nil() {
        return;
    }
    let peaks = peaks(&drive, &load, points, &Never).unwrap();
    if Mesh::new(&drive).zones_are_alike() {
        assert_eq!(peaks, SweepPeaks::from(fast), "peaks alone are those of the sweep: {parameters:?} {load:?}");
    } else {
        let of_stiffness = of_stiffness.iter().copied().fold(1.0, f64::max);
        assert_same_peaks(&drive, &peaks, plain, [by_gaps, by_gaps_at_capacity], of_stiffness);
    }
}

/// Asserts that peaks alone equal those of a sweep over all zones, up to rounding. Their places may be in another lap.
fn assert_same_peaks(
    drive: &Drive,
    peaks: &SweepPeaks,
    plain: &Sweep,
    [by_gaps, by_gaps_at_capacity]: [f64; 2],
    of_stiffness: f64,
) {
    let expected = SweepPeaks::from(plain);
    let at_ring = amplification(drive, expected.contacts.ring.stress_mpa.position_deg)
        .max(amplification(drive, peaks.contacts.ring.stress_mpa.position_deg));
    let assert_near = |what: &str, found: f64, expected: f64, amplified: f64| {
        let off = (found / expected - 1.0).abs();
        assert!(off <= ROUNDING * by_gaps * amplified, "{what}: {found} is not {expected}, {:?}", drive.parameters());
    };
    for (contact, found) in peaks.contacts.iter() {
        let expected = expected.contacts.get(contact);
        assert_near("force", found.force_n.value, expected.force_n.value, 1.0);
        let amplified = if contact == Contact::Ring { at_ring } else { 1.0 };
        assert_near("stress", found.stress_mpa.value, expected.stress_mpa.value, amplified);
    }
    assert_near("least wind-up", peaks.wind_up_deg.least, expected.wind_up_deg.least, 1.0);
    assert_near("largest wind-up", peaks.wind_up_deg.largest, expected.wind_up_deg.largest, 1.0);
    let (found, stiffness) = (peaks.torsional_stiffness_nm_per_rad, expected.torsional_stiffness_nm_per_rad);
    assert_near("least stiffness", found.least, stiffness.least, of_stiffness);
    assert_near("largest stiffness", found.largest, stiffness.largest, of_stiffness);
    assert_eq!(peaks.loaded_teeth, expected.loaded_teeth, "{:?}", drive.parameters());
    assert_eq!(peaks.torque_capacity.is_some(), expected.torque_capacity.is_some());
    if let Some((found, expected)) = peaks.torque_capacity.zip(expected.torque_capacity) {
        let amplified = at_ring * by_gaps_at_capacity / by_gaps;
        assert_near("capacity", found.input_torque_nm, expected.input_torque_nm, amplified);
        assert_near("capacity", found.output_torque_nm, expected.output_torque_nm, amplified);
    }
}

fn any_stiffnesses() -> impl Strategy<Value = [f64; 3]> {
    // Similar stiffnesses, so that `projection` has a solution on every drive.
    prop_oneof![Just([1e6; 3]), prop::array::uniform3(0.9e6_f64..1.1e6)]
}

fn any_samples() -> impl Strategy<Value = u64> {
    prop_oneof![1_u64..6, 40_u64..60, 500_u64..700]
}

proptest! {
    #![proptest_config(cases(256))]

    /// Superposed, unlike zones form one zone. This is thirty times faster than tooth by tooth.
    #[test]
    fn unlike_zones_match_plain_peaks(
        parameters in any_drive_of_unlike_zones(),
        law in prop::sample::select(vec![ContactLaw::Linear, ContactLaw::Palmgren, JOHNSON]),
        torque_exponent in -1.0_f64..2.0,
        gaps in prop::option::of(prop::array::uniform3(-1.0_f64..2.0)),
        allowable_stress_mpa in prop::option::of(Just(1500.0)),
        samples in any_samples(),
    ) {
        let mut load = load(10.0_f64.powf(torque_exponent), Compatibility::VirtualWork);
        load.law = law;
        let [wave_generator, ring, carrier] = gaps.map_or([0.0; 3], |gaps| gaps.map(|exponent| 10.0_f64.powf(exponent)));
        load.clearance_um = PerContact { wave_generator, ring, carrier };
        load.allowable_stress_mpa = allowable_stress_mpa.map(everywhere);
        assert_both_paths_agree(&parameters, &load, samples);
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn fast_path_matches_plain_path(
        parameters in prop_oneof![any_swept_drive(), any_elliptic_drive(), any_drive_of_other_kinds()],
        by_virtual_work in any::<bool>(),
        [wave_generator, ring, carrier] in any_stiffnesses(),
        allowable_stress_mpa in prop::option::of(Just(1500.0)),
        samples in any_samples(),
    ) {
        let (compatibility, stiffness) = if by_virtual_work {
            (Compatibility::VirtualWork, PerContact { wave_generator, ring, carrier })
        } else {
            (Compatibility::Projection, PerContact { wave_generator: 1e6, ring: 1e6, carrier: 1e6 })
        };
        let law = ContactLaw::Fixed(stiffness);
        assert_both_paths_agree(
            &parameters,
            &LoadParameters {
                law, allowable_stress_mpa: allowable_stress_mpa.map(everywhere), ..load(7.0, compatibility)
            },
            samples,
        );
    }

    #[test]
    fn fast_path_matches_plain_under_every_law(
        parameters in prop_oneof![any_swept_drive(), any_elliptic_drive(), any_drive_of_other_kinds()],
        by_virtual_work in any::<bool>(),
        law in any_law(),
        torque_exponent in -4.0_f64..3.0,
        gaps in prop::option::of(prop::array::uniform3(prop_oneof![Just(0.0), (-4.0_f64..2.0).prop_map(|exponent| 10.0_f64.powf(exponent))])),
        series in prop::array::uniform3(prop_oneof![Just(0.0), Just(1e-6)]),
        allowable_stress_mpa in prop::option::of(prop::array::uniform3((2.0_f64..6.0).prop_map(|exponent| 10.0_f64.powf(exponent)))),
        samples in any_samples(),
    ) {
        let [wave_generator, ring, carrier] = gaps.unwrap_or_default();
        let mut clearance_um = PerContact { wave_generator, ring, carrier };
        let is_projection = !by_virtual_work && matches!(law, ContactLaw::Linear | ContactLaw::Palmgren);
        let mut series_compliance_mm_per_n = PerContact::default();
        if is_projection {
            // Only the wave generator's gap has the same `projection` weight on every drive.
            (clearance_um.ring, clearance_um.carrier) = (0.0, 0.0);
        } else {
            let [wave_generator, ring, carrier] = series;
            series_compliance_mm_per_n = PerContact { wave_generator, ring, carrier };
        }
        let compatibility = if is_projection { Compatibility::Projection } else { Compatibility::VirtualWork };
        let load = LoadParameters {
            law, clearance_um, series_compliance_mm_per_n,
            allowable_stress_mpa: allowable_stress_mpa.map(|[wave_generator, ring, carrier]| PerContact { wave_generator, ring, carrier }),
            ..load(10.0_f64.powf(torque_exponent), compatibility)
        };
        assert_both_paths_agree(&parameters, &load, samples);
    }
}

/// Generates balls with any grooves or none, and flats of any possible length. Drives without room keep their teeth.
pub(crate) fn any_other_teeth() -> impl Strategy<Value = OtherTeeth> {
    let wider = || prop::option::of((-3.0_f64..1.0).prop_map(|exponent| 1.0 + 10.0_f64.powf(exponent)));
    prop_oneof![
        (wider(), wider(), wider()).prop_map(|(wave_generator, ring, carrier)| OtherTeeth::Balls(PerContact {
            wave_generator,
            ring,
            carrier
        })),
        (0.05_f64..0.99).prop_map(OtherTeeth::Flats),
    ]
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum OtherTeeth {
    /// Groove radii over the ball's radius.
    Balls(PerContact<Option<f64>>),
    /// Length of the flat over the greatest length possible at the ring's contacts.
    Flats(f64),
}

impl OtherTeeth {
    pub(crate) fn of(self, parameters: &DriveParameters) -> DriveParameters {
        let r = parameters.tooth_radius_mm;
        let tooth = match self {
            Self::Balls(wider) => ToothShape::Ball {
                groove_radius_mm: PerContact::of(|contact| wider.get(contact).map(|wider| wider * r)),
            },
            Self::Flats(share) => {
                let steepest = drive(parameters).largest_pressure_angle_deg().unwrap().to_radians();
                ToothShape::FlatSided { width_mm: 10.0, flat_length_mm: share * 2.0 * r * steepest.cos() }
            }
        };
        let shaped = DriveParameters { tooth, ..*parameters };
        if Drive::new(&shaped).is_ok() { shaped } else { *parameters }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn fast_path_matches_plain_for_balls_and_flats(
        parameters in prop_oneof![any_swept_drive(), any_elliptic_drive(), any_drive_of_other_kinds()],
        teeth in any_other_teeth(),
        law in any_law(),
        torque_exponent in -3.0_f64..2.0,
        gaps in prop::option::of(prop::array::uniform3(prop_oneof![Just(0.0), (-4.0_f64..2.0).prop_map(|exponent| 10.0_f64.powf(exponent))])),
        allowable_stress_mpa in prop::option::of(prop::array::uniform3((1.0_f64..5.0).prop_map(|exponent| 10.0_f64.powf(exponent)))),
        samples in any_samples(),
    ) {
        let parameters = teeth.of(&parameters);
        let [wave_generator, ring, carrier] = gaps.unwrap_or_default();
        let is_ball = matches!(parameters.tooth, ToothShape::Ball { .. });
        let load = LoadParameters {
            law: if is_ball { ContactLaw::Hertz } else { law },
            clearance_um: PerContact { wave_generator, ring, carrier },
            allowable_stress_mpa: allowable_stress_mpa.map(|[wave_generator, ring, carrier]| PerContact { wave_generator, ring, carrier }),
            ..load(10.0_f64.powf(torque_exponent), Compatibility::VirtualWork)
        };
        assert_both_paths_agree(&parameters, &load, samples);
    }
}

/// At 10 MPa the balls' approach is 1e-5 of the gap, so rounding of the gap is 2e-11 of the torque.
#[test]
fn tiny_capacity_is_accurate_despite_wide_gaps() {
    let parameters = DriveParameters {
        wave_generator: ellipse(39.33379486205007, 39.27141175813306),
        teeth: 300,
        installed: 100,
        tooth_radius_mm: 0.19103219423828893,
        tooth: ToothShape::Ball { groove_radius_mm: PerContact::default() },
        ring_teeth: 298,
        tip_radius_mm: None,
    };
    let load = LoadParameters {
        law: ContactLaw::Hertz,
        clearance_um: PerContact { carrier: 66.56202798386974, ..PerContact::default() },
        allowable_stress_mpa: Some(PerContact {
            wave_generator: 1413.83179522804,
            ring: 25.809100726022372,
            carrier: 10.0,
        }),
        ..load(1.0, Compatibility::VirtualWork)
    };
    assert_both_paths_agree(&parameters, &load, 5);
}

#[test]
fn undercut_balls_take_fast_path_on_any_generator() {
    let ball = ToothShape::Ball { groove_radius_mm: PerContact::default() };
    let on = |wave_generator: WaveGenerator| DriveParameters {
        wave_generator,
        ring_teeth: 28 - wave_generator.lobes(),
        ..PAPER_5_1
    };
    let load = LoadParameters { law: ContactLaw::Hertz, ..load(3.0, Compatibility::VirtualWork) };
    let case = LoadCase::new(&load).unwrap();
    for parameters in [
        PAPER_5_2,
        // A thousandth above the undercut threshold.
        DriveParameters { tooth_radius_mm: 6.756, ..PAPER_5_1 },
        on(WaveGenerator::Eccentric { radius_mm: 57.0, eccentricity_mm: 1.0 }),
        on(WaveGenerator::Harmonic { lobes: 7, mean_radius_mm: 57.0, amplitude_mm: 0.3 }),
        on(WaveGenerator::HarmonicPath { lobes: 2, mean_path_radius_mm: 62.0, amplitude_mm: 1.0 }),
    ] {
        let parameters = DriveParameters { tooth: ball, ..parameters };
        assert_both_paths_agree(&parameters, &load, 50);
        let plain = sweep_plain(&drive(&parameters), &case, Points::samples(50).unwrap(), &Never).unwrap();
        assert_ne!(swept(&parameters, &load, 50).states.stress_mpa, plain.states.stress_mpa, "{parameters:?}");
    }
}

#[test]
fn palmgren_with_series_compliance_takes_fast_path() {
    let parts = PerContact { wave_generator: 1e-6, ring: 0.0, carrier: 3e-6 };
    for series_compliance_mm_per_n in [parts, everywhere(1e-9), everywhere(1e-3)] {
        for (gap_um, torque_nm) in [(0.0, 20.0), (3.0, 20.0), (3.0, 1e-3)] {
            for allowable_stress_mpa in [None, Some(everywhere(900.0))] {
                let load = LoadParameters {
                    law: ContactLaw::Palmgren,
                    clearance_um: everywhere(gap_um),
                    series_compliance_mm_per_n,
                    allowable_stress_mpa,
                    ..load(torque_nm, Compatibility::VirtualWork)
                };
                assert_both_paths_agree(&PAPER_5_1, &load, 50);
                let case = LoadCase::new(&load).unwrap();
                let plain = sweep_plain(&drive(&PAPER_5_1), &case, Points::samples(50).unwrap(), &Never).unwrap();
                let fast = swept(&PAPER_5_1, &load, 50);
                assert_ne!(fast.states.stress_mpa, plain.states.stress_mpa, "{load:?}");
            }
        }
    }
}

#[test]
fn balls_and_flat_sided_teeth_take_fast_path() {
    let groove_radius_mm = PerContact { wave_generator: Some(5.3), ring: Some(5.2), carrier: None };
    let ball = ToothShape::Ball { groove_radius_mm };
    let flat = |flat_length_mm| ToothShape::FlatSided { width_mm: 15.0, flat_length_mm };
    let fixed = ContactLaw::Fixed(everywhere(4e5));
    for (tooth, law) in [
        (ball, ContactLaw::Hertz),
        (flat(4.0), ContactLaw::Linear),
        (flat(4.0), ContactLaw::Palmgren),
        (flat(4.0), JOHNSON),
        (flat(4.0), fixed),
        // The carrier ends before the flat does.
        (flat(5.5), JOHNSON),
    ] {
        let parameters = DriveParameters { tooth, ..PAPER_5_1 };
        for gap_um in [0.0, 1.0] {
            for allowable_stress_mpa in [None, Some(everywhere(900.0))] {
                let clearance_um = everywhere(gap_um);
                let load = LoadParameters {
                    law,
                    clearance_um,
                    allowable_stress_mpa,
                    ..load(20.0, Compatibility::VirtualWork)
                };
                assert_both_paths_agree(&parameters, &load, 50);
                let case = LoadCase::new(&load).unwrap();
                let plain = sweep_plain(&drive(&parameters), &case, Points::samples(50).unwrap(), &Never).unwrap();
                let fast = swept(&parameters, &load, 50);
                assert_ne!(fast.states.stress_mpa, plain.states.stress_mpa, "{tooth:?} {law:?} {gap_um}");
            }
        }
    }
}

/// The fast columns of balls know only Hertz's law without a series compliance.
#[test]
fn balls_beyond_plain_hertz_match_plain_path() {
    let ball = DriveParameters { tooth: ToothShape::Ball { groove_radius_mm: PerContact::default() }, ..PAPER_5_1 };
    for (law, series_compliance_mm_per_n) in [
        (ContactLaw::Hertz, everywhere(3e-6)),
        (ContactLaw::Hertz, PerContact { ring: 1e-6, ..PerContact::default() }),
        (ContactLaw::Fixed(everywhere(4e5)), PerContact::default()),
    ] {
        let load = LoadParameters { law, series_compliance_mm_per_n, ..load(20.0, Compatibility::VirtualWork) };
        assert_both_paths_agree(&ball, &load, 50);
    }
}

fn any_law() -> impl Strategy<Value = ContactLaw> {
    let depth = || prop::option::of(1.0_f64..50.0);
    prop_oneof![
        Just(ContactLaw::Linear),
        Just(ContactLaw::Palmgren),
        (depth(), depth(), depth()).prop_map(|(wave_generator, ring, carrier)| ContactLaw::Johnson {
            depth_mm: PerContact { wave_generator, ring, carrier }
        }),
    ]
}

/// Generates modifications of one common size. Some are not covered by gaps and give an interference.
fn any_modification() -> impl Strategy<Value = Modification> {
    let part = || prop_oneof![Just(0.0), -1.0_f64..1.0];
    let relief = (0.0_f64..1.0, prop_oneof![Just(1.0), Just(2.0), 0.1_f64..5.0]);
    let start_deg = 0.0_f64..180.0;
    ((-3.0_f64..1.5), prop::array::uniform8(part()), prop::option::of((relief, start_deg))).prop_map(
        |(exponent, parts, relief)| {
            let size = 10.0_f64.powf(exponent);
            let [
                ring_equidistant_um,
                ring_path_shift_um,
                ring_profile_shift_um,
                ring_rotation_arcsec,
                wave_generator_equidistant_um,
                slot_wall_um,
                carrier_rotation_arcsec,
                tooth_radius_um,
            ] = parts.map(|part| size * part);
            let ring_tip_relief =
                relief.map(|((share, power), start_deg)| TipRelief { amount_um: size * share, start_deg, power });
            Modification {
                ring_equidistant_um,
                ring_path_shift_um,
                ring_profile_shift_um,
                ring_rotation_arcsec,
                wave_generator_equidistant_um,
                slot_wall_um,
                carrier_rotation_arcsec,
                tooth_radius_um,
                ring_tip_relief,
            }
        },
    )
}

/// Moves the start of a tip relief onto the drive's flank.
fn start_on_flank(modification: Modification, parameters: &DriveParameters) -> Modification {
    let end_deg = drive(parameters).flank_limit().position.from_lobe_deg();
    let ring_tip_relief = modification
        .ring_tip_relief
        .map(|relief| TipRelief { start_deg: relief.start_deg / 180.0 * 0.999 * end_deg, ..relief });
    Modification { ring_tip_relief, ..modification }
}

/// Pseudo-random deviations of the chosen kinds.
#[derive(Debug, Clone, Copy)]
struct Deviating {
    size: f64,
    lists: [bool; 6],
    runouts: [bool; 3],
    seed: u64,
}

fn any_deviating() -> impl Strategy<Value = Deviating> {
    let parts = (prop::array::uniform6(any::<bool>()), prop::array::uniform3(any::<bool>()));
    (-3.0_f64..1.5, parts, any::<u64>()).prop_map(|(exponent, (lists, runouts), seed)| Deviating {
        size: 10.0_f64.powf(exponent),
        lists,
        runouts,
        seed,
    })
}

impl Deviating {
    fn of(self, parameters: &DriveParameters) -> Deviations {
        let mut state = self.seed;
        let mut random = move || {
            // Knuth's linear congruence.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let [tooth_radius, slot_angle, slot_wall, ring_space, ring_space_angle, lobe] = self.lists;
        let mut list = |is_wanted: bool, items: i64| -> Vec<f64> {
            if is_wanted { (0..items).map(|_| self.size * random()).collect() } else { Vec::new() }
        };
        let (slots, spaces) = (parameters.installed, parameters.ring_teeth);
        let runouts = self.runouts.map(|is_wanted| list(is_wanted, 2));
        let runout = |of: &[f64]| match of {
            [amount, angle] => Runout { amount_um: amount.abs(), angle_deg: 180.0 * angle / self.size },
            _ => Runout::default(),
        };
        let [wave_generator, ring, carrier] = runouts;
        Deviations {
            tooth_radius_um: list(tooth_radius, slots),
            slot_angle_arcsec: list(slot_angle, slots),
            slot_wall_um: list(slot_wall, slots),
            ring_space_um: list(ring_space, spaces),
            ring_space_angle_arcsec: list(ring_space_angle, spaces),
            wave_generator_lobe_um: list(lobe, parameters.wave_generator.lobes()),
            wave_generator_runout: runout(&wave_generator),
            ring_runout: runout(&ring),
            carrier_runout: runout(&carrier),
        }
    }
}

/// Largest number of states in a comparison of both paths.
const MOST_STATES: u64 = 30_000;

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn fast_path_matches_plain_with_modifications(
        parameters in prop_oneof![any_swept_drive(), any_elliptic_drive(), any_drive_of_other_kinds(), any_drive_of_unlike_zones()],
        teeth in prop::option::of(any_other_teeth()),
        law in any_law(),
        torque_exponent in -2.0_f64..2.0,
        modification in any_modification(),
        clearance in prop::array::uniform3(prop_oneof![Just(0.0), (0.0_f64..2.0).prop_map(|exponent| 10.0_f64.powf(exponent))]),
        allowable_stress_mpa in prop::option::of((2.0_f64..4.0).prop_map(|exponent| 10.0_f64.powf(exponent))),
        samples in any_samples(),
    ) {
        let parameters = teeth.map_or(parameters, |teeth| teeth.of(&parameters));
        let is_ball = matches!(parameters.tooth, ToothShape::Ball { .. });
        let [wave_generator, ring, carrier] = clearance;
        let load = LoadParameters {
            law: if is_ball { ContactLaw::Hertz } else { law },
            modification: start_on_flank(modification, &parameters),
            clearance_um: PerContact { wave_generator, ring, carrier },
            allowable_stress_mpa: allowable_stress_mpa.map(everywhere),
            ..load(10.0_f64.powf(torque_exponent), Compatibility::VirtualWork)
        };
        assert_both_paths_agree(&parameters, &load, samples);
    }

    #[test]
    fn fast_path_matches_plain_with_deviations(
        parameters in prop_oneof![any_swept_drive(), any_elliptic_drive(), any_drive_of_other_kinds(), any_drive_of_unlike_zones()],
        teeth in prop::option::of(any_other_teeth()),
        law in any_law(),
        torque_exponent in -2.0_f64..2.0,
        (deviating, modification) in (any_deviating(), prop::option::of(any_modification())),
        clearance_um in (0.0_f64..2.0).prop_map(|exponent| 10.0_f64.powf(exponent)),
        allowable_stress_mpa in prop::option::of((2.0_f64..4.0).prop_map(|exponent| 10.0_f64.powf(exponent))),
        samples in prop_oneof![1_u64..8, 40_u64..60],
    ) {
        let parameters = teeth.map_or(parameters, |teeth| teeth.of(&parameters));
        let deviations = deviating.of(&parameters);
        let mesh = deviations.mesh(&drive(&parameters));
        let Ok(Points::Samples(of_period)) = Points::samples(samples) else { panic!("{samples}") };
        prop_assume!(mesh.state_count(of_period) <= MOST_STATES);
        let is_ball = matches!(parameters.tooth, ToothShape::Ball { .. });
        let load = LoadParameters {
            law: if is_ball { ContactLaw::Hertz } else { law },
            modification: modification.map_or(Modification::NONE, |modification| start_on_flank(modification, &parameters)),
            clearance_um: everywhere(clearance_um),
            allowable_stress_mpa: allowable_stress_mpa.map(everywhere),
            ..load(10.0_f64.powf(torque_exponent), Compatibility::VirtualWork)
        };
        assert_both_paths_agree_on(&parameters, &load, &deviations, samples);
    }
}

/// Johnson's law with its default depths.
const JOHNSON: ContactLaw = ContactLaw::JOHNSON;

/// A force of 3e-13 of the largest has six correct digits, and so has its stress.
#[test]
fn stress_of_barely_loaded_tooth_is_accurate() {
    let wave_generator =
        WaveGenerator::HarmonicPath { lobes: 6, mean_path_radius_mm: 50.0, amplitude_mm: 0.001187144819369505 };
    let tooth_radius_mm = 2.694129592460173;
    let carrier = Some(1.0112496969771767 * tooth_radius_mm);
    let parameters = DriveParameters {
        wave_generator,
        teeth: 50,
        installed: 50,
        tooth_radius_mm,
        tooth: ToothShape::Ball { groove_radius_mm: PerContact { wave_generator: None, ring: None, carrier } },
        ring_teeth: 44,
        tip_radius_mm: None,
    };
    let deviating = Deviating {
        size: 0.853051259887023,
        lists: [false, false, true, true, true, true],
        runouts: [true, false, false],
        seed: 127887361568184349,
    };
    let modification = Modification {
        ring_equidistant_um: 0.0006717950056551121,
        tooth_radius_um: 0.007580979852663583,
        ..Modification::NONE
    };
    let load = LoadParameters {
        law: ContactLaw::Hertz,
        modification,
        clearance_um: everywhere(15.833587079254063),
        ..load(10.0_f64.powf(-1.7675780571054243), Compatibility::VirtualWork)
    };
    let deviations = deviating.of(&parameters);
    assert_both_paths_agree_on(&parameters, &load, &deviations, 1);
}

#[test]
fn fast_path_is_taken_under_every_law() {
    for law in [ContactLaw::Linear, ContactLaw::Palmgren, JOHNSON] {
        for gap_um in [0.0, 1.0] {
            let clearance_um = PerContact { wave_generator: gap_um, ring: gap_um, carrier: gap_um };
            let load = LoadParameters { law, clearance_um, ..load(20.0, Compatibility::VirtualWork) };
            assert_both_paths_agree(&PAPER_5_1, &load, 50);
            assert_both_paths_agree(
                &PAPER_5_1,
                &LoadParameters { allowable_stress_mpa: Some(everywhere(1500.0)), ..load },
                50,
            );
            let (fast, plain) = (swept(&PAPER_5_1, &load, 50), {
                let load = LoadCase::new(&load).unwrap();
                sweep_plain(&drive(&PAPER_5_1), &load, Points::samples(50).unwrap(), &Never).unwrap()
            });
            // Equal except in the last digits, which differ between the paths.
            assert_ne!(fast.states.stress_mpa, plain.states.stress_mpa, "{law:?} {gap_um}");
        }
    }
}

/// Returns drives of one to four lobes, with alike and unlike zones.
fn drives_that_may_deviate() -> Vec<DriveParameters> {
    let of = |wave_generator: WaveGenerator, teeth, ring_teeth| DriveParameters {
        wave_generator,
        teeth,
        installed: teeth,
        ring_teeth,
        ..PAPER_5_1
    };
    vec![
        of(ellipse(58.0, 56.0), 14, 12),
        of(ellipse(58.0, 56.6), 13, 15),
        of(WaveGenerator::Eccentric { radius_mm: 58.0, eccentricity_mm: 1.0 }, 12, 11),
        of(WaveGenerator::Harmonic { lobes: 3, mean_radius_mm: 60.0, amplitude_mm: 0.8 }, 16, 13),
        of(WaveGenerator::HarmonicPath { lobes: 4, mean_path_radius_mm: 65.0, amplitude_mm: 0.4 }, 18, 22),
    ]
}

#[test]
fn deviations_take_fast_path_from_any_lap_start() {
    let kinds = [
        ([true, true, true, false, false, false], [false, false, true]),
        ([false, false, false, true, true, false], [false, true, false]),
        ([false, false, false, false, false, true], [true, false, false]),
        ([true; 6], [true; 3]),
    ];
    let fixed = ContactLaw::Fixed(everywhere(4e5));
    for (parameters, seed) in drives_that_may_deviate().into_iter().zip(1..) {
        for ((lists, runouts), law) in kinds.into_iter().zip([fixed, ContactLaw::Palmgren, JOHNSON, fixed]) {
            let deviations = Deviating { size: 2.0, lists, runouts, seed }.of(&parameters);
            for samples in [1, 2, 3, 4, 5, 12] {
                let clearance_um = everywhere(9.0);
                let load = LoadParameters { law, clearance_um, ..load(20.0, Compatibility::VirtualWork) };
                assert_both_paths_agree_on(&parameters, &load, &deviations, samples);
                let (case, points) = (LoadCase::new(&load).unwrap(), Points::samples(samples).unwrap());
                let drive = drive(&parameters);
                let fast = sweep_with_deviations(&drive, &case, &deviations, points, &Never).unwrap();
                let plain = sweep_plain_with_deviations(&drive, &case, &deviations, points, &Never).unwrap();
                assert_ne!(fast.states.stress_mpa, plain.states.stress_mpa, "{parameters:?} {law:?} {samples}");
            }
        }
    }
}

#[test]
fn both_paths_keep_tolerance_with_unlike_items() {
    // The paths examine different places in the last digits, after the first sixteen intervals.
    let mut looked_elsewhere = [0, 0];
    for (parameters, seed) in drives_that_may_deviate().into_iter().zip(1..) {
        let drive = drive(&parameters);
        for (law, torque_nm) in [(ContactLaw::Palmgren, 20.0), (JOHNSON, 3.0)] {
            let load = LoadParameters {
                law,
                clearance_um: everywhere(9.0),
                allowable_stress_mpa: Some(everywhere(1500.0)),
                ..load(torque_nm, Compatibility::VirtualWork)
            };
            let (case, points) = (LoadCase::new(&load).unwrap(), Points::tolerance(1e-6, 10_000_000).unwrap());
            let lists = [true, false, true, false, false, true];
            let deviating = Deviating { size: 2.0, lists, runouts: [false, false, true], seed }.of(&parameters);
            for deviations in [Deviations::default(), deviating] {
                let fast = sweep_with_deviations(&drive, &case, &deviations, points, &Never).unwrap();
                let plain = sweep_plain_with_deviations(&drive, &case, &deviations, points, &Never).unwrap();
                let is_elsewhere = fast.states.input_angle_deg != plain.states.input_angle_deg;
                looked_elsewhere[usize::from(!deviations.is_nil())] += u32::from(is_elsewhere);
                let [fast, plain] = [SweepPeaks::from(&fast), SweepPeaks::from(&plain)];
                let assert_near = |what: &str, found: f64, expected: f64| {
                    assert!((found / expected - 1.0).abs() < 2e-6, "{what}: {found} {expected} {parameters:?} {law:?}");
                };
                for (contact, found) in fast.contacts.iter() {
                    let expected = plain.contacts.get(contact);
                    assert_near("force", found.force_n.value, expected.force_n.value);
                    assert_near("stress", found.stress_mpa.value, expected.stress_mpa.value);
                }
                assert_near("least wind-up", fast.wind_up_deg.least, plain.wind_up_deg.least);
                assert_near("largest wind-up", fast.wind_up_deg.largest, plain.wind_up_deg.largest);
                let capacity = |peaks: &SweepPeaks| peaks.torque_capacity.unwrap().input_torque_nm;
                assert_near("capacity", capacity(&fast), capacity(&plain));
            }
        }
    }
    assert!(looked_elsewhere.into_iter().all(|cases| cases > 2), "{looked_elsewhere:?} of 10 each");
}

#[test]
fn modifications_and_unlike_zones_take_fast_path() {
    let relief = TipRelief { amount_um: 5.0, start_deg: 20.0, power: 2.0 };
    for (parameters, law) in drives_that_may_deviate()
        .into_iter()
        .zip([ContactLaw::Linear, ContactLaw::Palmgren, JOHNSON].into_iter().cycle())
    {
        let unlike = !Mesh::new(&drive(&parameters)).zones_are_alike();
        for modification in [
            Modification::NONE,
            Modification { ring_tip_relief: Some(relief), ..Modification::NONE },
            Modification { ring_equidistant_um: 4.0, ring_path_shift_um: -3.0, ..Modification::NONE },
            Modification { ring_profile_shift_um: 3.0, tooth_radius_um: 1.0, slot_wall_um: 2.0, ..Modification::NONE },
            // The lost motion covers the ring's interference.
            Modification { ring_rotation_arcsec: 200.0, ring_equidistant_um: -1.0, ..Modification::NONE },
            Modification { carrier_rotation_arcsec: 9.0, wave_generator_equidistant_um: 1.0, ..Modification::NONE },
        ] {
            let load = LoadParameters { law, modification, ..load(20.0, Compatibility::VirtualWork) };
            let case = LoadCase::new(&load).unwrap();
            for samples in [50, 7] {
                assert_both_paths_agree(&parameters, &load, samples);
                let Ok(plain) = sweep_plain(&drive(&parameters), &case, Points::samples(samples).unwrap(), &Never)
                else {
                    assert!(modification.ring_equidistant_um < 0.0, "{modification:?}");
                    continue;
                };
                if unlike || modification != Modification::NONE {
                    let fast = swept(&parameters, &load, samples);
                    assert_ne!(fast.states.stress_mpa, plain.states.stress_mpa, "{parameters:?} {modification:?}");
                }
            }
        }
    }
}

#[test]
fn every_wave_generator_takes_fast_path() {
    for wave_generator in [
        WaveGenerator::Eccentric { radius_mm: 57.0, eccentricity_mm: 1.0 },
        WaveGenerator::Harmonic { lobes: 2, mean_radius_mm: 57.0, amplitude_mm: 1.0 },
        WaveGenerator::Harmonic { lobes: 7, mean_radius_mm: 57.0, amplitude_mm: 0.3 },
        WaveGenerator::HarmonicPath { lobes: 2, mean_path_radius_mm: 62.0, amplitude_mm: 1.0 },
        WaveGenerator::HarmonicPath { lobes: 7, mean_path_radius_mm: 62.0, amplitude_mm: 0.3 },
    ] {
        let lobes = wave_generator.lobes();
        let parameters = DriveParameters { wave_generator, ring_teeth: 28 - lobes, ..PAPER_5_1 };
        let load = LoadParameters { law: JOHNSON, ..load(20.0, Compatibility::VirtualWork) };
        let case = LoadCase::new(&load).unwrap();
        // Some tiles cover large rotations and have empty lanes.
        for samples in [50, 5000] {
            assert_both_paths_agree(&parameters, &load, samples);
            let plain = sweep_plain(&drive(&parameters), &case, Points::samples(samples).unwrap(), &Never).unwrap();
            let fast = swept(&parameters, &load, samples);
            assert_ne!(fast.states.stress_mpa, plain.states.stress_mpa, "{wave_generator:?} {samples}");
        }
    }
}

#[test]
fn both_paths_refuse_contacts_beyond_johnsons_law() {
    for torque_nm in [1e4, 1e5, 1e6, 1e7] {
        let load = LoadParameters { law: JOHNSON, ..load(torque_nm, Compatibility::VirtualWork) };
        assert_both_paths_agree(&PAPER_5_1, &load, 10);
    }
    // The capacity may lie beyond the law's end.
    for exponent in 0..38 {
        let allowable_stress_mpa = Some(everywhere(1e3 * 1.2_f64.powi(exponent)));
        let load = LoadParameters { law: JOHNSON, allowable_stress_mpa, ..load(20.0, Compatibility::VirtualWork) };
        assert_both_paths_agree(&PAPER_5_1, &load, 10);
    }
    // The load at which the law ends at some input angle, from both sides.
    let ends = |torque_nm: f64| {
        let load =
            LoadCase::new(&LoadParameters { law: JOHNSON, ..load(torque_nm, Compatibility::VirtualWork) }).unwrap();
        sweep(&drive(&PAPER_5_1), &load, Points::samples(10).unwrap(), &Never).is_err()
    };
    let (mut low, mut high) = (20.0, 1e7);
    assert!(!ends(low) && ends(high));
    while high / low > 1.0 + 1e-9 {
        let middle = 0.5 * (low + high);
        if ends(middle) { high = middle } else { low = middle }
    }
    for torque_nm in [low, high] {
        let load = LoadParameters { law: JOHNSON, ..load(torque_nm, Compatibility::VirtualWork) };
        assert_both_paths_agree(&PAPER_5_1, &load, 10);
    }
}

#[test]
fn residual_detects_torque_error_at_each_part() {
    let balance = TorqueBalance::new(&drive(&PAPER_5_1), 20_000.0);
    let right = PerContact { wave_generator: 20_000.0, ring: 260_000.0, carrier: 280_000.0 };
    assert!(balance.residual(&right) < 1e-15);
    let off = 1.01;
    for wrong in [
        PerContact { wave_generator: off * right.wave_generator, ..right },
        PerContact { ring: off * right.ring, ..right },
        PerContact { carrier: off * right.carrier, ..right },
        PerContact { carrier: (2.0 - off) * right.carrier, ..right },
    ] {
        assert!((balance.residual(&wrong) - 0.01).abs() < 1e-12, "{wrong:?}");
    }
    for none in [
        PerContact { wave_generator: f64::NAN, ..right },
        PerContact { ring: f64::NAN, ..right },
        PerContact { carrier: f64::NAN, ..right },
    ] {
        assert!(balance.residual(&none).is_nan());
    }
}

/// Default models of pointed and bored tips have no fast path. Studies ask for as many intervals as a sweep may have.
#[test]
fn peaks_computed_tooth_by_tooth_keep_no_states() {
    let gap = PerContact { ring: 2.0, ..PerContact::default() };
    let unlike = DriveParameters { teeth: 81, installed: 27, ring_teeth: 79, tooth_radius_mm: 2.2, ..PAPER_5_2 };
    let johnson = LoadParameters { law: JOHNSON, ..load(3.0, Compatibility::VirtualWork) };
    for (parameters, load) in [
        (PAPER_5_2, LoadParameters { ring_teeth_bend: true, ..johnson }),
        (PAPER_5_2, LoadParameters { corner_contact: true, clearance_um: gap, ..johnson }),
        (PAPER_5_1, LoadParameters { wave_generator_moves: true, clearance_um: gap, ..johnson }),
        (unlike, LoadParameters { ring_teeth_bend: true, ..johnson }),
    ] {
        let load = LoadParameters { allowable_stress_mpa: Some(everywhere(900.0)), ..load };
        let (drive, case) = (drive(&parameters), LoadCase::new(&load).unwrap());
        let of = |samples| count_alloc(|| peaks(&drive, &case, Points::samples(samples).unwrap(), &Never).unwrap());
        // The first sweep solves the ring's boundary elements.
        of(10);
        let ((_, growths, _), few) = of(1000);
        assert_eq!(few, SweepPeaks::from(&swept(&parameters, &load, 1000)), "{parameters:?} {load:?}");
        // Each input angle may have a fixed number of allocations. Growing columns would add a logarithm.
        let ((_, more_growths, _), _) = of(5000);
        assert_eq!((more_growths - growths) % 4000, 0, "{parameters:?} {load:?}");
    }
}

#[test]
fn sweep_allocates_only_columns() {
    let allocations = |samples| {
        let load = load(20.0, Compatibility::Projection);
        let ((allocations, growths, _), sweep) = count_alloc(|| swept(&PAPER_5_1, &load, samples));
        (sweep.states.len(), allocations + growths)
    };
    let (few_states, of_few) = allocations(50);
    let (many_states, of_many) = allocations(5000);
    assert!(many_states > 90 * few_states, "{few_states}, {many_states}");
    // Growing columns are moved as often as the logarithm of their length.
    assert!(of_few <= of_many && of_many < of_few + 30, "{of_few}, {of_many}");
}
