//! The web server: a page, a stream of the session, and its controls.
//!
//! One thread runs the whole server. A browser costs a task and its place in bounded queues. A slow browser loses the oldest messages, which are
//! counted, and the session never waits for it.

mod alarm_file;
mod body;
mod bring_up;
mod calibration;
mod connections;
mod guard;
mod live;
mod lock;
mod machine;
mod page;
mod past;
mod press_records;
mod pressing;
mod rig_maker;
mod routes;
mod session_info;
mod shared;
mod stream;
mod web_sink;

pub use alarm_file::AlarmFile;
pub use bring_up::BringUpError;
pub use calibration::{CalibrationPlan, CalibratorError};
pub use guard::{Access, AccessError};
pub use live::{Live, LiveError};
pub use rig_maker::RigFormError;
pub use web_sink::{Hub, WebSink};

use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::JoinHandle;
use tokio::net::TcpListener;
use tokio::sync::oneshot;

/// A server that cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The server cannot listen at the address.
    #[error("cannot listen at {address}: {error}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why.
        error: std::io::Error,
    },
    /// The thread or the event queue of the server cannot be created.
    #[error("cannot run a web server: {0}")]
    Run(#[from] std::io::Error),
}

/// A web server that runs in a thread of its own until it is dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Starts a server of a live session at an address; port 0 selects any free port.
    ///
    /// # Errors
    /// [`ServerError`] if the server cannot listen at the address.
    pub fn start(address: SocketAddr, access: Access, live: Arc<Live>) -> Result<Self, ServerError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let listener = runtime.block_on(TcpListener::bind(address));
        let listener = listener.map_err(|error| ServerError::Listen { address, error })?;
        let address = listener.local_addr()?;
        let (stop, stopped) = oneshot::channel::<()>();
        let router = routes::router(access.listening_at(address.ip()), live);
        let run = move || {
            runtime.block_on(async {
                tokio::select! {
                    _ = connections::serve(listener, router, connections::Bounds::default()) => {}
                    _ = stopped => {}
                }
            });
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("server".to_owned()).spawn(run)?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// The address that the server listens at.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
