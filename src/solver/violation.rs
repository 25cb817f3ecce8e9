//! Reasons why a drive, a load or a request is impossible.

use crate::contact::{Contact, Part};

/// Parameter to which a violation can refer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// `a`: semi-major axis, mm.
    SemiMajor,
    /// `b`: semi-minor axis, mm.
    SemiMinor,
    /// Radius of an eccentric circle, mm.
    EccentricRadius,
    /// `e`: distance of its centre from the axis, mm.
    Eccentricity,
    /// `U`: number of lobes.
    Lobes,
    /// `U` of a harmonic support function, of which one lobe is an eccentric circle.
    HarmonicLobes,
    /// `R0` of a harmonic support function, mm.
    MeanRadius,
    /// `R` of a harmonic path, mm.
    MeanPathRadius,
    /// `e`: amplitude of either, mm.
    Amplitude,
    /// `Z_G`: theoretical number of teeth.
    ToothCount,
    /// `Z'_G`: number of installed teeth.
    InstalledTeeth,
    /// `r`: tooth radius, mm.
    ToothRadius,
    /// `L1`: tooth width, mm.
    ToothWidth,
    /// Radius of a ball's groove, mm.
    GrooveRadius(Contact),
    /// `l`: length of a tooth's flat, mm.
    FlatLength,
    /// `Z_K`: number of ring teeth.
    RingTeeth,
    /// Tip-circle radius, mm.
    TipRadius,
    /// `E`: Young's modulus, GPa.
    YoungsModulus(Part),
    /// ν: Poisson's ratio.
    PoissonsRatio(Part),
    /// `M0`: torque at the wave generator, N·m.
    InputTorque,
    /// Torque at the carrier, N·m.
    OutputTorque,
    /// Fixed stiffness, N/mm.
    Stiffness(Contact),
    /// The contact law.
    Law,
    /// Bending of the ring's teeth, on or off.
    RingTeethBend,
    /// Change of lever arms with wind-up, on or off.
    WaveGeneratorMoves,
    /// Contact with the corners of the ring's tips, on or off.
    CornerContact,
    /// Depth of the body at a contact, mm.
    Depth(Contact),
    /// Series compliance of the support at a contact, mm/N.
    SeriesCompliance(Contact),
    /// Clearance along a contact's normal, µm.
    Clearance(Contact),
    /// A value of the modification.
    Modification(Modified),
    /// The deviations.
    Deviations,
    /// A list of the deviations.
    DeviationList(Listed),
    /// An entry of a list of the deviations, counted from 0.
    Deviation(Listed, usize),
    /// Runout of a part: distance from the axis, µm.
    RunoutAmount(Contact),
    /// Direction of a part's runout, deg.
    RunoutAngle(Contact),
    /// Allowable stress of all contacts, MPa.
    AllowableStress,
    /// Allowable stress of a contact, MPa.
    AllowableStressAt(Contact),
    /// `n`: speed of the wave generator, 1/min.
    InputSpeed,
    /// A value of a point of the duty, counted from 0.
    Duty(OfDutyPoint, usize),
    /// Number of points of the duty.
    DutyPoints,
    /// μ: coefficient of friction at a contact.
    FrictionCoefficient(Contact),
    /// `μ_b`: coefficient of friction of the bearing between cam and race.
    BearingCoefficient,
    /// `R_b`: radius of that bearing for its friction torque, mm.
    BearingRadius,
    /// `C`: dynamic load rating of that bearing, N.
    BearingLoadRating,
    /// `w`: wear rate of a part at its contact with the teeth, mm³/(N·m).
    WearRate(Contact),
    /// Number of intervals of a sweep.
    Samples,
    /// Relative tolerance of a sweep.
    SweepTolerance,
    /// Requested relative error.
    RequestedError,
    /// Chord tolerance, mm.
    ChordTolerance,
    /// Outer radius of the ring, mm.
    RingOuterRadius,
    /// Inner radius of the carrier, mm.
    CarrierInnerRadius,
    /// Outer radius of the carrier, mm.
    CarrierOuterRadius,
    /// Radius of the fillet at a finger's foot, mm.
    FingerFilletRadius,
    /// `R_p`: yield strength of the carrier, MPa.
    YieldStrength,
    /// `R_m`: tensile strength of the carrier, MPa.
    TensileStrength,
    /// `σ_W`: endurance limit of the carrier, MPa.
    EnduranceLimit,
    /// Radius of the wave generator's bore, mm.
    BoreRadius,
    /// Clearance of a part: inward offset of its working surface, µm.
    PartClearance(Part),
    /// Input angle of an assembly, deg.
    InputAngle,
}

