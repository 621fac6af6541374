//! Whether noise and process explain the errors at positions that were not learnt.

use std::cmp::Ordering;

use ndarray::{Axis, s};

use super::fitting::Presses;
use super::{MeasuredError, Whitening};
use palpate_numerics::regression::{GaussianProcess, Regression, Samples};
use palpate_numerics::small::Ldl;

/// Distinct positions from which on some can be held out.
const LEAST_TO_JUDGE: usize = 15;
/// The least and the greatest factor that is believed: with fewer rows to learn from, a factor below 1 says little.
const FACTORS: (f64, f64) = (1.0, 5.0);

/// By what factor position errors at positions that were not learnt exceed what noise and process say, as a deviation:
/// every fifth position is held out of the same process. `None` with too few positions to tell.
///
/// It is what the smoothness that the process found does not know of: texture that repeats itself, presses a little
/// off. For a residual r with covariance V, and the slopes J of the mean by position and nuisance coordinate, the error is
/// δ = (Jᵀ·V⁻¹·J)⁻¹·Jᵀ·V⁻¹·r, its covariance (Jᵀ·V⁻¹·J)⁻¹, and the factor the root mean square of their positions' part.
pub(super) fn misfit(
    presses: &Presses,
    regression: &Regression,
    process: &GaussianProcess,
    whitening: &Whitening,
) -> Result<Option<f64>, MeasuredError> {
    let dimensions = presses.coordinates.ncols() - usize::from(presses.has_nuisance);
    let Some(held) = held_out(presses, dimensions) else { return Ok(None) };
    let kept: Vec<usize> = (0..held.len()).filter(|i| !held[*i]).collect();
    let coordinates = presses.coordinates.select(Axis(0), &kept);
    let means = presses.means.select(Axis(0), &kept);
    let samples = Samples { coordinates: coordinates.view(), outputs: means.view(), noise_variance: None };
    let other = regression.condition(samples, process.hyperparameters())?;

    let mut known: Vec<Option<Prediction>> = vec![None; held.len()];
    let (mut square, mut count) = (0.0, 0);
    for (place, output) in presses.places.iter().zip(presses.outputs.outer_iter()) {
        if !held[*place] {
            continue;
        }
        let at = presses.coordinates.row(*place).to_vec();
        let prediction = known[*place].get_or_insert_with(|| Prediction::of(&other, &at, whitening));
        if let Some(score) = prediction.score(&output.to_vec(), whitening, dimensions) {
            square += score;
            count += dimensions;
        }
    }
    let factor = (square / count as f64).sqrt();
    Ok(factor.is_finite().then(|| factor.clamp(FACTORS.0, FACTORS.1)))
}

/// Of each press, whether its position is one of those held out: every fifth, sorted.
fn held_out(presses: &Presses, dimensions: usize) -> Option<Vec<bool>> {
    let places: Vec<Vec<f64>> =
        presses.coordinates.outer_iter().map(|at| at.slice(s![..dimensions]).to_vec()).collect();
    let order = |a: &Vec<f64>, b: &Vec<f64>| {
        a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    };
    let mut positions = places.clone();
    positions.sort_by(order);
    positions.dedup();
    if positions.len() < LEAST_TO_JUDGE {
        return None;
    }
    let index = |place: &Vec<f64>| positions.partition_point(|other| order(other, place).is_lt());
    Some(places.iter().map(|place| index(place) % 5 == 2).collect())
}

/// What the process expects somewhere, whitened.
#[derive(Clone, Debug)]
struct Prediction {
    mean: Vec<f64>,
    /// J, one column a coordinate: at most x, y and the hidden one.
    slopes: Vec<Vec<f64>>,
    /// v.
    variance: f64,
}

impl Prediction {
    fn of(process: &GaussianProcess, at: &[f64], whitening: &Whitening) -> Self {
        let (channels, d) = (process.outputs(), process.coordinates());
        let (raw, variances) = process.predict(at);
        let (mut unused, mut gradients) = (vec![0.0; channels], vec![0.0; channels * d]);
        process.mean_and_gradient_into(at, &mut unused, &mut gradients, &mut process.scratch());
        let white = |values: &[f64]| {
            let mut white = vec![0.0; channels];
            whitening.apply(values, &mut white);
            white
        };
        let slope = |k: usize| white(&gradients.iter().skip(k).step_by(d).copied().collect::<Vec<f64>>());
        let signal = process.signal_variance(0);
        let variance = if signal > 0.0 { variances[0] / signal } else { 0.0 };
        Self { mean: white(&raw), slopes: (0..d).map(slope).collect(), variance }
    }

    /// The squared standardized position error of a reading; `None` where the slopes tell no position.
    fn score(&self, output: &[f64], whitening: &Whitening, dimensions: usize) -> Option<f64> {
        let mut residual = vec![0.0; output.len()];
        whitening.apply(output, &mut residual);
        residual.iter_mut().zip(&self.mean).for_each(|(r, mean)| *r -= mean);
        let (mut information, mut score) = ([[0.0; 3]; 3], [0.0; 3]);
        for (i, slope) in self.slopes.iter().enumerate() {
            score[i] = self.product(slope, &residual, whitening);
            for (j, other) in self.slopes.iter().enumerate() {
                information[i][j] = self.product(slope, other, whitening);
            }
        }
        let factors = Ldl::of_free(&information, std::array::from_fn(|i| i < self.slopes.len()))?;
        let of_position = Ldl::of_free(&factors.inverse(), std::array::from_fn(|i| i < dimensions))?;
        let score = of_position.quadratic(factors.solve(score));
        score.is_finite().then_some(score)
    }

    /// aᵀ·V⁻¹·b, V = I + v·diag(d) + γ²·μ·μᵀ.
    fn product(&self, a: &[f64], b: &[f64], whitening: &Whitening) -> f64 {
        let diagonal = |a: &[f64], b: &[f64]| -> f64 {
            let products = a.iter().zip(b).zip(&whitening.signal);
            products.map(|((a, b), signal)| a * b / (1.0 + self.variance * signal)).sum()
        };
        let gain2 = whitening.gain * whitening.gain;
        let growth = 1.0 + gain2 * diagonal(&self.mean, &self.mean);
        diagonal(a, b) - gain2 * diagonal(a, &self.mean) * diagonal(b, &self.mean) / growth
    }
}
