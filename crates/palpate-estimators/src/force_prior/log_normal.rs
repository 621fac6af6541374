//! Truncated log-normal prior of a force, and its integral with a likelihood.
//!
//! A likelihood exp(b·W − ½·a·W²) has the maximum Ŵ = b/a and the signal-to-noise ratio z = Ŵ·√a. The
//! integral uses
//!
//! - for z·min(1, s) ≥ 6 the log prior about Ŵ to second order: the third is at most a hundredth at a
//!   relative standard deviation of 1/6;
//! - otherwise the trapezoidal rule over t = ln W, with error 2·e^(−2π²σ²/h²). For σ ≥ min(1, s)/6 the step h
//!   = min(1, s)/8 errs by less than a thousandth.

use super::cut_normal::CutNormal;
use super::{ForceIntegral, ForceLikelihood, PriorTerms};
use palpate_numerics::NORMAL_99;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LogNormalPrior {
    /// μ and s.
    log_median: f64,
    log_sd: f64,
    greatest_n: f64,
    /// W and probability, rising.
    nodes: Vec<[f64; 2]>,
}

/// Least z·min(1, s) of the expansion.
const DISTINCT: f64 = 6.0;
/// Lowest node in standard deviations: a tail below 1 in 30,000.
const LOWEST: f64 = 4.0;

impl LogNormalPrior {
    pub fn new(least_n: f64, greatest_n: f64) -> Self {
        /// For 60 decades; longer steps are coarse but valid.
        const MOST_NODES: f64 = 2000.0;
        // A power of a force may overflow or underflow.
        let in_numbers = |force_n: f64| force_n.clamp(f64::MIN_POSITIVE, f64::MAX).ln();
        let (low, high) = (in_numbers(least_n), in_numbers(greatest_n));
        let (log_median, log_sd) = (0.5 * (low + high), ((high - low) / (2.0 * NORMAL_99)).max(1e-6));
        let step = (log_sd.min(1.0) / 8.0).max((LOWEST + NORMAL_99) * log_sd / MOST_NODES);
        let from = (log_median - LOWEST * log_sd).max(f64::MIN_POSITIVE.ln());
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

    pub fn ends_n(&self) -> (f64, f64) {
        (self.nodes[0][0], self.greatest_n)
    }

    /// −2·ln of the width relative to the prior, from z².
    pub fn signal_cost(&self, square: f64) -> f64 {
        (self.log_sd * self.log_sd * square.max(0.0)).ln_1p()
    }

    pub fn terms(&self, force_n: f64) -> PriorTerms {
        let force_n = force_n.max(self.nodes[0][0]);
        let (residual, slope) = (self.deviation(force_n), 1.0 / (self.log_sd * force_n));
        PriorTerms { cost: residual * residual, slope: residual * slope, precision: slope * slope }
    }

    /// Mode where the expansion is valid, else mean.
    pub fn estimate_n(&self, b: f64, a: f64) -> f64 {
        if self.is_distinct(b, a) {
            self.expand(b, a).0.mean_n.clamp(0.0, self.greatest_n)
        } else {
            self.sum(ForceLikelihood { b, a, at_n: 0.0, misfit: 0.0 }).mean_n
        }
    }

    pub fn integrate(&self, likelihood: ForceLikelihood) -> ForceIntegral {
        let ForceLikelihood { b, a, .. } = likelihood;
        if self.is_distinct(b, a) {
            let (cut, cost) = self.expand(b, a);
            cut.integrate(likelihood.misfit_at(b / a) + cost)
        } else {
            self.sum(likelihood)
        }
    }

    fn is_distinct(&self, b: f64, a: f64) -> bool {
        b > 0.0 && a > 0.0 && b * self.log_sd.min(1.0) >= DISTINCT * a.sqrt()
    }

    fn deviation(&self, force_n: f64) -> f64 {
        (force_n.ln() - self.log_median) / self.log_sd
    }

    /// Expansion: ln p, p = exp(−q²/2)/(s·W), q = (ln W − μ)/s, k = q/s has the slope −(1 + k)/W and the
    /// curvature (1 + k − 1/s²)/W².
    fn expand(&self, b: f64, a: f64) -> (CutNormal, f64) {
        let found_n = b / a;
        let q = self.deviation(found_n);
        let k = q / self.log_sd;
        let slope = -(1.0 + k) / found_n;
        let curvature = (1.0 + k - self.log_sd.powi(-2)) / (found_n * found_n);
        // Far below the range the prior has no maximum; the curvature of the likelihood remains.
        let precision = (a - curvature).max(0.5 * a);
        let cut = CutNormal { mean_n: found_n + slope / precision, precision, greatest_n: self.greatest_n };
        (cut, q * q + 2.0 * (self.log_sd * found_n).ln() - slope * slope / precision)
    }

    fn sum(&self, likelihood: ForceLikelihood) -> ForceIntegral {
        let ForceLikelihood { b, a, .. } = likelihood;
        let exponent = |force_n: f64| force_n * (b - 0.5 * a * force_n);
        let (least_n, most_n) = self.ends_n();
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
        if all.is_nan() || all <= 0.0 {
            let (peak_cost, mean_n) = (f64::INFINITY, nearest_n);
            return ForceIntegral { peak_cost, width_cost: 0.0, mean_n, variance_n2: 0.0 };
        }
        let mean_n = first / all;
        ForceIntegral {
            peak_cost: likelihood.misfit_at(nearest_n),
            width_cost: -2.0 * all.ln(),
            mean_n,
            variance_n2: (second / all - mean_n * mean_n).max(0.0),
        }
    }
}

impl ForceLikelihood {
    fn misfit_at(&self, force_n: f64) -> f64 {
        self.misfit + (force_n - self.at_n) * (self.a * (force_n + self.at_n) - 2.0 * self.b)
    }
}
