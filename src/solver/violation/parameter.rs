//! The table of the parameters: range, unit and field of each. Checks, messages and the API document read it.

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

/// Makes an enum of lines `Name = range, "place in the design document";`, with `Name(of: Kind)` for each part, contact
/// or item.
macro_rules! table {
    (@each $name:ident) => { vec![Self::$name] };
    (@each $name:ident, $kind:ty) => { <$kind>::all().into_iter().map(Self::$name).collect() };
    (@each $name:ident, $kind:ty, $entry:ty) => {
        <$kind>::all().into_iter().map(|of| Self::$name(of, 0)).collect()
    };
    (
        $(#[$about:meta])* $table:ident:
        $(
            $(#[$doc:meta])*
            $name:ident $(($of:ident: $kind:ty $(, $at:ident: $entry:ty)?))? = $range:expr, $path:literal;
        )+
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $table {
            $(#[doc = concat!("`", $path, "`")] #[doc = ""] $(#[$doc])* $name $(($kind $(, $entry)?))?),+
        }

        impl $table {
            /// Returns the range and the unit.
            #[allow(unused_variables, reason = "most ranges are the same for all parts")]
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

        /// Writes the place in the design document.
        impl std::fmt::Display for $table {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Self::$name $(($of $(, $at)?))? => write!(f, $path)),+
                }
            }
        }
    };
}

table! {
    /// Parameter to which a violation can refer. Its text is the JSON pointer of its field.
    Parameter:
    SemiMajor = Range::LENGTH, "/drive/wave_generator/semi_major_mm";
    SemiMinor = Range::LENGTH, "/drive/wave_generator/semi_minor_mm";
    EccentricRadius = Range::LENGTH, "/drive/wave_generator/radius_mm";
    Eccentricity = Range::LENGTH, "/drive/wave_generator/eccentricity_mm";
    Lobes = Range::closed(1.0, MAX_LOBES as f64, ""), "/drive/wave_generator/lobes";
    /// Of a harmonic support function, of which one lobe is an eccentric circle.
    HarmonicLobes = Range::closed(2.0, MAX_LOBES as f64, ""), "/drive/wave_generator/lobes";
    MeanRadius = Range::LENGTH, "/drive/wave_generator/mean_radius_mm";
    MeanPathRadius = Range::LENGTH, "/drive/wave_generator/mean_path_radius_mm";
    Amplitude = Range::LENGTH, "/drive/wave_generator/amplitude_mm";
    ToothCount = Range::TEETH, "/drive/teeth/count";
    InstalledTeeth = Range::TEETH, "/drive/teeth/installed";
    ToothRadius = Range::LENGTH, "/drive/teeth/radius_mm";
    ToothWidth = Range::LENGTH, "/drive/teeth/width_mm";
    GrooveRadius(of: Contact) = Range::LENGTH, "/drive/teeth/groove_radius_mm/{of}";
    FlatLength = Range::LENGTH, "/drive/teeth/flat_length_mm";
    RingTeeth = Range::TEETH, "/drive/ring/teeth";
    TipRadius = Range::LENGTH, "/drive/ring/tip_radius_mm";
    YoungsModulus(of: Part) = Range::closed(1e-3, 1e5, "GPa"), "/materials/{of}/youngs_modulus_gpa";
    PoissonsRatio(of: Part) = Range { low: -1.0, high: 0.5, closed: false, unit: "" }, "/materials/{of}/poissons_ratio";
    InputTorque = Range::TORQUE, "/load/input_torque_nm";
    OutputTorque = Range::TORQUE, "/load/output_torque_nm";
    Stiffness(of: Contact) = Range::closed(1e-3, 1e15, "N/mm"), "/model/stiffness/{of}_n_per_mm";
    Law = Range::NONE, "/model/stiffness/law";
    RingTeethBend = Range::NONE, "/model/refinements";
    WaveGeneratorMoves = Range::NONE, "/model/refinements";
    CornerContact = Range::NONE, "/model/refinements";
    Depth(of: Contact) = Range::LENGTH, "/model/stiffness/depth_mm/{of}";
    /// As soft as the least stiffness, or zero.
    SeriesCompliance(of: Contact) = Range::closed(0.0, 1e3, "mm/N"), "/model/series_compliance_mm_per_n/{of}";
    Clearance(of: Contact) = Range::GAP, "/model/clearance/{of}_um";
    Modification(of: Modified) = of.range(), "/modification/{of}";
    Deviations = Range::NONE, "/deviations";
    DeviationList(of: Listed) = Range::NONE, "/deviations/{of}";
    /// Counted from 0.
    Deviation(of: Listed, at: usize) = of.range(), "/deviations/{of}/{at}";
    RunoutAmount(of: Contact) = Range::GAP, "/deviations/{of}_runout/amount_um";
    RunoutAngle(of: Contact) = Range::closed(-360.0, 360.0, "deg"), "/deviations/{of}_runout/angle_deg";
    /// Of all contacts.
    AllowableStress = Range::STRESS, "/load/allowable_stress_mpa";
    AllowableStressAt(of: Contact) = Range::STRESS, "/load/allowable_stress_mpa/{of}";
    InputSpeed = Range::SPEED, "/load/input_speed_rpm";
    /// Counted from 0.
    Duty(of: OfDutyPoint, at: usize) = of.range(), "/load/duty/{at}/{of}";
    /// Number of points.
    DutyPoints = Range::closed(1.0, MAX_DUTY_POINTS as f64, ""), "/load/duty";
    FrictionCoefficient(of: Contact) = Range::FRICTION, "/friction/{of}/coefficient";
    BearingCoefficient = Range::FRICTION, "/friction/wave_generator/bearing_coefficient";
    BearingRadius = Range::LENGTH, "/friction/wave_generator/bearing_radius_mm";
    BearingLoadRating = Range::closed(1e-3, 1e12, "N"), "/friction/wave_generator/bearing_load_rating_n";
    WearRate(of: Contact) = Range::closed(0.0, 1e3, "mm³/(N·m)"), "/friction/wear_rate_mm3_per_nm/{of}";
    Samples = Range::closed(1.0, MAX_SAMPLES as f64, ""), "/sweep/samples";
    SweepTolerance = Range::closed(1e-12, 0.1, ""), "/sweep/tolerance";
    RequestedError = Range::closed(1e-12, 1.0, ""), "/accuracy/requested_error";
    ChordTolerance = Range::LENGTH, "/profile/chord_tolerance_mm";
    RingOuterRadius = Range::LENGTH, "/parts/ring/outer_radius_mm";
    CarrierInnerRadius = Range::LENGTH, "/parts/carrier/inner_radius_mm";
    CarrierOuterRadius = Range::LENGTH, "/parts/carrier/outer_radius_mm";
    FingerFilletRadius = Range::LENGTH, "/parts/carrier/finger_fillet_radius_mm";
    YieldStrength = Range::STRESS, "/parts/carrier/strength/yield_strength_mpa";
    TensileStrength = Range::STRESS, "/parts/carrier/strength/tensile_strength_mpa";
    EnduranceLimit = Range::STRESS, "/parts/carrier/strength/endurance_limit_mpa";
    BoreRadius = Range::LENGTH, "/parts/wave_generator/bore_radius_mm";
    PartClearance(of: Part) = Range::GAP, "/parts/{of}/clearance_um";
    /// At the ends the rounding of the angle is 2e-9 deg.
    InputAngle = Range::closed(-1e7, 1e7, "deg"), "/assembly/input_angle_deg";
}

table! {
    /// Value of a point of a duty.
    OfDutyPoint:
    InputTorque = Range::TORQUE, "input_torque_nm";
    OutputTorque = Range::TORQUE, "output_torque_nm";
    InputSpeed = Range::SPEED, "input_speed_rpm";
    ShareOfTime = Range::closed(1e-9, 1.0, ""), "share_of_time";
}

table! {
    /// Value of a modification.
    Modified:
    RingEquidistant = Range::OFFSET, "ring_equidistant_um";
    RingPathShift = Range::OFFSET, "ring_path_shift_um";
    RingProfileShift = Range::OFFSET, "ring_profile_shift_um";
    RingRotation = Range::ROTATION, "ring_rotation_arcsec";
    WaveGeneratorEquidistant = Range::OFFSET, "wave_generator_equidistant_um";
    SlotWall = Range::OFFSET, "slot_wall_um";
    CarrierRotation = Range::ROTATION, "carrier_rotation_arcsec";
    ToothRadius = Range::OFFSET, "tooth_radius_um";
    TipReliefAmount = Range::OFFSET, "ring_tip_relief/amount_um";
    /// A single lobe has its valley at 180 deg.
    TipReliefStart = Range::closed(0.0, 180.0, "deg"), "ring_tip_relief/start_deg";
    TipReliefPower = Range::closed(0.1, 100.0, ""), "ring_tip_relief/power";
}

table! {
    /// List of deviations.
    Listed:
    ToothRadius = Range::OFFSET, "tooth_radius_um";
    SlotAngle = Range::ROTATION, "slot_angle_arcsec";
    SlotWall = Range::OFFSET, "slot_wall_um";
    RingSpace = Range::OFFSET, "ring_space_um";
    RingSpaceAngle = Range::ROTATION, "ring_space_angle_arcsec";
    WaveGeneratorLobe = Range::OFFSET, "wave_generator_lobe_um";
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
        Some(Violation::out_of_range(self, value, limit))
    }
}
