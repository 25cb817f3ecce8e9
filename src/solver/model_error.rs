//! How far the model is off elastic bodies: what was measured against finite elements (docs/explanation/validation.md), and whether a drive is one of
//! those that this speaks for.

mod measured;

use measured::MEASURED;

use crate::backing::{Backing, Fingers, Rim, Shares, Support};
use crate::contact::{Contact, ContactLaw, LawName, Material, PerContact};
use crate::drive::{Drive, ToothShape};
use crate::findings::{SOFT_BACKING_SHARE, WIND_UP_SHARE_OF_PERIOD, WIND_UP_TIMES_LOBES_RAD, widest_half_widths_mm};
use crate::gaps::Deviations;
use crate::load_sharing::{Compatibility, LoadCase, LoadParameters};
use crate::mesh::Mesh;
use crate::ring::FlankEnd;
use crate::root::NotConverged;
use crate::sweep::Sweep;
use crate::tooth::line::{WIDE_SHARE, least_length_mm};

/// Lobes of the wave generators that were held against finite elements, at most.
pub const LOBES_TO: u32 = 2;

/// Pressure angle at the ring, at most: case 5.2 has 46.7°.
pub const PRESSURE_ANGLE_TO_DEG: f64 = 47.0;

/// Gap at a contact, at most.
pub const GAP_TO_UM: f64 = 10.0;

/// The same over the tooth's radius, at most: 10 µm were at teeth of 1.5 mm.
pub const GAP_SHARE_TO: f64 = 0.01 / 1.5;

/// The largest wind-up times the number of lobes, and the same over the period, of natural tips with a gap: the wave generator's arms and the teeth's places are
/// those of the positions without load, or follow them to second order, and so far both were seen to hold. Without gaps all teeth move on alike, and it matters less.
const WIND_UP_TO: WindUpTo = WindUpTo { times_lobes_rad: 0.02, share_of_period: 0.05 };

/// The same of pointed and bored ones.
const WIND_UP_AT_POINTED_TIPS_TO: WindUpTo = WindUpTo { times_lobes_rad: 0.031, share_of_period: 0.095 };

/// Where their wind-up is told to be beyond the model.
const WITHOUT_GAPS_TO: WindUpTo =
    WindUpTo { times_lobes_rad: WIND_UP_TIMES_LOBES_RAD, share_of_period: WIND_UP_SHARE_OF_PERIOD };

#[derive(Debug, Clone, Copy)]
struct WindUpTo {
    times_lobes_rad: f64,
    share_of_period: f64,
}

/// Half the width of the widest contact of all states over the tooth's radius, at most: all drives that were calculated stay below.
pub const HALF_WIDTH_SHARE_TO: f64 = 0.035;

/// How far the moduli of parts may differ to be alike: all bodies were of one steel.
pub const ALIKE: f64 = 0.1;

/// A relative error of the model, `(model - bodies)/bodies`, from the least to the largest that was measured, rounded outward to whole
/// hundredths.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct ErrorRange {
    /// The least; below zero the model says too little.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl ErrorRange {
    const fn percent(low: i32, high: i32) -> Self {
        Self { low: low as f64 / 100.0, high: high as f64 / 100.0 }
    }

    /// Whether an error lies within.
    pub fn contains(&self, error: f64) -> bool {
        (self.low..=self.high).contains(&error)
    }

    /// The larger of the two errors, without its sign.
    pub const fn largest(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }
}

/// What makes cases err alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// Whether any contact has a gap.
    pub has_gaps: bool,
    /// Whether the ring's tips are pointed or bored, so that its flank ends where a tooth has a lever arm already: such teeth bend.
    pub has_pointed_tips: bool,
}

/// A model, and what makes drives err alike under it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct MeasuredCase {
    /// The form of compatibility.
    pub compatibility: Compatibility,
    /// The contact law.
    pub law: LawName,
    /// Whether the ring's teeth bend.
    pub ring_teeth_bend: bool,
    /// Whether the wave generator moves on under its teeth.
    pub wave_generator_moves: bool,
    /// Whether teeth are pressed against the corners of pointed or bored tips.
    pub corner_contact: bool,
    /// Whether any contact has a gap.
    pub has_gaps: bool,
    /// Whether the ring's tips are pointed or bored, so that teeth enter under load.
    pub has_pointed_tips: bool,
}

