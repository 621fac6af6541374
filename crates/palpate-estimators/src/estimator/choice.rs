//! The estimators that suit a setup, compared; and the choice of the best.

use super::{Estimator, FitError};
use crate::evaluation::{Trial, Tried, try_estimator};
use crate::fit::FitTask;
use crate::setup::Setup;
use palpate_numerics::watch::Cancelled;

/// How one estimator did over some trials.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The estimator.
    pub estimator: Estimator,
    /// Its answers to all trials together, and their times.
    pub tried: Tried,
}

/// The estimators that `auto` chooses from, and that a comparison shows: every contender, with the settings of `own`
/// where that is of its kind. Networks trained by back-propagation stop after as many presentations as
/// take some seconds.
pub fn contenders(setup: &Setup, own: &Estimator, rows: usize) -> Vec<Estimator> {
    const MOST_PRESENTATIONS: usize = 20_000_000;
    let mut contenders = Estimator::contenders(setup);
    for contender in &mut contenders {
        if contender.kind() == own.kind() {
            *contender = own.clone();
        }
        if let Estimator::Network(config) = contender {
            let most = u32::try_from(MOST_PRESENTATIONS / rows.max(1)).unwrap_or(u32::MAX).max(1);
            config.training.max_epochs = config.training.max_epochs.min(most);
        }
    }
    contenders
}

/// What `auto` chose, and the mean error in metres of each estimator in cross-validation, best first.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The estimator with the least mean error.
    pub best: Estimator,
    /// Kinds with their mean errors in metres, best first; those that do not suit the recording are left out.
    pub mean_errors_m: Vec<(&'static str, f64)>,
}

/// Folds of the cross-validation that chooses.
pub const CHOICE_FOLDS: usize = 5;

/// Chooses the estimator for a recording of a setup by cross-validation in [`CHOICE_FOLDS`] folds.
///
/// # Errors
/// [`FitError::Choice`] when the recording has too few positions, or no estimator suits it: then the last one's reason; and
/// [`FitError::Cancelled`] when the watch stopped it.
pub fn choose(task: FitTask) -> Result<Choice, FitError> {
    let FitTask { setup, recording, seed, watch } = task;
    let positions = recording.distinct_positions().len();
    let unsuited = |error| FitError::Choice(Box::new(error));
    let trials =
        Trial::by_folds(recording, CHOICE_FOLDS.min(positions)).map_err(|error| unsuited(error.into()))?;
    let mut tried = Vec::new();
    let mut last = None;
    for estimator in contenders(setup, &Estimator::Auto, recording.rows.len()) {
        match try_estimator(setup, &estimator, &trials, seed, &|| 0.0, watch) {
            Ok(one) => {
                if let Some(summary) = one.evaluation.summary(None) {
                    tried.push((estimator, summary.average_m));
                }
            }
            Err(error) if Cancelled::caused(&error) => return Err(Cancelled.into()),
            Err(error) => last = Some(error),
        }
    }
    tried.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mean_errors_m = tried.iter().map(|(estimator, error_m)| (estimator.kind(), *error_m)).collect();
    match (tried.into_iter().next(), last) {
        (Some((best, _)), _) => Ok(Choice { best, mean_errors_m }),
        (None, Some(error)) => Err(unsuited(error)),
        (None, None) => Err(Cancelled.into()),
    }
}
