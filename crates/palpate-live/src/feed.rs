//! Detection of a source without readings.

use crate::frame::{FrameReader, quote};
use crate::input::Arrival;
use std::time::Duration;

/// Message about a source that repeats readings.
pub const REPEATED_READINGS: &str =
    "the board repeats readings: it sends faster than its sensors measure; each reading counts once";
/// Consecutive bad frames, and time without readings, that are reported: starting boards print text, and
/// serial lines tear frames.
const FRAMES: u64 = 5;
const FRAMES_FOR: Duration = Duration::from_secs(1);
/// Reported after any time, because a stream may have any rate.
const MANY_FRAMES: u64 = 100;
/// Reported silence, longer than the start of a board.
const SILENCE: Duration = Duration::from_secs(3);
const PERIODS: u32 = 5;

/// Monitor of a feed of readings.
#[derive(Debug, Default)]
pub struct FeedWatch {
    state: FeedState,
    since: Duration,
    last_reading: Option<Duration>,
    period: Duration,
    readings: u64,
    bytes: u64,
    /// A board may send messages only when a value changes.
    has_messages: bool,
    is_reported: bool,
}

#[derive(Debug, Default, PartialEq, Eq)]
enum FeedState {
    #[default]
    Away,
    Open,
    Ended,
    Lost(String),
}

impl FeedWatch {
    /// Adds an arrival that was processed by `now`.
    pub fn receive(&mut self, arrival: &Arrival, now: Duration, frames: &FrameReader) {
        match arrival {
            Arrival::Opened(_) | Arrival::Joined(_) | Arrival::Piped(_) => {
                *self =
                    Self { state: FeedState::Open, since: now, readings: self.readings, ..Self::default() };
            }
            Arrival::Lost(why) => self.state = FeedState::Lost(why.clone()),
            Arrival::Bytes(bytes) => self.bytes += bytes.len() as u64,
            Arrival::Message(bytes) => {
                self.has_messages = true;
                self.bytes += bytes.len() as u64;
            }
            Arrival::Ended if self.state == FeedState::Open => self.state = FeedState::Ended,
            Arrival::Backlog(_) | Arrival::Ended => {}
        }
        if frames.readings() > self.readings {
            self.readings = frames.readings();
            self.period = self.last_reading.map_or(Duration::ZERO, |last| now.saturating_sub(last));
            self.last_reading = Some(now);
            (self.since, self.bytes, self.is_reported) = (now, 0, false);
        }
    }

    /// Reports missing readings, once per gap.
    pub fn report(&mut self, now: Duration, frames: &FrameReader) -> Option<String> {
        let since = now.saturating_sub(self.since);
        let bad = frames.bad_in_a_row();
        let is_fault = matches!(self.state, FeedState::Open | FeedState::Ended)
            && (bad >= MANY_FRAMES
                || (bad >= FRAMES && since >= FRAMES_FOR)
                || (self.state == FeedState::Open && since >= SILENCE.max(PERIODS * self.period)));
        if !is_fault || self.is_reported {
            return None;
        }
        self.is_reported = true;
        Some(format!("no readings: {}", self.reason(frames)))
    }

    /// Fault of a feed without readings at its end.
    pub fn fault(&self, frames: &FrameReader) -> Option<String> {
        let is_cut_short = match &self.state {
            FeedState::Lost(_) => true,
            FeedState::Away => false,
            FeedState::Open | FeedState::Ended => {
                frames.bad_in_a_row() >= FRAMES
                    || (self.state == FeedState::Open && self.is_reported && !self.has_messages)
            }
        };
        match frames.readings() {
            0 => Some(format!("there was no reading: {}", self.reason(frames))),
            _ if is_cut_short => Some(format!("the readings ended early: {}", self.reason(frames))),
            _ => None,
        }
    }

    fn reason(&self, frames: &FrameReader) -> String {
        match &self.state {
            FeedState::Lost(why) => return why.clone(),
            FeedState::Away => return "the source did not open".to_owned(),
            FeedState::Open | FeedState::Ended => {}
        }
        let bad = frames.bad_in_a_row();
        if let Some((cause, frame)) = frames.last_bad_frame().filter(|_| bad > 0) {
            let (cause, remedy) = (cause.describe(), cause.remedy(frames.labels()));
            let are_not =
                if bad == 1 { "frame is not a reading" } else { "frames in a row are not readings" };
            return format!("{bad} {are_not}: {cause}; the last is `{frame}`; {remedy}");
        }
        if self.bytes > 0 {
            let (bytes, last) = (self.bytes, quote(frames.unfinished()));
            return format!("{bytes} bytes without the end of a line: `{last}`; check the baud rate");
        }
        if self.state == FeedState::Ended {
            return "the source ended; check what sends to it".to_owned();
        }
        "the source is connected but sends no data; check that the board is on and sends to this port"
            .to_owned()
    }
}
