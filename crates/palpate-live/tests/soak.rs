//! A simulated board with faults every few seconds: every line is accounted for, and memory stays flat.
//!
//! `cargo test -p palpate-live --test soak -- --ignored --nocapture` processes an hour of readings, as fast as they are located.

use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation};
use palpate_live::input::{Arrival, TimedArrival};
use palpate_live::recording::RecordingSwitch;
use palpate_live::session::{Estimation, Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, FaultConfig, Finger, SimulatedBoard};
use palpate_live::sink::{Batch, Sink};
use palpate_live::stamp::Stamp;
use palpate_rig::Rig;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
const RATE_HZ: f64 = 1000.0;
/// Seconds between two disconnections of the cable, and seconds of each disconnection.
const PULLED_EVERY: u64 = 7;
const PULLED_MS: u64 = 800;

/// Five pulls of the cable are enough for every kind of line.
#[test]
fn every_line_is_accounted_for_and_memory_stays_flat() {
    soak(0.6);
}

#[test]
#[ignore = "an hour of readings takes minutes"]
fn every_line_of_an_hour_is_accounted_for_and_memory_stays_flat() {
    soak(60.0);
}

fn soak(minutes: f64) {
    let rig = Rig::from_toml(RIG).unwrap();
    let recording = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    let imperfections = Imperfections {
        drift: OffsetDrift { line_per_s: Amount::Value(1e-8), walk_per_root_s: Amount::Value(1e-8) },
        creep: [Relaxation { share: 0.02, time_s: 5.0 }, Relaxation::default()],
        ..Imperfections::default()
    };
    let faults = FaultConfig { dropped: 0.005, torn: 0.005, imperfections, ..FaultConfig::default() };
    let mut board = SimulatedBoard::new(
        &rig.setup,
        &BoardConfig { rate_hz: RATE_HZ, seed: 1, ..BoardConfig::default() },
        Finger::random(&rig, 1),
    )
    .unwrap()
    .with_faults(faults, 1)
    .unwrap();
    let mut session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("soak");
    let _ = std::fs::remove_dir_all(&folder);
    let (reports, _reports) = sync_channel(64);
    let mut recorder = RecordingSwitch::new(&locator, Estimation::Single, "soak", reports).unwrap();
    recorder.begin_in(&folder, Some("soak"), 0).unwrap();

    let end = Duration::from_secs_f64(60.0 * minutes);
    let (mut lines, mut away_frames, mut was_away, mut pulls) = (0_u64, 0_u64, false, 0_u64);
    let mut line_is_ended = true;
    let mut settled_kb = None;
    while board.next_at() < end {
        let elapsed = board.next_at();
        let ms = elapsed.as_millis() as u64;
        let is_away = ms / 1000 >= PULLED_EVERY && ms % (PULLED_EVERY * 1000) < PULLED_MS;
        let frame = board.next_frame();
        let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
        let mut outputs = Vec::new();
        let mut receive =
            |arrival, outputs: &mut Vec<_>| session.receive(&TimedArrival { at, arrival }, outputs);
        match (was_away, is_away) {
            (false, true) => {
                pulls += 1;
                receive(Arrival::Lost("unplugged".to_owned()), &mut outputs);
            }
            (true, false) => {
                receive(Arrival::Opened("board".to_owned()), &mut outputs);
                line_is_ended = true;
            }
            _ => {}
        }
        was_away = is_away;
        match frame {
            Some(_) if is_away => away_frames += 1,
            Some(bytes) => {
                // A frame that lost all but its line end is an empty line, which is ignored.
                let is_empty = line_is_ended && bytes == b"\n";
                lines += bytes.iter().filter(|byte| **byte == b'\n').count() as u64 - u64::from(is_empty);
                line_is_ended = bytes.ends_with(b"\n");
                receive(Arrival::Bytes(bytes), &mut outputs);
            }
            None => {}
        }
        if !outputs.is_empty() {
            recorder.batch(&Arc::new(Batch { outputs }));
        }
        // The recorder gets as much time as in a real session.
        if ms.is_multiple_of(500) {
            std::thread::sleep(Duration::from_millis(15));
        }
        if settled_kb.is_none() && elapsed > end / 4 {
            settled_kb = resident_kb();
        }
    }
    let status = recorder.end().unwrap();
    let counters = session.counters();
    let bad: u64 = counters.bad_frames.values().sum();
    let sent = board.sent();
    println!("{minutes} min at {RATE_HZ} Hz: {sent:?}, {away_frames} while unplugged");
    println!(
        "{lines} lines: {} located, rejected {:?}; {pulls} pulls, {} gaps",
        counters.readings, counters.bad_frames, counters.gaps
    );
    println!(
        "recorded {} readings, {} lost, {:.1} MB",
        status.readings,
        status.lost,
        status.bytes as f64 / 1e6
    );
    // A torn frame that lost its line end is one line with the next frame. Frames that the disconnection cuts have no end.
    assert_eq!(lines, counters.readings + bad);
    assert_eq!((status.readings, status.lost, status.problem), (counters.readings, 0, None));
    assert_eq!(counters.gaps, pulls - u64::from(was_away), "each pull is a gap, and nothing else is");
    assert!(bad > 0 && sent.torn > bad / 3, "{bad}");
    if let (Some(before), Some(after)) = (settled_kb, resident_kb()) {
        println!("memory: {before} kB after a quarter, {after} kB at the end");
        // Only the index of the recording grows, by about 20 bytes per reading.
        let most = before + before / 10 + counters.readings * 3 / 4 * 20 / 1000;
        assert!(after <= most, "{after} kB, at most {most}");
    }
}

/// Resident memory of this process.
fn resident_kb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches(" kB").parse().ok()
}
