//! Load sharing (docs/theory.md section 4.5): which rotation of the wave generator makes its torque, over springs, one a tooth. It knows
//! neither geometry nor shape.

use std::f64::consts::PI;

use crate::approach::Approach;
use crate::root::{NotConverged, ValueAndSlope, bracketed, newton_from_above};

/// A spring that is pressed by less is not pressed at all. The least torque of all presses some tooth by 1e-60 mm or more, so this share of the load
/// is none; and a law's logarithm and slope would leave the range of doubles.
const NOTHING_MM: f64 = 1e-200;

/// A tooth as load sharing sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Way along `F_H` for each radian that the wave generator turns: `|h'|` by kinematics.
    pub travel_arm_mm: f64,
    /// Torque at the wave generator for each newton of `F_H`: `|h'|` by statics. Friction will part the two.
    pub static_arm_mm: f64,
    /// How much shorter both become for each radian that the wave generator turns, moving on under the tooth; nothing where it counts as standing still.
    pub arm_decline_mm_per_rad: f64,
    /// How far the wave generator turns before the gaps at this tooth are closed, `g/|h'|`; infinite where they never are. Lost motion that
    /// all teeth have alike may be left out, and then what is left may be below zero.
    pub closing_rad: f64,
    /// The tooth's approach under `F_H`.
    pub approach: Approach,
}

/// What has to be closed before a tooth carries.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// Along `F_H`.
    pub(crate) along_mm: f64,
    /// As a rotation of the wave generator, on top of it.
    pub(crate) lost_motion_rad: f64,
}

impl Spring {
    /// A tooth with a gap, nothing where it has none, and the same arm in travel and statics. One without an arm never closes a gap: that of the slot
    /// vanishes with the arm, but no rotation brings the tooth there, unless it lends the tooth an arm. Nor does one whose arm ends before.
    pub(crate) fn new(arm_mm: f64, arm_decline_mm_per_rad: f64, gap: Option<Gap>, approach: Approach) -> Self {
        let closing_rad = match gap {
            Some(_) if arm_mm <= 0.0 && arm_decline_mm_per_rad >= 0.0 => f64::INFINITY,
            Some(Gap { along_mm: f64::INFINITY, .. }) => f64::INFINITY,
            Some(Gap { along_mm, lost_motion_rad }) if arm_decline_mm_per_rad == 0.0 => {
                along_mm / arm_mm + lost_motion_rad
            }
            Some(Gap { along_mm, lost_motion_rad }) => {
                turned_rad(arm_mm, arm_decline_mm_per_rad, along_mm) + lost_motion_rad
            }
            None => 0.0,
        };
        // Turned away flanks and walls let all that a tooth does come later. Its arm is what it is once that is made up for.
        let lost_motion_rad = gap.map_or(0.0, |gap| gap.lost_motion_rad);
        let arm_mm = arm_mm + arm_decline_mm_per_rad * lost_motion_rad;
        Self { travel_arm_mm: arm_mm, static_arm_mm: arm_mm, arm_decline_mm_per_rad, closing_rad, approach }
    }

    /// `Δφ |h'| - c Δφ²/2 - g`, c being the arm's decline, or nothing while a gap is open: from the closing angle θ on it is
    /// `(Δφ - θ) (|h'| - c (Δφ + θ)/2)`.
    pub fn displacement_mm(&self, wind_up: &Rotation) -> f64 {
        let closed_rad = wind_up.excess_rad - (self.closing_rad - wind_up.closing_rad);
        let mean_arm_mm = self.travel_arm_mm - self.arm_decline_mm_per_rad * (self.closing_rad + 0.5 * closed_rad);
        let displacement_mm = closed_rad * mean_arm_mm;
        // Not a number where a gap never closes, and not pressed then either.
        if displacement_mm > NOTHING_MM { displacement_mm } else { 0.0 }
    }

    /// What is turned beyond the closing angle when the tooth is displaced so far; without end where it never is.
    pub(crate) fn excess_rad(&self, displacement_mm: f64) -> f64 {
        if self.arm_decline_mm_per_rad == 0.0 {
            return displacement_mm / self.travel_arm_mm;
        }
        let arm_mm = self.travel_arm_mm - self.arm_decline_mm_per_rad * self.closing_rad;
        turned_rad(arm_mm, self.arm_decline_mm_per_rad, displacement_mm)
    }

