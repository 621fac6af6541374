//! Inputs of a session: what sources and users bring.

use crate::stamp::Stamp;

/// Input of a session's thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// An arrival of a source.
    Arrived(Arrived),
    /// A user's wish.
    Command(Command),
    /// The session is to end.
    Stop,
}

/// Arrival of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The device is there, and its bytes begin with a frame; its name.
    Opened(String),
    /// The device is there, and sends already: its bytes may begin amid a frame; its name.
    Joined(String),
    /// The stream is there, and comes at any pace, as through a pipe: its readings have the times of the board's clock, where it tells them; its name.
    Piped(String),
    /// Bytes of a stream that waited when it was opened: old readings.
    Backlog(Vec<u8>),
    /// Bytes of a stream, in order, cut anywhere.
    Bytes(Vec<u8>),
    /// Bytes of a message, as of UDP and MQTT: whole frames.
    Message(Vec<u8>),
    /// The device went away, and is looked for again; the reason.
    Lost(String),
    /// There will be no more.
    Ended,
}

/// An arrival with its instant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// The instant at which its last byte was there.
    pub at: Stamp,
    /// Kind, with the bytes.
    pub arrival: Arrival,
}

/// Wish of a user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Take the next readings for untouched.
    Tare,
    /// Set a mark.
    Mark(String),
    /// Tell that something beside the session does not work, or works again.
    Trouble(String),
    /// Raise an alarm.
    Alarm {
        /// Name of the rule.
        name: String,
        /// Text.
        text: String,
    },
}
