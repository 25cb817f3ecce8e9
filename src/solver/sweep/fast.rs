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
//! Vectors are four doubles wide on machines with AVX2, detected at run time (`pulp`). Eight doubles with AVX-512 were
//! 5 % slower on the Xeon used for the measurement.

mod centers;
mod curve;
mod gaps;
pub(crate) mod lanes;
mod laps;
mod moments;
mod pressures;
mod sharing;
mod sinks;
mod tile;

use std::f64::consts::PI;
use std::iter::zip;

use pulp::Simd;

use crate::cam::{Cam, Ellipse};
use crate::contact::{Contact, PerContact};
use crate::load_sharing::{Compatibility, LoadCase, LoadedDrive};
use crate::mesh::{Mesh, Samples};
use crate::position::Position;
use crate::sweep::columns::{self, ContactPeaks, Peak, Sweep, SweepPeaks, TorqueBalance, TorqueCapacity, worse};
use crate::sweep::points::{Points, Tolerance};
use crate::sweep::search::{Best, Found, Piece, search};
use crate::tooth::ToothLaw;
use crate::{SolveError, Stop};
use centers::{CenterLanes, Centers, EccentricCenters, HarmonicCenters, HarmonicPathCenters};
use gaps::{GapColumns, GapWork};
use lanes::{LANES, arctangent_terms, arctangents, cube_root, repeat_each};
use laps::{LapTeeth, Laps, Layout, whole};
use moments::FastLook;
use pressures::Pressures;
use sharing::{Limit, Shared, Sharing, Teeth, Work};
use sinks::{ColumnSink, PeakSink, Sink};
use tile::{Run, Tile, TileLanes, TileSize};

/// Largest number of steps towards the support. A drive that needs more uses the plain path.
const MAX_STEPS: u32 = 8;

/// A relative step this small is the last: the next would be proportional to its cube, below the last digit.
const LAST_STEP: f64 = 5e-6;

/// Returns the sweep and its capacity for an allowable stress. Returns none if the plain path has to compute it: for
/// laws without columns, possible interference, and drives beyond the limits.
///
/// # Errors
/// As [`columns::finished`].
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
    let Some(Filled { torque_balance_residual, capacity }) = kernel.fill(&one_zone, &laps, stop, &mut sink)? else {
        return Ok(None);
    };
    let columns = sink.columns(torque_balance_residual);
    let mut sweep = columns::finished(loaded, Points::Samples(samples), columns, None)?;
    sweep.torque_capacity = capacity.or_else(|| kernel.in_proportion(loaded, allowable_mpa, &sweep.peaks));
    kernel.complete(loaded, load, &mut sweep.peaks)?;
    Ok(Some(sweep))
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
    let (laps, mut sink) = (Laps::new(loaded.mesh(), samples), PeakSink::default());
    let Some(Filled { torque_balance_residual, capacity }) = kernel.fill(loaded, &laps, stop, &mut sink)? else {
        return Ok(None);
    };
    columns::check("torque balance", torque_balance_residual)?;
    let mut peaks = sink.peaks(loaded.drive(), torque_balance_residual);
    peaks.torque_capacity = capacity.or_else(|| kernel.in_proportion(loaded, allowable_mpa, &peaks.contacts));
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
    search(&mut look, pieces, tolerance, Some(resolution), stop)
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
    let Some(Found { seen, best }) = search(&mut look, Piece::of(loaded, 0), tolerance, None, stop)? else {
        return Ok(None);
    };
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

/// Shape that determines the centres of the teeth.
enum Shape {
    Ellipse(EllipseShape),
    Eccentric(EccentricCenters),
    Harmonic(HarmonicCenters),
    HarmonicPath(HarmonicPathCenters),
}

