//! Backlash at the output: closed forms, rules, and rigid bodies that are turned until they touch.

use std::f64::consts::PI;

use nalgebra::Vector2;
use toothwave_solver::backlash::{self, Backlash};
use toothwave_solver::gaps::{Runout, TipRelief};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::{
    Compatibility, Contact, Deviations, Drive, DriveParameters, LoadCase, LoadParameters, Modification, Never,
    PerContact, SolveError, ToothShape, WaveGenerator, findings,
};

use crate::deviations::{ALL_KINDS, deviations, drives};
use crate::drives::{ECCENTRIC, PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, drive, ellipse, everywhere, load};

const ARCSEC: f64 = PI / 648_000.0;
fn with_clearance(clearance_um: PerContact<f64>) -> LoadParameters {
    LoadParameters { clearance_um, ..load(20.0, Compatibility::VirtualWork) }
}

fn of(p: &DriveParameters, load: &LoadParameters, deviations: &Deviations) -> Result<Backlash, SolveError> {
    backlash::of(&drive(p), &LoadCase::new(load).unwrap(), deviations, &Never)
}

fn with_gap(p: &DriveParameters, clearance_um: PerContact<f64>) -> Backlash {
    of(p, &with_clearance(clearance_um), &Deviations::default()).unwrap()
}

fn arcmin_at(p: &DriveParameters, load: &LoadParameters, deviations: &Deviations, input_angle_deg: f64) -> f64 {
    backlash::arcmin_at(&drive(p), &LoadCase::new(load).unwrap(), deviations, input_angle_deg).unwrap()
}

fn arcmin(rad: f64) -> f64 {
    60.0 * rad.to_degrees()
}

fn only(contact: Contact, value: f64) -> PerContact<f64> {
    PerContact::of(|other| if other == contact { value } else { 0.0 })
}

#[test]
fn case_5_1_has_its_mean_and_contributions() {
    let found = with_gap(&PAPER_5_1, everywhere(10.0));
    let parts = found.contribution_arcmin;
    for (value, expected) in
        [(found.mean_arcmin, 6.266), (parts.wave_generator, 2.476), (parts.ring, 2.681), (parts.carrier, 1.108)]
    {
        assert!((value - expected).abs() < 6e-4, "{value} is not {expected}");
    }
    assert!(found.smallest_arcmin < found.mean_arcmin && found.mean_arcmin < found.largest_arcmin);
}

#[test]
fn without_gaps_there_is_none() {
    let found = with_gap(&PAPER_5_2, PerContact::default());
    assert_eq!([found.mean_arcmin, found.smallest_arcmin, found.largest_arcmin], [0.0; 3]);
}

#[test]
fn gaps_alone_have_less_than_together() {
    for p in [PAPER_5_1, PAPER_5_2, PAPER_5_2_BORED, ECCENTRIC] {
        let alone = Contact::all().map(|contact| with_gap(&p, only(contact, 10.0)).mean_arcmin);
        let together = with_gap(&p, everywhere(10.0)).mean_arcmin;
        assert!(alone.iter().sum::<f64>() < together, "{alone:?} {together}");
    }
}

#[test]
fn contributions_are_derivatives_of_the_mean() {
    let step = 1e-3;
    for p in [PAPER_5_1, PAPER_5_2_BORED, ECCENTRIC] {
        let gaps_um = PerContact { wave_generator: 8.0, ring: 12.0, carrier: 5.0 };
        let found = with_gap(&p, gaps_um);
        let sum: f64 = found.contribution_arcmin.iter().map(|(_, part)| part).sum();
        assert!((sum / found.mean_arcmin - 1.0).abs() < 1e-14);
        for contact in Contact::all() {
            let changed = |factor: f64| {
                let gap = |other: Contact| gaps_um.get(other) * if other == contact { factor } else { 1.0 };
                with_gap(&p, PerContact::of(gap)).mean_arcmin
            };
            let slope = (changed(1.0 + step) - changed(1.0 - step)) / (2.0 * step);
            let off = slope / found.contribution_arcmin.get(contact) - 1.0;
            assert!(off.abs() < 1e-4, "{off:e} at {contact:?} of {p:?}");
        }
    }
}

