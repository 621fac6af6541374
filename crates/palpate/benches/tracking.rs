//! The tracker at 1 kHz on the paper's beam, which swings, and on a plate in balance: readings a second on one core, CPU time,
//! medians; and how much closer the track is than its readings, at several speeds, in the mean of several recordings.

use cpu_time::ThreadTime;
use palpate_estimators::estimator::{Locator, Swing, Track, Tracker, TrackerConfig};
use palpate_estimators::fit::Fit;
use palpate_estimators::recording::TimedRecording;
use palpate_estimators::track_errors::{Followed, TrackErrors, follow};
use palpate_numerics::median;
use palpate_rig::Rig;
use palpate_testing::figure::figure;

const ROUNDS: usize = 7;
/// Recordings of each motion, under noise of their own.
const RECORDINGS: u64 = 6;

const BEAM: &str = include_str!("../../../examples/moving-load.toml");
const PLATE: &str = include_str!("../../../examples/moving-plate.toml");

fn main() {
    for (name, text) in [("beam", BEAM), ("plate", PLATE)] {
        let rig = Rig::from_toml(text).expect("the example is sound");
        let moving = rig.motion.expect("the example moves");
        for force_n in [rig.setup.force_n(), None] {
            println!("{name}, force {}", if force_n.is_some() { "known" } else { "unknown" });
            let locator = fit(&rig, force_n);
            for speed_m_per_s in [0.1, 0.2, 0.5, 1.0] {
                let rig = Rig { motion: Some(moving.at_speed(speed_m_per_s).unwrap()), ..rig.clone() };
                println!("  {speed_m_per_s} m/s");
                let force = if force_n.is_some() { "known" } else { "unknown" };
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
    let seeds = 2..2 + RECORDINGS;
    let moving: Vec<TimedRecording> =
        seeds.map(|seed| rig.simulate_moving(seed).expect("the example can be moved")).collect();
    let beam = rig.motion.and_then(|moving| moving.beam);
    let own =
        beam.map(|beam| Swing { frequency_hz: beam.frequency_hz(1), damping_ratio: beam.damping_ratio() });
    let ways = [Some(("in balance", None)), own.map(|own| ("with inertia", Some(own)))];
    for (name, swing) in ways.into_iter().flatten() {
        let config = TrackerConfig { swing, ..TrackerConfig::default() };
        let rate = readings_per_s(locator, config, &moving[0]);
        figure(&format!("{title}, {name}"), rate / 1e3, "thousand readings/s");
        let followed: Vec<_> = moving
            .iter()
            .map(|timed| follow(locator, config, timed).expect("an influence locator"))
            .collect();
        let tell = |tracks: fn(&Followed) -> &[Track]| {
            let errors: Vec<TrackErrors> = followed
                .iter()
                .zip(&moving)
                .map(|(followed, timed)| {
                    TrackErrors::new(tracks(followed), &timed.truths(), rig.setup.surface().extent())
                        .expect("something was tracked")
                })
                .collect();
            let mean = |of: fn(&TrackErrors) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
            let (single_m, track_m) = (mean(|one| one.single_m), mean(|one| one.track_m));
            format!(
                "{:.3} mm of {:.3}, {:.2} times, covers {:.1} %",
                track_m * 1e3,
                single_m * 1e3,
                single_m / track_m,
                mean(|one| one.track_covered) * 100.0
            )
        };
        println!(
            "    {name}: filter {}; smoother {}; {:.0} thousand readings/s",
            tell(|followed| &followed.filtered),
            tell(|followed| &followed.smoothed),
            rate / 1e3
        );
    }
}

/// The filter's rate: CPU time, the median of several rounds.
fn readings_per_s(locator: &Locator, config: TrackerConfig, timed: &TimedRecording) -> f64 {
    let tracking = locator.tracking(&config).expect("an influence locator");
    let rows = &timed.recording.rows;
    let rates: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let mut tracker = Tracker::new(tracking.likelihood(), config);
            let start = ThreadTime::now();
            for (row, time_s) in rows.iter().zip(&timed.times_s) {
                std::hint::black_box(tracker.follow(*time_s, &row.reading).expect("times rise"));
            }
            rows.len() as f64 / start.elapsed().as_secs_f64()
        })
        .collect();
    median(rates).expect("rounds")
}
