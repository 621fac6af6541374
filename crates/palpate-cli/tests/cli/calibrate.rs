//! `palpate calibrate` by a machine, on a simulated board whose finger a simulated machine moves.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::Stdio;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use palpate_estimators::estimator::Locator;
use palpate_estimators::evaluation::{Evaluation, limit_ratio};
use palpate_rig::Rig;

use crate::support::attempt::PATIENCE;
use crate::support::command::{Running, complained, palpate, said};

const RIG: &str = include_str!("../../../../examples/fsi-like.toml");

/// A board and its machine until they are dropped: the board behind TCP, the machine there too or at a pseudo-terminal.
struct Bench {
    _board: Running,
    from: String,
    stage: String,
    /// Lines of the board, with the instants at which they came.
    said: Receiver<(Instant, String)>,
    speed: u32,
}

/// Factor by which the clocks of board, machine and calibration run fast where no time is measured.
const SPEED: u32 = 8;

impl Bench {
    fn start(folder: &Path, firmware: &str) -> Self {
        Self::with(folder, "tcp://:0", &["--firmware", firmware])
    }

    /// With a machine at `link`, as further options describe it.
    fn with(folder: &Path, link: &str, more: &[&str]) -> Self {
        Self::at_speed(folder, link, more, SPEED)
    }

    fn at_speed(folder: &Path, link: &str, more: &[&str], speed: u32) -> Self {
        let mut child = palpate(folder)
            .args(["simulated-board", "rig.toml", "--rate", "200 Hz", "--to", "tcp://:0", "--stage", link])
            .args(["--load-cell", "2 mN", "--clock-speed", &speed.to_string()])
            .args(more)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the board starts");
        let stderr = BufReader::new(child.stderr.take().unwrap());
        let (to, said) = channel();
        std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                if to.send((Instant::now(), line)).is_err() {
                    return;
                }
            }
        });
        let next = || said.recv().expect("the board says where it is").1;
        let (stage, from) = (next(), next());
        let at = stage.rsplit(' ').next().unwrap();
        let stage = if link == "pty" { format!("gcode:serial://{at}") } else { format!("gcode:{at}") };
        let from = from.rsplit(' ').next().unwrap().to_owned();
        Self { _board: Running(child), from, stage, said, speed }
    }

    fn calibrate(&self, folder: &Path, more: &[&str]) -> std::process::Command {
        let mut command = palpate(folder);
        command.args(["calibrate", "rig.toml", "--from", &self.from, "--stage", &self.stage]);
        command.args(["--presses", "presses.csv", "--out", "locator.json"]);
        command.args(["--clock-speed", &self.speed.to_string()]).args(more);
        command
    }
}

/// Rows of the file of presses in which something touched.
fn presses(folder: &Path) -> usize {
    let rig = Rig::from_toml(RIG).unwrap();
    let bytes = std::fs::read(folder.join("presses.csv")).unwrap();
    rig.setup.read_recording("presses.csv", bytes.as_slice()).unwrap().touched().rows.len()
}

/// Rows of the file of presses that have a depth, also where that is no recording yet.
fn taken_presses(folder: &Path) -> usize {
    let csv = std::fs::read_to_string(folder.join("presses.csv")).unwrap_or_default();
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let heading = lines.next().unwrap_or_default();
    let Some(depth) = heading.split(',').position(|cell| cell == "depth_mm") else { return 0 };
    lines.filter(|line| line.split(',').nth(depth).is_some_and(|cell| cell != "0")).count()
}

/// From zero to a locator with no hand on it, and what it is worth at contacts that it has not seen.
#[test]
fn a_machine_calibrates_to_the_limit_unattended() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let bench = Bench::start(folder.path(), "marlin");
    let words = said(&bench.calibrate(folder.path(), &[]).output().unwrap());
    assert!(
        words.contains("fitted to 54 presses") && words.contains("error at held-out positions (5 folds)"),
        "{words}"
    );
    assert_eq!(presses(folder.path()), 54);
    let json = std::fs::read_to_string(folder.path().join("locator.json")).unwrap();
    let locator = Locator::from_json(&json).unwrap();
    let rig = Rig::from_toml(RIG).unwrap();
    let trial = rig.trials(1, 77).unwrap().remove(0);
    let evaluation = Evaluation::new(&locator, &trial.held_out).unwrap();
    let ratio = limit_ratio(&rig.setup, &evaluation).unwrap();
    assert!((0.8..1.2).contains(&ratio), "{ratio} × the limit");
    presses_that_are_missing_are_pressed_again(folder.path(), &bench);
}