    /// Torque at the wave generator for each newton of `F_H` when it has turned.
    pub fn turned_static_arm_mm(&self, wind_up: &Rotation) -> f64 {
        self.static_arm_mm - self.arm_decline_mm_per_rad * wind_up.rad()
    }

    fn turned_travel_arm_mm(&self, wind_up: &Rotation) -> f64 {
        self.travel_arm_mm - self.arm_decline_mm_per_rad * wind_up.rad()
    }

    /// `F_H`; nothing while a gap is open.
    ///
    /// # Errors
    /// [`NotConverged`] from the law's inverse.
    pub fn force_n(&self, wind_up: &Rotation) -> Result<f64, NotConverged> {
        let displacement_mm = self.displacement_mm(wind_up);
        if displacement_mm > 0.0 { Ok(self.approach.force(displacement_mm)?.force_n) } else { Ok(0.0) }
    }

    const fn has_arms(&self) -> bool {
        self.travel_arm_mm > 0.0 && self.static_arm_mm > 0.0
    }

    /// Whether some rotation makes the spring carry a torque.
    pub(crate) const fn can_carry(&self) -> bool {
        (self.has_arms() || self.arm_decline_mm_per_rad < 0.0) && self.closing_rad.is_finite()
    }
}

/// The rotation that makes a way along `F_H` by an arm that declines, `Δφ |h'| - c Δφ²/2`; without end where the arm ends before.
fn turned_rad(arm_mm: f64, arm_decline_mm_per_rad: f64, way_mm: f64) -> f64 {
    // Also where there is no arm to begin with.
    if way_mm == 0.0 {
        return 0.0;
    }
    let square_mm2 = arm_mm * arm_mm - 2.0 * arm_decline_mm_per_rad * way_mm;
    if square_mm2 < 0.0 && way_mm > 0.0 {
        return f64::INFINITY;
    }
    // Backwards, as to a gap below zero that lost motion makes up for, no further than to where the arm begins.
    2.0 * way_mm / (arm_mm + square_mm2.max(0.0).sqrt())
}

impl AsRef<Self> for Spring {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// `Δφ` in two parts. Under a light load what is turned beyond the last closing angle is small against the clearances, and yet makes
/// the forces: in a single number it would lose its digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Where the last of the teeth that carry closed its gaps.
    pub closing_rad: f64,
    /// What is turned beyond that, not negative: so every tooth that carries is pressed by a sum of positive terms.
    pub excess_rad: f64,
}

/// How far the wave generator turns under the load at one input angle, and how stiffly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindUp {
    /// Lost motion that all springs have alike, which their closing angles leave out.
    pub lost_motion_rad: f64,
    /// `Δφ` beyond it.
    pub rotation: Rotation,
    /// `dM0/dΔφ` at the load.
    pub stiffness_nmm_per_rad: f64,
}

impl Rotation {
    /// `Δφ`.
    pub const fn rad(&self) -> f64 {
        self.closing_rad + self.excess_rad
    }
}

impl WindUp {
    /// `Δφ`.
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
    /// The teeth of one of so many zones that are alike; all teeth, where zones are not, count as one zone.
    pub const fn new(springs: &'a [S], zones: f64) -> Self {
        Self { springs, zones }
    }

    fn iter(&self) -> impl Iterator<Item = &'a Spring> + use<'a, S> {
        self.springs.iter().map(AsRef::as_ref)
    }

