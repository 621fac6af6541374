use super::*;
use crate::evaluation::CoveredCoordinates;
use crate::fit::Fit;
use crate::fixtures::paper;
use crate::recording::Row;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Progress;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::atomic::{AtomicUsize, Ordering};

fn all_candidates(task: FitTask) -> Vec<Estimator> {
    Estimator::Auto(Auto::default()).candidates(task).unwrap()
}

#[test]
fn slow_estimators_are_stopped_and_omitted() {
    let bench = paper(5e-6, 2);
    let recording = bench.simulate(0);
    // Time passes only while later estimators are fitted.
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
    let choice = choose(task, all_candidates(task), Some(limit)).unwrap();
    // Fits that end ahead of the first check of the watch are not stopped.
    assert!(choice.candidates.iter().any(|tried| tried.name == "influence"), "{:?}", choice.candidates);
    assert_eq!(choice.candidates.len() + choice.omitted.len(), Estimator::contenders(&bench.setup).len());
    for kind in ["network", "network-lm", "gaussian-process"] {
        assert!(choice.omitted.contains(&(kind, NOT_IN_TIME.to_owned())), "{kind}: {:?}", choice.omitted);
    }
}

#[test]
fn first_estimator_stops_too_without_a_choice() {
    let bench = paper(5e-6, 2);
    let recording = bench.simulate(0);
    // Each call of the clock is a second.
    let looks = AtomicUsize::new(0);
    let clock = || looks.fetch_add(1, Ordering::Relaxed) as f64;
    let limit = TimeLimit { clock: &clock, seconds: 2.0 };
    let task = FitTask::new(&bench.setup, &recording);
    let error = choose(task, all_candidates(task), Some(limit)).unwrap_err();
    assert_eq!(error, FitError::NotInTime { seconds: 2.0, stopped: Some("influence") });
    let told = error.to_string();
    assert!(
        told.starts_with("no estimator was done within the 2 s") && told.contains("`influence` was stopped"),
        "{told}"
    );
    // The caller's watch stops it for other reasons.
    let stop = |_| false;
    let task = FitTask::new(&bench.setup, &recording).watch(Watch::new(&stop));
    let limit = TimeLimit { clock: &|| 0.0, seconds: 2.0 };
    assert!(Cancelled::caused(&choose(task, all_candidates(task), Some(limit)).unwrap_err()));
}

#[test]
fn chooses_among_the_named_kinds_alone() {
    let bench = paper(5e-6, 2);
    let recording = bench.simulate(0);
    let only = |kinds: &[&str]| {
        let auto = Auto { only: kinds.iter().map(|kind| (*kind).to_owned()).collect() };
        Estimator::Auto(auto).fit_task(FitTask::new(&bench.setup, &recording))
    };
    let choice = only(&["neighbours", "centroid"]).unwrap().provenance.choice;
    assert_eq!(choice.len(), 2, "{choice:?}");
    assert_eq!(only(&["digit"]).unwrap_err(), FitError::NoCandidate);
}

/// Presses of a line without a model, by two forces at each position. Four channels read a power of the force
/// times a bump.
fn pressed_line(places: usize, power: f64) -> (Setup, Recording) {
    const LENGTH_M: f64 = 0.1;
    const COUNTS: f64 = 1000.0;
    let setup = Setup::measured(LENGTH_M, &["a", "b", "c", "d"]).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut press = |x_m: f64, force_n: f64| {
        let bump = |c: usize| (-((x_m - 0.02 * (c as f64 + 1.0)) / 0.03).powi(2)).exp();
        let mut noise = || rng.random_range(-1.0..1.0);
        let reading = (0..4).map(|c| COUNTS * force_n.powf(power) * bump(c) + noise()).collect();
        let position = Position::along(x_m);
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading }
    };
    let place_m = |place: usize| LENGTH_M * (place as f64 + 0.5) / places as f64;
    let forces_n = [0.0, 1.0, 4.0];
    let rows = (0..places).flat_map(|place| forces_n.map(|force_n| press(place_m(place), force_n))).collect();
    let recording = Recording::new(setup.layout(), "bench", rows);
    (setup, recording)
}

