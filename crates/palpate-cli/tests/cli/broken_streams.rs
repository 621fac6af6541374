//! Stdout and stderr that are full, closed or left: nothing panics, whatever the verb.
#![cfg(target_os = "linux")]

use crate::support::command::{folder, palpate, run, said};
use crate::support::examples::{LOAD_PROFILE, NOISY_BEAM};
use crate::support::toml::Toml;
use std::fs::{self, OpenOptions};
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Every verb with something to say on stdout, and whether it ends well.
const VERBS: [&[&str]; 17] = [
    &["--help"],
    &["--version"],
    &["simulate", "rig.toml", "-o", "more.csv"],
    &["fit", "rig.toml", "-o", "more.json"],
    &["evaluate", "locator.json"],
    &["locate", "locator.json", "presses.csv"],
    &["locate", "locator.json", "presses.csv", "--json"],
    &["track", "influence.json", "presses.csv", "--rate", "100 Hz"],
    &["compare", "rig.toml", "--only", "neighbours", "--calibrations", "1"],
    &["limit", "rig.toml"],
    &["design", "sensors", "rig.toml", "--count", "2"],
    &["inspect", "locator.json"],
    &["profile", "load.toml"],
    &["init", "table.csv"],
    &["replay", "session.mcap"],
    &["recover", "session.mcap", "-o", "new/repaired.mcap"],
    &["completions", "bash"],
];

/// Commands that complain, or have remarks.
const COMPLAINTS: [&[&str]; 7] = [
    &["fit", "nowhere.toml", "-o", "x.json"],
    &["fit", "rig.toml"],
    &["nonsense"],
    &["limit", "table.csv"],
    &["locate", "locator.json", "torn.csv", "--no-header"],
    &["track", "influence.json", "torn.csv", "--rate", "1 Hz"],
    &["init", "torn.csv"],
];

fn bench() -> TempDir {
    let rig = Toml::parse(NOISY_BEAM).estimator("neighbours");
    let bench = folder(format!("{rig}\n[design]\nsites = \"20 mm\"\n"));
    let path = bench.path();
    fs::write(path.join("influence.toml"), NOISY_BEAM).unwrap();
    fs::write(path.join("load.toml"), LOAD_PROFILE).unwrap();
    fs::write(path.join("table.csv"), "x,force,a\n0,1,1\n10,1,2\n20,1,3\n").unwrap();
    fs::write(path.join("torn.csv"), "1,2\n1,2,3\n4\n").unwrap();
    said(&run(path, &["simulate", "rig.toml", "-o", "presses.csv"]));
    said(&run(path, &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(path, &["fit", "influence.toml", "-o", "influence.json"]));
    let board = ["--from", "simulated:rig.toml?rate=500", "--duration", "0.2 s"];
    said(&run(path, &[&["record", "influence.json", "-o", "session.mcap"], &board[..]].concat()));
    bench
}

/// Empties the folder of `recover`, which replaces no file.
fn renew(folder: &Path) {
    let _ = fs::remove_dir_all(folder.join("new"));
    fs::create_dir(folder.join("new")).unwrap();
}

fn full() -> Stdio {
    OpenOptions::new().write(true).open("/dev/full").unwrap().into()
}

fn code(command: &mut Command) -> Option<i32> {
    if let Some(folder) = command.get_current_dir().map(Path::to_owned) {
        renew(&folder);
    }
    command.status().unwrap().code()
}

/// Runs it by a shell, which can close what it hands on.
fn by_shell(folder: &Path, arguments: &[&str], redirection: &str) -> Option<i32> {
    renew(folder);
    let script = format!("\"$0\" \"$@\" {redirection}");
    let program = env!("CARGO_BIN_EXE_palpate");
    let mut command = Command::new("sh");
    command.current_dir(folder).args(["-c", &script, program]).args(arguments);
    code(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()))
}

#[test]
fn a_full_stdout_is_an_error() {
    let bench = bench();
    for arguments in VERBS {
        renew(bench.path());
        let output = palpate(bench.path()).args(arguments).stdout(full()).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains("cannot write to stdout"), "{arguments:?}: {stderr}");
    }
}

