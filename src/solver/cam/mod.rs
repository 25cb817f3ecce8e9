//! Wave generators, one file for each kind (docs/explanation/theory.md section 2).
//!
//! To add a kind, add a file that implements `Kind` (`kind.rs`). Then add a variant of `Cam` with its arms in
//! `Cam::kind` and `Cam::with_tooth_radius`, and a variant of [`WaveGenerator`] with its arms in the methods below.

mod ellipse;
mod harmonic;
mod harmonic_path;
mod kind;

use crate::violation::{FieldCode, Parameter, Violation};

pub(crate) use ellipse::Ellipse;
pub(crate) use harmonic::Harmonic;
pub(crate) use harmonic_path::HarmonicPath;
pub use kind::{CurvePoint, Kind, ToothCenter};

/// Parameters of a wave generator, not yet checked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum WaveGenerator {
    /// An ellipse: two lobes.
    Ellipse {
        /// `a`: semi-major axis, in mm.
        semi_major_mm: f64,
        /// `b`: semi-minor axis, in mm.
        semi_minor_mm: f64,
    },
    /// A circle that rotates about a point off its centre: one lobe.
    Eccentric {
        /// `R0`: radius of the circle, in mm.
        radius_mm: f64,
        /// `e`: distance of its centre from the axis, in mm.
        eccentricity_mm: f64,
    },
    /// The support function `R0 + e cos Uφ` of two lobes or more; with one it is an eccentric.
    Harmonic {
        /// `U`: number of lobes.
        lobes: i64,
        /// `R0`: mean radius of the cam, in mm.
        mean_radius_mm: f64,
        /// `e`: amplitude, in mm.
        amplitude_mm: f64,
    },
    /// The cam that moves the tooth centres along `R + e cos Uψ`.
    HarmonicPath {
        /// `U`: number of lobes.
        lobes: i64,
        /// `R`: mean radius of the path, in mm.
        mean_path_radius_mm: f64,
        /// `e`: amplitude, in mm.
        amplitude_mm: f64,
    },
}

/// A wave generator with checked parameters, for teeth of one radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cam {
    Ellipse(Ellipse),
    /// With one lobe an eccentric circle.
    Harmonic(Harmonic),
    HarmonicPath(HarmonicPath),
}

impl Cam {
    /// Returns its geometry.
    pub(crate) const fn kind(&self) -> &dyn Kind {
        match self {
            Self::Ellipse(cam) => cam,
            Self::Harmonic(cam) => cam,
            Self::HarmonicPath(cam) => cam,
        }
    }

    /// Returns the cam for teeth of another radius.
    pub(crate) const fn with_tooth_radius(self, tooth_radius_mm: f64) -> Self {
        match self {
            Self::Ellipse(cam) => Self::Ellipse(Ellipse { tooth_radius_mm, ..cam }),
            Self::Harmonic(cam) => Self::Harmonic(Harmonic { tooth_radius_mm, ..cam }),
            Self::HarmonicPath(cam) => Self::HarmonicPath(HarmonicPath { tooth_radius_mm, ..cam }),
        }
    }
}

impl WaveGenerator {
    /// Returns `U`, as given.
    pub const fn lobes(&self) -> i64 {
        match *self {
            Self::Ellipse { .. } => 2,
            Self::Eccentric { .. } => 1,
            Self::Harmonic { lobes, .. } | Self::HarmonicPath { lobes, .. } => lobes,
        }
    }

    /// Returns the given values, each with the parameter that defines its range.
    pub fn parameters(&self) -> Vec<(Parameter, f64)> {
        let lobes = match *self {
            Self::Ellipse { .. } | Self::Eccentric { .. } => None,
            Self::Harmonic { lobes, .. } => Some((Parameter::HarmonicLobes, lobes as f64)),
            Self::HarmonicPath { lobes, .. } => Some((Parameter::Lobes, lobes as f64)),
        };
        lobes.into_iter().chain(self.size_and_shape()).collect()
    }

