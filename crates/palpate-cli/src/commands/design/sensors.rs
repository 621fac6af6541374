//! `palpate design sensors`: kinds and positions of sensors, compared with the even layout.

use super::{changed_rig, design_error, print_files, to_micrometre, toml_position};
use crate::cost::MemoryOption;
use crate::failure::{Failure, UserError};
use crate::input;
use crate::json::{Object, fields, object};
use crate::output::{self, Table, figure};
use crate::progress::Observer;
use crate::remark::remark;
use crate::target::{Inputs, Target, TargetFolder};
use palpate_design::sensors::{
    AssessedLayout, Assessment, CountPoint, DesignCriterion, DesignError, Method, SensorDesign,
    SensorProblem, Verification, best_design, enough, to_verify,
};
use palpate_estimators::estimator::FitError;
use palpate_estimators::evaluation::EvaluationError;
use palpate_estimators::setup::Setup;
use palpate_mechanics::limit::LimitError;
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Quantity, format_count, format_length_mm};
use palpate_numerics::watch::Watch;
use palpate_report::{SensorDesignReport, sensor_design_report};
use palpate_rig::Rig;
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table as TomlTable, Value, value};

const EXAMPLES: &str = "\
Examples:
  # Design a layout of four sensors, and write the rig with it
  palpate design sensors beam.toml --count 4 -o four.toml

  # Compute the limit of 2 to 4 sensors
  palpate design sensors beam.toml --counts 2..4";

/// Design a sensor layout: choose positions that minimize the physical limit of the location error
///
/// Compares several methods. Candidates and constraints are those of the rig's [design]; without it, the sensors of the rig are placed anew for
/// contacts all over the surface.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    /// Number of sensors [default: that of the rig]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..=1000))]
    count: Option<u16>,
    /// Keep the sensors of the rig and add N sensors
    #[arg(long, value_name = "N", conflicts_with = "count", value_parser = clap::value_parser!(u16).range(1..=1000))]
    add: Option<u16>,
    /// Compute the limit for a range of numbers of sensors, such as 2..16
    #[arg(long, value_name = "FROM..TO", value_parser = counts)]
    counts: Option<RangeInclusive<usize>>,
    /// Contact force, such as "3 N" [default: that of the rig]
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    force: Option<f64>,
    /// Assume an unknown force (default when the rig has none)
    #[arg(long)]
    unknown_force: bool,
    /// Verify each layout by N simulated calibrations [default: 3 with --report, otherwise 0]
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5",
          value_parser = clap::value_parser!(u16).range(0..=10_000))]
    verify: Option<u16>,
    /// Seed of searches and simulations
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write the rig with the best layout to RIG
    #[arg(short, long, value_name = "RIG")]
    out: Option<PathBuf>,
    /// Write a report into DIR: report.html and its figures
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryOption,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

struct Outcome<'a> {
    rig: &'a Path,
    problem: &'a SensorProblem<'a>,
    designed: Vec<AssessedLayout>,
    /// Errors of simulated calibrations, for some of the layouts.
    verified: Vec<(Method, Verification)>,
    counts: Vec<CountPoint>,
    seed: u64,
}

