//! The design document: wire types, and their one conversion into the solver's.
//!
//! A document that is written as JSON reads back as itself.

use std::borrow::Cow;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toothwave_solver::Contact;
use toothwave_solver::drawing::DrawingParameters;
use toothwave_solver::parts::PartsParameters;
use toothwave_solver::profile::{Extent, ProfileParameters};
use toothwave_solver::sweep::Points;
use toothwave_solver::violation::Range;
use toothwave_solver::{
    Compatibility, ContactLaw, DriveParameters, LoadParameters, Material, Materials, Modification, Parameter,
    PerContact, ToothShape, Torque, Violation, WaveGenerator,
};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::{PartialSchema, ToSchema};

use crate::field::FieldCode;
use crate::json::{self, Fault};
use crate::key::{Encode, Encoder, encoded};
use crate::no_answer::NoAnswer;

/// One document for every endpoint: each reads only what it needs. Lengths in mm, torques in N·m, moduli in GPa, stiffnesses in N/mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
#[schema(example = json!({
    "drive": {
        "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
        "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
        "ring": { "teeth": 26 }
    },
    "load": { "input_torque_nm": 20.0 }
}))]
pub struct Design {
    /// The drive itself.
    pub drive: DriveDocument,
    /// Materials by part; steel where left out.
    #[serde(default)]
    pub materials: MaterialsDocument,
    /// The load; only a sweep needs it.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub load: Option<LoadDocument>,
    /// The model of load sharing.
    #[serde(default)]
    pub model: ModelDocument,
    /// The input angles of a sweep.
    #[serde(default)]
    pub sweep: SweepDocument,
    /// The sampling of profiles.
    #[serde(default)]
    pub profile: ProfileDocument,
    /// What is asked of `/v1/accuracy`.
    #[serde(default)]
    pub accuracy: AccuracyDocument,
    /// The parts as they are made: what the mechanics leave free. Only drawings read it.
    #[serde(default)]
    pub parts: PartsDocument,
    /// How the parts stand in a drawing of all of them.
    #[serde(default)]
    pub assembly: AssemblyDocument,
}

/// Wave generator, teeth and ring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DriveDocument {
    /// The elliptic cam.
    pub wave_generator: WaveGeneratorDocument,
    /// The discrete teeth.
    pub teeth: TeethDocument,
    /// The rigid internal wheel.
    pub ring: RingDocument,
}

/// The elliptic cam; `semi_major_mm` exceeds `semi_minor_mm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct WaveGeneratorDocument {
    /// Semi-major axis a.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub semi_major_mm: f64,
    /// Semi-minor axis b.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub semi_minor_mm: f64,
}

/// The discrete teeth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct TeethDocument {
    /// Teeth in theory, Z_G: two more or two fewer than the ring's.
    #[schema(value_type = i64, minimum = 2, maximum = 10000)]
    pub count: Whole,
    /// Installed teeth Z'_G, an even divisor of `count`; only they have a slot. Left out: `count`.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, minimum = 2, maximum = 10000, required = false)]
    pub installed: Option<Whole>,
    /// Radius r of a tooth.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub radius_mm: f64,
    /// Width L1 of a tooth along the axis.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub width_mm: f64,
}

/// The rigid internal wheel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct RingDocument {
    /// Teeth Z_K: two fewer or two more than the carrier's.
    #[schema(value_type = i64, minimum = 2, maximum = 10000)]
    pub teeth: Whole,
    /// Radius of a bore that truncates the teeth; null or left out, the ring keeps its natural tip.
    #[serde(default)]
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub tip_radius_mm: Option<f64>,
}

/// Materials by part.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct MaterialsDocument {
    /// Of the wave generator.
    pub wave_generator: MaterialDocument,
    /// Of the teeth.
    pub teeth: MaterialDocument,
    /// Of the ring.
    pub ring: MaterialDocument,
    /// Of the carrier.
    pub carrier: MaterialDocument,
}

/// An isotropic elastic material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct MaterialDocument {
    /// Young's modulus E.
    #[schema(minimum = 1e-3, maximum = 1e5, default = 210.0)]
    pub youngs_modulus_gpa: f64,
    /// Poisson's ratio ν.
    #[schema(exclusive_minimum = -1.0, exclusive_maximum = 0.5, default = 0.3)]
    pub poissons_ratio: f64,
}

impl Default for MaterialDocument {
    fn default() -> Self {
        let Material { youngs_modulus_gpa, poissons_ratio } = Material::STEEL;
        Self { youngs_modulus_gpa, poissons_ratio }
    }
}

