//! Touches much lighter and much harder than the presses, and ranges of forces that the rig states.

use super::*;
use crate::force_prior::{ForcePrior, ForceRange};

const FLOOR_M: [f64; 2] = [1.2, 0.8];
/// Counts per newton of a load cell, as its data sheet states them.
const CELL: f64 = 100.0;

/// Force plate on four load cells, whose gains are within 0.5 % of their data sheet and which stand within 4 mm of their place. It is pressed by
/// 100 N at 5 × 4 places, and left alone after each press.
fn floor(seed: u64) -> Bench {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let [length_m, width_m] = FLOOR_M;
    let mut beside = |nominal: f64| nominal + rng.random_range(-4e-3..4e-3);
    let [left, right, near, far] = [beside(0.0), beside(length_m), beside(0.0), beside(width_m)];
    let gains: [f64; 4] = std::array::from_fn(|_| CELL * rng.random_range(0.995..1.005));
    let influences: Influences = Box::new(move |at| {
        let (x, y) = ((at.x_m - left) / (right - left), (at.y_m - near) / (far - near));
        let shares = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
        shares.iter().zip(gains).map(|(share, gain)| gain * share).collect()
    });
    let mut bench = Bench::new(Extent::plane(length_m, width_m).unwrap(), 4, influences, Vec::new(), rng);
    for i in 0..20 {
        let place = Position {
            x_m: MARGIN_M + (length_m - 2.0 * MARGIN_M) * f64::from(i % 5) / 4.0,
            y_m: MARGIN_M + (width_m - 2.0 * MARGIN_M) * f64::from(i / 5) / 3.0,
        };
        let (press, untouched) = (bench.row(place, 100.0), bench.row(Position::default(), 0.0));
        bench.presses.extend([press, untouched]);
    }
    bench
}

/// Centre of pressure by the textbook: the mean place of the cells, weighed by their forces.
fn centre_of_pressure(bench: &Bench, reading: &[f64]) -> Position {
    let [length_m, width_m] = FLOOR_M;
    let forces: Vec<f64> = reading.iter().zip(&bench.offsets).map(|(value, offset)| value - offset).collect();
    let all: f64 = forces.iter().sum();
    Position { x_m: length_m * (forces[1] + forces[3]) / all, y_m: width_m * (forces[2] + forces[3]) / all }
}

#[test]
fn walking_is_located_at_least_as_well_as_by_the_centre_of_pressure() {
    const STEPS: usize = 100;
    const FLOORS: usize = 3;
    let (mut held, mut located) = (0, 0);
    for seed in 0..FLOORS as u64 {
        let mut bench = floor(seed);
        let locator = bench.fit(Structure::Auto).unwrap();
        let mut errors_mm = [0.0; 2];
        for _ in 0..STEPS {
            let at =
                Position { x_m: bench.rng.random_range(0.1..1.1), y_m: bench.rng.random_range(0.1..0.7) };
            let force_n = bench.rng.random_range(500.0..900.0);
            let reading = bench.counts(at, force_n);
            let estimate = locator.locate(&reading);
            let uncertainty = estimate.contact.uncertainty.unwrap();
            let places = [estimate.contact.position, centre_of_pressure(&bench, &reading)];
            errors_mm = [0, 1].map(|k| errors_mm[k] + 1e3 * places[k].distance_m(at) / STEPS as f64);
            held += usize::from((uncertainty.x_95_m.0..=uncertainty.x_95_m.1).contains(&at.x_m));
            located += usize::from(estimate.status == Status::Located);
            assert!((estimate.contact.force_n.unwrap() / force_n - 1.0).abs() < 0.02, "{estimate:?}");
        }
        let [ours_mm, textbook_mm] = errors_mm;
        assert!(ours_mm <= textbook_mm, "{ours_mm} mm, by the textbook {textbook_mm} mm");
    }
    // Errors of one calibration are common to all its touches.
    assert!(held >= 85 * FLOORS && located >= 97 * FLOORS, "{held} in their intervals, {located} located");
}

#[test]
fn light_and_hard_touches_are_located_from_presses_of_one_weight() {
    let mut bench = Bench::strip(11, 9, 9);
    let places: Vec<Position> = bench.presses.iter().map(|row| row.position).collect();
    bench.presses = places
        .into_iter()
        .enumerate()
        .flat_map(|(i, at)| {
            let force_n = if i % 2 == 0 { 5.1 } else { 4.9 };
            [bench.row(at, force_n), bench.row(Position::default(), 0.0)]
        })
        .collect();
    let locator = bench.fit(Structure::Auto).unwrap();
    for share in [0.5, 1.0, 2.0, 5.0, 9.0] {
        let (mut error_mm, mut located) = (0.0, 0);
        for i in 0..20 {
            let at = Position::along(0.06 + 0.009 * f64::from(i));
            let estimate = locator.locate(&bench.counts(at, 5.0 * share));
            error_mm += 1e3 * estimate.contact.position.distance_m(at) / 20.0;
            located += usize::from(estimate.status == Status::Located);
        }
        eprintln!("{share}: {error_mm:.2} mm, {located} located");
        assert!(error_mm < 12.0 && located >= 16, "{share}: {error_mm} mm, {located} located");
    }
}

