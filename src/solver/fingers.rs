//! Strength of the carrier's fingers, the bars between its slots, and the load along them (docs/explanation/theory.md
//! section 4.12).

mod beam;
mod capacity;
mod overhang;
mod strength;

pub use beam::{FOOT_IN_DISC, FingerBeam, Fingers};
pub use overhang::{Overhang, slice_compliance_mm2_per_n};
pub use strength::{LoadCycle, Safety, Strength, stress_concentration};

use crate::contact::{Contact, HertzLine, PerContact};
use crate::drive::{Drive, ToothShape};
use crate::load_sharing::LoadParameters;
use crate::root::NotConverged;
use crate::sweep::{ContactPeaks, States};
use crate::tooth::Pressure;
use crate::tooth::flat::FlatContact;

/// Radius of the fillet at a finger's foot over the finger's thickness, if it is not given.
pub const FILLET_SHARE_OF_THICKNESS: f64 = 0.1;

/// Factor on the stress concentration if the tooth presses beside the fillet. Measured by finite elements.
const PRESSED_BESIDE_FILLET: f64 = 1.35;

/// Moment at the foot over force times length below which the load is so near to the foot that it counts as beside the
/// fillet.
const MOMENT_OF_LOAD_BESIDE_FILLET: f64 = 0.25;

/// Parameters of the fingers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FingerParameters {
    /// Support.
    pub fingers: Fingers,
    /// Radius of the fillet at the foot; by default [`FILLET_SHARE_OF_THICKNESS`].
    pub fillet_radius_mm: Option<f64>,
    /// Strength of the carrier's material. Without it there is no safety.
    pub strength: Option<Strength>,
    /// Course of the load.
    pub cycle: LoadCycle,
    /// Coefficient of friction between teeth and carrier.
    pub friction_coefficient: f64,
}

/// Fingers of a drive's carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarrierFingers {
    beam: FingerBeam,
    parameters: FingerParameters,
    /// Load along the finger, if its support makes it uneven and is given.
    overhang: Option<Overhang>,
    /// Moment at the foot for each newton of a tooth's force.
    moment_nmm_per_n: f64,
    /// Moment at the foot for each newton metre at the carrier, which the ring at the far ends adds.
    moment_nmm_per_nm: f64,
    /// Pressure at the slot's wall, before an uneven load. The wall supports a flat over its whole length.
    slot: Pressure,
}

/// Strength of the carrier's fingers, under the largest force of a tooth (docs/explanation/theory.md section 4.12).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = FingersAnswer))]
#[non_exhaustive]
pub struct FingerStress {
    /// Support of the fingers.
    pub fingers: Fingers,
    /// Thickness of a finger across the slots, at the middle of its height, in mm.
    pub thickness_mm: f64,
    /// Height of a finger along the radius, in mm.
    pub height_mm: f64,
    /// Radius of the fillet at its foot, in mm.
    pub fillet_radius_mm: f64,
    /// Largest load per length along a tooth over its mean. Contact stresses grow with its square root.
    pub load_peak_over_mean: f64,
    /// Bending moment at the foot, in N·mm.
    pub moment_nmm: f64,
    /// Bending stress without the notch, in MPa.
    pub nominal_stress_mpa: f64,
    /// Largest stress in the fillet, in MPa.
    pub stress_mpa: f64,
    /// The lesser of both safeties. Only with `parts.carrier.strength`.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub safety: Option<f64>,
    /// Safety against yield, or against breaking if the material is hardened. Only with `parts.carrier.strength`.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub yield_safety: Option<f64>,
    /// Safety against fatigue. Only with `parts.carrier.strength`.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub fatigue_safety: Option<f64>,
}

impl CarrierFingers {
    /// Builds the fingers from their beam, which only drives with line contacts have.
    ///
    /// ```
    /// use toothwave_solver::backing::{Backings, Support};
    /// use toothwave_solver::drive::Draft;
    /// use toothwave_solver::fingers::{CarrierFingers, FingerParameters};
    /// use toothwave_solver::parts::PartsParameters;
    /// use toothwave_solver::{DriveParameters, LoadParameters};
    ///
    /// let draft = Draft::new(&DriveParameters::default()).unwrap();
    /// let (drive, load) = (draft.drive().unwrap(), LoadParameters::default());
    /// let backings = Backings::of(&drive, &draft, &PartsParameters::default(), Support::default());
    /// let beam = backings.finger.unwrap();
    /// let fingers = CarrierFingers::new(&drive, beam, FingerParameters::default(), &load).unwrap();
    /// assert!(fingers.stress(1000.0, 280.0).stress_mpa > 0.0);
    /// ```
    ///
    /// # Errors
    /// [`NotConverged`] from the geometry.
    pub fn new(
        drive: &Drive,
        beam: FingerBeam,
        parameters: FingerParameters,
        p: &LoadParameters,
    ) -> Result<Self, NotConverged> {
        let material = &p.materials.carrier;
        let overhang = |beam: &FingerBeam| {
            Ok::<_, NotConverged>(Overhang::of_beam(beam, material, slice_compliance_mm2_per_n(drive, p)?))
        };
        let length_mm = beam.length_mm;
        let (overhang, moment_nmm_per_n) = match parameters.fingers {
            Fingers::HeldAtOneEnd => {
                let overhang = overhang(&beam)?;
                (Some(overhang), overhang.moment_over_force_length * length_mm)
            }
            // Half of the force on half of the length.
            Fingers::WebInTheMiddle => {
                let overhang = overhang(&beam.half())?;
                (Some(overhang), overhang.moment_over_force_length * length_mm / 4.0)
            }
            Fingers::HeldAtBothEnds | Fingers::FarEndsJoined => (None, length_mm / 12.0),
        };
        let moment_nmm_per_nm = match parameters.fingers {
            // The mean force of all fingers, M_S/(Z' d), sways them all.
            Fingers::FarEndsJoined => 1e3 * length_mm / 4.0 / (beam.count as f64 * mean_center_radius_mm(drive)),
            Fingers::HeldAtOneEnd | Fingers::HeldAtBothEnds | Fingers::WebInTheMiddle => 0.0,
        };
        let width_mm = drive.tooth_width_mm();
        let slot = match drive.parameters().tooth {
            ToothShape::FlatSided { flat_length_mm: length_mm, .. } => {
                Pressure::Flat(FlatContact { length_mm, width_mm })
            }
            ToothShape::Cylinder { .. } | ToothShape::Ball { .. } => Pressure::Line {
                hertz: HertzLine::new(&p.materials, Contact::Carrier, width_mm),
                curvature_per_mm: 1.0 / drive.parameters().tooth_radius_mm,
            },
        };
        Ok(Self { beam, parameters, overhang, moment_nmm_per_n, moment_nmm_per_nm, slot })
    }

