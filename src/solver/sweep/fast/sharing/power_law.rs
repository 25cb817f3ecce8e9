//! Sharing among springs of one power law: closed form without gaps, tangents beyond them.

use pulp::Simd;

use super::{
    LAST_ROTATION_STEP, Limit, MAX_ROUNDS, NOTHING, OPEN_TORQUE, Weights, forces_at_stress, last_below, last_of,
    least_torque, press, start_above, turn_to_limit,
};
use crate::contact::PerContact;
use crate::contact_law::PALMGREN_EXPONENT;
use crate::sweep::fast::lanes::{cube_root, inverse_tenth_root, ninth_root};
use crate::sweep::fast::tile::Tile;
use crate::tooth::point::EllipticContact;

/// Power law `ξ = c F^p`, in columns.
pub(crate) trait Power {
    /// `p`.
    const EXPONENT: f64;

    /// `x^p`, x not negative.
    fn power<V: Simd>(&self, x: f64) -> f64;

    /// `x^(1/p - 1)`.
    fn inverse_over_x<V: Simd>(&self, x: f64) -> f64;

    /// `x^(1/p)`.
    #[inline(always)]
    fn inverse<V: Simd>(&self, x: f64) -> f64 {
        x * self.inverse_over_x::<V>(x)
    }

    /// Computes the force at the rotation 1, `(|h'|/c)^(1/p)`, with `c = Σ w q (F_c/F_H)^p`, part of which may be
    /// given.
    fn units<V: Simd>(&self, tile: &mut Tile<'_>);

    #[inline(always)]
    fn limit<V: Simd>(&self, per_allowable: &PerContact<f64>, tile: &mut Tile<'_>) -> Option<Limit> {
        let len = tile.len();
        forces_at_stress(per_allowable, tile);
        {
            let (force, unit) = (&tile.scale[..len], &tile.work.unit[..len]);
            let (arm, pressed) = (&tile.torque.wave_generator[..len], &mut tile.work.pressed[..len]);
            for i in 0..len {
                let by_law = self.power::<V>(force[i] / if arm[i] > 0.0 { unit[i] } else { 1.0 });
                pressed[i] = if arm[i] > 0.0 { by_law } else { f64::INFINITY };
            }
        }
        if !turn_to_limit(tile) {
            return None;
        }
        let (pressed, unit, force) = (&tile.work.pressed[..len], &tile.work.unit[..len], &mut tile.scale[..len]);
        for i in 0..len {
            let by_law = self.inverse::<V>(pressed[i]);
            force[i] = if pressed[i] > 0.0 { unit[i] * by_law } else { 0.0 };
        }
        least_torque(per_allowable, tile)
    }

    #[inline(always)]
    fn share<V: Simd>(&self, torque_nmm: f64, has_gaps: bool, tile: &mut Tile<'_>) -> bool {
        if !has_gaps {
            self.share_in_proportion::<V>(torque_nmm, tile);
            true
        } else {
            self.share_beyond_gaps::<V>(torque_nmm, tile)
        }
    }

    /// Shares the load without gaps: the forces of all rotations are proportional.
    #[inline(always)]
    fn share_in_proportion<V: Simd>(&self, torque_nmm: f64, tile: &mut Tile<'_>) {
        for row in 0..tile.rows() {
            let at = tile.of_row(row);
            let (arm, unit) = (&tile.torque.wave_generator[at.clone()], &tile.work.unit[at.clone()]);
            let mut of_unit = 0.0;
            for i in 0..arm.len() {
                of_unit += arm[i] * unit[i];
            }
            let share = torque_nmm / of_unit;
            let rotation_rad = self.power::<V>(share);
            tile.row_rotation_rad[row] = rotation_rad;
            tile.row_stiffness[row] = torque_nmm / (Self::EXPONENT * rotation_rad);
            for (force, unit) in tile.scale[at].iter_mut().zip(unit) {
                *force = unit * share;
            }
        }
    }

    /// Newton's method from above, with the tangents of all forces.
    #[inline(always)]
    fn share_beyond_gaps<V: Simd>(&self, torque_nmm: f64, tile: &mut Tile<'_>) -> bool {
        let (rows, inverse) = (tile.rows(), 1.0 / Self::EXPONENT);
        for row in 0..rows {
            let at = tile.of_row(row);
            let (arm, unit) = (&tile.torque.wave_generator[at.clone()], &tile.work.unit[at.clone()]);
            let mut of_unit = 0.0;
            for i in 0..arm.len() {
                of_unit += arm[i] * unit[i];
            }
            let alone = self.power::<V>(torque_nmm / of_unit);
            let Some((last, excess)) = start_above(alone, |i| arm[i] * unit[i], &tile.work.closing[at]) else {
                return false;
            };
            (tile.work.row_last[row], tile.work.row_excess[row]) = (last, excess);
        }
        let mut is_last_round = false;
        for _ in 0..MAX_ROUNDS {
            self.tangents::<V>(tile);
            let mut is_done = true;
            for row in 0..rows {
                let (at, work) = (tile.of_row(row), &mut tile.work);
                let (slope, arm) = (&work.slope[at.clone()], &tile.torque.wave_generator[at.clone()]);
                let pressed = &work.pressed[at.clone()];
                let (mut torque, mut stiffness) = (0.0, 0.0);
                for i in 0..arm.len() {
                    let tangent = arm[i] * slope[i];
                    stiffness += tangent;
                    torque += if pressed[i] > 0.0 { tangent * pressed[i] } else { 0.0 };
                }
                let stiffness = inverse * stiffness;
                tile.row_stiffness[row] = stiffness;
                if is_last_round {
                    continue;
                }
                let off = torque - torque_nmm;
                let (last, step) = (work.row_last[row], off / stiffness);
                let excess = work.row_excess[row] - step;
                is_done &= step.abs() <= LAST_ROTATION_STEP * excess || off.abs() <= OPEN_TORQUE * torque_nmm;
                (work.row_last[row], work.row_excess[row]) = if excess > 0.0 {
                    (last, excess)
                } else {
                    is_done = false;
                    let carrying = last_below(&work.closing[at], last, excess);
                    (carrying, excess + (last - carrying))
                };
            }
            if is_last_round {
                for row in 0..rows {
                    tile.row_rotation_rad[row] = tile.work.row_last[row] + tile.work.row_excess[row];
                }
                let len = tile.len();
                let (pressed, slope) = (&tile.work.pressed[..len], &tile.work.slope[..len]);
                let force = &mut tile.scale[..len];
                for i in 0..len {
                    force[i] = if pressed[i] > 0.0 { pressed[i] * slope[i] } else { 0.0 };
                }
                return tile.row_rotation_rad[..rows].iter().all(|rotation| rotation.is_finite());
            }
            is_last_round = is_done;
        }
        false
    }

    /// Computes `F/(Δφ - θ)` of the loaded teeth, which is p times the slope.
    #[inline(always)]
    fn tangents<V: Simd>(&self, tile: &mut Tile<'_>) {
        press::<true>(tile);
        let len = tile.len();
        let (unit, pressed) = (&tile.work.unit[..len], &tile.work.pressed[..len]);
        let slope = &mut tile.work.slope[..len];
        for i in 0..len {
            let over_x = self.inverse_over_x::<V>(pressed[i]);
            slope[i] = if pressed[i] > 0.0 { unit[i] * over_x } else { 0.0 };
        }
    }
}

/// A linear law with gaps, or for flat-sided teeth, whose compliance is given.
pub(crate) struct Linear {
    pub(in crate::sweep::fast) compliance_mm_per_n: PerContact<f64>,
    pub(super) weights: Weights,
}

impl Power for Linear {
    const EXPONENT: f64 = 1.0;

