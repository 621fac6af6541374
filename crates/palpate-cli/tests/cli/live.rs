//! `record`, `replay` and `simulated-board` from outside: what is recorded is located again, and a killed process leaves a file that opens.

use crate::support::command::{Running, complained, folder, palpate, run, said};
use crate::support::examples::NOISY_BEAM;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A thousand readings a second of a simulated board.
const BOARD: &str = "simulated:rig.toml?rate=1000";

/// A folder with a rig and its locator.
fn bench() -> TempDir {
    let folder = folder(NOISY_BEAM);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    folder
}

/// Lines of JSON.
fn objects(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_recording_is_located_again_to_the_last_bit() {
    let folder = bench();
    let record = ["record", "locator.json", "--from", BOARD, "--out", "press.mcap"];
    let told = said(&run(folder.path(), &[&record[..], &["--duration", "1.5 s", "--json"]].concat()));
    let samples: Vec<Value> = objects(&told).into_iter().filter(|object| object["event"].is_null()).collect();
    assert!(samples.len() > 500, "{}", samples.len());

    let output = run(folder.path(), &["replay", "press.mcap", "--json"]);
    let replayed = objects(&said(&output));
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("each equal to the recorded one to the last bit")
    );
    assert_eq!(replayed.len(), samples.len());
    for (again, sample) in replayed.iter().zip(&samples) {
        for key in ["number", "time_s", "x_mm", "x_95_mm", "status"] {
            assert_eq!(again[key], sample[key], "{key}: {sample}");
        }
    }
    let rows = said(&run(folder.path(), &["replay", "press.mcap"]));
    assert_eq!(rows.lines().count(), samples.len() + 1);
    let heading =
        "number,time_s,position_mm,force_n,low_mm,high_mm,force_low_n,force_high_n,trade_off,status";
    assert_eq!(rows.lines().next(), Some(heading));

    // The file is a source, as fast as the session takes it; and nothing is written over.
    let again = ["record", "locator.json", "--from", "file:press.mcap?speed=0", "--out", "again.mcap"];
    said(&run(folder.path(), &again));
    assert_eq!(said(&run(folder.path(), &["replay", "again.mcap"])).lines().count(), rows.lines().count());
    let refused = complained(&run(folder.path(), &record), 2);
    assert!(refused.contains("press.mcap: it exists already"), "{refused}");
}

#[test]
fn a_recording_whose_locator_is_damaged_or_cut_off_is_read_by_another() {
    let folder = bench();
    let record = ["record", "locator.json", "--from", BOARD, "--out", "whole.mcap", "--duration", "0.5 s"];
    said(&run(folder.path(), &record));
    let whole = fs::read(folder.path().join("whole.mcap")).unwrap();
    let rows = said(&run(folder.path(), &["replay", "whole.mcap", "--locator", "locator.json"]));
    let at = whole.windows(14).position(|bytes| bytes == b"format_version").expect("it is attached");
    let mut damaged = whole.clone();
    damaged[at] ^= 1;
    fs::write(folder.path().join("damaged.mcap"), &damaged).unwrap();
    fs::write(folder.path().join("cut.mcap"), &whole[..at]).unwrap();
    for (name, what, expected) in [
        ("damaged.mcap", "`locator.json` is damaged", rows.as_str()),
        ("cut.mcap", "cut off before its attached `locator.json`", rows.lines().next().unwrap()),
    ] {
        let told = complained(&run(folder.path(), &["replay", name]), 2);
        assert!(told.contains(name) && told.contains(what) && told.contains("--locator FILE"), "{told}");
        let output = run(folder.path(), &["replay", name, "--locator", "locator.json"]);
        // A file that ends before its locator has no reading.
        assert_eq!(output.status.code(), Some(if name == "cut.mcap" { 3 } else { 0 }), "{output:?}");
        let again = String::from_utf8(output.stdout).unwrap();
        assert_eq!(again.trim_end(), expected.trim_end(), "{name}");
    }
    let again = ["record", "locator.json", "--from", "file:damaged.mcap?speed=0", "--out", "again.mcap"];
    said(&run(folder.path(), &again));
    assert_eq!(said(&run(folder.path(), &["replay", "again.mcap"])).lines().count(), rows.lines().count());
}

