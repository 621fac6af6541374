//! Documentation site by MkDocs in target/site: docs/ and the docstrings of the Python package.

use std::path::Path;

use anyhow::Result;

use crate::needs::PYTHON;
use crate::python::{self, Environment, EnvironmentTask};
use crate::run;
use crate::skipped::{SkipLog, Skips};

const REQUIREMENTS: &str = "docs/requirements.txt";

pub fn make_environment(root: &Path) -> Option<EnvironmentTask> {
    python::begin_environment(root, "target/xtask/docs", REQUIREMENTS)
}

/// Fails without Python, or for a dead link or anchor, or a page outside the navigation.
pub fn build(root: &Path) -> Result<bool> {
    let Some(environment) = make_environment(root) else {
        println!("{}", PYTHON.describe());
        return Ok(false);
    };
    built(root, &run::joined(environment)?)
}

/// Skips without Python or its package index.
pub fn test(
    root: &Path,
    skips: Skips,
    skipped: &SkipLog,
    environment: Option<EnvironmentTask>,
) -> Result<bool> {
    let Some(environment) = environment else {
        println!("{}", PYTHON.describe());
        return Ok(skips == Skips::Pass);
    };
    match run::joined(environment) {
        Ok(environment) => built(root, &environment),
        Err(error) if skips == Skips::Pass => {
            skipped.add(&format!("skipped: the documentation site: {error:#}"))?;
            Ok(true)
        }
        Err(error) => Err(error),
    }
}

fn built(root: &Path, environment: &Environment) -> Result<bool> {
    let mut mkdocs = environment.run("mkdocs");
    // The theme advertises its successor, which ARCHITECTURE.md discusses.
    mkdocs.args(["build", "--strict", "--quiet"]).env("NO_MKDOCS_2_WARNING", "1").current_dir(root);
    let succeeded = run::run_shown(&mut mkdocs)?;
    if succeeded {
        println!("{}", root.join("target/site/index.html").display());
    }
    Ok(succeeded)
}
