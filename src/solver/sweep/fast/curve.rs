//! Curves that are too slow to evaluate at every state, as sums of Chebyshev polynomials over a drive's range
//! (docs/explanation/theory.md section 9, *Fast path*).

use std::f64::consts::PI;

use pulp::Simd;

use super::lanes::{LANES, fused};

/// Largest number of polynomials. A curve that needs more uses the plain path.
const MOST_TERMS: usize = 128;

/// Initial number of polynomials.
const FIRST_TERMS: usize = 8;

/// A curve is accurate if all omitted terms add up to less than this part of its largest value.
const LEFT_OUT: f64 = 1e-14;

/// Extension of the range at either end, relative to its length. It is many times what 33 points of a smooth curve may
/// miss.
const WIDENED: f64 = 0.25;

/// Half the length of the range of an almost constant argument.
const LEAST_HALF_LENGTH: f64 = 1e-3;

/// States summed together: as many as keep all sums in registers.
const BLOCK: usize = 8;

/// Several functions of one variable.
pub(super) struct Curves<const COUNT: usize> {
    middle: f64,
    half_length: f64,
    /// Coefficients by polynomial and then function.
    coefficients: Vec<[f64; COUNT]>,
}

impl<const COUNT: usize> Curves<COUNT> {
    /// Builds the curves of functions that are smooth around some points and zero at none. Returns none if too many
    /// polynomials are needed, or the functions have no value at a point.
    pub(super) fn around(
        places: impl Iterator<Item = f64>,
        functions: impl Fn(f64) -> Option<[f64; COUNT]>,
    ) -> Option<Self> {
        let (least, most) =
            places.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| (at.min(least), at.max(most)));
        let middle = 0.5 * (least + most);
        let half_length = (0.5 + WIDENED) * (most - least) + LEAST_HALF_LENGTH * middle.abs().min(1.0);
        let mut intervals = FIRST_TERMS;
        let mut values: Vec<[f64; COUNT]> = Vec::new();
        while intervals <= MOST_TERMS {
            // Every second node is one of the previous nodes.
            values = (0..=intervals)
                .map(|node| match values.get(node / 2).filter(|_| node % 2 == 0) {
                    Some(known) => Some(*known),
                    None => functions(middle + half_length * (PI * node as f64 / intervals as f64).cos()),
                })
                .collect::<Option<_>>()?;
            let coefficients = coefficients(&values);
            if let Some(terms) = terms_needed(&coefficients) {
                let coefficients = coefficients[..terms].to_vec();
                return Some(Self { middle, half_length, coefficients });
            }
            intervals *= 2;
        }
        None
    }

    /// Returns the functions at a chunk of points, by C. W. Clenshaw's recurrence. Also returns the largest distance of
    /// the first `count` points from the middle of the range, over half its length.
    #[inline(always)]
    pub(super) fn at<V: Simd>(&self, at: &[f64; LANES], count: usize) -> ([[f64; LANES]; COUNT], f64) {
        let per_half_length = 1.0 / self.half_length;
        let mut values = [[0.0; LANES]; COUNT];
        let mut node = [0.0; LANES];
        for i in 0..LANES {
            node[i] = (at[i] - self.middle) * per_half_length;
        }
        let [first, rest @ ..] = self.coefficients.as_slice() else { return (values, f64::INFINITY) };
        for start in (0..LANES).step_by(BLOCK) {
            let (mut sum, mut before) = ([[0.0; BLOCK]; COUNT], [[0.0; BLOCK]; COUNT]);
            for coefficient in rest.iter().rev() {
                for function in 0..COUNT {
                    for i in 0..BLOCK {
                        let next = fused::<V>(
                            2.0 * node[start + i],
                            sum[function][i],
                            coefficient[function] - before[function][i],
                        );
                        before[function][i] = sum[function][i];
                        sum[function][i] = next;
                    }
                }
            }
            for function in 0..COUNT {
                for i in 0..BLOCK {
                    values[function][start + i] =
                        fused::<V>(node[start + i], sum[function][i], first[function] - before[function][i]);
                }
            }
        }
        let farthest = node[..count.min(LANES)].iter().fold(0.0, |farthest, node| {
            let far = node.abs();
            if far > farthest || far.is_nan() { far } else { farthest }
        });
        (values, farthest)
    }
}

