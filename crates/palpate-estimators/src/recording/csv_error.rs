//! CSV errors with places.

use std::fmt;
use std::ops::Range;

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

use super::marks::{Decimal, Separator};
use super::untouched::TimeSpan;

/// Invalid CSV recording.
#[derive(Debug, thiserror::Error)]
#[error("{}{problem}", Prefix(source_name, place.as_deref()))]
pub struct CsvError {
    /// File name.
    pub source_name: String,
    /// Place; `None` for the whole file.
    pub place: Option<Box<Place>>,
    /// Cause.
    #[source]
    pub problem: CsvProblem,
}

/// Place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1; `None` for the line.
    pub column: Option<usize>,
    /// Line text.
    pub text: String,
    /// Affected bytes of `text`.
    pub span: Range<usize>,
}

/// CSV problem.
#[derive(Debug, thiserror::Error)]
pub enum CsvProblem {
    /// Input error.
    #[error("cannot be read: {0}")]
    Unreadable(#[source] std::io::Error),
    /// Empty file.
    #[error("the file is empty; a recording has at least 1 row")]
    Empty,
    /// Header without rows.
    #[error("a recording has at least 1 row below the header, found 0")]
    NoRows,
    /// Neither UTF-8 nor Windows-1252.
    #[error("the bytes are not text in UTF-8 or Windows-1252; save the file as CSV in UTF-8")]
    NotText,
    /// Ambiguous separator.
    #[error(
        "fields may be separated by {first} or by {second}; set `separator` in [recording] to \"comma\", \"semicolon\", \"tab\", \"pipe\" or \"blanks\""
    )]
    ManySeparators {
        /// First candidate.
        first: Separator,
        /// Second candidate.
        second: Separator,
    },
    /// Unclosed quote.
    #[error("a quoted field does not end on this line")]
    OpenQuote,
    /// Missing column.
    #[error(
        "column `{wanted}` does not exist; the columns are {}{}",
        list(present),
        advice_on_header(present)
    )]
    MissingColumn {
        /// Requested name.
        wanted: String,
        /// Present names.
        present: Vec<String>,
    },
    /// Invalid column number.
    #[error("column number {wanted} does not exist; columns are numbered from 1 to {count}")]
    NoSuchColumn {
        /// Requested number.
        wanted: usize,
        /// Column count.
        count: usize,
    },
    /// Column name without header.
    #[error(
        "column `{wanted}` is given by name, but the file has no header; give its number, from 1 to {count}"
    )]
    NameWithoutHeader {
        /// Requested name.
        wanted: String,
        /// Column count.
        count: usize,
    },
    /// Duplicate name.
    #[error(
        "columns {first} and {second} are both named `{name}`; name the column by its number, {first} or {second}"
    )]
    DuplicateColumn {
        /// Name.
        name: String,
        /// First column.
        first: usize,
        /// Second column.
        second: usize,
    },
    /// Wrong number of fields.
    #[error("the row has {found} fields; it must have {expected}")]
    RowLength {
        /// Actual number.
        found: usize,
        /// Required number.
        expected: usize,
    },
    /// Wrong number of fields, separated by blanks.
    #[error("the row has {found} fields; it must have {expected}: between blanks a field cannot be empty")]
    RowLengthBetweenBlanks {
        /// Actual number.
        found: usize,
        /// Required number.
        expected: usize,
    },
    /// Empty numeric field.
    #[error("the field is empty; it must be a number")]
    EmptyField,
    /// Invalid number.
    #[error("`{text}` is not a number")]
    NotANumber {
        /// Field.
        text: String,
    },
    /// NaN, infinite or too large.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// Field.
        text: String,
    },
    /// Ambiguous decimal comma.
    #[error(
        "`{text}` may be {} or {}; set `decimal = \"comma\"` in [recording] for the second, or write it without the comma for the first",
        text.replace(',', ""),
        text.replace(',', ".")
    )]
    DoubtfulNumber {
        /// Field.
        text: String,
    },
    /// Ambiguous separators of thousands.
    #[error(
        "`{text}` beside `{beside}` may be {} or {}; write all numbers without thousands marks for the first, or set \
         `decimal = \"{}\"` in [recording] for the second",
        text.replace([',', '.'], ""),
        text.replace(',', "."),
        if text.contains(',') { "comma" } else { "point" }
    )]
    DoubtfulThousands {
        /// Marked number.
        text: String,
        /// Whole number beside it.
        beside: String,
    },
    /// Inconsistent decimal mark.
    #[error(
        "`{text}` does not go with the {decimal} of the numbers before it or of the rig; write all numbers in one way"
    )]
    OtherDecimal {
        /// Field.
        text: String,
        /// Earlier decimal mark.
        decimal: Decimal,
    },
    /// Separators of thousands.
    #[error("`{text}` has separators of thousands; write it without them")]
    Thousands {
        /// Field.
        text: String,
    },
    /// Commas separate both fields and decimals.
    #[error(
        "the row has {found} fields; it must have {expected}: where commas stand before decimals, fields must be separated by semicolons or tabs"
    )]
    CutDecimals {
        /// Actual number.
        found: usize,
        /// Required number.
        expected: usize,
    },
    /// Contradictory unit in a heading.
    #[error(
        "the header has the unit `{heading_unit}`, but the column is read in {read_as}; set `{key}`, or correct the header"
    )]
    OtherUnit {
        /// Header unit.
        heading_unit: String,
        /// Column unit.
        read_as: Unit,
        /// Rig key.
        key: &'static str,
    },
    /// Names that differ only in units.
    #[error(
        "columns {first} and {second} are both `{name}` but for what stands behind it; write out the one that is meant, as in `{example}`"
    )]
    ManyUnits {
        /// Name.
        name: String,
        /// First column.
        first: usize,
        /// Second column.
        second: usize,
        /// First heading.
        example: String,
    },
    /// Invalid mark of untouched rows.
    #[error(
        "`{text}` does not mark whether the row is untouched; write 1, true or yes in an untouched row, and 0, false, no or an empty field in others"
    )]
    NotAMark {
        /// Field.
        text: String,
    },
    /// Untouched times without row times.
    #[error(
        "`untouched_times` needs the times of the rows, which are missing; name their column as `time` in [recording]"
    )]
    NoTimes,
    /// Untouched span without rows.
    #[error("no row has a time within the untouched {span}; the rows are from {from_s} s to {to_s} s")]
    NothingUntouched {
        /// Span.
        span: TimeSpan,
        /// Least time.
        from_s: f64,
        /// Greatest time.
        to_s: f64,
    },
    /// Zero without untouched rows.
    #[error("{0}")]
    NoZero(#[from] super::zero::NoUntouchedRow),
    /// Invalid time.
    #[error(
        "`{text}` is not a time; write a number, `2026-04-03 14:03:25.120`, `03.04.2026 14:03:25,120` or `14:03:25`"
    )]
    NotATime {
        /// Field.
        text: String,
    },
    /// Inconsistent time notation.
    #[error("`{text}` is written in another way than the time of the first row; all rows must have one way")]
    OtherTime {
        /// Field.
        text: String,
    },
    /// Ambiguous day and month.
    #[error("`{text}` may have the day first or the month first; write the date as 2026-04-03 or 03.04.2026")]
    SlashedDate {
        /// Field.
        text: String,
    },
    /// Time of day past midnight.
    #[error(
        "`{text}` is half a day or more before the row above; where times go over midnight they need a date"
    )]
    Midnight {
        /// Field.
        text: String,
    },
    /// Contact off the surface.
    #[error("the position {} is off the surface; it must be within {}", extent.place_in_words(*position), extent.bounds_in_words())]
    OffSurface {
        /// Contact position.
        position: Position,
        /// Surface extent.
        extent: Extent,
    },
    /// Different numbers of readings and contacts.
    #[error("found {readings} readings and {contacts} contacts; their numbers must be equal")]
    RowsDiffer {
        /// Reading rows.
        readings: usize,
        /// Contact rows.
        contacts: usize,
    },
    /// Different numbers of channels and sensors.
    #[error("{columns} columns are channels, but the layout has {sensors} sensors; they must be as many")]
    ChannelCount {
        /// Channel columns.
        columns: usize,
        /// Sensors.
        sensors: usize,
    },
}

impl CsvProblem {
    pub(super) fn in_line(self, source: &str, line: usize, text: String, span: Range<usize>) -> CsvError {
        let place = Some(Box::new(Place { line, column: None, text, span }));
        CsvError { source_name: source.to_owned(), place, problem: self }
    }

    pub(super) fn in_file(self, source: &str) -> CsvError {
        CsvError { source_name: source.to_owned(), place: None, problem: self }
    }
}

struct Prefix<'a>(&'a str, Option<&'a Place>);

impl fmt::Display for Prefix<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(source, place) = self;
        f.write_str(source)?;
        if let Some(place) = place {
            write!(f, ":{}", place.line)?;
            if let Some(column) = place.column {
                write!(f, ":{column}")?;
            }
        }
        f.write_str(": ")
    }
}

fn advice_on_header(names: &[String]) -> &'static str {
    if names.iter().all(|name| name.replace(',', ".").trim().parse::<f64>().is_ok()) {
        ": numbers; where no line names the columns, give `--no-header`, or `header = false` in [recording]"
    } else {
        ""
    }
}

fn list(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}
