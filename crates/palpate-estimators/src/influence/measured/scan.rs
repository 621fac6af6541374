//! Coarse search over the middles of a table's cells.
//!
//! With weights w by a line's largest variance, |z − μ|² = Σ w·z² − 2·Σ w·μ·z + Σ w·μ². Between nodes with
//! the squares r₀ and r₁ at the distance d, the segment is closest at s = (r₀ + d² − r₁)/(2·d²).

use super::table::Table;
use crate::influence::inversion::{CellBlocks, Cells};
use crate::influence::lanes::{LANES, Lanes};
use crate::influence::noise::Whitening;
use palpate_numerics::simd::EightLanes;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scan {
    cells: usize,
    channels: usize,
    nodes: usize,
    /// w, channel by channel.
    weights: Vec<Lanes>,
    /// w·μ, node by node and channel by channel.
    products: Vec<Lanes>,
    /// Σ w·μ², and Σ w·d² to the next node.
    squares: Vec<Lanes>,
    ways: Vec<Lanes>,
    /// 1/Σ w·d², finite for equal nodes.
    per_way: Vec<Lanes>,
    /// γ².
    gain2: f64,
}

impl Scan {
    pub fn new(table: &Table, whitening: &Whitening, cells: Cells) -> Self {
        let (channels, nodes) = (table.channels(), table.nuisance.count);
        let blocks = cells.len().div_ceil(LANES);
        let mut scan = Self {
            cells: cells.len(),
            channels,
            nodes,
            weights: vec![[0.0; LANES]; blocks * channels],
            products: vec![[0.0; LANES]; blocks * nodes * channels],
            squares: vec![[0.0; LANES]; blocks * nodes],
            ways: vec![[0.0; LANES]; blocks * nodes],
            per_way: Vec::new(),
            gain2: whitening.gain * whitening.gain,
        };
        for cell in 0..cells.len() {
            let (block, lane) = (cell / LANES, cell % LANES);
            let [x, y] = cells.middle(cell);
            let place = x * table.y.count + y;
            let variances = &table.variances[place * nodes..(place + 1) * nodes];
            let most = variances.iter().copied().fold(0.0, f64::max);
            for (c, signal) in whitening.signal.iter().enumerate() {
                let weight = 1.0 / (1.0 + most * signal);
                scan.weights[block * channels + c][lane] = weight;
                for node in 0..nodes {
                    let mean = table.mean(place, node, c);
                    let next = table.mean(place, (node + 1).min(nodes - 1), c);
                    let at = block * nodes + node;
                    scan.products[at * channels + c][lane] = weight * mean;
                    scan.squares[at][lane] += weight * mean * mean;
                    scan.ways[at][lane] += weight * (next - mean) * (next - mean);
                }
            }
        }
        let per_way = |way: &Lanes| way.map(|way| way.max(f64::MIN_POSITIVE).recip());
        scan.per_way = scan.ways.iter().map(per_way).collect();
        scan
    }
}

impl CellBlocks for Scan {
    fn cells(&self) -> usize {
        self.cells
    }

    /// Least squared residual of each cell, and the nuisance coordinate there.
    #[inline(always)]
    fn fits<V: EightLanes>(&self, block: usize, reading: &[f64]) -> [V; 3] {
        let (zero, one, two) = (V::splat(0.0), V::splat(1.0), V::splat(2.0));
        let mut own = zero;
        for (weights, z) in self.weights[block * self.channels..].iter().zip(reading) {
            own = V::load(weights).mul_add(V::splat(z * z), own);
        }
        let (mut best, mut latent, mut last) = (V::splat(f64::INFINITY), zero, zero);
        for node in 0..self.nodes {
            let at = block * self.nodes + node;
            let mut product = zero;
            for (products, z) in self.products[at * self.channels..].iter().zip(reading) {
                product = V::load(products).mul_add(V::splat(*z), product);
            }
            let square = V::load(&self.squares[at]);
            let mut residual = own - two * product + square;
            if self.gain2 > 0.0 {
                let (gain2, off) = (V::splat(self.gain2), product - square);
                residual = residual - gain2 * off * off / (one + gain2 * square);
            }
            if node == 0 {
                (best, last) = (residual, residual);
                continue;
            }
            let way = V::load(&self.ways[at - 1]);
            let along = V::splat(0.5) * (last + way - residual);
            let s = (along * V::load(&self.per_way[at - 1])).max(zero).min(one);
            let between = last - s * (two * along - s * way);
            latent = between.select_below(best, V::splat((node - 1) as f64) + s, latent);
            best = between.min(best);
            last = residual;
        }
        let misfit = best.max(zero);
        [misfit, misfit, latent]
    }
}
