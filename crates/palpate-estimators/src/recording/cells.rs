//! The fields of one line, found and read with errors that know their place.

use super::columns::{Column, Header};
use super::csv_error::{CsvError, CsvProblem};
use super::timestamp::Clock;
use palpate_mechanics::units::Unit;
use std::borrow::Cow;
use std::ops::Range;

/// One line of a CSV file, cut into fields.
pub(super) struct Cells<'a> {
    source: &'a str,
    line: usize,
    text: &'a str,
    fields: Vec<Field<'a>>,
}

impl<'a> Cells<'a> {
    /// Cuts line number `line` of `source`.
    pub fn parse(source: &'a str, line: usize, text: &'a str) -> Result<Self, CsvError> {
        match split(text) {
            Ok(fields) => Ok(Self { source, line, text, fields }),
            Err(open) => Err(CsvProblem::OpenQuote.in_line(source, line, text.to_owned(), open)),
        }
    }

    /// Number of fields.
    pub fn width(&self) -> usize {
        self.fields.len()
    }

    /// Refuses a row that has more or fewer fields than `expected`.
    pub fn check_width(&self, expected: usize) -> Result<(), CsvError> {
        match self.width() {
            found if found == expected => Ok(()),
            found => Err(self.line_error(CsvProblem::RowLength { found, expected })),
        }
    }

    /// Index of `column` among the fields of every line, from this first line of the file.
    pub fn find(&self, column: &Column, header: Header) -> Result<usize, CsvError> {
        let count = self.width();
        let name = match column {
            Column::Number(number) if (1..=count).contains(number) => return Ok(number - 1),
            Column::Number(wanted) => {
                return Err(self.line_error(CsvProblem::NoSuchColumn { wanted: *wanted, count }));
            }
            Column::Name(name) => name.clone(),
        };
        if header == Header::Absent {
            return Err(self.line_error(CsvProblem::NameWithoutHeader { wanted: name, count }));
        }
        let mut same = (0..count).filter(|i| self.fields[*i].value == name.as_str());
        match (same.next(), same.next()) {
            (Some(index), None) => Ok(index),
            (Some(first), Some(second)) => {
                let problem = CsvProblem::DuplicateColumn { name, first: first + 1, second: second + 1 };
                Err(self.error(second, problem))
            }
            (None, _) => {
                let present = self.fields.iter().map(|field| field.value.clone().into_owned()).collect();
                Err(self.line_error(CsvProblem::MissingColumn { wanted: name, present }))
            }
        }
    }

    /// Whether some field is called `column`, or has its number.
    pub fn has(&self, column: &Column) -> bool {
        match column {
            Column::Name(name) => self.fields.iter().any(|field| field.value == name.as_str()),
            Column::Number(number) => (1..=self.width()).contains(number),
        }
    }

    /// The finite number in field `index`, in SI units.
    pub fn number(&self, index: usize, unit: Unit) -> Result<f64, CsvError> {
        let Some(field) = self.fields.get(index) else {
            return Err(self.line_error(CsvProblem::RowLength { found: self.width(), expected: index + 1 }));
        };
        match unit.parse_si(&field.value) {
            Some(value) if value.is_finite() => Ok(value),
            Some(_) => Err(self.error(index, CsvProblem::NotFinite { text: field.value.to_string() })),
            None if field.value.is_empty() => Err(self.error(index, CsvProblem::EmptyField)),
            None => Err(self.error(index, CsvProblem::NotANumber { text: field.value.to_string() })),
        }
    }

    /// The time in field `index`, in seconds.
    pub fn time(&self, index: usize, unit: Unit, clock: &mut Clock) -> Result<f64, CsvError> {
        let Some(field) = self.fields.get(index) else {
            return Err(self.line_error(CsvProblem::RowLength { found: self.width(), expected: index + 1 }));
        };
        clock.read(&field.value, unit).map_err(|problem| self.error(index, problem))
    }

    /// A problem with field `index`.
    pub fn error(&self, index: usize, problem: CsvProblem) -> CsvError {
        let mut error = self.line_error(problem);
        if let Some(place) = &mut error.place {
            place.column = Some(index + 1);
            place.span = self.fields.get(index).map_or(place.span.clone(), |field| field.span.clone());
        }
        error
    }

    /// A problem with the whole line.
    fn line_error(&self, problem: CsvProblem) -> CsvError {
        problem.in_line(self.source, self.line, self.text.to_owned(), 0..self.text.len())
    }
}

/// One field: its value, and the bytes of the line it came from.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field<'a> {
    /// The value, without the spaces and quotes around it.
    pub value: Cow<'a, str>,
    /// Its place in the line, spaces around it left out.
    pub span: Range<usize>,
}

/// Cuts `line` at its commas, except within double quotes; a doubled quote within quotes is a quote (RFC 4180, but
/// a field ends with its line, so that every row has one line number). The error is what follows a quote that stays open.
pub(super) fn split(line: &str) -> Result<Vec<Field<'_>>, Range<usize>> {
    let bytes = line.as_bytes();
    let mut fields = Vec::new();
    let mut start = 0;
    loop {
        let opening = start + bytes[start..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
        let end = if bytes.get(opening) == Some(&b'"') {
            comma(bytes, closing_quote(bytes, opening).ok_or(opening..bytes.len())?)
        } else {
            comma(bytes, opening)
        };
        fields.push(field(line, start..end));
        if end == bytes.len() {
            return Ok(fields);
        }
        start = end + 1;
    }
}

fn comma(bytes: &[u8], from: usize) -> usize {
    from + bytes[from..].iter().take_while(|b| **b != b',').count()
}

/// The first byte after the quoted text that begins at `opening`.
fn closing_quote(bytes: &[u8], opening: usize) -> Option<usize> {
    let mut at = opening + 1;
    loop {
        at += bytes.get(at..)?.iter().position(|b| *b == b'"')?;
        if bytes.get(at + 1) != Some(&b'"') {
            return Some(at + 1);
        }
        at += 2;
    }
}

fn field(line: &str, range: Range<usize>) -> Field<'_> {
    let text = &line[range.clone()];
    let trimmed = text.trim();
    let start = range.start + (text.len() - text.trim_start().len());
    let value = match trimmed.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) {
        Some(inside) if inside.contains("\"\"") => Cow::Owned(inside.replace("\"\"", "\"").trim().to_owned()),
        Some(inside) => Cow::Borrowed(inside.trim()),
        None => Cow::Borrowed(trimmed),
    };
    Field { value, span: start..start + trimmed.len() }
}
