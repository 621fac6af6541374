//! Noise-free readings, propagated noise, and unidentifiable positions.

use std::sync::LazyLock;

use super::*;
use crate::fit::{Fit, FitTask, Locate};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use palpate_core::Status;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelErrors, ChannelModel, Layout, Sensor, SensorKind, measure};
use palpate_mechanics::surface::{Beam, Extent, Surface};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

static BEAM: LazyLock<Beam> = LazyLock::new(|| Beam::new(0.4, 0.04, 1.2e-3, 200e9).unwrap());

fn setup(sensors: &[(SensorKind, f64)], noise_sd: f64, force_n: Option<f64>) -> Setup {
    let sensors = sensors.iter().enumerate().map(|(i, (kind, x_m))| Sensor {
        kind: *kind,
        position: Position::along(*x_m),
        name: format!("c{i}"),
        channel: ChannelModel { noise_sd, ..ChannelModel::default() },
    });
    let layout = Layout::new(sensors.collect()).unwrap();
    Setup::new(*BEAM).with_layout(layout).unwrap().with_force(force_n).unwrap()
}

fn even(kind: SensorKind, count: usize) -> Vec<(SensorKind, f64)> {
    (1..=count).map(|i| (kind, 0.4 * i as f64 / (count + 1) as f64)).collect()
}

const SCALES: [(SensorKind, f64); 2] = [(SensorKind::Reaction, 0.0), (SensorKind::Reaction, 0.4)];

fn fit(setup: &Setup) -> Result<ClosedFormLocator, ClosedFormFitError> {
    let row = Row {
        position: Position::along(0.1),
        force_n: None,
        nuisances: Vec::new(),
        time_s: None,
        reading: vec![0.0; setup.layout().len()],
    };
    let recording = Recording::new(setup.layout(), "test", vec![row]);
    let task = FitTask::new(setup, &recording);
    let locator = ClosedForm::default().fit_method(task)?;
    assert_eq!(locator.check(setup), Ok(()));
    Ok(locator)
}

fn clean(setup: &Setup, x_m: f64, force_n: f64) -> Vec<f64> {
    let contact = Position::along(x_m);
    let sensors = setup.layout().sensors().iter();
    sensors.map(|s| force_n * BEAM.influence(s.kind, s.position, contact)).collect()
}

fn nearest_m(setup: &Setup, locator: &ClosedFormLocator, x_m: f64, force_n: f64) -> f64 {
    let estimate = locator.locate(&clean(setup, x_m, force_n));
    assert!(matches!(estimate.status, Status::Located | Status::Ambiguous), "{x_m}: {estimate:?}");
    let places = std::iter::once(estimate.contact).chain(estimate.modes.as_slice().iter().map(|m| m.contact));
    places.map(|contact| (contact.position.x_m - x_m).abs()).fold(f64::INFINITY, f64::min)
}

#[test]
fn clean_reactions_give_every_position_and_force() {
    let setup = setup(&SCALES, 0.0, None);
    let locator = fit(&setup).unwrap();
    for x_mm in 0..=400 {
        let x_m = f64::from(x_mm) * 1e-3;
        let contact = locator.locate(&clean(&setup, x_m, 2.5)).contact;
        assert!((contact.position.x_m - x_m).abs() < 1e-12 && (contact.force_n.unwrap() - 2.5).abs() < 1e-12);
    }
}

#[test]
fn clean_deflections_give_every_position_at_unknown_force() {
    for count in [2, 3, 8] {
        let setup = setup(&even(SensorKind::Deflection, count), 0.0, None);
        let locator = fit(&setup).unwrap();
        for x_mm in 5..=395 {
            let x_m = f64::from(x_mm) * 1e-3;
            let off_m = nearest_m(&setup, &locator, x_m, 1.7);
            assert!(off_m < 1e-7, "{count} sensors, {x_mm} mm: {off_m}");
        }
    }
}

#[test]
fn clean_deflections_give_every_position_at_known_force() {
    for count in [1, 2, 8] {
        let setup = setup(&even(SensorKind::Deflection, count), 0.0, Some(3.0));
        let locator = fit(&setup).unwrap();
        for x_mm in 1..=399 {
            let x_m = f64::from(x_mm) * 1e-3;
            let off_m = nearest_m(&setup, &locator, x_m, 3.0);
            // One sensor at mid-span has its maximum there; a double root has half the digits of double
            // precision.
            let bound_m = if count == 1 { 1e-6 } else { 1e-9 };
            assert!(off_m < bound_m, "{count} sensors, {x_mm} mm: {off_m}");
        }
    }
}

