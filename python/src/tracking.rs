//! Moving contacts: simulation and tracking.

use std::sync::Arc;

use palpate::estimators::estimator::{self, SmoothTracker, Swing, Track, TrackedContact, TrackerConfig};
use palpate::estimators::recording::{self, TimedRecording};
use palpate::estimators::setup;
use palpate::estimators::simulate::{MovingContacts, simulate_moving_watched as simulate};
use palpate::estimators::track_errors::TrackErrors;
use palpate::mechanics::contact::{Contact, Position};
use palpate::mechanics::surface::modal::ModalBeam;
use palpate::mechanics::surface::{Extent, SurfaceSpec};
use palpate::numerics::watch::{Cancelled, Watch};
use palpate::rig::RigSections;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use serde_json::json;

use crate::arrays::{self, Readings};
use crate::bench::{Recording, Setup};
use crate::errors::{of_rig, of_work, refused};
use crate::estimates::{Estimate, Estimates};
use crate::locator::Locator;
use crate::quantities::{force_n, frequency_hz, time_s};
use crate::rig::Rig;
use crate::values::Fields;
use crate::work;

/// Fields of `palpate.MovingRecording`; `motion` is the section ``[motion]`` of a rig.
#[pyfunction]
#[pyo3(signature = (bench, motion, *, density, force, seed))]
pub fn simulate_moving<'py>(
    py: Python<'py>,
    bench: &Bound<'py, PyAny>,
    motion: Option<&str>,
    density: Option<&str>,
    force: Option<Bound<'py, PyAny>>,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let force_n = force.map(|force| force_n(&force, "force")).transpose()?;
    let (setup, moving, press_n) = match (bench.cast::<Rig>(), motion) {
        (Ok(rig), None) => {
            let rig = rig.get();
            let training = rig.inner.training.as_ref();
            (
                Arc::new(rig.inner.setup.clone()),
                rig.inner.motion,
                training.and_then(|training| training.force_n),
            )
        }
        (Ok(rig), Some(motion)) => {
            let setup = Arc::new(rig.get().inner.setup.clone());
            let moving = moving_contacts(motion, density, &setup)?;
            (setup, moving, None)
        }
        (Err(_), Some(motion)) => {
            let setup = Arc::clone(&bench.cast::<Setup>()?.get().0);
            let moving = moving_contacts(motion, density, &setup)?;
            (setup, moving, None)
        }
        (Err(_), None) => (Arc::clone(&bench.cast::<Setup>()?.get().0), None, None),
    };
    let moving = moving.ok_or_else(|| refused("the motion of the contact is missing: give a `motion`"))?;
    let known_n = force_n.or(press_n).or(setup.force_n());
    let pressed = (*setup).clone().with_force(known_n).map_err(refused)?;
    let timed = work::run_quietly_with(py, |watch| simulate(&pressed, &moving, seed, watch))?;
    let timed = timed.map_err(|error| refused(format!("{error}; set `force`, as in \"3 N\"")))?;
    let fields = Fields::new(py);
    let TimedRecording { mut recording, times_s, second } = timed;
    for (row, time_s) in recording.rows.iter_mut().zip(&times_s) {
        row.time_s = Some(*time_s);
    }
    fields.set("second_x", second_column(py, &second, |contact| contact.position.x_m))?;
    fields.set("second_force", second_column(py, &second, |contact| contact.force_n))?;
    fields.set("frequency", moving.beam.map(|beam| beam.frequency_hz(1)))?;
    fields.set("damping", moving.beam.map(|beam| beam.damping_ratio()))?;
    fields.set("critical_speed", moving.beam.map(|beam| beam.critical_speed_m_per_s()))?;
    fields.set("recording", Py::new(py, Recording::new(setup, recording))?)?;
    Ok(fields.into_dict())
}

/// The file of moving contacts, as palpate's commands read it.
#[pyfunction]
pub fn moving_csv<'py>(
    py: Python<'py>,
    recording: &Recording,
    second: Option<(Vec<f64>, Vec<f64>)>,
) -> PyResult<Bound<'py, PyBytes>> {
    let inner = recording.inner.clone();
    let times_s = inner.times_s().ok_or_else(|| refused("a row has no time"))?;
    let second = second_contacts(second.as_ref());
    let version = env!("CARGO_PKG_VERSION");
    let seed = inner.provenance.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    let comment = format!("palpate {version}: moving contacts from {}{seed}", inner.provenance.source);
    let timed = TimedRecording { recording: inner, times_s, second };
    let mut csv = Vec::new();
    recording::write_timed(&timed, recording.setup.surface().extent(), &comment, &mut csv)?;
    Ok(PyBytes::new(py, &csv))
}

