//! Fields of one CSV line.

use super::columns::{Column, Header, ValueColumn};
use super::csv_error::{CsvError, CsvProblem};
use super::dialect::Dialect;
use super::grouping::{Groupings, Place};
use super::heading::Heading;
use super::marks::Separator;
use super::timestamp::Clock;
use super::untouched::is_mark;
use palpate_mechanics::units::{Dimension, Unit};
use std::borrow::Cow;
use std::ops::Range;

pub(super) struct Cells<'a> {
    line: usize,
    text: &'a str,
    fields: Vec<Field<'a>>,
    dialect: &'a mut Dialect,
    groupings: &'a mut Groupings,
}

impl<'a> Cells<'a> {
    pub fn parse(
        line: usize,
        text: &'a str,
        dialect: &'a mut Dialect,
        groupings: &'a mut Groupings,
    ) -> Result<Self, CsvError> {
        match split(text, dialect.separator) {
            Ok(fields) => Ok(Self { line, text, fields, dialect, groupings }),
            Err(open) => Err(CsvProblem::OpenQuote.in_line(&dialect.source, line, text.to_owned(), open)),
        }
    }

    /// Fields that belong to no line.
    pub fn of_texts(texts: &'a [String], dialect: &'a mut Dialect, groupings: &'a mut Groupings) -> Self {
        let field = |text: &'a String| Field { value: Cow::Borrowed(text), span: 0..0 };
        Self { line: 0, text: "", fields: texts.iter().map(field).collect(), dialect, groupings }
    }

    pub fn dialect(&self) -> &Dialect {
        self.dialect
    }

    pub fn note_units(&mut self) {
        self.dialect.units_line = Some(self.line);
    }

    pub fn note_line(&mut self) {
        self.dialect.note_line(self.line, self.text);
    }

    pub fn check_grouping(&self, index: usize) -> Result<(), CsvError> {
        self.groupings.ambiguity_in(index, &self.dialect.source).map_or(Ok(()), Err)
    }

    pub fn width(&self) -> usize {
        self.fields.len()
    }

    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|field| field.value.as_ref())
    }

    pub fn is_blank(&self) -> bool {
        self.fields.iter().all(|field| field.value.is_empty())
    }

    /// Further empty fields at the end are allowed.
    pub fn check_width(&self, expected: usize) -> Result<(), CsvError> {
        let beyond = self.fields.get(expected..);
        match self.width() {
            found if found == expected => Ok(()),
            _ if beyond.is_some_and(|beyond| beyond.iter().all(|field| field.value.is_empty())) => Ok(()),
            found if beyond.is_some() && self.is_split_at_decimals() => {
                Err(self.line_error(CsvProblem::CutDecimals { found, expected }))
            }
            found if self.dialect.separator == Separator::Blanks => {
                Err(self.line_error(CsvProblem::RowLengthBetweenBlanks { found, expected }))
            }
            found => Err(self.line_error(CsvProblem::RowLength { found, expected })),
        }
    }

    /// Commas may have split numbers at their decimal commas.
    fn is_split_at_decimals(&self) -> bool {
        let whole = |field: &Field| field.value.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
        self.dialect.separator == Separator::Comma && self.fields.iter().all(whole)
    }

    /// Field of a column of values, checked against the unit in the heading; `key` is the rig's key of the
    /// unit.
    pub fn find_values(
        &mut self,
        values: &ValueColumn,
        key: &'static str,
        header: Header,
    ) -> Result<usize, CsvError> {
        let index = self.find(&values.column, header)?;
        let text = self.fields[index].value.as_ref();
        let heading = Heading::parse(text);
        let exact = matches!(&values.column, Column::Name(name) if name == text);
        let agrees = match (heading.unit, heading.known_unit()) {
            _ if header == Header::Absent || values.unit == Unit::NONE => true,
            (None, _) => true,
            (Some(_), Some(unit)) => {
                (unit.dimension(), unit.factor()) == (values.unit.dimension(), values.unit.factor())
            }
            // Text outside brackets is not necessarily a unit. A rig with the complete heading has accepted its unit.
            (Some(_), None) => exact || !text.ends_with(']') || values.unit.dimension() == Dimension::Time,
        };
        if agrees {
            self.dialect.units_in_header |= heading.unit.is_some() && !exact && header == Header::Present;
            return Ok(index);
        }
        let said = heading.unit.unwrap_or_default().to_owned();
        Err(self.error(index, CsvProblem::OtherUnit { heading_unit: said, read_as: values.unit, key }))
    }

    /// Field by heading, with or without the unit, or by number.
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
            (None, _) => self.find_without_unit(name),
        }
    }

    fn find_without_unit(&self, name: String) -> Result<usize, CsvError> {
        let named = |i: &usize| Heading::parse(&self.fields[*i].value).name == name.as_str();
        let mut named = (0..self.width()).filter(named);
        match (named.next(), named.next()) {
            (Some(index), None) => Ok(index),
            (Some(first), Some(second)) => {
                let example = self.fields[first].value.to_string();
                let problem = CsvProblem::ManyUnits { name, first: first + 1, second: second + 1, example };
                Err(self.error(second, problem))
            }
            (None, _) => {
                let present = self.fields.iter().map(|field| field.value.clone().into_owned()).collect();
                Err(self.line_error(CsvProblem::MissingColumn { wanted: name, present }))
            }
        }
    }

    pub fn has(&self, column: &Column) -> bool {
        match column {
            Column::Name(name) => self.fields.iter().any(|field| {
                field.value == name.as_str() || Heading::parse(&field.value).name == name.as_str()
            }),
            Column::Number(number) => (1..=self.width()).contains(number),
        }
    }

    /// Finite number in SI units.
    pub fn number(&mut self, index: usize, unit: Unit) -> Result<f64, CsvError> {
        let value = self.read(index, |text, dialect| dialect.number(text, unit))?;
        if !self.groupings.is_decided(index) {
            let (line, text) = (self.line, self.text);
            let Field { value, span } = &self.fields[index];
            let place = || Place { line, column: index + 1, text: text.to_owned(), span: span.clone() };
            self.groupings.insert(index, value, place);
        }
        Ok(value)
    }

    pub fn is_empty(&self, index: usize) -> bool {
        self.fields.get(index).is_none_or(|field| field.value.is_empty())
    }

    pub fn is_marked(&self, index: usize) -> Result<bool, CsvError> {
        let text = self.fields.get(index).map_or("", |field| field.value.as_ref());
        is_mark(text).ok_or_else(|| self.error(index, CsvProblem::NotAMark { text: text.to_owned() }))
    }

    pub fn count_without_position(&mut self) {
        self.dialect.without_position += 1;
    }

    pub fn time(&mut self, index: usize, unit: Unit, clock: &mut Clock) -> Result<f64, CsvError> {
        self.read(index, |text, dialect| clock.read(text, || dialect.number(text, unit)))
    }

    fn read(
        &mut self,
        index: usize,
        parse: impl FnOnce(&str, &mut Dialect) -> Result<f64, CsvProblem>,
    ) -> Result<f64, CsvError> {
        let Some(field) = self.fields.get(index) else {
            return Err(self.line_error(CsvProblem::RowLength { found: self.width(), expected: index + 1 }));
        };
        parse(&field.value, self.dialect).map_err(|problem| self.error(index, problem))
    }

    pub fn error(&self, index: usize, problem: CsvProblem) -> CsvError {
        let mut error = self.line_error(problem);
        if let Some(place) = &mut error.place {
            place.column = Some(index + 1);
            place.span = self.fields.get(index).map_or(place.span.clone(), |field| field.span.clone());
        }
        error
    }

    pub fn line_error(&self, problem: CsvProblem) -> CsvError {
        problem.in_line(&self.dialect.source, self.line, self.text.to_owned(), 0..self.text.len())
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field<'a> {
    pub value: Cow<'a, str>,
    pub span: Range<usize>,
}

