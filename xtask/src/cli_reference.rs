//! `cargo xtask cli-reference`: docs/reference/commands.md from the help of every command.
//!
//! A test of the command writes the page, so that it matches the binary of this build.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::run;

pub fn run(root: &Path) -> Result<bool> {
    let mut test = Command::new("cargo");
    test.args(["test", "--quiet", "--package", "palpate-cli", "--test", "cli", "--", "the_page_of_commands"]);
    run::run_shown(test.env("PALPATE_WRITE_REFERENCE", "1").current_dir(root))
}
