//! Candidates of `auto`.

use serde::{Deserialize, Serialize};

/// Cross-validated errors of a candidate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CandidateErrors {
    /// Name: [`Estimator::name`](crate::estimator::Estimator::name).
    pub name: String,
    /// Mean error.
    pub mean_error_m: f64,
    /// Mean interval score:
    /// [`Evaluation::interval_score_m`](crate::evaluation::Evaluation::interval_score_m).
    pub interval_score_m: f64,
    /// Coverage of the 95 % regions.
    pub coverage_percent: Option<f64>,
}

impl CandidateErrors {
    /// Geometric mean of mean error and interval score.
    pub fn score_m(&self) -> f64 {
        (self.mean_error_m * self.interval_score_m).sqrt()
    }
}
