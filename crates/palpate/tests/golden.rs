//! Files of format version 1, checked in: a locator of every kind and a recording, which later versions must still read; and
//! golden vectors (reading to estimate), which every run time must answer.
//!
//! `PALPATE_WRITE_GOLDEN=1 cargo test -p palpate --test golden` writes the files anew, for a new version of a format.

use std::fs;
use std::path::PathBuf;

use palpate::prelude::*;
use serde::{Deserialize, Serialize};

/// Relative tolerance of estimates: what other orders of summation may change.
const TOLERANCE: f64 = 1e-9;

/// A reading, and what the locator answers.
#[derive(Debug, Serialize, Deserialize)]
struct Vector {
    reading: Vec<f64>,
    status: String,
    x_m: f64,
    y_m: f64,
    force_n: Option<f64>,
    x_95_m: Option<(f64, f64)>,
}

impl Vector {
    fn new(locator: &Locator, reading: &[f64]) -> Self {
        let estimate = locator.locate(reading).unwrap();
        let ContactEstimate { position, force_n, uncertainty } = estimate.contact;
        Self {
            reading: reading.to_vec(),
            status: estimate.status.name().to_owned(),
            x_m: position.x_m,
            y_m: position.y_m,
            force_n,
            x_95_m: uncertainty.map(|uncertainty| uncertainty.x_95_m),
        }
    }

    fn numbers(&self) -> Vec<f64> {
        let (low, high) = self.x_95_m.unwrap_or_default();
        vec![self.x_m, self.y_m, self.force_n.unwrap_or_default(), low, high]
    }
}

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

fn read(name: &str) -> String {
    fs::read_to_string(golden(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// A beam over three sensors, small enough for files that people can look into.
fn beam() -> (Setup, Recording) {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let setup = Setup::new(beam).sensors(Deflection.evenly(3).noise(um(5.0))).unwrap();
    let setup = setup.known_force(newtons(3.0)).unwrap();
    let presses = setup.simulate(&Training::even(12).repeated(3), 1).unwrap();
    (setup, presses)
}

/// The same presses without the model.
fn measured() -> (Setup, Recording) {
    let (_, mut presses) = beam();
    let setup = Setup::measured(mm(400.0), &["a", "b", "c"]).unwrap();
    presses.channels = setup.layout().names();
    presses.kinds = setup.layout().kinds();
    presses.rows.iter_mut().for_each(|row| row.force_n = None);
    (setup, presses)
}

/// A strip of three channels without a model, whose presses have two forces.
fn force_linear() -> (Setup, Recording) {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let bench = Setup::new(beam).sensors(Deflection.evenly(3).noise(um(5.0))).unwrap();
    let press = |force, seed| bench.simulate(&Training::even(6).with_force(newtons(force)), seed).unwrap();
    let (mut presses, hard) = (press(1.0, 1), press(3.0, 2));
    presses.rows.extend(hard.rows);
    let setup = Setup::measured(mm(400.0), &["a", "b", "c"]).unwrap();
    presses.channels = setup.layout().names();
    presses.kinds = setup.layout().kinds();
    (setup, presses)
}

fn digit() -> (Setup, Recording) {
    let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0)).unwrap();
    let gauges = Strain.at_x([mm(4.0), mm(40.0), mm(80.0)]).noise(microstrain(1.0));
    let setup = Setup::new(digit).sensors(gauges).unwrap();
    let presses = setup.simulate(&Training::even(6).with_force(newtons(2.0)), 1).unwrap();
    (setup, presses)
}

/// Every kind of locator: its file's name, its estimator, and what it is fitted to.
fn kinds() -> Vec<(&'static str, Estimator, (Setup, Recording))> {
    let mut network = Network::default();
    network.training.max_epochs = 200;
    let networks = LevenbergMarquardt { hidden: vec![3], ensemble: 2, max_iterations: 50 };
    vec![
        ("network", Estimator::Network(network), beam()),
        ("network-lm", Estimator::NetworkLm(networks), beam()),
        ("influence", Estimator::Influence(Influence::default()), beam()),
        ("influence-measured", Estimator::Influence(Influence::default()), measured()),
        ("influence-force-linear", Estimator::Influence(Influence::default()), force_linear()),
        ("gaussian-process", Estimator::GaussianProcess(GaussianProcessEstimator::default()), beam()),
        ("closed-form", Estimator::ClosedForm(ClosedForm::default()), beam()),
        ("digit", Estimator::Digit(DigitEstimator::default()), digit()),
        ("neighbours", Estimator::Neighbours(Neighbours::default()), beam()),
        ("centroid", Estimator::Centroid(Centroid), beam()),
    ]
}

#[test]
fn locators_of_version_1_are_read_and_answer_their_golden_vectors() {
    if std::env::var_os("PALPATE_WRITE_GOLDEN").is_some() {
        return write();
    }
    for (name, estimator, _) in kinds() {
        let locator = Locator::from_json(&read(&format!("{name}.locator.json"))).unwrap();
        assert_eq!(locator.kind(), estimator.kind(), "{name}");
        let vectors: Vec<Vector> = serde_json::from_str(&read(&format!("{name}.vectors.json"))).unwrap();
        assert!(vectors.len() >= 8, "{name}");
        for vector in vectors {
            let answer = Vector::new(&locator, &vector.reading);
            assert_eq!(answer.status, vector.status, "{name}: {vector:?}");
            for (found, wanted) in answer.numbers().into_iter().zip(vector.numbers()) {
                assert!(
                    (found - wanted).abs() <= TOLERANCE * wanted.abs().max(1e-3),
                    "{name}: {answer:?} {vector:?}"
                );
            }
        }
    }
}

#[test]
fn a_recording_of_version_1_is_read() {
    let (setup, presses) = beam();
    let recording = setup.read_recording("recording.csv", read("recording.csv").as_bytes()).unwrap();
    assert_eq!(recording.rows, presses.rows);
}

fn write() {
    for (name, estimator, (setup, presses)) in kinds() {
        let locator = estimator.fit(&setup, &presses).unwrap();
        fs::write(golden(&format!("{name}.locator.json")), locator.to_json().unwrap()).unwrap();
        let readings = presses.rows.iter().step_by(3).map(|row| row.reading.clone());
        let mut vectors: Vec<Vector> = readings.map(|reading| Vector::new(&locator, &reading)).collect();
        for factor in [0.0, 0.3, 0.6, 1.5, -1.0, 1e3] {
            let reading: Vec<f64> = presses.rows[1].reading.iter().map(|value| factor * value).collect();
            vectors.push(Vector::new(&locator, &reading));
        }
        let text = serde_json::to_string_pretty(&vectors).unwrap() + "\n";
        fs::write(golden(&format!("{name}.vectors.json")), text).unwrap();
    }
    let (setup, presses) = beam();
    let mut csv = Vec::new();
    palpate::estimators::recording::write(
        &presses,
        setup.surface().extent(),
        "palpate 0.1.0, a golden recording, seed 1",
        &mut csv,
    )
    .unwrap();
    fs::write(golden("recording.csv"), csv).unwrap();
}
