//! `palpate design`: what to build before it is built, and where to press before it is pressed.

mod positions;
mod sensors;

pub use sensors::help;

use crate::failure::{Complaint, Failure};
use crate::{input, output};
use palpate_rig::Rig;
use std::path::Path;
use toml_edit::{DocumentMut, TomlError};

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
    output::say_report("\n", report_folder)
}

/// The rig of `text` with a `change`, and its text, of which everything else stays as it was; `path` is where it will be.
fn changed_rig(
    path: &Path,
    text: &str,
    what: &str,
    change: impl FnOnce(&mut DocumentMut),
) -> Result<(Rig, String), Failure> {
    let written = with_changes(text, change)
        .map_err(|error| Complaint::new(format!("cannot put the {what} into the rig: {error}")))?;
    // Whatever else the rig says must go with it.
    Ok((input::parse_rig(path, &written)?, written))
}

fn with_changes(text: &str, change: impl FnOnce(&mut DocumentMut)) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    change(&mut document);
    Ok(document.to_string())
}
