//! Elementary functions and columns without branches and calls, so that the compiler can vectorise them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use pulp::Simd;

/// States processed in one chunk of straight-line code; a multiple of every vector's width.
pub(super) const LANES: usize = 64;

/// Number of doubles in the widest vector.
pub(crate) const VECTOR: usize = 8;

/// Largest number of terms of the arctangent's series. A drive that needs more uses the plain path.
const MAX_TERMS: usize = 24;

/// Added to the bits of a number, it makes the exponent step at √½ instead of 1: the mantissa is then in [√½, √2).
const FROM_ROOT_HALF: u64 = 0x3ff0_0000_0000_0000 - ROOT_HALF;
/// Bits of √½.
const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
const MANTISSA: u64 = 0x000f_ffff_ffff_ffff;
/// 2^52: added to a whole number, it puts that number into the low bits of the sum.
const WHOLE: f64 = 4_503_599_627_370_496.0;

/// ln 2 in two parts. The first ends in so many zero bits that its product with any exponent is exact.
const LN_2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Coefficients of `(artanh s)/s - 1` over the powers of `s²`, enough for the last digit for `|s| ≤ (√2 - 1)/(√2 + 1)`.
const ARTANH: [f64; 9] =
    [1.0 / 3.0, 0.2, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, 1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0, 1.0 / 19.0];

/// Returns `ab + c`, rounded once if the vectors support it.
#[inline(always)]
pub(crate) fn fused<V: Simd>(a: f64, b: f64, c: f64) -> f64 {
    if V::IS_SCALAR { a * b + c } else { a.mul_add(b, c) }
}

/// Returns `ln x` of a normal positive number, to two units in the last place.
#[inline(always)]
pub(crate) fn ln<V: Simd>(x: f64) -> f64 {
    let shifted = x.to_bits().wrapping_add(FROM_ROOT_HALF);
    let exponent = f64::from_bits((shifted >> 52) | WHOLE.to_bits()) - (WHOLE + 1023.0);
    let mantissa = f64::from_bits((shifted & MANTISSA).wrapping_add(ROOT_HALF));
    // ln m = 2 artanh((m - 1)/(m + 1))
    let above = mantissa - 1.0;
    let s = above / (2.0 + above);
    let z = s * s;
    let mut sum = 0.0;
    for coefficient in ARTANH.iter().rev() {
        sum = fused::<V>(sum, z, *coefficient);
    }
    let twice = 2.0 * s;
    fused::<V>(exponent, LN_2_HIGH, twice + fused::<V>(twice * z, sum, exponent * LN_2_LOW))
}

/// Returns `ln x` of a normal positive number, to 0.03, as an initial value.
#[inline(always)]
pub(super) fn ln_roughly(x: f64) -> f64 {
    /// Half of the largest excess of `log2 m` over `m - 1`, 1 ≤ m ≤ 2.
    const HALF_BULGE: f64 = 0.043;
    // As an integer, the bits count exponent and mantissa on a scale that is linear between powers of two.
    let straight = f64::from_bits((x.to_bits() >> 12) | WHOLE.to_bits()) - WHOLE;
    (straight / (1_u64 << 40) as f64 - (1023.0 - HALF_BULGE)) * std::f64::consts::LN_2
}

/// Returns `x^(-1/N)` of a normal positive number, to two units in the last place, without a division. The bits of a
/// double are a scale that is linear between powers of two and give an initial value y. It is refined by the series of
/// `1/(1 - ε)^(1/N)`, `ε = 1 - x y^N`.
#[inline(always)]
fn inverse_root<V: Simd, const N: u32>(x: f64) -> f64 {
    const PER_EXPONENT: f64 = (1_u64 << 40) as f64;
    // Balances ε above and below: at first 10 % for N = 3, then 5e-5 and 7e-16; 29 % for N = 10, then 3e-3, 2e-11 and
    // 2e-15.
    let (balance, rounds) = if N == 3 { (0.068, 2) } else { (0.058, 3) };
    let share = 1.0 / f64::from(N);
    let (second, third) = (0.5 * share * (1.0 + share), share * (1.0 + share) * (2.0 + share) / 6.0);
    let straight = f64::from_bits((x.to_bits() >> 12) | WHOLE.to_bits()) - WHOLE;
    let root = ((1.0 + share) * 1023.0 - balance) * PER_EXPONENT - straight * share;
    let mut inverse = f64::from_bits((root + WHOLE).to_bits() << 12);
    for _ in 0..rounds {
        let square = inverse * inverse;
        let fourth = square * square;
        let off = 1.0
            - match N {
                3 => (x * inverse) * square,
                9 => (x * fourth) * (fourth * inverse),
                _ => (x * (fourth * inverse)) * (fourth * inverse),
            };
        let series = fused::<V>(off, fused::<V>(off, third, second), share);
        inverse = fused::<V>(inverse * off, series, inverse);
    }
    inverse
}

