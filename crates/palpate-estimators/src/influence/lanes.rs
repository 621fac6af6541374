//! Channels in groups of eight, which are worked on side by side.

/// Channels of a group.
pub(super) const LANES: usize = 8;

/// Numbers of a group of channels.
pub(super) type Lanes = [f64; LANES];

/// Numbers in groups, the last filled up with zeros.
pub(super) fn in_lanes(numbers: &[f64]) -> Vec<Lanes> {
    let group = |numbers: &[f64]| std::array::from_fn(|l| numbers.get(l).copied().unwrap_or(0.0));
    numbers.chunks(LANES).map(group).collect()
}
