//! `palpate-validation real-benches`: runs an experiment, prints its table and writes its figures.
#![forbid(unsafe_code)]

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use palpate_validation::real_benches::{self, BENCHES, Options, Results};

/// Accuracy, coverage and statuses of palpate's estimators.
#[derive(Parser)]
#[command(name = "cargo xtask validate", bin_name = "cargo xtask validate")]
struct Arguments {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Subcommand)]
enum Experiment {
    /// Benches as they come, beside the same benches in a clean world
    RealBenches {
        /// Seeds of each bench
        #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=1000))]
        seeds: u64,
        /// Contacts of each seed, about
        #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=10_000))]
        contacts: u32,
        /// A bench to run, such as `real-strip`; may be given several times [default: all]
        #[arg(long, value_name = "NAME", value_parser = BENCHES.map(|(name, _)| name))]
        bench: Vec<String>,
        /// Folder for the figures, real-benches.json
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    match run(Arguments::parse().experiment) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run(experiment: Experiment) -> Result<()> {
    let Experiment::RealBenches { seeds, contacts, bench, out } = experiment;
    let mut options = Options { seeds, contacts: contacts as usize, ..Options::default() };
    if !bench.is_empty() {
        options.benches = bench;
    }
    if let Some(out) = &out {
        std::fs::create_dir_all(out).with_context(|| format!("cannot make the folder {}", out.display()))?;
    }
    let (start, is_seen) = (Instant::now(), std::io::stderr().is_terminal());
    let results = real_benches::run(&options, |what, done, of| {
        if is_seen {
            eprint!("\r\x1b[K{done} of {of}, {:.0} s: {what}", start.elapsed().as_secs_f64());
        }
    })?;
    if is_seen {
        eprint!("\r\x1b[K");
    }
    std::io::stdout().write_all(results.markdown().as_bytes()).context("cannot print the table")?;
    out.map_or(Ok(()), |out| write(&out, &results))
}

/// Writes the figures under a temporary name, and renames them.
fn write(folder: &Path, results: &Results) -> Result<()> {
    let path = folder.join("real-benches.json");
    let cannot = || format!("cannot write {}", path.display());
    let mut file = tempfile::NamedTempFile::new_in(folder).with_context(cannot)?;
    serde_json::to_writer_pretty(&mut file, results).with_context(cannot)?;
    file.write_all(b"\n").with_context(cannot)?;
    file.persist(&path).with_context(cannot)?;
    Ok(())
}
