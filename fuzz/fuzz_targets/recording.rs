//! Any bytes as a recording and as a stream of readings.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_estimators::recording::{Columns, Header, LineParser, ReadingParser, TextDecoder, read};
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
    let _ = parser.progress().unfound();
    // Columns by number below a heading, with forces: preambles, units, totals, forces that are 0
    // apart from noise.
    let channels = 3..3 + RIG.setup.layout().len();
    let columns = Columns { header: Header::Present, ..Columns::along(1, channels).force(2) };
    let _ = read("fuzz", bytes, &RIG.setup.schema(&columns));
    // Chunks do not change decoded UTF-16.
    let whole = decoded(bytes, bytes.len().max(1));
    assert_eq!(decoded(bytes, 3), whole);
});

fn decoded(bytes: &[u8], length: usize) -> Vec<u8> {
    let mut decoder = TextDecoder::default();
    let mut text: Vec<u8> = bytes.chunks(length).flat_map(|chunk| decoder.decode(chunk)).collect();
    text.extend(decoder.finish());
    text
}
