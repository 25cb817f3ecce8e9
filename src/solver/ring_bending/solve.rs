//! System of boundary elements, assembled and solved in columns that the compiler can vectorise.

use std::f64::consts::PI;

use nalgebra::Vector2;
use pulp::{Simd, WithSimd};

use crate::ring_bending::boundary::{Element, KNOTS, Piece};
use crate::root::NotConverged;
use crate::sweep::fast::lanes::{VECTOR, angle, fused, ln};

/// Returns the displacement of the ring in excess of a half-plane, under a force on each of the loaded elements and
/// along it.
pub(super) fn further_than_half_plane(piece: &Piece, poissons_ratio: f64) -> Result<[f64; KNOTS], NotConverged> {
    let singular = NotConverged { what: "bending of the ring's teeth", iterations: 1, bracket_width: f64::INFINITY };
    pulp::Arch::new().dispatch(Solving { piece, poissons_ratio }).ok_or(singular)
}

struct Solving<'a> {
    piece: &'a Piece,
    poissons_ratio: f64,
}

impl WithSimd for Solving<'_> {
    type Output = Option<[f64; KNOTS]>;

    #[inline(always)]
    fn with_simd<V: Simd>(self, _: V) -> Self::Output {
        let points = Points::of(&self.piece.elements);
        let mut system = assembled::<V>(self.piece, &points, self.poissons_ratio);
        if !system.eliminate::<V>() {
            return None;
        }
        let pressed = self.piece.pressed();
        let mut give = [0.0; KNOTS];
        for (force, element) in pressed.iter().enumerate() {
            let [x, y] = system.solution(force, 2 * (self.piece.elements.len() - KNOTS + force));
            give[force] = -(element.outward.x * x + element.outward.y * y);
        }
        Some(give)
    }
}

/// Midpoints of all elements with their outward directions, and flags of the fixed ones, in columns of whole vectors.
struct Points {
    x: Vec<f64>,
    y: Vec<f64>,
    outward_x: Vec<f64>,
    outward_y: Vec<f64>,
    /// 1 if the element is fixed, else 0.
    held: Vec<f64>,
}

impl Points {
    fn of(elements: &[Element]) -> Self {
        // Padding of the last vector is far away and has no effect.
        const FAR: f64 = 1e3;
        let column = |of: fn(&Element) -> f64, beyond: f64| {
            let mut column: Vec<_> = elements.iter().map(of).collect();
            column.resize(elements.len().next_multiple_of(VECTOR), beyond);
            column
        };
        Self {
            x: column(|element| element.middle.x, FAR),
            y: column(|element| element.middle.y, FAR),
            outward_x: column(|element| element.outward.x, 0.0),
            outward_y: column(|element| element.outward.y, 0.0),
            held: column(|element| f64::from(u8::from(element.is_held)), 0.0),
        }
    }

    /// Returns the number of points with padding.
    fn len(&self) -> usize {
        self.x.len()
    }
}

/// The components x and y of a vector at each point.
type Vectors = [Vec<f64>; 2];

/// Vectors at each point by an element's vector along x, then by one along y.
type Influence = [Vectors; 2];

#[inline(always)]
fn assembled<V: Simd>(piece: &Piece, points: &Points, poissons_ratio: f64) -> System {
    let elements = &piece.elements;
    let len = points.len();
    let vectors = || -> Vectors { [vec![0.0; len], vec![0.0; len]] };
    let first_pressed = elements.len() - KNOTS;
    // Added to the half-plane under each force: on free faces the negative of its tractions, on fixed ones of its
    // displacements. The loaded face needs no correction.
    let mut added = Vec::with_capacity(KNOTS);
    for (force, element) in piece.pressed().iter().enumerate() {
        let mut vectors = vectors();
        opposite_of_half_plane::<V>(element, points, poissons_ratio, &mut vectors);
        for component in &mut vectors {
            component[first_pressed + force] = 0.0;
        }
        added.push(vectors);
    }
    let mut system = System::new(elements.len(), len);
    let [mut by_traction, mut by_motion]: [Influence; 2] = [[vectors(), vectors()], [vectors(), vectors()]];
    for (at, element) in elements.iter().enumerate() {
        influence::<V>(element, points, poissons_ratio, &mut by_traction, &mut by_motion);
        let [[x_along_x, _], [_, y_along_y]] = &mut by_motion;
        x_along_x[at] += 0.5;
        y_along_y[at] += 0.5;
        for column in by_traction.iter_mut().chain(&mut by_motion).flatten() {
            column[elements.len()..].fill(0.0);
        }
        let (unknown, known, sign) =
            if element.is_held { (&by_traction, &by_motion, -1.0) } else { (&by_motion, &by_traction, 1.0) };
        for (column, [of_x, of_y]) in unknown.iter().enumerate() {
            let (x, y) = system.columns[2 * at + column].split_at_mut(len);
            for i in 0..len {
                (x[i], y[i]) = (sign * of_x[i], sign * of_y[i]);
            }
        }
        let [[xx, yx], [xy, yy]] = known;
        for (force, [added_x, added_y]) in added.iter().enumerate() {
            let (by_x, by_y) = (sign * added_x[at], sign * added_y[at]);
            let (x, y) = system.columns[2 * elements.len() + force].split_at_mut(len);
            for i in 0..len {
                x[i] = fused::<V>(by_x, xx[i], fused::<V>(by_y, xy[i], x[i]));
                y[i] = fused::<V>(by_x, yx[i], fused::<V>(by_y, yy[i], y[i]));
            }
        }
    }
    system
}

