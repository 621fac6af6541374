//! A contact of one minute on a simulated board that drifts and creeps, tracked with and without drift and creep in the state:
//! cargo bench -p palpate-live --bench drift
//!
//! Untouched for 30 s, pressed for 60 s, untouched for 30 s, at 100 readings a second, at six places. The means are
//! over all readings of the contact; "after" is the time from the end of the contact to the first `no_contact`.

use cpu_time::ProcessTime;
use palpate_core::Status;
use palpate_estimators::estimator::{Creep, Drift, Locator, TrackerConfig};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation};
use palpate_live::input::{Arrival, Arrived};
use palpate_live::sample::Sample;
use palpate_live::session::{Follower, Output, Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, FaultConfig, Finger, SimulatedBoard};
use palpate_live::stamp::Stamp;
use palpate_rig::Rig;

const RATE_HZ: f64 = 100.0;
const UNTOUCHED_S: f64 = 30.0;
const HELD_S: f64 = 60.0;
const AFTER_S: f64 = 30.0;
const NOISE_M: f64 = 5e-6;
/// Time from the onset of a press to its reading in a guided calibration, in seconds: the middle of its stretch at rest.
const PRESSED_S: f64 = 0.2;

fn main() {
    let known = include_str!("../../../examples/noisy-beam.toml").to_owned();
    let without = known.lines().filter(|line| *line != "[contact]" && !line.starts_with("force = "));
    let unknown = without.collect::<Vec<_>>().join("\n").replace("[training]", "[training]\nforce = \"3 N\"");
    assert_ne!(known, unknown);
    println!("force    faults                       state     error   cov  located  after");
    let none = FaultConfig::default();
    let line = OffsetDrift { line_per_s: Amount::Value(0.02 * NOISE_M), ..OffsetDrift::default() };
    let walk = OffsetDrift { walk_per_root_s: Amount::Value(0.1 * NOISE_M), ..OffsetDrift::default() };
    let creep = [Relaxation { share: 0.05, time_s: 20.0 }, Relaxation::default()];
    let drifting = |drift| imperfect(Imperfections { drift, ..Imperfections::default() });
    let creeping = |drift| imperfect(Imperfections { drift, creep, ..Imperfections::default() });
    let (walk, creep, all) = (drifting(walk), creeping(OffsetDrift::default()), creeping(line));
    let line = drifting(line);
    let faults = [
        ("none", none),
        ("line, 0.02 sd/s", line),
        ("walk, 0.1 sd/√s", walk),
        ("creep, 5 % in 20 s", creep),
        ("line and creep", all),
    ];
    for (force, text) in [("known", known), ("unknown", unknown)] {
        let rig = Rig::from_toml(&text).expect("a rig of the examples");
        for (name, faults) in &faults {
            let locator = calibrated(&rig, faults);
            for (state, config) in states(faults) {
                let outcome = Outcome::new(&rig, &locator, faults, config);
                println!("{force:<8} {name:<28} {state:<9} {outcome}");
            }
        }
    }
}

/// Faults of a board with these imperfections.
fn imperfect(imperfections: Imperfections) -> FaultConfig {
    FaultConfig { imperfections, ..FaultConfig::default() }
}

/// A locator calibrated by presses on the creeping surface.
fn calibrated(rig: &Rig, faults: &FaultConfig) -> Locator {
    let mut recording = rig.simulate(0).expect("a surface with a model");
    let [creep, _] = faults.imperfections.creep;
    if creep.share > 0.0 {
        let came = 1.0 - creep.share * (-PRESSED_S / creep.time_s).exp();
        recording.rows.iter_mut().flat_map(|row| &mut row.reading).for_each(|value| *value *= came);
    }
    rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).expect("an influence locator")
}

/// Trackers without drift and creep, with drift, and, for a board that creeps, with both.
fn states(faults: &FaultConfig) -> Vec<(&'static str, TrackerConfig)> {
    let nothing = TrackerConfig::default();
    let drift = TrackerConfig { drift: Some(Drift::default()), ..nothing };
    // Of a reading r, (1 − c)·r is immediate, and c·r creeps.
    let [of_board, _] = faults.imperfections.creep;
    let creep = Creep { share: of_board.share / (1.0 - of_board.share), time_s: of_board.time_s };
    let mut states = vec![("neither", nothing), ("drift", drift)];
    if of_board.share > 0.0 {
        states.push(("both", TrackerConfig { creep: Some(creep), ..drift }));
    }
    states
}

