//! What a reading comes from: surface, sensors, contact, and how its recordings are laid out.

use std::io::Read;

use serde::{Deserialize, Serialize};

use palpate_mechanics::limit::{Limit, LimitError};
use palpate_mechanics::surface::SurfaceSpec;
use crate::recording::{self, Columns, CsvError, Recording, Schema};
use palpate_mechanics::sensing::Layout;

/// A surface with its sensors, all checked. A rig describes it, and a locator keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bench {
    /// The surface that is touched.
    pub surface: SurfaceSpec,
    /// Its sensors, one a channel of a reading.
    pub layout: Layout,
    /// The contact force in newtons, greater than 0, where it is known.
    pub force_n: Option<f64>,
    /// Which column of a recording is what; `None` for the columns that palpate itself writes.
    pub columns: Option<Columns>,
}

impl Bench {
    /// The Cramér–Rao bound of this bench.
    ///
    /// # Errors
    /// [`LimitError`] for a measured surface, for a live sensor without noise, and when none is alive.
    pub fn cramer_rao_bound(&self) -> Result<Limit<'_>, LimitError> {
        Limit::new(self.surface.model().ok_or(LimitError::NoModel)?, &self.layout)
    }

    /// Which column of a recording is what: those that were named, or those that palpate itself writes.
    pub fn recording_columns(&self) -> Columns {
        match &self.columns {
            Some(columns) => columns.clone(),
            None => Columns::own(&self.layout.names(), &self.layout.kinds(), self.surface.extent()),
        }
    }

    /// Reads a recording of this bench; see [`recording::read`]. Where the file has no force, the bench's holds.
    ///
    /// # Errors
    /// [`CsvError`], with line and column.
    pub fn read_recording(&self, source: &str, bytes: impl Read) -> Result<Recording, CsvError> {
        recording::read(source, bytes, &self.schema(&self.recording_columns()))
    }

    /// Reads a recording of this bench from two files; see [`recording::read_pair`].
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

    /// What a file must agree with to be a recording of this bench, by columns such as [`Bench::recording_columns`].
    pub fn schema<'a>(&'a self, columns: &'a Columns) -> Schema<'a> {
        let extent = self.surface.extent();
        Schema { columns, layout: &self.layout, extent, known_force_n: self.force_n }
    }
}
