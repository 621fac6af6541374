use std::sync::LazyLock;

use palpate_core::Status;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{GaussianProcessError, GaussianProcessEstimator, GaussianProcessLocator};
use crate::arrangement::Training;
use crate::evaluation::{ErrorSummary, cross_validate};
use crate::features::FeatureKind;
use crate::fit::{Fit, FitTask, Locate};
use crate::fixtures::{pad_recording, raw_recording, raw_setup, sheet_recording, strip_recording};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind::Deflection;
use palpate_mechanics::surface::{Beam, Extent};
use palpate_mechanics::units::{gpa, mm, newtons, um};

static EXTENT: LazyLock<Extent> = LazyLock::new(|| Extent::line(0.4).unwrap());

fn fit(setup: &Setup, recording: &Recording) -> Result<GaussianProcessLocator, GaussianProcessError> {
    let task = FitTask::new(setup, recording).seed(1);
    GaussianProcessEstimator::default().fit_method(task)
}

fn bells(x_m: f64, force_n: f64, noise: f64, rng: &mut Xoshiro256PlusPlus) -> Row {
    let mut channel = |i: usize| {
        let error: f64 = StandardNormal.sample(rng);
        let off = (x_m - 0.05 - 0.1 * i as f64) / 0.12;
        force_n * (-off * off).exp() + noise * error
    };
    let reading = (0..4).map(&mut channel).collect();
    Row { position: Position::along(x_m), force_n: None, nuisances: Vec::new(), time_s: None, reading }
}

/// Repeats are not independent observations; as such they would make functions flat about every position.
#[test]
fn repeats_make_it_better() {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0))).unwrap();
    let setup = setup.known_force(newtons(3.0)).unwrap();
    let mut contacts = setup.simulate(&Training::even(79), 100).unwrap();
    contacts.rows.retain(|row| (mm(20.0)..=mm(380.0)).contains(&row.position.x_m));
    let mean_error_m = |positions: usize, repeats: usize, seed: u64| {
        let presses = setup.simulate(&Training::even(positions).repeated(repeats), seed).unwrap();
        let locator = fit(&setup, &presses).unwrap();
        let off = |row: &Row| (locator.locate(&row.reading).contact.position.x_m - row.position.x_m).abs();
        palpate_numerics::mean(contacts.rows.iter().map(off))
    };
    for (positions, seed) in [(10, 0), (10, 1), (15, 2), (15, 3)] {
        let [once, five, ten] = [1, 5, 10].map(|repeats| mean_error_m(positions, repeats, seed));
        assert!(five < once && ten < 1.2 * five, "{positions} positions: {once}, {five}, {ten} m");
    }
}

#[test]
fn it_locates_and_its_intervals_cover() {
    for force_n in [Some(3.0), None] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let press = |rng: &mut Xoshiro256PlusPlus| {
            let force_n = force_n.unwrap_or_else(|| rng.random_range(1.0..5.0));
            let x_m = rng.random_range(0.0..0.4);
            bells(x_m, force_n, 0.01, rng)
        };
        let setup = raw_setup(*EXTENT, 4, force_n);
        let recording = raw_recording((0..200).map(|_| press(&mut rng)).collect());
        let locator = fit(&setup, &recording).unwrap();
        assert_eq!(locator.check(&setup), Ok(()));
        let (mut covered, mut square_m2) = (0, 0.0);
        for _ in 0..400 {
            let row = press(&mut rng);
            let estimate = locator.locate(&row.reading);
            let (low_m, high_m) = estimate.contact.uncertainty.unwrap().x_95_m;
            covered += i32::from((low_m..high_m).contains(&row.position.x_m));
            square_m2 += (estimate.contact.position.x_m - row.position.x_m).powi(2) / 400.0;
            assert_eq!(estimate.contact.force_n, force_n);
        }
        assert!(square_m2.sqrt() < 2e-3, "{force_n:?}: {} m", square_m2.sqrt());
        assert!((370..=396).contains(&covered), "{force_n:?}: {covered} of 400");
    }
}

