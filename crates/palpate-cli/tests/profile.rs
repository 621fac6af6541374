//! `palpate profile` from outside: loads that are simulated, and readings that are read.
#![forbid(unsafe_code)]

mod support {
    pub mod command;
}

use serde_json::Value;
use std::fs;
use support::command::{complained, run, said};
use tempfile::TempDir;

const EXAMPLE: &str = include_str!("../../../examples/load-profile.toml");
/// The same bench, for presses at points.
const PRESSED: &str = "\n[training]\ncount = 2\nrepeats = 5\nforce = \"3 N\"\n[estimator]\nkind = \"influence\"\nfrom = \"mechanics\"\n";

fn folder(rig: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    folder
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_example_tells_both_pads() {
    let folder = folder(EXAMPLE);
    let json =
        said(&run(folder.path(), &["profile", "rig.toml", "--json", "--seed", "1", "--report", "page.html"]));
    let found: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(found["status"], "located");
    assert!((number(&found["total_n"]["value"]) / 4.0 - 1.0).abs() < 0.02, "{json}");
    assert!((number(&found["centre_x_mm"]["value"]) - 200.0).abs() < 1.0, "{json}");
    let patches = found["patches"].as_array().unwrap();
    assert_eq!(patches.len(), 2);
    for (patch, load) in patches.iter().zip(found["loads"].as_array().unwrap()) {
        let limit_mm = number(&load["limit_x_mm"]);
        assert!((limit_mm - 1.03).abs() < 0.05, "{limit_mm}");
        let off_mm = number(&patch["centre_x_mm"]["value"]) - number(&load["centre_x_mm"]);
        assert!(off_mm.abs() < 3.0 * limit_mm, "{off_mm}");
        let force = &patch["force_n"];
        assert!(number(&force["low"]) < 2.0 && number(&force["high"]) > 2.0, "{force}");
    }
    assert_eq!(found["profile"].as_array().unwrap().len(), 80);
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("figure-4") && page.contains("true load") && !page.contains("http://palpate"));
}

#[test]
fn people_get_a_table() {
    insta::assert_snapshot!(said(&run(folder(EXAMPLE).path(), &["profile", "rig.toml"])));
}

#[test]
fn readings_are_told_as_they_come_by_rigs_and_locators() {
    let folder = folder(&(EXAMPLE.split("[[load]]").next().unwrap().to_owned() + PRESSED));
    let press = ["simulate", "rig.toml", "--every", "150 mm", "-o", "presses.csv", "--seed", "2"];
    said(&run(folder.path(), &press));
    let mut csv = fs::read_to_string(folder.path().join("presses.csv")).unwrap();
    // Five presses at 150 mm, five at 300 mm; then a row that is none, and one that no load explains.
    let last = csv.lines().last().unwrap().to_owned();
    csv += "a row that is none\n";
    let mut cells: Vec<&str> = last.split(',').collect();
    let first = csv.lines().find(|line| line.contains("deflection_1_mm")).unwrap();
    let third = first.split(',').position(|name| name == "deflection_3_mm").unwrap();
    cells[third] = "-9.5";
    let csv = format!("{csv}{}\n", cells.join(","));
    fs::write(folder.path().join("presses.csv"), csv).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    for subject in ["rig.toml", "locator.json"] {
        let output = run(folder.path(), &["profile", subject, "presses.csv", "--json"]);
        let complaint = complained(&output, 3);
        assert!(complaint.contains("skipped") && complaint.contains("gave no profile"), "{complaint}");
        let told = String::from_utf8(output.stdout).unwrap();
        let told: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!(told.len(), 11);
        for (i, found) in told[..10].iter().enumerate() {
            let truth_mm = if i < 5 { 150.0 } else { 300.0 };
            assert_eq!(found["status"], "located", "{subject}");
            assert!((number(&found["centre_x_mm"]["value"]) - truth_mm).abs() < 3.0, "{subject}: {found}");
            assert!((number(&found["total_n"]["value"]) - 3.0).abs() < 0.06, "{subject}: {found}");
        }
        assert_eq!(told[10]["status"], "outside_model");
    }
}

#[test]
fn what_cannot_be_told_is_refused_in_words() {
    let loads = EXAMPLE.find("[[load]]").unwrap();
    let clean = EXAMPLE.replacen("\"2 um\"", "\"0 um\"", 1);
    let cases: [(&str, &str, &[&str]); 3] = [
        ("nothing to simulate", &EXAMPLE[..loads], &[]),
        ("clean sensors", &clean, &[]),
        ("a file that is not there", EXAMPLE, &["nowhere.csv"]),
    ];
    let complaint = |(what, rig, arguments): &(&str, &str, &[&str])| {
        let arguments = [&["profile", "rig.toml"], *arguments].concat();
        format!("{what}:\n{}", complained(&run(folder(rig).path(), &arguments), 2))
    };
    insta::assert_snapshot!(cases.iter().map(complaint).collect::<Vec<_>>().join("\n"));
}
