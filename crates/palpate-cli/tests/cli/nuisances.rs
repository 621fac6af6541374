//! Recordings with several nuisance coordinates, from outside.

use crate::support::command::{complained, run, said};
use std::fs;

const RIG: &str = r#"[surface]
kind = "measured"
length = "100 mm"

[sensors]
measure = "raw"
count = 4

[recording]
position = "X"
position_unit = "mm"
channels = ["a", "b", "c", "d"]
nuisance = ["depth", "temperature"]
nuisance_unit = ["mm", ""]

[estimator]
kind = "influence"
"#;

/// Presses at 16 places to 4 depths, at temperatures that move the channels by different ways.
fn presses() -> String {
    let mut csv = "X,depth,temperature,a,b,c,d\n".to_owned();
    for i in 0..64_i32 {
        let (x_mm, depth_mm) = (f64::from(i % 16) * 100.0 / 15.0, 1.0 + f64::from(i / 16) / 3.0);
        let temperature = f64::from((29 * i) % 61) / 20.0 - 1.5;
        let shifts = [0.3, -0.2, 0.25, -0.3];
        let reading = (0..4).zip(shifts).map(|(c, shift)| {
            let bump = (-((x_mm / 100.0 - f64::from(c) / 3.0) / 0.35).powi(2)).exp();
            let noise = f64::from((37 * i + 11 * c) % 23 - 11) / 250.0;
            format!("{:.4}", 3.0 * depth_mm * bump + shift * temperature + noise)
        });
        let reading = reading.collect::<Vec<_>>().join(",");
        csv += &format!("{x_mm},{depth_mm},{temperature},{reading}\n");
    }
    csv
}

#[test]
fn depth_and_temperature_are_fitted_located_and_evaluated() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    fs::write(folder.path().join("presses.csv"), presses()).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"]));
    let inspected = said(&run(folder.path(), &["inspect", "board.json"]));
    assert!(inspected.contains("position and the nuisance coordinate"), "{inspected}");
    let located = said(&run(folder.path(), &["locate", "board.json", "presses.csv"]));
    assert_eq!(located.lines().count(), 65, "{located}");
    let x_mm: Vec<f64> =
        located.lines().skip(1).map(|line| line.split(',').nth(1).unwrap().parse().unwrap()).collect();
    let error_mm = |(i, x_mm): (usize, &f64)| (x_mm - (i % 16) as f64 * 100.0 / 15.0).abs();
    let mean_mm = x_mm.iter().enumerate().map(error_mm).sum::<f64>() / 64.0;
    assert!(mean_mm < 3.0, "{mean_mm} mm\n{located}");
    let judged = said(&run(folder.path(), &["evaluate", "rig.toml", "--data", "presses.csv"]));
    assert!(judged.contains("effective: 100.0 %"), "{judged}");
    let advised = run(folder.path(), &["design", "positions", "rig.toml", "--data", "presses.csv"]);
    said(&advised);
    let warned = String::from_utf8_lossy(&advised.stderr);
    assert!(warned.contains("warning: what the nuisance coordinate changes counts as noise"), "{warned}");
}

#[test]
fn bad_lists_and_cells_are_refused_at_the_place() {
    let refused = |what: &str, from: &str, to: &str, csv: &str| {
        let folder = tempfile::tempdir().unwrap();
        assert!(RIG.contains(from), "{from}");
        fs::write(folder.path().join("rig.toml"), RIG.replace(from, to)).unwrap();
        fs::write(folder.path().join("presses.csv"), csv).unwrap();
        let fit = ["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"];
        let complaint = complained(&run(folder.path(), &fit), 2);
        assert!(!folder.path().join("board.json").exists());
        format!("{what}:\n{complaint}")
    };
    let (names, units) = ("[\"depth\", \"temperature\"]", "[\"mm\", \"\"]");
    let good = presses();
    let messages = [
        refused("an empty list", names, "[]", &good),
        refused("a name twice", names, "[\"depth\", \"depth\"]", &good),
        refused("units of another length", units, "[\"mm\"]", &good),
        refused("one unit for two", units, "\"mm\"", &good),
        refused("an unknown unit", units, "[\"mm\", \"furlong\"]", &good),
        refused("units alone", &format!("nuisance = {names}\n"), "", &good),
        refused("no column", names, "[\"depth\", \"humidity\"]", &good),
        refused("neither name nor number in a list", names, "[\"depth\", true]", &good),
        refused("a missing cell", names, names, "X,depth,temperature,a,b,c,d\n1,2,,4,5,6,7\n"),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}
