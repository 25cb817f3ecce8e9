//! A whole sweep at equally spaced input angles, many states at a time.
//!
//! The formulas are those of the plain path ([`crate::locus`], [`crate::ring`], [`crate::load_sharing`]), which stays as the oracle; here they
//! run over columns instead of one tooth, without a branch or a call, so that the compiler makes vectors of them. Three things make
//! that possible:
//!
//! - Equally spaced positions need no new sines: a tooth at a sample stands at the sum of two angles, one of the tooth and one of the
//!   sample, and the sine of a sum is made of products. Each sum is taken from the nearer axis, so that nothing cancels there.
//! - The support `h` follows by Newton's method for all states at once, with as many steps as the slowest of them needs: two or three.
//! - The only transcendental functions left are two arctangents of small ratios, for which a few terms of their series are enough; how many
//!   depends on the drive alone.
//!
//! The width of the vectors is chosen when the program runs (`pulp`).

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
use std::ops::Range;

use crate::contact::PerContact;
use crate::drive::{Drive, WAVES};
use crate::load_sharing::{Compatibility, LoadedDrive, WindUp};
use crate::mesh::Mesh;
use crate::sweep::{InputAngles, States};
use crate::{SolveError, Stop};

/// States worked on in one stretch of straight code; a multiple of every vector's width.
const LANES: usize = 64;

/// States of a tile, where one input angle has no more: its columns stay in the first-level cache.
const TILE: usize = 4 * LANES;

/// Newton steps at most. A drive that needs more goes the plain way.
const MAX_STEPS: u32 = 8;

/// A relative step this small is the last: the next one would be of its square.
const LAST_STEP: f64 = 1e-8;

/// Terms of the arctangent's series at most. A drive that needs more goes the plain way.
const MAX_TERMS: usize = 24;

/// What the plain path and this one both add to a sweep.
pub(crate) struct BatchSweep {
    pub(crate) states: States,
    pub(crate) input_angles: InputAngles,
    pub(crate) torque_balance_residual: f64,
}

/// The sweep, or nothing where the plain path has to make it: for a power law, for clearances, and for drives beyond the caps above.
///
/// # Errors
/// [`SolveError::Stopped`] when `stop` says so.
pub(crate) fn sweep(
    loaded: &LoadedDrive<'_>,
    samples: u64,
    stop: &impl Stop,
) -> Result<Option<BatchSweep>, SolveError> {
    let Some(kernel) = Kernel::new(loaded) else { return Ok(None) };
    pulp::Arch::new().dispatch(Vectorised { kernel: &kernel, loaded, samples, stop })
}

/// The sweep as `pulp` wants it: compiled once for each instruction set, the best one of this machine picked when the program runs. Whatever
/// it calls must be inlined into it, or it would be compiled for none of them.
struct Vectorised<'a, S> {
    kernel: &'a Kernel,
    loaded: &'a LoadedDrive<'a>,
    samples: u64,
    stop: &'a S,
}

impl<S: Stop> pulp::WithSimd for Vectorised<'_, S> {
    type Output = Result<Option<BatchSweep>, SolveError>;

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
    /// Coefficients of the compliance over its variable, which is chosen by the form of compatibility.
    compliance: Compliance,
    /// `E*/(π L1)` of each contact.
    hertz: PerContact<f64>,
    /// Terms of the arctangent for the angle on the cam and on the ring.
    cam_terms: usize,
    ring_terms: usize,
}

/// `c` of a tooth for a linear law.
#[derive(Clone, Copy)]
struct Compliance {
    contact: PerContact<f64>,
    compatibility: Compatibility,
    /// `1 + sk`.
    sensed_ratio: f64,
}

