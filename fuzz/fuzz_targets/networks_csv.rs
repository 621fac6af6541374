//! Any text, read as the networks that an earlier run of a study left.
#![no_main]

use palpate_numerics::watch::Watch;
use libfuzzer_sys::fuzz_target;
use palpate_studies::{NetworksCsv, PreparedStudy, Study};
use std::sync::LazyLock;

static STUDY: LazyLock<PreparedStudy> = LazyLock::new(|| {
    let study = Study::from_toml(palpate_studies::paper::STUDY_TOML).expect("the built-in study is one");
    PreparedStudy::new(study, Watch::NONE).expect("the built-in study can be simulated")
});

fuzz_target!(|text: &str| {
    let table = NetworksCsv::new(&STUDY);
    let _ = table.resume(text);
    let _ = table.resume(&(table.heading() + text));
});
