//! Estimators of a setup, and their fit.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use palpate::estimators::estimator::{self, Choice, TimeLimit};
use palpate::estimators::fit::{Fit, FitTask, SeedQueue};
use palpate::estimators::network::{TrainingOutcome, TrainingStatus};
use palpate::estimators::{recording, setup};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::bench::{Recording, Setup};
use crate::errors::{of_work, refused};
use crate::locator::Locator;
use crate::quantities::memory_limit;
use crate::sections;
use crate::work;

/// A configured method for one setup, its keys checked; `fit` turns it into a locator.
#[pyclass(frozen, module = "palpate")]
pub struct Estimator {
    pub setup: Arc<setup::Setup>,
    pub inner: estimator::Estimator,
    /// The estimator's section of a rig, where there is one.
    text: Option<String>,
}

/// Refuses a fit above the memory limit, if any.
///
/// # Errors
/// `PalpateError` with the need, the limit, and cheaper estimators.
pub fn check_memory(
    limit: Option<&Bound<'_, PyAny>>,
    estimator: &estimator::Estimator,
    setup: &setup::Setup,
    recording: &recording::Recording,
) -> PyResult<()> {
    let Some(limit) = limit.map(memory_limit).transpose()? else { return Ok(()) };
    let cost = estimator.fit_cost(setup, recording);
    let checked = limit.check_fit(estimator, cost);
    checked.map_err(|exceeded| refused(format!("{exceeded}: {}", limit.remedy(estimator, setup, recording))))
}

impl Estimator {
    pub fn new_of(setup: Arc<setup::Setup>, inner: estimator::Estimator) -> Self {
        Self { setup, inner, text: None }
    }
}

#[pymethods]
impl Estimator {
    /// The method that a rig's section ``[estimator]`` says, for a setup.
    #[new]
    fn new(text: String, setup: &Setup) -> PyResult<Self> {
        let inner = sections::estimator(&text, &setup.0)?;
        Ok(Self { setup: setup.0.clone(), inner, text: Some(text) })
    }

