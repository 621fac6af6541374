//! `serial:///dev/ttyACM0?baud=115200`: a serial port.

use super::port::{self, Port, Stream};
use super::{InputSender, LOOK};
use crate::input::Arrival;
use serialport::SerialPort;
use std::io::{self, Read};
use std::path::Path;
use std::sync::mpsc::Receiver;

pub fn run(outlet: &InputSender, commands: &Receiver<Vec<u8>>, path: &Path, baud: u32) {
    // A board sends as long as it has power, so the first line can be incomplete.
    let opened = Arrival::Joined(format!("{} at {baud} baud", path.display()));
    port::run(outlet, commands, &opened, || {
        let port = serialport::new(path.to_string_lossy(), baud).timeout(LOOK).open();
        let stream = port.map_err(|error| open_error(path, error))?;
        Ok(SerialStream(Stream { stream, end: "the port is gone" }))
    });
}

struct SerialStream(Stream<Box<dyn SerialPort>>);

impl Port for SerialStream {
    fn receive(&mut self, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        self.0.receive(buffer)
    }

    fn backlog(&mut self) -> io::Result<Vec<u8>> {
        /// Buffer size of drivers, for boards without pauses.
        const MOST: usize = 1 << 20;
        let port = &mut self.0.stream;
        let mut bytes = Vec::new();
        loop {
            let waiting = port.bytes_to_read()? as usize;
            let start = bytes.len();
            if waiting == 0 || start >= MOST {
                return Ok(bytes);
            }
            bytes.resize(start + waiting, 0);
            let count = port.read(&mut bytes[start..])?;
            bytes.truncate(start + count);
            if count == 0 {
                // A driver can report bytes that it does not deliver.
                return Ok(bytes);
            }
        }
    }

    fn send(&mut self, command: &[u8]) -> io::Result<()> {
        self.0.send(command)
    }
}

fn open_error(path: &Path, error: serialport::Error) -> io::Error {
    // On Unix systems this kind means that the port is locked.
    let is_busy = cfg!(unix) && error.kind == serialport::ErrorKind::NoDevice;
    let error = io::Error::from(error);
    let remedy = match error.kind() {
        _ if is_busy => "; another program has it open, perhaps a serial monitor: close that program",
        io::ErrorKind::NotFound => "; it is opened as soon as it is plugged in",
        io::ErrorKind::PermissionDenied => {
            "; add yourself to the group that owns it, often `dialout`, and log in again"
        }
        _ => "",
    };
    io::Error::new(error.kind(), format!("cannot open {}: {error}{remedy}", path.display()))
}
