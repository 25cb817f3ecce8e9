//! Equilibrium of a tooth and compatibility of all of them at one input angle (docs/theory.md section 4).

use crate::SolveError;
use crate::contact::{Approach, Contact, ContactLaw, HertzLine, Materials, PerContact};
use crate::drive::{Draft, Drive, WAVES};
use crate::locus::ToothCenter;
use crate::mesh::Mesh;
use crate::position::Position;
use crate::ring::{FlankPoint, RingFlank};
use crate::root::{NotConverged, ValueAndSlope, newton_in_bracket};
use crate::violation::{Parameter, Violation};

/// How the three approaches of a tooth add up to the rotation of the wave generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compatibility {
    /// The paper's \[3\]-\[6\]: each approach projected on the direction of `F_H`.
    Projection,
    /// Virtual work: the frictionless solution for a tooth whose centre is free to move.
    VirtualWork,
}

/// The torque that the drive transmits, ring fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Torque {
    /// At the wave generator, in N·m.
    Input(f64),
    /// At the carrier, in N·m; losses neglected.
    Output(f64),
}

/// What describes a load.
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
    /// Gap along the normal of each contact, in µm.
    pub clearance_um: PerContact<f64>,
    /// The contact stress that the torque capacity is asked for.
    pub allowable_stress_mpa: Option<f64>,
}

impl LoadParameters {
    /// The gaps that this drive cannot have under `projection`: those that it weighs negatively somewhere on the engaged flank,
    /// where more gap would mean more load. Virtual work weighs none so. Of a drive only `s` and the ring are needed, of the load
    /// the gap itself.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn clearance_violations(&self, draft: &Draft) -> Result<Vec<Violation>, NotConverged> {
        let gaps = self.clearance_um.iter();
        let gaps: Vec<_> =
            gaps.filter(|&(contact, &gap)| gap > 0.0 && Parameter::Clearance(contact).check(gap).is_none()).collect();
        let Some((sense, ring)) = draft.sense.zip(draft.ring) else { return Ok(Vec::new()) };
        if self.compatibility == Compatibility::VirtualWork || gaps.is_empty() {
            return Ok(Vec::new());
        }
        // Both weights fall with the pressure angle (or, for s = -1, one is negative throughout).
        let weight = Weights::of(Compatibility::Projection, sense, &ring.flank, &ring.steepest_engaged()?).0;
        Ok(gaps
            .into_iter()
            .filter(|&(contact, _)| *weight.get(contact) < 0.0)
            .map(|(contact, &clearance_um)| Violation::ClearanceNotMonotone { contact, clearance_um })
            .collect())
    }
}

/// A load that was checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadCase(LoadParameters);

impl LoadCase {
    /// Checks the parameters.
    ///
    /// # Errors
    /// Every value that is out of its range.
    pub fn new(parameters: &LoadParameters) -> Result<Self, Vec<Violation>> {
        let torque = match parameters.torque {
            Torque::Input(value) => (Parameter::InputTorque, value),
            Torque::Output(value) => (Parameter::OutputTorque, value),
        };
        let mut values: Vec<_> = parameters.materials.parameters().collect();
        values.push(torque);
        if let ContactLaw::Fixed(stiffness) = &parameters.law {
            values.extend(stiffness.iter().map(|(contact, &value)| (Parameter::Stiffness(contact), value)));
        }
        let gaps = parameters.clearance_um.iter();
        values.extend(gaps.map(|(contact, &value)| (Parameter::Clearance(contact), value)));
        values.extend(parameters.allowable_stress_mpa.map(|value| (Parameter::AllowableStress, value)));
        let violations: Vec<_> = values.into_iter().filter_map(|(parameter, value)| parameter.check(value)).collect();
        if violations.is_empty() { Ok(Self(*parameters)) } else { Err(violations) }
    }

    /// The parameters, as given.
    pub const fn parameters(&self) -> &LoadParameters {
        &self.0
    }