impl MeasuredCase {
    const fn new(
        compatibility: Compatibility,
        law: LawName,
        [ring_teeth_bend, wave_generator_moves, corner_contact]: [bool; 3],
        Case { has_gaps, has_pointed_tips }: Case,
    ) -> Self {
        Self { compatibility, law, ring_teeth_bend, wave_generator_moves, corner_contact, has_gaps, has_pointed_tips }
    }
}

/// What was measured of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct Measured {
    /// Which case.
    pub case: MeasuredCase,
    /// Of the largest forces of the contacts.
    pub force: ErrorRange,
    /// Of the stresses under them.
    pub stress: ErrorRange,
    /// Of the wind-up, bodies being held at the law's depth; what gives way behind them, rim or fingers, comes on top.
    pub wind_up: ErrorRange,
}

/// Why a drive is none of those that the measured errors speak for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum Beyond {
    /// Stiffnesses of the designer's own, or balls: nothing was measured. Of other laws than Johnson's three drives were, each under one load, and with any
    /// other size or load they err otherwise: their approach grows with another power of the force, or knows no radius, modulus or backing.
    Law,
    /// Teeth that are no cylinders.
    ToothShape,
    /// More lobes.
    Lobes,
    /// A ring with more teeth than the carrier.
    RingWithMoreTeeth,
    /// A steeper flank.
    PressureAngle,
    /// Teeth that enter under load: finite elements leave out the angles where one stands on the tip. A real tip takes its load little by little, and the
    /// peak comes out lower. With `corner_contact` those at pointed tips were calculated, not those at bores.
    EntryUnderLoad,
    /// Parts of unlike moduli.
    Materials,
    /// A larger gap.
    Gap,
    /// A larger wind-up.
    WindUp,
    /// Parts made otherwise than conjugate, or single items of them that deviate.
    Modification,
    /// Something that gives way behind a contact.
    SeriesCompliance,
    /// A part behind a contact that gives way by more than can be left out, by its estimate, or that has none.
    SoftBacking,
    /// A wider contact.
    HalfWidth,
}

/// How parts are held that the law takes as held at its depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum HeldCase {
    /// A rim in a housing, fingers at both ends; also where `parts` says nothing.
    Housed,
    /// Fingers that are slender though held at both ends.
    SlenderFingers,
    /// Fingers held at one end.
    FingersAtOneEnd,
    /// A rim with nothing around it.
    FreeRim,
}

/// How far the wind-up is off for parts that are not held at the law's depth, unless they are given as series compliance.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct Held {
    /// How they are held, after `parts`.
    pub case: HeldCase,
    /// What earlier calculations of elastic bodies held so found; left out where there were none.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub wind_up: Option<ErrorRange>,
    /// What the estimates of this design's own parts come to, of that part of the wind-up which the load adds to what gaps leave.
    pub estimated_wind_up: f64,
}

impl Held {
    /// Of parts that have estimates.
    fn of(support: &Support, shares: &Shares) -> Option<Self> {
        if shares.shares.is_empty() {
            return None;
        }
        let has = |wanted: Backing| shares.shares.iter().find(|(estimate, _)| estimate.backing == wanted);
        let is_soft = |&&(_, share): &&(_, f64)| share > SOFT_BACKING_SHARE;
        let case = if support.rim == Some(Rim::Free) && has(Backing::FreeRim).is_some() {
            HeldCase::FreeRim
        } else if support.fingers == Some(Fingers::HeldAtOneEnd) && has(Backing::FingerAtOneEnd).is_some() {
            HeldCase::FingersAtOneEnd
        } else if has(Backing::FingerAtBothEnds).filter(is_soft).is_some() {
            HeldCase::SlenderFingers
        } else {
            HeldCase::Housed
        };
        let wind_up = match case {
            HeldCase::Housed => Some(ErrorRange::percent(-25, -20)),
            HeldCase::FingersAtOneEnd | HeldCase::FreeRim => Some(ErrorRange::percent(-75, -50)),
            HeldCase::SlenderFingers => None,
        };
        Some(Self { case, wind_up, estimated_wind_up: shares.wind_up_error() })
    }
}

