//! The flexible digit from outside: simulated, fitted, located, judged, held against its limit and compared.

use crate::support::command::{complained, folder, json, run, said};
use crate::support::examples::{DIGIT, PAPER};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;

#[test]
fn the_example_is_located_with_its_shape_and_judged() {
    let folder = folder(DIGIT);
    let said_of = |arguments: &[&str]| said(&run(folder.path(), arguments));
    said_of(&["simulate", "rig.toml", "-o", "presses.csv", "--seed", "5"]);
    said_of(&["fit", "rig.toml", "-o", "digit.json"]);

    let lines = said_of(&["locate", "digit.json", "presses.csv", "--json", "--shape", "25"]);
    let estimates: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(estimates.len(), 48);
    // The last position is 117.5 mm, pressed with 4 N.
    let last = &estimates[47];
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(
        (number(&last["x_mm"]) - 117.5).abs() < 0.1 && (number(&last["force_n"]) - 4.0).abs() < 0.01,
        "{last}"
    );
    assert_eq!(last["status"], "located");
    let shape = last["shape"].as_array().unwrap();
    assert_eq!(shape.len(), 25);
    let tip = &shape[24];
    assert!(
        (number(&tip["x_mm"]) - TIP_MM.0).abs() < 0.05 && (number(&tip["y_mm"]) - TIP_MM.1).abs() < 0.05,
        "{tip}"
    );
    assert!(number(&tip["sd_mm"]) < 0.05 && number(&tip["sd_mm"]) > 0.001, "{tip}");

    let judged = json(
        folder.path(),
        &["evaluate", "digit.json", "--data", "presses.csv", "--portion", "22 mm..120 mm"],
    );
    let mean_mm = number(&judged["errors"][1]["error_mm"]["mean"]);
    assert!(mean_mm < 0.03, "{mean_mm}");

    insta::assert_snapshot!(said_of(&["inspect", "rig.toml"]));
}

/// Position of the tip in mm when 4 N push at 117.5 mm, by Runge–Kutta steps of the elastica's equation.
const TIP_MM: (f64, f64) = (74.64, -82.86);

#[test]
fn limit_and_report_support_the_bent_finger() {
    let folder = folder(DIGIT);
    let found = json(
        folder.path(),
        &["limit", "rig.toml", "--force", "4 N", "--every", "30 mm", "--report", "report"],
    );
    let positions = found["positions"].as_array().unwrap();
    let at = |i: usize, key: &str| positions[i][key].as_f64().unwrap();
    assert_eq!(at(2, "x_mm").round(), 90.0);
    assert!((at(2, "unknown_force_mm") - 0.03).abs() < 0.02 && at(2, "force_sd_n") < 0.005);
    // Between the first gauges one gauge sees the contact, which blinds this bench for an unknown force.
    assert_eq!(found["warnings"][0]["kind"], "blind");
    let page = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    for words in
        ["The finger, exactly bent", "The least standard deviation of an estimated force", "linear theory"]
    {
        assert!(page.contains(words), "{words}");
    }
    assert!(folder.path().join("report/figure-5.svg").exists());
}

#[test]
fn the_digit_estimator_is_compared_and_the_shape_is_its_own() {
    let folder = folder(DIGIT);
    let found = json(
        folder.path(),
        &["compare", "rig.toml", "--only", "digit", "--only", "influence", "--calibrations", "1"],
    );
    let estimators = found["estimators"].as_array().unwrap();
    assert_eq!(estimators[0]["name"], "digit");
    let ratio = estimators[0]["limit_ratio"].as_f64().unwrap();
    assert!((0.8..1.2).contains(&ratio), "{ratio}");

    let beam = Toml::parse(PAPER).estimator("closed-form").to_string();
    fs::write(folder.path().join("paper.toml"), beam).unwrap();
    said(&run(folder.path(), &["fit", "paper.toml", "-o", "beam.json"]));
    let refused =
        complained(&run(folder.path(), &["locate", "beam.json", "x.csv", "--json", "--shape", "9"]), 2);
    assert!(refused.contains("does not estimate the shape"), "{refused}");
}
