//! `cargo xtask wire`: sinks with slow dependencies, ROS 2 through Zenoh and Foxglove's WebSocket.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::features;
use crate::needs::NEXTEST;
use crate::run;

pub fn run(root: &Path) -> Result<bool> {
    let [workspace, with, features] = features::all(root)?;
    let everything = [workspace.as_str(), &with, &features];
    let tests: &[&str] = if NEXTEST.is_there(root) {
        &["nextest", "run", "--no-fail-fast"]
    } else {
        &["test", "--no-fail-fast"]
    };
    let mut succeeded = true;
    for (arguments, flags) in [
        ([tests, &everything, &["--test=wire"]].concat(), None),
        ([tests, &everything, &["--test=cli", "wire::"]].concat(), None),
        ([&["clippy", "--all-targets"], &everything[..], &["--", "-D", "warnings"]].concat(), None),
        ([&["doc", "--no-deps"], &everything[..]].concat(), Some(("RUSTDOCFLAGS", "-D warnings"))),
    ] {
        println!("\n=== cargo {}", arguments.join(" "));
        let mut cargo = Command::new("cargo");
        succeeded &= run::run_shown(cargo.args(arguments).envs(flags).current_dir(root))?;
    }
    Ok(succeeded)
}
