//! The parts as they are made: what the mechanics leave free, and clearances (docs/theory.md section 8).
//!
//! A part's clearance sets its working surface back into the part, along the surface's normal: the ring's flank outward, the cam
//! inward, the slot's walls apart, the tooth's radius down. The gap at a contact is the sum of its two parts' clearances.
//! Whatever the clearances, the teeth's centres are drawn where they stand without any.

use std::f64::consts::PI;

use crate::contact::Part;
use crate::drive::{Drive, DriveError};
use crate::ring::RingTooth;
use crate::violation::{Misfit, Parameter, Violation};

/// What the mechanics leave free. A radius that is `None` takes its default.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartsParameters {
    /// Outer radius of the ring; by default [`RIM`] times its root radius.
    pub ring_outer_radius_mm: Option<f64>,
    /// Radius of the carrier's bore, inside which the cam turns; by default [`CARRIER_PLAY`] outside `a`.
    pub carrier_inner_radius_mm: Option<f64>,
    /// Outer radius of the carrier; by default [`CARRIER_PLAY`] inside the ring's tips.
    pub carrier_outer_radius_mm: Option<f64>,
    /// Radius of the wave generator's bore; it has none by default.
    pub bore_radius_mm: Option<f64>,
    /// How far the cam is set back along its normal.
    pub wave_generator_clearance_um: f64,
    /// How much smaller than `r` the teeth's radius is.
    pub teeth_clearance_um: f64,
    /// How far the ring's flank is set back along its normal.
    pub ring_clearance_um: f64,
    /// How far each wall of a slot is set back.
    pub carrier_clearance_um: f64,
}

/// Outer over root radius of a ring that none is given for: a rim as thick as a fifth of the radius is rigid beside what it holds.
pub const RIM: f64 = 1.2;

/// Share of the annulus between cam and ring tips that is left free on either side of a carrier that no radius is given for.
pub const CARRIER_PLAY: f64 = 0.1;

const MM_PER_UM: f64 = 1e-3;

impl PartsParameters {
    /// The values of a part that are out of their ranges.
    pub fn violations(&self, part: Part) -> Vec<Violation> {
        let (clearance_um, radii) = match part {
            Part::WaveGenerator => {
                (self.wave_generator_clearance_um, vec![(Parameter::BoreRadius, self.bore_radius_mm)])
            }
            Part::Teeth => (self.teeth_clearance_um, vec![]),
            Part::Ring => (self.ring_clearance_um, vec![(Parameter::RingOuterRadius, self.ring_outer_radius_mm)]),
            Part::Carrier => (
                self.carrier_clearance_um,
                vec![
                    (Parameter::CarrierInnerRadius, self.carrier_inner_radius_mm),
                    (Parameter::CarrierOuterRadius, self.carrier_outer_radius_mm),
                ],
            ),
        };
        let radii = radii.into_iter().filter_map(|(parameter, radius_mm)| parameter.check(radius_mm?));
        Parameter::PartClearance(part).check(clearance_um).into_iter().chain(radii).collect()
    }
}

/// The ring as it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingPart {
    pub(crate) tooth: RingTooth,
    pub(crate) outer_radius_mm: f64,
}

/// The wave generator as it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveGeneratorPart {
    pub(crate) clearance_mm: f64,
    pub(crate) bore_radius_mm: Option<f64>,
}

/// The carrier as it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarrierPart {
    pub(crate) inner_radius_mm: f64,
    pub(crate) outer_radius_mm: f64,
    pub(crate) slot_half_width_mm: f64,
}

/// A tooth as it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothPart {
    pub(crate) radius_mm: f64,
}

impl RingPart {
    /// Checks the ring's parameters.
    ///
    /// # Errors
    /// Every reason why it cannot be made.
    pub fn new(drive: &Drive, parameters: &PartsParameters) -> Result<Self, DriveError> {
        let mut checks = Checks::new(parameters, Part::Ring)?;
        let clearance_mm = MM_PER_UM * parameters.ring_clearance_um;
        let flank = drive.flank().set_back_by(clearance_mm);
        let root_radius_mm = flank.root_radius_mm();
        let outer_radius_mm = parameters.ring_outer_radius_mm.unwrap_or(RIM * root_radius_mm);
        checks.above(Misfit::RingWithoutRim, outer_radius_mm, root_radius_mm);
        checks.finish()?;
        let tooth = RingTooth::new(flank, drive.parameters().tip_radius_mm)?;
        Ok(Self { tooth, outer_radius_mm })
    }
}

