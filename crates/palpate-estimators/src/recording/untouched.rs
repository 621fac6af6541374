//! Marks of untouched rows.

use palpate_mechanics::units::{Dimension, Quantity};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Closed time span.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeSpan {
    /// Start in seconds, optional.
    pub from_s: Option<f64>,
    /// End in seconds, optional.
    pub to_s: Option<f64>,
}

impl TimeSpan {
    /// True within the span.
    pub fn contains(&self, time_s: f64) -> bool {
        self.from_s.is_none_or(|from_s| from_s <= time_s) && self.to_s.is_none_or(|to_s| time_s <= to_s)
    }
}

impl fmt::Display for TimeSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = |time_s: Option<f64>| time_s.map_or_else(String::new, |time_s| format!("{time_s} s"));
        write!(f, "{}..{}", end(self.from_s), end(self.to_s))
    }
}

/// Invalid time span.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a span of time{}; write it as in \"0 s..10 s\", \"95 s..\" or \"..2 min\"",
    reason(because)
)]
pub struct TimeSpanError {
    /// Text.
    pub text: String,
    /// Reason, or empty.
    pub because: String,
}

fn reason(because: &str) -> String {
    if because.is_empty() { String::new() } else { format!(" ({because})") }
}

impl FromStr for TimeSpan {
    type Err = TimeSpanError;

    /// Parses `0 s..10 s`, `0..10 s`, `95 s..` and `..2 min`.
    fn from_str(text: &str) -> Result<Self, TimeSpanError> {
        let refuse = |because: String| TimeSpanError { text: text.to_owned(), because };
        let (from, to) = text.split_once("..").ok_or_else(|| refuse(String::new()))?;
        let [from_s, to_s] =
            Quantity::parse_span([from, to], Dimension::Time).map_err(|error| refuse(error.to_string()))?;
        match (from_s, to_s) {
            (None, None) => Err(refuse("it has neither a beginning nor an end".to_owned())),
            (Some(from_s), Some(to_s)) if from_s > to_s => {
                Err(refuse(format!("{from_s} s is later than {to_s} s")))
            }
            (from_s, to_s) => Ok(Self { from_s, to_s }),
        }
    }
}

/// True for yes, false for no or empty.
pub(super) fn is_mark(text: &str) -> Option<bool> {
    const YES: [&str; 7] = ["1", "true", "yes", "y", "x", "ja", "wahr"];
    const NO: [&str; 6] = ["", "0", "false", "no", "nein", "falsch"];
    let is_one_of = |words: &[&str]| words.iter().any(|word| text.eq_ignore_ascii_case(word));
    // Spreadsheets write numbers with decimals.
    let number = text.replacen(',', ".", 1).parse::<f64>().ok();
    if is_one_of(&YES) || number == Some(1.0) {
        return Some(true);
    }
    (is_one_of(&NO) || number == Some(0.0)).then_some(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_of_time_are_read_as_people_write_them() {
        let read = |text: &str| TimeSpan::from_str(text).map(|span| (span.from_s, span.to_s));
        assert_eq!(read("0 s..10 s"), Ok((Some(0.0), Some(10.0))));
        assert_eq!(read(" 0 .. 2 min"), Ok((Some(0.0), Some(120.0))));
        assert_eq!(read("95 s.."), Ok((Some(95.0), None)));
        assert_eq!(read("..500 ms"), Ok((None, Some(0.5))));
        let refused = ["10 s", "..", "5..", "0..10", "0 mm..10 s", "9 s..1 s", "nan s..1 s"];
        insta::assert_snapshot!(refused.map(|text| read(text).unwrap_err().to_string()).join("\n"));
    }

    #[test]
    fn marks_are_read_as_people_write_them() {
        assert_eq!(["1", "TRUE", "x", "Ja", "1,0"].map(is_mark), [Some(true); 5]);
        assert_eq!(["", "0", "false", "Nein", "0.00"].map(is_mark), [Some(false); 5]);
        assert_eq!(["2", "maybe"].map(is_mark), [None; 2]);
    }
}
