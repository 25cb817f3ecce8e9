//! Estimated compliance of the supports behind the contacts, from the parts' dimensions: values for
//! `series_compliance_mm_per_n` (docs/explanation/theory.md section 4.10). The designer decides what joins the fingers,
//! holds the rim and supports the cam.

use std::f64::consts::PI;

use crate::contact::{Contact, Material, Materials, Part, PerContact};
use crate::contact_law::ContactLaw;
use crate::drive::{Draft, Drive, ToothShape};
use crate::fingers::{CarrierFingers, FingerBeam, FingerParameters, Fingers};
use crate::gaps::MM_PER_UM;
use crate::load_sharing::LoadParameters;
use crate::parts::{CarrierPart, PartsParameters, RIM};
use crate::root::NotConverged;
use crate::sweep::ContactPeaks;

/// Support of the ring.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"))]
pub enum Rim {
    /// A rigid housing.
    #[default]
    Housed,
    /// No housing: only its rotation is blocked.
    Free,
}

/// Support of the parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Support {
    /// Support of the carrier's fingers.
    pub fingers: Fingers,
    /// Support of the ring's rim.
    pub rim: Rim,
}

/// Compliant part behind a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum Backing {
    /// The wave generator between its contacts and its bore.
    CamOnBore,
    /// The rim in its housing.
    HousedRim,
    /// The rim with no housing.
    FreeRim,
    /// A finger of the carrier held at both ends.
    FingerAtBothEnds,
    /// A finger of the carrier held at one end.
    FingerAtOneEnd,
    /// A finger of the carrier held at one end, its far end joined to the others by a ring.
    FingerJoinedAtFarEnd,
    /// A finger of the carrier held by a web in its middle.
    FingerOnWeb,
}

impl Backing {
    /// Returns the contact that this part is behind.
    pub const fn contact(self) -> Contact {
        match self {
            Self::CamOnBore => Contact::WaveGenerator,
            Self::HousedRim | Self::FreeRim => Contact::Ring,
            Self::FingerAtBothEnds | Self::FingerAtOneEnd | Self::FingerJoinedAtFarEnd | Self::FingerOnWeb => {
                Contact::Carrier
            }
        }
    }
}

/// Estimated compliance of a part behind a contact (docs/explanation/theory.md section 4.10).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = EstimateAnswer))]
pub struct Estimate {
    /// The contact.
    pub contact: Contact,
    /// Compliant part behind the contact.
    pub backing: Backing,
    /// Additional displacement of the contact per newton, beyond the depth that the contact's law includes.
    pub compliance_mm_per_n: f64,
    /// True if this support is the one in `parts`, or the default if `parts` does not specify it.
    pub is_as_held: bool,
    /// Share that it adds to the approach of a tooth at its three contacts, for cylinders with this support under
    /// `johnson`. Left out if the design gives a series compliance there.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub share: Option<f64>,
}

/// Ring rim beyond its tooth spaces, as a curved strip in plane strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RimStrip {
    /// Inner radius: the root of the tooth spaces.
    pub inner_radius_mm: f64,
    /// Outer radius.
    pub outer_radius_mm: f64,
    /// Width: that of the teeth.
    pub width_mm: f64,
    /// Number of teeth that load it from within, in all zones together.
    pub teeth: i64,
    /// Number of lobes.
    pub lobes: u32,
}

impl RimStrip {
    /// Returns the rim of the manufactured ring. Its flank modification is negligible here.
    fn of(drive: &Drive, parts: &PartsParameters) -> Self {
        let inner_radius_mm = drive.root_radius_mm() + MM_PER_UM * parts.ring_clearance_um;
        Self {
            inner_radius_mm,
            outer_radius_mm: parts.ring_outer_radius_mm.unwrap_or(RIM * inner_radius_mm),
            width_mm: drive.tooth_width_mm(),
            teeth: drive.parameters().installed,
            lobes: drive.lobes(),
        }
    }

