//! Lines of a file of readings, or of stdin, as they come.

use crate::failure::{Complaint, Failure};
use crate::{interrupt, output};
use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal};
use std::path::Path;

/// Where lines come from.
pub struct Lines {
    /// What the source is called: the file, or "stdin".
    pub name: String,
    /// How many lines have been read.
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
            let file = File::open(path).map_err(|error| output::cannot("read", path, &error))?;
            (path.display().to_string(), Box::new(BufReader::new(file)))
        };
        Ok(Self { name, count: 0, source, line: Vec::new() })
    }

    /// The next line, with its end; `None` after the last, and once Ctrl-C was pressed.
    pub fn next(&mut self) -> Result<Option<&[u8]>, Failure> {
        self.line.clear();
        if interrupt::asked() {
            return Ok(None);
        }
        let read = self.source.read_until(b'\n', &mut self.line);
        let read = read.map_err(|error| Complaint::new(format!("cannot read {}: {error}", self.name)))?;
        self.count += u64::from(read > 0);
        Ok((read > 0).then_some(self.line.as_slice()))
    }
}
