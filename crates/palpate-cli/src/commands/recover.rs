//! `palpate recover`: an interrupted recording, rewritten in full.

use crate::failure::{Failure, UserError};
use crate::json::object;
use crate::output;
use crate::remark::remark;
use crate::target::{Inputs, Target};
use palpate_live::recording;
use palpate_mechanics::units::format_count;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  # Repair a recording
  palpate recover session.mcap -o repaired.mcap";

/// Repair an interrupted recording
///
/// Copies all readable messages and the locator into a file with index and summary, which every MCAP reader opens.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Recording: whole, truncated or damaged
    recording: PathBuf,
    /// Write the repaired recording to FILE.mcap, which must not exist
    #[arg(short, long, value_name = "FILE.mcap")]
    out: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { recording, out, .. } = arguments;
    Target::new(out, &Inputs::new([recording.as_path()]))?;
    if out.exists() {
        let user_error = UserError::new(format!("{} exists already", out.display()));
        return Err(user_error.help("name another file with --out").into());
    }
    let recovery = recording::recover(recording, out).map_err(UserError::new)?;
    if recovery.was_whole {
        remark!("{} was not cut off", recording.display());
    }
    if recovery.skipped.foreign > 0 {
        let foreign = format_count(recovery.skipped.foreign);
        remark!("{foreign} messages on topics of other programs are skipped");
    }
    let (readings, messages) = (format_count(recovery.readings), format_count(recovery.messages));
    let summary = format!("{}: {readings} readings, {messages} messages", out.display());
    let losses: Vec<String> = recovery.skipped.loss().into_iter().chain(recovery.locator_fault).collect();
    if arguments.json {
        output::print_json(&object! {
            "palpate": env!("CARGO_PKG_VERSION"),
            "recording": out.display().to_string(),
            "readings": recovery.readings,
            "messages": recovery.messages,
            "foreign_messages": recovery.skipped.foreign,
            "was_whole": recovery.was_whole,
            "losses": &losses,
        })?;
        if losses.is_empty() {
            return Ok(());
        }
    }
    if losses.is_empty() {
        return output::print_line(summary);
    }
    Err(Failure::DataLost(format!("{summary}; {}", losses.join("; "))))
}