/// Splits at separators outside double quotes (RFC 4180, but a field ends with its line). The error is the
/// range from an unclosed quote.
pub(super) fn split(line: &str, separator: Separator) -> Result<Vec<Field<'_>>, Range<usize>> {
    if separator == Separator::Blanks {
        return split_at_blanks(line);
    }
    let (bytes, separator) = (line.as_bytes(), separator.byte());
    let is_space = |b: &&u8| matches!(b, b' ' | b'\t') && **b != separator;
    let mut fields = Vec::new();
    let mut start = 0;
    loop {
        let opening = start + bytes[start..].iter().take_while(is_space).count();
        let end = if bytes.get(opening) == Some(&b'"') {
            end_of_field(bytes, closing_quote(bytes, opening).ok_or(opening..bytes.len())?, |b| {
                b == separator
            })
        } else {
            end_of_field(bytes, opening, |b| b == separator)
        };
        fields.push(field(line, start..end));
        if end == bytes.len() {
            return Ok(fields);
        }
        start = end + 1;
    }
}

/// A unit in brackets belongs to the name before it: `Force [N]` is one field, `[mm] [N]` are two.
fn split_at_blanks(line: &str) -> Result<Vec<Field<'_>>, Range<usize>> {
    let bytes = line.as_bytes();
    let is_blank = |b: u8| matches!(b, b' ' | b'\t');
    let is_unit = |text: &str| text.starts_with(['[', '(']) && text.ends_with([']', ')']);
    let mut fields: Vec<Field<'_>> = Vec::new();
    let mut start = 0;
    loop {
        start += bytes[start..].iter().take_while(|b| is_blank(**b)).count();
        if start == bytes.len() {
            break;
        }
        let from = match bytes[start] {
            b'"' => closing_quote(bytes, start).ok_or(start..bytes.len())?,
            _ => start,
        };
        let end = end_of_field(bytes, from, is_blank);
        let next = field(line, start..end);
        match fields.last_mut() {
            Some(name) if is_unit(&next.value) && !name.value.ends_with([']', ')']) => {
                *name = field(line, name.span.start..end);
            }
            _ => fields.push(next),
        }
        start = end;
    }
    if fields.is_empty() {
        fields.push(field(line, 0..0));
    }
    Ok(fields)
}

fn end_of_field(bytes: &[u8], from: usize, is_separator: impl Fn(u8) -> bool) -> usize {
    from + bytes[from..].iter().take_while(|b| !is_separator(**b)).count()
}

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
