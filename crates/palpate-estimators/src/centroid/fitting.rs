//! Calibrating a centroid by least squares.

use ndarray::{Array1, Array2};
use palpate_numerics::watch::{Cancelled, Watch};

use super::{CentroidLocator, Weighing};
use crate::fit::{ChannelMismatch, Fit, FitTask};
use crate::held_out::HeldOutSpread;
use crate::recording::{Recording, Row, TooFewPositions};
use crate::setup::Setup;
use palpate_mechanics::sensing::SensorKind;
use palpate_numerics::{Cholesky, NotPositiveDefinite};

/// The calibrated centroid. Channel i weighs w_i = |r_i| / Σ|r_j|, its reading taken in units of the largest that its
/// kind has in the training recording.
///
/// With sensors at known positions p_i the estimate is A·(Σ w_i·p_i) + b, with A and b from least squares over the
/// training recording. Raw channels have no positions, so least squares gives each one a position of its own:
/// the estimate is Σ w_i·p_i.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Centroid;

/// Why a centroid cannot be calibrated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CentroidFitError {
    /// One sensor has the same centroid wherever the contact is.
    #[error("a centroid needs at least 2 sensors that are not dead; the layout has {found}")]
    TooFewSensors {
        /// Live sensors of the layout.
        found: usize,
    },
    /// Fewer positions than unknowns of the map.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Nothing is ever read by the sensors of one kind.
    #[error("every {kind} reading of the recording is 0; a centroid weighs sensors by what they read")]
    Silent {
        /// The kind.
        kind: SensorKind,
    },
    /// Every sensor sits at the same place, or all readings are alike.
    #[error("the centroids of the recording do not tell its positions apart: {0}")]
    Alike(#[from] NotPositiveDefinite),
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for Centroid {
    type Method = CentroidLocator;
    type Error = CentroidFitError;

    fn fit_method(&self, task: FitTask) -> Result<CentroidLocator, CentroidFitError> {
        let mut locator = uncalibrated(task.setup, task.recording)?;
        let terms = locator.weighing.terms(locator.channel_scales.len(), locator.extent.width_m.is_some());
        task.recording.check_distinct_positions(terms)?;
        let rows: Vec<&Row> = task.recording.rows.iter().collect();
        locator.map = calibrate(&locator, &rows)?;
        let errors = held_out_errors(&locator, task.recording, terms, task.watch)?;
        locator.spread = HeldOutSpread::of(&errors);
        Ok(locator)
    }
}

/// A locator that can weigh, but whose map is still empty.
fn uncalibrated(setup: &Setup, recording: &Recording) -> Result<CentroidLocator, CentroidFitError> {
    let sensors = &setup.layout.sensors;
    let live = sensors.iter().filter(|sensor| !sensor.channel.dead).count();
    if live < 2 {
        return Err(CentroidFitError::TooFewSensors { found: live });
    }
    let mut channel_scales = Vec::with_capacity(sensors.len());
    for sensor in sensors {
        if sensor.channel.dead {
            channel_scales.push(0.0);
            continue;
        }
        let of_kind =
            (0..sensors.len()).filter(|i| sensors[*i].kind == sensor.kind && !sensors[*i].channel.dead);
        let readings = of_kind.flat_map(|i| recording.rows.iter().map(move |row| row.reading[i].abs()));
        let largest = readings.fold(0.0, f64::max);
        if !(largest > 0.0 && (1.0 / largest).is_finite()) {
            return Err(CentroidFitError::Silent { kind: sensor.kind });
        }
        channel_scales.push(1.0 / largest);
    }
    let raw = sensors.iter().any(|sensor| sensor.kind == SensorKind::Raw);
    let weighing = if raw {
        Weighing::Channels
    } else {
        Weighing::Positions(sensors.iter().map(|sensor| sensor.position).collect())
    };
    Ok(CentroidLocator {
        extent: setup.surface.extent(),
        channel_scales,
        weighing,
        map: Vec::new(),
        force_n: setup.force_n,
        spread: None,
    })
}

/// Least squares of the positions (x, and y where there is one) on the terms, row by row of the map.
///
/// A ridge of 10⁻¹² of the largest diagonal entry keeps terms that a recording does not excite, such as a dead channel's, at 0.
fn calibrate(locator: &CentroidLocator, rows: &[&Row]) -> Result<Vec<Vec<f64>>, NotPositiveDefinite> {
    let terms = locator.terms();
    let mut normal = Array2::zeros((terms, terms));
    let mut right = [Array1::zeros(terms), Array1::zeros(terms)];
    for row in rows {
        let Some(term) = locator.term_values(&row.reading) else { continue };
        for i in 0..terms {
            for j in 0..=i {
                normal[[i, j]] += term[i] * term[j];
            }
            right[0][i] += term[i] * row.position.x_m;
            right[1][i] += term[i] * row.position.y_m;
        }
    }
    let ridge = 1e-12 * normal.diag().iter().fold(0.0, |m: f64, d: &f64| m.max(*d));
    normal.diag_mut().iter_mut().for_each(|d| *d += ridge);
    let cholesky = Cholesky::factor(normal)?;
    let axes = if locator.extent.width_m.is_some() { 2 } else { 1 };
    Ok(right[..axes].iter().map(|right| cholesky.solve(right).to_vec()).collect())
}

/// Errors (x, y) in metres at positions that the map was not calibrated on, of at most [`FOLDS`] maps; none where
/// a fold leaves fewer positions than `terms`.
fn held_out_errors(
    locator: &CentroidLocator,
    recording: &Recording,
    terms: usize,
    watch: Watch,
) -> Result<Vec<[f64; 2]>, Cancelled> {
    let positions = recording.distinct_positions().len();
    let folds = recording.folds(positions.min(FOLDS)).unwrap_or_default();
    let mut errors = Vec::with_capacity(recording.rows.len());
    for fold in folds {
        watch.round()?;
        let held_out: Vec<&Row> = fold.held_out.iter().map(|i| &recording.rows[*i]).collect();
        let training = recording.subset(&fold.training);
        if training.check_distinct_positions(terms).is_err() {
            return Ok(Vec::new());
        }
        let rows: Vec<&Row> = training.rows.iter().collect();
        let Ok(map) = calibrate(locator, &rows) else { return Ok(Vec::new()) };
        let judged = CentroidLocator { map, ..locator.clone() };
        for row in held_out {
            let Some(position) = judged.position(&row.reading) else { continue };
            errors.push([position.x_m - row.position.x_m, position.y_m - row.position.y_m]);
        }
    }
    Ok(errors)
}

/// Positions are held out one by one up to this many, and in groups beyond.
const FOLDS: usize = 20;
