//! Locators of every kind with corrupt numbers; an accepted one answers any reading with numbers.
//!
//! The first byte selects the kind. Records of eleven bytes follow: two select a number, one the
//! kind of corruption, eight are a float. The readings are the last float.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_estimators::estimator::Locator;
use palpate_testing::json_numbers::{HOSTILE, numbers};
use serde_json::Value;

macro_rules! golden {
    ($kind:literal) => {
        include_str!(concat!("../../crates/palpate/tests/golden/", $kind, ".locator.json"))
    };
}

const KINDS: [&str; 10] = [
    golden!("centroid"),
    golden!("closed-form"),
    golden!("digit"),
    golden!("gaussian-process"),
    golden!("influence"),
    golden!("influence-force-linear"),
    golden!("influence-measured"),
    golden!("neighbours"),
    golden!("network"),
    golden!("network-lm"),
];

const RECORD: usize = 11;

/// Returns an invalid number, any float, or a whole number.
fn number(choice: u8, float: f64) -> Value {
    match usize::from(choice) {
        known if known < HOSTILE.len() => serde_json::from_str(HOSTILE[known]).unwrap_or_default(),
        // JSON has no number for infinity and NaN.
        other if other % 2 == 0 => Value::from(float),
        _ => Value::from(float.to_bits() >> (choice & 63)),
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, records)) = bytes.split_first() else { return };
    let Ok(mut document) = serde_json::from_str::<Value>(KINDS[usize::from(*kind) % KINDS.len()]) else { return };
    let mut last = 0.0;
    for record in records.chunks_exact(RECORD) {
        let which = usize::from(u16::from_le_bytes([record[0], record[1]]));
        let mut float = [0; 8];
        float.copy_from_slice(&record[3..]);
        last = f64::from_le_bytes(float);
        let mut numbers = numbers(&mut document);
        let count = numbers.len();
        *numbers[which % count].1 = number(record[2], last);
    }
    let Ok(locator) = Locator::from_json(&document.to_string()) else { return };
    let channels = locator.setup.layout().len();
    for value in [0.0, -1e-4, 1e300, last] {
        if let Ok(estimate) = locator.locate(&vec![value; channels]) {
            assert!(estimate.is_in_numbers(), "{estimate:?}");
        }
    }
});
