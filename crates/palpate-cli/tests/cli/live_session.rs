//! What a live session does with its readings, from outside: tracked, filtered, and answered by commands to the board.

use crate::support::command::{Running, complained, folder, palpate, run, said};
use crate::support::examples::{NOISY_BEAM, PLATE};
use crate::support::toml::Toml;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tempfile::TempDir;
use toml_edit::Array;

/// Readings of a simulated board.
const BOARD: &str = "simulated:rig.toml?rate=500";
/// Longest wait for a word of a board.
const PATIENCE: Duration = Duration::from_secs(30);

/// A folder with a rig and its locator.
fn bench(rig: &str) -> TempDir {
    let folder = folder(rig);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    folder
}

/// Lines of JSON that are no events.
fn samples(text: &str) -> Vec<Value> {
    let objects = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    objects.filter(|object| object["event"].is_null()).collect()
}

/// A recording of so many seconds, and the samples that were told meanwhile.
fn record(folder: &Path, out: &str, more: &[&str]) -> Vec<Value> {
    let record = ["record", "locator.json", "--from", BOARD, "--out", out, "--json"];
    samples(&said(&run(folder, &[&record[..], more].concat())))
}

#[test]
fn tracked_and_filtered_sessions_are_recorded_and_located_again_to_the_last_bit() {
    let folder = bench(NOISY_BEAM);
    for (out, more) in [
        ("tracked.mcap", &["--track"][..]),
        ("inertia.mcap", &["--track", "--frequency", "17 Hz"]),
        ("filtered.mcap", &["--low-pass", "20 Hz"]),
    ] {
        let told = record(folder.path(), out, &[more, &["--duration", "3 s"]].concat());
        let touched = told.iter().filter(|sample| sample["status"] == "located").count();
        assert!(told.len() > 500 && touched > 50, "{out}: {touched} of {}", told.len());
        let output = run(folder.path(), &["replay", out, "--json"]);
        let replayed = samples(&said(&output));
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(words.contains("each equal to the recorded one to the last bit"), "{out}: {words}");
        for (again, sample) in replayed.iter().zip(&told) {
            for key in ["number", "x_mm", "x_95_mm", "sd_mm", "status"] {
                assert_eq!(again[key], sample[key], "{out}, {key}: {sample}");
            }
        }
    }
}

#[test]
fn a_contact_on_a_plane_has_its_covariance_tracked_or_not() {
    // At 16 places no fit checks its intervals.
    let rig = Toml::parse(PLATE).set("training.grid", Array::from_iter([4, 4])).add("surface.elements", 48);
    let folder = bench(&rig.to_string());
    for (out, more) in [("single.mcap", &[][..]), ("tracked.mcap", &["--track"])] {
        let told = record(folder.path(), out, &[more, &["--duration", "3 s"]].concat());
        let located: Vec<&Value> = told.iter().filter(|sample| sample["status"] == "located").collect();
        assert!(located.len() > 50, "{} of {}", located.len(), told.len());
        for sample in located {
            let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{sample}"));
            let [xx, xy, yy] = [0, 1, 2].map(|i| number(&sample["covariance_mm2"][i]));
            assert!(xx > 0.0 && yy > 0.0 && xy * xy <= xx * yy * (1.0 + 1e-9), "{sample}");
            assert!(((xx + yy).sqrt() / number(&sample["sd_mm"]) - 1.0).abs() < 1e-9, "{sample}");
        }
        let output = run(folder.path(), &["replay", out]);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(words.contains("each equal to the recorded one to the last bit"), "{out}: {words}");
    }
}

/// The raw readings of a session in which each was located by itself, followed afterwards.
#[test]
fn a_recording_is_followed_afterwards_as_it_would_have_been() {
    let folder = bench(NOISY_BEAM);
    let told = record(folder.path(), "single.mcap", &["--duration", "3 s"]);
    for more in [&["--track"][..], &["--low-pass", "5 Hz"]] {
        let replayed =
            samples(&said(&run(folder.path(), &[&["replay", "single.mcap", "--json"], more].concat())));
        assert_eq!(replayed.len(), told.len());
        let both = replayed
            .iter()
            .zip(&told)
            .filter(|(again, sample)| again["status"] == "located" && sample["status"] == "located");
        let others = both.filter(|(again, sample)| again["x_mm"] != sample["x_mm"]).count();
        assert!(others > 50, "{more:?}: {others} estimates are others");
    }
}

