//! Quantities: numbers in SI units, or texts with units.

use palpate::estimators::estimator::MemoryLimit;
use palpate::mechanics::units::{Dimension, Quantity};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors::refused;

/// Converts a finite number or a text with a unit.
fn si(value: &Bound<'_, PyAny>, name: &str, dimension: Dimension) -> PyResult<f64> {
    let number = if let Ok(text) = value.extract::<std::borrow::Cow<'_, str>>() {
        Quantity::parse_as(&text, dimension).map_err(|error| refused(format!("`{name}`: {error}")))?
    } else {
        value.extract::<f64>().map_err(|_| {
            let found = value.get_type().name().map_or_else(|_| "?".to_owned(), |name| name.to_string());
            let words = dimension.noun();
            PyTypeError::new_err(format!(
                "`{name}` is of the type {found}; it must be {words}, a number in SI units or a text with a unit"
            ))
        })?
    };
    if number.is_finite() {
        Ok(number)
    } else {
        Err(refused(format!("`{name}` is {number}; it must be finite")))
    }
}

pub fn length_m(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    si(value, name, Dimension::Length)
}

pub fn force_n(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    si(value, name, Dimension::Force)
}

pub fn frequency_hz(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    si(value, name, Dimension::Frequency)
}

pub fn time_s(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    si(value, name, Dimension::Time)
}

/// A number of bytes, or a text such as "2 GB".
pub fn memory_limit(value: &Bound<'_, PyAny>) -> PyResult<MemoryLimit> {
    let limit = match value.extract::<std::borrow::Cow<'_, str>>() {
        Ok(text) => text.parse(),
        Err(_) => {
            let bytes = value.extract::<f64>().map_err(|_| {
                PyTypeError::new_err(
                    "`memory_limit` must be a number of bytes, or a text with a unit, as in \"2 GB\"",
                )
            });
            MemoryLimit::new(bytes?)
        }
    };
    limit.map_err(|error| refused(format!("`memory_limit`: {error}")))
}

/// 0.05, or "5 %".
pub fn share(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    si(value, name, Dimension::Ratio)
}

/// The SI value of a text with a unit, and the noun of what it measures.
///
/// Parameters
/// ----------
/// text : str
///     A quantity, as in "400 mm" or "5 um".
///
/// Returns
/// -------
/// tuple of (float, str)
///     The value in SI units, and the name of the quantity: "a length".
///
/// Raises
/// ------
/// PalpateError
///     For a text that is not a quantity, or an unknown unit.
#[pyfunction]
pub fn parse_quantity(text: &str) -> PyResult<(f64, &'static str)> {
    let quantity: Quantity = text.parse().map_err(refused)?;
    Ok((quantity.value, quantity.dimension.noun()))
}