    /// Returns the rim's compliance without a housing, per tooth force. If every contact has this compliance, the work
    /// equals that of the whole rim. Forces follow `sin Uψ` over the half of each lobe on which teeth carry.
    pub fn free_compliance_mm_per_n(&self, material: &Material) -> f64 {
        const SHEAR: f64 = 5.0 / 6.0;
        /// Each further harmonic of the load adds less than a thousandth of the first.
        const HARMONICS: u32 = 8;
        let Self { inner_radius_mm, outer_radius_mm, width_mm, teeth, lobes } = *self;
        let thickness_mm = outer_radius_mm - inner_radius_mm;
        let radius_mm = 0.5 * (outer_radius_mm + inner_radius_mm);
        let plate_mpa = 1.0 / material.compliance_per_mpa();
        let shear_mpa = 1e3 * material.youngs_modulus_gpa / (2.0 * (1.0 + material.poissons_ratio));
        let area_mm2 = thickness_mm * width_mm;
        let inertia_mm4 = area_mm2 * thickness_mm * thickness_mm / 12.0;
        // Half of each lobe's sine is 1/π + (sin Uψ)/2 - (2/π) Σ (cos 2nUψ)/(4n² - 1). The first term stretches the
        // strip.
        let first = (f64::from(lobes), 0.5);
        let others = (1..=HARMONICS).map(|n| {
            let twice = 2.0 * f64::from(n);
            (twice * f64::from(lobes), 2.0 / PI / (twice * twice - 1.0))
        });
        let bent = std::iter::once(first).chain(others).map(|(waves, share)| {
            let squared = waves * waves;
            // A single wave moves the whole ring, which is the load of its support.
            if squared <= 1.0 {
                return 0.0;
            }
            let bending = radius_mm * radius_mm / (plate_mpa * inertia_mm4);
            let stretching = 1.0 / (plate_mpa * area_mm2);
            let shear = squared / (SHEAR * shear_mpa * area_mm2);
            0.5 * share * share * (bending + stretching + shear) / ((squared - 1.0) * (squared - 1.0))
        });
        let stretched = 1.0 / (PI * PI * plate_mpa * area_mm2);
        // The mean square of that load is a quarter.
        4.0 * (bent.sum::<f64>() + stretched) * radius_mm * teeth as f64 / (2.0 * PI)
    }
}

/// Body with a fixed back that is loaded by neighbouring teeth: a rim in its housing, a cam on its bore.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldStrip {
    /// Depth behind the contacts at which it is held.
    pub depth_mm: f64,
    /// Distance of neighbouring teeth along its surface.
    pub pitch_mm: f64,
    /// Width: that of the teeth.
    pub width_mm: f64,
}

impl HeldStrip {
    /// Returns its compliance beyond the depth that a contact's law includes; negative if it is held nearer than that.
    pub fn compliance_mm_per_n(&self, material: &Material, counted_depth_mm: f64) -> f64 {
        let Self { depth_mm, pitch_mm, width_mm } = *self;
        let nu = material.poissons_ratio;
        let of_material = material.compliance_per_mpa() / (PI * width_mm);
        // Even pressures one pitch apart: each has its own displacement nearby. From half a pitch on, the strip
        // shortens as a whole, without lateral strain. In a strip thinner than half a pitch, neighbours have no effect.
        let even_mm = depth_mm.max(0.5 * pitch_mm);
        let nearer = 2.0 * (depth_mm / even_mm).ln();
        let near = 2.0 * (pitch_mm / (2.0 * PI * counted_depth_mm)).ln() + 1.0 + nu / (1.0 - nu);
        let shortening = PI * (1.0 - 2.0 * nu) / ((1.0 - nu) * (1.0 - nu)) * even_mm / pitch_mm;
        of_material * (nearer + near + shortening)
    }
}

/// Compliant parts of a drive, as far as they can be manufactured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backings {
    /// The fingers of the carrier, if it has any.
    pub finger: Option<FingerBeam>,
    rim: Option<RimStrip>,
    housed: Option<HeldStrip>,
    cam: Option<HeldStrip>,
    /// Support of the parts.
    pub support: Support,
}

