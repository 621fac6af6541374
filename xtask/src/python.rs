//! Tests of the Python package in separate environments, and its wheel.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::{self, JoinHandle};

use anyhow::{Context, Result, bail};

use crate::counts::Counts;
use crate::needs::PYTHON;
use crate::run;
use crate::skipped::{STRICT, Skips};

/// Requirements without versions.
const REQUIREMENTS: &str = "python/tests/requirements.txt";
const OLDEST: &str = "python/tests/oldest.txt";
const MOST_BYTES: u64 = 6_000_000;
/// C library of Debian 10, Ubuntu 18.10 and later.
const MANYLINUX: &str = "manylinux_2_28";

pub type EnvironmentTask = JoinHandle<Result<Environment>>;

pub fn make_environment(root: &Path) -> Option<EnvironmentTask> {
    begin_environment(root, "target/xtask/python", REQUIREMENTS)
}

/// Returns `None` without Python.
pub fn begin_environment(
    root: &Path,
    folder: &'static str,
    requirements: &'static str,
) -> Option<EnvironmentTask> {
    let root = root.to_path_buf();
    PYTHON
        .is_there(&root)
        .then(|| thread::spawn(move || Environment::at(&root, folder, "python3", &[requirements])))
}

/// `tested` are the arguments of cargo's build.
pub fn test(
    root: &Path,
    skips: Skips,
    environment: Option<EnvironmentTask>,
    tested: &[&str],
) -> Result<(bool, Option<Counts>)> {
    let Some(environment) = environment else {
        println!("{}", PYTHON.describe());
        return Ok((skips == Skips::Pass, None));
    };
    let mut build = Command::new("cargo");
    build.args(["build", "--quiet"]).args(tested).current_dir(root);
    if !run::run_shown(&mut build)? {
        return Ok((false, None));
    }
    let built = root.join("target/debug").join(format!("{DLL_PREFIX}_palpate{DLL_SUFFIX}"));
    let module = root.join("python/palpate/_palpate.abi3.so");
    // Python processes may have loaded the module: it is replaced, not overwritten.
    let copied = module.with_extension("part");
    fs::copy(&built, &copied)
        .and_then(|_| fs::rename(&copied, &module))
        .with_context(|| format!("cannot copy {}", built.display()))?;
    let environment = run::joined(environment)?;
    let mut tests = environment.pytest(root);
    tests.env("PYTHONPATH", root.join("python"));
    if skips == Skips::Fail {
        tests.env(STRICT, "1");
    }
    let watched = run::run_captured(&mut tests)?;
    Ok((watched.succeeded, Counts::of_pytest(&watched.lines)))
}

pub fn wheel(root: &Path) -> Result<bool> {
    let tools = Environment::at(root, "target/xtask/maturin", "python3", &["python/wheel.txt"])?;
    let wheels = root.join("target/wheels");
    remove(&wheels)?;
    let mut build = tools.run("maturin");
    build.args([
        "build",
        "--release",
        "--zig",
        "--compatibility",
        MANYLINUX,
        "--manifest-path",
        "python/Cargo.toml",
    ]);
    if !run::run_shown(build.arg("--out").arg(&wheels).current_dir(root))? {
        return Ok(false);
    }
    let wheel = only_wheel(&wheels)?;
    let bytes = fs::metadata(&wheel)?.len();
    let size = format!("{:.2} MB", bytes as f64 / 1e6);
    println!("{}: {size}; at most {} MB", wheel.display(), MOST_BYTES / 1_000_000);
    let mut succeeded = bytes <= MOST_BYTES;
    // The oldest installed Python represents the oldest of all.
    let oldest = ["python3.10", "python3.11", "python3"]
        .into_iter()
        .find(|python| run::is_runnable(python, &["--version"]));
    for (name, python, requirements) in [
        ("newest", "python3", &[REQUIREMENTS][..]),
        ("oldest", oldest.unwrap_or("python3"), &[REQUIREMENTS, OLDEST][..]),
    ] {
        println!("\n=== the wheel with the {name} of what it supports");
        let folder = format!("target/xtask/wheel-{name}");
        remove(&root.join(&folder))?;
        let environment = Environment::at(root, &folder, python, requirements)?;
        let mut install = environment.run("python");
        install.args(["-m", "pip", "install", "--quiet", "--no-deps"]).arg(&wheel);
        if !run::run_shown(&mut install)? {
            bail!("the wheel cannot be installed");
        }
        let mut tests = environment.pytest(root);
        succeeded &= run::run_shown(tests.env("PALPATE_OPTIMISED", "1").env_remove("PYTHONPATH"))?;
    }
    Ok(succeeded)
}

pub struct Environment {
    folder: PathBuf,
}

impl Environment {
    fn at(root: &Path, folder: &str, python: &str, requirements: &[&str]) -> Result<Self> {
        let own = Self { folder: root.join(folder) };
        let wanted: Result<Vec<String>> = requirements
            .iter()
            .map(|file| fs::read_to_string(root.join(file)).with_context(|| format!("cannot read {file}")))
            .collect();
        let wanted = wanted?.concat();
        let stamp = own.folder.join("requirements.txt");
        if fs::read_to_string(&stamp).is_ok_and(|made| made == wanted) {
            return Ok(own);
        }
        remove(&own.folder)?;
        println!("making {folder}");
        let mut make = Command::new(python);
        let mut install = own.run("python");
        install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).current_dir(root);
        // The first file may name any version; the others constrain it.
        for (i, file) in requirements.iter().enumerate() {
            install.args([if i == 0 { "-r" } else { "-c" }, file]);
        }
        if !run::run_shown(make.args(["-m", "venv"]).arg(&own.folder))? || !run::run_shown(&mut install)? {
            bail!("the environment {folder} cannot be made");
        }
        fs::write(&stamp, wanted).with_context(|| format!("cannot write {}", stamp.display()))?;
        Ok(own)
    }

    pub fn run(&self, program: &str) -> Command {
        let programs = self.folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
        let mut command = Command::new(programs.join(program));
        let path = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(programs).chain(std::env::split_paths(&path));
        if let Ok(paths) = std::env::join_paths(paths) {
            command.env("PATH", paths);
        }
        command.env("VIRTUAL_ENV", &self.folder);
        command
    }

    fn pytest(&self, root: &Path) -> Command {
        let mut tests = self.run("python");
        tests.args([
            "-m",
            "pytest",
            "-c",
            "../pyproject.toml",
            "-q",
            "--durations=10",
            // One worker per core: checks of types and most fits have one thread.
            "--numprocesses=auto",
            // An idle worker takes tests of another, so that no long test runs alone at the end.
            "--dist=worksteal",
            "-p",
            "no:cacheprovider",
        ]);
        // Not in the folder of the package, which Python would import instead of the installed one.
        tests.current_dir(root.join("python/tests"));
        tests
    }
}

fn remove(folder: &Path) -> Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", folder.display()))
        }
        _ => Ok(()),
    }
}

fn only_wheel(folder: &Path) -> Result<PathBuf> {
    let files = fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut wheels = files.filter_map(|file| file.ok().map(|file| file.path()));
    wheels
        .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
        .context("the wheel is missing")
}
