//! Names in the JSON of every verb are those of the table in docs/reference/command-line.md.

use crate::support::board::set_force_linear;
use crate::support::command::{complained, run, said};
use crate::support::examples::NOISY_BEAM;
use crate::support::toml::Toml;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

const MANUAL: &str = include_str!("../../../../docs/reference/command-line.md");
/// Names whose content has names of its own: of statuses, or of the parameters of a locator.
const WITH_OWN_NAMES: [&str; 3] = ["statuses_percent", "learnt", "training"];

/// The names that the manual lists for a verb, and which of them are always present.
fn documented(verb: &str) -> (BTreeSet<String>, BTreeSet<String>) {
    let (_, section) = MANUAL.split_once("\n## JSON\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let mut rows = section.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" | "));
    let has_verb = |verbs: &str| verbs.split(", ").any(|one| one == format!("`{verb}`"));
    let (_, cell) = rows.find(|(verbs, _)| has_verb(verbs)).unwrap_or_else(|| panic!("no row of {verb}"));
    let quoted = cell.split('`').skip(1).step_by(2).filter(|name| !name.starts_with("--") && *name != "auto");
    let (mut all, mut required) = (BTreeSet::new(), BTreeSet::new());
    for name in quoted {
        if !name.ends_with('?') {
            required.insert(name.to_owned());
        }
        all.insert(name.trim_end_matches('?').to_owned());
    }
    (all, required)
}

/// Adds the names in a value, at any depth.
fn add_names(value: &Value, names: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (name, value) in object {
                names.insert(name.clone());
                if !WITH_OWN_NAMES.contains(&name.as_str()) {
                    add_names(value, names);
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| add_names(value, names)),
        _ => {}
    }
}

/// Compares the JSON of a run with the row of `verb`.
fn check(verb: &str, stdout: &str) {
    let mut names = BTreeSet::new();
    for value in serde_json::Deserializer::from_str(stdout).into_iter::<Value>() {
        add_names(&value.unwrap_or_else(|error| panic!("{verb}: {error}: {stdout}")), &mut names);
    }
    assert!(!names.is_empty(), "{verb} prints no JSON");
    let (all, required) = documented(verb);
    let unknown: Vec<_> = names.difference(&all).collect();
    let missing: Vec<_> = required.difference(&names).collect();
    assert!(
        unknown.is_empty() && missing.is_empty(),
        "{verb}: not in the manual {unknown:?}; not in the JSON {missing:?}"
    );
}

fn prepare(folder: &Path) {
    said(&run(folder, &["init", "--example", "board", "board"]));
    fs::write(folder.join("beam.toml"), Toml::parse(NOISY_BEAM).set("training.repeats", 2).to_string())
        .unwrap();
    said(&run(folder, &["simulate", "beam.toml", "-o", "presses.csv"]));
    said(&run(folder, &["simulate", "beam.toml", "--every", "40 mm", "-o", "touches.csv"]));
}

#[test]
fn names_are_those_of_the_manual() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let auto = Toml::parse(NOISY_BEAM).set("training.repeats", 2).estimator("auto");
    let auto = auto.add("estimator.only", toml_edit::Array::from_iter(["neighbours", "centroid"]));
    fs::write(folder.path().join("auto.toml"), auto.to_string()).unwrap();
    set_force_linear(&folder.path().join("board/board.toml"));
    let board = ["--data", "board/presses.csv", "-o", "board.json"];
    let design = ["--count", "3", "--trials", "1", "--calibrations", "1", "--verify", "1"];
    let record = ["--from", "simulated:beam.toml?rate=200", "--duration", "2 s", "-o", "session.mcap"];
    let calibrate = ["--from", "-", "--presses", "presses.csv", "-o", "c.json", "--resume"];
    let runs: [(&str, &[&str], &[&str]); 19] = [
        ("simulate", &["simulate", "beam.toml"], &["-o", "again.csv"]),
        ("fit", &["fit", "beam.toml"], &["--data", "presses.csv", "-o", "beam.json"]),
        ("fit", &["fit", "auto.toml"], &["--data", "presses.csv", "-o", "auto.json"]),
        ("fit", &["fit", "board/board.toml"], &board),
        ("evaluate", &["evaluate", "beam.json"], &["--data", "touches.csv"]),
        ("evaluate", &["evaluate", "beam.toml"], &["--data", "presses.csv"]),
        ("compare", &["compare", "beam.toml"], &["--only", "neighbours", "--calibrations", "1"]),
        ("locate", &["locate", "beam.json"], &["touches.csv"]),
        ("track", &["track", "beam.json"], &["touches.csv", "--rate", "10 Hz"]),
        ("profile", &["profile", "beam.toml"], &["touches.csv"]),
        ("limit", &["limit", "beam.toml"], &[]),
        ("inspect", &["inspect", "beam.json"], &[]),
        ("inspect", &["inspect", "board.json"], &[]),
        ("inspect", &["inspect", "touches.csv"], &[]),
        ("design sensors", &["design", "sensors", "beam.toml"], &["--count", "3"]),
        ("design positions", &["design", "positions", "beam.toml"], &design),
        ("design positions --data", &["design", "positions", "beam.toml"], &["--data", "presses.csv"]),
        ("init", &["init", "presses.csv"], &["-o", "first.toml"]),
        ("calibrate", &["calibrate", "beam.toml"], &calibrate),
    ];
    for (verb, subject, more) in runs {
        check(verb, &said(&run(folder.path(), &[subject, more, &["--json"]].concat())));
    }
    said(&run(folder.path(), &[&["record", "beam.json"], &record[..]].concat()));
    check("replay", &said(&run(folder.path(), &["replay", "session.mcap", "--json"])));
    let recover = ["recover", "session.mcap", "-o", "repaired.mcap", "--json"];
    check("recover", &said(&run(folder.path(), &recover)));
}

#[test]
fn damaged_recording_is_reported_in_json() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    said(&run(folder.path(), &["fit", "beam.toml", "-o", "beam.json"]));
    let record = ["--from", "simulated:beam.toml?rate=500", "--duration", "2 s", "-o", "session.mcap"];
    said(&run(folder.path(), &[&["record", "beam.json"], &record[..]].concat()));
    let mut bytes = fs::read(folder.path().join("session.mcap")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 64].fill(0x55);
    fs::write(folder.path().join("damaged.mcap"), bytes).unwrap();
    let output = run(folder.path(), &["recover", "damaged.mcap", "-o", "repaired.mcap", "--json"]);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    complained(&output, 3);
    assert!(!told["losses"].as_array().unwrap().is_empty(), "{told}");
}

#[test]
fn a_moving_contact_has_its_time_in_json() {
    let folder = tempfile::tempdir().unwrap();
    let moving = crate::support::examples::MOVING_LOAD;
    fs::write(folder.path().join("rig.toml"), moving).unwrap();
    let simulate = ["simulate", "rig.toml", "--moving", "-o", "moving.csv", "--json"];
    let stdout = said(&run(folder.path(), &simulate));
    check("simulate", &stdout);
    let told: Value = serde_json::from_str(&stdout).unwrap();
    assert!(
        told["duration_s"].as_f64().unwrap() > 0.0 && told["natural_frequency_hz"].as_f64().unwrap() > 0.0
    );
}
