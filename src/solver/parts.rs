//! Dimensions of the manufactured parts: free dimensions and clearances (docs/explanation/theory.md section 8).
//!
//! A part's clearance sets its working surface back into the part, along the surface's normal: the ring's flank outward, the cam
//! inward, the slot's walls apart, the tooth's radius down. The gap at a contact is the sum of its two parts' clearances.
//! A modification shapes the same surfaces, and may also set them forward. The teeth's centres are always drawn at
//! their positions without gaps.

use std::f64::consts::PI;

use crate::contact::Part;
use crate::drive::{Draft, Drive, DriveError};
use crate::gaps::{MM_PER_UM, Modification};
use crate::ring::RingTooth;
use crate::tooth_space::ToothSpace;
use crate::violation::{FieldCode as Code, Modified, Parameter, Violation};

/// Dimensions that the mechanics do not determine. A radius that is `None` takes its default.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartsParameters {
    /// Outer radius of the ring; by default [`RIM`] times the largest radius of its tooth spaces.
    pub ring_outer_radius_mm: Option<f64>,
    /// Radii of the carrier.
    pub carrier: CarrierRadii,
    /// Radius of the wave generator's bore; it has none by default.
    pub bore_radius_mm: Option<f64>,
    /// Set-back of the cam along its normal.
    pub wave_generator_clearance_um: f64,
    /// Set-back of a tooth's surface: `r` minus the manufactured radius.
    pub teeth_clearance_um: f64,
    /// Set-back of the ring's flank along its normal.
    pub ring_clearance_um: f64,
    /// Set-back of each wall of a slot.
    pub carrier_clearance_um: f64,
    /// Intended differences from conjugate parts.
    pub modification: Modification,
}

/// Radii between which the carrier has its slots, if given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CarrierRadii {
    /// Radius of the carrier's bore, inside which the cam turns; by default [`CARRIER_PLAY`] outside the cam.
    pub inner_mm: Option<f64>,
    /// Outer radius of the carrier; by default [`CARRIER_PLAY`] inside the ring's tips.
    pub outer_mm: Option<f64>,
}

impl CarrierRadii {
    /// Returns both radii, with defaults for those not given.
    pub(crate) fn of(self, drive: &Drive) -> [f64; 2] {
        let [inner_mm, outer_mm] = default_carrier_mm(drive.cam_outer_radius_mm(), drive.tip_radius_mm());
        [self.inner_mm.unwrap_or(inner_mm), self.outer_mm.unwrap_or(outer_mm)]
    }

    /// Returns violations if no carrier with these radii fits between a cam that is set forward by this amount and a
    /// ring. It checks as far as cam and ring are known, and nothing if no radius is given.
    pub(crate) fn violations(
        self,
        cam_outer_mm: Option<f64>,
        ring: Option<&RingTooth>,
        set_forward_um: f64,
    ) -> Vec<Violation> {
        let mut checks = Checks(Vec::new());
        if self != Self::default() {
            checks.carrier_radii(self, cam_outer_mm, ring, set_forward_um, f64::INFINITY);
        }
        checks.0
    }
}

/// Default outer radius of a ring divided by its root radius. A rim thickness of a fifth of the radius is rigid
/// compared with the contacts.
pub const RIM: f64 = 1.2;

/// Share of the annulus between cam and ring tips that is left free on each side of a carrier with default radii.
pub const CARRIER_PLAY: f64 = 0.1;

/// Smallest wall thickness of a rim or cam, as a share of its radius. With the default chord tolerance, splines are
/// within 0.01 µm of their curves. A solid whose walls they cross is invalid in CAD kernels.
pub const LEAST_WALL: f64 = 1e-6;

impl PartsParameters {
    /// Returns every reason why a part cannot be made: values outside their ranges, and conflicts among the valid
    /// values of part and drive.
    pub fn violations(&self, part: Part, draft: &Draft) -> Vec<Violation> {
        let mut checks = Checks(Vec::new());
        let of_part = self.modification.parameters().into_iter().filter(|(modified, _)| modified.part() == part);
        for (modified, value) in of_part {
            checks.in_range(Parameter::Modification(modified), value);
        }
        match part {
            Part::Ring => self.check_ring(draft, &mut checks),
            Part::Carrier => self.check_carrier(draft, &mut checks),
            Part::Teeth => self.check_teeth(draft, &mut checks),
            Part::WaveGenerator => self.check_wave_generator(draft, &mut checks),
        }
        checks.0
    }

