//! Inputs of a session.

use crate::stamp::Stamp;

/// Input of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// Arrival.
    Arrived(TimedArrival),
    /// Command.
    Command(Command),
    /// End of the session.
    Stop,
}

/// Arrival of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Opened device, at the start of a frame.
    Opened(String),
    /// Opened device, amid a frame.
    Joined(String),
    /// Opened stream of any rate, with the times of the board's clock.
    Piped(String),
    /// Outdated bytes from before the opening.
    Backlog(Vec<u8>),
    /// Bytes of a stream.
    Bytes(Vec<u8>),
    /// Whole frames, as from UDP and MQTT.
    Message(Vec<u8>),
    /// Lost device with the cause.
    Lost(String),
    /// End of the source.
    Ended,
}

/// Arrival with its instant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimedArrival {
    /// Instant of the last byte.
    pub at: Stamp,
    /// Arrival.
    pub arrival: Arrival,
}

/// Command of a user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Tare with the next readings.
    Tare,
    /// Set a mark.
    Mark(String),
    /// Report a failure or recovery of an output.
    Trouble(String),
    /// Raise an alarm.
    Alarm {
        /// Rule.
        name: String,
        /// Text.
        text: String,
    },
}
