//! `palpate compare`, and fitting with every estimator, from outside.

use crate::support::command::{complained, folder, run, said};
use crate::support::examples::{EFLESH, NOISY_BEAM};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Writes the same rig with another estimator, `other.toml`.
fn with_estimator(folder: &Path, kind: &str) {
    let rig = fs::read_to_string(folder.join("rig.toml")).unwrap();
    fs::write(folder.join("other.toml"), Toml::parse(&rig).estimator(kind).to_string()).unwrap();
}

#[test]
fn every_estimator_is_compared_with_the_limit() {
    // The paper's network takes its time; a short training will do.
    let folder = folder(Toml::parse(NOISY_BEAM).estimator("network").add("estimator.max_epochs", 5_000));
    let arguments = ["compare", "rig.toml", "--json", "--report", "report", "--calibrations", "2"];
    let found: Value = serde_json::from_str(&said(&run(folder.path(), &arguments))).unwrap();
    let estimators = found["estimators"].as_array().unwrap();
    let mut names: Vec<&str> = estimators.iter().map(|row| row["name"].as_str().unwrap()).collect();
    let means: Vec<f64> = estimators.iter().map(|row| row["error_mm"]["mean"].as_f64().unwrap()).collect();
    assert!(means.is_sorted(), "{means:?}");
    names.sort_unstable();
    let all =
        ["centroid", "closed-form", "gaussian-process", "influence", "neighbours", "network", "network-lm"];
    assert_eq!(names, all);
    for row in estimators {
        for key in ["mean", "median", "p95", "rmse", "max"] {
            assert!(row["error_mm"][key].as_f64().unwrap() > 0.0, "{row}");
        }
        assert!((0.0..=100.0).contains(&row["effective_percent"].as_f64().unwrap()), "{row}");
        assert!(row["limit_ratio"].as_f64().unwrap() > 0.9, "{row}");
        assert!(
            row["fit_seconds"].as_f64().unwrap() > 0.0 && row["locate_ns"].as_f64().unwrap() > 0.0,
            "{row}"
        );
    }
    let influence = estimators.iter().find(|row| row["name"] == "influence").unwrap();
    assert!(influence["limit_ratio"].as_f64().unwrap() < 1.2, "{influence}");
    assert!((92.0..98.0).contains(&influence["coverage_95"].as_f64().unwrap()), "{influence}");
    let report = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    assert!(all.iter().all(|name| report.contains(name)));
}

#[test]
fn only_requested_estimators_are_compared() {
    let folder = folder(NOISY_BEAM);
    let arguments = ["compare", "rig.toml", "--json", "--only", "influence", "--only", "closed-form"];
    let found: Value = serde_json::from_str(&said(&run(folder.path(), &arguments))).unwrap();
    assert_eq!(found["estimators"].as_array().unwrap().len(), 2);
    let complaint = complained(&run(folder.path(), &["compare", "rig.toml", "--only", "oracle"]), 2);
    insta::assert_snapshot!(complaint);
}

#[test]
fn every_estimator_is_fitted_inspected_and_locates() {
    let folder = folder(NOISY_BEAM);
    said(&run(folder.path(), &["simulate", "rig.toml", "-o", "presses.csv", "--every", "50 mm"]));
    let mut words = Vec::new();
    for kind in ["influence", "closed-form", "gaussian-process", "network-lm", "neighbours", "centroid"] {
        with_estimator(folder.path(), kind);
        said(&run(folder.path(), &["fit", "other.toml", "-o", "locator.json"]));
        let inspected = said(&run(folder.path(), &["inspect", "locator.json"]));
        let described =
            inspected.lines().find(|line| !line.starts_with("a locator") && !line.contains(": beam"));
        assert!(described.is_some() && inspected.contains(kind), "{inspected}");
        let judged = ["evaluate", "locator.json", "--data", "presses.csv", "--json"];
        let found: Value = serde_json::from_str(&said(&run(folder.path(), &judged))).unwrap();
        let mean_mm = found["errors"][0]["error_mm"]["mean"].as_f64().unwrap();
        let bound_mm = match kind {
            "influence" | "closed-form" => 1.0,
            "network-lm" => 10.0,
            // Ten positions are little for these.
            _ => 100.0,
        };
        assert!(mean_mm < bound_mm, "{kind}: {mean_mm}");
        words.push(inspected.lines().skip(4).take(1).collect::<String>());
    }
    // What counts and rounds differ by is not the snapshot's business.
    let words = words.join("\n").replace(|c: char| c.is_ascii_digit(), "#");
    insta::assert_snapshot!(words);
}

#[test]
fn auto_chooses_the_best_and_gives_the_reason() {
    // Networks take their time; two presses at each of six positions do.
    let folder = folder(Toml::parse(NOISY_BEAM).set("training.count", 6).set("training.repeats", 2));
    with_estimator(folder.path(), "auto");
    let fitted = run(folder.path(), &["fit", "other.toml", "-o", "locator.json"]);
    let told = String::from_utf8(fitted.stderr.clone()).unwrap();
    let (cost, why) = told.split_once('\n').unwrap();
    assert!(cost.starts_with("auto: the fit will take at most some "), "{told}");
    let rows: Vec<Vec<&str>> = why.lines().skip(2).map(|line| line.split_whitespace().collect()).collect();
    let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
    let scores: Vec<f64> = rows.iter().map(|row| number(row, 1) * number(row, 3)).collect();
    assert!(rows.len() == 7 && scores.is_sorted_by(|a, b| a <= &(b * 1.001)), "{why}");
    let (best, error_mm) = (rows[0][0], number(&rows[0], 1));
    assert!(["influence", "closed-form"].contains(&best) && error_mm < 0.3, "{why}");
    assert!(why.starts_with(&format!("chosen: {best}, by mean error × interval score")), "{why}");
    assert!(said(&fitted).starts_with(&format!("{best} fitted to 12 rows")), "{why}");
}

