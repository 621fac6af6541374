//! Readings as they stream in, line by line.

use super::cells::Cells;
use super::columns::{Columns, Header};
use super::csv_error::{CsvError, CsvProblem, Place};
use crate::units::Unit;

/// Turns lines of CSV into readings; only the channel columns need to be there.
#[derive(Clone, Debug)]
pub struct ReadingParser {
    source: String,
    columns: Columns,
    found: Option<Found>,
    line: usize,
}

/// What the first line told.
#[derive(Clone, Debug)]
struct Found {
    channels: ChannelFields,
    width: usize,
}

impl ReadingParser {
    /// A parser for the lines of `source`, from the first one; the position and force columns need not be there.
    pub fn new(source: &str, columns: &Columns) -> Self {
        Self { source: source.to_owned(), columns: columns.clone(), found: None, line: 0 }
    }

    /// Whether no line yet has told which columns there are: an error now means that no line can be read.
    pub fn awaits_columns(&self) -> bool {
        self.found.is_none()
    }

    /// Reads the next line: one value per channel, in SI units; `None` for the header, a blank line or a comment (`#`).
    ///
    /// After an error the parser goes on with the next line.
    ///
    /// # Errors
    /// [`CsvError`] with line and column: a header that lacks a channel or names one twice, another number of fields
    /// than the header or the first row, a field that is not a finite number, text that is not UTF-8.
    pub fn parse_line(&mut self, line: &[u8]) -> Result<Option<Vec<f64>>, CsvError> {
        self.line += 1;
        let text = utf8(&self.source, self.line, line)?;
        let text = if self.line == 1 { without_mark(text) } else { text };
        if is_passed_over(text) {
            return Ok(None);
        }
        let cells = Cells::parse(&self.source, self.line, text)?;
        let found = match &mut self.found {
            Some(found) => found,
            none => {
                let channels = ChannelFields::find(&cells, &self.columns)?;
                let found = none.insert(Found { channels, width: cells.width() });
                if self.columns.header == Header::Present {
                    return Ok(None);
                }
                found
            }
        };
        cells.check_width(found.width)?;
        found.channels.reading(&cells).map(Some)
    }
}

/// Which fields of a row are the channels, in the layout's order.
#[derive(Clone, Debug)]
pub(super) struct ChannelFields(Vec<(usize, Unit)>);

impl ChannelFields {
    pub fn find(head: &Cells, columns: &Columns) -> Result<Self, CsvError> {
        let find =
            |channel: &super::ValueColumn| Ok((head.find(&channel.column, columns.header)?, channel.unit));
        columns.channels.iter().map(find).collect::<Result<_, _>>().map(Self)
    }

    pub fn reading(&self, cells: &Cells) -> Result<Vec<f64>, CsvError> {
        self.0.iter().map(|(index, unit)| cells.number(*index, *unit)).collect()
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
pub(super) fn utf8<'a>(source: &str, line: usize, bytes: &'a [u8]) -> Result<&'a str, CsvError> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.trim_end_matches(['\r', '\n'])),
        Err(_) => {
            let text = String::from_utf8_lossy(bytes).trim_end_matches(['\r', '\n']).to_owned();
            let span = 0..text.len();
            Err(CsvProblem::NotUtf8.at(source, Place { line, column: None, text, span }))
        }
    }
}
