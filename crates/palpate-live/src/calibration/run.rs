//! A calibration in progress: arrivals of a source in, rows on disk and notes out.

use super::guide::{Guide, Press, Progress, Waiting};
use super::journal::{Journal, JournalError};
use super::repeats::untouched_before;
use super::trace::RecentReadings;
use crate::event::{ChannelState, Event};
use crate::frame::{BadFrame, Channel, ColumnsError, Decoder, Frame};
use crate::input::{Arrival, Arrived};
use crate::session::HealthWatch;
use palpate_estimators::recording::Row;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::Unit;
use palpate_rig::Stage;
use std::collections::BTreeMap;
use std::time::Duration;

/// A calibration that cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A press cannot be kept.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A press pulls at the load cell.
    #[error("the load cell `{name}` reads {force_n} N in a press; it must read more than 0 N")]
    LoadCell {
        /// Its name.
        name: String,
        /// The force that it reads.
        force_n: f64,
    },
}

/// Frames without a reading among them after which it is said that there is none.
const UNREAD: u64 = 100;

/// Note on what a calibration has read or done.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// The source is there; its name.
    Opened(String),
    /// The source went away, and is looked for again; why.
    Lost(String),
    /// Many frames and not one reading: why, and what to do.
    Unread(String),
    /// The source has no more.
    Ended,
    /// Something else is waited for.
    Waits(Waiting),
    /// A press was taken, and is on disk.
    Taken,
    /// The untouched surface was taken, and is on disk where presses have a force.
    Untouched,
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
    /// Its last reading.
    now_n: Option<f64>,
    /// Its reading when nothing touched last.
    untouched_n: Option<f64>,
}

/// A calibration that runs.
pub struct Calibration {
    guide: Guide,
    journal: Journal,
    decoder: Decoder,
    /// Names by which a board may call the channels, the load cell's among them.
    labels: Vec<String>,
    health: HealthWatch,
    load_cell: Option<LoadCell>,
    /// Frames that were no reading, by cause.
    bad: BTreeMap<BadFrame, u64>,
    readings: u64,
    last: Vec<f64>,
    recent: RecentReadings,
    /// True while readings are shown to the guide: not while a machine moves.
    is_guided: bool,
}

