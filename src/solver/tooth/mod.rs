//! Contacts of a tooth: approach and pressure under a force (docs/explanation/theory.md sections 4.3 and 5).

pub mod flat;
pub mod point;
mod pressure;

use std::f64::consts::PI;

use flat::FlatContact;
use point::EllipticContact;

use crate::approach::{Approach, Corner, Logarithmic};
use crate::contact::{Contact, HertzLine, Materials, PerContact};
use crate::contact_law::{ContactLaw, Term, ToothSize, Touch};
use crate::drive::{Drive, ToothShape};
use crate::parts::CarrierRadii;
use crate::root::NotConverged;

pub use pressure::{CornerContact, Pressure};

/// Powers of the stresses to which forces are proportional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StressExponents {
    /// 2 at all three contacts.
    Lines,
    /// 3 at all three contacts.
    Ellipses,
    /// 2 at wave generator and ring, 1 at the carrier.
    LinesAndFlat,
}

impl StressExponents {
    /// Returns true if all three powers are equal.
    #[inline(always)]
    pub(crate) const fn are_alike(self) -> bool {
        !matches!(self, Self::LinesAndFlat)
    }

    /// Returns true if the power at the contact is 1.
    #[inline(always)]
    pub(crate) const fn is_one_at(self, contact: Contact) -> bool {
        matches!((self, contact), (Self::LinesAndFlat, Contact::Carrier))
    }

    /// Returns the factor of the force for a factor of the stress at wave generator or ring.
    #[inline(always)]
    pub(crate) fn raised(self, factor: f64) -> f64 {
        match self {
            Self::Lines | Self::LinesAndFlat => factor * factor,
            Self::Ellipses => factor * factor * factor,
        }
    }

    /// Returns the factor of the force for a factor of the stress at any contact.
    #[inline(always)]
    pub(crate) fn raised_at(self, contact: Contact, factor: f64) -> f64 {
        if self.is_one_at(contact) { factor } else { self.raised(factor) }
    }
}

/// Contact of a ball, whose curvature in the plane of motion depends on the place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BallContact {
    axial_per_mm: f64,
    modulus_mpa: f64,
}

impl BallContact {
    /// Returns the contact for curvatures in the plane of motion that sum to `curvature_per_mm`.
    pub(crate) fn at(&self, curvature_per_mm: f64) -> Result<EllipticContact, NotConverged> {
        EllipticContact::new(curvature_per_mm, self.axial_per_mm, self.modulus_mpa)
    }
}

/// Flat on the wall of its slot, at any place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Flat {
    /// The contact over its whole length.
    pub(crate) whole: FlatContact,
    carrier_radii_mm: [f64; 2],
    modulus_mpa: f64,
    /// True if it has its own compliance law.
    pub(crate) has_own_law: bool,
}

impl Flat {
    /// Returns the supported length for a tooth centre at `center_radius_mm` from the axis. It is zero or negative if
    /// the flat has left the carrier.
    pub(crate) fn borne_mm(&self, center_radius_mm: f64) -> f64 {
        let (half_mm, [carrier_inner_mm, carrier_outer_mm]) = (0.5 * self.whole.length_mm, self.carrier_radii_mm);
        let inner_mm = (center_radius_mm - half_mm).max(carrier_inner_mm);
        let outer_mm = (center_radius_mm + half_mm).min(carrier_outer_mm);
        outer_mm - inner_mm
    }

    /// Returns the contact over this length.
    pub(crate) const fn over(&self, borne_mm: f64) -> FlatContact {
        FlatContact { length_mm: borne_mm, ..self.whole }
    }

    /// Returns its approach under 1 N over this length.
    pub(crate) fn compliance_mm_per_n(&self, borne_mm: f64) -> f64 {
        self.over(borne_mm).compliance_mm_per_n(self.modulus_mpa)
    }
}

/// The three contacts of the teeth of a drive under a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contacts {
    shape: ToothShape,
    tooth_radius_mm: f64,
    tooth_width_mm: f64,
    /// Inner and outer radius of the carrier, where its slots begin and end.
    carrier_radii_mm: [f64; 2],
    modulus_mpa: PerContact<f64>,
    pub(crate) hertz: PerContact<HertzLine>,
    pub(crate) law: PerContact<Term>,
    pub(crate) series_compliance_mm_per_n: PerContact<f64>,
}

