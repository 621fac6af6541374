//! Errors by their distance from the nearest sensor.

use serde::Serialize;

use palpate_estimators::evaluation::{Evaluation, Located};
use palpate_mechanics::sensing::Layout;

/// Parts into which half a gap between sensors is divided.
pub const FOLDS: usize = 10;

/// Errors of all contacts between the outermost sensors, folded over all gaps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoldedErrors {
    /// From over a sensor to half-way between two; parts that no contact fell into are left out.
    pub folds: Vec<Fold>,
    /// Mean error within a tenth of a pitch from a sensor, in metres.
    pub at_sensors_m: f64,
    /// Mean error within a tenth of a pitch from the middle of a gap, in metres.
    pub between_m: f64,
    /// Share of the contacts between the outermost sensors that are off by more than the tolerance, in %.
    pub dead_percent: f64,
}

/// Errors at one distance from the nearest sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fold {
    /// Middle of the part: distance from the nearest sensor over the pitch, 0 to 0.5.
    pub pitches: f64,
    /// Mean error, in metres.
    pub mean_error_m: f64,
    /// Contacts.
    pub contacts: usize,
}

impl FoldedErrors {
    /// Folds the errors of an evaluation over the gaps of a layout along a line.
    pub fn of(evaluation: &Evaluation, layout: &Layout, tolerance_m: f64) -> Self {
        let mut places: Vec<f64> = layout.sensors().iter().map(|sensor| sensor.position.x_m).collect();
        places.sort_by(f64::total_cmp);
        let folded: Vec<(f64, f64)> = evaluation
            .located
            .iter()
            .filter_map(|located| Some((pitches_off(&places, located)?, located.error_m())))
            .collect();
        let mean_within = |from: f64, to: f64| {
            let errors =
                folded.iter().filter(|(pitches, _)| (from..=to).contains(pitches)).map(|(_, error)| error);
            let (sum, count) = errors.fold((0.0, 0), |(sum, count), error| (sum + error, count + 1));
            (sum / f64::from(count), count as usize)
        };
        let width = 0.5 / FOLDS as f64;
        let fold = |i: usize| {
            let from = i as f64 * width;
            let (mean_error_m, contacts) = mean_within(from, from + width);
            (contacts > 0).then_some(Fold { pitches: from + 0.5 * width, mean_error_m, contacts })
        };
        let dead = folded.iter().filter(|(_, error_m)| *error_m > tolerance_m).count();
        Self {
            folds: (0..FOLDS).filter_map(fold).collect(),
            at_sensors_m: mean_within(0.0, 0.1).0,
            between_m: mean_within(0.4, 0.5).0,
            dead_percent: 100.0 * dead as f64 / folded.len() as f64,
        }
    }
}

/// Distance of a contact from the nearest sensor over the distance of the two sensors around it; `None` beyond the outermost.
fn pitches_off(places: &[f64], located: &Located) -> Option<f64> {
    let x_m = located.truth.x_m;
    let gap = places.windows(2).find(|gap| gap[0] <= x_m && x_m <= gap[1] && gap[0] < gap[1])?;
    Some((x_m - gap[0]).min(gap[1] - x_m) / (gap[1] - gap[0]))
}
