//! Readings of a file, or of stdin, as they come.

use crate::failure::{Complaint, Failure};
use crate::{input, progress, target};
use palpate_estimators::recording::{Column, Columns, Dialect, Header, ReadingParser};
use palpate_estimators::setup::Setup;
use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal};
use std::path::Path;

/// Lines of a source, as they come.
pub struct Lines {
    /// Name of the source: the file, or "stdin".
    pub name: String,
    /// Number of lines read so far.
    pub count: u64,
    source: Box<dyn BufRead>,
    line: Vec<u8>,
}

impl Lines {
    /// The lines of a file; `-` is stdin.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let (name, source): (_, Box<dyn BufRead>) = if path == Path::new("-") {
            if std::io::stdin().is_terminal() {
                eprintln!("palpate: reading from the keyboard; Ctrl-D ends it");
            }
            ("stdin".to_owned(), Box::new(std::io::stdin().lock()))
        } else {
            let file = File::open(path).map_err(|error| target::cannot("read", path, &error))?;
            (path.display().to_string(), Box::new(BufReader::new(file)))
        };
        Ok(Self { name, count: 0, source, line: Vec::new() })
    }

    /// The next line, with its end; `None` after the last, and once Ctrl-C was pressed.
    pub fn next(&mut self) -> Result<Option<&[u8]>, Failure> {
        self.line.clear();
        if progress::interrupted() {
            return Ok(None);
        }
        let read = self.source.read_until(b'\n', &mut self.line);
        let read = read.map_err(|error| Complaint::new(format!("cannot read {}: {error}", self.name)))?;
        self.count += u64::from(read > 0);
        Ok((read > 0).then_some(self.line.as_slice()))
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
            eprintln!("{}: {words}", dialect.source);
            self.0 = words;
        }
    }
}

/// The readings of a file, one a line; lines that hold none are said on stderr and counted.
pub struct Readings {
    pub lines: Lines,
    parser: ReadingParser,
    note: DialectNote,
    lost: u64,
}

impl Readings {
    /// The readings of a bench in a file; `-` is stdin. Without a header, columns are the channels in their order.
    pub fn open(path: &Path, setup: &Setup, no_header: bool) -> Result<Self, Failure> {
        let mut columns: Columns = setup.recording_columns();
        if no_header {
            columns.header = Header::Absent;
            for (i, channel) in columns.channels.iter_mut().enumerate() {
                channel.column = Column::Number(i + 1);
            }
        }
        let lines = Lines::open(path)?;
        Ok(Self {
            parser: ReadingParser::new(&lines.name, &columns),
            note: DialectNote::default(),
            lines,
            lost: 0,
        })
    }

    /// The next reading.
    pub fn next(&mut self) -> Result<Option<Vec<f64>>, Failure> {
        while let Some(line) = self.lines.next()? {
            match self.parser.parse_line(line) {
                Ok(None) => {}
                Ok(Some(reading)) => {
                    self.note.say(self.parser.dialect());
                    return Ok(Some(reading));
                }
                Err(error) if self.parser.awaits_columns() => return Err(input::csv_complaint(&error).into()),
                Err(error) => self.lose(&error),
            }
        }
        Ok(None)
    }

    /// True until the columns are known, by a header or by `--no-header`.
    pub fn awaits_columns(&self) -> bool {
        self.parser.awaits_columns()
    }

    /// True while no line has been skipped.
    pub fn is_whole(&self) -> bool {
        self.lost == 0
    }

    /// Counts a line that gave nothing.
    pub fn lose(&mut self, error: &dyn std::fmt::Display) {
        self.lost += 1;
        eprintln!("palpate: skipped: {error}");
    }

    /// The failure that some lines gave no such `answer`, if they did not.
    pub fn finish(self, answer: &str) -> Result<(), Failure> {
        match self.lost {
            0 => Ok(()),
            lost => Err(Failure::DataLost(format!("{lost} of {} lines gave no {answer}", self.lines.count))),
        }
    }
}
