//! `palpate study dead-areas`: errors between sensors, by estimator and by the number of sensors.

use super::Arguments;
use crate::failure::{Complaint, Failure};
use crate::progress::FitWatch;
use crate::table::table;
use crate::{input, output};
use palpate::report::dead_areas_report;
use palpate::study::dead_areas::{COUNTS, DeadAreaFindings, DeadAreas, RIG_TOML};
use std::path::{Path, PathBuf};

/// Calibrations at each count, unless `--seeds` says another number.
const CALIBRATIONS: u64 = 3;
const TOLERANCE_M: f64 = 2e-3;

/// The name under which `palpate study` knows it.
pub const NAME: &str = "dead-areas";

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let study = DeadAreas {
        rig: input::parse_rig(Path::new("examples/dead-areas.toml"), RIG_TOML)?,
        counts: COUNTS.to_vec(),
        calibrations: arguments.seeds.unwrap_or(CALIBRATIONS),
        tolerance_m: TOLERANCE_M,
        without: Vec::new(),
        seed: 0,
    };
    let mut watch = FitWatch::new(study.most_rounds());
    let findings = study.run(&mut || watch.keep_going()).map_err(Complaint::new)?;
    drop(watch);
    let stopped = || Failure::Interrupted("stopped; nothing was written".to_owned());
    let findings = findings.ok_or_else(stopped)?;
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from("palpate-out").join(NAME));
    output::write_report(&out, dead_areas_report(&study, &findings))?;
    output::write_file(&out.join("results.json"), (output::to_json(&findings)? + "\n").as_bytes())?;
    if arguments.json {
        return output::say_json(&findings);
    }
    print(&findings, &out)
}

fn print(findings: &DeadAreaFindings, out: &Path) -> Result<(), Failure> {
    let heading = [
        "sensing",
        "estimator",
        "sensors",
        "effective, %",
        "over sensors, mm",
        "between, mm",
        "dead between, %",
    ];
    let rows = findings.rows.iter().map(|row| {
        vec![
            row.sensing.clone(),
            row.estimator.to_owned(),
            row.sensors.to_string(),
            format!("{:.1}", row.effective_percent),
            format!("{:.3}", row.folded.at_sensors_m * 1e3),
            format!("{:.3}", row.folded.between_m * 1e3),
            format!("{:.1}", row.folded.dead_percent),
        ]
    });
    output::say(table(&heading, rows))?;
    for (sensing, estimator, sensors, why) in &findings.left_out {
        output::say(format!("{sensing}, {estimator}, {sensors} sensors: left out: {why}"))?;
    }
    output::say(format!("\nReport: {}", out.join("report.html").display()))
}
