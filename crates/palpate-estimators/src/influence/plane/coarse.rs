//! Where to look: the misfit in the middle of every cell of a coarse grid, and its lowest valleys.
//!
//! Symbols as in [`super::search`]. A cell is two nodes of the table long and wide, and the odd nodes are their middles: no
//! middle lies on an edge, where a support may hide every contact.

use super::table::{Patches, PlaneTable};
use crate::influence::config::ForceBelief;
use crate::influence::lanes::Lanes;

/// Valleys from which a refinement starts, at most.
pub(super) const MOST_VALLEYS: usize = 6;
/// Readings stray from the straight way between two middles, along which reaches are measured.
const MARGIN: f64 = 1.1;

/// The influences in the middles of the cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coarse {
    columns: usize,
    rows: usize,
    /// Length and width of a cell, in metres.
    pub cell_m: [f64; 2],
    /// f, channel by channel, each in blocks of eight cells.
    influences: Vec<Vec<Lanes>>,
    /// |f|² of every cell.
    norms: Vec<Lanes>,
    /// For each cell how far a newton's readings within it are from that of its middle, at most, as far as the force does
    /// not make up for it: half as far as its neighbours' middles.
    pub reaches: Vec<f64>,
    /// For each cell how far apart those of its ends are, along and across.
    pub lengths: Vec<[f64; 2]>,
    /// The same with one force all over the cell, where it is not known.
    pub whole_lengths: Vec<[f64; 2]>,
}

/// Memory of one scan.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    /// The misfit of every cell, and fillers behind.
    misfits: Vec<Lanes>,
    /// The best force of every cell, where it is not known.
    forces: Vec<Lanes>,
}

impl Profile {
    /// The misfit of every cell, and fillers behind.
    pub fn misfits(&self) -> &[f64] {
        self.misfits.as_flattened()
    }

    /// The best force in a cell, in newtons.
    pub fn force_n(&self, cell: usize, force: ForceBelief) -> f64 {
        force.known_n().unwrap_or_else(|| self.forces.as_flattened()[cell])
    }
}

/// A valley of a profile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Valley {
    pub cell: usize,
    pub misfit: f64,
}

impl Coarse {
    /// Coarse cells of whitened patches with so many channels.
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

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// The middle of a cell, in metres.
    pub fn middle_m(&self, cell: usize) -> [f64; 2] {
        let (column, row) = (cell % self.columns, cell / self.columns);
        [(column as f64 + 0.5) * self.cell_m[0], (row as f64 + 0.5) * self.cell_m[1]]
    }

    /// Distance of the readings of a newton in two cells; where nothing is known of the force, of one that is as
    /// strong in the second cell's readings as a newton is in the first's.
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

    /// The misfit of every cell, with the best force there, of a whitened reading of length `square`.
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

    /// The lowest valleys and how many, lowest first: cells no higher than all their neighbours.
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

/// A place and those before and behind it.
fn around(at: usize, count: usize) -> std::ops::Range<usize> {
    at.saturating_sub(1)..(at + 2).min(count)
}