/// Value of a point of a duty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OfDutyPoint {
    /// Torque at the wave generator, N·m.
    InputTorque,
    /// Torque at the carrier, N·m.
    OutputTorque,
    /// Speed of the wave generator, 1/min.
    InputSpeed,
    /// Share of the running time.
    ShareOfTime,
}

/// Value of a modification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Modified {
    /// Offset of the ring along its normals, µm.
    RingEquidistant,
    /// Shift of the ring's generating path, µm.
    RingPathShift,
    /// Shift of the ring's profile, µm.
    RingProfileShift,
    /// Rotation of the ring, arcsec.
    RingRotation,
    /// Offset of the wave generator, µm.
    WaveGeneratorEquidistant,
    /// Offset of the slots' walls, µm.
    SlotWall,
    /// Rotation of the carrier, arcsec.
    CarrierRotation,
    /// Reduction of the teeth's radius, µm.
    ToothRadius,
    /// Amount of tip relief at the flank's end, µm.
    TipReliefAmount,
    /// Start of the tip relief, deg.
    TipReliefStart,
    /// Power of the tip relief.
    TipReliefPower,
}

impl Modified {
    /// Returns the part that it changes.
    pub const fn part(self) -> Part {
        match self {
            Self::RingEquidistant
            | Self::RingPathShift
            | Self::RingProfileShift
            | Self::RingRotation
            | Self::TipReliefAmount
            | Self::TipReliefStart
            | Self::TipReliefPower => Part::Ring,
            Self::WaveGeneratorEquidistant => Part::WaveGenerator,
            Self::SlotWall | Self::CarrierRotation => Part::Carrier,
            Self::ToothRadius => Part::Teeth,
        }
    }
}

/// List of deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Listed {
    /// Reduction of the teeth's radius, by slot, µm.
    ToothRadius,
    /// Rotation of slots, arcsec.
    SlotAngle,
    /// Offset of the slots' walls, µm.
    SlotWall,
    /// Offset of ring spaces, µm.
    RingSpace,
    /// Rotation of ring spaces, arcsec.
    RingSpaceAngle,
    /// Offset of the wave generator's lobes, µm.
    WaveGeneratorLobe,
}

/// Range of a parameter and its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// True if the ends themselves are allowed.
    pub closed: bool,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
}

impl Range {
    const fn closed(low: f64, high: f64, unit: &'static str) -> Self {
        Self { low, high, closed: true, unit }
    }

    /// Returns the end of the range that `value` exceeds, if any; the lower end for NaN.
    pub fn limit_exceeded_by(&self, value: f64) -> Option<f64> {
        let above_low = if self.closed { value >= self.low } else { value > self.low };
        let below_high = if self.closed { value <= self.high } else { value < self.high };
        if !above_low { Some(self.low) } else { (!below_high).then_some(self.high) }
    }
}

/// Largest number of teeth of carrier and ring.
pub const MAX_TEETH: i64 = 10_000;

/// Largest number of lobes of a wave generator. It exceeds any real design, and every tooth number has a possible ring.
pub const MAX_LOBES: i64 = 1_000;

/// Largest number of points of a duty: more than a load spectrum has classes.
pub const MAX_DUTY_POINTS: usize = 100;

