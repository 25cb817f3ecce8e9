//! Parameters, and the range of each.

use super::Violation;
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
