//! The tracker at 1 kHz on the paper's beam, which swings, and on a plate in balance: readings a second on one core, CPU time,
//! medians; and how much closer the track is than its readings, at several speeds.

use cpu_time::ThreadTime;
use palpate::bench::Bench;
use palpate::estimator::{Fitting, Locator, Swing, Tracker, TrackerConfig};
use palpate::evaluation::{TrackErrors, follow};
use palpate::rig::Rig;
use palpate::simulate::{simulate, simulate_moving};

const ROUNDS: usize = 7;

const BEAM: &str = include_str!("../../../examples/moving-load.toml");
const PLATE: &str = include_str!("../../../examples/moving-plate.toml");

fn main() {
    for (name, text) in [("beam", BEAM), ("plate", PLATE)] {
        let rig = Rig::from_toml(text).expect("the example is sound");
        let moving = rig.motion.expect("the example moves");
        for force_n in [rig.bench.force_n, None] {
            println!("{name}, force {}", if force_n.is_some() { "known" } else { "unknown" });
            let locator = fit(&rig, force_n);
            for speed_m_per_s in [0.1, 0.2, 0.5, 1.0] {
                let rig = Rig { motion: Some(moving.at_speed(speed_m_per_s)), ..rig.clone() };
                println!("  {speed_m_per_s} m/s");
                measure(&locator, &rig);
            }
        }
    }
}

fn fit(rig: &Rig, force_n: Option<f64>) -> Locator {
    let bench = Bench { force_n, ..rig.bench.clone() };
    let recording = simulate(rig, 1).expect("the example can be simulated");
    let fitting = Fitting::prepare(&bench, &rig.estimator, &recording).expect("the presses suit the bench");
    fitting.fit(0, &mut || true).expect("the presses suit the bench").expect("nobody stops it")
}

fn measure(locator: &Locator, rig: &Rig) {
    let timed = simulate_moving(rig, 2).expect("the example can be moved");
    let rows = &timed.recording.rows;
    let truths = timed.truths();
    let beam = rig.motion.and_then(|moving| moving.beam);
    let own =
        beam.map(|beam| Swing { frequency_hz: beam.frequency_hz(1), damping_ratio: beam.damping_ratio });
    let ways = [Some(("in balance", None)), own.map(|own| ("with inertia", Some(own)))];
    for (name, swing) in ways.into_iter().flatten() {
        let config = TrackerConfig { swing, ..TrackerConfig::default() };
        let tracking = locator.tracking(&config).expect("an influence locator");
        let mut rates: Vec<f64> = (0..ROUNDS)
            .map(|_| {
                let mut tracker = Tracker::new(tracking.likelihood(), config);
                let start = ThreadTime::now();
                for (row, time_s) in rows.iter().zip(&timed.times_s) {
                    std::hint::black_box(tracker.follow(*time_s, &row.reading).expect("times rise"));
                }
                rows.len() as f64 / start.elapsed().as_secs_f64()
            })
            .collect();
        rates.sort_by(f64::total_cmp);
        let followed = follow(locator, config, &timed).expect("an influence locator");
        let errors = |tracks| {
            TrackErrors::of(tracks, &truths, rig.bench.surface.extent()).expect("something was tracked")
        };
        let (filter, smoother) = (errors(&followed.filtered), errors(&followed.smoothed));
        println!(
            "    {name}: single {:.3} mm; filter {:.3} mm, {:.2} times, covers {:.1} %; smoother {:.3} mm, {:.2} times, covers {:.1} %; {:.0} thousand readings/s",
            filter.single_m * 1e3,
            filter.track_m * 1e3,
            filter.ratio(),
            filter.track_covered * 100.0,
            smoother.track_m * 1e3,
            smoother.ratio(),
            smoother.track_covered * 100.0,
            rates[ROUNDS / 2] / 1e3
        );
    }
}
