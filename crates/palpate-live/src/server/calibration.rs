use super::lock::locked;
use super::machine::{Attendance, MachineRecord, MachineState};
use super::machine_run::{MachineRun, listen};
use super::press_records::{CheckRecord, PressRecord, press_records};
use super::shared::Shared;
use crate::calibration::{
    Assessment, AwaitedStep, Calibration, Check, DepthKnowledge, Journal, JournalError, LONGEST_JOG_M,
    PlanError, Press, SetUpTask, Statements, Trace, check_path, check_presses, dry_run, places, plan,
};
use crate::frame::{Channel, ColumnsError};
use crate::input::Input;
use crate::pipeline::WAITING;
use crate::source::{Source, SourceError, SourceUrl};
use crate::stage::StageUrl;
use crate::stamp::HostClock;
use palpate_estimators::description;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Row, comment_with_placement};
use palpate_files as whole_file;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, Stage};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;

/// Plan of a calibration.
#[derive(Debug)]
pub struct CalibrationPlan {
    /// Rig.
    pub rig: Rig,
    /// Source of the readings.
    pub from: SourceUrl,
    /// File of the presses.
    pub presses: PathBuf,
    /// File of the locator.
    pub out: PathBuf,
    /// Comment of the file of presses.
    pub comment: String,
    /// Force, if not that of the rig.
    pub force_n: Option<f64>,
    /// Machine, if one presses.
    pub machine: Option<StageUrl>,
    /// Rows on disk.
    pub before: Vec<Row>,
    /// Statements of the operator.
    pub statements: Statements,
    /// Seed of the fit.
    pub seed: u64,
}

