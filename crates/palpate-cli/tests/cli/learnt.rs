//! Structure, drift, scatter and noise of a surface without a model, said by `fit` and `inspect`.

use crate::support::board::{Board, RIG, Touch, linear_rig};
use crate::support::command::{complained, folder, run, said};
use std::fs;

/// A recording of presses at 20 places in which every channel drifts by 3 counts after every sixth press; the forces are recorded with
/// an error of up to a tenth, and one press is recorded at the wrong end.
fn disturbed(board: &mut Board) -> String {
    let mut csv = String::new();
    for i in 0..120 {
        if i % 6 == 5 {
            board.move_steadily(3.0);
        }
        let place_mm = 15.0 + 14.0 * f64::from((7 * i) % 20);
        let force_n = 1.0 + f64::from((3 * i) % 5);
        let pressed = Touch {
            position_mm: if i == 49 { 300.0 - place_mm } else { place_mm },
            force_n: if i % 4 == 0 { 0.0 } else { force_n * (0.9 + 0.2 * board.uniform()) },
        };
        let reading = board.reading(pressed).map(|value| format!("{value:.3}")).join(",");
        let force_n = if i % 4 == 0 { 0.0 } else { force_n };
        if csv.is_empty() {
            csv = "Position,Force,g1,g2,g3,g4,g5,g6\n".to_owned();
        }
        csv += &format!("{place_mm},{force_n},{reading}\n");
    }
    csv
}

#[test]
fn drift_scatter_and_excluded_rows_are_reported() {
    let (folder, mut board) = (folder(RIG), Board::new(11));
    fs::write(folder.path().join("presses.csv"), disturbed(&mut board)).unwrap();
    let fit = ["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"];
    let fitted = said(&run(folder.path(), &fit));
    let inspected = said(&run(folder.path(), &["inspect", "board.json"]));
    let words = inspected.lines().filter(|line| !line.contains("sha256")).collect::<Vec<_>>().join("\n");
    insta::assert_snapshot!(format!("{fitted}\n{words}"));

    let json = |arguments: &[&str]| -> serde_json::Value {
        serde_json::from_str(&said(&run(folder.path(), arguments))).unwrap()
    };
    let of_fit = json(&[&fit[..], &["--json"]].concat());
    let of_locator = json(&["inspect", "board.json", "--json"]);
    assert_eq!(of_fit["learnt"], of_locator["learnt"]);
    assert_eq!(of_locator["says"].as_array().unwrap().len(), inspected.lines().count());
    let learnt = &of_locator["learnt"];
    assert!(learnt["rows_set_aside"].as_array().unwrap().contains(&serde_json::json!(50)), "{learnt}");
    assert_eq!(learnt["drift_course"], "linear");
    let channel = &learnt["channels"][0];
    // 60 counts over the recording; a newton moves the strip by some 30 counts.
    let drift = channel["drift"].as_f64().unwrap();
    assert!((45.0..75.0).contains(&drift), "{learnt}");
    assert!((0.5..15.0).contains(&channel["scatter_sd"].as_f64().unwrap()), "{learnt}");

    let rig = json(&["inspect", "rig.toml", "--json"]);
    assert_eq!((&rig["says"][0], rig.get("learnt")), (&serde_json::json!("a rig"), None));
}

#[test]
fn noise_by_place_is_reported() {
    let (folder, mut board) = (folder(linear_rig()), Board::new(5));
    let mut csv = "Position,Force,g1,g2,g3,g4,g5,g6\n".to_owned();
    for i in 0..120 {
        let touch = Touch {
            position_mm: 15.0 + 15.8 * f64::from((7 * i) % 18),
            force_n: 1.0 + f64::from((3 * i) % 5),
        };
        // Four times the noise on one half: the mean of two readings and three times their difference.
        let [a, b] = [board.reading(touch), board.reading(touch)];
        let times = if touch.position_mm > 150.0 { 2.8 } else { 0.7 };
        let reading = a.iter().zip(&b).map(|(a, b)| format!("{:.3}", 0.5 * (a + b) + times * (a - b)));
        let reading = reading.collect::<Vec<_>>().join(",");
        csv += &format!("{},{},{reading}\n", touch.position_mm, touch.force_n);
    }
    fs::write(folder.path().join("presses.csv"), csv).unwrap();
    let fitted = said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"]));
    let inspected = said(&run(folder.path(), &["inspect", "board.json"]));
    let line = fitted.lines().find(|line| line.starts_with("  noise of contacts")).unwrap().trim();
    assert!(inspected.contains(line), "{inspected}");
    insta::assert_snapshot!(line);
    let json = said(&run(folder.path(), &["inspect", "board.json", "--json"]));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let [least, most] = [0, 1].map(|i| json["learnt"]["noise_by_place"][i]["times"].as_f64().unwrap());
    assert!((2.5..6.0).contains(&(most / least)), "{json}");

    // What a file may have got wrong.
    let text = fs::read_to_string(folder.path().join("board.json")).unwrap();
    let noise = text.find("\"noise_by_place\"").unwrap();
    let bad = text[..noise].to_owned() + &text[noise..].replacen("\"width\": ", "\"width\": -", 1);
    fs::write(folder.path().join("bad.json"), bad).unwrap();
    let refused = complained(&run(folder.path(), &["inspect", "bad.json"]), 2);
    assert!(refused.contains("width of the noise by place"), "{refused}");
}

#[test]
fn chosen_structure_is_reported_with_its_reason() {
    let (folder, mut board) = (folder(RIG), Board::new(3));
    fs::write(folder.path().join("presses.csv"), board.calibration(30)).unwrap();
    let said_of = |structure: &str| {
        let rig = format!("{RIG}structure = \"{structure}\"\n");
        fs::write(folder.path().join("rig.toml"), rig).unwrap();
        said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"]));
        let inspected = said(&run(folder.path(), &["inspect", "board.json"]));
        let line = inspected.lines().find(|line| line.starts_with("structure:"));
        line.unwrap_or_default().to_owned()
    };
    let said: Vec<String> = ["auto", "force-linear", "force-monotone", "free"].map(said_of).to_vec();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn structures_are_compared_as_separate_estimators() {
    let (folder, mut board) = (folder(RIG), Board::new(3));
    fs::write(folder.path().join("presses.csv"), board.calibration(30)).unwrap();
    let names = |only: &str| -> Vec<String> {
        let compare = ["compare", "rig.toml", "--data", "presses.csv", "--json", "--only", only];
        let found: serde_json::Value = serde_json::from_str(&said(&run(folder.path(), &compare))).unwrap();
        let rows = found["estimators"].as_array().unwrap().iter();
        rows.map(|row| row["name"].as_str().unwrap().to_owned()).collect()
    };
    let mut all = names("influence");
    all.sort();
    let structures = ["force-linear", "force-monotone", "force-saturating", "free"];
    assert_eq!(all, structures.map(|structure| format!("influence {structure}")));
    assert_eq!(names("influence free"), ["influence free"]);
}
