//! `palpate evaluate`: errors of a locator, or of the estimator of a rig.

use crate::cost::MemoryOption;
use crate::failure::{Failure, UserError};
use crate::input::{RecordingFiles, RigOrLocator};
use crate::json::object;
use crate::output::Table;
use crate::progress::Observer;
use crate::remark::remark;
use crate::tables::{CsvTable, ERROR_COLUMNS, ERRORS_CSV};
use crate::tare::{TareOption, tare_splits, tared_recording};
use crate::target::{Inputs, TargetFolder};
use crate::{input, output, tables};
use palpate_estimators::estimator::Locator;
use palpate_estimators::evaluation::{
    ErrorSummary, Evaluation, ForceSummary, MappedPositions, Portion, Split, evaluate_splits,
    percentage_error, simulate_use_all_over_watched,
};
use palpate_estimators::fit::FitTask;
use palpate_estimators::recording::{Provenance, Recording};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Dimension, Quantity, format_length_mm};
use palpate_report::{EstimateOrigin, EvaluationReport, evaluation_report};
use palpate_rig::Rig;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  # Evaluate a locator with recorded contacts, and write a report
  palpate evaluate beam.json --data touches.csv --report evaluation

  # Cross-validate the estimator of a rig, with figures of one portion
  palpate evaluate beam.toml --data presses.csv --portion \"100..300 mm\"";

/// Evaluate a locator, or cross-validate the estimator of a rig
///
/// Prints location errors by position and portion, the coverage of the 95 % intervals, and the effective length or area. Without --data the
/// contacts are simulated.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Locator to evaluate, or rig file whose estimator is cross-validated
    #[arg(value_name = "LOCATOR|RIG")]
    subject: PathBuf,
    #[command(flatten)]
    files: RecordingFiles,
    /// Number of folds of the cross-validation; positions are held out as a whole
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    folds: u16,
    /// Largest error that counts towards the effective length or area
    #[arg(long, value_name = "LENGTH", default_value = "2 mm", value_parser = input::length)]
    tolerance: f64,
    /// Evaluate a portion of the surface separately, such as "0..100 mm"; may be repeated
    #[arg(long, value_name = "FROM..TO", value_parser = portion)]
    portion: Vec<Portion>,
    /// Seed of simulations and fits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    tare: TareOption,
    /// Write a report into DIR: report.html, its figures, and errors.csv with the errors at each position
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryOption,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct PortionErrors {
    portion: String,
    count: usize,
    error_mm: ErrorFigures,
    error_percent: ErrorFigures,
}

#[derive(serde::Serialize)]
pub struct ErrorFigures {
    pub mean: f64,
    pub median: f64,
    pub p95: f64,
    pub rmse: f64,
    pub max: f64,
}

impl ErrorFigures {
    pub fn new(summary: &ErrorSummary, unit: impl Fn(f64) -> f64) -> Self {
        Self {
            mean: unit(summary.average_m),
            median: unit(summary.median_m),
            p95: unit(summary.p95_m),
            rmse: unit(summary.rmse_m),
            max: unit(summary.largest_m),
        }
    }
}