impl Shape {
    /// Returns the shape, with bounds over all positions of the angle between contact points (cam, ring) and position,
    /// as tangents. Returns none for a kind without columns, which uses the plain path.
    fn new(cam: &Cam, r: f64) -> Option<(Self, PerContact<f64>)> {
        // On the ring by sin β ≤ 1, from the least distance of a centre.
        let bounds =
            |cam: f64, least_center: f64| PerContact { wave_generator: cam, ring: r / least_center, carrier: 0.0 };
        let off_path = |steepest: f64, least_center: f64| bounds(r * steepest / (least_center - r), least_center);
        Some(match cam {
            Cam::Ellipse(cam) => {
                let shape = EllipseShape::new(cam, r);
                let EllipseShape { a, b, difference_of_squares, .. } = shape;
                // By the inequality of arithmetic and geometric means.
                let ratio = difference_of_squares * r * a / (2.0 * a * b * ((b * b + r * b) * (a * a + r * b)).sqrt());
                (Self::Ellipse(shape), bounds(ratio, b + r))
            }
            Cam::Harmonic(cam) => {
                let (path, e) = (cam.mean_radius_mm() + r, cam.amplitude_mm());
                let shape = if cam.is_circle() {
                    Self::Eccentric(EccentricCenters::new(cam, r))
                } else {
                    Self::Harmonic(HarmonicCenters::new(cam, r))
                };
                (shape, off_path(e * f64::from(cam.lobes()) / (path - e), path - e))
            }
            Cam::HarmonicPath(cam) => {
                let (mean, e) = (cam.mean_radius_mm(), cam.amplitude_mm());
                let steepest = e * cam.lobe_count() / (mean - e);
                (Self::HarmonicPath(HarmonicPathCenters::new(cam, r)), off_path(steepest, mean - e))
            }
        })
    }
}

/// The ellipse, whose support is computed iteratively.
struct EllipseShape {
    a: f64,
    b: f64,
    r: f64,
    difference_of_squares: f64,
    guess: Guess,
}

impl EllipseShape {
    fn new(cam: &Ellipse, r: f64) -> Self {
        let (a, b) = (cam.semi_major_mm(), cam.semi_minor_mm());
        Self { a, b, r, difference_of_squares: cam.difference_of_squares_mm2(), guess: Guess::new(a, b, r) }
    }

    /// Returns the support h: the root in [b, a] of sin² (a² + rh)² (h² - b²) - cos² (b² + rh)² (a² - h²), by Halley's
    /// method. Its one division replaces two of Newton's steps. Returns none if it converges too slowly.
    #[inline(always)]
    fn supports(&self, sin: &[f64; LANES], cos: &[f64; LANES]) -> Option<[f64; LANES]> {
        let Self { a, b, r, .. } = *self;
        let (a2, b2) = (a * a, b * b);
        let mut support = [0.0; LANES];
        for i in 0..LANES {
            let guess = self.guess.at(sin[i], cos[i]);
            support[i] = if guess > b { guess } else { b };
        }
        for _ in 0..MAX_STEPS {
            let mut largest = [0.0; LANES];
            for i in 0..LANES {
                let h = support[i];
                let (major, minor) = (sin[i] * (a2 + r * h), cos[i] * (b2 + r * h));
                let (major_slope, minor_slope) = (r * sin[i], r * cos[i]);
                let (above_b, below_a) = ((h - b) * (h + b), (a - h) * (a + h));
                let value = major * major * above_b - minor * minor * below_a;
                // Half the first and half the second derivative.
                let (major_part, minor_part) = (major_slope * above_b, minor_slope * below_a);
                let slope = major * (major_part + major * h) + minor * (minor * h - minor_part);
                let bend = major * (major + 4.0 * h * major_slope)
                    + major_slope * major_part
                    + minor * (minor + 4.0 * h * minor_slope)
                    - minor_slope * minor_part;
                let step = 2.0 * value * slope / (4.0 * slope * slope - value * bend);
                support[i] = h - step;
                largest[i] = step.abs() - LAST_STEP * h;
            }
            if largest.iter().all(|&beyond| beyond <= 0.0) {
                return Some(support);
            }
        }
        None
    }
}

/// Results of a sweep that are not in its sink.
struct Filled {
    torque_balance_residual: f64,
    capacity: Option<TorqueCapacity>,
}

/// Load-sharing method.
enum Law {
    /// A linear law without gaps: unit loads are those of a rotation of 1, to be scaled by one factor for each input
    /// angle.
    Linear(Compliance),
    /// Any other law: unit loads are those of 1 N at the wave generator.
    Sharing(Sharing),
}

