//! What a designer should be told about a drive that can exist (docs/findings.md).

use crate::contact::{Contact, ContactLaw, Material, Materials, PerContact};
use crate::drive::Drive;
use crate::load_sharing::LoadCase;
use crate::mesh::Mesh;
use crate::ring::FlankEnd;
use crate::root::NotConverged;
use crate::sweep::{ContactPeaks, Sweep};

/// Contact stress at the fatigue limit of bearing steel (ISO 281:2007).
pub const FATIGUE_LIMIT_STRESS_MPA: f64 = 1500.0;

/// A wall thinner than this share of its slot's width is reported: a rule of thumb, not a strength calculation.
pub const THIN_WALL_SHARE_OF_SLOT: f64 = 0.25;

/// A ring pressure angle beyond this is reported: there the ring carries about three times the cam's radial force, and
/// friction, which the model leaves out, begins to decide whether the drive turns at all.
pub const STEEP_FLANK_DEG: f64 = 70.0;

/// How far a contact modulus may be from that of steel on steel for Palmgren's constant to hold without a word: steels differ by less.
pub const STEEL_TOLERANCE: f64 = 0.1;

/// A wind-up beyond this share of the period is reported. Lever arms and directions are those of the positions without load, and a wind-up of
/// one period moves every tooth on by one spacing: a tenth of it by a tenth of a spacing, which begins to be a matter of per cent.
pub const WIND_UP_SHARE_OF_PERIOD: f64 = 0.1;

const STEEL: Material = Material::STEEL;

/// The edge of the carrier's annulus that a tooth passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// Towards the wave generator.
    Inner,
    /// Towards the ring.
    Outer,
}

/// Something questionable about a drive or its load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// The ring's tips are cut away by their own envelope.
    Undercut {
        /// `r`.
        tooth_radius_mm: f64,
        /// The least radius that undercuts.
        critical_tooth_radius_mm: f64,
        /// Where teeth then start to touch the flank.
        engagement_start_deg: f64,
        /// Whether a bore takes more away than undercut does.
        is_bored_away: bool,
    },
    /// The bore ends the flank before its natural tip: teeth enter under load.
    BoreShortensFlank {
        /// The bore.
        tip_radius_mm: f64,
        /// The tip without it.
        natural_tip_radius_mm: f64,
        /// Where teeth then start to touch the flank.
        engagement_start_deg: f64,
    },
    /// The bore lies inside the natural tip.
    BoreWithoutEffect {
        /// The bore.
        tip_radius_mm: f64,
        /// The tip without it.
        natural_tip_radius_mm: f64,
    },
    /// At some input angle fewer than two teeth of a zone mesh.
    FewTeethInMesh {
        /// How many.
        min: u64,
    },
    /// The wall between two slots is thin.
    ThinSlotWall {
        /// Its least thickness.
        slot_wall_mm: f64,
        /// What it is measured against.
        limit_mm: f64,
    },
    /// A loaded tooth's centre leaves the annulus between wave generator and ring tips: it presses on a slot's edge.
    ToothBeyondCarrier {
        /// Which edge it passes.
        edge: Edge,
        /// How far its centre goes.
        center_radius_mm: f64,
        /// The edge of the annulus.
        limit_mm: f64,
    },
    /// The flank stands steep to the radius.
    SteepRingFlank {
        /// Largest pressure angle β on the engaged flank.
        pressure_angle_deg: f64,
    },
    /// The linear law where approaches matter: it is several times too stiff.
    LinearLawTooStiff {
        /// The approach at the wave generator under the peak force by the linear law.
        linear_um: f64,
        /// The same by Palmgren's law.
        palmgren_um: f64,
    },
    /// Palmgren's law for a contact that is not steel on steel.
    PalmgrenBeyondSteel {
        /// Which.
        contact: Contact,
        /// Its contact modulus.
        contact_modulus_gpa: f64,
        /// That of steel on steel.
        steel_gpa: f64,
    },
    /// A wind-up so large that the teeth no longer stand where the model has them.
    WindUpBeyondModel {
        /// The largest wind-up of the input.
        wind_up_deg: f64,
        /// What it is measured against.
        limit_deg: f64,
    },
    /// A stress above the fatigue limit of bearing steel.
    StressAboveFatigueLimit {
        /// Where.
        contact: Contact,
        /// The peak.
        stress_mpa: f64,
    },
}

