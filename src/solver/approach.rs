//! Approach of a tooth along `F_H` as a function of that force (docs/explanation/theory.md sections 4.3 to 4.5).

use crate::root::{NotConverged, ValueAndSlope, newton_from_below};

/// Weighted sum of a tooth's three approaches over `F_H`. It is zero at zero force, increasing, and linear or concave,
/// so the force grows ever faster with the approach. All searches rely on these properties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Approach {
    /// `ξ = c F`.
    Linear {
        /// `c`.
        compliance_mm_per_n: f64,
    },
    /// `ξ = c F^p + l F` with `p < 1`. The linear part is that of contacts or series compliances with a linear law.
    Power {
        /// `p`.
        exponent: f64,
        /// `c`, in mm/N^p.
        coefficient: f64,
        /// `l`.
        compliance_mm_per_n: f64,
    },
    /// `ξ = F (A + B ln(F_r/F))`.
    Logarithmic(Logarithmic),
    /// The same with the contact of a tooth at a corner of the ring.
    Corner(Corner),
}

/// `ξ = F (A + B ln(F_r/F) + K ln(2/u - 1))`, `1/u = z + √(1 + z²)`, `z² = F_z/F`. Here u is the width of the contact
/// with a corner over that with a smooth surface. The last term is increasing and concave like the others
/// (docs/explanation/theory.md section 4.4, `corner_contact`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// The same contact on a smooth surface.
    pub(crate) smooth: Logarithmic,
    /// `K`.
    pub(crate) growth_mm_per_n: f64,
    /// `F_z`.
    pub(crate) narrowing_n: f64,
}

/// `ξ = F (A + B ln(F_r/F))` up to the force at which the law ends. Beyond, it continues along its tangent: no result
/// is there, but a search may pass through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Logarithmic {
    /// `A`.
    compliance_mm_per_n: f64,
    /// `B`.
    growth_mm_per_n: f64,
    /// `F_r`.
    reference_n: f64,
    /// Force at which the law ends, `F_r` times [`Logarithmic::LIMIT`].
    limit_n: f64,
    /// Approach at that force.
    limit_mm: f64,
}

/// A force, and the local exponent of the approach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceAndExponent {
    /// Force, in N.
    pub force_n: f64,
    /// `d ln ξ/d ln F`.
    pub exponent: f64,
}

impl Logarithmic {
    /// Force at the law's end over the reference force, which corresponds to half the reference width.
    pub const LIMIT: f64 = 0.25;

    /// Builds the law from `A`, `B` and `F_r` with `A + B (ln 4 - 1) > 0`: the slope stays positive up to the limit.
    pub fn new(compliance_mm_per_n: f64, growth_mm_per_n: f64, reference_n: f64) -> Self {
        let limit_n = Self::LIMIT * reference_n;
        let limit_mm = limit_n * (compliance_mm_per_n + growth_mm_per_n * -Self::LIMIT.ln());
        Self { compliance_mm_per_n, growth_mm_per_n, reference_n, limit_n, limit_mm }
    }

    /// Returns `dξ/dF` at the limit and beyond.
    fn limit_slope_mm_per_n(&self) -> f64 {
        self.compliance_mm_per_n + self.growth_mm_per_n * (-Self::LIMIT.ln() - 1.0)
    }

    fn slope_mm_per_n(&self, force_n: f64) -> f64 {
        let force_n = force_n.min(self.limit_n);
        self.compliance_mm_per_n + self.growth_mm_per_n * ((self.reference_n / force_n).ln() - 1.0)
    }

    fn approach_mm(&self, force_n: f64) -> f64 {
        if force_n > self.limit_n {
            return self.limit_mm + (force_n - self.limit_n) * self.limit_slope_mm_per_n();
        }
        if force_n > 0.0 {
            force_n * (self.compliance_mm_per_n + self.growth_mm_per_n * (self.reference_n / force_n).ln())
        } else {
            0.0
        }
    }

    /// With `w = A/B + ln(F_r/F)` the law is `ξ = B F w`, that is `w - ln w = A/B + ln(B F_r/ξ)`, the lower branch of
    /// Lambert's function. For `w > 1` it is increasing and convex, so Newton's method approaches the root from above
    /// after one step. The force `ξ/(B w)` keeps the relative digits of w.
    fn force(&self, approach_mm: f64) -> Result<ForceAndExponent, NotConverged> {
        const CAP: u32 = 50;
        if approach_mm >= self.limit_mm {
            let slope = self.limit_slope_mm_per_n();
            let force_n = self.limit_n + (approach_mm - self.limit_mm) / slope;
            return Ok(ForceAndExponent { force_n, exponent: force_n * slope / approach_mm });
        }
        let right = self.compliance_mm_per_n / self.growth_mm_per_n
            + (self.growth_mm_per_n * (self.reference_n / approach_mm)).ln();
        let ln = right.ln();
        let mut w = right + ln + ln / right;
        for _ in 0..CAP {
            let step = (w - w.ln() - right) * w / (w - 1.0);
            w -= step;
            // Quadratic convergence: the next step would be the square of this one over w.
            if step.abs() <= 1e-9 * w {
                return Ok(ForceAndExponent {
                    force_n: approach_mm / (self.growth_mm_per_n * w),
                    exponent: (w - 1.0) / w,
                });
            }
        }
        Err(NotConverged { what: "force of a logarithmic approach", iterations: CAP, bracket_width: w })
    }
}

