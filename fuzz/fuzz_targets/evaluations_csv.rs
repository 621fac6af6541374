//! Any text as the evaluations of an earlier run or shard of a study.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_numerics::watch::Watch;
use palpate_studies::{FitRows, PreparedStudy, Shard, ShardTables, Study, StudyTables};
use std::sync::LazyLock;

const STUDY_TOML: &str = r#"
    name = "small"
    surface = { kind = "beam", length = "400 mm", width = "40 mm", thickness = "1.2 mm", youngs_modulus = "200 GPa" }
    sensors = { measure = "deflection", count = 4, noise = "5 um" }
    contact = { force = "3 N" }
    training = { count = 10 }
    estimator = { kind = "influence" }
    evaluation = { from = "100 mm", to = "300 mm", step = "100 mm", readings = 1 }
    [[arm]]
    name = "a"
"#;

static STUDY: LazyLock<PreparedStudy> = LazyLock::new(|| {
    let study = Study::from_toml(STUDY_TOML).expect("the study is one");
    PreparedStudy::new(study, Watch::NONE).expect("the study can be simulated")
});

fuzz_target!(|text: &str| {
    let tables = StudyTables::new(&STUDY);
    let alone = |evaluations: String| FitRows { networks: String::new(), evaluations };
    let _ = tables.read(&alone(text.to_owned()));
    if let Ok(checkpoint) = tables.read(&alone(tables.headings().evaluations + text)) {
        let whole = tables.whole(&checkpoint.done);
        let again = tables.read(&whole).expect("a table that was written is read");
        assert_eq!(tables.whole(&again.done), whole);
    }
    // As a shard, with the number in the first line.
    let shard = Shard::new(1, 1).expect("the only shard");
    let mut texts = StudyTables::of_shard(&STUDY, shard, 2).headings();
    texts.evaluations += text;
    let _ = STUDY.merge(&[ShardTables { place: "a".to_owned(), texts }]);
    let texts = FitRows { networks: text.to_owned(), evaluations: String::new() };
    let _ = STUDY.merge(&[ShardTables { place: "b".to_owned(), texts }]);
});