/// Returns the approach at the wave generator under a force, by a law of cylinders that does not depend on the place.
pub(crate) fn plain_approach_mm(
    law: &ContactLaw,
    materials: &Materials,
    tooth_width_mm: f64,
    force_n: f64,
) -> Option<f64> {
    let size = ToothSize { radius_mm: 0.0, width_mm: tooth_width_mm };
    match law.term(Touch::Line, Contact::WaveGenerator, materials, size)? {
        Term::Linear { compliance_mm_per_n } => Some(compliance_mm_per_n * force_n),
        Term::Power { exponent, coefficient } => Some(coefficient * force_n.powf(exponent)),
        Term::Logarithmic(_) | Term::Ellipse | Term::Flat => None,
    }
}

impl Contacts {
    /// Builds the contacts; none if the law does not apply to the shape.
    pub(crate) fn new(
        drive: &Drive,
        carrier: CarrierRadii,
        law: &ContactLaw,
        materials: &Materials,
        series_compliance_mm_per_n: &PerContact<f64>,
    ) -> Option<Self> {
        let shape = drive.parameters().tooth;
        let size = ToothSize { radius_mm: drive.parameters().tooth_radius_mm, width_mm: drive.tooth_width_mm() };
        let touch = |contact| match (shape, contact) {
            (ToothShape::Ball { .. }, _) => Touch::Ellipse,
            (ToothShape::FlatSided { .. }, Contact::Carrier) => Touch::Flat,
            (ToothShape::Cylinder { .. } | ToothShape::FlatSided { .. }, _) => Touch::Line,
        };
        let law = |contact| law.term(touch(contact), contact, materials, size).ok_or(());
        Some(Self {
            shape,
            tooth_radius_mm: size.radius_mm,
            tooth_width_mm: size.width_mm,
            carrier_radii_mm: carrier.of(drive),
            modulus_mpa: PerContact::of(|contact| materials.contact_modulus_mpa(contact)),
            hertz: PerContact::of(|contact| HertzLine::new(materials, contact, size.width_mm)),
            law: PerContact::try_of(law).ok()?,
            series_compliance_mm_per_n: *series_compliance_mm_per_n,
        })
    }

    /// Returns true if the approach at each contact is proportional to its force, the same at every place.
    pub(crate) fn are_linear(&self) -> bool {
        self.law.iter().all(|(_, law)| matches!(law, Term::Linear { .. }))
            && matches!(self.shape, ToothShape::Cylinder { .. })
    }

    pub(crate) fn ball(&self, contact: Contact) -> Option<BallContact> {
        let ToothShape::Ball { groove_radius_mm } = &self.shape else { return None };
        let r = self.tooth_radius_mm;
        // 1/r - 1/r_g without a difference of nearly equal numbers.
        let axial_per_mm = groove_radius_mm.get(contact).map_or(1.0 / r, |groove| (groove - r) / groove / r);
        Some(BallContact { axial_per_mm, modulus_mpa: *self.modulus_mpa.get(contact) })
    }

    /// Returns the flat of flat-sided teeth.
    pub(crate) fn flat(&self) -> Option<Flat> {
        let ToothShape::FlatSided { flat_length_mm, .. } = self.shape else { return None };
        Some(Flat {
            whole: FlatContact { length_mm: flat_length_mm, width_mm: self.tooth_width_mm },
            carrier_radii_mm: self.carrier_radii_mm,
            modulus_mpa: self.modulus_mpa.carrier,
            has_own_law: self.law.carrier == Term::Flat,
        })
    }

    /// Returns the pressure model of a contact, for curvatures in the plane of motion that sum to `curvature_per_mm`
    /// and a tooth centre at `center_radius_mm` from the axis. Returns none if a flat has left the carrier.
    pub(crate) fn pressure(
        &self,
        contact: Contact,
        curvature_per_mm: f64,
        center_radius_mm: f64,
    ) -> Result<Option<Pressure>, NotConverged> {
        if let Some(ball) = self.ball(contact) {
            return Ok(Some(Pressure::Ellipse(ball.at(curvature_per_mm)?)));
        }
        if let Some(flat) = self.flat().filter(|_| contact == Contact::Carrier) {
            let borne_mm = flat.borne_mm(center_radius_mm);
            return Ok((borne_mm > 0.0).then(|| Pressure::Flat(flat.over(borne_mm))));
        }
        Ok(Some(Pressure::Line { hertz: *self.hertz.get(contact), curvature_per_mm }))
    }

