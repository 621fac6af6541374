//! Heavy tails of untouched readings.

use crate::status::SIGNIFICANCE;
use palpate_numerics::{normal_quantile, student_critical_value, student_ln_density};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeavyTails {
    /// ν.
    degrees_of_freedom: f64,
    /// The standard deviation is √(ν/(ν − 2)) times this.
    scale: f64,
}

impl HeavyTails {
    /// `None` for normality at the 5 % level, by likelihood ratio.
    pub fn of_deviations(deviations: &[(f64, f64)]) -> Option<Self> {
        /// At 2 the variance is infinite; beyond 40 tails are almost normal.
        const LEAST: f64 = 2.5;
        const POWERS: i32 = 8;
        let total: f64 = deviations.iter().map(|(_, weight)| weight).sum();
        let variance = deviations.iter().map(|(z, weight)| weight * z * z).sum::<f64>() / total;
        if !(variance > 0.0 && variance.is_finite()) {
            return None;
        }
        let normal = -0.5 * total * ((std::f64::consts::TAU * variance).ln() + 1.0);
        let tried = (0..=POWERS).map(|power| {
            let freedom = LEAST * f64::from(power).exp2().sqrt();
            let tails =
                Self { degrees_of_freedom: freedom, scale: most_likely_scale(deviations, variance, freedom) };
            (tails, tails.log_likelihood(deviations))
        });
        let (best, likelihood) = tried.max_by(|a, b| a.1.total_cmp(&b.1))?;
        // A normal distribution is the end of the family: half of the ratio's distribution is at 0.
        let bound = normal_quantile(1.0 - SIGNIFICANCE).powi(2);
        (2.0 * (likelihood - normal) > bound).then_some(best)
    }

    fn log_likelihood(&self, deviations: &[(f64, f64)]) -> f64 {
        let of_one = |(z, weight): &(f64, f64)| {
            weight * (student_ln_density(z / self.scale, self.degrees_of_freedom) - self.scale.ln())
        };
        deviations.iter().map(of_one).sum()
    }

    /// Critical value of Σ d²/2, d the difference of two deviations of variance 1 with this share of noise:
    /// one deviation exceeds x, the other channels have their mean (Foss, Korshunov and Zachary, *An
    /// Introduction to Heavy-Tailed and Subexponential Distributions*, 2013).
    pub fn bound(&self, channels: usize, share: f64, rate: f64) -> f64 {
        let n = channels as f64;
        let x = self.scale * student_critical_value(rate / (2.0 * n), self.degrees_of_freedom);
        0.5 * share * x * x + (n - 1.0)
    }
}

/// Expectation–maximization (Lange, Little and Taylor, *Journal of the American Statistical Association* 84,
/// 1989).
fn most_likely_scale(deviations: &[(f64, f64)], variance: f64, freedom: f64) -> f64 {
    const ROUNDS: usize = 30;
    let total: f64 = deviations.iter().map(|(_, weight)| weight).sum();
    let mut square = variance;
    for _ in 0..ROUNDS {
        let weighted = deviations
            .iter()
            .map(|(z, weight)| weight * z * z * (freedom + 1.0) / (freedom + z * z / square));
        square = weighted.sum::<f64>() / total;
    }
    square.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StudentT};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn deviations(freedom: f64, count: usize, seed: u64) -> Vec<(f64, f64)> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let t = StudentT::new(freedom).unwrap();
        (0..count).map(|_| (t.sample(&mut rng), 1.0)).collect()
    }

    #[test]
    fn heavy_tails_are_found_with_their_freedom_and_normal_ones_are_none() {
        for seed in 0..10 {
            let HeavyTails { degrees_of_freedom: freedom, scale } =
                HeavyTails::of_deviations(&deviations(4.0, 2000, seed)).unwrap();
            assert!((2.5..=6.0).contains(&freedom) && (scale - 1.0).abs() < 0.15, "{freedom} {scale}");
        }
        // One in twenty is significant by chance.
        let found = (0..100).filter(|seed| HeavyTails::of_deviations(&deviations(1e6, 300, *seed)).is_some());
        assert!(found.count() <= 12);
        assert_eq!(HeavyTails::of_deviations(&[]), None);
        assert_eq!(HeavyTails::of_deviations(&[(0.0, 1.0); 5]), None);
    }

    #[test]
    fn differences_of_heavy_tailed_rows_exceed_the_bound_at_the_rate() {
        const CHANNELS: usize = 6;
        let tails = HeavyTails { degrees_of_freedom: 4.0, scale: 0.5_f64.sqrt() };
        for rate in [0.01, 0.001] {
            let bound = tails.bound(CHANNELS, 1.0, rate);
            let rows = deviations(4.0, 2 * CHANNELS * 100_000, 1);
            let beyond = rows.chunks_exact(2 * CHANNELS).filter(|row| {
                let pairs = row.chunks_exact(2).map(|pair| tails.scale * (pair[0].0 - pair[1].0));
                pairs.map(|d| 0.5 * d * d).sum::<f64>() > bound
            });
            let share = beyond.count() as f64 / 100_000.0;
            assert!((0.7 * rate..1.5 * rate).contains(&share), "{share} beside {rate}");
        }
    }
}
