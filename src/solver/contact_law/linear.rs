//! The paper's linear law.

use std::f64::consts::PI;

use super::{Law, LawName, Suits, Term, ToothSize};
use crate::contact::{Contact, Materials};

pub(super) struct Linear;

impl Law for Linear {
    fn name(&self) -> LawName {
        LawName::Linear
    }

    fn suits(&self) -> Suits {
        Suits::Lines
    }

    fn term(&self, contact: Contact, materials: &Materials, tooth: ToothSize) -> Term {
        let stiffness = 0.5 * PI * tooth.width_mm * materials.contact_modulus_mpa(contact);
        Term::Linear { compliance_mm_per_n: 1.0 / stiffness }
    }

    fn is_of_projection(&self) -> bool {
        true
    }
}