impl Outcome<'_> {
    fn verification(&self, method: Method) -> Option<&Verification> {
        self.verified.iter().find(|(of, _)| *of == method).map(|(_, verification)| verification)
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let text = input::read_text(&arguments.rig)?;
    let rig = input::parse_rig(&arguments.rig, &text)?;
    let inputs = Inputs::new([arguments.rig.as_path()]);
    let out = arguments.out.as_ref().map(|path| Target::new(path, &inputs)).transpose()?;
    let report = arguments.report.as_ref();
    let report = report.map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()?;
    let (setup, design) = what_to_design(arguments, &rig)?;
    let to_failure = |error: DesignError| user_error(&error, &arguments.rig);
    let cost = SensorProblem::estimated_cost(&setup, &design).map_err(to_failure)?;
    let what = format!("the design with {} candidate sensors", format_count(cost.candidates as u64));
    let remedy = "set `sites` or the contacts' `every` wider apart";
    arguments.memory.check_work(&what, [cost.seconds; 2], cost.memory_bytes, remedy)?;
    let observer = Observer::of_stages();
    let problem = observer.watch(|watch| SensorProblem::new(&setup, &design, watch)).map_err(to_failure)?;
    let outcome = observer.watch(|watch| outcome(arguments, &rig, &problem, watch))?;
    drop(observer);
    if let (Some(target), Some(best)) = (&out, best_design(&outcome.designed)) {
        let extent = setup.surface().extent();
        let (rig, written) = changed_rig(target.path(), &text, "layout", |rig| {
            place_sensors(rig, &best.layout, &design.fixed, extent);
        })?;
        if rig.setup.layout().len() != best.layout.len() {
            return Err(UserError::new("the rig does not take the layout").into());
        }
        target.write(written.as_bytes())?;
    }
    if let Some(folder) = &report {
        write_report(&outcome, &setup, folder)?;
    }
    if arguments.json {
        return output::print_json(&to_json(&outcome));
    }
    print(&outcome)?;
    print_files(arguments.out.as_deref(), arguments.report.as_deref())
}

fn what_to_design(arguments: &Arguments, rig: &Rig) -> Result<(Setup, SensorDesign), Failure> {
    let force_n = arguments.force.or(rig.setup.force_n());
    let setup = rig.setup.clone().with_force(force_n);
    let setup = setup.map_err(|error| UserError::for_path(&arguments.rig, error))?;
    let mut design = match &rig.design {
        Some(design) => design.clone(),
        None => SensorDesign::for_setup(&rig.setup).map_err(|error| user_error(&error, &arguments.rig))?,
    };
    if arguments.unknown_force {
        design = design.unknown_force();
    }
    if let Some(count) = arguments.count {
        design.count = usize::from(count);
    }
    if let Some(count) = arguments.add {
        let adding = design.adding(usize::from(count), rig.setup.layout());
        design = adding.map_err(|error| user_error(&error, &arguments.rig))?;
        let dead = rig.setup.layout().len() - design.fixed.len();
        if dead > 0 {
            remark!("palpate: {dead} existing sensors are dead, and are not kept");
        }
    }
    Ok((setup, design))
}

fn outcome<'a>(
    arguments: &'a Arguments,
    rig: &Rig,
    problem: &'a SensorProblem<'a>,
    watch: Watch,
) -> Result<Outcome<'a>, Failure> {
    let to_failure = |error: DesignError| user_error(&error, &arguments.rig);
    let designed = problem.all(arguments.seed, watch).map_err(to_failure)?;
    let counts = match &arguments.counts {
        None => Vec::new(),
        Some(range) => problem.counts(range.clone(), arguments.seed, watch).map_err(to_failure)?,
    };
    let calibrations = arguments.verify.unwrap_or(if arguments.report.is_some() { 3 } else { 0 });
    let mut verified = Vec::new();
    if calibrations > 0 {
        for designed in to_verify(&designed) {
            let verification = problem.verify(
                &designed.layout,
                &rig.estimator,
                usize::from(calibrations),
                arguments.seed,
                watch,
            );
            let to_failure = |error: EvaluationError<FitError>| match Failure::from_error(&error) {
                Failure::BadInput(_) => {
                    UserError::new(format!("{}: cannot verify: {error}", arguments.rig.display())).into()
                }
                stopped => stopped,
            };
            verified.push((designed.method, verification.map_err(to_failure)?));
        }
    }
    Ok(Outcome { rig: &arguments.rig, problem, designed, verified, counts, seed: arguments.seed })
}