#[test]
fn slot_gaps_alone_close_beside_lobes() {
    let found = with_gap(&PAPER_5_1, only(Contact::Carrier, 10.0));
    let drive = drive(&PAPER_5_1);
    let radius_mm = |spacings: f64| {
        let position = toothwave_solver::Position::from_lobe(spacings * 2.0 * PI / 28.0, 2);
        drive.flank().locus().at(position).unwrap().center_radius_mm
    };
    let beside_lobe = 1e-2 / radius_mm(0.0) + 1e-2 / radius_mm(1.0);
    let between = 2e-2 / radius_mm(0.5);
    let [least, most] = [beside_lobe.min(between), beside_lobe.max(between)];
    assert!((found.smallest_arcmin / arcmin(least) - 1.0).abs() < 1e-9);
    assert!((found.largest_arcmin / arcmin(most) - 1.0).abs() < 1e-9);
}

#[test]
fn dense_angles_show_the_same_mean_and_no_more() {
    for (index, p) in drives().iter().enumerate() {
        let load = with_clearance(PerContact { wave_generator: 9.0, ring: 7.0, carrier: 8.0 });
        for kinds in [None, Some(ALL_KINDS[index % 7])] {
            let deviations = kinds.map_or_else(Deviations::default, |kinds| deviations(p, kinds, index as u64));
            let found = of(p, &load, &deviations).unwrap();
            let period_deg = deviations.mesh(&drive(p)).sweep_period_deg();
            let count = 2000;
            let at =
                |step: i32| arcmin_at(p, &load, &deviations, (f64::from(step) + 0.5) / f64::from(count) * period_deg);
            let dense: Vec<_> = (0..count).map(at).collect();
            let least = dense.iter().copied().fold(f64::INFINITY, f64::min);
            let most = dense.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let mean = dense.iter().sum::<f64>() / f64::from(count);
            let (smallest, largest) = (found.smallest_arcmin, found.largest_arcmin);
            let range = largest - smallest;
            assert!(smallest <= least + 1e-9 * mean && least - smallest < 0.1 * range, "{smallest} {least} {p:?}");
            assert!(largest >= most - 1e-9 * mean && largest - most < 0.1 * range, "{largest} {most} {p:?}");
            assert!((found.mean_arcmin / mean - 1.0).abs() < 3e-3, "{} {mean} {kinds:?} {p:?}", found.mean_arcmin);
            for (arcmin, at_deg) in
                [(found.smallest_arcmin, found.smallest_at_deg), (found.largest_arcmin, found.largest_at_deg)]
            {
                // A tooth may enter there.
                let around = [-1e-7, 0.0, 1e-7].map(|off| at_deg + off);
                let values = around.map(|angle_deg| arcmin_at(p, &load, &deviations, angle_deg.max(0.0)));
                let is_there = |value: f64| (value / arcmin - 1.0).abs() < 1e-6;
                assert!(values.into_iter().any(is_there), "{arcmin} at {at_deg} {values:?} {p:?}");
            }
        }
    }
}

#[test]
fn a_turned_carrier_moves_the_zero_alone() {
    let gaps = with_clearance(everywhere(10.0));
    let modification = Modification { carrier_rotation_arcsec: 20.0, ..Modification::NONE };
    let turned = of(&PAPER_5_1, &LoadParameters { modification, ..gaps }, &Deviations::default()).unwrap();
    let plain = with_gap(&PAPER_5_1, everywhere(10.0));
    assert!((turned.mean_arcmin / plain.mean_arcmin - 1.0).abs() < 1e-9);
    assert!((turned.smallest_arcmin / plain.smallest_arcmin - 1.0).abs() < 1e-9);
    let gapless = LoadParameters { modification, ..with_clearance(PerContact::default()) };
    let found = of(&PAPER_5_1, &gapless, &Deviations::default()).unwrap();
    for found_arcmin in [found.mean_arcmin, found.smallest_arcmin, found.largest_arcmin] {
        assert!(found_arcmin.abs() < 1e-12 * 20.0 / 60.0, "{found_arcmin:e}");
    }
}

