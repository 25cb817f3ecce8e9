//! Sharing among springs whose law has two parts, and no inverse in closed form.

use pulp::Simd;

use super::power_law::positive;
use super::{
    LAST_FORCE_STEP, Limit, MAX_ROUNDS, NOTHING, Weights, forces_at_stress, last_below, least_margin, least_torque,
    press, start_above, turn_to_limit,
};
use crate::contact::{Contact, PerContact};
use crate::contact_law::{LogarithmicTerm, PALMGREN_EXPONENT};
use crate::load_sharing::LoadedDrive;
use crate::sweep::fast::lanes::{LANES, inverse_tenth_root, largest, ln, ln_roughly};
use crate::sweep::fast::tile::Tile;

/// Substitute for the force limit of a flat, to which the limit of Johnson's law does not apply.
const NEVER_TOO_WIDE_N: f64 = 1e100;

/// A law without a closed form for both the forces and the rotation, in columns, with two coefficients for each tooth.
pub(crate) trait TwoParts {
    /// `-F d²ξ/dF²` over `ξ/F - dξ/dF`.
    const BEND: f64;

    /// Computes the coefficients of each tooth, with forces in units of `work.typical_n`, and the logarithm of the force
    /// at which the law ends.
    fn coefficients<V: Simd>(&self, tile: &mut Tile<'_>);

    /// Returns `dξ/dF` inside the law's range, and `ξ/F - dξ/dF`.
    fn slope_and_rest<V: Simd>(a: f64, b: f64, force: f64) -> [f64; 2];

    /// Returns `ξ/F` approximately.
    fn over_force_roughly<V: Simd>(a: f64, b: f64, force: f64) -> f64;

    /// Returns `ln F` if the law ends at some force.
    fn ln_of<V: Simd>(force: f64) -> f64;

    /// Computes the coefficients of each tooth, with forces in a typical unit, so that no logarithm is large.
    #[inline(always)]
    fn prepare<V: Simd>(&self, torque_nmm: f64, tile: &mut Tile<'_>) {
        tile.work.typical_n = torque_nmm / tile.torque.wave_generator[..tile.teeth].iter().sum::<f64>();
        self.coefficients::<V>(tile);
    }

    /// Computes an initial force for each tooth, and the matching rotation.
    #[inline(always)]
    fn start<V: Simd, const GAPS: bool>(torque: f64, tile: &mut Tile<'_>) -> bool {
        let (len, work) = (tile.len(), &mut tile.work);
        let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &tile.torque.wave_generator[..len]);
        // Assumes that all forces equal the typical one.
        let secant = &mut work.secant[..len];
        for i in 0..len {
            secant[i] = arm[i] / Self::over_force_roughly::<V>(a[i], b[i], 1.0);
        }
        for row in 0..tile.rows() {
            let (at, work) = (tile.of_row(row), &mut tile.work);
            let (arm, secant) = (&tile.torque.wave_generator[at.clone()], &work.secant[at.clone()]);
            let mut stiffness = 0.0;
            for i in 0..arm.len() {
                stiffness += arm[i] * secant[i];
            }
            let alone = torque / stiffness;
            (work.row_last[row], work.row_excess[row]) = if GAPS {
                let Some(start) = start_above(alone, |i| arm[i] * secant[i], &work.closing[at]) else { return false };
                start
            } else {
                (0.0, alone)
            };
        }
        press::<GAPS>(tile);
        Self::guess::<V>(tile);
        true
    }