/// The torque: exactly one of the two, at the wave generator or at the carrier, ring fixed; and the stress that may be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct LoadDocument {
    /// Torque M0 at the wave generator.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 1e15, nullable = false)]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, losses neglected.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 1e15, nullable = false)]
    pub output_torque_nm: Option<f64>,
    /// The contact stress that the torque capacity is asked for.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-3, maximum = 1e6, nullable = false)]
    pub allowable_stress_mpa: Option<f64>,
}

/// The model of load sharing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ModelDocument {
    /// How the approaches at a tooth's contacts add up.
    #[serde(default)]
    pub compatibility: CompatibilityDocument,
    /// The contact law.
    #[serde(default)]
    pub stiffness: StiffnessDocument,
    /// Gaps at the contacts; left out, there are none.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub clearance: Option<ClearanceDocument>,
}

/// Uniform gaps along the normals: a tooth carries load only where they are closed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ClearanceDocument {
    /// At the wave generator.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub wave_generator_um: f64,
    /// At the ring.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub ring_um: f64,
    /// At the carrier.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub carrier_um: f64,
}

/// How the approaches at a tooth's contacts add up to the rotation of the wave generator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CompatibilityDocument {
    /// The paper's: each projected on the direction of the wave generator's force.
    #[default]
    Projection,
    /// Virtual work: the frictionless solution for a tooth whose centre is free to move.
    VirtualWork,
}

/// The contact law.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum StiffnessDocument {
    /// `k = π L1 E*/2` at each contact.
    #[default]
    Linear,
    /// Given stiffnesses.
    Fixed {
        /// At the wave generator.
        wave_generator_n_per_mm: f64,
        /// At the ring.
        ring_n_per_mm: f64,
        /// At the carrier.
        carrier_n_per_mm: f64,
    },
    /// Palmgren's `δ = 3.84e-5 F^0.9/L^0.8`, steel on steel.
    Palmgren,
}

/// Written out, because a derived one could neither leave the default law out nor refuse what a law does not know.
impl PartialSchema for StiffnessDocument {
    fn schema() -> RefOr<Schema> {
        let law = |word: &str, description: &str| {
            ObjectBuilder::new()
                .additional_properties(Some(AdditionalProperties::FreeForm(false)))
                .description(Some(description))
                .property("law", ObjectBuilder::new().schema_type(Type::String).enum_values(Some([word])))
        };
        let Range { low, high, .. } = Parameter::Stiffness(Contact::Ring).range();
        let fixed = ["wave_generator", "ring", "carrier"].iter().fold(
            law("fixed", "Given stiffnesses at the wave generator, the ring and the carrier.").required("law"),
            |schema, contact| {
                let name = format!("{contact}_n_per_mm");
                let stiffness = ObjectBuilder::new().schema_type(Type::Number).minimum(Some(low)).maximum(Some(high));
                schema.property(&name, stiffness).required(name)
            },
        );
        let linear = law("linear", "k = π L1 E*/2 at each contact; what is used where no law is named.");
        let palmgren = law("palmgren", "Palmgren's δ = 3.84e-5 F^0.9/L1^0.8 (N, mm), steel on steel.").required("law");
        OneOfBuilder::new().description(Some("The contact law.")).item(linear).item(fixed).item(palmgren).into()
    }
}

impl ToSchema for StiffnessDocument {
    fn name() -> Cow<'static, str> {
        "StiffnessDocument".into()
    }
}

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
const DEFAULT_SAMPLES: Whole = Whole(50.0);

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

/// The parts as they are made. A part's clearance sets its working surface back into the part along the surface's normal; the
/// gap at a contact is the sum of its two parts' clearances. Forces are computed with the gaps of `model.clearance`, not with these.
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
    /// Outer radius; left out, 1.2 times the root radius.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub outer_radius_mm: Option<f64>,
    /// How far the flank is set back outward; a bored tip stays where it is.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub clearance_um: f64,
}

/// The carrier as it is made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct CarrierPartDocument {
    /// Inner radius; left out, a tenth of the annulus between cam and ring tips is left free inside.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub inner_radius_mm: Option<f64>,
    /// Outer radius; left out, a tenth of that annulus is left free outside.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub outer_radius_mm: Option<f64>,
    /// How far each wall of a slot is set back.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub clearance_um: f64,
}

/// How the parts stand in a drawing of all of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct AssemblyDocument {
    /// Angle of the wave generator from the start position, in which its major axis and tooth 0 stand in the middle of a tooth space.
    #[schema(minimum = -1e7, maximum = 1e7, default = 0.0)]
    pub input_angle_deg: f64,
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

