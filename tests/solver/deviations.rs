//! Sweeps with deviations against an independent calculation. It places teeth by angles, each a chain of springs with
//! the gaps of its slot, ring space and lobe, and finds the rotation by bisection.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use toothwave_solver::Compatibility::{Projection, VirtualWork};
use toothwave_solver::gaps::Runout;
use toothwave_solver::losses::period::{Losses, RadialForces};
use toothwave_solver::losses::{Friction, FrictionParameters, WaveGeneratorFriction};
use toothwave_solver::mesh::{Mesh, Samples};
use toothwave_solver::sweep::{self, Points, Sweep};
use toothwave_solver::{
    ContactLaw, Deviations, Drive, DriveParameters, FieldCode, LoadCase, LoadParameters, Modification, Never,
    Parameter, PerContact, SolveError, ToothShape, Violation, WaveGenerator,
};

use crate::drives::{PAPER_5_1, PAPER_5_2_BORED, drive, ellipse, everywhere, load, swept};

pub(crate) const FIXED: ContactLaw = ContactLaw::Fixed(PerContact { wave_generator: 3e5, ring: 5e5, carrier: 2e5 });
const ARCSEC: f64 = PI / 648_000.0;

fn of(wave_generator: WaveGenerator, teeth: i64, installed: i64, ring_teeth: i64, radius_mm: f64) -> DriveParameters {
    DriveParameters {
        wave_generator,
        teeth,
        installed,
        ring_teeth,
        tooth_radius_mm: radius_mm,
        tooth: ToothShape::Cylinder { width_mm: 15.0 },
        tip_radius_mm: None,
    }
}

/// Returns drives of one or more lobes: alike and unlike zones, both senses, full and half-filled slots, any flank end.
pub(crate) fn drives() -> Vec<DriveParameters> {
    let harmonic =
        |lobes, mean_radius_mm, amplitude_mm| WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm };
    vec![
        of(ellipse(58.0, 56.0), 14, 14, 12, 5.0),
        of(ellipse(58.0, 56.0), 14, 14, 16, 5.0),
        of(ellipse(58.0, 56.0), 24, 12, 22, 5.0),
        of(ellipse(58.0, 56.6), 13, 13, 15, 5.0),
        of(WaveGenerator::Eccentric { radius_mm: 30.0, eccentricity_mm: 1.0 }, 12, 12, 11, 4.0),
        of(WaveGenerator::Eccentric { radius_mm: 30.0, eccentricity_mm: 1.0 }, 20, 10, 21, 4.0),
        of(harmonic(3, 60.0, 0.8), 16, 16, 13, 4.0),
        of(harmonic(4, 60.0, 0.4), 18, 18, 22, 4.0),
        DriveParameters { tip_radius_mm: Some(67.0), ..of(ellipse(58.0, 56.0), 28, 14, 26, 5.0) },
    ]
}

/// Returns a generator of pseudo-random numbers between -1 and 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        // Knuth's linear congruence.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// The kinds of items that deviate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kinds {
    pub(crate) slots: bool,
    pub(crate) ring_spaces: bool,
    pub(crate) lobes: bool,
}

pub(crate) const ALL_KINDS: [Kinds; 7] = [
    Kinds { slots: true, ring_spaces: false, lobes: false },
    Kinds { slots: false, ring_spaces: true, lobes: false },
    Kinds { slots: false, ring_spaces: false, lobes: true },
    Kinds { slots: true, ring_spaces: true, lobes: false },
    Kinds { slots: true, ring_spaces: false, lobes: true },
    Kinds { slots: false, ring_spaces: true, lobes: true },
    Kinds { slots: true, ring_spaces: true, lobes: true },
];

fn count(of: i64) -> usize {
    usize::try_from(of).unwrap()
}

/// Returns deviations of these kinds, some micrometres large.
pub(crate) fn deviations(p: &DriveParameters, kinds: Kinds, seed: u64) -> Deviations {
    let mut random = random(seed);
    let mut list = |is_wanted: bool, items: i64, size: f64| {
        if is_wanted { (0..items).map(|_| size * random()).collect() } else { Vec::new() }
    };
    let Kinds { slots, ring_spaces, lobes } = kinds;
    let runout = |is_wanted: bool, angle_deg| Runout { amount_um: if is_wanted { 3.0 } else { 0.0 }, angle_deg };
    Deviations {
        tooth_radius_um: list(slots, p.installed, 1.0),
        slot_angle_arcsec: list(slots, p.installed, 4.0),
        slot_wall_um: list(slots, p.installed, 2.0),
        ring_space_um: list(ring_spaces, p.ring_teeth, 2.0),
        ring_space_angle_arcsec: list(ring_spaces, p.ring_teeth, 4.0),
        wave_generator_lobe_um: list(lobes, p.wave_generator.lobes(), 2.0),
        wave_generator_runout: runout(lobes, 40.0),
        ring_runout: runout(ring_spaces, -100.0),
        carrier_runout: runout(slots, 250.0),
    }
}

