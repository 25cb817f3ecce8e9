//! Load sharing (docs/explanation/theory.md section 4.5): the rotation of the wave generator that balances its torque,
//! with one spring for each tooth. It is independent of geometry and tooth shape.

mod spring;

use std::f64::consts::PI;

use crate::approach::Approach;
use crate::root::{NotConverged, ValueAndSlope, bracketed, newton_from_above};

pub(crate) use spring::Gap;
pub use spring::{Rotation, Spring};

/// Displacement below which a spring carries nothing. The least torque displaces some tooth by 1e-60 mm or more, so the
/// neglected load is negligible. Smaller values would leave the range of doubles in a law's logarithm and slope.
const NOTHING_MM: f64 = 1e-200;

/// Upper bound of every search for a rotation; a lobe is no wider than a turn.
const FARTHEST_RAD: f64 = 2.0 * PI;

/// Maximum of the torque of springs with declining arms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Summit {
    pub(crate) rotation: Rotation,
    pub(crate) torque_nmm: f64,
    /// True if the search ended there, so that the torque may still rise.
    is_end: bool,
}

/// Wind-up of the wave generator under the load at one input angle, and the stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindUp {
    /// Lost motion common to all springs, which their closing angles exclude.
    pub lost_motion_rad: f64,
    /// `Δφ` beyond the lost motion.
    pub rotation: Rotation,
    /// `dM0/dΔφ` at the load.
    pub stiffness_nmm_per_rad: f64,
}

impl WindUp {
    /// Returns `Δφ`, including the lost motion.
    pub const fn rotation_rad(&self) -> f64 {
        self.lost_motion_rad + self.rotation.rad()
    }
}

/// Springs that share a torque.
#[derive(Debug, Clone, Copy)]
pub struct Springs<'a, S> {
    springs: &'a [S],
    zones: f64,
}

impl<'a, S: AsRef<Spring>> Springs<'a, S> {
    /// Builds the springs of one zone of `zones` that are alike. If zones are not alike, all teeth count as one zone.
    pub const fn new(springs: &'a [S], zones: f64) -> Self {
        Self { springs, zones }
    }

    fn iter(&self) -> impl Iterator<Item = &'a Spring> + use<'a, S> {
        self.springs.iter().map(AsRef::as_ref)
    }

    /// Returns the torque `U Σ F_H |h'|` \[2\], and its derivative by `Δφ`.
    ///
    /// # Errors
    /// [`NotConverged`] from a law's inverse.
    pub fn torque_nmm(&self, rotation: &Rotation) -> Result<ValueAndSlope, NotConverged> {
        let mut torque = ValueAndSlope { value: 0.0, slope: 0.0 };
        for spring in self.iter() {
            let displacement_mm = spring.displacement_mm(rotation);
            if displacement_mm > 0.0 {
                let force = spring.approach.force(displacement_mm)?;
                let torque_nmm = self.zones * force.force_n * spring.turned_arm_mm(rotation);
                torque.value += torque_nmm;
                // dF/dΔφ = F |h'|/((Δφ |h'| - g) d ln ξ/d ln F)
                torque.slope += torque_nmm * (spring.turned_arm_mm(rotation) / displacement_mm) / force.exponent;
                torque.slope -= self.zones * force.force_n * spring.arm_decline_mm_per_rad;
            }
        }
        Ok(torque)
    }

    /// Returns the `Δφ` at which the springs balance a torque. Returns none if no spring has an arm, or if declining
    /// arms end before.
    ///
    /// # Errors
    /// [`NotConverged`] if the remaining equation is not solved.
    pub fn wind_up(&self, torque_nmm: f64) -> Result<Option<WindUp>, NotConverged> {
        if !self.iter().any(Spring::has_arm) {
            return Ok(None);
        }
        let found = self.rotation(torque_nmm, None)?;
        let rotation = if self.has_declining_arms() { self.first_rotation(torque_nmm, found)? } else { found };
        let Some(rotation) = rotation else { return Ok(None) };
        let stiffness_nmm_per_rad = self.torque_nmm(&rotation)?.slope;
        Ok(Some(WindUp { lost_motion_rad: 0.0, rotation, stiffness_nmm_per_rad }))
    }

