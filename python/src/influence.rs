//! Learnt influence functions as values of Python.

use numpy::{PyArray1, PyArrayMethods};
use palpate::estimators::influence::InfluencesAtNodes;
use palpate::estimators::setup::Setup;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::values::Fields;

/// Fields of `palpate.InfluenceFunctions`, NaN for disabled channels.
pub fn fields<'py>(
    py: Python<'py>,
    learnt: &InfluencesAtNodes,
    setup: &Setup,
) -> PyResult<Bound<'py, PyDict>> {
    let fields = Fields::new(py);
    let names = setup.layout().names();
    let of_all = |of_live: &[f64]| -> Vec<f64> {
        let live = learnt.channels.len();
        let mut all = vec![f64::NAN; of_live.len() / live * names.len()];
        for (i, value) in of_live.iter().enumerate() {
            all[i / live * names.len() + learnt.channels[i % live]] = *value;
        }
        all
    };
    let (rows, columns) = (learnt.positions.len(), names.len());
    let table = |of_live: &[f64]| PyArray1::from_vec(py, of_all(of_live)).reshape([rows, columns]);
    fields.positions(&learnt.positions, setup.surface().extent())?;
    fields.set("values", table(&learnt.values)?)?;
    fields.set("sd", table(&learnt.sd)?)?;
    fields.set("offsets", PyArray1::from_vec(py, of_all(&learnt.offsets)))?;
    fields.set("noise", PyArray1::from_vec(py, of_all(&learnt.noise_sd)))?;
    fields.set("channels", names)?;
    Ok(fields.into_dict())
}
