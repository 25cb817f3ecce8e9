//! Estimates of the maximum between two moments, and of their error.

use super::seen::Seen;
use super::{COARSE_MARGIN, MARGIN, NODES, OF_TERM_BEFORE, SUMMIT_STEPS};

/// Successive moments at which the same teeth carry.
pub(super) struct Run<'a> {
    pub(super) seen: &'a Seen,
    pub(super) moments: &'a [usize],
    /// True if the piece, and not a change of these teeth, bounds the run at its start or its end.
    pub(super) is_first: bool,
    pub(super) is_last: bool,
}

impl Run<'_> {
    pub(super) fn fraction(&self, at: usize) -> f64 {
        self.seen.fractions[self.moments[at]]
    }
}

/// Computes the bend of each curve on an interval, a quarter of which is the rise of a parabola, and its bound. `coarse`
/// is by curve. The run has three moments or more.
///
/// The bend is the larger of the second differences at both ends, from the neighbouring moments. At an end of the run
/// both are those of the moment next to it.
pub(super) fn margins(run: &Run<'_>, at: usize, coarse: &[f64], bends: &mut [f64], bounds: &mut [f64]) {
    let count = coarse.len();
    let last = run.moments.len() - 3;
    let starts = [at.saturating_sub(1).min(last), at.min(last)];
    let width = run.fraction(at + 1) - run.fraction(at);
    let is_at_end = at == 0 || at == last + 1;
    // Weights of three moments that give the bend of this interval.
    let [[a, b, c], [d, e, f]] = starts.map(|start| {
        let [x, y, z] = [0, 1, 2].map(|step| run.fraction(start + step));
        // By curvature for smooth curves. For two lines by the difference of slopes, of which one end shows only a part.
        let scale = (width * width / (z - x)).max(if is_at_end { width } else { 0.5 * width });
        let (before, after) = (scale / (y - x), scale / (z - y));
        [before, -(before + after), after]
    });
    let values = |at: usize| &run.seen.values(run.moments[at])[..count];
    let [[x, y, z], [u, v, w]] = starts.map(|start| [values(start), values(start + 1), values(start + 2)]);
    let [low, high] = [values(at), values(at + 1)];
    let (bends, bounds) = (&mut bends[..count], &mut bounds[..count]);
    for i in 0..count {
        let one = (a * x[i] + b * y[i] + c * z[i]).abs();
        let other = (d * u[i] + e * v[i] + f * w[i]).abs();
        let bend = if one > other { one } else { other };
        let end = if low[i] > high[i] { low[i] } else { high[i] };
        bends[i] = bend;
        bounds[i] = end + bend * if bend > coarse[i] { COARSE_MARGIN } else { MARGIN };
    }
}

/// Moments that bound a curve on an interval, in units of its length. Its ends are at 0 and 1; the others follow by
/// distance.
pub(super) struct Nodes {
    pub(super) moments: [usize; NODES],
    pub(super) places: [f64; NODES],
    /// Reciprocals of the distance of each node from the one this many before it.
    reciprocals: [[f64; NODES]; NODES],
}

/// Maximum of a curve on an interval, by the polynomial through its nodes.
pub(super) struct Summit {
    /// Value.
    pub(super) top: f64,
    /// Place, from 0 to 1.
    pub(super) at: f64,
    /// Error estimate of the polynomial.
    pub(super) error: f64,
    /// Upper bound of the curve.
    pub(super) bound: f64,
}

