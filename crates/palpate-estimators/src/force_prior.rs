//! Prior of the force of a contact whose force is not known: one for the estimators, the tracker and the status of readings.
//!
//! A [`ForceRange`] (W₁, W₂) is a log-normal distribution, ln W ~ N(μ, s²) with the quantiles W₁ at 0.5 % and W₂ at 99.5 %, cut off at W₂. Over
//! several decades it is nearly flat in ln W: a place where the surface is stiff, and a greater force has to explain the reading, is as probable as
//! any other. A prior flat in W would prefer the stiff places beside supports, in proportion to the force that they need.
//!
//! A reading has the likelihood exp(b·W − ½·a·W²) of a force at a place, with the least-squares force Ŵ = b/a and the signal-to-noise ratio z = Ŵ·√a.
//! [`ForcePrior::integrate`] integrates prior times likelihood:
//!
//! - for z·min(1, s) ≥ 6 the prior hardly changes over the likelihood. Its logarithm expanded about Ŵ to the second order leaves a normal
//!   distribution, cut off at both ends; with a relative standard deviation of 1/6 or less, the third order is a hundredth of the integral or less;
//! - otherwise by the trapezoidal rule over t = ln W. For a density of standard deviation σ in t the rule with the step h errs by 2·e^(−2π²σ²/h²).
//!   The likelihood has σ = 1/z ≥ min(1, s)/6 and the prior σ = s, so h = min(1, s)/8 errs by less than a thousandth, also where the cut is near.

use palpate_numerics::{NORMAL_99, OutOfRange, normal_between, normal_interval_95};
use serde::{Deserialize, Serialize};

/// Range of the forces of contacts, in newtons: 1 in 200 is less than its lower end, and none is greater than its upper end.
///
/// ```
/// use palpate_estimators::force_prior::ForceRange;
///
/// let range = ForceRange::new(0.5, 10.0)?;
/// assert_eq!(range.ends_n(), (0.5, 10.0));
/// let refused = ForceRange::new(10.0, 0.5).unwrap_err().to_string();
/// assert_eq!(refused, "the upper end of the force range in newtons is 0.5; it must be greater than the lower end");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "(f64, f64)", into = "(f64, f64)")]
pub struct ForceRange {
    least_n: f64,
    greatest_n: f64,
}

/// Where readings are proportional to the force, contacts may be so many times lighter or harder than the presses of the calibration: a decade.
pub(crate) const DECADE: f64 = 10.0;

impl ForceRange {
    /// From a least to a greatest force, in newtons.
    ///
    /// # Errors
    /// [`OutOfRange`] for an end that is not greater than 0 and finite, and an upper end that is not greater than the lower one.
    pub fn new(least_n: f64, greatest_n: f64) -> Result<Self, OutOfRange> {
        const UPPER: &str = "the upper end of the force range in newtons";
        let ends = [("the lower end of the force range in newtons", least_n), (UPPER, greatest_n)];
        OutOfRange::check_positive(ends)?;
        OutOfRange::check("greater than the lower end", [(UPPER, greatest_n)], |upper| upper > least_n)?;
        Ok(Self { least_n, greatest_n })
    }

    /// A decade either side of the mean force of presses, in newtons, and all of these; `None` without a press.
    ///
    /// Readings that are proportional to the force have the same directions at any force, so extrapolation is safe there. Where readings follow
    /// another function of the force, nothing but the calibration knows it, and contacts are expected to be about as hard as the presses.
    pub fn of_presses(forces_n: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut sum_n, mut count, mut least_n, mut greatest_n) = (0.0, 0.0, f64::INFINITY, 0.0f64);
        for force_n in forces_n {
            (sum_n, count) = (sum_n + force_n, count + 1.0);
            (least_n, greatest_n) = (least_n.min(force_n), greatest_n.max(force_n));
        }
        let mean_n: f64 = sum_n / count;
        Self::new(least_n.min(mean_n / DECADE), greatest_n.max(mean_n * DECADE)).ok()
    }

    /// Lower and upper end, in newtons.
    pub fn ends_n(self) -> (f64, f64) {
        (self.least_n, self.greatest_n)
    }
}

impl TryFrom<(f64, f64)> for ForceRange {
    type Error = OutOfRange;

    fn try_from((least_n, greatest_n): (f64, f64)) -> Result<Self, OutOfRange> {
        Self::new(least_n, greatest_n)
    }
}

impl From<ForceRange> for (f64, f64) {
    fn from(range: ForceRange) -> Self {
        range.ends_n()
    }
}

/// Prior of an unknown force, or of another quantity in newtons that is a power of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ForcePrior {
    /// Normal, cut off at 0 and at a greatest force.
    Normal { mean_n: f64, precision: f64, greatest_n: f64 },
    /// Log-normal, cut off at a greatest force.
    LogNormal(LogNormal),
}

