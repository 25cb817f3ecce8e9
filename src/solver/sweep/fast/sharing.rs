//! Load sharing among the teeth at an input angle, for a tile of input angles together (docs/explanation/theory.md
//! section 9, *Fast path*).
//!
//! The springs are those of [`crate::springs`], in columns. With gaps every search approaches the rotation from above.
//! Each force is convex in the rotation, so the sum of all tangents never exceeds the springs' torque. Its root is at
//! or beyond the true one. A tooth that is open there is open at the true rotation too.

use pulp::Simd;

use super::lanes::{LANES, cube_root, inverse_tenth_root, largest, ln, ln_roughly, ninth_root, repeat_each};
use crate::contact::{Contact, PerContact};
use crate::load_sharing::{Compatibility, LoadedDrive};
use crate::tooth::StressExponents;
use crate::tooth::line::{JohnsonLine, WIDEST_SHARE};
use crate::tooth::point::EllipticContact;
use crate::tooth::{PALMGREN_EXPONENT, ToothLaw};

/// Largest number of rounds of a search. A tile that needs more uses the plain path.
const MAX_ROUNDS: u32 = 60;

/// A relative step this small of a force under Johnson's law is the last: the next would be proportional to its square.
const LAST_FORCE_STEP: f64 = 3e-8;

/// The same for the rotation under a power law, and the relative error of the torque due to rounding.
const LAST_ROTATION_STEP: f64 = 1e-9;
const OPEN_TORQUE: f64 = 8.0 * f64::EPSILON;

/// Replaces zero where a logarithm is needed. No contact has a ratio or a force this small.
const NOTHING: f64 = 1e-150;

/// Substitute for the force limit of a flat, to which the limit of Johnson's law does not apply.
const NEVER_TOO_WIDE_N: f64 = 1e100;

/// Teeth of a tile under 1 N at the wave generator, by input angle and then tooth.
pub(super) struct Teeth<'a> {
    /// Number of teeth at an input angle.
    pub(super) count: usize,
    /// Number of input angles.
    pub(super) rows: usize,
    /// Number of states, including those that fill the last chunk.
    pub(super) len: usize,
    /// `d`.
    pub(super) center_radius_mm: &'a [f64],
    /// `|h'|`.
    pub(super) arm: &'a [f64],
    /// `F_K/F_H`.
    pub(super) ring_ratio: &'a [f64],
    /// `F_S/F_H`.
    pub(super) carrier_ratio: &'a [f64],
    /// Stress at the wave generator.
    pub(super) cam_stress: &'a [f64],
    /// Stress at the ring.
    pub(super) ring_stress: &'a [f64],
    /// Stress at the carrier.
    pub(super) carrier_stress: &'a [f64],
    /// Powers of the stresses to which forces are proportional.
    pub(super) stress_exponents: StressExponents,
}

/// Least torque of a tile under which a contact reaches a stress.
pub(super) struct Limit {
    /// Torque of one zone.
    pub(super) torque_nmm: f64,
    /// The contact that reaches it.
    pub(super) contact: Contact,
    /// Input angle in the tile.
    pub(super) row: usize,
}

/// Result of load sharing.
pub(super) struct Shared<'a> {
    /// `F_H`, by state.
    pub(super) force: &'a mut [f64],
    /// `Δφ`, by input angle.
    pub(super) rotation_rad: &'a mut [f64],
    /// `dM0/dΔφ` of one zone, by input angle.
    pub(super) stiffness: &'a mut [f64],
}

/// Working columns.
pub(super) struct Work<'a> {
    /// Place-dependent part of each tooth's law: c of balls, the compliance of a flat.
    pub(super) given: &'a mut [f64],
    /// Power law: force at the rotation 1. Johnson's law: `A`. Power with a linear part: that part.
    unit: &'a mut [f64],
    /// Johnson's law: `B`. Otherwise the coefficient of the power.
    growth: &'a mut [f64],
    /// Rotation at which the gaps of a tooth are closed.
    pub(super) closing: &'a mut [f64],
    /// Rotation beyond that; zero or negative if a gap is open.
    pressed: &'a mut [f64],
    /// `dF_H/dΔφ` of the tangent.
    slope: &'a mut [f64],
    /// Ordinate of the tangent, for a tooth that is not pressed.
    offset: &'a mut [f64],
    /// `F_H` over the approach along `F_H`.
    secant: &'a mut [f64],
    /// Logarithm of the force at which Johnson's law ends.
    reach: &'a mut [f64],
    /// The same relative to the force.
    margin: &'a mut [f64],
    /// Rotation beyond `last`, by state.
    excess: &'a mut [f64],
    /// Reference closing angle of `excess`, by state: that of the last tooth that carries, so that light loads keep
    /// their digits.
    last: &'a mut [f64],
    /// `F_H` under a limit.
    limit: &'a mut [f64],
    row_excess: &'a mut [f64],
    row_last: &'a mut [f64],
    /// Torque of one zone under which a contact reaches its limit, by input angle.
    row_limit: &'a mut [f64],
    /// Unit of the forces under Johnson's law.
    typical_n: f64,
}

impl<'a> Work<'a> {
    /// Number of columns of states.
    pub(super) const COLUMNS: usize = 13;
    /// Number of columns of input angles.
    pub(super) const ROWS: usize = 3;

    /// Builds the columns from slices of any length.
    pub(super) fn new(slice: &mut impl FnMut(usize) -> &'a mut [f64], column: usize, rows: usize) -> Self {
        Self {
            given: slice(column),
            unit: slice(column),
            growth: slice(column),
            closing: slice(column),
            pressed: slice(column),
            slope: slice(column),
            offset: slice(column),
            secant: slice(column),
            reach: slice(column),
            margin: slice(column),
            excess: slice(column),
            last: slice(column),
            limit: slice(column),
            row_excess: slice(rows),
            row_last: slice(rows),
            row_limit: slice(rows),
            typical_n: 1.0,
        }
    }

