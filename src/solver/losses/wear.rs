//! Wear by Archard's law (docs/explanation/theory.md section 10.4): volume per force and slip, as a depth per hour where a tooth touches a part.

use std::f64::consts::PI;

use crate::contact::{Contact, PerContact};
use crate::losses::{Friction, LoadedTooth, Mechanism, ToothSlip, secant};

/// Seconds in an hour.
const SECONDS: f64 = 3600.0;

/// What decides how fast the parts wear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearParameters {
    /// Specific wear rate of each part at its contact with the teeth, in mm³/(N·m).
    pub rate_mm3_per_nm: PerContact<f64>,
    /// `|ω_HS|`.
    pub turning_rad_per_s: f64,
}

impl Mechanism {
    /// How fast the point of contact moves over each part, per radian: `ρ_H dφ` on the cam, `(1 + rκ) d/(k cos β)` on the ring, `dd` in the
    /// slot.
    pub fn advance_mm_per_rad(&self, tooth: &LoadedTooth) -> PerContact<f64> {
        let (k, d, t) = (self.ring_teeth_per_wave(), tooth.center_radius_mm, tooth.tan_pressure_angle);
        PerContact {
            // dφ/dψ = d/((r + ρ_H) cos γ), and ρ_H/(r + ρ_H) = 1/(1 + r/ρ_H), which holds on a straight or hollow cam too.
            wave_generator: d * secant(t) / (1.0 + self.tooth_radius_mm * tooth.cam_curvature_per_mm),
            ring: tooth.regularity * d * secant(k * t) / k,
            carrier: d * t,
        }
    }

    /// How often a point of each part is passed by a loaded tooth, per radian: of the cam by every tooth once a turn against the carrier, of
    /// the ring by every m-th lobe, of a slot by every lobe.
    fn passes_per_rad(&self) -> PerContact<f64> {
        let (lobes, installed) = (f64::from(self.lobes), f64::from(self.installed));
        PerContact {
            wave_generator: installed / (2.0 * PI),
            // ω_HK = ω_HS Z_G/Z_K, U lobes, and one in Z_G/Z'_G brings a tooth.
            ring: lobes * installed / (2.0 * PI * f64::from(self.ring_teeth)),
            carrier: lobes / (2.0 * PI),
        }
    }

    /// Depth that each part loses in an hour at the point where a tooth touches it. As a point
    /// of a part meets its teeth always at the same ψ, this is its depth, not a share of it. `line_load_n_per_mm` is the force over the
    /// width of a cylinder; for another contact the pressure summed along the way of the tooth where that sum is largest.
    ///
    /// A race drifts under the teeth and wears all round: its entry is what this tooth adds to that depth, to be summed over the teeth
    /// and averaged over the period.
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
                    self.zones_in_torque() * area_mm2_per_rad / (2.0 * PI * self.race_radius_mm)
                }
                _ => area_mm2_per_rad / advance.get(contact) * passes.get(contact),
            };
            depth_mm_per_rad * wear.turning_rad_per_s * SECONDS
        })
    }
}
