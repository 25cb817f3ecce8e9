//! Sweep at equally spaced input angles, evaluated for many states at a time.
//!
//! The formulas are those of the plain path ([`crate::locus`], [`crate::ring`], [`crate::load_sharing`]), which remains
//! the reference. Here they process columns instead of one tooth, without branches and calls, so that the compiler can
//! vectorise them. Three properties make that possible:
//!
//! - Equally spaced positions need no new sines. The position of a tooth is a sum of a few angles, and the sine of a
//!   sum is a sum of products. The sums are chosen so that nothing cancels near an axis.
//! - The support `h` follows by Halley's method for all states at once. The slowest state sets the number of steps: one
//!   or two.
//! - The only remaining transcendental functions are two arctangents of small ratios. A few terms of their series are
//!   enough; the number depends only on the drive.
//!
//! Each state then needs three divisions and five square roots, plus the division of the position.
//!
//! Vectors are four doubles wide on machines with AVX2 and eight with AVX-512, detected at run time (`pulp`). Both give
//! the same digits. On an AMD EPYC with Zen 4, eight doubles make searches (`benches/searches.rs`) 6 % (linear) to 22 % (Palmgren) faster.

mod centers;
mod curve;
mod gaps;
pub(crate) mod lanes;
mod laps;
mod loads;
mod moments;
mod pressures;
mod shape;
mod sharing;
mod sinks;
mod teeth;
mod tile;
mod unit;

use std::iter::zip;

use gaps::GapColumns;
use lanes::arctangent_terms;
use laps::{LapTeeth, Laps, Layout, whole};
use moments::FastLook;
use pressures::Pressures;
use pulp::Simd;
use shape::Shape;
use sharing::Sharing;
use sinks::{ColumnSink, PeakSink, Sink};
use tile::{Run, Tile, TileSize};
use unit::Compliance;

use crate::contact::{Contact, PerContact};
use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::mesh::{Mesh, Samples};
use crate::position::Position;
use crate::sweep::columns::{self, ContactPeaks, Peak, Sweep, SweepPeaks, TorqueBalance, TorqueCapacity};
use crate::sweep::points::{Points, Tolerance};
use crate::sweep::search::{Best, Found, Piece, search};
use crate::{SolveError, Stop};

/// Returns the sweep and its capacity for an allowable stress. Returns none if the plain path has to compute it: for
/// laws without columns, possible interference, and drives beyond the limits.
///
/// # Errors
/// As [`columns::checked`].
pub(crate) fn sweep(
    loaded: &LoadedDrive<'_>,
    samples: Samples,
    load: &LoadCase,
    stop: &dyn Stop,
) -> Result<Option<Sweep>, SolveError> {
    let allowable_mpa = load.parameters().allowable_stress_mpa;
    let one_zone = loaded.as_one_zone();
    let Some(kernel) = Kernel::new(&one_zone, allowable_mpa) else { return Ok(None) };
    let laps = Laps::new(loaded.mesh(), samples);
    let mut sink = ColumnSink::new(&laps);
    let Some(filled) = kernel.fill(&one_zone, &laps, stop, &mut sink)? else { return Ok(None) };
    let mut sweep = sink.sweep(loaded.drive(), filled);
    sweep.torque_capacity = sweep.torque_capacity.or_else(|| kernel.in_proportion(loaded, allowable_mpa, &sweep.peaks));
    kernel.complete(loaded, load, &mut sweep.peaks)?;
    columns::checked(sweep, loaded, Points::Samples(samples)).map(Some)
}

/// Returns the peaks of the same sweep without its states, for zones that are alike; none in the cases of [`sweep`].
///
/// # Errors
/// As [`sweep`].
pub(crate) fn peaks(
    loaded: &LoadedDrive<'_>,
    samples: Samples,
    load: &LoadCase,
    stop: &dyn Stop,
) -> Result<Option<SweepPeaks>, SolveError> {
    let allowable_mpa = load.parameters().allowable_stress_mpa;
    let Some(kernel) = Kernel::new(loaded, allowable_mpa) else { return Ok(None) };
    let (laps, mut sink) = (Laps::new(loaded.mesh(), samples), PeakSink::new());
    let Some(Filled { torque_balance_residual, torque_capacity }) = kernel.fill(loaded, &laps, stop, &mut sink)? else {
        return Ok(None);
    };
    columns::check("torque balance", torque_balance_residual)?;
    let mut peaks = sink.peaks(loaded.drive(), torque_balance_residual);
    peaks.torque_capacity = torque_capacity.or_else(|| kernel.in_proportion(loaded, allowable_mpa, &peaks.contacts));
    kernel.complete(loaded, load, &mut peaks.contacts)?;
    Ok(Some(peaks))
}

