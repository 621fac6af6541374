//! Choice of an estimator by cross-validation.

use super::trial_splits::TrialSplits;
use super::{Estimator, FitError, Locator, contenders};
use crate::candidate_errors::CandidateErrors;
use crate::evaluation::{EvaluatedContact, Evaluation, Split};
use crate::fit::{FitTask, fit_with_interval_check};
use crate::fit_memo::FitMemo;
use crate::influence::{Influence, InfluenceFitError, Structure, is_one_weight, is_unsaturated};
use crate::offset_course::OffsetCourse;
use crate::reading_check::ReadingCheck;
use crate::recording::Recording;
use crate::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{FEWEST_FOR_95, NORMAL_95, mean, mean_and_variance};
use std::borrow::Cow;

/// Choice among estimators (`kind = "auto"`).
///
/// ```
/// use palpate_estimators::estimator::{Auto, Estimator};
/// use palpate_estimators::fit::Fit;
/// use palpate_estimators::{arrangement::Training, setup::Setup};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10).repeated(3), 0)?;
/// let auto = Estimator::Auto(Auto { only: vec!["influence".to_owned(), "neighbours".to_owned()] });
/// let locator = auto.fit(&setup, &presses)?;
/// assert_eq!(locator.kind(), "influence");
/// assert_eq!(locator.provenance.choice.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Auto {
    /// Kinds of the candidates; empty for all.
    pub only: Vec<String>,
}

impl Auto {
    /// Returns the fast candidates of a surface without a model.
    pub fn quick() -> Self {
        Self { only: ["influence", "gaussian-process"].map(str::to_owned).to_vec() }
    }
}

impl Estimator {
    /// Returns the candidates of a choice.
    ///
    /// `influence` with `structure = "auto"` compares structures from 19 positions on; with fewer, and within
    /// folds, log evidence decides. Presses of one force allow only proportional readings.
    pub fn candidates(&self, FitTask { setup, recording, .. }: FitTask) -> Option<Vec<Self>> {
        let all = || {
            let mut all = contenders(setup, self, recording.rows.len());
            if setup.surface().model().is_none() && is_one_weight(setup, recording) {
                all.retain(|contender| !contender.needs_forces());
            }
            all
        };
        match self {
            Self::Auto(Auto { only }) => {
                let is_named = |kind: &str| only.is_empty() || only.iter().any(|name| name == kind);
                Some(all().into_iter().filter(|contender| is_named(contender.kind())).collect())
            }
            Self::Influence(influence)
                if influence.has_structures(setup, recording)
                    && recording.distinct_positions().len() >= FEWEST_FOR_95 =>
            {
                Some(all().into_iter().filter(|contender| contender.kind() == self.kind()).collect())
            }
            _ => None,
        }
    }
}

impl Estimator {
    fn needs_forces(&self) -> bool {
        let Self::Influence(Influence { structure, .. }) = self else { return false };
        matches!(structure, Structure::ForceSaturating | Structure::ForceMonotone | Structure::Free)
    }

    /// Chooses a candidate; `None` without candidates, or without a compared structure in time, where log
    /// evidence decides.
    ///
    /// # Errors
    /// [`FitError`] without a suitable candidate, for too few positions, past the limit, or cancelled.
    pub fn decide(&self, task: FitTask, limit: Option<TimeLimit>) -> Result<Option<Choice>, FitError> {
        let Some(candidates) = self.candidates(task) else { return Ok(None) };
        match choose(task, candidates, limit) {
            Err(FitError::NotInTime { .. }) if matches!(self, Self::Influence(_)) => Ok(None),
            choice => choice.map(Some),
        }
    }

    /// Fits the chosen estimator, or this one.
    ///
    /// # Errors
    /// [`FitError`] for an unsuitable recording or a cancellation.
    pub fn fit_decided(&self, task: FitTask, choice: Option<&Choice>) -> Result<Locator, FitError> {
        let mut locator = fit_with_interval_check(choice.map_or(self, |choice| &choice.best), task)?;
        locator.provenance.choice = choice.map_or_else(Vec::new, |choice| choice.candidates.clone());
        Ok(locator)
    }

    pub(super) fn choose_estimator(&self, task: FitTask) -> Result<Self, FitError> {
        Ok(self.decide(task, None)?.map_or_else(|| self.clone(), |choice| choice.best))
    }

    /// Returns the estimator for an evaluation in folds. A structure is chosen once, at a sixteenth of the
    /// cost; the choice of `auto` is repeated in each fold.
    ///
    /// # Errors
    /// As for [`Estimator::decide`].
    pub fn for_folds(&self, task: FitTask) -> Result<Self, FitError> {
        if let Self::Auto(_) = self { Ok(self.clone()) } else { self.choose_estimator(task) }
    }
}

