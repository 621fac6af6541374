//! `serial:///dev/ttyACM0?baud=115200`: a serial port.

use super::port::{self, Stream};
use super::{LOOK, Outlet};
use crate::input::Arrival;
use std::io;
use std::path::Path;
use std::sync::mpsc::Receiver;

pub fn run(outlet: &Outlet, commands: &Receiver<Vec<u8>>, path: &Path, baud: u32) {
    // A board sends as long as it has power, so that its first line is the end of one.
    let opened = Arrival::Joined(format!("{} at {baud} baud", path.display()));
    port::run(outlet, commands, &opened, || {
        let port = serialport::new(path.to_string_lossy(), baud).timeout(LOOK).open();
        let stream = port.map_err(|error| complaint(path, error))?;
        Ok(Stream { stream, end: "the port is gone" })
    });
}

/// An error with its remedy.
fn complaint(path: &Path, error: serialport::Error) -> io::Error {
    let error = io::Error::from(error);
    let remedy = match error.kind() {
        io::ErrorKind::NotFound => "; it is opened as soon as it is plugged in",
        io::ErrorKind::PermissionDenied => {
            "; add yourself to the group that owns it, often `dialout`, and log in again"
        }
        _ => "",
    };
    io::Error::new(error.kind(), format!("cannot open {}: {error}{remedy}", path.display()))
}