/// Forces from the least to a third of the greatest that a locator expects, each at a place of a strip.
fn touches_of_all_forces(bench: &mut Bench, locator: &ForceLinearLocator) -> Vec<(Position, f64)> {
    const TOUCHES: usize = 20;
    let (least_n, greatest_n) = locator.stored.force_range.unwrap().ends_n();
    (0..TOUCHES)
        .map(|i| {
            let share = i as f64 / (TOUCHES - 1) as f64;
            let at = Position::along(bench.rng.random_range(0.03..0.27));
            (at, least_n * (greatest_n / (3.0 * least_n)).powf(share))
        })
        .collect()
}

#[test]
fn estimates_of_light_and_hard_touches_are_those_of_a_plain_sum_over_the_grid() {
    const PER_NODE: usize = 100;
    let mut bench = Bench::strip(9, 25, 9);
    // From presses without noise the variances of influences exceed noise many times, and grow with the square of the force.
    let mut precise = Bench::strip(10, 60, 15);
    for i in 0..precise.presses.len() {
        let (at, force_n) = (precise.presses[i].position, precise.presses[i].force_n.unwrap());
        precise.presses[i].reading = clean_counts(&precise, at, force_n);
    }
    let noisy: fn(&mut Bench, Position, f64) -> Vec<f64> = Bench::counts;
    let clean = |bench: &mut Bench, at: Position, force_n: f64| clean_counts(bench, at, force_n);
    for (bench, read) in [(&mut bench, noisy), (&mut precise, clean)] {
        let locator = bench.fit(Structure::ForceLinear).unwrap();
        let spacing_m = locator.stored.x.step / PER_NODE as f64;
        let touches = touches_of_all_forces(bench, &locator);
        let compared = touches.iter().filter(|(at, force_n)| {
            let reading = read(bench, *at, *force_n);
            let (found, all) = (locator.locate(&reading), locator.summed_everywhere(&reading, PER_NODE));
            let sd_m = all.uncertainty.unwrap().covariance[0].sqrt();
            let apart_m = found.contact.position.distance_m(all.position);
            // Of several modes the estimate is but one, and the sum may step over a narrow one.
            let is_comparable = found.status == Status::Located && sd_m > spacing_m;
            assert!(
                !is_comparable || apart_m < 0.1 * sd_m + 5e-5,
                "{force_n} N at {at:?}: {apart_m} m of {sd_m} m: {found:?} {all:?}"
            );
            is_comparable
        });
        assert!(2 * compared.count() > touches.len());
    }
}

fn clean_counts(bench: &Bench, at: Position, force_n: f64) -> Vec<f64> {
    let influences = (bench.influences)(at);
    influences.iter().zip(&bench.offsets).map(|(f, offset)| offset + force_n * f).collect()
}

#[test]
fn a_stated_range_bounds_forces_whatever_the_response() {
    let mut bench = Bench::strip(3, 40, 10);
    let range = ForceRange::new(1.0, 4.0).unwrap();
    let setup = bench.setup().with_force_range(Some(range));
    for structure in [Structure::ForceLinear, Structure::ForceMonotone] {
        let locator = fit(FitTask::new(&setup, &bench.recording()), structure).unwrap().unwrap();
        let estimate = |bench: &mut Bench, force_n: f64| {
            locator.locate(&bench.counts(Position::along(0.14), force_n)).contact.force_n.unwrap()
        };
        assert!((estimate(&mut bench, 2.0) - 2.0).abs() < 0.1);
        // Softly at the lower end, and no more than the upper one.
        assert!((estimate(&mut bench, 0.8) - 0.8).abs() < 0.1);
        assert!(estimate(&mut bench, 8.0) <= 4.0 * (1.0 + 1e-9));
    }
}

#[test]
fn locators_of_files_without_a_range_keep_the_forces_of_the_presses() {
    let bench = Bench::strip(3, 40, 10);
    let locator = bench.fit(Structure::Auto).unwrap();
    let mut file = serde_json::to_value(&locator).unwrap();
    assert!(file.as_object_mut().unwrap().remove("force_range").is_some());
    let older: ForceLinearLocator = serde_json::from_value(file).unwrap();
    let mean_n = mean(bench.presses.iter().map(|row| row.force_n.unwrap()));
    let ForcePrior::Normal(prior) = &older.force_prior else { panic!("{:?}", older.force_prior) };
    assert!((prior.mean_n / mean_n - 1.0).abs() < 1e-9, "{prior:?} beside {mean_n}");
    assert!(prior.greatest_n < 16.0, "{prior:?}");
}
