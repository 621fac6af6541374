//! Widths of the 95 % intervals, by errors at held-out positions.
//!
//! A process has one error for the whole surface. Where sensors are insensitive the true error is larger; elsewhere the intervals are too wide, and
//! all are too wide where errors have long tails. So positions are held out. There z_j = (estimate − truth)/σ_j along coordinate j, where σ_j is the
//! standard deviation from the process. A second process models ln z_j² as a smooth function of the features, with the smoothness from its evidence;
//! w_j = exp(½·E ln z_j²) is the factor by which σ_j is off near a reading (Goldberg, Williams and Bishop, Adv. Neural Inf. Process. Syst. 10, 1998).
//! Number ⌈0.95·(n + 1)⌉ of the n values |z_j|/w_j in rising order, times w_j·σ_j, is the half-width (Papadopoulos, Gammerman and Vovk 2008).

use ndarray::Array2;
use serde::{Deserialize, Serialize};

use super::GaussianProcessError;
use super::selection::{Points, folds_between};
use crate::features::Features;
use crate::fit::{FitTask, LocatorFault};
use crate::recording::Recording;
use crate::thinning::thinned;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::{
    GaussianProcess, Hyperparameters, Kernel, Regression, RegressionError, Samples, Trend,
};
use palpate_numerics::watch::Watch;
use palpate_numerics::{ELLIPSE_95, FEWEST_FOR_95, NORMAL_95, conformal_95};

/// Factors on the standard deviations of a process, which give its intervals their coverage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Widths {
    /// ln z_j² as functions of the features.
    pub logarithms: GaussianProcess,
    /// Quantile of |z_j|/w_j over that of a normal variable, for each coordinate.
    pub factors: Vec<f64>,
    /// On a plane, quantile of the quadratic form of all coordinates, so scaled, over that of normal variables.
    pub ellipse: f64,
}

/// Errors over standard deviations, with the features of their readings.
#[derive(Default)]
struct HeldOut {
    features: Vec<Vec<f64>>,
    z: Vec<Vec<f64>>,
    positions: Vec<Position>,
}

/// Lower bound of |z| in its logarithm: that of a smaller one varies by chance alone.
const LEAST_Z: f64 = 0.1;

impl Widths {
    /// Widths by positions that a process with these features and hyperparameters is not conditioned on; `None` with fewer than [`FEWEST_FOR_95`].
    pub(super) fn held_out(
        task: FitTask,
        regression: Regression,
        features: &Features,
        hyperparameters: &Hyperparameters,
    ) -> Result<Option<Self>, GaussianProcessError> {
        let FitTask { setup, recording, seed, watch, .. } = task;
        let extent = setup.surface().extent();
        let mut held_out = HeldOut::default();
        let folds = folds_between(recording, FOLDS);
        let count = folds_taken(recording.rows.len());
        for (k, fold) in folds.iter().take(count).enumerate() {
            watch.counted("holding positions out", "folds", k, count)?;
            let points = Points::new(&recording.subset(&fold.training), features, extent);
            let process = regression.condition(points.samples(), hyperparameters, watch)?;
            held_out.judge(&process, recording, &fold.held_out, features, extent);
        }
        let searched = Regression { kernel: Kernel::Matern52, trend: Trend::Constant, seed, ..regression };
        held_out.widths(searched, watch)
    }

    /// Multiples of the standard deviation of each coordinate, about a reading with these features.
    pub(super) fn multiples(&self, features: &[f64]) -> Vec<f64> {
        let widths = local_widths(&self.logarithms, features);
        widths.into_iter().zip(&self.factors).map(|(width, factor)| factor * width).collect()
    }

    /// Checks numbers that come from a file.
    pub(super) fn check(&self, features: usize, outputs: usize) -> Result<(), LocatorFault> {
        let logarithms = &self.logarithms;
        LocatorFault::check_count(
            "coordinates of the process of its widths",
            features,
            logarithms.coordinates(),
        )?;
        LocatorFault::check_count("outputs of the process of its widths", outputs, logarithms.outputs())?;
        LocatorFault::check_count("factors of its widths", outputs, self.factors.len())?;
        let numbers = self.factors.iter().copied().chain([self.ellipse]);
        LocatorFault::check_numbers("factor of its widths", numbers, |x| x > 0.0, "finite and greater than 0")
    }
}

/// w_j about a reading with these features.
fn local_widths(logarithms: &GaussianProcess, features: &[f64]) -> Vec<f64> {
    let mut widths = vec![0.0; logarithms.outputs()];
    logarithms.mean_into(features, &mut widths, &mut logarithms.scratch());
    widths.iter_mut().for_each(|width| *width = (0.5 * *width).exp());
    widths
}

/// Folds that positions are dealt to.
const FOLDS: usize = 10;

