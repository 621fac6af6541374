//! Readings paired with their contacts: what calibration makes and evaluation needs.

mod cells;
mod columns;
mod csv_error;
mod csv_in;
mod csv_out;
mod fields;
mod folds;
mod lines;
mod reading_parser;
mod timed;
mod warnings;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

pub use columns::{Column, Columns, ForceColumn, Frame, Header, Need, PositionColumns, ValueColumn};
pub use csv_error::{CsvError, CsvProblem, Place};
pub use csv_in::{Schema, read, read_pair};
pub use csv_out::{csv_row, write};
pub use folds::{Fold, TooFewPositions};
pub use reading_parser::ReadingParser;
pub use timed::{TimedParser, TimedReading, TimedRecording, write_timed};
pub use warnings::Warning;

use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::SensorKind;

/// Readings with the contacts that caused them.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The name of each channel, in the order of the readings' values.
    pub channels: Vec<String>,
    /// What each channel measures.
    pub kinds: Vec<SensorKind>,
    /// The rows, in the order in which they were recorded.
    pub rows: Vec<Row>,
    /// Where they come from.
    pub provenance: Provenance,
}

/// One reading and its contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Where the contact was.
    pub position: Position,
    /// Its force in newtons, positive downward; `None` where nobody measured it.
    pub force_n: Option<f64>,
    /// Something else about the contact that shapes the reading, is known here, and is unknown when a reading is to be
    /// located: the depth of indentation, say. In the SI unit of its column; `None` where the recording has no such column.
    pub nuisance: Option<f64>,
    /// One finite value per channel, in the SI unit of its kind (or raw).
    pub reading: Vec<f64>,
}

impl Row {
    /// The contact, where its force is known.
    pub fn contact(&self) -> Option<Contact> {
        self.force_n.map(|force_n| Contact { position: self.position, force_n })
    }
}

/// The SHA-256 of a file's content in hexadecimal, by which provenance names it.
pub fn sha256_hex(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Where a recording comes from, so that whatever is fitted to it can say so.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// The name that the caller gave: usually a file's, or "simulation".
    pub source: String,
    /// How many rows there are.
    pub rows: usize,
    /// The [`sha256_hex`] of each file that was read; empty for a simulation.
    pub digests: Vec<String>,
    /// The seed of a simulation.
    pub seed: Option<u64>,
}

#[cfg(test)]
mod tests;
