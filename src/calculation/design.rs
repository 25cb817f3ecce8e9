//! The design document: wire types, and their one conversion into the solver's.
//!
//! A document that is written as JSON reads back as itself.

use serde::{Deserialize, Serialize};
use toothwave_solver::drawing::DrawingParameters;
use toothwave_solver::losses::Friction;
use toothwave_solver::parts::PartsParameters;
use toothwave_solver::profile::{Extent, ProfileParameters};
use toothwave_solver::sweep::Points;
use toothwave_solver::{
    Compatibility, ContactLaw, DriveParameters, LoadParameters, Material, Materials, Parameter, PerContact, Torque,
    Violation,
};
use utoipa::ToSchema;

use crate::field::FieldCode;
use crate::json::{self, Fault};
use crate::no_answer::NoAnswer;

mod asked;
mod deviations;
mod drive;
mod friction;
mod load;
mod modification;
mod number;

pub use asked::*;
pub use deviations::*;
pub use drive::*;
pub use friction::*;
pub use load::*;
pub use modification::*;
pub use number::Whole;

use drive::Counted;
use number::given;

/// One document for every endpoint: each reads only what it needs. Lengths in mm, torques in N·m, moduli in GPa, stiffnesses in N/mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
#[schema(example = json!({
    "drive": {
        "wave_generator": { "kind": "ellipse", "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
        "teeth": { "shape": "cylinder", "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
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
    /// Friction; only a sweep reads it, and left out, nothing of it is computed.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub friction: Option<FrictionDocument>,
    /// The model of load sharing.
    #[serde(default)]
    pub model: ModelDocument,
    /// Parts made otherwise than conjugate.
    #[serde(default)]
    pub modification: ModificationDocument,
    /// Single items of the parts as they came out.
    #[serde(default)]
    pub deviations: DeviationsDocument,
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

impl Design {
    /// The document that a text holds, normalised.
    ///
    /// # Errors
    /// Where it holds none: the first structural fault.
    pub fn read(text: &[u8]) -> Result<Self, NoAnswer> {
        Ok(json::read::<Self>(text)?.normalised())
    }

    /// The document with what may be left out filled in, so that equal designs are equal bytes.
    pub fn normalised(mut self) -> Self {
        if self.sweep.tolerance.is_none() {
            self.sweep.samples.get_or_insert(DEFAULT_SAMPLES);
        }
        let by_default = self.law_by_default();
        self.model.stiffness.get_or_insert(by_default);
        self
    }

    /// The law of a document that names none: the one that holds best, and the paper's beside the paper's compatibility.
    fn law_by_default(&self) -> StiffnessDocument {
        match (&self.drive.teeth, self.model.compatibility) {
            (TeethDocument::Ball(_), _) => StiffnessDocument::Hertz(HertzDocument::default()),
            (TeethDocument::Cylinder(_) | TeethDocument::FlatSided(_), CompatibilityDocument::Projection) => {
                StiffnessDocument::Linear(LinearDocument::default())
            }
            (TeethDocument::Cylinder(_) | TeethDocument::FlatSided(_), CompatibilityDocument::VirtualWork) => {
                StiffnessDocument::Johnson(JohnsonDocument::default())
            }
        }
    }

    /// The drive's parameters.
    pub fn drive_parameters(&self) -> DriveParameters {
        let DriveDocument { wave_generator, teeth, ring } = &self.drive;
        let Counted { count, installed, radius_mm } = teeth.counted();
        DriveParameters {
            wave_generator: wave_generator.into(),
            teeth: count.count(),
            installed: installed.unwrap_or(count).count(),
            tooth_radius_mm: radius_mm,
            tooth: teeth.into(),
            ring_teeth: ring.teeth.count(),
            tip_radius_mm: ring.tip_radius_mm,
        }
    }

    /// Violations with the numbers that stand in the document, where the solver's count could not hold them; without those of `installed`
    /// where it does not stand there: they are faults of `count`, which has them too.
    pub fn as_written(&self, violations: &[Violation]) -> Vec<Violation> {
        let Counted { count, installed, .. } = self.drive.teeth.counted();
        let as_written = |&violation: &Violation| match violation {
            Violation::OutOfRange { parameter: Parameter::InstalledTeeth, .. } if installed.is_none() => None,
            Violation::OutOfRange { parameter, limit, value } => {
                let value = match parameter {
                    Parameter::ToothCount => count.0,
                    Parameter::InstalledTeeth => installed.unwrap_or(count).0,
                    Parameter::RingTeeth => self.drive.ring.teeth.0,
                    Parameter::Lobes => self.drive.wave_generator.lobes().map_or(value, |lobes| lobes.0),
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
        Ok(LoadParameters {
            materials: Materials {
                wave_generator: material(&self.materials.wave_generator),
                teeth: material(&self.materials.teeth),
                ring: material(&self.materials.ring),
                carrier: material(&self.materials.carrier),
            },
            torque,
            compatibility,
            law: self.contact_law(),
            series_compliance_mm_per_n: (&self.model.series_compliance_mm_per_n).into(),
            modification: (&self.modification).into(),
            clearance_um: self.model.clearance.as_ref().map_or_else(PerContact::default, |clearance| PerContact {
                wave_generator: clearance.wave_generator_um,
                ring: clearance.ring_um,
                carrier: clearance.carrier_um,
            }),
            allowable_stress_mpa: load.allowable_stress_mpa,
        })
    }

    /// Speed of the wave generator.
    ///
    /// # Errors
    /// The violation of its range.
    pub fn input_speed_rpm(&self) -> Result<Option<f64>, Violation> {
        let speed_rpm = self.load.as_ref().and_then(|load| load.input_speed_rpm);
        speed_rpm.and_then(|speed_rpm| Parameter::InputSpeed.check(speed_rpm)).map_or(Ok(speed_rpm), Err)
    }

    /// Friction, where there is any.
    ///
    /// # Errors
    /// Every value that is out of its range.
    pub fn friction(&self) -> Result<Option<Friction>, Vec<Violation>> {
        let Some(document) = &self.friction else { return Ok(None) };
        match (document.idle_violation(), Friction::new(&document.into())) {
            (None, friction) => friction.map(Some),
            (Some(idle), friction) => Err(std::iter::once(idle).chain(friction.err().into_iter().flatten()).collect()),
        }
    }

    fn contact_law(&self) -> ContactLaw {
        // Only a document that was not normalised names none.
        self.model.stiffness.as_ref().map_or_else(|| (&self.law_by_default()).into(), Into::into)
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
