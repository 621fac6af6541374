//! Placement of training positions, and the next press of a recording.

use std::sync::Arc;

use palpate::design::positions::{
    PositionDesign, PositionProblem, Verification, VerifiedPositions, best_placed, next_press as advise,
};
use palpate::estimators::arrangement::{self, Arrangement};
use palpate::estimators::setup;
use palpate::mechanics::contact::Position;
use palpate::mechanics::limit::Force;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::positions_array;
use crate::bench::Recording;
use crate::errors::refused;
use crate::estimator::Estimator;
use crate::quantities::share;
use crate::sections;
use crate::subject::Subject;
use crate::training::Training;
use crate::values::Fields;
use crate::work;

/// Fields of `palpate.TrainingPlacement`.
#[pyfunction]
#[pyo3(signature = (bench, design, *, estimator, training, count, repeats, trials, calibrations, verify, seed, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn place_training<'py>(
    py: Python<'py>,
    bench: &Bound<'py, PyAny>,
    design: Option<&str>,
    estimator: Option<&Estimator>,
    training: Option<&Training>,
    count: Option<usize>,
    repeats: Option<usize>,
    trials: usize,
    calibrations: usize,
    verify: usize,
    seed: u64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let subject = Subject::of(bench, "bench")?;
    let setup = subject.setup();
    let rig = match &subject {
        Subject::Rig(rig) => Some(*rig),
        _ => None,
    };
    let existing = training.map(|training| &training.0).or(rig.and_then(|rig| rig.training.as_ref()));
    let mut asked = existing.map_or_else(PositionDesign::default, PositionDesign::for_training);
    let sensors = match design {
        Some(text) => sections::design(text, setup)?,
        None => rig.and_then(|rig| rig.design.clone()),
    };
    if let Some(sensors) = &sensors {
        asked = asked.contacts_of(sensors);
    }
    asked = PositionDesign {
        count: count.unwrap_or(asked.count),
        repeats: repeats.unwrap_or(asked.repeats),
        trials,
        calibrations,
        verifications: verify,
        seed,
        ..asked
    };
    if let Some(estimator) = estimator.map(|own| &own.inner).or(rig.map(|rig| &rig.estimator)) {
        asked.estimator = estimator.clone();
    }
    let problem = PositionProblem::new(setup, &asked).map_err(refused)?;
    let placed = work::run(py, progress, None, |watch| problem.all(watch))?;
    let fields = Fields::new(py);
    fields.set("estimator", asked.estimator.kind())?;
    fields.set("force_known", problem.force() == Force::Known)?;
    fields.set("repeats", asked.repeats)?;
    fields.set("tolerance", asked.tolerance_m)?;
    let contacts = Fields::new(py);
    contacts.positions(&problem.contacts().positions, problem.extent())?;
    contacts.column("weights", problem.contacts().weights.iter().copied().map(Some))?;
    fields.set("contacts", contacts.into_dict())?;
    let force_n = existing.and_then(|training| training.force_n);
    placed_fields(&fields, py, &placed, &problem, force_n)?;
    Ok(fields.into_dict())
}

fn placed_fields<'py>(
    fields: &Fields<'py>,
    py: Python<'py>,
    placed: &[VerifiedPositions],
    problem: &PositionProblem,
    force_n: Option<f64>,
) -> PyResult<()> {
    let names = placed.iter().map(|one| one.placement.name());
    fields.set("methods", names.collect::<Vec<_>>())?;
    let each = placed.iter().map(|one| positions_array(py, &one.positions, problem.extent()));
    fields.set("positions", PyList::new(py, each.collect::<PyResult<Vec<_>>>()?)?)?;
    let repeats = problem.design().repeats;
    let trainings = placed.iter().map(|one| {
        let rule = Arrangement::Explicit(one.positions.clone());
        let training = arrangement::Training::new(rule, one.positions.len()).repeated(repeats);
        Py::new(py, Training(arrangement::Training { force_n, ..training }))
    });
    fields.set("trainings", PyList::new(py, trainings.collect::<PyResult<Vec<_>>>()?)?)?;
    let column = |name: &str, figure: fn(&Verification) -> f64| {
        fields.column(name, placed.iter().map(|one| Some(figure(&one.verification))))
    };
    column("mean_error", |told| told.mean_error_m)?;
    column("standard_error", |told| told.standard_error_m)?;
    column("median_error", |told| told.median_error_m)?;
    column("within_tolerance", |told| told.within_tolerance_percent / 100.0)?;
    let errors = placed.iter().map(|one| Fields::of_numbers(py, &one.errors_m));
    fields.set("errors_by_contact", PyList::new(py, errors)?)?;
    fields.set("calibrations", placed.first().map_or(0, |one| one.verification.calibrations))?;
    fields.set("best_method", best_placed(placed).map(|best| best.placement.name()))
}

/// Fields of `palpate.NextPress`.
#[pyfunction]
#[pyo3(signature = (recording, design, *, stop_below, progress))]
pub fn next_press<'py>(
    py: Python<'py>,
    recording: &Recording,
    design: Option<&str>,
    stop_below: Bound<'py, PyAny>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let setup: &Arc<setup::Setup> = &recording.setup;
    let mut asked = PositionDesign {
        stop_percent: 100.0 * share(&stop_below, "stop_below")?,
        ..PositionDesign::default()
    };
    if let Some(sensors) = design.map(|text| sections::design(text, setup)).transpose()?.flatten() {
        asked = asked.contacts_of(&sensors);
    }
    let advice = work::run(py, progress, None, |watch| advise(setup, &recording.inner, &asked, watch))?;
    let fields = Fields::new(py);
    let next: Vec<Position> = advice.next.iter().map(|press| press.position).collect();
    fields.positions(&next, setup.surface().extent())?;
    fields.column("expected_error", advice.next.iter().map(|press| Some(press.error_m)))?;
    fields.set("presses", advice.presses)?;
    fields.set("positions", advice.positions)?;
    fields.set("error", advice.error_m)?;
    fields.set("endless_error", advice.endless_error_m)?;
    fields.set("to_gain", advice.remaining_gain_percent() / 100.0)?;
    fields.set("stop_below", advice.stop_percent / 100.0)?;
    fields.set("enough", advice.is_enough())?;
    fields.set("presses_to_go", advice.reaches_goal().then_some(advice.next.len()))?;
    Ok(fields.into_dict())
}
