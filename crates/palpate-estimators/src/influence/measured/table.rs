//! Learnt readings, tabulated over position and nuisance coordinate.

use crate::influence::grid::{Axis, neighbours};

/// Whitened mean readings and their relative variance at the nodes of a grid.
///
/// Index of a node: (x·count_y + y)·count_nuisance + nuisance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Along the surface, in metres.
    pub x: Axis,
    /// Across it, in metres; a single node on a one-dimensional surface.
    pub y: Axis,
    /// The nuisance coordinate on its scale; a single node where there is none.
    pub nuisance: Axis,
    /// W·f̄, channel by channel, node by node.
    pub means: Vec<f64>,
    /// v: the process's variance over its signal's, 0 to 1, node by node.
    pub variances: Vec<f64>,
    /// For each place (x, y), half the longest whitened distance from one of its nodes to the line of a neighbouring
    /// place: about how far the line of anywhere in the place's cell can lie from the place's own.
    pub reaches: Vec<f64>,
    /// Into how many parts each cell is cut along each axis when a reading is located within it.
    pub parts: usize,
}

/// A finely cut cell has about this whitened length, so that sums over it are integrals.
const FINE: f64 = 1.2;
/// The finest cut.
const MOST_PARTS: usize = 12;

impl Table {
    /// From means and variances at the nodes.
    pub(super) fn new([x, y, nuisance]: [Axis; 3], means: Vec<f64>, variances: Vec<f64>) -> Self {
        let mut table = Self { x, y, nuisance, means, variances, reaches: Vec::new(), parts: 1 };
        let of_nodes = table.line_reaches();
        table.reaches = of_nodes
            .chunks_exact(nuisance.count)
            .map(|nodes| nodes.iter().copied().fold(0.0, f64::max))
            .collect();
        table.parts = ((table.cell_length() / FINE).ceil().min(MOST_PARTS as f64) as usize).max(1);
        table
    }

    /// The whitened length of a typical cell.
    fn cell_length(&self) -> f64 {
        2.0 * self.reaches.iter().sum::<f64>() / self.reaches.len().max(1) as f64
    }

    /// By how much noise of unit deviation is too small for the finest cut; 1 where it is not.
    pub(super) fn too_coarse(&self) -> f64 {
        (self.cell_length() / (FINE * MOST_PARTS as f64)).max(1.0)
    }

    /// The same for noise of `factor` times the deviation.
    pub(super) fn widened(mut self, factor: f64) -> Self {
        self.means.iter_mut().chain(&mut self.reaches).for_each(|value| *value /= factor);
        self
    }

    /// Places (x, y).
    pub fn places(&self) -> usize {
        self.x.count * self.y.count
    }

    /// Half the longest distance from each node to the line of a neighbouring place, of which only the stretches near the node's own are
    /// asked.
    pub(super) fn line_reaches(&self) -> Vec<f64> {
        let channels = self.means.len() / self.variances.len().max(1);
        (0..self.variances.len())
            .map(|node| self.line_reach(node / self.nuisance.count, node % self.nuisance.count, channels))
            .collect()
    }

    fn line_reach(&self, place: usize, k: usize, channels: usize) -> f64 {
        const NEAR: usize = 4;
        let nodes = self.nuisance.count;
        let node = |place: usize, k: usize| {
            let first = (place * nodes + k) * channels;
            &self.means[first..first + channels]
        };
        let square_to = |place: usize, k: usize, other: usize| {
            let last = nodes.saturating_sub(1).max(1);
            let stretches = k.saturating_sub(NEAR).min(last - 1)..(k + NEAR).min(last);
            let squares = stretches.map(|s| {
                let ends = node(other, s).iter().zip(node(other, (s + 1).min(nodes - 1)));
                let (mut aa, mut ad, mut dd) = (0.0, 0.0, 0.0);
                for (z, (from, to)) in node(place, k).iter().zip(ends) {
                    let (a, d) = (z - from, to - from);
                    (aa, ad, dd) = (aa + a * a, ad + a * d, dd + d * d);
                }
                let foot = if dd > 0.0 { (ad / dd).clamp(0.0, 1.0) } else { 0.0 };
                (aa - 2.0 * foot * ad + foot * foot * dd).max(0.0)
            });
            squares.fold(f64::INFINITY, f64::min)
        };
        let squares = neighbours([self.x, self.y], place).map(|other| square_to(place, k, other));
        0.5 * squares.fold(0.0, f64::max).sqrt()
    }
}
