//! Means, variances, quantiles.

/// Mean; NaN for no values.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// Mean, and mean square of the differences from it.
pub fn mean_and_variance<I: Iterator<Item = f64> + Clone>(values: I) -> (f64, f64) {
    let middle = mean(values.clone());
    (middle, mean(values.map(|value| (value - middle).powi(2))))
}

/// Standard error of the mean; 0 for a single value.
pub fn standard_error(values: &[f64]) -> f64 {
    let (_, variance) = mean_and_variance(values.iter().copied());
    (variance / (values.len() as f64 - 1.0).max(1.0)).sqrt()
}

/// Root mean square.
pub fn root_mean_square(values: &[f64]) -> f64 {
    mean(values.iter().map(|value| value * value)).sqrt()
}

/// Percentile of ascending values, interpolated; `None` for no values.
pub fn percentile(sorted: &[f64], percent: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = percent.clamp(0.0, 100.0) / 100.0 * last as f64;
    let below = place.floor() as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    Some(low + (high - low) * place.fract())
}

/// Median; `None` for no values.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    percentile(&values, 50.0)
}

/// Smallest number of errors for [`conformal_95`].
pub const FEWEST_FOR_95: usize = 19;

/// ⌈0.95·(n + 1)⌉-th smallest of n absolute errors, a 95 % bound; `None` below [`FEWEST_FOR_95`] (Vovk,
/// Gammerman and Shafer, *Algorithmic Learning in a Random World*, 2005).
pub fn conformal_95(mut sizes: Vec<f64>) -> Option<f64> {
    sizes.sort_by(f64::total_cmp);
    let number = (0.95 * (sizes.len() + 1) as f64).ceil() as usize;
    sizes.get(number.checked_sub(1)?).copied()
}

/// 95 % bound of absolute errors of a further group; `None` below [`FEWEST_FOR_95`] groups.
///
/// Groups have equal weights (Dunn, Wasserman and Ramdas, *Journal of the American Statistical Association*
/// 118, 2023). The bound is the interpolated quantile at 0.95·(n + 1)/n (Hutson, *Statistics and Probability
/// Letters* 42, 1999), n the effective sample size (Kish, *Survey Sampling*, 1965).
pub fn conformal_95_of_groups(groups: &[&[f64]]) -> Option<f64> {
    const SHARE: f64 = 0.95;
    if groups.len() < FEWEST_FOR_95 || groups.iter().any(|group| group.is_empty()) {
        return None;
    }
    let count = groups.len() as f64;
    let weighted = |group: &&[f64]| {
        let weight = 1.0 / (count * group.len() as f64);
        group.iter().map(|size| (*size, weight)).collect::<Vec<_>>()
    };
    let mut sizes: Vec<(f64, f64)> = groups.iter().flat_map(weighted).collect();
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let quantile = weighted_quantile(&sizes, SHARE);
    let share_beyond =
        |group: &&[f64]| group.iter().filter(|size| **size > quantile).count() as f64 / group.len() as f64;
    let (_, variance) = mean_and_variance(groups.iter().map(share_beyond));
    let independent = (SHARE * (1.0 - SHARE) * (count - 1.0) / variance).clamp(count, sizes.len() as f64);
    Some(weighted_quantile(&sizes, SHARE * (1.0 + 1.0 / independent)))
}

/// Quantile of ascending values with weights of sum 1.
fn weighted_quantile(values: &[(f64, f64)], share: f64) -> f64 {
    let (mut cumulated, mut below) = (0.0, f64::NAN);
    for (value, weight) in values {
        if cumulated + weight >= share {
            let part = (share - cumulated) / weight;
            // Equal values need no interpolation, and could overflow.
            return if *value > below { below + part * (value - below) } else { *value };
        }
        (cumulated, below) = (cumulated + weight, *value);
    }
    below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_sizes_of_a_group_count_as_one() {
        let sizes: Vec<f64> = (1..=60).map(f64::from).collect();
        let single: Vec<&[f64]> = sizes.chunks(1).collect();
        let bound = |groups: &[&[f64]]| conformal_95_of_groups(groups).unwrap();
        assert!((bound(&single[..19]) - 19.0).abs() < 1e-9);
        assert!((bound(&single) - 0.95 * 61.0).abs() < 0.06, "{}", bound(&single));
        let repeated: Vec<Vec<f64>> = sizes.iter().map(|size| vec![*size; 7]).collect();
        let repeated: Vec<&[f64]> = repeated.iter().map(Vec::as_slice).collect();
        assert!((bound(&repeated) - bound(&single)).abs() < 1.0);
        // The errors of groups with equal values are independent.
        let thousand: Vec<f64> = (1..=1000).map(f64::from).collect();
        assert!((bound(&[thousand.as_slice(); 20]) - 950.0).abs() < 1.0);
        assert_eq!(conformal_95_of_groups(&single[..18]), None);
        assert_eq!(conformal_95_of_groups(&[&[][..]; 20]), None);
        assert_eq!(bound(&[&[f64::MAX][..]; 20]), f64::MAX);
    }

    #[test]
    fn nineteen_errors_in_twenty_are_within_the_conformal_bound() {
        let sizes = |count: u32| (1..=count).rev().map(f64::from).collect();
        assert_eq!(conformal_95(sizes(99)), Some(95.0));
        assert_eq!(conformal_95(sizes(FEWEST_FOR_95 as u32)), Some(19.0));
        assert_eq!(conformal_95(sizes(FEWEST_FOR_95 as u32 - 1)), None);
        assert_eq!(conformal_95(Vec::new()), None);
    }

    #[test]
    fn percentiles_lie_between_the_values() {
        let values = [1.0, 2.0, 4.0, 8.0, 16.0];
        assert_eq!(percentile(&values, 0.0), Some(1.0));
        assert_eq!(percentile(&values, 50.0), Some(4.0));
        assert_eq!(percentile(&values, 60.0), Some(5.6));
        assert_eq!(percentile(&values, 100.0), Some(16.0));
        assert_eq!(percentile(&[3.0], 95.0), Some(3.0));
        assert_eq!(percentile(&[], 50.0), None);
    }

    #[test]
    fn moments_and_median_are_those_of_the_textbook() {
        let values = vec![2.0, 9.0, 4.0, 5.0];
        assert_eq!(mean_and_variance(values.iter().copied()), (5.0, 6.5));
        assert!((standard_error(&values) - (26.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15);
        assert!((root_mean_square(&values) - 31.5f64.sqrt()).abs() < 1e-15);
        assert_eq!(standard_error(&[7.0]), 0.0);
        assert_eq!(median(values), Some(4.5));
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert!(mean([]).is_nan() && median(Vec::new()).is_none());
    }
}
