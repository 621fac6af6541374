//! Errors of one or all estimators at held-out positions.

use std::time::Instant;

use palpate::estimators::estimator::{
    self, CompareOptions, Comparison, UnknownEstimator, compare as compare_all, contenders, select,
    subtract_drift,
};
use palpate::estimators::evaluation::{self, Calibration, ErrorSummary, Split, evaluate_splits, limit_ratio};
use palpate::estimators::fit::FitTask;
use palpate::estimators::recording;
use palpate::estimators::setup;
use palpate::numerics::watch::{Cancelled, Watch};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::sync::Arc;

use crate::bench::{Recording, Setup};
use crate::errors::{of_work, refused};
use crate::estimator::{Estimator, check_memory};
use crate::evaluation::{Evaluation, EvaluationOrigin, FIGURES};
use crate::quantities::{self, length_m};
use crate::training::Training;
use crate::values::Fields;
use crate::work;

/// Splits by folds; `tare` corrects held-out readings for drift.
fn folds(
    setup: &setup::Setup,
    recording: &recording::Recording,
    count: usize,
    tare: bool,
    watch: Watch,
) -> Result<Vec<Split>, Box<dyn std::error::Error + Send + Sync>> {
    let recording = recording.clone().in_order();
    let mut splits = Split::by_folds(&recording, count)?;
    if tare {
        subtract_drift(setup, &mut splits, watch)?;
    }
    Ok(splits)
}

fn checked_folds(count: usize) -> PyResult<usize> {
    if count >= 2 { Ok(count) } else { Err(refused(format!("`folds` is {count}; it must be at least 2"))) }
}

fn in_folds(count: usize, tare: bool) -> String {
    let tared = if tare { ", tared" } else { "" };
    format!("cross-validated in {count} folds by position{tared}")
}

/// `palpate.cross_validate`.
#[pyfunction]
#[pyo3(signature = (estimator, recording, *, folds, seed, tare, memory_limit, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn cross_validate(
    py: Python<'_>,
    estimator: &Estimator,
    recording: &Recording,
    folds: usize,
    seed: u64,
    tare: bool,
    memory_limit: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Evaluation> {
    let count = checked_folds(folds)?;
    let (setup, method) = (&recording.setup, &estimator.inner);
    check_memory(memory_limit, method, setup, &recording.inner)?;
    let rounds = Some(count as u64 * method.most_rounds()).filter(|most| *most > 0);
    let tried = work::run_with(py, progress, rounds, |watch| {
        let splits = self::folds(setup, &recording.inner, count, tare, watch)?;
        let method = method.for_folds(FitTask::new(setup, &recording.inner).seed(seed).watch(watch))?;
        let tried = evaluate_splits(setup, &method, &splits, seed, &|| 0.0, watch)?;
        Ok::<_, Box<dyn std::error::Error + Send + Sync>>(tried.evaluation)
    })?;
    let evaluation = tried.map_err(|error| of_work(&*error))?;
    let about = EvaluationOrigin {
        kind: method.kind().to_owned(),
        source: recording.inner.provenance.source.clone(),
        how: in_folds(count, tare),
    };
    Ok(Evaluation::new(in_order(evaluation, &recording.inner, count)?, setup.clone(), about))
}

/// Sorts the answers of folds by the recording's rows.
fn in_order(
    mut evaluation: evaluation::Evaluation,
    recording: &recording::Recording,
    folds: usize,
) -> PyResult<evaluation::Evaluation> {
    let folds = recording.folds(folds).map_err(refused)?;
    let touched = |row: &usize| recording.rows[*row].touches();
    let rows: Vec<usize> = folds.into_iter().flat_map(|fold| fold.held_out).filter(touched).collect();
    let mut answers: Vec<_> = rows.into_iter().zip(evaluation.located).collect();
    answers.sort_by_key(|(row, _)| *row);
    evaluation.located = answers.into_iter().map(|(_, located)| located).collect();
    Ok(evaluation)
}

