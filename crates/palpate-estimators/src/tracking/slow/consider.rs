//! Consider filter of drift and contacts (S. F. Schmidt, *Application of State-Space Methods to Navigation
//! Problems*, 1966).
//!
//! A drift along J = ∂h/∂θ, the derivatives of the readings by positions and forces θ of the contacts, is
//! unidentifiable. An observation of the drift has a flat prior of θ; the covariance of the drift, projected on
//! θ, is added to that of the contacts.

use super::contact_of;
use crate::likelihood::{Likelihood, Linearisation};
use crate::tracking::TrackedContact;
use ndarray::{Array1, Array2, Axis};
use palpate_mechanics::contact::Contact;
use palpate_numerics::push_rest;
use palpate_numerics::small::{Ldl, Matrix, dot, form};

/// Prior variance of θ over that of the noise.
const DIFFUSE_VARIANCE: f64 = 1e8;
/// Least independent share of a derivative.
const LEAST_INDEPENDENT: f64 = 1e-9;
/// Observations with a common calibration error, with the information of one.
const COMMON_ERROR_OBSERVATIONS: f64 = 300.0;

/// Covariance of a drift observed as the mean of `count` readings, over the noise, with θ marginalized.
pub(super) fn observation_covariance(at: Linearisation, count: f64) -> Array2<f64> {
    let channels = at.variance.len();
    let mut covariance = Array2::from_diag(&Array1::from_elem(channels, 1.0 / count));
    for (i, variance) in at.variance.iter().enumerate() {
        covariance[[i, i]] += COMMON_ERROR_OBSERVATIONS * variance;
    }
    let mut basis = Vec::new();
    at.derivatives.into_iter().for_each(|column| push_rest(&mut basis, column, LEAST_INDEPENDENT));
    for along in basis.into_iter().map(Array1::from) {
        let column = along.view().insert_axis(Axis(1));
        covariance += &(column.dot(&column.t()) * DIFFUSE_VARIANCE);
    }
    covariance
}

/// Adds the covariance of the drift, over the noise, to that of contacts.
pub(in crate::tracking) fn widen(
    covariance: &Array2<f64>,
    likelihood: &dyn Likelihood,
    tracked: &mut [TrackedContact],
) {
    let contacts: Vec<Contact> = tracked.iter().map(contact_of).collect();
    let greatest_n = likelihood.force_range().map_or(f64::INFINITY, |range| range.ends_n().1);
    let added = covariance_of_contacts(covariance, &likelihood.linearised(&contacts));
    for (k, one) in tracked.iter_mut().enumerate() {
        let of = |i: usize, j: usize| added[3 * k + i][3 * k + j];
        one.widen([of(0, 0), of(0, 1), of(1, 1), of(2, 2)], likelihood.extent(), greatest_n);
    }
}

/// A⁻¹·Jᵀ·P·J·A⁻¹ with A = JᵀJ, J = ∂h/∂θ and P the covariance of d.
fn covariance_of_contacts(covariance: &Array2<f64>, at: &Linearisation) -> Matrix<6> {
    let (mut a, mut b) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
    let mut added = [[0.0; 6]; 6];
    let columns: Vec<&[f64]> = at.derivatives.iter().map(Vec::as_slice).take(6).collect();
    for (j, right) in columns.iter().enumerate() {
        let spread: Vec<f64> = covariance
            .rows()
            .into_iter()
            .map(|row| row.iter().zip(*right).map(|(own, right)| own * right).sum())
            .collect();
        for (i, left) in columns.iter().enumerate() {
            a[i][j] = dot(left, right);
            b[i][j] = dot(left, &spread);
        }
    }
    let free = std::array::from_fn(|i| i < columns.len() && a[i][i] > 0.0);
    if let Some(factors) = Ldl::of_free(&a, free) {
        let inverse = factors.inverse();
        for i in 0..6 {
            for j in 0..6 {
                added[i][j] = form(&inverse[i], &b, &inverse[j]);
            }
        }
    }
    added
}
