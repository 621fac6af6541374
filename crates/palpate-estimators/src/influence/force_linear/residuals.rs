//! Leave-one-out residuals of presses: (P·y)_i/P_ii with variance s²/P_ii and P = Lᵀ⁻¹·M·L⁻¹ (Rasmussen and
//! Williams, eq. 5.12).
//!
//! A point sensor with amplitude variance τ·s² subtracts τ/(1 + τ·vᵀ·v)·u·uᵀ from P, with v = M·L⁻¹·g and u =
//! Lᵀ⁻¹·M·v. Places of sensors are averaged: exp(−r²/2) is the mean over the places, so that a press is an
//! outlier only if no probable place explains it.

use super::component::log_sum_exp;
use super::evidence::{ChannelFit, SourceFit};
use super::posterior::{ChannelPosterior, Conditions, Posterior, of_equal_ratio};
use super::prior::Prior;
use crate::influence::calibration::CalibrationRows;
use ndarray::{Array1, Array2};
use palpate_numerics::NotPositiveDefinite;

/// One row per press and one column per channel.
pub(super) struct Residuals {
    /// Squared residuals over their variance.
    pub squares: Array2<f64>,
    /// Share of the own noise in this variance.
    pub noise_shares: Array2<f64>,
    pub freedom: f64,
}

impl Residuals {
    pub fn new(
        presses: &CalibrationRows,
        prior: &Prior,
        fits: &[ChannelFit],
        sensors_m: &[Vec<f64>],
    ) -> Result<Self, NotPositiveDefinite> {
        let n = presses.len();
        let mut squares = Array2::<f64>::zeros((n, fits.len()));
        let mut noise_shares = squares.clone();
        let mut freedom = f64::INFINITY;
        let noise: Vec<f64> =
            (0..n).map(|i| prior.relative_noise_of(presses, i) / presses.count[i]).collect();
        for channels in of_equal_ratio(fits) {
            let conditions = Conditions::of_fits(prior, fits, &channels);
            let Posterior { solution, channels, .. } = Posterior::new(&conditions, presses, sensors_m)?;
            let restricted = &solution.restricted;
            freedom = (n - restricted.effects()) as f64;
            // (M·L⁻¹)ᵀ: squared rows sum to the diagonal of P.
            let projection = restricted.projection().t().as_standard_layout().into_owned();
            let squared: Array1<f64> = projection.outer_iter().map(|row| row.dot(&row)).collect();
            let errors = projection.dot(&solution.white);
            for ChannelPosterior { c, signal, sources } in &channels {
                let errors = errors.column(*c);
                let mut log_densities: Vec<Array1<f64>> = Vec::new();
                let mut add = |weight: f64, diagonal: &Array1<f64>, errors: &Array1<f64>| {
                    let square = |i: usize| errors[i].powi(2) / (diagonal[i] * signal);
                    log_densities.push((0..n).map(|i| weight.ln() - 0.5 * square(i)).collect());
                    for i in 0..n {
                        noise_shares[[i, *c]] += weight * diagonal[i] * solution.ratio * noise[i];
                    }
                };
                if sources.fits.is_empty() {
                    add(1.0, &squared, &errors.to_owned());
                }
                for SourceFit { place, weight, amplitude, variance } in &sources.fits {
                    let u = projection.dot(&sources.white.columns.column(*place));
                    let diagonal = &squared - &(*variance * &u * &u);
                    add(*weight, &diagonal, &(&errors - &(*amplitude * &u)));
                }
                for i in 0..n {
                    squares[[i, *c]] = -2.0 * log_sum_exp(log_densities.iter().map(|logs| logs[i]));
                }
            }
        }
        Ok(Self { squares, noise_shares, freedom })
    }
}
