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
        /// Elliptic cam with two lobes; `semi_major_mm` must exceed `semi_minor_mm`.
        Ellipse {
            /// Semi-major axis a, in mm.
            semi_major_mm: f64,
            /// Semi-minor axis b, in mm.
            semi_minor_mm: f64,
        },
        /// Circle that rotates about a point off its centre, one lobe; `eccentricity_mm` must be below `radius_mm`.
        Eccentric {
            /// Radius R0 of the circle, in mm.
            radius_mm: f64,
            /// Distance e of its centre from the axis, in mm.
            eccentricity_mm: f64,
        },
        /// Cam with the support function R0 + e cos Uφ, which is the distance of its tangents from the axis.
        Harmonic {
            /// Lobes U: teeth pass as many meshing zones in a turn. With one the cam is an `eccentric`.
            #[schema(value_type = i64, minimum = 2)]
            lobes: Whole,
            /// Mean radius R0, in mm.
            mean_radius_mm: f64,
            /// Amplitude e, in mm.
            amplitude_mm: f64,
        },
        /// Cam that moves the tooth centres along R + e cos Uψ.
        HarmonicPath {
            /// Number of lobes U, and of meshing zones.
            #[schema(value_type = i64)]
            lobes: Whole,
            /// Mean radius R of the path, in mm.
            mean_path_radius_mm: f64,
            /// Amplitude e, in mm.
            amplitude_mm: f64,
        },
    }
}

union! {
    /// The discrete teeth. Default shape: cylinder.
    #[schema(as = Teeth)]
    pub enum TeethDocument by "shape" read "by:shape=cylinder" {
        /// Cylinders along the axis.
        Cylinder {
            /// Theoretical number of teeth Z_G. It differs from the ring's by the number of lobes of the wave generator.
            #[schema(value_type = i64)]
            count: Whole,
            /// Number of installed teeth Z'_G, a divisor of `count`. Only installed teeth have a slot. Default: `count`.
            #[serde(skip_serializing_if = "Option::is_none")]
            #[schema(value_type = i64, required = false)]
            installed: Option<Whole>,
            /// Radius r of a tooth, in mm.
            radius_mm: f64,
            /// Width L1 of a tooth along the axis, in mm.
            width_mm: f64,
        },
        /// Balls, which can run in grooves along the path of the contact.
        Ball {
            /// Theoretical number of teeth Z_G. It differs from the ring's by the number of lobes of the wave generator.
            #[schema(value_type = i64)]
            count: Whole,
            /// Number of installed teeth Z'_G, a divisor of `count`. Only installed teeth have a slot. Default: `count`.
            #[serde(skip_serializing_if = "Option::is_none")]
            #[schema(value_type = i64, required = false)]
            installed: Option<Whole>,
            /// Radius r of a ball, in mm.
            radius_mm: f64,
            /// Radii of the grooves across the path, in mm, each larger than the ball's radius. Default: no groove; the part is
            /// straight along the axis.
            #[serde(default)]
            groove_radius_mm: LengthsByContactDocument,
        },
        /// Cylinders with two flats on the walls of the slot.
        FlatSided {
            /// Theoretical number of teeth Z_G. It differs from the ring's by the number of lobes of the wave generator.
            #[schema(value_type = i64)]
            count: Whole,
            /// Number of installed teeth Z'_G, a divisor of `count`. Only installed teeth have a slot. Default: `count`.
            #[serde(skip_serializing_if = "Option::is_none")]
            #[schema(value_type = i64, required = false)]
            installed: Option<Whole>,
            /// Radius r of a tooth, in mm.
            radius_mm: f64,
            /// Width L1 of a tooth along the axis, in mm.
            width_mm: f64,
            /// Length l of a flat along the slot, in mm. It must be below the tooth's diameter.
            flat_length_mm: f64,
        },
    }
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
            Self::Ellipse { .. } | Self::Eccentric { .. } => None,
            Self::Harmonic { lobes, .. } | Self::HarmonicPath { lobes, .. } => Some(lobes),
        }
    }
}

impl From<&WaveGeneratorDocument> for WaveGenerator {
    fn from(document: &WaveGeneratorDocument) -> Self {
        use WaveGeneratorDocument::{Eccentric, Ellipse, Harmonic, HarmonicPath};
        match *document {
            Ellipse { semi_major_mm, semi_minor_mm } => Self::Ellipse { semi_major_mm, semi_minor_mm },
            Eccentric { radius_mm, eccentricity_mm } => Self::Eccentric { radius_mm, eccentricity_mm },
            Harmonic { lobes, mean_radius_mm, amplitude_mm } => {
                Self::Harmonic { lobes: lobes.count(), mean_radius_mm, amplitude_mm }
            }
            HarmonicPath { lobes, mean_path_radius_mm, amplitude_mm } => {
                Self::HarmonicPath { lobes: lobes.count(), mean_path_radius_mm, amplitude_mm }
            }
        }
    }
}

impl From<&TeethDocument> for ToothShape {
    fn from(document: &TeethDocument) -> Self {
        use TeethDocument::{Ball, Cylinder, FlatSided};
        match *document {
            Cylinder { width_mm, .. } => Self::Cylinder { width_mm },
            Ball { ref groove_radius_mm, .. } => Self::Ball { groove_radius_mm: groove_radius_mm.by_contact() },
            FlatSided { width_mm, flat_length_mm, .. } => Self::FlatSided { width_mm, flat_length_mm },
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
        let (Self::Cylinder { count, installed, .. }
        | Self::Ball { count, installed, .. }
        | Self::FlatSided { count, installed, .. }) = self;
        installed.get_or_insert(*count);
    }

    pub(super) const fn counted(&self) -> Counted {
        let (Self::Cylinder { count, installed, radius_mm, .. }
        | Self::Ball { count, installed, radius_mm, .. }
        | Self::FlatSided { count, installed, radius_mm, .. }) = *self;
        Counted { count, installed, radius_mm }
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
