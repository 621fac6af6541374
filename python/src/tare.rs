//! Tare: readings of a surface whose offsets have moved since its calibration, brought to what calibration learnt.

use numpy::{PyArray1, PyArrayMethods};
use palpate::estimators::estimator::{Locator, Tare, TareError};
use palpate::estimators::fit::Locate;
use pyo3::prelude::*;

use crate::arrays::{self, Readings};
use crate::errors::refused;

/// Readings less what the channels read untouched today, as `untouched` says, and what calibration learnt that they do added.
///
/// # Errors
/// `PalpateError` for a locator that has not learnt what the surface reads untouched, and for readings of other channels.
pub fn tare<'py>(
    locator: &Locator,
    channels: &[String],
    readings: &Bound<'py, PyAny>,
    untouched: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = readings.py();
    let mut tare = locator.tare().map_err(|error| {
        refused(format!("{error}: add rows of force 0 to the recording and fit again, or fit `Influence` to a recording with forces"))
    })?;
    let readings = arrays::readings(readings, channels)?;
    let (values, rows) = match &readings {
        Readings::One(one) => (one.as_slice()?, None),
        Readings::Many(many) => (many.as_slice()?, Some(many.as_array().nrows())),
    };
    let mut tared = vec![0.0; values.len()];
    let slots = || values.chunks_exact(channels.len());
    match untouched {
        Some(untouched) => {
            add_untouched(&mut tare, untouched, channels)?;
            let apply = |(reading, tared): (&[f64], &mut [f64])| tare.apply(reading, tared);
            py.detach(|| slots().zip(tared.chunks_exact_mut(channels.len())).try_for_each(apply))
                .map_err(refused)?;
        }
        None if locator.false_alarm_rate().is_none() => {
            return Err(refused(format!(
                "a locator of kind `{}` does not tell untouched readings from contacts: give `untouched`",
                locator.kind()
            )));
        }
        None => {
            let follow = |(reading, tared): (&[f64], &mut [f64])| {
                tare.follow(reading, tared, |tared| locator.method.locate(tared)).map(|_| ())
            };
            py.detach(|| slots().zip(tared.chunks_exact_mut(channels.len())).try_for_each(follow))
                .map_err(refused)?;
        }
    }
    let array = PyArray1::from_vec(py, tared);
    Ok(match rows {
        None => array.into_any(),
        Some(rows) => array.reshape([rows, channels.len()])?.into_any(),
    })
}

/// The mean of untouched readings is the baseline.
fn add_untouched(
    tare: &mut Tare<Vec<f64>>,
    untouched: &Bound<'_, PyAny>,
    channels: &[String],
) -> PyResult<()> {
    let added = match arrays::readings(untouched, channels)? {
        Readings::One(one) => tare.add_untouched(one.as_slice()?),
        Readings::Many(many) => {
            let values = many.as_slice()?;
            if values.is_empty() {
                return Err(refused("`untouched` has 0 readings; it must have at least 1"));
            }
            values.chunks_exact(channels.len()).try_for_each(|reading| tare.add_untouched(reading))
        }
    };
    added.map_err(|error: TareError| refused(format!("untouched: {error}")))
}
