//! Hertz's law of point contacts.

use super::{Law, LawName, Suits, Term, ToothSize};
use crate::contact::{Contact, Materials};

pub(super) struct Hertz;

impl Law for Hertz {
    fn name(&self) -> LawName {
        LawName::Hertz
    }

    fn suits(&self) -> Suits {
        Suits::Balls
    }

    fn term(&self, _: Contact, _: &Materials, _: ToothSize) -> Term {
        Term::Ellipse
    }
}