    /// Kind of the method, as in a rig: "influence".
    #[getter]
    fn kind(&self) -> &'static str {
        self.inner.kind()
    }

    /// Every setting, in words.
    #[getter]
    fn settings(&self) -> Vec<(&'static str, String)> {
        self.inner.settings(&self.setup).into_iter().map(|setting| (setting.name, setting.value)).collect()
    }

    /// Calibrate: fit the method to a recording.
    ///
    /// Parameters
    /// ----------
    /// recording : Recording
    ///     Readings with their contacts.
    /// seed : int
    ///     Seed of the method's random numbers.
    /// progress : bool or callable, optional
    ///     A progress bar where somebody sees it (the default), `False` for none, `True` for one anywhere, or a function of
    ///     (stage, done, total).
    /// auto_seconds : float
    ///     Seconds that the choice of `Auto` may take; an estimator that is not done by then is stopped and left out.
    /// memory_limit : str or float, optional
    ///     The most memory that the fit may need, as in "2 GB", or in bytes: one that is estimated to need more is refused before it begins.
    ///
    /// Returns
    /// -------
    /// Locator
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     When the recording does not suit the setup or the method, and for more memory than the limit, with the estimators that need less.
    #[pyo3(signature = (recording, *, seed=0, progress=None, auto_seconds=300.0, memory_limit=None))]
    fn fit(
        &self,
        py: Python<'_>,
        recording: &Recording,
        seed: u64,
        progress: Option<&Bound<'_, PyAny>>,
        auto_seconds: f64,
        memory_limit: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Locator> {
        if auto_seconds.is_nan() || auto_seconds <= 0.0 {
            return Err(refused(format!("`auto_seconds` is {auto_seconds}; it must be greater than 0")));
        }
        let needed = self.inner.positions_needed();
        recording.inner.check_distinct_positions(needed).map_err(refused)?;
        check_memory(memory_limit, &self.inner, &self.setup, &recording.inner)?;
        let task = FitTask::new(&self.setup, &recording.inner).seed(seed);
        let begun = Instant::now();
        let clock = || begun.elapsed().as_secs_f64();
        let limit = TimeLimit { clock: &clock, seconds: auto_seconds };
        let choice = match self.inner.candidates(task) {
            Some(_) => {
                work::run(py, progress, None, |watch| self.inner.decide(task.watch(watch), Some(limit)))?
            }
            None => None,
        };
        let chosen = choice.as_ref().map_or(&self.inner, |choice| &choice.best);
        let rounds = Some(chosen.most_rounds()).filter(|most| *most > 0);
        let fitted = work::run_with(py, progress, rounds, |watch| {
            self.inner.fit_decided(task.watch(watch), choice.as_ref())
        })?;
        let locator = fitted.map_err(|error| of_work(&error))?;
        if let Some(TrainingOutcome { status: TrainingStatus::Diverged, epochs, .. }) =
            locator.training_outcome()
        {
            return Err(refused(format!(
                "training diverged after {epochs} epochs: lower the learning rate or the momentum"
            )));
        }
        let choice = choice.map(|choice| choice_dict(py, &choice).map(Bound::unbind)).transpose()?;
        Ok(Locator::new(locator, choice))
    }

    /// Fit the method once for every seed: the locators of the method alone, without the check of their estimates.
    ///
    /// Networks are trained side by side, as in a study.
    ///
    /// Parameters
    /// ----------
    /// recording : Recording
    ///     Readings with their contacts.
    /// seeds : sequence of int
    ///     Seeds of the method's random numbers.
    /// threads : int, optional
    ///     Threads that fit, on which the locators do not depend; by default as many as the machine has.
    /// progress : bool or callable, optional
    ///     As of `fit`, by seeds that are done.
    ///
    /// Returns
    /// -------
    /// list of Locator
    ///     In the order of the seeds.
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     When the recording does not suit the setup or the method.
    #[pyo3(signature = (recording, seeds, *, threads=None, progress=None))]
    fn fit_many(
        &self,
        py: Python<'_>,
        recording: &Recording,
        seeds: Vec<u64>,
        threads: Option<NonZeroUsize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<Locator>> {
        let threads = threads.or_else(|| thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
        let task = FitTask::new(&self.setup, &recording.inner);
        let next = AtomicUsize::new(0);
        let fitted = work::run_with(py, progress, None, |watch| {
            let next = &next;
            let one = || -> Result<Vec<(usize, estimator::Locator)>, estimator::FitError> {
                let mut queue = Seeds { seeds: &seeds, next, taken: Vec::new(), done: Vec::new() };
                self.inner.fit_many(task.watch(watch), &mut queue)?;
                Ok(queue.done)
            };
            thread::scope(|scope| {
                let running: Vec<_> = (0..threads.get().min(seeds.len())).map(|_| scope.spawn(one)).collect();
                let ended = running
                    .into_iter()
                    .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
                ended.collect::<Result<Vec<_>, _>>()
            })
        })?;
        let mut fitted = fitted.map_err(|error| of_work(&error))?.concat();
        fitted.sort_by_key(|(index, _)| *index);
        Ok(fitted.into_iter().map(|(_, locator)| Locator::new(locator, None)).collect())
    }

    fn __repr__(&self) -> String {
        format!("<Estimator: {}>", self.kind())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, Setup))> {
        let own = slf.get();
        let text =
            own.text.clone().ok_or_else(|| refused("an estimator of a rig is pickled with its rig"))?;
        Ok((slf.get_type().into_any(), (text, Setup(own.setup.clone()))))
    }
}

struct Seeds<'a> {
    seeds: &'a [u64],
    /// Index of the next free seed.
    next: &'a AtomicUsize,
    /// Unfinished seeds of this thread.
    taken: Vec<usize>,
    done: Vec<(usize, estimator::Locator)>,
}

impl SeedQueue<estimator::Locator> for Seeds<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        let index = self.next.fetch_add(1, Ordering::Relaxed);
        let seed = self.seeds.get(index)?;
        self.taken.push(index);
        Some(*seed)
    }

    fn fitted(&mut self, seed: u64, result: estimator::Locator) {
        if let Some(at) = self.taken.iter().position(|index| self.seeds[*index] == seed) {
            self.done.push((self.taken.swap_remove(at), result));
        }
    }
}

/// Chosen kind, figures of the contenders, and omitted kinds.
fn choice_dict<'py>(py: Python<'py>, choice: &Choice) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("best", choice.best.name())?;
    let tried = choice.candidates.iter().map(|tried| {
        let one = PyDict::new(py);
        one.set_item("name", &tried.name)?;
        one.set_item("mean_error", tried.mean_error_m)?;
        one.set_item("interval_score", tried.interval_score_m)?;
        one.set_item("coverage", tried.coverage_percent.map(|percent| percent / 100.0))?;
        Ok(one)
    });
    dict.set_item("tried", tried.collect::<PyResult<Vec<_>>>()?)?;
    dict.set_item("left_out", choice.omitted.iter().cloned().collect::<std::collections::BTreeMap<_, _>>())?;
    Ok(dict)
}
