//! Model error relative to elastic bodies, measured with finite elements (docs/explanation/validation.md). It applies
//! to drives within the measured range.

mod measured;

use measured::MEASURED;

use crate::backing::{Backing, Backings, Estimate};
use crate::contact::{Contact, Material};
use crate::contact_law::{ContactLaw, LawName, WIDE_SHARE};
use crate::drive::{Drive, ToothShape};
use crate::findings::{SOFT_BACKING_SHARE, WIND_UP_SHARE_OF_PERIOD, WIND_UP_TIMES_LOBES_RAD, widest_half_widths_mm};
use crate::gaps::Deviations;
use crate::load_sharing::{Compatibility, LoadCase, LoadParameters};
use crate::mesh::Mesh;
use crate::ring::FlankEnd;
use crate::root::NotConverged;
use crate::sweep::Sweep;

/// Largest number of wave generator lobes in the finite-element comparison.
pub const LOBES_TO: u32 = 2;

/// Largest pressure angle at the ring: case 5.2 has 46.7°.
pub const PRESSURE_ANGLE_TO_DEG: f64 = 47.0;

/// Largest gap at a contact.
pub const GAP_TO_UM: f64 = 10.0;

/// Largest gap divided by the tooth's radius: 10 µm at teeth of 1.5 mm.
pub const GAP_SHARE_TO: f64 = 0.01 / 1.5;

/// Largest wind-up times the number of lobes, in rad, and divided by the period, for natural tips with a gap. Lever arms and
/// tooth positions are unloaded or exact to second order, which was verified up to here. Without gaps all teeth move
/// alike, and it matters less.
const WIND_UP_TO: [f64; 2] = [0.02, 0.05];

/// The same for pointed and bored tips.
const WIND_UP_AT_POINTED_TIPS_TO: [f64; 2] = [0.031, 0.095];

/// Largest half width of a contact over all states, divided by the tooth's radius. All calculated drives are below it.
pub const HALF_WIDTH_SHARE_TO: f64 = 0.035;

/// Largest relative difference between moduli that count as equal. All bodies were of the same steel.
pub const ALIKE: f64 = 0.1;

/// Range of the relative error of the model, `(model - bodies)/bodies`, from the smallest to the largest measured
/// value, rounded outward to whole hundredths.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct ErrorRange {
    /// Smallest error; negative if the model's value is too small.
    pub low: f64,
    /// Largest error.
    pub high: f64,
}

impl ErrorRange {
    const fn percent([low, high]: [i32; 2]) -> Self {
        Self { low: low as f64 / 100.0, high: high as f64 / 100.0 }
    }

    /// Returns the larger absolute value of the two errors.
    pub const fn largest(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }
}

/// Properties that group cases with equal errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// True if any contact has a gap.
    pub has_gaps: bool,
    /// True if the ring's tips are pointed or bored. Its flank then ends where a tooth already has a lever arm: such
    /// teeth bend.
    pub has_pointed_tips: bool,
}

/// Model and properties that group drives with equal errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct MeasuredCase {
    /// The form of compatibility.
    pub compatibility: Compatibility,
    /// The contact law.
    pub law: LawName,
    /// True if the ring's teeth bend.
    pub ring_teeth_bend: bool,
    /// True if the wave generator moves under its teeth.
    pub wave_generator_moves: bool,
    /// True if teeth are pressed against the corners of pointed or bored tips.
    pub corner_contact: bool,
    /// True if any contact has a gap.
    pub has_gaps: bool,
    /// True if the ring's tips are pointed or bored, so that teeth enter under load.
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

/// Measured errors of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct Measured {
    /// The measured case.
    pub case: MeasuredCase,
    /// Error of the largest forces of the contacts.
    pub force: ErrorRange,
    /// Error of the stresses under these forces.
    pub stress: ErrorRange,
    /// Error of the wind-up, with bodies held at the law's depth. The compliance behind them, rim or fingers, is added
    /// to it.
    pub wind_up: ErrorRange,
}

/// Reason why the measured errors do not apply to a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum Beyond {
    /// User-defined stiffnesses, or balls: nothing was measured. Three drives were measured with laws other than
    /// Johnson's, each under one load. At other sizes or loads these laws have other errors: their approach grows with
    /// another power of the force, or does not depend on radius, modulus or backing.
    Law,
    /// Teeth that are not cylinders.
    ToothShape,
    /// More lobes than measured.
    Lobes,
    /// Ring with more teeth than the carrier.
    RingWithMoreTeeth,
    /// Steeper flank than measured.
    PressureAngle,
    /// Teeth that enter under load: finite elements leave out the angles where a tooth stands on the tip. A real tip
    /// takes its load gradually, and the peak is lower. With `corner_contact` those at pointed tips were calculated,
    /// not those at bores.
    EntryUnderLoad,
    /// Parts with different moduli.
    Materials,
    /// Larger gap than measured.
    Gap,
    /// Larger wind-up than measured.
    WindUp,
    /// Parts that are not conjugate by design, or single items with deviations.
    Modification,
    /// Series compliance behind a contact.
    SeriesCompliance,
    /// Part behind a contact whose estimated compliance is too large to neglect, or that has no estimate.
    SoftBacking,
    /// Wider contact than measured.
    HalfWidth,
}

