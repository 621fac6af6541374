//! `palpate simulate`: a recording from the model.

use crate::failure::{Failure, UserError};
use crate::json::object;
use crate::progress::Observer;
use crate::target::{Inputs, Target};
use crate::{input, output, target};
use palpate_estimators::arrangement::{EveryError, every};
use palpate_estimators::recording::{self, Recording, comment_with_placement};
use palpate_estimators::simulate::simulate_at_watched;
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_mechanics::units::format_count;
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, RigSimulationError};
use serde::Serialize;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  # Simulate the calibration of a rig
  palpate simulate beam.toml -o simulated.csv

  # Simulate contacts at a spacing of 5 mm, with other noise
  palpate simulate beam.toml --every \"5 mm\" --seed 1 -o dense.csv";

/// Simulate a recording from the model of a rig
///
/// Readings contain the noise of the sensors and the rig's [imperfections]. Contacts are at the training positions, at a regular spacing with
/// --every, or on a trajectory with --moving.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    /// Write the recording to FILE.csv
    #[arg(short, long, value_name = "FILE.csv")]
    out: PathBuf,
    /// Spacing of the contacts, in x and y on a plane [default: the training positions]
    #[arg(long, value_name = "LENGTH", value_parser = input::length)]
    every: Option<f64>,
    /// Move the contact along the rig's [motion] and write the time of each reading
    ///
    /// A beam vibrates under the contact; a plate is in equilibrium at every reading.
    #[arg(long, conflicts_with = "every")]
    moving: bool,
    /// Seed of noise and imperfections
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Target::new(&arguments.out, &Inputs::new([arguments.rig.as_path()]))?;
    let rig = input::read_rig(&arguments.rig)?;
    if arguments.moving {
        return move_contact(arguments, &rig, &out);
    }
    let (recording, csv) = simulated_csv(&rig, &arguments.rig, arguments.every, arguments.seed)?;
    out.write(&csv)?;
    if arguments.json {
        return output::print_json(&result(arguments, &recording, None, None));
    }
    output::print_line(format!(
        "{} rows, {} channels: {}",
        recording.rows.len(),
        recording.channels.len(),
        arguments.out.display()
    ))
}

/// Simulates the training positions, or positions at a spacing in metres.
pub fn simulated_csv(
    rig: &Rig,
    path: &Path,
    every_m: Option<f64>,
    seed: u64,
) -> Result<(Recording, Vec<u8>), Failure> {
    let observer = Observer::of_stages();
    let recording = match every_m {
        None => observer.watch(|watch| rig.simulate_watched(seed, watch)),
        Some(every_m) => {
            let repeats = rig.training.as_ref().map_or(1, |training| training.repeats);
            let setup = rig.training_setup().map_err(|error| UserError::for_path(path, error))?;
            let positions = every(rig.setup.surface().extent(), every_m).map_err(too_many)?;
            let simulate = |watch: Watch| simulate_at_watched(&setup, &positions, repeats, seed, watch);
            observer.watch(simulate).map_err(RigSimulationError::from)
        }
    };
    drop(observer);
    let recording =
        recording.map_err(|error| Failure::of_work(error, |error| UserError::for_path(path, error)))?;
    let mut csv = Vec::new();
    let comment = comment_with_placement(&comment(path, seed), recording.provenance.placement_sd_m);
    recording::write(&recording, rig.setup.surface().extent(), &comment, &mut csv).map_err(UserError::new)?;
    Ok((recording, csv))
}

fn move_contact(arguments: &Arguments, rig: &Rig, out: &Target) -> Result<(), Failure> {
    let timed = Observer::of_stages()
        .watch(|watch| rig.simulate_moving_watched(arguments.seed, watch))
        .map_err(|error| Failure::of_work(error, |error| UserError::for_path(&arguments.rig, error)))?;
    let mut csv = Vec::new();
    let swings = rig.motion.is_some_and(|moving| moving.beam.is_some());
    let how = if swings { "" } else { ", in balance at every reading, without inertia" };
    let comment = comment(&arguments.rig, arguments.seed) + how;
    recording::write_timed(&timed, rig.setup.surface().extent(), &comment, &mut csv)
        .map_err(|error| target::cannot("write", out.path(), &error))?;
    out.write(&csv)?;
    let rows = format_count(timed.recording.rows.len() as u64);
    let seconds = timed.times_s.last().copied().unwrap_or(0.0);
    let beam = rig.motion.and_then(|moving| moving.beam);
    if arguments.json {
        return output::print_json(&result(arguments, &timed.recording, Some(seconds), beam.as_ref()));
    }
    let mut told = format!("{rows} rows in {seconds:.3} s: {}", arguments.out.display());
    match beam {
        Some(beam) => {
            told += &format!(
                "\nfirst natural frequency {:.2} Hz, critical speed {:.2} m/s",
                beam.frequency_hz(1),
                beam.critical_speed_m_per_s()
            );
        }
        None => told += "\nthe plate is in balance at every reading: its inertia is neglected",
    }
    output::print_line(told)
}

fn result(
    arguments: &Arguments,
    recording: &Recording,
    seconds: Option<f64>,
    beam: Option<&ModalBeam>,
) -> impl Serialize {
    object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "rig": arguments.rig.display().to_string(),
        "recording": arguments.out.display().to_string(),
        "seed": arguments.seed,
        "rows": recording.rows.len(),
        "channels": recording.channels.len(),
        "duration_s"?: seconds,
        "natural_frequency_hz"?: beam.map(|beam| beam.frequency_hz(1)),
        "critical_speed_m_per_s"?: beam.map(|beam| beam.critical_speed_m_per_s()),
    }
}

fn comment(rig: &Path, seed: u64) -> String {
    format!("palpate {}, simulated from {}, seed {seed}", env!("CARGO_PKG_VERSION"), rig.display())
}

fn too_many(EveryError { count, .. }: EveryError) -> UserError {
    let count = if count < 1e15 { count.to_string() } else { format!("{count:.1e}") };
    UserError::new(format!(
        "--every makes {count} positions; there must be at least 1 and at most {}",
        EveryError::MOST
    ))
}