#[test]
fn a_turned_slot_without_gaps_interferes() {
    let mut slot_angle_arcsec = vec![0.0; 28];
    slot_angle_arcsec[3] = 30.0;
    let deviations = Deviations { slot_angle_arcsec, ..Deviations::default() };
    let found = of(&PAPER_5_1, &with_clearance(PerContact::default()), &deviations).unwrap();
    assert!((found.smallest_arcmin / -0.5 - 1.0).abs() < 1e-9);
}

#[test]
fn a_tooth_too_thick_for_its_lobe_interferes() {
    let mut tooth_radius_um = vec![0.0; 28];
    tooth_radius_um[3] = -6.0;
    let deviations = Deviations { tooth_radius_um, ..Deviations::default() };
    let found = of(&PAPER_5_1, &with_clearance(everywhere(5.0)), &deviations);
    let Err(SolveError::Interference { place: Some(place), gap_um, .. }) = found else { panic!("{found:?}") };
    assert_eq!(place.slot, 3);
    assert!((gap_um + 2.0).abs() < 1e-9);
}

#[test]
fn refuses_where_no_tooth_is_in_mesh() {
    let p = DriveParameters { tip_radius_mm: Some(67.95), ..PAPER_5_1 };
    let found = of(&p, &with_clearance(everywhere(5.0)), &Deviations::default());
    assert!(matches!(found, Err(SolveError::NoToothInMesh { .. })), "{found:?}");
}

/// Numbers that seem to be at random, between 0 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        // Knuth's linear congruence.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    #[expect(clippy::cast_possible_truncation, reason = "a few")]
    fn whole(&mut self, low: i64, high: i64) -> i64 {
        low + (self.next() * (high - low + 1) as f64) as i64
    }
}

/// A drive that can exist, of the kinds that the index tells: wave generator, tooth, bore.
fn random_drive(index: usize, random: &mut Random) -> DriveParameters {
    loop {
        let radius_mm = random.between(30.0, 60.0);
        let stroke_mm = random.between(0.01, 0.025) * radius_mm;
        let lobes = random.whole(2, 4);
        let wave_generator = match index % 4 {
            0 => ellipse(radius_mm + stroke_mm, radius_mm - stroke_mm),
            1 => WaveGenerator::Eccentric { radius_mm, eccentricity_mm: stroke_mm },
            2 => WaveGenerator::Harmonic { lobes, mean_radius_mm: radius_mm, amplitude_mm: 0.6 * stroke_mm },
            _ => WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm: radius_mm, amplitude_mm: 0.6 * stroke_mm },
        };
        let lobes = wave_generator.lobes();
        let removal = random.whole(1, 2);
        let installed = random.whole(5, 12) * lobes + random.whole(0, 1);
        let teeth = installed * removal;
        let tooth_radius_mm = random.between(0.4, 0.75) * PI * radius_mm / installed as f64;
        let tooth = match index % 3 {
            0 => ToothShape::Cylinder { width_mm: 10.0 },
            1 => ToothShape::Ball { groove_radius_mm: PerContact::default() },
            _ => ToothShape::FlatSided { width_mm: 10.0, flat_length_mm: 0.6 * tooth_radius_mm },
        };
        let ring_teeth = if random.next() < 0.5 { teeth + lobes } else { teeth - lobes };
        let mut p = DriveParameters {
            wave_generator,
            teeth,
            installed,
            tooth_radius_mm,
            tooth,
            ring_teeth,
            tip_radius_mm: None,
        };
        let Ok(natural) = Drive::new(&p) else { continue };
        if index % 2 == 1 {
            let share = random.between(0.05, 0.35);
            p.tip_radius_mm =
                Some((1.0 - share) * natural.ring_tooth().natural_tip_radius_mm + share * natural.root_radius_mm());
        }
        if Drive::new(&p).is_ok_and(|drive| Mesh::new(&drive).engaged_spacings() > 2.0) {
            return p;
        }
    }
}

