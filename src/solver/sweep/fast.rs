//! A whole sweep at equally spaced input angles, many states at a time.
//!
//! The formulas are those of the plain path ([`crate::locus`], [`crate::ring`], [`crate::load_sharing`]), which stays as the oracle; here they
//! run over columns instead of one tooth, without a branch or a call, so that the compiler makes vectors of them. Three things make
//! that possible:
//!
//! - Equally spaced positions need no new sines: a tooth at a sample stands at the sum of a few angles, and the sine of a sum is made of
//!   products. The sums are taken so that nothing cancels near an axis.
//! - The support `h` follows by Halley's method for all states at once, with as many steps as the slowest of them needs: one or two.
//! - The only transcendental functions left are two arctangents of small ratios, for which a few terms of their series are enough; how many
//!   depends on the drive alone.
//!
//! What is left has three divisions and five square roots a state, beside the division of the position.
//!
//! Vectors are four doubles wide where the machine has AVX2, which is found out when the program runs (`pulp`). Eight, with AVX-512, were
//! 5 % slower on the Xeon that this was measured on.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
use std::iter::zip;
use std::ops::Range;

use crate::cam::Cam;
use crate::contact::PerContact;
use crate::load_sharing::{Compatibility, LoadedDrive};
use crate::mesh::{Mesh, Samples};
use crate::position::Position;
use crate::sweep::columns::{Columns, InputAngles, PeakAt, States, TorqueBalance, worse};
use crate::{SolveError, Stop};

/// States worked on in one stretch of straight code; a multiple of every vector's width.
const LANES: usize = 64;

/// States of a tile, where one input angle has no more: its columns stay in the first-level cache.
const TILE: usize = 128;

/// Doubles of the widest vector.
const VECTOR: usize = 8;

/// Steps towards the support at most. A drive that needs more goes the plain way.
const MAX_STEPS: u32 = 8;

/// A relative step this small is the last: the next one would be of its cube, less than the last digit.
const LAST_STEP: f64 = 5e-6;

/// Terms of the arctangent's series at most. A drive that needs more goes the plain way.
const MAX_TERMS: usize = 24;

/// The sweep, or nothing where the plain path has to make it: for a power law, for clearances, and for drives beyond the caps above.
///
/// # Errors
/// [`SolveError::Stopped`] when `stop` says so.
pub(crate) fn sweep(
    loaded: &LoadedDrive<'_>,
    samples: Samples,
    stop: &impl Stop,
) -> Result<Option<Columns>, SolveError> {
    let Some(kernel) = Kernel::new(loaded) else { return Ok(None) };
    pulp::Arch::new().dispatch(Vectorised { kernel: &kernel, loaded, samples, stop })
}

/// The sweep as `pulp` wants it: compiled once for each instruction set, the best one of this machine picked when the program runs. Whatever
/// it calls must be inlined into it, or it would be compiled for none of them.
struct Vectorised<'a, S> {
    kernel: &'a Kernel,
    loaded: &'a LoadedDrive<'a>,
    samples: Samples,
    stop: &'a S,
}

impl<S: Stop> pulp::WithSimd for Vectorised<'_, S> {
    type Output = Result<Option<Columns>, SolveError>;

    #[inline(always)]
    fn with_simd<V: pulp::Simd>(self, _: V) -> Self::Output {
        self.kernel.sweep(self.loaded, self.samples, self.stop)
    }
}

/// The constants of a drive under a load.
struct Kernel {
    a: f64,
    b: f64,
    r: f64,
    ring_teeth_per_wave: f64,
    teeth_per_wave: f64,
    difference_of_squares: f64,
    compliance: Compliance,
    /// `E*/(π L1)` of each contact.
    hertz: PerContact<f64>,
    /// Terms of the arctangent for the angle on the cam and on the ring.
    cam_terms: usize,
    ring_terms: usize,
    guess: Guess,
}

/// `c d²` of a tooth for a linear law: this much for each `(h + r)²` and `h'²`, which add up to `d²`.
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

