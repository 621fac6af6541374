//! `palpate track` from outside, on the example of a moving load.

use crate::support::command::{complained, folder, run, said};
use crate::support::examples::{CONTINUOUS_BEAM, MOVING_LOAD, MOVING_PLATE, TWO_MOVING_LOADS};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

/// A folder with a locator and a recording of the example.
fn moved() -> TempDir {
    let folder = folder(MOVING_LOAD);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let told =
        said(&run(folder.path(), &["simulate", "rig.toml", "--moving", "-o", "moving.csv", "--seed", "1"]));
    assert!(told.contains("17.17 Hz") && told.contains("13.73 m/s"), "{told}");
    folder
}

/// The numbers of a row of the errors that are said at the end.
fn row(stderr: &[u8], name: &str) -> Vec<f64> {
    let text = String::from_utf8_lossy(stderr).into_owned();
    let line = text.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{text}"));
    line.split_whitespace().skip(1).map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn the_example_s_track_is_closer_than_its_readings() {
    let folder = moved();
    let output = run(
        folder.path(),
        &["track", "locator.json", "moving.csv", "--rig", "rig.toml", "--smooth", "--report", "page"],
    );
    let told = said(&output);
    assert_eq!(
        told.lines().next(),
        Some(
            "line,time_s,position_mm,speed_m_per_s,force_n,low_mm,high_mm,force_low_n,force_high_n,touching"
        )
    );
    let readings = fs::read_to_string(folder.path().join("moving.csv")).unwrap().lines().count() - 2;
    assert_eq!(told.lines().count() - 1, readings);
    let (filter, smoother) = (row(&output.stderr, "filter"), row(&output.stderr, "smoother"));
    assert!(filter[3] >= 2.5, "{filter:?}");
    assert!(smoother[3] >= 4.0, "{smoother:?}");
    assert!((90.0..99.0).contains(&filter[4]), "{filter:?}");
    for name in ["report.html", "figure-1.svg", "figure-2.svg", "figure-3.svg"] {
        assert!(folder.path().join("page").join(name).is_file(), "{name}");
    }
}

#[test]
fn rows_that_cannot_be_followed_are_skipped_and_counted() {
    let folder = moved();
    let csv = fs::read_to_string(folder.path().join("moving.csv")).unwrap();
    let mut lines: Vec<String> = csv.lines().take(8).map(str::to_owned).collect();
    // Again the time of the line before, and a field that is not a number.
    lines[5] = lines[5].replacen("0.003,", "0.002,", 1);
    lines[6] = lines[6].replacen("0.004,", "soon,", 1);
    fs::write(folder.path().join("bad.csv"), lines.join("\n") + "\n").unwrap();
    let output = run(folder.path(), &["track", "locator.json", "bad.csv", "--json"]);
    let complaint = complained(&output, 3);
    assert!(complaint.contains("2 of 8 lines gave no estimate"), "{complaint}");
    let told: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    // Comment and header are no readings.
    assert_eq!(told.len(), 6);
    assert!(told[3..5].iter().all(|record| record["skipped"].is_string()), "{told:?}");
    assert!((told[5]["x_mm"].as_f64().unwrap() - 50.0).abs() < 2.0, "{}", told[5]);
}

#[test]
fn prints_lines_for_people_where_a_contact_changes() {
    let folder = moved();
    let text = said(&run(folder.path(), &["track", "locator.json", "moving.csv", "--text"]));
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].contains("s: contact 1 at "), "{text}");
    assert!(lines.last().unwrap().starts_with("1 contact in "), "{text}");
    // A line a second at most, and none twice.
    let csv = fs::read_to_string(folder.path().join("moving.csv")).unwrap();
    let last_s: f64 = csv.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    assert!(lines.len() > 4 && (lines.len() as f64) < last_s + 4.0, "{last_s} s: {text}");
    assert!(lines.windows(2).all(|pair| pair[0] != pair[1]), "{text}");
    assert!(text.split([' ', '(', ')']).all(|word| word.len() < 10), "{text}");
    complained(&run(folder.path(), &["track", "locator.json", "moving.csv", "--text", "--csv"]), 2);
}

#[test]
fn prints_few_messages_about_many_skipped_rows() {
    let folder = moved();
    let csv = fs::read_to_string(folder.path().join("moving.csv")).unwrap();
    let mut lines: Vec<&str> = csv.lines().take(10).collect();
    lines.extend(std::iter::repeat_n(lines[9], 340));
    fs::write(folder.path().join("held.csv"), lines.join("\n") + "\n").unwrap();
    let output = run(folder.path(), &["track", "locator.json", "held.csv"]);
    let complaint = complained(&output, 3);
    assert!(complaint.contains("340 of 350 lines gave no estimate"), "{complaint}");
    assert!(complaint.lines().count() < 30, "{complaint}");
}