impl CalibrationPlan {
    /// File name of the locator.
    pub fn out_name(&self) -> String {
        self.out.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    fn machine(&self) -> Option<(&StageUrl, &Stage)> {
        self.machine.as_ref().zip(self.rig.stage.as_ref())
    }

    fn to_come(&self, statements: &Statements, rows: &[Row]) -> Result<Vec<Press>, PlanError> {
        plan(&self.rig, statements.weights(self.force_n), self.depths_m(), rows)
    }

    fn depths_m(&self) -> &[f64] {
        self.machine().map_or(&[], |(_, stage)| &stage.depths_m)
    }

    fn comment(&self, statements: &Statements) -> String {
        comment_with_placement(&self.comment, statements.placement_sd_m)
    }
}

/// Error of a calibration step.
#[derive(Debug, thiserror::Error)]
pub enum CalibratorError {
    /// Another step is in progress.
    #[error("the calibration runs already")]
    GoesOn,
    /// No calibration in progress.
    #[error("the calibration has not begun, or has ended")]
    NotBegun,
    /// A machine presses.
    #[error("a machine presses: end it first, then remove or skip presses by hand")]
    MachinePresses,
    /// No machine.
    #[error("no machine runs")]
    NoMachine,
    /// No set-up in progress.
    #[error("the machine is not connected for a jog or a touch-off")]
    NotSetUp,
    /// Invalid length of a jog.
    #[error("a jog moves one axis by at most {} mm, and not by 0", LONGEST_JOG_M * 1e3)]
    Jog,
    /// No press.
    #[error("no press is recorded yet")]
    NoPress,
    /// Missing press.
    #[error("press {press} does not exist; {presses} were recorded")]
    NoSuchPress {
        /// Number, from 1.
        press: usize,
        /// Number of presses.
        presses: usize,
    },
    /// No locator, or no fresh place.
    #[error("no locator was fitted that could be checked")]
    NothingToCheck,
    /// Statement out of range.
    #[error(transparent)]
    Statement(#[from] OutOfRange),
    /// Error of the plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Error of the recording.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// Wrong columns.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// Error of the source.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Error of a new thread.
    #[error("no thread for the calibration: {0}")]
    Thread(#[from] std::io::Error),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Phase {
    Ready,
    Pressing,
    Pressed,
    Fitting,
    Assessing,
    Done,
    Checking,
    SettingUp,
}

#[derive(Clone, Debug, Serialize)]
pub struct CalibrationRecord {
    phase: Phase,
    #[serde(rename = "waiting")]
    awaited: AwaitedStep,
    next: Option<PlaceRecord>,
    #[serde(rename = "taken")]
    recorded: usize,
    left: usize,
    places: Vec<PlaceRecord>,
    last_percent: Option<f64>,
    source: Option<String>,
    readings: u64,
    reading: Vec<f64>,
    bad_frames: u64,
    presses: String,
    placement_mm: Option<f64>,
    /// Single force in newtons, if a second is necessary.
    single_weight_n: Option<f64>,
    problem: Option<String>,
    hint: Option<String>,
    machine: Option<MachineRecord>,
    outcome: Option<OutcomeRecord>,
    check: Option<CheckRecord>,
    can_check: bool,
    can_set_up: bool,
}

#[derive(Clone, Debug, Default, Serialize)]
struct PlaceRecord {
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_n: Option<f64>,
    #[serde(rename = "taken")]
    recorded: usize,
    left: usize,
    spread_percent: Option<f64>,
}

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

/// Calibration behind a lock.
pub struct Calibrator {
    plan: CalibrationPlan,
    folder: PathBuf,
    clock: HostClock,
    channels: Vec<Channel>,
    state: Mutex<State>,
    /// Stop flag of the last machine, separate because the state may be locked for long.
    stop: Mutex<Arc<AtomicBool>>,
    attendance: Arc<Attendance>,
}

struct State {
    phase: Phase,
    /// Rows on disk while no run is active.
    rows: Vec<Row>,
    /// Traces per row, errors per press.
    traces: Vec<Option<Trace>>,
    errors_m: Vec<Option<f64>>,
    statements: Statements,
    touch_z_m: Option<f64>,
    running: Option<Running>,
    problem: Option<String>,
    hint: Option<String>,
    outcome: Option<OutcomeRecord>,
    check: Option<CheckRecord>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Preview,
    Press,
    Check,
    SetUp,
}

struct Running {
    shared: Arc<Mutex<Shared>>,
    inputs: SyncSender<Input>,
    thread: JoinHandle<()>,
    purpose: Purpose,
    by_machine: bool,
    /// Dropped to end its thread.
    _source: Source,
}

impl Calibrator {
    /// Calibration; paths of sources are relative to `folder`.
    pub fn new(mut plan: CalibrationPlan, folder: PathBuf, clock: HostClock) -> Self {
        let rows = std::mem::take(&mut plan.before);
        let state = State {
            phase: Phase::Ready,
            traces: vec![None; rows.len()],
            rows,
            errors_m: Vec::new(),
            statements: plan.statements,
            touch_z_m: None,
            running: None,
            problem: None,
            hint: None,
            outcome: None,
            check: None,
        };
        Self {
            channels: Channel::all_of(&plan.rig.setup),
            plan,
            folder,
            clock,
            state: Mutex::new(state),
            stop: Mutex::default(),
            attendance: Arc::new(Attendance::new()),
        }
    }

    pub fn plan(&self) -> &CalibrationPlan {
        &self.plan
    }

    pub fn attendance(&self) -> &Attendance {
        &self.attendance
    }

    /// Begins or continues the calibration, after connection to a machine. `free_source` ends the session at
    /// the source.
    pub fn begin(&self, stated: Statements, free_source: impl FnOnce()) -> Result<(), CalibratorError> {
        stated.check()?;
        let mut state = self.lock();
        match state.phase() {
            Phase::Ready | Phase::Pressed | Phase::Done => {}
            Phase::Pressing | Phase::Fitting | Phase::Assessing | Phase::Checking | Phase::SettingUp => {
                return Err(CalibratorError::GoesOn);
            }
        }
        state.end_running();
        let CalibrationPlan { rig, presses, .. } = &self.plan;
        state.state(stated);
        let to_come = self.plan.to_come(&state.statements, &state.rows)?;
        let machine = self.machine_run(&state, None).filter(|_| !to_come.is_empty());
        let depths = DepthKnowledge::for_stage(machine.as_ref().map(|machine| &machine.stage));
        let (rows, comment) = (state.rows.clone(), self.plan.comment(&state.statements));
        let journal =
            Journal::new(&rig.setup, presses, comment, rows, depths)?.with_traces(state.traces.clone());
        // Many sources accept only one client.
        free_source();
        let running = self.run(Purpose::Press, to_come, journal, machine)?;
        (state.phase, state.problem, state.hint) = (Phase::Pressing, None, None);
        state.running = Some(running);
        Ok(())
    }

    /// Begins the set-up, or a dry run.
    pub fn begin_set_up(&self, is_dry_run: bool, free_source: impl FnOnce()) -> Result<(), CalibratorError> {
        let mut state = self.lock();
        if self.plan.machine().is_none() {
            return Err(CalibratorError::NoMachine);
        }
        if !self.can_set_up(&state) {
            return Err(CalibratorError::GoesOn);
        }
        let CalibrationPlan { rig, presses, comment, .. } = &self.plan;
        let first = match is_dry_run {
            true => Some(SetUpTask::DryRun(dry_run(&self.plan.to_come(&state.statements, &[])?))),
            false => None,
        };
        let machine = self.machine_run(&state, Some(first.into_iter().collect()));
        let journal =
            Journal::new(&rig.setup, presses, comment.clone(), Vec::new(), DepthKnowledge::Unknown)?;
        free_source();
        let running = self.run(Purpose::SetUp, Vec::new(), journal, machine)?;
        (state.problem, state.hint) = (None, None);
        state.running = Some(running);
        Ok(())
    }

    fn can_set_up(&self, state: &State) -> bool {
        let is_free = matches!(state.phase, Phase::Ready | Phase::Pressed) && state.running.is_none();
        is_free && self.plan.machine().is_some()
    }

    pub fn ask_set_up(&self, task: SetUpTask) -> Result<(), CalibratorError> {
        if let SetUpTask::Jog(by_m) = &task {
            let is_short = by_m.iter().all(|by_m| by_m.abs() <= LONGEST_JOG_M);
            if !is_short || *by_m == [0.0; 3] {
                return Err(CalibratorError::Jog);
            }
        }
        let state = self.lock();
        let running = state.running.as_ref().filter(|running| running.purpose == Purpose::SetUp);
        let running = running.ok_or(CalibratorError::NotSetUp)?;
        locked(&running.shared).tasks.push_back(task);
        Ok(())
    }

    fn machine_run(&self, state: &State, set_up: Option<Vec<SetUpTask>>) -> Option<MachineRun> {
        let (url, _) = self.plan.machine()?;
        Some(MachineRun {
            url: url.clone(),
            stage: self.stage(state)?,
            set_up,
            stop: self.new_stop(),
            attendance: Arc::clone(&self.attendance),
            clock: self.clock,
        })
    }

    /// Stage with the height from a touch-off.
    fn stage(&self, state: &State) -> Option<Stage> {
        let (_, stage) = self.plan.machine()?;
        let touch_z_m = state.touch_z_m.unwrap_or(stage.touch_z_m);
        Some(Stage { touch_z_m, ..stage.clone() })
    }

    /// Shows readings to a person.
    pub fn preview(&self) {
        let mut state = self.lock();
        let waits = state.phase == Phase::Ready && state.running.is_none() && state.problem.is_none();
        if !waits || state.outcome.is_some() || self.plan.machine().is_some() {
            return;
        }
        let CalibrationPlan { rig, presses, comment, .. } = &self.plan;
        let journal = Journal::new(&rig.setup, presses, comment.clone(), Vec::new(), DepthKnowledge::Unknown);
        let running = journal
            .map_err(CalibratorError::from)
            .and_then(|journal| self.run(Purpose::Preview, Vec::new(), journal, None));
        match running {
            Ok(running) => state.running = Some(running),
            Err(error) => state.problem = Some(error.to_string()),
        }
    }

    /// Begins presses at fresh places, which check the locator on disk.
    pub fn begin_check(&self, free_source: impl FnOnce()) -> Result<(), CalibratorError> {
        let mut state = self.lock();
        if !self.can_check(&state) {
            return Err(CalibratorError::NothingToCheck);
        }
        let CalibrationPlan { rig, presses, force_n, .. } = &self.plan;
        let weights = state.statements.weights(*force_n);
        let to_press = check_presses(rig, &state.rows, weights, self.plan.depths_m());
        if to_press.is_empty() {
            return Err(CalibratorError::NothingToCheck);
        }
        let (path, comment) = (check_path(presses), self.plan.comment(&state.statements));
        let machine = self.machine_run(&state, None);
        let depths = DepthKnowledge::for_stage(machine.as_ref().map(|machine| &machine.stage));
        let journal = Journal::new(&rig.setup, &path, comment, Vec::new(), depths)?;
        free_source();
        let running = self.run(Purpose::Check, to_press, journal, machine)?;
        (state.phase, state.problem, state.check) = (Phase::Checking, None, None);
        state.running = Some(running);
        Ok(())
    }

    fn can_check(&self, state: &State) -> bool {
        state.phase == Phase::Done && state.running.is_none()
    }

    /// Evaluates a finished check; false without one. The source is then free.
    pub fn finish_check(&self) -> bool {
        let mut state = locked(&self.state);
        let is_over = |running: &Running| {
            running.purpose == Purpose::Check
                && match running.by_machine {
                    true => running.thread.is_finished(),
                    false => {
                        locked(&running.shared).calibration.guide().awaited_step() == AwaitedStep::Nothing
                    }
                }
        };
        let Some(running) = state.running.as_ref().filter(|running| is_over(running)) else { return false };
        let path = locked(&running.shared).calibration.journal().path().to_owned();
        state.end_running();
        match self.measure(&path, &state.statements) {
            Ok(check) => state.check = check,
            Err(problem) => state.problem = Some(problem),
        }
        true
    }

    fn measure(&self, path: &Path, statements: &Statements) -> Result<Option<CheckRecord>, String> {
        let CalibrationPlan { rig, out, .. } = &self.plan;
        let read = |path: &Path| {
            std::fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()))
        };
        let Ok(presses) = read(path) else { return Ok(None) };
        let name = path.display().to_string();
        let recording =
            rig.setup.read_recording(&name, presses.as_slice()).map_err(|error| error.to_string())?;
        let locator = String::from_utf8(read(out)?).map_err(|error| error.to_string())?;
        let locator = Locator::from_json(&locator).map_err(|error| error.to_string())?;
        let check = Check::new(&locator, &recording).map_err(|error| error.to_string())?;
        let extent = rig.setup.surface().extent();
        Ok(check.map(|check| CheckRecord::new(&name, &check, statements.placement_sd_m, extent)))
    }

