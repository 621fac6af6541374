//! CSV reader.

use std::io::Read;

use super::cells::Cells;
use super::columns::{Column, Columns, Frame, Header, Need, PositionColumns, ValueColumn};
use super::csv_error::{CsvError, CsvProblem};
use super::dialect::Dialect;
use super::lines::{LineProgress, Lines, Reading};
use super::notes::Origin;
use super::placement::placement_of;
use super::text::TextDecoder;
use super::timestamp::Clock;
use super::zero_force::{self, Sample};
use super::{Recording, Row, sha256_hex};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

/// Schema of recordings.
#[derive(Clone, Copy, Debug)]
pub struct Schema<'a> {
    /// Column roles.
    pub columns: &'a Columns,
    /// Sensors, one per channel.
    pub layout: &'a Layout,
    /// Surface extent.
    pub extent: Extent,
    /// Force of contacts without recorded force, in newtons.
    pub known_force_n: Option<f64>,
}

/// Reads a recording; `source` is the file's name.
///
/// # Errors
/// [`CsvError`], with line and column.
pub fn read(source: &str, bytes: impl Read, schema: &Schema) -> Result<Recording, CsvError> {
    schema.check(source)?;
    let file = File::read(source, bytes)?;
    let columns = schema.columns;
    let find = |head: &mut Cells| {
        let contact = ContactFields::find(head, columns)?;
        Ok((contact, ChannelFields::find(head, columns)?, TimeField::find(head, columns)?))
    };
    let mut clock = Clock::default();
    let (rows, mut dialect) = file.rows(columns, find, |cells, (contact, channels, time)| {
        let time_s = time.read(cells, &mut clock)?;
        Ok(contact.row(cells, schema, time_s)?.with_reading(channels.reading(cells)?))
    })?;
    let rows = settle_forces(rows, columns, &mut dialect)?;
    schema.check_untouched_times(source, &rows)?;
    let placement_sd_m = placement_of(&file.content);
    let mut recording = schema.recording(source, rows, vec![file.digest], [dialect])?;
    recording.provenance.placement_sd_m = placement_sd_m;
    Ok(recording)
}

/// Reads a recording from two files that pair row by row: readings with times, and contacts. Each is a name
/// and bytes.
///
/// # Errors
/// [`CsvError`], also for different numbers of rows.
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
    let (contact_rows, mut contact_dialect) = contacts.rows(
        columns,
        |head| ContactFields::find(head, columns),
        |cells, contact| contact.row(cells, schema, times_s.next().flatten()),
    )?;
    if reading_rows.len() != contact_rows.len() {
        let problem = CsvProblem::RowsDiffer { readings: reading_rows.len(), contacts: contact_rows.len() };
        return Err(problem.in_file(contacts.source));
    }
    let rows = reading_rows.into_iter().zip(contact_rows);
    let rows = rows.map(|((reading, _), contact)| contact.with_reading(reading)).collect();
    let rows = settle_forces(rows, columns, &mut contact_dialect)?;
    schema.check_untouched_times(readings.source, &rows)?;
    let digests = vec![readings.digest, contacts.digest];
    schema.recording(&source, rows, digests, [reading_dialect, contact_dialect])
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
    ) -> Result<Recording, CsvError> {
        let mut recording = Recording::new(self.layout, source, rows);
        recording.provenance.digests = digests;
        recording.provenance.dialects = dialects.into_iter().filter(|dialect| !dialect.is_plain()).collect();
        let recording = recording.treat_repeated_readings(self.columns.repeated_readings);
        recording.subtract_zero(self.columns.zero).map_err(|error| CsvProblem::from(error).in_file(source))
    }
}

/// Row before the recognition of forces that are 0 except for noise.
#[derive(Debug)]
struct OpenRow {
    row: Row,
    has_position: bool,
    /// Error unless the force is 0.
    refusal: Option<Box<CsvError>>,
}

impl OpenRow {
    fn with_reading(mut self, reading: Vec<f64>) -> Self {
        self.row.reading = reading;
        self
    }

    fn into_row(self) -> Result<Row, CsvError> {
        self.refusal.map_or(Ok(self.row), |error| Err(*error))
    }
}

