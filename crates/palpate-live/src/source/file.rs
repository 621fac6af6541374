//! `file:recording.mcap?speed=1`: the readings of a recording, as the board sent them.

use super::{Outlet, SourceError};
use crate::input::Arrival;
use crate::recording::{Playback, Recorded};
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest sleep between two checks that the source is still in use.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Bytes of an arrival in playback without waits.
const BURST: usize = 1 << 12;

/// Opens a recording. The readings come at `speed` times the pace of the recording, or with 0 as fast as the session processes them.
pub fn open(outlet: Outlet, path: &Path, speed: f64) -> Result<(), SourceError> {
    let playback = Playback::open(path)?;
    let name = format!("the recording {}", path.display());
    std::thread::Builder::new().name("source".to_owned()).spawn(move || {
        if outlet.send(Arrival::Opened(name)) && run(&outlet, playback, speed) {
            outlet.send(Arrival::Ended);
        }
    })?;
    Ok(())
}

/// Sends the content of the recording; false once the receiver is gone.
fn run(outlet: &Outlet, mut playback: Playback, speed: f64) -> bool {
    let start = Instant::now();
    let mut first_ns = None;
    let mut bytes = Vec::new();
    loop {
        let recorded = match playback.next_recorded() {
            Ok(recorded) => recorded,
            Err(error) => return outlet.send(Arrival::Lost(error.to_string())),
        };
        let Some(recorded) = recorded else {
            let loss = playback.passed_over().loss();
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

/// Sleeps until `due` after the start; false once the receiver is gone.
fn sleep_until(outlet: &Outlet, start: Instant, due: Duration) -> bool {
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

/// Values as a line of numbers that parse back exactly.
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
