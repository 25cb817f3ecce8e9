//! Reasons why a drive, a load or a request cannot exist.

use crate::contact::{Contact, Part};

/// A parameter that a violation can be about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// `a`, mm.
    SemiMajor,
    /// `b`, mm.
    SemiMinor,
    /// Radius of an eccentric circle, mm.
    EccentricRadius,
    /// Its distance from the axis, mm.
    Eccentricity,
    /// `U`.
    Lobes,
    /// `R0` of a harmonic support function, mm.
    MeanRadius,
    /// `R` of a harmonic path, mm.
    MeanPathRadius,
    /// `e` of either, mm.
    Amplitude,
    /// `Z_G`.
    ToothCount,
    /// `Z'_G`.
    InstalledTeeth,
    /// `r`, mm.
    ToothRadius,
    /// `L1`, mm.
    ToothWidth,
    /// Radius of a ball's groove, mm.
    GrooveRadius(Contact),
    /// `l`: length of a tooth's flat, mm.
    FlatLength,
    /// `Z_K`.
    RingTeeth,
    /// Tip-circle radius, mm.
    TipRadius,
    /// `E`, GPa.
    YoungsModulus(Part),
    /// ν.
    PoissonsRatio(Part),
    /// `M0`, N·m.
    InputTorque,
    /// Torque at the carrier, N·m.
    OutputTorque,
    /// Fixed stiffness, N/mm.
    Stiffness(Contact),
    /// The contact law.
    Law,
    /// Whether the ring's teeth bend.
    RingTeethBend,
    /// Whether the wave generator moves on under its teeth.
    WaveGeneratorMoves,
    /// Whether teeth are pressed against the corners of the ring's tips.
    CornerContact,
    /// Depth of the body at a contact, mm.
    Depth(Contact),
    /// Compliance of what stands behind a contact, mm/N.
    SeriesCompliance(Contact),
    /// Gap along a contact's normal, µm.
    Clearance(Contact),
    /// A number of the modification.
    Modification(Modified),
    /// The deviations.
    Deviations,
    /// A list of the deviations.
    DeviationList(Listed),
    /// An entry of a list of the deviations, counted from 0.
    Deviation(Listed, usize),
    /// How far a part stands off the axis, µm.
    RunoutAmount(Contact),
    /// In which direction, deg.
    RunoutAngle(Contact),
    /// Allowable stress of all contacts, MPa.
    AllowableStress,
    /// Allowable stress of a contact, MPa.
    AllowableStressAt(Contact),
    /// `n`: speed of the wave generator, 1/min.
    InputSpeed,
    /// A number of a point of the duty, counted from 0.
    Duty(OfDutyPoint, usize),
    /// Points of the duty.
    DutyPoints,
    /// μ of a contact.
    FrictionCoefficient(Contact),
    /// `μ_b`: friction of the bearing between cam and race.
    BearingCoefficient,
    /// `R_b`: the radius that it belongs to, mm.
    BearingRadius,
    /// `C`: dynamic load rating of that bearing, N.
    BearingLoadRating,
    /// `w`: wear rate of a part at its contact with the teeth, mm³/(N·m).
    WearRate(Contact),
    /// Intervals of a sweep.
    Samples,
    /// Relative tolerance of a sweep.
    SweepTolerance,
    /// Relative error that is asked for.
    RequestedError,
    /// Chord tolerance, mm.
    ChordTolerance,
    /// Outer radius of the ring, mm.
    RingOuterRadius,
    /// Inner radius of the carrier, mm.
    CarrierInnerRadius,
    /// Outer radius of the carrier, mm.
    CarrierOuterRadius,
    /// Radius of the wave generator's bore, mm.
    BoreRadius,
    /// How far a part's working surface is set back, µm.
    PartClearance(Part),
    /// Input angle of an assembly, deg.
    InputAngle,
}

/// What a point of a duty says.
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

/// What a modification says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Modified {
    /// The ring set back along its normals, µm.
    RingEquidistant,
    /// The ring's generating path shifted, µm.
    RingPathShift,
    /// The ring's profile shifted, µm.
    RingProfileShift,
    /// The ring turned, arcsec.
    RingRotation,
    /// The wave generator set back, µm.
    WaveGeneratorEquidistant,
    /// The slots' walls set back, µm.
    SlotWall,
    /// The carrier turned, arcsec.
    CarrierRotation,
    /// Teeth thinner in radius, µm.
    ToothRadius,
    /// Tip relief at the flank's end, µm.
    TipReliefAmount,
    /// Where it starts, deg.
    TipReliefStart,
    /// Its power.
    TipReliefPower,
}

