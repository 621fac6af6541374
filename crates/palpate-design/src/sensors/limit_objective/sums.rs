//! What each criterion sums over the contacts.

use super::{Block, LANES};

/// What is summed, block by block. The second sum is the mean standard deviation, where ties are to be broken.
pub(super) trait Sums {
    fn fold(&self, first: &mut Block, second: &mut Block, weight: &Block, variance: &Block, shrink: &Block);

    fn join(lanes: &Block) -> f64 {
        lanes.iter().sum()
    }
}

/// The mean standard deviation.
pub(super) struct Mean;
/// The largest variance.
pub(super) struct Worst;
/// The share of contacts whose variance is above this one.
pub(super) struct Without(pub f64);
/// The mean of −½·ln of the factors by which det C shrinks.
pub(super) struct Shrinking;

impl Sums for Mean {
    #[inline(always)]
    fn fold(&self, first: &mut Block, _: &mut Block, weight: &Block, variance: &Block, _: &Block) {
        for lane in 0..LANES {
            first[lane] += weight[lane] * variance[lane].sqrt();
        }
    }
}

impl Sums for Worst {
    #[inline(always)]
    fn fold(&self, first: &mut Block, second: &mut Block, weight: &Block, variance: &Block, _: &Block) {
        for lane in 0..LANES {
            first[lane] = first[lane].max(variance[lane]);
            second[lane] += weight[lane] * variance[lane].sqrt();
        }
    }

    fn join(lanes: &Block) -> f64 {
        lanes.iter().copied().fold(0.0, f64::max)
    }
}

impl Sums for Without {
    #[inline(always)]
    fn fold(&self, first: &mut Block, second: &mut Block, weight: &Block, variance: &Block, _: &Block) {
        for lane in 0..LANES {
            first[lane] += if variance[lane] > self.0 { weight[lane] } else { 0.0 };
            second[lane] += weight[lane] * variance[lane].sqrt();
        }
    }
}

impl Sums for Shrinking {
    #[inline(always)]
    fn fold(&self, first: &mut Block, _: &mut Block, weight: &Block, _: &Block, shrink: &Block) {
        for lane in 0..LANES {
            first[lane] -= 0.5 * weight[lane] * shrink[lane].ln();
        }
    }
}
