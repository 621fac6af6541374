//! Studies that are built in beside the paper's: run whole, reported, and told as a table.

use super::Arguments;
use crate::failure::Failure;
use crate::output;
use crate::progress::Observer;
use palpate_numerics::watch::Watch;
use palpate_report::ReportFile;
use std::path::Path;

/// What sets one such study apart from another.
pub trait BuiltIn {
    /// The name under which `palpate study` knows it.
    const NAME: &'static str;
    type Findings: serde::Serialize;
    type Error: std::error::Error + 'static;

    /// Calibrations, and the seed of the first.
    fn seeds(&self) -> (u64, u64);

    /// The most often that [`BuiltIn::run`] asks whether to go on.
    fn most_rounds(&self) -> u64;

    /// What it finds.
    fn run(&self, watch: Watch) -> Result<Self::Findings, Self::Error>;

    fn report(&self, findings: &Self::Findings) -> Vec<ReportFile>;

    /// The findings for people.
    fn tell(findings: &Self::Findings) -> String;
}

/// Everything that `results.json` holds.
#[derive(serde::Serialize)]
struct ResultsFile<F> {
    palpate: &'static str,
    study: &'static str,
    calibrations: u64,
    seed: u64,
    #[serde(flatten)]
    findings: F,
}

/// Runs a study, writes its report and results, and prints them.
pub fn run<S: BuiltIn>(study: &S, arguments: &Arguments) -> Result<(), Failure> {
    let observer = Observer::of_rounds(study.most_rounds());
    let observe = |progress| observer.observe(progress);
    let findings = study.run(Watch::new(&observe)).map_err(|error| Failure::of(&error))?;
    drop(observer);
    let out = arguments.out.clone().unwrap_or_else(|| Path::new("palpate-out").join(S::NAME));
    output::write_report(&out, study.report(&findings))?;
    let (calibrations, seed) = study.seeds();
    let palpate = env!("CARGO_PKG_VERSION");
    let file = ResultsFile { palpate, study: S::NAME, calibrations, seed, findings };
    output::write_file(&out.join("results.json"), (output::to_json(&file)? + "\n").as_bytes())?;
    if arguments.json {
        return output::say_json(&file);
    }
    output::say(S::tell(&file.findings))?;
    output::say(format!("\nReport: {}", out.join("report.html").display()))
}