/// Returns the moments of a sweep to a tolerance over these pieces, with linear interpolation true to a resolution.
/// Returns none in the cases of [`sweep`].
///
/// # Errors
/// As [`search()`].
pub(crate) fn moments(
    loaded: &LoadedDrive<'_>,
    pieces: impl Iterator<Item = Piece>,
    tolerance: Tolerance,
    resolution: f64,
    allowable_mpa: Option<PerContact<f64>>,
    stop: &dyn Stop,
) -> Result<Option<Found>, SolveError> {
    let one_zone = loaded.as_one_zone();
    let Some(kernel) = Kernel::new(&one_zone, allowable_mpa) else { return Ok(None) };
    let layout = kernel.layout(loaded.mesh());
    let size = kernel.tile_size(loaded.mesh(), layout);
    let mut arena = vec![0.0; size.doubles()];
    let mut look = FastLook::new(&kernel, &one_zone, (*loaded.mesh(), layout), &size, &mut arena, stop);
    search(&look.searched(), pieces, tolerance, Some(resolution), stop, |fractions, seen| look.look(fractions, seen))
}

/// Returns the true peaks to a tolerance; none in the cases of [`sweep`].
///
/// # Errors
/// As [`search()`], and as [`sweep`].
pub(crate) fn true_peaks(
    loaded: &LoadedDrive<'_>,
    tolerance: Tolerance,
    load: &LoadCase,
    stop: &dyn Stop,
) -> Result<Option<SweepPeaks>, SolveError> {
    let allowable_mpa = load.parameters().allowable_stress_mpa;
    let Some(kernel) = Kernel::new(loaded, allowable_mpa) else { return Ok(None) };
    let mesh = *loaded.mesh();
    let size = kernel.tile_size(&mesh, Layout::PLAIN);
    let mut arena = vec![0.0; size.doubles()];
    let mut look = FastLook::new(&kernel, loaded, (mesh, Layout::PLAIN), &size, &mut arena, stop);
    let pieces = Piece::of(loaded, 0);
    let found = search(&look.searched(), pieces, tolerance, None, stop, |fractions, seen| look.look(fractions, seen))?;
    let Some(Found { seen, best }) = found else { return Ok(None) };
    columns::check("torque balance", look.torque_balance_residual)?;
    let drive = loaded.drive();
    let peak = |Best { value, piece, moment, tooth }| {
        let (seen, fraction) = (&seen[piece], seen[piece].fractions[moment]);
        let position = seen.piece.position(&mesh, tooth as u64 + 1, fraction);
        Peak { value, input_angle_deg: fraction * mesh.period_deg(), position_deg: position.from_lobe_deg() }
    };
    let mut contacts = PerContact::of(|contact| {
        let force = contact as usize;
        let hardest: Best = best[force + 3];
        let force_n = seen[hardest.piece].load(hardest.moment, force, hardest.tooth);
        ContactPeaks::of_line(peak(best[force]), peak(hardest), force_n, drive.tooth_width_mm())
    });
    let torque_capacity = look.capacity.or_else(|| kernel.in_proportion(loaded, allowable_mpa, &contacts));
    kernel.complete(loaded, load, &mut contacts)?;
    Ok(Some(look.angles.peaks(contacts, torque_capacity, look.torque_balance_residual)))
}

/// Sweep in the form that `pulp` needs. It is compiled once for each instruction set, and the best one is chosen at run
/// time. All functions called must be inlined, otherwise they would not be vectorised.
struct Vectorised<'a, K> {
    kernel: &'a Kernel,
    loaded: &'a LoadedDrive<'a>,
    laps: &'a Laps,
    stop: &'a dyn Stop,
    sink: &'a mut K,
}

impl<K: Sink> pulp::WithSimd for Vectorised<'_, K> {
    type Output = Result<Option<Filled>, SolveError>;

    #[inline(always)]
    fn with_simd<V: Simd>(self, _: V) -> Self::Output {
        self.kernel.sweep::<V, K>(self.loaded, self.laps, self.stop, self.sink)
    }
}

