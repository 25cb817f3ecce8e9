//! Approximation of curves by few polynomials, for solids (docs/explanation/theory.md section 8).

use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};

use crate::profile::{Polyline, SampledCurve};

/// Degree of a polynomial. CAD kernels compute a face's share of a volume with a fixed number of quadrature points.
/// OpenCascade uses nine, which is exact up to degree 9 and inexact for curves of several polynomials.
const DEGREE: usize = 8;

/// Number of interpolation points between the ends of a polynomial. At the ends it also has their directions.
const INNER: usize = DEGREE - 3;

/// Number of points of a piece that are checked: ten between two interpolation points.
const LOOKED_AT: usize = 64;

/// Returns the control polygons of consecutive Bézier polynomials along a densely sampled curve. They interpolate
/// points and tangents, and pass the other points within a tolerance. They are few, of low degree, and symmetric if the
/// curve is.
pub(crate) fn polygons(curve: &SampledCurve, tolerance_mm: f64) -> Vec<Polyline> {
    let measured = MeasuredCurve::new(curve);
    let lowest = |from: usize, to: usize, inner: std::ops::RangeInclusive<usize>| {
        inner
            .map(|inner| measured.polygon(from, to, inner))
            .find(|polygon| measured.is_near(polygon, from, to, tolerance_mm))
    };
    let ends = ends_of_pieces(curve.points.len() - 1, |from, to| lowest(from, to, INNER..=INNER).is_some());
    let of_piece = |ends: &[usize]| {
        lowest(ends[0], ends[1], 0..=INNER).unwrap_or_else(|| measured.polygon(ends[0], ends[1], INNER))
    };
    ends.windows(2).map(of_piece).collect()
}

/// Splits a curve from its point 0 to `last` into few pieces, and returns their ends. It takes the longest possible
/// piece from each end, then two halves of the rest if these are possible.
pub(crate) fn ends_of_pieces(last: usize, is_one: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let (mut from, mut to) = (0, last);
    let mut ends = vec![from, to];
    while from < to && !is_one(from, to) {
        let middle = from.midpoint(to);
        if is_one(from, middle) && is_one(middle, to) {
            ends.push(middle);
            break;
        }
        from += largest(to - from, |points| is_one(from, from + points));
        to -= largest(to - from, |points| is_one(to - points, to));
        ends.extend([from, to]);
    }
    ends.sort_unstable();
    ends.dedup();
    ends
}