/// Returns `∛x` of a non-negative number.
#[inline(always)]
pub(super) fn cube_root<V: Simd>(x: f64) -> f64 {
    let inverse = inverse_root::<V, 3>(x);
    x * (inverse * inverse)
}

/// Returns `x^(1/9)` of a normal positive number.
#[inline(always)]
pub(super) fn ninth_root<V: Simd>(x: f64) -> f64 {
    let inverse = inverse_root::<V, 9>(x);
    let square = inverse * inverse;
    x * ((square * square) * (square * square))
}

/// Returns `x^(-1/10)` of a normal positive number.
#[inline(always)]
pub(super) fn inverse_tenth_root<V: Simd>(x: f64) -> f64 {
    inverse_root::<V, 10>(x)
}

/// Coefficients of Cephes' `atan`, `x + x³ P(x²)/Q(x²)` up to 0.66.
const ARCTANGENT_OVER: [f64; 5] = [
    -8.750_608_600_031_904e-1,
    -1.615_753_718_733_365e1,
    -7.500_855_792_314_705e1,
    -1.228_866_684_490_136_2e2,
    -6.485_021_904_942_025e1,
];
const ARCTANGENT_UNDER: [f64; 6] = [
    1.0,
    2.485_846_490_142_306_3e1,
    1.650_270_098_316_988_5e2,
    4.328_810_604_912_903e2,
    4.853_903_996_359_137e2,
    1.945_506_571_482_614e2,
];

