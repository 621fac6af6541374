//! Events of a session.

use palpate_estimators::estimate_record::ContactRecord;
use serde::Serialize;

/// An event with its time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// Seconds since 1970-01-01 00:00 UTC.
    pub time_s: f64,
    /// The event itself.
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
    /// The source went away, and is tried again.
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
        /// Frames that the board sent in the meantime, if it counts them.
        #[serde(skip_serializing_if = "Option::is_none")]
        lost_frames: Option<u32>,
    },
    /// The wall clock was set.
    ClockSet {
        /// Change in seconds, forward where positive.
        by_s: f64,
    },
    /// A contact began.
    TouchDown {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// A contact has moved by more than its uncertainty.
    Move {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// The contact has ended.
    LiftOff {
        /// Duration of the contact in seconds.
        seconds: f64,
    },
    /// A second contact began, or a reading that cannot be distinguished from one.
    OutsideModel,
    /// Contacts beside the first.
    SecondContact {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// The state of a channel has changed.
    Channel {
        /// Name.
        name: String,
        /// State now.
        state: ChannelState,
    },
    /// The baseline was set by a tare.
    Tared,
    /// A recording, a broker or another part beside the session has failed, or works again.
    Trouble {
        /// Problem and cause.
        text: String,
    },
    /// A rule has raised an alarm.
    Alarm {
        /// Name of the rule.
        name: String,
        /// Text.
        text: String,
    },
    /// A mark of a user.
    Mark {
        /// Text.
        text: String,
    },
}

impl Event {
    /// Name of the event in records.
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
    /// The channel works.
    #[default]
    Well,
    /// The channel repeats one value while others change.
    Dead,
    /// The channel reads the end of its range.
    Saturated,
}
