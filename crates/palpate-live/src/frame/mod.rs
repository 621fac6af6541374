//! Frames: the bytes that a board sends for one reading.

mod text;

pub use text::TextDecoder;

use palpate_estimators::recording::Column;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::Unit;
use std::time::Duration;

/// Channel of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of its sensor.
    pub name: String,
    /// Name by which a board calls it: the column of the recordings that the locator learnt from, where that has a name.
    pub label: String,
    /// Unit of the board's numbers: that of the recordings.
    pub unit: Unit,
}

impl Channel {
    /// Channels of the boards of a setup, in the order of its sensors.
    pub fn all_of(setup: &Setup) -> Vec<Self> {
        let columns = setup.recording_columns().channels;
        let sensors = setup.layout().sensors().iter();
        sensors
            .zip(columns)
            .map(|(sensor, column)| Self {
                name: sensor.name.clone(),
                label: match column.column {
                    Column::Name(label) => label,
                    Column::Number(_) => sensor.name.clone(),
                },
                unit: column.unit,
            })
            .collect()
    }
}

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
}
