//! The influence estimator on the plate of `examples/plate.toml`: a fit of 36 × 5 presses, and an estimate with its
//! uncertainty; one core, CPU time, medians.

use cpu_time::ThreadTime;
use palpate_estimators::arrangement::every;
use palpate_estimators::fit::FitTask;
use palpate_estimators::influence::{Influence, PlaneLocator, PlaneScratch};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_numerics::median;
use palpate_rig::Rig;
use palpate_testing::figure::figure;

const ROUNDS: usize = 51;

fn main() {
    let rig = Rig::from_toml(include_str!("../../../examples/plate.toml")).expect("the rig is sound");
    let recording = rig.simulate(0).expect("the rig can be simulated");
    let times: Vec<f64> = (0..5)
        .map(|_| {
            let start = ThreadTime::now();
            std::hint::black_box(fit(&rig.setup, &recording));
            start.elapsed().as_secs_f64()
        })
        .collect();
    let time_ms = median(times).expect("rounds") * 1e3;
    figure("plane: fit of 36 × 5 presses", time_ms, "ms");
    println!("fit of 36 × 5 presses: {time_ms:.0} ms");
    let all =
        every(Extent::plane(0.3, 0.3).expect("it has sides"), 0.01).expect("a centimetre is a fair spacing");
    let middle = |at: &Position| [at.x_m, at.y_m].iter().all(|m| (0.075..=0.225).contains(m));
    let plain: Vec<Position> = all.iter().copied().filter(middle).collect();
    for force_n in [Some(5.0), None] {
        let setup = rig.setup.clone().with_force(force_n).expect("a force is more than 0");
        let locator = fit(&setup, &recording);
        let known = if force_n.is_some() { "known" } else { "unknown" };
        for (place, positions) in [("the middle, half as long and wide", &plain), ("the whole plate", &all)] {
            let time_us = microseconds(&locator, &rig, positions);
            figure(&format!("plane: estimate, force {known}, {place}"), time_us, "us");
            println!("estimate with uncertainty, force {known}, {place}: {time_us:.2} µs a reading");
        }
    }
}

fn fit(setup: &Setup, recording: &Recording) -> PlaneLocator {
    let fitted = Influence::default().fit_plane(FitTask::new(setup, recording));
    fitted.expect("the presses suit the bench")
}

/// Median time of an estimate, readings being all alike.
fn microseconds(locator: &PlaneLocator, rig: &Rig, positions: &[Position]) -> f64 {
    let surface = rig.setup.surface().model().expect("a plate has a model");
    let sensors = CleanSensors::new(surface, rig.setup.layout());
    let readings: Vec<Vec<f64>> =
        positions.iter().map(|&position| sensors.reading(Contact { position, force_n: 5.0 })).collect();
    let mut scratch = PlaneScratch::default();
    let times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = ThreadTime::now();
            for reading in &readings {
                std::hint::black_box(locator.locate_with(reading, &mut scratch));
            }
            start.elapsed().as_secs_f64() * 1e6 / readings.len() as f64
        })
        .collect();
    median(times).expect("rounds")
}
