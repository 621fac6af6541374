//! Recordings of contacts that move: a `time_s` column beside the others, and those of a second contact.
//!
//! Whoever reads such a file as an ordinary recording passes the column over, as any column without a role.

use std::io::{self, Write};

use super::Recording;
use super::cells::Cells;
use super::columns::{Column, Columns, Header};
use super::csv_error::CsvError;
use super::csv_in::{ContactFields, Schema};
use super::csv_out::{csv_row, header, record};
use super::lines::Lines;
use super::reading_parser::ChannelFields;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

/// The column of time, in seconds.
const TIME: &str = "time_s";

/// The columns of a second contact.
const SECOND: [&str; 2] = ["position_2_mm", "force_2_n"];

/// A recording with the time of every row.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedRecording {
    /// The rows; a force of 0 says that nothing touched.
    pub recording: Recording,
    /// When each was taken, in seconds.
    pub times_s: Vec<f64>,
    /// The second contact of each row; nothing where there is but one contact.
    pub second: Vec<Contact>,
}

impl TimedRecording {
    /// The true contacts of every row whose force is known.
    pub fn truths(&self) -> Vec<Vec<Contact>> {
        let rows = self.recording.rows.iter().enumerate();
        let all = rows.filter_map(|(i, row)| {
            row.contact().map(|first| std::iter::once(first).chain(self.second.get(i).copied()).collect())
        });
        all.collect()
    }
}

/// Writes a recording as [`write`](super::write) does, with the time first.
///
/// # Errors
/// Whatever `out` reports.
pub fn write_timed(
    timed: &TimedRecording,
    extent: Extent,
    comment: &str,
    mut out: impl Write,
) -> io::Result<()> {
    let columns = Columns::own(&timed.recording.channels, &timed.recording.kinds, extent);
    let timed_record = |time: String, second: [String; 2], rest: Vec<String>| {
        let second = second.into_iter().filter(|_| !timed.second.is_empty());
        std::iter::once(time).chain(second).chain(rest)
    };
    writeln!(out, "# {}", comment.replace(['\r', '\n'], " "))?;
    let heading = timed_record(TIME.to_owned(), SECOND.map(str::to_owned), header(&columns));
    out.write_all(csv_row(heading).as_bytes())?;
    for (i, (row, time_s)) in timed.recording.rows.iter().zip(&timed.times_s).enumerate() {
        let second = timed.second.get(i).map_or_else(Default::default, |contact| {
            [columns.position_unit.format_si(contact.position.x_m), Unit::NONE.format_si(contact.force_n)]
        });
        let line = timed_record(Unit::NONE.format_si(*time_s), second, record(row, &columns));
        out.write_all(csv_row(line).as_bytes())?;
    }
    out.flush()
}

/// One line of readings in time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedReading {
    /// When it was taken, where the file says, in seconds.
    pub time_s: Option<f64>,
    /// The true contacts, where the file says; the force is 0 of one that did not touch.
    pub truth: Option<Vec<Contact>>,
    /// One value a channel, in SI units.
    pub reading: Vec<f64>,
}

/// Turns lines of CSV into readings in time; only the channel columns need to be there.
pub struct TimedParser<'a> {
    lines: Lines,
    schema: Schema<'a>,
    found: Option<Found>,
}

/// What the first line told.
#[derive(Clone, Debug)]
struct Found {
    time: Option<usize>,
    contact: Option<ContactFields>,
    second: Option<[usize; 2]>,
    channels: ChannelFields,
    width: usize,
}

impl<'a> TimedParser<'a> {
    /// A parser for the lines of `source`, from the first one.
    pub fn new(source: &str, schema: Schema<'a>) -> Self {
        Self { lines: Lines::new(source), schema, found: None }
    }

    /// Whether no line yet has told which columns there are: an error now means that no line can be read.
    pub fn awaits_columns(&self) -> bool {
        self.found.is_none()
    }

    /// Whether a column tells the time.
    pub fn has_time(&self) -> bool {
        self.found.as_ref().is_some_and(|found| found.time.is_some())
    }

    /// Reads the next line; `None` for the header, a blank line or a comment (`#`). After an error the parser goes on
    /// with the next line.
    ///
    /// # Errors
    /// [`CsvError`] with line and column, as [`ReadingParser::parse_line`](super::ReadingParser::parse_line) has them, and
    /// for a time or a contact that is no number, or a contact off the surface.
    pub fn parse_line(&mut self, line: &[u8]) -> Result<Option<TimedReading>, CsvError> {
        let Some(cells) = self.lines.cells(line)? else { return Ok(None) };
        let header = self.schema.columns.header;
        let found = match &mut self.found {
            Some(found) => found,
            none => {
                let found = none.insert(Found::of(&cells, &self.schema)?);
                if header == Header::Present {
                    return Ok(None);
                }
                found
            }
        };
        cells.check_width(found.width)?;
        let time_s = found.time.map(|field| cells.number(field, Unit::NONE)).transpose()?;
        let touch = found.contact.as_ref().map(|contact| contact.touch(&cells, &self.schema)).transpose()?;
        // A force that nobody knows is not 0: something touched.
        let truth = touch.map(|touch| Contact {
            position: touch.position,
            force_n: touch.force_n.unwrap_or(f64::INFINITY),
        });
        let second = found.second.map(|fields| second_contact(&cells, fields)).transpose()?;
        let truth = truth.map(|first| std::iter::once(first).chain(second).collect());
        Ok(Some(TimedReading { time_s, truth, reading: found.channels.reading(&cells)? }))
    }
}

/// The second contact of a line, from the fields of its place and its force.
fn second_contact(cells: &Cells, [x, force]: [usize; 2]) -> Result<Contact, CsvError> {
    let position = Position::along(cells.number(x, SensorKind::Deflection.unit())?);
    Ok(Contact { position, force_n: cells.number(force, SensorKind::Reaction.unit())? })
}

impl Found {
    fn of(head: &Cells, schema: &Schema) -> Result<Self, CsvError> {
        let columns = schema.columns;
        let named = columns.header == Header::Present;
        let time = Column::Name(TIME.to_owned());
        let time = if named && head.has(&time) { Some(head.find(&time, columns.header)?) } else { None };
        let contact = if named { ContactFields::find(head, columns).ok() } else { None };
        let second = SECOND.map(|name| Column::Name(name.to_owned()));
        let second = if named && second.iter().all(|column| head.has(column)) {
            let [x, force] = &second;
            Some([head.find(x, columns.header)?, head.find(force, columns.header)?])
        } else {
            None
        };
        let channels = ChannelFields::find(head, columns)?;
        Ok(Self { time, contact, second, channels, width: head.width() })
    }
}
