//! `tcp://host:port`: a server of frames.

use super::port::{self, Stream};
use super::{Address, CONNECT, InputSender, LOOK};
use crate::input::Arrival;
use socket2::{SockRef, TcpKeepalive};
use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Silence, interval and number of probes: a board without power does not close the connection.
const ALIVE: (Duration, Duration, u32) = (Duration::from_secs(2), Duration::from_secs(1), 3);

pub fn run(outlet: &InputSender, commands: &Receiver<Vec<u8>>, server: &Address) {
    // A bridge to a serial port can begin amid a line, so the first line can be incomplete.
    let opened = Arrival::Joined(format!("tcp://{server}"));
    port::run(outlet, commands, &opened, || {
        let stream = connect(outlet, server)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(LOOK))?;
        let (after, every, times) = ALIVE;
        let alive = TcpKeepalive::new().with_time(after).with_interval(every).with_retries(times);
        SockRef::from(&stream).set_tcp_keepalive(&alive)?;
        Ok(Stream { stream, end: "the server has closed the connection" })
    });
}

/// The thread is abandoned at the end of the source.
fn connect(outlet: &InputSender, server: &Address) -> io::Result<TcpStream> {
    let (to, from) = sync_channel(1);
    let address = server.clone();
    thread::Builder::new().name("connect".to_owned()).spawn(move || {
        let _ = to.send(connect_first(&address));
    })?;
    loop {
        match from.recv_timeout(LOOK) {
            Ok(connected) => {
                let complaint = |error: io::Error| {
                    io::Error::new(error.kind(), format!("cannot connect to {server}: {error}"))
                };
                return connected.map_err(complaint);
            }
            Err(RecvTimeoutError::Timeout) if !outlet.is_stopped() => {}
            Err(_) => return Err(io::ErrorKind::Interrupted.into()),
        }
    }
}

fn connect_first(server: &Address) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for address in (server.host.as_str(), server.port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}