    /// Returns the rotation that balances the torque. Up to a given maximum that exceeds the torque, it is the first
    /// rotation.
    fn rotation(&self, torque_nmm: f64, summit: Option<&Rotation>) -> Result<Option<Rotation>, NotConverged> {
        if self.iter().all(|spring| spring.closing_rad == 0.0) {
            let excess_rad = match self.gapless_rad(torque_nmm) {
                Some(excess_rad) => Some(excess_rad),
                None => self.excess_rad(0.0, torque_nmm, summit)?,
            };
            return Ok(excess_rad.map(|excess_rad| Rotation { closing_rad: 0.0, excess_rad }));
        }
        let closes = |spring: &&S| {
            let spring = spring.as_ref();
            spring.can_carry()
                && summit.is_none_or(|summit| spring.closing_rad - summit.closing_rad <= summit.excess_rad)
        };
        let mut order: Vec<&S> = self.springs.iter().filter(closes).collect();
        order.sort_by(|one, other| one.as_ref().closing_rad.total_cmp(&other.as_ref().closing_rad));
        Springs::new(&order, self.zones).rotation_in_order(torque_nmm, summit)
    }

    /// Returns the first rotation that balances the torque if arms decline, given one that does (if found): the torque
    /// need not rise monotonically. Returns none if every maximum of the torque is lower.
    fn first_rotation(&self, torque_nmm: f64, found: Option<Rotation>) -> Result<Option<Rotation>, NotConverged> {
        let summit = match found {
            Some(found) if self.iter().all(|spring| spring.helps_up_to(&found)) => return Ok(Some(found)),
            Some(found) => self.summit(&found, torque_nmm)?,
            None => self.summit(&self.farthest(), torque_nmm)?,
        };
        match found {
            Some(found) if summit.is_end => Ok(Some(found)),
            _ if summit.torque_nmm < torque_nmm => Ok(None),
            // At the maximum's own torque, rounding may leave no earlier rotation.
            _ => Ok(self.rotation(torque_nmm, Some(&summit.rotation))?.or(Some(summit.rotation))),
        }
    }

    /// Returns the largest torque before a rotation (or anywhere) if it exceeds that of the rotation; none if arms do
    /// not decline.
    ///
    /// # Errors
    /// [`NotConverged`] from a law's inverse.
    pub(crate) fn summit_before(&self, end: Option<&Rotation>) -> Result<Option<Summit>, NotConverged> {
        if !self.has_declining_arms() || end.is_some_and(|end| self.iter().all(|spring| spring.helps_up_to(end))) {
            return Ok(None);
        }
        let summit = self.summit(end.unwrap_or(&self.farthest()), f64::INFINITY)?;
        Ok((!summit.is_end && summit.torque_nmm > 0.0).then_some(summit))
    }

    /// Returns the closing angle of the first spring.
    fn first_closing_rad(&self) -> f64 {
        let closings_rad = self.iter().filter(|spring| spring.can_carry()).map(|spring| spring.closing_rad);
        closings_rad.reduce(f64::min).unwrap_or(0.0)
    }

    fn farthest(&self) -> Rotation {
        Rotation { closing_rad: self.first_closing_rad(), excess_rad: FARTHEST_RAD }
    }

