//! `palpate compare`: every estimator on the same trials, against the limit.

use crate::failure::{Complaint, Failure};
use crate::recording_files::RecordingFiles;
use crate::table::table;
use crate::{input, interrupt, output, progress};
use palpate_estimators::estimator::{Comparison, contenders};
use palpate_estimators::evaluation::{Split, evaluate_splits, limit_ratio, percentage_error};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_report::{ComparisonReport, comparison_report};
use palpate_rig::Rig;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Every estimator on the same folds of a recording (or on simulated calibrations), against what physics allows.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    #[command(flatten)]
    files: RecordingFiles,
    /// Folds of the cross-validation
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    folds: u16,
    /// Simulated calibrations, where there is no recording
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    calibrations: u16,
    /// Only these kinds of estimators; may be repeated
    #[arg(long, value_name = "KIND")]
    only: Vec<String>,
    /// An error up to this is good enough for the effective length or area
    #[arg(long, value_name = "LENGTH", default_value = "2 mm", value_parser = input::length)]
    tolerance: f64,
    /// Seed of simulation and fits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Folder for a report
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed, or written as JSON.
#[derive(serde::Serialize)]
struct Findings {
    palpate: &'static str,
    rig: String,
    data: String,
    trials: usize,
    readings: usize,
    seed: u64,
    length_mm: f64,
    tolerance_mm: f64,
    estimators: Vec<Row>,
    left_out: Vec<LeftOut>,
}

#[derive(serde::Serialize)]
struct Row {
    name: &'static str,
    error_mm: Figures,
    error_percent: f64,
    effective_percent: f64,
    coverage_95: Option<f64>,
    limit_ratio: Option<f64>,
    fit_seconds: f64,
    locate_ns: f64,
}

#[derive(serde::Serialize)]
struct Figures {
    mean: f64,
    median: f64,
    p95: f64,
    rmse: f64,
    max: f64,
}

/// An estimator that does not suit the rig or the recording.
#[derive(serde::Serialize)]
struct LeftOut {
    name: &'static str,
    why: String,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let rig = input::read_rig(&arguments.rig)?;
    let Trials { data, how, trials } = trials(arguments, &rig)?;
    let (comparisons, left_out) = compare(arguments, &rig, &trials)?;
    if let Some(out) = &arguments.out {
        write_report(arguments, &rig, &how, &comparisons, &left_out, out)?;
    }
    let rows = comparisons.iter().filter_map(|comparison| row(&rig, comparison, arguments.tolerance));
    let findings = Findings {
        palpate: env!("CARGO_PKG_VERSION"),
        rig: arguments.rig.display().to_string(),
        data,
        trials: trials.len(),
        readings: trials.iter().map(|trial| trial.judged.rows.len()).sum(),
        seed: arguments.seed,
        length_mm: rig.setup.surface.extent().length_m() * 1e3,
        tolerance_mm: arguments.tolerance * 1e3,
        estimators: rows.collect(),
        left_out,
    };
    if arguments.json {
        return output::say_json(&findings);
    }
    print(&findings, &how)?;
    match &arguments.out {
        Some(out) => output::say(format!("\nReport: {}", out.join("report.html").display())),
        None => Ok(()),
    }
}

fn write_report(
    arguments: &Arguments,
    rig: &Rig,
    how: &str,
    comparisons: &[Comparison],
    left_out: &[LeftOut],
    out: &Path,
) -> Result<(), Failure> {
    let left_out: Vec<_> = left_out.iter().map(|left_out| (left_out.name, left_out.why.clone())).collect();
    let report = ComparisonReport {
        title: &format!("Estimators compared on {}", arguments.rig.display()),
        setup: &rig.setup,
        trials: how,
        comparisons,
        left_out: &left_out,
        tolerance_m: arguments.tolerance,
        seed: arguments.seed,
    };
    output::write_report(out, comparison_report(&report))
}

/// What the estimators are tried on, what it is called, and how it is used.
struct Trials {
    data: String,
    how: String,
    trials: Vec<Split>,
}

fn trials(arguments: &Arguments, rig: &Rig) -> Result<Trials, Failure> {
    let Some(recording) = arguments.files.read(&rig.setup)? else {
        let trials = rig.trials(u64::from(arguments.calibrations), arguments.seed);
        let trials = trials.map_err(|error| {
            Complaint::new(format!("{}: {error}", arguments.rig.display()))
                .help("--data names a recording to compare on")
        })?;
        let calibrations = arguments.calibrations;
        let judged = trials.first().map_or(0, |trial| trial.judged.rows.len());
        let how = format!("{calibrations} simulated calibrations, judged at {judged} positions each");
        return Ok(Trials { data: "simulation".to_owned(), how, trials });
    };
    let trials = Split::by_folds(&recording, usize::from(arguments.folds)).map_err(Complaint::new)?;
    let data = recording.provenance.source;
    let how = format!("{data}, cross-validated in {} folds by position", arguments.folds);
    Ok(Trials { data, how, trials })
}

