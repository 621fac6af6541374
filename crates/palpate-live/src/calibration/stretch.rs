use palpate_estimators::recording::{RepeatCause, RepeatCounts, is_same_reading};
use std::collections::VecDeque;
use std::time::Duration;

/// Span and minimum number of readings at rest.
pub const REST_SPAN: Duration = Duration::from_millis(400);
const REST_READINGS: usize = 8;
/// Span and minimum number of readings for noise.
const NOISE_SPAN: Duration = Duration::from_secs(1);
const NOISE_READINGS: usize = 20;
/// Longest span, sufficient for a steady drift.
pub const LONGEST_SPAN: Duration = Duration::from_secs(3);

/// Recent readings with their instants.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    readings: VecDeque<(Duration, Vec<f64>)>,
}

impl Stretch {
    /// Adds a reading, and removes those older than [`LONGEST_SPAN`].
    pub fn add(&mut self, at: Duration, reading: &[f64]) {
        self.readings.push_back((at, reading.to_vec()));
        while self.readings.len() > NOISE_READINGS
            && self.readings.get(1).is_some_and(|(second, _)| at.saturating_sub(*second) > LONGEST_SPAN)
        {
            self.readings.pop_front();
        }
    }

    pub fn clear(&mut self) {
        self.readings.clear();
    }

    pub fn has_one_reading(&self) -> bool {
        self.readings.len() == 1
    }

    pub fn last_at(&self) -> Option<Duration> {
        self.readings.back().map(|(at, _)| *at)
    }

    pub fn last(&self) -> Option<&[f64]> {
        self.readings.back().map(|(_, reading)| reading.as_slice())
    }

    /// Middle reading of [`Self::latest`], or of the last [`REST_SPAN`].
    pub fn middle(&self) -> Option<(Duration, &[f64])> {
        let last = self.last_at()?;
        let begin = self.rest_begin().unwrap_or(last.saturating_sub(REST_SPAN));
        let middle = last - (last - begin) / 2;
        let index = self.readings.partition_point(|(at, _)| *at < middle);
        self.readings.get(index).map(|(at, reading)| (*at, reading.as_slice()))
    }

    /// Readings of the last [`REST_SPAN`], at least 8.
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

    fn rest_begin(&self) -> Option<Duration> {
        let few = self.readings.len().checked_sub(REST_READINGS)?;
        let begin = self.last_at()?.checked_sub(REST_SPAN)?.min(self.readings[few].0);
        // An earlier reading shows that the span is covered.
        (self.readings.front()?.0 <= begin).then_some(begin)
    }

    /// True if a source at rest repeats readings: its sensors are slower.
    pub fn is_sample_and_hold(&self) -> bool {
        let Some(reading) = self.last() else { return false };
        let mut counts = RepeatCounts::new(reading.len());
        let readings = self.readings.iter().map(|(_, reading)| reading);
        readings.clone().zip(readings.skip(1)).for_each(|(before, reading)| counts.add(before, reading));
        counts.cause() == Some(RepeatCause::SampleAndHold)
    }

    pub fn is_repeat(&self, reading: &[f64]) -> bool {
        self.last().is_some_and(|last| is_same_reading(last, reading))
    }

    /// Stretch without repetitions, if it has any.
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

    /// Readings with relative times in seconds, if sufficient for the noise.
    pub fn for_noise(&self) -> Option<Vec<(f64, &[f64])>> {
        let end = self.last_at()?;
        let span = end.saturating_sub(self.readings.front()?.0);
        let seconds = |at: Duration| -end.saturating_sub(at).as_secs_f64();
        let readings: Vec<_> =
            self.readings.iter().map(|(at, reading)| (seconds(*at), reading.as_slice())).collect();
        (span >= NOISE_SPAN && readings.len() >= NOISE_READINGS).then_some(readings)
    }

    /// Readings of the last second, and their predecessor.
    pub fn last_second(&self) -> impl Iterator<Item = &[f64]> {
        let begin = self.last_at().unwrap_or_default().saturating_sub(NOISE_SPAN);
        let later = self.readings.partition_point(|(at, _)| *at <= begin);
        self.readings.range(later.saturating_sub(1)..).map(|(_, reading)| reading.as_slice())
    }
}

pub fn mean(readings: &[&[f64]]) -> Vec<f64> {
    let mut mean = vec![0.0; readings.first().map_or(0, |reading| reading.len())];
    for reading in readings {
        mean.iter_mut().zip(*reading).for_each(|(mean, value)| *mean += value / readings.len() as f64);
    }
    mean
}