/// Largest deviation of the shares of a duty from a sum of one, due to decimal rounding.
pub const SHARES_TOLERANCE: f64 = 1e-6;

/// Largest number of intervals of a sweep.
pub const MAX_SAMPLES: i64 = 10_000_000;

impl Parameter {
    /// Returns the range of the parameter.
    pub const fn range(self) -> Range {
        match self {
            Self::SemiMajor
            | Self::SemiMinor
            | Self::EccentricRadius
            | Self::Eccentricity
            | Self::MeanRadius
            | Self::MeanPathRadius
            | Self::Amplitude
            | Self::ToothRadius
            | Self::ToothWidth
            | Self::GrooveRadius(_)
            | Self::FlatLength
            | Self::TipRadius
            | Self::RingOuterRadius
            | Self::CarrierInnerRadius
            | Self::CarrierOuterRadius
            | Self::FingerFilletRadius
            | Self::BoreRadius
            | Self::Depth(_)
            | Self::BearingRadius
            | Self::ChordTolerance => Range::closed(1e-6, 1e6, "mm"),
            Self::Lobes => Range::closed(1.0, MAX_LOBES as f64, ""),
            Self::HarmonicLobes => Range::closed(2.0, MAX_LOBES as f64, ""),
            Self::ToothCount | Self::InstalledTeeth | Self::RingTeeth => Range::closed(2.0, MAX_TEETH as f64, ""),
            Self::YoungsModulus(_) => Range::closed(1e-3, 1e5, "GPa"),
            Self::PoissonsRatio(_) => Range { low: -1.0, high: 0.5, closed: false, unit: "" },
            Self::InputTorque
            | Self::OutputTorque
            | Self::Duty(OfDutyPoint::InputTorque | OfDutyPoint::OutputTorque, _) => Range::closed(1e-12, 1e15, "N·m"),
            Self::Stiffness(_) => Range::closed(1e-3, 1e15, "N/mm"),
            // As soft as the least stiffness, or zero.
            Self::SeriesCompliance(_) => Range::closed(0.0, 1e3, "mm/N"),
            // Options and lists have no range.
            Self::Law
            | Self::RingTeethBend
            | Self::WaveGeneratorMoves
            | Self::CornerContact
            | Self::Deviations
            | Self::DeviationList(_) => Range::closed(f64::NEG_INFINITY, f64::INFINITY, ""),
            Self::Clearance(_) | Self::PartClearance(_) | Self::RunoutAmount(_) => Range::closed(0.0, 1e6, "µm"),
            Self::RunoutAngle(_) => Range::closed(-360.0, 360.0, "deg"),
            Self::Deviation(Listed::SlotAngle | Listed::RingSpaceAngle, _) => Range::closed(-1e5, 1e5, "arcsec"),
            Self::Deviation(
                Listed::ToothRadius | Listed::SlotWall | Listed::RingSpace | Listed::WaveGeneratorLobe,
                _,
            ) => Range::closed(-1e6, 1e6, "µm"),
            Self::Modification(modified) => match modified {
                Modified::RingRotation | Modified::CarrierRotation => Range::closed(-1e5, 1e5, "arcsec"),
                // A single lobe has its valley at 180 deg.
                Modified::TipReliefStart => Range::closed(0.0, 180.0, "deg"),
                Modified::TipReliefPower => Range::closed(0.1, 100.0, ""),
                Modified::RingEquidistant
                | Modified::RingPathShift
                | Modified::RingProfileShift
                | Modified::WaveGeneratorEquidistant
                | Modified::SlotWall
                | Modified::ToothRadius
                | Modified::TipReliefAmount => Range::closed(-1e6, 1e6, "µm"),
            },
            // At its ends the rounding of the angle is 2e-9 deg.
            Self::InputAngle => Range::closed(-1e7, 1e7, "deg"),
            Self::AllowableStress
            | Self::AllowableStressAt(_)
            | Self::YieldStrength
            | Self::TensileStrength
            | Self::EnduranceLimit => Range::closed(1e-3, 1e6, "MPa"),
            Self::InputSpeed | Self::Duty(OfDutyPoint::InputSpeed, _) => Range::closed(1e-6, 1e6, "1/min"),
            Self::Duty(OfDutyPoint::ShareOfTime, _) => Range::closed(1e-9, 1.0, ""),
            Self::DutyPoints => Range::closed(1.0, MAX_DUTY_POINTS as f64, ""),
            Self::BearingLoadRating => Range::closed(1e-3, 1e12, "N"),
            Self::WearRate(_) => Range::closed(0.0, 1e3, "mm³/(N·m)"),
            Self::FrictionCoefficient(_) | Self::BearingCoefficient => Range::closed(0.0, 1.0, ""),
            Self::Samples => Range::closed(1.0, MAX_SAMPLES as f64, ""),
            Self::RequestedError => Range::closed(1e-12, 1.0, ""),
            Self::SweepTolerance => Range::closed(1e-12, 0.1, ""),
        }
    }

