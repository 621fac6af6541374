//! Intervals between readings.

/// Last step and mean interval of readings with times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    pub last_s: f64,
    /// Infinite for the first reading.
    pub step_s: f64,
    interval_s: f64,
    intervals: u32,
}

impl Clock {
    /// None for a time that is not finite.
    pub fn starting_at(time_s: f64) -> Option<Self> {
        let clock = Self { last_s: time_s, step_s: f64::INFINITY, interval_s: 0.0, intervals: 0 };
        time_s.is_finite().then_some(clock)
    }

    /// Returns the mean interval, exponentially weighted over `memory` readings.
    pub fn advance_to(&mut self, time_s: f64, memory: u32) -> f64 {
        self.step_s = time_s - self.last_s;
        self.intervals = self.intervals.saturating_add(1).min(memory);
        self.interval_s += (self.step_s - self.interval_s) / f64::from(self.intervals);
        self.last_s = time_s;
        self.interval_s
    }

    /// Mean interval in seconds, from the second reading on.
    pub fn interval_s(&self) -> Option<f64> {
        (self.intervals > 0).then_some(self.interval_s)
    }
}
