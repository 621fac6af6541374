//! Groups of eight channels for vector instructions.

use palpate_numerics::simd::EightLanes;

pub(super) const LANES: usize = 8;

pub(super) type Lanes = [f64; LANES];

/// Groups `numbers`; zeros pad the last group.
pub(super) fn in_lanes(numbers: &[f64]) -> Vec<Lanes> {
    let group = |numbers: &[f64]| std::array::from_fn(|l| numbers.get(l).copied().unwrap_or(0.0));
    numbers.chunks(LANES).map(group).collect()
}

/// Sum over the channels, added in pairs for a short dependency chain.
#[inline(always)]
pub(super) fn sum_of<V: EightLanes<Real = f64>>(lanes: V) -> f64 {
    let [a, b, c, d, e, f, g, h] = lanes.to_array();
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}
