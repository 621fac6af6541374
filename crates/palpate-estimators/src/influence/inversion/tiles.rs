//! Integration of a posterior over tiles around its minima, from neighbour to neighbour.

use super::cells::CellFit;
use super::minima::{Minimum, least_cost};
use super::{ContactLikelihood, PlaceFit};

/// A cost this far above the least has negligible probability: e⁻⁸.
pub(super) const CUT: f64 = 16.0;
/// Greatest change of a reading within a tile, in standard deviations: on a line, and on a plane, where each
/// halving costs fourfold.
const FINE: [f64; 2] = [0.5, 1.0];
/// Range of a tile's side in nodes; a length scale has eight.
const LEAST_STEP: f64 = 1e-6;
const MOST_STEP: f64 = 2.0;
/// Tiles to either side of a minimum; beyond that they are enlarged.
const MOST_TILES: usize = 60;

fn nearest(minima: &[Minimum], [x, y]: [f64; 2]) -> usize {
    let square = |minimum: &Minimum| (minimum.at[0] - x).powi(2) + (minimum.at[1] - y).powi(2);
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    minima.iter().map(square).enumerate().min_by(by_distance).map_or(0, |(i, _)| i)
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    place: [f64; 2],
    latent: f64,
}

pub(super) fn candidates<E: ContactLikelihood>(
    reading: &E,
    fits: &[CellFit],
    minima: &[Minimum],
) -> Vec<Vec<Candidate>> {
    let cells = reading.cells();
    let mut candidates = vec![Vec::new(); minima.len()];
    for (cell, fit) in fits.iter().enumerate() {
        if least_cost(reading, cell, fit) <= minima[0].found.cost + CUT {
            let place = cells.middle(cell).map(|node| node as f64);
            candidates[nearest(minima, place)].push(Candidate { place, latent: fit.latent });
        }
    }
    candidates
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Number of tiles, and side of a tile in nodes.
    counts: [usize; 2],
    steps: [f64; 2],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub tile: [usize; 2],
    pub weight: f64,
    pub found: PlaceFit,
}

impl Lattice {
    fn new(nodes: [usize; 2], steps: [f64; 2]) -> Self {
        let counts = [0, 1].map(|k| ((nodes[k] - 1) as f64 / steps[k]).ceil().max(1.0) as usize);
        Self { counts, steps: [0, 1].map(|k| (nodes[k] - 1) as f64 / counts[k] as f64) }
    }

    fn fine_steps<E: ContactLikelihood>(reading: &E, minimum: &Minimum) -> [f64; 2] {
        let [x, y, latent] = minimum.at;
        let lengths = reading.lengths([x, y].map(|at| at.round() as usize), latent);
        let [[xx, _, xt], [_, yy, yt], [_, _, tt]] = minimum.information;
        let is_plane = reading.axes().iter().all(|axis| axis.count > 1);
        let fine = FINE[usize::from(is_plane)];
        let step = |own: f64, with_latent: f64, length: f64| {
            let conditional = if tt > 0.0 { own - with_latent * with_latent / tt } else { own };
            (fine / conditional.max(0.0).sqrt().max(length)).clamp(LEAST_STEP, MOST_STEP)
        };
        [step(xx, xt, lengths[0]), step(yy, yt, lengths[1])]
    }

    /// Covers the contributing places nearest to minimum `i`, with weights relative to the best minimum.
    pub fn cover<E: ContactLikelihood>(
        reading: &mut E,
        minima: &[Minimum],
        i: usize,
        others: &[Candidate],
    ) -> (Self, Vec<Leaf>) {
        let nodes = reading.axes().map(|axis| axis.count);
        let mut steps = Self::fine_steps(reading, &minima[i]);
        loop {
            let lattice = Self::new(nodes, steps);
            if let Some(leaves) = lattice.leaves(reading, minima, i, others) {
                return (lattice, leaves);
            }
            steps = steps.map(|step| 2.0 * step);
        }
    }

    /// `None` beyond [`MOST_TILES`].
    fn leaves<E: ContactLikelihood>(
        self,
        reading: &mut E,
        minima: &[Minimum],
        i: usize,
        others: &[Candidate],
    ) -> Option<Vec<Leaf>> {
        let Minimum { at, .. } = minima[i];
        let best = minima[0].found.cost;
        let start = self.tile([at[0], at[1]]);
        let corner = start.map(|tile| tile.saturating_sub(MOST_TILES));
        let index_of =
            |tile: [usize; 2]| (tile[0] - corner[0]) * (2 * MOST_TILES + 1) + (tile[1] - corner[1]);
        let wide = |k: usize| (start[k] + MOST_TILES + 1).min(self.counts[k]) - corner[k];
        let is_near = |tile: [usize; 2]| (0..2).all(|k| tile[k].abs_diff(start[k]) <= MOST_TILES);
        let mut visited = vec![false; (wide(0) - 1) * (2 * MOST_TILES + 1) + wide(1)];
        visited[index_of(start)] = true;
        let (mut open, mut leaves) = (vec![(start, at[2])], Vec::new());
        let mut others = others.iter();
        loop {
            while let Some((tile, latent)) = open.pop() {
                let place = self.middle(tile);
                let found = reading.fit_place(place, latent);
                // The tile of the minimum always counts.
                let matters = found.cost <= best + CUT || tile == start;
                if !matters || minima.len() > 1 && nearest(minima, place) != i {
                    continue;
                }
                let weight = (0.5 * (best - found.cost)).exp() * self.area();
                if weight > 0.0 {
                    leaves.push(Leaf { tile, weight, found });
                }
                let around = |k: usize| tile[k].saturating_sub(1)..(tile[k] + 2).min(self.counts[k]);
                for next in around(0).flat_map(|x| around(1).map(move |y| [x, y])) {
                    if !is_near(next) {
                        return None;
                    }
                    if !std::mem::replace(&mut visited[index_of(next)], true) {
                        open.push((next, found.latent));
                    }
                }
            }
            // Candidates that are not connected to these tiles.
            let Some(Candidate { place, latent }) = others.next() else { return Some(leaves) };
            let tile = self.tile(*place);
            if is_near(tile) {
                if !std::mem::replace(&mut visited[index_of(tile)], true) {
                    open.push((tile, *latent));
                }
            } else if reading.fit_place(*place, *latent).cost <= best + CUT {
                return None;
            }
        }
    }

    fn tile(self, place: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| {
            let tile = if self.steps[k] > 0.0 { (place[k] / self.steps[k]) as usize } else { 0 };
            tile.min(self.counts[k] - 1)
        })
    }

    pub fn middle(self, tile: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|k| (tile[k] as f64 + 0.5) * self.steps[k])
    }

    pub fn span(self, tile: [usize; 2], k: usize) -> (f64, f64) {
        (tile[k] as f64 * self.steps[k], (tile[k] + 1) as f64 * self.steps[k])
    }

    /// Area in nodes²; an axis without extent has the factor 1.
    fn area(self) -> f64 {
        self.steps.iter().map(|step| if *step > 0.0 { *step } else { 1.0 }).product()
    }
}