/// Names of the columns of a file.
fn heading_of(csv: &str) -> impl Iterator<Item = &str> {
    csv.lines().find(|line| !line.starts_with('#')).unwrap().split(',')
}

/// As after presses that were left out: of the first place one to each depth, and one of another place.
fn presses_that_are_missing_are_pressed_again(folder: &Path, bench: &Bench) {
    let path = folder.join("presses.csv");
    let whole = std::fs::read_to_string(&path).unwrap();
    let depths = |text: &str| -> Vec<(String, String)> {
        let column = |name: &str| heading_of(text).position(|cell| cell == name).unwrap();
        let (at, depth) = (column("position_mm"), column("depth_mm"));
        let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        let rows = lines.map(|line| line.split(',').collect::<Vec<&str>>());
        let mut pressed: Vec<_> = rows
            .filter(|row| row[depth] != "0")
            .map(|row| (row[at].to_owned(), row[depth].to_owned()))
            .collect();
        pressed.sort();
        pressed
    };
    let all = depths(&whole);
    assert_eq!(all.iter().filter(|(_, depth)| depth == "1").count(), 27, "{all:?}");
    let mut pressed = 0;
    let mut is_kept = |line: &&str| {
        let row: Vec<&str> = line.split(',').collect();
        let touches = heading_of(&whole).zip(&row).any(|(name, cell)| name == "depth_mm" && *cell != "0");
        pressed += usize::from(touches && !line.starts_with('#'));
        // The heading is no press, though its cell is not 0.
        !(touches && [3, 6, 41].contains(&pressed))
    };
    let kept: Vec<&str> = whole.lines().filter(|line| is_kept(line)).collect();
    std::fs::write(&path, kept.join("\n") + "\n").unwrap();
    let output = bench.calibrate(folder, &["--resume"]).output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    said(&output);
    assert!(words.contains("3 presses to go"), "{words}");
    assert_eq!(depths(&std::fs::read_to_string(&path).unwrap()), all);
}

#[test]
fn too_much_force_and_enter_stop_the_machine_and_the_presses_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    // The second depth presses with 1 N, the first with half of it.
    std::fs::write(folder.path().join("rig.toml"), RIG.replace("\"3 N\"", "\"0.8 N\"")).unwrap();
    let bench = Bench::start(folder.path(), "grbl");
    let words = complained(&bench.calibrate(folder.path(), &[]).output().unwrap(), 1);
    assert!(words.contains("more than the limit of 0.8 N"), "{words}");
    assert!(words.contains("--resume continues"), "{words}");
    assert_eq!(presses(folder.path()), 3, "those of the first depth");
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let mut child = bench
        .calibrate(folder.path(), &["--resume"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    lines.find(|line| line.starts_with("taken: press 5")).expect("it goes on after the third");
    child.stdin.take().unwrap().write_all(b"\n").unwrap();
    let words: Vec<String> = lines.collect();
    assert!(words.iter().any(|line| line.contains("stopped by hand")), "{words:?}");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(presses(folder.path()) >= 5);
    assert!(!folder.path().join("locator.json").exists());
}

/// A fault of a machine, the words of the calibration that it ends, its finger as the board says it, and the presses before it.
type FaultCase = (&'static str, [&'static str; 2], &'static str, usize);

/// Faults of machines, in the terminal: the line is quoted, nothing is learnt of a press that did not happen, and the exit code says that it ended early.
#[test]
fn fault_of_a_machine_ends_the_calibration_with_its_words() {
    // The first `G1 Z` is the lift after homing, the second the first press, the third its lift.
    let cases: [FaultCase; 9] = [
        (
            "no-greeting,unknown@G1 Z:2",
            ["answered `echo:Unknown command: \"G1 Z21", "answered `error:20` to `G1 Z21"],
            "up",
            0,
        ),
        ("home-first@G1 X:2", ["answered `echo:Home XYZ First` to `G1 X", "answered `error:9`"], "up", 1),
        ("resend@G1 Z:3", ["it was stopped, and its finger is lifted"; 2], "up", 1),
        ("lost@G1 Z:3", ["did not answer `G1 Z27.000 F3000.000` within 5 s"; 2], "up", 1),
        ("reset-moving@G1 Z:2,paced", ["was reset: it sent `start`", "was reset: it sent `Grbl"], "up", 0),
        ("endstop@G1 X:2", ["`echo:endstops hit", "`ALARM:1`"], "up", 1),
        ("silence@G1 X:2", ["did not answer `"; 2], "up", 1),
        ("extra-ok@G1 Z:3", ["the machine sent `ok` while no command was under way"; 2], "up", 1),
        (
            "soft-limit-x=75mm",
            ["reports X 75.00 mm and was sent to X 76.67 mm", "`ALARM:2` to `G1 X"],
            "up",
            2,
        ),
    ];
    let runs = ["marlin", "grbl"].into_iter().enumerate().flat_map(|(of, firmware)| {
        cases
            .into_iter()
            .map(move |case| std::thread::spawn(move || ends_with_its_words(firmware, &case, case.1[of])))
    });
    let runs: Vec<_> = runs.collect();
    runs.into_iter().for_each(|run| run.join().unwrap());
}

fn ends_with_its_words(firmware: &str, (config, _, finger, taken): &FaultCase, words: &str) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG.replace("repeats = 3", "repeats = 1")).unwrap();
    let bench = Bench::with(folder.path(), "tcp://:0", &["--firmware", firmware, "--machine", config]);
    let said = complained(&bench.calibrate(folder.path(), &[]).output().unwrap(), 3);
    assert!(said.contains(words), "{firmware} {config}: {said}");
    let kept = if *taken > 0 { "--resume continues" } else { "no press is recorded" };
    assert!(said.contains(kept), "{firmware} {config}: {said}");
    assert!(!folder.path().join("locator.json").exists(), "{firmware} {config}");
    assert_eq!(taken_presses(folder.path()), *taken, "{firmware} {config}");
    let (_, stopped) = bench.said.recv_timeout(PATIENCE).unwrap();
    assert!(stopped.ends_with(&format!("stopped with its finger {finger}")), "{config}: {stopped}");
}

