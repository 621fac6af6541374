//! The time that the choice of an estimator may take.

use super::*;
use crate::fixtures::paper;
use palpate_numerics::watch::Progress;
use std::sync::atomic::{AtomicUsize, Ordering};

#[test]
fn estimators_that_are_not_done_in_time_are_stopped_and_left_out() {
    let bench = paper(5e-6, 2);
    let recording = bench.simulate(0);
    // Time passes only while other estimators than the first are tried.
    let done = AtomicUsize::new(0);
    let observe = |progress| {
        if let Progress::Counted { unit: "estimators", done: count, .. } = progress {
            done.store(count, Ordering::Relaxed);
        }
        true
    };
    let clock = || done.load(Ordering::Relaxed) as f64;
    let limit = TimeLimit { clock: &clock, seconds: 1.0 };
    let task = FitTask::new(&bench.setup, &recording).watch(Watch::new(&observe));
    let choice = choose(task, Some(limit)).unwrap();
    // Fits that are done before they are watched at all need no stopping.
    assert!(choice.tried.iter().any(|tried| tried.name == "influence"), "{:?}", choice.tried);
    assert_eq!(choice.tried.len() + choice.left_out.len(), Estimator::contenders(&bench.setup).len());
    for kind in ["network", "network-lm", "gaussian-process"] {
        assert!(choice.left_out.contains(&(kind, NOT_IN_TIME.to_owned())), "{kind}: {:?}", choice.left_out);
    }
}

#[test]
fn the_first_estimator_is_stopped_too_and_nothing_is_chosen() {
    let bench = paper(5e-6, 2);
    let recording = bench.simulate(0);
    // Each look at the clock is a second.
    let looks = AtomicUsize::new(0);
    let clock = || looks.fetch_add(1, Ordering::Relaxed) as f64;
    let limit = TimeLimit { clock: &clock, seconds: 2.0 };
    let error = choose(FitTask::new(&bench.setup, &recording), Some(limit)).unwrap_err();
    assert_eq!(error, FitError::NotInTime { seconds: 2.0, stopped: Some("influence") });
    let told = error.to_string();
    assert!(
        told.starts_with("no estimator was done within the 2 s") && told.contains("`influence` was stopped"),
        "{told}"
    );
    // Whoever watches stops it for reasons of their own.
    let stop = |_| false;
    let task = FitTask::new(&bench.setup, &recording).watch(Watch::new(&stop));
    let limit = TimeLimit { clock: &|| 0.0, seconds: 2.0 };
    assert!(Cancelled::caused(&choose(task, Some(limit)).unwrap_err()));
}
