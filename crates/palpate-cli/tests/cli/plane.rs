//! The plate of `examples/plate.toml` from outside: every verb that has two coordinates.

use crate::support::command::{complained, folder, json, palpate, run, said};
use crate::support::examples::PLATE;
use crate::support::toml::Toml;
use std::fs;
use std::path::Path;
use toml_edit::Array;

/// The plate with a coarse mesh and at 16 places: at 19 a fit would check its intervals, which takes forty times as long.
fn coarse_plate() -> Toml {
    let rig = Toml::parse(PLATE).set("training.grid", Array::from_iter([4, 4]));
    rig.add("surface.elements", 48)
}

/// Names of the files of a report.
fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn the_limit_of_the_plate_is_a_table_and_a_map() {
    let folder = folder(PLATE);
    let words = said(&run(folder.path(), &["limit", "rig.toml", "--report", "report"]));
    insta::assert_snapshot!(words);
    let mut written = files(&folder.path().join("report"));
    written.retain(|name| !name.ends_with(".png"));
    assert_eq!(written, ["figure-1.svg", "limit.csv", "report.html"]);
    let found = json(folder.path(), &["limit", "rig.toml", "--every", "50 mm"]);
    assert_eq!(found["positions"].as_array().unwrap().len(), 25);
}

#[test]
fn every_estimator_runs_on_the_plate() {
    let folder = folder(PLATE);
    let all = ["influence", "gaussian-process", "neighbours", "centroid", "network-lm"];
    let mut arguments = vec!["compare", "rig.toml", "--calibrations", "1", "--report", "report"];
    all.iter().for_each(|kind| arguments.extend(["--only", *kind]));
    let found = json(folder.path(), &arguments);
    assert_eq!(found["readings"], 400);
    let estimators = found["estimators"].as_array().unwrap();
    assert_eq!(estimators.len(), all.len(), "{found:#}");
    let best = &estimators[0];
    assert_eq!(best["name"], "influence");
    assert!(best["limit_ratio"].as_f64().unwrap() < 1.2, "{best}");
    assert!((85.0..=99.0).contains(&best["coverage_95"].as_f64().unwrap()), "{best}");
    let report = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    assert!(all.iter().all(|name| report.contains(name)) && report.contains("Errors over the surface"));
}

#[test]
fn a_plate_is_simulated_fitted_located_and_evaluated() {
    let folder = folder(coarse_plate());
    let path = folder.path();
    said(&run(path, &["simulate", "rig.toml", "--every", "60 mm", "-o", "presses.csv"]));
    let recording = fs::read_to_string(path.join("presses.csv")).unwrap();
    assert_eq!(recording.lines().filter(|line| !line.starts_with('#')).count(), 1 + 16 * 5);
    said(&run(path, &["fit", "rig.toml", "-o", "plate.locator"]));
    let inspected = said(&run(path, &["inspect", "plate.locator"]));
    assert!(inspected.contains("influence functions of 9 sensors at 49 × 49 nodes"), "{inspected}");
    let rig = said(&run(path, &["inspect", "rig.toml"]));
    assert!(rig.contains("training positions: 16, a grid of 4 × 4, 5 × each"), "{rig}");
    assert!(rig.contains("deflection at 75 mm, 75 mm; deflection at 150 mm, 75 mm"), "{rig}");

    let located = said(&palpate(path).args(["locate", "plate.locator", "presses.csv"]).output().unwrap());
    let mut lines = located.lines();
    assert_eq!(
        lines.next(),
        Some(
            "line,x_mm,y_mm,force_n,x_low_mm,x_high_mm,y_low_mm,y_high_mm,force_low_n,force_high_n,trade_off,status"
        )
    );
    let first: Vec<&str> = lines.next().unwrap().split(',').collect();
    let [x_mm, y_mm] = [first[1], first[2]].map(|cell| cell.parse::<f64>().unwrap());
    assert!((x_mm - 60.0).abs() < 5.0 && (y_mm - 60.0).abs() < 5.0 && first[11] == "located", "{first:?}");

    let arguments = ["evaluate", "plate.locator", "--data", "presses.csv", "--report", "report"];
    let words = said(&run(path, &arguments));
    assert!(words.contains("effective area: "), "{words}");
    assert!(files(&path.join("report")).contains(&"figure-1.svg".to_owned()));
    let found = json(path, &arguments);
    assert!(found["errors"][0]["error_mm"]["median"].as_f64().unwrap() < 2.5, "{found:#}");
    let crossed = json(path, &["evaluate", "rig.toml"]);
    assert_eq!(crossed["errors"][0]["count"], 80);
}

#[test]
fn the_papers_network_learns_the_plate_a_little() {
    let folder = folder(coarse_plate().estimator("network").add("estimator.max_epochs", 300));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "network.locator"]));
    let found = json(folder.path(), &["evaluate", "network.locator"]);
    // Better than the middle of the plate, which is 115 mm off on average.
    assert!(found["errors"][0]["error_mm"]["mean"].as_f64().unwrap() < 60.0, "{found:#}");
}

#[test]
fn count_on_a_plane_needs_positions() {
    let folder = folder(Toml::parse(PLATE).remove("sensors.grid").add("sensors.count", 9));
    let refused = complained(&run(folder.path(), &["inspect", "rig.toml"]), 2);
    assert!(refused.contains("`count` does not go with a plane"), "{refused}");
}
