//! Where one contact is: whitened search over the table, then Gauss–Newton.
//!
//! Symbols: d whitened reading (less offsets, over the noise), f whitened influence, W force, a position,
//! χ²(a, W) = |d − W·f(a)|² (+ the force's own misfit where it is believed to be near a value), S channels in use.
//!
//! What bounds it: the search multiplies d by the influence of every other node, S·65 multiply-adds, which the compiler
//! turns into vectors; the refinement reads two nodes a step and converges in two or three steps.

use super::belief::ForceBelief;
use super::table::InfluenceTable;
use crate::numerics::chi_squared_bound;

/// A table that is ready to be searched: whitened, and without the channels that are left out.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Search {
    /// The channels in use.
    pub live: Vec<usize>,
    /// One over the noise of each channel in use.
    inverse_sd: Vec<f64>,
    offsets: Vec<f64>,
    /// f, f′ and the variance of f, of the channels in use.
    pub table: InfluenceTable,
    /// f at every STRIDE-th node: blocks of nodes, in each block channel by channel, padded with zeros.
    coarse: Vec<[f64; BLOCK]>,
    /// |f|² at every STRIDE-th node.
    norms: Vec<f64>,
    /// 1/(1 + v) in every cell, v the calibration's variance of a reading over the noise's; cells × channels.
    weights: Vec<f64>,
    pub force: ForceBelief,
    /// The calibration's mean force, in newtons: its offsets are as uncertain as its influences at this force.
    reference_force_n: f64,
    /// A misfit of one contact is larger than this once in ten thousand readings; infinite where none can be.
    pub worst_misfit: f64,
    /// |d|² of noise alone is larger than this once in ten thousand readings.
    pub worst_noise: f64,
}

/// The search looks at every so many nodes; misfits between them are smooth.
pub(super) const STRIDE: usize = 4;

/// Nodes that are searched side by side, so that their sums stay in registers.
const BLOCK: usize = 8;

/// Memory for locating a reading.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// d.
    pub(super) whitened: Vec<f64>,
    /// The misfit at every STRIDE-th node.
    pub(super) misfits: Vec<f64>,
}

/// A minimum of the misfit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum {
    pub x_m: f64,
    pub force_n: f64,
    /// χ² there.
    pub misfit: f64,
    /// Variance of the position, covariance of position and force, variance of the force.
    pub covariance: [f64; 3],
}

/// Minima that may matter; more never compete in practice.
pub(super) const MOST_MINIMA: usize = 4;

/// A minimum this much above the best has a share of e⁻¹² of the probability.
const NEGLIGIBLE: f64 = 24.0;

impl Search {
    /// Whitens a table by the noise of each channel, and leaves out the channels that are `dead`.
    pub fn new(
        table: &InfluenceTable,
        offsets: &[f64],
        noise_sd: &[f64],
        dead: &[bool],
        force: ForceBelief,
        reference_force_n: f64,
    ) -> Self {
        let live: Vec<usize> = (0..table.sensors).filter(|s| !dead[*s]).collect();
        let inverse_sd: Vec<f64> = live.iter().map(|s| 1.0 / noise_sd[*s]).collect();
        let whiten = |values: &[f64], power: i32| {
            let rows = values.chunks_exact(table.sensors);
            let row = |row: &[f64]| -> Vec<f64> {
                live.iter().zip(&inverse_sd).map(|(s, inverse)| row[*s] * inverse.powi(power)).collect()
            };
            rows.flat_map(row).collect::<Vec<f64>>()
        };
        let table = InfluenceTable {
            sensors: live.len(),
            length_m: table.length_m,
            values: whiten(&table.values, 1),
            slopes: whiten(&table.slopes, 1),
            variances: whiten(&table.variances, 2),
        };
        let nodes: Vec<usize> = (0..table.nodes()).step_by(STRIDE).collect();
        let blocks = nodes.chunks(BLOCK).flat_map(|block| (0..live.len()).map(move |s| (block, s)));
        let coarse = blocks.map(|(block, s)| {
            std::array::from_fn(|i| block.get(i).map_or(0.0, |node| table.at_node(*node)[s]))
        });
        let coarse = coarse.collect();
        let norms = nodes.iter().map(|node| table.at_node(*node).iter().map(|f| f * f).sum()).collect();
        let offsets = live.iter().map(|s| offsets[*s]).collect();
        let force_squared = reference_force_n.powi(2);
        let (left, right) = (&table.variances[..], &table.variances[live.len()..]);
        let cells = left.iter().zip(right);
        let weights = cells.map(|(a, b)| 1.0 / (1.0 + 0.5 * force_squared * (a + b))).collect();
        Self {
            worst_misfit: worst_misfit(live.len().saturating_sub(force.unknowns())),
            worst_noise: worst_misfit(live.len()),
            live,
            inverse_sd,
            offsets,
            table,
            coarse,
            norms,
            weights,
            force,
            reference_force_n,
        }
    }

    /// Places that the search tells apart.
    pub fn coarse_nodes(&self) -> usize {
        self.norms.len()
    }

