//! Recordings: readings with their contacts.

mod cells;
mod columns;
mod csv_error;
mod csv_in;
mod csv_out;
mod dialect;
mod forces;
mod grouping;
mod heading;
mod lines;
mod marks;
mod notes;
mod placement;
mod repeat_watch;
mod repeated_readings;
mod sample_hold;
mod table;
mod text;
mod timestamp;
mod untouched;
mod warnings;
mod zero;
mod zero_force;

pub use columns::{Column, Columns, ForceColumn, Frame, Header, Need, PositionColumns, ValueColumn};
pub use csv_error::{CsvError, CsvProblem, Place};
pub use csv_in::{
    LineParser, ReadingParser, Schema, TimedParser, TimedReading, TimedRecording, read, read_pair,
};
pub use csv_out::{csv_row, write, write_as, write_timed};
pub use dialect::{Dialect, Notes, Preamble};
pub use forces::{is_one_force, is_same_force};
pub use heading::Heading;
pub use lines::LineProgress;
pub use marks::{Decimal, Separator};
pub use placement::comment_with_placement;
pub use repeat_watch::RepeatWatch;
pub use repeated_readings::{RepeatedReadings, Repeats};
pub use sample_hold::{FALSE_ALARM, RepeatCause, RepeatCounts, is_same_reading};
pub use table::{Content, Table, TableColumn};
pub use text::TextDecoder;
pub use untouched::{TimeSpan, TimeSpanError};
pub(crate) use warnings::channel_list;
pub use warnings::{DriftRows, Warning};
pub use zero::{NoUntouchedRow, Zero};
pub use zero_force::ZeroForce;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::imperfections::BenchState;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_numerics::{mean, random_order};
use std::borrow::Cow;

/// Degrees of freedom up to which a noise estimate is unreliable; the prior of a channel's noise counts as
/// many.
pub(crate) const LEAST_FREEDOM: f64 = 4.0;

/// Readings with their contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Channel names.
    pub channels: Vec<String>,
    /// Quantity that each channel measures.
    pub kinds: Vec<SensorKind>,
    /// Rows in the order of recording.
    pub rows: Vec<Row>,
    /// Provenance of the rows.
    pub provenance: Provenance,
}

/// One reading and its contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// True position.
    pub position: Position,
    /// Force in newtons, positive downward; `None` if unmeasured, 0 if untouched.
    pub force_n: Option<f64>,
    /// Known coordinates that affect the reading, such as temperature, in SI units; unknown when a reading is
    /// located.
    pub nuisances: Vec<f64>,
    /// Time in seconds, for timestamps since the first row.
    pub time_s: Option<f64>,
    /// One finite value per channel, in SI units or raw.
    pub reading: Vec<f64>,
}

impl Row {
    /// Returns the contact; `None` without force.
    pub fn contact(&self) -> Option<Contact> {
        self.force_n.map(|force_n| Contact { position: self.position, force_n })
    }

    /// True unless the force is 0, where the position has no meaning.
    pub fn touches(&self) -> bool {
        self.force_n != Some(0.0)
    }
}

/// Returns the SHA-256 of a file's content in hexadecimal.
pub fn sha256_hex(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Provenance of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the file, or "simulation".
    pub source: String,
    /// Number of rows.
    pub rows: usize,
    /// [`sha256_hex`] of each file; empty for a simulation.
    pub digests: Vec<String>,
    /// Dialects of files that are not plain CSV.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dialects: Vec<Dialect>,
    /// Repeated rows and slow channels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeats>,
    /// Seed of a simulation.
    pub seed: Option<u64>,
    /// Standard deviation of manual placement in each direction, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement_sd_m: Option<f64>,
    /// Final state of a simulated bench.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<BenchState>,
}

/// Fold of cross-validation by position.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// Rows to fit.
    pub training: Vec<usize>,
    /// Rows at held-out positions.
    pub held_out: Vec<usize>,
}

/// Too few distinct positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the recording has {found} distinct positions; at least {needed} are needed")]
pub struct TooFewPositions {
    /// Number of positions.
    pub found: usize,
    /// Required number.
    pub needed: usize,
}

impl Recording {
    /// Creates a recording without files or seed.
    pub fn new(layout: &Layout, source: &str, rows: Vec<Row>) -> Self {
        let provenance = Provenance {
            source: source.to_owned(),
            rows: rows.len(),
            digests: Vec::new(),
            dialects: Vec::new(),
            repeats: None,
            seed: None,
            placement_sd_m: None,
            bench: None,
        };
        Self { channels: layout.names(), kinds: layout.kinds(), rows, provenance }
    }

    /// Sets the seed.
    #[must_use]
    pub fn seeded(mut self, seed: u64) -> Self {
        self.provenance.seed = Some(seed);
        self
    }

    /// Returns the times in seconds; `None` if some row has none.
    pub fn times_s(&self) -> Option<Vec<f64>> {
        self.rows.iter().map(|row| row.time_s).collect()
    }

    /// Times in seconds, or row numbers if some row has none.
    pub(crate) fn times_or_order(&self) -> Vec<f64> {
        self.times_s().unwrap_or_else(|| (0..self.rows.len()).map(|row| row as f64).collect())
    }

