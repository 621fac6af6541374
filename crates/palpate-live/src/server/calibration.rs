//! A calibration that browsers guide a person through, and the locator that it ends with.

use crate::calibration::{
    Assessment, Calibration, CalibrationError, DepthKnowledge, Journal, JournalError, Note, PlanError, Press,
    Waiting, last_deviation_percent, places, plan,
};
use crate::frame::{Channel, ColumnsError};
use crate::input::Input;
use crate::pipeline::WAITING;
use crate::source::{Source, SourceError, SourceUrl};
use crate::stamp::HostClock;
use crate::whole_file;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;
use palpate_rig::Rig;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Plan of a calibration: rig, source of the readings, files of the outcome.
#[derive(Debug)]
pub struct CalibrationPlan {
    /// The rig.
    pub rig: Rig,
    /// Source of the readings.
    pub from: SourceUrl,
    /// File of the presses.
    pub presses: PathBuf,
    /// File of the locator.
    pub out: PathBuf,
    /// Comment of the file of presses.
    pub comment: String,
    /// Force of every press, where it is not that of the rig.
    pub force_n: Option<f64>,
    /// Rows that the file of presses has already.
    pub before: Vec<Row>,
    /// Seed of the fit.
    pub seed: u64,
}

impl CalibrationPlan {
    /// Name of the locator's file.
    pub fn out_name(&self) -> String {
        self.out.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }
}

/// A step of a calibration that cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum CalibratorError {
    /// It goes on already.
    #[error("the calibration goes on already")]
    GoesOn,
    /// It does not go on.
    #[error("the calibration has not begun, or has ended")]
    NotBegun,
    /// There is nothing to fit, or to take back.
    #[error("no press was taken yet")]
    NoPress,
    /// The rig does not say where to press.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Presses cannot be kept.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The columns of the source are not those of the rig's channels.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// The source cannot be opened.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// There is no thread for it.
    #[error("no thread for the calibration: {0}")]
    Thread(#[from] std::io::Error),
}

/// Phase of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    /// It waits for somebody to begin, or to go on.
    Ready,
    /// Presses are asked for.
    Pressing,
    /// All presses were taken, or somebody ended it early.
    Pressed,
    /// The locator is fitted.
    Fitting,
    /// The locator is in use, and its error is estimated.
    Assessing,
    /// All is done.
    Done,
}

/// State of a calibration as a record of JSON.
#[derive(Clone, Debug, Serialize)]
pub struct CalibrationRecord {
    phase: Phase,
    waiting: Waiting,
    next: Option<PlaceRecord>,
    taken: usize,
    left: usize,
    places: Vec<PlaceRecord>,
    /// Deviation of the last press from the others of its place, in %.
    last_percent: Option<f64>,
    source: Option<String>,
    readings: u64,
    reading: Vec<f64>,
    bad_frames: u64,
    presses: String,
    problem: Option<String>,
    outcome: Option<OutcomeRecord>,
}

/// A place of a calibration.
#[derive(Clone, Debug, Default, Serialize)]
struct PlaceRecord {
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_n: Option<f64>,
    taken: usize,
    left: usize,
    spread_percent: Option<f64>,
}

/// Outcome of a calibration.
#[derive(Clone, Debug, Serialize)]
struct OutcomeRecord {
    locator: String,
    presses: usize,
    folds: Option<usize>,
    median_mm: Option<f64>,
    mean_mm: Option<f64>,
    gain_percent: Option<f64>,
    stop_percent: Option<f64>,
    remarks: Vec<String>,
}

/// A calibration, its state behind a lock.
pub struct Calibrator {
    plan: CalibrationPlan,
    channels: Vec<Channel>,
    state: Mutex<State>,
}

struct State {
    phase: Phase,
    /// Rows of the file of presses, before it begins and after it has ended.
    rows: Vec<Row>,
    running: Option<Running>,
    problem: Option<String>,
    outcome: Option<OutcomeRecord>,
}

