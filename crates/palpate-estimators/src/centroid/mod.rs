//! Calibrated centroid of array sensors.

use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};

use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::held_out::HeldOutErrors;
use crate::recording::{Recording, Row, TooFewPositions};
use crate::setup::Setup;
use crate::status::{NO_CONTACT, on_surface};
use palpate_core::{ContactEstimate, Estimate};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Sensor, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{Cholesky, NotPositiveDefinite};

/// Calibrated centroid with weights w_i = |r_i| / Σ|r_j|, in units of the largest reading of each kind.
///
/// The estimate is A·(Σ w_i·p_i) + b at known sensor positions p_i, with A and b by least squares. For raw
/// channels least squares gives the p_i of Σ w_i·p_i.
///
/// ```
/// use palpate_estimators::{arrangement::Training, fit::Fit, setup::Setup, centroid::Centroid};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(20), 0)?;
/// let estimate = Centroid.fit(&setup, &presses)?.locate(&presses.rows[9].reading)?;
/// assert!((estimate.contact.position.x_m - mm(190.0)).abs() < mm(20.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Centroid;

/// Recording that does not calibrate a centroid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CentroidFitError {
    /// Fewer than two enabled sensors.
    #[error("a centroid needs at least 2 sensors that are not dead; the layout has {found}")]
    TooFewSensors {
        /// Enabled sensors.
        found: usize,
    },
    /// Fewer positions than unknowns.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Readings of one kind that are all 0.
    #[error("every {kind} reading of the recording is 0; a centroid weights sensors by their readings")]
    Silent {
        /// Kind of the sensors.
        kind: SensorKind,
    },
    /// Centroids that do not distinguish positions.
    #[error("the centroids of the recording do not distinguish its positions: {0}")]
    Alike(#[from] NotPositiveDefinite),
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for Centroid {
    type Method = CentroidLocator;
    type Error = CentroidFitError;

    fn fit_method(
        &self,
        FitTask { setup, recording, watch, .. }: FitTask,
    ) -> Result<CentroidLocator, CentroidFitError> {
        let mut locator = fit_from_positions(setup, recording)?;
        recording.check_distinct_positions(locator.terms())?;
        locator.map = calibrate(&locator, &recording.rows)?;
        locator.held_out_errors = HeldOutErrors::from_errors(&held_out_errors(&locator, recording, watch)?);
        Ok(locator)
    }
}

fn fit_from_positions(setup: &Setup, recording: &Recording) -> Result<CentroidLocator, CentroidFitError> {
    let sensors = setup.layout().sensors();
    let live = sensors.iter().filter(|sensor| !sensor.channel.disabled).count();
    if live < 2 {
        return Err(CentroidFitError::TooFewSensors { found: live });
    }
    let channel_scale = |sensor: &Sensor| {
        if sensor.channel.disabled {
            return Ok(0.0);
        }
        let of_kind =
            (0..sensors.len()).filter(|i| sensors[*i].kind == sensor.kind && !sensors[*i].channel.disabled);
        let readings = of_kind.flat_map(|i| recording.rows.iter().map(move |row| row.reading[i].abs()));
        let scale = 1.0 / readings.fold(0.0, f64::max);
        if scale.is_finite() { Ok(scale) } else { Err(CentroidFitError::Silent { kind: sensor.kind }) }
    };
    let channel_scales = sensors.iter().map(channel_scale).collect::<Result<_, _>>()?;
    let raw = sensors.iter().any(|sensor| sensor.kind == SensorKind::Raw);
    let weighing = if raw {
        Weighting::Channels
    } else {
        Weighting::Positions(sensors.iter().map(|sensor| sensor.position).collect())
    };
    Ok(CentroidLocator {
        extent: setup.surface().extent(),
        channel_scales,
        weighing,
        map: Vec::new(),
        force_n: setup.force_n(),
        held_out_errors: None,
    })
}

/// Ridge of 10⁻¹² of the largest diagonal entry, which keeps unexcited terms at 0.
fn calibrate(locator: &CentroidLocator, rows: &[Row]) -> Result<Vec<Vec<f64>>, NotPositiveDefinite> {
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
    Ok(right[..locator.extent.dimensions()].iter().map(|right| cholesky.solve(right).to_vec()).collect())
}

/// Empty where a fold has fewer positions than terms.
fn held_out_errors(
    locator: &CentroidLocator,
    recording: &Recording,
    watch: Watch,
) -> Result<Vec<[f64; 2]>, Cancelled> {
    let positions = recording.distinct_positions().len();
    let folds = recording.folds(positions.min(FOLDS)).unwrap_or_default();
    let mut errors = Vec::with_capacity(recording.rows.len());
    for fold in folds {
        watch.round()?;
        let training = recording.subset(&fold.training);
        if training.check_distinct_positions(locator.terms()).is_err() {
            return Ok(Vec::new());
        }
        let Ok(map) = calibrate(locator, &training.rows) else { return Ok(Vec::new()) };
        let judged = CentroidLocator { map, ..locator.clone() };
        for row in fold.held_out.iter().map(|i| &recording.rows[*i]) {
            let Some(position) = judged.position(&row.reading) else { continue };
            errors.push([position.x_m - row.position.x_m, position.y_m - row.position.y_m]);
        }
    }
    Ok(errors)
}

const FOLDS: usize = 20;

/// Fitted [`Centroid`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CentroidLocator {
    /// Extent of the surface.
    pub extent: Extent,
    /// Inverse of the kind's largest training reading; 0 for a disabled channel.
    pub channel_scales: Vec<f64>,
    /// Points of the centroid.
    pub weighing: Weighting,
    /// Row per coordinate: factors and a constant ([`Weighting::Positions`]), or a position per channel
    /// ([`Weighting::Channels`]), in metres.
    pub map: Vec<Vec<f64>>,
    /// Known force.
    pub force_n: Option<f64>,
    /// Cross-validated errors.
    #[serde(rename = "spread")]
    pub held_out_errors: Option<HeldOutErrors>,
}

