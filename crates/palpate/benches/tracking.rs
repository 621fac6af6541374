//! Readings per second of the filter at 1 kHz on one core, CPU time, medians: on the paper's beam with and without inertia, and on a plate.
//! `cargo xtask validate moving-contacts` measures the errors of the tracks.

use cpu_time::ThreadTime;
use palpate_estimators::estimator::{Locator, Swing, Tracker, TrackerConfig};
use palpate_estimators::fit::Fit;
use palpate_estimators::recording::TimedRecording;
use palpate_numerics::median;
use palpate_rig::Rig;
use palpate_testing::figure::figure;

const ROUNDS: usize = 7;

const BEAM: &str = include_str!("../../../examples/moving-load.toml");
const PLATE: &str = include_str!("../../../examples/moving-plate.toml");

fn main() {
    for (name, text) in [("beam", BEAM), ("plate", PLATE)] {
        let rig = Rig::from_toml(text).expect("the example is sound");
        let moving = rig.motion.expect("the example moves");
        for force_n in [rig.setup.force_n(), None] {
            let force = if force_n.is_some() { "known" } else { "unknown" };
            let locator = fit(&rig, force_n);
            for speed_m_per_s in [0.1, 0.2, 0.5, 1.0] {
                let rig = Rig { motion: Some(moving.at_speed(speed_m_per_s).unwrap()), ..rig.clone() };
                measure(&format!("tracking: {name}, force {force}, {speed_m_per_s} m/s"), &locator, &rig);
            }
        }
    }
}

fn fit(rig: &Rig, force_n: Option<f64>) -> Locator {
    let setup = rig.setup.clone().with_force(force_n).expect("a force is more than 0");
    let recording = rig.simulate(1).expect("the example can be simulated");
    rig.estimator.fit(&setup, &recording).expect("the presses suit the bench")
}

fn measure(title: &str, locator: &Locator, rig: &Rig) {
    let timed = rig.simulate_moving(2).expect("the example can be moved");
    let beam = rig.motion.and_then(|moving| moving.beam);
    let first =
        beam.map(|beam| Swing { frequency_hz: beam.frequency_hz(1), damping_ratio: beam.damping_ratio() });
    let assumptions = [Some(("in equilibrium", None)), first.map(|first| ("with inertia", Some(first)))];
    for (name, swing) in assumptions.into_iter().flatten() {
        let config = TrackerConfig { swing, ..TrackerConfig::default() };
        let rate = readings_per_s(locator, config, &timed);
        println!("{title}, {name}: {:.0} thousand readings/s", rate / 1e3);
        figure(&format!("{title}, {name}"), rate / 1e3, "thousand readings/s");
    }
}

/// CPU time of the filter, the median of several rounds.
fn readings_per_s(locator: &Locator, config: TrackerConfig, timed: &TimedRecording) -> f64 {
    let tracking = locator.tracking(&config).expect("an influence locator");
    let rows = &timed.recording.rows;
    let rates: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let mut tracker = Tracker::new(tracking.likelihood(), config);
            let start = ThreadTime::now();
            for (row, time_s) in rows.iter().zip(&timed.times_s) {
                std::hint::black_box(tracker.update(*time_s, &row.reading).expect("times rise"));
            }
            rows.len() as f64 / start.elapsed().as_secs_f64()
        })
        .collect();
    median(rates).expect("rounds")
}