fn settle_forces(rows: Vec<OpenRow>, columns: &Columns, dialect: &mut Dialect) -> Result<Vec<Row>, CsvError> {
    if columns.force_zero_n.is_none() {
        let samples = rows.iter().map(|open| Sample { row: &open.row, has_position: open.has_position });
        dialect.zero_force = zero_force::recognise(&samples.collect::<Vec<_>>());
    }
    let zero_n = dialect.zero_force.map_or(0.0, |zero| zero.zero_n);
    let settle = |mut open: OpenRow| {
        if open.row.force_n.is_some_and(|force_n| force_n.abs() <= zero_n) {
            open.row.force_n = Some(0.0);
            open.refusal = None;
        }
        open.into_row()
    };
    rows.into_iter().map(settle).collect()
}

pub(super) struct File<'s> {
    pub source: &'s str,
    /// UTF-8, or the original bytes of another encoding.
    content: Vec<u8>,
    digest: String,
    pub is_utf16: bool,
}

impl<'s> File<'s> {
    pub fn read(source: &'s str, mut bytes: impl Read) -> Result<Self, CsvError> {
        let mut content = Vec::new();
        bytes.read_to_end(&mut content).map_err(|error| CsvProblem::Unreadable(error).in_file(source))?;
        let digest = sha256_hex(&content);
        let mut decoder = TextDecoder::default();
        let mut text = decoder.decode(&content);
        let is_utf16 = decoder.is_utf16();
        text.extend(decoder.finish());
        Ok(Self { source, content: text, digest, is_utf16 })
    }

    /// Some older spreadsheets end lines with carriage returns alone.
    pub fn lines(&self) -> impl Iterator<Item = &[u8]> {
        let end = if self.content.contains(&b'\n') { b'\n' } else { b'\r' };
        self.content.split_inclusive(move |byte| *byte == end)
    }

    fn rows<C, T>(
        &self,
        columns: &Columns,
        find: impl Fn(&mut Cells) -> Result<C, CsvError>,
        mut row: impl FnMut(&mut Cells, &C) -> Result<T, CsvError>,
    ) -> Result<(Vec<T>, Dialect), CsvError> {
        let mut lines = Lines::new(self.source, Reading::of(columns, Origin::File));
        let mut rows = Vec::new();
        for line in self.lines() {
            if let Some((mut cells, fields)) = lines.next(line, &find)? {
                rows.push(row(&mut cells, fields)?);
            }
        }
        if let Some(error) = lines.unfound() {
            return Err(error);
        }
        match lines.fields() {
            None => Err(CsvProblem::Empty.in_file(self.source)),
            Some(_) if rows.is_empty() => Err(CsvProblem::NoRows.in_file(self.source)),
            Some(_) => {
                let dialect = lines.into_dialect()?;
                Ok((rows, Dialect { utf16: self.is_utf16, ..dialect }))
            }
        }
    }
}

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

    fn row(&self, cells: &mut Cells, schema: &Schema, time_s: Option<f64>) -> Result<OpenRow, CsvError> {
        let position = self.position(cells)?;
        let is_marked = self.is_marked(cells, schema, time_s)?;
        let force_n = match self.force {
            Some((field, unit)) if !(cells.is_empty(field) && (is_marked || position.is_none())) => {
                Some(cells.number(field, unit)?)
            }
            _ => None,
        };
        let zero_n = schema.columns.force_zero_n.unwrap_or(0.0);
        let is_zero = force_n.is_some_and(|force_n| force_n.abs() <= zero_n);
        let is_found = position.is_none() && (force_n.is_none() || is_zero);
        if is_found && !is_marked {
            cells.count_without_position();
        }
        if is_marked || is_found || is_zero {
            return self.untouched_row(cells, schema, time_s, position);
        }
        let refusal = self.refusal(cells, schema, position)?;
        if refusal.is_some() && force_n.is_some() {
            let open = self.untouched_row(cells, schema, time_s, position)?;
            return Ok(OpenRow { row: Row { force_n, ..open.row }, refusal: refusal.map(Box::new), ..open });
        }
        let (None, Some(position)) = (&refusal, position) else {
            return refusal.map_or_else(|| self.untouched_row(cells, schema, time_s, position), Err);
        };
        let nuisances = self.nuisances(cells)?;
        let row = Row {
            position,
            force_n: force_n.or(schema.known_force_n),
            nuisances,
            time_s,
            reading: Vec::new(),
        };
        Ok(OpenRow { row, has_position: true, refusal: None })
    }

    /// Error of a press without a position on the surface.
    fn refusal(
        &self,
        cells: &mut Cells,
        schema: &Schema,
        position: Option<Position>,
    ) -> Result<Option<CsvError>, CsvError> {
        let extent = schema.extent;
        match position {
            None => Ok(self.coordinates(cells).err()),
            Some(position) if extent.contains(position) => Ok(None),
            Some(position) => {
                let across = self.y.filter(|_| extent.contains(Position::along(position.x_m)));
                Ok(Some(cells.error(across.unwrap_or(self.x), CsvProblem::OffSurface { position, extent })))
            }
        }
    }

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

    fn is_marked(&self, cells: &Cells, schema: &Schema, time_s: Option<f64>) -> Result<bool, CsvError> {
        let is_time = |time_s| schema.columns.untouched_times.iter().any(|span| span.contains(time_s));
        let marked = self.untouched.map_or(Ok(false), |field| cells.is_marked(field))?;
        Ok(marked || time_s.is_some_and(is_time))
    }

    /// Keeps a meaningless position if it is on the surface.
    fn untouched_row(
        &self,
        cells: &mut Cells,
        schema: &Schema,
        time_s: Option<f64>,
        position: Option<Position>,
    ) -> Result<OpenRow, CsvError> {
        let position = position.filter(|position| schema.extent.contains(*position));
        let is_known = self.nuisances.iter().all(|(field, _)| !cells.is_empty(*field));
        let nuisances = if is_known { self.nuisances(cells)? } else { Vec::new() };
        let has_position = position.is_some();
        let position = position.unwrap_or_default();
        let row = Row { position, force_n: Some(0.0), nuisances, time_s, reading: Vec::new() };
        Ok(OpenRow { row, has_position, refusal: None })
    }
}

