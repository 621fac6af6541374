//! Readings as they stream in, line by line.

use super::cells::Cells;
use super::columns::{Columns, Header};
use super::csv_error::CsvError;
use super::lines::Lines;
use palpate_mechanics::units::Unit;

/// Turns lines of CSV into readings; only the channel columns need to be there.
#[derive(Clone, Debug)]
pub struct ReadingParser {
    lines: Lines,
    columns: Columns,
    found: Option<Found>,
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
        Self { lines: Lines::new(source), columns: columns.clone(), found: None }
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
        let Some(cells) = self.lines.cells(line)? else { return Ok(None) };
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