/// Modifications of all kinds, in parts of the size.
fn random_modification(p: &DriveParameters, random: &mut Random, size: f64) -> Modification {
    let mut um = |share: f64| size * random.between(-share, share);
    let end_deg = drive(p).flank_limit().position.from_lobe_deg();
    Modification {
        ring_equidistant_um: um(2.0),
        ring_path_shift_um: um(2.0),
        ring_profile_shift_um: um(2.0),
        ring_rotation_arcsec: um(4.0),
        wave_generator_equidistant_um: um(2.0),
        slot_wall_um: um(2.0),
        carrier_rotation_arcsec: um(4.0),
        tooth_radius_um: um(1.0),
        ring_tip_relief: Some(TipRelief { amount_um: 3.0 * size, start_deg: 0.4 * end_deg, power: 2.0 }),
    }
}

fn scaled(deviations: &Deviations, size: f64) -> Deviations {
    let list = |list: &Vec<f64>| list.iter().map(|value| size * value).collect();
    let runout = |runout: &Runout| Runout { amount_um: size * runout.amount_um, ..*runout };
    Deviations {
        tooth_radius_um: list(&deviations.tooth_radius_um),
        slot_angle_arcsec: list(&deviations.slot_angle_arcsec),
        slot_wall_um: list(&deviations.slot_wall_um),
        ring_space_um: list(&deviations.ring_space_um),
        ring_space_angle_arcsec: list(&deviations.ring_space_angle_arcsec),
        wave_generator_lobe_um: list(&deviations.wave_generator_lobe_um),
        wave_generator_runout: runout(&deviations.wave_generator_runout),
        ring_runout: runout(&deviations.ring_runout),
        carrier_runout: runout(&deviations.carrier_runout),
    }
}

fn unit(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(angle_rad.cos(), angle_rad.sin())
}

/// The parts as rigid bodies, as they are made, in µm and arcsec.
struct Bodies<'a> {
    p: &'a DriveParameters,
    gaps_um: PerContact<f64>,
    m: Modification,
    deviations: &'a Deviations,
    flank_end_rad: f64,
}

/// A tooth where it stands without gaps.
#[derive(Debug, Clone, Copy)]
struct Standing {
    slot: usize,
    lobe: i64,
    space: usize,
    angle_rad: f64,
    position_rad: f64,
}

