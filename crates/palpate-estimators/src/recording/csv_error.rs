//! Errors of a CSV file, with their places.

use std::fmt;
use std::ops::Range;

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

use super::marks::{Decimal, Separator};
use super::untouched::TimeSpan;

/// A CSV file that cannot be read as a recording.
#[derive(Debug, thiserror::Error)]
#[error("{}{problem}", Prefix(source_name, place.as_deref()))]
pub struct CsvError {
    /// The name of the file, as the caller gave it.
    pub source_name: String,
    /// Place of the problem; `None` when it concerns the whole file.
    pub place: Option<Box<Place>>,
    /// The problem.
    #[source]
    pub problem: CsvProblem,
}

/// A place in a CSV file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The line, from 1.
    pub line: usize,
    /// The column, from 1; `None` when the problem concerns the whole line.
    pub column: Option<usize>,
    /// The line's text.
    pub text: String,
    /// The bytes of `text` that the problem concerns.
    pub span: Range<usize>,
}

/// Problem of a CSV file.
#[derive(Debug, thiserror::Error)]
pub enum CsvProblem {
    /// The bytes cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(#[source] std::io::Error),
    /// The file has no line with content.
    #[error("the file is empty; a recording has at least 1 row")]
    Empty,
    /// The file has a header but no rows below it.
    #[error("a recording has at least 1 row below the header, found 0")]
    NoRows,
    /// The text is neither UTF-8 nor Windows-1252.
    #[error("the bytes are not text in UTF-8 or Windows-1252; save the file as CSV in UTF-8")]
    NotText,
    /// The first line contains several separators, and more than one of them gives the columns.
    #[error(
        "fields may be separated by {first} or by {second}; set `separator` in [recording] to \"comma\", \"semicolon\", \"tab\", \"pipe\" or \"blanks\""
    )]
    ManySeparators {
        /// A separator that gives the columns.
        first: Separator,
        /// Another one.
        second: Separator,
    },
    /// A quote is not closed on its line.
    #[error("a quoted field does not end on this line")]
    OpenQuote,
    /// The header lacks a column.
    #[error(
        "column `{wanted}` does not exist; the columns are {}{}",
        list(present),
        advice_on_header(present)
    )]
    MissingColumn {
        /// The requested name.
        wanted: String,
        /// The names in the header.
        present: Vec<String>,
    },
    /// A column number is 0 or beyond the last column.
    #[error("column number {wanted} does not exist; columns are numbered from 1 to {count}")]
    NoSuchColumn {
        /// The requested number.
        wanted: usize,
        /// Number of columns.
        count: usize,
    },
    /// A column is given by name, but the file has no header.
    #[error(
        "column `{wanted}` is given by name, but the file has no header; give its number, from 1 to {count}"
    )]
    NameWithoutHeader {
        /// The requested name.
        wanted: String,
        /// Number of columns.
        count: usize,
    },
    /// Two columns have the name of a required column.
    #[error(
        "columns {first} and {second} are both named `{name}`; name the column by its number, {first} or {second}"
    )]
    DuplicateColumn {
        /// The name.
        name: String,
        /// Number of the first column, from 1.
        first: usize,
        /// Number of the second column, from 1.
        second: usize,
    },
    /// A row has more or fewer fields than the header (or the first row).
    #[error("the row has {found} fields; it must have {expected}")]
    RowLength {
        /// Number of fields in the row.
        found: usize,
        /// Number of fields that it must have.
        expected: usize,
    },
    /// A row with blanks between its fields has more or fewer fields than the header.
    #[error("the row has {found} fields; it must have {expected}: between blanks a field cannot be empty")]
    RowLengthBetweenBlanks {
        /// Number of fields in the row.
        found: usize,
        /// Number of fields that it must have.
        expected: usize,
    },
    /// A field that must be a number is empty.
    #[error("the field is empty; it must be a number")]
    EmptyField,
    /// A field is not a number.
    #[error("`{text}` is not a number")]
    NotANumber {
        /// The field.
        text: String,
    },
    /// A field is NaN, infinite, or too large.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// The field.
        text: String,
    },
    /// A number that is ambiguous between a whole number with a separator of thousands and a number with a decimal comma.
    #[error(
        "`{text}` may be {} or {}; set `decimal = \"comma\"` in [recording] for the second, or write it without the comma for the first",
        text.replace(',', ""),
        text.replace(',', ".")
    )]
    DoubtfulNumber {
        /// The field.
        text: String,
    },
    /// Numbers of a column that are plausible both with a decimal mark and with separators of thousands.
    #[error(
        "`{text}` beside `{beside}` may be {} or {}; write all numbers without thousands marks for the first, or set \
         `decimal = \"{}\"` in [recording] for the second",
        text.replace([',', '.'], ""),
        text.replace(',', "."),
        if text.contains(',') { "comma" } else { "point" }
    )]
    DoubtfulThousands {
        /// The number with a mark.
        text: String,
        /// A whole number of the same column.
        beside: String,
    },
    /// A number has another decimal mark than the numbers before it.
    #[error(
        "`{text}` does not go with the {decimal} of the numbers before it or of the rig; write all numbers in one way"
    )]
    OtherDecimal {
        /// The field.
        text: String,
        /// Decimal mark of the other numbers.
        decimal: Decimal,
    },
    /// A number has separators of thousands.
    #[error("`{text}` has separators of thousands; write it without them")]
    Thousands {
        /// The field.
        text: String,
    },
    /// A row of whole numbers has more fields than the header: commas separate fields and decimals alike.
    #[error(
        "the row has {found} fields; it must have {expected}: where commas stand before decimals, fields must be separated by semicolons or tabs"
    )]
    CutDecimals {
        /// Number of fields in the row.
        found: usize,
        /// Number of fields that it must have.
        expected: usize,
    },
    /// A heading contains another unit than the one in which its column is read.
    #[error(
        "the header has the unit `{said}`, but the column is read in {read_as}; set `{key}`, or correct the header"
    )]
    OtherUnit {
        /// The unit in the header.
        said: String,
        /// The unit of the column's role.
        read_as: Unit,
        /// The key of the unit in a rig.
        key: &'static str,
    },
    /// Two columns have the name of a required column and differ only in their units.
    #[error(
        "columns {first} and {second} are both `{name}` but for what stands behind it; write out the one that is meant, as in `{example}`"
    )]
    ManyUnits {
        /// The name.
        name: String,
        /// Number of the first column, from 1.
        first: usize,
        /// Number of the second column, from 1.
        second: usize,
        /// Heading of the first column.
        example: String,
    },
    /// A field of the column that marks untouched rows is neither a yes nor a no.
    #[error(
        "`{text}` does not mark whether the row is untouched; write 1, true or yes in an untouched row, and 0, false, no or an empty field in others"
    )]
    NotAMark {
        /// The field.
        text: String,
    },
    /// Untouched times are given, but the rows of the file have no time.
    #[error(
        "`untouched_times` needs the times of the rows, which are missing; name their column as `time` in [recording]"
    )]
    NoTimes,
    /// No row has a time within an untouched span.
    #[error("no row has a time within the untouched {span}; the rows are from {from_s} s to {to_s} s")]
    NothingUntouched {
        /// The untouched span.
        span: TimeSpan,
        /// Least time of a row, in seconds.
        from_s: f64,
        /// Greatest time of a row, in seconds.
        to_s: f64,
    },
    /// No row is untouched, but the zero of the readings needs such rows.
    #[error("{0}")]
    NoZero(#[from] super::zero::NoUntouchedRow),
    /// A field of the time column is neither a number nor a timestamp.
    #[error(
        "`{text}` is not a time; write a number, `2026-04-03 14:03:25.120`, `03.04.2026 14:03:25,120` or `14:03:25`"
    )]
    NotATime {
        /// The field.
        text: String,
    },
    /// A time has another notation than that of the first row.
    #[error("`{text}` is written in another way than the time of the first row; all rows must have one way")]
    OtherTime {
        /// The field.
        text: String,
    },
    /// A date with slashes, in which day and month cannot be distinguished.
    #[error("`{text}` may have the day first or the month first; write the date as 2026-04-03 or 03.04.2026")]
    SlashedDate {
        /// The field.
        text: String,
    },
    /// A time of day, without a date, goes back by more than half a day.
    #[error(
        "`{text}` is half a day or more before the row above; where times go over midnight they need a date"
    )]
    Midnight {
        /// The field.
        text: String,
    },
    /// A contact lies off the surface.
    #[error("the position {} is off the surface; it must be within {}", extent.place_in_words(*position), extent.bounds_in_words())]
    OffSurface {
        /// Position of the contact in the file.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// The numbers of readings and contacts differ.
    #[error("found {readings} readings and {contacts} contacts; their numbers must be equal")]
    RowsDiffer {
        /// Rows of the readings' file.
        readings: usize,
        /// Rows of the contacts' file.
        contacts: usize,
    },
    /// The numbers of channel columns and sensors differ.
    #[error("{columns} columns are channels, but the layout has {sensors} sensors; they must be as many")]
    ChannelCount {
        /// Number of channel columns.
        columns: usize,
        /// Number of sensors of the layout.
        sensors: usize,
    },
}

impl CsvProblem {
    /// This problem with the bytes `span` of `text`, a line of the file `source`.
    pub(super) fn in_line(self, source: &str, line: usize, text: String, span: Range<usize>) -> CsvError {
        let place = Some(Box::new(Place { line, column: None, text, span }));
        CsvError { source_name: source.to_owned(), place, problem: self }
    }

    /// This problem, which concerns the whole file `source`.
    pub(super) fn in_file(self, source: &str) -> CsvError {
        CsvError { source_name: source.to_owned(), place: None, problem: self }
    }
}

/// `file:line:column: `, as far as it is known.
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

/// Advice for a header of numbers only.
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
