//! Dialects of CSV files.
//!
//! The first line determines the separator, the first number with a mark the decimal mark. Ambiguous text is
//! an error.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::csv_error::CsvProblem;
use super::grouping::is_grouped_number;
use super::marks::{Decimal, Separator};
use super::zero_force::ZeroForce;
use palpate_mechanics::units::Unit;

/// Dialect of a file, displayed as in `semicolons, decimal commas, units in the header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dialect {
    /// File name.
    pub source: String,
    /// Field separator.
    pub separator: Separator,
    /// Decimal mark; `None` for whole numbers.
    pub decimal: Option<Decimal>,
    /// First number with a mark that may separate thousands.
    #[serde(rename = "doubtful")]
    pub ambiguous_number: Option<String>,
    /// True if names matched without units.
    pub units_in_header: bool,
    /// True for Windows-1252.
    pub windows_1252: bool,
    /// Rows untouched only by their missing position.
    #[serde(default)]
    pub without_position: usize,
    /// True for UTF-16.
    #[serde(default, skip_serializing_if = "is_false")]
    pub utf16: bool,
    /// Lines above the heading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preamble: Option<Preamble>,
    /// Line of the units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units_line: Option<usize>,
    /// Lines below the heading that are not rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<Notes>,
    /// Forces recognised as 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero_force: Option<ZeroForce>,
}

/// Lines above a heading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Preamble {
    /// Number.
    pub lines: usize,
    /// Heading line.
    pub heading_line: usize,
}

/// Lines below the heading that are not rows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Notes {
    /// Number.
    pub lines: usize,
    /// First line.
    pub first_line: usize,
    /// Beginning of its text.
    pub text: String,
}

// serde passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(value: &bool) -> bool {
    !*value
}

impl Dialect {
    pub(super) fn new(source: &str, decimal: Option<Decimal>) -> Self {
        Self { source: source.to_owned(), decimal, ..Self::default() }
    }

    /// True for plain CSV.
    pub fn is_plain(&self) -> bool {
        let plain = Self {
            source: self.source.clone(),
            decimal: self.decimal.filter(|decimal| *decimal == Decimal::Point),
            ..Self::default()
        };
        *self == plain
    }

    pub(super) fn note_preamble(&mut self, heading_line: usize, lines: usize) {
        self.preamble = (lines > 0).then_some(Preamble { lines, heading_line });
    }

    pub(super) fn note_line(&mut self, line: usize, text: &str) {
        const MOST: usize = 40;
        let shown = || text.chars().map(|c| if c.is_control() { ' ' } else { c });
        let cut = if shown().count() > MOST { "…" } else { "" };
        let text = || shown().take(MOST).collect::<String>().trim().to_owned() + cut;
        let first = || Notes { lines: 0, first_line: line, text: text() };
        self.notes.get_or_insert_with(first).lines += 1;
    }

    /// Finite number in SI units.
    pub(super) fn number(&mut self, text: &str, unit: Unit) -> Result<f64, CsvProblem> {
        let commas = text.bytes().filter(|byte| *byte == b',').count();
        let parsed = match commas {
            0 => unit.parse_si(text),
            1 if !text.contains('.') => unit.parse_si(&text.replace(',', ".")),
            _ => None,
        };
        let text_of = || text.to_owned();
        match parsed {
            Some(value) if value.is_finite() => {
                if commas == 1 {
                    self.add_decimal(Decimal::Comma, text)?;
                } else if (self.decimal, &self.ambiguous_number) != (Some(Decimal::Point), &None)
                    && text.contains('.')
                {
                    self.add_decimal(Decimal::Point, text)?;
                }
                Ok(value)
            }
            Some(_) => Err(CsvProblem::NotFinite { text: text_of() }),
            None if text.is_empty() => Err(CsvProblem::EmptyField),
            None if has_thousands(text) => Err(CsvProblem::Thousands { text: text_of() }),
            None => Err(CsvProblem::NotANumber { text: text_of() }),
        }
    }

