use super::*;
use crate::sensors::limit_objective::padded;

/// Blocks without any pattern; the same for the same seed.
fn blocks(count: usize, seed: usize) -> Vec<Block> {
    let value = |i: usize| ((i * 7 + seed * 3) as f64 * 0.7).sin() * [2.0, 40.0, 1e-3][(i + seed) % 3];
    padded(&(0..count * LANES).map(value).collect::<Vec<_>>())
}

/// What the machine's widest registers give and what plain Rust gives.
fn both<const P: usize, const FIRST: usize, R: Reduction>(reduction: &R, seed: usize) -> [[u64; 2]; 2] {
    let n = 5;
    let (mut covariances, row) = (blocks(packed(P, 0) * n, seed), blocks(P * n, seed + 1));
    // Dominant diagonals make them definite.
    for i in 0..P {
        let diagonal = &mut covariances[packed(i, i) * n..][..n];
        diagonal.iter_mut().flatten().for_each(|value| *value = 200.0 + value.abs());
    }
    let weights = blocks(n, seed + 2);
    let wide = folded::<P, FIRST, R>(&covariances, &row, &weights, reduction);
    let narrow = kernel::<P, FIRST, R>(&covariances, &row, &weights, reduction);
    assert!(narrow.iter().all(|sum| sum.is_finite()) && narrow[0] != 0.0, "{narrow:?}");
    [wide, narrow].map(|sums| sums.map(f64::to_bits))
}

fn agree<const P: usize, const FIRST: usize>() {
    for seed in 0..20 {
        let pairs = [
            both::<P, FIRST, _>(&MeanDeviation, seed),
            both::<P, FIRST, _>(&LargestVariance, seed),
            both::<P, FIRST, _>(&ShareAbove(150.0), seed),
            both::<P, FIRST, _>(&LogDeterminant, seed),
        ];
        for (criterion, [wide, narrow]) in pairs.into_iter().enumerate() {
            assert_eq!(wide, narrow, "{P} unknowns, {criterion}, {seed}");
        }
    }
}

#[test]
fn wide_registers_sum_as_narrow_ones_to_the_last_bit() {
    agree::<1, 0>();
    agree::<2, 0>();
    agree::<2, 1>();
    agree::<3, 1>();
}