/// Where the support is looked for first: the series of h in ε = (a - b)/(a + b), as far as its third power.
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
    fn new(loaded: &LoadedDrive<'_>) -> Option<Self> {
        let contact = loaded.linear_compliance_mm_per_n()?;
        let drive = loaded.drive();
        // The formulas are those of an ellipse, and one zone stands for both.
        let Cam::Ellipse(cam) = drive.flank().locus().cam() else { return None };
        if !Mesh::new(drive).zones_are_alike() {
            return None;
        }
        let (a, b, r) = (cam.semi_major_mm(), cam.semi_minor_mm(), drive.parameters().tooth_radius_mm);
        let difference_of_squares = cam.difference_of_squares_mm2();
        // Bounds of the two ratios over all positions: the first by the inequality of the means, the second by sin β ≤ 1.
        let cam_ratio = difference_of_squares * r * a / (2.0 * a * b * ((b * b + r * b) * (a * a + r * b)).sqrt());
        let ring_ratio = r / (b + r);
        Some(Self {
            a,
            b,
            r,
            ring_teeth_per_wave: drive.flank().teeth_per_wave(),
            teeth_per_wave: drive.teeth_per_wave(),
            difference_of_squares,
            compliance: Compliance::new(&contact, loaded),
            hertz: PerContact::of(|contact| loaded.hertz(contact).modulus_per_width_mpa_per_mm()),
            cam_terms: arctangent_terms(cam_ratio)?,
            ring_terms: arctangent_terms(ring_ratio)?,
            guess: Guess::new(a, b, r),
        })
    }

    #[inline(always)]
    fn sweep(
        &self,
        loaded: &LoadedDrive<'_>,
        samples: Samples,
        stop: &impl Stop,
    ) -> Result<Option<Columns>, SolveError> {
        let drive = loaded.drive();
        let mesh = Mesh::new(drive);
        let mut sweep = Columns {
            states: States::with_capacity(whole(mesh.state_count(samples))),
            input_angles: InputAngles::with_capacity(whole(samples.count() + 1)),
            peaks: PerContact::default(),
            torque_balance_residual: 0.0,
        };
        let mut peaks = PerContact::<[RunningPeak; 2]>::default();
        let size = TileSize::of(&mesh, samples);
        let mut arena = vec![0.0; size.doubles()];
        let mut tile = Tile::new(&mut arena, &size, 2.0 * PI / mesh.steps(samples) as f64);
        let mut first = 0;
        while first < samples.count() {
            let run = Run::from(first, samples, &mesh);
            run.lay_pattern(&mut tile);
            for start in run.samples.clone().step_by(run.rows) {
                if stop.stopped() {
                    return Err(SolveError::Stopped);
                }
                let tile_samples = start..run.samples.end.min(start + run.rows as u64);
                run.place(tile_samples.clone(), &mut tile);
                for chunk in 0..tile.count.div_ceil(LANES) {
                    if !self.unit_states(&mut tile, chunk) {
                        return Ok(None);
                    }
                }
                self.share_load(loaded, &mesh, tile_samples, &run, &mut tile, &mut sweep);
                tile.append_to(&mut sweep.states, &mut peaks);
            }
            first = run.samples.end;
        }
        sweep.peaks = PerContact::of(|contact| {
            let [force, stress] = peaks.get(contact);
            let states = &sweep.states;
            PeakAt {
                force: force.find(states.force_n.get(contact)),
                stress: stress.find(states.stress_mpa.get(contact)),
            }
        });
        // The last input angle repeats the first, every tooth one further.
        let end_deg = mesh.input_angle_deg(samples.count(), samples);
        sweep.states.repeat_first(mesh.teeth_at(0, samples).count(), end_deg);
        sweep.input_angles.repeat_first(end_deg);
        Ok(Some(sweep))
    }

    /// Geometry of a stretch of states, and their forces and stresses for `Δφ` = 1; false where the support takes too many steps.
    #[inline(always)]
    fn unit_states(&self, tile: &mut Tile<'_>, chunk: usize) -> bool {
        let sin = &tile.sin.as_chunks::<LANES>().0[chunk];
        let cos = &tile.cos.as_chunks::<LANES>().0[chunk];
        let Some(support) = self.supports(sin, cos) else { return false };
        let Self { a, b, r, ring_teeth_per_wave: k, difference_of_squares, compliance, .. } = *self;
        let from_minor = &tile.from_minor_rad.as_chunks::<LANES>().0[chunk];
        let center_radius_mm = &mut tile.center_radius_mm.as_chunks_mut::<LANES>().0[chunk];
        let cam_angle_deg = &mut tile.wave_generator_angle_deg.as_chunks_mut::<LANES>().0[chunk];
        let ring_angle_deg = &mut tile.ring_angle_deg.as_chunks_mut::<LANES>().0[chunk];
        let cam_force = &mut tile.force.wave_generator.as_chunks_mut::<LANES>().0[chunk];
        let ring_force = &mut tile.force.ring.as_chunks_mut::<LANES>().0[chunk];
        let carrier_force = &mut tile.force.carrier.as_chunks_mut::<LANES>().0[chunk];
        let cam_stress = &mut tile.stress.wave_generator.as_chunks_mut::<LANES>().0[chunk];
        let ring_stress = &mut tile.stress.ring.as_chunks_mut::<LANES>().0[chunk];
        let carrier_stress = &mut tile.stress.carrier.as_chunks_mut::<LANES>().0[chunk];
        let cam_torque = &mut tile.torque.wave_generator.as_chunks_mut::<LANES>().0[chunk];
        let ring_torque = &mut tile.torque.ring.as_chunks_mut::<LANES>().0[chunk];
        let carrier_torque = &mut tile.torque.carrier.as_chunks_mut::<LANES>().0[chunk];

        let mut cam_ratio = [0.0; LANES];
        let mut ring_ratio = [0.0; LANES];
        let (a2, b2, ab, k2) = (a * a, b * b, a * b, k * k);
        let tooth_curvature = 1.0 / r;
        let per_squares = 1.0 / (a2 * b2);
        let (ring_hertz, carrier_hertz) = (self.hertz.ring * tooth_curvature, self.hertz.carrier * tooth_curvature);
        // Divisions and roots cost most here. One reciprocal of a product serves all its factors, and γ and β are written with lengths,
        // tan γ = h'/(h + r), cos γ = (h + r)/d, tan β = k tan γ, cos β = (h + r)/e, so that d and e are the only roots.
        for i in 0..LANES {
            let h = support[i];
            let (above, sin_i, cos_i) = (h + r, sin[i], cos[i]);
            // The normal's direction, from the position's.
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
            // The regularity 1 + … is this over e³ d.
            let e3_d = e2 * de;
            let regular = e3_d + r * (above * e2 + k2 * d2 * bend);
            let least = f64::EPSILON * e3_d;
            let regular = if regular > least { regular } else { least };
            let compliance_d2 = compliance.of_above * above2 + compliance.of_lever * lever2;
            // Tangents of the angles that the contact points are off the position.
            let cam_below = b2 * (along_minor * sin_i) + a2 * (along_major * cos_i);
            let ring_below = de + r * above;

            let (loads, angles) = (compliance_d2 * regular, cam_below * ring_below);
            let angles_e = angles * e;
            let all = 1.0 / (loads * angles_e);
            let (per_loads, per_angles_e) = (all * angles_e, all * loads);
            let (per_compliance_d2, per_regular) = (per_loads * regular, per_loads * compliance_d2);
            let (per_angles, per_e) = (per_angles_e * e, per_angles_e * angles);
            cam_ratio[i] = (cos_i * sin_i) * (difference_of_squares * r * h) * (per_angles * ring_below);
            ring_ratio[i] = r * k * lever * (per_angles * cam_below);
            let load = lever * per_compliance_d2;
            let (force_h, force_k, force_s) = (load * d2, load * de, load * lever * d * self.teeth_per_wave);
            center_radius_mm[i] = d;
            cam_force[i] = force_h;
            ring_force[i] = force_k;
            carrier_force[i] = force_s;
            let cam_curvature = tooth_curvature + cube * per_squares;
            cam_stress[i] = (force_h * (cam_curvature * self.hertz.wave_generator)).sqrt();
            ring_stress[i] = (force_k * (e3_d * per_regular) * ring_hertz).sqrt();
            carrier_stress[i] = (force_s * carrier_hertz).sqrt();
            cam_torque[i] = force_h * lever;
            ring_torque[i] = force_k * (d * k * lever * per_e);
            carrier_torque[i] = force_s * d;
        }
        arctangents(&mut cam_ratio, self.cam_terms);
        arctangents(&mut ring_ratio, self.ring_terms);
        let (to_degrees, per_k) = (180.0 / PI, 1.0 / k);
        for i in 0..LANES {
            cam_angle_deg[i] = (from_minor[i] + cam_ratio[i]) * to_degrees;
            ring_angle_deg[i] = (from_minor[i] * per_k - ring_ratio[i]) * to_degrees;
        }
        true
    }

    /// The support h: the root in [b, a] of sin² (a² + rh)² (h² - b²) - cos² (b² + rh)² (a² - h²), by Halley's method, whose one division
    /// does what takes Newton's two. Nothing where that is too slow.
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

    /// Turns the wave generator at each input angle of a tile until the unit loads of its teeth balance the torque.
    #[inline(always)]
    fn share_load(
        &self,
        loaded: &LoadedDrive<'_>,
        mesh: &Mesh,
        samples: Range<u64>,
        run: &Run,
        tile: &mut Tile<'_>,
        sweep: &mut Columns,
    ) {
        let rows = tile.sum_torques(run.teeth);
        let input_nmm = loaded.input_torque_nmm();
        let balance = TorqueBalance::new(loaded.drive(), input_nmm);
        let PerContact { wave_generator: cam, ring, carrier } = &mut tile.row_torque;
        let (cam, ring, carrier) = (&cam[..rows], &ring[..rows], &carrier[..rows]);
        let (rotation_rad, rotation_root) = (&mut tile.row_rotation_rad[..rows], &mut tile.row_rotation_root[..rows]);
        let residual = &mut tile.row_residual[..rows];
        for row in 0..rows {
            let rotation = input_nmm / (loaded.zones() * cam[row]);
            rotation_rad[row] = rotation;
            rotation_root[row] = rotation.sqrt();
            let zones = loaded.zones() * rotation;
            let [wave_generator, ring, carrier] = [cam[row], ring[row], carrier[row]].map(|torque| zones * torque);
            residual[row] = balance.residual(&PerContact { wave_generator, ring, carrier });
        }
        sweep.torque_balance_residual =
            residual.iter().fold(sweep.torque_balance_residual, |worst, &residual| worse(residual, worst));
        for (angle_deg, sample) in zip(&mut tile.row_input_angle_deg[..rows], samples) {
            *angle_deg = mesh.input_angle_deg(sample, run.of);
        }
        let stiffness_nmm_per_rad = cam.iter().map(|cam| loaded.zones() * cam);
        // Only a tooth on the minor axis, the last one, has no lever arm and no load.
        let lasts = tile.force.wave_generator[..tile.count].iter().skip(run.teeth - 1).step_by(run.teeth);
        let loaded_teeth = lasts.map(|last| run.teeth - usize::from(*last <= 0.0));
        sweep.input_angles.extend(
            loaded.drive(),
            &tile.row_input_angle_deg[..rows],
            rotation_rad,
            stiffness_nmm_per_rad,
            loaded_teeth,
        );
        repeat_each(&tile.row_input_angle_deg[..rows], run.teeth, tile.input_angle_deg);
        repeat_each(rotation_rad, run.teeth, tile.rotation_rad);
        repeat_each(rotation_root, run.teeth, tile.rotation_root);
    }
}

