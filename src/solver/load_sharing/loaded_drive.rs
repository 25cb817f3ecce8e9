//! A drive under a load: forces, stresses and wind-up of its teeth at one input angle.

use std::f64::consts::PI;

use super::equilibrium::{Compatibility, ToothState};
use super::load::{LoadCase, LoadParameters};
use crate::SolveError;
use crate::contact::PerContact;
use crate::contact_law::ContactLaw;
use crate::drive::{Drive, ToothShape};
use crate::gaps::{Deviations, Gaps};
use crate::mesh::{Mesh, Place};
use crate::ring::TipCorner;
use crate::ring_bending::RingBending;
use crate::root::NotConverged;
use crate::springs::{Springs, WindUp};
use crate::tooth::Contacts;
use crate::violation::{Parameter, Violation};

/// A drive under a load, with everything precomputed that does not depend on the position.
#[derive(Debug, Clone, Copy)]
pub struct LoadedDrive<'a> {
    pub(super) drive: &'a Drive,
    /// Load as it was checked.
    pub(crate) load: LoadParameters,
    pub(super) mesh: Mesh,
    /// Factor from a sum over the listed teeth to the sum over all teeth.
    pub(crate) zones: f64,
    pub(super) input_torque_nmm: f64,
    pub(crate) contacts: Contacts,
    pub(super) ring_bending: Option<RingBending>,
    pub(super) tip_corner: Option<TipCorner>,
    /// Growth of the corner's compliance for each unit of the logarithm by which a contact there is narrower, if the
    /// ring's teeth bend.
    pub(super) corner_growth_mm_per_n: f64,
    pub(crate) gaps: Gaps<'a>,
}

impl<'a> LoadedDrive<'a> {
    /// Builds the drive under the load.
    ///
    /// # Errors
    /// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] if no finite forces exist,
    /// [`SolveError::Impossible`] if the drive cannot have the load's clearances or its law.
    pub fn new(drive: &'a Drive, load: &LoadCase) -> Result<Self, SolveError> {
        Self::with_deviations(drive, load, None)
    }

    /// Builds the drive under the load, with deviations of its parts. Zones are then not alike: [`Self::wind_up`] needs
    /// the teeth of all zones, made by [`Self::tooth_at`].
    ///
    /// # Errors
    /// As [`Self::new`], and [`SolveError::Impossible`] if a list has a wrong length or `projection` gets deviations.
    pub fn deviating(drive: &'a Drive, load: &LoadCase, deviations: &'a Deviations) -> Result<Self, SolveError> {
        Self::with_deviations(drive, load, Some(deviations))
    }

    fn with_deviations(
        drive: &'a Drive,
        load: &LoadCase,
        deviations: Option<&'a Deviations>,
    ) -> Result<Self, SolveError> {
        let p = *load.parameters();
        let contacts = Contacts::new(drive, p.carrier, &p.law, &p.materials, &p.series_compliance_mm_per_n);
        let contacts = contacts
            .ok_or_else(|| SolveError::Impossible(vec![Violation::conflict(Parameter::Law, ContactLaw::SUITABLE)]))?;
        let mesh = load.mesh(drive, deviations.unwrap_or(&Deviations::default()));
        let tip_corner = if load.presses_corners(drive) { TipCorner::of(drive.ring_tooth())? } else { None };
        let loaded = Self {
            drive,
            load: p,
            mesh,
            zones: mesh.zones_in_torque(),
            input_torque_nmm: 1e3 * load.input_torque_nm(drive),
            contacts,
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
            let set_forward_um = -p.modification.wave_generator_equidistant_um;
            let (cam_outer_mm, ring) = (drive.cam_outer_radius_mm(), drive.ring_tooth());
            violations.extend(p.carrier.violations(Some(cam_outer_mm), Some(ring), set_forward_um));
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
            loaded.state(&Place::default(), drive.ring_tooth().steepest_engaged()?)?;
        }
        Ok(loaded)
    }

    /// Returns the same drive for lists with one tooth at each place, which represents all that carry alike. If items
    /// deviate, every tooth is listed.
    pub(crate) fn with_one_tooth_a_place(&self) -> Self {
        let zones = if self.mesh.tells_items_apart() { self.zones } else { self.mesh.lobes_loaded_alike() as f64 };
        Self { zones, ..*self }
    }

    /// Returns the same drive over the places of one zone ([`Mesh::as_one_zone`]).
    pub(crate) fn as_one_zone(&self) -> Self {
        Self { mesh: self.mesh.as_one_zone(), ..self.with_one_tooth_a_place() }
    }

    /// Returns the drive.
    pub const fn drive(&self) -> &'a Drive {
        self.drive
    }

    /// Returns its mesh, in which deviating items are distinguished.
    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns true if the law is linear and uniform and no contact has a gap. Unit loads then only have to be scaled.
    pub(crate) fn is_linear(&self) -> bool {
        self.contacts_in_columns().is_some_and(Contacts::are_linear) && self.gaps.is_nil()
    }

    /// Returns the contacts for column-wise evaluation, or none if more than their own law decides about the load.
    pub(crate) fn contacts_in_columns(&self) -> Option<&Contacts> {
        let are_alone = self.ring_bending.is_none() && !self.load.wave_generator_moves && self.tip_corner.is_none();
        are_alone.then_some(&self.contacts)
    }

    /// Returns true if listed teeth may carry nothing because of an open gap.
    pub(crate) fn has_gaps(&self) -> bool {
        !self.gaps.is_nil() || self.tip_corner.is_some()
    }

    /// Returns the angle by which the wave generator moves a tooth at the flank's end by its distance from the axis.
    /// Returns 0 if no corner is pressed.
    pub(crate) fn distance_at_corner_rad(&self) -> Result<f64, NotConverged> {
        if self.tip_corner.is_none() {
            return Ok(0.0);
        }
        let center = self.drive.flank().locus().at(self.drive.flank_limit().position)?;
        Ok(center.center_radius_mm / center.lever_arm_mm)
    }

    /// Returns `M0` in N·mm.
    pub const fn input_torque_nmm(&self) -> f64 {
        self.input_torque_nmm
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
    pub(super) fn springs<'s>(&self, teeth: &'s [ToothState]) -> Springs<'s, ToothState> {
        Springs::new(teeth, self.zones)
    }

    /// Returns the `Δφ` that balances the input torque over these teeth of one zone, or of all if zones are not alike.
    ///
    /// # Errors
    /// [`SolveError::NoLeverArm`] if none can carry, [`SolveError::JohnsonBeyondHalfWidth`] if that law ends before.
    pub fn wind_up(&self, teeth: &[ToothState]) -> Result<WindUp, SolveError> {
        let wind_up = self.springs(teeth).wind_up(self.input_torque_nmm)?.ok_or_else(|| self.carries_nothing(teeth))?;
        if let Some(error) = self.law_end(teeth, &wind_up.rotation, false)?.and_then(|end| end.law_end) {
            return Err(error);
        }
        Ok(WindUp { lost_motion_rad: self.lost_motion_rad(), ..wind_up })
    }

    /// Returns the reason why teeth carry no torque, or less than the required torque.
    pub(crate) fn carries_nothing(&self, teeth: &[ToothState]) -> SolveError {
        if self.load.wave_generator_moves && teeth.iter().any(|tooth| tooth.spring.arm_mm > 0.0) {
            SolveError::TurnedPastTeeth
        } else {
            SolveError::NoLeverArm
        }
    }

    /// Returns the lost motion common to all teeth, which their closing angles exclude.
    pub(crate) fn lost_motion_rad(&self) -> f64 {
        self.gaps.lost_motion_rad()
    }
}
