//! Load sharing among the teeth at an input angle, for a tile of input angles together (docs/explanation/theory.md
//! section 9, *Fast path*).
//!
//! The springs are those of [`crate::springs`], in columns. With gaps every search approaches the rotation from above.
//! Each force is convex in the rotation, so the sum of all tangents never exceeds the springs' torque. Its root is at
//! or beyond the true one. A tooth that is open there is open at the true rotation too.
//!
//! The tiles have the loads of 1 N at the wave generator: the torque there is the lever arm `|h'|`, the forces at ring
//! and carrier are `F_K/F_H` and `F_S/F_H`. Load sharing computes `F_H` in `scale`, `Δφ` and, for one zone, `dM0/dΔφ`.

mod power_law;
mod two_parts;

use pulp::Simd;

use super::lanes::repeat_each;
use super::tile::Tile;
use crate::contact::{Contact, PerContact};
use crate::contact_law::{LogarithmicTerm, PALMGREN_EXPONENT, Term, WIDEST_SHARE};
use crate::load_sharing::{Compatibility, LoadedDrive};

use power_law::{Hertz, Linear, Palmgren, Power};
use two_parts::{Logarithm, PalmgrenAndLinear, TwoParts};

/// Largest number of rounds of a search. A tile that needs more uses the plain path.
const MAX_ROUNDS: u32 = 60;

/// A relative step this small of a force under Johnson's law is the last: the next would be proportional to its square.
const LAST_FORCE_STEP: f64 = 3e-8;

/// The same for the rotation under a power law, and the relative error of the torque due to rounding.
const LAST_ROTATION_STEP: f64 = 1e-9;

const OPEN_TORQUE: f64 = 8.0 * f64::EPSILON;

/// Replaces zero where a logarithm is needed. No contact has a ratio or a force this small.
const NOTHING: f64 = 1e-150;

/// Least torque of a tile under which a contact reaches a stress.
pub(super) struct Limit {
    /// Torque of one zone.
    pub(super) torque_nmm: f64,
    /// The contact that reaches it.
    pub(super) contact: Contact,
    /// Input angle in the tile.
    pub(super) row: usize,
}

