//! Gaussian-process regression of the contact's position on what a reading says of it.
//!
//! The inverse way: position = f(features) + error, with f a Gaussian process and the error, whose variance is fitted,
//! standing for what the sensors' noise does to the position. It asks nothing of the surface but smoothness, and one
//! error for the whole surface is its limit: where the sensors see little, the truth is wider than it says.

use ndarray::Array2;

use crate::features::{FeatureKind, Features, NoFeatures};
use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::recording::{Fold, Recording, Row, TooFewPositions};
use crate::setup::Setup;
use crate::status::on_surface;
use crate::thinning::thinned;
use palpate_core::{ContactEstimate, Estimate, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::{GaussianProcess, Kernel, Regression, RegressionError, Samples, Trend};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{mean, normal_interval_95};

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
    /// Features of a reading; `None` for those of [`FeatureKind::contenders`] that suit best.
    pub features: Option<FeatureKind>,
    /// Kernel: the smoothness of the position as a function of the features.
    pub kernel: Kernel,
    /// Trend: what the position returns to for readings unlike any recorded.
    pub trend: Trend,
    /// The hyperparameters are found from at most this many rows, drawn at random; at least 2.
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
    /// There is nothing between which to interpolate.
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

/// Distinct positions without which a position cannot be a function of anything.
const LEAST_POSITIONS: usize = 2;

impl Fit for GaussianProcessEstimator {
    type Method = GaussianProcessLocator;
    type Error = GaussianProcessError;

    fn fit_method(&self, task: FitTask) -> Result<GaussianProcessLocator, GaussianProcessError> {
        let FitTask { setup, recording, seed, watch } = task;
        recording.check_distinct_positions(LEAST_POSITIONS)?;
        let extent = setup.surface().extent();
        let kinds =
            self.features.map_or_else(|| FeatureKind::contenders(setup, recording), |kind| vec![kind]);
        let regression =
            Regression { kernel: self.kernel, trend: self.trend, search_points: self.search_points, seed };
        // Of more positions few rows that are searched are repeats.
        let without_repeats =
            recording.one_row_a_position().filter(|firsts| firsts.rows.len() < self.search_points);
        let mut candidates = Vec::new();
        for kind in kinds {
            let features = Features::fit(kind, recording)?;
            let points = Points::new(recording.rows.iter(), &features, extent);
            let mut processes = vec![regression.fit(points.samples(), watch)?];
            if let Some(firsts) = &without_repeats {
                let firsts = Points::new(firsts.rows.iter(), &features, extent);
                let found = regression.hyperparameters(firsts.samples(), watch)?;
                processes.push(regression.condition(points.samples(), &found, watch)?);
            }
            let locators = processes.into_iter().map(|process| GaussianProcessLocator {
                features: features.clone(),
                process,
                extent,
                force_n: setup.force_n(),
            });
            candidates.extend(locators);
        }
        Judges::new(recording).best(candidates, &regression, watch)
    }
}

/// Features of rows, and where those were pressed.
struct Points {
    coordinates: Array2<f64>,
    outputs_m: Array2<f64>,
}

impl Points {
    fn new<'a>(rows: impl ExactSizeIterator<Item = &'a Row>, features: &Features, extent: Extent) -> Self {
        let mut coordinates = Array2::zeros((rows.len(), features.len()));
        let mut outputs_m = Array2::zeros((rows.len(), extent.dimensions()));
        for (i, row) in rows.enumerate() {
            coordinates.row_mut(i).iter_mut().zip(features.apply(&row.reading)).for_each(|(out, x)| *out = x);
            let position_m = [row.position.x_m, row.position.y_m];
            outputs_m.row_mut(i).iter_mut().zip(position_m).for_each(|(out, at)| *out = at);
        }
        Self { coordinates, outputs_m }
    }

    fn samples(&self) -> Samples<'_> {
        Samples { coordinates: self.coordinates.view(), outputs: self.outputs_m.view(), noise_variance: None }
    }
}

/// Presses by which features and hyperparameters are judged: each position is held out once, unless it lies beyond all that are left then, where
/// no contact is expected.
///
/// The evidence alone would be misled by repeats: it takes those of one position for as many witnesses of its value, and prefers functions that
/// are flat around each position and steep between them.
struct Judges {
    recording: Recording,
    folds: Vec<Fold>,
}

