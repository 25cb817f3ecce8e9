//! What can be computed of parameters that a drive may not have, with every reason why it cannot.

use super::neighbours::Neighbours;
use super::tooth_counts::{installed_no_divisor, tooth_difference};
use super::{Drive, DriveParameters};
use crate::cam::WaveGenerator;
use crate::ring::{RingFlank, RingTooth};
use crate::root::NotConverged;
use crate::violation::{FieldCode, Parameter, Violation};

/// Parameters of which some may be impossible. Each check runs as soon as the values that it needs are possible, so one
/// impossible value hides no other.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    pub(crate) parameters: DriveParameters,
    pub(super) violations: Vec<Violation>,
    /// Largest and least distance of the cam from the axis.
    pub(crate) cam_outer_mm: Option<f64>,
    pub(crate) cam_inner_mm: Option<f64>,
    /// Inward offset of the cam at which it gets a cusp or reaches the axis.
    pub(crate) greatest_set_back_mm: Option<f64>,
    pub(crate) installed: Option<i64>,
    pub(crate) tooth_radius_mm: Option<f64>,
    pub(crate) slot_half_width_mm: Option<f64>,
    /// `s`, if carrier and ring differ by one tooth for each lobe.
    pub(crate) sense: Option<f64>,
    pub(crate) ring: Option<RingTooth>,
}

