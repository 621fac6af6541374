//! Errors in Python: `palpate.PalpateError`, a `ValueError` with the message and, for a text,
//! carets.

use std::error::Error;
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;

use palpate::estimators::estimator::LocatorFileError;
use palpate::estimators::recording::CsvError;
use palpate::rig::RigError;
use pyo3::exceptions::PyOSError;
use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(palpate._errors, PalpateError);
import_exception!(palpate._errors, FileError);

pub fn refused(error: impl Display) -> PyErr {
    PalpateError::new_err(error.to_string())
}

pub fn io_error(error: &std::io::Error, path: &Path) -> PyErr {
    match error.raw_os_error() {
        // `OSError` selects the subclass by the number: FileNotFoundError, PermissionError.
        Some(number) => {
            let text = error.to_string();
            let words = text.split(" (os error").next().unwrap_or_default().to_owned();
            PyOSError::new_err((number, words, path.display().to_string()))
        }
        None => PyOSError::new_err(format!("{}: {error}", path.display())),
    }
}

/// `text` is the input of the rig, study or sections.
pub fn of_rig(error: &RigError, source: &str, text: &str) -> PyErr {
    let mut message = error.to_string();
    if let Some(help) = error.help() {
        message += &format!("; {help}");
    }
    let Some(span) = error.span.clone() else {
        return FileError::new_err((format!("{source}: {message}"), source.to_owned()));
    };
    let before = &text[..span.start.min(text.len())];
    let start = before.rfind('\n').map_or(0, |at| at + 1);
    let line = before.matches('\n').count() + 1;
    let line_text = text[start..].lines().next().unwrap_or_default();
    at_place(&message, source, line, line_text, span.start - start..span.end - start)
}

pub fn of_csv(error: &CsvError) -> PyErr {
    let source = &error.source_name;
    match &error.place {
        Some(place) => at_place(&error.problem, source, place.line, &place.text, place.span.clone()),
        None => FileError::new_err((error.to_string(), source.clone())),
    }
}

pub fn of_locator(error: &LocatorFileError, source: &str, text: &str) -> PyErr {
    let Some((line, column)) = error.place() else {
        return FileError::new_err((format!("{source}: {error}"), source.to_owned()));
    };
    let line_text = text.lines().nth(line - 1).unwrap_or_default();
    at_place(error, source, line, line_text, column - 1..column)
}

const SHOWN: usize = 120;

/// The line is below the message, with carets under the span.
fn at_place(message: impl Display, source: &str, line: usize, line_text: &str, span: Range<usize>) -> PyErr {
    let floor = |at: usize| {
        let at = at.min(line_text.len());
        (0..=at).rev().find(|at| line_text.is_char_boundary(*at)).unwrap_or(0)
    };
    let before = line_text[..floor(span.start)].chars().count();
    let meant = line_text[floor(span.start)..floor(span.end)].chars().count().max(1);
    let column = before + 1;
    let first = before.saturating_sub(SHOWN / 2);
    let shown: String =
        line_text.chars().skip(first).take(SHOWN).map(|c| if c == '\t' { ' ' } else { c }).collect();
    let carets = "^".repeat(meant.min(SHOWN.saturating_sub(before - first).max(1)));
    let margin = " ".repeat(line.to_string().len());
    let text = format!(
        "{source}:{line}:{column}: {message}\n {line} | {shown}\n {margin} | {}{carets}",
        " ".repeat(before - first)
    );
    FileError::new_err((text, source.to_owned(), line, column))
}

/// Adds the cause if the message does not contain it.
pub fn of_work(error: &(dyn Error + 'static)) -> PyErr {
    refused(error)
}
