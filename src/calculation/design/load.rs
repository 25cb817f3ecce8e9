//! Load.

use serde::{Deserialize, Serialize, Serializer};
use toothwave_solver::PerContact;
use toothwave_solver::fingers::LoadCycle;
use utoipa::ToSchema;
use utoipa::openapi::schema::{ObjectBuilder, Type};

use crate::either;

/// Load and allowable stress. The load is exactly one of: torque at the wave generator, torque at the carrier, or duty;
/// ring fixed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct LoadDocument {
    /// Torque M0 at the wave generator, in N·m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, in N·m, without losses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output_torque_nm: Option<f64>,
    /// Allowable contact stress, in MPa, for the torque capacity. A finding reports if it is exceeded. Default: no
    /// torque capacity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowable_stress_mpa: Option<AllowableStressDocument>,
    /// Speed of the wave generator, in 1/min. With `friction` it gives powers and sliding speeds. The points of a duty
    /// have their own speeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_speed_rpm: Option<f64>,
    /// Course of the load on the carrier's fingers, for their fatigue. Default: pulsating.
    #[serde(default)]
    pub cycle: LoadCycle,
    /// Load spectrum: one to 100 loads, whose shares of the running time add up to one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duty: Option<Vec<DutyPointDocument>>,
}

/// One load of a duty: exactly one torque, a speed, and a share of the running time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DutyPointDocument {
    /// Torque M0 at the wave generator, in N·m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, in N·m, without losses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output_torque_nm: Option<f64>,
    /// Speed of the wave generator, in 1/min.
    pub input_speed_rpm: f64,
    /// Share of the running time, from 0 to 1.
    pub share_of_time: f64,
}

/// Allowable contact stress, in MPa: one number for all contacts, or one for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllowableStressDocument(pub PerContact<f64>);

/// Writes one number for three equal ones.
impl Serialize for AllowableStressDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(PerContact { wave_generator, ring, carrier }) = self;
        let is_one = [ring, carrier].iter().all(|stress_mpa| stress_mpa.total_cmp(wave_generator).is_eq());
        if is_one { ring.serialize(serializer) } else { self.0.serialize(serializer) }
    }
}

/// Stress for each contact, in MPa.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
struct StressByContactDocument {
    /// Between teeth and wave generator, in MPa.
    wave_generator: f64,
    /// Between teeth and ring, in MPa.
    ring: f64,
    /// Between teeth and carrier, in MPa.
    carrier: f64,
}

either! {
    AllowableStressDocument as "AllowableStress" (
        "Allowable contact stress, in MPa: one number for all contacts, or one for each.",
        ObjectBuilder::new().schema_type(Type::Number)
    ) expects "a number, or an object with one for each contact":
    visit_f64(stress_mpa: f64) => Ok(AllowableStressDocument(PerContact::of(|_| stress_mpa))),
    StressByContactDocument => |StressByContactDocument { wave_generator, ring, carrier }| {
        AllowableStressDocument(PerContact { wave_generator, ring, carrier })
    },
}