/// Support of the parts that the law takes as held at its depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum HeldCase {
    /// A rim in a housing, fingers that are not slender.
    Housed,
    /// Slender fingers that are not held at one end alone.
    SlenderFingers,
    /// Fingers held at one end.
    FingersAtOneEnd,
    /// A rim with no housing.
    FreeRim,
}

/// Wind-up error for parts that are not held at the law's depth, unless they are given as series compliance.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct Held {
    /// Support of the parts, from `parts`.
    pub case: HeldCase,
    /// Error found in earlier calculations of elastic bodies held so; left out if there were none.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub wind_up: Option<ErrorRange>,
    /// Estimated error from this design's own parts, relative to the wind-up that the load adds to that of the gaps.
    pub estimated_wind_up: f64,
}

impl Held {
    /// Returns the error for parts that have estimates.
    fn of(estimates: &[Estimate]) -> Option<Self> {
        let shared = || estimates.iter().filter_map(|estimate| Some((estimate, estimate.share?)));
        shared().next()?;
        let has = |wanted: Backing| shared().any(|(estimate, _)| estimate.backing == wanted);
        let case = if has(Backing::FreeRim) {
            HeldCase::FreeRim
        } else if has(Backing::FingerAtOneEnd) {
            HeldCase::FingersAtOneEnd
        } else if shared().any(|(estimate, share)| estimate.contact == Contact::Carrier && share > SOFT_BACKING_SHARE) {
            HeldCase::SlenderFingers
        } else {
            HeldCase::Housed
        };
        let wind_up = match case {
            HeldCase::Housed => Some(ErrorRange::percent([-25, -20])),
            HeldCase::FingersAtOneEnd | HeldCase::FreeRim => Some(ErrorRange::percent([-75, -50])),
            HeldCase::SlenderFingers => None,
        };
        // If all of them are neglected, the wind-up is that of the contacts alone.
        let sum: f64 = shared().map(|(_, share)| share).sum();
        Some(Self { case, wind_up, estimated_wind_up: -sum / (1.0 + sum) })
    }
}

/// Range of the calculated drives: steel cylinders in a ring with fewer teeth.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct MeasuredRange {
    /// Largest number of lobes.
    pub lobes: u32,
    /// Largest pressure angle of the ring's flank.
    pub pressure_angle_deg: f64,
    /// Largest gap of a contact, for teeth of this size.
    pub gap_um: f64,
    /// Largest wind-up for this number of lobes and teeth, this tip shape, and gaps or none.
    pub wind_up_deg: f64,
    /// Largest half width of a contact divided by the tooth's radius. It is less if the law's own limit is lower.
    pub half_width_over_tooth_radius: f64,
}

impl MeasuredRange {
    fn of(drive: &Drive, law: &ContactLaw, case: Case) -> Self {
        let tooth_radius_mm = drive.parameters().tooth_radius_mm;
        let [times_lobes_rad, share_of_period] = match (case.has_gaps, case.has_pointed_tips) {
            // The wind-up at which the finding is reported.
            (false, _) => [WIND_UP_TIMES_LOBES_RAD, WIND_UP_SHARE_OF_PERIOD],
            (true, false) => WIND_UP_TO,
            (true, true) => WIND_UP_AT_POINTED_TIPS_TO,
        };
        let by_lobes_deg = (times_lobes_rad / f64::from(drive.lobes())).to_degrees();
        // The law's own limit may be lower.
        let of_law = law.reference_length_mm(tooth_radius_mm).map_or(f64::INFINITY, |length_mm| {
            length_mm
                .iter()
                .fold(f64::INFINITY, |least, (_, &length_mm)| least.min(WIDE_SHARE * length_mm / tooth_radius_mm))
        });
        Self {
            lobes: LOBES_TO,
            pressure_angle_deg: PRESSURE_ANGLE_TO_DEG,
            gap_um: GAP_TO_UM.min(1e3 * GAP_SHARE_TO * tooth_radius_mm),
            wind_up_deg: by_lobes_deg.min(share_of_period * Mesh::new(drive).period_deg()),
            half_width_over_tooth_radius: HALF_WIDTH_SHARE_TO.min(of_law),
        }
    }
}

