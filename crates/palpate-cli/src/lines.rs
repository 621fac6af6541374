//! Readings of a file, or of stdin, as they come.

use crate::chunks::Chunks;
use crate::failure::{Complaint, Failure};
use crate::input;
use crate::json::object;
use crate::output;
use crate::remark::remark;
use palpate_estimators::recording::{Column, Columns, CsvError, Dialect, Header, ReadingParser};
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::format_count;
use std::error::Error;
use std::path::Path;

/// Lines of a source, as they come; those that give nothing are said and counted.
pub struct Lines {
    /// Number of lines read so far.
    pub count: u64,
    source: Chunks,
    /// The last chunk, and how much of it has been taken.
    chunk: (Vec<u8>, usize),
    line: Vec<u8>,
    /// Lines that gave nothing.
    lost: u64,
    records: Records,
}

/// Records of lines that give nothing.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Records {
    /// None on stdout: the lines of those that give something have numbers.
    None,
    /// A JSON object on stdout.
    Json,
}

/// Most bytes of a line.
pub const MOST_BYTES: usize = 1 << 20;

/// A line longer than [`MOST_BYTES`].
#[derive(Debug, thiserror::Error)]
#[error("the line is longer than 1 MiB ({} bytes)", format_count(MOST_BYTES as u64))]
pub struct TooLong;

impl Lines {
    /// The lines of a file; `-` is stdin.
    pub fn open(path: &Path, records: Records) -> Result<Self, Failure> {
        let source = Chunks::open(path)?;
        Ok(Self { count: 0, source, chunk: (Vec::new(), 0), line: Vec::new(), lost: 0, records })
    }

    /// Name of the source.
    pub fn name(&self) -> &str {
        &self.source.name
    }

    /// The next line, with its end; `None` after the last.
    ///
    /// # Errors
    /// A complaint where the source cannot be read, and [`Failure::Interrupted`] once a signal came.
    pub fn next(&mut self) -> Result<Option<Result<&[u8], TooLong>>, Failure> {
        self.line.clear();
        let mut length = 0;
        loop {
            let (chunk, taken) = &mut self.chunk;
            if *taken == chunk.len() {
                let next = self.source.next().map_err(|failure| stopped_after(failure, self.count))?;
                let Some(next) = next else { break };
                self.chunk = (next, 0);
                continue;
            }
            let rest = &chunk[*taken..];
            let end = rest.iter().position(|byte| *byte == b'\n').map(|at| at + 1);
            let part = &rest[..end.unwrap_or(rest.len())];
            length += part.len();
            *taken += part.len();
            // Of a line that is too long, nothing more is kept.
            if length <= MOST_BYTES {
                self.line.extend_from_slice(part);
            }
            if end.is_some() {
                break;
            }
        }
        if length == 0 {
            return Ok(None);
        }
        self.count += 1;
        Ok(Some(if length <= MOST_BYTES { Ok(&self.line) } else { Err(TooLong) }))
    }

    /// Counts the line as one that gave nothing, and says why.
    pub fn lose(&mut self, error: &(dyn Error + 'static)) -> Result<(), Failure> {
        self.lost += 1;
        match error.downcast_ref::<CsvError>() {
            // It names source and line itself.
            Some(error) => remark!("palpate: skipped: {error}"),
            None => remark!("palpate: skipped: {}:{}: {error}", self.name(), self.count),
        }
        if self.records == Records::None {
            return Ok(());
        }
        let (column, reason) = match error.downcast_ref::<CsvError>() {
            Some(CsvError { place, problem, .. }) => {
                (place.as_ref().and_then(|place| place.column), problem.to_string())
            }
            None => (None, error.to_string()),
        };
        output::say_json_line(&object! { "line": self.count, "column"?: column, "skipped": reason })
    }

    /// True while every line has given something.
    pub fn is_whole(&self) -> bool {
        self.lost == 0
    }

    /// The failure that some lines gave no such `answer`, if they did not.
    pub fn finish(&self, answer: &str) -> Result<(), Failure> {
        match self.lost {
            0 => Ok(()),
            lost => Err(Failure::DataLost(format!("{lost} of {} lines gave no {answer}", self.count))),
        }
    }
}

/// What was interrupted, with the last line that was read before.
fn stopped_after(failure: Failure, line: u64) -> Failure {
    match failure {
        Failure::Interrupted(_) => Failure::Interrupted(format!("stopped after line {line}")),
        other => other,
    }
}

/// What to do with a line that cannot be read while it is not known yet which columns there are.
///
/// # Errors
/// A complaint, unless the stream has no header and this is its first line: it may have begun in the middle of it.
pub fn check_first_line(lines: &Lines, header: Header, error: &CsvError) -> Result<(), Failure> {
    match header {
        Header::Absent if lines.is_whole() => Ok(()),
        _ => Err(input::csv_complaint(error).into()),
    }
}

/// The same for a line that is too long: there is no header behind it.
pub fn check_first_length(lines: &Lines, header: Header, error: &TooLong) -> Result<(), Failure> {
    match header {
        Header::Absent => Ok(()),
        _ => Err(Complaint::new(format!("{}:{}: {error}", lines.name(), lines.count)).into()),
    }
}

/// Remarks that were made about a stream's dialect.
#[derive(Default)]
pub struct DialectNote(String);

impl DialectNote {
    /// Says on stderr what is new of the dialect.
    pub fn say(&mut self, dialect: &Dialect) {
        let words = dialect.to_string();
        if words != self.0 {
            remark!("{}: {words}", dialect.source);
            self.0 = words;
        }
    }
}

/// The readings of a file, one a line; lines that hold none are said and counted.
pub struct Readings {
    pub lines: Lines,
    parser: ReadingParser,
    header: Header,
    note: DialectNote,
}

impl Readings {
    /// The readings of a bench in lines. Without a header, columns are the channels in their order.
    pub fn new(lines: Lines, setup: &Setup, no_header: bool) -> Self {
        let mut columns: Columns = setup.recording_columns();
        if no_header {
            columns.header = Header::Absent;
            for (i, channel) in columns.channels.iter_mut().enumerate() {
                channel.column = Column::Number(i + 1);
            }
        }
        Self {
            parser: ReadingParser::new(lines.name(), &columns),
            header: columns.header,
            note: DialectNote::default(),
            lines,
        }
    }

    /// The next reading.
    pub fn next(&mut self) -> Result<Option<Vec<f64>>, Failure> {
        while let Some(line) = self.lines.next()? {
            match line.map(|line| self.parser.parse_line(line)) {
                Ok(Ok(None)) => {}
                Ok(Ok(Some(reading))) => {
                    self.note.say(self.parser.dialect());
                    return Ok(Some(reading));
                }
                Ok(Err(error)) => {
                    if self.parser.awaits_columns() {
                        check_first_line(&self.lines, self.header, &error)?;
                    }
                    self.lines.lose(&error)?;
                }
                Err(error) => {
                    if self.parser.awaits_columns() {
                        check_first_length(&self.lines, self.header, &error)?;
                    }
                    self.parser.skip_line();
                    self.lines.lose(&error)?;
                }
            }
        }
        Ok(None)
    }

    /// True until the columns are known, by a header or by `--no-header`.
    pub fn awaits_columns(&self) -> bool {
        self.parser.awaits_columns()
    }
}
