//! The design document: wire types, and their one conversion into the solver's types.
//!
//! A document that is written as JSON reads back as itself.

use serde::{Deserialize, Serialize};
use toothwave_solver::backing::Support;
use toothwave_solver::fingers::{FingerParameters, LoadCycle, Strength};
use toothwave_solver::losses::duty::{Duty, DutyPoint, LossParameters};
use toothwave_solver::parts::{CarrierRadii, PartsParameters};
use toothwave_solver::profile::ProfileParameters;
use toothwave_solver::sweep::Points;
use toothwave_solver::violation::{OfDutyPoint, SHARES_TOLERANCE};
use toothwave_solver::{
    Deviations, DriveParameters, LoadCase, LoadParameters, Materials, Modification, Parameter, Torque, Violation,
    WaveGenerator,
};
use utoipa::ToSchema;

use crate::field::{FieldCode, FieldError};
use crate::json;
use crate::no_answer::NoAnswer;

mod asked;
mod contact_law;
mod drive;
mod friction;
mod load;
mod model;
mod number;
mod refinements;
mod resolved;
mod strength;

pub use asked::*;
pub use contact_law::*;
pub use drive::*;
pub use friction::*;
pub use load::*;
pub use model::*;
pub use number::Whole;
pub use refinements::*;
pub use resolved::*;
pub use strength::*;

use drive::Counted;

/// Design document for every endpoint; each endpoint reads only what it needs. Lengths are in mm, torques in N·m,
/// moduli in GPa, stiffnesses in N/mm.
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
    /// Wave generator, teeth and ring.
    pub drive: DriveDocument,
    /// Material of each part. Default: steel.
    #[serde(default)]
    pub materials: Materials,
    /// Load. Needed for a sweep only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<LoadDocument>,
    /// Friction. Used by a sweep only. Default: friction is not calculated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionDocument>,
    /// The model of load sharing.
    #[serde(default)]
    pub model: ModelDocument,
    /// Modification: intentional differences of the parts from the conjugate shape. A positive value opens a gap.
    /// Default: none.
    #[serde(default)]
    pub modification: Modification,
    /// Deviations of individual items of the parts. A positive value opens a gap. Default: none.
    #[serde(default)]
    pub deviations: Deviations,
    /// Input angles of a sweep.
    #[serde(default)]
    pub sweep: SweepDocument,
    /// Sampling of profiles.
    #[serde(default)]
    pub profile: ProfileParameters,
    /// Settings of `/v1/accuracy`.
    #[serde(default)]
    pub accuracy: AccuracyDocument,
    /// The parts as manufactured: clearances, and dimensions that the mechanics do not determine. Forces depend on the
    /// clearances, and for flat-sided teeth on the carrier's radii. From the other dimensions a sweep estimates the
    /// compliance of the supports, which its forces do not include.
    #[serde(default)]
    pub parts: PartsDocument,
    /// Position of the parts in a drawing of the assembly.
    #[serde(default)]
    pub assembly: AssemblyDocument,
}

/// Returns the torque if exactly one is given.
fn one_torque(input_nm: Option<f64>, output_nm: Option<f64>, pointer: &str) -> Result<Torque, FieldError> {
    match (input_nm, output_nm) {
        (Some(torque_nm), None) => Ok(Torque::Input(torque_nm)),
        (None, Some(torque_nm)) => Ok(Torque::Output(torque_nm)),
        (Some(_), Some(_)) => {
            Err(FieldError::conflict(pointer, "only one of `input_torque_nm` and `output_torque_nm` may stand here"))
        }
        (None, None) => {
            let detail = "`input_torque_nm` or `output_torque_nm` is required here";
            Err(FieldError::at(pointer, FieldCode::MissingField, detail))
        }
    }
}

/// Clears each list that has a zero for every item, which is equivalent.
fn leave_out_zeros(deviations: &mut Deviations, drive: &DriveParameters) {
    for (list, items) in [
        (&mut deviations.tooth_radius_um, drive.installed),
        (&mut deviations.slot_angle_arcsec, drive.installed),
        (&mut deviations.slot_wall_um, drive.installed),
        (&mut deviations.ring_space_um, drive.ring_teeth),
        (&mut deviations.ring_space_angle_arcsec, drive.ring_teeth),
        (&mut deviations.wave_generator_lobe_um, drive.wave_generator.lobes()),
    ] {
        if usize::try_from(items) == Ok(list.len()) && list.iter().all(|&value| value == 0.0) {
            list.clear();
        }
    }
}