    /// The torque at the wave generator. Losses neglected, it is the carrier's over the absolute ratio, ring fixed.
    pub fn input_torque_nm(&self, drive: &Drive) -> f64 {
        match self.0.torque {
            Torque::Input(torque) => torque,
            Torque::Output(torque) => torque / drive.teeth_per_wave(),
        }
    }

    /// The torque at the carrier.
    pub fn output_torque_nm(&self, drive: &Drive) -> f64 {
        match self.0.torque {
            Torque::Input(torque) => torque * drive.teeth_per_wave(),
            Torque::Output(torque) => torque,
        }
    }

    /// Whether any contact has a gap.
    pub fn has_clearance(&self) -> bool {
        self.0.clearance_um.iter().any(|(_, &gap)| gap > 0.0)
    }
}

/// What an approach at each contact adds to the displacement ξ along `F_H`.
struct Weights(PerContact<f64>);

impl Weights {
    fn of(compatibility: Compatibility, sense: f64, flank: &RingFlank, center: &ToothCenter) -> Self {
        let force_ratio = force_ratio(sense, flank, center);
        match compatibility {
            Compatibility::VirtualWork => Self(force_ratio),
            // The paper's cos(γ + sβ) and s sin γ. With tan β = k tan γ the first, times F_K/F_H = cos γ/cos β, is 1 - (1 + sk) sin²γ.
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
fn force_ratio(sense: f64, flank: &RingFlank, center: &ToothCenter) -> PerContact<f64> {
    let t = center.tan_pressure_angle;
    let tan_ring = flank.teeth_per_wave() * t;
    let cos_cam = 1.0 / (1.0 + t * t).sqrt();
    PerContact {
        wave_generator: 1.0,
        ring: (1.0 + tan_ring * tan_ring).sqrt() * cos_cam,
        carrier: t * cos_cam * (flank.teeth_per_wave() + sense),
    }
}

/// A tooth at a position, with what the load makes of it per unit of `F_H`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothState {
    /// Its centre and its contact with the cam.
    pub center: ToothCenter,
    /// Its contact with the ring.
    pub flank: FlankPoint,
    /// Forces over `F_H`.
    pub force_ratio: PerContact<f64>,
    /// Relative curvature of each contact, in 1/mm.
    pub curvature_per_mm: PerContact<f64>,
    /// `c` in `ξ = c F_H^(1/n)`: displacement along `F_H`, in mm/N^(1/n).
    pub compliance: f64,
    /// `g/|h'|`: how far the wave generator turns before the clearances at this tooth are closed; infinite where it has no lever arm.
    pub closing_rad: f64,
}

/// A drive under a load: everything that does not depend on the position, worked out once.
#[derive(Debug, Clone, Copy)]
pub struct LoadedDrive<'a> {
    drive: &'a Drive,
    compatibility: Compatibility,
    input_torque_nmm: f64,
    approach: Approach,
    clearance_mm: PerContact<f64>,
    hertz: PerContact<HertzLine>,
}

/// How far the wave generator turns under the load at one input angle, and how stiffly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindUp {
    /// Where the first tooth's clearances are closed.
    pub closing_rad: f64,
    /// What is turned beyond that. Kept apart, because it may be small against the clearances and alone makes the forces.
    pub excess_rad: f64,
    /// `dM0/dΔφ` at the load.
    pub stiffness_nmm_per_rad: f64,
}

impl WindUp {
    /// `Δφ`.
    pub const fn rotation_rad(&self) -> f64 {
        self.closing_rad + self.excess_rad
    }
}

/// A stress that limits the torque at one input angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueLimit {
    /// The torque at the wave generator under which it is reached.
    pub input_torque_nmm: f64,
    /// The contact that reaches it first.
    pub contact: Contact,
}

