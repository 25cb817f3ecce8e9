//! Equilibrium of a tooth and compatibility of all of them at one input angle (docs/theory.md section 4).

use crate::SolveError;
use crate::contact::{ContactLaw, HertzLine, Materials, PerContact};
use crate::drive::{Drive, WAVES};
use crate::locus::ToothCenter;
use crate::mesh::Mesh;
use crate::position::Position;
use crate::ring::FlankPoint;
use crate::root::NotConverged;
use crate::violation::{Parameter, Violation};

/// How the three approaches of a tooth add up to the rotation of the wave generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compatibility {
    /// The paper's [3]-[6]: each approach projected on the direction of `F_H`.
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
        let violations: Vec<_> = values.into_iter().filter_map(|(parameter, value)| parameter.check(value)).collect();
        if violations.is_empty() { Ok(Self(*parameters)) } else { Err(violations) }
    }

    /// The parameters, as given.
    pub const fn parameters(&self) -> &LoadParameters {
        &self.0
    }
}

/// A tooth at a position, with what the load makes of it per unit of `F_H`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothState {
    /// Its centre and its contact with the cam.
    pub center: ToothCenter,
    /// Its contact with the ring.
    pub flank: FlankPoint,
    /// Forces over `F_H`: 1, `F_K/F_H = cos γ/cos β`, `F_S/F_H = sin γ Z_G/U` [1].
    pub force_ratio: PerContact<f64>,
    /// Relative curvature of each contact, in 1/mm.
    pub curvature_per_mm: PerContact<f64>,
    /// `c = ξ/F_H`: displacement along `F_H` per force.
    pub compliance_mm_per_n: f64,
}

/// A drive under a load: everything that does not depend on the position, worked out once.
#[derive(Debug, Clone, Copy)]
pub struct LoadedDrive<'a> {
    drive: &'a Drive,
    compatibility: Compatibility,
    input_torque_nmm: f64,
    /// `1/k` of each contact.
    contact_compliance_mm_per_n: PerContact<f64>,
    hertz: PerContact<HertzLine>,
}

impl<'a> LoadedDrive<'a> {
    /// The drive under the load.
    ///
    /// # Errors
    /// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] where no finite forces exist.
    pub fn new(drive: &'a Drive, load: &LoadCase) -> Result<Self, SolveError> {
        let p = load.parameters();
        let width_mm = drive.parameters().tooth_width_mm;
        let input_torque_nm = match p.torque {
            Torque::Input(torque) => torque,
            Torque::Output(torque) => torque / drive.teeth_per_wave(),
        };
        let stiffness = p.law.stiffness_n_per_mm(&p.materials, width_mm);
        let loaded = Self {
            drive,
            compatibility: p.compatibility,
            input_torque_nmm: 1e3 * input_torque_nm,
            contact_compliance_mm_per_n: PerContact::of(|contact| 1.0 / stiffness.get(contact)),
            hertz: PerContact::of(|contact| HertzLine::new(&p.materials, contact, width_mm)),
        };
        let mesh = Mesh::new(drive);
        if !mesh.always_carries() {
            return Err(SolveError::NoToothInMesh {
                engagement_start_deg: drive.flank_limit().position.from_major_deg(),
                spacing_deg: mesh.spacing_deg(),
            });
        }
        // Only `projection` can fall to zero. It is linear in sin²γ and positive at the root, so its least value stands there or
        // where γ is largest.
        if p.compatibility == Compatibility::Projection {
            let ToothState { center, compliance_mm_per_n, .. } = loaded.state(drive.steepest_engaged()?);
            if compliance_mm_per_n <= 0.0 {
                let position_deg = center.position.from_major_deg();
                return Err(SolveError::ComplianceNotPositive { position_deg, compliance_mm_per_n });
            }
        }
        Ok(loaded)
    }

    /// The drive.
    pub const fn drive(&self) -> &'a Drive {
        self.drive
    }

    /// `M0` in N·mm.
    pub const fn input_torque_nmm(&self) -> f64 {
        self.input_torque_nmm
    }

    /// Hertz stress of each contact.
    pub const fn hertz(&self) -> &PerContact<HertzLine> {
        &self.hertz
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
        let t = center.tan_pressure_angle;
        let cos_cam = 1.0 / (1.0 + t * t).sqrt();
        let force_ratio = PerContact {
            wave_generator: 1.0,
            ring: cos_cam / flank.cos_pressure_angle,
            carrier: t * cos_cam * self.drive.teeth_per_wave(),
        };
        let cam = flank_curve.locus().cam();
        let curvature_per_mm = PerContact {
            wave_generator: 1.0 / r + 1.0 / cam.curvature_radius_mm(&center.cam_contact),
            ring: 1.0 / (r * flank.regularity),
            carrier: 1.0 / r,
        };
        let compliance_mm_per_n = self.compliance_mm_per_n(&force_ratio, t * cos_cam);
        ToothState { center, flank, force_ratio, curvature_per_mm, compliance_mm_per_n }
    }

    fn compliance_mm_per_n(&self, force_ratio: &PerContact<f64>, sin_cam: f64) -> f64 {
        let contact = &self.contact_compliance_mm_per_n;
        match self.compatibility {
            // The paper's δ_H + δ_K cos(γ + sβ) + s δ_S sin γ over F_H. With tan β = k tan γ and Z_G/U = k + s
            // its ring term is (1 - (1 + sk) sin²γ)/k_K and its carrier term (1 + sk) sin²γ/k_S.
            Compatibility::Projection => {
                let sense = self.drive.sense();
                let carrier_share = (1.0 + sense * self.drive.flank().teeth_per_wave()) * sin_cam * sin_cam;
                contact.wave_generator + contact.ring * (1.0 - carrier_share) + contact.carrier * carrier_share
            }
            Compatibility::VirtualWork => {
                contact.wave_generator
                    + contact.ring * force_ratio.ring * force_ratio.ring
                    + contact.carrier * force_ratio.carrier * force_ratio.carrier
            }
        }
    }

    /// `Δφ`, in rad, that balances the input torque over these teeth of one zone: with `F_H = Δφ |h'|/c` the torque balance [2] is
    /// `M0 = U Δφ Σ h'²/c`.
    pub fn wind_up_rad(&self, teeth: &[ToothState]) -> f64 {
        let torque_per_rotation: f64 = teeth
            .iter()
            .map(|tooth| {
                let lever_arm_mm = tooth.center.cam_contact.lever_arm_mm;
                lever_arm_mm * (lever_arm_mm / tooth.compliance_mm_per_n)
            })
            .sum();
        self.input_torque_nmm / (WAVES * torque_per_rotation)
    }
}

impl ToothState {
    /// The forces on the tooth once `Δφ` is known, in N.
    pub fn forces_n(&self, wind_up_rad: f64) -> PerContact<f64> {
        let force_n = wind_up_rad * (self.center.cam_contact.lever_arm_mm / self.compliance_mm_per_n);
        PerContact::of(|contact| force_n * self.force_ratio.get(contact))
    }
}
