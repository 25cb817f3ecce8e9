//! Findings about a drive's contacts under a load.

use super::FindingCode as Code;

use super::{FATIGUE_LIMIT_STRESS_MPA, Finding, GROOVE_DEPTH_SHARE_OF_BALL, STEEL_TOLERANCE, groove_radius_mm};
use crate::contact::{Contact, Materials, PerContact, half_width_mm};
use crate::contact_law::{ContactLaw, WIDE_SHARE};
use crate::drive::{Drive, ToothShape};
use crate::load_sharing::LoadCase;
use crate::sweep::{ContactPeaks, States};
use crate::tooth::plain_approach_mm;

/// Returns half the width at the edges of a groove of radius `r_g` and depth `t`: `√(t (2r_g - t))`, at most the ball's
/// radius.
fn groove_half_width_mm(groove_radius_mm: f64, ball_radius_mm: f64) -> f64 {
    let depth_mm = GROOVE_DEPTH_SHARE_OF_BALL * ball_radius_mm;
    (depth_mm * (2.0 * groove_radius_mm - depth_mm)).sqrt().min(ball_radius_mm)
}

/// True if the contact is that of a flat.
fn is_flat(drive: &Drive, contact: Contact) -> bool {
    contact == Contact::Carrier && matches!(drive.parameters().tooth, ToothShape::FlatSided { .. })
}

/// Returns the findings about a drive's contacts under a load. `approaches_matter` is true if wind-up or clearance is
/// computed.
pub fn of_contacts(
    drive: &Drive,
    load: &LoadCase,
    peaks: &PerContact<ContactPeaks>,
    approaches_matter: bool,
) -> Vec<Finding> {
    let p = load.parameters();
    let width_mm = drive.tooth_width_mm();
    let mut findings = Vec::new();
    let force_n = peaks.wave_generator.force_n.value;
    let approach_mm = |law: ContactLaw| plain_approach_mm(&law, &p.materials, width_mm, force_n);
    if p.law == ContactLaw::Linear
        && approaches_matter
        && let Some((linear_mm, palmgren_mm)) = approach_mm(ContactLaw::Linear).zip(approach_mm(ContactLaw::Palmgren))
    {
        findings.push(Finding::info(Code::LinearLawTooStiff, 1e3 * linear_mm, 1e3 * palmgren_mm));
    }
    if p.law == ContactLaw::Palmgren {
        let steel_mpa = Materials::default().contact_modulus_mpa(Contact::Ring);
        // A flat has its own law, which depends on the modulus.
        for (contact, _) in peaks.iter().filter(|&(contact, _)| !is_flat(drive, contact)) {
            let contact_mpa = p.materials.contact_modulus_mpa(contact);
            if (contact_mpa / steel_mpa - 1.0).abs() > STEEL_TOLERANCE {
                let (contact_gpa, steel_gpa) = (1e-3 * contact_mpa, 1e-3 * steel_mpa);
                findings.push(Finding::warning(Code::PalmgrenBeyondSteel, contact_gpa, steel_gpa).at(contact));
            }
        }
    }
    for (contact, peaks) in peaks.iter() {
        if let Some(half_length_mm) = peaks.half_length_mm
            && let Some(groove_radius_mm) = groove_radius_mm(drive, contact)
        {
            let limit_mm = groove_half_width_mm(groove_radius_mm, drive.parameters().tooth_radius_mm);
            let finding = Finding::above(Code::ContactBeyondGroove, half_length_mm, limit_mm);
            findings.extend(finding.map(|finding| finding.at(contact)));
        }
    }
    let overstressed = |code: Code, contact: Contact, limit_mpa: f64| {
        Some(Finding::above(code, peaks.get(contact).stress_mpa.value, limit_mpa)?.at(contact))
    };
    // The fatigue limit has its own finding.
    let allowables = p.allowable_stress_mpa.iter().flat_map(PerContact::iter);
    let allowables = allowables.filter(|(_, mpa)| mpa.total_cmp(&FATIGUE_LIMIT_STRESS_MPA).is_ne());
    findings.extend(allowables.filter_map(|(contact, &mpa)| overstressed(Code::StressAboveAllowable, contact, mpa)));
    let of_fatigue = |contact| overstressed(Code::StressAboveFatigueLimit, contact, FATIGUE_LIMIT_STRESS_MPA);
    findings.extend(Contact::all().into_iter().filter_map(of_fatigue));
    findings
}

/// Returns half the width of the widest contact of each kind over all states, at the most loaded place along the teeth.
/// It is not the contact with the largest stress. Flats have none.
pub(crate) fn widest_half_widths_mm(
    drive: &Drive,
    states: &States,
    load_peak_over_mean: f64,
) -> impl Iterator<Item = (Contact, f64)> {
    let tooth_width_mm = drive.tooth_width_mm();
    states.force_n.iter().filter(|&(contact, _)| !is_flat(drive, contact)).map(move |(contact, forces_n)| {
        // A corner has no such width, and its stress is not reported.
        let loaded = forces_n.iter().zip(states.stress_mpa.get(contact)).filter(|&(_, &stress_mpa)| stress_mpa > 0.0);
        let half_widths = loaded.map(|(&force_n, &stress_mpa)| half_width_mm(force_n, stress_mpa, tooth_width_mm));
        (contact, load_peak_over_mean.sqrt() * half_widths.fold(0.0, f64::max))
    })
}

/// Returns the contacts that are too wide for Johnson's law, over all states, whose stresses are means along the teeth.
pub fn of_half_widths(drive: &Drive, load: &LoadCase, states: &States, load_peak_over_mean: f64) -> Vec<Finding> {
    let length_mm = load.parameters().law.reference_length_mm(drive.parameters().tooth_radius_mm);
    let Some(length_mm) = length_mm else { return Vec::new() };
    widest_half_widths_mm(drive, states, load_peak_over_mean)
        .filter_map(|(contact, half_width_mm)| {
            let limit_mm = WIDE_SHARE * length_mm.get(contact);
            Some(Finding::above(Code::JohnsonBeyondHalfWidth, half_width_mm, limit_mm)?.at(contact))
        })
        .collect()
}
