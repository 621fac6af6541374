//! `palpate compare`: all estimators on equal trials, compared with the Cramér–Rao limit.

use super::evaluate::ErrorFigures;
use crate::cost::MemoryOption;
use crate::failure::{Failure, UserError};
use crate::input::RecordingFiles;
use crate::json::object;
use crate::output::Table;
use crate::progress::Observer;
use crate::tables::{CsvTable, ERROR_COLUMNS, ERRORS_CSV};
use crate::tare::{TareOption, tare_splits};
use crate::target::{Inputs, TargetFolder};
use crate::{input, output, progress, tables};
use palpate_estimators::estimator::{
    self, CompareOptions, Comparison, ComparisonResult, UnknownEstimator, contenders, select,
};
use palpate_estimators::evaluation::{Evaluation, ForceSummary, Split, limit_ratio, percentage_error};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Progress, Watch};
use palpate_report::{ComparisonReport, comparison_report};
use palpate_rig::Rig;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  # Compare two estimators on a recording
  palpate compare beam.toml --data presses.csv --only influence --only neighbours

  # Compare two estimators on one simulated calibration, and write a report
  palpate compare beam.toml --only influence --only centroid --calibrations 1 --report comparison";

/// Compare estimators on the same data, and with the physical limit
///
/// Every estimator that suits the rig is cross-validated on a recording, or without --data on simulated calibrations.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    #[command(flatten)]
    files: RecordingFiles,
    /// Number of folds of the cross-validation; positions are held out as a whole
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    folds: u16,
    /// Number of simulated calibrations, without --data
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    calibrations: u16,
    /// Compare this kind of estimator only; may be repeated [default: all kinds]
    #[arg(long, value_name = "KIND")]
    only: Vec<String>,
    /// Largest error that counts towards the effective length or area
    #[arg(long, value_name = "LENGTH", default_value = "2 mm", value_parser = input::length)]
    tolerance: f64,
    /// Seed of simulations and fits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    tare: TareOption,
    /// Write a report into DIR: report.html, its figures, errors.csv with the errors at each position, and trials.csv with those of each trial
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryOption,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Kind of an unsuitable estimator, and the reason.
type OmittedEstimator = (&'static str, String);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    arguments.tare.check_recorded(&arguments.files)?;
    let inputs = Inputs::new(arguments.files.paths().chain([arguments.rig.as_path()]));
    let folder = arguments.report.as_ref();
    let folder = folder.map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()?;
    let rig = input::read_rig(&arguments.rig)?;
    let Trials { data, source, how, trials } = trials(arguments, &rig)?;
    let ComparisonResult { comparisons, omitted } = compare(arguments, &rig, &trials)?;
    let readings: usize = trials.iter().map(|trial| trial.held_out.rows.len()).sum();
    if let Some(folder) = &folder {
        write_report(arguments, &rig, &how, &comparisons, &omitted, folder)?;
        let comment =
            format!("estimators compared on {}, {source}, seed {}", arguments.rig.display(), arguments.seed);
        errors_table(&comment, &comparisons, rig.setup.surface().extent()).write(folder, ERRORS_CSV)?;
        trials_table(&comment, &comparisons, &trials).write(folder, "trials.csv")?;
    }
    if arguments.json {
        let estimators = comparisons.iter().filter_map(|comparison| json_row(&rig, comparison, arguments));
        return output::print_json(&object! {
            "palpate": env!("CARGO_PKG_VERSION"),
            "rig": arguments.rig.display().to_string(),
            "data": data,
            "trials": trials.len(),
            "readings": readings,
            "seed": arguments.seed,
            "tared": arguments.tare.tare.is_some(),
            "length_mm": rig.setup.surface().extent().length_m() * 1e3,
            "tolerance_mm": arguments.tolerance * 1e3,
            "estimators": estimators.collect::<Vec<_>>(),
            "left_out": omitted.iter().map(|(name, why)| object! { "name": name, "why": why }).collect::<Vec<_>>(),
        });
    }
    output::print_line(format!("{}: {how}; {readings} readings\n", arguments.rig.display()))?;
    output::print_line(table(&rig, &comparisons, arguments))?;
    for (name, why) in &omitted {
        output::print_line(format!("\n{name} is skipped: {why}"))?;
    }
    output::print_report_path("\n", arguments.report.as_deref())
}