#[test]
fn a_pad_is_two_dimensional() {
    let extent = Extent::plane(0.2, 0.1).unwrap();
    let rows = (0..120).map(|i| {
        let (x_m, y_m) = (0.02 * f64::from(i % 11), 0.01 * f64::from(i / 11));
        let (u, v) = (x_m / 0.2, y_m / 0.1);
        let mut reading = vec![(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v, 5.0];
        reading[..4].iter_mut().for_each(|value| *value *= 0.4 + 0.2 * f64::from(i % 4));
        Row { position: Position { x_m, y_m }, force_n: None, nuisances: Vec::new(), time_s: None, reading }
    });
    let setup = raw_setup(extent, 5, None);
    let locator = fit(&setup, &raw_recording(rows.collect())).unwrap();
    assert_eq!(locator.check(&setup), Ok(()));
    // Between the grid points, with half of the size, and another reading of the disabled channel.
    let estimate = locator.locate(&[0.375, 0.125, 0.375, 0.125, 0.0].map(|r: f64| 0.5 * r));
    assert!((estimate.contact.position.x_m - 0.05).abs() < 1e-3, "{estimate:?}");
    assert!((estimate.contact.position.y_m - 0.05).abs() < 1e-3, "{estimate:?}");
    let uncertainty = estimate.contact.uncertainty.unwrap();
    assert!(uncertainty.y_95_m.0 < 0.05 && 0.05 < uncertainty.y_95_m.1);
    assert_eq!(estimate.status, Status::Located);
}

#[test]
fn position_beyond_the_edge_is_reported() {
    // Presses up to the edge, and the reading of a press beyond it.
    let rows = (0..41).map(|i| {
        let x_m = 0.01 * f64::from(i);
        Row {
            position: Position::along(x_m),
            force_n: None,
            nuisances: Vec::new(),
            time_s: None,
            reading: vec![x_m, 1.0 - x_m],
        }
    });
    let setup = raw_setup(*EXTENT, 2, Some(1.0));
    let locator = fit(&setup, &raw_recording(rows.collect())).unwrap();
    assert_eq!(locator.locate(&[0.42, 0.58]).status, Status::OutsideSurface);
    assert_eq!(locator.locate(&[0.2, 0.8]).status, Status::Located);
}

#[test]
fn recordings_without_information_are_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let setup = raw_setup(*EXTENT, 4, None);
    let one_place = raw_recording((0..9).map(|_| bells(0.1, 1.0, 0.01, &mut rng)).collect());
    assert!(matches!(fit(&setup, &one_place), Err(GaussianProcessError::Positions(_))));
    let mut still = raw_recording(vec![bells(0.1, 1.0, 0.0, &mut rng), bells(0.3, 1.0, 0.0, &mut rng)]);
    still.rows[1].reading = still.rows[0].reading.clone();
    assert!(matches!(fit(&setup, &still), Err(GaussianProcessError::Features(_))));
    still.rows[1].reading[0] = f64::NAN;
    assert!(fit(&setup, &still).is_err());
    let two = raw_recording(vec![bells(0.1, 1.0, 0.0, &mut rng), bells(0.3, 1.0, 0.0, &mut rng)]);
    assert!(fit(&setup, &two).is_ok());
}

#[test]
fn it_comes_back_from_a_file_and_a_damaged_file_is_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let recording = raw_recording((0..40).map(|i| bells(0.01 * f64::from(i), 1.0, 1e-3, &mut rng)).collect());
    let bench_4 = raw_setup(*EXTENT, 4, Some(1.0));
    let locator = fit(&bench_4, &recording).unwrap();
    let text = serde_json::to_string(&locator).unwrap();
    let back: GaussianProcessLocator = serde_json::from_str(&text).unwrap();
    assert_eq!(back.check(&bench_4), Ok(()));
    let reading = bells(0.123, 1.0, 0.0, &mut rng).reading;
    let (here, there) = (locator.locate(&reading), back.locate(&reading));
    assert!((here.contact.position.x_m - there.contact.position.x_m).abs() < 1e-9);
    assert!(back.check(&raw_setup(*EXTENT, 2, Some(1.0))).is_err());
    assert!(back.check(&raw_setup(Extent::plane(EXTENT.length_m(), 0.1).unwrap(), 4, Some(1.0))).is_err());
    let mut damaged = back;
    damaged.features.features.pop();
    assert!(damaged.check(&bench_4).is_err());
}

fn five_folds(name: &str, setup: &Setup, recording: &Recording) -> (ErrorSummary, f64) {
    let task = FitTask::new(setup, recording).seed(1);
    let held_out = cross_validate(&GaussianProcessEstimator::default(), task, 5).unwrap();
    let (errors, coverage) = (held_out.summary(None).unwrap(), held_out.coverage_percent().unwrap());
    eprintln!(
        "{name}: {errors:?}, coverage {coverage:.1} %, score {:?} m",
        held_out.interval_score_m().unwrap()
    );
    (errors, coverage)
}

/// Hyperparameters come from other starts and a prior than scikit-learn's, so its figures are matched within
/// a hundredth.
const SLACK: f64 = 1.01;