    /// Returns the first maximum of the torque, up to `end`, that is at least `enough_nmm`, or else the highest. The
    /// search ends at a maximum after which no gap is left to close. An earlier maximum is passed, because the wave
    /// generator then meets further springs.
    fn summit(&self, end: &Rotation, enough_nmm: f64) -> Result<Summit, NotConverged> {
        /// Relative length of an interval whose ends show if the torque rises: at the maximum the torque varies by its
        /// square.
        const SHORTEST: f64 = 1e-9;
        let first_rad = self.first_closing_rad();
        let at = |excess_rad: f64| Rotation { closing_rad: first_rad, excess_rad };
        let closings_rad = self.iter().filter(|spring| spring.can_carry()).map(|spring| spring.closing_rad - first_rad);
        let all_closed_rad = closings_rad.fold(0.0, f64::max);
        let end_rad = end.excess_rad + (end.closing_rad - first_rad);
        let mut summit = Summit { rotation: at(0.0), torque_nmm: 0.0, is_end: false };
        let (mut near_rad, mut near_nmm, mut rises, mut step_rad) = (0.0, 0.0, true, end_rad);
        // By rounding, the shortest intervals at a minimum have maxima of their own.
        let mut surely_rises = true;
        while near_rad < end_rad {
            let far_rad = end_rad.min(near_rad + step_rad);
            let far_nmm = self.torque_nmm(&at(far_rad))?.value;
            let is_short = step_rad <= SHORTEST * near_rad.max(SHORTEST * end_rad);
            let trend = self.trend(&at(near_rad), &at(far_rad))?;
            let Some(goes_up) = trend.or_else(|| is_short.then_some(far_nmm >= near_nmm)) else {
                step_rad = 0.5 * (far_rad - near_rad);
                continue;
            };
            if rises && !goes_up && near_nmm > summit.torque_nmm {
                summit = Summit { rotation: at(near_rad), torque_nmm: near_nmm, is_end: false };
                if near_nmm >= enough_nmm {
                    return Ok(summit);
                }
            }
            if surely_rises && trend == Some(false) && near_rad >= all_closed_rad {
                return Ok(summit);
            }
            surely_rises = trend.unwrap_or(surely_rises);
            (near_rad, near_nmm, rises, step_rad) = (far_rad, far_nmm, goes_up, 2.0 * step_rad);
        }
        let is_end = rises && near_nmm >= summit.torque_nmm;
        Ok(if is_end { Summit { rotation: *end, torque_nmm: near_nmm, is_end } } else { summit })
    }

    /// Returns true if the torque certainly rises over an interval of the rotation, false if it certainly falls,
    /// otherwise none.
    ///
    /// The term `F_H |h'|` of a spring has the slope `h'² dF_H/dξ - c F_H`. Force and stiffness grow with the
    /// displacement, so the extremes of these and of the arm bound the slope.
    fn trend(&self, near: &Rotation, far: &Rotation) -> Result<Option<bool>, NotConverged> {
        let (mut least, mut most) = (0.0, 0.0);
        for spring in self.iter().filter(|spring| spring.can_carry()) {
            let ways_mm = [near, far].map(|rotation| spring.displacement_mm(rotation));
            let arms_mm = [near, far].map(|rotation| spring.turned_arm_mm(rotation));
            let squares_mm2 = arms_mm.map(|arm_mm| arm_mm * arm_mm);
            let is_passed = arms_mm[0] > 0.0 && arms_mm[1] < 0.0;
            let decline_mm = spring.arm_decline_mm_per_rad;
            let largest_mm =
                if is_passed { spring.arm_mm * spring.arm_mm / (2.0 * decline_mm) } else { ways_mm[0].max(ways_mm[1]) };
            let (lesser, larger) =
                (spring.force_and_stiffness(ways_mm[0].min(ways_mm[1]))?, spring.force_and_stiffness(largest_mm)?);
            let least_square_mm2 = if is_passed { 0.0 } else { squares_mm2[0].min(squares_mm2[1]) };
            let declines = [decline_mm * lesser.value, decline_mm * larger.value];
            let own_least = least_square_mm2 * lesser.slope - declines[0].max(declines[1]);
            least += if spring.helps_up_to(far) { own_least.max(0.0) } else { own_least };
            most += squares_mm2[0].max(squares_mm2[1]) * larger.slope - declines[0].min(declines[1]);
        }
        Ok(if least >= 0.0 {
            Some(true)
        } else if most < 0.0 {
            Some(false)
        } else {
            None
        })
    }