/// Fields of `palpate.Comparison`.
#[pyfunction]
#[pyo3(signature = (setup, own, estimators, recording, training, *, only, folds, calibrations, tolerance, seed, tare, memory_limit, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn compare<'py>(
    py: Python<'py>,
    setup: &Setup,
    own: Option<&Estimator>,
    estimators: Option<Vec<PyRef<'py, Estimator>>>,
    recording: Option<&Recording>,
    training: Option<&Training>,
    only: Vec<String>,
    folds: usize,
    calibrations: u64,
    tolerance: Bound<'py, PyAny>,
    seed: u64,
    tare: bool,
    memory_limit: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let tolerance_m = length_m(&tolerance, "tolerance")?;
    let bench = &*setup.0;
    let (trials, source, how) = match (recording, training) {
        (Some(recording), _) => {
            let count = checked_folds(folds)?;
            let splits = work::run_with(py, progress, None, |watch| {
                self::folds(bench, &recording.inner, count, tare, watch)
            })?;
            let splits = splits.map_err(|error| of_work(&*error))?;
            (splits, recording.inner.provenance.source.clone(), in_folds(count, tare))
        }
        (None, Some(_)) if tare => {
            return Err(refused("`tare` needs a recording: simulated readings do not drift"));
        }
        (None, Some(_)) if calibrations == 0 => {
            return Err(refused("`calibrations` is 0; it must be at least 1"));
        }
        (None, Some(training)) => {
            let trials = work::run_quietly(py, |watch| {
                let calibration = Calibration::from_training(bench, &training.0)?.at_forces_of_use();
                calibration.trials_watched(calibrations, seed, watch)
            });
            let how =
                format!("{calibrations} simulated calibration{}", if calibrations == 1 { "" } else { "s" });
            (trials?, "simulation".to_owned(), how)
        }
        (None, None) => {
            return Err(refused("a comparison needs data: give a recording, or `training` to simulate it"));
        }
    };
    let rows = trials.first().map_or(0, |trial| trial.training.rows.len());
    let contenders = match estimators {
        Some(estimators) => estimators.iter().map(|estimator| estimator.inner.clone()).collect(),
        None => {
            let own = own.map_or_else(estimator::Estimator::default, |own| own.inner.clone());
            contenders(bench, &own, rows)
        }
    };
    let contenders = select(contenders, &only).map_err(|UnknownEstimator { name, known }| {
        let known = known.join(", ");
        refused(format!("`only` names \"{name}\", which does not suit the bench; it can be: {known}"))
    })?;
    // A single estimator is refused; among several it is omitted.
    if let ([only], Some(trial)) = (&contenders[..], trials.first()) {
        check_memory(memory_limit, only, bench, &trial.training)?;
    }
    let limit = memory_limit.map(quantities::memory_limit).transpose()?;
    let refuse = |contender: &estimator::Estimator, cost| {
        limit.and_then(|limit| limit.check_fit(contender, cost).err()).map(|exceeded| exceeded.to_string())
    };
    let start = Instant::now();
    let (compared, ratios) = work::run(py, progress, None, |watch| {
        let clock = || start.elapsed().as_secs_f64();
        let options = CompareOptions { seed, clock: &clock, refuse: &refuse, watch };
        let compared = compare_all(bench, contenders, &trials, options)?;
        let evaluations = compared.comparisons.iter().map(|one| &one.timed.evaluation);
        let ratios: Vec<Option<f64>> = evaluations.map(|of| limit_ratio(bench, of)).collect();
        Ok::<_, Cancelled>((compared, ratios))
    })?;
    let fields = Fields::new(py);
    fields.set("source", &source)?;
    fields.set("how", &how)?;
    fields.set("trials", trials.len())?;
    fields.set("tolerance", tolerance_m)?;
    let comparisons = &compared.comparisons;
    columns(&fields, comparisons, tolerance_m)?;
    fields.column("limit_ratio", ratios)?;
    let about =
        |kind: &str| EvaluationOrigin { kind: kind.to_owned(), source: source.clone(), how: how.clone() };
    let evaluations = comparisons.iter().map(|Comparison { estimator, timed }| {
        Evaluation::new(timed.evaluation.clone(), Arc::clone(&setup.0), about(estimator.name()))
    });
    fields.set(
        "evaluations",
        PyList::new(
            py,
            evaluations.map(|evaluation| Py::new(py, evaluation)).collect::<PyResult<Vec<_>>>()?,
        )?,
    )?;
    let left_out = PyDict::new(py);
    for (kind, why) in &compared.omitted {
        left_out.set_item(kind, why)?;
    }
    fields.set("left_out", left_out)?;
    Ok(fields.into_dict())
}

fn columns(fields: &Fields<'_>, comparisons: &[Comparison], tolerance_m: f64) -> PyResult<()> {
    let summaries: Vec<Option<ErrorSummary>> =
        comparisons.iter().map(|comparison| comparison.timed.evaluation.summary(None)).collect();
    fields
        .set("names", comparisons.iter().map(|comparison| comparison.estimator.name()).collect::<Vec<_>>())?;
    for (name, of) in FIGURES {
        fields.column(name, summaries.iter().map(|errors| errors.as_ref().map(of)))?;
    }
    let evaluations = || comparisons.iter().map(|comparison| &comparison.timed.evaluation);
    let share = |percent: f64| percent / 100.0;
    fields
        .column("effective_length", evaluations().map(|of| Some(share(of.effective_percent(tolerance_m)))))?;
    fields.column("coverage", evaluations().map(|of| of.coverage_percent().map(share)))?;
    fields.column("interval_score", evaluations().map(evaluation::Evaluation::interval_score_m))?;
    let forces = || evaluations().map(evaluation::Evaluation::force_summary);
    fields.column("force_mean", forces().map(|forces| Some(forces?.average_n)))?;
    fields.column("force_coverage", forces().map(|forces| Some(share(forces?.coverage_percent))))?;
    fields.column("fit_seconds", comparisons.iter().map(|comparison| Some(comparison.timed.fit_seconds)))?;
    let locate_s = |comparison: &Comparison| Some(1e-9 * comparison.timed.locate_ns);
    fields.column("locate_seconds", comparisons.iter().map(locate_s))
}
