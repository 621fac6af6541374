//! Features of the checks, and a check of all combinations.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::run;

/// Features that take minutes to compile: only `cargo xtask wire` checks them.
const SLOW: [&str; 2] = ["foxglove", "ros"];

pub fn all_but_slow(root: &Path) -> Result<[String; 3]> {
    arguments(&metadata(root)?, |feature| !SLOW.contains(&feature))
}

pub fn all(root: &Path) -> Result<[String; 3]> {
    arguments(&metadata(root)?, |_| true)
}

pub fn check(root: &Path) -> Result<bool> {
    let combinations = combinations(&metadata(root)?)?;
    let mut failed = Vec::new();
    for (number, arguments) in combinations.iter().enumerate() {
        let words = arguments.join(" ");
        println!("\n=== {} of {}: cargo check {words}", number + 1, combinations.len());
        let mut cargo = Command::new("cargo");
        if !run::run_shown(cargo.args(["check", "--quiet"]).args(arguments).current_dir(root))? {
            failed.push(words);
        }
    }
    println!("\n{} combinations, {} failed", combinations.len(), failed.len());
    failed.iter().for_each(|words| println!("failed: cargo check {words}"));
    Ok(failed.is_empty())
}

fn combinations(metadata: &Value) -> Result<Vec<Vec<String>>> {
    let packages = metadata["packages"].as_array().context("`cargo metadata` lists no packages")?;
    let mut combinations = Vec::new();
    // `publish` lists the allowed registries; null means any, an empty list none.
    for package in packages.iter().filter(|package| package["publish"].is_null()) {
        let name = package["name"].as_str().context("`cargo metadata` has a package without a name")?;
        let features = package["features"].as_object().into_iter().flat_map(|features| features.keys());
        let features: Vec<&String> = features.filter(|feature| *feature != "default").collect();
        let mut add = |more: &[&str]| {
            let arguments = ["--package", name, "--no-default-features"].into_iter();
            combinations.push(arguments.chain(more.iter().copied()).map(str::to_owned).collect());
        };
        add(&[]);
        features.iter().for_each(|feature| add(&["--features", feature]));
        if features.len() > 1 {
            add(&["--all-features"]);
        }
    }
    Ok(combinations)
}

fn metadata(root: &Path) -> Result<Value> {
    let arguments = ["metadata", "--format-version", "1", "--no-deps"];
    let output = Command::new("cargo").args(arguments).current_dir(root).output();
    let output = output.context("cannot start cargo: is it on PATH?")?;
    if !output.status.success() {
        bail!("cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    serde_json::from_slice(&output.stdout).context("cannot read what `cargo metadata` printed")
}

fn arguments(metadata: &Value, is_on: impl Fn(&str) -> bool) -> Result<[String; 3]> {
    let packages = metadata["packages"].as_array().context("`cargo metadata` lists no packages")?;
    let of = |package: &Value| {
        let name = package["name"].as_str().unwrap_or_default().to_owned();
        let features: Vec<String> = package["features"]
            .as_object()
            .into_iter()
            .flat_map(|features| features.keys().cloned())
            .collect();
        features.into_iter().map(move |feature| (name.clone(), feature))
    };
    let features: Vec<String> = packages
        .iter()
        .flat_map(of)
        .filter(|(_, feature)| is_on(feature))
        .map(|(package, feature)| format!("{package}/{feature}"))
        .collect();
    Ok(["--workspace".to_owned(), "--features".to_owned(), features.join(",")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_crates_are_checked_in_every_combination() {
        let metadata = serde_json::json!({"packages": [
            {"name": "a", "publish": null, "features": {"default": ["x"], "x": [], "y": []}},
            {"name": "b", "publish": null, "features": {}},
            {"name": "c", "publish": [], "features": {"z": []}},
        ]});
        let combinations = combinations(&metadata).unwrap();
        let words: Vec<String> = combinations.iter().map(|arguments| arguments.join(" ")).collect();
        assert_eq!(
            words,
            [
                "--package a --no-default-features",
                "--package a --no-default-features --features x",
                "--package a --no-default-features --features y",
                "--package a --no-default-features --all-features",
                "--package b --no-default-features",
            ]
        );
    }

    #[test]
    fn slow_features_are_left_out_and_all_others_are_on() {
        let [_, _, most] = all_but_slow(&crate::root()).unwrap();
        let most: Vec<&str> = most.split(',').collect();
        assert!(most.contains(&"palpate-cli/png") && most.contains(&"palpate-core/serde"), "{most:?}");
        assert!(!most.iter().any(|feature| SLOW.iter().any(|slow| feature.ends_with(slow))), "{most:?}");
        let [_, _, all] = all(&crate::root()).unwrap();
        let slow: Vec<&str> = all.split(',').filter(|feature| !most.contains(feature)).collect();
        assert_eq!(
            slow,
            ["palpate-cli/foxglove", "palpate-cli/ros", "palpate-live/foxglove", "palpate-live/ros"]
        );
    }
}
