//! Contacts of a tooth: approach and pressure under a force (docs/explanation/theory.md sections 4.3 and 5).

pub mod flat;
pub mod point;
mod pressure;

use std::f64::consts::PI;

use flat::FlatContact;
use point::EllipticContact;

use crate::approach::{Approach, Corner, Logarithmic};
use crate::contact::{Contact, HertzLine, Materials, PerContact};
use crate::contact_law::{ContactLaw, LogarithmicTerm, PALMGREN_EXPONENT, Term, ToothSize, Touch};
use crate::drive::{Drive, ToothShape};
use crate::parts::CarrierRadii;
use crate::root::NotConverged;

pub use pressure::{CornerContact, Pressure};

/// Shape of a tooth, as its contacts need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToothContact {
    /// A cylinder: line contacts at all three contacts.
    Cylinder,
    /// A ball: elliptic contacts at all three contacts.
    Ball {
        /// Groove radius across the plane of motion, larger than the ball's. A contact without a groove is straight
        /// along the axis.
        groove_radius_mm: PerContact<Option<f64>>,
    },
    /// A cylinder with two flats on the walls of the slot: lines at wave generator and ring, a rectangle at the
    /// carrier.
    FlatSided {
        /// Length of the flat along the slot.
        flat_length_mm: f64,
        /// Inner radius of the carrier, where its slots begin.
        carrier_inner_radius_mm: f64,
        /// Outer radius of the carrier, where its slots end.
        carrier_outer_radius_mm: f64,
    },
}

impl ToothContact {
    /// Returns the shape of a drive's teeth. The carrier radii are used for flats only.
    pub fn of(drive: &Drive, carrier: CarrierRadii) -> Self {
        match drive.parameters().tooth {
            ToothShape::Cylinder { .. } => Self::Cylinder,
            ToothShape::Ball { groove_radius_mm } => Self::Ball { groove_radius_mm },
            ToothShape::FlatSided { flat_length_mm, .. } => {
                let [carrier_inner_radius_mm, carrier_outer_radius_mm] = carrier.of(drive);
                Self::FlatSided { flat_length_mm, carrier_inner_radius_mm, carrier_outer_radius_mm }
            }
        }
    }

    const fn touch(&self, contact: Contact) -> Touch {
        match (self, contact) {
            (Self::Ball { .. }, _) => Touch::Ellipse,
            (Self::FlatSided { .. }, Contact::Carrier) => Touch::Flat,
            (Self::Cylinder | Self::FlatSided { .. }, _) => Touch::Line,
        }
    }
}

/// Law of the three contacts of a tooth, for column-wise evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ToothLaw {
    /// `δ = F/k`, including the series compliance.
    Linear { compliance_mm_per_n: PerContact<f64> },
    /// Palmgren's `δ = q F^0.9`, the same at all three contacts.
    Palmgren { coefficient: f64 },
    /// Palmgren's law at wave generator, ring and (unless a flat is there) carrier, plus a linear compliance.
    PalmgrenAndLinear { coefficient: PerContact<f64>, compliance_mm_per_n: PerContact<f64> },
    /// `δ = F (A + B ln(F_r/F))`, plus the series compliance.
    Logarithmic { law: PerContact<LogarithmicTerm>, series_compliance_mm_per_n: PerContact<f64> },
    /// Hertz's ellipses.
    Hertz,
}

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
    length_mm: f64,
    width_mm: f64,
    carrier_inner_radius_mm: f64,
    carrier_outer_radius_mm: f64,
    modulus_mpa: f64,
    /// True if it has its own compliance law.
    pub(crate) has_own_law: bool,
}

impl Flat {
    /// Returns the supported length for a tooth centre at `center_radius_mm` from the axis. It is zero or negative if
    /// the flat has left the carrier.
    pub(crate) fn borne_mm(&self, center_radius_mm: f64) -> f64 {
        let inner_mm = (center_radius_mm - 0.5 * self.length_mm).max(self.carrier_inner_radius_mm);
        let outer_mm = (center_radius_mm + 0.5 * self.length_mm).min(self.carrier_outer_radius_mm);
        outer_mm - inner_mm
    }

    /// Returns the contact over this length.
    pub(crate) const fn over(&self, borne_mm: f64) -> FlatContact {
        FlatContact::new(borne_mm, self.width_mm)
    }

