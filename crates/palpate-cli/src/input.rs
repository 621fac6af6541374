//! Reading palpate's files, with complaints that point at the place.

use crate::failure::{Complaint, Failure};
use palpate_estimators::estimator::{Locator, LocatorFileError};
use palpate_estimators::recording::CsvError;
use palpate_mechanics::units::{Dimension, Quantity};
use palpate_rig::{Rig, RigError};
use palpate_studies::Study;
use std::path::Path;

/// The text of a file.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    let bytes = read_bytes(path)?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Complaint::new(format!("{} is not UTF-8 text: byte {} is no character", path.display(), at + 1))
            .into()
    })
}

/// The bytes of a file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| {
        let complaint = Complaint::new(format!("cannot read {}: {error}", path.display()));
        match error.kind() {
            std::io::ErrorKind::NotFound => {
                complaint.help("check the name; it is taken from the current folder").into()
            }
            _ => complaint.into(),
        }
    })
}

/// A rig, from its file.
pub fn read_rig(path: &Path) -> Result<Rig, Failure> {
    parse_rig(path, &read_text(path)?)
}

/// A rig, from its file's text.
pub fn parse_rig(path: &Path, text: &str) -> Result<Rig, Failure> {
    Rig::from_toml(text).map_err(|error| rig_complaint(error, path, text))
}

/// A study, from its file's text.
pub fn parse_study(name: &str, text: &str) -> Result<Study, Failure> {
    Study::from_toml(text).map_err(|error| rig_complaint(error, Path::new(name), text))
}

/// A locator, from its file.
pub fn read_locator(path: &Path) -> Result<Locator, Failure> {
    parse_locator(path, &read_text(path)?)
}

/// A locator, from its file's text.
pub fn parse_locator(path: &Path, text: &str) -> Result<Locator, Failure> {
    Locator::from_json(text).map_err(|error| locator_complaint(&error, path, text).into())
}

/// A length in metres, from a command line argument.
pub fn length(text: &str) -> Result<f64, String> {
    match Quantity::parse_as(text, Dimension::Length) {
        Ok(length_m) if length_m > 0.0 => Ok(length_m),
        Ok(_) => Err(format!("`{text}` must be greater than 0")),
        Err(error) => Err(error.to_string()),
    }
}

/// A force in newtons, from a command line argument.
pub fn force(text: &str) -> Result<f64, String> {
    match Quantity::parse_as(text, Dimension::Force) {
        Ok(force_n) if force_n > 0.0 => Ok(force_n),
        Ok(_) => Err(format!("`{text}` must be greater than 0")),
        Err(error) => Err(error.to_string()),
    }
}

/// A frequency in hertz, from a command line argument.
pub fn frequency(text: &str) -> Result<f64, String> {
    match Quantity::parse_as(text, Dimension::Frequency) {
        Ok(frequency_hz) if frequency_hz > 0.0 => Ok(frequency_hz),
        Ok(_) => Err(format!("`{text}` must be greater than 0")),
        Err(error) => Err(error.to_string()),
    }
}

/// A quantity greater than 0 in whatever unit, from a command line argument.
pub fn quantity(text: &str) -> Result<Quantity, String> {
    match text.parse::<Quantity>() {
        Ok(quantity) if quantity.value > 0.0 => Ok(quantity),
        Ok(_) => Err(format!("`{text}` must be greater than 0")),
        Err(error) => Err(error.to_string()),
    }
}

fn rig_complaint(error: RigError, path: &Path, text: &str) -> Failure {
    let complaint = Complaint::new(&error);
    let complaint = match error.help() {
        Some(help) => complaint.help(help),
        None => complaint,
    };
    complaint_at(complaint, &path.display().to_string(), text, error.span).into()
}

fn complaint_at(
    complaint: Complaint,
    name: &str,
    text: &str,
    span: Option<std::ops::Range<usize>>,
) -> Complaint {
    // What is not there at all is said of the first line.
    complaint.at_span(name, text, span.unwrap_or(0..0))
}

fn locator_complaint(error: &LocatorFileError, path: &Path, text: &str) -> Complaint {
    let complaint = Complaint::new(format!("{}: {error}", path.display()));
    let Some((line, column)) = error.place() else { return complaint };
    let line_text = text.lines().nth(line - 1).unwrap_or_default();
    let start = (column - 1).min(line_text.len());
    complaint.at_line(&path.display().to_string(), line, line_text, start..line_text.len().min(start + 1))
}

/// The complaint about a recording.
pub fn csv_complaint(error: &CsvError) -> Failure {
    match &error.place {
        // The caret's heading says the place.
        Some(place) => Complaint::new(&error.problem)
            .at_line(&error.source_name, place.line, &place.text, place.span.clone())
            .into(),
        None => Complaint::new(error).into(),
    }
}