    /// Estimates the forces from the displacements of the teeth.
    #[inline(always)]
    fn guess<V: Simd>(tile: &mut Tile<'_>) {
        let (len, work) = (tile.len(), &mut tile.work);
        let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &tile.torque.wave_generator[..len]);
        let pressed = &work.pressed[..len];
        let (excess, force) = (&work.excess[..len], &mut tile.scale[..len]);
        for i in 0..len {
            // An open tooth is treated as closed, because it may turn out to carry.
            let pressed = if pressed[i] > 0.0 { pressed[i] } else { excess[i] };
            let first = pressed * arm[i] / Self::over_force_roughly::<V>(a[i], b[i], 1.0);
            let second = pressed * arm[i] / Self::over_force_roughly::<V>(a[i], b[i], positive(first));
            force[i] = if second > NOTHING { second } else { NOTHING };
        }
    }

    /// Forces, and the limit, are in the unit of the previous load sharing.
    #[inline(always)]
    fn limit<V: Simd>(&self, per_allowable: &PerContact<f64>, tile: &mut Tile<'_>) -> Option<Limit> {
        forces_at_stress(per_allowable, tile);
        {
            let (len, work) = (tile.len(), &mut tile.work);
            let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &tile.torque.wave_generator[..len]);
            let (force, reach, pressed) = (&tile.scale[..len], &work.reach[..len], &mut work.pressed[..len]);
            let per_typical = 1.0 / work.typical_n;
            let least_margin = least_margin();
            for i in 0..len {
                let force = force[i] * per_typical;
                let [slope, rest] = Self::slope_and_rest::<V>(a[i], b[i], force);
                let approach = force * (slope + rest);
                // If the law ends first on a tooth, that tooth does not limit the torque, or the end of the law is
                // detected below.
                let is_within = arm[i] > 0.0 && reach[i] - Self::ln_of::<V>(force) > least_margin;
                pressed[i] = if is_within { approach / arm[i] } else { f64::INFINITY };
            }
        }
        if !turn_to_limit(tile) {
            return None;
        }
        Self::guess::<V>(tile);
        let mut is_done = false;
        for _ in 0..MAX_ROUNDS {
            Self::tangents::<V, true>(tile);
            is_done = Self::follow::<true>(tile);
            if is_done {
                break;
            }
        }
        let is_within = Self::cut_and_check(tile);
        least_torque(per_allowable, tile).filter(|_| is_done && is_within)
    }

    #[inline(always)]
    fn share<V: Simd>(&self, torque_nmm: f64, has_gaps: bool, tile: &mut Tile<'_>) -> bool {
        let torque = torque_nmm / tile.work.typical_n;
        if has_gaps { Self::share_with::<V, true>(torque, tile) } else { Self::share_with::<V, false>(torque, tile) }
    }

    /// Newton's method for all forces and the rotations together. Each force follows the tangent of its law, and the
    /// rotation is the one at which the tangents balance the torque. A round costs one logarithm or root for each
    /// state. Without gaps every tooth carries: compiled apart, it takes an eighth to a quarter less time.
    #[inline(always)]
    fn share_with<V: Simd, const GAPS: bool>(torque: f64, tile: &mut Tile<'_>) -> bool {
        if !Self::start::<V, GAPS>(torque, tile) {
            return false;
        }
        for _ in 0..MAX_ROUNDS {
            Self::tangents::<V, GAPS>(tile);
            let mut is_done = true;
            for row in 0..tile.rows() {
                let (at, work) = (tile.of_row(row), &mut tile.work);
                let (slope, offset) = (&work.slope[at.clone()], &work.offset[at.clone()]);
                let (arm, closing) = (&tile.torque.wave_generator[at.clone()], &work.closing[at]);
                let (mut stiffness, mut of_offset) = (0.0, 0.0);
                let last = work.row_last[row];
                for i in 0..arm.len() {
                    stiffness += arm[i] * slope[i];
                    let before = if GAPS && slope[i] > 0.0 { (last - closing[i]) * slope[i] } else { 0.0 };
                    of_offset += arm[i] * (offset[i] + before);
                }
                let excess = (torque - of_offset) / stiffness;
                work.row_excess[row] = excess;
                if GAPS && excess <= 0.0 {
                    is_done = false;
                    let carrying = last_below(closing, last, excess);
                    (work.row_last[row], work.row_excess[row]) = (carrying, excess + (last - carrying));
                }
            }
            is_done &= Self::follow::<GAPS>(tile);
            if is_done {
                return Self::finish(tile);
            }
        }
        false
    }

    /// Computes the tangents of all laws at the current forces.
    #[inline(always)]
    fn tangents<V: Simd, const GAPS: bool>(tile: &mut Tile<'_>) {
        let (len, work) = (tile.len(), &mut tile.work);
        let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &tile.torque.wave_generator[..len]);
        let (reach, pressed, force) = (&work.reach[..len], &work.pressed[..len], &tile.scale[..len]);
        let (slope, offset) = (&mut work.slope[..len], &mut work.offset[..len]);
        let (secant, margin) = (&mut work.secant[..len], &mut work.margin[..len]);
        for i in 0..len {
            let [beyond, rest] = Self::slope_and_rest::<V>(a[i], b[i], force[i]);
            let at_force = beyond + rest;
            let both = 1.0 / (at_force * beyond);
            let per_slope = both * at_force;
            let is_pressed = !GAPS || pressed[i] > 0.0;
            slope[i] = if is_pressed { arm[i] * per_slope } else { 0.0 };
            offset[i] = if is_pressed { -(rest * force[i]) * per_slope } else { 0.0 };
            secant[i] = both * beyond;
            margin[i] = reach[i] - Self::ln_of::<V>(force[i]);
        }
    }

    /// Updates the forces to the new rotations, and stores the former ones in place of the secants. Returns true if that
    /// was the last step.
    #[inline(always)]
    fn follow<const GAPS: bool>(tile: &mut Tile<'_>) -> bool {
        // A tooth that was pressed before has a slope.
        press::<GAPS>(tile);
        let (len, work) = (tile.len(), &mut tile.work);
        let (arm, pressed) = (&tile.torque.wave_generator[..len], &work.pressed[..len]);
        let (slope, offset) = (&work.slope[..len], &work.offset[..len]);
        let (secant, force) = (&mut work.secant[..len], &mut tile.scale[..len]);
        let mut beyond = [0.0; LANES];
        for start in (0..len).step_by(LANES) {
            for (lane, beyond) in beyond.iter_mut().enumerate() {
                let i = start + lane;
                let before = force[i];
                let by_tangent = offset[i] + slope[i] * pressed[i];
                // Far from the tangent's point its root may be meaningless; there the chord of the law is used.
                let by_chord = arm[i] * pressed[i] * secant[i];
                let next = if by_tangent > 0.5 * by_chord { by_tangent } else { by_chord };
                let next = if next > NOTHING { next } else { NOTHING };
                let is_pressed = !GAPS || pressed[i] > 0.0;
                let next = if is_pressed { next } else { before };
                let has_changed = GAPS && is_pressed != (slope[i] > 0.0) && arm[i] > 0.0;
                let step = (next - before).abs() - LAST_FORCE_STEP * before - f64::EPSILON * f64::EPSILON;
                let step = if has_changed { 1.0 } else { step };
                force[i] = next;
                secant[i] = before;
                *beyond = if step > *beyond || step.is_nan() { step } else { *beyond };
            }
        }
        beyond.iter().all(|&beyond| beyond <= 0.0)
    }

    /// Converts the forces to newtons, and the stiffnesses accordingly. Returns false if a contact is wider than the
    /// law allows.
    #[inline(always)]
    fn finish(tile: &mut Tile<'_>) -> bool {
        let (rows, len, work) = (tile.rows(), tile.len(), &mut tile.work);
        let (arm, force) = (&tile.torque.wave_generator[..len], &tile.scale[..len]);
        let (before, slope, change) = (&work.secant[..len], &work.slope[..len], &mut work.offset[..len]);
        // Change of the slopes along the last step.
        for i in 0..len {
            change[i] *= (force[i] - before[i]) / (before[i] * before[i]);
        }
        for row in 0..rows {
            let mut stiffness = 0.0;
            for i in row * tile.teeth..(row + 1) * tile.teeth {
                stiffness += arm[i] * slope[i] * (1.0 - Self::BEND * change[i]);
            }
            tile.row_rotation_rad[row] = work.row_last[row] + work.row_excess[row];
            tile.row_stiffness[row] = work.typical_n * stiffness;
        }
        let is_finite = tile.row_rotation_rad[..rows].iter().all(|rotation| rotation.is_finite());
        Self::cut_and_check(tile) && is_finite
    }

    /// Converts forces to newtons, zero for teeth that are not pressed. Returns true if all are within the law.
    #[inline(always)]
    fn cut_and_check(tile: &mut Tile<'_>) -> bool {
        let (len, work) = (tile.len(), &mut tile.work);
        let (arm, pressed) = (&tile.torque.wave_generator[..len], &work.pressed[..len]);
        let (margin, force) = (&mut work.margin[..len], &mut tile.scale[..len]);
        let (typical_n, least_margin) = (work.typical_n, least_margin());
        for i in 0..len {
            let carries = pressed[i] > 0.0 && arm[i] > 0.0;
            force[i] = if carries { typical_n * force[i] } else { 0.0 };
            margin[i] = if carries { least_margin - margin[i] } else { 0.0 };
        }
        largest(&margin[..tile.count]) <= 0.0
    }
}

