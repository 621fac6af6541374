//! Errors at positions that the estimator was not fitted to.

use super::{Evaluation, ReadingError, choose};
use crate::estimator::{EstimatorConfig, FitError, Fitting};
use crate::recording::{Recording, TooFewPositions};
use crate::setup::Bench;

/// Why a recording cannot be cross-validated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CrossValidationError {
    /// Too few positions for the folds.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// The estimator does not fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A reading does not suit the locator.
    #[error(transparent)]
    Reading(#[from] ReadingError),
}

/// Fits an estimator to each fold's training rows and locates the held-out ones; the answers of all folds
/// together. Folds are by position, see [`Recording::folds`]. `None` when `keep_going`, asked often, says no.
///
/// # Errors
/// [`CrossValidationError`] when a fold cannot be fitted.
pub fn cross_validate(
    bench: &Bench,
    estimator: &EstimatorConfig,
    recording: &Recording,
    folds: usize,
    seed: u64,
    keep_going: &mut dyn FnMut() -> bool,
) -> Result<Option<Evaluation>, CrossValidationError> {
    let mut pooled = Evaluation { length_m: bench.surface.extent().length_m, located: Vec::new() };
    for fold in recording.folds(folds)? {
        let training = recording.subset(&fold.training);
        // An estimator that is to be chosen is chosen without the held-out rows.
        let estimator = match estimator {
            EstimatorConfig::Auto => match choose(bench, estimator, &training, folds, seed, keep_going)? {
                Some(choice) => choice.best,
                None => return Ok(None),
            },
            decided => decided.clone(),
        };
        let fitting = Fitting::prepare(bench, &estimator, &training)?;
        let Some(locator) = fitting.fit(seed, keep_going)? else { return Ok(None) };
        let part = Evaluation::of(&locator, &recording.subset(&fold.held_out))?;
        pooled.located.extend(part.located);
    }
    Ok(Some(pooled))
}
