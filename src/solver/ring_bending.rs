//! How much further the ring gives way under a tooth towards its tips than at its root (docs/theory.md section 4.3, `ring_teeth_bend`).
//!
//! A force on the flank moves it as it would move a half-plane, and further, because the other faces of the ring's tooth bear nothing: what the
//! half-plane bears there has to be taken off the ring again. That is a problem of the boundary alone, without any singularity at the force, and
//! is solved by boundary elements: one dense system for all places of the force.

use std::f64::consts::PI;

use nalgebra::{DMatrix, Matrix2, Point2, Rotation2, Vector2};

use crate::contact::Material;
use crate::drive::Drive;
use crate::position::Position;
use crate::ring::RingFlank;
use crate::root::NotConverged;

/// Elements of either flank of the ring's tooth that is pressed; every other flank is a single one. With 64 of them, 16 on every other flank and a space
/// more on either side the compliance in case 5.2 is another one by 0.13 of the 21 units that the contact with the ring gives way by, in the last twentieth
/// of the flank by 0.4.
const FINE: usize = 16;

/// Elements of either half of its land, where the tip is bored, denser towards the flank's end; every other half is a single one. What the land would bear
/// of a half-plane beside a force at the flank's end is what bends the tooth there.
const FINE_OF_LAND: usize = 8;

/// Tooth spaces on either side of the one whose flank is pressed, at most.
const SPACES_BESIDE: u64 = 2;

/// How far behind its root the ring is held, in pitches of its teeth.
const HELD_BEHIND: f64 = 1.0;

/// Elements along each side of the piece of ring, and along the arc where it is held.
const ALONG_SIDE: u32 = 2;
const ALONG_ARC: u32 = 8;

/// Places of the force: the root and each element of the flank.
const KNOTS: usize = FINE + 1;

/// A tooth presses a stretch as wide as this part of its radius to either side, as far as contacts are: nearer to the flank's end it bends
/// the tooth no more.
const WIDTH_SHARE: f64 = 0.02;

/// What a ring gives way by under a tooth beyond what it gives way by at its root.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingBending {
    /// Where the flank ends.
    end: Point2<f64>,
    width_mm: f64,
    /// Of the contact's distance from the flank's end the logarithm, increasing; and by it the compliance in mm/N with its second derivative.
    ln_distance: [f64; KNOTS],
    compliance_mm_per_n: [f64; KNOTS],
    bend: [f64; KNOTS],
}

/// A straight piece of the boundary with the material on its left.
#[derive(Clone, Copy)]
struct Element {
    middle: Point2<f64>,
    along: Vector2<f64>,
    outward: Vector2<f64>,
    half: f64,
    is_held: bool,
}

/// A unit force on the surface of a half-plane of the same material, into it.
struct Force {
    at: Point2<f64>,
    inward: Vector2<f64>,
}

impl RingBending {
    /// Of a drive whose ring is of a material.
    ///
    /// # Errors
    /// [`NotConverged`] from the flank.
    pub fn new(drive: &Drive, ring: &Material) -> Result<Self, NotConverged> {
        let pitch_mm = 2.0 * PI * drive.root_radius_mm() / drive.parameters().ring_teeth.unsigned_abs() as f64;
        let piece = Piece::of(drive, pitch_mm)?;
        let give = piece.further_than_half_plane(ring.poissons_ratio)?;
        let end = flank_point(drive.flank(), drive.flank_limit().position)?;
        // Towards the root: the compliance is a difference from the last.
        let root = give[KNOTS - 1];
        let per_width_mm_per_n = ring.compliance_per_mpa() / drive.tooth_width_mm();
        let mut ln_distance = [0.0; KNOTS];
        let mut compliance_mm_per_n = [0.0; KNOTS];
        for (knot, element) in piece.pressed().iter().enumerate() {
            ln_distance[knot] = (element.middle * pitch_mm - end).norm().ln();
            compliance_mm_per_n[knot] = per_width_mm_per_n * (give[knot] - root);
        }
        let bend = spline_bends(&ln_distance, &compliance_mm_per_n);
        let width_mm = WIDTH_SHARE * drive.parameters().tooth_radius_mm;
        Ok(Self { end, width_mm, ln_distance, compliance_mm_per_n, bend })
    }

    /// Under a tooth that touches the flank at a point, in mm/N along the normal. A ring of few teeth, each as broad as the ring, may give way by less
    /// there than at its root; that counts as nothing, for beside stiff contacts it would be more than they have.
    pub fn compliance_mm_per_n(&self, contact: Point2<f64>) -> f64 {
        let ln = (contact - self.end).norm().hypot(self.width_mm).ln();
        let at = self.ln_distance[1..KNOTS - 1].partition_point(|&knot| knot < ln);
        let [low, high] = [self.ln_distance[at], self.ln_distance[at + 1]];
        let step = high - low;
        let (a, b) = ((high - ln) / step, (ln - low) / step);
        let bends = (a * a * a - a) * self.bend[at] + (b * b * b - b) * self.bend[at + 1];
        let compliance = a * self.compliance_mm_per_n[at] + b * self.compliance_mm_per_n[at + 1];
        (compliance + bends * step * step / 6.0).max(0.0)
    }
}