    fn check_ring(&self, draft: &Draft, checks: &mut Checks) {
        let clearance_mm = checks.clearance_mm(Part::Ring, self.ring_clearance_um);
        let outer_mm = checks.radius_mm(Parameter::RingOuterRadius, self.ring_outer_radius_mm, None);
        if let (Some(outer_mm), Some(clearance_mm)) = (outer_mm, clearance_mm)
            && let (Some(a), Some(r)) = (draft.cam_outer_mm, draft.tooth_radius_mm)
        {
            let as_made_mm = self.ring_space(draft).map(|space| space.outermost_radius_mm);
            let root_mm = as_made_mm.unwrap_or(a + (r + (r + clearance_mm)));
            let limit_mm = root_mm * (1.0 + LEAST_WALL);
            checks.require(outer_mm > limit_mm, || Violation::ring_without_rim(outer_mm, limit_mm));
        }
        if let Some(drive) = draft.drive() {
            checks.0.extend(self.modification.violation_in(&drive));
        }
    }

    fn check_wave_generator(&self, draft: &Draft, checks: &mut Checks) {
        let clearance_mm = checks.clearance_mm(Part::WaveGenerator, self.wave_generator_clearance_um);
        let bore_mm = checks.radius_mm(Parameter::BoreRadius, self.bore_radius_mm, None);
        let Some(clearance_mm) = clearance_mm else { return };
        if let Some(greatest_mm) = draft.greatest_set_back_mm {
            let greatest_um = greatest_mm / MM_PER_UM;
            let parameter = Parameter::PartClearance(Part::WaveGenerator);
            checks.below(Code::ClearanceTakesCam, parameter, self.wave_generator_clearance_um, greatest_um, |value, limit| {
                format!(
                    "set back by {value:?} µm the wave generator gets a cusp: choose less than its least radius of curvature, {limit:?} µm"
                )
            });
            if self.wave_generator_clearance_um < greatest_um {
                let (modified, value) =
                    (Modified::WaveGeneratorEquidistant, self.modification.wave_generator_equidistant_um);
                let left_um = greatest_um - self.wave_generator_clearance_um;
                checks.modification(value < left_um, modified, value, left_um);
                // A cam set forward stays inside the path of the teeth's centres, up to which its parallel curves are
                // regular.
                if let Some(r) = draft.tooth_radius_mm {
                    let least_um = -r / MM_PER_UM - self.wave_generator_clearance_um;
                    checks.modification(value > least_um, modified, value, least_um);
                }
            }
        }
        // If nothing of the cam is left, no bore is small enough.
        let set_back_mm = clearance_mm + MM_PER_UM * self.modification.wave_generator_equidistant_um;
        let cam_mm = draft.cam_inner_mm.map(|inner_mm| inner_mm - set_back_mm).filter(|&cam_mm| cam_mm > 0.0);
        if let (Some(bore_mm), Some(cam_mm)) = (bore_mm, cam_mm) {
            let limit_mm = cam_mm * (1.0 - LEAST_WALL);
            checks.below(Code::BoreTakesCam, Parameter::BoreRadius, bore_mm, limit_mm, |value, limit| {
                format!(
                    "a bore of {value:?} mm cuts the wave generator open: choose less than its least radius of {limit:?} mm"
                )
            });
        }
    }

    fn check_carrier(&self, draft: &Draft, checks: &mut Checks) {
        let clearance_mm = checks.clearance_mm(Part::Carrier, self.carrier_clearance_um);
        let set_forward_um = -self.modification.wave_generator_equidistant_um - self.wave_generator_clearance_um;
        let tip_mm = self.ring_space(draft).map_or(f64::INFINITY, |space| space.tip.radius_mm);
        let ring = draft.ring.as_ref();
        let outer_mm = checks.carrier_radii(self.carrier, draft.cam_outer_mm, ring, set_forward_um, tip_mm);
        if let (Some(clearance_mm), Some(half_width_mm)) = (clearance_mm, draft.slot_half_width_mm) {
            let (value, least_um) = (self.modification.slot_wall_um, -(half_width_mm + clearance_mm) / MM_PER_UM);
            checks.modification(value > least_um, Modified::SlotWall, value, least_um);
        }
        let Some(outer_mm) = outer_mm else { return };
        if let (Some(clearance_mm), Some(wall_mm), Some(installed)) =
            (clearance_mm, draft.slot_half_width_mm, draft.installed)
        {
            let clearance_mm = clearance_mm + MM_PER_UM * self.modification.slot_wall_um;
            let half_spacing_rad = PI / installed as f64;
            let limit_mm = (wall_mm + clearance_mm) / half_spacing_rad.sin();
            checks.above(Code::SlotsTakeCarrier, Parameter::CarrierOuterRadius, outer_mm, limit_mm, |value, limit| {
                format!(
                    "up to {limit:?} mm from the axis the slots run into each other, which leaves nothing of a carrier of {value:?} mm outer radius: make the teeth thinner or install fewer"
                )
            });
        }
    }

