//! Lines and readings of a file or stdin, as they arrive.

use crate::chunks::Chunks;
use crate::failure::{Failure, UserError};
use crate::input;
use crate::json::object;
use crate::output;
use crate::remark::{alert, remark};
use palpate_estimators::recording::{
    Column, Columns, CsvError, Dialect, Header, LineParser, ReadingParser, TextDecoder,
};
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::format_count;
use std::error::Error;
use std::path::Path;

/// Lines of a source; invalid lines are reported and counted.
pub struct Lines {
    pub count: u64,
    source: Chunks,
    decoder: TextDecoder,
    /// The last chunk, and the number of consumed bytes.
    chunk: (Vec<u8>, usize),
    line: Vec<u8>,
    /// True after a line that ends with CR: a following LF belongs to it.
    after_cr: bool,
    parsed: u64,
    skipped: u64,
    records: Records,
}

/// Records of invalid lines on stdout.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Records {
    None,
    Json,
}

const MOST_SKIPS: u64 = 20;

pub const MOST_BYTES: usize = 1 << 20;

/// A line longer than [`MOST_BYTES`].
#[derive(Debug, thiserror::Error)]
#[error("the line is longer than 1 MiB ({} bytes)", format_count(MOST_BYTES as u64))]
pub struct TooLong;

impl Lines {
    pub fn open(path: &Path, records: Records) -> Result<Self, Failure> {
        let source = Chunks::open(path)?;
        Ok(Self {
            count: 0,
            source,
            decoder: TextDecoder::default(),
            chunk: (Vec::new(), 0),
            line: Vec::new(),
            after_cr: false,
            parsed: 0,
            skipped: 0,
            records,
        })
    }

    pub fn name(&self) -> &str {
        &self.source.name
    }

    /// Returns the next line with its end: LF, CR or CRLF.
    ///
    /// # Errors
    /// [`UserError`] if the source cannot be read; [`Failure::Interrupted`] after a signal.
    pub fn next(&mut self) -> Result<Option<Result<&[u8], TooLong>>, Failure> {
        self.line.clear();
        let mut length = 0;
        loop {
            let (chunk, taken) = &mut self.chunk;
            if *taken == chunk.len() {
                let next = self.source.next().map_err(|failure| with_last_line(failure, self.count))?;
                let Some(next) = next else { break };
                self.chunk = (self.decoder.decode(&next), 0);
                continue;
            }
            if std::mem::take(&mut self.after_cr) && chunk[*taken] == b'\n' {
                *taken += 1;
                continue;
            }
            let rest = &chunk[*taken..];
            let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).map(|at| at + 1);
            let part = &rest[..end.unwrap_or(rest.len())];
            length += part.len();
            *taken += part.len();
            // The rest of a line that is too long is discarded.
            if length <= MOST_BYTES {
                self.line.extend_from_slice(part);
            }
            if let Some(end) = end {
                self.after_cr = rest[end - 1] == b'\r';
                break;
            }
        }
        if length == 0 {
            return Ok(None);
        }
        self.count += 1;
        Ok(Some(if length <= MOST_BYTES { Ok(&self.line) } else { Err(TooLong) }))
    }

    pub fn skip_reading(&mut self, error: &(dyn Error + 'static)) -> Result<(), Failure> {
        self.skipped += 1;
        // An error of a parser contains source and line.
        let (column, reason, words) = match error.downcast_ref::<CsvError>() {
            Some(CsvError { place, problem, .. }) => {
                (place.as_ref().and_then(|place| place.column), problem.to_string(), error.to_string())
            }
            None => (None, error.to_string(), format!("{}:{}: {error}", self.name(), self.count)),
        };
        if self.skipped <= MOST_SKIPS {
            alert!("palpate: skipped: {words}");
        } else if self.skipped == MOST_SKIPS + 1 {
            alert!("palpate: skipped: further lines, which are counted at the end");
        }
        if self.records == Records::None {
            return Ok(());
        }
        output::print_json_line(&object! { "line": self.count, "column"?: column, "skipped": reason })
    }

    pub fn is_whole(&self) -> bool {
        self.skipped == 0
    }

    /// Fails if some lines gave no `answer`, or if no line contains a reading.
    pub fn finish(&self, answer: &str) -> Result<(), Failure> {
        match self.skipped {
            0 if self.parsed == 0 => {
                Err(Failure::DataLost(format!("{} contains a header and no reading", self.name())))
            }
            0 => Ok(()),
            lost => Err(Failure::DataLost(format!("{lost} of {} lines gave no {answer}", self.count))),
        }
    }
}

