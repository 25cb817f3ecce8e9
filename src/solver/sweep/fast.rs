//! Sweep at equally spaced input angles, evaluated for many states at a time.
//!
//! The formulas are those of the plain path ([`crate::cam`], [`crate::ring`], [`crate::load_sharing`]), which remains
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
use unit::Unit;

use crate::contact::{Contact, PerContact};
use crate::load_sharing::LoadedDrive;
use crate::mesh::{Mesh, Samples};
use crate::position::Position;
use crate::sweep::columns::{self, ContactPeaks, Peak, PeaksSoFar, Sweep, SweepPeaks, TorqueCapacity, Totals};
use crate::sweep::points::{Points, Tolerance};
use crate::sweep::search::{Best, Found, Piece, search};
use crate::{SolveError, Stop};

/// Returns the sweep, and its capacity if the load has an allowable stress. Returns none if the plain path has to compute
/// it: for laws without columns, possible interference, and drives beyond the limits.
pub(crate) fn sweep(loaded: &LoadedDrive<'_>, samples: Samples, stop: &dyn Stop) -> Result<Option<Sweep>, SolveError> {
    let one_zone = loaded.as_one_zone();
    let Some(kernel) = Kernel::new(&one_zone) else { return Ok(None) };
    let laps = Laps::new(loaded.mesh(), samples);
    let mut sink = ColumnSink::new(loaded.drive(), &laps);
    let Some(totals) = kernel.fill(&laps, stop, &mut sink)? else { return Ok(None) };
    let mut sweep = sink.sweep(&totals);
    sweep.torque_capacity = kernel.complete(&mut sweep.peaks, sweep.torque_capacity)?;
    columns::checked(sweep, loaded, Points::Samples(samples)).map(Some)
}

/// Returns the peaks of the same sweep without its states, for zones that are alike; none in the cases of [`sweep`].
pub(crate) fn peaks(
    loaded: &LoadedDrive<'_>,
    samples: Samples,
    stop: &dyn Stop,
) -> Result<Option<SweepPeaks>, SolveError> {
    let Some(kernel) = Kernel::new(loaded) else { return Ok(None) };
    let mut sink = PeakSink::new(loaded.drive());
    let Some(mut totals) = kernel.fill(&Laps::new(loaded.mesh(), samples), stop, &mut sink)? else { return Ok(None) };
    let mut contacts = sink.contact_peaks();
    totals.torque_capacity = kernel.complete(&mut contacts, totals.torque_capacity)?;
    totals.peaks(contacts).map(Some)
}

/// Returns the moments of a sweep to a tolerance over these pieces, with linear interpolation true to a resolution.
/// Returns none in the cases of [`sweep`].
pub(crate) fn moments(
    loaded: &LoadedDrive<'_>,
    pieces: impl Iterator<Item = Piece>,
    tolerance: Tolerance,
    resolution: f64,
    stop: &dyn Stop,
) -> Result<Option<Found>, SolveError> {
    let one_zone = loaded.as_one_zone();
    let Some(kernel) = Kernel::new(&one_zone) else { return Ok(None) };
    let mut arena = Vec::new();
    let mut look = FastLook::new(&kernel, *loaded.mesh(), &mut arena, stop);
    search(&look.searched(), pieces, tolerance, Some(resolution), stop, |fractions, seen| look.look(fractions, seen))
}

