//! `palpate locate`: readings in, estimates out, line by line.

use super::estimate_line;
use crate::failure::{Complaint, Failure};
use crate::lines::Lines;
use crate::{input, output};
use palpate_estimators::estimator::Locator;
use palpate_estimators::recording::{Column, Columns, Header, ReadingParser};
use palpate_estimators::setup::Setup;
use palpate_mechanics::surface::Extent;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Locate readings: CSV in (a file, or stdin), estimates out as they come.
#[derive(clap::Args)]
pub struct Arguments {
    /// The locator
    locator: PathBuf,
    /// The readings; `-` or nothing for stdin
    readings: Option<PathBuf>,
    /// The readings have no header: a row is one value a channel, in the locator's order
    #[arg(long)]
    no_header: bool,
    /// Leave a dead channel out, by its number from 1; may be repeated
    #[arg(long, value_name = "CHANNEL")]
    dead: Vec<usize>,
    /// Print one JSON object a line instead of CSV
    #[arg(long)]
    json: bool,
    /// Add the shape of a flexible digit to every estimate, at so many points from clamp to tip
    #[arg(long, value_name = "POINTS", requires = "json", value_parser = clap::value_parser!(u16).range(2..=10_000))]
    shape: Option<u16>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut locator = input::read_locator(&arguments.locator)?;
    for channel in &arguments.dead {
        // Channel 0 is none, like those beyond the last.
        let left_out = locator.leave_out(channel.wrapping_sub(1));
        left_out.map_err(|error| Complaint::new(format!("--dead {channel}: {error}")))?;
    }
    if arguments.shape.is_some() && locator.kind() != "digit" {
        let complaint = format!("--shape: a locator of kind `{}` does not tell the shape", locator.kind());
        return Err(Complaint::new(complaint).help("only the `digit` estimator does").into());
    }
    let lines = Lines::open(arguments.readings.as_deref().unwrap_or(Path::new("-")))?;
    let mut stream = Stream { locator: &locator, json: arguments.json, shape: arguments.shape, lost: 0 };
    stream.run(lines, &columns(&locator.setup, arguments.no_header))
}

/// Which columns of readings are the channels.
pub fn columns(setup: &Setup, no_header: bool) -> Columns {
    let mut columns = setup.recording_columns();
    if no_header {
        columns.header = Header::Absent;
        for (i, channel) in columns.channels.iter_mut().enumerate() {
            channel.column = Column::Number(i + 1);
        }
    }
    columns
}

struct Stream<'a> {
    locator: &'a Locator,
    json: bool,
    /// Points of the shape, where it is asked for.
    shape: Option<u16>,
    /// Rows that gave no estimate.
    lost: u64,
}

impl Stream<'_> {
    fn run(&mut self, mut lines: Lines, columns: &Columns) -> Result<(), Failure> {
        let mut out = std::io::stdout().lock();
        let mut parser = ReadingParser::new(&lines.name, columns);
        if !self.json {
            output::print(&mut out, estimate_line::heading(self.extent()).as_bytes())?;
        }
        while let Some(line) = lines.next()? {
            match parser.parse_line(line) {
                Ok(None) => {}
                Ok(Some(reading)) => self.locate(&reading, lines.count, &mut out)?,
                Err(error) if parser.awaits_columns() => return Err(input::csv_complaint(&error)),
                Err(error) => self.lose(&error),
            }
        }
        if parser.awaits_columns() {
            let complaint = Complaint::new(format!("{} holds no reading", lines.name));
            return Err(complaint.help("it must begin with a header; --no-header reads values alone").into());
        }
        match self.lost {
            0 => Ok(()),
            lost => Err(Failure::DataLost(format!("{lost} of {} lines gave no estimate", lines.count))),
        }
    }

    fn locate(&mut self, reading: &[f64], line: u64, out: &mut impl Write) -> Result<(), Failure> {
        match self.locator.locate(reading) {
            Ok(estimate) => {
                let text = if self.json {
                    let shape =
                        self.shape.and_then(|points| self.locator.shape(&estimate, usize::from(points) - 1));
                    estimate_line::json(&estimate, line, self.extent(), shape.as_ref())?
                } else {
                    estimate_line::csv(&estimate, self.extent())
                };
                output::print(out, text.as_bytes())?;
                // A reader at the other end of a pipe wants each estimate now.
                out.flush().map_err(|_| Failure::NobodyReads)
            }
            Err(error) => {
                self.lose(&error);
                Ok(())
            }
        }
    }

    fn lose(&mut self, error: &dyn std::fmt::Display) {
        self.lost += 1;
        eprintln!("palpate: skipped: {error}");
    }

    fn extent(&self) -> Extent {
        self.locator.setup.surface.extent()
    }
}