/// The second derivatives of the natural cubic spline through points.
fn spline_bends(x: &[f64; KNOTS], y: &[f64; KNOTS]) -> [f64; KNOTS] {
    let mut bends = [0.0; KNOTS];
    let mut share = [0.0; KNOTS];
    for i in 1..KNOTS - 1 {
        let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        let slopes = (y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * share[i - 1];
        share[i] = after / pivot;
        bends[i] = (6.0 * slopes - before * bends[i - 1]) / pivot;
    }
    for i in (1..KNOTS - 1).rev() {
        bends[i] -= share[i] * bends[i + 1];
    }
    bends
}

fn flank_point(flank: &RingFlank, position: Position) -> Result<Point2<f64>, NotConverged> {
    let tooth = flank.locus().at(position)?;
    Ok(flank.point(&tooth, &flank.at(&tooth)))
}

/// A piece of the ring, in pitches, as its boundary has it: teeth on either side of a tooth space, and where it is held.
struct Piece {
    elements: Vec<Element>,
    /// The first of the [`KNOTS`] elements that a tooth presses, from the flank's end to the root, which is pressed in the middle of its space.
    first_pressed: usize,
}

impl Piece {
    fn of(drive: &Drive, pitch_mm: f64) -> Result<Self, NotConverged> {
        let (flank, limit) = (drive.flank(), drive.flank_limit());
        let (lobes, ring_teeth) = (drive.lobes(), drive.parameters().ring_teeth.unsigned_abs());
        let mut fine = Vec::with_capacity(FINE + 1);
        for step in 0..FINE {
            // The root's element reaches from one flank to the other; towards the end they become shorter.
            let from_end = 1.0 - (step as f64 + 0.5) / (FINE as f64 + 0.5);
            let position_rad = limit.position.from_lobe_rad * (1.0 - from_end * from_end);
            fine.push(flank_point(flank, Position::from_lobe(position_rad, lobes))? / pitch_mm);
        }
        fine.push(flank_point(flank, limit.position)? / pitch_mm);
        let coarse = [fine[0], fine[FINE]];
        let half_pitch_rad = PI / ring_teeth as f64;
        // From the middle of the tip, where a land or nothing lies beyond the flank.
        let at_tip =
            |angle_rad: f64| Point2::new(angle_rad.cos(), angle_rad.sin()) * (drive.tip_radius_mm() / pitch_mm);
        let end_rad = fine[FINE].y.atan2(fine[FINE].x);
        let has_land = (at_tip(half_pitch_rad) - fine[FINE]).norm() > 1e-9;
        let land = |is_fine: bool| {
            let steps = if is_fine { FINE_OF_LAND } else { 1 };
            let shares = (1..=if has_land { steps } else { 0 }).rev().map(move |step| step as f64 / steps as f64);
            shares.map(move |share| at_tip(end_rad + (half_pitch_rad - end_rad) * share * share)).collect::<Vec<_>>()
        };
        let mirrored = |point: Point2<f64>| Point2::new(point.x, -point.y);
        let mut elements = Vec::new();
        let mut first_pressed = 0;
        // The piece's ends stay apart.
        let pressed_space = SPACES_BESIDE.min(ring_teeth.saturating_sub(2) / 2);
        for space in (0..=2 * pressed_space).rev() {
            let turn = Rotation2::new(2.0 * half_pitch_rad * (space as f64 - pressed_space as f64));
            let points = |is_fine: bool| if is_fine { &fine[..] } else { &coarse[..] };
            let (is_pressed, is_behind) = (space == pressed_space, space == pressed_space + 1);
            let (land_before, land_behind) = (land(is_pressed), land(is_behind));
            if is_pressed {
                first_pressed = elements.len() + land_before.len();
            }
            // Backwards about the axis, so that the material is on the left.
            let forward = land_before.into_iter().chain(points(is_pressed).iter().rev().copied());
            let backward = points(is_behind).iter().copied().chain(land_behind.into_iter().rev()).map(mirrored);
            let outline: Vec<_> = forward.chain(backward).map(|point| turn * point).collect();
            elements.extend(outline.windows(2).map(|ends| Element::new(ends[0], ends[1], false)));
        }
        if let [first, .., last] = elements[..] {
            elements.extend(held_around(last.end(), first.start(), drive.root_radius_mm() / pitch_mm + HELD_BEHIND));
        }
        Ok(Self { elements, first_pressed })
    }

    fn pressed(&self) -> &[Element] {
        &self.elements[self.first_pressed..][..KNOTS]
    }

    /// How much further than a half-plane the ring gives way under a force on each of the elements that are pressed; along the force, per unit of
    /// `(1 - ν²)/E` for each unit of width, and but for the same number for all.
    fn further_than_half_plane(&self, poissons_ratio: f64) -> Result<Vec<f64>, NotConverged> {
        let count = self.elements.len();
        let forces = self.pressed().iter().map(|element| Force { at: element.middle, inward: -element.outward });
        let forces: Vec<_> = forces.collect();
        let mut matrix = DMatrix::<f64>::zeros(2 * count, 2 * count);
        // What has to be added to the half-plane: on free faces the opposite of its tractions, on held ones of its displacements.
        let mut added = DMatrix::<f64>::zeros(2 * count, KNOTS);
        let mut known = DMatrix::<f64>::zeros(2 * count, 2 * count);
        for (column, element) in self.elements.iter().enumerate() {
            for (force, of) in forces.iter().enumerate() {
                // The face that bears the force bears no more than that.
                if column != self.first_pressed + force {
                    let [displacement, traction] = of.of_half_plane(element.middle, &element.outward, poissons_ratio);
                    let wanted = if element.is_held { -displacement } else { -traction };
                    added.fixed_view_mut::<2, 1>(2 * column, force).copy_from(&wanted);
                }
            }
            for (row, at) in self.elements.iter().enumerate() {
                let (by_traction, mut by_motion) = element.influence(at.middle, poissons_ratio);
                if row == column {
                    by_motion += 0.5 * Matrix2::identity();
                }
                let (of_unknown, of_known) =
                    if element.is_held { (-by_traction, -by_motion) } else { (by_motion, by_traction) };
                matrix.fixed_view_mut::<2, 2>(2 * row, 2 * column).copy_from(&of_unknown);
                known.fixed_view_mut::<2, 2>(2 * row, 2 * column).copy_from(&of_known);
            }
        }
        let singular =
            NotConverged { what: "bending of the ring's teeth", iterations: 1, bracket_width: f64::INFINITY };
        let solved = matrix.lu().solve(&(known * added)).ok_or(singular)?;
        let along = |(force, of): (usize, &Force)| {
            solved.fixed_view::<2, 1>(2 * (self.first_pressed + force), force).dot(&of.inward)
        };
        Ok(forces.iter().enumerate().map(along).collect())
    }
}

/// Outward from where the inner boundary ends, along the arc and inward to where it starts.
fn held_around(from: Point2<f64>, to: Point2<f64>, radius: f64) -> impl Iterator<Item = Element> {
    let on_arc = |angle_rad: f64| Point2::new(angle_rad.cos(), angle_rad.sin()) * radius;
    let [start_rad, end_rad] = [from, to].map(|point| point.y.atan2(point.x));
    let share = |step: u32, steps: u32| f64::from(step) / f64::from(steps);
    let outward = (0..ALONG_SIDE).map(move |step| from + (on_arc(start_rad) - from) * share(step, ALONG_SIDE));
    let around = (0..ALONG_ARC).map(move |step| on_arc(start_rad + (end_rad - start_rad) * share(step, ALONG_ARC)));
    let inward = (0..=ALONG_SIDE).map(move |step| on_arc(end_rad) + (to - on_arc(end_rad)) * share(step, ALONG_SIDE));
    let points: Vec<_> = outward.chain(around).chain(inward).collect();
    (1..points.len()).map(move |end| Element::new(points[end - 1], points[end], true))
}

impl Element {
    fn new(from: Point2<f64>, to: Point2<f64>, is_held: bool) -> Self {
        let way = to - from;
        let along = way.normalize();
        let outward = Vector2::new(along.y, -along.x);
        Self { middle: from + 0.5 * way, along, outward, half: 0.5 * way.norm(), is_held }
    }

    fn start(&self) -> Point2<f64> {
        self.middle - self.half * self.along
    }

    fn end(&self) -> Point2<f64> {
        self.middle + self.half * self.along
    }

    /// Kelvin's solution integrated over the element: what an even unit traction on it moves a point by, and what its own even unit displacement does,
    /// in plane strain of a material with `E/(1 - ν²) = 1`.
    fn influence(&self, point: Point2<f64>, poissons_ratio: f64) -> (Matrix2<f64>, Matrix2<f64>) {
        let nu = poissons_ratio;
        let from_middle = point - self.middle;
        let (x, y) = (from_middle.dot(&self.along), from_middle.dot(&self.outward));
        // The ends as seen from the point, along the element.
        let (low, high) = (x - self.half, x + self.half);
        let (low_squared, high_squared) = (low * low + y * y, high * high + y * y);
        // In the middle of the element itself the principal value.
        let seen_rad = if y == 0.0 { 0.0 } else { (high / y).atan() - (low / y).atan() };
        let ln_ratio = 0.5 * (high_squared / low_squared).ln();
        let ln = 0.5 * (high * high_squared.ln() - low * low_squared.ln()) - 2.0 * self.half + y * seen_rad;
        let cubic = 0.5 * (y * (high / high_squared - low / low_squared) + seen_rad);
        let square = -0.5 * y * y * (1.0 / high_squared - 1.0 / low_squared);
        // 2G = E/(1 + ν) = 1 - ν, so 8πG(1 - ν) = 4π(1 - ν)².
        let by_traction = Matrix2::new(
            2.0 * self.half - y * seen_rad - (3.0 - 4.0 * nu) * ln,
            y * ln_ratio,
            y * ln_ratio,
            y * seen_rad - (3.0 - 4.0 * nu) * ln,
        ) / (4.0 * PI * (1.0 - nu) * (1.0 - nu));
        let even = (1.0 - 2.0 * nu) * seen_rad;
        let odd = (1.0 - 2.0 * nu) * ln_ratio;
        let by_motion =
            Matrix2::new(even + 2.0 * (seen_rad - cubic), 2.0 * square - odd, 2.0 * square + odd, even + 2.0 * cubic)
                / (4.0 * PI * (1.0 - nu));
        let axes = Matrix2::from_columns(&[self.along, self.outward]);
        (axes * by_traction * axes.transpose(), axes * by_motion * axes.transpose())
    }
}

impl Force {
    /// Flamant's solution: the displacement of a point, but for a motion of the whole, and the traction on a face through it.
    fn of_half_plane(&self, point: Point2<f64>, outward: &Vector2<f64>, poissons_ratio: f64) -> [Vector2<f64>; 2] {
        // That of plane stress which plane strain is like.
        let nu = poissons_ratio / (1.0 - poissons_ratio);
        let across = Vector2::new(-self.inward.y, self.inward.x);
        let way = point - self.at;
        let (depth, aside) = (way.dot(&self.inward), way.dot(&across));
        let distance = depth.hypot(aside);
        let (sin, cos) = (aside / distance, depth / distance);
        // Counted from the direction away from the axis, so that it jumps towards the axis alone, where no ring is.
        let away = self.at.coords;
        let from_away_rad = away.perp(&way).atan2(away.dot(&way));
        let angle_rad = self.inward.perp(&away).atan2(self.inward.dot(&away)) + from_away_rad;
        let radial = -2.0 * cos * distance.ln() - (1.0 - nu) * angle_rad * sin;
        let around = 2.0 * sin * distance.ln() + (1.0 + nu) * sin - (1.0 - nu) * angle_rad * cos;
        let outwards = cos * self.inward + sin * across;
        let sideways = cos * across - sin * self.inward;
        let displacement = (radial * outwards + around * sideways) / PI;
        [displacement, outwards * (-2.0 * cos / (PI * distance) * outwards.dot(outward))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine over half a wave has no bend at its ends, as the spline has none.
    #[test]
    fn a_spline_bends_as_the_curve_whose_points_it_goes_through() {
        let x: [f64; KNOTS] = std::array::from_fn(|knot| knot as f64 / (KNOTS - 1) as f64);
        let x = x.map(|x| x * (0.5 + 0.5 * x));
        let bends = spline_bends(&x, &x.map(|x| (PI * x).sin()));
        for (x, bend) in x.into_iter().zip(bends) {
            assert!((bend + PI * PI * (PI * x).sin()).abs() < 0.05, "{bend} at {x}");
        }
    }

    #[test]
    fn a_spline_has_one_slope_on_either_side_of_its_points_and_no_bend_at_its_ends() {
        let x: [f64; KNOTS] = std::array::from_fn(|knot| (1.0 + knot as f64).ln() + 0.1 * (knot % 3) as f64);
        let y: [f64; KNOTS] = std::array::from_fn(|knot| (2.5 * knot as f64).sin());
        let bends = spline_bends(&x, &y);
        assert!(bends[0].abs() <= 0.0 && bends[KNOTS - 1].abs() <= 0.0);
        for i in 1..KNOTS - 1 {
            let slope =
                |to: usize| (y[to] - y[i]) / (x[to] - x[i]) - (x[to] - x[i]) * (2.0 * bends[i] + bends[to]) / 6.0;
            assert!((slope(i - 1) - slope(i + 1)).abs() < 1e-11, "{} and {}", slope(i - 1), slope(i + 1));
        }
    }
}
