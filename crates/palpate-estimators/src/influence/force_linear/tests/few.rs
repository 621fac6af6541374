//! Strips that are pressed a few times, each time at another place, with no rows of force 0, so that there are as many readings as coefficients: a sample of
//! the experiment `few-presses`.

use super::*;
use crate::influence::measured::MeasuredError;

/// Touches of a strip.
const TOUCHES: usize = 100;

/// Locators of strips from few presses, judged by touches.
#[derive(Debug, Default)]
struct Few {
    /// Geometric mean of the gauges' noise on each strip, and the least of all, in counts.
    noise: Vec<f64>,
    least_noise: f64,
    covered: Vec<f64>,
    /// Shares of touches that are `no_contact`.
    missed: Vec<f64>,
}

impl Few {
    /// Strips pressed so often, each time at another place; readings are counted in whole numbers where they are `rounded`.
    fn new(count: u64, presses: usize, rounded: bool) -> Self {
        let mut few = Self { least_noise: f64::INFINITY, ..Self::default() };
        for seed in 0..count {
            let mut bench = Bench::strip(seed, presses, presses);
            let mut touches = bench.touches(TOUCHES);
            if rounded {
                let readings = bench.presses.iter_mut().chain(&mut touches).flat_map(|row| &mut row.reading);
                readings.for_each(|value| *value = value.round());
            }
            let locator = bench.fit(Structure::Auto).unwrap();
            assert!(locator.stored.shared_errors.is_empty(), "gauges of strain share few errors");
            let noise: Vec<f64> = locator.channels().map(|(.., noise)| noise).collect();
            few.least_noise = noise.iter().copied().fold(few.least_noise, f64::min);
            few.noise.push(mean(noise.iter().map(|noise| noise.ln())).exp());
            few.covered.push(errors_mm(&locator, &touches).1);
            let is_missed = |row: &&Row| locator.locate(&row.reading).status == Status::NoContact;
            few.missed.push(touches.iter().filter(is_missed).count() as f64 / TOUCHES as f64);
        }
        few
    }
}

#[test]
fn few_presses_tell_no_more_than_they_can() {
    for (presses, rounded) in [(5, true), (6, false), (12, false)] {
        let few = Few::new(2, presses, rounded);
        let mean_of = |list: &[f64]| mean(list.iter().copied());
        let case = format!("{presses} presses, rounded {rounded}: {few:?}");
        assert!(few.least_noise > 0.03 && few.noise.iter().all(|noise| (0.1..8.0).contains(noise)), "{case}");
        // The worst of 20 strips of the experiment is covered by 80 %.
        assert!(mean_of(&few.covered) >= 0.8, "{case}");
        // 1.1 % of touches at most are missed over the strips of the experiment.
        assert!(mean_of(&few.missed) <= 0.03, "{case}");
    }
}

#[test]
fn two_presses_are_too_few_for_a_structure_by_the_force() {
    let setup = Setup::measured(0.045, &["c"]).unwrap();
    let row = |x_m: f64, force_n: f64| Row {
        position: Position::along(x_m),
        force_n: Some(force_n),
        nuisances: Vec::new(),
        time_s: None,
        reading: vec![5.0 * force_n],
    };
    let recording = Recording::new(setup.layout(), "two", vec![row(0.01, 1.0), row(0.02, 2.0)]);
    let fitted = |structure| fit(FitTask::new(&setup, &recording), structure);
    for structure in [Structure::ForceLinear, Structure::ForceMonotone] {
        assert_eq!(fitted(structure).unwrap_err(), MeasuredError::TooFewPresses { presses: 2 });
    }
    assert!(fitted(Structure::Auto).unwrap().is_none());
}
