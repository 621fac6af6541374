//! What presses say about one sensor's influence function.

use super::presses::Presses;
use super::prior::{Parts, Prior, Spread};
use ndarray::{Array1, Array2, ArrayView1};
use palpate_numerics::{Cholesky, NotPositiveDefinite};

/// Sharpens no posterior beyond what f64 can hold: variance of a reading, relative to the full-scale reading squared.
const FLOOR: f64 = 1e-18;

/// One sensor's presses, with all that does not depend on the spread worked out once.
pub(super) struct SensorPresses<'a> {
    pub prior: Prior<'a>,
    force_n: Vec<f64>,
    count: Vec<f64>,
    parts: Vec<Parts>,
    /// Mean reading less the prior's mean.
    surprise: Array1<f64>,
    /// Covariance of the remainders of every pair of presses.
    remainder: Array2<f64>,
    /// The reading's noise variance, where repeats or the rig tell it.
    noise: Option<f64>,
    /// The full-scale reading at the mean force.
    scale: f64,
    mean_force_n: f64,
}

/// The posterior of one sensor's influence function.
pub(super) struct Posterior<'s, 'a> {
    presses: &'s SensorPresses<'a>,
    spread: Spread,
    cholesky: Cholesky,
    weights: Array1<f64>,
}

impl<'a> SensorPresses<'a> {
    /// Sensor number `index` of the presses, of which those numbered `kept` are looked at; `remainder` is of all.
    pub fn new(
        prior: Prior<'a>,
        presses: &Presses,
        index: usize,
        noise: Option<f64>,
        kept: &[usize],
        remainder: &Array2<f64>,
    ) -> Self {
        let of = |j: usize| &presses.presses[kept[j]];
        let indices = 0..kept.len();
        let parts: Vec<Parts> = indices.clone().map(|j| prior.parts(of(j).position)).collect();
        let surprise = |j: usize| of(j).mean[index] - of(j).force_n * prior.mean(parts[j]);
        let mean_force_n = presses.mean_force_n();
        Self {
            force_n: indices.clone().map(|j| of(j).force_n).collect(),
            count: indices.clone().map(|j| of(j).count).collect(),
            surprise: indices.map(surprise).collect(),
            remainder: Array2::from_shape_fn((kept.len(), kept.len()), |(j, k)| {
                remainder[[kept[j], kept[k]]]
            }),
            parts,
            noise,
            scale: prior.full_scale * mean_force_n,
            mean_force_n,
            prior,
        }
    }

    /// The variance of a reading's noise.
    pub fn noise_variance(&self, spread: &Spread) -> f64 {
        let least = FLOOR * self.scale * self.scale;
        self.noise.unwrap_or((spread.noise * self.scale).powi(2)).max(least)
    }

    fn offset_variance(&self, spread: &Spread) -> f64 {
        (spread.offset * self.scale).powi(2)
    }

    /// Covariance of the mean readings of all presses.
    fn covariance(&self, spread: &Spread) -> Array2<f64> {
        let (offset, noise) = (self.offset_variance(spread), self.noise_variance(spread));
        let n = self.parts.len();
        let mut covariance = Array2::zeros((n, n));
        for j in 0..n {
            for k in 0..=j {
                let (a, b) = (self.parts[j], self.parts[k]);
                let influence = self.prior.covariance(spread, a, b, self.remainder[[j, k]]);
                covariance[[j, k]] = self.force_n[j] * self.force_n[k] * influence + offset;
            }
            covariance[[j, j]] += noise / self.count[j] + 1e-14 * covariance[[j, j]];
        }
        covariance
    }

    /// ln of the probability density of the presses, less a constant; −∞ where it cannot be computed.
    pub fn log_evidence(&self, spread: &Spread) -> f64 {
        let Ok(cholesky) = Cholesky::factor(self.covariance(spread)) else { return f64::NEG_INFINITY };
        let whitened = cholesky.solve_lower(&self.surprise);
        -0.5 * (whitened.dot(&whitened) + cholesky.log_determinant())
    }

    /// The posterior.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] when the presses' covariance cannot be factored.
    pub fn posterior(&self, spread: Spread) -> Result<Posterior<'_, 'a>, NotPositiveDefinite> {
        let cholesky = Cholesky::factor(self.covariance(&spread))?;
        let weights = cholesky.solve(&self.surprise);
        Ok(Posterior { presses: self, spread, cholesky, weights })
    }
}

impl Posterior<'_, '_> {
    /// The posterior mean of the offset.
    pub fn offset(&self) -> f64 {
        self.presses.offset_variance(&self.spread) * self.weights.sum()
    }

    /// Covariance of the influence with each press's reading, of the influence alone; `remainders` are those of the
    /// place with the presses.
    fn with_presses(&self, at: Parts, remainders: &ArrayView1<f64>) -> Array1<f64> {
        let SensorPresses { prior, parts, force_n, .. } = self.presses;
        let presses = parts.iter().zip(force_n).zip(remainders);
        let covariance = |((press, force_n), remainder): ((&Parts, &f64), &f64)| {
            force_n * prior.covariance(&self.spread, at, *press, *remainder)
        };
        presses.map(covariance).collect()
    }

    /// The posterior mean of the influence.
    pub fn mean(&self, at: Parts, remainders: &ArrayView1<f64>) -> f64 {
        self.presses.prior.mean(at) + self.with_presses(at, remainders).dot(&self.weights)
    }

    /// The posterior variance of the influence and of the offset shared over the mean force; `own` is the remainder's
    /// covariance of the place with itself.
    pub fn variance(&self, at: Parts, remainders: &ArrayView1<f64>, own: f64) -> f64 {
        let force_n = self.presses.mean_force_n;
        let offset = self.presses.offset_variance(&self.spread);
        let covariance = self.with_presses(at, remainders) + offset / force_n;
        let explained = self.cholesky.solve_lower(&covariance);
        let before = self.presses.prior.covariance(&self.spread, at, at, own);
        (before + offset / (force_n * force_n) - explained.dot(&explained)).max(0.0)
    }
}