/// `ξ = c F^0.9 + e F`: Palmgren's law with a linear compliance.
pub(crate) struct PalmgrenAndLinear {
    pub(super) coefficient: PerContact<f64>,
    pub(super) compliance: PerContact<f64>,
    pub(super) weights: Weights,
}

impl TwoParts for PalmgrenAndLinear {
    const BEND: f64 = PALMGREN_EXPONENT;

    /// `e` and `c`.
    #[inline(always)]
    fn coefficients<V: Simd>(&self, tile: &mut Tile<'_>) {
        let (len, work) = (tile.len(), &mut tile.work);
        let (ring, carrier) = (&tile.force.ring[..len], &tile.force.carrier[..len]);
        let (given, typical_n) = (&work.given[..len], work.typical_n);
        let (e, c, reach) = (&mut work.unit[..len], &mut work.growth[..len], &mut work.reach[..len]);
        let Self { coefficient, compliance, weights } = self;
        let typical = typical_n * inverse_tenth_root::<V>(typical_n);
        for i in 0..len {
            let along = 1.0 - weights.ring_decline * (carrier[i] * carrier[i]);
            let squared = if weights.ring_exponent > 0.0 { ring[i] * ring[i] } else { 1.0 };
            let (at_ring, at_carrier) = (along * squared, weights.carrier * (carrier[i] * carrier[i]));
            let of_ring = coefficient.ring * at_ring * inverse_tenth_root::<V>(ring[i]);
            let of_carrier = coefficient.carrier * at_carrier * inverse_tenth_root::<V>(positive(carrier[i]));
            c[i] = typical * (coefficient.wave_generator + of_ring + of_carrier);
            let of_carrier = at_carrier * (compliance.carrier + given[i]);
            e[i] = typical_n * (compliance.wave_generator + at_ring * compliance.ring + of_carrier);
            reach[i] = f64::INFINITY;
        }
    }

