//! Resolution of a document: defaults of fields that are left out, and deprecated fields.

use serde::Serialize;
use toothwave_solver::drive::Draft;
use toothwave_solver::violation::Modified;
use toothwave_solver::{Compatibility, Modification, Parameter, Part, PerContact, Violation, model_error};

use super::{
    ClearanceDocument, Design, ModelDocument, Refinements, StiffnessDocument, StrengthDocument, TeethDocument,
};
use crate::field::FieldError;

/// Relative difference of a gap and a sum of clearances that is due to rounding.
const ROUNDING: f64 = 1e-12;

/// Clearance of each part: offset of its working surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ClearancesUm {
    /// Clearance of the parts that the teeth touch.
    pub by_contact: PerContact<f64>,
    /// Clearance of the teeth.
    pub teeth: f64,
}

impl ClearancesUm {
    /// Returns the gap at each contact: the sum of its two parts' clearances.
    pub fn gaps(&self) -> PerContact<f64> {
        PerContact::of(|contact| self.by_contact.get(contact) + self.teeth)
    }
}

/// JSON pointer of the deprecated gaps.
pub const DEPRECATED_CLEARANCE: &str = "/model/clearance";

/// JSON pointers of the deprecated switches of refinements.
pub const DEPRECATED_SWITCHES: [&str; 3] =
    ["/model/ring_teeth_bend", "/model/wave_generator_moves", "/model/corner_contact"];

