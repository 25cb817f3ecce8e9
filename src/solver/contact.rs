//! The three contacts of a tooth: materials, stiffness, Hertz stress (docs/explanation/theory.md sections 4 and 5).

use std::f64::consts::PI;

/// A part of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"), schema(as = BodyPart))]
pub enum Part {
    /// The cam.
    WaveGenerator,
    /// The discrete teeth.
    Teeth,
    /// The rigid internal gear.
    Ring,
    /// The slotted annulus.
    Carrier,
}

impl Part {
    /// Returns all parts.
    pub const fn all() -> [Self; 4] {
        [Self::WaveGenerator, Self::Teeth, Self::Ring, Self::Carrier]
    }
}

/// Writes the name in documents.
impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::WaveGenerator => "wave_generator",
            Self::Teeth => "teeth",
            Self::Ring => "ring",
            Self::Carrier => "carrier",
        })
    }
}

/// A contact of a tooth with another part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum Contact {
    /// With the wave generator.
    WaveGenerator,
    /// With the ring's flank.
    Ring,
    /// With the wall of its slot in the carrier.
    Carrier,
}

impl Contact {
    /// Returns all contacts.
    pub const fn all() -> [Self; 3] {
        [Self::WaveGenerator, Self::Ring, Self::Carrier]
    }

    /// Returns the part that teeth touch there.
    pub const fn mate(self) -> Part {
        match self {
            Self::WaveGenerator => Part::WaveGenerator,
            Self::Ring => Part::Ring,
            Self::Carrier => Part::Carrier,
        }
    }

    /// Returns the name in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::WaveGenerator => "the wave generator",
            Self::Ring => "the ring",
            Self::Carrier => "the carrier",
        }
    }
}

/// Writes the name in documents.
impl std::fmt::Display for Contact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.mate().fmt(f)
    }
}

/// One value for each contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct PerContact<T> {
    /// At the wave generator.
    pub wave_generator: T,
    /// At the ring.
    pub ring: T,
    /// At the carrier.
    pub carrier: T,
}

impl<T> PerContact<T> {
    /// Builds the values by a function of each contact.
    pub fn of(mut function: impl FnMut(Contact) -> T) -> Self {
        Self {
            wave_generator: function(Contact::WaveGenerator),
            ring: function(Contact::Ring),
            carrier: function(Contact::Carrier),
        }
    }

    /// Builds the values by a fallible function of each contact.
    ///
    /// # Errors
    /// The first error of the function.
    pub fn try_of<E>(mut function: impl FnMut(Contact) -> Result<T, E>) -> Result<Self, E> {
        Ok(Self {
            wave_generator: function(Contact::WaveGenerator)?,
            ring: function(Contact::Ring)?,
            carrier: function(Contact::Carrier)?,
        })
    }

    /// Returns a mutable reference to the value at one contact.
    pub const fn get_mut(&mut self, contact: Contact) -> &mut T {
        match contact {
            Contact::WaveGenerator => &mut self.wave_generator,
            Contact::Ring => &mut self.ring,
            Contact::Carrier => &mut self.carrier,
        }
    }

    /// Returns the value at one contact.
    pub const fn get(&self, contact: Contact) -> &T {
        match contact {
            Contact::WaveGenerator => &self.wave_generator,
            Contact::Ring => &self.ring,
            Contact::Carrier => &self.carrier,
        }
    }

    /// Returns the contacts with their values.
    pub fn iter(&self) -> impl Iterator<Item = (Contact, &T)> {
        [(Contact::WaveGenerator, &self.wave_generator), (Contact::Ring, &self.ring), (Contact::Carrier, &self.carrier)]
            .into_iter()
    }
}

/// An isotropic elastic material.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, default, expecting = "an object"), schema(as = MaterialDocument))]
pub struct Material {
    /// Young's modulus E, in GPa. Default: 210 GPa.
    pub youngs_modulus_gpa: f64,
    /// Poisson's ratio ν. Default: 0.3.
    pub poissons_ratio: f64,
}

