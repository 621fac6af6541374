//! `--quiet`, and output without escape codes.

use crate::support::command::{complained, folder, palpate, run, said};
use crate::support::examples::NOISY_BEAM;
use crate::support::toml::Toml;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A bench with a locator and readings.
fn bench() -> TempDir {
    let bench = folder(
        Toml::parse(NOISY_BEAM).set("training.repeats", 2).remove("contact").add("training.force", "3 N"),
    );
    let path = bench.path();
    let only = toml_edit::Array::from_iter(["influence", "neighbours"]);
    let auto =
        Toml::parse(NOISY_BEAM).set("training.repeats", 2).estimator("auto").add("estimator.only", only);
    fs::write(path.join("auto.toml"), auto.to_string()).unwrap();
    said(&run(path, &["simulate", "rig.toml", "-o", "presses.csv"]));
    said(&run(path, &["fit", "rig.toml", "--data", "presses.csv", "-o", "locator.json"]));
    bench
}

fn stderr_of(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn notes_and_warnings_are_omitted() {
    let bench = bench();
    let with_notes: [&[&str]; 3] = [
        &["fit", "auto.toml", "--data", "presses.csv", "-o", "auto.json"],
        &["evaluate", "locator.json", "--data", "presses.csv"],
        &["record", "locator.json", "--from", "simulated:rig.toml", "--duration", "0.2 s", "-o"],
    ];
    for (i, arguments) in with_notes.into_iter().enumerate() {
        let out = |name: &str| {
            if arguments.ends_with(&["-o"]) { vec![format!("{name}{i}.mcap")] } else { Vec::new() }
        };
        let run_with = |name: &str, more: &[&str]| {
            let out = out(name);
            let out: Vec<&str> = out.iter().map(String::as_str).collect();
            stderr_of(bench.path(), &[arguments, &out[..], more].concat())
        };
        assert_ne!(run_with("loud", &[]), "", "{arguments:?}");
        assert_eq!(run_with("quiet", &["--quiet"]), "", "{arguments:?}");
        assert_eq!(
            stderr_of(
                bench.path(),
                &[&["-q"], arguments, &out("q").iter().map(String::as_str).collect::<Vec<_>>()[..]].concat()
            ),
            ""
        );
    }
}

#[test]
fn answers_stay_the_same() {
    let bench = bench();
    for arguments in [&["locate", "locator.json", "presses.csv"][..], &["limit", "auto.toml", "--json"]] {
        let loud = said(&run(bench.path(), arguments));
        assert_eq!(said(&run(bench.path(), &[arguments, &["--quiet"]].concat())), loud);
    }
}

#[test]
fn errors_and_lost_data_are_reported() {
    let bench = bench();
    let complaint = complained(&run(bench.path(), &["fit", "nowhere.toml", "-o", "x.json", "--quiet"]), 2);
    assert!(complaint.contains("nowhere.toml"), "{complaint}");
    fs::write(bench.path().join("torn.csv"), "1,2,3,4,5,6,7,8\n1,2,3,4,5,6,7,x\n").unwrap();
    let locate = ["locate", "locator.json", "torn.csv", "--no-header", "--quiet"];
    let told = complained(&run(bench.path(), &locate), 3);
    assert!(told.contains("torn.csv:2:8") && told.contains("1 of 2 lines gave no estimate"), "{told}");
}

#[test]
fn no_escape_codes_without_a_terminal() {
    let bench = bench();
    let runs: [&[&str]; 8] = [
        &["--help"],
        &["limit", "--help"],
        &["nonsense"],
        &["fit", "auto.toml", "-o", "auto.json"],
        &["fit", "nowhere.toml", "-o", "x.json"],
        &["limit", "auto.toml"],
        &["limit", "presses.csv"],
        &["track", "locator.json", "presses.csv", "--rate", "10 Hz", "--text"],
    ];
    for arguments in runs {
        let output = palpate(bench.path()).env_remove("NO_COLOR").args(arguments).output().unwrap();
        for stream in [&output.stdout, &output.stderr] {
            assert!(!stream.contains(&0x1b), "{arguments:?}: {}", String::from_utf8_lossy(stream));
        }
    }
}

/// Runs a command at a pseudo-terminal of `script`; `None` without it.
#[cfg(target_os = "linux")]
fn at_terminal(folder: &Path, arguments: &[&str], no_colour: Option<&str>) -> Option<String> {
    let words = [&[env!("CARGO_BIN_EXE_palpate")], arguments].concat();
    let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    let mut command = std::process::Command::new("script");
    command.current_dir(folder).args(["-qec", &quoted.join(" "), "/dev/null"]);
    command.env("TERM", "xterm-256color").env_remove("NO_COLOR").env_remove("CLICOLOR");
    if let Some(value) = no_colour {
        command.env("NO_COLOR", value);
    }
    let output = command.stdin(std::process::Stdio::null()).output().ok()?;
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
#[cfg(target_os = "linux")]
fn no_colour_at_a_terminal_with_no_color() {
    let bench = bench();
    for arguments in [&["limit", "--help"][..], &["fit", "nowhere.toml", "-o", "x.json"]] {
        let Some(coloured) = at_terminal(bench.path(), arguments, None) else {
            return println!("skipped: no `script`");
        };
        assert!(coloured.contains("\u{1b}["), "{arguments:?}: {coloured}");
        assert_eq!(
            at_terminal(bench.path(), arguments, Some("")).as_ref(),
            Some(&coloured),
            "an empty NO_COLOR is none"
        );
        let plain = at_terminal(bench.path(), arguments, Some("1")).unwrap();
        assert!(!plain.contains('\u{1b}'), "{arguments:?}: {plain}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn no_progress_bar_at_a_terminal_with_quiet() {
    let bench = bench();
    let fit = ["fit", "auto.toml", "-o", "auto.json"];
    let Some(loud) = at_terminal(bench.path(), &fit, Some("1")) else {
        return println!("skipped: no `script`");
    };
    assert!(loud.contains("\u{1b}["), "no bar: {loud}");
    let quiet = at_terminal(bench.path(), &[&fit[..], &["--quiet"]].concat(), Some("1")).unwrap();
    assert!(!quiet.contains('\u{1b}') && quiet.contains("auto.json"), "{quiet}");
}