/// The largest of values that are not negative: first of each lane, since one running value could not be vectorised.
#[inline(always)]
fn largest(values: &[f64]) -> f64 {
    let (stretches, rest) = values.as_chunks::<{ 2 * VECTOR }>();
    let mut most = [0.0; 2 * VECTOR];
    for stretch in stretches {
        for i in 0..2 * VECTOR {
            most[i] = if stretch[i] > most[i] { stretch[i] } else { most[i] };
        }
    }
    most.iter().chain(rest).fold(0.0, |most, &value| if value > most { value } else { most })
}

/// Each value so many times in a row. Whole vectors are written, and what is too much is overwritten by the next; the last needs room.
#[inline(always)]
fn repeat_each(values: &[f64], times: usize, repeated: &mut [f64]) {
    for (row, &value) in values.iter().enumerate() {
        for start in (row * times..(row + 1) * times).step_by(VECTOR) {
            repeated[start..start + VECTOR].fill(value);
        }
    }
}

/// A count that memory can hold, as an index; the caller has bounded the sweep.
fn whole(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}

/// How many terms of `atan q = q (1 - q²/3 + q⁴/5 - …)` reach the last digit for `0 ≤ q ≤ largest`.
fn arctangent_terms(largest: f64) -> Option<usize> {
    let square = largest * largest;
    let mut power = 1.0;
    (1..=MAX_TERMS).find(|_| {
        power *= square;
        power < 0.25 * f64::EPSILON
    })
}

