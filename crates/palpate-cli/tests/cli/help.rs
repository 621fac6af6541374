//! Help of every verb.

use crate::support::command::{palpate, run, said};
#[cfg(unix)]
use crate::support::shell::run_line;
use std::fs;
use std::path::Path;

/// Every verb, and the verbs of `design`.
const VERBS: [&[&str]; 22] = [
    &[],
    &["study"],
    &["init"],
    &["simulate"],
    &["fit"],
    &["evaluate"],
    &["locate"],
    &["track"],
    &["calibrate"],
    &["compare"],
    &["design"],
    &["design", "sensors"],
    &["design", "positions"],
    &["limit"],
    &["inspect"],
    &["profile"],
    &["serve"],
    &["record"],
    &["recover"],
    &["replay"],
    &["simulated-board"],
    &["completions"],
];

/// The long help of a verb.
fn long_help(verb: &[&str]) -> String {
    said(&run(Path::new("."), &[verb, &["--help"]].concat()))
}

/// The verbs that the help of `verb` lists.
fn listed(verb: &[&str]) -> Vec<String> {
    let help = long_help(verb);
    let Some((_, rest)) = help.split_once("\nCommands:\n") else { return Vec::new() };
    let names = rest.lines().take_while(|line| line.starts_with("  "));
    let names = names.filter_map(|line| line[2..].split(' ').next()).filter(|name| !name.is_empty());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

#[test]
fn help_of_every_verb_is_as_in_the_snapshot() {
    for verb in VERBS {
        let name = if verb.is_empty() { "palpate".to_owned() } else { verb.join("-") };
        insta::with_settings!({ snapshot_suffix => name }, {
            insta::assert_snapshot!(long_help(verb));
        });
    }
}

#[test]
fn every_verb_has_a_snapshot() {
    for parent in [&[][..], &["design"]] {
        for name in listed(parent) {
            let verb = [parent, &[name.as_str()]].concat();
            assert!(VERBS.contains(&&verb[..]), "{verb:?}");
        }
    }
}

#[test]
fn every_verb_has_examples_and_every_option_a_description() {
    for verb in VERBS {
        let help = long_help(verb);
        assert!(help.contains("\nExamples:\n"), "{verb:?}");
        let short = said(&run(Path::new("."), &[verb, &["-h"]].concat()));
        let lines: Vec<&str> = short.lines().collect();
        let is_option = |line: &str| line.starts_with("  -") || line.starts_with("      --");
        for (i, line) in lines.iter().enumerate().filter(|(_, line)| is_option(line)) {
            // The description of a long option is on the next line.
            let text = line.trim().split_once("  ").map_or_else(|| lines[i + 1], |(_, text)| text).trim();
            assert!(text.starts_with(char::is_uppercase), "{verb:?}: {line}");
        }
    }
}

#[test]
fn help_fits_a_narrow_terminal_without_a_panic() {
    for verb in VERBS {
        let output = palpate(Path::new(".")).env("COLUMNS", "20").args(verb).arg("--help").output().unwrap();
        assert!(output.status.success(), "{verb:?}");
    }
}

/// Lines of the examples of a verb's help.
#[cfg(unix)]
fn examples(verb: &[&str]) -> Vec<String> {
    let help = long_help(verb);
    let (_, rest) = help.split_once("\nExamples:\n").unwrap();
    let lines = rest.lines().take_while(|line| line.is_empty() || line.starts_with(' '));
    lines
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(str::to_owned)
        .collect()
}

/// True for examples that need hardware, run until they are interrupted, write into the user's home, or train hundreds of networks, as
/// the tests of studies do.
#[cfg(unix)]
fn needs_more_than_a_folder(line: &str) -> bool {
    let is_endless = ["palpate serve", "palpate simulated-board beam.toml"].contains(&line);
    is_endless || line.contains("/dev/tty") || line.contains("~/") || line.starts_with("palpate study ")
}

#[test]
#[cfg(unix)]
fn examples_of_the_help_work() {
    let folder = tempfile::tempdir().unwrap();
    // Files that later examples read: those of `init`, then `beam.json`, then `session.mcap`.
    let first: [&[&str]; 4] = [&["init"], &[], &["fit"], &["record"]];
    let others = VERBS.into_iter().filter(|verb| !first.contains(verb));
    for verb in first.into_iter().chain(others) {
        for line in examples(verb) {
            assert!(line.len() <= 98, "wrapped in the help: {line}");
            if needs_more_than_a_folder(&line) {
                continue;
            }
            let output = run_line(folder.path(), &format!("set -o pipefail; {line}"));
            assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        }
        if verb == ["init"] {
            let beam = folder.path().join("beam.toml");
            fs::write(&beam, fs::read_to_string(&beam).unwrap() + "\n[design]\nsites = \"20 mm\"\n").unwrap();
        }
    }
}
