use super::guide::{AwaitedStep, Guide, Progress, RestingRow};
use super::journal::{Journal, JournalError};
use super::press::Press;
use super::repeat_check::RetakeReason;
use super::repeats::untouched_before;
use super::touch_off::TouchDetector;
use super::trace::RecentReadings;
use crate::event::{ChannelState, Event};
use crate::feed::FeedWatch;
use crate::frame::{BadFrame, Channel, ColumnsError, FrameReader};
use crate::input::{Arrival, TimedArrival};
use crate::session::HealthWatch;
use palpate_estimators::recording::Row;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::Unit;
use palpate_rig::Stage;
use std::collections::BTreeMap;
use std::time::Duration;

/// Error of a calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A press cannot be recorded.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// Pull at the load cell.
    #[error("the load cell `{name}` reads {force_n} N in a press; it must read more than 0 N")]
    LoadCell {
        /// Channel.
        name: String,
        /// Force in newtons.
        force_n: f64,
    },
}

const EXPLAIN_EVERY: Duration = Duration::from_secs(5);

/// Message of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// Name of the opened source.
    Opened(String),
    /// Cause of a loss of the source.
    Lost(String),
    /// Cause and remedy of missing readings.
    NoReadings(String),
    /// Readings arrive again.
    ReadingsAgain,
    /// The source has ended.
    Ended,
    /// Another step is awaited.
    Waits(AwaitedStep),
    /// A press is on disk.
    Taken,
    /// The last row was replaced by a firmer press.
    Replaced,
    /// The untouched surface was recorded, on disk if presses have a force.
    Untouched,
    /// The source repeats readings: its sensors are slower.
    RepeatedReadings,
    /// The press is requested again.
    AskedAgain(RetakeReason),
    /// Explanation of a long step.
    StillWaiting(String),
    /// Name of a saturated channel.
    Saturated(String),
    /// Force above the limit of the load cell, in newtons.
    Overload(f64),
}

/// Load cell: the last channel.
#[derive(Clone, Debug)]
struct LoadCell {
    name: String,
    limit_n: Option<f64>,
    first_n: Option<f64>,
    now_n: Option<f64>,
}

/// Calibration in progress.
pub struct Calibration {
    guide: Guide,
    journal: Journal,
    frames: FrameReader,
    feed: FeedWatch,
    lacks_readings: bool,
    health: HealthWatch,
    load_cell: Option<LoadCell>,
    last: Vec<f64>,
    recent: RecentReadings,
    is_guided: bool,
    touch_detector: Option<TouchDetector>,
    notes_repeats: bool,
    explained: (AwaitedStep, Duration),
}

impl Calibration {
    /// Creates the calibration of a plan. `columns` are those of unnamed frames; a load cell is the last
    /// channel.
    ///
    /// # Errors
    /// [`ColumnsError`].
    pub fn new(
        setup: &Setup,
        stage: Option<&Stage>,
        columns: &[String],
        plan: Vec<Press>,
        journal: Journal,
    ) -> Result<Self, ColumnsError> {
        let mut channels = Channel::all_of(setup);
        let load_cell = stage.and_then(|stage| {
            let name = stage.load_cell.clone()?;
            Some(LoadCell { name, limit_n: stage.force_limit_n, first_n: None, now_n: None })
        });
        if let Some(LoadCell { name, .. }) = &load_cell {
            channels.push(Channel {
                name: name.clone(),
                label: name.clone(),
                unit: Unit::from_symbol("N").unwrap_or(Unit::NONE),
            });
        }
        let mut frames = FrameReader::new(&channels);
        frames.set_columns(columns)?;
        let guide = Guide::new(plan).with_rows(journal.rows());
        Ok(Self {
            explained: (guide.awaited_step(), Duration::ZERO),
            guide,
            journal,
            frames,
            feed: FeedWatch::default(),
            lacks_readings: false,
            health: HealthWatch::new(setup.layout()),
            load_cell,
            last: Vec::new(),
            recent: RecentReadings::default(),
            is_guided: true,
            touch_detector: None,
            notes_repeats: false,
        })
    }

    /// Guide.
    pub fn guide(&self) -> &Guide {
        &self.guide
    }

    /// Recorded presses.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Invalid frames by cause.
    pub fn bad_frames(&self) -> &BTreeMap<BadFrame, u64> {
        self.frames.bad_frames()
    }