    fn run(
        &self,
        purpose: Purpose,
        to_come: Vec<Press>,
        journal: Journal,
        machine: Option<MachineRun>,
    ) -> Result<Running, CalibratorError> {
        let CalibrationPlan { rig, from, .. } = &self.plan;
        let stage = machine.as_ref().map(|machine| &machine.stage);
        let calibration = Calibration::new(&rig.setup, stage, from.columns(), to_come, journal)?;
        let by_machine = machine.is_some();
        let shared = Shared {
            calibration,
            clock: self.clock,
            source: None,
            last_percent: None,
            problem: None,
            hint: None,
            machine: MachineState::default(),
            tasks: VecDeque::new(),
        };
        let shared = Arc::new(Mutex::new(shared));
        let (inputs, received) = sync_channel(WAITING);
        let source = Source::open(from, &self.folder, self.clock, inputs.clone())?;
        let heard = Arc::clone(&shared);
        let run = move || match machine {
            Some(machine) => machine.run(&received, &heard),
            None => listen(&received, &heard),
        };
        let thread = std::thread::Builder::new().name("calibration".to_owned()).spawn(run)?;
        Ok(Running { shared, inputs, thread, purpose, by_machine, _source: source })
    }

    /// Stops the machine at once.
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

    /// Requests the last press again.
    pub fn redo(&self) -> Result<(), CalibratorError> {
        self.with_hand(|calibration| match calibration.redo()? {
            true => Ok(()),
            false => Err(CalibratorError::NoPress),
        })
    }

