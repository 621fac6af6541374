//! The tests that found a prerequisite missing. A test runner counts them as passed and hides what they print, so each
//! adds a line to a file that the environment names, and this reads it.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Names the file to which a test that skips adds a line.
pub const VARIABLE: &str = "PALPATE_SKIPPED";

/// Tells a test that it must fail where it would skip.
pub const STRICT: &str = "PALPATE_STRICT";

/// Verdict on a test that is skipped for want of a prerequisite.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Skips {
    /// The test is named and counted.
    Pass,
    /// The test fails.
    Fail,
}

/// The file of one run.
#[derive(Clone)]
pub struct Skipped {
    /// The path.
    pub file: PathBuf,
}

impl Skipped {
    /// Empties the file of the run before.
    pub fn begin(root: &Path) -> Result<Self> {
        let file = root.join("target/xtask/skipped.txt");
        fs::create_dir_all(root.join("target/xtask")).context("cannot make the folder target/xtask")?;
        fs::write(&file, "").with_context(|| format!("cannot empty {}", file.display()))?;
        Ok(Self { file })
    }

    /// Adds the line of a step that is skipped.
    pub fn add(&self, line: &str) -> Result<()> {
        let file = fs::File::options().append(true).open(&self.file);
        file.and_then(|mut file| writeln!(file, "{line}"))
            .with_context(|| format!("cannot write {}", self.file.display()))
    }

    /// Lines that the tests wrote, one each, in order of name.
    pub fn lines(&self) -> Result<Vec<String>> {
        let text = match fs::read_to_string(&self.file) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", self.file.display())),
        };
        let mut lines: Vec<String> =
            text.lines().filter(|line| !line.is_empty()).map(str::to_owned).collect();
        lines.sort();
        Ok(lines)
    }
}