#[test]
fn a_recording_is_kept_whole_where_its_samples_cannot_be_printed() {
    let bench = bench();
    let board = "simulated:rig.toml?rate=500";
    let record = ["record", "influence.json", "--from", board, "--duration", "0.5 s", "--json", "--out"];
    let to_full = palpate(bench.path()).args(record).arg("full.mcap").stdout(full()).output().unwrap();
    let stderr = String::from_utf8_lossy(&to_full.stderr);
    assert_eq!(to_full.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("cannot write to stdout: No space left"), "{stderr}");
    assert!(stderr.contains("not printed any longer") && stderr.contains("full.mcap: "), "{stderr}");
    let mut head = palpate(bench.path());
    let mut left = head.args(record).arg("left.mcap").stdout(Stdio::piped()).spawn().unwrap();
    drop(left.stdout.take());
    assert_eq!(left.wait().unwrap().code(), Some(0));
    for kept in ["full.mcap", "left.mcap"] {
        let replayed = run(bench.path(), &["replay", kept]);
        assert!(said(&replayed).lines().count() > 100, "{kept}");
        assert!(!String::from_utf8_lossy(&replayed.stderr).contains("cut off"), "{kept}");
    }
}

#[test]
fn full_or_closed_stderr_has_no_effect() {
    let bench = bench();
    for arguments in VERBS.into_iter().chain(COMPLAINTS) {
        let wanted = code(palpate(bench.path()).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()));
        assert_eq!(wanted == Some(0), VERBS.contains(&arguments), "{arguments:?}: {wanted:?}");
        let told = code(palpate(bench.path()).args(arguments).stdout(Stdio::null()).stderr(full()));
        assert_eq!(told, wanted, "{arguments:?}");
        assert_eq!(by_shell(bench.path(), arguments, "2>&-"), wanted, "{arguments:?}");
        for redirection in [">&- 2>&-", "2>/dev/full >&-"] {
            let code = by_shell(bench.path(), arguments, redirection);
            assert!(
                code == Some(2) || code == wanted && wanted != Some(0),
                "{arguments:?} {redirection}: {code:?}"
            );
        }
        let both = code(palpate(bench.path()).args(arguments).stdout(full()).stderr(full()));
        assert!(both == Some(2) || both == wanted, "{arguments:?}: {both:?}");
    }
}

#[test]
fn a_closed_stdout_is_an_error() {
    let bench = bench();
    let more: [&[&str]; 4] = [
        &["record", "influence.json", "--from", "simulated:rig.toml", "--json", "-o", "new/a.mcap"],
        &[
            "record",
            "influence.json",
            "--from",
            "simulated:rig.toml",
            "--duration",
            "0.2 s",
            "-o",
            "new/b.mcap",
        ],
        &["simulated-board", "rig.toml", "--to", "-", "--duration", "0.1 s"],
        &["man", "-o", "man"],
    ];
    for arguments in VERBS.into_iter().chain(more) {
        renew(bench.path());
        let script = "\"$0\" \"$@\" >&-";
        let mut command = Command::new("sh");
        command.current_dir(bench.path()).args(["-c", script, env!("CARGO_BIN_EXE_palpate")]).args(arguments);
        let output =
            command.env("NO_COLOR", "1").stdin(Stdio::null()).stderr(Stdio::piped()).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains("cannot write to stdout: it is closed"), "{arguments:?}: {stderr}");
    }
    // An open stdout that leads nowhere is not closed, also where it can be read.
    let null = OpenOptions::new().read(true).write(true).open("/dev/null").unwrap();
    assert_eq!(code(palpate(bench.path()).args(["limit", "rig.toml"]).stdout(null)), Some(0));
}

#[test]
fn a_reader_that_ends_is_no_error() {
    let bench = bench();
    for arguments in VERBS {
        renew(bench.path());
        let mut command = palpate(bench.path());
        let mut child =
            command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("Broken pipe") && !stderr.contains("panicked"), "{arguments:?}: {stderr}");
    }
}
