//! Means, medians and shares with their Monte-Carlo standard errors.

use crate::table::Figure;
use std::collections::BTreeMap;

/// Values by calibration, each a cluster: its readings share errors.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    clusters: BTreeMap<u64, Vec<f64>>,
}

impl Sample {
    pub fn add(&mut self, calibration: u64, value: f64) {
        self.clusters.entry(calibration).or_default().push(value);
    }

    pub fn len(&self) -> usize {
        self.clusters.values().map(Vec::len).sum()
    }

    pub fn is_empty(&self) -> bool {
        self.clusters.is_empty()
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        self.clusters.values().flatten().copied()
    }

    /// Mean x̄ of n values. Standard error: the larger of s/√n and, over G clusters of nᵢ values with sums sᵢ, √(G/(G − 1)·Σ(sᵢ − x̄·nᵢ)²)/n.
    pub fn mean(&self) -> Option<Figure> {
        let mean = self.values().sum::<f64>() / self.len() as f64;
        let squares: f64 = self.values().map(|value| (value - mean).powi(2)).sum();
        let independent = (squares / (self.len() as f64 - 1.0).max(1.0) / self.len() as f64).sqrt();
        self.figure(mean, self.error_of_several(independent.max(self.clustered_error(mean))))
    }

    /// Median. Standard error: the larger of half the distance between the order statistics n/2 ± √n/2, and that of the mean of the clusters'
    /// medians.
    pub fn median(&self) -> Option<Figure> {
        let sorted = sorted(self.values());
        let median = median_of_sorted(&sorted)?;
        let (half, reach) = (0.5 * (sorted.len() - 1) as f64, 0.5 * (sorted.len() as f64).sqrt());
        let rank = |rank: f64| sorted[(rank.round().max(0.0) as usize).min(sorted.len() - 1)];
        let [low, high] = [rank(half - reach), rank(half + reach)];
        let medians: Vec<f64> = self
            .clusters
            .values()
            .filter_map(|values| median_of_sorted(&self::sorted(values.iter().copied())))
            .collect();
        let between = match medians.len() {
            0 | 1 => 0.0,
            count => {
                let mean = medians.iter().sum::<f64>() / count as f64;
                let squares: f64 = medians.iter().map(|median| (median - mean).powi(2)).sum();
                (squares / (count as f64 - 1.0) / count as f64).sqrt()
            }
        };
        self.figure(median, self.error_of_several((0.5 * (high - low)).max(between)))
    }

    fn clustered_error(&self, mean: f64) -> f64 {
        let count = self.clusters.len() as f64;
        if count < 2.0 {
            return 0.0;
        }
        let deviation = |values: &Vec<f64>| values.iter().sum::<f64>() - mean * values.len() as f64;
        let squares: f64 = self.clusters.values().map(|values| deviation(values).powi(2)).sum();
        (count / (count - 1.0) * squares).sqrt() / self.len() as f64
    }

    /// One value has no standard error.
    fn error_of_several(&self, standard_error: f64) -> Option<f64> {
        (self.len() > 1).then_some(standard_error)
    }

    fn figure(&self, value: f64, standard_error: Option<f64>) -> Option<Figure> {
        let is_finite = value.is_finite() && standard_error.is_none_or(f64::is_finite);
        (!self.is_empty() && is_finite).then_some(Figure { value, standard_error })
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

fn median_of_sorted(sorted: &[f64]) -> Option<f64> {
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        length if length % 2 == 1 => Some(sorted[middle]),
        _ => Some(0.5 * (sorted[middle - 1] + sorted[middle])),
    }
}

#[derive(Clone, Debug, Default)]
pub struct Share(Sample);

impl Share {
    pub fn add(&mut self, calibration: u64, has_property: bool) {
        self.0.add(calibration, f64::from(u8::from(has_property)));
    }

    /// Share k/n in %. Standard error: the larger of that by clusters and √(p̃(1 − p̃)/n), p̃ = (k + ½)/(n + 1), positive also for k = 0 and k = n.
    pub fn percent(&self) -> Option<Figure> {
        let (count, cases) = (self.0.values().sum::<f64>(), self.0.len() as f64);
        let smoothed = (count + 0.5) / (cases + 1.0);
        let independent = (smoothed * (1.0 - smoothed) / cases).sqrt();
        let share = count / cases;
        self.0.figure(100.0 * share, Some(100.0 * independent.max(self.0.clustered_error(share))))
    }
}

/// Numerators and denominators by calibration.
#[derive(Clone, Debug, Default)]
pub struct Ratio {
    clusters: BTreeMap<u64, Vec<[f64; 2]>>,
}

impl Ratio {
    pub fn add(&mut self, calibration: u64, numerator: f64, denominator: f64) {
        self.clusters.entry(calibration).or_default().push([numerator, denominator]);
    }

