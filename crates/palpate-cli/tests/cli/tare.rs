//! `--tare` from outside: boards whose offsets have moved since their calibration.

use crate::support::board::{Board, RIG, Touch, linear_rig};
use crate::support::command::{complained, folder, run, said};
use crate::support::examples::{MOVING_LOAD, NOISY_BEAM, REAL_FINGER};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Untouched readings at the beginning of a recording.
const FIRST: usize = 60;

/// A folder with a board's rig and locator, and the board.
fn fitted() -> (TempDir, Board) {
    let (folder, mut board) = (folder(linear_rig()), Board::new(7));
    fs::write(folder.path().join("presses.csv"), board.calibration(72)).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"]));
    (folder, board)
}

/// Readings of an untouched board, then of touches with pauses between them.
fn touches(board: &mut Board) -> Vec<Touch> {
    let mut touches = vec![Touch::NONE; FIRST];
    for _ in 0..60 {
        let touch = board.touch();
        touches.extend([touch, touch, Touch::NONE]);
    }
    touches
}

/// Mean error of the touches, in millimetres, and the share of untouched rows behind the first that are `no_contact`.
fn error_and_false_alarms(folder: &Path, touches: &[Touch], options: &[&str]) -> (f64, f64) {
    let located = said(&run(folder, &[&["locate", "board.json", "touches.csv", "--all"], options].concat()));
    let rows: Vec<Vec<&str>> = located.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), touches.len());
    let (mut errors, mut untouched) = (Vec::new(), Vec::new());
    for (row, touch) in rows.iter().zip(touches).skip(FIRST) {
        if touch.force_n > 0.0 {
            errors.push((row[1].parse::<f64>().unwrap() - touch.position_mm).abs());
        } else {
            untouched.push(f64::from(row.last() == Some(&"no_contact")));
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    (mean(&errors), mean(&untouched))
}

#[test]
fn a_board_that_moved_is_as_good_as_a_fresh_one_with_a_tare() {
    let (folder, mut board) = fitted();
    let touches = touches(&mut board);
    let file = |name: &str, text: String| fs::write(folder.path().join(name), text).unwrap();
    file("touches.csv", board.recording(&touches));
    let fresh = error_and_false_alarms(folder.path(), &touches, &[]);
    board.move_offsets(50.0);
    file("touches.csv", board.recording(&touches));
    file("untouched.csv", board.recording(&[Touch::NONE; 80]));
    let moved = error_and_false_alarms(folder.path(), &touches, &[]);
    println!("fresh {fresh:?}, moved {moved:?}");
    assert!(fresh.1 > 0.95 && moved.1 < 0.1 && moved.0 > 5.0 * fresh.0, "{fresh:?} {moved:?}");
    for tare in [FIRST.to_string().as_str(), "untouched.csv", "auto", &format!("{FIRST},auto")] {
        let tared = error_and_false_alarms(folder.path(), &touches, &["--tare", tare]);
        println!("--tare {tare}: {tared:?}");
        assert!(tared.0 < 1.15 * fresh.0 + 0.1, "--tare {tare}: {tared:?}, fresh {fresh:?}");
        assert!(tared.1 > 0.95, "--tare {tare}: {tared:?}");
    }
    // One reading has more noise than a mean, of which a calibration by offsets does not know.
    let last = error_and_false_alarms(folder.path(), &touches, &["--tare", "last"]);
    assert!(last.0 < 1.5 * fresh.0 && last.1 > 0.5, "{last:?}, fresh {fresh:?}");
}

#[test]
fn rows_of_a_tare_are_reported_and_keep_their_places() {
    let (folder, mut board) = fitted();
    board.move_offsets(50.0);
    let touch = Touch { position_mm: 150.0, force_n: 2.0 };
    fs::write(folder.path().join("few.csv"), board.recording(&[Touch::NONE, Touch::NONE, touch])).unwrap();
    let output = run(folder.path(), &["locate", "board.json", "few.csv", "--tare", "2"]);
    let lines: Vec<String> = said(&output).lines().map(str::to_owned).collect();
    assert_eq!(
        lines[..3],
        [
            "line,position_mm,force_n,low_mm,high_mm,force_low_n,force_high_n,trade_off,status",
            "2,,,,,,,,tare",
            "3,,,,,,,,tare"
        ]
    );
    assert!(lines[3].ends_with(",located"), "{lines:?}");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("tare from the mean of 2 readings; g"), "{told}");
    let json = said(&run(folder.path(), &["locate", "board.json", "few.csv", "--tare", "2", "--json"]));
    assert_eq!(json.lines().nth(1), Some(r#"{"line":3,"status":"tare"}"#));

    // A touched board is no tare.
    let touched: Vec<Touch> = (0..40).map(|i| if i % 2 == 0 { touch } else { Touch::NONE }).collect();
    fs::write(folder.path().join("touched.csv"), board.recording(&touched)).unwrap();
    let output = run(folder.path(), &["locate", "board.json", "few.csv", "--tare", "touched.csv"]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("40 of 40 readings of the tare are not within the noise"), "{told}");
}

/// Three loads side by side, which are no contact of the model.
const PALM: [Touch; 3] = [
    Touch { position_mm: 60.0, force_n: 3.0 },
    Touch { position_mm: 130.0, force_n: 3.0 },
    Touch { position_mm: 240.0, force_n: 3.0 },
];

/// Statuses and positions of readings with an automatic tare: a palm, the board let go, a touch, let go, and a touch.
fn after_a_palm(folder: &Path, board: &mut Board) -> Vec<Vec<(String, String)>> {
    let touch = |position_mm: f64| Touch { position_mm, force_n: 2.0 };
    let stretches =
        [(60, Touch::NONE), (60, Touch::NONE), (20, touch(100.0)), (20, Touch::NONE), (20, touch(200.0))];
    let mut csv = String::new();
    for (i, (count, touch)) in stretches.into_iter().enumerate() {
        board.lay_on(if i == 0 { &PALM } else { &[] });
        let rows = board.recording(&vec![touch; count]);
        csv += if i == 0 { &rows } else { rows.split_once('\n').unwrap().1 };
    }
    fs::write(folder.join("palm.csv"), csv).unwrap();
    let located = said(&run(folder, &["locate", "board.json", "palm.csv", "--tare", "auto"]));
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        (fields.last().unwrap().to_string(), fields[1].to_owned())
    };
    let mut rows = located.lines().skip(1).map(row);
    stretches.map(|(count, _)| rows.by_ref().take(count).collect()).to_vec()
}

/// Readings of a status.
fn count(rows: &[(String, String)], status: &str) -> usize {
    rows.iter().filter(|(found, _)| found == status).count()
}

#[test]
fn a_palm_while_a_session_starts_is_no_baseline_for_good() {
    let (folder, mut board) = fitted();
    let [_, let_go, touched, untouched, last] = &after_a_palm(folder.path(), &mut board)[..] else {
        panic!()
    };
    assert!(count(let_go, "no_contact") >= 50, "{let_go:?}");
    assert!(
        count(touched, "located") >= 19 && count(untouched, "no_contact") >= 18,
        "{touched:?} {untouched:?}"
    );
    assert!(count(last, "located") >= 19, "{last:?}");

    // On a board that has moved the first touch decides, which comes and goes.
    board.move_offsets(50.0);
    let [_, let_go, touched, untouched, last] = &after_a_palm(folder.path(), &mut board)[..] else {
        panic!()
    };
    assert_eq!(count(let_go, "located") + count(touched, "located"), 0, "{let_go:?} {touched:?}");
    assert!(count(untouched, "no_contact") >= 12, "{untouched:?}");
    assert!(count(last, "located") >= 19, "{last:?}");
    for (_, position_mm) in last {
        assert!((position_mm.parse::<f64>().unwrap() - 200.0).abs() < 20.0, "{last:?}");
    }
}

#[test]
fn automatic_tare_counts_its_untouched_readings() {
    let (folder, mut board) = fitted();
    let touch = Touch { position_mm: 150.0, force_n: 2.0 };
    let told = |board: &mut Board, touches: &[Touch]| {
        fs::write(folder.path().join("few.csv"), board.recording(touches)).unwrap();
        let output = run(folder.path(), &["locate", "board.json", "few.csv", "--tare", "auto"]);
        said(&output);
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let touched = told(&mut board, &[touch; 30]);
    assert!(touched.contains("found no untouched reading in few.csv"), "{touched}");
    assert!(!touched.contains("moved most"), "{touched}");
    let short = told(&mut board, &[[Touch::NONE; 5].as_slice(), &[touch; 30]].concat());
    assert!(short.contains("found only 5 untouched readings") && short.contains("moved most"), "{short}");
    let enough = told(&mut board, &[[Touch::NONE; 60].as_slice(), &[touch; 30]].concat());
    assert!(enough.contains("tare from 60 untouched readings that were found"), "{enough}");
    assert!(!enough.contains("warning"), "{enough}");
    board.move_offsets(50.0);
    board.lay_on(&PALM);
    let mut csv = board.recording(&[Touch::NONE; 60]);
    board.lay_on(&[]);
    csv += board.recording(&[Touch::NONE; 60]).split_once('\n').unwrap().1;
    fs::write(folder.path().join("palm.csv"), csv).unwrap();
    let output = run(folder.path(), &["locate", "board.json", "palm.csv", "--tare", "auto"]);
    let doubted = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        doubted.contains("readings of palm.csv differ from the baseline without matching a contact"),
        "{doubted}"
    );
}

#[test]
fn bad_tares_are_refused() {
    let (folder, mut board) = fitted();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    file("few.csv", &board.recording(&[Touch::NONE; 3]));
    file("broken.csv", "g1,g2,g3,g4,g5,g6\n1,2,3,4,5,nan\n");
    file("narrow.csv", "g1,g2,g3\n1,2,3\n");
    file("empty.csv", "");
    file("header.csv", "g1,g2,g3,g4,g5,g6\n");
    let neighbours = RIG.replace("\"influence\"", "\"neighbours\"");
    file("neighbours.toml", &neighbours);
    // Without forces nothing tells what the board reads untouched.
    file("forceless.toml", &neighbours.replace("force = \"Force\"\n", ""));
    let pressed = fs::read_to_string(folder.path().join("presses.csv")).unwrap();
    let touched: Vec<&str> = pressed.lines().filter(|line| !line.contains(",0.0000,")).collect();
    file("touched.csv", &touched.join("\n"));
    said(&run(folder.path(), &["fit", "forceless.toml", "--data", "touched.csv", "-o", "forceless.json"]));
    said(&run(folder.path(), &["fit", "neighbours.toml", "--data", "presses.csv", "-o", "neighbours.json"]));
    let refused = |locator: &str, tare: &str| {
        let option = format!("--tare={tare}");
        complained(&run(folder.path(), &["locate", locator, "few.csv", &option]), 2)
    };
    let mut shown = Vec::new();
    let tares = [
        "4",
        "0",
        "-3",
        "2.5",
        "0,auto",
        "-",
        "nowhere.csv",
        "broken.csv",
        "narrow.csv",
        "empty.csv",
        "header.csv",
    ];
    for tare in tares {
        shown.push(refused("board.json", tare));
    }
    shown.extend([refused("forceless.json", "2"), refused("forceless.json", "auto")]);
    insta::assert_snapshot!(shown.join("\n"));
    // With rows of force 0, the mean of those is the baseline.
    said(&run(folder.path(), &["locate", "neighbours.json", "few.csv", "--tare", "2"]));
}

/// A recording of presses whose offsets move in the course of it, some of its untouched rows without position and force.
fn drifting(board: &mut Board) -> String {
    let mut csv = String::new();
    for part in 0..8 {
        board.move_steadily(4.5);
        let place_mm = |i: i32| 15.0 + 18.0 * f64::from((5 * part + i) % 16);
        let mut touches: Vec<Touch> = (0..5)
            .map(|i| Touch { position_mm: place_mm(i), force_n: 1.0 + f64::from((3 * part + i) % 4) })
            .collect();
        touches.push(Touch::NONE);
        let text = board.recording(&touches).replace("0.000,0.0000,", ",,");
        csv += if csv.is_empty() { &text } else { text.split_once('\n').unwrap().1 };
    }
    csv
}

#[test]
fn held_out_readings_are_evaluated_without_the_drift_of_the_recording() {
    let (folder, mut board) = fitted();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    file("drift.csv", &drifting(&mut board));
    let mean_mm = |command: &[&str]| {
        let options = ["rig.toml", "--data", "drift.csv", "--json"];
        let output = run(folder.path(), &[&command[..1], &options, &command[1..]].concat());
        let json: serde_json::Value = serde_json::from_str(&said(&output)).unwrap();
        let errors = json["errors"].get(0).or(json["estimators"].get(0)).unwrap();
        let mean_mm = errors["error_mm"]["mean"].as_f64().unwrap();
        (mean_mm, json["tared"].as_bool().unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (raw_mm, _, warned) = mean_mm(&["evaluate"]);
    assert!(warned.contains("drift.csv: 8 rows without a position, taken as untouched"), "{warned}");
    assert!(warned.contains("`--tare auto` subtracts it"), "{warned}");
    let (tared_mm, tared, told) = mean_mm(&["evaluate", "--tare", "auto"]);
    assert!(tared && told.contains("it is subtracted from held-out readings"), "{told}");
    println!("mean error {raw_mm:.2} mm, {tared_mm:.2} mm with --tare auto");
    assert!(tared_mm < 0.4 * raw_mm, "{tared_mm} mm, {raw_mm} mm");
    let (compared_mm, tared, _) = mean_mm(&["compare", "--only", "influence force-linear", "--tare", "auto"]);
    assert!(tared && (compared_mm / tared_mm - 1.0).abs() < 1e-9, "{compared_mm} mm, {tared_mm} mm");
    let refused =
        complained(&run(folder.path(), &["evaluate", "rig.toml", "--data", "drift.csv", "--tare", "5"]), 2);
    assert!(refused.contains("--tare auto subtracts the drift"), "{refused}");
    // `auto` judges likewise.
    file("auto.toml", &RIG.replace("\"influence\"", "\"auto\"\nonly = [\"influence\", \"neighbours\"]"));
    let options = ["--data", "drift.csv", "--time-limit", "2 min", "-o", "auto.json"];
    let fit = run(folder.path(), &[&["fit", "auto.toml"][..], &options].concat());
    let chosen = String::from_utf8(fit.stderr).unwrap();
    assert!(chosen.contains("it is subtracted from held-out readings\nchosen: influence force-"), "{chosen}");
    let tried = chosen.lines().find_map(|line| line.strip_prefix("influence force-linear "));
    let auto_mm: f64 = tried.unwrap().split_whitespace().next().unwrap().parse().unwrap();
    assert!((auto_mm / tared_mm - 1.0).abs() < 1e-2, "{auto_mm} mm, {tared_mm} mm");
    // A locator is judged as it is asked.
    file("untouched.csv", &board.recording(&[Touch::NONE; 40]));
    let touches: Vec<Touch> = (0..40).map(|_| board.touch()).collect();
    file("later.csv", &board.recording(&touches));
    let judged = |tare: &[&str]| {
        let arguments = [&["evaluate", "board.json", "--data", "later.csv", "--json"], tare].concat();
        let json: serde_json::Value = serde_json::from_str(&said(&run(folder.path(), &arguments))).unwrap();
        json["errors"][0]["error_mm"]["mean"].as_f64().unwrap()
    };
    let (raw_mm, tared_mm) = (judged(&[]), judged(&["--tare", "untouched.csv"]));
    assert!(tared_mm < 0.4 * raw_mm, "{tared_mm} mm, {raw_mm} mm");
}

#[test]
fn a_track_is_tared_too() {
    let folder = folder(MOVING_LOAD);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(folder.path(), &["simulate", "rig.toml", "--moving", "-o", "moving.csv", "--seed", "1"]));
    let csv = fs::read_to_string(folder.path().join("moving.csv")).unwrap();
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let move_by = |line: &str, mm: f64| {
        let cell = |(cell, name): (&str, &&str)| match name.starts_with("deflection") {
            true => format!("{}", cell.parse::<f64>().unwrap() + mm),
            false => cell.to_owned(),
        };
        line.split(',').zip(&header).map(cell).collect::<Vec<_>>().join(",")
    };
    let moved: Vec<String> = lines.map(|line| move_by(line, 0.3)).collect();
    let text = format!("{}\n{}\n", header.join(","), moved.join("\n"));
    fs::write(folder.path().join("moved.csv"), text).unwrap();
    let zeros: Vec<&str> =
        header.iter().map(|name| if name.starts_with("deflection") { "0.3" } else { "0" }).collect();
    let untouched = format!("{}\n{}\n", header.join(","), zeros.join(","));
    fs::write(folder.path().join("untouched.csv"), untouched).unwrap();
    let plain = said(&run(folder.path(), &["track", "locator.json", "moving.csv"]));
    let tared = said(&run(folder.path(), &["track", "locator.json", "moved.csv", "--tare", "untouched.csv"]));
    let positions = |text: &str| -> Vec<f64> {
        text.lines().skip(1).filter_map(|line| line.split(',').nth(2)?.parse().ok()).collect()
    };
    let (plain, tared) = (positions(&plain), positions(&tared));
    assert_eq!(plain.len(), tared.len());
    assert!(plain.len() > 100);
    assert!(plain.iter().zip(&tared).all(|(a, b)| (a - b).abs() < 0.1));
}

/// A recording with the time of each row, so many a second.
fn timed(recording: &str, rate_hz: f64) -> String {
    let rows = recording.lines().enumerate().map(|(i, line)| match i {
        0 => format!("time_s,{line}\n"),
        _ => format!("{},{line}\n", (i - 1) as f64 / rate_hz),
    });
    rows.collect()
}

#[test]
fn the_first_seconds_are_tared_by_where_rows_have_times() {
    let (folder, mut board) = fitted();
    let touches = touches(&mut board);
    board.move_offsets(50.0);
    let recording = board.recording(&touches);
    fs::write(folder.path().join("touches.csv"), &recording).unwrap();
    let locate = |tare: &str| run(folder.path(), &["locate", "board.json", "touches.csv", "--tare", tare]);
    let without = complained(&locate("2 s"), 2);
    assert!(without.contains("has no time"), "{without}");
    // Two seconds are 20 readings.
    fs::write(folder.path().join("touches.csv"), timed(&recording, 10.0)).unwrap();
    for (seconds, readings) in
        [("2 s", "20"), ("2 s,auto", "20,auto"), ("0.05 min", "30"), ("2s,last", "20,last")]
    {
        assert_eq!(said(&locate(seconds)), said(&locate(readings)), "{seconds}");
    }
    let long = complained(&locate("1 h"), 2);
    assert!(long.contains("the first 3600 s"), "{long}");
}

#[test]
fn a_calibration_by_the_latest_zero_is_used_by_it() {
    let (folder, mut board) = (folder(RIG), Board::new(7));
    let rig = linear_rig().replacen("[recording]", "[recording]\nzero = \"last\"", 1);
    assert_ne!(rig, linear_rig());
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    fs::write(folder.path().join("presses.csv"), board.calibration(72)).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "board.json"]));
    let touches = touches(&mut board);
    fs::write(folder.path().join("touches.csv"), board.recording(&touches)).unwrap();
    let fresh = error_and_false_alarms(folder.path(), &touches, &[]);
    board.move_offsets(500.0);
    fs::write(folder.path().join("touches.csv"), board.recording(&touches)).unwrap();
    let moved = error_and_false_alarms(folder.path(), &touches, &[]);
    println!("fresh {fresh:?}, moved {moved:?}");
    assert!(moved.0 < 1.15 * fresh.0 + 0.1 && moved.1 > 0.95, "{fresh:?} {moved:?}");
}

