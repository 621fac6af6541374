//! `cargo xtask validate [NAME…]`: runs experiments, prints their tables and writes their files.
#![forbid(unsafe_code)]

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Parser;
use palpate_validation::check::worse_figures;
use palpate_validation::experiment::{Experiment, Size};
use palpate_validation::registry::by_names;
use palpate_validation::report::Report;

/// Accuracy, coverage and statuses of palpate's estimators.
#[derive(Parser)]
#[command(name = "cargo xtask validate", bin_name = "cargo xtask validate")]
struct Arguments {
    /// Experiments to run [default: all]
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Few repetitions, written to target/validation instead of docs/validation
    #[arg(long)]
    quick: bool,
    /// Compare with the figures in docs/validation instead of writing them; exit code 1 where one is worse beyond its Monte-Carlo error
    #[arg(long)]
    check: bool,
    /// List the experiments
    #[arg(long, conflicts_with_all = ["quick", "check"])]
    list: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// False if a check finds a worse figure.
fn run(arguments: &Arguments) -> Result<bool> {
    let experiments = by_names(&arguments.names)?;
    if arguments.list {
        experiments
            .iter()
            .try_for_each(|Experiment { name, title, .. }| print(&format!("{name:<24} {title}\n")))?;
        return Ok(true);
    }
    let size = if arguments.quick { Size::Quick } else { Size::Full };
    let (stored, written) = (workspace().join("docs/validation"), folder(size));
    let mut worse = Vec::new();
    for experiment in &experiments {
        // A missing file is an error before the experiment takes its time.
        let before = arguments.check.then(|| Report::read(&stored, experiment.name)).transpose()?;
        let start = Instant::now();
        let report = with_progress(experiment.name, |progress| Report::run(experiment, size, progress))?;
        eprintln!("{}: {:.0} s", experiment.name, start.elapsed().as_secs_f64());
        match before {
            Some(before) => worse.extend(worse_figures(&before, &report)),
            None => {
                print(&report.markdown())?;
                report.write(&written)?;
            }
        }
    }
    if arguments.check {
        worse.iter().try_for_each(|line| print(&format!("{line}\n")))?;
        print(&format!("{} figures are worse than stored\n", worse.len()))?;
    }
    Ok(worse.is_empty())
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn folder(size: Size) -> PathBuf {
    workspace().join(size.pick("docs/validation", "target/validation"))
}

fn print(text: &str) -> Result<()> {
    std::io::stdout().write_all(text.as_bytes()).context("cannot print the table")
}

/// Shows progress on a terminal.
fn with_progress<R>(
    experiment: &str,
    run: impl FnOnce(&(dyn Fn(&str, usize, usize) + Sync)) -> Result<R>,
) -> Result<R> {
    let (start, is_terminal) = (Instant::now(), std::io::stderr().is_terminal());
    let results = run(&|name, finished, of| {
        if is_terminal {
            let seconds = start.elapsed().as_secs_f64();
            eprint!("\r\x1b[K{experiment}: {finished} of {of}, {seconds:.0} s: {name}");
        }
    });
    if is_terminal {
        eprint!("\r\x1b[K");
    }
    results
}
