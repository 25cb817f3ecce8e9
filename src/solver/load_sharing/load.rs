//! A load: torque, materials, contact law, compatibility, clearances and profile modifications.

use super::equilibrium::{Compatibility, projected_weights};
use crate::contact::{Material, Materials, Part, PerContact};
use crate::contact_law::ContactLaw;
use crate::drive::{Draft, Drive, DriveParameters, ToothShape};
use crate::gaps::{Deviations, Modification};
use crate::mesh::Mesh;
use crate::parts::CarrierRadii;
use crate::ring::{FlankEnd, RingTooth};
use crate::root::NotConverged;
use crate::violation::{FieldCode, Parameter, Violation};

/// Torque that the drive transmits, ring fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Torque {
    /// At the wave generator, in N·m.
    Input(f64),
    /// At the carrier, in N·m, without losses.
    Output(f64),
}

impl Torque {
    /// Returns the torque at the wave generator: without losses, the carrier torque over the absolute ratio, ring
    /// fixed.
    pub fn input_nm(self, drive: &Drive) -> f64 {
        match self {
            Self::Input(torque) => torque,
            Self::Output(torque) => torque / drive.teeth_per_wave(),
        }
    }

    /// Returns the torque at the carrier, without losses.
    pub fn output_nm(self, drive: &Drive) -> f64 {
        match self {
            Self::Input(torque) => torque * drive.teeth_per_wave(),
            Self::Output(torque) => torque,
        }
    }
}

impl Default for Torque {
    fn default() -> Self {
        Self::Input(20.0)
    }
}

/// Parameters of a load. The default is 20 N·m at the wave generator, steel, Johnson's law and virtual work, without
/// gaps and refinements.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LoadParameters {
    /// Materials of all parts.
    pub materials: Materials,
    /// The torque.
    pub torque: Torque,
    /// The form of compatibility.
    pub compatibility: Compatibility,
    /// The contact law.
    pub law: ContactLaw,
    /// Compliance of the supports, in series with each contact under any law. Needs `VirtualWork`.
    pub series_compliance_mm_per_n: PerContact<f64>,
    /// True if the ring's teeth bend, more so the nearer to the tip the contact is. Needs `VirtualWork`. If false,
    /// bending is neglected.
    pub ring_teeth_bend: bool,
    /// True if the lever arms change as the wave generator winds up under its teeth. Needs `VirtualWork`. If false, the
    /// arms are those of the unloaded positions.
    pub wave_generator_moves: bool,
    /// True if teeth before a pointed or bored flank press against its corner. Needs `VirtualWork` and cylinders. If
    /// false, the ring is rigid at the flank's end, and teeth carry from there on.
    pub corner_contact: bool,
    /// Gap along the normal of each contact, in µm.
    pub clearance_um: PerContact<f64>,
    /// Profile modifications: parts made with other than the conjugate shape. Need `VirtualWork`.
    pub modification: Modification,
    /// Radii of the carrier, which supports the flats of flat-sided teeth. Used for such teeth only.
    pub carrier: CarrierRadii,
    /// Allowable stress of each contact, which sets the torque capacity.
    pub allowable_stress_mpa: Option<PerContact<f64>>,
}

impl LoadParameters {
    /// Returns the clearances that this drive cannot have under `projection`. Their weights are negative somewhere on
    /// the engaged flank, so more clearance would mean more load. Virtual work has no negative weights. Only `s` and
    /// the ring of the drive, and the clearance itself, are needed.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn clearance_violations(&self, draft: &Draft) -> Result<Vec<Violation>, NotConverged> {
        let Some((sense, ring)) = draft.sense.zip(draft.ring) else { return Ok(Vec::new()) };
        self.clearance_violations_in(sense, &ring)
    }

    /// Returns the reasons why the carrier cannot have the radii that support flats.
    pub fn carrier_violations(&self, draft: &Draft) -> Vec<Violation> {
        let set_forward_um = -self.modification.wave_generator_equidistant_um;
        if !matches!(draft.parameters.tooth, ToothShape::FlatSided { .. }) {
            return Vec::new();
        }
        self.carrier.violations(draft.cam_outer_mm, draft.ring.as_ref(), set_forward_um)
    }

    /// Returns the deviations that are impossible for the drive or under this load.
    pub fn deviation_violations(&self, drive: &DriveParameters, deviations: &Deviations) -> Vec<Violation> {
        let mut violations = deviations.violations(drive);
        if self.compatibility == Compatibility::Projection && !deviations.is_nil() {
            violations.push(Violation::needs_virtual_work(Parameter::Deviations));
        }
        violations
    }

    /// Returns the parameters that `projection` rejects: its weights are not those of virtual work and may be negative.
    fn what_needs_virtual_work(&self) -> impl Iterator<Item = Parameter> {
        let law = (!self.law.is_of_projection()).then_some(Parameter::Law);
        let series = self.series_compliance_mm_per_n.iter().filter(|&(_, &compliance)| compliance > 0.0);
        let series = series.map(|(contact, _)| Parameter::SeriesCompliance(contact));
        let bending = self.ring_teeth_bend.then_some(Parameter::RingTeethBend);
        let moves = self.wave_generator_moves.then_some(Parameter::WaveGeneratorMoves);
        let corner = self.corner_contact.then_some(Parameter::CornerContact);
        law.into_iter().chain(series).chain(bending).chain(moves).chain(corner).chain(self.modification.first())
    }

    pub(super) fn clearance_violations_in(&self, sense: f64, ring: &RingTooth) -> Result<Vec<Violation>, NotConverged> {
        let gaps = self.clearance_um.iter();
        let gaps: Vec<_> =
            gaps.filter(|&(contact, &gap)| gap > 0.0 && Parameter::Clearance(contact).check(gap).is_none()).collect();
        if self.compatibility == Compatibility::VirtualWork || gaps.is_empty() {
            return Ok(Vec::new());
        }
        // Both weights fall with the pressure angle (for s = -1 one weight is negative everywhere).
        let weight = projected_weights(sense, &ring.flank, &ring.steepest_engaged()?);
        Ok(gaps
            .into_iter()
            .filter(|&(contact, _)| *weight.get(contact) < 0.0)
            .map(|(contact, &clearance_um)| {
                let detail = format!(
                    "`projection` weighs this gap of {clearance_um:?} µm negatively at some position, so that it would load a tooth instead of freeing it: choose `virtual_work`, or no clearance of this part and of the teeth"
                );
                let parameter = Parameter::PartClearance(contact.mate());
                Violation::new(FieldCode::ClearanceNotMonotone, parameter, clearance_um, 0.0, detail)
            })
            .collect())
    }
}

