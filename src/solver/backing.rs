//! What gives way behind the contacts, estimated from the parts as they are made: numbers for `series_compliance_mm_per_n`
//! (docs/explanation/theory.md section 4.10). They are estimates: what joins the fingers, what holds the rim and what the cam sits on is the designer's.

use std::f64::consts::PI;

use crate::contact::{Contact, ContactLaw, Material, Materials, Part, PerContact};
use crate::drive::{Draft, Drive, ToothShape};
use crate::gaps::MM_PER_UM;
use crate::load_sharing::LoadCase;
use crate::parts::{CarrierPart, PartsParameters, RIM};
use crate::sweep::ContactPeaks;

/// What joins the fingers between the carrier's slots beside the teeth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fingers {
    /// A disc at one end.
    HeldAtOneEnd,
    /// A disc at either end.
    HeldAtBothEnds,
}

/// What stands around the ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rim {
    /// A rigid housing.
    Housed,
    /// Nothing: it is kept from turning alone.
    Free,
}

/// How the parts are held, as far as the designer says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Support {
    /// The carrier's fingers.
    pub fingers: Option<Fingers>,
    /// The ring's rim.
    pub rim: Option<Rim>,
}

/// What gives way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backing {
    /// The wave generator between its contacts and its bore.
    CamOnBore,
    /// The rim in its housing.
    HousedRim,
    /// The rim with nothing around it.
    FreeRim,
    /// A finger of the carrier held at both ends.
    FingerAtBothEnds,
    /// A finger of the carrier held at one end.
    FingerAtOneEnd,
}

impl Backing {
    /// The contact that it stands behind.
    pub const fn contact(self) -> Contact {
        match self {
            Self::CamOnBore => Contact::WaveGenerator,
            Self::HousedRim | Self::FreeRim => Contact::Ring,
            Self::FingerAtBothEnds | Self::FingerAtOneEnd => Contact::Carrier,
        }
    }

    /// Whether a part that is held so has it: where nothing is said, the stiffer of two.
    pub const fn is_of(self, support: &Support) -> bool {
        match self {
            Self::CamOnBore => true,
            Self::HousedRim => !matches!(support.rim, Some(Rim::Free)),
            Self::FreeRim => matches!(support.rim, Some(Rim::Free)),
            Self::FingerAtBothEnds => !matches!(support.fingers, Some(Fingers::HeldAtOneEnd)),
            Self::FingerAtOneEnd => matches!(support.fingers, Some(Fingers::HeldAtOneEnd)),
        }
    }
}

/// An estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Of what.
    pub backing: Backing,
    /// How far the contact gives way besides, for each newton there; beyond the depth that the contact's law counts to.
    pub compliance_mm_per_n: f64,
}

/// A finger between two slots as a straight beam along the axis, pressed evenly along one wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerBeam {
    /// Its length, the teeth's width.
    pub length_mm: f64,
    /// Its thickness across the slots, in the middle of its height.
    pub thickness_mm: f64,
    /// Its height along the radius.
    pub height_mm: f64,
}

impl FingerBeam {
    /// Of a carrier; none where its slots run into each other in the middle of its height.
    fn of(drive: &Drive, carrier: &CarrierPart) -> Option<Self> {
        let CarrierPart { inner_radius_mm, outer_radius_mm, slot_half_width_mm } = carrier;
        let middle_mm = 0.5 * (inner_radius_mm + outer_radius_mm);
        let half_spacing_rad = PI / drive.parameters().installed as f64;
        let thickness_mm = 2.0 * (middle_mm * half_spacing_rad.sin() - slot_half_width_mm);
        let (length_mm, height_mm) = (drive.tooth_width_mm(), outer_radius_mm - inner_radius_mm);
        (thickness_mm > 0.0).then_some(Self { length_mm, thickness_mm, height_mm })
    }