fn second_contacts(second: Option<&(Vec<f64>, Vec<f64>)>) -> Vec<Contact> {
    second.map_or_else(Vec::new, |(x_m, force_n)| {
        let each = x_m.iter().zip(force_n);
        each.map(|(x_m, force_n)| Contact { position: Position::along(*x_m), force_n: *force_n }).collect()
    })
}

/// `None` for one contact.
fn second_column<'py>(
    py: Python<'py>,
    second: &[Contact],
    of: fn(&Contact) -> f64,
) -> Option<Bound<'py, numpy::PyArray1<f64>>> {
    let values: Vec<f64> = second.iter().map(of).collect();
    (!values.is_empty()).then(|| Fields::of_numbers(py, &values))
}

fn moving_contacts(
    motion: &str,
    density: Option<&str>,
    setup: &setup::Setup,
) -> PyResult<Option<MovingContacts>> {
    let text = match (setup.surface(), density) {
        (SurfaceSpec::Beam(beam), Some(density)) => {
            // A beam's density, which determines the vibration, is a key of its surface.
            format!(
                "{motion}[surface]\nkind = \"beam\"\nlength = \"{} m\"\nwidth = \"{} m\"\nthickness = \"{} m\"\nyoungs_modulus = \"{} Pa\"\ndensity = {density}\n",
                beam.length_m(),
                beam.width_m(),
                beam.thickness_m(),
                beam.youngs_modulus_pa()
            )
        }
        (_, Some(_)) => {
            return Err(refused("`density` does not go with a surface other than a beam on two supports"));
        }
        (_, None) => motion.to_owned(),
    };
    let sections = RigSections::from_toml(&text);
    let moving = sections.and_then(|sections| sections.motion(setup));
    moving.map_err(|error| of_rig(&error, "motion", &text))
}

/// Fields of `palpate.Track`.
#[pyfunction]
#[pyo3(signature = (locator, times, readings, *, truth, second_truth, smooth, frequency, damping, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn track<'py>(
    py: Python<'py>,
    locator: &Locator,
    times: &Bound<'py, PyAny>,
    readings: &Bound<'py, PyAny>,
    truth: Option<&Recording>,
    second_truth: Option<(Vec<f64>, Vec<f64>)>,
    smooth: bool,
    frequency: Option<Bound<'py, PyAny>>,
    damping: Option<f64>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let inner = &locator.inner;
    let channels = inner.layout().names();
    let Readings::Many(readings) = arrays::readings(readings, &channels)? else {
        let needed = channels.len();
        return Err(refused(format!(
            "readings of one dimension; a track has the shape (readings, {needed})"
        )));
    };
    let readings = readings.as_slice()?;
    let times_s = arrays::column(times, "times", readings.len() / channels.len())?;
    if let Some(at) = times_s.iter().position(|time_s| !time_s.is_finite()) {
        return Err(refused(format!("times[{at}] is {}; it must be finite", times_s[at])));
    }
    let config = tracker_config(frequency, damping)?;
    let tracking = inner.tracking(&config).map_err(refused)?;
    let tracks = work::run_with(py, progress, None, |watch| {
        let likelihood = tracking.likelihood();
        if smooth {
            let mut tracker = SmoothTracker::new(likelihood, config);
            let take = |time_s: f64, reading: &[f64]| tracker.update(time_s, reading).map(|()| None);
            update_tracks(&times_s, readings, watch, take)?;
            tracker.smoothed(watch).map_err(TrackingFailure::Cancelled)
        } else {
            let mut tracker = estimator::Tracker::new(likelihood, config);
            update_tracks(&times_s, readings, watch, |time_s, reading| {
                tracker.update(time_s, reading).map(Some)
            })
        }
    })?;
    let tracks = tracks.map_err(|error| match error {
        TrackingFailure::At(row, error) => refused(format!("readings[{row}]: {error}")),
        TrackingFailure::Cancelled(cancelled) => of_work(&cancelled),
    })?;
    let fields = track_fields(py, inner, &tracks)?;
    let extent = inner.setup.surface().extent();
    let errors = truth.and_then(|truth| {
        let truths = truths(&truth.inner, second_truth.as_ref());
        (truths.len() == tracks.len()).then(|| TrackErrors::new(&tracks, &truths, extent)).flatten()
    });
    let errors = errors.map(|errors| {
        json!({
            "readings": errors.readings,
            "tracked": errors.tracked,
            "single": errors.single_m,
            "track": errors.track_m,
            "ratio": errors.ratio(),
            "single_covered": errors.single_covered,
            "track_covered": errors.track_covered,
            "single_number_right": errors.single_number_right,
            "track_number_right": errors.track_number_right,
        })
    });
    fields.json("errors", &json!(errors))?;
    Ok(fields.into_dict())
}

