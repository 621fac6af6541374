//! Instants by the clocks of the host.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Instant by both clocks of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Time since the start of the [`HostClock`].
    pub elapsed: Duration,
    /// Unix time in ns, by a clock that may be set.
    pub unix_ns: u64,
}

/// Monotonic and wall clock of the host.
#[derive(Clone, Copy, Debug)]
pub struct HostClock {
    start: Instant,
    speed: u32,
}

impl HostClock {
    /// Starts the clocks.
    #[expect(clippy::new_without_default, reason = "a clock's start is not a default value")]
    pub fn new() -> Self {
        Self::with_speed(1)
    }

    /// Starts clocks; the monotonic clock is `speed` times as fast, for a simulation.
    pub fn with_speed(speed: u32) -> Self {
        Self { start: Instant::now(), speed }
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed().saturating_mul(self.speed)
    }

    /// Real time of `span`.
    pub fn real_time(&self, span: Duration) -> Duration {
        span / self.speed.max(1)
    }

    /// Present instant.
    pub fn now(&self) -> Stamp {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Stamp { elapsed: self.elapsed(), unix_ns: unix.as_nanos() as u64 }
    }
}