    pub fn relearn_untouched(&self) -> Result<(), CalibratorError> {
        self.with_hand(|calibration| {
            calibration.relearn_untouched();
            Ok(())
        })
    }

    pub fn skip(&self) -> Result<(), CalibratorError> {
        self.with_hand(|calibration| {
            calibration.skip();
            Ok(())
        })
    }

    /// Ends the presses or the set-up early.
    pub fn stop(&self) -> Result<(), CalibratorError> {
        if self.ask_set_up(SetUpTask::End).is_ok() {
            return Ok(());
        }
        self.with_calibration(|calibration| {
            calibration.stop();
            Ok(())
        })
    }

    /// Deletes a press, counted from 1, and requests it again.
    pub fn strike(&self, press: usize) -> Result<(), CalibratorError> {
        let mut state = self.lock();
        if state.machine_presses() {
            return Err(CalibratorError::MachinePresses);
        }
        if matches!(state.phase(), Phase::Fitting | Phase::Assessing | Phase::Checking | Phase::SettingUp) {
            return Err(CalibratorError::GoesOn);
        }
        let index = press.wrapping_sub(1);
        let statements = state.statements;
        let no_such = |presses| CalibratorError::NoSuchPress { press, presses };
        if let Some(running) = state.running.as_ref().filter(|running| running.purpose == Purpose::Press) {
            let calibration = &mut locked(&running.shared).calibration;
            if !calibration.strike(index)? {
                return Err(no_such(calibration.journal().presses()));
            }
            let to_come = self.plan.to_come(&statements, calibration.journal().rows())?;
            calibration.replan(to_come);
        } else {
            let CalibrationPlan { rig, presses, .. } = &self.plan;
            let stage = self.plan.machine().map(|(_, stage)| stage);
            let (rows, comment) = (state.rows.clone(), self.plan.comment(&statements));
            let mut journal =
                Journal::new(&rig.setup, presses, comment, rows, DepthKnowledge::for_stage(stage))?
                    .with_traces(state.traces.clone());
            if !journal.strike(index)? {
                return Err(no_such(journal.presses()));
            }
            (state.rows, state.traces) = (journal.rows().to_vec(), journal.traces().to_vec());
            state.phase = Phase::Ready;
        }
        if index < state.errors_m.len() {
            state.errors_m.remove(index);
        }
        Ok(())
    }