#[test]
fn options_that_do_not_go_with_locator_source_or_each_other_are_refused_with_a_reason() {
    let bench_alone = NOISY_BEAM.split("[estimator]").next().unwrap();
    let folder = bench(&format!("{bench_alone}[estimator]\nkind = \"centroid\"\n"));
    let refused = |arguments: &[&str]| complained(&run(folder.path(), arguments), 2);
    let record = ["record", "locator.json", "--out", "never.mcap", "--from"];
    let told = refused(&[&record[..], &[BOARD, "--track"]].concat());
    assert!(told.contains("this one is of kind `centroid`"), "{told}");
    let told = refused(&["serve", "locator.json", "--listen", "127.0.0.1:0", "--track"]);
    assert!(told.contains("this one is of kind `centroid`"), "{told}");
    for (more, what) in [
        (&["--low-pass", "20 mm"][..], "20 mm"),
        (&["--low-pass", "0 Hz"], "must be greater than 0"),
        (&["--low-pass", "-3 Hz"], "-3"),
        (&["--low-pass", "20 Hz", "--track"], "cannot be used with"),
        (&["--frequency", "17 Hz"], "--track"),
    ] {
        let told = refused(&[&record[..], &[BOARD], more].concat());
        assert!(told.contains(what), "{more:?}: {told}");
    }
    // The times of readings that come faster than they were taken say nothing of how fast a contact was.
    let told = refused(&[&record[..], &["file:some.mcap?speed=0", "--low-pass", "20 Hz"]].concat());
    assert!(told.contains("speed=0") && told.contains("palpate replay"), "{told}");
    assert!(!folder.path().join("never.mcap").exists());
    let plate = Toml::parse(PLATE).set("training.grid", Array::from_iter([4, 4])).add("surface.elements", 48);
    let plate = bench(&plate.to_string());
    let told = complained(
        &run(plate.path(), &[&record[..], &[BOARD, "--track", "--frequency", "17 Hz"]].concat()),
        2,
    );
    assert!(told.contains("two simple supports"), "{told}");
}

const RULES: &str = r#"
[[rule]]
name = "brake"
event = "touch_down"
command = "brake on"

[[rule]]
event = "lift_off"
command = "brake off"
"#;

/// A board, and its words as they come.
fn board(folder: &Path, to: &str) -> (Running, Receiver<String>) {
    let mut command = palpate(folder);
    command.args(["simulated-board", "rig.toml", "--rate", "200 Hz", "--to", to]).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let (tell, words) = channel();
    std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| tell.send(line)));
    (Running(child), words)
}

#[test]
fn rules_send_commands_to_the_board_over_a_pseudo_terminal_and_tcp() {
    let folder = bench(NOISY_BEAM);
    fs::write(folder.path().join("rules.toml"), RULES).unwrap();
    for (i, to) in ["pty", "tcp://:0"].into_iter().enumerate() {
        let (_board, words) = board(folder.path(), to);
        let place = words.recv_timeout(PATIENCE).unwrap();
        let from = if to == "pty" { format!("serial://{place}") } else { place };
        let out = format!("{i}.mcap");
        let record = ["record", "locator.json", "--from", &from, "--out", &out, "--rules", "rules.toml"];
        let mut command = palpate(folder.path());
        command.args(record).stdout(Stdio::null()).stderr(Stdio::null());
        let _recorder = Running(command.spawn().unwrap());
        for expected in ["command 1: brake on", "command 2: brake off", "command 3: brake on"] {
            assert_eq!(words.recv_timeout(PATIENCE).unwrap(), expected, "{to}");
        }
    }
}

#[test]
fn rules_about_a_force_need_a_locator_that_estimates_it() {
    let (rest, _) = NOISY_BEAM.split_once("[estimator]").unwrap();
    let folder = bench(&format!("{rest}[estimator]\nkind = \"network\"\nmax_epochs = 200\n"));
    let record = ["record", "locator.json", "--out", "never.mcap", "--rules", "rules.toml", "--from", BOARD];
    let serve = ["serve", "locator.json", "--listen", "127.0.0.1:0", "--rules", "rules.toml"];
    let rule = "[[rule]]\nname = \"brake\"\nforce = [\"5 N\", \"9 N\"]\ncommand = \"brake on\"\n";
    fs::write(folder.path().join("rules.toml"), rule).unwrap();
    for arguments in [&record[..], &serve] {
        let told = complained(&run(folder.path(), arguments), 2);
        assert!(told.contains("rules.toml: rule `brake` requires a `force`"), "{told}");
        assert!(told.contains("kind `network`") && told.contains("remove `force`"), "{told}");
    }
    assert!(!folder.path().join("never.mcap").exists());
}

#[test]
fn sources_without_a_way_back_and_rules_without_a_broker_are_refused() {
    let folder = bench(NOISY_BEAM);
    fs::write(folder.path().join("rules.toml"), RULES).unwrap();
    said(&run(
        folder.path(),
        &["record", "locator.json", "--from", BOARD, "--out", "a.mcap", "--duration", "0.3 s"],
    ));
    let record = ["record", "locator.json", "--out", "never.mcap", "--rules", "rules.toml", "--from"];
    for from in ["-", "udp://127.0.0.1:47123", "file:a.mcap", BOARD, "mqtt://127.0.0.1/a/+"] {
        let told = complained(&run(folder.path(), &[&record[..], &[from]].concat()), 2);
        assert!(told.contains("the source takes no"), "{from}: {told}");
    }
    let serve = ["serve", "rig.toml", "--listen", "127.0.0.1:0", "--rules", "rules.toml", "--from", "-"];
    let told = complained(&run(folder.path(), &serve), 2);
    assert!(told.contains("the source takes no"), "{told}");
    fs::write(
        folder.path().join("rules.toml"),
        "[[rule]]\nname = \"a\"\nevent = \"mark\"\ntopic = \"t\"\nmessage = \"1\"\n",
    )
    .unwrap();
    let told = complained(&run(folder.path(), &[&record[..], &["tcp://127.0.0.1:1"]].concat()), 2);
    assert!(told.contains("rule `a` publishes") && told.contains("--mqtt"), "{told}");
    let told = complained(&run(folder.path(), &serve), 2);
    assert!(told.contains("rule `a` publishes"), "{told}");
    assert!(!folder.path().join("never.mcap").exists());
}