impl Calibration {
    /// A calibration through a plan; frames without names have these `columns`. A stage may have a load cell, which is the last channel then.
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
            Some(LoadCell { name, limit_n: stage.force_limit_n, now_n: None, untouched_n: None })
        });
        if let Some(LoadCell { name, .. }) = &load_cell {
            channels.push(Channel {
                name: name.clone(),
                label: name.clone(),
                unit: Unit::from_symbol("N").unwrap_or(Unit::NONE),
            });
        }
        let mut decoder = Decoder::new(&channels);
        decoder.set_columns(columns)?;
        Ok(Self {
            guide: Guide::new(plan),
            journal,
            decoder,
            labels: channels.into_iter().map(|channel| channel.label).collect(),
            health: HealthWatch::new(setup.layout()),
            load_cell,
            bad: BTreeMap::new(),
            readings: 0,
            last: Vec::new(),
            recent: RecentReadings::default(),
            is_guided: true,
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

    /// Frames that were no reading, by cause.
    pub fn bad_frames(&self) -> &BTreeMap<BadFrame, u64> {
        &self.bad
    }

    /// Readings that arrived.
    pub fn readings(&self) -> u64 {
        self.readings
    }

    /// The last reading, in SI units or raw, without the load cell; empty before there was one.
    pub fn last_reading(&self) -> &[f64] {
        &self.last
    }

    /// Force at the load cell, in newtons, less what it read untouched; `None` without one, or before the first reading.
    pub fn cell_force_n(&self) -> Option<f64> {
        let cell = self.load_cell.as_ref()?;
        Some(cell.now_n? - cell.untouched_n.unwrap_or(0.0))
    }

    /// Takes what a source brought; what follows is added to `notes`.
    ///
    /// # Errors
    /// [`CalibrationError`] where a press cannot be kept.
    pub fn receive(&mut self, arrived: &Arrived, notes: &mut Vec<Note>) -> Result<(), CalibrationError> {
        let mut frames = Vec::new();
        let hand_on = |frame| frames.push(frame);
        match &arrived.arrival {
            Arrival::Bytes(bytes) => self.decoder.receive(bytes, hand_on),
            Arrival::Message(bytes) => self.decoder.receive_message(bytes, hand_on),
            Arrival::Opened(name) => {
                self.decoder.open();
                notes.push(Note::Opened(name.clone()));
            }
            Arrival::Joined(name) => {
                self.decoder.join();
                notes.push(Note::Opened(name.clone()));
            }
            Arrival::Lost(why) => {
                self.decoder.open();
                notes.push(Note::Lost(why.clone()));
            }
            Arrival::Ended => self.decoder.end(hand_on),
        }
        for frame in frames {
            match frame {
                Ok(Frame { reading, .. }) => self.add(arrived.at.elapsed, &reading, notes)?,
                Err(cause) => {
                    *self.bad.entry(cause).or_default() += 1;
                    notes.extend(self.unread(cause));
                }
            }
        }
        if arrived.arrival == Arrival::Ended {
            notes.push(Note::Ended);
        }
        Ok(())
    }

    /// A note where the last of many frames was no reading either, for this cause.
    fn unread(&self, cause: BadFrame) -> Option<Note> {
        let is_time = self.readings == 0 && self.bad.values().sum::<u64>() == UNREAD;
        is_time
            .then(|| Note::Unread(cause.explain_no_reading(UNREAD, self.labels.iter().map(String::as_str))))
    }

    fn add(&mut self, at: Duration, reading: &[f64], notes: &mut Vec<Note>) -> Result<(), CalibrationError> {
        self.readings += 1;
        let channels = reading.len() - usize::from(self.load_cell.is_some());
        self.last = reading[..channels].to_vec();
        self.recent.add(at, &reading[..channels]);
        self.health.add(&reading[..channels], |event| {
            if let Event::Channel { name, state: ChannelState::Saturated } = event {
                notes.push(Note::Saturated(name));
            }
        });
        if let Some(cell) = &mut self.load_cell {
            cell.now_n = Some(reading[channels]);
            let force_n = reading[channels] - cell.untouched_n.unwrap_or(0.0);
            if cell.limit_n.is_some_and(|limit_n| force_n.abs() > limit_n) {
                notes.push(Note::Overload(force_n));
            }
        }
        if !self.is_guided {
            return Ok(());
        }
        let press = self.guide.next_press().map(|(_, press)| press);
        match self.guide.add(at, reading) {
            Progress::None => {}
            Progress::Waits(waiting) => notes.push(Note::Waits(waiting)),
            Progress::Taken { row, mean } => {
                let depth_m = press.and_then(|press| press.depth_m).filter(|_| row.touches());
                notes.push(if row.touches() { Note::Taken } else { Note::Untouched });
                let row = self.weighed(row, &mean)?;
                let is_press = row.touches();
                self.journal.add(row, depth_m)?;
                let rows = self.journal.rows();
                if let Some(untouched) = untouched_before(rows, rows.len()).filter(|_| is_press) {
                    let times_s = rows.last().and_then(|row| row.time_s).zip(untouched.time_s);
                    let ago_s = times_s.map_or(f64::INFINITY, |(press_s, untouched_s)| press_s - untouched_s);
                    let trace = self.recent.trace(&untouched.reading, ago_s);
                    self.journal.set_trace(trace);
                }
            }
        }
        Ok(())
    }

    /// A row whose force is that of the load cell, where there is one: the mean of the stretch at rest, as a force is no reading that is located.
    fn weighed(&mut self, mut row: Row, mean: &[f64]) -> Result<Row, CalibrationError> {
        let Some(cell) = &mut self.load_cell else { return Ok(row) };
        let Some(&read_n) = mean.last() else { return Ok(row) };
        row.reading.pop();
        if row.touches() {
            let force_n = read_n - cell.untouched_n.unwrap_or(0.0);
            if force_n <= 0.0 {
                return Err(CalibrationError::LoadCell { name: cell.name.clone(), force_n });
            }
            row.force_n = Some(force_n);
        } else {
            cell.untouched_n = Some(read_n);
        }
        Ok(row)
    }

    /// Shows readings to the guide from now on, or not: those that are taken while a machine moves mean nothing.
    pub(super) fn set_guided(&mut self, is_guided: bool) {
        if is_guided != self.is_guided {
            self.guide.forget_readings();
        }
        self.is_guided = is_guided;
    }

    /// Takes back the last press, which is asked for again; false where there is none.
    ///
    /// # Errors
    /// [`JournalError`] where the file cannot be written.
    pub fn redo(&mut self) -> Result<bool, JournalError> {
        if !self.guide.redo() {
            return Ok(false);
        }
        self.journal.take_back()?;
        Ok(true)
    }

    /// Strikes out a press, counted from 0; false where there is no such press. [`Self::replan`] asks for it again.
    ///
    /// # Errors
    /// [`JournalError`] where the file cannot be written.
    pub fn strike(&mut self, press: usize) -> Result<bool, JournalError> {
        self.journal.strike(press)
    }

    /// Asks for these presses from now on; the untouched reading is learnt anew.
    pub fn replan(&mut self, to_come: Vec<Press>) {
        self.guide = Guide::new(to_come);
    }

    /// Leaves out the press that is next.
    pub fn skip(&mut self) {
        self.guide.skip();
    }

    /// Ends the calibration early.
    pub fn stop(&mut self) {
        self.guide.stop();
    }
}