    /// What the table's variances are multiplied by for a contact of a force.
    pub fn variance_scale(&self, force_n: f64) -> f64 {
        force_n.max(self.reference_force_n).powi(2)
    }

    /// Puts d into the scratch; |d|².
    pub fn whiten(&self, reading: &[f64], scratch: &mut Scratch) -> f64 {
        let channels = self.live.iter().zip(&self.offsets).zip(&self.inverse_sd);
        scratch.whitened.clear();
        scratch.whitened.extend(channels.map(|((s, offset), inverse)| (reading[*s] - offset) * inverse));
        scratch.whitened.iter().map(|d| d * d).sum()
    }

    /// The minima that matter, best first, of a reading that was whitened to length `square`.
    pub fn minima(&self, square: f64, scratch: &mut Scratch) -> ([Minimum; MOST_MINIMA], usize) {
        self.scan(square, scratch);
        let candidates = coarse_minima(&scratch.misfits);
        let mut found = [NOWHERE; MOST_MINIMA];
        let mut count = 0;
        for node in candidates.into_iter().flatten() {
            let start_m = vertex(&scratch.misfits, node) * STRIDE as f64 * self.table.spacing_m();
            let minimum = self.refine(&scratch.whitened, start_m);
            let is_new = |other: &Minimum| (other.x_m - minimum.x_m).abs() > 0.5 * self.table.spacing_m();
            if found[..count].iter().all(is_new) {
                found[count] = minimum;
                count += 1;
            }
        }
        found[..count].sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        let best = found[0].misfit;
        let count = found[..count].iter().take_while(|m| m.misfit <= best + NEGLIGIBLE).count();
        (found, count.max(1))
    }

    /// The misfit at every STRIDE-th node, with the best force there.
    fn scan(&self, square: f64, scratch: &mut Scratch) {
        scratch.misfits.clear();
        for block in self.coarse.chunks_exact(self.live.len()) {
            let mut products = [0.0; BLOCK];
            for (f, d) in block.iter().zip(&scratch.whitened) {
                for i in 0..BLOCK {
                    products[i] += d * f[i];
                }
            }
            scratch.misfits.extend_from_slice(&products);
        }
        scratch.misfits.truncate(self.norms.len());
        let products = &mut scratch.misfits;
        match self.force {
            ForceBelief::Known(force_n) => {
                for (product, norm) in products.iter_mut().zip(&self.norms) {
                    *product = square + force_n * (force_n * norm - 2.0 * *product);
                }
            }
            belief => {
                let (mean, precision) = belief.mean_and_precision();
                let constant = square + mean * mean * precision;
                for (product, norm) in products.iter_mut().zip(&self.norms) {
                    let pull = (*product + mean * precision).max(0.0);
                    *product = constant - pull * pull / (norm + precision).max(f64::MIN_POSITIVE);
                }
            }
        }
    }

    /// The minimum near `x_m`.
    pub fn refine(&self, whitened: &[f64], mut x_m: f64) -> Minimum {
        const MOST_STEPS: usize = 16;
        let reach = 2.0 * self.table.spacing_m();
        let mut force_n = None;
        let mut sums = self.sums(whitened, x_m, force_n);
        for _ in 0..MOST_STEPS {
            let (step_m, step_n) = sums.step(self.force);
            let next = (x_m + step_m.clamp(-reach, reach)).clamp(0.0, self.table.length_m);
            let moved = next - x_m;
            x_m = next;
            force_n = Some((sums.force_n + step_n).max(0.0));
            // The error that a step leaves is of the order of its square, so the last step is taken on trust.
            let covariance = sums.covariance(self.force);
            if moved.abs() <= 0.02 * covariance[0].sqrt() || moved.abs() <= 1e-9 * self.table.length_m {
                let misfit = self.misfit(&sums) - moved * moved / covariance[0];
                return Minimum { x_m, force_n: force_n.unwrap_or(sums.force_n), misfit, covariance };
            }
            sums = self.sums(whitened, x_m, force_n);
        }
        let covariance = sums.covariance(self.force);
        Minimum { x_m, force_n: sums.force_n, misfit: self.misfit(&sums), covariance }
    }

    fn misfit(&self, sums: &Sums) -> f64 {
        match self.force {
            ForceBelief::Normal { mean_n, sd_n } => sums.square + ((sums.force_n - mean_n) / sd_n).powi(2),
            _ => sums.square,
        }
    }

