//! What training answers.

use super::Topology;

/// How a training ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainingStatus {
    /// The aggregate error fell to the tolerance.
    Converged,
    /// The epoch cap came first.
    Capped,
    /// The weights left the numbers.
    Diverged,
}

impl std::fmt::Display for TrainingStatus {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Converged => "converged",
            Self::Capped => "capped",
            Self::Diverged => "diverged",
        })
    }
}

/// How a training ended and what it took. Not converging is a status, never an error.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrainingOutcome {
    /// How it ended.
    pub status: TrainingStatus,
    /// Passes over all patterns.
    pub epochs: u32,
    /// Sum of squared output errors over the last epoch.
    pub aggregate_error: f64,
}

impl Default for TrainingOutcome {
    /// That of a method which is not trained by epochs: converged before the first.
    fn default() -> Self {
        Self { status: TrainingStatus::Converged, epochs: 0, aggregate_error: 0.0 }
    }
}

impl TrainingOutcome {
    /// The verdict after an epoch: `None` while training goes on.
    pub(super) fn after_epoch(epochs: u32, error: f64, rule: &super::BackPropagation) -> Option<Self> {
        let status = if !error.is_finite() {
            TrainingStatus::Diverged
        } else if error <= rule.aggregate_error {
            TrainingStatus::Converged
        } else if epochs >= rule.max_epochs {
            TrainingStatus::Capped
        } else {
            return None;
        };
        Some(Self { status, epochs, aggregate_error: error })
    }
}

/// A network's weights, and how they were found.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedNetwork {
    /// Its shape.
    pub topology: Topology,
    /// Its weights, in the order that [`Topology`] states.
    pub weights: Vec<f64>,
    /// How its training ended.
    pub outcome: TrainingOutcome,
}
