//! Skipped tests.

use std::env;
use std::fs::OpenOptions;
use std::io::Write;
use std::thread;

/// Reports a skipped test for lack of `what`; fails under `PALPATE_STRICT=1`. `cargo xtask test` reads the
/// file `PALPATE_SKIPPED`.
pub fn skip(what: &str, remedy: &str) {
    let line =
        format!("skipped {}: {what} is missing; {remedy}", thread::current().name().unwrap_or("a test"));
    assert!(env::var_os("PALPATE_STRICT").is_none_or(|value| value != "1"), "{line}");
    eprintln!("{line}");
    if let Some(file) = env::var_os("PALPATE_SKIPPED") {
        let written = OpenOptions::new().append(true).create(true).open(&file);
        // One write keeps lines of concurrent tests apart.
        written
            .and_then(|mut file| file.write_all(format!("{line}\n").as_bytes()))
            .expect("PALPATE_SKIPPED can be written");
    }
}
