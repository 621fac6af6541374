//! `palpate limit` from outside: what physics allows on the paper's bench, and what it refuses.

use crate::support::board::{self, Board, Touch};
use crate::support::command::{complained, folder, json, run, said};
use crate::support::examples::{FSI_WATER, PAPER};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fmt::Display;
use std::fs;
use toml_edit::Array;

fn limit(rig: impl Display, arguments: &[&str]) -> String {
    said(&run(folder(rig).path(), &[&["limit", "rig.toml"], arguments].concat()))
}

fn curve(rig: impl Display, arguments: &[&str]) -> Value {
    json(folder(rig).path(), &[&["limit", "rig.toml"], arguments].concat())
}

#[test]
fn the_papers_bench_has_its_limit_and_its_warnings() {
    insta::assert_snapshot!(limit(PAPER, &[]));
}

#[test]
fn with_an_unknown_force_the_warnings_are_others() {
    let unknown = curve(PAPER, &["--unknown-force"]);
    assert_eq!(unknown["force"], "unknown");
    let warnings = unknown["warnings"].as_array().unwrap();
    assert_eq!(warnings.iter().map(|warning| &warning["kind"]).collect::<Vec<_>>(), ["blind", "blind"]);
    assert_eq!(warnings[0]["bound"].as_f64().unwrap().round(), 40.0);
    assert!(warnings[0]["value"].as_f64().unwrap() > 8000.0);
    assert!(warnings[0]["help"].as_str().unwrap().contains("reaction sensors"));
    // A rig without a force does not know it.
    let without = Toml::parse(PAPER).remove("contact").remove("training");
    assert_eq!(curve(without, &["--force", "3 N"])["warnings"], unknown["warnings"]);
}

#[test]
fn the_json_has_the_papers_figures() {
    let found = curve(PAPER, &["--every", "50 mm"]);
    let positions = found["positions"].as_array().unwrap();
    assert_eq!(positions.len(), 7);
    let at = |i: usize, key: &str| positions[i][key].as_f64().unwrap();
    assert_eq!(at(3, "x_mm").round(), 200.0);
    assert!((at(0, "known_force_mm") - 0.095).abs() < 1e-3 && (at(3, "known_force_mm") - 0.69).abs() < 5e-3);
    assert!((at(0, "unknown_force_mm") - 3.3).abs() < 0.05);
    let mean_mm = found["known_force"]["mean_mm"].as_f64().unwrap();
    assert!((mean_mm - 0.195).abs() < 5e-4, "{found}");
    let mean_error_mm = found["known_force"]["mean_error_mm"].as_f64().unwrap();
    assert!((mean_error_mm / mean_mm - 0.79788).abs() < 1e-4);
    assert_eq!(found["warnings"][0]["kind"], "mirror");
    // The limit goes with the noise, and against the force.
    let louder = curve(PAPER, &["--noise", "10 um", "--force", "6 N"]);
    let ratio = louder["known_force"]["mean_mm"].as_f64().unwrap() / mean_mm;
    assert!((ratio - 1.0).abs() < 1e-9);
}

#[test]
fn unidentifiable_values_are_null() {
    let one = Toml::parse(PAPER).set("sensors.count", 1).to_string();
    let found = curve(&one, &[]);
    assert!(
        found["unknown_force"].is_null() && found["positions"][0]["unknown_force_mm"].is_null(),
        "{found}"
    );
    assert!(limit(&one, &[]).contains("read the same"));
}

/// A beam of 24 m on three supports.
const LONG_BEAM: &str = r#"
[surface]
kind = "beam"
length = "24 m"
width = "300 mm"
thickness = "300 mm"
youngs_modulus = "30 GPa"
supports = [{ at = "0 m", kind = "simple" }, { at = "12 m", kind = "simple" }, { at = "24 m", kind = "simple" }]

[sensors]
measure = "deflection"
positions = ["3 m", "6 m", "9 m", "15 m", "18 m"]
noise = "10 um"

[training]
arrangement = "even"
count = 20
force = "1000 N"
"#;

#[test]
fn unknown_force_over_a_support_is_unidentifiable() {
    let folder = folder(LONG_BEAM);
    let table = said(&run(folder.path(), &["limit", "rig.toml", "--force", "1000 N", "--report", "report"]));
    let row = table.lines().find(|line| line.starts_with("12000 mm")).unwrap();
    assert_eq!(row.matches("unidentifiable").count(), 2, "{table}");
    let words = "unidentifiable, and excluded from the limits over the surface, 1 of 399 positions, 0.3 %, at 12000 mm";
    assert!(table.contains(&format!("force unknown: {words}")), "{table}");
    let found = json(folder.path(), &["limit", "rig.toml", "--force", "1000 N"]);
    assert_eq!(found["unknown_force"]["positions_without"], 1);
    assert_ne!(found["unknown_force"]["least_at_mm"][0], 12000.0);
    let middle = &found["positions"][4];
    assert_eq!((&middle["x_mm"], &middle["unknown_force_mm"]), (&Value::from(12000.0), &Value::Null));
    assert_eq!(middle["force_sd_n"], Value::Null);
    let csv = fs::read_to_string(folder.path().join("report/limit.csv")).unwrap();
    let row: Vec<&str> = csv.lines().find(|line| line.starts_with("12000,")).unwrap().split(',').collect();
    assert!(!row[1].is_empty() && row[2].is_empty() && row[3].is_empty(), "{row:?}");
    let page = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    assert!(page.contains("1 of 399 positions, 0.3 %, at 12000 mm"), "not in the report");
}