    pub fn presses(&self) -> Vec<PressRecord> {
        let state = self.lock();
        let extent = self.plan.rig.setup.surface().extent();
        match state.running.as_ref().filter(|running| running.purpose == Purpose::Press) {
            Some(running) => {
                let shared = locked(&running.shared);
                let journal = shared.calibration.journal();
                press_records(journal.rows(), journal.traces(), &state.errors_m, extent)
            }
            None => press_records(&state.rows, &state.traces, &state.errors_m, extent),
        }
    }

    /// Runs `act` on a person's calibration; a machine is already under way.
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
        let running = state.running.as_ref().filter(|running| running.purpose != Purpose::Preview);
        let running = running.ok_or(CalibratorError::NotBegun)?;
        act(&mut locked(&running.shared).calibration)
    }

    /// Ends the presses.
    pub fn begin_fit(&self) -> Result<(), CalibratorError> {
        let mut state = self.lock();
        if matches!(state.phase(), Phase::Fitting | Phase::Assessing | Phase::Checking | Phase::SettingUp) {
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

    /// Fits the presses, writes the locator, passes it to `begin`, and assesses it.
    pub fn fit(&self, begin: impl FnOnce(Locator) -> Result<(), String>) {
        let outcome = self.try_to_fit(begin);
        let mut state = self.lock();
        match outcome {
            Ok((outcome, errors_m)) => {
                (state.phase, state.outcome, state.check) = (Phase::Done, Some(outcome), None);
                state.errors_m = errors_m;
            }
            Err(problem) => (state.phase, state.problem) = (Phase::Ready, Some(problem)),
        }
    }

    fn try_to_fit(
        &self,
        begin: impl FnOnce(Locator) -> Result<(), String>,
    ) -> Result<(OutcomeRecord, Vec<Option<f64>>), String> {
        let CalibrationPlan { rig, presses, seed, out, force_n, .. } = &self.plan;
        let rig = &self.lock().statements.applied_to(rig, *force_n);
        let name = presses.display().to_string();
        let bytes = std::fs::read(presses).map_err(|error| format!("cannot read {name}: {error}"))?;
        let recording =
            rig.setup.read_recording(&name, bytes.as_slice()).map_err(|error| error.to_string())?;
        let task = FitTask::new(&rig.setup, &recording).seed(*seed);
        let locator = rig.estimator.fit_task(task).map_err(|error| error.to_string())?;
        let json = locator.to_json().map_err(|error| error.to_string())?;
        whole_file::write(out, json.as_bytes())
            .map_err(|error| format!("cannot write {}: {error}", out.display()))?;
        let mut remarks = description::interval_check(locator.interval_check.as_ref());
        begin(locator)?;
        self.lock().phase = Phase::Assessing;
        let assessment =
            Assessment::new(rig, &recording, *seed, Watch::NONE).map_err(|error| error.to_string())?;
        remarks.extend(assessment.remarks);
        let held_out = assessment.held_out;
        let outcome = OutcomeRecord {
            locator: out.display().to_string(),
            presses: recording.touched().rows.len(),
            folds: held_out.map(|held_out| held_out.folds),
            median_mm: held_out.map(|held_out| held_out.median_m * 1e3),
            mean_mm: held_out.map(|held_out| held_out.mean_m * 1e3),
            gain_percent: assessment.gain.map(|gain| gain.percent),
            stop_percent: assessment.gain.map(|gain| gain.stop_percent),
            remarks,
        };
        Ok((outcome, assessment.errors_m))
    }

    /// Ends the calibration, and stops a machine; returns the fault of a source without readings.
    pub fn end(&self) -> Option<String> {
        locked(&self.stop).store(true, Ordering::Relaxed);
        let mut state = self.lock();
        let running = state.running.as_ref().map(|running| Arc::clone(&running.shared))?;
        state.end_running();
        let calibration = &locked(&running).calibration;
        calibration.fault().filter(|_| calibration.readings() == 0)
    }

    pub fn record(&self) -> CalibrationRecord {
        let state = self.lock();
        let extent = self.plan.rig.setup.surface().extent();
        let mut record = CalibrationRecord {
            phase: state.phase(),
            awaited: AwaitedStep::Nothing,
            next: None,
            recorded: 0,
            left: 0,
            places: Vec::new(),
            last_percent: None,
            source: None,
            readings: 0,
            reading: Vec::new(),
            bad_frames: 0,
            presses: self.plan.presses.display().to_string(),
            placement_mm: state.statements.placement_sd_m.map(|sd_m| sd_m * 1e3),
            single_weight_n: match self.plan.machine() {
                None => state.statements.single_weight_n(&self.plan.rig, self.plan.force_n),
                Some(_) => None,
            },
            problem: state.problem.clone(),
            hint: state.hint.clone(),
            machine: None,
            outcome: state.outcome.clone(),
            check: state.check.clone(),
            can_check: self.can_check(&state),
            can_set_up: self.can_set_up(&state),
        };
        let running = state.running.as_ref();
        match running.filter(|running| running.purpose != Purpose::Preview) {
            Some(running) => self.write_running(&state, running, &mut record),
            None => {
                let to_come = match state.phase {
                    Phase::Ready => self.plan.to_come(&state.statements, &state.rows),
                    _ => Ok(Vec::new()),
                };
                let to_come = to_come.unwrap_or_default();
                write_places(&state.rows, &to_come, extent, &mut record);
                record.machine = self.machine_record(&state, &state.rows, &to_come);
                if let Some(preview) = running {
                    self.write_readings(&locked(&preview.shared), &mut record);
                }
            }
        }
        record
    }

    fn write_running(&self, state: &State, running: &Running, record: &mut CalibrationRecord) {
        let (shared, extent) = (&*locked(&running.shared), self.plan.rig.setup.surface().extent());
        let calibration = &shared.calibration;
        let guide = calibration.guide();
        record.awaited = guide.awaited_step();
        let next = guide.next_press();
        let left = next.map_or(guide.plan().len(), |(number, _)| number);
        let (rows, to_come) = match running.purpose {
            // Shows the calibration after the set-up.
            Purpose::SetUp => {
                let to_come = self.plan.to_come(&state.statements, &state.rows).unwrap_or_default();
                (state.rows.as_slice(), Cow::Owned(to_come))
            }
            _ => (calibration.journal().rows(), Cow::Borrowed(&guide.plan()[left..])),
        };
        write_places(rows, &to_come, extent, record);
        record.next = next.map(|(_, press)| PlaceRecord {
            force_n: press.force_n,
            ..PlaceRecord::of_position(press.position, extent)
        });
        record.last_percent = shared.last_percent;
        record.presses = calibration.journal().path().display().to_string();
        self.write_readings(shared, record);
        record.machine = self
            .machine_record(state, rows, &to_come)
            .map(|machine| machine.running(&shared.machine, calibration, extent, record.left));
    }

    fn write_readings(&self, shared: &Shared, record: &mut CalibrationRecord) {
        let calibration = &shared.calibration;
        record.source.clone_from(&shared.source);
        record.readings = calibration.readings();
        let values = calibration.last_reading().iter().zip(&self.channels);
        record.reading = values.map(|(value, channel)| value / channel.unit.factor()).collect();
        record.bad_frames = calibration.bad_frames().values().sum();
        record.hint.clone_from(&shared.hint);
        record.problem = record.problem.take().or_else(|| shared.problem.clone());
    }

    fn machine_record(&self, state: &State, rows: &[Row], to_come: &[Press]) -> Option<MachineRecord> {
        let (url, _) = self.plan.machine()?;
        let stage = self.stage(state)?;
        let pressed = rows.iter().filter(|row| row.touches()).map(|row| row.position);
        let places: Vec<Position> = pressed.chain(to_come.iter().map(|press| press.position)).collect();
        Some(MachineRecord::new(url, &stage, &places, state.touch_z_m))
    }

    /// Ends a finished run of a machine, except for a check ([`Self::finish_check`]).
    fn lock(&self) -> MutexGuard<'_, State> {
        let mut state = locked(&self.state);
        let has_ended = |running: &Running| {
            running.by_machine && running.purpose != Purpose::Check && running.thread.is_finished()
        };
        if state.running.as_ref().is_some_and(has_ended) {
            state.end_running();
        }
        state
    }
}

impl State {
    fn phase(&self) -> Phase {
        let Some(running) = &self.running else { return self.phase };
        match running.purpose {
            Purpose::Preview => self.phase,
            Purpose::Check => Phase::Checking,
            Purpose::SetUp => Phase::SettingUp,
            Purpose::Press if running.by_machine => Phase::Pressing,
            Purpose::Press => match locked(&running.shared).calibration.guide().awaited_step() {
                AwaitedStep::Nothing => Phase::Pressed,
                _ => Phase::Pressing,
            },
        }
    }

