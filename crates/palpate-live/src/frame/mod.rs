//! Frames: the bytes that a board sends for one reading.

mod binary;
mod channel;
mod decoder;
mod json;
mod names;
mod text;

pub use binary::encode_into;
pub use channel::Channel;
pub use decoder::{ColumnsError, Decoder};
pub(crate) use names::is_reserved;

use std::time::Duration;

/// A frame that has been decoded.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// One finite value a channel, in SI units or raw.
    pub reading: Vec<f64>,
    /// Number that the board counts its frames by, where it does; it may wrap around.
    pub sequence: Option<u32>,
    /// Time by the board's clock, where it tells it.
    pub device_time: Option<Duration>,
}

/// Cause for which a frame is no reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BadFrame {
    /// More bytes than a frame can have, without an end.
    TooLong,
    /// Another number of values than channels.
    Channels,
    /// A channel that the names do not have.
    MissingChannel,
    /// A value that is no finite number.
    NotANumber,
    /// Bytes that are neither text nor a binary frame.
    Encoding,
    /// A checksum that is not that of the bytes.
    Checksum,
    /// A binary frame of a length or a type that is none.
    Malformed,
}

impl BadFrame {
    /// All causes.
    pub const ALL: [Self; 7] = [
        Self::TooLong,
        Self::Channels,
        Self::MissingChannel,
        Self::NotANumber,
        Self::Encoding,
        Self::Checksum,
        Self::Malformed,
    ];

    /// In words.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::TooLong => "longer than any frame",
            Self::Channels => "another number of values than channels",
            Self::MissingChannel => "a channel is missing",
            Self::NotANumber => "a value is no number",
            Self::Encoding => "not text",
            Self::Checksum => "the checksum is wrong",
            Self::Malformed => "not a frame",
        }
    }

    /// Words about a source of whose frames none is a reading: their number, the labels of the channels, this cause, and what to do.
    pub fn explain_no_reading<'a>(self, frames: u64, labels: impl IntoIterator<Item = &'a str>) -> String {
        let labels: Vec<&str> = labels.into_iter().collect();
        format!(
            "none of {frames} frames is a reading of the channels `{}`: {}; name them in the rig as the board does, or in columns= of the source",
            labels.join("`, `"),
            self.describe()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Channel;
    use palpate_mechanics::units::Unit;

    /// Raw channels of these labels, of sensors s1, s2, …
    pub fn channels(labels: &[&str]) -> Vec<Channel> {
        let channel = |(i, label): (usize, &&str)| Channel {
            name: format!("s{}", i + 1),
            label: (*label).to_owned(),
            unit: Unit::NONE,
        };
        labels.iter().enumerate().map(channel).collect()
    }
}