#[test]
fn invalid_tracking_is_refused_with_a_message() {
    let folder = moved();
    said(&run(folder.path(), &["simulate", "rig.toml", "-o", "presses.csv"]));
    let without_time = complained(&run(folder.path(), &["track", "locator.json", "presses.csv"]), 2);
    assert!(without_time.contains("--rate"), "{without_time}");
    said(&run(folder.path(), &["track", "locator.json", "presses.csv", "--rate", "100 Hz"]));
    let neighbours = Toml::parse(MOVING_LOAD).estimator("neighbours").to_string();
    fs::write(folder.path().join("other.toml"), neighbours).unwrap();
    said(&run(folder.path(), &["fit", "other.toml", "-o", "other.json"]));
    let other = complained(&run(folder.path(), &["track", "other.json", "moving.csv"]), 2);
    assert!(other.contains("kind `neighbours`"), "{other}");
}

#[test]
fn two_contacts_are_tracked_in_separate_columns() {
    let folder = folder(TWO_MOVING_LOADS);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(folder.path(), &["simulate", "rig.toml", "--moving", "-o", "moving.csv", "--seed", "1"]));
    let output = run(folder.path(), &["track", "locator.json", "moving.csv", "--rig", "rig.toml"]);
    let told = said(&output);
    let heading = "line,time_s,position_mm,speed_m_per_s,force_n,low_mm,high_mm,force_low_n,force_high_n,touching,position_2_mm,speed_2_m_per_s,force_2_n,low_2_mm,high_2_mm,force_low_2_n,force_high_2_n,two_touching";
    assert_eq!(told.lines().next(), Some(heading));
    assert!(told.lines().all(|line| line.split(',').count() == 18));
    let filter = row(&output.stderr, "filter");
    assert!(filter[3] >= 2.5 && filter[6] >= 95.0, "{filter:?}");
    // Its beginning is enough for what does not depend on the errors.
    let moving = fs::read_to_string(folder.path().join("moving.csv")).unwrap();
    let beginning: Vec<&str> = moving.lines().take(400).collect();
    fs::write(folder.path().join("beginning.csv"), beginning.join("\n")).unwrap();
    let json = run(folder.path(), &["track", "locator.json", "beginning.csv", "--json", "--report", "page"]);
    assert!(folder.path().join("page/report.html").exists());
    let last: Value = serde_json::from_str(said(&json).lines().last().unwrap()).unwrap();
    assert!(last["two_touching"].as_f64().unwrap() > 0.9, "{last}");
    assert!(last["second"]["x_mm"].as_f64().is_some(), "{last}");
}

#[test]
fn inertia_is_refused_where_the_mode_is_not_known() {
    let folder = folder(CONTINUOUS_BEAM);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let output = run(folder.path(), &["track", "locator.json", "--frequency", "17 Hz"]);
    let complaint = complained(&output, 2);
    assert!(complaint.contains("a beam on two simple supports"), "{complaint}");
}

#[test]
fn a_contact_is_followed_over_a_plate() {
    // A mesh that is solved at once, and a short way.
    let folder = folder(Toml::parse(MOVING_PLATE).add("surface.elements", 24).set("motion.passes", 1));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let simulate = ["simulate", "rig.toml", "--moving", "-o", "moving.csv", "--seed", "1"];
    let told = said(&run(folder.path(), &simulate));
    assert!(told.contains("its inertia is neglected"), "{told}");
    let csv = fs::read_to_string(folder.path().join("moving.csv")).unwrap();
    assert!(csv.lines().next().unwrap().contains("without inertia"), "{csv}");

    let track = ["track", "locator.json", "moving.csv", "--smooth", "--report", "page"];
    let output = run(folder.path(), &track);
    let told = said(&output);
    let heading = "line,time_s,x_mm,y_mm,speed_x_m_per_s,speed_y_m_per_s,force_n,x_low_mm,x_high_mm,y_low_mm,y_high_mm,force_low_n,force_high_n,touching";
    assert_eq!(told.lines().next(), Some(heading));
    assert_eq!(told.lines().count() - 1, csv.lines().count() - 2);
    assert!(told.lines().all(|line| line.split(',').count() == 14));
    let (filter, smoother) = (row(&output.stderr, "filter"), row(&output.stderr, "smoother"));
    assert!(filter[3] >= 2.5, "{filter:?}");
    assert!(smoother[3] >= 4.0, "{smoother:?}");
    assert!((88.0..=100.0).contains(&filter[4]), "{filter:?}");
    for name in ["report.html", "figure-1.svg", "figure-2.svg"] {
        assert!(folder.path().join("page").join(name).is_file(), "{name}");
    }

    let json = run(folder.path(), &["track", "locator.json", "moving.csv", "--json"]);
    let last: Value = serde_json::from_str(said(&json).lines().last().unwrap()).unwrap();
    let number = |key: &str| last[key].as_f64().unwrap();
    let near = |key: &str, sd: &str, mm: f64| (number(key) - mm).abs() < 3.0 * number(sd) && number(sd) < 5.0;
    assert!(near("x_mm", "sd_mm", 250.0) && near("y_mm", "sd_y_mm", 210.0), "{last}");
    assert_eq!(last["single_mm"].as_array().map(Vec::len), Some(2));
    let inertia = run(folder.path(), &["track", "locator.json", "moving.csv", "--frequency", "40 Hz"]);
    let complaint = complained(&inertia, 2);
    assert!(complaint.contains("without a natural frequency"), "{complaint}");
}