#[test]
fn the_even_layout_of_a_design_keeps_off_the_support() {
    let table = said(&run(folder(LONG_BEAM).path(), &["design", "sensors", "rig.toml", "--force", "1000 N"]));
    let even = table.lines().find(|line| line.starts_with("even: ")).unwrap();
    assert_eq!(even, "even: deflection 4000, 8000, 12060, 16000, 20000 mm");
    let mean_limit = table.lines().find(|line| line.starts_with("even  ")).unwrap();
    assert!(!mean_limit.contains('–'), "{table}");
}

#[test]
fn disabled_sensor_is_excluded() {
    let dead = Toml::parse(PAPER).add("sensors.dead", Array::from_iter([4]));
    let (whole, rest) = (curve(PAPER, &[]), curve(dead, &[]));
    assert_eq!((&rest["sensors"], &rest["sensors_alive"]), (&Value::from(8), &Value::from(7)));
    let mean = |found: &Value| found["known_force"]["mean_mm"].as_f64().unwrap();
    assert!(mean(&rest) > mean(&whole));
}

#[test]
fn the_report_and_its_pictures_are_written() {
    let folder = folder(PAPER);
    let told = said(&run(folder.path(), &["limit", "rig.toml", "--report", "deep/report"]));
    assert!(told.contains("Report: deep/report/report.html"), "{told}");
    let written = |name: &str| folder.path().join("deep/report").join(name).is_file();
    for name in ["report.html", "figure-1.svg", "figure-2.svg"] {
        assert!(written(name), "{name}");
    }
    assert_eq!(["figure-1.png", "figure-2.png"].map(written), [cfg!(feature = "png"); 2]);
}

#[test]
fn benches_without_a_limit_are_refused_in_words() {
    let clean = Toml::parse(PAPER).set("sensors.noise", "0 um").to_string();
    let forceless = Toml::parse(PAPER).remove("contact").remove("training").to_string();
    let dead =
        Toml::parse(PAPER).set("sensors.count", 2).add("sensors.dead", Array::from_iter([1, 2])).to_string();
    let cases: [(&str, &str, &[&str]); 8] = [
        ("clean sensors", &clean, &[]),
        ("a surface without a model", FSI_WATER, &[]),
        ("no force", &forceless, &[]),
        ("nothing but dead sensors", &dead, &[]),
        ("noise in a unit that nothing measures in", PAPER, &["--noise", "5 N"]),
        ("a negative noise", PAPER, &["--noise=-5 um"]),
        ("a force that is no force", PAPER, &["--force", "3 mm"]),
        ("steps longer than the surface", PAPER, &["--every", "1 m"]),
    ];
    let complaint = |(what, rig, arguments): &(&str, &str, &[&str])| {
        let folder = folder(rig);
        let arguments = [&["limit", "rig.toml", "--report", "report"], *arguments].concat();
        let complaint = complained(&run(folder.path(), &arguments), 2);
        assert!(!folder.path().join("report").exists(), "{what}");
        format!("{what}:\n{complaint}")
    };
    insta::assert_snapshot!(cases.iter().map(complaint).collect::<Vec<_>>().join("\n"));
}

#[test]
fn a_locator_of_a_measured_surface_has_a_limit_and_a_lightest_touch() {
    let (folder, mut board) = (folder(board::linear_rig()), Board::new(3));
    fs::write(folder.path().join("presses.csv"), board.calibration(144)).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"]));
    let told = json(folder.path(), &["limit", "board.json", "--force", "3 N", "--report", "page"]);
    // Raw channels have no places: 42.86 mm is where even sensors would be.
    let page = fs::read_to_string(folder.path().join("page/report.html")).unwrap();
    assert!(page.contains("standard deviation") && !page.contains("42.86"));
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{told}"));
    assert_eq!((number(&told["sensors_alive"]), number(&told["false_alarm_rate_percent"])), (6.0, 0.1));
    // A count of noise where a newton moves a sensor by up to 55.
    let surely = &told["lightest_touch"][1];
    assert_eq!(number(&surely["found_percent"]), 95.0);
    assert!((0.03..0.2).contains(&number(&surely["median_n"])), "{told}");
    assert!((0.5..10.0).contains(&number(&told["unknown_force"]["median_mm"])), "{told}");

    // Touches of that force in the middle are found at least as often as it says: these are not tared, and the scatter has the noise of a tare.
    let middle = told["positions"].as_array().unwrap().iter().find(|at| at["x_mm"] == 150.0).unwrap();
    let force_n = number(&middle["lightest_touch_n"][1]);
    let touches = vec![Touch { position_mm: 150.0, force_n }; 1000];
    fs::write(folder.path().join("touches.csv"), board.recording(&touches)).unwrap();
    let located = said(&run(folder.path(), &["locate", "board.json", "touches.csv"]));
    let found = located.lines().skip(1).filter(|line| !line.ends_with("no_contact")).count();
    assert!((930..=995).contains(&found), "{found}");

    let refused = |options: &[&str]| complained(&run(folder.path(), options), 2);
    let rig = refused(&["limit", "rig.toml", "--force", "3 N"]);
    let noise = refused(&["limit", "board.json", "--force", "3 N", "--noise", "2"]);
    let force = refused(&["limit", "board.json"]);
    insta::assert_snapshot!([rig, noise, force].join("\n"));
}
