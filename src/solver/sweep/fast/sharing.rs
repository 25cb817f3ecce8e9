//! Load sharing among the teeth at an input angle, for a tile of input angles together (docs/explanation/theory.md
//! section 9, *Fast path*).
//!
//! The springs are those of [`crate::springs`], in columns. With gaps every search approaches the rotation from above.
//! Each force is convex in the rotation, so the sum of all tangents never exceeds the springs' torque. Its root is at
//! or beyond the true one. A tooth that is open there is open at the true rotation too.

mod power_law;
mod two_parts;

use pulp::Simd;

use super::lanes::repeat_each;
use crate::contact::{Contact, PerContact};
use crate::contact_law::{LogarithmicTerm, PALMGREN_EXPONENT, Term, WIDEST_SHARE};
use crate::load_sharing::{Compatibility, LoadedDrive};
use crate::tooth::StressExponents;

pub(crate) use power_law::{Hertz, Linear, Palmgren, Power, PowerLaw};
pub(crate) use two_parts::{Logarithm, NoPowerLaw, PalmgrenAndLinear};

/// Largest number of rounds of a search. A tile that needs more uses the plain path.
const MAX_ROUNDS: u32 = 60;

/// A relative step this small of a force under Johnson's law is the last: the next would be proportional to its square.
const LAST_FORCE_STEP: f64 = 3e-8;

/// The same for the rotation under a power law, and the relative error of the torque due to rounding.
const LAST_ROTATION_STEP: f64 = 1e-9;

const OPEN_TORQUE: f64 = 8.0 * f64::EPSILON;

/// Replaces zero where a logarithm is needed. No contact has a ratio or a force this small.
const NOTHING: f64 = 1e-150;

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
    let (rows, len) = (teeth.rows, teeth.len);
    if GAPS {
        repeat_each(&work.row_excess[..rows], teeth.count, work.excess);
        repeat_each(&work.row_last[..rows], teeth.count, work.last);
        let (excess, pressed) = (&work.excess[..len], &mut work.pressed[..len]);
        let (last, closing) = (&work.last[..len], &work.closing[..len]);
        for i in 0..len {
            pressed[i] = excess[i] + (last[i] - closing[i]);
        }
    } else {
        repeat_each(&work.row_excess[..rows], teeth.count, work.pressed);
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

/// Conversion of unit loads to loads.
pub(super) enum Sharing {
    Linear(PowerLaw<Linear>),
    Palmgren(PowerLaw<Palmgren>),
    Hertz(PowerLaw<Hertz>),
    PalmgrenAndLinear(NoPowerLaw<PalmgrenAndLinear>),
    Logarithmic(NoPowerLaw<Logarithm>),
}

impl Sharing {
    /// Returns the method of a drive under a load; none if its law has no columns. A flat with its own law contributes
    /// only its series compliance.
    pub(super) fn new(loaded: &LoadedDrive<'_>) -> Option<Self> {
        let contacts = loaded.contacts_in_columns()?;
        let (weights, has_gaps) = (Weights::new(loaded), !loaded.gaps.is_nil());
        let series = contacts.series_compliance_mm_per_n;
        let is_alone = series.iter().all(|(_, &compliance)| compliance == 0.0);
        let PerContact { wave_generator, ring, carrier } = contacts.law;
        // Other powers have no columns.
        if matches!(wave_generator, Term::Power { exponent, .. } if exponent.total_cmp(&PALMGREN_EXPONENT).is_ne()) {
            return None;
        }
        match (wave_generator, ring, carrier) {
            _ if contacts.ball(Contact::WaveGenerator).is_some() => (is_alone && wave_generator == Term::Ellipse)
                .then_some(Self::Hertz(PowerLaw { power: Hertz, has_gaps })),
            (
                Term::Linear { compliance_mm_per_n: wave_generator },
                Term::Linear { compliance_mm_per_n: ring },
                Term::Linear { .. } | Term::Flat,
            ) => {
                let carrier =
                    if let Term::Linear { compliance_mm_per_n } = carrier { compliance_mm_per_n } else { 0.0 };
                let compliance_mm_per_n = PerContact {
                    wave_generator: wave_generator + series.wave_generator,
                    ring: ring + series.ring,
                    carrier: carrier + series.carrier,
                };
                Some(Self::Linear(PowerLaw { power: Linear { compliance_mm_per_n, weights }, has_gaps }))
            }
            (Term::Power { coefficient, .. }, ..) if is_alone && wave_generator == ring && ring == carrier => {
                Some(Self::Palmgren(PowerLaw { power: Palmgren { coefficient, weights }, has_gaps }))
            }
            (
                Term::Power { coefficient: wave_generator, .. },
                Term::Power { coefficient: ring, .. },
                Term::Power { .. } | Term::Flat,
            ) => {
                let carrier = if let Term::Power { coefficient, .. } = carrier { coefficient } else { 0.0 };
                let coefficient = PerContact { wave_generator, ring, carrier };
                let law = PalmgrenAndLinear { coefficient, compliance: series, weights };
                Some(Self::PalmgrenAndLinear(NoPowerLaw { law, has_gaps }))
            }
            (Term::Logarithmic(wave_generator), Term::Logarithmic(ring), Term::Logarithmic(_) | Term::Flat) => {
                let carrier = if let Term::Logarithmic(line) = carrier { line } else { LogarithmicTerm::NONE };
                let law = Logarithm::new(loaded, &PerContact { wave_generator, ring, carrier }, &series);
                Some(Self::Logarithmic(NoPowerLaw { law, has_gaps }))
            }
            _ => None,
        }
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

/// Returns the logarithm of the force at which half the width is the reference length, over that at which Johnson's law
/// ends. It is slightly large, so that the plain path decides near the end.
fn least_margin() -> f64 {
    1e-6 - 2.0 * WIDEST_SHARE.ln()
}
