//! From a recording to a locator.

use ndarray::Array2;

use super::{GaussianProcessError, GaussianProcessEstimator, GaussianProcessLocator};
use crate::features::{FeatureKind, Features};
use crate::fit::{Fit, FitTask};
use palpate_numerics::regression::{Regression, Samples};

/// Distinct positions without which a position cannot be a function of anything.
const LEAST_POSITIONS: usize = 2;

impl Fit for GaussianProcessEstimator {
    type Method = GaussianProcessLocator;
    type Error = GaussianProcessError;

    fn fit_method(&self, task: FitTask) -> Result<GaussianProcessLocator, GaussianProcessError> {
        let FitTask { setup, recording, seed, watch } = task;
        recording.check_distinct_positions(LEAST_POSITIONS)?;
        let kind = self.features.unwrap_or_else(|| FeatureKind::for_setup(setup));
        let features = Features::fit(kind, recording)?;
        let extent = setup.surface.extent();
        let rows = recording.rows.len();
        let mut coordinates = Array2::zeros((rows, features.len()));
        for (row, mut out) in recording.rows.iter().zip(coordinates.outer_iter_mut()) {
            out.iter_mut().zip(features.apply(&row.reading)).for_each(|(out, feature)| *out = feature);
        }
        let outputs = Array2::from_shape_fn((rows, extent.width_m.map_or(1, |_| 2)), |(row, j)| {
            let position = recording.rows[row].position;
            if j == 0 { position.x_m } else { position.y_m }
        });
        let samples =
            Samples { coordinates: coordinates.view(), outputs: outputs.view(), noise_variance: None };
        let regression =
            Regression { kernel: self.kernel, trend: self.trend, search_points: self.search_points, seed };
        let process = regression.fit(samples, watch)?;
        Ok(GaussianProcessLocator { features, process, extent, force_n: setup.force_n })
    }
}
