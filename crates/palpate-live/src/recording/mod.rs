//! Recordings of sessions: MCAP files, which Foxglove and the official readers open.
//!
//! A recording holds what the board sent (`/reading`), what was made of it (`/estimate`) and what happened (`/event`), all as JSON with
//! schemas, and the locator as an attachment, so that nothing that a later look at it needs is outside the file. A file that was cut off
//! anywhere is read up to there.

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

/// End of the names of recordings.
pub const EXTENSION: &str = "mcap";

/// Fault of the locator that is attached to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocatorFault {
    /// None is attached.
    #[error("no `locator.json` is attached")]
    Missing,
    /// The file ends before it.
    #[error("the file is cut off before its attached `locator.json`")]
    CutOff,
    /// Its bytes are others than were written.
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
        /// Why.
        error: std::io::Error,
    },
    /// The file is there already, and is not written over.
    #[error("cannot record into {path}: it is there already; name another file")]
    Exists {
        /// The file.
        path: String,
    },
    /// A name that a recording cannot have.
    #[error(
        "`{name}` is no name of a recording: at most 100 letters, digits, dots, dashes and underscores, of which a dot is not the first"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// A link, a pipe, a device or a folder has the name of a recording.
    #[error("{path} is no regular file")]
    NotRegular {
        /// The file.
        path: String,
    },
    /// A recording is going on, and another cannot be begun.
    #[error("{name} is being recorded; end it first")]
    GoesOn {
        /// Name.
        name: String,
    },
    /// The file is not MCAP.
    #[error("{path} is no MCAP file")]
    NotMcap {
        /// The file.
        path: String,
    },
    /// The file is MCAP, but not a recording of palpate.
    #[error("{path} is no recording of palpate: {lacks}")]
    NotOurs {
        /// The file.
        path: String,
        /// The missing part.
        lacks: &'static str,
    },
    /// Its locator cannot be had from it; its readings can.
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
