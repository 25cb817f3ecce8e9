//! Gaps at a tooth's three contacts from modifications and deviations of the parts (docs/explanation/theory.md section
//! 4.8). A positive value opens a gap. All are exact to first order in their size, and add up.

use std::f64::consts::PI;

use crate::cam::ToothCenter;
use crate::contact::PerContact;
use crate::drive::{Drive, DriveParameters};
use crate::mesh::{Mesh, Place, greatest_common_divisor};
use crate::ring::FlankPoint;
use crate::violation::{FieldCode, Listed, Modified, Parameter, Violation};

pub(crate) const MM_PER_UM: f64 = 1e-3;
pub(crate) const RAD_PER_ARCSEC: f64 = PI / 648_000.0;

/// Modification: intentional differences of the parts from the conjugate shape, the same for all teeth, with
/// `virtual_work` only. A positive value opens a gap. A positive angle is a rotation away from the flank under load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, default, expecting = "an object"), schema(as = ModificationDocument))]
pub struct Modification {
    /// Offset of the ring's profile along its normals, in µm. Default: 0 µm.
    pub ring_equidistant_um: f64,
    /// Outward shift of the path that generates the ring, along its radii, in µm. Default: 0 µm.
    pub ring_path_shift_um: f64,
    /// Outward shift of the ring's profile, along its own radii, in µm. Default: 0 µm.
    pub ring_profile_shift_um: f64,
    /// Rotation of the ring's flanks about the axis, in arcsec. Default: 0 arcsec.
    pub ring_rotation_arcsec: f64,
    /// Offset of the wave generator along its normals, in µm. Default: 0 µm.
    pub wave_generator_equidistant_um: f64,
    /// Offset of the slots' walls, in µm. Default: 0 µm.
    pub slot_wall_um: f64,
    /// Rotation of the carrier about the axis, in arcsec. Default: 0 arcsec.
    pub carrier_rotation_arcsec: f64,
    /// Reduction of the teeth's radius, in µm. Default: 0 µm.
    pub tooth_radius_um: f64,
    /// Tip relief: offset of the ring's flank towards its tip. Default: no relief.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub ring_tip_relief: Option<TipRelief>,
}

/// Tip relief: the flank is offset by C ((ψ - ψ_t)/(ψ_e - ψ_t))^n for tooth positions ψ above ψ_t. ψ_e is the flank's
/// end.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, expecting = "an object"), schema(as = TipReliefDocument))]
pub struct TipRelief {
    /// Amount C at the flank's end, in µm.
    pub amount_um: f64,
    /// Start ψ_t: tooth position from the middle of the lobe, in deg. It must be before the flank's end.
    pub start_deg: f64,
    /// Power n.
    pub power: f64,
}

/// Deviations of individual items of the parts, measured or random, with `virtual_work` only. A positive value opens a
/// gap. A positive angle is a rotation away from the flank under load. A list has one entry for each item, counted from
/// 0, or is empty if no item deviates.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, default, expecting = "an object"), schema(as = DeviationsDocument))]
pub struct Deviations {
    /// Reduction of the teeth's radius, by slot, in µm.
    pub tooth_radius_um: Vec<f64>,
    /// Rotation of the slots about the axis, by slot, in arcsec.
    pub slot_angle_arcsec: Vec<f64>,
    /// Offset of the slots' walls, by slot, in µm.
    pub slot_wall_um: Vec<f64>,
    /// Offset of the profiles along their normals, by ring space, in µm.
    pub ring_space_um: Vec<f64>,
    /// Rotation of the ring's spaces about the axis, by ring space, in arcsec.
    pub ring_space_angle_arcsec: Vec<f64>,
    /// Offset of the wave generator along its normals, by lobe, in µm.
    pub wave_generator_lobe_um: Vec<f64>,
    /// Runout of the wave generator. Its angle is counted from the middle of lobe 0.
    pub wave_generator_runout: Runout,
    /// Runout of the ring. Its angle is counted from the middle of space 0.
    pub ring_runout: Runout,
    /// Runout of the carrier. Its angle is counted from slot 0.
    pub carrier_runout: Runout,
}

/// Runout: distance of a part's centre from the axis, in a direction that is fixed in the part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, default, expecting = "an object"), schema(as = RunoutDocument))]
pub struct Runout {
    /// Distance from the axis, in µm. Default: 0 µm.
    pub amount_um: f64,
    /// Direction, in deg. Default: 0 deg.
    pub angle_deg: f64,
}