/// How far the drives went that were calculated: cylinders of steel in a ring with fewer teeth.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct MeasuredRange {
    /// Most lobes.
    pub lobes: u32,
    /// Largest pressure angle of the ring's flank.
    pub pressure_angle_deg: f64,
    /// Largest gap of a contact, for teeth of this size.
    pub gap_um: f64,
    /// Largest wind-up, for so many lobes and teeth, such tips, and gaps or none.
    pub wind_up_deg: f64,
    /// Half of the largest width of a contact, over the tooth's radius; less where the law's own limit comes before.
    pub half_width_over_tooth_radius: f64,
}

impl MeasuredRange {
    fn of(drive: &Drive, law: &ContactLaw, case: Case) -> Self {
        let tooth_radius_mm = drive.parameters().tooth_radius_mm;
        let to = match (case.has_gaps, case.has_pointed_tips) {
            (false, _) => WITHOUT_GAPS_TO,
            (true, false) => WIND_UP_TO,
            (true, true) => WIND_UP_AT_POINTED_TIPS_TO,
        };
        let by_lobes_deg = (to.times_lobes_rad / f64::from(drive.lobes())).to_degrees();
        // Where the law itself is told to end before.
        let of_law = match law {
            ContactLaw::Johnson { depth_mm } => PerContact::of(|contact| {
                WIDE_SHARE * least_length_mm(depth_mm, contact, tooth_radius_mm) / tooth_radius_mm
            }),
            _ => PerContact::of(|_| f64::INFINITY),
        };
        Self {
            lobes: LOBES_TO,
            pressure_angle_deg: PRESSURE_ANGLE_TO_DEG,
            gap_um: GAP_TO_UM.min(1e3 * GAP_SHARE_TO * tooth_radius_mm),
            wind_up_deg: by_lobes_deg.min(to.share_of_period * Mesh::new(drive).period_deg()),
            half_width_over_tooth_radius: of_law
                .iter()
                .fold(HALF_WIDTH_SHARE_TO, |least, (_, &share)| least.min(share)),
        }
    }
}

/// The expected error of the model, numerical ones apart: how far it was off elastic bodies, calculated by finite elements, in drives
/// of the same case (docs/explanation/validation.md).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct ModelError {
    /// The errors of the case; left out where nothing was measured of the law.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub measured: Option<Measured>,
    /// What comes on top of the wind-up's error for what gives way behind the contacts, of cylinders under `virtual_work` with `johnson`.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"), schema(nullable = false))]
    pub held: Option<Held>,
    /// The range of the drives that were calculated.
    pub range: MeasuredRange,
    /// Whether this design lies within.
    pub is_within: bool,
    /// Why it does not.
    pub beyond: Vec<Beyond>,
}

/// Errors that were found of a case, in per cent.
struct Row {
    case: MeasuredCase,
    /// Of force, stress and wind-up.
    percent: [[i32; 2]; 3],
}

/// Its flags: the ring's teeth bend, the wave generator moves, corners are met; tips are pointed, contacts have gaps.
const fn row(
    compatibility: Compatibility,
    law: LawName,
    refinements: [bool; 3],
    [has_pointed_tips, has_gaps]: [bool; 2],
    percent: [[i32; 2]; 3],
) -> Row {
    let case = MeasuredCase::new(compatibility, law, refinements, Case { has_gaps, has_pointed_tips });
    Row { case, percent }
}

/// What was measured of a model in such a case; nothing of a model that was not held against finite elements.
pub fn measured(load: &LoadParameters, case: Case) -> Option<Measured> {
    let LoadParameters { compatibility, law, ring_teeth_bend, wave_generator_moves, corner_contact, .. } = *load;
    let refinements = [ring_teeth_bend, wave_generator_moves, corner_contact];
    let case = MeasuredCase::new(compatibility, law.name(), refinements, case);
    // Teeth meet corners at pointed tips alone.
    let wanted = MeasuredCase { corner_contact: corner_contact && case.has_pointed_tips, ..case };
    let [force, stress, wind_up] =
        MEASURED.iter().find(|row| row.case == wanted)?.percent.map(|[low, high]| ErrorRange::percent(low, high));
    Some(Measured { case, force, stress, wind_up })
}

