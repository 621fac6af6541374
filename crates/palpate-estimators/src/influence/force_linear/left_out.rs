//! Leave-one-position-out calibration of intervals from few presses, which leave hyperparameters uncertain.
//!
//! With press x, estimate x̂ and h the half-width of the 95 % interval towards x, z = 1.96·(x − x̂)/h is
//! standard normal for calibrated intervals. The mean of z² divides the log-likelihood, as for overdispersion
//! (McCullagh and Nelder, *Generalized Linear Models*, 1989).

use super::{ForceLinearLocator, MOST_PRESSES, fit_condensed};
use crate::fit::FitTask;
use crate::influence::calibration::FEW;
use crate::influence::config::Structure;
use crate::influence::measured::MeasuredError;
use crate::recording::Row;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Cancelled;
use palpate_numerics::{NORMAL_95, mean};

/// Presses below [`FEW`] at full weight.
const FEWER: f64 = 10.0;
/// Fewer leave too little to learn from.
const LEAST: usize = 7;
/// One press may be an outlier.
const MOST_SQUARE: f64 = 25.0;

/// Weight of the correction: 1 for few presses, 0 for many.
pub(super) fn weight(presses: usize) -> f64 {
    ((FEW - presses as f64) / FEWER).clamp(0.0, 1.0)
}

/// Further divisor of the log-likelihood; `None` with many presses, few positions or no valid fit.
pub(super) fn factor(
    task: FitTask,
    structure: Structure,
    presses: usize,
) -> Result<Option<f64>, MeasuredError> {
    let FitTask { setup, recording, watch, .. } = task;
    let weight = weight(presses);
    let positions = recording.touched().distinct_positions();
    if weight == 0.0 || positions.len() < LEAST {
        return Ok(None);
    }
    let mut squares = Vec::new();
    for (done, position) in positions.iter().enumerate() {
        watch.counted("leaving positions out", "positions", done, positions.len())?;
        let is_left_out = |row: &Row| row.touches() && row.position == *position;
        let (left_out, others): (Vec<usize>, Vec<usize>) =
            (0..recording.rows.len()).partition(|i| is_left_out(&recording.rows[*i]));
        let rest = recording.subset(&others);
        let task = FitTask { recording: &rest, ..task };
        let locator = match fit_condensed(task, structure, MOST_PRESSES) {
            Ok(Some(locator)) => locator,
            Err(error) if Cancelled::caused(&error) => return Err(error),
            // A rest that cannot be learnt carries no information on the intervals.
            Ok(None) | Err(_) => continue,
        };
        let extent = setup.surface().extent();
        squares.extend(left_out.iter().filter_map(|i| square(&locator, &recording.rows[*i], extent)));
    }
    Ok((!squares.is_empty()).then(|| 1.0 + weight * (mean(squares) - 1.0).max(0.0)))
}

/// z² of a press, averaged over coordinates; `None` without an interval.
fn square(locator: &ForceLinearLocator, row: &Row, extent: Extent) -> Option<f64> {
    let contact = locator.posterior(&row.reading).contact;
    let told = contact.uncertainty?;
    let (at, true_at) = (contact.position, row.position);
    let square = |at_m: f64, true_m: f64, (low_m, high_m): (f64, f64)| {
        let half_m = if true_m < at_m { at_m - low_m } else { high_m - at_m };
        (half_m > 0.0).then(|| (NORMAL_95 * (true_m - at_m) / half_m).powi(2).min(MOST_SQUARE))
    };
    let x = square(at.x_m, true_at.x_m, told.x_95_m)?;
    match extent {
        Extent::Line { .. } => Some(x),
        Extent::Plane { .. } => Some(0.5 * (x + square(at.y_m, true_at.y_m, told.y_95_m)?)),
    }
}
