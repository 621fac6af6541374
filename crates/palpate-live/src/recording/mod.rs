//! Recordings of sessions: MCAP files for Foxglove and other readers.
//!
//! Topics are `/reading`, `/estimate` and `/event` in JSON, with the locator as attachment. Cut-off files are
//! readable.

mod head;
mod mcap_file;
mod reader;
mod recorder;
mod recover;
mod switch;
mod tail;
mod unpack;
mod whole_record;

pub use head::{Head, RecordedChannel};
pub use reader::{Excerpt, Playback, Recorded, RecordingSummary, SkippedData, list, read, summary};
pub use recorder::{Recorder, RecordingStatus};
pub use recover::{Recovery, recover};
pub use switch::{RecordingSwitch, check_name};
pub use unpack::BlockFault;

/// File extension of recordings.
pub const EXTENSION: &str = "mcap";

/// Fault of an attached locator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocatorFault {
    /// No attachment.
    #[error("no `locator.json` is attached")]
    Missing,
    /// The file ends too early.
    #[error("the file is cut off before its attached `locator.json`")]
    CutOff,
    /// Damaged bytes.
    #[error("the attached `locator.json` is damaged: its bytes do not match their checksum and lengths")]
    Damaged,
}

/// Error of a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be created, opened or read.
    #[error("cannot {verb} {path}: {error}")]
    File {
        /// Action.
        verb: &'static str,
        /// File.
        path: String,
        /// Cause.
        error: std::io::Error,
    },
    /// The file exists.
    #[error("cannot record into {path}: it exists already; name another file")]
    Exists {
        /// File.
        path: String,
    },
    /// Invalid name.
    #[error(
        "`{name}` is not a name of a recording: use at most 100 letters, digits, dots, dashes and underscores, and do not start with a dot"
    )]
    Name {
        /// Name.
        name: String,
    },
    /// Link, pipe, device or folder.
    #[error("{path} is not a regular file")]
    NotRegular {
        /// File.
        path: String,
    },
    /// Another recording is active.
    #[error("{name} is being recorded; end it first")]
    GoesOn {
        /// Active recording.
        name: String,
    },
    /// Not an MCAP file.
    #[error("{path} is not an MCAP file")]
    NotMcap {
        /// File.
        path: String,
    },
    /// Not a recording of palpate.
    #[error("{path} is not a recording of palpate: {lacks}")]
    NotOurs {
        /// File.
        path: String,
        /// Missing part.
        lacks: &'static str,
    },
    /// The locator is unreadable; readings are available.
    #[error("{path}: {fault}")]
    Locator {
        /// File.
        path: String,
        /// Fault.
        fault: LocatorFault,
    },
    /// A record cannot be encoded.
    #[error("cannot encode the recording: {0}")]
    Encode(String),
}
