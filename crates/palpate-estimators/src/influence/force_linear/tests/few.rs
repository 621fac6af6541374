//! Strips that are pressed a few times, each time at another place, with no rows of force 0: as many readings as coefficients.

use super::*;
use crate::influence::measured::MeasuredError;

/// Touches of a strip.
const TOUCHES: usize = 100;

/// Locators of strips from few presses, judged by touches.
#[derive(Default)]
struct Few {
    /// Geometric mean of the gauges' noise on each strip, and the least of all, in counts.
    noise: Vec<f64>,
    least_noise: f64,
    covered: Vec<f64>,
    errors_mm: Vec<f64>,
    widths_mm: Vec<f64>,
    /// Shares of touches, and of readings of the untouched board, that are `no_contact`.
    missed: Vec<f64>,
    untouched: Vec<f64>,
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
            let (errors, covered) = errors_mm(&locator, &touches);
            few.covered.push(covered);
            few.errors_mm.push(mean(errors));
            let width_mm = |row: &Row| {
                let (low_m, high_m) = locator.locate(&row.reading).contact.uncertainty.unwrap().x_95_m;
                1e3 * (high_m - low_m)
            };
            few.widths_mm.push(mean(touches.iter().map(width_mm)));
            let no_contact = |reading: &[f64]| locator.locate(reading).status == Status::NoContact;
            let missed = touches.iter().filter(|row| no_contact(&row.reading)).count();
            few.missed.push(missed as f64 / TOUCHES as f64);
            let untouched =
                (0..TOUCHES).filter(|_| no_contact(&bench.counts(Position::along(0.15), 0.0))).count();
            few.untouched.push(untouched as f64 / TOUCHES as f64);
        }
        few
    }
}

#[test]
fn few_presses_tell_no_more_than_they_can() {
    /// Strips in a test that takes seconds; from more strips the numbers up to 24 presses are told too.
    const QUICK: u64 = 5;
    let strips = benches(QUICK);
    let most = if strips > QUICK { 24 } else { 12 };
    let mut wrong = Vec::new();
    for presses in [5, 6, 8, 12, 16, 20, 24].into_iter().filter(|presses| *presses <= most) {
        for rounded in [false, true].into_iter().take(if presses == 5 { 2 } else { 1 }) {
            let few = Few::new(strips, presses, rounded);
            let [noise, covered, error_mm, width_mm, missed, untouched] =
                [&few.noise, &few.covered, &few.errors_mm, &few.widths_mm, &few.missed, &few.untouched]
                    .map(|list| mean(list.iter().copied()));
            let lowest = few.covered.iter().copied().fold(1.0, f64::min);
            eprintln!(
                "strip, {presses} presses at {presses} places{}: noise {noise:.2} (least {:.3}) of 1 count; mean {error_mm:.1} mm, {width_mm:.1} mm wide, {:.1} % covered (worst strip {:.1} %); no contact: {:.2} % of touches, {:.1} % of untouched",
                if rounded { ", in whole counts" } else { "" },
                few.least_noise,
                100.0 * covered,
                100.0 * lowest,
                100.0 * missed,
                100.0 * untouched,
            );
            let is_honest = few.least_noise > 0.03
                && few.noise.iter().all(|noise| (0.1..8.0).contains(noise))
                && (0.92..0.995).contains(&covered)
                && missed <= 0.02;
            if !is_honest {
                wrong.push((presses, rounded));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
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
