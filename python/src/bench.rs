//! Setups, and recordings of their sensors.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use palpate::estimators::fit::ReadingError;
use palpate::estimators::recording::{self, Row, Zero};
use palpate::estimators::recording_check::check_recording;
use palpate::estimators::setup;
use palpate::estimators::simulate::{CleanSensors, SimulateError, simulate_contacts_watched};
use palpate::mechanics::contact::{Contact, OffSurface, Position};
use palpate::mechanics::surface::{Extent, SurfaceSpec};
use palpate::mechanics::units::format_length_mm;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyBytes, PyDict, PyList, PyTuple};

use crate::arrays::{self, Readings, positions_array};
use crate::errors::{io_error, of_csv, refused};
use crate::files::write_whole;
use crate::methods;
use crate::quantities::force_n;
use crate::sections;
use crate::surface;
use crate::training::{self, Training, checked_force};
use crate::work;

/// A surface with its sensors, all checked: what a reading comes from.
///
/// Parameters
/// ----------
/// surface : Beam, Plate, Digit or Measured
///     The elastic body that is touched.
/// *sensors : Sensors
///     What is measured where, as `deflection(8, noise="5 um")` makes them.
/// force : float or str, optional
///     Force of the contacts in newtons or with a unit, where it is known and one for all.
/// greatest_force : float or str, optional
///     The greatest that an unknown force can be, on a surface with a model; by default ten times that of the presses.
/// force_range : pair of float or str, optional
///     Least and greatest force of contacts of unknown force: 1 in 200 is lighter, none is harder. Without it a decade either side of the presses, where
///     readings are proportional to the force.
/// columns : Columns or mapping, optional
///     Columns of recordings by their roles, where they are not as palpate writes them.
///
/// Raises
/// ------
/// PalpateError
///     For a value out of its bounds, and for sensors that do not go with the surface.
///
/// Examples
/// --------
/// >>> import palpate as pp
/// >>> pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
/// <Setup: beam 400 mm, 8 sensors (deflection), unknown force>
#[pyclass(frozen, eq, module = "palpate")]
#[derive(PartialEq)]
pub struct Setup(pub Arc<setup::Setup>);

#[pymethods]
impl Setup {
    #[new]
    #[pyo3(signature = (surface, *sensors, force=None, greatest_force=None, force_range=None, columns=None))]
    fn new(
        surface: Bound<'_, PyAny>,
        sensors: Bound<'_, PyTuple>,
        force: Option<Bound<'_, PyAny>>,
        greatest_force: Option<Bound<'_, PyAny>>,
        force_range: Option<Bound<'_, PyAny>>,
        columns: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let module = surface.py().import("palpate._sensors")?;
        let arguments = (surface, sensors, force, greatest_force, force_range, columns);
        let text = module.call_method1("setup_toml", arguments)?;
        Ok(Self(Arc::new(sections::setup(&text.extract::<String>()?)?)))
    }

