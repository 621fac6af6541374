//! A calibration that browsers guide a person through, and the locator that it ends with.

use super::lock::locked;
use super::machine::{Attendance, MachineRecord, MachineState};
use super::pressing::{MachineRun, listen};
use super::shared::Shared;
use crate::calibration::{
    Assessment, Calibration, DepthKnowledge, Journal, JournalError, PlanError, Press, Waiting, places, plan,
};
use crate::frame::{Channel, ColumnsError};
use crate::input::Input;
use crate::pipeline::WAITING;
use crate::source::{Source, SourceError, SourceUrl};
use crate::stage::StageUrl;
use crate::stamp::HostClock;
use crate::whole_file;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, Stage};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;

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
    /// The machine that presses, as the rig's stage says; without one a person does.
    pub machine: Option<StageUrl>,
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

    /// The machine that presses, and the rig's stage.
    fn machine(&self) -> Option<(&StageUrl, &Stage)> {
        self.machine.as_ref().zip(self.rig.stage.as_ref())
    }

    /// The presses that are not among these rows.
    fn to_come(&self, rows: &[Row]) -> Result<Vec<Press>, PlanError> {
        let depths_m = self.machine().map_or(&[][..], |(_, stage)| &stage.depths_m);
        plan(&self.rig, self.force_n, depths_m, rows)
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
    /// A machine presses, which a hand must not be led past.
    #[error("a machine presses: it takes no press back and leaves none out by hand, and is to end first")]
    MachinePresses,
    /// There is no machine that could be stopped.
    #[error("no machine runs")]
    NoMachine,
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
    /// Why a press is asked for again, or what a step that takes long waits for.
    hint: Option<String>,
    /// The machine, where one presses.
    machine: Option<MachineRecord>,
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
    /// The stop of the machine that was started last: apart from the state, which may be waited for.
    stop: Mutex<Arc<AtomicBool>>,
    attendance: Arc<Attendance>,
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
    by_machine: bool,
    /// Its thread ends with it.
    _source: Source,
}

impl Calibrator {
    /// A calibration that has not begun.
    pub fn new(mut plan: CalibrationPlan) -> Self {
        let rows = std::mem::take(&mut plan.before);
        let state = State { phase: Phase::Ready, rows, running: None, problem: None, outcome: None };
        Self {
            channels: Channel::all_of(&plan.rig.setup),
            plan,
            state: Mutex::new(state),
            stop: Mutex::default(),
            attendance: Arc::default(),
        }
    }

    /// The plan.
    pub fn plan(&self) -> &CalibrationPlan {
        &self.plan
    }

    /// Signs of people who watch.
    pub fn attendance(&self) -> &Attendance {
        &self.attendance
    }