impl Backings {
    /// Returns the compliant parts as manufactured and supported. Only cylinders, with or without flats, load their
    /// parts along a line.
    ///
    /// ```
    /// use toothwave_solver::backing::{Backings, Rim, Support};
    /// use toothwave_solver::drive::Draft;
    /// use toothwave_solver::parts::PartsParameters;
    /// use toothwave_solver::{DriveParameters, LoadParameters};
    ///
    /// let draft = Draft::new(&DriveParameters::default()).unwrap();
    /// let drive = draft.drive().unwrap();
    /// let support = Support { rim: Rim::Free, ..Support::default() };
    /// let backings = Backings::of(&drive, &draft, &PartsParameters::default(), support);
    /// let mut load = LoadParameters::default();
    /// load.series_compliance_mm_per_n = backings.series_compliance_mm_per_n(&drive, &load);
    /// ```
    pub fn of(drive: &Drive, draft: &Draft, parts: &PartsParameters, support: Support) -> Self {
        let mut backings = Self { finger: None, rim: None, housed: None, cam: None, support };
        if matches!(drive.parameters().tooth, ToothShape::Ball { .. }) {
            return backings;
        }
        let is_possible = |part| parts.violations(part, draft).is_empty();
        if is_possible(Part::Carrier) {
            backings.finger = FingerBeam::of(drive, &CarrierPart::new(drive, parts));
        }
        let strip = |radius_mm: f64, depth_mm: f64| HeldStrip {
            depth_mm,
            pitch_mm: 2.0 * PI * radius_mm / drive.parameters().installed as f64,
            width_mm: drive.tooth_width_mm(),
        };
        if is_possible(Part::Ring) {
            let rim = RimStrip::of(drive, parts);
            backings.housed = Some(strip(rim.inner_radius_mm, rim.outer_radius_mm - rim.inner_radius_mm));
            backings.rim = Some(rim);
        }
        if let Some(bore_mm) = parts.bore_radius_mm.filter(|_| is_possible(Part::WaveGenerator)) {
            let mean_mm = 0.5 * (drive.cam_outer_radius_mm() + drive.flank().locus().cam_inner_radius_mm());
            backings.cam = Some(strip(mean_mm, mean_mm - bore_mm));
        }
        backings
    }

    /// Returns the largest load per length along a tooth over its mean, 1 without fingers.
    ///
    /// # Errors
    /// [`NotConverged`] from the geometry.
    pub fn load_peak_over_mean(&self, drive: &Drive, p: &LoadParameters) -> Result<f64, NotConverged> {
        let Some(beam) = self.finger else { return Ok(1.0) };
        let parameters = FingerParameters { fingers: self.support.fingers, ..FingerParameters::default() };
        Ok(CarrierFingers::new(drive, beam, parameters, p)?.load_peak_over_mean())
    }

    /// Returns the estimates, without shares. The deflection within the depth that a contact's law includes belongs to
    /// the law.
    pub fn estimates(&self, drive: &Drive, p: &LoadParameters) -> Vec<Estimate> {
        let counted_mm = |contact| counted_depth_mm(drive, &p.law, contact);
        let held = |strip: Option<HeldStrip>, contact: Contact| {
            strip.map(|strip| strip.compliance_mm_per_n(p.materials.partner(contact), counted_mm(contact)).max(0.0))
        };
        let Support { fingers, rim } = self.support;
        let finger = |backing: Backing, support: Fingers| {
            let compliance = self.finger.map(|finger| finger.compliance_mm_per_n(&p.materials.carrier, support));
            (backing, fingers == support, compliance)
        };
        let free = self.rim.map(|rim| rim.free_compliance_mm_per_n(&p.materials.ring));
        [
            (Backing::CamOnBore, true, held(self.cam, Contact::WaveGenerator)),
            (Backing::HousedRim, rim == Rim::Housed, held(self.housed, Contact::Ring)),
            (Backing::FreeRim, rim == Rim::Free, free),
            finger(Backing::FingerAtBothEnds, Fingers::HeldAtBothEnds),
            finger(Backing::FingerAtOneEnd, Fingers::HeldAtOneEnd),
            finger(Backing::FingerJoinedAtFarEnd, Fingers::FarEndsJoined),
            finger(Backing::FingerOnWeb, Fingers::WebInTheMiddle),
        ]
        .into_iter()
        .filter_map(|(backing, is_as_held, compliance)| {
            // A wall of nearly zero thickness has infinite compliance.
            let compliance_mm_per_n = compliance.filter(|compliance| compliance.is_finite())?;
            Some(Estimate { contact: backing.contact(), backing, compliance_mm_per_n, is_as_held, share: None })
        })
        .collect()
    }

