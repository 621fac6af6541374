//! Every estimator on the same trials, and the choice of the best.

use super::{CrossValidationError, Evaluation};
use crate::arrangement::{Training, all_over};
use crate::estimator::{EstimatorConfig, FitError, Fitting};
use crate::recording::{Recording, TooFewPositions};
use crate::setup::Bench;
use crate::simulate::{SimulateError, simulate_at};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;

/// A recording to fit, and one to judge by, whose contacts the fit has not seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What is fitted.
    pub training: Recording,
    /// What is judged by.
    pub judged: Recording,
}

/// How one estimator did over some trials.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The estimator.
    pub estimator: EstimatorConfig,
    /// Its answers to all trials together.
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
        bench: &Bench,
        training: &Training,
        count: u64,
        seed: u64,
    ) -> Result<Vec<Self>, SimulateError> {
        let extent = bench.surface.extent();
        let positions = all_over(extent);
        let bench = bench.pressed_by(training);
        let at = training.positions(extent)?;
        let trial = |k: u64| {
            // A calibration and its judgement share the bench's gains and offsets, which a seed's first draws decide.
            let pressed: Vec<Position> =
                at.iter().copied().flat_map(|p| std::iter::repeat_n(p, training.repeats)).collect();
            let both = simulate_at(&bench, &[pressed.clone(), positions.clone()].concat(), 1, seed + k)?;
            let split = |range: std::ops::Range<usize>| both.subset(&range.collect::<Vec<_>>());
            Ok(Self { training: split(0..pressed.len()), judged: split(pressed.len()..both.rows.len()) })
        };
        (0..count).map(trial).collect()
    }
}

/// Fits an estimator to each trial and locates what the trial judges by; `None` when `keep_going` says no. `clock` tells
/// seconds since any fixed moment.
///
/// # Errors
/// [`FitError`] when the estimator does not suit the bench or a recording.
pub fn try_estimator(
    bench: &Bench,
    estimator: &EstimatorConfig,
    trials: &[Trial],
    seed: u64,
    clock: &dyn Fn() -> f64,
    keep_going: &mut dyn FnMut() -> bool,
) -> Result<Option<Comparison>, CrossValidationError> {
    let length_m = bench.surface.extent().length_m;
    let mut evaluation = Evaluation { length_m, located: Vec::new() };
    let (mut fitting_s, mut locating_s) = (0.0, 0.0);
    for trial in trials {
        let start = clock();
        let fitting = Fitting::prepare(bench, estimator, &trial.training)?;
        let Some(locator) = fitting.fit(seed, keep_going)? else { return Ok(None) };
        let fitted = clock();
        let part = Evaluation::of(&locator, &trial.judged)?;
        (fitting_s, locating_s) = (fitting_s + (fitted - start), locating_s + (clock() - fitted));
        evaluation.located.extend(part.located);
    }
    let readings = evaluation.located.len().max(1) as f64;
    Ok(Some(Comparison {
        estimator: estimator.clone(),
        evaluation,
        fit_seconds: fitting_s / trials.len().max(1) as f64,
        locate_ns: locating_s / readings * 1e9,
    }))
}

/// The estimators that `auto` chooses from, and that a comparison shows: every contender, with the settings of `own`
/// where that is of its kind. Networks trained by back-propagation stop after as many presentations as
/// take some seconds.
pub fn contenders(bench: &Bench, own: &EstimatorConfig, rows: usize) -> Vec<EstimatorConfig> {
    const MOST_PRESENTATIONS: usize = 20_000_000;
    let mut contenders = EstimatorConfig::contenders(bench);
    for contender in &mut contenders {
        if contender.kind() == own.kind() {
            *contender = own.clone();
        }
        if let EstimatorConfig::Network(config) = contender {
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
    pub best: EstimatorConfig,
    /// Kinds with their mean errors in metres, best first; those that do not suit the recording are left out.
    pub mean_errors_m: Vec<(&'static str, f64)>,
}

/// Chooses the estimator for a bench by cross-validation on a recording, with the settings of `own` where that is of a
/// contender's kind; `None` when `keep_going` says no.
///
/// # Errors
/// [`CrossValidationError`] when the recording has too few positions, or no estimator suits it: then the last one's
/// complaint.
pub fn choose(
    bench: &Bench,
    own: &EstimatorConfig,
    recording: &Recording,
    folds: usize,
    seed: u64,
    keep_going: &mut dyn FnMut() -> bool,
) -> Result<Option<Choice>, CrossValidationError> {
    let positions = recording.distinct_positions().len();
    let trials = Trial::by_folds(recording, folds.min(positions))?;
    let mut tried = Vec::new();
    let mut complaint = CrossValidationError::Fit(FitError::Undecided);
    for estimator in contenders(bench, own, recording.rows.len()) {
        match try_estimator(bench, &estimator, &trials, seed, &|| 0.0, keep_going) {
            Ok(None) => return Ok(None),
            Ok(Some(comparison)) => {
                if let Some(summary) = comparison.evaluation.summary(None) {
                    tried.push((estimator, summary.average_m));
                }
            }
            Err(error) => complaint = error,
        }
    }
    tried.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mean_errors_m = tried.iter().map(|(estimator, error_m)| (estimator.kind(), *error_m)).collect();
    match tried.into_iter().next() {
        Some((best, _)) => Ok(Some(Choice { best, mean_errors_m })),
        None => Err(complaint),
    }
}

/// Share of the length at either end, and of the width, where left and right cannot be told apart at usual noise.
const ENDS: f64 = 1.0 / 80.0;
/// Where the limit is larger than this share of the length, an estimator cannot reach it: it is a bound for small errors.
const LARGE_LIMIT: f64 = 1.0 / 200.0;
/// The same on a plane, whose two directions share the readings.
const LARGE_LIMIT_ON_A_PLANE: f64 = 1.0 / 20.0;

/// Mean error over the limit's mean error, for the bench's noise; `None` where there is no limit. Counted are contacts
/// at least 1/80 of the length from both ends, on a plane also of the width from both sides, where the limit is at most
/// 1/200 of the length, on a plane 1/20.
pub fn limit_ratio(bench: &Bench, evaluation: &Evaluation) -> Option<f64> {
    let limit = bench.cramer_rao_bound().ok()?;
    let force = if bench.force_n.is_some() { Force::Known } else { Force::Unknown };
    let extent = bench.surface.extent();
    let within =
        |at_m: f64, size_m: f64| (ENDS * size_m - 1e-9..=(1.0 - ENDS) * size_m + 1e-9).contains(&at_m);
    let is_inner = |at: Position| {
        within(at.x_m, extent.length_m) && extent.width_m.is_none_or(|width_m| within(at.y_m, width_m))
    };
    let large = if extent.is_plane() { LARGE_LIMIT_ON_A_PLANE } else { LARGE_LIMIT };
    let (mut error_m, mut bound_m) = (0.0, 0.0);
    for located in &evaluation.located {
        let Some(force_n) = located.force_n.or(bench.force_n) else { continue };
        let bound = limit.at(Contact { position: located.truth, force_n }, force);
        let Some(bound) = bound.filter(|bound| bound.sd_position_m <= large * extent.length_m) else {
            continue;
        };
        if is_inner(located.truth) {
            error_m += located.error_m();
            bound_m += bound.mean_error_m();
        }
    }
    (bound_m > 0.0).then(|| error_m / bound_m)
}