    /// Returns the rotation of springs sorted by closing angle. A spring carries if the springs before it balance less
    /// than the torque when it closes. Bisection finds the last one, because the torque crosses the required value once
    /// up to the given maximum. If no maximum is known and the torque is not monotonic, bisection still ends between
    /// two springs that bracket the torque.
    fn rotation_in_order(&self, torque_nmm: f64, summit: Option<&Rotation>) -> Result<Option<Rotation>, NotConverged> {
        if self.springs.is_empty() {
            return Ok(None);
        }
        let (mut carrying, mut free) = (1, self.springs.len());
        while carrying < free {
            let tried = carrying.midpoint(free + 1);
            let closing_rad = self.springs[tried - 1].as_ref().closing_rad;
            let before = Self { springs: &self.springs[..tried - 1], ..*self };
            if before.torque_nmm(&Rotation { closing_rad, excess_rad: 0.0 })?.value < torque_nmm {
                carrying = tried;
            } else {
                free = tried - 1;
            }
        }
        let closing_rad = self.springs[carrying - 1].as_ref().closing_rad;
        let next =
            self.springs.get(carrying).map(|next| Rotation { closing_rad: next.as_ref().closing_rad, excess_rad: 0.0 });
        let carrying = Self { springs: &self.springs[..carrying], ..*self };
        // These springs balance the torque at the next closing angle, and may balance less beyond.
        let end = next.as_ref().or(summit);
        let excess_rad = carrying.excess_rad(closing_rad, torque_nmm, end)?;
        let excess_rad = excess_rad.or_else(|| Some(next?.closing_rad - closing_rad));
        Ok(excess_rad.map(|excess_rad| Rotation { closing_rad, excess_rad }))
    }

    /// Returns true if any arm declines; then no force is proportional to a power of the rotation.
    fn has_declining_arms(&self) -> bool {
        self.iter().any(|spring| spring.arm_decline_mm_per_rad != 0.0)
    }

    /// Returns the common exponent of all springs, if there is one.
    fn common_exponent(&self) -> Option<f64> {
        let mut exponents = self.iter().map(|spring| spring.approach.single_exponent());
        let first = exponents.next()??;
        exponents.all(|exponent| exponent == Some(first)).then_some(first)
    }

    /// Returns the rotation without gaps, `(M0/(U Σ |h'| (|h'|/c)^(1/p)))^p`; none without a common exponent p.
    fn gapless_rad(&self, torque_nmm: f64) -> Option<f64> {
        let exponent = self.common_exponent().filter(|_| !self.has_declining_arms())?;
        let torque_of_unit = self.iter().map(|spring| {
            let arm = spring.arm_mm;
            match spring.approach {
                Approach::Power { coefficient, .. } => arm * (arm / coefficient).powf(1.0 / exponent),
                Approach::Linear { compliance_mm_per_n } => arm * (arm / compliance_mm_per_n),
                // No exponent.
                Approach::Logarithmic(_) | Approach::Corner(_) => 0.0,
            }
        });
        let share = torque_nmm / (self.zones * torque_of_unit.sum::<f64>());
        Some(if exponent < 1.0 { share.powf(exponent) } else { share })
    }

    /// Returns the rotation beyond `closing_rad`, the last closing angle, for springs that all carry.
    ///
    /// A linear law has a closed form. Other laws use Newton's method from above: each force, and so the torque, is
    /// increasing and convex in the rotation, since the approach is concave in the force. With declining arms it may be
    /// neither.
    fn excess_rad(
        &self,
        closing_rad: f64,
        torque_nmm: f64,
        end: Option<&Rotation>,
    ) -> Result<Option<f64>, NotConverged> {
        if self.has_declining_arms() {
            let most_rad = end.map_or(FARTHEST_RAD, |end| end.excess_rad + (end.closing_rad - closing_rad));
            return self.bracketed_excess_rad(closing_rad, torque_nmm, most_rad);
        }
        if self.common_exponent() == Some(1.0) {
            let (mut stiffness, mut torque_of_unit) = (0.0, 0.0);
            for Spring { arm_mm, closing_rad: own_rad, approach, .. } in self.iter() {
                let share = arm_mm * (arm_mm / approach.approach_mm(1.0));
                stiffness += share;
                torque_of_unit += share * (closing_rad - own_rad);
            }
            return Ok(Some(((torque_nmm / self.zones - torque_of_unit) / stiffness).max(0.0)));
        }
        let start_rad = self.most_excess_rad(closing_rad, torque_nmm)?;
        newton_from_above("rotation under the load", start_rad, |excess_rad| {
            let torque = self.torque_nmm(&Rotation { closing_rad, excess_rad })?;
            Ok(ValueAndSlope { value: torque.value - torque_nmm, slope: torque.slope })
        })
        .map(Some)
    }

