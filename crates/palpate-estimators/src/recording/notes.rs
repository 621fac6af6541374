//! Lines that are not rows: units, totals, notes.

use super::cells::split;
use super::heading::Heading;
use super::marks::Separator;
use palpate_mechanics::units::Unit;

/// An unreadable line is a note in a file, but a lost reading in a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    File,
    Stream,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LineKind {
    Row,
    Units,
    /// Repeated heading, total, name of a run.
    Note,
}

/// Missing values; their lines are rows.
const MISSING: [&str; 16] = [
    "nan", "na", "n/a", "#n/a", "null", "none", "inf", "-inf", "+inf", "infinity", "err", "error", "ol",
    "ovld", "overload", "overflow",
];

/// Computed rows of spreadsheets.
const TOTALS: [&str; 26] = [
    "total",
    "totals",
    "sum",
    "mean",
    "average",
    "avg",
    "median",
    "min",
    "max",
    "minimum",
    "maximum",
    "std",
    "sd",
    "stdev",
    "std dev",
    "rms",
    "variance",
    "count",
    "summe",
    "gesamt",
    "mittelwert",
    "mittel",
    "standardabweichung",
    "varianz",
    "anzahl",
    "ø",
];

/// Units without conversion.
const OTHER_UNITS: [&str; 26] = [
    "v", "mv", "µv", "uv", "a", "ma", "ohm", "ω", "kω", "w", "hz", "°c", "degc", "c", "k", "%", "counts",
    "count", "cts", "digits", "digit", "lsb", "raw", "a.u.", "au", "bit",
];

/// Classifies a line with at least one field that is not a value. `words` marks columns with words in the
/// last row.
pub(super) fn kind_of(
    texts: &[&str],
    heading: &[String],
    words: Option<&[bool]>,
    origin: Origin,
) -> LineKind {
    if texts.len() == heading.len() && texts.iter().zip(heading).all(|(text, heading)| text == heading) {
        return LineKind::Note;
    }
    let had_words = |i: usize| words.and_then(|words| words.get(i)).copied().unwrap_or(false);
    let filled: Vec<usize> = (0..texts.len()).filter(|i| !texts[*i].is_empty()).collect();
    let values = filled.iter().filter(|i| is_value(texts[**i])).count();
    let is_missing = |i: &usize| texts[*i].starts_with("#") || is_one_of(texts[*i], &MISSING);
    let is_total = |i: &usize| !had_words(*i) && is_one_of(texts[*i].trim_end_matches([':', '.']), &TOTALS);
    // Remarks on the right of a row may have the same words.
    if words.is_some() && filled.first().is_some_and(is_total) {
        return LineKind::Note;
    }
    if filled.iter().any(is_missing) {
        return LineKind::Row;
    }
    if values == 0 && texts.len() >= heading.len() && filled.iter().all(|i| is_unit(texts[*i])) {
        return LineKind::Units;
    }
    let is_note = match (words, origin) {
        (None, _) => values == 0,
        (Some(_), Origin::Stream) => false,
        (Some(_), Origin::File) if values == 0 => {
            filled.len() == 1 || texts.len() != heading.len() || distinct_words(texts) == 1
        }
        // `Rows;69` is a note: a torn row begins like a row.
        (Some(_), Origin::File) => {
            texts.len() < heading.len()
                && filled.first().is_some_and(|i| !is_value(texts[*i]) && !had_words(*i))
        }
    };
    if is_note { LineKind::Note } else { LineKind::Row }
}

pub(super) fn with_units(heading: &[String], units: &[String]) -> Vec<String> {
    let bare = |unit: &str| unit.trim_matches(['[', ']', '(', ')']).trim().to_owned();
    let composed = heading.iter().enumerate().map(|(i, heading)| {
        let unit = units.get(i).map_or_else(String::new, |unit| bare(unit));
        let is_without = Heading::parse(heading).unit.is_none() && !heading.is_empty();
        if is_without && !matches!(unit.as_str(), "" | "-") {
            format!("{heading} [{unit}]")
        } else {
            heading.clone()
        }
    });
    composed.collect()
}

/// Number of distinct words; 0 for units.
pub(super) fn heading_likeness(text: &str, separator: Separator) -> usize {
    let fields = split(text, separator).unwrap_or_default();
    let texts: Vec<&str> = fields.iter().map(|field| field.value.as_ref()).collect();
    let is_units = texts.iter().all(|text| text.is_empty() || is_unit(text));
    if is_units { 0 } else { distinct_words(&texts) }
}

/// Distinct non-empty texts that do not begin like a value.
pub(super) fn distinct_words(texts: &[&str]) -> usize {
    let mut words: Vec<&str> =
        texts.iter().copied().filter(|text| !text.is_empty() && !begins_like_a_value(text)).collect();
    words.sort_unstable();
    words.dedup();
    words.len()
}

/// Number or timestamp.
pub(super) fn is_value(text: &str) -> bool {
    begins_like_a_value(text)
        && (Unit::NONE.parse_si(&text.replacen(',', ".", 1)).is_some() || text.contains(':'))
}

pub(super) fn begins_like_a_value(text: &str) -> bool {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    unsigned.strip_prefix(['.', ',']).unwrap_or(unsigned).starts_with(|c: char| c.is_ascii_digit())
}

fn is_unit(text: &str) -> bool {
    let is_enclosed = |open, close| text.starts_with(open) && text.ends_with(close);
    let known = |text: &str| Unit::from_symbol(text).is_some_and(|unit| unit != Unit::NONE);
    is_enclosed('[', ']')
        || is_enclosed('(', ')')
        || text == "-"
        || known(text)
        || is_one_of(text, &OTHER_UNITS)
}

fn is_one_of(text: &str, words: &[&str]) -> bool {
    let text = text.to_lowercase();
    words.contains(&text.as_str())
}
