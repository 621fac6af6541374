//! `palpate design`: sensor layouts and training positions.

mod positions;
mod sensors;

pub use sensors::help;

use crate::failure::{Failure, UserError};
use crate::{input, output};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Cancelled;
use palpate_rig::Rig;
use std::path::Path;
use toml_edit::{DocumentMut, TomlError, Value};

const EXAMPLES: &str = "\
Examples:
  # Design a layout of four sensors
  palpate design sensors beam.toml --count 4

  # Design six training positions with a short search
  palpate design positions beam.toml --count 6 --trials 2 --calibrations 1 --verify 2";

/// Design the sensor layout or the training positions of a rig
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    what: DesignCommand,
}

#[derive(clap::Subcommand)]
enum DesignCommand {
    Sensors(sensors::Arguments),
    Positions(positions::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.what {
        DesignCommand::Sensors(arguments) => sensors::run(arguments),
        DesignCommand::Positions(arguments) => positions::run(arguments),
    }
}

fn print_files(rig: Option<&Path>, report_folder: Option<&Path>) -> Result<(), Failure> {
    if let Some(path) = rig {
        output::print_line(format!("\nRig: {}", path.display()))?;
    }
    output::print_report_path("\n", report_folder)
}

/// Applies `change` to the rig `text`; `path` is the new file.
fn changed_rig(
    path: &Path,
    text: &str,
    what: &str,
    change: impl FnOnce(&mut DocumentMut),
) -> Result<(Rig, String), Failure> {
    let written = with_changes(text, change)
        .map_err(|error| UserError::new(format!("cannot put the {what} into the rig: {error}")))?;
    // The rest of the rig must be consistent with the change.
    Ok((input::parse_rig(path, &written)?, written))
}

fn design_error(error: &(dyn std::error::Error + 'static), rig: &Path, help: &str) -> Failure {
    if Cancelled::caused(error) {
        Failure::stopped()
    } else {
        UserError::for_path(rig, error).help(help).into()
    }
}

/// Converts a position to one length on a line, two on a plane.
fn toml_position(position: Position, extent: Extent, in_mm: fn(f64) -> f64) -> Value {
    let lengths = extent.coordinates_m(position).map(|at_m| format!("{} mm", in_mm(at_m)));
    match extent {
        Extent::Line { .. } => lengths.collect::<String>().into(),
        Extent::Plane { .. } => Value::Array(lengths.collect()),
    }
}

fn to_micrometre(length_m: f64) -> f64 {
    (length_m * 1e6).round() / 1e3
}

fn with_changes(text: &str, change: impl FnOnce(&mut DocumentMut)) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    change(&mut document);
    Ok(document.to_string())
}
