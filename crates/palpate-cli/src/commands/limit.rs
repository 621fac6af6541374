//! `palpate limit`: Cramér–Rao bound and smallest detectable force of a bench, by position.

use crate::cost::MemoryOption;
use crate::failure::{Failure, UserError};
use crate::input::{self, RigOrLocator};
use crate::json::object;
use crate::output::{self, Table, figure};
use crate::progress::Observer;
use crate::tables::{self, CsvTable};
use crate::target::{Inputs, TargetFolder};
use palpate_estimators::detectable_force::{DetectableForce, TouchSummary};
use palpate_estimators::influence::{ForceLinearLocator, Influence};
use palpate_estimators::setup::{Setup, SetupError};
use palpate_estimators::status::FalseAlarmRate;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{
    Bound, CramerRaoBound, Force, LimitCurve, LimitError, LimitSummary, LimitWarning, limit_warnings,
    positions_with_spacing,
};
use palpate_mechanics::sensing::NoiseError;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Quantity, format_count, format_length_mm};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_report::{LimitReport, limit_report};
use serde::Serialize;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  # Compute the limit of a rig at a spacing of 50 mm
  palpate limit beam.toml --every \"50 mm\"

  # Compute the limit of noisier sensors for a contact of unknown force
  palpate limit beam.toml --noise \"20 um\" --unknown-force";

/// Compute the physical limit of the errors: the Cramér–Rao bound of position and force
///
/// Prints the bound at a list of positions, the smallest detectable force, and warnings about contacts that the sensors cannot locate. For a
/// surface without a model, name a locator: influence functions and noise are those of its fit.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file or locator
    #[arg(value_name = "RIG|LOCATOR")]
    rig: PathBuf,
    /// Spacing of the listed positions [default: nine positions on a line, 49 on a plane]
    #[arg(long, value_name = "LENGTH", value_parser = input::length)]
    every: Option<f64>,
    /// Contact force, such as "3 N" [default: that of the rig]
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    force: Option<f64>,
    /// Assume an unknown force (default when the rig has none)
    #[arg(long)]
    unknown_force: bool,
    /// Noise of all sensors that measure in this unit, such as "5 um"; may be repeated [default: that of the rig]
    #[arg(long, value_name = "NOISE", value_parser = input::quantity)]
    noise: Vec<Quantity>,
    /// Write a report into DIR: report.html, its figures, and limit.csv with the bound all over the surface
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryOption,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

struct Limits<'a> {
    limit: &'a CramerRaoBound<'a>,
    force_n: f64,
    force: Force,
    known_force: LimitCurve,
    unknown_force: LimitCurve,
    listed: Vec<Position>,
    warnings: Vec<LimitWarning>,
    touch: &'a DetectableForce<'a>,
    /// Smallest detectable force over the surface, for both detection probabilities.
    touches: [Option<TouchSummary>; 2],
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let folder = arguments.report.as_ref();
    let inputs = Inputs::new([arguments.rig.as_path()]);
    let folder = folder.map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()?;
    let bench = RigOrLocator::read(&arguments.rig)?;
    let setup = setup(&bench, arguments)?;
    let complain = |error| user_error(error, &arguments.rig);
    let extent = setup.surface().extent();
    let listed = match arguments.every {
        Some(every_m) => positions_with_spacing(extent, every_m).map_err(complain)?,
        None => a_few(extent),
    };
    check_cost(&setup, listed.len(), arguments)?;
    let (limit, mut touch);
    match force_linear_locator(&bench) {
        Some(linear) => {
            limit = linear.cramer_rao_bound(extent);
            touch = linear.lightest_touch();
        }
        None => {
            let observer = Observer::of_stages();
            limit = observer.watch(|watch| setup.cramer_rao_bound_watched(watch)).map_err(complain)?;
            touch = Influence { false_alarm_rate: false_alarm_rate(&bench), ..Influence::default() }
                .lightest_touch(&limit);
        }
    }
    if let RigOrLocator::Locator(locator) = &bench {
        touch = locator.add_scatter(touch);
    }
    let limits = Observer::of_stages()
        .watch(|watch| limits(&limit, &touch, &setup, listed, arguments, watch))
        .map_err(complain)?;
    if let Some(folder) = &folder {
        write_report(&limits, &setup, arguments, folder)?;
    }
    if arguments.json {
        output::print_json(&json(&limits, &setup, arguments))
    } else {
        print(&limits, &setup, arguments)
    }
}

