//! Torque at which a contact reaches its allowable stress, or Johnson's law ends.

use super::equilibrium::ToothState;
use super::loaded_drive::LoadedDrive;
use crate::SolveError;
use crate::contact::{Contact, PerContact, half_width_mm};
use crate::contact_law::WIDEST_SHARE;
use crate::root::NotConverged;
use crate::springs::{Rotation, Spring};
use crate::tooth::Pressure;

/// Stress that limits the torque at one input angle.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueLimit {
    /// Torque at the wave generator at which the stress is reached.
    pub input_torque_nmm: f64,
    /// The contact that reaches its stress first, or the nearest to its stress if none does.
    pub contact: Contact,
    /// True if no contact reaches its stress: at a larger torque the wave generator would rotate past the teeth.
    pub turns_past_teeth: bool,
    /// The error of Johnson's law, if it ends before any stress is reached. The torque is then the one at that end, and
    /// the limit is higher.
    pub law_end: Option<SolveError>,
}

/// The first of many contacts to reach its limit.
struct FirstLimit<'a> {
    tooth: &'a ToothState,
    contact: Contact,
    rotation: Rotation,
}

impl<'a> LoadedDrive<'a> {
    /// Returns the largest input torque under which no contact of these teeth exceeds its stress, and the contact that
    /// reaches it.
    ///
    /// Loads grow with `Δφ` and `Δφ` with the torque, so the first contact to reach its stress sets `Δφ`, and that the
    /// torque.
    ///
    /// If Johnson's law ends before, the result is the torque at its end. If the lever arms change with wind-up, the
    /// torque may have a maximum before any contact reaches its stress. That maximum is then the result: larger torques
    /// are not carried until a contact has exceeded its stress.
    ///
    /// # Errors
    /// As [`Self::wind_up`], except for the end of Johnson's law.
    pub fn torque_limit(
        &self,
        teeth: &[ToothState],
        allowable_stress_mpa: &PerContact<f64>,
    ) -> Result<TorqueLimit, SolveError> {
        let limit = Self::first_to_reach(teeth, |tooth, contact| {
            tooth.pressure.get(contact).force_n(*allowable_stress_mpa.get(contact)) / tooth.force_ratio.get(contact)
        });
        let summit = self.springs(teeth).summit_before(limit.as_ref().map(|limit| &limit.rotation))?;
        let rotation = summit.map(|summit| summit.rotation).or(limit.as_ref().map(|limit| limit.rotation));
        let rotation = rotation.ok_or_else(|| self.carries_nothing(teeth))?;
        if let Some(end) = self.law_end(teeth, &rotation, true)? {
            return Ok(end);
        }
        let input_torque_nmm = self.springs(teeth).torque_nmm(&rotation)?.value;
        let contact = match limit {
            Some(FirstLimit { contact, .. }) if summit.is_none() => contact,
            _ => self.nearest_to_stress(teeth, &rotation, allowable_stress_mpa)?,
        };
        Ok(TorqueLimit { input_torque_nmm, contact, turns_past_teeth: summit.is_some(), law_end: None })
    }

    /// Returns the contact with the largest ratio of stress to allowable stress at a rotation.
    fn nearest_to_stress(
        &self,
        teeth: &[ToothState],
        rotation: &Rotation,
        allowable_stress_mpa: &PerContact<f64>,
    ) -> Result<Contact, NotConverged> {
        let mut nearest = (Contact::WaveGenerator, 0.0);
        for tooth in teeth {
            let cam_force_n = tooth.spring.force_n(rotation)?;
            let force_n = PerContact::of(|contact| cam_force_n * tooth.force_ratio.get(contact));
            for (contact, stress_mpa) in self.stress_mpa(tooth, &force_n).iter() {
                let share = stress_mpa / allowable_stress_mpa.get(contact);
                if share > nearest.1 {
                    nearest = (contact, share);
                }
            }
        }
        Ok(nearest.0)
    }

    /// Returns the tooth and contact that reach a given `F_H` at the least rotation.
    fn first_to_reach(teeth: &[ToothState], limit_n: impl Fn(&ToothState, Contact) -> f64) -> Option<FirstLimit<'_>> {
        let first_rad = teeth.iter().map(|tooth| tooth.spring.closing_rad).fold(f64::INFINITY, f64::min);
        let mut least: Option<(f64, FirstLimit<'_>)> = None;
        for tooth in teeth {
            let spring = &tooth.spring;
            let Spring { closing_rad, ref approach, .. } = *spring;
            for (contact, &ratio) in tooth.force_ratio.iter() {
                if ratio > 0.0 && spring.can_carry() {
                    let excess_rad = spring.excess_rad(approach.approach_mm(limit_n(tooth, contact)));
                    let from_first_rad = excess_rad + (closing_rad - first_rad);
                    if excess_rad.is_finite() && least.as_ref().is_none_or(|(least_rad, _)| from_first_rad < *least_rad)
                    {
                        let rotation = Rotation { closing_rad, excess_rad };
                        least = Some((from_first_rad, FirstLimit { tooth, contact, rotation }));
                    }
                }
            }
        }
        least.map(|(_, limit)| limit)
    }

    /// Returns the end of Johnson's law, as a limit of the load or of the torque capacity, if some contact is wider at
    /// this rotation than the law allows.
    pub(super) fn law_end(
        &self,
        teeth: &[ToothState],
        rotation: &Rotation,
        is_of_capacity: bool,
    ) -> Result<Option<TorqueLimit>, SolveError> {
        let tooth_radius_mm = self.drive.parameters().tooth_radius_mm;
        let Some(length_mm) = self.load.law.reference_length_mm(tooth_radius_mm) else { return Ok(None) };
        let is_beyond = |tooth: &ToothState| tooth.spring.displacement_mm(rotation) >= tooth.spring.approach.limit_mm();
        if !teeth.iter().any(is_beyond) {
            return Ok(None);
        }
        let tooth_width_mm = self.drive.tooth_width_mm();
        let limit_mm = |contact| WIDEST_SHARE * length_mm.get(contact);
        let limit = Self::first_to_reach(teeth, |tooth, contact| {
            // The half-width's square is proportional to the force.
            let pressure = tooth.pressure.get(contact);
            // The law applies to line contacts only.
            if matches!(pressure, Pressure::Corner(_) | Pressure::Flat(_)) {
                return f64::INFINITY;
            }
            let stress_mpa = pressure.stress_mpa(1.0);
            let share = limit_mm(contact) / half_width_mm(1.0, stress_mpa, tooth_width_mm);
            share * share / tooth.force_ratio.get(contact)
        });
        let FirstLimit { tooth, contact, rotation } = limit.ok_or_else(|| self.carries_nothing(teeth))?;
        let input_torque_nmm = self.springs(teeth).torque_nmm(&rotation)?.value;
        let error = SolveError::JohnsonBeyondHalfWidth {
            contact,
            position_deg: tooth.center.position.from_lobe_deg(),
            half_width_limit_mm: limit_mm(contact),
            input_torque_limit_nm: 1e-3 * input_torque_nmm,
            is_of_capacity,
        };
        Ok(Some(TorqueLimit { input_torque_nmm, contact, turns_past_teeth: false, law_end: Some(error) }))
    }
}
