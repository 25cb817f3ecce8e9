//! Equilibrium of a tooth, and compatibility of all teeth at one input angle (docs/explanation/theory.md section 4).

use std::f64::consts::PI;

use crate::cam::ToothCenter;
use crate::contact::{Contact, ContactLaw, HertzLine, Material, Materials, Part, PerContact, half_width_mm};
use crate::drive::{Draft, Drive, DriveParameters, ToothShape};
use crate::gaps::{Deviations, Gaps, Modification};
use crate::mesh::{Mesh, Place};
use crate::parts::CarrierRadii;
use crate::position::Position;
use crate::ring::{FlankEnd, FlankPoint, RingFlank, RingTooth, TipCorner};
use crate::ring_bending::RingBending;
use crate::root::NotConverged;
use crate::springs::{Gap, Rotation, Spring, Springs, WindUp};
use crate::tooth::line::{WIDEST_SHARE, least_length_mm};
use crate::tooth::{BallContact, Contacts, CornerContact, Flat, Pressure, ToothContact, ToothLaw, ToothSize};
use crate::violation::{Parameter, Violation};
use crate::{SolveError, tooth};

/// Rule by which the approaches at a tooth's contacts add up to the rotation of the wave generator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"))]
pub enum Compatibility {
    /// The paper's (equations 3 to 6): each projected on the direction of the wave generator's force.
    Projection,
    /// Virtual work: the frictionless solution for a tooth whose centre is free to move.
    #[default]
    VirtualWork,
}

/// Torque that the drive transmits, ring fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Torque {
    /// At the wave generator, in N·m.
    Input(f64),
    /// At the carrier, in N·m, without losses.
    Output(f64),
}