    /// Readings.
    pub fn readings(&self) -> u64 {
        self.frames.readings()
    }

    /// Fault of the source: no reading, or none at the end.
    pub fn fault(&self) -> Option<String> {
        self.feed.fault(&self.frames)
    }

    /// Last reading in SI units or raw, without the load cell.
    pub fn last_reading(&self) -> &[f64] {
        &self.last
    }

    /// Tared force at the load cell, in newtons.
    pub fn cell_force_n(&self) -> Option<f64> {
        let cell = self.load_cell.as_ref()?;
        Some(cell.now_n? - self.cell_untouched_n())
    }

    /// Untouched value of the load cell, in newtons; the first reading until one at rest.
    fn cell_untouched_n(&self) -> f64 {
        let of_guide = self.guide.untouched_reading().and_then(|reading| reading.last().copied());
        let of_detector = || self.touch_detector.as_ref().and_then(TouchDetector::untouched_last);
        let first = || self.load_cell.as_ref()?.first_n;
        of_guide.or_else(of_detector).or_else(first).unwrap_or(0.0)
    }

    /// Processes an arrival, and appends to `notes`.
    ///
    /// # Errors
    /// [`CalibrationError`] of a press.
    pub fn receive(&mut self, arrived: &TimedArrival, notes: &mut Vec<Note>) -> Result<(), CalibrationError> {
        match &arrived.arrival {
            Arrival::Opened(name) | Arrival::Piped(name) | Arrival::Joined(name) => {
                // The offsets of a reconnected board may have changed.
                self.guide.relearn();
                notes.push(Note::Opened(name.clone()));
            }
            Arrival::Lost(why) => notes.push(Note::Lost(why.clone())),
            Arrival::Backlog(_) | Arrival::Bytes(_) | Arrival::Message(_) | Arrival::Ended => {}
        }
        let frames = self.frames.receive(&arrived.arrival);
        self.feed.receive(&arrived.arrival, arrived.at.elapsed, &self.frames);
        if !frames.is_empty() && std::mem::take(&mut self.lacks_readings) {
            notes.push(Note::ReadingsAgain);
        }
        for frame in frames {
            self.add(arrived.at.elapsed, &frame.reading, notes)?;
        }
        self.check_feed(arrived.at.elapsed, notes);
        if arrived.arrival == Arrival::Ended {
            notes.push(Note::Ended);
        }
        Ok(())
    }

    /// Notes missing readings once; must be called often.
    pub fn check_feed(&mut self, now: Duration, notes: &mut Vec<Note>) {
        if let Some(words) = self.feed.report(now, &self.frames) {
            self.lacks_readings = true;
            notes.push(Note::NoReadings(words));
        }
    }

    fn add(&mut self, at: Duration, reading: &[f64], notes: &mut Vec<Note>) -> Result<(), CalibrationError> {
        let channels = reading.len() - usize::from(self.load_cell.is_some());
        self.last = reading[..channels].to_vec();
        self.recent.add(at, &reading[..channels]);
        self.health.add(&reading[..channels], |event| {
            if let Event::Channel { name, state: ChannelState::Saturated } = event {
                notes.push(Note::Saturated(name));
            }
        });
        if let Some(cell) = &mut self.load_cell {
            cell.first_n.get_or_insert(reading[channels]);
        }
        let untouched_n = self.cell_untouched_n();
        if let Some(cell) = &mut self.load_cell {
            cell.now_n = Some(reading[channels]);
            let force_n = reading[channels] - untouched_n;
            if cell.limit_n.is_some_and(|limit_n| force_n.abs() > limit_n) {
                notes.push(Note::Overload(force_n));
            }
        }
        if !self.is_guided {
            return Ok(());
        }
        if let Some(detector) = &mut self.touch_detector {
            // A load cell alone decides: it is the most sensitive.
            let from = if self.load_cell.is_some() { channels } else { 0 };
            detector.add(at, &reading[from..]);
        }
        let last_press = |guide: &Guide| Some(guide.plan()[guide.taken().checked_sub(1)?]);
        let progress = self.guide.add(at, reading);
        if self.guide.is_sample_and_hold() && !std::mem::replace(&mut self.notes_repeats, true) {
            notes.push(Note::RepeatedReadings);
        }
        let depth_m = last_press(&self.guide).and_then(|press| press.depth_m);
        match progress {
            Progress::None => self.explain(at, notes),
            Progress::Waits(waiting) => notes.push(Note::Waits(waiting)),
            Progress::AskedAgain(doubt) => notes.push(Note::AskedAgain(doubt)),
            Progress::TakenBack(doubt) => {
                self.journal.remove_last_press()?;
                notes.push(Note::AskedAgain(doubt));
            }
            Progress::Pressed { untouched, press } => {
                if let Some(untouched) = untouched {
                    self.journal.add(self.without_cell(untouched.row), None)?;
                }
                let row = self.add_load_cell_force(press)?;
                self.journal.add(row, depth_m)?;
                self.trace_last_press();
                notes.push(Note::Taken);
            }
            Progress::Replaced(press) => {
                let row = self.add_load_cell_force(press)?;
                self.journal.replace_last(row, depth_m)?;
                self.trace_last_press();
                notes.push(Note::Replaced);
            }
            Progress::Untouched(untouched) => {
                self.journal.add(self.without_cell(untouched.row), None)?;
                notes.push(Note::Untouched);
            }
        }
        Ok(())
    }

