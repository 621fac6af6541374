//! Gaussian-process regression of the contact's position on the features of a reading.
//!
//! The inverse method: position = f(features) + error. f is a Gaussian process; the error has a fitted variance, and
//! stands for the effect of the sensors' noise on the position. The method requires only a smooth surface. One error for the whole
//! surface is too small where the sensors are insensitive, and too large elsewhere: [`Widths`] correct the intervals by errors at held-out positions.

mod selection;
mod widths;

use selection::{Candidate, Points, Selection};
pub use widths::Widths;
pub(crate) use widths::folds_taken;

use crate::features::{FeatureKind, Features, NoFeatures};
use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::recording::TooFewPositions;
use crate::setup::Setup;
use crate::status::on_surface;
use palpate_core::{ContactEstimate, Estimate, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::normal_interval_95;
use palpate_numerics::regression::{GaussianProcess, Kernel, Regression, RegressionError, Trend};
use palpate_numerics::watch::Cancelled;

/// Gaussian-process regression of the contact's position.
///
/// ```
/// use palpate_estimators::{arrangement::Training, fit::Fit, setup::Setup, gaussian_process::GaussianProcessEstimator};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(20), 0)?;
/// let estimate = GaussianProcessEstimator::default().fit(&setup, &presses)?.locate(&presses.rows[9].reading)?;
/// assert!((estimate.contact.position.x_m - mm(190.0)).abs() < mm(2.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GaussianProcessEstimator {
    /// Features of a reading; `None` for those of [`FeatureKind::contenders`] that evidence and held-out positions favour.
    pub features: Option<FeatureKind>,
    /// Kernel: the smoothness of the position as a function of the features.
    pub kernel: Kernel,
    /// Trend: the position for readings unlike any recorded.
    pub trend: Trend,
    /// The hyperparameters are optimised on at most this many rows, drawn at random; at least 2.
    pub search_points: usize,
}

impl Default for GaussianProcessEstimator {
    fn default() -> Self {
        Self { features: None, kernel: Kernel::Matern52, trend: Trend::Constant, search_points: 500 }
    }
}

/// A recording that a Gaussian process cannot be fitted to.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GaussianProcessError {
    /// Too few positions to interpolate between.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// No channel varies.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// A regression that failed.
    #[error(transparent)]
    Regression(#[from] RegressionError),
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Least number of distinct positions, below which the position cannot be a function of the reading.
const LEAST_POSITIONS: usize = 2;

impl Fit for GaussianProcessEstimator {
    type Method = GaussianProcessLocator;
    type Error = GaussianProcessError;

    fn fit_method(&self, task: FitTask) -> Result<GaussianProcessLocator, GaussianProcessError> {
        let FitTask { setup, recording, seed, watch, .. } = task;
        recording.check_distinct_positions(LEAST_POSITIONS)?;
        let regression =
            Regression { kernel: self.kernel, trend: self.trend, search_points: self.search_points, seed };
        let extent = setup.surface().extent();
        let candidates = self.candidates(task, regression)?;
        let selection = Selection { recording, regression, extent, watch };
        let Candidate { features, hyperparameters, process } = selection.best(candidates)?;
        let process = match process {
            Some(process) => process,
            None => {
                let points = Points::new(recording, &features, extent);
                regression.condition(points.samples(), &hyperparameters, watch)?
            }
        };
        let widths = Widths::held_out(task, regression, &features, process.hyperparameters())?;
        Ok(GaussianProcessLocator { features, process, extent, force_n: setup.force_n(), widths })
    }
}

impl GaussianProcessEstimator {
    /// For each kind of features, hyperparameters from all rows, and from one row of each position where there are repeats.
    fn candidates(
        &self,
        task: FitTask,
        regression: Regression,
    ) -> Result<Vec<Candidate>, GaussianProcessError> {
        let FitTask { setup, recording, seed, watch, .. } = task;
        let extent = setup.surface().extent();
        let kinds =
            self.features.map_or_else(|| FeatureKind::contenders(setup, recording), |kind| vec![kind]);
        // With more positions than searched rows, few of the searched rows are repeats.
        let without_repeats =
            recording.one_row_a_position(seed).filter(|few| few.rows.len() < self.search_points);
        let mut candidates = Vec::with_capacity(2 * kinds.len());
        for kind in kinds {
            let features = Features::fit(kind, recording)?;
            if let Some(few) = &without_repeats {
                let points = Points::new(few, &features, extent);
                let hyperparameters = regression.hyperparameters(points.samples(), watch)?;
                candidates.push(Candidate { features: features.clone(), hyperparameters, process: None });
            }
            let points = Points::new(recording, &features, extent);
            let process = regression.fit(points.samples(), watch)?;
            let hyperparameters = process.hyperparameters().clone();
            candidates.push(Candidate { features, hyperparameters, process: Some(process) });
        }
        Ok(candidates)
    }
}

/// A Gaussian process that locates.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussianProcessLocator {
    /// Features of a reading.
    pub features: Features,
    /// The posterior of x, and of y where the surface has a width, in metres.
    pub process: GaussianProcess,
    /// The surface.
    pub extent: Extent,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
    /// Widths of the intervals, where enough positions could be held out.
    pub widths: Option<Widths>,
}

impl Locate for GaussianProcessLocator {
    type Check = NoCheck;

    /// The posterior mean, with the variance of the contact's position: that of the function and the fitted error of a single row, times the square
    /// of the factor from held-out positions.
    fn locate(&self, reading: &[f64]) -> Estimate {
        let features = self.features.apply(reading);
        let (means_m, variances_m2) = self.process.predict(&features);
        let widths = self.widths.as_ref().map(|widths| widths.multiples(&features));
        let coordinate = |j: usize| -> Option<(f64, f64)> {
            let error_m2 = self.process.noise_variance(j).unwrap_or(0.0);
            let multiple = widths.as_ref().map_or(1.0, |widths| widths[j]);
            Some((*means_m.get(j)?, multiple * (variances_m2.get(j)? + error_m2).sqrt()))
        };
        let (x_m, x_sd_m) = coordinate(0).unwrap_or_default();
        let (y_m, y_sd_m) = if self.process.outputs() > 1 { coordinate(1) } else { None }.unwrap_or_default();
        let ellipse = self.widths.as_ref().map_or(1.0, |widths| widths.ellipse);
        let uncertainty = Uncertainty {
            covariance: [ellipse * x_sd_m.powi(2), 0.0, 0.0, ellipse * y_sd_m.powi(2), 0.0, 0.0],
            x_95_m: normal_interval_95(x_m, x_sd_m),
            y_95_m: normal_interval_95(y_m, y_sd_m),
            force_95_n: None,
        };
        let position = Position { x_m, y_m };
        let contact = ContactEstimate { position, force_n: self.force_n, uncertainty: Some(uncertainty) };
        on_surface(contact, self.extent)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.features.check(setup.layout().len())?;
        let coordinates = self.process.coordinates();
        LocatorFault::check_count("coordinates of its Gaussian process", self.features.len(), coordinates)?;
        let outputs = setup.surface().extent().dimensions();
        LocatorFault::check_count("outputs", outputs, self.process.outputs())?;
        self.widths.as_ref().map_or(Ok(()), |widths| widths.check(self.features.len(), outputs))?;
        LocatorFault::check_numbers(
            "extent",
            self.extent.sides_m(),
            |size| size > 0.0,
            "finite and greater than 0",
        )?;
        LocatorFault::check_numbers("force", self.force_n, |force| force > 0.0, "finite and greater than 0")
    }
}

#[cfg(test)]
mod tests;