    /// Returns the violation of the parameter's range by `value`, if there is one.
    pub fn check(self, value: f64) -> Option<Violation> {
        let range = self.range();
        let limit = range.limit_exceeded_by(value)?;
        Some(Violation::OutOfRange { parameter: self, value, limit })
    }
}

/// Nearest possible tooth numbers on either side of an impossible one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alternatives {
    /// Largest possible number below.
    pub below: Option<i64>,
    /// Least possible number above.
    pub above: Option<i64>,
}

impl Alternatives {
    /// Returns the divisors of `teeth` next to a number of installed teeth that does not divide it.
    pub(crate) fn to_installed(installed: i64, teeth: i64) -> Self {
        let is_divisor = |other: &i64| teeth % other == 0;
        Self { below: (2..installed).rev().find(is_divisor), above: (installed + 1..=teeth).find(is_divisor) }
    }

    /// Returns the ring tooth numbers that differ from `teeth` by the lobes and are at least the number of lobes.
    pub(crate) fn to_ring_beside(teeth: i64, lobes: i64) -> Self {
        let possible = |ring: i64| {
            let is_in_range = Parameter::RingTeeth.check(ring as f64).is_none();
            (is_in_range && ring >= lobes).then_some(ring)
        };
        Self { below: possible(teeth - lobes), above: possible(teeth + lobes) }
    }

    /// Returns true if the count is one of the two.
    pub(crate) fn contains(&self, count: i64) -> bool {
        self.below == Some(count) || self.above == Some(count)
    }

    /// Returns the nearer number, the lower one if both are equally near. There is always one.
    pub fn nearest_to(&self, count: i64) -> i64 {
        let nearest = [self.below, self.above].into_iter().flatten().min_by_key(|other| (other - count).abs());
        nearest.unwrap_or(count)
    }
}

impl std::fmt::Display for Alternatives {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.below, self.above) {
            (Some(below), Some(above)) => write!(f, "{below} or {above}"),
            (below, above) => below.or(above).map_or(Ok(()), |only| write!(f, "{only}")),
        }
    }
}

