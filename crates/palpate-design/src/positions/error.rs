//! Why training positions cannot be designed.

use crate::calibration::CalibrationError;
use palpate_estimators::arrangement::ArrangementError;
use palpate_numerics::regression::RegressionError;
use palpate_numerics::watch::Cancelled;

/// A rig, a budget or a recording that no training positions can be designed for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PositionError {
    /// The design was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// Nothing to simulate.
    #[error("a measured surface has no model to simulate calibrations with")]
    NoModel,
    /// The force of the presses is not given.
    #[error("the force of the presses is not known; there is no force in [contact] or [training]")]
    NoForce,
    /// The estimator is not decided on.
    #[error("the estimator is `auto`; positions are designed for one estimator")]
    Auto,
    /// Fewer positions than the estimator needs.
    #[error("{count} training position(s); an estimator of kind `{kind}` needs at least {needed}")]
    TooFew {
        /// How many there are.
        count: usize,
        /// How many there must be.
        needed: usize,
        /// The estimator's kind.
        kind: &'static str,
    },
    /// The rig's own training positions cannot be laid out.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// A calibration cannot be simulated.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The influence functions cannot be learnt.
    #[error("the influence functions cannot be learnt: {0}")]
    Regression(#[from] RegressionError),
    /// The recording has other channels than the rig.
    #[error("the recording has {found} channels, the rig {needed}")]
    Channels {
        /// How many the rig has.
        needed: usize,
        /// How many the recording has.
        found: usize,
    },
    /// Too few places pressed to see how smooth the influence functions are.
    #[error("the recording has {found} distinct positions; at least {needed} tell how smooth the surface is")]
    TooFewPresses {
        /// How many the recording has.
        found: usize,
        /// How many there must be.
        needed: usize,
    },
    /// Nothing says how noisy a channel is.
    #[error(
        "nothing says how noisy channel {channel} is: no position was pressed twice, and the rig states no noise"
    )]
    NoNoise {
        /// Which channel, from 1.
        channel: usize,
    },
}

impl PositionError {
    /// What to do about it.
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Cancelled(_) => "start it again",
            Self::NoModel => {
                "give a surface with a model, such as `kind = \"beam\"`; or --data with a recording begun, for the next press"
            }
            Self::NoForce => {
                "add `force = \"3 N\"` to [contact], or to [training] where it is not known afterwards"
            }
            Self::Auto => "say which: `kind = \"influence\"` in [estimator]",
            Self::TooFew { .. } => "--count takes a larger number",
            Self::Arrangement(_) | Self::Calibration(_) | Self::Regression(_) => {
                "check [training], [sensors] and [estimator] of the rig"
            }
            Self::Channels { .. } => "check `channels` in [recording], or the rig's sensors",
            Self::TooFewPresses { .. } => "begin with evenly spaced presses, ends included",
            Self::NoNoise { .. } => "press some positions twice, or add `noise = \"5 um\"` to [sensors]",
        }
    }
}