fn check_cost(setup: &Setup, listed: usize, arguments: &Arguments) -> Result<(), Failure> {
    let Some(surface) = setup.surface().model() else { return Ok(()) };
    let cost = CramerRaoBound::cost(surface, setup.layout(), listed);
    let what = format!("the limit of {} sensors", format_count(setup.layout().len() as u64));
    arguments.memory.check_work(&what, cost.seconds, cost.memory_bytes, "take fewer sensors or `elements`")
}

fn force_linear_locator(bench: &RigOrLocator) -> Option<&ForceLinearLocator> {
    match bench {
        RigOrLocator::Locator(locator) => locator.force_linear(),
        RigOrLocator::Rig(_) => None,
    }
}

fn false_alarm_rate(bench: &RigOrLocator) -> FalseAlarmRate {
    let set = match bench {
        RigOrLocator::Rig(rig) => rig.estimator.false_alarm_rate(),
        RigOrLocator::Locator(locator) => locator.false_alarm_rate(),
    };
    set.unwrap_or_default()
}

fn setup(bench: &RigOrLocator, arguments: &Arguments) -> Result<Setup, Failure> {
    let mut setup = match bench {
        RigOrLocator::Rig(rig) => rig.setup.clone(),
        RigOrLocator::Locator(locator) => {
            locator.learnt_setup().map_err(|error| UserError::for_path(&arguments.rig, error))?
        }
    };
    if let (Some(_), Some(noise)) = (force_linear_locator(bench), arguments.noise.first()) {
        let message =
            format!("--noise {noise}: the noise of a locator of a measured surface is what it learnt");
        return Err(UserError::new(message).help("leave --noise out").into());
    }
    for noise in &arguments.noise {
        setup = setup.with_noise(*noise).map_err(|error| match error {
            SetupError::NoSensorOfUnit { .. } => {
                let user_error =
                    UserError::new(format!("--noise {noise}: no sensor of the rig measures in this unit"));
                user_error.help("give the noise in the unit of the readings, as in \"5 um\"")
            }
            error => UserError::new(format!("--noise {noise}: {error}")),
        })?;
    }
    Ok(setup)
}

fn user_error(error: LimitError, rig: &Path) -> Failure {
    if Cancelled::caused(&error) {
        return Failure::stopped();
    }
    let user_error = UserError::for_path(rig, error);
    let help = match error {
        LimitError::NoModel => {
            "fit `kind = \"influence\"` to a recording with forces, and name its locator instead of the rig; or give a surface with a model, such as `kind = \"beam\"`"
        }
        LimitError::Noise(NoiseError::Singular { .. }) => {
            "add `noise = \"5 um\"` to [sensors], or try one with --noise \"5 um\""
        }
        LimitError::Noise(error) => error.help(),
        LimitError::NoForce => "--force \"3 N\" gives one, or `force = \"3 N\"` in [contact]",
        LimitError::Force { .. } => "--force takes a force such as \"3 N\"",
        LimitError::Positions { .. } => "--every takes a length between two positions, such as \"10 mm\"",
        LimitError::Surface(error) => error.help(),
        LimitError::Cancelled(_) => "start it again",
    };
    user_error.help(help).into()
}

fn limits<'a>(
    limit: &'a CramerRaoBound<'a>,
    touch: &'a DetectableForce<'a>,
    setup: &Setup,
    listed: Vec<Position>,
    arguments: &Arguments,
    watch: Watch,
) -> Result<Limits<'a>, LimitError> {
    let force_n = arguments.force.or(setup.force_n()).ok_or(LimitError::NoForce)?;
    let unknown = arguments.unknown_force || setup.force_n().is_none();
    let force = if unknown { Force::Unknown } else { Force::Known };
    limit.prepare(&listed, watch)?;
    let known = LimitCurve::over_surface(limit, force_n, Force::Known)?;
    let positions: Vec<Position> = known.points.iter().map(|point| point.position).collect();
    Ok(Limits {
        limit,
        force_n,
        force,
        touch,
        touches: touch.summaries(&positions),
        known_force: known,
        unknown_force: LimitCurve::over_surface(limit, force_n, Force::Unknown)?,
        listed,
        warnings: limit_warnings(limit, force_n, force, watch)?,
    })
}