    fn add_decimal(&mut self, mark: Decimal, text: &str) -> Result<(), CsvProblem> {
        let doubtful = is_grouped_number(text);
        match self.decimal {
            Some(decimal) if decimal != mark => {
                return Err(CsvProblem::OtherDecimal { text: text.to_owned(), decimal });
            }
            Some(_) if doubtful => return Ok(()),
            Some(_) => {}
            // Between commas, the comma of a quoted number may separate thousands.
            None if doubtful && mark == Decimal::Comma && self.separator == Separator::Comma => {
                return Err(CsvProblem::DoubtfulNumber { text: text.to_owned() });
            }
            None => self.decimal = Some(mark),
        }
        // Plain files have decimal points; with semicolons, a point may separate thousands.
        let doubtful = doubtful && (mark == Decimal::Comma || self.separator == Separator::Semicolon);
        self.ambiguous_number = doubtful.then(|| text.to_owned());
        Ok(())
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words = Vec::new();
        if self.separator != Separator::Comma {
            words.push(self.separator.to_string());
        }
        match (self.decimal, &self.ambiguous_number) {
            (Some(decimal), Some(text)) => {
                let (number, whole) = (text.replace(',', "."), text.replace([',', '.'], ""));
                words.push(format!("{decimal} ({text} is {number}, not {whole})"));
            }
            (Some(Decimal::Comma), None) => words.push(Decimal::Comma.to_string()),
            _ => {}
        }
        if self.units_in_header {
            words.push("units in the header".to_owned());
        }
        if self.windows_1252 {
            words.push("Windows-1252 text".to_owned());
        }
        if self.utf16 {
            words.push("UTF-16 text".to_owned());
        }
        if let Some(Preamble { lines, heading_line }) = self.preamble {
            words
                .push(format!("heading on line {heading_line}, {} above it skipped", counted(lines, "line")));
        }
        if let Some(line) = self.units_line {
            words.push(format!("units on line {line}"));
        }
        if let Some(Notes { lines, first_line, text }) = &self.notes {
            let first = if *lines == 1 { "" } else { "first " };
            words.push(format!(
                "{} without a reading skipped ({first}line {first_line}: `{text}`)",
                counted(*lines, "line")
            ));
        }
        match self.without_position {
            0 => {}
            1 => words.push("1 row without a position, taken as untouched".to_owned()),
            count => words.push(format!("{count} rows without a position, taken as untouched")),
        }
        words.extend(self.zero_force.map(|zero| zero.to_string()));
        f.write_str(&words.join(", "))
    }
}

fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Number with several points or commas.
fn has_thousands(text: &str) -> bool {
    let number: String = text.chars().filter(|c| !matches!(c, ',' | '.')).collect();
    let marks = text.len() - number.len();
    marks > 1
        && number.parse::<f64>().is_ok_and(f64::is_finite)
        && text.starts_with(|c: char| !",.".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(separator: Separator, texts: &[&str]) -> String {
        let mut dialect = Dialect { separator, ..Dialect::default() };
        let numbers: Result<Vec<f64>, _> =
            texts.iter().map(|text| dialect.number(text, Unit::NONE)).collect();
        match numbers {
            Ok(numbers) => format!("{numbers:?} {dialect}"),
            Err(problem) => problem.to_string(),
        }
    }

    #[test]
    fn the_first_mark_holds() {
        use Separator::{Comma, Semicolon, Tab};
        let lines = [
            said(Comma, &["1", "1.234", "-2.5e-3"]),
            said(Semicolon, &["1", "1,5", "0,234"]),
            said(Semicolon, &["1,234"]),
            said(Semicolon, &["1,234", "1,5"]),
            said(Semicolon, &["0,234"]),
            said(Semicolon, &["1.234"]),
            said(Semicolon, &["1.234", "1.5"]),
            said(Tab, &["1.234"]),
            said(Tab, &["1,5", "1.5"]),
            said(Semicolon, &["1.234", "1,5"]),
            said(Semicolon, &["1.234,5"]),
            said(Semicolon, &["1,234,567"]),
            said(Comma, &["1,5", "-12,25e3"]),
            said(Comma, &["1,234"]),
            said(Comma, &["one"]),
            said(Comma, &["1,2,x"]),
            said(Semicolon, &["1e999"]),
            said(Semicolon, &[","]),
            said(Semicolon, &[""]),
        ];
        insta::assert_snapshot!(lines.join("\n"));
    }

    #[test]
    fn numbers_with_commas_are_those_with_points_to_the_last_bit() {
        let mm = Unit::from_symbol("mm").unwrap();
        for number in ["0.1", "123.456789012345678", "-7.000000000000001e-12", "3.", ".5"] {
            let plain = mm.parse_si(number).unwrap();
            let mut dialect = Dialect { separator: Separator::Semicolon, ..Dialect::default() };
            assert_eq!(dialect.number(&number.replace('.', ","), mm).unwrap().to_bits(), plain.to_bits());
        }
    }
}
