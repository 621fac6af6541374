//! The readings of the last seconds.

use palpate_estimators::recording::{RepeatCause, RepeatCounts, is_same_reading};
use std::collections::VecDeque;
use std::time::Duration;

/// Span over which readings are tested for rest, and the smallest number of readings: those of a slow board span more.
pub const REST_SPAN: Duration = Duration::from_millis(400);
const REST_READINGS: usize = 8;
/// Span from which the noise is learnt, and the smallest number of readings in it.
const NOISE_SPAN: Duration = Duration::from_secs(1);
const NOISE_READINGS: usize = 20;
/// Longest stored span: it is long enough to show a steady drift.
pub const LONGEST_SPAN: Duration = Duration::from_secs(3);

/// The readings of the last seconds, with their instants.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    readings: VecDeque<(Duration, Vec<f64>)>,
}

impl Stretch {
    /// Adds a reading, and removes those that are older than [`LONGEST_SPAN`].
    pub fn add(&mut self, at: Duration, reading: &[f64]) {
        self.readings.push_back((at, reading.to_vec()));
        while self.readings.len() > NOISE_READINGS
            && self.readings.get(1).is_some_and(|(second, _)| at.saturating_sub(*second) > LONGEST_SPAN)
        {
            self.readings.pop_front();
        }
    }

    /// Removes all readings.
    pub fn clear(&mut self) {
        self.readings.clear();
    }

    /// True for a single reading, for example after a move of a machine.
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

    /// The reading in the middle of [`Self::latest`], with its instant; before that span is covered, the one in the middle of the last
    /// [`REST_SPAN`].
    pub fn middle(&self) -> Option<(Duration, &[f64])> {
        let last = self.last_at()?;
        let begin = self.rest_begin().unwrap_or(last.saturating_sub(REST_SPAN));
        let middle = last - (last - begin) / 2;
        let index = self.readings.partition_point(|(at, _)| *at < middle);
        self.readings.get(index).map(|(at, reading)| (*at, reading.as_slice()))
    }

    /// The readings of the last [`REST_SPAN`], or the last 8 of a slow board; `None` while there are fewer.
    pub fn latest(&self) -> Option<Vec<&[f64]>> {
        let begin = self.rest_begin()?;
        let mut readings: Vec<&[f64]> = self
            .readings
            .iter()
            .rev()
            .take_while(|(at, _)| *at >= begin)
            .map(|(_, reading)| reading.as_slice())
            .collect();
        readings.reverse();
        Some(readings)
    }

    /// Begin of the span over which readings are tested for rest, if it is covered.
    fn rest_begin(&self) -> Option<Duration> {
        let few = self.readings.len().checked_sub(REST_READINGS)?;
        let begin = self.last_at()?.checked_sub(REST_SPAN)?.min(self.readings[few].0);
        // A reading at the begin or before it shows that the span is covered.
        (self.readings.front()?.0 <= begin).then_some(begin)
    }

    /// True if the source repeats readings because it is faster than its sensors; the readings must be at rest.
    pub fn is_sample_and_hold(&self) -> bool {
        let Some(reading) = self.last() else { return false };
        let mut counts = RepeatCounts::new(reading.len());
        let readings = self.readings.iter().map(|(_, reading)| reading);
        readings.clone().zip(readings.skip(1)).for_each(|(before, reading)| counts.add(before, reading));
        counts.cause() == Some(RepeatCause::SampleAndHold)
    }

    /// True for a reading that repeats the last one.
    pub fn is_repeat(&self, reading: &[f64]) -> bool {
        self.last().is_some_and(|last| is_same_reading(last, reading))
    }

    /// The stretch without readings that repeat their predecessor; `None` if none does.
    pub fn without_repeats(&self) -> Option<Self> {
        let pairs = self.readings.iter().zip(self.readings.iter().skip(1));
        if !pairs.into_iter().any(|((_, before), (_, reading))| is_same_reading(before, reading)) {
            return None;
        }
        let mut distinct = Self::default();
        for (at, reading) in &self.readings {
            if !distinct.is_repeat(reading) {
                distinct.readings.push_back((*at, reading.clone()));
            }
        }
        Some(distinct)
    }

    /// The readings of at least a second, with seconds before the last one, if they are sufficient to learn the noise.
    pub fn for_noise(&self) -> Option<Vec<(f64, &[f64])>> {
        let end = self.last_at()?;
        let span = end.saturating_sub(self.readings.front()?.0);
        let seconds = |at: Duration| -end.saturating_sub(at).as_secs_f64();
        let readings: Vec<_> =
            self.readings.iter().map(|(at, reading)| (seconds(*at), reading.as_slice())).collect();
        (span >= NOISE_SPAN && readings.len() >= NOISE_READINGS).then_some(readings)
    }

    /// The readings of the last second, and the reading before them, which is older after a pause.
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
