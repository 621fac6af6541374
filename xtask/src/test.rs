//! `cargo xtask test`: every check, also after a failure.

use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::counts::Counts;
use crate::dashboard;
use crate::features;
use crate::needs::{self, Fallback, NEXTEST};
use crate::python;
use crate::run;
use crate::site;
use crate::skipped::{self, STRICT, SkipLog, Skips};
use crate::tidy;

/// The build and the Python tests share these targets, so that cargo compiles once.
const TARGETS: [&str; 3] = ["--lib", "--tests", "--bin=palpate"];

/// xtask shares `syn` with procedural macros. Beside it cargo compiles them, and all that depends on them, with other flags than clippy and the doc tests do.
const WITHOUT_XTASK: [&str; 2] = ["--exclude", "xtask"];

struct Step {
    name: &'static str,
    succeeded: bool,
    took: Duration,
    counts: Option<Counts>,
}

pub fn run(root: &Path, skips: Skips) -> Result<bool> {
    let skipped = SkipLog::begin(root)?;
    let mut missing = Vec::new();
    let [workspace, with, features] = features::all_but_slow(root)?;
    let everything = [workspace.as_str(), &with, &features];
    let product = [&everything[..], &WITHOUT_XTASK].concat();
    let tested = [&product[..], &TARGETS].concat();
    let prerequisites = step("prerequisites", || prerequisites(root, skips, &mut missing))?;
    // Built while the compiler does not use all cores; the server contains the dashboard.
    let environment = python::make_environment(root);
    let site = site::make_environment(root);
    let dashboard = dashboard::begin_build(root);
    let mut steps = vec![
        prerequisites,
        step("formatting", || run_cargo(root, &["fmt", "--all", "--check"]))?,
        step("fuzz lock", || {
            run_cargo(root, &["fetch", "--quiet", "--locked", "--manifest-path", "fuzz/Cargo.toml"])
        })?,
        step("clippy", || {
            run_cargo(
                root,
                &[&["clippy", "--all-targets"], &everything[..], &["--", "-D", "warnings"]].concat(),
            )
        })?,
        step("build", || {
            let has_dashboard = dashboard::wait(dashboard)?;
            let (succeeded, counts) = run_cargo(root, &[&["build"], &tested[..]].concat())?;
            Ok((has_dashboard && succeeded, counts))
        })?,
        step("tests", || tests(root, skips, &skipped, &product))?,
        step("xtask tests", || tests(root, skips, &skipped, &["--package", "xtask"]))?,
    ];
    steps.extend([
        step("doc tests", || run_watched(cargo(root, &[&["test", "--doc"], &product[..]].concat())))?,
        step("docs", || {
            let mut docs = cargo(root, &[&["doc", "--no-deps"], &everything[..]].concat());
            Ok((run::run_shown(docs.env("RUSTDOCFLAGS", "-D warnings"))?, None))
        })?,
        step("site", || Ok((site::test(root, skips, &skipped, site)?, None)))?,
        step("Python tests", || python::test(root, skips, environment, &tested))?,
        step("dashboard", || dashboard::test(root, skips, &skipped))?,
        step("tidy", || Ok((tidy::run(root)?, None)))?,
    ]);
    let lines = skipped.lines()?;
    print!("\n{}", closing(&steps, &missing, &lines));
    Ok(steps.iter().all(|step| step.succeeded))
}

type Outcome = Result<(bool, Option<Counts>)>;

fn step(name: &'static str, act: impl FnOnce() -> Outcome) -> Result<Step> {
    println!("\n=== {name}");
    let start = Instant::now();
    let (succeeded, counts) = act()?;
    Ok(Step { name, succeeded, took: start.elapsed(), counts })
}

fn prerequisites(root: &Path, skips: Skips, missing: &mut Vec<String>) -> Outcome {
    let mut succeeded = true;
    for need in needs::missing(root)? {
        println!("{}", need.describe());
        missing.push(need.describe());
        succeeded &= skips == Skips::Pass || matches!(need.without, Fallback::FallsBack(_));
    }
    if missing.is_empty() {
        println!("all there");
    }
    Ok((succeeded, None))
}

fn tests(root: &Path, skips: Skips, skipped: &SkipLog, packages: &[&str]) -> Outcome {
    let mut command = if NEXTEST.is_there(root) {
        // Two more than there are cores: many tests wait for a board or a server.
        let threads =
            format!("--test-threads={}", thread::available_parallelism().map_or(2, |cores| cores.get() + 2));
        cargo(root, &[&["nextest", "run", "--no-fail-fast", &threads], packages].concat())
    } else {
        cargo(root, &[&["test", "--lib", "--bins", "--tests", "--no-fail-fast"], packages].concat())
    };
    command.env(skipped::VARIABLE, &skipped.file);
    match skips {
        Skips::Fail => command.env(STRICT, "1"),
        Skips::Pass => command.env_remove(STRICT),
    };
    let before = skipped.lines()?.len();
    let (succeeded, counts) = run_watched(command)?;
    let skips = skipped.lines()?.len() - before;
    Ok((succeeded, counts.map(|counts| counts.with_skips(skips))))
}

fn cargo(root: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments).current_dir(root);
    command
}

fn run_cargo(root: &Path, arguments: &[&str]) -> Outcome {
    Ok((run::run_shown(&mut cargo(root, arguments))?, None))
}

fn run_watched(mut command: Command) -> Outcome {
    let watched = run::run_captured(&mut command)?;
    Ok((watched.succeeded, Counts::read(&watched.lines)))
}

fn closing(steps: &[Step], missing: &[String], skipped: &[String]) -> String {
    let mut text = format!("{:<14} {:<6} {:>8}\n", "step", "result", "seconds");
    for step in steps {
        let result = if step.succeeded { "ok" } else { "FAILED" };
        text += &format!("{:<14} {result:<6} {:>8.1}\n", step.name, step.took.as_secs_f64());
    }
    for line in missing.iter().chain(skipped) {
        text += &format!("{line}\n");
    }
    let failed: Vec<_> = steps.iter().filter(|step| !step.succeeded).map(|step| step.name).collect();
    if !failed.is_empty() {
        text += &format!("failed: {}\n", failed.join(", "));
    }
    if let Some(counts) = steps.iter().filter_map(|step| step.counts).reduce(|sum, counts| sum + counts) {
        text += &format!("{counts}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(name: &'static str, succeeded: bool, counts: Option<Counts>) -> Step {
        Step { name, succeeded, took: Duration::from_millis(1500), counts }
    }

    #[test]
    fn the_closing_names_failed_steps_and_ends_with_the_counts_of_all_tests() {
        let steps = [
            done("formatting", false, None),
            done("tests", true, Some(Counts { passed: 3, failed: 0, skipped: 1 })),
            done("doc tests", true, Some(Counts { passed: 2, failed: 0, skipped: 0 })),
        ];
        let text = closing(&steps, &["Chromium is missing".into()], &["skipped: a test: no Chromium".into()]);
        let expected = "\
step           result  seconds
formatting     FAILED      1.5
tests          ok          1.5
doc tests      ok          1.5
Chromium is missing
skipped: a test: no Chromium
failed: formatting
5 passed, 0 failed, 1 skipped
";
        assert_eq!(text, expected);
    }

    #[test]
    fn without_counts_there_is_no_line_of_counts() {
        assert!(closing(&[done("tests", false, None)], &[], &[]).ends_with("failed: tests\n"));
    }
}