/// A few symmetric positions, such as 1, 20, 50, 100, 200 mm and mirrored for the paper's beam.
fn a_few(extent: Extent) -> Vec<Position> {
    const ON_A_LINE: [f64; 9] = [0.0025, 0.05, 0.125, 0.25, 0.5, 0.75, 0.875, 0.95, 0.9975];
    const ON_A_PLANE: [f64; 7] = [0.05, 0.125, 0.25, 0.5, 0.75, 0.875, 0.95];
    let x_m = |share: &f64| share * extent.length_m();
    let Some(width_m) = extent.width_m() else {
        return ON_A_LINE.iter().map(|share| Position::along(x_m(share))).collect();
    };
    let row = |y: &f64| {
        let y_m = y * width_m;
        ON_A_PLANE.iter().map(move |x| Position { x_m: x_m(x), y_m })
    };
    ON_A_PLANE.iter().flat_map(row).collect()
}

impl Limits<'_> {
    fn bounds_at(&self, position: Position) -> [Option<Bound>; 2] {
        let contact = Contact { position, force_n: self.force_n };
        [Force::Known, Force::Unknown].map(|force| self.limit.bound_at(contact, force))
    }
}

fn write_report(
    limits: &Limits,
    setup: &Setup,
    arguments: &Arguments,
    folder: &TargetFolder,
) -> Result<(), Failure> {
    let report = LimitReport {
        title: &format!("What physics allows: the limit of {}", arguments.rig.display()),
        setup,
        limit: limits.limit,
        known_force: &limits.known_force,
        unknown_force: &limits.unknown_force,
        force: limits.force,
        warnings: &limits.warnings,
        listed: &limits.listed,
        touch: limits.touch,
    };
    folder.write_report(limit_report(&report))?;
    limit_table(limits, arguments).write(folder, "limit.csv")
}

/// Cells of unidentifiable contacts are empty.
fn limit_table(limits: &Limits, arguments: &Arguments) -> CsvTable {
    let extent = limits.known_force.extent;
    let comment = format!(
        "limit of {}, {} N, {} of false alarms",
        arguments.rig.display(),
        limits.force_n,
        limits.touch.rate()
    );
    let figures = [
        "limit_known_force_mm",
        "limit_unknown_force_mm",
        "limit_of_force_n",
        "lightest_touch_50_percent_n",
        "lightest_touch_95_percent_n",
    ];
    let mut table = CsvTable::new(&comment, [tables::position_columns(extent), figures.to_vec()].concat());
    for (known, unknown) in limits.known_force.points.iter().zip(&limits.unknown_force.points) {
        let mm = |bound: &Option<Bound>| bound.map(|bound| bound.sd_position_m * 1e3);
        let [half_n, surely_n] = limits.touch.forces_at(known.position);
        let force_n = unknown.bound.and_then(|bound| bound.sd_force_n);
        let figures = [mm(&known.bound), mm(&unknown.bound), force_n, half_n, surely_n].map(tables::cell);
        table.row([tables::position_cells(known.position, extent), figures.to_vec()].concat());
    }
    table
}