    /// Returns the values that set the size of the cam and its deviation from a circle.
    pub const fn size_and_shape(&self) -> [(Parameter, f64); 2] {
        match *self {
            Self::Ellipse { semi_major_mm, semi_minor_mm } => {
                [(Parameter::SemiMajor, semi_major_mm), (Parameter::SemiMinor, semi_minor_mm)]
            }
            Self::Eccentric { radius_mm, eccentricity_mm } => {
                [(Parameter::EccentricRadius, radius_mm), (Parameter::Eccentricity, eccentricity_mm)]
            }
            Self::Harmonic { mean_radius_mm, amplitude_mm, .. } => {
                [(Parameter::MeanRadius, mean_radius_mm), (Parameter::Amplitude, amplitude_mm)]
            }
            Self::HarmonicPath { mean_path_radius_mm, amplitude_mm, .. } => {
                [(Parameter::MeanPathRadius, mean_path_radius_mm), (Parameter::Amplitude, amplitude_mm)]
            }
        }
    }

    /// Returns the value that sets the stroke of the teeth. For an ellipse it is the semi-major axis, the other being
    /// fixed.
    pub(crate) const fn stroke(&self) -> (Parameter, f64) {
        let [size, shape] = self.size_and_shape();
        match self {
            Self::Ellipse { .. } => size,
            Self::Eccentric { .. } | Self::Harmonic { .. } | Self::HarmonicPath { .. } => shape,
        }
    }

    /// Returns true if the cam depends on the tooth radius, because the path of the teeth is given.
    pub(crate) const fn follows_from_teeth(&self) -> bool {
        matches!(self, Self::HarmonicPath { .. })
    }

    /// Returns `R_race`: speed of a race along the cam over its angular velocity (docs/explanation/theory.md section
    /// 10.2).
    pub fn race_radius_mm(&self, tooth_radius_mm: f64) -> f64 {
        match *self {
            Self::Ellipse { semi_major_mm, semi_minor_mm } => 0.5 * (semi_major_mm + semi_minor_mm),
            Self::Eccentric { radius_mm, .. } => radius_mm,
            Self::Harmonic { mean_radius_mm, .. } => mean_radius_mm,
            Self::HarmonicPath { mean_path_radius_mm, .. } => mean_path_radius_mm - tooth_radius_mm,
        }
    }

    /// Returns the cam for teeth of this radius. Every parameter must be in its range.
    ///
    /// # Errors
    /// The reason why there is no such cam.
    pub(crate) fn cam(&self, tooth_radius_mm: f64) -> Result<Cam, Violation> {
        // In range, so at most MAX_LOBES.
        let lobes = u32::try_from(self.lobes()).unwrap_or(u32::MAX);
        match *self {
            Self::Ellipse { semi_major_mm, semi_minor_mm } => {
                if semi_major_mm > semi_minor_mm {
                    Ok(Cam::Ellipse(Ellipse { semi_major_mm, semi_minor_mm, tooth_radius_mm }))
                } else {
                    let detail = format!(
                        "the semi-major axis ({semi_major_mm:?} mm) must exceed the semi-minor axis ({semi_minor_mm:?} mm): a round cam moves no tooth"
                    );
                    let code = FieldCode::CamNotElongated;
                    Err(Violation::new(code, Parameter::SemiMajor, semi_major_mm, semi_minor_mm, detail))
                }
            }
            Self::Eccentric { radius_mm: mean_radius_mm, eccentricity_mm: amplitude_mm }
            | Self::Harmonic { mean_radius_mm, amplitude_mm, .. } => {
                let cam = Harmonic { lobes, mean_radius_mm, amplitude_mm, tooth_radius_mm };
                self.wide_enough(mean_radius_mm, cam.least_mean_radius_mm())?;
                Ok(Cam::Harmonic(cam))
            }
            Self::HarmonicPath { mean_path_radius_mm: mean_radius_mm, amplitude_mm, .. } => {
                let cam = HarmonicPath { lobes, mean_radius_mm, amplitude_mm, tooth_radius_mm };
                self.wide_enough(mean_radius_mm, cam.least_mean_radius_mm())?;
                Ok(Cam::HarmonicPath(cam))
            }
        }
    }

    fn wide_enough(&self, radius_mm: f64, least_mm: f64) -> Result<(), Violation> {
        if radius_mm > least_mm {
            Ok(())
        } else {
            let [(parameter, _), _] = self.size_and_shape();
            let detail = format!(
                "a wave generator of {radius_mm:?} mm is too small for its stroke, its lobes would have cusps, their flanks would meet, or its axis would lie outside: choose more than {least_mm:?} mm, or a smaller stroke"
            );
            Err(Violation::new(FieldCode::CamTooSmall, parameter, radius_mm, least_mm, detail))
        }
    }
}
