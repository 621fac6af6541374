//! Any bytes as an MCAP recording: refused with a message, or read to the end.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::recording::{Playback, read, recover};
use std::path::PathBuf;
use std::sync::LazyLock;

/// A file of this process, which every input overwrites.
static PATH: LazyLock<PathBuf> =
    LazyLock::new(|| std::env::temp_dir().join(format!("palpate-fuzz-{}.mcap", std::process::id())));

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*PATH, bytes).expect("the temporary folder can be written");
    if let Ok(mut playback) = Playback::open(&PATH) {
        while let Ok(Some(_)) = playback.next_recorded() {}
        let _ = read(&PATH, 0.0, 1e9, 50);
        let _ = recover(&PATH, &PATH.with_extension("recovered"));
    }
});
