//! Readings paired with their contacts: the data that calibration records and evaluation requires.

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

/// Degrees of freedom of a channel's noise that count as those of its prior. A noise estimate with no more degrees of freedom is unreliable.
pub(crate) const LEAST_FREEDOM: f64 = 4.0;

/// Readings with the contacts that caused them.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The name of each channel, in the order of the readings' values.
    pub channels: Vec<String>,
    /// Quantity that each channel measures.
    pub kinds: Vec<SensorKind>,
    /// The rows, in the order in which they were recorded.
    pub rows: Vec<Row>,
    /// Provenance of the rows.
    pub provenance: Provenance,
}

/// One reading and its contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// True position of the contact.
    pub position: Position,
    /// Force in newtons, positive downward; `None` if it was not measured, 0 for an untouched row.
    pub force_n: Option<f64>,
    /// Coordinates that affect the reading, for example the depth of indentation and the temperature. They are known here and unknown when a
    /// reading is located. In the SI units of their columns and in their order; empty where the recording has no such columns.
    pub nuisances: Vec<f64>,
    /// Time in seconds, if the recording has one: from the origin of the file's times, or since the first row for timestamps.
    pub time_s: Option<f64>,
    /// One finite value per channel, in the SI unit of its kind (or raw).
    pub reading: Vec<f64>,
}

impl Row {
    /// The contact, where its force is known.
    pub fn contact(&self) -> Option<Contact> {
        self.force_n.map(|force_n| Contact { position: self.position, force_n })
    }

    /// True for a contact: the force is not 0. The position of a row without contact has no meaning.
    pub fn touches(&self) -> bool {
        self.force_n != Some(0.0)
    }
}

/// The SHA-256 of a file's content in hexadecimal, by which provenance names it.
pub fn sha256_hex(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Provenance of a recording. Every model that is fitted to the recording can state it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The name that the caller gave: usually a file's, or "simulation".
    pub source: String,
    /// Number of rows.
    pub rows: usize,
    /// The [`sha256_hex`] of each file that was read; empty for a simulation.
    pub digests: Vec<String>,
    /// Dialect of each file, where it is not plain CSV.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dialects: Vec<Dialect>,
    /// Rows that repeated the reading before them, and slow channels, where there are some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeats>,
    /// The seed of a simulation.
    pub seed: Option<u64>,
    /// Standard deviation in each direction of the pressed place about the position of its row, in metres, if a person pressed and the file states
    /// it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement_sd_m: Option<f64>,
    /// State in which the recording left a simulated bench with imperfections.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<BenchState>,
}

/// One fold of held-out positions: the rows to fit and the rows to evaluate.
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
    /// Number of distinct positions that it has.
    pub found: usize,
    /// Number that is needed.
    pub needed: usize,
}

impl Recording {
    /// A recording by the sensors of a layout, from a source of this name, without files or a seed.
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

    /// Sets the seed of the simulation.
    #[must_use]
    pub fn seeded(mut self, seed: u64) -> Self {
        self.provenance.seed = Some(seed);
        self
    }

    /// The time of every row, in seconds; `None` where some row has none.
    pub fn times_s(&self) -> Option<Vec<f64>> {
        self.rows.iter().map(|row| row.time_s).collect()
    }

    /// The time of every row in seconds, or its number where some row has none.
    pub(crate) fn times_or_order(&self) -> Vec<f64> {
        self.times_s().unwrap_or_else(|| (0..self.rows.len()).map(|row| row as f64).collect())
    }

    /// Sets the time of each row to its number if some row has no time, so that parts of the recording keep their order.
    #[must_use]
    pub fn in_order(mut self) -> Self {
        if self.times_s().is_none() {
            self.rows.iter_mut().enumerate().for_each(|(i, row)| row.time_s = Some(i as f64));
        }
        self
    }

    /// Every touched position, once, sorted by x and then y.
    pub fn distinct_positions(&self) -> Vec<Position> {
        let touched = self.rows.iter().filter(|row| row.touches());
        let mut positions: Vec<Position> = touched.map(|row| row.position).collect();
        positions.sort_by(Position::cmp_by_x_then_y);
        positions.dedup_by(|a, b| a.cmp_by_x_then_y(b).is_eq());
        positions
    }

    /// True where every row has a force, but too few rows repeat a place or are untouched to estimate the noise of influence functions.
    pub fn hardly_tells_noise(&self) -> bool {
        let spare = self.rows.len().saturating_sub(self.distinct_positions().len() + 1);
        self.rows.iter().all(|row| row.force_n.is_some()) && spare as f64 <= LEAST_FREEDOM
    }

    /// Checks that there are at least `needed` distinct positions.
    ///
    /// # Errors
    /// [`TooFewPositions`], with both numbers.
    pub fn check_distinct_positions(&self, needed: usize) -> Result<(), TooFewPositions> {
        let found = self.distinct_positions().len();
        if found >= needed { Ok(()) } else { Err(TooFewPositions { found, needed }) }
    }

    /// Splits the rows into `count` folds by position. Fold k holds out every distinct position with index i such that i mod `count` = k, with all
    /// rows of the position. The positions are sorted by x and then y. No fold holds out rows without contact.
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
                let is_held_out = row.touches() && index % count == k;
                if is_held_out { fold.held_out.push(i) } else { fold.training.push(i) }
            }
        }
        Ok(folds)
    }

    /// The rows with a contact, with the same provenance; borrowed if all rows have one.
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

    /// Mean reading of the untouched rows; `None` without such rows.
    pub fn untouched_mean(&self) -> Option<Vec<f64>> {
        let untouched: Vec<usize> = (0..self.rows.len()).filter(|row| !self.rows[*row].touches()).collect();
        (!untouched.is_empty()).then(|| self.mean_reading(&untouched))
    }

    /// Mean reading of some rows, by their indices.
    pub fn mean_reading(&self, rows: &[usize]) -> Vec<f64> {
        let channel = |c: usize| mean(rows.iter().map(|row| self.rows[*row].reading[c]));
        (0..self.channels.len()).map(channel).collect()
    }

    /// Rests: runs of consecutive untouched rows, by their indices.
    pub fn rests(&self) -> Vec<Vec<usize>> {
        let indices: Vec<usize> = (0..self.rows.len()).collect();
        let touches = |row: &usize| self.rows[*row].touches();
        let runs = indices.chunk_by(|a, b| touches(a) == touches(b));
        runs.filter(|run| !touches(&run[0])).map(<[usize]>::to_vec).collect()
    }

    /// One row of each touched position, drawn at random, because presses of a position may be in the order of their depths; `None` if those are
    /// all rows.
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

    /// The recording of the rows with the indices `rows`; indices beyond the last row are ignored.
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
