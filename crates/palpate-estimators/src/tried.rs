//! Estimators among which `auto` chooses.

use serde::{Deserialize, Serialize};

/// Errors and intervals of an estimator at held-out positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tried {
    /// Name of the estimator: [`Estimator::name`](crate::estimator::Estimator::name).
    pub name: String,
    /// Mean error in metres.
    pub mean_error_m: f64,
    /// Mean score of its 95 % intervals in metres: [`Evaluation::interval_score_m`](crate::evaluation::Evaluation::interval_score_m).
    pub interval_score_m: f64,
    /// Share of its 95 % regions that contain the contact, in %, where it has them.
    pub coverage_percent: Option<f64>,
}

impl Tried {
    /// Geometric mean of mean error and interval score in metres: an estimator must be accurate, and its intervals must be valid.
    pub fn score_m(&self) -> f64 {
        (self.mean_error_m * self.interval_score_m).sqrt()
    }
}