/// Unit of the unit loads.
trait Unit: Copy {
    /// Returns the divisor of a state's loads, from the squares of `h + r` and `h'`, which add up to `d²`.
    fn denominator(self, above2: f64, lever2: f64) -> f64;

    /// Returns `F_H` over `d²`, given the reciprocal of that divisor.
    fn load(self, lever: f64, per_denominator: f64) -> f64;

    /// Returns the value stored as stress: `√(F Σ E*/(π L1))` for a line contact of relative curvature Σ.
    #[inline(always)]
    fn stress(self, force: f64, curvature: f64, hertz: f64) -> f64 {
        (force * curvature * hertz).sqrt()
    }
}

impl Unit for Compliance {
    #[inline(always)]
    fn denominator(self, above2: f64, lever2: f64) -> f64 {
        self.of_above * above2 + self.of_lever * lever2
    }

    #[inline(always)]
    fn load(self, lever: f64, per_denominator: f64) -> f64 {
        lever * per_denominator
    }
}

/// 1 N at the wave generator.
#[derive(Clone, Copy)]
struct Newton;

impl Unit for Newton {
    #[inline(always)]
    fn denominator(self, above2: f64, lever2: f64) -> f64 {
        above2 + lever2
    }

    #[inline(always)]
    fn load(self, _: f64, per_denominator: f64) -> f64 {
        per_denominator
    }
}

/// 1 N at the wave generator of a tooth without line contacts: stores curvatures in place of stresses.
#[derive(Clone, Copy)]
struct NewtonOnBall;

impl Unit for NewtonOnBall {
    #[inline(always)]
    fn denominator(self, above2: f64, lever2: f64) -> f64 {
        Newton.denominator(above2, lever2)
    }

    #[inline(always)]
    fn load(self, lever: f64, per_denominator: f64) -> f64 {
        Newton.load(lever, per_denominator)
    }

    #[inline(always)]
    fn stress(self, _: f64, curvature: f64, hertz: f64) -> f64 {
        curvature * hertz
    }
}

/// `c d²` of a tooth under a linear law: coefficients of `(h + r)²` and `h'²`, which add up to `d²`.
#[derive(Clone, Copy)]
struct Compliance {
    of_above: f64,
    of_lever: f64,
}

impl Compliance {
    fn new(contact: &PerContact<f64>, loaded: &LoadedDrive<'_>) -> Self {
        let PerContact { wave_generator, ring, carrier } = *contact;
        let drive = loaded.drive();
        let ring_teeth_per_wave = drive.flank().teeth_per_wave();
        let of_above = wave_generator + ring;
        let of_lever = match loaded.compatibility() {
            // F_K²/F_H² = cos²γ/cos²β and F_S²/F_H² = sin²γ (Z_G/U)².
            Compatibility::VirtualWork => {
                wave_generator + ring * ring_teeth_per_wave.powi(2) + carrier * drive.teeth_per_wave().powi(2)
            }
            // 1/k_H + 1/k_K + (1 + sk) sin²γ (1/k_S - 1/k_K).
            Compatibility::Projection => of_above + (1.0 + drive.sense() * ring_teeth_per_wave) * (carrier - ring),
        };
        Self { of_above, of_lever }
    }
}

/// Initial value of the support: the series of h in ε = (a - b)/(a + b) up to its third power.
#[derive(Clone, Copy)]
struct Guess {
    mean: f64,
    first: f64,
    second: f64,
    third: f64,
}

impl Guess {
    fn new(a: f64, b: f64, r: f64) -> Self {
        let mean = 0.5 * (a + b);
        let (flattening, thickness) = ((a - b) / (a + b), r / mean);
        let round = 1.0 + thickness;
        let first = mean * flattening;
        let second = 2.0 * first * flattening * (thickness - 7.0) / round;
        let third = 2.0 * first * flattening * flattening * (thickness * (thickness - 14.0) + 25.0) / (round * round);
        Self { mean, first, second, third }
    }

    #[inline(always)]
    fn at(&self, sin: f64, cos: f64) -> f64 {
        let (double_cos, product) = (cos * cos - sin * sin, sin * cos);
        self.mean + self.first * double_cos + product * product * (self.second - self.third * double_cos)
    }
}

