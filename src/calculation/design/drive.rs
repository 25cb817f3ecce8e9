//! Wave generator, teeth and ring, with one object for each kind and shape.

use serde::{Deserialize, Serialize};
use toothwave_solver::{PerContact, ToothShape, WaveGenerator};
use utoipa::ToSchema;

use super::number::Whole;
use crate::union;

/// Wave generator, teeth and ring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DriveDocument {
    /// Wave generator, which pushes the teeth outward.
    pub wave_generator: WaveGeneratorDocument,
    /// The discrete teeth.
    pub teeth: TeethDocument,
    /// The rigid internal gear.
    pub ring: RingDocument,
}

union! {
    /// Cam with one or more lobes, which pushes the teeth outward. Default kind: ellipse.
    #[schema(as = WaveGenerator)]
    pub enum WaveGeneratorDocument by "kind" read "by:kind=ellipse" {
        /// An ellipse.
        Ellipse(EllipseDocument),
        /// A circle that rotates about a point off its centre.
        Eccentric(EccentricDocument),
        /// A support function with one harmonic.
        Harmonic(HarmonicDocument),
        /// A path of the tooth centres with one harmonic.
        HarmonicPath(HarmonicPathDocument),
    }
}

/// Elliptic cam with two lobes; `semi_major_mm` must exceed `semi_minor_mm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct EllipseDocument {
    /// Semi-major axis a, in mm.
    pub semi_major_mm: f64,
    /// Semi-minor axis b, in mm.
    pub semi_minor_mm: f64,
}

/// Circle that rotates about a point off its centre, one lobe; `eccentricity_mm` must be below `radius_mm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct EccentricDocument {
    /// Radius R0 of the circle, in mm.
    pub radius_mm: f64,
    /// Distance e of its centre from the axis, in mm.
    pub eccentricity_mm: f64,
}

/// Cam with the support function R0 + e cos Uφ, which is the distance of its tangents from the axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct HarmonicDocument {
    /// Lobes U: teeth pass as many meshing zones in a turn. With one the cam is an `eccentric`.
    #[schema(value_type = i64, minimum = 2)]
    pub lobes: Whole,
    /// Mean radius R0, in mm.
    pub mean_radius_mm: f64,
    /// Amplitude e, in mm.
    pub amplitude_mm: f64,
}

/// Cam that moves the tooth centres along R + e cos Uψ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct HarmonicPathDocument {
    /// Number of lobes U, and of meshing zones.
    #[schema(value_type = i64)]
    pub lobes: Whole,
    /// Mean radius R of the path, in mm.
    pub mean_path_radius_mm: f64,
    /// Amplitude e, in mm.
    pub amplitude_mm: f64,
}

union! {
    /// The discrete teeth. Default shape: cylinder.
    #[schema(as = Teeth)]
    pub enum TeethDocument by "shape" read "by:shape=cylinder" {
        /// Cylinders along the axis.
        Cylinder(CylinderDocument),
        /// Balls.
        Ball(BallDocument),
        /// Cylinders with two flats.
        FlatSided(FlatSidedDocument),
    }
}

/// Cylinders along the axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct CylinderDocument {
    /// Theoretical number of teeth Z_G. It differs from the ring's by the number of lobes of the wave generator.
    #[schema(value_type = i64)]
    pub count: Whole,
    /// Number of installed teeth Z'_G, a divisor of `count`. Only installed teeth have a slot. Default: `count`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, required = false)]
    pub installed: Option<Whole>,
    /// Radius r of a tooth, in mm.
    pub radius_mm: f64,
    /// Width L1 of a tooth along the axis, in mm.
    pub width_mm: f64,
}

/// Balls, which can run in grooves along the path of the contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct BallDocument {
    /// Theoretical number of teeth Z_G. It differs from the ring's by the number of lobes of the wave generator.
    #[schema(value_type = i64)]
    pub count: Whole,
    /// Number of installed teeth Z'_G, a divisor of `count`. Only installed teeth have a slot. Default: `count`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, required = false)]
    pub installed: Option<Whole>,
    /// Radius r of a ball, in mm.
    pub radius_mm: f64,
    /// Radii of the grooves across the path, in mm, each larger than the ball's radius. Default: no groove; the part is
    /// straight along the axis.
    #[serde(default)]
    pub groove_radius_mm: LengthsByContactDocument,
}