impl Design {
    /// Reads a document from text and normalises it.
    pub fn read(text: &[u8]) -> Result<Self, NoAnswer> {
        Ok(json::read::<Self>(text)?.normalised())
    }

    /// Returns the document in its normal form, so that equal designs have equal bytes.
    pub fn normalised(mut self) -> Self {
        if self.sweep.tolerance.is_none() {
            self.sweep.samples.get_or_insert(DEFAULT_SAMPLES);
        }
        let drive = self.drive_parameters();
        leave_out_zeros(&mut self.deviations, &drive);
        let Support { fingers, rim } = Support::default();
        self.parts.ring.rim.take_if(|given| *given == rim);
        self.parts.carrier.fingers.take_if(|given| *given == fingers);
        if let Some(friction) = &mut self.friction {
            friction.wear_rate_mm3_per_nm.take_if(|rates| *rates == WearRatesDocument::default());
        }
        self
    }

    /// Returns the parameters of the drive.
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

    /// Returns the violations with the numbers of the document, if they exceed the solver's integers. Violations of a
    /// default `installed` are left out, because `count` has the same ones.
    pub fn as_written(&self, violations: &[Violation]) -> Vec<Violation> {
        let Counted { count, installed, .. } = self.drive.teeth.counted();
        let as_written = |violation: &Violation| {
            if violation.code != FieldCode::OutOfRange {
                return Some(violation.clone());
            }
            let written = match violation.parameter {
                Parameter::ToothCount => Some(count),
                Parameter::InstalledTeeth => Some(installed?),
                Parameter::RingTeeth => Some(self.drive.ring.teeth),
                Parameter::Lobes | Parameter::HarmonicLobes => self.drive.wave_generator.lobes(),
                _ => None,
            };
            Some(Violation { value: written.map(|count| count.0).or(violation.value), ..violation.clone() })
        };
        violations.iter().filter_map(as_written).collect()
    }

    /// Returns the parameters of the load, for a drive with or without pointed or bored tips. Fails without a load, or
    /// without exactly one torque.
    pub fn load_parameters(&self, has_pointed_tips: bool) -> Result<LoadParameters, FieldError> {
        self.require_one_clearance()?;
        self.require_one_choice_of_refinements()?;
        let load = self.load.as_ref().ok_or_else(|| {
            let detail = "forces need a load: give `load` an `input_torque_nm` or an `output_torque_nm`";
            FieldError::at("/load", FieldCode::MissingField, detail)
        })?;
        let Duty { points, hardest } = self.duty()?;
        Ok(LoadParameters {
            torque: points[hardest].torque,
            allowable_stress_mpa: load.allowable_stress_mpa.map(|stress_mpa| stress_mpa.0),
            ..self.model_parameters(has_pointed_tips)
        })
    }

    /// Returns the parameters of the load with the default torque.
    fn model_parameters(&self, has_pointed_tips: bool) -> LoadParameters {
        let refinements = self.refinements(has_pointed_tips);
        let CarrierPartDocument { inner_radius_mm, outer_radius_mm, .. } = self.parts.carrier;
        let carrier = match self.drive.teeth {
            TeethDocument::FlatSided { .. } => CarrierRadii { inner_mm: inner_radius_mm, outer_mm: outer_radius_mm },
            // Forces on other teeth do not depend on the carrier's radii.
            TeethDocument::Cylinder { .. } | TeethDocument::Ball { .. } => CarrierRadii::default(),
        };
        LoadParameters {
            materials: self.materials,
            compatibility: self.model.compatibility,
            law: (&self.stiffness()).into(),
            series_compliance_mm_per_n: self.model.series_compliance_mm_per_n.given().unwrap_or_default(),
            ring_teeth_bend: refinements.ring_teeth_bend,
            wave_generator_moves: refinements.wave_generator_moves,
            corner_contact: refinements.corner_contact,
            modification: self.modification,
            carrier,
            clearance_um: self.clearances_um().gaps(),
            ..LoadParameters::default()
        }
    }

