//! Palmgren's power law for steel on steel.

use super::{Law, LawName, Suits, Term, ToothSize};
use crate::contact::{Contact, Materials};

/// Power of the force.
pub(crate) const EXPONENT: f64 = 0.9;

pub(super) struct Palmgren;

impl Law for Palmgren {
    fn name(&self) -> LawName {
        LawName::Palmgren
    }

    fn suits(&self) -> Suits {
        Suits::Lines
    }

    fn term(&self, _: Contact, _: &Materials, tooth: ToothSize) -> Term {
        Term::Power { exponent: EXPONENT, coefficient: 3.84e-5 / tooth.width_mm.powf(0.8) }
    }

    fn is_of_projection(&self) -> bool {
        true
    }
}
