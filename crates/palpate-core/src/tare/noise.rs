//! Noise of the channels of an untouched surface.

/// Fewest readings of a known noise.
const NOISE_KNOWN: u32 = 20;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct NoiseEstimate<B> {
    /// Variance of each channel about the baseline.
    variance: B,
    readings: u32,
}

impl<B: AsRef<[f64]> + AsMut<[f64]>> NoiseEstimate<B> {
    pub fn new(zeros: B) -> Self {
        Self { variance: zeros, readings: 0 }
    }

    pub fn is_known(&self) -> bool {
        self.readings >= NOISE_KNOWN
    }

    /// Adds an untouched reading to the variance over at most `memory` readings.
    pub fn add(&mut self, reading: &[f64], baseline: &[f64], memory: u32) {
        self.readings = self.readings.saturating_add(1).min(memory);
        let share = 1.0 / f64::from(self.readings);
        for ((variance, value), baseline) in self.variance.as_mut().iter_mut().zip(reading).zip(baseline) {
            let deviation = value - baseline;
            *variance += share * (deviation * deviation - *variance);
        }
    }

    /// Σ (a − b)² / variance. A channel without noise, as from a coarse converter, gets the mean variance.
    pub fn square_distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let variances = self.variance.as_ref();
        let mean = variances.iter().sum::<f64>() / variances.len().max(1) as f64;
        let variance = |own: f64| match (own > 0.0, mean > 0.0) {
            (true, _) => own,
            (false, true) => mean,
            (false, false) => 1.0,
        };
        let channels = a.iter().zip(b).zip(variances);
        channels.map(|((a, b), own)| (a - b) * (a - b) / variance(*own)).sum()
    }
}