    /// Returns what the document gives and its `projection` rejects.
    pub fn projection_violations(&self) -> Vec<Violation> {
        let found = LoadCase::new(&self.model_parameters(false)).err().into_iter().flatten();
        found.filter(|violation| violation.code == FieldCode::ConflictingFields).collect()
    }

    /// Returns the points of the duty, or a single one without duty; none without a load.
    pub fn duty(&self) -> Result<Duty, FieldError> {
        let Some(load) = &self.load else { return Ok(Duty::default()) };
        let &LoadDocument { input_torque_nm, output_torque_nm, input_speed_rpm, .. } = load;
        let Some(duty) = &load.duty else {
            let torque = one_torque(input_torque_nm, output_torque_nm, "/load")?;
            let point = DutyPoint { torque, input_speed_rpm, share_of_time: 1.0 };
            return Ok(Duty { points: vec![point], hardest: 0 });
        };
        if input_torque_nm.or(output_torque_nm).or(input_speed_rpm).is_some() {
            let detail = "`duty` has torques and speeds of its own: no other may stand here";
            return Err(FieldError::conflict("/load", detail));
        }
        if self.sweep.tolerance.is_some() {
            let detail = "a duty adds wear place by place, and its points have to be swept over the same input angles: give `samples`";
            return Err(FieldError::conflict("/sweep/tolerance", detail));
        }
        let mut points = Vec::new();
        for (at, point) in duty.iter().enumerate() {
            let torque = one_torque(point.input_torque_nm, point.output_torque_nm, &format!("/load/duty/{at}"))?;
            let (input_speed_rpm, share_of_time) = (Some(point.input_speed_rpm), point.share_of_time);
            points.push(DutyPoint { torque, input_speed_rpm, share_of_time });
        }
        if points.is_empty() {
            return Err(FieldError::at("/load/duty", FieldCode::OutOfRange, "a duty has one point or more"));
        }
        // All forces grow with the torque, so the point with the largest torque governs.
        let drive = self.drive_parameters();
        let ratio = drive.teeth as f64 / drive.wave_generator.lobes() as f64;
        let input_nm = |point: &DutyPoint| match point.torque {
            Torque::Input(torque_nm) => torque_nm,
            Torque::Output(torque_nm) => torque_nm / ratio,
        };
        let hardest = (1..points.len())
            .fold(0, |hardest, at| if input_nm(&points[at]) > input_nm(&points[hardest]) { at } else { hardest });
        Ok(Duty { points, hardest })
    }

    /// Returns true if the document has a duty, not a single load.
    pub fn has_duty(&self) -> bool {
        self.load.as_ref().is_some_and(|load| load.duty.is_some())
    }

    /// Returns every value of the duty that is out of its range, or else shares that do not add up to one. Without a
    /// duty it checks the speed of the load.
    pub fn duty_violations(&self) -> Vec<Violation> {
        let Some(load) = &self.load else { return Vec::new() };
        let Some(points) = &load.duty else {
            let speed = load.input_speed_rpm;
            return speed.and_then(|speed_rpm| Parameter::InputSpeed.check(speed_rpm)).into_iter().collect();
        };
        let mut violations: Vec<_> = Parameter::DutyPoints.check(points.len() as f64).into_iter().collect();
        for (at, point) in points.iter().enumerate() {
            let values = [
                (OfDutyPoint::InputTorque, point.input_torque_nm),
                (OfDutyPoint::OutputTorque, point.output_torque_nm),
                (OfDutyPoint::InputSpeed, Some(point.input_speed_rpm)),
                (OfDutyPoint::ShareOfTime, Some(point.share_of_time)),
            ];
            violations.extend(values.into_iter().filter_map(|(of, value)| Parameter::Duty(of, at).check(value?)));
        }
        let sum: f64 = points.iter().map(|point| point.share_of_time).sum();
        if violations.is_empty() && (sum - 1.0).abs() > SHARES_TOLERANCE {
            let detail = format!(
                "the shares of time add up to {sum:?}, not to 1: say for each point how much of the running time it takes"
            );
            violations.push(Violation::new(FieldCode::OutOfRange, Parameter::DutyPoints, sum, 1.0, detail));
        }
        violations
    }