    /// The torque `U Σ F_H |h'|` \[2\], and its derivative by `Δφ`.
    ///
    /// # Errors
    /// [`NotConverged`] from a law's inverse.
    pub fn torque_nmm(&self, rotation: &Rotation) -> Result<ValueAndSlope, NotConverged> {
        let mut torque = ValueAndSlope { value: 0.0, slope: 0.0 };
        for spring in self.iter() {
            let displacement_mm = spring.displacement_mm(rotation);
            if displacement_mm > 0.0 {
                let force = spring.approach.force(displacement_mm)?;
                let torque_nmm = self.zones * force.force_n * spring.turned_static_arm_mm(rotation);
                torque.value += torque_nmm;
                // dF/dΔφ = F |h'|/((Δφ |h'| - g) d ln ξ/d ln F)
                torque.slope += torque_nmm * (spring.turned_travel_arm_mm(rotation) / displacement_mm) / force.exponent;
                torque.slope -= self.zones * force.force_n * spring.arm_decline_mm_per_rad;
            }
        }
        Ok(torque)
    }

    /// The `Δφ` under which the springs make a torque; nothing where none of them has an arm, or where arms that decline end before.
    ///
    /// # Errors
    /// [`NotConverged`] where the equation that is left is not solved.
    pub fn wind_up(&self, torque_nmm: f64) -> Result<Option<WindUp>, NotConverged> {
        if !self.iter().any(Spring::has_arms) {
            return Ok(None);
        }
        let rotation = if self.iter().all(|spring| spring.closing_rad == 0.0) {
            let excess_rad = match self.gapless_rad(torque_nmm) {
                Some(excess_rad) => Some(excess_rad),
                None => self.excess_rad(0.0, torque_nmm)?,
            };
            excess_rad.map(|excess_rad| Rotation { closing_rad: 0.0, excess_rad })
        } else {
            let mut order: Vec<&S> = self.springs.iter().filter(|spring| spring.as_ref().can_carry()).collect();
            order.sort_by(|one, other| one.as_ref().closing_rad.total_cmp(&other.as_ref().closing_rad));
            Springs::new(&order, self.zones).rotation_in_order(torque_nmm)?
        };
        let Some(rotation) = rotation else { return Ok(None) };
        let stiffness_nmm_per_rad = self.torque_nmm(&rotation)?.slope;
        Ok(Some(WindUp { lost_motion_rad: 0.0, rotation, stiffness_nmm_per_rad }))
    }

    /// The rotation of springs that stand in the order in which they close. A spring carries if those before it make less than the torque when
    /// it closes; since the torque grows with the rotation, halving finds the last one. (Where arms decline so much that it does not, halving still ends
    /// between one that makes less and one that makes more.)
    fn rotation_in_order(&self, torque_nmm: f64) -> Result<Option<Rotation>, NotConverged> {
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
        let carrying = Self { springs: &self.springs[..carrying], ..*self };
        let excess_rad = carrying.excess_rad(closing_rad, torque_nmm)?;
        Ok(excess_rad.map(|excess_rad| Rotation { closing_rad, excess_rad }))
    }

    /// Whether any arm declines: then no force is in proportion to a power of the rotation.
    fn has_declining_arms(&self) -> bool {
        self.iter().any(|spring| spring.arm_decline_mm_per_rad != 0.0)
    }

    /// The exponent of all springs, if they have one in common.
    fn common_exponent(&self) -> Option<f64> {
        let mut exponents = self.iter().map(|spring| spring.approach.single_exponent());
        let first = exponents.next()??;
        exponents.all(|exponent| exponent == Some(first)).then_some(first)
    }

    /// The rotation without gaps, `(M0/(U Σ |h'| (|h'|/c)^(1/p)))^p`; none where there is no common exponent p.
    fn gapless_rad(&self, torque_nmm: f64) -> Option<f64> {
        let exponent = self.common_exponent().filter(|_| !self.has_declining_arms())?;
        let torque_of_unit = self.iter().map(|spring| {
            let (travel, arm) = (spring.travel_arm_mm, spring.static_arm_mm);
            match spring.approach {
                Approach::Power { coefficient, .. } => arm * (travel / coefficient).powf(1.0 / exponent),
                Approach::Linear { compliance_mm_per_n } => arm * (travel / compliance_mm_per_n),
                // Has no exponent.
                Approach::Logarithmic(_) | Approach::Corner(_) => 0.0,
            }
        });
        let share = torque_nmm / (self.zones * torque_of_unit.sum::<f64>());
        Some(if exponent < 1.0 { share.powf(exponent) } else { share })
    }