/// The coefficients of `atan q` over `q` and the powers of `q²`.
const ARCTANGENT: [f64; MAX_TERMS] = {
    let mut coefficients = [0.0; MAX_TERMS];
    let (mut term, mut sign) = (0, 1.0);
    while term < MAX_TERMS {
        coefficients[term] = sign / (2 * term + 1) as f64;
        (term, sign) = (term + 1, -sign);
    }
    coefficients
};

/// Replaces small ratios by their arctangents.
#[inline(always)]
fn arctangents(ratios: &mut [f64; LANES], terms: usize) {
    let mut sums = [0.0; LANES];
    for coefficient in ARCTANGENT[..terms].iter().rev() {
        for i in 0..LANES {
            sums[i] = sums[i] * (ratios[i] * ratios[i]) + coefficient;
        }
    }
    for i in 0..LANES {
        ratios[i] *= sums[i];
    }
}

/// Sines and cosines of angles.
struct SineTable {
    sin: Vec<f64>,
    cos: Vec<f64>,
}

impl SineTable {
    /// Of `count` multiples of a step, at most [`TILE`], from 0 to at most a quarter of a turn: those of a few steps and those of a few strides, added.
    fn equally_spaced(step_rad: f64, count: usize) -> Self {
        // Strides are one or two more than a stride is long.
        const STRIDE: usize = TILE.isqrt() + 2;
        let sines = |step_rad: f64, count: usize| {
            let mut sines = [(0.0, 0.0); STRIDE];
            for (index, sines) in sines[..count].iter_mut().enumerate() {
                *sines = (step_rad * index as f64).sin_cos();
            }
            sines
        };
        let stride = count.isqrt().max(1);
        let strides = count.div_ceil(stride);
        let (fine, coarse) = (sines(step_rad, stride), sines(step_rad * stride as f64, strides));
        let mut table = Self { sin: Vec::with_capacity(count + stride), cos: Vec::with_capacity(count + stride) };
        for (coarse_sin, coarse_cos) in &coarse[..strides] {
            table.sin.extend(fine[..stride].iter().map(|(sin, cos)| coarse_sin * cos + coarse_cos * sin));
            table.cos.extend(fine[..stride].iter().map(|(sin, cos)| coarse_cos * cos - coarse_sin * sin));
        }
        table
    }
}

