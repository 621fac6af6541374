//! Reading recordings from CSV.

use std::io::Read;

use super::cells::{Cells, split};
use super::columns::{Column, Columns, Frame, Header, Need, PositionColumns, ValueColumn};
use super::csv_error::{CsvError, CsvProblem};
use super::dialect::{Dialect, windows_1252};
use super::marks::{Decimal, Separator};
use super::placement::placement_of;
use super::timestamp::Clock;
use super::{Recording, Row, sha256_hex};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

/// Schema of a recording of a bench.
#[derive(Clone, Copy, Debug)]
pub struct Schema<'a> {
    /// Roles of the columns.
    pub columns: &'a Columns,
    /// The sensors; as many as `columns` has channels.
    pub layout: &'a Layout,
    /// Extent of the surface, within which contacts lie.
    pub extent: Extent,
    /// The force of every contact, in newtons, where it is known and the file does not say.
    pub known_force_n: Option<f64>,
}

/// Reads a recording from a CSV file; `source` is its name in messages and in the provenance.
///
/// # Errors
/// [`CsvError`], with line and column: a missing column, a field that is not a finite number, a position off the
/// surface, a row of another length than the header, an empty file, no rows, text that is not UTF-8.
pub fn read(source: &str, bytes: impl Read, schema: &Schema) -> Result<Recording, CsvError> {
    schema.check(source)?;
    let file = File::read(source, bytes)?;
    let columns = schema.columns;
    let find = |head: &mut Cells| {
        let contact = ContactFields::find(head, columns)?;
        Ok((contact, ChannelFields::find(head, columns)?, TimeField::find(head, columns)?))
    };
    let mut clock = Clock::default();
    let (rows, dialect) = file.rows(columns, find, |cells, (contact, channels, time)| {
        let time_s = time.read(cells, &mut clock)?;
        Ok(Row { reading: channels.reading(cells)?, ..contact.row(cells, schema, time_s)? })
    })?;
    schema.check_untouched_times(source, &rows)?;
    let placement_sd_m = placement_of(&file.content);
    let mut recording = schema.recording(source, rows, vec![file.digest], [dialect]);
    recording.provenance.placement_sd_m = placement_sd_m;
    Ok(recording)
}

/// Reads a recording from two CSV files, of readings and of contacts, that pair row by row; the time column is that of the first
/// file, the position and force columns are those of the second. `readings` and `contacts` are each a name and its bytes.
///
/// # Errors
/// [`CsvError`] as for [`read`], and when the files have different numbers of rows.
pub fn read_pair(
    readings: (&str, impl Read),
    contacts: (&str, impl Read),
    schema: &Schema,
) -> Result<Recording, CsvError> {
    schema.check(readings.0)?;
    let source = format!("{}, {}", readings.0, contacts.0);
    let readings = File::read(readings.0, readings.1)?;
    let contacts = File::read(contacts.0, contacts.1)?;
    let columns = schema.columns;
    let mut clock = Clock::default();
    let (reading_rows, reading_dialect) = readings.rows(
        columns,
        |head| Ok((ChannelFields::find(head, columns)?, TimeField::find(head, columns)?)),
        |cells, (channels, time)| Ok((channels.reading(cells)?, time.read(cells, &mut clock)?)),
    )?;
    let mut times_s = reading_rows.iter().map(|(_, time_s)| *time_s);
    let (contact_rows, contact_dialect) = contacts.rows(
        columns,
        |head| ContactFields::find(head, columns),
        |cells, contact| contact.row(cells, schema, times_s.next().flatten()),
    )?;
    if reading_rows.len() != contact_rows.len() {
        let problem = CsvProblem::RowsDiffer { readings: reading_rows.len(), contacts: contact_rows.len() };
        return Err(problem.in_file(contacts.source));
    }
    let rows = reading_rows.into_iter().zip(contact_rows);
    let rows: Vec<Row> = rows.map(|((reading, _), contact)| Row { reading, ..contact }).collect();
    schema.check_untouched_times(readings.source, &rows)?;
    let digests = vec![readings.digest, contacts.digest];
    Ok(schema.recording(&source, rows, digests, [reading_dialect, contact_dialect]))
}