    fn state(&mut self, stated: Statements) {
        let now = &mut self.statements;
        now.placement_sd_m = stated.placement_sd_m.or(now.placement_sd_m);
        now.second_force_n = stated.second_force_n.or(now.second_force_n);
        now.force_is_known |= stated.force_is_known;
    }

    fn machine_presses(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.by_machine)
    }

    /// Ends the run, but keeps rows and problem.
    fn end_running(&mut self) {
        let Some(Running { shared, inputs, thread, purpose, _source: source, .. }) = self.running.take()
        else {
            return;
        };
        drop(source);
        // Fails only after the end of the thread.
        let _ = inputs.send(Input::Stop);
        let _ = thread.join();
        let shared = locked(&shared);
        let journal = shared.calibration.journal();
        match purpose {
            Purpose::Preview => {}
            Purpose::Press => {
                (self.rows, self.traces) = (journal.rows().to_vec(), journal.traces().to_vec());
                self.errors_m.truncate(journal.presses());
                self.problem.clone_from(&shared.problem);
                self.phase = Phase::Ready;
            }
            Purpose::Check => {
                self.problem.clone_from(&shared.problem);
                self.phase = Phase::Done;
            }
            Purpose::SetUp => {
                self.problem.clone_from(&shared.problem);
                self.hint.clone_from(&shared.hint);
                self.touch_z_m = shared.machine.touch_z_m.or(self.touch_z_m);
            }
        }
    }
}

