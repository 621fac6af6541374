//! Placing 8 of 100,000 candidate sensors on the paper's beam: CPU time on one core, medians. By the limit (force unknown, 73
//! contacts), and by QR with column pivoting on 8 modes, with the condition number of what it chooses. What scipy takes for the
//! same matrix of sines says `design_scipy.py` beside this file.

use cpu_time::ThreadTime;
use palpate_design::sensors::{SensorDesign, Sites};
use palpate_design::sensors::{SensorProblem, condition_number, pivoted_columns};
use palpate_estimators::setup::Setup;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Beam, Surface, SurfaceSpec};
use palpate_numerics::median;
use palpate_numerics::watch::Watch;
use palpate_rig::Rig;
use palpate_testing::figure::figure;

const SITES: usize = 100_000;
const SENSORS: usize = 8;
const ROUNDS: usize = 5;
/// scipy.linalg.qr(pivoting=True) and PySensors' QR on such a matrix, in seconds, as first measured.
const SCIPY_S: f64 = 0.41;
const PYSENSORS_S: f64 = 1.75;

fn main() {
    let rig =
        Rig::from_toml(include_str!("../../../examples/sensor-design.toml")).expect("the example is sound");
    let design =
        SensorDesign { sites: Sites::Count(SITES), ..rig.design.clone().expect("the example designs") };
    by_limit(&rig.setup, &design);
    let SurfaceSpec::Beam(beam) = rig.setup.surface() else { return };
    by_pivoting("sines", &sines());
    by_pivoting("deflections at 8 contacts, orthonormal", &deflections(beam));
}

/// The median CPU time of some rounds, and what the last of them gives.
fn timed<T>(work: impl Fn() -> T) -> (f64, T) {
    let mut last = None;
    let times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            // What the round before gave is let go untimed.
            last = None;
            let start = ThreadTime::now();
            last = Some(std::hint::black_box(work()));
            start.elapsed().as_secs_f64()
        })
        .collect();
    (median(times).expect("rounds"), last.expect("there is a round"))
}

fn by_limit(setup: &Setup, design: &SensorDesign) {
    let (rows_s, _) = timed(|| SensorProblem::new(setup, design, Watch::NONE).expect("a sound design"));
    let problem = SensorProblem::new(setup, design, Watch::NONE).expect("a sound design");
    let (search_s, designed) = timed(|| problem.greedy_exchange(0, Watch::NONE).expect("it is judged"));
    figure("design: search by the limit", rows_s + search_s, "s");
    let limit_mm = designed.assessment.mean_limit_m.unwrap_or(f64::NAN) * 1e3;
    println!("{SENSORS} of {SITES} sites by the limit, {} contacts:", problem.contacts().len());
    println!(
        "  what every site tells {rows_s:.3} s, search {search_s:.3} s: {:.3} s in all (wanted: 1 s)",
        rows_s + search_s
    );
    println!("  mean limit {limit_mm:.4} mm");
}

fn by_pivoting(name: &str, modes: &[Vec<f64>]) {
    let (seconds, pivots) = timed(|| pivoted_columns(modes, SENSORS));
    figure(&format!("design: QR with column pivoting, {name}"), seconds * 1e3, "ms");
    println!(
        "QR with column pivoting, {SENSORS} of {SITES} sites, {} modes ({name}): {:.2} ms, condition {:.4}",
        modes.len(),
        seconds * 1e3,
        condition_number(modes, &pivots)
    );
    println!(
        "  scipy's 0.41 s is {:.0} times that, PySensors' 1.75 s {:.0} times",
        SCIPY_S / seconds,
        PYSENSORS_S / seconds
    );
}

fn site(i: usize) -> f64 {
    (i as f64 + 1.0) / (SITES as f64 + 1.0)
}

/// A simply supported beam's modes of vibration.
fn sines() -> Vec<Vec<f64>> {
    let mode = |k: usize| (0..SITES).map(|i| (k as f64 * std::f64::consts::PI * site(i)).sin()).collect();
    (1..=SENSORS).map(mode).collect()
}

/// Bent shapes under forces at i·l/9, made orthonormal by Gram and Schmidt.
fn deflections(beam: &Beam) -> Vec<Vec<f64>> {
    let mut modes: Vec<Vec<f64>> = Vec::new();
    for k in 1..=SENSORS {
        let at = |x: f64| palpate_mechanics::contact::Position::along(x * beam.length_m());
        let shape = beam.influence_function(SensorKind::Deflection, at(k as f64 / 9.0));
        let mut mode: Vec<f64> = (0..SITES).map(|i| shape.at(at(site(i)))).collect();
        for _ in 0..2 {
            for other in &modes {
                let share: f64 = mode.iter().zip(other).map(|(a, b)| a * b).sum();
                mode.iter_mut().zip(other).for_each(|(value, other)| *value -= share * other);
            }
        }
        let length = mode.iter().map(|value| value * value).sum::<f64>().sqrt();
        mode.iter_mut().for_each(|value| *value /= length);
        modes.push(mode);
    }
    modes
}