/// Without a frequency the surface is in static equilibrium.
fn tracker_config(frequency: Option<Bound<'_, PyAny>>, damping: Option<f64>) -> PyResult<TrackerConfig> {
    let Some(frequency) = frequency else {
        return match damping {
            Some(_) => Err(refused("`damping` does not go without a `frequency`")),
            None => Ok(TrackerConfig::default()),
        };
    };
    let frequency_hz = frequency_hz(&frequency, "frequency")?;
    let damping_ratio = damping.unwrap_or(ModalBeam::USUAL_DAMPING_RATIO);
    if frequency_hz <= 0.0 {
        return Err(refused(format!("`frequency` is {frequency_hz} Hz; it must be greater than 0")));
    }
    if !(0.0..1.0).contains(&damping_ratio) {
        return Err(refused(format!("`damping` is {damping_ratio}; it must be at least 0 and below 1")));
    }
    let swing = Some(Swing { frequency_hz, damping_ratio });
    Ok(TrackerConfig { swing, ..TrackerConfig::default() })
}

/// Follows moving contacts reading by reading; `Locator.tracker` makes it.
#[pyclass(module = "palpate")]
pub struct Tracker {
    inner: estimator::Tracker,
    channels: Vec<String>,
    extent: Extent,
    /// Time of the last reading, in seconds.
    time_s: Option<f64>,
}

#[pymethods]
impl Tracker {
    /// A tracker that has seen nothing; see `Locator.tracker`.
    #[new]
    #[pyo3(signature = (locator, *, frequency=None, damping=None))]
    fn new(locator: &Locator, frequency: Option<Bound<'_, PyAny>>, damping: Option<f64>) -> PyResult<Self> {
        let config = tracker_config(frequency, damping)?;
        let tracking = locator.inner.tracking(&config).map_err(refused)?;
        Ok(Self {
            inner: estimator::Tracker::new(tracking.likelihood(), config),
            channels: locator.inner.layout().names(),
            extent: locator.inner.setup.surface().extent(),
            time_s: None,
        })
    }

    /// Take the next reading.
    ///
    /// Parameters
    /// ----------
    /// time : float or str
    ///     The time of the reading in seconds or with a unit, later than that of the one before.
    /// reading : array_like
    ///     In SI units: of the shape (channels).
    ///
    /// Returns
    /// -------
    /// TrackState
    ///     State of all contacts, by this reading and those before.
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a time that is not later, another shape, and a value that is not finite; the reading is then as if it had not been.
    fn follow<'py>(
        &mut self,
        time: &Bound<'py, PyAny>,
        reading: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = time.py();
        let time_s = time_s(time, "time")?;
        let Readings::One(reading) = arrays::readings(reading, &self.channels)? else {
            let needed = self.channels.len();
            return Err(refused(format!(
                "readings of two dimensions; one reading has the shape ({needed},), and `Locator.track` takes many"
            )));
        };
        let reading = reading.as_slice()?;
        estimator::ReadingError::check(reading, self.channels.len()).map_err(refused)?;
        let track = self.inner.update(time_s, reading).map_err(refused)?;
        self.time_s = Some(time_s);
        let module = py.import("palpate._tracking")?;
        let of_contact = module.getattr("ContactState")?;
        let contacts = track.contacts.iter().map(|contact| {
            let fields = contact_state(py, contact)?;
            of_contact.call((), Some(&fields))
        });
        let fields = Fields::new(py);
        fields.set("time", time_s)?;
        fields.set("touching", track.touching())?;
        fields.set("two_touching", track.numbers[2])?;
        fields.set("contacts", PyTuple::new(py, contacts.collect::<PyResult<Vec<_>>>()?)?)?;
        fields.set("single", Estimate::new(track.single, self.extent))?;
        module.getattr("TrackState")?.call((), Some(&fields.into_dict()))
    }

    fn __repr__(&self) -> String {
        let last = self.time_s.map_or_else(|| "no reading yet".to_owned(), |time_s| format!("at {time_s} s"));
        format!("<Tracker: {} channels, {last}>", self.channels.len())
    }
}

/// Fields of `palpate.ContactState`.
fn contact_state<'py>(py: Python<'py>, contact: &TrackedContact) -> PyResult<Bound<'py, PyDict>> {
    let fields = Fields::new(py);
    let [x_sd, speed_sd, force_sd] = contact.sd;
    for (name, value) in [
        ("x", contact.x_m),
        ("speed", contact.speed_m_per_s),
        ("force", contact.force_n),
        ("x_sd", x_sd),
        ("speed_sd", speed_sd),
        ("force_sd", force_sd),
    ] {
        fields.set(name, value)?;
    }
    fields.set("x_95", contact.x_95_m)?;
    fields.set("force_95", contact.force_interval_95_n())?;
    if let Some(across) = contact.transverse {
        for (name, value) in [
            ("y", across.y_m),
            ("speed_y", across.speed_m_per_s),
            ("y_sd", across.sd[0]),
            ("speed_y_sd", across.sd[1]),
            ("covariance_xy", across.covariance_m2),
        ] {
            fields.set(name, value)?;
        }
        fields.set("y_95", across.y_95_m)?;
    }
    Ok(fields.into_dict())
}

