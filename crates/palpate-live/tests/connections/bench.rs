//! A source under test.

use palpate_live::input::{Arrival, Input};
use palpate_live::source::Source;
use palpate_live::stamp::HostClock;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

/// Timeout of all waits, for a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// A source, and its arrivals.
pub struct Bench {
    pub source: Source,
    arrivals: Receiver<Input>,
}

impl Bench {
    /// Opens the source of a URL.
    pub fn open(url: &str) -> Self {
        let (to, arrivals) = sync_channel(1024);
        let source = Source::open(&url.parse().unwrap(), Path::new("."), HostClock::new(), to).unwrap();
        Self { source, arrivals }
    }

    /// The next arrival.
    pub fn next(&self) -> Arrival {
        match self.arrivals.recv_timeout(PATIENCE) {
            Ok(Input::Arrived(arrived)) => arrived.arrival,
            other => panic!("{other:?}"),
        }
    }

    /// Waits until the device is opened.
    pub fn opened(&self) {
        loop {
            match self.next() {
                Arrival::Opened(_) | Arrival::Joined(_) => return,
                Arrival::Lost(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }

    /// Waits until the device goes away; returns the cause.
    pub fn lost(&self) -> String {
        match self.next() {
            Arrival::Lost(why) => why,
            other => panic!("{other:?}"),
        }
    }

    /// Waits for `count` bytes.
    pub fn bytes(&self, count: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() < count {
            match self.next() {
                Arrival::Bytes(more) | Arrival::Message(more) => bytes.extend(more),
                other => panic!("{other:?} after {} bytes", bytes.len()),
            }
        }
        bytes
    }

    /// Ends the source; returns the time until its thread ends.
    pub fn end(self) -> Duration {
        let start = Instant::now();
        drop(self.source);
        loop {
            match self.arrivals.recv_timeout(PATIENCE) {
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => return start.elapsed(),
                Err(RecvTimeoutError::Timeout) => panic!("the source's thread goes on"),
            }
        }
    }
}

/// Lines of numbered frames.
pub fn lines(numbers: std::ops::Range<u32>) -> Vec<u8> {
    numbers.flat_map(|n| format!("n:{n},a:1.25,b:-3\n").into_bytes()).collect()
}