/// Folds that are held out in turn: all where a process is fast, few where one has hundreds of presses.
pub(crate) fn folds_taken(rows: usize) -> usize {
    match rows {
        0..=1200 => FOLDS,
        1201..=3000 => 4,
        _ => 1,
    }
}

impl HeldOut {
    fn judge(
        &mut self,
        process: &GaussianProcess,
        recording: &Recording,
        held_out: &[usize],
        features: &Features,
        extent: Extent,
    ) {
        for row in held_out.iter().map(|i| &recording.rows[*i]) {
            let point = features.apply(&row.reading);
            let (means_m, variances_m2) = process.predict(&point);
            let off = extent.coordinates_m(row.position).enumerate().map(|(j, at_m)| {
                let sd_m = (variances_m2[j] + process.noise_variance(j).unwrap_or(0.0)).sqrt();
                (means_m[j] - at_m) / sd_m
            });
            self.z.push(off.collect());
            self.features.push(point);
            self.positions.push(row.position);
        }
    }

    /// Distinct positions. Errors of presses at one position are alike, so they count as one independent error.
    fn places(&self) -> Vec<Position> {
        let mut places = self.positions.clone();
        places.sort_by(Position::cmp_by_x_then_y);
        places.dedup();
        places
    }

    fn outputs(&self) -> usize {
        self.z.first().map_or(0, Vec::len)
    }

    /// The process of ln z², by some of the errors; its hyperparameters are searched where they are unknown.
    fn logarithms(
        &self,
        chosen: &[usize],
        regression: Regression,
        known: Option<&Hyperparameters>,
        watch: Watch,
    ) -> Result<GaussianProcess, RegressionError> {
        let number = |i: usize, j: usize| 2.0 * self.z[chosen[i]][j].abs().max(LEAST_Z).ln();
        let outputs = Array2::from_shape_fn((chosen.len(), self.outputs()), |(i, j)| number(i, j));
        let width = self.features.first().map_or(0, Vec::len);
        let coordinates = Array2::from_shape_fn((chosen.len(), width), |(i, k)| self.features[chosen[i]][k]);
        let samples =
            Samples { coordinates: coordinates.view(), outputs: outputs.view(), noise_variance: None };
        match known {
            Some(known) => regression.condition(samples, known, watch),
            None => regression.fit(samples, watch),
        }
    }

    fn widths(self, regression: Regression, watch: Watch) -> Result<Option<Widths>, GaussianProcessError> {
        let places = self.places();
        if places.len() < FEWEST_FOR_95 {
            return Ok(None);
        }
        let kept: Vec<usize> = thinned(self.z.len(), regression.search_points).collect();
        let logarithms = self.logarithms(&kept, regression, None, watch)?;
        let scaled = self.scaled(logarithms.hyperparameters(), &places, &kept, regression, watch)?;
        // Without any error, as of simulated readings without noise, the factors are undetermined.
        let bound = |sizes: Vec<f64>| conformal_95(sizes).filter(|size| size.is_finite() && *size > 0.0);
        let factor = |j: usize| Some(bound(scaled.iter().map(|z| z[j].abs()).collect())? / NORMAL_95);
        let factors: Option<Vec<f64>> = (0..self.outputs()).map(factor).collect();
        let Some(factors) = factors else { return Ok(None) };
        let square = |z: &Vec<f64>| z.iter().zip(&factors).map(|(z, f)| (z / f).powi(2)).sum::<f64>();
        let ellipse = match self.outputs() {
            1 => 1.0,
            _ => bound(scaled.iter().map(square).collect()).unwrap_or(ELLIPSE_95) / ELLIPSE_95,
        };
        Ok(Some(Widths { logarithms, factors, ellipse }))
    }

    /// z over widths from errors at other positions, as those of contacts in use are.
    fn scaled(
        &self,
        known: &Hyperparameters,
        places: &[Position],
        kept: &[usize],
        regression: Regression,
        watch: Watch,
    ) -> Result<Vec<Vec<f64>>, GaussianProcessError> {
        const PARTS: usize = 5;
        let part =
            |i: usize| places.partition_point(|at| at.cmp_by_x_then_y(&self.positions[i]).is_lt()) % PARTS;
        let mut scaled = Vec::with_capacity(self.z.len());
        for k in 0..PARTS {
            watch.round()?;
            let others: Vec<usize> = kept.iter().copied().filter(|i| part(*i) != k).collect();
            if others.is_empty() {
                continue;
            }
            let logarithms = self.logarithms(&others, regression, Some(known), watch)?;
            for i in (0..self.z.len()).filter(|i| part(*i) == k) {
                let widths = local_widths(&logarithms, &self.features[i]);
                scaled.push(self.z[i].iter().zip(widths).map(|(z, width)| z / width).collect());
            }
        }
        Ok(scaled)
    }
}
