//! `palpate simulate`: a recording from the model.

use crate::failure::{Complaint, Failure};
use crate::{input, output};
use palpate::arrangement::{EveryError, every};
use palpate::recording;
use palpate::simulate::{simulate, simulate_at};
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
    /// Seed of noise and faults
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let rig = input::read_rig(&arguments.rig)?;
    let recording = match arguments.every {
        None => simulate(&rig, arguments.seed),
        Some(every_m) => {
            let repeats = rig.training.as_ref().map_or(1, |training| training.repeats);
            simulate_at(
                &rig.pressed_bench(),
                &every(rig.bench.surface.extent(), every_m).map_err(too_many)?,
                repeats,
                arguments.seed,
            )
        }
    };
    let recording =
        recording.map_err(|error| Complaint::new(format!("{}: {error}", arguments.rig.display())))?;
    let mut csv = Vec::new();
    let comment = format!(
        "palpate {}, simulated from {}, seed {}",
        env!("CARGO_PKG_VERSION"),
        arguments.rig.display(),
        arguments.seed
    );
    recording::write(&recording, rig.bench.surface.extent(), &comment, &mut csv)
        .map_err(|error| output::cannot("write", &arguments.out, &error))?;
    output::write_file(&arguments.out, &csv)?;
    output::say(format!(
        "{} rows, {} channels: {}",
        recording.rows.len(),
        recording.channels.len(),
        arguments.out.display()
    ))
}

fn too_many(EveryError { count, .. }: EveryError) -> Complaint {
    Complaint::new(format!(
        "--every makes {count} positions; there must be at least 1 and at most {}",
        EveryError::MOST
    ))
}