fn compare(
    arguments: &Arguments,
    rig: &Rig,
    trials: &[Split],
) -> Result<(Vec<Comparison>, Vec<LeftOut>), Failure> {
    let rows = trials.first().map_or(0, |trial| trial.training.rows.len());
    let mut contenders = contenders(&rig.setup, &rig.estimator, rows);
    let known: Vec<&str> = contenders.iter().map(|contender| contender.kind()).collect();
    if let Some(unknown) = arguments.only.iter().find(|kind| !known.contains(&kind.as_str())) {
        let complaint = Complaint::new(format!("--only {unknown}: no estimator of this kind suits the rig"));
        return Err(complaint.help(format!("it can be: {}", known.join(", "))).into());
    }
    contenders.retain(|contender| {
        arguments.only.is_empty() || arguments.only.iter().any(|kind| kind == contender.kind())
    });
    let bar = progress::bar(contenders.len() as u64, "comparing");
    let start = Instant::now();
    let (mut comparisons, mut left_out) = (Vec::new(), Vec::new());
    for contender in contenders {
        bar.set_prefix(contender.kind());
        let clock = || start.elapsed().as_secs_f64();
        let go_on = |_| !interrupt::asked();
        match evaluate_splits(&rig.setup, &contender, trials, arguments.seed, &clock, Watch::new(&go_on)) {
            Ok(tried) => comparisons.push(Comparison { estimator: contender, tried }),
            Err(error) if Cancelled::caused(&error) => return Err(Failure::stopped()),
            Err(error) => left_out.push(LeftOut { name: contender.kind(), why: error.to_string() }),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    comparisons.sort_by(|a, b| mean_m(a).total_cmp(&mean_m(b)));
    Ok((comparisons, left_out))
}

fn mean_m(comparison: &Comparison) -> f64 {
    comparison.tried.evaluation.summary(None).map_or(f64::INFINITY, |summary| summary.average_m)
}

fn row(rig: &Rig, comparison: &Comparison, tolerance_m: f64) -> Option<Row> {
    let evaluation = &comparison.tried.evaluation;
    let summary = evaluation.summary(None)?;
    Some(Row {
        name: comparison.estimator.kind(),
        error_mm: Figures {
            mean: summary.average_m * 1e3,
            median: summary.median_m * 1e3,
            p95: summary.p95_m * 1e3,
            rmse: summary.rmse_m * 1e3,
            max: summary.largest_m * 1e3,
        },
        error_percent: percentage_error(summary.average_m, evaluation.length_m),
        effective_percent: evaluation.effective_percent(tolerance_m),
        coverage_95: evaluation.coverage_percent(),
        limit_ratio: limit_ratio(&rig.setup, evaluation),
        fit_seconds: comparison.tried.fit_seconds,
        locate_ns: comparison.tried.locate_ns,
    })
}

fn print(findings: &Findings, how: &str) -> Result<(), Failure> {
    output::say(format!("{}: {how}; {} readings\n", findings.rig, findings.readings))?;
    let or_dash = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
    let rows = findings.estimators.iter().map(|row| {
        vec![
            row.name.to_owned(),
            format!("{:.4} ({:.4})", row.error_mm.mean, row.error_percent),
            format!("{:.4}", row.error_mm.median),
            format!("{:.3}", row.error_mm.p95),
            format!("{:.3}", row.error_mm.max),
            format!("{:.1}", row.effective_percent),
            or_dash(row.coverage_95.map(|percent| format!("{percent:.1}"))),
            or_dash(row.limit_ratio.map(|ratio| format!("{ratio:.3}"))),
            time(row.fit_seconds),
            time(row.locate_ns * 1e-9),
        ]
    });
    let heading = [
        "error, mm (% of length)",
        "mean",
        "median",
        "p95",
        "largest",
        "effective, %",
        "95 % covers, %",
        "× limit",
        "fit",
        "a reading",
    ];
    output::say(table(&heading, rows))?;
    for left_out in &findings.left_out {
        output::say(format!("\n{} is left out: {}", left_out.name, left_out.why))?;
    }
    Ok(())
}

/// A short time with three digits.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-6 => (s * 1e9, "ns"),
        s if s < 1e-3 => (s * 1e6, "µs"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    let digits = if value < 10.0 {
        2
    } else if value < 100.0 {
        1
    } else {
        0
    };
    format!("{value:.digits$} {unit}")
}
