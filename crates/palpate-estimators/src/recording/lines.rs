//! Lines of CSV as they come, numbered, without those that hold no row.

use super::cells::Cells;
use super::csv_error::{CsvError, CsvProblem, Place};

/// The lines of one source.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    source: String,
    /// How many have been read.
    count: usize,
}

impl Lines {
    pub fn new(source: &str) -> Self {
        Self { source: source.to_owned(), count: 0 }
    }

    /// The cells of the next line; `None` for a blank line or a comment (`#`).
    pub fn cells<'a>(&'a mut self, line: &'a [u8]) -> Result<Option<Cells<'a>>, CsvError> {
        self.count += 1;
        let text = utf8(&self.source, self.count, line)?;
        let text = if self.count == 1 { without_mark(text) } else { text };
        if is_passed_over(text) {
            return Ok(None);
        }
        Cells::parse(&self.source, self.count, text).map(Some)
    }
}

/// Whether a line holds nothing, not even a comma, or is a comment.
pub(super) fn is_passed_over(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with('#')
}

/// `text` without the byte-order mark that some spreadsheets put first.
pub(super) fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// `bytes` as text, without the line's end.
fn utf8<'a>(source: &str, line: usize, bytes: &'a [u8]) -> Result<&'a str, CsvError> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.trim_end_matches(['\r', '\n'])),
        Err(_) => {
            let text = String::from_utf8_lossy(bytes).trim_end_matches(['\r', '\n']).to_owned();
            let span = 0..text.len();
            Err(CsvProblem::NotUtf8.at(source, Place { line, column: None, text, span }))
        }
    }
}