    /// Mean deflection along the finger over the force: what a straight tooth on its wall moves by. Bending and shear after Timoshenko, with the
    /// shear coefficient 5/6 of a rectangle.
    pub fn compliance_mm_per_n(&self, material: &Material, fingers: Fingers) -> f64 {
        const SHEAR: f64 = 5.0 / 6.0;
        let Self { length_mm, thickness_mm, height_mm } = *self;
        let youngs_mpa = 1e3 * material.youngs_modulus_gpa;
        let shear_mpa = youngs_mpa / (2.0 * (1.0 + material.poissons_ratio));
        let area_mm2 = thickness_mm * height_mm;
        let inertia_mm4 = area_mm2 * thickness_mm * thickness_mm / 12.0;
        // The mean of the deflection under an even load: F L³/(20 E I) and F L/(3 κ G A), and between two discs F L³/(720 E I) and F L/(12 κ G A).
        let (bending, shear) = match fingers {
            Fingers::HeldAtOneEnd => (20.0, 3.0),
            Fingers::HeldAtBothEnds => (720.0, 12.0),
        };
        length_mm.powi(3) / (bending * youngs_mpa * inertia_mm4) + length_mm / (shear * SHEAR * shear_mpa * area_mm2)
    }
}

/// The ring's rim beyond its tooth spaces as a curved strip, in plane strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RimStrip {
    /// Where it begins, at the root of the tooth spaces.
    pub inner_radius_mm: f64,
    /// Where it ends.
    pub outer_radius_mm: f64,
    /// Its width, that of the teeth.
    pub width_mm: f64,
    /// Teeth that press it from within, all zones together.
    pub teeth: i64,
    /// Lobes that they are pressed by.
    pub lobes: u32,
}

impl RimStrip {
    /// Of the ring as it is made; its flanks' modification is of no weight here.
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

