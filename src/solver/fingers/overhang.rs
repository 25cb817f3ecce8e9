//! Load along a finger that is held at one end (docs/explanation/theory.md section 4.12). The far end bends away, so the
//! tooth presses most at the foot: a beam on an elastic foundation.

use std::f64::consts::PI;

use crate::contact::{Contact, Material, PerContact};
use crate::drive::{Drive, ToothShape};
use crate::fingers::beam::{FingerBeam, Fingers};
use crate::load_sharing::{LoadParameters, curvature_per_mm, force_ratio};
use crate::root::NotConverged;
use crate::tooth::flat::FlatContact;

/// Contact modulus over the contact pressure at which contacts have the width that a slice's compliance is computed
/// with: 1000 MPa in steel. Widths enter by their logarithm.
const MODULUS_OVER_PRESSURE: f64 = 115.0;

/// Beyond this length over Winkler's length the hyperbolic functions differ from their limits by less than rounding.
const LONG: f64 = 20.0;

/// Load along a finger that is held at one end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overhang {
    /// κ: load per length at the foot over its mean.
    pub peak_over_mean: f64,
    /// m: moment at the foot over force times length; 1/2 under an even load.
    pub moment_over_force_length: f64,
}

impl Overhang {
    /// Returns the load along a beam by its length over Winkler's, `x = L (4 E I c)^(-1/4)` (Winkler 1867; Hetényi,
    /// *Beams on Elastic Foundation*, 1946).
    pub fn of_relative_length(x: f64) -> Self {
        if x > LONG {
            return Self { peak_over_mean: x, moment_over_force_length: 0.5 / x };
        }
        let (sin, cos) = (2.0 * x).sin_cos();
        let (sinh, cosh) = ((2.0 * x).sinh(), (2.0 * x).cosh());
        // cosh 2x - cos 2x, without a difference of nearly equal numbers.
        let difference = 2.0 * (x.sinh().powi(2) + x.sin().powi(2));
        Self {
            peak_over_mean: x * (cosh + cos + 2.0) / (sinh + sin),
            moment_over_force_length: difference / (2.0 * x * (sinh + sin)),
        }
    }

    /// Returns the load along a finger with this mean deflection per force, on slices of teeth with this compliance.
    pub fn of_beam(beam: &FingerBeam, material: &Material, slice_mm2_per_n: f64) -> Self {
        let compliance_mm_per_n = beam.compliance_mm_per_n(material, Fingers::HeldAtOneEnd);
        let bending_nmm2 = beam.length_mm.powi(3) / (20.0 * compliance_mm_per_n);
        Self::of_relative_length(beam.length_mm * (4.0 * bending_nmm2 * slice_mm2_per_n).powf(-0.25))
    }
}

/// Returns the compliance of a slice of a tooth along the force on its slot's wall, `Σ f_c² C_c L1/f_S²`, where that
/// force is largest beside the others. C is the tangent of Johnson's law, since only changes of the load count.
///
/// # Errors
/// [`NotConverged`] from the geometry.
pub fn slice_compliance_mm2_per_n(drive: &Drive, p: &LoadParameters) -> Result<f64, NotConverged> {
    let center = drive.ring_tooth().steepest_engaged()?;
    let flank = drive.flank().at(&center);
    let ratio = force_ratio(drive.sense(), drive.flank(), &center);
    let curvatures = curvature_per_mm(drive, &center, &flank);
    let of_contact = PerContact::of(|contact| contact_slice_mm2_per_n(drive, p, contact, *curvatures.get(contact)));
    let sum: f64 = ratio.iter().map(|(contact, ratio)| ratio * ratio * of_contact.get(contact)).sum();
    Ok(sum / (ratio.carrier * ratio.carrier))
}

/// Returns the compliance of a contact for each unit of load per length.
fn contact_slice_mm2_per_n(drive: &Drive, p: &LoadParameters, contact: Contact, curvature_per_mm: f64) -> f64 {
    let width_mm = drive.tooth_width_mm();
    if let (ToothShape::FlatSided { flat_length_mm, .. }, Contact::Carrier) = (drive.parameters().tooth, contact) {
        let modulus_mpa = p.materials.contact_modulus_mpa(contact);
        let flat = FlatContact { length_mm: flat_length_mm, width_mm };
        return width_mm * flat.compliance_mm_per_n(modulus_mpa);
    }
    let radius_mm = drive.parameters().tooth_radius_mm;
    let depth_mm = p.law.depth_mm(radius_mm).map_or(radius_mm, |depth_mm| *depth_mm.get(contact));
    let mate = p.materials.partner(contact);
    let [of_tooth, of_mate] = [&p.materials.teeth, mate].map(|body| body.compliance_per_mpa() / PI);
    let half_width_mm = 2.0 / (MODULUS_OVER_PRESSURE * curvature_per_mm);
    let nu = mate.poissons_ratio;
    let tooth = 2.0 * (4.0 * radius_mm / half_width_mm).ln() - 2.0;
    // A mate that is held as near as the contact is wide gives way as little as its tooth's slope there.
    let mate = (2.0 * (2.0 * depth_mm / half_width_mm).ln() - nu / (1.0 - nu) - 1.0).max(0.0);
    of_tooth * tooth + of_mate * mate
}
