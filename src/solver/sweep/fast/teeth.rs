//! Geometry and unit loads of the teeth of a tile.

use std::f64::consts::PI;

use pulp::Simd;

use super::Kernel;
use super::centers::{CenterLanes, Centers};
use super::lanes::{LANES, arctangents};
use super::pressures::Pressures;
use super::shape::{EllipseShape, Shape};
use super::sinks::Sink;
use super::tile::{Tile, TileLanes};
use super::unit::stress_of;

impl Kernel<'_> {
    /// Computes all of a tile that depends on places only: geometry, unit loads, law and gaps. Returns false if it needs
    /// the plain path.
    #[inline(always)]
    pub(super) fn unit_loads<V: Simd, K: Sink>(&self, tile: &mut Tile<'_>) -> bool {
        let are_found = if matches!(self.pressures, Pressures::Ellipses(_)) {
            self.loads_of::<K, true>(tile)
        } else {
            self.loads_of::<K, false>(tile)
        };
        if !are_found || !self.pressures.finish::<V>(tile) {
            return false;
        }
        let Some(sharing) = &self.sharing else { return true };
        sharing.prepare::<V>(self.torque_of_zone_nmm(), tile);
        self.gaps.as_ref().is_none_or(|gaps| gaps.prepare(tile))
    }

    #[inline(always)]
    fn loads_of<K: Sink, const BALLS: bool>(&self, tile: &mut Tile<'_>) -> bool {
        // A plain loop: an iterator's method would not be compiled for these vectors.
        for chunk in 0..tile.count.div_ceil(LANES) {
            let are_found = match &self.shape {
                Shape::Ellipse(ellipse) => self.on_ellipse::<K, BALLS>(ellipse, tile, chunk),
                Shape::Path(centers) => self.on_path::<K, BALLS>(centers, tile, chunk),
            };
            if !are_found {
                return false;
            }
        }
        true
    }

    /// Computes geometry and unit loads of a chunk of states. Returns false if the support takes too many steps.
    #[inline(always)]
    fn on_ellipse<K: Sink, const BALLS: bool>(
        &self,
        ellipse: &EllipseShape,
        tile: &mut Tile<'_>,
        chunk: usize,
    ) -> bool {
        let TileLanes { sin, cos, force, stress, torque } = tile.lanes(chunk);
        let Some(support) = ellipse.supports(sin, cos) else { return false };
        let EllipseShape { a, b, r, difference_of_squares, .. } = *ellipse;
        let (k, unit) = (self.ring_teeth_per_wave, self.unit);

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
            stress.wave_generator[i] = stress_of::<BALLS>(force_h, cam_curvature * self.hertz.wave_generator, 1.0);
            stress.ring[i] = stress_of::<BALLS>(force_k, e3_d * per_regular, ring_hertz);
            stress.carrier[i] = stress_of::<BALLS>(force_s, 1.0, carrier_hertz);
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
    fn on_path<K: Sink, const BALLS: bool>(&self, centers: &Centers, tile: &mut Tile<'_>, chunk: usize) -> bool {
        let TileLanes { sin, cos, force, stress, torque } = tile.lanes(chunk);
        let Self { r, ring_teeth_per_wave: k, unit, .. } = *self;
        let Some(CenterLanes { radius_mm, tan, tan_derivative, cam_curvature_per_mm }) = centers.at(r, sin, cos) else {
            return false;
        };

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
            stress.wave_generator[i] = stress_of::<BALLS>(force_h, curvature * self.hertz.wave_generator, 1.0);
            stress.ring[i] = stress_of::<BALLS>(force_k, flat * per_regular, ring_hertz);
            stress.carrier[i] = stress_of::<BALLS>(force_s, 1.0, carrier_hertz);
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
}
