//! Any bytes as replies of a machine: no panic, no move before the `ok` of every earlier command,
//! none below the deepest press.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::stage::{GcodeStage, StageLink};
use palpate_mechanics::contact::Position;
use palpate_rig::{Rig, Stage};
use std::io::{self, Read, Write};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

static STAGE: LazyLock<Stage> = LazyLock::new(|| {
    let rig = Rig::from_toml(include_str!("../../examples/fsi-like.toml")).expect("the example is a rig");
    rig.stage.expect("it has a machine")
});

/// Duration of a read.
const READ: Duration = Duration::from_millis(10);

/// A line to a machine with fixed replies; at their end it is disconnected.
#[derive(Clone)]
struct Line {
    replies: Arc<Mutex<Vec<u8>>>,
    sent: Arc<Mutex<Vec<u8>>>,
    now: Arc<Mutex<Duration>>,
}

fn locked<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        *locked(&self.now) += READ;
        let mut replies = locked(&self.replies);
        let count = replies.len().min(buffer.len());
        buffer[..count].copy_from_slice(&replies[..count]);
        replies.drain(..count);
        Ok(count)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        locked(&self.sent).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl StageLink for Line {
    fn now(&self) -> Duration {
        *locked(&self.now)
    }

    fn reset_by_dtr(&mut self) -> io::Result<bool> {
        Ok(false)
    }

    fn has_dtr(&self) -> bool {
        false
    }
}

fuzz_target!(|replies: &[u8]| {
    let line =
        Line { replies: Arc::new(Mutex::new(replies.to_vec())), sent: Arc::default(), now: Arc::default() };
    if let Ok(mut stage) = GcodeStage::connect(line.clone(), STAGE.clone(), Arc::default()) {
        let _ = stage
            .home()
            .and_then(|()| stage.travel(Position::along(0.05)))
            .and_then(|()| stage.press(1e-3))
            .and_then(|()| stage.jog([1e-3, 0.0, -1.0]))
            .and_then(|()| stage.lower(-1.0))
            .and_then(|()| stage.lift());
    }
    let confirmed = replies.windows(2).filter(|pair| *pair == b"ok").count();
    let sent = String::from_utf8_lossy(&locked(&line.sent)).into_owned();
    let moves = sent.matches("G1 ").count();
    // The lift of a retreat follows a refused command.
    assert!(moves <= confirmed + 1, "{moves} moves after {confirmed} answers");
    let heights_mm =
        sent.split(|c: char| c.is_ascii_whitespace()).filter_map(|word| word.strip_prefix('Z')?.parse().ok());
    let lowest_mm = heights_mm.fold(f64::INFINITY, f64::min);
    assert!(lowest_mm >= STAGE.lowest_z_m() * 1e3 - 1e-3, "sent to {lowest_mm} mm");
});
