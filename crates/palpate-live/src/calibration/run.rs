//! A calibration in progress: arrivals of a source in, rows on disk and notes out.

use super::guide::{Guide, Progress, RestingRow, Waiting};
use super::journal::{Journal, JournalError};
use super::press::Press;
use super::repeat_check::Doubt;
use super::repeats::untouched_before;
use super::touch_off::TouchDetector;
use super::trace::RecentReadings;
use crate::event::{ChannelState, Event};
use crate::feed::FeedWatch;
use crate::frame::{BadFrame, Channel, ColumnsError, FrameReader};
use crate::input::{Arrival, Arrived};
use crate::session::HealthWatch;
use palpate_estimators::recording::Row;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::Unit;
use palpate_rig::Stage;
use std::collections::BTreeMap;
use std::time::Duration;

/// Error that ends a calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A press cannot be recorded.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A press pulls at the load cell.
    #[error("the load cell `{name}` reads {force_n} N in a press; it must read more than 0 N")]
    LoadCell {
        /// Name.
        name: String,
        /// The force at the load cell.
        force_n: f64,
    },
}

/// Time between two explanations of a long step.
const EXPLAIN_EVERY: Duration = Duration::from_secs(5);

/// Note on the readings or steps of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// The source was opened; its name.
    Opened(String),
    /// The source was lost, and is searched for again; the cause.
    Lost(String),
    /// No readings arrive: cause and remedy.
    NoReadings(String),
    /// Readings arrive again.
    ReadingsAgain,
    /// The source has ended.
    Ended,
    /// The guide waits for another step.
    Waits(Waiting),
    /// A press was recorded, and is on disk.
    Taken,
    /// The last press grew without a lift, and its row was replaced.
    Replaced,
    /// The untouched surface was recorded. It is on disk if presses have a force.
    Untouched,
    /// The source repeats readings because it is faster than its sensors: each counts once.
    RepeatedReadings,
    /// The press is requested again.
    AskedAgain(Doubt),
    /// A step is long: the awaited condition and the present reading.
    StillWaiting(String),
    /// A channel reads the end of its range; its name.
    Saturated(String),
    /// The load cell reads more than its limit, in newtons.
    Overload(f64),
}

/// The load cell of a machine: the last channel of the frames.
#[derive(Clone, Debug)]
struct LoadCell {
    name: String,
    limit_n: Option<f64>,
    /// First reading, before the machine moves.
    first_n: Option<f64>,
    /// Last reading.
    now_n: Option<f64>,
}

/// A calibration that runs.
pub struct Calibration {
    guide: Guide,
    journal: Journal,
    /// Frames with the channels and the load cell.
    frames: FrameReader,
    feed: FeedWatch,
    /// True from a report of missing readings until the next reading.
    lacks_readings: bool,
    health: HealthWatch,
    load_cell: Option<LoadCell>,
    last: Vec<f64>,
    recent: RecentReadings,
    /// True while the guide and the detector receive readings: not while a machine moves.
    is_guided: bool,
    /// Detector of a touch-off.
    touch_detector: Option<TouchDetector>,
    /// True once it was noted that the source repeats readings.
    notes_repeats: bool,
    /// Awaited step, and the instant of its last explanation.
    explained: (Waiting, Duration),
}

impl Calibration {
    /// A calibration for a plan. Frames without names have these `columns`. A stage may have a load cell, which is then the last channel.
    ///
    /// # Errors
    /// [`ColumnsError`] unless every channel is named once.
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
            explained: (guide.waiting(), Duration::ZERO),
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

    /// The guide.
    pub fn guide(&self) -> &Guide {
        &self.guide
    }

    /// The presses so far.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Frames that contained no valid reading, by cause.
    pub fn bad_frames(&self) -> &BTreeMap<BadFrame, u64> {
        self.frames.bad_frames()
    }

    /// Number of readings that arrived.
    pub fn readings(&self) -> u64 {
        self.frames.readings()
    }

    /// Fault of the source: no reading arrived, or none near the end.
    pub fn fault(&self) -> Option<String> {
        self.feed.fault(&self.frames)
    }

    /// The last reading, in SI units or raw, without the load cell; empty before the first.
    pub fn last_reading(&self) -> &[f64] {
        &self.last
    }

    /// Force at the load cell, in newtons, less its untouched reading; `None` without one, or before the first reading.
    pub fn cell_force_n(&self) -> Option<f64> {
        let cell = self.load_cell.as_ref()?;
        Some(cell.now_n? - self.cell_untouched_n())
    }

    /// Untouched reading of the load cell, in newtons. It is the first reading until one is learnt at rest, because a cell that is not tared has an
    /// offset.
    fn cell_untouched_n(&self) -> f64 {
        let of_guide = self.guide.untouched_reading().and_then(|reading| reading.last().copied());
        let of_detector = || self.touch_detector.as_ref().and_then(TouchDetector::untouched_last);
        let first = || self.load_cell.as_ref()?.first_n;
        of_guide.or_else(of_detector).or_else(first).unwrap_or(0.0)
    }