    /// Returns the estimates with their shares at the peaks of a load under the logarithmic law. None for teeth that are
    /// not cylinders, or under other laws, whose own error is as large. A contact with a given series compliance already
    /// includes its backing.
    pub fn estimates_with_shares(
        &self,
        drive: &Drive,
        p: &LoadParameters,
        peaks: &PerContact<ContactPeaks>,
    ) -> Option<Vec<Estimate>> {
        let is_line = matches!(drive.parameters().tooth, ToothShape::Cylinder { .. });
        if !is_line || p.law.depth_mm(drive.parameters().tooth_radius_mm).is_none() {
            return None;
        }
        let cam_force_n = peaks.wave_generator.force_n.value;
        let squared_ratio = PerContact::of(|contact| (peaks.get(contact).force_n.value / cam_force_n).powi(2));
        let own_mm_per_n: f64 = peaks
            .iter()
            .map(|(contact, peaks)| {
                let depth_mm = counted_depth_mm(drive, &p.law, contact);
                let own = line_compliance_mm_per_n(drive, &p.materials, contact, depth_mm, peaks.half_width_mm);
                squared_ratio.get(contact) * own
            })
            .sum();
        if !(own_mm_per_n.is_finite() && own_mm_per_n > 0.0) {
            return None;
        }
        let mut estimates = self.estimates(drive, p);
        for Estimate { contact, compliance_mm_per_n, is_as_held, share, .. } in &mut estimates {
            let is_given = *p.series_compliance_mm_per_n.get(*contact) > 0.0;
            if *is_as_held && !is_given {
                *share = Some(squared_ratio.get(*contact) * *compliance_mm_per_n / own_mm_per_n);
            }
        }
        Some(estimates)
    }

    /// Returns the estimates for the actual support as series compliance; zero where there is none.
    pub fn series_compliance_mm_per_n(&self, drive: &Drive, p: &LoadParameters) -> PerContact<f64> {
        let estimates = self.estimates(drive, p);
        PerContact::of(|contact| {
            let is_held = |estimate: &&Estimate| estimate.contact == contact && estimate.is_as_held;
            estimates.iter().find(is_held).map_or(0.0, |estimate| estimate.compliance_mm_per_n)
        })
    }
}

/// Returns the depth below a contact that its law includes in the approach: the law's own, otherwise the tooth's
/// radius.
fn counted_depth_mm(drive: &Drive, law: &ContactLaw, contact: Contact) -> f64 {
    let tooth_radius_mm = drive.parameters().tooth_radius_mm;
    law.depth_mm(tooth_radius_mm).map_or(tooth_radius_mm, |depth_mm| *depth_mm.get(contact))
}

/// Returns a contact's own approach divided by its force, by the logarithmic law (docs/explanation/theory.md section
/// 4.3).
fn line_compliance_mm_per_n(
    drive: &Drive,
    materials: &Materials,
    contact: Contact,
    depth_mm: f64,
    half_width_mm: f64,
) -> f64 {
    let mate = materials.partner(contact);
    let per_width = |material: &Material| material.compliance_per_mpa() / (PI * drive.tooth_width_mm());
    let of_tooth = 2.0 * (4.0 * drive.parameters().tooth_radius_mm / half_width_mm).ln() - 1.0;
    let of_mate = 2.0 * (2.0 * depth_mm / half_width_mm).ln() - mate.poissons_ratio / (1.0 - mate.poissons_ratio);
    per_width(&materials.teeth) * of_tooth + per_width(mate) * of_mate
}
