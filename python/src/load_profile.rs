//! Load profiles: distribution of the force over a surface.

use numpy::ToPyArray;
use palpate::estimators::estimator::{
    CentreOfPressure, LoadProfile, LoadSensors, LoadSensorsError, Patch, PatchLimit, Profiler, Resolution,
    patch_limits,
};
use palpate::estimators::fit::ReadingError;
use palpate::estimators::setup;
use palpate::estimators::simulate::simulate_loads_watched as simulate;
use palpate::mechanics::contact::Position;
use palpate::mechanics::surface::{Extent, UniformLoad};
use palpate::rig::RigSections;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::{Value, json};

use crate::arrays::{self, Readings};
use crate::errors::{of_rig, of_work, refused};
use crate::subject::Subject;
use crate::values::{Fields, place};
use crate::work;

/// Fields of `palpate.LoadProfile`, one a reading; `loads` are sections ``[[load]]`` of a rig that the profiles are held beside.
#[pyfunction]
#[pyo3(signature = (bench, readings, loads, *, progress))]
pub fn load_profile<'py>(
    py: Python<'py>,
    bench: &Bound<'py, PyAny>,
    readings: &Bound<'py, PyAny>,
    loads: Option<&str>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let subject = Subject::of(bench, "bench")?;
    let setup = subject.setup();
    let truth = loads.map_or_else(|| Ok(Vec::new()), |text| uniform_loads(text, setup))?;
    let asked = arrays::readings(readings, &setup.layout().names())?;
    let (values, one) = match &asked {
        Readings::One(reading) => (reading.as_slice()?, true),
        Readings::Many(readings) => (readings.as_slice()?, false),
    };
    let channels = setup.layout().len();
    let told = work::run_with(py, progress, None, |watch| {
        let sensors = match &subject {
            Subject::Locator(locator) => locator.load_sensors_watched(watch),
            other => LoadSensors::from_setup_watched(other.setup(), watch),
        };
        let profiler = Profiler::new(sensors.map_err(ProfileFailure::Sensors)?);
        let of_truth = patch_limits(profiler.sensors(), &truth);
        let rows = values.chunks_exact(channels).enumerate();
        let each = rows.map(|(i, reading)| {
            watch.counted("estimating loads", "readings", i, values.len() / channels)?;
            let profile = profiler.profile(reading).map_err(|error| ProfileFailure::Reading(i, error))?;
            let extent = profiler.cells().extent;
            let patches: Vec<UniformLoad> =
                profile.patches.iter().map(|patch| patch.as_load(extent)).collect();
            Ok(ProfileResult {
                limits: patch_limits(profiler.sensors(), &patches),
                resolution: profiler.resolution(&profile),
                profile,
                truth_limits: of_truth.clone(),
            })
        });
        each.collect::<Result<Vec<_>, ProfileFailure>>()
    })?;
    let told = told.map_err(|error| match error {
        ProfileFailure::Sensors(error) => complaint(&error),
        ProfileFailure::Reading(_, error) if one => refused(error),
        ProfileFailure::Reading(row, error) => refused(format!("readings[{row}]: {error}")),
        ProfileFailure::Cancelled(cancelled) => of_work(&cancelled),
    })?;
    let profiles = told.iter().map(|told| told.fields(py, &truth)).collect::<PyResult<Vec<_>>>()?;
    let profiles = PyList::new(py, profiles)?;
    if one { profiles.get_item(0) } else { Ok(profiles.into_any()) }
}

/// Readings of loads that lie on the simulated surface together, of the shape (repeats, channels).
#[pyfunction]
#[pyo3(signature = (bench, loads, *, repeats, seed))]
pub fn simulate_loads<'py>(
    py: Python<'py>,
    bench: &Bound<'py, PyAny>,
    loads: Option<&str>,
    repeats: usize,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let subject = Subject::of(bench, "bench")?;
    let setup = subject.setup();
    let loads = match (loads, &subject) {
        (Some(text), _) => uniform_loads(text, setup)?,
        (None, Subject::Rig(rig)) => rig.loads.clone(),
        (None, _) => Vec::new(),
    };
    if loads.is_empty() {
        return Err(refused("a simulation needs a load; give at least one `UniformLoad`"));
    }
    if repeats == 0 {
        return Err(refused("`repeats` is 0; it must be at least 1"));
    }
    let readings = work::run_quietly(py, |watch| simulate(setup, &loads, repeats, seed, watch))?;
    Fields::of_rows(py, &readings)
}

fn uniform_loads(text: &str, setup: &setup::Setup) -> PyResult<Vec<UniformLoad>> {
    let sections = RigSections::from_toml(text);
    let loads = sections.and_then(|sections| sections.loads(setup.surface()));
    loads.map_err(|error| of_rig(&error, "load", text))
}

enum ProfileFailure {
    Sensors(LoadSensorsError),
    /// Index of a reading, and the error.
    Reading(usize, ReadingError),
    Cancelled(palpate::numerics::watch::Cancelled),
}

