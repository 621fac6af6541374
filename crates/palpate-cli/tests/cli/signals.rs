//! Ctrl-C and SIGTERM: every verb ends soon, says so by its exit code, and keeps what is finished.
#![cfg(unix)]

use crate::support::command::{folder, palpate, run, said};
use crate::support::examples::{FSI_WATER, LOAD_PROFILE, MOVING_LOAD, NOISY_BEAM, PLATE};
use crate::support::toml::Toml;
use std::collections::HashMap;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest time from a signal to the end of a command, on a machine that may do other work too.
const SOON: Duration = Duration::from_millis(1500);

fn begin(folder: &Path, arguments: &[&str]) -> Child {
    let mut command = palpate(folder);
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Times for which the threads of a process waited for a processor, in nanoseconds; empty where the system does not say.
#[derive(Default)]
struct RunDelays(HashMap<String, u64>);

impl RunDelays {
    /// Reads the times of the threads that there are now.
    fn read(&mut self, process: u32) {
        let Ok(threads) = fs::read_dir(format!("/proc/{process}/task")) else { return };
        for thread in threads.flatten() {
            let statistics = fs::read_to_string(thread.path().join("schedstat")).unwrap_or_default();
            if let Some(delay_ns) = statistics.split(' ').nth(1).and_then(|text| text.parse().ok()) {
                self.0.insert(thread.file_name().to_string_lossy().into_owned(), delay_ns);
            }
        }
    }

    fn sum(&self) -> Duration {
        Duration::from_nanos(self.0.values().sum())
    }
}

/// Sends a signal, and waits for the end. Time for which other processes have the processors does not count.
fn end(mut child: Child, signal: &str, within: Duration) -> Output {
    // Its stdin stays open until it has ended.
    let stdin = child.stdin.take();
    let [stdout, stderr] = [reader(child.stdout.take()), reader(child.stderr.take())];
    let mut delays = RunDelays::default();
    delays.read(child.id());
    let (start, delayed) = (Instant::now(), delays.sum());
    Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        delays.read(child.id());
        std::thread::sleep(Duration::from_millis(2));
    };
    let elapsed = start.elapsed().saturating_sub(delays.sum() - delayed);
    drop(stdin);
    let output = Output { status, stdout: stdout.join().unwrap(), stderr: stderr.join().unwrap() };
    let code = output.status.code();
    let stderr = String::from_utf8_lossy(&output.stderr);
    let wanted = if signal == "-INT" { 130 } else { 143 };
    assert_eq!(code, Some(wanted), "{stderr}");
    assert!(elapsed < within, "{elapsed:?}: {stderr}");
    assert!(stderr.contains("stopped"), "{stderr}");
    output
}

/// A thread that reads a pipe to its end; nothing without a pipe.
fn reader(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
        bytes
    })
}

/// A folder with a moving load's rig, a locator of it, and its readings in time.
fn moving_bench() -> TempDir {
    let folder = folder(Toml::parse(MOVING_LOAD));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(folder.path(), &["simulate", "rig.toml", "--moving", "-o", "moving.csv"]));
    folder
}

#[test]
fn a_wait_for_input_ends_at_once() {
    let bench = moving_bench();
    let folder = bench.path();
    fs::write(folder.join("load.toml"), LOAD_PROFILE).unwrap();
    Command::new("mkfifo").arg(folder.join("silent.csv")).status().unwrap();
    let waiting: [&[&str]; 8] = [
        &["locate", "locator.json"],
        &["locate", "locator.json", "--no-header"],
        &["locate", "locator.json", "silent.csv"],
        &["track", "locator.json", "--rate", "100 Hz"],
        &["track", "locator.json", "--rate", "100 Hz", "--smooth"],
        &["profile", "load.toml", "-"],
        &["fit", "rig.toml", "--data", "silent.csv", "-o", "never.json"],
        &["locate", "locator.json", "moving.csv", "--tare", "silent.csv"],
    ];
    for arguments in waiting {
        for signal in ["-INT", "-TERM"] {
            let child = begin(folder, arguments);
            std::thread::sleep(Duration::from_millis(400));
            end(child, signal, SOON);
        }
    }
    assert!(!folder.join("never.json").exists());
}

