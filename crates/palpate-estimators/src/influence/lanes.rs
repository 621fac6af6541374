//! Channels in groups of eight, which are worked on side by side.

use palpate_numerics::simd::Eight;

/// Channels of a group.
pub(super) const LANES: usize = 8;

/// Numbers of a group of channels.
pub(super) type Lanes = [f64; LANES];

/// Numbers in groups, the last filled up with zeros.
pub(super) fn in_lanes(numbers: &[f64]) -> Vec<Lanes> {
    let group = |numbers: &[f64]| std::array::from_fn(|l| numbers.get(l).copied().unwrap_or(0.0));
    numbers.chunks(LANES).map(group).collect()
}

/// The sum over the channels, in pairs: no addition waits for more than two others.
#[inline(always)]
pub(super) fn sum_of<V: Eight<Real = f64>>(lanes: V) -> f64 {
    let [a, b, c, d, e, f, g, h] = lanes.to_array();
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}