/// The findings about the drive itself.
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn of_drive(drive: &Drive) -> Result<Vec<Finding>, NotConverged> {
    let mut findings = Vec::new();
    let p = drive.parameters();
    let flank = drive.flank();
    let limit = drive.flank_limit();
    let engagement_start_deg = limit.position.from_major_deg();
    let natural_tip_radius_mm = drive.natural_tip_radius_mm();
    if flank.is_undercut()
        && let Some(critical_tooth_radius_mm) = flank.critical_tooth_radius_mm()
    {
        findings.push(Finding::Undercut {
            tooth_radius_mm: p.tooth_radius_mm,
            critical_tooth_radius_mm,
            engagement_start_deg,
            is_bored_away: limit.end == FlankEnd::Bore,
        });
    }
    match p.tip_radius_mm {
        Some(tip_radius_mm) if limit.end == FlankEnd::Bore => {
            findings.push(Finding::BoreShortensFlank { tip_radius_mm, natural_tip_radius_mm, engagement_start_deg });
        }
        Some(tip_radius_mm) if tip_radius_mm < natural_tip_radius_mm => {
            findings.push(Finding::BoreWithoutEffect { tip_radius_mm, natural_tip_radius_mm });
        }
        Some(_) | None => {}
    }
    let min = Mesh::new(drive).teeth_in_mesh().min;
    if min < 2 {
        findings.push(Finding::FewTeethInMesh { min });
    }
    let slot_wall_mm = drive.slot_wall_mm();
    let limit_mm = THIN_WALL_SHARE_OF_SLOT * 2.0 * p.tooth_radius_mm;
    if slot_wall_mm < limit_mm {
        findings.push(Finding::ThinSlotWall { slot_wall_mm, limit_mm });
    }
    let innermost_mm = flank.locus().at(limit.position)?.center_radius_mm;
    if innermost_mm < p.semi_major_mm {
        findings.push(Finding::ToothBeyondCarrier {
            edge: Edge::Inner,
            center_radius_mm: innermost_mm,
            limit_mm: p.semi_major_mm,
        });
    }
    let outermost_mm = p.semi_major_mm + p.tooth_radius_mm;
    if outermost_mm > drive.tip_radius_mm() {
        findings.push(Finding::ToothBeyondCarrier {
            edge: Edge::Outer,
            center_radius_mm: outermost_mm,
            limit_mm: drive.tip_radius_mm(),
        });
    }
    let pressure_angle_deg = drive.steepest_engaged()?.tan_pressure_angle * flank.teeth_per_wave();
    let pressure_angle_deg = pressure_angle_deg.atan().to_degrees();
    if pressure_angle_deg > STEEP_FLANK_DEG {
        findings.push(Finding::SteepRingFlank { pressure_angle_deg });
    }
    Ok(findings)
}

/// That the wind-up of a sweep goes beyond what the model holds for.
pub fn of_wind_up(drive: &Drive, sweep: &Sweep) -> Option<Finding> {
    let wind_up_deg = sweep.input_angles.wind_up_deg.iter().copied().fold(0.0, f64::max);
    let limit_deg = WIND_UP_SHARE_OF_PERIOD * Mesh::new(drive).period_deg();
    (wind_up_deg > limit_deg).then_some(Finding::WindUpBeyondModel { wind_up_deg, limit_deg })
}

/// The findings about a drive's contacts under a load. `approaches_matter` where wind-up or clearance was asked for.
pub fn of_contacts(
    drive: &Drive,
    load: &LoadCase,
    peaks: &PerContact<ContactPeaks>,
    approaches_matter: bool,
) -> Vec<Finding> {
    let p = load.parameters();
    let width_mm = drive.parameters().tooth_width_mm;
    let mut findings = Vec::new();
    if p.law == ContactLaw::Linear && approaches_matter {
        let force_n = peaks.wave_generator.force_n.value;
        let approach_um = |law: ContactLaw| {
            let approach = law.approach(&p.materials, width_mm);
            1e3 * approach.coefficient.wave_generator * approach.power(force_n)
        };
        findings.push(Finding::LinearLawTooStiff {
            linear_um: approach_um(ContactLaw::Linear),
            palmgren_um: approach_um(ContactLaw::Palmgren),
        });
    }
    if p.law == ContactLaw::Palmgren {
        let steel = Materials { wave_generator: STEEL, teeth: STEEL, ring: STEEL, carrier: STEEL };
        let steel_mpa = steel.contact_modulus_mpa(Contact::Ring);
        for (contact, _) in peaks.iter() {
            let contact_mpa = p.materials.contact_modulus_mpa(contact);
            if (contact_mpa / steel_mpa - 1.0).abs() > STEEL_TOLERANCE {
                findings.push(Finding::PalmgrenBeyondSteel {
                    contact,
                    contact_modulus_gpa: 1e-3 * contact_mpa,
                    steel_gpa: 1e-3 * steel_mpa,
                });
            }
        }
    }
    let stressed = peaks.iter().filter(|(_, peaks)| peaks.stress_mpa.value > FATIGUE_LIMIT_STRESS_MPA);
    findings.extend(
        stressed
            .map(|(contact, peaks)| Finding::StressAboveFatigueLimit { contact, stress_mpa: peaks.stress_mpa.value }),
    );
    findings
}
