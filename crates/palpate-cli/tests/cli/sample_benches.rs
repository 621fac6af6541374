//! `palpate init --example`: files that are there at once, and commands that work on them.
#![cfg(unix)]

use crate::support::attempt::{Attempt, wait_for_answer};
use crate::support::board::set_force_linear;
use crate::support::command::{complained, json, run, said};
use crate::support::shell::run_line;
use serde_json::Value;
use std::fs;
use std::path::Path;

const BENCHES: [&str; 5] = ["beam", "board", "skin", "plate", "finger"];

/// Writes a bench into the folder `bench`, and runs its next commands; returns the median error of the touches, in mm.
fn try_commands(bench: &str) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let told = said(&run(folder.path(), &["init", "--example", bench, "bench"]));
    if bench == "skin" {
        // The tutorials fit the rig of a measured surface as it is: the choice among all estimators takes four times as long.
        set_force_linear(&folder.path().join("bench/skin.toml"));
    }
    let (files, commands) = told.split_once("Next:\n").unwrap();
    for file in files.lines() {
        assert!(folder.path().join(file).is_file(), "{bench}: {file}");
    }
    let mut median_mm = f64::NAN;
    for line in commands.lines().map(str::trim) {
        if line.starts_with("palpate serve ") {
            serves(folder.path(), line);
            continue;
        }
        let is_evaluation = line.starts_with("palpate evaluate ");
        let output =
            run_line(folder.path(), &format!("{line}{}", if is_evaluation { " --json" } else { "" }));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{bench}: {line}: {stderr}");
        if line.starts_with("palpate locate ") {
            let located = String::from_utf8_lossy(&output.stdout).matches(",located").count();
            assert!(located > 20, "{bench}: {located} contacts");
        }
        if is_evaluation {
            let json: Value = serde_json::from_slice(&output.stdout).unwrap();
            median_mm = json["errors"][0]["error_mm"]["median"].as_f64().unwrap();
        }
    }
    median_mm
}

/// The command serves until it is interrupted.
fn serves(folder: &Path, line: &str) {
    let words: Vec<&str> = line.split(' ').skip(1).chain(["--listen", "127.0.0.1:0"]).collect();
    let mut server = Attempt::begin(folder, &words);
    let address = server.address();
    // A session that ends before its first reading lost its data.
    let has_samples = |history: &Value| history["samples"].as_array().is_some_and(|all| !all.is_empty());
    wait_for_answer(&address, "/api/history", has_samples);
    assert_eq!(server.interrupt().0, Some(130));
}

#[test]
fn commands_of_the_beam_work() {
    assert!(try_commands("beam") < 0.1);
}

#[test]
fn commands_of_the_board_work() {
    assert!(try_commands("board") < 1.0);
}

#[test]
fn commands_of_the_skin_work() {
    assert!(try_commands("skin") < 3.0);
}

#[test]
fn commands_of_the_plate_work() {
    // Touches reach the edges; the root of the Cramér–Rao bound is 2 to 4 mm in the middle.
    assert!(try_commands("plate") < 2.5);
}

#[test]
fn commands_of_the_finger_work() {
    assert!(try_commands("finger") < 0.5);
}

#[test]
fn files_are_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    for bench in BENCHES {
        let read = |name: &str| -> Vec<Vec<u8>> {
            said(&run(folder.path(), &["init", "--example", bench, name]));
            let file = |file: &str| fs::read(folder.path().join(name).join(file)).unwrap();
            vec![file(&format!("{bench}.toml")), file("presses.csv"), file("touches.csv")]
        };
        assert!(read(&format!("{bench}-1")) == read(&format!("{bench}-2")), "{bench}");
    }
}

#[test]
fn existing_files_stay_unless_they_are_to_be_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bench/touches.csv");
    fs::create_dir(folder.path().join("bench")).unwrap();
    fs::write(&path, "mine").unwrap();
    let init = ["init", "--example", "beam", "bench"];
    let told = complained(&run(folder.path(), &init), 2);
    assert!(told.contains("bench/touches.csv already exists") && told.contains("--overwrite"), "{told}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    assert!(!folder.path().join("bench/beam.toml").exists());
    said(&run(folder.path(), &[&init[..], &["--overwrite"]].concat()));
    assert_ne!(fs::read_to_string(&path).unwrap(), "mine");
    // A bench of another name has a rig of another name, and the same names of recordings.
    complained(&run(folder.path(), &["init", "--example", "board", "bench"]), 2);
}

#[test]
fn options_of_a_recording_do_not_go_with_an_example() {
    let folder = tempfile::tempdir().unwrap();
    for more in [&["--force", "F"][..], &["-o", "rig.toml"], &["--decimal", "comma"]] {
        complained(&run(folder.path(), &[&["init", "--example", "beam", "bench"], more].concat()), 2);
    }
    complained(&run(folder.path(), &["init", "--example", "bridge", "bench"]), 2);
    complained(&run(folder.path(), &["init", "--example", "beam"]), 2);
    assert!(fs::read_dir(folder.path()).unwrap().next().is_none());
}

#[test]
fn a_folder_with_a_blank_in_its_name_is_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let told = json(folder.path(), &["init", "--example", "finger", "my bench"]);
    let fit = told["commands"][0].as_str().unwrap();
    assert!(run_line(folder.path(), fit).status.success(), "{fit}");
    assert!(folder.path().join("my bench/finger.json").is_file());
}