/// Fails where median and mean exceed scikit-learn's, or the coverage is wrong.
fn check(name: &str, (setup, recording): (Setup, Recording), median_mm: f64, mean_mm: f64) {
    let (errors, coverage) = five_folds(name, &setup, &recording);
    let as_good = errors.median_m <= SLACK * mm(median_mm) && errors.average_m <= SLACK * mm(mean_mm);
    assert!(as_good, "{name}: {errors:?}");
    assert!((93.0..97.0).contains(&coverage), "{name}: {coverage}");
}

fn check_strip(file: &str, median_mm: f64, mean_mm: f64) {
    let Some(recording) = strip_recording(file) else { return };
    check(file, recording, median_mm, mean_mm);
}

#[test]
fn a_strip_over_water_is_as_scikit_learn_has_it() {
    check_strip("1d-water-1.5mm.csv", 0.565, 0.844);
}

#[test]
fn a_strip_over_oil_is_as_scikit_learn_has_it() {
    check_strip("1d-oil-1.0mm.csv", 0.438, 0.902);
}

#[test]
fn a_strip_over_air_is_as_scikit_learn_has_it() {
    check_strip("1d-air-2.0mm.csv", 0.600, 0.824);
}

/// Five exact processes of 3,844 rows: the longest of these tests.
#[test]
fn a_magnetic_pad_is_as_scikit_learn_has_it() {
    let Some(recording) = pad_recording() else { return };
    check("pad", recording, 0.312, 0.343);
}

/// 5 % better than scikit-learn (6.36, 6.88 mm), with logarithms as features.
#[test]
fn a_sheet_is_better_than_scikit_learn_has_it() {
    let Some(recording) = sheet_recording() else { return };
    check("sheet", recording, 0.95 / SLACK * 6.36, 0.95 / SLACK * 6.88);
}

/// Noise that is five times greater on one half of a line.
#[test]
fn widths_follow_the_reading() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut press = |x_m: f64| bells(x_m, 1.0, if x_m < 0.2 { 2e-3 } else { 1e-2 }, &mut rng);
    let presses = raw_recording((0..300).map(|i| press(0.4 * (f64::from(i % 60) + 0.5) / 60.0)).collect());
    let touches: Vec<Row> = (0..2000).map(|i| press(0.02 + 0.36 * (f64::from(i) + 0.5) / 2000.0)).collect();
    let locator = fit(&raw_setup(*EXTENT, 4, Some(1.0)), &presses).unwrap();
    let held_percent = |locator: &GaussianProcessLocator, is_noisy: bool| {
        let half = touches.iter().filter(|row| (row.position.x_m >= 0.2) == is_noisy);
        let held = half.map(|row| {
            let (low_m, high_m) = locator.locate(&row.reading).contact.uncertainty.unwrap().x_95_m;
            f64::from(u8::from((low_m..=high_m).contains(&row.position.x_m)))
        });
        100.0 * palpate_numerics::mean(held)
    };
    let one_width = GaussianProcessLocator { widths: None, ..locator.clone() };
    for is_noisy in [false, true] {
        let [with, without] = [&locator, &one_width].map(|locator| held_percent(locator, is_noisy));
        eprintln!("noisy half {is_noisy}: {with:.1} % held, {without:.1} % by one width");
        assert!((88.0..99.0).contains(&with), "{with}");
        assert!((with - 95.0).abs() < (without - 95.0).abs(), "{with}, {without}");
    }
}

#[test]
fn channels_that_follow_different_powers_of_the_force_are_taken_by_their_logarithms() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let rows = (0..150).map(|_| {
        let (x_m, force_n): (f64, f64) = (rng.random_range(0.0..0.4), rng.random_range(0.5..5.0));
        let noise = |rng: &mut Xoshiro256PlusPlus| -> f64 {
            let error: f64 = StandardNormal.sample(rng);
            (0.01 * error).exp()
        };
        let powers = [(3.0, 1.0), (-3.0, 2.0), (1.0, -0.5)];
        let reading =
            powers.map(|(slope, power)| (slope * x_m).exp() * force_n.powf(power) * noise(&mut rng));
        Row {
            position: Position::along(x_m),
            force_n: None,
            nuisances: Vec::new(),
            time_s: None,
            reading: reading.to_vec(),
        }
    });
    let recording = raw_recording(rows.collect());
    let setup = raw_setup(*EXTENT, 3, None);
    assert_eq!(fit(&setup, &recording).unwrap().features.kind, FeatureKind::Logarithms);
    // A channel with negative readings has no logarithms.
    let mut signed = recording;
    signed.rows[3].reading[1] = -0.1;
    assert_eq!(fit(&setup, &signed).unwrap().features.kind, FeatureKind::LoadInvariant);
}
