//! `cargo xtask fuzz`: libFuzzer on stable Rust.
//!
//! Sanitizers are unstable flags, so `RUSTC_BOOTSTRAP=1` enables them. An explicit `--target`
//! excludes build scripts and procedural macros, which must not be instrumented.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::run;

/// Flags of `cargo fuzz`.
const FLAGS: [&str; 9] = [
    "-Zsanitizer=address",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Cdebug-assertions",
    "-Ccodegen-units=1",
    "--cfg=fuzzing",
];

pub fn list(root: &Path) -> Result<bool> {
    println!("fuzz targets, for `cargo xtask fuzz TARGET --seconds N`:");
    targets(root)?.iter().for_each(|target| println!("  {target}"));
    Ok(true)
}

/// Returns true without a finding; `fuzz/artifacts` keeps the crashing inputs.
pub fn run(root: &Path, target: &str, seconds: u32) -> Result<bool> {
    let known = targets(root)?;
    if !known.iter().any(|name| name == target) {
        bail!("no fuzz target {target:?}: fuzz/fuzz_targets has {}", known.join(", "));
    }
    let host = host()?;
    if !built(root, target, &host)? {
        bail!("fuzz target {target} does not build (libFuzzer also needs a C++ compiler: Debian's g++)");
    }
    let fuzz = root.join("fuzz");
    let (corpus, artifacts) = (fuzz.join("corpus").join(target), fuzz.join("artifacts").join(target));
    for folder in [&corpus, &artifacts] {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    run::run_shown(
        Command::new(fuzz.join("target").join(&host).join("release").join(target))
            .arg(format!("-max_total_time={seconds}"))
            .arg(format!("-artifact_prefix={}/", artifacts.display()))
            .arg(corpus)
            .current_dir(&fuzz),
    )
}

fn built(root: &Path, target: &str, host: &str) -> Result<bool> {
    let mut command = Command::new("cargo");
    command.args(["build", "--release", "--locked", "--manifest-path", "fuzz/Cargo.toml", "--bin", target]);
    command.args(["--target", host, "--target-dir", "fuzz/target"]);
    command.env("RUSTC_BOOTSTRAP", "1").env("CARGO_ENCODED_RUSTFLAGS", FLAGS.join("\u{1f}"));
    run::run_shown(command.current_dir(root))
}

fn targets(root: &Path) -> Result<Vec<String>> {
    let folder = root.join("fuzz/fuzz_targets");
    let mut names = Vec::new();
    for entry in fs::read_dir(&folder).with_context(|| format!("cannot list {}", folder.display()))? {
        let path = entry.with_context(|| format!("cannot list {}", folder.display()))?.path();
        if let (Some(name), Some("rs")) = (path.file_stem(), path.extension().and_then(|end| end.to_str())) {
            names.push(name.to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

fn host() -> Result<String> {
    let output = Command::new("rustc").arg("-vV").output().context("cannot start rustc: is it on PATH?")?;
    let text = String::from_utf8_lossy(&output.stdout);
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).context("`rustc -vV` names no host")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::root;

    #[test]
    fn every_target_file_is_a_binary_of_the_manifest() {
        let manifest = fs::read_to_string(root().join("fuzz/Cargo.toml")).unwrap();
        let targets = targets(&root()).unwrap();
        assert!(!targets.is_empty());
        for target in targets {
            assert!(manifest.contains(&format!("path = \"fuzz_targets/{target}.rs\"")), "{target}");
        }
    }

    #[test]
    fn an_unknown_target_is_an_error_that_lists_the_known_ones() {
        let error = run(&root(), "no-such-target", 1).unwrap_err().to_string();
        assert!(error.contains("no-such-target") && error.contains("fuzz/fuzz_targets has"), "{error}");
    }
}
