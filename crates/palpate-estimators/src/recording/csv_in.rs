//! Reading recordings from CSV.

use std::io::Read;

use super::cells::Cells;
use super::columns::{Columns, Frame, Header, Need, PositionColumns};
use super::csv_error::{CsvError, CsvProblem, Place};
use super::lines::{is_passed_over, without_mark};
use super::reading_parser::ChannelFields;
use super::{Provenance, Recording, Row, sha256_hex};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

/// What a file must agree with to be a recording of a bench.
#[derive(Clone, Copy, Debug)]
pub struct Schema<'a> {
    /// Which column is what.
    pub columns: &'a Columns,
    /// The sensors; as many as `columns` has channels.
    pub layout: &'a Layout,
    /// Where contacts can be.
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
    let find = |head: &Cells| {
        Ok((ContactFields::find(head, schema.columns)?, ChannelFields::find(head, schema.columns)?))
    };
    let rows = file.rows(schema.columns.header, find, |cells, (contact, channels)| {
        let Touch { position, force_n, nuisance } = contact.touch(cells, schema)?;
        Ok(Row { position, force_n, nuisance, reading: channels.reading(cells)? })
    })?;
    Ok(schema.recording(source.to_owned(), rows, vec![file.digest]))
}

/// Reads a recording from two CSV files, of readings and of contacts, that pair row by row; the position and force
/// columns are those of the second file. `readings` and `contacts` are each a name and its bytes.
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
    let (columns, header) = (schema.columns, schema.columns.header);

    let reading_rows = readings.rows(
        header,
        |head| ChannelFields::find(head, columns),
        |cells, channels| channels.reading(cells),
    )?;
    let contact_rows = contacts.rows(
        header,
        |head| ContactFields::find(head, columns),
        |cells, contact| contact.touch(cells, schema),
    )?;
    if reading_rows.len() != contact_rows.len() {
        let problem = CsvProblem::RowsDiffer { readings: reading_rows.len(), contacts: contact_rows.len() };
        return Err(problem.of_file(contacts.source));
    }
    let rows = reading_rows.into_iter().zip(contact_rows);
    let row = |(reading, Touch { position, force_n, nuisance })| Row { position, force_n, nuisance, reading };
    let rows = rows.map(row).collect();
    Ok(schema.recording(source, rows, vec![readings.digest, contacts.digest]))
}

impl Schema<'_> {
    fn check(&self, source: &str) -> Result<(), CsvError> {
        let (columns, sensors) = (self.columns.channels.len(), self.layout.len());
        if columns == sensors {
            Ok(())
        } else {
            Err(CsvProblem::ChannelCount { columns, sensors }.of_file(source))
        }
    }

    fn recording(&self, source: String, rows: Vec<Row>, digests: Vec<String>) -> Recording {
        let provenance = Provenance { source, rows: rows.len(), digests, seed: None };
        Recording { channels: self.layout.names(), kinds: self.layout.kinds(), rows, provenance }
    }
}

/// A file in memory.
struct File<'s> {
    source: &'s str,
    text: String,
    digest: String,
}

impl<'s> File<'s> {
    fn read(source: &'s str, mut bytes: impl Read) -> Result<Self, CsvError> {
        let mut content = Vec::new();
        bytes.read_to_end(&mut content).map_err(|error| CsvProblem::Unreadable(error).of_file(source))?;
        let digest = sha256_hex(&content);
        let text = String::from_utf8(content).map_err(|error| not_utf8(source, &error))?;
        Ok(Self { source, text, digest })
    }

    /// Every row, read by `row`, after `find` has found the columns in the first line.
    fn rows<C, T>(
        &self,
        header: Header,
        find: impl Fn(&Cells) -> Result<C, CsvError>,
        row: impl Fn(&Cells, &C) -> Result<T, CsvError>,
    ) -> Result<Vec<T>, CsvError> {
        let lines = without_mark(&self.text).lines().enumerate();
        let mut lines = lines
            .filter(|(_, text)| !is_passed_over(text))
            .map(|(i, text)| Cells::parse(self.source, i + 1, text));
        let head = lines.next().ok_or_else(|| CsvProblem::Empty.of_file(self.source))??;
        let columns = find(&head)?;
        let first = match header {
            Header::Present => None,
            Header::Absent => Some(row(&head, &columns)?),
        };
        let mut rows: Vec<T> = first.into_iter().collect();
        for cells in lines {
            let cells = cells?;
            cells.check_width(head.width())?;
            rows.push(row(&cells, &columns)?);
        }
        if rows.is_empty() { Err(CsvProblem::NoRows.of_file(self.source)) } else { Ok(rows) }
    }
}

fn not_utf8(source: &str, error: &std::string::FromUtf8Error) -> CsvError {
    let (good, rest) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
    let line = 1 + good.iter().filter(|byte| **byte == b'\n').count();
    let start = good.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
    let before = String::from_utf8_lossy(&good[start..]).into_owned();
    let after =
        String::from_utf8_lossy(rest.split(|byte| *byte == b'\n').next().unwrap_or(rest)).into_owned();
    let mark = before.len()..before.len() + after.chars().next().map_or(0, char::len_utf8);
    CsvProblem::NotUtf8.at(source, Place { line, column: None, text: before + &after, span: mark })
}

/// What a row says of its contact.
pub(super) struct Touch {
    pub position: Position,
    pub force_n: Option<f64>,
    nuisance: Option<f64>,
}

/// Which fields of a row say where and how hard the contact was.
#[derive(Clone, Debug)]
pub(super) struct ContactFields {
    x: usize,
    y: Option<usize>,
    position_unit: Unit,
    frame: Frame,
    force: Option<(usize, Unit)>,
    nuisance: Option<(usize, Unit)>,
}

impl ContactFields {
    pub fn find(head: &Cells, columns: &Columns) -> Result<Self, CsvError> {
        let find = |column| head.find(column, columns.header);
        let (x, y) = match &columns.position {
            PositionColumns::Along(x) => (find(x)?, None),
            PositionColumns::Plane { x, y } => (find(x)?, Some(find(y)?)),
        };
        let force = match &columns.force {
            Some(force) if force.need == Need::Required || head.has(&force.values.column) => {
                Some((find(&force.values.column)?, force.values.unit))
            }
            _ => None,
        };
        let nuisance = columns.nuisance.as_ref().map(|nuisance| Ok((find(&nuisance.column)?, nuisance.unit)));
        let (position_unit, frame) = (columns.position_unit, columns.frame);
        Ok(Self { x, y, position_unit, frame, force, nuisance: nuisance.transpose()? })
    }

    pub fn touch(&self, cells: &Cells, schema: &Schema) -> Result<Touch, CsvError> {
        let x_m = cells.number(self.x, self.position_unit)?;
        let y_m = self.y.map_or(Ok(0.0), |y| cells.number(y, self.position_unit))?;
        let position = self.frame.position(x_m, y_m);
        let extent = schema.extent;
        if !extent.contains(position) {
            let across = self.y.filter(|_| extent.contains(Position::along(position.x_m)));
            return Err(cells.error(across.unwrap_or(self.x), CsvProblem::OffSurface { position, extent }));
        }
        let force_n = self.force.map(|(field, unit)| cells.number(field, unit)).transpose()?;
        let nuisance = self.nuisance.map(|(field, unit)| cells.number(field, unit)).transpose()?;
        Ok(Touch { position, force_n: force_n.or(schema.known_force_n), nuisance })
    }
}