/// Returns the true peaks to a tolerance; none in the cases of [`sweep`].
pub(crate) fn true_peaks(
    loaded: &LoadedDrive<'_>,
    tolerance: Tolerance,
    stop: &dyn Stop,
) -> Result<Option<SweepPeaks>, SolveError> {
    let Some(kernel) = Kernel::new(loaded) else { return Ok(None) };
    let (mesh, mut arena) = (*loaded.mesh(), Vec::new());
    let mut look = FastLook::new(&kernel, mesh, &mut arena, stop);
    let pieces = Piece::of(loaded, 0);
    let found = search(&look.searched(), pieces, tolerance, None, stop, |fractions, seen| look.look(fractions, seen))?;
    let Some(Found { seen, best }) = found else { return Ok(None) };
    let mut totals = look.totals;
    let peak = |Best { value, piece, moment, tooth }| {
        let (seen, fraction) = (&seen[piece], seen[piece].fractions[moment]);
        let position = seen.piece.position(&mesh, tooth as u64 + 1, fraction);
        Peak { value, input_angle_deg: fraction * mesh.period_deg(), position_deg: position.from_lobe_deg() }
    };
    let mut contacts = PerContact::of(|contact| {
        let force = contact as usize;
        let hardest: Best = best[force + 3];
        let force_at_stress_n = seen[hardest.piece].load(hardest.moment, force, hardest.tooth);
        let peaks = PeaksSoFar { force_n: peak(best[force]), stress_mpa: peak(hardest), force_at_stress_n };
        peaks.of_line(loaded.drive().tooth_width_mm())
    });
    totals.torque_capacity = kernel.complete(&mut contacts, totals.torque_capacity)?;
    totals.peaks(contacts).map(Some)
}

/// A drive under a load, with its constants.
struct Kernel<'a> {
    loaded: &'a LoadedDrive<'a>,
    shape: Shape,
    r: f64,
    ring_teeth_per_wave: f64,
    teeth_per_wave: f64,
    unit: Unit,
    /// Load sharing; none for a linear law without gaps, whose unit loads are scaled by one factor for each input angle.
    sharing: Option<Sharing>,
    gaps: Option<GapColumns<'a>>,
    pressures: Pressures,
    /// `E*/(π L1)` of each contact.
    hertz: PerContact<f64>,
    /// Terms of the arctangent for the angle on the cam and on the ring.
    cam_terms: usize,
    ring_terms: usize,
    /// Allowable stress, if the torque capacity does not follow from the peaks.
    allowable_mpa: Option<PerContact<f64>>,
}

impl<'a> Kernel<'a> {
    fn new(loaded: &'a LoadedDrive<'a>) -> Option<Self> {
        let (unit, sharing) = match Sharing::new(loaded)? {
            Sharing::Linear(law) if loaded.is_linear() => (Unit::rotation(&law.compliance_mm_per_n, loaded), None),
            sharing => (Unit::NEWTON, Some(sharing)),
        };
        let drive = loaded.drive();
        let pressures = Pressures::new(loaded)?;
        let r = drive.parameters().tooth_radius_mm;
        let (shape, ratios) = Shape::new(&drive.flank().cam, r)?;
        let mut kernel = Self {
            loaded,
            shape,
            r,
            ring_teeth_per_wave: drive.flank().teeth_per_wave(),
            teeth_per_wave: drive.teeth_per_wave(),
            unit,
            sharing,
            gaps: GapColumns::new(loaded),
            hertz: pressures.hertz(loaded),
            pressures,
            cam_terms: arctangent_terms(ratios.wave_generator)?,
            ring_terms: arctangent_terms(ratios.ring)?,
            allowable_mpa: None,
        };
        kernel.allowable_mpa = loaded.load.allowable_stress_mpa.filter(|_| !kernel.is_in_proportion());
        Some(kernel)
    }

    /// Returns true if all loads are proportional, whatever the torque.
    fn is_in_proportion(&self) -> bool {
        self.sharing.as_ref().is_none_or(|sharing| sharing.is_power_law() && self.gaps.is_none())
    }

    fn torque_of_zone_nmm(&self) -> f64 {
        self.loaded.input_torque_nmm() / self.loaded.zones
    }