    /// Returns the conflict of two fields that set the same quantity, whether or not an answer needs it.
    pub fn conflict(&self) -> Option<FieldError> {
        let checks = [
            self.require_one_clearance(),
            self.require_one_choice_of_refinements(),
            self.duty().map(|_| ()),
            self.sweep_points(u64::MAX).map(|_| ()),
        ];
        checks.into_iter().filter_map(Result::err).find(|fault| fault.code == FieldCode::ConflictingFields)
    }

    /// Returns the parameters of the losses, if friction is given, and adds their violations:
    /// they are valid if it adds none.
    pub(crate) fn loss_parameters(&self, violations: &mut Vec<Violation>) -> Option<LossParameters> {
        let is_eccentric = matches!(self.drive_parameters().wave_generator, WaveGenerator::Eccentric { .. });
        self.friction.as_ref()?.loss_parameters(is_eccentric, violations)
    }

    /// Returns the input angles of the sweep. Fails if the document has both samples and a tolerance; inside is the
    /// violation of a range.
    pub fn sweep_points(&self, max_states: u64) -> Result<Result<Points, Violation>, FieldError> {
        let SweepDocument { samples, tolerance, .. } = self.sweep;
        match (samples, tolerance) {
            (Some(_), Some(_)) => {
                Err(FieldError::conflict("/sweep", "at most one of `samples` and `tolerance` is wanted here"))
            }
            (None, Some(tolerance)) => Ok(Points::tolerance(tolerance, max_states)),
            (samples, None) => {
                let samples = samples.unwrap_or(DEFAULT_SAMPLES);
                let violation = Parameter::Samples.check(samples.0);
                Ok(violation.map_or_else(|| Points::samples(samples.count().unsigned_abs()), Err))
            }
        }
    }

    /// Returns the dimensions that the mechanics do not determine. Fails if the document gives a contact two different
    /// gaps.
    pub fn parts_parameters(&self) -> Result<PartsParameters, FieldError> {
        self.require_one_clearance()?;
        let PartsDocument { wave_generator, ring, carrier, teeth: _ } = &self.parts;
        let ClearancesUm { by_contact, teeth } = self.clearances_um();
        Ok(PartsParameters {
            ring_outer_radius_mm: ring.outer_radius_mm,
            carrier: CarrierRadii { inner_mm: carrier.inner_radius_mm, outer_mm: carrier.outer_radius_mm },
            bore_radius_mm: wave_generator.bore_radius_mm,
            wave_generator_clearance_um: by_contact.wave_generator,
            teeth_clearance_um: teeth,
            ring_clearance_um: by_contact.ring,
            carrier_clearance_um: by_contact.carrier,
            modification: self.modification,
        })
    }

    /// Returns the supports of the parts, given or by default.
    pub fn support(&self) -> Support {
        let PartsDocument { ring, carrier, .. } = &self.parts;
        Support { fingers: carrier.fingers.unwrap_or_default(), rim: ring.rim.unwrap_or_default() }
    }

    /// Returns the parameters of the carrier's fingers, and adds their violations: they are
    /// valid if it adds none.
    pub(crate) fn finger_parameters(&self, violations: &mut Vec<Violation>) -> FingerParameters {
        let CarrierPartDocument { fingers, finger_fillet_radius_mm: fillet_radius_mm, strength, .. } =
            self.parts.carrier;
        let strength = strength.map(StrengthDocument::numbers);
        violations.extend(fillet_radius_mm.and_then(|mm| Parameter::FingerFilletRadius.check(mm)));
        if let Some(Strength { yield_mpa, tensile_mpa, endurance_mpa, .. }) = strength {
            violations.extend(Parameter::YieldStrength.check(yield_mpa));
            violations.extend(Parameter::TensileStrength.check(tensile_mpa));
            violations.extend(Parameter::EnduranceLimit.check(endurance_mpa));
        }
        FingerParameters {
            fingers: fingers.unwrap_or_default(),
            fillet_radius_mm,
            strength,
            cycle: self.load.as_ref().map_or_else(LoadCycle::default, |load| load.cycle),
            friction_coefficient: self.friction.as_ref().map_or(0.0, |friction| friction.carrier.coefficient),
        }
    }
}
