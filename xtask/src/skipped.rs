//! Skipped tests. Test runners count them as passed and hide their output, so each adds a line to a
//! file.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Variable with the path of that file.
pub const VARIABLE: &str = "PALPATE_SKIPPED";

/// Variable for tests that must fail instead of being skipped.
pub const STRICT: &str = "PALPATE_STRICT";

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Skips {
    Pass,
    Fail,
}

#[derive(Clone)]
pub struct SkipLog {
    pub file: PathBuf,
}

impl SkipLog {
    /// Empties the file of the previous run.
    pub fn begin(root: &Path) -> Result<Self> {
        let file = root.join("target/xtask/skipped.txt");
        fs::create_dir_all(root.join("target/xtask")).context("cannot make the folder target/xtask")?;
        fs::write(&file, "").with_context(|| format!("cannot empty {}", file.display()))?;
        Ok(Self { file })
    }

    pub fn add(&self, line: &str) -> Result<()> {
        let file = fs::File::options().append(true).open(&self.file);
        file.and_then(|mut file| writeln!(file, "{line}"))
            .with_context(|| format!("cannot write {}", self.file.display()))
    }

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
