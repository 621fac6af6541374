//! The way back to a device.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// Commands that wait for a device at most.
const COMMANDS: usize = 16;

/// A command that is not sent to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The source has no way back.
    #[error("the source takes no commands; serial ports, TCP and MQTT with a topic without `+` and `#` do")]
    OneWay,
    /// The device is not there.
    #[error("the device is not there; the command was not sent")]
    Away,
    /// The device takes commands too slowly.
    #[error("{COMMANDS} commands wait for the device already; the command was not sent")]
    Full,
}

/// The way back to the device of a source; its clones are one and the same.
#[derive(Clone, Debug)]
pub struct Commander {
    commands: SyncSender<Vec<u8>>,
    /// True while the device is there.
    open: Arc<AtomicBool>,
    /// End of a line of text: none where a message is one.
    line_end: &'static str,
}

impl Commander {
    /// A way back to a device that is there while `open` is true, and the commands that are to be sent to it.
    pub(crate) fn new(open: Arc<AtomicBool>) -> (Self, Receiver<Vec<u8>>) {
        let (commands, for_device) = sync_channel(COMMANDS);
        (Self { commands, open, line_end: "" }, for_device)
    }

    /// The same to a device whose lines end so.
    pub(crate) fn with_line_end(self, line_end: &'static str) -> Self {
        Self { line_end, ..self }
    }

    /// Sends a command to the device as it is. Returns at once; the source's thread sends it.
    ///
    /// # Errors
    /// [`SendError`] where the device is away, or too many commands wait for it.
    pub fn send(&self, command: &[u8]) -> Result<(), SendError> {
        if !self.open.load(Ordering::Relaxed) {
            return Err(SendError::Away);
        }
        self.commands.try_send(command.to_vec()).map_err(|error| match error {
            TrySendError::Full(_) => SendError::Full,
            TrySendError::Disconnected(_) => SendError::Away,
        })
    }

    /// Sends a line of text, with its end on a stream and without it as a message.
    ///
    /// # Errors
    /// As of [`Commander::send`].
    pub fn send_line(&self, line: &str) -> Result<(), SendError> {
        self.send(format!("{line}{}", self.line_end).as_bytes())
    }
}
