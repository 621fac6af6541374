//! Separators of thousands among decimal marks: `1.003` beside `503`.

use super::csv_error::{CsvError, CsvProblem};
use super::marks::Decimal;
use std::ops::Range;

/// One mark that may separate thousands: `1,234`, not `0,234`.
pub(super) fn is_grouped_number(number: &str) -> bool {
    let digits = number.trim_start_matches(['+', '-']);
    let all_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    digits.split_once([',', '.']).is_some_and(|(whole, rest)| {
        (1..=3).contains(&whole.len())
            && !whole.starts_with('0')
            && rest.len() == 3
            && all_digits(whole)
            && all_digits(rest)
    })
}

/// Columns with marks that may separate thousands.
///
/// A number that can only have a decimal mark, such as `0.5`, decides for its column. Otherwise the column is
/// ambiguous if it has whole numbers below 1000 and spans no more decades as thousands than as decimals.
#[derive(Clone, Debug, Default)]
pub(super) struct Groupings {
    is_reported: bool,
    columns: Vec<Grouping>,
}

#[derive(Clone, Debug, Default)]
struct Grouping {
    is_decided: bool,
    /// Unmarked numbers: least and greatest magnitude, text of the greatest.
    whole: Option<(f64, f64, String)>,
    /// Grouped numbers: least and greatest magnitude as decimals, place of the first.
    grouped: Option<(f64, f64, Place)>,
}

#[derive(Clone, Debug)]
pub(super) struct Place {
    pub line: usize,
    pub column: usize,
    pub text: String,
    pub span: Range<usize>,
}

impl Groupings {
    pub fn new(decimal: Option<Decimal>) -> Self {
        Self { is_reported: decimal.is_some(), columns: Vec::new() }
    }

    pub fn is_decided(&self, column: usize) -> bool {
        self.is_reported || self.columns.get(column).is_some_and(|column| column.is_decided)
    }

    pub fn insert(&mut self, column: usize, text: &str, place: impl FnOnce() -> Place) {
        if self.columns.len() <= column {
            self.columns.resize(column + 1, Grouping::default());
        }
        let Grouping { is_decided, whole, grouped } = &mut self.columns[column];
        let digits = text.trim_start_matches(['+', '-']);
        let is_grouped = is_grouped_number(text);
        // Separators of thousands are in all numbers or in none.
        *is_decided |= !is_grouped && (digits.len() > 3 || !digits.bytes().all(|byte| byte.is_ascii_digit()));
        let value = |value, digit| 10.0 * value + f64::from(digit - b'0');
        let number = digits.bytes().filter(u8::is_ascii_digit).fold(0.0, value);
        let magnitude = if is_grouped { number / 1000.0 } else { number };
        if *is_decided || magnitude == 0.0 {
            return;
        }
        if is_grouped {
            let (low, high, _) = grouped.get_or_insert_with(|| (magnitude, magnitude, place()));
            (*low, *high) = (low.min(magnitude), high.max(magnitude));
        } else {
            let (low, high, one) = whole.get_or_insert_with(|| (magnitude, magnitude, text.to_owned()));
            if magnitude > *high {
                text.clone_into(one);
            }
            (*low, *high) = (low.min(magnitude), high.max(magnitude));
        }
    }

    /// Error of the first ambiguous column.
    pub fn doubt(&self, source: &str) -> Option<CsvError> {
        if self.is_reported {
            return None;
        }
        self.columns.iter().find_map(|column| column.doubt(source))
    }

    pub fn ambiguity_in(&self, column: usize, source: &str) -> Option<CsvError> {
        self.columns.get(column).filter(|_| !self.is_reported)?.doubt(source)
    }
}

impl Grouping {
    fn doubt(&self, source: &str) -> Option<CsvError> {
        if self.is_decided {
            return None;
        }
        let ((low, high, beside), (least, greatest, place)) = (self.whole.as_ref()?, self.grouped.as_ref()?);
        let ratio = |factor: f64| high.max(greatest * factor) / low.min(least * factor);
        if ratio(1000.0) > ratio(1.0) {
            return None;
        }
        let Place { line, column, text, span } = place;
        let number = text.get(span.clone()).unwrap_or_default().trim_matches('"').trim().to_owned();
        let problem = CsvProblem::DoubtfulThousands { text: number, beside: beside.clone() };
        let mut error = problem.in_line(source, *line, text.clone(), span.clone());
        if let Some(place) = &mut error.place {
            place.column = Some(*column);
        }
        Some(error)
    }
}
