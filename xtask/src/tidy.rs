//! `cargo xtask tidy`: rules of the project that a program can check.
//!
//! Each rule is a function from the project to findings, and does not read the disk.

mod binary;
mod changelog;
mod circles;
mod copies;
mod crates;
mod links;
mod places;
mod project;
mod samples;
mod unfinished;

use std::path::Path;

use anyhow::Result;

use project::Project;

#[derive(Debug, PartialEq, Eq)]
struct Finding {
    path: String,
    /// From 1.
    line: usize,
    message: String,
}

impl Finding {
    fn new(path: &str, line: usize, message: impl Into<String>) -> Self {
        Self { path: path.into(), line, message: message.into() }
    }
}

type Rule = fn(&Project) -> Vec<Finding>;

const RULES: [(&str, Rule); 9] = [
    ("crates depend one way", crates::findings),
    ("no import circle between sibling files", circles::findings),
    ("copies equal their originals", copies::findings),
    ("documents name what exists", links::findings),
    ("no machine's paths or hosts", places::findings),
    ("nothing unfinished", unfinished::findings),
    ("text files only", binary::findings),
    ("the changelog has the version", changelog::findings),
    ("samples are the examples", samples::findings),
];

pub fn run(root: &Path) -> Result<bool> {
    let project = Project::read(root)?;
    let mut failures = 0;
    for (name, rule) in RULES {
        for Finding { path, line, message } in rule(&project) {
            failures += 1;
            println!("{path}:{line}: error ({name}): {message}");
        }
    }
    println!("tidy: {} rules, {} files, {failures} broken", RULES.len(), project.files.len());
    Ok(failures == 0)
}