/// Returns a load with clearances that cover the deviations.
pub(crate) fn cleared(torque_nm: f64, law: ContactLaw) -> LoadParameters {
    LoadParameters {
        law,
        clearance_um: PerContact { wave_generator: 8.0, ring: 8.0, carrier: 8.0 },
        ..load(torque_nm, VirtualWork)
    }
}

pub(crate) fn swept_with(
    drive: &Drive,
    load: &LoadParameters,
    deviations: &Deviations,
    points: Points,
) -> Result<Sweep, SolveError> {
    sweep::sweep_with_deviations(drive, &LoadCase::new(load).unwrap(), deviations, points, &Never)
}

/// A tooth placed by angles, without the solver's integers.
#[derive(Debug, Clone, Copy)]
struct Placed {
    slot: u64,
    /// Lobe that the tooth is on.
    lobe: u64,
    ring_space: u64,
    position_rad: f64,
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small, and not negative")]
const fn whole(value: f64) -> u64 {
    value as u64
}

/// Returns all teeth between a lobe and the next valley, with their lobes, after an input rotation.
fn placed_by_angles(p: &DriveParameters, input_rad: f64) -> Vec<Placed> {
    let lobes = p.wave_generator.lobes() as f64;
    let s = if p.teeth > p.ring_teeth { 1.0 } else { -1.0 };
    let pitch = 2.0 * PI / lobes;
    let mut placed = Vec::new();
    for slot in 0..p.installed.unsigned_abs() {
        // In the ring's frame the carrier turns with the input over the ratio.
        let in_ring = 2.0 * PI * slot as f64 / p.installed as f64 + s * lobes / p.teeth as f64 * input_rad;
        let from_lobe_0 = (in_ring - input_rad).rem_euclid(2.0 * PI);
        let lobe = ((from_lobe_0 + 0.5 * pitch - 1e-9) / pitch).floor();
        let position_rad = from_lobe_0 - lobe * pitch;
        if position_rad < 1e-9 {
            continue;
        }
        // The middle of the space is the tooth's place at the root.
        let middle = in_ring + s * position_rad * lobes / p.ring_teeth as f64;
        let space = (middle * p.ring_teeth as f64 / (2.0 * PI)).round();
        assert!((space - middle * p.ring_teeth as f64 / (2.0 * PI)).abs() < 1e-6, "{p:?}");
        placed.push(Placed {
            slot,
            lobe: whole(lobe) % p.wave_generator.lobes().unsigned_abs(),
            ring_space: whole(space.rem_euclid(p.ring_teeth as f64)),
            position_rad,
        });
    }
    placed
}

/// Returns `h` and `h'` of the support function.
fn support(p: &DriveParameters, normal_rad: f64) -> (f64, f64) {
    let (sin, cos) = normal_rad.sin_cos();
    match p.wave_generator {
        WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } => {
            let h = (a * cos).hypot(b * sin);
            (h, (b * b - a * a) * sin * cos / h)
        }
        WaveGenerator::Eccentric { radius_mm, eccentricity_mm } => {
            (radius_mm + eccentricity_mm * cos, -eccentricity_mm * sin)
        }
        WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm } => {
            let (sin, cos) = (lobes as f64 * normal_rad).sin_cos();
            (mean_radius_mm + amplitude_mm * cos, -amplitude_mm * lobes as f64 * sin)
        }
        other => panic!("{other:?} is not among these drives"),
    }
}

/// A tooth as a chain of springs: travel arm, total gap, force ratios and direction of the wave generator's normal.
struct Chain {
    placed: Placed,
    arm_mm: f64,
    gap_mm: f64,
    ratio: [f64; 3],
    normal_rad: f64,
}

fn entry(list: &[f64], index: u64) -> f64 {
    list.get(usize::try_from(index).unwrap()).copied().unwrap_or(0.0)
}

