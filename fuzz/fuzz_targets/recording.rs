//! Any bytes, read as a recording and as a stream of readings.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_estimators::recording::{LineParser, ReadingParser};
use palpate_rig::Rig;
use std::sync::LazyLock;

static RIG: LazyLock<Rig> = LazyLock::new(|| {
    Rig::from_toml(include_str!("../../examples/fsi-water.toml")).expect("the example is a rig")
});

fuzz_target!(|bytes: &[u8]| {
    if let Ok(recording) = RIG.setup.read_recording("fuzz", bytes) {
        assert!(recording.rows.iter().all(|row| row.reading.iter().all(|value| value.is_finite())));
        let _ = recording.warnings();
        let _ = recording.folds(5);
    }
    let mut parser = ReadingParser::new("fuzz", &RIG.setup.recording_columns());
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let _ = parser.parse_line(line);
    }
});
