//! The way back to a device.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// Most commands that wait for a device.
const COMMANDS: usize = 16;

/// Error for a command that cannot be sent to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The source has no way back.
    #[error("the source takes no commands; serial ports, TCP and MQTT with a topic without `+` and `#` do")]
    OneWay,
    /// The device is away.
    #[error("the device is not there; the command was not sent")]
    Away,
    /// The device takes commands too slowly.
    #[error("{COMMANDS} commands wait for the device already; the command was not sent")]
    Full,
}

/// The way back to the device of a source. Clones share their state.
#[derive(Clone, Debug)]
pub struct Commander {
    commands: SyncSender<Vec<u8>>,
    /// True while the device is connected.
    open: Arc<AtomicBool>,
    /// End of a line of text; empty for links where a message is a line.
    line_end: &'static str,
}

impl Commander {
    /// A way back to a device that is connected while `open` is true, and the receiver of the commands for it.
    pub(crate) fn new(open: Arc<AtomicBool>) -> (Self, Receiver<Vec<u8>>) {
        let (commands, for_device) = sync_channel(COMMANDS);
        (Self { commands, open, line_end: "" }, for_device)
    }

    /// Sets the end of lines to the device.
    pub(crate) fn with_line_end(self, line_end: &'static str) -> Self {
        Self { line_end, ..self }
    }

    /// Sends a command to the device unchanged. Returns at once; the thread of the source sends it.
    ///
    /// # Errors
    /// [`SendError`] if the device is away, or too many commands wait for it.
    pub fn send(&self, command: &[u8]) -> Result<(), SendError> {
        if !self.open.load(Ordering::Relaxed) {
            return Err(SendError::Away);
        }
        self.commands.try_send(command.to_vec()).map_err(|error| match error {
            TrySendError::Full(_) => SendError::Full,
            TrySendError::Disconnected(_) => SendError::Away,
        })
    }

    /// Sends a line of text; with a line end on a stream, without one as a message.
    ///
    /// # Errors
    /// As for [`Commander::send`].
    pub fn send_line(&self, line: &str) -> Result<(), SendError> {
        self.send(format!("{line}{}", self.line_end).as_bytes())
    }
}