#[test]
fn simulated_calibrations_have_the_zero_of_the_rig() {
    let zero = "\n[recording]\nzero = \"last\"\n";
    let finger = folder(format!("{REAL_FINGER}{zero}"));
    let median_mm = |arguments: &[&str]| {
        let json: serde_json::Value = serde_json::from_str(&said(&run(finger.path(), arguments))).unwrap();
        let errors = json["errors"].get(0).or(json["estimators"].get(0)).unwrap();
        errors["error_mm"]["median"].as_f64().unwrap()
    };
    said(&run(finger.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let evaluated_mm = median_mm(&["evaluate", "locator.json", "--json"]);
    let compare = ["compare", "rig.toml", "--only", "influence", "--calibrations", "1", "--json"];
    let compared_mm = median_mm(&compare);
    // One bench: its median error without a zero is more than twice as large.
    assert!((0.7..1.4).contains(&(evaluated_mm / compared_mm)), "{evaluated_mm} mm, {compared_mm} mm");
    let clean = folder(format!("{NOISY_BEAM}{zero}"));
    for verb in [&["fit", "rig.toml", "-o", "never.json"][..], &["compare", "rig.toml"]] {
        let words = complained(&run(clean.path(), verb), 2);
        assert!(words.contains("only a bench with [imperfections]"), "{words}");
    }
}