/// Signals in the middle of a press, with their exit code and the firmware of the machine.
#[cfg(unix)]
const SIGNALS: [(&str, i32, &str); 4] =
    [("INT", 130, "marlin"), ("TERM", 143, "grbl"), ("HUP", 129, "marlin"), ("QUIT", 131, "grbl")];

#[cfg(unix)]
#[test]
fn signals_stop_the_machine_before_the_process_ends() {
    stop_by_signals(SIGNALS.len());
}

#[cfg(unix)]
#[test]
#[ignore = "prints the time of a hundred stops, which takes minutes"]
fn a_hundred_signals_stop_the_machine_before_the_process_ends() {
    stop_by_signals(100);
}

/// Sends signals in turn to processes whose threads wait at serial ports: the machine is stopped each time, and the exit code is the signal's. The time is
/// printed, as it depends on the load of the computer; that of the machine's own clock is bounded by `stop_takes_effect` of palpate-live.
#[cfg(unix)]
fn stop_by_signals(stops: usize) {
    let runs: Vec<_> = SIGNALS.into_iter().cycle().take(stops).collect();
    let mut took: Vec<Duration> = Vec::new();
    for runs in runs.chunks(SIGNALS.len()) {
        let threads = runs
            .iter()
            .map(|&(signal, code, firmware)| std::thread::spawn(move || stopped_by(signal, code, firmware)));
        let threads: Vec<_> = threads.collect();
        took.extend(threads.into_iter().map(|thread| thread.join().unwrap()));
    }
    took.sort();
    let quantile = |percent: usize| took[(took.len() * percent).div_ceil(100) - 1];
    let (median, most, longest) = (quantile(50), quantile(99), quantile(100));
    println!(
        "{stops} stops by signals, from the signal to the machine: median {median:?}, 99 % within {most:?}, the longest {longest:?}"
    );
}

/// The time from a signal to the stop at the machine.
#[cfg(unix)]
fn stopped_by(signal: &str, code: i32, firmware: &str) -> Duration {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let bench = Bench::at_speed(folder.path(), "pty", &["--firmware", firmware, "--machine", "paced"], 1);
    let mut child =
        bench.calibrate(folder.path(), &[]).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    lines.find(|line| line.contains("searches for its end stops")).expect("it homes");
    // It lifts, travels and goes down for seconds.
    std::thread::sleep(Duration::from_millis(700));
    let asked = Instant::now();
    let id = child.id().to_string();
    std::process::Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap();
    let (at, line) = bench.said.recv_timeout(PATIENCE).expect("the machine is stopped");
    assert!(line.contains("the machine was stopped"), "{line}");
    assert_eq!(child.wait().unwrap().code(), Some(code), "{signal}");
    let rest: Vec<String> = lines.collect();
    assert!(rest.iter().any(|line| line.contains("reset it, for example by its button")), "{rest:?}");
    at - asked
}

