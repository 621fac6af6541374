//! Recordings: the outputs of a session are read back from a file that is whole, cut off, or written on a full disk.

use palpate_estimators::estimate_record::EstimateRecord;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::input::{Arrival, Command, Input, TimedArrival};
use palpate_live::recording::{self, Playback, Recorded, RecordingError, RecordingSwitch};
use palpate_live::sample::Sample;
use palpate_live::session::{Estimation, Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, Finger, SimulatedBoard};
use palpate_live::sink::{Batch, Sink};
use palpate_live::stamp::Stamp;
use palpate_rig::Rig;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
const START_NS: u64 = 1_800_000_000_000_000_000;

/// An empty folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn bench() -> (Rig, Locator) {
    let rig = Rig::from_toml(RIG).unwrap();
    let recording = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    (rig, locator)
}

fn switch(locator: &Locator) -> (RecordingSwitch, Receiver<Input>) {
    let (to, from) = sync_channel(64);
    (RecordingSwitch::new(locator, Estimation::Single, "simulated:rig.toml", to).unwrap(), from)
}

/// Passes readings of a simulated board through a session into a sink, and returns the samples.
fn session(rig: &Rig, locator: &Locator, frames: u64, sink: &mut impl Sink) -> Vec<Sample> {
    let config = BoardConfig { rate_hz: 200.0, seed: 3, ..BoardConfig::default() };
    let mut board = SimulatedBoard::new(&rig.setup, &config, Finger::random(rig, 3)).unwrap();
    let mut session = Session::new(locator, &SessionConfig::default()).unwrap();
    let mut samples = Vec::new();
    for frame in 0..frames {
        let elapsed = board.next_at();
        let at = Stamp { elapsed, unix_ns: START_NS + elapsed.as_nanos() as u64 };
        let arrival = Arrival::Bytes(board.send_until(elapsed));
        let mut outputs = Vec::new();
        session.receive(&TimedArrival { at, arrival }, &mut outputs);
        if frame == 10 {
            session.command(at, Command::Mark("ten".to_owned()), &mut outputs);
        }
        let batch = Arc::new(Batch { outputs });
        samples.extend(batch.samples().cloned());
        sink.batch(&batch);
        if frame.is_multiple_of(1000) {
            std::thread::sleep(Duration::from_millis(60));
        }
    }
    samples
}

fn all(path: &Path) -> Vec<Recorded> {
    let mut playback = Playback::open(path).unwrap();
    let mut all = Vec::new();
    while let Some(recorded) = playback.next_recorded().unwrap() {
        all.push(recorded);
    }
    assert_eq!(playback.skipped().loss(), None);
    all
}