#[test]
fn a_killed_process_loses_the_last_tenth_of_a_second_at_most() {
    let folder = bench();
    let mut record = palpate(folder.path());
    record.args(["record", "locator.json", "--from", BOARD, "--out", "press.mcap", "--json"]);
    let mut recorder = Running(record.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap());
    let mut lines = BufReader::new(recorder.0.stdout.take().unwrap()).lines();
    let start = Instant::now();
    let mut told = Vec::new();
    while start.elapsed() < Duration::from_secs(2) || told.len() < 1000 {
        told.push(lines.next().unwrap().unwrap());
    }
    // SIGKILL: nothing of the process runs any more.
    drop(recorder);
    told.extend(lines.map_while(Result::ok));
    // The last line may be torn.
    let last = told.iter().rev().find_map(|line| serde_json::from_str::<Value>(line).ok()).unwrap();
    let kept = objects(&said(&run(folder.path(), &["replay", "press.mcap", "--json"])));
    let time = |object: &Value| object["time_s"].as_f64().unwrap();
    let lost_s = time(&last) - time(kept.last().unwrap());
    println!("{} readings kept, the last {:.0} ms lost", kept.len(), 1e3 * lost_s);
    assert!(lost_s < 0.1, "{lost_s} s lost");
}

#[test]
fn a_board_over_tcp_is_recorded_with_its_faults() {
    let folder = bench();
    let arguments = ["simulated-board", "rig.toml", "--rate", "500 Hz", "--drop", "0.02", "--torn", "0.02"];
    let mut board = palpate(folder.path());
    board.args(arguments).args(["--to", "tcp://:0"]).stderr(Stdio::piped());
    let mut board = Running(board.spawn().unwrap());
    let mut words = BufReader::new(board.0.stderr.take().unwrap()).lines().map(Result::unwrap);
    let from = words.next().expect("the place of the board");
    let record = ["record", "locator.json", "--from", &from, "--out", "press.mcap", "--duration", "3 s"];
    let told = said(&run(folder.path(), &record));
    let number = |after: &str| -> u64 {
        let end = told.find(after).unwrap();
        let text = told[..end].trim_end().rsplit(' ').next().unwrap();
        text.replace(',', "").parse().unwrap()
    };
    assert!(number("readings in") > 200, "{told}");
    assert!(number("bad frames") > 0, "{told}");
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let folder = bench();
    let refused = |arguments: &[&str]| complained(&run(folder.path(), arguments), 2);
    let record = ["record", "locator.json", "--out", "never.mcap", "--from"];
    for (url, what) in [
        ("serial://", "serial://"),
        ("carrier-pigeon://roof", "carrier-pigeon://roof"),
        ("simulated:rig.toml?rate=0", "rate"),
        ("tcp://host:99999", "99999"),
    ] {
        let told = refused(&[&record[..], &[url]].concat());
        assert!(told.contains(what), "{url}: {told}");
    }
    let rule = "[[rule]]\nname = \"a\"\ntopic = \"t\"\nmessage = \"1\"\nx = [\"0 mm\", \"9 N\"]\n";
    fs::write(folder.path().join("rules.toml"), rule).unwrap();
    let rules = ["simulated:rig.toml", "--mqtt", "mqtt://127.0.0.1:1/a", "--rules", "rules.toml"];
    let told = refused(&[&record[..], &rules].concat());
    assert!(told.contains("rules.toml:5:"), "{told}");
    for time in ["1e308 s", "0 s"] {
        let told = refused(&[&record[..], &["simulated:rig.toml", "--duration", time]].concat());
        assert!(told.contains(&format!("`{time}`")) && told.contains("at most 1e9 s"), "{told}");
    }
    let board = ["simulated-board", "rig.toml", "--to", "-", "--duration", "1e308 s"];
    assert!(refused(&board).contains("at most 1e9 s"));
    for band in ["x = [\"500 mm\", \"600 mm\"]", "y = [\"0 mm\", \"9 mm\"]"] {
        let rule = format!("[[rule]]\ncommand = \"a\"\n{band}\n");
        fs::write(folder.path().join("rules.toml"), rule).unwrap();
        let told = refused(&[&record[..], &rules].concat());
        assert!(told.contains("rules.toml:3:5") && told.contains(&band[..3]), "{told}");
        let serve = ["serve", "rig.toml", "--listen", "127.0.0.1:0", "--rules", "rules.toml"];
        assert!(refused(&serve).contains("rules.toml:3:5"));
    }
    fs::write(folder.path().join("no.mcap"), "no recording").unwrap();
    let told = refused(&["replay", "no.mcap"]);
    assert!(told.contains("no.mcap"), "{told}");
    assert!(!folder.path().join("never.mcap").exists());
}

