//! Instants by the host's clocks.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// An instant by the host's two clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Time since the [`HostClock`] was started, by the monotonic clock: all durations are reckoned by it.
    pub elapsed: Duration,
    /// Nanoseconds since 1970-01-01 00:00 UTC by the wall clock, which may be set at any time.
    pub unix_ns: u64,
}

/// The host's clocks, from a common start.
#[derive(Clone, Copy, Debug)]
pub struct HostClock {
    start: Instant,
}

impl HostClock {
    /// Clocks that start now.
    #[expect(clippy::new_without_default, reason = "a clock's start is no default value")]
    pub fn new() -> Self {
        Self { start: Instant::now() }
    }

    /// The present instant.
    pub fn now(&self) -> Stamp {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Stamp { elapsed: self.start.elapsed(), unix_ns: unix.as_nanos() as u64 }
    }
}