impl PlaceRecord {
    fn of_position(position: Position, extent: Extent) -> Self {
        let y_mm = extent.width_m().map(|_| position.y_m * 1e3);
        Self { x_mm: position.x_m * 1e3, y_mm, ..Self::default() }
    }
}

fn write_places(rows: &[Row], to_come: &[Press], extent: Extent, record: &mut CalibrationRecord) {
    record.recorded = rows.iter().filter(|row| row.touches()).count();
    record.left = to_come.len();
    let places = places(rows, to_come).into_iter();
    record.places = places
        .map(|place| PlaceRecord {
            recorded: place.recorded,
            left: place.left,
            spread_percent: place.spread_percent,
            ..PlaceRecord::of_position(place.position, extent)
        })
        .collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn row(x_m: f64, force_n: f64, value: f64) -> Row {
        let position = Position::along(x_m);
        Row {
            position,
            force_n: Some(force_n),
            nuisances: Vec::new(),
            time_s: None,
            reading: vec![value, 0.5],
        }
    }

    fn calibrator(folder: &Path) -> Calibrator {
        let rig = include_str!("../../../../examples/fsi-like.toml");
        let rig = Rig::from_toml(&rig.replace("count = 9\nrepeats = 3", "count = 2\nrepeats = 2")).unwrap();
        Calibrator::new(
            CalibrationPlan {
                rig,
                from: "tcp://127.0.0.1:9".parse().unwrap(),
                presses: folder.join("presses.csv"),
                out: folder.join("locator.json"),
                comment: "palpate 0.1.0, pressed for a test".to_owned(),
                force_n: None,
                machine: None,
                before: vec![
                    row(0.0, 0.0, 0.0),
                    row(0.025, 1.0, 0.7),
                    row(0.025, 1.0, 0.9),
                    row(0.0, 0.0, 0.0),
                    row(0.075, 1.0, 0.3),
                ],
                statements: Statements { placement_sd_m: Some(1e-3), ..Statements::default() },
                seed: 0,
            },
            folder.to_owned(),
            HostClock::new(),
        )
    }

    fn record(calibrator: &Calibrator) -> Value {
        serde_json::to_value(calibrator.record()).unwrap()
    }

    #[test]
    fn presses_are_listed_and_struck_out_before_it_begins() {
        let folder = tempfile::tempdir().unwrap();
        let calibrator = calibrator(folder.path());
        let state = record(&calibrator);
        assert_eq!((&state["taken"], &state["left"]), (&json!(3), &json!(1)));
        assert_eq!((&state["placement_mm"], &state["single_weight_n"]), (&json!(1.0), &Value::Null));
        let presses = serde_json::to_value(calibrator.presses()).unwrap();
        assert_eq!((&presses[1]["press"], &presses[1]["x_mm"]), (&json!(2), &json!(25.0)));
        assert!(presses[1]["deviation_percent"].as_f64().unwrap() > 10.0, "{presses}");
        assert_eq!(presses[2]["deviation_percent"], Value::Null);
        calibrator.strike(2).unwrap();
        let state = record(&calibrator);
        assert_eq!(
            (&state["phase"], &state["taken"], &state["left"]),
            (&json!("ready"), &json!(2), &json!(2))
        );
        let file = std::fs::read_to_string(folder.path().join("presses.csv")).unwrap();
        assert!(file.contains("0.7") && !file.contains("0.9") && file.contains("; placement 1 mm"), "{file}");
        for press in [0, 3, usize::MAX] {
            assert!(matches!(calibrator.strike(press), Err(CalibratorError::NoSuchPress { presses: 2, .. })));
        }
    }

    #[test]
    fn checks_need_a_fit_and_statements_need_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let calibrator = calibrator(folder.path());
        let checked = calibrator.begin_check(|| panic!("the session goes on"));
        assert!(matches!(checked, Err(CalibratorError::NothingToCheck)));
        let stated = Statements { second_force_n: Some(f64::NAN), ..Statements::default() };
        let begun = calibrator.begin(stated, || panic!("the session goes on"));
        assert!(matches!(begun, Err(CalibratorError::Statement(_))));
        assert!(!calibrator.finish_check());
        assert_eq!(record(&calibrator)["can_check"], json!(false));
    }
}
