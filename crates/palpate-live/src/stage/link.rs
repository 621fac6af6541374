use super::url::StageUrl;
use crate::stamp::HostClock;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Link to a machine; reads take about 10 ms at most.
pub trait StageLink: Read + Write + Send {
    /// Time since an arbitrary instant.
    fn now(&self) -> Duration;

    /// Resets the board by DTR; false without DTR.
    ///
    /// # Errors
    /// [`io::Error`] of the port.
    fn reset_by_dtr(&mut self) -> io::Result<bool>;

    /// True for links with DTR.
    fn has_dtr(&self) -> bool;
}

impl<L: StageLink + ?Sized> StageLink for Box<L> {
    fn now(&self) -> Duration {
        (**self).now()
    }

    fn reset_by_dtr(&mut self) -> io::Result<bool> {
        (**self).reset_by_dtr()
    }

    fn has_dtr(&self) -> bool {
        (**self).has_dtr()
    }
}

/// Longest wait for a byte, thus delay of a stop.
const READ: Duration = Duration::from_millis(10);
/// For a write, or a connection.
const WRITE: Duration = Duration::from_millis(200);
const CONNECT: Duration = Duration::from_secs(2);
/// Pulse: an Arduino's capacitor needs about 10 ms.
const DTR: Duration = Duration::from_millis(20);

impl StageUrl {
    pub(super) fn open(&self, clock: HostClock) -> io::Result<Box<dyn StageLink>> {
        match self {
            Self::Serial { port, baud } => {
                let port =
                    serialport::new(port.to_string_lossy(), *baud).timeout(clock.real_time(READ)).open()?;
                Ok(Box::new(SerialLink { port, clock }))
            }
            Self::Tcp(server) => {
                let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
                for address in (server.host.as_str(), server.port).to_socket_addrs()? {
                    match TcpStream::connect_timeout(&address, CONNECT) {
                        Ok(stream) => {
                            stream.set_nodelay(true)?;
                            stream.set_read_timeout(Some(clock.real_time(READ)))?;
                            stream.set_write_timeout(Some(WRITE))?;
                            return Ok(Box::new(TcpLink { stream, clock }));
                        }
                        Err(error) => last = error,
                    }
                }
                Err(last)
            }
        }
    }
}

struct SerialLink {
    port: Box<dyn serialport::SerialPort>,
    clock: HostClock,
}

impl Read for SerialLink {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.port.read(buffer)
    }
}

impl Write for SerialLink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.port.write(bytes)
    }

    /// The port has no buffer; a wait would delay a stop.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl StageLink for SerialLink {
    fn now(&self) -> Duration {
        self.clock.elapsed()
    }

    fn reset_by_dtr(&mut self) -> io::Result<bool> {
        self.port.write_data_terminal_ready(false)?;
        std::thread::sleep(DTR);
        self.port.write_data_terminal_ready(true)?;
        Ok(true)
    }

    fn has_dtr(&self) -> bool {
        true
    }
}

struct TcpLink {
    stream: TcpStream,
    clock: HostClock,
}

impl Read for TcpLink {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for TcpLink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

impl StageLink for TcpLink {
    fn now(&self) -> Duration {
        self.clock.elapsed()
    }

    fn reset_by_dtr(&mut self) -> io::Result<bool> {
        Ok(false)
    }

    fn has_dtr(&self) -> bool {
        false
    }
}
