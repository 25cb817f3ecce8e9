//! The design document: wire types, and their one conversion into the solver's.
//!
//! A document that is written as JSON reads back as itself.

use serde::{Deserialize, Serialize};
use toothwave_solver::backing::Support;
use toothwave_solver::drawing::DrawingParameters;
use toothwave_solver::losses::Friction;
use toothwave_solver::parts::{CarrierRadii, PartsParameters};
use toothwave_solver::profile::{Extent, ProfileParameters};
use toothwave_solver::sweep::Points;
use toothwave_solver::violation::{OfDutyPoint, SHARES_TOLERANCE};
use toothwave_solver::{
    Compatibility, DriveParameters, LoadParameters, Material, Materials, Parameter, PerContact, Torque, Violation,
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
mod model;
mod modification;
mod number;
mod refinements;
mod resolved;

pub use asked::*;
pub use deviations::*;
pub use drive::*;
pub use friction::*;
pub use load::*;
pub use model::*;
pub use modification::*;
pub use number::Whole;
pub use refinements::*;
pub use resolved::*;

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
    /// The parts as they are made: clearances, and what the mechanics leave free. Forces read the clearances, those on flat-sided teeth also the carrier's
    /// radii, between which the flats are borne. A sweep estimates from the rest what gives way behind the contacts, which its forces leave out.
    #[serde(default)]
    pub parts: PartsDocument,
    /// How the parts stand in a drawing of all of them.
    #[serde(default)]
    pub assembly: AssemblyDocument,
}

/// The loads in turn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Duty {
    /// Each of them.
    pub points: Vec<DutyPoint>,
    /// The one with the largest torque, which has the largest forces, stresses and wind-up of all.
    pub hardest: usize,
    /// Whether the document has a duty, or a single load.
    pub is_asked: bool,
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DutyPoint {
    /// Its torque.
    pub torque: Torque,
    /// Speed of the wave generator.
    pub input_speed_rpm: Option<f64>,
    /// Its share of the running time.
    pub share_of_time: f64,
}