fn write_report(outcome: &Outcome, setup: &Setup, folder: &TargetFolder) -> Result<(), Failure> {
    let report = SensorDesignReport {
        title: &format!("Sensors for {}", outcome.rig.display()),
        setup,
        problem: outcome.problem,
        designed: &outcome.designed,
        verified: &outcome.verified,
        counts: &outcome.counts,
        seed: outcome.seed,
    };
    folder.write_report(sensor_design_report(&report))
}

fn user_error(error: &DesignError, rig: &Path) -> Failure {
    design_error(error, rig, help(error))
}

const MOST_COUNT: usize = 200;

/// Parses "2..16", both ends included.
fn counts(text: &str) -> Result<RangeInclusive<usize>, String> {
    let form = || format!("`{text}` is not a range; write the smallest and the largest number, as in 2..16");
    let (from, to) = text.split_once("..").ok_or_else(form)?;
    let number = |text: &str| text.trim_start_matches('=').trim().parse::<usize>().map_err(|_| form());
    let (from, to) = (number(from)?, number(to)?);
    if from < 1 || to > MOST_COUNT || from > to {
        return Err(format!("`{text}` must be a range from 1 to {MOST_COUNT}, the smaller number first"));
    }
    Ok(from..=to)
}

pub fn help(error: &DesignError) -> &'static str {
    match error {
        DesignError::Limit(LimitError::NoModel) => "give a surface with a model, such as `kind = \"beam\"`",
        DesignError::Limit(LimitError::NoForce | LimitError::Force { .. }) => {
            "the limit depends on the contact force: `force = \"3 N\"` in [contact], or --force \"3 N\""
        }
        DesignError::Limit(LimitError::Noise(error)) => error.help(),
        DesignError::Limit(LimitError::Surface(error)) => error.help(),
        DesignError::Cancelled(_) | DesignError::Limit(LimitError::Cancelled(_)) => "start it again",
        DesignError::Limit(LimitError::Positions { .. }) => "set the contacts' `every` wider apart",
        DesignError::OutOfRange(_) | DesignError::Layout(_) => "check it in [design]",
        DesignError::SingularNoise { .. } => {
            "add `noise = \"5 um\"` to [sensors], or to the kind in [design] `kinds`"
        }
        DesignError::OverSupports { .. } => "set [design] `contacts` elsewhere too, or `force = \"known\"`",
        DesignError::TooFewSites { .. } => {
            "lower `count`, bring `sites` closer together, or make `keep_out` smaller"
        }
        DesignError::Spacing { .. } => "lower `count` or `spacing`, or make `keep_out` smaller",
        DesignError::NoMirror { .. } => "lower `count`, bring `sites` closer together, or allow symmetry",
        DesignError::Budget { .. } => "raise `budget`, lower `count`, or offer cheaper `kinds`",
        DesignError::TooManyMustHaves { .. } => "raise `count`, or take some from `must_have`",
        DesignError::MustHaveReadsNothing { .. } => "move it, or remove it",
        DesignError::MustHaveKeptOut { .. } => "move it, or change the zone",
        DesignError::MustHavesExclude { .. } => "move one of them, or relax the constraint",
        DesignError::MustHaveWithoutTwin { .. } => "move it, or remove `symmetry`",
        DesignError::KeptDiffers { .. } => {
            "give the kind that noise in [design] `kinds`, or give every sensor of the kind the same in [sensors]"
        }
        DesignError::Symmetry { .. } => {
            "choose `sites` that mirror each other, such as a distance that divides the length, or an even `count`"
        }
        DesignError::NoLayout { .. } => {
            "choose another method, relax the constraints, or allow sensors other than reactions"
        }
        DesignError::TooLarge { .. } => "set `sites` or the contacts' `every` wider apart",
    }
}

