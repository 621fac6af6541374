//! Trials: what is fitted, and what it is then judged by; cross-validation.

use palpate_mechanics::contact::Position;

use super::Evaluation;
use crate::arrangement::{Training, all_over};
use crate::fit::{Fit, FitTask, ReadingError};
use crate::recording::{Recording, TooFewPositions};
use crate::setup::Setup;
use crate::simulate::{SimulateError, simulate_at};
use palpate_numerics::watch::Watch;

/// A recording to fit, and one to judge by, whose contacts the fit has not seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What is fitted.
    pub training: Recording,
    /// What is judged by.
    pub judged: Recording,
}

/// An estimator's answers to some trials together, and the time they took.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The answers.
    pub evaluation: Evaluation,
    /// Mean time of a fit, by the caller's clock.
    pub fit_seconds: f64,
    /// Mean time of an estimate in nanoseconds, by the caller's clock.
    pub locate_ns: f64,
}

impl Trial {
    /// A trial a fold of a recording, by position.
    ///
    /// # Errors
    /// [`TooFewPositions`] as for [`Recording::folds`].
    pub fn by_folds(recording: &Recording, folds: usize) -> Result<Vec<Self>, TooFewPositions> {
        let folds = recording.folds(folds)?;
        let trial = |fold: &crate::recording::Fold| Self {
            training: recording.subset(&fold.training),
            judged: recording.subset(&fold.held_out),
        };
        Ok(folds.iter().map(trial).collect())
    }

    /// Simulated calibrations of a bench at training positions, `count` of them, each judged by one press at each
    /// position of [`all_over`].
    ///
    /// # Errors
    /// [`SimulateError`] when the bench has no model or no force, or the positions cannot be laid out.
    pub fn by_simulation(
        setup: &Setup,
        training: &Training,
        count: u64,
        seed: u64,
    ) -> Result<Vec<Self>, SimulateError> {
        let extent = setup.surface.extent();
        let positions = all_over(extent);
        let setup = setup.pressed_by(training);
        let at = training.positions(extent)?;
        let trial = |k: u64| {
            // A calibration and its judgement share the bench's gains and offsets, which a seed's first draws decide.
            let pressed: Vec<Position> =
                at.iter().copied().flat_map(|p| std::iter::repeat_n(p, training.repeats)).collect();
            let both = simulate_at(&setup, &[pressed.clone(), positions.clone()].concat(), 1, seed + k)?;
            let split = |range: std::ops::Range<usize>| both.subset(&range.collect::<Vec<_>>());
            Ok(Self { training: split(0..pressed.len()), judged: split(pressed.len()..both.rows.len()) })
        };
        (0..count).map(trial).collect()
    }
}

/// Fits an estimator to each trial and locates what the trial judges by. `clock` tells seconds since any fixed moment.
///
/// # Errors
/// [`CrossValidationError`] when the estimator does not suit the setup or a recording, or the watch stopped it.
pub fn try_estimator<E: Fit>(
    setup: &Setup,
    estimator: &E,
    trials: &[Trial],
    seed: u64,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Tried, CrossValidationError<E::Error>> {
    let mut evaluation = Evaluation { length_m: setup.surface.extent().length_m, located: Vec::new() };
    let (mut fitting_s, mut locating_s) = (0.0, 0.0);
    for trial in trials {
        let start = clock();
        let task = FitTask { setup, recording: &trial.training, seed, watch };
        let locator = estimator.fit_task(task).map_err(CrossValidationError::Fit)?;
        let fitted = clock();
        let part = Evaluation::of(&locator, &trial.judged)?;
        (fitting_s, locating_s) = (fitting_s + (fitted - start), locating_s + (clock() - fitted));
        evaluation.located.extend(part.located);
    }
    let readings = evaluation.located.len().max(1) as f64;
    Ok(Tried {
        evaluation,
        fit_seconds: fitting_s / trials.len().max(1) as f64,
        locate_ns: locating_s / readings * 1e9,
    })
}

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
    Ok(try_estimator(task.setup, estimator, &trials, task.seed, &|| 0.0, task.watch)?.evaluation)
}
