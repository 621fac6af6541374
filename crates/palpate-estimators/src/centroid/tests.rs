use super::*;
use crate::fit::{Fit, FitTask, Locate};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use palpate_core::{Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};
use palpate_mechanics::surface::{Beam, Extent};

fn fit(setup: &Setup, rows: Vec<Row>) -> Result<CentroidLocator, CentroidFitError> {
    let recording = Recording::new(setup.layout(), "test", rows);
    let task = FitTask::new(setup, &recording);
    let locator = Centroid.fit_method(task)?;
    assert_eq!(locator.check(setup), Ok(()));
    let text = serde_json::to_string(&locator).unwrap();
    assert_eq!(serde_json::from_str::<CentroidLocator>(&text).unwrap().check(setup), Ok(()));
    Ok(locator)
}

fn pad(channels: usize, width_m: Option<f64>) -> Setup {
    let mut layout = Layout::even(SensorKind::Raw, channels, 0.1);
    let name = |(i, sensor): (usize, &mut Sensor)| sensor.name = format!("c{i}");
    layout.edit(|sensors| sensors.iter_mut().enumerate().for_each(name)).unwrap();
    Setup::new(Extent::new(0.1, width_m).unwrap()).with_layout(layout).unwrap()
}

/// Two supports share a force by the lever rule, so the centroid is the contact position.
fn scales() -> Setup {
    let beam = Beam::new(0.4, 0.04, 1.2e-3, 200e9).unwrap();
    let support = |name: &str, x_m| Sensor {
        kind: SensorKind::Reaction,
        position: Position::along(x_m),
        name: name.to_owned(),
        channel: Default::default(),
    };
    let layout = Layout::new(vec![support("left", 0.0), support("right", 0.4)]).unwrap();
    Setup::new(beam).with_layout(layout).unwrap()
}

fn lever(x_m: f64, force_n: f64) -> Row {
    let right = force_n * x_m / 0.4;
    Row {
        position: Position::along(x_m),
        force_n: Some(force_n),
        nuisances: Vec::new(),
        time_s: None,
        reading: vec![force_n - right, right],
    }
}

#[test]
fn reactions_make_the_centroid_exact_at_any_force() {
    let rows = (0..20).map(|i| lever(0.01 + 0.02 * f64::from(i), 1.0 + f64::from(i % 3))).collect();
    let locator = fit(&scales(), rows).unwrap();
    for x_mm in 0..=400 {
        let row = lever(f64::from(x_mm) * 1e-3, 7.0);
        let estimate = locator.locate(&row.reading);
        assert!(estimate.contact.position.distance_m(row.position) < 1e-9, "{x_mm} mm: {estimate:?}");
        assert!(estimate.contact.uncertainty.is_some());
    }
}

#[test]
fn raw_channels_find_their_positions() {
    let setup = pad(3, Some(0.1));
    let places = [[0.0, 0.0], [0.1, 0.0], [0.05, 0.1]];
    let row = |i: usize, j: usize| {
        let weights = [i as f64, j as f64, (5 - i - j) as f64].map(|w| w / 5.0);
        let along = |axis: usize| (0..3).map(|c| weights[c] * places[c][axis]).sum::<f64>();
        let position = Position { x_m: along(0), y_m: along(1) };
        Row {
            position,
            force_n: None,
            nuisances: Vec::new(),
            time_s: None,
            reading: weights.iter().map(|w| -3.0 * w).collect(),
        }
    };
    let rows: Vec<Row> = (0..=5).flat_map(|i| (0..=5 - i).map(move |j| row(i, j))).collect();
    let locator = fit(&setup, rows.clone()).unwrap();
    for row in rows {
        assert!(locator.locate(&row.reading).contact.position.distance_m(row.position) < 1e-9);
    }
    assert!((locator.map[1][2] - 0.1).abs() < 1e-9 && locator.map[0][0].abs() < 1e-9, "{:?}", locator.map);
}

#[test]
fn zero_reading_is_no_contact() {
    let rows = (1..20).map(|i| lever(0.02 * f64::from(i), 3.0)).collect();
    let nothing: Estimate = fit(&scales(), rows).unwrap().locate(&[0.0, 0.0]);
    assert_eq!(nothing.status, Status::NoContact);
}

#[test]
fn position_beyond_the_edge_is_reported() {
    let rows = (1..20).map(|i| lever(0.02 * f64::from(i), 3.0)).collect();
    let mut locator = fit(&scales(), rows).unwrap();
    locator.map[0][1] += 0.1;
    assert_eq!(locator.locate(&lever(0.35, 3.0).reading).status, Status::OutsideSurface);
}

#[test]
fn uncalibratable_recordings_are_refused() {
    let message = |setup: &Setup, rows| fit(setup, rows).unwrap_err().to_string();
    let mut setup = scales();
    let rows: Vec<Row> = (1..20).map(|i| lever(0.02 * f64::from(i), 3.0)).collect();
    assert_eq!(
        message(&setup, rows[..1].to_vec()),
        "the recording has 1 distinct positions; at least 2 are needed"
    );
    let silent = rows.iter().map(|row| Row { reading: vec![0.0; 2], ..row.clone() }).collect();
    assert_eq!(
        message(&setup, silent),
        "every reaction reading of the recording is 0; a centroid weights sensors by their readings"
    );
    setup.set_disabled(0, true);
    assert_eq!(
        message(&setup, rows),
        "a centroid needs at least 2 sensors that are not dead; the layout has 1"
    );
}

#[test]
fn a_file_with_the_wrong_numbers_is_refused() {
    let rows = (1..20).map(|i| lever(0.02 * f64::from(i), 3.0)).collect();
    let locator = fit(&scales(), rows).unwrap();
    let short = CentroidLocator { channel_scales: vec![1.0], ..locator.clone() };
    assert!(short.check(&scales()).is_err());
    let wide = CentroidLocator { map: vec![vec![1.0, 0.0]; 2], ..locator.clone() };
    assert!(wide.check(&scales()).is_err());
    let broken = CentroidLocator { map: vec![vec![f64::NAN, 0.0]], ..locator };
    assert!(broken.check(&scales()).is_err());
}