/// Constants of a drive under a load.
struct Kernel {
    shape: Shape,
    r: f64,
    ring_teeth_per_wave: f64,
    teeth_per_wave: f64,
    law: Law,
    gaps: Option<GapColumns>,
    pressures: Pressures,
    /// `E*/(π L1)` of each contact.
    hertz: PerContact<f64>,
    /// Terms of the arctangent for the angle on the cam and on the ring.
    cam_terms: usize,
    ring_terms: usize,
    /// Allowable stress, if the torque capacity does not follow from the peaks.
    allowable_mpa: Option<PerContact<f64>>,
}

/// Results of a sweep that are not in its sink.
struct Filled {
    torque_balance_residual: f64,
    torque_capacity: Option<TorqueCapacity>,
}

/// Load-sharing method.
enum Law {
    /// A linear law without gaps: unit loads are those of a rotation of 1, to be scaled by one factor for each input
    /// angle.
    Linear(Compliance),
    /// Any other law: unit loads are those of 1 N at the wave generator.
    Sharing(Sharing),
}

impl Law {
    /// Returns true if all loads are proportional, whatever the torque.
    const fn is_in_proportion(&self) -> bool {
        match self {
            Self::Linear(_) => true,
            Self::Sharing(sharing) => sharing.is_in_proportion(),
        }
    }
}

impl Kernel {
    fn new(loaded: &LoadedDrive<'_>, allowable_mpa: Option<PerContact<f64>>) -> Option<Self> {
        let law = match Sharing::new(loaded)? {
            Sharing::Linear(law) if loaded.is_linear() => {
                Law::Linear(Compliance::new(&law.power.compliance_mm_per_n, loaded))
            }
            sharing => Law::Sharing(sharing),
        };
        let drive = loaded.drive();
        let pressures = Pressures::new(loaded)?;
        let r = drive.parameters().tooth_radius_mm;
        let (shape, ratios) = Shape::new(drive.flank().locus().cam(), r)?;
        Some(Self {
            shape,
            r,
            ring_teeth_per_wave: drive.flank().teeth_per_wave(),
            teeth_per_wave: drive.teeth_per_wave(),
            gaps: GapColumns::new(loaded),
            hertz: pressures.hertz(loaded),
            pressures,
            cam_terms: arctangent_terms(ratios.wave_generator)?,
            ring_terms: arctangent_terms(ratios.ring)?,
            allowable_mpa: allowable_mpa.filter(|_| !law.is_in_proportion()),
            law,
        })
    }

    /// Returns the capacity if all loads are proportional (docs/explanation/theory.md section 4.7): that of the stress
    /// nearest to its limit.
    fn in_proportion(
        &self,
        loaded: &LoadedDrive<'_>,
        allowable_mpa: Option<PerContact<f64>>,
        peaks: &PerContact<ContactPeaks>,
    ) -> Option<TorqueCapacity> {
        let (exponents, input_torque_nm) = (self.pressures.stress_exponents(), 1e-3 * loaded.input_torque_nmm());
        allowable_mpa.map(|allowable_mpa| {
            TorqueCapacity::in_proportion(loaded.drive(), input_torque_nm, &allowable_mpa, peaks, exponents)
        })
    }

    /// Adds to the peaks the data of contacts other than line contacts.
    fn complete(
        &self,
        loaded: &LoadedDrive<'_>,
        load: &LoadCase,
        peaks: &mut PerContact<ContactPeaks>,
    ) -> Result<(), SolveError> {
        if !matches!(self.pressures, Pressures::Lines) {
            let lobes = loaded.drive().lobes();
            for contact in Contact::all() {
                let peak = peaks.get_mut(contact);
                let position = Position::from_lobe(peak.stress_mpa.position_deg.to_radians(), lobes);
                let pressure = loaded.pressure_at(position, contact)?;
                let force_n = pressure.force_n(peak.stress_mpa.value);
                *peak = peak.of_pressure(&pressure, force_n, &load.parameters().materials, contact);
            }
        }
        Ok(())
    }

    /// Returns the size of tiles for arbitrary input angles.
    fn tile_size(&self, mesh: &Mesh, layout: Layout) -> TileSize {
        let places = mesh.teeth_in_mesh().max / mesh.listed_at_each_place();
        self.with_room(TileSize::anywhere(layout.at_each_place * whole(places)))
    }

    /// Returns the size with the memory that the law needs.
    fn with_room(&self, size: TileSize) -> TileSize {
        let are_unlike = self.gaps.as_ref().is_some_and(GapColumns::are_unlike);
        size.with(matches!(self.law, Law::Sharing(_)), are_unlike)
    }

    /// Returns true if gaps belong to individual items.
    fn tells_items_apart(&self) -> bool {
        self.gaps.as_ref().is_some_and(GapColumns::are_of_items)
    }