#[test]
fn influence_chooses_its_structure_at_held_out_places() {
    // Readings in proportion to the square root of the force contradict force-linear.
    let (setup, recording) = pressed_line(19, 0.5);
    let task = FitTask::new(&setup, &recording);
    let candidates = Estimator::Influence(Influence::default()).candidates(task).unwrap();
    let choice = choose(task, candidates, None).unwrap();
    assert_eq!(choice.candidates.len(), Structure::STATED.len(), "{choice:?}");
    assert_eq!(choice.candidates[3].name, "influence force-linear", "{choice:?}");
    assert_eq!(choice.best.name(), choice.candidates[0].name);
}

#[test]
fn the_simplest_structure_that_is_not_significantly_worse_is_chosen() {
    let trial = |structure: Structure, errors_mm: &dyn Fn(usize) -> f64| {
        let estimator = Estimator::Influence(Influence { structure, ..Influence::default() });
        let located = (0..40).map(|i| {
            let truth = Position::along(1e-3 * i as f64);
            let error_m = 1e-3 * errors_mm(i);
            EvaluatedContact {
                truth,
                force_n: None,
                estimate: Position::along(truth.x_m + error_m),
                covered: Some(CoveredCoordinates { x: true, y: None }),
                interval_score_m: Some(4.0 * error_m),
                status: None,
                force: None,
            }
        });
        let evaluation = Evaluation { extent: Extent::line(0.1).unwrap(), located: located.collect() };
        let tried = figures(estimator.name(), &evaluation).unwrap();
        Trial { estimator, errors: tried, evaluation }
    };
    let scattered = |i: usize| if i.is_multiple_of(2) { 1.0 } else { 2.0 };
    let other_places = |i: usize| if i.is_multiple_of(2) { 2.0 } else { 1.1 };
    let equal = [trial(Structure::ForceMonotone, &scattered), trial(Structure::ForceLinear, &other_places)];
    assert_eq!(chosen(&equal), 1);
    let worse = |i: usize| 1.3 * scattered(i);
    let worse = [trial(Structure::ForceMonotone, &scattered), trial(Structure::ForceLinear, &worse)];
    assert_eq!(chosen(&worse), 0);
    let simpler = [trial(Structure::ForceLinear, &scattered), trial(Structure::Free, &other_places)];
    assert_eq!(chosen(&simpler), 0);
    assert_eq!(chosen(&[]), 0);
}

#[test]
fn without_time_for_a_comparison_the_evidence_decides() {
    let (setup, recording) = pressed_line(19, 1.0);
    let task = FitTask::new(&setup, &recording);
    let looks = AtomicUsize::new(0);
    let clock = || looks.fetch_add(1, Ordering::Relaxed) as f64;
    let limit = TimeLimit { clock: &clock, seconds: 2.0 };
    let influence = Estimator::Influence(Influence::default());
    let choice = influence.decide(task, Some(limit)).unwrap();
    assert_eq!(choice, None);
    let locator = influence.fit_decided(task, choice.as_ref()).unwrap();
    assert!(locator.provenance.choice.is_empty() && locator.interval_check.is_some());
}

#[test]
fn few_places_choose_the_structure_by_their_evidence() {
    let (setup, recording) = pressed_line(18, 1.0);
    let influence = Estimator::Influence(Influence::default());
    assert!(influence.candidates(FitTask::new(&setup, &recording)).is_none());
    assert!(influence.fit(&setup, &recording).unwrap().provenance.choice.is_empty());
}

#[test]
fn a_stated_structure_and_a_nuisance_coordinate_leave_no_choice() {
    let (setup, mut recording) = pressed_line(19, 1.0);
    let stated = Influence { structure: Structure::ForceLinear, ..Influence::default() };
    assert!(Estimator::Influence(stated).candidates(FitTask::new(&setup, &recording)).is_none());
    recording.rows.iter_mut().for_each(|row| row.nuisances = vec![1.0]);
    let influence = Estimator::Influence(Influence::default());
    assert!(influence.candidates(FitTask::new(&setup, &recording)).is_none());
}