/// Parameters of a load.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        if draft.has_flats() { self.carrier.violations(draft, set_forward_um) } else { Vec::new() }
    }

    /// Returns the deviations that are impossible for the drive or under this load.
    pub fn deviation_violations(&self, drive: &DriveParameters, deviations: &Deviations) -> Vec<Violation> {
        let mut violations = deviations.violations(drive);
        if self.compatibility == Compatibility::Projection && !deviations.is_nil() {
            violations.push(Violation::NeedsVirtualWork { parameter: Parameter::Deviations });
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

    fn clearance_violations_in(&self, sense: f64, ring: &RingTooth) -> Result<Vec<Violation>, NotConverged> {
        let gaps = self.clearance_um.iter();
        let gaps: Vec<_> =
            gaps.filter(|&(contact, &gap)| gap > 0.0 && Parameter::Clearance(contact).check(gap).is_none()).collect();
        if self.compatibility == Compatibility::VirtualWork || gaps.is_empty() {
            return Ok(Vec::new());
        }
        // Both weights fall with the pressure angle (for s = -1 one weight is negative everywhere).
        let weight = Weights::of(Compatibility::Projection, sense, &ring.flank, &ring.steepest_engaged()?).0;
        Ok(gaps
            .into_iter()
            .filter(|&(contact, _)| *weight.get(contact) < 0.0)
            .map(|(contact, &clearance_um)| Violation::ClearanceNotMonotone { contact, clearance_um })
            .collect())
    }
}

/// A load with checked parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadCase(LoadParameters);

impl LoadCase {
    /// Checks the parameters and builds the load.
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
            violations.extend(
                parameters.what_needs_virtual_work().map(|parameter| Violation::NeedsVirtualWork { parameter }),
            );
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

    /// Returns the torque at the wave generator: without losses, the carrier torque over the absolute ratio, ring
    /// fixed.
    pub fn input_torque_nm(&self, drive: &Drive) -> f64 {
        match self.0.torque {
            Torque::Input(torque) => torque,
            Torque::Output(torque) => torque / drive.teeth_per_wave(),
        }
    }

    /// Returns the torque at the carrier, without losses.
    pub fn output_torque_nm(&self, drive: &Drive) -> f64 {
        match self.0.torque {
            Torque::Input(torque) => torque * drive.teeth_per_wave(),
            Torque::Output(torque) => torque,
        }
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

/// Contribution of each contact's approach to the displacement ξ along `F_H`.
struct Weights(PerContact<f64>);

impl Weights {
    fn of(compatibility: Compatibility, sense: f64, flank: &RingFlank, center: &ToothCenter) -> Self {
        let force_ratio = force_ratio(sense, flank, center);
        match compatibility {
            Compatibility::VirtualWork => Self(force_ratio),
            // The paper's cos(γ + sβ) and s sin γ. With tan β = k tan γ the first, times F_K/F_H = cos γ/cos β, is 1 -
            // (1 + sk) sin²γ.
            Compatibility::Projection => {
                let t = center.tan_pressure_angle;
                let sin_squared = t * t / (1.0 + t * t);
                let along_ring = 1.0 - (1.0 + sense * flank.teeth_per_wave()) * sin_squared;
                Self(PerContact {
                    wave_generator: 1.0,
                    ring: along_ring / force_ratio.ring,
                    carrier: sense * sin_squared.sqrt(),
                })
            }
        }
    }
}

/// Forces over `F_H`: 1, `F_K/F_H = cos γ/cos β`, `F_S/F_H = sin γ Z_G/U` \[1\], where `Z_G/U = k + s`.
pub(crate) fn force_ratio(sense: f64, flank: &RingFlank, center: &ToothCenter) -> PerContact<f64> {
    let t = center.tan_pressure_angle;
    let tan_ring = flank.teeth_per_wave() * t;
    let cos_cam = 1.0 / (1.0 + t * t).sqrt();
    PerContact {
        wave_generator: 1.0,
        ring: (1.0 + tan_ring * tan_ring).sqrt() * cos_cam,
        carrier: t * cos_cam * (flank.teeth_per_wave() + sense),
    }
}

/// Returns the relative curvature of each contact of a tooth in the plane of motion.
pub(crate) fn curvature_per_mm(drive: &Drive, center: &ToothCenter, flank: &FlankPoint) -> PerContact<f64> {
    let r = drive.parameters().tooth_radius_mm;
    PerContact {
        wave_generator: 1.0 / r + center.cam_contact.curvature_per_mm,
        ring: 1.0 / (r * flank.regularity),
        carrier: 1.0 / r,
    }
}

/// Returns the force ratios of a tooth before the flank, `F_K/F_H = cos γ/cos β` and `F_S/F_H = cos γ (tan β + s tan
/// γ)`. Here β is the angle of the line to the corner. Returns none if the tooth is past the corner, or if its slot
/// would have to pull it.
fn force_ratio_at_corner(sense: f64, center: &ToothCenter, seen: &FlankPoint) -> Option<PerContact<f64>> {
    let t = center.tan_pressure_angle;
    let cos_cam = 1.0 / (1.0 + t * t).sqrt();
    let carrier = cos_cam * (seen.tan_pressure_angle + sense * t);
    // Both tests are needed: a tooth farther out than the corner and past it has a positive tangent again.
    let is_before = seen.tan_pressure_angle > 0.0 && seen.cos_pressure_angle > 0.0;
    (is_before && carrier >= 0.0).then(|| PerContact {
        wave_generator: 1.0,
        ring: cos_cam / seen.cos_pressure_angle,
        carrier,
    })
}

/// State of a tooth at a position: geometry, force ratios and its spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothState {
    /// Centre of the tooth and its contact with the cam.
    pub center: ToothCenter,
    /// Contact with the ring.
    pub flank: FlankPoint,
    /// Forces over `F_H`.
    pub force_ratio: PerContact<f64>,
    /// Relative curvature of each contact in the plane of motion, in 1/mm.
    pub curvature_per_mm: PerContact<f64>,
    /// Pressure model of each contact.
    pub pressure: PerContact<Pressure>,
    /// Spring of the tooth in load sharing.
    pub spring: Spring,
}

impl AsRef<Spring> for ToothState {
    fn as_ref(&self) -> &Spring {
        &self.spring
    }
}

/// A drive under a load, with everything precomputed that does not depend on the position.
#[derive(Debug, Clone, Copy)]
pub struct LoadedDrive<'a> {
    drive: &'a Drive,
    mesh: Mesh,
    compatibility: Compatibility,
    /// Factor from a sum over the listed teeth to the sum over all teeth.
    zones: f64,
    input_torque_nmm: f64,
    law: ContactLaw,
    contacts: Contacts,
    ring_bending: Option<RingBending>,
    wave_generator_moves: bool,
    tip_corner: Option<TipCorner>,
    /// Growth of the corner's compliance for each unit of the logarithm by which a contact there is narrower, if the
    /// ring's teeth bend.
    corner_growth_mm_per_n: f64,
    gaps: Gaps<'a>,
}

/// Stress that limits the torque at one input angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueLimit {
    /// Torque at the wave generator at which the stress is reached.
    pub input_torque_nmm: f64,
    /// The contact that reaches its stress first, or the nearest to its stress if none does.
    pub contact: Contact,
    /// True if no contact reaches its stress: at a larger torque the wave generator would rotate past the teeth.
    pub turns_past_teeth: bool,
    /// End of Johnson's law, if it comes before any stress is reached. The torque is then the one at that end, and the
    /// limit is higher.
    pub law_end: Option<LawEnd>,
}

