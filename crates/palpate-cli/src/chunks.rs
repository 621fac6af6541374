//! Byte chunks of a file or stdin, read by a thread that a signal can interrupt.

use crate::failure::{Failure, UserError};
use crate::progress;
use crate::remark::remark;
use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// Chunks of a source, read by a separate thread, as a blocking read cannot be cancelled.
pub struct Chunks {
    pub name: String,
    /// Messages of the reading thread: an empty one after the source is opened, then chunks until
    /// the end.
    chunks: Receiver<io::Result<Vec<u8>>>,
}

const CHUNK: usize = 1 << 16;
const AHEAD: usize = 4;
const LOOK: Duration = Duration::from_millis(50);

impl Chunks {
    pub fn open(path: &Path) -> Result<Self, Failure> {
        if path != Path::new("-") {
            return Self::of_file(path);
        }
        if io::stdin().is_terminal() {
            remark!("palpate: reading from the keyboard; Ctrl-D ends it");
        }
        Self::read(None, "stdin".to_owned())
    }

    pub fn of_file(path: &Path) -> Result<Self, Failure> {
        Self::read(Some(path.to_owned()), path.display().to_string())
    }

    fn read(path: Option<PathBuf>, name: String) -> Result<Self, Failure> {
        let (sender, chunks) = sync_channel(AHEAD);
        let reader = std::thread::Builder::new().spawn(move || send_all(path, &sender));
        reader.map_err(|error| UserError::new(format!("cannot read {name}: {error}")))?;
        let mut opened = Self { name, chunks };
        opened.next()?;
        Ok(opened)
    }

    /// Returns the next bytes, at least one; `None` after the last.
    ///
    /// # Errors
    /// [`UserError`] if the source cannot be read; [`Failure::Interrupted`] after a signal.
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

    /// Returns all bytes of a text. A zero byte is an error except in UTF-16 with a byte-order
    /// mark: an endless device sends zero bytes.
    pub fn read_to_end(mut self) -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        while let Some(chunk) = self.next()? {
            let begins: &[u8] = if bytes.is_empty() { &chunk } else { &bytes };
            let is_utf16 = begins.starts_with(b"\xff\xfe") || begins.starts_with(b"\xfe\xff");
            if let Some(at) = chunk.iter().position(|byte| *byte == 0).filter(|_| !is_utf16) {
                let message = format!("{} is not text: byte {} is 0", self.name, bytes.len() + at + 1);
                return Err(UserError::new(message).help("save it as UTF-8").into());
            }
            bytes.extend(chunk);
        }
        Ok(bytes)
    }
}

fn send_all(path: Option<PathBuf>, to: &SyncSender<io::Result<Vec<u8>>>) {
    let source: io::Result<Box<dyn Read>> = match path {
        None => Ok(Box::new(io::stdin().lock())),
        Some(path) => File::open(path).map(|file| Box::new(file) as Box<dyn Read>),
    };
    let mut source = match source {
        Ok(source) => source,
        Err(error) => return drop(to.send(Err(error))),
    };
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

fn unreadable(name: &str, error: &io::Error) -> Failure {
    let user_error = UserError::new(format!("cannot read {name}: {error}"));
    match error.kind() {
        io::ErrorKind::NotFound => {
            user_error.help("check the name; it is taken from the current folder").into()
        }
        _ => user_error.into(),
    }
}