impl Deviations {
    /// Returns the runout of the part that the teeth touch at each contact.
    pub const fn runout(&self) -> PerContact<Runout> {
        PerContact { wave_generator: self.wave_generator_runout, ring: self.ring_runout, carrier: self.carrier_runout }
    }

    /// Returns the values that are impossible for a drive of these parameters. Lists are checked against item counts
    /// that are valid.
    pub fn violations(&self, drive: &DriveParameters) -> Vec<Violation> {
        let mut violations = Vec::new();
        let slots = (Parameter::InstalledTeeth, drive.installed);
        let spaces = (Parameter::RingTeeth, drive.ring_teeth);
        let lobes = (Parameter::Lobes, drive.wave_generator.lobes());
        for (listed, list, (parameter, items)) in [
            (Listed::ToothRadius, &self.tooth_radius_um, slots),
            (Listed::SlotAngle, &self.slot_angle_arcsec, slots),
            (Listed::SlotWall, &self.slot_wall_um, slots),
            (Listed::RingSpace, &self.ring_space_um, spaces),
            (Listed::RingSpaceAngle, &self.ring_space_angle_arcsec, spaces),
            (Listed::WaveGeneratorLobe, &self.wave_generator_lobe_um, lobes),
        ] {
            let can_be = parameter.check(items as f64).is_none();
            if let Some(items) = usize::try_from(items).ok().filter(|_| can_be)
                && !list.is_empty()
                && list.len() != items
            {
                let (count, parameter) = (list.len(), Parameter::DeviationList(listed));
                let detail = format!("{count} entries for {items} items: give one for each, or none");
                let code = FieldCode::WrongLength;
                violations.push(Violation::new(code, parameter, count as f64, items as f64, detail));
            }
            let entries = list.iter().enumerate();
            violations.extend(entries.filter_map(|(entry, &value)| Parameter::Deviation(listed, entry).check(value)));
        }
        for (contact, &Runout { amount_um, angle_deg }) in self.runout().iter() {
            violations.extend(Parameter::RunoutAmount(contact).check(amount_um));
            violations.extend(Parameter::RunoutAngle(contact).check(angle_deg));
        }
        violations
    }

    /// True if all deviations are zero. Zones are then alike, and places do not matter.
    pub fn is_nil(&self) -> bool {
        !(self.are_of_slots() || self.are_of_ring_spaces() || self.are_of_lobes())
    }

    fn are_of_slots(&self) -> bool {
        any([&self.tooth_radius_um, &self.slot_angle_arcsec, &self.slot_wall_um])
            || self.carrier_runout.amount_um != 0.0
    }

    fn are_of_ring_spaces(&self) -> bool {
        any([&self.ring_space_um, &self.ring_space_angle_arcsec]) || self.ring_runout.amount_um != 0.0
    }

    fn are_of_lobes(&self) -> bool {
        any([&self.wave_generator_lobe_um]) || self.wave_generator_runout.amount_um != 0.0
    }

    /// Returns the mesh of a drive with these deviations. Its sweep has as many load periods as it takes until the same
    /// items meet again (docs/explanation/theory.md section 4.8).
    pub fn mesh(&self, drive: &Drive) -> Mesh {
        if self.is_nil() {
            return Mesh::new(drive);
        }
        let p = drive.parameters();
        // The counts of a checked drive are positive and small.
        let whole = |count: i64| count.unsigned_abs();
        let (lobes, teeth, slots, spaces) =
            (u64::from(drive.lobes()), whole(p.teeth), whole(p.installed), whole(p.ring_teeth));
        // Shift after which they meet again, in load periods: `items` over `alike`.
        let (items, alike) = match (self.are_of_slots(), self.are_of_ring_spaces(), self.are_of_lobes()) {
            (false, false, _) => (1, 1),
            (true, false, false) => (slots, lobes),
            (true, false, true) => (slots, 1),
            (false, true, false) => (spaces, lobes),
            (false, true, true) => (spaces, greatest_common_divisor(teeth / slots, lobes)),
            (true, true, false) => (slots * spaces, lobes),
            (true, true, true) => (slots * spaces, greatest_common_divisor(teeth, lobes)),
        };
        Mesh::of_items(drive, items / greatest_common_divisor(items, alike))
    }
}

/// True if any entry of the lists is not zero.
fn any<const LISTS: usize>(lists: [&[f64]; LISTS]) -> bool {
    lists.into_iter().flatten().any(|&value| value != 0.0)
}

