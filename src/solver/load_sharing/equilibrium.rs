//! Equilibrium of a tooth: its forces over `F_H`, and the weights of its approaches in compatibility.

use crate::cam::ToothCenter;
use crate::contact::PerContact;
use crate::drive::Drive;
use crate::ring::{FlankPoint, RingFlank};
use crate::springs::Spring;
use crate::tooth::Pressure;

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

/// Returns the contribution of each contact's approach to the displacement ξ along `F_H` under `projection`: the paper's
/// cos(γ + sβ) and s sin γ. With tan β = k tan γ the first, times F_K/F_H = cos γ/cos β, is 1 - (1 + sk) sin²γ.
pub(super) fn projected_weights(sense: f64, flank: &RingFlank, center: &ToothCenter) -> PerContact<f64> {
    let t = center.tan_pressure_angle;
    let sin_squared = t * t / (1.0 + t * t);
    let along_ring = 1.0 - (1.0 + sense * flank.teeth_per_wave()) * sin_squared;
    PerContact {
        wave_generator: 1.0,
        ring: along_ring / force_ratio(sense, flank, center).ring,
        carrier: sense * sin_squared.sqrt(),
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
        wave_generator: 1.0 / r + center.cam_curvature_per_mm,
        ring: 1.0 / (r * flank.regularity),
        carrier: 1.0 / r,
    }
}

/// Returns the force ratios of a tooth before the flank, `F_K/F_H = cos γ/cos β` and `F_S/F_H = cos γ (tan β + s tan
/// γ)`. Here β is the angle of the line to the corner. Returns none if the tooth is past the corner, or if its slot
/// would have to pull it.
pub(super) fn force_ratio_at_corner(sense: f64, center: &ToothCenter, seen: &FlankPoint) -> Option<PerContact<f64>> {
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
