//! `palpate fit`: calibration of an estimator.

use super::learnt;
use crate::cost::MemoryOption;
use crate::failure::{Failure, UserError};
use crate::input::RecordingFiles;
use crate::json::object;
use crate::progress::Observer;
use crate::remark::remark;
use crate::tare::print_drift;
use crate::target::{Inputs, Target};
use crate::{input, output};
use palpate_estimators::description;
use palpate_estimators::estimator::{CHOICE_FOLDS, CandidateErrors, Choice, FitCost, TimeLimit};
use palpate_estimators::fit::FitTask;
use palpate_estimators::network::{TrainingOutcome, TrainingStatus};
use palpate_estimators::recording::Recording;
use palpate_mechanics::units::{format_count, format_length_mm};
use palpate_rig::Rig;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  # Fit to a recording of presses
  palpate fit beam.toml --data presses.csv -o beam.json

  # Fit to a simulated calibration, before a bench exists
  palpate fit beam.toml -o simulated.json";

/// Fit the estimator of a rig and write a locator
///
/// The estimator is fitted to a recording of presses, or without --data to a simulated calibration.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    #[command(flatten)]
    files: RecordingFiles,
    /// Write the locator to this file
    #[arg(short, long, value_name = "LOCATOR")]
    out: PathBuf,
    /// Seed of the fit and of the simulation
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Longest time of the comparison by which `auto` chooses an estimator, such as "2 min"
    ///
    /// A candidate that is not fitted in time is stopped and excluded.
    #[arg(long, value_name = "TIME", default_value = "300 s", value_parser = input::time)]
    time_limit: f64,
    #[command(flatten)]
    memory: MemoryOption,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = Inputs::new(arguments.files.paths().chain([arguments.rig.as_path()]));
    let out = Target::new(&arguments.out, &inputs)?;
    let rig = input::read_rig(&arguments.rig)?;
    let recording = match arguments.files.read(&rig.setup)? {
        Some(recording) => recording,
        None => {
            let simulated =
                Observer::of_stages().watch(|watch| rig.simulate_calibration_watched(arguments.seed, watch));
            simulated.map_err(|error| {
                let about = |error| UserError::for_path(&arguments.rig, error);
                Failure::of_work(error, |error| about(error).help("--data names a recording to fit"))
            })?
        }
    };
    let cost = cost(&rig, &recording, arguments);
    arguments.memory.check(&rig.estimator, cost, &rig.setup, &recording)?;
    let choice = decide(&rig, &recording, arguments)?;
    let chosen = choice.as_ref().map_or(&rig.estimator, |choice| &choice.best);
    let needed = chosen.positions_needed();
    recording.check_distinct_positions(needed).map_err(UserError::new)?;
    let task = FitTask::new(&rig.setup, &recording).seed(arguments.seed);
    let locator = Observer::of_rounds(chosen.most_rounds())
        .watch(|watch| rig.estimator.fit_decided(task.watch(watch), choice.as_ref()))
        .map_err(|error| Failure::from_error(&error))?;
    let training = locator.training_outcome();
    if let Some(TrainingOutcome { status: TrainingStatus::Diverged, epochs, .. }) = training {
        let epochs = format_count(u64::from(epochs));
        return Err(Failure::GoalMissed(format!(
            "training diverged after {epochs} epochs, and no file was written: lower the learning rate or the momentum"
        )));
    }
    let learnt = learnt::of_locator(&locator);
    let json = locator.to_json().map_err(UserError::new)?;
    out.write(json.as_bytes())?;
    if arguments.json {
        return output::print_json(&object! {
            "palpate": env!("CARGO_PKG_VERSION"),
            "locator": arguments.out.display().to_string(),
            "estimator": locator.kind(),
            "seed": arguments.seed,
            "rows": recording.rows.len(),
            "training"?: training,
            "interval_check": locator.interval_check,
            "choice"?: choice_json(&locator.provenance.choice),
            "learnt"?: learnt.map(|(linear, names)| learnt::json(linear, &names)),
        });
    }
    let ended = training.map_or_else(String::new, |outcome| format!("; {}", in_words(outcome)));
    output::print_line(format!(
        "{} fitted to {} rows{ended}: {}",
        locator.kind(),
        recording.rows.len(),
        arguments.out.display()
    ))?;
    let mut lines =
        learnt.map(|(linear, names)| description::summary_lines(linear, &names)).unwrap_or_default();
    lines.extend(description::interval_check(locator.interval_check.as_ref()));
    lines.iter().try_for_each(|line| output::print_line(format!("  {line}")))
}