    /// The setup of a rig's sections; `Rig` reads a whole one.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     ``[surface]``, ``[sensors]``, and where needed ``[contact]`` and ``[recording]``.
    ///
    /// Raises
    /// ------
    /// FileError
    ///     With the place in the text.
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        Ok(Self(Arc::new(sections::setup(text)?)))
    }

    /// Kind of the surface: "beam", "plate", "digit" or "measured".
    #[getter]
    fn kind(&self) -> &'static str {
        match self.0.surface() {
            SurfaceSpec::Beam(_) | SurfaceSpec::SupportedBeam(_) => "beam",
            SurfaceSpec::Plate(_) => "plate",
            SurfaceSpec::Digit(_) => "digit",
            SurfaceSpec::Measured(_) => "measured",
        }
    }

    /// Length of the surface, in metres.
    #[getter]
    fn length(&self) -> f64 {
        self.extent().length_m()
    }

    /// Width of a plane, in metres; None of a line.
    #[getter]
    fn width(&self) -> Option<f64> {
        self.extent().width_m()
    }

    /// Known force of the contacts in newtons; None where it is not known.
    #[getter]
    fn force(&self) -> Option<f64> {
        self.0.force_n()
    }

    /// Names of the channels, one a sensor.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.0.layout().names()
    }

    /// What each sensor measures: "deflection", "slope", "strain", "reaction" or "raw".
    #[getter]
    fn measures(&self) -> Vec<String> {
        self.0.layout().kinds().iter().map(ToString::to_string).collect()
    }

    /// Positions of the sensors, in metres: of the shape (sensors), or (sensors, 2) on a plane.
    #[getter]
    fn sensor_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let positions: Vec<Position> =
            self.0.layout().sensors().iter().map(|sensor| sensor.position).collect();
        positions_array(py, &positions, self.extent())
    }

    /// Positions of the surface's supports that take up force, in metres: of the shape (supports), or (supports, 2) on a plane.
    #[getter]
    fn supports<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let supports = self.0.surface().model().map(|model| model.force_supports()).unwrap_or_default();
        positions_array(py, &supports, self.extent())
    }

    /// Kind of each of these supports: "simple", "clamped" or "elastic".
    #[getter]
    fn support_kinds(&self) -> Vec<&'static str> {
        surface::support_kinds(self.0.surface())
    }

    /// Supports of the edges "left", "right", "bottom" and "top" of a plate: "simple", "clamped" or "free"; None of another surface.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        surface::edges(self.0.surface()).map(|edges| edges.into_py_dict(py)).transpose()
    }

    /// Standard deviations of the readings' noise, in the SI unit of each sensor: of the shape (sensors).
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let noise: Vec<f64> =
            self.0.layout().sensors().iter().map(|sensor| sensor.channel.noise_sd).collect();
        noise.to_pyarray(py)
    }

    /// This setup with contacts of another force, in newtons or with a unit; None for an unknown one.
    #[pyo3(signature = (force))]
    fn with_force(&self, force: Option<Bound<'_, PyAny>>) -> PyResult<Self> {
        let force_n = force.map(|force| force_n(&force, "force")).transpose()?;
        Ok(Self(Arc::new((*self.0).clone().with_force(force_n).map_err(refused)?)))
    }

    /// This setup with this noise of every sensor that measures in its unit.
    ///
    /// Parameters
    /// ----------
    /// noise : str
    ///     Standard deviation of a reading's noise with its unit: "5 um".
    fn with_noise(&self, noise: &str) -> PyResult<Self> {
        let noise = noise.parse().map_err(|error| refused(format!("`noise`: {error}")))?;
        Ok(Self(Arc::new((*self.0).clone().with_noise(noise).map_err(refused)?)))
    }

    /// This setup with the imperfections of a real bench, which its simulations have; None for the faults of the sensors alone.
    ///
    /// Parameters
    /// ----------
    /// imperfections : Imperfections or None
    ///
    /// Raises
    /// ------
    /// FileError
    ///     For a value out of its range, and for a surface without a model.
    #[pyo3(signature = (imperfections))]
    fn with_imperfections(&self, py: Python<'_>, imperfections: Option<Bound<'_, PyAny>>) -> PyResult<Self> {
        let Some(imperfections) = imperfections else {
            return Ok(Self(Arc::new((*self.0).clone().without_imperfections())));
        };
        let text =
            py.import("palpate._imperfections")?.call_method1("imperfections_toml", (imperfections,))?;
        Ok(Self(Arc::new(sections::with_imperfections(&text.extract::<String>()?, &self.0)?)))
    }

    /// True where simulations have the imperfections of a real bench.
    #[getter]
    fn is_imperfect(&self) -> bool {
        self.0.imperfections().is_some()
    }

    /// The training positions on this surface, each once.
    ///
    /// Returns
    /// -------
    /// ndarray of float64
    ///     In metres, of the shape (positions), or (positions, 2) on a plane.
    fn positions<'py>(&self, py: Python<'py>, training: &Training) -> PyResult<Bound<'py, PyAny>> {
        let positions = training.0.positions(self.extent()).map_err(refused)?;
        positions_array(py, &positions, self.extent())
    }

    /// Press the simulated surface at the training positions, and record what its faulty channels report.
    ///
    /// Parameters
    /// ----------
    /// training : Training
    ///     Where to press, as `even(10)` makes it.
    /// force : float or str, optional
    ///     Force of the presses in newtons or with a unit; by default the training's or the setup's.
    /// repeats : int, optional
    ///     Presses at each position; by default the training's.
    /// seed : int
    ///     Seed of gains, offsets and noise; the same seed gives the same recording.
    ///
    /// Returns
    /// -------
    /// Recording
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     When the surface has no model, or the force is not known.
    #[pyo3(signature = (training, *, force=None, repeats=None, seed=0))]
    fn simulate(
        &self,
        py: Python<'_>,
        training: &Training,
        force: Option<Bound<'_, PyAny>>,
        repeats: Option<usize>,
        seed: u64,
    ) -> PyResult<Recording> {
        let mut training = training.0.clone();
        if let Some(repeats) = repeats {
            training = training.repeated(repeats);
        }
        if let Some(force) = force {
            training = training.with_force(checked_force(&force)?);
        }
        check_zero(&self.0)?;
        let recording = work::run_quietly(py, |watch| self.0.simulate_watched(&training, seed, watch))?;
        Ok(Recording::new(self.0.clone(), recording))
    }

    /// Press the simulated surface by contacts of one's own.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like
    ///     In metres or with units: of the shape (contacts), or (contacts, 2) on a plane.
    /// force : float, str or array_like, optional
    ///     Force of the contacts, or of each, in newtons or with a unit; by default the setup's.
    /// repeats : int
    ///     Presses by each contact.
    /// seed : int
    ///     Seed of gains, offsets and noise.
    ///
    /// Returns
    /// -------
    /// Recording
    #[pyo3(signature = (positions, *, force=None, repeats=1, seed=0))]
    fn simulate_at(
        &self,
        py: Python<'_>,
        positions: Bound<'_, PyAny>,
        force: Option<Bound<'_, PyAny>>,
        repeats: usize,
        seed: u64,
    ) -> PyResult<Recording> {
        check_zero(&self.0)?;
        let positions = training::positions(&positions)?;
        let forces_n = self.forces(force, positions.len())?;
        let contacts: Vec<Contact> = positions
            .into_iter()
            .zip(forces_n)
            .map(|(position, force_n)| Contact { position, force_n })
            .collect();
        let recording = work::run_quietly(py, |watch| {
            simulate_contacts_watched(&self.0, &contacts, repeats, seed, watch)
        })?;
        Ok(Recording::new(self.0.clone(), recording))
    }

    /// Readings of faultless sensors, without noise, for contacts of this force.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like
    ///     In metres or with units: of the shape (contacts), or (contacts, 2) on a plane.
    /// force : float, str or array_like
    ///     Force of the contacts, or of each; by default 1 N: then the readings are the influence functions.
    ///
    /// Returns
    /// -------
    /// ndarray of float64
    ///     In SI units, of the shape (contacts, sensors).
    #[pyo3(signature = (positions, *, force=None))]
    fn response<'py>(
        &self,
        py: Python<'py>,
        positions: Bound<'py, PyAny>,
        force: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let positions = training::positions(&positions)?;
        let forces_n = match force {
            Some(force) => self.forces(Some(force), positions.len())?,
            None => vec![1.0; positions.len()],
        };
        let model = self.0.surface().model().ok_or_else(|| refused("a measured surface has no model"))?;
        OffSurface::check("position", &positions, self.extent()).map_err(refused)?;
        let readings = work::run_quietly(py, |watch| {
            model.check_solution_watched(watch)?;
            let sensors = CleanSensors::new_watched(model, self.0.layout(), watch)?;
            let mut readings: Vec<f64> = Vec::new();
            for (&position, &force_n) in positions.iter().zip(&forces_n) {
                watch.round()?;
                readings.extend(sensors.reading(Contact { position, force_n }));
            }
            Ok::<_, SimulateError>(readings)
        })?;
        readings.to_pyarray(py).reshape([positions.len(), self.0.layout().len()])
    }

    /// Tell how force is spread over the surface; see `load_profile`.
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

    /// Shape of a line that a contact bends: of a beam by beam theory, of a digit exactly.
    ///
    /// Parameters
    /// ----------
    /// position : float or str
    ///     Position of the contact, in metres or with a unit.
    /// force : float or str, optional
    ///     Force of the contact in newtons or with a unit; by default the setup's.
    /// points : int
    ///     Points along the line, its ends included.
    ///
    /// Returns
    /// -------
    /// ndarray of float64
    ///     Position and height of each point in metres, upward positive: of the shape (points, 2).
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     On a plane, on a measured surface, without a force, and for a position off the surface.
    #[pyo3(signature = (position, *, force=None, points=201))]
    fn shape<'py>(
        &self,
        py: Python<'py>,
        position: Bound<'py, PyAny>,
        force: Option<Bound<'py, PyAny>>,
        points: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let position = training::position(&position)?;
        let contact = Contact { position, force_n: self.forces(force, 1)?[0] };
        let line = py.detach(|| surface::bent_line(self.0.surface(), contact, points))?;
        line.concat().to_pyarray(py).reshape([line.len(), 2])
    }

    /// Read a recording from CSV of any dialect.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    ///     The file.
    /// contacts : str or path, optional
    ///     A second file with the contacts, row by row, where the first has the readings alone.
    ///
    /// Returns
    /// -------
    /// Recording
    ///
    /// Raises
    /// ------
    /// FileError
    ///     With line and column.
    /// OSError
    ///     Where a file cannot be read.
    #[pyo3(signature = (path, contacts=None))]
    fn read_csv(&self, py: Python<'_>, path: PathBuf, contacts: Option<PathBuf>) -> PyResult<Recording> {
        let read = |path: &PathBuf| std::fs::read(path).map_err(|error| io_error(&error, path));
        let readings = read(&path)?;
        let contacts =
            contacts.map(|path| Ok::<_, PyErr>((path.display().to_string(), read(&path)?))).transpose()?;
        let name = path.display().to_string();
        let recording = py.detach(|| match &contacts {
            None => self.0.read_recording(&name, readings.as_slice()),
            Some((contacts_name, bytes)) => {
                let contacts = (contacts_name.as_str(), bytes.as_slice());
                self.0.read_recording_pair((&name, readings.as_slice()), contacts)
            }
        });
        Ok(Recording::new(self.0.clone(), recording.map_err(|error| of_csv(&error))?))
    }

    /// A recording from a data frame: one of `Recording.to_frame`, or one with the columns of a CSV file, by their roles in `columns` and
    /// with units in their names.
    ///
    /// Parameters
    /// ----------
    /// frame : pandas.DataFrame
    ///
    /// Returns
    /// -------
    /// Recording
    fn read_frame<'py>(slf: &Bound<'py, Self>, frame: &Bound<'py, PyAny>) -> PyResult<Recording> {
        let (py, setup) = (slf.py(), slf.get());
        let own = py.import("palpate._frames")?.call_method1("own_columns", (frame, slf))?;
        if let Ok(own) = own.cast::<PyDict>() {
            let recording = slf.call_method("recording", (), Some(own))?;
            let recording = recording.cast::<Recording>()?.get();
            return Ok(Recording::new(setup.0.clone(), recording.inner.clone()));
        }
        let options = PyDict::new(py);
        options.set_item("index", false)?;
        let text: String = frame.call_method("to_csv", (), Some(&options))?.extract()?;
        let recording = setup.0.read_recording("frame", text.as_bytes()).map_err(|error| of_csv(&error))?;
        Ok(Recording::new(setup.0.clone(), recording))
    }

    /// A recording from arrays.
    ///
    /// Parameters
    /// ----------
    /// readings : array_like
    ///     In SI units, or raw: of the shape (rows, sensors).
    /// x : array_like
    ///     Position of each contact, in metres: of the shape (rows).
    /// y : array_like, optional
    ///     Position across a plane, in metres: of the shape (rows).
    /// force : float, str or array_like, optional
    ///     Force of each contact in newtons, 0 for an untouched row; by default the setup's.
    /// nuisance : array_like, optional
    ///     Coordinates that shape the readings and are unknown in use: of the shape (rows) or (rows, coordinates).
    /// time : array_like, optional
    ///     Time of each row, in seconds: of the shape (rows).
    ///
    /// Returns
    /// -------
    /// Recording
    #[pyo3(signature = (readings, x, y=None, *, force=None, nuisance=None, time=None))]
    fn recording<'py>(
        &self,
        readings: &Bound<'py, PyAny>,
        x: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        force: Option<Bound<'py, PyAny>>,
        nuisance: Option<&Bound<'py, PyAny>>,
        time: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Recording> {
        check_zero(&self.0)?;
        let Readings::Many(readings) = arrays::readings_or_none(readings, &self.channels())? else {
            return Err(refused(format!(
                "readings of one dimension; a recording has the shape (rows, {})",
                self.0.layout().len()
            )));
        };
        let readings = readings.as_slice()?;
        let channels = self.0.layout().len();
        let rows = readings.len() / channels;
        let x_m = arrays::column(x, "x", rows)?;
        let y_m = match (y, self.extent()) {
            (Some(y), Extent::Plane { .. }) => arrays::column(y, "y", rows)?,
            (None, Extent::Line { .. }) => vec![0.0; rows],
            (None, Extent::Plane { .. }) => return Err(refused("`y` is needed on a plane")),
            (Some(_), Extent::Line { .. }) => {
                return Err(refused("`y` does not go with a line, which has no width"));
            }
        };
        let forces_n = self.row_forces(force, rows)?;
        let nuisances = match nuisance {
            Some(nuisance) => nuisance_rows(nuisance, rows)?,
            None => vec![Vec::new(); rows],
        };
        let times_s = time.map(|time| arrays::column(time, "time", rows)).transpose()?;
        let mut made = Vec::with_capacity(rows);
        for (i, reading) in readings.chunks_exact(channels).enumerate() {
            let row = |error: &dyn std::fmt::Display| refused(format!("row {i}: {error}"));
            ReadingError::check(reading, channels).map_err(|error| row(&error))?;
            let position = Position { x_m: x_m[i], y_m: y_m[i] };
            let force_n = forces_n[i];
            let time_s = times_s.as_ref().map(|times_s| times_s[i]);
            for (name, value) in [("force", force_n), ("time", time_s)] {
                if value.is_some_and(|value| !value.is_finite()) {
                    return Err(row(&format!(
                        "`{name}` is {}; it must be finite",
                        value.unwrap_or_default()
                    )));
                }
            }
            if force_n != Some(0.0) {
                OffSurface::check("position", &[position], self.extent()).map_err(|error| row(&error))?;
            }
            let nuisances = nuisances[i].clone();
            made.push(Row { position, force_n, nuisances, time_s, reading: reading.to_vec() });
        }
        if made.is_empty() {
            return Err(refused("0 rows; a recording has at least 1"));
        }
        Ok(Recording::new(self.0.clone(), recording::Recording::new(self.0.layout(), "arrays", made)))
    }

    fn __repr__(&self) -> String {
        let extent = self.extent();
        let across =
            extent.width_m().map_or_else(String::new, |width_m| format!(" × {}", format_length_mm(width_m)));
        let mut kinds: Vec<String> = self.measures();
        kinds.dedup();
        let force =
            self.0.force_n().map_or_else(|| "unknown force".to_owned(), |force_n| format!("{force_n} N"));
        let mut text = format!("<Setup: {} {}{across}, ", self.kind(), format_length_mm(extent.length_m()));
        let _ = write!(text, "{} sensors ({}), {force}>", self.0.layout().len(), kinds.join(", "));
        text
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._html")?.call_method1("setup", (slf,))
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        (self.0.layout().names(), self.extent().length_m().to_bits()).hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let json = serde_json::to_vec(&*slf.get().0).map_err(refused)?;
        Ok((
            slf.py().import("palpate._palpate")?.getattr("Setup")?.getattr("_from_json")?,
            (PyBytes::new(slf.py(), &json),),
        ))
    }

    #[staticmethod]
    fn _from_json(json: &[u8]) -> PyResult<Self> {
        Ok(Self(Arc::new(serde_json::from_slice(json).map_err(refused)?)))
    }
}

