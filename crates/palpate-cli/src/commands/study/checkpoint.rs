//! `networks.csv` on disk: grows as networks that are trained in lanes are finished, survives Ctrl-C, is sorted at the end.

use crate::failure::{Complaint, Failure};
use crate::{input, output};
use palpate_studies::{ArmOutcome, CheckpointError, NetworksCsv, PreparedStudy, Trained};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Its name.
pub const NAME: &str = "networks.csv";

/// The file, open for more rows.
pub struct CheckpointFile {
    file: File,
}

impl CheckpointFile {
    /// Opens the file of a run, and reads what an earlier run left in it when `resume` asks for that.
    ///
    /// A finished run's file is replaced. An unfinished one's is replaced only when `overwrite` says so.
    pub fn open(
        out: &Path,
        table: &NetworksCsv,
        resume: bool,
        overwrite: bool,
    ) -> Result<(Self, Vec<Trained>), Failure> {
        let path = out.join(NAME);
        let unfinished = path.exists() && !out.join("results.json").exists();
        if unfinished && !resume && !overwrite {
            let complaint = Complaint::new(format!("{} is of a run that was not finished", path.display()));
            return Err(complaint
                .help("--resume goes on from it, --overwrite throws it away, --out names another folder")
                .into());
        }
        let done = if resume { read(&path, table)? } else { Vec::new() };
        // From here until the end the run counts as unfinished.
        match std::fs::remove_file(out.join("results.json")) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(output::cannot("remove", &out.join("results.json"), &error));
            }
            _ => {}
        }
        let mut rows = table.heading();
        done.iter().for_each(|trained| rows.push_str(&table.row(trained)));
        output::write_file(&path, rows.as_bytes())?;
        let file = File::options().append(true).open(&path);
        let file = file.map_err(|error| output::cannot("write", &path, &error))?;
        Ok((Self { file }, done))
    }

    /// Adds a row, in one write, so that no other row comes between.
    pub fn add(&mut self, row: &str) -> std::io::Result<()> {
        self.file.write_all(row.as_bytes())
    }
}

fn read(path: &Path, table: &NetworksCsv) -> Result<Vec<Trained>, Failure> {
    let text = input::read_text(path)?;
    let checkpoint = table.resume(&text).map_err(|error| {
        let name = path.display().to_string();
        let complaint = Complaint::new(format!("{name}: {error}"));
        match &error {
            CheckpointError::Heading { .. } => {
                complaint.help("--overwrite starts anew, --out names another folder")
            }
            CheckpointError::Row { line, .. } => {
                let row = text.lines().nth(line - 1).unwrap_or_default();
                complaint.at_line(&name, *line, row, 0..row.find(',').unwrap_or(row.len()))
            }
        }
    })?;
    if checkpoint.cut_off {
        eprintln!("warning: the last line of {} is cut off; its network is trained again", path.display());
    }
    Ok(checkpoint.done)
}

/// Replaces the file by one whose rows are in the order of the arms and seeds, whatever the threads did.
pub fn write_sorted(
    out: &Path,
    table: &NetworksCsv,
    prepared: &PreparedStudy,
    outcomes: &[ArmOutcome],
) -> Result<(), Failure> {
    let mut rows = table.heading();
    for (arm, outcome) in outcomes.iter().enumerate().filter(|(arm, _)| prepared.is_in_lanes(*arm)) {
        for fit in &outcome.fits {
            rows.push_str(&table.row(&Trained { arm, fit: fit.clone() }));
        }
    }
    output::write_file(&out.join(NAME), rows.as_bytes())
}
