//! `-`: standard input.

use super::InputSender;
use crate::input::Arrival;
use std::io::Read;

const CHUNK: usize = 1 << 16;

pub fn open(outlet: InputSender) -> std::io::Result<()> {
    std::thread::Builder::new().name("source".to_owned()).spawn(move || run(&outlet))?;
    Ok(())
}

fn run(outlet: &InputSender) {
    let mut stdin = std::io::stdin().lock();
    let mut buffer = vec![0; CHUNK];
    if !outlet.send(Arrival::Piped("stdin".to_owned())) {
        return;
    }
    loop {
        let arrival = match stdin.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => Arrival::Bytes(buffer[..count].to_vec()),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(error) => {
                outlet.send(Arrival::Lost(error.to_string()));
                break;
            }
        };
        if !outlet.send(arrival) {
            return;
        }
    }
    outlet.send(Arrival::Ended);
}
