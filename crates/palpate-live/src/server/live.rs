use super::alarm_file::AlarmFile;
use super::bring_up::{BringUp, BringUpError, BringUpRecord};
use super::calibration::{CalibrationPlan, CalibrationRecord, Calibrator, CalibratorError};
use super::lock::locked;
use super::rig_maker::{NewRig, NewRigRecord, RigForm, RigFormError};
use super::session_info::SessionInfo;
use super::web_sink::{Hub, WebSink};
use crate::calibration::Statements;
use crate::frame::{Channel, ColumnsError};
use crate::input::{Command, Input};
use crate::pipeline::{self, PaceError};
use crate::recording::{self, Excerpt, RecordingError, RecordingStatus, RecordingSummary, RecordingSwitch};
use crate::rules::Rules;
use crate::session::{Session, SessionConfig, SessionError};
use crate::simulated_board::BoardConfig;
use crate::sink::{AlarmSink, Alarms, CommandSink, OpenSink, Sink};
use crate::source::{SendError, Source, SourceError, SourceUrl};
use crate::stamp::HostClock;
use palpate_estimators::estimator::Locator;
use palpate_rig::Rig;
use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::JoinHandle;

/// Live use of a locator.
pub struct Live {
    /// Replaced once, after a calibration.
    subject: Mutex<Arc<Subject>>,
    /// Set at the start, or with a new rig.
    calibrator: OnceLock<Calibrator>,
    bring_up: Option<BringUp>,
    simulated: Option<(Rig, BoardConfig)>,
    folder: PathBuf,
    /// Folder of recordings; `None` without recording.
    recordings: Option<PathBuf>,
    config: SessionConfig,
    commands: Rules,
    alarms: Alarms,
    alarm_text: Mutex<(String, Option<AlarmFile>)>,
    sinks: Vec<OpenSink>,
    clock: HostClock,
    hub: Hub,
    running: Mutex<Option<Running>>,
}

struct Subject {
    /// `None` during a calibration.
    locator: Option<Arc<Locator>>,
    channels: Vec<Channel>,
    info: SessionInfo,
}

struct Running {
    url: String,
    inputs: SyncSender<Input>,
    thread: JoinHandle<Option<String>>,
    switch: RecordingSwitch,
    /// Dropped to end its thread.
    _source: Source,
}

