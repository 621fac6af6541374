//! Coarse search on a plane: χ² in the middle of every cell, and its local minima.
//!
//! Symbols as in [`super::search`]. A cell is two nodes wide, around an odd node: a support may hide contacts
//! on an edge.

use super::table::{Patches, PlaneTable};
use crate::influence::config::ForceBelief;
use crate::influence::lanes::Lanes;

pub(super) const MOST_VALLEYS: usize = 6;
/// Allowance for the deviation of readings from the chord between two middles.
const MARGIN: f64 = 1.1;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coarse {
    columns: usize,
    rows: usize,
    pub cell_m: [f64; 2],
    /// f by channel and block of eight cells.
    influences: Vec<Vec<Lanes>>,
    /// |f|².
    norms: Vec<Lanes>,
    /// Greatest distance of readings within a cell from the middle's, per newton at the best force.
    pub reaches: Vec<f64>,
    /// Distance between readings of a cell's ends, at the best force.
    pub lengths: Vec<[f64; 2]>,
    /// Distance at equal forces.
    pub whole_lengths: Vec<[f64; 2]>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    misfits: Vec<Lanes>,
    forces: Vec<Lanes>,
}

impl Profile {
    pub fn misfits(&self) -> &[f64] {
        self.misfits.as_flattened()
    }

    pub fn force_n(&self, cell: usize, force: ForceBelief) -> f64 {
        force.known_n().unwrap_or_else(|| self.forces.as_flattened()[cell])
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Valley {
    pub cell: usize,
    pub misfit: f64,
}

impl Coarse {
    pub fn new(table: &PlaneTable, patches: &Patches, channels: usize, force: ForceBelief) -> Self {
        let (columns, rows) = ((table.columns - 1) / 2, (table.rows - 1) / 2);
        let blocks = (columns * rows).div_ceil(8);
        let mut influences = vec![vec![[0.0; 8]; blocks]; channels];
        let mut norms = vec![[0.0; 8]; blocks];
        for cell in 0..columns * rows {
            let (column, row) = (cell % columns, cell / columns);
            for (channel, blocks) in influences.iter_mut().enumerate() {
                let f = patches.at_node(2 * column + 1, 2 * row + 1, channel / 8)[channel % 8];
                blocks[cell / 8][cell % 8] = f;
                norms[cell / 8][cell % 8] += f * f;
            }
        }
        let cell_m = table.spacing_m().map(|spacing_m| 2.0 * spacing_m);
        let (reaches, lengths, whole_lengths) = (Vec::new(), Vec::new(), Vec::new());
        let mut coarse = Self { columns, rows, cell_m, influences, norms, reaches, lengths, whole_lengths };
        coarse.reaches = (0..columns * rows).map(|cell| coarse.reach(cell, force)).collect();
        coarse.lengths = (0..columns * rows).map(|cell| coarse.length(cell, force)).collect();
        let known = ForceBelief::Known(1.0);
        coarse.whole_lengths = (0..columns * rows).map(|cell| coarse.length(cell, known)).collect();
        coarse
    }

    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    pub fn middle_m(&self, cell: usize) -> [f64; 2] {
        let (column, row) = (cell % self.columns, cell / self.columns);
        [(column as f64 + 0.5) * self.cell_m[0], (row as f64 + 0.5) * self.cell_m[1]]
    }

    /// Distance of readings per newton; at unknown force, after scaling to equal strength.
    fn distance(&self, first: usize, second: usize, force: ForceBelief) -> f64 {
        let at = |blocks: &[Lanes], cell: usize| blocks.as_flattened()[cell];
        let scale = match force {
            ForceBelief::Unknown => {
                (at(&self.norms, first) / at(&self.norms, second).max(f64::MIN_POSITIVE)).sqrt()
            }
            _ => 1.0,
        };
        let square = |blocks: &Vec<Lanes>| (at(blocks, first) - scale * at(blocks, second)).powi(2);
        self.influences.iter().map(square).sum::<f64>().sqrt()
    }

    fn reach(&self, cell: usize, force: ForceBelief) -> f64 {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let neighbours = around(row, self.rows)
            .flat_map(|r| around(column, self.columns).map(move |c| r * self.columns + c));
        0.5 * MARGIN * neighbours.map(|other| self.distance(cell, other, force)).fold(0.0, f64::max)
    }

    fn length(&self, cell: usize, force: ForceBelief) -> [f64; 2] {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let farthest = |neighbours: &mut dyn Iterator<Item = usize>| {
            neighbours.map(|other| self.distance(cell, other, force)).fold(0.0, f64::max)
        };
        [
            farthest(&mut around(column, self.columns).map(|c| row * self.columns + c)),
            farthest(&mut around(row, self.rows).map(|r| r * self.columns + column)),
        ]
    }

    /// Computes χ² of every cell at the best force; `square` is |d|².
    pub fn scan(&self, whitened: &[f64], square: f64, force: ForceBelief, profile: &mut Profile) {
        let Profile { misfits, forces } = profile;
        misfits.clear();
        misfits.resize(self.norms.len(), [0.0; 8]);
        for (d, blocks) in whitened.iter().zip(&self.influences) {
            for (product, f) in misfits.iter_mut().zip(blocks) {
                for lane in 0..8 {
                    product[lane] += d * f[lane];
                }
            }
        }
        if let ForceBelief::Known(force_n) = force {
            for (misfit, norm) in misfits.iter_mut().zip(&self.norms) {
                for lane in 0..8 {
                    misfit[lane] = square + force_n * (force_n * norm[lane] - 2.0 * misfit[lane]);
                }
            }
            return;
        }
        let (mean, precision) = force.mean_and_precision();
        let constant = square + mean * mean * precision;
        forces.clear();
        forces.resize(self.norms.len(), [0.0; 8]);
        for ((misfit, forces), norm) in misfits.iter_mut().zip(forces).zip(&self.norms) {
            for lane in 0..8 {
                let score = (misfit[lane] + mean * precision).max(0.0);
                forces[lane] = score / (norm[lane] + precision).max(f64::MIN_POSITIVE);
                misfit[lane] = constant - score * forces[lane];
            }
        }
    }

    pub fn valleys(&self, profile: &Profile) -> ([Valley; MOST_VALLEYS], usize) {
        let misfits = profile.misfits();
        let (mut lowest, mut count) = ([Valley::default(); MOST_VALLEYS], 0);
        for row in 0..self.rows {
            let line = &misfits[row * self.columns..][..self.columns];
            for (column, &misfit) in line.iter().enumerate() {
                let right = line.get(column + 1).is_none_or(|right| misfit <= *right);
                let left = column == 0 || misfit <= line[column - 1];
                let low = count < MOST_VALLEYS || misfit < lowest[count - 1].misfit;
                if !(left && right && low && self.is_valley(misfits, column, row)) {
                    continue;
                }
                let mut rank = count;
                while rank > 0 && misfit < lowest[rank - 1].misfit {
                    rank -= 1;
                }
                count = (count + 1).min(MOST_VALLEYS);
                lowest[rank..count].rotate_right(1);
                lowest[rank] = Valley { cell: row * self.columns + column, misfit };
            }
        }
        (lowest, count)
    }

    fn is_valley(&self, misfits: &[f64], column: usize, row: usize) -> bool {
        let value = misfits[row * self.columns + column];
        around(row, self.rows).all(|r| {
            let line = &misfits[r * self.columns..][around(column, self.columns)];
            line.iter().all(|other| value <= *other)
        })
    }
}

fn around(at: usize, count: usize) -> std::ops::Range<usize> {
    at.saturating_sub(1)..(at + 2).min(count)
}
