//! How a measured surface is to be learnt, and why it cannot be.

use crate::fit::ChannelMismatch;
use crate::recording::TooFewPositions;
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::regression::{Kernel, RegressionError, Trend};
use palpate_numerics::watch::Cancelled;

/// Settings by which readings are learnt as a function of position and nuisance coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasuredInfluence {
    /// On which scale readings are learnt; `None` for logarithms where every reading is greater than 0.
    pub readings: Option<Scale>,
    /// On which scale the nuisance coordinate is held; `None` for logarithms where every value is greater than 0.
    pub nuisance: Option<Scale>,
    /// Kernel: the smoothness of the readings.
    pub kernel: Kernel,
    /// Trend: the value that readings return to far from every press.
    pub trend: Trend,
    /// The hyperparameters are found from at most this many distinct presses, drawn at random; at least 2.
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
    /// There is nothing between which to interpolate.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Logarithms were asked for, but a value has none.
    #[error("{what} of row {row} is {value}, which has no logarithm; it must be greater than 0")]
    NoLogarithm {
        /// Reading or nuisance coordinate.
        what: &'static str,
        /// Which row, from 1.
        row: usize,
        /// The value.
        value: f64,
    },
    /// The nuisance coordinate, or the force, is known in some rows but not in all.
    #[error("the {what} of row {row} is unknown, though others are known")]
    NuisanceMissing {
        /// Force or nuisance coordinate.
        what: &'static str,
        /// Which row, from 1.
        row: usize,
    },
    /// Presses that leave no influence function and noise to be estimated beside the offset.
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
    /// The noise of the channels has no whitening.
    #[error("the noise covariance of the channels cannot be factored: {0}")]
    Noise(#[from] NotPositiveDefinite),
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// On which scale a quantity is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// As it is.
    Linear,
    /// By its natural logarithm: effects multiply, and errors are relative.
    Logarithm,
}

impl Scale {
    /// Logarithms for values that all have one.
    pub fn for_values(mut values: impl Iterator<Item = f64>) -> Self {
        if values.all(|value| value > 0.0) { Self::Logarithm } else { Self::Linear }
    }

    /// `value` on this scale; `None` for the logarithm of what is not greater than 0.
    pub fn scaled(self, value: f64) -> Option<f64> {
        match self {
            Self::Linear => Some(value),
            Self::Logarithm => (value > 0.0).then(|| value.ln()),
        }
    }

    /// The value that [`Self::scaled`] gave `scaled`.
    pub fn undo(self, scaled: f64) -> f64 {
        match self {
            Self::Linear => scaled,
            Self::Logarithm => scaled.exp(),
        }
    }
}
