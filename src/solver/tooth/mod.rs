//! What a contact of a tooth is: how it gives way under a force and what pressure the force makes (docs/theory.md sections 4.3 and 5).

pub mod flat;
pub(crate) mod line;
pub mod point;

use std::f64::consts::PI;

use crate::approach::{Approach, Logarithmic};
use crate::contact::{Contact, ContactLaw, HertzLine, Materials, PerContact};
use crate::drive::{Drive, ToothShape};
use crate::parts::CarrierRadii;
use crate::root::NotConverged;
use crate::violation::Parameter;
use flat::FlatContact;
use line::JohnsonLine;
use point::EllipticContact;

/// The shape of a tooth, as its contacts need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToothContact {
    /// A cylinder: lines at all three.
    Cylinder,
    /// A ball: ellipses at all three.
    Ball {
        /// Radius across the plane of motion of a groove that the ball runs in, above the ball's own; a contact without one is straight along the axis.
        groove_radius_mm: PerContact<Option<f64>>,
    },
    /// A cylinder with two flats, which lie on the walls of the slot: lines at wave generator and ring, a rectangle at the carrier.
    FlatSided {
        /// Length of the flat along the slot.
        flat_length_mm: f64,
        /// Inner radius of the carrier, where its slots begin.
        carrier_inner_radius_mm: f64,
        /// Its outer radius, where they end.
        carrier_outer_radius_mm: f64,
    },
}

impl ToothContact {
    /// Of a drive's teeth. Flats are borne by a carrier of these radii, which no other teeth ask for.
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
}

/// How force and approach of one contact go together, wherever it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Law {
    /// `δ = F/k`.
    Linear { compliance_mm_per_n: f64 },
    /// `δ = q F^p`.
    Power { exponent: f64, coefficient: f64 },
    /// Johnson's line.
    Johnson(JohnsonLine),
    /// Hertz's ellipse, whose coefficient the place decides.
    Ellipse,
    /// A flat, whose compliance the place decides.
    Flat,
}

/// The law of the three contacts of a cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LineLaw {
    /// `δ = F/k`, what stands behind the contact included.
    Linear { compliance_mm_per_n: PerContact<f64> },
    /// `δ = q F^p`, alike at all three.
    Power { exponent: f64, coefficient: f64 },
    /// Johnson's line, and what stands behind it.
    Johnson { law: PerContact<JohnsonLine>, series_compliance_mm_per_n: PerContact<f64> },
}

/// What the pressure of a contact at a place follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pressure {
    /// Hertz's line.
    Line {
        /// Its law.
        hertz: HertzLine,
        /// Relative curvature.
        curvature_per_mm: f64,
    },
    /// Hertz's ellipse.
    Ellipse(EllipticContact),
    /// An even pressure.
    Flat(FlatContact),
}

impl Pressure {
    /// The largest pressure under a force; the mean one of a flat.
    pub fn stress_mpa(&self, force_n: f64) -> f64 {
        match self {
            Self::Line { hertz, curvature_per_mm } => hertz.stress_mpa(force_n, *curvature_per_mm),
            Self::Ellipse(ellipse) => ellipse.stress_mpa(force_n),
            Self::Flat(flat) => flat.stress_mpa(force_n),
        }
    }

    /// The pressure in the middle plane, summed along the plane of motion: of an ellipse `π a p/2`, a its half-width; elsewhere the force
    /// over the width.
    pub fn line_load_n_per_mm(&self, force_n: f64, tooth_width_mm: f64) -> f64 {
        match self {
            Self::Line { .. } | Self::Flat(_) => force_n / tooth_width_mm,
            Self::Ellipse(ellipse) => 0.5 * PI * ellipse.half_width_mm(force_n) * ellipse.stress_mpa(force_n),
        }
    }

    /// The inverse of [`Self::stress_mpa`].
    pub fn force_n(&self, stress_mpa: f64) -> f64 {
        match self {
            Self::Line { hertz, curvature_per_mm } => hertz.force_n(stress_mpa, *curvature_per_mm),
            Self::Ellipse(ellipse) => ellipse.force_n(stress_mpa),
            Self::Flat(flat) => flat.force_n(stress_mpa),
        }
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
    law: PerContact<Law>,
    series_compliance_mm_per_n: PerContact<f64>,
}

/// Radius and width of a tooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToothSize {
    pub(crate) radius_mm: f64,
    pub(crate) width_mm: f64,
}