impl WaveGeneratorPart {
    /// Checks the wave generator's parameters.
    ///
    /// # Errors
    /// Every reason why it cannot be made.
    pub fn new(drive: &Drive, parameters: &PartsParameters) -> Result<Self, DriveError> {
        let mut checks = Checks::new(parameters, Part::WaveGenerator)?;
        let clearance_mm = MM_PER_UM * parameters.wave_generator_clearance_um;
        let (a, b) = (drive.parameters().semi_major_mm, drive.parameters().semi_minor_mm);
        // Set back by its least radius of curvature, at the major axis, the cam would get a cusp there.
        checks.below(Misfit::ClearanceTakesCam, parameters.wave_generator_clearance_um, b * (b / a) / MM_PER_UM);
        if let Some(bore_radius_mm) = parameters.bore_radius_mm {
            checks.below(Misfit::BoreTakesCam, bore_radius_mm, b - clearance_mm);
        }
        checks.finish()?;
        Ok(Self { clearance_mm, bore_radius_mm: parameters.bore_radius_mm })
    }
}

impl CarrierPart {
    /// Checks the carrier's parameters.
    ///
    /// # Errors
    /// Every reason why it cannot be made.
    pub fn new(drive: &Drive, parameters: &PartsParameters) -> Result<Self, DriveError> {
        let p = drive.parameters();
        let mut checks = Checks::new(parameters, Part::Carrier)?;
        let clearance_mm = MM_PER_UM * parameters.carrier_clearance_um;
        let tip_radius_mm = drive.tip_radius_mm();
        let play_mm = CARRIER_PLAY * (tip_radius_mm - p.semi_major_mm);
        let inner_radius_mm = parameters.carrier_inner_radius_mm.unwrap_or(p.semi_major_mm + play_mm);
        let outer_radius_mm = parameters.carrier_outer_radius_mm.unwrap_or(tip_radius_mm - play_mm);
        checks.above(Misfit::CarrierMeetsCam, inner_radius_mm, p.semi_major_mm);
        checks.below(Misfit::CarrierMeetsRing, outer_radius_mm, tip_radius_mm);
        checks.above(Misfit::CarrierWithoutWall, outer_radius_mm, inner_radius_mm);
        let slot_half_width_mm = p.tooth_radius_mm + clearance_mm;
        let slots_meet_mm = slot_half_width_mm / (PI / p.installed as f64).sin();
        checks.above(Misfit::SlotsTakeCarrier, outer_radius_mm, slots_meet_mm);
        checks.finish()?;
        Ok(Self { inner_radius_mm, outer_radius_mm, slot_half_width_mm })
    }
}

impl ToothPart {
    /// Checks the tooth's clearance.
    ///
    /// # Errors
    /// Why it cannot be made.
    pub fn new(drive: &Drive, parameters: &PartsParameters) -> Result<Self, DriveError> {
        let radius_mm = drive.parameters().tooth_radius_mm;
        let mut checks = Checks::new(parameters, Part::Teeth)?;
        let clearance_mm = MM_PER_UM * parameters.teeth_clearance_um;
        checks.below(Misfit::ClearanceTakesTooth, parameters.teeth_clearance_um, radius_mm / MM_PER_UM);
        checks.finish()?;
        Ok(Self { radius_mm: radius_mm - clearance_mm })
    }
}

/// What does not fit, as it is found, once the values themselves are in their ranges.
#[derive(Debug)]
struct Checks(Vec<Violation>);

impl Checks {
    fn new(parameters: &PartsParameters, part: Part) -> Result<Self, DriveError> {
        let mut checks = Self(parameters.violations(part));
        checks.finish()?;
        Ok(checks)
    }

    fn above(&mut self, misfit: Misfit, value: f64, limit: f64) {
        self.require(value > limit, misfit, value, limit);
    }

    fn below(&mut self, misfit: Misfit, value: f64, limit: f64) {
        self.require(value < limit, misfit, value, limit);
    }

    fn require(&mut self, holds: bool, misfit: Misfit, value: f64, limit: f64) {
        if !holds {
            self.0.push(Violation::PartDoesNotFit { misfit, value, limit });
        }
    }

    fn finish(&mut self) -> Result<(), DriveError> {
        if self.0.is_empty() { Ok(()) } else { Err(DriveError::Impossible(std::mem::take(&mut self.0))) }
    }
}