fn truths(recording: &recording::Recording, second: Option<&(Vec<f64>, Vec<f64>)>) -> Vec<Vec<Contact>> {
    let second = second_contacts(second);
    TimedRecording { recording: recording.clone(), times_s: Vec::new(), second }.truths()
}

enum TrackingFailure {
    /// Index of a reading, and the error.
    At(usize, Box<dyn std::error::Error + Send + Sync>),
    Cancelled(Cancelled),
}

fn update_tracks(
    times_s: &[f64],
    readings: &[f64],
    watch: Watch,
    mut take: impl FnMut(f64, &[f64]) -> Result<Option<Track>, estimator::TrackError>,
) -> Result<Vec<Track>, TrackingFailure> {
    const EVERY: usize = 64;
    let count = times_s.len();
    let channels = readings.len() / count.max(1);
    let mut tracks = Vec::new();
    for (i, (time_s, reading)) in times_s.iter().zip(readings.chunks_exact(channels.max(1))).enumerate() {
        if i.is_multiple_of(EVERY) {
            watch.counted("following", "readings", i, count).map_err(TrackingFailure::Cancelled)?;
        }
        estimator::ReadingError::check(reading, channels)
            .map_err(|error| TrackingFailure::At(i, error.into()))?;
        tracks.extend(take(*time_s, reading).map_err(|error| TrackingFailure::At(i, error.into()))?);
    }
    Ok(tracks)
}

fn track_fields<'py>(
    py: Python<'py>,
    locator: &estimator::Locator,
    tracks: &[Track],
) -> PyResult<Fields<'py>> {
    let extent = locator.setup.surface().extent();
    let fields = Fields::new(py);
    fields.column("time", tracks.iter().map(|track| Some(track.time_s)))?;
    fields.column("touching", tracks.iter().map(|track| Some(track.touching())))?;
    fields.column("two_touching", tracks.iter().map(|track| Some(track.numbers[2])))?;
    let contact = |at: usize| {
        let one = Fields::new(py);
        contact_fields(&one, tracks, at, extent.width_m().is_some())?;
        Ok::<_, PyErr>(one.into_dict())
    };
    fields.set("first", contact(0)?)?;
    let several = tracks.iter().any(|track| track.contacts.len() > 1);
    fields.set("second", if several { Some(contact(1)?) } else { None })?;
    let single = Estimates::filled(py, tracks.len(), extent, |mut rows| {
        tracks.iter().enumerate().for_each(|(row, track)| rows.set(row, &track.single));
        Ok(rows)
    })?;
    fields.set("single", Py::new(py, single)?)?;
    Ok(fields)
}

fn contact_fields(fields: &Fields<'_>, tracks: &[Track], at: usize, plane: bool) -> PyResult<()> {
    let contacts = || tracks.iter().map(move |track| track.contacts.get(at));
    let column = |name: &str, of: fn(&TrackedContact) -> Option<f64>| {
        fields.column(name, contacts().map(|contact| contact.and_then(of)))
    };
    column("x", |contact| Some(contact.x_m))?;
    column("speed", |contact| Some(contact.speed_m_per_s))?;
    column("force", |contact| Some(contact.force_n))?;
    column("x_sd", |contact| Some(contact.sd[0]))?;
    column("speed_sd", |contact| Some(contact.sd[1]))?;
    column("force_sd", |contact| Some(contact.sd[2]))?;
    let ends = |(low, high): (f64, f64)| [low, high];
    let x_95 = contacts().map(|contact| contact.map_or([f64::NAN; 2], |contact| ends(contact.x_95_m)));
    fields.columns("x_95", x_95)?;
    let force_95 = contacts()
        .map(|contact| contact.map_or([f64::NAN; 2], |contact| ends(contact.force_interval_95_n())));
    fields.columns("force_95", force_95)?;
    if !plane {
        return Ok(());
    }
    column("y", |contact| Some(contact.transverse?.y_m))?;
    column("speed_y", |contact| Some(contact.transverse?.speed_m_per_s))?;
    column("y_sd", |contact| Some(contact.transverse?.sd[0]))?;
    column("speed_y_sd", |contact| Some(contact.transverse?.sd[1]))?;
    column("covariance_xy", |contact| Some(contact.transverse?.covariance_m2))?;
    let y_95 = contacts().map(|contact| {
        contact.and_then(|contact| contact.transverse).map_or([f64::NAN; 2], |across| ends(across.y_95_m))
    });
    fields.columns("y_95", y_95)
}
