//! Bytes of a file or of stdin as they arrive. A signal ends the wait for them.

use crate::failure::{Complaint, Failure};
use crate::progress;
use crate::remark::remark;
use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// Bytes of a source. A separate thread reads them, as a blocking read cannot be cancelled.
pub struct Chunks {
    /// Name of the source: the file, or "stdin".
    pub name: String,
    /// Messages of the reading thread: an empty one after the source is opened, then chunks until the end.
    chunks: Receiver<io::Result<Vec<u8>>>,
}

/// Largest size of a chunk, in bytes.
const CHUNK: usize = 1 << 16;
/// Number of chunks that are read ahead.
const AHEAD: usize = 4;
/// Interval between two checks for a signal.
const LOOK: Duration = Duration::from_millis(50);

impl Chunks {
    /// Opens a file; `-` is stdin.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        if path != Path::new("-") {
            return Self::of_file(path);
        }
        if io::stdin().is_terminal() {
            remark!("palpate: reading from the keyboard; Ctrl-D ends it");
        }
        Self::read(None, "stdin".to_owned())
    }

    /// Opens a file, also one with the name `-`.
    pub fn of_file(path: &Path) -> Result<Self, Failure> {
        Self::read(Some(path.to_owned()), path.display().to_string())
    }

    fn read(path: Option<PathBuf>, name: String) -> Result<Self, Failure> {
        let (sender, chunks) = sync_channel(AHEAD);
        let reader = std::thread::Builder::new().spawn(move || send_all(path, &sender));
        reader.map_err(|error| Complaint::new(format!("cannot read {name}: {error}")))?;
        let mut opened = Self { name, chunks };
        opened.next()?;
        Ok(opened)
    }

    /// The next bytes, at least one; `None` after the last.
    ///
    /// # Errors
    /// A complaint if the source cannot be read, and [`Failure::Interrupted`] after a signal.
    pub fn next(&mut self) -> Result<Option<Vec<u8>>, Failure> {
        loop {
            if progress::interrupted() {
                return Err(Failure::stopped());
            }
            match self.chunks.recv_timeout(LOOK) {
                Ok(Ok(chunk)) => return Ok(Some(chunk)),
                Ok(Err(error)) => return Err(unreadable(&self.name, &error)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
            }
        }
    }

    /// All bytes of a text up to its end. A zero byte is an error except in UTF-16 with a byte-order mark: a device without an end
    /// has zero bytes.
    pub fn read_to_end(mut self) -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        while let Some(chunk) = self.next()? {
            let begins: &[u8] = if bytes.is_empty() { &chunk } else { &bytes };
            let is_utf16 = begins.starts_with(b"\xff\xfe") || begins.starts_with(b"\xfe\xff");
            if let Some(at) = chunk.iter().position(|byte| *byte == 0).filter(|_| !is_utf16) {
                let complaint = format!("{} is not text: byte {} is 0", self.name, bytes.len() + at + 1);
                return Err(Complaint::new(complaint).help("save it as UTF-8").into());
            }
            bytes.extend(chunk);
        }
        Ok(bytes)
    }
}

/// Sends an empty chunk after the source is opened, then all of its bytes; without a path, those of stdin.
fn send_all(path: Option<PathBuf>, to: &SyncSender<io::Result<Vec<u8>>>) {
    let source: io::Result<Box<dyn Read>> = match path {
        None => Ok(Box::new(io::stdin().lock())),
        Some(path) => File::open(path).map(|file| Box::new(file) as Box<dyn Read>),
    };
    let mut source = match source {
        Ok(source) => source,
        Err(error) => return drop(to.send(Err(error))),
    };
    // The reading ends if the receiver is gone.
    let mut listens = to.send(Ok(Vec::new())).is_ok();
    let mut buffer = vec![0; CHUNK];
    while listens {
        match source.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => listens = to.send(Ok(buffer[..count].to_vec())).is_ok(),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return drop(to.send(Err(error))),
        }
    }
}

/// The complaint that a source cannot be read.
fn unreadable(name: &str, error: &io::Error) -> Failure {
    let complaint = Complaint::new(format!("cannot read {name}: {error}"));
    match error.kind() {
        io::ErrorKind::NotFound => {
            complaint.help("check the name; it is taken from the current folder").into()
        }
        _ => complaint.into(),
    }
}
