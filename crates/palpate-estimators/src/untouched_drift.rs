//! Drift of an untouched surface over a recording.

use crate::locator_fault::LocatorFault;
use crate::recording::Recording;
use crate::status::SIGNIFICANCE;
use crate::untouched_scatter::FEWEST_RESTS;
use palpate_mechanics::sensing::Layout;
use palpate_numerics::{mean, normal_quantile};
use serde::{Deserialize, Serialize};

/// Drift of the untouched reading over a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UntouchedDrift {
    /// Reading of the last rest.
    pub last: Vec<f64>,
    /// Range of each channel's untouched readings.
    pub range: Vec<f64>,
    /// Standard deviation of each random walk after 1 s.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walk_per_root_s: Vec<f64>,
    /// Time from the first to the last rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

impl UntouchedDrift {
    /// Returns a drift beyond noise.
    pub fn of_recording(recording: &Recording) -> Option<Self> {
        let rests = recording.untouched_groups();
        if rests.len() < FEWEST_RESTS {
            return None;
        }
        let channels = recording.channels.len();
        let levels: Vec<Vec<f64>> = rests.iter().map(|rest| recording.mean_reading(rest)).collect();
        let course = |channel: usize| levels.iter().map(|level| level[channel]).collect::<Vec<f64>>();
        // Level of each channel for an overall level `SIGNIFICANCE`.
        let share = SIGNIFICANCE / channels as f64;
        if !(0..channels).any(|channel| is_drifting(&course(channel), share)) {
            return None;
        }
        let range = |channel: usize| {
            let values = || rests.iter().flatten().map(|row| recording.rows[*row].reading[channel]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let rest_times_s = recording.times_s().map(|times_s| -> Vec<f64> {
            rests.iter().map(|rest| mean(rest.iter().map(|row| times_s[*row]))).collect()
        });
        let duration_s = |times_s: &Vec<f64>| times_s[times_s.len() - 1] - times_s[0];
        let walks = rest_times_s
            .as_ref()
            .map(|times_s| (0..channels).map(|channel| walk_per_root_s(&course(channel), times_s)).collect());
        Some(Self {
            walk_per_root_s: walks.unwrap_or_default(),
            duration_s: rest_times_s.as_ref().map(duration_s),
            last: levels.last()?.clone(),
            range: (0..channels).map(range).collect(),
        })
    }

    /// Twice the mean square deviation w²·T/15 of each walk from a line over the duration T.
    pub fn walk_variances(&self) -> Vec<f64> {
        let of = |duration_s: f64| {
            self.walk_per_root_s.iter().map(|walk| 2.0 / 15.0 * walk * walk * duration_s).collect()
        };
        self.duration_s.map_or_else(Vec::new, of)
    }

    /// Returns the largest change that counts as drift; infinite for disabled channels.
    pub fn largest_changes(&self, layout: &Layout) -> Vec<f64> {
        let reach = |(range, dead): (&f64, bool)| if dead { f64::INFINITY } else { *range };
        self.range
            .iter()
            .zip(layout.sensors().iter().map(|sensor| sensor.channel.disabled))
            .map(reach)
            .collect()
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
    pub fn check(&self, channels: usize) -> Result<(), LocatorFault> {
        LocatorFault::check_count("last untouched channels", channels, self.last.len())?;
        LocatorFault::check_count("ranges of untouched channels", channels, self.range.len())?;
        LocatorFault::check_numbers("last untouched reading", &self.last, |_| true, "a finite number")?;
        if !self.walk_per_root_s.is_empty() {
            LocatorFault::check_count("walks of untouched channels", channels, self.walk_per_root_s.len())?;
        }
        LocatorFault::check_numbers(
            "walk of untouched readings",
            self.walk_per_root_s.iter().copied(),
            |walk| walk >= 0.0,
            "finite and at least 0",
        )?;
        let is_time = |duration_s| duration_s >= 0.0;
        LocatorFault::check_numbers("time of rests", self.duration_s, is_time, "finite and at least 0")?;
        LocatorFault::check_numbers(
            "range of untouched readings",
            &self.range,
            |range| range >= 0.0,
            "finite and at least 0",
        )
    }
}

/// Von Neumann's ratio η = Σ(xᵢ₊₁ − xᵢ)²/Σ(xᵢ − x̄)² is about normal for n independent values, with mean 2
/// and variance 4·(n − 2)/(n² − 1), and small for drift (*Annals of Mathematical Statistics* 12, 1941).
fn is_drifting(values: &[f64], share: f64) -> bool {
    let n = values.len() as f64;
    let average = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|value| (value - average).powi(2)).sum();
    let steps: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    let bound = 2.0 + normal_quantile(share) * (4.0 * (n - 2.0) / (n * n - 1.0)).sqrt();
    squares > 0.0 && steps < bound * squares
}

/// With white noise σ², changes over k values have the mean square D_k = 2·σ² + w²·T_k, so w² = (D_k −
/// D₁)/(T_k − T₁); k is a quarter of the values.
fn walk_per_root_s(values: &[f64], times_s: &[f64]) -> f64 {
    let over = |lag: usize| {
        let changes = values.iter().zip(&values[lag..]).map(|(before, after)| (after - before).powi(2));
        let durations_s = times_s.iter().zip(&times_s[lag..]).map(|(before_s, after_s)| after_s - before_s);
        [mean(changes), mean(durations_s)]
    };
    let ([short, short_s], [long, long_s]) = (over(1), over((values.len() / 4).max(2)));
    if long > short && long_s > short_s { ((long - short) / (long_s - short_s)).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Row;
    use crate::setup::Setup;
    use palpate_core::Position;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn recording(presses: usize, drift: f64, seed: u64) -> Recording {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut row = |force_n: f64, press: usize| {
            let reading = [0.0, drift].map(|drift| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                100.0 * force_n + drift * press as f64 + noise
            });
            let position = Position::along(0.1);
            let (nuisances, time_s, reading) = (Vec::new(), None, reading.to_vec());
            Row { position, force_n: Some(force_n), nuisances, time_s, reading }
        };
        let rows =
            (0..presses).flat_map(|press| [2.0, 0.0, 0.0].map(|force_n| row(force_n, press))).collect();
        Recording::new(Setup::measured(0.3, &["a", "b"]).unwrap().layout(), "presses", rows)
    }

    #[test]
    fn noise_is_taken_for_a_drift_in_one_of_twenty_recordings() {
        let drifting = |seed: &u64| UntouchedDrift::of_recording(&recording(20, 0.0, *seed)).is_some();
        let found = (0..400).filter(drifting).count();
        // 20 expected, with a standard deviation of 4.4.
        assert!((7..=33).contains(&found), "{found}");
    }

    #[test]
    fn a_drift_is_as_large_as_the_range_of_the_untouched_rows() {
        let UntouchedDrift { last, range, .. } =
            UntouchedDrift::of_recording(&recording(20, 2.0, 1)).unwrap();
        assert!(last[0].abs() < 3.0 && (last[1] - 38.0).abs() < 3.0, "{last:?}");
        assert!(range[0] < 6.0 && (range[1] - 38.0).abs() < 6.0, "{range:?}");
    }

    #[test]
    fn a_walk_has_its_standard_deviation_after_a_second() {
        for walk in [0.5, 3.0] {
            let squares = (0..40).map(|seed| {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
                let mut at = 0.0;
                let values: Vec<f64> = (0..60)
                    .map(|_| {
                        at += 2.0 * walk * normal();
                        at + normal()
                    })
                    .collect();
                let times_s: Vec<f64> = (0..60).map(|i| 4.0 * f64::from(i)).collect();
                walk_per_root_s(&values, &times_s).powi(2)
            });
            let found = mean(squares).sqrt();
            assert!((found / walk - 1.0).abs() < 0.3, "{found} beside {walk}");
        }
    }

    #[test]
    fn four_rests_show_no_drift() {
        assert_eq!(UntouchedDrift::of_recording(&recording(4, 50.0, 1)), None);
    }
}
