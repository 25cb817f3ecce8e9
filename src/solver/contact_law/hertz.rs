//! Hertz's law of point contacts.

use super::{Law, LawName, Suits, Term};
use crate::contact::{Contact, Materials};
use crate::tooth::ToothSize;

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
