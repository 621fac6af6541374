//! Prerequisites of the tests beyond Rust: how each is found and installed, and which tests do without it.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::run;

/// One prerequisite.
pub struct Need {
    /// Name for people.
    pub name: &'static str,
    /// An environment variable that says where it is, and so that it need not be installed.
    variable: Option<&'static str>,
    /// Whether it is where it usually is, or where the variable says.
    found: fn(&Path, Option<&Path>) -> bool,
    install: Option<Install>,
    /// Consequence for the tests without it.
    pub without: Without,
}

/// Consequence for the tests of a missing prerequisite.
#[derive(Clone, Copy)]
pub enum Without {
    /// These tests are skipped, until a person does what `remedy` says.
    Skips {
        /// The files that hold the tests.
        tests: &'static [&'static str],
        /// Remedy for people.
        remedy: &'static str,
    },
    /// Every test runs all the same, in this other way.
    FallsBack(&'static str),
}

/// Way of installing a prerequisite.
#[derive(Clone, Copy)]
enum Install {
    /// Debian packages, when this runs as root on Debian.
    Apt(&'static [&'static str]),
    /// The packages that a folder's package-lock.json names.
    #[cfg_attr(not(test), expect(dead_code, reason = "no row of the table is an npm package yet"))]
    Npm(&'static str),
    /// Python packages, in a virtual environment under target/.
    #[cfg_attr(not(test), expect(dead_code, reason = "no row of the table is a Python package yet"))]
    Pip(&'static [&'static str]),
}

/// Runs the tests in parallel, a process each.
pub const NEXTEST: Need = Need {
    name: "cargo-nextest",
    variable: None,
    found: |_, _| run::answers("cargo", &["nextest", "--version"]),
    install: None,
    without: Without::FallsBack("cargo test runs the tests instead"),
};

const NEEDS: [Need; 3] = [
    NEXTEST,
    Need {
        name: "the folder of real recordings",
        variable: Some("PALPATE_DATA"),
        found: |root, named| named.map_or_else(|| root.join("../shared/data").is_dir(), Path::is_dir),
        install: None,
        without: Without::Skips {
            tests: &["crates/palpate-cli/tests/cli/recordings.rs", "every test that reads a real recording"],
            remedy: "put it at ../shared/data beside the workspace, or name it in PALPATE_DATA",
        },
    },
    Need {
        name: "Chromium",
        variable: Some("PALPATE_CHROMIUM"),
        found: |_, named| named.unwrap_or(Path::new("/usr/bin/chromium")).is_file(),
        install: Some(Install::Apt(&["chromium", "fonts-dejavu-core"])),
        without: Without::Skips {
            tests: &["crates/palpate-cli/tests/cli/browser.rs"],
            remedy: "install Debian's chromium, or name the program in PALPATE_CHROMIUM",
        },
    },
];

/// Installs what is missing and can be installed here, and returns what is missing still.
pub fn missing(root: &Path) -> Result<Vec<Need>> {
    let mut missing = Vec::new();
    for need in NEEDS {
        let there = need.is_there(root) || (need.installed(root)? && need.is_there(root));
        if !there {
            missing.push(need);
        }
    }
    Ok(missing)
}

impl Need {
    /// Whether it is on this machine.
    pub fn is_there(&self, root: &Path) -> bool {
        (self.found)(root, self.named().as_deref().map(Path::new))
    }

    fn named(&self) -> Option<OsString> {
        self.variable.and_then(env::var_os)
    }

    /// Description for people: what is missing, what follows and what can be done.
    pub fn describe(&self) -> String {
        match self.without {
            Without::Skips { tests, remedy } => {
                format!("{} is missing: skips {}; {remedy}", self.name, tests.join(", "))
            }
            Without::FallsBack(instead) => format!("{} is missing: {instead}", self.name),
        }
    }

    fn installed(&self, root: &Path) -> Result<bool> {
        let install = self.install.filter(|install| self.named().is_none() && install.may_run());
        let Some(install) = install else { return Ok(false) };
        println!("installing {}", self.name);
        for mut command in install.commands(root) {
            if !run::shown(&mut command)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

impl Install {
    fn may_run(self) -> bool {
        match self {
            Self::Apt(_) => {
                Path::new("/etc/debian_version").exists()
                    && run::answers("apt-get", &["--version"])
                    && is_root()
            }
            Self::Npm(_) => run::answers("npm", &["--version"]),
            Self::Pip(_) => run::answers("python3", &["--version"]),
        }
    }

    fn commands(self, root: &Path) -> Vec<Command> {
        match self {
            Self::Apt(packages) => {
                let apt = |arguments: &[&str]| {
                    let mut command = Command::new("apt-get");
                    command.env("DEBIAN_FRONTEND", "noninteractive").args(["-y", "-qq"]).args(arguments);
                    command
                };
                let install = [&["install", "--no-install-recommends"], packages].concat();
                vec![apt(&["update"]), apt(&install)]
            }
            Self::Npm(folder) => {
                let mut command = Command::new("npm");
                command.args(["ci", "--no-audit", "--no-fund"]).current_dir(root.join(folder));
                vec![command]
            }
            Self::Pip(packages) => {
                let environment = root.join("target/xtask/venv");
                let mut make = Command::new("python3");
                make.args(["-m", "venv"]).arg(&environment);
                let mut install = Command::new(environment.join("bin/python"));
                install
                    .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
                    .args(packages);
                vec![make, install]
            }
        }
    }
}

/// The effective user of this process is root (`Uid:` real, effective, …).
fn is_root() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let user = status.lines().find_map(|line| line.strip_prefix("Uid:"));
    user.and_then(|ids| ids.split_whitespace().nth(1)) == Some("0")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(install: Install) -> Vec<String> {
        install
            .commands(Path::new("/usr/w"))
            .iter()
            .map(|command| format!("{command:?}").replace('"', ""))
            .collect()
    }

    #[test]
    fn each_kind_of_package_is_installed_without_questions() {
        let apt = shown(Install::Apt(&["a", "b"]));
        assert!(apt[0].ends_with("apt-get -y -qq update"), "{apt:?}");
        assert!(apt[1].ends_with("apt-get -y -qq install --no-install-recommends a b"), "{apt:?}");
        assert!(apt.iter().all(|command| command.contains("DEBIAN_FRONTEND=noninteractive")), "{apt:?}");
        assert!(shown(Install::Npm("web"))[0].ends_with("npm ci --no-audit --no-fund"));
        let pip = shown(Install::Pip(&["onnx"]));
        assert!(pip[1].starts_with("/usr/w/target/xtask/venv/bin/python -m pip install"), "{pip:?}");
    }

    #[test]
    fn a_missing_prerequisite_names_the_tests_it_skips_and_the_remedy() {
        let chromium = NEEDS.iter().find(|need| need.name == "Chromium").unwrap();
        let text = chromium.describe();
        assert!(text.contains("tests/cli/browser.rs") && text.contains("PALPATE_CHROMIUM"), "{text}");
    }

    #[test]
    fn every_test_file_that_the_table_names_exists() {
        let root = crate::root();
        for need in &NEEDS {
            if let Without::Skips { tests, .. } = need.without {
                let files = tests.iter().filter(|test| test.contains('/'));
                files.for_each(|file| assert!(root.join(file).is_file(), "{file}"));
            }
        }
    }
}