struct EvaluationResult {
    evaluation: Evaluation,
    recording: Provenance,
    subject: RigOrLocator,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let read = [Some(arguments.subject.as_path()), arguments.tare.path()].into_iter().flatten();
    let inputs = Inputs::new(arguments.files.paths().chain(read));
    let folder = arguments.report.as_ref();
    let folder = folder.map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()?;
    let subject = RigOrLocator::read(&arguments.subject)?;
    arguments.tare.check_drifts(&arguments.files, subject.setup())?;
    let answers = match subject {
        RigOrLocator::Rig(rig) => cross_validated(arguments, rig)?,
        RigOrLocator::Locator(locator) => located(arguments, locator)?,
    };
    let errors = errors_by_portion(arguments, &answers)?;
    if let Some(folder) = &folder {
        let (folds, seed) = (usize::from(arguments.folds), arguments.seed);
        let report = EvaluationReport {
            title: &format!("Location errors of {}", arguments.subject.display()),
            origin: match &answers.subject {
                RigOrLocator::Locator(locator) => EstimateOrigin::Locator(locator),
                RigOrLocator::Rig(rig) => EstimateOrigin::CrossValidated { rig, folds, seed },
            },
            evaluation: &answers.evaluation,
            recording: &answers.recording,
            portions: &arguments.portion,
            tolerance_m: arguments.tolerance,
        };
        folder.write_report(evaluation_report(&report))?;
        errors_table(arguments, &answers).write(folder, ERRORS_CSV)?;
    }
    let evaluation = &answers.evaluation;
    let folds = matches!(answers.subject, RigOrLocator::Rig(_)).then_some(arguments.folds);
    if !arguments.json {
        return print(arguments, &answers, folds, &errors);
    }
    output::print_json(&object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "subject": arguments.subject.display().to_string(),
        "data": &answers.recording.source,
        "folds": folds,
        "seed": arguments.seed,
        "tared": arguments.tare.tare.is_some(),
        "length_mm": evaluation.extent.length_m() * 1e3,
        "tolerance_mm": arguments.tolerance * 1e3,
        "effective_percent": evaluation.effective_percent(arguments.tolerance),
        "coverage_95": evaluation.coverage_percent(),
        "interval_score_mm": evaluation.interval_score_m().map(|score_m| score_m * 1e3),
        "statuses_percent": tables::status_percents(evaluation),
        "errors": errors,
        "force_errors_n": tables::force_errors(evaluation),
    })
}

fn errors_table(arguments: &Arguments, answers: &EvaluationResult) -> CsvTable {
    let how = match &answers.subject {
        RigOrLocator::Locator(_) => "located".to_owned(),
        RigOrLocator::Rig(_) => format!("cross-validated in {} folds by position", arguments.folds),
    } + arguments.tare.in_words();
    let (subject, data) = (arguments.subject.display(), tables::source_in_words(&answers.recording));
    let comment = format!("errors of {subject} on {data}, {how}, seed {}", arguments.seed);
    let extent = answers.evaluation.extent;
    let mut table =
        CsvTable::new(&comment, [tables::position_columns(extent), ERROR_COLUMNS.to_vec()].concat());
    for (position, evaluation) in answers.evaluation.by_position() {
        table.row([tables::position_cells(position, extent), tables::error_cells(&evaluation)].concat());
    }
    table
}

fn cross_validated(arguments: &Arguments, mut rig: Box<Rig>) -> Result<EvaluationResult, Failure> {
    let recording = match arguments.files.read(&rig.setup)? {
        Some(recording) => recording,
        None => Observer::of_stages()
            .watch(|watch| rig.simulate_calibration_watched(arguments.seed, watch))
            .map_err(|error| Failure::of_work(error, simulation_error))?,
    };
    let (folds, seed) = (usize::from(arguments.folds), arguments.seed);
    let cost = rig.estimator.fit_cost(&rig.setup, &recording);
    arguments.memory.check(&rig.estimator, cost, &rig.setup, &recording)?;
    let recording = recording.in_order();
    let mut splits = Split::by_folds(&recording, folds).map_err(UserError::new)?;
    tare_splits(&arguments.tare, &rig.setup, &recording, &mut splits)?;
    let task = FitTask::new(&rig.setup, &recording).seed(seed);
    let chosen = Observer::of_stages()
        .watch(|watch| rig.estimator.for_folds(task.watch(watch)))
        .map_err(|error| Failure::from_error(&error))?;
    if chosen != rig.estimator {
        remark!("structure: {}, by its errors and intervals at held-out positions", chosen.name());
    }
    rig.estimator = chosen;
    let Rig { setup, estimator, .. } = &*rig;
    let evaluation = Observer::of_rounds(folds as u64 * estimator.most_rounds())
        .watch(|watch| evaluate_splits(setup, estimator, &splits, seed, &|| 0.0, watch))
        .map_err(|error| Failure::from_error(&error))?
        .evaluation;
    Ok(EvaluationResult { evaluation, recording: recording.provenance, subject: RigOrLocator::Rig(rig) })
}

