//! Locators.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use palpate::estimators::batch::{BLOCK, BatchError, BatchOptions};
use palpate::estimators::estimator;
use palpate::estimators::evaluation;
use palpate::estimators::setup;
use palpate::numerics::watch::Watch;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict};

use crate::arrays::{self, Readings};
use crate::bench::{Recording, Setup};
use crate::errors::{io_error, of_locator, refused};
use crate::estimates::{Estimate, Estimates};
use crate::evaluation::{Evaluation, EvaluationOrigin};
use crate::files::write_whole;
use crate::influence;
use crate::methods;
use crate::tare;
use crate::work;

/// A locator: a fitted method with its setup, complete in itself.
///
/// `fit` of an estimator makes one, and `Locator.load` reads one from its file.
#[pyclass(frozen, module = "palpate")]
pub struct Locator {
    pub inner: estimator::Locator,
    setup: Arc<setup::Setup>,
    channels: Vec<String>,
    choice: Option<Py<PyDict>>,
}

impl Locator {
    pub fn new(inner: estimator::Locator, choice: Option<Py<PyDict>>) -> Self {
        let (setup, channels) = (Arc::new(inner.setup.clone()), inner.layout().names());
        Self { inner, setup, channels, choice }
    }
}

#[pymethods]
impl Locator {
    /// Estimate the contacts of readings.
    ///
    /// Parameters
    /// ----------
    /// readings : array_like
    ///     In SI units, or raw: one reading of the shape (channels), or many of the shape (readings, channels). A C-contiguous array of
    ///     64-bit floats is read as it lies in memory; of a data frame the columns of the channels are taken.
    ///
    /// threads : int
    ///     Threads that locate many readings; the estimates do not depend on it.
    ///
    /// Returns
    /// -------
    /// Estimate or Estimates
    ///     The numbers of one reading, or a column of them for many.
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For another number of channels, and for a value that is not finite, with its row and channel.
    #[pyo3(signature = (readings, *, threads=1))]
    fn locate<'py>(
        &self,
        py: Python<'py>,
        readings: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let threads =
            NonZeroUsize::new(threads).ok_or_else(|| refused("`threads` is 0; it must be at least 1"))?;
        let extent = self.setup.surface().extent();
        match arrays::readings(readings, &self.channels)? {
            Readings::One(reading) => {
                let estimate = self.inner.locate(reading.as_slice()?).map_err(refused)?;
                Ok(Bound::new(py, Estimate::new(estimate, extent))?.into_any())
            }
            Readings::Many(readings) => {
                let estimates = self.locate_many(py, readings.as_slice()?, threads)?;
                Ok(Bound::new(py, estimates)?.into_any())
            }
        }
    }

    /// Subtract the change of the channels' offsets since the calibration.
    ///
    /// Parameters
    /// ----------
    /// readings : array_like
    ///     One reading of the shape (channels), or many of the shape (readings, channels), in SI units or raw, in the order of time.
    /// untouched : array_like, optional
    ///     Readings of the untouched surface, such as ``readings[:50]``. Their mean is the present baseline. By default, `readings` themselves
    ///     are searched for untouched ones, and the drift of these is subtracted.
    ///
    /// Returns
    /// -------
    /// ndarray of float64
    ///     As many readings, for `locate`, `track` and `Setup.recording`.
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a calibration without the untouched reading.
    #[pyo3(signature = (readings, *, untouched=None))]
    fn tare<'py>(
        &self,
        readings: &Bound<'py, PyAny>,
        untouched: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        tare::tare(&self.inner, &self.channels, readings, untouched)
    }

    /// Locate the contacts of a recording, and compare the estimates with the true positions.
    ///
    /// Parameters
    /// ----------
    /// recording : Recording, optional
    ///     A recording of the same sensors; by default the surface is simulated, pressed all over.
    /// seed : int
    ///     Seed of the simulation.
    /// tare : "auto", int or array_like, optional
    ///     Baseline of the recording, as for `tare`: its untouched readings ("auto"), a number of its first readings, which are not evaluated,
    ///     or untouched readings of the shape (readings, channels).
    /// progress : bool or callable, optional
    ///     As of `Estimator.fit`.
    ///
    /// Returns
    /// -------
    /// Evaluation
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a recording with another number of channels, and without one for a surface without a model or an unknown force; for a tare
    ///     without a recording, or of more readings than it has.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     If the locator was fitted to this file. Errors at other positions are larger; `cross_validate` estimates them.
    #[pyo3(signature = (recording=None, *, seed=0, tare=None, progress=None))]
    fn evaluate(
        &self,
        py: Python<'_>,
        recording: Option<&Recording>,
        seed: u64,
        tare: Option<&Bound<'_, PyAny>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Evaluation> {
        let made;
        let judged = match recording {
            Some(recording) => {
                let digests = &recording.inner.provenance.digests;
                if !digests.is_empty() && *digests == self.inner.provenance.recording.digests {
                    let message = c"the locator was fitted to this recording; errors at other positions are larger: cross_validate estimates them";
                    PyErr::warn(py, &py.get_type::<PyUserWarning>(), message, 1)?;
                }
                match tare {
                    Some(tare) => {
                        made = tare::tared_recording(&self.inner, &self.channels, &recording.inner, tare)?;
                        &made
                    }
                    None => &recording.inner,
                }
            }
            None if tare.is_some() && self.setup.imperfections().is_none() => {
                return Err(refused("`tare` needs a recording: simulated readings do not drift"));
            }
            None => {
                let calibration = &self.inner.provenance.recording;
                let simulated = work::run_quietly_with(py, |watch| {
                    evaluation::simulate_use_all_over_watched(&self.setup, calibration, seed, watch)
                })?;
                let simulated =
                    simulated.map_err(|error| refused(format!("{error}; give a recording to judge by")))?;
                made = match tare {
                    Some(tare) => tare::tared_recording(&self.inner, &self.channels, &simulated, tare)?,
                    None => simulated,
                };
                &made
            }
        };
        let evaluation = work::run(py, progress, None, |watch| {
            evaluation::Evaluation::new_watched(&self.inner, judged, watch)
        })?;
        let source = judged.provenance.source.clone();
        let located = if tare.is_some() { "located, tared" } else { "located" };
        let about = EvaluationOrigin { kind: self.kind().to_owned(), source, how: located.to_owned() };
        Ok(Evaluation::new(evaluation, self.setup.clone(), about))
    }

    /// Follow moving contacts through readings in time: one contact, or on a line up to two, with their speed and force.
    ///
    /// The locator is an influence locator of any structure but ``free``; two contacts are followed where its estimator has ``contacts=2``.
    ///
    /// Parameters
    /// ----------
    /// times : array_like or MovingRecording
    ///     Time of each reading, in seconds, rising: of the shape (readings). A `MovingRecording` has the readings too, and the truth.
    /// readings : array_like, optional
    ///     In SI units: of the shape (readings, channels).
    /// smooth : bool
    ///     Go back over all of them, with what came later, instead of filtering them as they come.
    /// frequency : float or str, optional
    ///     First natural frequency of a beam on two simple supports, in hertz or with a unit; the tracker then includes the inertia.
    /// damping : float, optional
    ///     Damping ratio of the first mode; 0.01.
    /// progress : bool or callable, optional
    ///     As of `Estimator.fit`.
    ///
    /// Returns
    /// -------
    /// Track
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a locator that cannot follow, a time that is not later than the one before, and a value that is not finite, with the reading.
    #[pyo3(signature = (times, readings=None, *, smooth=false, frequency=None, damping=None, progress=None))]
    fn track<'py>(
        slf: &Bound<'py, Self>,
        times: &Bound<'py, PyAny>,
        readings: Option<&Bound<'py, PyAny>>,
        smooth: bool,
        frequency: Option<&Bound<'py, PyAny>>,
        damping: Option<&Bound<'py, PyAny>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = (slf, times, readings, smooth, frequency, damping, progress);
        slf.py().import("palpate._tracking")?.call_method1("track", arguments)
    }

    /// Track moving contacts reading by reading; the results equal those of `track` for all readings at once.
    ///
    /// Parameters
    /// ----------
    /// frequency, damping
    ///     As of `track`.
    ///
    /// Returns
    /// -------
    /// Tracker
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a locator that cannot track: it must be an influence locator of any structure but ``free``.
    ///
    /// Examples
    /// --------
    /// >>> import palpate as pp
    /// >>> beam = pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa")
    /// >>> setup = pp.Setup(beam, pp.deflection(8, noise="5 um"), force="3 N")
    /// >>> tracker = pp.Influence().fit(setup.simulate(pp.even(10), repeats=5)).tracker()
    /// >>> for count in range(3):
    /// ...     now = tracker.follow(0.01 * count, setup.response([0.1 + 0.001 * count], force="3 N")[0])
    /// >>> bool(abs(now.x - 0.102) < 1e-3)
    /// True
    #[pyo3(signature = (*, frequency=None, damping=None))]
    fn tracker<'py>(
        slf: &Bound<'py, Self>,
        frequency: Option<&Bound<'py, PyAny>>,
        damping: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        methods::tracker(slf.as_any(), frequency, damping)
    }

    /// Estimate the distribution of the force over the surface; see `load_profile`.
    ///
    /// Parameters
    /// ----------
    /// readings : array_like
    ///     In SI units: one reading of the shape (channels), or many of the shape (readings, channels).
    /// loads : UniformLoad or sequence of UniformLoad, optional
    ///     True loads, to compare with the profile.
    /// progress : bool or callable, optional
    ///     As of `Estimator.fit`.
    ///
    /// Returns
    /// -------
    /// LoadProfile or list of LoadProfile
    #[pyo3(signature = (readings, *, loads=None, progress=None))]
    fn load_profile<'py>(
        slf: &Bound<'py, Self>,
        readings: &Bound<'py, PyAny>,
        loads: Option<&Bound<'py, PyAny>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        methods::load_profile(slf.as_any(), readings, loads, progress)
    }

    /// Kind of the estimator, such as "influence".
    #[getter]
    fn kind(&self) -> &'static str {
        self.inner.kind()
    }

    /// Setup of the readings.
    #[getter]
    fn setup(&self) -> Setup {
        Setup(self.setup.clone())
    }

    /// Seed of the fit.
    #[getter]
    fn seed(&self) -> u64 {
        self.inner.provenance.seed
    }

    /// Version of palpate that fitted it.
    #[getter]
    fn version(&self) -> &str {
        &self.inner.provenance.palpate
    }

    /// What `Auto` chose it by; None of another estimator.
    ///
    /// "best" is the kind; "tried" has of each contender "kind", "mean_error" in metres, "interval_score" in metres and "coverage" at
    /// positions held out; "left_out" names the estimators that were not tried, with the reason.
    #[getter]
    fn choice(&self, py: Python<'_>) -> Option<Py<PyDict>> {
        self.choice.as_ref().map(|choice| choice.clone_ref(py))
    }

    /// Outcome of training, of a network: "status", "epochs" and "aggregate_error"; None of other methods.
    #[getter]
    fn training<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(outcome) = self.inner.training_outcome() else { return Ok(None) };
        let json = serde_json::to_string(&outcome).map_err(refused)?;
        Ok(Some(py.import("json")?.call_method1("loads", (json,))?))
    }

    /// Check of the 95 % intervals at held-out places; None with fewer than 19 places, where they are not checked.
    ///
    /// "places" is their number, "presses" that of the presses there, and "outside_model" the number of those that are `outside_model`. "position" and "force" (where it is estimated and was recorded) have the coverage "before_percent" and
    /// "after_percent", and the "factor" of at least 1 by which the intervals are widened.
    #[getter]
    fn interval_check<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(check) = self.inner.interval_check else { return Ok(None) };
        let json = serde_json::to_string(&check).map_err(refused)?;
        Ok(Some(py.import("json")?.call_method1("loads", (json,))?))
    }

    /// The influence functions that it has learnt, with their uncertainty.
    ///
    /// Returns
    /// -------
    /// InfluenceFunctions
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a method without any, such as a network, and for readings that are not a multiple of the force.
    fn influence_functions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let learnt = self.inner.influences_at_nodes().ok_or_else(|| {
            refused(format!(
                "a locator of the kind {} has learnt no influence functions here; fit `Influence`",
                self.kind()
            ))
        })?;
        let fields = influence::fields(py, &learnt, &self.setup)?;
        py.import("palpate._influence")?.getattr("InfluenceFunctions")?.call((), Some(&fields))
    }

    /// Write the locator to a file, which the command reads too.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let json = py.detach(|| self.inner.to_json()).map_err(refused)?;
        write_whole(&path, json.as_bytes())
    }

    /// Read a locator from a file.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    ///
    /// Raises
    /// ------
    /// FileError
    ///     For a file that is not a locator or has an unsupported version, with line and column where they are known.
    /// OSError
    ///     Where the file cannot be read.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let bytes = std::fs::read(&path).map_err(|error| io_error(&error, &path))?;
        let name = path.display().to_string();
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            refused(format!("{name} is not UTF-8 text: byte {} is invalid", at + 1))
        })?;
        let locator = py.detach(|| estimator::Locator::from_json(&text));
        Ok(Self::new(locator.map_err(|error| of_locator(&error, &name, &text))?, None))
    }

    /// The text of the locator's file.
    fn to_json(&self) -> PyResult<String> {
        self.inner.to_json().map_err(refused)
    }

    /// Read a locator from the text of its file.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        let locator = estimator::Locator::from_json(text);
        Ok(Self::new(locator.map_err(|error| of_locator(&error, "locator", text))?, None))
    }

    fn __repr__(&self) -> String {
        let provenance = &self.inner.provenance.recording;
        format!("<Locator: {}, fitted to {} rows of {}>", self.kind(), provenance.rows, provenance.source)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._html")?.call_method1("locator", (slf,))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = slf.py();
        let own = slf.get();
        let json = serde_json::to_vec(&own.inner).map_err(refused)?;
        let rebuild = py.import("palpate._palpate")?.getattr("Locator")?.getattr("_unpickle")?;
        Ok((rebuild, (PyBytes::new(py, &json), own.choice(py)).into_pyobject(py)?.into_any()))
    }

    #[staticmethod]
    fn _unpickle(json: &[u8], choice: Option<Py<PyDict>>) -> PyResult<Self> {
        Ok(Self::new(serde_json::from_slice(json).map_err(refused)?, choice))
    }
}