    /// Returns the rotation of each tooth at an input angle beyond its closing angle, after load sharing with gaps. It
    /// is negative if a gap is open.
    pub(super) fn pressed_rad(&self, row: usize, count: usize) -> impl Iterator<Item = f64> {
        let (last, excess) = (self.row_last[row], self.row_excess[row]);
        self.closing[row * count..(row + 1) * count].iter().map(move |closing| excess + (last - closing))
    }

    /// Returns the result of the last search for a limit, by input angle: the torque of one zone.
    pub(super) const fn limits_nmm(&self) -> &[f64] {
        self.row_limit
    }
}

/// Contribution of each contact's approach along `F_H` ([`Compatibility`]): 1 at the wave generator,
/// `along_ring (F_K/F_H)^±1` at the ring, `carrier F_S/F_H` at the carrier.
#[derive(Clone, Copy)]
pub(super) struct Weights {
    pub(super) ring_exponent: f64,
    /// Factor in `along_ring = 1 - this (F_S/F_H)²`.
    pub(super) ring_decline: f64,
    pub(super) carrier: f64,
}

impl Weights {
    pub(super) fn new(loaded: &LoadedDrive<'_>) -> Self {
        match loaded.compatibility() {
            Compatibility::VirtualWork => Self { ring_exponent: 1.0, ring_decline: 0.0, carrier: 1.0 },
            // cos(γ + sβ) and s sin γ, with sin γ = F_S/F_H over Z_G/U.
            Compatibility::Projection => {
                let drive = loaded.drive();
                let (s, ratio) = (drive.sense(), drive.teeth_per_wave());
                let ring_decline = (1.0 + s * drive.flank().teeth_per_wave()) / (ratio * ratio);
                Self { ring_exponent: -1.0, ring_decline, carrier: s / ratio }
            }
        }
    }
}

/// Returns the closing angle of the last tooth that carries at a rotation, which is given relative to another.
#[inline(always)]
fn last_below(closing: &[f64], from_last: f64, excess: f64) -> f64 {
    closing.iter().fold(
        f64::NEG_INFINITY,
        |last, &closing| {
            if closing - from_last < excess && closing > last { closing } else { last }
        },
    )
}

/// Returns the last of the finite closing angles.
#[inline(always)]
fn last_of(closing: &[f64]) -> f64 {
    last_below(closing, 0.0, f64::INFINITY)
}

/// Returns the rotation of all springs if each kept its present weight: an initial value, above the true one if the
/// weights are those of tangents. It has two parts, the first of which is a closing angle.
#[inline(always)]
fn start_above(excess_alone: f64, weight: impl Fn(usize) -> f64, closing: &[f64]) -> Option<(f64, f64)> {
    let last = last_of(closing);
    let (mut sum, mut before) = (0.0, 0.0);
    for (i, &closing) in closing.iter().enumerate() {
        if closing <= last {
            sum += weight(i);
            before += weight(i) * (last - closing);
        }
    }
    let excess = excess_alone - before / sum;
    let carrying = last_below(closing, last, excess);
    carrying.is_finite().then_some((carrying, excess + (last - carrying)))
}

/// Computes the rotation of each tooth beyond closure at the rotation of its row.
#[inline(always)]
fn press<const GAPS: bool>(teeth: &Teeth<'_>, work: &mut Work<'_>) {
    let rows = teeth.rows;
    repeat_each(&work.row_excess[..rows], teeth.count, work.excess);
    let len = teeth.len;
    let (excess, pressed) = (&work.excess[..len], &mut work.pressed[..len]);
    if GAPS {
        repeat_each(&work.row_last[..rows], teeth.count, work.last);
        let (last, closing) = (&work.last[..len], &work.closing[..len]);
        for i in 0..len {
            pressed[i] = excess[i] + (last[i] - closing[i]);
        }
    } else {
        pressed.copy_from_slice(excess);
    }
}

/// Computes the force at which the first contact of each tooth reaches its allowable stress: `(σ_a/σ)²` for line
/// contacts.
#[inline(always)]
fn forces_at_stress(per_allowable: &PerContact<f64>, teeth: &Teeth<'_>, force: &mut [f64]) {
    let len = teeth.len;
    let exponents = teeth.stress_exponents;
    let (cam, ring) = (&teeth.cam_stress[..len], &teeth.ring_stress[..len]);
    let (carrier, force) = (&teeth.carrier_stress[..len], &mut force[..len]);
    for i in 0..len {
        let (cam, ring) = (cam[i] * per_allowable.wave_generator, ring[i] * per_allowable.ring);
        let carrier = carrier[i] * per_allowable.carrier;
        let most = if ring > cam { ring } else { cam };
        if exponents.are_alike() {
            let most = if carrier > most { carrier } else { most };
            force[i] = exponents.raised(1.0 / most);
        } else {
            let (at_lines, at_flat) = (exponents.raised(1.0 / most), 1.0 / carrier);
            force[i] = if at_flat < at_lines { at_flat } else { at_lines };
        }
    }
}

