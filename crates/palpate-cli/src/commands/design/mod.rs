//! `palpate design`: what to build before it is built, and where to press before it is pressed.

pub mod help;
mod positions;
mod sensors;

use crate::failure::Failure;
use crate::output;
use std::path::Path;

/// Where to put the sensors, and where to press.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Sensors(sensors::Arguments),
    Positions(positions::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.what {
        What::Sensors(arguments) => sensors::run(arguments),
        What::Positions(arguments) => positions::run(arguments),
    }
}

/// Says where the rig and the report are, as far as they were asked for.
fn say_files(rig: Option<&Path>, report_folder: Option<&Path>) -> Result<(), Failure> {
    if let Some(path) = rig {
        output::say(format!("\nRig: {}", path.display()))?;
    }
    match report_folder {
        Some(folder) => output::say(format!("\nReport: {}", folder.join("report.html").display())),
        None => Ok(()),
    }
}