#[test]
fn one_sensor_reports_the_mirror_image_as_a_mode() {
    let setup = setup(&even(SensorKind::Deflection, 1), 5e-6, Some(3.0));
    let estimate = fit(&setup).unwrap().locate(&clean(&setup, 0.1, 3.0));
    assert_eq!(estimate.status, Status::Ambiguous);
    let [mode] = estimate.modes.as_slice() else { panic!("{estimate:?}") };
    let sum_m = estimate.contact.position.x_m + mode.contact.position.x_m;
    assert!((sum_m - 0.4).abs() < 1e-9 && (mode.probability - 0.5).abs() < 1e-6, "{estimate:?}");
}

#[test]
fn two_strains_locate_only_between_them() {
    let setup = setup(&even(SensorKind::Strain, 2), 1e-7, None);
    let locator = fit(&setup).unwrap();
    for x_mm in (140..=260).step_by(10) {
        let x_m = f64::from(x_mm) * 1e-3;
        assert!(nearest_m(&setup, &locator, x_m, 3.0) < 1e-9, "{x_mm} mm");
    }
    let blind = locator.locate(&clean(&setup, 0.05, 3.0));
    assert_eq!(blind.status, Status::Ambiguous);
    let (low, high) = blind.contact.uncertainty.unwrap().x_95_m;
    assert!(low < 0.001 && high > 0.4 / 3.0, "{blind:?}");
}

/// Mean and standard deviation of position errors, mean propagated sd, and coverage of the 95 % interval.
fn monte_carlo(setup: &Setup, x_m: f64, force_n: f64) -> (f64, f64, f64, f64) {
    let locator = fit(setup).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let truth = clean(setup, x_m, force_n);
    let (mut sum, mut squares, mut sd, mut covered) = (0.0, 0.0, 0.0, 0.0);
    let draws = 2000;
    for _ in 0..draws {
        let reading = measure(setup.layout(), &truth, &ChannelErrors::none(setup.layout()), &mut rng);
        let contact = locator.locate(&reading).contact;
        let (error, uncertainty) = (contact.position.x_m - x_m, contact.uncertainty.unwrap());
        sum += error;
        squares += error * error;
        sd += uncertainty.covariance[0].sqrt();
        covered += f64::from(u8::from(uncertainty.x_95_m.0 <= x_m && x_m <= uncertainty.x_95_m.1));
    }
    let count = f64::from(draws);
    let mean = sum / count;
    (mean, (squares / count - mean * mean).sqrt(), sd / count, covered / count)
}

#[test]
fn noise_spreads_as_much_as_was_propagated() {
    let cases = [
        (setup(&SCALES, 0.01, None), 0.13, 3.0),
        (setup(&SCALES, 0.01, Some(3.0)), 0.13, 3.0),
        (setup(&even(SensorKind::Deflection, 8), 5e-6, Some(3.0)), 0.05, 3.0),
        (setup(&even(SensorKind::Deflection, 8), 5e-6, None), 0.17, 3.0),
        (setup(&even(SensorKind::Deflection, 2), 1e-6, None), 0.17, 3.0),
        (setup(&even(SensorKind::Strain, 2), 1e-7, None), 0.17, 3.0),
    ];
    for (i, (setup, x_m, force_n)) in cases.into_iter().enumerate() {
        let (mean, spread, propagated, covered) = monte_carlo(&setup, x_m, force_n);
        // With 2000 draws the standard error of a standard deviation is 1.6 %, and of a coverage of 0.95 it
        // is 0.005.
        assert!((spread / propagated - 1.0).abs() < 0.06, "case {i}: {spread} against {propagated}");
        assert!(mean.abs() < 0.1 * spread, "case {i}: mean {mean}, sd {spread}");
        assert!((covered - 0.95).abs() < 0.02, "case {i}: {covered}");
    }
}

#[test]
fn unexplained_reading_is_not_located() {
    let deflections = setup(&even(SensorKind::Deflection, 8), 5e-6, None);
    let locator = fit(&deflections).unwrap();
    assert_eq!(locator.locate(&[3e-6, -4e-6, 1e-6, 0.0, 2e-6, -6e-6, 5e-6, 1e-6]).status, Status::NoContact);
    let pulled: Vec<f64> = clean(&deflections, 0.2, 3.0).iter().map(|r| -r).collect();
    assert_eq!(locator.locate(&pulled).status, Status::OutsideModel);
    let two = clean(&deflections, 0.1, 3.0).into_iter().zip(clean(&deflections, 0.3, 3.0));
    let two: Vec<f64> = two.map(|(a, b)| a + b).collect();
    assert_eq!(locator.locate(&two).status, Status::OutsideModel);

    let scales = fit(&setup(&SCALES, 0.01, None)).unwrap();
    assert_eq!(scales.locate(&[0.01, -0.005]).status, Status::NoContact);
    assert_eq!(scales.locate(&[-0.5, 2.5]).status, Status::OutsideSurface);
    assert_eq!(scales.locate(&[-1.0, -2.0]).status, Status::OutsideModel);
    // Noise may shift the estimate of a contact at an edge beyond it.
    let edge = scales.locate(&[-0.01, 3.0]);
    assert_eq!((edge.status, edge.contact.position.x_m), (Status::Located, 0.4));
}

