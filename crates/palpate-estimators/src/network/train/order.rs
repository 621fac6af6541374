//! Random presentation orders, without branches.
//!
//! A sorting network sorts random keys with the pattern's number in the low bits, in all lanes at once,
//! without scattered stores. For n = 30 two keys coincide once in 300,000 epochs. Beyond [`MOST_SORTED`]
//! Fisher and Yates' exchanges (Knuth, TAOCP vol. 2, 3.4.2, algorithm P) are used.

use palpate_numerics::simd::LOOK_UP;

/// Up to here a key has at least as many random bits as bits of the number.
const MOST_SORTED: usize = 1 << 16;

/// xoshiro128++ 1.0 (Blackman and Vigna, ACM TOMS 47, 2021), N streams.
#[derive(Clone, Debug)]
pub(super) struct Streams<const N: usize>([[u32; N]; 4]);

impl<const N: usize> Streams<N> {
    pub(super) fn unseeded() -> Self {
        let mut streams = Self([[0; N]; 4]);
        for lane in 0..N {
            streams.set(lane, &Streams::<1>::seeded(0));
        }
        streams
    }

    pub(super) fn set(&mut self, lane: usize, stream: &Streams<1>) {
        for (words, word) in self.0.iter_mut().zip(&stream.0) {
            words[lane] = word[0];
        }
    }

    #[inline(always)]
    pub(super) fn next(&mut self) -> [u32; N] {
        let [s0, s1, s2, s3] = &mut self.0;
        let mut result = [0; N];
        for l in 0..N {
            result[l] = s0[l].wrapping_add(s3[l]).rotate_left(7).wrapping_add(s0[l]);
            let t = s1[l] << 9;
            s2[l] ^= s0[l];
            s3[l] ^= s1[l];
            s1[l] ^= s2[l];
            s0[l] ^= s3[l];
            s2[l] ^= t;
            s3[l] = s3[l].rotate_left(11);
        }
        result
    }
}

impl Streams<1> {
    /// SplitMix64 spreads the seed over the state, as the authors advise.
    pub(super) fn seeded(seed: u64) -> Self {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let [a, b] = [next(), next()];
        Self([[a as u32], [(a >> 32) as u32], [b as u32], [(b >> 32) as u32]])
    }

    pub(super) fn uniform(&mut self, half_width: f64) -> f64 {
        (f64::from(self.next()[0]) / f64::from(u32::MAX) * 2.0 - 1.0) * half_width
    }
}

/// Batcher's odd–even merge sort (Knuth, TAOCP vol. 3, 5.2.2, algorithm M).
fn exchanges(n: usize) -> Vec<(u32, u32)> {
    let mut list = Vec::new();
    if n < 2 {
        return list;
    }
    let top = n.next_power_of_two() / 2;
    let mut p = top;
    while p > 0 {
        let (mut q, mut r, mut d) = (top, 0, p);
        loop {
            list.extend((0..n - d).filter(|i| i & p == r).map(|i| (i as u32, (i + d) as u32)));
            if q == p {
                break;
            }
            d = q - p;
            q /= 2;
            r = p;
        }
        p /= 2;
    }
    list
}

pub(super) fn column_len(patterns: usize) -> usize {
    patterns.next_power_of_two().max(LOOK_UP)
}

pub(super) struct OrderDrawer {
    patterns: usize,
    mask: u32,
    method: Method,
}

enum Method {
    Sort(Vec<(u32, u32)>),
    Shuffle,
}

impl OrderDrawer {
    pub(super) fn new(patterns: usize) -> Self {
        let method = if patterns > MOST_SORTED { Method::Shuffle } else { Method::Sort(exchanges(patterns)) };
        Self { patterns, mask: column_len(patterns) as u32 - 1, method }
    }

    /// Only the low bits of a pick are the pattern's number.
    #[inline(always)]
    pub(super) fn draw<const N: usize>(&self, streams: &mut Streams<N>, order: &mut [[u32; N]]) {
        let Method::Sort(exchanges) = &self.method else { return shuffle(streams, order) };
        // A local copy lets the generator's state stay in registers.
        let mut local = streams.clone();
        for (pattern, row) in order.iter_mut().enumerate() {
            let random = local.next();
            for l in 0..N {
                row[l] = (random[l] & !self.mask) | pattern as u32;
            }
        }
        *streams = local;
        for &(i, j) in exchanges {
            let (i, j) = (i as usize, j as usize);
            let (low, high) = (order[i], order[j]);
            for l in 0..N {
                order[i][l] = low[l].min(high[l]);
                order[j][l] = low[l].max(high[l]);
            }
        }
    }