/// Input angles at which the same teeth mesh.
///
/// There a tooth stands at the sum of three angles: its own at the start of the run, one of the tile and one of the input angle within
/// the tile. The first and the last make a pattern that all tiles share, so that a tile takes the sine of a single angle. The teeth come
/// nearer to the major axis, so only for the one next to it does such a sum cancel: it is counted from the end of the tile.
struct Run {
    samples: Range<u64>,
    /// Samples of the period.
    of: Samples,
    teeth: usize,
    /// Samples of a tile: equally many, but for the last.
    rows: usize,
    mesh: Mesh,
    step_rad: f64,
    /// Steps of a whole turn.
    steps: f64,
}

impl Run {
    fn from(first: u64, of: Samples, mesh: &Mesh) -> Self {
        let samples = first..mesh.same_teeth_until(first, of);
        let steps = mesh.steps(of) as f64;
        let teeth = whole(*mesh.teeth_at(first, of).end());
        let count = whole(samples.end - samples.start);
        let rows = count.div_ceil(count.div_ceil((TILE / teeth).max(1)));
        Self { samples, of, teeth, rows, mesh: *mesh, step_rad: 2.0 * PI / steps, steps }
    }

    /// Lays the pattern of its tiles.
    #[inline(always)]
    fn lay_pattern(&self, tile: &mut Tile<'_>) {
        let Self { teeth, rows, .. } = *self;
        let (base_sin, base_cos) = (&mut tile.base_sin[..teeth], &mut tile.base_cos[..teeth]);
        for (tooth, base) in zip(1.., zip(&mut *base_sin, &mut *base_cos)) {
            let Position { phase_sin: sin, phase_cos: cos, .. } =
                self.mesh.position_in_mesh(tooth, self.samples.start, self.of);
            (*base.0, *base.1) = (sin, cos);
        }
        tile.tooth.clear();
        let last_tooth = u32::try_from(teeth).unwrap_or(u32::MAX);
        for row in 0..rows {
            let of_row = row * teeth..(row + 1) * teeth;
            let (row_sin, row_cos) = (tile.row_sines.sin[row], tile.row_sines.cos[row]);
            let (sin, cos) = (&mut tile.pattern_sin[of_row.clone()], &mut tile.pattern_cos[of_row.clone()]);
            let step = &mut tile.pattern_step[of_row];
            for i in 0..teeth {
                sin[i] = base_sin[i] * row_cos - base_cos[i] * row_sin;
                cos[i] = base_cos[i] * row_cos + base_sin[i] * row_sin;
                // Whole numbers below 2^53: exact.
                step[i] = (i + 1) as f64 * self.of.count() as f64 - row as f64;
            }
            tile.tooth.extend(1..=last_tooth);
        }
    }

