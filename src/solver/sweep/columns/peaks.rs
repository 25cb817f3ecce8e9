//! Peaks of a sweep, and its torque capacity.

use crate::contact::{Contact, Materials, PerContact, SHEAR_DEPTH, SHEAR_SHARE, half_width_mm};
use crate::drive::Drive;
use crate::mesh::TeethInMesh;
use crate::sweep::limited_by::LimitedBy;
use crate::tooth::point::ShearBelow;
use crate::tooth::{Pressure, StressExponents};

/// Largest value of a column, and the state in which it occurs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct Peak {
    /// The value, in the unit of the field that holds the peak.
    pub value: f64,
    /// Input angle of the state.
    pub input_angle_deg: f64,
    /// Position of the tooth, from the middle of its lobe.
    pub position_deg: f64,
}

/// The peaks of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = ContactPeaksAnswer))]
#[non_exhaustive]
pub struct ContactPeaks {
    /// Peak of the normal force, in N.
    pub force_n: Peak,
    /// Peak of the Hertz stress, in MPa.
    pub stress_mpa: Peak,
    /// Half the width of the contact, in the plane of motion, where the stress has its peak.
    pub half_width_mm: f64,
    /// Half the length of the contact along the axis at the stress peak, in mm. Only for balls.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub half_length_mm: Option<f64>,
    /// Largest shear stress below the surface at the stress peak, in MPa. Left out for a flat, whose edges are not
    /// modelled.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub shear_stress_mpa: Option<f64>,
    /// Depth of that shear stress below the surface, in mm.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub shear_depth_mm: Option<f64>,
}

impl ContactPeaks {
    /// Returns these peaks with the data of a contact of this pressure model and force `force_n` at its stress peak.
    pub(crate) fn of_pressure(
        self,
        pressure: &Pressure,
        force_n: f64,
        materials: &Materials,
        contact: Contact,
    ) -> Self {
        match pressure {
            Pressure::Line { .. } | Pressure::Corner(_) => self,
            Pressure::Flat(flat) => {
                let half_width_mm = 0.5 * flat.length_mm;
                Self { half_width_mm, shear_stress_mpa: None, shear_depth_mm: None, ..self }
            }
            Pressure::Ellipse(ellipse) => {
                let half_width_mm = ellipse.half_width_mm(force_n);
                let half_length_mm = ellipse.half_length_mm(force_n);
                let shear = |poissons_ratio: f64| {
                    let ShearBelow { share, depth } = ellipse.shear_below(poissons_ratio);
                    (share * self.stress_mpa.value, depth * half_width_mm.min(half_length_mm))
                };
                // The larger of the values in the two bodies.
                let [tooth, partner] = [&materials.teeth, materials.partner(contact)].map(|body| body.poissons_ratio);
                let (of_tooth, are_alike) = (shear(tooth), partner.to_bits() == tooth.to_bits());
                let of_partner = if are_alike { of_tooth } else { shear(partner) };
                let (stress_mpa, depth_mm) = if of_partner.0 > of_tooth.0 { of_partner } else { of_tooth };
                Self {
                    half_width_mm,
                    half_length_mm: Some(half_length_mm),
                    shear_stress_mpa: Some(stress_mpa),
                    shear_depth_mm: Some(depth_mm),
                    ..self
                }
            }
        }
    }
}

/// Peaks of force and stress at a contact over the states so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PeaksSoFar {
    pub(crate) force_n: Peak,
    pub(crate) stress_mpa: Peak,
    /// Force in the state of the stress peak.
    pub(crate) force_at_stress_n: f64,
}

impl PeaksSoFar {
    /// Peaks of no state.
    pub(crate) const NONE: Self = {
        let none = Peak { value: f64::NEG_INFINITY, input_angle_deg: 0.0, position_deg: 0.0 };
        Self { force_n: none, stress_mpa: none, force_at_stress_n: 0.0 }
    };