impl Schema<'_> {
    fn check(&self, source: &str) -> Result<(), CsvError> {
        let (columns, sensors) = (self.columns.channels.len(), self.layout.len());
        if columns == sensors {
            Ok(())
        } else {
            Err(CsvProblem::ChannelCount { columns, sensors }.in_file(source))
        }
    }

    /// Checks that every span of untouched times holds a row.
    fn check_untouched_times(&self, source: &str, rows: &[Row]) -> Result<(), CsvError> {
        for span in &self.columns.untouched_times {
            let times = || rows.iter().filter_map(|row| row.time_s);
            if times().next().is_none() {
                return Err(CsvProblem::NoTimes.in_file(source));
            }
            if !times().any(|time_s| span.contains(time_s)) {
                let (from_s, to_s) =
                    (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
                return Err(CsvProblem::NothingUntouched { span: *span, from_s, to_s }.in_file(source));
            }
        }
        Ok(())
    }

    fn recording(
        &self,
        source: &str,
        rows: Vec<Row>,
        digests: Vec<String>,
        dialects: impl IntoIterator<Item = Dialect>,
    ) -> Recording {
        let mut recording = Recording::new(self.layout, source, rows);
        recording.provenance.digests = digests;
        recording.provenance.dialects = dialects.into_iter().filter(|dialect| !dialect.is_plain()).collect();
        recording
    }
}

/// A file in memory.
pub(super) struct File<'s> {
    pub source: &'s str,
    content: Vec<u8>,
    digest: String,
}

impl<'s> File<'s> {
    pub fn read(source: &'s str, mut bytes: impl Read) -> Result<Self, CsvError> {
        let mut content = Vec::new();
        bytes.read_to_end(&mut content).map_err(|error| CsvProblem::Unreadable(error).in_file(source))?;
        let digest = sha256_hex(&content);
        Ok(Self { source, content, digest })
    }

    /// Its lines, with their ends, which some older spreadsheets write as carriage returns alone.
    pub fn lines(&self) -> impl Iterator<Item = &[u8]> {
        let end = if self.content.contains(&b'\n') { b'\n' } else { b'\r' };
        self.content.split_inclusive(move |byte| *byte == end)
    }

    /// Every row, read by `row`, after `find` has found the columns in the first line; and how the table is written.
    fn rows<C, T>(
        &self,
        columns: &Columns,
        find: impl Fn(&mut Cells) -> Result<C, CsvError>,
        mut row: impl FnMut(&mut Cells, &C) -> Result<T, CsvError>,
    ) -> Result<(Vec<T>, Dialect), CsvError> {
        let (mut lines, mut rows) = (Lines::new(self.source, columns.separator, columns.decimal), Vec::new());
        for line in self.lines() {
            if let Some((mut cells, fields)) = lines.next(line, columns.header, &find)? {
                rows.push(row(&mut cells, fields)?);
            }
        }
        match lines.fields {
            None => Err(CsvProblem::Empty.in_file(self.source)),
            Some(_) if rows.is_empty() => Err(CsvProblem::NoRows.in_file(self.source)),
            Some(_) => Ok((rows, lines.dialect)),
        }
    }
}

/// Fields of a row for the position, force and nuisance coordinates of the contact.
#[derive(Clone, Debug)]
struct ContactFields {
    x: usize,
    y: Option<usize>,
    position_unit: Unit,
    frame: Frame,
    force: Option<(usize, Unit)>,
    nuisances: Vec<(usize, Unit)>,
    untouched: Option<usize>,
}