    /// Positions of all teeth at some samples, by sample and then tooth.
    #[inline(always)]
    fn place(&self, samples: Range<u64>, tile: &mut Tile<'_>) {
        let rows = whole(samples.end - samples.start);
        tile.count = rows * self.teeth;
        let len = tile.count.next_multiple_of(LANES);
        let passed = samples.start as f64;
        let (turn_sin, turn_cos) = ((samples.start - self.samples.start) as f64 * self.step_rad).sin_cos();
        let (pattern_sin, pattern_cos) = (&tile.pattern_sin[..len], &tile.pattern_cos[..len]);
        let pattern_step = &tile.pattern_step[..len];
        let (sin, cos) = (&mut tile.sin[..len], &mut tile.cos[..len]);
        let (position_deg, from_minor_rad) = (&mut tile.position_deg[..len], &mut tile.from_minor_rad[..len]);
        let (steps, quarter_step_rad) = (self.steps, FRAC_PI_2 / self.steps);
        for i in 0..len {
            sin[i] = pattern_sin[i] * turn_cos - pattern_cos[i] * turn_sin;
            cos[i] = pattern_cos[i] * turn_cos + pattern_sin[i] * turn_sin;
            let step = pattern_step[i] - passed;
            position_deg[i] = 360.0 * step / steps;
            from_minor_rad[i] = (steps - 4.0 * step) * quarter_step_rad;
        }
        // The first tooth again, from where it will stand at the last sample.
        let end = self.mesh.position_in_mesh(1, samples.end - 1, self.of);
        for (row, to_end) in (0..rows).rev().enumerate() {
            let (row_sin, row_cos) = (tile.row_sines.sin[to_end], tile.row_sines.cos[to_end]);
            sin[row * self.teeth] = end.phase_sin * row_cos + end.phase_cos * row_sin;
            cos[row * self.teeth] = end.phase_cos * row_cos - end.phase_sin * row_sin;
        }
    }
}

/// The most that the tiles of a sweep hold.
struct TileSize {
    /// States, with those that fill the last stretch and room for [`repeat_each`].
    len: usize,
    /// Input angles.
    rows: usize,
    /// Teeth at an input angle.
    teeth: usize,
}

