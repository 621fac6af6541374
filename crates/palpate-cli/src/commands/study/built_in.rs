//! Built-in studies besides the paper's.

use super::{Arguments, EarlierRun};
use crate::failure::{Failure, UserError};
use crate::input;
use crate::output::{self, Table};
use crate::progress::Observer;
use crate::target::{RESULTS_JSON, TargetFolder};
use palpate_estimators::evaluation::Quantiles;
use palpate_numerics::watch::Watch;
use palpate_report::{ReportFile, dead_areas_report, elliott_report};
use palpate_studies::dead_areas::{self, DeadAreaResults, DeadAreas};
use palpate_studies::elliott::{self, Elliott, ElliottResults};
use std::path::Path;

const CALIBRATIONS: u64 = 3;

/// Content of `results.json`.
#[derive(serde::Serialize)]
struct Results<F> {
    palpate: &'static str,
    study: &'static str,
    calibrations: u64,
    seed: u64,
    #[serde(flatten)]
    findings: F,
}

/// `palpate study dead-areas`: errors between sensors.
pub fn dead_areas(arguments: &Arguments) -> Result<(), Failure> {
    let study = DeadAreas {
        rig: input::parse_rig(Path::new("examples/dead-areas.toml"), dead_areas::RIG_TOML)?,
        counts: dead_areas::COUNTS.to_vec(),
        calibrations: arguments.seeds.unwrap_or(CALIBRATIONS),
        tolerance_m: 2e-3,
        excluded: Vec::new(),
        seed: 0,
    };
    let out = folder(arguments, "dead-areas")?;
    let results = |findings| results("dead-areas", study.calibrations, study.seed, findings);
    let results = results(fit(study.most_rounds(), |watch| study.run(watch))?);
    write((arguments, &out), &results, dead_areas_report(&study, &results.findings), dead_areas_text)
}

/// `palpate study elliott`: components of a plate's readings and a network, compared with influence
/// locators.
pub fn elliott(arguments: &Arguments) -> Result<(), Failure> {
    let study = Elliott {
        rig: input::parse_rig(Path::new("examples/elliott.toml"), elliott::RIG_TOML)?,
        components: elliott::COMPONENTS.to_vec(),
        presentations: elliott::PRESENTATIONS,
        calibrations: arguments.seeds.unwrap_or(CALIBRATIONS),
        tolerance_m: 5e-3,
        seed: 0,
    };
    let out = folder(arguments, "elliott")?;
    let results = |findings| results("elliott", study.calibrations, study.seed, findings);
    let results = results(fit(study.most_rounds(), |watch| study.run(watch))?);
    write((arguments, &out), &results, elliott_report(&study, &results.findings), elliott_text)
}

fn folder(arguments: &Arguments, study: &str) -> Result<TargetFolder, Failure> {
    let in_shards = [(arguments.shard.is_some(), "--shard"), (!arguments.merge.is_empty(), "--merge")];
    if let Some((_, option)) = in_shards.into_iter().find(|(asked, _)| *asked) {
        let user_error = UserError::new(format!("{option}: the study `{study}` is not run in shards"));
        return Err(user_error.help("run it whole: it takes minutes").into());
    }
    if arguments.earlier_run() == EarlierRun::Resume {
        let user_error =
            UserError::new(format!("--resume: the study `{study}` keeps no networks to continue from"));
        return Err(user_error.help("--overwrite deletes an earlier run, --out names another folder").into());
    }
    arguments.folder(study)
}

fn results<F>(study: &'static str, calibrations: u64, seed: u64, findings: F) -> Results<F> {
    Results { palpate: env!("CARGO_PKG_VERSION"), study, calibrations, seed, findings }
}

/// Runs a study that reports progress at most `most_rounds` times.
fn fit<F, E>(most_rounds: u64, run: impl FnOnce(Watch) -> Result<F, E>) -> Result<F, Failure>
where
    E: std::error::Error + 'static,
{
    Observer::of_rounds(most_rounds).watch(run).map_err(|error| Failure::from_error(&error))
}

fn write<F: serde::Serialize>(
    (arguments, out): (&Arguments, &TargetFolder),
    results: &Results<F>,
    report: Vec<ReportFile>,
    tell: fn(&F) -> String,
) -> Result<(), Failure> {
    out.write_report(report)?;
    out.write(RESULTS_JSON, (output::to_json(results)? + "\n").as_bytes())?;
    if arguments.json {
        return output::print_json(results);
    }
    output::print_line(tell(&results.findings))?;
    output::print_report_path("\n", Some(out.path()))
}

fn dead_areas_text(findings: &DeadAreaResults) -> String {
    let mut told = Table::from_rows(&findings.rows)
        .column("sensing", |row| row.sensing.clone())
        .column("estimator", |row| row.estimator.to_owned())
        .column("sensors", |row| row.sensors.to_string())
        .column("effective, %", |row| format!("{:.1}", row.effective_percent))
        .column("over sensors, mm", |row| format!("{:.3}", row.folded.at_sensors_m * 1e3))
        .column("between, mm", |row| format!("{:.3}", row.folded.between_m * 1e3))
        .column("dead between, %", |row| format!("{:.1}", row.folded.dead_percent))
        .to_string();
    for (sensing, estimator, sensors, why) in &findings.omitted {
        told += &format!("\n{sensing}, {estimator}, {sensors} sensors: skipped: {why}");
    }
    told
}

fn elliott_text(findings: &ElliottResults) -> String {
    let mm = |spread: Quantiles| format!("{:.3}", spread.median * 1e3);
    Table::from_rows(&findings.rows)
        .column("chain", |row| row.chain.to_string())
        .column("error, mm", |row| row.error_m.map_or_else(String::new, mm))
        .column("limit, mm", |row| {
            row.limit_m.map_or_else(String::new, |limit_m| format!("{:.3}", limit_m * 1e3))
        })
        .column("effective area, %", |row| {
            row.effective_percent.map_or_else(String::new, |percent| format!("{:.1}", percent.median))
        })
        .column("moving, mm", |row| mm(row.moving_error_m))
        .to_string()
}
