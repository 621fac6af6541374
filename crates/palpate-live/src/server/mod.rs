//! Web server: page, stream and controls.
//!
//! One thread serves all browsers from bounded queues: a slow browser loses the oldest messages, which are
//! counted, and never delays the session.

mod alarm_file;
mod body;
mod bring_up;
mod calibration;
mod connections;
mod guard;
mod history;
mod live;
mod lock;
mod machine;
mod machine_run;
mod page;
mod press_records;
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

/// Error of the start of a server.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// Failure to listen.
    #[error("cannot listen at {address}: {error}")]
    Listen {
        /// Address.
        address: SocketAddr,
        /// Cause.
        error: std::io::Error,
    },
    /// Failed thread or event queue.
    #[error("cannot run a web server: {0}")]
    Run(#[from] std::io::Error),
}

/// Web server in a thread, until dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Starts a server; port 0 is any free port.
    ///
    /// # Errors
    /// [`ServerError`] of the address.
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
                    _ = connections::serve(listener, router, connections::ConnectionLimits::default()) => {}
                    _ = stopped => {}
                }
            });
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("server".to_owned()).spawn(run)?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Address of the server.
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