#[derive(Clone, Copy, Debug)]
struct TimeField(Option<(usize, Unit)>);

impl TimeField {
    /// Required if named; `time_s` is optional.
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

    fn find_optional(head: &mut Cells, columns: &Columns) -> Result<Self, CsvError> {
        match Self::find(head, columns) {
            Err(CsvError { problem: CsvProblem::MissingColumn { .. }, .. }) => Ok(Self(None)),
            found => found,
        }
    }

    fn read(self, cells: &mut Cells, clock: &mut Clock) -> Result<Option<f64>, CsvError> {
        self.0.map(|(field, unit)| cells.time(field, unit, clock)).transpose()
    }
}

/// Line-by-line parser; the first lines determine the columns.
pub trait LineParser {
    /// Values of a line.
    type Values;

    /// Parses the next line; `None` for the header, a blank line or a comment. Parsing continues after an
    /// error.
    ///
    /// # Errors
    /// [`CsvError`], with line and column.
    fn parse_line(&mut self, line: &[u8]) -> Result<Option<Self::Values>, CsvError>;

    /// Progress.
    fn progress(&mut self) -> &mut dyn LineProgress;
}

/// Parser of readings; only channel columns are required.
#[derive(Debug)]
pub struct ReadingParser {
    lines: Lines<(ChannelFields, TimeField)>,
    columns: Columns,
    clock: Clock,
    time_s: Option<f64>,
}

impl ReadingParser {
    /// Creates a parser of `source`.
    pub fn new(source: &str, columns: &Columns) -> Self {
        let lines = Lines::new(source, Reading::of(columns, Origin::Stream));
        Self { lines, columns: columns.clone(), clock: Clock::default(), time_s: None }
    }

    /// Time of the last reading in seconds.
    pub fn time_s(&self) -> Option<f64> {
        self.time_s
    }

    /// True with a time column.
    pub fn has_time(&self) -> bool {
        self.lines.fields().is_some_and(|(_, time)| time.0.is_some())
    }
}

