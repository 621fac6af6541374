//! `file:recording.mcap?speed=1`: a recording.

use super::{InputSender, SourceError};
use crate::input::Arrival;
use crate::recording::{Playback, Recorded};
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

const LOOK_EVERY: Duration = Duration::from_millis(50);
const BURST: usize = 1 << 12;

/// Opens a recording for a replay at `speed`; 0 is the fastest.
pub fn open(outlet: InputSender, path: &Path, speed: f64) -> Result<(), SourceError> {
    let playback = Playback::open(path)?;
    let name = format!("the recording {}", path.display());
    std::thread::Builder::new().name("source".to_owned()).spawn(move || {
        if outlet.send(Arrival::Opened(name)) && run(&outlet, playback, speed) {
            outlet.send(Arrival::Ended);
        }
    })?;
    Ok(())
}

fn run(outlet: &InputSender, mut playback: Playback, speed: f64) -> bool {
    let start = Instant::now();
    let mut first_ns = None;
    let mut bytes = Vec::new();
    loop {
        let recorded = match playback.next_recorded() {
            Ok(recorded) => recorded,
            Err(error) => return outlet.send(Arrival::Lost(error.to_string())),
        };
        let Some(recorded) = recorded else {
            let loss = playback.skipped().loss();
            return (bytes.is_empty() || outlet.send(Arrival::Bytes(bytes)))
                && loss.is_none_or(|loss| outlet.send(Arrival::Lost(loss)));
        };
        let Recorded::Reading { unix_ns, values, .. } = recorded else { continue };
        if speed > 0.0 {
            let after_ns = unix_ns.saturating_sub(*first_ns.get_or_insert(unix_ns));
            let due = Duration::from_secs_f64((after_ns as f64 * 1e-9 / speed).min(1e9));
            let is_due = due <= start.elapsed();
            if !is_due && !bytes.is_empty() && !outlet.send(Arrival::Bytes(std::mem::take(&mut bytes))) {
                return false;
            }
            if !is_due && !sleep_until(outlet, start, due) {
                return false;
            }
        }
        bytes.extend(line(&values).into_bytes());
        if bytes.len() >= BURST && !outlet.send(Arrival::Bytes(std::mem::take(&mut bytes))) {
            return false;
        }
    }
}

fn sleep_until(outlet: &InputSender, start: Instant, due: Duration) -> bool {
    loop {
        let left = due.saturating_sub(start.elapsed());
        if outlet.is_stopped() {
            return false;
        }
        if left.is_zero() {
            return true;
        }
        std::thread::sleep(left.min(LOOK_EVERY));
    }
}

/// Line of numbers that parse back exactly.
pub fn line(values: &[f64]) -> String {
    let mut line = String::new();
    for value in values {
        if !line.is_empty() {
            line.push(',');
        }
        // Writing into a string cannot fail.
        let _ = write!(line, "{value}");
    }
    line.push('\n');
    line
}