/// Returns the largest number up to `limit` for which a monotonic condition holds; at least one.
fn largest(limit: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut good, mut bad) = (1, limit + 1);
    while bad - good > 1 {
        let middle = good.midpoint(bad);
        if holds(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// Curve with the arc length up to each of its points, the parameter of its polynomials.
struct MeasuredCurve<'a> {
    curve: &'a SampledCurve,
    lengths_mm: Vec<f64>,
}

impl<'a> MeasuredCurve<'a> {
    fn new(curve: &'a SampledCurve) -> Self {
        let mut length_mm = 0.0;
        let mut lengths_mm = vec![length_mm];
        for (points, tangents) in curve.points.windows(2).zip(curve.tangents.windows(2)) {
            let chord = points[1] - points[0];
            let chord_mm = chord.norm();
            if chord_mm > 0.0 {
                let [a, b] = [0, 1].map(|end| chord.perp(&tangents[end]) / chord_mm);
                // Length of the cubic with these end slopes, to second order.
                length_mm += chord_mm * (1.0 + (2.0 * a * a - a * b + 2.0 * b * b) / 30.0);
            }
            lengths_mm.push(length_mm);
        }
        Self { curve, lengths_mm }
    }

    fn share(&self, from: usize, to: usize, point: usize) -> f64 {
        (self.lengths_mm[point] - self.lengths_mm[from]) / (self.lengths_mm[to] - self.lengths_mm[from])
    }

    /// Returns the interpolation points of a polynomial: both ends twice, and inner points nearest to the Chebyshev
    /// nodes.
    fn through(&self, from: usize, to: usize, inner: usize) -> Vec<usize> {
        let inner = inner.min(to - from - 1);
        let mut through = vec![from, from];
        for i in 0..inner {
            // Among all nodes, with two at each end.
            let wanted = 0.5 - 0.5 * (PI * (i as f64 + 2.5) / (inner as f64 + 4.0)).cos();
            let after = through[through.len() - 1] + 1;
            let latest = to - (inner - i);
            let beyond = (after..latest).find(|&point| self.share(from, to, point) >= wanted).unwrap_or(latest);
            let off = |point: usize| (self.share(from, to, point) - wanted).abs();
            through.push(if beyond > after && off(beyond - 1) < off(beyond) { beyond - 1 } else { beyond });
        }
        through.extend([to, to]);
        through
    }

    /// Returns the Bézier control polygon of the polynomial between two points, through inner points.
    fn polygon(&self, from: usize, to: usize, inner: usize) -> Polyline {
        let SampledCurve { points, tangents } = self.curve;
        let through = self.through(from, to, inner);
        // Newton's divided differences; at a double node, the derivative.
        let length_mm = self.lengths_mm[to] - self.lengths_mm[from];
        let places: Vec<_> = through.iter().map(|&point| self.share(from, to, point)).collect();
        let mut differences: Vec<_> = through.iter().map(|&point| points[point] - points[from]).collect();
        for order in 1..places.len() {
            for i in (order..places.len()).rev() {
                let between = places[i] - places[i - order];
                differences[i] = if through[i] == through[i - order] {
                    length_mm * tangents[through[i]].into_inner()
                } else {
                    (differences[i] - differences[i - 1]) / between
                };
            }
        }
        // Horner's scheme on Bézier control polygons: multiply by (t - x), which is -x at the start and 1 - x at the
        // end, and add one term.
        let mut polygon: Vec<Vector2<f64>> = Vec::new();
        for (x, difference) in places.iter().zip(differences).rev() {
            let degree = polygon.len();
            let raised = |i: usize| {
                let before = if i > 0 { polygon[i - 1] * (i as f64 * (1.0 - x)) } else { Vector2::zeros() };
                let after = if i < degree { polygon[i] * ((degree - i) as f64 * x) } else { Vector2::zeros() };
                difference + (before - after) / degree.max(1) as f64
            };
            polygon = (0..=degree).map(raised).collect();
        }
        let mut polygon: Polyline = polygon.into_iter().map(|pole| points[from] + pole).collect();
        // The end points are shared with the neighbouring polynomials.
        polygon[0] = points[from];
        if let Some(end) = polygon.last_mut() {
            *end = points[to];
        }
        polygon
    }

    /// True if the points between are within a tolerance of the polynomial, measured across the curve.
    fn is_near(&self, polygon: &Polyline, from: usize, to: usize, tolerance_mm: f64) -> bool {
        let step = (to - from).div_ceil(LOOKED_AT);
        (from + 1..to).step_by(step).all(|point| {
            let off = self.curve.points[point] - at(polygon, self.share(from, to, point));
            off.perp(&self.curve.tangents[point]).abs() <= tolerance_mm
        })
    }
}

/// Returns a point of a polynomial by de Casteljau's algorithm.
fn at(polygon: &Polyline, share: f64) -> Point2<f64> {
    let mut poles = polygon.clone();
    for last in (1..poles.len()).rev() {
        for i in 0..last {
            poles[i] = poles[i] + share * (poles[i + 1] - poles[i]);
        }
    }
    poles[0]
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;

    use super::*;

    /// Returns points on a straight line at the lengths given by a function.
    fn line(points: usize, at: impl Fn(f64) -> f64) -> SampledCurve {
        let places = (0..points).map(|i| i as f64 / (points - 1) as f64);
        SampledCurve {
            points: places.map(|x| Point2::new(at(x), 0.0)).collect(),
            tangents: vec![Unit::new_unchecked(Vector2::x()); points],
        }
    }

    #[test]
    fn polynomial_passes_points_nearest_to_chebyshev_nodes() {
        for at in [|x: f64| x, |x| x * x, f64::sqrt] {
            let curve = line(1001, at);
            for inner in 1..=INNER {
                let through = MeasuredCurve::new(&curve).through(100, 900, inner);
                assert_eq!(through[..2], [100, 100]);
                assert_eq!(through[inner + 2..], [900, 900]);
                let length = |point: usize| curve.points[point].x - curve.points[100].x;
                for (i, &point) in through[2..inner + 2].iter().enumerate() {
                    let angle_rad = PI * (i as f64 + 2.5) / (inner as f64 + 4.0);
                    let wanted = length(900) * (0.5 - 0.5 * angle_rad.cos());
                    let off = |point: usize| (length(point) - wanted).abs();
                    let nearest = (101..900).min_by(|&one, &other| off(one).total_cmp(&off(other)));
                    assert_eq!(Some(point), nearest, "{i} of {inner}");
                }
            }
        }
    }

    #[test]
    fn polynomial_passes_all_points_of_short_curve() {
        for at in [|x: f64| x, |x: f64| x.powi(8), |x: f64| x.powf(0.125)] {
            let curve = line(8, at);
            let measured = MeasuredCurve::new(&curve);
            assert_eq!(measured.through(1, 7, INNER), [1, 1, 2, 3, 4, 5, 6, 7, 7]);
            assert_eq!(measured.through(3, 6, INNER), [3, 3, 4, 5, 6, 6]);
            assert_eq!(measured.through(3, 4, INNER), [3, 3, 4, 4]);
            assert!(measured.through(0, 7, INNER).windows(2).skip(1).take(INNER).all(|pair| pair[0] < pair[1]));
        }
    }
}
