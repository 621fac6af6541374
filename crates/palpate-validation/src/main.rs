//! `palpate-validation EXPERIMENT`: runs an experiment, prints its table and writes its figures.
#![forbid(unsafe_code)]

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use palpate_validation::{load_profiles, one_weight, real_benches};
use serde::Serialize;

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
        #[arg(long, value_name = "NAME", value_parser = real_benches::BENCHES.map(|(name, _)| name))]
        bench: Vec<String>,
        /// Folder for the figures, real-benches.json
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
    },
    /// Surfaces that were calibrated with one weight
    OneWeight {
        /// Seeds of each row
        #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=1000))]
        seeds: u64,
        /// Contacts of each seed, about
        #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=10_000))]
        contacts: u32,
        /// Folder for the figures, one-weight.json
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
    },
    /// Intervals of load profiles on the founding paper's beam
    LoadProfiles {
        /// Readings of each row
        #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        readings: u64,
        /// Seed of loads and noise
        #[arg(long, value_name = "N", default_value_t = 0)]
        seed: u64,
        /// Folder for the figures, load-profiles.json
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
    match experiment {
        Experiment::RealBenches { seeds, contacts, bench, out } => {
            make_folder(out.as_deref())?;
            let mut options =
                real_benches::Options { seeds, contacts: contacts as usize, ..Default::default() };
            if !bench.is_empty() {
                options.benches = bench;
            }
            let results = with_progress(|progress| real_benches::run(&options, progress))?;
            finish("real-benches", &results.markdown(), &results, out.as_deref())
        }
        Experiment::OneWeight { seeds, contacts, out } => {
            make_folder(out.as_deref())?;
            let options = one_weight::Options { seeds, contacts: contacts as usize };
            let results = with_progress(|progress| one_weight::run(options, progress))?;
            finish("one-weight", &results.markdown(), &results, out.as_deref())
        }
        Experiment::LoadProfiles { readings, seed, out } => {
            make_folder(out.as_deref())?;
            let options = load_profiles::Options { readings, seed };
            let results = with_progress(|progress| load_profiles::run(options, progress))?;
            finish("load-profiles", &results.markdown(), &results, out.as_deref())
        }
    }
}

fn make_folder(folder: Option<&Path>) -> Result<()> {
    let Some(folder) = folder else { return Ok(()) };
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))
}

/// Runs an experiment, with its progress on a terminal.
fn with_progress<R>(run: impl FnOnce(&(dyn Fn(&str, usize, usize) + Sync)) -> Result<R>) -> Result<R> {
    let (start, is_terminal) = (Instant::now(), std::io::stderr().is_terminal());
    let results = run(&|name, finished, of| {
        if is_terminal {
            eprint!("\r\x1b[K{finished} of {of}, {:.0} s: {name}", start.elapsed().as_secs_f64());
        }
    });
    if is_terminal {
        eprint!("\r\x1b[K");
    }
    results
}

/// Prints the table, and writes the figures to a folder under a temporary name that is then renamed.
fn finish(name: &str, table: &str, results: &impl Serialize, folder: Option<&Path>) -> Result<()> {
    std::io::stdout().write_all(table.as_bytes()).context("cannot print the table")?;
    let Some(folder) = folder else { return Ok(()) };
    let path = folder.join(format!("{name}.json"));
    let cannot = || format!("cannot write {}", path.display());
    let mut file = tempfile::NamedTempFile::new_in(folder).with_context(cannot)?;
    serde_json::to_writer_pretty(&mut file, results).with_context(cannot)?;
    file.write_all(b"\n").with_context(cannot)?;
    file.persist(&path).with_context(cannot)?;
    Ok(())
}
