//! Results as values of Python: columns of numbers, and small tables of names.

use numpy::{PyArray1, PyArrayMethods, ToPyArray};
use palpate::mechanics::contact::Position;
use palpate::mechanics::surface::Extent;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::errors::refused;

pub struct Fields<'py>(Bound<'py, PyDict>);

impl<'py> Fields<'py> {
    pub fn new(py: Python<'py>) -> Self {
        Self(PyDict::new(py))
    }

    pub fn of_numbers(py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray1<f64>> {
        values.to_pyarray(py)
    }

    /// Shape (rows, columns), at least one row.
    pub fn of_rows(py: Python<'py>, rows: &[Vec<f64>]) -> PyResult<Bound<'py, PyAny>> {
        let columns = rows.first().map_or(0, Vec::len);
        Ok(PyArray1::from_vec(py, rows.concat()).reshape([rows.len(), columns])?.into_any())
    }

    pub fn set(&self, name: &str, value: impl IntoPyObject<'py>) -> PyResult<()> {
        self.0.set_item(name, value)
    }

    /// NaN for `None`.
    pub fn column(&self, name: &str, values: impl IntoIterator<Item = Option<f64>>) -> PyResult<()> {
        let values: Vec<f64> = values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect();
        self.set(name, values.to_pyarray(self.0.py()))
    }

    /// Shape (rows, `N`).
    pub fn columns<const N: usize>(
        &self,
        name: &str,
        rows: impl IntoIterator<Item = [f64; N]>,
    ) -> PyResult<()> {
        self.array(name, rows, [N])
    }

    /// Shape (rows, 2, 2).
    pub fn matrices(&self, name: &str, rows: impl IntoIterator<Item = [f64; 4]>) -> PyResult<()> {
        self.array(name, rows, [2, 2])
    }

    fn array<const N: usize, const D: usize>(
        &self,
        name: &str,
        rows: impl IntoIterator<Item = [f64; N]>,
        shape: [usize; D],
    ) -> PyResult<()> {
        let rows: Vec<[f64; N]> = rows.into_iter().collect();
        let shape: Vec<usize> = std::iter::once(rows.len()).chain(shape).collect();
        self.set(name, PyArray1::from_vec(self.0.py(), rows.into_flattened()).reshape(shape)?)
    }

    /// In metres; `y` is None on a line.
    pub fn positions(&self, positions: &[Position], extent: Extent) -> PyResult<()> {
        self.column("x", positions.iter().map(|position| Some(position.x_m)))?;
        match extent {
            Extent::Line { .. } => self.set("y", self.0.py().None()),
            Extent::Plane { .. } => self.column("y", positions.iter().map(|position| Some(position.y_m))),
        }
    }

    /// Null is None.
    pub fn json(&self, name: &str, value: &Value) -> PyResult<()> {
        self.set(name, json(self.0.py(), value)?)
    }

    pub fn into_dict(self) -> Bound<'py, PyDict> {
        self.0
    }
}

/// Nested dicts and lists.
pub fn json<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(refused)?;
    py.import("json")?.call_method1("loads", (text,))
}

/// A length on a line, two on a plane.
pub fn place(position: Position, extent: Extent) -> Value {
    match extent {
        Extent::Line { .. } => Value::from(position.x_m),
        Extent::Plane { .. } => Value::from(vec![position.x_m, position.y_m]),
    }
}
