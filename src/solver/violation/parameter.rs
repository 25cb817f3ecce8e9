//! The table of the parameters: meaning, range and unit of each. Checks, messages and the API document read it.

use super::Violation;
use crate::contact::{Contact, Part};

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
    const LENGTH: Self = Self::closed(1e-6, 1e6, "mm");
    const OFFSET: Self = Self::closed(-1e6, 1e6, "µm");
    const GAP: Self = Self::closed(0.0, 1e6, "µm");
    const ROTATION: Self = Self::closed(-1e5, 1e5, "arcsec");
    const TEETH: Self = Self::closed(2.0, MAX_TEETH as f64, "");
    const TORQUE: Self = Self::closed(1e-12, 1e15, "N·m");
    const SPEED: Self = Self::closed(1e-6, 1e6, "1/min");
    const STRESS: Self = Self::closed(1e-3, 1e6, "MPa");
    const FRICTION: Self = Self::closed(0.0, 1.0, "");
    /// An option or a list has no range.
    const NONE: Self = Self::closed(f64::NEG_INFINITY, f64::INFINITY, "");

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

/// Makes an enum of lines `Name = range;`, with `Name(of: Kind)` for each part, contact or item.
macro_rules! table {
    (@each $name:ident) => { vec![Self::$name] };
    (@each $name:ident, $kind:ty) => { <$kind>::all().into_iter().map(Self::$name).collect() };
    (@each $name:ident, $kind:ty, $entry:ty) => {
        <$kind>::all().into_iter().map(|of| Self::$name(of, 0)).collect()
    };
    (
        $(#[$about:meta])* $table:ident:
        $($(#[$doc:meta])* $name:ident $(($of:tt: $kind:ty $(, $at:tt: $entry:ty)?))? = $range:expr;)+
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $table {
            $($(#[$doc])* $name $(($kind $(, $entry)?))?),+
        }

        impl $table {
            /// Returns the range and the unit.
            pub const fn range(self) -> Range {
                match self {
                    $(Self::$name $(($of $(, $at)?))? => $range),+
                }
            }

            /// Returns all of them, of the entries of a list the first.
            pub fn all() -> Vec<Self> {
                [$(table!(@each $name $(, $kind $(, $entry)?)?)),+].concat()
            }
        }
    };
}

table! {
    /// Parameter to which a violation can refer.
    Parameter:
    /// `a`: semi-major axis.
    SemiMajor = Range::LENGTH;
    /// `b`: semi-minor axis.
    SemiMinor = Range::LENGTH;
    /// Radius of an eccentric circle.
    EccentricRadius = Range::LENGTH;
    /// `e`: distance of its centre from the axis.
    Eccentricity = Range::LENGTH;
    /// `U`: number of lobes.
    Lobes = Range::closed(1.0, MAX_LOBES as f64, "");
    /// `U` of a harmonic support function, of which one lobe is an eccentric circle.
    HarmonicLobes = Range::closed(2.0, MAX_LOBES as f64, "");
    /// `R0` of a harmonic support function.
    MeanRadius = Range::LENGTH;
    /// `R` of a harmonic path.
    MeanPathRadius = Range::LENGTH;
    /// `e`: amplitude of either.
    Amplitude = Range::LENGTH;
    /// `Z_G`: theoretical number of teeth.
    ToothCount = Range::TEETH;
    /// `Z'_G`: number of installed teeth.
    InstalledTeeth = Range::TEETH;
    /// `r`: tooth radius.
    ToothRadius = Range::LENGTH;
    /// `L1`: tooth width.
    ToothWidth = Range::LENGTH;
    /// Radius of a ball's groove.
    GrooveRadius(_: Contact) = Range::LENGTH;
    /// `l`: length of a tooth's flat.
    FlatLength = Range::LENGTH;
    /// `Z_K`: number of ring teeth.
    RingTeeth = Range::TEETH;
    /// Tip-circle radius.
    TipRadius = Range::LENGTH;
    /// `E`: Young's modulus.
    YoungsModulus(_: Part) = Range::closed(1e-3, 1e5, "GPa");
    /// ν: Poisson's ratio.
    PoissonsRatio(_: Part) = Range { low: -1.0, high: 0.5, closed: false, unit: "" };
    /// `M0`: torque at the wave generator.
    InputTorque = Range::TORQUE;
    /// Torque at the carrier.
    OutputTorque = Range::TORQUE;
    /// Fixed stiffness.
    Stiffness(_: Contact) = Range::closed(1e-3, 1e15, "N/mm");
    /// The contact law.
    Law = Range::NONE;
    /// Bending of the ring's teeth, on or off.
    RingTeethBend = Range::NONE;
    /// Change of lever arms with wind-up, on or off.
    WaveGeneratorMoves = Range::NONE;
    /// Contact with the corners of the ring's tips, on or off.
    CornerContact = Range::NONE;
    /// Depth of the body at a contact.
    Depth(_: Contact) = Range::LENGTH;
    /// Series compliance of the support at a contact: as soft as the least stiffness, or zero.
    SeriesCompliance(_: Contact) = Range::closed(0.0, 1e3, "mm/N");
    /// Clearance along a contact's normal.
    Clearance(_: Contact) = Range::GAP;
    /// A value of the modification.
    Modification(modified: Modified) = modified.range();
    /// The deviations.
    Deviations = Range::NONE;
    /// A list of the deviations.
    DeviationList(_: Listed) = Range::NONE;
    /// An entry of a list of the deviations, counted from 0.
    Deviation(listed: Listed, _: usize) = listed.range();
    /// Runout of a part: distance from the axis.
    RunoutAmount(_: Contact) = Range::GAP;
    /// Direction of a part's runout.
    RunoutAngle(_: Contact) = Range::closed(-360.0, 360.0, "deg");
    /// Allowable stress of all contacts.
    AllowableStress = Range::STRESS;
    /// Allowable stress of a contact.
    AllowableStressAt(_: Contact) = Range::STRESS;
    /// `n`: speed of the wave generator.
    InputSpeed = Range::SPEED;
    /// A value of a point of the duty, counted from 0.
    Duty(of: OfDutyPoint, _: usize) = of.range();
    /// Number of points of the duty.
    DutyPoints = Range::closed(1.0, MAX_DUTY_POINTS as f64, "");
    /// μ: coefficient of friction at a contact.
    FrictionCoefficient(_: Contact) = Range::FRICTION;
    /// `μ_b`: coefficient of friction of the bearing between cam and race.
    BearingCoefficient = Range::FRICTION;
    /// `R_b`: radius of that bearing for its friction torque.
    BearingRadius = Range::LENGTH;
    /// `C`: dynamic load rating of that bearing.
    BearingLoadRating = Range::closed(1e-3, 1e12, "N");
    /// `w`: wear rate of a part at its contact with the teeth.
    WearRate(_: Contact) = Range::closed(0.0, 1e3, "mm³/(N·m)");
    /// Number of intervals of a sweep.
    Samples = Range::closed(1.0, MAX_SAMPLES as f64, "");
    /// Relative tolerance of a sweep.
    SweepTolerance = Range::closed(1e-12, 0.1, "");
    /// Requested relative error.
    RequestedError = Range::closed(1e-12, 1.0, "");
    /// Chord tolerance.
    ChordTolerance = Range::LENGTH;
    /// Outer radius of the ring.
    RingOuterRadius = Range::LENGTH;
    /// Inner radius of the carrier.
    CarrierInnerRadius = Range::LENGTH;
    /// Outer radius of the carrier.
    CarrierOuterRadius = Range::LENGTH;
    /// Radius of the fillet at a finger's foot.
    FingerFilletRadius = Range::LENGTH;
    /// `R_p`: yield strength of the carrier.
    YieldStrength = Range::STRESS;
    /// `R_m`: tensile strength of the carrier.
    TensileStrength = Range::STRESS;
    /// `σ_W`: endurance limit of the carrier.
    EnduranceLimit = Range::STRESS;
    /// Radius of the wave generator's bore.
    BoreRadius = Range::LENGTH;
    /// Clearance of a part: inward offset of its working surface.
    PartClearance(_: Part) = Range::GAP;
    /// Input angle of an assembly. At its ends the rounding of the angle is 2e-9 deg.
    InputAngle = Range::closed(-1e7, 1e7, "deg");
}

table! {
    /// Value of a point of a duty.
    OfDutyPoint:
    /// Torque at the wave generator.
    InputTorque = Range::TORQUE;
    /// Torque at the carrier.
    OutputTorque = Range::TORQUE;
    /// Speed of the wave generator.
    InputSpeed = Range::SPEED;
    /// Share of the running time.
    ShareOfTime = Range::closed(1e-9, 1.0, "");
}

table! {
    /// Value of a modification.
    Modified:
    /// Offset of the ring along its normals.
    RingEquidistant = Range::OFFSET;
    /// Shift of the ring's generating path.
    RingPathShift = Range::OFFSET;
    /// Shift of the ring's profile.
    RingProfileShift = Range::OFFSET;
    /// Rotation of the ring.
    RingRotation = Range::ROTATION;
    /// Offset of the wave generator.
    WaveGeneratorEquidistant = Range::OFFSET;
    /// Offset of the slots' walls.
    SlotWall = Range::OFFSET;
    /// Rotation of the carrier.
    CarrierRotation = Range::ROTATION;
    /// Reduction of the teeth's radius.
    ToothRadius = Range::OFFSET;
    /// Amount of tip relief at the flank's end.
    TipReliefAmount = Range::OFFSET;
    /// Start of the tip relief. A single lobe has its valley at 180 deg.
    TipReliefStart = Range::closed(0.0, 180.0, "deg");
    /// Power of the tip relief.
    TipReliefPower = Range::closed(0.1, 100.0, "");
}

table! {
    /// List of deviations.
    Listed:
    /// Reduction of the teeth's radius, by slot.
    ToothRadius = Range::OFFSET;
    /// Rotation of slots.
    SlotAngle = Range::ROTATION;
    /// Offset of the slots' walls.
    SlotWall = Range::OFFSET;
    /// Offset of ring spaces.
    RingSpace = Range::OFFSET;
    /// Rotation of ring spaces.
    RingSpaceAngle = Range::ROTATION;
    /// Offset of the wave generator's lobes.
    WaveGeneratorLobe = Range::OFFSET;
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

impl Parameter {
    /// Returns the violation of the parameter's range by `value`, if there is one.
    pub fn check(self, value: f64) -> Option<Violation> {
        let limit = self.range().limit_exceeded_by(value)?;
        Some(Violation::OutOfRange { parameter: self, value, limit })
    }
}
