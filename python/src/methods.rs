//! Methods of setups and locators that are written in Python.

use pyo3::prelude::*;
use pyo3::types::PyDict;

pub fn load_profile<'py>(
    bench: &Bound<'py, PyAny>,
    readings: &Bound<'py, PyAny>,
    loads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let options = PyDict::new(bench.py());
    options.set_item("loads", loads)?;
    options.set_item("progress", progress)?;
    bench.py().import("palpate._load_profile")?.call_method("load_profile", (bench, readings), Some(&options))
}

/// See `Locator.tracker`.
pub fn tracker<'py>(
    locator: &Bound<'py, PyAny>,
    frequency: Option<&Bound<'py, PyAny>>,
    damping: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = locator.py();
    let keywords = PyDict::new(py);
    keywords.set_item("frequency", frequency)?;
    keywords.set_item("damping", damping)?;
    py.import("palpate._palpate")?.getattr("Tracker")?.call((locator,), Some(&keywords))
}
