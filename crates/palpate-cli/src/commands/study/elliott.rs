//! `palpate study elliott`: components of a plate's readings and a network, beside the influence locator and its tracker.

use super::Arguments;
use crate::failure::{Complaint, Failure};
use crate::progress::FitWatch;
use crate::table::table;
use crate::{input, output};
use palpate::evaluation::Spread;
use palpate::report::{chain_in_words, elliott_report};
use palpate::study::elliott::{COMPONENTS, Elliott, ElliottFindings, PRESENTATIONS, RIG_TOML};
use std::path::{Path, PathBuf};

/// Calibrations, unless `--seeds` says another number.
const CALIBRATIONS: u64 = 3;
const TOLERANCE_M: f64 = 5e-3;

/// The name under which `palpate study` knows it.
pub const NAME: &str = "elliott";

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let study = Elliott {
        rig: input::parse_rig(Path::new("examples/elliott.toml"), RIG_TOML)?,
        components: COMPONENTS.to_vec(),
        presentations: PRESENTATIONS,
        calibrations: arguments.seeds.unwrap_or(CALIBRATIONS),
        tolerance_m: TOLERANCE_M,
        seed: 0,
    };
    let mut watch = FitWatch::new(study.most_rounds());
    let findings = study.run(&mut || watch.keep_going()).map_err(Complaint::new)?;
    drop(watch);
    let stopped = || Failure::Interrupted("stopped; nothing was written".to_owned());
    let findings = findings.ok_or_else(stopped)?;
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from("palpate-out").join(NAME));
    output::write_report(&out, elliott_report(&study, &findings))?;
    output::write_file(&out.join("results.json"), (output::to_json(&findings)? + "\n").as_bytes())?;
    if arguments.json {
        return output::say_json(&findings);
    }
    print(&findings, &out)
}

fn print(findings: &ElliottFindings, out: &Path) -> Result<(), Failure> {
    let heading = ["chain", "error, mm", "limit, mm", "effective area, %", "moving, mm"];
    let rows = findings.rows.iter().map(|row| {
        let mm = |spread: Spread| format!("{:.3}", spread.median * 1e3);
        vec![
            chain_in_words(row.chain),
            row.error_m.map_or_else(String::new, mm),
            row.limit_m.map_or_else(String::new, |limit_m| format!("{:.3}", limit_m * 1e3)),
            row.effective_percent.map_or_else(String::new, |percent| format!("{:.1}", percent.median)),
            mm(row.moving_error_m),
        ]
    });
    output::say(table(&heading, rows))?;
    output::say(format!("\nReport: {}", out.join("report.html").display()))
}
