//! Tare: correction of readings for offsets that have changed since the calibration.

use numpy::{PyArray1, PyArrayMethods};
use palpate::estimators::estimator::{Locator, Tare, TareError};
use palpate::estimators::recording::Recording;
use palpate::numerics::watch::{Cancelled, Watch};
use pyo3::prelude::*;

use crate::arrays::{self, Readings};
use crate::errors::refused;
use crate::work;

const READINGS_EACH: usize = 256;

#[derive(Debug, thiserror::Error)]
enum TareFailure {
    #[error("{0}")]
    Tare(#[from] TareError),
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Subtracts the baseline of `untouched`, and adds that of the calibration.
///
/// # Errors
/// `PalpateError` without a learnt baseline, and for other channels.
pub fn tare<'py>(
    locator: &Locator,
    channels: &[String],
    readings: &Bound<'py, PyAny>,
    untouched: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = readings.py();
    let mut tare = of_calibration(locator)?;
    let readings = arrays::readings(readings, channels)?;
    let (values, rows) = match &readings {
        Readings::One(one) => (one.as_slice()?, None),
        Readings::Many(many) => (many.as_slice()?, Some(many.as_array().nrows())),
    };
    let mut tared = vec![0.0; values.len()];
    match untouched {
        Some(untouched) => add_untouched(&mut tare, untouched, channels)?,
        None => check_tells_untouched(locator, "give `untouched`")?,
    }
    let follows = untouched.is_none();
    let mut taring = |watch: Watch<'_>| -> Result<(), TareFailure> {
        let slots = values.chunks_exact(channels.len()).zip(tared.chunks_exact_mut(channels.len()));
        for (i, (reading, tared)) in slots.enumerate() {
            if i.is_multiple_of(READINGS_EACH) {
                watch.round()?;
            }
            if follows {
                locator.locate_following(&mut tare, reading, tared)?;
            } else {
                tare.apply(reading, tared)?;
            }
        }
        Ok(())
    };
    if rows.is_none_or(|rows| rows <= READINGS_EACH) {
        // The start of a thread would take longer.
        py.detach(|| taring(Watch::NONE)).map_err(refused)?;
    } else {
        work::run_quietly(py, taring)?;
    }
    let array = PyArray1::from_vec(py, tared);
    Ok(match rows {
        None => array.into_any(),
        Some(rows) => array.reshape([rows, channels.len()])?.into_any(),
    })
}

/// Tares by detected untouched readings ("auto"), by the latest one ("last"), by a number of first
/// rows, which are omitted, or by given readings.
///
/// # Errors
/// As for [`tare`], and for too few rows.
pub fn tared_recording(
    locator: &Locator,
    channels: &[String],
    recording: &Recording,
    tare: &Bound<'_, PyAny>,
) -> PyResult<Recording> {
    let py = tare.py();
    let mut taring = of_calibration(locator)?;
    let mut tared = recording.clone();
    let text = tare.extract::<std::borrow::Cow<'_, str>>().ok();
    let first = match (text.as_deref(), tare.extract::<usize>()) {
        (Some(followed @ ("auto" | "last")), _) => {
            if followed == "last" {
                taring = taring.with_last_zero();
            }
            check_tells_untouched(
                locator,
                "give the number of the first untouched readings, or such readings",
            )?;
            let rows = &mut tared.rows;
            work::run_quietly(py, |watch| {
                for (i, (row, tared)) in recording.rows.iter().zip(rows).enumerate() {
                    if i.is_multiple_of(READINGS_EACH) {
                        watch.round()?;
                    }
                    if let Some(time_s) = row.time_s {
                        taring.note_time(time_s);
                    }
                    locator.locate_following(&mut taring, &row.reading, &mut tared.reading)?;
                }
                Ok::<(), TareFailure>(())
            })?;
            return Ok(tared);
        }
        (Some(other), _) => {
            return Err(refused(format!(
                "`tare` is \"{other}\"; it must be \"auto\", \"last\", a number of readings, or untouched readings"
            )));
        }
        (None, Ok(0)) => return Err(refused("`tare` is 0; it must be at least 1 reading")),
        (None, Ok(first)) if first >= recording.rows.len() => {
            let rows = recording.rows.len();
            return Err(refused(format!(
                "`tare` is {first}; the recording has {rows} rows; the first {first} must be untouched: give a smaller number"
            )));
        }
        (None, Ok(first)) => {
            let mut untouched = recording.rows[..first].iter();
            untouched.try_for_each(|row| taring.add_untouched(&row.reading)).map_err(refused)?;
            first
        }
        (None, Err(_)) => {
            add_untouched(&mut taring, tare, channels)?;
            0
        }
    };
    for (row, tared) in recording.rows.iter().zip(&mut tared.rows) {
        taring.apply(&row.reading, &mut tared.reading).map_err(refused)?;
    }
    Ok(tared.subset(&(first..recording.rows.len()).collect::<Vec<_>>()))
}

fn of_calibration(locator: &Locator) -> PyResult<Tare<Vec<f64>>> {
    locator.tare().map_err(|error| {
        refused(format!("{error}: add rows of force 0 to the recording and fit again, or fit `Influence` to a recording with forces"))
    })
}

/// Refuses a locator that does not detect contacts.
fn check_tells_untouched(locator: &Locator, remedy: &str) -> PyResult<()> {
    match locator.false_alarm_rate() {
        Some(_) => Ok(()),
        None => Err(refused(format!(
            "a locator of kind `{}` cannot distinguish untouched readings from contacts: {remedy}",
            locator.kind()
        ))),
    }
}

/// The baseline is the mean of the readings.
fn add_untouched(
    tare: &mut Tare<Vec<f64>>,
    untouched: &Bound<'_, PyAny>,
    channels: &[String],
) -> PyResult<()> {
    let added = match arrays::readings_or_none(untouched, channels)? {
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
