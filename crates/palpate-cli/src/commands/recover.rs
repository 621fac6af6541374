//! `palpate recover`: an interrupted recording, rewritten in full.

use crate::failure::{Complaint, Failure};
use crate::output;
use crate::remark::remark;
use crate::target::{Inputs, Target};
use palpate_live::recording;
use palpate_mechanics::units::format_count;
use std::path::PathBuf;

/// Rewrite a recording that was cut off, with its index and summary, so that every MCAP reader opens it.
///
/// All messages of palpate that can be read are in the new file, with their times and numbers, and so is the locator.
#[derive(clap::Args)]
pub struct Arguments {
    /// The recording, whole, cut off or damaged
    recording: PathBuf,
    /// The new file
    #[arg(short, long, value_name = "FILE.mcap")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { recording, out } = arguments;
    Target::new(out, &Inputs::new([recording.as_path()]))?;
    if out.exists() {
        let complaint = Complaint::new(format!("{} exists already", out.display()));
        return Err(complaint.help("name another file with --out").into());
    }
    let recovery = recording::recover(recording, out).map_err(Complaint::new)?;
    if recovery.was_whole {
        remark!("{} was not cut off", recording.display());
    }
    if recovery.passed_over.foreign > 0 {
        let foreign = format_count(recovery.passed_over.foreign);
        remark!("{foreign} messages on topics of other programs are skipped");
    }
    let (readings, messages) = (format_count(recovery.readings), format_count(recovery.messages));
    let summary = format!("{}: {readings} readings, {messages} messages", out.display());
    let losses: Vec<String> = recovery.passed_over.loss().into_iter().chain(recovery.locator_fault).collect();
    if losses.is_empty() {
        return output::say(summary);
    }
    Err(Failure::DataLost(format!("{summary}; {}", losses.join("; "))))
}
