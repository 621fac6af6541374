//! Gaussian-process regression of the contact position.
//!
//! Position = f(features) + error, with one error variance. [`Widths`] correct the intervals locally.

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

/// Gaussian-process regression of the contact position.
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
    /// Features; `None` to choose among [`FeatureKind::contenders`].
    pub features: Option<FeatureKind>,
    /// Kernel over the features.
    pub kernel: Kernel,
    /// Trend far from the recording.
    pub trend: Trend,
    /// Limit of rows for the hyperparameter search; at least 2.
    pub search_points: usize,
}

impl Default for GaussianProcessEstimator {
    fn default() -> Self {
        Self { features: None, kernel: Kernel::Matern52, trend: Trend::Constant, search_points: 500 }
    }
}

/// Recording that a Gaussian process does not suit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GaussianProcessError {
    /// Too few positions.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Constant channels.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// Failed regression.
    #[error(transparent)]
    Regression(#[from] RegressionError),
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

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
    /// Candidates from all rows, and from one row per repeated position.
    fn candidates(
        &self,
        task: FitTask,
        regression: Regression,
    ) -> Result<Vec<Candidate>, GaussianProcessError> {
        let FitTask { setup, recording, seed, watch, .. } = task;
        let extent = setup.surface().extent();
        let kinds =
            self.features.map_or_else(|| FeatureKind::contenders(setup, recording), |kind| vec![kind]);
        // With more positions than search rows, few of the search rows are repeats.
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

/// Fitted Gaussian process.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussianProcessLocator {
    /// Features.
    pub features: Features,
    /// Posterior of x, and y on a plane.
    pub process: GaussianProcess,
    /// Surface.
    pub extent: Extent,
    /// Known force.
    pub force_n: Option<f64>,
    /// Interval widths, with enough held-out positions.
    pub widths: Option<Widths>,
}

impl Locate for GaussianProcessLocator {
    type Check = NoCheck;

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