impl TileSize {
    fn of(mesh: &Mesh, samples: Samples) -> Self {
        let teeth_at = |sample| whole(*mesh.teeth_at(sample, samples).end());
        let (least, most) = (teeth_at(0).max(1), teeth_at(samples.count() - 1));
        let states = TILE.min(whole(mesh.state_count(samples))).max(most);
        let rows = whole(samples.count()).min(TILE.div_ceil(least));
        Self { len: states.next_multiple_of(LANES) + VECTOR, rows, teeth: most }
    }

    /// What all slices of a tile take together.
    const fn doubles(&self) -> usize {
        22 * self.len + 7 * self.rows + 2 * self.teeth
    }
}

/// Columns of the states of a few input angles: where they stand, their geometry, and what a unit rotation makes of them. All lie in one
/// stretch of memory.
struct Tile<'a> {
    /// States in it; lanes beyond the last one hold some tooth or other.
    count: usize,
    /// Of the steps from one input angle to the next.
    row_sines: SineTable,
    tooth: Vec<u32>,
    // Of the teeth at the start of the run.
    base_sin: &'a mut [f64],
    base_cos: &'a mut [f64],
    pattern_sin: &'a mut [f64],
    pattern_cos: &'a mut [f64],
    pattern_step: &'a mut [f64],
    sin: &'a mut [f64],
    cos: &'a mut [f64],
    from_minor_rad: &'a mut [f64],
    input_angle_deg: &'a mut [f64],
    position_deg: &'a mut [f64],
    center_radius_mm: &'a mut [f64],
    wave_generator_angle_deg: &'a mut [f64],
    ring_angle_deg: &'a mut [f64],
    /// Over `Δφ`.
    force: PerContact<&'a mut [f64]>,
    /// Over the root of `Δφ`.
    stress: PerContact<&'a mut [f64]>,
    /// Of the forces over `Δφ`.
    torque: PerContact<&'a mut [f64]>,
    rotation_rad: &'a mut [f64],
    rotation_root: &'a mut [f64],
    // By input angle.
    row_torque: PerContact<&'a mut [f64]>,
    row_input_angle_deg: &'a mut [f64],
    row_rotation_rad: &'a mut [f64],
    row_rotation_root: &'a mut [f64],
    row_residual: &'a mut [f64],
}

impl<'a> Tile<'a> {
    fn new(arena: &'a mut [f64], &TileSize { len, rows, teeth }: &TileSize, step_rad: f64) -> Self {
        let mut rest = arena;
        let mut slice = |len| {
            let (slice, others) = std::mem::take(&mut rest).split_at_mut(len);
            rest = others;
            slice
        };
        let (base_sin, base_cos) = (slice(teeth), slice(teeth));
        let row_torque = PerContact::of(|_| slice(rows));
        let (row_input_angle_deg, row_residual) = (slice(rows), slice(rows));
        let (row_rotation_rad, row_rotation_root) = (slice(rows), slice(rows));
        let mut column = || slice(len);
        let (pattern_sin, pattern_cos) = (column(), column());
        pattern_sin.fill(FRAC_1_SQRT_2);
        pattern_cos.fill(FRAC_1_SQRT_2);
        Self {
            count: 0,
            row_sines: SineTable::equally_spaced(step_rad, rows),
            tooth: Vec::with_capacity(len),
            base_sin,
            base_cos,
            pattern_sin,
            pattern_cos,
            pattern_step: column(),
            sin: column(),
            cos: column(),
            from_minor_rad: column(),
            input_angle_deg: column(),
            position_deg: column(),
            center_radius_mm: column(),
            wave_generator_angle_deg: column(),
            ring_angle_deg: column(),
            force: PerContact::of(|_| column()),
            stress: PerContact::of(|_| column()),
            torque: PerContact::of(|_| column()),
            rotation_rad: column(),
            rotation_root: column(),
            row_torque,
            row_input_angle_deg,
            row_rotation_rad,
            row_rotation_root,
            row_residual,
        }
    }