impl Bodies<'_> {
    fn lobes(&self) -> f64 {
        self.p.wave_generator.lobes() as f64
    }

    fn k(&self) -> f64 {
        self.p.ring_teeth as f64 / self.lobes()
    }

    fn s(&self) -> f64 {
        if self.p.teeth > self.p.ring_teeth { 1.0 } else { -1.0 }
    }

    fn of_item(list: &[f64], item: usize) -> f64 {
        list.get(item).copied().unwrap_or(0.0)
    }

    fn thinner_mm(&self, tooth: &Standing) -> f64 {
        1e-3 * (self.m.tooth_radius_um + Self::of_item(&self.deviations.tooth_radius_um, tooth.slot))
    }

    /// A place of the path of centres around the wave generator by a parameter: point and outward normal's direction.
    fn path(&self, parameter: f64) -> (Vector2<f64>, f64) {
        let r = self.p.tooth_radius_mm;
        let by_support = |support: f64, slope: f64| {
            let n = unit(parameter);
            ((support + r) * n + slope * Vector2::new(-n.y, n.x), parameter)
        };
        match self.p.wave_generator {
            WaveGenerator::Ellipse { semi_major_mm: a, semi_minor_mm: b } => {
                let n = unit(parameter);
                let h = (a * n.x).hypot(b * n.y);
                by_support(h, (b * b - a * a) * n.x * n.y / h)
            }
            WaveGenerator::Eccentric { radius_mm, eccentricity_mm } => {
                by_support(radius_mm + eccentricity_mm * parameter.cos(), -eccentricity_mm * parameter.sin())
            }
            WaveGenerator::Harmonic { lobes, mean_radius_mm, amplitude_mm } => {
                let (u, phase) = (lobes as f64, lobes as f64 * parameter);
                by_support(mean_radius_mm + amplitude_mm * phase.cos(), -amplitude_mm * u * phase.sin())
            }
            WaveGenerator::HarmonicPath { lobes, mean_path_radius_mm, amplitude_mm } => {
                let (u, phase) = (lobes as f64, lobes as f64 * parameter);
                let d = mean_path_radius_mm + amplitude_mm * phase.cos();
                (d * unit(parameter), parameter + (amplitude_mm * u * phase.sin() / d).atan())
            }
            other => panic!("no rigid body of {other:?}"),
        }
    }

    /// The centre of a tooth that touches the wave generator, in its frame.
    fn on_cam(&self, tooth: &Standing, parameter: f64) -> Vector2<f64> {
        let (point, normal_rad) = self.path(parameter);
        let lobe = usize::try_from(tooth.lobe).unwrap();
        let lobe_um = Self::of_item(&self.deviations.wave_generator_lobe_um, lobe);
        let set_back_um = self.gaps_um.wave_generator + self.m.wave_generator_equidistant_um + lobe_um;
        let off = runout(&self.deviations.wave_generator_runout);
        point - (1e-3 * set_back_um + self.thinner_mm(tooth)) * unit(normal_rad) + off
    }

    /// A point of the flank as it is made, in the frame of its space, by a parameter of the path.
    fn flank_point(&self, parameter: f64) -> (Vector2<f64>, f64) {
        let (point, normal_rad) = self.path(parameter);
        let (d, position) = (point.norm(), point.y.atan2(point.x));
        let tan = (normal_rad - position).tan();
        let angle = -self.s() * position / self.k();
        let radius = d + 1e-3 * self.m.ring_path_shift_um;
        let normal_rad = angle - (self.s() * self.k() * d * tan / radius).atan();
        let relief_um = self.m.ring_tip_relief.map_or(0.0, |relief| {
            let start = relief.start_deg.to_radians();
            let share = ((position.abs() - start) / (self.flank_end_rad - start)).max(0.0);
            relief.amount_um * share.powf(relief.power)
        });
        let distance = self.p.tooth_radius_mm + 1e-3 * (self.gaps_um.ring + self.m.ring_equidistant_um + relief_um);
        let flank = radius * unit(angle) + distance * unit(normal_rad);
        (flank * (1.0 + 1e-3 * self.m.ring_profile_shift_um / flank.norm()), normal_rad)
    }

    /// The centre of a tooth that touches its space, in the ring's frame.
    fn on_ring(&self, tooth: &Standing, parameter: f64) -> Vector2<f64> {
        let (flank, near_rad) = self.flank_point(parameter);
        let step = 1e-3;
        let [left, right] = [-step, step].map(|off| self.flank_point(parameter + off).0);
        let [far_left, far_right] = [-2.0 * step, 2.0 * step].map(|off| self.flank_point(parameter + off).0);
        let tangent = 8.0 * (right - left) - (far_right - far_left);
        let normal = Vector2::new(tangent.y, -tangent.x).normalize();
        let normal = if normal.dot(&unit(near_rad)) > 0.0 { normal } else { -normal };
        let space_mm = 1e-3 * Self::of_item(&self.deviations.ring_space_um, tooth.space);
        let center = flank - (self.p.tooth_radius_mm - self.thinner_mm(tooth) - space_mm) * normal;
        let apart = self.m.ring_rotation_arcsec * tooth.position_rad.signum();
        let turned = Self::of_item(&self.deviations.ring_space_angle_arcsec, tooth.space) + apart;
        let middle_rad = 2.0 * PI * tooth.space as f64 / self.p.ring_teeth as f64;
        let rotation = nalgebra::Rotation2::new(middle_rad - self.s() * turned * ARCSEC);
        rotation * center + runout(&self.deviations.ring_runout)
    }

    /// All teeth that touch flanks, when the input has turned.
    fn standing(&self, input_rad: f64) -> Vec<Standing> {
        let (p, s, pitch) = (self.p, self.s(), 2.0 * PI / self.lobes());
        let slots = 0..usize::try_from(p.installed).unwrap();
        let of_slot = |slot: usize| {
            let angle_rad = 2.0 * PI * slot as f64 / p.installed as f64 + s * input_rad * self.lobes() / p.teeth as f64;
            let lobe = ((angle_rad - input_rad) / pitch).round();
            let position_rad = angle_rad - input_rad - lobe * pitch;
            let spaces = (angle_rad + s * position_rad / self.k()) * p.ring_teeth as f64 / (2.0 * PI);
            assert!((spaces - spaces.round()).abs() < 1e-6);
            #[expect(clippy::cast_possible_truncation, reason = "a few")]
            let (lobe, space) = (lobe as i64, spaces.round() as i64);
            let space = usize::try_from(space.rem_euclid(p.ring_teeth)).unwrap();
            let lobe = lobe.rem_euclid(p.wave_generator.lobes());
            Standing { slot, lobe, space, angle_rad, position_rad }
        };
        slots.map(of_slot).filter(|tooth| tooth.position_rad.abs() <= self.flank_end_rad).collect()
    }

    /// How much farther out the ring lets a tooth's centre stand than the wave generator, at an angle.
    fn room_mm(&self, tooth: &Standing, input_rad: f64, angle_rad: f64) -> f64 {
        let on_cam = |parameter: f64| self.on_cam(tooth, parameter);
        let on_ring = |parameter: f64| self.on_ring(tooth, parameter);
        let middle_rad = 2.0 * PI * tooth.lobe as f64 / self.lobes();
        let cam = radius_at(on_cam, middle_rad + tooth.position_rad, angle_rad - input_rad);
        radius_at(on_ring, tooth.position_rad, angle_rad) - cam
    }

    /// Turn of the carrier, s times against the forward sense or with it, at which a tooth is held between three bodies.
    fn closing_rad(&self, tooth: &Standing, input_rad: f64) -> f64 {
        let sense = self.s() * tooth.position_rad.signum();
        let room_mm = |turned_rad: f64| self.room_mm(tooth, input_rad, tooth.angle_rad - sense * turned_rad);
        let mut reach_rad = 1e-7;
        let is_free = room_mm(0.0) > 0.0;
        while (room_mm(if is_free { reach_rad } else { -reach_rad }) > 0.0) == is_free {
            reach_rad *= 1.5;
            if reach_rad > 0.05 {
                return f64::INFINITY;
            }
        }
        let (mut free, mut held) = if is_free { (0.0, reach_rad) } else { (-reach_rad, 0.0) };
        for _ in 0..50 {
            let middle = 0.5 * (free + held);
            if room_mm(middle) > 0.0 { free = middle } else { held = middle }
        }
        let at_rad = tooth.angle_rad - sense * free;
        let middle_rad = 2.0 * PI * tooth.lobe as f64 / self.lobes();
        let on_cam = |parameter: f64| self.on_cam(tooth, parameter);
        let radius_mm = radius_at(on_cam, middle_rad + tooth.position_rad, at_rad - input_rad);
        self.slot_rad(tooth, radius_mm * unit(at_rad), input_rad) * -sense
    }

    /// The turn of the carrier at which a wall of the slot touches the tooth.
    fn slot_rad(&self, tooth: &Standing, center: Vector2<f64>, input_rad: f64) -> f64 {
        let sense = self.s() * tooth.position_rad.signum();
        let wall_um = Self::of_item(&self.deviations.slot_wall_um, tooth.slot);
        let free_mm = 1e-3 * (self.gaps_um.carrier + self.m.slot_wall_um + wall_um) + self.thinner_mm(tooth);
        let turned = self.m.carrier_rotation_arcsec + Self::of_item(&self.deviations.slot_angle_arcsec, tooth.slot);
        let carrier_rad = self.s() * input_rad * self.lobes() / self.p.teeth as f64;
        let slot_rad = 2.0 * PI * tooth.slot as f64 / self.p.installed as f64 + self.s() * turned * ARCSEC;
        // The carrier's own axis, off by its runout, turns with it.
        let aside_mm = |turn_rad: f64| {
            let off = nalgebra::Rotation2::new(carrier_rad + turn_rad) * runout(&self.deviations.carrier_runout);
            unit(carrier_rad + turn_rad + slot_rad).perp(&(center - off)) - sense * free_mm
        };
        let (mut low, mut high) = (-0.1, 0.1);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if aside_mm(middle) > 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// The carrier's turn between the two senses.
    fn backlash_rad(&self, input_rad: f64) -> f64 {
        let (mut front, mut behind) = (f64::INFINITY, f64::INFINITY);
        for tooth in self.standing(input_rad) {
            let side = if tooth.position_rad > 0.0 { &mut front } else { &mut behind };
            *side = side.min(self.closing_rad(&tooth, input_rad));
        }
        front + behind
    }
}

