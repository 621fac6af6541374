//! `palpate design positions`: training positions, compared with even ones; and the next press of a
//! recording.

use super::{changed_rig, design_error, print_files, to_micrometre, toml_position};
use crate::failure::Failure;
use crate::input::{self, RecordingFiles};
use crate::json::object;
use crate::output::{self, Table};
use crate::progress::Observer;
use crate::remark::remark;
use crate::target::{Inputs, Target, TargetFolder};
use palpate_design::positions::{
    Advice, Placement, PositionDesign, PositionError, PositionProblem, VerifiedPositions, best_placed,
    next_press,
};
use palpate_estimators::recording::Recording;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{format_count, format_length_mm};
use palpate_report::{PositionDesignReport, position_design_report};
use palpate_rig::Rig;
use serde::Serialize;
use std::path::{Path, PathBuf};
use toml_edit::{Array, DocumentMut, Item, Table as TomlTable, value};

const EXAMPLES: &str = "\
Examples:
  # Design six training positions with a short search, and write the rig with them
  palpate design positions beam.toml --count 6 --trials 2 --calibrations 1 --verify 2 -o six.toml

  # Propose the next press of a recording
  palpate design positions beam.toml --data presses.csv";

/// Design training positions: choose positions that minimize the location error after the calibration
///
/// Compares rules and a search by simulated calibrations of the rig's estimator. Contacts are those of the rig's [design], or all over the surface.
/// With --data, proposes the next press of an unfinished calibration, its expected gain, and when to stop.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    /// Number of training positions [default: that of the rig, or 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    count: Option<u16>,
    /// Number of presses at each position [default: that of the rig, or 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeats: Option<u16>,
    /// Number of arrangements that the search evaluates
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    trials: u32,
    /// Number of simulated calibrations of each arrangement in the search
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    calibrations: u16,
    /// Verify each arrangement by N simulated calibrations with other noise
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    verify: u16,
    /// Unfinished recording: propose its next press
    #[arg(long, value_name = "FILE.csv")]
    data: Option<PathBuf>,
    /// Contacts of the recording, row by row, if --data contains readings only
    #[arg(long, value_name = "FILE.csv", requires = "data")]
    contacts: Option<PathBuf>,
    /// Propose to stop once any number of further presses lowers the error by less than this, in %
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0, value_parser = percent, requires = "data")]
    stop_below: f64,
    /// Seed of simulations and fits
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write the rig with the best positions to RIG
    #[arg(short, long, value_name = "RIG", conflicts_with = "data")]
    out: Option<PathBuf>,
    /// Write a report into DIR: report.html and its figures
    #[arg(long, value_name = "DIR", conflicts_with = "data")]
    report: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

struct Outcome<'a> {
    rig: &'a Path,
    estimator: &'static str,
    problem: &'a PositionProblem,
    placed: Vec<VerifiedPositions>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let text = input::read_text(&arguments.rig)?;
    let rig = input::parse_rig(&arguments.rig, &text)?;
    let files = RecordingFiles { data: arguments.data.clone(), contacts: arguments.contacts.clone() };
    let inputs = Inputs::new(files.paths().chain([arguments.rig.as_path()]));
    let out = arguments.out.as_ref().map(|path| Target::new(path, &inputs)).transpose()?;
    let report = arguments.report.as_ref();
    let report = report.map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()?;
    if let Some(recording) = files.read(&rig.setup)? {
        return advise(arguments, &rig, &recording);
    }
    let to_failure = |error: PositionError| user_error(&error, &arguments.rig);
    let problem = PositionProblem::new(&rig.setup, &what_to_design(arguments, &rig)).map_err(to_failure)?;
    let placed = Observer::of_stages().watch(|watch| problem.all(watch)).map_err(to_failure)?;
    let outcome = Outcome { rig: &arguments.rig, estimator: rig.estimator.kind(), problem: &problem, placed };
    if let (Some(target), Some(best)) = (&out, best_placed(&outcome.placed)) {
        let (_, written) = changed_rig(target.path(), &text, "positions", |rig| {
            place_presses(rig, &best.positions, problem.design().repeats, problem.extent());
        })?;
        target.write(written.as_bytes())?;
    }
    if let Some(folder) = &report {
        write_report(&outcome, &rig, folder)?;
    }
    if arguments.json {
        return output::print_json(&to_json(&outcome));
    }
    print(&outcome)?;
    print_files(arguments.out.as_deref(), arguments.report.as_deref())
}

fn what_to_design(arguments: &Arguments, rig: &Rig) -> PositionDesign {
    let design = rig.training.as_ref().map_or_else(PositionDesign::default, PositionDesign::for_training);
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

fn write_report(outcome: &Outcome, rig: &Rig, folder: &TargetFolder) -> Result<(), Failure> {
    let report = PositionDesignReport {
        title: &format!("Training positions for {}", outcome.rig.display()),
        setup: &rig.setup,
        estimator: outcome.estimator,
        problem: outcome.problem,
        placed: &outcome.placed,
    };
    folder.write_report(position_design_report(&report))
}

fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').trim().parse::<f64>() {
        Ok(value) if value > 0.0 && value < 100.0 => Ok(value),
        _ => Err(format!("`{text}` must be a number greater than 0 and less than 100")),
    }
}

