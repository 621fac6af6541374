//! Locator files whose numbers were put wrong, and readings beyond all bounds: refused, or answered with numbers.

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use palpate::prelude::*;
use palpate_testing::json_numbers::{HOSTILE, some_numbers};
use serde_json::Value;

/// The kinds that have a file of numbers each; on a plane there is another influence locator, which is fitted here.
const KINDS: [&str; 10] = [
    "centroid",
    "closed-form",
    "digit",
    "gaussian-process",
    "influence",
    "influence-force-linear",
    "influence-measured",
    "neighbours",
    "network",
    "network-lm",
];

fn golden(kind: &str) -> String {
    let name = format!("tests/golden/{kind}.locator.json");
    fs::read_to_string(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

fn on_a_plane() -> String {
    let plate = include_str!("../../../examples/plate.toml").replace("# elements = 128 ", "elements = 8 ");
    let rig = Rig::from_toml(&plate).unwrap();
    let presses = rig.simulate(1).unwrap();
    rig.estimator.fit(&rig.setup, &presses).unwrap().to_json().unwrap()
}

/// Readings of a locator's own kind, of nothing, and of what no sensor reads.
fn readings(channels: usize) -> Vec<Vec<f64>> {
    let values = [0.0, -1e-4, 3.0, 1e18, 1e300, -1e300, f64::MAX, 1e-320];
    let mut readings: Vec<Vec<f64>> = values.map(|value| vec![value; channels]).into();
    readings.push((0..channels).map(|i| if i % 2 == 0 { 1e300 } else { -1e300 }).collect());
    readings.push((0..channels).map(|i| -1e-3 * (i + 1) as f64).collect());
    readings
}

/// What is not a number in an estimate.
fn not_a_number(estimate: &Estimate) -> Option<&'static str> {
    let of_contact = |contact: &ContactEstimate| {
        let Position { x_m, y_m } = contact.position;
        let ends = contact.uncertainty.map(|uncertainty| (uncertainty.x_95_m, uncertainty.y_95_m));
        let ends = ends.map_or([0.0; 4], |(x, y)| [x.0, x.1, y.0, y.1]);
        let covariance = contact.uncertainty.map_or([0.0; 6], |uncertainty| uncertainty.covariance);
        match () {
            () if !(x_m.is_finite() && y_m.is_finite()) => Some("position"),
            () if !contact.force_n.is_none_or(f64::is_finite) => Some("force"),
            () if !ends.iter().all(|end| end.is_finite()) => Some("interval"),
            () if covariance.iter().any(|entry| entry.is_nan()) => Some("covariance"),
            () => None,
        }
    };
    let modes = estimate.modes.as_slice();
    of_contact(&estimate.contact)
        .or_else(|| modes.iter().find_map(|mode| of_contact(&mode.contact)))
        .or_else(|| modes.iter().any(|mode| !mode.probability.is_finite()).then_some("probability"))
        .or_else(|| estimate.further.as_slice().iter().find_map(of_contact))
}

fn faults_of_answers(locator: &Locator, what: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for reading in readings(locator.setup.layout().len()) {
        let estimate = locator.locate(&reading).unwrap();
        let x_95_m = estimate.contact.uncertainty.map(|uncertainty| uncertainty.x_95_m);
        if estimate.status == Status::OutsideModel && x_95_m.is_some_and(|(low_m, high_m)| low_m >= high_m) {
            faults.push(format!("{what}: at {:e} an interval of one point", reading[0]));
        }
        if let Some(part) = not_a_number(&estimate) {
            faults.push(format!("{what}: at {:e} the {part} of {}", reading[0], estimate.status.name()));
        }
    }
    faults
}

#[test]
fn readings_beyond_all_bounds_get_numbers() {
    let mut faults = Vec::new();
    for (kind, text) in KINDS.map(|kind| (kind, golden(kind))).into_iter().chain([("plane", on_a_plane())]) {
        faults.extend(faults_of_answers(&Locator::from_json(&text).unwrap(), kind));
    }
    assert!(faults.is_empty(), "{}\n{}", faults.len(), faults.join("\n"));
}

/// Puts numbers of a locator wrong one by one.
fn put_wrong(kind: &str, text: &str, by: &[&str]) {
    let mut document: Value = serde_json::from_str(text).unwrap();
    let count = some_numbers(&mut document).len();
    let mut faults = Vec::new();
    for n in 0..count {
        for hostile in by {
            let mut numbers = some_numbers(&mut document);
            let (path, number) = numbers.swap_remove(n);
            let sound = std::mem::replace(number, serde_json::from_str(hostile).unwrap());
            let what = format!("{kind}{path} = {hostile}");
            let wrong = serde_json::to_string(&document).unwrap();
            let start = Instant::now();
            if let Ok(locator) = Locator::from_json(&wrong) {
                faults.extend(faults_of_answers(&locator, &what).first().cloned());
            }
            if start.elapsed() > Duration::from_secs(2) {
                faults.push(format!("{what}: took {:?}", start.elapsed()));
            }
            *some_numbers(&mut document).swap_remove(n).1 = sound;
        }
    }
    assert!(faults.is_empty(), "{} of {count} numbers\n{}", faults.len(), faults.join("\n"));
}

macro_rules! numbers_put_wrong {
    ($($name:ident: $kind:literal,)*) => {
        $(#[test]
        fn $name() {
            put_wrong($kind, &golden($kind), &HOSTILE);
        })*
    };
}

numbers_put_wrong! {
    a_centroid_is_refused_or_answers: "centroid",
    a_closed_form_is_refused_or_answers: "closed-form",
    a_digit_is_refused_or_answers: "digit",
    a_gaussian_process_is_refused_or_answers: "gaussian-process",
    influence_functions_are_refused_or_answer: "influence",
    influences_times_force_are_refused_or_answer: "influence-force-linear",
    influences_without_a_model_are_refused_or_answer: "influence-measured",
    neighbours_are_refused_or_answer: "neighbours",
    a_network_is_refused_or_answers: "network",
    networks_of_levenberg_and_marquardt_are_refused_or_answer: "network-lm",
}

#[test]
fn influences_on_a_plane_are_refused_or_answer() {
    // A file of megabytes: a few numbers tell.
    put_wrong("plane", &on_a_plane(), &["0", "1e-320", "1e308", "18446744073709551615"]);
}