#[test]
fn disabled_channel_is_excluded() {
    let mut deflections = setup(&even(SensorKind::Deflection, 8), 5e-6, None);
    deflections.set_disabled(3, true);
    let mut reading = clean(&deflections, 0.17, 3.0);
    reading[3] = 0.0;
    let estimate = fit(&deflections).unwrap().locate(&reading);
    assert_eq!(estimate.status, Status::Located);
    assert!((estimate.contact.position.x_m - 0.17).abs() < 1e-9);
}

#[test]
fn unsuitable_setup_is_refused() {
    let message = |setup: &Setup| fit(setup).unwrap_err().to_string();
    let layout = setup(&SCALES, 0.0, None).layout().clone();
    let measured = Setup::new(Extent::line(0.4).unwrap()).with_layout(layout).unwrap();
    assert!(message(&measured).contains("no model"));
    assert_eq!(
        message(&setup(&[(SensorKind::Raw, 0.1)], 0.0, None)),
        "the closed form needs deflection, slope, strain or reaction sensors; the layout has a raw channel"
    );
    assert_eq!(
        message(&setup(&even(SensorKind::Deflection, 1), 0.0, None)),
        "the closed form needs at least 2 sensors that see a contact (the force is unknown); the layout has 1"
    );
}

#[test]
fn two_scales_hold_a_contact_at_the_edge_in_its_own_interval() {
    for force_n in [None, Some(3.0)] {
        let setup = setup(&SCALES, 0.01, force_n);
        let locator = fit(&setup).unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        for x_m in [0.0, 2e-4, 1e-3, 3e-3] {
            let (truth, mut covered) = (clean(&setup, x_m, 3.0), 0);
            for _ in 0..2000 {
                let reading = measure(setup.layout(), &truth, &ChannelErrors::none(setup.layout()), &mut rng);
                let estimate = locator.locate(&reading);
                let (low, high) = estimate.contact.uncertainty.unwrap().x_95_m;
                covered += usize::from(low <= x_m && x_m <= high);
                if estimate.status == Status::Located {
                    let place = estimate.contact.position.x_m;
                    assert!(low <= place && place <= high, "{estimate:?}");
                }
            }
            assert!((1860..=1940).contains(&covered), "{force_n:?} at {x_m}: {covered} of 2000");
        }
    }
}

#[test]
fn offsets_are_those_of_untouched_rows_and_else_as_uncertain_as_the_rig_states() {
    let setup = setup(&even(SensorKind::Strain, 8), 1e-6, None);
    let offsets: Vec<f64> = (0..8).map(|c| 1e-3 * f64::from(c - 4)).collect();
    let row = |force_n: f64| Row {
        position: Position::along(0.13),
        force_n: Some(force_n),
        nuisances: Vec::new(),
        time_s: None,
        reading: {
            let functions =
                setup.layout().sensors().iter().map(|s| BEAM.influence_function(s.kind, s.position));
            functions
                .zip(&offsets)
                .map(|(f, offset)| offset + force_n * f.at(Position::along(0.13)))
                .collect()
        },
    };
    let rows = std::iter::repeat_n(row(0.0), 4).chain([row(3.0)]).collect();
    let recording = Recording::new(setup.layout(), "bridges", rows);
    let locator = ClosedForm::default().fit(&setup, &recording).unwrap().into_locator();
    let contact = locator.locate(&row(3.0).reading).unwrap().contact;
    assert!((contact.position.x_m - 0.13).abs() < 1e-6, "{contact:?}");
    let untouched = locator.untouched_reading().unwrap();
    assert!(untouched.iter().zip(&offsets).all(|(a, b)| (a - b).abs() < 1e-15), "{untouched:?}");
    assert_eq!(crate::estimator::Locator::from_json(&locator.to_json().unwrap()).unwrap(), locator);

    let width_m = |offset_error: f64| {
        let mut setup = setup.clone();
        setup
            .edit_sensors(|sensors| sensors.iter_mut().for_each(|s| s.channel.offset_error = offset_error))
            .unwrap();
        let locator = ClosedForm::default().fit(&setup, &recording.touched()).unwrap();
        let reading: Vec<f64> =
            row(3.0).reading.iter().zip(&offsets).map(|(value, own)| value - own).collect();
        let (low_m, high_m) = locator.locate(&reading).unwrap().contact.uncertainty.unwrap().x_95_m;
        high_m - low_m
    };
    assert!(width_m(20e-6) > 5.0 * width_m(0.0));
}
