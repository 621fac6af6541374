//! Untouched, pressed, at rest, let go: the state of a surface by the course of its readings.

use std::collections::VecDeque;
use std::time::Duration;

/// Shortest stretch of readings that is judged, and the fewest readings in it.
const STRETCH: Duration = Duration::from_millis(400);
const FEWEST: usize = 8;
/// Stretch from which the noise is learnt, and the fewest readings in it.
const NOISE_STRETCH: Duration = Duration::from_secs(1);
const NOISE_FEWEST: usize = 20;
/// Deviation from the baseline that is a press, in standard deviations of the noise: noise alone reaches it once in 10¹⁴ values.
const PRESSED_SD: f64 = 8.0;
/// Difference of the means of two halves of a stretch at rest, in standard deviations of that difference.
const REST_SD: f64 = 3.5;
/// The same as a share of the press's own deviation: soft surfaces creep for minutes.
const REST_SHARE: f64 = 0.005;
/// Share of a press's deviation that may be left for a while when it has been let go.
const LEFT_SHARE: f64 = 0.05;

/// Readings of the last stretch of time.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    readings: VecDeque<(Duration, Vec<f64>)>,
}

impl Stretch {
    /// Adds a reading, and forgets those that are older than `keep`, of which the fewest are kept.
    pub fn add(&mut self, at: Duration, reading: &[f64]) {
        self.readings.push_back((at, reading.to_vec()));
        while self.readings.len() > NOISE_FEWEST
            && self.readings.get(1).is_some_and(|(second, _)| at.saturating_sub(*second) > NOISE_STRETCH)
        {
            self.readings.pop_front();
        }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.readings.clear();
    }

    /// The readings of the last `STRETCH`, where they are enough to judge by.
    fn latest(&self) -> Option<Vec<&[f64]>> {
        let end = self.readings.back()?.0;
        let begin = end.checked_sub(STRETCH)?;
        // One reading before the stretch shows that it is spanned.
        let is_spanned = self.readings.front()?.0 <= begin;
        let readings: Vec<_> = self
            .readings
            .iter()
            .filter(|(at, _)| *at >= begin)
            .map(|(_, reading)| reading.as_slice())
            .collect();
        (is_spanned && readings.len() >= FEWEST).then_some(readings)
    }

    /// All readings, where they are enough to learn the noise from.
    fn all(&self) -> Option<Vec<&[f64]>> {
        let span = self.readings.back()?.0.saturating_sub(self.readings.front()?.0);
        let readings: Vec<_> = self.readings.iter().map(|(_, reading)| reading.as_slice()).collect();
        (span >= NOISE_STRETCH && readings.len() >= NOISE_FEWEST).then_some(readings)
    }
}

/// Untouched reading and noise of each channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Mean of each channel.
    pub mean: Vec<f64>,
    /// Standard deviation of a reading of each channel.
    pub noise_sd: Vec<f64>,
}

impl Baseline {
    /// The baseline of a stretch at rest; `None` while it is too short, or not at rest.
    pub fn learn(stretch: &Stretch) -> Option<Self> {
        let readings = stretch.all()?;
        let mean = mean(&readings);
        let noise_sd = (0..mean.len()).map(|channel| noise_sd(&readings, channel)).collect();
        let baseline = Self { mean, noise_sd };
        rests(&readings, &baseline, 0.0).then_some(baseline)
    }

    /// True for a reading that no noise explains.
    pub fn is_pressed(&self, reading: &[f64]) -> bool {
        self.deviations(reading).any(|(deviation, sd)| deviation > PRESSED_SD * sd)
    }

    /// Mean of the last stretch, once it is at rest.
    pub fn settled(&self, stretch: &Stretch) -> Option<Vec<f64>> {
        let readings = stretch.latest()?;
        let mean = mean(&readings);
        rests(&readings, self, self.size(&mean)).then_some(mean)
    }

    /// Mean of the last stretch, once a press of mean reading `pressed` has been let go and what is left of it is at rest.
    pub fn released(&self, stretch: &Stretch, pressed: &[f64]) -> Option<Vec<f64>> {
        let readings = stretch.latest()?;
        let mean = mean(&readings);
        let size = self.size(pressed);
        let is_let_go =
            self.deviations(&mean).all(|(deviation, sd)| deviation <= PRESSED_SD.max(LEFT_SHARE * size) * sd);
        (is_let_go && rests(&readings, self, size)).then_some(mean)
    }

    /// Largest deviation of a reading in standard deviations of the noise.
    pub fn size(&self, reading: &[f64]) -> f64 {
        self.deviations(reading).map(|(deviation, sd)| deviation / sd).fold(0.0, f64::max)
    }

    /// Deviation of each channel, and the noise's standard deviation.
    fn deviations(&self, reading: &[f64]) -> impl Iterator<Item = (f64, f64)> {
        let baseline = self.mean.iter().zip(&self.noise_sd);
        reading.iter().zip(baseline).map(|(value, (mean, sd))| ((value - mean).abs(), *sd))
    }
}

/// True where the means of both halves of a stretch agree, by noise and by a share of a press of `size` standard deviations.
fn rests(readings: &[&[f64]], baseline: &Baseline, size: f64) -> bool {
    let (first, second) = readings.split_at(readings.len() / 2);
    let sd_of_difference = (1.0 / first.len() as f64 + 1.0 / second.len() as f64).sqrt();
    let most_sd = REST_SD * sd_of_difference + REST_SHARE * size;
    let (first, second) = (mean(first), mean(second));
    first
        .iter()
        .zip(&second)
        .zip(&baseline.noise_sd)
        .all(|((first, second), noise_sd)| (first - second).abs() <= most_sd * noise_sd)
}

fn mean(readings: &[&[f64]]) -> Vec<f64> {
    let mut mean = vec![0.0; readings.first().map_or(0, |reading| reading.len())];
    for reading in readings {
        mean.iter_mut().zip(*reading).for_each(|(mean, value)| *mean += value / readings.len() as f64);
    }
    mean
}

/// Standard deviation of a reading, from differences of readings that follow one another, which a slow drift leaves as they are: those of
/// independent readings have twice the variance of one. Never 0: a channel that has not moved yet may do so by any step.
fn noise_sd(readings: &[&[f64]], channel: usize) -> f64 {
    let differences = readings.windows(2).map(|pair| pair[1][channel] - pair[0][channel]);
    let sum: f64 = differences.map(|difference| difference * difference).sum();
    let variance = 0.5 * sum / (readings.len() - 1) as f64;
    let size = readings[0][channel].abs();
    variance.sqrt().max(1e-9 * size).max(f64::MIN_POSITIVE.sqrt())
}
