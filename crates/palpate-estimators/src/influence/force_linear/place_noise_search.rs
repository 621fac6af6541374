//! Position-dependent noise by Fisher scoring.
//!
//! Let t be the share of noise in a leave-one-out error, d its square over the variance, and b the
//! derivatives of ln m by θ, relative to channel means. The restricted log-likelihood has the gradient ½·Σ
//! t·b·(d − 1) and about the information ½·Σ t·b·bᵀ (Smyth, J. R. Statist. Soc. B 51, 1989; Smyth, Huele and
//! Verbyla, Statistical Modelling 1, 2001). Repeats count with t = ν, their degrees of freedom.

use super::evidence::{ALL_DECADES, ChannelFit, Evidence};
use super::place_noise::{PlaceNoise, Shape};
use super::prior::Prior;
use super::residuals::Residuals;
use crate::influence::calibration::CalibrationRows;
use crate::influence::measured::MeasuredError;
use ndarray::{Array1, Array2};
use palpate_numerics::Cholesky;
use palpate_numerics::watch::Watch;

/// Least gain of log evidence.
const LEAST_GAIN: f64 = 10.0;
/// Least gain per parameter.
const LEAST_MORE: f64 = 3.0;

pub(super) struct PlaceNoiseSearch<'a> {
    pub presses: &'a CalibrationRows,
    pub prior: &'a Prior,
    pub sensors_m: &'a [Vec<f64>],
    pub watch: Watch<'a>,
}

struct NoiseFit {
    prior: Prior,
    fits: Vec<ChannelFit>,
    total: f64,
}

/// Gradient and information by θ.
struct Score {
    slope: Array1<f64>,
    information: Cholesky,
}

impl Score {
    fn way(&self) -> Array1<f64> {
        self.information.solve(&self.slope)
    }

    fn gain(&self) -> f64 {
        0.5 * self.slope.dot(&self.way())
    }
}