/// Whether the ring's tips are pointed or bored.
pub fn has_pointed_tips(drive: &Drive) -> bool {
    drive.flank_limit().end != FlankEnd::RegularTip
}

/// The case of a drive under a load.
pub fn case_of(drive: &Drive, load: &LoadCase, deviations: &Deviations) -> Case {
    Case { has_gaps: load.has_gaps() || !deviations.is_nil(), has_pointed_tips: has_pointed_tips(drive) }
}

/// What is expected of the model for this drive, load and sweep, with parts that are held so and add these shares.
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn of(
    drive: &Drive,
    load: &LoadCase,
    deviations: &Deviations,
    sweep: &Sweep,
    parts: Option<(&Support, &Shares)>,
) -> Result<ModelError, NotConverged> {
    let p = load.parameters();
    let case = case_of(drive, load, deviations);
    let measured = measured(p, case);
    let own = p.materials.teeth;
    let is_alike =
        |material: &Material| (material.compliance_per_mpa() / own.compliance_per_mpa() - 1.0).abs() <= ALIKE;
    let mates = [&p.materials.wave_generator, &p.materials.ring, &p.materials.carrier];
    let tooth_radius_mm = drive.parameters().tooth_radius_mm;
    let range = MeasuredRange::of(drive, &p.law, case);
    // Slots that run into each other leave no finger that could be estimated.
    let has_estimate = |shares: &Shares, contact: Contact| {
        *p.series_compliance_mm_per_n.get(contact) > 0.0
            || shares.shares.iter().any(|(estimate, _)| estimate.backing.contact() == contact)
    };
    let is_soft = |shares: &Shares| {
        shares.shares.iter().any(|(_, share)| *share > SOFT_BACKING_SHARE)
            || ![Contact::Ring, Contact::Carrier].into_iter().all(|contact| has_estimate(shares, contact))
    };
    // Of lines the widest is not the one with the largest stress; flats and the ellipses of balls are known at their peaks alone.
    let at_peaks = sweep.peaks.iter().map(|(_, peaks)| peaks.half_width_mm);
    let of_lines = widest_half_widths_mm(drive, &sweep.states).map(|(_, half_width_mm)| half_width_mm);
    let widest_mm = at_peaks.chain(of_lines).fold(0.0, f64::max);
    let wind_up_deg = sweep.input_angles.wind_up_deg.iter().copied().fold(0.0, f64::max);
    let is_at_a_point = p.corner_contact && drive.flank_limit().end == FlankEnd::Undercut;
    let reasons = [
        (measured.is_none() || !matches!(p.law, ContactLaw::Johnson { .. }), Beyond::Law),
        (!matches!(drive.parameters().tooth, ToothShape::Cylinder { .. }), Beyond::ToothShape),
        (drive.lobes() > LOBES_TO, Beyond::Lobes),
        (drive.sense() < 0.0, Beyond::RingWithMoreTeeth),
        (drive.largest_pressure_angle_deg()? > PRESSURE_ANGLE_TO_DEG, Beyond::PressureAngle),
        (has_pointed_tips(drive) && !is_at_a_point, Beyond::EntryUnderLoad),
        (!mates.into_iter().all(is_alike), Beyond::Materials),
        (p.clearance_um.iter().any(|(_, &gap_um)| gap_um > range.gap_um), Beyond::Gap),
        (wind_up_deg > range.wind_up_deg, Beyond::WindUp),
        (p.modification.first().is_some() || !deviations.is_nil(), Beyond::Modification),
        (p.series_compliance_mm_per_n.iter().any(|(_, &compliance)| compliance > 0.0), Beyond::SeriesCompliance),
        (parts.is_some_and(|(_, shares)| is_soft(shares)), Beyond::SoftBacking),
        (widest_mm > range.half_width_over_tooth_radius * tooth_radius_mm, Beyond::HalfWidth),
    ];
    let beyond: Vec<_> = reasons.into_iter().filter(|&(is_beyond, _)| is_beyond).map(|(_, reason)| reason).collect();
    let held = parts.and_then(|(support, shares)| Held::of(support, shares));
    Ok(ModelError { measured, held, range, is_within: beyond.is_empty(), beyond })
}
