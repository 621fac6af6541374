//! Any text as a locator; an accepted one locates.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_estimators::estimator::Locator;

fuzz_target!(|text: &str| {
    if let Ok(locator) = Locator::from_json(text) {
        let _ = locator.locate(&vec![0.5; locator.setup.layout().len()]);
    }
});