/// Integrates Kelvin's solution over an element: the displacement of each point by its uniform unit traction, and by
/// its uniform unit displacement, in plane strain of a material with `E/(1 - ν²) = 1`.
#[inline(always)]
fn influence<V: Simd>(
    element: &Element,
    points: &Points,
    poissons_ratio: f64,
    by_traction: &mut Influence,
    by_motion: &mut Influence,
) {
    let nu = poissons_ratio;
    // 2G = E/(1 + ν) = 1 - ν, so 8πG(1 - ν) = 4π(1 - ν)².
    let of_motion = 1.0 / (4.0 * PI * (1.0 - nu));
    let of_traction = of_motion / (1.0 - nu);
    let (stretch, share) = (3.0 - 4.0 * nu, 1.0 - 2.0 * nu);
    let (a, o, half) = (element.along, element.outward, element.half);
    let len = points.len();
    let (point_x, point_y) = (&points.x[..len], &points.y[..len]);
    let [[txx, tyx], [txy, tyy]] = by_traction.each_mut().map(|of| of.each_mut().map(|column| &mut column[..len]));
    let [[mxx, myx], [mxy, myy]] = by_motion.each_mut().map(|of| of.each_mut().map(|column| &mut column[..len]));
    for i in 0..len {
        let (dx, dy) = (point_x[i] - element.middle.x, point_y[i] - element.middle.y);
        let (x, y) = (dx * a.x + dy * a.y, dx * o.x + dy * o.y);
        // The ends as seen from the point, along the element.
        let (low, high) = (x - half, x + half);
        let (low_squared, high_squared) = (low * low + y * y, high * high + y * y);
        // At the middle of the element itself the principal value.
        let seen_rad = angle::<V>(2.0 * half * y, low * high + y * y);
        let seen_rad = if y == 0.0 { 0.0 } else { seen_rad };
        let (ln_low, ln_high) = (ln::<V>(low_squared), ln::<V>(high_squared));
        let ln_ratio = 0.5 * (ln_high - ln_low);
        let ln_mean = 0.5 * (high * ln_high - low * ln_low) - 2.0 * half + y * seen_rad;
        let (over_low, over_high) = (1.0 / low_squared, 1.0 / high_squared);
        let cubic = 0.5 * (y * (high * over_high - low * over_low) + seen_rad);
        let square = -0.5 * y * y * (over_high - over_low);
        let traction = [
            of_traction * (2.0 * half - y * seen_rad - stretch * ln_mean),
            of_traction * y * ln_ratio,
            of_traction * (y * seen_rad - stretch * ln_mean),
        ];
        let (even, odd) = (share * seen_rad, share * ln_ratio);
        let motion = [
            of_motion * (even + 2.0 * (seen_rad - cubic)),
            of_motion * (2.0 * square - odd),
            of_motion * (2.0 * square + odd),
            of_motion * (even + 2.0 * cubic),
        ];
        // From the element's axes to those of the ring.
        let [aa, ao, oo] = traction;
        (txx[i], txy[i]) = (
            aa * a.x * a.x + 2.0 * ao * a.x * o.x + oo * o.x * o.x,
            aa * a.x * a.y + ao * (a.x * o.y + o.x * a.y) + oo * o.x * o.y,
        );
        (tyx[i], tyy[i]) = (txy[i], aa * a.y * a.y + 2.0 * ao * a.y * o.y + oo * o.y * o.y);
        let [aa, ao, oa, oo] = motion;
        let (to_x, to_y) = (aa * a.x + oa * o.x, aa * a.y + oa * o.y);
        let (across_x, across_y) = (ao * a.x + oo * o.x, ao * a.y + oo * o.y);
        (mxx[i], mxy[i]) = (to_x * a.x + across_x * o.x, to_x * a.y + across_x * o.y);
        (myx[i], myy[i]) = (to_y * a.x + across_y * o.x, to_y * a.y + across_y * o.y);
    }
}

