//! Beams on any supports, through every command.

use crate::support::command::{complained, folder, json, run, said};
use crate::support::examples::{CANTILEVER, CONTINUOUS_BEAM};
use crate::support::toml::{Toml, replaced};
use std::fmt::Display;
use std::fs;

/// The rig without its known force: the presses that calibrate keep it.
fn unknown_force(rig: &str) -> Toml {
    let mut rig = Toml::parse(rig);
    let force = rig.text_at("contact.force");
    rig.remove("contact").add("training.force", force)
}

/// The influence estimator's mean error over the limit's, with this rig.
fn limit_ratio(rig: impl Display) -> f64 {
    let found =
        json(folder(rig).path(), &["compare", "rig.toml", "--only", "influence", "--calibrations", "2"]);
    found["estimators"][0]["limit_ratio"].as_f64().unwrap()
}

#[test]
fn the_cantilever_is_located_at_the_limit() {
    let known = limit_ratio(CANTILEVER);
    assert!((0.9..1.1).contains(&known), "{known}");
}

#[test]
fn the_cantilever_is_located_at_the_limit_with_an_unknown_force_too() {
    let folder = folder(unknown_force(CANTILEVER));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(
        folder.path(),
        &["simulate", "rig.toml", "-o", "presses.csv", "--every", "1 mm", "--seed", "1"],
    ));
    // Nearer to the clamp the force cannot be told from the position.
    let portion = ["--portion", "60 mm..295 mm"];
    let judged = [&["evaluate", "locator.json", "--data", "presses.csv"], portion.as_slice()].concat();
    let found = json(folder.path(), &judged);
    let mean_mm = found["errors"][1]["error_mm"]["mean"].as_f64().unwrap();
    let limits = json(folder.path(), &["limit", "rig.toml", "--force", "0.5 N", "--every", "5 mm"]);
    let inner =
        limits["positions"].as_array().unwrap().iter().filter(|at| at["x_mm"].as_f64().unwrap() > 59.0);
    let sds: Vec<f64> = inner.map(|at| at["unknown_force_mm"].as_f64().unwrap()).collect();
    let limit_mm = (2.0 / std::f64::consts::PI).sqrt() * sds.iter().sum::<f64>() / sds.len() as f64;
    assert!((0.9..1.1).contains(&(mean_mm / limit_mm)), "{mean_mm} beside {limit_mm}");
}

#[test]
fn the_continuous_beam_is_located_at_the_limit() {
    let known = limit_ratio(CONTINUOUS_BEAM);
    assert!((0.9..1.1).contains(&known), "{known}");
    let unknown = limit_ratio(unknown_force(CONTINUOUS_BEAM));
    assert!((0.9..1.1).contains(&unknown), "{unknown}");
    let from_recording = limit_ratio(Toml::parse(CONTINUOUS_BEAM).add("estimator.source", "recording"));
    assert!((0.9..1.2).contains(&from_recording), "{from_recording}");
}

#[test]
fn the_limit_of_the_cantilever_is_that_of_its_clamp() {
    let found = json(folder(CANTILEVER).path(), &["limit", "rig.toml", "--report", "report"]);
    let median_mm = found["known_force"]["median_mm"].as_f64().unwrap();
    assert!((median_mm - 0.284).abs() < 1e-3, "{median_mm}");
    // A clamp that holds the beam alone takes up the whole force, wherever that acts.
    let blind = &found["warnings"][0];
    assert!(blind["kind"] == "blind" && !blind["help"].as_str().unwrap().contains("reaction"), "{blind}");
}

#[test]
fn contact_over_a_rigid_support_is_reported_undetectable() {
    let folder = folder(Toml::parse(CONTINUOUS_BEAM).remove("sensors.1"));
    let found = said(&run(folder.path(), &["limit", "rig.toml"]));
    let faint: Vec<&str> = found.lines().filter(|line| line.contains("faint")).collect();
    assert!(faint.iter().any(|line| line.contains("500 mm")), "{found}");
    assert!(
        found.contains("reaction sensors at the supports; less noise or a larger force does not help"),
        "{found}"
    );
}

#[test]
fn every_estimator_but_the_closed_form_works_on_it() {
    // At fewer than 19 places no fit checks its intervals.
    let rig = Toml::parse(CONTINUOUS_BEAM).set("training.count", 15).set("training.repeats", 5).to_string();
    let folder = folder(&rig);
    said(&run(folder.path(), &["simulate", "rig.toml", "-o", "presses.csv", "--every", "25 mm"]));
    for kind in ["influence", "gaussian-process", "network-lm", "neighbours", "centroid"] {
        let other = Toml::parse(&rig).estimator(kind).to_string();
        fs::write(folder.path().join("other.toml"), other).unwrap();
        said(&run(folder.path(), &["fit", "other.toml", "-o", "locator.json"]));
        let inspected = said(&run(folder.path(), &["inspect", "locator.json"]));
        assert!(
            inspected.contains("simple at 0 mm, elastic (2 N/mm) at 280 mm, simple at 500 mm"),
            "{inspected}"
        );
        let found = json(folder.path(), &["evaluate", "locator.json", "--data", "presses.csv"]);
        let mean_mm = found["errors"][0]["error_mm"]["mean"].as_f64().unwrap();
        let bound_mm = if kind == "influence" { 1.0 } else { 150.0 };
        assert!(mean_mm < bound_mm, "{kind}: {mean_mm}");
    }
    let simple = Toml::parse(&rig).estimator("closed-form").to_string();
    fs::write(folder.path().join("other.toml"), simple).unwrap();
    let refused = complained(&run(folder.path(), &["fit", "other.toml", "-o", "refused.json"]), 2);
    assert!(refused.contains("two simple supports"), "{refused}");
    let left_out = complained(&run(folder.path(), &["compare", "rig.toml", "--only", "closed-form"]), 2);
    assert!(left_out.contains("no estimator of this kind suits the rig"), "{left_out}");
}

#[test]
fn a_locator_file_with_a_beam_that_cannot_be_is_refused() {
    let folder = folder(CANTILEVER);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let file = fs::read_to_string(folder.path().join("locator.json")).unwrap();
    fs::write(folder.path().join("bad.json"), replaced(&file, "\"clamped\"", "\"simple\"")).unwrap();
    let refused = complained(&run(folder.path(), &["inspect", "bad.json"]), 2);
    assert!(refused.contains("the beam is a mechanism"), "{refused}");
}
