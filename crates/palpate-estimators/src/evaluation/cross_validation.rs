//! Errors at positions that the estimator was not fitted to.

use super::{Evaluation, Trial, try_estimator};
use crate::fit::{Fit, FitTask, ReadingError};
use crate::recording::TooFewPositions;

/// Why a recording cannot be cross-validated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CrossValidationError<E: std::error::Error + 'static> {
    /// Too few positions for the folds.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// The estimator does not fit.
    #[error(transparent)]
    Fit(E),
    /// A reading does not suit the locator.
    #[error(transparent)]
    Reading(#[from] ReadingError),
}

/// Fits an estimator to each fold's training rows and locates the held-out ones; the answers of all folds together. Folds
/// are by position, see [`Recording::folds`](crate::recording::Recording::folds). An estimator that chooses among others
/// chooses without the held-out rows.
///
/// # Errors
/// [`CrossValidationError`] when a fold cannot be fitted, or the watch stopped it.
pub fn cross_validate<E: Fit>(
    estimator: &E,
    task: FitTask,
    folds: usize,
) -> Result<Evaluation, CrossValidationError<E::Error>> {
    let trials = Trial::by_folds(task.recording, folds)?;
    Ok(try_estimator(task.bench, estimator, &trials, task.seed, &|| 0.0, task.watch)?.evaluation)
}