    /// Returns the contact over its whole length.
    pub(crate) const fn whole(&self) -> FlatContact {
        self.over(self.length_mm)
    }

    /// Returns its approach under 1 N over this length.
    pub(crate) fn compliance_mm_per_n(&self, borne_mm: f64) -> f64 {
        self.over(borne_mm).compliance_mm_per_n(self.modulus_mpa)
    }
}

/// The three contacts of the teeth of a drive under a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contacts {
    shape: ToothContact,
    tooth_radius_mm: f64,
    tooth_width_mm: f64,
    modulus_mpa: PerContact<f64>,
    hertz: PerContact<HertzLine>,
    law: PerContact<Term>,
    series_compliance_mm_per_n: PerContact<f64>,
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

/// Contact of a tooth at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// Force over `F_H`.
    pub(crate) force_ratio: f64,
    /// Weight of its approach along `F_H`.
    pub(crate) weight: f64,
    /// Pressure model.
    pub(crate) pressure: Pressure,
}

impl Contacts {
    /// Builds the contacts; none if the law does not apply to the shape.
    pub(crate) fn new(
        shape: &ToothContact,
        law: &ContactLaw,
        materials: &Materials,
        size: ToothSize,
        series_compliance_mm_per_n: &PerContact<f64>,
    ) -> Option<Self> {
        let law = |contact| law.term(shape.touch(contact), contact, materials, size);
        let laws = PerContact {
            wave_generator: law(Contact::WaveGenerator)?,
            ring: law(Contact::Ring)?,
            carrier: law(Contact::Carrier)?,
        };
        Some(Self {
            shape: *shape,
            tooth_radius_mm: size.radius_mm,
            tooth_width_mm: size.width_mm,
            modulus_mpa: PerContact::of(|contact| materials.contact_modulus_mpa(contact)),
            hertz: PerContact::of(|contact| HertzLine::new(materials, contact, size.width_mm)),
            law: laws,
            series_compliance_mm_per_n: *series_compliance_mm_per_n,
        })
    }

    /// Returns Hertz's line law at a contact, for column-wise evaluation.
    pub(crate) const fn hertz(&self, contact: Contact) -> &HertzLine {
        self.hertz.get(contact)
    }

    /// Returns the law for column-wise evaluation; none if it has no columns. A flat with its own law contributes only
    /// its series compliance.
    pub(crate) fn tooth_law(&self) -> Option<ToothLaw> {
        let series = &self.series_compliance_mm_per_n;
        let is_alone = series.iter().all(|(_, &compliance)| compliance == 0.0);
        let PerContact { wave_generator, ring, carrier } = &self.law;
        // Other powers have no columns.
        if matches!(wave_generator, Term::Power { exponent, .. } if exponent.total_cmp(&PALMGREN_EXPONENT).is_ne()) {
            return None;
        }
        match (wave_generator, ring, carrier) {
            _ if matches!(self.shape, ToothContact::Ball { .. }) => {
                (is_alone && *wave_generator == Term::Ellipse).then_some(ToothLaw::Hertz)
            }
            (
                Term::Linear { compliance_mm_per_n: wave_generator },
                Term::Linear { compliance_mm_per_n: ring },
                carrier @ (Term::Linear { .. } | Term::Flat),
            ) => {
                let carrier =
                    if let Term::Linear { compliance_mm_per_n } = carrier { *compliance_mm_per_n } else { 0.0 };
                Some(ToothLaw::Linear {
                    compliance_mm_per_n: PerContact {
                        wave_generator: wave_generator + series.wave_generator,
                        ring: ring + series.ring,
                        carrier: carrier + series.carrier,
                    },
                })
            }
            (&Term::Power { coefficient, .. }, ring, carrier)
                if is_alone && wave_generator == ring && ring == carrier =>
            {
                Some(ToothLaw::Palmgren { coefficient })
            }
            (
                &Term::Power { coefficient: wave_generator, .. },
                &Term::Power { coefficient: ring, .. },
                carrier @ (Term::Power { .. } | Term::Flat),
            ) => {
                let carrier = if let Term::Power { coefficient, .. } = *carrier { coefficient } else { 0.0 };
                Some(ToothLaw::PalmgrenAndLinear {
                    coefficient: PerContact { wave_generator, ring, carrier },
                    compliance_mm_per_n: *series,
                })
            }
            (
                &Term::Logarithmic(wave_generator),
                &Term::Logarithmic(ring),
                carrier @ (Term::Logarithmic(_) | Term::Flat),
            ) => {
                let carrier = if let Term::Logarithmic(line) = carrier { *line } else { LogarithmicTerm::NONE };
                Some(ToothLaw::Logarithmic {
                    law: PerContact { wave_generator, ring, carrier },
                    series_compliance_mm_per_n: *series,
                })
            }
            _ => None,
        }
    }