impl Nodes {
    /// Returns the nodes of a run; none if there are too few. Nodes closer than a quarter of the interval only show
    /// rounding.
    pub(super) fn of(run: &Run<'_>, at: usize) -> Option<Self> {
        const APART: f64 = 0.25;
        let origin = run.fraction(at);
        let width = run.fraction(at + 1) - origin;
        let place = |at: usize| (run.fraction(at) - origin) / width;
        let mut nodes =
            Self { moments: [run.moments[at]; NODES], places: [0.0; NODES], reciprocals: [[0.0; NODES]; NODES] };
        (nodes.moments[1], nodes.places[1]) = (run.moments[at + 1], 1.0);
        let (mut low, mut high) = (0.0, 1.0);
        let mut before = (0..at).rev().map(|at| (at, place(at))).peekable();
        let mut after = (at + 2..run.moments.len()).map(|at| (at, place(at))).peekable();
        for node in 2..NODES {
            while before.next_if(|&(_, place)| place > low - APART).is_some() {}
            while after.next_if(|&(_, place)| place < high + APART).is_some() {}
            let is_before_nearer = match (before.peek(), after.peek()) {
                (None, None) => return None,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (Some((_, before)), Some((_, after))) => -before < after - 1.0,
            };
            let (at, place) = if is_before_nearer { before.next()? } else { after.next()? };
            if is_before_nearer {
                low = place
            } else {
                high = place
            }
            (nodes.moments[node], nodes.places[node]) = (run.moments[at], place);
        }
        for order in 1..NODES {
            for node in order..NODES {
                nodes.reciprocals[order][node] = 1.0 / (nodes.places[node] - nodes.places[node - order]);
            }
        }
        Some(nodes)
    }

    /// Returns the maximum of a curve whose polynomial may be off by this multiple of its last term.
    pub(super) fn summit(&self, seen: &Seen, curve: usize, off: f64) -> Summit {
        let u = &self.places;
        let values = self.moments.map(|moment| seen.value(moment, curve));
        // Newton's divided differences.
        let mut c = values;
        for order in 1..NODES {
            for node in (order..NODES).rev() {
                c[node] = (c[node] - c[node - 1]) * self.reciprocals[order][node];
            }
        }
        // The last two terms in the middle.
        let fourth = c[4].abs() * 0.25 * ((0.5 - u[2]) * (0.5 - u[3])).abs();
        let fifth = c[5].abs() * 0.25 * ((0.5 - u[2]) * (0.5 - u[3]) * (0.5 - u[4])).abs();
        let error = off * fifth.max(OF_TERM_BEFORE * fourth);
        // Coefficients of powers of the place.
        let mut a = [0.0; NODES];
        a[0] = c[NODES - 1];
        for node in (0..NODES - 1).rev() {
            for power in (1..NODES).rev() {
                a[power] = a[power - 1] - u[node] * a[power];
            }
            a[0] = c[node] - u[node] * a[0];
        }
        let value = |x: f64| a[0] + x * (a[1] + x * (a[2] + x * (a[3] + x * (a[4] + x * a[5]))));
        let slope = |x: f64| a[1] + x * (2.0 * a[2] + x * (3.0 * a[3] + x * (4.0 * a[4] + x * 5.0 * a[5])));
        let bend = |x: f64| 2.0 * a[2] + x * (6.0 * a[3] + x * (12.0 * a[4] + x * 20.0 * a[5]));
        let higher = values[0].max(values[1]);
        // Effect of the error on the slope: nodes are at least a quarter apart.
        let slope_error = 8.0 * error;
        let slopes = [0.0, 0.5, 1.0].map(slope);
        let is_steep =
            slopes.iter().all(|&slope| slope > slope_error) || slopes.iter().all(|&slope| slope < -slope_error);
        if is_steep {
            return Summit { top: higher, at: 0.5, error, bound: higher };
        }
        let (mut top, mut at, mut from_end) = (higher, 0.5_f64, 0.0);
        if slopes[0] > 0.0 && slopes[2] < 0.0 {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..SUMMIT_STEPS {
                let found = slope(at);
                if found > 0.0 {
                    low = at
                } else {
                    high = at
                }
                let newton = at - found / bend(at);
                // After convergence it is at an end.
                at = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            }
            top = higher.max(value(at));
            from_end = at.min(1.0 - at);
        }
        // At its nodes the polynomial is exact. An error of the slope changes the maximum by at most the error times
        // the distance from the nearer end. It shifts the maximum of a concave curve only slightly.
        let least_bend = [0.0, 0.5, 1.0].map(|x| -bend(x)).into_iter().fold(f64::INFINITY, f64::min);
        let above =
            if least_bend > 0.0 { error.min(slope_error * (0.5 * slope_error / least_bend + from_end)) } else { error };
        Summit { top, at, error, bound: top + above }
    }
}