/// Expected error of the model, without numerical errors: its difference to elastic bodies, calculated by finite
/// elements, in drives of the same case (docs/explanation/validation.md).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
#[non_exhaustive]
pub struct ModelError {
    /// Errors of the case; left out if the law was not measured.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub measured: Option<Measured>,
    /// Additional wind-up error from the compliance behind the contacts, for cylinders under `virtual_work` with
    /// `johnson`.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub held: Option<Held>,
    /// Range of the calculated drives.
    pub range: MeasuredRange,
    /// True if this design is in the range.
    pub is_within: bool,
    /// Reasons why it is not.
    pub beyond: Vec<Beyond>,
}

/// Makes a row of the table. The flags: ring teeth bend, wave generator moves, corner contact; pointed tips, gaps. The
/// errors of force, stress and wind-up are in per cent.
const fn row(
    compatibility: Compatibility,
    law: LawName,
    refinements: [bool; 3],
    [has_pointed_tips, has_gaps]: [bool; 2],
    [force, stress, wind_up]: [[i32; 2]; 3],
) -> Measured {
    let case = MeasuredCase::new(compatibility, law, refinements, Case { has_gaps, has_pointed_tips });
    let [force, stress, wind_up] =
        [ErrorRange::percent(force), ErrorRange::percent(stress), ErrorRange::percent(wind_up)];
    Measured { case, force, stress, wind_up }
}

/// Returns the measured errors of a model in such a case, or none if finite elements were not calculated for it.
pub fn measured(load: &LoadParameters, case: Case) -> Option<Measured> {
    let LoadParameters { compatibility, law, ring_teeth_bend, wave_generator_moves, corner_contact, .. } = *load;
    let refinements = [ring_teeth_bend, wave_generator_moves, corner_contact];
    let case = MeasuredCase::new(compatibility, law.name(), refinements, case);
    // Teeth touch corners at pointed tips only.
    let wanted = MeasuredCase { corner_contact: corner_contact && case.has_pointed_tips, ..case };
    MEASURED.iter().find(|row| row.case == wanted).map(|row| Measured { case, ..*row })
}

/// True if the ring's tips are pointed or bored.
pub fn has_pointed_tips(drive: &Drive) -> bool {
    drive.flank_limit().end != FlankEnd::RegularTip
}

/// Returns the case of a drive under a load.
pub fn case_of(drive: &Drive, load: &LoadCase, deviations: &Deviations) -> Case {
    Case { has_gaps: load.has_gaps() || !deviations.is_nil(), has_pointed_tips: has_pointed_tips(drive) }
}

/// Returns the expected model error for this drive, load and sweep, with these parts and, if known, the shares of
/// their estimates.
///
/// ```
/// use toothwave_solver::sweep::{Points, sweep};
/// use toothwave_solver::{Deviations, model_error};
/// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
/// let load = LoadCase::new(&LoadParameters::default()).unwrap();
///
/// let sweep = sweep(&drive, &load, Points::samples(100).unwrap(), &Never).unwrap();
/// let error = model_error::of(&drive, &load, &Deviations::default(), &sweep, None).unwrap();
/// assert!(error.measured.is_some());
/// ```
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn of(
    drive: &Drive,
    load: &LoadCase,
    deviations: &Deviations,
    sweep: &Sweep,
    parts: Option<(&Backings, Option<&[Estimate]>)>,
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
    // Overlapping slots leave no finger to estimate.
    let has_estimate = |estimates: &[Estimate], contact: Contact| {
        *p.series_compliance_mm_per_n.get(contact) > 0.0
            || estimates.iter().any(|estimate| estimate.contact == contact && estimate.share.is_some())
    };
    let is_soft = |estimates: &[Estimate]| {
        estimates.iter().any(|estimate| estimate.share > Some(SOFT_BACKING_SHARE))
            || ![Contact::Ring, Contact::Carrier].into_iter().all(|contact| has_estimate(estimates, contact))
    };
    let shared = parts.and_then(|(_, shared)| shared);
    // For line contacts the widest is not the one with the largest stress. Flats and the ellipses of balls are known
    // only at their peaks.
    let at_peaks = sweep.peaks.iter().map(|(_, peaks)| peaks.half_width_mm);
    let along = parts.map_or(Ok(1.0), |(backings, _)| backings.load_peak_over_mean(drive, p))?;
    let of_lines = widest_half_widths_mm(drive, &sweep.states, along).map(|(_, half_width_mm)| half_width_mm);
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
        (shared.is_some_and(is_soft), Beyond::SoftBacking),
        (widest_mm > range.half_width_over_tooth_radius * tooth_radius_mm, Beyond::HalfWidth),
    ];
    let beyond: Vec<_> = reasons.into_iter().filter(|&(is_beyond, _)| is_beyond).map(|(_, reason)| reason).collect();
    Ok(ModelError { measured, held: shared.and_then(Held::of), range, is_within: beyond.is_empty(), beyond })
}
