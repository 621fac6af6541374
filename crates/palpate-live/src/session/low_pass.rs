use palpate_numerics::OutOfRange;
use std::f64::consts::TAU;

const RANGE_HZ: std::ops::RangeInclusive<f64> = 1e-6..=1e9;
const RANGE_IN_WORDS: &str = "at least 0.000001 Hz and at most 1000000000 Hz";

/// First-order low-pass filter: y ← x + (y − x)·exp(−T/τ), with the reading x, the time T since the last one,
/// and τ = 1/(2π·f).
///
/// It multiplies the standard deviation of independent noise by √(α/(2 − α)), α = 1 − exp(−T/τ).
#[derive(Clone, Debug)]
pub struct LowPass {
    time_constant_s: f64,
    state: Option<(Vec<f64>, u64)>,
}

impl LowPass {
    /// Cut-off frequency of 1e-6 to 1e9 Hz.
    pub fn new(cutoff_hz: f64) -> Result<Self, OutOfRange> {
        let number = [("the cut-off frequency", cutoff_hz)];
        OutOfRange::check(RANGE_IN_WORDS, number, |cutoff_hz| RANGE_HZ.contains(&cutoff_hz))?;
        Ok(Self { time_constant_s: 1.0 / (TAU * cutoff_hz), state: None })
    }

    pub fn reset(&mut self) {
        self.state = None;
    }

    /// Filters a finite reading; its time in ns increases.
    pub fn filter(&mut self, unix_ns: u64, reading: &[f64]) -> &[f64] {
        let (filtered, last_ns) = self.state.get_or_insert_with(|| (reading.to_vec(), unix_ns));
        let step_s = unix_ns.saturating_sub(*last_ns) as f64 * 1e-9;
        let kept = (-step_s / self.time_constant_s).exp();
        for (filtered, value) in filtered.iter_mut().zip(reading) {
            // A weighted sum, because the difference of very large values may be infinite.
            *filtered = kept * *filtered + (1.0 - kept) * value;
        }
        *last_ns = unix_ns;
        filtered
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    const TAU_S: f64 = 0.1 / TAU;

    fn ns(time_s: f64) -> u64 {
        1_000_000_000 + (time_s * 1e9).round() as u64
    }

    #[test]
    fn a_step_is_followed_alike_however_irregular_the_readings_are() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let regular: Vec<f64> = (1..=1000).map(|i| f64::from(i) * TAU_S / 1000.0).collect();
        let mut irregular: Vec<f64> = (0..300).map(|_| rng.random_range(0.0..TAU_S)).collect();
        irregular.sort_by(f64::total_cmp);
        irregular.push(TAU_S);
        for times_s in [vec![TAU_S], regular, irregular] {
            let mut filter = LowPass::new(10.0).unwrap();
            assert_eq!(filter.filter(ns(0.0), &[0.0]), [0.0]);
            let risen = times_s.iter().fold(0.0, |_, time_s| filter.filter(ns(*time_s), &[1.0])[0]);
            assert!((risen - (1.0 - (-1.0f64).exp())).abs() < 1e-6, "{} readings: {risen}", times_s.len());
        }
    }

    #[test]
    fn at_the_cut_off_a_sine_is_lower_by_3_db_and_noise_by_the_formula() {
        let (rate_hz, mut filter) = (10_000.0, LowPass::new(10.0).unwrap());
        let sine = |i: u32| (TAU * 10.0 * f64::from(i) / rate_hz).sin();
        let out = (0..30_000).map(|i| filter.filter(ns(f64::from(i) / rate_hz), &[sine(i)])[0]);
        let peak = out.skip(20_000).fold(0.0, f64::max);
        assert!((peak - 0.5f64.sqrt()).abs() < 0.005, "{peak}");

        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let mut filter = LowPass::new(10.0).unwrap();
        let alpha = 1.0 - (-1e-3 / TAU_S).exp();
        let mut squares = 0.0;
        for i in 0..200_000 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            squares += filter.filter(ns(f64::from(i) * 1e-3), &[noise])[0].powi(2) / 200_000.0;
        }
        let expected = alpha / (2.0 - alpha);
        assert!((squares / expected - 1.0).abs() < 0.05, "{squares} {expected}");
    }

    #[test]
    fn a_reset_passes_the_next_reading_as_it_is_and_immense_readings_leave_it_in_numbers() {
        let mut filter = LowPass::new(1.0).unwrap();
        filter.filter(ns(0.0), &[f64::MAX, 1.0]);
        assert!(filter.filter(ns(0.1), &[-f64::MAX, 2.0]).iter().all(|value| value.is_finite()));
        filter.reset();
        assert_eq!(filter.filter(ns(0.2), &[3.0, 4.0]), [3.0, 4.0]);
    }

    #[test]
    fn a_cut_off_out_of_range_is_refused_with_its_value_and_bounds() {
        for cutoff_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-7] {
            let words = LowPass::new(cutoff_hz).unwrap_err().to_string();
            assert!(words.contains("the cut-off frequency is") && words.contains("0.000001 Hz"), "{words}");
        }
    }
}