impl Judges {
    /// Presses that judge; more would cost time and change little.
    const MOST: usize = 500;
    const FOLDS: usize = 5;
    /// Errors at so few presses differ by chance; where the evidence is misled they differ by more.
    const MARGIN: f64 = 1.25;

    fn new(recording: &Recording) -> Self {
        let few: Vec<usize> = thinned(recording.rows.len(), Self::MOST).collect();
        let recording = recording.subset(&few);
        let folds = recording.folds(recording.distinct_positions().len().min(Self::FOLDS));
        let mut folds = folds.unwrap_or_default();
        for Fold { training, held_out } in &mut folds {
            let position = |i: &usize| recording.rows[*i].position;
            let is_between = |at: Position| {
                let is_reached = |along: fn(Position) -> f64| {
                    let others = || training.iter().map(|i| along(position(i)));
                    others().any(|other| other <= along(at)) && others().any(|other| other >= along(at))
                };
                is_reached(|at| at.x_m) && is_reached(|at| at.y_m)
            };
            held_out.retain(|i| is_between(position(i)));
        }
        Self { folds, recording }
    }

    /// The candidate under which the positions are most probable, unless another has a mean error at positions held out that is less by
    /// [`Self::MARGIN`].
    fn best(
        &self,
        mut candidates: Vec<GaussianProcessLocator>,
        regression: &Regression,
        watch: Watch,
    ) -> Result<GaussianProcessLocator, GaussianProcessError> {
        let by_evidence = |a: &GaussianProcessLocator, b: &GaussianProcessLocator| {
            b.process.log_evidence().total_cmp(&a.process.log_evidence())
        };
        candidates.sort_by(by_evidence);
        let mut best = (f64::INFINITY, 0);
        if candidates.len() > 1 {
            for (i, candidate) in candidates.iter().enumerate() {
                let margin = if i == 0 { 1.0 } else { Self::MARGIN };
                let score = margin * self.mean_error_m(candidate, regression, watch)?;
                if score < best.0 {
                    best = (score, i);
                }
            }
        }
        Ok(candidates.swap_remove(best.1))
    }

    fn mean_error_m(
        &self,
        candidate: &GaussianProcessLocator,
        regression: &Regression,
        watch: Watch,
    ) -> Result<f64, GaussianProcessError> {
        let GaussianProcessLocator { features, process, extent, .. } = candidate;
        let mut errors_m = Vec::with_capacity(self.recording.rows.len());
        for fold in &self.folds {
            watch.round()?;
            let row = |i: &usize| &self.recording.rows[*i];
            let points = Points::new(fold.training.iter().map(row), features, *extent);
            let process = regression.condition(points.samples(), process.hyperparameters(), watch)?;
            for row in fold.held_out.iter().map(row) {
                let (means_m, _) = process.predict(&features.apply(&row.reading));
                let at_m = [row.position.x_m, row.position.y_m];
                let square = means_m.iter().zip(at_m).map(|(mean, at)| (mean - at).powi(2)).sum::<f64>();
                errors_m.push(square.sqrt());
            }
        }
        Ok(if errors_m.is_empty() { f64::INFINITY } else { mean(errors_m) })
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
}

impl Locate for GaussianProcessLocator {
    type Check = NoCheck;

    /// The posterior mean, with the variance of the contact's position: that of the function, and the fitted error of
    /// a single row besides.
    fn locate(&self, reading: &[f64]) -> Estimate {
        let (means_m, variances_m2) = self.process.predict(&self.features.apply(reading));
        let coordinate = |j: usize| -> Option<(f64, f64)> {
            let error_m2 = self.process.noise_variance(j).unwrap_or(0.0);
            Some((*means_m.get(j)?, variances_m2.get(j)? + error_m2))
        };
        let (x_m, x_m2) = coordinate(0).unwrap_or_default();
        let (y_m, y_m2) = if self.process.outputs() > 1 { coordinate(1) } else { None }.unwrap_or_default();
        let uncertainty = Uncertainty {
            covariance: [x_m2, 0.0, 0.0, y_m2, 0.0, 0.0],
            x_95_m: normal_interval_95(x_m, x_m2.sqrt()),
            y_95_m: normal_interval_95(y_m, y_m2.sqrt()),
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