/// Points of the centroid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weighting {
    /// Known sensor positions.
    Positions(Vec<Position>),
    /// Calibrated positions of raw channels.
    Channels,
}

impl CentroidLocator {
    fn terms(&self) -> usize {
        match self.weighing {
            Weighting::Positions(_) => 1 + self.extent.dimensions(),
            Weighting::Channels => self.channel_scales.len(),
        }
    }

    fn term_values(&self, reading: &[f64]) -> Option<Vec<f64>> {
        let mut weights: Vec<f64> =
            reading.iter().zip(&self.channel_scales).map(|(r, s)| (r * s).abs()).collect();
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        weights.iter_mut().for_each(|weight| *weight /= total);
        let Weighting::Positions(positions) = &self.weighing else { return Some(weights) };
        let mean = |coordinate: fn(&Position) -> f64| {
            weights.iter().zip(positions).map(|(w, p)| w * coordinate(p)).sum::<f64>()
        };
        let along = mean(|p| p.x_m);
        Some(match self.extent.width_m() {
            None => vec![along, 1.0],
            Some(_) => vec![along, mean(|p| p.y_m), 1.0],
        })
    }

    fn position(&self, reading: &[f64]) -> Option<Position> {
        let terms = self.term_values(reading)?;
        let mapped = |row: &Vec<f64>| row.iter().zip(&terms).map(|(m, t)| m * t).sum::<f64>();
        let mut coordinates = self.map.iter().map(mapped);
        Some(Position { x_m: coordinates.next()?, y_m: coordinates.next().unwrap_or(0.0) })
    }
}

impl Locate for CentroidLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        let Some(position) = self.position(reading) else {
            return NO_CONTACT;
        };
        let uncertainty = self.held_out_errors.map(|spread| spread.uncertainty(position));
        on_surface(ContactEstimate { position, force_n: self.force_n, uncertainty }, self.extent)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        let channels = setup.layout().len();
        LocatorFault::check_count("channel scales", channels, self.channel_scales.len())?;
        let scales = &self.channel_scales;
        LocatorFault::check_numbers("channel scale", scales, |scale| scale >= 0.0, "a number of at least 0")?;
        if let Weighting::Positions(positions) = &self.weighing {
            LocatorFault::check_count("sensor positions", channels, positions.len())?;
            let coordinates = positions.iter().flat_map(|p| [p.x_m, p.y_m]);
            LocatorFault::check_numbers("sensor position", coordinates, |_| true, "a finite number")?;
        }
        LocatorFault::check_count("rows of the map", self.extent.dimensions(), self.map.len())?;
        for row in &self.map {
            LocatorFault::check_count("numbers in a row of the map", self.terms(), row.len())?;
            LocatorFault::check_numbers("map", row, |_| true, "a finite number")?;
        }
        self.held_out_errors.map_or(Ok(()), |spread| spread.check())
    }
}

#[cfg(test)]
mod tests;