    /// Returns the manufactured tooth space of the ring, if its values are valid and leave one.
    fn ring_space(&self, draft: &Draft) -> Option<ToothSpace> {
        let of_ring = self.modification.parameters().into_iter().filter(|(modified, _)| modified.part() == Part::Ring);
        let given = of_ring.map(|(modified, value)| (Parameter::Modification(modified), value));
        let mut given = given.chain([(Parameter::PartClearance(Part::Ring), self.ring_clearance_um)]);
        if given.any(|(parameter, value)| parameter.check(value).is_some()) {
            return None;
        }
        ToothSpace::new(&draft.drive()?, MM_PER_UM * self.ring_clearance_um, &self.modification).ok()
    }

    fn check_teeth(&self, draft: &Draft, checks: &mut Checks) {
        let clearance_mm = checks.clearance_mm(Part::Teeth, self.teeth_clearance_um);
        // A tooth is thinnest between its flats.
        if let (Some(_), Some(half_width_mm)) = (clearance_mm, draft.slot_half_width_mm) {
            let half_width_um = half_width_mm / MM_PER_UM;
            let parameter = Parameter::PartClearance(Part::Teeth);
            checks.below(Code::ClearanceTakesTooth, parameter, self.teeth_clearance_um, half_width_um, |value, limit| {
                format!(
                    "a clearance of {value:?} µm leaves nothing of the teeth: choose less than their radius of {limit:?} µm"
                )
            });
            let (value, left_um) = (self.modification.tooth_radius_um, half_width_um - self.teeth_clearance_um);
            checks.modification(value < left_um || left_um <= 0.0, Modified::ToothRadius, value, left_um);
        }
    }
}

/// Returns the carrier's default radii between the largest radius of the cam and the ring's tips.
fn default_carrier_mm(cam_outer_mm: f64, tip_mm: f64) -> [f64; 2] {
    let play_mm = CARRIER_PLAY * (tip_mm - cam_outer_mm);
    [cam_outer_mm + play_mm, tip_mm - play_mm]
}

/// Manufactured part of [`PartsParameters`] that have no violation for the drive.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MadePart {
    Ring {
        space: Box<ToothSpace>,
        outer_radius_mm: f64,
    },
    Carrier(CarrierPart),
    Teeth {
        radius_mm: f64,
        /// Half the width across the slot, less than the radius between flats.
        half_width_mm: f64,
    },
    WaveGenerator {
        set_back_mm: f64,
        bore_radius_mm: Option<f64>,
    },
}

impl MadePart {
    pub(crate) fn new(part: Part, drive: &Drive, parameters: &PartsParameters) -> Result<Self, DriveError> {
        let p = parameters;
        Ok(match part {
            Part::Ring => {
                let space = ToothSpace::new(drive, MM_PER_UM * p.ring_clearance_um, &p.modification)?;
                let outer_radius_mm = p.ring_outer_radius_mm.unwrap_or(RIM * space.outermost_radius_mm);
                Self::Ring { space: Box::new(space), outer_radius_mm }
            }
            Part::Carrier => Self::Carrier(CarrierPart::new(drive, parameters)),
            Part::Teeth => {
                let thinner_mm = MM_PER_UM * (p.teeth_clearance_um + p.modification.tooth_radius_um);
                let radius_mm = drive.parameters().tooth_radius_mm - thinner_mm;
                Self::Teeth { radius_mm, half_width_mm: drive.slot_half_width_mm() - thinner_mm }
            }
            Part::WaveGenerator => {
                let set_back_um = p.wave_generator_clearance_um + p.modification.wave_generator_equidistant_um;
                Self::WaveGenerator { set_back_mm: MM_PER_UM * set_back_um, bore_radius_mm: p.bore_radius_mm }
            }
        })
    }
}

/// Manufactured carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CarrierPart {
    pub(crate) inner_radius_mm: f64,
    pub(crate) outer_radius_mm: f64,
    pub(crate) slot_half_width_mm: f64,
}

impl CarrierPart {
    pub(crate) fn new(drive: &Drive, parameters: &PartsParameters) -> Self {
        let [inner_radius_mm, outer_radius_mm] = parameters.carrier.of(drive);
        Self {
            inner_radius_mm,
            outer_radius_mm,
            slot_half_width_mm: drive.slot_half_width_mm()
                + MM_PER_UM * (parameters.carrier_clearance_um + parameters.modification.slot_wall_um),
        }
    }

