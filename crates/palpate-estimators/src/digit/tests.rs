use proptest::prelude::*;

use super::*;
use crate::estimator::{ContactEstimate, Estimator, Locator, Method, Status};
use crate::fit::{Fit, FitTask};
use crate::fixtures;
use crate::setup::Setup;
use crate::simulate::{clean_reading, simulate_at};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Digit, ForceDirection, SurfaceSpec};

fn example() -> Setup {
    fixtures::digit(ForceDirection::Normal, 4.0).setup
}

fn digit(setup: &Setup) -> Digit {
    let SurfaceSpec::Digit(digit) = setup.surface() else { panic!("{:?}", setup.surface()) };
    *digit
}

fn locator(setup: &Setup, theory: DigitTheory) -> Locator {
    let pressed = setup.clone().known_force(1.0).unwrap();
    let recording = simulate_at(&pressed, &[Position::along(0.1)], 1, 0).unwrap();
    let config = Estimator::Digit(DigitEstimator::of_theory(theory));
    config.fit_without_interval_check(FitTask::new(setup, &recording)).unwrap()
}

fn method(locator: &Locator) -> &DigitLocator {
    let Method::Digit(digit) = &locator.method else { panic!("{}", locator.kind()) };
    digit
}

fn clean(setup: &Setup, x_m: f64, force_n: f64) -> Vec<f64> {
    let contact = Contact { position: Position::along(x_m), force_n };
    clean_reading(setup.surface().model().unwrap(), setup.layout(), contact)
}

/// Results on contacts between the second gauge and the tip.
#[derive(Debug, Default)]
struct Tally {
    /// Number of contacts, and of those above five standard deviations at the second gauge.
    counts: [f64; 2],
    /// Mean errors of position and force of the latter, over those at the Cramér–Rao bound.
    ratios: [f64; 2],
    /// Coverage of the 95 % intervals of position and force in %, for all contacts.
    covered: [f64; 2],
    /// Largest error of the centre line of the length.
    shape_percent: f64,
    /// Share of `located` among the latter contacts in %.
    located: f64,
}

fn tally(setup: &Setup, force_n: f64, from_m: f64, count: usize, seed: u64) -> Tally {
    let l = digit(setup).length_m();
    let share = |i: usize| (i as f64 + 0.5) / count as f64;
    let positions: Vec<Position> =
        (0..count).map(|i| Position::along(from_m + share(i) * (l - from_m))).collect();
    let pressed = setup.clone().known_force(force_n).unwrap();
    let recording = simulate_at(&pressed, &positions, 1, seed).unwrap();
    let (locator, limit) = (locator(setup, DigitTheory::Exact), setup.cramer_rao_bound().unwrap());
    let mut tally = Tally::default();
    let (mut errors, mut bounds) = ([0.0; 2], [0.0; 2]);
    for row in &recording.rows {
        let truth = Contact { position: row.position, force_n };
        let estimate = locator.locate(&row.reading).unwrap();
        let ContactEstimate { position, force_n: found_n, uncertainty } = estimate.contact;
        let (error_m, error_n) = (position.distance_m(truth.position), (found_n.unwrap() - force_n).abs());
        let (low_m, high_m) = uncertainty.unwrap().x_95_m;
        let sd_n = uncertainty.unwrap().covariance[5].sqrt();
        tally.counts[0] += 1.0;
        tally.covered[0] += f64::from((low_m..=high_m).contains(&truth.position.x_m));
        tally.covered[1] += f64::from(error_n <= 1.96 * sd_n);
        let shape = method(&locator).shape(&estimate.contact, 40);
        tally.shape_percent = tally.shape_percent.max(100.0 * shape.distance_m(&digit(setup), truth) / l);
        if limit.whitened_reading(truth)[1].abs() >= 5.0 {
            let bound = limit.bound_at(truth, Force::Unknown).unwrap();
            tally.counts[1] += 1.0;
            tally.located += f64::from(estimate.status == Status::Located);
            errors = [errors[0] + error_m, errors[1] + error_n];
            let mean_n = (2.0 / std::f64::consts::PI).sqrt() * bound.sd_force_n.unwrap();
            bounds = [bounds[0] + bound.mean_error_m(), bounds[1] + mean_n];
        }
    }
    tally.ratios = [errors[0] / bounds[0], errors[1] / bounds[1]];
    tally.covered = tally.covered.map(|held| 100.0 * held / tally.counts[0]);
    tally.located *= 100.0 / tally.counts[1];
    tally
}