impl PlaceNoiseSearch<'_> {
    /// Noise of largest log evidence minus [`LEAST_MORE`] per parameter; `None` without a gain of
    /// [`LEAST_GAIN`] over uniform or force-dependent noise.
    pub fn found(&self) -> Result<Option<PlaceNoise>, MeasuredError> {
        const STEPS: usize = 4;
        /// Candidate steps per coordinate; below, those fitted.
        const MOST_STEPS: usize = 16;
        const BEST_STEPS: usize = 3;
        let places_m = self.presses.positions_m();
        let dimensions = self.prior.extent.dimensions();
        // Scatter with force and noise at the positions of large forces resemble each other.
        let even = Prior { scatter: 0.0, ..self.prior.clone() };
        let Some(before) = self.fitted(even, None) else { return Ok(None) };
        let scattered = if self.prior.scatter > 0.0 { self.fitted(self.prior.clone(), None) } else { None };
        let rival = scattered.map_or(before.total, |scattered| scattered.total.max(before.total));
        let residuals = Residuals::new(self.presses, &before.prior, &before.fits, self.sensors_m)?;
        let with_gain = |shape: Shape| {
            let score = self.score(&before, &residuals, &PlaceNoise::even(&places_m, shape));
            score.map(|score| (score.gain(), shape))
        };
        let smooth: Vec<Shape> =
            (1..=PlaceNoise::most_degrees(dimensions)).map(|degree| Shape::Smooth { degree }).collect();
        let gains = smooth.iter().map(|shape| with_gain(*shape)).collect::<Result<Vec<_>, _>>()?;
        let steps = PlaceNoise::steps(&places_m, MOST_STEPS).into_iter();
        let mut steps = steps.map(with_gain).collect::<Result<Vec<_>, _>>()?;
        steps.sort_by(|a, b| b.0.total_cmp(&a.0));
        steps.truncate(BEST_STEPS);
        // Large differences of variance gain more than the quadratic approximation.
        if gains.iter().chain(&steps).all(|(gain, _)| *gain < 0.5 * LEAST_GAIN) {
            return Ok(None);
        }
        let mut best: Option<(f64, PlaceNoise)> = None;
        let mut theta: Vec<f64> = Vec::new();
        for shape in smooth.into_iter().chain(steps.into_iter().map(|(_, shape)| shape)) {
            let even = PlaceNoise::even(&places_m, shape);
            let start = match shape {
                Shape::Smooth { .. } => even.with_coefficients(&places_m, &theta),
                Shape::Step { .. } => even,
            };
            let prior = Prior { noise_by_place: Some(start), ..before.prior.clone() };
            let Some(mut found) = self.fitted(prior, Some(&before.fits)) else { continue };
            for _ in 0..STEPS {
                self.watch.round()?;
                let Some(next) = self.step(&found, &places_m)? else { break };
                let gained = next.total - found.total;
                if gained > 0.0 {
                    found = next;
                }
                if gained < 0.1 {
                    break;
                }
            }
            let Some(noise) = found.prior.noise_by_place else { continue };
            if let Shape::Smooth { .. } = shape {
                theta = noise.coefficients().to_vec();
            }
            let gain = found.total - rival - LEAST_MORE * noise.shape().parameters(dimensions) as f64;
            if gain > best.as_ref().map_or(LEAST_GAIN, |(most, _)| *most) {
                best = Some((gain, noise));
            }
        }
        Ok(best.map(|(_, noise)| noise.towards_quiet()))
    }

    fn fitted(&self, prior: Prior, about: Option<&[ChannelFit]>) -> Option<NoiseFit> {
        let evidence = Evidence::new(self.presses, &prior, self.sensors_m);
        let coarse = match about {
            Some(fits) => fits.to_vec(),
            None => evidence.best_decades(ALL_DECADES)?,
        };
        let fits = evidence.refined(coarse);
        let total = fits.iter().map(|fit| fit.evidence).sum::<f64>();
        total.is_finite().then_some(NoiseFit { prior, fits, total })
    }

    fn step(&self, from: &NoiseFit, places_m: &[&[f64]]) -> Result<Option<NoiseFit>, MeasuredError> {
        const LONGEST: f64 = 1.5;
        let Some(noise) = &from.prior.noise_by_place else { return Ok(None) };
        let residuals = Residuals::new(self.presses, &from.prior, &from.fits, self.sensors_m)?;
        let way = self.score(from, &residuals, noise)?.way();
        let longest = way.iter().fold(0.0, |most: f64, step| most.max(step.abs()));
        let share = if longest > LONGEST { LONGEST / longest } else { 1.0 };
        let moved: Vec<f64> =
            noise.coefficients().iter().zip(&way).map(|(theta, step)| theta + share * step).collect();
        let noise_by_place = Some(noise.with_coefficients(places_m, &moved));
        let prior = Prior { noise_by_place, ..from.prior.clone() };
        Ok(self.fitted(prior, Some(&from.fits)))
    }

    fn score(
        &self,
        at: &NoiseFit,
        residuals: &Residuals,
        noise: &PlaceNoise,
    ) -> Result<Score, MeasuredError> {
        /// Prior precision of θ.
        const PRECISION: f64 = 0.05;
        let NoiseFit { prior, fits, .. } = at;
        let (presses, repeated) = (self.presses, &self.presses.repeats);
        let places_m = presses.positions_m();
        let slopes_of = |positions_m: &[Vec<f64>], force_n: &[f64]| {
            let mut slopes = noise.slopes(&places_m, positions_m);
            let untouched = slopes.outer_iter_mut().zip(force_n).filter(|(_, force_n)| **force_n == 0.0);
            untouched.for_each(|(mut row, _)| row.fill(0.0));
            slopes
        };
        let of_presses = slopes_of(&presses.positions_m, &presses.force_n);
        let of_repeats = slopes_of(&repeated.positions_m, &repeated.force_n);
        let terms = of_presses.ncols();
        let mut slope = Array1::from_iter(noise.coefficients().iter().map(|theta| -PRECISION * theta));
        let mut information = PRECISION * Array2::eye(terms);
        for (c, fit) in fits.iter().enumerate() {
            let errors = (0..presses.len()).map(|i| {
                let (noise_share, square) = (residuals.noise_shares[[i, c]], residuals.squares[[i, c]]);
                (
                    of_presses.row(i),
                    if square.is_finite() { noise_share.clamp(0.0, 1.0) } else { 0.0 },
                    square,
                )
            });
            let repeats = (0..repeated.degrees_of_freedom.len()).map(|i| {
                let noise = fit.noise_variance()
                    * prior.relative_noise(repeated.force_n[i], &repeated.positions_m[i]);
                let freedom = repeated.degrees_of_freedom[i];
                (of_repeats.row(i), freedom, repeated.squares[[i, c]] / (freedom * noise))
            });
            let all: Vec<_> =
                errors.chain(repeats).filter(|(_, noise_share, _)| *noise_share > 0.0).collect();
            let weight: f64 = all.iter().map(|(_, noise_share, _)| noise_share).sum();
            let square: f64 =
                all.iter().map(|(_, noise_share, square)| noise_share * square).sum::<f64>() / weight;
            if weight.is_nan() || weight <= 0.0 || square.is_nan() || square <= 0.0 {
                continue;
            }
            let mut middle = Array1::<f64>::zeros(terms);
            all.iter().for_each(|(row, noise_share, _)| middle.scaled_add(noise_share / weight, row));
            for (row, noise_share, own) in all {
                let row = &row - &middle;
                slope.scaled_add(0.5 * noise_share * (own / square - 1.0), &row);
                for k in 0..terms {
                    information.row_mut(k).scaled_add(0.5 * noise_share * row[k], &row);
                }
            }
        }
        Ok(Score { slope, information: Cholesky::factor(information)? })
    }
}
