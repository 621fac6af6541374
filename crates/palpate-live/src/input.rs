//! Inputs of a session, from sources and users.

use crate::stamp::Stamp;

/// Input of a session's thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// An arrival of a source.
    Arrived(Arrived),
    /// A command of a user.
    Command(Command),
    /// The session is to end.
    Stop,
}

/// Arrival of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The device with this name was opened, and its bytes begin with a frame.
    Opened(String),
    /// The device with this name was opened while it sends: its bytes may begin amid a frame.
    Joined(String),
    /// The stream with this name was opened, and comes at any pace, as through a pipe. The readings have the times of the board's clock, if the frames
    /// contain them.
    Piped(String),
    /// Bytes of a stream that waited before it was opened: old readings.
    Backlog(Vec<u8>),
    /// Bytes of a stream, in order, split at any place.
    Bytes(Vec<u8>),
    /// Bytes of a message, as from UDP and MQTT: whole frames.
    Message(Vec<u8>),
    /// The device went away, with the cause, and is tried again.
    Lost(String),
    /// The source has ended.
    Ended,
}

/// An arrival with its instant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// Instant of the last byte.
    pub at: Stamp,
    /// Kind of the arrival, with its bytes.
    pub arrival: Arrival,
}

/// Command of a user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Tare: the next readings are untouched.
    Tare,
    /// Set a mark.
    Mark(String),
    /// Report that a part beside the session has failed, or works again.
    Trouble(String),
    /// Raise an alarm.
    Alarm {
        /// Name of the rule.
        name: String,
        /// Text.
        text: String,
    },
}