    /// Processes an arrival from a source; resulting notes are added to `notes`.
    ///
    /// # Errors
    /// [`CalibrationError`] if a press cannot be recorded.
    pub fn receive(&mut self, arrived: &Arrived, notes: &mut Vec<Note>) -> Result<(), CalibrationError> {
        match &arrived.arrival {
            Arrival::Opened(name) | Arrival::Piped(name) | Arrival::Joined(name) => {
                // The offsets of a board that was disconnected may have changed.
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

    /// Notes once that no readings arrive; must be called often during a silence.
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
            // A load cell is the most sensitive to the touch: its value alone decides.
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
                self.journal.take_back()?;
                notes.push(Note::AskedAgain(doubt));
            }
            Progress::Pressed { untouched, press } => {
                if let Some(untouched) = untouched {
                    self.journal.add(self.without_cell(untouched.row), None)?;
                }
                let row = self.weighed(press)?;
                self.journal.add(row, depth_m)?;
                self.trace_last_press();
                notes.push(Note::Taken);
            }
            Progress::Replaced(press) => {
                let row = self.weighed(press)?;
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

    /// Stores the trace of the last recorded press, beginning before its untouched row.
    fn trace_last_press(&mut self) {
        let rows = self.journal.rows();
        let Some(untouched) = untouched_before(rows, rows.len()) else { return };
        let times_s = rows.last().and_then(|row| row.time_s).zip(untouched.time_s);
        let ago_s = times_s.map_or(f64::INFINITY, |(press_s, untouched_s)| press_s - untouched_s);
        let trace = self.recent.trace(&untouched.reading, ago_s);
        self.journal.set_trace(trace);
    }

    /// Explains a long step, except the wait for a press.
    fn explain(&mut self, at: Duration, notes: &mut Vec<Note>) {
        let waiting = self.guide.waiting();
        let (explained, since) = self.explained;
        if explained != waiting {
            self.explained = (waiting, at);
        } else if waiting != Waiting::Press && at.saturating_sub(since) >= EXPLAIN_EVERY {
            self.explained.1 = at;
            notes.extend(self.guide.explain().map(Note::StillWaiting));
        }
    }

    /// The row of a press with the force of the load cell, if there is one. The force is the mean of the stretch at rest, because it is not a
    /// reading to be located.
    fn weighed(&self, press: RestingRow) -> Result<Row, CalibrationError> {
        let Some(cell) = &self.load_cell else { return Ok(press.row) };
        let force_n = press.mean.last().map_or(0.0, |read_n| read_n - self.cell_untouched_n());
        if force_n <= 0.0 {
            return Err(CalibrationError::LoadCell { name: cell.name.clone(), force_n });
        }
        Ok(Row { force_n: Some(force_n), ..self.without_cell(press.row) })
    }

    /// A row without the value of the load cell.
    fn without_cell(&self, mut row: Row) -> Row {
        row.reading.truncate(row.reading.len() - usize::from(self.load_cell.is_some()));
        row
    }

    /// Sets whether the guide receives readings: those during a move of a machine are meaningless.
    pub(super) fn set_guided(&mut self, is_guided: bool) {
        if is_guided != self.is_guided {
            self.guide.forget_readings();
            if let Some(detector) = &mut self.touch_detector {
                detector.forget_readings();
            }
        }
        self.is_guided = is_guided;
    }

    /// Starts or ends the detection of a touch in the readings.
    pub(super) fn detect_touch(&mut self, is_wanted: bool) {
        self.touch_detector = is_wanted.then(TouchDetector::default);
    }

    /// The detector of a touch-off; `None` outside one.
    pub(super) fn touch_detector(&mut self) -> Option<&mut TouchDetector> {
        self.touch_detector.as_mut()
    }

    /// Takes back the last press, which is requested again; false if there is none.
    ///
    /// # Errors
    /// [`JournalError`] if the file cannot be written.
    pub fn redo(&mut self) -> Result<bool, JournalError> {
        if !self.guide.redo() {
            return Ok(false);
        }
        self.journal.take_back()?;
        Ok(true)
    }

    /// Learns the untouched reading again, after the operator has stated that the surface is untouched.
    pub fn relearn_untouched(&mut self) {
        self.guide.relearn();
    }

    /// Strikes out a press, counted from 0; false if the press does not exist. [`Self::replan`] requests it again.
    ///
    /// # Errors
    /// [`JournalError`] if the file cannot be written.
    pub fn strike(&mut self, press: usize) -> Result<bool, JournalError> {
        self.journal.strike(press)
    }

    /// Requests these presses from now on; the untouched reading is learnt again.
    pub fn replan(&mut self, to_come: Vec<Press>) {
        self.guide = Guide::new(to_come).with_rows(self.journal.rows());
    }

    /// Leaves out the next press.
    pub fn skip(&mut self) {
        self.guide.skip();
    }

    /// Ends the calibration early.
    pub fn stop(&mut self) {
        self.guide.stop();
    }
}