/// Reason why a drive, a load or a request is impossible. Its text says what to change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Violation {
    /// A value outside its range.
    OutOfRange {
        /// The parameter.
        parameter: Parameter,
        /// Value.
        value: f64,
        /// End of the range that the value exceeds.
        limit: f64,
    },
    /// Ellipse with `a ≤ b`.
    CamNotElongated {
        /// `a`.
        semi_major_mm: f64,
        /// `b`.
        semi_minor_mm: f64,
    },
    /// The cam is too small for its stroke: its lobes have cusps, their flanks meet, or the axis is outside.
    CamTooSmall {
        /// Parameter that sets the size of the cam.
        parameter: Parameter,
        /// Value.
        radius_mm: f64,
        /// Value that it has to exceed.
        least_mm: f64,
    },
    /// Impossible tooth difference: `|Z_G - Z_K| ≠ U`, or `Z_K < U`.
    ToothDifference {
        /// `Z_G`.
        teeth: i64,
        /// `Z_K`.
        ring_teeth: i64,
        /// `U`.
        lobes: i64,
        /// Possible values of `Z_K`.
        instead: Alternatives,
    },
    /// A groove that is no wider than its ball.
    GrooveTooTight {
        /// Contact of the groove.
        contact: Contact,
        /// The groove's radius.
        groove_radius_mm: f64,
        /// `r`.
        tooth_radius_mm: f64,
    },
    /// A flat that leaves nothing of the tooth.
    FlatTooLong {
        /// `l`.
        flat_length_mm: f64,
        /// `2r`.
        tooth_diameter_mm: f64,
    },
    /// `Z'_G` is not a divisor of `Z_G`.
    InstalledNoDivisor {
        /// `Z'_G`.
        installed: i64,
        /// `Z_G`.
        teeth: i64,
        /// Possible values of `Z'_G`.
        instead: Alternatives,
    },
    /// Neighbouring installed teeth touch somewhere on their path.
    TeethTouch {
        /// `2r`.
        tooth_diameter_mm: f64,
        /// Least distance of two neighbouring centres on their path, for an ellipse the pair across the minor axis.
        center_distance_mm: f64,
        /// Radius at which teeth begin to touch. The path of thinner teeth is closer to the axis.
        touching_radius_mm: f64,
    },
    /// The ring's tips reach the wave generator: no annulus is left for the carrier.
    NoCarrierAnnulus {
        /// Parameter that sets the wave generator's reach.
        parameter: Parameter,
        /// Value.
        value_mm: f64,
        /// Value that it has to stay below.
        limit_mm: f64,
        /// Largest distance of the wave generator from the axis, `a` for an ellipse.
        cam_outer_mm: f64,
        /// Actual tip radius of the ring.
        tip_radius_mm: f64,
    },
    /// A clearance under `projection` that would load a tooth instead of unloading it.
    ClearanceNotMonotone {
        /// Contact of the clearance.
        contact: Contact,
        /// The clearance.
        clearance_um: f64,
    },
    /// A parameter that `projection` does not support.
    NeedsVirtualWork {
        /// The parameter.
        parameter: Parameter,
    },
    /// A tip relief that starts at the end of the flank or beyond it.
    TipReliefBeyondFlank {
        /// Start of the tip relief.
        start_deg: f64,
        /// End of the flank.
        engagement_start_deg: f64,
    },
    /// A modification that leaves nothing of a part's outline.
    ModificationLeavesNothing {
        /// The value of the modification.
        modified: Modified,
        /// Value.
        value: f64,
        /// Limit of the value, if it is a single number.
        limit: Option<f64>,
    },
    /// A list of deviations that is neither empty nor has one entry for each item.
    DeviationCount {
        /// The list.
        listed: Listed,
        /// Number of entries.
        count: usize,
        /// Number of items.
        items: usize,
    },
    /// A contact law that does not apply to teeth of this shape.
    LawOfOtherTeeth,
    /// Shares of a duty that do not add up to one.
    DutyShares {
        /// Their sum.
        sum: f64,
    },
    /// A load rating of a bearing whose load does not define a life.
    NoBearingLife,
    /// The bore removes the whole flank.
    BoreLeavesNoFlank {
        /// The bore.
        tip_radius_mm: f64,
        /// `d_l + r`.
        root_radius_mm: f64,
    },
    /// A part whose dimension or clearance leaves no space for it or for another part.
    PartDoesNotFit {
        /// The misfit.
        misfit: Misfit,
        /// The value, given or by default, in the unit of its parameter.
        value: f64,
        /// Limit of the value, upper or lower.
        limit: f64,
    },
}

