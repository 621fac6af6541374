//! Appended file with a buffer for a full disk.

use super::RecordingError;
use std::fs::{File, Metadata};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

#[derive(Debug)]
pub struct Tail {
    file: File,
    path: PathBuf,
    identity: Option<(u64, u64)>,
    written: u64,
    pending: Vec<u8>,
}

impl Tail {
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let shown = || path.display().to_string();
        let file = File::create_new(path).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => RecordingError::Exists { path: shown() },
            _ => RecordingError::File { verb: "make", path: shown(), error },
        })?;
        let identity = file.metadata().ok().as_ref().and_then(identity);
        Ok(Self { file, path: path.to_owned(), identity, written: 0, pending: Vec::new() })
    }

    pub fn bytes(&self) -> u64 {
        self.written
    }

    pub fn waiting(&self) -> usize {
        self.pending.len()
    }

    pub fn push(&mut self, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
    }

    /// Writes the waiting bytes, and keeps the rest on errors.
    pub fn write(&mut self) -> std::io::Result<()> {
        let mut done = 0;
        let result = loop {
            match self.file.write(&self.pending[done..]) {
                _ if done == self.pending.len() => break Ok(()),
                Ok(0) => break Err(ErrorKind::WriteZero.into()),
                Ok(count) => done += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => break Err(error),
            }
        };
        self.pending.drain(..done);
        self.written += done as u64;
        result
    }

    /// False if the file or its folder was removed.
    pub fn is_there(&self) -> bool {
        match std::fs::metadata(&self.path) {
            Ok(found) => self.identity.is_none() || identity(&found) == self.identity,
            Err(error) => error.kind() != ErrorKind::NotFound,
        }
    }
}

#[cfg(unix)]
#[expect(clippy::unnecessary_wraps, reason = "other systems have none")]
fn identity(file: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((file.dev(), file.ino()))
}

#[cfg(not(unix))]
fn identity(_: &Metadata) -> Option<(u64, u64)> {
    None
}
