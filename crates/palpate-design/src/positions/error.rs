//! Why training positions cannot be designed.

use palpate_estimators::arrangement::ArrangementError;
use palpate_estimators::estimator::FitError;
use palpate_estimators::evaluation::EvaluationError;
use palpate_numerics::regression::RegressionError;
use palpate_numerics::watch::Cancelled;

use palpate_numerics::OutOfRange;

/// A setup, a design or a recording that no training positions can be found for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PositionError {
    /// The design was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// Nothing to simulate.
    #[error("a measured surface has no model to simulate calibrations with")]
    NoModel,
    /// The force of the presses is not given.
    #[error("the force of the presses is not known")]
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
    /// The existing training positions cannot be laid out.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// A calibration cannot be simulated.
    #[error(transparent)]
    Calibration(#[from] EvaluationError<FitError>),
    /// A number that is not in its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The influence functions cannot be learnt.
    #[error("the influence functions cannot be learnt: {0}")]
    Regression(#[from] RegressionError),
    /// The recording has other channels than the setup has sensors.
    #[error("the recording has {found} channels; the setup has {needed} sensors")]
    Channels {
        /// Sensors of the setup.
        needed: usize,
        /// Channels of the recording.
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
        "nothing says how noisy channel {channel} is: no position was pressed twice, and the setup states no noise"
    )]
    NoNoise {
        /// Which channel, from 1.
        channel: usize,
    },
}