    pub(super) fn draw_one(&self, stream: &mut Streams<1>, order: &mut [u32]) {
        if matches!(self.method, Method::Shuffle) {
            return shuffle(stream, order.as_chunks_mut().0);
        }
        for (pattern, key) in order.iter_mut().enumerate() {
            *key = (stream.next()[0] & !self.mask) | pattern as u32;
        }
        order.sort_unstable();
        for pick in order {
            *pick &= self.mask;
        }
    }

    pub(super) fn patterns(&self) -> usize {
        self.patterns
    }
}

/// A partner is the high word of a product, with a bias up to one part in 2³²/n.
fn shuffle<const N: usize>(streams: &mut Streams<N>, order: &mut [[u32; N]]) {
    for (pattern, row) in order.iter_mut().enumerate() {
        *row = [pattern as u32; N];
    }
    for last in (1..order.len()).rev() {
        let random = streams.next();
        for l in 0..N {
            let partner = (u64::from(random[l]) * (last as u64 + 1)) >> 32;
            let picked = order[partner as usize][l];
            order[partner as usize][l] = order[last][l];
            order[last][l] = picked;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro128PlusPlus;

    #[test]
    fn the_streams_are_xoshiro128_plus_plus() {
        let mut state = [0; 16];
        let ours = Streams::<1>::seeded(42);
        for (bytes, word) in state.chunks_exact_mut(4).zip(ours.0) {
            bytes.copy_from_slice(&word[0].to_le_bytes());
        }
        let mut reference = Xoshiro128PlusPlus::from_seed(state);
        let mut side_by_side = Streams::<3>::unseeded();
        side_by_side.set(1, &ours);
        for _ in 0..1000 {
            assert_eq!(side_by_side.next()[1], reference.next_u32());
        }
    }

    #[test]
    fn every_lane_draws_the_order_of_its_stream_alone() {
        for patterns in (1..=40).chain([100, 257, MOST_SORTED + 1]) {
            let drawer = OrderDrawer::new(patterns);
            let mut lanes = Streams::<4>::unseeded();
            let mut singles: Vec<_> = (0..4).map(Streams::seeded).collect();
            for (lane, single) in singles.iter().enumerate() {
                lanes.set(lane, single);
            }
            let mut order = vec![[0; 4]; patterns];
            for _ in 0..3 {
                drawer.draw(&mut lanes, &mut order);
                for (lane, single) in singles.iter_mut().enumerate() {
                    let mut expected = vec![0; patterns];
                    drawer.draw_one(single, &mut expected);
                    let drawn: Vec<_> = order.iter().map(|row| row[lane] & drawer.mask).collect();
                    assert_eq!(drawn, expected);
                    expected.sort_unstable();
                    assert!(expected.into_iter().eq(0..patterns as u32), "{patterns} patterns");
                }
            }
        }
    }

    #[test]
    fn every_pattern_comes_first_and_last_equally_often() {
        let shuffled = OrderDrawer { method: Method::Shuffle, ..OrderDrawer::new(10) };
        for drawer in [OrderDrawer::new(10), shuffled] {
            let mut stream = Streams::seeded(1);
            let mut order = [0; 10];
            let mut at_end = [[0; 10]; 2];
            for _ in 0..20_000 {
                drawer.draw_one(&mut stream, &mut order);
                at_end[0][order[0] as usize] += 1;
                at_end[1][order[9] as usize] += 1;
            }
            for counts in at_end {
                // χ² with 9 degrees of freedom exceeds 27.9 with probability 0.001.
                let chi_squared: f64 = counts.iter().map(|n| f64::from(n - 2000).powi(2) / 2000.0).sum();
                assert!(chi_squared < 27.9, "{counts:?}");
            }
        }
    }

    #[test]
    fn weights_start_within_their_width() {
        let mut stream = Streams::seeded(9);
        let values: Vec<f64> = (0..10_000).map(|_| stream.uniform(0.5)).collect();
        assert!(values.iter().all(|value| value.abs() <= 0.5));
        let mean = values.iter().sum::<f64>() / 10_000.0;
        assert!(mean.abs() < 0.015, "{mean}");
    }
}
