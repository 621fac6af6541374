//! Any text as the networks of an earlier run of a study.
#![no_main]

use palpate_numerics::watch::Watch;
use libfuzzer_sys::fuzz_target;
use palpate_studies::{FitRows, PreparedStudy, Study, StudyTables};
use std::sync::LazyLock;

static STUDY: LazyLock<PreparedStudy> = LazyLock::new(|| {
    let study = Study::from_toml(palpate_studies::paper::STUDY_TOML).expect("the built-in study is one");
    PreparedStudy::new(study, Watch::NONE).expect("the built-in study can be simulated")
});

fuzz_target!(|text: &str| {
    let tables = StudyTables::new(&STUDY);
    let alone = |networks: String| FitRows { networks, evaluations: String::new() };
    let _ = tables.read(&alone(text.to_owned()));
    let _ = tables.read(&alone(tables.headings().networks + text));
});