impl Draft {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`NotConverged`] from the geometry.
    pub fn new(parameters: &DriveParameters) -> Result<Self, NotConverged> {
        let p = *parameters;
        let mut violations = Vec::new();
        let mut is_in_range = |parameter: Parameter, value: f64| {
            parameter.check(value).map(|violation| violations.push(violation)).is_none()
        };
        let mut are_in_range = |parameters: &[(Parameter, f64)]| {
            parameters.iter().fold(true, |all, &(parameter, value)| is_in_range(parameter, value) && all)
        };
        let wave_generator = are_in_range(&p.wave_generator.parameters()).then_some(p.wave_generator);
        let teeth = are_in_range(&[(Parameter::ToothCount, p.teeth as f64)]).then_some(p.teeth);
        let installed = are_in_range(&[(Parameter::InstalledTeeth, p.installed as f64)]).then_some(p.installed);
        let tooth_radius_mm = are_in_range(&[(Parameter::ToothRadius, p.tooth_radius_mm)]).then_some(p.tooth_radius_mm);
        are_in_range(&p.tooth.parameters());
        let ring_teeth = are_in_range(&[(Parameter::RingTeeth, p.ring_teeth as f64)]).then_some(p.ring_teeth);
        let mut bore_is_possible = p.tip_radius_mm.is_none_or(|bore| is_in_range(Parameter::TipRadius, bore));

        // A cam defined by its path depends on the teeth. Any other cam is known without them.
        let cam_tooth_radius_mm = tooth_radius_mm.or((!p.wave_generator.follows_from_teeth()).then_some(0.0));
        let mut cam = None;
        if let Some((wave_generator, radius_mm)) = wave_generator.zip(cam_tooth_radius_mm) {
            match wave_generator.cam(radius_mm) {
                Ok(possible) => cam = Some(possible),
                Err(violation) => violations.push(violation),
            }
        }
        let (cam_outer_mm, cam_inner_mm) = match p.wave_generator {
            // The semi-axes of an ellipse are known independently of each other.
            WaveGenerator::Ellipse { semi_major_mm, semi_minor_mm } => {
                let in_range = |parameter: Parameter, value| parameter.check(value).is_none().then_some(value);
                (in_range(Parameter::SemiMajor, semi_major_mm), in_range(Parameter::SemiMinor, semi_minor_mm))
            }
            _ => (cam.map(|cam| cam.kind().cam_outer_radius_mm()), cam.map(|cam| cam.kind().cam_inner_radius_mm())),
        };
        let lobes = Some(p.wave_generator.lobes()).filter(|&lobes| Parameter::Lobes.check(lobes as f64).is_none());
        let mut sense = None;
        if let Some(((teeth, ring_teeth), lobes)) = teeth.zip(ring_teeth).zip(lobes) {
            match tooth_difference(teeth, ring_teeth, lobes) {
                Some(violation) => violations.push(violation),
                None => sense = Some(if teeth > ring_teeth { 1.0 } else { -1.0 }),
            }
        }
        violations.extend(installed.zip(teeth).and_then(|(installed, teeth)| installed_no_divisor(installed, teeth)));
        let mut slot_half_width_mm = None;
        if let Some(tooth_radius_mm) = tooth_radius_mm {
            violations.extend(p.tooth.violations(tooth_radius_mm));
            // None if the flats leave nothing of the tooth.
            slot_half_width_mm =
                Some(p.tooth.half_width_in_slot_mm(tooth_radius_mm)).filter(|&width_mm| width_mm > 0.0);
        }
        if let Some(((cam_outer_mm, tooth_radius_mm), tip_radius_mm)) =
            cam_outer_mm.zip(tooth_radius_mm).zip(p.tip_radius_mm.filter(|_| bore_is_possible))
        {
            let root_radius_mm = cam_outer_mm + 2.0 * tooth_radius_mm;
            if tip_radius_mm >= root_radius_mm {
                let detail = format!(
                    "a bore of {tip_radius_mm:?} mm takes the whole flank away: choose less than the root radius of {root_radius_mm:?} mm"
                );
                let (code, parameter) = (FieldCode::BoreLeavesNoFlank, Parameter::TipRadius);
                violations.push(Violation::new(code, parameter, tip_radius_mm, root_radius_mm, detail));
                bore_is_possible = false;
            }
        }

        let cam_of_teeth = cam.filter(|_| tooth_radius_mm.is_some());
        let ring = match cam_of_teeth.zip(ring_teeth).filter(|_| bore_is_possible) {
            Some((cam, ring_teeth)) => {
                let flank = RingFlank::new(cam, ring_teeth as f64 / f64::from(cam.kind().lobes()));
                Some(RingTooth::new(flank, p.tip_radius_mm)?)
            }
            None => None,
        };
        if let Some(RingTooth { flank, tip_radius_mm, .. }) = ring {
            let cam_outer_mm = flank.locus().cam_outer_radius_mm();
            if tip_radius_mm <= cam_outer_mm {
                let (parameter, value_mm) = p.wave_generator.stroke();
                let limit_mm = match p.wave_generator {
                    WaveGenerator::Ellipse { .. } => tip_radius_mm,
                    // At a regular tip, where the ring is farthest in, the carrier has space if e < r.
                    _ => p.tooth_radius_mm,
                };
                let detail = format!(
                    "the ring's tips ({tip_radius_mm:?} mm) must stay outside the wave generator ({cam_outer_mm:?} mm), or no annulus is left for the carrier: make the teeth thicker or the wave generator rounder, or bore the ring"
                );
                violations.push(Violation::new(FieldCode::NoCarrierAnnulus, parameter, value_mm, limit_mm, detail));
            }
        }
        if let Some((cam, installed)) = cam_of_teeth.zip(installed) {
            violations.extend(Neighbours { cam, installed }.violation()?);
        }
        Ok(Self {
            parameters: p,
            violations,
            cam_outer_mm,
            cam_inner_mm,
            greatest_set_back_mm: cam
                .map(|cam| cam.kind().least_curvature_radius_mm().min(cam.kind().cam_inner_radius_mm())),
            installed,
            tooth_radius_mm,
            slot_half_width_mm,
            sense,
            ring,
        })
    }

    /// Returns every reason why the drive cannot exist.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// Returns the drive if it can exist.
    pub fn drive(&self) -> Option<Drive> {
        let ring = self.ring.filter(|_| self.violations.is_empty())?;
        Some(Drive { parameters: self.parameters, ring })
    }
}
