//! Input files and quantities of a command, with complaints that show the place.

use crate::chunks::Chunks;
use crate::failure::{Failure, UserError};
use crate::remark::remark;
use palpate_estimators::estimator::{Locator, LocatorFileError};
use palpate_estimators::recording::{self, Columns, CsvError, Recording};
use palpate_estimators::recording_check::check_recording;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::{Dimension, Quantity};
use palpate_rig::{Rig, RigError};
use palpate_studies::Study;
use std::path::{Path, PathBuf};

pub fn read_text(path: &Path) -> Result<String, Failure> {
    let bytes = read_bytes(path)?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        UserError::new(format!("{} is not UTF-8 text: byte {} is invalid", path.display(), at + 1)).into()
    })
}

pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    Chunks::of_file(path)?.read_to_end()
}

pub fn read_rig(path: &Path) -> Result<Rig, Failure> {
    parse_rig(path, &read_text(path)?)
}

pub fn parse_rig(path: &Path, text: &str) -> Result<Rig, Failure> {
    Rig::from_toml(text).map_err(|error| rig_error(error, path, text))
}

pub fn parse_study(name: &str, text: &str) -> Result<Study, Failure> {
    Study::from_toml(text).map_err(|error| rig_error(error, Path::new(name), text))
}

pub fn read_locator(path: &Path) -> Result<Locator, Failure> {
    parse_locator(path, &read_text(path)?)
}

pub fn parse_locator(path: &Path, text: &str) -> Result<Locator, Failure> {
    Locator::from_json(text).map_err(|error| locator_error(&error, path, text).into())
}

/// Returns true for a file name that ends in `.toml`: a rig or a study.
pub fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

pub enum RigOrLocator {
    Rig(Box<Rig>),
    Locator(Box<Locator>),
}

impl RigOrLocator {
    pub fn read(path: &Path) -> Result<Self, Failure> {
        Ok(if is_toml(path) {
            Self::Rig(Box::new(read_rig(path)?))
        } else {
            Self::Locator(Box::new(read_locator(path)?))
        })
    }

    pub fn setup(&self) -> &Setup {
        match self {
            Self::Rig(rig) => &rig.setup,
            Self::Locator(locator) => &locator.setup,
        }
    }
}

/// A recording: one file, or readings and contacts apart.
#[derive(clap::Args)]
pub struct RecordingFiles {
    /// Recording of readings with their contacts [default: a simulation, if the rig has a model]
    #[arg(long, value_name = "FILE.csv")]
    pub data: Option<PathBuf>,
    /// Contacts of the recording, row by row, if --data contains readings only
    #[arg(long, value_name = "FILE.csv", requires = "data")]
    pub contacts: Option<PathBuf>,
}

impl RecordingFiles {
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        [&self.data, &self.contacts].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Reads the recording of this bench; `None` without a file.
    pub fn read(&self, setup: &Setup) -> Result<Option<Recording>, Failure> {
        let Some(data) = &self.data else { return Ok(None) };
        let Some(contacts) = &self.contacts else { return read_recording(setup, data).map(Some) };
        let (readings, pressed) = (read_bytes(data)?, read_bytes(contacts)?);
        let names = [data, contacts].map(|path| path.display().to_string());
        let recording =
            setup.read_recording_pair((&names[0], readings.as_slice()), (&names[1], pressed.as_slice()));
        with_warnings(setup, recording, &names[0]).map(Some)
    }
}

pub fn read_recording(setup: &Setup, path: &Path) -> Result<Recording, Failure> {
    read_recording_as(setup, path, &setup.recording_columns())
}

pub fn read_recording_as(setup: &Setup, path: &Path, columns: &Columns) -> Result<Recording, Failure> {
    let (bytes, name) = (read_bytes(path)?, path.display().to_string());
    with_warnings(setup, recording::read(&name, bytes.as_slice(), &setup.schema(columns)), &name)
}

/// Reports dialect, warnings and mismatches with the setup.
fn with_warnings(
    setup: &Setup,
    recording: Result<Recording, CsvError>,
    name: &str,
) -> Result<Recording, Failure> {
    let recording = recording.map_err(|error| csv_error(&error))?;
    print_dialects(&recording);
    recording.warning_lines().iter().for_each(|warning| remark!("warning: {name}: {warning}"));
    let mismatches = check_recording(setup, &recording);
    mismatches.iter().for_each(|mismatch| remark!("warning: {name}: {mismatch}"));
    Ok(recording)
}

/// Reports a table format that differs from the standard one.
pub fn print_dialects(recording: &Recording) {
    recording.provenance.dialects.iter().for_each(|dialect| remark!("{}: {dialect}", dialect.source));
}

pub fn length(text: &str) -> Result<f64, String> {
    greater_than_0(text, Quantity::parse_as(text, Dimension::Length), |length_m| *length_m)
}

pub fn force(text: &str) -> Result<f64, String> {
    greater_than_0(text, Quantity::parse_as(text, Dimension::Force), |force_n| *force_n)
}

/// Parses hertz. The range gives a period that floating-point times resolve, and finite multiples
/// of it.
pub fn frequency(text: &str) -> Result<f64, String> {
    let frequency_hz =
        greater_than_0(text, Quantity::parse_as(text, Dimension::Frequency), |frequency_hz| *frequency_hz)?;
    if (1e-6..=1e9).contains(&frequency_hz) {
        Ok(frequency_hz)
    } else {
        Err(format!("`{text}` must be at least 0.000001 Hz and at most 1000000000 Hz"))
    }
}

pub fn quantity(text: &str) -> Result<Quantity, String> {
    greater_than_0(text, text.parse::<Quantity>(), |quantity| quantity.value)
}

fn greater_than_0<T>(
    text: &str,
    parsed: Result<T, impl std::fmt::Display>,
    value: fn(&T) -> f64,
) -> Result<T, String> {
    match parsed {
        Ok(parsed) if value(&parsed) > 0.0 => Ok(parsed),
        Ok(_) => Err(format!("`{text}` must be greater than 0")),
        Err(error) => Err(error.to_string()),
    }
}

fn rig_error(error: RigError, path: &Path, text: &str) -> Failure {
    let user_error = UserError::new(&error);
    let user_error = match error.help() {
        Some(help) => user_error.help(help),
        None => user_error,
    };
    // An error about a missing item is shown at the first line.
    user_error.at_span(&path.display().to_string(), text, error.span.unwrap_or(0..0)).into()
}

fn locator_error(error: &LocatorFileError, path: &Path, text: &str) -> UserError {
    let user_error = UserError::for_path(path, error);
    let Some((line, column)) = error.place() else { return user_error };
    let line_text = text.lines().nth(line - 1).unwrap_or_default();
    let start = (column - 1).min(line_text.len());
    user_error.at_line(&path.display().to_string(), line, line_text, start..line_text.len().min(start + 1))
}

pub fn csv_error(error: &CsvError) -> UserError {
    match &error.place {
        // The heading above the excerpt states the place.
        Some(place) => UserError::new(&error.problem).at_line(
            &error.source_name,
            place.line,
            &place.text,
            place.span.clone(),
        ),
        None => UserError::new(error),
    }
}

#[cfg(feature = "live")]
pub fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err(format!("`{text}` must be a number from 0 to 1")),
    }
}

#[cfg(feature = "live")]
pub fn clock_speed() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=100)
}

pub fn time(text: &str) -> Result<f64, String> {
    match Quantity::parse_as(text, Dimension::Time) {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e9 => Ok(seconds),
        Ok(_) => Err(format!("`{text}` must be greater than 0, and at most 1e9 s")),
        Err(error) => Err(error.to_string()),
    }
}