fn runout(runout: &Runout) -> Vector2<f64> {
    1e-3 * runout.amount_um * unit(runout.angle_deg.to_radians())
}

/// The radius of a curve at an angle, by secants of its parameter.
fn radius_at(curve: impl Fn(f64) -> Vector2<f64>, near: f64, angle_rad: f64) -> f64 {
    let off_rad = |point: Vector2<f64>| unit(angle_rad).perp(&point).atan2(unit(angle_rad).dot(&point));
    let (mut before, mut now) = (near, near + 1e-3);
    let mut off_before = off_rad(curve(before));
    for _ in 0..40 {
        let point = curve(now);
        let off = off_rad(point);
        // The normal of a flank is a difference, known to some 1e-12; beyond it secants would follow rounding.
        if off.abs() < 1e-11 {
            return point.norm();
        }
        (before, now) = (now, now - off * (now - before) / (off - off_before));
        off_before = off;
    }
    panic!("no point of the curve at {angle_rad}")
}

#[test]
fn rigid_bodies_turned_until_they_touch_agree() {
    let mut random = Random(7);
    let mut worst = [0.0_f64; 2];
    for index in 0..10 {
        let p = random_drive(index, &mut random);
        let seed = random.0;
        let plain = deviations(&p, ALL_KINDS[6], seed);
        let angles: Vec<_> = (0..12).map(|_| random.between(0.0, 2.0 * PI * p.teeth as f64)).collect();
        let off = |size: f64| {
            let deviations = scaled(&plain, size);
            let modification = random_modification(&p, &mut Random(seed), size);
            let load = LoadParameters { modification, ..with_clearance(everywhere(16.0 * size)) };
            let bodies = Bodies {
                p: &p,
                gaps_um: load.clearance_um,
                m: modification,
                deviations: &deviations,
                flank_end_rad: drive(&p).flank_limit().position.from_lobe_rad,
            };
            let mut squares = 0.0;
            let mut mean = 0.0;
            for &input_rad in &angles {
                let found = arcmin_at(&p, &load, &deviations, input_rad.to_degrees());
                squares += (found - arcmin(bodies.backlash_rad(input_rad))).powi(2);
                mean += found / angles.len() as f64;
            }
            (squares / angles.len() as f64).sqrt() / mean
        };
        let [coarse, fine] = [0.5, 0.25].map(off);
        println!("{index}: {coarse:.1e} {fine:.1e} {:.3} {p:?}", fine / coarse);
        worst = [worst[0].max(coarse), worst[1].max(fine / coarse)];
    }
    // The error over the gap halves with the gap.
    assert!(worst[0] < 1e-2 && worst[1] < 0.56, "{worst:?}");
}

#[test]
fn only_negative_backlash_is_a_finding() {
    let of_backlash = |clearance_um, slot_angle: f64, tooth_radius: f64| {
        let list = |value: f64| (0..28).map(|item| if item == 3 { value } else { 0.0 }).collect();
        let deviations = Deviations {
            slot_angle_arcsec: list(slot_angle),
            tooth_radius_um: list(tooth_radius),
            ..Deviations::default()
        };
        let found = of(&PAPER_5_1, &with_clearance(everywhere(clearance_um)), &deviations);
        findings::of_backlash(&found)
    };
    assert_eq!(of_backlash(0.0, 0.0, 0.0), None);
    assert_eq!(of_backlash(10.0, 30.0, 0.0), None);
    let jammed = of_backlash(0.0, 30.0, 0.0).unwrap();
    assert!((jammed.value + 0.5).abs() < 1e-9 && jammed.contact.is_none(), "{jammed:?}");
    let blocked = of_backlash(5.0, 0.0, -6.0).unwrap();
    assert!((blocked.value + 2.0).abs() < 1e-6 && blocked.contact == Some(Contact::Ring), "{blocked:?}");
}