fn cost(rig: &Rig, recording: &Recording, arguments: &Arguments) -> FitCost {
    let cost = rig.estimator.fit_cost(&rig.setup, recording);
    let task = FitTask::new(&rig.setup, recording);
    let Some(candidates) = rig.estimator.candidates(task) else { return cost.with_interval_check(recording) };
    let choice = cost.seconds.min(arguments.time_limit);
    // The chosen estimator takes at most as long as the slowest one.
    let costs = candidates.iter().map(|candidate| candidate.fit_cost(&rig.setup, recording));
    let slowest = costs.fold(FitCost { seconds: 0.0, ..cost }, |slowest, cost| FitCost {
        seconds: slowest.seconds.max(cost.seconds),
        memory_bytes: slowest.memory_bytes.max(cost.memory_bytes),
    });
    FitCost { seconds: choice + slowest.with_interval_check(recording).seconds, ..slowest }
}

fn decide(rig: &Rig, recording: &Recording, arguments: &Arguments) -> Result<Option<Choice>, Failure> {
    let task = FitTask::new(&rig.setup, recording).seed(arguments.seed);
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let seconds = arguments.time_limit;
    let limit = TimeLimit { clock: &clock, seconds };
    let choice = Observer::of_stages()
        .watch(|watch| rig.estimator.decide(task.watch(watch), Some(limit)))
        .map_err(|error| Failure::from_error(&error))?;
    let Some(choice) = choice else {
        if rig.estimator.candidates(task).is_some() {
            remark!(
                "structure: by the evidence of the presses, because none was compared within {seconds} s"
            );
        }
        return Ok(None);
    };
    if let Some(spans) = &choice.drift {
        print_drift(&rig.setup, spans);
    }
    remark!(
        "chosen: {}, by mean error × interval score at held-out positions ({CHOICE_FOLDS} folds)",
        choice.best.name()
    );
    remark!("{:<26} {:>12} {:>20} {:>14}", "", "mean error", "score of 95 %", "95 % covers");
    for CandidateErrors { name, mean_error_m, interval_score_m, coverage_percent } in &choice.candidates {
        let covers = coverage_percent.map_or_else(|| "–".to_owned(), |percent| format!("{percent:.1} %"));
        let [error, score] = [mean_error_m, interval_score_m].map(|length_m| format_length_mm(*length_m));
        remark!("{name:<26} {error:>12} {score:>20} {covers:>14}");
    }
    for (name, reason) in &choice.omitted {
        remark!("{name:<26} skipped: {reason}");
    }
    Ok(Some(choice))
}

/// The chosen candidate is first; `None` if the rig names its estimator.
fn choice_json(tried: &[CandidateErrors]) -> Option<Vec<impl Serialize>> {
    let one = |tried: &CandidateErrors| {
        object! {
            "estimator": tried.name.clone(),
            "mean_error_mm": tried.mean_error_m * 1e3,
            "interval_score_mm": tried.interval_score_m * 1e3,
            "coverage_95": tried.coverage_percent,
        }
    };
    (!tried.is_empty()).then(|| tried.iter().map(one).collect())
}

fn in_words(outcome: TrainingOutcome) -> String {
    let status = match outcome.status {
        TrainingStatus::Converged => "converged",
        _ => "stopped at the cap",
    };
    let epochs = format_count(u64::from(outcome.epochs));
    format!("training {status} after {epochs} epochs, aggregate error {:.2e}", outcome.aggregate_error)
}
