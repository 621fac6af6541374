//! Any text as a study.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = palpate_studies::Study::from_toml(text);
});
