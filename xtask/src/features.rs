//! The features that the checks turn on.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// Features with dependencies that take minutes to compile: `cargo xtask wire` checks them, `cargo xtask test` leaves them out.
const SLOW: [&str; 2] = ["foxglove", "ros"];

/// Every crate with the features that are off by default but the slow ones, as arguments of cargo.
pub fn all_but_slow(root: &Path) -> Result<[String; 3]> {
    arguments(&metadata(root)?, |feature| !SLOW.contains(&feature))
}

/// Every crate with all features, as arguments of cargo.
pub fn all(root: &Path) -> Result<[String; 3]> {
    arguments(&metadata(root)?, |_| true)
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
