//! The rig file: one TOML document that says what is on the bench.

mod error;
mod sections;
mod validate;
mod value;

use std::io::Read;

pub use error::{RigError, RigProblem};
pub(crate) use sections::{
    ContactSection, EstimatorSection, RigSections, SensorsSections, SurfaceSection, TrainingSection,
};
pub(crate) use validate::validate;
pub(crate) use value::{RawQuantity, positive};

use crate::arrangement::{Arrangement, ArrangementError};
use crate::contact::Position;
use crate::estimator::EstimatorConfig;
use crate::mechanics::SurfaceSpec;
use crate::recording::{self, Columns, CsvError, Recording, Schema};
use crate::sensing::Layout;

/// What is on the bench: surface, sensors, contact, training positions and estimator, all checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// The surface that is touched.
    pub surface: SurfaceSpec,
    /// Its sensors.
    pub layout: Layout,
    /// The contact force in newtons, greater than 0, where it is known.
    pub force_n: Option<f64>,
    /// Where to press to calibrate.
    pub training: Option<Training>,
    /// The method that locates.
    pub estimator: EstimatorConfig,
    /// Which column of a recording is what; `None` for the columns that palpate itself writes.
    pub columns: Option<Columns>,
}

/// The training positions of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// The rule that places them.
    pub arrangement: Arrangement,
    /// How many there are; at least 1.
    pub count: usize,
    /// How often each is pressed; at least 1.
    pub repeats: usize,
}

impl Training {
    /// The positions on a surface of length `length_m` (metres), each once.
    ///
    /// # Errors
    /// [`ArrangementError`]; never for the length of the rig that this belongs to.
    pub fn positions(&self, length_m: f64) -> Result<Vec<Position>, ArrangementError> {
        self.arrangement.positions(self.count, length_m)
    }
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RigError`], with the place in `text`, the value and its bound.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        validate(&toml::from_str(text).map_err(RigError::from_toml)?)
    }

    /// Which column of a recording is what: those that the rig names, or those that palpate itself writes.
    pub fn recording_columns(&self) -> Columns {
        match &self.columns {
            Some(columns) => columns.clone(),
            None => Columns::own(&self.layout.names(), &self.layout.kinds(), self.surface.extent()),
        }
    }

    /// Reads a recording of this rig's bench; see [`recording::read`]. Where the file has no force, the rig's holds.
    ///
    /// # Errors
    /// [`CsvError`], with line and column.
    pub fn read_recording(&self, source: &str, bytes: impl Read) -> Result<Recording, CsvError> {
        recording::read(source, bytes, &self.schema(&self.recording_columns()))
    }

    /// Reads a recording of this rig's bench from two files; see [`recording::read_pair`].
    ///
    /// # Errors
    /// [`CsvError`], with line and column.
    pub fn read_recording_pair(
        &self,
        readings: (&str, impl Read),
        contacts: (&str, impl Read),
    ) -> Result<Recording, CsvError> {
        recording::read_pair(readings, contacts, &self.schema(&self.recording_columns()))
    }

    fn schema<'a>(&'a self, columns: &'a Columns) -> Schema<'a> {
        let extent = self.surface.extent();
        Schema { columns, layout: &self.layout, extent, known_force_n: self.force_n }
    }
}

#[cfg(test)]
mod tests;