/// Returns `atan2(y, x)`, not both 0, to two units in the last place of its largest value.
#[inline(always)]
pub(crate) fn angle<V: Simd>(y: f64, x: f64) -> f64 {
    const TAN_PI_8: f64 = 0.414_213_562_373_095_03;
    let (rise, run) = (y.abs(), x.abs());
    let is_steep = rise > run;
    let (less, more) = if is_steep { (run, rise) } else { (rise, run) };
    let is_far = less > TAN_PI_8 * more;
    // tan(φ - π/4) = (t - 1)/(t + 1)
    let t = if is_far { less - more } else { less } / if is_far { less + more } else { more };
    let z = t * t;
    let polynomial = |coefficients: &[f64]| coefficients.iter().fold(0.0, |sum, &next| fused::<V>(sum, z, next));
    let series = fused::<V>(t * z, polynomial(&ARCTANGENT_OVER) / polynomial(&ARCTANGENT_UNDER), t);
    let octant = if is_far { FRAC_PI_4 + series } else { series };
    let quadrant = if is_steep { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    half.copysign(y)
}

/// Returns the number of terms of `atan q = q (1 - q²/3 + q⁴/5 - …)` that reach the last digit for `0 ≤ q ≤ largest`.
pub(super) fn arctangent_terms(largest: f64) -> Option<usize> {
    let square = largest * largest;
    let mut power = 1.0;
    (1..=MAX_TERMS).find(|_| {
        power *= square;
        power < 0.25 * f64::EPSILON
    })
}

/// Coefficients of `atan q` over `q` and the powers of `q²`.
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
pub(super) fn arctangents(ratios: &mut [f64; LANES], terms: usize) {
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

/// Returns the largest of non-negative values. It computes one maximum for each lane, since a single one cannot be
/// vectorised.
#[inline(always)]
pub(super) fn largest(values: &[f64]) -> f64 {
    let (stretches, rest) = values.as_chunks::<{ 2 * VECTOR }>();
    let mut most = [0.0; 2 * VECTOR];
    for stretch in stretches {
        for i in 0..2 * VECTOR {
            most[i] = if stretch[i] > most[i] { stretch[i] } else { most[i] };
        }
    }
    let mut largest = 0.0;
    for values in [most.as_slice(), rest] {
        for &value in values {
            largest = if value > largest { value } else { largest };
        }
    }
    largest
}

/// Returns the largest product of non-negative values in two columns.
#[inline(always)]
pub(super) fn largest_product(values: &[f64], factors: &[f64]) -> f64 {
    let (stretches, rest) = values.as_chunks::<{ 2 * VECTOR }>();
    let (by_stretch, by_rest) = factors.as_chunks::<{ 2 * VECTOR }>();
    let mut most = [0.0; 2 * VECTOR];
    for (values, factors) in stretches.iter().zip(by_stretch) {
        for i in 0..2 * VECTOR {
            let product = values[i] * factors[i];
            most[i] = if product > most[i] { product } else { most[i] };
        }
    }
    for (i, (value, factor)) in rest.iter().zip(by_rest).enumerate() {
        let product = value * factor;
        most[i] = if product > most[i] { product } else { most[i] };
    }
    largest(&most)
}

/// Returns the index of the first product of values in two columns that reaches `least`. It tests whole stretches,
/// since a search that ends at a value cannot be vectorised.
#[inline(always)]
pub(super) fn first_product(values: &[f64], factors: &[f64], least: f64) -> Option<usize> {
    let reaches = |(value, factor): (&f64, &f64)| value * factor >= least;
    let stretches = values.chunks(2 * VECTOR).zip(factors.chunks(2 * VECTOR));
    let mut stretches = stretches.map(|(values, factors)| values.iter().zip(factors));
    let stretch = stretches.position(|stretch| stretch.fold(false, |any, pair| any | reaches(pair)))?;
    let start = stretch * 2 * VECTOR;
    values[start..].iter().zip(&factors[start..]).position(reaches).map(|at| start + at)
}

/// Repeats each value in a row, the last one up to the end of its chunk. Whole vectors are written, and the next value
/// overwrites the excess; the last needs extra space.
#[inline(always)]
pub(super) fn repeat_each(values: &[f64], times: usize, repeated: &mut [f64]) {
    for (row, &value) in values.iter().enumerate() {
        for start in (row * times..(row + 1) * times).step_by(VECTOR) {
            repeated[start..start + VECTOR].fill(value);
        }
    }
    let end = values.len() * times;
    if let Some(&last) = values.last() {
        repeated[end..end.next_multiple_of(LANES)].fill(last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_to_a_few_units<V: Simd>() {
        let close = |found: f64, expected: f64| (found - expected).abs() <= 2.0 * f64::EPSILON * expected.abs();
        let mut x = 1e-300;
        while x < 1e300 {
            assert!(close(ln::<V>(x), x.ln()), "ln {x}");
            assert!((ln_roughly(x) - x.ln()).abs() < 0.031, "ln {x}");
            let roots = [
                (cube_root::<V>(x), x.cbrt()),
                (ninth_root::<V>(x), x.cbrt().cbrt()),
                (inverse_tenth_root::<V>(x), (-0.1 * x.ln()).exp()),
            ];
            for (root, expected) in roots {
                assert!((root - expected).abs() <= 100.0 * f64::EPSILON * expected, "a root of {x}: {root}");
            }
            x *= 1.003_7;
        }
        for step in -100_000..100_000 {
            let x = 1.0 + f64::from(step) * 9e-6;
            assert!(close(ln::<V>(x), x.ln()), "ln {x}");
            // Powers of ten have no library root: x is raised to powers instead. Tolerance: 10 units in the last place.
            let (cube, ninth, tenth) = (x.powi(3), x.powi(9), x.powi(10));
            for root in [cube_root::<V>(cube), ninth_root::<V>(ninth), 1.0 / inverse_tenth_root::<V>(tenth)] {
                assert!((root - x).abs() <= 10.0 * f64::EPSILON * x, "{root} is not {x}");
            }
        }
        assert_eq!(cube_root::<V>(0.0).to_bits(), 0);
        for step in -10_000..=10_000 {
            let (sin, cos) = (f64::from(step) * PI * 1e-4).sin_cos();
            let (found, expected) = (angle::<V>(3.0 * sin, 3.0 * cos), sin.atan2(cos));
            assert!((found - expected).abs() <= 2.0 * f64::EPSILON * PI, "{found} is not {expected}");
        }
    }

    #[test]
    fn logarithms_and_roots_are_accurate_to_last_digits() {
        assert_to_a_few_units::<pulp::Scalar>();
        #[cfg(target_arch = "x86_64")]
        assert_to_a_few_units::<pulp::x86::V3>();
        #[cfg(target_arch = "aarch64")]
        assert_to_a_few_units::<pulp::aarch64::Neon>();
    }
}