    fn fillet_radius_mm(&self) -> f64 {
        self.parameters.fillet_radius_mm.unwrap_or(FILLET_SHARE_OF_THICKNESS * self.beam.thickness_mm)
    }

    /// Returns κ: the load per length at the most loaded place over its mean, 1 if it is even.
    pub fn load_peak_over_mean(&self) -> f64 {
        self.overhang.map_or(1.0, |overhang| overhang.peak_over_mean)
    }

    /// Returns the largest stress in the fillet over the nominal one.
    pub fn concentration(&self) -> f64 {
        let is_beside_fillet =
            self.overhang.is_none_or(|overhang| overhang.moment_over_force_length < MOMENT_OF_LOAD_BESIDE_FILLET);
        let beside = if is_beside_fillet { PRESSED_BESIDE_FILLET } else { 1.0 };
        beside * stress_concentration(self.fillet_radius_mm() / self.beam.thickness_mm)
    }

    /// Returns the nominal stress for each unit of moment. The wall is turned against the finger, so its force bends
    /// the finger along the radius too, and friction adds to that.
    fn nominal_mpa_per_nmm(&self) -> f64 {
        let FingerBeam { thickness_mm, height_mm, .. } = self.beam;
        let (sin, cos) = self.beam.wall_angle_rad().sin_cos();
        let radial = (thickness_mm / height_mm) * (sin + self.parameters.friction_coefficient);
        6.0 / (height_mm * thickness_mm * thickness_mm) * (cos + radial)
    }

    /// Returns the stress under the largest force on a slot's wall and the torque at the carrier.
    pub fn stress(&self, force_n: f64, output_torque_nm: f64) -> FingerStress {
        let moment_nmm = self.moment_nmm_per_n * force_n + self.moment_nmm_per_nm * output_torque_nm;
        let (nominal_mpa, concentration) = (self.nominal_mpa_per_nmm() * moment_nmm, self.concentration());
        let safety = |strength: Strength| strength.safety(self.parameters.cycle, nominal_mpa, concentration);
        let safety = self.parameters.strength.map(safety);
        FingerStress {
            fingers: self.parameters.fingers,
            thickness_mm: self.beam.thickness_mm,
            height_mm: self.beam.height_mm,
            fillet_radius_mm: self.fillet_radius_mm(),
            load_peak_over_mean: self.load_peak_over_mean(),
            moment_nmm,
            nominal_stress_mpa: nominal_mpa,
            stress_mpa: concentration * nominal_mpa,
            safety: safety.as_ref().map(Safety::least),
            yield_safety: safety.map(|safety| safety.yielding),
            fatigue_safety: safety.map(|safety| safety.fatigue),
        }
    }

    /// Returns the factor of a contact's stress at the most loaded place along the teeth. The stress of a line grows
    /// with the root of its load per length, that of a flat with the load itself.
    pub fn stress_factor(&self, contact: Contact) -> f64 {
        let peak_over_mean = self.load_peak_over_mean();
        match (contact, &self.slot) {
            (Contact::Carrier, Pressure::Flat(_)) => peak_over_mean,
            _ => peak_over_mean.sqrt(),
        }
    }

    /// Returns the peaks at the most loaded place along the teeth.
    pub fn peaks_along(&self, peaks: &PerContact<ContactPeaks>) -> PerContact<ContactPeaks> {
        let root = self.load_peak_over_mean().sqrt();
        PerContact::of(|contact| {
            let mut peaks = *peaks.get(contact);
            peaks.stress_mpa.value *= self.stress_factor(contact);
            // A flat keeps its length, and has no shear.
            if let (Some(stress_mpa), Some(depth_mm)) = (&mut peaks.shear_stress_mpa, &mut peaks.shear_depth_mm) {
                peaks.half_width_mm *= root;
                *stress_mpa *= root;
                *depth_mm *= root;
            }
            peaks
        })
    }

    /// Returns the states with their stresses at the most loaded place along the teeth.
    pub fn states_along(&self, mut states: States) -> States {
        for contact in Contact::all() {
            let factor = self.stress_factor(contact);
            states.stress_mpa.get_mut(contact).iter_mut().for_each(|stress_mpa| *stress_mpa *= factor);
        }
        states
    }
}

/// Returns the mean of the teeth's distances from the axis on a lobe and in a valley.
fn mean_center_radius_mm(drive: &Drive) -> f64 {
    let valley_mm = drive.flank().locus().cam_inner_radius_mm();
    0.5 * (drive.cam_outer_radius_mm() + valley_mm) + drive.parameters().tooth_radius_mm
}