    /// Ratio R = Σa/Σb. Standard error: that of Σ(a − R·b), divided by Σb (delta method).
    pub fn figure(&self) -> Option<Figure> {
        let pairs = || self.clusters.values().flatten();
        let [numerator, denominator] = pairs().fold([0.0; 2], |[a, b], pair| [a + pair[0], b + pair[1]]);
        let value = numerator / denominator;
        let mut residuals = Sample::default();
        for (calibration, pairs) in &self.clusters {
            pairs.iter().for_each(|[a, b]| residuals.add(*calibration, a - value * b));
        }
        let mean = residuals.mean()?;
        let standard_error = mean.standard_error.map(|error| error * residuals.len() as f64 / denominator);
        value.is_finite().then_some(Figure { value, standard_error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_of_a_ratio_vanishes_with_its_residuals() {
        let mut ratio = Ratio::default();
        assert_eq!(ratio.figure(), None);
        (1..=20).for_each(|i| ratio.add(i % 4, 2.0 * i as f64, i as f64));
        let exact = ratio.figure().unwrap();
        assert!((exact.value - 2.0).abs() < 1e-12 && exact.standard_error.unwrap() < 1e-12, "{exact:?}");
        // With equal denominators the error is that of the mean of the numerators.
        let (mut ratio, mut sample) = (Ratio::default(), Sample::default());
        for i in 0..30_u64 {
            let value = (i * 7 % 11) as f64;
            ratio.add(i % 5, value, 4.0);
            sample.add(i % 5, value);
        }
        let (ratio, mean) = (ratio.figure().unwrap(), sample.mean().unwrap());
        assert!((4.0 * ratio.standard_error.unwrap() - mean.standard_error.unwrap()).abs() < 1e-12);
    }

    fn sample(clusters: &[&[f64]]) -> Sample {
        let mut sample = Sample::default();
        for (calibration, values) in (0..).zip(clusters) {
            values.iter().for_each(|value| sample.add(calibration, *value));
        }
        sample
    }

    #[test]
    fn error_of_a_mean_is_that_of_independent_values_or_of_clusters() {
        let alone = sample(&[&[1.0], &[2.0], &[3.0], &[4.0]]).mean().unwrap();
        assert_eq!(alone.value, 2.5);
        // s² = 5/3.
        assert!((alone.standard_error.unwrap() - (5.0_f64 / 12.0).sqrt()).abs() < 1e-12);
        // Values that agree within their calibrations count as one each.
        let clustered = sample(&[&[1.0; 50], &[3.0; 50]]).mean().unwrap();
        assert!((clustered.standard_error.unwrap() - 1.0).abs() < 1e-12, "{clustered:?}");
    }

    #[test]
    fn error_of_a_median_is_near_that_of_normal_theory() {
        // Quantiles of the logistic distribution, whose median has the standard error 2/√n.
        let quantile = |i: usize| ((i as f64 + 0.5) / 400.0, ()).0;
        let values: Vec<f64> = (0..400).map(|i| (quantile(i) / (1.0 - quantile(i))).ln()).collect();
        let median = sample(&[&values]).median().unwrap();
        assert!(
            median.value.abs() < 1e-9 && (median.standard_error.unwrap() / 0.1 - 1.0).abs() < 0.1,
            "{median:?}"
        );
        assert_eq!(sample(&[&[1.0, f64::INFINITY]]).median(), None);
        assert_eq!(Sample::default().median(), None);
        assert_eq!(sample(&[&[3.0]]).median(), Some(Figure::exact(3.0)));
        assert_eq!(sample(&[&[3.0]]).mean(), Some(Figure::exact(3.0)));
    }

    #[test]
    fn share_without_a_case_has_no_figure_and_a_full_one_a_positive_error() {
        let mut share = Share::default();
        assert_eq!(share.percent(), None);
        (0..20).for_each(|_| share.add(0, true));
        let full = share.percent().unwrap();
        assert!(full.value == 100.0 && (2.0..5.0).contains(&full.standard_error.unwrap()), "{full:?}");
    }
}
