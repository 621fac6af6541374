//! Frames: the bytes that a board sends for one reading.

mod binary;
mod channel;
mod decoder;
mod json;
mod names;
mod printed;
mod quote;
mod reader;
mod text;

pub use binary::encode_into;
pub use channel::Channel;
pub use decoder::{ColumnsError, Decoder, LONGEST_MESSAGE};
pub(crate) use names::is_reserved;
pub use quote::quote;
pub use reader::FrameReader;

use std::time::Duration;

/// Decoded frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// One finite value per channel, in SI units or raw.
    pub reading: Vec<f64>,
    /// Sequence number, which may wrap around.
    pub sequence: Option<u32>,
    /// Time by the clock of the board.
    pub device_time: Option<Duration>,
}

/// Cause of a bad frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BadFrame {
    /// Too many bytes without an end.
    TooLong,
    /// Wrong number of values.
    Channels,
    /// Missing channel.
    MissingChannel,
    /// A value that is not finite.
    NotANumber,
    /// Wrong unit.
    OtherUnit,
    /// Neither text nor a binary frame.
    Encoding,
    /// Wrong checksum.
    Checksum,
    /// Invalid length, type or JSON.
    Malformed,
}

impl BadFrame {
    /// All causes.
    pub const ALL: [Self; 8] = [
        Self::TooLong,
        Self::Channels,
        Self::MissingChannel,
        Self::NotANumber,
        Self::OtherUnit,
        Self::Encoding,
        Self::Checksum,
        Self::Malformed,
    ];

    /// Description.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::TooLong => "longer than any frame",
            Self::Channels => "another number of values than channels",
            Self::MissingChannel => "a channel is missing",
            Self::NotANumber => "a value is not a number",
            Self::OtherUnit => "a value has another unit than the previous one, or than the channel",
            Self::Encoding => "not text",
            Self::Checksum => "the checksum is wrong",
            Self::Malformed => "not a frame",
        }
    }

    /// Remedy for channels with these labels.
    pub fn remedy<'a>(self, labels: impl IntoIterator<Item = &'a str>) -> String {
        let labels: Vec<&str> = labels.into_iter().collect();
        let labels = labels.join("`, `");
        match self {
            Self::Channels => {
                format!("print one value for each of `{labels}`, or name the values in columns=")
            }
            Self::MissingChannel => {
                format!("name `{labels}` as the board does, in the rig or in columns= of the source")
            }
            Self::NotANumber => {
                format!("print a decimal number for each of `{labels}`, with commas between them")
            }
            Self::OtherUnit => "print all values of a channel in one unit".to_owned(),
            Self::TooLong => "end every reading with a line feed, and check the baud rate".to_owned(),
            Self::Encoding => "check the baud rate, or that the board sends text".to_owned(),
            Self::Checksum | Self::Malformed => {
                "check the wiring, and the frame against docs/reference/sources.md".to_owned()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Channel;
    use palpate_mechanics::units::Unit;

    pub fn channels(labels: &[&str]) -> Vec<Channel> {
        let channel = |(i, label): (usize, &&str)| Channel {
            name: format!("s{}", i + 1),
            label: (*label).to_owned(),
            unit: Unit::NONE,
        };
        labels.iter().enumerate().map(channel).collect()
    }
}
