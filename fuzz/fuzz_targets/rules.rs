//! Any text as a rule file: errors are within the text, and accepted rules can be published.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::rules::Rules;
use palpate_mechanics::surface::Extent;

fuzz_target!(|text: &str| {
    if let Err(error) = Rules::from_toml(text, Extent::plane(0.3, 0.2).unwrap()) {
        let span = error.span.clone().unwrap_or(0..0);
        assert!(text.get(span).is_some(), "{error:?}");
    }
});
