//! Sources of bytes: boards, networks, files, and a board that is simulated.

mod simulated;
mod stdin;
mod url;

pub use url::{SourceUrl, SourceUrlError};

use crate::input::{Arrival, Arrived, Input};
use crate::simulated_board::BoardConfig;
use crate::stamp::HostClock;
use palpate_rig::Rig;
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
            SourceUrl::Simulated { rig, rate_hz, seed } => {
                simulated::open(outlet, &folder.join(rig), *rate_hz, *seed)?;
            }
        }
        Ok(Self { stop })
    }

    /// Opens a simulated board on the bench of a rig.
    ///
    /// # Errors
    /// [`SourceError::Simulate`] for a surface without a model, or one whose equations are not solved.
    pub fn simulated(
        rig: Rig,
        config: BoardConfig,
        clock: HostClock,
        to: SyncSender<Input>,
    ) -> Result<Self, SourceError> {
        let stop = Arc::new(AtomicBool::new(false));
        let outlet = Outlet { to, clock, stop: Arc::clone(&stop) };
        simulated::open_rig(outlet, rig, config, "a simulated board".to_owned())?;
        Ok(Self { stop })
    }
}