impl ContactFields {
    fn find(head: &mut Cells, columns: &Columns) -> Result<Self, CsvError> {
        let (header, position_unit) = (columns.header, columns.position_unit);
        let mut coordinate = |column: &Column| {
            let values = ValueColumn { column: column.clone(), unit: position_unit };
            head.find_values(&values, "position_unit", header)
        };
        let (x, y) = match &columns.position {
            PositionColumns::Along(x) => (coordinate(x)?, None),
            PositionColumns::Plane { x, y } => (coordinate(x)?, Some(coordinate(y)?)),
        };
        let force = match &columns.force {
            Some(force) if force.need == Need::Required || head.has(&force.values.column) => {
                Some((head.find_values(&force.values, "force_unit", header)?, force.values.unit))
            }
            _ => None,
        };
        let find = |values: &ValueColumn| -> Result<_, CsvError> {
            Ok((head.find_values(values, "nuisance_unit", header)?, values.unit))
        };
        let nuisances = columns.nuisances().map(find).collect::<Result<_, _>>()?;
        let untouched = columns.untouched.as_ref().map(|column| head.find(column, header)).transpose()?;
        Ok(Self { x, y, position_unit, frame: columns.frame, force, nuisances, untouched })
    }

    /// The row of a contact at a time, its reading still empty.
    fn row(&self, cells: &mut Cells, schema: &Schema, time_s: Option<f64>) -> Result<Row, CsvError> {
        let position = self.position(cells)?;
        let is_marked = self.is_marked(cells, schema, time_s)?;
        let force_n = match self.force {
            Some((field, unit)) if !(cells.is_empty(field) && (is_marked || position.is_none())) => {
                Some(cells.number(field, unit)?)
            }
            _ => None,
        };
        let is_found = position.is_none() && force_n.is_none_or(|force_n| force_n == 0.0);
        if is_found && !is_marked {
            cells.count_without_position();
        }
        if is_marked || is_found || force_n == Some(0.0) {
            return self.untouched_row(cells, schema, time_s, position);
        }
        // The error of a field that is empty.
        let position = position.map_or_else(|| self.coordinates(cells), Ok)?;
        let extent = schema.extent;
        if !extent.contains(position) {
            let across = self.y.filter(|_| extent.contains(Position::along(position.x_m)));
            return Err(cells.error(across.unwrap_or(self.x), CsvProblem::OffSurface { position, extent }));
        }
        let nuisances = self.nuisances(cells)?;
        let force_n = force_n.or(schema.known_force_n);
        Ok(Row { position, force_n, nuisances, time_s, reading: Vec::new() })
    }

    /// The position; `None` where its fields are empty.
    fn position(&self, cells: &mut Cells) -> Result<Option<Position>, CsvError> {
        let is_empty = cells.is_empty(self.x) && self.y.is_none_or(|y| cells.is_empty(y));
        if is_empty { Ok(None) } else { self.coordinates(cells).map(Some) }
    }

    fn coordinates(&self, cells: &mut Cells) -> Result<Position, CsvError> {
        let x_m = cells.number(self.x, self.position_unit)?;
        let y_m = self.y.map_or(Ok(0.0), |y| cells.number(y, self.position_unit))?;
        Ok(self.frame.position(x_m, y_m))
    }

    fn nuisances(&self, cells: &mut Cells) -> Result<Vec<f64>, CsvError> {
        self.nuisances.iter().map(|(field, unit)| cells.number(*field, *unit)).collect()
    }

    /// Whether the row is marked as untouched, or its time is among those in which nothing touched.
    fn is_marked(&self, cells: &Cells, schema: &Schema, time_s: Option<f64>) -> Result<bool, CsvError> {
        let is_time = |time_s| schema.columns.untouched_times.iter().any(|span| span.contains(time_s));
        let marked = self.untouched.map_or(Ok(false), |field| cells.is_marked(field))?;
        Ok(marked || time_s.is_some_and(is_time))
    }

