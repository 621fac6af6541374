use super::recorder::{describe, options};
use super::{Playback, RecordingError, SkippedData};
use mcap::McapError;
use mcap::records::MessageHeader;
use palpate_files as whole_file;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Result of a recovery.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovery {
    /// Readings in the new file.
    pub readings: u64,
    /// Messages in the new file, with readings.
    pub messages: u64,
    /// True if the old file has a complete end.
    pub was_whole: bool,
    /// Fault that prevents a locator.
    pub locator_fault: Option<String>,
    /// Lost parts of the old file.
    pub skipped: SkippedData,
}

/// Copies readable messages into a new file.
///
/// # Errors
/// Not a recording, or a failed write.
pub fn recover(from: &Path, to: &Path) -> Result<Recovery, RecordingError> {
    let mut playback = Playback::open(from)?;
    let mut recovery = None;
    let written = whole_file::write_with(to, |file| {
        recovery = Some(copy(&mut playback, file).map_err(io_error)?);
        Ok(())
    });
    let failed = |error| RecordingError::File { verb: "write", path: to.display().to_string(), error };
    written.map_err(failed)?;
    recovery.ok_or_else(|| failed(std::io::ErrorKind::WriteZero.into()))
}

fn io_error(error: CopyError) -> std::io::Error {
    match error {
        CopyError::Write(McapError::Io(error)) => error,
        other => std::io::Error::other(other),
    }
}

#[derive(Debug, thiserror::Error)]
enum CopyError {
    #[error(transparent)]
    Read(#[from] RecordingError),
    #[error(transparent)]
    Write(#[from] McapError),
}

fn copy(playback: &mut Playback, file: &mut File) -> Result<Recovery, CopyError> {
    let (locator, locator_fault) = match playback.locator() {
        Ok(locator) => (Some(locator), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let mut writer = options(&playback.head().version).create(BufWriter::new(file))?;
    let topics = describe(&mut writer, playback.head(), locator)?;
    let (mut readings, mut messages) = (0, 0);
    while let Some(message) = playback.next_message()? {
        let time = message.unix_ns;
        let (channel_id, sequence) = (topics[message.topic], message.sequence);
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &message.data)?;
        messages += 1;
        readings += u64::from(message.topic == 0);
    }
    writer.finish()?;
    let (was_whole, passed_over) = (playback.is_whole(), playback.skipped().clone());
    Ok(Recovery { readings, messages, was_whole, locator_fault, skipped: passed_over })
}
