//! Any text as a quantity.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(quantity) = text.parse::<palpate_mechanics::units::Quantity>() {
        assert!(quantity.value.is_finite());
    }
});
