//! Build of the dashboard, and tests in Node and in a browser.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;
use std::thread::{self, JoinHandle};
use std::time::SystemTime;

use anyhow::{Context, Result};

use crate::counts::Counts;
use crate::needs::NODE;
use crate::run;
use crate::skipped::{self, STRICT, SkipLog, Skips};

/// Largest uncompressed size of scripts and styles.
const MOST_BYTES: u64 = 150_000;

/// In the crate that compiles the dashboard, so that the published archive contains it.
const BUILT: &str = "crates/palpate-live/dashboard";

pub fn build(root: &Path) -> Result<bool> {
    if !NODE.is_there(root) {
        println!("{}", NODE.describe());
        return Ok(false);
    }
    if !(install(root)? && run::run_shown(&mut npm(root, &["run", "--silent", "build"]))?) {
        return Ok(false);
    }
    // Cargo does not see files that did not exist when it compiled the file that includes them.
    let holder = root.join("crates/palpate-live/src/server/page.rs");
    let touched = fs::File::options().append(true).open(&holder);
    touched
        .and_then(|file| file.set_modified(SystemTime::now()))
        .with_context(|| format!("cannot touch {}", holder.display()))?;
    let bytes = size(&root.join(BUILT).join("assets"))?;
    println!("{BUILT}: {bytes} bytes of scripts and styles; at most {MOST_BYTES}");
    Ok(bytes <= MOST_BYTES)
}

pub type Building = JoinHandle<Result<bool>>;

pub fn begin_build(root: &Path) -> Option<Building> {
    let root = root.to_path_buf();
    NODE.is_there(&root).then(|| thread::spawn(move || build(&root)))
}

pub fn wait(building: Option<Building>) -> Result<bool> {
    building.map_or(Ok(true), run::joined)
}

/// Tests the dashboard in Node and in a browser, in real time: other work delays pages.
pub fn test(root: &Path, skips: Skips, skipped: &SkipLog) -> Result<(bool, Option<Counts>)> {
    if !NODE.is_there(root) {
        println!("{}", NODE.describe());
        return Ok((skips == Skips::Pass, None));
    }
    let before = skipped.lines()?.len();
    let (mut succeeded, mut counts) = (true, None);
    for script in ["test", "browser-test"] {
        let mut tests = npm(root, &["run", "--silent", script]);
        tests.env("NO_COLOR", "1").env(skipped::VARIABLE, &skipped.file);
        tests.env(
            "PALPATE_BINARY",
            root.join("target/debug").join(format!("palpate{}", std::env::consts::EXE_SUFFIX)),
        );
        match skips {
            Skips::Fail => tests.env(STRICT, "1"),
            Skips::Pass => tests.env_remove(STRICT),
        };
        let watched = run::run_captured(&mut tests)?;
        succeeded &= watched.succeeded;
        counts =
            [counts, Counts::of_vitest(&watched.lines)].into_iter().flatten().reduce(|sum, more| sum + more);
    }
    let skips = skipped.lines()?.len() - before;
    Ok((succeeded, counts.map(|counts: Counts| counts.with_skips(skips))))
}

fn install(root: &Path) -> Result<bool> {
    let lock = root.join("web/package-lock.json");
    let wanted = fs::read_to_string(&lock).with_context(|| format!("cannot read {}", lock.display()))?;
    let stamp = root.join("web/node_modules/.installed-package-lock.json");
    if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(true);
    }
    println!("installing the dashboard's packages");
    if !run::run_shown(&mut npm(root, &["ci", "--no-audit", "--no-fund"]))? {
        return Ok(false);
    }
    fs::write(&stamp, wanted).with_context(|| format!("cannot write {}", stamp.display()))?;
    Ok(true)
}

fn npm(root: &Path, arguments: &[&str]) -> Command {
    let mut npm = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
    npm.args(arguments).current_dir(root.join("web"));
    npm
}

fn size(folder: &Path) -> Result<u64> {
    let files = match fs::read_dir(folder) {
        Ok(files) => files,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(0),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", folder.display())),
    };
    let mut bytes = 0;
    for file in files {
        bytes += file.and_then(|file| file.metadata()).context("cannot read the dashboard's files")?.len();
    }
    Ok(bytes)
}
