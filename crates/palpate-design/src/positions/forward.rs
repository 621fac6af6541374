//! Whitened readings as a Gaussian process of the contact position.

use super::design::PositionError;
use super::presses::{Presses, enabled_sensors};
use ndarray::Array2;
use palpate_estimators::arrangement::cells;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::regression::{GaussianProcess, Kernel, Regression, Samples};
use palpate_numerics::watch::Watch;

/// Positions where a model is evaluated, along a line and along each side of a plane.
const ASKED: usize = 60;
const ASKED_ON_A_PLANE: usize = 14;
/// Noise of a noise-free sensor, as a share of its full scale.
const NOMINAL_NOISE: f64 = 1e-4;
const KERNELS: [Kernel; 3] = [Kernel::Matern32, Kernel::Matern52, Kernel::SquaredExponential];

pub(super) struct ForwardModel {
    process: GaussianProcess,
    /// Correlation with the largest log evidence.
    kernel: Kernel,
    /// Prior variance, averaged over the sensors.
    signal_variance: f64,
    extent: Extent,
    force: Force,
}

impl ForwardModel {
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
        let living: Vec<usize> = enabled_sensors(setup.layout()).collect();
        let clean = |&position: &Position| {
            let reading = sensors.reading(Contact { position, force_n });
            living.iter().map(|&s| reading[s]).collect()
        };
        let clean: Vec<Vec<f64>> = positions.iter().map(clean).collect();
        let full_scale = |j: usize| clean.iter().map(|reading| reading[j].abs()).fold(0.0, f64::max);
        let sd = |(j, &s): (usize, &usize)| match setup.layout().sensors()[s].channel.reading_sd() {
            sd if sd > 0.0 => sd,
            _ => (NOMINAL_NOISE * full_scale(j)).max(f64::MIN_POSITIVE),
        };
        let sds: Vec<f64> = living.iter().enumerate().map(sd).collect();
        // The model is exact: the regression has only as much noise as rounding causes.
        Self::fit(&positions, &clean, &sds, &vec![0.0; positions.len()], extent, force, watch)
    }

    pub fn from_presses(presses: &Presses, setup: &Setup, watch: Watch) -> Result<Self, PositionError> {
        let Presses { positions, readings, reading_sds, .. } = presses;
        let variances: Vec<f64> = (0..positions.len()).map(|row| presses.variance_of(row)).collect();
        Self::fit(
            positions,
            readings,
            reading_sds,
            &variances,
            setup.surface().extent(),
            setup.force(),
            watch,
        )
    }

    /// Fits to `readings`, with the variances of the whitened readings.
    fn fit(
        positions: &[Position],
        readings: &[Vec<f64>],
        sds: &[f64],
        variances: &[f64],
        extent: Extent,
        force: Force,
        watch: Watch,
    ) -> Result<Self, PositionError> {
        let rows = positions.len();
        let coordinates = Array2::from_shape_fn((rows, extent.dimensions()), |(row, k)| {
            [positions[row].x_m, positions[row].y_m][k]
        });
        let whitened = Array2::from_shape_fn((rows, sds.len()), |(row, j)| readings[row][j] / sds[j]);
        let samples = Samples {
            coordinates: coordinates.view(),
            outputs: whitened.view(),
            noise_variance: Some(variances),
        };
        let mut fitted = Vec::new();
        for kernel in KERNELS {
            fitted.push((kernel, Regression { kernel, ..Regression::default() }.fit(samples, watch)?));
        }
        fitted.sort_by(|(_, a), (_, b)| a.log_evidence().total_cmp(&b.log_evidence()));
        let (kernel, process) = fitted.pop().expect("there are kernels");
        let outputs = process.outputs();
        let signal_variance = mean((0..outputs).map(|j| process.signal_variance(j)));
        Ok(Self { process, kernel, signal_variance, extent, force })
    }

    pub fn covariance(&self, a: Position, b: Position) -> f64 {
        let scales = &self.process.hyperparameters().length_scales;
        let r2: f64 =
            [a.x_m - b.x_m, a.y_m - b.y_m].iter().zip(scales).map(|(d, scale)| (d / scale).powi(2)).sum();
        self.signal_variance * self.kernel.correlation(r2)
    }

    /// Returns expected whitened readings and slopes, 1/m: by x, on a plane by x and y, channel by channel.
    fn mean_and_slopes(&self, at: Position) -> (Vec<f64>, Vec<f64>) {
        let (outputs, d) = (self.process.outputs(), self.process.coordinates());
        let (mut means, mut slopes) = (vec![0.0; outputs], vec![0.0; outputs * d]);
        let point = [at.x_m, at.y_m];
        self.process.mean_and_gradient_into(
            &point[..d],
            &mut means,
            &mut slopes,
            &mut self.process.scratch(),
        );
        (means, slopes)
    }

    /// Returns the variance of each whitened reading due to a placement error: |I′|²·σ², to first order.
    ///
    /// If the force is unknown, the slope along the reading is excluded: it changes only the force.
    pub fn placement_variances(&self, at: Position, sd_m: f64) -> Vec<f64> {
        let d = self.process.coordinates();
        let (means, mut slopes) = self.mean_and_slopes(at);
        let size = means.iter().map(|mean| mean * mean).sum::<f64>();
        if self.force == Force::Unknown && means.len() > 1 && size > 0.0 {
            for k in 0..d {
                let along =
                    means.iter().enumerate().map(|(j, mean)| slopes[j * d + k] * mean).sum::<f64>() / size;
                means.iter().enumerate().for_each(|(j, mean)| slopes[j * d + k] -= along * mean);
            }
        }
        slopes
            .chunks(d)
            .map(|slopes| sd_m * sd_m * slopes.iter().map(|slope| slope * slope).sum::<f64>())
            .collect()
    }

    pub fn information(&self, at: Position) -> Information {
        let (outputs, d) = (self.process.outputs(), self.process.coordinates());
        let (means, slopes) = self.mean_and_slopes(at);
        let dot = |f: &dyn Fn(usize) -> (f64, f64)| (0..outputs).map(f).map(|(a, b)| a * b).sum::<f64>();
        // The derivative by ln W of a reading that is linear in the force is the reading itself.
        let by_force = dot(&|j| (means[j], means[j])).max(f64::MIN_POSITIVE);
        let entry = |k: usize, l: usize| {
            let plain = dot(&|j| (slopes[j * d + k], slopes[j * d + l]));
            match self.force {
                Force::Known => plain,
                Force::Unknown => {
                    let [a, b] = [k, l].map(|k| dot(&|j| (slopes[j * d + k], means[j])));
                    plain - a * b / by_force
                }
            }
        };
        match self.extent {
            Extent::Line { .. } => Information { xx: entry(0, 0), xy: 0.0, yy: 0.0 },
            Extent::Plane { .. } => Information { xx: entry(0, 0), xy: entry(0, 1), yy: entry(1, 1) },
        }
    }
}

/// Fisher information of a position, 1/m²; on a line only `xx`.
#[derive(Clone, Copy)]
pub(super) struct Information {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Information {
    /// Returns the standard deviation of a position, m; in two dimensions of the distance.
    ///
    /// The information is divided by `noise_variance`; the surface's prior is added.
    pub fn sd_m(self, noise_variance: f64, extent: Extent) -> f64 {
        let told = |information: f64| information / noise_variance;
        let size = |side_m: f64| 12.0 / (side_m * side_m);
        let xx = told(self.xx) + size(extent.length_m());
        let Some(width_m) = extent.width_m() else { return 1.0 / xx.sqrt() };
        let (yy, xy) = (told(self.yy) + size(width_m), told(self.xy));
        ((xx + yy) / (xx * yy - xy * xy)).sqrt()
    }
}
