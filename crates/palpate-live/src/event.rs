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
    /// The source is there.
    SourceOpened {
        /// Name.
        name: String,
    },
    /// The source went away, and is looked for again.
    SourceLost {
        /// Why.
        why: String,
    },
    /// The source has no more.
    SourceEnded,
    /// Readings are missing.
    Gap {
        /// Seconds without a reading.
        seconds: f64,
        /// Frames that the board sent in the meantime, where it counts them.
        #[serde(skip_serializing_if = "Option::is_none")]
        lost_frames: Option<u32>,
    },
    /// The wall clock was set.
    ClockSet {
        /// By so many seconds, forward where positive.
        by_s: f64,
    },
    /// Something touches.
    TouchDown {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// A contact has moved by more than is uncertain of it.
    Move {
        /// Position and force.
        #[serde(flatten)]
        contact: ContactRecord,
    },
    /// The contact has gone.
    LiftOff {
        /// Seconds since it was touched.
        seconds: f64,
    },
    /// A second contact came, or what cannot be distinguished from one.
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
    /// The baseline was taken anew.
    Tared,
    /// Something beside the session does not work, or works again: a recording, a broker.
    Trouble {
        /// What, and why.
        text: String,
    },
    /// A rule has raised an alarm.
    Alarm {
        /// Name of the rule.
        name: String,
        /// Text.
        text: String,
    },
    /// Somebody's mark.
    Mark {
        /// Text.
        text: String,
    },
}

impl Event {
    /// Its name, as records have it.
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
    /// It reads.
    #[default]
    Well,
    /// It reads one and the same value, whatever the others read.
    Dead,
    /// It reads the end of its range.
    Saturated,
}
