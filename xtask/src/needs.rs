//! Prerequisites of the tests beyond Rust: detection and installation.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::run;

pub struct Need {
    pub name: &'static str,
    /// Variable with the path of a program that is installed elsewhere.
    variable: Option<&'static str>,
    found: fn(&Path, Option<&Path>) -> bool,
    /// Installed by root on Debian.
    packages: &'static [&'static str],
    pub without: Fallback,
}

#[derive(Clone, Copy)]
pub enum Fallback {
    Skips {
        tests: &'static [&'static str],
        remedy: &'static str,
    },
    /// All tests run in another way.
    FallsBack(&'static str),
}

pub const NEXTEST: Need = Need {
    name: "cargo-nextest",
    variable: None,
    found: |_, _| run::is_runnable("cargo", &["nextest", "--version"]),
    packages: &[],
    without: Fallback::FallsBack("cargo test runs the tests instead"),
};

pub const PYTHON: Need = Need {
    name: "Python with venv",
    variable: None,
    found: |_, _| {
        run::is_runnable(
            "python3",
            &["-c", "import venv, ensurepip, sys; assert sys.version_info >= (3, 10)"],
        )
    },
    packages: &["python3", "python3-venv"],
    without: Fallback::Skips {
        tests: &["every test of the Python package"],
        remedy: "install Python 3.10 or later with its modules venv and ensurepip",
    },
};

pub const NODE: Need = Need {
    name: "Node with npm",
    variable: None,
    found: |_, _| {
        run::first_line("node", &["--version"]).is_some_and(|version| is_recent_node(&version))
            && run::is_runnable("npm", &["--version"])
    },
    packages: &["nodejs", "npm"],
    without: Fallback::Skips {
        tests: &["every test of the dashboard"],
        remedy: "install Node 20.19 or later with npm; without it `palpate serve` has no dashboard",
    },
};

const NEEDS: [Need; 7] = [
    NEXTEST,
    PYTHON,
    NODE,
    Need {
        name: "the folder of real recordings",
        variable: Some("PALPATE_DATA"),
        found: |root, named| named.map_or_else(|| root.join("../shared/data").is_dir(), Path::is_dir),
        packages: &[],
        without: Fallback::Skips {
            tests: &["crates/palpate-cli/tests/cli/recordings.rs", "every test that reads a real recording"],
            remedy: "put it at ../shared/data beside the workspace, or name it in PALPATE_DATA",
        },
    },
    Need {
        name: "Chromium",
        variable: Some("PALPATE_CHROMIUM"),
        found: |_, named| named.unwrap_or(Path::new("/usr/bin/chromium")).is_file(),
        packages: &["chromium", "fonts-dejavu-core"],
        without: Fallback::Skips {
            tests: &["crates/palpate-cli/tests/cli/browser.rs", "web/browser/dashboard.test.ts"],
            remedy: "install Debian's chromium, or name the program in PALPATE_CHROMIUM",
        },
    },
    Need {
        name: "the MQTT broker mosquitto",
        variable: Some("PALPATE_MOSQUITTO"),
        found: |_, named| named.unwrap_or(Path::new("/usr/sbin/mosquitto")).is_file(),
        packages: &["mosquitto"],
        without: Fallback::Skips {
            tests: &["crates/palpate-live/tests/connections/broker.rs"],
            remedy: "install Debian's mosquitto, or name the program in PALPATE_MOSQUITTO",
        },
    },
    Need {
        name: "a C compiler",
        variable: None,
        found: |_, _| run::is_runnable("cc", &["--version"]),
        packages: &["gcc", "libc6-dev"],
        without: Fallback::Skips {
            tests: &["crates/palpate-live/tests/firmware.rs"],
            remedy: "install Debian's gcc",
        },
    },
];

/// Installs missing prerequisites, and returns the rest.
pub fn missing(root: &Path) -> Result<Vec<Need>> {
    let mut missing = Vec::new();
    for need in NEEDS {
        let there = need.is_there(root) || (need.installed()? && need.is_there(root));
        if !there {
            missing.push(need);
        }
    }
    Ok(missing)
}

impl Need {
    pub fn is_there(&self, root: &Path) -> bool {
        (self.found)(root, self.named().as_deref().map(Path::new))
    }

    fn named(&self) -> Option<OsString> {
        self.variable.and_then(env::var_os)
    }

    pub fn describe(&self) -> String {
        match self.without {
            Fallback::Skips { tests, remedy } => {
                format!("{} is missing: skips {}; {remedy}", self.name, tests.join(", "))
            }
            Fallback::FallsBack(instead) => format!("{} is missing: {instead}", self.name),
        }
    }

    fn installed(&self) -> Result<bool> {
        if self.packages.is_empty() || self.named().is_some() || !may_install() {
            return Ok(false);
        }
        println!("installing {}", self.name);
        for mut command in self.installation() {
            if !run::run_shown(&mut command)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn installation(&self) -> [Command; 2] {
        let apt = |arguments: &[&str]| {
            let mut command = Command::new("apt-get");
            command.env("DEBIAN_FRONTEND", "noninteractive").args(["-y", "-qq"]).args(arguments);
            command
        };
        [apt(&["update"]), apt(&[&["install", "--no-install-recommends"], self.packages].concat())]
    }
}

/// The dashboard needs Node 20.19; a version has the form `v20.19.1`.
fn is_recent_node(version: &str) -> bool {
    let mut numbers =
        version.trim().trim_start_matches('v').split('.').map_while(|number| number.parse::<u32>().ok());
    matches!((numbers.next(), numbers.next()), (Some(major), Some(minor)) if (major, minor) >= (20, 19))
}

fn may_install() -> bool {
    Path::new("/etc/debian_version").exists() && run::is_runnable("apt-get", &["--version"]) && is_root()
}

/// Reads the effective user (`Uid:` real, effective, …).
fn is_root() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let user = status.lines().find_map(|line| line.strip_prefix("Uid:"));
    user.and_then(|ids| ids.split_whitespace().nth(1)) == Some("0")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn need(name: &str) -> &'static Need {
        const { &NEEDS }.iter().find(|need| need.name == name).unwrap()
    }

    #[test]
    fn packages_are_installed_without_questions() {
        let commands = need("Chromium").installation().map(|command| format!("{command:?}").replace('"', ""));
        assert!(commands[0].ends_with("apt-get -y -qq update"), "{commands:?}");
        let install = "apt-get -y -qq install --no-install-recommends chromium fonts-dejavu-core";
        assert!(commands[1].ends_with(install), "{commands:?}");
        assert!(commands.iter().all(|command| command.contains("DEBIAN_FRONTEND=noninteractive")));
    }

    #[test]
    fn node_is_recent_from_20_19_on() {
        for recent in ["v20.19.0\n", "v20.20.2", "v22.1.0", "v100.0.0"] {
            assert!(is_recent_node(recent), "{recent}");
        }
        for old in ["v20.18.3", "v18.20.4\n", "", "v", "node"] {
            assert!(!is_recent_node(old), "{old}");
        }
    }

    #[test]
    fn a_missing_prerequisite_names_the_tests_it_skips_and_the_remedy() {
        let text = need("Chromium").describe();
        assert!(text.contains("tests/cli/browser.rs") && text.contains("PALPATE_CHROMIUM"), "{text}");
    }

    #[test]
    fn every_test_file_that_the_table_names_exists() {
        let root = crate::root();
        for need in &NEEDS {
            if let Fallback::Skips { tests, .. } = need.without {
                let files = tests.iter().filter(|test| test.contains('/'));
                files.for_each(|file| assert!(root.join(file).is_file(), "{file}"));
            }
        }
    }
}
