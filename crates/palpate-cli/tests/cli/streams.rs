//! Streams of readings as instruments send them: torn, endless and bad lines, and which answer belongs to which line.

use crate::support::command::{complained, folder, palpate, run, said};
use crate::support::examples::{LOAD_PROFILE, MOVING_LOAD, NOISY_BEAM, TWO_MOVING_LOADS};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Output, Stdio};
use tempfile::TempDir;

const READING: &str = "-1.2,-2.2,-3.0,-3.4,-3.4,-3.0,-2.2,-1.2\n";

fn bench() -> TempDir {
    let folder = folder(Toml::parse(NOISY_BEAM).estimator("neighbours"));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    folder
}

/// Runs a command on these bytes as its stdin.
fn fed(folder: &Path, arguments: &[&str], bytes: &[u8]) -> Output {
    let mut command = palpate(folder);
    let mut child = command
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let bytes = bytes.to_vec();
    // A command that is done with its input closes it.
    let feeder = std::thread::spawn(move || drop(stdin.write_all(&bytes)));
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap();
    output
}

fn lines(output: &Output) -> Vec<String> {
    String::from_utf8(output.stdout.clone()).unwrap().lines().map(str::to_owned).collect()
}

fn records(output: &Output) -> Vec<Value> {
    lines(output).iter().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_torn_first_line_is_skipped() {
    let bench = bench();
    let torn = format!("3.4,-3.0,-2.2,-1.2\n{READING}{READING}");
    let output = fed(bench.path(), &["locate", "locator.json", "--no-header"], torn.as_bytes());
    let complaint = complained(&output, 3);
    assert!(complaint.contains("skipped: stdin:1:"), "{complaint}");
    assert!(complaint.contains("1 of 3 lines gave no estimate"), "{complaint}");
    let told = lines(&output);
    assert!(told[1].starts_with("2,") && told[2].starts_with("3,"), "{told:?}");

    // Bytes that are no text, as a serial port sends before it is set.
    let noise = [&b"\xff\x81\x00,\xfe\n"[..], READING.as_bytes()].concat();
    complained(&fed(bench.path(), &["locate", "locator.json", "--no-header"], &noise), 3);

    // Two lines of the same wrong length are no torn ones.
    let wrong = "1,2,3,4\n1,2,3,4\n";
    let output = fed(bench.path(), &["locate", "locator.json", "--no-header"], wrong.as_bytes());
    assert!(complained(&output, 2).contains("column number 5 does not exist"), "{output:?}");
}

#[test]
fn lines_without_an_end_are_not_kept() {
    let bench = bench();
    let long = "1".repeat(3 << 20);
    let stream = format!("{READING}{long}\n{READING}");
    let locate = ["locate", "locator.json", "--no-header"];
    let output = fed(bench.path(), &locate, stream.as_bytes());
    let complaint = complained(&output, 3);
    assert!(complaint.contains("skipped: stdin:2: the line is longer than 1 MiB"), "{complaint}");
    let numbers: Vec<String> =
        lines(&output).iter().map(|line| line.split(',').next().unwrap().to_owned()).collect();
    assert_eq!(numbers, ["line", "1", "3"]);
    // Later places are counted with it.
    let output = fed(bench.path(), &locate, format!("{stream}one,2,3,4,5,6,7,8\n").as_bytes());
    assert!(complained(&output, 3).contains("stdin:4:1: `one`"), "{output:?}");
    // The first line may be the long one; a header is none.
    assert_eq!(lines(&fed(bench.path(), &locate, format!("{long}\n{READING}").as_bytes())).len(), 2);
    let output = fed(bench.path(), &["locate", "locator.json"], long.as_bytes());
    assert!(complained(&output, 2).contains("stdin:1: the line is longer than 1 MiB"), "{output:?}");
    complained(&fed(bench.path(), &locate, long.as_bytes()), 3);
    // Exactly a mebibyte is a line like others.
    let most = format!("{READING}#{}\n", "x".repeat((1 << 20) - 2));
    said(&fed(bench.path(), &locate, most.as_bytes()));
}

#[test]
fn every_answer_has_the_line_of_its_reading() {
    let bench = bench();
    let stream = format!("# a comment\n{READING}\none,2,3,4,5,6,7,8\n{READING}");
    let locate = ["locate", "locator.json", "--no-header"];
    let output = fed(bench.path(), &locate, stream.as_bytes());
    complained(&output, 3);
    let told = lines(&output);
    assert_eq!(told[0], "line,position_mm,force_n,low_mm,high_mm,force_low_n,force_high_n,trade_off,status");
    let numbers: Vec<&str> = told[1..].iter().map(|row| row.split(',').next().unwrap()).collect();
    assert_eq!(numbers, ["2", "5"]);

    let output = fed(bench.path(), &[&locate[..], &["--json"]].concat(), stream.as_bytes());
    complained(&output, 3);
    let told = records(&output);
    assert_eq!(told.iter().map(|record| &record["line"]).collect::<Vec<_>>(), [2, 4, 5]);
    assert_eq!(told[1].to_string(), r#"{"column":1,"line":4,"skipped":"`one` is not a number"}"#);
}

#[test]
fn tracks_and_profiles_have_line_numbers() {
    let folder = folder(Toml::parse(MOVING_LOAD));
    let path = folder.path();
    said(&run(path, &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(path, &["simulate", "rig.toml", "--moving", "-o", "moving.csv"]));
    let csv = fs::read_to_string(path.join("moving.csv")).unwrap();
    let mut rows: Vec<&str> = csv.lines().take(12).collect();
    rows[5] = "torn";
    let stream = rows.join("\n");
    for more in [&[][..], &["--smooth"]] {
        let output = fed(path, &[&["track", "locator.json"], more].concat(), stream.as_bytes());
        complained(&output, 3);
        let told = lines(&output);
        assert!(told[0].starts_with("line,time_s,position_mm,"), "{told:?}");
        let numbers: Vec<&str> = told[1..].iter().map(|row| row.split(',').next().unwrap()).collect();
        assert_eq!(numbers, ["3", "4", "5", "7", "8", "9", "10", "11", "12"]);
    }
    let output = fed(path, &["track", "locator.json", "--json"], stream.as_bytes());
    complained(&output, 3);
    assert_eq!(records(&output)[3]["line"], 6);
    assert!(records(&output)[3]["skipped"].as_str().unwrap().contains("1 field"), "{output:?}");

    fs::write(path.join("load.toml"), LOAD_PROFILE).unwrap();
    let channels = said(&run(path, &["profile", "load.toml", "--json"]));
    let count = serde_json::from_str::<Value>(&channels).unwrap()["residuals"].as_array().unwrap().len();
    let reading = vec!["-0.1"; count].join(",");
    let stream = format!("{reading}\ntorn\n{reading}\n");
    let output = fed(path, &["profile", "load.toml", "-", "--no-header", "--json"], stream.as_bytes());
    complained(&output, 3);
    let told = records(&output);
    assert_eq!(told.iter().map(|record| &record["line"]).collect::<Vec<_>>(), [1, 2, 3]);
    assert!(told[1]["skipped"].is_string());
}

#[test]
fn estimates_without_a_contact_have_no_place_unless_asked() {
    let bench = bench();
    let none = "-1.2,-2.2,-3.0,-3.4,-3.4,-3.0,-2.2,-1.2";
    let locate = ["locate", "locator.json", "--no-header"];
    let cells = |more: &[&str]| {
        let output = fed(bench.path(), &[&locate[..], more].concat(), none.as_bytes());
        lines(&output)[1].split(',').map(str::to_owned).collect::<Vec<_>>()
    };
    let row = cells(&[]);
    assert_eq!((row[0].as_str(), row[8].as_str()), ("1", "outside_model"));
    assert!(row[1..8].iter().all(String::is_empty), "{row:?}");
    let row = cells(&["--all"]);
    assert!(row[1].parse::<f64>().is_ok() && row[8] == "outside_model", "{row:?}");
}

#[test]
fn second_contact_has_separate_columns() {
    let folder = folder(TWO_MOVING_LOADS);
    let path = folder.path();
    said(&run(path, &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(path, &["simulate", "rig.toml", "--moving", "-o", "moving.csv", "--seed", "1"]));
    let located = said(&run(path, &["locate", "locator.json", "moving.csv"]));
    let rows: Vec<Vec<&str>> = located.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][8..10], ["status", "position_2_mm"]);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    let json = said(&run(path, &["locate", "locator.json", "moving.csv", "--json"]));
    let mut two = 0;
    for (line, row) in json.lines().zip(&rows[1..]) {
        let record: Value = serde_json::from_str(line).unwrap();
        let second =
            record["further"][0]["x_mm"].as_f64().filter(|_| ["located", "ambiguous"].contains(&row[8]));
        assert_eq!(second.map_or(String::new(), |x_mm| format!("{x_mm:.4}")), row[9], "{line}");
        two += usize::from(second.is_some());
    }
    assert!(two > rows.len() / 10, "{two} of {}", rows.len());
}