    /// Returns the same for declining arms. It doubles the rotation, up to a maximum, until the torque is reached, and
    /// then solves within the last interval. Returns none if the torque is not reached.
    fn bracketed_excess_rad(
        &self,
        closing_rad: f64,
        torque_nmm: f64,
        most_rad: f64,
    ) -> Result<Option<f64>, NotConverged> {
        let lacking =
            |excess_rad: f64| Ok(self.torque_nmm(&Rotation { closing_rad, excess_rad })?.value / torque_nmm - 1.0);
        // Springs without an initial arm give no estimate.
        let guess_rad = self.most_excess_rad(closing_rad, torque_nmm)?;
        let mut far_rad = if guess_rad > 0.0 { guess_rad.min(most_rad) } else { most_rad };
        let mut near = lacking(0.5 * far_rad)?;
        while near >= 0.0 && far_rad > 0.0 {
            far_rad *= 0.5;
            near = lacking(0.5 * far_rad)?;
        }
        if far_rad <= 0.0 {
            // The last closing angle itself balances the torque, to the last digit.
            return Ok(Some(0.0));
        }
        let (mut near_rad, mut far) = (0.5 * far_rad, lacking(far_rad)?);
        while far < 0.0 {
            if far_rad >= most_rad {
                return Ok(None);
            }
            (near_rad, near) = (far_rad, far);
            far_rad = most_rad.min(2.0 * far_rad);
            far = lacking(far_rad)?;
        }
        let start = near_rad / far_rad;
        let share = bracketed("rotation under the load", start, near, 1.0, |share| lacking(share * far_rad))?;
        Ok(Some(share * far_rad))
    }

    /// Returns a rotation that certainly reaches the torque: the lesser of two bounds.
    fn most_excess_rad(&self, closing_rad: f64, torque_nmm: f64) -> Result<f64, NotConverged> {
        /// Springs with less than this share of the longest arm are left out: they would need a large rotation for a
        /// small torque.
        const ARM_SHARE: f64 = 0.25;
        // For any distribution of the torque, a rotation at which every spring carries its part, ignoring its earlier
        // closing, is sufficient. Forces proportional to the arm are close to the true ones.
        let longest_mm = self.iter().map(|spring| spring.arm_mm).fold(0.0, f64::max);
        let shares = || self.iter().filter(move |spring| spring.has_arm() && spring.arm_mm >= ARM_SHARE * longest_mm);
        let squares: f64 = shares().map(|spring| spring.arm_mm * spring.arm_mm).sum();
        let force_per_arm = torque_nmm / (self.zones * squares);
        let by_share_rad = shares()
            .map(|spring| spring.approach.approach_mm(force_per_arm * spring.arm_mm) / spring.arm_mm)
            .fold(0.0, f64::max);
        // The torque is convex, so it exceeds its tangent at the last closing angle.
        let at_closing = self.torque_nmm(&Rotation { closing_rad, excess_rad: 0.0 })?;
        let by_tangent_rad = (torque_nmm - at_closing.value) / at_closing.slope;
        Ok(if by_tangent_rad >= 0.0 { by_share_rad.min(by_tangent_rad) } else { by_share_rad })
    }
}