impl Kernel {
    fn new(loaded: &LoadedDrive<'_>) -> Option<Self> {
        let contact = loaded.linear_compliance_mm_per_n()?;
        let drive = loaded.drive();
        let p = drive.parameters();
        let (a, b, r) = (p.semi_major_mm, p.semi_minor_mm, p.tooth_radius_mm);
        let difference_of_squares = drive.flank().locus().cam().difference_of_squares_mm2();
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
            compliance: Compliance {
                contact,
                compatibility: loaded.compatibility(),
                sensed_ratio: 1.0 + drive.sense() * drive.flank().teeth_per_wave(),
            },
            hertz: PerContact::of(|contact| loaded.hertz(contact).modulus_per_width_mpa_per_mm()),
            cam_terms: arctangent_terms(cam_ratio)?,
            ring_terms: arctangent_terms(ring_ratio)?,
        })
    }

    #[inline(always)]
    fn sweep(
        &self,
        loaded: &LoadedDrive<'_>,
        samples: u64,
        stop: &impl Stop,
    ) -> Result<Option<BatchSweep>, SolveError> {
        let drive = loaded.drive();
        let mesh = Mesh::new(drive);
        let placing = Placing::new(drive, &mesh, samples);
        let mut sweep = BatchSweep {
            states: States::with_capacity(whole(mesh.state_count(samples))),
            input_angles: InputAngles::with_capacity(whole(samples + 1)),
            torque_balance_residual: 0.0,
        };
        let mut tile = Tile::new(whole(*mesh.teeth_at(samples - 1, samples).end()));
        let mut sample = 0;
        while sample < samples {
            if stop.stopped() {
                return Err(SolveError::Stopped);
            }
            // Whole input angles with the same teeth.
            let last = *mesh.teeth_at(sample, samples).end();
            let most = (TILE as u64 / last).max(1);
            let mut next = sample + 1;
            while next < samples.min(sample + most) && *mesh.teeth_at(next, samples).end() == last {
                next += 1;
            }
            let teeth = whole(last);
            let count = teeth * whole(next - sample);
            placing.place(sample..next, teeth, &mut tile);
            for chunk in 0..count.div_ceil(LANES) {
                if !self.unit_states(&mut tile, chunk) {
                    return Ok(None);
                }
            }
            for (row, sample) in (sample..next).enumerate() {
                let input_angle_deg = mesh.input_angle_deg(sample, samples);
                self.share_load(loaded, &mut tile, row * teeth..(row + 1) * teeth, input_angle_deg, &mut sweep);
            }
            tile.append_to(&mut sweep.states, count);
            sample = next;
        }
        // The last input angle repeats the first, every tooth one further.
        let end_deg = mesh.input_angle_deg(samples, samples);
        sweep.states.repeat_first(mesh.teeth_at(0, samples).count(), end_deg);
        sweep.input_angles.repeat_first(end_deg);
        Ok(Some(sweep))
    }

    /// Geometry of a stretch of states, and their forces and stresses for `Δφ` = 1; false where Newton's method is too slow.
    #[inline(always)]
    fn unit_states(&self, tile: &mut Tile, chunk: usize) -> bool {
        let Self { a, b, r, ring_teeth_per_wave: k, difference_of_squares, .. } = *self;
        let (a2, b2) = (a * a, b * b);
        let sin = &tile.sin.as_chunks::<LANES>().0[chunk];
        let cos = &tile.cos.as_chunks::<LANES>().0[chunk];
        let from_minor = &tile.from_minor_rad.as_chunks::<LANES>().0[chunk];
        let lever_mm = &mut tile.lever_mm.as_chunks_mut::<LANES>().0[chunk];
        let ring_lever_mm = &mut tile.ring_lever_mm.as_chunks_mut::<LANES>().0[chunk];
        let center_radius_mm = &mut tile.center_radius_mm.as_chunks_mut::<LANES>().0[chunk];
        let cam_angle_deg = &mut tile.wave_generator_angle_deg.as_chunks_mut::<LANES>().0[chunk];
        let ring_angle_deg = &mut tile.ring_angle_deg.as_chunks_mut::<LANES>().0[chunk];
        let cam_force = &mut tile.force.wave_generator.as_chunks_mut::<LANES>().0[chunk];
        let ring_force_n = &mut tile.force.ring.as_chunks_mut::<LANES>().0[chunk];
        let carrier_force_n = &mut tile.force.carrier.as_chunks_mut::<LANES>().0[chunk];
        let cam_stress = &mut tile.stress.wave_generator.as_chunks_mut::<LANES>().0[chunk];
        let ring_stress = &mut tile.stress.ring.as_chunks_mut::<LANES>().0[chunk];
        let carrier_stress = &mut tile.stress.carrier.as_chunks_mut::<LANES>().0[chunk];

        // The support h: the root in [b, a] of sin² (a² + rh)² (h² - b²) - cos² (b² + rh)² (a² - h²).
        let mut support = [0.0; LANES];
        // Begun at the linear interpolation between the axes and its next term in (a - b)/a, as far as a nearly round cam goes.
        let mean = 0.5 * (a + b);
        let bulge = (a - b) * (a - b) * (0.5 / mean - 4.0 / (mean + r));
        for i in 0..LANES {
            let cos2 = cos[i] * cos[i];
            let guess = b + (a - b) * cos2 + bulge * cos2 * (sin[i] * sin[i]);
            support[i] = if guess > b { guess } else { b };
        }
        let mut steps = 0;
        loop {
            let mut settled = 0;
            for i in 0..LANES {
                let h = support[i];
                let (major, minor) = (sin[i] * (a2 + r * h), cos[i] * (b2 + r * h));
                let (above_b, below_a) = ((h - b) * (h + b), (a - h) * (a + h));
                let value = major * major * above_b - minor * minor * below_a;
                let slope = major * (r * sin[i] * above_b + major * h) + minor * (minor * h - r * cos[i] * below_a);
                let step = value / (2.0 * slope);
                support[i] = h - step;
                settled += u64::from(step.abs() <= LAST_STEP * h);
            }
            steps += 1;
            if settled == LANES as u64 {
                break;
            }
            if steps == MAX_STEPS {
                return false;
            }
        }

        let mut cam_ratio = [0.0; LANES];
        let mut ring_ratio = [0.0; LANES];
        let Compliance { contact: of_contact, compatibility, sensed_ratio } = self.compliance;
        let by_virtual_work = compatibility == Compatibility::VirtualWork;
        let tooth_curvature = 1.0 / r;
        let per_squares = 1.0 / (a2 * b2);
        for i in 0..LANES {
            let h = support[i];
            let (above, sin_i, cos_i) = (h + r, sin[i], cos[i]);
            // The normal's direction, from the position's; only squares and products of its sine and cosine are needed.
            let (along_major, along_minor) = (cos_i * (b2 + r * h), sin_i * (a2 + r * h));
            let length2 = along_major * along_major + along_minor * along_minor;
            let cube = h * h * h;
            // r + ρ_H over h³.
            let curvature_sum = r * cube + a2 * b2;
            // Divisions cost most here: one reciprocal of a product serves all its factors.
            let all = 1.0 / ((h * above) * (curvature_sum * length2));
            let per_length2 = all * (h * above) * curvature_sum;
            let per_lengths = all * length2;
            let per_h = per_lengths * above * curvature_sum;
            let per_above = per_lengths * h * curvature_sum;
            let per_curvature_sum = cube * (per_lengths * h * above);
            let (cos2, sin2) = (along_major * along_major * per_length2, along_minor * along_minor * per_length2);
            let lever = difference_of_squares * (along_major * along_minor * per_length2) * per_h;
            let t = lever * per_above;
            let secant2 = 1.0 + t * t;
            let secant = secant2.sqrt();
            let center_radius = above * secant;
            let curvature_root = a * b * per_h;
            let second = (a - b) * ((b * sin2 - a * cos2) * per_h) * (curvature_root * per_h + 1.0);
            let t_slope = secant2 * (t * lever - second) * per_curvature_sum;
            // The ring.
            let ring_tan = k * t;
            let ring_secant2 = 1.0 + ring_tan * ring_tan;
            let ring_secant = ring_secant2.sqrt();
            let per_secants2 = 1.0 / (secant2 * ring_secant2);
            let cam_cos = secant * (ring_secant2 * per_secants2);
            let ring_cos2 = secant2 * per_secants2;
            let ring_cos = ring_secant * ring_cos2;
            let turning = 1.0 + k * k * t_slope * ring_cos2;
            let regularity = 1.0 + r * ring_cos * (per_above * cam_cos) * turning;
            let regularity = if regularity > f64::EPSILON { regularity } else { f64::EPSILON };
            // Forces over that of the wave generator, and the compliance.
            let ring_force = ring_secant * cam_cos;
            let cam_sin = t * cam_cos;
            let carrier_force = cam_sin * self.teeth_per_wave;
            let projected =
                of_contact.ring + sensed_ratio * (cam_sin * cam_sin) * (of_contact.carrier - of_contact.ring);
            let worked =
                of_contact.ring * (ring_force * ring_force) + of_contact.carrier * (carrier_force * carrier_force);
            let compliance = of_contact.wave_generator + if by_virtual_work { worked } else { projected };
            // Tangents of the angles that the contact points are off the position.
            let cam_below = b2 * (a2 + r * h) * (sin_i * sin_i) + a2 * (b2 + r * h) * (cos_i * cos_i);
            let ring_normal = r * ring_cos;
            let ring_below = center_radius + ring_normal;
            let all = 1.0 / ((compliance * regularity) * (cam_below * ring_below));
            let per_ratios = all * (compliance * regularity);
            let per_loads = all * (cam_below * ring_below);
            cam_ratio[i] = (cos_i * sin_i) * (difference_of_squares * r * h) * (per_ratios * ring_below);
            ring_ratio[i] = ring_normal * ring_tan * (per_ratios * cam_below);
            let unit = lever * (per_loads * regularity);
            let per_regularity = per_loads * compliance;
            center_radius_mm[i] = center_radius;
            cam_force[i] = unit;
            ring_force_n[i] = unit * ring_force;
            carrier_force_n[i] = unit * carrier_force;
            let cam_curvature = tooth_curvature + cube * per_squares;
            cam_stress[i] = (unit * (cam_curvature * self.hertz.wave_generator)).sqrt();
            ring_stress[i] = (unit * ring_force * per_regularity * (tooth_curvature * self.hertz.ring)).sqrt();
            carrier_stress[i] = (unit * carrier_force * (tooth_curvature * self.hertz.carrier)).sqrt();
            // What the torques are summed from.
            lever_mm[i] = lever;
            ring_lever_mm[i] = ring_tan * ring_cos * center_radius;
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

    /// What the unit loads of the teeth at one input angle are to be multiplied by to balance the torque, and how well they then do.
    #[inline(always)]
    fn share_load(
        &self,
        loaded: &LoadedDrive<'_>,
        tile: &mut Tile,
        teeth: Range<usize>,
        input_angle_deg: f64,
        sweep: &mut BatchSweep,
    ) {
        let (mut cam, mut ring, mut carrier) = (0.0, 0.0, 0.0);
        let mut loaded_teeth = 0;
        for i in teeth.clone() {
            cam += tile.force.wave_generator[i] * tile.lever_mm[i];
            ring += tile.force.ring[i] * tile.ring_lever_mm[i];
            carrier += tile.force.carrier[i] * tile.center_radius_mm[i];
            loaded_teeth += usize::from(tile.force.wave_generator[i] > 0.0);
        }
        let input_nmm = loaded.input_torque_nmm();
        let stiffness_nmm_per_rad = WAVES * cam;
        let rotation_rad = input_nmm / stiffness_nmm_per_rad;
        tile.rotation_rad[teeth.clone()].fill(rotation_rad);
        tile.rotation_root[teeth.clone()].fill(rotation_rad.sqrt());
        tile.input_angle_deg[teeth].fill(input_angle_deg);
        let wind_up = WindUp { closing_rad: 0.0, excess_rad: rotation_rad, stiffness_nmm_per_rad };
        sweep.input_angles.push(loaded.drive(), input_angle_deg, &wind_up, loaded_teeth);
        let off = |unit_torque: f64, ratio: f64| (WAVES * unit_torque * rotation_rad / (input_nmm * ratio) - 1.0).abs();
        let residual = off(cam, 1.0).max(off(ring, self.ring_teeth_per_wave)).max(off(carrier, self.teeth_per_wave));
        sweep.torque_balance_residual = sweep.torque_balance_residual.max(residual);
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

/// Replaces small ratios by their arctangents.
#[inline(always)]
fn arctangents(ratios: &mut [f64; LANES], terms: usize) {
    let mut sums = [0.0; LANES];
    for term in (0..terms).rev() {
        let sign = if term % 2 == 0 { 1.0 } else { -1.0 };
        let coefficient = sign / (2 * term + 1) as f64;
        for i in 0..LANES {
            sums[i] = sums[i] * (ratios[i] * ratios[i]) + coefficient;
        }
    }
    for i in 0..LANES {
        ratios[i] *= sums[i];
    }
}

/// Sines and cosines of angles.
#[derive(Default)]
struct SineTable {
    sin: Vec<f64>,
    cos: Vec<f64>,
}

impl SineTable {
    /// Of `count` multiples of a step, from 0 to at most a quarter of a turn: those of a few steps and those of a few strides, added.
    fn equally_spaced(step_rad: f64, count: usize) -> Self {
        let stride = count.isqrt().max(1);
        let sines = |step_rad: f64, count: usize| -> Vec<(f64, f64)> {
            (0..count).map(|index| (step_rad * index as f64).sin_cos()).collect()
        };
        let fine = sines(step_rad, stride);
        let coarse = sines(step_rad * stride as f64, count.div_ceil(stride));
        let mut table = Self { sin: Vec::with_capacity(count + stride), cos: Vec::with_capacity(count + stride) };
        for (coarse_sin, coarse_cos) in coarse {
            table.sin.extend(fine.iter().map(|(sin, cos)| coarse_sin * cos + coarse_cos * sin));
            table.cos.extend(fine.iter().map(|(sin, cos)| coarse_cos * cos - coarse_sin * sin));
        }
        table
    }

    /// Of any angles, each by itself.
    fn of(angles_rad: impl Iterator<Item = f64>) -> Self {
        let (sin, cos) = angles_rad.map(f64::sin_cos).unzip();
        Self { sin, cos }
    }
}

/// Where the teeth stand: each as the sum of an angle of its own and one of the sample.
struct Placing {
    samples: u64,
    installed: u64,
    of_samples: SineTable,
    /// Teeth nearer to the major axis: angle from it at the end of the period.
    low: SineTable,
    /// Teeth nearer to the minor axis, by number less `low`'s: angle from it at the start of the period.
    high: SineTable,
    /// The tooth that crosses the minor axis during the period, which no such sum reaches without cancellation.
    crossing: Option<usize>,
    mesh: Mesh,
}

impl Placing {
    fn new(drive: &Drive, mesh: &Mesh, samples: u64) -> Self {
        let installed = drive.parameters().installed.unsigned_abs();
        let spacing_rad = 2.0 * PI / installed as f64;
        let count = whole(samples + 1);
        let low_teeth = installed / 8;
        let high_teeth = installed / 4 - low_teeth;
        let crosses = !installed.is_multiple_of(4);
        let quarter = 0.25 * installed as f64;
        Self {
            samples,
            installed,
            of_samples: SineTable::equally_spaced(spacing_rad / samples as f64, count),
            low: SineTable::of((0..low_teeth).map(|tooth| tooth as f64 * spacing_rad)),
            high: SineTable::of((1..=high_teeth).map(|tooth| (quarter - (low_teeth + tooth) as f64) * spacing_rad)),
            crossing: crosses.then(|| whole(low_teeth + high_teeth)),
            mesh: *mesh,
        }
    }

    /// Numbers and positions of the first `teeth` teeth at some samples, by sample and then tooth.
    #[inline(always)]
    fn place(&self, samples: Range<u64>, teeth: usize, tile: &mut Tile) {
        let steps = (self.samples * self.installed) as f64;
        let low = teeth.min(self.low.sin.len());
        let high = (teeth - low).min(self.high.sin.len());
        for (row, sample) in samples.enumerate() {
            let start = row * teeth;
            let (at_start, at_end) = (whole(sample), whole(self.samples - sample));
            let (end_sin, end_cos) = (self.of_samples.sin[at_end], self.of_samples.cos[at_end]);
            let (start_sin, start_cos) = (self.of_samples.sin[at_start], self.of_samples.cos[at_start]);
            let (sin, cos) = (&mut tile.sin[start..start + teeth], &mut tile.cos[start..start + teeth]);
            for i in 0..low {
                sin[i] = self.low.sin[i] * end_cos + self.low.cos[i] * end_sin;
                cos[i] = self.low.cos[i] * end_cos - self.low.sin[i] * end_sin;
            }
            for i in 0..high {
                cos[low + i] = self.high.sin[i] * start_cos + self.high.cos[i] * start_sin;
                sin[low + i] = self.high.cos[i] * start_cos - self.high.sin[i] * start_sin;
            }
            if let Some(tooth) = self.crossing.filter(|&tooth| tooth < teeth) {
                let position = self.mesh.position(tooth as u64 + 1, sample, self.samples);
                (sin[tooth], cos[tooth]) = (position.sin, position.cos);
            }
            let passed = sample as f64;
            for i in 0..teeth {
                // Whole numbers below 2^53: exact.
                let step = (i + 1) as f64 * self.samples as f64 - passed;
                tile.position_deg[start + i] = 360.0 * step / steps;
                tile.from_minor_rad[start + i] = (steps - 4.0 * step) * (FRAC_PI_2 / steps);
            }
            for (tooth, number) in tile.tooth[start..start + teeth].iter_mut().zip(1..) {
                *tooth = number;
            }
        }
    }
}

/// Columns of the states of a few input angles: where they stand, their geometry, and what a unit rotation makes of them.
struct Tile {
    sin: Vec<f64>,
    cos: Vec<f64>,
    from_minor_rad: Vec<f64>,
    input_angle_deg: Vec<f64>,
    tooth: Vec<u32>,
    position_deg: Vec<f64>,
    center_radius_mm: Vec<f64>,
    wave_generator_angle_deg: Vec<f64>,
    ring_angle_deg: Vec<f64>,
    lever_mm: Vec<f64>,
    /// `d sin β`.
    ring_lever_mm: Vec<f64>,
    /// Over `Δφ`.
    force: PerContact<Vec<f64>>,
    /// Over the root of `Δφ`.
    stress: PerContact<Vec<f64>>,
    rotation_rad: Vec<f64>,
    rotation_root: Vec<f64>,
}

impl Tile {
    /// For up to [`TILE`] states, or those of one input angle; lanes beyond the last state hold some tooth or other.
    fn new(teeth: usize) -> Self {
        let len = TILE.max(teeth.next_multiple_of(LANES));
        let column = || vec![0.0; len];
        Self {
            sin: vec![FRAC_1_SQRT_2; len],
            cos: vec![FRAC_1_SQRT_2; len],
            from_minor_rad: column(),
            input_angle_deg: column(),
            tooth: vec![0; len],
            position_deg: column(),
            center_radius_mm: column(),
            wave_generator_angle_deg: column(),
            ring_angle_deg: column(),
            lever_mm: column(),
            ring_lever_mm: column(),
            force: PerContact::of(|_| column()),
            stress: PerContact::of(|_| column()),
            rotation_rad: column(),
            rotation_root: column(),
        }
    }

    #[inline(always)]
    fn append_to(&self, states: &mut States, count: usize) {
        states.input_angle_deg.extend_from_slice(&self.input_angle_deg[..count]);
        states.tooth.extend_from_slice(&self.tooth[..count]);
        states.position_deg.extend_from_slice(&self.position_deg[..count]);
        states.center_radius_mm.extend_from_slice(&self.center_radius_mm[..count]);
        states.wave_generator_angle_deg.extend_from_slice(&self.wave_generator_angle_deg[..count]);
        states.ring_angle_deg.extend_from_slice(&self.ring_angle_deg[..count]);
        let scaled = |to: &mut Vec<f64>, unit: &[f64], factor: &[f64]| {
            to.extend(unit[..count].iter().zip(&factor[..count]).map(|(unit, factor)| unit * factor));
        };
        scaled(&mut states.force_n.wave_generator, &self.force.wave_generator, &self.rotation_rad);
        scaled(&mut states.force_n.ring, &self.force.ring, &self.rotation_rad);
        scaled(&mut states.force_n.carrier, &self.force.carrier, &self.rotation_rad);
        scaled(&mut states.stress_mpa.wave_generator, &self.stress.wave_generator, &self.rotation_root);
        scaled(&mut states.stress_mpa.ring, &self.stress.ring, &self.rotation_root);
        scaled(&mut states.stress_mpa.carrier, &self.stress.carrier, &self.rotation_root);
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