fn located(arguments: &Arguments, locator: Box<Locator>) -> Result<EvaluationResult, Failure> {
    let recording = match arguments.files.read(&locator.setup)? {
        Some(recording) => {
            warn_of_training_data(&locator, &recording);
            recording
        }
        None => simulated(&locator, arguments.seed)?,
    };
    let recording = tared_recording(&arguments.tare, &locator, recording)?;
    let evaluation = Observer::of_stages()
        .watch(|watch| Evaluation::new_watched(&locator, &recording, watch))
        .map_err(|error| Failure::from_error(&error))?;
    if let Some(MappedPositions { map, recorded_m, mapped_m }) = evaluation.mapped_positions() {
        remark!(
            "warning: the mean error is {}, and {} with {}: correct the positions of {}, or the order of its channels",
            format_length_mm(recorded_m),
            format_length_mm(mapped_m),
            map.formula(),
            recording.provenance.source
        );
    }
    Ok(EvaluationResult {
        evaluation,
        recording: recording.provenance,
        subject: RigOrLocator::Locator(locator),
    })
}

fn simulation_error(error: impl std::fmt::Display) -> UserError {
    UserError::new(error).help("--data names a recording to evaluate on")
}

fn simulated(locator: &Locator, seed: u64) -> Result<Recording, Failure> {
    let calibration = &locator.provenance.recording;
    Observer::of_stages()
        .watch(|watch| simulate_use_all_over_watched(&locator.setup, calibration, seed, watch))
        .map_err(|error| Failure::of_work(error, simulation_error))
}

fn warn_of_training_data(locator: &Locator, recording: &Recording) {
    if locator.provenance.recording.digests == recording.provenance.digests {
        remark!(
            "warning: the locator was fitted to this recording; errors at other positions are larger: `palpate evaluate RIG --data …` cross-validates"
        );
    }
}

/// Parses `60 mm..300 mm` or `60..300 mm`.
fn portion(text: &str) -> Result<Portion, String> {
    const EXAMPLE: &str = "write it as in `0 mm..100 mm` or `0..100 mm`";
    let (from, to) = text.split_once("..").ok_or_else(|| format!("`{text}` has no `..`; {EXAMPLE}"))?;
    let ends_m =
        Quantity::parse_span([from, to], Dimension::Length).map_err(|error| format!("{error}; {EXAMPLE}"))?;
    match ends_m {
        [Some(from_m), Some(_)] if from_m < 0.0 => {
            Err(format!("`{text}` begins at {}; it must begin at 0 or beyond", format_length_mm(from_m)))
        }
        [Some(from_m), Some(to_m)] if from_m < to_m => Ok(Portion { from_m, to_m }),
        [Some(_), Some(_)] => Err(format!("`{text}` must end beyond where it begins")),
        _ => Err(format!("`{text}` needs a length on either side of `..`; {EXAMPLE}")),
    }
}

fn errors_by_portion(
    arguments: &Arguments,
    answers: &EvaluationResult,
) -> Result<Vec<PortionErrors>, Failure> {
    let (evaluation, data) = (&answers.evaluation, &answers.recording.source);
    let named = |portion: &Portion| format!("{}–{} mm", portion.from_m * 1e3, portion.to_m * 1e3);
    let portions = std::iter::once((None, "whole surface".to_owned()))
        .chain(arguments.portion.iter().map(|portion| (Some(*portion), named(portion))));
    let errors = portions.map(|(portion, name)| {
        let summary = evaluation.summary(portion).ok_or_else(|| {
            UserError::new(format!("{name} has no contact in {data}")).help("name a portion that was pressed")
        })?;
        let percent = |error_m| percentage_error(error_m, evaluation.extent.length_m());
        Ok(PortionErrors {
            portion: name,
            count: summary.count,
            error_mm: ErrorFigures::new(&summary, |error_m| error_m * 1e3),
            error_percent: ErrorFigures::new(&summary, percent),
        })
    });
    errors.collect()
}

