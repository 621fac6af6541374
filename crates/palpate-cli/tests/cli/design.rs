//! `palpate design sensors` from outside: layouts against the even one, the rig with the best, and what is refused.

use crate::support::command::{complained, folder, json, run, said};
use crate::support::examples::{FSI_WATER, PAPER, PLATE, SENSOR_DESIGN};
use crate::support::toml::{Toml, replaced};
use serde_json::Value;
use std::fmt::Display;
use std::fs;

fn design(rig: impl Display, arguments: &[&str]) -> String {
    said(&run(folder(rig).path(), &[&["design", "sensors", "rig.toml"], arguments].concat()))
}

fn designs(rig: &str, arguments: &[&str]) -> Value {
    json(folder(rig).path(), &[&["design", "sensors", "rig.toml"], arguments].concat())
}

/// The example with other keys in its [design].
fn rig_with(keys: &str) -> String {
    format!("{SENSOR_DESIGN}\n{keys}\n")
}

#[test]
fn people_get_a_table_of_layouts_and_a_curve_of_counts() {
    let told = design(SENSOR_DESIGN, &["--counts", "2..4"]);
    let lines: Vec<&str> = told.lines().collect();
    assert!(
        lines[0].starts_with("rig.toml: 8 of 79 candidate sensors, 73 contacts, 3 N, force unknown"),
        "{told}"
    );
    let row = |name: &str| lines.iter().find(|line| line.starts_with(name)).copied().unwrap_or_default();
    assert_eq!(
        row("even ").split_whitespace().collect::<Vec<_>>(),
        ["even", "2.628", "2.641", "20.646", "72.6", "3.457"]
    );
    for name in
        ["greedy-exchange ", "genetic ", "refined ", "d-optimal ", "principal-components ", "qr-pivoting "]
    {
        assert_eq!(row(name).split_whitespace().count(), 6, "{name}: {told}");
    }
    assert!(row("Best: ").contains("below the even layout's 2.641 mm"), "{told}");
    assert_eq!(row("2 ").split_whitespace().nth(2), Some("10.194"), "{told}");
}

#[test]
fn the_json_has_the_designs() {
    let found = designs(SENSOR_DESIGN, &[]);
    let designs = found["designs"].as_array().unwrap();
    let of = |method: &str| designs.iter().find(|design| design["method"] == method).unwrap();
    let number = |design: &Value, key: &str| design[key].as_f64().unwrap();
    let (even, best) = (of("even"), of("greedy-exchange"));
    assert!((number(even, "mean_limit_mm") - 2.64).abs() < 0.005, "{even}");
    assert!(number(best, "mean_limit_mm") < 0.82 * number(even, "mean_limit_mm"), "{best}");
    assert!(number(best, "score") < number(best, "mean_limit_mm"));
    assert!(number(best, "worst_limit_mm") < number(even, "worst_limit_mm"));
    assert!((0.0..=100.0).contains(&number(best, "within_tolerance_percent")));
    assert_eq!(best["positions"].as_array().unwrap().len(), 8);
    assert!(best["positions"][0]["x_mm"].as_f64().unwrap() > 0.0 && best["simulated"].is_null());
    assert_eq!(found["force"], "unknown");
}

#[test]
fn the_best_layout_becomes_a_rig_that_can_be_used() {
    let folder = folder(SENSOR_DESIGN);
    let told = said(&run(folder.path(), &["design", "sensors", "rig.toml", "-o", "designed.toml"]));
    assert!(told.contains("Rig: designed.toml"), "{told}");
    let written = fs::read_to_string(folder.path().join("designed.toml")).unwrap();
    assert!(written.contains("# as they are now") || written.contains("youngs_modulus = \"200 GPa\""));
    assert!(
        written.contains("positions = [") && !written.contains("count = 8                        # evenly")
    );
    let limit = said(&run(folder.path(), &["limit", "designed.toml", "--unknown-force", "--json"]));
    let limit: Value = serde_json::from_str(&limit).unwrap();
    assert_eq!(limit["sensors"], 8);
    said(&run(folder.path(), &["fit", "designed.toml", "-o", "locator.json"]));
}

