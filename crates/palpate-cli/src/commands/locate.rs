//! `palpate locate`: an estimate for each line of readings.

use crate::estimate_columns::{EstimateColumns, EstimateRows};
use crate::failure::{Failure, UserError};
use crate::json::object;
use crate::lines::{Lines, Readings, Records};
use crate::tare::{TareOption, TareOutcome, Taring};
use crate::{input, output};
use palpate_estimators::digit::{DigitShape, ShapePoint};
use palpate_estimators::estimate_record::EstimateRecord;
use palpate_estimators::estimator::{Estimate, Locator};
use palpate_mechanics::surface::Extent;
use serde::Serialize;
use std::error::Error;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  # Locate the readings of a file
  palpate locate beam.json touches.csv

  # Locate readings from a pipe, as JSON
  cat touches.csv | palpate locate beam.json --json";

/// Locate the contact of each reading
///
/// Reads CSV line by line and prints position, force, 95 % intervals and status as CSV, each before it reads the next line.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Locator
    locator: PathBuf,
    /// CSV file of readings, `-` for stdin [default: stdin]
    readings: Option<PathBuf>,
    /// Read a CSV without a header: one column for each channel, in the locator's order
    #[arg(long)]
    no_header: bool,
    /// Ignore a channel, by its number from 1; may be repeated
    #[arg(long, value_name = "CHANNEL")]
    disable: Vec<usize>,
    #[command(flatten)]
    tare: TareOption,
    /// Print the estimate also where the status is `no_contact` or `outside_model`
    #[arg(long, conflicts_with = "json")]
    all: bool,
    /// Print one JSON object per reading, with the estimate whatever its status
    #[arg(long)]
    json: bool,
    /// Add the shape of a flexible digit to each estimate, at this number of points from clamp to tip
    #[arg(long, value_name = "POINTS", requires = "json", value_parser = clap::value_parser!(u16).range(2..=10_000))]
    shape: Option<u16>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut locator = input::read_locator(&arguments.locator)?;
    for channel in &arguments.disable {
        // An invalid channel, like those beyond the last.
        let left_out = locator.leave_out(channel.wrapping_sub(1));
        left_out.map_err(|error| UserError::new(format!("--disable {channel}: {error}")))?;
    }
    if arguments.shape.is_some() && locator.kind() != "digit" {
        let message = format!("--shape: a locator of kind `{}` does not estimate the shape", locator.kind());
        return Err(UserError::new(message).help("only the `digit` estimator does").into());
    }
    let path = arguments.readings.as_deref().unwrap_or(Path::new("-"));
    let tare = arguments.tare.in_use(&locator);
    let mut taring = Taring::new(&tare, &locator, arguments.no_header)?;
    let records = if arguments.json { Records::Json } else { Records::None };
    let mut readings = Readings::new(Lines::open(path, records)?, &locator.setup, arguments.no_header);
    let extent = locator.setup.surface().extent();
    let columns = EstimateColumns::new(&locator, EstimateRows::by_option(arguments.all));
    let mut out = std::io::stdout().lock();
    if !arguments.json {
        output::print(&mut out, columns.heading("line").as_bytes())?;
    }
    while let Some(mut reading) = readings.next()? {
        let estimate = match locate(&locator, taring.as_mut(), &mut reading, readings.time_s()) {
            Ok(estimate) => estimate,
            Err(error) => {
                readings.lines.skip_reading(&*error)?;
                continue;
            }
        };
        let line = readings.lines.count;
        let text = match &estimate {
            None if arguments.json => untouched_json(line)?,
            None => columns.empty_row(vec![line.to_string()], TARE),
            Some(estimate) if arguments.json => {
                let shape =
                    arguments.shape.and_then(|points| locator.shape(estimate, usize::from(points) - 1));
                json(estimate, line, extent, shape.as_ref())?
            }
            Some(estimate) => columns.row(vec![line.to_string()], &EstimateRecord::new(estimate, extent)),
        };
        output::print(&mut out, text.as_bytes())?;
        // The reader of a pipe gets each estimate at once.
        output::flush(&mut out)?;
    }
    if readings.awaits_columns() && readings.lines.is_whole() {
        let user_error = UserError::new(format!("{} contains no reading", readings.lines.name()));
        return Err(user_error.help("it must begin with a header; --no-header reads values alone").into());
    }
    if let Some(taring) = &taring {
        taring.finish(readings.lines.name())?;
    }
    readings.lines.finish("estimate")
}

/// Returns `None` for a reading of the baseline.
fn locate(
    locator: &Locator,
    taring: Option<&mut Taring>,
    reading: &mut [f64],
    time_s: Option<f64>,
) -> Result<Option<Estimate>, Box<dyn Error>> {
    match taring.map(|taring| taring.take(reading, time_s)).transpose()? {
        Some(TareOutcome::Baseline) => Ok(None),
        Some(TareOutcome::Located(estimate)) => Ok(Some(*estimate)),
        Some(TareOutcome::Tared) | None => Ok(Some(locator.locate(reading)?)),
    }
}

/// Status of a baseline reading, which is not located.
const TARE: &str = "tare";

fn untouched_json(line: u64) -> Result<String, Failure> {
    json_line(&object! { "line": line, "status": TARE })
}

fn json(
    estimate: &Estimate,
    line: u64,
    extent: Extent,
    shape: Option<&DigitShape>,
) -> Result<String, Failure> {
    #[derive(Serialize)]
    struct Line<S> {
        line: u64,
        #[serde(flatten)]
        estimate: EstimateRecord,
        #[serde(skip_serializing_if = "Option::is_none")]
        shape: Option<Vec<S>>,
    }
    let shape = shape.map(|shape| shape.points.iter().map(shape_point).collect());
    json_line(&Line { line, estimate: EstimateRecord::new(estimate, extent), shape })
}

fn json_line(object: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string(object).map(|line| line + "\n").map_err(|error| UserError::new(error).into())
}

/// Returns a point of the finger's centre line: arc length, position and standard deviations.
fn shape_point(point: &ShapePoint) -> impl Serialize {
    object! {
        "at_mm": point.at_m * 1e3,
        "x_mm": point.x_m * 1e3,
        "y_mm": point.y_m * 1e3,
        "sd_mm": point.sd_m * 1e3,
    }
}