/// A whole number of any size, spelled `28`, `28.0` or `2.8e1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whole(f64);

/// Without a point, as far as every reader can tell whole numbers apart.
impl Serialize for Whole {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        const MOST: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
        if self.0.abs() <= MOST { serializer.serialize_i64(self.count()) } else { serializer.serialize_f64(self.0) }
    }
}

impl Whole {
    /// As the solver counts; what lies beyond that lies beyond every range too.
    #[expect(clippy::cast_possible_truncation, reason = "whole, and saturating")]
    const fn count(self) -> i64 {
        self.0 as i64
    }
}

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = f64::deserialize(deserializer)?;
        if value.fract() == 0.0 {
            Ok(Self(value))
        } else {
            let message = format_args!("a whole number is wanted here, not {value}").to_string();
            Err(serde::de::Error::custom(message))
        }
    }
}

/// For fields that may be left out but not be null.
fn given<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

impl<'de> Deserialize<'de> for StiffnessDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;

        #[derive(Default, Deserialize)]
        #[serde(rename_all = "snake_case")]
        enum Law {
            #[default]
            Linear,
            Fixed,
            Palmgren,
        }

        #[derive(Deserialize)]
        #[serde(deny_unknown_fields, expecting = "an object")]
        struct Fields {
            #[serde(default)]
            law: Law,
            #[serde(default, deserialize_with = "given")]
            wave_generator_n_per_mm: Option<f64>,
            #[serde(default, deserialize_with = "given")]
            ring_n_per_mm: Option<f64>,
            #[serde(default, deserialize_with = "given")]
            carrier_n_per_mm: Option<f64>,
        }

        let fields = Fields::deserialize(deserializer)?;
        let stiffnesses = [
            ("wave_generator_n_per_mm", fields.wave_generator_n_per_mm),
            ("ring_n_per_mm", fields.ring_n_per_mm),
            ("carrier_n_per_mm", fields.carrier_n_per_mm),
        ];
        match fields.law {
            Law::Linear | Law::Palmgren => match stiffnesses.iter().find(|(_, stiffness)| stiffness.is_some()) {
                Some((name, _)) => {
                    Err(D::Error::unknown_field(name, &["law", "by default `linear`; stiffnesses belong to `fixed`"]))
                }
                None if matches!(fields.law, Law::Palmgren) => Ok(Self::Palmgren),
                None => Ok(Self::Linear),
            },
            Law::Fixed => {
                let required = |index: usize| {
                    let (name, stiffness) = stiffnesses[index];
                    stiffness.ok_or_else(|| D::Error::missing_field(name))
                };
                Ok(Self::Fixed {
                    wave_generator_n_per_mm: required(0)?,
                    ring_n_per_mm: required(1)?,
                    carrier_n_per_mm: required(2)?,
                })
            }
        }
    }
}

encoded! {
    struct DriveDocument { wave_generator, teeth, ring }
    struct WaveGeneratorDocument { semi_major_mm, semi_minor_mm }
    struct RingDocument { teeth, tip_radius_mm }
    struct MaterialsDocument { wave_generator, teeth, ring, carrier }
    struct MaterialDocument { youngs_modulus_gpa, poissons_ratio }
    struct LoadDocument { input_torque_nm, output_torque_nm, allowable_stress_mpa }
    struct ModelDocument { compatibility, stiffness, clearance }
    struct ClearanceDocument { wave_generator_um, ring_um, carrier_um }
    struct SweepDocument { samples, tolerance, wind_up }
    struct ProfileDocument { chord_tolerance_mm, extent }
    struct AccuracyDocument { requested_error }
    struct PartsDocument { wave_generator, teeth, ring, carrier }
    struct WaveGeneratorPartDocument { bore_radius_mm, clearance_um }
    struct ToothPartDocument { clearance_um }
    struct RingPartDocument { outer_radius_mm, clearance_um }
    struct CarrierPartDocument { inner_radius_mm, outer_radius_mm, clearance_um }
    struct AssemblyDocument { input_angle_deg }
}

encoded!(enum CompatibilityDocument enum ExtentDocument);

impl Encode for Whole {
    fn encode(&self, encoder: &mut Encoder) {
        self.0.encode(encoder);
    }
}

/// With `installed` filled in. The document itself keeps whether it stands there, so that no fault is blamed on a field that does not.
impl Encode for TeethDocument {
    fn encode(&self, encoder: &mut Encoder) {
        let Self { count, installed, radius_mm, width_mm } = self;
        (count, installed.unwrap_or(*count), radius_mm, width_mm).encode(encoder);
    }
}