/// The law of one contact of a shape; none where the shape has no such contact.
fn law_of(
    shape: &ToothContact,
    law: &ContactLaw,
    materials: &Materials,
    size: ToothSize,
    contact: Contact,
) -> Option<Law> {
    let is_flat = contact == Contact::Carrier && matches!(shape, ToothContact::FlatSided { .. });
    let is_ball = matches!(shape, ToothContact::Ball { .. });
    Some(match law {
        ContactLaw::Fixed(stiffness_n_per_mm) => {
            Law::Linear { compliance_mm_per_n: 1.0 / stiffness_n_per_mm.get(contact) }
        }
        ContactLaw::Hertz => return is_ball.then_some(Law::Ellipse),
        _ if is_ball => return None,
        _ if is_flat => Law::Flat,
        ContactLaw::Linear => {
            let stiffness = 0.5 * PI * size.width_mm * materials.contact_modulus_mpa(contact);
            Law::Linear { compliance_mm_per_n: 1.0 / stiffness }
        }
        ContactLaw::Palmgren => Law::Power { exponent: 0.9, coefficient: 3.84e-5 / size.width_mm.powf(0.8) },
        ContactLaw::Johnson { depth_mm } => {
            Law::Johnson(JohnsonLine::new(materials, contact, size.radius_mm, size.width_mm, *depth_mm.get(contact)))
        }
    })
}

/// The approach at the wave generator under a force by a law of cylinders that knows no place.
pub(crate) fn plain_approach_mm(
    law: &ContactLaw,
    materials: &Materials,
    tooth_width_mm: f64,
    force_n: f64,
) -> Option<f64> {
    let size = ToothSize { radius_mm: 0.0, width_mm: tooth_width_mm };
    match law_of(&ToothContact::Cylinder, law, materials, size, Contact::WaveGenerator)? {
        Law::Linear { compliance_mm_per_n } => Some(compliance_mm_per_n * force_n),
        Law::Power { exponent, coefficient } => Some(coefficient * force_n.powf(exponent)),
        Law::Johnson(_) | Law::Ellipse | Law::Flat => None,
    }
}

/// A contact where a tooth stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// Force over `F_H`.
    pub(crate) force_ratio: f64,
    /// What its approach counts along `F_H`.
    pub(crate) weight: f64,
    /// What pressure it has.
    pub(crate) pressure: Pressure,
}

