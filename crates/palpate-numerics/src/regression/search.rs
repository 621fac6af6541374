//! Fit of the hyperparameters.

use ndarray::Axis;

use super::evidence::Evidence;
use super::groups::Groups;
use super::lbfgs::{Stop, minimise};
use super::{GaussianProcess, Hyperparameters, Kernel, RegressionError, Samples, Trend};
use crate::random_order;
use crate::watch::{Cancelled, Watch};

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regression {
    /// Covariance function.
    pub kernel: Kernel,
    /// Mean function.
    pub trend: Trend,
    /// Points in the search, at least 2; the posterior uses all.
    pub search_points: usize,
    /// Seed of their choice.
    pub seed: u64,
}

impl Default for Regression {
    fn default() -> Self {
        Self { kernel: Kernel::Matern52, trend: Trend::Constant, search_points: 500, seed: 0 }
    }
}

const TRIAL_POINTS: usize = 160;
/// Criteria for a start, and for the best one.
const TRIAL: Stop = Stop { evaluations: 30, decrease: 0.05 };
const FINAL: Stop = Stop { evaluations: 60, decrease: 0.01 };
/// Relative length scales, and noise ratio.
const STARTS: [(f64, f64); 3] = [(1.0, 1e-2), (0.3, 1e-3), (3.0, 1e-5)];

impl Regression {
    /// Fits hyperparameters and computes the posterior.
    ///
    /// The logarithms have normal priors: standard deviation 2 for length scales, 5 for a fitted noise ratio.
    ///
    /// # Errors
    /// [`RegressionError`].
    pub fn fit(&self, samples: Samples, watch: Watch) -> Result<GaussianProcess, RegressionError> {
        let groups = Groups::new(samples)?;
        let found = self.search(&groups, watch)?;
        GaussianProcess::of_groups(&groups, self.kernel, self.trend, &found, watch)
    }

    /// Fits only the hyperparameters.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn hyperparameters(
        &self,
        samples: Samples,
        watch: Watch,
    ) -> Result<Hyperparameters, RegressionError> {
        Ok(self.search(&Groups::new(samples)?, watch)?)
    }

    /// Fits one process per output.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn fit_each(&self, samples: Samples, watch: Watch) -> Result<Vec<GaussianProcess>, RegressionError> {
        let mut processes = Vec::with_capacity(samples.outputs.ncols());
        for column in samples.outputs.axis_chunks_iter(Axis(1), 1) {
            processes.push(self.fit(Samples { outputs: column, ..samples }, watch)?);
        }
        Ok(processes)
    }

    /// Computes the posterior for given hyperparameters.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn condition(
        &self,
        samples: Samples,
        hyperparameters: &Hyperparameters,
        watch: Watch,
    ) -> Result<GaussianProcess, RegressionError> {
        let groups = Groups::new(samples)?;
        hyperparameters.check(groups.coordinates.nrows())?;
        GaussianProcess::of_groups(&groups, self.kernel, self.trend, hyperparameters, watch)
    }

    fn search(&self, groups: &Groups, watch: Watch) -> Result<Hyperparameters, Cancelled> {
        let prior = Prior::new(groups);
        let order = random_order(groups.len(), self.seed);
        let first = |count: usize| {
            let mut chosen = order[..count.min(order.len())].to_vec();
            chosen.sort_unstable();
            groups.subset(&chosen)
        };
        let search = groups.len().min(self.search_points.max(2));
        let trial = first(search.min(TRIAL_POINTS));
        let mut best = self.maximize_from(&trial, &prior, &prior.start(STARTS[0]), TRIAL, watch)?;
        for start in &STARTS[1..] {
            let found = self.maximize_from(&trial, &prior, &prior.start(*start), TRIAL, watch)?;
            if found.1 < best.1 {
                best = found;
            }
        }
        let best = self.maximize_from(&first(search), &prior, &best.0, FINAL, watch)?;
        Ok(Hyperparameters::from_logarithms(&best.0))
    }

    /// Optimum, and minus its log density.
    fn maximize_from(
        &self,
        groups: &Groups,
        prior: &Prior,
        start: &[f64],
        stop: Stop,
        watch: Watch,
    ) -> Result<(Vec<f64>, f64), Cancelled> {
        let evidence = Evidence { groups, kernel: self.kernel, trend: self.trend };
        let minimum = minimise(start, stop, |logarithms, gradient| {
            watch.round()?;
            let hyperparameters = Hyperparameters::from_logarithms(logarithms);
            let log_evidence = evidence.with_gradient(&hyperparameters, gradient);
            // No factor: infinity, so that the search steps back.
            let Some(log_evidence) = log_evidence.ok().filter(|value| value.is_finite()) else {
                return Ok(f64::INFINITY);
            };
            gradient.iter_mut().for_each(|slope| *slope = -*slope);
            Ok(prior.minus_log_density(logarithms, gradient) - log_evidence)
        })?;
        Ok((minimum.point, minimum.value))
    }
}

struct Prior {
    centre: Vec<f64>,
    deviation: Vec<f64>,
    /// ln η for s² equal to the mean square.
    known_start: Option<f64>,
}

impl Prior {
    fn new(groups: &Groups) -> Self {
        let d = groups.standard_deviations.len();
        // The distance of points in d dimensions is about √d spreads.
        let apart = (d as f64).sqrt();
        let scales = groups.standard_deviations.iter().map(|spread| (spread * apart).ln());
        let known_start = groups.noise_given.then(|| -groups.mean_square().max(f64::MIN_POSITIVE).ln());
        let (noise, deviation) = known_start.map_or((1e-3_f64.ln(), 5.0), |start| (start, 3.0));
        let centre = scales.chain([noise]).collect();
        Self { centre, deviation: [vec![2.0; d], vec![deviation]].concat(), known_start }
    }

    fn start(&self, (scale, noise): (f64, f64)) -> Vec<f64> {
        let mut start: Vec<f64> = self.centre.iter().map(|centre| centre + f64::ln(scale)).collect();
        if let Some(last) = start.last_mut() {
            *last = self.known_start.unwrap_or(noise.ln());
        }
        start
    }

    /// ½·Σ ((θ − centre)/deviation)²; adds its gradient.
    fn minus_log_density(&self, logarithms: &[f64], gradient: &mut [f64]) -> f64 {
        let mut sum = 0.0;
        for (i, theta) in logarithms.iter().enumerate() {
            let off = (theta - self.centre[i]) / self.deviation[i];
            gradient[i] += off / self.deviation[i];
            sum += 0.5 * off * off;
        }
        sum
    }
}
