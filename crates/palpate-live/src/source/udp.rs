//! `udp://:port`: datagrams, one message each.

use super::port::{self, Port};
use super::{Address, InputSender, LOOK};
use crate::input::Arrival;
use std::io;
use std::net::UdpSocket;
use std::sync::mpsc::Receiver;

pub fn run(outlet: &InputSender, commands: &Receiver<Vec<u8>>, at: &Address) {
    let host = if at.host.is_empty() { "0.0.0.0" } else { &at.host };
    let opened = Arrival::Opened(format!("udp://{at}"));
    port::run(outlet, commands, &opened, || {
        let socket = UdpSocket::bind((host, at.port)).and_then(|socket| {
            socket.set_read_timeout(Some(LOOK))?;
            Ok(socket)
        });
        let complaint =
            |error: io::Error| io::Error::new(error.kind(), format!("cannot receive at udp://{at}: {error}"));
        socket.map(Datagrams).map_err(complaint)
    });
}

struct Datagrams(UdpSocket);

impl Port for Datagrams {
    fn receive(&mut self, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        let count = self.0.recv(buffer)?;
        Ok(Some(Arrival::Message(buffer[..count].to_vec())))
    }

    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        Ok(())
    }
}
