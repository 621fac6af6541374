//! `palpate init`: a first rig for an existing recording.

use crate::failure::{Complaint, Failure};
use crate::remark::remark;
use crate::target::{Inputs, Target};
use crate::{input, output};
use palpate_estimators::description;
use palpate_estimators::recording::{Decimal, Separator};
use palpate_rig::{FirstRig, FirstRigError, Hints, Rig};
use std::path::PathBuf;

/// Look at a recording and write a first rig for it, its guesses as comments.
///
/// A column is named by its heading, with or without the unit behind it, or by its number from 1 where no heading is that number.
#[derive(clap::Args)]
pub struct Arguments {
    /// The recording: positions, channels, and forces where they were measured
    recording: PathBuf,
    /// The rig to write [default: print it]
    #[arg(short, long, value_name = "RIG.toml")]
    out: Option<PathBuf>,
    /// Write over a rig that is there
    #[arg(long, requires = "out")]
    overwrite: bool,
    /// Column of the position along a line
    #[arg(long, value_name = "NAME", conflicts_with_all = ["x", "y"])]
    position: Option<String>,
    /// Column of the position along a plane
    #[arg(long, value_name = "NAME", requires = "y")]
    x: Option<String>,
    /// Column of the position across a plane
    #[arg(long, value_name = "NAME", requires = "x")]
    y: Option<String>,
    /// Column of the force
    #[arg(long, value_name = "NAME")]
    force: Option<String>,
    /// Column of the time
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    /// Column of a coordinate that readings depend on and that is unknown in use
    #[arg(long, value_name = "NAME")]
    nuisance: Option<String>,
    /// Column that marks the rows in which nothing touched, with 1, true or yes
    #[arg(long, value_name = "NAME")]
    untouched: Option<String>,
    /// Column of a channel; may be repeated
    #[arg(long, value_name = "NAME")]
    channel: Vec<String>,
    /// Separator of the fields: comma, semicolon, tab, pipe or blanks [default: that of the file]
    #[arg(long, value_name = "WORD", value_parser = separator)]
    separator: Option<Separator>,
    /// Decimal mark: point or comma [default: that of the file]
    #[arg(long, value_name = "WORD", value_parser = decimal)]
    decimal: Option<Decimal>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = arguments.target()?;
    let name = arguments.recording.display().to_string();
    let bytes = input::read_bytes(&arguments.recording)?;
    let first =
        FirstRig::guess(&name, &bytes, &arguments.hints()).map_err(|error| complaint(&error, &name))?;
    let rig_name = arguments.out.as_ref().map_or("RIG.toml".to_owned(), |out| out.display().to_string());
    let text = first.to_toml(&rig_name);
    // Read as in every later command, so that its warnings about file and channels appear now.
    let rig = Rig::from_toml(&text).map_err(Complaint::new)?;
    let recording = rig.setup.read_recording(&name, bytes.as_slice());
    let recording = recording.map_err(|error| input::csv_complaint(&error))?;
    input::say_dialects(&recording);
    first.warnings().iter().for_each(|warning| remark!("warning: {name}: {warning}"));
    if recording.hardly_tells_noise() {
        let presses = recording.rows.iter().filter(|row| row.touches()).count();
        remark!("warning: {name}: {}", description::noise_is_hardly_told(presses));
    }
    let Some(out) = out else {
        return output::print(&mut std::io::stdout().lock(), text.as_bytes());
    };
    out.write(text.as_bytes())?;
    output::say(format!("{rig_name}: {}", first.summary()))?;
    output::say("Check what is marked as a guess there; then:")?;
    first.next_commands(&rig_name).iter().try_for_each(|command| output::say(format!("  {command}")))
}

impl Arguments {
    /// The rig's file, which must not exist unless it is to be overwritten.
    fn target(&self) -> Result<Option<Target>, Failure> {
        let Some(out) = &self.out else { return Ok(None) };
        let target = Target::new(out, &Inputs::new([self.recording.as_path()]))?;
        if out.exists() && !self.overwrite {
            let complaint = Complaint::new(format!("{} exists already", out.display()));
            return Err(complaint.help("name another file, or overwrite it with --overwrite").into());
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

fn complaint(error: &FirstRigError, name: &str) -> Failure {
    let complaint = match error {
        FirstRigError::Csv(error) => input::csv_complaint(error),
        _ => Complaint::new(format!("{name}: {error}")),
    };
    match error.help() {
        Some(help) => complaint.help(help).into(),
        None => complaint.into(),
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