/// Reason why a part cannot be made or does not fit to the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misfit {
    /// The ring's outer radius does not exceed its root radius.
    RingWithoutRim,
    /// The carrier's inner radius does not exceed that of the cam.
    CarrierMeetsCam,
    /// The carrier's outer radius reaches the ring's tips.
    CarrierMeetsRing,
    /// The carrier's outer radius does not exceed its inner one.
    CarrierWithoutWall,
    /// The slots overlap up to the carrier's outer radius.
    SlotsTakeCarrier,
    /// The bore reaches the cam.
    BoreTakesCam,
    /// The cam's inward offset is at least its least radius of curvature.
    ClearanceTakesCam,
    /// The teeth's clearance reaches their radius.
    ClearanceTakesTooth,
}

impl Misfit {
    /// Returns the parameter at fault.
    pub const fn parameter(self) -> Parameter {
        match self {
            Self::RingWithoutRim => Parameter::RingOuterRadius,
            Self::CarrierMeetsCam => Parameter::CarrierInnerRadius,
            Self::CarrierMeetsRing | Self::CarrierWithoutWall | Self::SlotsTakeCarrier => Parameter::CarrierOuterRadius,
            Self::BoreTakesCam => Parameter::BoreRadius,
            Self::ClearanceTakesCam => Parameter::PartClearance(Part::WaveGenerator),
            Self::ClearanceTakesTooth => Parameter::PartClearance(Part::Teeth),
        }
    }
}