    /// Needs no iteration.
    #[inline(always)]
    fn share_beyond_gaps<V: Simd>(&self, torque_nmm: f64, tile: &mut Tile<'_>) -> bool {
        share_linearly(torque_nmm, tile)
    }

    #[inline(always)]
    fn power<V: Simd>(&self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn inverse_over_x<V: Simd>(&self, _: f64) -> f64 {
        1.0
    }

    #[inline(always)]
    fn units<V: Simd>(&self, tile: &mut Tile<'_>) {
        let len = tile.len();
        let (unit, given) = (&mut tile.work.unit[..len], &tile.work.given[..len]);
        let (arm, ring) = (&tile.torque.wave_generator[..len], &tile.force.ring[..len]);
        let carrier = &tile.force.carrier[..len];
        let Self { compliance_mm_per_n: compliance, weights } = self;
        for i in 0..len {
            let along = 1.0 - weights.ring_decline * (carrier[i] * carrier[i]);
            let ring = if weights.ring_exponent > 0.0 { ring[i] * ring[i] } else { 1.0 };
            let of_ring = compliance.ring * along * ring;
            let of_carrier = (compliance.carrier + given[i]) * weights.carrier;
            let c = compliance.wave_generator + of_ring + of_carrier * (carrier[i] * carrier[i]);
            unit[i] = arm[i] / c;
        }
    }
}

/// Palmgren's law, `p = 9/10`.
pub(crate) struct Palmgren {
    pub(super) coefficient: f64,
    pub(super) weights: Weights,
}

/// Returns the number, or a tiny positive one if it is not positive: roots need positive arguments.
#[inline(always)]
pub(super) fn positive(x: f64) -> f64 {
    if x > NOTHING { x } else { NOTHING }
}

impl Power for Palmgren {
    const EXPONENT: f64 = PALMGREN_EXPONENT;

