//! `-`: bytes of the standard input.

use super::{Arrival, Outlet};
use std::io::Read;

/// Most bytes of an arrival.
const CHUNK: usize = 1 << 16;

pub fn open(outlet: Outlet) -> std::io::Result<()> {
    std::thread::Builder::new().name("source".to_owned()).spawn(move || run(&outlet))?;
    Ok(())
}

fn run(outlet: &Outlet) {
    let mut stdin = std::io::stdin().lock();
    let mut buffer = vec![0; CHUNK];
    let mut goes_on = outlet.send(Arrival::Opened("stdin".to_owned()));
    while goes_on {
        goes_on = match stdin.read(&mut buffer) {
            Ok(0) => outlet.send(Arrival::Ended) && false,
            Ok(count) => outlet.send(Arrival::Bytes(buffer[..count].to_vec())),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => true,
            Err(error) => {
                outlet.send(Arrival::Lost(error.to_string())) && outlet.send(Arrival::Ended) && false
            }
        };
    }
}