/// Limits of unidentifiable contacts are null.
fn json(limits: &Limits, setup: &Setup, arguments: &Arguments) -> impl Serialize {
    // Limits over the surface; `mean_error_mm` is the mean error of an estimator at the limit.
    let summary = |summary: LimitSummary| {
        object! {
            "mean_mm": summary.mean_m * 1e3,
            "median_mm": summary.median_m * 1e3,
            "mean_error_mm": summary.mean_error_m * 1e3,
            "least_mm": summary.best.1 * 1e3,
            "least_at_mm": in_mm(summary.best.0),
            "largest_mm": summary.worst.1 * 1e3,
            "largest_at_mm": in_mm(summary.worst.0),
            "positions_without": summary.unidentifiable,
            "share_without_percent": 100.0 * summary.unidentifiable as f64 / limits.known_force.points.len() as f64,
        }
    };
    let at = |&position: &Position| {
        let [known, unknown] = limits.bounds_at(position);
        object! {
            "x_mm": position.x_m * 1e3,
            "y_mm": position.y_m * 1e3,
            "known_force_mm": known.map(|bound| bound.sd_position_m * 1e3),
            "unknown_force_mm": unknown.map(|bound| bound.sd_position_m * 1e3),
            "force_sd_n": unknown.and_then(|bound| bound.sd_force_n),
            "lightest_touch_n": limits.touch.forces_at(position),
        }
    };
    // Forces that are detected with this probability if the force is unknown.
    let touch = |summary: &TouchSummary| {
        object! {
            "found_percent": summary.found * 100.0,
            "median_n": summary.median_n,
            "largest_n": summary.worst.1,
            "largest_at_mm": in_mm(summary.worst.0),
            "positions_without": summary.undetected,
        }
    };
    let warning = |warning: &LimitWarning| {
        // Millimetres for a blind zone, standard deviations for the others.
        let unit = if matches!(warning, LimitWarning::Blind { .. }) { 1e3 } else { 1.0 };
        let ((value, bound), zone) = (warning.value_and_bound(), warning.zone());
        object! {
            "kind": warning.kind(),
            "from_mm": in_mm(zone.from),
            "to_mm": in_mm(zone.to),
            "value": value.map(|value| value * unit),
            "bound": bound * unit,
            "message": warning.to_string(),
            "help": warning.help(),
        }
    };
    object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "rig": arguments.rig.display().to_string(),
        "length_mm": setup.surface().extent().length_m() * 1e3,
        "sensors": setup.layout().len(),
        "sensors_alive": limits.limit.enabled_count(),
        "force_n": limits.force_n,
        // Knowledge of the force in the rig, which the warnings assume.
        "force": limits.force,
        "known_force": limits.known_force.summary().map(summary),
        "unknown_force": limits.unknown_force.summary().map(summary),
        "false_alarm_rate_percent": limits.touch.rate().share() * 100.0,
        "lightest_touch": limits.touches.iter().map(|summary| summary.as_ref().map(touch)).collect::<Vec<_>>(),
        "positions": limits.listed.iter().map(at).collect::<Vec<_>>(),
        "warnings": limits.warnings.iter().map(warning).collect::<Vec<_>>(),
    }
}

fn in_mm(position: Position) -> [f64; 2] {
    [position.x_m * 1e3, position.y_m * 1e3]
}

fn print(limits: &Limits, setup: &Setup, arguments: &Arguments) -> Result<(), Failure> {
    output::print_line(format!(
        "{}: {} of {} sensors alive, {} N, force {}\n",
        arguments.rig.display(),
        limits.limit.enabled_count(),
        setup.layout().len(),
        limits.force_n,
        limits.force.name()
    ))?;
    match limits.known_force.extent {
        line @ Extent::Line { .. } => print_line(limits, line)?,
        Extent::Plane { .. } => print_plane(limits)?,
    }
    output::print_line(format!("{}\n{}", unidentifiable_lines(limits), lightest_touch_in_words(limits)))?;
    for warning in &limits.warnings {
        output::print_line(format!("\nwarning: {warning}\n  would help: {}", warning.help()))?;
    }
    output::print_report_path("\n", arguments.report.as_deref())
}

fn print_line(limits: &Limits, extent: Extent) -> Result<(), Failure> {
    let limit = |bound: Option<Bound>| limit_figure(bound.as_ref());
    let rows = limits.listed.iter().map(|&position| (position, limits.bounds_at(position)));
    let table = Table::from_rows(rows)
        .column("limit, mm", |(position, _)| extent.place_in_words(*position))
        .column("force known", |(_, [known, _])| limit(*known))
        .column("force unknown", |(_, [_, unknown])| limit(*unknown))
        .column("force itself, N", |(_, [_, unknown])| {
            figure_or_unidentifiable(unknown.and_then(|bound| bound.sd_force_n))
        })
        .column("lightest touch, N", |(position, _)| force_figure(limits.touch.forces_at(*position)[1]));
    output::print_line(summary_rows(limits).into_iter().fold(table, Table::row))
}