    /// Torques of a unit rotation summed over the teeth at each input angle; how many of these there are.
    #[inline(always)]
    fn sum_torques(&mut self, teeth: usize) -> usize {
        let rows = self.count / teeth;
        for row in 0..rows {
            let at = row * teeth..(row + 1) * teeth;
            let (cam, ring) = (&self.torque.wave_generator[at.clone()], &self.torque.ring[at.clone()]);
            let carrier = &self.torque.carrier[at];
            let (mut of_cam, mut of_ring, mut of_carrier) = (0.0, 0.0, 0.0);
            for ((cam, ring), carrier) in zip(zip(cam, ring), carrier) {
                of_cam += cam;
                of_ring += ring;
                of_carrier += carrier;
            }
            self.row_torque.wave_generator[row] = of_cam;
            self.row_torque.ring[row] = of_ring;
            self.row_torque.carrier[row] = of_carrier;
        }
        rows
    }

    #[inline(always)]
    fn append_to(&self, states: &mut States, peaks: &mut PerContact<[RunningPeak; 2]>) {
        let count = self.count;
        states.input_angle_deg.extend_from_slice(&self.input_angle_deg[..count]);
        states.tooth.extend_from_slice(&self.tooth[..count]);
        states.position_deg.extend_from_slice(&self.position_deg[..count]);
        states.center_radius_mm.extend_from_slice(&self.center_radius_mm[..count]);
        states.wave_generator_angle_deg.extend_from_slice(&self.wave_generator_angle_deg[..count]);
        states.ring_angle_deg.extend_from_slice(&self.ring_angle_deg[..count]);
        let PerContact { wave_generator: [force_h, stress_h], ring: [force_k, stress_k], carrier: [force_s, stress_s] } =
            peaks;
        let (rotation_rad, rotation_root) = (&self.rotation_rad[..count], &self.rotation_root[..count]);
        force_h.append(&mut states.force_n.wave_generator, self.force.wave_generator, rotation_rad);
        force_k.append(&mut states.force_n.ring, self.force.ring, rotation_rad);
        force_s.append(&mut states.force_n.carrier, self.force.carrier, rotation_rad);
        stress_h.append(&mut states.stress_mpa.wave_generator, self.stress.wave_generator, rotation_root);
        stress_k.append(&mut states.stress_mpa.ring, self.stress.ring, rotation_root);
        stress_s.append(&mut states.stress_mpa.carrier, self.stress.carrier, rotation_root);
    }
}

/// The largest value of a growing column, and the first state of the tile that it stands in.
#[derive(Clone, Copy, Default)]
struct RunningPeak {
    value: f64,
    start: usize,
}

impl RunningPeak {
    /// Appends unit loads times the rotations that go with them to the column, and looks at them while they are near.
    #[inline(always)]
    fn append(&mut self, column: &mut Vec<f64>, unit: &[f64], factor: &[f64]) {
        let start = column.len();
        column.extend(zip(unit, factor).map(|(unit, factor)| unit * factor));
        let value = largest(&column[start..]);
        if value > self.value {
            *self = Self { value, start };
        }
    }

    /// The state itself.
    fn find(&self, column: &[f64]) -> usize {
        self.start + column[self.start..].iter().position(|&value| value >= self.value).unwrap_or(0)
    }
}

impl States {
    /// Appends the first `teeth` states again, a period on.
    fn repeat_first(&mut self, teeth: usize, input_angle_deg: f64) {
        self.input_angle_deg.extend(std::iter::repeat_n(input_angle_deg, teeth));
        self.tooth.extend_from_within(..teeth);
        let last = self.tooth.len() - teeth;
        self.tooth[last..].iter_mut().for_each(|tooth| *tooth += 1);
        let PerContact { wave_generator: force_h, ring: force_k, carrier: force_s } = &mut self.force_n;
        let PerContact { wave_generator: stress_h, ring: stress_k, carrier: stress_s } = &mut self.stress_mpa;
        for column in [
            &mut self.position_deg,
            &mut self.center_radius_mm,
            &mut self.wave_generator_angle_deg,
            &mut self.ring_angle_deg,
            force_h,
            force_k,
            force_s,
            stress_h,
            stress_k,
            stress_s,
        ] {
            column.extend_from_within(..teeth);
        }
    }
}
