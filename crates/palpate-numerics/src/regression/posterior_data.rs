//! What of a posterior is written to a file.

use super::{Hyperparameters, Kernel, Trend};
use crate::NotPositiveDefinite;

/// Everything that predictions need, but for what can be computed from it. Lists of lists are flat, row by row.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PosteriorData {
    pub kernel: Kernel,
    pub trend: Trend,
    /// What is taken off each coordinate.
    pub centre: Vec<f64>,
    /// What the trend then divides it by.
    pub spread: Vec<f64>,
    pub hyperparameters: Hyperparameters,
    /// n×d.
    pub inputs: Vec<f64>,
    /// Noise variance of each point over the signal's.
    pub noise: Vec<f64>,
    /// That of a single row, where it was fitted.
    pub row_noise: Option<f64>,
    pub offset: Vec<f64>,
    pub scale: Vec<f64>,
    pub signal_variance: Vec<f64>,
    /// m×n.
    pub weights: Vec<f64>,
    /// m×q.
    pub trend_coefficients: Vec<f64>,
    pub log_evidence: f64,
}

/// A posterior from a file, whose numbers do not fit together.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PosteriorFault {
    /// A list has the wrong length.
    #[error("the Gaussian process has {found} {what}; it must have {needed}")]
    Count {
        /// What the list holds.
        what: &'static str,
        /// Length that the rest asks for.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// A number that is infinite, not a number, or beyond its bound.
    #[error("the Gaussian process's {what} number {number} is {value}; it must be {bound}")]
    BadNumber {
        /// What the list holds.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
        /// Its value.
        value: f64,
        /// What it must be.
        bound: &'static str,
    },
    /// Its covariance does not factor.
    #[error("the Gaussian process's covariance cannot be factored: {0}")]
    Singular(#[from] NotPositiveDefinite),
}

impl PosteriorData {
    /// Checks lengths and ranges.
    pub fn check(&self) -> Result<(), PosteriorFault> {
        let (n, d, m) = (self.noise.len(), self.centre.len(), self.offset.len());
        let some = |what, found: usize| {
            if found > 0 { Ok(()) } else { Err(PosteriorFault::Count { what, needed: 1, found }) }
        };
        some("points", n)?;
        some("coordinates", d)?;
        some("outputs", m)?;
        let lists: [(&'static str, usize, &[f64]); 6] = [
            ("spreads", d, &self.spread),
            ("length scales", d, &self.hyperparameters.length_scales),
            ("inputs", n.saturating_mul(d), &self.inputs),
            ("scales", m, &self.scale),
            ("signal variances", m, &self.signal_variance),
            ("weights", n.saturating_mul(m), &self.weights),
        ];
        let trend = ("trend coefficients", m * self.trend.size(d), &self.trend_coefficients[..]);
        for (what, needed, list) in lists.into_iter().chain([trend]) {
            if list.len() != needed {
                return Err(PosteriorFault::Count { what, needed, found: list.len() });
            }
        }
        let finite = [&self.centre, &self.inputs, &self.offset, &self.weights, &self.trend_coefficients];
        let names = ["centre", "input", "offset", "weight", "trend coefficient"];
        for (what, list) in names.into_iter().zip(finite) {
            numbers(what, list, |_| true, "finite")?;
        }
        let positive =
            [&self.spread, &self.hyperparameters.length_scales, &self.scale, &self.signal_variance];
        for (what, list) in ["spread", "length scale", "scale", "signal variance"].into_iter().zip(positive) {
            numbers(what, list, |value| value > 0.0, "finite and greater than 0")?;
        }
        numbers(
            "noise ratio",
            &[self.hyperparameters.noise_ratio],
            |v| v > 0.0,
            "finite and greater than 0",
        )?;
        numbers("log evidence", &[self.log_evidence], |_| true, "finite")?;
        let noise: Vec<f64> = self.noise.iter().copied().chain(self.row_noise).collect();
        numbers("noise", &noise, |value| value >= 0.0, "finite and at least 0")
    }
}

fn numbers(
    what: &'static str,
    list: &[f64],
    good: impl Fn(f64) -> bool,
    bound: &'static str,
) -> Result<(), PosteriorFault> {
    match list.iter().position(|value| !(value.is_finite() && good(*value))) {
        Some(i) => Err(PosteriorFault::BadNumber { what, number: i + 1, value: list[i], bound }),
        None => Ok(()),
    }
}