/// A calibration that runs, with its thread and its source.
struct Running {
    shared: Arc<Mutex<Shared>>,
    inputs: SyncSender<Input>,
    thread: JoinHandle<()>,
    /// Its thread ends with it.
    _source: Source,
}

struct Shared {
    calibration: Calibration,
    source: Option<String>,
    last_percent: Option<f64>,
    problem: Option<String>,
}

impl Calibrator {
    /// A calibration that has not begun.
    pub fn new(mut plan: CalibrationPlan) -> Self {
        let rows = std::mem::take(&mut plan.before);
        let state = State { phase: Phase::Ready, rows, running: None, problem: None, outcome: None };
        Self { channels: Channel::all_of(&plan.rig.setup), plan, state: Mutex::new(state) }
    }

    /// The plan.
    pub fn plan(&self) -> &CalibrationPlan {
        &self.plan
    }

    /// Begins, or goes on after it was ended early. `free_source` ends the session that has the source.
    ///
    /// # Errors
    /// [`CalibratorError`] where it goes on already, the source cannot be opened, or the presses cannot be kept.
    pub fn begin(
        &self,
        folder: &Path,
        clock: HostClock,
        free_source: impl FnOnce(),
    ) -> Result<(), CalibratorError> {
        let mut state = self.lock();
        match state.phase() {
            Phase::Ready | Phase::Pressed | Phase::Done => {}
            Phase::Pressing | Phase::Fitting | Phase::Assessing => return Err(CalibratorError::GoesOn),
        }
        state.end_running();
        let CalibrationPlan { rig, from, presses, comment, force_n, .. } = &self.plan;
        let to_come = plan(rig, *force_n, &[], &state.rows)?;
        let rows = state.rows.clone();
        let journal = Journal::new(&rig.setup, presses, comment.clone(), rows, DepthKnowledge::Unknown)?;
        let calibration = Calibration::new(&rig.setup, None, from.columns(), to_come, journal)?;
        let shared = Shared { calibration, source: None, last_percent: None, problem: None };
        let shared = Arc::new(Mutex::new(shared));
        let (inputs, received) = sync_channel(WAITING);
        // Many sources have room for one.
        free_source();
        let source = Source::open(from, folder, clock, inputs.clone())?;
        let heard = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("calibration".to_owned())
            .spawn(move || listen(&received, &heard))?;
        (state.phase, state.problem) = (Phase::Pressing, None);
        state.running = Some(Running { shared, inputs, thread, _source: source });
        Ok(())
    }

    /// Takes back the last press, which is asked for again.
    ///
    /// # Errors
    /// [`CalibratorError`] where none was taken since it began.
    pub fn redo(&self) -> Result<(), CalibratorError> {
        self.with_calibration(|calibration| match calibration.redo()? {
            true => Ok(()),
            false => Err(CalibratorError::NoPress),
        })
    }

    /// Leaves out the press that is next.
    ///
    /// # Errors
    /// [`CalibratorError::NotBegun`].
    pub fn skip(&self) -> Result<(), CalibratorError> {
        self.with_calibration(|calibration| {
            calibration.skip();
            Ok(())
        })
    }

    /// Ends the presses early.
    ///
    /// # Errors
    /// [`CalibratorError::NotBegun`].
    pub fn stop(&self) -> Result<(), CalibratorError> {
        self.with_calibration(|calibration| {
            calibration.stop();
            Ok(())
        })
    }

    fn with_calibration(
        &self,
        act: impl FnOnce(&mut Calibration) -> Result<(), CalibratorError>,
    ) -> Result<(), CalibratorError> {
        let state = self.lock();
        let running = state.running.as_ref().ok_or(CalibratorError::NotBegun)?;
        act(&mut locked(&running.shared).calibration)
    }