    /// Returns the order of teeth in the tiles. If items are not distinguished, there is one tooth at each place.
    fn layout(&self, mesh: &Mesh) -> Layout {
        let at_each_place = if self.tells_items_apart() { whole(mesh.lobes_loaded_alike()) } else { 1 };
        let apart = if mesh.zones_are_alike() { 1 } else { whole(mesh.laps_of_load_period()) };
        Layout { at_each_place, apart }
    }

    /// Fills the sink with the best vectors of this machine. Returns the largest torque residual, or none if the plain
    /// path is needed.
    fn fill(
        &self,
        loaded: &LoadedDrive<'_>,
        laps: &Laps,
        stop: &dyn Stop,
        sink: &mut impl Sink,
    ) -> Result<Option<Filled>, SolveError> {
        pulp::Arch::new().dispatch(Vectorised { kernel: self, loaded, laps, stop, sink })
    }

    /// Runs the sweep over the superposed zones of a drive, whose positions repeat in each lap.
    #[inline(always)]
    fn sweep<V: Simd, K: Sink>(
        &self,
        loaded: &LoadedDrive<'_>,
        laps: &Laps,
        stop: &dyn Stop,
        sink: &mut K,
    ) -> Result<Option<Filled>, SolveError> {
        let (mesh, layout) = (*loaded.mesh(), self.layout(laps.mesh()));
        let size = self.with_room(TileSize::of(&mesh, laps.of_lap, layout.at_each_place, K::COLUMNS));
        let mut arena = vec![0.0; size.doubles()];
        let step_rad = laps.stride as f64 * mesh.phase_step_rad(laps.of_lap);
        let mut tile = Tile::new(&mut arena, &size, step_rad, self.pressures.stress_exponents());
        let balance = TorqueBalance::new(loaded.drive(), loaded.input_torque_nmm());
        let mut filled = Filled { torque_balance_residual: 0.0, torque_capacity: None };
        let mut lap_teeth = LapTeeth::default();
        for residue in 0..laps.stride {
            let mut first = residue;
            while first < laps.of_lap.count() {
                let run = Run::from(first, laps, &mesh, layout);
                run.lay_pattern(&mut tile);
                for start in run.starts() {
                    run.place(start, &mut tile);
                    if !self.unit_loads::<V, K>(&mut tile) || !self.prepare::<V>(loaded, run.teeth, &mut tile) {
                        return Ok(None);
                    }
                    let mut is_shared = false;
                    for lap in laps.with(start) {
                        if stop.stopped() {
                            return Err(SolveError::Stopped);
                        }
                        if laps.are_listed() {
                            lap_teeth.list(laps.mesh(), layout, run.places(), lap);
                        }
                        if laps.is_end(lap) {
                            tile.count = run.teeth;
                        }
                        let sample = laps.sample(lap, start);
                        let rows = tile.count / run.teeth;
                        if !is_shared {
                            if !self.close(laps.mesh(), &lap_teeth, run.teeth, &mut tile) {
                                return Ok(None);
                            }
                            let Some(limit) = self.loads::<V>(loaded, run.teeth, &mut tile, |_, _| ()) else {
                                return Ok(None);
                            };
                            if let Some(limit) = limit {
                                let limit_deg = laps.input_angle_deg(sample + limit.row as u64);
                                filled.torque_capacity =
                                    least(filled.torque_capacity, limit.capacity(loaded, limit_deg));
                            }
                            filled.torque_balance_residual =
                                Self::residual(&balance, rows, &mut tile, filled.torque_balance_residual);
                            is_shared = !self.tells_items_apart();
                        }
                        for (angle_deg, sample) in zip(&mut tile.row_input_angle_deg[..rows], sample..) {
                            *angle_deg = laps.input_angle_deg(sample);
                        }
                        sink.take(loaded.drive(), &mut tile, run.teeth, sample, &lap_teeth);
                    }
                }
                first = run.next();
            }
        }
        Ok(Some(filled))
    }
}

/// Returns the smaller of two capacities, and the first of equal ones, independent of the order of evaluation.
fn least(before: Option<TorqueCapacity>, capacity: TorqueCapacity) -> Option<TorqueCapacity> {
    let is_first = |before: &TorqueCapacity| {
        let order = before.input_torque_nm.total_cmp(&capacity.input_torque_nm);
        order.then(before.input_angle_deg.total_cmp(&capacity.input_angle_deg)).is_le()
    };
    Some(before.filter(is_first).unwrap_or(capacity))
}
