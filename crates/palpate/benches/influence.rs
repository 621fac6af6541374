//! The influence estimator on the paper's beam: a fit of 10 × 10 presses, and an estimate with its uncertainty; one
//! core, CPU time, medians. What bounds the estimate is said in `influence/beam/search.rs`,
//! and what bounds a batch in `influence/beam/locator.rs`.

use cpu_time::ThreadTime;
use palpate_core::{Estimate, Status};
use palpate_estimators::batch::BatchOptions;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::influence::{BeamLocator, Influence, InfluenceSource, Scratch};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::clean_reading;
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::median;
use palpate_rig::Rig;
use palpate_testing::figure::figure;
use std::num::NonZeroUsize;
use std::time::Instant;

const ROUNDS: usize = 201;
const READINGS: usize = 1000;

fn main() {
    let text = include_str!("../../../examples/paper.toml").replace("repeats = 1", "repeats = 10");
    let rig = Rig::from_toml(&text).expect("the paper's rig is sound");
    let recording = rig.simulate(0).expect("the paper's rig can be simulated");
    for source in [InfluenceSource::Recording, InfluenceSource::Corrected] {
        let config = Influence { source, ..Influence::default() };
        let times: Vec<f64> = (0..21)
            .map(|_| {
                let start = ThreadTime::now();
                std::hint::black_box(fit(config, &rig.setup, &recording));
                start.elapsed().as_secs_f64()
            })
            .collect();
        let time_ms = median(times).expect("rounds") * 1e3;
        figure(&format!("influence: fit of 10 × 10 presses, {source:?}"), time_ms, "ms");
        println!("fit of 10 × 10 presses, {source:?}: {time_ms:.2} ms");
    }
    for force_n in [Some(3.0), None] {
        let setup = rig.setup.clone().with_force(force_n).expect("a force is more than 0");
        let locator = fit(Influence::default(), &setup, &recording);
        let known = if force_n.is_some() { "known" } else { "unknown" };
        let Times { single, batch } = nanoseconds(&locator, &rig);
        figure(&format!("influence: estimate, force {known}"), single, "ns");
        figure(&format!("influence: estimate in a batch, force {known}"), batch, "ns");
        println!("estimate with uncertainty, force {known}: {single:.0} ns a reading");
        println!(
            "the same in batches of {READINGS}: {batch:.0} ns, {:.2} million readings/s, {:.2} times as fast",
            1e3 / batch,
            single / batch
        );
    }
    million(&rig, &recording);
}

/// Prints the time of a million readings, checked, located, and handed over block by block, with one thread and with two.
fn million(rig: &Rig, recording: &Recording) {
    let locator = Influence::default().fit(&rig.setup, recording).expect("the presses suit the bench");
    let readings: Vec<f64> = clean_readings(rig).into_iter().cycle().take(1_000_000 * 8).collect();
    for threads in [1, 2] {
        let threads = NonZeroUsize::new(threads).expect("more than 0");
        let options = BatchOptions { threads, ..BatchOptions::default() };
        let times = (0..7).map(|_| {
            let start = Instant::now();
            let located = locator.locate_blocks(&readings, options, &|_, estimates| {
                std::hint::black_box(estimates);
            });
            located.expect("the readings are finite");
            start.elapsed().as_secs_f64()
        });
        let seconds = median(times.collect()).expect("rounds");
        figure(&format!("influence: a million readings, {threads} threads"), 1e3 * seconds, "ms");
        println!(
            "a million readings in blocks, {threads} threads: {:.1} ms, {:.2} million readings/s",
            1e3 * seconds,
            1.0 / seconds
        );
    }
}

fn fit(config: Influence, setup: &Setup, recording: &Recording) -> BeamLocator {
    let fitted = config.fit_beam(FitTask::new(setup, recording));
    fitted.expect("the presses suit the bench")
}

/// Nanoseconds a reading.
struct Times {
    single: f64,
    batch: f64,
}

/// Readings without noise of contacts all along the beam, in no order.
fn clean_readings(rig: &Rig) -> Vec<f64> {
    let surface = rig.setup.surface().model().expect("a beam has a model");
    (0..READINGS)
        .flat_map(|i| {
            let position = Position::along(0.02 + 0.36 * (i * 619 % READINGS) as f64 / READINGS as f64);
            clean_reading(surface, rig.setup.layout(), Contact { position, force_n: 3.0 })
        })
        .collect()
}

/// Median times of an estimate, alone and in a batch.
fn nanoseconds(locator: &BeamLocator, rig: &Rig) -> Times {
    let readings = clean_readings(rig);
    let mut scratch = Scratch::default();
    let nothing = Estimate::of_position(Position::along(0.0), Status::NoContact);
    let mut estimates = vec![nothing; READINGS];
    let (mut single, mut batch) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let start = ThreadTime::now();
        for reading in readings.chunks_exact(rig.setup.layout().len()) {
            std::hint::black_box(locator.locate_with(reading, &mut scratch));
        }
        single.push(start.elapsed().as_nanos() as f64 / READINGS as f64);
        let start = ThreadTime::now();
        locator.locate_batch_with(&readings, &mut scratch, &mut estimates);
        std::hint::black_box(&mut estimates);
        batch.push(start.elapsed().as_nanos() as f64 / READINGS as f64);
    }
    Times { single: median(single).expect("rounds"), batch: median(batch).expect("rounds") }
}