    /// Ends the presses, which are to be fitted.
    ///
    /// # Errors
    /// [`CalibratorError::NoPress`], or [`CalibratorError::GoesOn`] where they are fitted already.
    pub fn begin_fit(&self) -> Result<(), CalibratorError> {
        let mut state = self.lock();
        if matches!(state.phase(), Phase::Fitting | Phase::Assessing) {
            return Err(CalibratorError::GoesOn);
        }
        state.end_running();
        if !state.rows.iter().any(Row::touches) {
            state.phase = Phase::Ready;
            return Err(CalibratorError::NoPress);
        }
        (state.phase, state.problem) = (Phase::Fitting, None);
        Ok(())
    }

    /// Fits the presses on disk, writes the locator, has a session `begin` with it, and assesses it.
    pub fn fit(&self, begin: impl FnOnce(Locator) -> Result<(), String>) {
        let outcome = self.try_to_fit(begin);
        let mut state = self.lock();
        match outcome {
            Ok(outcome) => {
                (state.phase, state.outcome) = (Phase::Done, Some(outcome));
            }
            Err(problem) => (state.phase, state.problem) = (Phase::Ready, Some(problem)),
        }
    }

    fn try_to_fit(&self, begin: impl FnOnce(Locator) -> Result<(), String>) -> Result<OutcomeRecord, String> {
        let CalibrationPlan { rig, presses, seed, out, .. } = &self.plan;
        let name = presses.display().to_string();
        let bytes = std::fs::read(presses).map_err(|error| format!("cannot read {name}: {error}"))?;
        let recording =
            rig.setup.read_recording(&name, bytes.as_slice()).map_err(|error| error.to_string())?;
        let task = FitTask::new(&rig.setup, &recording).seed(*seed);
        let locator = rig.estimator.fit_task(task).map_err(|error| error.to_string())?;
        let json = locator.to_json().map_err(|error| error.to_string())?;
        whole_file::write(out, json.as_bytes())
            .map_err(|error| format!("cannot write {}: {error}", out.display()))?;
        begin(locator)?;
        self.lock().phase = Phase::Assessing;
        let assessment =
            Assessment::new(rig, &recording, *seed, Watch::NONE).map_err(|error| error.to_string())?;
        let held_out = assessment.held_out;
        Ok(OutcomeRecord {
            locator: out.display().to_string(),
            presses: recording.touched().rows.len(),
            folds: held_out.map(|held_out| held_out.folds),
            median_mm: held_out.map(|held_out| held_out.median_m * 1e3),
            mean_mm: held_out.map(|held_out| held_out.mean_m * 1e3),
            gain_percent: assessment.gain.map(|gain| gain.percent),
            stop_percent: assessment.gain.map(|gain| gain.stop_percent),
            remarks: assessment.remarks,
        })
    }

    /// Ends it, where it runs; its presses are on disk.
    pub fn end(&self) {
        self.lock().end_running();
    }

    /// Its state.
    pub fn record(&self) -> CalibrationRecord {
        let state = self.lock();
        let extent = self.plan.rig.setup.surface().extent();
        let mut record = CalibrationRecord {
            phase: state.phase(),
            waiting: Waiting::Nothing,
            next: None,
            taken: 0,
            left: 0,
            places: Vec::new(),
            last_percent: None,
            source: None,
            readings: 0,
            reading: Vec::new(),
            bad_frames: 0,
            presses: self.plan.presses.display().to_string(),
            problem: state.problem.clone(),
            outcome: state.outcome.clone(),
        };
        match &state.running {
            Some(running) => self.tell_running(&locked(&running.shared), &mut record, extent),
            None => {
                let to_come = match state.phase {
                    Phase::Ready => plan(&self.plan.rig, self.plan.force_n, &[], &state.rows),
                    _ => Ok(Vec::new()),
                };
                tell_places(&state.rows, &to_come.unwrap_or_default(), extent, &mut record);
            }
        }
        record
    }