    pub(crate) fn ball(&self, contact: Contact) -> Option<BallContact> {
        let ToothContact::Ball { groove_radius_mm } = &self.shape else { return None };
        let r = self.tooth_radius_mm;
        // 1/r - 1/r_g without a difference of nearly equal numbers.
        let axial_per_mm = groove_radius_mm.get(contact).map_or(1.0 / r, |groove| (groove - r) / groove / r);
        Some(BallContact { axial_per_mm, modulus_mpa: *self.modulus_mpa.get(contact) })
    }

    /// Returns the flat of flat-sided teeth.
    pub(crate) fn flat(&self) -> Option<Flat> {
        let ToothContact::FlatSided { flat_length_mm, carrier_inner_radius_mm, carrier_outer_radius_mm } = self.shape
        else {
            return None;
        };
        Some(Flat {
            length_mm: flat_length_mm,
            width_mm: self.tooth_width_mm,
            carrier_inner_radius_mm,
            carrier_outer_radius_mm,
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

    /// Returns `ξ = Σ w δ` of a tooth over `F_H`, including this compliance of the ring in excess of that at its root.
    pub(crate) fn approach(&self, places: &PerContact<Place>, ring_bending_mm_per_n: f64) -> Approach {
        let mut linear_mm_per_n = places.ring.weight * (ring_bending_mm_per_n * places.ring.force_ratio);
        let mut power: Option<(f64, f64)> = None;
        let mut growth_mm_per_n = 0.0;
        // The contact that first reaches the end of Johnson's law sets the reference force of the logarithms, so all
        // are positive.
        let johnson = PerContact::of(|contact| match (self.law.get(contact), &places.get(contact).pressure) {
            (
                Term::Logarithmic(law),
                Pressure::Line { curvature_per_mm, .. } | Pressure::Corner(CornerContact { curvature_per_mm, .. }),
            ) => Some(law.at(*curvature_per_mm)),
            _ => None,
        });
        let reference_n = places
            .iter()
            .filter(|(_, place)| place.force_ratio > 0.0)
            .filter_map(|(contact, place)| johnson.get(contact).map(|law| law.reference_n / place.force_ratio));
        let reference_n = reference_n.fold(f64::INFINITY, f64::min);
        for (contact, place) in places.iter() {
            let (weight, ratio) = (place.weight, place.force_ratio);
            let mut add_power = |exponent: f64, coefficient: f64| {
                let sum = power.map_or(0.0, |(_, sum)| sum);
                power = Some((exponent, sum + weight * (coefficient * ratio.powf(exponent))));
            };
            match (self.law.get(contact), &place.pressure) {
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
                    if let Some(law) = johnson.get(contact).filter(|_| ratio > 0.0) {
                        let ln = (law.reference_n / ratio / reference_n).ln();
                        linear_mm_per_n += weight * ratio * (law.compliance_mm_per_n + law.growth_mm_per_n * ln);
                        growth_mm_per_n += weight * ratio * law.growth_mm_per_n;
                    }
                }
            }
            linear_mm_per_n += weight * (self.series_compliance_mm_per_n.get(contact) * ratio);
        }
        if growth_mm_per_n > 0.0 {
            let smooth = Logarithmic::new(linear_mm_per_n, growth_mm_per_n, reference_n);
            match (johnson.ring, &places.ring.pressure) {
                (Some(law), Pressure::Corner(corner)) => {
                    let Place { weight, force_ratio, .. } = places.ring;
                    let growth_mm_per_n = 2.0 * law.growth_mm_per_n + corner.bending_growth_mm_per_n;
                    let narrowing_n = corner.angle_rad * corner.angle_rad
                        / (PI * PI * corner.curvature_per_mm * law.growth_mm_per_n * force_ratio);
                    Approach::Corner(Corner::new(smooth, weight * force_ratio * growth_mm_per_n, narrowing_n))
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
