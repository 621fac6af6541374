//! Rigs: a TOML file that describes the bench.

use std::path::PathBuf;
use std::sync::Arc;

use palpate::estimators::setup;
use palpate::rig;
use pyo3::prelude::*;

use crate::bench::{Recording, Setup, check_zero};
use crate::errors::{io_error, of_rig};
use crate::estimator::Estimator;
use crate::training::Training;
use crate::work;

/// A rig: surface, sensors, contact, training positions and estimator of one TOML file.
///
/// `Rig.load` reads a file, `Rig(text)` its text; docs/reference/rig-keys.md has every key.
#[pyclass(frozen, module = "palpate")]
pub struct Rig {
    pub inner: rig::Rig,
    setup: Arc<setup::Setup>,
    text: String,
}

impl Rig {
    fn named(source: &str, text: String) -> PyResult<Self> {
        let inner = rig::Rig::from_toml(&text).map_err(|error| of_rig(&error, source, &text))?;
        let setup = Arc::new(inner.setup.clone());
        Ok(Self { inner, setup, text })
    }
}

#[pymethods]
impl Rig {
    /// The rig of a text in TOML.
    ///
    /// Raises
    /// ------
    /// FileError
    ///     With the place, and a caret below it.
    #[new]
    fn new(text: String) -> PyResult<Self> {
        Self::named("rig", text)
    }

    /// Read a rig from its file.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    ///
    /// Raises
    /// ------
    /// FileError
    ///     With the place, and a caret below it.
    /// OSError
    ///     Where the file cannot be read.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let text = std::fs::read_to_string(&path).map_err(|error| io_error(&error, &path))?;
        Self::named(&path.display().to_string(), text)
    }

    /// Surface, sensors and contact.
    #[getter]
    fn setup(&self) -> Setup {
        Setup(self.setup.clone())
    }

    /// Training positions; None where the rig has none.
    #[getter]
    fn training(&self) -> Option<Training> {
        self.inner.training.clone().map(Training)
    }

    /// The method that locates.
    #[getter]
    fn estimator(&self) -> Estimator {
        Estimator::new_of(self.setup.clone(), self.inner.estimator.clone())
    }

    /// The rig's text.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// Press the simulated surface at the training positions.
    ///
    /// Parameters
    /// ----------
    /// seed : int
    ///     Seed of gains, offsets and noise; the same seed gives the same recording.
    ///
    /// Returns
    /// -------
    /// Recording
    #[pyo3(signature = (*, seed=0))]
    fn simulate(&self, py: Python<'_>, seed: u64) -> PyResult<Recording> {
        check_zero(&self.inner.setup)?;
        let recording = work::run_quietly(py, |watch| self.inner.simulate_watched(seed, watch))?;
        Ok(Recording::new(self.setup.clone(), recording))
    }

    fn __repr__(&self) -> String {
        let setup = pyo3::Python::attach(|py| {
            Bound::new(py, self.setup()).and_then(|setup| setup.repr()?.extract::<String>())
        });
        let setup = setup.unwrap_or_default();
        format!("<Rig: {}, estimator {}>", setup.trim_matches(['<', '>']), self.inner.estimator.kind())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (String,)) {
        (slf.get_type().into_any(), (slf.get().text.clone(),))
    }
}