    /// Returns the carrier without clearance or play, if its slots leave one.
    pub(crate) fn widest(drive: &Drive) -> Option<Self> {
        let carrier = Self {
            inner_radius_mm: drive.cam_outer_radius_mm(),
            outer_radius_mm: drive.tip_radius_mm(),
            slot_half_width_mm: drive.slot_half_width_mm(),
        };
        let slots_meet_mm = carrier.slot_half_width_mm / (PI / drive.parameters().installed as f64).sin();
        (slots_meet_mm < carrier.outer_radius_mm).then_some(carrier)
    }
}

/// Violations found so far.
struct Checks(Vec<Violation>);

impl Checks {
    fn in_range(&mut self, parameter: Parameter, value: f64) -> Option<f64> {
        parameter.check(value).map(|violation| self.0.push(violation)).is_none().then_some(value)
    }

    fn clearance_mm(&mut self, part: Part, clearance_um: f64) -> Option<f64> {
        Some(MM_PER_UM * self.in_range(Parameter::PartClearance(part), clearance_um)?)
    }

    fn radius_mm(&mut self, parameter: Parameter, given_mm: Option<f64>, default_mm: Option<f64>) -> Option<f64> {
        match given_mm {
            Some(given_mm) => self.in_range(parameter, given_mm),
            None => default_mm,
        }
    }

    /// Checks that the carrier's radii leave a wall between cam and ring tips, both of which may be set forward.
    /// Returns the outer radius if it is possible.
    fn carrier_radii(
        &mut self,
        radii: CarrierRadii,
        cam_outer_mm: Option<f64>,
        ring: Option<&RingTooth>,
        set_forward_um: f64,
        made_tip_mm: f64,
    ) -> Option<f64> {
        let annulus_mm = ring.map(|ring| (ring.flank.locus().cam_outer_radius_mm(), ring.tip_radius_mm));
        let annulus_mm = annulus_mm.filter(|(cam_outer_mm, tip_mm)| cam_outer_mm < tip_mm);
        let default_mm = annulus_mm.map(|(cam_outer_mm, tip_mm)| default_carrier_mm(cam_outer_mm, tip_mm));
        let [inner_mm, outer_mm] = default_mm.map_or([None; 2], |radii_mm| radii_mm.map(Some));
        let inner_mm = self.radius_mm(Parameter::CarrierInnerRadius, radii.inner_mm, inner_mm);
        let outer_mm = self.radius_mm(Parameter::CarrierOuterRadius, radii.outer_mm, outer_mm);
        if let (Some(inner_mm), Some(a)) = (inner_mm, cam_outer_mm) {
            let limit_mm = a + MM_PER_UM * set_forward_um.max(0.0);
            self.above(Code::CarrierMeetsCam, Parameter::CarrierInnerRadius, inner_mm, limit_mm, |value, limit| {
                format!(
                    "a carrier of {value:?} mm inner radius meets the wave generator: choose more than its largest radius of {limit:?} mm"
                )
            });
        }
        if let Some(outer_mm) = outer_mm {
            if let Some((_, tip_mm)) = annulus_mm {
                let limit_mm = tip_mm.min(made_tip_mm);
                self.below(Code::CarrierMeetsRing, Parameter::CarrierOuterRadius, outer_mm, limit_mm, |value, limit| {
                    format!(
                        "a carrier of {value:?} mm outer radius meets the ring: choose less than the ring's tip radius of {limit:?} mm"
                    )
                });
            }
            if let Some(inner_mm) = inner_mm {
                self.above(Code::CarrierWithoutWall, Parameter::CarrierOuterRadius, outer_mm, inner_mm, |value, limit| {
                    format!(
                        "an outer radius of {value:?} mm leaves the carrier no wall: choose more than its inner radius of {limit:?} mm"
                    )
                });
            }
        }
        outer_mm
    }

    /// Checks that a modification leaves some of its part.
    fn modification(&mut self, holds: bool, modified: Modified, value: f64, limit: f64) {
        self.require(holds, || Violation::modification_leaves_nothing(modified, value, Some(limit)));
    }

    fn above(&mut self, code: Code, parameter: Parameter, value: f64, limit: f64, text: impl Fn(f64, f64) -> String) {
        self.require(value > limit, || Violation::new(code, parameter, value, limit, text(value, limit)));
    }

    fn below(&mut self, code: Code, parameter: Parameter, value: f64, limit: f64, text: impl Fn(f64, f64) -> String) {
        self.require(value < limit, || Violation::new(code, parameter, value, limit, text(value, limit)));
    }

    fn require(&mut self, holds: bool, violation: impl FnOnce() -> Violation) {
        if !holds {
            self.0.push(violation());
        }
    }
}