    /// Returns the peaks of a line contact.
    pub(crate) fn of_line(&self, tooth_width_mm: f64) -> ContactPeaks {
        let Self { force_n, stress_mpa, force_at_stress_n } = *self;
        let half_width_mm = half_width_mm(force_at_stress_n, stress_mpa.value, tooth_width_mm);
        ContactPeaks {
            force_n,
            stress_mpa,
            half_width_mm,
            half_length_mm: None,
            shear_stress_mpa: Some(SHEAR_SHARE * stress_mpa.value),
            shear_depth_mm: Some(SHEAR_DEPTH * half_width_mm),
        }
    }
}

/// Torque capacity and the contact that limits it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
#[non_exhaustive]
pub struct TorqueCapacity {
    /// Largest torque at the wave generator under which no contact exceeds its allowable stress and no finger of the
    /// carrier its strength, in N·m.
    pub input_torque_nm: f64,
    /// The corresponding torque at the carrier, in N·m.
    pub output_torque_nm: f64,
    /// What limits it; where `turns_past_teeth`, the contact that is nearest to its allowable stress.
    pub limited_by: LimitedBy,
    /// True if no contact reaches its allowable stress under any torque that the teeth carry. Beyond this torque the wave
    /// generator would turn past its teeth.
    /// Left out where it does not.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "std::ops::Not::not"))]
    pub turns_past_teeth: bool,
    /// The input angle where it is so.
    pub input_angle_deg: f64,
}

impl TorqueCapacity {
    /// Returns the capacity of a drive, limited by a contact, without a limit by the teeth.
    pub(crate) fn new(drive: &Drive, input_torque_nm: f64, contact: Contact, input_angle_deg: f64) -> Self {
        let output_torque_nm = input_torque_nm * drive.teeth_per_wave();
        let limited_by = contact.into();
        Self { input_torque_nm, output_torque_nm, limited_by, turns_past_teeth: false, input_angle_deg }
    }

    /// Returns the capacity if all loads are proportional: for line contacts `M0 min (σ_a/σ)²`.
    pub(crate) fn in_proportion(
        drive: &Drive,
        input_torque_nm: f64,
        allowable_mpa: &PerContact<f64>,
        peaks: &PerContact<ContactPeaks>,
        stress_exponents: StressExponents,
    ) -> Self {
        let share_of = |contact| {
            stress_exponents.raised_at(contact, allowable_mpa.get(contact) / peaks.get(contact).stress_mpa.value)
        };
        let (contact, share) = [Contact::Ring, Contact::Carrier]
            .map(|contact| (contact, share_of(contact)))
            .into_iter()
            .fold((Contact::WaveGenerator, share_of(Contact::WaveGenerator)), |least, other| {
                if other.1 < least.1 { other } else { least }
            });
        Self::new(drive, input_torque_nm * share, contact, peaks.get(contact).stress_mpa.input_angle_deg)
    }
}

/// Summary of a sweep without its states, for searches over millions of drives.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SweepPeaks {
    /// Peaks over the states.
    pub contacts: PerContact<ContactPeaks>,
    /// Range of the wind-up `Δφ` over the input angles, in deg.
    pub wind_up_deg: Extremes,
    /// Range of the output torsional stiffness over the input angles.
    pub torsional_stiffness_nm_per_rad: Extremes,
    /// Number of listed teeth that carry load.
    pub loaded_teeth: TeethInMesh,
    /// The torque capacity, given an allowable stress.
    pub torque_capacity: Option<TorqueCapacity>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
}

/// Least and largest value of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub largest: f64,
}

impl Extremes {
    /// Extremes of no values.
    pub(crate) const NONE: Self = Self { least: f64::INFINITY, largest: f64::NEG_INFINITY };

    /// Returns the extremes of a column.
    pub fn of(column: &[f64]) -> Self {
        column.iter().fold(Self::NONE, |seen, &value| seen.with(value))
    }

    #[inline(always)]
    pub(crate) fn with(self, value: f64) -> Self {
        Self { least: self.least.min(value), largest: self.largest.max(value) }
    }
}

impl SweepPeaks {
    /// Returns the transmission error under load, peak to peak: the range of the wind-up, referred to the output.
    pub fn transmission_error_peak_to_peak_deg(&self, drive: &Drive) -> f64 {
        (self.wind_up_deg.largest - self.wind_up_deg.least) / drive.teeth_per_wave()
    }
}