fn user_error(error: &PositionError, rig: &Path) -> Failure {
    design_error(error, rig, help(error))
}

fn help(error: &PositionError) -> &'static str {
    match error {
        PositionError::Cancelled(_) => "start it again",
        PositionError::NoModel => {
            "give a surface with a model, such as `kind = \"beam\"`; or --data with a recording begun, for the next press"
        }
        PositionError::NoForce => {
            "add `force = \"3 N\"` to [contact], or to [training] where it is not known afterwards"
        }
        PositionError::Auto => "choose one: `kind = \"influence\"` in [estimator]",
        PositionError::TooFew { .. } => "--count takes a larger number",
        PositionError::Arrangement(_) | PositionError::Calibration(_) | PositionError::Regression(_) => {
            "check [training], [sensors] and [estimator] of the rig"
        }
        PositionError::OutOfRange(_) => "check it on the command line, or in [design]",
        PositionError::Channels { .. } => "check `channels` in [recording], or the rig's sensors",
        PositionError::TooFewPresses { .. } => "begin with evenly spaced presses, ends included",
        PositionError::SmallPart { .. } => "begin with evenly spaced presses, ends included",
        PositionError::NothingTold => {
            "press with a larger force, or inspect the recording with `palpate init`"
        }
        PositionError::NoOffset => "add untouched rows, of force 0, or press some position with two forces",
        PositionError::NoNoise { .. } => "press some positions twice, or add `noise = \"5 um\"` to [sensors]",
    }
}

fn print(outcome: &Outcome) -> Result<(), Failure> {
    let (problem, design) = (outcome.problem, outcome.problem.design());
    output::print_line(format!(
        "{}: {} training positions, {} press{} each, for the `{}` estimator; {} contacts, force {}; {} calibrations verify\n",
        outcome.rig.display(),
        design.count,
        format_count(design.repeats as u64),
        if design.repeats == 1 { "" } else { "es" },
        outcome.estimator,
        problem.contacts().len(),
        problem.force().name(),
        design.verifications,
    ))?;
    output::print_line(errors(outcome))?;
    output::print_line("")?;
    for placed in &outcome.placed {
        let places = problem.extent().places_in_words(&placed.positions);
        output::print_line(format!("{}: {places}", placed.placement.name()))?;
    }
    match best_placed(&outcome.placed) {
        Some(best) => output::print_line(format!("\nBest: {}", gain(outcome, best))),
        None => Ok(()),
    }
}

fn errors(outcome: &Outcome) -> String {
    let tolerance = format!("within {}, %", format_length_mm(outcome.problem.design().tolerance_m));
    let even_m = even(outcome).map(|even| even.verification.median_error_m);
    Table::from_rows(&outcome.placed)
        .column("positions", |placed| placed.placement.name().to_owned())
        .column("mean error, mm", |placed| {
            let told = &placed.verification;
            format!("{} ± {}", figure(told.mean_error_m * 1e3), figure(told.standard_error_m * 1e3))
        })
        .column("median, mm", |placed| figure(placed.verification.median_error_m * 1e3))
        .column(tolerance, |placed| format!("{:.1}", placed.verification.within_tolerance_percent))
        .column("less than even, %", |placed| {
            let less = |even_m: f64| 100.0 * (1.0 - placed.verification.median_error_m / even_m);
            even_m.map_or_else(|| "–".to_owned(), |even_m| format!("{:.1}", less(even_m)))
        })
        .to_string()
}

/// Formats three decimals, or two significant digits of a small number.
fn figure(value: f64) -> String {
    if value >= 0.01 || value == 0.0 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

fn even<'a>(outcome: &'a Outcome) -> Option<&'a VerifiedPositions> {
    outcome.placed.iter().find(|placed| placed.placement == Placement::Even)
}

fn gain(outcome: &Outcome, best: &VerifiedPositions) -> String {
    let (name, best_m) = (best.placement.name(), best.verification.median_error_m);
    match even(outcome).map(|even| even.verification.median_error_m) {
        _ if best.placement == Placement::Even => {
            "even; no other is better by more than the noise of the calibrations".to_owned()
        }
        Some(even_m) => format!(
            "{name}, median error {} mm, {:.1} % below the even positions' {} mm",
            figure(best_m * 1e3),
            100.0 * (1.0 - best_m / even_m),
            figure(even_m * 1e3),
        ),
        None => format!("{name}, median error {} mm", figure(best_m * 1e3)),
    }
}