    /// What the rim gives way where nothing holds it, over the force of a tooth: that compliance of each contact which does the work of the whole,
    /// under forces that go as `sin Uψ` over the half of each lobe on which teeth carry.
    pub fn free_compliance_mm_per_n(&self, material: &Material) -> f64 {
        const SHEAR: f64 = 5.0 / 6.0;
        /// Further harmonics of the load bend the strip by less than a thousandth of the first.
        const HARMONICS: u32 = 8;
        let Self { inner_radius_mm, outer_radius_mm, width_mm, teeth, lobes } = *self;
        let thickness_mm = outer_radius_mm - inner_radius_mm;
        let radius_mm = 0.5 * (outer_radius_mm + inner_radius_mm);
        let plate_mpa = 1.0 / material.compliance_per_mpa();
        let shear_mpa = 1e3 * material.youngs_modulus_gpa / (2.0 * (1.0 + material.poissons_ratio));
        let area_mm2 = thickness_mm * width_mm;
        let inertia_mm4 = area_mm2 * thickness_mm * thickness_mm / 12.0;
        // Half of each lobe's sine is 1/π + (sin Uψ)/2 - (2/π) Σ (cos 2nUψ)/(4n² - 1); the first term stretches the strip.
        let first = (f64::from(lobes), 0.5);
        let others = (1..=HARMONICS).map(|n| {
            let twice = 2.0 * f64::from(n);
            (twice * f64::from(lobes), 2.0 / PI / (twice * twice - 1.0))
        });
        let bent = std::iter::once(first).chain(others).map(|(waves, share)| {
            let squared = waves * waves;
            // One wave pushes the ring aside, which what keeps it in its place takes.
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

/// A body that stands still at its back and is pressed by teeth one beside the other: a rim in its housing, a cam on its bore.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldStrip {
    /// How far behind the contacts it is held.
    pub depth_mm: f64,
    /// Distance of neighbouring teeth along its surface.
    pub pitch_mm: f64,
    /// Its width, that of the teeth.
    pub width_mm: f64,
}

impl HeldStrip {
    /// What it gives way beyond the depth that a contact's law counts to; less than nothing where it is held nearer than that.
    pub fn compliance_mm_per_n(&self, material: &Material, counted_depth_mm: f64) -> f64 {
        let Self { depth_mm, pitch_mm, width_mm } = *self;
        let nu = material.poissons_ratio;
        let of_material = material.compliance_per_mpa() / (PI * width_mm);
        // Even pressures a pitch apart: near each its own displacement, from half a pitch on the strip shortens as a whole, without giving way
        // sideways. A strip that is thinner than half a pitch knows nothing of the neighbours.
        let even_mm = depth_mm.max(0.5 * pitch_mm);
        let nearer = 2.0 * (depth_mm / even_mm).ln();
        let near = 2.0 * (pitch_mm / (2.0 * PI * counted_depth_mm)).ln() + 1.0 + nu / (1.0 - nu);
        let shortening = PI * (1.0 - 2.0 * nu) / ((1.0 - nu) * (1.0 - nu)) * even_mm / pitch_mm;
        of_material * (nearer + near + shortening)
    }
}

/// The parts of a drive as far as they can be made, with what gives way in each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backings {
    finger: Option<FingerBeam>,
    rim: Option<RimStrip>,
    housed: Option<HeldStrip>,
    cam: Option<HeldStrip>,
    support: Support,
}

impl Backings {
    /// Of the parts as they are made and held. Only cylinders, whole or with flats, press their parts along a line.
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

    /// How the parts are held.
    pub const fn support(&self) -> &Support {
        &self.support
    }

    /// The estimates; what a body gives way within the depth that its law counts to stands in the law.
    pub fn estimates(&self, drive: &Drive, load: &LoadCase) -> Vec<Estimate> {
        let p = load.parameters();
        let counted_mm = |contact| counted_depth_mm(drive, &p.law, contact);
        let held = |strip: Option<HeldStrip>, contact: Contact| {
            strip.map(|strip| strip.compliance_mm_per_n(p.materials.partner(contact), counted_mm(contact)).max(0.0))
        };
        let finger = |fingers| self.finger.map(|finger| finger.compliance_mm_per_n(&p.materials.carrier, fingers));
        let free = self.rim.map(|rim| rim.free_compliance_mm_per_n(&p.materials.ring));
        [
            (Backing::CamOnBore, held(self.cam, Contact::WaveGenerator)),
            (Backing::HousedRim, held(self.housed, Contact::Ring)),
            (Backing::FreeRim, free),
            (Backing::FingerAtBothEnds, finger(Fingers::HeldAtBothEnds)),
            (Backing::FingerAtOneEnd, finger(Fingers::HeldAtOneEnd)),
        ]
        .into_iter()
        // A wall of next to nothing gives way without end.
        .filter_map(|(backing, compliance)| Some((backing, compliance.filter(|compliance| compliance.is_finite())?)))
        .map(|(backing, compliance_mm_per_n)| Estimate { backing, compliance_mm_per_n })
        .collect()
    }
}

/// The depth below a contact that its law counts the approach to: Johnson's own, elsewhere the tooth's radius.
fn counted_depth_mm(drive: &Drive, law: &ContactLaw, contact: Contact) -> f64 {
    let of_law = match law {
        ContactLaw::Johnson { depth_mm } => *depth_mm.get(contact),
        ContactLaw::Linear | ContactLaw::Fixed(_) | ContactLaw::Palmgren | ContactLaw::Hertz => None,
    };
    of_law.unwrap_or(drive.parameters().tooth_radius_mm)
}

/// What the estimates come to beside the contacts themselves, where these are lines under a law of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// Those that the drive has as its parts are held, with the share of a tooth's approach at its own contacts that each adds to it.
    pub shares: Vec<(Estimate, f64)>,
}

impl Shares {
    /// At the peaks of a load under the logarithmic law; none of other teeth than cylinders, nor under other laws, whose own error is as large. A contact that
    /// is given a series compliance has its backing in it.
    pub fn of(drive: &Drive, load: &LoadCase, backings: &Backings, peaks: &PerContact<ContactPeaks>) -> Option<Self> {
        let p = load.parameters();
        let is_line = matches!(drive.parameters().tooth, ToothShape::Cylinder { .. });
        if !is_line || !matches!(p.law, ContactLaw::Johnson { .. }) {
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
        let shares = backings
            .estimates(drive, load)
            .into_iter()
            .filter(|estimate| {
                let is_given = *p.series_compliance_mm_per_n.get(estimate.backing.contact()) > 0.0;
                !is_given && estimate.backing.is_of(&backings.support)
            })
            .map(|estimate| {
                let ratio = squared_ratio.get(estimate.backing.contact());
                (estimate, ratio * estimate.compliance_mm_per_n / own_mm_per_n)
            })
            .collect();
        Some(Self { shares })
    }

    /// How far the wind-up is off for want of all of them: `1/(1 + Σ) - 1`.
    pub fn wind_up_error(&self) -> f64 {
        let sum: f64 = self.shares.iter().map(|(_, share)| share).sum();
        -sum / (1.0 + sum)
    }
}

/// A contact's own approach over its force, by the logarithmic law (docs/explanation/theory.md section 4.3).
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
