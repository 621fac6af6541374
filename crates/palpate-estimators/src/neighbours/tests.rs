use super::*;
use crate::fit::{Fit, FitTask, Locate};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Extent, SurfaceSpec};

fn setup(force_n: Option<f64>) -> Setup {
    let layout = Layout::even(SensorKind::Raw, 2, 0.1);
    let surface = SurfaceSpec::Measured(Extent::plane(0.1, 0.1).unwrap());
    Setup::new(surface).with_layout(layout).unwrap().with_force(force_n).unwrap()
}

/// Readings turn with the position and grow with the force.
fn row(x_m: f64, y_m: f64, force_n: f64) -> Row {
    let (angle, size) = (10.0 * x_m, force_n * (1.0 + 10.0 * y_m));
    Row {
        position: Position { x_m, y_m },
        force_n: Some(force_n),
        nuisances: Vec::new(),
        time_s: None,
        reading: vec![size * angle.cos(), size * angle.sin()],
    }
}

fn grid(force_n: f64) -> Vec<Row> {
    (0..=10)
        .flat_map(|i| (0..=10).map(move |j| row(f64::from(i) * 0.01, f64::from(j) * 0.01, force_n)))
        .collect()
}

fn fit(setup: &Setup, rows: Vec<Row>) -> Result<NeighboursLocator, NeighboursFitError> {
    let recording = Recording::new(setup.layout(), "test", rows);
    let task = FitTask::new(setup, &recording);
    let locator = Neighbours::default().fit_method(task)?;
    assert_eq!(locator.check(setup), Ok(()));
    let text = serde_json::to_string(&locator).unwrap();
    assert_eq!(serde_json::from_str::<NeighboursLocator>(&text).unwrap().check(setup), Ok(()));
    Ok(locator)
}

#[test]
fn a_training_reading_comes_back_exactly() {
    let setup = setup(Some(1.0));
    let locator = fit(&setup, grid(1.0)).unwrap();
    for row in grid(1.0) {
        assert_eq!(locator.locate(&row.reading).contact.position, row.position);
    }
}

#[test]
fn between_presses_it_is_within_a_pitch_and_its_interval_covers() {
    let locator = fit(&setup(Some(1.0)), grid(1.0)).unwrap();
    let mut covered = 0;
    for i in 0..100 {
        let truth = row(0.005 + 0.0009 * f64::from(i), 0.095 - 0.0009 * f64::from(i), 1.0);
        let contact = locator.locate(&truth.reading).contact;
        assert!(contact.position.distance_m(truth.position) < 0.01, "{i}: {contact:?}");
        let (low, high) = contact.uncertainty.unwrap().x_95_m;
        covered += u32::from(low <= truth.position.x_m && truth.position.x_m <= high);
    }
    assert!(covered >= 95, "{covered}");
}

#[test]
fn at_unknown_force_only_the_direction_and_the_size_count() {
    let rows: Vec<Row> =
        (0..=20).map(|i| row(f64::from(i) * 0.005, 0.0, 1.0 + f64::from(i % 2) * 1e-9)).collect();
    let locator = fit(&setup(None), rows).unwrap();
    for i in 0..=20 {
        let heavy = row(f64::from(i) * 0.005, 0.0, 1.0 + f64::from(i % 2) * 1e-9);
        let off_m = locator.locate(&heavy.reading).contact.position.distance_m(heavy.position);
        assert!(off_m < 1e-12, "{i}: {off_m}");
    }
    assert!(locator.locate(&[0.0, 0.0]).contact.position.x_m.is_finite());
}

#[test]
fn repeats_do_not_vouch_for_their_own_position() {
    // Ten repeats per position: compared with its repeats, a row would favour one neighbour.
    let rows: Vec<Row> = (0..10).flat_map(|i| vec![row(0.01 * f64::from(i), 0.0, 1.0); 10]).collect();
    let locator = fit(&setup(Some(1.0)), rows).unwrap();
    assert!(locator.count > 10, "{}", locator.count);
    assert!(locator.held_out_errors.unwrap().rms_m[0] > 1e-3);
}

#[test]
fn unusable_recordings_are_refused() {
    let error = fit(&setup(None), vec![row(0.01, 0.0, 1.0); 5]).unwrap_err();
    assert_eq!(error.to_string(), "the recording has 1 distinct positions; at least 2 are needed");
    let alike = Row { position: Position::along(0.05), ..row(0.01, 0.0, 1.0) };
    let error = fit(&setup(None), vec![row(0.01, 0.0, 1.0), alike]).unwrap_err();
    assert!(matches!(error, NeighboursFitError::Features(_)), "{error}");
}

#[test]
fn a_file_with_the_wrong_numbers_is_refused() {
    let setup = setup(Some(1.0));
    let locator = fit(&setup, grid(1.0)).unwrap();
    assert!(NeighboursLocator { count: 0, ..locator.clone() }.check(&setup).is_err());
    assert!(NeighboursLocator { rows: vec![], ..locator.clone() }.check(&setup).is_err());
    let mut short = locator;
    short.rows[0].features.pop();
    assert!(short.check(&setup).is_err());
}
