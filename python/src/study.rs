//! Studies: arms by seeds, fitted by threads or, task by task, by an executor.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use palpate::numerics::simd::InstructionSet;
use palpate::numerics::watch::Watch;
use palpate::rig;
use palpate_studies::{
    self as studies, ArmFit, ArmOutcome, ArmResults, AssemblyError, Checkpoint, CheckpointError, FitRows,
    ResultsFile, RunFacts, RunOptions, ShardTables, StudyResults, StudyTables, Task, paper,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::{of_rig, of_work, refused};
use crate::values::Fields;
use crate::work;

/// `networks.csv` and `evaluations.csv`, or rows of them.
type Texts = (String, String);
/// Arm, first seed, and the seed after the last.
type Block = (String, u64, u64);

/// A study that is ready to be run: its layouts found, its recordings made. `palpate.Study` keeps it.
#[pyclass(frozen, module = "palpate._palpate")]
pub struct PreparedStudy {
    inner: studies::PreparedStudy,
    is_paper: bool,
}

/// The text of the founding paper's study.
#[pyfunction]
pub fn paper_study() -> &'static str {
    paper::STUDY_TOML
}

/// Name, arms, seeds by default, digest and precision of the study of a text in TOML.
#[pyfunction]
pub fn read_study<'py>(py: Python<'py>, source: &str, text: &str) -> PyResult<Bound<'py, PyDict>> {
    let study = rig::Study::from_toml(text).map_err(|error| of_rig(&error, source, text))?;
    let fields = Fields::new(py);
    fields.set("name", &study.name)?;
    fields.set("arms", study.arms.iter().map(|arm| arm.name.as_str()).collect::<Vec<_>>())?;
    fields.set("seeds", study.seeds)?;
    fields.set("digest", &study.digest)?;
    fields.set("precision", format!("{:?}", study.precision).to_lowercase())?;
    Ok(fields.into_dict())
}

#[pymethods]
impl PreparedStudy {
    #[new]
    fn new(py: Python<'_>, source: &str, text: &str, progress: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let study = rig::Study::from_toml(text).map_err(|error| of_rig(&error, source, text))?;
        let inner = work::run(py, progress, None, |watch| studies::PreparedStudy::new(study, watch))?;
        Ok(Self { inner, is_paper: text == paper::STUDY_TOML })
    }

    /// Number of networks that train side by side.
    #[getter]
    fn lanes(&self) -> u64 {
        self.inner.lanes()
    }

    /// Tasks that are left of so many seeds of every arm, where tables have what is finished.
    fn tasks_left(&self, py: Python<'_>, seeds: u64, block: u64, finished: Texts) -> PyResult<Vec<Block>> {
        let done = self.read(py, finished)?.done;
        let left = self.inner.tasks_left(seeds, block, &done);
        Ok(left.into_iter().map(|task| (task.arm, task.seeds.start, task.seeds.end)).collect())
    }

    /// Whole tables of what some tables have, sorted; the names of those whose last line was cut off; and the number of fits that cannot be
    /// restored, as they are in `networks.csv` alone.
    fn whole(&self, py: Python<'_>, texts: Texts) -> PyResult<(Texts, Vec<&'static str>, usize)> {
        let checkpoint = self.read(py, texts)?;
        let FitRows { networks, evaluations } = StudyTables::new(&self.inner).whole(&checkpoint.done);
        let cut_off = checkpoint.cut_off.iter().map(|table| table.file_name()).collect();
        Ok(((networks, evaluations), cut_off, checkpoint.without_evaluation))
    }

    /// Comment and header that the tables begin with.
    fn headings(&self) -> Texts {
        let FitRows { networks, evaluations } = StudyTables::new(&self.inner).headings();
        (networks, evaluations)
    }

    /// Fits the seeds of some tasks, and calls `on_fit` with the rows of each and the number of patterns that it was presented.
    #[pyo3(signature = (tasks, *, threads, on_fit, progress))]
    fn fit(
        &self,
        py: Python<'_>,
        tasks: Vec<Block>,
        threads: usize,
        on_fit: &Bound<'_, PyAny>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let tasks: Vec<Task> =
            tasks.into_iter().map(|(arm, first, end)| Task { arm, seeds: first..end }).collect();
        let of = usize::try_from(tasks.iter().map(Task::fits).sum::<u64>()).map_err(refused)?;
        let (on_fit, failed, done) =
            (on_fit.clone().unbind(), Mutex::new(None::<PyErr>), AtomicUsize::new(0));
        let (on_fit, failed, done) = (&on_fit, &failed, &done);
        let fitted = work::run_with(py, progress, None, |watch| {
            let tables = StudyTables::new(&self.inner);
            let go_on = |_| lock(failed).is_none() && watch.round().is_ok();
            let on_trained = |trained: &ArmFit| {
                let FitRows { networks, evaluations } = tables.rows(trained);
                let presented = self.inner.presentations(trained);
                let told = Python::attach(|py| on_fit.call1(py, (networks, evaluations, presented)));
                if let Err(error) = told {
                    lock(failed).get_or_insert(error);
                }
                // The fits check for a stop themselves.
                let _ = watch.counted("fits", "fits", done.fetch_add(1, Ordering::Relaxed) + 1, of);
            };
            self.inner.fit_tasks(&tasks, &[], threads, &on_trained, Watch::new(&go_on))
        })?;
        match lock(failed).take() {
            Some(error) => Err(error),
            None => fitted.map(|_| ()).map_err(|error| of_work(&error)),
        }
    }