impl Setup {
    pub fn extent(&self) -> Extent {
        self.0.surface().extent()
    }

    /// One force for each contact, or one for all.
    fn forces(&self, force: Option<Bound<'_, PyAny>>, count: usize) -> PyResult<Vec<f64>> {
        let forces_n = self.row_forces(force, count)?;
        let each = forces_n
            .into_iter()
            .map(|force_n| force_n.ok_or_else(|| refused("`force` is needed: the setup has no known force")));
        each.map(|force_n| {
            let force_n = force_n?;
            if force_n > 0.0 && force_n.is_finite() {
                return Ok(force_n);
            }
            Err(refused(format!("`force` is {force_n} N; it must be greater than 0 and finite")))
        })
        .collect()
    }

    /// Given forces, one for all, or the setup's.
    fn row_forces(&self, force: Option<Bound<'_, PyAny>>, rows: usize) -> PyResult<Vec<Option<f64>>> {
        match force {
            None => Ok(vec![self.0.force_n(); rows]),
            Some(force) => match force_n(&force, "force") {
                Ok(force_n) => Ok(vec![Some(force_n); rows]),
                Err(error) if force.is_instance_of::<pyo3::types::PyString>() => Err(error),
                Err(_) => Ok(arrays::column(&force, "force", rows)?.into_iter().map(Some).collect()),
            },
        }
    }
}

