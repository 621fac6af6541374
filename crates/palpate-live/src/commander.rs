//! Commands to a device.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

const COMMANDS: usize = 16;

/// Error of an unsent command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The source takes no commands.
    #[error("the source takes no commands; serial ports, TCP and MQTT with a topic without `+` and `#` do")]
    OneWay,
    /// The device is disconnected.
    #[error("the device is not there; the command was not sent")]
    Away,
    /// Too many commands wait.
    #[error("{COMMANDS} commands wait for the device already; the command was not sent")]
    Full,
}

/// Sender of commands to a device; clones share their state.
#[derive(Clone, Debug)]
pub struct Commander {
    commands: SyncSender<Vec<u8>>,
    open: Arc<AtomicBool>,
    line_end: &'static str,
}

impl Commander {
    pub(crate) fn new(open: Arc<AtomicBool>) -> (Self, Receiver<Vec<u8>>) {
        let (commands, for_device) = sync_channel(COMMANDS);
        (Self { commands, open, line_end: "" }, for_device)
    }

    pub(crate) fn with_line_end(self, line_end: &'static str) -> Self {
        Self { line_end, ..self }
    }

    /// Queues a command without waiting.
    ///
    /// # Errors
    /// A disconnected device, or too many waiting commands.
    pub fn send(&self, command: &[u8]) -> Result<(), SendError> {
        if !self.open.load(Ordering::Relaxed) {
            return Err(SendError::Away);
        }
        self.commands.try_send(command.to_vec()).map_err(|error| match error {
            TrySendError::Full(_) => SendError::Full,
            TrySendError::Disconnected(_) => SendError::Away,
        })
    }

    /// Queues a line of text.
    ///
    /// # Errors
    /// As for [`Commander::send`].
    pub fn send_line(&self, line: &str) -> Result<(), SendError> {
        self.send(format!("{line}{}", self.line_end).as_bytes())
    }
}