    /// Begins, or goes on after it was ended early; with a machine it greets that, which then moves. `free_source` ends the session that has the source.
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
        let CalibrationPlan { rig, from, presses, comment, .. } = &self.plan;
        let to_come = self.plan.to_come(&state.rows)?;
        let machine = self.plan.machine().filter(|_| !to_come.is_empty());
        let stage = machine.map(|(_, stage)| stage);
        let rows = state.rows.clone();
        let journal =
            Journal::new(&rig.setup, presses, comment.clone(), rows, DepthKnowledge::for_stage(stage))?;
        let calibration = Calibration::new(&rig.setup, stage, from.columns(), to_come, journal)?;
        let machine = machine.map(|(url, stage)| MachineRun {
            url: url.clone(),
            stage: stage.clone(),
            stop: self.new_stop(),
            attendance: Arc::clone(&self.attendance),
        });
        let by_machine = machine.is_some();
        let shared = Shared {
            calibration,
            source: None,
            last_percent: None,
            problem: None,
            hint: None,
            machine: MachineState::default(),
        };
        let shared = Arc::new(Mutex::new(shared));
        let (inputs, received) = sync_channel(WAITING);
        // Many sources have room for one.
        free_source();
        let source = Source::open(from, folder, clock, inputs.clone())?;
        let heard = Arc::clone(&shared);
        let run = move || match machine {
            Some(machine) => machine.press(&received, &heard),
            None => listen(&received, &heard),
        };
        let thread = std::thread::Builder::new().name("calibration".to_owned()).spawn(run)?;
        (state.phase, state.problem) = (Phase::Pressing, None);
        state.running = Some(Running { shared, inputs, thread, by_machine, _source: source });
        Ok(())
    }

    /// Stops the machine at once, whatever it does and whatever is waited for.
    ///
    /// # Errors
    /// [`CalibratorError::NoMachine`] where none is to press.
    pub fn halt(&self) -> Result<(), CalibratorError> {
        if self.plan.machine.is_none() {
            return Err(CalibratorError::NoMachine);
        }
        locked(&self.stop).store(true, Ordering::Relaxed);
        Ok(())
    }

    fn new_stop(&self) -> Arc<AtomicBool> {
        let stop = Arc::<AtomicBool>::default();
        *locked(&self.stop) = Arc::clone(&stop);
        stop
    }

    /// Takes back the last press, which is asked for again.
    ///
    /// # Errors
    /// [`CalibratorError`] where none was taken since it began.
    pub fn redo(&self) -> Result<(), CalibratorError> {
        self.with_hand(|calibration| match calibration.redo()? {
            true => Ok(()),
            false => Err(CalibratorError::NoPress),
        })
    }

    /// Learns the untouched reading anew: the operator says that nothing touches.
    ///
    /// # Errors
    /// [`CalibratorError::NotBegun`], or [`CalibratorError::MachinePresses`].
    pub fn relearn_untouched(&self) -> Result<(), CalibratorError> {
        self.with_hand(|calibration| {
            calibration.relearn_untouched();
            Ok(())
        })
    }

    /// Leaves out the press that is next.
    ///
    /// # Errors
    /// [`CalibratorError::NotBegun`], or [`CalibratorError::MachinePresses`].
    pub fn skip(&self) -> Result<(), CalibratorError> {
        self.with_hand(|calibration| {
            calibration.skip();
            Ok(())
        })
    }

    /// Ends the presses early; a machine lifts its finger first.
    ///
    /// # Errors
    /// [`CalibratorError::NotBegun`].
    pub fn stop(&self) -> Result<(), CalibratorError> {
        self.with_calibration(|calibration| {
            calibration.stop();
            Ok(())
        })
    }

    /// Acts where a person presses: a machine is on its way to the press that was next.
    fn with_hand(
        &self,
        act: impl FnOnce(&mut Calibration) -> Result<(), CalibratorError>,
    ) -> Result<(), CalibratorError> {
        if self.lock().machine_presses() {
            return Err(CalibratorError::MachinePresses);
        }
        self.with_calibration(act)
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
        if state.machine_presses() {
            return Err(CalibratorError::MachinePresses);
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

    /// Ends it, where it runs; its presses are on disk. A machine is stopped at once.
    pub fn end(&self) {
        locked(&self.stop).store(true, Ordering::Relaxed);
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
            hint: None,
            machine: None,
            outcome: state.outcome.clone(),
        };
        match &state.running {
            Some(running) => self.tell_running(&locked(&running.shared), &mut record, extent),
            None => {
                let to_come = match state.phase {
                    Phase::Ready => self.plan.to_come(&state.rows),
                    _ => Ok(Vec::new()),
                };
                let to_come = to_come.unwrap_or_default();
                tell_places(&state.rows, &to_come, extent, &mut record);
                record.machine = self.machine_record(&state.rows, &to_come);
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
        record.hint.clone_from(&shared.hint);
        record.problem = record.problem.take().or_else(|| shared.problem.clone());
        record.machine = self
            .machine_record(calibration.journal().rows(), to_come)
            .map(|machine| machine.running(&shared.machine, calibration, extent, record.left));
    }

    fn machine_record(&self, rows: &[Row], to_come: &[Press]) -> Option<MachineRecord> {
        let (url, stage) = self.plan.machine()?;
        let pressed = rows.iter().filter(|row| row.touches()).map(|row| row.position);
        let places: Vec<Position> = pressed.chain(to_come.iter().map(|press| press.position)).collect();
        Some(MachineRecord::new(url, stage, &places))
    }

    /// The state, in which a machine that has ended is no more.
    fn lock(&self) -> MutexGuard<'_, State> {
        let mut state = locked(&self.state);
        if state.running.as_ref().is_some_and(|running| running.by_machine && running.thread.is_finished()) {
            state.end_running();
        }
        state
    }
}

impl State {
    /// The phase, which a calibration that runs tells.
    fn phase(&self) -> Phase {
        match &self.running {
            Some(running) if running.by_machine => Phase::Pressing,
            Some(running) if locked(&running.shared).calibration.guide().waiting() == Waiting::Nothing => {
                Phase::Pressed
            }
            Some(_) => Phase::Pressing,
            None => self.phase,
        }
    }

    fn machine_presses(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.by_machine)
    }

    /// Ends the thread and the source, and keeps the rows and what is wrong.
    fn end_running(&mut self) {
        let Some(Running { shared, inputs, thread, _source: source, .. }) = self.running.take() else {
            return;
        };
        drop(source);
        // Refused only by a thread that has ended.
        let _ = inputs.send(Input::Stop);
        let _ = thread.join();
        let shared = locked(&shared);
        self.rows = shared.calibration.journal().rows().to_vec();
        self.problem.clone_from(&shared.problem);
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