    /// The row of no contact: its position means nothing, and is kept where it is one of the surface.
    fn untouched_row(
        &self,
        cells: &mut Cells,
        schema: &Schema,
        time_s: Option<f64>,
        position: Option<Position>,
    ) -> Result<Row, CsvError> {
        let position = position.filter(|position| schema.extent.contains(*position)).unwrap_or_default();
        let is_known = self.nuisances.iter().all(|(field, _)| !cells.is_empty(*field));
        let nuisances = if is_known { self.nuisances(cells)? } else { Vec::new() };
        Ok(Row { position, force_n: Some(0.0), nuisances, time_s, reading: Vec::new() })
    }
}

/// Field of a row for its time, where the file has one.
#[derive(Clone, Copy, Debug)]
struct TimeField(Option<(usize, Unit)>);

impl TimeField {
    /// The field of the column that is named, which must be there, or of `time_s`, which may be.
    fn find(head: &mut Cells, columns: &Columns) -> Result<Self, CsvError> {
        let own =
            || Some(Column::from(TIME)).filter(|own| columns.header == Header::Present && head.has(own));
        let unit = Unit::NONE;
        let time = columns.time.clone().or_else(|| Some(ValueColumn { column: own()?, unit }));
        let field = |time: ValueColumn| -> Result<_, CsvError> {
            Ok((head.find_values(&time, "time_unit", columns.header)?, time.unit))
        };
        time.map(field).transpose().map(Self)
    }

    fn read(self, cells: &mut Cells, clock: &mut Clock) -> Result<Option<f64>, CsvError> {
        self.0.map(|(field, unit)| cells.time(field, unit, clock)).transpose()
    }
}

/// Lines of CSV as they come, and the fields that the first of them told.
#[derive(Clone, Debug)]
pub(super) struct Lines<F> {
    /// Dialect of the lines, as far as they have told.
    dialect: Dialect,
    /// The separator, where the rig or a line before the header says it.
    separator: Option<Separator>,
    /// The text of the last line that was not UTF-8.
    decoded: String,
    /// Number of lines that have been read.
    count: usize,
    /// The fields, and how many a line has.
    fields: Option<(F, usize)>,
}

impl<F> Lines<F> {
    /// The lines of `source` from the first one, with the separator and the decimal mark that are said.
    pub fn new(source: &str, separator: Option<Separator>, decimal: Option<Decimal>) -> Self {
        let dialect = Dialect::new(source, decimal);
        Self { dialect, separator, decoded: String::new(), count: 0, fields: None }
    }

    /// The cells of the next line and its fields, which `find` finds in the first one; `None` for the header, a blank line or a
    /// comment (`#`).
    pub fn next<'a>(
        &'a mut self,
        line: &'a [u8],
        header: Header,
        find: impl Fn(&mut Cells) -> Result<F, CsvError>,
    ) -> Result<Option<(Cells<'a>, &'a F)>, CsvError> {
        self.count += 1;
        let Self { dialect, separator, decoded, count, fields } = self;
        let Some(text) = written(line, *count, dialect, decoded)? else { return Ok(None) };
        if fields.is_none()
            && let Some(told) = Separator::told(text)
        {
            *separator = Some(told);
            return Ok(None);
        }
        let (fields, width) = match fields {
            Some(found) => found,
            none => {
                let separators = separator.map_or_else(|| separators(text, header), |told| vec![told]);
                let Some(found) = first_line(*count, text, &separators, dialect, find)? else {
                    return Ok(None);
                };
                let found = none.insert(found);
                if header == Header::Present {
                    return Ok(None);
                }
                found
            }
        };
        let cells = Cells::parse(*count, text, dialect)?;
        if cells.is_blank() {
            return Ok(None);
        }
        cells.check_width(*width)?;
        Ok(Some((cells, fields)))
    }

    /// The text of the next line, uncut; `None` where nothing is in it but separators, or a comment.
    pub fn text<'a>(&'a mut self, line: &'a [u8]) -> Result<Option<&'a str>, CsvError> {
        self.count += 1;
        let text = written(line, self.count, &mut self.dialect, &mut self.decoded)?;
        if let Some(told) = text.and_then(Separator::told) {
            self.separator = Some(told);
            return Ok(None);
        }
        let nothing = |c: char| c.is_whitespace() || matches!(c, '"' | ',' | ';');
        Ok(text.filter(|text| !text.chars().all(nothing)))
    }

    /// Number of lines that have been read.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The separator that was said, or that a line before the header has told.
    pub fn separator(&self) -> Option<Separator> {
        self.separator
    }

    /// The fields that the first line has told.
    pub fn fields(&self) -> Option<&F> {
        self.fields.as_ref().map(|(fields, _)| fields)
    }
}

