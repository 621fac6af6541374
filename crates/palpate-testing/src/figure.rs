//! Figures of benchmarks, which `cargo xtask bench` saves and compares.

use std::env;
use std::fs::OpenOptions;
use std::io::Write;

use serde_json::json;

/// Adds the median of a benchmark to the file that `PALPATE_FIGURES` names, as a line of JSON. Without the variable this has no effect.
///
/// # Panics
/// The file cannot be written.
pub fn figure(name: &str, median: f64, unit: &str) {
    let Some(file) = env::var_os("PALPATE_FIGURES") else { return };
    let line = json!({"name": name, "median": median, "unit": unit});
    let written = OpenOptions::new().append(true).create(true).open(&file);
    written.and_then(|mut file| writeln!(file, "{line}")).expect("PALPATE_FIGURES can be written");
}