/// Log-normal distribution that is cut off at a greatest force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LogNormal {
    /// μ and s.
    log_median: f64,
    log_sd: f64,
    greatest_n: f64,
    /// W and its probability at the nodes of the trapezoidal rule, in rising order.
    nodes: Vec<[f64; 2]>,
}

/// Posterior of a force at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceIntegral {
    /// −2·ln of the integral of prior and likelihood, up to a constant of the prior.
    pub cost: f64,
    pub mean_n: f64,
    pub variance_n2: f64,
}

/// Least z·min(1, s) of a prior that hardly changes over the likelihood.
const DISTINCT: f64 = 6.0;

impl From<ForceRange> for ForcePrior {
    fn from(range: ForceRange) -> Self {
        Self::LogNormal(LogNormal::new(range.least_n, range.greatest_n))
    }
}

impl ForcePrior {
    /// The log-normal distribution with these quantiles at 0.5 % and 99.5 %, which is cut off at the upper one.
    pub fn log_normal(least_n: f64, greatest_n: f64) -> Self {
        Self::LogNormal(LogNormal::new(least_n, greatest_n))
    }

    /// The least force that matters, and the greatest that is possible, in newtons.
    pub fn ends_n(&self) -> (f64, f64) {
        match self {
            Self::Normal { greatest_n, .. } => (0.0, *greatest_n),
            Self::LogNormal(prior) => (prior.nodes[0][0], prior.greatest_n),
        }
    }

    /// Mean and precision of the normal density; precision 0 of a log-normal one.
    pub fn normal_part(&self) -> [f64; 2] {
        match self {
            Self::Normal { mean_n, precision, .. } => [*mean_n, *precision],
            Self::LogNormal(_) => [0.0, 0.0],
        }
    }

    /// Residual r, with r² = −2·ln of the density up to a constant, and its slope per newton. The log-normal's is that of the density of ln W.
    pub fn residual(&self, force_n: f64) -> [f64; 2] {
        match self {
            Self::Normal { mean_n, precision, .. } => {
                let root = precision.sqrt();
                [(force_n - mean_n) * root, root]
            }
            Self::LogNormal(prior) => {
                let force_n = force_n.max(prior.nodes[0][0]);
                [prior.deviation(force_n), 1.0 / (prior.log_sd * force_n)]
            }
        }
    }

    /// The cost, −2·ln, that the prior adds to a reading of signal-to-noise ratio z, beside that of a force away from the median.
    pub fn signal_cost(&self, square: f64) -> f64 {
        match self {
            Self::Normal { .. } => 0.0,
            Self::LogNormal(prior) => (prior.log_sd * prior.log_sd * square.max(0.0)).ln_1p(),
        }
    }

    /// Point estimate of the force by the likelihood exp(b·W − ½·a·W²).
    pub fn estimate_n(&self, b: f64, a: f64) -> f64 {
        match self {
            Self::Normal { mean_n, precision, greatest_n } => {
                let estimate_n = (b + mean_n * precision) / (a + precision);
                if estimate_n > 0.0 { estimate_n.min(*greatest_n) } else { 0.0 }
            }
            Self::LogNormal(prior) => prior.integrate(b, a).mean_n,
        }
    }

    /// The integral of prior and likelihood exp(b·W − ½·a·W²), with mean and variance of the force; an infinite cost where these are no numbers.
    pub fn integrate(&self, b: f64, a: f64) -> ForceIntegral {
        match self {
            Self::Normal { mean_n, precision, greatest_n } => {
                let all = a + precision;
                let cut = CutNormal { mean_n: (b + mean_n * precision) / all, precision: all };
                let own = precision * mean_n * mean_n;
                cut.integrate(own - all * cut.mean_n * cut.mean_n, *greatest_n)
            }
            Self::LogNormal(prior) => prior.integrate(b, a),
        }
    }
}

impl LogNormal {
    /// Standard deviations below the median at which the nodes begin: less than 1 in 30,000 is lighter.
    const LOWEST: f64 = 4.0;

    fn new(least_n: f64, greatest_n: f64) -> Self {
        /// Most nodes, which a range of 60 decades has: a rule with longer steps is coarse, and still a prior.
        const MOST_NODES: f64 = 2000.0;
        // A power of a force may be beyond all numbers.
        let in_numbers = |force_n: f64| force_n.clamp(f64::MIN_POSITIVE, f64::MAX).ln();
        let (low, high) = (in_numbers(least_n), in_numbers(greatest_n));
        let (log_median, log_sd) = (0.5 * (low + high), ((high - low) / (2.0 * NORMAL_99)).max(1e-6));
        let step = (log_sd.min(1.0) / 8.0).max((Self::LOWEST + NORMAL_99) * log_sd / MOST_NODES);
        let from = (log_median - Self::LOWEST * log_sd).max(f64::MIN_POSITIVE.ln());
        let count = ((high - from) / step).ceil().max(1.0);
        let node = |i: usize| {
            let t = from + (high - from) * i as f64 / count;
            let end = if i == 0 || i as f64 == count { 0.5 } else { 1.0 };
            [t.exp(), end * (-0.5 * ((t - log_median) / log_sd).powi(2)).exp()]
        };
        let mut nodes: Vec<[f64; 2]> = (0..=count as usize).map(node).collect();
        let sum: f64 = nodes.iter().map(|[_, weight]| weight).sum();
        nodes.iter_mut().for_each(|[_, weight]| *weight /= sum);
        Self { log_median, log_sd, greatest_n, nodes }
    }

