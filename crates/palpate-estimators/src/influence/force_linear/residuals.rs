//! Leave-one-out residuals of presses: (P·y)_i/P_ii with variance s²/P_ii and P = Lᵀ⁻¹·M·L⁻¹ (Rasmussen and
//! Williams, eq. 5.12).

use super::evidence::{ChannelFit, Evidence};
use super::posterior::of_equal_ratio;
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
        let evidence = Evidence::new(presses, prior, &[]);
        for channels in of_equal_ratio(fits) {
            let ratio = fits[channels[0]].ratio;
            let restricted = evidence.restricted(ratio)?;
            freedom = (n - restricted.effects()) as f64;
            // (M·L⁻¹)ᵀ: squared rows sum to the diagonal of P.
            let projection = restricted.projection().t().as_standard_layout().into_owned();
            let squared: Array1<f64> = projection.outer_iter().map(|row| row.dot(&row)).collect();
            let (white, _) = restricted.residuals(presses.means.clone());
            for c in channels {
                let mut left = white.column(c).to_owned();
                let mut diagonal = squared.clone();
                if let Some(source) = fits[c].most_probable_source() {
                    let place = std::slice::from_ref(&sensors_m[source.place]);
                    let (column, _) = restricted.residuals(prior.sources(presses, place));
                    let column = column.column(0).to_owned();
                    let share = column.dot(&left) / column.dot(&column);
                    let explained = projection.dot(&column);
                    diagonal.scaled_add(-1.0 / column.dot(&column), &explained.mapv(|v| v * v));
                    left.scaled_add(-share, &column);
                }
                let errors = projection.dot(&left);
                for i in 0..n {
                    noise_shares[[i, c]] = diagonal[i] * ratio * noise[i];
                    squares[[i, c]] = errors[i].powi(2) / (diagonal[i] * fits[c].signal);
                }
            }
        }
        Ok(Self { squares, noise_shares, freedom })
    }
}