#[test]
fn a_report_verifies_what_it_claims() {
    // Within 30 mm of the ends, where force and place trade off, the estimator errs less than the limit on any layout.
    let folder = folder(replaced(
        SENSOR_DESIGN,
        "from = \"20 mm\", to = \"380 mm\"",
        "from = \"30 mm\", to = \"370 mm\"",
    ));
    let arguments =
        ["design", "sensors", "rig.toml", "--counts", "2..5", "--report", "deep/report", "--json"];
    let found: Value = serde_json::from_str(&said(&run(folder.path(), &arguments))).unwrap();
    for name in ["report.html", "figure-1.svg", "figure-2.svg", "figure-3.svg", "figure-4.svg"] {
        assert!(folder.path().join("deep/report").join(name).is_file(), "{name}");
    }
    let page = fs::read_to_string(folder.path().join("deep/report/report.html")).unwrap();
    let figures: Vec<_> = (1..=4).map(|number| page.find(&format!("Figure {number}."))).collect();
    assert!(figures.iter().all(Option::is_some) && figures.is_sorted(), "{figures:?}");
    let told: Vec<f64> = found["designs"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|design| design["simulated"]["mean_error_mm"].as_f64())
        .collect();
    assert!(told.len() >= 4, "{told:?}");
    let refined =
        found["designs"].as_array().unwrap().iter().find(|design| design["method"] == "refined").unwrap();
    assert!(refined["simulated"]["mean_error_mm"].as_f64().unwrap() < 0.9 * told[0], "{told:?}");
    assert_eq!(found["counts"].as_array().unwrap().len(), 4);
}

#[test]
fn a_rig_without_a_design_is_designed_too() {
    let found = designs(PAPER, &["--count", "3"]);
    assert_eq!((&found["force"], &found["candidates"]), (&Value::from("known"), &Value::from(399)));
    let methods: Vec<&str> =
        found["designs"].as_array().unwrap().iter().filter_map(|d| d["method"].as_str()).collect();
    assert_eq!(methods[..3], ["even", "existing", "greedy-exchange"]);
    let unknown = designs(PAPER, &["--count", "3", "--unknown-force"]);
    assert_eq!(unknown["force"], "unknown");
}

#[test]
fn a_plate_has_maps() {
    let coarse = Toml::parse(PLATE).add("surface.elements", 24);
    let rig =
        format!("{coarse}\n[design]\nsites = \"50 mm\"\ncontacts = {{ every = \"50 mm\" }}\ncount = 4\n");
    let folder = folder(rig);
    let told =
        said(&run(folder.path(), &["design", "sensors", "rig.toml", "--report", "report", "--verify", "1"]));
    assert!(told.contains("greedy-exchange: deflection (") && told.contains("Report:"), "{told}");
    for name in ["figure-1.svg", "figure-2.svg"] {
        assert!(folder.path().join("report").join(name).is_file(), "{name}");
    }
    let page = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    assert!(page.find("Figure 1.") < page.find("Figure 2.") && page.contains("Figure 1."));
}

#[test]
fn invalid_design_is_refused_with_a_message() {
    let forceless = replaced(SENSOR_DESIGN, "force = \"3 N\"", "");
    let clean = Toml::parse(SENSOR_DESIGN).set("sensors.noise", "0 um").to_string();
    let cases: [(&str, &str, &[&str]); 11] = [
        ("a spacing that leaves no room", &rig_with("spacing = \"60 mm\""), &[]),
        ("a budget too small", &rig_with("budget = 7"), &[]),
        (
            "a zone that leaves too few sites",
            &rig_with("keep_out = [{ from = \"0 mm\", to = \"380 mm\" }]"),
            &[],
        ),
        ("a misspelled key", &rig_with("spacin = \"60 mm\""), &[]),
        ("a must-have off the beam", &rig_with("must_have = [{ at = \"401 mm\" }]"), &[]),
        ("no force", &forceless, &[]),
        ("clean sensors", &clean, &[]),
        ("a surface without a model", FSI_WATER, &[]),
        ("a range that is none", SENSOR_DESIGN, &["--counts", "16..2"]),
        ("no sensors", SENSOR_DESIGN, &["--count", "0"]),
        ("no folder to write to", SENSOR_DESIGN, &["-o", "none/rig.toml"]),
    ];
    let complaint = |(what, rig, arguments): &(&str, &str, &[&str])| {
        let folder = folder(rig);
        let arguments = [&["design", "sensors", "rig.toml", "--report", "report"], *arguments].concat();
        let complaint = complained(&run(folder.path(), &arguments), 2);
        assert!(!folder.path().join("report").exists(), "{what}");
        format!("{what}:\n{complaint}")
    };
    insta::assert_snapshot!(cases.iter().map(complaint).collect::<Vec<_>>().join("\n"));
}