impl<'a> LoadedDrive<'a> {
    /// The drive under the load.
    ///
    /// # Errors
    /// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] where no finite forces exist.
    pub fn new(drive: &'a Drive, load: &LoadCase) -> Result<Self, SolveError> {
        let p = load.parameters();
        let width_mm = drive.parameters().tooth_width_mm;
        let loaded = Self {
            drive,
            compatibility: p.compatibility,
            input_torque_nmm: 1e3 * load.input_torque_nm(drive),
            approach: p.law.approach(&p.materials, width_mm),
            clearance_mm: PerContact::of(|contact| 1e-3 * p.clearance_um.get(contact)),
            hertz: PerContact::of(|contact| HertzLine::new(&p.materials, contact, width_mm)),
        };
        let mesh = Mesh::new(drive);
        if !mesh.always_carries() {
            return Err(SolveError::NoToothInMesh {
                engagement_start_deg: drive.flank_limit().position.from_major_deg(),
                spacing_deg: mesh.spacing_deg(),
            });
        }
        // Only `projection` can fall to zero, and only with unlike stiffnesses. It is then linear in sin²γ and positive at the root, so its
        // least value stands there or where γ is largest.
        if p.compatibility == Compatibility::Projection {
            let ToothState { center, compliance, .. } = loaded.state(drive.steepest_engaged()?);
            if compliance <= 0.0 {
                let position_deg = center.position.from_major_deg();
                return Err(SolveError::ComplianceNotPositive { position_deg, compliance_mm_per_n: compliance });
            }
        }
        Ok(loaded)
    }