    /// ln W from the median, in standard deviations.
    fn deviation(&self, force_n: f64) -> f64 {
        (force_n.ln() - self.log_median) / self.log_sd
    }

    fn integrate(&self, b: f64, a: f64) -> ForceIntegral {
        let is_distinct = b > 0.0 && a > 0.0 && b * self.log_sd.min(1.0) >= DISTINCT * a.sqrt();
        if is_distinct { self.expand(b, a) } else { self.sum(b, a) }
    }

    /// By the second order of ln p about Ŵ, p = exp(−q²/2)/(s·W) with q = (ln W − μ)/s: with k = q/s the slope is −(1 + k)/W and the curvature
    /// (1 + k − 1/s²)/W².
    fn expand(&self, b: f64, a: f64) -> ForceIntegral {
        let found_n = b / a;
        let q = self.deviation(found_n);
        let k = q / self.log_sd;
        let slope = -(1.0 + k) / found_n;
        let curvature = (1.0 + k - self.log_sd.powi(-2)) / (found_n * found_n);
        // Far below the range the curvature of the prior alone is that of no maximum; the likelihood's stays.
        let precision = (a - curvature).max(0.5 * a);
        let cut = CutNormal { mean_n: found_n + slope / precision, precision };
        let cost = q * q + 2.0 * (self.log_sd * found_n).ln() - b * found_n - slope * slope / precision;
        cut.integrate(cost, self.greatest_n)
    }

    /// By the trapezoidal rule.
    fn sum(&self, b: f64, a: f64) -> ForceIntegral {
        let exponent = |force_n: f64| force_n * (b - 0.5 * a * force_n);
        let (least_n, most_n) = (self.nodes[0][0], self.greatest_n);
        let nearest_n = if a > 0.0 {
            (b / a).clamp(least_n, most_n)
        } else if b > 0.0 {
            most_n
        } else {
            least_n
        };
        let reference = exponent(nearest_n);
        let mut sums = [0.0; 3];
        for [force_n, weight] in &self.nodes {
            let share = weight * (exponent(*force_n) - reference).exp();
            let moments = [1.0, *force_n, force_n * force_n];
            sums.iter_mut().zip(moments).for_each(|(sum, moment)| *sum += share * moment);
        }
        let [all, first, second] = sums;
        let mean_n = first / all;
        ForceIntegral {
            cost: if all > 0.0 { -2.0 * (reference + all.ln()) } else { f64::INFINITY },
            mean_n: if all > 0.0 { mean_n } else { nearest_n },
            variance_n2: if all > 0.0 { (second / all - mean_n * mean_n).max(0.0) } else { 0.0 },
        }
    }
}

/// Normal distribution of a force that is cut off at 0 and at a greatest force.
struct CutNormal {
    mean_n: f64,
    precision: f64,
}

impl CutNormal {
    /// The integral, by the `cost` of the mean.
    fn integrate(&self, cost: f64, greatest_n: f64) -> ForceIntegral {
        let Self { mean_n, precision } = *self;
        if precision.is_nan() || precision <= 0.0 {
            return ForceIntegral {
                cost: f64::INFINITY,
                mean_n: mean_n.clamp(0.0, greatest_n),
                variance_n2: 0.0,
            };
        }
        let sd_n = precision.sqrt().recip();
        let part = normal_between(-mean_n / sd_n, (greatest_n - mean_n) / sd_n);
        ForceIntegral {
            cost: cost - 2.0 * (part.ln_share + sd_n.ln()),
            mean_n: (mean_n + sd_n * part.mean).clamp(0.0, greatest_n),
            variance_n2: part.variance * sd_n * sd_n,
        }
    }
}

/// The 95 % interval of a force by a normal distribution, in newtons. Contacts press: the interval of a force that presses ends at 0.
///
/// ```
/// use palpate_estimators::force_prior::force_interval_95_n;
///
/// assert_eq!(force_interval_95_n(1.0, 5.0).0, 0.0);
/// assert!(force_interval_95_n(-1.0, 0.1).1 < 0.0); // where the rig counts pulls as negative forces
/// ```
pub fn force_interval_95_n(force_n: f64, sd_n: f64) -> (f64, f64) {
    let (low_n, high_n) = normal_interval_95(force_n, sd_n);
    if force_n >= 0.0 { (low_n.max(0.0), high_n) } else { (low_n, high_n) }
}

#[cfg(test)]
mod tests;