/// End of Johnson's law for the teeth at one input angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawEnd {
    contact: Contact,
    position_deg: f64,
    half_width_limit_mm: f64,
    input_torque_limit_nmm: f64,
}

impl LawEnd {
    /// Returns the error for a load or a torque capacity beyond this end.
    pub(crate) fn error(self, is_of_capacity: bool) -> SolveError {
        let Self { contact, position_deg, half_width_limit_mm, input_torque_limit_nmm } = self;
        let input_torque_limit_nm = 1e-3 * input_torque_limit_nmm;
        SolveError::JohnsonBeyondHalfWidth {
            contact,
            position_deg,
            half_width_limit_mm,
            input_torque_limit_nm,
            is_of_capacity,
        }
    }
}

impl<'a> LoadedDrive<'a> {
    /// Builds the drive under the load.
    ///
    /// # Errors
    /// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] if no finite forces exist,
    /// [`SolveError::Impossible`] if the drive cannot have the load's clearances.
    pub fn new(drive: &'a Drive, load: &LoadCase) -> Result<Self, SolveError> {
        Self::with_deviations(drive, load, &ToothContact::of(drive, load.parameters().carrier), None)
    }

    /// Builds the drive under the load, with deviations of its parts.
    ///
    /// # Errors
    /// As [`Self::with_deviations`].
    pub(crate) fn deviating(drive: &'a Drive, load: &LoadCase, deviations: &'a Deviations) -> Result<Self, SolveError> {
        Self::with_deviations(drive, load, &ToothContact::of(drive, load.parameters().carrier), Some(deviations))
    }

    /// Builds the drive under the load, with teeth of another shape.
    ///
    /// # Errors
    /// As [`Self::new`], and [`SolveError::Impossible`] if the law does not apply to such teeth.
    pub fn with_teeth(drive: &'a Drive, load: &LoadCase, shape: &ToothContact) -> Result<Self, SolveError> {
        Self::with_deviations(drive, load, shape, None)
    }

    /// Builds the drive under the load, with teeth of another shape and deviations of its parts. Zones are then not
    /// alike: [`Self::wind_up`] needs the teeth of all zones, made by [`Self::tooth_at`].
    ///
    /// # Errors
    /// As [`Self::with_teeth`], and [`SolveError::Impossible`] if a list has a wrong length or `projection` gets
    /// deviations.
    pub fn with_deviations(
        drive: &'a Drive,
        load: &LoadCase,
        shape: &ToothContact,
        deviations: Option<&'a Deviations>,
    ) -> Result<Self, SolveError> {
        let p = load.parameters();
        let size = ToothSize { radius_mm: drive.parameters().tooth_radius_mm, width_mm: drive.tooth_width_mm() };
        let contacts = Contacts::new(shape, &p.law, &p.materials, size, &p.series_compliance_mm_per_n)
            .ok_or_else(|| SolveError::Impossible(vec![Violation::LawOfOtherTeeth]))?;
        let mesh = load.mesh(drive, deviations.unwrap_or(&Deviations::default()));
        let tip_corner = if load.presses_corners(drive) { TipCorner::of(drive.ring_tooth())? } else { None };
        let loaded = Self {
            drive,
            mesh,
            compatibility: p.compatibility,
            zones: mesh.zones_in_torque(),
            input_torque_nmm: 1e3 * load.input_torque_nm(drive),
            law: p.law,
            contacts,
            wave_generator_moves: p.wave_generator_moves,
            tip_corner,
            corner_growth_mm_per_n: tip_corner.filter(|_| p.ring_teeth_bend).map_or(0.0, |corner| {
                corner.bending_growth() * p.materials.ring.compliance_per_mpa() / (PI * drive.tooth_width_mm())
            }),
            ring_bending: if p.ring_teeth_bend { Some(RingBending::new(drive, &p.materials.ring)?) } else { None },
            gaps: Gaps::new(drive, &p.clearance_um, p.modification, deviations),
        };
        let mut violations = p.clearance_violations_in(drive.sense(), drive.ring_tooth())?;
        violations.extend(p.modification.violation_in(drive));
        if matches!(drive.parameters().tooth, ToothShape::FlatSided { .. }) {
            violations.extend(p.carrier.violations_in(drive, -p.modification.wave_generator_equidistant_um));
        }
        let of_deviations = deviations.map(|deviations| p.deviation_violations(drive.parameters(), deviations));
        violations.extend(of_deviations.into_iter().flatten());
        if !violations.is_empty() {
            return Err(SolveError::Impossible(violations));
        }
        if !mesh.always_carries() {
            return Err(SolveError::NoToothInMesh {
                engagement_start_deg: drive.flank_limit().position.from_lobe_deg(),
                spacing_deg: mesh.spacing_deg(),
            });
        }
        // Only `projection` can fall to zero, and only with unequal stiffnesses. For cylinders and balls it is linear
        // in sin²γ and positive at the root, so its least value is there or at the largest γ. For flats the supported
        // length varies too.
        if p.compatibility == Compatibility::Projection {
            loaded.state(&Place::default(), drive.steepest_engaged()?)?;
        }
        Ok(loaded)
    }