    /// Adds to the peaks the data of contacts other than line contacts. Returns the torque capacity, which follows from
    /// the peaks if all loads are proportional (docs/explanation/theory.md section 4.7): that of the stress nearest to
    /// its limit.
    fn complete(
        &self,
        peaks: &mut PerContact<ContactPeaks>,
        torque_capacity: Option<TorqueCapacity>,
    ) -> Result<Option<TorqueCapacity>, SolveError> {
        let (drive, load) = (self.loaded.drive(), &self.loaded.load);
        let torque_capacity = torque_capacity.or_else(|| {
            let input_torque_nm = 1e-3 * self.loaded.input_torque_nmm();
            let exponents = self.pressures.stress_exponents();
            load.allowable_stress_mpa.map(|allowable_mpa| {
                TorqueCapacity::in_proportion(drive, input_torque_nm, &allowable_mpa, peaks, exponents)
            })
        });
        if !matches!(self.pressures, Pressures::Lines) {
            for contact in Contact::all() {
                let peak = peaks.get_mut(contact);
                let position = Position::from_lobe(peak.stress_mpa.position_deg.to_radians(), drive.lobes());
                let pressure = self.loaded.pressure_at(position, contact)?;
                let force_n = pressure.force_n(peak.stress_mpa.value);
                *peak = peak.of_pressure(&pressure, force_n, &load.materials, contact);
            }
        }
        Ok(torque_capacity)
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

    /// Fills the sink with the best vectors of this machine. Returns none if the plain path is needed.
    fn fill(&self, laps: &Laps, stop: &dyn Stop, sink: &mut impl Sink) -> Result<Option<Totals>, SolveError> {
        pulp::Arch::new().dispatch(Vectorised { kernel: self, laps, stop, sink })
    }
}

/// Sweep over the superposed zones of a drive, whose positions repeat in each lap, in the form that `pulp` needs. It is
/// compiled once for each instruction set, and the best one is chosen at run time. All functions called must be inlined,
/// otherwise they would not be vectorised.
struct Vectorised<'a, K> {
    kernel: &'a Kernel<'a>,
    laps: &'a Laps,
    stop: &'a dyn Stop,
    sink: &'a mut K,
}

impl<K: Sink> pulp::WithSimd for Vectorised<'_, K> {
    type Output = Result<Option<Totals>, SolveError>;

    #[inline(always)]
    fn with_simd<V: Simd>(self, _: V) -> Self::Output {
        let Self { kernel, laps, stop, sink } = self;
        let (mesh, layout) = (*kernel.loaded.mesh(), kernel.layout(&laps.mesh));
        let size = TileSize::of(kernel, laps.of_lap, layout.at_each_place, K::COLUMNS);
        let mut arena = vec![0.0; size.doubles()];
        let step_rad = laps.stride as f64 * mesh.phase_step_rad(laps.of_lap);
        let mut tile = Tile::new(&mut arena, &size, step_rad, kernel.pressures.stress_exponents());
        let (mut totals, mut lap_teeth) = (Totals::new(kernel.loaded), LapTeeth::default());
        for residue in 0..laps.stride {
            let mut first = residue;
            while first < laps.of_lap.count() {
                let run = Run::from(first, laps, &mesh, layout);
                run.lay_pattern(&mut tile);
                for start in run.starts() {
                    run.place(start, &mut tile);
                    if !kernel.unit_loads::<V, K>(&mut tile) {
                        return Ok(None);
                    }
                    let mut is_shared = false;
                    for lap in laps.with(start) {
                        if stop.stopped() {
                            return Err(SolveError::Stopped);
                        }
                        if laps.are_listed() {
                            lap_teeth.list(&laps.mesh, layout, run.places, lap);
                        }
                        if lap == laps.count {
                            tile.count = run.teeth;
                        }
                        let sample = laps.sample(lap, start);
                        if !is_shared {
                            if !kernel.loads::<V>(&laps.mesh, &lap_teeth, &mut tile) {
                                return Ok(None);
                            }
                            let Some(limit) = kernel.limit::<V>(&mut tile) else { return Ok(None) };
                            let angle_deg = |row: usize| laps.input_angle_deg(sample + row as u64);
                            totals.add_torques(kernel.loaded, &mut tile, limit.as_ref(), angle_deg);
                            if !K::COLUMNS {
                                totals.add_rows(kernel.loaded.drive(), &tile);
                            }
                            is_shared = !kernel.tells_items_apart();
                        }
                        let rows = tile.rows();
                        for (angle_deg, sample) in zip(&mut tile.row_input_angle_deg[..rows], sample..) {
                            *angle_deg = laps.input_angle_deg(sample);
                        }
                        sink.take(&mut tile, sample, &lap_teeth);
                    }
                }
                first = run.next();
            }
        }
        Ok(Some(totals))
    }
}
