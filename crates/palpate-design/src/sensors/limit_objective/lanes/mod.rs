//! Every contact's variance with one sensor more, eight contacts at a time: what searches spend their time in.
//!
//! [`kernel`] is plain Rust whose inner loops go over the lanes of one block, so that compilers make vector instructions of
//! them: two f64 in a register on any x86-64, four where [`folded`] finds AVX2 when the program runs. Both do the same
//! operations lane by lane in the same order, each rounded as IEEE 754 says and none fused, so their sums are the same to the
//! last bit and searches find the same layouts on every machine. (The logarithms of D-optimality are the C library's.)
//!
//! The bound is one division and one root a contact: with AVX2 2.2 ns of a 2.5 GHz Xeon, whatever their width; AVX-512 gains
//! nothing, as it divides eight numbers in twice the time of four. Rows that are in no cache cost another 1.2 ns to fetch, so
//! whoever judges candidates for several states does so while their rows are at hand.

use super::{Block, LANES, packed};

/// Folds each contact's variance of the position, and the factor by which a sensor shrinks det C there, into sums.
///
/// `covariances`: [entry of the lower triangle][block of contacts], `row`: [unknown][block], `weights`: [block].
pub(super) fn folded<const P: usize, const FIRST: usize, R: Reduction>(
    covariances: &[Block],
    row: &[Block],
    weights: &[Block],
    reduction: &R,
) -> [f64; 2] {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2.
        return unsafe { by_avx2::<P, FIRST, R>(covariances, row, weights, reduction) };
    }
    kernel::<P, FIRST, R>(covariances, row, weights, reduction)
}

/// # Safety
/// The machine must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn by_avx2<const P: usize, const FIRST: usize, R: Reduction>(
    covariances: &[Block],
    row: &[Block],
    weights: &[Block],
    reduction: &R,
) -> [f64; 2] {
    kernel::<P, FIRST, R>(covariances, row, weights, reduction)
}

/// [`folded`] with whatever instructions its caller is compiled for.
#[inline(always)]
fn kernel<const P: usize, const FIRST: usize, R: Reduction>(
    covariances: &[Block],
    row: &[Block],
    weights: &[Block],
    reduction: &R,
) -> [f64; 2] {
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
        reduction.fold(&mut first, &mut second, &weights[at], &variance, &shrink);
    }
    [R::join(&first), second.iter().sum()]
}

/// What is summed, block by block. The second sum is the mean standard deviation, where ties are to be broken.
pub(super) trait Reduction {
    fn fold(&self, first: &mut Block, second: &mut Block, weight: &Block, variance: &Block, shrink: &Block);

    fn join(lanes: &Block) -> f64 {
        lanes.iter().sum()
    }
}

/// The mean standard deviation.
pub(super) struct MeanDeviation;
/// The largest variance.
pub(super) struct LargestVariance;
/// The share of contacts whose variance is above this one.
pub(super) struct ShareAbove(pub f64);
/// The mean of −½·ln of the factors by which det C shrinks.
pub(super) struct LogDeterminant;

impl Reduction for MeanDeviation {
    #[inline(always)]
    fn fold(&self, first: &mut Block, _: &mut Block, weight: &Block, variance: &Block, _: &Block) {
        for lane in 0..LANES {
            first[lane] += weight[lane] * variance[lane].sqrt();
        }
    }
}

impl Reduction for LargestVariance {
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

impl Reduction for ShareAbove {
    #[inline(always)]
    fn fold(&self, first: &mut Block, second: &mut Block, weight: &Block, variance: &Block, _: &Block) {
        for lane in 0..LANES {
            first[lane] += if variance[lane] > self.0 { weight[lane] } else { 0.0 };
            second[lane] += weight[lane] * variance[lane].sqrt();
        }
    }
}

impl Reduction for LogDeterminant {
    #[inline(always)]
    fn fold(&self, first: &mut Block, _: &mut Block, weight: &Block, _: &Block, shrink: &Block) {
        for lane in 0..LANES {
            first[lane] -= 0.5 * weight[lane] * shrink[lane].ln();
        }
    }
}

#[cfg(test)]
mod tests;
