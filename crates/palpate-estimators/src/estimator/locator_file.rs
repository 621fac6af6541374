//! Locator file: JSON with a format version.

use super::Locator;
use crate::fit::{LARGEST, LocatorFault};

const FORMAT: &str = "palpate-locator";

/// Format version that is read and written.
pub const FORMAT_VERSION: u32 = 1;

/// Error of a locator file.
#[derive(Debug, thiserror::Error)]
pub enum LocatorFileError {
    /// Invalid JSON, with line and column.
    #[error("this is not a locator file: {0}")]
    Json(#[from] serde_json::Error),
    /// Number out of range, checked after the whole object around it.
    #[error("{}", without_place(.error))]
    Number {
        /// Number with its name and bound.
        error: serde_json::Error,
        /// Line and column of the number, from 1.
        place: (usize, usize),
    },
    /// JSON of another format.
    #[error("the file's format is `{found}`; a locator's is `{FORMAT}`")]
    Format {
        /// Value in the file.
        found: String,
    },
    /// Unknown format version.
    #[error(
        "the locator has format version {found}; this palpate reads version {FORMAT_VERSION}: fit it again, or use the palpate that wrote it"
    )]
    Version {
        /// Value in the file.
        found: u32,
    },
    /// Inconsistent numbers.
    #[error("{fault}")]
    Fault {
        /// Fault.
        fault: LocatorFault,
        /// Line and column from 1, where known.
        place: Option<(usize, usize)>,
    },
    /// Number beyond the largest magnitude.
    #[error("{value:e} is beyond ±{LARGEST:e}, within which every number of a locator lies")]
    TooLarge {
        /// Value of the number.
        value: f64,
        /// Line and column, from 1.
        place: (usize, usize),
    },
}

impl LocatorFileError {
    /// Line and column of the error, from 1.
    pub fn place(&self) -> Option<(usize, usize)> {
        match self {
            Self::Json(error) if error.line() > 0 => Some((error.line(), error.column().max(1))),
            Self::Fault { place, .. } => *place,
            Self::Number { place, .. } | Self::TooLarge { place, .. } => Some(*place),
            _ => None,
        }
    }
}

#[derive(serde::Deserialize)]
struct Heading {
    format: String,
    format_version: u32,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File<L> {
    format: String,
    format_version: u32,
    locator: L,
}

impl Locator {
    /// Text of the locator file.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, estimator::Locator, fit::Fit, influence::Influence, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// let locator = Influence::default().fit(&setup, &presses)?.into_locator();
    /// assert_eq!(Locator::from_json(&locator.to_json()?)?, locator);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`LocatorFileError::Json`] for an infinite number, which fits never give.
    pub fn to_json(&self) -> Result<String, LocatorFileError> {
        let file = File { format: FORMAT.to_owned(), format_version: FORMAT_VERSION, locator: self };
        Ok(serde_json::to_string_pretty(&file)? + "\n")
    }

    /// Reads a locator file.
    ///
    /// # Errors
    /// [`LocatorFileError`].
    pub fn from_json(text: &str) -> Result<Self, LocatorFileError> {
        let heading: Heading = serde_json::from_str(text)?;
        if heading.format != FORMAT {
            return Err(LocatorFileError::Format { found: heading.format });
        }
        if heading.format_version != FORMAT_VERSION {
            return Err(LocatorFileError::Version { found: heading.format_version });
        }
        if let Some((at, value)) = numbers(text).find(|(_, value)| value.abs() > LARGEST) {
            return Err(LocatorFileError::TooLarge { value, place: line_and_column(text, at) });
        }
        let File::<Self> { locator, .. } =
            serde_json::from_str(text).map_err(|error| at_number(error, text))?;
        locator.check().map_err(|fault| LocatorFileError::Fault { fault, place: place_of(&fault, text) })?;
        Ok(locator)
    }
}

fn numbers(text: &str) -> impl Iterator<Item = (usize, f64)> {
    let bytes = text.as_bytes();
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let start = at;
            match *bytes.get(at)? {
                b'"' => at = end_of_string(bytes, at + 1),
                b'-' | b'0'..=b'9' => {
                    let is_part = |byte: &u8| matches!(byte, b'0'..=b'9' | b'-' | b'+' | b'.' | b'e' | b'E');
                    at += bytes[at..].iter().take_while(|byte| is_part(byte)).count();
                    if let Ok(value) = text[start..at].parse() {
                        return Some((start, value));
                    }
                }
                _ => at += 1,
            }
        }
    })
}

fn end_of_string(bytes: &[u8], mut at: usize) -> usize {
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'"' => return at + 1,
            // An escaped character does not end a string.
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
    at
}

fn at_number(error: serde_json::Error, text: &str) -> LocatorFileError {
    match place_within_object(&error, text) {
        Some(place) => LocatorFileError::Number { error, place },
        None => error.into(),
    }
}

/// The only such number in the object that ends at the error.
fn place_within_object(error: &serde_json::Error, text: &str) -> Option<(usize, usize)> {
    let told = error.to_string();
    let (named, _) = told.split_once("; it must be ")?;
    let (_, number) = named.rsplit_once(" is ")?;
    let number: f64 = number.split(' ').next()?.parse().ok()?;
    let end = byte_at(text, error.line(), error.column())?;
    let start = start_of_object(text.as_bytes(), end);
    let is_it = |(at, value): &(usize, f64)| (start..end).contains(at) && value.to_bits() == number.to_bits();
    let mut places = numbers(text).filter(is_it);
    let (at, _) = places.next()?;
    places.next().is_none().then(|| line_and_column(text, at))
}

fn without_place(error: &serde_json::Error) -> String {
    let told = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    told.strip_suffix(&place).unwrap_or(&told).to_owned()
}

fn byte_at(text: &str, line: usize, column: usize) -> Option<usize> {
    let before: usize = text.split_inclusive('\n').take(line.checked_sub(1)?).map(str::len).sum();
    Some((before + column).min(text.len()))
}

fn start_of_object(bytes: &[u8], end: usize) -> usize {
    let mut open = Vec::new();
    let (mut at, mut start) = (0, 0);
    while at < end {
        match bytes[at] {
            b'"' => {
                at = end_of_string(bytes, at + 1);
                continue;
            }
            b'{' | b'[' => open.push(at),
            b'}' | b']' => start = open.pop().unwrap_or(0),
            _ => {}
        }
        at += 1;
    }
    start
}

/// The only such number, or the first that is too small.
fn place_of(fault: &LocatorFault, text: &str) -> Option<(usize, usize)> {
    let mut places = numbers(text).filter(|(_, number)| number.to_bits() == fault.value().to_bits());
    let (at, _) = places.next()?;
    let is_found = matches!(fault, LocatorFault::TooSmall { .. }) || places.next().is_none();
    is_found.then(|| line_and_column(text, at))
}

fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..at];
    let line_start = before.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    (before.iter().filter(|byte| **byte == b'\n').count() + 1, at - line_start + 1)
}
