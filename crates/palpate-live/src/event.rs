//! Events of a session.

use palpate_estimators::estimate_record::ContactRecord;
use serde::Serialize;

/// Event with its time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// Unix time in seconds.
    pub time_s: f64,
    /// Event.
    #[serde(flatten)]
    pub event: Event,
}

/// Event of a session.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The source was opened.
    SourceOpened {
        /// Name.
        name: String,
    },
    /// The source was lost; reconnection continues.
    SourceLost {
        /// Cause.
        why: String,
    },
    /// The source has ended.
    SourceEnded,
    /// Readings are missing.
    Gap {
        /// Seconds without a reading.
        seconds: f64,
        /// Lost frames, if the board counts them.
        #[serde(skip_serializing_if = "Option::is_none")]
        lost_frames: Option<u32>,
    },
    /// The wall clock was set.
    ClockSet {
        /// Change in seconds.
        by_s: f64,
    },
    /// A contact began.
    TouchDown {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// A contact moved by more than its uncertainty.
    Move {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// The contact has ended.
    LiftOff {
        /// Duration in seconds.
        seconds: f64,
    },
    /// Reading that no single contact explains.
    OutsideModel,
    /// Second contact.
    SecondContact {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// A channel changed its state.
    Channel {
        /// Name.
        name: String,
        /// New state.
        state: ChannelState,
    },
    /// A tare has set the baseline.
    Tared,
    /// An output has failed, or works again.
    Trouble {
        /// Problem and cause.
        text: String,
    },
    /// A rule has raised an alarm.
    Alarm {
        /// Rule.
        name: String,
        /// Text.
        text: String,
    },
    /// Mark of a user.
    Mark {
        /// Text.
        text: String,
    },
}

impl Event {
    /// Name in records.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::SourceOpened { .. } => "source_opened",
            Self::SourceLost { .. } => "source_lost",
            Self::SourceEnded => "source_ended",
            Self::Gap { .. } => "gap",
            Self::ClockSet { .. } => "clock_set",
            Self::TouchDown { .. } => "touch_down",
            Self::Move { .. } => "move",
            Self::LiftOff { .. } => "lift_off",
            Self::OutsideModel => "outside_model",
            Self::SecondContact { .. } => "second_contact",
            Self::Channel { .. } => "channel",
            Self::Tared => "tared",
            Self::Trouble { .. } => "trouble",
            Self::Alarm { .. } => "alarm",
            Self::Mark { .. } => "mark",
        }
    }
}

/// State of a channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChannelState {
    /// Works.
    #[default]
    Well,
    /// Repeats one value while others change.
    Dead,
    /// Reads the end of its range.
    Saturated,
}