impl LineParser for ReadingParser {
    /// Values in SI units.
    type Values = Vec<f64>;

    fn parse_line(&mut self, line: &[u8]) -> Result<Option<Vec<f64>>, CsvError> {
        let Self { lines, columns, clock, time_s } = self;
        let next = lines.next(line, |head| {
            Ok((ChannelFields::find(head, columns)?, TimeField::find_optional(head, columns)?))
        })?;
        let Some((mut cells, (channels, time))) = next else { return Ok(None) };
        let reading = channels.checked_reading(&mut cells)?;
        // A reading without a valid time is still valid.
        *time_s = time.read(&mut cells, clock).unwrap_or(None);
        Ok(Some(reading))
    }

    fn progress(&mut self) -> &mut dyn LineProgress {
        &mut self.lines
    }
}

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

    /// A stream cannot wait for later numbers, so ambiguous thousands are an error at once.
    fn checked_reading(&self, cells: &mut Cells) -> Result<Vec<f64>, CsvError> {
        let reading = self.reading(cells)?;
        self.0.iter().try_for_each(|(index, _)| cells.check_grouping(*index))?;
        Ok(reading)
    }
}

pub(super) const TIME: &str = "time_s";

pub(super) const SECOND: [&str; 2] = ["position_2_mm", "force_2_n"];

/// Recording of moving contacts; [`read`] ignores the columns of a second contact.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedRecording {
    /// Rows.
    pub recording: Recording,
    /// Times in seconds.
    pub times_s: Vec<f64>,
    /// Second contacts; empty for a single contact.
    pub second: Vec<Contact>,
}

impl TimedRecording {
    /// True contacts of rows with a force.
    pub fn truths(&self) -> Vec<Vec<Contact>> {
        let rows = self.recording.rows.iter().enumerate();
        let all = rows.filter_map(|(i, row)| {
            row.contact().map(|first| std::iter::once(first).chain(self.second.get(i).copied()).collect())
        });
        all.collect()
    }
}

/// Timed reading.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedReading {
    /// Time in seconds.
    pub time_s: Option<f64>,
    /// True contacts, with force 0 if untouched.
    pub truth: Option<Vec<Contact>>,
    /// Values in SI units.
    pub reading: Vec<f64>,
}

/// Parser of timed readings; only channel columns are required.
pub struct TimedParser<'a> {
    lines: Lines<TimedFields>,
    clock: Clock,
    schema: Schema<'a>,
}

#[derive(Clone, Debug)]
struct TimedFields {
    time: TimeField,
    contact: Option<ContactFields>,
    second: Option<(usize, usize)>,
    channels: ChannelFields,
}

impl<'a> TimedParser<'a> {
    /// Creates a parser of `source`.
    pub fn new(source: &str, schema: Schema<'a>) -> Self {
        let lines = Lines::new(source, Reading::of(schema.columns, Origin::Stream));
        Self { lines, clock: Clock::default(), schema }
    }

    /// True with a time column.
    pub fn has_time(&self) -> bool {
        self.lines.fields().is_some_and(|fields| fields.time.0.is_some())
    }
}

impl LineParser for TimedParser<'_> {
    type Values = TimedReading;

    fn parse_line(&mut self, line: &[u8]) -> Result<Option<TimedReading>, CsvError> {
        let Self { lines, clock, schema } = self;
        let next = lines.next(line, |head| TimedFields::find(head, schema))?;
        let Some((mut cells, fields)) = next else { return Ok(None) };
        let time_s = fields.time.read(&mut cells, clock)?;
        let contact = fields.contact.as_ref();
        let row = contact.map(|contact| contact.row(&mut cells, schema, time_s)?.into_row()).transpose()?;
        // An unknown force is not 0: the surface is touched.
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
        Ok(Some(TimedReading { time_s, truth, reading: fields.channels.checked_reading(&mut cells)? }))
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
            time: TimeField::find_optional(head, columns)?,
            contact: if named { ContactFields::find(head, columns).ok() } else { None },
            channels: ChannelFields::find(head, columns)?,
        })
    }
}