    /// What is turned beyond `closing_rad`, the last closing angle, for springs that all carry.
    ///
    /// Closed for a linear law. Otherwise Newton's method from above: each spring's force, and so the torque, is increasing and bent upwards in the
    /// excess, since its approach is bent downwards in the force. Where arms decline it may be bent either way.
    fn excess_rad(&self, closing_rad: f64, torque_nmm: f64) -> Result<Option<f64>, NotConverged> {
        if self.has_declining_arms() {
            return self.bracketed_excess_rad(closing_rad, torque_nmm);
        }
        if self.common_exponent() == Some(1.0) {
            let (mut stiffness, mut torque_of_unit) = (0.0, 0.0);
            for Spring { travel_arm_mm, static_arm_mm, closing_rad: own_rad, approach, .. } in self.iter() {
                let share = static_arm_mm * (travel_arm_mm / approach.approach_mm(1.0));
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

    /// The same where arms decline: between the last of some places, each twice as far as the one before, that make less than the torque and the first
    /// that does not. Nothing where none does: the wave generator turns past its teeth.
    fn bracketed_excess_rad(&self, closing_rad: f64, torque_nmm: f64) -> Result<Option<f64>, NotConverged> {
        /// Beyond the first guess no search has to go as far as this; a lobe is no wider than a turn.
        const FARTHEST_RAD: f64 = 2.0 * PI;
        let lacking =
            |excess_rad: f64| Ok(self.torque_nmm(&Rotation { closing_rad, excess_rad })?.value / torque_nmm - 1.0);
        // Springs that have no arm to begin with have no guess either.
        let guess_rad = self.most_excess_rad(closing_rad, torque_nmm)?;
        let mut far_rad = if guess_rad > 0.0 { guess_rad.min(FARTHEST_RAD) } else { FARTHEST_RAD };
        let mut near = lacking(0.5 * far_rad)?;
        while near >= 0.0 && far_rad > 0.0 {
            far_rad *= 0.5;
            near = lacking(0.5 * far_rad)?;
        }
        if far_rad <= 0.0 {
            // The last closing angle itself makes the torque, to the last digit.
            return Ok(Some(0.0));
        }
        let mut far = lacking(far_rad)?;
        while far < 0.0 {
            (far_rad, near) = (2.0 * far_rad, far);
            if far_rad > FARTHEST_RAD {
                return Ok(None);
            }
            far = lacking(far_rad)?;
        }
        let share = bracketed("rotation under the load", 0.5, near, 1.0, |share| lacking(share * far_rad))?;
        Ok(Some(share * far_rad))
    }

    /// An excess that surely makes the torque: the lesser of two.
    fn most_excess_rad(&self, closing_rad: f64, torque_nmm: f64) -> Result<f64, NotConverged> {
        /// Springs with less than this share of the longest arm are left to the others: they would need a long way for a small torque.
        const ARM_SHARE: f64 = 0.25;
        // However the torque is shared out, a rotation at which every spring bears its part at least, even without what it closed before, is enough.
        // Forces by arm are near to the true ones.
        let longest_mm = self.iter().map(|spring| spring.static_arm_mm).fold(0.0, f64::max);
        let shares =
            || self.iter().filter(move |spring| spring.has_arms() && spring.static_arm_mm >= ARM_SHARE * longest_mm);
        let squares: f64 = shares().map(|spring| spring.static_arm_mm * spring.static_arm_mm).sum();
        let force_per_arm = torque_nmm / (self.zones * squares);
        let by_share_rad = shares()
            .map(|spring| spring.approach.approach_mm(force_per_arm * spring.static_arm_mm) / spring.travel_arm_mm)
            .fold(0.0, f64::max);
        // Bent upwards, the torque lies above its tangent where the last gap closes.
        let at_closing = self.torque_nmm(&Rotation { closing_rad, excess_rad: 0.0 })?;
        let by_tangent_rad = (torque_nmm - at_closing.value) / at_closing.slope;
        Ok(if by_tangent_rad >= 0.0 { by_share_rad.min(by_tangent_rad) } else { by_share_rad })
    }
}
