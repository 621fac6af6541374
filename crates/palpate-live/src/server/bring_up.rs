//! Board without a rig.

use super::lock::locked;
use crate::input::Input;
use crate::monitor::{Monitor, MonitorRecord};
use crate::pipeline::WAITING;
use crate::source::{Source, SourceError, SourceUrl};
use crate::stamp::HostClock;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

const GREATEST_BAUD: u32 = 20_000_000;

/// Error of a board without a rig.
#[derive(Debug, thiserror::Error)]
pub enum BringUpError {
    /// A rig exists.
    #[error("this server has a rig already")]
    HasRig,
    /// The source is not a serial port.
    #[error("the source {from} has no port and no baud rate")]
    NotSerial {
        /// URL of the source.
        from: String,
    },
    /// Missing port.
    #[error("serial port {port} does not exist")]
    NoPort {
        /// Name.
        port: String,
    },
    /// Rate out of range.
    #[error("{baud} baud; a port takes 1 to {GREATEST_BAUD}")]
    Baud {
        /// Bits a second.
        baud: u32,
    },
    /// Error of the source.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Error of a new thread.
    #[error("no thread for the source: {0}")]
    Thread(#[from] std::io::Error),
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PortRecord {
    /// Path, or name on Windows.
    pub name: String,
    pub device: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
pub struct BringUpRecord {
    from: String,
    /// Null for other sources.
    port: Option<String>,
    baud: Option<u32>,
    ports: Vec<PortRecord>,
    #[serde(flatten)]
    #[serde(rename = "seen")]
    monitor: MonitorRecord,
}

pub struct BringUp {
    clock: HostClock,
    state: Mutex<State>,
}

struct State {
    from: SourceUrl,
    watched: Option<WatchedSource>,
}

struct WatchedSource {
    monitor: Arc<Mutex<Monitor>>,
    inputs: SyncSender<Input>,
    thread: JoinHandle<()>,
    source: Source,
}

impl BringUp {
    pub fn begin(from: SourceUrl, folder: &Path, clock: HostClock) -> Result<Self, BringUpError> {
        let watched = Some(WatchedSource::open(&from, folder, clock)?);
        Ok(Self { clock, state: Mutex::new(State { from, watched }) })
    }

    pub fn from(&self) -> SourceUrl {
        locked(&self.state).from.clone()
    }

    /// Slow, because it lists the ports.
    pub fn record(&self) -> BringUpRecord {
        let ports = ports();
        let state = locked(&self.state);
        let monitor = state.watched.as_ref().map(|watched| Arc::clone(&watched.monitor));
        let now = self.clock.now().elapsed;
        let seen =
            monitor.map_or_else(|| Monitor::default().record(now), |monitor| locked(&monitor).record(now));
        let (port, baud) = match &state.from {
            SourceUrl::Serial { port, baud, .. } => (Some(port.display().to_string()), Some(*baud)),
            _ => (None, None),
        };
        BringUpRecord { from: state.from.to_string(), port, baud, ports, monitor: seen }
    }

    /// Opens another port or rate.
    pub fn choose(&self, port: Option<&str>, baud: Option<u32>, folder: &Path) -> Result<(), BringUpError> {
        let mut state = locked(&self.state);
        let SourceUrl::Serial { port: old_port, baud: old_baud, columns } = state.from.clone() else {
            return Err(BringUpError::NotSerial { from: state.from.to_string() });
        };
        let port = match port.map(PathBuf::from) {
            Some(port) if port != old_port => {
                // A page may open serial ports only.
                let is_port = |one: &PortRecord| Path::new(&one.name) == port;
                if !ports().iter().any(is_port) {
                    return Err(BringUpError::NoPort { port: port.display().to_string() });
                }
                port
            }
            _ => old_port,
        };
        let baud = baud.unwrap_or(old_baud);
        if !(1..=GREATEST_BAUD).contains(&baud) {
            return Err(BringUpError::Baud { baud });
        }
        // The port must be free first.
        if let Some(watched) = state.watched.take() {
            watched.end();
        }
        state.from = SourceUrl::Serial { port, baud, columns };
        state.watched = Some(WatchedSource::open(&state.from, folder, self.clock)?);
        Ok(())
    }

    /// Detected channels, and true if the board names them.
    pub fn channels(&self) -> (Vec<String>, bool) {
        let state = locked(&self.state);
        let Some(watched) = &state.watched else { return (Vec::new(), false) };
        let monitor = locked(&watched.monitor);
        (monitor.channel_names(), monitor.is_named())
    }

    /// Closes the source; returns its fault without readings.
    pub fn end(&self) -> Option<String> {
        locked(&self.state).watched.take()?.end()
    }
}

impl WatchedSource {
    fn open(from: &SourceUrl, folder: &Path, clock: HostClock) -> Result<Self, BringUpError> {
        let (inputs, received) = sync_channel(WAITING);
        let monitor = Arc::<Mutex<Monitor>>::default();
        let source = Source::open(from, folder, clock, inputs.clone())?;
        let watching = Arc::clone(&monitor);
        let thread = std::thread::Builder::new()
            .name("bring-up".to_owned())
            .spawn(move || watch(&received, &watching))?;
        Ok(Self { monitor, inputs, thread, source })
    }

    fn end(self) -> Option<String> {
        let Self { inputs, thread, source, monitor } = self;
        drop(source);
        // Fails only after the end of the thread.
        let _ = inputs.send(Input::Stop);
        let _ = thread.join();
        locked(&monitor).fault()
    }
}

fn watch(inputs: &Receiver<Input>, monitor: &Mutex<Monitor>) {
    while let Ok(input) = inputs.recv() {
        match input {
            Input::Arrived(arrived) => locked(monitor).receive(&arrived),
            Input::Command(_) => {}
            Input::Stop => return,
        }
    }
}

fn ports() -> Vec<PortRecord> {
    let ports = serialport::available_ports().unwrap_or_default();
    let record = |port: serialport::SerialPortInfo| PortRecord {
        device: match port.port_type {
            serialport::SerialPortType::UsbPort(usb) => usb.product.or(usb.manufacturer),
            _ => None,
        },
        name: port.port_name,
    };
    ports.into_iter().map(record).collect()
}
