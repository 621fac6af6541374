//! Sessions: from bytes to readings, estimates and events.

mod contact;
mod estimate_tracker;
mod estimation;
mod health;
mod low_pass;
mod taring;
mod timeline;

pub use estimate_tracker::EstimateTracker;
pub use estimation::{CreepConfig, Estimation, SessionError};
pub use health::ChannelHealth;
pub(crate) use health::HealthWatch;

use crate::event::{Event, EventRecord};
use crate::feed::REPEATED_READINGS;
use crate::frame::{BadFrame, Channel, ColumnsError, Frame, FrameReader};
use crate::input::{Arrival, Command, TimedArrival};
use crate::sample::Sample;
use crate::stamp::Stamp;
use contact::ContactWatch;
use estimation::EstimationState;
use palpate_core::Status;
use palpate_estimators::estimator::Locator;
use palpate_estimators::recording::RepeatWatch;
use palpate_mechanics::surface::Extent;
use std::collections::BTreeMap;
use taring::Taring;
use timeline::{GapKind, Timeline};

/// Configuration of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionConfig {
    /// Tare.
    pub tare: TareMode,
    /// Estimation method.
    pub estimation: Estimation,
}

/// Treatment of moved offsets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TareMode {
    /// Tracked, if the locator detects untouched readings.
    #[default]
    Auto,
    /// Constant until a tare.
    Manual,
}

/// Output of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// Reading with its estimate.
    Sample(Box<Sample>),
    /// Event.
    Event(EventRecord),
}

/// Counts of readings and frames.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// Located readings.
    pub readings: u64,
    /// Bad frames by cause.
    pub bad_frames: BTreeMap<BadFrame, u64>,
    /// Lost frames, if the board numbers its frames.
    pub lost_frames: u64,
    /// Gaps without readings.
    pub gaps: u64,
}

/// Session of a locator.
pub struct Session<'a> {
    locator: &'a Locator,
    channels: Vec<Channel>,
    extent: Extent,
    frames: FrameReader,
    timeline: Timeline,
    taring: Taring,
    estimation: EstimationState,
    contact: ContactWatch,
    health: HealthWatch,
    repeats: RepeatWatch,
    lost_frames: u64,
    gaps: u64,
    number: u64,
    was_untouched: bool,
}