/// Rotates each row until its first tooth reaches its limit, which is in `work.pressed`. Returns false if a row has no
/// limit.
#[inline(always)]
fn turn_to_limit(teeth: &Teeth<'_>, work: &mut Work<'_>) -> bool {
    for row in 0..teeth.rows {
        let at = row * teeth.count..(row + 1) * teeth.count;
        let (closing, pressed) = (&work.closing[at.clone()], &work.pressed[at]);
        let earliest = closing.iter().fold(f64::INFINITY, |earliest, &closing| earliest.min(closing));
        let mut least = f64::INFINITY;
        for (&closing, &pressed) in closing.iter().zip(pressed) {
            let from_earliest = pressed + (closing - earliest);
            if from_earliest < least {
                least = from_earliest;
                (work.row_last[row], work.row_excess[row]) = (closing, pressed);
            }
        }
        if least.is_infinite() {
            return false;
        }
    }
    press::<true>(teeth, work);
    true
}

/// Returns the least torque of the rows, each at its limit, under these forces.
#[inline(always)]
fn least_torque(
    per_allowable: &PerContact<f64>,
    teeth: &Teeth<'_>,
    work: &mut Work<'_>,
    force: &[f64],
) -> Option<Limit> {
    // Share of 1 N in the force at the allowable stress.
    let shares = |i: usize| {
        let exponents = teeth.stress_exponents;
        PerContact {
            wave_generator: exponents.raised(teeth.cam_stress[i] * per_allowable.wave_generator),
            ring: exponents.raised(teeth.ring_stress[i] * per_allowable.ring),
            carrier: exponents.raised_at(Contact::Carrier, teeth.carrier_stress[i] * per_allowable.carrier),
        }
    };
    let mut least: Option<Limit> = None;
    for row in 0..teeth.rows {
        let at = row * teeth.count..(row + 1) * teeth.count;
        let mut torque_nmm = 0.0;
        for i in at.clone() {
            torque_nmm += if work.pressed[i] > 0.0 { teeth.arm[i] * force[i] } else { 0.0 };
        }
        work.row_limit[row] = torque_nmm;
        if least.as_ref().is_none_or(|least| torque_nmm < least.torque_nmm) {
            let share = |&i: &usize| {
                let PerContact { wave_generator, ring, carrier } = shares(i);
                wave_generator.max(ring).max(carrier) * if work.pressed[i] > 0.0 { force[i] } else { 0.0 }
            };
            let at_limit = at.clone().max_by(|one, other| share(one).total_cmp(&share(other)))?;
            let PerContact { wave_generator, ring, carrier } = shares(at_limit);
            let contact = if carrier > wave_generator.max(ring) {
                Contact::Carrier
            } else if ring > wave_generator {
                Contact::Ring
            } else {
                Contact::WaveGenerator
            };
            least = Some(Limit { torque_nmm, contact, row });
        }
    }
    least.filter(|least| least.torque_nmm.is_finite())
}

/// Power law `ξ = c F^p`.
pub(super) struct PowerLaw<P> {
    power: P,
    has_gaps: bool,
}

/// Operations of a power law on a column.
pub(super) trait Power {
    /// True if p is 1.
    const IS_LINEAR: bool;

    /// `p`.
    fn exponent(&self) -> f64;

    /// `x^p`, x not negative.
    fn power<V: Simd>(&self, x: f64) -> f64;

    /// `x^(1/p)`.
    fn inverse<V: Simd>(&self, x: f64) -> f64;

    /// `x^(1/p - 1)`.
    fn inverse_over_x<V: Simd>(&self, x: f64) -> f64;

    /// Computes the force at the rotation 1, `(|h'|/c)^(1/p)`, with `c = Σ w q (F_c/F_H)^p`, part of which may be
    /// given.
    fn units<V: Simd>(&self, teeth: &Teeth<'_>, given: &[f64], unit: &mut [f64]);
}

/// A linear law with gaps, or for flat-sided teeth, whose compliance is given.
pub(super) struct Linear {
    compliance_mm_per_n: PerContact<f64>,
    weights: Weights,
}

impl Power for Linear {
    const IS_LINEAR: bool = true;

    #[inline(always)]
    fn exponent(&self) -> f64 {
        1.0
    }