#[test]
fn todays_sensors_are_kept_and_more_are_placed() {
    let folder = folder(SENSOR_DESIGN);
    let told = said(&run(folder.path(), &["design", "sensors", "rig.toml", "--add", "2", "-o", "more.toml"]));
    assert!(told.starts_with("rig.toml: 8 kept and 2 new of 87 candidate sensors"), "{told}");
    let kept = "44.44, 88.89, 133.33, 177.78, 222.22, 266.67, 311.11, 355.56 mm";
    for method in
        ["greedy-exchange", "genetic", "refined", "d-optimal", "principal-components", "qr-pivoting"]
    {
        let places = told.lines().find(|line| line.starts_with(&format!("{method}: "))).unwrap();
        assert!(
            places.contains(": new deflection ") && places.ends_with(&format!("kept deflection {kept}")),
            "{places}"
        );
    }
    let best = told.lines().find(|line| line.starts_with("Best: ")).unwrap();
    assert!(best.contains("below today's 2.641 mm"), "{best}");
    let written = fs::read_to_string(folder.path().join("more.toml")).unwrap();
    assert!(written.contains("\"355.556 mm\", ") && written.contains("] # the last 2 are new"), "{written}");
    let again = json(folder.path(), &["design", "sensors", "more.toml", "--add", "1"]);
    let best =
        again["designs"].as_array().unwrap().iter().find(|design| design["method"] == "refined").unwrap();
    let kept =
        best["positions"].as_array().unwrap().iter().map(|position| position["kept"].as_bool().unwrap());
    assert_eq!(kept.collect::<Vec<_>>(), [vec![true; 10], vec![false]].concat());

    // Another kind beside them.
    let strain = rig_with("kinds = [{ measure = \"strain\", noise = \"1 ue\" }]");
    let strain = designs(&strain, &["--add", "2"]);
    let refined =
        strain["designs"].as_array().unwrap().iter().find(|design| design["method"] == "refined").unwrap();
    let kinds: Vec<&Value> =
        refined["positions"].as_array().unwrap().iter().map(|at| &at["measure"]).collect();
    assert_eq!(kinds[8..], ["strain", "strain"]);
    assert!(kinds[..8].iter().all(|kind| *kind == "deflection"));
}

#[test]
fn additions_that_cannot_be_are_refused_in_words() {
    let cases = [
        ("none", "", "0"),
        ("too many", "", "200"),
        ("too close", "spacing = \"50 mm\"", "1"),
        ("kept out", "keep_out = [{ from = \"30 mm\", to = \"60 mm\" }]", "1"),
        ("another noise", "kinds = [{ measure = \"deflection\", noise = \"1 um\" }]", "1"),
        (
            "one alone in symmetry",
            "symmetry = \"wanted\"\nkeep_out = [{ from = \"190 mm\", to = \"210 mm\" }]",
            "1",
        ),
        ("beyond the budget", "budget = 9", "2"),
    ];
    let complaint = |(what, keys, count): (&str, &str, &str)| {
        let folder = folder(rig_with(keys));
        let complaint =
            complained(&run(folder.path(), &["design", "sensors", "rig.toml", "--add", count]), 2);
        format!("{what}:\n{complaint}")
    };
    insta::assert_snapshot!(cases.map(complaint).join("\n"));
}