fn write_report(
    arguments: &Arguments,
    rig: &Rig,
    how: &str,
    comparisons: &[Comparison],
    omitted: &[OmittedEstimator],
    folder: &TargetFolder,
) -> Result<(), Failure> {
    let report = ComparisonReport {
        title: &format!("Estimators compared on {}", arguments.rig.display()),
        setup: &rig.setup,
        trials: how,
        comparisons,
        omitted,
        tolerance_m: arguments.tolerance,
        seed: arguments.seed,
    };
    folder.write_report(comparison_report(&report))
}

fn errors_table(comment: &str, comparisons: &[Comparison], extent: Extent) -> CsvTable {
    let columns = [vec!["estimator"], tables::position_columns(extent), ERROR_COLUMNS.to_vec()].concat();
    let mut table = CsvTable::new(comment, columns);
    for Comparison { estimator, timed } in comparisons {
        for (position, evaluation) in timed.evaluation.by_position() {
            let position = tables::position_cells(position, extent);
            table.row(
                [vec![estimator.name().to_owned()], position, tables::error_cells(&evaluation)].concat(),
            );
        }
    }
    table
}

fn trials_table(comment: &str, comparisons: &[Comparison], trials: &[Split]) -> CsvTable {
    let columns = [vec!["estimator", "trial"], ERROR_COLUMNS.to_vec()].concat();
    let mut table = CsvTable::new(comment, columns);
    for Comparison { estimator, timed } in comparisons {
        let Evaluation { extent, located } = &timed.evaluation;
        let mut rest = located.as_slice();
        for (number, trial) in trials.iter().enumerate() {
            // The answers of all trials are concatenated.
            let count = trial.held_out.rows.iter().filter(|row| row.touches()).count();
            let (own, others) = rest.split_at(count.min(rest.len()));
            rest = others;
            let evaluation = Evaluation { extent: *extent, located: own.to_vec() };
            let head = vec![estimator.name().to_owned(), number.to_string()];
            table.row([head, tables::error_cells(&evaluation)].concat());
        }
    }
    table
}

struct Trials {
    data: String,
    source: String,
    how: String,
    trials: Vec<Split>,
}

fn trials(arguments: &Arguments, rig: &Rig) -> Result<Trials, Failure> {
    let Some(recording) = arguments.files.read(&rig.setup)? else {
        let (count, seed) = (u64::from(arguments.calibrations), arguments.seed);
        let trials = Observer::of_stages().watch(|watch| rig.trials_watched(count, seed, watch));
        let trials = trials.map_err(|error| {
            let about = |error| UserError::for_path(&arguments.rig, error);
            Failure::of_work(error, |error| about(error).help("--data names a recording to compare on"))
        })?;
        let calibrations = arguments.calibrations;
        let held_out = trials.first().map_or(0, |trial| trial.held_out.rows.len());
        let forces = match rig.setup.force_n() {
            Some(_) => "",
            None => " by the force of the presses, half and twice that in turn",
        };
        let plural = if calibrations == 1 { "" } else { "s" };
        let how = format!(
            "{calibrations} simulated calibration{plural}, evaluated at {held_out} positions each{forces}"
        );
        return Ok(Trials { data: "simulation".to_owned(), source: how.clone(), how, trials });
    };
    let recording = recording.in_order();
    let mut trials = Split::by_folds(&recording, usize::from(arguments.folds)).map_err(UserError::new)?;
    tare_splits(&arguments.tare, &rig.setup, &recording, &mut trials)?;
    let tared = arguments.tare.in_words();
    let cross_validated =
        |data: &str| format!("{data}, cross-validated in {} folds by position{tared}", arguments.folds);
    let source = cross_validated(&tables::source_in_words(&recording.provenance));
    let data = recording.provenance.source;
    Ok(Trials { source, how: cross_validated(&data), data, trials })
}

