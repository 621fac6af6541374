//! A test with a missing prerequisite prints one line and passes, or fails when skips are forbidden.

use std::env;
use std::fs::OpenOptions;
use std::io::Write;
use std::thread;

/// Says that the running test is skipped because `what` is missing, and what to do about it. Under `PALPATE_STRICT=1` it
/// fails instead. `cargo xtask test` reads the line from the file that `PALPATE_SKIPPED` names, as test runners hide it.
pub fn skip(what: &str, remedy: &str) {
    let line =
        format!("skipped {}: {what} is missing; {remedy}", thread::current().name().unwrap_or("a test"));
    assert!(env::var_os("PALPATE_STRICT").is_none_or(|value| value != "1"), "{line}");
    eprintln!("{line}");
    if let Some(file) = env::var_os("PALPATE_SKIPPED") {
        let written = OpenOptions::new().append(true).create(true).open(&file);
        // One write, so that lines of tests that run at once do not mix.
        written
            .and_then(|mut file| file.write_all(format!("{line}\n").as_bytes()))
            .expect("PALPATE_SKIPPED can be written");
    }
}
