//! Recordings of sessions: MCAP files, which Foxglove and the official readers open.
//!
//! A recording contains the readings of the board (`/reading`), their estimates (`/estimate`) and the events of the session (`/event`), all as
//! JSON with schemas. The locator is an attachment, so the file is sufficient for a later evaluation. A file that was cut off is read up to the
//! cut.

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
pub use reader::{Excerpt, PassedOver, Playback, Recorded, RecordingSummary, list, read, summary};
pub use recorder::{Recorder, RecordingStatus};
pub use recover::{Recovery, recover};
pub use switch::{RecordingSwitch, check_name};
pub use unpack::BlockFault;

/// File extension of recordings.
pub const EXTENSION: &str = "mcap";

/// Fault of the locator that is attached to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocatorFault {
    /// The recording has no attached locator.
    #[error("no `locator.json` is attached")]
    Missing,
    /// The file ends before the attachment.
    #[error("the file is cut off before its attached `locator.json`")]
    CutOff,
    /// The bytes of the attachment differ from those that were written.
    #[error("the attached `locator.json` is damaged: its bytes do not match their checksum and lengths")]
    Damaged,
}

/// A recording that cannot be made or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be made, opened or read.
    #[error("cannot {verb} {path}: {error}")]
    File {
        /// The action that failed.
        verb: &'static str,
        /// The file.
        path: String,
        /// Cause.
        error: std::io::Error,
    },
    /// The file exists already, and is not overwritten.
    #[error("cannot record into {path}: it exists already; name another file")]
    Exists {
        /// The file.
        path: String,
    },
    /// A name that a recording cannot have.
    #[error(
        "`{name}` is not a name of a recording: use at most 100 letters, digits, dots, dashes and underscores, and do not start with a dot"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// A link, a pipe, a device or a folder has the name of a recording.
    #[error("{path} is not a regular file")]
    NotRegular {
        /// The file.
        path: String,
    },
    /// A recording is active, and a second one cannot begin.
    #[error("{name} is being recorded; end it first")]
    GoesOn {
        /// Name of the active recording.
        name: String,
    },
    /// The file is not MCAP.
    #[error("{path} is not an MCAP file")]
    NotMcap {
        /// The file.
        path: String,
    },
    /// The file is MCAP, but not a recording of palpate.
    #[error("{path} is not a recording of palpate: {lacks}")]
    NotOurs {
        /// The file.
        path: String,
        /// The missing part.
        lacks: &'static str,
    },
    /// The locator of the recording cannot be read; its readings can.
    #[error("{path}: {fault}")]
    Locator {
        /// The file.
        path: String,
        /// The fault.
        fault: LocatorFault,
    },
    /// The record cannot be written in MCAP.
    #[error("cannot encode the recording: {0}")]
    Encode(String),
}