impl Design {
    /// Returns the JSON pointers of the deprecated fields that have an effect.
    pub fn deprecated_fields(&self) -> Vec<&'static str> {
        let clearance = (self.deprecated_gaps_um() != PerContact::default()).then_some(DEPRECATED_CLEARANCE);
        let switches = self.model.switches().filter_map(|(pointer, is_on)| is_on.map(|_| pointer));
        clearance.into_iter().chain(switches).collect()
    }

    /// Returns the gaps of `model.clearance`.
    fn deprecated_gaps_um(&self) -> PerContact<f64> {
        self.model.clearance.as_ref().map_or_else(PerContact::default, |clearance| PerContact {
            wave_generator: clearance.wave_generator_um,
            ring: clearance.ring_um,
            carrier: clearance.carrier_um,
        })
    }

    /// Returns the clearances of `parts` only.
    fn clearances_of_parts_um(&self) -> ClearancesUm {
        let parts = &self.parts;
        let by_contact = PerContact {
            wave_generator: parts.wave_generator.clearance_um,
            ring: parts.ring.clearance_um,
            carrier: parts.carrier.clearance_um,
        };
        ClearancesUm { by_contact, teeth: parts.teeth.clearance_um }
    }

    /// Returns the clearances of the parts. A gap of `model.clearance` is assigned to the part that the teeth touch
    /// there.
    pub fn clearances_um(&self) -> ClearancesUm {
        let (mut clearances, deprecated) = (self.clearances_of_parts_um(), self.deprecated_gaps_um());
        let gaps = clearances.gaps();
        for (contact, &gap_um) in deprecated.iter() {
            if gap_um != 0.0 && *gaps.get(contact) == 0.0 {
                *clearances.by_contact.get_mut(contact) = gap_um;
            }
        }
        clearances
    }

    /// Returns the surfaces that are offset by two fields: a clearance and a modification, both in µm.
    pub fn set_back_twice(&self) -> impl Iterator<Item = [(Parameter, f64); 2]> + use<> {
        let ClearancesUm { by_contact: PerContact { wave_generator, ring, carrier }, teeth } = self.clearances_um();
        let Modification { wave_generator_equidistant_um, tooth_radius_um, ring_equidistant_um, slot_wall_um, .. } =
            self.modification;
        let pairs = [
            (Part::WaveGenerator, wave_generator, Modified::WaveGeneratorEquidistant, wave_generator_equidistant_um),
            (Part::Teeth, teeth, Modified::ToothRadius, tooth_radius_um),
            (Part::Ring, ring, Modified::RingEquidistant, ring_equidistant_um),
            (Part::Carrier, carrier, Modified::SlotWall, slot_wall_um),
        ];
        let fields = pairs.map(|(part, clearance_um, modified, modification_um)| {
            [(Parameter::PartClearance(part), clearance_um), (Parameter::Modification(modified), modification_um)]
        });
        fields.into_iter().filter(|fields| fields.iter().all(|&(_, offset_um)| offset_um != 0.0))
    }

    /// Checks that `model.clearance` and `parts` do not give a contact different gaps.
    pub fn require_one_clearance(&self) -> Result<(), FieldError> {
        let of_parts = self.clearances_of_parts_um().gaps();
        for (contact, &gap_um) in self.deprecated_gaps_um().iter() {
            let of_parts = *of_parts.get(contact);
            let differs = (gap_um - of_parts).abs() > ROUNDING * gap_um.abs();
            if gap_um != 0.0 && of_parts != 0.0 && differs {
                let detail = format!(
                    "the gap is {gap_um:?} µm here, and {of_parts:?} µm by `parts.{contact}.clearance_um` and `parts.teeth.clearance_um`; leave out `model.clearance`, which is deprecated"
                );
                return Err(FieldError::conflict(&Parameter::Clearance(contact).to_string(), detail));
            }
        }
        Ok(())
    }

    /// Checks that deprecated switches do not conflict with `refinements` or `projection`.
    pub fn require_one_choice_of_refinements(&self) -> Result<(), FieldError> {
        let is_projection = self.model.compatibility == Compatibility::Projection;
        let is_chosen = self.model.refinements != Refinements::AUTO;
        for (pointer, is_on) in self.model.switches() {
            let detail = match is_on {
                Some(_) if is_chosen => {
                    "`refinements` says already which refinements the model has; leave out this field, which is deprecated"
                }
                Some(true) if is_projection => "`projection` takes no refinement; choose `virtual_work`",
                _ => continue,
            };
            return Err(FieldError::conflict(pointer, detail));
        }
        Ok(())
    }

    /// Returns every clearance that is out of its range.
    pub fn clearance_violations(&self) -> Vec<Violation> {
        let ClearancesUm { by_contact, teeth } = self.clearances_of_parts_um();
        let of_parts = by_contact.iter().map(|(contact, &value)| (Parameter::PartClearance(contact.mate()), value));
        let of_teeth = [(Parameter::PartClearance(Part::Teeth), teeth)];
        let deprecated = self.deprecated_gaps_um();
        let deprecated = deprecated.iter().map(|(contact, &value)| (Parameter::Clearance(contact), value));
        of_parts.chain(of_teeth).chain(deprecated).filter_map(|(parameter, value)| parameter.check(value)).collect()
    }

    /// Returns true if any contact has a gap.
    fn has_gaps(&self) -> bool {
        self.clearances_um().gaps() != PerContact::default() || !self.modification.is_nil() || !self.deviations.is_nil()
    }

    /// Returns the choice of `auto` under virtual work. Refinements of balls and flat-sided teeth were not checked
    /// against elastic bodies.
    fn refinements_by_geometry(&self, has_pointed_tips: bool) -> Refinements {
        let is_refined = has_pointed_tips && matches!(self.drive.teeth, TeethDocument::Cylinder { .. });
        let wave_generator_moves = is_refined && self.has_gaps();
        Refinements { ring_teeth_bend: is_refined, wave_generator_moves, ..Refinements::NONE }
    }

    /// Returns the refinements of the model, for a drive with or without pointed or bored tips. A list with `projection`
    /// is rejected elsewhere.
    pub fn refinements(&self, has_pointed_tips: bool) -> Refinements {
        self.refinements_of(self.model.refinements, has_pointed_tips)
    }

    fn refinements_of(&self, asked: Refinements, has_pointed_tips: bool) -> Refinements {
        let by_geometry = match self.model.compatibility {
            Compatibility::VirtualWork if asked.auto => self.refinements_by_geometry(has_pointed_tips),
            _ => Refinements::NONE,
        };
        let ModelDocument { ring_teeth_bend, wave_generator_moves, corner_contact, .. } = self.model;
        let moves = by_geometry.wave_generator_moves || asked.wave_generator_moves;
        Refinements {
            auto: false,
            ring_teeth_bend: ring_teeth_bend.unwrap_or(by_geometry.ring_teeth_bend || asked.ring_teeth_bend),
            // If bending is off, the geometry never chose any refinement.
            wave_generator_moves: wave_generator_moves.unwrap_or(moves && ring_teeth_bend != Some(false)),
            corner_contact: corner_contact.unwrap_or(by_geometry.corner_contact || asked.corner_contact),
        }
    }

    /// Returns the refinements under virtual work, whatever the document's compatibility. A document with `projection`
    /// chooses none for its own model only.
    pub fn refinements_by_virtual_work(&self, has_pointed_tips: bool) -> Refinements {
        match self.model.compatibility {
            Compatibility::VirtualWork => self.refinements(has_pointed_tips),
            Compatibility::Projection => self.refinements_by_geometry(has_pointed_tips),
        }
    }

    /// Returns the contact law with all its values. By default it is the most accurate one, or the paper's law with the
    /// paper's compatibility.
    pub fn stiffness(&self) -> StiffnessDocument {
        let by_default = || match (&self.drive.teeth, self.model.compatibility) {
            (TeethDocument::Ball { .. }, _) => StiffnessDocument::Hertz {},
            (_, Compatibility::Projection) => StiffnessDocument::Linear {},
            (_, Compatibility::VirtualWork) => StiffnessDocument::Johnson { depth_mm: Default::default() },
        };
        let mut stiffness = self.model.stiffness.clone().unwrap_or_else(by_default);
        stiffness.fill_in(self.drive.teeth.counted().radius_mm);
        stiffness
    }

    /// The complete model, for a drive that has pointed or bored tips or not. `refinements` replaces deprecated switches.
    pub fn complete_model(&self, has_pointed_tips: bool) -> ModelDocument {
        ModelDocument {
            compatibility: self.model.compatibility,
            stiffness: Some(self.stiffness()),
            series_compliance_mm_per_n: self.model.series_compliance_mm_per_n.clone(),
            refinements: self.refinements(has_pointed_tips),
            clearance: self.effective_clearance(),
            ..ModelDocument::default()
        }
    }

    /// Returns the document with every default that depends on other fields, except refinements that follow from the
    /// geometry.
    pub fn with_defaults(mut self) -> Self {
        self.model.stiffness = Some(self.stiffness());
        self.model.clearance = self.effective_clearance();
        self.drive.teeth.install_all_by_default();
        self
    }

    /// Returns the document in one of several spellings with the same meaning: strengths as numbers and, if the drive is
    /// that of every variant, `auto` for the refinements that it means.
    pub fn in_one_spelling(mut self, is_only_drive: bool) -> Self {
        let strength = self.parts.carrier.strength;
        self.parts.carrier.strength = strength.map(|strength| StrengthDocument::Given(strength.numbers()));
        // Deprecated switches are kept, because answers name them.
        let has_switch = self.model.switches().any(|(_, is_on)| is_on.is_some());
        // Only refinements other than `auto` depend on the geometry.
        if is_only_drive && !has_switch && self.model.refinements != Refinements::AUTO {
            let drive = Draft::new(&self.drive_parameters()).ok().and_then(|draft| draft.drive());
            let has_pointed_tips = drive.is_some_and(|drive| model_error::has_pointed_tips(&drive));
            let refinements = self.refinements(has_pointed_tips);
            let is_auto = refinements == self.refinements_of(Refinements::AUTO, has_pointed_tips);
            self.model.refinements = if is_auto { Refinements::AUTO } else { refinements };
        }
        self
    }

    /// Returns the document for keys. A default that is written out gives the same key as one that is left out.
    pub(crate) fn in_key(&self) -> Self {
        self.clone().with_defaults().in_one_spelling(true)
    }

    /// Returns what a drawing reads, for keys.
    pub(crate) fn drawn_in_key(&self) -> impl Serialize + use<> {
        let Self { drive, parts, model, modification, profile, .. } = self.in_key();
        (drive, (parts.drawn(), model.clearance), modification, profile.chord_tolerance_mm)
    }

    /// Returns `model.clearance` if it has an effect.
    fn effective_clearance(&self) -> Option<ClearanceDocument> {
        self.model.clearance.clone().filter(|_| self.deprecated_gaps_um() != PerContact::default())
    }
}

impl ModelDocument {
    /// Returns the deprecated switches, by JSON pointer.
    fn switches(&self) -> impl Iterator<Item = (&'static str, Option<bool>)> + use<> {
        DEPRECATED_SWITCHES.into_iter().zip([self.ring_teeth_bend, self.wave_generator_moves, self.corner_contact])
    }
}