    #[inline(always)]
    fn slope_and_rest<V: Simd>(e: f64, c: f64, force: f64) -> [f64; 2] {
        let power = c * inverse_tenth_root::<V>(force);
        [e + PALMGREN_EXPONENT * power, (1.0 - PALMGREN_EXPONENT) * power]
    }

    #[inline(always)]
    fn over_force_roughly<V: Simd>(e: f64, c: f64, force: f64) -> f64 {
        e + c * inverse_tenth_root::<V>(force)
    }

    #[inline(always)]
    fn ln_of<V: Simd>(_: f64) -> f64 {
        0.0
    }
}

/// `ξ = F (A - B ln F)`, Johnson's law, by virtual work.
pub(crate) struct Logarithm {
    /// `A` of each contact, including the series compliance.
    compliance: PerContact<f64>,
    /// `B` of each contact.
    growth: PerContact<f64>,
    /// Force at which half a contact's width is the reference length of the law. At wave generator and ring it is
    /// divided by the square of the stress under 1 N, without the ratio of forces. At the carrier it is the force
    /// itself.
    reference: PerContact<f64>,
}

impl Logarithm {
    pub(super) fn new(
        loaded: &LoadedDrive<'_>,
        law: &PerContact<LogarithmicTerm>,
        series_mm_per_n: &PerContact<f64>,
    ) -> Self {
        let reference = |contact| {
            let LogarithmicTerm { growth_mm_per_n, length_mm, .. } = *law.get(contact);
            let of_curvature = length_mm * length_mm / (4.0 * growth_mm_per_n);
            match contact {
                // σ² = F Σ E*/(π L1), F = 1 at the wave generator and F_K/F_H at the ring.
                Contact::WaveGenerator | Contact::Ring => {
                    of_curvature / loaded.contacts.hertz.get(contact).modulus_per_width_mpa_per_mm
                }
                Contact::Carrier if growth_mm_per_n > 0.0 => of_curvature / loaded.drive().parameters().tooth_radius_mm,
                Contact::Carrier => NEVER_TOO_WIDE_N,
            }
        };
        Self {
            compliance: PerContact::of(|contact| law.get(contact).compliance_mm_per_n + series_mm_per_n.get(contact)),
            growth: PerContact::of(|contact| law.get(contact).growth_mm_per_n),
            reference: PerContact::of(reference),
        }
    }
}

