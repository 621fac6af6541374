//! Files of format version 1, checked in: a locator of every kind and a recording, which later versions must still read; and
//! golden vectors (reading to estimate), which every runtime must answer.
//!
//! `PALPATE_WRITE_GOLDEN=1 cargo test -p palpate --test golden` writes missing locators, and the vectors of all.

use std::fs;
use std::path::PathBuf;

use palpate::prelude::*;
use serde::{Deserialize, Serialize};

/// Relative tolerance of estimates: what other orders of summation may change.
const TOLERANCE: f64 = 1e-9;

/// A reading and the locator's estimate.
#[derive(Debug, Serialize, Deserialize)]
struct Vector {
    reading: Vec<f64>,
    status: String,
    #[serde(flatten)]
    contact: Answer,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    modes: Vec<ModeAnswer>,
}

/// An estimated contact. Covariances are xx, xy, xf, yy, yf, ff.
#[derive(Debug, Serialize, Deserialize)]
struct Answer {
    x_m: f64,
    y_m: f64,
    force_n: Option<f64>,
    x_95_m: Option<(f64, f64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y_95_m: Option<(f64, f64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    force_95_n: Option<(f64, f64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    covariance: Option<[f64; 6]>,
}

#[derive(Debug, Serialize, Deserialize)]
struct ModeAnswer {
    probability: f64,
    #[serde(flatten)]
    contact: Answer,
}

impl Answer {
    fn new(ContactEstimate { position, force_n, uncertainty }: ContactEstimate) -> Self {
        Self {
            x_m: position.x_m,
            y_m: position.y_m,
            force_n,
            x_95_m: uncertainty.map(|uncertainty| uncertainty.x_95_m),
            y_95_m: uncertainty
                .map(|uncertainty| uncertainty.y_95_m)
                .filter(|interval| *interval != (0.0, 0.0)),
            force_95_n: uncertainty.and_then(|uncertainty| uncertainty.force_95_n),
            covariance: uncertainty.map(|uncertainty| uncertainty.covariance),
        }
    }

    /// Lengths in m and forces in N, then variances and covariances, each with the size below which it counts as zero.
    fn numbers(&self) -> Vec<(f64, f64)> {
        const SMALL: f64 = 1e-3;
        let intervals = [self.x_95_m, self.y_95_m, self.force_95_n].map(Option::unwrap_or_default);
        let lengths = [self.x_m, self.y_m, self.force_n.unwrap_or_default()];
        let lengths = lengths.into_iter().chain(intervals.into_iter().flat_map(|(low, high)| [low, high]));
        let covariance = self.covariance.unwrap_or_default();
        let scales = [[0, 0], [0, 3], [0, 5], [3, 3], [3, 5], [5, 5]];
        let scales = scales.map(|[i, j]| (covariance[i] * covariance[j]).sqrt().max(f64::MIN_POSITIVE));
        lengths.map(|length| (length, SMALL)).chain(covariance.into_iter().zip(scales)).collect()
    }
}

impl Vector {
    fn new(locator: &Locator, reading: &[f64]) -> Self {
        let estimate = locator.locate(reading).unwrap();
        let modes = estimate.modes.as_slice().iter();
        Self {
            reading: reading.to_vec(),
            status: estimate.status.name().to_owned(),
            contact: Answer::new(estimate.contact),
            modes: modes
                .map(|mode| ModeAnswer { probability: mode.probability, contact: Answer::new(mode.contact) })
                .collect(),
        }
    }

    fn numbers(&self) -> Vec<(f64, f64)> {
        let of_modes = self.modes.iter();
        let of_modes =
            of_modes.flat_map(|mode| [vec![(mode.probability, 1e-3)], mode.contact.numbers()].concat());
        self.contact.numbers().into_iter().chain(of_modes).collect()
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

/// A plate over four sensors, pressed with two forces.
fn plate() -> (Setup, Recording) {
    let plate = Plate::simply_supported((mm(300.0), mm(200.0)), mm(0.8), gpa(200.0), 0.3).unwrap();
    let setup = Setup::new(plate).sensors(Deflection.grid(2, 2).noise(um(5.0))).unwrap();
    let press = |force, seed| setup.simulate(&Training::grid(4, 3).with_force(newtons(force)), seed).unwrap();
    let (mut presses, hard) = (press(2.0, 1), press(5.0, 2));
    presses.rows.extend(hard.rows);
    (setup, presses)
}

/// The presses of the plate without its model.
fn measured_plate(with_forces: bool) -> (Setup, Recording) {
    let (_, mut presses) = plate();
    let setup = Setup::measured_plane(mm(300.0), mm(200.0), &["a", "b", "c", "d"]).unwrap();
    presses.channels = setup.layout().names();
    presses.kinds = setup.layout().kinds();
    if !with_forces {
        presses.rows.truncate(presses.rows.len() / 2);
        presses.rows.iter_mut().for_each(|row| row.force_n = None);
    }
    (setup, presses)
}

fn digit() -> (Setup, Recording) {
    let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0)).unwrap();
    let gauges = Strain.at_x([mm(4.0), mm(40.0), mm(80.0)]).noise(microstrain(1.0));
    let setup = Setup::new(digit).sensors(gauges).unwrap();
    let presses = setup.simulate(&Training::even(6).with_force(newtons(2.0)), 1).unwrap();
    (setup, presses)
}

fn unknown_force((setup, presses): (Setup, Recording)) -> (Setup, Recording) {
    (setup.unknown_force(), presses)
}

fn known_force((setup, presses): (Setup, Recording), force_n: f64) -> (Setup, Recording) {
    (setup.known_force(force_n).unwrap(), presses)
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
        ("influence-unknown-force", Estimator::Influence(Influence::default()), unknown_force(beam())),
        ("influence-plane", Estimator::Influence(Influence::default()), known_force(plate(), 5.0)),
        ("influence-plane-unknown-force", Estimator::Influence(Influence::default()), plate()),
        ("influence-plane-force-linear", Estimator::Influence(Influence::default()), measured_plate(true)),
        ("influence-plane-free", Estimator::Influence(Influence::default()), measured_plate(false)),
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
            let (found, wanted) = (answer.numbers(), vector.numbers());
            assert_eq!(found.len(), wanted.len(), "{name}: {answer:?} {vector:?}");
            for ((found, _), (wanted, small)) in found.into_iter().zip(wanted) {
                assert!(
                    (found - wanted).abs() <= TOLERANCE * wanted.abs().max(small),
                    "{name}: {found} instead of {wanted}: {answer:?} {vector:?}"
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
        let file = format!("{name}.locator.json");
        if !golden(&file).exists() {
            let locator = estimator.fit(&setup, &presses).unwrap();
            // Tables of thousands of nodes take half the space without line breaks.
            let json: serde_json::Value = serde_json::from_str(&locator.to_json().unwrap()).unwrap();
            fs::write(golden(&file), json.to_string() + "\n").unwrap();
        }
        let locator = Locator::from_json(&read(&file)).unwrap();
        let vectors: Vec<Vector> =
            readings(&presses).iter().map(|reading| Vector::new(&locator, reading)).collect();
        let text = serde_json::to_string_pretty(&vectors).unwrap() + "\n";
        fs::write(golden(&format!("{name}.vectors.json")), text).unwrap();
    }
    if !golden("recording.csv").exists() {
        write_recording();
    }
}

/// Every third press, multiples of one press, and means of distant presses, which may be ambiguous.
fn readings(presses: &Recording) -> Vec<Vec<f64>> {
    let rows = &presses.rows;
    let mut readings: Vec<Vec<f64>> = rows.iter().step_by(3).map(|row| row.reading.clone()).collect();
    for factor in [0.0, 0.3, 0.6, 1.5, -1.0, 1e3] {
        readings.push(rows[1].reading.iter().map(|value| factor * value).collect());
    }
    for share in [0.2, 0.5, 0.8] {
        let pairs = rows[0].reading.iter().zip(&rows[rows.len() - 1].reading);
        readings.push(pairs.map(|(first, last)| share * first + (1.0 - share) * last).collect());
    }
    readings
}

fn write_recording() {
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