/// Computes Flamant's solution for a unit force into an element, on a half-plane of the same material. For each point
/// it gives the negative of the displacement (up to a rigid motion) if the point is fixed, otherwise of the traction.
#[inline(always)]
fn opposite_of_half_plane<V: Simd>(element: &Element, points: &Points, poissons_ratio: f64, vectors: &mut Vectors) {
    // Equivalent Poisson's ratio of plane stress for plane strain.
    let nu = poissons_ratio / (1.0 - poissons_ratio);
    let inward = -element.outward;
    let across = Vector2::new(-inward.y, inward.x);
    // Angle from the direction away from the axis, so that it jumps only towards the axis, where there is no ring.
    let away = element.middle.coords;
    let to_away_rad = inward.perp(&away).atan2(inward.dot(&away));
    let len = points.len();
    let (point_x, point_y) = (&points.x[..len], &points.y[..len]);
    let (outward_x, outward_y, held) = (&points.outward_x[..len], &points.outward_y[..len], &points.held[..len]);
    let [to_x, to_y] = vectors.each_mut().map(|component| &mut component[..len]);
    for i in 0..len {
        let (dx, dy) = (point_x[i] - element.middle.x, point_y[i] - element.middle.y);
        let (depth, aside) = (dx * inward.x + dy * inward.y, dx * across.x + dy * across.y);
        let squared = depth * depth + aside * aside;
        let over_distance = 1.0 / squared.sqrt();
        let (sin, cos) = (aside * over_distance, depth * over_distance);
        let ln_distance = 0.5 * ln::<V>(squared);
        let angle_rad = to_away_rad + angle::<V>(away.x * dy - away.y * dx, away.x * dx + away.y * dy);
        let radial = -2.0 * cos * ln_distance - (1.0 - nu) * angle_rad * sin;
        let around = 2.0 * sin * ln_distance + (1.0 + nu) * sin - (1.0 - nu) * angle_rad * cos;
        let (outwards_x, outwards_y) = (cos * inward.x + sin * across.x, cos * inward.y + sin * across.y);
        let (sideways_x, sideways_y) = (cos * across.x - sin * inward.x, cos * across.y - sin * inward.y);
        let traction = -2.0 * cos * over_distance * (outwards_x * outward_x[i] + outwards_y * outward_y[i]);
        let (x, y) = if held[i] > 0.0 {
            (radial * outwards_x + around * sideways_x, radial * outwards_y + around * sideways_y)
        } else {
            (traction * outwards_x, traction * outwards_y)
        };
        (to_x[i], to_y[i]) = (-x / PI, -y / PI);
    }
}

/// A dense system with several right-hand sides, by columns. The equations of x precede those of y, each padded with
/// zeros to whole vectors.
struct System {
    unknowns: usize,
    columns: Vec<Vec<f64>>,
}

impl System {
    fn new(elements: usize, len: usize) -> Self {
        let unknowns = 2 * elements;
        Self { unknowns, columns: vec![vec![0.0; 2 * len]; unknowns + KNOTS] }
    }

    /// Runs Gaussian elimination with partial pivoting, column by column. Returns true if there is a solution.
    #[inline(always)]
    fn eliminate<V: Simd>(&mut self) -> bool {
        let mut pivots = Vec::with_capacity(self.unknowns);
        for at in 0..self.columns.len() {
            let (before, from) = self.columns.split_at_mut(at);
            let column = &mut from[0];
            for (row, &pivot) in pivots.iter().enumerate() {
                column.swap(row, pivot);
            }
            subtract_earlier::<V>(&before[..at.min(self.unknowns)], column);
            if at >= self.unknowns {
                continue;
            }
            let mut pivot = at;
            for row in at + 1..column.len() {
                if column[row].abs() > column[pivot].abs() {
                    pivot = row;
                }
            }
            let over_pivot = 1.0 / column[pivot];
            if !over_pivot.is_finite() {
                return false;
            }
            pivots.push(pivot);
            for column in &mut self.columns[..=at] {
                column.swap(at, pivot);
            }
            for value in &mut self.columns[at][at + 1..] {
                *value *= over_pivot;
            }
        }
        true
    }

    /// Returns two unknowns, from the first on, under a force.
    fn solution(&self, force: usize, first: usize) -> [f64; 2] {
        let mut values = self.columns[self.unknowns + force].clone();
        for at in (first..self.unknowns).rev() {
            let column = &self.columns[at];
            values[at] /= column[at];
            for row in first..at {
                values[row] -= values[at] * column[row];
            }
        }
        [values[first], values[first + 1]]
    }
}

/// Subtracts the eliminated columns from a column, four at once, which needs a quarter of the memory accesses.
#[inline(always)]
fn subtract_earlier<V: Simd>(before: &[Vec<f64>], column: &mut [f64]) {
    let (fours, rest) = before.as_chunks::<4>();
    let mut row = 0;
    for [a, b, c, d] in fours {
        column[row + 1] -= column[row] * a[row + 1];
        column[row + 2] -= column[row] * a[row + 2] + column[row + 1] * b[row + 2];
        column[row + 3] -= column[row] * a[row + 3] + column[row + 1] * b[row + 3] + column[row + 2] * c[row + 3];
        let [by_a, by_b, by_c, by_d] = [0, 1, 2, 3].map(|next| -column[row + next]);
        row += 4;
        let column = &mut column[row..];
        let len = column.len();
        let [a, b, c, d] = [a, b, c, d].map(|before| &before[row..][..len]);
        for i in 0..len {
            let first = fused::<V>(by_a, a[i], fused::<V>(by_b, b[i], column[i]));
            column[i] = fused::<V>(by_c, c[i], fused::<V>(by_d, d[i], first));
        }
    }
    for before in rest {
        let by = -column[row];
        row += 1;
        for (value, &before) in column[row..].iter_mut().zip(&before[row..]) {
            *value = fused::<V>(by, before, *value);
        }
    }
}