fn print(outcome: &Outcome) -> Result<(), Failure> {
    let (problem, design) = (outcome.problem, outcome.problem.design());
    output::print_line(format!(
        "{}: {} of {} candidate sensors, {} contacts, {} N, force {}; score: {}\n",
        outcome.rig.display(),
        match design.fixed.len() {
            0 => design.count.to_string(),
            kept => format!("{kept} kept and {} new", design.count - kept),
        },
        format_count(problem.candidates() as u64),
        problem.contacts().len(),
        problem.force_n(),
        problem.force().name(),
        score_in_words(design.criterion)
    ))?;
    if let Some(words) = excluded_contacts_text(problem) {
        output::print_line(words + "\n")?;
    }
    output::print_line(designs(outcome))?;
    if outcome.designed.iter().any(|designed| !designed.assessment.keeps_constraints) {
        output::print_line("* breaks a constraint of [design]")?;
    }
    output::print_line("")?;
    for designed in &outcome.designed {
        output::print_line(format!(
            "{}: {}",
            designed.method.name(),
            problem.places_in_words(&designed.layout)
        ))?;
    }
    if let Some(best) = best_design(&outcome.designed) {
        output::print_line(format!("\nBest: {}", gain(outcome, best)))?;
    }
    if outcome.counts.is_empty() { Ok(()) } else { print_counts(outcome) }
}

fn excluded_contacts_text(problem: &SensorProblem) -> Option<String> {
    let places = problem.contacts_over_supports();
    let reason = "where an unknown force is unidentifiable: excluded from scores and limits";
    match places.as_slice() {
        [] => None,
        [place] => Some(format!(
            "1 contact, at {}, is over a support, {reason}",
            problem.extent().place_in_words(*place)
        )),
        _ => Some(format!("{} contacts are over supports, {reason}", places.len())),
    }
}

fn score_in_words(criterion: DesignCriterion) -> &'static str {
    match criterion {
        DesignCriterion::MeanLimit => "mean limit with the prior, mm",
        DesignCriterion::WorstLimit => "largest limit with the prior, mm",
        DesignCriterion::WithinTolerance => "contacts beyond the tolerance, %",
        DesignCriterion::DOptimality => "mean of ½·ln det of the least covariance",
    }
}

fn designs(outcome: &Outcome) -> String {
    let design = outcome.problem.design();
    let tolerance = format!("within {}, %", format_length_mm(design.tolerance_m));
    let unit = design.criterion.score_scale();
    let mm = |limit_m: Option<f64>| figure(limit_m.map(|limit_m| limit_m * 1e3));
    let mut table = Table::from_rows(&outcome.designed)
        .column("layout", |designed| {
            let star = if designed.assessment.keeps_constraints { "" } else { " *" };
            format!("{}{star}", designed.method.name())
        })
        .column("score", |designed| figure(Some(designed.assessment.score * unit)))
        .column("mean limit, mm", |designed| mm(designed.assessment.mean_limit_m))
        .column("largest, mm", |designed| mm(designed.assessment.worst_limit_m))
        .column(tolerance, |designed| format!("{:.1}", designed.assessment.within_tolerance_percent))
        .column("one dead: score", |designed| {
            figure(designed.assessment.score_one_dead.map(|score| score * unit))
        });
    if design.has_costs() {
        table = table.column("cost", |designed| designed.assessment.cost.to_string());
    }
    if !outcome.verified.is_empty() {
        table = table.column("simulated error, mm", |designed| {
            let told = outcome.verification(designed.method);
            told.map_or_else(
                || "–".to_owned(),
                |told| format!("{:.3} ± {:.3}", told.mean_error_m * 1e3, told.standard_error_m * 1e3),
            )
        });
    }
    table.to_string()
}

