//! The file of the presses of a calibration.

use super::trace::Trace;
use palpate_estimators::recording::{self, Column, Columns, Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_files as whole_file;
use palpate_mechanics::units::{Dimension, Unit};
use palpate_rig::Stage;
use std::path::{Path, PathBuf};

/// Presses so far, and their file.
#[derive(Debug)]
pub struct Journal {
    setup: Setup,
    columns: Columns,
    comment: String,
    path: PathBuf,
    rows: Vec<Row>,
    /// Trace of each row; only presses of this run have one.
    traces: Vec<Option<Trace>>,
    /// Seconds that are added to the times of new rows, so that they follow those of the file.
    later_s: f64,
}

/// Error of presses that cannot be recorded.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The rig's recordings have a column with unknown values.
    #[error("presses are recorded without the nuisance coordinate {column}")]
    Nuisance {
        /// The column.
        column: Column,
    },
    /// The rig's recordings have columns without names.
    #[error("presses are recorded in columns with names")]
    Numbered,
    /// The file cannot be written.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
}

impl JournalError {
    /// The remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Nuisance { .. } => {
                "leave `nuisance` out of [recording], or record with a program of your own"
            }
            Self::Numbered => "name the channels of [recording] instead of counting them",
            Self::Write { .. } => "make room, or name another file",
        }
    }
}

/// Name of the column of depths, if the rig has none.
const DEPTH: &str = "depth_mm";
/// Seconds between the presses of a file and those that continue it. The time between two runs is unknown; the drift between them follows from the
/// untouched rows of both.
const BETWEEN_RUNS_S: f64 = 60.0;

impl Journal {
    /// A journal that continues these earlier rows; the file is written with the next press.
    ///
    /// # Errors
    /// [`JournalError`] if the columns of the rig's recordings cannot be determined.
    pub fn new(
        setup: &Setup,
        path: &Path,
        comment: String,
        before: Vec<Row>,
        depths: DepthKnowledge,
    ) -> Result<Self, JournalError> {
        let columns = Self::columns(setup, depths)?;
        let last_s = before.iter().filter_map(|row| row.time_s).fold(0.0, f64::max);
        let later_s = if before.is_empty() { 0.0 } else { last_s + BETWEEN_RUNS_S };
        let (path, traces) = (path.to_owned(), vec![None; before.len()]);
        Ok(Self { setup: setup.clone(), columns, comment, path, rows: before, traces, later_s })
    }

    /// Sets the traces of the rows, where they are known.
    #[must_use]
    pub fn with_traces(self, mut traces: Vec<Option<Trace>>) -> Self {
        traces.resize(self.rows.len(), None);
        Self { traces, ..self }
    }

    /// The columns of a file of presses. They are those that the rig reads. If a machine presses to several depths, there is one more, `depth_mm`,
    /// which distinguishes the rows when a calibration is continued. If a machine presses, a nuisance coordinate of the rig that is a length is the
    /// depth.
    ///
    /// # Errors
    /// [`JournalError`] for columns with unknown values, or without names.
    pub fn columns(setup: &Setup, depths: DepthKnowledge) -> Result<Columns, JournalError> {
        let columns = setup.recording_columns();
        let is_depth = |nuisance: &recording::ValueColumn| nuisance.unit.dimension() == Dimension::Length;
        let mut nuisances = columns.nuisances();
        let has_depth = match (nuisances.next(), nuisances.next(), depths) {
            (None, ..) => false,
            (Some(nuisance), None, DepthKnowledge::One | DepthKnowledge::Several) if is_depth(nuisance) => {
                true
            }
            (Some(nuisance), ..) => {
                return Err(JournalError::Nuisance { column: nuisance.column.clone() });
            }
        };
        drop(nuisances);
        if columns.channels.iter().any(|channel| matches!(channel.column, Column::Number(_))) {
            return Err(JournalError::Numbered);
        }
        Ok(match (depths, Unit::from_symbol("mm")) {
            (DepthKnowledge::Several, Some(mm)) if !has_depth => columns.nuisance(DEPTH, mm),
            _ => columns,
        })
    }

    /// The rows so far, both presses and the untouched surface.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Trace of each row, if it has one.
    pub fn traces(&self) -> &[Option<Trace>] {
        &self.traces
    }

    /// Stores the trace of the last row.
    pub(super) fn set_trace(&mut self, trace: Trace) {
        if let Some(last) = self.traces.last_mut() {
            *last = Some(trace);
        }
    }

