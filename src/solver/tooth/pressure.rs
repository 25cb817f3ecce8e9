//! Pressure of a contact under a force.

use std::f64::consts::PI;

use super::flat::FlatContact;
use super::point::EllipticContact;
use crate::contact::HertzLine;

/// Pressure model of a contact at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pressure {
    /// Hertz's line.
    Line {
        /// Stress law.
        hertz: HertzLine,
        /// Relative curvature, in 1/mm.
        curvature_per_mm: f64,
    },
    /// Hertz's ellipse.
    Ellipse(EllipticContact),
    /// Uniform pressure.
    Flat(FlatContact),
    /// Contact with a corner. No pressure is calculated: by Hertz there is none, and at a sharp corner it is infinite.
    Corner(CornerContact),
}

/// Contact of a tooth with the corner that ends the ring's flank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerContact {
    /// Relative curvature of the tooth and the flank's end, in 1/mm.
    pub(crate) curvature_per_mm: f64,
    /// Angle between the contact and the flank's normal there.
    pub(crate) angle_rad: f64,
    /// Growth of the ring tooth's bending compliance for each unit of the logarithm by which the contact is narrower.
    pub(crate) bending_growth_mm_per_n: f64,
}

impl Pressure {
    /// Returns the largest pressure under a force; the mean pressure for a flat, 0 for a corner.
    pub fn stress_mpa(&self, force_n: f64) -> f64 {
        match self {
            Self::Line { hertz, curvature_per_mm } => hertz.stress_mpa(force_n, *curvature_per_mm),
            Self::Ellipse(ellipse) => ellipse.stress_mpa(force_n),
            Self::Flat(flat) => flat.stress_mpa(force_n),
            Self::Corner(_) => 0.0,
        }
    }

    /// Returns the pressure in the middle plane, integrated along the plane of motion. For an ellipse it is `π a p/2`
    /// with its half-width a, otherwise the force over the width. It is 0 for a corner, which stays in contact: its
    /// wear differs from a flank's.
    pub fn line_load_n_per_mm(&self, force_n: f64, tooth_width_mm: f64) -> f64 {
        match self {
            Self::Line { .. } | Self::Flat(_) => force_n / tooth_width_mm,
            Self::Ellipse(ellipse) => 0.5 * PI * ellipse.half_width_mm(force_n) * ellipse.stress_mpa(force_n),
            Self::Corner(_) => 0.0,
        }
    }

    /// Returns the force for a stress, the inverse of [`Self::stress_mpa`].
    pub fn force_n(&self, stress_mpa: f64) -> f64 {
        match self {
            Self::Line { hertz, curvature_per_mm } => hertz.force_n(stress_mpa, *curvature_per_mm),
            Self::Ellipse(ellipse) => ellipse.force_n(stress_mpa),
            Self::Flat(flat) => flat.force_n(stress_mpa),
            Self::Corner(_) => f64::INFINITY,
        }
    }
}
