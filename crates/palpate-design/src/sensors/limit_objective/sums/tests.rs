use super::*;
use crate::sensors::limit_objective::padded;

/// Blocks without a pattern, reproducible by the seed.
fn blocks(count: usize, seed: usize) -> Vec<Block> {
    let value = |i: usize| ((i * 7 + seed * 3) as f64 * 0.7).sin() * [2.0, 40.0, 1e-3][(i + seed) % 3];
    padded(&(0..count * LANES).map(value).collect::<Vec<_>>())
}

/// Bits of the sums by vector instructions and by plain Rust.
fn both<const P: usize, const FIRST: usize, S: Sums>(sums: &S, seed: usize) -> [[u64; 2]; 2] {
    let n = 5;
    let (mut covariances, row) = (blocks(packed(P, 0) * n, seed), blocks(P * n, seed + 1));
    // Dominant diagonals make them definite.
    for i in 0..P {
        let diagonal = &mut covariances[packed(i, i) * n..][..n];
        diagonal.iter_mut().flatten().for_each(|value| *value = 200.0 + value.abs());
    }
    let weights = blocks(n, seed + 2);
    let contacts = Contacts { covariances: &covariances, row: &row, weights: &weights };
    let (wide, narrow) = (folded::<P, FIRST, S>(contacts, sums), sum_up::<P, FIRST, S>(contacts, sums));
    assert!(narrow.iter().all(|sum| sum.is_finite()) && narrow[0] != 0.0, "{narrow:?}");
    [wide, narrow].map(|sums| sums.map(f64::to_bits))
}

fn agree<const P: usize, const FIRST: usize>() {
    for seed in 0..20 {
        let pairs = [
            both::<P, FIRST, _>(&Mean, seed),
            both::<P, FIRST, _>(&Worst, seed),
            both::<P, FIRST, _>(&Without(150.0), seed),
            both::<P, FIRST, _>(&Shrinking, seed),
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