/// Chosen estimator and the scores of all candidates.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Least [`CandidateErrors::score_m`], or the simplest structure that is not significantly worse.
    pub best: Estimator,
    /// Candidates, the chosen one first, by rising score.
    pub candidates: Vec<CandidateErrors>,
    /// Omitted candidates with reasons.
    pub omitted: Vec<(&'static str, String)>,
    /// Largest subtracted drift of each channel.
    pub drift: Option<Vec<f64>>,
}

struct Trial {
    estimator: Estimator,
    errors: CandidateErrors,
    evaluation: Evaluation,
}

impl Trial {
    fn structure_rank(&self) -> Option<usize> {
        let Estimator::Influence(Influence { structure, .. }) = self.estimator else { return None };
        match structure {
            Structure::Auto => None,
            Structure::ForceLinear => Some(0),
            Structure::ForceSaturating | Structure::ForceMonotone => Some(1),
            Structure::Free => Some(2),
        }
    }

    /// True where another score is less by more than two standard errors. Costs are half the sum of error and
    /// interval score, relative to the other trial's means.
    fn is_significantly_worse_than(&self, best: &Self) -> bool {
        let [error_m, score_m] = [best.errors.mean_error_m, best.errors.interval_score_m];
        let cost = |one: &EvaluatedContact| {
            0.5 * (one.error_m() / error_m + one.interval_score_m.map_or(1.0, |score| score / score_m))
        };
        let pairs = self.evaluation.located.iter().zip(&best.evaluation.located);
        let mut by_place: Vec<(Position, f64)> =
            pairs.map(|(own, best)| (best.truth, cost(own) - cost(best))).collect();
        by_place.sort_by(|a, b| a.0.cmp_by_x_then_y(&b.0));
        let places = by_place.chunk_by(|a, b| a.0 == b.0);
        let differences: Vec<f64> =
            places.map(|place| mean(place.iter().map(|(_, difference)| *difference))).collect();
        let (difference, variance) = mean_and_variance(differences.iter().copied());
        difference > NORMAL_95 * (variance / differences.len() as f64).sqrt()
    }
}

/// Index of the choice; a simpler structure extrapolates better to other forces.
fn chosen(trials: &[Trial]) -> usize {
    let Some(best) = trials.first() else { return 0 };
    let is_simpler = |trial: &Trial| {
        let ranks = trial.structure_rank().zip(best.structure_rank());
        ranks.is_some_and(|(own, of_best)| own < of_best) && !trial.is_significantly_worse_than(best)
    };
    let simpler = (1..trials.len()).filter(|i| is_simpler(&trials[*i]));
    simpler.min_by_key(|i| trials[*i].structure_rank()).unwrap_or(0)
}

fn figures(name: &str, evaluation: &Evaluation) -> Option<CandidateErrors> {
    Some(CandidateErrors {
        name: name.to_owned(),
        mean_error_m: evaluation.summary(None)?.average_m,
        interval_score_m: evaluation.interval_score_m()?,
        coverage_percent: evaluation.coverage_percent(),
    })
}

/// Time limit of a choice.
#[derive(Clone, Copy)]
pub struct TimeLimit<'a> {
    /// Clock in seconds from any origin.
    pub clock: &'a (dyn Fn() -> f64 + Sync),
    /// Limit, beyond which candidates are omitted.
    pub seconds: f64,
}

/// Reason of a saturating response that is not tried: it would be that of the structure `force-linear`.
const UNSATURATED: &str = "the evidence of the presses is largest without a saturation";

fn is_saturating(estimator: &Estimator) -> bool {
    matches!(estimator, Estimator::Influence(Influence { structure: Structure::ForceSaturating, .. }))
}

const NOT_IN_TIME: &str = "it was not done in time";

/// Subtracts the drift of training presses from held-out readings. Returns the largest change of each
/// channel.
///
/// # Errors
/// [`InfluenceFitError`] for a failed fit or a cancellation.
pub fn subtract_drift(
    setup: &Setup,
    splits: &mut [Split],
    watch: Watch,
) -> Result<Option<Vec<f64>>, InfluenceFitError> {
    subtract_drift_with(splits, watch, &FitMemo::new(setup))
}

fn subtract_drift_with(
    splits: &mut [Split],
    watch: Watch,
    memo: &FitMemo,
) -> Result<Option<Vec<f64>>, InfluenceFitError> {
    let mut spans: Option<Vec<f64>> = None;
    for Split { training, held_out, offsets, .. } in splits {
        let task = FitTask::new(memo.setup(), training).watch(watch).memo(memo);
        *offsets = Influence::default().offset_course(task, held_out)?;
        for found in offsets.iter().map(OffsetCourse::spans) {
            let spans = spans.get_or_insert_with(|| vec![0.0; found.len()]);
            spans.iter_mut().zip(found).for_each(|(most, span)| *most = most.max(span));
        }
    }
    Ok(spans)
}

