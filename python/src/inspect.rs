//! Descriptions of objects and files.

use palpate::estimators::description;
use palpate::estimators::estimator;
use palpate::estimators::influence::ForceLinearLocator;
use palpate::rig::{Study, table_in_words};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::bench::{Recording, Setup};
use crate::errors::{of_csv, of_rig};
use crate::locator::Locator;
use crate::rig::Rig;
use crate::training::Training;
use crate::values;

/// Description of a value, line by line; and, of a locator of a surface without a model, the numbers that it learnt.
#[pyfunction]
pub fn inspect<'py>(
    py: Python<'py>,
    value: &Bound<'py, PyAny>,
) -> PyResult<(Vec<String>, Option<Bound<'py, PyAny>>)> {
    let mut learnt = None;
    let lines = if let Ok(setup) = value.cast::<Setup>() {
        description::setup(&setup.get().0)
    } else if let Ok(rig) = value.cast::<Rig>() {
        rig.get().inner.in_words()
    } else if let Ok(locator) = value.cast::<Locator>() {
        let locator = &locator.get().inner;
        let linear = locator.force_linear();
        learnt = linear.map(|linear| values::json(py, &of_linear(linear, locator))).transpose()?;
        description::locator(locator)
    } else if let Ok(recording) = value.cast::<Recording>() {
        let recording = recording.get();
        description::recording(&recording.inner, &recording.setup)
    } else if let Ok(training) = value.cast::<Training>() {
        vec![description::training(&training.get().0)]
    } else {
        let found = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "a value of the type {found} cannot be inspected; it must be a path, or a Setup, Rig, Locator, Recording or Training"
        )));
    };
    Ok((lines, learnt))
}

/// Description of a study, line by line.
#[pyfunction]
pub fn inspect_study(source: &str, text: &str) -> PyResult<Vec<String>> {
    let study = Study::from_toml(text).map_err(|error| of_rig(&error, source, text))?;
    Ok(study.in_words())
}

/// Description of a table, line by line.
#[pyfunction]
pub fn inspect_table(source: &str, bytes: &[u8]) -> PyResult<Vec<String>> {
    table_in_words(source, bytes).map_err(|error| of_csv(&error))
}

/// Properties learnt without a model, in the units of the channels.
fn of_linear(linear: &ForceLinearLocator, locator: &estimator::Locator) -> Value {
    let names = locator.layout().names();
    let size_of = |sizes: &[(usize, f64)], c: usize| sizes.iter().find(|(of, _)| *of == c).map(|(_, sd)| *sd);
    let (drifts, scatter) = (linear.drifts(), linear.scatter());
    let scatters = scatter.as_ref().map_or(&[][..], |scatter| &scatter.sd);
    let channels = linear.channels().map(|(c, offset, noise_sd)| {
        json!({
            "name": names[c],
            "offset": offset,
            "noise_sd": noise_sd,
            "drift": size_of(&drifts, c),
            "scatter_sd": size_of(scatters, c),
        })
    });
    let extent = linear.extent();
    let noise_by_place = linear.noise_by_place().map(|ends| {
        ends.map(|(times, position)| json!({ "times": times, "at": values::place(position, extent) }))
    });
    json!({
        "structure": linear.structure(),
        "asked_structure": linear.asked_structure(),
        "force_exponent": linear.response(),
        "saturation": linear.saturation_share(),
        "presses": linear.presses(),
        "channels": Value::from_iter(channels),
        "drift_course": linear.drift_course(),
        "noise_by_place": noise_by_place,
        "scatter_force": scatter.as_ref().map(|scatter| scatter.force_n),
        "rows_set_aside": linear.set_aside(),
    })
}