impl Contacts {
    /// The contacts; without a law of their own shape, none.
    pub(crate) fn new(
        shape: &ToothContact,
        law: &ContactLaw,
        materials: &Materials,
        size: ToothSize,
        series_compliance_mm_per_n: &PerContact<f64>,
    ) -> Option<Self> {
        let law = |contact| law_of(shape, law, materials, size, contact);
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

    /// Hertz's line at a contact, for whoever works in columns.
    pub(crate) const fn hertz(&self, contact: Contact) -> &HertzLine {
        self.hertz.get(contact)
    }

    /// The law of cylinders, for whoever works in columns; none of other shapes, nor where laws of two kinds add up at a tooth.
    pub(crate) fn line_law(&self) -> Option<LineLaw> {
        if self.shape != ToothContact::Cylinder {
            return None;
        }
        let series = &self.series_compliance_mm_per_n;
        let PerContact { wave_generator, ring, carrier } = &self.law;
        match (wave_generator, ring, carrier) {
            (
                Law::Linear { compliance_mm_per_n: wave_generator },
                Law::Linear { compliance_mm_per_n: ring },
                Law::Linear { compliance_mm_per_n: carrier },
            ) => Some(LineLaw::Linear {
                compliance_mm_per_n: PerContact {
                    wave_generator: wave_generator + series.wave_generator,
                    ring: ring + series.ring,
                    carrier: carrier + series.carrier,
                },
            }),
            (&Law::Power { exponent, coefficient }, Law::Power { .. }, Law::Power { .. })
                if series.iter().all(|(_, &compliance)| compliance == 0.0) =>
            {
                Some(LineLaw::Power { exponent, coefficient })
            }
            (&Law::Johnson(wave_generator), &Law::Johnson(ring), &Law::Johnson(carrier)) => Some(LineLaw::Johnson {
                law: PerContact { wave_generator, ring, carrier },
                series_compliance_mm_per_n: *series,
            }),
            _ => None,
        }
    }

    /// What pressure a contact has where the curvatures in the plane of motion sum to `curvature_per_mm` and the tooth's centre is
    /// `center_radius_mm` from the axis; none where a flat has left the carrier.
    pub(crate) fn pressure(
        &self,
        contact: Contact,
        curvature_per_mm: f64,
        center_radius_mm: f64,
    ) -> Result<Option<Pressure>, NotConverged> {
        let line = Pressure::Line { hertz: *self.hertz.get(contact), curvature_per_mm };
        Ok(Some(match &self.shape {
            ToothContact::Cylinder => line,
            ToothContact::Ball { groove_radius_mm } => {
                let r = self.tooth_radius_mm;
                // 1/r - 1/r_g without the difference of near numbers.
                let axial_per_mm = groove_radius_mm.get(contact).map_or(1.0 / r, |groove| (groove - r) / groove / r);
                Pressure::Ellipse(EllipticContact::new(curvature_per_mm, axial_per_mm, *self.modulus_mpa.get(contact))?)
            }
            ToothContact::FlatSided { flat_length_mm, carrier_inner_radius_mm, carrier_outer_radius_mm } => {
                if contact != Contact::Carrier {
                    return Ok(Some(line));
                }
                let inner_mm = (center_radius_mm - 0.5 * flat_length_mm).max(*carrier_inner_radius_mm);
                let outer_mm = (center_radius_mm + 0.5 * flat_length_mm).min(*carrier_outer_radius_mm);
                if outer_mm <= inner_mm {
                    return Ok(None);
                }
                Pressure::Flat(FlatContact::new(outer_mm - inner_mm, self.tooth_width_mm))
            }
        }))
    }

    /// `ξ = Σ w δ` of a tooth over `F_H`, where the ring gives way by so much more than at its root.
    pub(crate) fn approach(&self, places: &PerContact<Place>, ring_bending_mm_per_n: f64) -> Approach {
        let mut linear_mm_per_n = places.ring.weight * (ring_bending_mm_per_n * places.ring.force_ratio);
        let mut power: Option<(f64, f64)> = None;
        let mut growth_mm_per_n = 0.0;
        // The contact that first reaches the width at which Johnson's law ends sets the force that logarithms count from: so all are positive.
        let johnson = PerContact::of(|contact| match (self.law.get(contact), &places.get(contact).pressure) {
            (Law::Johnson(law), Pressure::Line { curvature_per_mm, .. }) => Some(law.at(*curvature_per_mm)),
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
                (Law::Linear { compliance_mm_per_n }, _) => linear_mm_per_n += weight * (compliance_mm_per_n * ratio),
                (Law::Power { exponent, coefficient }, _) => add_power(*exponent, *coefficient),
                (Law::Ellipse, Pressure::Ellipse(ellipse)) => {
                    add_power(EllipticContact::EXPONENT, ellipse.coefficient());
                }
                (Law::Flat, Pressure::Flat(flat)) => {
                    linear_mm_per_n += weight * (flat.compliance_mm_per_n(*self.modulus_mpa.get(contact)) * ratio);
                }
                // A contact without a force has no approach, and a law stands only beside the pressure of its own shape.
                (Law::Johnson(_) | Law::Ellipse | Law::Flat, _) => {
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
            Approach::Logarithmic(Logarithmic::new(linear_mm_per_n, growth_mm_per_n, reference_n))
        } else if let Some((exponent, coefficient)) = power {
            Approach::Power { exponent, coefficient, compliance_mm_per_n: linear_mm_per_n }
        } else {
            Approach::Linear { compliance_mm_per_n: linear_mm_per_n }
        }
    }
}

impl ContactLaw {
    /// The numbers that the law itself brings.
    pub(crate) fn parameters(&self) -> Vec<(Parameter, f64)> {
        match self {
            Self::Linear | Self::Palmgren | Self::Hertz => Vec::new(),
            Self::Fixed(stiffness) => {
                stiffness.iter().map(|(contact, &value)| (Parameter::Stiffness(contact), value)).collect()
            }
            Self::Johnson { depth_mm } => depth_mm
                .iter()
                .filter_map(|(contact, depth_mm)| depth_mm.map(|value| (Parameter::Depth(contact), value)))
                .collect(),
        }
    }

    /// Whether the law goes with `projection`.
    pub const fn is_of_projection(&self) -> bool {
        match self {
            Self::Linear | Self::Fixed(_) | Self::Palmgren => true,
            Self::Johnson { .. } | Self::Hertz => false,
        }
    }
}