impl Modified {
    /// The part that it changes.
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

/// What a list of the deviations is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Listed {
    /// Teeth thinner in their radius, by slot, µm.
    ToothRadius,
    /// Slots turned away, arcsec.
    SlotAngle,
    /// Slots' walls set back, µm.
    SlotWall,
    /// Ring spaces set back, µm.
    RingSpace,
    /// Ring spaces turned away, arcsec.
    RingSpaceAngle,
    /// Lobes of the wave generator set back, µm.
    WaveGeneratorLobe,
}

/// The range of a parameter and its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Whether the ends themselves are allowed.
    pub closed: bool,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
}

impl Range {
    const fn closed(low: f64, high: f64, unit: &'static str) -> Self {
        Self { low, high, closed: true, unit }
    }

    /// The end that `value` is beyond, if it is; not-a-number is beyond the lower one.
    pub fn limit_exceeded_by(&self, value: f64) -> Option<f64> {
        let above_low = if self.closed { value >= self.low } else { value > self.low };
        let below_high = if self.closed { value <= self.high } else { value < self.high };
        if !above_low { Some(self.low) } else { (!below_high).then_some(self.high) }
    }
}

/// Most teeth of carrier and ring.
pub const MAX_TEETH: i64 = 10_000;

/// Most lobes of a wave generator; more than any has, and so few that some number of ring teeth is possible beside any of teeth.
pub const MAX_LOBES: i64 = 1_000;

/// Most points of a duty: more than a load spectrum has classes.
pub const MAX_DUTY_POINTS: usize = 100;

/// How far the shares of a duty may be from one: what writing them with some digits leaves.
pub const SHARES_TOLERANCE: f64 = 1e-6;

/// Most intervals of a sweep.
pub const MAX_SAMPLES: i64 = 10_000_000;

impl Parameter {
    /// The range that the parameter has to lie in.
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
            | Self::BoreRadius
            | Self::Depth(_)
            | Self::BearingRadius
            | Self::ChordTolerance => Range::closed(1e-6, 1e6, "mm"),
            Self::Lobes => Range::closed(1.0, MAX_LOBES as f64, ""),
            Self::ToothCount | Self::InstalledTeeth | Self::RingTeeth => Range::closed(2.0, MAX_TEETH as f64, ""),
            Self::YoungsModulus(_) => Range::closed(1e-3, 1e5, "GPa"),
            Self::PoissonsRatio(_) => Range { low: -1.0, high: 0.5, closed: false, unit: "" },
            Self::InputTorque
            | Self::OutputTorque
            | Self::Duty(OfDutyPoint::InputTorque | OfDutyPoint::OutputTorque, _) => Range::closed(1e-12, 1e15, "N·m"),
            Self::Stiffness(_) => Range::closed(1e-3, 1e15, "N/mm"),
            // As soft as the least stiffness, and nothing.
            Self::SeriesCompliance(_) => Range::closed(0.0, 1e3, "mm/N"),
            // A choice and lists, which have no number.
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
                // A single lobe has its valley at the end.
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
            Self::AllowableStress | Self::AllowableStressAt(_) => Range::closed(1e-3, 1e6, "MPa"),
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

    /// The violation of the parameter's range by `value`, if there is one.
    pub fn check(self, value: f64) -> Option<Violation> {
        let range = self.range();
        let limit = range.limit_exceeded_by(value)?;
        Some(Violation::OutOfRange { parameter: self, value, limit })
    }
}

/// The possible numbers of teeth on either side of one that is impossible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alternatives {
    /// The largest below.
    pub below: Option<i64>,
    /// The least above.
    pub above: Option<i64>,
}

impl Alternatives {
    /// To a number of installed teeth that does not divide `teeth`: divisors.
    pub(crate) fn to_installed(installed: i64, teeth: i64) -> Self {
        let is_divisor = |other: &i64| teeth % other == 0;
        Self { below: (2..installed).rev().find(is_divisor), above: (installed + 1..=teeth).find(is_divisor) }
    }

    /// To a ring that does not differ from `teeth` by the lobes, or has fewer teeth than there are lobes.
    pub(crate) fn to_ring_beside(teeth: i64, lobes: i64) -> Self {
        let possible = |ring: i64| {
            let is_in_range = Parameter::RingTeeth.check(ring as f64).is_none();
            (is_in_range && ring >= lobes).then_some(ring)
        };
        Self { below: possible(teeth - lobes), above: possible(teeth + lobes) }
    }

    /// Whether the count is one of the two.
    pub(crate) fn contains(&self, count: i64) -> bool {
        self.below == Some(count) || self.above == Some(count)
    }

