//! `cargo xtask cli-reference`: docs/reference/commands.md from the help of every command.
//!
//! A test of the command makes the page, so that it has the binary of the same build, and compares it with the written one.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::run;

/// Writes the page.
pub fn run(root: &Path) -> Result<bool> {
    let mut test = Command::new("cargo");
    test.args(["test", "--quiet", "--package", "palpate-cli", "--test", "cli", "--", "the_page_of_commands"]);
    run::shown(test.env("PALPATE_WRITE_REFERENCE", "1").current_dir(root))
}
