//! Widths of 95 % intervals from held-out errors.
//!
//! For z_j = (estimate − truth)/σ_j along coordinate j, a second process models ln z_j² over the features,
//! and w_j = exp(½·E ln z_j²) (Goldberg, Williams and Bishop, Adv. Neural Inf. Process. Syst. 10, 1998). The
//! half-width is w_j·σ_j times number ⌈0.95·(n + 1)⌉ of n sorted |z_j|/w_j (Papadopoulos, Gammerman and Vovk
//! 2008).

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

/// Factors on standard deviations, for 95 % coverage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Widths {
    /// ln z_j² as functions of the features.
    pub logarithms: GaussianProcess,
    /// Conformal over normal quantile of |z_j|/w_j, by coordinate.
    pub factors: Vec<f64>,
    /// Conformal over normal quantile of the quadratic form.
    pub ellipse: f64,
}

#[derive(Default)]
struct HeldOut {
    features: Vec<Vec<f64>>,
    z: Vec<Vec<f64>>,
    positions: Vec<Position>,
}

/// Lower bound of |z|: smaller values vary by chance.
const LEAST_Z: f64 = 0.1;

impl Widths {
    /// `None` for fewer than [`FEWEST_FOR_95`] positions.
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
            held_out.add_held_out(&process, recording, &fold.held_out, features, extent);
        }
        let searched = Regression { kernel: Kernel::Matern52, trend: Trend::Constant, seed, ..regression };
        held_out.widths(searched, watch)
    }

    pub(super) fn multiples(&self, features: &[f64]) -> Vec<f64> {
        let widths = local_widths(&self.logarithms, features);
        widths.into_iter().zip(&self.factors).map(|(width, factor)| factor * width).collect()
    }

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

fn local_widths(logarithms: &GaussianProcess, features: &[f64]) -> Vec<f64> {
    let mut widths = vec![0.0; logarithms.outputs()];
    logarithms.mean_into(features, &mut widths, &mut logarithms.scratch());
    widths.iter_mut().for_each(|width| *width = (0.5 * *width).exp());
    widths
}

const FOLDS: usize = 10;

/// All for a fast process, few for hundreds of rows.
pub(crate) fn folds_taken(rows: usize) -> usize {
    match rows {
        0..=1200 => FOLDS,
        1201..=3000 => 4,
        _ => 1,
    }
}

impl HeldOut {
    fn add_held_out(
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

    /// Errors at one position are alike and count as one.
    fn places(&self) -> Vec<Position> {
        let mut places = self.positions.clone();
        places.sort_by(Position::cmp_by_x_then_y);
        places.dedup();
        places
    }

    fn outputs(&self) -> usize {
        self.z.first().map_or(0, Vec::len)
    }

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
        // Errors of 0, as of noise-free simulations, leave the factors undetermined.
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

    /// From errors at other positions, as for contacts in use.
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
