//! What a contact of a tooth is: how it gives way under a force and what pressure the force makes (docs/explanation/theory.md sections 4.3 and 5).

pub mod flat;
pub(crate) mod line;
pub mod point;

use std::f64::consts::PI;

use crate::approach::{Approach, Corner, Logarithmic};
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

/// The law of the three contacts of a tooth, for whoever works in columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ToothLaw {
    /// `δ = F/k`, what stands behind the contact included.
    Linear { compliance_mm_per_n: PerContact<f64> },
    /// Palmgren's `δ = q F^0.9`, alike at all three.
    Palmgren { coefficient: f64 },
    /// The same at wave generator and ring and, unless a flat lies there, at the carrier, and what gives way besides in proportion to the force.
    PalmgrenAndLinear { coefficient: PerContact<f64>, compliance_mm_per_n: PerContact<f64> },
    /// Johnson's line, and what stands behind it.
    Johnson { law: PerContact<JohnsonLine>, series_compliance_mm_per_n: PerContact<f64> },
    /// Hertz's ellipses.
    Hertz,
}

/// `p` of Palmgren's law.
pub(crate) const PALMGREN_EXPONENT: f64 = 0.9;

/// The powers of the stresses that forces go with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StressExponents {
    /// 2 at all three contacts.
    Lines,
    /// 3.
    Ellipses,
    /// 2 at wave generator and ring, 1 at the carrier.
    LinesAndFlat,
}

impl StressExponents {
    /// Whether all three are.
    #[inline(always)]
    pub(crate) const fn are_alike(self) -> bool {
        !matches!(self, Self::LinesAndFlat)
    }

    /// Whether that of one of them is 1.
    #[inline(always)]
    pub(crate) const fn is_one_at(self, contact: Contact) -> bool {
        matches!((self, contact), (Self::LinesAndFlat, Contact::Carrier))
    }

    /// By how much a force is more where the stress at wave generator or ring is more by a factor.
    #[inline(always)]
    pub(crate) fn raised(self, factor: f64) -> f64 {
        match self {
            Self::Lines | Self::LinesAndFlat => factor * factor,
            Self::Ellipses => factor * factor * factor,
        }
    }

    /// The same at any contact.
    #[inline(always)]
    pub(crate) fn raised_at(self, contact: Contact, factor: f64) -> f64 {
        if self.is_one_at(contact) { factor } else { self.raised(factor) }
    }
}

/// A contact of a ball, whose curvature in the plane of motion the place decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BallContact {
    axial_per_mm: f64,
    modulus_mpa: f64,
}

impl BallContact {
    /// Where the curvatures in the plane of motion sum to `curvature_per_mm`.
    pub(crate) fn at(&self, curvature_per_mm: f64) -> Result<EllipticContact, NotConverged> {
        EllipticContact::new(curvature_per_mm, self.axial_per_mm, self.modulus_mpa)
    }
}

/// A flat on the wall of its slot, wherever the tooth stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Flat {
    length_mm: f64,
    width_mm: f64,
    carrier_inner_radius_mm: f64,
    carrier_outer_radius_mm: f64,
    modulus_mpa: f64,
    /// Whether it gives way by its own law.
    pub(crate) has_own_law: bool,
}

impl Flat {
    /// The length that is borne where the tooth's centre is `center_radius_mm` from the axis; nothing or less where the flat has left the carrier.
    pub(crate) fn borne_mm(&self, center_radius_mm: f64) -> f64 {
        let inner_mm = (center_radius_mm - 0.5 * self.length_mm).max(self.carrier_inner_radius_mm);
        let outer_mm = (center_radius_mm + 0.5 * self.length_mm).min(self.carrier_outer_radius_mm);
        outer_mm - inner_mm
    }

    /// The contact over so much of its length.
    pub(crate) const fn over(&self, borne_mm: f64) -> FlatContact {
        FlatContact::new(borne_mm, self.width_mm)
    }

    /// The contact over all of its length.
    pub(crate) const fn whole(&self) -> FlatContact {
        self.over(self.length_mm)
    }

    /// How far it gives way under 1 N over so much of its length.
    pub(crate) fn compliance_mm_per_n(&self, borne_mm: f64) -> f64 {
        self.over(borne_mm).compliance_mm_per_n(self.modulus_mpa)
    }
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
    /// That of a corner, of which nothing is told: as Hertz has it there is none, and it would have no end in a sharp one.
    Corner(CornerContact),
}

/// A tooth against the corner that ends the ring's flank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerContact {
    /// Relative curvature of the tooth and the flank's end.
    pub(crate) curvature_per_mm: f64,
    /// By how much the contact is turned against the flank's normal there.
    pub(crate) angle_rad: f64,
    /// How much more the ring's tooth bends for each unit of the logarithm by which the contact is narrower.
    pub(crate) bending_growth_mm_per_n: f64,
}

impl Pressure {
    /// The largest pressure under a force; the mean one of a flat, none of a corner.
    pub fn stress_mpa(&self, force_n: f64) -> f64 {
        match self {
            Self::Line { hertz, curvature_per_mm } => hertz.stress_mpa(force_n, *curvature_per_mm),
            Self::Ellipse(ellipse) => ellipse.stress_mpa(force_n),
            Self::Flat(flat) => flat.stress_mpa(force_n),
            Self::Corner(_) => 0.0,
        }
    }

