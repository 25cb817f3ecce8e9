//! The three contacts of a tooth: materials, stiffness, Hertz stress (docs/explanation/theory.md sections 4 and 5).

use std::f64::consts::PI;

/// A part with a material of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// The elliptic cam.
    WaveGenerator,
    /// The discrete teeth.
    Teeth,
    /// The rigid internal wheel.
    Ring,
    /// The slotted annulus.
    Carrier,
}

/// A contact of a tooth with another part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Contact {
    /// With the wave generator.
    WaveGenerator,
    /// With the ring's flank.
    Ring,
    /// With the wall of its slot in the carrier.
    Carrier,
}

impl Contact {
    /// The part that teeth touch there.
    pub const fn mate(self) -> Part {
        match self {
            Self::WaveGenerator => Part::WaveGenerator,
            Self::Ring => Part::Ring,
            Self::Carrier => Part::Carrier,
        }
    }

    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::WaveGenerator => "the wave generator",
            Self::Ring => "the ring",
            Self::Carrier => "the carrier",
        }
    }
}

/// One value for each contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PerContact<T> {
    /// At the wave generator.
    pub wave_generator: T,
    /// At the ring.
    pub ring: T,
    /// At the carrier.
    pub carrier: T,
}

impl<T> PerContact<T> {
    /// The same function of each contact.
    pub fn of(mut function: impl FnMut(Contact) -> T) -> Self {
        Self {
            wave_generator: function(Contact::WaveGenerator),
            ring: function(Contact::Ring),
            carrier: function(Contact::Carrier),
        }
    }

    /// The same fallible function of each contact.
    ///
    /// # Errors
    /// The first one's.
    pub fn try_of<E>(mut function: impl FnMut(Contact) -> Result<T, E>) -> Result<Self, E> {
        Ok(Self {
            wave_generator: function(Contact::WaveGenerator)?,
            ring: function(Contact::Ring)?,
            carrier: function(Contact::Carrier)?,
        })
    }

    /// The value at one contact, to be changed.
    pub const fn get_mut(&mut self, contact: Contact) -> &mut T {
        match contact {
            Contact::WaveGenerator => &mut self.wave_generator,
            Contact::Ring => &mut self.ring,
            Contact::Carrier => &mut self.carrier,
        }
    }

    /// The value at one contact.
    pub const fn get(&self, contact: Contact) -> &T {
        match contact {
            Contact::WaveGenerator => &self.wave_generator,
            Contact::Ring => &self.ring,
            Contact::Carrier => &self.carrier,
        }
    }

    /// The contacts with their values.
    pub fn iter(&self) -> impl Iterator<Item = (Contact, &T)> {
        [(Contact::WaveGenerator, &self.wave_generator), (Contact::Ring, &self.ring), (Contact::Carrier, &self.carrier)]
            .into_iter()
    }
}

/// An isotropic elastic material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus E.
    pub youngs_modulus_gpa: f64,
    /// Poisson's ratio ν.
    pub poissons_ratio: f64,
}

impl Material {
    /// Steel as the paper has it.
    pub const STEEL: Self = Self { youngs_modulus_gpa: 210.0, poissons_ratio: 0.3 };

    /// `(1 - ν²)/E`, in 1/MPa.
    pub(crate) fn compliance_per_mpa(&self) -> f64 {
        (1.0 - self.poissons_ratio) * (1.0 + self.poissons_ratio) / (1e3 * self.youngs_modulus_gpa)
    }
}

/// The materials of all parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Materials {
    /// Of the wave generator.
    pub wave_generator: Material,
    /// Of the teeth.
    pub teeth: Material,
    /// Of the ring.
    pub ring: Material,
    /// Of the carrier.
    pub carrier: Material,
}

impl Materials {
    /// The parts with their materials.
    pub fn iter(&self) -> impl Iterator<Item = (Part, &Material)> {
        [
            (Part::WaveGenerator, &self.wave_generator),
            (Part::Teeth, &self.teeth),
            (Part::Ring, &self.ring),
            (Part::Carrier, &self.carrier),
        ]
        .into_iter()
    }

