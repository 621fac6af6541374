use super::*;
use crate::arrangement::Training;
use crate::estimator::{Estimator, Locator, contenders};
use crate::evaluation::{Calibration, Evaluation, limit_ratio};
use crate::gaussian_process::GaussianProcessEstimator;
use crate::simulate::{CleanSensors, simulate_contacts};
use palpate_mechanics::contact::Contact;
use palpate_mechanics::sensing::SensorKind::Deflection;
use palpate_mechanics::surface::Beam;
use palpate_mechanics::units::{gpa, mm, newtons, um};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn beam(force_n: Option<f64>) -> Setup {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0))).unwrap().with_force(force_n).unwrap()
}

fn presses() -> Recording {
    beam(Some(newtons(3.0))).simulate(&Training::even(20).repeated(10), 1).unwrap()
}

/// Locator of every learnt kind. Networks are trained briefly, to keep the test short.
fn learning_locators(setup: &Setup) -> Vec<Locator> {
    let presses = presses();
    let all = contenders(setup, &Estimator::default(), 20 * presses.rows.len());
    let learnt = all.iter().filter(|estimator| crate::estimator::is_learnt(estimator.kind()));
    let locators: Vec<Locator> = learnt
        .map(|estimator| estimator.fit_without_interval_check(FitTask::new(setup, &presses)).unwrap())
        .collect();
    assert_eq!(locators.len(), 5);
    locators
}

fn percent(
    locator: &Locator,
    readings: &[(Position, Vec<f64>)],
    is_so: impl Fn(&Estimate, Position) -> bool,
) -> f64 {
    let so = readings.iter().filter(|(at, reading)| is_so(&locator.locate(reading).unwrap(), *at));
    100.0 * so.count() as f64 / readings.len() as f64
}

/// Readings of 5 µm noise, with loads by `load` within 20–380 mm.
fn readings(
    load: impl Fn(&dyn Fn(f64, f64) -> Vec<f64>, f64, &mut Xoshiro256PlusPlus) -> Vec<f64>,
) -> Vec<(Position, Vec<f64>)> {
    let setup = beam(None);
    let sensors = CleanSensors::new(setup.surface().model().unwrap(), setup.layout());
    let at = |x_m: f64, force_n: f64| sensors.reading(Contact { position: Position::along(x_m), force_n });
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let one = |_| {
        let x_m = rng.random_range(0.02..0.38);
        let clean = load(&at, x_m, &mut rng);
        let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
        (Position::along(x_m), clean.into_iter().map(|reading| reading + um(5.0) * noise()).collect())
    };
    (0..400).map(one).collect()
}

fn covers(estimate: &Estimate, at: Position) -> bool {
    estimate.contact.uncertainty.is_some_and(|told| told.x_95_m.0 <= at.x_m && at.x_m <= told.x_95_m.1)
}

#[test]
fn learning_methods_mark_unexplained_readings_outside_model() {
    let outside = |estimate: &Estimate, _| estimate.status == Status::OutsideModel;
    let two = readings(|at, x_m, _| {
        let other_m = if x_m < 0.2 { x_m + 0.05 } else { x_m - 0.05 };
        at(x_m, 3.0).iter().zip(at(other_m, 3.0)).map(|(a, b)| a + b).collect()
    });
    let stuck = readings(|at, x_m, rng| {
        let mut reading = at(x_m, 3.0);
        reading[rng.random_range(0..8)] = 0.0;
        reading
    });
    let turned = readings(|at, x_m, _| {
        at(x_m, 3.0).into_iter().enumerate().map(|(i, r)| if i % 2 == 0 { r } else { -r }).collect()
    });
    let absurd = readings(|_, _, rng| (0..8).map(|_| 1e9 * rng.random_range(-1.0..1.0)).collect());
    let noise = readings(|_, _, _| vec![0.0; 8]);
    let clean = readings(|at, x_m, _| at(x_m, 3.0));
    for locator in learning_locators(&beam(Some(newtons(3.0)))) {
        let kind = locator.kind();
        for (name, wrong) in [("two", &two), ("stuck", &stuck), ("turned", &turned), ("absurd", &absurd)] {
            let told = percent(&locator, wrong, outside);
            assert!(told >= 99.0, "{kind}, {name}: {told} %");
        }
        let untouched = percent(&locator, &noise, |estimate, _| estimate.status == Status::NoContact);
        assert!(untouched >= 99.0, "{kind}: {untouched} % of noise");
        let located = percent(&locator, &clean, |estimate, _| estimate.status == Status::Located);
        assert!(located >= 99.0, "{kind}: {located} % of contacts");
    }
}

#[test]
fn intervals_hold_contacts_of_other_forces_than_the_presses() {
    for locator in learning_locators(&beam(None)) {
        for force_n in [1.5, 3.0, 6.0] {
            let clean = readings(|at, x_m, _| at(x_m, force_n));
            let covered = percent(&locator, &clean, covers);
            assert!((92.5..=99.0).contains(&covered), "{}, {force_n} N: {covered} %", locator.kind());
            let holds_itself = |estimate: &Estimate, _| {
                estimate.status == Status::OutsideModel || covers(estimate, estimate.contact.position)
            };
            assert_eq!(percent(&locator, &clean, holds_itself), 100.0, "{}", locator.kind());
        }
    }
}

#[test]
fn presses_of_one_force_do_not_extrapolate_to_another() {
    for locator in learning_locators(&beam(None)) {
        let estimate = locator.locate(&presses().rows[90].reading).unwrap();
        assert_eq!(estimate.contact.force_n, None, "{}", locator.kind());
    }
}