/// Folds of the cross-validation.
pub const CHOICE_FOLDS: usize = 5;

/// [`ReadingCheck::MOST_ROWS`] rows suffice for structures of one method.
pub(super) fn compared_rows<'a>(candidates: &[Estimator], recording: &'a Recording) -> Cow<'a, Recording> {
    if candidates.iter().all(|candidate| matches!(candidate, Estimator::Influence(_))) {
        ReadingCheck::thinned(recording)
    } else {
        Cow::Borrowed(recording)
    }
}

/// Least geometric mean of error and interval score, or the simplest structure not significantly worse. Drift
/// is subtracted, as by a tare.
fn choose(
    task: FitTask,
    mut candidates: Vec<Estimator>,
    limit: Option<TimeLimit>,
) -> Result<Choice, FitError> {
    if candidates.is_empty() {
        return Err(FitError::NoCandidate);
    }
    let FitTask { setup, recording, seed, watch, .. } = task;
    let start_s = limit.map_or(0.0, |limit| (limit.clock)());
    let is_over = || limit.is_some_and(|limit| (limit.clock)() - start_s >= limit.seconds);
    let in_time = |progress| watch.report(progress).is_ok() && !is_over();
    let limited = Watch::new(&in_time);
    // Cancelled by the caller's watch, unless the time limit has passed.
    let stopped = |stopped: Option<&'static str>| match (watch.round(), limit) {
        (Ok(()), Some(TimeLimit { seconds, .. })) => FitError::NotInTime { seconds, stopped },
        _ => Cancelled.into(),
    };
    let recording = compared_rows(&candidates, recording).into_owned().in_order();
    let positions = recording.distinct_positions().len();
    let unsuited = |error| FitError::Choice(Box::new(error));
    let mut splits =
        Split::by_folds(&recording, CHOICE_FOLDS.min(positions)).map_err(|error| unsuited(error.into()))?;
    let own = FitMemo::new(setup);
    let memo = task.memo.unwrap_or(&own);
    let whole = FitTask::new(setup, &recording).watch(limited).memo(memo);
    let course = Influence::default().offset_course(whole, &recording);
    let drift = match course
        .and_then(|course| course.map(|_| subtract_drift_with(&mut splits, limited, memo)).transpose())
    {
        Ok(drift) => drift.flatten(),
        Err(error) if Cancelled::caused(&error) => return Err(stopped(None)),
        // The drift is unknown here; the trial of that estimator reports the error.
        Err(_) => {
            splits.iter_mut().for_each(|split| split.offsets = None);
            None
        }
    };
    let (mut tried, mut omitted, mut last) = (Vec::new(), Vec::new(), None);
    if let Some(saturating) = candidates.iter().position(is_saturating) {
        match is_unsaturated(whole) {
            Ok(true) => omitted.push((candidates.remove(saturating).name(), UNSATURATED.to_owned())),
            Err(error) if Cancelled::caused(&error) => return Err(stopped(None)),
            // Influence functions that cannot be learnt give the reason in their trial.
            Ok(false) | Err(_) => {}
        }
    }
    let count = candidates.len();
    let trials = TrialSplits::new(setup, &splits, seed, &|| 0.0).memo(memo);
    for (done, estimator) in candidates.into_iter().enumerate() {
        let name = estimator.name();
        watch.counted("trying estimators", "estimators", done, count)?;
        match trials.evaluate(&estimator, limited) {
            Ok(one) => {
                if let Some(figures) = figures(name, &one.evaluation) {
                    tried.push(Trial { estimator, errors: figures, evaluation: one.evaluation });
                }
            }
            Err(error) if Cancelled::caused(&error) => {
                let why = stopped(Some(name));
                if tried.is_empty() || matches!(why, FitError::Cancelled(_)) {
                    return Err(why);
                }
                omitted.push((name, NOT_IN_TIME.to_owned()));
            }
            Err(error) => {
                omitted.push((name, error.to_string()));
                last = Some(error);
            }
        }
    }
    tried.sort_by(|a, b| a.errors.score_m().total_cmp(&b.errors.score_m()));
    if tried.is_empty() {
        return Err(last.map_or_else(|| Cancelled.into(), unsuited));
    }
    let first = tried.remove(chosen(&tried));
    let best = first.estimator.clone();
    tried.insert(0, first);
    Ok(Choice { best, candidates: tried.into_iter().map(|trial| trial.errors).collect(), omitted, drift })
}

#[cfg(test)]
mod tests;
