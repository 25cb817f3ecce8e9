//! Settings of the endpoints: input angles of a sweep, parts and assembly of drawings.

use serde::{Deserialize, Serialize};
use toothwave_solver::backing::Rim;
use toothwave_solver::fingers::Fingers;
use utoipa::ToSchema;

use super::number::Whole;
use super::strength::StrengthDocument;

/// The input angles of a sweep.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct SweepDocument {
    /// Number of equal intervals of one period; both ends are included. Default: 50, if `tolerance` is not given
    /// either.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, default = 50, required = false)]
    pub samples: Option<Whole>,
    /// Relative tolerance of the extremes of every force and stress, of wind-up, torsional stiffness and torque
    /// capacity. Use it instead of `samples`. Positions and half-widths are accurate to its square root, the
    /// transmission error to the tolerance times the wind-up. Input angles are placed where they are needed. The angle
    /// at which a tooth enters is listed twice, without and with that tooth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// True if the answer includes wind-up, torsional stiffness and backlash. Default: false.
    pub wind_up: bool,
}

/// Number of intervals in the paper.
pub(super) const DEFAULT_SAMPLES: Whole = Whole(50.0);

/// Settings of `/v1/accuracy`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct AccuracyDocument {
    /// Relative error of the peaks that the recommended settings must meet. Default: 1e-6.
    pub requested_error: f64,
}

impl Default for AccuracyDocument {
    fn default() -> Self {
        Self { requested_error: 1e-6 }
    }
}

/// The parts as manufactured. A part's clearance offsets its working surface into the part along the surface's normal.
/// The gap at a contact is the sum of its two parts' clearances, in drawings and forces alike.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct PartsDocument {
    /// The wave generator.
    pub wave_generator: WaveGeneratorPartDocument,
    /// The teeth.
    pub teeth: ToothPartDocument,
    /// The ring.
    pub ring: RingPartDocument,
    /// The carrier.
    pub carrier: CarrierPartDocument,
}

impl PartsDocument {
    /// Returns what a drawing reads: no supports, no strength.
    pub(super) fn drawn(mut self) -> Self {
        self.ring.rim = None;
        self.carrier =
            CarrierPartDocument { fingers: None, finger_fillet_radius_mm: None, strength: None, ..self.carrier };
        self
    }
}

/// The wave generator as manufactured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct WaveGeneratorPartDocument {
    /// Radius of its bore, in mm. Null or left out: no bore.
    #[serde(default, deserialize_with = "crate::json::or_null")]
    pub bore_radius_mm: Option<f64>,
    /// Inward offset of the cam, in µm. Default: 0 µm.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub clearance_um: f64,
}

/// The teeth as manufactured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ToothPartDocument {
    /// Reduction of their radius from `drive.teeth.radius_mm`, in µm. Default: 0 µm.
    pub clearance_um: f64,
}

/// The ring as manufactured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct RingPartDocument {
    /// Outer radius, in mm. Default: 1.2 times the largest radius of the tooth spaces. This is the root radius, unless
    /// a tip relief extends beyond it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outer_radius_mm: Option<f64>,
    /// Outward offset of the flank, in µm. A bored tip keeps its radius. Default: 0 µm.
    pub clearance_um: f64,
    /// Support of the ring's rim. A sweep estimates the compliance from it; drawings do not use it. Default: a rigid
    /// housing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rim: Option<Rim>,
}

/// The carrier as manufactured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct CarrierPartDocument {
    /// Inner radius, in mm. Default: one tenth of the annulus between cam and ring tips stays free inside. Slot walls
    /// support flat-sided teeth from this radius on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inner_radius_mm: Option<f64>,
    /// Outer radius, in mm. Default: one tenth of that annulus stays free outside. Slot walls support flat-sided teeth
    /// up to this radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outer_radius_mm: Option<f64>,
    /// Offset of each wall of a slot, in µm. Default: 0 µm.
    pub clearance_um: f64,
    /// Support of the fingers between the slots. A sweep calculates compliance and strength from it. If they are held at
    /// one end or in the middle, contact stresses are those at the place where the load along a tooth is largest.
    /// Default: a disc at one end, and a ring that joins the far ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fingers: Option<Fingers>,
    /// Radius of the fillet at the foot of a finger, in mm. Default: a tenth of the finger's thickness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finger_fillet_radius_mm: Option<f64>,
    /// Strength of the carrier's material: a name from `GET /v1/materials`, or numbers. With it a sweep calculates the
    /// safety of the fingers, which also limits the torque capacity. Default: no safety.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength: Option<StrengthDocument>,
}

/// Position of the parts in a drawing of the assembly.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct AssemblyDocument {
    /// Angle of the wave generator from the start position, in deg. At the start the middle of a lobe
    /// (the major axis of an ellipse) and tooth 0 are in the middle of a tooth space. Default: 0 deg.
    pub input_angle_deg: f64,
}
