//! Percentiles, and the spread of a figure over seeds.

/// The `percent`-th percentile of values in rising order, linear between them; `None` of nothing.
pub fn percentile(sorted: &[f64], percent: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = percent.clamp(0.0, 100.0) / 100.0 * last as f64;
    let below = place.floor() as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    Some(low + (high - low) * place.fract())
}

/// The median of values in any order; `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    percentile(&values, 50.0)
}

/// Where a figure lies over many seeds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Half of the seeds lie below.
    pub median: f64,
    /// One in twenty lies below.
    pub p05: f64,
    /// One in twenty lies above.
    pub p95: f64,
}

impl Spread {
    /// The same spread in another unit, of which one of this makes `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self { median: self.median * factor, p05: self.p05 * factor, p95: self.p95 * factor }
    }

    /// The spread of some values, in any order; `None` of nothing.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        Some(Self {
            median: percentile(&values, 50.0)?,
            p05: percentile(&values, 5.0)?,
            p95: percentile(&values, 95.0)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_lie_between_the_values() {
        let values = [1.0, 2.0, 4.0, 8.0, 16.0];
        assert_eq!(percentile(&values, 0.0), Some(1.0));
        assert_eq!(percentile(&values, 50.0), Some(4.0));
        assert_eq!(percentile(&values, 60.0), Some(5.6));
        assert_eq!(percentile(&values, 100.0), Some(16.0));
        assert_eq!(percentile(&[3.0], 95.0), Some(3.0));
        assert_eq!(percentile(&[], 50.0), None);
        assert_eq!((median(vec![8.0, 1.0, 2.0]), median(vec![])), (Some(2.0), None));
    }

    #[test]
    fn a_spread_does_not_mind_the_order() {
        let spread = Spread::of((0..=100).rev().map(f64::from).collect()).unwrap();
        assert_eq!(spread, Spread { median: 50.0, p05: 5.0, p95: 95.0 });
        assert_eq!(Spread::of(vec![]), None);
    }
}
