//! `palpate evaluate`: how far a locator is off, or how far a rig's estimator would be.

use crate::failure::{Complaint, Failure};
use crate::progress::Observer;
use crate::recording_files::RecordingFiles;
use crate::table::table;
use crate::{input, output};
use palpate_estimators::arrangement::all_over;
use palpate_estimators::estimator::Locator;
use palpate_estimators::evaluation::{ErrorSummary, Evaluation, Portion, cross_validate, percentage_error};
use palpate_estimators::fit::FitTask;
use palpate_estimators::recording::{Provenance, Recording};
use palpate_estimators::simulate::simulate_at;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;
use palpate_report::{EvaluationReport, Judged, evaluation_report};
use palpate_rig::Rig;
use std::path::{Path, PathBuf};

/// Errors by position, by portion, and the effective length of a locator; or, of a rig, cross-validated by position.
#[derive(clap::Args)]
pub struct Arguments {
    /// A locator; or a rig, whose estimator is then cross-validated on the recording
    subject: PathBuf,
    #[command(flatten)]
    files: RecordingFiles,
    /// Folds of the cross-validation
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    folds: u16,
    /// An error up to this is good enough for the effective length or area
    #[arg(long, value_name = "LENGTH", default_value = "2 mm", value_parser = input::length)]
    tolerance: f64,
    /// A portion that is also judged by itself, as in `--portion "60 mm..300 mm"`; may be repeated
    #[arg(long, value_name = "FROM..TO", value_parser = portion)]
    portion: Vec<Portion>,
    /// Seed of simulation and fits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Folder for a report
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the errors as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed, or written as JSON.
#[derive(serde::Serialize)]
struct Findings {
    palpate: &'static str,
    subject: String,
    data: String,
    folds: Option<u16>,
    seed: u64,
    length_mm: f64,
    tolerance_mm: f64,
    #[serde(skip)]
    extent: Extent,
    effective_percent: f64,
    errors: Vec<Errors>,
}

#[derive(serde::Serialize)]
struct Errors {
    portion: String,
    count: usize,
    error_mm: Figures,
    error_percent: Figures,
}

#[derive(serde::Serialize)]
struct Figures {
    mean: f64,
    median: f64,
    p95: f64,
    rmse: f64,
    max: f64,
}

/// Answers, and what gave them.
struct Answers {
    evaluation: Evaluation,
    recording: Provenance,
    subject: Subject,
}

enum Subject {
    Locator(Box<Locator>),
    Rig(Box<Rig>),
}

impl Answers {
    fn extent(&self) -> Extent {
        let setup = match &self.subject {
            Subject::Locator(locator) => &locator.setup,
            Subject::Rig(rig) => &rig.setup,
        };
        setup.surface.extent()
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let answers = if is_toml(&arguments.subject) { cross_validated(arguments)? } else { located(arguments)? };
    let findings = findings(arguments, &answers)?;
    if let Some(out) = &arguments.out {
        let (folds, seed) = (usize::from(arguments.folds), arguments.seed);
        let report = EvaluationReport {
            title: &format!("Location errors of {}", findings.subject),
            judged: match &answers.subject {
                Subject::Locator(locator) => Judged::Locator(locator),
                Subject::Rig(rig) => Judged::CrossValidated { rig, folds, seed },
            },
            evaluation: &answers.evaluation,
            recording: &answers.recording,
            portions: &arguments.portion,
            tolerance_m: arguments.tolerance,
        };
        output::write_report(out, evaluation_report(&report))?;
    }
    if arguments.json { output::say_json(&findings) } else { print(&findings, arguments) }
}

fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// A rig: its estimator is fitted to each fold, and judged at the positions that the fold holds out.
fn cross_validated(arguments: &Arguments) -> Result<Answers, Failure> {
    let rig = input::read_rig(&arguments.subject)?;
    let recording = match arguments.files.read(&rig.setup)? {
        Some(recording) => recording,
        None => rig.simulate(arguments.seed).map_err(simulation_complaint)?,
    };
    let (folds, seed) = (usize::from(arguments.folds), arguments.seed);
    let observer = Observer::of_rounds(folds as u64 * rig.estimator.most_rounds());
    let observe = |progress| observer.observe(progress);
    let task = FitTask::new(&rig.setup, &recording).seed(seed).watch(Watch::new(&observe));
    let evaluation = cross_validate(&rig.estimator, task, folds).map_err(|error| Failure::of(&error))?;
    drop(observer);
    Ok(Answers { evaluation, recording: recording.provenance, subject: Subject::Rig(Box::new(rig)) })
}

/// A locator, judged by a recording or by its own bench's simulation.
fn located(arguments: &Arguments) -> Result<Answers, Failure> {
    let locator = input::read_locator(&arguments.subject)?;
    let recording = match arguments.files.read(&locator.setup)? {
        Some(recording) => {
            warn_of_training_data(&locator, &recording);
            recording
        }
        None => simulated(&locator, arguments.seed)?,
    };
    let evaluation = Evaluation::of(&locator, &recording).map_err(Complaint::new)?;
    let subject = Subject::Locator(Box::new(locator));
    Ok(Answers { evaluation, recording: recording.provenance, subject })
}

fn simulation_complaint(error: impl std::fmt::Display) -> Complaint {
    Complaint::new(error).help("--data names a recording to judge by")
}

/// The bench pressed all over: for the paper's beam at every millimetre, on a plane in the middles of about 400 cells.
fn simulated(locator: &Locator, seed: u64) -> Result<Recording, Failure> {
    let positions = all_over(locator.setup.surface.extent());
    Ok(simulate_at(&locator.setup, &positions, 1, seed).map_err(simulation_complaint)?)
}

fn warn_of_training_data(locator: &Locator, recording: &Recording) {
    if locator.provenance.recording.digests == recording.provenance.digests {
        eprintln!(
            "warning: the locator was fitted to this very recording; at positions that it has not seen it is worse: `palpate evaluate RIG --data …` cross-validates"
        );
    }
}

fn portion(text: &str) -> Result<Portion, String> {
    let (from, to) =
        text.split_once("..").ok_or_else(|| format!("`{text}` has no `..` between two lengths"))?;
    let portion = Portion { from_m: input::length(from.trim())?, to_m: input::length(to.trim())? };
    if portion.from_m < portion.to_m { Ok(portion) } else { Err(format!("`{text}` does not rise")) }
}

fn findings(arguments: &Arguments, answers: &Answers) -> Result<Findings, Failure> {
    let (evaluation, data) = (&answers.evaluation, answers.recording.source.clone());
    let named = |portion: &Portion| format!("{}–{} mm", portion.from_m * 1e3, portion.to_m * 1e3);
    let portions = std::iter::once((None, "whole surface".to_owned()))
        .chain(arguments.portion.iter().map(|portion| (Some(*portion), named(portion))));
    let errors = portions.map(|(portion, name)| {
        let summary = evaluation.summary(portion).ok_or_else(|| {
            Complaint::new(format!("{name} has no contact in {data}")).help("name a portion that was pressed")
        })?;
        Ok(errors(name, &summary, evaluation.length_m))
    });
    let folds = matches!(answers.subject, Subject::Rig(_)).then_some(arguments.folds);
    Ok(Findings {
        palpate: env!("CARGO_PKG_VERSION"),
        subject: arguments.subject.display().to_string(),
        folds,
        seed: arguments.seed,
        length_mm: evaluation.length_m * 1e3,
        tolerance_mm: arguments.tolerance * 1e3,
        extent: answers.extent(),
        effective_percent: evaluation.effective_percent(arguments.tolerance),
        errors: errors.collect::<Result<_, Failure>>()?,
        data,
    })
}

fn errors(portion: String, summary: &ErrorSummary, length_m: f64) -> Errors {
    let figures = |unit: &dyn Fn(f64) -> f64| Figures {
        mean: unit(summary.average_m),
        median: unit(summary.median_m),
        p95: unit(summary.p95_m),
        rmse: unit(summary.rmse_m),
        max: unit(summary.largest_m),
    };
    let error_percent = figures(&|error_m| percentage_error(error_m, length_m));
    Errors { portion, count: summary.count, error_mm: figures(&|error_m| error_m * 1e3), error_percent }
}

fn print(findings: &Findings, arguments: &Arguments) -> Result<(), Failure> {
    let how = match findings.folds {
        Some(folds) => format!("cross-validated in {folds} folds by position"),
        None => "located".to_owned(),
    };
    let count = findings.errors.first().map_or(0, |errors| errors.count);
    output::say(format!("{}: {count} readings of {}, {how}\n", findings.subject, findings.data))?;
    let cell = |mm: f64, percent: f64| format!("{mm:.3} ({percent:.2})");
    let rows = findings.errors.iter().map(|errors| {
        let (mm, percent) = (&errors.error_mm, &errors.error_percent);
        vec![
            errors.portion.clone(),
            errors.count.to_string(),
            cell(mm.mean, percent.mean),
            cell(mm.median, percent.median),
            cell(mm.p95, percent.p95),
            cell(mm.max, percent.max),
        ]
    });
    let heading = ["error, mm (% of length)", "contacts", "average", "median", "95th percentile", "largest"];
    output::say(table(&heading, rows))?;
    let (share, tolerance) = (findings.effective_percent, findings.tolerance_mm);
    let what = match findings.extent {
        Extent::Line { .. } => "effective",
        Extent::Plane { .. } => "effective area",
    };
    output::say(format!("\n{what}: {share:.1} % of the contacts within {tolerance} mm"))?;
    match &arguments.out {
        Some(out) => output::say(format!("Report: {}", out.join("report.html").display())),
        None => Ok(()),
    }
}
