//! The readings of the last seconds.

use std::collections::VecDeque;
use std::time::Duration;

/// Span over which readings are judged to be at rest, and the fewest readings in it.
pub const REST_SPAN: Duration = Duration::from_millis(400);
const REST_READINGS: usize = 8;
/// Span from which the noise is learnt, and the fewest readings in it.
const NOISE_SPAN: Duration = Duration::from_secs(1);
const NOISE_READINGS: usize = 20;
/// Longest span that is kept: a steady drift shows in it.
pub const LONGEST_SPAN: Duration = Duration::from_secs(3);

/// The readings of the last seconds, with their instants.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    readings: VecDeque<(Duration, Vec<f64>)>,
}

impl Stretch {
    /// Adds a reading, and forgets those that are older than [`LONGEST_SPAN`].
    pub fn add(&mut self, at: Duration, reading: &[f64]) {
        self.readings.push_back((at, reading.to_vec()));
        while self.readings.len() > NOISE_READINGS
            && self.readings.get(1).is_some_and(|(second, _)| at.saturating_sub(*second) > LONGEST_SPAN)
        {
            self.readings.pop_front();
        }
    }

    /// Forgets all readings.
    pub fn clear(&mut self) {
        self.readings.clear();
    }

    /// True for a single reading, as after a machine moved.
    pub fn has_one_reading(&self) -> bool {
        self.readings.len() == 1
    }

    /// Instant of the last reading.
    pub fn last_at(&self) -> Option<Duration> {
        self.readings.back().map(|(at, _)| *at)
    }

    /// The last reading.
    pub fn last(&self) -> Option<&[f64]> {
        self.readings.back().map(|(_, reading)| reading.as_slice())
    }

    /// The reading in the middle of the last [`REST_SPAN`], with its instant.
    pub fn middle(&self) -> Option<(Duration, &[f64])> {
        let middle = self.last_at()?.saturating_sub(REST_SPAN / 2);
        let index = self.readings.partition_point(|(at, _)| *at < middle);
        self.readings.get(index).map(|(at, reading)| (*at, reading.as_slice()))
    }

    /// The readings of the last [`REST_SPAN`], where they span it and are enough to judge by.
    pub fn latest(&self) -> Option<Vec<&[f64]>> {
        let begin = self.last_at()?.checked_sub(REST_SPAN)?;
        // One reading before the span shows that it is covered.
        let is_covered = self.readings.front()?.0 <= begin;
        let mut readings: Vec<&[f64]> = self
            .readings
            .iter()
            .rev()
            .take_while(|(at, _)| *at >= begin)
            .map(|(_, reading)| reading.as_slice())
            .collect();
        readings.reverse();
        (is_covered && readings.len() >= REST_READINGS).then_some(readings)
    }

    /// The readings of at least a second, with seconds before the last one, where they are enough to learn the noise from.
    pub fn for_noise(&self) -> Option<Vec<(f64, &[f64])>> {
        let end = self.last_at()?;
        let span = end.saturating_sub(self.readings.front()?.0);
        let seconds = |at: Duration| -end.saturating_sub(at).as_secs_f64();
        let readings: Vec<_> =
            self.readings.iter().map(|(at, reading)| (seconds(*at), reading.as_slice())).collect();
        (span >= NOISE_SPAN && readings.len() >= NOISE_READINGS).then_some(readings)
    }

    /// The readings of the last second, and the one before them, which is older after a pause.
    pub fn last_second(&self) -> impl Iterator<Item = &[f64]> {
        let begin = self.last_at().unwrap_or_default().saturating_sub(NOISE_SPAN);
        let later = self.readings.partition_point(|(at, _)| *at <= begin);
        self.readings.range(later.saturating_sub(1)..).map(|(_, reading)| reading.as_slice())
    }
}

/// Mean of readings, channel by channel.
pub fn mean(readings: &[&[f64]]) -> Vec<f64> {
    let mut mean = vec![0.0; readings.first().map_or(0, |reading| reading.len())];
    for reading in readings {
        mean.iter_mut().zip(*reading).for_each(|(mean, value)| *mean += value / readings.len() as f64);
    }
    mean
}