impl TwoParts for Logarithm {
    const BEND: f64 = 1.0;

    /// `A` and `B`.
    #[inline(always)]
    fn coefficients<V: Simd>(&self, tile: &mut Tile<'_>) {
        let (len, work) = (tile.len(), &mut tile.work);
        let (ring, carrier) = (&tile.force.ring[..len], &tile.force.carrier[..len]);
        let (cam_stress, ring_stress) = (&tile.stress.wave_generator[..len], &tile.stress.ring[..len]);
        let (given, typical_n) = (&work.given[..len], work.typical_n);
        let (a, b, reach) = (&mut work.unit[..len], &mut work.growth[..len], &mut work.reach[..len]);
        let compliance = PerContact::of(|contact| typical_n * self.compliance.get(contact));
        let growth = PerContact::of(|contact| typical_n * self.growth.get(contact));
        let reference = PerContact::of(|contact| self.reference.get(contact) / typical_n);
        let per_carrier_reference = 1.0 / reference.carrier;
        for i in 0..len {
            let ring_stress = ring_stress[i] / ring[i];
            let carrier_ratio = if carrier[i] > NOTHING { carrier[i] } else { NOTHING };
            let of_cam = ln::<V>(reference.wave_generator * (cam_stress[i] * cam_stress[i]));
            let of_ring = ln::<V>(reference.ring * (ring_stress * ring_stress));
            let of_carrier = -ln::<V>(per_carrier_reference * carrier_ratio);
            let (ring2, carrier2) = (ring[i] * ring[i], carrier[i] * carrier[i]);
            a[i] = (compliance.wave_generator + growth.wave_generator * of_cam)
                + ring2 * (compliance.ring + growth.ring * of_ring)
                + carrier2 * (compliance.carrier + growth.carrier * of_carrier + typical_n * given[i]);
            b[i] = growth.wave_generator + ring2 * growth.ring + carrier2 * growth.carrier;
            let least = if of_ring < of_cam { of_ring } else { of_cam };
            reach[i] = if of_carrier < least { of_carrier } else { least };
        }
    }

    /// In its range the law's slope is more than a fifth of `B`.
    #[inline(always)]
    fn slope_and_rest<V: Simd>(a: f64, b: f64, force: f64) -> [f64; 2] {
        let (beyond, least) = (a - b * ln::<V>(force) - b, 0.2 * b);
        [if beyond > least { beyond } else { least }, b]
    }

    #[inline(always)]
    fn over_force_roughly<V: Simd>(a: f64, b: f64, force: f64) -> f64 {
        let (over_force, least) = (a - b * ln_roughly(force), 0.5 * b);
        if over_force > least { over_force } else { least }
    }

    #[inline(always)]
    fn ln_of<V: Simd>(force: f64) -> f64 {
        ln::<V>(force)
    }
}
