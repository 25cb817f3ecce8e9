//! Roots of one unknown inside a bracket: the iterations used by all other modules.

/// An iteration that reached its limit of steps.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what}: no convergence within {iterations} iterations, the bracket is still {bracket_width} wide")]
pub struct NotConverged {
    /// The quantity that was solved for.
    pub what: &'static str,
    /// Limit of steps.
    pub iterations: u32,
    /// Width of the remaining bracket.
    pub bracket_width: f64,
}

/// Limit of steps, above any real need. Bisection takes below 60 steps, in the logarithm from the widest bracket in the
/// ranges of the parameters (a/b = 1e12) as well as down to [`NOTHING`]. Every step can fall back to bisection.
const MAX_ITERATIONS: u32 = 200;

/// Absolute value below which a root of [`bracketed`] is zero: its unknowns are angles in rad and ratios. Without it,
/// bisection towards a root at zero, moved by rounding, would not end.
const NOTHING: f64 = 1e-16;

/// A function's value and derivative.
#[derive(Debug, Clone, Copy)]
pub struct ValueAndSlope {
    /// The value.
    pub value: f64,
    /// The derivative.
    pub slope: f64,
}

/// Returns the root in `[low, high]`, `0 < low <= high`, of a function that is negative below it and positive above.
/// The method is Newton's from `guess`, with logarithmic bisection for steps that leave the bracket or shrink too
/// slowly.
///
/// # Errors
/// [`NotConverged`] after 200 iterations.
pub fn newton_in_bracket(
    what: &'static str,
    low: f64,
    high: f64,
    guess: f64,
    function: impl Fn(f64) -> ValueAndSlope,
) -> Result<f64, NotConverged> {
    let (mut low, mut high) = (low, high);
    let mut x = guess.clamp(low, high);
    let mut last_step = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        let ValueAndSlope { value, slope } = function(x);
        if value > 0.0 {
            high = x;
        } else if value < 0.0 {
            low = x;
        } else {
            return Ok(x);
        }
        let newton = x - value / slope;
        // The negated comparison also catches a slope of zero, for which `newton` is NaN.
        let next = if !(newton >= low && newton <= high) || (newton - x).abs() > 0.5 * last_step {
            (low * high).sqrt()
        } else {
            newton
        };
        let step = (next - x).abs();
        x = next;
        if step <= f64::EPSILON * x || high - low <= f64::EPSILON * low {
            return Ok(x);
        }
        last_step = step;
    }
    Err(NotConverged { what, iterations: MAX_ITERATIONS, bracket_width: high - low })
}

/// Returns the root of an increasing function that is linear or convex, from a point at or above it. Newton's method
/// then approaches the root without passing it and needs no bracket. Arguments are not negative: if rounding gives a
/// negative step, the root is zero.
///
/// # Errors
/// [`NotConverged`] after 200 iterations, or from `function` itself.
pub fn newton_from_above(
    what: &'static str,
    start: f64,
    function: impl Fn(f64) -> Result<ValueAndSlope, NotConverged>,
) -> Result<f64, NotConverged> {
    let mut x = start;
    for _ in 0..MAX_ITERATIONS {
        let ValueAndSlope { value, slope } = function(x)?;
        // Only rounding leads below the root: the upward step is its correction.
        let next = (x - value / slope).max(0.0);
        if value <= 0.0 || x - next <= f64::EPSILON * x {
            return Ok(if next.is_finite() { next } else { x });
        }
        x = next;
    }
    Err(NotConverged { what, iterations: MAX_ITERATIONS, bracket_width: x })
}

/// Returns the root of an increasing function that is linear or concave, from a positive point at or below it, like
/// [`newton_from_above`].
///
/// # Errors
/// [`NotConverged`] after 200 iterations.
pub fn newton_from_below(
    what: &'static str,
    start: f64,
    function: impl Fn(f64) -> ValueAndSlope,
) -> Result<f64, NotConverged> {
    let mut x = start;
    for _ in 0..MAX_ITERATIONS {
        let ValueAndSlope { value, slope } = function(x);
        let next = x - value / slope;
        if value >= 0.0 || next - x <= f64::EPSILON * x {
            return Ok(next);
        }
        x = next;
    }
    Err(NotConverged { what, iterations: MAX_ITERATIONS, bracket_width: x })
}

/// Returns the root between `start`, where the function's value is known, and `end`, where it has the other sign. The
/// method is inverse quadratic interpolation with a fallback to bisection (Chandrupatla 1997).
///
/// # Errors
/// [`NotConverged`] after 200 iterations, or from `function` itself.
pub fn bracketed(
    what: &'static str,
    start: f64,
    value_at_start: f64,
    end: f64,
    function: impl Fn(f64) -> Result<f64, NotConverged>,
) -> Result<f64, NotConverged> {
    let (mut a, mut value_a) = (start, value_at_start);
    let (mut b, mut value_b) = (end, function(end)?);
    let (mut c, mut value_c);
    let mut fraction = 0.5;
    for _ in 0..MAX_ITERATIONS {
        let x = a + fraction * (b - a);
        let value = function(x)?;
        // `a` is the newest point, `b` the nearest one of the other sign, `c` the one before.
        if (value > 0.0) == (value_a > 0.0) {
            (c, value_c) = (a, value_a);
        } else {
            (c, value_c, b, value_b) = (b, value_b, a, value_a);
        }
        (a, value_a) = (x, value);
        let (best, least) = if value_a.abs() < value_b.abs() { (a, value_a) } else { (b, value_b) };
        let width = (b - a).abs();
        let tolerance = (0.5 * f64::EPSILON * best.abs()).max(NOTHING) / width;
        if least == 0.0 || width == 0.0 || tolerance >= 0.5 {
            return Ok(best);
        }
        let xi = (a - b) / (c - b);
        let phi = (value_a - value_b) / (value_c - value_b);
        fraction = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            value_a / (value_b - value_a) * (value_c / (value_b - value_c))
                + (c - a) / (b - a) * (value_a / (value_c - value_a)) * (value_b / (value_c - value_b))
        } else {
            0.5
        };
        fraction = fraction.clamp(tolerance, 1.0 - tolerance);
    }
    Err(NotConverged { what, iterations: MAX_ITERATIONS, bracket_width: (b - a).abs() })
}

/// Returns the least value that a function with one minimum has at the places of a golden-section search, and the middle
/// of the last bracket. Each step leaves 0.62 of the bracket.
///
/// # Errors
/// The first error of `function`.
pub(crate) fn golden_section<E>(
    mut low: f64,
    mut high: f64,
    steps: u32,
    mut function: impl FnMut(f64) -> Result<f64, E>,
) -> Result<(f64, f64), E> {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut least = f64::INFINITY;
    for _ in 0..steps {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        let (at_left, at_right) = (function(left)?, function(right)?);
        least = least.min(at_left).min(at_right);
        if at_left < at_right { high = right } else { low = left }
    }
    Ok((least, 0.5 * (low + high)))
}
