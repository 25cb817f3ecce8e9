//! State of a tooth at a position: geometry, gaps, pressure models, spring.

use super::equilibrium::{
    Compatibility, ToothState, curvature_per_mm, force_ratio, force_ratio_at_corner, projected_weights,
};
use super::loaded_drive::LoadedDrive;
use crate::SolveError;
use crate::cam::ToothCenter;
use crate::contact::{Contact, PerContact};
use crate::mesh::Place;
use crate::position::Position;
use crate::ring::{FlankPoint, TipCorner};
use crate::root::NotConverged;
use crate::springs::{Gap, Spring};
use crate::tooth::{CornerContact, Pressure};

impl<'a> LoadedDrive<'a> {
    /// Returns the corner that a tooth before the flank meets first.
    fn corner_at(&self, position: &Position) -> Option<&TipCorner> {
        self.tip_corner.as_ref().filter(|corner| corner.is_before_flank(position))
    }

    /// Returns the centre of a tooth at a position, and the curvature of each of its contacts in the plane of motion.
    pub(crate) fn center_and_curvatures(
        &self,
        position: Position,
    ) -> Result<(ToothCenter, PerContact<f64>), NotConverged> {
        let center = self.drive.flank().locus().at(position)?;
        Ok((center, curvature_per_mm(self.drive, &center, &self.drive.flank().at(&center))))
    }

    /// Returns the pressure model of a contact of a tooth at a position.
    pub(crate) fn pressure_at(&self, position: Position, contact: Contact) -> Result<Pressure, SolveError> {
        let (center, curvature_per_mm) = self.center_and_curvatures(position)?;
        self.pressure(contact, &center, *curvature_per_mm.get(contact))
    }

    /// Returns the tooth at a position.
    ///
    /// # Errors
    /// [`NotConverged`] from the path, [`SolveError::FlatOffCarrier`] if a flat-sided tooth has left its slot.
    pub fn tooth(&self, position: Position) -> Result<ToothState, SolveError> {
        self.tooth_at(&Place::default(), position)
    }

    /// Returns the tooth at a position, in its place among items that may deviate.
    ///
    /// # Errors
    /// As [`Self::tooth`], and [`SolveError::Interference`] if a tooth is pressed without load.
    pub fn tooth_at(&self, place: &Place, position: Position) -> Result<ToothState, SolveError> {
        let locus = self.drive.flank().locus();
        self.state(place, locus.at(position)?)
    }

    pub(super) fn state(&self, place: &Place, center: ToothCenter) -> Result<ToothState, SolveError> {
        let (sense, flank_curve) = (self.drive.sense(), self.drive.flank());
        let corner = self.corner_at(&center.position);
        let flank = corner.map_or_else(|| flank_curve.at(&center), |corner| corner.seen_from(&center));
        let at_corner = corner.and_then(|_| force_ratio_at_corner(sense, &center, &flank));
        let can_be_pressed = corner.is_none() || (at_corner.is_some() && !self.has_left_slot(&center));
        let force_ratio = at_corner.unwrap_or_else(|| force_ratio(sense, flank_curve, &center));
        // Corners are pressed with virtual work only.
        let weights = match self.load.compatibility {
            Compatibility::VirtualWork => force_ratio,
            Compatibility::Projection => projected_weights(sense, flank_curve, &center),
        };
        let curvature_per_mm = curvature_per_mm(self.drive, &center, &flank);
        let pressure = PerContact::try_of(|contact| self.pressure(contact, &center, *curvature_per_mm.get(contact)))?;
        // Without friction, displacement and torque of the wave generator have the same lever arm.
        let arm_mm = center.lever_arm_mm;
        let usually_turned = self.gaps.usually_turned(center.center_radius_mm);
        let gap = if self.gaps.is_nil() && corner.is_none() {
            None
        } else if !can_be_pressed {
            Some(Gap { along_mm: f64::INFINITY, lost_motion_rad: 0.0 })
        } else {
            let mut gaps_mm = self.gaps.besides_turns(place, &center, &flank);
            let mut turned = self.gaps.turned_at(place);
            if self.load.wave_generator_moves || corner.is_some() {
                // This also holds in the valley, where the gap has no weight.
                turned = turned.and_aside(std::mem::take(&mut gaps_mm.carrier), center.center_radius_mm);
            }
            if let Some(corner) = corner {
                let apart_rad = turned.rad() - usually_turned.rad();
                gaps_mm.ring +=
                    corner.gap_mm(&flank) + self.beyond_lost_motion_mm(apart_rad, &center, &flank) / weights.ring;
            }
            let along_mm = weights.iter().fold(0.0, |sum, (contact, weight)| sum + weight * gaps_mm.get(contact));
            let lost_motion_rad = turned.lost_motion_rad(self.drive);
            Some(match self.load.compatibility {
                // Weights of clearances were checked before; a negative sum is rounding.
                Compatibility::Projection => Gap { along_mm: along_mm.max(0.0), lost_motion_rad },
                Compatibility::VirtualWork => {
                    let gap_mm = along_mm + (lost_motion_rad + self.lost_motion_rad()) * arm_mm;
                    if gap_mm < 0.0 {
                        let position_deg = center.position.from_lobe_deg();
                        let place = self.mesh.tells_items_apart().then_some(*place);
                        let gap_um = 1e3 * gap_mm;
                        return Err(SolveError::Interference { place, position_deg, input_angle_deg: None, gap_um });
                    }
                    Gap { along_mm, lost_motion_rad }
                }
            })
        };
        let bending =
            self.ring_bending.map_or(0.0, |ring| ring.compliance_mm_per_n(flank_curve.point(&center, &flank)));
        let approach = self.contacts.approach(&force_ratio, &weights, &pressure, bending);
        if self.load.compatibility == Compatibility::Projection {
            let compliance_mm_per_n = approach.least_part_mm();
            if compliance_mm_per_n <= 0.0 {
                let position_deg = center.position.from_lobe_deg();
                return Err(SolveError::ComplianceNotPositive { position_deg, compliance_mm_per_n });
            }
        }
        let decline_mm_per_rad = self.arm_decline_mm_per_rad(&center);
        // The tooth reaches this place on the flank after the common lost motion, and has its lever arm then.
        let usual_rad = usually_turned.lost_motion_rad(self.drive);
        let spring = Spring::new(arm_mm, usual_rad, decline_mm_per_rad, gap, approach);
        Ok(ToothState { center, flank, force_ratio, curvature_per_mm, pressure, spring })
    }

