//! The files of a recording, named on the command line.

use crate::failure::Failure;
use crate::input::{csv_complaint, read_bytes};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use std::path::{Path, PathBuf};

/// A recording: one file, or readings and contacts apart.
#[derive(clap::Args)]
pub struct RecordingFiles {
    /// A recording [default: simulations, where the rig has a model]
    #[arg(long, value_name = "FILE.csv")]
    pub data: Option<PathBuf>,
    /// The recording's contacts, where --data has the readings alone; row by row
    #[arg(long, value_name = "FILE.csv", requires = "data")]
    pub contacts: Option<PathBuf>,
}

impl RecordingFiles {
    /// The recording of this bench, with its warnings said on stderr; `None` where no file is named.
    pub fn read(&self, setup: &Setup) -> Result<Option<Recording>, Failure> {
        let Some(data) = &self.data else { return Ok(None) };
        let Some(contacts) = &self.contacts else { return read_recording(setup, data).map(Some) };
        let (readings, pressed) = (read_bytes(data)?, read_bytes(contacts)?);
        let names = [data, contacts].map(|path| path.display().to_string());
        let recording =
            setup.read_recording_pair((&names[0], readings.as_slice()), (&names[1], pressed.as_slice()));
        let recording = recording.map_err(|error| csv_complaint(&error))?;
        warn(&recording, &names[0]);
        Ok(Some(recording))
    }
}

/// A recording of a bench in one file, with its warnings said on stderr.
pub fn read_recording(setup: &Setup, path: &Path) -> Result<Recording, Failure> {
    let bytes = read_bytes(path)?;
    let name = path.display().to_string();
    let recording = setup.read_recording(&name, bytes.as_slice()).map_err(|error| csv_complaint(&error))?;
    warn(&recording, &name);
    Ok(recording)
}

fn warn(recording: &Recording, name: &str) {
    for warning in recording.warnings() {
        eprintln!("warning: {name}: {warning}");
    }
}