fn with_last_line(failure: Failure, line: u64) -> Failure {
    match failure {
        Failure::Interrupted(_) => Failure::Interrupted(format!("stopped after line {line}")),
        other => other,
    }
}

#[derive(Default)]
struct DialectNote(String);

impl DialectNote {
    fn report_dialect(&mut self, dialect: &Dialect) {
        let words = dialect.to_string();
        if words != self.0 {
            remark!("{}: {words}", dialect.source);
            self.0 = words;
        }
    }
}

/// Parsed values of lines; invalid lines are reported and counted.
pub struct Parsing<P> {
    pub parser: P,
    header: Header,
    note: DialectNote,
}

impl<P: LineParser> Parsing<P> {
    /// Parses lines with or without a header.
    pub fn new(parser: P, header: Header) -> Self {
        Self { parser, header, note: DialectNote::default() }
    }

    /// Returns the values of the next line: `None` at the end, `Some(None)` without values.
    pub fn next(&mut self, lines: &mut Lines) -> Result<Option<Option<P::Values>>, Failure> {
        let Some(line) = lines.next()? else {
            let unfound = self.parser.progress().unfound();
            return unfound.map_or(Ok(None), |error| Err(input::csv_error(&error).into()));
        };
        match line.map(|line| self.parser.parse_line(line)) {
            Ok(Ok(parsed)) => {
                if parsed.is_some() {
                    lines.parsed += 1;
                    self.note.report_dialect(self.parser.progress().dialect());
                }
                return Ok(Some(parsed));
            }
            Ok(Err(error)) => {
                // A stream without a header may begin within a line.
                let may_be_torn = self.header == Header::Absent && lines.is_whole();
                if self.parser.progress().awaits_columns() && !may_be_torn {
                    return Err(input::csv_error(&error).into());
                }
                lines.skip_reading(&error)?;
            }
            Err(error) => {
                if self.parser.progress().awaits_columns() && self.header != Header::Absent {
                    let place = format!("{}:{}", lines.name(), lines.count);
                    return Err(UserError::new(format!("{place}: {error}")).into());
                }
                self.parser.progress().skip_line();
                lines.skip_reading(&error)?;
            }
        }
        Ok(Some(None))
    }
}

pub struct Readings {
    pub lines: Lines,
    parsing: Parsing<ReadingParser>,
}

impl Readings {
    /// Without a header, the columns are the channels in order.
    pub fn new(lines: Lines, setup: &Setup, no_header: bool) -> Self {
        let mut columns: Columns = setup.recording_columns();
        if no_header {
            columns.header = Header::Absent;
            columns.time = None;
            for (i, channel) in columns.channels.iter_mut().enumerate() {
                channel.column = Column::Number(i + 1);
            }
        }
        let parser = ReadingParser::new(lines.name(), &columns);
        Self { lines, parsing: Parsing::new(parser, columns.header) }
    }

    pub fn next(&mut self) -> Result<Option<Vec<f64>>, Failure> {
        while let Some(parsed) = self.parsing.next(&mut self.lines)? {
            if parsed.is_some() {
                return Ok(parsed);
            }
        }
        Ok(None)
    }

    /// Time of the last reading in seconds, if the source has times.
    pub fn time_s(&self) -> Option<f64> {
        self.parsing.parser.time_s()
    }

    /// Returns true until a header or `--no-header` defines the columns.
    pub fn awaits_columns(&mut self) -> bool {
        self.parsing.parser.progress().awaits_columns()
    }
}