    fn tell_running(&self, shared: &Shared, record: &mut CalibrationRecord, extent: Extent) {
        let calibration = &shared.calibration;
        let guide = calibration.guide();
        record.waiting = guide.waiting();
        let next = guide.next_press();
        let to_come = &guide.plan()[next.map_or(guide.plan().len(), |(number, _)| number)..];
        tell_places(calibration.journal().rows(), to_come, extent, record);
        record.next = next.map(|(_, press)| PlaceRecord {
            force_n: press.force_n,
            ..PlaceRecord::of_position(press.position, extent)
        });
        record.last_percent = shared.last_percent;
        record.source.clone_from(&shared.source);
        record.readings = calibration.readings();
        let values = calibration.last_reading().iter().zip(&self.channels);
        record.reading = values.map(|(value, channel)| value / channel.unit.factor()).collect();
        record.bad_frames = calibration.bad_frames().values().sum();
        record.problem = record.problem.take().or_else(|| shared.problem.clone());
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        locked(&self.state)
    }
}

impl State {
    /// The phase, which a calibration that runs tells.
    fn phase(&self) -> Phase {
        match &self.running {
            Some(running) if locked(&running.shared).calibration.guide().waiting() == Waiting::Nothing => {
                Phase::Pressed
            }
            Some(_) => Phase::Pressing,
            None => self.phase,
        }
    }

    /// Ends the thread and the source, and keeps the rows.
    fn end_running(&mut self) {
        let Some(Running { shared, inputs, thread, _source: source }) = self.running.take() else { return };
        drop(source);
        // Refused only by a thread that has ended.
        let _ = inputs.send(Input::Stop);
        let _ = thread.join();
        self.rows = locked(&shared).calibration.journal().rows().to_vec();
        self.phase = Phase::Ready;
    }
}

impl PlaceRecord {
    fn of_position(position: Position, extent: Extent) -> Self {
        let y_mm = extent.width_m().map(|_| position.y_m * 1e3);
        Self { x_mm: position.x_m * 1e3, y_mm, ..Self::default() }
    }
}

fn tell_places(rows: &[Row], to_come: &[Press], extent: Extent, record: &mut CalibrationRecord) {
    record.taken = rows.iter().filter(|row| row.touches()).count();
    record.left = to_come.len();
    let places = places(rows, to_come).into_iter();
    record.places = places
        .map(|place| PlaceRecord {
            taken: place.taken,
            left: place.left,
            spread_percent: place.spread_percent,
            ..PlaceRecord::of_position(place.position, extent)
        })
        .collect();
}

/// Takes what the source brings, until it is told to stop.
fn listen(inputs: &Receiver<Input>, shared: &Mutex<Shared>) {
    /// Longest wait for what is next.
    const LOOK: Duration = Duration::from_millis(100);
    loop {
        let arrived = match inputs.recv_timeout(LOOK) {
            Ok(Input::Arrived(arrived)) => arrived,
            Ok(Input::Stop) | Err(RecvTimeoutError::Disconnected) => return,
            Ok(Input::Command(_)) | Err(RecvTimeoutError::Timeout) => continue,
        };
        let mut shared = locked(shared);
        let mut notes = Vec::new();
        if let Err(error) = shared.calibration.receive(&arrived, &mut notes) {
            shared.fail(&error);
        }
        for note in notes {
            shared.take(note);
        }
    }
}

impl Shared {
    fn take(&mut self, note: Note) {
        match note {
            Note::Opened(name) => (self.source, self.problem) = (Some(name), None),
            Note::Lost(why) => {
                (self.source, self.problem) = (None, Some(format!("the source went away: {why}")));
            }
            Note::Ended => {
                (self.source, self.problem) = (None, Some("the source has ended".to_owned()));
            }
            Note::Taken => {
                self.last_percent = last_deviation_percent(self.calibration.journal().rows());
                self.problem = None;
            }
            Note::Saturated(name) => {
                self.problem = Some(format!("channel {name} reads the end of its range: press less, redo"));
            }
            Note::Waits(_) | Note::Untouched | Note::Overload(_) => {}
        }
    }

    /// A press that is not on disk: the guide must not go on from it.
    fn fail(&mut self, error: &CalibrationError) {
        self.calibration.stop();
        self.problem = Some(error.to_string());
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