/// Cylinders with two flats on the walls of the slot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct FlatSidedDocument {
    /// Theoretical number of teeth Z_G. It differs from the ring's by the number of lobes of the wave generator.
    #[schema(value_type = i64)]
    pub count: Whole,
    /// Number of installed teeth Z'_G, a divisor of `count`. Only installed teeth have a slot. Default: `count`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, required = false)]
    pub installed: Option<Whole>,
    /// Radius r of a tooth, in mm.
    pub radius_mm: f64,
    /// Width L1 of a tooth along the axis, in mm.
    pub width_mm: f64,
    /// Length l of a flat along the slot, in mm. It must be below the tooth's diameter.
    pub flat_length_mm: f64,
}

/// Length for each contact, in mm; each can be left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct LengthsByContactDocument {
    /// At the wave generator, in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wave_generator: Option<f64>,
    /// At the ring, in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ring: Option<f64>,
    /// At the carrier, in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub carrier: Option<f64>,
}

/// Data common to teeth of any shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Counted {
    pub(super) count: Whole,
    /// Number of installed teeth, as in the document.
    pub(super) installed: Option<Whole>,
    pub(super) radius_mm: f64,
}

impl WaveGeneratorDocument {
    /// Returns the number of lobes, if it is given.
    pub(super) const fn lobes(&self) -> Option<Whole> {
        match *self {
            Self::Ellipse(_) | Self::Eccentric(_) => None,
            Self::Harmonic(HarmonicDocument { lobes, .. }) | Self::HarmonicPath(HarmonicPathDocument { lobes, .. }) => {
                Some(lobes)
            }
        }
    }
}

impl From<&WaveGeneratorDocument> for WaveGenerator {
    fn from(document: &WaveGeneratorDocument) -> Self {
        match *document {
            WaveGeneratorDocument::Ellipse(EllipseDocument { semi_major_mm, semi_minor_mm }) => {
                Self::Ellipse { semi_major_mm, semi_minor_mm }
            }
            WaveGeneratorDocument::Eccentric(EccentricDocument { radius_mm, eccentricity_mm }) => {
                Self::Eccentric { radius_mm, eccentricity_mm }
            }
            WaveGeneratorDocument::Harmonic(HarmonicDocument { lobes, mean_radius_mm, amplitude_mm }) => {
                Self::Harmonic { lobes: lobes.count(), mean_radius_mm, amplitude_mm }
            }
            WaveGeneratorDocument::HarmonicPath(HarmonicPathDocument { lobes, mean_path_radius_mm, amplitude_mm }) => {
                Self::HarmonicPath { lobes: lobes.count(), mean_path_radius_mm, amplitude_mm }
            }
        }
    }
}

impl From<&TeethDocument> for ToothShape {
    fn from(document: &TeethDocument) -> Self {
        match document {
            TeethDocument::Cylinder(teeth) => Self::Cylinder { width_mm: teeth.width_mm },
            TeethDocument::Ball(teeth) => Self::Ball { groove_radius_mm: teeth.groove_radius_mm.by_contact() },
            TeethDocument::FlatSided(teeth) => {
                Self::FlatSided { width_mm: teeth.width_mm, flat_length_mm: teeth.flat_length_mm }
            }
        }
    }
}

impl LengthsByContactDocument {
    pub(super) const fn by_contact(&self) -> PerContact<Option<f64>> {
        let Self { wave_generator, ring, carrier } = *self;
        PerContact { wave_generator, ring, carrier }
    }
}

impl TeethDocument {
    /// Sets `installed` to its default if it is left out.
    pub(super) fn install_all_by_default(&mut self) {
        let count = self.counted().count;
        let (Self::Cylinder(CylinderDocument { installed, .. })
        | Self::Ball(BallDocument { installed, .. })
        | Self::FlatSided(FlatSidedDocument { installed, .. })) = self;
        installed.get_or_insert(count);
    }

    pub(super) const fn counted(&self) -> Counted {
        match *self {
            Self::Cylinder(CylinderDocument { count, installed, radius_mm, .. })
            | Self::Ball(BallDocument { count, installed, radius_mm, .. })
            | Self::FlatSided(FlatSidedDocument { count, installed, radius_mm, .. }) => {
                Counted { count, installed, radius_mm }
            }
        }
    }
}

/// The rigid internal gear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct RingDocument {
    /// Number of teeth Z_K. It differs from the teeth's `count` by the number of lobes of the wave generator, two for
    /// an ellipse.
    #[schema(value_type = i64)]
    pub teeth: Whole,
    /// Radius of a bore that truncates the teeth, in mm. Null or left out: the ring keeps its natural tip.
    #[serde(default, deserialize_with = "crate::json::or_null")]
    pub tip_radius_mm: Option<f64>,
}