#[test]
fn estimates_beyond_an_edge_are_moved_onto_it() {
    let extent = beam(None).surface().extent();
    assert_eq!(nearest_on(extent, Position { x_m: -0.01, y_m: 0.3 }), Position::along(0.0));
    assert_eq!(nearest_on(extent, Position::along(0.41)), Position::along(0.4));
    let plane = Extent::plane(0.3, 0.2).unwrap();
    assert_eq!(nearest_on(plane, Position { x_m: 0.1, y_m: 0.25 }), Position { x_m: 0.1, y_m: 0.2 });
}

#[test]
fn a_file_keeps_the_check_and_refuses_a_wrong_one() {
    let setup = beam(Some(newtons(3.0)));
    let locator = Estimator::Neighbours(Default::default())
        .fit_without_interval_check(FitTask::new(&setup, &presses()))
        .unwrap();
    let text = locator.to_json().unwrap();
    assert_eq!(Locator::from_json(&text).unwrap(), locator);
    // First number of the check other than 0.
    let (before, check) = text.split_at(text.find("\"check\"").unwrap());
    let at = check.find(|c: char| ('1'..='9').contains(&c)).unwrap();
    let wrong = format!("{before}{}e80{}", &check[..=at], &check[at + 1..]).replacen("e80.", "e80, 0.", 1);
    let error = Locator::from_json(&wrong).unwrap_err().to_string();
    assert!(error.contains("e80 is beyond"), "{error}");
}

#[test]
fn checks_learn_from_few_rows_of_all_places() {
    let setup = beam(Some(newtons(3.0)));
    let many = setup.simulate(&Training::even(40).repeated(100), 0).unwrap();
    let few = ReadingCheck::thinned(&many);
    assert_eq!((few.rows.len(), few.distinct_positions().len()), (ReadingCheck::MOST_ROWS, 40));
    // Positions in turn: one row in eight would cover five of the forty.
    let in_turn: Vec<usize> = (0..many.rows.len()).map(|i| i % 40 * 100 + i / 40).collect();
    let few = ReadingCheck::thinned(&many.subset(&in_turn)).into_owned();
    assert_eq!((few.rows.len(), few.distinct_positions().len()), (ReadingCheck::MOST_ROWS, 40));
    let presses = presses();
    assert!(matches!(ReadingCheck::thinned(&presses), Cow::Borrowed(_)));
}

#[test]
fn comparisons_of_unknown_forces_judge_by_several() {
    let training = Training { force_n: Some(2.0), ..Training::even(10) };
    let forces = |setup: &Setup| -> Vec<f64> {
        let calibration = Calibration::from_training(setup, &training).unwrap().at_forces_of_use();
        let judged = calibration.simulate(0).unwrap().held_out;
        judged.rows.iter().take(4).filter_map(|row| row.force_n).collect()
    };
    assert_eq!(forces(&beam(None)), [2.0, 1.0, 4.0, 2.0]);
    assert_eq!(forces(&beam(Some(3.0))), [3.0; 4]);
}

#[test]
fn a_gaussian_process_is_as_good_at_other_forces() {
    // ln‖r‖ determines the position at the one force of the presses, and would shift it by 25 mm at half that
    // force.
    let setup = beam(None);
    let locator = Estimator::GaussianProcess(Default::default())
        .fit_without_interval_check(FitTask::new(&setup, &presses()))
        .unwrap();
    let contacts: Vec<Contact> =
        (20..=380).map(|x| Contact { position: Position::along(mm(f64::from(x))), force_n: 1.5 }).collect();
    let judged = simulate_contacts(&beam(Some(3.0)), &contacts, 1, 3).unwrap();
    let ratio = limit_ratio(&setup, &Evaluation::new(&locator, &judged).unwrap()).unwrap();
    assert!((0.9..1.4).contains(&ratio), "{ratio} × the limit");
}

/// Soft sheet that influence functions explain less well than regression does.
#[test]
fn own_intervals_stand_where_they_are_shorter() {
    let Some((setup, recording)) = crate::fixtures::sheet_recording() else { return };
    let few: Vec<usize> = thinned(recording.rows.len(), 200).collect();
    let recording = recording.subset(&few);
    let task = FitTask::new(&setup, &recording);
    let locator = Estimator::GaussianProcess(GaussianProcessEstimator::default())
        .fit_without_interval_check(task)
        .unwrap();
    let check = locator.check.as_ref().unwrap();
    assert!(check.keeps_intervals());
    let text = serde_json::to_string(check).unwrap();
    assert_eq!(&serde_json::from_str::<Box<ReadingCheck>>(&text).unwrap(), check);
    let neither = serde_json::from_str::<ReadingCheck>("{}").unwrap_err();
    assert!(neither.to_string().contains("either `influence` or `digit`"), "{neither}");
    // At the pressed forces, and beyond them.
    let widened = ReadingCheck { own_intervals: None, ..(**check).clone() };
    let extent = setup.surface().extent();
    let (mut kept, mut beyond) = (0, 0);
    for row in recording.rows.iter().step_by(5) {
        let own = locator.method.locate(&row.reading);
        let harder = ReadingCheck {
            own_intervals: Some(OwnIntervals { force_n: Some((1e3, 2e3)) }),
            ..widened.clone()
        };
        let [checked, other, alone] =
            [&**check, &harder, &widened].map(|check| check.checked(&row.reading, own, extent));
        assert_eq!(other, alone);
        kept += usize::from(checked != alone);
        beyond += usize::from(checked == alone);
    }
    assert!(kept > beyond, "{kept}, {beyond}");
}

#[test]
fn known_force_leaves_intervals_to_the_check() {
    let setup = beam(Some(newtons(3.0)));
    let locator = Estimator::GaussianProcess(GaussianProcessEstimator::default())
        .fit_without_interval_check(FitTask::new(&setup, &presses()))
        .unwrap();
    assert!(!locator.check.unwrap().keeps_intervals());
}