    /// The drive.
    pub const fn drive(&self) -> &'a Drive {
        self.drive
    }

    /// The form of compatibility.
    pub const fn compatibility(&self) -> Compatibility {
        self.compatibility
    }

    /// `1/k` of each contact, where the law is linear and no contact has a gap: where unit loads only have to be scaled.
    pub(crate) fn linear_compliance_mm_per_n(&self) -> Option<PerContact<f64>> {
        let is_gapless = self.clearance_mm.iter().all(|(_, &gap)| gap == 0.0);
        (is_gapless && self.approach.exponent >= 1.0).then_some(self.approach.coefficient)
    }

    /// Hertz stress of a contact.
    pub(crate) const fn hertz(&self, contact: Contact) -> &HertzLine {
        self.hertz.get(contact)
    }

    /// `M0` in N·mm.
    pub const fn input_torque_nmm(&self) -> f64 {
        self.input_torque_nmm
    }

    /// The tooth at a position.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn tooth(&self, position: Position) -> Result<ToothState, NotConverged> {
        let locus = self.drive.flank().locus();
        Ok(self.state(locus.at(position)?))
    }

    fn state(&self, center: ToothCenter) -> ToothState {
        let flank_curve = self.drive.flank();
        let flank = flank_curve.at(&center);
        let r = self.drive.parameters().tooth_radius_mm;
        let force_ratio = force_ratio(self.drive.sense(), flank_curve, &center);
        let weights = Weights::of(self.compatibility, self.drive.sense(), flank_curve, &center).0;
        let cam = flank_curve.locus().cam();
        let curvature_per_mm = PerContact {
            wave_generator: 1.0 / r + 1.0 / cam.curvature_radius_mm(&center.cam_contact),
            ring: 1.0 / (r * flank.regularity),
            carrier: 1.0 / r,
        };
        let (mut compliance, mut gap_mm) = (0.0, 0.0);
        for (contact, weight) in weights.iter() {
            let approach = self.approach.coefficient.get(contact) * self.approach.power(*force_ratio.get(contact));
            compliance += weight * approach;
            gap_mm += weight * self.clearance_mm.get(contact);
        }
        let closing_rad = if gap_mm > 0.0 { gap_mm / center.cam_contact.lever_arm_mm } else { 0.0 };
        ToothState { center, flank, force_ratio, curvature_per_mm, compliance, closing_rad }
    }

    /// The forces on a tooth when the wave generator has turned by `Δφ`, from `F_H = ((Δφ |h'| - g)/c)^n`; none where a gap is
    /// still open.
    pub fn forces_n(&self, tooth: &ToothState, wind_up: &WindUp) -> PerContact<f64> {
        let cam_force_n = self.cam_force_n(tooth, tooth.displacement_mm(wind_up.closing_rad, wind_up.excess_rad));
        PerContact::of(|contact| cam_force_n * tooth.force_ratio.get(contact))
    }

    fn cam_force_n(&self, tooth: &ToothState, displacement_mm: f64) -> f64 {
        self.approach.root(displacement_mm / tooth.compliance)
    }

    /// The three forces and the three stresses on a tooth when the wave generator has turned by `Δφ`.
    pub(crate) fn loads(&self, tooth: &ToothState, wind_up: &WindUp) -> [f64; 6] {
        let force_n = self.forces_n(tooth, wind_up);
        let stress_mpa = self.stress_mpa(tooth, &force_n);
        [
            force_n.wave_generator,
            force_n.ring,
            force_n.carrier,
            stress_mpa.wave_generator,
            stress_mpa.ring,
            stress_mpa.carrier,
        ]
    }

    /// The Hertz stresses under the forces on a tooth.
    pub fn stress_mpa(&self, tooth: &ToothState, force_n: &PerContact<f64>) -> PerContact<f64> {
        PerContact::of(|contact| {
            self.hertz.get(contact).stress_mpa(*force_n.get(contact), *tooth.curvature_per_mm.get(contact))
        })
    }

    /// The torque `U Σ F_H |h'|` \[2\] of these teeth of one zone, and its derivative by `Δφ`.
    fn torque(&self, teeth: &[ToothState], closing_rad: f64, excess_rad: f64) -> ValueAndSlope {
        let mut torque = ValueAndSlope { value: 0.0, slope: 0.0 };
        for tooth in teeth {
            let displacement_mm = tooth.displacement_mm(closing_rad, excess_rad);
            if displacement_mm > 0.0 {
                let lever_arm_mm = tooth.center.cam_contact.lever_arm_mm;
                let torque_nmm = WAVES * self.cam_force_n(tooth, displacement_mm) * lever_arm_mm;
                torque.value += torque_nmm;
                // dF/dΔφ = n F |h'|/(Δφ |h'| - g)
                torque.slope += torque_nmm * (lever_arm_mm / displacement_mm) / self.approach.exponent;
            }
        }
        torque
    }

    /// The `Δφ` that balances the input torque over these teeth of one zone.
    ///
    /// Without clearance all teeth carry, and `Δφ = (M0/(U Σ |h'| (|h'|/c)^n))^(1/n)`. With clearance a tooth carries from `Δφ = g/|h'|` on;
    /// in that order the teeth are taken in until the torque is reached: for a linear law the sum over those that carry is closed
    /// again, for a power law one increasing equation is left.
    ///
    /// # Errors
    /// [`NotConverged`] where that equation is not solved.
    pub fn wind_up(&self, teeth: &[ToothState]) -> Result<WindUp, NotConverged> {
        let closing_rad = teeth.iter().map(|tooth| tooth.closing_rad).fold(f64::INFINITY, f64::min);
        let excess_rad = if teeth.iter().all(|tooth| tooth.closing_rad == 0.0) {
            self.gapless_rotation_rad(teeth)
        } else {
            self.excess_rad(teeth, closing_rad)?
        };
        let stiffness_nmm_per_rad = self.torque(teeth, closing_rad, excess_rad).slope;
        Ok(WindUp { closing_rad, excess_rad, stiffness_nmm_per_rad })
    }

    fn gapless_rotation_rad(&self, teeth: &[ToothState]) -> f64 {
        let torque_of_unit: f64 = teeth
            .iter()
            .map(|tooth| {
                let lever_arm_mm = tooth.center.cam_contact.lever_arm_mm;
                lever_arm_mm * self.approach.root(lever_arm_mm / tooth.compliance)
            })
            .sum();
        self.approach.power(self.input_torque_nmm / (WAVES * torque_of_unit))
    }

    /// What is turned beyond the first closing angle, by an exact active set.
    fn excess_rad(&self, teeth: &[ToothState], closing_rad: f64) -> Result<f64, NotConverged> {
        let mut order: Vec<ToothState> = teeth.iter().filter(|tooth| tooth.closing_rad.is_finite()).copied().collect();
        order.sort_by(|one, other| one.closing_rad.total_cmp(&other.closing_rad));
        // The next tooth is taken in if those before make less than the torque when it begins to carry.
        let mut carrying = 1;
        while let Some(next) = order.get(carrying)
            && self.torque(&order[..carrying], closing_rad, next.closing_rad - closing_rad).value
                < self.input_torque_nmm
        {
            carrying += 1;
        }
        let order = &order[..carrying];
        if self.approach.exponent < 1.0 {
            // With all gaps closed from the start these teeth would need less, and from the last closing angle on they need no more.
            let gapless_rad = self.gapless_rotation_rad(order);
            let last_rad = order[carrying - 1].closing_rad - closing_rad;
            let (low, high) = (last_rad.max(gapless_rad), last_rad + gapless_rad);
            newton_in_bracket("rotation that closes the gaps", low, high, high, |excess_rad| {
                let torque = self.torque(order, closing_rad, excess_rad);
                ValueAndSlope { value: torque.value - self.input_torque_nmm, slope: torque.slope }
            })
        } else {
            let (mut stiffness, mut torque_of_gaps) = (0.0, 0.0);
            for tooth in order {
                let lever_arm_mm = tooth.center.cam_contact.lever_arm_mm;
                let share = lever_arm_mm * (lever_arm_mm / tooth.compliance);
                stiffness += share;
                torque_of_gaps += share * (tooth.closing_rad - closing_rad);
            }
            Ok((self.input_torque_nmm / WAVES + torque_of_gaps) / stiffness)
        }
    }

    /// The largest input torque under which no contact of these teeth exceeds a stress, and the contact that reaches it.
    ///
    /// Loads grow with `Δφ` and `Δφ` with the torque, so the first contact to reach the stress sets `Δφ`, and that the torque.
    pub fn torque_limit(&self, teeth: &[ToothState], allowable_stress_mpa: f64) -> TorqueLimit {
        let closing_rad = teeth.iter().map(|tooth| tooth.closing_rad).fold(f64::INFINITY, f64::min);
        let mut limit = (f64::INFINITY, Contact::WaveGenerator);
        for tooth in teeth {
            let lever_arm_mm = tooth.center.cam_contact.lever_arm_mm;
            for (contact, hertz) in self.hertz.iter() {
                let ratio = *tooth.force_ratio.get(contact);
                if ratio > 0.0 && lever_arm_mm > 0.0 {
                    let allowed_n = hertz.force_n(allowable_stress_mpa, *tooth.curvature_per_mm.get(contact));
                    let displacement_mm = tooth.compliance * self.approach.power(allowed_n / ratio);
                    let excess_rad = displacement_mm / lever_arm_mm + (tooth.closing_rad - closing_rad);
                    if excess_rad < limit.0 {
                        limit = (excess_rad, contact);
                    }
                }
            }
        }
        TorqueLimit { input_torque_nmm: self.torque(teeth, closing_rad, limit.0).value, contact: limit.1 }
    }
}

impl ToothState {
    /// `Δφ |h'| - g`, or nothing while the gap is open, for a rotation of `excess_rad` beyond `closing_rad`.
    fn displacement_mm(&self, closing_rad: f64, excess_rad: f64) -> f64 {
        let closed_rad = excess_rad - (self.closing_rad - closing_rad);
        if closed_rad > 0.0 { closed_rad * self.center.cam_contact.lever_arm_mm } else { 0.0 }
    }
}