impl From<palpate::numerics::watch::Cancelled> for ProfileFailure {
    fn from(cancelled: palpate::numerics::watch::Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

fn complaint(error: &LoadSensorsError) -> PyErr {
    let help = match error {
        LoadSensorsError::NoModel => {
            "give a surface with a model, such as a `Beam`, or a locator of `Influence`"
        }
        LoadSensorsError::NotProportional(error) => error.help(),
        LoadSensorsError::Noise(error) => error.help(),
        LoadSensorsError::Surface(error) => error.help(),
    };
    refused(format!("{error}: {help}"))
}

struct ProfileResult {
    profile: LoadProfile,
    limits: Option<Vec<PatchLimit>>,
    truth_limits: Option<Vec<PatchLimit>>,
    resolution: Option<Resolution>,
}

impl ProfileResult {
    fn fields<'py>(&self, py: Python<'py>, truth: &[UniformLoad]) -> PyResult<Bound<'py, PyDict>> {
        let profile = &self.profile;
        let extent = profile.cells.extent;
        let fields = Fields::new(py);
        fields.set("status", profile.status.name())?;
        fields.set("misfit", profile.chi_squared)?;
        fields.set("worst_misfit", profile.worst_misfit)?;
        fields.set("total", profile.total_n)?;
        fields.set("total_sd", profile.total_sd_n)?;
        fields.set("total_95", profile.bounds.total_95_n)?;
        fields.set("margin", profile.bounds.margin_m)?;
        fields.set("seen_95", profile.bounds.seen_95_n)?;
        let centre = profile.centre.map(|centre| of_centre(&centre, extent));
        fields.json("centre", &json!(centre))?;
        fields.set("resolution", self.resolution.as_ref().map(Resolution::median_width_m))?;
        let widths = self.resolution.as_ref().map(|resolution| resolution.widths_m.to_pyarray(py));
        fields.set("kernel_widths", widths)?;
        fields
            .set("kernels", self.resolution.as_ref().map(|resolution| resolution.kernels.to_pyarray(py)))?;
        let limit = |limits: &Option<Vec<PatchLimit>>, i: usize| {
            limits.as_ref().and_then(|limits| limits.get(i).copied())
        };
        let patches = profile.patches.iter().enumerate();
        let patches = patches.map(|(i, patch)| of_patch(patch, limit(&self.limits, i), extent));
        fields.json("patches", &Value::from_iter(patches))?;
        let loads = truth.iter().enumerate();
        let loads = loads.map(|(i, load)| of_load(load, limit(&self.truth_limits, i), extent));
        fields.json("loads", &Value::from_iter(loads))?;
        let centres: Vec<Position> = profile.cells.centres().collect();
        fields.positions(&centres, extent)?;
        let densities: Vec<(f64, (f64, f64))> =
            (0..profile.cells.len()).map(|cell| profile.density(cell)).collect();
        fields.column("density", densities.iter().map(|(density, _)| Some(*density)))?;
        fields.columns("density_95", densities.iter().map(|(_, (low, high))| [*low, *high]))?;
        fields.column("cell_force", profile.forces_n.iter().copied().map(Some))?;
        fields.set("cells", (profile.cells.columns, profile.cells.rows))?;
        fields.column("residuals", profile.residuals.iter().copied())?;
        fields.column("fitted", profile.fitted.iter().copied())?;
        Ok(fields.into_dict())
    }
}

/// Position, standard deviations, and 95 % intervals.
fn of_centre(centre: &CentreOfPressure, extent: Extent) -> Value {
    json!({
        "x": centre.position.x_m,
        "x_sd": centre.sd_x_m,
        "x_95": centre.x_95_m,
        "y": extent.if_plane(centre.position.y_m),
        "y_sd": extent.if_plane(centre.sd_y_m),
        "y_95": extent.if_plane(centre.y_95_m),
    })
}

fn of_patch(patch: &Patch, limit: Option<PatchLimit>, extent: Extent) -> Value {
    json!({
        "from": place(patch.from, extent),
        "to": place(patch.to, extent),
        "centre": of_centre(&patch.centre, extent),
        "force": patch.force_n,
        "force_sd": patch.force_sd_n,
        "force_95": patch.force_95_n,
        "limit": limit.map(|limit| of_limit(limit, extent)),
    })
}

fn of_load(load: &UniformLoad, limit: Option<PatchLimit>, extent: Extent) -> Value {
    json!({
        "from": place(load.from(), extent),
        "to": place(load.to(), extent),
        "centre": place(load.centre(), extent),
        "force": load.force_n(),
        "limit": limit.map(|limit| of_limit(limit, extent)),
    })
}

/// Least standard deviations for evenly loaded patches of this number and size.
fn of_limit(limit: PatchLimit, extent: Extent) -> Value {
    json!({ "x": limit.sd_x_m, "y": extent.if_plane(limit.sd_y_m), "force": limit.sd_force_n })
}