#[test]
fn stopped_stream_keeps_its_output() {
    let bench = moving_bench();
    let folder = bench.path();
    let csv = fs::read_to_string(folder.join("moving.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().take(42).collect();
    for (arguments, signal) in [
        (&["locate", "locator.json"][..], "-INT"),
        (&["locate", "locator.json", "--json"], "-TERM"),
        (&["track", "locator.json"], "-INT"),
        (&["track", "locator.json"], "-TERM"),
        (&["track", "locator.json", "--json"], "-INT"),
    ] {
        let mut child = begin(folder, arguments);
        let mut stdin = child.stdin.take().unwrap();
        writeln!(stdin, "{}", lines.join("\n")).unwrap();
        child.stdin = Some(stdin);
        let mut told = BufReader::new(child.stdout.take().unwrap()).lines();
        let heading = usize::from(!arguments.contains(&"--json"));
        // A comment and a header are no readings.
        for _ in 0..heading + 40 {
            assert!(!told.next().unwrap().unwrap().is_empty());
        }
        let stopped = end(child, signal, SOON);
        assert!(String::from_utf8_lossy(&stopped.stderr).contains("stopped after line 42"), "{stopped:?}");
        assert!(told.next().is_none());
    }
}

#[test]
fn readings_before_a_signal_are_smoothed_and_reported() {
    let bench = moving_bench();
    let folder = bench.path();
    let csv = fs::read_to_string(folder.join("moving.csv")).unwrap();
    let mut child = begin(folder, &["track", "locator.json", "--smooth", "--report", "report"]);
    let mut stdin = child.stdin.take().unwrap();
    writeln!(stdin, "{}", csv.lines().take(42).collect::<Vec<_>>().join("\n")).unwrap();
    // A pipe contains 64 KiB, and the command reads up to six chunks of as many bytes before it parses them. Once more comments than these are written, the
    // lines before them are parsed.
    stdin.write_all("# no reading\n".repeat((10 << 16) / 13).as_bytes()).unwrap();
    child.stdin = Some(stdin);
    let stopped = end(child, "-INT", SOON);
    let told = String::from_utf8(stopped.stdout).unwrap();
    assert_eq!(told.lines().count(), 41, "{told}");
    assert!(folder.join("report/report.html").exists(), "{}", String::from_utf8_lossy(&stopped.stderr));
}

/// A hundred thousand rows of a strip with two channels: five hundred places, four depths.
fn many_rows() -> String {
    let row = |i: usize| {
        let (x_mm, depth_mm, wobble) =
            (0.2 * (i % 500) as f64, 0.5 * (i % 4) as f64 + 1.0, (0.7 * i as f64).sin());
        let [left, right] = [100.0 - x_mm, x_mm].map(|near_mm| depth_mm * near_mm * near_mm + wobble);
        format!("{x_mm},{left},{right},{depth_mm},{depth_mm}\n")
    };
    "X,Pl,Pr,F,depth\n".to_owned() + &(0..100_000).map(row).collect::<String>()
}

#[test]
fn studies_simulations_and_fits_of_many_rows_end_within_a_second() {
    let bench = folder(NOISY_BEAM);
    let folder = bench.path();
    fs::write(folder.join("strip.toml"), FSI_WATER).unwrap();
    fs::write(folder.join("many.csv"), many_rows()).unwrap();
    let long: [&[&str]; 4] = [
        &["study", "paper", "--seeds", "1000", "--out", "paper"],
        &["study", "elliott", "--out", "elliott"],
        &["fit", "strip.toml", "--data", "many.csv", "-o", "never.json"],
        &["compare", "rig.toml", "--calibrations", "5000"],
    ];
    for (arguments, signal) in long.into_iter().zip(["-INT", "-TERM"].into_iter().cycle()) {
        let mut child = begin(folder, arguments);
        std::thread::sleep(Duration::from_millis(700));
        assert!(child.try_wait().unwrap().is_none(), "{arguments:?} was done before");
        end(child, signal, SOON);
    }
    assert!(!folder.join("never.json").exists());
}

#[test]
fn the_equations_of_a_plate_are_left_at_a_signal() {
    let loaded = Toml::parse(PLATE).add("surface.elements", 320).to_string()
        + "\n[[load]]\nfrom = [\"50 mm\", \"50 mm\"]\nto = [\"90 mm\", \"90 mm\"]\nforce = \"5 N\"\n";
    let bench = folder(loaded);
    let folder = bench.path();
    let long: [&[&str]; 5] = [
        &["simulate", "rig.toml", "--every", "1 mm", "-o", "never.csv"],
        &["fit", "rig.toml", "-o", "never.json"],
        &["limit", "rig.toml"],
        &["profile", "rig.toml"],
        &["compare", "rig.toml"],
    ];
    for (arguments, signal) in long.into_iter().zip(["-INT", "-TERM"].into_iter().cycle()) {
        let mut child = begin(folder, arguments);
        std::thread::sleep(Duration::from_millis(700));
        assert!(child.try_wait().unwrap().is_none(), "{arguments:?} was done before");
        let stopped = end(child, signal, SOON);
        let stderr = String::from_utf8_lossy(&stopped.stderr);
        // The work itself stopped: it was not ended with the process.
        assert!(stderr.contains("no output was written"), "{arguments:?}: {stderr}");
    }
    assert!(!folder.join("never.csv").exists() && !folder.join("never.json").exists());
}

#[test]
fn a_long_recording_that_is_smoothed_ends_within_a_second() {
    let bench = moving_bench();
    let folder = bench.path();
    let csv = fs::read_to_string(folder.join("moving.csv")).unwrap();
    let (head, rows): (Vec<&str>, Vec<&str>) =
        csv.lines().partition(|line| !line.starts_with(|c: char| c.is_ascii_digit()));
    // Over and over, without times: --rate counts.
    let without_time: Vec<&str> = rows.iter().map(|row| row.split_once(',').unwrap().1).collect();
    let heading = head.last().unwrap().split_once(',').unwrap().1;
    let long = format!("{heading}\n{}", (without_time.join("\n") + "\n").repeat(100));
    fs::write(folder.join("long.csv"), long).unwrap();
    for signal in ["-INT", "-TERM"] {
        let mut child =
            begin(folder, &["track", "locator.json", "long.csv", "--rate", "1000 Hz", "--smooth"]);
        std::thread::sleep(Duration::from_millis(1500));
        assert!(child.try_wait().unwrap().is_none(), "it was done before");
        end(child, signal, SOON);
    }
}

#[test]
fn work_ends_within_a_second() {
    let bench = folder(Toml::parse(NOISY_BEAM).set("sensors.count", 40));
    let folder = bench.path();
    fs::write(folder.join("plate.toml"), PLATE).unwrap();
    let long: [&[&str]; 5] = [
        &["design", "sensors", "rig.toml", "--counts", "2..40", "--verify", "50"],
        &["design", "positions", "rig.toml", "--trials", "100000", "--verify", "1000"],
        &["compare", "rig.toml", "--calibrations", "5000"],
        &["evaluate", "rig.toml", "--folds", "5"],
        &["limit", "plate.toml", "--every", "1 mm"],
    ];
    for (arguments, signal) in long.into_iter().zip(["-INT", "-TERM"].into_iter().cycle()) {
        let mut child = begin(folder, arguments);
        std::thread::sleep(Duration::from_millis(700));
        // Where it was done before, there is nothing to be seen.
        if child.try_wait().unwrap().is_none() {
            end(child, signal, SOON);
        }
    }
}
