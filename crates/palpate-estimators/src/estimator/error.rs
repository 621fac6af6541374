//! Why fitting fails, whichever estimator it is.

use palpate_numerics::watch::Cancelled;

use crate::centroid::CentroidFitError;
use crate::closed_form::ClosedFormFitError;
use crate::digit::DigitFitError;
use crate::evaluation::EvaluationError;
use crate::fit::ChannelMismatch;
use crate::gaussian_process::GaussianProcessError;
use crate::influence::InfluenceFitError;
use crate::neighbours::NeighboursFitError;
use crate::network::{LevenbergMarquardtFitError, NetworkFitError};

/// Why an estimator cannot be fitted to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// The network's reason.
    #[error(transparent)]
    Network(#[from] NetworkFitError),
    /// The Levenberg–Marquardt networks' reason.
    #[error(transparent)]
    NetworkLm(#[from] LevenbergMarquardtFitError),
    /// The influence estimator's reason.
    #[error(transparent)]
    Influence(#[from] InfluenceFitError),
    /// The Gaussian process's reason.
    #[error(transparent)]
    GaussianProcess(#[from] GaussianProcessError),
    /// The closed form's reason.
    #[error(transparent)]
    ClosedForm(#[from] ClosedFormFitError),
    /// The digit estimator's reason.
    #[error(transparent)]
    Digit(#[from] DigitFitError),
    /// The nearest neighbours' reason.
    #[error(transparent)]
    Neighbours(#[from] NeighboursFitError),
    /// The centroid's reason.
    #[error(transparent)]
    Centroid(#[from] CentroidFitError),
    /// No estimator suits the recording; the last one's complaint.
    #[error("no estimator suits the recording: {0}")]
    Choice(Box<EvaluationError<FitError>>),
}