    /// Returns the same drive for lists in which each tooth represents this many.
    pub(crate) const fn with_zones(self, zones: f64) -> Self {
        Self { zones, ..self }
    }

    /// Returns the same drive over the places of one zone ([`Mesh::as_one_zone`]). One tooth at each place represents
    /// all that carry alike. If items deviate, every tooth is listed.
    pub(crate) fn as_one_zone(&self) -> Self {
        let zones = if self.mesh.tells_items_apart() { self.zones } else { self.mesh.teeth_at_each_place() };
        Self { mesh: self.mesh.as_one_zone(), zones, ..*self }
    }

    /// Returns the factor from a sum over the listed teeth to the sum over all teeth.
    pub(crate) const fn zones(&self) -> f64 {
        self.zones
    }

    /// Returns the drive.
    pub const fn drive(&self) -> &'a Drive {
        self.drive
    }

    /// Returns its mesh, in which deviating items are distinguished.
    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the form of compatibility.
    pub const fn compatibility(&self) -> Compatibility {
        self.compatibility
    }

    /// Returns true if the law is linear and uniform and no contact has a gap. Unit loads then only have to be scaled.
    pub(crate) fn is_linear(&self) -> bool {
        matches!(self.tooth_law(), Some(ToothLaw::Linear { .. })) && self.flat().is_none() && self.gaps.is_nil()
    }

    /// Returns the law for column-wise evaluation, or none if it varies with the position.
    pub(crate) fn tooth_law(&self) -> Option<ToothLaw> {
        let is_plain = self.ring_bending.is_none() && !self.wave_generator_moves && self.tip_corner.is_none();
        self.contacts.tooth_law().filter(|_| is_plain)
    }

    /// Returns true if listed teeth may carry nothing because of an open gap.
    pub(crate) fn has_gaps(&self) -> bool {
        !self.gaps.is_nil() || self.tip_corner.is_some()
    }

    /// Returns the angle by which the wave generator moves a tooth at the flank's end by its distance from the axis.
    /// Returns 0 if no corner is pressed.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub(crate) fn distance_at_corner_rad(&self) -> Result<f64, NotConverged> {
        if self.tip_corner.is_none() {
            return Ok(0.0);
        }
        let center = self.drive.flank().locus().at(self.drive.flank_limit().position)?;
        Ok(center.center_radius_mm / center.cam_contact.lever_arm_mm)
    }

    /// Returns the corner that a tooth before the flank meets first.
    fn corner_at(&self, position: &Position) -> Option<&TipCorner> {
        self.tip_corner.as_ref().filter(|corner| corner.is_before_flank(position))
    }

    /// Returns a ball contact for column-wise evaluation.
    pub(crate) fn ball(&self, contact: Contact) -> Option<BallContact> {
        self.contacts.ball(contact)
    }

    /// Returns the flat of flat-sided teeth for column-wise evaluation.
    pub(crate) fn flat(&self) -> Option<Flat> {
        self.contacts.flat()
    }

    /// Returns the centre of a tooth at a position, and the curvature of each of its contacts in the plane of motion.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub(crate) fn center_and_curvatures(
        &self,
        position: Position,
    ) -> Result<(ToothCenter, PerContact<f64>), NotConverged> {
        let center = self.drive.flank().locus().at(position)?;
        Ok((center, curvature_per_mm(self.drive, &center, &self.drive.flank().at(&center))))
    }

    /// Returns the gaps.
    pub(crate) const fn gaps(&self) -> &Gaps<'a> {
        &self.gaps
    }

    /// Returns the pressure model of a contact of a tooth at a position.
    ///
    /// # Errors
    /// As [`Self::tooth`], except for gaps.
    pub(crate) fn pressure_at(&self, position: Position, contact: Contact) -> Result<Pressure, SolveError> {
        let (center, curvature_per_mm) = self.center_and_curvatures(position)?;
        self.pressure(contact, &center, *curvature_per_mm.get(contact))
    }

    /// Returns the Hertz stress law of a contact.
    pub(crate) const fn hertz(&self, contact: Contact) -> &HertzLine {
        self.contacts.hertz(contact)
    }

    /// Returns `M0` in N·mm.
    pub const fn input_torque_nmm(&self) -> f64 {
        self.input_torque_nmm
    }

    /// Returns the tooth at a position.
    ///
    /// # Errors
    /// [`NotConverged`] from the path, [`SolveError::FlatOffCarrier`] if a flat-sided tooth has left its slot.
    pub fn tooth(&self, position: Position) -> Result<ToothState, SolveError> {
        self.tooth_at(&Place::default(), position)
    }

    /// Returns the tooth at a position, in its place among items that may deviate.
    ///
    /// # Errors
    /// As [`Self::tooth`], and [`SolveError::Interference`] if a tooth is pressed without load.
    pub fn tooth_at(&self, place: &Place, position: Position) -> Result<ToothState, SolveError> {
        let locus = self.drive.flank().locus();
        self.state(place, locus.at(position)?)
    }

    fn state(&self, place: &Place, center: ToothCenter) -> Result<ToothState, SolveError> {
        let (sense, flank_curve) = (self.drive.sense(), self.drive.flank());
        let corner = self.corner_at(&center.position);
        let flank = corner.map_or_else(|| flank_curve.at(&center), |corner| corner.seen_from(&center));
        let at_corner = corner.and_then(|_| force_ratio_at_corner(sense, &center, &flank));
        let can_be_pressed = corner.is_none() || (at_corner.is_some() && !self.has_left_slot(&center));
        let force_ratio = at_corner.unwrap_or_else(|| force_ratio(sense, flank_curve, &center));
        let weights = match corner {
            Some(_) => force_ratio,
            None => Weights::of(self.compatibility, sense, flank_curve, &center).0,
        };
        let curvature_per_mm = curvature_per_mm(self.drive, &center, &flank);
        let places = PerContact::try_of(|contact| {
            Ok::<_, SolveError>(tooth::Place {
                force_ratio: *force_ratio.get(contact),
                weight: *weights.get(contact),
                pressure: self.pressure(contact, &center, *curvature_per_mm.get(contact))?,
            })
        })?;
        // Without friction, displacement and torque of the wave generator have the same lever arm.
        let arm_mm = center.cam_contact.lever_arm_mm;
        let usually_turned = self.gaps.usually_turned(center.center_radius_mm);
        let gap = if self.gaps.is_nil() && corner.is_none() {
            None
        } else if !can_be_pressed {
            Some(Gap { along_mm: f64::INFINITY, lost_motion_rad: 0.0 })
        } else {
            let mut gaps_mm = self.gaps.besides_turns(place, &center, &flank);
            let mut turned = self.gaps.turned_at(place);
            if self.wave_generator_moves || corner.is_some() {
                // This also holds in the valley, where the gap has no weight.
                turned = turned.and_aside(std::mem::take(&mut gaps_mm.carrier), center.center_radius_mm);
            }
            if let Some(corner) = corner {
                let apart_rad = turned.rad() - usually_turned.rad();
                gaps_mm.ring +=
                    corner.gap_mm(&flank) + self.beyond_lost_motion_mm(apart_rad, &center, &flank) / weights.ring;
            }
            let along_mm = weights.iter().fold(0.0, |sum, (contact, weight)| sum + weight * gaps_mm.get(contact));
            let lost_motion_rad = turned.lost_motion_rad(self.drive);
            Some(match self.compatibility {
                // Weights of clearances were checked before; a negative sum is rounding.
                Compatibility::Projection => Gap { along_mm: along_mm.max(0.0), lost_motion_rad },
                Compatibility::VirtualWork => {
                    let gap_mm = along_mm + (lost_motion_rad + self.lost_motion_rad()) * arm_mm;
                    if gap_mm < 0.0 {
                        let position_deg = center.position.from_lobe_deg();
                        let place = self.mesh.tells_items_apart().then_some(*place);
                        let gap_um = 1e3 * gap_mm;
                        return Err(SolveError::Interference { place, position_deg, input_angle_deg: None, gap_um });
                    }
                    Gap { along_mm, lost_motion_rad }
                }
            })
        };
        let bending =
            self.ring_bending.map_or(0.0, |ring| ring.compliance_mm_per_n(flank_curve.point(&center, &flank)));
        let approach = self.contacts.approach(&places, bending);
        if self.compatibility == Compatibility::Projection {
            let compliance_mm_per_n = approach.least_part_mm();
            if compliance_mm_per_n <= 0.0 {
                let position_deg = center.position.from_lobe_deg();
                return Err(SolveError::ComplianceNotPositive { position_deg, compliance_mm_per_n });
            }
        }
        let decline_mm_per_rad = self.arm_decline_mm_per_rad(&center);
        // The tooth reaches this place on the flank after the common lost motion, and has its lever arm then.
        let usual_rad = usually_turned.lost_motion_rad(self.drive);
        let spring = Spring::new(arm_mm, usual_rad, decline_mm_per_rad, gap, approach);
        let pressure = PerContact::of(|contact| places.get(contact).pressure);
        Ok(ToothState { center, flank, force_ratio, curvature_per_mm, pressure, spring })
    }

    /// Returns the decrease of a tooth's lever arm for each radian of wind-up of the wave generator. It is the
    /// derivative of `d tan γ cos γ` by the position, with γ in the cosine constant (docs/explanation/theory.md section
    /// 4.4).
    fn arm_decline_mm_per_rad(&self, center: &ToothCenter) -> f64 {
        if !self.wave_generator_moves {
            return 0.0;
        }
        let &ToothCenter { tan_pressure_angle: t, tan_pressure_angle_derivative, center_radius_mm, .. } = center;
        (tan_pressure_angle_derivative - t * t) * center_radius_mm / (1.0 + t * t).sqrt()
    }

    /// Returns the extra gap along `F_H` of a tooth before the flank, if flanks and walls are rotated by more than the
    /// common angle. On the flank the ring's force has k times the arm of `F_H`; here it has another, so the lost
    /// motion differs.
    fn beyond_lost_motion_mm(&self, turned_rad: f64, center: &ToothCenter, seen: &FlankPoint) -> f64 {
        let t = center.tan_pressure_angle;
        let ring_arm_mm = center.center_radius_mm * seen.tan_pressure_angle / (1.0 + t * t).sqrt();
        let of_flank_mm = self.drive.flank().teeth_per_wave() * center.cam_contact.lever_arm_mm;
        turned_rad * (ring_arm_mm - of_flank_mm)
    }

    /// Returns the pressure model of a contact of a tooth.
    fn pressure(&self, contact: Contact, center: &ToothCenter, curvature_per_mm: f64) -> Result<Pressure, SolveError> {
        if let (Contact::Ring, Some(corner)) = (contact, self.corner_at(&center.position)) {
            return Ok(Pressure::Corner(CornerContact {
                curvature_per_mm,
                angle_rad: corner.angle_off_flank_rad(center, &corner.seen_from(center)),
                bending_growth_mm_per_n: self.corner_growth_mm_per_n,
            }));
        }
        let center_radius_mm = center.center_radius_mm;
        let pressure = self.contacts.pressure(contact, curvature_per_mm, center_radius_mm)?;
        // Before the flank such a tooth carries no load.
        let unpressed = || self.corner_at(&center.position).and(self.flat()).map(|flat| Pressure::Flat(flat.whole()));
        pressure.or_else(unpressed).ok_or_else(|| {
            let position_deg = center.position.from_lobe_deg();
            SolveError::FlatOffCarrier { position_deg, center_radius_mm }
        })
    }

    /// Returns true if a tooth's flat lies outside its slot's walls.
    fn has_left_slot(&self, center: &ToothCenter) -> bool {
        self.flat().is_some_and(|flat| flat.borne_mm(center.center_radius_mm) <= 0.0)
    }

    /// Returns the pressure at the middle of each contact of a tooth, integrated along its path over the part. Wear
    /// follows from it (docs/explanation/theory.md section 10.4).
    ///
    /// # Errors
    /// [`NotConverged`] from the ellipse, [`SolveError::FlatOffCarrier`] if a flat-sided tooth has left its slot.
    pub(crate) fn line_load_n_per_mm(
        &self,
        center: &ToothCenter,
        flank: &FlankPoint,
        force_n: &PerContact<f64>,
    ) -> Result<PerContact<f64>, SolveError> {
        let curvature_per_mm = curvature_per_mm(self.drive, center, flank);
        let width_mm = self.drive.tooth_width_mm();
        PerContact::try_of(|contact| {
            let pressure = self.pressure(contact, center, *curvature_per_mm.get(contact))?;
            Ok(pressure.line_load_n_per_mm(*force_n.get(contact), width_mm))
        })
    }

    /// Returns the forces on a tooth after the wave generator has rotated by `Δφ`; zero if a gap is still open.
    ///
    /// # Errors
    /// [`NotConverged`] from the law's inverse.
    pub fn forces_n(&self, tooth: &ToothState, wind_up: &WindUp) -> Result<PerContact<f64>, NotConverged> {
        let cam_force_n = tooth.spring.force_n(&wind_up.rotation)?;
        Ok(PerContact::of(|contact| cam_force_n * tooth.force_ratio.get(contact)))
    }

    /// Returns the three forces and the three stresses on a tooth after the wave generator has rotated by `Δφ`.
    pub(crate) fn loads(&self, tooth: &ToothState, wind_up: &WindUp) -> Result<[f64; 6], NotConverged> {
        let force_n = self.forces_n(tooth, wind_up)?;
        let stress_mpa = self.stress_mpa(tooth, &force_n);
        Ok([
            force_n.wave_generator,
            force_n.ring,
            force_n.carrier,
            stress_mpa.wave_generator,
            stress_mpa.ring,
            stress_mpa.carrier,
        ])
    }

    /// Returns the Hertz stresses under the forces on a tooth.
    pub fn stress_mpa(&self, tooth: &ToothState, force_n: &PerContact<f64>) -> PerContact<f64> {
        PerContact::of(|contact| tooth.pressure.get(contact).stress_mpa(*force_n.get(contact)))
    }

    /// Returns the springs of these teeth: those of one zone, or of all zones if they are not alike.
    fn springs<'s>(&self, teeth: &'s [ToothState]) -> Springs<'s, ToothState> {
        Springs::new(teeth, self.zones)
    }

    /// Returns the `Δφ` that balances the input torque over these teeth of one zone, or of all if zones are not alike.
    ///
    /// # Errors
    /// [`SolveError::NoLeverArm`] if none can carry, [`SolveError::JohnsonBeyondHalfWidth`] if that law ends before.
    pub fn wind_up(&self, teeth: &[ToothState]) -> Result<WindUp, SolveError> {
        let wind_up = self.springs(teeth).wind_up(self.input_torque_nmm)?.ok_or_else(|| self.carries_nothing(teeth))?;
        if let Some(end) = self.law_end(teeth, &wind_up.rotation)? {
            return Err(end.error(false));
        }
        Ok(WindUp { lost_motion_rad: self.lost_motion_rad(), ..wind_up })
    }

    /// Returns the reason why teeth carry no torque, or less than the required torque.
    pub(crate) fn carries_nothing(&self, teeth: &[ToothState]) -> SolveError {
        if self.wave_generator_moves && teeth.iter().any(|tooth| tooth.spring.static_arm_mm > 0.0) {
            SolveError::TurnedPastTeeth
        } else {
            SolveError::NoLeverArm
        }
    }

    /// Returns the lost motion common to all teeth, which their closing angles exclude.
    pub(crate) fn lost_motion_rad(&self) -> f64 {
        self.gaps.lost_motion_rad()
    }

    /// Returns the largest input torque under which no contact of these teeth exceeds its stress, and the contact that
    /// reaches it.
    ///
    /// Loads grow with `Δφ` and `Δφ` with the torque, so the first contact to reach its stress sets `Δφ`, and that the
    /// torque.
    ///
    /// If Johnson's law ends before, the result is the torque at its end. If the lever arms change with wind-up, the
    /// torque may have a maximum before any contact reaches its stress. That maximum is then the result: larger torques
    /// are not carried until a contact has exceeded its stress.
    ///
    /// # Errors
    /// As [`Self::wind_up`], except for the end of Johnson's law.
    pub fn torque_limit(
        &self,
        teeth: &[ToothState],
        allowable_stress_mpa: &PerContact<f64>,
    ) -> Result<TorqueLimit, SolveError> {
        let limit = Self::first_to_reach(teeth, |tooth, contact| {
            tooth.pressure.get(contact).force_n(*allowable_stress_mpa.get(contact)) / tooth.force_ratio.get(contact)
        });
        let summit = self.springs(teeth).summit_before(limit.as_ref().map(|limit| &limit.rotation))?;
        let rotation = summit.map(|summit| summit.rotation).or(limit.as_ref().map(|limit| limit.rotation));
        let rotation = rotation.ok_or_else(|| self.carries_nothing(teeth))?;
        if let Some(end) = self.law_end(teeth, &rotation)? {
            let LawEnd { contact, input_torque_limit_nmm: input_torque_nmm, .. } = end;
            return Ok(TorqueLimit { input_torque_nmm, contact, turns_past_teeth: false, law_end: Some(end) });
        }
        let input_torque_nmm = self.springs(teeth).torque_nmm(&rotation)?.value;
        let contact = match limit {
            Some(FirstLimit { contact, .. }) if summit.is_none() => contact,
            _ => self.nearest_to_stress(teeth, &rotation, allowable_stress_mpa)?,
        };
        Ok(TorqueLimit { input_torque_nmm, contact, turns_past_teeth: summit.is_some(), law_end: None })
    }

    /// Returns the contact with the largest ratio of stress to allowable stress at a rotation.
    fn nearest_to_stress(
        &self,
        teeth: &[ToothState],
        rotation: &Rotation,
        allowable_stress_mpa: &PerContact<f64>,
    ) -> Result<Contact, NotConverged> {
        let mut nearest = (Contact::WaveGenerator, 0.0);
        for tooth in teeth {
            let cam_force_n = tooth.spring.force_n(rotation)?;
            let force_n = PerContact::of(|contact| cam_force_n * tooth.force_ratio.get(contact));
            for (contact, stress_mpa) in self.stress_mpa(tooth, &force_n).iter() {
                let share = stress_mpa / allowable_stress_mpa.get(contact);
                if share > nearest.1 {
                    nearest = (contact, share);
                }
            }
        }
        Ok(nearest.0)
    }

    /// Returns the tooth and contact that reach a given `F_H` at the least rotation.
    fn first_to_reach(teeth: &[ToothState], limit_n: impl Fn(&ToothState, Contact) -> f64) -> Option<FirstLimit<'_>> {
        let first_rad = teeth.iter().map(|tooth| tooth.spring.closing_rad).fold(f64::INFINITY, f64::min);
        let mut least: Option<(f64, FirstLimit<'_>)> = None;
        for tooth in teeth {
            let spring = &tooth.spring;
            let Spring { closing_rad, ref approach, .. } = *spring;
            for (contact, &ratio) in tooth.force_ratio.iter() {
                if ratio > 0.0 && spring.can_carry() {
                    let excess_rad = spring.excess_rad(approach.approach_mm(limit_n(tooth, contact)));
                    let from_first_rad = excess_rad + (closing_rad - first_rad);
                    if excess_rad.is_finite() && least.as_ref().is_none_or(|(least_rad, _)| from_first_rad < *least_rad)
                    {
                        let rotation = Rotation { closing_rad, excess_rad };
                        least = Some((from_first_rad, FirstLimit { tooth, contact, rotation }));
                    }
                }
            }
        }
        least.map(|(_, limit)| limit)
    }

    /// Returns the end of Johnson's law if some contact is wider at this rotation than the law allows.
    fn law_end(&self, teeth: &[ToothState], rotation: &Rotation) -> Result<Option<LawEnd>, SolveError> {
        let ContactLaw::Johnson { depth_mm } = &self.law else { return Ok(None) };
        let is_beyond = |tooth: &ToothState| tooth.spring.displacement_mm(rotation) >= tooth.spring.approach.limit_mm();
        if !teeth.iter().any(is_beyond) {
            return Ok(None);
        }
        let tooth_radius_mm = self.drive.parameters().tooth_radius_mm;
        let tooth_width_mm = self.drive.tooth_width_mm();
        let limit_mm = |contact| WIDEST_SHARE * least_length_mm(depth_mm, contact, tooth_radius_mm);
        let limit = Self::first_to_reach(teeth, |tooth, contact| {
            // The half-width's square is proportional to the force.
            let pressure = tooth.pressure.get(contact);
            // The law applies to line contacts only.
            if matches!(pressure, Pressure::Corner(_) | Pressure::Flat(_)) {
                return f64::INFINITY;
            }
            let stress_mpa = pressure.stress_mpa(1.0);
            let share = limit_mm(contact) / half_width_mm(1.0, stress_mpa, tooth_width_mm);
            share * share / tooth.force_ratio.get(contact)
        });
        let FirstLimit { tooth, contact, rotation } = limit.ok_or_else(|| self.carries_nothing(teeth))?;
        Ok(Some(LawEnd {
            contact,
            position_deg: tooth.center.position.from_lobe_deg(),
            half_width_limit_mm: limit_mm(contact),
            input_torque_limit_nmm: self.springs(teeth).torque_nmm(&rotation)?.value,
        }))
    }
}

/// The first of many contacts to reach its limit.
struct FirstLimit<'a> {
    tooth: &'a ToothState,
    contact: Contact,
    rotation: Rotation,
}
