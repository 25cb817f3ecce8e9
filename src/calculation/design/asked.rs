//! What is asked of the answers: where a sweep looks, how fine a profile is, what is drawn.

use serde::{Deserialize, Serialize};
use toothwave_solver::backing::{Fingers, Rim};
use utoipa::ToSchema;

use super::number::{Whole, given};
use crate::key::{Encode, Encoder, encoded};

/// The input angles of a sweep.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct SweepDocument {
    /// Equal intervals of one period; both ends are included. 50 where neither this nor `tolerance` is given.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, minimum = 1, maximum = 10000000, default = 50, required = false)]
    pub samples: Option<Whole>,
    /// Instead of `samples`: the true extremes to this relative tolerance, of every force and stress, of wind-up, torsional stiffness and torque
    /// capacity. Places and half-widths are known to its root, the transmission error to the tolerance times the wind-up. Input angles are
    /// placed where they are needed, and the instant at which a tooth enters twice, without it and with it.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 0.1, nullable = false)]
    pub tolerance: Option<f64>,
    /// Whether wind-up and torsional stiffness are wanted too.
    #[serde(default)]
    #[schema(default = false)]
    pub wind_up: bool,
}

/// The paper's number of intervals.
pub(super) const DEFAULT_SAMPLES: Whole = Whole(50.0);

/// The sampling of profiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ProfileDocument {
    /// How far a chord may be from its curve.
    #[schema(minimum = 1e-6, maximum = 1e6, default = 0.001)]
    pub chord_tolerance_mm: f64,
    /// How much of the ring.
    pub extent: ExtentDocument,
}

impl Default for ProfileDocument {
    fn default() -> Self {
        Self { chord_tolerance_mm: 1e-3, extent: ExtentDocument::default() }
    }
}

/// What is asked of `/v1/accuracy`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct AccuracyDocument {
    /// The relative error of the peaks that the cheapest way has to meet.
    #[schema(minimum = 1e-12, maximum = 1.0, default = 1e-6)]
    pub requested_error: f64,
}

impl Default for AccuracyDocument {
    fn default() -> Self {
        Self { requested_error: 1e-6 }
    }
}

/// How much of the ring.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExtentDocument {
    /// From one tooth's symmetry line to the next, so that copies join.
    #[default]
    Tooth,
    /// The closed ring, its last point equal to its first.
    Full,
}

/// The parts as they are made. A part's clearance sets its working surface back into the part along the surface's normal; the
/// gap at a contact is the sum of its two parts' clearances, in drawings and forces alike.
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
    /// What of them a load's answer depends on: gaps, and what stands behind the contacts.
    pub(crate) fn under_load(&self) -> impl Encode + '_ {
        let Self { wave_generator, teeth, ring, carrier } = self;
        (wave_generator, teeth, ring, ring.rim, carrier, carrier.fingers)
    }
}

/// The wave generator as it is made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct WaveGeneratorPartDocument {
    /// Radius of its bore; null or left out, it has none.
    #[serde(default)]
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub bore_radius_mm: Option<f64>,
    /// How far the cam is set back inward.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub clearance_um: f64,
}

/// The teeth as they are made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ToothPartDocument {
    /// How much smaller their radius is than `drive.teeth.radius_mm`.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub clearance_um: f64,
}

/// The ring as it is made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct RingPartDocument {
    /// Outer radius; left out, 1.2 times the largest radius of the tooth spaces, that of the root but for a tip relief that reaches beyond it.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub outer_radius_mm: Option<f64>,
    /// How far the flank is set back outward; a bored tip stays where it is.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub clearance_um: f64,
    /// What stands around its rim; a sweep says what gives way so, drawings do not read it. Left out, findings take it as housed.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub rim: Option<RimDocument>,
}

/// What stands around the ring's rim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RimDocument {
    /// A rigid housing.
    Housed,
    /// Nothing: it is kept from turning alone.
    Free,
}

/// What joins the carrier's fingers beside the teeth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FingersDocument {
    /// A disc at either end.
    HeldAtBothEnds,
    /// A disc at one end.
    HeldAtOneEnd,
}

/// The carrier as it is made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct CarrierPartDocument {
    /// Inner radius; left out, a tenth of the annulus between cam and ring tips is left free inside. Flat-sided teeth are borne from here.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub inner_radius_mm: Option<f64>,
    /// Outer radius; left out, a tenth of that annulus is left free outside. Flat-sided teeth are borne up to here.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub outer_radius_mm: Option<f64>,
    /// How far each wall of a slot is set back.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub clearance_um: f64,
    /// What joins the fingers between its slots beside the teeth; a sweep says what gives way so, drawings do not read it. Left out, findings take
    /// them as held at both ends.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub fingers: Option<FingersDocument>,
}

/// How the parts stand in a drawing of all of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct AssemblyDocument {
    /// Angle of the wave generator from the start position, in which the middle of a lobe, the major axis of an ellipse, and tooth 0 stand in the middle of a tooth space.
    #[schema(minimum = -1e7, maximum = 1e7, default = 0.0)]
    pub input_angle_deg: f64,
}

encoded! {
    struct SweepDocument { samples, tolerance, wind_up }
    struct ProfileDocument { chord_tolerance_mm, extent }
    struct AccuracyDocument { requested_error }
    struct PartsDocument { wave_generator, teeth, ring, carrier }
    struct WaveGeneratorPartDocument { bore_radius_mm, clearance_um }
    struct ToothPartDocument { clearance_um }
    struct AssemblyDocument { input_angle_deg }
}

encoded!(enum ExtentDocument);
encoded!(enum RimDocument);
encoded!(enum FingersDocument);

/// Without what holds the part, which drawings do not read: whoever does names it beside.
impl Encode for RingPartDocument {
    fn encode(&self, encoder: &mut Encoder) {
        let Self { outer_radius_mm, clearance_um, rim: _ } = self;
        (outer_radius_mm, clearance_um).encode(encoder);
    }
}

/// Without what holds the part, as above.
impl Encode for CarrierPartDocument {
    fn encode(&self, encoder: &mut Encoder) {
        let Self { inner_radius_mm, outer_radius_mm, clearance_um, fingers: _ } = self;
        (inner_radius_mm, outer_radius_mm, clearance_um).encode(encoder);
    }
}

impl From<RimDocument> for Rim {
    fn from(rim: RimDocument) -> Self {
        match rim {
            RimDocument::Housed => Self::Housed,
            RimDocument::Free => Self::Free,
        }
    }
}

impl From<FingersDocument> for Fingers {
    fn from(fingers: FingersDocument) -> Self {
        match fingers {
            FingersDocument::HeldAtBothEnds => Self::HeldAtBothEnds,
            FingersDocument::HeldAtOneEnd => Self::HeldAtOneEnd,
        }
    }
}