    /// Number of recorded presses.
    pub fn presses(&self) -> usize {
        self.rows.iter().filter(|row| row.touches()).count()
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a row, which is on disk when this returns; `depth_m` is the depth of a machine's press.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn add(&mut self, row: Row, depth_m: Option<f64>) -> Result<(), JournalError> {
        let time_s = row.time_s.map(|time_s| time_s + self.later_s);
        let nuisances = match self.columns.nuisance {
            Some(_) => vec![depth_m.unwrap_or(0.0)],
            None => Vec::new(),
        };
        // Rows that were removed at the end have no trace any more.
        self.traces.resize(self.rows.len(), None);
        self.rows.push(Row { time_s, nuisances, ..row });
        self.traces.push(None);
        self.save()
    }

    /// Removes the last press, and the untouched rows after it.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn take_back(&mut self) -> Result<(), JournalError> {
        if let Some(last) = self.rows.iter().rposition(Row::touches) {
            self.rows.truncate(last);
            self.traces.truncate(last);
            self.save()?;
        }
        Ok(())
    }

    /// Replaces the last press by a row, which is on disk when this returns.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn replace_last(&mut self, row: Row, depth_m: Option<f64>) -> Result<(), JournalError> {
        if let Some(last) = self.rows.iter().rposition(Row::touches) {
            self.rows.truncate(last);
        }
        self.add(row, depth_m)
    }

    /// Strikes out a press, counted from 0; false if the press does not exist. The untouched rows are kept, because they show the drift.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn strike(&mut self, press: usize) -> Result<bool, JournalError> {
        let touched = self.rows.iter().enumerate().filter(|(_, row)| row.touches());
        let Some((row, _)) = touched.clone().nth(press) else { return Ok(false) };
        self.rows.remove(row);
        self.traces.remove(row);
        self.save()?;
        Ok(true)
    }

    fn save(&self) -> Result<(), JournalError> {
        let mut rows = self.rows.clone();
        // The force distinguishes an untouched row from a press, if presses have one.
        if self.columns.force.is_none() || rows.iter().any(|row| row.force_n.is_none()) {
            rows.retain(Row::touches);
        }
        let recording = Recording::new(self.setup.layout(), "calibration", rows);
        let mut csv = Vec::new();
        recording::write_as(&recording, &self.columns, &self.comment, &mut csv)
            .and_then(|()| whole_file::write(&self.path, &csv))
            .map_err(|error| JournalError::Write { path: self.path.clone(), error })
    }
}

/// Knowledge of the depth of presses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthKnowledge {
    /// A hand presses.
    Unknown,
    /// A machine presses to one depth.
    One,
    /// A machine presses to several depths.
    Several,
}

impl DepthKnowledge {
    /// Knowledge for presses by this machine, or by hand without one.
    pub fn for_stage(stage: Option<&Stage>) -> Self {
        match stage {
            None => Self::Unknown,
            Some(stage) if stage.depths_m.len() > 1 => Self::Several,
            Some(_) => Self::One,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mechanics::contact::Position;
    use palpate_rig::Rig;

    fn row(x_m: f64, force_n: f64) -> Row {
        let position = Position::along(x_m);
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading: vec![x_m, 0.5] }
    }

    #[test]
    fn a_press_that_is_struck_out_leaves_the_file_and_the_others_stay() {
        let rig = Rig::from_toml(include_str!("../../../../examples/fsi-like.toml")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("presses.csv");
        let before = vec![row(0.0, 0.0), row(0.01, 1.0), row(0.0, 0.0), row(0.02, 1.0)];
        let comment = "palpate 0.1.0, pressed for rig.toml; placement 2 mm".to_owned();
        let mut journal = Journal::new(&rig.setup, &path, comment, before, DepthKnowledge::Unknown).unwrap();
        journal.add(row(0.03, 1.0), None).unwrap();
        journal.set_trace(Trace { points: vec![(0.0, 100.0)] });
        assert!(journal.strike(1).unwrap() && !journal.strike(2).unwrap());
        assert_eq!(journal.presses(), 2);
        assert!(journal.traces().last().unwrap().is_some() && journal.traces().len() == journal.rows().len());
        let read = rig.setup.read_recording("presses.csv", std::fs::read(&path).unwrap().as_slice()).unwrap();
        let pressed: Vec<f64> = read.touched().rows.iter().map(|row| row.position.x_m).collect();
        assert_eq!(pressed, [0.01, 0.03]);
        assert_eq!(read.rows.len(), 4);
        assert_eq!(read.provenance.placement_sd_m, Some(2e-3));
    }
}