/// The separators by which the first line of a file may be meant to be cut.
fn separators(text: &str, header: Header) -> Vec<Separator> {
    let cuts = |separator: &Separator| split(text, *separator).is_ok_and(|fields| fields.len() > 1);
    let mut separators: Vec<Separator> = Separator::ALL.into_iter().filter(cuts).collect();
    // Between numbers, a comma beside semicolons or tabs stands before decimals.
    if header == Header::Absent && separators.len() > 1 {
        separators.retain(|separator| *separator != Separator::Comma);
    }
    if separators.is_empty() { vec![Separator::Comma] } else { separators }
}

/// The fields that `find` finds in the first line, and how many a line has, with the one separator that lets it; `None` for a line
/// of empty fields.
fn first_line<F>(
    line: usize,
    text: &str,
    separators: &[Separator],
    dialect: &mut Dialect,
    find: impl Fn(&mut Cells) -> Result<F, CsvError>,
) -> Result<Option<(F, usize)>, CsvError> {
    let mut found: Option<(F, usize, Dialect)> = None;
    let mut refused: Option<(usize, CsvError)> = None;
    for separator in separators {
        let mut dialect = Dialect { separator: *separator, ..dialect.clone() };
        let mut cells = Cells::parse(line, text, &mut dialect)?;
        if cells.is_blank() {
            return Ok(None);
        }
        let width = cells.width();
        match (find(&mut cells), &found) {
            (Ok(fields), None) => found = Some((fields, width, dialect)),
            (Ok(_), Some((.., other))) => {
                let problem = CsvProblem::ManySeparators { first: other.separator, second: *separator };
                return Err(cells.line_error(problem));
            }
            (Err(error), _) if refused.as_ref().is_none_or(|(most, _)| width > *most) => {
                refused = Some((width, error));
            }
            (Err(_), _) => {}
        }
    }
    match (found, refused) {
        (Some((fields, width, found)), _) => {
            *dialect = found;
            Ok(Some((fields, width)))
        }
        (None, Some((_, error))) => Err(error),
        (None, None) => Ok(None),
    }
}

/// A parser of the lines of a stream, one by one, which finds its columns by the first of them.
pub trait LineParser {
    /// The values of a line.
    type Parsed;

    /// Reads the next line; `None` for the header, a blank line or a comment (`#`). After an error the parser goes on with the next line.
    ///
    /// # Errors
    /// [`CsvError`] with line and column: a header that lacks a channel or names one twice, another number of fields
    /// than the header or the first row, a field that is not a finite number, text that is not UTF-8; of readings in time also a time or a
    /// contact that is no number, and a contact off the surface.
    fn parse_line(&mut self, line: &[u8]) -> Result<Option<Self::Parsed>, CsvError>;

    /// Progress through the lines.
    fn progress(&mut self) -> &mut dyn LineProgress;
}

/// Progress of a [`LineParser`].
pub trait LineProgress {
    /// Counts a line that nobody reads, so that the lines after it have their numbers.
    fn skip_line(&mut self);

    /// True while no line yet has told which columns there are: an error now means that no line can be read.
    fn awaits_columns(&self) -> bool;