/// Returns an entry of a list; zero beyond its end.
pub(crate) fn of(list: &[f64], index: u64) -> f64 {
    usize::try_from(index).ok().and_then(|index| list.get(index)).copied().unwrap_or_default()
}

/// Returns the middle entry of a list, ordered by value; zero if it is empty.
fn middle(list: &[f64]) -> f64 {
    let mut by_size = list.to_vec();
    by_size.sort_by(f64::total_cmp);
    by_size.get(list.len() / 2).copied().unwrap_or_default()
}

impl Modification {
    /// Conjugate parts without modification.
    pub const NONE: Self = Self {
        ring_equidistant_um: 0.0,
        ring_path_shift_um: 0.0,
        ring_profile_shift_um: 0.0,
        ring_rotation_arcsec: 0.0,
        wave_generator_equidistant_um: 0.0,
        slot_wall_um: 0.0,
        carrier_rotation_arcsec: 0.0,
        tooth_radius_um: 0.0,
        ring_tip_relief: None,
    };

    /// Returns the values with their kinds.
    pub(crate) fn parameters(&self) -> Vec<(Modified, f64)> {
        let mut parameters = vec![
            (Modified::RingEquidistant, self.ring_equidistant_um),
            (Modified::RingPathShift, self.ring_path_shift_um),
            (Modified::RingProfileShift, self.ring_profile_shift_um),
            (Modified::RingRotation, self.ring_rotation_arcsec),
            (Modified::WaveGeneratorEquidistant, self.wave_generator_equidistant_um),
            (Modified::SlotWall, self.slot_wall_um),
            (Modified::CarrierRotation, self.carrier_rotation_arcsec),
            (Modified::ToothRadius, self.tooth_radius_um),
        ];
        if let Some(TipRelief { amount_um, start_deg, power }) = self.ring_tip_relief {
            parameters.extend([
                (Modified::TipReliefAmount, amount_um),
                (Modified::TipReliefStart, start_deg),
                (Modified::TipReliefPower, power),
            ]);
        }
        parameters
    }

    /// Returns the largest of the values that shape the ring, each in its unit.
    pub(crate) fn greatest_of_ring(&self) -> (Modified, f64) {
        let shapes_ring = |modified: &Modified| {
            matches!(
                modified,
                Modified::RingPathShift
                    | Modified::RingProfileShift
                    | Modified::RingRotation
                    | Modified::TipReliefAmount
            )
        };
        self.parameters()
            .into_iter()
            .filter(|(modified, _)| shapes_ring(modified))
            .max_by(|(_, one), (_, other)| one.abs().total_cmp(&other.abs()))
            .unwrap_or((Modified::RingEquidistant, self.ring_equidistant_um))
    }

    /// Returns a violation if the tip relief starts beyond the drive's flank. An impossible start position is reported
    /// elsewhere.
    pub fn violation_in(&self, drive: &Drive) -> Option<Violation> {
        let start_deg = self.ring_tip_relief?.start_deg;
        let end_deg = drive.flank_limit().position.from_lobe_deg();
        let parameter = Parameter::Modification(Modified::TipReliefStart);
        if parameter.check(start_deg).is_some() || start_deg < end_deg {
            return None;
        }
        let detail =
            format!("a tip relief from {start_deg:?} deg on relieves nothing: the flank ends at {end_deg:?} deg");
        Some(Violation::new(FieldCode::OutOfRange, parameter, start_deg, end_deg, detail))
    }

    /// True if none of the values opens or closes a gap.
    pub fn is_nil(&self) -> bool {
        self.first().is_none()
    }

    /// Returns the first value that opens or closes a gap.
    pub(crate) fn first(&self) -> Option<Parameter> {
        // Fast path: called for every tooth.
        if *self == Self::NONE {
            return None;
        }
        let opens = |modified: &Modified| !matches!(modified, Modified::TipReliefStart | Modified::TipReliefPower);
        let parameters = self.parameters().into_iter();
        let mut set = parameters.filter(|(modified, value)| *value != 0.0 && opens(modified));
        set.next().map(|(modified, _)| Parameter::Modification(modified))
    }
}

/// Gaps of a drive.
#[derive(Debug, Clone, Copy)]
pub struct Gaps<'a> {
    drive: &'a Drive,
    pub(crate) clearance_mm: PerContact<f64>,
    pub(crate) modification: Modification,
    pub(crate) deviations: Option<&'a Deviations>,
    /// Common displacement of teeth along the flank, for items by the median of their lists: zero if most are zero, the
    /// common value if all are equal. A gap at a slot has the effect of a rotated wall.
    usual: Turned,
    /// The gap at the slot of that displacement.
    usual_carrier_mm: f64,
}

