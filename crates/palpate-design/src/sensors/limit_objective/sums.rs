//! Variance of every contact with one more sensor, summed over blocks of eight contacts: the innermost loop
//! of the searches.
//!
//! [`sum_up`] loops over lanes, which compilers vectorize; [`run_loops`] selects AVX2 at run time. Both do
//! equal operations in equal order without fusing, so sums and layouts are bitwise equal on all machines.
//! (The logarithms of D-optimality are the C library's.)

use super::{Block, LANES, packed};
use palpate_numerics::simd::{Kernel, Simd, run_loops};

#[derive(Clone, Copy)]
pub(super) struct Contacts<'a> {
    /// [entry of the covariance's lower triangle][block of contacts]
    pub covariances: &'a [Block],
    /// [unknown][block]
    pub row: &'a [Block],
    /// [block]
    pub weights: &'a [Block],
}

/// Folds two values of each contact into sums: position variance, and shrink factor of det C.
pub(super) fn folded<const P: usize, const FIRST: usize, S: Sums>(contacts: Contacts, sums: &S) -> [f64; 2] {
    run_loops(Fold::<P, FIRST, S> { contacts, sums })
}

struct Fold<'a, const P: usize, const FIRST: usize, S> {
    contacts: Contacts<'a>,
    sums: &'a S,
}

impl<const P: usize, const FIRST: usize, S: Sums> Kernel for Fold<'_, P, FIRST, S> {
    type Output = [f64; 2];
    const FUSED: bool = false;

    #[inline(always)]
    fn run<V: Simd>(self) -> [f64; 2] {
        sum_up::<P, FIRST, S>(self.contacts, self.sums)
    }
}

#[inline(always)]
fn sum_up<const P: usize, const FIRST: usize, S: Sums>(contacts: Contacts, sums: &S) -> [f64; 2] {
    let Contacts { covariances, row, weights } = contacts;
    let n = weights.len();
    let columns: [&[Block]; P] = std::array::from_fn(|k| &row[k * n..][..n]);
    let covariances: [[&[Block]; P]; P] =
        std::array::from_fn(|i| std::array::from_fn(|k| &covariances[packed(i, k) * n..][..n]));
    let (mut first, mut second) = ([0.0; LANES], [0.0; LANES]);
    for at in 0..n {
        // shrink = 1 + jᵀ·C·j; gain = |C·j|² of the position; before = tr C of the position.
        let (mut shrink, mut gain, mut variance) = ([1.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..P {
            let mut told = [0.0; LANES];
            for k in 0..P {
                let (c, j) = (&covariances[i][k][at], &columns[k][at]);
                for lane in 0..LANES {
                    told[lane] += c[lane] * j[lane];
                }
            }
            let j = &columns[i][at];
            for lane in 0..LANES {
                shrink[lane] += j[lane] * told[lane];
            }
            if i >= FIRST {
                let before = &covariances[i][i][at];
                for lane in 0..LANES {
                    gain[lane] += told[lane] * told[lane];
                    variance[lane] += before[lane];
                }
            }
        }
        for lane in 0..LANES {
            variance[lane] = (variance[lane] - gain[lane] / shrink[lane]).max(0.0);
        }
        sums.fold(&mut first, &mut second, &weights[at], &variance, &shrink);
    }
    [S::join(&first), second.iter().sum()]
}

/// Two sums, block by block. The second is the mean standard deviation to break ties.
pub(super) trait Sums {
    fn fold(&self, first: &mut Block, second: &mut Block, weight: &Block, variance: &Block, shrink: &Block);

    fn join(lanes: &Block) -> f64 {
        lanes.iter().sum()
    }
}

pub(super) struct Mean;
/// Largest variance.
pub(super) struct Worst;
/// Share of contacts with a larger variance.
pub(super) struct Without(pub f64);
/// Mean of −½·ln of the shrink factors of det C.
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

#[cfg(test)]
mod tests;