    #[inline(always)]
    fn power<V: Simd>(&self, x: f64) -> f64 {
        x * inverse_tenth_root::<V>(positive(x))
    }

    #[inline(always)]
    fn inverse_over_x<V: Simd>(&self, x: f64) -> f64 {
        ninth_root::<V>(positive(x))
    }

    /// Uses `F_K/F_H` to the power 1.9 by virtual work and -0.1 by projection, and `F_S/F_H` to the power 1.9.
    #[inline(always)]
    fn units<V: Simd>(&self, tile: &mut Tile<'_>) {
        let len = tile.len();
        let (unit, arm) = (&mut tile.work.unit[..len], &tile.torque.wave_generator[..len]);
        let (ring, carrier) = (&tile.force.ring[..len], &tile.force.carrier[..len]);
        let Self { coefficient, weights } = self;
        let of_carrier = coefficient * weights.carrier;
        for i in 0..len {
            let along = 1.0 - weights.ring_decline * (carrier[i] * carrier[i]);
            let squared = if weights.ring_exponent > 0.0 { ring[i] * ring[i] } else { 1.0 };
            let of_ring = coefficient * along * squared * inverse_tenth_root::<V>(ring[i]);
            let power = carrier[i] * carrier[i] * inverse_tenth_root::<V>(positive(carrier[i]));
            unit[i] = self.inverse::<V>(arm[i] / (coefficient + of_ring + of_carrier * power));
        }
    }
}

/// Hertz's law of balls. Its coefficient varies with the place, and c is given.
pub(crate) struct Hertz;

impl Power for Hertz {
    const EXPONENT: f64 = EllipticContact::EXPONENT;

    #[inline(always)]
    fn power<V: Simd>(&self, x: f64) -> f64 {
        let root = cube_root::<V>(x);
        root * root
    }

    #[inline(always)]
    fn inverse_over_x<V: Simd>(&self, x: f64) -> f64 {
        x.sqrt()
    }

    #[inline(always)]
    fn units<V: Simd>(&self, tile: &mut Tile<'_>) {
        let (len, work) = (tile.len(), &mut tile.work);
        let (arm, given) = (&tile.torque.wave_generator[..len], &work.given[..len]);
        let unit = &mut work.unit[..len];
        for i in 0..len {
            unit[i] = self.inverse::<V>(arm[i] / given[i]);
        }
    }
}

/// Newton's method that starts with all teeth carrying. With a linear law it ends when the set of carrying teeth is
/// constant.
#[inline(always)]
fn share_linearly(torque_nmm: f64, tile: &mut Tile<'_>) -> bool {
    for row in 0..tile.rows() {
        let (at, work) = (tile.of_row(row), &mut tile.work);
        let (arm, unit) = (&tile.torque.wave_generator[at.clone()], &work.unit[at.clone()]);
        let closing = &work.closing[at.clone()];
        let mut last = last_of(closing);
        let (stiffness, excess) = loop {
            let (mut stiffness, mut before) = (0.0, 0.0);
            for i in 0..arm.len() {
                let of_tooth = arm[i] * unit[i];
                stiffness += if closing[i] <= last { of_tooth } else { 0.0 };
                before += if closing[i] <= last { of_tooth * (last - closing[i]) } else { 0.0 };
            }
            let excess = (torque_nmm - before) / stiffness;
            if excess > 0.0 {
                break (stiffness, excess);
            }
            // The number falls each time: the last tooth is open.
            last = last_below(closing, last, excess);
            if !last.is_finite() || excess.is_nan() {
                return false;
            }
        };
        (work.row_last[row], work.row_excess[row]) = (last, excess);
        tile.row_rotation_rad[row] = last + excess;
        tile.row_stiffness[row] = stiffness;
        for (force, (unit, closing)) in tile.scale[at].iter_mut().zip(unit.iter().zip(closing)) {
            let pressed = excess + (last - closing);
            *force = if pressed > 0.0 { unit * pressed } else { 0.0 };
        }
    }
    true
}