    /// Returns the decrease of a tooth's lever arm for each radian of wind-up of the wave generator. It is the
    /// derivative of `d tan γ cos γ` by the position, with γ in the cosine constant (docs/explanation/theory.md section
    /// 4.4).
    fn arm_decline_mm_per_rad(&self, center: &ToothCenter) -> f64 {
        if !self.load.wave_generator_moves {
            return 0.0;
        }
        let &ToothCenter { tan_pressure_angle: t, tan_pressure_angle_derivative, center_radius_mm, .. } = center;
        (tan_pressure_angle_derivative - t * t) * center_radius_mm / (1.0 + t * t).sqrt()
    }

    /// Returns the extra gap along `F_H` of a tooth before the flank, if flanks and walls are rotated by more than the
    /// common angle. On the flank the ring's force has k times the arm of `F_H`; here it has another, so the lost
    /// motion differs.
    fn beyond_lost_motion_mm(&self, turned_rad: f64, center: &ToothCenter, seen: &FlankPoint) -> f64 {
        let t = center.tan_pressure_angle;
        let ring_arm_mm = center.center_radius_mm * seen.tan_pressure_angle / (1.0 + t * t).sqrt();
        let of_flank_mm = self.drive.flank().teeth_per_wave() * center.lever_arm_mm;
        turned_rad * (ring_arm_mm - of_flank_mm)
    }

    /// Returns the pressure model of a contact of a tooth.
    pub(super) fn pressure(
        &self,
        contact: Contact,
        center: &ToothCenter,
        curvature_per_mm: f64,
    ) -> Result<Pressure, SolveError> {
        if let (Contact::Ring, Some(corner)) = (contact, self.corner_at(&center.position)) {
            return Ok(Pressure::Corner(CornerContact {
                curvature_per_mm,
                angle_rad: corner.angle_off_flank_rad(center, &corner.seen_from(center)),
                bending_growth_mm_per_n: self.corner_growth_mm_per_n,
            }));
        }
        let center_radius_mm = center.center_radius_mm;
        let pressure = self.contacts.pressure(contact, curvature_per_mm, center_radius_mm)?;
        // Before the flank such a tooth carries no load.
        let unpressed =
            || self.corner_at(&center.position).and(self.contacts.flat()).map(|flat| Pressure::Flat(flat.whole));
        pressure.or_else(unpressed).ok_or_else(|| {
            let position_deg = center.position.from_lobe_deg();
            SolveError::FlatOffCarrier { position_deg, center_radius_mm }
        })
    }

    /// Returns true if a tooth's flat lies outside its slot's walls.
    fn has_left_slot(&self, center: &ToothCenter) -> bool {
        self.contacts.flat().is_some_and(|flat| flat.borne_mm(center.center_radius_mm) <= 0.0)
    }

    /// Returns the pressure at the middle of each contact of a tooth, integrated along its path over the part. Wear
    /// follows from it (docs/explanation/theory.md section 10.4).
    pub(crate) fn line_load_n_per_mm(
        &self,
        center: &ToothCenter,
        flank: &FlankPoint,
        force_n: &PerContact<f64>,
    ) -> Result<PerContact<f64>, SolveError> {
        let curvature_per_mm = curvature_per_mm(self.drive, center, flank);
        let width_mm = self.drive.tooth_width_mm();
        PerContact::try_of(|contact| {
            let pressure = self.pressure(contact, center, *curvature_per_mm.get(contact))?;
            Ok(pressure.line_load_n_per_mm(*force_n.get(contact), width_mm))
        })
    }
}
