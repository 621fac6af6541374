//! Any text as a rig.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = palpate_rig::Rig::from_toml(text);
});