struct Outcome {
    error_mm: f64,
    covered: f64,
    located: f64,
    after_s: f64,
    per_s: f64,
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { error_mm, covered, located, after_s, per_s } = self;
        write!(
            f,
            "{error_mm:6.3} mm {covered:5.1} % {located:5.1} % {after_s:5.1} s  {:.0} thousand/s",
            per_s * 1e-3
        )
    }
}

impl Outcome {
    fn new(rig: &Rig, locator: &Locator, faults: &FaultConfig, config: TrackerConfig) -> Self {
        let (mut errors, mut held, mut located, mut count, mut after, mut seconds, mut readings) =
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let places_mm = [63.0, 117.0, 160.0, 211.0, 289.0, 331.0];
        for (seed, x_mm) in places_mm.into_iter().enumerate() {
            let samples = samples(rig, locator, faults, x_mm, seed as u64);
            let mut follower = Follower::new(locator, config).expect("an influence locator");
            let start = ProcessTime::now();
            let mut touches = true;
            for sample in &samples {
                let estimate =
                    follower.follow(sample.unix_ns, &sample.reading, &sample.tared, sample.estimate);
                let time_s = sample.number as f64 / RATE_HZ;
                // The first second of the contact is omitted.
                if (UNTOUCHED_S + 1.0..UNTOUCHED_S + HELD_S).contains(&time_s) {
                    count += 1.0;
                    located += f64::from(u8::from(estimate.status == Status::Located));
                    let contact = estimate.contact;
                    errors += 1e3 * (contact.position.x_m - 1e-3 * x_mm).abs();
                    let (low_m, high_m) =
                        contact.uncertainty.map_or((0.0, 0.0), |uncertainty| uncertainty.x_95_m);
                    held += f64::from(u8::from((low_m..=high_m).contains(&(1e-3 * x_mm))));
                }
                if time_s >= UNTOUCHED_S + HELD_S && touches {
                    touches = estimate.status != Status::NoContact;
                    after += 1.0 / RATE_HZ;
                }
            }
            seconds += start.elapsed().as_secs_f64();
            readings += samples.len() as f64;
        }
        Self {
            error_mm: errors / count,
            covered: 100.0 * held / count,
            located: 100.0 * located / count,
            after_s: after / places_mm.len() as f64,
            per_s: readings / seconds,
        }
    }
}

/// Samples of a session, each located by itself.
fn samples(rig: &Rig, locator: &Locator, faults: &FaultConfig, x_mm: f64, seed: u64) -> Vec<Sample> {
    let config = BoardConfig { rate_hz: RATE_HZ, seed, ..BoardConfig::default() };
    let board =
        SimulatedBoard::new(&rig.setup, &config, Finger::random(rig, seed)).expect("a surface with a model");
    let mut board = board.with_faults(faults.clone(), seed).expect("faults in their ranges");
    let mut session = Session::new(locator, &SessionConfig::default()).expect("each reading by itself");
    let mut out = Vec::new();
    board.finger_mut().obey("lift").expect("a line of the finger");
    for frame in 0..((UNTOUCHED_S + HELD_S + AFTER_S) * RATE_HZ) as u32 {
        if frame == (UNTOUCHED_S * RATE_HZ) as u32 {
            board.finger_mut().obey(&format!("finger {x_mm} 0 3")).expect("a line of the finger");
        }
        if frame == ((UNTOUCHED_S + HELD_S) * RATE_HZ) as u32 {
            board.finger_mut().obey("lift").expect("a line of the finger");
        }
        let elapsed = board.next_at();
        let arrival = Arrival::Bytes(board.send_until(elapsed));
        let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
        session.receive(&Arrived { at, arrival }, &mut out);
    }
    out.into_iter()
        .filter_map(|output| match output {
            Output::Sample(sample) => Some(*sample),
            Output::Event(_) => None,
        })
        .collect()
}