fn chain(p: &DriveParameters, load: &LoadParameters, deviations: &Deviations, placed: Placed) -> Chain {
    let lobes = p.wave_generator.lobes() as f64;
    let s = if p.teeth > p.ring_teeth { 1.0 } else { -1.0 };
    let r = p.tooth_radius_mm;
    // Finds the normal for the tooth's position by bisection: the centre lags its normal.
    let (mut low, mut high) = (0.0, PI / lobes);
    for _ in 0..100 {
        let middle: f64 = 0.5 * (low + high);
        let (h, slope) = support(p, middle);
        if middle + (slope / (h + r)).atan() < placed.position_rad { low = middle } else { high = middle }
    }
    let normal_rad = 0.5 * (low + high);
    let (h, slope) = support(p, normal_rad);
    let d = (h + r).hypot(slope);
    let gamma = normal_rad - placed.position_rad;
    let k = p.ring_teeth as f64 / lobes;
    let beta = (k * gamma.tan()).atan();
    let ratio = [1.0, gamma.cos() / beta.cos(), gamma.sin() * p.teeth as f64 / lobes];
    // Table 4.1, per contact.
    let um = 1e-3;
    let off = |runout: &Runout, direction_rad: f64| {
        um * runout.amount_um * (direction_rad - runout.angle_deg.to_radians()).cos()
    };
    let in_cam = normal_rad + 2.0 * PI * placed.lobe as f64 / lobes;
    let in_ring = 2.0 * PI * placed.ring_space as f64 / p.ring_teeth as f64 - s * (placed.position_rad / k + beta);
    let in_carrier = 2.0 * PI * placed.slot as f64 / p.installed as f64 + s * 0.5 * PI;
    let thinner = um * entry(&deviations.tooth_radius_um, placed.slot);
    let gaps_mm = [
        thinner + um * entry(&deviations.wave_generator_lobe_um, placed.lobe)
            - off(&deviations.wave_generator_runout, in_cam),
        thinner
            + um * entry(&deviations.ring_space_um, placed.ring_space)
            + ARCSEC * entry(&deviations.ring_space_angle_arcsec, placed.ring_space) * d * beta.sin()
            + off(&deviations.ring_runout, in_ring),
        thinner
            + um * entry(&deviations.slot_wall_um, placed.slot)
            + ARCSEC * entry(&deviations.slot_angle_arcsec, placed.slot) * d
            + off(&deviations.carrier_runout, in_carrier),
    ];
    let PerContact { wave_generator, ring, carrier } = load.clearance_um;
    let clearance = [wave_generator, ring, carrier];
    let gap_mm = (0..3).map(|c| ratio[c] * (gaps_mm[c] + um * clearance[c])).sum();
    Chain { placed, arm_mm: d * gamma.sin(), gap_mm, ratio, normal_rad: in_cam }
}

/// Returns the input rotation at which the first tooth between lobe and flank end has closed its gaps.
pub(crate) fn first_closing_rad(
    p: &DriveParameters,
    load: &LoadParameters,
    deviations: &Deviations,
    reach_rad: f64,
    input_rad: f64,
) -> f64 {
    let placed = placed_by_angles(p, input_rad).into_iter().filter(|tooth| tooth.position_rad < reach_rad);
    let chains = placed.map(|tooth| chain(p, load, deviations, tooth));
    chains.map(|chain| chain.gap_mm / chain.arm_mm).fold(f64::INFINITY, f64::min)
}

/// Returns `F_H` of each chain after a rotation of the wave generator.
fn forces_n(chains: &[Chain], law: &ContactLaw, width_mm: f64, rotation_rad: f64) -> Vec<f64> {
    chains
        .iter()
        .map(|chain| {
            let approach_mm = rotation_rad * chain.arm_mm - chain.gap_mm;
            if approach_mm <= 0.0 {
                return 0.0;
            }
            let [_, ring, carrier] = chain.ratio;
            match law {
                ContactLaw::Fixed(k) => {
                    approach_mm / (1.0 / k.wave_generator + ring * ring / k.ring + carrier * carrier / k.carrier)
                }
                ContactLaw::Palmgren => {
                    let sum: f64 = chain.ratio.iter().map(|ratio| ratio * ratio.powf(0.9)).sum();
                    (approach_mm / (3.84e-5 / width_mm.powf(0.8) * sum)).powf(1.0 / 0.9)
                }
                other => panic!("{other:?} is not among these laws"),
            }
        })
        .collect()
}