    /// Fields of `palpate.StudyResults`, from the tables and the facts of all shards: of each its place, the two tables and its `shard.json`.
    fn merge<'py>(
        &self,
        py: Python<'py>,
        shards: Vec<(String, String, String, String)>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (mut tables, mut facts) = (Vec::new(), Vec::new());
        for (place, networks, evaluations, shard_json) in shards {
            let read = serde_json::from_str::<RunFacts>(&shard_json);
            facts.push(read.map_err(|error| refused(format!("{place}: shard.json: {error}")))?);
            tables.push(ShardTables { place, texts: FitRows { networks, evaluations } });
        }
        let merged = py.detach(|| self.inner.merge(&tables)).map_err(refused)?;
        let facts = RunFacts::of_shards(&facts).ok_or_else(|| refused(AssemblyError::Nothing))?;
        self.fields(py, merged.fits, &RunFacts { seeds: merged.seeds, ..facts })
    }

    /// Fields of `palpate.StudyResults`, from tables that have every fit of so many seeds.
    #[pyo3(signature = (seeds, tables, *, threads, presentations, seconds))]
    fn results<'py>(
        &self,
        py: Python<'py>,
        seeds: u64,
        tables: Texts,
        threads: usize,
        presentations: u64,
        seconds: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let options = RunOptions { seeds, threads };
        let arithmetic = format!("{}, {} lanes", InstructionSet::best(), self.inner.lanes());
        let facts = RunFacts::new(&self.inner, options, arithmetic, presentations, seconds);
        self.fields(py, self.read(py, tables)?.done, &facts)
    }
}

impl PreparedStudy {
    fn fields<'py>(
        &self,
        py: Python<'py>,
        fits: Vec<ArmFit>,
        facts: &RunFacts,
    ) -> PyResult<Bound<'py, PyDict>> {
        let FitRows { networks, evaluations } = StudyTables::new(&self.inner).whole(&fits);
        let outcomes = self.inner.by_arm(fits, facts.seeds);
        let results = StudyResults::new(&outcomes, &self.inner);
        let file = ResultsFile {
            run: facts,
            results: &results,
            published: self.is_paper.then(|| paper::published_figures(&results)),
            claims: self.is_paper.then(|| paper::claims(&outcomes, self.inner.evaluation_settings())),
        };
        let fields = Fields::new(py);
        fields.set("study", &facts.study)?;
        fields.set("seeds", facts.seeds)?;
        figures(&fields, &results.arms)?;
        fields.set("by_position", by_position(py, &outcomes)?)?;
        fields.set("results_json", serde_json::to_string_pretty(&file).map_err(refused)? + "\n")?;
        fields.set("networks_csv", networks)?;
        fields.set("evaluations_csv", evaluations)?;
        Ok(fields.into_dict())
    }

    fn read(&self, py: Python<'_>, (networks, evaluations): Texts) -> PyResult<Checkpoint> {
        let texts = FitRows { networks, evaluations };
        let read = py.detach(|| StudyTables::new(&self.inner).read(&texts));
        read.map_err(|error: CheckpointError| refused(format!("{}: {error}", error.table().file_name())))
    }
}

/// Medians with the 5th and 95th percentiles over the seeds, by arm.
fn figures(fields: &Fields<'_>, arms: &[ArmResults]) -> PyResult<()> {
    fields.set("names", arms.iter().map(|arm| arm.name.as_str()).collect::<Vec<_>>())?;
    fields.column("converged", arms.iter().map(|arm| arm.converged.map(|count| count as f64)))?;
    let limit = |arm: &ArmResults| arm.limit.as_ref().map(|limit| limit.limit_error_percent);
    fields.column("limit_error_percent", arms.iter().map(limit))?;
    let spread = |name, of: fn(&ArmResults) -> Option<palpate::estimators::evaluation::Quantiles>| {
        let rows = arms
            .iter()
            .map(|arm| of(arm).map_or([f64::NAN; 3], |spread| [spread.median, spread.p05, spread.p95]));
        fields.columns(name, rows)
    };
    spread("epochs", |arm| arm.epochs)?;
    spread("error_percent", |arm| Some(arm.error_percent))?;
    spread("max_error_percent", |arm| Some(arm.max_error_percent))?;
    spread("effective_length_percent", |arm| Some(arm.effective_length_percent))?;
    spread("error_over_limit", |arm| arm.limit.as_ref()?.error_over_limit)?;
    spread("coverage_percent", |arm| arm.coverage_percent)
}

/// Positions and errors in metres: median, 5th and 95th percentile over the seeds.
fn by_position<'py>(py: Python<'py>, outcomes: &[ArmOutcome]) -> PyResult<Bound<'py, PyList>> {
    let arms = outcomes.iter().map(|outcome| {
        let errors = outcome.by_position(|located| located.error_m());
        let fields = Fields::new(py);
        fields.column("x", errors.iter().map(|(x_m, _)| Some(*x_m)))?;
        fields.columns("error", errors.iter().map(|(_, error)| [error.median, error.p05, error.p95]))?;
        Ok(fields.into_dict())
    });
    PyList::new(py, arms.collect::<PyResult<Vec<_>>>()?)
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
