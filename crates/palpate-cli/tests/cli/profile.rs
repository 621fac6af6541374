//! `palpate profile` from outside: loads that are simulated, and readings that are read.

use crate::support::command::{complained, folder, run, said};
use crate::support::examples::{LOAD_PROFILE, PRESSURE_MAP};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;

/// Sections that the example lacks for presses at points.
const PRESSED: &str = "\n[training]\ncount = 2\nrepeats = 5\nforce = \"3 N\"\n[estimator]\nkind = \"influence\"\nsource = \"mechanics\"\n";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn example_resolves_both_pads() {
    let folder = folder(LOAD_PROFILE);
    let json =
        said(&run(folder.path(), &["profile", "rig.toml", "--json", "--seed", "1", "--report", "page"]));
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
    let page = fs::read_to_string(folder.path().join("page/report.html")).unwrap();
    assert!(page.contains("figure-4") && page.contains("true load") && !page.contains("http://palpate"));
    assert!(
        page.contains("from rig.toml, simulated with seed 1."),
        "the page does not say what it was made from"
    );
}

#[test]
fn the_pressure_on_a_plate_is_a_map() {
    let folder = folder(Toml::parse(PRESSURE_MAP).add("surface.elements", 32));
    let told = said(&run(folder.path(), &["profile", "rig.toml"]));
    assert!(told.contains("across") && told.contains("centre y, mm"), "{told}");
    let json = said(&run(folder.path(), &["profile", "rig.toml", "--json", "--report", "page"]));
    let found: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(found["status"], "located");
    assert!((number(&found["total_n"]["value"]) / 10.0 - 1.0).abs() < 0.02, "{}", found["total_n"]);
    let (patches, loads) = (found["patches"].as_array().unwrap(), found["loads"].as_array().unwrap());
    assert_eq!(patches.len(), 2);
    for (patch, load) in patches.iter().zip(loads) {
        for (centre, limit) in [("centre_x_mm", "limit_x_mm"), ("centre_y_mm", "limit_y_mm")] {
            let off_mm = number(&patch[centre]["value"]) - number(&load[centre]);
            assert!(off_mm.abs() < 3.0 * number(&load[limit]), "{centre}: off by {off_mm} mm");
        }
    }
    let page = fs::read_to_string(folder.path().join("page/report.html")).unwrap();
    assert!(page.contains("kPa") && page.contains("simulated") && page.contains("figure-4"));
}

#[test]
fn people_get_a_table() {
    insta::assert_snapshot!(said(&run(folder(LOAD_PROFILE).path(), &["profile", "rig.toml"])));
}

#[test]
fn readings_are_printed_as_they_arrive() {
    let folder = folder(Toml::parse(LOAD_PROFILE).remove("load").to_string() + PRESSED);
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
        assert_eq!(told.len(), 12);
        assert!(told[10]["skipped"].is_string(), "{}", told[10]);
        for (i, found) in told[..10].iter().enumerate() {
            let truth_mm = if i < 5 { 150.0 } else { 300.0 };
            assert_eq!(found["status"], "located", "{subject}");
            assert!((number(&found["centre_x_mm"]["value"]) - truth_mm).abs() < 3.0, "{subject}: {found}");
            assert!((number(&found["total_n"]["value"]) - 3.0).abs() < 0.06, "{subject}: {found}");
        }
        assert_eq!(told[11]["status"], "outside_model");
    }
}

#[test]
fn invalid_profile_requests_are_refused() {
    let unloaded = Toml::parse(LOAD_PROFILE).remove("load").to_string();
    let clean = Toml::parse(LOAD_PROFILE).set("sensors.0.noise", "0 um").to_string();
    let cases: [(&str, &str, &[&str]); 3] = [
        ("nothing to simulate", &unloaded, &[]),
        ("clean sensors", &clean, &[]),
        ("a file that is not there", LOAD_PROFILE, &["nowhere.csv"]),
    ];
    let complaint = |(what, rig, arguments): &(&str, &str, &[&str])| {
        let arguments = [&["profile", "rig.toml"], *arguments].concat();
        format!("{what}:\n{}", complained(&run(folder(rig).path(), &arguments), 2))
    };
    insta::assert_snapshot!(cases.iter().map(complaint).collect::<Vec<_>>().join("\n"));
}

#[test]
fn total_without_an_upper_bound_is_printed_as_such() {
    let bench = LOAD_PROFILE.split("[[load]]").next().unwrap();
    let folder = folder(format!("{bench}[[load]]\nfrom = \"2 mm\"\nto = \"6 mm\"\nforce = \"0.2 N\"\n"));
    let told = said(&run(folder.path(), &["profile", "rig.toml"]));
    assert!(told.contains(" N or more if no load lies within") && !told.contains("inf"), "{told}");
}
