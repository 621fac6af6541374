use super::stretch::{LONGEST_SPAN, REST_SPAN, Stretch, mean};

/// Limit of noise, in standard deviations; Gaussian noise exceeds it once in 10¹⁴ values.
pub const NOISE_LIMIT_SD: f64 = 8.0;
/// Limit on the difference between half means at rest, in its standard deviations.
const REST_SD: f64 = 3.5;
/// Limit on the variance about a line over that of successive differences; 25-fold repeated values reach it.
const LARGEST_CORRELATION: f64 = 25.0;
const MOST_DECIMALS: i32 = 9;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Noise {
    sd: f64,
    /// Ratio of the variance of a mean to that of independent readings.
    correlation: f64,
    drift_per_s: f64,
}

/// Untouched reading and noise of each channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    pub mean: Vec<f64>,
    noise: Vec<Noise>,
}

impl Baseline {
    /// Baseline of a stretch at rest, or with a steady drift over [`LONGEST_SPAN`]; `None` otherwise.
    pub fn learn(stretch: &Stretch) -> Option<Self> {
        let readings = stretch.for_noise()?;
        let span_s = -readings.first()?.0;
        let noise: Option<Vec<Noise>> =
            (0..readings[0].1.len()).map(|channel| Noise::learn(&readings, channel)).collect();
        let latest = stretch.latest()?;
        let baseline = Self { mean: mean(&latest), noise: noise? };
        let is_steady = span_s >= 0.95 * LONGEST_SPAN.as_secs_f64();
        let still = Self {
            noise: baseline.noise.iter().map(|noise| Noise { drift_per_s: 0.0, ..*noise }).collect(),
            ..baseline.clone()
        };
        let all: Vec<&[f64]> = readings.iter().map(|(_, reading)| *reading).collect();
        (is_steady || still.is_at_rest(&all, 0.0)).then_some(baseline)
    }

    pub fn noise_sd(&self) -> Vec<f64> {
        self.noise.iter().map(|noise| noise.sd).collect()
    }

    /// Largest deviation, in standard deviations.
    pub fn size(&self, reading: &[f64]) -> f64 {
        self.size_of(&self.deviation(reading))
    }

    /// Largest component, in standard deviations.
    pub fn size_of(&self, deviation: &[f64]) -> f64 {
        deviation
            .iter()
            .zip(&self.noise)
            .map(|(deviation, noise)| deviation.abs() / noise.sd)
            .fold(0.0, f64::max)
    }

    pub fn deviation(&self, reading: &[f64]) -> Vec<f64> {
        reading.iter().zip(&self.mean).map(|(value, mean)| value - mean).collect()
    }

