//! Evaluation of an estimator on splits of a recording.

use super::{EvaluatedContact, Evaluation, Split, SplitOrigin};
use crate::fit::{Fit, FitTask, HeldOut, HoldOutError, HoldOutTask, Locate, MethodLocator, ReadingError};
use crate::interval_check::{HeldOutEstimate, widen_by_other_folds};
use crate::recording::TooFewPositions;
use crate::setup::Setup;
use crate::simulate::SimulateError;
use palpate_numerics::watch::{Cancelled, Watch};

/// Evaluation over splits, with computing times.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedEvaluation {
    /// Estimates.
    pub evaluation: Evaluation,
    /// Mean time of a fit.
    pub fit_seconds: f64,
    /// Mean time of an estimate.
    pub locate_ns: f64,
}

/// Fits and evaluates an estimator on each split, with a `clock` in seconds.
///
/// # Errors
/// [`EvaluationError`].
pub fn evaluate_splits<E: Fit>(
    setup: &Setup,
    estimator: &E,
    splits: &[Split],
    seed: u64,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<TimedEvaluation, EvaluationError<E::Error>> {
    let fit = |_, task: FitTask| Ok((estimator.fit_without_interval_check(task)?, 0.0));
    evaluate_held_out(&HoldOutTask { setup, splits, seed, clock, watch, memo: None }, fit)
}

pub(crate) fn evaluate_held_out<M: Locate, E: std::error::Error>(
    task: &HoldOutTask,
    fit: impl Fn(usize, FitTask) -> Result<(MethodLocator<M>, f64), E>,
) -> Result<TimedEvaluation, EvaluationError<E>> {
    let HoldOutTask { setup, splits, .. } = *task;
    let extent = setup.surface().extent();
    let held_out = task.run(fit).map_err(|error| match error {
        HoldOutError::Fit(error) => EvaluationError::Fit(error),
        HoldOutError::Reading(error) => error.into(),
    })?;
    let HeldOut { mut estimates, fitting_s, locating_s } = held_out;
    if splits.iter().all(|split| split.origin == SplitOrigin::Fold) {
        widen_by_other_folds(&mut estimates, extent);
    }
    let located = estimates.iter().map(|HeldOutEstimate { truth, force_n, estimate, .. }| {
        EvaluatedContact::of_contact(*truth, *force_n, estimate, extent)
    });
    let evaluation = Evaluation { extent, located: located.collect() };
    let readings = evaluation.located.len().max(1) as f64;
    Ok(TimedEvaluation {
        evaluation,
        fit_seconds: fitting_s / splits.len().max(1) as f64,
        locate_ns: locating_s / readings * 1e9,
    })
}

/// Error of an evaluation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError<E: std::error::Error + 'static> {
    /// Failed simulation.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Too few positions for the folds.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Failed fit.
    #[error(transparent)]
    Fit(E),
    /// Invalid reading.
    #[error(transparent)]
    Reading(#[from] ReadingError),
}

impl<E: From<Cancelled> + std::error::Error + 'static> From<Cancelled> for EvaluationError<E> {
    fn from(cancelled: Cancelled) -> Self {
        Self::Fit(cancelled.into())
    }
}

/// Returns held-out estimates by position (see [`Recording::folds`](crate::recording::Recording::folds)),
/// with any choice of estimator in each fold.
///
/// ```
/// use palpate_estimators::{arrangement::Training, evaluation::cross_validate, fit::FitTask, influence::Influence, setup::Setup};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10).repeated(5), 0)?;
/// let held_out = cross_validate(&Influence::default(), FitTask::new(&setup, &presses), 5)?;
/// assert!(held_out.summary(None).expect("50 presses").median_m < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`EvaluationError`].
pub fn cross_validate<E: Fit>(
    estimator: &E,
    task: FitTask,
    folds: usize,
) -> Result<Evaluation, EvaluationError<E::Error>> {
    let splits = Split::by_folds(task.recording, folds)?;
    Ok(evaluate_splits(task.setup, estimator, &splits, task.seed, &|| 0.0, task.watch)?.evaluation)
}