    #[inline(always)]
    fn power<V: Simd>(&self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn inverse<V: Simd>(&self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn inverse_over_x<V: Simd>(&self, _: f64) -> f64 {
        1.0
    }

    #[inline(always)]
    fn units<V: Simd>(&self, teeth: &Teeth<'_>, given: &[f64], unit: &mut [f64]) {
        let len = teeth.len;
        let (unit, given) = (&mut unit[..len], &given[..len]);
        let (arm, ring, carrier) = (&teeth.arm[..len], &teeth.ring_ratio[..len], &teeth.carrier_ratio[..len]);
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
pub(super) struct Palmgren {
    coefficient: f64,
    weights: Weights,
}

/// Returns the number, or a tiny positive one if it is not positive: roots need positive arguments.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x > NOTHING { x } else { NOTHING }
}

impl Power for Palmgren {
    const IS_LINEAR: bool = false;

    #[inline(always)]
    fn exponent(&self) -> f64 {
        PALMGREN_EXPONENT
    }

    #[inline(always)]
    fn power<V: Simd>(&self, x: f64) -> f64 {
        x * inverse_tenth_root::<V>(positive(x))
    }

    #[inline(always)]
    fn inverse<V: Simd>(&self, x: f64) -> f64 {
        x * ninth_root::<V>(positive(x))
    }

    #[inline(always)]
    fn inverse_over_x<V: Simd>(&self, x: f64) -> f64 {
        ninth_root::<V>(positive(x))
    }

    /// Uses `F_K/F_H` to the power 1.9 by virtual work and -0.1 by projection, and `F_S/F_H` to the power 1.9.
    #[inline(always)]
    fn units<V: Simd>(&self, teeth: &Teeth<'_>, _: &[f64], unit: &mut [f64]) {
        let len = teeth.len;
        let unit = &mut unit[..len];
        let (arm, ring, carrier) = (&teeth.arm[..len], &teeth.ring_ratio[..len], &teeth.carrier_ratio[..len]);
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
pub(super) struct Hertz;

impl Power for Hertz {
    const IS_LINEAR: bool = false;

    #[inline(always)]
    fn exponent(&self) -> f64 {
        EllipticContact::EXPONENT
    }

    #[inline(always)]
    fn power<V: Simd>(&self, x: f64) -> f64 {
        let root = cube_root::<V>(x);
        root * root
    }

    #[inline(always)]
    fn inverse<V: Simd>(&self, x: f64) -> f64 {
        x * x.sqrt()
    }

    #[inline(always)]
    fn inverse_over_x<V: Simd>(&self, x: f64) -> f64 {
        x.sqrt()
    }

    #[inline(always)]
    fn units<V: Simd>(&self, teeth: &Teeth<'_>, given: &[f64], unit: &mut [f64]) {
        let len = teeth.len;
        let (arm, given, unit) = (&teeth.arm[..len], &given[..len], &mut unit[..len]);
        for i in 0..len {
            unit[i] = self.inverse::<V>(arm[i] / given[i]);
        }
    }
}

/// A law without a closed form for both the forces and the rotation.
pub(super) struct NoPowerLaw<L> {
    law: L,
    has_gaps: bool,
}

/// Operations of such a law on a column, with two coefficients for each tooth.
pub(super) trait TwoParts {
    /// `-F d²ξ/dF²` over `ξ/F - dξ/dF`.
    const BEND: f64;

    /// Computes the coefficients of each tooth, with forces in units of `typical_n`, and the logarithm of the force at
    /// which the law ends.
    fn coefficients<V: Simd>(&self, typical_n: f64, teeth: &Teeth<'_>, work: &mut Work<'_>);

    /// Returns `dξ/dF` inside the law's range, and `ξ/F - dξ/dF`.
    fn slope_and_rest<V: Simd>(a: f64, b: f64, force: f64) -> [f64; 2];

    /// Returns `ξ/F` approximately.
    fn over_force_roughly<V: Simd>(a: f64, b: f64, force: f64) -> f64;

    /// Returns `ln F` if the law ends at some force.
    fn ln_of<V: Simd>(force: f64) -> f64;
}

/// `ξ = c F^0.9 + e F`: Palmgren's law with a linear compliance.
pub(super) struct PalmgrenAndLinear {
    coefficient: PerContact<f64>,
    compliance: PerContact<f64>,
    weights: Weights,
}

impl TwoParts for PalmgrenAndLinear {
    const BEND: f64 = PALMGREN_EXPONENT;

    /// `e` and `c`.
    #[inline(always)]
    fn coefficients<V: Simd>(&self, typical_n: f64, teeth: &Teeth<'_>, work: &mut Work<'_>) {
        let len = teeth.len;
        let (ring, carrier) = (&teeth.ring_ratio[..len], &teeth.carrier_ratio[..len]);
        let given = &work.given[..len];
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
pub(super) struct Logarithm {
    /// `A` of each contact, including the series compliance.
    compliance: PerContact<f64>,
    /// `B` of each contact.
    growth: PerContact<f64>,
    /// Force at which half a contact's width is the reference length of the law. At wave generator and ring it is
    /// divided by the square of the stress under 1 N, without the ratio of forces. At the carrier it is the force
    /// itself.
    reference: PerContact<f64>,
}

/// Conversion of unit loads to loads.
pub(super) enum Sharing {
    Linear(PowerLaw<Linear>),
    Palmgren(PowerLaw<Palmgren>),
    Hertz(PowerLaw<Hertz>),
    PalmgrenAndLinear(NoPowerLaw<PalmgrenAndLinear>),
    Logarithmic(NoPowerLaw<Logarithm>),
}

impl Sharing {
    /// Returns the method of a drive under a load; none if its law has no columns.
    pub(super) fn new(loaded: &LoadedDrive<'_>) -> Option<Self> {
        let weights = Weights::new(loaded);
        let has_gaps = !loaded.gaps().is_nil();
        Some(match loaded.tooth_law()? {
            ToothLaw::Linear { compliance_mm_per_n } => {
                Self::Linear(PowerLaw { power: Linear { compliance_mm_per_n, weights }, has_gaps })
            }
            ToothLaw::Palmgren { coefficient } => {
                Self::Palmgren(PowerLaw { power: Palmgren { coefficient, weights }, has_gaps })
            }
            ToothLaw::PalmgrenAndLinear { coefficient, compliance_mm_per_n: compliance } => {
                let law = PalmgrenAndLinear { coefficient, compliance, weights };
                Self::PalmgrenAndLinear(NoPowerLaw { law, has_gaps })
            }
            ToothLaw::Hertz => Self::Hertz(PowerLaw { power: Hertz, has_gaps }),
            ToothLaw::Johnson { law, series_compliance_mm_per_n: series } => {
                let tooth_radius_mm = loaded.drive().parameters().tooth_radius_mm;
                let reference = |contact| {
                    let JohnsonLine { growth_mm_per_n, length_mm, .. } = *law.get(contact);
                    let of_curvature = length_mm * length_mm / (4.0 * growth_mm_per_n);
                    match contact {
                        // σ² = F Σ E*/(π L1), F = 1 at the wave generator and F_K/F_H at the ring.
                        Contact::WaveGenerator | Contact::Ring => {
                            of_curvature / loaded.hertz(contact).modulus_per_width_mpa_per_mm()
                        }
                        Contact::Carrier if growth_mm_per_n > 0.0 => of_curvature / tooth_radius_mm,
                        Contact::Carrier => NEVER_TOO_WIDE_N,
                    }
                };
                let law = Logarithm {
                    compliance: PerContact::of(|contact| law.get(contact).compliance_mm_per_n + series.get(contact)),
                    growth: PerContact::of(|contact| law.get(contact).growth_mm_per_n),
                    reference: PerContact::of(reference),
                };
                Self::Logarithmic(NoPowerLaw { law, has_gaps })
            }
        })
    }

    /// Computes the place-dependent part of the law, independent of the gaps.
    #[inline(always)]
    pub(super) fn prepare<V: Simd>(&self, torque_nmm: f64, teeth: &Teeth<'_>, work: &mut Work<'_>) {
        match self {
            Self::Linear(law) => law.power.units::<V>(teeth, work.given, work.unit),
            Self::Palmgren(law) => law.power.units::<V>(teeth, work.given, work.unit),
            Self::Hertz(law) => law.power.units::<V>(teeth, work.given, work.unit),
            Self::PalmgrenAndLinear(law) => law.prepare::<V>(torque_nmm, teeth, work),
            Self::Logarithmic(law) => law.prepare::<V>(torque_nmm, teeth, work),
        }
    }

    /// Computes the forces that balance the torque of one zone, with the closing angles in `work`. Returns false if
    /// they are not found or the law ends.
    #[inline(always)]
    pub(super) fn share<V: Simd>(
        &self,
        torque_nmm: f64,
        teeth: &Teeth<'_>,
        work: &mut Work<'_>,
        shared: &mut Shared<'_>,
    ) -> bool {
        match self {
            Self::Linear(law) => law.share::<V>(torque_nmm, teeth, work, shared),
            Self::Palmgren(law) => law.share::<V>(torque_nmm, teeth, work, shared),
            Self::Hertz(law) => law.share::<V>(torque_nmm, teeth, work, shared),
            Self::PalmgrenAndLinear(law) => law.share::<V>(torque_nmm, teeth, work, shared),
            Self::Logarithmic(law) => law.share::<V>(torque_nmm, teeth, work, shared),
        }
    }
}

impl Sharing {
    /// Returns true if teeth begin and cease to carry between their entry and their exit.
    pub(super) const fn has_gaps(&self) -> bool {
        match self {
            Self::Linear(law) => law.has_gaps,
            Self::Palmgren(law) => law.has_gaps,
            Self::Hertz(law) => law.has_gaps,
            Self::PalmgrenAndLinear(law) => law.has_gaps,
            Self::Logarithmic(law) => law.has_gaps,
        }
    }

    /// Returns true if forces are proportional to displacements.
    pub(super) const fn is_linear(&self) -> bool {
        matches!(self, Self::Linear(_))
    }

    /// Returns true if all loads are proportional, whatever the torque.
    pub(super) const fn is_in_proportion(&self) -> bool {
        !matches!(self, Self::PalmgrenAndLinear(_) | Self::Logarithmic(_)) && !self.has_gaps()
    }

    /// Returns the least torque of one zone in the tile under which a contact reaches a stress, after load sharing.
    /// Returns none if it is not found or the law ends before.
    #[inline(always)]
    pub(super) fn limit<V: Simd>(
        &self,
        per_allowable: &PerContact<f64>,
        teeth: &Teeth<'_>,
        work: &mut Work<'_>,
    ) -> Option<Limit> {
        match self {
            Self::Linear(law) => law.limit::<V>(per_allowable, teeth, work),
            Self::Palmgren(law) => law.limit::<V>(per_allowable, teeth, work),
            Self::Hertz(law) => law.limit::<V>(per_allowable, teeth, work),
            Self::PalmgrenAndLinear(law) => law.limit::<V>(per_allowable, teeth, work),
            Self::Logarithmic(law) => law.limit::<V>(per_allowable, teeth, work),
        }
    }
}

impl<P: Power> PowerLaw<P> {
    #[inline(always)]
    fn limit<V: Simd>(&self, per_allowable: &PerContact<f64>, teeth: &Teeth<'_>, work: &mut Work<'_>) -> Option<Limit> {
        let len = teeth.len;
        forces_at_stress(per_allowable, teeth, work.limit);
        {
            let (force, unit, arm) = (&work.limit[..len], &work.unit[..len], &teeth.arm[..len]);
            let pressed = &mut work.pressed[..len];
            for i in 0..len {
                let by_law = self.power.power::<V>(force[i] / if arm[i] > 0.0 { unit[i] } else { 1.0 });
                pressed[i] = if arm[i] > 0.0 { by_law } else { f64::INFINITY };
            }
        }
        if !turn_to_limit(teeth, work) {
            return None;
        }
        let limit = std::mem::take(&mut work.limit);
        let (pressed, unit, force) = (&work.pressed[..len], &work.unit[..len], &mut limit[..len]);
        for i in 0..len {
            let by_law = self.power.inverse::<V>(pressed[i]);
            force[i] = if pressed[i] > 0.0 { unit[i] * by_law } else { 0.0 };
        }
        let least = least_torque(per_allowable, teeth, work, limit);
        work.limit = limit;
        least
    }

    #[inline(always)]
    fn share<V: Simd>(&self, torque_nmm: f64, teeth: &Teeth<'_>, work: &mut Work<'_>, shared: &mut Shared<'_>) -> bool {
        if !self.has_gaps {
            self.share_in_proportion::<V>(torque_nmm, teeth, work, shared);
            true
        } else if P::IS_LINEAR {
            share_linearly(torque_nmm, teeth, work, shared)
        } else {
            self.share_beyond_gaps::<V>(torque_nmm, teeth, work, shared)
        }
    }

    /// Shares the load without gaps: the forces of all rotations are proportional.
    #[inline(always)]
    fn share_in_proportion<V: Simd>(
        &self,
        torque_nmm: f64,
        teeth: &Teeth<'_>,
        work: &Work<'_>,
        shared: &mut Shared<'_>,
    ) {
        for row in 0..teeth.rows {
            let at = row * teeth.count..(row + 1) * teeth.count;
            let (arm, unit) = (&teeth.arm[at.clone()], &work.unit[at.clone()]);
            let mut of_unit = 0.0;
            for i in 0..teeth.count {
                of_unit += arm[i] * unit[i];
            }
            let share = torque_nmm / of_unit;
            let rotation_rad = self.power.power::<V>(share);
            shared.rotation_rad[row] = rotation_rad;
            shared.stiffness[row] = torque_nmm / (self.power.exponent() * rotation_rad);
            for (force, unit) in shared.force[at].iter_mut().zip(unit) {
                *force = unit * share;
            }
        }
    }

    /// Newton's method from above, with the tangents of all forces.
    #[inline(always)]
    fn share_beyond_gaps<V: Simd>(
        &self,
        torque_nmm: f64,
        teeth: &Teeth<'_>,
        work: &mut Work<'_>,
        shared: &mut Shared<'_>,
    ) -> bool {
        let (count, inverse) = (teeth.count, 1.0 / self.power.exponent());
        for row in 0..teeth.rows {
            let at = row * count..(row + 1) * count;
            let (arm, unit) = (&teeth.arm[at.clone()], &work.unit[at.clone()]);
            let mut of_unit = 0.0;
            for i in 0..count {
                of_unit += arm[i] * unit[i];
            }
            let alone = self.power.power::<V>(torque_nmm / of_unit);
            let Some((last, excess)) = start_above(alone, |i| arm[i] * unit[i], &work.closing[at]) else {
                return false;
            };
            (work.row_last[row], work.row_excess[row]) = (last, excess);
        }
        let mut is_last_round = false;
        for _ in 0..MAX_ROUNDS {
            self.tangents::<V>(teeth, work);
            let mut is_done = true;
            for row in 0..teeth.rows {
                let at = row * count..(row + 1) * count;
                let (slope, arm) = (&work.slope[at.clone()], &teeth.arm[at.clone()]);
                let pressed = &work.pressed[at.clone()];
                let (mut torque, mut stiffness) = (0.0, 0.0);
                for i in 0..count {
                    let tangent = arm[i] * slope[i];
                    stiffness += tangent;
                    torque += if pressed[i] > 0.0 { tangent * pressed[i] } else { 0.0 };
                }
                let stiffness = inverse * stiffness;
                shared.stiffness[row] = stiffness;
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
                for row in 0..teeth.rows {
                    shared.rotation_rad[row] = work.row_last[row] + work.row_excess[row];
                }
                let len = teeth.len;
                let (pressed, slope) = (&work.pressed[..len], &work.slope[..len]);
                let force = &mut shared.force[..len];
                for i in 0..len {
                    force[i] = if pressed[i] > 0.0 { pressed[i] * slope[i] } else { 0.0 };
                }
                return shared.rotation_rad[..teeth.rows].iter().all(|rotation| rotation.is_finite());
            }
            is_last_round = is_done;
        }
        false
    }

    /// Computes `F/(Δφ - θ)` of the loaded teeth, which is p times the slope.
    #[inline(always)]
    fn tangents<V: Simd>(&self, teeth: &Teeth<'_>, work: &mut Work<'_>) {
        let rows = teeth.rows;
        repeat_each(&work.row_excess[..rows], teeth.count, work.excess);
        repeat_each(&work.row_last[..rows], teeth.count, work.last);
        let len = teeth.len;
        let (unit, closing, excess, last) =
            (&work.unit[..len], &work.closing[..len], &work.excess[..len], &work.last[..len]);
        let (pressed, slope) = (&mut work.pressed[..len], &mut work.slope[..len]);
        for i in 0..len {
            let x = excess[i] + (last[i] - closing[i]);
            pressed[i] = x;
            let over_x = self.power.inverse_over_x::<V>(x);
            slope[i] = if x > 0.0 { unit[i] * over_x } else { 0.0 };
        }
    }
}

/// Newton's method that starts with all teeth carrying. With a linear law it ends when the set of carrying teeth is
/// constant.
#[inline(always)]
fn share_linearly(torque_nmm: f64, teeth: &Teeth<'_>, work: &mut Work<'_>, shared: &mut Shared<'_>) -> bool {
    for row in 0..teeth.rows {
        let at = row * teeth.count..(row + 1) * teeth.count;
        let (arm, unit, closing) = (&teeth.arm[at.clone()], &work.unit[at.clone()], &work.closing[at.clone()]);
        let mut last = last_of(closing);
        let (stiffness, excess) = loop {
            let (mut stiffness, mut before) = (0.0, 0.0);
            for i in 0..teeth.count {
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
        shared.rotation_rad[row] = last + excess;
        shared.stiffness[row] = stiffness;
        for (force, (unit, closing)) in shared.force[at].iter_mut().zip(unit.iter().zip(closing)) {
            let pressed = excess + (last - closing);
            *force = if pressed > 0.0 { unit * pressed } else { 0.0 };
        }
    }
    true
}

/// Returns the logarithm of the force at which half the width is the reference length, over that at which Johnson's law
/// ends. It is slightly large, so that the plain path decides near the end.
fn least_margin() -> f64 {
    1e-6 - 2.0 * WIDEST_SHARE.ln()
}

impl TwoParts for Logarithm {
    const BEND: f64 = 1.0;

    /// `A` and `B`.
    #[inline(always)]
    fn coefficients<V: Simd>(&self, typical_n: f64, teeth: &Teeth<'_>, work: &mut Work<'_>) {
        let len = teeth.len;
        let (ring, carrier) = (&teeth.ring_ratio[..len], &teeth.carrier_ratio[..len]);
        let (cam_stress, ring_stress) = (&teeth.cam_stress[..len], &teeth.ring_stress[..len]);
        let given = &work.given[..len];
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

impl<L: TwoParts> NoPowerLaw<L> {
    /// Computes the coefficients of each tooth, with forces in a typical unit, so that no logarithm is large.
    #[inline(always)]
    fn prepare<V: Simd>(&self, torque_nmm: f64, teeth: &Teeth<'_>, work: &mut Work<'_>) {
        work.typical_n = torque_nmm / teeth.arm[..teeth.count].iter().sum::<f64>();
        self.law.coefficients::<V>(work.typical_n, teeth, work);
    }

    #[inline(always)]
    fn share<V: Simd>(&self, torque_nmm: f64, teeth: &Teeth<'_>, work: &mut Work<'_>, shared: &mut Shared<'_>) -> bool {
        if self.has_gaps {
            Self::share_with::<V, true>(torque_nmm, teeth, work, shared)
        } else {
            Self::share_with::<V, false>(torque_nmm, teeth, work, shared)
        }
    }

    /// Computes an initial force for each tooth, and the matching rotation.
    #[inline(always)]
    fn start<V: Simd, const GAPS: bool>(
        torque: f64,
        teeth: &Teeth<'_>,
        work: &mut Work<'_>,
        force: &mut [f64],
    ) -> bool {
        let (count, len) = (teeth.count, teeth.len);
        let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &teeth.arm[..len]);
        // Assumes that all forces equal the typical one.
        let secant = &mut work.secant[..len];
        for i in 0..len {
            secant[i] = arm[i] / L::over_force_roughly::<V>(a[i], b[i], 1.0);
        }
        for row in 0..teeth.rows {
            let at = row * count..(row + 1) * count;
            let (arm, secant) = (&arm[at.clone()], &secant[at.clone()]);
            let mut stiffness = 0.0;
            for i in 0..count {
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
        press::<GAPS>(teeth, work);
        Self::guess::<V>(teeth, work, force);
        true
    }

    /// Estimates the forces from the displacements of the teeth.
    #[inline(always)]
    fn guess<V: Simd>(teeth: &Teeth<'_>, work: &mut Work<'_>, force: &mut [f64]) {
        let len = teeth.len;
        let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &teeth.arm[..len]);
        let pressed = &work.pressed[..len];
        let (excess, force) = (&work.excess[..len], &mut force[..len]);
        for i in 0..len {
            // An open tooth is treated as closed, because it may turn out to carry.
            let pressed = if pressed[i] > 0.0 { pressed[i] } else { excess[i] };
            let first = pressed * arm[i] / L::over_force_roughly::<V>(a[i], b[i], 1.0);
            let second = pressed * arm[i] / L::over_force_roughly::<V>(a[i], b[i], positive(first));
            force[i] = if second > NOTHING { second } else { NOTHING };
        }
    }

    /// Forces, and the limit, are in the unit of the previous load sharing.
    #[inline(always)]
    fn limit<V: Simd>(&self, per_allowable: &PerContact<f64>, teeth: &Teeth<'_>, work: &mut Work<'_>) -> Option<Limit> {
        let len = teeth.len;
        let typical_n = work.typical_n;
        if !self.has_gaps {
            work.closing[..len].fill(0.0);
        }
        // Taken temporarily: if the tile fails here, the whole sweep uses the plain path.
        let mut limit = std::mem::take(&mut work.limit);
        forces_at_stress(per_allowable, teeth, limit);
        {
            let (a, b, arm) = (&work.unit[..len], &work.growth[..len], &teeth.arm[..len]);
            let (force, reach, pressed) = (&limit[..len], &work.reach[..len], &mut work.pressed[..len]);
            let per_typical = 1.0 / typical_n;
            let least_margin = least_margin();
            for i in 0..len {
                let force = force[i] * per_typical;
                let [slope, rest] = L::slope_and_rest::<V>(a[i], b[i], force);
                let approach = force * (slope + rest);
                // If the law ends first on a tooth, that tooth does not limit the torque, or the end of the law is
                // detected below.
                let is_within = arm[i] > 0.0 && reach[i] - L::ln_of::<V>(force) > least_margin;
                pressed[i] = if is_within { approach / arm[i] } else { f64::INFINITY };
            }
        }
        if !turn_to_limit(teeth, work) {
            return None;
        }
        Self::guess::<V>(teeth, work, limit);
        let mut is_done = false;
        for _ in 0..MAX_ROUNDS {
            Self::tangents::<V, true>(teeth, work, limit);
            is_done = Self::follow::<true>(teeth, work, limit);
            if is_done {
                break;
            }
        }
        let is_within = Self::cut_and_check(typical_n, teeth, work, limit);
        let least = least_torque(per_allowable, teeth, work, limit);
        std::mem::swap(&mut work.limit, &mut limit);
        least.filter(|_| is_done && is_within)
    }

    /// Newton's method for all forces and the rotations together. Each force follows the tangent of its law, and the
    /// rotation is the one at which the tangents balance the torque. A round costs one logarithm or root for each
    /// state.
    #[inline(always)]
    fn share_with<V: Simd, const GAPS: bool>(
        torque_nmm: f64,
        teeth: &Teeth<'_>,
        work: &mut Work<'_>,
        shared: &mut Shared<'_>,
    ) -> bool {
        let (count, typical_n) = (teeth.count, work.typical_n);
        let torque = torque_nmm / typical_n;
        if !Self::start::<V, GAPS>(torque, teeth, work, shared.force) {
            return false;
        }
        for _ in 0..MAX_ROUNDS {
            Self::tangents::<V, GAPS>(teeth, work, shared.force);
            let mut is_done = true;
            for row in 0..teeth.rows {
                let at = row * count..(row + 1) * count;
                let (arm, slope, offset) = (&teeth.arm[at.clone()], &work.slope[at.clone()], &work.offset[at.clone()]);
                let (mut stiffness, mut of_offset) = (0.0, 0.0);
                let last = work.row_last[row];
                if GAPS {
                    let closing = &work.closing[at.clone()];
                    for i in 0..count {
                        stiffness += arm[i] * slope[i];
                        let before = if slope[i] > 0.0 { (last - closing[i]) * slope[i] } else { 0.0 };
                        of_offset += arm[i] * (offset[i] + before);
                    }
                } else {
                    for i in 0..count {
                        stiffness += arm[i] * slope[i];
                        of_offset += arm[i] * offset[i];
                    }
                }
                let excess = (torque - of_offset) / stiffness;
                work.row_excess[row] = excess;
                if GAPS && excess <= 0.0 {
                    is_done = false;
                    let carrying = last_below(&work.closing[at], last, excess);
                    (work.row_last[row], work.row_excess[row]) = (carrying, excess + (last - carrying));
                }
            }
            is_done &= Self::follow::<GAPS>(teeth, work, shared.force);
            if is_done {
                return Self::finish(typical_n, teeth, work, shared);
            }
        }
        false
    }

    /// Computes the tangents of all laws at the current forces.
    #[inline(always)]
    fn tangents<V: Simd, const GAPS: bool>(teeth: &Teeth<'_>, work: &mut Work<'_>, force: &[f64]) {
        let len = teeth.len;
        let (a, b, arm, force) = (&work.unit[..len], &work.growth[..len], &teeth.arm[..len], &force[..len]);
        let (reach, pressed) = (&work.reach[..len], &work.pressed[..len]);
        let (slope, offset) = (&mut work.slope[..len], &mut work.offset[..len]);
        let (secant, margin) = (&mut work.secant[..len], &mut work.margin[..len]);
        for i in 0..len {
            let [beyond, rest] = L::slope_and_rest::<V>(a[i], b[i], force[i]);
            let at_force = beyond + rest;
            let both = 1.0 / (at_force * beyond);
            let per_slope = both * at_force;
            let is_pressed = !GAPS || pressed[i] > 0.0;
            slope[i] = if is_pressed { arm[i] * per_slope } else { 0.0 };
            offset[i] = if is_pressed { -(rest * force[i]) * per_slope } else { 0.0 };
            secant[i] = both * beyond;
            margin[i] = reach[i] - L::ln_of::<V>(force[i]);
        }
    }

    /// Updates the forces to the new rotations. Returns true if that was the last step.
    #[inline(always)]
    fn follow<const GAPS: bool>(teeth: &Teeth<'_>, work: &mut Work<'_>, force: &mut [f64]) -> bool {
        let len = teeth.len;
        // A tooth that was pressed before has a slope.
        press::<GAPS>(teeth, work);
        let (arm, pressed, slope) = (&teeth.arm[..len], &work.pressed[..len], &work.slope[..len]);
        let (secant, offset) = (&work.secant[..len], &mut work.offset[..len]);
        let force = &mut force[..len];
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
                // Change of the slope along the step.
                offset[i] *= (next - before) / (before * before);
                force[i] = next;
                *beyond = if step > *beyond || step.is_nan() { step } else { *beyond };
            }
        }
        beyond.iter().all(|&beyond| beyond <= 0.0)
    }

    /// Converts the forces to newtons, and the stiffnesses accordingly. Returns false if a contact is wider than the
    /// law allows.
    #[inline(always)]
    fn finish(typical_n: f64, teeth: &Teeth<'_>, work: &mut Work<'_>, shared: &mut Shared<'_>) -> bool {
        let (count, arm) = (teeth.count, &teeth.arm[..teeth.len]);
        let (slope, change) = (&work.slope[..teeth.len], &work.offset[..teeth.len]);
        for row in 0..teeth.rows {
            let mut stiffness = 0.0;
            for i in row * count..(row + 1) * count {
                stiffness += arm[i] * slope[i] * (1.0 - L::BEND * change[i]);
            }
            shared.rotation_rad[row] = work.row_last[row] + work.row_excess[row];
            shared.stiffness[row] = typical_n * stiffness;
        }
        let is_finite = shared.rotation_rad[..teeth.rows].iter().all(|rotation| rotation.is_finite());
        Self::cut_and_check(typical_n, teeth, work, shared.force) && is_finite
    }

    /// Converts forces to newtons, zero for teeth that are not pressed. Returns true if all are within the law.
    #[inline(always)]
    fn cut_and_check(typical_n: f64, teeth: &Teeth<'_>, work: &mut Work<'_>, force: &mut [f64]) -> bool {
        let len = teeth.len;
        let (arm, pressed) = (&teeth.arm[..len], &work.pressed[..len]);
        let (margin, force) = (&mut work.margin[..len], &mut force[..len]);
        let least_margin = least_margin();
        for i in 0..len {
            let carries = pressed[i] > 0.0 && arm[i] > 0.0;
            force[i] = if carries { typical_n * force[i] } else { 0.0 };
            margin[i] = if carries { least_margin - margin[i] } else { 0.0 };
        }
        largest(&margin[..teeth.rows * teeth.count]) <= 0.0
    }
}
