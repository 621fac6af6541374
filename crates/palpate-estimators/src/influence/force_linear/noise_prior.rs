//! Prior of the channels' noise variances, which few presses without repeats do not determine one by one.
//!
//! The variance of channel c has a scaled inverse χ² distribution with ν₀ = 2 degrees of freedom and scale
//! s₀²·u_c² (Gelman et al., *Bayesian Data Analysis*, 2013, section 2.6; Smyth, Statistical Applications in
//! Genetics and Molecular Biology 3, 2004): channels are alike within about a factor of three. The unit u_c is
//! the channel's signal, for equal signal-to-noise ratios, or common, for equal noise. Units and scales are
//! averaged by their evidence.

use crate::influence::calibration::CalibrationRows;
use palpate_numerics::{mean, mean_and_variance};
use std::f64::consts::PI;

/// ν₀.
const FREEDOM: f64 = 2.0;

/// Prior of all channels' noise variances.
pub(super) struct NoisePrior {
    /// s₀²·u_c².
    pub scales: Vec<f64>,
}

impl NoisePrior {
    /// Equal noise or equal signal-to-noise ratios, from a thousandth to a tenth of the signal.
    pub fn candidates(presses: &CalibrationRows) -> Vec<Self> {
        /// Powers of ten of the variance.
        const DECADES: std::ops::RangeInclusive<i32> = -6..=-2;
        let signals = signal_variances(presses);
        let common = mean(signals.iter().map(|signal| signal.ln())).exp();
        let units = [signals.clone(), vec![common; signals.len()]];
        let scaled = |unit: &Vec<f64>, decade: i32| Self {
            scales: unit.iter().map(|variance| variance * 10f64.powi(decade)).collect(),
        };
        units.iter().flat_map(|unit| DECADES.map(move |decade| scaled(unit, decade))).collect()
    }
}

/// Variance of each channel's readings.
pub(super) fn signal_variances(presses: &CalibrationRows) -> Vec<f64> {
    let channels = presses.means.columns().into_iter();
    channels.map(|channel| mean_and_variance(channel.iter().copied()).1.max(f64::MIN_POSITIVE)).collect()
}

/// Student's t density of a residue of ν degrees of freedom under one prior, as a function of its square:
/// constant − ½·(ν₀ + ν)·ln(ν₀·scale + square).
#[derive(Clone, Copy)]
pub(super) struct ResidueDensity {
    constant: f64,
    power: f64,
    /// Whole part of the power, and whether a half remains.
    whole: (i32, bool),
    /// ν₀ times the scale.
    prior: f64,
}

impl ResidueDensity {
    pub fn new(scale: f64, freedom: f64) -> Self {
        let prior = FREEDOM * scale;
        let power = 0.5 * (FREEDOM + freedom);
        let constant = libm::lgamma(power) - libm::lgamma(0.5 * FREEDOM) - 0.5 * freedom * PI.ln()
            + 0.5 * FREEDOM * prior.ln();
        let doubled = (2.0 * power).round() as i32;
        Self { constant, power, whole: (doubled / 2, doubled % 2 == 1), prior }
    }

    pub fn log_of(&self, square: f64) -> f64 {
        self.constant - self.power * (self.prior + square).ln()
    }

    /// Scale of the prior, up to a factor of all priors.
    pub fn scale(&self) -> f64 {
        self.prior
    }

    /// Density of a residue over that of the residue `least`.
    ///
    /// The power is an integer or half of one, so that no residue needs a logarithm.
    pub fn relative(&self, square: f64, least: f64) -> f64 {
        let base = (self.prior + least) / (self.prior + square);
        let (whole, has_half) = self.whole;
        let power = base.powi(whole);
        if has_half { power * base.sqrt() } else { power }
    }

    /// Logarithm of the summed density of residues with the squares and weights `residues`, given by the
    /// least square.
    pub fn log_sum_of(&self, residues: &[(f64, f64)], least: f64) -> f64 {
        let sum: f64 = residues.iter().map(|(square, weight)| weight * self.relative(*square, least)).sum();
        self.log_of(least) + sum.ln()
    }

    /// Posterior mean of the noise variance.
    fn noise_variance(&self, square: f64) -> f64 {
        (self.prior + square) / (2.0 * self.power - 2.0)
    }
}