fn gain(outcome: &Outcome, best: &AssessedLayout) -> String {
    let name = best.method.name();
    let (even, reference) = match outcome.problem.reference(&outcome.designed) {
        Some(reference) => (Some(reference), reference.method.reference_in_words()),
        None => (None, ""),
    };
    let limits = even.and_then(|even| {
        let (even_m, best_m) = (even.assessment.mean_limit_m?, best.assessment.mean_limit_m?);
        Some((even_m * 1e3, best_m * 1e3, 100.0 * (1.0 - best_m / even_m)))
    });
    let Some((even_mm, best_mm, percent)) = limits else { return name.to_owned() };
    let compared = |percent: f64| {
        if percent >= 0.0 { format!("{percent:.1} % below") } else { format!("{:.1} % above", -percent) }
    };
    let mut words =
        format!("{name}, mean limit {best_mm:.3} mm, {} {reference} {even_mm:.3} mm", compared(percent));
    let errors =
        even.and_then(|even| Some((outcome.verification(even.method)?, outcome.verification(best.method)?)));
    if let Some((even, best)) = errors {
        let percent = 100.0 * (1.0 - best.mean_error_m / even.mean_error_m);
        words += &format!(
            "; in simulation its error is {:.3} mm, {} {reference} {:.3} mm",
            best.mean_error_m * 1e3,
            compared(percent),
            even.mean_error_m * 1e3
        );
    }
    words
}

fn print_counts(outcome: &Outcome) -> Result<(), Failure> {
    let unit = outcome.problem.design().criterion.score_scale();
    let mm = |limit_m: Option<f64>| figure(limit_m.map(|limit_m| limit_m * 1e3));
    let table = Table::from_rows(&outcome.counts)
        .column("sensors", |point| point.count.to_string())
        .column("even: score", |point| figure(point.even.as_ref().map(|even| even.score * unit)))
        .column("mean limit, mm", |point| mm(point.even.as_ref().and_then(|even| even.mean_limit_m)))
        .column("designed: score", |point| figure(Some(point.designed.score * unit)))
        .column("mean limit, mm", |point| mm(point.designed.mean_limit_m))
        .column("largest, mm", |point| mm(point.designed.worst_limit_m))
        .column("within, %", |point| format!("{:.1}", point.designed.within_tolerance_percent));
    output::print_line(format!("\n{table}"))?;
    match enough(&outcome.counts) {
        Some(count) => {
            output::print_line(format!("\n{count} sensors come within 10 % of the score of the most."))
        }
        None => Ok(()),
    }
}

/// Limits of unidentifiable contacts are null. Scores: limits in mm, the share beyond the tolerance
/// in %, D-optimality as ½·ln det.
fn to_json(outcome: &Outcome) -> impl Serialize {
    let (problem, design) = (outcome.problem, outcome.problem.design());
    let scale = design.criterion.score_scale();
    let mm = |length_m: Option<f64>| length_m.map(|length_m| length_m * 1e3);
    let assessment = |assessed: &Assessment| {
        fields! {
            "score": assessed.score * scale,
            "mean_limit_mm": mm(assessed.mean_limit_m),
            "worst_limit_mm": mm(assessed.worst_limit_m),
            "mean_error_at_limit_mm": mm(assessed.mean_error_m),
            "within_tolerance_percent": assessed.within_tolerance_percent,
            "score_one_dead": assessed.score_one_dead.map(|score| score * scale),
            "cost": assessed.cost,
            "keeps_constraints": assessed.keeps_constraints,
        }
    };
    let position = |sensor: &Sensor| {
        object! {
            "measure": sensor.kind,
            "x_mm": sensor.position.x_m * 1e3,
            "y_mm": sensor.position.y_m * 1e3,
            // True for an existing sensor that is kept.
            "kept"?: (!design.fixed.is_empty()).then(|| problem.is_kept(sensor)),
        }
    };
    let simulated = |verification: &Verification| {
        object! {
            "mean_error_mm": verification.mean_error_m * 1e3,
            "standard_error_mm": verification.standard_error_m * 1e3,
            "within_tolerance_percent": verification.within_tolerance_percent,
            "calibrations": verification.calibrations,
        }
    };
    let designed = |designed: &AssessedLayout| {
        object! {
            "method": designed.method,
            "positions": designed.layout.sensors().iter().map(position).collect::<Vec<_>>(),
            ..assessment(&designed.assessment),
            "simulated": outcome.verification(designed.method).map(simulated),
        }
    };
    let count = |point: &CountPoint| {
        object! {
            "count": point.count,
            "even": point.even.as_ref().map(|even| Object(assessment(even))),
            "designed": Object(assessment(&point.designed)),
        }
    };
    object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "rig": outcome.rig.display().to_string(),
        "seed": outcome.seed,
        "force_n": problem.force_n(),
        "force": problem.force(),
        "criterion": design.criterion.name(),
        "tolerance_mm": design.tolerance_m * 1e3,
        "candidates": problem.candidates(),
        "contacts": problem.contacts().len(),
        "contacts_over_supports": problem.contacts_over_supports().len(),
        "designs": outcome.designed.iter().map(designed).collect::<Vec<_>>(),
        "counts": outcome.counts.iter().map(count).collect::<Vec<_>>(),
    }
}