/// Formats a number as a person would write it.
fn readable(value: f64) -> String {
    if value == 0.0 || (1e-3..1e7).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

impl std::fmt::Display for Violation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::OutOfRange { parameter, value, .. } => {
                let Range { low, high, closed, unit } = parameter.range();
                let bounds = if closed { "from" } else { "strictly between" };
                let joint = if closed { "to" } else { "and" };
                let [value, low, high] = [value, low, high].map(readable);
                write!(f, "{value} is out of range: choose a value {bounds} {low} {joint} {high}")?;
                if unit.is_empty() { Ok(()) } else { write!(f, " {unit}") }
            }
            Self::CamNotElongated { semi_major_mm, semi_minor_mm } => write!(
                f,
                "the semi-major axis ({semi_major_mm:?} mm) must exceed the semi-minor axis ({semi_minor_mm:?} mm): a round cam moves no tooth"
            ),
            Self::CamTooSmall { radius_mm, least_mm, .. } => write!(
                f,
                "a wave generator of {radius_mm:?} mm is too small for its stroke, its lobes would have cusps, their flanks would meet, or its axis would lie outside: choose more than {least_mm:?} mm, or a smaller stroke"
            ),
            Self::ToothDifference { teeth, ring_teeth, lobes, instead } => {
                let joint = if lobes == 1 { "1 tooth".to_owned() } else { format!("{lobes} teeth") };
                write!(
                    f,
                    "carrier and ring must differ by {joint}, one for each lobe of the wave generator: with {teeth} teeth the ring has {instead}, not {ring_teeth}"
                )
            }
            Self::GrooveTooTight { groove_radius_mm, tooth_radius_mm, .. } => write!(
                f,
                "a groove of {groove_radius_mm:?} mm radius is no wider than the balls in it: choose more than their radius of {tooth_radius_mm:?} mm"
            ),
            Self::FlatTooLong { flat_length_mm, tooth_diameter_mm } => write!(
                f,
                "flats of {flat_length_mm:?} mm length leave nothing of a tooth: choose less than its diameter of {tooth_diameter_mm:?} mm"
            ),
            Self::InstalledNoDivisor { installed, teeth, instead } => write!(
                f,
                "{installed} installed teeth do not divide {teeth}: teeth are removed evenly, every m-th slot keeps its tooth; choose {instead}"
            ),
            Self::TeethTouch { tooth_diameter_mm, center_distance_mm, touching_radius_mm } => write!(
                f,
                "neighbouring teeth of {tooth_diameter_mm:?} mm diameter come as near as {center_distance_mm:?} mm from centre to centre: choose a radius below {touching_radius_mm:?} mm, install fewer, or enlarge the wave generator"
            ),
            Self::NoCarrierAnnulus { cam_outer_mm, tip_radius_mm, .. } => write!(
                f,
                "the ring's tips ({tip_radius_mm:?} mm) must stay outside the wave generator ({cam_outer_mm:?} mm), or no annulus is left for the carrier: make the teeth thicker or the wave generator rounder, or bore the ring"
            ),
            Self::ClearanceNotMonotone { clearance_um, .. } => write!(
                f,
                "`projection` weighs this gap of {clearance_um:?} µm negatively at some position, so that it would load a tooth instead of freeing it: choose `virtual_work`, or no clearance of this part and of the teeth"
            ),
            Self::NeedsVirtualWork { .. } => {
                write!(f, "`projection` does not take this: choose `virtual_work`, or leave it out")
            }
            Self::TipReliefBeyondFlank { start_deg, engagement_start_deg } => write!(
                f,
                "a tip relief from {start_deg:?} deg on relieves nothing: the flank ends at {engagement_start_deg:?} deg"
            ),
            Self::ModificationLeavesNothing { value, limit, .. } => {
                write!(f, "modified by {value:?} a part has no outline left that could be made: choose ")?;
                match limit {
                    Some(limit) => write!(f, "a value between {limit:?} and zero"),
                    None => write!(f, "a value nearer to zero"),
                }
            }
            Self::DeviationCount { count, items, .. } => {
                write!(f, "{count} entries for {items} items: give one for each, or none")
            }
            Self::LawOfOtherTeeth => write!(
                f,
                "balls take `hertz` or `fixed`, and `hertz` is nowhere else: choose a law that teeth of this shape have"
            ),
            Self::DutyShares { sum } => {
                write!(
                    f,
                    "the shares of time add up to {sum:?}, not to 1: say for each point how much of the running time it takes"
                )
            }
            Self::NoBearingLife => write!(
                f,
                "a bearing's life by ISO 281 follows from the load across an eccentric circle: lobes that are loaded alike leave none, and a race that they bend has another life"
            ),
            Self::BoreLeavesNoFlank { tip_radius_mm, root_radius_mm } => write!(
                f,
                "a bore of {tip_radius_mm:?} mm takes the whole flank away: choose less than the root radius of {root_radius_mm:?} mm"
            ),
            Self::PartDoesNotFit { misfit, value, limit } => match misfit {
                Misfit::RingWithoutRim => write!(
                    f,
                    "an outer radius of {value:?} mm leaves the ring no rim: choose more than its root radius of {limit:?} mm"
                ),
                Misfit::CarrierMeetsCam => write!(
                    f,
                    "a carrier of {value:?} mm inner radius meets the wave generator: choose more than its largest radius of {limit:?} mm"
                ),
                Misfit::CarrierMeetsRing => write!(
                    f,
                    "a carrier of {value:?} mm outer radius meets the ring: choose less than the ring's tip radius of {limit:?} mm"
                ),
                Misfit::CarrierWithoutWall => write!(
                    f,
                    "an outer radius of {value:?} mm leaves the carrier no wall: choose more than its inner radius of {limit:?} mm"
                ),
                Misfit::SlotsTakeCarrier => write!(
                    f,
                    "up to {limit:?} mm from the axis the slots run into each other, which leaves nothing of a carrier of {value:?} mm outer radius: make the teeth thinner or install fewer"
                ),
                Misfit::BoreTakesCam => write!(
                    f,
                    "a bore of {value:?} mm cuts the wave generator open: choose less than its least radius of {limit:?} mm"
                ),
                Misfit::ClearanceTakesCam => write!(
                    f,
                    "set back by {value:?} µm the wave generator gets a cusp: choose less than its least radius of curvature, {limit:?} µm"
                ),
                Misfit::ClearanceTakesTooth => write!(
                    f,
                    "a clearance of {value:?} µm leaves nothing of the teeth: choose less than their radius of {limit:?} µm"
                ),
            },
        }
    }
}