    /// Dialect of the lines, as far as they have told.
    fn dialect(&self) -> &Dialect;
}

impl<F> LineProgress for Lines<F> {
    fn skip_line(&mut self) {
        self.count += 1;
    }

    fn awaits_columns(&self) -> bool {
        self.fields.is_none()
    }

    fn dialect(&self) -> &Dialect {
        &self.dialect
    }
}

/// Turns lines of CSV into readings; only the channel columns need to be there.
#[derive(Clone, Debug)]
pub struct ReadingParser {
    lines: Lines<ChannelFields>,
    columns: Columns,
}

impl ReadingParser {
    /// A parser for the lines of `source`, from the first one; the position and force columns need not be there.
    pub fn new(source: &str, columns: &Columns) -> Self {
        Self { lines: Lines::new(source, columns.separator, columns.decimal), columns: columns.clone() }
    }
}

impl LineParser for ReadingParser {
    /// One value per channel, in SI units.
    type Parsed = Vec<f64>;

    fn parse_line(&mut self, line: &[u8]) -> Result<Option<Vec<f64>>, CsvError> {
        let Self { lines, columns } = self;
        let next = lines.next(line, columns.header, |head| ChannelFields::find(head, columns))?;
        next.map(|(mut cells, channels)| channels.reading(&mut cells)).transpose()
    }

    fn progress(&mut self) -> &mut dyn LineProgress {
        &mut self.lines
    }
}

/// Fields of a row for the channels, in the layout's order.
#[derive(Clone, Debug)]
struct ChannelFields(Vec<(usize, Unit)>);

impl ChannelFields {
    fn find(head: &mut Cells, columns: &Columns) -> Result<Self, CsvError> {
        let find = |channel: &ValueColumn| {
            Ok((head.find_values(channel, "channel_unit", columns.header)?, channel.unit))
        };
        columns.channels.iter().map(find).collect::<Result<_, _>>().map(Self)
    }

    fn reading(&self, cells: &mut Cells) -> Result<Vec<f64>, CsvError> {
        self.0.iter().map(|(index, unit)| cells.number(*index, *unit)).collect()
    }
}

/// The column of time that palpate itself writes, in seconds.
pub(super) const TIME: &str = "time_s";

/// The columns of a second contact.
pub(super) const SECOND: [&str; 2] = ["position_2_mm", "force_2_n"];

/// A recording of contacts that move, with the time of every row and, where there is one, the second contact.
///
/// Its file has a `time_s` column beside the others; whoever reads it as an ordinary recording passes that over, as any column without
/// a role.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedRecording {
    /// The rows; a force of 0 says that nothing touched.
    pub recording: Recording,
    /// Time of each row, in seconds.
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

/// One line of readings in time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedReading {
    /// Its time in seconds, where the file has one.
    pub time_s: Option<f64>,
    /// The true contacts, where the file says; the force is 0 of one that did not touch.
    pub truth: Option<Vec<Contact>>,
    /// One value a channel, in SI units.
    pub reading: Vec<f64>,
}

/// Turns lines of CSV into readings in time; only the channel columns need to be there.
pub struct TimedParser<'a> {
    lines: Lines<TimedFields>,
    clock: Clock,
    schema: Schema<'a>,
}

/// Fields of a row for the time, the contacts and the channels.
#[derive(Clone, Debug)]
struct TimedFields {
    time: TimeField,
    contact: Option<ContactFields>,
    second: Option<(usize, usize)>,
    channels: ChannelFields,
}

impl<'a> TimedParser<'a> {
    /// A parser for the lines of `source`, from the first one.
    pub fn new(source: &str, schema: Schema<'a>) -> Self {
        let Columns { separator, decimal, .. } = schema.columns;
        Self { lines: Lines::new(source, *separator, *decimal), clock: Clock::default(), schema }
    }

    /// Whether a column tells the time.
    pub fn has_time(&self) -> bool {
        self.lines.fields.as_ref().is_some_and(|(fields, _)| fields.time.0.is_some())
    }
}

