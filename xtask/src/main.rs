//! Tasks of the project: `cargo xtask test | validate | features | wire | web | wheel | docs |
//! cli-reference | rig-keys | man | tidy | bench | fuzz`.
#![forbid(unsafe_code)]

mod bench;
mod cli_reference;
mod counts;
mod dashboard;
mod features;
mod fuzz;
mod needs;
mod python;
mod rig_keys;
mod run;
mod rust;
mod site;
mod skipped;
mod test;
mod tidy;
mod wire;

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::{Parser, Subcommand};

/// The project's chores.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Run every check: formatting, clippy, tests, doc tests, docs, Python tests, dashboard, tidy
    Test {
        /// A test that is skipped for want of a prerequisite fails
        #[arg(long)]
        strict: bool,
    },
    /// Run experiments of palpate-validation, and write their tables to docs/validation
    #[command(disable_help_flag = true)]
    Validate {
        /// Handed on: [NAME…] [--quick] [--check] [--list] [--help]
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Check every published crate without features, with each feature alone and with all
    Features,
    /// Build the sinks for ROS 2 and Foxglove, which take minutes to compile, and run their tests, clippy and docs
    Wire,
    /// Build the dashboard of `palpate serve` into crates/palpate-live/dashboard, from which compiling takes it; needs Node
    Web,
    /// Build the wheel of the Python package, and run its tests on it with the oldest and the newest of what it supports
    Wheel,
    /// Build the documentation site into target/site; dead links and anchors are errors
    Docs,
    /// Write docs/reference/commands.md from the help of every command
    CliReference,
    /// Write docs/reference/rig-keys.md from the types that rig and study files are read into
    RigKeys,
    /// Write the manual pages of the command into target/man
    Man,
    /// Check the rules that a program can check: dependencies, import circles, links
    Tidy,
    /// Run the benchmarks of the whole workspace, or some of them; save their figures, and compare them with saved ones
    Bench(bench::Arguments),
    /// Fuzz one target, or list the targets when none is named
    Fuzz {
        /// A file of fuzz/fuzz_targets, without .rs
        target: Option<String>,
        /// Stop after this many seconds
        #[arg(long, value_name = "N", default_value_t = 60)]
        seconds: u32,
    },
}

fn main() -> ExitCode {
    let root = root();
    let done = match Arguments::parse().chore {
        Chore::Test { strict } => {
            test::run(&root, if strict { skipped::Skips::Fail } else { skipped::Skips::Pass })
        }
        Chore::Validate { arguments } => {
            let mut experiment = Command::new("cargo");
            experiment.args(["run", "--quiet", "--package", "palpate-validation", "--"]).args(arguments);
            run::run_shown(&mut experiment)
        }
        Chore::Features => features::check(&root),
        Chore::Wire => wire::run(&root),
        Chore::Web => dashboard::build(&root),
        Chore::Wheel => python::wheel(&root),
        Chore::Docs => site::build(&root),
        Chore::CliReference => cli_reference::run(&root),
        Chore::RigKeys => rig_keys::run(&root),
        Chore::Man => {
            let mut man = Command::new("cargo");
            man.args(["run", "--quiet", "--package", "palpate-cli", "--", "man", "--out", "target/man"]);
            run::run_shown(man.current_dir(&root))
        }
        Chore::Tidy => tidy::run(&root),
        Chore::Bench(arguments) => bench::run(&root, &arguments),
        Chore::Fuzz { target: None, .. } => fuzz::list(&root),
        Chore::Fuzz { target: Some(target), seconds } => fuzz::run(&root, &target, seconds),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Folder of the workspace, from Cargo's environment, or else from the build.
fn root() -> PathBuf {
    let own =
        env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    own.parent().map_or_else(|| own.clone(), Path::to_path_buf)
}
