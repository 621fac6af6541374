//! `palpate design positions`: where to press, against even positions; and the next press of a recording begun.

mod findings;
mod next;
mod rig_file;
mod tables;

use super::{help, say_files};
use crate::failure::{Complaint, Failure};
use crate::progress::Observer;
use crate::recording_files::RecordingFiles;
use crate::{input, output};
use palpate_design::positions::{Placed, PositionDesign, PositionError, PositionProblem, best_placed};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_report::{PositionDesignReport, position_design_report};
use palpate_rig::Rig;
use std::path::{Path, PathBuf};

/// Where to press: training positions by rules and by search, scored by the location error after calibrating.
///
/// Calibrations of the rig's estimator are simulated, with noise; contacts are those of the rig's [design], or come from all
/// over. With --data, a recording begun: where to press next, what that gains, and when to stop.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    /// Training positions [default: the rig's, or 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    count: Option<u16>,
    /// Presses at each position [default: the rig's, or 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeats: Option<u16>,
    /// Arrangements that the search may try
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    trials: u32,
    /// Simulated calibrations of each, while searching
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    calibrations: u16,
    /// Calibrations with fresh noise, which the figures are of
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    verify: u16,
    /// A recording begun: say where to press next
    #[arg(long, value_name = "FILE.csv")]
    data: Option<PathBuf>,
    /// The recording's contacts, where --data has the readings alone; row by row
    #[arg(long, value_name = "FILE.csv", requires = "data")]
    contacts: Option<PathBuf>,
    /// With --data: stop once endlessly many presses would lower the error by less than this, in %
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0, value_parser = percent, requires = "data")]
    stop_below: f64,
    /// Seed of all simulations and fits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write the rig with the best positions
    #[arg(short, value_name = "RIG", conflicts_with = "data")]
    output: Option<PathBuf>,
    /// Folder for a report
    #[arg(long, value_name = "DIR", conflicts_with = "data")]
    out: Option<PathBuf>,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

/// Everything that was found out.
pub struct Outcome<'a> {
    rig: &'a Path,
    estimator: &'static str,
    problem: &'a PositionProblem,
    placed: Vec<Placed>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let text = input::read_text(&arguments.rig)?;
    let rig = input::parse_rig(&arguments.rig, &text)?;
    if let Some(path) = &arguments.output {
        output::check_writable(path)?;
    }
    let files = RecordingFiles { data: arguments.data.clone(), contacts: arguments.contacts.clone() };
    if let Some(recording) = files.read(&rig.setup)? {
        return next::run(arguments, &rig, &recording);
    }
    let complain = |error: PositionError| complaint(&error, &arguments.rig);
    let problem = PositionProblem::new(&rig.setup, &what_to_design(arguments, &rig)).map_err(complain)?;
    let observer = Observer::of_stages();
    let observe = |progress| observer.observe(progress);
    let placed = problem.all(Watch::new(&observe)).map_err(complain)?;
    drop(observer);
    let outcome = Outcome { rig: &arguments.rig, estimator: rig.estimator.kind(), problem: &problem, placed };
    if let (Some(path), Some(best)) = (&arguments.output, best_placed(&outcome.placed)) {
        rig_file::write(path, &text, best, problem.design().repeats, problem.extent())?;
    }
    if let Some(out) = &arguments.out {
        write_report(&outcome, &rig, out)?;
    }
    if arguments.json {
        return output::say_json(&findings::findings(&outcome));
    }
    tables::print(&outcome)?;
    say_files(arguments.output.as_deref(), arguments.out.as_deref())
}

/// What the rig and the command line say.
fn what_to_design(arguments: &Arguments, rig: &Rig) -> PositionDesign {
    let design = rig.training.as_ref().map_or_else(PositionDesign::default, PositionDesign::like);
    let design = rig.design.iter().fold(design, PositionDesign::contacts_of);
    PositionDesign {
        estimator: rig.estimator.clone(),
        count: arguments.count.map_or(design.count, usize::from),
        repeats: arguments.repeats.map_or(design.repeats, usize::from),
        calibrations: usize::from(arguments.calibrations),
        trials: arguments.trials as usize,
        verifications: usize::from(arguments.verify),
        stop_percent: arguments.stop_below,
        seed: arguments.seed,
        ..design
    }
}

fn write_report(outcome: &Outcome, rig: &Rig, out: &Path) -> Result<(), Failure> {
    let report = PositionDesignReport {
        title: &format!("Training positions for {}", outcome.rig.display()),
        setup: &rig.setup,
        estimator: outcome.estimator,
        problem: outcome.problem,
        placed: &outcome.placed,
    };
    output::write_report(out, position_design_report(&report))
}

fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').trim().parse::<f64>() {
        Ok(value) if value > 0.0 && value < 100.0 => Ok(value),
        _ => Err(format!("`{text}` must be a number greater than 0 and less than 100")),
    }
}

fn complaint(error: &PositionError, rig: &Path) -> Failure {
    if Cancelled::caused(error) {
        return Failure::stopped();
    }
    Complaint::new(format!("{}: {error}", rig.display())).help(help::for_positions(error)).into()
}
