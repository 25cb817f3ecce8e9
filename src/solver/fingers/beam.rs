//! A finger as a straight beam: compliance and moment at its foot (docs/explanation/theory.md sections 4.10 and 4.12).

use std::f64::consts::PI;

use crate::contact::Material;
use crate::drive::Drive;
use crate::parts::CarrierPart;

/// Support of the fingers between the carrier's slots, axially outside the teeth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"))]
pub enum Fingers {
    /// A disc at one end.
    HeldAtOneEnd,
    /// A disc at each end, both of which pass on the torque.
    HeldAtBothEnds,
    /// A disc at one end, and a ring that joins the far ends and passes on no torque: the usual cage.
    #[default]
    FarEndsJoined,
    /// A web in the middle.
    WebInTheMiddle,
}

/// Rotation of a finger's foot in a disc as thick as the finger, for `M/(E' t² h)`. Measured by finite elements, ± 0.6.
pub const FOOT_IN_DISC: f64 = 3.5;

/// Shear coefficient of a rectangle.
const SHEAR: f64 = 5.0 / 6.0;

/// `(ΣF)²/(Z ΣF²)` of forces that follow `sin Uψ` over half of each lobe.
const SQUARED_MEAN_OVER_MEAN_SQUARE: f64 = 4.0 / (PI * PI);

/// Finger between two slots as a straight beam along the axis, with an even load along one wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerBeam {
    /// Length: the teeth's width.
    pub length_mm: f64,
    /// Thickness across the slots, at the middle of the height.
    pub thickness_mm: f64,
    /// Height along the radius.
    pub height_mm: f64,
    /// Number of fingers.
    pub count: i64,
    /// Rotation of the foot for `M/(E' t² h)`: [`FOOT_IN_DISC`], or 0 in a rigid disc.
    pub foot: f64,
}

impl FingerBeam {
    /// Returns the finger of a carrier. None if its slots overlap at the middle of its height.
    pub(crate) fn of(drive: &Drive, carrier: &CarrierPart) -> Option<Self> {
        let CarrierPart { inner_radius_mm, outer_radius_mm, slot_half_width_mm } = carrier;
        let middle_mm = 0.5 * (inner_radius_mm + outer_radius_mm);
        let count = drive.parameters().installed;
        let thickness_mm = 2.0 * (middle_mm * (PI / count as f64).sin() - slot_half_width_mm);
        let (length_mm, height_mm) = (drive.tooth_width_mm(), outer_radius_mm - inner_radius_mm);
        (thickness_mm > 0.0).then_some(Self { length_mm, thickness_mm, height_mm, count, foot: FOOT_IN_DISC })
    }

    /// Returns the angle of a slot's wall against the middle of the finger, δ.
    pub(crate) fn wall_angle_rad(&self) -> f64 {
        PI / self.count as f64
    }

    /// Returns the mean deflection along the finger divided by the force, which is the displacement of a straight tooth
    /// on its wall. Bending and shear follow Timoshenko. A ring at the far ends moves with the mean force of all teeth;
    /// the compliance is that of springs that do the same work.
    pub fn compliance_mm_per_n(&self, material: &Material, fingers: Fingers) -> f64 {
        let Self { length_mm, thickness_mm, height_mm, count: _, foot } = *self;
        let (squared, cubed) = (length_mm.powi(2), length_mm.powi(3));
        let youngs_mpa = 1e3 * material.youngs_modulus_gpa;
        let shear_mpa = youngs_mpa / (2.0 * (1.0 + material.poissons_ratio));
        let area_mm2 = thickness_mm * height_mm;
        // The wall is not square to the finger, so its force bends the finger along the radius too.
        let (sin, cos) = self.wall_angle_rad().sin_cos();
        let slenderness = thickness_mm / height_mm;
        let both_ways = cos * cos + slenderness * slenderness * sin * sin;
        // `E I`, lower by the radial part of the bending.
        let bending_nmm2 = youngs_mpa * area_mm2 * thickness_mm * thickness_mm / 12.0 / both_ways;
        // Rotation of the foot for each unit of moment.
        let foot_per_nmm = foot * material.compliance_per_mpa() / (thickness_mm * thickness_mm * height_mm);
        // `κ G A`.
        let shear_n = SHEAR * shear_mpa * area_mm2;
        match fingers {
            Fingers::HeldAtOneEnd => {
                cubed / (20.0 * bending_nmm2) + foot_per_nmm * squared / 4.0 + length_mm / (3.0 * shear_n)
            }
            Fingers::HeldAtBothEnds => {
                // The moment of a foot is F L/12 in rigid discs and less in elastic ones.
                let moment_mm = length_mm / 12.0 / (1.0 + 2.0 * bending_nmm2 * foot_per_nmm / length_mm);
                cubed / (120.0 * bending_nmm2) - moment_mm * squared / (12.0 * bending_nmm2)
                    + length_mm / (12.0 * shear_n)
            }
            Fingers::FarEndsJoined => {
                let sway = cubed / (48.0 * bending_nmm2) + foot_per_nmm * squared / 8.0 + length_mm / (4.0 * shear_n);
                self.compliance_mm_per_n(material, Fingers::HeldAtBothEnds) + SQUARED_MEAN_OVER_MEAN_SQUARE * sway
            }
            Fingers::WebInTheMiddle => 0.5 * self.half().compliance_mm_per_n(material, Fingers::HeldAtOneEnd),
        }
    }

    /// Returns the finger on one side of a web in the middle.
    pub(crate) fn half(&self) -> Self {
        Self { length_mm: 0.5 * self.length_mm, ..*self }
    }
}
