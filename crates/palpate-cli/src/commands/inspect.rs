//! `palpate inspect`: a description of any palpate file.

use super::learnt;
use crate::failure::Failure;
use crate::json::object;
use crate::{input, output};
use palpate_estimators::description;
use palpate_rig::table_in_words;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  # Describe a locator
  palpate inspect beam.json

  # Describe a recording of a rig
  palpate inspect presses.csv --rig beam.toml";

/// Describe a rig, study, locator, recording or table of networks in words
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// File to describe
    file: PathBuf,
    /// Rig file by which a CSV is read as a recording [default: read it as a table]
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
    /// Print the description as JSON, with the fitted parameters of a locator of a surface without a model
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let extension = extension.to_ascii_lowercase();
    let mut fitted = None;
    let is_table = ["csv", "txt", "tsv", "dat", "lvm"].contains(&extension.as_str());
    let text = if is_table { String::new() } else { input::read_text(path)? };
    let lines = match extension.as_str() {
        _ if is_table => csv(path, &input::read_bytes(path)?, arguments.rig.as_deref())?,
        "toml" if text.lines().any(|line| line.trim_start().starts_with("[[arm]]")) => {
            input::parse_study(&path.display().to_string(), &text)?.in_words()
        }
        "toml" => input::read_rig(path)?.in_words(),
        _ => description::locator(fitted.insert(input::parse_locator(path, &text)?)),
    };
    if !arguments.json {
        return output::print_line(lines.join("\n"));
    }
    output::print_json(&object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "file": path.display().to_string(),
        "says": lines,
        "estimator"?: fitted.as_ref().map(|locator| locator.kind()),
        "learnt"?: fitted.as_ref().and_then(learnt::of_locator).map(|(linear, names)| learnt::json(linear, &names)),
    })
}

fn csv(path: &Path, bytes: &[u8], rig: Option<&Path>) -> Result<Vec<String>, Failure> {
    let Some(rig) = rig else { return table(path, bytes) };
    let setup = input::read_rig(rig)?.setup;
    let recording = input::read_recording(&setup, path)?;
    Ok(description::recording(&recording, &setup))
}

fn table(path: &Path, bytes: &[u8]) -> Result<Vec<String>, Failure> {
    let lines = table_in_words(&path.display().to_string(), bytes);
    let mut lines = lines.map_err(|error| input::csv_error(&error))?;
    lines.push(
        "--rig RIG reads it as a recording of that rig; palpate init writes a first rig for it".to_owned(),
    );
    Ok(lines)
}
