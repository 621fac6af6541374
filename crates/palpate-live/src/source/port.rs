//! Ports with reconnection: serial, TCP and UDP.

use super::{BackOff, InputSender, LOOK, forget};
use crate::input::Arrival;
use std::io::{self, ErrorKind, Read, Write};
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// Most bytes of an arrival.
pub const CHUNK: usize = 1 << 16;
const WRITE: std::time::Duration = std::time::Duration::from_millis(50);

/// Open device.
pub trait Port {
    /// Waits at most [`LOOK`].
    fn receive(&mut self, buffer: &mut [u8]) -> io::Result<Option<Arrival>>;

    /// Bytes from before the opening, if known.
    fn backlog(&mut self) -> io::Result<Vec<u8>> {
        Ok(Vec::new())
    }

    fn send(&mut self, command: &[u8]) -> io::Result<()>;
}

/// Sends `opened` and the data of a device, which is opened again after each loss.
pub fn run<P: Port>(
    outlet: &InputSender,
    commands: &Receiver<Vec<u8>>,
    opened: &Arrival,
    mut open: impl FnMut() -> io::Result<P>,
) {
    let mut back_off = BackOff::new();
    let mut said = String::new();
    while !outlet.is_stopped() {
        let error = match open() {
            Ok(mut port) => {
                said.clear();
                forget(commands);
                let backlog = port.backlog().unwrap_or_default();
                if !outlet.send(opened.clone())
                    || (!backlog.is_empty() && !outlet.send(Arrival::Backlog(backlog)))
                {
                    return;
                }
                match read_port(outlet, commands, &mut port, &mut back_off) {
                    Ok(()) => return,
                    Err(error) => error,
                }
            }
            Err(error) => error,
        };
        let why = error.to_string();
        // Each cause is reported once.
        if why != said && !outlet.send(Arrival::Lost(why.clone())) {
            return;
        }
        said = why;
        outlet.pause(back_off.next());
    }
}

fn read_port(
    outlet: &InputSender,
    commands: &Receiver<Vec<u8>>,
    port: &mut impl Port,
    back_off: &mut BackOff,
) -> io::Result<()> {
    let mut buffer = vec![0; CHUNK];
    while !outlet.is_stopped() {
        while let Ok(command) = commands.try_recv() {
            port.send(&command)?;
        }
        match port.receive(&mut buffer) {
            Ok(Some(arrival)) => {
                // Only data reset the pauses, so that a device that disconnects at once is not opened ten
                // times a second.
                *back_off = BackOff::new();
                if !outlet.send(arrival) {
                    return Ok(());
                }
            }
            Ok(None) => {}
            Err(error) if is_wait(&error) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// Stream with timeouts of [`LOOK`].
pub struct Stream<T> {
    pub stream: T,
    /// Message at the end of the stream.
    pub end: &'static str,
}

impl<T: Read + Write> Port for Stream<T> {
    fn receive(&mut self, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        match self.stream.read(buffer)? {
            0 => Err(io::Error::new(ErrorKind::UnexpectedEof, self.end)),
            count => Ok(Some(Arrival::Bytes(buffer[..count].to_vec()))),
        }
    }

    fn send(&mut self, command: &[u8]) -> io::Result<()> {
        let end = Instant::now() + WRITE;
        let mut rest = command;
        while !rest.is_empty() {
            match self.stream.write(rest) {
                Ok(0) => return Err(io::Error::new(ErrorKind::WriteZero, self.end)),
                Ok(count) => rest = &rest[count..],
                Err(error) if is_wait(&error) && Instant::now() < end => {}
                Err(error) if is_wait(&error) => {
                    let words = "it does not take commands: half of one may have arrived";
                    return Err(io::Error::new(ErrorKind::TimedOut, words));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

const _: () = assert!(LOOK.as_millis() + WRITE.as_millis() < 100);
