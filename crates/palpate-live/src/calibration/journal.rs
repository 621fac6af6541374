use super::trace::Trace;
use palpate_estimators::recording::{self, Column, Columns, Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_files as whole_file;
use palpate_mechanics::units::{Dimension, Unit};
use palpate_rig::Stage;
use std::path::{Path, PathBuf};

/// Rows and their file.
#[derive(Debug)]
pub struct Journal {
    setup: Setup,
    columns: Columns,
    comment: String,
    path: PathBuf,
    rows: Vec<Row>,
    traces: Vec<Option<Trace>>,
    /// Offset of the times of new rows.
    later_s: f64,
}

/// Error of a press that cannot be recorded.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// A column of the recordings has unknown values.
    #[error("presses are recorded without the nuisance coordinate {column}")]
    Nuisance {
        /// Column.
        column: Column,
    },
    /// The columns of the recordings have no names.
    #[error("presses are recorded in columns with names")]
    Numbered,
    /// The file cannot be written.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// File.
        path: PathBuf,
        /// Cause.
        error: std::io::Error,
    },
}

impl JournalError {
    /// Remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Nuisance { .. } => "remove `nuisance` from [recording], or record with another program",
            Self::Numbered => "name the channels of [recording] instead of counting them",
            Self::Write { .. } => "make room, or name another file",
        }
    }
}

/// Column of depths if the rig has none.
const DEPTH: &str = "depth_mm";
/// Assumed time between runs; untouched rows show the drift.
const BETWEEN_RUNS_S: f64 = 60.0;

impl Journal {
    /// Journal with earlier rows; the next press writes the file.
    ///
    /// # Errors
    /// [`JournalError`] of [`Self::columns`].
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

    /// Sets the known traces.
    #[must_use]
    pub fn with_traces(self, mut traces: Vec<Option<Trace>>) -> Self {
        traces.resize(self.rows.len(), None);
        Self { traces, ..self }
    }

    /// Columns of the rig.
    ///
    /// For a machine, a length among the nuisance coordinates is the depth; otherwise several depths need the
    /// column `depth_mm`.
    ///
    /// # Errors
    /// [`JournalError`] for unknown values or missing names.
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

    /// Rows, including untouched ones.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Known trace of each row.
    pub fn traces(&self) -> &[Option<Trace>] {
        &self.traces
    }

    pub(super) fn set_trace(&mut self, trace: Trace) {
        if let Some(last) = self.traces.last_mut() {
            *last = Some(trace);
        }
    }

    /// Recorded presses.
    pub fn presses(&self) -> usize {
        self.rows.iter().filter(|row| row.touches()).count()
    }

    /// File.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a row to disk; `depth_m` is that of a machine.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn add(&mut self, row: Row, depth_m: Option<f64>) -> Result<(), JournalError> {
        let time_s = row.time_s.map(|time_s| time_s + self.later_s);
        let nuisances = match self.columns.nuisance {
            Some(_) => vec![depth_m.unwrap_or(0.0)],
            None => Vec::new(),
        };
        // Removed rows have no trace.
        self.traces.resize(self.rows.len(), None);
        self.rows.push(Row { time_s, nuisances, ..row });
        self.traces.push(None);
        self.save()
    }

    /// Removes the last press and the untouched rows after it.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn remove_last_press(&mut self) -> Result<(), JournalError> {
        if let Some(last) = self.rows.iter().rposition(Row::touches) {
            self.rows.truncate(last);
            self.traces.truncate(last);
            self.save()?;
        }
        Ok(())
    }

    /// Replaces the last press on disk.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn replace_last(&mut self, row: Row, depth_m: Option<f64>) -> Result<(), JournalError> {
        if let Some(last) = self.rows.iter().rposition(Row::touches) {
            self.rows.truncate(last);
        }
        self.add(row, depth_m)
    }

    /// Deletes a press, counted from 0, but no untouched rows; false if missing.
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
        // Only presses with a force can be distinguished from untouched rows.
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
    /// Knowledge for a machine, or for a hand.
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