fn print_plane(limits: &Limits) -> Result<(), Failure> {
    const MOST_COLUMNS: usize = 12;
    let mut rows: Vec<&[Position]> = limits.listed.chunk_by(|a, b| a.y_m == b.y_m).collect();
    rows.reverse();
    let columns = rows.first().map_or(&[][..], |row| *row);
    if columns.len() > MOST_COLUMNS {
        return print_line(limits, limits.known_force.extent);
    }
    for (force, name) in [(Force::Known, "force known"), (Force::Unknown, "force unknown")] {
        let cell = |position: Position| {
            let bound = limits.limit.bound_at(Contact { position, force_n: limits.force_n }, force);
            limit_figure(bound.as_ref())
        };
        let table = Table::from_rows(rows.iter().copied()).column(format!("limit, mm, {name}"), |row| {
            row.first().map_or(String::new(), |at| format!("y {}", format_length_mm(at.y_m)))
        });
        let table = columns.iter().enumerate().fold(table, |table, (i, at)| {
            table.column(format!("x {}", format_length_mm(at.x_m)), |row| cell(row[i]))
        });
        output::print_line(format!("{table}\n"))?;
    }
    let table = Table::from_rows([]).column("limit, mm", |()| String::new());
    let table = ["force known", "force unknown", "", ""]
        .into_iter()
        .fold(table, |t, name| t.column(name, |()| String::new()));
    output::print_line(summary_rows(limits).into_iter().fold(table, Table::row))
}

fn limit_figure(bound: Option<&Bound>) -> String {
    figure_or_unidentifiable(bound.map(|bound| bound.sd_position_m * 1e3))
}

fn figure_or_unidentifiable(value: Option<f64>) -> String {
    value.map_or_else(|| "unidentifiable".to_owned(), |value| figure(Some(value)))
}

fn unidentifiable_lines(limits: &Limits) -> String {
    let line = |(curve, name): (&LimitCurve, &str)| {
        let words = curve.unidentifiable_text()?;
        Some(format!(
            "\nforce {name}: unidentifiable, and excluded from the limits over the surface, {words}\n"
        ))
    };
    [(&limits.known_force, "known"), (&limits.unknown_force, "unknown")]
        .into_iter()
        .filter_map(line)
        .collect()
}

fn force_figure(force_n: Option<f64>) -> String {
    let three = |force_n: f64| -> f64 { format!("{force_n:.2e}").parse().unwrap_or(force_n) };
    force_n.map_or_else(|| "–".to_owned(), |force_n| three(force_n).to_string())
}

fn lightest_touch_in_words(limits: &Limits) -> String {
    let extent = limits.known_force.extent;
    let rate = limits.touch.rate();
    let [Some(half), Some(surely)] = &limits.touches else {
        return format!("lightest touch: no force is detected at {rate} of false alarms");
    };
    let without = match surely.undetected {
        0 => String::new(),
        1 => ", none at 1 position".to_owned(),
        without => format!(", none at {without} positions"),
    };
    format!(
        "lightest touch, found in {} % of its readings at {rate} of false alarms, force unknown: median {} N, largest {} N at {}{without}; found in {} %: median {} N",
        surely.found * 100.0,
        force_figure(Some(surely.median_n)),
        force_figure(Some(surely.worst.1)),
        extent.place_in_words(surely.worst.0),
        half.found * 100.0,
        force_figure(Some(half.median_n)),
    )
}

/// Rows of the limit over the whole surface.
fn summary_rows(limits: &Limits) -> Vec<Vec<String>> {
    let summaries = [limits.known_force.summary(), limits.unknown_force.summary()];
    let row = |name: &str, of: fn(&LimitSummary) -> f64| {
        let [known, unknown] = summaries.map(|summary| figure(summary.as_ref().map(|s| of(s) * 1e3)));
        vec![name.to_owned(), known, unknown, String::new(), String::new()]
    };
    vec![
        row("surface: mean", |summary| summary.mean_m),
        row("median", |summary| summary.median_m),
        row("largest", |summary| summary.worst.1),
        row("mean error at the limit", |summary| summary.mean_error_m),
    ]
}