    /// The pressure in the middle plane, summed along the plane of motion: of an ellipse `π a p/2`, a its half-width; elsewhere the force
    /// over the width. None of a corner, on which a tooth stays: it wears there as no flank does.
    pub fn line_load_n_per_mm(&self, force_n: f64, tooth_width_mm: f64) -> f64 {
        match self {
            Self::Line { .. } | Self::Flat(_) => force_n / tooth_width_mm,
            Self::Ellipse(ellipse) => 0.5 * PI * ellipse.half_width_mm(force_n) * ellipse.stress_mpa(force_n),
            Self::Corner(_) => 0.0,
        }
    }

    /// The inverse of [`Self::stress_mpa`].
    pub fn force_n(&self, stress_mpa: f64) -> f64 {
        match self {
            Self::Line { hertz, curvature_per_mm } => hertz.force_n(stress_mpa, *curvature_per_mm),
            Self::Ellipse(ellipse) => ellipse.force_n(stress_mpa),
            Self::Flat(flat) => flat.force_n(stress_mpa),
            Self::Corner(_) => f64::INFINITY,
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
        ContactLaw::Palmgren => {
            Law::Power { exponent: PALMGREN_EXPONENT, coefficient: 3.84e-5 / size.width_mm.powf(0.8) }
        }
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

    /// The law for whoever works in columns; none where it has no columns. Of a flat that gives way by its own law there is only what stands behind it.
    pub(crate) fn tooth_law(&self) -> Option<ToothLaw> {
        let series = &self.series_compliance_mm_per_n;
        let is_alone = series.iter().all(|(_, &compliance)| compliance == 0.0);
        let PerContact { wave_generator, ring, carrier } = &self.law;
        match (wave_generator, ring, carrier) {
            _ if matches!(self.shape, ToothContact::Ball { .. }) => {
                (is_alone && *wave_generator == Law::Ellipse).then_some(ToothLaw::Hertz)
            }
            (
                Law::Linear { compliance_mm_per_n: wave_generator },
                Law::Linear { compliance_mm_per_n: ring },
                carrier @ (Law::Linear { .. } | Law::Flat),
            ) => {
                let carrier =
                    if let Law::Linear { compliance_mm_per_n } = carrier { *compliance_mm_per_n } else { 0.0 };
                Some(ToothLaw::Linear {
                    compliance_mm_per_n: PerContact {
                        wave_generator: wave_generator + series.wave_generator,
                        ring: ring + series.ring,
                        carrier: carrier + series.carrier,
                    },
                })
            }
            (&Law::Power { coefficient, .. }, Law::Power { .. }, Law::Power { .. }) if is_alone => {
                Some(ToothLaw::Palmgren { coefficient })
            }
            (&Law::Power { coefficient, .. }, Law::Power { .. }, carrier @ (Law::Power { .. } | Law::Flat)) => {
                let at_carrier = if *carrier == Law::Flat { 0.0 } else { coefficient };
                Some(ToothLaw::PalmgrenAndLinear {
                    coefficient: PerContact { wave_generator: coefficient, ring: coefficient, carrier: at_carrier },
                    compliance_mm_per_n: *series,
                })
            }
            (&Law::Johnson(wave_generator), &Law::Johnson(ring), carrier @ (Law::Johnson(_) | Law::Flat)) => {
                let carrier = if let Law::Johnson(line) = carrier { *line } else { JohnsonLine::NONE };
                Some(ToothLaw::Johnson {
                    law: PerContact { wave_generator, ring, carrier },
                    series_compliance_mm_per_n: *series,
                })
            }
            _ => None,
        }
    }

    /// A contact of balls.
    pub(crate) fn ball(&self, contact: Contact) -> Option<BallContact> {
        let ToothContact::Ball { groove_radius_mm } = &self.shape else { return None };
        let r = self.tooth_radius_mm;
        // 1/r - 1/r_g without the difference of near numbers.
        let axial_per_mm = groove_radius_mm.get(contact).map_or(1.0 / r, |groove| (groove - r) / groove / r);
        Some(BallContact { axial_per_mm, modulus_mpa: *self.modulus_mpa.get(contact) })
    }

    /// The flat of flat-sided teeth.
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
            has_own_law: self.law.carrier == Law::Flat,
        })
    }

    /// What pressure a contact has where the curvatures in the plane of motion sum to `curvature_per_mm` and the tooth's centre is
    /// `center_radius_mm` from the axis; none where a flat has left the carrier.
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

    /// `ξ = Σ w δ` of a tooth over `F_H`, where the ring gives way by so much more than at its root.
    pub(crate) fn approach(&self, places: &PerContact<Place>, ring_bending_mm_per_n: f64) -> Approach {
        let mut linear_mm_per_n = places.ring.weight * (ring_bending_mm_per_n * places.ring.force_ratio);
        let mut power: Option<(f64, f64)> = None;
        let mut growth_mm_per_n = 0.0;
        // The contact that first reaches the width at which Johnson's law ends sets the force that logarithms count from: so all are positive.
        let johnson = PerContact::of(|contact| match (self.law.get(contact), &places.get(contact).pressure) {
            (
                Law::Johnson(law),
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
