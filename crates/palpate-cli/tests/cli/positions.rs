//! `palpate design positions` from outside: arrangements against the even one, the next press, and what is refused.

use crate::support::command::{complained, folder, run, said};
use crate::support::examples::{FSI_WATER, PLATE, SENSOR_DESIGN, TRAINING_POSITIONS};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;
use std::path::Path;

const QUICK: [&str; 6] = ["--trials", "20", "--calibrations", "2", "--verify", "3"];

fn design(folder: &Path, arguments: &[&str]) -> std::process::Output {
    run(folder, &[&["design", "positions", "rig.toml"], arguments].concat())
}

#[test]
fn people_get_a_table_of_arrangements_a_rig_and_a_report() {
    let folder = folder(SENSOR_DESIGN);
    let arguments = ["--count", "6", "-o", "pressed.toml", "--report", "page"];
    let output = design(folder.path(), &[&QUICK[..], &arguments].concat());
    let told = said(&output);
    let start = "rig.toml: 6 training positions, 5 presses each, for the `influence` estimator; 73 contacts, force unknown";
    assert!(told.starts_with(start), "{told}");
    for name in ["even ", "edge-dense ", "chebyshev ", "variance-optimal ", "optimal "] {
        assert!(told.lines().any(|line| line.starts_with(name)), "{name}: {told}");
    }
    assert!(told.contains("\neven: 33.33, 100, 166.67, 233.33, 300, 366.67 mm\n"), "{told}");
    assert!(folder.path().join("page/report.html").exists());
    let rig = fs::read_to_string(folder.path().join("pressed.toml")).unwrap();
    assert!(rig.contains("arrangement = \"explicit\"\n") && rig.contains("repeats = 5"), "{rig}");
    said(&run(folder.path(), &["fit", "pressed.toml", "-o", "locator.json"]));
}

#[test]
fn the_papers_network_gains_by_chebyshevs_nodes_alone() {
    let folder = folder(TRAINING_POSITIONS);
    let output = design(folder.path(), &["--trials", "1", "--calibrations", "1", "--verify", "8", "--json"]);
    let found: Value = serde_json::from_str(&said(&output)).unwrap();
    let median = |method: &str| {
        let designs = found["designs"].as_array().unwrap();
        let design = designs.iter().find(|design| design["method"] == method).unwrap();
        design["median_error_mm"].as_f64().unwrap()
    };
    assert!(median("chebyshev") < 0.7 * median("even"), "{found}");
}

#[test]
fn a_plate_is_pressed_on_a_grid_or_better() {
    // An estimator that is fitted at once.
    let folder = folder(Toml::parse(PLATE).estimator("neighbours"));
    let arguments = ["--count", "9", "--trials", "1", "--calibrations", "1", "--verify", "1", "--json"];
    let found: Value = serde_json::from_str(&said(&design(folder.path(), &arguments))).unwrap();
    let designs = found["designs"].as_array().unwrap();
    let names: Vec<&str> = designs.iter().map(|design| design["method"].as_str().unwrap()).collect();
    assert_eq!(names, ["even", "chebyshev", "variance-optimal", "optimal"]);
    assert!(designs.iter().all(|design| design["positions"].as_array().unwrap().len() == 9), "{found}");
}

#[test]
fn begun_recording_gives_the_next_press_and_the_stop() {
    let folder = folder(SENSOR_DESIGN);
    said(&run(folder.path(), &["simulate", "rig.toml", "-o", "all.csv"]));
    let all = fs::read_to_string(folder.path().join("all.csv")).unwrap();
    let begun: Vec<&str> = all.lines().take(32).collect();
    fs::write(folder.path().join("begun.csv"), begun.join("\n")).unwrap();
    let told = said(&design(folder.path(), &["--data", "begun.csv"]));
    assert!(told.starts_with("30 presses at 6 positions: expected error "), "{told}");
    assert!(told.contains("press next at, mm"), "{told}");
    let json = design(folder.path(), &["--data", "all.csv", "--stop-below", "90", "--json"]);
    let found: Value = serde_json::from_str(&said(&json)).unwrap();
    assert_eq!((&found["enough"], &found["presses_to_go"]), (&Value::from(true), &Value::from(0)), "{found}");
}

#[test]
fn invalid_design_is_refused_with_a_message() {
    let refused = |rig: &str, arguments: &[&str]| {
        let folder = folder(rig);
        fs::write(folder.path().join("few.csv"), "position_mm,force_n\n1,2\n").unwrap();
        complained(&design(folder.path(), arguments), 2)
    };
    let cases: [(&str, &[&str]); 9] = [
        (FSI_WATER, &[]),
        (TRAINING_POSITIONS, &["--count", "1"]),
        (TRAINING_POSITIONS, &["--count", "0"]),
        (TRAINING_POSITIONS, &["--stop-below", "3"]),
        (TRAINING_POSITIONS, &["--data", "few.csv", "--stop-below", "0"]),
        (TRAINING_POSITIONS, &["--data", "few.csv"]),
        (TRAINING_POSITIONS, &["--data", "nowhere.csv"]),
        (TRAINING_POSITIONS, &["-o", "no/such/rig.toml"]),
        (&Toml::parse(TRAINING_POSITIONS).estimator("auto").to_string(), &[]),
    ];
    let shown: Vec<String> = cases.iter().map(|(rig, arguments)| refused(rig, arguments)).collect();
    insta::assert_snapshot!(shown.join("\n"));
}
