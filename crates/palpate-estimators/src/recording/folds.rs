//! Splitting a recording by position, so that no position is in both halves.

use super::{Provenance, Recording, Row};
use palpate_mechanics::contact::Position;

/// One way to hold positions out: the rows to fit, and the rows to judge by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// Indices of the rows to fit.
    pub training: Vec<usize>,
    /// Indices of the rows at held-out positions.
    pub held_out: Vec<usize>,
}

/// A recording has fewer distinct positions than are needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the recording has {found} distinct positions; at least {needed} are needed")]
pub struct TooFewPositions {
    /// How many it has.
    pub found: usize,
    /// How many are needed.
    pub needed: usize,
}

impl Recording {
    /// Every position that occurs, once, sorted by x and then y.
    pub fn distinct_positions(&self) -> Vec<Position> {
        let mut positions: Vec<Position> = self.rows.iter().map(|row| row.position).collect();
        positions.sort_by(Position::cmp_by_x_then_y);
        positions.dedup_by(|a, b| a.cmp_by_x_then_y(b).is_eq());
        positions
    }

    /// Checks that there are at least `needed` distinct positions.
    ///
    /// # Errors
    /// [`TooFewPositions`], with both numbers.
    pub fn check_distinct_positions(&self, needed: usize) -> Result<(), TooFewPositions> {
        let found = self.distinct_positions().len();
        if found >= needed { Ok(()) } else { Err(TooFewPositions { found, needed }) }
    }

    /// Splits the rows into `count` folds by position: of the distinct positions, sorted by x and then y, fold k
    /// holds out those whose index leaves k when divided by `count`, with all their rows.
    ///
    /// # Errors
    /// [`TooFewPositions`] when there are fewer distinct positions than folds, or fewer than 2, since every fold
    /// needs rows to fit; a `count` below 2 counts as 2.
    pub fn folds(&self, count: usize) -> Result<Vec<Fold>, TooFewPositions> {
        let count = count.max(2);
        self.check_distinct_positions(count)?;
        let positions = self.distinct_positions();
        let mut folds = vec![Fold { training: Vec::new(), held_out: Vec::new() }; count];
        for (i, row) in self.rows.iter().enumerate() {
            let index = positions.partition_point(|position| position.cmp_by_x_then_y(&row.position).is_lt());
            for (k, fold) in folds.iter_mut().enumerate() {
                if index % count == k { fold.held_out.push(i) } else { fold.training.push(i) }
            }
        }
        Ok(folds)
    }

    /// The recording that consists of `rows`, indices into this one's; those beyond it are left out.
    pub fn subset(&self, rows: &[usize]) -> Self {
        let rows: Vec<Row> = rows.iter().filter_map(|i| self.rows.get(*i)).cloned().collect();
        let provenance = Provenance { rows: rows.len(), ..self.provenance.clone() };
        Self { channels: self.channels.clone(), kinds: self.kinds.clone(), rows, provenance }
    }
}
