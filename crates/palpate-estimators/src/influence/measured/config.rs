//! Settings and errors of the measured-surface method.

use crate::fit::ChannelMismatch;
use crate::recording::TooFewPositions;
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::regression::{Kernel, RegressionError, Trend};
use palpate_numerics::watch::Cancelled;

/// Settings of the regression of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasuredInfluence {
    /// Scale of the readings; `None` for logarithms if all are positive.
    pub readings: Option<Scale>,
    /// Scale of the nuisance coordinate; `None` for logarithms if all are positive.
    pub nuisance: Option<Scale>,
    /// Kernel of the process.
    pub kernel: Kernel,
    /// Mean far from every press.
    pub trend: Trend,
    /// Most distinct presses of the hyperparameter search, drawn at random; at least 2.
    pub search_points: usize,
}

impl Default for MeasuredInfluence {
    fn default() -> Self {
        Self {
            readings: None,
            nuisance: None,
            kernel: Kernel::Matern52,
            trend: Trend::Constant,
            search_points: 400,
        }
    }
}

/// Error of learning a surface from a recording.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeasuredError {
    /// Too few distinct positions.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// A value without a logarithm.
    #[error("{what} of row {row} is {value}, which has no logarithm; it must be greater than 0")]
    NoLogarithm {
        /// Reading or nuisance coordinate.
        what: &'static str,
        /// Row, from 1.
        row: usize,
        /// The value.
        value: f64,
    },
    /// Nuisance coordinate or force missing in some rows.
    #[error("the {what} of row {row} is unknown, though others are known")]
    NuisanceMissing {
        /// Force or nuisance coordinate.
        what: &'static str,
        /// Row, from 1.
        row: usize,
    },
    /// Too few presses to learn from.
    #[error(
        "{presses} presses do not determine influence functions and a force: press at least 3 times, at two positions or more"
    )]
    TooFewPresses {
        /// Number of presses.
        presses: usize,
    },
    /// An error of the regression.
    #[error(transparent)]
    Regression(#[from] RegressionError),
    /// Noise covariance that is not positive definite.
    #[error("the noise covariance of the channels cannot be factored: {0}")]
    Noise(#[from] NotPositiveDefinite),
    /// Channels that differ from the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled fit.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Scale of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Unchanged.
    Linear,
    /// Natural logarithm, with relative errors.
    Logarithm,
}

impl Scale {
    /// Logarithms for positive values.
    pub fn for_values(mut values: impl Iterator<Item = f64>) -> Self {
        if values.all(|value| value > 0.0) { Self::Logarithm } else { Self::Linear }
    }

    /// Scaled value; `None` without a logarithm.
    pub fn scaled(self, value: f64) -> Option<f64> {
        match self {
            Self::Linear => Some(value),
            Self::Logarithm => (value > 0.0).then(|| value.ln()),
        }
    }

    /// Inverts [`Self::scaled`].
    pub fn undo(self, scaled: f64) -> f64 {
        match self {
            Self::Linear => scaled,
            Self::Logarithm => scaled.exp(),
        }
    }
}