const PLACES: [&str; 4] = ["count", "grid", "positions", "dead"];

fn place_sensors(rig: &mut DocumentMut, layout: &Layout, kept: &[Sensor], extent: Extent) {
    let own = sections(rig.get("sensors"));
    let mut new = ArrayOfTables::new();
    for kind in SensorKind::ALL {
        let sensors: Vec<&Sensor> = layout.sensors().iter().filter(|sensor| sensor.kind == kind).collect();
        if let Some(first) = sensors.first() {
            let mut section = section(kind, &own, &first.channel);
            let mut places = positions(&sensors, extent);
            let of_kind = kept.iter().filter(|sensor| sensor.kind == kind).count();
            if !kept.is_empty() && of_kind < sensors.len() {
                let new = format!(" # the last {} are new", sensors.len() - of_kind);
                places.decor_mut().set_suffix(new);
            }
            section.insert("positions", Item::Value(Value::Array(places)));
            new.push(section);
        }
    }
    if let (Some(first), Some(table)) = (own.first(), new.get_mut(0)) {
        table.decor_mut().clone_from(first.decor());
    }
    // Position of the old sections in the file.
    let position = own.first().and_then(TomlTable::position);
    for table in new.iter_mut() {
        table.set_position(position);
    }
    rig.insert("sensors", Item::ArrayOfTables(new));
}

fn sections(sensors: Option<&Item>) -> Vec<TomlTable> {
    match sensors {
        Some(Item::Table(table)) => vec![table.clone()],
        Some(Item::ArrayOfTables(tables)) => tables.iter().cloned().collect(),
        _ => Vec::new(),
    }
}

/// Returns the rig's section of this kind without positions, or a new one.
fn section(kind: SensorKind, own: &[TomlTable], channel: &ChannelModel) -> TomlTable {
    let measures = |table: &&TomlTable| table.get("measure").and_then(Item::as_str) == Some(kind.name());
    let mut section = own.iter().find(measures).cloned().unwrap_or_default();
    PLACES.iter().for_each(|key| drop(section.remove(key)));
    if section.get("measure").is_none() {
        section.decor_mut().set_prefix("\n");
        section.insert("measure", value(kind.name()));
    }
    for (key, si) in [("noise", channel.noise_sd), ("resolution", channel.resolution)] {
        let written = section.get(key).and_then(Item::as_str);
        let same = written.and_then(|text| Quantity::parse_as(text, kind.dimension()).ok()) == Some(si);
        if !same && (si > 0.0 || written.is_some()) {
            section.insert(key, value(Quantity { value: si, dimension: kind.dimension() }.to_string()));
        }
    }
    section
}

fn positions(sensors: &[&Sensor], extent: Extent) -> Array {
    let written = |sensor: &&Sensor| {
        // The position of a reaction sensor must equal that of its support exactly; a micrometre is
        // enough for the others.
        let in_mm = match sensor.kind {
            SensorKind::Reaction => |at_m| at_m * 1e3,
            _ => to_micrometre,
        };
        toml_position(sensor.position, extent, in_mm)
    };
    sensors.iter().map(written).collect()
}

#[cfg(test)]
mod tests;
