//! Conversion of arrays: C-contiguous arrays of 64-bit floats are not copied.

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray,
};
use palpate::mechanics::contact::Position;
use palpate::mechanics::surface::Extent;
use pyo3::exceptions::{PyIndexError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyType};

use crate::errors::refused;

pub enum Readings<'py> {
    /// Shape (channels).
    One(PyReadonlyArray1<'py, f64>),
    /// Shape (readings, channels).
    Many(PyReadonlyArray2<'py, f64>),
}

/// Converts at least one reading: an array-like, or a data frame with the channels as columns.
///
/// # Errors
/// `ValueError` for another shape, and for an object that is not an array of numbers.
pub fn readings<'py>(value: &Bound<'py, PyAny>, channels: &[String]) -> PyResult<Readings<'py>> {
    let readings = readings_or_none(value, channels)?;
    match &readings {
        Readings::Many(many) if many.shape()[0] == 0 => Err(refused(format!(
            "readings of the shape {} have 0 rows; there must be at least 1",
            in_words(many.shape())
        ))),
        _ => Ok(readings),
    }
}

/// Converts any number of readings.
///
/// # Errors
/// As for [`readings`], except for the number of rows.
pub fn readings_or_none<'py>(value: &Bound<'py, PyAny>, channels: &[String]) -> PyResult<Readings<'py>> {
    let array = if is_plain(value) {
        value.clone()
    } else {
        let py = value.py();
        py.import("palpate._arrays")?.call_method1("readings", (value, channels.to_vec()))?
    };
    if let Ok(one) = array.cast::<PyArray1<f64>>() {
        check_channels(one.shape(), one.len(), channels)?;
        return Ok(Readings::One(one.readonly()));
    }
    let many = array.cast::<PyArray2<f64>>()?;
    check_channels(many.shape(), many.shape()[1], channels)?;
    Ok(Readings::Many(many.readonly()))
}

/// Returns true for an array that is readable in memory: unmasked, one- or two-dimensional,
/// C-contiguous, 64-bit floats.
fn is_plain(value: &Bound<'_, PyAny>) -> bool {
    let exact = |class: Bound<'_, PyType>| value.get_type().is(&class);
    if let Ok(array) = value.cast::<PyArray1<f64>>() {
        return array.is_c_contiguous() && exact(value.py().get_type::<PyArray1<f64>>());
    }
    value
        .cast::<PyArray2<f64>>()
        .is_ok_and(|array| array.is_c_contiguous() && exact(value.py().get_type::<PyArray2<f64>>()))
}

fn check_channels(shape: &[usize], found: usize, channels: &[String]) -> PyResult<()> {
    if found == channels.len() {
        return Ok(());
    }
    let needed = channels.len();
    Err(refused(format!(
        "readings of the shape {} have {found} channels; it must be ({needed},) or (readings, {needed})",
        in_words(shape)
    )))
}

/// Converts a column of `rows` numbers.
///
/// # Errors
/// `ValueError` for another length, and for other objects.
pub fn column(value: &Bound<'_, PyAny>, name: &str, rows: usize) -> PyResult<Vec<f64>> {
    let numbers = numbers(value, name)?;
    if numbers.len() != rows {
        return Err(refused(format!("`{name}` has {} values; there are {rows} rows", numbers.len())));
    }
    Ok(numbers)
}

/// Converts an array of one dimension; an element may be a text with a unit.
///
/// # Errors
/// `ValueError` for other objects.
pub fn numbers(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let array = value.py().import("palpate._arrays")?.call_method1("column", (value, name))?;
    Ok(array.cast::<PyArray1<f64>>()?.readonly().as_slice()?.to_vec())
}

pub fn row_indices(rows: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<usize>> {
    if let Ok(slice) = rows.cast::<PySlice>() {
        let indices = slice.indices(count as isize)?;
        let at = |i: usize| usize::try_from(indices.start + i as isize * indices.step).unwrap_or(count);
        return Ok((0..indices.slicelength).map(at).collect());
    }
    let array = rows.py().import("numpy")?.call_method1("asarray", (rows,))?;
    if let Ok(chosen) = array.cast::<PyArray1<bool>>() {
        let chosen = chosen.readonly();
        let chosen: Vec<bool> = chosen.as_array().iter().copied().collect();
        if chosen.len() != count {
            return Err(PyIndexError::new_err(format!("{} booleans for {count} rows", chosen.len())));
        }
        return Ok((0..count).filter(|i| chosen[*i]).collect());
    }
    let asked: Vec<isize> = array.extract().map_err(|_| {
        PyTypeError::new_err("rows are chosen by a slice, by indices or by booleans, one a row")
    })?;
    let each = asked.into_iter().map(|index| {
        let from_0 = if index < 0 { index + count as isize } else { index };
        usize::try_from(from_0)
            .ok()
            .filter(|i| *i < count)
            .ok_or_else(|| PyIndexError::new_err(format!("row {index} of a recording of {count} rows")))
    });
    each.collect()
}

/// Shape (positions), or (positions, 2) on a plane.
pub fn positions_array<'py>(
    py: Python<'py>,
    positions: &[Position],
    extent: Extent,
) -> PyResult<Bound<'py, PyAny>> {
    match extent {
        Extent::Line { .. } => {
            let along: Vec<f64> = positions.iter().map(|position| position.x_m).collect();
            Ok(along.to_pyarray(py).into_any())
        }
        Extent::Plane { .. } => {
            let both: Vec<f64> = positions.iter().flat_map(|position| [position.x_m, position.y_m]).collect();
            Ok(both.to_pyarray(py).reshape([positions.len(), 2])?.into_any())
        }
    }
}

fn in_words(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        many => format!("({})", many.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}
