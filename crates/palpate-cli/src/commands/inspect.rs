//! `palpate inspect`: what any of palpate's files holds, in words.

use super::learnt;
use crate::failure::Failure;
use crate::json::object;
use crate::{input, output};
use palpate_estimators::description;
use palpate_estimators::recording::{Header, Table};
use palpate_rig::{FirstRig, Hints, Rig};
use std::path::{Path, PathBuf};

/// Say in words what a file holds: a rig, a study, a locator, a recording or a study's networks.
#[derive(clap::Args)]
pub struct Arguments {
    /// The file
    file: PathBuf,
    /// The rig whose recording it is, to read a CSV by
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
    /// Print what is said as JSON, and what a locator of a surface without a model has learnt of it as numbers
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
        return output::say(lines.join("\n"));
    }
    output::say_json(&object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "file": path.display().to_string(),
        "says": lines,
        "estimator"?: fitted.as_ref().map(|locator| locator.kind()),
        "learnt"?: fitted.as_ref().and_then(learnt::of_locator).map(|(linear, names)| learnt::json(linear, &names)),
    })
}

/// Description of a CSV file: with a rig as its recording, otherwise as a table.
fn csv(path: &Path, bytes: &[u8], rig: Option<&Path>) -> Result<Vec<String>, Failure> {
    let Some(rig) = rig else { return table(path, bytes) };
    let setup = input::read_rig(rig)?.setup;
    let recording = input::read_recording(&setup, path)?;
    Ok(description::recording(&recording, &setup))
}

fn table(path: &Path, bytes: &[u8]) -> Result<Vec<String>, Failure> {
    let text = String::from_utf8_lossy(bytes);
    let comments = text.lines().take_while(|line| line.starts_with('#'));
    let mut lines: Vec<String> =
        comments.map(|line| line.trim_start_matches(['#', ' ']).to_owned()).collect();
    let table = Table::read(&path.display().to_string(), bytes, None, None);
    let Table { header, columns, rows } = table.map_err(|error| input::csv_complaint(&error))?;
    lines.push(format!("a table of {rows} rows"));
    lines.push(match header {
        Header::Present => {
            let headings: Vec<&str> = columns.iter().map(|column| column.heading.as_str()).collect();
            format!("columns: {}", headings.join(", "))
        }
        Header::Absent => format!("{} columns without names", columns.len()),
    });
    lines.extend(repeats(&path.display().to_string(), bytes));
    lines.push(
        "--rig RIG reads it as a recording of that rig; palpate init writes a first rig for it".to_owned(),
    );
    Ok(lines)
}

/// Rows that repeat the reading before them, where the table is a recording by its headings.
fn repeats(name: &str, bytes: &[u8]) -> Option<String> {
    let first = FirstRig::guess(name, bytes, &Hints::default()).ok()?;
    let rig = Rig::from_toml(&first.to_toml(name)).ok()?;
    let recording = rig.setup.read_recording(name, bytes).ok()?;
    recording.provenance.repeats.filter(|repeats| repeats.left_out > 0).map(|repeats| repeats.to_string())
}