/// Printed with --nocapture.
#[test]
fn beyond_the_second_gauge_position_force_and_shape_are_at_their_limits() {
    for direction in [ForceDirection::Normal, ForceDirection::Vertical] {
        let setup = fixtures::digit(direction, 4.0).setup;
        let mut covered = [0.0; 2];
        for (i, force_n) in [1.0, 3.0, 5.0, 8.0, 13.0].into_iter().enumerate() {
            let tally = tally(&setup, force_n, 0.020, 400, i as u64);
            let turn = digit(&setup).shape(Contact { position: Position::along(0.12), force_n }).angle(0.12);
            println!("{direction:?} {force_n} N, tip turned by {:.0}°: {tally:.3?}", turn.to_degrees());
            assert!(tally.ratios.iter().all(|ratio| *ratio < 1.2), "{tally:?}");
            assert!(tally.located > 97.0 && tally.counts[1] > 390.0, "{tally:?}");
            assert!(tally.shape_percent < 0.5, "{tally:?}");
            covered = [covered[0] + tally.covered[0] / 5.0, covered[1] + tally.covered[1] / 5.0];
        }
        println!("{direction:?}: 95 % intervals hold {covered:.1?} %");
        assert!(covered.iter().all(|percent| (93.0..=97.0).contains(percent)), "{covered:?}");
    }
}