fn compare(arguments: &Arguments, rig: &Rig, trials: &[Split]) -> Result<ComparisonResult, Failure> {
    let rows = trials.first().map_or(0, |trial| trial.training.rows.len());
    let contenders = contenders(&rig.setup, &rig.estimator, rows);
    let contenders = select(contenders, &arguments.only).map_err(|UnknownEstimator { name, known }| {
        let user_error = UserError::new(format!("--only {name}: no estimator of this kind suits the rig"));
        user_error.help(format!("it can be: {}", known.join(", ")))
    })?;
    // A single estimator is refused; among several it is omitted.
    if let ([only], Some(trial)) = (&contenders[..], trials.first()) {
        let cost = only.fit_cost(&rig.setup, &trial.training);
        arguments.memory.check(only, cost, &rig.setup, &trial.training)?;
    }
    let bar = progress::bar(contenders.len() as u64, "comparing");
    let start = Instant::now();
    let shown = AtomicUsize::new(usize::MAX);
    let observe = |progress| {
        // A network reports this at every epoch.
        if let Progress::Counted { name, done, .. } = progress
            && shown.swap(done, Ordering::Relaxed) != done
        {
            bar.set_prefix(name);
            bar.set_position(done as u64);
        }
        !progress::interrupted()
    };
    let options = CompareOptions {
        seed: arguments.seed,
        clock: &|| start.elapsed().as_secs_f64(),
        refuse: &|contender, cost| arguments.memory.refusal(contender, cost),
        watch: Watch::new(&observe),
    };
    let compared = estimator::compare(&rig.setup, contenders, trials, options);
    bar.finish_and_clear();
    compared.map_err(|Cancelled| Failure::stopped())
}

fn json_row(rig: &Rig, comparison: &Comparison, arguments: &Arguments) -> Option<impl Serialize> {
    let evaluation = &comparison.timed.evaluation;
    let summary = evaluation.summary(None)?;
    Some(object! {
        "name": comparison.estimator.name(),
        "error_mm": ErrorFigures::new(&summary, |error_m| error_m * 1e3),
        "error_percent": percentage_error(summary.average_m, evaluation.extent.length_m()),
        "effective_percent": evaluation.effective_percent(arguments.tolerance),
        "coverage_95": evaluation.coverage_percent(),
        "interval_score_mm": evaluation.interval_score_m().map(|score_m| score_m * 1e3),
        "statuses_percent": tables::status_percents(evaluation),
        "force_errors_n": tables::force_errors(evaluation),
        "limit_ratio": limit_ratio(&rig.setup, evaluation),
        "fit_seconds": comparison.timed.fit_seconds,
        "locate_ns": comparison.timed.locate_ns,
    })
}

fn table(rig: &Rig, comparisons: &[Comparison], arguments: &Arguments) -> String {
    let rows = comparisons.iter().filter_map(|comparison| {
        let evaluation = &comparison.timed.evaluation;
        Some((comparison, evaluation, evaluation.summary(None)?))
    });
    let or_dash = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
    let has_forces = comparisons.iter().any(|of| of.timed.evaluation.force_summary().is_some());
    let table = Table::from_rows(rows)
        .column("error, mm (% of length)", |(comparison, ..)| comparison.estimator.name().to_owned())
        .column("mean", |(_, evaluation, summary)| {
            let percent = percentage_error(summary.average_m, evaluation.extent.length_m());
            format!("{:.4} ({percent:.4})", summary.average_m * 1e3)
        })
        .column("median", |(.., summary)| format!("{:.4}", summary.median_m * 1e3))
        .column("p95", |(.., summary)| format!("{:.3}", summary.p95_m * 1e3))
        .column("largest", |(.., summary)| format!("{:.3}", summary.largest_m * 1e3))
        .column("effective, %", |(_, of, _)| format!("{:.1}", of.effective_percent(arguments.tolerance)))
        .column("95 % covers, %", |(_, evaluation, _)| {
            or_dash(evaluation.coverage_percent().map(|percent| format!("{percent:.1}")))
        })
        .column("score, mm", |(_, evaluation, _)| {
            or_dash(evaluation.interval_score_m().map(|score_m| format!("{:.3}", score_m * 1e3)))
        });
    let table = if has_forces {
        table.column("force, N (95 % covers, %)", |(_, evaluation, _)| {
            let in_words =
                |forces: ForceSummary| format!("{:.3} ({:.1})", forces.average_n, forces.coverage_percent);
            or_dash(evaluation.force_summary().map(in_words))
        })
    } else {
        table
    };
    table
        .column("× limit", |(_, evaluation, _)| {
            or_dash(limit_ratio(&rig.setup, evaluation).map(|ratio| format!("{ratio:.3}")))
        })
        .column("fit", |(comparison, ..)| time(comparison.timed.fit_seconds))
        .column("a reading", |(comparison, ..)| time(comparison.timed.locate_ns * 1e-9))
        .to_string()
}

fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-6 => (s * 1e9, "ns"),
        s if s < 1e-3 => (s * 1e6, "µs"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    let digits = usize::from(value < 10.0) + usize::from(value < 100.0);
    format!("{value:.digits$} {unit}")
}
