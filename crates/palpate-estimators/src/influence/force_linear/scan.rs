//! Coarse search by lower bounds of the cost.
//!
//! With weights w from a node's largest variances, the least chi-squared over forces is Σ w·d² − (Σ w·f·d)²/Σ
//! w·f².

use crate::influence::inversion::CellBlocks;
use crate::influence::lanes::{LANES, Lanes};
use palpate_numerics::simd::EightLanes;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Scan {
    places: usize,
    channels: usize,
    /// w, channel by channel.
    weights: Vec<Lanes>,
    /// w·f, channel by channel.
    products: Vec<Lanes>,
    /// Σ w·f² plus the precision of φ.
    squares: Vec<Lanes>,
    /// Lower bound of log determinant and width.
    constants: Vec<Lanes>,
    /// Prior mean and precision of φ; below, a known φ.
    expected: [f64; 2],
    known: Option<f64>,
}

impl Scan {
    pub fn new(
        places: usize,
        channels: usize,
        expected: [f64; 2],
        known: Option<f64>,
        channel: impl Fn(usize, usize) -> (f64, [f64; 2]),
    ) -> Self {
        let blocks = places.div_ceil(LANES);
        let mut scan = Self {
            places,
            channels,
            weights: vec![[0.0; LANES]; blocks * channels],
            products: vec![[0.0; LANES]; blocks * channels],
            squares: vec![[f64::MIN_POSITIVE; LANES]; blocks],
            constants: vec![[0.0; LANES]; blocks],
            expected,
            known,
        };
        for place in 0..places {
            let (block, lane) = (place / LANES, place % LANES);
            let (mut square, mut log_determinant) = (expected[1], 0.0);
            for c in 0..channels {
                let (f, [least, most]) = channel(place, c);
                scan.weights[block * channels + c][lane] = 1.0 / most;
                scan.products[block * channels + c][lane] = f / most;
                square += f * f / most;
                log_determinant += least.ln();
            }
            scan.squares[block][lane] = square.max(f64::MIN_POSITIVE);
            let width = if known.is_some() { 0.0 } else { scan.squares[block][lane].ln() };
            scan.constants[block][lane] = log_determinant + width;
        }
        scan
    }
}

impl CellBlocks for Scan {
    fn cells(&self) -> usize {
        self.places
    }

    /// Least chi-squared, cost and φ of each node.
    #[inline(always)]
    fn fits<V: EightLanes>(&self, block: usize, reading: &[f64]) -> [V; 3] {
        let of_block = block * self.channels..(block + 1) * self.channels;
        let channels = self.weights[of_block.clone()].iter().zip(&self.products[of_block]).zip(reading);
        let [expected, precision] = self.expected;
        let mut dd = V::splat(precision * expected * expected);
        let mut fd = V::splat(precision * expected);
        for ((weights, products), d) in channels {
            dd = V::load(weights).mul_add(V::splat(d * d), dd);
            fd = V::load(products).mul_add(V::splat(*d), fd);
        }
        let ff = V::load(&self.squares[block]);
        let response = self.known.map_or(fd / ff, V::splat);
        let zero = V::splat(0.0);
        let misfit = (dd + response * (response * ff - (fd + fd))).max(zero);
        [misfit, misfit + V::load(&self.constants[block]), response.max(zero)]
    }
}