/// Error of a request.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// No locator yet.
    #[error("the locator does not exist yet: the calibration has not ended")]
    NoLocator,
    /// No calibration.
    #[error("this server does not calibrate")]
    NotCalibrating,
    /// Error of a calibration step.
    #[error(transparent)]
    Calibrator(#[from] CalibratorError),
    /// No running session.
    #[error("no session runs: the source is missing or has ended")]
    NoSession,
    /// The session is too slow.
    #[error("the session is behind its source")]
    Behind,
    /// No rig to simulate.
    #[error("the server has no simulated board: it was started with a locator alone")]
    NotSimulated,
    /// The calibration needs its source.
    #[error("this server calibrates, and its readings come from {from}")]
    Calibrates {
        /// URL of the source.
        from: String,
    },
    /// Error of the source.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Error of a new thread.
    #[error("no thread for the session: {0}")]
    Thread(#[from] std::io::Error),
    /// Session configuration unsuitable for the locator.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Times unsuitable for filter or tracker.
    #[error(transparent)]
    Pace(#[from] PaceError),
    /// Commands to a one-way source.
    #[error("rules send commands, and {0}")]
    OneWay(#[from] SendError),
    /// Wrong columns of the source.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// Error of a board without a rig.
    #[error(transparent)]
    BringUp(#[from] BringUpError),
    /// Error of a new rig.
    #[error(transparent)]
    RigForm(#[from] RigFormError),
    /// Invalid alarms.
    #[error("{0}")]
    Rule(String),
    /// Unwritable file of alarms.
    #[error("cannot keep the alarms in {path}: {error}")]
    AlarmFile {
        /// Path of the file.
        path: String,
        /// Cause.
        error: std::io::Error,
    },
    /// No folder of recordings.
    #[error("no folder for recordings is set")]
    NoFolder,
    /// Error of a recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

impl Live {
    /// Creates live use; `simulated` enables the simulated board.
    pub fn new(locator: Locator, name: &str, simulated: Option<(Rig, BoardConfig)>, folder: PathBuf) -> Self {
        let subject = Subject::of_locator(locator, name, simulated.is_some());
        Self::of_subject(subject, simulated, folder)
    }

    /// Creates live use without a locator, for calibration.
    pub fn calibrating(plan: CalibrationPlan, folder: PathBuf, clock: HostClock) -> Self {
        let subject = Subject {
            locator: None,
            channels: Channel::all_of(&plan.rig.setup),
            info: SessionInfo::of_setup(&plan.rig.setup),
        };
        let live = Self { clock, ..Self::of_subject(subject, None, folder) };
        // The cell is empty.
        let _ = live.calibrator.set(Calibrator::new(plan, live.folder.clone(), clock));
        live
    }

    /// Creates live use of a board without a rig.
    ///
    /// # Errors
    /// [`LiveError::BringUp`].
    pub fn bringing_up(from: SourceUrl, folder: PathBuf) -> Result<Self, LiveError> {
        let subject = Subject { locator: None, channels: Vec::new(), info: SessionInfo::without_rig() };
        let live = Self::of_subject(subject, None, folder);
        let bring_up = BringUp::begin(from, &live.folder, live.clock)?;
        Ok(Self { bring_up: Some(bring_up), ..live })
    }

    fn of_subject(subject: Subject, simulated: Option<(Rig, BoardConfig)>, folder: PathBuf) -> Self {
        Self {
            subject: Mutex::new(Arc::new(subject)),
            calibrator: OnceLock::new(),
            bring_up: None,
            simulated,
            folder,
            recordings: None,
            config: SessionConfig::default(),
            commands: Rules::default(),
            alarms: Alarms::default(),
            alarm_text: Mutex::default(),
            sinks: Vec::new(),
            clock: HostClock::new(),
            hub: Hub::default(),
            running: Mutex::default(),
        }
    }

    /// Sets the folder of recordings.
    #[must_use]
    pub fn with_recordings(self, folder: PathBuf) -> Self {
        Self { recordings: Some(folder), ..self }
    }

    /// Sets the session configuration, checked at the start of a session.
    #[must_use]
    pub fn with_sessions(self, config: SessionConfig) -> Self {
        Self { config, ..self }
    }

    /// Sets rules that send commands to the board.
    #[must_use]
    pub fn with_commands(self, commands: Rules) -> Self {
        Self { commands, ..self }
    }

    /// Sets rules that raise alarms.
    #[must_use]
    pub fn with_alarms(self, rules: Rules) -> Self {
        locked(&self.alarm_text).0 = rules.to_toml();
        self.alarms.set(rules);
        self
    }

    /// Sets the file of alarms, and its content.
    #[must_use]
    pub fn with_alarm_file(self, file: AlarmFile, text: String, rules: Rules) -> Self {
        *locked(&self.alarm_text) = (text, Some(file));
        self.alarms.set(rules);
        self
    }

    pub(super) fn alarm_text(&self) -> (String, Option<AlarmFile>) {
        locked(&self.alarm_text).clone()
    }

    /// Replaces the alarms, also on disk; empty text removes them.
    ///
    /// # Errors
    /// [`LiveError::NoLocator`], `AlarmFile`, or `Rule` for invalid text, another action, or no effect.
    pub(super) fn set_alarms(&self, text: &str) -> Result<(), LiveError> {
        let subject = self.subject();
        let locator = subject.locator.as_ref().ok_or(LiveError::NoLocator)?;
        let rules = match text.trim() {
            "" => Rules::default(),
            _ => Rules::from_toml(text, locator.setup.surface().extent())
                .map_err(|error| LiveError::Rule(error.with_line(text)))?,
        };
        rules.check_alarms(locator).map_err(LiveError::Rule)?;
        let mut kept = locked(&self.alarm_text);
        if let Some(file) = &kept.1 {
            let path = || file.path().display().to_string();
            file.write(text).map_err(|error| LiveError::AlarmFile { path: path(), error })?;
        }
        self.alarms.set(rules);
        text.clone_into(&mut kept.0);
        Ok(())
    }

    /// Sets sinks besides browsers and recordings.
    #[must_use]
    pub fn with_sinks(self, sinks: Vec<OpenSink>) -> Self {
        Self { sinks, ..self }
    }

    /// Replaces the session.
    ///
    /// # Errors
    /// [`LiveError`] of source, sinks, columns or configuration; the running session continues.
    pub fn begin(&self, url: &SourceUrl) -> Result<(), LiveError> {
        pipeline::check_pace(&self.config.estimation, url)?;
        self.begin_with(url.to_string(), url.columns(), |clock, to| {
            Source::open(url, &self.folder, clock, to)
        })
    }

    /// Replaces the session by a simulated one.
    ///
    /// # Errors
    /// [`LiveError::Calibrates`], `NotSimulated`, or those of [`Self::begin`].
    pub fn begin_simulated(&self) -> Result<(), LiveError> {
        self.check_source_is_free()?;
        let (rig, config) = self.simulated.clone().ok_or(LiveError::NotSimulated)?;
        self.begin_with("simulated".to_owned(), &[], |clock, to| Source::simulated(rig, config, clock, to))
    }

    /// A calibration needs its own source.
    pub(super) fn check_source_is_free(&self) -> Result<(), LiveError> {
        match self.calibrator.get() {
            Some(calibrator) => Err(LiveError::Calibrates { from: calibrator.plan().from.to_string() }),
            None => Ok(()),
        }
    }

    fn begin_with(
        &self,
        url: String,
        columns: &[String],
        open: impl FnOnce(HostClock, SyncSender<Input>) -> Result<Source, SourceError>,
    ) -> Result<(), LiveError> {
        let (inputs, received) = sync_channel(pipeline::WAITING);
        let locator = self.subject().locator.clone().ok_or(LiveError::NoLocator)?;
        let config = self.config.clone();
        Session::new(&locator, &config)?.set_columns(columns)?;
        let switch = RecordingSwitch::new(&locator, config.estimation, &url, inputs.clone())?;
        let source = open(self.clock, inputs.clone())?;
        let commands = match self.commands.as_slice() {
            [] => None,
            _ => Some(CommandSink::new(self.commands.clone(), source.commander()?, inputs.clone())),
        };
        let (clock, columns) = (self.clock, columns.to_vec());
        let (channels, extent) = (Channel::all_of(&locator.setup), locator.setup.surface().extent());
        let mut sinks: Vec<Box<dyn Sink>> =
            vec![Box::new(WebSink::new(self.hub.clone(), &channels, extent)), Box::new(switch.clone())];
        sinks.push(Box::new(AlarmSink::new(self.alarms.clone(), inputs.clone())));
        for open in &self.sinks {
            sinks.push(open(&channels, extent, inputs.clone())?);
        }
        sinks.extend(commands.map(|commands| Box::new(commands) as Box<dyn Sink>));
        // All fallible steps are done; the running session may end.
        let mut running = self.lock();
        if let Some(running) = running.take() {
            running.end();
        }
        self.hub.forget_past();
        let run = move || {
            // Errors were returned above.
            let mut session = Session::new(&locator, &config).ok()?;
            let _ = session.set_columns(&columns);
            let fault = pipeline::run(&mut session, clock, &received, &mut sinks);
            fault.filter(|_| session.frames().readings() == 0)
        };
        let thread = std::thread::Builder::new().name("session".to_owned()).spawn(run)?;
        *running = Some(Running { url, inputs, thread, switch, _source: source });
        Ok(())
    }

    /// Sends a command to the session.
    ///
    /// # Errors
    /// [`LiveError::NoSession`] or `Behind`.
    pub fn command(&self, command: Command) -> Result<(), LiveError> {
        use std::sync::mpsc::TrySendError;
        let running = self.lock();
        let running = running.as_ref().ok_or(LiveError::NoSession)?;
        running.inputs.try_send(Input::Command(command)).map_err(|error| match error {
            TrySendError::Full(_) => LiveError::Behind,
            TrySendError::Disconnected(_) => LiveError::NoSession,
        })
    }

    /// Begins a recording, named by the time by default.
    ///
    /// # Errors
    /// [`LiveError::NoFolder`], `NoSession`, or `Recording`.
    pub fn begin_recording(&self, name: Option<&str>) -> Result<RecordingStatus, LiveError> {
        let folder = self.recordings()?;
        let switch = self.switch().ok_or(LiveError::NoSession)?;
        Ok(switch.begin_in(folder, name, self.clock.now().unix_ns / 1_000_000_000)?)
    }

    /// Ends the recording after its last byte.
    ///
    /// # Errors
    /// [`LiveError::NoSession`].
    pub fn end_recording(&self) -> Result<Option<RecordingStatus>, LiveError> {
        Ok(self.switch().ok_or(LiveError::NoSession)?.end())
    }

    /// Lists recordings; see [`recording::list`].
    ///
    /// # Errors
    /// [`LiveError::NoFolder`] or `Recording`.
    pub fn list_recordings(&self) -> Result<Vec<RecordingSummary>, LiveError> {
        Ok(recording::list(self.recordings()?)?)
    }

    /// Reads a recording; see [`recording::read`].
    ///
    /// # Errors
    /// [`LiveError::NoFolder`] or `Recording`.
    pub fn read_recording(
        &self,
        name: &str,
        (from_s, to_s): (f64, f64),
        points: usize,
    ) -> Result<Excerpt, LiveError> {
        Ok(recording::read(&self.recording_path(name)?, from_s, to_s, points)?)
    }

    /// Path of a possible recording.
    ///
    /// # Errors
    /// [`LiveError::NoFolder`], or `Recording` for an invalid name, a link, a pipe or a folder.
    pub fn recording_path(&self, name: &str) -> Result<PathBuf, LiveError> {
        let path = self.recordings()?.join(recording::check_name(name)?);
        match path.symlink_metadata() {
            Ok(found) if !found.is_file() => {
                Err(RecordingError::NotRegular { path: path.display().to_string() }.into())
            }
            _ => Ok(path),
        }
    }

    fn recordings(&self) -> Result<&PathBuf, LiveError> {
        self.recordings.as_ref().ok_or(LiveError::NoFolder)
    }

    fn switch(&self) -> Option<RecordingSwitch> {
        self.lock().as_ref().map(|running| running.switch.clone())
    }

    fn board(&self) -> Result<&BringUp, BringUpError> {
        let board = self.bring_up.as_ref().filter(|_| self.calibrator.get().is_none());
        board.ok_or(BringUpError::HasRig)
    }

    pub(super) fn bring_up_record(&self) -> Result<BringUpRecord, LiveError> {
        Ok(self.board()?.record())
    }

    pub(super) fn choose_port(&self, port: Option<&str>, baud: Option<u32>) -> Result<(), LiveError> {
        Ok(self.board()?.choose(port, baud, &self.folder)?)
    }

    /// Makes a rig; a written one can be calibrated.
    pub(super) fn make_rig(&self, form: &RigForm) -> Result<NewRigRecord, LiveError> {
        let board = self.board()?;
        let mut made = NewRig::new(form, &board.from(), &board.channels(), &self.folder)?;
        if !form.write {
            return Ok(made.record);
        }
        // Only one request at a time makes the rig.
        let mut subject = locked(&self.subject);
        self.board()?;
        made.write(form.overwrite)?;
        board.end();
        *subject = Arc::new(Subject {
            locator: None,
            channels: Channel::all_of(&made.rig.setup),
            info: SessionInfo::of_setup(&made.rig.setup),
        });
        *locked(&self.alarm_text) = (String::new(), Some(AlarmFile::for_path(&made.out)));
        let plan = CalibrationPlan {
            comment: format!("presses for {}", made.record.file),
            rig: made.rig,
            from: made.from,
            presses: made.presses,
            out: made.out,
            force_n: None,
            statements: made.statements,
            machine: None,
            before: Vec::new(),
            seed: 0,
        };
        // The cell is empty without a rig.
        let _ = self.calibrator.set(Calibrator::new(plan, self.folder.clone(), self.clock));
        Ok(made.record)
    }

    pub(super) fn calibration(&self) -> Result<CalibrationRecord, LiveError> {
        let calibrator = self.calibrator()?;
        if calibrator.finish_check() {
            self.begin(&calibrator.plan().from)?;
        }
        calibrator.preview();
        Ok(calibrator.record())
    }

    pub(super) fn calibrator(&self) -> Result<&Calibrator, LiveError> {
        self.calibrator.get().ok_or(LiveError::NotCalibrating)
    }

    pub(super) fn attend(&self) {
        if let Some(calibrator) = self.calibrator.get() {
            calibrator.attendance().note();
        }
    }

    pub(super) fn needs_attendance(&self) -> bool {
        self.calibrator.get().is_some_and(|calibrator| calibrator.attendance().is_needed())
    }

    pub(super) fn begin_calibration(&self, stated: Statements) -> Result<(), LiveError> {
        Ok(self.calibrator()?.begin(stated, || drop(self.end_session()))?)
    }

    pub(super) fn begin_check(&self) -> Result<(), LiveError> {
        Ok(self.calibrator()?.begin_check(|| drop(self.end_session()))?)
    }

    pub(super) fn begin_set_up(&self, is_dry_run: bool) -> Result<(), LiveError> {
        Ok(self.calibrator()?.begin_set_up(is_dry_run, || drop(self.end_session()))?)
    }

    /// Fits the presses in a thread, then begins a session.
    pub(super) fn finish_calibration(self: &Arc<Self>) -> Result<(), LiveError> {
        let calibrator = self.calibrator()?;
        calibrator.begin_fit()?;
        let live = Arc::clone(self);
        std::thread::Builder::new().name("fit".to_owned()).spawn(move || {
            let Ok(calibrator) = live.calibrator() else { return };
            let url = calibrator.plan().from.clone();
            let name = calibrator.plan().out_name();
            calibrator.fit(|locator| {
                let subject = Subject::of_locator(locator, &name, false);
                *locked(&live.subject) = Arc::new(subject);
                live.begin(&url).map_err(|error| error.to_string())
            });
        })?;
        Ok(())
    }

    /// Ends session and calibration; returns the fault of a source without readings.
    pub fn end(&self) -> Option<String> {
        let of_calibration = self.calibrator.get().and_then(Calibrator::end);
        let of_board = self.bring_up.as_ref().and_then(BringUp::end);
        let of_session = self.end_session();
        of_calibration.or(of_board).or(of_session)
    }

    fn end_session(&self) -> Option<String> {
        self.lock().take()?.end()
    }

    /// URL of the running source.
    pub fn source(&self) -> Option<String> {
        let running = self.lock();
        running.as_ref().filter(|running| !running.thread.is_finished()).map(|running| running.url.clone())
    }

    /// Channels.
    pub fn channels(&self) -> Vec<Channel> {
        self.subject().channels.clone()
    }

    pub(super) fn info(&self) -> SessionInfo {
        let recording = self.recordings.as_ref().map(|folder| {
            let status = self.switch().and_then(|switch| switch.status());
            (folder.display().to_string(), status)
        });
        self.subject()
            .info
            .clone()
            .with_source(self.source())
            .with_estimation(self.config.estimation)
            .with_recording(recording)
            .with_calibration(self.calibrator.get())
            .with_bring_up(self.board().is_ok())
    }

    pub(super) fn past(&self) -> String {
        // Releases the lock early, because the session waits for it.
        let past = locked(&self.hub.history).clone();
        past.to_json()
    }

    fn subject(&self) -> Arc<Subject> {
        Arc::clone(&locked(&self.subject))
    }

    pub(super) fn hub(&self) -> &Hub {
        &self.hub
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Running>> {
        locked(&self.running)
    }
}

impl Subject {
    fn of_locator(locator: Locator, name: &str, has_simulated: bool) -> Self {
        Self {
            channels: Channel::all_of(&locator.setup),
            info: SessionInfo::new(&locator, name, has_simulated),
            locator: Some(Arc::new(locator)),
        }
    }
}

impl Running {
    fn end(self) -> Option<String> {
        let Self { inputs, thread, switch, _source: source, .. } = self;
        drop(source);
        // Fails only after the end of the session.
        let _ = inputs.send(Input::Stop);
        let fault = thread.join().ok().flatten();
        switch.end();
        fault
    }
}