impl<'a> Session<'a> {
    /// Session.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn new(locator: &'a Locator, config: &SessionConfig) -> Result<Self, SessionError> {
        let channels = Channel::all_of(&locator.setup);
        let extent = locator.setup.surface().extent();
        Ok(Self {
            locator,
            extent,
            frames: FrameReader::new(&channels),
            timeline: Timeline::default(),
            taring: Taring::new(locator, config.tare, &config.estimation),
            estimation: EstimationState::new(&config.estimation, locator)?,
            contact: ContactWatch::new(extent),
            health: HealthWatch::new(locator.setup.layout()),
            repeats: RepeatWatch::new(channels.len()),
            lost_frames: 0,
            gaps: 0,
            number: 0,
            was_untouched: false,
            channels,
        })
    }

    /// Names the values of unnamed frames: channels, time (`t`, `ms`, `us`), sequence number (`n`); others are
    /// ignored.
    ///
    /// # Errors
    /// [`ColumnsError`].
    pub fn set_columns(&mut self, columns: &[String]) -> Result<(), ColumnsError> {
        self.frames.set_columns(columns)
    }

    /// Channels.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Counts of readings and frames.
    pub fn counters(&self) -> Counters {
        Counters {
            readings: self.frames.readings(),
            bad_frames: self.frames.bad_frames().clone(),
            lost_frames: self.lost_frames,
            gaps: self.gaps,
        }
    }

    /// Reader of the frames.
    pub fn frames(&self) -> &FrameReader {
        &self.frames
    }

    /// Health of each channel.
    pub fn health(&self) -> &[ChannelHealth] {
        self.health.channels()
    }

    /// Readings per second over the last second.
    pub fn rate_hz(&self) -> f64 {
        self.timeline.rate_hz()
    }

    /// Processes an arrival.
    pub fn receive(&mut self, arrived: &TimedArrival, out: &mut Vec<Output>) {
        let at = arrived.at;
        if let Some(by_s) = self.timeline.clock_step(at) {
            self.push_event(at, Event::ClockSet { by_s }, out);
        }
        match &arrived.arrival {
            Arrival::Opened(name) | Arrival::Joined(name) | Arrival::Piped(name) => {
                self.estimation.interrupt();
                if matches!(arrived.arrival, Arrival::Piped(_)) {
                    self.timeline.follow_board();
                }
                self.push_event(at, Event::SourceOpened { name: name.clone() }, out);
            }
            Arrival::Lost(why) => self.push_event(at, Event::SourceLost { why: why.clone() }, out),
            Arrival::Backlog(_) | Arrival::Bytes(_) | Arrival::Message(_) | Arrival::Ended => {}
        }
        let frames = self.frames.receive(&arrived.arrival);
        let behind = (0..frames.len()).rev();
        frames.into_iter().zip(behind).for_each(|(frame, behind)| self.take(at, frame, behind, out));
        if arrived.arrival == Arrival::Ended {
            self.push_event(at, Event::SourceEnded, out);
        }
    }

    /// Executes a command.
    pub fn command(&mut self, at: Stamp, command: Command, out: &mut Vec<Output>) {
        match command {
            Command::Tare => self.taring.begin(),
            Command::Mark(text) => self.push_event(at, Event::Mark { text }, out),
            Command::Trouble(text) => self.push_event(at, Event::Trouble { text }, out),
            Command::Alarm { name, text } => self.push_event(at, Event::Alarm { name, text }, out),
        }
    }

    /// Processes a reading; `behind` more readings arrived with it.
    fn take(&mut self, at: Stamp, frame: Frame, behind: usize, out: &mut Vec<Output>) {
        let at = self.timeline.board_stamp(at, frame.device_time);
        let (unix_ns, gap) = self.timeline.next(at, &frame, behind);
        if let Some(gap) = gap {
            if gap.kind == GapKind::Silence {
                self.estimation.interrupt();
            }
            self.gaps += 1;
            self.lost_frames += u64::from(gap.lost_frames.unwrap_or(0));
            self.push_event(at, Event::Gap { seconds: gap.seconds, lost_frames: gap.lost_frames }, out);
        }
        let time_s = unix_ns as f64 * 1e-9;
        self.health.add(&frame.reading, |event| out.push(Output::Event(EventRecord { time_s, event })));
        let is_repeat = self.watch_repeats(time_s, &frame.reading, out);
        let mut tared = frame.reading.clone();
        self.taring.note_time(time_s);
        // The baseline follows unfiltered readings, because a filtered reading would show a contact late.
        let single = if is_repeat {
            let single = self.taring.locate_repeat(self.locator, &frame.reading, &mut tared);
            single.map(|single| (single, false))
        } else {
            self.taring.locate(self.locator, &frame.reading, &mut tared)
        };
        let located = single.and_then(|(single, tares)| {
            let state = &mut self.estimation;
            let estimate = state.estimate(self.locator, unix_ns, &frame.reading, &mut tared, single)?;
            Some((estimate, tares, single.status == Status::NoContact))
        });
        let Some((estimate, tares, is_untouched)) = located else {
            // Very large values have a difference that is not finite.
            self.frames.refuse(BadFrame::NotANumber);
            return;
        };
        if tares {
            out.push(Output::Event(EventRecord { time_s, event: Event::Tared }));
        }
        self.contact
            .add(at.elapsed, &estimate, |event| out.push(Output::Event(EventRecord { time_s, event })));
        if is_untouched && self.was_untouched && !is_repeat {
            self.health.learn_noise();
        }
        self.was_untouched = is_untouched;
        let number = self.number;
        self.number += 1;
        let reading = frame.reading;
        out.push(Output::Sample(Box::new(Sample {
            number,
            unix_ns,
            arrived: at.elapsed,
            reading,
            tared,
            estimate,
        })));
    }

    /// True for a repeated reading, if the board sends faster than it measures.
    fn watch_repeats(&mut self, time_s: f64, reading: &[f64], out: &mut Vec<Output>) -> bool {
        let before = self.repeats.is_sample_and_hold();
        let is_repeat = self.repeats.add(reading, self.was_untouched);
        if self.repeats.is_sample_and_hold() && !before {
            let text = REPEATED_READINGS.to_owned();
            out.push(Output::Event(EventRecord { time_s, event: Event::Trouble { text } }));
        }
        is_repeat
    }

    fn push_event(&self, at: Stamp, event: Event, out: &mut Vec<Output>) {
        let time_s = self.timeline.unix_ns(at) as f64 * 1e-9;
        out.push(Output::Event(EventRecord { time_s, event }));
    }

    /// True if the surface is touched.
    pub fn is_touched(&self) -> bool {
        self.contact.is_touched()
    }

    /// Extent of the surface.
    pub fn extent(&self) -> Extent {
        self.extent
    }
}

fn touches(status: Status) -> bool {
    matches!(status, Status::Located | Status::Ambiguous)
}