#[test]
fn auto_stops_when_its_time_is_used_up() {
    let folder = folder(Toml::parse(NOISY_BEAM).set("training.repeats", 2));
    with_estimator(folder.path(), "auto");
    let late = run(folder.path(), &["fit", "other.toml", "-o", "locator.json", "--time-limit", "1 us"]);
    let why = String::from_utf8(late.stderr.clone()).unwrap();
    assert!(why.contains("no estimator was done within the 0.000001 s that the choice may take"), "{why}");
    assert!(!late.status.success() && !folder.path().join("locator.json").exists(), "{why}");
    let refused = run(folder.path(), &["fit", "other.toml", "-o", "locator.json", "--time-limit", "-1 s"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn disabled_channel_is_excluded_from_the_sums() {
    let folder = folder(NOISY_BEAM);
    with_estimator(folder.path(), "influence");
    said(&run(folder.path(), &["fit", "other.toml", "-o", "locator.json"]));
    said(&run(folder.path(), &["simulate", "other.toml", "-o", "presses.csv", "--every", "100 mm"]));
    let csv = fs::read_to_string(folder.path().join("presses.csv")).unwrap();
    let (mut positions_mm, mut stuck) = (Vec::new(), Vec::new());
    for line in csv.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())) {
        let mut cells: Vec<&str> = line.split(',').collect();
        positions_mm.push(cells[0].parse::<f64>().unwrap());
        // Position and force come first; the third sensor is stuck.
        cells[4] = "5";
        stuck.push(cells[2..].join(","));
    }
    assert_eq!(positions_mm.len(), 30);
    fs::write(folder.path().join("stuck.csv"), stuck.join("\n")).unwrap();
    let located = said(&run(folder.path(), &["locate", "locator.json", "stuck.csv", "--no-header"]));
    assert!(located.lines().skip(1).all(|line| line.ends_with("outside_model")), "{located}");
    let arguments = ["locate", "locator.json", "stuck.csv", "--no-header", "--disable", "3"];
    let located = said(&run(folder.path(), &arguments));
    for (line, x_mm) in located.lines().skip(1).zip(positions_mm) {
        let cells: Vec<&str> = line.split(',').collect();
        assert!(
            (cells[1].parse::<f64>().unwrap() - x_mm).abs() < 4.0 && cells.last() == Some(&"located"),
            "{line}"
        );
    }
    complained(
        &run(folder.path(), &["locate", "locator.json", "stuck.csv", "--no-header", "--disable", "9"]),
        2,
    );
}

#[test]
fn rigs_and_recordings_that_cannot_be_compared_are_refused() {
    let folder = folder(NOISY_BEAM);
    with_estimator(folder.path(), "influence");
    let contacts = complained(&run(folder.path(), &["compare", "rig.toml", "--contacts", "a.csv"]), 2);
    assert!(contacts.contains("--data"), "{contacts}");
    fs::write(folder.path().join("measured.toml"), EFLESH).unwrap();
    let no_model = complained(&run(folder.path(), &["compare", "measured.toml"]), 2);
    let no_contacts =
        ["fit", "measured.toml", "--data", "readings.csv", "--contacts", "none.csv", "-o", "l.json"];
    fs::write(folder.path().join("readings.csv"), format!("0{}\n", ",1".repeat(15))).unwrap();
    let no_contacts = complained(&run(folder.path(), &no_contacts), 2);
    fs::write(folder.path().join("contacts.csv"), "0,274,-115,1\n1,275,-115,1\n").unwrap();
    let odd =
        ["fit", "measured.toml", "--data", "readings.csv", "--contacts", "contacts.csv", "-o", "l.json"];
    let odd = complained(&run(folder.path(), &odd), 2);
    insta::assert_snapshot!([no_model, no_contacts, odd].join("\n"));
}

#[test]
fn tables_stand_beside_the_reports() {
    let folder = folder(crate::support::examples::PAPER);
    let compare =
        ["compare", "rig.toml", "--only", "influence", "--only", "closed-form", "--calibrations", "2"];
    said(&run(folder.path(), &[&compare[..], &["--report", "page"]].concat()));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(folder.path(), &["evaluate", "locator.json", "--report", "page2"]));
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let rows = |name: &str| -> Vec<Vec<String>> {
        read(name).lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
    };
    assert!(
        read("page/errors.csv")
            .starts_with("# palpate 0.1.0, estimators compared on rig.toml, 2 simulated calibrations")
    );
    let figures = "readings,mean_error_mm,median_error_mm,p95_error_mm,rms_error_mm,max_error_mm,covered_percent,\
                   mean_force_error_n,force_covered_percent";
    let (errors, trials) = (rows("page/errors.csv"), rows("page/trials.csv"));
    assert_eq!(errors[0].join(","), format!("estimator,position_mm,{figures}"));
    assert_eq!(trials[0].join(","), format!("estimator,trial,{figures}"));
    assert_eq!((errors.len(), trials.len()), (1 + 2 * 399, 1 + 2 * 2));
    assert_eq!(errors[1][1..3], ["1", "2"]);
    // The mean over the positions is that over the trials.
    let mean = |rows: &[Vec<String>], column: usize| {
        let own = rows.iter().filter(|row| row[0] == "influence");
        let errors: Vec<f64> = own.map(|row| row[column].parse().unwrap()).collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    };
    assert!((mean(&errors, 3) / mean(&trials, 3) - 1.0).abs() < 1e-6);
    let evaluated = rows("page2/errors.csv");
    assert_eq!((evaluated[0].join(","), evaluated.len()), (format!("position_mm,{figures}"), 400));
}
