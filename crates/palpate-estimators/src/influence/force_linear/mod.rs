//! Force-linear method: reading = offset + force · influence function of the position, learnt ([`learning`])
//! and inverted ([`locator`]) without a model.

mod averaging;
mod beyond_presses;
mod broad_scan;
mod component;
mod component_search;
mod condensed;
mod drift;
mod drift_fit;
mod evidence;
mod force_prior;
mod influence_function;
mod learning;
mod likelihood;
mod locator;
mod missing_channel;
mod noise_prior;
mod outliers;
mod place_noise;
mod place_noise_search;
mod posterior;
mod prior;
mod reading_likelihood;
mod residuals;
mod saturation;
mod saturation_fit;
mod scan;
mod shared_errors;
mod source_grid;
mod systematic_sample;

pub use drift::DriftCourse;
pub(crate) use learning::{FOLDS, MOST_PRESSES, MOST_SEARCHED};
pub use likelihood::ForceLinearLikelihood;
pub use locator::{ForceLinearLocator, Scatter};
pub use prior::Source;

use super::calibration::{Averaging, CalibrationRows, shares};
use super::config::Structure;
use super::grid::Axis;
use super::measured::MeasuredError;
use crate::fit::FitTask;
use crate::offset_course::OffsetCourse;
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::FalseAlarmRate;
use force_prior::PressForces;
use learning::InfluenceModel;
use locator::{ForceLinearContents, Tables};
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use saturation_fit::Linearization;

const LEAST_POSITIONS: usize = 2;
const MOST_ALONG: usize = 400;
const MOST_OF_PLANE: usize = 60;

pub(crate) const fn most_nodes(extent: Extent) -> usize {
    match extent {
        Extent::Line { .. } => MOST_ALONG,
        Extent::Plane { .. } => MOST_OF_PLANE * MOST_OF_PLANE,
    }
}

/// Fits influence functions and offsets; `None` where forces do not separate them, or [`Structure::Auto`]
/// rejects the structure.
pub(super) fn fit(task: FitTask, structure: Structure) -> Result<Option<ForceLinearLocator>, MeasuredError> {
    if structure == Structure::ForceSaturating {
        return fit_saturating(task);
    }
    fit_condensed(task, structure, MOST_PRESSES)
}

fn fit_saturating(task: FitTask) -> Result<Option<ForceLinearLocator>, MeasuredError> {
    let Some(linearization) = Linearization::new(task)? else { return Ok(None) };
    let task = FitTask { recording: &linearization.recording, ..task };
    let locator = fit(task, Structure::ForceLinear)?;
    Ok(locator.map(|locator| locator.with_saturation(&linearization.saturation, linearization.channels())))
}

/// Returns whether a zero saturation has the largest log evidence.
pub(crate) fn is_unsaturated(task: FitTask) -> Result<bool, MeasuredError> {
    Ok(Linearization::new(task)?.is_none_or(|linearization| linearization.saturation.share == 0.0))
}

/// Returns whether all rows have forces and two of these differ.
pub(super) fn has_forces(setup: &Setup, recording: &Recording) -> bool {
    let presses = CalibrationRows::of_recording(setup, recording, Averaging::Consecutive, &[]);
    presses.is_some_and(|presses| presses.distinct_forces() >= 2)
}

fn fit_condensed(
    task: FitTask,
    structure: Structure,
    most: usize,
) -> Result<Option<ForceLinearLocator>, MeasuredError> {
    let FitTask { setup, recording, watch, .. } = task;
    recording.check_distinct_positions(LEAST_POSITIONS)?;
    let extent = setup.surface().extent();
    let Some(learnt) = InfluenceModel::of_task(task, structure, most)? else { return Ok(None) };
    let (presses, prior) = (&learnt.pressed, &learnt.prior);
    if structure == Structure::Auto && !prior.is_separable() {
        return Ok(None);
    }
    let axes = axes(&learnt, extent);
    let [x, y] = axes;
    let places_m: Vec<Vec<f64>> = (0..x.count * y.count)
        .map(|place| {
            let coordinates = [x.value((place / y.count) as f64), y.value((place % y.count) as f64)];
            coordinates[..extent.dimensions()].to_vec()
        })
        .collect();
    let functions = learnt.functions(&places_m, watch)?;
    let force = PressForces::new(presses, prior, setup.force_range());
    let positions_m = presses.positions_m();
    let outermost_m = |k: usize| {
        let coordinates = || positions_m.iter().map(|position_m| position_m[k]);
        (coordinates().fold(f64::INFINITY, f64::min), coordinates().fold(f64::NEG_INFINITY, f64::max))
    };
    let functions = Tables::new(&functions);
    let mut locator = ForceLinearContents {
        x,
        y,
        outermost_m: (0..extent.dimensions()).map(outermost_m).collect(),
        channels: recording.channels.len(),
        live: learnt.live.clone(),
        shared_errors: if functions.are_undetermined(force.mean_n) {
            learnt.shared_errors()?
        } else {
            Vec::new()
        },
        functions,
        known_force_n: setup.force_n(),
        mean_force_n: force.mean_n,
        force_sd_n: force.sd_n,
        hardest_n: force.hardest_n,
        force_range: force.range,
        residual_limit: f64::INFINITY,
        spread_limit: None,
        prior: prior.clone(),
        set_aside: learnt.set_aside.clone(),
        structure,
        presses: presses.len(),
        noise_freedom: presses.noise_freedom(),
        false_alarm_rate: FalseAlarmRate::DEFAULT,
        channels_as_one: 1.0,
        drifts: learnt.drifts()?,
        saturation: None,
    }
    .into_locator();
    locator.limit_residuals(recording);
    Ok(Some(locator))
}

/// Offsets at the rows of `asked`; `None` without times, drift or separable influence functions.
pub(super) fn offset_course(
    task: FitTask,
    structure: Structure,
    asked: &Recording,
) -> Result<Option<OffsetCourse>, MeasuredError> {
    let recording = task.recording;
    let Some((own_s, asked_s)) = recording.times_s().zip(asked.times_s()) else { return Ok(None) };
    let Some(learnt) = InfluenceModel::of_task(task, structure, MOST_PRESSES)? else { return Ok(None) };
    // Without separability, the order of positions or of a nuisance coordinate would pass for drift.
    if !learnt.prior.is_separable() {
        return Ok(None);
    }
    let Some(at_rows) = learnt.offsets_at(&shares(&asked_s, &own_s))? else { return Ok(None) };
    let Some(own) = learnt.offsets_at(&shares(&own_s, &own_s))? else { return Ok(None) };
    let channels = recording.channels.len();
    let mut course = OffsetCourse { at_rows: vec![None; channels], means: vec![None; channels] };
    for ((c, at_rows), own) in learnt.live.iter().zip(at_rows).zip(own) {
        course.at_rows[*c] = Some(at_rows);
        course.means[*c] = Some(mean(own));
    }
    Ok(Some(course))
}

fn axes(learnt: &InfluenceModel, extent: Extent) -> [Axis; 2] {
    let positions_m = learnt.pressed.positions_m();
    let axis = |k: usize, most: usize| {
        let values = positions_m.iter().map(|position_m| position_m[k]).collect();
        Axis::of_positions(values, (extent, k), learnt.finest_m(k), most)
    };
    match extent {
        Extent::Line { .. } => [axis(0, MOST_ALONG), Axis::NONE],
        Extent::Plane { .. } => [0, 1].map(|k| axis(k, MOST_OF_PLANE)),
    }
}

#[cfg(test)]
mod tests;
