//! Readings as a Gaussian process of the contact's position, in units of their noise.

use super::design::PositionError;
use ndarray::Array2;

use palpate_estimators::arrangement::cells;
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::regression::{GaussianProcess, Kernel, Regression, Samples};
use palpate_numerics::watch::Watch;

/// Positions at which a model is asked, along a line and along each side of a plane.
const ASKED: usize = 60;
const ASKED_ON_A_PLANE: usize = 14;
/// Noise of a sensor whose channel has none, as a share of its full scale: what is then left is the error of
/// interpolating.
const NOMINAL_NOISE: f64 = 1e-4;
/// Distinct positions without which nobody knows how smooth a function is.
const FEWEST_POSITIONS: usize = 4;

/// Whitened readings as functions of position.
pub(super) struct ForwardModel {
    process: GaussianProcess,
    /// The variance of the functions before any press, the sensors' mean.
    signal_variance: f64,
    extent: Extent,
    force: Force,
}

impl ForwardModel {
    /// Model of a bench from the clean readings that its mechanics give.
    pub fn from_mechanics(setup: &Setup, force: Force, watch: Watch) -> Result<Self, PositionError> {
        let surface = setup.surface().model().ok_or(PositionError::NoModel)?;
        let force_n = setup.force_n().ok_or(PositionError::NoForce)?;
        let extent = surface.extent();
        let side = match extent {
            Extent::Line { .. } => ASKED,
            Extent::Plane { .. } => ASKED_ON_A_PLANE,
        };
        let positions = cells(extent, side, side);
        let sensors = CleanSensors::new_watched(surface, setup.layout(), watch)?;
        let clean: Vec<Vec<f64>> =
            positions.iter().map(|&position| sensors.reading(Contact { position, force_n })).collect();
        let full_scale = |s: usize| clean.iter().map(|reading| reading[s].abs()).fold(0.0, f64::max);
        let sd = |s: usize| match setup.layout().sensors()[s].channel.reading_sd() {
            sd if sd > 0.0 => sd,
            _ => (NOMINAL_NOISE * full_scale(s)).max(f64::MIN_POSITIVE),
        };
        let sds: Vec<(usize, f64)> = living(setup.layout()).map(|s| (s, sd(s))).collect();
        // The model is exact: regressions take as much noise as rounding leaves.
        Self::fit(&positions, &clean, &sds, 0.0, extent, force, watch)
    }

    /// Model of a bench from a recording begun, whose noise its repeats tell, or else the layout.
    pub fn from_recording(
        recording: &Recording,
        layout: &Layout,
        extent: Extent,
        force: Force,
        watch: Watch,
    ) -> Result<Self, PositionError> {
        if recording.channels.len() != layout.len() {
            return Err(PositionError::Channels { needed: layout.len(), found: recording.channels.len() });
        }
        let found = recording.distinct_positions().len();
        if found < FEWEST_POSITIONS {
            return Err(PositionError::TooFewPresses { found, needed: FEWEST_POSITIONS });
        }
        let scaled = at_one_force(recording);
        let sds = living(layout).map(|s| {
            let stated = layout.sensors()[s].channel.reading_sd();
            let sd = scatter(recording, &scaled, s).unwrap_or(stated);
            if sd > 0.0 { Ok((s, sd)) } else { Err(PositionError::NoNoise { channel: s + 1 }) }
        });
        let sds = sds.collect::<Result<Vec<_>, _>>()?;
        let positions: Vec<Position> = recording.rows.iter().map(|row| row.position).collect();
        Self::fit(&positions, &scaled, &sds, 1.0, extent, force, watch)
    }

    /// Fits to readings at some positions: those of the sensors in `sds`, divided by their standard deviations, then have the
    /// `noise_variance`.
    fn fit(
        positions: &[Position],
        readings: &[Vec<f64>],
        sds: &[(usize, f64)],
        noise_variance: f64,
        extent: Extent,
        force: Force,
        watch: Watch,
    ) -> Result<Self, PositionError> {
        let rows = positions.len();
        let coordinates = Array2::from_shape_fn((rows, extent.dimensions()), |(row, k)| {
            [positions[row].x_m, positions[row].y_m][k]
        });
        let whitened =
            Array2::from_shape_fn((rows, sds.len()), |(row, j)| readings[row][sds[j].0] / sds[j].1);
        let samples = Samples {
            coordinates: coordinates.view(),
            outputs: whitened.view(),
            noise_variance: Some(&vec![noise_variance; rows]),
        };
        let process = Regression::default().fit(samples, watch)?;
        let outputs = process.outputs();
        let signal_variance = mean((0..outputs).map(|j| process.signal_variance(j)));
        Ok(Self { process, signal_variance, extent, force })
    }