impl Locator {
    /// Checks for Ctrl-C between blocks.
    fn locate_many(&self, py: Python<'_>, readings: &[f64], threads: NonZeroUsize) -> PyResult<Estimates> {
        let (channels, extent) = (self.channels.len(), self.setup.surface().extent());
        Estimates::filled(py, readings.len() / channels, extent, |rows| {
            let rows = Mutex::new(rows);
            let take = |first: usize, estimates: &[estimator::Estimate]| {
                let mut rows = rows.lock().unwrap_or_else(PoisonError::into_inner);
                for (i, estimate) in estimates.iter().enumerate() {
                    rows.set(first + i, estimate);
                }
            };
            let locate =
                |watch: Watch<'_>| self.inner.locate_blocks(readings, BatchOptions { threads, watch }, &take);
            let located = if readings.len() <= BLOCK * channels {
                // One block takes less time than the start of a thread.
                py.detach(|| locate(Watch::NONE))
            } else {
                work::run_with(py, Some(PyBool::new(py, false).as_any()), None, locate)?
            };
            located.map_err(|error| match error {
                // Rows are counted from 0, as in the array.
                BatchError::Reading { row, error } => refused(format!("readings[{}]: {error}", row - 1)),
                error => refused(error),
            })?;
            Ok(rows.into_inner().unwrap_or_else(PoisonError::into_inner))
        })
    }
}
