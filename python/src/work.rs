//! Long work without the interpreter's lock, with Ctrl-C and progress.

use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use palpate::numerics::watch::{Progress, Watch};
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::errors::of_work;

const LOOK: Duration = Duration::from_millis(20);
const SHOW_AFTER: Duration = Duration::from_millis(500);
const SHOW_EVERY: Duration = Duration::from_millis(200);
/// As of a main thread.
const STACK_BYTES: usize = 8 << 20;

#[derive(Clone)]
struct LatestProgress {
    rounds: u64,
    stage: Option<(&'static str, f64, Option<f64>)>,
}

/// Works in a thread while this one checks for Ctrl-C and shows progress, of at most `rounds`
/// rounds.
///
/// # Errors
/// Errors of the work, `KeyboardInterrupt`, and exceptions of a progress function; the work is
/// stopped first.
pub fn run<T, E>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    rounds: Option<u64>,
    work: impl FnOnce(Watch<'_>) -> Result<T, E> + Send,
) -> PyResult<T>
where
    T: Send,
    E: Error + Send + 'static,
{
    run_with(py, progress, rounds, work)?.map_err(|error| of_work(&error))
}

/// [`run`] without progress, for short work.
pub fn run_quietly<T, E>(py: Python<'_>, work: impl FnOnce(Watch<'_>) -> Result<T, E> + Send) -> PyResult<T>
where
    T: Send,
    E: Error + Send + 'static,
{
    run_quietly_with(py, work)?.map_err(|error| of_work(&error))
}

/// [`run_quietly`] with an unconverted error.
pub fn run_quietly_with<T: Send>(py: Python<'_>, work: impl FnOnce(Watch<'_>) -> T + Send) -> PyResult<T> {
    run_with(py, Some(PyBool::new(py, false).as_any()), None, work)
}

/// [`run`] with an unconverted error.
pub fn run_with<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    rounds: Option<u64>,
    work: impl FnOnce(Watch<'_>) -> T + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let latest = Mutex::new(LatestProgress { rounds: 0, stage: None });
    let observe = |progress: Progress| {
        let mut latest = latest.lock().unwrap_or_else(PoisonError::into_inner);
        latest.stage = match progress {
            Progress::Round => {
                latest.rounds += 1;
                latest.stage
            }
            Progress::Stage { name, share } if share.is_finite() => Some((name, share, Some(1.0))),
            Progress::Stage { name, .. } => Some((name, 0.0, None)),
            Progress::Counted { name, done, of, .. } => Some((name, done as f64, Some(of as f64))),
        };
        !stop.load(Ordering::Relaxed)
    };
    thread::scope(|scope| {
        let (done, mut finished) = mpsc::channel::<()>();
        let observe = &observe;
        let working = thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, move || {
            // Dropped at the end of the work, also after a panic.
            let _done = done;
            work(Watch::new(observe))
        })?;
        let mut shown = ProgressDisplay::new(progress, rounds);
        let looked = loop {
            let ended;
            (ended, finished) = py.detach(move || (wait(&finished), finished));
            if ended {
                break Ok(());
            }
            let now = latest.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if let Err(error) = py.check_signals().and_then(|()| shown.show(py, &now)) {
                stop.store(true, Ordering::Relaxed);
                break Err(error);
            }
        };
        let result = py.detach(|| working.join());
        shown.close()?;
        looked?;
        result.map_err(|panic| std::panic::resume_unwind(panic))
    })
}

/// Waits briefly; returns true once the work has ended and closed the channel.
fn wait(finished: &mpsc::Receiver<()>) -> bool {
    finished.recv_timeout(LOOK) == Err(mpsc::RecvTimeoutError::Disconnected)
}

struct ProgressDisplay<'py> {
    wanted: Option<Bound<'py, PyAny>>,
    rounds: Option<u64>,
    begun: Instant,
    next: Duration,
    /// Display, set after a while; `Some(None)` without one.
    by: Option<Option<Bound<'py, PyAny>>>,
}

impl<'py> ProgressDisplay<'py> {
    fn new(wanted: Option<&Bound<'py, PyAny>>, rounds: Option<u64>) -> Self {
        // A function is called from the beginning.
        let next =
            if wanted.is_some_and(|wanted| wanted.is_callable()) { Duration::ZERO } else { SHOW_AFTER };
        Self { wanted: wanted.cloned(), rounds, begun: Instant::now(), next, by: None }
    }

    fn show(&mut self, py: Python<'py>, latest: &LatestProgress) -> PyResult<()> {
        if self.begun.elapsed() < self.next {
            return Ok(());
        }
        self.next = self.begun.elapsed() + SHOW_EVERY;
        let by = match &self.by {
            Some(by) => by,
            None => {
                let by = py.import("palpate._progress")?.call_method1("show", (self.wanted.as_ref(),))?;
                self.by.insert((!by.is_none()).then_some(by))
            }
        };
        let Some(by) = by else { return Ok(()) };
        let (stage, done, total) =
            latest.stage.unwrap_or(("rounds", latest.rounds as f64, self.rounds.map(|most| most as f64)));
        by.call_method1("update", (stage, done, total)).map(|_| ())
    }

    fn close(&self) -> PyResult<()> {
        match &self.by {
            Some(Some(by)) => by.call_method0("close").map(|_| ()),
            _ => Ok(()),
        }
    }
}