#[test]
fn a_folder_of_recordings_that_is_none_is_refused_before_anything_is_served() {
    let folder = bench();
    for (given, what) in
        [("rig.toml", "rig.toml is not a folder"), ("rig.toml/new", "rig.toml is not a folder")]
    {
        let serve = ["serve", "locator.json", "--listen", "127.0.0.1:0", "--record", given];
        let told = complained(&run(folder.path(), &serve), 2);
        assert!(told.contains(&format!("--record {given}")) && told.contains(what), "{told}");
    }
}

#[test]
fn sinks_are_refused_with_the_error_or_the_missing_feature() {
    let folder = bench();
    let record = ["record", "locator.json", "--from", BOARD, "--out", "never.mcap"];
    let refused = |option: &[&str]| complained(&run(folder.path(), &[&record[..], option].concat()), 2);
    for (option, value, what) in [
        ("--ros", "robot:7447", "tcp/"),
        ("--ros", "tcp/robot:99999", "1 to 65535"),
        ("--ros", "tcp/robot?domain=233", "0 to 232"),
        ("--ros", "tcp/robot?topic=a", "domain, name and frame"),
        ("--foxglove", "8765", "8765"),
        ("--foxglove", "localhost:8765", "localhost:8765"),
    ] {
        let told = refused(&[option, value]);
        assert!(told.contains(option) && told.contains(what), "{value}: {told}");
    }
    #[cfg(not(feature = "ros"))]
    assert!(refused(&["--ros", "tcp/robot"]).contains("--features ros"));
    #[cfg(not(feature = "foxglove"))]
    for verb in [&record[..], &["serve", "locator.json"]] {
        let told = complained(&run(folder.path(), &[verb, &["--foxglove", "127.0.0.1:0"]].concat()), 2);
        assert!(told.contains("--features foxglove"), "{told}");
    }
    assert!(!folder.path().join("never.mcap").exists());
}

#[test]
fn board_with_other_channels_is_not_recorded_and_the_reason_is_reported() {
    let folder = bench();
    fs::write(folder.path().join("other.toml"), NOISY_BEAM.replace("count = 8 ", "count = 5 ")).unwrap();
    let board = "simulated:other.toml?rate=500";
    let record = ["record", "locator.json", "--from", board, "--out", "none.mcap", "--duration", "0.5 s"];
    let told = complained(&run(folder.path(), &record), 3);
    assert!(told.contains("0 readings") && told.contains("frames in a row are not readings"), "{told}");
    assert!(told.contains("another number of values") && told.contains("the last is `"), "{told}");
    assert!(told.contains("columns="), "{told}");
}

#[test]
fn absent_broker_is_reported_with_the_losses() {
    let folder = bench();
    let record = ["record", "locator.json", "--from", BOARD, "--out", "press.mcap", "--duration", "0.5 s"];
    let output = run(folder.path(), &[&record[..], &["--mqtt", "mqtt://127.0.0.1:1/bench"]].concat());
    said(&output);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("the broker mqtt://127.0.0.1:1/bench cannot be reached"), "{told}");
    assert!(told.contains(" messages did not reach the broker mqtt://127.0.0.1:1/bench"), "{told}");
    let board = ["simulated-board", "rig.toml", "--to", "mqtt://127.0.0.1:1/bench", "--duration", "1 s"];
    let output = run(folder.path(), &board);
    said(&output);
    let told = String::from_utf8_lossy(&output.stderr);
    let remarks = told.matches("the broker 127.0.0.1:1 cannot be reached").count();
    assert!(remarks == 1 && told.contains("check that it runs there"), "{told}");
}
