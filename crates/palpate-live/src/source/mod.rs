//! Sources of bytes.

mod file;
mod mqtt;
mod port;
mod serial;
mod simulated;
mod stdin;
mod tcp;
mod udp;
mod url;

pub use crate::address::Address;
pub use crate::commander::{Commander, SendError};
pub use file::line;
pub use url::{SourceUrl, SourceUrlError};

use crate::input::{Arrival, Input, TimedArrival};
use crate::simulated_board::BoardConfig;
use crate::stamp::HostClock;
use palpate_rig::Rig;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError};
use std::thread;
use std::time::{Duration, Instant};

const LOOK: Duration = Duration::from_millis(10);
/// First and longest pause; pauses double.
const PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(5)];
const CONNECT: Duration = Duration::from_secs(2);

/// Error of a source; a missing device is awaited.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The rig cannot be read.
    #[error("cannot read {path}: {error}")]
    Rig {
        /// Rig.
        path: String,
        /// Cause.
        error: String,
    },
    /// The rig cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] palpate_estimators::simulate::SimulateError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] crate::recording::RecordingError),
    /// The password cannot be read.
    #[error(transparent)]
    Login(#[from] crate::login::LoginError),
    /// The system provides no thread.
    #[error("no thread for the source: {0}")]
    Thread(#[from] std::io::Error),
}

/// Open source; its thread ends within 100 ms after a drop.
#[derive(Debug)]
pub struct Source {
    stop: Arc<AtomicBool>,
    open: Arc<AtomicBool>,
    commander: Option<Commander>,
}

impl Drop for Source {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

pub(crate) struct InputSender {
    to: SyncSender<Input>,
    clock: HostClock,
    stop: Arc<AtomicBool>,
    open: Arc<AtomicBool>,
}

impl InputSender {
    fn new(to: SyncSender<Input>, clock: HostClock) -> Self {
        Self { to, clock, stop: Arc::default(), open: Arc::default() }
    }

    fn source(&self) -> Source {
        Source { stop: Arc::clone(&self.stop), open: Arc::clone(&self.open), commander: None }
    }

    /// Sends an arrival; false at the end of source or session. Waits for a slow session, while the system
    /// buffers data.
    pub(crate) fn send(&self, arrival: Arrival) -> bool {
        match arrival {
            Arrival::Opened(_) | Arrival::Joined(_) | Arrival::Piped(_) => {
                self.open.store(true, Ordering::Relaxed);
            }
            Arrival::Lost(_) | Arrival::Ended => self.open.store(false, Ordering::Relaxed),
            Arrival::Backlog(_) | Arrival::Bytes(_) | Arrival::Message(_) => {}
        }
        let mut input = Input::Arrived(TimedArrival { at: self.clock.now(), arrival });
        while !self.is_stopped() {
            match self.to.try_send(input) {
                Ok(()) => return true,
                Err(TrySendError::Disconnected(_)) => return false,
                Err(TrySendError::Full(back)) => input = back,
            }
            thread::sleep(Duration::from_millis(1));
        }
        false
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn pause(&self, pause: Duration) {
        let end = Instant::now() + pause;
        while !self.is_stopped() && Instant::now() < end {
            thread::sleep(LOOK);
        }
    }
}

impl Source {
    /// Opens a source that sends to `to`; paths are relative to `folder`.
    ///
    /// # Errors
    /// [`SourceError`].
    pub fn open(
        url: &SourceUrl,
        folder: &Path,
        clock: HostClock,
        to: SyncSender<Input>,
    ) -> Result<Self, SourceError> {
        let outlet = InputSender::new(to, clock);
        let mut source = outlet.source();
        let (commander, for_device) = Commander::new(Arc::clone(&source.open));
        // Line end of commands, for a source that accepts them.
        let mut line_end = None;
        match url.clone() {
            SourceUrl::Stdin => stdin::open(outlet)?,
            SourceUrl::File { path, speed } => file::open(outlet, &folder.join(path), speed)?,
            SourceUrl::Serial { port, baud, .. } => {
                line_end = Some("\n");
                spawn(move || serial::run(&outlet, &for_device, &port, baud))?;
            }
            SourceUrl::Tcp { server, .. } => {
                line_end = Some("\n");
                spawn(move || tcp::run(&outlet, &for_device, &server))?;
            }
            SourceUrl::Udp { at, .. } => spawn(move || udp::run(&outlet, &for_device, &at))?,
            SourceUrl::Mqtt { broker, login, topic, .. } => {
                line_end = Some("").filter(|_| !topic.contains(['+', '#']));
                let login = login.map(|login| login.credentials()).transpose()?;
                spawn(move || mqtt::run(&outlet, &for_device, &broker, login, &topic))?;
            }
            SourceUrl::Simulated { rig, rate_hz, seed } => {
                simulated::open(outlet, &folder.join(rig), rate_hz, seed)?;
            }
        }
        source.commander = line_end.map(|line_end| commander.with_line_end(line_end));
        Ok(source)
    }

    /// Sender of commands.
    ///
    /// # Errors
    /// [`SendError::OneWay`].
    pub fn commander(&self) -> Result<Commander, SendError> {
        self.commander.clone().ok_or(SendError::OneWay)
    }

    /// Queues a command, for MQTT to `TOPIC/command`.
    ///
    /// # Errors
    /// [`SendError`].
    pub fn send(&self, command: &[u8]) -> Result<(), SendError> {
        self.commander.as_ref().ok_or(SendError::OneWay)?.send(command)
    }

    /// Opens a simulated board on the bench of a rig.
    ///
    /// # Errors
    /// [`SourceError::Simulate`].
    pub fn simulated(
        rig: Rig,
        config: BoardConfig,
        clock: HostClock,
        to: SyncSender<Input>,
    ) -> Result<Self, SourceError> {
        let outlet = InputSender::new(to, clock);
        let source = outlet.source();
        simulated::open_rig(outlet, rig, config, "a simulated board".to_owned())?;
        Ok(source)
    }
}

fn spawn(run: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    thread::Builder::new().name("source".to_owned()).spawn(run).map(|_| ())
}

struct BackOff(Duration);

impl BackOff {
    fn new() -> Self {
        Self(PAUSES[0])
    }

    fn next(&mut self) -> Duration {
        let pause = self.0;
        self.0 = (2 * pause).min(PAUSES[1]);
        pause
    }
}

fn forget(commands: &Receiver<Vec<u8>>) {
    while commands.try_recv().is_ok() {}
}