#[test]
fn soft_contacts_beside_the_tip_are_in_their_intervals_and_so_is_every_estimate() {
    const COUNT: usize = 300;
    let setup = fixtures::digit(ForceDirection::Normal, 4.0).setup;
    for known in [false, true] {
        for (force_n, x_mm) in
            [(0.01, 110.0), (0.01, 118.0), (0.01, 119.7), (0.05, 118.0), (0.05, 119.7), (0.5, 119.7)]
        {
            let pressed = setup.clone().known_force(force_n).unwrap();
            let locator = locator(if known { &pressed } else { &setup }, DigitTheory::Exact);
            let position = Position::along(1e-3 * x_mm);
            let recording = simulate_at(&pressed, &[position], COUNT, 9).unwrap();
            let (mut told, mut held) = (0, 0);
            for row in &recording.rows {
                let estimate = locator.locate(&row.reading).unwrap();
                let Some(uncertainty) = estimate.contact.uncertainty else { continue };
                let (low_m, high_m) = uncertainty.x_95_m;
                told += 1;
                held += usize::from((low_m..=high_m).contains(&position.x_m));
                let found_m = estimate.contact.position.x_m;
                assert!((low_m..=high_m).contains(&found_m), "{found_m}: {low_m} to {high_m}");
            }
            println!("{force_n} N at {x_mm} mm, known {known}: {held} of {told} held");
            assert!(
                told >= COUNT / 2 && 100 * held >= 90 * told,
                "{force_n} N at {x_mm} mm: {held} of {told}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn clean_readings_are_located_to_many_digits(x in 0.021..0.12f64, load in 0.05..7.0f64, vertical: bool) {
        // Within the noise of a gauge both of its sides explain a reading.
        prop_assume!([0.04, 0.06, 0.08].iter().all(|gauge_m| (x - gauge_m).abs() > 5e-4));
        let direction = if vertical { ForceDirection::Vertical } else { ForceDirection::Normal };
        let setup = fixtures::digit(direction, 4.0).setup;
        let force_n = load * digit(&setup).bending_stiffness() / (x * x);
        let estimate = locator(&setup, DigitTheory::Exact).locate(&clean(&setup, x, force_n)).unwrap();
        prop_assert_eq!(estimate.status, Status::Located);
        prop_assert!((estimate.contact.position.x_m - x).abs() < 1e-9, "{:?}", estimate.contact);
        prop_assert!((estimate.contact.force_n.unwrap() / force_n - 1.0).abs() < 1e-7);
    }
}

#[test]
fn contact_at_one_gauge_is_ambiguous_for_an_unknown_force() {
    let setup = example();
    let reading = clean(&setup, 0.014, 2.0);
    let estimate = locator(&setup, DigitTheory::Exact).locate(&reading).unwrap();
    assert_eq!(estimate.status, Status::Ambiguous);
    let ContactEstimate { position, force_n, uncertainty } = estimate.contact;
    let (low_m, high_m) = uncertainty.unwrap().x_95_m;
    assert!(low_m < 0.006 && high_m > 0.018 && high_m < 0.021, "{low_m} {high_m}");
    // A single gauge determines the moment: force times lever arm.
    assert!((force_n.unwrap() * (position.x_m - 0.004) / (2.0 * 0.010) - 1.0).abs() < 0.02);
    let known = setup.clone().known_force(2.0).unwrap();
    let estimate = locator(&known, DigitTheory::Exact).locate(&reading).unwrap();
    assert_eq!(estimate.status, Status::Located);
    assert!((estimate.contact.position.x_m - 0.014).abs() < 1e-9);
}

#[test]
fn unexplained_readings_are_outside_model() {
    let setup = example();
    let locator = locator(&setup, DigitTheory::Exact);
    let status = |reading: &[f64]| locator.locate(reading).unwrap().status;
    assert_eq!(status(&[1e-6, -1e-6, 0.5e-6, 0.0, -0.5e-6]), Status::NoContact);
    // Contacts between the clamp and the first gauge strain no gauge.
    assert_eq!(status(&clean(&setup, 0.003, 3.0)), Status::NoContact);
    let pulled: Vec<f64> = clean(&setup, 0.09, 3.0).into_iter().map(|strain| -strain).collect();
    assert_eq!(status(&pulled), Status::OutsideModel);
    let mut broken = clean(&setup, 0.09, 3.0);
    broken[2] += 50e-6;
    assert_eq!(status(&broken), Status::OutsideModel);
    assert_eq!(status(&[1.0, -1.0, 1e300, -1e300, 1e-300]), Status::OutsideModel);
}

#[test]
fn disabled_and_saturated_gauges_are_excluded() {
    let mut setup = example();
    setup
        .edit_sensors(|sensors| {
            sensors.iter_mut().for_each(|sensor| sensor.channel.range = Some((-1500e-6, 1500e-6)));
        })
        .unwrap();
    let mut locator = locator(&setup, DigitTheory::Exact);
    let mut reading = clean(&setup, 0.09, 2.0);
    assert!(reading[0] < -1500e-6 && reading[2] > -1500e-6);
    reading[0] = -1500e-6;
    let position_m = |locator: &Locator, reading: &[f64]| {
        let estimate = locator.locate(reading).unwrap();
        assert_eq!(estimate.status, Status::Located);
        estimate.contact.position.x_m
    };
    assert!((position_m(&locator, &reading) - 0.09).abs() < 1e-8);
    locator.leave_out(2).unwrap();
    reading[2] = 0.0;
    assert!((position_m(&locator, &reading) - 0.09).abs() < 1e-8);
    locator.leave_out(0).unwrap();
    locator.leave_out(1).unwrap();
    assert_eq!(locator.leave_out(3).unwrap_err().to_string(), "too few channels would remain in use");
}

#[test]
fn the_linear_theory_is_right_for_small_forces_and_far_off_for_large_ones() {
    let setup = fixtures::digit(ForceDirection::Vertical, 4.0).setup;
    let linear = locator(&setup, DigitTheory::Linear);
    let off_mm = |force_n: f64| {
        let contact = linear.locate(&clean(&setup, 0.09, force_n)).unwrap().contact;
        ((contact.position.x_m - 0.09) * 1e3, contact.force_n.unwrap() / force_n)
    };
    let (small_mm, small) = off_mm(0.02);
    assert!(small_mm.abs() < 1e-3 && (small - 1.0).abs() < 1e-4, "{small_mm} {small}");
    let (large_mm, large) = off_mm(5.0);
    println!("at 5 N the linear theory is off by {large_mm:.2} mm and finds {large:.3} of the force");
    assert!(large_mm.abs() > 2.0, "{large_mm}");
}

#[test]
fn the_shape_has_an_honest_band() {
    let setup = example();
    let locator = locator(&setup, DigitTheory::Exact);
    let truth = Contact { position: Position::along(0.07), force_n: 4.0 };
    let pressed = setup.clone().known_force(truth.force_n).unwrap();
    let recording = simulate_at(&pressed, &[truth.position], 400, 3).unwrap();
    let (mut squares, mut variances) = (0.0, 0.0);
    for row in &recording.rows {
        let shape = locator.shape(&locator.locate(&row.reading).unwrap(), 10).unwrap();
        let tip = shape.tip().unwrap();
        let [x_m, y_m] = digit(&setup).shape(truth).point(0.12);
        squares += (tip.x_m - x_m).powi(2) + (tip.y_m - y_m).powi(2);
        variances += tip.sd_m.powi(2);
        assert_eq!((shape.points[0].x_m, shape.points[0].y_m), (0.0, 0.0));
    }
    let ratio = (squares / variances).sqrt();
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn a_locator_survives_its_file_and_bad_numbers_do_not() {
    let locator = locator(&example(), DigitTheory::Exact);
    let text = locator.to_json().unwrap();
    assert_eq!(Locator::from_json(&text).unwrap(), locator);
    let refused = |change: fn(&mut DigitLocator)| {
        let mut bad = locator.clone();
        if let Method::Digit(digit) = &mut bad.method {
            change(digit);
        }
        bad.check().unwrap_err().to_string()
    };
    let shown = [
        refused(|digit| digit.layout.edit(|sensors| sensors[1].position.x_m = 0.2).unwrap()),
        refused(|digit| digit.layout.edit(|sensors| sensors[0].channel.noise_sd = 0.0).unwrap()),
        refused(|digit| digit.force_n = Some(-1.0)),
        refused(|digit| digit.layout.edit(|sensors| drop(sensors.pop())).unwrap()),
        refused(|digit| digit.layout.edit(|sensors| sensors[2].kind = SensorKind::Slope).unwrap()),
        refused(|digit| {
            digit
                .layout
                .edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.disabled = true))
                .unwrap();
        }),
    ];
    insta::assert_snapshot!(shown.join("\n"));
}

#[test]
fn benches_that_do_not_suit_are_refused_in_words() {
    let paper = fixtures::paper(5e-6, 1).setup;
    let good = example();
    let refused = |setup: &Setup| {
        let pressed = setup.clone().known_force(1.0).unwrap();
        let recording = simulate_at(&pressed, &[Position::along(0.1)], 1, 0).unwrap();
        let config = Estimator::Digit(DigitEstimator::default());
        config.fit_without_interval_check(FitTask::new(setup, &recording)).unwrap_err().to_string()
    };
    let with = |change: &dyn Fn(&mut Setup)| {
        let mut setup = good.clone();
        change(&mut setup);
        refused(&setup)
    };
    let shown = [
        refused(&paper),
        with(&|setup| setup.edit_sensors(|sensors| sensors[3].kind = SensorKind::Deflection).unwrap()),
        with(&|setup| setup.edit_sensors(|sensors| sensors[3].channel.noise_sd = 0.0).unwrap()),
        with(&|setup| setup.edit_sensors(|sensors| sensors.truncate(1)).unwrap()),
        refused(&good.clone().known_force(20.0).unwrap()),
    ];
    insta::assert_snapshot!(shown.join("\n"));
}

#[test]
fn for_small_forces_influence_functions_are_at_the_limit() {
    let rig = fixtures::digit(ForceDirection::Normal, 0.3);
    let recording = rig.simulate(1);
    let config = Estimator::Influence(crate::influence::Influence {
        source: crate::influence::InfluenceSource::Mechanics,
        ..Default::default()
    });
    let locator = config.fit_without_interval_check(FitTask::new(&rig.setup, &recording)).unwrap();
    let limit = rig.setup.cramer_rao_bound().unwrap();
    let positions: Vec<Position> =
        (0..200).map(|i| Position::along(0.03 + 0.09 * f64::from(i) / 200.0)).collect();
    let judged = simulate_at(&rig.training_setup(), &positions, 1, 9).unwrap();
    let (mut error_m, mut bound_m) = (0.0, 0.0);
    for row in &judged.rows {
        error_m += locator.locate(&row.reading).unwrap().contact.position.distance_m(row.position);
        let contact = Contact { position: row.position, force_n: 0.3 };
        bound_m += limit.bound_at(contact, Force::Unknown).unwrap().mean_error_m();
    }
    println!("influence functions at 0.3 N: {:.3} × limit", error_m / bound_m);
    assert!(error_m < 1.2 * bound_m, "{error_m} {bound_m}");
}