    /// Sets times to row numbers if some row has none, so that subsets keep their order.
    #[must_use]
    pub fn in_order(mut self) -> Self {
        if self.times_s().is_none() {
            self.rows.iter_mut().enumerate().for_each(|(i, row)| row.time_s = Some(i as f64));
        }
        self
    }

    /// Returns the touched positions, sorted by x, then y.
    pub fn distinct_positions(&self) -> Vec<Position> {
        let touched = self.rows.iter().filter(|row| row.touches());
        let mut positions: Vec<Position> = touched.map(|row| row.position).collect();
        positions.sort_by(Position::cmp_by_x_then_y);
        positions.dedup_by(|a, b| a.cmp_by_x_then_y(b).is_eq());
        positions
    }

    /// True if every row has a force, but repeats are too few for a reliable noise estimate.
    pub fn has_unreliable_noise(&self) -> bool {
        let spare = self.rows.len().saturating_sub(self.distinct_positions().len() + 1);
        self.rows.iter().all(|row| row.force_n.is_some()) && spare as f64 <= LEAST_FREEDOM
    }

    /// Checks the number of distinct positions.
    ///
    /// # Errors
    /// [`TooFewPositions`].
    pub fn check_distinct_positions(&self, needed: usize) -> Result<(), TooFewPositions> {
        let found = self.distinct_positions().len();
        if found >= needed { Ok(()) } else { Err(TooFewPositions { found, needed }) }
    }

    /// Splits the rows into folds, at least 2: fold k holds out positions i with i mod `count` = k, sorted by
    /// x, then y. Untouched rows are in every training set.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let folds = setup.simulate(&Training::even(10).repeated(2), 0)?.folds(5)?;
    /// assert_eq!((folds.len(), folds[0].training.len(), folds[0].held_out.len()), (5, 16, 4));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`TooFewPositions`].
    pub fn folds(&self, count: usize) -> Result<Vec<Fold>, TooFewPositions> {
        let count = count.max(2);
        self.check_distinct_positions(count)?;
        let positions = self.distinct_positions();
        let mut folds = vec![Fold { training: Vec::new(), held_out: Vec::new() }; count];
        for (i, row) in self.rows.iter().enumerate() {
            let index = positions.partition_point(|position| position.cmp_by_x_then_y(&row.position).is_lt());
            for (k, fold) in folds.iter_mut().enumerate() {
                let is_held_out = row.touches() && index % count == k;
                if is_held_out { fold.held_out.push(i) } else { fold.training.push(i) }
            }
        }
        Ok(folds)
    }

    /// Returns the touched rows.
    pub fn touched(&self) -> Cow<'_, Self> {
        if self.rows.iter().all(Row::touches) {
            return Cow::Borrowed(self);
        }
        let rows = self.rows.iter().filter(|row| row.touches()).cloned().collect();
        Cow::Owned(Self {
            channels: self.channels.clone(),
            kinds: self.kinds.clone(),
            rows,
            provenance: self.provenance.clone(),
        })
    }

    /// Returns the mean untouched reading.
    pub fn untouched_mean(&self) -> Option<Vec<f64>> {
        let untouched: Vec<usize> = (0..self.rows.len()).filter(|row| !self.rows[*row].touches()).collect();
        (!untouched.is_empty()).then(|| self.mean_reading(&untouched))
    }

    /// Returns the mean reading of some rows.
    pub fn mean_reading(&self, rows: &[usize]) -> Vec<f64> {
        let channel = |c: usize| mean(rows.iter().map(|row| self.rows[*row].reading[c]));
        (0..self.channels.len()).map(channel).collect()
    }

    /// Returns runs of consecutive untouched rows.
    pub fn untouched_groups(&self) -> Vec<Vec<usize>> {
        let indices: Vec<usize> = (0..self.rows.len()).collect();
        let touches = |row: &usize| self.rows[*row].touches();
        let runs = indices.chunk_by(|a, b| touches(a) == touches(b));
        runs.filter(|run| !touches(&run[0])).map(<[usize]>::to_vec).collect()
    }

    /// Draws one row of each touched position, at random because rows may be ordered by depth; `None` if that
    /// is every row.
    pub fn one_row_a_position(&self, seed: u64) -> Option<Self> {
        let positions = self.distinct_positions();
        let mut drawn: Vec<Option<usize>> = vec![None; positions.len()];
        for i in random_order(self.rows.len(), seed) {
            let row = &self.rows[i];
            if row.touches() {
                let index =
                    positions.partition_point(|position| position.cmp_by_x_then_y(&row.position).is_lt());
                drawn[index].get_or_insert(i);
            }
        }
        let drawn: Vec<usize> = drawn.into_iter().flatten().collect();
        (drawn.len() < self.rows.len()).then(|| self.subset(&drawn))
    }

    /// Returns the recording of some rows; ignores indices beyond the last.
    pub fn subset(&self, rows: &[usize]) -> Self {
        let rows: Vec<Row> = rows.iter().filter_map(|i| self.rows.get(*i)).cloned().collect();
        let provenance = Provenance { rows: rows.len(), ..self.provenance.clone() };
        Self { channels: self.channels.clone(), kinds: self.kinds.clone(), rows, provenance }
    }
}

#[cfg(test)]
mod file_tests;
#[cfg(test)]
mod tests;
