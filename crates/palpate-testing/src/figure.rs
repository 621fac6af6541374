//! Figures of benchmarks for `cargo xtask bench`.

use std::env;
use std::fs::OpenOptions;
use std::io::Write;

use serde_json::json;

/// Appends the median of a benchmark to the file `PALPATE_FIGURES`, if set, as JSON.
///
/// # Panics
/// Panics if the file cannot be written.
pub fn figure(name: &str, median: f64, unit: &str) {
    let Some(file) = env::var_os("PALPATE_FIGURES") else { return };
    let line = json!({"name": name, "median": median, "unit": unit});
    let written = OpenOptions::new().append(true).create(true).open(&file);
    written.and_then(|mut file| writeln!(file, "{line}")).expect("PALPATE_FIGURES can be written");
}