impl Corner {
    /// Returns `ξ` and `dξ/dF`.
    fn approach(&self, force_n: f64) -> ValueAndSlope {
        let z = (self.narrowing_n / force_n).sqrt();
        let root = 1.0_f64.hypot(z);
        let u = 1.0 / (z + root);
        // 2/u - 1 without a difference of nearly equal numbers.
        let ln = (2.0 * z + 2.0 * z * (z / (root + 1.0))).ln_1p();
        ValueAndSlope {
            value: self.smooth.approach_mm(force_n) + self.growth_mm_per_n * (force_n * ln),
            slope: self.smooth.slope_mm_per_n(force_n) + self.growth_mm_per_n * (ln - z / root / (2.0 - u)),
        }
    }

    fn approach_mm(&self, force_n: f64) -> f64 {
        if force_n > 0.0 { self.approach(force_n).value } else { 0.0 }
    }

    fn force(&self, approach_mm: f64) -> Result<ForceAndExponent, NotConverged> {
        /// The corner's compliance is at most a few dozen times that of the smooth surface.
        const LEAST_SHARE: f64 = 1e-3;
        // Lighter forces have more compliance, so scaling a force that is certainly too light gives one that is still
        // too light.
        let light_n = LEAST_SHARE * self.smooth.force(approach_mm)?.force_n;
        let start_n = light_n * (approach_mm / self.approach(light_n).value);
        let force_n = newton_from_below("force at a corner", start_n, |force_n| {
            let ValueAndSlope { value, slope } = self.approach(force_n);
            ValueAndSlope { value: value - approach_mm, slope }
        })?;
        Ok(ForceAndExponent { force_n, exponent: force_n * self.approach(force_n).slope / approach_mm })
    }
}

impl Approach {
    /// Returns `ξ` under a force.
    pub fn approach_mm(&self, force_n: f64) -> f64 {
        match self {
            Self::Linear { compliance_mm_per_n } => compliance_mm_per_n * force_n,
            Self::Power { exponent, coefficient, compliance_mm_per_n } => {
                coefficient * force_n.powf(*exponent) + compliance_mm_per_n * force_n
            }
            Self::Logarithmic(law) => law.approach_mm(force_n),
            Self::Corner(law) => law.approach_mm(force_n),
        }
    }

    /// Returns the force that makes an approach: the inverse of [`Self::approach_mm`].
    ///
    /// # Errors
    /// [`NotConverged`], if there is no closed form.
    pub fn force(&self, approach_mm: f64) -> Result<ForceAndExponent, NotConverged> {
        match self {
            Self::Linear { compliance_mm_per_n } => {
                Ok(ForceAndExponent { force_n: approach_mm / compliance_mm_per_n, exponent: 1.0 })
            }
            &Self::Power { exponent, coefficient, compliance_mm_per_n } => {
                let alone_n = (approach_mm / coefficient).powf(1.0 / exponent);
                // If the linear part is negligible, so is its share in the force.
                if compliance_mm_per_n * alone_n <= 0.0 {
                    return Ok(ForceAndExponent { force_n: alone_n, exponent });
                }
                // With half of the approach for either part the force is too small for both together.
                let half_n = alone_n * 0.5_f64.powf(1.0 / exponent);
                let start_n = half_n.min(0.5 * approach_mm / compliance_mm_per_n);
                let force_n = newton_from_below("force of a power and a linear approach", start_n, |force_n| {
                    let power_mm = coefficient * force_n.powf(exponent);
                    ValueAndSlope {
                        value: (power_mm - approach_mm) + compliance_mm_per_n * force_n,
                        slope: exponent * power_mm / force_n + compliance_mm_per_n,
                    }
                })?;
                let linear_mm = compliance_mm_per_n * force_n;
                let power_mm = coefficient * force_n.powf(exponent);
                let exponent = (exponent * power_mm + linear_mm) / (power_mm + linear_mm);
                Ok(ForceAndExponent { force_n, exponent })
            }
            Self::Logarithmic(law) => law.force(approach_mm),
            Self::Corner(law) => law.force(approach_mm),
        }
    }

    /// Returns the approach at which the law ends; infinite for most laws.
    pub fn limit_mm(&self) -> f64 {
        match self {
            Self::Linear { .. } | Self::Power { .. } => f64::INFINITY,
            Self::Logarithmic(law) => law.limit_mm,
            Self::Corner(law) => law.approach_mm(law.smooth.limit_n),
        }
    }

    /// Returns the least coefficient of its parts, under 1 N. If it is negative, the approach falls at some force, and
    /// this type does not apply.
    pub(crate) fn least_part_mm(&self) -> f64 {
        match *self {
            Self::Power { coefficient, compliance_mm_per_n, .. } if compliance_mm_per_n >= 0.0 => coefficient,
            Self::Linear { compliance_mm_per_n }
            | Self::Power { compliance_mm_per_n, .. }
            | Self::Logarithmic(Logarithmic { compliance_mm_per_n, .. })
            | Self::Corner(Corner { smooth: Logarithmic { compliance_mm_per_n, .. }, .. }) => compliance_mm_per_n,
        }
    }

    /// Returns the exponent of a law that is a single power.
    pub(crate) fn single_exponent(&self) -> Option<f64> {
        match *self {
            Self::Linear { .. } => Some(1.0),
            Self::Power { exponent, compliance_mm_per_n, .. } => (compliance_mm_per_n <= 0.0).then_some(exponent),
            Self::Logarithmic(_) | Self::Corner(_) => None,
        }
    }
}