/// Refuses a setup with `zero`: only files contain readings as recorded.
pub fn check_zero(setup: &setup::Setup) -> PyResult<()> {
    match setup.recording_columns().zero {
        Zero::None => Ok(()),
        Zero::Last => Err(refused(
            "`zero = \"last\"` of [recording] applies to files of readings as recorded: simulate with `palpate simulate`, and read with `read_csv`",
        )),
    }
}

fn nuisance_rows(value: &Bound<'_, PyAny>, rows: usize) -> PyResult<Vec<Vec<f64>>> {
    let columns = value.py().import("palpate._arrays")?.call_method1("nuisances", (value, rows))?;
    columns.extract()
}

/// Readings with the contacts that caused them, by the sensors of a setup.
///
/// `Setup.read_csv`, `Setup.recording`, `Setup.read_frame` and `Setup.simulate` make recordings. ``recording[rows]`` takes some of the rows, by
/// a slice, an array of indices or one of booleans.
#[pyclass(frozen, module = "palpate")]
pub struct Recording {
    pub setup: Arc<setup::Setup>,
    pub inner: recording::Recording,
}

impl Recording {
    pub fn new(setup: Arc<setup::Setup>, inner: recording::Recording) -> Self {
        Self { setup, inner }
    }

    fn column<'py>(&self, py: Python<'py>, value: impl Fn(&Row) -> f64) -> Bound<'py, PyArray1<f64>> {
        self.inner.rows.iter().map(value).collect::<Vec<f64>>().to_pyarray(py)
    }
}

