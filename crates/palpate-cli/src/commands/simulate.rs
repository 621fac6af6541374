//! `palpate simulate`: a recording from the model.

use crate::failure::{Complaint, Failure};
use crate::progress::Observer;
use crate::target::{Inputs, Target};
use crate::{input, output, target};
use palpate_estimators::arrangement::{EveryError, every};
use palpate_estimators::recording::{self, comment_with_placement};
use palpate_estimators::simulate::simulate_at_watched;
use palpate_mechanics::units::format_count;
use palpate_numerics::watch::Watch;
use palpate_rig::{Rig, RigSimulationError};
use std::path::PathBuf;

/// Make a recording from the model, with the sensors' noise and faults.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    /// The recording to write
    #[arg(short, long, value_name = "FILE.csv")]
    out: PathBuf,
    /// Press every so far, on a plane both ways, instead of at the training positions, as in `--every "1 mm"`
    #[arg(long, value_name = "LENGTH", value_parser = input::length)]
    every: Option<f64>,
    /// Move the contact as the rig's [motion] says, over a beam that swings or a plate in balance, and write the time of each reading
    #[arg(long, conflicts_with = "every")]
    moving: bool,
    /// Seed of noise and faults
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Target::new(&arguments.out, &Inputs::new([arguments.rig.as_path()]))?;
    let rig = input::read_rig(&arguments.rig)?;
    if arguments.moving {
        return move_contact(arguments, &rig, &out);
    }
    let observer = Observer::of_stages();
    let recording = match arguments.every {
        None => observer.watch(|watch| rig.simulate_watched(arguments.seed, watch)),
        Some(every_m) => {
            let repeats = rig.training.as_ref().map_or(1, |training| training.repeats);
            let setup = rig.pressed_setup().map_err(|error| Complaint::about(&arguments.rig, error))?;
            let positions = every(rig.setup.surface().extent(), every_m).map_err(too_many)?;
            let simulate =
                |watch: Watch| simulate_at_watched(&setup, &positions, repeats, arguments.seed, watch);
            observer.watch(simulate).map_err(RigSimulationError::from)
        }
    };
    drop(observer);
    let recording = recording
        .map_err(|error| Failure::of_work(error, |error| Complaint::about(&arguments.rig, error)))?;
    let mut csv = Vec::new();
    let comment = comment_with_placement(&comment(arguments), recording.provenance.placement_sd_m);
    recording::write(&recording, rig.setup.surface().extent(), &comment, &mut csv)
        .map_err(|error| target::cannot("write", out.path(), &error))?;
    out.write(&csv)?;
    output::say(format!(
        "{} rows, {} channels: {}",
        recording.rows.len(),
        recording.channels.len(),
        arguments.out.display()
    ))
}

fn move_contact(arguments: &Arguments, rig: &Rig, out: &Target) -> Result<(), Failure> {
    let timed = Observer::of_stages()
        .watch(|watch| rig.simulate_moving_watched(arguments.seed, watch))
        .map_err(|error| Failure::of_work(error, |error| Complaint::about(&arguments.rig, error)))?;
    let mut csv = Vec::new();
    let swings = rig.motion.is_some_and(|moving| moving.beam.is_some());
    let how = if swings { "" } else { ", in balance at every reading, without inertia" };
    let comment = comment(arguments) + how;
    recording::write_timed(&timed, rig.setup.surface().extent(), &comment, &mut csv)
        .map_err(|error| target::cannot("write", out.path(), &error))?;
    out.write(&csv)?;
    let rows = format_count(timed.recording.rows.len() as u64);
    let seconds = timed.times_s.last().copied().unwrap_or(0.0);
    let mut told = format!("{rows} rows in {seconds:.3} s: {}", arguments.out.display());
    match rig.motion.and_then(|moving| moving.beam) {
        Some(beam) => {
            told += &format!(
                "\nfirst natural frequency {:.2} Hz, critical speed {:.2} m/s",
                beam.frequency_hz(1),
                beam.critical_speed_m_per_s()
            );
        }
        None => told += "\nthe plate is in balance at every reading: its inertia is neglected",
    }
    output::say(told)
}

/// Comment at the head of a recording: its origin.
fn comment(arguments: &Arguments) -> String {
    format!(
        "palpate {}, simulated from {}, seed {}",
        env!("CARGO_PKG_VERSION"),
        arguments.rig.display(),
        arguments.seed
    )
}

fn too_many(EveryError { count, .. }: EveryError) -> Complaint {
    let count = if count < 1e15 { count.to_string() } else { format!("{count:.1e}") };
    Complaint::new(format!(
        "--every makes {count} positions; there must be at least 1 and at most {}",
        EveryError::MOST
    ))
}
