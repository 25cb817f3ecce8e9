//! Given stiffnesses.

use super::{Law, LawName, Suits, Term, ToothSize};
use crate::contact::{Contact, Materials, PerContact};
use crate::violation::Parameter;

/// Stiffnesses in N/mm.
pub(super) struct Fixed(pub(super) PerContact<f64>);

impl Law for Fixed {
    fn name(&self) -> LawName {
        LawName::Fixed
    }

    fn suits(&self) -> Suits {
        Suits::All
    }

    fn term(&self, contact: Contact, _: &Materials, _: ToothSize) -> Term {
        Term::Linear { compliance_mm_per_n: 1.0 / self.0.get(contact) }
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        self.0.iter().map(|(contact, &stiffness)| (Parameter::Stiffness(contact), stiffness)).collect()
    }

    fn is_of_projection(&self) -> bool {
        true
    }
}