impl Encode for StiffnessDocument {
    fn encode(&self, encoder: &mut Encoder) {
        match self {
            Self::Linear => "linear".encode(encoder),
            Self::Fixed { wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm } => {
                ("fixed", wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm).encode(encoder);
            }
            Self::Palmgren => "palmgren".encode(encoder),
        }
    }
}

impl Design {
    /// The document that a text holds, normalised.
    ///
    /// # Errors
    /// Where it holds none: the first structural fault.
    pub fn read(text: &[u8]) -> Result<Self, NoAnswer> {
        Ok(json::read::<Self>(text)?.normalised())
    }

    /// The document with what may be left out filled in and zeros of one sign, so that equal designs are equal bytes.
    pub fn normalised(mut self) -> Self {
        if self.sweep.tolerance.is_none() {
            self.sweep.samples.get_or_insert(DEFAULT_SAMPLES);
        }
        if let Some(clearance) = &mut self.model.clearance {
            for gap in [&mut clearance.wave_generator_um, &mut clearance.ring_um, &mut clearance.carrier_um] {
                *gap += 0.0;
            }
        }
        let PartsDocument { wave_generator, teeth, ring, carrier } = &mut self.parts;
        let clearances = [
            &mut wave_generator.clearance_um,
            &mut teeth.clearance_um,
            &mut ring.clearance_um,
            &mut carrier.clearance_um,
        ];
        for zero in clearances.into_iter().chain([&mut self.assembly.input_angle_deg]) {
            *zero += 0.0;
        }
        let materials = &mut self.materials;
        for material in
            [&mut materials.wave_generator, &mut materials.teeth, &mut materials.ring, &mut materials.carrier]
        {
            material.poissons_ratio += 0.0;
        }
        self
    }

    /// The drive's parameters.
    pub fn drive_parameters(&self) -> DriveParameters {
        let DriveDocument { wave_generator, teeth, ring } = &self.drive;
        DriveParameters {
            wave_generator: WaveGenerator::Ellipse {
                semi_major_mm: wave_generator.semi_major_mm,
                semi_minor_mm: wave_generator.semi_minor_mm,
            },
            teeth: teeth.count.count(),
            installed: teeth.installed.unwrap_or(teeth.count).count(),
            tooth_radius_mm: teeth.radius_mm,
            tooth: ToothShape::Cylinder { width_mm: teeth.width_mm },
            ring_teeth: ring.teeth.count(),
            tip_radius_mm: ring.tip_radius_mm,
        }
    }

    /// Violations with the numbers that stand in the document, where the solver's count could not hold them; without those of `installed`
    /// where it does not stand there: they are faults of `count`, which has them too.
    pub fn as_written(&self, violations: &[Violation]) -> Vec<Violation> {
        let TeethDocument { count, installed, .. } = self.drive.teeth;
        let as_written = |&violation: &Violation| match violation {
            Violation::OutOfRange { parameter: Parameter::InstalledTeeth, .. } if installed.is_none() => None,
            Violation::OutOfRange { parameter, limit, value } => {
                let value = match parameter {
                    Parameter::ToothCount => count.0,
                    Parameter::InstalledTeeth => installed.unwrap_or(count).0,
                    Parameter::RingTeeth => self.drive.ring.teeth.0,
                    _ => value,
                };
                Some(Violation::OutOfRange { parameter, value, limit })
            }
            other => Some(other),
        };
        violations.iter().filter_map(as_written).collect()
    }