/// A jog over the surface, a touch-off there, and presses and a check by the height that was found.
#[test]
fn jogs_find_the_touch_by_which_the_machine_presses_and_checks() {
    let folder = tempfile::tempdir().unwrap();
    let rig = RIG.replace("repeats = 3", "repeats = 1").replace("count = 9", "count = 4");
    std::fs::write(folder.path().join("rig.toml"), &rig).unwrap();
    let bench = Bench::start(folder.path(), "grbl");
    // The rig is 0.8 mm too high: without a touch-off its presses of 0.5 mm touch nothing.
    let wrong =
        rig.replace("\"22 mm\"", "\"22.8 mm\"").replace("[\"1 mm\", \"2 mm\"]", "[\"0.5 mm\", \"1 mm\"]");
    std::fs::write(folder.path().join("rig.toml"), wrong).unwrap();
    let mut child = bench
        .calibrate(folder.path(), &["--jog", "--check"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut keys = child.stdin.take().unwrap();
    keys.write_all("coarse\nx+\nx+\nx+\nx+\nx+\nx+\nx+\nfine\nz+\nz-\nz-\nwhat\nt\nb\n".as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    drop(keys);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    let answers = said(&output);
    assert!(words.contains("the finger is at x 70, y 0, z 27.8 mm of the machine"), "{words}");
    let found = words.split("the finger touches at z ").nth(1).unwrap().split(' ').next().unwrap();
    assert!((found.parse::<f64>().unwrap() - 22.0).abs() < 0.06, "{words}");
    assert!(words.contains(&format!("`touch = \"{found} mm\"` in [stage]")), "{words}");
    assert_eq!(taken_presses(folder.path()), 8);
    assert!(words.contains("check at 5 fresh places"), "{words}");
    assert_eq!(answers.matches("located at").count(), 5, "{answers}");
    assert!(
        answers.contains("error at fresh places: median") && answers.contains("of 5 within their 95 %"),
        "{answers}"
    );
    assert!(!answers.contains("placement"), "a machine has none: {answers}");
    assert!(folder.path().join("presses-check.csv").exists());
}

/// Enter alone stops a machine that is jogged, and the end of the keys ends it with its finger up.
#[test]
fn enter_stops_a_jogged_machine_and_the_end_of_the_keys_lifts_it() {
    for (keys, code, stopped) in [("x+\n\n", 130, true), ("t\n", 0, false)] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
        let bench = Bench::start(folder.path(), "marlin");
        let mut child = bench
            .calibrate(folder.path(), &["--jog"])
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(keys.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{words}");
        assert_eq!(words.contains("stopped by hand"), stopped, "{words}");
        // Beside the surface a touch-off goes down to the deepest press and finds nothing.
        assert!(stopped || words.contains("no reading shows a touch down to z 20.000 mm"), "{words}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the rig alone");
    }
}

#[test]
fn dry_run_presses_nowhere_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    // Any press would end it.
    let config = "no-emergency-parser,unknown@G1 Z21,unknown@G1 Z20";
    let bench = Bench::with(folder.path(), "tcp://:0", &["--machine", config]);
    let output = bench.calibrate(folder.path(), &["--dry-run"]).output().unwrap();
    let words = said(&output);
    assert!(words.contains("dry run: 9 positions reached at the height of travel, none pressed"), "{words}");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("has no emergency parser") && stderr.contains("pieces of 40 ms"), "{stderr}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the rig alone");
}

/// A channel at the end of its range would be read wrong, and may be about to break.
#[test]
fn a_saturated_channel_stops_the_machine() {
    let folder = tempfile::tempdir().unwrap();
    let range = "noise = \"2 mN\"\nrange = [\"-1 N\", \"0.3 N\"]";
    std::fs::write(folder.path().join("rig.toml"), RIG.replace("noise = \"2 mN\"", range)).unwrap();
    let bench = Bench::start(folder.path(), "marlin");
    let words = complained(&bench.calibrate(folder.path(), &[]).output().unwrap(), 1);
    assert!(words.contains("channel `reaction_1` reads the end of its range"), "{words}");
    assert!(words.contains("no press is recorded"), "{words}");
}

/// A touch height that is wrong: the finger never reaches the surface.
#[test]
fn presses_that_no_reading_shows_end_the_calibration() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let bench = Bench::start(folder.path(), "marlin");
    std::fs::write(folder.path().join("rig.toml"), RIG.replace("\"22 mm\"", "\"32 mm\"")).unwrap();
    let words = complained(&bench.calibrate(folder.path(), &[]).output().unwrap(), 1);
    assert!(words.contains("press excluded: it changed no reading"), "{words}");
    assert!(words.contains("`touch` or `depths` of [stage] are wrong"), "{words}");
}

