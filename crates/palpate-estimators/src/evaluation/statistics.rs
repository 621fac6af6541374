//! The spread of a figure over seeds.

use palpate_numerics::percentile;

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
    fn a_spread_does_not_mind_the_order() {
        let spread = Spread::of((0..=100).rev().map(f64::from).collect()).unwrap();
        assert_eq!(spread, Spread { median: 50.0, p05: 5.0, p95: 95.0 });
        assert_eq!(Spread::of(vec![]), None);
    }
}