impl Material {
    /// Steel as in the paper.
    pub const STEEL: Self = Self { youngs_modulus_gpa: 210.0, poissons_ratio: 0.3 };

    /// Returns `(1 - ν²)/E`, in 1/MPa.
    pub(crate) fn compliance_per_mpa(&self) -> f64 {
        (1.0 - self.poissons_ratio) * (1.0 + self.poissons_ratio) / (1e3 * self.youngs_modulus_gpa)
    }
}

impl Default for Material {
    fn default() -> Self {
        Self::STEEL
    }
}

/// Materials by part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, default, expecting = "an object"), schema(as = MaterialsDocument))]
pub struct Materials {
    /// Material of the wave generator. Default: steel.
    pub wave_generator: Material,
    /// Material of the teeth. Default: steel.
    pub teeth: Material,
    /// Material of the ring. Default: steel.
    pub ring: Material,
    /// Material of the carrier. Default: steel.
    pub carrier: Material,
}

impl Materials {
    /// Returns the parts with their materials.
    pub fn iter(&self) -> impl Iterator<Item = (Part, &Material)> {
        [
            (Part::WaveGenerator, &self.wave_generator),
            (Part::Teeth, &self.teeth),
            (Part::Ring, &self.ring),
            (Part::Carrier, &self.carrier),
        ]
        .into_iter()
    }

    /// Returns the contact modulus E* of a contact: `1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2`.
    pub fn contact_modulus_mpa(&self, contact: Contact) -> f64 {
        1.0 / (self.teeth.compliance_per_mpa() + self.partner(contact).compliance_per_mpa())
    }

    /// Returns the material that a tooth touches at a contact.
    pub(crate) const fn partner(&self, contact: Contact) -> &Material {
        match contact {
            Contact::WaveGenerator => &self.wave_generator,
            Contact::Ring => &self.ring,
            Contact::Carrier => &self.carrier,
        }
    }
}

/// Hertz stress of a line contact \[8\]: `σ = √(F/(π L1) · (1/ρ1 + 1/ρ2) · E*)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HertzLine {
    /// `E*/(π L1)`.
    pub(crate) modulus_per_width_mpa_per_mm: f64,
}

impl HertzLine {
    /// Builds the law of a contact, for teeth of this width.
    pub fn new(materials: &Materials, contact: Contact, tooth_width_mm: f64) -> Self {
        let modulus = materials.contact_modulus_mpa(contact);
        Self { modulus_per_width_mpa_per_mm: modulus / (PI * tooth_width_mm) }
    }

    /// Returns the largest pressure under `force_n`, for curvatures (convex positive) that sum to `curvature_per_mm`.
    pub fn stress_mpa(&self, force_n: f64, curvature_per_mm: f64) -> f64 {
        (force_n * curvature_per_mm * self.modulus_per_width_mpa_per_mm).sqrt()
    }

    /// Returns the force that makes the largest pressure `stress_mpa`: the inverse of [`Self::stress_mpa`].
    pub fn force_n(&self, stress_mpa: f64, curvature_per_mm: f64) -> f64 {
        stress_mpa * (stress_mpa / (curvature_per_mm * self.modulus_per_width_mpa_per_mm))
    }
}

/// Returns half the width of a line contact, `2F/(π L1 σ)`; 0 without a stress.
pub fn half_width_mm(force_n: f64, stress_mpa: f64, tooth_width_mm: f64) -> f64 {
    // At a corner there is a force but no calculated stress.
    if stress_mpa > 0.0 { 2.0 * force_n / (PI * tooth_width_mm * stress_mpa) } else { 0.0 }
}

/// Largest shear stress below a line contact, over its largest pressure: `τ/σ = ζ - ζ²/√(1 + ζ²)` at the depth ζ in
/// half-widths. The maximum is at `ζ² = (√5 - 1)/2`, in the plane of the section, where Poisson's ratio has no
/// influence.
pub const SHEAR_SHARE: f64 = 0.300_283_106_000_777_6;

/// Depth of that shear stress in half-widths, `√((√5 - 1)/2)`.
pub const SHEAR_DEPTH: f64 = 0.786_151_377_757_423_3;