#[test]
fn absent_machine_and_rig_without_a_stage_are_reported_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let rig = RIG.split("[stage]").next().unwrap();
    std::fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let calibrate = |stage: &str| {
        let arguments = ["calibrate", "rig.toml", "--from", "udp://127.0.0.1:9", "--stage", stage];
        let mut command = palpate(folder.path());
        command.args(arguments).args(["--presses", "presses.csv", "--out", "locator.json"]);
        complained(&command.output().unwrap(), 2)
    };
    let words = calibrate("gcode:tcp://127.0.0.1:1");
    assert!(words.contains("needs the rig's section [stage]"), "{words}");
    let served = |more: &[&str]| {
        let mut command = palpate(folder.path());
        command.args([
            "serve",
            "rig.toml",
            "--from",
            "udp://127.0.0.1:9",
            "--stage",
            "gcode:tcp://127.0.0.1:1",
        ]);
        complained(&command.args(more).output().unwrap(), 2)
    };
    let calibrating = ["--calibrate", "--presses", "presses.csv", "--out", "locator.json"];
    let words = served(&calibrating);
    assert!(words.contains("needs the rig's section [stage]"), "{words}");
    let words = served(&[]);
    assert!(words.contains("--calibrate"), "a machine presses in a calibration only: {words}");
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let words = calibrate("gcode:tcp://127.0.0.1:1");
    assert!(words.contains("--stage gcode:tcp://127.0.0.1:1: the line to the machine is broken"), "{words}");
    let words = served(&[&calibrating[..], &["--force", "2 N"]].concat());
    assert!(words.contains("--force does not go with the rig's [stage]: the load cell"), "{words}");
    let words = calibrate("tcp://127.0.0.1:1");
    assert!(words.contains("gcode:serial:///dev/ttyUSB0"), "{words}");
    let mut command = palpate(folder.path());
    let jogged = ["calibrate", "rig.toml", "--from", "-", "--stage", "gcode:tcp://127.0.0.1:1", "--jog"];
    command.args(jogged).args(["--presses", "presses.csv", "--out", "locator.json"]);
    let words = complained(&command.output().unwrap(), 2);
    assert!(words.contains("--jog needs the keyboard") && words.contains("another source"), "{words}");
}

#[test]
fn board_without_readings_is_reported_at_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let mut child = palpate(folder.path())
        .args(["calibrate", "rig.toml", "--from", "-", "--presses", "presses.csv", "--out", "locator.json"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all("left:1.5,right:2.5\n".repeat(150).as_bytes()).unwrap();
    let complaint = complained(&child.wait_with_output().unwrap(), 3);
    // Once while it runs, and once as the reason of its end.
    let cause = "150 frames in a row are not readings: a channel is missing; the last is `left:1.5,right:2.5`; name `reaction_1_n`, `reaction_2_n` as";
    for words in ["no readings: ", "there was no reading: "] {
        assert_eq!(complaint.matches(&format!("{words}{cause}")).count(), 1, "{complaint}");
    }
    assert!(complaint.contains("150 frames were not readings: a channel is missing"), "{complaint}");
}

#[test]
fn statements_of_the_operator_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let complaint = |arguments: &[&str]| {
        let mut command = palpate(folder.path());
        complained(&command.args(arguments).output().unwrap(), 2)
    };
    let calibrating = |more: &[&'static str]| {
        let begin =
            ["calibrate", "rig.toml", "--from", "-", "--presses", "presses.csv", "--out", "locator.json"];
        complaint(&[&begin, more].concat())
    };
    for wrong in ["2", "-1 mm", "2 N", "0 mm"] {
        let words = complaint(&["calibrate", "rig.toml", &format!("--placement={wrong}")]);
        assert!(words.contains("--placement"), "{wrong}: {words}");
    }
    let words = calibrating(&["--second-force", "2 N", "--known-force"]);
    assert!(words.contains("cannot be used with"), "{words}");
    let words = complaint(&["serve", "rig.toml", "--placement", "2 mm"]);
    assert!(words.contains("--placement is for a calibration"), "{words}");
    let far = RIG.replace("repeats = 3", "repeats = 3\nplacement = \"2 m\"");
    std::fs::write(folder.path().join("rig.toml"), far).unwrap();
    let words = calibrating(&[]);
    assert!(words.contains("placement") && words.contains("less than 100 mm"), "{words}");
}