/// Rotation of flanks and walls about the axis away from the flank under load: lost motion only
/// (docs/explanation/theory.md section 4.8).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Turned {
    ring_rad: f64,
    carrier_rad: f64,
}

impl Turned {
    /// Returns the lost motion: `kτ` for a ring, `(Z_G/U) τ` for a carrier.
    pub(crate) fn lost_motion_rad(&self, drive: &Drive) -> f64 {
        drive.flank().teeth_per_wave() * self.ring_rad + drive.teeth_per_wave() * self.carrier_rad
    }

    /// Returns the sum of flank and wall rotation.
    pub(crate) const fn rad(&self) -> f64 {
        self.ring_rad + self.carrier_rad
    }

    /// Adds a gap at the slot of a tooth with this centre radius.
    pub(crate) fn and_aside(self, gap_mm: f64, center_radius_mm: f64) -> Self {
        Self { carrier_rad: self.carrier_rad + gap_mm / center_radius_mm, ..self }
    }
}

impl<'a> Gaps<'a> {
    /// Creates the gaps. Clearances are equal at every tooth, modifications depend on its position, and deviations on
    /// its place.
    pub fn new(
        drive: &'a Drive,
        clearance_um: &PerContact<f64>,
        modification: Modification,
        deviations: Option<&'a Deviations>,
    ) -> Self {
        let clearance_mm = PerContact::of(|contact| MM_PER_UM * clearance_um.get(contact));
        let deviations = deviations.filter(|deviations| !deviations.is_nil());
        let of_items = |list: fn(&Deviations) -> &[f64]| deviations.map_or(0.0, |deviations| middle(list(deviations)));
        let walls_um = modification.slot_wall_um + of_items(|deviations| &deviations.slot_wall_um);
        let thinner_um = modification.tooth_radius_um + of_items(|deviations| &deviations.tooth_radius_um);
        let usual = Turned {
            ring_rad: RAD_PER_ARCSEC * of_items(|deviations| &deviations.ring_space_angle_arcsec),
            carrier_rad: RAD_PER_ARCSEC * of_items(|deviations| &deviations.slot_angle_arcsec),
        };
        let usual_carrier_mm = clearance_mm.carrier + MM_PER_UM * (walls_um + thinner_um);
        Self { drive, clearance_mm, modification, deviations, usual, usual_carrier_mm }
    }

    /// True if there is no gap anywhere.
    pub fn is_nil(&self) -> bool {
        self.are_uniform() && self.clearance_mm.iter().all(|(_, &gap_mm)| gap_mm == 0.0)
    }

    /// True if the gaps are the same for every tooth and position.
    pub(crate) fn are_uniform(&self) -> bool {
        self.deviations.is_none() && self.modification.first().is_none()
    }

    /// Returns the gap at each contact of a tooth, along its normal; negative for interference.
    pub fn at(&self, place: &Place, center: &ToothCenter, flank: &FlankPoint) -> PerContact<f64> {
        let d = center.center_radius_mm;
        let sin = flank.tan_pressure_angle * flank.cos_pressure_angle;
        let (all, own) = (self.turned_alike(), self.turned_at(place));
        let mut gap_mm = self.besides_turns(place, center, flank);
        gap_mm.ring += (all.ring_rad + own.ring_rad) * d * sin;
        gap_mm.carrier += (all.carrier_rad + own.carrier_rad) * d;
        gap_mm
    }

    /// Returns the wave generator's rotation for the lost motion common to all teeth. It is kept separate: rounding
    /// would make teeth differ and decide which ones carry a light load.
    pub(crate) fn lost_motion_rad(&self) -> f64 {
        self.turned_alike().lost_motion_rad(self.drive)
    }

    fn turned_alike(&self) -> Turned {
        let Modification { ring_rotation_arcsec, carrier_rotation_arcsec, .. } = &self.modification;
        Turned {
            ring_rad: RAD_PER_ARCSEC * ring_rotation_arcsec,
            carrier_rad: RAD_PER_ARCSEC * carrier_rotation_arcsec,
        }
    }

    /// Returns the additional rotation at one place.
    pub(crate) fn turned_at(&self, place: &Place) -> Turned {
        self.deviations.map_or_else(Turned::default, |deviations| Turned {
            ring_rad: RAD_PER_ARCSEC * of(&deviations.ring_space_angle_arcsec, place.ring_space),
            carrier_rad: RAD_PER_ARCSEC * of(&deviations.slot_angle_arcsec, place.slot),
        })
    }

