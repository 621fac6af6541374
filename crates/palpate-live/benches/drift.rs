//! Readings per second of a live tracker with and without drift and creep in its state, CPU time: `cargo bench -p palpate-live --bench drift`.
//! `cargo xtask validate drift-and-creep` measures the errors.

use cpu_time::ProcessTime;
use palpate_estimators::estimator::{Creep, Drift, Locator, TrackerConfig};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::imperfections::{Imperfections, Relaxation};
use palpate_live::input::{Arrival, TimedArrival};
use palpate_live::sample::Sample;
use palpate_live::session::{EstimateTracker, Output, Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, FaultConfig, Finger, SimulatedBoard};
use palpate_live::stamp::Stamp;
use palpate_rig::Rig;

const RATE_HZ: f64 = 100.0;
const UNTOUCHED_S: f64 = 30.0;
const HELD_S: f64 = 60.0;
const AFTER_S: f64 = 30.0;
const CREEP: Relaxation = Relaxation { share: 0.05, time_s: 20.0 };

fn main() {
    let rig = Rig::from_toml(include_str!("../../../examples/noisy-beam.toml")).expect("a sound example");
    let recording = rig.simulate(0).expect("a surface with a model");
    for (force, force_n) in [("known", rig.setup.force_n()), ("unknown", None)] {
        let setup = rig.setup.clone().with_force(force_n).expect("a force is more than 0");
        let locator = rig.estimator.fit_task(FitTask::new(&setup, &recording)).expect("an influence locator");
        let samples = samples(&rig, &locator);
        for (state, config) in states() {
            let rate = readings_per_s(&locator, config, &samples);
            println!("{force} force, {state}: {:.0} thousand readings/s", rate * 1e-3);
        }
    }
}

fn states() -> [(&'static str, TrackerConfig); 3] {
    let neither = TrackerConfig::default();
    let drift = TrackerConfig { drift: Some(Drift::default()), ..neither };
    let creep = Creep { share: CREEP.share / (1.0 - CREEP.share), time_s: CREEP.time_s };
    [
        ("neither", neither),
        ("drift", drift),
        ("drift and creep", TrackerConfig { creep: Some(creep), ..drift }),
    ]
}

fn readings_per_s(locator: &Locator, config: TrackerConfig, samples: &[Sample]) -> f64 {
    let mut follower = EstimateTracker::new(locator, config).expect("an influence locator");
    let start = ProcessTime::now();
    for sample in samples {
        let Sample { unix_ns, reading, tared, estimate, .. } = sample;
        std::hint::black_box(follower.update(*unix_ns, reading, tared, *estimate));
    }
    samples.len() as f64 / start.elapsed().as_secs_f64()
}

/// Samples of a session on a creeping surface, which a finger presses for a minute.
fn samples(rig: &Rig, locator: &Locator) -> Vec<Sample> {
    let creep = [CREEP, Relaxation::default()];
    let imperfections = Imperfections { creep, ..Imperfections::default() };
    let faults = FaultConfig { imperfections, ..FaultConfig::default() };
    let config = BoardConfig { rate_hz: RATE_HZ, ..BoardConfig::default() };
    let board =
        SimulatedBoard::new(&rig.setup, &config, Finger::random(rig, 0)).expect("a surface with a model");
    let mut board = board.with_faults(faults, 0).expect("faults in their ranges");
    let mut session = Session::new(locator, &SessionConfig::default()).expect("each reading by itself");
    let mut out = Vec::new();
    board.finger_mut().execute("lift").expect("a line of the finger");
    for frame in 0..((UNTOUCHED_S + HELD_S + AFTER_S) * RATE_HZ) as u32 {
        if frame == (UNTOUCHED_S * RATE_HZ) as u32 {
            board.finger_mut().execute("finger 160 0 3").expect("a line of the finger");
        }
        if frame == ((UNTOUCHED_S + HELD_S) * RATE_HZ) as u32 {
            board.finger_mut().execute("lift").expect("a line of the finger");
        }
        let elapsed = board.next_at();
        let arrival = Arrival::Bytes(board.send_until(elapsed));
        let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
        session.receive(&TimedArrival { at, arrival }, &mut out);
    }
    out.into_iter()
        .filter_map(|output| match output {
            Output::Sample(sample) => Some(*sample),
            Output::Event(_) => None,
        })
        .collect()
}
