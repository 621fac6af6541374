//! Presses of one weight, or nearly one, and touches whose force nobody knows.

use super::super::force_prior::PressForces;
use super::*;
use crate::recording::is_same_force;
use palpate_numerics::normal_interval_95;

/// Force that the strip feels under the weight, in newtons: the counts are those of every weight.
const FELT_N: f64 = 5.0;

/// Nine presses of a weight, one after each of which the strip was left alone, and its locator.
fn pressed_by(weight_n: f64, spread: f64) -> (Bench, ForceLinearLocator) {
    let mut bench = Bench::strip(11, 9, 9);
    let places: Vec<Position> = bench.presses.iter().map(|row| row.position).collect();
    bench.presses.clear();
    for (i, at) in places.into_iter().enumerate() {
        let share = 1.0 + if i % 2 == 0 { spread } else { -spread };
        let press = Row { force_n: Some(weight_n * share), ..bench.row(at, FELT_N * share) };
        let untouched = bench.row(Position::default(), 0.0);
        bench.presses.extend([press, untouched]);
    }
    let locator = bench.fit(Structure::Auto).unwrap();
    (bench, locator)
}

/// Mean error in mm, share of intervals along the strip that hold the touch and of those that hold its force, and share of touches that are outside the model, of
/// touches by 0.25 to 2 times the weight.
fn judged(weight_n: f64, spread: f64) -> [f64; 4] {
    const TOUCHES: usize = 100;
    let (mut bench, locator) = pressed_by(weight_n, spread);
    let (mut error_mm, mut held, mut force_held, mut outside) = (0.0, 0, 0, 0);
    for _ in 0..TOUCHES {
        let at = Position::along(bench.rng.random_range(2.0 * MARGIN_M..STRIP_M - 2.0 * MARGIN_M));
        let share: f64 = bench.rng.random_range(0.25..2.0);
        let estimate = locator.locate(&bench.counts(at, FELT_N * share));
        let told = estimate.contact.uncertainty.unwrap();
        let holds = |(low, high): (f64, f64), value: f64| low <= value && value <= high;
        error_mm += 1e3 * estimate.contact.position.distance_m(at) / TOUCHES as f64;
        held += usize::from(holds(told.x_95_m, at.x_m));
        // Without an interval of its own the force is normal.
        let force_n = estimate.contact.force_n.unwrap();
        let normal = normal_interval_95(force_n, told.covariance[5].sqrt());
        force_held += usize::from(holds(told.force_95_n.unwrap_or(normal), weight_n * share));
        outside += usize::from(estimate.status == Status::OutsideModel);
        // A thousandth of the weight is what one count of noise makes of it.
        assert!(told.covariance[5].sqrt() > 1e-4 * weight_n, "{weight_n}: {told:?}");
    }
    let share = |count: usize| count as f64 / TOUCHES as f64;
    [error_mm, share(held), share(force_held), share(outside)]
}

#[test]
fn touches_of_other_forces_are_located_whatever_the_one_weight_of_the_presses() {
    let of_100 = judged(100.0, 0.0);
    for weight_n in [2.0, 98.1] {
        let found = judged(weight_n, 0.0);
        let [error_mm, held, force_held, outside] = found;
        assert!(
            error_mm < 10.0 && held >= 0.9 && force_held >= 0.9 && outside <= 0.03,
            "{weight_n}: {found:?}"
        );
        assert!((error_mm - of_100[0]).abs() < 0.05 * of_100[0], "{weight_n}: {found:?} beside {of_100:?}");
    }
}

#[test]
fn nothing_but_proportion_to_the_force_is_learnt_from_one_weight() {
    use crate::estimator::{Auto, Estimator};
    use crate::fit::{Fit, FitTask};
    use crate::influence::{Influence, InfluenceLocator};
    let presses = |spread: f64| {
        let mut bench = Bench::strip(11, 20, 20);
        for (i, row) in bench.presses.iter_mut().enumerate() {
            row.force_n = Some(500.0 * (1.0 + if i % 2 == 0 { spread } else { -spread }));
        }
        let untouched = (0..10).map(|_| bench.row(Position::default(), 0.0)).collect::<Vec<_>>();
        bench.presses.extend(untouched);
        (bench.setup(), bench.recording())
    };
    let candidates = |setup: &Setup, recording: &Recording| {
        let task = FitTask::new(setup, recording);
        let candidates = |estimator: Estimator| {
            estimator.candidates(task).map(|all| all.iter().map(Estimator::name).collect::<Vec<_>>())
        };
        [Estimator::Influence(Influence::default()), Estimator::Auto(Auto::quick())].map(candidates)
    };
    let (setup, recording) = presses(0.02);
    let [own, auto] = candidates(&setup, &recording);
    assert_eq!((own, auto.unwrap()), (None, vec!["influence force-linear", "gaussian-process"]));
    let locator = Influence::default().fit_method(FitTask::new(&setup, &recording)).unwrap();
    assert!(matches!(locator, InfluenceLocator::ForceLinear(_)));
    let (setup, recording) = presses(0.5);
    let [own, _] = candidates(&setup, &recording);
    assert_eq!(own.unwrap().len(), Structure::STATED.len());
}

#[test]
fn presses_of_nearly_one_weight_leave_the_force_as_open() {
    let found @ [error_mm, held, force_held, outside] = judged(500.0, 0.02);
    assert!(error_mm < 10.0 && held >= 0.9 && force_held >= 0.9 && outside <= 0.03, "{found:?}");
}

#[test]
fn presses_of_nearly_one_weight_leave_the_force_open_over_a_decade() {
    let range_of = |forces_n: &[f64]| {
        let mut bench = Bench::strip(11, 9, 9);
        bench.presses = forces_n.iter().map(|force_n| bench.row(Position::along(0.1), *force_n)).collect();
        let recording = bench.recording();
        let presses =
            CalibrationRows::of_recording(&bench.setup(), &recording, Averaging::ByPlace, &[]).unwrap();
        PressForces::new(&presses, &Prior::smooth(bench.extent, &presses), None).range.unwrap().ends_n()
    };
    for weight_n in [98.1, 0.1 + 0.2, 1e-3, 196.2, 250.0, 500.0, 1000.0] {
        let (least_n, greatest_n) = range_of(&[weight_n; 9]);
        assert!(is_same_force(10.0 * least_n, weight_n) && is_same_force(greatest_n, 10.0 * weight_n));
    }
    assert_eq!(range_of(&[490.0, 510.0]), (50.0, 5000.0));
    assert_eq!(range_of(&[0.0, 0.5, 2.0, 3.5, 4.0]), (0.25, 25.0));
}
