//! Where to look: the misfit at every second node of the table, and its lowest valleys.
//!
//! Symbols as in [`super::search`].

use super::patches::{Lanes, Patches};
use super::table::PlaneTable;
use crate::influence::belief::ForceBelief;

/// The search looks at every so many nodes, each way; misfits between them are smooth.
const STRIDE: usize = 2;

/// Valleys from which a refinement starts, at most.
pub(super) const MOST_VALLEYS: usize = 6;

/// The influences at the coarse nodes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coarse {
    columns: usize,
    rows: usize,
    /// Distance of neighbouring coarse nodes along and across, in metres.
    pub spacing_m: [f64; 2],
    /// f, channel by channel, each in blocks of eight nodes.
    influences: Vec<Vec<Lanes>>,
    /// |f|² of every node.
    norms: Vec<Lanes>,
}

/// Memory of one scan.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    /// d·f, then the misfit, at every coarse node.
    misfits: Vec<Lanes>,
}

impl Coarse {
    /// Of whitened patches with so many channels.
    pub fn new(table: &PlaneTable, patches: &Patches, channels: usize) -> Self {
        let (columns, rows) = ((table.columns - 1) / STRIDE + 1, (table.rows - 1) / STRIDE + 1);
        let blocks = (columns * rows).div_ceil(8);
        let mut influences = vec![vec![[0.0; 8]; blocks]; channels];
        let mut norms = vec![[0.0; 8]; blocks];
        for node in 0..columns * rows {
            let (column, row) = (node % columns, node / columns);
            for (channel, blocks) in influences.iter_mut().enumerate() {
                let f = patches.at_node(STRIDE * column, STRIDE * row, channel / 8)[channel % 8];
                blocks[node / 8][node % 8] = f;
                norms[node / 8][node % 8] += f * f;
            }
        }
        let spacing_m = table.spacing_m().map(|spacing_m| STRIDE as f64 * spacing_m);
        Self { columns, rows, spacing_m, influences, norms }
    }

    /// How many nodes there are.
    pub fn nodes(&self) -> usize {
        self.columns * self.rows
    }

    /// The misfit at every node, with the best force there, of a whitened reading of length `square`.
    pub fn scan(&self, whitened: &[f64], square: f64, force: ForceBelief, profile: &mut Profile) {
        profile.misfits.clear();
        profile.misfits.resize(self.norms.len(), [0.0; 8]);
        for (d, blocks) in whitened.iter().zip(&self.influences) {
            for (product, f) in profile.misfits.iter_mut().zip(blocks) {
                for lane in 0..8 {
                    product[lane] += d * f[lane];
                }
            }
        }
        let (mean, precision) = force.mean_and_precision();
        for (misfit, norm) in profile.misfits.iter_mut().zip(&self.norms) {
            for lane in 0..8 {
                let (product, norm) = (misfit[lane], norm[lane]);
                misfit[lane] = match force {
                    ForceBelief::Known(force_n) => square + force_n * (force_n * norm - 2.0 * product),
                    _ => {
                        let pull = (product + mean * precision).max(0.0);
                        let norm = (norm + precision).max(f64::MIN_POSITIVE);
                        square + mean * mean * precision - pull * pull / norm
                    }
                };
            }
        }
    }

    /// The lowest valleys and how many, lowest first: nodes no higher than all their neighbours, with their places in
    /// metres.
    pub fn valleys(&self, profile: &Profile) -> ([[f64; 2]; MOST_VALLEYS], usize) {
        let misfits = profile.misfits.as_flattened();
        let (mut lowest, mut places, mut count) = ([0.0; MOST_VALLEYS], [[0.0; 2]; MOST_VALLEYS], 0);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let value = misfits[row * self.columns + column];
                if !self.is_valley(misfits, column, row) {
                    continue;
                }
                let mut rank = count;
                while rank > 0 && value < lowest[rank - 1] {
                    rank -= 1;
                }
                if rank < MOST_VALLEYS {
                    count = (count + 1).min(MOST_VALLEYS);
                    lowest[rank..count].rotate_right(1);
                    places[rank..count].rotate_right(1);
                    lowest[rank] = value;
                    places[rank] = [column as f64 * self.spacing_m[0], row as f64 * self.spacing_m[1]];
                }
            }
        }
        (places, count)
    }

    fn is_valley(&self, misfits: &[f64], column: usize, row: usize) -> bool {
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let value = misfits[row * self.columns + column];
        around(row, self.rows).all(|r| {
            let line = &misfits[r * self.columns..][around(column, self.columns)];
            line.iter().all(|other| value <= *other)
        })
    }
}