#[test]
fn readings_and_estimates_are_read_again_to_the_last_bit() {
    let folder = folder("recording-whole");
    let (rig, locator) = bench();
    let (mut switch, _reports) = switch(&locator);
    let path = folder.join("first.mcap");
    switch.begin(&path).unwrap();
    let samples = session(&rig, &locator, 2000, &mut switch);
    let status = switch.end().unwrap();
    assert_eq!((status.readings, status.lost, status.problem), (2000, 0, None));

    let recorded = all(&path);
    let attached = Locator::from_json(Playback::open(&path).unwrap().locator().unwrap()).unwrap();
    let factors: Vec<f64> = palpate_live::frame::Channel::all_of(&locator.setup)
        .iter()
        .map(|channel| channel.unit.factor())
        .collect();
    let (mut readings, mut estimates) = (0, 0);
    for recorded in &recorded {
        match recorded {
            Recorded::Reading { number, values, .. } => {
                let sample = &samples[*number as usize];
                let si: Vec<f64> =
                    values.iter().zip(&factors).map(|(value, factor)| value * factor).collect();
                assert_eq!(si, sample.reading, "{number}");
                readings += 1;
            }
            Recorded::Estimate { number, located, estimate, unix_ns } => {
                let sample = &samples[*number as usize];
                assert_eq!((located, *unix_ns), (&sample.tared, sample.unix_ns));
                let again = attached.locate(located).unwrap();
                let again = EstimateRecord::new(&again, locator.setup.surface().extent());
                assert_eq!(serde_json::to_value(again).unwrap().as_object(), Some(estimate), "{number}");
                estimates += 1;
            }
            Recorded::Event { .. } => {}
        }
    }
    assert_eq!((readings, estimates), (2000, 2000));
    let mark = |recorded: &&Recorded| matches!(recorded, Recorded::Event { event, .. } if event["event"] == "mark" && event["text"] == "ten");
    assert_eq!(recorded.iter().filter(mark).count(), 1);

    let listed = recording::list(&folder).unwrap();
    assert_eq!((listed.len(), listed[0].readings, listed[0].is_cut_off), (1, 2000, false));
    assert!((listed[0].seconds - 9.995).abs() < 1e-6, "{listed:?}");
    let excerpt = recording::read(&path, 2.0, 6.0, 100).unwrap();
    // 800 readings of whole chunks with up to 204 more, so every 8th to every 11th of them, and the last.
    assert!((72..=101).contains(&excerpt.samples.len()), "{}", excerpt.samples.len());
    let times = || excerpt.samples.iter().map(|sample| sample["time_s"].as_f64().unwrap() - 1.8e9);
    assert!(
        times().all(|time| (1.999..6.001).contains(&time)) && times().max_by(f64::total_cmp).unwrap() > 5.99
    );
    assert!(
        excerpt.samples.iter().all(|sample| sample["status"].is_string() && sample["reading"].is_array())
    );
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_read_up_to_there() {
    let folder = folder("recording-cut");
    let (rig, locator) = bench();
    let (mut switch, _reports) = switch(&locator);
    let path = folder.join("whole.mcap");
    switch.begin(&path).unwrap();
    session(&rig, &locator, 4000, &mut switch);
    switch.end().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let cut = folder.join("cut.mcap");
    let mut last = u64::MAX;
    let (mut opened, mut step) = (0, bytes.len());
    while step > bytes.len() / 40 {
        step -= bytes.len() / 37;
        std::fs::write(&cut, &bytes[..step]).unwrap();
        match recording::summary(&cut) {
            Ok(summary) => {
                assert!(summary.readings <= last, "{step}");
                let readings = all(&cut).iter().filter(|one| matches!(one, Recorded::Reading { .. })).count();
                assert_eq!(readings as u64, summary.readings, "{step}");
                last = summary.readings;
                opened += 1;
            }
            // A file of a few bytes is not recognized as MCAP.
            Err(RecordingError::NotMcap { .. }) if step < 8 => {}
            Err(error) => assert!(matches!(error, RecordingError::NotOurs { .. }), "{error}"),
        }
    }
    assert!(opened > 10 && last < 4000, "{opened} {last}");
    std::fs::write(&cut, &bytes[..5]).unwrap();
    assert!(matches!(recording::summary(&cut), Err(RecordingError::NotMcap { .. })));
}

#[test]
fn recordings_without_an_instant_are_listed_last() {
    let folder = folder("recording-order");
    let (rig, locator) = bench();
    let (mut switch, _reports) = switch(&locator);
    for (name, readings) in [("a.mcap", 0), ("b.mcap", 20), ("c.mcap", 0)] {
        switch.begin(&folder.join(name)).unwrap();
        session(&rig, &locator, readings, &mut switch);
        switch.end().unwrap();
    }
    let listed = recording::list(&folder).unwrap();
    let told: Vec<_> = listed.iter().map(|one| (one.name.as_str(), one.start_s.is_some())).collect();
    assert_eq!(told, [("b.mcap", true), ("a.mcap", false), ("c.mcap", false)]);
}

#[test]
fn recordings_are_never_overwritten_and_names_get_a_number() {
    let folder = folder("recording-names");
    let (_, locator) = bench();
    let (switch, _reports) = switch(&locator);
    std::fs::write(folder.join("a.mcap"), "mine").unwrap();
    assert!(matches!(switch.begin(&folder.join("a.mcap")), Err(RecordingError::Exists { .. })));
    assert_eq!(switch.begin_in(&folder, Some("a"), 0).unwrap().name, "a-2.mcap");
    assert!(matches!(switch.begin_in(&folder, Some("b"), 0), Err(RecordingError::GoesOn { .. })));
    switch.end().unwrap();
    assert!(matches!(switch.begin_in(&folder, Some("../b"), 0), Err(RecordingError::Name { .. })));
    assert_eq!(switch.begin_in(&folder.join("new"), None, 0).unwrap().name, "1970-01-01T00-00-00Z.mcap");
    switch.end().unwrap();
    assert_eq!(std::fs::read(folder.join("a.mcap")).unwrap(), b"mine");
}

#[test]
fn a_file_that_is_taken_away_ends_the_recording_in_words() {
    let folder = folder("recording-gone");
    let (rig, locator) = bench();
    let (mut switch, reports) = switch(&locator);
    let path = folder.join("a.mcap");
    switch.begin(&path).unwrap();
    session(&rig, &locator, 100, &mut switch);
    std::fs::remove_dir_all(&folder).unwrap();
    let Ok(Input::Command(Command::Trouble(text))) = reports.recv_timeout(Duration::from_secs(20)) else {
        panic!("nothing is told");
    };
    assert!(text.contains("a.mcap") && text.contains("its file was removed"), "{text}");
    session(&rig, &locator, 100, &mut switch);
    let status = switch.end().unwrap();
    assert_eq!((status.readings, status.lost), (100, 100), "{status:?}");
    assert!(status.problem.is_some());
}

/// A disk of 6 MB; `None` if the user has no permission to mount one.
#[cfg(target_os = "linux")]
struct SmallDisk(PathBuf);

#[cfg(target_os = "linux")]
impl SmallDisk {
    fn mount(folder: PathBuf) -> Option<Self> {
        let mut mount = std::process::Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=6000k", "tmpfs"]).arg(&folder);
        mount.output().ok()?.status.success().then_some(Self(folder))
    }
}

#[cfg(target_os = "linux")]
impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = std::process::Command::new("umount").arg(&self.0).output();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_is_reported_and_the_recording_resumes_with_space() {
    let Some(disk) = SmallDisk::mount(folder("recording-full")) else {
        println!("skipped: a small disk can only be mounted by root");
        return;
    };
    let (rig, locator) = bench();
    let (mut switch, reports) = switch(&locator);
    let ballast = disk.0.join("ballast");
    std::fs::write(&ballast, vec![0; 5500 << 10]).unwrap();
    let path = disk.0.join("a.mcap");
    switch.begin(&path).unwrap();
    let samples = session(&rig, &locator, 4000, &mut switch);
    let next = || match reports.recv_timeout(Duration::from_secs(20)) {
        Ok(Input::Command(Command::Trouble(text))) => text,
        other => panic!("{other:?}"),
    };
    let full = next();
    assert!(full.contains("No space left") && full.contains("every second"), "{full}");
    assert!(switch.status().unwrap().problem.is_some());
    assert!(recording::summary(&path).unwrap().is_cut_off);
    std::fs::remove_file(&ballast).unwrap();
    let again = next();
    assert!(again.contains("written again"), "{again}");
    let status = switch.end().unwrap();
    assert_eq!((status.readings, status.lost, status.problem), (samples.len() as u64, 0, None));
    assert_eq!(recording::summary(&path).unwrap().readings, samples.len() as u64);
}

/// MCAP's reader subtracts the length of a record in a chunk from the remaining length of the chunk.
#[test]
fn a_record_that_reaches_beyond_its_chunk_is_damage() {
    let record = |kind: u8, body: &[u8]| [&[kind], &(body.len() as u64).to_le_bytes()[..], body].concat();
    let header = [&[0; 8 + 8 + 8 + 4][..], &0u32.to_le_bytes()].concat();
    let mut reaches_beyond = record(5, &[]);
    reaches_beyond[1..9].copy_from_slice(&20u64.to_le_bytes());
    let data = [&(reaches_beyond.len() as u64).to_le_bytes()[..], &reaches_beyond].concat();
    // The bytes behind the data of the chunk are within its record.
    let chunk = [&header[..], &data, &[0; 40]].concat();
    let path = folder("recording-beyond").join("beyond.mcap");
    std::fs::write(&path, [mcap::MAGIC, &record(6, &chunk)].concat()).unwrap();
    assert!(matches!(Playback::open(&path), Err(RecordingError::NotOurs { .. })));
}

#[test]
fn damaged_files_are_read_without_a_panic() {
    use rand::{RngExt, SeedableRng};
    let folder = folder("recording-damaged");
    let (rig, locator) = bench();
    let (mut switch, _reports) = switch(&locator);
    let path = folder.join("whole.mcap");
    switch.begin(&path).unwrap();
    session(&rig, &locator, 200, &mut switch);
    switch.end().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let chunks_at = 1000 + Playback::open(&path).unwrap().locator().unwrap().len();
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(9);
    let (mut opened, mut refused) = (0, 0);
    for round in 0..300 {
        let mut damaged = bytes.clone();
        // Half of the damage goes to the head of the file, half to its chunks.
        let range = if round % 2 == 0 { 8..2000 } else { chunks_at..damaged.len() };
        for _ in 0..rng.random_range(1..8) {
            let at = rng.random_range(range.clone());
            damaged[at] = if rng.random() { 0xFF } else { rng.random() };
        }
        std::fs::write(&path, &damaged).unwrap();
        let Ok(mut playback) = Playback::open(&path) else {
            refused += 1;
            continue;
        };
        opened += 1;
        while let Ok(Some(_)) = playback.next_recorded() {}
        recording::read(&path, 0.0, 1e9, 50).unwrap();
    }
    assert!(opened > 60 && refused > 60, "{opened} {refused}");
}