    /// The sums of the normal equations at a place, with a force or the best one there.
    fn sums(&self, whitened: &[f64], x_m: f64, force_n: Option<f64>) -> Sums {
        let force_n = match (self.force, force_n) {
            (ForceBelief::Known(force_n), _) | (_, Some(force_n)) => force_n,
            _ => self.best_force(whitened, x_m),
        };
        let scale = self.variance_scale(force_n);
        let grown = scale / self.reference_force_n.powi(2);
        let cell = self.table.cell(x_m);
        let weights = &self.weights[cell.node * self.live.len()..][..self.live.len()];
        let mut sums = Sums { force_n, ..Sums::default() };
        self.table.for_each(cell, |s, f, slope| {
            // 1/(1 + g·v) from w = 1/(1 + v), without a division where the force is as in calibration.
            let weight =
                if grown > 1.0 { weights[s] / (weights[s] + grown * (1.0 - weights[s])) } else { weights[s] };
            let e = whitened[s] - force_n * f;
            sums.square += weight * e * e;
            sums.ff += weight * f * f;
            sums.fg += weight * f * slope;
            sums.gg += weight * slope * slope;
            sums.ef += weight * e * f;
            sums.eg += weight * e * slope;
        });
        sums
    }

    fn best_force(&self, whitened: &[f64], x_m: f64) -> f64 {
        let (mean, precision) = self.force.mean_and_precision();
        let (mut product, mut norm) = (mean * precision, precision);
        self.table.for_each(self.table.cell(x_m), |s, f, _| {
            product += whitened[s] * f;
            norm += f * f;
        });
        if norm > 0.0 { (product / norm).max(0.0) } else { 0.0 }
    }
}

/// Sums over channels at a place: e = d − W·f the residual, g = f′, each weighted by the calibration's own variance.
#[derive(Clone, Copy, Default)]
struct Sums {
    force_n: f64,
    square: f64,
    ff: f64,
    fg: f64,
    gg: f64,
    ef: f64,
    eg: f64,
}

impl Sums {
    /// The information about position and force: aa, aW, WW.
    fn information(&self, precision: f64) -> [f64; 3] {
        let w = self.force_n;
        [w * w * self.gg, w * self.fg, self.ff + precision]
    }

    /// The Gauss–Newton step of position and force.
    fn step(&self, belief: ForceBelief) -> (f64, f64) {
        let along = self.force_n * self.eg;
        if let ForceBelief::Known(_) = belief {
            let [aa, ..] = self.information(0.0);
            return (if aa > 0.0 { along / aa } else { 0.0 }, 0.0);
        }
        let (mean, precision) = belief.mean_and_precision();
        let pull = self.ef - precision * (self.force_n - mean);
        let [aa, aw, ww] = self.information(precision);
        let determinant = aa * ww - aw * aw;
        if determinant <= 1e-14 * aa * ww {
            return (0.0, 0.0);
        }
        ((along * ww - pull * aw) / determinant, (pull * aa - along * aw) / determinant)
    }

    /// The Cramér–Rao covariance: variance of position, covariance, variance of force; infinite where nothing is told.
    fn covariance(&self, belief: ForceBelief) -> [f64; 3] {
        if let ForceBelief::Known(_) = belief {
            return [1.0 / self.information(0.0)[0], 0.0, 0.0];
        }
        let [aa, aw, ww] = self.information(belief.mean_and_precision().1);
        let determinant = aa * ww - aw * aw;
        if determinant <= 1e-14 * aa * ww {
            return [f64::INFINITY, 0.0, f64::INFINITY];
        }
        [ww / determinant, -aw / determinant, aa / determinant]
    }
}

/// The misfit that a reading exceeds once in ten thousand times, when `freedom` channels more than unknowns are in use;
/// infinite where none are.
pub(super) fn worst_misfit(freedom: usize) -> f64 {
    match freedom {
        0 => f64::INFINITY,
        freedom => chi_squared_bound(1e-4, freedom),
    }
}

const NOWHERE: Minimum = Minimum {
    x_m: 0.0,
    force_n: 0.0,
    misfit: f64::INFINITY,
    covariance: [f64::INFINITY, 0.0, f64::INFINITY],
};

/// The lowest point, in nodes, of the parabola through a node and its neighbours.
fn vertex(misfits: &[f64], node: usize) -> f64 {
    let here = node as f64;
    let (Some(left), Some(right)) = (node.checked_sub(1), misfits.get(node + 1)) else { return here };
    let (rise, bend) = (right - misfits[left], misfits[left] - 2.0 * misfits[node] + right);
    if bend > 0.0 { here - (0.5 * rise / bend).clamp(-0.5, 0.5) } else { here }
}

/// The lowest nodes that are no higher than both neighbours, at most [`MOST_MINIMA`].
fn coarse_minima(misfits: &[f64]) -> [Option<usize>; MOST_MINIMA] {
    let mut lowest: [Option<usize>; MOST_MINIMA] = [None; MOST_MINIMA];
    let at = |node: usize| misfits.get(node).copied().unwrap_or(f64::INFINITY);
    for node in 0..misfits.len() {
        let value = misfits[node];
        let left = if node == 0 { f64::INFINITY } else { misfits[node - 1] };
        if !(value <= left && value < at(node + 1)) {
            continue;
        }
        let rank = lowest.iter().position(|other| other.is_none_or(|other| value < misfits[other]));
        if let Some(rank) = rank {
            lowest[rank..].rotate_right(1);
            lowest[rank] = Some(node);
        }
    }
    lowest
}