impl Kernel {
    fn new(loaded: &LoadedDrive<'_>, allowable_mpa: Option<PerContact<f64>>) -> Option<Self> {
        let law = match loaded.tooth_law()? {
            ToothLaw::Linear { compliance_mm_per_n } if loaded.is_linear() => {
                Law::Linear(Compliance::new(&compliance_mm_per_n, loaded))
            }
            _ => Law::Sharing(Sharing::new(loaded)?),
        };
        let is_in_proportion = match &law {
            Law::Linear(_) => true,
            Law::Sharing(sharing) => sharing.is_in_proportion(),
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
            law,
            gaps: GapColumns::new(loaded),
            hertz: pressures.hertz(loaded),
            pressures,
            cam_terms: arctangent_terms(ratios.wave_generator)?,
            ring_terms: arctangent_terms(ratios.ring)?,
            allowable_mpa: allowable_mpa.filter(|_| !is_in_proportion),
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
            for contact in [Contact::WaveGenerator, Contact::Ring, Contact::Carrier] {
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
        let mut filled = Filled { torque_balance_residual: 0.0, capacity: None };
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
                                filled.capacity = least(filled.capacity, limit.capacity(loaded, limit_deg));
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

    /// Computes geometry and unit loads of all states of a tile. Returns false if a support takes too many steps.
    #[inline(always)]
    fn unit_loads<V: Simd, K: Sink>(&self, tile: &mut Tile<'_>) -> bool {
        let are_found = match (&self.law, &self.pressures) {
            (Law::Linear(compliance), _) => self.loads_of::<K>(*compliance, tile),
            (Law::Sharing(_), Pressures::Ellipses(_)) => self.loads_of::<K>(NewtonOnBall, tile),
            (Law::Sharing(_), _) => self.loads_of::<K>(Newton, tile),
        };
        are_found && self.pressures.finish::<V>(tile)
    }

    #[inline(always)]
    fn loads_of<K: Sink>(&self, unit: impl Unit, tile: &mut Tile<'_>) -> bool {
        // A plain loop: an iterator's method would not be compiled for these vectors.
        for chunk in 0..tile.count.div_ceil(LANES) {
            let are_found = match &self.shape {
                Shape::Ellipse(ellipse) => self.on_ellipse::<K>(ellipse, unit, tile, chunk),
                Shape::Eccentric(centers) => self.on_path::<K>(centers, unit, tile, chunk),
                Shape::Harmonic(centers) => self.on_path::<K>(centers, unit, tile, chunk),
                Shape::HarmonicPath(centers) => self.on_path::<K>(centers, unit, tile, chunk),
            };
            if !are_found {
                return false;
            }
        }
        true
    }

    /// Computes geometry and unit loads of a chunk of states. Returns false if the support takes too many steps.
    #[inline(always)]
    fn on_ellipse<K: Sink>(&self, ellipse: &EllipseShape, unit: impl Unit, tile: &mut Tile<'_>, chunk: usize) -> bool {
        let TileLanes { sin, cos, force, stress, torque } = tile.lanes(chunk);
        let Some(support) = ellipse.supports(sin, cos) else { return false };
        let EllipseShape { a, b, r, difference_of_squares, .. } = *ellipse;
        let k = self.ring_teeth_per_wave;

        let mut center_radius = [0.0; LANES];
        let mut cam_ratio = [0.0; LANES];
        let mut ring_ratio = [0.0; LANES];
        let (a2, b2, ab, k2) = (a * a, b * b, a * b, k * k);
        let tooth_curvature = 1.0 / r;
        let per_squares = 1.0 / (a2 * b2);
        let (ring_hertz, carrier_hertz) = (self.hertz.ring * tooth_curvature, self.hertz.carrier * tooth_curvature);
        // Divisions and roots cost most. One reciprocal of a product serves all its factors. γ and β are written with
        // lengths, tan γ = h'/(h + r), cos γ = (h + r)/d, tan β = k tan γ, cos β = (h + r)/e, so that d and e are the
        // only roots.
        for i in 0..LANES {
            let h = support[i];
            let (above, sin_i, cos_i) = (h + r, sin[i], cos[i]);
            // Direction of the normal, from that of the position.
            let (along_major, along_minor) = (cos_i * (b2 + r * h), sin_i * (a2 + r * h));
            let length2 = along_major * along_major + along_minor * along_minor;
            let cube = h * h * h;
            // r + ρ_H over h³.
            let curvature_sum = r * cube + a2 * b2;
            let length2_h = length2 * h;
            let all = 1.0 / (length2_h * curvature_sum);
            let (per_length2_h, per_curvature_sum) = (all * curvature_sum, all * length2_h);
            let lever = difference_of_squares * (along_major * along_minor) * per_length2_h;
            let (above2, lever2) = (above * above, lever * lever);
            let (d2, e2) = (above2 + lever2, above2 + k2 * lever2);
            let (d, e) = (d2.sqrt(), e2.sqrt());
            let de = d * e;
            // The derivative of tan γ is d² `bend` over (h + r)³.
            let second = (a - b) * (b * along_minor * along_minor - a * along_major * along_major) * per_length2_h;
            let bend = (lever2 * (h * h) - above * second * (ab + h * h)) * (h * per_curvature_sum);
            // The regularity 1 + … is this value over e³ d.
            let e3_d = e2 * de;
            let regular = e3_d + r * (above * e2 + k2 * d2 * bend);
            let least = f64::EPSILON * e3_d;
            let regular = if regular > least { regular } else { least };
            let denominator = unit.denominator(above2, lever2);
            // Tangents of the angles between contact points and position.
            let cam_below = b2 * (along_minor * sin_i) + a2 * (along_major * cos_i);
            let ring_below = de + r * above;

            let (loads, angles) = (denominator * regular, cam_below * ring_below);
            let angles_e = angles * e;
            let all = 1.0 / (loads * angles_e);
            let (per_loads, per_angles_e) = (all * angles_e, all * loads);
            let (per_denominator, per_regular) = (per_loads * regular, per_loads * denominator);
            let (per_angles, per_e) = (per_angles_e * e, per_angles_e * angles);
            cam_ratio[i] = (cos_i * sin_i) * (difference_of_squares * r * h) * (per_angles * ring_below);
            ring_ratio[i] = r * k * lever * (per_angles * cam_below);
            let load = unit.load(lever, per_denominator);
            let (force_h, force_k, force_s) = (load * d2, load * de, load * lever * d * self.teeth_per_wave);
            center_radius[i] = d;
            force.wave_generator[i] = force_h;
            force.ring[i] = force_k;
            force.carrier[i] = force_s;
            let cam_curvature = tooth_curvature + cube * per_squares;
            stress.wave_generator[i] = unit.stress(force_h, cam_curvature * self.hertz.wave_generator, 1.0);
            stress.ring[i] = unit.stress(force_k, e3_d * per_regular, ring_hertz);
            stress.carrier[i] = unit.stress(force_s, 1.0, carrier_hertz);
            torque.wave_generator[i] = force_h * lever;
            torque.ring[i] = force_k * (d * k * lever * per_e);
            torque.carrier[i] = force_s * d;
        }
        tile.center_radius_mm.as_chunks_mut::<LANES>().0[chunk] = center_radius;
        if K::COLUMNS {
            self.place(tile, chunk, cam_ratio, ring_ratio);
        }
        true
    }

    /// The same for other wave generators, from their centres: `cos γ = 1/V`, `V² = 1 + T²`, and `cos β = 1/W`,
    /// `W² = 1 + k²T²`.
    #[inline(always)]
    fn on_path<K: Sink>(&self, centers: &impl Centers, unit: impl Unit, tile: &mut Tile<'_>, chunk: usize) -> bool {
        let TileLanes { sin, cos, force, stress, torque } = tile.lanes(chunk);
        let Some(CenterLanes { radius_mm, tan, tan_derivative, cam_curvature_per_mm }) = centers.at(sin, cos) else {
            return false;
        };
        let Self { r, ring_teeth_per_wave: k, .. } = *self;

        let mut cam_ratio = [0.0; LANES];
        let mut ring_ratio = [0.0; LANES];
        let tooth_curvature = 1.0 / r;
        let (ring_hertz, carrier_hertz) = (self.hertz.ring * tooth_curvature, self.hertz.carrier * tooth_curvature);
        for i in 0..LANES {
            let (d, tan) = (radius_mm[i], tan[i]);
            let (ring_tan, v2) = (k * tan, 1.0 + tan * tan);
            let w2 = 1.0 + ring_tan * ring_tan;
            let (v, w) = (v2.sqrt(), w2.sqrt());
            let cos_gamma = 1.0 / v;
            let above = d * cos_gamma;
            let lever = above * tan;
            let (above2, lever2) = (above * above, lever * lever);
            // The regularity 1 + rκ is this value over d W³.
            let flat = d * (w * w2);
            let regular = flat + r * (w2 + k * k * tan_derivative[i]);
            let least = f64::EPSILON * flat;
            let regular = if regular > least { regular } else { least };
            let denominator = unit.denominator(above2, lever2);
            let all = 1.0 / (denominator * regular);
            let (per_denominator, per_regular) = (all * regular, all * denominator);
            let force_h = unit.load(lever, per_denominator) * (d * d);
            let force_k = force_h * (w * cos_gamma);
            let force_s = force_h * (tan * cos_gamma) * self.teeth_per_wave;
            force.wave_generator[i] = force_h;
            force.ring[i] = force_k;
            force.carrier[i] = force_s;
            let curvature = tooth_curvature + cam_curvature_per_mm[i];
            stress.wave_generator[i] = unit.stress(force_h, curvature * self.hertz.wave_generator, 1.0);
            stress.ring[i] = unit.stress(force_k, flat * per_regular, ring_hertz);
            stress.carrier[i] = unit.stress(force_s, 1.0, carrier_hertz);
            torque.wave_generator[i] = force_h * lever;
            // F_K sin β, with F_K cos β = F_H cos γ.
            torque.ring[i] = force_h * (cos_gamma * ring_tan) * d;
            torque.carrier[i] = force_s * d;
            if K::COLUMNS {
                // Tangents of the angles between contact points and position.
                let (cam_below, ring_below) = (d * v - r, d * w + r);
                let all = r * tan / (cam_below * ring_below);
                cam_ratio[i] = all * ring_below;
                ring_ratio[i] = k * all * cam_below;
            }
        }
        tile.center_radius_mm.as_chunks_mut::<LANES>().0[chunk] = radius_mm;
        if K::COLUMNS {
            self.place(tile, chunk, cam_ratio, ring_ratio);
        }
        true
    }

    /// Stores the angles of contact points, given the tangents of their angles to the position.
    #[inline(always)]
    fn place(&self, tile: &mut Tile<'_>, chunk: usize, mut cam_ratio: [f64; LANES], mut ring_ratio: [f64; LANES]) {
        let from_valley = &tile.from_valley_rad.as_chunks::<LANES>().0[chunk];
        let cam_angle_deg = &mut tile.wave_generator_angle_deg.as_chunks_mut::<LANES>().0[chunk];
        let ring_angle_deg = &mut tile.ring_angle_deg.as_chunks_mut::<LANES>().0[chunk];
        arctangents(&mut cam_ratio, self.cam_terms);
        arctangents(&mut ring_ratio, self.ring_terms);
        let (to_degrees, per_k) = (180.0 / PI, 1.0 / self.ring_teeth_per_wave);
        for i in 0..LANES {
            cam_angle_deg[i] = (from_valley[i] + cam_ratio[i]) * to_degrees;
            ring_angle_deg[i] = (from_valley[i] * per_k - ring_ratio[i]) * to_degrees;
        }
    }

    /// Computes what depends on the places of a tile: law and gaps. Returns false if it needs the plain path.
    #[inline(always)]
    fn prepare<V: Simd>(&self, loaded: &LoadedDrive<'_>, count: usize, tile: &mut Tile<'_>) -> bool {
        let Law::Sharing(sharing) = &self.law else { return true };
        let (teeth, work, gap_work, _) = self.teeth_of(count, tile);
        sharing.prepare::<V>(loaded.input_torque_nmm() / loaded.zones(), &teeth, work);
        self.gaps.as_ref().is_none_or(|gaps| gaps.prepare(&teeth, gap_work, work.closing))
    }

    /// Closes the gaps of the teeth of a lap if items are distinguished. Returns false if the tile needs the plain
    /// path.
    #[inline(always)]
    fn close(&self, mesh: &Mesh, lap_teeth: &LapTeeth, count: usize, tile: &mut Tile<'_>) -> bool {
        let Some(gaps) = self.gaps.as_ref().filter(|gaps| gaps.are_of_items()) else { return true };
        gaps.set_teeth(mesh, lap_teeth, &mut tile.gaps);
        let (teeth, work, gap_work, _) = self.teeth_of(count, tile);
        gaps.close_at_items(&teeth, gap_work, work.closing)
    }

    /// Computes the loads of a tile from its unit loads, and their limits. Returns none if it needs the plain path. If
    /// a limit is searched for, `shared` receives the result of load sharing first, because the limit overwrites it.
    #[inline(always)]
    fn loads<V: Simd>(
        &self,
        loaded: &LoadedDrive<'_>,
        teeth: usize,
        tile: &mut Tile<'_>,
        shared: impl FnOnce(&Sharing, &Work<'_>),
    ) -> Option<Option<Limit>> {
        let Law::Sharing(sharing) = &self.law else {
            Self::scale(loaded, teeth, tile);
            return Some(None);
        };
        if !self.share::<V>(sharing, loaded, teeth, tile) {
            return None;
        }
        shared(sharing, &tile.work);
        let limit = match &self.allowable_mpa {
            Some(allowable_mpa) => Some(self.limit::<V>(sharing, allowable_mpa, teeth, tile)?),
            None => None,
        };
        self.scale_shared::<V>(loaded, teeth, tile);
        Some(limit)
    }

    /// Rotates the wave generator at each input angle of a tile until the loads balance the torque.
    #[inline(always)]
    fn scale(loaded: &LoadedDrive<'_>, teeth: usize, tile: &mut Tile<'_>) {
        let rows = tile.sum_torques::<true>(teeth);
        let (input_nmm, zones) = (loaded.input_torque_nmm(), loaded.zones());
        let PerContact { wave_generator: cam, ring, carrier } = &mut tile.row_torque;
        let (cam, ring, carrier) = (&mut cam[..rows], &mut ring[..rows], &mut carrier[..rows]);
        let (rotation_rad, rotation_root) = (&mut tile.row_rotation_rad[..rows], &mut tile.row_rotation_root[..rows]);
        let stiffness = &mut tile.row_stiffness[..rows];
        for row in 0..rows {
            let rotation = input_nmm / (zones * cam[row]);
            rotation_rad[row] = rotation;
            rotation_root[row] = rotation.sqrt();
            stiffness[row] = zones * cam[row];
            let scale = zones * rotation;
            cam[row] *= scale;
            ring[row] *= scale;
            carrier[row] *= scale;
        }
        // Only a tooth in the valley, at the last place, has neither lever arm nor load.
        let lasts = tile.force.wave_generator[..tile.count].iter().skip(tile.last_place).step_by(teeth);
        tile.row_loaded.clear();
        tile.row_loaded.extend(lasts.map(|last| teeth - usize::from(*last <= 0.0)));
        repeat_each(rotation_rad, teeth, tile.scale);
        repeat_each(rotation_root, teeth, tile.scale_root);
    }

    /// Returns the teeth of a tile under 1 N, and the inputs and outputs of load sharing.
    #[inline(always)]
    fn teeth_of<'t, 'a>(
        &self,
        count: usize,
        tile: &'t mut Tile<'a>,
    ) -> (Teeth<'t>, &'t mut Work<'a>, &'t mut GapWork<'a>, Shared<'t>) {
        let teeth = Teeth {
            count,
            rows: tile.count / count,
            len: tile.count.next_multiple_of(LANES),
            center_radius_mm: tile.center_radius_mm,
            arm: tile.torque.wave_generator,
            ring_ratio: tile.force.ring,
            carrier_ratio: tile.force.carrier,
            cam_stress: tile.stress.wave_generator,
            ring_stress: tile.stress.ring,
            carrier_stress: tile.stress.carrier,
            stress_exponents: self.pressures.stress_exponents(),
        };
        let shared = Shared { force: tile.scale, rotation_rad: tile.row_rotation_rad, stiffness: tile.row_stiffness };
        (teeth, &mut tile.work, &mut tile.gaps, shared)
    }

    /// Shares the load among the teeth of each input angle. Returns false if it needs the plain path.
    #[inline(always)]
    fn share<V: Simd>(&self, sharing: &Sharing, loaded: &LoadedDrive<'_>, count: usize, tile: &mut Tile<'_>) -> bool {
        let (teeth, work, _, mut shared) = self.teeth_of(count, tile);
        sharing.share::<V>(loaded.input_torque_nmm() / loaded.zones(), &teeth, work, &mut shared)
    }

    /// Returns the limit of the teeth after load sharing; none if it needs the plain path.
    #[inline(always)]
    fn limit<V: Simd>(
        &self,
        sharing: &Sharing,
        allowable_mpa: &PerContact<f64>,
        count: usize,
        tile: &mut Tile<'_>,
    ) -> Option<Limit> {
        let per_allowable = PerContact::of(|contact| 1.0 / allowable_mpa.get(contact));
        let (teeth, work, _, _) = self.teeth_of(count, tile);
        sharing.limit::<V>(&per_allowable, &teeth, work)
    }

    /// Computes torques, stiffness and the number of carrying teeth after load sharing.
    #[inline(always)]
    fn scale_shared<V: Simd>(&self, loaded: &LoadedDrive<'_>, count: usize, tile: &mut Tile<'_>) {
        let zones = loaded.zones();
        let len = tile.count.next_multiple_of(LANES);
        let (scale, root) = (&tile.scale[..len], &mut tile.scale_root[..len]);
        let are_balls = matches!(self.pressures, Pressures::Ellipses(_));
        for i in 0..len {
            root[i] = if are_balls { cube_root::<V>(scale[i]) } else { scale[i].sqrt() };
        }
        let rows = tile.sum_torques::<false>(count);
        let PerContact { wave_generator: cam, ring, carrier } = &mut tile.row_torque;
        let (cam, ring, carrier) = (&mut cam[..rows], &mut ring[..rows], &mut carrier[..rows]);
        let (rotation_rad, stiffness) = (&mut tile.row_rotation_rad[..rows], &mut tile.row_stiffness[..rows]);
        let lost_motion_rad = self.gaps.as_ref().map_or(0.0, GapColumns::lost_motion_rad);
        for row in 0..rows {
            cam[row] *= zones;
            ring[row] *= zones;
            carrier[row] *= zones;
            stiffness[row] *= zones;
            rotation_rad[row] += lost_motion_rad;
        }
        tile.row_loaded.clear();
        let carrying = |row: &[f64]| row.iter().filter(|&&force| force > 0.0).count();
        tile.row_loaded.extend(tile.scale[..tile.count].chunks_exact(count).map(carrying));
    }

    /// Returns the largest torque residual of a tile and of the earlier ones.
    #[inline(always)]
    fn residual(balance: &TorqueBalance, rows: usize, tile: &mut Tile<'_>, before: f64) -> f64 {
        for row in 0..rows {
            let torque = PerContact::of(|contact| tile.row_torque.get(contact)[row]);
            tile.row_residual[row] = balance.residual(&torque);
        }
        tile.row_residual[..rows].iter().fold(before, |worst, &residual| worse(residual, worst))
    }
}

impl Limit {
    /// Returns the torque capacity at an input angle.
    fn capacity(&self, loaded: &LoadedDrive<'_>, input_angle_deg: f64) -> TorqueCapacity {
        let input_torque_nm = 1e-3 * (loaded.zones() * self.torque_nmm);
        let output_torque_nm = input_torque_nm * loaded.drive().teeth_per_wave();
        let limited_by = self.contact.into();
        TorqueCapacity { input_torque_nm, output_torque_nm, limited_by, turns_past_teeth: false, input_angle_deg }
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