    /// Returns the additional rotation at most places, gaps at slots included, for a tooth with this centre radius.
    /// Positions on the flank are relative to it.
    pub(crate) fn usually_turned(&self, center_radius_mm: f64) -> Turned {
        self.usual.and_aside(self.usual_carrier_mm, center_radius_mm)
    }

    /// Returns the gaps except those from flanks and walls rotated about the axis.
    pub(crate) fn besides_turns(&self, place: &Place, center: &ToothCenter, flank: &FlankPoint) -> PerContact<f64> {
        let mut gap_mm = self.clearance_mm;
        self.add_modification(center, flank, &mut gap_mm);
        if let Some(deviations) = self.deviations {
            self.add_deviations(deviations, place, center, flank, &mut gap_mm);
        }
        gap_mm
    }

    fn add_modification(&self, center: &ToothCenter, flank: &FlankPoint, gap_mm: &mut PerContact<f64>) {
        let m = &self.modification;
        let d = center.center_radius_mm;
        let (cos, sin) = (flank.cos_pressure_angle, flank.tan_pressure_angle * flank.cos_pressure_angle);
        // Angle δ between the contact on the ring and the tooth's centre line, seen from the axis.
        let to_ring_mm = flank.distance_mm;
        let (along, across) = (d + to_ring_mm * cos, to_ring_mm * sin);
        let cos_to_profile = (along * cos + across * sin) / along.hypot(across);
        let thinner_mm = MM_PER_UM * m.tooth_radius_um;
        gap_mm.wave_generator += MM_PER_UM * m.wave_generator_equidistant_um + thinner_mm;
        gap_mm.ring += MM_PER_UM
            * (m.ring_equidistant_um
                + m.ring_path_shift_um * cos
                + m.ring_profile_shift_um * cos_to_profile
                + self.tip_relief_um(center))
            + thinner_mm;
        gap_mm.carrier += MM_PER_UM * m.slot_wall_um + thinner_mm;
    }

    fn tip_relief_um(&self, center: &ToothCenter) -> f64 {
        let Some(TipRelief { amount_um, start_deg, power }) = self.modification.ring_tip_relief else { return 0.0 };
        let start_rad = start_deg.to_radians();
        let end_rad = self.drive.flank_limit().position.from_lobe_rad;
        let beyond_rad = center.position.from_lobe_rad - start_rad;
        // A corner is set back as far as the flank's end.
        if beyond_rad > 0.0 { amount_um * (beyond_rad / (end_rad - start_rad)).min(1.0).powf(power) } else { 0.0 }
    }

    fn add_deviations(
        &self,
        deviations: &Deviations,
        &Place { slot, ring_space, lobe }: &Place,
        center: &ToothCenter,
        flank: &FlankPoint,
        gap_mm: &mut PerContact<f64>,
    ) {
        let p = self.drive.parameters();
        let s = self.drive.sense();
        let thinner_mm = MM_PER_UM * of(&deviations.tooth_radius_um, slot);
        // Directions, each in the frame of its own part: the cam's normal, the ring's outward normal, and the force on
        // a slot's wall.
        let normal_rad = center.normal_rad();
        let cam_rad = normal_rad + 2.0 * PI * lobe as f64 / f64::from(self.drive.lobes());
        let beta_rad = flank.tan_pressure_angle.atan();
        let in_space_rad = center.position.from_lobe_rad / self.drive.flank().teeth_per_wave() + beta_rad;
        let ring_rad = 2.0 * PI * ring_space as f64 / p.ring_teeth as f64 - s * in_space_rad;
        let wall_rad = 2.0 * PI * slot as f64 / p.installed as f64 + s * 0.5 * PI;
        let along_mm = |runout: &Runout, direction_rad: f64| {
            MM_PER_UM * runout.amount_um * (direction_rad - runout.angle_deg.to_radians()).cos()
        };
        gap_mm.wave_generator += MM_PER_UM * of(&deviations.wave_generator_lobe_um, lobe)
            - along_mm(&deviations.wave_generator_runout, cam_rad)
            + thinner_mm;
        gap_mm.ring += MM_PER_UM * of(&deviations.ring_space_um, ring_space)
            + along_mm(&deviations.ring_runout, ring_rad)
            + thinner_mm;
        gap_mm.carrier += MM_PER_UM * of(&deviations.slot_wall_um, slot)
            + along_mm(&deviations.carrier_runout, wall_rad)
            + thinner_mm;
    }
}