impl LineParser for TimedParser<'_> {
    type Parsed = TimedReading;

    fn parse_line(&mut self, line: &[u8]) -> Result<Option<TimedReading>, CsvError> {
        let Self { lines, clock, schema } = self;
        let next = lines.next(line, schema.columns.header, |head| TimedFields::find(head, schema))?;
        let Some((mut cells, fields)) = next else { return Ok(None) };
        let time_s = fields.time.read(&mut cells, clock)?;
        let row =
            fields.contact.as_ref().map(|contact| contact.row(&mut cells, schema, time_s)).transpose()?;
        // A force that nobody knows is not 0: something touched.
        let truth = row.map(|Row { position, force_n, .. }| Contact {
            position,
            force_n: force_n.unwrap_or(f64::INFINITY),
        });
        let mut second = |(x, force)| -> Result<Contact, CsvError> {
            let position = Position::along(cells.number(x, SensorKind::Deflection.unit())?);
            Ok(Contact { position, force_n: cells.number(force, SensorKind::Reaction.unit())? })
        };
        let second = fields.second.map(&mut second).transpose()?;
        let truth = truth.map(|first| std::iter::once(first).chain(second).collect());
        Ok(Some(TimedReading { time_s, truth, reading: fields.channels.reading(&mut cells)? }))
    }

    fn progress(&mut self) -> &mut dyn LineProgress {
        &mut self.lines
    }
}

impl TimedFields {
    fn find(head: &mut Cells, schema: &Schema) -> Result<Self, CsvError> {
        let columns = schema.columns;
        let named = columns.header == Header::Present;
        let mut field = |name: &str| {
            let column = ValueColumn { column: Column::from(name), unit: Unit::NONE };
            let there = named && head.has(&column.column);
            there.then(|| head.find_values(&column, "", columns.header)).transpose()
        };
        let second = field(SECOND[0])?.zip(field(SECOND[1])?);
        Ok(Self {
            second,
            time: match TimeField::find(head, columns) {
                Err(CsvError { problem: CsvProblem::MissingColumn { .. }, .. }) => TimeField(None),
                found => found?,
            },
            contact: if named { ContactFields::find(head, columns).ok() } else { None },
            channels: ChannelFields::find(head, columns)?,
        })
    }
}

/// Text of a line of bytes, without its end; `None` for a blank line or a comment. `decoded` holds the text where it is not
/// UTF-8.
fn written<'a>(
    bytes: &'a [u8],
    line: usize,
    dialect: &mut Dialect,
    decoded: &'a mut String,
) -> Result<Option<&'a str>, CsvError> {
    let text = match std::str::from_utf8(bytes).map_err(|error| (error, windows_1252(bytes))) {
        Ok(text) => text,
        Err((_, Some(text))) => {
            dialect.windows_1252 = true;
            *decoded = text;
            decoded.as_str()
        }
        Err((error, None)) => {
            let (good, bad) = bytes.split_at(error.valid_up_to());
            let shown = |part| String::from_utf8_lossy(part).trim_end().replace(char::is_control, "\u{fffd}");
            let (before, after) = (shown(good), shown(bad));
            let mark = before.len()..before.len() + after.chars().next().map_or(0, char::len_utf8);
            return Err(CsvProblem::NotText.in_line(&dialect.source, line, before + &after, mark));
        }
    };
    let text = text.trim_end_matches(['\r', '\n']);
    // Some spreadsheets begin a file with a byte-order mark.
    let text = if line == 1 { text.strip_prefix('\u{feff}').unwrap_or(text) } else { text };
    // A heading may be `#`, for the number of the row.
    let is_comment = text.strip_prefix('#').is_some_and(|rest| !rest.starts_with([',', ';', '\t']));
    Ok(Some(text).filter(|text| !text.trim().is_empty() && !is_comment))
}
