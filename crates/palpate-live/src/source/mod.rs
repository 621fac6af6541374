//! Sources of bytes: boards, networks, files, and a board that is simulated.

mod file;
mod simulated;
mod stdin;
mod url;

pub use file::line;
pub use url::{SourceUrl, SourceUrlError};

use crate::input::{Arrival, Arrived, Input};
use crate::stamp::HostClock;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;

/// A source that cannot be opened at all; one that merely is not there is waited for.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The rig of a simulated board cannot be read.
    #[error("cannot read {path}: {error}")]
    Rig {
        /// The rig's path.
        path: String,
        /// Why.
        error: String,
    },
    /// The rig of a simulated board cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] palpate_estimators::simulate::SimulateError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] crate::recording::RecordingError),
    /// There is no thread for it.
    #[error("no thread for the source: {0}")]
    Thread(#[from] std::io::Error),
}

/// An open source: a thread that brings arrivals until it is dropped.
#[derive(Debug)]
pub struct Source {
    stop: Arc<AtomicBool>,
}

impl Drop for Source {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Where a source's thread puts what it brings.
pub(crate) struct Outlet {
    to: SyncSender<Input>,
    clock: HostClock,
    stop: Arc<AtomicBool>,
}

impl Outlet {
    /// Hands an arrival on, stamped now; false once nobody wants more.
    pub(crate) fn send(&self, arrival: Arrival) -> bool {
        !self.is_stopped() && self.to.send(Input::Arrived(Arrived { at: self.clock.now(), arrival })).is_ok()
    }

    /// True once the source is to end.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl Source {
    /// Opens a source whose arrivals go to `to`; paths in the URL are relative to `folder`.
    ///
    /// # Errors
    /// [`SourceError`] where it can never be opened. A device that is not there yet is waited for.
    pub fn open(
        url: &SourceUrl,
        folder: &Path,
        clock: HostClock,
        to: SyncSender<Input>,
    ) -> Result<Self, SourceError> {
        let stop = Arc::new(AtomicBool::new(false));
        let outlet = Outlet { to, clock, stop: Arc::clone(&stop) };
        match url {
            SourceUrl::Stdin => stdin::open(outlet)?,
            SourceUrl::File { path, speed } => file::open(outlet, &folder.join(path), *speed)?,
            SourceUrl::Simulated { rig, rate_hz, seed } => {
                simulated::open(outlet, &folder.join(rig), *rate_hz, *seed)?;
            }
        }
        Ok(Self { stop })
    }
}