/// Mixture of [`NoisePrior`]s of one channel.
#[derive(Clone, Debug, Default)]
pub(super) struct NoiseDensity {
    /// ln of the weight, and the scale s₀²·u_c².
    pub terms: Vec<(f64, f64)>,
}

/// Density of the residues of one channel under a mixture of noise priors.
pub(super) struct ResidueMixture {
    terms: Vec<(f64, ResidueDensity)>,
    /// ½·ν.
    half_freedom: f64,
}

impl ResidueMixture {
    pub fn new(noise: &NoiseDensity, freedom: f64) -> Self {
        let term = |(log_weight, scale): &(f64, f64)| (*log_weight, ResidueDensity::new(*scale, freedom));
        Self { terms: noise.terms.iter().map(term).collect(), half_freedom: 0.5 * freedom }
    }

    /// Log density of a squared residue over s², and the posterior mean of s².
    pub fn of_residue(&self, square: f64, ratio: f64) -> (f64, f64) {
        let square = ratio * square;
        // Relative to the most probable term so far.
        let (mut most, mut sum, mut variance) = (f64::NEG_INFINITY, 0.0, 0.0);
        for (log_weight, density) in &self.terms {
            let log = log_weight + density.log_of(square);
            if log > most {
                let scale = (most - log).exp();
                (most, sum, variance) = (log, sum * scale, variance * scale);
            }
            let weight = (log - most).exp();
            sum += weight;
            variance += weight * density.noise_variance(square);
        }
        (most + sum.ln() + self.half_freedom * ratio.ln(), variance / sum / ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Density of a squared residue by integration over ln σ².
    fn integrated(square: f64, freedom: f64, scale: f64) -> f64 {
        const STEP: f64 = 1e-3;
        let density = |ln_variance: f64| {
            let variance = ln_variance.exp();
            let normal = -0.5 * (freedom * (2.0 * PI * variance).ln() + square / variance);
            let half = 0.5 * FREEDOM;
            let prior = half * (half * scale).ln()
                - libm::lgamma(half)
                - half * ln_variance
                - half * scale / variance;
            (normal + prior).exp()
        };
        STEP * (-20_000..20_000).map(|i| density(f64::from(i) * STEP)).sum::<f64>()
    }

    #[test]
    fn the_noise_variance_is_integrated() {
        for (square, freedom, scale) in [(0.3, 1.0, 0.1), (5.0, 7.0, 1.0), (40.0, 24.0, 0.5)] {
            let found = ResidueDensity::new(scale, freedom).log_of(square);
            let sum = integrated(square, freedom, scale).ln();
            assert!((found - sum).abs() < 1e-6, "{square} {freedom} {scale}: {found} {sum}");
        }
    }

    #[test]
    fn sums_of_densities_are_those_of_each_residue() {
        for freedom in [3.0, 4.0, 25.0] {
            let density = ResidueDensity::new(0.2, freedom);
            let residues: Vec<(f64, f64)> =
                (0..9).map(|i| (1.0 + f64::from(i), 0.1 + 0.3 * f64::from(i % 4))).collect();
            let sum: f64 =
                residues.iter().map(|(square, weight)| weight * density.log_of(*square).exp()).sum();
            let found = density.log_sum_of(&residues, 1.0);
            assert!((found - sum.ln()).abs() < 1e-12, "{freedom}: {found}");
        }
    }

    #[test]
    fn a_mixture_of_one_prior_is_this_prior() {
        let (freedom, scale, square, ratio) = (6.0, 0.4, 3.0, 0.1);
        let noise = NoiseDensity { terms: vec![(0.7, scale)] };
        let (log, signal) = ResidueMixture::new(&noise, freedom).of_residue(square, ratio);
        let density = ResidueDensity::new(scale, freedom);
        let expected = 0.7 + density.log_of(ratio * square) + 0.5 * freedom * ratio.ln();
        assert!((log - expected).abs() < 1e-12);
        // E[σ²] = (ν₀·scale + square)/(ν₀ + ν − 2).
        assert!((signal * ratio - (2.0 * scale + ratio * square) / freedom).abs() < 1e-12);
    }
}
