//! Common-mode errors of influence functions, which all channels learn at equal positions.
//!
//! The error of channel k is √w_k·(u_k·z + √r_k·e_k), with w_k the posterior variance and z (common) and e_k
//! (independent) standard normal. u are the loadings of the first principal component of yᵀ·P·K·P·y, scaled
//! to correlations, with A the covariance of the presses, K its part without noise and P = A⁻¹ minus the part
//! of offset and polynomials (Conti and O'Hagan, Journal of Statistical Planning and Inference 140, 2010).
//! For N independent channels with ν degrees of freedom, it has a variance of about (1 + √(N/ν))² (Johnstone,
//! Annals of Statistics 29, 2001): below, errors are independent.
//!
//! Along a line r_k = 1 − u_k². On a plane r_k = 1, as presses miss the peak beside each sensor
//! independently. For point sensors along a line, sources and cubics dominate, without common errors.

use super::evidence::{ChannelFit, Evidence};
use super::prior::Prior;
use crate::influence::calibration::CalibrationRows;
use ndarray::Array2;
use palpate_mechanics::surface::Extent;
use palpate_numerics::{NotPositiveDefinite, median};

/// Loadings u; empty without common-mode errors.
pub(super) fn loadings(
    presses: &CalibrationRows,
    prior: &Prior,
    fits: &[ChannelFit],
    sensors_m: &[Vec<f64>],
) -> Result<Vec<f64>, NotPositiveDefinite> {
    if matches!(prior.extent, Extent::Line { .. }) && prior.source.is_some() {
        return Ok(Vec::new());
    }
    let Some(ratio) = median(fits.iter().map(|fit| fit.ratio).collect()) else { return Ok(Vec::new()) };
    let restricted = Evidence::new(presses, prior, &[]).restricted(ratio)?;
    let projection = restricted.projection();
    let (mut white, _) = restricted.residuals(presses.means.clone());
    for (mut white, fit) in white.columns_mut().into_iter().zip(fits) {
        if let Some(source) = fit.most_probable_source() {
            let place = std::slice::from_ref(&sensors_m[source.place]);
            let (column, _) = restricted.residuals(prior.sources(presses, place));
            let column = column.column(0);
            let share = column.dot(&white) / column.dot(&column);
            white.scaled_add(-share, &column);
        }
    }
    let weights = projection.t().dot(&white);
    let lower = prior.covariance(presses);
    let covariance = &lower + &lower.t() - Array2::from_diag(&lower.diag());
    let products = weights.t().dot(&covariance).dot(&weights);
    let freedom = presses.len().saturating_sub(restricted.effects());
    let loadings = first_component(&products);
    Ok(if is_common(&loadings, freedom) { loadings } else { Vec::new() })
}

/// Returns whether the variance exceeds that of independent channels.
fn is_common(loadings: &[f64], freedom: usize) -> bool {
    let variance: f64 = loadings.iter().map(|loading| loading * loading).sum();
    variance > (1.0 + (loadings.len() as f64 / freedom as f64).sqrt()).powi(2)
}

/// First principal component by the power method, as channels may be hundreds.
fn first_component(products: &Array2<f64>) -> Vec<f64> {
    const ROUNDS: usize = 100;
    let n = products.nrows();
    let root = |i: usize| products[[i, i]].max(f64::MIN_POSITIVE).sqrt();
    let correlation = Array2::from_shape_fn((n, n), |(i, j)| products[[i, j]] / (root(i) * root(j)));
    // The channel of largest correlations is not orthogonal to the first component.
    let common = |i: &usize| correlation.row(*i).mapv(|value| value * value).sum();
    let Some(first) = (0..n).max_by(|a, b| common(a).total_cmp(&common(b))) else { return Vec::new() };
    let mut component = correlation.row(first).to_owned();
    let mut value = 0.0;
    for _ in 0..ROUNDS {
        component /= component.dot(&component).sqrt();
        component = correlation.dot(&component);
        value = component.dot(&component).sqrt();
    }
    component.iter().map(|loading| (loading / value.sqrt()).clamp(-1.0, 1.0)).collect()
}

/// r for given loadings.
pub(super) fn own_shares(loadings: &[f64], extent: Extent) -> Vec<f64> {
    match extent {
        Extent::Line { .. } => loadings.iter().map(|u| (1.0 - u * u).max(0.0)).collect(),
        Extent::Plane { .. } => vec![1.0; loadings.len()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn channels_that_are_multiples_of_each_other_share_all_errors() {
        let products = array![[4.0, -2.0, 0.0], [-2.0, 1.0, 0.0], [0.0, 0.0, 9.0]];
        let loadings = first_component(&products);
        assert!((loadings[0] + loadings[1]).abs() < 1e-12 && (loadings[0].abs() - 1.0).abs() < 1e-12);
        assert!(loadings[2].abs() < 1e-12, "{loadings:?}");
    }

    #[test]
    fn channels_of_noise_share_nothing() {
        const COUNT: u64 = 200;
        const CHANNELS: usize = 6;
        for freedom in [4, 8, 16] {
            let is_shared = |seed: &u64| {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(*seed);
                let noise =
                    Array2::from_shape_simple_fn((freedom, CHANNELS), || StandardNormal.sample(&mut rng));
                let loadings = first_component(&noise.t().dot(&noise));
                is_common(&loadings, freedom)
            };
            let shared = (0..COUNT).filter(is_shared).count();
            assert!(shared < 15, "{shared} of {COUNT} from {freedom} degrees of freedom");
        }
    }
}