    /// The nearer one, of two as near the lower. There is always one.
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

/// A reason why a drive, a load or a request cannot exist. Its text says what to change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Violation {
    /// A value outside its range.
    OutOfRange {
        /// Which.
        parameter: Parameter,
        /// Its value.
        value: f64,
        /// The end of the range that it is beyond.
        limit: f64,
    },
    /// `a ≤ b`.
    CamNotElongated {
        /// `a`.
        semi_major_mm: f64,
        /// `b`.
        semi_minor_mm: f64,
    },
    /// A cam that is too small for its stroke: its lobes would have cusps, their flanks would meet, or the axis would lie outside.
    CamTooSmall {
        /// The radius that says how large it is.
        parameter: Parameter,
        /// Its value.
        radius_mm: f64,
        /// What it has to exceed.
        least_mm: f64,
    },
    /// `|Z_G - Z_K| ≠ U`, or `Z_K < U`.
    ToothDifference {
        /// `Z_G`.
        teeth: i64,
        /// `Z_K`.
        ring_teeth: i64,
        /// `U`.
        lobes: i64,
        /// What `Z_K` could be.
        instead: Alternatives,
    },
    /// A groove that is no wider than the ball in it.
    GrooveTooTight {
        /// At which contact.
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
    /// `Z'_G` no divisor of `Z_G`.
    InstalledNoDivisor {
        /// `Z'_G`.
        installed: i64,
        /// `Z_G`.
        teeth: i64,
        /// What `Z'_G` could be.
        instead: Alternatives,
    },
    /// Neighbouring installed teeth touch somewhere on their path.
    TeethTouch {
        /// `2r`.
        tooth_diameter_mm: f64,
        /// Distance of two neighbouring centres, those either side of the minor axis.
        center_distance_mm: f64,
        /// The radius at which teeth begin to touch: that of thinner ones, whose path lies farther in.
        touching_radius_mm: f64,
    },
    /// The ring's tips reach in to the wave generator: no annulus is left for the carrier.
    NoCarrierAnnulus {
        /// What makes the wave generator reach so far out.
        parameter: Parameter,
        /// Its value.
        value_mm: f64,
        /// What it has to stay below.
        limit_mm: f64,
        /// The wave generator's largest distance from the axis, `a` of an ellipse.
        cam_outer_mm: f64,
        /// The ring's actual tip radius.
        tip_radius_mm: f64,
    },
    /// A clearance under `projection` that would push a tooth instead of leaving it free.
    ClearanceNotMonotone {
        /// At which contact.
        contact: Contact,
        /// The clearance.
        clearance_um: f64,
    },
    /// What `projection` does not take.
    NeedsVirtualWork {
        /// Which.
        parameter: Parameter,
    },
    /// A tip relief that starts at the end of the flank or beyond it.
    TipReliefBeyondFlank {
        /// Where it starts.
        start_deg: f64,
        /// Where the flank ends.
        engagement_start_deg: f64,
    },
    /// A modification that leaves nothing of a part's outline.
    ModificationLeavesNothing {
        /// Which of its numbers.
        modified: Modified,
        /// Its value.
        value: f64,
        /// What it has to stay away from, where that is one number.
        limit: Option<f64>,
    },
    /// A list of deviations that has neither no entry nor one for each item.
    DeviationCount {
        /// Which list.
        listed: Listed,
        /// Entries.
        count: usize,
        /// Items.
        items: usize,
    },
    /// A contact law that teeth of this shape do not have.
    LawOfOtherTeeth,
    /// Shares of a duty that do not add up to one.
    DutyShares {
        /// Their sum.
        sum: f64,
    },
    /// A load rating of a bearing whose load is none that its life follows from.
    NoBearingLife,
    /// The bore takes the whole flank away.
    BoreLeavesNoFlank {
        /// The bore.
        tip_radius_mm: f64,
        /// `d_l + r`.
        root_radius_mm: f64,
    },
    /// A part whose dimension or clearance leaves no room for it or for another.
    PartDoesNotFit {
        /// What does not fit.
        misfit: Misfit,
        /// The value, given or by default, in the unit of its parameter.
        value: f64,
        /// What it has to stay above or below.
        limit: f64,
    },
}

/// Why a part cannot be made, or not beside the others.
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
    /// The slots run into each other all the way to the carrier's outer radius.
    SlotsTakeCarrier,
    /// The bore reaches the cam.
    BoreTakesCam,
    /// The cam is set back by its least radius of curvature or more.
    ClearanceTakesCam,
    /// The teeth's clearance reaches their radius.
    ClearanceTakesTooth,
}

impl Misfit {
    /// The parameter at fault.
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

/// A number as a person would write it.
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
