//! A surface without a model whose presses have forces: every reading is an offset plus the force times an influence function of
//! the position, as elastic surfaces are.
//!
//! Learnt from the presses ([`learning`]) and inverted over a grid of places ([`locator`]).

mod learning;
mod locator;

pub use locator::ForceLinearLocator;

use super::config::Structure;
use super::grid::Axis;
use super::measured::MeasuredError;
use crate::fit::FitTask;
use crate::status::FalseAlarmRate;
use learning::{Learnt, Presses};
use locator::Stored;
use palpate_mechanics::surface::Extent;

/// Distinct positions without which a reading cannot be a function of anything.
const LEAST_POSITIONS: usize = 2;
/// Most nodes along a line, and along either axis of a plane.
const MOST_ALONG: usize = 400;
const MOST_OF_PLANE: usize = 60;
/// Forces up to this many times the greatest of the calibration are looked for.
const HARDEST: f64 = 3.0;

/// Learns the influence functions and offsets of a surface without a model; `None` where the presses do not tell them apart, as
/// they have no forces or all the same one, and unless the structure is force-linear by demand, where they speak against it.
pub(super) fn fit(task: FitTask, structure: Structure) -> Result<Option<ForceLinearLocator>, MeasuredError> {
    let FitTask { setup, recording, watch, .. } = task;
    let Some(presses) = Presses::average(setup, recording) else { return Ok(None) };
    if presses.distinct_forces() < 2 {
        return Ok(None);
    }
    recording.check_distinct_positions(LEAST_POSITIONS)?;
    let extent = setup.surface().extent();
    let learnt = Learnt::new(&presses, extent, watch)?;
    if learnt.live.is_empty() {
        return Ok(None);
    }
    if structure != Structure::ForceLinear && learnt.correlation.nonlinearity > 0.0 {
        return Ok(None);
    }
    let axes = axes(&presses, &learnt, extent);
    let [x, y] = axes;
    let places_m: Vec<Vec<f64>> = (0..x.count * y.count)
        .map(|place| {
            let coordinates = [x.value((place / y.count) as f64), y.value((place % y.count) as f64)];
            coordinates[..extent.dimensions()].to_vec()
        })
        .collect();
    let functions = learnt.functions(&places_m, watch)?;
    let mut locator = Stored {
        x,
        y,
        channels: recording.channels.len(),
        live: learnt.live.clone(),
        functions: functions.into(),
        known_force_n: setup.force_n(),
        hardest_n: HARDEST * presses.greatest_force_n(),
        residual_limit: f64::INFINITY,
        kernel: learnt.correlation.kernel,
        lengths_m: learnt.correlation.lengths_m.clone(),
        nonlinearity: learnt.correlation.nonlinearity,
        presses: learnt.presses(),
        noise_freedom: presses.noise_freedom(),
        false_alarm_rate: FalseAlarmRate::DEFAULT,
    }
    .into_locator();
    locator.limit_residuals(recording);
    Ok(Some(locator))
}

/// The grid: the span of the positions that were pressed and half their largest gap beyond.
fn axes(presses: &Presses, learnt: &Learnt, extent: Extent) -> [Axis; 2] {
    let positions_m = presses.positions_m();
    let axis = |k: usize, size_m: f64, most: usize| {
        let values = positions_m.iter().map(|position_m| position_m[k]).collect();
        Axis::over(values, (0.0, size_m), learnt.correlation.lengths_m[k], most)
    };
    match extent.width_m() {
        None => [axis(0, extent.length_m(), MOST_ALONG), Axis::NONE],
        Some(width_m) => [axis(0, extent.length_m(), MOST_OF_PLANE), axis(1, width_m, MOST_OF_PLANE)],
    }
}

#[cfg(test)]
mod tests;