#[pymethods]
impl Recording {
    /// The setup that recorded it.
    #[getter]
    fn setup(&self) -> Setup {
        Setup(self.setup.clone())
    }

    /// Names of the channels, in the order of the readings' values.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.inner.channels.clone()
    }

    /// Readings in SI units, or raw: of the shape (rows, channels).
    #[getter]
    fn readings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let values: Vec<f64> = self.inner.rows.iter().flat_map(|row| row.reading.iter().copied()).collect();
        values.to_pyarray(py).reshape([self.inner.rows.len(), self.inner.channels.len()])
    }

    /// Position of each contact along the surface, in metres: of the shape (rows). A row without contact has a position without a meaning.
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.position.x_m)
    }

    /// Position of each contact across a plane, in metres: of the shape (rows); None on a line.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let plane = matches!(self.setup.surface().extent(), Extent::Plane { .. });
        plane.then(|| self.column(py, |row| row.position.y_m))
    }

    /// Position of each contact, in metres: of the shape (rows), or (rows, 2) on a plane, as scikit-learn's estimators take targets.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let each: Vec<Position> = self.inner.rows.iter().map(|row| row.position).collect();
        positions_array(py, &each, self.setup.surface().extent())
    }

    /// Force of each contact in newtons, 0 for an untouched row, and NaN for a force that was not measured: of the shape (rows).
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.force_n.unwrap_or(f64::NAN))
    }

    /// Time of each row in seconds, NaN where it has none: of the shape (rows).
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.time_s.unwrap_or(f64::NAN))
    }

    /// Coordinates that shape the readings and are unknown in use: of the shape (rows, coordinates).
    #[getter]
    fn nuisance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.inner.rows.first().map_or(0, |row| row.nuisances.len());
        let values: Vec<f64> = self.inner.rows.iter().flat_map(|row| row.nuisances.iter().copied()).collect();
        values.to_pyarray(py).reshape([self.inner.rows.len(), count])
    }

    /// Whether something touched, row by row: of the shape (rows).
    #[getter]
    fn touches<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.inner.rows.iter().map(Row::touches).collect::<Vec<bool>>().to_pyarray(py)
    }

    /// Every position that was touched, once, sorted by x and then y, in metres: of the shape (positions), or (positions, 2) on a plane.
    #[getter]
    fn distinct_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        positions_array(py, &self.inner.distinct_positions(), self.setup.surface().extent())
    }

    /// Warnings of dead or saturated channels, repeats that disagree, drift and repeated readings, and of what contradicts the setup: units,
    /// mirrored positions, the order, sign and gain of channels, noise.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let mismatches = check_recording(&self.setup, &self.inner);
        let mismatches = mismatches.iter().map(ToString::to_string);
        self.inner.warning_lines().into_iter().chain(mismatches).collect()
    }

    /// Name of the file that it was read from, or "simulation", "arrays" or "frame".
    #[getter]
    fn source(&self) -> &str {
        &self.inner.provenance.source
    }

    /// Folds that hold positions out: of the distinct positions, sorted by x and then y, fold k holds out those whose index leaves k when
    /// divided by `count`, with all their rows.
    ///
    /// Parameters
    /// ----------
    /// count : int
    ///     Number of folds.
    ///
    /// Returns
    /// -------
    /// list of (ndarray of int, ndarray of int)
    ///     The rows to fit, and the rows at held-out positions.
    #[pyo3(signature = (count=5))]
    fn folds<'py>(&self, py: Python<'py>, count: usize) -> PyResult<Bound<'py, PyList>> {
        let indices =
            |rows: &[usize]| rows.iter().map(|row| *row as i64).collect::<Vec<i64>>().to_pyarray(py);
        let folds = self.inner.folds(count).map_err(refused)?;
        PyList::new(py, folds.iter().map(|fold| (indices(&fold.training), indices(&fold.held_out))))
    }

    /// Write the recording as CSV, as palpate's commands read it.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    fn to_csv(&self, path: PathBuf) -> PyResult<()> {
        check_zero(&self.setup)?;
        let bytes = self.csv()?;
        write_whole(&path, &bytes)
    }

    /// The recording as a data frame, with units in the names of its columns.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    fn to_frame<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._frames")?.call_method1("recording", (slf,))
    }

    /// The recording as arrays by name, as `numpy.savez` takes them: ``np.savez("presses.npz", **recording.to_dict())``.
    ///
    /// Returns
    /// -------
    /// dict of ndarray
    ///     What `Setup.recording` takes: "readings", "x", and where there are some "y", "force", "nuisance" and "time".
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let arrays = PyDict::new(py);
        arrays.set_item("readings", self.readings(py)?)?;
        arrays.set_item("x", self.x(py))?;
        if let Some(y) = self.y(py) {
            arrays.set_item("y", y)?;
        }
        let rows = &self.inner.rows;
        if rows.iter().all(|row| row.force_n.is_some()) {
            arrays.set_item("force", self.force(py))?;
        }
        if rows.iter().any(|row| !row.nuisances.is_empty()) {
            arrays.set_item("nuisance", self.nuisance(py)?)?;
        }
        if rows.iter().all(|row| row.time_s.is_some()) {
            arrays.set_item("time", self.time(py))?;
        }
        Ok(arrays)
    }

    fn __len__(&self) -> usize {
        self.inner.rows.len()
    }

    fn __getitem__(&self, rows: &Bound<'_, PyAny>) -> PyResult<Self> {
        let rows = arrays::row_indices(rows, self.inner.rows.len())?;
        if rows.is_empty() {
            return Err(refused("0 rows are left; a recording has at least 1"));
        }
        Ok(Self::new(self.setup.clone(), self.inner.subset(&rows)))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            self.setup == other.setup && self.inner == other.inner
        })
    }

    fn __repr__(&self) -> String {
        let positions = self.inner.distinct_positions().len();
        let (rows, channels) = (self.inner.rows.len(), self.inner.channels.len());
        format!(
            "<Recording: {rows} rows at {positions} positions, {channels} channels, from {}>",
            self.source()
        )
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._html")?.call_method1("recording", (slf,))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = slf.py();
        let provenance = serde_json::to_vec(&slf.get().inner.provenance).map_err(refused)?;
        let rows: Vec<_> = slf.get().inner.rows.iter().map(packed).collect();
        let rebuild = py.import("palpate._palpate")?.getattr("Recording")?.getattr("_from_rows")?;
        let arguments = (slf.get().setup(), PyBytes::new(py, &provenance), rows);
        Ok((rebuild, arguments.into_pyobject(py)?.into_any()))
    }

    #[staticmethod]
    fn _from_rows(setup: &Setup, provenance: &[u8], rows: Vec<PackedRow>) -> PyResult<Self> {
        let rows = rows.into_iter().map(unpacked).collect();
        let mut inner = recording::Recording::new(setup.0.layout(), "", rows);
        inner.provenance = serde_json::from_slice(provenance).map_err(refused)?;
        Ok(Self::new(setup.0.clone(), inner))
    }
}

/// Position, force, nuisances, time and reading.
type PackedRow = ((f64, f64), Option<f64>, Vec<f64>, Option<f64>, Vec<f64>);

fn packed(row: &Row) -> PackedRow {
    let Row { position, force_n, nuisances, time_s, reading } = row.clone();
    ((position.x_m, position.y_m), force_n, nuisances, time_s, reading)
}

fn unpacked(((x_m, y_m), force_n, nuisances, time_s, reading): PackedRow) -> Row {
    Row { position: Position { x_m, y_m }, force_n, nuisances, time_s, reading }
}

impl Recording {
    fn csv(&self) -> PyResult<Vec<u8>> {
        let version = env!("CARGO_PKG_VERSION");
        let seed = self.inner.provenance.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
        let comment =
            format!("palpate {version}: recording from {}{seed}", self.source().replace(['\n', '\r'], " "));
        let mut bytes = Vec::new();
        recording::write(&self.inner, self.setup.surface().extent(), &comment, &mut bytes)?;
        Ok(bytes)
    }
}
