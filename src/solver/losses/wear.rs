//! Wear by Archard's law (docs/explanation/theory.md section 10.4): volume per force and slip, as a depth per hour
//! where a tooth touches a part.

use std::f64::consts::PI;

use crate::cam::ToothCenter;
use crate::contact::{Contact, PerContact};
use crate::losses::{Friction, LoadedTooth, Mechanism, ToothSlip, secant};
use crate::sweep::Peak;

/// Seconds in an hour.
const SECONDS: f64 = 3600.0;

/// Parameters of the wear rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearParameters {
    /// Specific wear rate of each part at its contact with the teeth, in mm³/(N·m).
    pub rate_mm3_per_nm: PerContact<f64>,
    /// `|ω_HS|`: speed of the wave generator relative to the carrier.
    pub turning_rad_per_s: f64,
}

/// Largest wear rate of a part, by Archard's law, and its place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct WornPlace {
    /// Depth, in mm per hour.
    pub value: f64,
    /// Input angle at which a tooth touches the part there. A race wears evenly around its circumference and has no
    /// place.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub input_angle_deg: Option<f64>,
    /// Position of that tooth, from the middle of its lobe.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub position_deg: Option<f64>,
}

impl From<Peak> for WornPlace {
    fn from(Peak { value, input_angle_deg, position_deg }: Peak) -> Self {
        Self { value, input_angle_deg: Some(input_angle_deg), position_deg: Some(position_deg) }
    }
}

impl Mechanism {
    /// Returns the speed of the contact point over each part, per radian: `ρ_H dφ` on the cam, `(1 + rκ) d/(k cos β)`
    /// on the ring, `dd` in the slot.
    pub fn advance_mm_per_rad(&self, tooth: &LoadedTooth) -> PerContact<f64> {
        let ToothCenter { center_radius_mm: d, tan_pressure_angle: t, cam_curvature_per_mm, .. } = tooth.center;
        let (k, r) = (self.drive.flank().teeth_per_wave(), self.drive.parameters().tooth_radius_mm);
        PerContact {
            // dφ/dψ = d/((r + ρ_H) cos γ), and ρ_H/(r + ρ_H) = 1/(1 + r/ρ_H), which holds on a straight or hollow cam too.
            wave_generator: d * secant(t) / (1.0 + r * cam_curvature_per_mm),
            ring: tooth.flank.regularity * d * secant(k * t) / k,
            carrier: d * t,
        }
    }

    /// Returns the number of loaded teeth that pass a point of each part, per radian. Every tooth passes a point of the
    /// cam once per revolution relative to the carrier. A point of the ring is passed with every m-th lobe, a point of
    /// a slot with every lobe.
    fn passes_per_rad(&self) -> PerContact<f64> {
        let ([_, ring_teeth, lobes], installed) = (self.counts(), self.drive.parameters().installed as f64);
        PerContact {
            wave_generator: installed / (2.0 * PI),
            // ω_HK = ω_HS Z_G/Z_K, U lobes, and one in Z_G/Z'_G brings a tooth.
            ring: lobes * installed / (2.0 * PI * ring_teeth),
            carrier: lobes / (2.0 * PI),
        }
    }

    /// Returns the depth that each part loses per hour at the point where a tooth touches it. A point of a part meets
    /// its teeth always at the same ψ, so this is its full depth. `line_load_n_per_mm` is the force over the width of a
    /// cylinder. For another contact it is the pressure summed along the way of the tooth where that sum is largest. A
    /// race drifts under the teeth and wears evenly: its entry is this tooth's contribution, to be summed over the
    /// teeth and averaged over the period.
    pub fn wear_mm_per_hour(
        &self,
        friction: &Friction,
        wear: &WearParameters,
        tooth: &LoadedTooth,
        slip: &ToothSlip,
        line_load_n_per_mm: &PerContact<f64>,
    ) -> PerContact<f64> {
        let advance = self.advance_mm_per_rad(tooth);
        let passes = self.passes_per_rad();
        PerContact::of(|contact| {
            // 1e-3 m/mm: area worn off a part's section per radian.
            let area_mm2_per_rad = 1e-3
                * wear.rate_mm3_per_nm.get(contact)
                * line_load_n_per_mm.get(contact)
                * slip.slip_mm_per_rad.get(contact).abs();
            if area_mm2_per_rad <= 0.0 {
                return 0.0;
            }
            let depth_mm_per_rad = match (contact, friction.bearing()) {
                (Contact::WaveGenerator, Some(_)) => {
                    self.mesh.zones_in_torque() * area_mm2_per_rad / (2.0 * PI * self.race_radius_mm())
                }
                _ => area_mm2_per_rad / advance.get(contact) * passes.get(contact),
            };
            depth_mm_per_rad * wear.turning_rad_per_s * SECONDS
        })
    }
}