/// Working columns.
pub(super) struct Work<'a> {
    /// Place-dependent part of each tooth's law: c of balls, the compliance of a flat.
    pub(super) given: &'a mut [f64],
    /// Power law: force at the rotation 1. Johnson's law: `A`. Power with a linear part: that part.
    unit: &'a mut [f64],
    /// Johnson's law: `B`. Otherwise the coefficient of the power.
    growth: &'a mut [f64],
    /// Rotation at which the gaps of a tooth are closed; zero without gaps, as the tile begins.
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
    /// `F_H` under a limit; takes the place of `scale` while the limit is searched for.
    limit: &'a mut [f64],
    row_excess: &'a mut [f64],
    row_last: &'a mut [f64],
    /// Torque of one zone under which a contact reaches its limit, by input angle.
    pub(super) row_limit: &'a mut [f64],
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
    pub(super) fn pressed_rad(&self, row: usize, teeth: usize) -> impl Iterator<Item = f64> {
        let (last, excess) = (self.row_last[row], self.row_excess[row]);
        self.closing[row * teeth..(row + 1) * teeth].iter().map(move |closing| excess + (last - closing))
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
        match loaded.load.compatibility {
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
fn press<const GAPS: bool>(tile: &mut Tile<'_>) {
    let (rows, len, work) = (tile.rows(), tile.len(), &mut tile.work);
    repeat_each(&work.row_excess[..rows], tile.teeth, work.excess);
    let (excess, pressed) = (&work.excess[..len], &mut work.pressed[..len]);
    if !GAPS {
        pressed.copy_from_slice(excess);
        return;
    }
    repeat_each(&work.row_last[..rows], tile.teeth, work.last);
    let (last, closing) = (&work.last[..len], &work.closing[..len]);
    for i in 0..len {
        pressed[i] = excess[i] + (last[i] - closing[i]);
    }
}

/// Computes the force at which the first contact of each tooth reaches its allowable stress: `(σ_a/σ)²` for line
/// contacts.
#[inline(always)]
fn forces_at_stress(per_allowable: &PerContact<f64>, tile: &mut Tile<'_>) {
    let len = tile.len();
    let exponents = tile.stress_exponents;
    let (cam, ring) = (&tile.stress.wave_generator[..len], &tile.stress.ring[..len]);
    let (carrier, force) = (&tile.stress.carrier[..len], &mut tile.scale[..len]);
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
fn turn_to_limit(tile: &mut Tile<'_>) -> bool {
    for row in 0..tile.rows() {
        let (at, work) = (tile.of_row(row), &mut tile.work);
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
    press::<true>(tile);
    true
}

/// Returns the least torque of the rows, each at its limit, under the forces there.
#[inline(always)]
fn least_torque(per_allowable: &PerContact<f64>, tile: &mut Tile<'_>) -> Option<Limit> {
    let rows = tile.rows();
    let (work, arm, force) = (&mut tile.work, &*tile.torque.wave_generator, &*tile.scale);
    // Share of 1 N in the force at the allowable stress.
    let shares = |i: usize| {
        let exponents = tile.stress_exponents;
        PerContact {
            wave_generator: exponents.raised(tile.stress.wave_generator[i] * per_allowable.wave_generator),
            ring: exponents.raised(tile.stress.ring[i] * per_allowable.ring),
            carrier: exponents.raised_at(Contact::Carrier, tile.stress.carrier[i] * per_allowable.carrier),
        }
    };
    let mut least: Option<Limit> = None;
    for row in 0..rows {
        let at = row * tile.teeth..(row + 1) * tile.teeth;
        let mut torque_nmm = 0.0;
        for i in at.clone() {
            torque_nmm += if work.pressed[i] > 0.0 { arm[i] * force[i] } else { 0.0 };
        }
        work.row_limit[row] = torque_nmm;
        if least.as_ref().is_none_or(|least| torque_nmm < least.torque_nmm) {
            let share = |&i: &usize| {
                let PerContact { wave_generator, ring, carrier } = shares(i);
                wave_generator.max(ring).max(carrier) * if work.pressed[i] > 0.0 { force[i] } else { 0.0 }
            };
            let at_limit = at.max_by(|one, other| share(one).total_cmp(&share(other)))?;
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
    Linear(Linear),
    Palmgren(Palmgren),
    Hertz(Hertz),
    PalmgrenAndLinear(PalmgrenAndLinear),
    Logarithmic(Logarithm),
}

impl Sharing {
    /// Returns the method of a drive under a load; none if its law has no columns. A flat with its own law contributes
    /// only its series compliance.
    pub(super) fn new(loaded: &LoadedDrive<'_>) -> Option<Self> {
        let contacts = loaded.contacts_in_columns()?;
        let weights = Weights::new(loaded);
        let series = contacts.series_compliance_mm_per_n;
        let is_alone = series.iter().all(|(_, &compliance)| compliance == 0.0);
        let PerContact { wave_generator, ring, carrier } = contacts.law;
        // Other powers have no columns.
        if matches!(wave_generator, Term::Power { exponent, .. } if exponent.total_cmp(&PALMGREN_EXPONENT).is_ne()) {
            return None;
        }
        match (wave_generator, ring, carrier) {
            _ if contacts.ball(Contact::WaveGenerator).is_some() => {
                (is_alone && wave_generator == Term::Ellipse).then_some(Self::Hertz(Hertz))
            }
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
                Some(Self::Linear(Linear { compliance_mm_per_n, weights }))
            }
            (Term::Power { coefficient, .. }, ..) if is_alone && wave_generator == ring && ring == carrier => {
                Some(Self::Palmgren(Palmgren { coefficient, weights }))
            }
            (
                Term::Power { coefficient: wave_generator, .. },
                Term::Power { coefficient: ring, .. },
                Term::Power { .. } | Term::Flat,
            ) => {
                let carrier = if let Term::Power { coefficient, .. } = carrier { coefficient } else { 0.0 };
                let coefficient = PerContact { wave_generator, ring, carrier };
                Some(Self::PalmgrenAndLinear(PalmgrenAndLinear { coefficient, compliance: series, weights }))
            }
            (Term::Logarithmic(wave_generator), Term::Logarithmic(ring), Term::Logarithmic(_) | Term::Flat) => {
                let carrier = if let Term::Logarithmic(line) = carrier { line } else { LogarithmicTerm::NONE };
                let law = PerContact { wave_generator, ring, carrier };
                Some(Self::Logarithmic(Logarithm::new(loaded, &law, &series)))
            }
            _ => None,
        }
    }

    /// Computes the place-dependent part of the law, independent of the gaps.
    #[inline(always)]
    pub(super) fn prepare<V: Simd>(&self, torque_nmm: f64, tile: &mut Tile<'_>) {
        match self {
            Self::Linear(law) => law.units::<V>(tile),
            Self::Palmgren(law) => law.units::<V>(tile),
            Self::Hertz(law) => law.units::<V>(tile),
            Self::PalmgrenAndLinear(law) => law.prepare::<V>(torque_nmm, tile),
            Self::Logarithmic(law) => law.prepare::<V>(torque_nmm, tile),
        }
    }

    /// Computes the forces that balance the torque of one zone, with the closing angles in `work`. Returns false if
    /// they are not found or the law ends.
    #[inline(always)]
    pub(super) fn share<V: Simd>(&self, torque_nmm: f64, has_gaps: bool, tile: &mut Tile<'_>) -> bool {
        match self {
            Self::Linear(law) => law.share::<V>(torque_nmm, has_gaps, tile),
            Self::Palmgren(law) => law.share::<V>(torque_nmm, has_gaps, tile),
            Self::Hertz(law) => law.share::<V>(torque_nmm, has_gaps, tile),
            Self::PalmgrenAndLinear(law) => law.share::<V>(torque_nmm, has_gaps, tile),
            Self::Logarithmic(law) => law.share::<V>(torque_nmm, has_gaps, tile),
        }
    }

    /// Returns true if all loads without gaps are proportional, whatever the torque.
    pub(super) const fn is_power_law(&self) -> bool {
        !matches!(self, Self::PalmgrenAndLinear(_) | Self::Logarithmic(_))
    }

    /// Returns the least torque of one zone in the tile under which a contact reaches a stress, after load sharing.
    /// Returns none if it is not found or the law ends before.
    #[inline(always)]
    pub(super) fn limit<V: Simd>(&self, per_allowable: &PerContact<f64>, tile: &mut Tile<'_>) -> Option<Limit> {
        // The law works on `scale`, which holds forces at the limit meanwhile.
        std::mem::swap(&mut tile.scale, &mut tile.work.limit);
        let limit = match self {
            Self::Linear(law) => law.limit::<V>(per_allowable, tile),
            Self::Palmgren(law) => law.limit::<V>(per_allowable, tile),
            Self::Hertz(law) => law.limit::<V>(per_allowable, tile),
            Self::PalmgrenAndLinear(law) => law.limit::<V>(per_allowable, tile),
            Self::Logarithmic(law) => law.limit::<V>(per_allowable, tile),
        };
        std::mem::swap(&mut tile.scale, &mut tile.work.limit);
        limit
    }
}

/// Returns the logarithm of the force at which half the width is the reference length, over that at which Johnson's law
/// ends. It is slightly large, so that the plain path decides near the end.
fn least_margin() -> f64 {
    1e-6 - 2.0 * WIDEST_SHARE.ln()
}