/// Returns the coefficients of the polynomials through values at `cos(πj/n)`, j from 0 to n.
fn coefficients<const COUNT: usize>(values: &[[f64; COUNT]]) -> Vec<[f64; COUNT]> {
    let intervals = values.len() - 1;
    let cosines: Vec<_> = (0..2 * intervals).map(|step| (PI * step as f64 / intervals as f64).cos()).collect();
    let is_end = |index: usize| index == 0 || index == intervals;
    (0..=intervals)
        .map(|term| {
            let mut sum = [0.0; COUNT];
            for (node, value) in values.iter().enumerate() {
                let share = cosines[term * node % cosines.len()] * if is_end(node) { 0.5 } else { 1.0 };
                (0..COUNT).for_each(|function| sum[function] += share * value[function]);
            }
            sum.map(|sum| sum * if is_end(term) { 1.0 } else { 2.0 } / intervals as f64)
        })
        .collect()
}

/// Returns the number of terms needed; none if the last quarter of them is not negligible.
fn terms_needed<const COUNT: usize>(coefficients: &[[f64; COUNT]]) -> Option<usize> {
    let needed = |function: usize| {
        let allowed = LEFT_OUT * coefficients[0][function].abs();
        let mut left_out = 0.0;
        let last = coefficients.iter().rposition(|coefficient| {
            left_out += coefficient[function].abs();
            left_out > allowed || left_out.is_nan()
        });
        last.map_or(1, |last| last + 1)
    };
    let most = (0..COUNT).map(needed).max().unwrap_or(1);
    (most <= coefficients.len() - coefficients.len() / 4).then_some(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_right<V: Simd>() {
        for (least, most) in [(0.3, 0.3), (0.1, 0.2), (-2.0, 3.0), (-3.0, 5.0)] {
            let functions = |x: f64| [(0.25 * x).exp(), 1.0 / (x * x + 10.0)];
            let curves = Curves::around([least, most].into_iter(), |x| Some(functions(x))).expect("smooth curves");
            for stretch in 0..16 {
                let at = std::array::from_fn(|i| least + (most - least) * (stretch * LANES + i) as f64 / 1023.0);
                let (found, farthest) = curves.at::<V>(&at, LANES);
                assert!(farthest < 1.0, "{farthest}");
                for (i, &x) in at.iter().enumerate() {
                    for (found, (expected, largest)) in
                        found.iter().zip(functions(x).into_iter().zip([(0.25 * most).exp(), 0.1]))
                    {
                        let off = (found[i] - expected).abs() / largest;
                        assert!(off < 2e-14, "{off:e} at {x} from {least} to {most}");
                    }
                }
            }
        }
    }

    #[test]
    fn smooth_curves_are_accurate_to_last_digits() {
        assert_right::<pulp::Scalar>();
        #[cfg(target_arch = "x86_64")]
        assert_right::<pulp::x86::V3>();
        #[cfg(target_arch = "aarch64")]
        assert_right::<pulp::aarch64::Neon>();
    }

    #[test]
    fn rejects_curve_with_corner_or_missing_value() {
        assert!(Curves::around([-1.0, 1.0].into_iter(), |x: f64| Some([x.abs()])).is_none());
        assert!(Curves::around([0.5, 1.0].into_iter(), |x: f64| (x > 0.6).then_some([x])).is_none());
        assert!(Curves::around([0.5, 1.0].into_iter(), |_| Some([f64::NAN])).is_none());
    }

    #[test]
    fn reports_position_beyond_range_of_present_teeth_only() {
        let curves = Curves::around([1.0, 2.0].into_iter(), |x| Some([x])).expect("a straight line");
        let mut at = [1.5; LANES];
        at[7] = 2.5;
        assert!(curves.at::<pulp::Scalar>(&at, LANES).1 > 1.0);
        assert!(curves.at::<pulp::Scalar>(&at, 7).1 < 1.0);
        at[3] = f64::NAN;
        assert!(curves.at::<pulp::Scalar>(&at, 7).1.is_nan());
    }
}