    /// The load's parameters.
    ///
    /// # Errors
    /// A fault where the document has no load, or not exactly one torque.
    pub fn load_parameters(&self) -> Result<LoadParameters, Fault> {
        let load = self.load.as_ref().ok_or_else(|| {
            let detail = "forces need a load: give `load` an `input_torque_nm` or an `output_torque_nm`";
            Fault::of_field(FieldCode::MissingField, "load", detail.into())
        })?;
        let torque = match (load.input_torque_nm, load.output_torque_nm) {
            (Some(torque_nm), None) => Torque::Input(torque_nm),
            (None, Some(torque_nm)) => Torque::Output(torque_nm),
            (given, _) => {
                let code = if given.is_some() { FieldCode::ConflictingFields } else { FieldCode::MissingField };
                let detail = match given {
                    Some(_) => "only one of `input_torque_nm` and `output_torque_nm` may stand here",
                    None => "`input_torque_nm` or `output_torque_nm` is required here",
                };
                return Err(Fault::of_field(code, "load", detail.into()));
            }
        };
        let material = |document: &MaterialDocument| Material {
            youngs_modulus_gpa: document.youngs_modulus_gpa,
            poissons_ratio: document.poissons_ratio,
        };
        let compatibility = match self.model.compatibility {
            CompatibilityDocument::Projection => Compatibility::Projection,
            CompatibilityDocument::VirtualWork => Compatibility::VirtualWork,
        };
        let law = match self.model.stiffness {
            StiffnessDocument::Linear => ContactLaw::Linear,
            StiffnessDocument::Palmgren => ContactLaw::Palmgren,
            StiffnessDocument::Fixed { wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm } => {
                ContactLaw::Fixed(PerContact {
                    wave_generator: wave_generator_n_per_mm,
                    ring: ring_n_per_mm,
                    carrier: carrier_n_per_mm,
                })
            }
        };
        Ok(LoadParameters {
            materials: Materials {
                wave_generator: material(&self.materials.wave_generator),
                teeth: material(&self.materials.teeth),
                ring: material(&self.materials.ring),
                carrier: material(&self.materials.carrier),
            },
            torque,
            compatibility,
            law,
            series_compliance_mm_per_n: PerContact::default(),
            clearance_um: self.model.clearance.as_ref().map_or_else(PerContact::default, |clearance| PerContact {
                wave_generator: clearance.wave_generator_um,
                ring: clearance.ring_um,
                carrier: clearance.carrier_um,
            }),
            modification: Modification::default(),
            allowable_stress_mpa: load.allowable_stress_mpa,
        })
    }

    /// Where a sweep looks.
    ///
    /// # Errors
    /// A fault where the document wants samples and a tolerance; inside, the violation of a range.
    pub fn sweep_points(&self, max_states: u64) -> Result<Result<Points, Violation>, Fault> {
        let SweepDocument { samples, tolerance, .. } = self.sweep;
        match (samples, tolerance) {
            (Some(_), Some(_)) => {
                let detail = "at most one of `samples` and `tolerance` is wanted here";
                Err(Fault::of_field(FieldCode::ConflictingFields, "sweep", detail.into()))
            }
            (None, Some(tolerance)) => Ok(Points::tolerance(tolerance, max_states)),
            (samples, None) => {
                let samples = samples.unwrap_or(DEFAULT_SAMPLES);
                let violation = Parameter::Samples.check(samples.0);
                Ok(violation.map_or_else(|| Points::samples(samples.count().unsigned_abs()), Err))
            }
        }
    }

    /// The relative error that is asked for.
    ///
    /// # Errors
    /// The violation of its range.
    pub fn requested_error(&self) -> Result<f64, Violation> {
        let requested_error = self.accuracy.requested_error;
        Parameter::RequestedError.check(requested_error).map_or(Ok(requested_error), Err)
    }

    /// What the mechanics leave free.
    pub fn parts_parameters(&self) -> PartsParameters {
        let PartsDocument { wave_generator, teeth, ring, carrier } = &self.parts;
        PartsParameters {
            ring_outer_radius_mm: ring.outer_radius_mm,
            carrier_inner_radius_mm: carrier.inner_radius_mm,
            carrier_outer_radius_mm: carrier.outer_radius_mm,
            bore_radius_mm: wave_generator.bore_radius_mm,
            wave_generator_clearance_um: wave_generator.clearance_um,
            teeth_clearance_um: teeth.clearance_um,
            ring_clearance_um: ring.clearance_um,
            carrier_clearance_um: carrier.clearance_um,
        }
    }

    /// What a drawing is asked for.
    pub fn drawing_parameters(&self, max_points: u64) -> DrawingParameters {
        DrawingParameters {
            chord_tolerance_mm: self.profile.chord_tolerance_mm,
            max_points,
            input_angle_deg: self.assembly.input_angle_deg,
        }
    }

    /// What profiles are asked for.
    ///
    /// # Errors
    /// The violation of the tolerance's range.
    pub fn profile_parameters(&self, max_points: u64) -> Result<ProfileParameters, Violation> {
        let chord_tolerance_mm = self.profile.chord_tolerance_mm;
        let extent = match self.profile.extent {
            ExtentDocument::Tooth => Extent::Tooth,
            ExtentDocument::Full => Extent::Full,
        };
        Parameter::ChordTolerance
            .check(chord_tolerance_mm)
            .map_or(Ok(ProfileParameters { chord_tolerance_mm, extent, max_points }), Err)
    }
}
