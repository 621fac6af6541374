//! `palpate init`: a first rig for an existing recording.

use super::sample_benches::{self, Request, SampleBench};
use crate::failure::{Failure, UserError};
use crate::json::object;
use crate::remark::remark;
use crate::target::{Inputs, Target};
use crate::{input, output};
use palpate_estimators::description;
use palpate_estimators::recording::{Decimal, Separator};
use palpate_rig::{FirstRig, FirstRigError, Hints, Rig};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  # Write a rig with recordings into the current folder, and print the next commands
  palpate init --example beam .

  # Write a rig for a recording
  palpate init presses.csv -o first.toml

  # Name the column of the force, and print the rig
  palpate init presses.csv --force 2";

/// Write a first rig for a recording, or an example with its data
///
/// Comments in the rig mark what is guessed. Name a column by its heading, with or without the unit, or by its number from 1 if no heading is
/// that number.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Recording: positions, channels, and forces if they were measured; with --example the folder to write into
    #[arg(value_name = "RECORDING|DIR")]
    recording: PathBuf,
    /// Write the rig to RIG.toml [default: stdout]
    #[arg(short, long, value_name = "RIG.toml", group = "written")]
    out: Option<PathBuf>,
    /// Write an example into DIR: rig, presses and touches, and print the next commands
    #[arg(long, value_name = "BENCH", group = "written", conflicts_with_all = [
        "position", "x", "y", "force", "time", "nuisance", "untouched", "channel", "separator", "decimal",
    ])]
    example: Option<SampleBench>,
    /// Overwrite existing files
    #[arg(long, requires = "written")]
    overwrite: bool,
    /// Column of the position on a line [default: guessed]
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["x", "y"])]
    position: Option<String>,
    /// Column of the position along a plane [default: guessed]
    #[arg(long, value_name = "COLUMN", requires = "y")]
    x: Option<String>,
    /// Column of the position across a plane [default: guessed]
    #[arg(long, value_name = "COLUMN", requires = "x")]
    y: Option<String>,
    /// Column of the force [default: guessed]
    #[arg(long, value_name = "COLUMN")]
    force: Option<String>,
    /// Column of the time [default: guessed]
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// Column of a nuisance coordinate: it changes the readings and is unknown in use
    #[arg(long, value_name = "COLUMN")]
    nuisance: Option<String>,
    /// Column that marks untouched rows by 1, true or yes
    #[arg(long, value_name = "COLUMN")]
    untouched: Option<String>,
    /// Column of a channel; may be repeated [default: all other columns]
    #[arg(long, value_name = "COLUMN")]
    channel: Vec<String>,
    /// Separator of the fields: comma, semicolon, tab, pipe or blanks [default: detected]
    #[arg(long, value_name = "WORD", value_parser = separator)]
    separator: Option<Separator>,
    /// Decimal mark: point or comma [default: detected]
    #[arg(long, value_name = "WORD", value_parser = decimal)]
    decimal: Option<Decimal>,
    /// Print the result as JSON
    #[arg(long, requires = "written")]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(bench) = arguments.example {
        let Arguments { overwrite, json, .. } = *arguments;
        return sample_benches::run(&Request { bench, folder: &arguments.recording, overwrite, json });
    }
    let out = arguments.target()?;
    let name = arguments.recording.display().to_string();
    let bytes = input::read_bytes(&arguments.recording)?;
    let first =
        FirstRig::infer(&name, &bytes, &arguments.hints()).map_err(|error| user_error(&error, &name))?;
    let rig_name = arguments.out.as_ref().map_or("RIG.toml".to_owned(), |out| out.display().to_string());
    let text = first.to_toml(&rig_name);
    // Parsed as in every later command, so that warnings about file and channels appear now.
    let rig = Rig::from_toml(&text).map_err(UserError::new)?;
    let recording = rig.setup.read_recording(&name, bytes.as_slice());
    let recording = recording.map_err(|error| input::csv_error(&error))?;
    input::print_dialects(&recording);
    first.warnings().iter().for_each(|warning| remark!("warning: {name}: {warning}"));
    if recording.has_unreliable_noise() {
        let presses = recording.rows.iter().filter(|row| row.touches()).count();
        remark!("warning: {name}: {}", description::noise_is_hardly_told(presses));
    }
    let Some(out) = out else {
        return output::print(&mut std::io::stdout().lock(), text.as_bytes());
    };
    out.write(text.as_bytes())?;
    if arguments.json {
        return output::print_json(&object! {
            "palpate": env!("CARGO_PKG_VERSION"),
            "rig": &rig_name,
            "files": [&rig_name],
            "commands": first.next_commands(&rig_name),
        });
    }
    output::print_line(format!("{rig_name}: {}", first.summary()))?;
    output::print_line("Check what is marked as a guess there; then:")?;
    first.next_commands(&rig_name).iter().try_for_each(|command| output::print_line(format!("  {command}")))
}

impl Arguments {
    fn target(&self) -> Result<Option<Target>, Failure> {
        let Some(out) = &self.out else { return Ok(None) };
        let target = Target::new(out, &Inputs::new([self.recording.as_path()]))?;
        if out.exists() && !self.overwrite {
            let user_error = UserError::new(format!("{} exists already", out.display()));
            return Err(user_error.help("name another file, or overwrite it with --overwrite").into());
        }
        Ok(Some(target))
    }

    fn hints(&self) -> Hints {
        Hints {
            position: self.position.clone(),
            x: self.x.clone(),
            y: self.y.clone(),
            force: self.force.clone(),
            time: self.time.clone(),
            nuisance: self.nuisance.clone(),
            untouched: self.untouched.clone(),
            channels: self.channel.clone(),
            separator: self.separator,
            decimal: self.decimal,
        }
    }
}

fn user_error(error: &FirstRigError, name: &str) -> Failure {
    let user_error = match error {
        FirstRigError::Csv(error) => input::csv_error(error),
        _ => UserError::new(format!("{name}: {error}")),
    };
    match error.help() {
        Some(help) => user_error.help(help).into(),
        None => user_error.into(),
    }
}

fn separator(text: &str) -> Result<Separator, String> {
    word(text, &Separator::ALL, Separator::name)
}

fn decimal(text: &str) -> Result<Decimal, String> {
    word(text, &Decimal::ALL, Decimal::name)
}

fn word<T: Copy>(text: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
    let found = all.iter().copied().find(|value| name(*value) == text);
    found.ok_or_else(|| {
        let known: Vec<&str> = all.iter().map(|value| name(*value)).collect();
        format!("`{text}` is not one of {}", known.join(", "))
    })
}