    /// The contact modulus E* of a contact: `1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2`.
    pub fn contact_modulus_mpa(&self, contact: Contact) -> f64 {
        1.0 / (self.teeth.compliance_per_mpa() + self.partner(contact).compliance_per_mpa())
    }

    /// The material that a tooth touches at a contact.
    pub(crate) const fn partner(&self, contact: Contact) -> &Material {
        match contact {
            Contact::WaveGenerator => &self.wave_generator,
            Contact::Ring => &self.ring,
            Contact::Carrier => &self.carrier,
        }
    }
}

/// How force and approach of a contact go together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactLaw {
    /// `F = k δ` \[7\] with `k = π L1 E*/2`, of two parallel cylinders in line contact (Yang and Sun 1985).
    Linear,
    /// `F = k δ` with stiffnesses that the designer gives, in N/mm.
    Fixed(PerContact<f64>),
    /// Palmgren's `δ = 3.84e-5 F^0.9/L^0.8` (steel on steel, N and mm).
    Palmgren,
    /// The logarithmic approach of a cylinder between two bodies (K. L. Johnson, *Contact Mechanics*, 1985, section 5.6), each of which stands still
    /// at a depth, by default the tooth's radius.
    Johnson {
        /// Depth of each body below its contact, in mm.
        depth_mm: PerContact<Option<f64>>,
    },
    /// Hertz's `δ = q F^(2/3)` of a point contact: the law of balls.
    Hertz,
}

/// Hertz stress of a line contact \[8\]: `σ = √(F/(π L1) · (1/ρ1 + 1/ρ2) · E*)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HertzLine {
    modulus_per_width_mpa_per_mm: f64,
}

impl HertzLine {
    /// Of a contact, for teeth of this width.
    pub fn new(materials: &Materials, contact: Contact, tooth_width_mm: f64) -> Self {
        let modulus = materials.contact_modulus_mpa(contact);
        Self { modulus_per_width_mpa_per_mm: modulus / (PI * tooth_width_mm) }
    }

    /// `E*/(π L1)`.
    pub(crate) const fn modulus_per_width_mpa_per_mm(&self) -> f64 {
        self.modulus_per_width_mpa_per_mm
    }

    /// The largest pressure under `force_n`, for bodies whose curvatures (convex positive) sum to `curvature_per_mm`.
    pub fn stress_mpa(&self, force_n: f64, curvature_per_mm: f64) -> f64 {
        (force_n * curvature_per_mm * self.modulus_per_width_mpa_per_mm).sqrt()
    }

    /// The force that makes the largest pressure `stress_mpa`: the inverse of [`Self::stress_mpa`].
    pub fn force_n(&self, stress_mpa: f64, curvature_per_mm: f64) -> f64 {
        stress_mpa * (stress_mpa / (curvature_per_mm * self.modulus_per_width_mpa_per_mm))
    }
}

/// Half the width of a line contact, `2F/(π L1 σ)`.
pub fn half_width_mm(force_n: f64, stress_mpa: f64, tooth_width_mm: f64) -> f64 {
    // At a corner a force is borne of which no stress is told.
    if stress_mpa > 0.0 { 2.0 * force_n / (PI * tooth_width_mm * stress_mpa) } else { 0.0 }
}

/// The largest shear stress below a line contact, over its largest pressure: `τ/σ = ζ - ζ²/√(1 + ζ²)` at the depth ζ in half-widths,
/// with its maximum at `ζ² = (√5 - 1)/2` (in the plane of the section, where it does not depend on Poisson's ratio).
pub const SHEAR_SHARE: f64 = 0.300_283_106_000_777_6;

/// The depth of that shear stress in half-widths, `√((√5 - 1)/2)`.
pub const SHEAR_DEPTH: f64 = 0.786_151_377_757_423_3;