/// Finds the rotation for a torque by bisection.
fn rotation_rad(chains: &[Chain], law: &ContactLaw, width_mm: f64, torque_nmm: f64) -> f64 {
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let forces = forces_n(chains, law, width_mm, middle);
        let torque: f64 = chains.iter().zip(forces).map(|(chain, force)| chain.arm_mm * force).sum();
        if torque < torque_nmm { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[test]
fn deviation_states_match_free_teeth_on_springs() {
    let mut worst = 0.0_f64;
    for (index, p) in drives().iter().enumerate() {
        for (kinds, law) in ALL_KINDS.into_iter().zip([FIXED, ContactLaw::Palmgren].into_iter().cycle()) {
            let drive = drive(p);
            let load = cleared(60.0, law);
            let deviations = deviations(p, kinds, index as u64);
            let samples = Samples::new(3).unwrap();
            let sweep = swept_with(&drive, &load, &deviations, Points::Samples(samples)).unwrap();
            let states = &sweep.states;
            let case = LoadCase::new(&load).unwrap();
            let unloaded_deg = sweep::unloaded_wind_up_deg(&drive, &case, &deviations, &sweep, &Never).unwrap();
            let reach_rad = drive.flank_limit().position.from_lobe_rad + 1e-9;
            let mut state = 0;
            for (angle, &input_angle_deg) in sweep.input_angles.input_angle_deg.iter().enumerate() {
                let expected_deg = angle as f64 / 3.0 * sweep.mesh.period_deg();
                assert!((input_angle_deg - expected_deg).abs() < 1e-12 * expected_deg.max(1.0));
                let placed = placed_by_angles(p, input_angle_deg.to_radians());
                let in_mesh = placed.into_iter().filter(|tooth| tooth.position_rad < reach_rad);
                let chains: Vec<_> = in_mesh.map(|tooth| chain(p, &load, &deviations, tooth)).collect();
                let width_mm = drive.tooth_width_mm();
                let rotation_rad = rotation_rad(&chains, &law, width_mm, 60e3);
                let off = (sweep.input_angles.wind_up_deg[angle].to_radians() - rotation_rad).abs() / rotation_rad;
                worst = worst.max(off);
                let first_rad = chains.iter().map(|chain| chain.gap_mm / chain.arm_mm).fold(f64::INFINITY, f64::min);
                worst = worst.max((unloaded_deg[angle].to_radians() - first_rad).abs() / first_rad);
                let loaded = forces_n(&chains, &law, width_mm, rotation_rad);
                for (chain, cam_force_n) in chains.iter().zip(loaded) {
                    assert_eq!(states.input_angle_deg[state], input_angle_deg);
                    assert_eq!(u64::from(states.tooth[state]), chain.placed.slot, "{p:?} {kinds:?}");
                    assert_eq!(u64::from(states.lobe[state]), chain.placed.lobe, "{p:?} {kinds:?}");
                    for ((_, column), ratio) in states.force_n.iter().zip(chain.ratio) {
                        let peak = column.iter().copied().fold(0.0, f64::max);
                        worst = worst.max((column[state] - cam_force_n * ratio).abs() / peak);
                    }
                    state += 1;
                }
            }
            assert_eq!(state, states.len(), "{p:?} {kinds:?}");
            assert_eq!(states.len() as u64, deviations.mesh(&drive).state_count(samples));
        }
    }
    println!("worst difference over the column's peak: {worst:e}");
    assert!(worst < 1e-12, "{worst:e}");
}

/// A tooth's position with its slot, ring space and lobe if these are compared.
type Items = (u64, Option<u64>, Option<u64>, Option<u64>);

/// Returns the combinations of deviating items: each slot's position on its lobe, with its items.
fn pattern(p: &DriveParameters, kinds: Kinds, load_periods: u64) -> BTreeSet<Items> {
    let removal = (p.teeth / p.installed) as f64;
    // An angle at a quarter, so that no tooth is at a lobe or in a valley.
    let input_rad = (load_periods as f64 + 0.26) * 2.0 * PI * removal / p.ring_teeth as f64;
    let found = placed_by_angles(p, input_rad);
    let of = |is_wanted: bool, item: u64| is_wanted.then_some(item);
    let found = found.iter().map(|tooth| {
        let place = whole((tooth.position_rad * 1e6).round());
        (place, of(kinds.slots, tooth.slot), of(kinds.ring_spaces, tooth.ring_space), of(kinds.lobes, tooth.lobe))
    });
    found.collect()
}

#[test]
fn deviation_sweep_ends_when_pattern_repeats() {
    for p in drives() {
        let drive = drive(&p);
        for kinds in ALL_KINDS {
            let mesh = deviations(&p, kinds, 1).mesh(&drive);
            let start = pattern(&p, kinds, 0);
            let periods = (1..).find(|&periods| pattern(&p, kinds, periods) == start).unwrap();
            assert_eq!(mesh.load_periods(), periods, "{p:?} {kinds:?}");
            let whole_deg = mesh.period_deg() * periods as f64;
            assert!((mesh.sweep_period_deg() / whole_deg - 1.0).abs() < 1e-15);
        }
    }
}

/// Listing all laps, slots by spaces, would take gigabytes.
#[test]
fn sixteen_million_laps_are_refused_at_once() {
    let p = of(ellipse(15_996.0, 15_995.0), 3999, 3999, 3997, 2.0);
    let unlike = |count: u32| (0..count).map(|item| f64::from(item % 7)).collect();
    let deviations = Deviations { slot_wall_um: unlike(3999), ring_space_um: unlike(3997), ..Deviations::default() };
    let drive = drive(&p);
    assert!(deviations.mesh(&drive).load_periods() > 1_000_000);
    let points = Points::tolerance(1e-3, 1_000_000).unwrap();
    let refused = swept_with(&drive, &load(20.0, VirtualWork), &deviations, points);
    assert_eq!(refused.err(), Some(SolveError::TooManyStates { limit: 1_000_000 }));
}

#[test]
fn zero_deviations_sweep_one_zone() {
    let drive = drive(&PAPER_5_1);
    let none = Runout { amount_um: 0.0, angle_deg: 77.0 };
    let nothing = Deviations {
        slot_wall_um: vec![0.0; 28],
        wave_generator_runout: none,
        ring_runout: none,
        carrier_runout: none,
        ..Deviations::default()
    };
    let load = load(20.0, Projection);
    let found = swept_with(&drive, &load, &nothing, Points::samples(50).unwrap()).unwrap();
    assert_eq!(found, swept(&PAPER_5_1, &load, 50));
    assert_eq!(found.mesh, Mesh::new(&drive));
}

#[test]
fn equal_deviation_of_all_items_is_modification() {
    let drives = [PAPER_5_1, of(ellipse(58.0, 56.6), 13, 13, 15, 5.0), PAPER_5_2_BORED];
    for (p, moves) in drives.into_iter().flat_map(|p| [(p, false), (p, true)]) {
        let drive = drive(&p);
        let torque = LoadParameters { wave_generator_moves: moves, ..cleared(20.0, ContactLaw::Palmgren) };
        let modified = LoadParameters {
            modification: Modification {
                tooth_radius_um: 0.7,
                slot_wall_um: 1.1,
                carrier_rotation_arcsec: -3.0,
                ring_equidistant_um: -0.6,
                ring_rotation_arcsec: 60.0,
                wave_generator_equidistant_um: 0.4,
                ..Modification::default()
            },
            ..torque
        };
        let all = |items: i64, value: f64| vec![value; count(items)];
        let deviating = Deviations {
            tooth_radius_um: all(p.installed, 0.7),
            slot_wall_um: all(p.installed, 1.1),
            slot_angle_arcsec: all(p.installed, -3.0),
            ring_space_um: all(p.ring_teeth, -0.6),
            ring_space_angle_arcsec: all(p.ring_teeth, 60.0),
            wave_generator_lobe_um: all(2, 0.4),
            ..Deviations::default()
        };
        let alike = swept(&p, &modified, 4);
        let told_apart = swept_with(&drive, &torque, &deviating, Points::samples(4).unwrap()).unwrap();
        // Load periods follow each other, each with as many teeth in every zone.
        let angles = alike.input_angles.input_angle_deg.len() - 1;
        for (angle, wind_up_deg) in told_apart.input_angles.wind_up_deg.iter().enumerate() {
            let expected_deg = alike.input_angles.wind_up_deg[angle % angles];
            assert!((wind_up_deg / expected_deg - 1.0).abs() < 1e-13);
        }
        for (contact, peaks) in alike.peaks.iter() {
            let found = told_apart.peaks.get(contact);
            assert!((found.force_n.value / peaks.force_n.value - 1.0).abs() < 1e-12);
            assert!((found.stress_mpa.value / peaks.stress_mpa.value - 1.0).abs() < 1e-12);
        }
        let zones = alike.mesh.zones_in_torque();
        let whole = f64::from(alike.input_angles.loaded_teeth[1]) * zones;
        assert_eq!(f64::from(told_apart.input_angles.loaded_teeth[1]), whole);
        // Losses are the same for either listing of zones.
        let friction = Friction::new(&FrictionParameters {
            wave_generator: WaveGeneratorFriction::Plain { coefficient: 0.02 },
            ring_coefficient: 0.05,
            carrier_coefficient: 0.04,
        });
        let load = LoadCase::new(&torque).unwrap();
        let lost =
            |sweep| Losses::of(&drive, &load, sweep, friction.as_ref().unwrap(), None, &Never).unwrap().mean.total();
        assert!((lost(&told_apart) / lost(&alike) - 1.0).abs() < 1e-11);
    }
}

fn turned_by(list: &[f64], items: usize) -> Vec<f64> {
    let mut list = list.to_vec();
    list.rotate_left(items);
    list
}

#[test]
fn rotated_lists_shift_sweep_by_a_load_period() {
    let p = of(ellipse(58.0, 56.0), 24, 12, 22, 5.0);
    let drive = drive(&p);
    let load = cleared(20.0, FIXED);
    let mut from_0 = deviations(&p, ALL_KINDS[6], 5);
    // A runout's direction cannot be rotated by whole items of every part.
    from_0.wave_generator_runout = Runout::default();
    from_0.ring_runout = Runout::default();
    from_0.carrier_runout = Runout::default();
    let from_1 = Deviations {
        tooth_radius_um: turned_by(&from_0.tooth_radius_um, 1),
        slot_angle_arcsec: turned_by(&from_0.slot_angle_arcsec, 1),
        slot_wall_um: turned_by(&from_0.slot_wall_um, 1),
        ring_space_um: turned_by(&from_0.ring_space_um, 2),
        ring_space_angle_arcsec: turned_by(&from_0.ring_space_angle_arcsec, 2),
        ..from_0.clone()
    };
    let points = Points::samples(5).unwrap();
    let [first, later] = [&from_0, &from_1].map(|list| swept_with(&drive, &load, list, points).unwrap());
    let intervals = first.input_angles.wind_up_deg.len() - 1;
    for angle in 0..intervals {
        let (one, other) =
            (first.input_angles.wind_up_deg[(angle + 5) % intervals], later.input_angles.wind_up_deg[angle]);
        assert!((one / other - 1.0).abs() < 1e-13, "{one} {other}");
    }
}

#[test]
fn eccentric_off_axis_has_another_eccentricity() {
    // The moved circle: distance of the tooth's centre from its middle, minus both radii.
    let eccentric = |eccentricity_mm| WaveGenerator::Eccentric { radius_mm: 30.0, eccentricity_mm };
    let p = of(eccentric(1.0), 12, 12, 11, 4.0);
    let none = cleared(20.0, FIXED);
    let amount_um = 1e-3;
    let off = Deviations { wave_generator_runout: Runout { amount_um, angle_deg: 0.0 }, ..Deviations::default() };
    for tooth in placed_by_angles(&p, 0.3) {
        let found_mm = chain(&p, &none, &off, tooth).gap_mm - chain(&p, &none, &Deviations::default(), tooth).gap_mm;
        let (h, slope) = support(&p, chain(&p, &none, &off, tooth).normal_rad);
        let d = (h + 4.0).hypot(slope);
        let (y, x) = tooth.position_rad.sin_cos();
        let moved_mm = (d * x - 1.0 - 1e-3 * amount_um).hypot(d * y) - 34.0;
        assert!((found_mm - moved_mm).abs() < 1e-13, "{found_mm:e} {moved_mm:e}");
    }
}

#[test]
fn tolerance_sweep_finds_peaks_of_all_load_periods() {
    for (index, p) in drives().iter().enumerate() {
        let drive = drive(p);
        let load =
            LoadParameters { allowable_stress_mpa: Some(everywhere(1500.0)), ..cleared(40.0, ContactLaw::Palmgren) };
        for kinds in [ALL_KINDS[0], ALL_KINDS[1], ALL_KINDS[5]] {
            let deviations = deviations(p, kinds, 7 + index as u64);
            let fine = swept_with(&drive, &load, &deviations, Points::samples(200).unwrap()).unwrap();
            let tolerance = Points::tolerance(1e-6, 10_000_000).unwrap();
            let found = swept_with(&drive, &load, &deviations, tolerance).unwrap();
            assert_eq!(found.mesh, fine.mesh);
            let pairs = fine.peaks.iter().flat_map(|(contact, fine)| {
                let found = found.peaks.get(contact);
                [(fine.force_n.value, found.force_n.value), (fine.stress_mpa.value, found.stress_mpa.value)]
            });
            let extremes = |sweep: &Sweep| {
                let column = sweep.input_angles.wind_up_deg.iter().copied();
                [column.clone().fold(0.0, f64::max), -column.fold(f64::INFINITY, f64::min)]
            };
            let wind_ups = extremes(&fine).into_iter().zip(extremes(&found));
            let capacity = |sweep: &Sweep| -sweep.torque_capacity.unwrap().input_torque_nm;
            let capacities = [(capacity(&fine), capacity(&found))];
            for (fine, found) in pairs.chain(wind_ups).chain(capacities) {
                let beyond = (found - fine) / fine.abs();
                assert!(beyond > -1e-6, "{found} misses {fine}: {p:?} {kinds:?}");
                // The samples miss the peaks by a little.
                assert!(beyond < 1e-2, "{found} is far above {fine}: {p:?} {kinds:?}");
            }
            let (first, last) = (found.states.input_angle_deg[0], found.states.input_angle_deg[found.states.len() - 1]);
            assert!(first == 0.0 && (last / found.mesh.sweep_period_deg() - 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn equal_deviations_have_peaks_of_one_period() {
    for p in [of(ellipse(58.0, 56.0), 14, 14, 12, 5.0), of(ellipse(58.0, 56.6), 13, 13, 15, 5.0), PAPER_5_2_BORED] {
        let drive = drive(&p);
        let torque = cleared(20.0, ContactLaw::Palmgren);
        let modification = Modification { slot_wall_um: 1.0, ..Modification::default() };
        let points = Points::tolerance(1e-8, 10_000_000).unwrap();
        let case = LoadCase::new(&LoadParameters { modification, ..torque }).unwrap();
        let alike = sweep::sweep(&drive, &case, points, &Never).unwrap();
        let walls = Deviations { slot_wall_um: vec![1.0; count(p.installed)], ..Deviations::default() };
        let told_apart = swept_with(&drive, &torque, &walls, points).unwrap();
        for (contact, peaks) in alike.peaks.iter() {
            let found = told_apart.peaks.get(contact);
            assert!((found.force_n.value / peaks.force_n.value - 1.0).abs() < 1e-8);
            assert!((found.stress_mpa.value / peaks.stress_mpa.value - 1.0).abs() < 1e-8);
        }
    }
}

#[test]
fn radial_force_of_unlike_teeth_is_their_sum() {
    for p in [of(ellipse(58.0, 56.0), 14, 14, 12, 5.0), of(ellipse(58.0, 56.0), 14, 14, 16, 5.0)] {
        let drive = drive(&p);
        let load = cleared(60.0, FIXED);
        let case = LoadCase::new(&load).unwrap();
        let deviations = deviations(&p, ALL_KINDS[4], 3);
        let sweep = swept_with(&drive, &load, &deviations, Points::samples(2).unwrap()).unwrap();
        let forces = RadialForces::of(&drive, &case, &deviations, &sweep, &Never).unwrap().unwrap();
        for (angle, input_angle_deg) in sweep.input_angles.input_angle_deg.iter().enumerate() {
            let placed = placed_by_angles(&p, input_angle_deg.to_radians());
            let chains: Vec<_> = placed.into_iter().map(|tooth| chain(&p, &load, &deviations, tooth)).collect();
            let rotation_rad = rotation_rad(&chains, &FIXED, 15.0, 60e3);
            let (mut x, mut y, mut all) = (0.0, 0.0, 0.0);
            for (chain, force_n) in chains.iter().zip(forces_n(&chains, &FIXED, 15.0, rotation_rad)) {
                let (sin, cos) = chain.normal_rad.sin_cos();
                (x, y, all) = (x - force_n * cos, y - force_n * sin, all + force_n);
            }
            assert!((forces.force_n[angle] - x.hypot(y)).abs() < 1e-9 * all);
            let turned = (forces.direction_deg[angle] - y.atan2(x).to_degrees()).rem_euclid(360.0);
            assert!(turned.min(360.0 - turned) < 1e-6);
            assert!(forces.force_n[angle] > 1e-3 * all);
        }
        // Alike zones have no radial force.
        let alike = sweep::sweep(&drive, &case, Points::samples(2).unwrap(), &Never).unwrap();
        assert_eq!(RadialForces::of(&drive, &case, &Deviations::default(), &alike, &Never).unwrap(), None);
    }
}

#[test]
fn interference_names_slot_lobe_and_input_angle() {
    let drive = drive(&PAPER_5_1);
    let mut walls = vec![0.0; 28];
    // A gap of 8 µm at each contact is 16 µm at the root at least.
    walls[9] = -400.0;
    let deviations = Deviations { slot_wall_um: walls, ..Deviations::default() };
    for points in [Points::samples(4).unwrap(), Points::tolerance(1e-4, 1_000_000).unwrap()] {
        let refused = swept_with(&drive, &cleared(20.0, FIXED), &deviations, points).unwrap_err();
        let SolveError::Interference { place: Some(place), position_deg, input_angle_deg: Some(input_deg), gap_um } =
            refused
        else {
            panic!("{refused:?}");
        };
        assert!(place.slot == 9 && gap_um < 0.0, "{refused:?}");
        let placed = placed_by_angles(&PAPER_5_1, input_deg.to_radians());
        let tooth = placed.iter().find(|tooth| tooth.slot == 9).unwrap();
        assert_eq!(place.lobe, tooth.lobe);
        assert!((tooth.position_rad.to_degrees() - position_deg).abs() < 1e-9);
        assert!(refused.to_string().contains("slot 9"), "{refused}");
    }
}

#[test]
fn reports_all_impossible_deviations() {
    let drive = drive(&PAPER_5_1);
    let wrong = Deviations {
        slot_wall_um: vec![1.0; 27],
        ring_runout: Runout { amount_um: -1.0, angle_deg: 400.0 },
        ..Deviations::default()
    };
    let refused = swept_with(&drive, &load(20.0, Projection), &wrong, Points::samples(4).unwrap()).unwrap_err();
    let SolveError::Impossible(violations) = refused else { panic!("{refused:?}") };
    let counted = |violation: &Violation| {
        matches!(violation, Violation { code: FieldCode::WrongLength, value: Some(27.0), limit: Some(28.0), .. })
    };
    assert!(violations.iter().any(counted), "{violations:?}");
    assert!(violations.contains(&Violation::needs_virtual_work(Parameter::Deviations)));
    assert_eq!(violations.len(), 4, "{violations:?}");
    // Zero deviations need the right length too.
    let nil = Deviations { slot_wall_um: vec![0.0; 27], ..Deviations::default() };
    let refused = swept_with(&drive, &load(20.0, Projection), &nil, Points::samples(4).unwrap()).unwrap_err();
    assert!(matches!(refused, SolveError::Impossible(violations) if violations.len() == 1));
}

#[test]
fn unloaded_wind_up_is_limit_of_small_torque() {
    for p in drives() {
        let drive = drive(&p);
        let deviations = deviations(&p, ALL_KINDS[4], 11);
        // Cases: teeth of both zones, teeth of one zone, and a tolerance sweep with jumps at double angles.
        for (deviations, points) in [
            (&deviations, Points::samples(5).unwrap()),
            (&Deviations::default(), Points::samples(5).unwrap()),
            (&deviations, Points::tolerance(1e-2, 1_000_000).unwrap()),
        ] {
            let light = cleared(1e-9, FIXED);
            let sweep = swept_with(&drive, &light, deviations, points).unwrap();
            let case = LoadCase::new(&light).unwrap();
            let unloaded_deg = sweep::unloaded_wind_up_deg(&drive, &case, deviations, &sweep, &Never).unwrap();
            assert_eq!(unloaded_deg.len(), sweep.input_angles.wind_up_deg.len());
            for (unloaded_deg, wind_up_deg) in unloaded_deg.iter().zip(&sweep.input_angles.wind_up_deg) {
                assert!(wind_up_deg >= unloaded_deg && wind_up_deg / unloaded_deg - 1.0 < 1e-9, "{p:?}");
            }
        }
    }
}
