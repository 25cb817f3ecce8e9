//! Contact laws, one file for each (docs/explanation/theory.md section 4.3).
//!
//! To add a law, add a file that implements `Law`. Then add its lines to [`ContactLaw`], [`LawName`] and
//! `ContactLaw::law` below. Approach, slope, inverse and load sharing follow from its `Term`.

mod fixed;
mod hertz;
mod johnson;
mod linear;
mod palmgren;
mod term;

use crate::contact::{Contact, Materials, PerContact};
use crate::drive::ToothShape;
use crate::violation::Parameter;

pub(crate) use johnson::{WIDE_SHARE, WIDEST_SHARE};
pub(crate) use palmgren::EXPONENT as PALMGREN_EXPONENT;
pub(crate) use term::{LogarithmicTerm, Term};

/// Contact law: relation of force and approach of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ContactLaw {
    /// `F = k δ` \[7\] with `k = π L1 E*/2`, of two parallel cylinders in line contact (Yang and Sun 1985).
    Linear,
    /// `F = k δ` with given stiffnesses, in N/mm.
    Fixed(PerContact<f64>),
    /// Palmgren's `δ = 3.84e-5 F^0.9/L^0.8` (steel on steel, N and mm).
    Palmgren,
    /// The logarithmic approach of a cylinder between two bodies (K. L. Johnson, *Contact Mechanics*, 1985, section
    /// 5.6). Each body is fixed at a depth, by default the tooth's radius.
    Johnson {
        /// Depth of each body below its contact, in mm.
        depth_mm: PerContact<Option<f64>>,
    },
    /// Hertz's `δ = q F^(2/3)` of a point contact: the law of balls.
    Hertz,
}

/// A contact law by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum LawName {
    /// `k = π L1 E*/2`.
    Linear,
    /// Given stiffnesses.
    Fixed,
    /// Palmgren's.
    Palmgren,
    /// Johnson's.
    Johnson,
    /// Hertz's.
    Hertz,
}

/// Teeth that a law is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Suits {
    /// Any teeth, flats and balls included.
    All,
    /// Line contacts. A flat has its own law.
    Lines,
    /// Balls.
    Balls,
}

/// Where teeth touch at a contact: along a line, in an ellipse, or with a flat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Touch {
    Line,
    Ellipse,
    Flat,
}

/// Radius and width of a tooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToothSize {
    pub(crate) radius_mm: f64,
    pub(crate) width_mm: f64,
}

/// A contact law.
pub(crate) trait Law {
    /// Returns its name.
    fn name(&self) -> LawName;

    /// Returns the teeth that it is for.
    fn suits(&self) -> Suits;

    /// Returns the approach under a force at one contact of a tooth.
    fn term(&self, contact: Contact, materials: &Materials, tooth: ToothSize) -> Term;

    /// Returns its parameters, whose ranges are checked.
    fn parameters(&self) -> Vec<(Parameter, f64)> {
        Vec::new()
    }

    /// Returns true if it can be combined with `projection`.
    fn is_of_projection(&self) -> bool {
        false
    }

    /// Returns the depth up to which each body's approach is included; none if the law has no such depth. A logarithmic
    /// term needs it: the term ends where half the contact's width is half the lesser of depth and tooth radius.
    fn depth_mm(&self, _tooth_radius_mm: f64) -> Option<PerContact<f64>> {
        None
    }
}

impl Default for ContactLaw {
    fn default() -> Self {
        Self::JOHNSON
    }
}

impl ContactLaw {
    /// Johnson's law, each body fixed at the depth of the tooth's radius.
    pub const JOHNSON: Self =
        Self::Johnson { depth_mm: PerContact { wave_generator: None, ring: None, carrier: None } };

    /// The laws that need no numbers.
    pub const WITHOUT_NUMBERS: [Self; 4] = [Self::Linear, Self::Palmgren, Self::JOHNSON, Self::Hertz];

    /// Message for a law that does not suit the teeth.
    pub(crate) const SUITABLE: &'static str =
        "balls take `hertz` or `fixed`, and `hertz` is nowhere else: choose a law that teeth of this shape have";

    /// Asks the file of the law.
    fn law<T>(&self, ask: impl FnOnce(&dyn Law) -> T) -> T {
        match *self {
            Self::Linear => ask(&linear::Linear),
            Self::Fixed(stiffness_n_per_mm) => ask(&fixed::Fixed(stiffness_n_per_mm)),
            Self::Palmgren => ask(&palmgren::Palmgren),
            Self::Johnson { depth_mm } => ask(&johnson::Johnson { depth_mm }),
            Self::Hertz => ask(&hertz::Hertz),
        }
    }

    /// Returns the name.
    pub fn name(&self) -> LawName {
        self.law(|law| law.name())
    }

    /// Returns true if the law is one of such teeth.
    pub fn suits(&self, teeth: &ToothShape) -> bool {
        match self.law(|law| law.suits()) {
            Suits::All => true,
            Suits::Lines => !matches!(teeth, ToothShape::Ball { .. }),
            Suits::Balls => matches!(teeth, ToothShape::Ball { .. }),
        }
    }

    /// Returns true if the law can be combined with `projection`.
    pub fn is_of_projection(&self) -> bool {
        self.law(|law| law.is_of_projection())
    }

    /// Returns the numerical parameters of the law.
    pub(crate) fn parameters(&self) -> Vec<(Parameter, f64)> {
        self.law(|law| law.parameters())
    }

    /// Returns the depth up to which the law includes each body's approach, if it has one.
    pub(crate) fn depth_mm(&self, tooth_radius_mm: f64) -> Option<PerContact<f64>> {
        self.law(|law| law.depth_mm(tooth_radius_mm))
    }

    /// Returns the length with which half the width of each contact is compared, the lesser of the tooth's radius and
    /// the law's depth; none if the law holds for any width.
    pub(crate) fn reference_length_mm(&self, tooth_radius_mm: f64) -> Option<PerContact<f64>> {
        let depth_mm = self.depth_mm(tooth_radius_mm)?;
        Some(PerContact::of(|contact| depth_mm.get(contact).min(tooth_radius_mm)))
    }

    /// Returns the approach at one contact of a tooth; none if the law is not for teeth that touch so.
    pub(crate) fn term(&self, touch: Touch, contact: Contact, materials: &Materials, tooth: ToothSize) -> Option<Term> {
        self.law(|law| match (law.suits(), touch) {
            (Suits::Lines, Touch::Flat) => Some(Term::Flat),
            (Suits::Lines, Touch::Ellipse) | (Suits::Balls, Touch::Line | Touch::Flat) => None,
            _ => Some(law.term(contact, materials, tooth)),
        })
    }
}
