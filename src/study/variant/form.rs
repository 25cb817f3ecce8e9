//! One form of a document: the choices that decide which fields it has.

use std::collections::BTreeMap;

use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::Tree;

use super::variable::{Domain, Variable};
use super::{LAW, RING_TEETH};
use crate::defaults::complete;

#[derive(Debug, Clone)]
pub(super) struct Form {
    pub(super) tree: Tree,
    /// For each variable, true if this form has it.
    pub(super) takes: Vec<bool>,
    pub(super) derives_ring_teeth: bool,
}

/// True if a pointer is at a place or within it.
pub(super) fn is_within(pointer: &str, place: &str) -> bool {
    pointer.strip_prefix(place).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

impl Form {
    /// Sets the ring's teeth if the base has none: the number of teeth minus the number of lobes.
    pub(super) fn derive(&mut self) {
        if !self.derives_ring_teeth {
            return;
        }
        let number = |place: &[&str]| match self.tree.at(place) {
            Some(Tree::Number(number)) => Some(*number),
            _ => None,
        };
        let kind = self.tree.at(&["drive", "wave_generator", "kind"]);
        let lobes = match kind {
            Some(Tree::Text(kind)) if kind == "eccentric" => Some(1.0),
            Some(Tree::Text(kind)) if kind == "ellipse" => Some(2.0),
            Some(_) => number(&["drive", "wave_generator", "lobes"]),
            None => Some(2.0),
        };
        if let (Some(lobes), Some(count)) = (lobes, number(&["drive", "teeth", "count"])) {
            self.tree.set(&RING_TEETH, Tree::Number(count - lobes));
        }
    }

    /// Names the default law, if free fields are its numbers and nothing names the law.
    pub(super) fn name_law_of_numbers(&mut self) {
        if self.tree.at(&LAW[..2]).is_none() || self.tree.at(&LAW).is_some() {
            return;
        }
        let mut without = self.tree.clone();
        without.remove(&LAW[..2]);
        if let Some(name) = complete(&without).ok().and_then(|complete| complete.at(&LAW).cloned()) {
            self.tree.set(&LAW, name);
        }
    }

    /// Sets every free number to its smallest value.
    pub(super) fn put_least(&mut self, variables: &[Variable]) {
        for (variable, _) in variables.iter().zip(&self.takes).filter(|(_, takes)| **takes) {
            if let Domain::Real { min, .. } | Domain::Whole { min, .. } = variable.domain {
                self.tree.set(&variable.path, Tree::Number(min));
            }
        }
        self.derive();
    }

    /// Finds the variables that this form parses as whole numbers: they reject a number with a half. All are tried at
    /// once, because there may be thousands.
    pub(super) fn find_whole(&self, variables: &mut [Variable], indices: &[usize]) {
        let mut tree = self.tree.clone();
        let mut real = BTreeMap::new();
        for &index in indices {
            let Variable { pointer, path, domain, .. } = &variables[index];
            if let Domain::Real { min, .. } = domain {
                tree.set(path, Tree::Number(min.floor() + 0.5));
                real.insert(pointer.clone(), index);
            }
        }
        while let Err(found) = tree.read::<Design>()
            && found.code == FieldCode::WrongType
            && let Some(index) = real.remove(&found.pointer)
        {
            let Variable { path, domain, .. } = &mut variables[index];
            if let Domain::Real { min, max } = *domain {
                *domain = Domain::Whole { min: min.ceil(), max: max.floor() };
                tree.set(path, Tree::Number(min.ceil()));
            }
        }
    }
}