fn print(
    arguments: &Arguments,
    answers: &EvaluationResult,
    folds: Option<u16>,
    errors: &[PortionErrors],
) -> Result<(), Failure> {
    let how = match folds {
        Some(folds) => format!("cross-validated in {folds} folds by position"),
        None => "located".to_owned(),
    } + arguments.tare.in_words();
    let count = errors.first().map_or(0, |errors| errors.count);
    let (subject, data) = (arguments.subject.display(), &answers.recording.source);
    output::print_line(format!("{subject}: {count} readings of {data}, {how}\n"))?;
    let cell = |errors: &PortionErrors, of: fn(&ErrorFigures) -> f64| {
        format!("{:.3} ({:.2})", of(&errors.error_mm), of(&errors.error_percent))
    };
    output::print_line(
        Table::from_rows(errors)
            .column("error, mm (% of length)", |errors| errors.portion.clone())
            .column("contacts", |errors| errors.count.to_string())
            .column("average", |errors| cell(errors, |figures| figures.mean))
            .column("median", |errors| cell(errors, |figures| figures.median))
            .column("95th percentile", |errors| cell(errors, |figures| figures.p95))
            .column("largest", |errors| cell(errors, |figures| figures.max)),
    )?;
    let share = answers.evaluation.effective_percent(arguments.tolerance);
    let tolerance = arguments.tolerance * 1e3;
    let what = match answers.subject.setup().surface().extent() {
        Extent::Line { .. } => "effective",
        Extent::Plane { .. } => "effective area",
    };
    output::print_line(format!("\n{what}: {share:.1} % of the contacts within {tolerance} mm"))?;
    if let (Some(percent), Some(score_m)) =
        (answers.evaluation.coverage_percent(), answers.evaluation.interval_score_m())
    {
        let score = format_length_mm(score_m);
        output::print_line(format!(
            "95 % intervals: {percent:.1} % of the contacts in them, interval score {score}"
        ))?;
    }
    if let Some(forces) = answers.evaluation.force_summary() {
        let ForceSummary { average_n, median_n, p95_n, largest_n, coverage_percent, .. } = forces;
        output::print_line(format!(
            "error of the force: average {average_n:.3} N, median {median_n:.3} N, 95th percentile {p95_n:.3} N, largest {largest_n:.3} N; \
             {coverage_percent:.1} % in their 95 % intervals"
        ))?;
    }
    if let Some(statuses) = answers.evaluation.status_percents() {
        let shares = statuses.iter().filter(|(_, percent)| *percent > 0.0);
        let shares: Vec<String> =
            shares.map(|(status, percent)| format!("{percent:.1} % `{}`", status.name())).collect();
        output::print_line(format!("statuses: {}", shares.join(", ")))?;
    }
    output::print_report_path("", arguments.report.as_deref())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn portions_are_read_as_people_write_them() {
        let read = |text: &str| portion(text).map(|portion| (portion.from_m, portion.to_m));
        for text in [
            "0 mm..100 mm",
            "0..100 mm",
            "0 mm .. 100 mm",
            "0mm..100mm",
            " 0 .. 0.1 m ",
            "0..10 cm",
            "0 m..1e2 mm",
        ] {
            assert_eq!(read(text), Ok((0.0, 0.1)), "{text}");
        }
        assert_eq!(read("2.5..7.5 mm"), Ok((0.0025, 0.0075)));
        let refused = [
            "100 mm",
            "0..100",
            "0 N..100 mm",
            "0..100 N",
            "-1..5 mm",
            "5..5 mm",
            "9 mm..1 mm",
            "..5 mm",
            "5 mm..",
        ];
        insta::assert_snapshot!(refused.map(|text| read(text).unwrap_err()).join("\n"));
    }
}
