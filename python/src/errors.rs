//! Errors as Python's: `palpate.PalpateError`, a `ValueError` with palpate's own words, and carets where a file or a text is at fault.

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

/// A value that is refused.
pub fn refused(error: impl Display) -> PyErr {
    PalpateError::new_err(error.to_string())
}

/// The error of a file that the system does not let be read or written.
pub fn io_error(error: &std::io::Error, path: &Path) -> PyErr {
    match error.raw_os_error() {
        // `OSError` makes of the number what it is: FileNotFoundError, PermissionError.
        Some(number) => {
            let text = error.to_string();
            let words = text.split(" (os error").next().unwrap_or_default().to_owned();
            PyOSError::new_err((number, words, path.display().to_string()))
        }
        None => PyOSError::new_err(format!("{}: {error}", path.display())),
    }
}

/// A rig or study, or sections of one, that cannot be used; `text` is what was read.
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

/// A recording that cannot be read.
pub fn of_csv(error: &CsvError) -> PyErr {
    let source = &error.source_name;
    match &error.place {
        Some(place) => at_place(&error.problem, source, place.line, &place.text, place.span.clone()),
        None => FileError::new_err((error.to_string(), source.clone())),
    }
}

/// A locator's file that cannot be read; `text` is what was read.
pub fn of_locator(error: &LocatorFileError, source: &str, text: &str) -> PyErr {
    let Some((line, column)) = error.place() else {
        return FileError::new_err((format!("{source}: {error}"), source.to_owned()));
    };
    let line_text = text.lines().nth(line - 1).unwrap_or_default();
    at_place(error, source, line, line_text, column - 1..column)
}

/// The longest part of a line that is shown, in characters; a locator's file may have much longer ones.
const SHOWN: usize = 120;

/// An error at a place: the line below the message, with carets under the bytes that are meant.
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

/// An error of long work: that of its own, with what caused it where its words do not say that.
pub fn of_work(error: &(dyn Error + 'static)) -> PyErr {
    refused(error)
}