    /// The covariance of a whitened reading's function at two positions before any press.
    pub fn covariance(&self, a: Position, b: Position) -> f64 {
        let scales = &self.process.hyperparameters().length_scales;
        let r2: f64 =
            [a.x_m - b.x_m, a.y_m - b.y_m].iter().zip(scales).map(|(d, scale)| (d / scale).powi(2)).sum();
        self.signal_variance * Kernel::Matern52.correlation(r2)
    }

    /// The standard deviation, in metres, with which a reading tells a position once everything is calibrated: the limit by
    /// the expected readings' slopes, combined with what the surface's size tells.
    pub fn limit_m(&self, at: Position) -> f64 {
        let (outputs, d) = (self.process.outputs(), self.process.coordinates());
        let (mut means, mut slopes) = (vec![0.0; outputs], vec![0.0; outputs * d]);
        let point = [at.x_m, at.y_m];
        self.process.mean_and_gradient_into(
            &point[..d],
            &mut means,
            &mut slopes,
            &mut self.process.scratch(),
        );
        let dot = |f: &dyn Fn(usize) -> (f64, f64)| (0..outputs).map(f).map(|(a, b)| a * b).sum::<f64>();
        // By ln W a reading that is linear in the force changes as much as it is.
        let by_force = dot(&|j| (means[j], means[j])).max(f64::MIN_POSITIVE);
        let information = |k: usize, l: usize| {
            let plain = dot(&|j| (slopes[j * d + k], slopes[j * d + l]));
            match self.force {
                Force::Known => plain,
                Force::Unknown => {
                    let [a, b] = [k, l].map(|k| dot(&|j| (slopes[j * d + k], means[j])));
                    plain - a * b / by_force
                }
            }
        };
        let prior = |side_m: f64| 12.0 / (side_m * side_m);
        let xx = information(0, 0) + prior(self.extent.length_m());
        let Some(width_m) = self.extent.width_m() else { return 1.0 / xx.sqrt() };
        let (yy, xy) = (information(1, 1) + prior(width_m), information(0, 1));
        ((xx + yy) / (xx * yy - xy * xy)).sqrt()
    }
}

/// Indices of the sensors that are alive.
fn living(layout: &Layout) -> impl Iterator<Item = usize> {
    (0..layout.len()).filter(|s| !layout.sensors()[*s].channel.dead)
}

/// Readings brought to the mean force, where forces are known.
fn at_one_force(recording: &Recording) -> Vec<Vec<f64>> {
    let forces: Option<Vec<f64>> =
        recording.rows.iter().map(|row| row.force_n.filter(|force_n| *force_n > 0.0)).collect();
    let mean = forces.as_ref().map(|forces| mean(forces.iter().copied()));
    let scaled = |(i, row): (usize, &palpate_estimators::recording::Row)| {
        let factor = forces.as_ref().zip(mean).map_or(1.0, |(forces, mean)| mean / forces[i]);
        row.reading.iter().map(|value| factor * value).collect()
    };
    recording.rows.iter().enumerate().map(scaled).collect()
}

/// Standard deviation of a channel about its means at each position; `None` where no position was pressed twice.
fn scatter(recording: &Recording, readings: &[Vec<f64>], channel: usize) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0usize);
    for position in recording.distinct_positions() {
        let repeats: Vec<f64> = recording
            .rows
            .iter()
            .zip(readings)
            .filter(|(row, _)| row.position == position)
            .map(|(_, reading)| reading[channel])
            .collect();
        let mean = mean(repeats.iter().copied());
        squares += repeats.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        freedom += repeats.len() - 1;
    }
    (freedom > 0).then(|| (squares / freedom as f64).sqrt()).filter(|sd| *sd > 0.0)
}
