//! Any bytes as a recording for a first rig: a written rig loads and reads the file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_rig::{FirstRig, Hints, Rig};

fuzz_target!(|bytes: &[u8]| {
    let hints = [
        Hints::default(),
        Hints { position: Some("1".to_owned()), force: Some("2".to_owned()), ..Hints::default() },
    ];
    for hints in hints {
        let Ok(first) = FirstRig::infer("fuzz \"file\"\n.csv", bytes, &hints) else { continue };
        let rig = Rig::from_toml(&first.to_toml("a\u{7f}b")).expect("a rig that was guessed loads");
        let recording = rig.setup.read_recording("fuzz", bytes).expect("its recording is read");
        assert!(recording.rows.iter().all(|row| row.reading.iter().all(|value| value.is_finite())));
        let _ = first.summary();
    }
});