/// The torque where exactly one is given.
fn one_torque(input_nm: Option<f64>, output_nm: Option<f64>, pointer: String) -> Result<Torque, Fault> {
    let fault = |code, detail: &str| Fault { pointer, code, detail: detail.into() };
    match (input_nm, output_nm) {
        (Some(torque_nm), None) => Ok(Torque::Input(torque_nm)),
        (None, Some(torque_nm)) => Ok(Torque::Output(torque_nm)),
        (Some(_), Some(_)) => Err(fault(
            FieldCode::ConflictingFields,
            "only one of `input_torque_nm` and `output_torque_nm` may stand here",
        )),
        (None, None) => Err(fault(FieldCode::MissingField, "`input_torque_nm` or `output_torque_nm` is required here")),
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

    /// The document with what may be left out filled in, so that equal designs are equal bytes.
    pub fn normalised(mut self) -> Self {
        if self.sweep.tolerance.is_none() {
            self.sweep.samples.get_or_insert(DEFAULT_SAMPLES);
        }
        let drive = self.drive_parameters();
        self.deviations.leave_out_zeros(&drive);
        self
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

    /// The load's parameters, for a drive that has pointed or bored tips or not.
    ///
    /// # Errors
    /// A fault where the document has no load, or not exactly one torque.
    pub fn load_parameters(&self, has_pointed_tips: bool) -> Result<LoadParameters, Fault> {
        self.require_one_clearance()?;
        self.require_one_choice_of_refinements()?;
        let load = self.load.as_ref().ok_or_else(|| {
            let detail = "forces need a load: give `load` an `input_torque_nm` or an `output_torque_nm`";
            Fault::of_field(FieldCode::MissingField, "load", detail.into())
        })?;
        let Duty { points, hardest, .. } = self.duty_of(load)?;
        let torque = points[hardest].torque;
        let material = |document: &MaterialDocument| Material {
            youngs_modulus_gpa: document.youngs_modulus_gpa,
            poissons_ratio: document.poissons_ratio,
        };
        let compatibility = match self.model.compatibility {
            CompatibilityDocument::Projection => Compatibility::Projection,
            CompatibilityDocument::VirtualWork => Compatibility::VirtualWork,
        };
        let Refinements { ring_teeth_bend, wave_generator_moves, corner_contact } = self.refinements(has_pointed_tips);
        Ok(LoadParameters {
            materials: Materials {
                wave_generator: material(&self.materials.wave_generator),
                teeth: material(&self.materials.teeth),
                ring: material(&self.materials.ring),
                carrier: material(&self.materials.carrier),
            },
            torque,
            compatibility,
            law: (&self.stiffness()).into(),
            series_compliance_mm_per_n: (&self.model.series_compliance_mm_per_n).into(),
            ring_teeth_bend,
            wave_generator_moves,
            corner_contact,
            modification: (&self.modification).into(),
            carrier: self.carrier_of_flats(),
            clearance_um: self.clearances_um().gaps(),
            allowable_stress_mpa: load.allowable_stress_mpa.map(Into::into),
        })
    }

    /// The radii of the carrier that bears the flats of flat-sided teeth, as far as they are given; forces on other teeth do not depend on them.
    pub fn carrier_of_flats(&self) -> CarrierRadii {
        let CarrierPartDocument { inner_radius_mm, outer_radius_mm, .. } = self.parts.carrier;
        match self.drive.teeth {
            TeethDocument::FlatSided(_) => CarrierRadii { inner_mm: inner_radius_mm, outer_mm: outer_radius_mm },
            TeethDocument::Cylinder(_) | TeethDocument::Ball(_) => CarrierRadii::default(),
        }
    }

    /// The loads in turn, of a document with a load; a single one where it has no duty.
    ///
    /// # Errors
    /// As [`Self::load_parameters`].
    pub fn duty(&self) -> Result<Duty, Fault> {
        self.load.as_ref().map_or_else(|| Ok(Duty::default()), |load| self.duty_of(load))
    }

    fn duty_of(&self, load: &LoadDocument) -> Result<Duty, Fault> {
        let fault = |code, pointer: String, detail: &str| Fault { pointer, code, detail: detail.into() };
        let LoadDocument { input_torque_nm, output_torque_nm, input_speed_rpm, duty, .. } = load;
        let Some(duty) = duty else {
            let torque = one_torque(*input_torque_nm, *output_torque_nm, "/load".into())?;
            let point = DutyPoint { torque, input_speed_rpm: *input_speed_rpm, share_of_time: 1.0 };
            return Ok(Duty { points: vec![point], ..Duty::default() });
        };
        if input_torque_nm.or(*output_torque_nm).or(*input_speed_rpm).is_some() {
            let detail = "`duty` has torques and speeds of its own: no other may stand here";
            return Err(fault(FieldCode::ConflictingFields, "/load".into(), detail));
        }
        if self.sweep.tolerance.is_some() {
            let detail = "a duty adds wear place by place, and its points have to be swept over the same input angles: give `samples`";
            return Err(fault(FieldCode::ConflictingFields, "/sweep/tolerance".into(), detail));
        }
        let points: Result<Vec<_>, _> = duty
            .iter()
            .enumerate()
            .map(|(at, point)| {
                let torque = one_torque(point.input_torque_nm, point.output_torque_nm, format!("/load/duty/{at}"))?;
                let (input_speed_rpm, share_of_time) = (Some(point.input_speed_rpm), point.share_of_time);
                Ok(DutyPoint { torque, input_speed_rpm, share_of_time })
            })
            .collect();
        let points = points?;
        if points.is_empty() {
            return Err(fault(FieldCode::OutOfRange, "/load/duty".into(), "a duty has one point or more"));
        }
        // Every force grows with the torque, so the hardest point is that of the largest.
        let drive = self.drive_parameters();
        let ratio = drive.teeth as f64 / drive.wave_generator.lobes() as f64;
        let input_nm = |point: &DutyPoint| match point.torque {
            Torque::Input(torque_nm) => torque_nm,
            Torque::Output(torque_nm) => torque_nm / ratio,
        };
        let hardest = (1..points.len())
            .fold(0, |hardest, at| if input_nm(&points[at]) > input_nm(&points[hardest]) { at } else { hardest });
        Ok(Duty { points, hardest, is_asked: true })
    }

    /// Every number of the duty that is out of its range, or else shares that do not add up to one; of a load without one that of the speed.
    ///
    /// # Errors
    /// As [`Self::load_parameters`].
    pub fn duty_violations(&self) -> Result<Vec<Violation>, Fault> {
        let Duty { points, is_asked, .. } = self.duty()?;
        if !is_asked {
            let speeds = points.iter().filter_map(|point| point.input_speed_rpm);
            return Ok(speeds.filter_map(|speed_rpm| Parameter::InputSpeed.check(speed_rpm)).collect());
        }
        let mut violations: Vec<_> = Parameter::DutyPoints.check(points.len() as f64).into_iter().collect();
        for (at, point) in points.iter().enumerate() {
            let torque = match point.torque {
                Torque::Input(torque_nm) => (OfDutyPoint::InputTorque, Some(torque_nm)),
                Torque::Output(torque_nm) => (OfDutyPoint::OutputTorque, Some(torque_nm)),
            };
            let speed = (OfDutyPoint::InputSpeed, point.input_speed_rpm);
            let share = (OfDutyPoint::ShareOfTime, Some(point.share_of_time));
            let out_of_range = |(of, value): (OfDutyPoint, Option<f64>)| Parameter::Duty(of, at).check(value?);
            violations.extend([torque, speed, share].into_iter().filter_map(out_of_range));
        }
        let sum: f64 = points.iter().map(|point| point.share_of_time).sum();
        if violations.is_empty() && (sum - 1.0).abs() > SHARES_TOLERANCE {
            violations.push(Violation::DutyShares { sum });
        }
        Ok(violations)
    }

    /// The wear rates of the parts, where they are given.
    pub fn wear_rate_mm3_per_nm(&self) -> Option<PerContact<f64>> {
        self.friction.as_ref().and_then(FrictionDocument::wear_rate_mm3_per_nm)
    }

    /// What the life of the wave generator's bearing follows from, where it is asked for.
    pub fn bearing_rating(&self) -> Option<BearingRating> {
        self.friction.as_ref().and_then(FrictionDocument::bearing_rating)
    }

    /// Friction, where there is any.
    ///
    /// # Errors
    /// Every value that is out of its range.
    pub fn friction(&self) -> Result<Option<Friction>, Vec<Violation>> {
        let Some(document) = &self.friction else { return Ok(None) };
        let mut violations = document.violations_beside();
        if document.bearing_rating().is_some() && !self.drive_parameters().wave_generator.is_eccentric_circle() {
            violations.push(Violation::NoBearingLife);
        }
        match Friction::new(&document.into()) {
            Ok(friction) if violations.is_empty() => Ok(Some(friction)),
            friction => Err(violations.into_iter().chain(friction.err().into_iter().flatten()).collect()),
        }
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
    ///
    /// # Errors
    /// A fault where the document gives a contact two gaps.
    pub fn parts_parameters(&self) -> Result<PartsParameters, Fault> {
        self.require_one_clearance()?;
        let PartsDocument { wave_generator, ring, carrier, teeth: _ } = &self.parts;
        let ClearancesUm { by_contact, teeth } = self.clearances_um();
        Ok(PartsParameters {
            ring_outer_radius_mm: ring.outer_radius_mm,
            carrier_inner_radius_mm: carrier.inner_radius_mm,
            carrier_outer_radius_mm: carrier.outer_radius_mm,
            bore_radius_mm: wave_generator.bore_radius_mm,
            wave_generator_clearance_um: by_contact.wave_generator,
            teeth_clearance_um: teeth,
            ring_clearance_um: by_contact.ring,
            carrier_clearance_um: by_contact.carrier,
            modification: (&self.modification).into(),
        })
    }

    /// How the parts are held, as far as the document says.
    pub fn support(&self) -> Support {
        let PartsDocument { ring, carrier, .. } = &self.parts;
        Support { fingers: carrier.fingers.map(Into::into), rim: ring.rim.map(Into::into) }
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