fn to_json(outcome: &Outcome) -> impl Serialize {
    let (problem, asked) = (outcome.problem, outcome.problem.design());
    let design = |placed: &VerifiedPositions| {
        let told = &placed.verification;
        object! {
            "method": placed.placement,
            "positions": placed.positions.iter().copied().map(in_mm).collect::<Vec<_>>(),
            "mean_error_mm": told.mean_error_m * 1e3,
            "standard_error_mm": told.standard_error_m * 1e3,
            "median_error_mm": told.median_error_m * 1e3,
            "within_tolerance_percent": told.within_tolerance_percent,
            "calibrations": told.calibrations,
        }
    };
    object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "rig": outcome.rig.display().to_string(),
        "seed": asked.seed,
        "estimator": outcome.estimator,
        "force": problem.force(),
        "count": asked.count,
        "repeats": asked.repeats,
        "tolerance_mm": asked.tolerance_m * 1e3,
        "contacts": problem.contacts().len(),
        "designs": outcome.placed.iter().map(design).collect::<Vec<_>>(),
    }
}

fn in_mm(position: Position) -> impl Serialize {
    object! { "x_mm": position.x_m * 1e3, "y_mm": position.y_m * 1e3 }
}

const PLACES: [&str; 6] = ["arrangement", "count", "grid", "middle", "portion", "positions"];

fn place_presses(rig: &mut DocumentMut, positions: &[Position], repeats: usize, extent: Extent) {
    let own = rig.get("training").and_then(Item::as_table).cloned();
    let mut training = own.unwrap_or_else(TomlTable::new);
    PLACES.iter().for_each(|key| drop(training.remove(key)));
    training.insert("arrangement", value("explicit"));
    let listed: Array = positions.iter().map(|at| toml_position(*at, extent, to_micrometre)).collect();
    training.insert("positions", value(listed));
    if repeats > 1 || training.contains_key("repeats") {
        training.insert("repeats", value(i64::try_from(repeats).unwrap_or(i64::MAX)));
    }
    rig.insert("training", Item::Table(training));
}

const SHOWN: usize = 5;

fn advise(arguments: &Arguments, rig: &Rig, recording: &Recording) -> Result<(), Failure> {
    let design = what_to_design(arguments, rig);
    if recording.rows.iter().any(|row| !row.nuisances.is_empty()) {
        remark!(
            "warning: what the nuisance coordinate changes counts as noise here: the expected errors are too large"
        );
    }
    let advice = Observer::of_stages()
        .watch(|watch| next_press(&rig.setup, recording, &design, watch))
        .map_err(|error| user_error(&error, &arguments.rig))?;
    if arguments.json {
        return output::print_json(&advice_to_json(arguments, &advice));
    }
    print_advice(&advice, rig.setup.surface().extent())
}

/// Standard deviations are averaged over the contacts.
fn advice_to_json(arguments: &Arguments, advice: &Advice) -> impl Serialize {
    let next = advice.next.iter().map(|press| {
        object! {
            "x_mm": press.position.x_m * 1e3,
            "y_mm": press.position.y_m * 1e3,
            "expected_error_mm": press.error_m * 1e3,
        }
    });
    object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "rig": arguments.rig.display().to_string(),
        "presses": advice.presses,
        "positions": advice.positions,
        "expected_error_mm": advice.error_m * 1e3,
        "endless_error_mm": advice.endless_error_m * 1e3,
        "to_gain_percent": advice.remaining_gain_percent(),
        "stop_below_percent": advice.stop_percent,
        "enough": advice.is_enough(),
        "next": next.collect::<Vec<_>>(),
        // Number of presses until the stopping rule is met; null above the largest number.
        "presses_to_go": advice.reaches_goal().then_some(advice.next.len()),
    }
}

fn print_advice(advice: &Advice, extent: Extent) -> Result<(), Failure> {
    output::print_line(format!(
        "{} presses at {} positions: expected error {:.4} mm; with endless presses {:.4} mm, {:.1} % less",
        advice.presses,
        advice.positions,
        advice.error_m * 1e3,
        advice.endless_error_m * 1e3,
        advice.remaining_gain_percent(),
    ))?;
    if advice.is_enough() {
        return output::print_line(format!("Enough: less than {} % is left to gain.", advice.stop_percent));
    }
    let mut before_m = advice.error_m;
    let rows = advice.next.iter().take(SHOWN).map(|press| {
        let gain = 100.0 * (1.0 - press.error_m / before_m);
        before_m = press.error_m;
        (press, gain)
    });
    let table = Table::from_rows(rows)
        .column("press next at, mm", |(press, _)| {
            let (x, y) = (press.position.x_m * 1e3, press.position.y_m * 1e3);
            match extent {
                Extent::Line { .. } => format!("{x:.1}"),
                Extent::Plane { .. } => format!("({x:.1}, {y:.1})"),
            }
        })
        .column("expected error, mm", |(press, _)| format!("{:.4}", press.error_m * 1e3))
        .column("gain, %", |(_, gain)| format!("{gain:.2}"));
    output::print_line(format!("\n{table}"))?;
    if advice.reaches_goal() {
        let count = advice.next.len();
        let words = if count == 1 { "press leaves" } else { "presses leave" };
        output::print_line(format!("\n{count} {words} less than {} % to gain.", advice.stop_percent))
    } else {
        output::print_line(format!(
            "\nMore than {} presses are needed to leave less than {} % to gain.",
            Advice::MOST_AHEAD,
            advice.stop_percent
        ))
    }
}