    fn trace_last_press(&mut self) {
        let rows = self.journal.rows();
        let Some(untouched) = untouched_before(rows, rows.len()) else { return };
        let times_s = rows.last().and_then(|row| row.time_s).zip(untouched.time_s);
        let ago_s = times_s.map_or(f64::INFINITY, |(press_s, untouched_s)| press_s - untouched_s);
        let trace = self.recent.trace(&untouched.reading, ago_s);
        self.journal.set_trace(trace);
    }

    fn explain(&mut self, at: Duration, notes: &mut Vec<Note>) {
        let waiting = self.guide.awaited_step();
        let (explained, since) = self.explained;
        if explained != waiting {
            self.explained = (waiting, at);
        } else if waiting != AwaitedStep::Press && at.saturating_sub(since) >= EXPLAIN_EVERY {
            self.explained.1 = at;
            notes.extend(self.guide.explain().map(Note::StillWaiting));
        }
    }

    /// Adds the force of the load cell, as mean of the stretch.
    fn add_load_cell_force(&self, press: RestingRow) -> Result<Row, CalibrationError> {
        let Some(cell) = &self.load_cell else { return Ok(press.row) };
        let force_n = press.mean.last().map_or(0.0, |read_n| read_n - self.cell_untouched_n());
        if force_n <= 0.0 {
            return Err(CalibrationError::LoadCell { name: cell.name.clone(), force_n });
        }
        Ok(Row { force_n: Some(force_n), ..self.without_cell(press.row) })
    }

    fn without_cell(&self, mut row: Row) -> Row {
        row.reading.truncate(row.reading.len() - usize::from(self.load_cell.is_some()));
        row
    }

    /// Sets the use of readings, which are meaningless during a move.
    pub(super) fn set_guided(&mut self, is_guided: bool) {
        if is_guided != self.is_guided {
            self.guide.forget_readings();
            if let Some(detector) = &mut self.touch_detector {
                detector.forget_readings();
            }
        }
        self.is_guided = is_guided;
    }

    pub(super) fn detect_touch(&mut self, is_wanted: bool) {
        self.touch_detector = is_wanted.then(TouchDetector::default);
    }

    pub(super) fn touch_detector(&mut self) -> Option<&mut TouchDetector> {
        self.touch_detector.as_mut()
    }

    /// Requests the last press again; false without one.
    ///
    /// # Errors
    /// [`JournalError`] of the file.
    pub fn redo(&mut self) -> Result<bool, JournalError> {
        if !self.guide.redo() {
            return Ok(false);
        }
        self.journal.remove_last_press()?;
        Ok(true)
    }

    /// Learns the baseline again.
    pub fn relearn_untouched(&mut self) {
        self.guide.relearn();
    }

    /// Deletes a press, counted from 0; false if missing.
    ///
    /// # Errors
    /// [`JournalError`] of the file.
    pub fn strike(&mut self, press: usize) -> Result<bool, JournalError> {
        self.journal.strike(press)
    }

    /// Replaces the remaining presses, and learns the baseline again.
    pub fn replan(&mut self, to_come: Vec<Press>) {
        self.guide = Guide::new(to_come).with_rows(self.journal.rows());
    }

    /// Skips the next press.
    pub fn skip(&mut self) {
        self.guide.skip();
    }

    /// Ends the calibration early.
    pub fn stop(&mut self) {
        self.guide.stop();
    }
}