/// A load with checked parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadCase(LoadParameters);

impl LoadCase {
    /// Checks the parameters and builds the load.
    ///
    /// ```
    /// use toothwave_solver::{Compatibility, ContactLaw, LoadCase, LoadParameters, PerContact, Torque};
    ///
    /// let load = LoadCase::new(&LoadParameters {
    ///     torque: Torque::Output(280.0),
    ///     clearance_um: PerContact { wave_generator: 5.0, ring: 5.0, carrier: 10.0 },
    ///     ..LoadParameters::default()
    /// });
    /// assert!(load.is_ok());
    ///
    /// // Johnson's law cannot be combined with the paper's projection; the linear one can.
    /// let projected = LoadParameters { compatibility: Compatibility::Projection, ..LoadParameters::default() };
    /// assert!(LoadCase::new(&projected).is_err());
    /// assert!(LoadCase::new(&LoadParameters { law: ContactLaw::Linear, ..projected }).is_ok());
    /// ```
    ///
    /// # Errors
    /// Returns every value that is out of its range.
    pub fn new(parameters: &LoadParameters) -> Result<Self, Vec<Violation>> {
        let torque = match parameters.torque {
            Torque::Input(value) => (Parameter::InputTorque, value),
            Torque::Output(value) => (Parameter::OutputTorque, value),
        };
        let of_material = |(part, material): (Part, &Material)| {
            [
                (Parameter::YoungsModulus(part), material.youngs_modulus_gpa),
                (Parameter::PoissonsRatio(part), material.poissons_ratio),
            ]
        };
        let mut values: Vec<_> = parameters.materials.iter().flat_map(of_material).collect();
        values.push(torque);
        values.extend(parameters.law.parameters());
        let series = parameters.series_compliance_mm_per_n.iter();
        values.extend(series.map(|(contact, &value)| (Parameter::SeriesCompliance(contact), value)));
        let modification = parameters.modification.parameters();
        values.extend(modification.into_iter().map(|(modified, value)| (Parameter::Modification(modified), value)));
        let gaps = parameters.clearance_um.iter();
        values.extend(gaps.map(|(contact, &value)| (Parameter::Clearance(contact), value)));
        values.extend(parameters.allowable_stress_mpa.into_iter().flat_map(allowable_stresses));
        let mut violations: Vec<_> =
            values.into_iter().filter_map(|(parameter, value)| parameter.check(value)).collect();
        if parameters.compatibility == Compatibility::Projection {
            violations.extend(parameters.what_needs_virtual_work().map(Violation::needs_virtual_work));
        }
        if violations.is_empty() { Ok(Self(*parameters)) } else { Err(violations) }
    }

    /// Returns the load with other allowable stresses of the contacts.
    pub(crate) fn with_allowable_stress(&self, stress_mpa: PerContact<f64>) -> Self {
        Self(LoadParameters { allowable_stress_mpa: Some(stress_mpa), ..self.0 })
    }

    /// Returns the parameters, as given.
    pub const fn parameters(&self) -> &LoadParameters {
        &self.0
    }

    /// Returns the torque at the wave generator.
    pub fn input_torque_nm(&self, drive: &Drive) -> f64 {
        self.0.torque.input_nm(drive)
    }

    /// Returns the torque at the carrier, without losses.
    pub fn output_torque_nm(&self, drive: &Drive) -> f64 {
        self.0.torque.output_nm(drive)
    }

    /// Returns true if teeth of this drive press against the corners of the ring's tips: no balls, and a flank with a
    /// corner.
    pub fn presses_corners(&self, drive: &Drive) -> bool {
        let is_ball = matches!(drive.parameters().tooth, ToothShape::Ball { .. });
        self.0.corner_contact && !is_ball && drive.flank_limit().end != FlankEnd::RegularTip
    }

    /// Returns the mesh of a drive with these deviations under the load.
    pub fn mesh(&self, drive: &Drive, deviations: &Deviations) -> Mesh {
        let mesh = deviations.mesh(drive);
        if self.presses_corners(drive) { mesh.with_teeth_before_flank() } else { mesh }
    }

    /// Returns true if any contact has a gap.
    pub fn has_gaps(&self) -> bool {
        self.0.clearance_um.iter().any(|(_, &gap)| gap > 0.0) || self.0.modification.first().is_some()
    }
}

/// Returns one value if all contacts have the same stress, otherwise one for each contact.
fn allowable_stresses(stress_mpa: PerContact<f64>) -> Vec<(Parameter, f64)> {
    let PerContact { wave_generator, ring, carrier } = stress_mpa;
    if wave_generator.to_bits() == ring.to_bits() && ring.to_bits() == carrier.to_bits() {
        vec![(Parameter::AllowableStress, ring)]
    } else {
        stress_mpa.iter().map(|(contact, &value)| (Parameter::AllowableStressAt(contact), value)).collect()
    }
}