    /// Returns `ξ = Σ w δ` of a tooth over `F_H`, for the forces over `F_H` and the weights of the approaches, including
    /// this compliance of the ring in excess of that at its root.
    pub(crate) fn approach(
        &self,
        force_ratio: &PerContact<f64>,
        weights: &PerContact<f64>,
        pressure: &PerContact<Pressure>,
        ring_bending_mm_per_n: f64,
    ) -> Approach {
        let mut linear_mm_per_n = weights.ring * (ring_bending_mm_per_n * force_ratio.ring);
        let mut power: Option<(f64, f64)> = None;
        let mut growth_mm_per_n = 0.0;
        // The contact that first reaches the end of Johnson's law sets the reference force of the logarithms, so all
        // are positive.
        let johnson = PerContact::of(|contact| match (self.law.get(contact), pressure.get(contact)) {
            (
                Term::Logarithmic(law),
                Pressure::Line { curvature_per_mm, .. } | Pressure::Corner(CornerContact { curvature_per_mm, .. }),
            ) => Some((law, law.reference_n(*curvature_per_mm))),
            _ => None,
        });
        let reference_n = force_ratio
            .iter()
            .filter(|&(_, &ratio)| ratio > 0.0)
            .filter_map(|(contact, ratio)| johnson.get(contact).map(|(_, reference_n)| reference_n / ratio));
        let reference_n = reference_n.fold(f64::INFINITY, f64::min);
        for (contact, &ratio) in force_ratio.iter() {
            let weight = *weights.get(contact);
            let mut add_power = |exponent: f64, coefficient: f64| {
                let sum = power.map_or(0.0, |(_, sum)| sum);
                power = Some((exponent, sum + weight * (coefficient * ratio.powf(exponent))));
            };
            match (self.law.get(contact), pressure.get(contact)) {
                (Term::Linear { compliance_mm_per_n }, _) => linear_mm_per_n += weight * (compliance_mm_per_n * ratio),
                (Term::Power { exponent, coefficient }, _) => add_power(*exponent, *coefficient),
                (Term::Ellipse, Pressure::Ellipse(ellipse)) => {
                    add_power(EllipticContact::EXPONENT, ellipse.coefficient());
                }
                (Term::Flat, Pressure::Flat(flat)) => {
                    linear_mm_per_n += weight * (flat.compliance_mm_per_n(*self.modulus_mpa.get(contact)) * ratio);
                }
                // A contact without a force has no approach, and a law only occurs with the pressure model of its own
                // shape.
                (Term::Logarithmic(_) | Term::Ellipse | Term::Flat, _) => {
                    if let Some((law, own_reference_n)) = johnson.get(contact).filter(|_| ratio > 0.0) {
                        let ln = (own_reference_n / ratio / reference_n).ln();
                        linear_mm_per_n += weight * ratio * (law.compliance_mm_per_n + law.growth_mm_per_n * ln);
                        growth_mm_per_n += weight * ratio * law.growth_mm_per_n;
                    }
                }
            }
            linear_mm_per_n += weight * (self.series_compliance_mm_per_n.get(contact) * ratio);
        }
        if growth_mm_per_n > 0.0 {
            let smooth = Logarithmic::new(linear_mm_per_n, growth_mm_per_n, reference_n);
            match (johnson.ring, &pressure.ring) {
                (Some((law, _)), Pressure::Corner(corner)) => {
                    let growth_mm_per_n = 2.0 * law.growth_mm_per_n + corner.bending_growth_mm_per_n;
                    let narrowing_n = corner.angle_rad * corner.angle_rad
                        / (PI * PI * corner.curvature_per_mm * law.growth_mm_per_n * force_ratio.ring);
                    let growth_mm_per_n = weights.ring * force_ratio.ring * growth_mm_per_n;
                    Approach::Corner(Corner { smooth, growth_mm_per_n, narrowing_n })
                }
                _ => Approach::Logarithmic(smooth),
            }
        } else if let Some((exponent, coefficient)) = power {
            Approach::Power { exponent, coefficient, compliance_mm_per_n: linear_mm_per_n }
        } else {
            Approach::Linear { compliance_mm_per_n: linear_mm_per_n }
        }
    }
}
