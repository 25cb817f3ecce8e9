//! Order statistics: estimates of a distribution from the ranks of a sample.

use serde::Serialize;
use utoipa::ToSchema;

/// Probability outside a confidence interval on each side.
const TAIL: f64 = 0.025;

/// The quantile of the standard normal distribution for `TAIL`.
const NORMAL_QUANTILE: f64 = 1.959_963_984_540_054;

/// A quantile with its confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct QuantileAnswer {
    /// Fraction of drives at or below the quantile.
    pub share: f64,
    /// The quantile.
    pub value: f64,
    /// Lower confidence bound (97.5 %). Absent if the sample is too small.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    /// Upper confidence bound (97.5 %). Absent if the sample is too small.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
}

/// A fraction of a sample with its 95 % confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct ShareAnswer {
    /// The fraction.
    pub share: f64,
    /// Lower end of the confidence interval.
    pub low: f64,
    /// Upper end of the confidence interval.
    pub high: f64,
}

/// Ranks of a confidence interval, from 1. Absent if the sample is too small.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Ranks {
    low: Option<u64>,
    high: Option<u64>,
}

/// Returns a quantile of a sorted sample, and its confidence interval from ranks. For every distribution the number of
/// values below its quantile is binomial (H. A. David, H. N. Nagaraja, Order Statistics, 2003, section 7.1).
pub(crate) fn quantile(sorted: &[f64], share: f64) -> Option<QuantileAnswer> {
    let count = sorted.len();
    let rank = whole(share * count as f64).clamp(1, count.max(1) as u64);
    let at = |rank: u64| sorted.get(usize::try_from(rank.checked_sub(1)?).ok()?).copied();
    let Ranks { low, high } = ranks(count as u64, share);
    Some(QuantileAnswer { share, value: at(rank)?, low: low.and_then(at), high: high.and_then(at) })
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a rank: not negative, below 2^53")]
fn whole(rank: f64) -> u64 {
    rank.ceil() as u64
}

/// Returns the ranks outside of which each tail has a probability of at most 2.5 %.
fn ranks(count: u64, share: f64) -> Ranks {
    let n = count as f64;
    let spread = (n * share * (1.0 - share)).sqrt();
    // The probability beyond ten standard deviations and 30 more is negligible.
    let from = whole((n * share - 10.0 * spread - 30.0).max(0.0)).min(count);
    let to = whole(n * share + 10.0 * spread + 30.0).min(count);
    let log_probability = |k: u64| {
        let (k, rest) = (k as f64, (count - k) as f64);
        log_factorial(n) - log_factorial(k) - log_factorial(rest) + k * share.ln() + rest * (-share).ln_1p()
    };
    let mut below = 0.0;
    let mut found = Ranks { low: None, high: None };
    for k in from..=to {
        // Here `below` is the probability of fewer than k values below the quantile.
        if below <= TAIL {
            found.low = (k > 0).then_some(k);
        }
        below += log_probability(k).exp();
        if below >= 1.0 - TAIL {
            found.high = (k < count).then_some(k + 1);
            break;
        }
    }
    found
}

/// Computes `ln n!` for a whole number: by Stirling's series, and for small n by the product, because the series is
/// less exact.
fn log_factorial(n: f64) -> f64 {
    if n < 32.0 {
        let mut product = 1.0;
        let mut factor = 2.0;
        while factor <= n {
            product *= factor;
            factor += 1.0;
        }
        return f64::ln(product);
    }
    let series = 1.0 / (12.0 * n) - 1.0 / (360.0 * n.powi(3)) + 1.0 / (1260.0 * n.powi(5));
    (n + 0.5) * n.ln() - n + 0.5 * (2.0 * std::f64::consts::PI).ln() + series
}

/// Returns a fraction with Wilson's interval (Journal of the American Statistical Association 22, 1927, 209-212).
pub(crate) fn share(good: u64, count: u64) -> Option<ShareAnswer> {
    if count == 0 {
        return None;
    }
    let (n, p) = (count as f64, good as f64 / count as f64);
    let z2 = NORMAL_QUANTILE * NORMAL_QUANTILE;
    let middle = (p + 0.5 * z2 / n) / (1.0 + z2 / n);
    let half = NORMAL_QUANTILE / (1.0 + z2 / n) * (p * (1.0 - p) / n + 0.25 * z2 / (n * n)).sqrt();
    Some(ShareAnswer { share: p, low: (middle - half).max(0.0), high: (middle + half).min(1.0) })
}

#[cfg(test)]
mod tests {
    use super::{Ranks, log_factorial, quantile, ranks, share};

    /// P(B ≤ 39) = 0.0176, P(B ≤ 40) = 0.0284 for B of 100 tosses. Textbooks have this interval.
    #[test]
    fn median_of_100_has_textbook_ranks() {
        assert_eq!(ranks(100, 0.5), Ranks { low: Some(40), high: Some(61) });
    }

    /// 0.5^5 on each side is above 2.5 %, 0.5^6 is not.
    #[test]
    fn median_interval_needs_six_values() {
        assert_eq!(ranks(5, 0.5), Ranks { low: None, high: None });
        assert_eq!(ranks(6, 0.5), Ranks { low: Some(1), high: Some(6) });
    }

    #[test]
    fn quantiles_are_order_statistics() {
        let sorted: Vec<_> = (1..=1000).map(f64::from).collect();
        let median = quantile(&sorted, 0.5);
        assert!(median.is_some_and(|median| median.value.to_bits() == 500.0_f64.to_bits()), "{median:?}");
        assert_eq!(quantile(&[], 0.5), None);
    }

    #[test]
    fn factorials_are_products() {
        let product: f64 = (1..=40).map(|k| f64::from(k).ln()).sum();
        assert!((log_factorial(40.0) / product - 1.0).abs() < 1e-14);
    }

    /// Wilson's interval for 10 of 10 starts at 1/(1 + z²/n).
    #[test]
    fn ten_of_ten_have_wilson_interval() {
        let all = share(10, 10);
        let low = 1.0 / (1.0 + super::NORMAL_QUANTILE.powi(2) / 10.0);
        assert!(all.is_some_and(|all| (all.low - low).abs() < 1e-12 && all.high > 0.999_999), "{all:?}");
    }
}
