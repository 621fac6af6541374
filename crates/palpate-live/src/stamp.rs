//! Instants by the host's clocks.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// An instant by the host's two clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Time since the [`HostClock`] was started, by the monotonic clock, the reference of all durations.
    pub elapsed: Duration,
    /// Nanoseconds since 1970-01-01 00:00 UTC by the wall clock, which may be set at any time.
    pub unix_ns: u64,
}

/// The host's clocks, from a common start.
#[derive(Clone, Copy, Debug)]
pub struct HostClock {
    start: Instant,
    /// Factor by which the monotonic clock runs fast.
    speed: u32,
}

impl HostClock {
    /// Clocks that start now.
    #[expect(clippy::new_without_default, reason = "a clock's start is not a default value")]
    pub fn new() -> Self {
        Self::with_speed(1)
    }

    /// Clocks that start now, with a monotonic clock that is `speed` times as fast, for a simulated board and machine of this speed.
    pub fn with_speed(speed: u32) -> Self {
        Self { start: Instant::now(), speed }
    }

    /// Time since the start, by the monotonic clock.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed().saturating_mul(self.speed)
    }

    /// Real time that corresponds to `span` of the monotonic clock.
    pub fn real_time(&self, span: Duration) -> Duration {
        span / self.speed.max(1)
    }

    /// The present instant.
    pub fn now(&self) -> Stamp {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Stamp { elapsed: self.elapsed(), unix_ns: unix.as_nanos() as u64 }
    }
}