    /// Euclidean norm in standard deviations.
    pub fn length_of(&self, deviation: &[f64]) -> f64 {
        deviation
            .iter()
            .zip(&self.noise)
            .map(|(deviation, noise)| (deviation / noise.sd).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Inner product in standard deviations.
    pub fn product_of(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.noise).map(|((a, b), noise)| a * b / noise.sd.powi(2)).sum()
    }

    /// True if the means of both halves agree within noise, drift and `allowed` standard deviations.
    ///
    /// One standard deviation is always allowed, because single readings are recorded.
    pub fn is_at_rest(&self, readings: &[&[f64]], allowed: f64) -> bool {
        let (first, second) = readings.split_at(readings.len() / 2);
        let sd_of_difference = (1.0 / first.len() as f64 + 1.0 / second.len() as f64).sqrt();
        let half_s = 0.5 * REST_SPAN.as_secs_f64();
        let (first, second) = (mean(first), mean(second));
        first.iter().zip(&second).zip(&self.noise).all(|((first, second), noise)| {
            let by_noise = REST_SD * sd_of_difference * noise.correlation.sqrt();
            // Factor 2, because the drift changes slowly.
            let by_drift = 2.0 * noise.drift_per_s.abs() * half_s;
            (first - second).abs() <= (by_noise.max(1.0) + allowed) * noise.sd + by_drift
        })
    }

    pub fn change(&self, readings: &[&[f64]]) -> f64 {
        let (first, second) = readings.split_at(readings.len() / 2);
        let (first, second) = (mean(first), mean(second));
        let change: Vec<f64> = first.iter().zip(&second).map(|(first, second)| second - first).collect();
        self.size_of(&change)
    }
}

impl Noise {
    /// Noise of a channel; `None` if the channel moves.
    ///
    /// The variance of independent readings is half the mean square of successive differences (von Neumann
    /// 1941), unaffected by slow drift. Filtered or repeated values have smaller differences: the ratio to the
    /// variance about a line is the correlation.
    fn learn(readings: &[(f64, &[f64])], channel: usize) -> Option<Self> {
        let values: Vec<(f64, f64)> =
            readings.iter().map(|(at_s, reading)| (*at_s, reading[channel])).collect();
        let n = values.len() as f64;
        let squares: f64 = values.windows(2).map(|pair| (pair[1].1 - pair[0].1).powi(2)).sum();
        let of_differences = 0.5 * squares / (n - 1.0);
        let (mean_s, mean) =
            values.iter().fold((0.0, 0.0), |(s, v), (at_s, value)| (s + at_s / n, v + value / n));
        let (mut across, mut along) = (0.0, 0.0);
        for (at_s, value) in &values {
            across += (at_s - mean_s) * (value - mean);
            along += (at_s - mean_s).powi(2);
        }
        let drift_per_s = if along > 0.0 { across / along } else { 0.0 };
        let residuals = values.iter().map(|(at_s, value)| value - mean - drift_per_s * (at_s - mean_s));
        let about_line = residuals.map(|residual| residual * residual).sum::<f64>() / (n - 2.0).max(1.0);
        // A constant channel may still change by one step.
        let least_sd = (0.5 * resolution(&values)).max(1e-9 * mean.abs()).max(f64::MIN_POSITIVE.sqrt());
        let least = least_sd * least_sd;
        let correlation = about_line.max(least) / of_differences.max(least);
        (correlation <= LARGEST_CORRELATION).then(|| Self {
            sd: about_line.max(of_differences).max(least).sqrt(),
            correlation: correlation.max(1.0),
            drift_per_s,
        })
    }
}

/// Largest decimal step that divides all values; 0 without one.
fn resolution(values: &[(f64, f64)]) -> f64 {
    let is_multiple = |value: f64, scale: f64| {
        let scaled = value * scale;
        (scaled - scaled.round()).abs() <= 1e-9 * scaled.abs().max(1.0)
    };
    (0..=MOST_DECIMALS)
        .map(|decimals| 10f64.powi(decimals))
        .find(|scale| values.iter().all(|(_, value)| is_multiple(*value, *scale)))
        .map_or(0.0, f64::recip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use std::time::Duration;

    fn stretch(values: impl Iterator<Item = f64>) -> Stretch {
        let mut stretch = Stretch::default();
        values.enumerate().for_each(|(i, value)| stretch.add(Duration::from_millis(10 * i as u64), &[value]));
        stretch
    }

    fn noise(count: usize) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        (0..count).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    #[test]
    fn learns_the_noise_of_independent_readings() {
        let baseline = Baseline::learn(&stretch(noise(250).into_iter())).unwrap();
        assert!((0.85..1.15).contains(&baseline.noise[0].sd), "{baseline:?}");
    }

    #[test]
    fn learns_the_noise_of_repeated_values() {
        let values = noise(25);
        let baseline = Baseline::learn(&stretch((0..250).map(|i| values[i / 10]))).unwrap();
        assert!((0.6..1.4).contains(&baseline.noise[0].sd), "{baseline:?}");
        assert!((4.0..25.0).contains(&baseline.noise[0].correlation), "{baseline:?}");
    }

    #[test]
    fn accepts_a_steady_drift_after_three_seconds_only() {
        let drifting = |count: usize| {
            let values = noise(count);
            stretch((0..count).map(move |i| values[i] + 0.2 * i as f64))
        };
        assert_eq!(Baseline::learn(&drifting(200)), None);
        let baseline = Baseline::learn(&drifting(301)).unwrap();
        assert!((baseline.noise[0].drift_per_s - 20.0).abs() < 0.5, "{baseline:?}");
    }

    #[test]
    fn refuses_a_moving_surface() {
        let values = noise(300);
        assert_eq!(
            Baseline::learn(&stretch((0..300).map(|i| values[i] + 300.0 * (0.02 * i as f64).sin()))),
            None
        );
    }

    #[test]
    fn a_constant_channel_may_flip_by_its_resolution() {
        let baseline = Baseline::learn(&stretch((0..250).map(|_| 512.0))).unwrap();
        assert!(baseline.size(&[513.0]) < NOISE_LIMIT_SD);
        assert!(baseline.size(&[520.0]) > NOISE_LIMIT_SD);
    }
}
