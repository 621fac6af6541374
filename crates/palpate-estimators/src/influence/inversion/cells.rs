//! Coarse search over the cells of a grid.

use crate::influence::lanes::{LANES, Lanes};
use palpate_numerics::simd::{EightLanes, InstructionSet, Kernel, Simd, Vector};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::influence) struct Cells {
    nodes: [usize; 2],
    /// Nodes per cell; odd.
    stride: [usize; 2],
}

/// Candidate of the coarse search.
#[derive(Clone, Copy, Debug)]
pub(in crate::influence) struct CellFit {
    /// Approximate χ² at the best amplitude.
    pub misfit: f64,
    /// χ² plus the other terms of −2·ln of the posterior density.
    pub cost: f64,
    pub latent: f64,
}

impl Cells {
    pub fn new(nodes: [usize; 2], stride: usize) -> Self {
        Self { nodes, stride: nodes.map(|nodes| if nodes > 1 { stride } else { 1 }) }
    }

    fn counts(self) -> [usize; 2] {
        [0, 1].map(|k| self.nodes[k].div_ceil(self.stride[k]))
    }

    pub fn len(self) -> usize {
        self.counts().iter().product()
    }

    fn indices(self, cell: usize) -> [usize; 2] {
        let across = self.counts()[1];
        [cell / across, cell % across]
    }

    pub fn middle(self, cell: usize) -> [usize; 2] {
        let at = self.indices(cell);
        [0, 1].map(|k| (at[k] * self.stride[k] + self.stride[k] / 2).min(self.nodes[k] - 1))
    }

    /// Ends of a cell, in nodes.
    pub(super) fn span(self, cell: usize) -> [(f64, f64); 2] {
        let at = self.indices(cell);
        [0, 1].map(|k| {
            let [from, to] = [at[k], at[k] + 1].map(|cells| (cells * self.stride[k]) as f64 - 0.5);
            (from.max(0.0), to.min((self.nodes[k] - 1) as f64))
        })
    }

    /// Local minima in order of cost.
    pub(super) fn local_minima(self, fits: &[CellFit], most: usize) -> Vec<usize> {
        let counts @ [rows, columns] = self.counts();
        let cells = (0..rows).flat_map(|i| (0..columns).map(move |j| [i, j]));
        let mut local_minima: Vec<usize> = cells
            .filter(|cell| is_local_minimum(fits, counts, *cell))
            .map(|[i, j]| i * columns + j)
            .collect();
        local_minima.sort_by(|a, b| fits[*a].cost.total_cmp(&fits[*b].cost));
        local_minima.truncate(most);
        local_minima
    }
}

/// Of equal cells, only the first is a minimum.
fn is_local_minimum(fits: &[CellFit], [rows, columns]: [usize; 2], [i, j]: [usize; 2]) -> bool {
    let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let cell = i * columns + j;
    let cost = fits[cell].cost;
    // Two neighbours exclude most cells.
    let is_before = i > 0 && fits[cell - columns].cost <= cost;
    let is_behind = i + 1 < rows && fits[cell + columns].cost < cost;
    !is_before
        && !is_behind
        && cost.is_finite()
        && around(i, rows).all(|i| {
            around(j, columns).all(|j| {
                let other = i * columns + j;
                let from = fits[other].cost;
                !(from < cost || other < cell && from == cost)
            })
        })
}

pub(in crate::influence) trait CellBlocks {
    fn cells(&self) -> usize;

    /// χ², cost and amplitude of each cell of a block.
    fn fits<V: EightLanes>(&self, block: usize, reading: &[f64]) -> [V; 3];
}

pub(in crate::influence) fn fit_cells(
    blocks: &impl CellBlocks,
    reading: &[Lanes],
    channels: usize,
    fits: &mut Vec<CellFit>,
) {
    let reading = &reading.as_flattened()[..channels];
    InstructionSet::best().run(CellFitKernel { blocks, reading, fits });
}

struct CellFitKernel<'a, C> {
    blocks: &'a C,
    reading: &'a [f64],
    fits: &'a mut Vec<CellFit>,
}

impl<C: CellBlocks> Kernel for CellFitKernel<'_, C> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) {
        let Self { blocks, reading, fits } = self;
        fits.clear();
        for block in 0..blocks.cells().div_ceil(LANES) {
            let [misfits, costs, latents] =
                blocks.fits::<S::F64>(block, reading).map(|eight| eight.to_array());
            for l in 0..LANES.min(blocks.cells() - LANES * block) {
                fits.push(CellFit { misfit: misfits[l], cost: costs[l], latent: latents[l] });
            }
        }
    }
}
