//! Gaussian-process regression of the contact's position on what a reading says of it.
//!
//! The inverse way: position = f(features) + error, with f a Gaussian process and the error, whose variance is fitted,
//! standing for what the sensors' noise does to the position. It asks nothing of the surface but smoothness, and one
//! error for the whole surface is its limit: where the sensors see little, the truth is wider than it says.

mod fitting;
mod locator;

use crate::features::{FeatureKind, NoFeatures};
use crate::fit::ChannelMismatch;
use crate::recording::TooFewPositions;
use palpate_numerics::regression::{Kernel, RegressionError, Trend};
use palpate_numerics::watch::Cancelled;

pub use locator::GaussianProcessLocator;

/// How a Gaussian process is to be fitted to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GaussianProcessEstimator {
    /// What it sees of a reading; `None` for [`FeatureKind::for_setup`].
    pub features: Option<FeatureKind>,
    /// How smooth the position is as a function of the features.
    pub kernel: Kernel,
    /// What the position returns to for readings unlike any recorded.
    pub trend: Trend,
    /// The hyperparameters are found from at most this many rows, drawn at random; at least 2.
    pub search_points: usize,
}

impl Default for GaussianProcessEstimator {
    fn default() -> Self {
        Self { features: None, kernel: Kernel::Matern52, trend: Trend::Constant, search_points: 500 }
    }
}

/// Why a Gaussian process cannot be fitted to a recording.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GaussianProcessError {
    /// There is nothing between which to interpolate.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// No channel varies.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// What the regression has to say.
    #[error(transparent)]
    Regression(#[from] RegressionError),
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

#[cfg(test)]
mod tests;
